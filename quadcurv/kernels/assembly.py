"""Matrices over faces put together: the pattern of the sum once, then values into their places."""

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.parts import place_of


@kernel
def _faces_by_vertex(first, corners, start, around):
    # `start` counts up where the next face of a vertex goes, and so ends up one vertex ahead.
    for c in range(corners.size):
        start[corners[c] + 2] += 1
    for w in range(start.size - 2):
        start[w + 2] += start[w + 1]
    for f in range(first.size - 1):
        for c in range(first[f], first[f + 1]):
            w = corners[c] + 1
            around[start[w]] = f
            start[w] += 1


@kernel
def _columns(first, corners, start, around, last, end, indices):
    # Where `indices` has no room they are only counted.
    n = last.size
    for w in range(start.size - 2):
        for k in range(start[w], start[w + 1]):
            for c in range(first[around[k]], first[around[k] + 1]):
                v = corners[c]
                if v < n and last[v] != w:
                    last[v] = w
                    if indices.size > 0:
                        indices[end[v]] = w
                    end[v] += 1


def pattern(first, corners, n, p):
    """CSR pattern of rows 0..n of a sum of matrices over faces: indptr (n + 1,) int64, indices int32.

    Face f has the vertices ``corners[first[f]:first[f + 1]]``, all less than p. Columns come out sorted: they
    are gone through in their order, each being appended to the rows that it stands in.
    """
    first, corners = flat(first), flat(corners)
    start, around = np.zeros(p + 2, np.int64), np.empty(corners.size, np.int32)
    _faces_by_vertex(first, corners, start, around)
    indptr, indices = np.zeros(n + 1, np.int64), np.empty(0, np.int32)
    _columns(first, corners, start, around, np.full(n, -1, np.int32), indptr[1:], indices)
    np.cumsum(indptr, out=indptr)
    end, indices = indptr[:-1].copy(), np.empty(indptr[-1], np.int32)
    if indices.size:
        _columns(first, corners, start, around, np.full(n, -1, np.int32), end, indices)
    return indptr, indices


@kernel
def _add(matrices, faces, sides, indptr, indices, data):
    n = indptr.size - 1
    for c in range(faces.size):
        v, first = faces[c], c - c % sides
        if v >= n:
            continue
        for j in range(sides):
            at = place_of(indices, indptr[v], indptr[v + 1], faces[first + j])
            data[at] += matrices[c * sides + j]


def add(matrices, faces, indptr, indices, data):
    """Add matrices (m, k, k) over faces (m, k) to the data of a CSR matrix, rows beyond its last left out."""
    _add(flat(matrices), flat(faces), faces.shape[1], flat(indptr), flat(indices), data)


@kernel
def _add_fluxes(matrices, points, faces, sides, flux):
    n = flux.size // 3
    for c in range(faces.size):
        v, first = faces[c], c - c % sides
        if v >= n:
            continue
        for j in range(sides):
            for x in range(3):
                # Relative to the vertex itself: rows sum to zero, but only up to rounding.
                along = points[3 * faces[first + j] + x] - points[3 * v + x]
                flux[3 * v + x] -= matrices[c * sides + j] * along


def add_fluxes(matrices, points, faces, flux):
    """Add -K x, K being matrices (m, k, k) over faces (m, k), to flux (n, 3), vertices from n on left out."""
    _add_fluxes(flat(matrices), flat(points), flat(faces), faces.shape[1], flux.reshape(-1))
