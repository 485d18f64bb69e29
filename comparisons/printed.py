"""The formulas as the thesis prints them, and as kernels share them, on arrays of any kind of number.

Run on numbers that count they tell what they cost; with a slip put back, what it does.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]


def dot(a: Array, b: Array) -> Array:
    """Inner products of vectors (..., 3)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3)."""
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def printed_edge(across: Array, along: Array, slip: str = "") -> Array:
    """Edge normal times length, n_k Delta s_k of (3.26) to (3.30): 48 operations with both differences.

    across, along are t_(1), t_(2) on edges of the first kind and t_(2), t_(1) on those of the second.
    """
    if slip == "3.34":  # t^(1) where t^(2) is meant
        return np.asarray(
            printed_edge(along, across) * np.sqrt(dot(along, along) / dot(across, across))[..., None]
        )
    a11, a12, a22 = dot(across, across), dot(across, along), dot(along, along)
    det = a11 * a22 - a12 * a12
    second = a11 / det if slip == "3.29" else -a12 / det
    t = (a22 / det)[..., None] * across + second[..., None] * along
    if slip == "3.20":  # no length
        return np.asarray(t / np.sqrt(dot(t, t))[..., None])
    return np.asarray(t / np.sqrt(dot(t, t))[..., None] * np.sqrt(a22)[..., None])


def printed_curvature_normal(primal: Array, dual: Array, slip: str = "") -> Array:
    """H n of (3.34) on a grid that wraps both ways, each cell on its own.

    primal[i, j] lies between dual[i, j] and dual[i + 1, j + 1]; both are (r, c, 3).
    """
    corner = [dual, np.roll(dual, -1, 0), np.roll(dual, (-1, -1), (0, 1)), np.roll(dual, -1, 1)]
    flux = None
    for k, (step, axis) in enumerate(((1, 1), (-1, 0), (-1, 1), (1, 0))):
        across, along = np.roll(primal, step, axis) - primal, corner[(k + 1) % 4] - corner[k]
        wrong = "" if slip == "3.34" and axis == 0 else slip
        edge = printed_edge(across, along, wrong)
        flux = edge if flux is None else flux + edge
    c01, c10 = corner[1] - corner[0], corner[3] - corner[0]
    half = (corner[2] - corner[1] - corner[3] + corner[0]) / 2
    normal = cross(c01 + half, c10 + half)
    return np.asarray(flux / (2 * np.sqrt(dot(normal, normal)))[..., None])


def ring(points: Array) -> list[tuple[Array, Array, Array]]:
    """Corners (a, d, b) of the four quads around each vertex of a grid that wraps both ways."""
    around = ((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))
    moved = [np.roll(points, (-i, -j), (0, 1)) for i, j in around]
    return [(moved[k], moved[k + 1], moved[(k + 2) % 8]) for k in (0, 2, 4, 6)]


def printed_fluxes(points: Array) -> Array:
    """Sum of n_k Delta s_k (3.29) over the stencil of Figure 4.1, t_(1) = d - c and t_(2) = b - a."""
    return np.asarray(sum(printed_edge(d - points, b - a) for a, d, b in ring(points)))


def printed_liu(points: Array, divided: bool = True) -> Array:
    """H n of (4.4) to (4.7) on a vertex grid that wraps both ways, each corner on its own.

    Not divided it is the sum in (4.7) alone.
    """
    total: Any = None
    area: Any = None
    for a, d, b in ring(points):
        su = 0.5 * (b - points) + 0.5 * (d - a)
        sv = 0.5 * (a - points) + 0.5 * (d - b)
        uu, vv, uv = dot(su, su), dot(sv, sv), dot(su, sv)
        aj = np.sqrt(vv * uu - uv * uv)
        alpha, beta = (uu - vv) / (4 * aj), (vv - uu) / (4 * aj)
        gamma = dot(su - sv, su - sv) / (4 * aj)
        term = (
            alpha[..., None] * (a - points) + beta[..., None] * (b - points) + gamma[..., None] * (d - points)
        )
        total, area = (term, aj) if total is None else (total + term, area + aj)
    return np.asarray((2 / area)[..., None] * total if divided else total)


def diamond_flux(u: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Normal n = u x v, |n|, 1/|n| and the flux v x n / |n| across the edge v."""
    n = cross(u, v)
    length = np.sqrt(dot(n, n))
    scale = 1 / length
    return n, length, scale, scale[..., None] * cross(v, n)


