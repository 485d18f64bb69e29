"""The plane, paraboloids and a sheet: graphs over a square."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.surfaces.base import DO_CARMO, HUTCHINS, Surface, closed_form, require_positive
from quadcurv.types import Floats


def plane() -> Surface:
    """Plane (xi, eta, 0).

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Normal (0, 0, 1); H = K = 0.

    References
    ----------
    Hutchins (2013), section 3.3.2.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.plane()
    >>> H, K = surface.mean_curvature(0.3, 0.2), surface.gaussian_curvature(0.3, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (0.0, 0.0)
    """
    return closed_form(
        "plane",
        lambda x, y: (x, y, 0.0),
        mean_curvature=0.0,
        gaussian_curvature=0.0,
        domain=((-1.0, 1.0), (-1.0, 1.0)),
        wrap=(False, False),
        reference=f"{HUTCHINS}, section 3.3.2",
    )


def _graph(name: str, jet: Callable[[Floats, Floats], tuple[ArrayLike, ...]], half_width: float) -> Surface:
    """Graph over a square, from `jet` = z and its derivatives z_x, z_y, z_xx, z_xy, z_yy."""

    def mean_curvature(x: Floats, y: Floats) -> Floats:
        _, zx, zy, zxx, zxy, zyy = map(np.asarray, jet(x, y))
        bending = (1 + zy**2) * zxx - 2 * zx * zy * zxy + (1 + zx**2) * zyy
        return -bending / (2 * (1 + zx**2 + zy**2) ** 1.5)

    def gaussian_curvature(x: Floats, y: Floats) -> Floats:
        _, zx, zy, zxx, zxy, zyy = map(np.asarray, jet(x, y))
        return (zxx * zyy - zxy**2) / (1 + zx**2 + zy**2) ** 2

    return closed_form(
        name,
        lambda x, y: (x, y, jet(x, y)[0]),
        mean_curvature,
        gaussian_curvature,
        domain=((-half_width, half_width), (-half_width, half_width)),
        wrap=(False, False),
        reference=f"{DO_CARMO}, section 3-3, example 5",
    )


def elliptic_paraboloid(a: float = 1.0, b: float = 1.0) -> Surface:
    """Elliptic paraboloid z = x**2/a**2 + y**2/b**2 with xi = x, eta = y.

    Over a square: the grid is not orthogonal.

    Parameters
    ----------
    a, b : float, default 1
        Semi-axes > 0 of the ellipse at z = 1.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Oriented upward, into the bowl: H < 0 and K > 0, by
        H = -((1 + z_y**2) z_xx - 2 z_x z_y z_xy + (1 + z_x**2) z_yy)/(2 W**3),
        K = (z_xx z_yy - z_xy**2)/W**4, W**2 = 1 + z_x**2 + z_y**2.

    Raises
    ------
    ValueError
        If a or b is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.elliptic_paraboloid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (-0.962963, 0.790123)
    """
    require_positive(a=a, b=b)

    def jet(x: Floats, y: Floats) -> tuple[ArrayLike, ...]:
        z = (x / a) ** 2 + (y / b) ** 2
        return z, 2 * x / a**2, 2 * y / b**2, 2 / a**2, 0.0, 2 / b**2

    return _graph("elliptic_paraboloid", jet, half_width=1.0)


def hyperbolic_paraboloid(a: float = 1.0, b: float = 1.0) -> Surface:
    """Hyperbolic paraboloid z = x**2/a**2 - y**2/b**2 with xi = x, eta = y.

    Over a square: the grid is not orthogonal.

    Parameters
    ----------
    a, b : float, default 1
        Semi-axes > 0 of the hyperbolas at z = 1 and z = -1.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Oriented upward; K < 0 and H changes sign (with a = b, on
        the diagonals). Formulas as in `elliptic_paraboloid`.

    Raises
    ------
    ValueError
        If a or b is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.hyperbolic_paraboloid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.222222, -0.790123)
    """
    require_positive(a=a, b=b)

    def jet(x: Floats, y: Floats) -> tuple[ArrayLike, ...]:
        z = (x / a) ** 2 - (y / b) ** 2
        return z, 2 * x / a**2, -2 * y / b**2, 2 / a**2, 0.0, -2 / b**2

    return _graph("hyperbolic_paraboloid", jet, half_width=1.0)


def tanh_sheet(height: float = 1.0) -> Surface:
    """Hyperbolic-tangent sheet z = h tanh(x) tanh(y) with xi = x, eta = y.

    Four plateaus at z = +-h joined by steep fronts: H and K both change sign, and the grid is not
    orthogonal.

    Parameters
    ----------
    height : float, default 1
        h > 0.

    Returns
    -------
    Surface
        Domain [-2, 2] x [-2, 2], open. Oriented upward; H = 0 on both axes. Formulas as in
        `elliptic_paraboloid`.

    Raises
    ------
    ValueError
        If the height is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.tanh_sheet()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.204842, -0.338511)
    """
    require_positive(height=height)

    def jet(x: Floats, y: Floats) -> tuple[ArrayLike, ...]:
        s, t = np.tanh(x), np.tanh(y)
        ds, dt = 1 - s**2, 1 - t**2
        derivatives = s * t, ds * t, s * dt, -2 * s * ds * t, ds * dt, -2 * s * t * dt
        return tuple(height * derivative for derivative in derivatives)

    return _graph("tanh_sheet", jet, half_width=2.0)
