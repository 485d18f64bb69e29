"""Polynomial fits of height over the tangent plane ("jets", Cazals and Pouget 2005), many at a time.

Around a vertex, in a frame whose z axis is the normal of its ring, the neighbourhood is fitted by
z = sum c_ab x^a y^b, a + b <= degree, in the least-squares sense. x and y are first made to have unit second
moments (an affine map, under which the polynomials stay what they are): the conditioning then depends on
the shape of the neighbourhood alone, neither on its size nor on its stretching. The normal equations
are those of the moments sum x^a y^b, 45 numbers for degree 4. Their terms are eliminated highest degree
first, so that what the curvature needs (c10, c01, c20, c11, c02) comes last: the last block of the
Cholesky factor gives it, and its covariance, without the others.

LANES fits go through every step together, the innermost loops running over them: what there is of every fit
lies in rows of LANES numbers.
"""

from math import inf, nan

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import real, root, span, where
from quadcurv.kernels.gather import BLOCKS, LANES, neighbourhoods, step, windows
from quadcurv.kernels.vector import triple

# Below this part of a term's square nothing is left but rounding.
PIVOT = 1e-9
# Columns of a result.
MEAN, GAUSSIAN, K1, K2 = 0, 1, 2, 3
DIRECTION1, DIRECTION2, NORMAL = slice(4, 7), slice(7, 10), slice(10, 13)
SIGMA, ERROR, CONDITION, COLUMNS = 13, 14, 18, 19  # ERROR: four of them
# Seen from the other side: H -> -H, k1 -> -k2.
TURNED = np.array([0, 1, 3, 2, 7, 8, 9, 4, 5, 6, 10, 11, 12, 13, 14, 15, 17, 16, 18])
SIGNS = np.array([-1.0, 1, -1, -1, 1, 1, 1, 1, 1, 1, -1, -1, -1, 1, 1, 1, 1, 1, 1])

# Rows of `lane`: the axes of the frame; sums of x^2, x y, y^2, z^2 and of weights; the affine map
# x = xx x', y = yx x' + yy y'; what of a term's square the terms before it left, at least; an inverse.
AXES, SXX, SXY, SYY, SZZ, SW = (k * LANES for k in (0, 9, 10, 11, 12, 13))
XX, YX, YY, LEAST, INVERSE = (k * LANES for k in (14, 15, 16, 17, 18))


