"""Regular vertices of a face list by their rings: what `rows` gives on grids, and the stiffness matrix.

A block of vertices is done at once. Planes `x` hold their nine points, the vertices themselves and then
their rings (a, d, a, d, ...); the k-th corner of a vertex is (a, d, a) from the (2 k + 1)-th point on.
"""

import numpy as np

from quadcurv.kernels.compiled import kernel
from quadcurv.kernels.formulas import formula, prefetch, span, where
from quadcurv.kernels.quad import (
    conductance,
    quads_area,
    quads_scale,
    ring_area,
    ring_scale,
)
from quadcurv.kernels.vector import (
    apart,
    cross,
    dot,
    fused_cross,
    known_ring_square,
    known_square,
    less,
    middle,
    place,
    plus,
    times,
    triple,
    unit,
)

BLOCK = 64  # vertices done at once: their rings stay in the first-level cache
AHEAD = 16  # vertices: where the points of rings lie far apart, they are asked for that early
POINT = 3 * BLOCK  # between points
CORNERS = 4 * BLOCK  # between planes of what there is of every corner
# In `work`: normals of corners, their lengths and squares; normals of rings; what sums of fluxes are
# multiplied by; dual areas.
LENGTH, SQUARE, RING, SCALE, AREA = (k * BLOCK for k in (12, 16, 20, 23, 24))
# For the stiffness: weights of the nine points; `conductance` of corners.
OWN, MIXED = 9 * BLOCK, 13 * BLOCK


def edge(k):
    """Place of the k-th neighbour along an edge."""
    return (2 * (k % 4) + 1) * POINT


@formula
def gather_ring(points, ring, v, x, k):
    """Put vertex v and its ring, or v nine times if it has none, at place k of the planes."""
    regular = ring[8 * v] >= 0
    for j in range(9):
        i = v if j == 0 else where(regular, ring[8 * v + j - 1], v)
        place(x, j * POINT + k, BLOCK, triple(points, 3 * i, 1))


@formula
def ask_ring(points, ring, v):
    """Ask for the memory of the ring of vertex v."""
    for j in range(8):
        prefetch(points, 3 * ring[8 * v + j])


@formula
def corner_normals(x, work, coarse):
    """Normals (d - c) x (b - a) of the corners of every vertex c of a block."""
    for k in span(0, BLOCK):
        c = triple(x, k, BLOCK)
        around = [triple(x, edge(corner) + k, BLOCK) for corner in range(4)]
        for corner in range(4):
            u = less(triple(x, edge(corner) + POINT + k, BLOCK), c)
            v = less(around[corner - 3], around[corner])
            n, i = cross(u, v), corner * BLOCK + k
            place(work, i, CORNERS, n)
            d = triple(x, edge(corner) + POINT + k, BLOCK)
            point = middle(c, d, around[corner], around[corner - 3])
            work[SQUARE + i] = known_square(n, u, v, point, coarse)


@formula
def corner_units(work):
    """Make normals of corners of length one."""
    for k in span(0, CORNERS, 4):
        n, length = unit(triple(work, k, CORNERS), work[SQUARE + k])
        place(work, k, CORNERS, n)
        work[LENGTH + k] = length


@formula
def ring_normals(x, work, coarse):
    """Unit normals of rings, and the finite-volume scheme's scales and areas."""
    for k in span(0, BLOCK, 2):
        u, v = apart(x, edge(2) + k, x, edge(0) + k, BLOCK), apart(x, edge(3) + k, x, edge(1) + k, BLOCK)
        n = cross(u, v)
        around = [triple(x, edge(corner) + k, BLOCK) for corner in range(4)]
        square = known_ring_square(n, around, triple(x, k, BLOCK), coarse)
        work[SCALE + k] = scale = ring_scale(square)
        work[AREA + k] = ring_area(square)
        place(work, RING + k, BLOCK, times(n, scale))


@formula
def liu_scales(work):
    """Scales and areas from the lengths of the corners' normals instead."""
    for k in span(0, BLOCK):
        i = LENGTH + k
        lengths = (work[i] + work[i + BLOCK]) + (work[i + 2 * BLOCK] + work[i + 3 * BLOCK])
        work[SCALE + k] = quads_scale(lengths)
        work[AREA + k] = quads_area(lengths)


def sums(x, work, size):
    """Curvature normals: at corner (a, d, b) the flux is (b - a) x n, n the quad's normal."""
    for k in span(0, size):
        first, second, third, fourth = (
            fused_cross(
                apart(x, edge(corner + 1) + k, x, edge(corner) + k, BLOCK),
                triple(work, corner * BLOCK + k, CORNERS),
            )
            for corner in range(4)
        )
        yield k, times(plus(plus(first, second), plus(third, fourth)), work[SCALE + k])


@formula
def block_vectors(x, work, Hn, at, size):
    """Write the curvature normals of a block from vertex number `at` on."""
    for k, h in sums(x, work, size):
        place(Hn, 3 * (at + k), 1, h)


@formula
def block_curvatures(x, work, H, at, size):
    """Write the curvatures of a block from vertex number `at` on."""
    for k, h in sums(x, work, size):
        H[at + k] = -dot(h, triple(work, RING + k, BLOCK))


