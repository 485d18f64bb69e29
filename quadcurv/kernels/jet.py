"""Polynomial fits of height over the tangent plane ("jets", Cazals and Pouget 2005), many at a time.

Around a vertex, in a frame whose z axis is the normal of its ring, the neighbourhood is fitted by
z = sum c_ab x^a y^b, a + b <= degree, in the least-squares sense. x and y are first made to have unit second
moments (an affine map, under which the polynomials stay what they are): the conditioning then depends on
the shape of the neighbourhood alone, neither on its size nor on its stretching. The normal equations
are those of the moments sum x^a y^b, 45 numbers for degree 4. Their terms are eliminated highest degree
first, so that what the curvature needs (c10, c01, c20, c11, c02) comes last: the last block of the
Cholesky factor gives it, and its covariance, without the others.

LANES fits go through every step together, the innermost loops running over them.
"""

from functools import partial

import numpy as np
from numba import njit

LANES = 48
# Below this part of a term's square nothing is left but rounding.
PIVOT = 1e-9
# Steepest that a neighbourhood of more than one ring may be. A polynomial follows no steeper one (a sphere is
# vertical where its powers stop converging), and what folds over is no graph at all.
SLOPE = 2.0
# Columns of a result.
MEAN, GAUSSIAN, K1, K2 = 0, 1, 2, 3
DIRECTION1, DIRECTION2, NORMAL = slice(4, 7), slice(7, 10), slice(10, 13)
SIGMA, ERROR, CONDITION, COLUMNS = 13, 14, 18, 19  # ERROR: four of them
# Seen from the other side: H -> -H, k1 -> -k2.
TURNED = np.array([0, 1, 3, 2, 7, 8, 9, 4, 5, 6, 10, 11, 12, 13, 14, 15, 17, 16, 18])
SIGNS = np.array([-1.0, 1, -1, -1, 1, 1, 1, 1, 1, 1, -1, -1, -1, 1, 1, 1, 1, 1, 1])

# Nothing but fused multiply-adds is left to the compiler: NaN stays NaN. An unsigned index saves it the look
# whether to count from the end.
compiled = partial(njit, cache=True, nogil=True, error_model="numpy", fastmath={"contract"})


