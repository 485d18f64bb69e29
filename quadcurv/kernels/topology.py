"""Which corners meet at a vertex, and in which order.

Faces are an (m, 4) int32 array, a triangle's last entry being -1. Corner 4 f + s is slot s of face f.
"""

from functools import partial, reduce

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, prefetch, where
from quadcurv.kernels.vector import larger, smaller

ISOLATED, INTERIOR, BOUNDARY, SEVERAL_FANS, NONMANIFOLD = 0, 1, 2, 3, 4
FAR = 10_000  # vertices between neighbours in memory, on average, that are in no cache
AHEAD = 16  # faces or vertices: where what is read next lies far apart, it is asked for that early


@formula
def checked_face(given, f, sides, n, faces):
    """Copy a face; whether an index is outside, whether a vertex is repeated."""
    h, i, j = (given[sides * f + s] for s in range(3))
    k = where(sides == 4, given[sides * f + sides - 1], -1)
    for s, v in enumerate((h, i, j, k)):
        faces[4 * f + s] = v
    least, most = reduce(smaller, (h, i, j)), reduce(larger, (h, i, j, k))
    return (least < 0) | (k < -1) | (most >= n), (h == i) | (i == j) | (j == h) | (k == h) | (k == i) | (
        k == j
    )


@kernel
def _checked(given, sides, n, faces):
    outside, n_outside, repeated, n_repeated = -1, 0, -1, 0
    for f in range(faces.size // 4):
        is_outside, is_repeated = checked_face(given, f, sides, n, faces)
        if is_outside:
            outside = f if n_outside == 0 else outside
            n_outside += 1
        if is_repeated:
            repeated = f if n_repeated == 0 else repeated
            n_repeated += 1
    return outside, n_outside, repeated, n_repeated


def checked(given, n, faces):
    """Copy (m, 3 or 4) faces to (m, 4) int32, -1 being added to triangles, and look for bad ones.

    Returns
    -------
    (first, count), (first, count)
        Faces with an index outside 0..n - 1, and faces with a repeated vertex.
    """
    found = _checked(flat(given), given.shape[1], n, faces.ravel())
    return found[:2], found[2:]


@kernel
def _corners_by_vertex(faces, indptr, corners):
    for c in range(faces.size):
        if faces[c] >= 0:
            indptr[faces[c] + 1] += 1
    n = indptr.size - 1
    for i in range(n):
        indptr[i + 1] += indptr[i]
    # indptr itself counts up where the next corner goes, and so ends up one vertex ahead.
    for c in range(faces.size):
        v = faces[c]
        if v >= 0:
            corners[indptr[v]] = c
            indptr[v] += 1
    for i in range(n, 0, -1):
        indptr[i] = indptr[i - 1]
    indptr[0] = 0


def corners_by_vertex(faces, n):
    """Counting sort of all corners by their vertex: (indptr, corners)."""
    indptr, corners = np.zeros(n + 1, np.int64), np.empty(faces.size, np.int32)
    _corners_by_vertex(flat(faces), indptr, corners)
    return indptr, corners[: indptr[-1]]


def mean_distance(faces):
    """Mean distance in memory of a face's first two vertices, in vertices; of every 16th face."""
    return float(np.abs(np.diff(faces[::16, :2])).mean()) if len(faces) else 0.0


@formula
def ask(values, index):
    """Ask for the memory of an entry."""
    prefetch(values, index)


@formula
def ask_corners(faces, f, ring, valence):
    """Ask for what belongs to the vertices of a face."""
    for s in range(4):
        v = faces[4 * f + s]
        prefetch(ring, 8 * v)
        prefetch(valence, v)


@formula
def first_corner(faces, c, ring, valence):
    """Put a corner into the row of its vertex, after those that it has; more than five are not counted."""
    v = faces[c]
    count = valence[v]
    ring[8 * v + count] = c
    valence[v] = where(count < 5, count + 1, 5)


@kernel
def first_corners(faces, far, ring, valence):
    """Put the first four corners of every vertex into its row of `ring`, and count them as far as five."""
    for f in range(faces.size // 4):
        if far and f + AHEAD < faces.size // 4:
            ask_corners(faces, f + AHEAD, ring, valence)
        for c in range(4 * f, 4 * f + 4):
            if faces[c] >= 0:
                first_corner(faces, c, ring, valence)


@formula
def regular_ring(faces, ring, v):
    """Turn the first four corners of a vertex into its ring; -1 first if they have none."""
    around = []
    for k in range(4):
        corner = ring[8 * v + k]
        f, s = corner >> 2, corner & 3
        following, diagonal, previous = (faces[4 * f + ((s + i) & 3)] for i in (1, 2, 3))
        around.append((following, diagonal, previous, faces[4 * f + 3] >= 0))
    first, diagonal, end, regular = around[0]
    found = [first, diagonal]
    for _ in range(3):
        (a, *one), (b, *two), (c, *three) = around[1:]
        diagonal, following, quad = (
            where(a == end, x, where(b == end, y, z)) for x, y, z in zip(one, two, three, strict=True)
        )
        regular = regular & quad & (end != first) & ((a == end) | (b == end) | (c == end))
        found += [end, diagonal]
        end = following
    regular = regular & (end == first)
    for k in range(1, 8, 2):
        for j in range(8):
            if j != k:
                regular = regular & (found[j] != found[k])
    for j, x in enumerate(found):
        ring[8 * v + j] = where(regular, x, -1) if j == 0 else x


@kernel
def _regular_rings(faces, far, valence, ring, start, stop):
    for v in range(start, stop):
        if far and v + AHEAD < stop and valence[v + AHEAD] == 4:
            for k in range(4):
                ask(faces, 4 * (ring[8 * (v + AHEAD) + k] >> 2))
        if valence[v] == 4:
            regular_ring(faces, ring, v)
        else:
            ring[8 * v] = -1


def rings(faces, n):
    """Rings (a, d, a, d, ...) of vertices inside four quads that run the same way round, (n, 8) int32.

    Counter-clockwise from the first corner. A first entry of -1 marks all other vertices.
    """
    ring, valence, far = np.empty((n, 8), np.int32), np.zeros(n, np.uint8), mean_distance(faces) > FAR
    first_corners(flat(faces), far, ring.ravel(), valence)
    ranges.over(partial(_regular_rings, flat(faces), far, flat(valence), ring.ravel()), n, n)
    return ring


def fans(faces, n):
    """Rings; the vertices that have none; what `order_rings` says of these.

    Returns
    -------
    ring : (n, 8) int32
        See `rings`. Where four quads run the same way round there is nothing to reject or to turn.
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


@formula
def is_near(faces, f, level, step):
    """Whether a vertex of a face is at most `step` steps away."""
    a, b, c, d = (level[faces[4 * f + s]] <= step for s in (0, 1, 2, where(faces[4 * f + 3] < 0, 0, 3)))
    return a | b | c | d


@formula
def spread(faces, f, level, step):
    """The vertices of a face are one step further at most."""
    for s in (0, 1, 2, where(faces[4 * f + 3] < 0, 0, 3)):
        v = faces[4 * f + s]
        level[v] = where(level[v] > step, step + 1, level[v])


@kernel
def _surroundings(faces, level, reach, kept):
    for step in range(reach):
        for f in range(kept.size):
            if not kept[f] and is_near(faces, f, level, step):
                kept[f] = True
                spread(faces, f, level, step)


def surroundings(faces, vertices, n, reach):
    """Faces that one comes to from the vertices in `reach` steps from face to face, in their order."""
    level, kept = np.full(n, reach, np.uint8), np.zeros(len(faces), bool)
    level[vertices] = 0
    _surroundings(flat(faces), level, reach, kept)
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


@formula
def neighbour(faces, corner, previous):
    """Next or previous edge neighbour of the vertex at a corner."""
    f, s = corner >> 2, corner & 3
    last = where(faces[4 * f + 3] < 0, 2, 3)
    ahead, behind = where(s == last, 0, s + 1), where(s == 0, last, s - 1)
    return faces[4 * f + where(previous, behind, ahead)]


@kernel
def _order_rings(faces, indptr, corners, vertices, kind, flipped, bad_edge, seen, found, turns):
    # One entry a neighbour, stamped with the vertex at hand: a pole costs O(valence), not its square.
    n = kind.size
    stamp, first, second, count, role = 0, n, 2 * n, 3 * n, 4 * n  # a first corner's role: whether "previous"
    disagree = 0
    for v in vertices:
        begin, end = indptr[v], indptr[v + 1]
        valence = end - begin
        if valence == 0:
            kind[v] = ISOLATED
            continue
        for k in range(begin, end):
            for r in range(2):
                x = neighbour(faces, corners[k], r == 1)
                if seen[stamp + x] != v:
                    seen[stamp + x], seen[first + x], seen[second + x] = v, k, -1
                    seen[count + x], seen[role + x] = 1, r
                    continue
                seen[count + x] += 1
                seen[second + x] = k
                if seen[count + x] == 2:
                    if v < x and seen[role + x] == r:
                        disagree += 1
                elif seen[count + x] == 3 and v < x:
                    if bad_edge[2] == 0:
                        bad_edge[0], bad_edge[1] = v, x
                    bad_edge[2] += 1
        start, flip = begin, False
        for k in range(begin, end):
            if seen[count + neighbour(faces, corners[k], False)] == 1:
                start, flip = k, False
                break
            if seen[count + neighbour(faces, corners[k], True)] == 1:
                start, flip = k, True
        used, k, closed = 0, start, False
        while used < valence:
            found[used], turns[used] = corners[k], flip
            used += 1
            x = neighbour(faces, corners[k], not flip)
            other = seen[second + x] if seen[first + x] == k else seen[first + x]
            if other < 0 or seen[count + x] > 2:
                break
            if other == start:
                closed = True
                break
            k, flip = other, neighbour(faces, corners[other], False) != x
        if used < valence:
            kind[v] = SEVERAL_FANS
            continue
        kind[v] = INTERIOR if closed else BOUNDARY
        for i in range(valence):
            corners[begin + i] = found[i]
            flipped[begin + i] = turns[i]
    return disagree


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
    n, most = indptr.size - 1, int(np.diff(indptr).max(initial=0))
    kind, flipped, bad_edge = (
        np.full(n, INTERIOR, np.uint8),
        np.zeros(corners.size, bool),
        np.array([-1, -1, 0]),
    )
    seen = np.full(5 * n, -1, np.int64)
    found, turns = np.empty(most, np.int64), np.empty(most, bool)
    n_disagree = _order_rings(
        flat(faces), flat(indptr), corners, flat(vertices), kind, flipped, bad_edge, seen, found, turns
    )
    return kind, flipped, bad_edge, n_disagree