def terms_of(degree):
    """Exponents of the terms in the order of their elimination: x, y, x^2, x y, y^2 last."""
    higher = [(d - b, b) for d in range(degree, 2, -1) for b in range(d + 1)]
    return [*higher, (0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]


def workspace(degree):
    """Scratch of `fit`, and which of its rows make which.

    Returns
    -------
    lane, px, py, mu, nu, A
        Rows: see above; powers of x and y; moments and those with z; the Cholesky factor, with the
        right-hand side as its last row.
    products, entries
        Rows (mu, px, py) of moments, those with z last; rows (A, mu) of the normal equations, the right-hand
        side last, (A, nu).
    """
    terms, top, T = terms_of(degree), 2 * degree, (degree + 1) * (degree + 2) // 2
    moments = [(a, b) for b in range(top + 1) for a in range(top + 1 - b)]
    with_z = [(a, b) for b in range(degree + 1) for a in range(degree + 1 - b)]
    products = [(k, a, b) for table in (moments, with_z) for k, (a, b) in enumerate(table)]
    entries = [
        (i * T + j, moments.index((terms[i][0] + terms[j][0], terms[i][1] + terms[j][1])))
        for i in range(T)
        for j in range(i + 1)
    ]
    entries += [(T * T + i, with_z.index(term)) for i, term in enumerate(terms)]
    rows = (19, top + 1, top + 1, len(moments), len(with_z), (T + 1) * T)
    scratch = (np.zeros(count * LANES) for count in rows)
    return *scratch, flat(products, np.int32), flat(entries, np.int32)


@step()
def frames(normals, block, lane):
    """Unit normals and, after Duff et al. 2017, bases of their planes without a branch."""
    for k in span(0, LANES):
        nx, ny, nz = triple(normals, 3 * block * LANES + k, LANES)
        length = root(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
        sign = where(nz >= 0, 1.0, -1.0)
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        axes = 1.0 + sign * nx * nx * a, sign * b, -sign * nx, b, sign + ny * ny * a, -ny, nx, ny, nz
        for row, x in enumerate(axes):
            lane[AXES + row * LANES + k] = x
        for row in (SXX, SXY, SYY, SZZ, SW):
            lane[row + k] = 0.0


@step()
def into_frames(P, m, lane):
    """Turn row m of neighbourhoods into their frames; sum its moments."""
    for k in span(0, LANES):
        i = 4 * m * LANES + k
        dx, dy, dz = triple(P, i, LANES)
        x, y, z = (
            lane[AXES + r * LANES + k] * dx
            + lane[AXES + (r + 1) * LANES + k] * dy
            + lane[AXES + (r + 2) * LANES + k] * dz
            for r in (0, 3, 6)
        )
        P[i], P[i + LANES], P[i + 2 * LANES] = x, y, z
        for row, value in ((SXX, x * x), (SXY, x * y), (SYY, y * y), (SZZ, z * z)):
            lane[row + k] += value
        lane[SW + k] += P[i + 3 * LANES]


@step()
def affine_maps(lane):
    """Maps that make second moments unit ones."""
    for k in span(0, LANES):
        weight = lane[SW + k]
        xx = root(lane[SXX + k] / weight)
        yx = lane[SXY + k] / (weight * xx)
        square = lane[SYY + k] / weight - yx * yx
        lane[XX + k], lane[YX + k], lane[YY + k] = xx, yx, root(where(square < 0, 0.0, square))
        lane[LEAST + k] = 1.0


@step()
def first_powers(P, m, lane, px, py):
    """Powers 0 and 1 of x, the same of y times the weight."""
    for k in span(0, LANES):
        i = 4 * m * LANES + k
        weight, x = P[i + 3 * LANES], P[i] / lane[XX + k]
        px[k], px[LANES + k] = 1.0, x
        py[k], py[LANES + k] = weight, (P[i + LANES] - lane[YX + k] * x) / lane[YY + k]


@step()
def next_powers(px, py, a):
    """Power a of x and y."""
    for k in span(0, LANES):
        i = a * LANES + k
        px[i] = px[i - LANES] * px[LANES + k]
        py[i] = py[i - LANES] * py[LANES + k]


@step()
def add_moment(sums, px, py, products, t):
    """Add one product."""
    i, a, b = (products[3 * t + k] * LANES for k in range(3))
    for k in span(0, LANES):
        sums[i + k] += px[a + k] * py[b + k]


@step()
def clear(rows, count):
    """Make rows zero."""
    for k in span(0, count * LANES):
        rows[k] = 0.0


@step()
def powers_with_z(P, m, py, b):
    """Multiply a power of y by z."""
    for k in span(0, LANES):
        py[b * LANES + k] *= P[(4 * m + 2) * LANES + k]


@step()
def put_entry(A, mu, nu, without_z, entries, t):
    """One of the normal equations' entries."""
    moments = where(without_z, mu, nu)
    i, j = entries[2 * t] * LANES, entries[2 * t + 1] * LANES
    for k in span(0, LANES):
        A[i + k] = moments[j + k]


@step()
def pivot(A, lane, mu, diagonal, moment):
    """How much of a term's square is left, of 1; the inverse of its root."""
    for k in span(0, LANES):
        left = A[diagonal * LANES + k]
        share, least = left / mu[moment * LANES + k], lane[LEAST + k]
        lane[LEAST + k] = where(share < least, share, least)
        lane[INVERSE + k] = 1.0 / root(left)


@step()
def scale_entry(A, lane, i):
    """An entry of the factor."""
    for k in span(0, LANES):
        A[i * LANES + k] *= lane[INVERSE + k]


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
        lane[SZZ + k] -= x * x


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
def result(A, lane, T, k, out, at):
    """All results of the k-th fit."""
    # The last rows and columns of the Cholesky factor, (6, 5), the right-hand side last.
    B = {(i, j): A[((T - 5 + i) * T + T - 5 + j) * LANES + k] for i in range(6) for j in range(5) if j <= i}
    frame = [lane[AXES + row * LANES + k] for row in range(9)]
    weight = lane[SW + k]
    freedom, square = weight - real(T), lane[SZZ + k]
    sigma = where(freedom > 0, root(where(square < 0, 0.0, square) / freedom), nan)
    values, errors = curvatures(B, lane[XX + k], lane[YX + k], lane[YY + k], frame)
    errors = [error * sigma for error in errors]
    for column, x in enumerate((*values, sigma, *errors, sensitivity(B) * root(weight))):
        out[at * COLUMNS + column] = x


def sensitivity(B):
    """How errors in z pass on to the second-order terms: the root of the sum of their variances."""
    b00, b11, b22 = 1 / B[2, 2], 1 / B[3, 3], 1 / B[4, 4]
    b10 = -B[3, 2] * b00 * b11
    b21 = -B[4, 3] * b11 * b22
    b20 = -(B[4, 2] * b00 + B[4, 3] * b10) * b22
    return root(b00 * b00 + b10 * b10 + b20 * b20 + b11 * b11 + b21 * b21 + b22 * b22)


def curvatures(B, xx, yx, yy, frame):
    """The first 13 columns of a result, and the standard errors of four of them for sigma = 1."""
    c02 = B[5, 4] / B[4, 4]
    c11 = (B[5, 3] - B[4, 3] * c02) / B[3, 3]
    c20 = (B[5, 2] - B[3, 2] * c11 - B[4, 2] * c02) / B[2, 2]
    c01 = (B[5, 1] - B[2, 1] * c20 - B[3, 1] * c11 - B[4, 1] * c02) / B[1, 1]
    c10 = (B[5, 0] - B[1, 0] * c01 - B[2, 0] * c20 - B[3, 0] * c11 - B[4, 0] * c02) / B[0, 0]

    # d/dx = al d/dx' + be d/dy', d/dy = ga d/dy'.
    al, be, ga = 1 / xx, -yx / (xx * yy), 1 / yy
    p, q = al * c10 + be * c01, ga * c01
    zxx = 2 * (al * al * c20 + al * be * c11 + be * be * c02)
    zxy = ga * (al * c11 + 2 * be * c02)
    zyy = 2 * ga * ga * c02

    # Shape operator ((a, b), (b, c)) in the basis e1 = (1, 0, p) / e, e2 = (-p q, e^2, q) / (e W).
    e2 = 1 + p * p
    e, W = root(e2), root(e2 + q * q)
    a = -zxx / (e2 * W)
    b = -(e2 * zxy - p * q * zxx) / (e2 * W * W)
    c = -(p * p * q * q * zxx - 2 * p * q * e2 * zxy + e2 * e2 * zyy) / (e2 * W * W * W)
    half, H = (a - c) / 2, (a + c) / 2
    size = root(half * half + b * b)
    # Half the angle of (half, b), the larger of cosine and sine first.
    larger = root((1 + where(half < 0, -half, half) / size) / 2)
    smaller = b / (2 * size * larger)
    cos, sin = where(half < 0, smaller, larger), where(half < 0, larger, smaller)
    cos, sin = where(size == 0, 1.0, cos), where(size == 0, 0.0, sin)
    first, second, normal = [], [], []
    for t1, t2, n in zip(frame[:3], frame[3:6], frame[6:], strict=True):
        f1 = (t1 + p * n) / e
        f2 = (-p * q * t1 + e2 * t2 + q * n) / (e * W)
        first.append(cos * f1 + sin * f2)
        second.append(cos * f2 - sin * f1)
        normal.append((n - p * t1 - q * t2) / W)

    # Standard errors to first order; those of the slopes are of a higher one.
    errors = []
    for da, db, dc in (
        (0.5, 0.0, 0.5),
        (c, -2 * b, a),
        (cos * cos, 2 * cos * sin, sin * sin),
        (sin * sin, -2 * cos * sin, cos * cos),
    ):
        dxx = -da / (e2 * W) + db * p * q / (e2 * W * W) - dc * p * p * q * q / (e2 * W * W * W)
        dxy = -db / (W * W) + dc * 2 * p * q / (W * W * W)
        dyy = -dc * e2 / (W * W * W)
        d20 = 2 * al * al * dxx
        d11 = 2 * al * be * dxx + ga * al * dxy
        d02 = 2 * be * be * dxx + 2 * ga * be * dxy + 2 * ga * ga * dyy
        u = d20 / B[2, 2]
        v = (d11 - B[3, 2] * u) / B[3, 3]
        w = (d02 - B[4, 2] * u - B[4, 3] * v) / B[4, 4]
        errors.append(root(u * u + v * v + w * w))
    return (H, a * c - b * b, H + size, H - size, *first, *second, *normal), errors


@kernel
def _fit(P, counts, normals, degree, out, size, lane, px, py, mu, nu, A, products, entries):
    T = (degree + 1) * (degree + 2) // 2
    moments, normal, room = (degree + 1) * (2 * degree + 1), T * (T + 1) // 2, P.size // (4 * LANES * BLOCKS)
    for block in range(counts.size):
        first, last = block * room, block * room + counts[block]
        frames(normals, block, lane)
        for m in range(first, last):
            into_frames(P, m, lane)
        affine_maps(lane)
        clear(mu, moments)
        clear(nu, T)
        for m in range(first, last):
            first_powers(P, m, lane, px, py)
            for a in range(2, 2 * degree + 1):
                next_powers(px, py, a)
            for t in range(moments):
                add_moment(mu, px, py, products, t)
            for b in range(degree + 1):
                powers_with_z(P, m, py, b)
            for t in range(moments, moments + T):
                add_moment(nu, px, py, products, t)
        for t in range(normal + T):
            put_entry(A, mu, nu, t < normal, entries, t)
        diagonal = 0
        for k in range(T):
            pivot(A, lane, mu, k * T + k, entries[2 * diagonal + 1])
            diagonal += k + 2
            for i in range(k, T + 1):
                scale_entry(A, lane, i * T + k)
            for i in range(k + 1, T + 1):
                for j in range(k + 1, min(i, T - 1) + 1):
                    eliminate(A, i * T + j, i * T + k, j * T + k)
            explain(A, lane, T * T + k)
        for k in range(min(LANES, size - block * LANES)):
            if is_determined(lane, k):
                result(A, lane, T, k, out, block * LANES + k)
            else:
                unknown(out, block * LANES + k, inf)


def grid_fits(points, normals, vertices, degree, rings, out):
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
    out : (k, COLUMNS) float64
        Filled. With several rings all is NaN, the CONDITION too, where the neighbourhood is too steep; with
        any, all but the CONDITION, infinite then, where it does not determine the polynomial.
    """
    work, columns, room = workspace(degree), points.shape[1], (2 * rings + 1) ** 2
    points, normals = flat(points), flat(normals)
    P, axes = np.empty(BLOCKS * room * 4 * LANES), np.empty(BLOCKS * 3 * LANES)
    steep = np.empty(BLOCKS * LANES, bool)
    for start in range(0, len(vertices), BLOCKS * LANES):
        some, results = flat(vertices[start : start + BLOCKS * LANES]), out[start : start + BLOCKS * LANES]
        counts = np.empty(-(-len(results) // LANES), np.int64)
        windows(points, normals, columns, some, rings, P, counts, axes, steep)
        _fit(P, counts, axes, degree, results.reshape(-1), len(results), *work)
        results[steep[: len(results)]] = np.nan


def face_fits(points, faces, indptr, corners, normals, sided, vertices, degree, rings, out):
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
    degree, rings, out
        As for grid_fits.
    """
    stamp, around = np.full(len(points), -1, np.int32), np.empty(len(points), np.int32)
    given = [flat(x) for x in (points, faces, indptr, corners, normals)]
    work, room, axes = workspace(degree), 32, np.empty(BLOCKS * 3 * LANES)
    P = np.empty(BLOCKS * room * 4 * LANES)
    for start in range(0, len(vertices), BLOCKS * LANES):
        some, results = flat(vertices[start : start + BLOCKS * LANES]), out[start : start + BLOCKS * LANES]
        counts = np.empty(-(-len(results) // LANES), np.int64)
        while (found := neighbourhoods(*given, sided, some, rings, P, counts, axes, stamp, around)) > room:
            stamp.fill(-1)
            room = 2 * found
            P = np.empty(BLOCKS * room * 4 * LANES)
        _fit(P, counts, axes, degree, results.reshape(-1), len(results), *work)
