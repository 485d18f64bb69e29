"""Parametrised surfaces with their exact mean and Gaussian curvature.

Every factory returns a `Surface`; `SURFACES` lists the factories by name, and `Surface.from_mapping`
makes one of any mapping. Lengths are in the units of the factory's parameters, mean curvature in
1/length, Gaussian curvature in 1/length**2.
"""

from __future__ import annotations

from collections.abc import Callable

from quadcurv.surfaces.base import Surface
from quadcurv.surfaces.graphs import elliptic_paraboloid, hyperbolic_paraboloid, plane, tanh_sheet
from quadcurv.surfaces.minimal import catenoid, enneper, helicoid, henneberg
from quadcurv.surfaces.revolution import cylinder, dupin_cyclide, hyperboloid, torus
from quadcurv.surfaces.spheres import cubed_ellipsoid, cubed_sphere, ellipsoid, pillow_sphere, sphere

__all__ = [
    "SURFACES",
    "Surface",
    "as_surface",
    "catenoid",
    "cubed_ellipsoid",
    "cubed_sphere",
    "cylinder",
    "dupin_cyclide",
    "ellipsoid",
    "elliptic_paraboloid",
    "enneper",
    "helicoid",
    "henneberg",
    "hyperbolic_paraboloid",
    "hyperboloid",
    "pillow_sphere",
    "plane",
    "sphere",
    "tanh_sheet",
    "torus",
]

SURFACES: dict[str, Callable[..., Surface]] = {
    factory.__name__: factory
    for factory in (
        plane,
        cylinder,
        sphere,
        pillow_sphere,
        cubed_sphere,
        ellipsoid,
        cubed_ellipsoid,
        torus,
        dupin_cyclide,
        catenoid,
        helicoid,
        enneper,
        henneberg,
        hyperboloid,
        elliptic_paraboloid,
        hyperbolic_paraboloid,
        tanh_sheet,
    )
}


def as_surface(surface: str | Surface) -> Surface:
    """Surface by its name in `SURFACES`, with the factory's own parameters, or the one given.

    Parameters
    ----------
    surface : str or Surface

    Returns
    -------
    Surface

    Raises
    ------
    ValueError
        An unknown name; the message lists what there is.
    TypeError
        Neither a name nor a `Surface`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.surfaces.as_surface("torus").name
    'torus'
    """
    if isinstance(surface, Surface):
        return surface
    if not isinstance(surface, str):
        raise TypeError(
            f"surface: expected a name or a Surface (see Surface.from_mapping), got {type(surface).__name__}"
        )
    if surface not in SURFACES:
        raise ValueError(f"surface: {surface!r} is not one of {', '.join(SURFACES)}")
    return SURFACES[surface]()
