"""The linear element on triangles, from coordinates: the cotan formula.

Vectors are (3, ...) here, coordinates first and faces last, so that numpy works on long rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from quadcurv.polygons import cut
from quadcurv.types import Floats

# Squares of the differences along the edge across from each corner: cotan matrices are sums of these.
EDGES = np.array(
    [
        [(0, 0, 0), (0, 1, -1), (0, -1, 1)],
        [(1, 0, -1), (0, 0, 0), (-1, 0, 1)],
        [(1, -1, 0), (-1, 1, 0), (0, 0, 0)],
    ],
    float,
)


def linear(x: Floats, coarse: float) -> tuple[Floats, Floats]:
    """Cotan matrices (m, 3, 3) of triangles (m, 3, 3), and a third of their areas at each corner (m, 3)."""
    weights, double = half_cotans(x.transpose(1, 2, 0), squared_distance(x), coarse)
    return np.tensordot(weights, EDGES, ((0,), (0,))), thirds(weights, double).T


def thirds(weights: Floats, double: Floats) -> Floats:
    """A third of the areas (3, ...) of triangles, as `voronoi`."""
    return np.broadcast_to(double / 6, weights.shape)


def cut_up(
    x: Floats, coarse: float, areas: Callable[[Floats, Floats], Floats] = thirds
) -> tuple[Floats, Floats]:
    """As `linear`, of polygons (m, k, 3) that are cut into triangles, `areas` giving the parts of each."""
    m, k, _ = x.shape
    triangles, polygon = cut(x.reshape(-1, 3), np.arange(0, m * k + 1, k), np.arange(m * k, dtype=np.int32))
    corners = x.reshape(-1, 3)[triangles].transpose(1, 2, 0)
    weights, double = half_cotans(corners, squared_distance(x)[polygon], coarse)
    matrices, parts, slots = np.zeros((m, k, k)), np.zeros((m, k)), triangles % k
    where = polygon[:, None, None], slots[:, :, None], slots[:, None]
    np.add.at(matrices, where, np.tensordot(weights, EDGES, ((0,), (0,))))
    np.add.at(parts, (polygon[:, None], slots), areas(weights, double).T)
    return matrices, parts


def half_cotans(corners: Iterable[Floats], far: Floats, coarse: float) -> tuple[Floats, Floats]:
    """Halves of the cotans (3, ...) at corners of triangles, and twice their areas (...), NaN without area.

    Each of the three corners is (3, ...), `far` the squared distance from the origin of what they belong to.
    """
    a, b, c = corners
    across_a, across_b, across_c = c - b, a - c, b - a
    aa, bb, cc = (dot(edge, edge) for edge in (across_a, across_b, across_c))
    # Area between the two shortest edges: of a needle nothing cancels.
    one = np.where(aa >= np.maximum(bb, cc), across_b, across_a)
    other = np.where(cc > np.maximum(aa, bb), across_b, across_c)
    double = length(cross(one, other), aa + bb + cc, far, coarse)
    products = dot(across_b, across_c), dot(across_c, across_a), dot(across_a, across_b)
    return np.stack(products) / (-2 * double), double


def voronoi(weights: Floats, double: Floats) -> Floats:
    """Mixed Voronoi areas (3, ...) of triangles (Meyer et al. 2003, section 3.3) from their half cotans."""
    before, after = np.roll(weights, 1, axis=0), np.roll(weights, -1, axis=0)
    across = weights * (before + after)  # a square less edge's weight times its square, over half the area
    acute = (np.roll(across, 1, axis=0) + np.roll(across, -1, axis=0)) * (double / 2)
    obtuse = np.where(weights < 0, double / 4, double / 8)
    return np.where((weights < 0).any(axis=0), obtuse, acute)


def squared_distance(x: Floats) -> Floats:
    """Squared distance from the origin (m,) of faces (m, k, 3): it says how far their corners are rounded.

    Of their middle, which is the same wherever they begin.
    """
    middle = x.mean(axis=1)
    return np.einsum("mx,mx->m", middle, middle)


def length(product: Floats, edges: Floats, far: Floats, coarse: float) -> Floats:
    """Length (...) of cross products (3, ...), NaN where these are zero but for rounding.

    `edges` is the sum of the squares of the factors, `far` the squared distance from the origin; for `coarse`
    see `kernels.vector.rounding`.
    """
    from quadcurv.kernels import vector

    square = dot(product, product)
    return np.where(square > coarse * vector.rounding(edges, far), np.sqrt(square), np.nan)


def dot(a: Floats, b: Floats) -> Floats:
    """Inner products (...) of vectors (3, ...)."""
    return np.einsum("x...,x...->...", a, b)


def cross(a: Floats, b: Floats) -> Floats:
    """Cross products (3, ...) of vectors (3, ...)."""
    return np.stack([a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)])
