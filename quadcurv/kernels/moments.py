"""From neighbourhoods to sums over them: frames, spheres, maps, weights and moments, WIDTH fits at once.

What there is of every fit lies in rows of WIDTH numbers. A row of `lane` is one number of each, a point has
ROWS rows in `P`: x, y, z less those of the vertex itself, and the weight.

A round neighbourhood is fitted over the sphere through its vertex, tangent to the plane there, that is
nearest to it: an inversion about the opposite point, which leaves angles and the vertex as they are, makes
the sphere that plane, and takes its curvature from all normal curvatures at the vertex. With d the position
less the vertex, n the normal and b the sphere's curvature, what is inverted has

    (x, y) / D,   (z + b d^2 / 2) / D,   D = 1 + b z + b^2 d^2 / 4 = (n + b d / 2)^2.

What is left to be followed by a polynomial is how the surface departs from a sphere: nothing of a coarse
one is steep, and the terms of higher degree are smaller wherever the principal curvatures are of one sign.
"""

from functools import partial

import numpy as np

from quadcurv.kernels.formulas import (
    WIDTH,
    Carried,
    formula,
    lanes,
    muladd,
    put_lanes,
    real,
    root,
    side_by_side,
    span,
    three_lanes,
    where,
)

FARTHEST = 0.1  # of D: beyond, near the opposite point of the sphere, nothing is looked at
# Steepest that a neighbourhood of more than one ring may be. A polynomial follows no steeper one (a sphere is
# vertical where its powers stop converging), and what folds over is no graph at all.
SLOPE = 2.0
# Where weights vanish, in squares of the neighbourhood's radius.
RIM = 1.44
CHUNK = 25  # points whose powers are kept at once: they stay in the first-level cache
MOST = 22  # sums that are taken at once: so many vectors processors have room for

ROWS = 4
X, Y, Z, W = range(ROWS)
# Rows of `lane`: the vertex; the axes of the frame; the sphere's curvature; how many points are too steep,
# are there, and are seen; the affine map x = xx x', y = yx x' + yy y'; what of a term's square the terms
# before it left, at least; what is left of the squares of z with fewer terms, and with all; sums of the
# points' parts in the last coefficients and of their products.
ORIGIN, AXES, BEND, STEEP, POINTS, COUNT, XX, YX, YY, LEAST, LESS, LEFT, SPREAD = (
    0, 3, 12, 13, 14, 15, 16, 17, 18, 19, 20, 21, 22,
)  # fmt: skip
ROWS_OF_LANE = 31

# Nothing but fused multiply-adds is left to the compiler: NaN stays NaN.
step = partial(formula, contract=True)


def terms_of(degree):
    """Exponents of the terms in the order of their elimination: x, y, x^2, x y, y^2, 1 last."""
    low = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    higher = [(d - b, b) for d in range(degree, 2, -1) for b in range(d + 1)]
    return [*higher, *(term for term in low if sum(term) <= degree), (0, 0)]


def moments_of(degree):
    """Rows of `mu`: (a, b, c) of the sums of w x^a y^b z^c."""
    plain = [(a, b, 0) for b in range(2 * degree + 1) for a in range(2 * degree + 1 - b)]
    return [*plain, *((a, b, 1) for b in range(degree + 1) for a in range(degree + 1 - b)), (0, 0, 2)]


def moments_degree(degree):
    """Even degree whose moments make the normal equations: those of the odd one are among them."""
    return degree + degree % 2


def new_rows(count):
    """So many rows of zeros, each in one line of the caches: others take twice as long to read."""
    values = np.zeros((count + 1) * WIDTH)
    first = -values.ctypes.data % (8 * WIDTH) // 8
    return values[first : first + count * WIDTH]


def row(values, k):
    """A row."""
    return lanes(values, k * WIDTH)


def put_row(values, k, x):
    """Write a row."""
    put_lanes(values, k * WIDTH, x)


def rows(values, k, count=3):
    """Some rows from one on."""
    return [row(values, k + i) for i in range(count)]


def point(P, m):
    """Coordinates of point m."""
    return rows(P, ROWS * m)


def inner(a, b):
    """Inner product."""
    return muladd(a[0], b[0], muladd(a[1], b[1], a[2] * b[2]))


def gathered(values, index, at):
    """Triples of an array at WIDTH indices."""
    starts = [3 * index[at + k] for k in range(WIDTH)]
    return [side_by_side([values[start + i] for start in starts]) for i in range(3)]


