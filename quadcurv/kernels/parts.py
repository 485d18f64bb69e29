"""Faces by the part that owns their vertices, and points in the order of a curve that fills space."""

import numpy as np

from quadcurv.kernels.compiled import flat, helper, kernel

_BITS = 21  # of each coordinate


@helper
def place_of(values, low, high, v):
    """The last place of ascending values from `low` up to `high` whose value is v at most, else `low`."""
    while high - low > 1:
        middle = (low + high) // 2
        if values[middle] <= v:
            low = middle
        else:
            high = middle
    return low


@kernel
def _owners(faces, cuts, number, part, count):
    renumbered, last = number.size > 0, 0
    for f in range(faces.size // 4):
        for s in range(4):
            v, p = faces[4 * f + s], -1
            if v >= 0:
                v = number[v] if renumbered else v
                if v < cuts[last] or v >= cuts[last + 1]:  # mostly it is the part of the corner before
                    last = place_of(cuts, 0, cuts.size - 1, v)
                p = last
            for t in range(s):
                if part[4 * f + t] == p:
                    p = -1
            part[4 * f + s] = p
            if p >= 0:
                count[p] += 1


@kernel
def _by_part(faces, first, number, part, place, out):
    renumbered = number.size > 0
    for f in range(faces.size // 4):
        for s in range(4):
            p = part[4 * f + s]
            if p >= 0:
                k = place[p]
                place[p] = k + 1
                out[5 * k] = first + f
                for t in range(4):
                    v = faces[4 * f + t]
                    out[5 * k + 1 + t] = number[v] if renumbered and v >= 0 else v


def by_part(faces, first, cuts, number):
    """Faces (m, 4) int32, the first of them being face `first`, by part, in their order.

    Parameters
    ----------
    faces : (m, 4) int32
    first : int
    cuts : (parts + 1,) int64
        Part p owns the vertices cuts[p] up to cuts[p + 1].
    number : (n,) int32
        New numbers of vertices; empty where they keep theirs.

    Returns
    -------
    out : (k, 5) int32
        Number of the face and its vertices; each face once for every part that owns one of them.
    begin : (parts + 1,) int64
        Those of part p are ``out[begin[p]:begin[p + 1]]``.
    """
    part, count = np.empty(faces.size, np.int32), np.zeros(cuts.size - 1, np.int64)
    faces, cuts, number = flat(faces, np.int32), flat(cuts, np.int64), flat(number, np.int32)
    _owners(faces, cuts, number, part, count)
    begin = np.concatenate(([0], np.cumsum(count)))
    out = np.empty((begin[-1], 5), np.int32)
    _by_part(faces, first, number, part, begin[:-1].copy(), out.reshape(-1))
    return out, begin


@kernel
def _corners(faces, begin, end, used, beyond):
    count = 0
    for f in range(faces.size // 5):
        for k in range(5 * f + 1, 5 * f + 5):
            v = faces[k]
            if v >= begin and v < end:
                used[v - begin] = True
            elif v >= 0:
                beyond[count] = v
                count += 1
    return count


def corners(faces, begin, end):
    """Which of the vertices begin..end faces (k, 5) as `by_part` has them have, and all their others (c,)."""
    used, beyond = np.zeros(end - begin, np.bool_), np.empty(4 * len(faces), np.int32)
    count = _corners(flat(faces, np.int32), begin, end, used, beyond)
    return used, beyond[:count].copy()


@kernel
def _placed(faces, begin, own, beyond, place, out):
    for f in range(faces.size // 5):
        for s in range(4):
            v = faces[5 * f + 1 + s]
            k = v - begin
            if v < 0:
                out[4 * f + s] = -1
            elif k >= 0 and k < own.size:
                out[4 * f + s] = own[k]
            else:
                out[4 * f + s] = place[place_of(beyond, 0, beyond.size, v)]


def placed(faces, begin, own, beyond, place):
    """Faces (k, 4) int32 over other numbers of their vertices.

    Parameters
    ----------
    faces : (k, 5) int32
        As `by_part` has them.
    begin : int
    own : (c,) int32
        New numbers of the vertices from `begin` on.
    beyond, place : (b,) int32
        All other vertices, in ascending order, and their new numbers.
    """
    out = np.empty((len(faces), 4), np.int32)
    given = (flat(array, np.int32) for array in (own, beyond, place))
    _placed(flat(faces, np.int32), begin, *given, out.reshape(-1))
    return out


@kernel
def _curve(points, low, scale, key):
    for i in range(key.size):
        found = 0
        for axis in range(3):
            x = np.int64((points[3 * i + axis] - low[axis]) * scale)
            for bit in range(_BITS):
                found |= ((x >> bit) & 1) << (3 * bit + axis)
        key[i] = found


def curve(points, low, size):
    """Place (n,) int64 of points along Morton's curve through the cube at `low` of that size."""
    key = np.empty(len(points), np.int64)
    scale = (2**_BITS - 1) / size if size > 0 else 0.0
    _curve(flat(points, np.float64), flat(low, np.float64), scale, key)
    return key
