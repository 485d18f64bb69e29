"""Spheres and ellipsoids under the mappings that grids come with."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.surfaces.base import (
    CIRCLE,
    HUTCHINS,
    Formula,
    Surface,
    closed_form,
    positions,
    require_positive,
)
from quadcurv.types import Floats


def _polar_cut(latitude: float) -> tuple[float, float]:
    if not 0 < latitude < np.pi / 2:
        raise ValueError(f"latitude must lie between 0 and pi/2 (the poles are excluded), got {latitude!r}")
    return -latitude, latitude


def _sphere(name: str, direction: Formula, radius: float, **attributes: Any) -> Surface:
    require_positive(radius=radius)
    return closed_form(
        name,
        lambda xi, eta: tuple(radius * x for x in direction(xi, eta)),
        mean_curvature=1 / radius,
        gaussian_curvature=1 / radius**2,
        **attributes,
    )


def _longitude_latitude(xi: Floats, eta: Floats) -> tuple[Floats, ...]:
    return (np.cos(xi) * np.cos(eta), np.sin(xi) * np.cos(eta), np.sin(eta))


def sphere(radius: float = 1.0, latitude: float = np.pi / 3) -> Surface:
    """Sphere by longitude xi and latitude eta: R (cos xi cos eta, sin xi cos eta, sin eta).

    Parameters
    ----------
    radius : float, default 1
        R > 0.
    latitude : float, default pi/3
        Where the polar caps are cut off, between 0 and pi/2. Ghost cells must not reach over a
        pole.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-latitude, latitude], wraps in xi. Oriented outward; H = 1/R,
        K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the latitude not between 0 and pi/2.

    References
    ----------
    Hutchins (2013), section 3.3.3, figures 3.10 and 3.11.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.sphere(radius=2.0)
    >>> H, K = surface.mean_curvature(0.3, 0.2), surface.gaussian_curvature(0.3, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (0.5, 0.25)
    """
    return _sphere(
        "sphere",
        _longitude_latitude,
        radius,
        domain=(CIRCLE, _polar_cut(latitude)),
        wrap=(True, False),
        reference=f"{HUTCHINS}, section 3.3.3",
    )


def _pillow(xi: Floats, eta: Floats) -> tuple[Floats, ...]:
    """Pillow mapping of the unit sphere, continued through the folds and around."""
    folded = np.abs(eta) > 1
    x = np.where(folded, -2 - xi, xi)
    y = np.where(folded, np.copysign(2, eta) - eta, eta)
    x = x - 4 * np.floor((x + 3) / 4)
    lower = x < -1
    x = np.where(lower, -2 - x, x)

    wide = np.abs(x) >= np.abs(y)
    d = np.maximum(np.abs(x), np.abs(y))
    # The circle of radius 1 through the diagonal point (D, D) with its centre on an axis, at D - q:
    # `across` is the coordinate D m/d off that axis, `along` = D - q + p the one on it.
    D = d * (2 - d) / np.sqrt(2)
    across = (2 - d) * np.minimum(np.abs(x), np.abs(y)) / np.sqrt(2)
    p, q = np.sqrt(1 - across**2), np.sqrt(1 - D**2)
    along = D + (D - across) * (D + across) / (p + q)
    # 1 - along**2 - across**2 = (p + along)(q - D) with q**2 - D**2 = (1 - d)**2 (1 + d(2 - d)):
    # no digits cancel at the equator d = 1.
    z = (1 - d) * np.sqrt((1 + d * (2 - d)) * (p + along) / (q + D))
    return (
        np.copysign(np.where(wide, along, across), x),
        np.copysign(np.where(wide, across, along), y),
        np.where(lower, -z, z),
    )


def pillow_sphere(radius: float = 1.0) -> Surface:
    """Sphere by the pillow grid mapping of Calhoun, Helzel and LeVeque.

    With d = max(|xi|, |eta|) and D = d (2 - d)/sqrt(2), the square of half-width d is mapped to
    four arcs of radius R through (+-R D, +-R D), and z = sqrt(R**2 - x**2 - y**2). xi in [-1, 1] is
    the upper hemisphere, xi in [-3, -1] the lower one, by (xi, z) -> (-2 - xi, -z).

    Parameters
    ----------
    radius : float, default 1
        R > 0.

    Returns
    -------
    Surface
        Domain [-3, 1] x [-1, 1], wraps in xi. The sides eta = +-1 are folds: (xi, +-1) is the same
        point as (-2 - xi, +-1), and beyond them, up to |eta| = 3, the mapping continues as
        (xi, eta) -> (-2 - xi, +-2 - eta). Continuous everywhere; the derivatives jump across the
        equator and the diagonals of the two squares. Oriented outward on both hemispheres;
        H = 1/R, K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    D. A. Calhoun, C. Helzel, R. J. LeVeque (2008), Logically rectangular grids and finite volume
    methods for PDEs in circular and spherical domains, SIAM Review 50(4), 723-752.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.pillow_sphere()
    >>> H, K = surface.mean_curvature(-2.5, 0.2), surface.gaussian_curvature(-2.5, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (1.0, 1.0)
    """
    return _sphere(
        "pillow_sphere",
        _pillow,
        radius,
        domain=((-3.0, 1.0), (-1.0, 1.0)),
        wrap=(True, False),
        reference="D. A. Calhoun, C. Helzel, R. J. LeVeque, Logically rectangular grids and finite "
        "volume methods for PDEs in circular and spherical domains, SIAM Review 50(4), 2008",
    )


# Axes of the panels: outward normal, direction of xi, direction of eta; right-handed.
_CUBE = np.array(
    [
        [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(0, 1, 0), (-1, 0, 0), (0, 0, 1)],
        [(-1, 0, 0), (0, -1, 0), (0, 0, 1)],
        [(0, -1, 0), (1, 0, 0), (0, 0, 1)],
        [(0, 0, 1), (0, 1, 0), (-1, 0, 0)],
        [(0, 0, -1), (0, 1, 0), (1, 0, 0)],
    ],
    dtype=np.float64,
)


def _cube(xi: Floats, eta: Floats) -> tuple[Floats, ...]:
    """Equiangular mapping of the cube to the unit sphere."""
    panel = np.floor((xi + 0.5) / 2)
    a = np.tan(np.pi / 2 * (xi - 2 * panel - 0.5))
    b = np.tan(np.pi / 2 * (eta - 0.5))
    outward, along_xi, along_eta = np.moveaxis(_CUBE[panel.astype(int) % 6], (-2, -1), (0, 1))
    length = np.sqrt(1 + a**2 + b**2)
    return tuple((n + a * u + b * v) / length for n, u, v in zip(outward, along_xi, along_eta, strict=True))


def cubed_sphere(radius: float = 1.0) -> Surface:
    """Sphere as the equiangular projection of the six sides of a cube.

    Panel p = 0, ..., 5 has xi in [2p, 2p + 1] and is R (n + a u + b v)/sqrt(1 + a**2 + b**2) with
    a = tan(pi/2 (xi - 2p - 1/2)), b = tan(pi/2 (eta - 1/2)) and the right-handed axes u, v, n of
    the cube's side: n = +x, +y, -x, -y around the equator, then +z and -z.

    Parameters
    ----------
    radius : float, default 1
        R > 0.

    Returns
    -------
    Surface
        Domain [0, 1] x [0, 1], open, panels (0, 2, 4, 6, 8, 10). Neighbouring panels share their
        edge; beyond it each continues by half its width along its own great circles. Oriented
        outward; H = 1/R, K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    C. Ronchi, R. Iacono, P. S. Paolucci (1996), The "cubed sphere": a new method for the solution
    of partial differential equations in spherical geometry, J. Comput. Phys. 124, 93-114.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.cubed_sphere()
    >>> H, K = surface.mean_curvature(0.3, 0.2), surface.gaussian_curvature(0.3, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (1.0, 1.0)
    """
    return _sphere(
        "cubed_sphere",
        _cube,
        radius,
        domain=((0.0, 1.0), (0.0, 1.0)),
        wrap=(False, False),
        reference='C. Ronchi, R. Iacono, P. S. Paolucci, The "cubed sphere": a new method for the '
        "solution of partial differential equations in spherical geometry, J. Comput. Phys. 124, "
        "1996",
        panels=(0.0, 2.0, 4.0, 6.0, 8.0, 10.0),
    )


def _scaled(name: str, unit_sphere: Surface, direction: Formula, a: float, b: float, c: float) -> Surface:
    """Ellipsoid as the image of a unit sphere under scaling."""
    require_positive(a=a, b=b, c=c)
    axes = np.array([a, b, c], dtype=np.float64)
    product = a * b * c

    def support(xi: ArrayLike, eta: ArrayLike) -> Floats:
        """Distance of the tangent plane from the centre."""
        return 1 / np.linalg.norm(unit_sphere.mapping(xi, eta) / axes, axis=-1)

    def mean_curvature(xi: ArrayLike, eta: ArrayLike) -> Floats:
        square = np.sum((axes * unit_sphere.mapping(xi, eta)) ** 2, axis=-1)
        return support(xi, eta) ** 3 * (np.sum(axes**2) - square) / (2 * product**2)

    return replace(
        unit_sphere,
        name=name,
        mapping=positions(lambda xi, eta: (a * x for a, x in zip(axes, direction(xi, eta), strict=True))),
        mean_curvature=mean_curvature,
        gaussian_curvature=lambda xi, eta: support(xi, eta) ** 4 / product**2,
        reference="R. Goldman, Curvature formulas for implicit curves and surfaces, Computer Aided "
        "Geometric Design 22, 2005",
    )


def ellipsoid(a: float = 2.0, b: float = 1.5, c: float = 1.0, latitude: float = np.pi / 3) -> Surface:
    """Ellipsoid (a cos xi cos eta, b sin xi cos eta, c sin eta), the scaled `sphere`.

    Parameters
    ----------
    a, b, c : float, default 2, 1.5, 1
        Semi-axes > 0 along x, y, z.
    latitude : float, default pi/3
        Largest |eta|, between 0 and pi/2. Ghost cells must not reach over a pole.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-latitude, latitude], wraps in xi. Oriented outward;
        H = h**3 (a**2 + b**2 + c**2 - |X|**2)/(2 (a b c)**2) and K = h**4/(a b c)**2, where
        h = (x**2/a**4 + y**2/b**4 + z**2/c**4)**(-1/2) is the distance of the tangent plane from
        the centre.

    Raises
    ------
    ValueError
        If a semi-axis is not positive and finite, or the latitude not between 0 and pi/2.

    References
    ----------
    R. Goldman (2005), Curvature formulas for implicit curves and surfaces, Computer Aided Geometric
    Design 22, 632-658.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.ellipsoid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (1.078156, 0.973362)
    """
    return _scaled("ellipsoid", sphere(latitude=latitude), _longitude_latitude, a, b, c)


def cubed_ellipsoid(a: float = 2.0, b: float = 1.5, c: float = 1.0) -> Surface:
    """Ellipsoid x**2/a**2 + y**2/b**2 + z**2/c**2 = 1 in six panels, the scaled `cubed_sphere`.

    Parameters
    ----------
    a, b, c : float, default 2, 1.5, 1
        Semi-axes > 0 along x, y, z.

    Returns
    -------
    Surface
        Domain and panels of `cubed_sphere`, orientation and curvature of `ellipsoid`.

    Raises
    ------
    ValueError
        If a semi-axis is not positive and finite.

    References
    ----------
    R. Goldman (2005), Curvature formulas for implicit curves and surfaces, Computer Aided Geometric
    Design 22, 632-658.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.cubed_ellipsoid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.949557, 0.858125)
    """
    return _scaled("cubed_ellipsoid", cubed_sphere(), _cube, a, b, c)
