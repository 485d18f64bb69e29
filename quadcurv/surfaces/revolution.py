"""Surfaces of revolution, and the cyclide, which is a torus inverted in a sphere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from quadcurv.surfaces.base import CIRCLE, DO_CARMO, HUTCHINS, Surface, closed_form, require_positive
from quadcurv.types import Floats


def cylinder(radius: float = 1.0, f: Callable[[Floats], Floats] | None = None) -> Surface:
    """Circular cylinder (R cos theta, R sin theta, zeta + f(theta)) with xi = theta, eta = zeta.

    Parameters
    ----------
    radius : float, default 1
        R > 0.
    f : callable, optional
        Shift of the rulings along the axis, array of angles to array of lengths; zero by default.
        It shears the grid and leaves the surface as it is.

    Returns
    -------
    Surface
        Domain [0, 2 pi] x [0, 2 pi]. Wraps in xi if f has the period 2 pi, which is tried at a few
        angles. Oriented outward; H = 1/(2R), K = 0.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    Hutchins (2013), eq. 3.36 and section 4.2.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.cylinder()
    >>> H, K = surface.mean_curvature(0.3, 0.2), surface.gaussian_curvature(0.3, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (0.5, 0.0)
    """
    require_positive(radius=radius)
    shift = f if f is not None else np.zeros_like
    angles = np.linspace(0.0, 2 * np.pi, 17)
    return closed_form(
        "cylinder",
        lambda t, zeta: (radius * np.cos(t), radius * np.sin(t), zeta + shift(t)),
        mean_curvature=0.5 / radius,
        gaussian_curvature=0.0,
        domain=((0.0, 2 * np.pi), (0.0, 2 * np.pi)),
        wrap=(bool(np.allclose(shift(angles), shift(angles + 2 * np.pi))), False),
        reference=f"{HUTCHINS}, eq. 3.36",
    )


def torus(major: float = 2.0, minor: float = 1.0) -> Surface:
    """Torus ((R + r cos eta) cos xi, (R + r cos eta) sin xi, r sin eta).

    Parameters
    ----------
    major : float, default 2
        R > r, from the axis to the centre of the tube.
    minor : float, default 1
        r > 0, radius of the tube.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-pi, pi], wraps in both. Oriented outward;
        H = (R + 2 r cos eta)/(2 r (R + r cos eta)), K = cos eta/(r (R + r cos eta)).

    Raises
    ------
    ValueError
        If a radius is not positive and finite, or the minor one not less than the major one.

    References
    ----------
    do Carmo (1976), section 3-3.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.torus()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.663176, 0.326353)
    """
    require_positive(major=major, minor=minor)
    if minor >= major:
        raise ValueError(f"minor must be less than major, got major={major!r}, minor={minor!r}")

    def axis_distance(eta: Floats) -> Floats:
        return major + minor * np.cos(eta)

    return closed_form(
        "torus",
        lambda xi, eta: (
            axis_distance(eta) * np.cos(xi),
            axis_distance(eta) * np.sin(xi),
            minor * np.sin(eta),
        ),
        mean_curvature=lambda xi, eta: (1 / minor + np.cos(eta) / axis_distance(eta)) / 2,
        gaussian_curvature=lambda xi, eta: np.cos(eta) / (minor * axis_distance(eta)),
        domain=(CIRCLE, CIRCLE),
        wrap=(True, True),
        reference=f"{DO_CARMO}, section 3-3",
    )


def hyperboloid(radius: float = 1.0, height: float = 1.0) -> Surface:
    """Hyperboloid of one sheet (a cosh eta cos xi, a cosh eta sin xi, c sinh eta).

    Parameters
    ----------
    radius : float, default 1
        a > 0, radius of the waist.
    height : float, default 1
        c > 0: (x**2 + y**2)/a**2 - z**2/c**2 = 1.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-1, 1], wraps in xi. Oriented away from the axis;
        H = c (s**2 - a**2)/(2 a s**3), K = -(c/s**2)**2, s = hypot(a sinh eta, c cosh eta).

    Raises
    ------
    ValueError
        If the radius or the height is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3 (surfaces of revolution).

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.hyperboloid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.053292, -0.786448)
    """
    require_positive(radius=radius, height=height)

    def speed(eta: Floats) -> Floats:
        return np.hypot(radius * np.sinh(eta), height * np.cosh(eta))

    def mean_curvature(xi: Floats, eta: Floats) -> Floats:
        s = speed(eta)
        return height * (s - radius) * (s + radius) / (2 * radius * s**3)

    return closed_form(
        "hyperboloid",
        lambda xi, eta: (
            radius * np.cosh(eta) * np.cos(xi),
            radius * np.cosh(eta) * np.sin(xi),
            height * np.sinh(eta),
        ),
        mean_curvature=mean_curvature,
        gaussian_curvature=lambda xi, eta: -((height / speed(eta) ** 2) ** 2),
        domain=(CIRCLE, (-1.0, 1.0)),
        wrap=(True, False),
        reference=f"{DO_CARMO}, section 3-3",
    )


def dupin_cyclide(major: float = 2.0, minor: float = 1.0, offset: float = 0.5) -> Surface:
    """Dupin's ring cyclide: a torus whose tube grows from radius d - c to d + c along an ellipse.

    With semi-axes a and b = sqrt(a**2 - c**2) of the ellipse and N = a - c cos xi cos eta, the point is
    (d (c - a cos xi cos eta) + b**2 cos xi, b sin xi (a - d cos eta), b sin eta (c cos xi - d))/N. Both
    families of parameter lines are circles and lines of curvature.

    Parameters
    ----------
    major : float, default 2
        a > d, larger semi-axis of the ellipse.
    minor : float, default 1
        d > 0, mean radius of the tube.
    offset : float, default 0.5
        c < d, how much the radius of the tube departs from d: a foci's distance from the centre of the
        ellipse. As c goes to 0 the surface becomes `torus(a, d)`.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-pi, pi], wraps in both. Oriented outward; the principal curvatures are
        1/(d - c cos xi) and cos eta/(d cos eta - a), H half their sum and K their product.

    Raises
    ------
    ValueError
        If a parameter is not positive and finite, or offset < minor < major does not hold.

    References
    ----------
    V. Chandru, D. Dutta, C. M. Hoffmann (1989), On the geometry of Dupin cyclides, The Visual Computer
    5, 277-290.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.dupin_cyclide()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.421084, -1.674421)
    """
    require_positive(major=major, minor=minor, offset=offset)
    if not offset < minor < major:
        raise ValueError(
            f"offset < minor < major must hold, got offset={offset!r}, minor={minor!r}, major={major!r}"
        )
    other = np.sqrt((major - offset) * (major + offset))

    def mapping(xi: Any, eta: Any) -> tuple[Any, ...]:
        s, t = np.cos(xi), np.cos(eta)
        denominator = major - offset * s * t
        return (
            (minor * (offset - major * s * t) + other**2 * s) / denominator,
            other * np.sin(xi) * (major - minor * t) / denominator,
            other * np.sin(eta) * (offset * s - minor) / denominator,
        )

    def tube(xi: Floats) -> Floats:
        return 1 / (minor - offset * np.cos(xi))

    def ring(eta: Floats) -> Floats:
        return np.cos(eta) / (minor * np.cos(eta) - major)

    return closed_form(
        "dupin_cyclide",
        mapping,
        mean_curvature=lambda xi, eta: (tube(xi) + ring(eta)) / 2,
        gaussian_curvature=lambda xi, eta: tube(xi) * ring(eta),
        domain=(CIRCLE, CIRCLE),
        wrap=(True, True),
        reference="V. Chandru, D. Dutta, C. M. Hoffmann, On the geometry of Dupin cyclides, The Visual "
        "Computer 5, 1989",
    )
