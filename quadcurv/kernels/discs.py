"""Integrals over the part of a surface of flat triangles that lies within a distance of each vertex.

A face of four corners is four triangles around the mean of its corners, whose value is their mean; values are
linear in triangles. What is integrated is exact to rounding: a sphere cuts the plane of a triangle in a disc.
"""

from math import atan2, sqrt

import numpy as np

from quadcurv.kernels import ranges, topology
from quadcurv.kernels.compiled import flat, helper, kernel
from quadcurv.kernels.vector import cross, less, plus, times, triple

_WORK = 200  # of one disc, in vertices of the finite-volume scheme

_cross, _less, _plus, _times, _triple = map(helper, (cross, less, plus, times, triple))


@helper
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@helper
def _sector(ax, ay, bx, by, square):
    """Area and first moments of the sector of a disc from the direction of a to that of b."""
    a, b = sqrt(ax * ax + ay * ay), sqrt(bx * bx + by * by)
    angle = atan2(ax * by - ay * bx, ax * bx + ay * by)
    third = square * sqrt(square) / 3
    return square * angle / 2, third * (by / b - ay / a), third * (ax / a - bx / b)


@helper
def _edge(ax, ay, bx, by, square):
    """Signed area and first moments of what triangle (0, a, b) and a disc around 0 have in common."""
    dx, dy = bx - ax, by - ay
    length, along, beyond = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - square
    root = along * along - length * beyond
    if root <= 0:
        return _sector(ax, ay, bx, by, square)
    root = sqrt(root)
    t, u = (-along - root) / length, (-along + root) / length
    if t >= 1 or u <= 0:
        return _sector(ax, ay, bx, by, square)
    area, mx, my = 0.0, 0.0, 0.0
    px, py, qx, qy = ax, ay, bx, by
    if t > 0:
        px, py = ax + t * dx, ay + t * dy
        area, mx, my = _sector(ax, ay, px, py, square)
    if u < 1:
        qx, qy = ax + u * dx, ay + u * dy
        s, sx, sy = _sector(qx, qy, bx, by, square)
        area, mx, my = area + s, mx + sx, my + sy
    inner = (px * qy - py * qx) / 2
    return area + inner, mx + inner * (px + qx) / 3, my + inner * (py + qy) / 3


@helper
def _disc(a, b, c, square):
    """Weights of the corners of a triangle: integrals of their hat functions within a distance of 0."""
    u, v = _less(b, a), _less(c, a)
    n = _cross(u, v)
    twice, base = sqrt(_dot(n, n)), sqrt(_dot(u, u))
    if not twice > 0:
        return 0.0, 0.0, 0.0
    n, e = _times(n, 1 / twice), _times(u, 1 / base)
    f = _cross(n, e)
    height = _dot(a, n)
    rest = square - height * height
    if not rest > 0:
        return 0.0, 0.0, 0.0
    ax, ay = _dot(a, e), _dot(a, f)
    bx, cx, cy = ax + base, _dot(c, e), _dot(c, f)
    s0, x0, y0 = _edge(ax, ay, bx, ay, rest)
    s1, x1, y1 = _edge(bx, ay, cx, cy, rest)
    s2, x2, y2 = _edge(cx, cy, ax, ay, rest)
    s, x, y = s0 + s1 + s2, x0 + x1 + x2 - ax * (s0 + s1 + s2), y0 + y1 + y2 - ay * (s0 + s1 + s2)
    if not s > 1e-14 * twice:
        return 0.0, 0.0, 0.0
    wc = y / (cy - ay)
    wb = (x - wc * (cx - ax)) / base
    return s - wb - wc, wb, wc


@helper
def _face(points, faces, f, x, square):
    """Weights of the four corners of a face, the last one's zero where it has three."""
    a, b = (
        _less(_triple(points, 3 * faces[4 * f], 1), x),
        _less(_triple(points, 3 * faces[4 * f + 1], 1), x),
    )
    c = _less(_triple(points, 3 * faces[4 * f + 2], 1), x)
    if faces[4 * f + 3] < 0:
        wa, wb, wc = _disc(a, b, c, square)
        return wa, wb, wc, 0.0
    d = _less(_triple(points, 3 * faces[4 * f + 3], 1), x)
    m = _times(_plus(_plus(a, b), _plus(c, d)), 0.25)
    a0, b0, m0 = _disc(a, b, m, square)
    b1, c1, m1 = _disc(b, c, m, square)
    c2, d2, m2 = _disc(c, d, m, square)
    d3, a3, m3 = _disc(d, a, m, square)
    m4 = (m0 + m1 + m2 + m3) / 4
    return a0 + a3 + m4, b0 + b1 + m4, c1 + c2 + m4, d2 + d3 + m4