@compiled()
def terms_of(degree):
    """Exponents (T, 2) of the terms in the order of their elimination: x, y, x^2, x y, y^2 last."""
    terms = np.empty(((degree + 1) * (degree + 2) // 2, 2), np.int64)
    t = 0
    for d in range(degree, 2, -1):
        for b in range(d + 1):
            terms[t, 0], terms[t, 1] = d - b, b
            t += 1
    for a, b in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
        terms[t, 0], terms[t, 1] = a, b
        t += 1
    return terms


@compiled()
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
    width = 2 * rings + 1
    P = np.empty((width * width, 4, LANES))
    frame = np.empty((9, LANES))
    work = workspace(degree)
    terms = terms_of(degree)
    for start in range(0, len(vertices), LANES):
        lanes = min(LANES, len(vertices) - start)
        for lane in range(LANES):
            i, j = vertices[start + min(lane, lanes - 1)]
            cx, cy, cz = points[i, j, 0], points[i, j, 1], points[i, j, 2]
            m = 0
            for u in range(i - rings, i + rings + 1):
                for v in range(j - rings, j + rings + 1):
                    x = points[u, v, 0]
                    known = x == x
                    P[m, 0, lane] = x - cx if known else 0.0
                    P[m, 1, lane] = points[u, v, 1] - cy if known else 0.0
                    P[m, 2, lane] = points[u, v, 2] - cz if known else 0.0
                    P[m, 3, lane] = 1.0 if known else 0.0
                    m += 1
            # Across the ring of edge neighbours; missing ones are at the centre.
            n, s = (m - 1) // 2 - width, (m - 1) // 2 + width
            w, e = (m - 1) // 2 - 1, (m - 1) // 2 + 1
            ax, ay, az = (
                P[s, 0, lane] - P[n, 0, lane],
                P[s, 1, lane] - P[n, 1, lane],
                P[s, 2, lane] - P[n, 2, lane],
            )
            bx, by, bz = (
                P[e, 0, lane] - P[w, 0, lane],
                P[e, 1, lane] - P[w, 1, lane],
                P[e, 2, lane] - P[w, 2, lane],
            )
            frame[6, lane], frame[7, lane], frame[8, lane] = (
                ay * bz - az * by,
                az * bx - ax * bz,
                ax * by - ay * bx,
            )
        fit(P, width * width, frame, degree, terms, work, out[start : start + lanes])
        for k in range(start, start + lanes):
            if rings > 1 and steep_window(normals, vertices[k, 0], vertices[k, 1], rings):
                out[k] = np.nan


@compiled()
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
    P = np.empty((32, 4, LANES))
    frame = np.empty((9, LANES))
    work = workspace(degree)
    terms = terms_of(degree)
    stamp = np.full(len(points), -1, np.int32)
    around = np.empty(len(points), np.int32)
    for start in range(0, len(vertices), LANES):
        lanes = min(LANES, len(vertices) - start)
        count = 0
        for lane in range(LANES):
            c = vertices[start + min(lane, lanes - 1)]
            m = 0
            if lane < lanes:
                m = neighbourhood(faces, indptr, corners, c, rings, stamp, around)
                if sided and rings > 1 and steep(normals, around, m):
                    m = 0
            if m > len(P):
                larger = np.empty((2 * m, 4, LANES))
                larger[:count] = P[:count]
                P = larger
            cx, cy, cz = points[c, 0], points[c, 1], points[c, 2]
            for k in range(m):
                v = np.uint32(around[k])
                P[k, 0, lane] = points[v, 0] - cx
                P[k, 1, lane] = points[v, 1] - cy
                P[k, 2, lane] = points[v, 2] - cz
                P[k, 3, lane] = 1.0
            if m > count:
                P[count:m, :, :lane] = 0.0
                count = m
            P[m:count, :, lane] = 0.0
            for x in range(3):
                frame[6 + x, lane] = normals[c, x]
        fit(P, count, frame, degree, terms, work, out[start : start + lanes])


@compiled()
def neighbourhood(faces, indptr, corners, c, rings, stamp, around):
    """Write c and the vertices of `rings` rings of faces around it to `around`; how many they are."""
    stamp[c] = c
    around[0] = c
    begin, end = 0, 1
    for _ in range(rings):
        new = end
        for q in range(begin, end):
            v = np.uint32(around[q])
            for k in range(indptr[v], indptr[v + 1]):
                f = np.uint32(corners[np.uint64(k)]) >> np.uint32(2)
                for s in range(4):
                    x = faces[f, s]
                    if x >= 0 and stamp[x] != c:
                        stamp[x] = c
                        around[new] = x
                        new += 1
        begin, end = end, new
    return end


@compiled()
def turned(x, y, z, nx, ny, nz):
    """Whether the first normal, of any length, is further than SLOPE from the second; not if it is NaN."""
    up, size = x * nx + y * ny + z * nz, nx * nx + ny * ny + nz * nz
    return (1.0 + SLOPE * SLOPE) * up / size * abs(up) < x * x + y * y + z * z


@compiled()
def steep_window(normals, i, j, rings):
    """As `steep`, of the window around row i and column j; NaN where there is no vertex."""
    nx, ny, nz = normals[i, j, 0], normals[i, j, 1], normals[i, j, 2]
    found = False
    for u in range(i - rings, i + rings + 1):
        for v in range(j - rings, j + rings + 1):
            found |= turned(normals[u, v, 0], normals[u, v, 1], normals[u, v, 2], nx, ny, nz)
    return found


@compiled()
def steep(normals, around, m):
    """Whether the normal of any vertex of a neighbourhood turns too far from that of the first."""
    c = around[0]
    nx, ny, nz = normals[c, 0], normals[c, 1], normals[c, 2]
    found = False
    for k in range(1, m):
        v = np.uint32(around[k])
        if v < len(normals):
            found |= turned(normals[v, 0], normals[v, 1], normals[v, 2], nx, ny, nz)
    return found


@compiled()
def workspace(degree):
    """Scratch of `fit`: powers of x and y; moments, those with z; Cholesky factor; lane scratch."""
    d, T = degree, (degree + 1) * (degree + 2) // 2
    return (
        np.empty((2 * d + 1, LANES)),
        np.empty((2 * d + 1, LANES)),
        np.empty((2 * d + 1, 2 * d + 1, LANES)),
        np.empty((d + 1, d + 1, LANES)),
        np.empty((T + 1, T, LANES)),
        np.empty((8, LANES)),
    )


@compiled()
def fit(P, count, frame, degree, terms, work, out):
    """Fit LANES neighbourhoods P[:count] (x, y, z, weight; changed) with normals frame[6:9]."""
    px, py, mu, nu, A, scratch = work
    L = P.shape[2]
    sxx, sxy, syy, szz, sw = scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    scratch[:] = 0.0
    for lane in range(L):
        nx, ny, nz = frame[6, lane], frame[7, lane], frame[8, lane]
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        nx, ny, nz = nx / length, ny / length, nz / length
        # Duff et al. 2017: a basis of the tangent plane without a branch.
        sign = 1.0 if nz >= 0 else -1.0
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        frame[0, lane], frame[1, lane], frame[2, lane] = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
        frame[3, lane], frame[4, lane], frame[5, lane] = b, sign + ny * ny * a, -ny
        frame[6, lane], frame[7, lane], frame[8, lane] = nx, ny, nz
    for m in range(count):
        for lane in range(L):
            dx, dy, dz, w = P[m, 0, lane], P[m, 1, lane], P[m, 2, lane], P[m, 3, lane]
            x = frame[0, lane] * dx + frame[1, lane] * dy + frame[2, lane] * dz
            y = frame[3, lane] * dx + frame[4, lane] * dy + frame[5, lane] * dz
            z = frame[6, lane] * dx + frame[7, lane] * dy + frame[8, lane] * dz
            P[m, 0, lane], P[m, 1, lane], P[m, 2, lane] = x, y, z
            sxx[lane] += x * x
            sxy[lane] += x * y
            syy[lane] += y * y
            szz[lane] += z * z
            sw[lane] += w
    # x = xx x', y = yx x' + yy y' with unit second moments of x', y'.
    xx, yx, yy = scratch[5], scratch[6], scratch[7]
    for lane in range(L):
        xx[lane] = np.sqrt(sxx[lane] / sw[lane])
        yx[lane] = sxy[lane] / (sw[lane] * xx[lane])
        yy[lane] = np.sqrt(max(syy[lane] / sw[lane] - yx[lane] * yx[lane], 0.0))

    mu[:] = 0.0
    nu[:] = 0.0
    top = 2 * degree
    for m in range(count):
        x, y, z, w = P[m, 0], P[m, 1], P[m, 2], P[m, 3]
        for lane in range(L):
            px[0, lane] = 1.0
            py[0, lane] = w[lane]
            px[1, lane] = x[lane] / xx[lane]
            py[1, lane] = (y[lane] - yx[lane] * px[1, lane]) / yy[lane]
        for a in range(2, top + 1):
            for lane in range(L):
                px[a, lane] = px[a - 1, lane] * px[1, lane]
                py[a, lane] = py[a - 1, lane] * py[1, lane]
        for b in range(top + 1):
            for a in range(top + 1 - b):
                for lane in range(L):
                    mu[a, b, lane] += px[a, lane] * py[b, lane]
        for b in range(degree + 1):
            for lane in range(L):
                py[b, lane] *= z[lane]
            for a in range(degree + 1 - b):
                for lane in range(L):
                    nu[a, b, lane] += px[a, lane] * py[b, lane]

    T = len(terms)
    for i in range(T):
        for j in range(i + 1):
            A[i, j] = mu[terms[i, 0] + terms[j, 0], terms[i, 1] + terms[j, 1]]
        A[T, i] = nu[terms[i, 0], terms[i, 1]]
    condition, inverse = sxx, sxy
    condition[:] = 1.0
    for k in range(T):
        a, b = 2 * terms[k, 0], 2 * terms[k, 1]
        for lane in range(L):
            # What of the term's square the terms before it leave, of 1.
            condition[lane] = min(condition[lane], A[k, k, lane] / mu[a, b, lane])
            inverse[lane] = 1.0 / np.sqrt(A[k, k, lane])
        for i in range(k, T + 1):
            for lane in range(L):
                A[i, k, lane] *= inverse[lane]
        for i in range(k + 1, T + 1):
            for j in range(k + 1, min(i, T - 1) + 1):
                for lane in range(L):
                    A[i, j, lane] -= A[i, k, lane] * A[j, k, lane]
        for lane in range(L):
            szz[lane] -= A[T, k, lane] * A[T, k, lane]

    for lane in range(len(out)):
        if not condition[lane] > PIVOT:
            out[lane] = np.nan
            out[lane, CONDITION] = np.inf
            continue
        B = A[T - 5 :, T - 5 :, lane]
        curvatures(B, xx[lane], yx[lane], yy[lane], frame[:, lane], out[lane])
        freedom = sw[lane] - T
        out[lane, SIGMA] = np.sqrt(max(szz[lane], 0.0) / freedom) if freedom > 0 else np.nan
        for k in range(4):
            out[lane, ERROR + k] *= out[lane, SIGMA]
        out[lane, CONDITION] = sensitivity(B) * np.sqrt(sw[lane])


@compiled()
def sensitivity(B):
    """How errors in z pass on to the second-order terms: the root of the sum of their variances."""
    b00, b11, b22 = 1 / B[2, 2], 1 / B[3, 3], 1 / B[4, 4]
    b10 = -B[3, 2] * b00 * b11
    b21 = -B[4, 3] * b11 * b22
    b20 = -(B[4, 2] * b00 + B[4, 3] * b10) * b22
    return np.sqrt(b00 * b00 + b10 * b10 + b20 * b20 + b11 * b11 + b21 * b21 + b22 * b22)


@compiled()
def curvatures(B, xx, yx, yy, frame, out):
    """Curvatures from the last rows and columns of the Cholesky factor, (6, 5), the right-hand side last."""
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
    e, W = np.sqrt(e2), np.sqrt(e2 + q * q)
    a = -zxx / (e2 * W)
    b = -(e2 * zxy - p * q * zxx) / (e2 * W * W)
    c = -(p * p * q * q * zxx - 2 * p * q * e2 * zxy + e2 * e2 * zyy) / (e2 * W * W * W)
    half, H = (a - c) / 2, (a + c) / 2
    root = np.sqrt(half * half + b * b)
    out[0], out[1], out[2], out[3] = H, a * c - b * b, H + root, H - root
    # Half the angle of (half, b), the larger of cosine and sine first.
    if root == 0:
        cos, sin = 1.0, 0.0
    elif half >= 0:
        cos = np.sqrt((1 + half / root) / 2)
        sin = b / (2 * root * cos)
    else:
        sin = np.sqrt((1 - half / root) / 2)
        cos = b / (2 * root * sin)
    for x in range(3):
        t1, t2, n = frame[x], frame[3 + x], frame[6 + x]
        f1 = (t1 + p * n) / e
        f2 = (-p * q * t1 + e2 * t2 + q * n) / (e * W)
        out[4 + x] = cos * f1 + sin * f2
        out[7 + x] = cos * f2 - sin * f1
        out[10 + x] = (n - p * t1 - q * t2) / W

    # Standard errors for sigma = 1, to first order; those of the slopes are of a higher one.
    for k in range(4):
        if k == 0:
            da, db, dc = 0.5, 0.0, 0.5
        elif k == 1:
            da, db, dc = c, -2 * b, a
        elif k == 2:
            da, db, dc = cos * cos, 2 * cos * sin, sin * sin
        else:
            da, db, dc = sin * sin, -2 * cos * sin, cos * cos
        dxx = -da / (e2 * W) + db * p * q / (e2 * W * W) - dc * p * p * q * q / (e2 * W * W * W)
        dxy = -db / (W * W) + dc * 2 * p * q / (W * W * W)
        dyy = -dc * e2 / (W * W * W)
        d20 = 2 * al * al * dxx
        d11 = 2 * al * be * dxx + ga * al * dxy
        d02 = 2 * be * be * dxx + 2 * ga * be * dxy + 2 * ga * ga * dyy
        u = d20 / B[2, 2]
        v = (d11 - B[3, 2] * u) / B[3, 3]
        w = (d02 - B[4, 2] * u - B[4, 3] * v) / B[4, 4]
        out[ERROR + k] = np.sqrt(u * u + v * v + w * w)
