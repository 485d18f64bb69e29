"""Polynomial fits of height over the tangent plane ("jets", Cazals and Pouget 2005), many at a time.

Around a vertex, in a frame whose z axis is the normal of its ring, the neighbourhood is fitted by
z = sum c_ab x^a y^b, a + b <= degree, in the least-squares sense. x and y are first made to have unit second
moments (an affine map, under which the polynomials stay what they are): the conditioning then depends on
the shape of the neighbourhood alone, neither on its size nor on its stretching. The normal equations
are those of the moments sum x^a y^b, 45 numbers for degree 4. Their terms are eliminated highest degree
first, so that what the curvature needs (c10, c01, c20, c11, c02) comes last: the last block of the
Cholesky factor gives it without the others. The very last term is the constant one: less its row
the factor is that of fits through the vertex.

Three KINDS of fits: PLAIN ones; ROUND ones, over the sphere instead of the plane (see `gather`); SMOOTH ones,
round, through the vertex, and with weights (1 - r^2)^4 that fall to nearly nothing at the rim (Jiao and
Zha 2008 interpolate and weigh): of these bias is least, of the others noise.

LANES fits go through every step together, the innermost loops running over them: what there is of every fit
lies in rows of LANES numbers.
"""

from math import inf, nan

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import real, root, span, where
from quadcurv.kernels.gather import BLOCKS, FARTHEST, LANES, ROWS, neighbourhoods, step, windows
from quadcurv.kernels.shape import INDICES, curvatures, variances
from quadcurv.kernels.vector import triple

PLAIN, ROUND, SMOOTH = KINDS = range(3)
# Below this part of a term's square nothing is left but rounding.
PIVOT = 1e-9
# Where weights vanish, in squares of the neighbourhood's radius.
RIM = 1.44
# Columns of a result.
MEAN, GAUSSIAN, K1, K2 = 0, 1, 2, 3
DIRECTION1, DIRECTION2, NORMAL = slice(4, 7), slice(7, 10), slice(10, 13)
# GAIN, BIAS: four of them.
SIGMA, GAIN, CONDITION, BIAS, SQUARE, FREEDOM, LOWER, WHOLE, COLUMNS = 13, 14, 18, 19, 23, 24, 25, 26, 27

# Rows of `lane`: the axes of the frame; sums of x^2, x y, y^2, w z^2 and of weights; the affine map
# x = xx x', y = yx x' + yy y'; what of a term's square the terms before it left, at least; what is left of
# the squares of z; the largest x'^2 + y'^2; the number of points; what is left with fewer terms; sums of the
# points' parts in the last coefficients and of their products.
AXES, BEND, SXX, SXY, SYY, SZZ, SW = (k * LANES for k in (0, 9, 10, 11, 12, 13, 14))
XX, YX, YY, LEAST, LEFT, FAR, COUNT, LESS = (k * LANES for k in (15, 16, 17, 18, 19, 20, 21, 22))
SPREAD, ROWS_OF_LANE = 23 * LANES, 32