@helper
def _inside(points, faces, f, x, square):
    """Whether all corners of a face lie within a distance of x, and hence all of it."""
    for s in range(4):
        v = faces[4 * f + s]
        if v >= 0:
            d = _less(_triple(points, 3 * v, 1), x)
            if not _dot(d, d) <= square:
                return False
    return True


@kernel
def _integrals(
    points, faces, indptr, corners, values, columns, whole, radius, start, stop, stamp, queue, areas, out
):
    """Areas, and integrals of so many columns of values, around vertices from `start` to `stop`."""
    square = radius * radius
    for v in range(start, stop):
        x = _triple(points, 3 * v, 1)
        begin, end = 0, 0
        for k in range(indptr[v], indptr[v + 1]):
            f = corners[k] >> 2
            if stamp[f] != v:
                stamp[f] = v
                queue[end] = f
                end += 1
        while begin < end:
            f = queue[begin]
            begin += 1
            if _inside(points, faces, f, x, square):
                met = True
                areas[v] += whole[f * (columns + 1) + columns]
                for j in range(columns):
                    out[v * columns + j] += whole[f * (columns + 1) + j]
            else:
                weights = _face(points, faces, f, x, square)
                met = weights[0] + weights[1] + weights[2] + weights[3] > 0
                if met:
                    for s in range(4):
                        c = faces[4 * f + s]
                        if c >= 0:
                            areas[v] += weights[s]
                            for j in range(columns):
                                out[v * columns + j] += weights[s] * values[c * columns + j]
            if met:
                for s in range(4):
                    c = faces[4 * f + s]
                    if c >= 0:
                        for k in range(indptr[c], indptr[c + 1]):
                            g = corners[k] >> 2
                            if stamp[g] != v:
                                stamp[g] = v
                                queue[end] = g
                                end += 1


def _wholes(points, faces, values):
    """Integrals of values over whole faces, and the areas of these in the last column."""
    total = np.zeros((len(faces), values.shape[1] + 1))
    corners = np.where(faces < 0, faces[:, [2]], faces)  # a triangle's last edge has no length
    quad = faces[:, 3] >= 0
    middle = np.where(quad[:, None], points[corners].mean(axis=1), points[corners[:, 0]])
    between = np.where(quad[:, None], values[corners].mean(axis=1), values[corners[:, 0]])
    for s in range(4):
        p, q = corners[:, s], corners[:, (s + 1) % 4]
        area = np.linalg.norm(np.cross(points[p] - middle, points[q] - middle), axis=1) / 2
        total[:, -1] += area
        some = area > 0
        total[some, :-1] += area[some, None] * (values[p] + values[q] + between)[some] / 3
    return total


def integrals(points, faces, values, radius):
    """Integrals of values around every vertex, over what is connected with it within a distance.

    Parameters
    ----------
    points : (n, 3) float64
    faces : (m, 4) int32
        A last corner of -1 makes a triangle.
    values : (n, k) float64
        NaN makes integrals NaN of which it is a part.
    radius : float

    Returns
    -------
    areas : (n,) float64
    integrals : (n, k) float64
    """
    n, columns = values.shape
    points = points - points[:1]
    whole = flat(_wholes(points, faces, values))
    indptr, corners = topology.corners_by_vertex(faces, n)
    areas, out = np.zeros(n), np.zeros(n * columns)
    arrays = flat(points), flat(faces, np.int32), flat(indptr), flat(corners), flat(values), columns, whole

    def run(start, stop):
        stamp, queue = np.full(len(faces), -1, np.int64), np.empty(len(faces), np.int64)
        _integrals(*arrays, float(radius), start, stop, stamp, queue, areas, out)

    ranges.over(run, n, n * _WORK)
    return areas, out.reshape(n, columns)
