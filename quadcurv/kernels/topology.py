"""Which corners meet at a vertex, and in which order.

Faces are an (m, 4) int32 array, a triangle's last entry being -1. Corner 4 f + s is slot s of face f.
"""

import numpy as np
from numba import njit

ISOLATED, INTERIOR, BOUNDARY, SEVERAL_FANS = 0, 1, 2, 3


@njit(cache=True, nogil=True, error_model="numpy")
def corners_by_vertex(faces, n):
    """Counting sort of all corners by their vertex: (indptr, corners)."""
    indptr = np.zeros(n + 1, np.int64)
    for f in range(faces.shape[0]):
        for s in range(4):
            if faces[f, s] >= 0:
                indptr[faces[f, s] + 1] += 1
    for i in range(n):
        indptr[i + 1] += indptr[i]
    fill = indptr[:-1].copy()
    corners = np.empty(indptr[n], np.int64)
    for f in range(faces.shape[0]):
        for s in range(4):
            v = faces[f, s]
            if v >= 0:
                corners[fill[v]] = 4 * f + s
                fill[v] += 1
    return indptr, corners


@njit(cache=True, nogil=True, error_model="numpy")
def neighbours(faces, corner):
    """Next and previous edge neighbour of the vertex at a corner."""
    f, s = corner // 4, corner % 4
    sides = 3 if faces[f, 3] < 0 else 4
    return faces[f, (s + 1) % sides], faces[f, (s + sides - 1) % sides]


@njit(cache=True, nogil=True, error_model="numpy")
def order_rings(faces, indptr, corners):
    """Sort each vertex's corners in place into its fan, counter-clockwise from a boundary if it has one.

    Returns
    -------
    kind : (n,) uint8
        ISOLATED, INTERIOR, BOUNDARY or SEVERAL_FANS.
    flipped : (number of corners,) bool
        Corners that run against the first one of their fan.
    bad_edge : (3,) int64
        Vertex, neighbour of the first edge with more than two faces, -1 if none; how many such edges.
    n_disagree : int
        Interior edges whose two faces run the same way along them.
    """
    n = indptr.size - 1
    kind = np.zeros(n, np.uint8)
    flipped = np.zeros(corners.size, np.bool_)
    bad_edge = np.array([-1, -1, 0])
    n_disagree = 0
    # One entry a neighbour, stamped with the vertex at hand: a pole costs O(valence), not its square.
    stamp = np.full(n, -1, np.int64)
    first = np.empty(n, np.int64)
    second = np.empty(n, np.int64)
    count = np.empty(n, np.int64)
    role = np.empty(n, np.int64)  # of the first corner's: 0 where it is "next", 1 where "previous"
    for v in range(n):
        begin, end = indptr[v], indptr[v + 1]
        valence = end - begin
        if valence == 0:
            continue
        for k in range(begin, end):
            for r, x in enumerate(neighbours(faces, corners[k])):
                if stamp[x] != v:
                    stamp[x], first[x], second[x], count[x], role[x] = v, k, -1, 1, r
                    continue
                count[x] += 1
                second[x] = k
                if count[x] == 2:
                    n_disagree += v < x and role[x] == r
                elif count[x] == 3 and v < x:
                    if bad_edge[2] == 0:
                        bad_edge[0], bad_edge[1] = v, x
                    bad_edge[2] += 1
        start, flip = begin, False
        for k in range(begin, end):
            a, b = neighbours(faces, corners[k])
            if count[a] == 1:
                start, flip = k, False
                break
            if count[b] == 1:
                start, flip = k, True
        ring = np.empty(valence, np.int64)
        turned = np.empty(valence, np.bool_)
        used, k, closed = 0, start, False
        while used < valence:
            ring[used], turned[used] = corners[k], flip
            used += 1
            a, b = neighbours(faces, corners[k])
            exit_ = a if flip else b
            other = second[exit_] if first[exit_] == k else first[exit_]
            if other < 0 or count[exit_] > 2:
                break
            if other == start:
                closed = True
                break
            k, flip = other, neighbours(faces, corners[other])[0] != exit_
        if used < valence:
            kind[v] = SEVERAL_FANS
            continue
        kind[v] = INTERIOR if closed else BOUNDARY
        for i in range(valence):
            corners[begin + i] = ring[i]
            flipped[begin + i] = turned[i]
    return kind, flipped, bad_edge, n_disagree


@njit(cache=True, nogil=True, error_model="numpy")
def colour(faces, indptr, corners, n):
    """Colour vertices 0..n-1, no two along an edge of a quad alike; -1 for all others.

    Greedy in breadth-first order, which gives two colours wherever two suffice.
    """
    colours = np.full(indptr.size - 1, -1, np.int64)
    taken = np.full(indptr.size, -1, np.int64)
    queue = np.empty(n, np.int64)
    queued = np.zeros(n, np.bool_)
    size = 0
    head = 0
    for root in range(n):
        if queued[root]:
            continue
        queue[size], queued[root] = root, True
        size += 1
        while head < size:
            v = queue[head]
            head += 1
            for k in range(indptr[v], indptr[v + 1]):
                if faces[corners[k] // 4, 3] < 0:
                    continue
                for x in neighbours(faces, corners[k]):
                    if colours[x] >= 0:
                        taken[colours[x]] = v
                    if x < n and not queued[x]:
                        queue[size], queued[x] = x, True
                        size += 1
            c = 0
            while taken[c] == v:
                c += 1
            colours[v] = c
    return colours
