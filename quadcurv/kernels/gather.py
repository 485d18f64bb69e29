"""Neighbourhoods of vertices, gathered for fits that go side by side.

LANES of them make a block; a row of a block is what one point of every neighbourhood has, four times LANES
numbers: x, y, z less those of the vertex itself, and the weight.
"""

from functools import partial

from quadcurv.kernels.compiled import helper, kernel
from quadcurv.kernels.formulas import formula, where
from quadcurv.kernels.vector import cross, less, triple

LANES = 48
BLOCKS = 8  # gathered at once
CROWDED = 64  # faces of a vertex, of which others are passed over from twice as many on
# Steepest that a neighbourhood of more than one ring may be. A polynomial follows no steeper one (a sphere is
# vertical where its powers stop converging), and what folds over is no graph at all.
SLOPE = 2.0

# Nothing but fused multiply-adds is left to the compiler: NaN stays NaN.
step = partial(formula, contract=True)


def is_turned(a, n):
    """Whether a normal, of any length, is further than SLOPE from another one, n; not if it is NaN."""
    up, size = a[0] * n[0] + a[1] * n[1] + a[2] * n[2], n[0] * n[0] + n[1] * n[1] + n[2] * n[2]
    share = (1.0 + SLOPE * SLOPE) * up / size * where(up < 0, -up, up)
    return share < a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@step()
def turned(normals, v, c):
    """`is_turned` of vertices."""
    return is_turned(triple(normals, 3 * v, 1), triple(normals, 3 * c, 1))


@step()
def add_point(points, v, c, P, m, lane):
    """Put a point less a centre, or nothing where it is NaN, into row m of a neighbourhood."""
    x, y, z = less(triple(points, 3 * v, 1), triple(points, 3 * c, 1))
    known = x == x
    for k, value in enumerate((x, y, z, 1.0)):
        P[(4 * m + k) * LANES + lane] = where(known, value, 0.0)


@step()
def no_point(P, m, lane):
    """Put nothing into row m of a neighbourhood."""
    for k in range(4):
        P[(4 * m + k) * LANES + lane] = 0.0


def column(P, m, lane):
    """Row m of a neighbourhood."""
    return triple(P, 4 * m * LANES + lane, LANES)


@step()
def window_normal(P, middle, width, axes, block, lane):
    """The normal across the ring of edge neighbours; missing ones are at the centre."""
    a = less(column(P, middle + width, lane), column(P, middle - width, lane))
    b = less(column(P, middle + 1, lane), column(P, middle - 1, lane))
    for k, x in enumerate(cross(a, b)):
        axes[(3 * block + k) * LANES + lane] = x


@step()
def vertex_normal(normals, c, axes, block, lane):
    """The normal as given."""
    for k, x in enumerate(triple(normals, 3 * c, 1)):
        axes[(3 * block + k) * LANES + lane] = x


@kernel
def windows(points, normals, columns, vertices, rings, P, counts, axes, steep):
    """Gather windows of a grid, with their normals; which are too steep."""
    width, total = 2 * rings + 1, vertices.size // 2
    for k in range(counts.size * LANES):
        block, lane, at = k // LANES, k % LANES, min(k, total - 1)
        first, middle = block * width * width, block * width * width + (width * width - 1) // 2
        c = vertices[2 * at] * columns + vertices[2 * at + 1]
        counts[block] = width * width
        found = False
        for m in range(width * width):
            v = c + (m // width - rings) * columns + m % width - rings
            add_point(points, v, c, P, first + m, lane)
            if rings > 1:
                found |= turned(normals, v, c)
        steep[k] = found
        window_normal(P, middle, width, axes, block, lane)


@helper
def neighbourhood(faces, indptr, corners, c, rings, stamp, around):
    """Write c and the vertices of `rings` rings of faces around it to `around`; how many they are."""
    stamp[c] = c
    around[0] = c
    begin, end = 0, 1
    for _ in range(rings):
        new = end
        for q in range(begin, end):
            v = around[q]
            # Of a vertex of very many faces, a pole, some stand for all: else its neighbours' fits would each
            # look at all of them.
            for k in range(indptr[v], indptr[v + 1], max(1, (indptr[v + 1] - indptr[v]) // CROWDED)):
                f = corners[k] >> 2
                for s in range(4):
                    x = faces[4 * f + s]
                    if x >= 0 and stamp[x] != c:
                        stamp[x] = c
                        around[new] = x
                        new += 1
        begin, end = end, new
    return end


@kernel
def neighbourhoods(
    points, faces, indptr, corners, normals, sided, vertices, rings, P, counts, axes, stamp, around
):
    """Gather neighbourhoods of a face list; as many rows as one needs, if there is no room for these."""
    room = P.size // (4 * LANES * BLOCKS)
    for k in range(counts.size * LANES):
        block, lane, first = k // LANES, k % LANES, k // LANES * room
        c, m, steep = vertices[min(k, vertices.size - 1)], 0, False
        if k < vertices.size:
            m = neighbourhood(faces, indptr, corners, c, rings, stamp, around)
        if m > room:
            return m
        if sided and rings > 1:
            for i in range(1, m):
                if 3 * around[i] < normals.size:
                    steep |= turned(normals, around[i], c)
        m = 0 if steep else m
        for i in range(m):
            add_point(points, around[i], c, P, first + i, lane)
        count = 0 if lane == 0 else counts[block]
        for i in range(count, m):
            for other in range(lane):  # whose neighbourhoods end before
                no_point(P, first + i, other)
        for i in range(m, count):
            no_point(P, first + i, lane)
        counts[block] = max(count, m)
        vertex_normal(normals, c, axes, block, lane)
    return room