def shared_curvature_normal(points: Array, area: str = "finite_volume") -> Array:
    """H n on a vertex grid that wraps both ways, as the kernels share it: each quad once.

    Operations a vertex: diagonals u, v 6; n = u x v 9; |n| 6; 1/|n| 1; two fluxes 24; their sum 9; then
    the finite-volume area 21 and the division 4, together 80; or Liu's area 2 and the division 4, 61.
    """
    i, j, k = np.roll(points, -1, 0), np.roll(points, (-1, -1), (0, 1)), np.roll(points, -1, 1)
    u, v = j - points, k - i
    n, length, scale, g = diamond_flux(u, v)
    e = scale[..., None] * cross(n, u)
    flux = g + np.roll(e, 1, 0) - np.roll(g, (1, 1), (0, 1)) - np.roll(e, 1, 1)
    if area == "liu":
        rows = length + np.roll(length, 1, 0)
        return np.asarray((2 / (rows + np.roll(rows, 1, 1)))[..., None] * flux)
    ring = cross(i - np.roll(points, 1, 0), k - np.roll(points, 1, 1))
    return np.asarray((1 / np.sqrt(dot(ring, ring)))[..., None] * flux)


def staggered_curvature_normal(primal: Array, dual: Array) -> Array:
    """H n on a primal/dual grid that wraps both ways, each edge once.

    Operations a cell: two edges of 34, their sum 9, the area 21 and the division 4, together 102.
    """
    up, left, across = np.roll(dual, -1, 0), np.roll(dual, -1, 1), np.roll(dual, (-1, -1), (0, 1))
    first = diamond_flux(primal - np.roll(primal, 1, 0), left - dual)[-1]
    second = diamond_flux(primal - np.roll(primal, 1, 1), dual - up)[-1]
    flux = np.roll(first, -1, 0) - first + np.roll(second, -1, 1) - second
    cell = cross(across - dual, left - up)
    return np.asarray((1 / np.sqrt(dot(cell, cell)))[..., None] * flux)


class Counted(float):
    """A float that counts the operations it takes part in; a change of sign is none."""

    count = 0

    def sqrt(self) -> Counted:
        """Square root, which numpy.sqrt calls."""
        Counted.count += 1
        return Counted(np.sqrt(float(self)))

    def __neg__(self) -> Counted:
        return Counted(-float(self))


def _counting(operation: Callable[[float, float], float], swapped: bool = False) -> Any:
    def counted(self: Counted, other: float) -> Counted:
        Counted.count += 1
        a, b = float(self), float(other)
        return Counted(operation(b, a) if swapped else operation(a, b))

    return counted


for _name in ("add", "sub", "mul", "truediv"):
    setattr(Counted, f"__{_name}__", _counting(getattr(operator, _name)))
    setattr(Counted, f"__r{_name}__", _counting(getattr(operator, _name), swapped=True))


def operations(formula: Callable[..., Array], *points: Array) -> float:
    """Floating-point operations (sums, products, divisions, roots) a point of the grid."""
    counted = [np.vectorize(Counted, otypes=[object])(p) for p in points]
    Counted.count = 0
    formula(*counted)
    return Counted.count / points[0][..., 0].size


def cylinder_edge(radius: float, theta: float, h: float, dz: float) -> dict[str, float]:
    """The edge of section 3.3.1, from theta to theta + h with dz along the axis, and what is printed of it.

    Returns
    -------
    dict
        By equation, what the printed text gives over what it should.
    """
    s, half = np.sin(theta + h / 2), np.sin(h / 2)
    first = np.array([-2 * radius * s * half, 2 * radius * np.cos(theta + h / 2) * half, dz])
    second = np.array([0.0, 0.0, 1.0])
    metric = np.linalg.inv([[first @ first, first @ second], [first @ second, 1.0]])
    dual = metric[1, 0] * first + metric[1, 1] * second  # t^(2) of (3.5)
    root = np.sqrt(dz**2 + 4 * radius**2 * half**2)
    return {
        # along theta zeta stays, Z = zeta + f(theta) does not
        "3.37": 0.0 / dz,
        "3.49": -dz * s / (2 * radius * half) / dual[0],
        "3.51": (-(dz**2) / (4 * radius**2 * half)) / (metric[1, 0] * dz),
        "3.51, the sum": (-(dz**2) / (4 * radius**2 * half) + 1 + dz**2 / (4 * radius**2 * half)) / dual[2],
        "3.59": dz * np.cos(theta + h / 2) / root / (dual[1] / np.linalg.norm(dual)),
    }
