"""Curvatures, directions and their errors of a polynomial of height, from its Cholesky factor."""

from quadcurv.kernels.formulas import root, where


def variances(B):
    """Those of the last three coefficients before the constant one, and their covariances, for sigma = 1."""
    rows = []  # of the inverse of the factor, transposed
    for j in range(2, 5):
        row = {j: B[j, j]}
        for i in range(j + 1, 6):
            row[i] = -sum(B[i, k] * row[k] for k in range(j, i)) * B[i, i]
        rows.append(row)
    return [sum(rows[i][k] * rows[j][k] for k in rows[j]) for i, j in INDICES]


INDICES = (0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)


def curvatures(B, constant, xx, yx, yy, bend, frame, S):
    """The first 13 columns of a result, and the standard errors of four of them for sigma = 1."""
    right = [B[6, j] - B[5, j] * constant for j in range(5)]
    c02 = right[4] * B[4, 4]
    c11 = (right[3] - B[4, 3] * c02) * B[3, 3]
    c20 = (right[2] - B[3, 2] * c11 - B[4, 2] * c02) * B[2, 2]
    c01 = (right[1] - B[2, 1] * c20 - B[3, 1] * c11 - B[4, 1] * c02) * B[1, 1]
    c10 = (right[0] - B[1, 0] * c01 - B[2, 0] * c20 - B[3, 0] * c11 - B[4, 0] * c02) * B[0, 0]

    # d/dx = al d/dx' + be d/dy', d/dy = ga d/dy'.
    al, ga = 1 / xx, 1 / yy
    shear, stretch = -yx * ga, xx * ga
    be = al * shear
    p, q = al * c10 + be * c01, ga * c01
    zxx = 2 * (al * al * c20 + al * be * c11 + be * be * c02)
    zxy = ga * (al * c11 + 2 * be * c02)
    zyy = 2 * ga * ga * c02

    # Shape operator ((a, b), (b, c)) in the basis e1 = (1, 0, p) / e, e2 = (-p q, e^2, q) / (e W), and the
    # sphere's. Quotients take long: all are products with four reciprocals, i those of e^2 and j those of W.
    e2, pq = 1 + p * p, p * q
    i, j = 1 / e2, 1 / root(e2 + q * q)
    along = i * zxx
    a = (bend - along) * j
    b = (pq * along - zxy) * j * j
    c = (bend - (pq * pq * along - 2 * pq * zxy + e2 * zyy) * j * j) * j
    half, H = (a - c) / 2, (a + c) / 2
    size = root(half * half + b * b)
    # Half the angle of (half, b), the larger of cosine and sine first.
    inverse = 0.5 / size
    larger = root(0.5 + where(half < 0, -half, half) * inverse)
    smaller = b * inverse / larger
    cos, sin = where(half < 0, smaller, larger), where(half < 0, larger, smaller)
    cos, sin = where(size == 0, 1.0, cos), where(size == 0, 0.0, sin)
    first, second, normal, over_e = [], [], [], root(i)
    for t1, t2, n in zip(frame[:3], frame[3:6], frame[6:], strict=True):
        f1 = (t1 + p * n) * over_e
        f2 = (-pq * t1 + e2 * t2 + q * n) * (over_e * j)
        first.append(cos * f1 + sin * f2)
        second.append(cos * f2 - sin * f1)
        normal.append((n - p * t1 - q * t2) * j)

    # Standard errors to first order; those of the slopes are of a higher one. The squares are of numbers
    # without al^2: with it, those of the smallest meshes overflow, and those of the largest ones vanish.
    errors = []
    for da, db, dc in (
        (0.5, 0.0, 0.5),
        (c, -2 * b, a),
        (cos * cos, 2 * cos * sin, sin * sin),
        (sin * sin, -2 * cos * sin, cos * cos),
    ):
        dxx = (-da + (db - dc * pq * j) * pq * j) * i * j
        dxy = (2 * dc * pq * j - db) * j * j
        dyy = -dc * e2 * j * j * j
        u = 2 * dxx
        v = 2 * shear * dxx + stretch * dxy
        w = 2 * shear * shear * dxx + 2 * stretch * shear * dxy + 2 * stretch * stretch * dyy
        square = u * u * S[0] + v * v * S[2] + w * w * S[5]
        square += 2 * (u * v * S[1] + u * w * S[3] + v * w * S[4])
        errors.append(al * al * root(where(square < 0, 0.0, square)))
    return (H, a * c - b * b, H + size, H - size, *first, *second, *normal), errors