def terms_of(degree):
    """Exponents of the terms in the order of their elimination: x, y, x^2, x y, y^2, 1 last."""
    low = [(1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    higher = [(d - b, b) for d in range(degree, 2, -1) for b in range(d + 1)]
    return [*higher, *(term for term in low if sum(term) <= degree), (0, 0)]


def count_of(degree):
    """Of terms."""
    return (degree + 1) * (degree + 2) // 2


def workspace(degree):
    """Scratch of `fit`, and which of its rows make which.

    Returns
    -------
    lane, px, py, mu, nu, A, G
        Rows: see above; powers of x and y; moments and those with z; the Cholesky factor, with the
        right-hand side as its last row; what the last three of the terms before 1 are of the points.
    products, entries, terms
        Rows (mu, px, py) of moments, those with z last; rows (A, mu) of the normal equations, the right-hand
        side last, (A, nu), first those of two degrees less; rows (px, py) of the terms.
    """
    top, T = 2 * degree, count_of(degree)
    moments = [(a, b) for b in range(top + 1) for a in range(top + 1 - b)]
    with_z = [(a, b) for b in range(degree + 1) for a in range(degree + 1 - b)]
    products = [(k, a, b) for table in (moments, with_z) for k, (a, b) in enumerate(table)]
    entries = []
    for d in (degree - 2, degree):
        terms, t = terms_of(d), count_of(d)
        entries += [
            (i * t + j, moments.index((terms[i][0] + terms[j][0], terms[i][1] + terms[j][1])))
            for i in range(t)
            for j in range(i + 1)
        ]
        entries += [(t * t + i, with_z.index(term)) for i, term in enumerate(terms)]
    rows = (ROWS_OF_LANE, top + 1, top + 1, len(moments), len(with_z), (T + 1) * T, 3 * T)
    scratch = (np.zeros(count * LANES) for count in rows)
    tables = products, entries, terms_of(degree)
    return *scratch, *(flat(table, np.int32) for table in tables)


@step()
def frames(normals, block, lane):
    """Unit normals and, after Duff et al. 2017, bases of their planes without a branch."""
    for k in span(0, LANES):
        i = 4 * block * LANES + k
        nx, ny, nz = triple(normals, i, LANES)
        length = root(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
        sign = where(nz >= 0, 1.0, -1.0)
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        axes = 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny, nx, ny, nz
        for row, x in enumerate(axes):
            lane[AXES + row * LANES + k] = x
        lane[BEND + k] = normals[i + 3 * LANES]
        for row in (SXX, SXY, SYY, SZZ, SW, COUNT, FAR):
            lane[row + k] = 0.0


@step()
def into_frames(P, m, lane):
    """Turn row m of neighbourhoods into their frames, and spheres into planes; sum its moments."""
    for k in span(0, LANES):
        i = ROWS * m * LANES + k
        dx, dy, dz = triple(P, i, LANES)
        x, y, z = (
            lane[AXES + r * LANES + k] * dx
            + lane[AXES + (r + 1) * LANES + k] * dy
            + lane[AXES + (r + 2) * LANES + k] * dz
            for r in (0, 3, 6)
        )
        bend, square = lane[BEND + k], x * x + y * y + z * z
        share = 1.0 + bend * z + bend * bend * square / 4
        # Nothing is seen of what lies next to the opposite point of the sphere.
        known = where(share > FARTHEST, P[i + 3 * LANES], 0.0)
        inverse = where(share > FARTHEST, 1.0 / share, 0.0)
        x, y, z = x * inverse, y * inverse, (z + bend * square / 2) * inverse
        P[i], P[i + LANES], P[i + 2 * LANES], P[i + 3 * LANES] = x, y, z, known
        for row, value in ((SXX, x * x), (SXY, x * y), (SYY, y * y), (COUNT, known)):
            lane[row + k] += value


@step()
def affine_maps(lane):
    """Maps that make second moments unit ones."""
    for k in span(0, LANES):
        count = lane[COUNT + k]
        xx = root(lane[SXX + k] / count)
        yx = lane[SXY + k] / (count * xx)
        square = lane[SYY + k] / count - yx * yx
        lane[XX + k], lane[YX + k], lane[YY + k] = xx, yx, root(where(square < 0, 0.0, square))
        lane[LEAST + k] = 1.0


@step()
def into_maps(P, m, lane):
    """Apply them; the farthest point."""
    for k in span(0, LANES):
        i = ROWS * m * LANES + k
        x = P[i] / lane[XX + k]
        y = (P[i + LANES] - lane[YX + k] * x) / lane[YY + k]
        P[i], P[i + LANES] = x, y
        far, square = lane[FAR + k], x * x + y * y
        lane[FAR + k] = where(square > far, square, far)


@step()
def weigh(P, m, lane, weighted):
    """Weights, their sum, and that of the squares of z."""
    for k in span(0, LANES):
        i = ROWS * m * LANES + k
        known, square = P[i + 3 * LANES], P[i] * P[i] + P[i + LANES] * P[i + LANES]
        w = 1.0 - square / (RIM * lane[FAR + k])
        w = known * where(weighted, w * w * w * w, 1.0)
        P[i + 3 * LANES] = w
        lane[SW + k] += w
        lane[SZZ + k] += w * P[i + 2 * LANES] * P[i + 2 * LANES]


@step()
def first_powers(P, m, px, py):
    """Powers 0 and 1 of x, the same of y times the weight."""
    for k in span(0, LANES):
        i = ROWS * m * LANES + k
        weight = P[i + 3 * LANES]
        px[k], px[LANES + k] = 1.0, P[i]
        py[k], py[LANES + k] = weight, weight * P[i + LANES]


@step()
def next_powers(P, m, px, py, a):
    """Power a of x and y."""
    for k in span(0, LANES):
        i, j = a * LANES + k, ROWS * m * LANES + k
        px[i] = px[i - LANES] * P[j]
        py[i] = py[i - LANES] * P[j + LANES]


@step()
def add_moment(sums, px, py, products, t):
    """Add one product."""
    i, a, b = (products[3 * t + k] * LANES for k in range(3))
    for k in span(0, LANES):
        sums[i + k] += px[a + k] * py[b + k]


@step()
def clear(rows, first, count):
    """Make rows zero."""
    for k in span(first * LANES, (first + count) * LANES):
        rows[k] = 0.0


@step()
def powers_with_z(P, m, py, b):
    """Multiply a power of y by z."""
    for k in span(0, LANES):
        py[b * LANES + k] *= P[(ROWS * m + 2) * LANES + k]


@step()
def put_entry(A, mu, nu, without_z, entries, t):
    """One of the normal equations' entries."""
    moments = where(without_z, mu, nu)
    i, j = entries[2 * t] * LANES, entries[2 * t + 1] * LANES
    for k in span(0, LANES):
        A[i + k] = moments[j + k]


@step()
def begin(lane):
    """Keep what fewer terms left of the squares of z, and begin with all of them."""
    for k in span(0, LANES):
        lane[LESS + k] = lane[LEFT + k]
        lane[LEFT + k] = lane[SZZ + k]


@step()
def pivot(A, lane, mu, diagonal, moment):
    """How much of a term's square is left, of 1; the inverse of its root, in its place."""
    for k in span(0, LANES):
        left = A[diagonal * LANES + k]
        share, least = left / mu[moment * LANES + k], lane[LEAST + k]
        lane[LEAST + k] = where(share < least, share, least)
        A[diagonal * LANES + k] = 1.0 / root(left)


@step()
def scale_entry(A, i, diagonal):
    """An entry of the factor."""
    for k in span(0, LANES):
        A[i * LANES + k] *= A[diagonal * LANES + k]


@step()
def eliminate(A, ij, ik, jk):
    """Take from an entry what the term that is eliminated explains of it."""
    for k in span(0, LANES):
        A[ij * LANES + k] -= A[ik * LANES + k] * A[jk * LANES + k]


@step()
def explain(A, lane, i):
    """Take from the squares of z what the term that is eliminated explains of them."""
    for k in span(0, LANES):
        x = A[i * LANES + k]
        lane[LEFT + k] -= x * x


@step()
def unit_row(A, G, i, diagonal):
    """Begin a row of an inverse with its diagonal."""
    for k in span(0, LANES):
        G[i * LANES + k] = A[diagonal * LANES + k]


@step()
def combine(A, G, i, j, entry):
    """Take from an entry of an inverse what another one makes of it."""
    for k in span(0, LANES):
        G[i * LANES + k] -= A[entry * LANES + k] * G[j * LANES + k]


@step()
def scale_inverse(A, G, i, diagonal):
    """An entry of an inverse."""
    for k in span(0, LANES):
        G[i * LANES + k] *= A[diagonal * LANES + k]


@step()
def add_term(G, px, py, terms, T, t, mu):
    """What one term adds to the parts that a point has in the last three coefficients."""
    a, b = terms[2 * t] * LANES, terms[2 * t + 1] * LANES
    for k in span(0, LANES):
        x = px[a + k] * py[b + k]
        for j in range(3):
            mu[j * LANES + k] += G[(j * T + t) * LANES + k] * x


@step()
def spread(lane, mu):
    """Add the parts of a point, and their products."""
    for k in span(0, LANES):
        u, v, w = (mu[j * LANES + k] for j in range(3))
        for row, x in enumerate((u, v, w, u * u, u * v, v * v, u * w, v * w, w * w)):
            lane[SPREAD + row * LANES + k] += x


@step()
def is_determined(lane, k):
    """Whether a neighbourhood determines the polynomial."""
    return lane[LEAST + k] > PIVOT


@step()
def unknown(out, at, condition):
    """Results where nothing is known."""
    for k in range(COLUMNS):
        out[at * COLUMNS + k] = condition if k == CONDITION else nan


@step()
def result(A, lane, T, through, k, out, at):
    """All results of the k-th fit."""
    # The last rows and columns of the Cholesky factor, (7, 6), the right-hand side last; inverses on its
    # diagonal.
    B = {(i, j): A[((T - 6 + i) * T + T - 6 + j) * LANES + k] for i in range(7) for j in range(6) if j <= i}
    frame = [lane[AXES + row * LANES + k] for row in range(9)]
    maps = lane[XX + k], lane[YX + k], lane[YY + k], lane[BEND + k]
    count = lane[COUNT + k]
    square, constant = where(lane[LEFT + k] < 0, 0.0, lane[LEFT + k]), B[6, 5] * B[5, 5]
    # Points less the terms, weighted ones for as much as they count.
    freedom = count - real(T)
    sigma = where(freedom > 0, root(square / freedom), nan)
    sums = [lane[SPREAD + row * LANES + k] for row in range(9)]
    # A vertex that all pass through is in the other points, turned round.
    S = [
        where(through, x + sums[i] * sums[j], y)
        for x, y, (i, j) in zip(sums[3:], variances(B), INDICES, strict=True)
    ]
    values, gains = curvatures(B, where(through, 0.0, constant), *maps, frame, S)
    others, _ = curvatures(B, where(through, constant, 0.0), *maps, frame, S)
    bias = (b - a for a, b in zip(values[:4], others[:4], strict=True))
    condition = where(count > 0, root((S[0] + S[2] + S[5]) * count), nan)
    squares = square, freedom, lane[LESS + k], lane[SZZ + k]
    for column, x in enumerate((*values, sigma, *gains, condition, *bias, *squares)):
        out[at * COLUMNS + column] = x


@kernel
def _fit(P, counts, normals, degree, smooth, out, size, lane, px, py, mu, nu, A, G, products, entries, terms):
    T = (degree + 1) * (degree + 2) // 2
    moments, room = (degree + 1) * (2 * degree + 1), P.size // (ROWS * LANES * BLOCKS)
    for block in range(counts.size):
        first, last = block * room, block * room + counts[block]
        frames(normals, block, lane)
        for m in range(first, last):
            into_frames(P, m, lane)
        affine_maps(lane)
        for m in range(first, last):
            into_maps(P, m, lane)
        for m in range(first, last):
            weigh(P, m, lane, smooth == 1)
        clear(mu, 0, moments)
        clear(nu, 0, T)
        for m in range(first, last):
            first_powers(P, m, px, py)
            for a in range(2, 2 * degree + 1):
                next_powers(P, m, px, py, a)
            for t in range(moments):
                add_moment(mu, px, py, products, t)
            for b in range(degree + 1):
                powers_with_z(P, m, py, b)
            for t in range(moments, moments + T):
                add_moment(nu, px, py, products, t)

        at = 0  # of the entries
        for d in range(degree - 2, degree + 1, 2):
            n = (d + 1) * (d + 2) // 2
            normal = n * (n + 1) // 2
            for t in range(normal + n):
                put_entry(A, mu, nu, t < normal, entries, at + t)
            begin(lane)
            diagonal = at
            for k in range(n):
                pivot(A, lane, mu, k * n + k, entries[2 * diagonal + 1])
                diagonal += k + 2
                for i in range(k + 1, n + 1):
                    scale_entry(A, i * n + k, k * n + k)
                for i in range(k + 1, n + 1):
                    for j in range(k + 1, min(i, n - 1) + 1):
                        eliminate(A, i * n + j, i * n + k, j * n + k)
                explain(A, lane, n * n + k)
            at += normal + n

        if smooth:  # of least squares without weights the factor tells all
            clear(G, 0, 3 * T)
            for j in range(3):
                q = T - 4 + j
                unit_row(A, G, j * T + q, q * T + q)
                for i in range(q + 1, T - 1):
                    for k in range(q, i):
                        combine(A, G, j * T + i, j * T + k, i * T + k)
                    scale_inverse(A, G, j * T + i, i * T + i)
                for i in range(T - 2, -1, -1):
                    for k in range(i + 1, T - 1):
                        combine(A, G, j * T + i, j * T + k, k * T + i)
                    scale_inverse(A, G, j * T + i, i * T + i)
            clear(lane, SPREAD // LANES, 9)
            for m in range(first, last):
                first_powers(P, m, px, py)
                for a in range(2, degree + 1):
                    next_powers(P, m, px, py, a)
                clear(mu, 0, 3)
                for t in range(T - 1):
                    add_term(G, px, py, terms, T, t, mu)
                spread(lane, mu)
        for k in range(min(LANES, size - block * LANES)):
            if is_determined(lane, k):
                result(A, lane, T, smooth == 1, k, out, block * LANES + k)
            else:
                unknown(out, block * LANES + k, inf)


def grid_fits(points, normals, vertices, degree, rings, kind, out):
    """Fit a grid's vertices over windows of 2 rings + 1 points in both directions.

    Parameters
    ----------
    points : (R, C, 3) float64
        The grid with at least `rings` layers around it, NaN where there is no point.
    normals : (R, C, 3) float64
        Of any length.
    vertices : (k, 2) int32
        Row and column in `points` of each vertex to fit.
    degree : int
    rings : int
    kind : int
        One of KINDS.
    out : (k, COLUMNS) float64
        Filled. With several rings all is NaN, the CONDITION too, where the neighbourhood is too steep; with
        any, all but the CONDITION, infinite then, where it does not determine the polynomial.
    """
    work, columns, room = workspace(degree), points.shape[1], (2 * rings + 1) ** 2
    points, normals = flat(points), flat(normals)
    P, axes = np.empty(BLOCKS * room * ROWS * LANES), np.empty(BLOCKS * 4 * LANES)
    steep = np.empty(BLOCKS * LANES, bool)
    for start in range(0, len(vertices), BLOCKS * LANES):
        some, results = flat(vertices[start : start + BLOCKS * LANES]), out[start : start + BLOCKS * LANES]
        counts = np.empty(-(-len(results) // LANES), np.int64)
        windows(points, normals, columns, some, rings, kind != PLAIN, P, counts, axes, steep)
        _fit(P, counts, axes, degree, int(kind == SMOOTH), results.reshape(-1), len(results), *work)
        results[steep[: len(results)]] = np.nan


def face_fits(points, faces, indptr, corners, normals, sided, vertices, degree, rings, kind, out):
    """Fit vertices of a face list over all vertices of `rings` rings of faces around them.

    Parameters
    ----------
    points : (p, 3) float64
    faces : (m, 4) int32
    indptr, corners
        Corners by vertex, see topology.corners_by_vertex.
    normals : (n, 3) float64
        Of any length; of the first n points.
    sided : bool
        Whether they are all on the same side; if not, nobody knows what is too steep.
    vertices : (k,) int32
        Vertices to fit.
    degree, rings, kind, out
        As for grid_fits.
    """
    stamp, around = np.full(len(points), -1, np.int32), np.empty(len(points), np.int32)
    given = [flat(x) for x in (points, faces, indptr, corners, normals)]
    work, room, axes = workspace(degree), 32, np.empty(BLOCKS * 4 * LANES)
    P = np.empty(BLOCKS * room * ROWS * LANES)
    for start in range(0, len(vertices), BLOCKS * LANES):
        some, results = flat(vertices[start : start + BLOCKS * LANES]), out[start : start + BLOCKS * LANES]
        counts = np.empty(-(-len(results) // LANES), np.int64)
        scratch = P, counts, axes, stamp, around
        while (found := neighbourhoods(*given, sided, some, rings, kind != PLAIN, *scratch)) > room:
            stamp.fill(-1)
            room = 2 * found
            P = np.empty(BLOCKS * room * ROWS * LANES)
            scratch = P, *scratch[1:]
        _fit(P, counts, axes, degree, int(kind == SMOOTH), results.reshape(-1), len(results), *work)
