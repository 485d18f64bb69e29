"""What lies around vertices, as indices: for fits that go side by side, WIDTH of them a block.

A row of a block is one point of each of its neighbourhoods. Neighbourhoods of different size end with the
vertex itself, over and over, up to the size of the largest: `counts` tells how many points there are.
"""

import numpy as np

from quadcurv.kernels.compiled import flat, helper, kernel
from quadcurv.kernels.formulas import WIDTH, Carried, formula, span, where

CROWDED = 64  # faces of a vertex, of which others are passed over from twice as many on
ROOM = 6000  # points of all blocks that are gathered at once


class Blocks:
    """Room for the neighbourhoods of many blocks, and what is in it.

    Attributes
    ----------
    centres : (WIDTH b,) int32
        The vertices; the last one again where there are fewer.
    counts : (WIDTH b,) int32
        Points of each neighbourhood.
    index : (b room WIDTH,) int32
        Block by block, row by row.
    beside : (b,) bool
        Whether the indices of every row of a block follow each other: then the first of them will do.
    room : int
        Rows of a block.
    """

    def __init__(self, room):
        self.room, self.most = room, max(4, ROOM // room)
        self.centres, self.counts = np.zeros((2, WIDTH * self.most), np.int32)
        self.index, self.beside = np.zeros(WIDTH * self.most * room, np.int32), np.zeros(self.most, bool)
        self.size = 0

    def begin(self, vertices):
        """Take other vertices, WIDTH a block."""
        self.size = -(-len(vertices) // WIDTH)
        self.centres[: len(vertices)] = vertices
        self.centres[len(vertices) : WIDTH * self.size] = vertices[-1]


@formula
def window_beside(c, rings, columns, at, index):
    """The window of a vertex far from all sides, in the first column of a block."""
    for p in span(0, 2 * rings + 1):
        for q in span(0, 2 * rings + 1):
            index[at + (p * (2 * rings + 1) + q) * WIDTH] = c + (p - rings) * columns + q - rings


@formula
def clipped_window(row_of, column_of, columns, i, j, rings, at, index):
    """The window of a vertex as far as the grid goes; how many points it has."""
    size = Carried((0 * i,))
    for p in span(i, i + 2 * rings + 1):
        for q in span(j, j + 2 * rings + 1):
            (m,), row, column = size.get(), row_of[p], column_of[q]
            index[at + m * WIDTH] = row * columns + column
            size.set((m + where((row >= 0) & (column >= 0), 1, 0),))
    return size.get()[0]


@formula
def fill(index, at, begin, end, v):
    """Put a vertex into further rows."""
    for m in span(begin, end):
        index[at + m * WIDTH] = v


@formula
def in_a_row(centres, k):
    """Whether the vertices of a block, from the k-th on, follow each other."""
    found = centres[k] == centres[k]
    for lane in range(1, WIDTH):
        found = found & (centres[k + lane] == centres[k] + lane)
    return found


@kernel
def _windows(row_of, column_of, rings, centres, blocks, index, counts, beside):
    rows, columns = row_of.size - 2 * rings, column_of.size - 2 * rings
    room = (2 * rings + 1) * (2 * rings + 1)
    for k in range(WIDTH * blocks):
        block, at, c = k >> 3, (k >> 3) * room * WIDTH + (k & 7), centres[k]
        i, j = c // columns, c % columns
        if (k & 7) == 0:
            inside = rings <= i < rows - rings and rings <= j < columns - rings - WIDTH + 1
            beside[block] = inside and in_a_row(centres, k)
            if beside[block]:
                window_beside(c, rings, columns, at, index)
        counts[k] = room
        if not beside[block]:
            counts[k] = clipped_window(row_of, column_of, columns, i, j, rings, at, index)
            fill(index, at, counts[k], room, c)


class Windows:
    """Windows of 2 rings + 1 points in both directions, as far as a grid goes."""

    def __init__(self, shape, wrap, rings):
        places = []
        for size, wraps in zip(shape, wrap, strict=True):
            at = np.arange(-rings, size + rings)
            inside = (at >= 0) & (at < size)
            places.append(flat(at % size if wraps else np.where(inside, at, -1), np.int32))
        self._given = *places, rings

    def put(self, blocks):
        """Put those of the centres into blocks; how much room one needs."""
        given = blocks.centres, blocks.size, blocks.index, blocks.counts, blocks.beside
        _windows(*self._given, *given)
        return blocks.room


@formula
def corners_of(faces, f, mark, stamp, around, end):
    """Write those corners of a face that are new behind what is there; where that ends then."""
    for s in range(4):
        v = faces[4 * f + s]
        at = where(v < 0, stamp.size - 1, v)
        is_new = (v >= 0) & (stamp[at] != mark)
        around[end] = v
        stamp[at] = where(is_new, mark, stamp[at])
        end = end + where(is_new, 1, 0)
    return end


@formula
def new_ones(others, first, last, mark, stamp, around, end):
    """Write those of some vertices that are new behind what is there; where that ends then."""
    at = Carried((end,))
    for k in span(first, last):
        v, (end,) = others[k], at.get()
        is_new = stamp[v] != mark
        around[end] = v
        stamp[v] = mark
        at.set((end + where(is_new, 1, 0),))
    return at.get()[0]


@helper
def neighbourhood(faces, indptr, corners, c, rings, mark, stamp, around, seen, others, first, last):
    """Write c and the vertices of `rings` rings of faces around it to `around`; how many they are."""
    stamp[c] = mark
    around[0] = c
    begin, end = 0, 1
    for _ in range(rings):
        new = end
        for q in range(begin, end):
            v = around[q]
            if last[v] == 0:  # nobody has looked around it: behind all is the end of what is known of others
                first[v] = at = last[last.size - 1]
                seen[v] = v + 1
                # Of a vertex of very many faces, a pole, some stand for all: else its neighbours' fits would
                # each look at all of them.
                for k in range(indptr[v], indptr[v + 1], max(1, (indptr[v + 1] - indptr[v]) // CROWDED)):
                    at = corners_of(faces, corners[k] >> 2, v + 1, seen, others, at)
                last[v] = last[last.size - 1] = at
            new = new_ones(others, first[v], last[v], mark, stamp, around, new)
        begin, end = end, new
    return end


def step_to(ring, v, turn, direction):
    """The neighbour of a vertex in a direction, how far its ring is turned, and whether it is regular."""
    x = ring[8 * v + ((direction + turn) & 7)]
    back, found = 0, False
    for k in (0, 2, 4, 6):
        here = ring[8 * x + k] == v
        back, found = where(here, k, back), here | found
    return x, (back - direction - 4) & 7, found & (ring[8 * x] >= 0)


def half_row(ring, v, turn, direction, rings, at, step, around):
    """Write three rows of a window, from v on in a direction; whether vertices on the way are regular."""
    up = 1 if direction == 0 else 3
    state = Carried((v, turn, at, 1 + 0 * v))
    for _ in span(0, rings - 1):
        v, turn, at, known = state.get()
        for i, k in ((0, None), (1, 2), (-1, 6)):
            around[at + i] = v if k is None else ring[8 * v + ((k + turn) & 7)]
        x, turned, is_regular = step_to(ring, v, turn, direction)
        on = is_regular & (known > 0)
        state.set((where(on, x, v), where(on, turned, turn), at + step, where(on, 1, 0)))
    v, turn, at, known = state.get()
    for i, k in ((0, None), (1, 2), (-1, 6)):
        around[at + i] = v if k is None else ring[8 * v + ((k + turn) & 7)]
    for i, k in ((0, direction), (1, up), (-1, 8 - up)):
        around[at + step + i] = ring[8 * v + ((k + turn) & 7)]
    return known > 0


@formula
def window(ring, c, rings, phase, mark, stamp, around):
    """Write the neighbourhood of a regular vertex if it is a window: regular inside, no vertex there twice.

    Along every third of its rows, the outer ones but one among them, by the rings of the vertices there:
    `phase` is 1 - rings modulo 3. With 1 nobody looks at the middle row but itself.
    """
    width = 2 * rings + 1
    middle = rings * width + rings
    known = 1 + 0 * c
    for across, side in ((2, 1), (6, -1)):
        state = Carried((c, 0 * c, phase, known))
        for j in span(0, rings):
            v, turn, since, known = state.get()
            is_row = (since == 0) | ((j == 0) & (phase == 1))
            is_row = is_row & ((j > 0) | where(side > 0, True, False))
            rows = where(is_row, 1, 0)
            for along, step in ((0, width), (4, -1 * width)):
                right = Carried((known,))
                for _ in span(0, rows):
                    (before,) = right.get()
                    found = half_row(ring, v, turn, along, rings, middle + side * j, step, around)
                    right.set((where(found, before, 0),))
                (known,) = right.get()
            x, turned, is_regular = step_to(ring, v, turn, across)
            on = is_regular & (known > 0)
            last = j == rings - 1
            known = where(on | last, known, 0)
            state.set((where(on, x, v), where(on, turned, turn), where(since == 2, 0, since + 1), known))
        known = state.get()[3]
    fine = Carried((known,))
    for i in span(0, where(known > 0, width, 0)):
        for j in span(0, width):
            v, (known,) = around[i * width + j], fine.get()
            at_rim = (i == 0) | (i == width - 1) | (j == 0) | (j == width - 1)
            fine.set((where((stamp[v] != mark) & (at_rim | (ring[8 * v] >= 0)), known, 0),))
            stamp[v] = mark
    return fine.get()[0] > 0


@formula
def follow(run, around, rings):
    """Whether the windows of the next vertices are the first one's, every vertex replaced by its next."""
    width, least = 2 * rings + 1, Carried((WIDTH + 0 * rings,))
    for i in span(1, width - 1):
        for j in span(1, width - 1):
            (before,), here = least.get(), run[around[i * width + j]]
            least.set((where(here < before, here, before),))
    return least.get()[0] >= WIDTH - 1


@formula
def put(around, size, room, c, at, index):
    """Write a neighbourhood into a column of a block."""
    for m in span(0, size):
        index[at + m * WIDTH] = around[m]
    for m in span(size, room):
        index[at + m * WIDTH] = c


@kernel
def _neighbourhoods(
    faces, indptr, corners, ring, run, rings, centres, blocks, room, index, counts, beside, stamp, around,
    seen, others, first, last,
):  # fmt: skip
    mark, phase = stamp[stamp.size - 2], (1 - rings) % 3  # the last neighbourhood's
    for k in range(WIDTH * blocks):
        block, lane, c = k >> 3, k & 7, centres[k]
        m, is_window = (2 * rings + 1) * (2 * rings + 1), False
        if lane == 0 or not beside[block]:
            mark += 2
            if ring.size > 0 and ring[8 * c] >= 0:
                is_window = window(ring, c, rings, phase, mark, stamp, around)
            if not is_window:
                m = neighbourhood(
                    faces, indptr, corners, c, rings, mark + 1, stamp, around, seen, others, first, last
                )
                if m > room:
                    stamp[stamp.size - 2] = mark
                    return m
            if lane == 0:
                beside[block] = is_window and in_a_row(centres, k) and follow(run, around, rings)
            put(around, m, room, c, block * room * WIDTH + lane, index)
        counts[k] = m
    stamp[stamp.size - 2] = mark
    return room


@kernel
def _runs(ring, run):
    for v in range(run.size - 2, -1, -1):
        same = ring[8 * v] >= 0
        for k in range(8 * v, 8 * v + 8):
            same &= ring[k + 8] - ring[k] == 1
        run[v] = run[v + 1] + 1 if same else 0


def runs(ring):
    """(n,) int32: how many vertices after each have its ring, with every vertex replaced by its next."""
    run = np.zeros(len(ring), np.int32)
    _runs(flat(ring), run)
    return run


class Rings:
    """Neighbourhoods of a face list by rings of faces, for one thread.

    Parameters
    ----------
    faces : (m, 4) int32
    indptr, corners
        Corners by vertex, see topology.corners_by_vertex.
    ring : (n, 8) or (0, 8) int32
        See topology.rings. Neighbourhoods that are windows of a grid are found by it.
    run : (n,) or (0,) int32
        See `runs`.
    rings : int
    """

    def __init__(self, faces, indptr, corners, ring, run, rings):
        self._given = flat(faces), flat(indptr), flat(corners), flat(ring), flat(run), rings
        # Which neighbourhood a vertex was last in; behind the vertices, the number of the last one.
        self._stamp = np.zeros(indptr.size + 1, np.int32)
        self._around = np.empty(max(indptr.size + 4, (2 * rings + 1) ** 2), np.int32)
        # Around which vertex others were last found, and these; where those of each begin and end (0 where
        # nobody has looked yet), and behind all, where those that are known do.
        self._seen, self._others = np.zeros(indptr.size, np.int32), np.empty(3 * corners.size + 5, np.int32)
        self._first, self._last = np.empty(indptr.size, np.int64), np.zeros(indptr.size, np.int64)
        self._last[-1] = 1

    def put(self, blocks):
        """Put those of the centres into blocks; how much room one needs for which there is none."""
        return _neighbourhoods(
            *self._given, blocks.centres, blocks.size, blocks.room, blocks.index, blocks.counts,
            blocks.beside, self._stamp, self._around, self._seen, self._others, self._first, self._last,
        )  # fmt: skip
