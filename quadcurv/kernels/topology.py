"""Which corners meet at a vertex, and in which order.

Faces are an (m, 4) int32 array, a triangle's last entry being -1. Corner 4 f + s is slot s of face f.
"""

from functools import partial

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import helper, kernel
from quadcurv.kernels.formulas import formula, prefetch

ISOLATED, INTERIOR, BOUNDARY, SEVERAL_FANS, NONMANIFOLD = 0, 1, 2, 3, 4
FAR = 10_000  # vertices between neighbours in memory, on average, that are in no cache
AHEAD = 16  # faces or vertices: where what is read next lies far apart, it is asked for that early


@kernel
def checked(given, n, faces):
    """Copy (m, 3 or 4) faces to (m, 4) int32, -1 being added to triangles, and look for bad ones.

    Returns
    -------
    (first, count), (first, count)
        Faces with an index outside 0..n - 1, and faces with a repeated vertex.
    """
    outside, n_outside, repeated, n_repeated = -1, 0, -1, 0
    for f in range(given.shape[0]):
        h, i, j = given[f, 0], given[f, 1], given[f, 2]
        k = given[f, 3] if given.shape[1] == 4 else -1
        faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3] = h, i, j, k
        if min(h, i, j) < 0 or k < -1 or max(h, i, j, k) >= n:
            outside = f if n_outside == 0 else outside
            n_outside += 1
        if h == i or i == j or j == h or k in (h, i, j):
            repeated = f if n_repeated == 0 else repeated
            n_repeated += 1
    return (outside, n_outside), (repeated, n_repeated)


@kernel
def corners_by_vertex(faces, n):
    """Counting sort of all corners by their vertex: (indptr, corners)."""
    indptr = np.zeros(n + 1, np.int64)
    for f in range(faces.shape[0]):
        for s in range(4):
            if faces[f, s] >= 0:
                indptr[faces[f, s] + 1] += 1
    for i in range(n):
        indptr[i + 1] += indptr[i]
    corners = np.empty(indptr[n], np.int32)
    # indptr itself counts up where the next corner goes, and so ends up one vertex ahead.
    for f in range(faces.shape[0]):
        for s in range(4):
            v = faces[f, s]
            if v >= 0:
                corners[indptr[v]] = 4 * f + s
                indptr[v] += 1
    for i in range(n, 0, -1):
        indptr[i] = indptr[i - 1]
    indptr[0] = 0
    return indptr, corners


@kernel
def mean_distance(faces):
    """Mean distance in memory of a face's first two vertices, in vertices; of every 16th face."""
    total = count = 0
    for f in range(0, faces.shape[0], 16):
        total += abs(faces[f, 1] - faces[f, 0])
        count += 1
    return total / max(count, 1)


@formula
def ask(values, index):
    """Ask for the memory of an entry."""
    prefetch(values, index)


@kernel
def first_corners(faces, far, ring, ring8, valence):
    """Put the first four corners of every vertex into its row of `ring`, and count them as far as five."""
    for f in range(faces.shape[0]):
        if far and f + AHEAD < faces.shape[0]:
            for s in range(4):
                v = max(faces[f + AHEAD, s], 0)
                ask(ring8, 8 * v)
                ask(valence, v)
        for s in range(4):
            v = faces[f, s]
            if v >= 0 and valence[v] < 5:
                if valence[v] < 4:
                    ring[v, valence[v]] = 4 * f + s
                valence[v] += 1


@kernel
def regular_rings(faces, faces4, far, valence, ring, start, stop):
    """Rings (a, d, a, d, ...) of vertices start..stop inside four quads that run the same way round.

    Counter-clockwise from the first corner, eight vertices, where `first_corners` has put corners. A first
    entry of -1 marks all other vertices.
    """
    corners = np.empty(4, np.int32)
    for v in range(start, stop):
        if far and v + AHEAD < stop and valence[v + AHEAD] == 4:
            for k in range(4):
                ask(faces4, ring[v + AHEAD, k])
        if valence[v] != 4:
            ring[v, 0] = -1
            continue
        for k in range(4):
            corners[k] = ring[v, k]
        ring[v, 0] = -1
        f, s = corners[0] >> 2, corners[0] & 3
        first, exit_ = faces[f, (s + 1) & 3], faces[f, (s + 3) & 3]
        ring[v, 1] = faces[f, (s + 2) & 3]
        ok = faces[f, 3] >= 0
        for turn in range(1, 4):
            found = False
            for k in range(1, 4):
                f, s = corners[k] >> 2, corners[k] & 3
                if faces[f, (s + 1) & 3] == exit_:
                    found = faces[f, 3] >= 0
                    break
            if not found or exit_ == first:
                ok = False
                break
            ring[v, 2 * turn], ring[v, 2 * turn + 1] = exit_, faces[f, (s + 2) & 3]
            exit_ = faces[f, (s + 3) & 3]
        if not ok or exit_ != first:
            continue
        ring[v, 0] = first
        for k in range(1, 8, 2):
            for j in range(8):
                ok &= j == k or ring[v, j] != ring[v, k]
        if not ok:
            ring[v, 0] = -1