@formula
def unit_normals(work, normal, at, size):
    """Write normals."""
    for k in span(0, size):
        place(normal, 3 * (at + k), 1, triple(work, RING + k, BLOCK))


@formula
def dual_areas(work, area, at, size):
    """Write dual areas."""
    for k in span(0, size):
        area[at + k] = work[AREA + k]


@kernel
def _pass(points, ring, far, coarse, liu, Hn, H, normal, area, start, stop, x, work):
    vectors, numbers, normals, areas = Hn.size > 0, H.size > 0, normal.size > 0, area.size > 0
    for at in range(start, stop, BLOCK):
        size = min(BLOCK, stop - at)
        for k in range(size):
            if far and at + k + AHEAD < stop:
                ask_ring(points, ring, at + k + AHEAD)
            gather_ring(points, ring, at + k, x, k)
        corner_normals(x, work, coarse)
        corner_units(work)
        if not liu or numbers or normals:
            ring_normals(x, work, coarse)
        if liu:
            liu_scales(work)
        if vectors:
            block_vectors(x, work, Hn, at, size)
        if numbers:
            block_curvatures(x, work, H, at, size)
        if normals:
            unit_normals(work, normal, at, size)
        if areas:
            dual_areas(work, area, at, size)


def ring_curvatures(points, ring, far, coarse, liu, Hn, H, normal, area, start, stop):
    """As `grid_curvatures`, of the regular vertices start..stop of a face list.

    Parameters
    ----------
    points : (3 n,) float64
    ring : (8 n,) int32
        The ring (a, d, a, d, ...) of each vertex, counter-clockwise; negative first where the vertex is not
        regular, whose results are NaN.
    far : bool
        Whether neighbours are far apart in `points`.
    coarse, liu, Hn, H, normal, area, start, stop
        As for `grid_curvatures`.
    """
    x, work = np.zeros(27 * BLOCK), np.zeros(25 * BLOCK)
    _pass(points, ring, far, coarse, liu, Hn, H, normal, area, start, stop, x, work)


@formula
def corner_weights(x, work, corner, a, b, coarse):
    """`conductance` of one corner of every vertex of a block."""
    for k in span(0, BLOCK):
        corners = [triple(x, i + k, BLOCK) for i in (0, a + POINT, a, b)]
        u, v = less(corners[1], corners[0]), less(corners[3], corners[2])
        own, mixed = conductance(u, v, middle(*corners), coarse)
        work[OWN + corner * BLOCK + k], work[MIXED + corner * BLOCK + k] = own, mixed


@formula
def stiffness_rows(work):
    """Weights of the nine points in the rows of a block."""
    for k in span(0, BLOCK):
        own = [work[OWN + corner * BLOCK + k] for corner in range(4)]
        mixed = [work[MIXED + corner * BLOCK + k] for corner in range(4)]
        work[k] = (own[0] + own[1]) + (own[2] + own[3])
        for corner in range(4):
            work[(2 * corner + 1) * BLOCK + k] = mixed[corner] - mixed[corner - 1]
            work[(2 * corner + 2) * BLOCK + k] = -own[corner]


@formula
def ranks(column, rank):
    """Place of each of the nine columns in its row when sorted: how many are smaller."""
    for k in span(0, BLOCK):
        for i in range(9):
            smaller = 0
            for j in range(9):
                smaller = smaller + where(column[j * BLOCK + k] < column[i * BLOCK + k], 1, 0)
            rank[i * BLOCK + k] = smaller


@formula
def gather_columns(ring, v, column, k):
    """Put the columns of row v at place k."""
    for j in range(9):
        column[j * BLOCK + k] = v if j == 0 else ring[8 * v + j - 1]


@formula
def store_row(work, column, rank, first, indices, data, k):
    """Write the k-th row of a block in the order of its columns, from entry `first` on."""
    for j in range(9):
        i = j * BLOCK + k
        indices[first + rank[i]] = column[i]
        data[first + rank[i]] = work[i]


@kernel
def _rows(points, ring, coarse, indptr, indices, data, start, stop, x, work, column, rank):
    for at in range(start, stop, BLOCK):
        size = min(BLOCK, stop - at)
        for k in range(size):
            gather_ring(points, ring, at + k, x, k)
            gather_columns(ring, at + k, column, k)
        for corner in range(4):
            a, b = (2 * corner + 1) * POINT, ((2 * corner + 2) % 8 + 1) * POINT
            corner_weights(x, work, corner, a, b, coarse)
        stiffness_rows(work)
        ranks(column, rank)
        for k in range(size):
            if ring[8 * (at + k)] >= 0:
                store_row(work, column, rank, indptr[at + k], indices, data, k)


def ring_stiffness(points, ring, coarse, indptr, indices, data, start, stop):
    """Rows start..stop of the stiffness in CSR, columns sorted, of regular vertices; others are left alone.

    Parameters
    ----------
    points, ring, coarse
        As for `ring_curvatures`.
    indptr : (n + 1,) int32
        Nine entries a row.
    indices, data : int32, float64
        Written to.
    start, stop : int
    """
    column, rank = np.zeros((2, 9 * BLOCK), np.int32)
    x, work = np.zeros(27 * BLOCK), np.zeros(17 * BLOCK)
    _rows(points, ring, coarse, indptr, indices, data, start, stop, x, work, column, rank)
