"""Neighbourhoods of vertices, gathered for fits that go side by side.

LANES of them make a block; a row of a block is what one point of every neighbourhood has, four times LANES
numbers: x, y, z less those of the vertex itself, and the weight.

A round neighbourhood is fitted over the sphere through its vertex, tangent to the plane there, that is
nearest to it: an inversion about the opposite point, which leaves angles and the vertex as they are, makes
the sphere that plane, and takes its curvature from all normal curvatures at the vertex. With d the position
less the vertex, n the normal and b the sphere's curvature, what is inverted has

    (x, y) / D,   (z + b d^2 / 2) / D,   D = 1 + b z + b^2 d^2 / 4 = (n + b d / 2)^2.

What is left to be followed by a polynomial is how the surface departs from a sphere: nothing of a coarse
one is steep, and the terms of higher degree are smaller wherever the principal curvatures are of one sign.
"""

from functools import partial

from quadcurv.kernels.compiled import helper, kernel
from quadcurv.kernels.formulas import Carried, formula, root, span, where
from quadcurv.kernels.vector import cross, less, triple

LANES = 48
ROWS = 4  # of LANES numbers
BLOCKS = 8  # gathered at once
FARTHEST = 0.1  # of D: beyond, near the opposite point of the sphere, nothing is looked at
CROWDED = 64  # faces of a vertex, of which others are passed over from twice as many on
# Steepest that a neighbourhood of more than one ring may be. A polynomial follows no steeper one (a sphere is
# vertical where its powers stop converging), and what folds over is no graph at all.
SLOPE = 2.0

# Nothing but fused multiply-adds is left to the compiler: NaN stays NaN.
step = partial(formula, contract=True)


def is_steep(up, a, n):
    """Whether a normal, of any length, is further than SLOPE from another one, n, of unit length."""
    share = (1.0 + SLOPE * SLOPE) * up * where(up < 0, -up, up)
    return share < a[0] * a[0] + a[1] * a[1] + a[2] * a[2]


@step()
def turned(normals, v, P, m, axes, block, lane):
    """Whether the normal of a vertex, row m of a neighbourhood, is too steep over the sphere; not if NaN."""
    i = 4 * block * LANES + lane
    a, n, bend, d = triple(normals, 3 * v, 1), triple(axes, i, LANES), axes[i + 3 * LANES], column(P, m, lane)
    # Mirrored by the inversion at n + b d / 2, of square D, and turned over.
    half = n[0] + bend * d[0] / 2, n[1] + bend * d[1] / 2, n[2] + bend * d[2] / 2
    up = 2.0 * inner(half, n) * inner(half, a) / inner(half, half) - inner(a, n)
    return is_steep(up, a, n)


def inner(a, b):
    """Inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@step()
def add_point(points, v, c, P, m, lane):
    """Put a point less a centre, or nothing where it is NaN, into row m of a neighbourhood."""
    x, y, z = less(triple(points, 3 * v, 1), triple(points, 3 * c, 1))
    known = x == x
    for k, value in enumerate((x, y, z, 1.0)):
        P[(ROWS * m + k) * LANES + lane] = where(known, value, 0.0)


@step()
def no_point(P, m, lane):
    """Put nothing into row m of a neighbourhood."""
    for k in range(4):
        P[(ROWS * m + k) * LANES + lane] = 0.0


def column(P, m, lane):
    """Row m of a neighbourhood."""
    return triple(P, ROWS * m * LANES + lane, LANES)


@step()
def window_normal(P, middle, width, axes, block, lane):
    """The normal across the ring of edge neighbours, of unit length; missing ones are at the centre."""
    a = less(column(P, middle + width, lane), column(P, middle - width, lane))
    b = less(column(P, middle + 1, lane), column(P, middle - 1, lane))
    put_axis(cross(a, b), axes, block, lane)


@step()
def vertex_normal(normals, c, axes, block, lane):
    """The normal as given, of unit length."""
    put_axis(triple(normals, 3 * c, 1), axes, block, lane)


def put_axis(n, axes, block, lane):
    """A normal made one of unit length, and no sphere yet."""
    length = root(inner(n, n))
    for k, x in enumerate((*(x / length for x in n), 0.0)):
        axes[(4 * block + k) * LANES + lane] = x


@step()
def nearest_sphere(P, first, last, axes, block, lane):
    """Curvature of the sphere that is nearest to a neighbourhood: z + b d^2 / 2 = 0 by least squares."""
    i = 4 * block * LANES + lane
    n, sums = triple(axes, i, LANES), Carried((0.0, 0.0))
    for m in span(first, last):
        d = column(P, m, lane)
        square, (above, fourth) = inner(d, d), sums.get()
        sums.set((above + inner(d, n) * square, fourth + square * square))
    above, fourth = sums.get()
    axes[i + 3 * LANES] = where(fourth > 0, -2.0 * above / fourth, 0.0)


@kernel
def windows(points, normals, columns, vertices, rings, is_round, P, counts, axes, steep):
    """Gather windows of a grid, with their normals and spheres; which are too steep."""
    width, total = 2 * rings + 1, vertices.size // 2
    for k in range(counts.size * LANES):
        block, lane, at = k // LANES, k % LANES, min(k, total - 1)
        first, middle = block * width * width, block * width * width + (width * width - 1) // 2
        c = vertices[2 * at] * columns + vertices[2 * at + 1]
        counts[block] = width * width
        for m in range(width * width):
            v = c + (m // width - rings) * columns + m % width - rings
            add_point(points, v, c, P, first + m, lane)
        window_normal(P, middle, width, axes, block, lane)
        if is_round:
            nearest_sphere(P, first, first + width * width, axes, block, lane)
        found = False
        if rings > 1:
            for m in range(width * width):
                v = c + (m // width - rings) * columns + m % width - rings
                found |= turned(normals, v, P, first + m, axes, block, lane)
        steep[k] = found


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
    points, faces, indptr, corners, normals, sided, vertices, rings, is_round, P, counts, axes, stamp, around
):
    """Gather neighbourhoods of a face list; as many rows as one needs, if there is no room for these."""
    room = P.size // (ROWS * LANES * BLOCKS)
    for k in range(counts.size * LANES):
        block, lane, first = k // LANES, k % LANES, k // LANES * room
        c, m, steep = vertices[min(k, vertices.size - 1)], 0, False
        if k < vertices.size:
            m = neighbourhood(faces, indptr, corners, c, rings, stamp, around)
        if m > room:
            return m
        for i in range(m):
            add_point(points, around[i], c, P, first + i, lane)
        vertex_normal(normals, c, axes, block, lane)
        if is_round:
            nearest_sphere(P, first, first + m, axes, block, lane)
        if sided and rings > 1:
            for i in range(1, m):
                if 3 * around[i] < normals.size:
                    steep |= turned(normals, around[i], P, first + i, axes, block, lane)
        m = 0 if steep else m
        count = 0 if lane == 0 else counts[block]
        for i in range(count, m):
            for other in range(lane):  # whose neighbourhoods end before
                no_point(P, first + i, other)
        for i in range(m, count):
            no_point(P, first + i, lane)
        counts[block] = max(count, m)
    return room
