"""Finite differences of the fundamental forms: the classical way on a logically Cartesian grid."""

from __future__ import annotations

from typing import Any

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

    orders = (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)
    shape, (e1, e2, normal), _ = shape_operator(*(derivative(*o).reshape(-1, 3).T for o in orders))
    cos, sin = principal(*shape)
    return Curvatures(
        *invariants(*shape), (cos * e1 + sin * e2).T, (cos * e2 - sin * e1).T, np.ascontiguousarray(normal.T)
    )


def shape_operator(X1: Floats, X2: Floats, X11: Floats, X12: Floats, X22: Floats) -> tuple[Any, Any, Any]:
    """By the derivatives (3, n) of positions.

    Returns
    -------
    a, b, c : (n,) float64
        ((a, b), (b, c)) in orthonormal tangents e1, e2.
    e1, e2, normal : (3, n) float64
    s, f, g : (n,) float64
        X1 = s e1, X2 = f e1 + g e2.
    """
    from quadcurv.kernels import vector

    with np.errstate(divide="ignore", invalid="ignore"):
        s, cross = np.sqrt(dot(X1, X1)), np.stack(vector.cross(X1, X2))
        area = np.sqrt(dot(cross, cross))
        normal, e1 = cross / area, X1 / s
        e2 = np.stack(vector.cross(normal, e1))
        f, g = dot(X2, e1), area / s
        L, M, N = (dot(X, normal) for X in (X11, X12, X22))
        h = f / s
        shape = -L / s**2, -(M - h * L) / (s * g), -(N - 2 * h * M + h * h * L) / g**2
        return shape, (e1, e2, normal), (s, f, g)


def invariants(a: Floats, b: Floats, c: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """H, K, k1 and k2 of ((a, b), (b, c))."""
    H, root = (a + c) / 2, np.hypot((a - c) / 2, b)
    return H, a * c - b * b, H + root, H - root


def principal(a: Floats, b: Floats, c: Floats) -> tuple[Floats, Floats]:
    """Cosine and sine of the direction of k1 of ((a, b), (b, c))."""
    angle = np.arctan2(b, (a - c) / 2) / 2
    return np.cos(angle), np.sin(angle)


def dot(x: Floats, y: Floats) -> Floats:
    """Of positions (3, ...)."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]
