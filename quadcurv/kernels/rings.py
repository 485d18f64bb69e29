"""Regular vertices of a face list by their rings: what `rows` gives on grids, and the stiffness matrix."""

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel, prefetch, wide
from quadcurv.kernels.quad import conductance, flux_scale, ring_normal, store_curvature
from quadcurv.kernels.vector import ONE, THREE, apart, cross, fused_cross, place, triple, unit

BLOCK = 64  # vertices done at once: their rings stay in the first-level cache
AHEAD = 16  # vertices: where the points of rings lie far apart, they are asked for that early
SIDE, TWICE, POINT = np.uint64(BLOCK), np.uint64(2 * BLOCK), np.uint64(3 * BLOCK)
CORNERS = np.uint64(4 * BLOCK)


@inlined
def gather_ring(points, ring, v, x, k):
    """Put vertex v and its ring, or v nine times, at place k of the planes of nine points."""
    regular = ring[v, 0] >= 0
    for j in range(9):
        i = THREE * np.uint64(ring[v, j - 1] if regular and j > 0 else v)
        place(x, np.uint64(j) * POINT + k, SIDE, triple(points, i, ONE))


@helper
def corner_normals(x, a, d, b, normals, size):
    """Normals (d - c) x (b - a) of one corner of every vertex c of a block."""
    wide()
    for k in range(np.uint64(0), size):
        place(normals, k, CORNERS, cross(apart(x, d + k, x, k, SIDE), apart(x, b + k, x, a + k, SIDE)))


@helper
def block_curvatures(x, size, normals, ring, at, liu, Hn, H, normal, area):
    """Finish the vertices of a block from the planes x of their nine points."""
    wide()
    a, d, b, e = POINT, THREE * POINT, np.uint64(5) * POINT, np.uint64(7) * POINT  # along the edges
    for j, first, last in ((0, a, d), (1, d, b), (2, b, e), (3, e, a)):
        corner_normals(x, first, first + POINT, last, normals[BLOCK * j :], size)
    for k in range(np.uint64(0), CORNERS):
        n, normals[k + THREE * CORNERS] = unit(triple(normals, k, CORNERS))
        place(normals, k, CORNERS, n)
    for k in range(np.uint64(0), size):
        u, v = apart(x, b + k, x, a + k, SIDE), apart(x, e + k, x, d + k, SIDE)
        ring_normal(ring, k, SIDE, u, v, liu, H, normal)
    for k in range(np.uint64(0), size):
        i = k + THREE * CORNERS
        lengths = (normals[i] + normals[i + SIDE]) + (normals[i + TWICE] + normals[i + POINT])
        flux_scale(ring, k, SIDE, lengths, liu, H, normal, area, at + k)
    for k in range(np.uint64(0), size):
        f = fused_cross(apart(x, d + k, x, a + k, SIDE), triple(normals, k, CORNERS))
        g = fused_cross(apart(x, b + k, x, d + k, SIDE), triple(normals, k + SIDE, CORNERS))
        h = fused_cross(apart(x, e + k, x, b + k, SIDE), triple(normals, k + TWICE, CORNERS))
        t = fused_cross(apart(x, a + k, x, e + k, SIDE), triple(normals, k + POINT, CORNERS))
        t = (f[0] + g[0]) + (h[0] + t[0]), (f[1] + g[1]) + (h[1] + t[1]), (f[2] + g[2]) + (h[2] + t[2])
        store_curvature(t, ring, k, SIDE, Hn, H, at + k)


@kernel
def ring_curvatures(points, ring, far, liu, Hn, H, normal, area, start, stop):
    """As `grid_curvatures`, of the regular vertices start..stop of a face list.

    Parameters
    ----------
    points : (3 n,) float64
    ring : (n, 8) int32
        The ring (a, d, a, d, ...) of each vertex, counter-clockwise; negative first where the vertex is not
        regular, whose results are NaN.
    far : bool
        Whether neighbours are far apart in `points`.
    liu, Hn, H, normal, area, start, stop
        As for `grid_curvatures`.
    """
    x, normals, weights = np.empty(9 * 3 * BLOCK), np.ones(16 * BLOCK), np.empty(4 * BLOCK)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            ahead = begin + k + AHEAD
            if far and ahead < stop and ring[ahead, 0] >= 0:
                for j in range(8):
                    prefetch(points, 3 * ring[ahead, j])
            gather_ring(points, ring, begin + k, x, np.uint64(k))
        block_curvatures(x, size, normals, weights, np.uint64(begin), liu, Hn, H, normal, area)


@helper
def corner_weights(x, a, d, b, own, mixed, size):
    """Planes of `conductance` of the corner (a, d, b) of each vertex of a block."""
    wide()
    for k in range(np.uint64(0), size):
        own[k], mixed[k] = conductance(apart(x, d + k, x, k, SIDE), apart(x, b + k, x, a + k, SIDE))


@helper
def stiffness_rows(own, mixed, size, row):
    """Rows of the stiffness of a block, planes of the weights of the nine points in `row`."""
    for k in range(np.uint64(0), size):
        row[k] = (own[k] + own[k + SIDE]) + (own[k + TWICE] + own[k + POINT])
        for j in range(4):
            at, before = np.uint64(j) * SIDE + k, np.uint64((j + 3) % 4) * SIDE + k
            row[np.uint64(2 * j + 1) * SIDE + k] = mixed[at] - mixed[before]
            row[np.uint64(2 * j + 2) * SIDE + k] = -own[at]


@helper
def ranks(column, size, rank):
    """Place of each of the nine columns in its row when sorted: how many are smaller."""
    for i in range(9):
        at = np.uint64(i) * SIDE
        for k in range(np.uint64(0), size):
            smaller = np.int32(0)
            for j in range(9):
                smaller += np.int32(column[np.uint64(j) * SIDE + k] < column[at + k])
            rank[at + k] = smaller


@kernel
def ring_stiffness(points, ring, indptr, indices, data, start, stop):
    """Rows start..stop of the stiffness in CSR, columns sorted, of regular vertices; others are left alone.

    Parameters
    ----------
    points, ring
        As for `ring_curvatures`.
    indptr : (n + 1,) int32
        Nine entries a row.
    indices, data : int32, float64
        Written to.
    start, stop : int
    """
    x, row = np.empty(9 * 3 * BLOCK), np.empty(9 * BLOCK)
    own, mixed = np.empty(4 * BLOCK), np.empty(4 * BLOCK)
    column, rank = np.empty(9 * BLOCK, np.int32), np.empty(9 * BLOCK, np.int32)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            gather_ring(points, ring, begin + k, x, np.uint64(k))
            column[k] = begin + k
            for j in range(8):
                column[BLOCK * (j + 1) + k] = ring[begin + k, j]
        for j in range(4):
            a, b = np.uint64(2 * j + 1) * POINT, np.uint64((2 * j + 2) % 8 + 1) * POINT
            corner_weights(x, a, a + POINT, b, own[BLOCK * j :], mixed[BLOCK * j :], size)
        stiffness_rows(own, mixed, size, row)
        ranks(column, size, rank)
        for k in range(np.uint64(0), size):
            v = begin + np.int64(k)
            if ring[v, 0] < 0:
                continue
            first = np.uint64(indptr[v])
            for j in range(9):
                at = np.uint64(j) * SIDE + k
                i = first + np.uint64(rank[at])
                indices[i], data[i] = column[at], row[at]
