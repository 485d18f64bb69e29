"""Faces by the part that owns their vertices, and points in the order of a curve that fills space."""

import numpy as np

from quadcurv.kernels.compiled import flat, helper, kernel

_BITS = 21  # of each coordinate


@helper
def owner(cuts, v):
    """The part whose range of vertices holds v."""
    low, high = 0, cuts.size - 1
    while high - low > 1:
        middle = (low + high) // 2
        if cuts[middle] <= v:
            low = middle
        else:
            high = middle
    return low


@kernel
def _owners(faces, cuts, number, part, count):
    renumbered = number.size > 0
    for f in range(faces.size // 4):
        for s in range(4):
            v, p = faces[4 * f + s], -1
            if v >= 0:
                p = owner(cuts, number[v] if renumbered else v)
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