@step()
def frames(points, normals, centres, counts, block, lane):
    """Vertices, unit normals and, after Duff et al. 2017, bases of their planes without a branch."""
    for i, x in enumerate(gathered(points, centres, block * WIDTH)):
        put_row(lane, ORIGIN + i, x)
    nx, ny, nz = gathered(normals, centres, block * WIDTH)
    length = root(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    sign = where(nz >= 0, 1.0, -1.0)
    a = -1.0 / (sign + nz)
    b = nx * ny * a
    axes = 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny, nx, ny, nz
    for i, x in enumerate(axes):
        put_row(lane, AXES + i, x)
    put_row(lane, POINTS, side_by_side([real(counts[block * WIDTH + k]) for k in range(WIDTH)]))
    put_row(lane, LEAST, 1.0)


def beside(values, index, at):
    """The same where these indices follow each other."""
    return three_lanes(values, 3 * index[at])


# What is done wherever neighbours are has its fused products written out: what is left to the compiler might
# differ between the two ways of reading them, and results would depend on how vertices are cut into blocks.


def _into_frames(points, index, first, size, is_round, P, lane, triples=gathered):
    """Positions in the frames; the spheres nearest to them: z + b d^2 / 2 = 0 by least squares."""
    origin, axes = rows(lane, ORIGIN), [rows(lane, AXES + i) for i in (0, 3, 6)]
    zero = 0.0 * row(lane, POINTS)
    sums = Carried((zero, zero))
    for m in span(0, size):
        at = triples(points, index, (first + m) * WIDTH)
        d = [x - y for x, y in zip(at, origin, strict=True)]
        turned = [inner(axis, d) for axis in axes]
        for i, x in enumerate(turned):
            put_row(P, ROWS * m + i, x)
        square, (above, fourth) = inner(turned, turned), sums.get()
        sums.set((muladd(turned[2], square, above), muladd(square, square, fourth)))
    above, fourth = sums.get()
    bend = where(fourth > 0, -2.0 * above / fourth, 0.0)
    put_row(lane, BEND, where(is_round, bend, 0.0))


def is_steep(up, square):
    """Whether a normal that has a part `up` along another, and this square, is further than SLOPE from it."""
    return (1.0 + SLOPE * SLOPE) * up * where(up < 0, -up, up) < square


def _into_planes(normals, index, first, size, is_even, P, lane, triples=gathered):
    """Make the spheres planes; second moments; which are too steep: not where a normal is NaN or zero.

    Of points of one noise that in height grows with lengths and with the inverse cosine of the slope: where
    it is to be even, points have the inverse of its square for weights.
    """
    axes, bend, count = [rows(lane, AXES + i) for i in (0, 3, 6)], row(lane, BEND), row(lane, POINTS)
    zero = 0.0 * count
    sums = Carried((zero,) * 5)
    for m in span(0, size):
        d = point(P, m)
        x, y, z = d
        square, half = inner(d, d), muladd(bend / 2, z, 1.0)
        share = muladd(half, half, bend * bend / 4 * muladd(x, x, y * y))
        # Nothing is seen of what lies next to the opposite point of the sphere.
        seen = (share > FARTHEST) & (count > real(m))
        known, inverse = where(seen, 1.0, 0.0), where(seen, 1.0 / share, 0.0)
        normal = triples(normals, index, (first + m) * WIDTH)
        a = [inner(axis, normal) for axis in axes]
        # Mirrored by the inversion at n + b d / 2, of square D, and turned over: here D times that.
        up = 2.0 * half * muladd(bend / 2, inner(a, d), a[2]) - share * a[2]
        steep = where(is_steep(up, inner(a, a) * share * share), 1.0, 0.0)
        x, y, z = x * inverse, y * inverse, muladd(bend / 2, square, z) * inverse
        even = where(inner(a, a) > 0, up * up / inner(a, a), share * share)
        for i, value in enumerate((x, y, z, known * where(is_even, even, 1.0))):
            put_row(P, ROWS * m + i, value)
        more = (known, 1.0), (x, x), (x, y), (y, y), (steep, 1.0)
        sums.set(tuple(muladd(*pair, s) for s, pair in zip(sums.get(), more, strict=True)))
    count, xx, xy, yy, steep = sums.get()
    put_row(lane, COUNT, count)
    put_row(lane, STEEP, steep)
    # The affine map that makes second moments unit ones: the conditioning depends on the shape alone.
    scale = root(xx / count)
    shear = xy / (count * scale)
    square = yy / count - shear * shear
    put_row(lane, XX, scale)
    put_row(lane, YX, shear)
    put_row(lane, YY, root(where(square < 0, 0.0, square)))


@formula
def into_frames(points, index, first, size, is_round, P, lane):
    """`_into_frames` wherever neighbours are."""
    _into_frames(points, index, first, size, is_round, P, lane)


@formula
def into_frames_beside(points, index, first, size, is_round, P, lane):
    """`_into_frames` where those of a row of the block follow each other."""
    _into_frames(points, index, first, size, is_round, P, lane, beside)


@formula
def into_planes(normals, index, first, size, is_even, P, lane):
    """`_into_planes` wherever neighbours are."""
    _into_planes(normals, index, first, size, is_even, P, lane)


@formula
def into_planes_beside(normals, index, first, size, is_even, P, lane):
    """`_into_planes` where those of a row of the block follow each other."""
    _into_planes(normals, index, first, size, is_even, P, lane, beside)


@step()
def into_maps(P, size, weighted, lane):
    """Apply the affine maps; weights (1 - r^2)^4, r of the farthest point."""
    xx, yx, yy = 1.0 / row(lane, XX), row(lane, YX), 1.0 / row(lane, YY)
    farthest = Carried((0.0 * row(lane, POINTS),))
    for m in span(0, size):
        x = row(P, ROWS * m) * xx
        y = (row(P, ROWS * m + Y) - yx * x) * yy
        put_row(P, ROWS * m, x)
        put_row(P, ROWS * m + Y, y)
        square, (far,) = x * x + y * y, farthest.get()
        farthest.set((where(square > far, square, far),))
    scale = where(weighted, 1.0 / (RIM * farthest.get()[0]), 0.0)
    for m in span(0, where(weighted, size, 0)):
        x, y, _ = point(P, m)
        w = 1.0 - (x * x + y * y) * scale
        w = w * w
        put_row(P, ROWS * m + W, row(P, ROWS * m + W) * w * w)


@step()
def clear(values, size):
    """Make rows zero."""
    for k in span(0, size):
        put_row(values, k, 0.0)


def _groups(degree):
    """Powers of y that are summed at once, with all their moments."""
    moments, groups = moments_of(degree), []
    for b in range(2 * degree + 1):
        of_b = [(a, b, c) for (a, q, c) in moments if q == b]
        if not groups or groups[-1][-1][1] == b or len(groups[-1]) + len(of_b) > MOST:
            groups.append([])
        groups[-1] += of_b
    return groups


def _add_moments(degree):
    top, moments = 2 * degree, moments_of(degree)

    def add_moments(P, first, size, px, q, mu):
        """Add the moments of some points."""
        for m in span(0, size):
            x, power = row(P, ROWS * (first + m)), 1.0
            for a in range(top):
                power = power * x
                put_row(px, m * top + a, power)
            put_row(q, m, row(P, ROWS * (first + m) + W))
        for group in _groups(degree):
            sums = Carried(tuple(row(mu, moments.index(moment)) for moment in group))
            for m in span(0, size):
                at = ROWS * (first + m)
                y, z, power, before = row(P, at + Y), row(P, at + Z), row(q, m), None
                totals, x = [], {}
                for total, (a, b, c) in zip(sums.get(), group, strict=True):
                    if before not in (None, b):
                        power = power * y
                    before = b
                    factor = power
                    for _ in range(c):
                        factor = factor * z
                    if a and a not in x:
                        x[a] = row(px, m * top + a - 1)
                    totals.append(total + (factor * x[a] if a else factor))
                sums.set(tuple(totals))
                put_row(q, m, power * y)
            for total, moment in zip(sums.get(), group, strict=True):
                put_row(mu, moments.index(moment), total)

    add_moments.__name__ = f"add_moments_{degree}"
    return step()(add_moments)


add_moments_2, add_moments_4, add_moments_6 = map(_add_moments, (2, 4, 6))


def _horner(coefficients, x):
    """Value of a polynomial, the highest power first; None where there is no coefficient."""
    value = None
    for c in coefficients:
        value = None if value is None else value * x
        value = value if c is None else c if value is None else value + c
    return value


def _spread(degree):
    terms = terms_of(degree)[:-1]
    T = len(terms) + 1

    def spread(P, size, G, lane):
        """The points' parts in the last coefficients, and sums of their products."""
        zero = 0.0 * row(lane, POINTS)
        sums = Carried((zero,) * 9)
        for m in span(0, size):
            x, y, _ = point(P, m)
            weight, parts = row(P, ROWS * m + W), []
            for j in range(3):
                inner_powers = [
                    _horner(
                        [
                            row(G, j * T + terms.index((a, b))) if (a, b) in terms else None
                            for a in range(degree - b, -1, -1)
                        ],
                        x,
                    )
                    for b in range(degree, -1, -1)
                ]
                parts.append(weight * _horner(inner_powers, y))
            u, v, w = parts
            more = u, v, w, u * u, u * v, v * v, u * w, v * w, w * w
            sums.set(tuple(s + value for s, value in zip(sums.get(), more, strict=True)))
        for k, total in enumerate(sums.get()):
            put_row(lane, SPREAD + k, total)

    spread.__name__ = f"spread_{degree}"
    return step()(spread)


spread_2, spread_4, spread_6 = map(_spread, (2, 4, 6))
