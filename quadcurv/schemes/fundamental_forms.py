"""Finite differences of the fundamental forms: the classical way on a logically Cartesian grid."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from quadcurv.schemes.base import Curvatures, Fit, Neighbourhoods
from quadcurv.types import Floats

# Central differences by order: weights of the value itself, its first and its second derivative.
_WEIGHTS = {
    2: np.array([(0, 1, 0), (-1 / 2, 0, 1 / 2), (1, -2, 1)]),
    4: np.array(
        [(0, 0, 1, 0, 0), (1 / 12, -2 / 3, 0, 2 / 3, -1 / 12), (-1 / 12, 4 / 3, -5 / 2, 4 / 3, -1 / 12)]
    ),
}


def fundamental_forms(order: int = 2) -> Fit:
    """Curvature from central differences of a grid's positions along its two directions.

    The positions' first differences give the first fundamental form and the normal, the second ones the
    second form. Only as good as the grid is smooth: the order is lost where its spacing jumps or at a fold.

    Parameters
    ----------
    order : {2, 4}
        Differences over 3 or 5 points. Open sides get one ghost layer of quartic, or two of quintic
        extrapolation with boundary="extrapolate"; with "nan" the outer `order` / 2 layers are NaN.

    Returns
    -------
    Fit
        For QuadGrid and StaggeredGrid, of which the cell centres alone are read; without standard errors.
        It raises a ValueError for other meshes, and where an open direction has too few
        points. Not in ``SCHEMES``, which serve every mesh.

    Raises
    ------
    ValueError
        Any other order.

    References
    ----------
    M. P. do Carmo (1976), Differential Geometry of Curves and Surfaces, sections 2-5 and 3-3.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> torus = qc.surfaces.torus()
    >>> grid, xi, eta = torus.sample((48, 32))
    >>> H = qc.mean_curvature(grid, qc.schemes.fundamental_forms(4))
    >>> bool(np.abs(H - torus.mean_curvature(xi, eta)).max() < 1e-3)
    True
    """
    if order not in _WEIGHTS:
        raise ValueError(f"order: expected one of {tuple(_WEIGHTS)}, got {order!r}")
    return Fit(
        f"fundamental_forms-{order}",
        order,
        "do Carmo 1976, sections 2-5 and 3-3",
        lambda around: _curvatures(around, order),
    )


def _curvatures(around: Neighbourhoods, order: int) -> Curvatures:
    x = around.lattice(order // 2)

    def derivative(i: int, j: int) -> Floats:
        along = sliding_window_view(x, order + 1, 0) @ _WEIGHTS[order][i]
        return sliding_window_view(along, order + 1, 1) @ _WEIGHTS[order][j]

    X1, X2 = derivative(1, 0), derivative(0, 1)
    with np.errstate(divide="ignore", invalid="ignore"):
        # Orthonormal tangents e1 = X1 / s, e2 = (X2 - f / s X1) / g.
        s = np.linalg.norm(X1, axis=-1)
        cross = np.cross(X1, X2)
        area = np.linalg.norm(cross, axis=-1)
        normal, e1 = cross / area[..., None], X1 / s[..., None]
        e2 = np.cross(normal, e1)
        f, g = _dot(X2, e1) / s, area / s
        L, M, N = (_dot(X, normal) for X in (derivative(2, 0), derivative(1, 1), derivative(0, 2)))
        a, b, c = -L / s**2, -(M - f * L) / (s * g), -(N - 2 * f * M + f * f * L) / g**2
    H, half = (a + c) / 2, (a - c) / 2
    root, angle = np.hypot(half, b), np.arctan2(b, half)[..., None] / 2
    return Curvatures(
        mean=H.ravel(),
        gaussian=(a * c - b * b).ravel(),
        k1=(H + root).ravel(),
        k2=(H - root).ravel(),
        direction1=(np.cos(angle) * e1 + np.sin(angle) * e2).reshape(-1, 3),
        direction2=(np.cos(angle) * e2 - np.sin(angle) * e1).reshape(-1, 3),
        normal=normal.reshape(-1, 3),
    )


def _dot(x: Floats, y: Floats) -> Floats:
    return np.einsum("...x,...x->...", x, y)
