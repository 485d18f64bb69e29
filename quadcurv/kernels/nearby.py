"""What lies around vertices of a face list, ring by ring."""

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import Carried, formula, real, span, where

FACES = 16  # of a vertex, of which others are passed over: as many lie around a pole as anybody wants to see


@kernel
def _rings_around(faces, indptr, corners, vertices, rings, room, stamp, around, ring):
    for k in range(vertices.size):
        base = k * room
        around[base], ring[base] = vertices[k], 0
        stamp[vertices[k]] = k
        begin, end = 0, 1
        for r in range(1, rings + 1):
            new = end
            for q in range(begin, end):
                v = around[base + q]
                step = max(1, (indptr[v + 1] - indptr[v]) // FACES)
                for at in range(indptr[v], indptr[v + 1], step):
                    f = corners[at] >> 2
                    for s in range(4):
                        x = faces[4 * f + s]
                        if x >= 0 and stamp[x] != k and new < room:
                            stamp[x] = k
                            around[base + new], ring[base + new] = x, r
                            new += 1
            if new == room and r > 1:  # a ring in parts would be worse than none
                break
            begin, end = end, new
        for q in range(end, room):
            around[base + q], ring[base + q] = -1, rings + 1


def rings_around(faces, indptr, corners, vertices, rings, room):
    """Vertices of `rings` rings of faces around each of some vertices, as many as there is room for.

    Returns
    -------
    around : (k, room) int32
        The vertex itself, then ring after ring; -1 behind.
    ring : (k, room) uint8
        In which ring they are.
    """
    around, ring = np.empty((vertices.size, room), np.int32), np.empty((vertices.size, room), np.uint8)
    stamp = np.full(indptr.size - 1, -1, np.int64)
    _rings_around(
        flat(faces),
        flat(indptr),
        flat(corners),
        flat(vertices, np.int64),
        rings,
        room,
        stamp,
        around.reshape(-1),
        ring.reshape(-1),
    )
    return around, ring


@formula
def mean(indptr, indices, values, columns, column, v):
    """Of the finite values of one column over the neighbours of a vertex."""
    sums = Carried((0.0, 0))
    for k in span(indptr[v], indptr[v + 1]):
        x, (total, count) = values[indices[k] * columns + column], sums.get()
        known = x - x == 0.0
        sums.set((total + where(known, x, 0.0), count + where(known, 1, 0)))
    total, count = sums.get()
    return total / real(count)


@kernel
def _means(indptr, indices, values, columns, out, start, stop):
    for v in range(start, stop):
        for column in range(columns):
            out[v * columns + column] = mean(indptr, indices, values, columns, column, v)


def means(indptr, indices, values):
    """Means of finite values (n, k) over neighbours in CSR form, NaN where there is none."""
    n, columns = values.shape
    given, out = (flat(indptr), flat(indices), flat(values), columns), np.empty(n * columns)
    ranges.over(lambda start, stop: _means(*given, out, start, stop), n, n)
    return out.reshape(n, columns)