def rings(faces, n):
    """Ring (n, 8) int32 of every vertex, see `regular_rings`."""
    ring, valence, far = np.empty((n, 8), np.int32), np.zeros(n, np.uint8), mean_distance(faces) > FAR
    first_corners(faces, far, ring, ring.ravel(), valence)
    ranges.over(partial(regular_rings, faces, faces.ravel(), far, valence, ring), n, n)
    return ring


def fans(faces, n):
    """Rings; the vertices that have none; what `order_rings` says of these.

    Returns
    -------
    ring : (n, 8) int32
        See `regular_rings`. Where four quads run the same way round there is nothing to reject or to turn.
    others : (k,) int64
        Vertices without such a ring.
    kind, bad_edge, n_disagree
        See `order_rings`.
    """
    ring = rings(faces, n)
    others = np.flatnonzero(ring[:, 0] < 0)
    kind = np.full(n, INTERIOR, np.uint8)
    if others.size == 0:
        return ring, others, kind, np.array([-1, -1, 0]), 0
    kept, near = part_around(faces, others, n, 1)
    indptr, corners = corners_by_vertex(near, kept.size)
    kind_near, _, bad_edge, n_disagree = order_rings(near, indptr, corners, np.arange(others.size))
    kind[others] = kind_near[: others.size]
    if bad_edge[2]:
        bad_edge[:2] = kept[bad_edge[:2]]
    return ring, others, kind, bad_edge, n_disagree


@kernel
def surroundings(faces, vertices, n, reach):
    """Faces that one comes to from the vertices in `reach` steps from face to face, in their order."""
    level = np.full(n, reach, np.uint8)
    for v in vertices:
        level[v] = 0
    kept = np.zeros(faces.shape[0], np.bool_)
    for step in range(reach):
        for f in range(faces.shape[0]):
            if kept[f]:
                continue
            sides = 3 if faces[f, 3] < 0 else 4
            for s in range(sides):
                if level[faces[f, s]] <= step:
                    kept[f] = True
            if kept[f]:
                for s in range(sides):
                    level[faces[f, s]] = min(level[faces[f, s]], step + 1)
    return np.flatnonzero(kept)


def part_around(faces, vertices, n, reach):
    """Part of a mesh, `reach` faces beyond some vertices: its vertices, these first, and faces over them."""
    near = faces[surroundings(faces, vertices, n, reach)]
    known = np.zeros(n, np.bool_)
    known[near[near >= 0]] = True
    known[vertices] = False
    kept = np.concatenate((vertices, np.flatnonzero(known)))
    place = np.full(n + 1, -1, np.int32)  # the last one, which -1 reads, stays -1
    place[kept] = np.arange(kept.size)
    return kept, place[near]


@helper
def neighbours(faces, corner):
    """Next and previous edge neighbour of the vertex at a corner."""
    f, s = corner // 4, corner % 4
    sides = 3 if faces[f, 3] < 0 else 4
    return faces[f, (s + 1) % sides], faces[f, (s + sides - 1) % sides]


@kernel
def order_rings(faces, indptr, corners, vertices):
    """Sort the corners of some vertices in place into fans, counter-clockwise from a boundary if any.

    Returns
    -------
    kind : (n,) uint8
        ISOLATED, INTERIOR, BOUNDARY or SEVERAL_FANS; INTERIOR for all vertices not asked for.
    flipped : (number of corners,) bool
        Corners that run against the first one of their fan.
    bad_edge : (3,) int64
        Vertex, neighbour of the first edge with more than two faces, -1 if none; how many such edges.
    n_disagree : int
        Interior edges whose two faces run the same way along them.
    """
    n = indptr.size - 1
    kind = np.full(n, INTERIOR, np.uint8)
    flipped = np.zeros(corners.size, np.bool_)
    bad_edge = np.array([-1, -1, 0])
    n_disagree = 0
    # One entry a neighbour, stamped with the vertex at hand: a pole costs O(valence), not its square.
    stamp = np.full(n, -1, np.int32)
    first = np.empty(n, np.int64)
    second = np.empty(n, np.int64)
    count = np.empty(n, np.int64)
    role = np.empty(n, np.int64)  # of the first corner's: 0 where it is "next", 1 where "previous"
    for v in vertices:
        begin, end = indptr[v], indptr[v + 1]
        valence = end - begin
        if valence == 0:
            kind[v] = ISOLATED
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


@kernel
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
