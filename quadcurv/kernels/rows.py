"""The pass over the vertices of a grid, row by row: see `quad` for how its loops are written.

Of rows that follow each other, o, p and q say where in `planes` they are. Quads lie between p and q and add
to the vertices of both: the sums of p are finished, those of q wait in `part` for the next row of quads.
`work` holds what the loops over a stretch of a row, from column g on, leave for each other.

Planes of a row begin where a page of memory begins, or in its middle. (A load that follows a store to the
same place of another page waits for it; so placed, loads keep ahead of stores.)
"""

import numpy as np

from quadcurv.kernels.compiled import kernel
from quadcurv.kernels.formulas import (
    Carried,
    bits,
    formula,
    from_bits,
    make_zero,
    part_of,
    prefetch,
    span,
    where,
)
from quadcurv.kernels.quad import fluxes, quads_area, quads_scale, ring_area, ring_scale
from quadcurv.kernels.vector import (
    apart,
    cross,
    dot,
    known_ring_square,
    known_square,
    larger,
    less,
    middle,
    most_rounding,
    place,
    plus,
    smaller,
    times,
    triple,
    unit,
)

WIDTH = 2048  # columns done at once: their rows stay in the second-level cache
STRETCH = 80  # of them, by one loop after the other: what these leave stays in the first-level cache
LEAST_ROWS = 16  # of a range of its own, which computes a row of quads that others compute too
PAGE = 512  # doubles
Y = WIDTH + PAGE // 2  # between planes of a row
ROW = 3 * Y  # between rows
TOGETHER = 16  # of these, at least, by loops that have no remainder
S = STRETCH + 8  # between planes of a stretch
MOST = 2**63 - 1  # of bits
FIRST = 8  # place of the first vertex in a plane, its left neighbour before it
# In `work`: normals of quads, their squares, lengths, diagonals; normals of rings, their squares and scales;
# what sums of fluxes are multiplied by; what dual areas come from.
NORMAL, LENGTH, U, V, RING, SQUARE, RING_SCALE, SCALE, AREA, QUAD_SQUARE = (
    k * S for k in (0, 3, 4, 7, 10, 13, 14, 15, 16, 17)
)
PLANES = 16  # of the rows and of `part`
WORK = 23 * S
ROOM = PLANES * Y + WORK + PAGE  # and the beginning of a page


def make_room():
    """Scratch for one call of a pass, which begins where a page of memory does."""
    found = np.empty(ROOM)
    return found[-(found.__array_interface__["data"][0] // 8) % PAGE :]


@formula
def clear(planes, part, work, width):
    """Make zero what stretches read, being computed whole, before it is written.

    What lay in the memory before may be numbers so small that a processor takes a hundred times as long for
    each.
    """
    make_zero(work, 0, WORK)
    for plane in span(0, 12):
        make_zero(planes, plane * Y + FIRST + width, TOGETHER + 1)
    for plane in span(0, 4):
        make_zero(part, plane * Y + FIRST, width + TOGETHER)


@formula
def load_row(planes, to, points, beyond, inside, at, width, far):
    """Put a row that begins at number `at` of the points, or of those beyond them, into planes.

    Returns the bits of the largest square of any point's coordinates so far.
    """
    points = where(inside, points, beyond)
    most = Carried((far,))
    for k in span(0, width):
        point = triple(points, at + 3 * k, 1)
        place(planes, to + k, Y, point)
        most.set((larger(most.get()[0], bits(dot(point, point))),))
    return most.get()[0]


@formula
def load_ends(planes, to, points, beyond, beside, inside, first, begin, end, columns, row, rows, far):
    """Put the points before and after columns begin..end of a row, which begins at `first`, into planes.

    Where rows end they are those of `beside` at place `row`, or of a closed row the last and the first point.
    """
    closed, last = beside.size == 0, 3 * (columns - 1)
    points = where(inside, points, beyond)
    for at, within, next_to, other, place_beside in (
        (to - 1, begin > 0, 3 * begin - 3, last, row),
        (to + (end - begin), end < columns, 3 * end, 0, rows + 2 + row),
    ):
        source = where(within | closed, points, beside)
        place_there = where(within | closed, first + where(within, next_to, other), 3 * place_beside)
        point = triple(source, place_there, 1)
        place(planes, at, Y, point)
        far = larger(far, bits(dot(point, point)))
    return far


def diagonals(planes, p, q, i):
    """Of the quad whose first two vertices are at i in rows p and q, the others beside them."""
    return apart(planes, q + i + 1, planes, p + i, Y), apart(planes, p + i + 1, planes, q + i, Y)


def quad_middle(planes, p, q, i):
    """Of the same quad."""
    return middle(*(triple(planes, k, Y) for k in (p + i, q + i + 1, q + i, p + i + 1)))


def ring_diagonals(planes, o, p, q, i):
    """Of the ring polygon around the vertex at i in row p."""
    return apart(planes, q + i, planes, o + i, Y), apart(planes, p + i + 1, planes, p + i - 1, Y)


@formula
def first_quad(planes, p, q, work, coarse):
    """The quad before the first one of a row."""
    u, v = diagonals(planes, p, q, FIRST - 1)
    n = cross(u, v)
    square = known_square(n, u, v, quad_middle(planes, p, q, FIRST - 1), coarse)
    n, work[FIRST - 1 + LENGTH] = unit(n, square)
    place(work, FIRST - 1 + NORMAL, S, n)


@formula
def last_quad(work):
    """Make the last quad of a stretch the one before the next stretch."""
    for plane in (NORMAL, NORMAL + S, NORMAL + 2 * S, LENGTH):
        work[plane + FIRST - 1] = work[plane + FIRST + STRETCH - 1]


def normals(planes, o, p, q, work, g, width, padded, ring):
    """Diagonals and normals of quads; with `ring` squares of the rings' normals, with 2 these too.

    Returns the bits of the least square of the first `width` ones.
    """
    least = Carried((MOST,))
    for k in span(0, padded, 2):
        i, j = FIRST + g + k, FIRST + k
        u, v = diagonals(planes, p, q, i)
        place(work, j + U, S, u)
        place(work, j + V, S, v)
        n = cross(u, v)
        place(work, j + NORMAL, S, n)
        work[j + QUAD_SQUARE] = square = dot(n, n)
        found = bits(square)
        if ring:
            n = cross(*ring_diagonals(planes, o, p, q, i))
            work[j + SQUARE] = square = dot(n, n)
            found = smaller(found, bits(square))
            if ring == 2:
                place(work, j + RING, S, n)
        (before,) = least.get()
        least.set((smaller(before, where(k < width, found, MOST)),))
    return least.get()[0]


@formula
def quad_normals(planes, p, q, work, g, width, padded):
    """As `normals`, of no rings."""
    return normals(planes, None, p, q, work, g, width, padded, 0)


@formula
def quad_normals_ring_squares(planes, o, p, q, work, g, width, padded):
    """As `normals`, without those of rings."""
    return normals(planes, o, p, q, work, g, width, padded, 1)


@formula
def quad_and_ring_normals(planes, o, p, q, work, g, width, padded):
    """As `normals`."""
    return normals(planes, o, p, q, work, g, width, padded, 2)


@formula
def is_clear(least, far, coarse):
    """Whether all squares are larger than what rounding could make of zero, be it the most that there is."""
    return from_bits(least) > most_rounding(from_bits(far), coarse)


@formula
def known_squares(planes, o, p, q, work, g, padded, rings, coarse):
    """Make squares zero that are but for rounding, those of the rings too if they are there."""
    for k in span(0, padded, 1):
        i, j = FIRST + g + k, FIRST + k
        normal, u, v = (triple(work, j + plane, S) for plane in (NORMAL, U, V))
        work[j + QUAD_SQUARE] = known_square(normal, u, v, quad_middle(planes, p, q, i), coarse)
        n = cross(*ring_diagonals(planes, o, p, q, i))
        around = [triple(planes, k, Y) for k in (o + i, p + i - 1, q + i, p + i + 1)]
        square = known_ring_square(n, around, triple(planes, p + i, Y), coarse)
        work[j + SQUARE] = where(rings, square, work[j + SQUARE])


@formula
def finite_volume_scales(work, padded):
    """Make normals of quads of length one; scales from the squares of the rings' normals."""
    for j in span(FIRST, FIRST + padded, 2):
        work[j + SCALE] = ring_scale(work[j + SQUARE])
        n, _ = unit(triple(work, j + NORMAL, S), work[j + QUAD_SQUARE])
        place(work, j + NORMAL, S, n)


@formula
def liu_scales(work, part, g, padded):
    """Make normals of quads of length one; scales from the lengths that they had."""
    before = Carried((work[FIRST - 1 + LENGTH],))
    for k in span(0, padded, 2):
        i, j = FIRST + g + k + ROW, FIRST + k
        n, length = unit(triple(work, j + NORMAL, S), work[j + QUAD_SQUARE])
        place(work, j + NORMAL, S, n)
        both = length + before.get()[0]
        before.set((length,))
        lengths = part[i] + both
        part[i] = both
        work[j + AREA] = lengths
        work[j + SCALE] = quads_scale(lengths)
    work[FIRST + padded - 1 + LENGTH] = before.get()[0]


@formula
def ring_scales(work, padded):
    """What gives the normals of rings length one."""
    for j in span(FIRST, FIRST + padded, 2):
        work[j + RING_SCALE] = ring_scale(work[j + SQUARE])


def sums(planes, p, q, work, part, g, width):
    """Curvature normals of the vertices of row p; the sums of those of row q begin."""
    u, v = diagonals(planes, p, q, FIRST + g - 1)
    first, second = fluxes(u, v, triple(work, FIRST - 1 + NORMAL, S))
    before = Carried((*first, *second))
    for k in span(0, width):
        i, j = FIRST + g + k, FIRST + k
        u, v = triple(work, j + U, S), triple(work, j + V, S)
        first, second = fluxes(u, v, triple(work, j + NORMAL, S))
        others = before.get()
        before.set((*first, *second))
        t = plus(triple(part, i, Y), less(first, others[3:]))
        place(part, i, Y, less(second, others[:3]))
        yield k, times(t, work[j + SCALE])


@formula
def row_vectors(planes, p, q, work, part, unwanted, Hn, wanted, g, at, width):
    """Write the curvature normals of row p from vertex number `at` on, unless they are not wanted."""
    Hn, at = where(wanted, Hn, unwanted), where(wanted, at, 0)
    for k, h in sums(planes, p, q, work, part, g, width):
        place(Hn, 3 * (at + k), 1, h)


def ring_normal(work, scale, k):
    """Unit normal of the k-th ring of a stretch."""
    return times(triple(work, FIRST + k + RING, S), work[FIRST + k + scale])


@formula
def row_curvatures(planes, p, q, work, part, scale, H, g, at, width):
    """Write the curvatures of row p from vertex number `at` on."""
    for k, h in sums(planes, p, q, work, part, g, width):
        H[at + k] = -dot(h, ring_normal(work, scale, k))


@formula
def vector_curvatures(work, scale, Hn, H, at, width):
    """Write curvatures where their vectors have been written."""
    for k in span(0, width):
        H[at + k] = -dot(triple(Hn, 3 * (at + k), 1), ring_normal(work, scale, k))


@formula
def unit_normals(work, scale, normal, at, width):
    """Write normals."""
    for k in span(0, width):
        place(normal, 3 * (at + k), 1, ring_normal(work, scale, k))


@formula
def dual_areas(work, liu, area, at, width):
    """Write dual areas."""
    for k in span(0, width):
        j = FIRST + k
        area[at + k] = where(liu, quads_area(work[j + AREA]), ring_area(work[j + SQUARE]))


@formula
def ask(values, begin):
    """Ask for the memory of a stretch of points."""
    for k in range(0, STRETCH, 8):
        prefetch(values, begin + k)


@formula
def ask_to_write(values, begin):
    """Ask for the memory of a stretch of results."""
    for k in range(0, STRETCH, 8):
        prefetch(values, begin + k, write=True)


@kernel
def _pass(points, size, c, beyond, beside, coarse, liu, Hn, H, normal, area, start, stop, room):
    # An array of size 0 is a result that nobody wants.
    planes, part = part_of(room, 0, 4 * ROW), part_of(room, 4 * ROW, 4 * Y)
    work = part_of(room, PLANES * Y, WORK)
    rows, around, unwanted = points.size // size, beyond.size == 0, part_of(work, 18 * S, 3 * S)
    vectors, numbers, normals, areas = Hn.size > 0, H.size > 0, normal.size > 0, area.size > 0
    scale = RING_SCALE if liu else SCALE
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        o, p, q, fresh, far = 0, ROW, 2 * ROW, 3 * ROW, 0
        clear(planes, part, work, end - begin)
        for i in range(start - 3, stop):
            ahead, wanted = min(i + 2, stop), i >= start  # the row that is loaded; whether there are results
            if around and not 0 <= ahead < rows:
                ahead += rows if ahead < 0 else -rows
            inside = 0 <= ahead < rows
            first = size * ahead if inside else 0 if ahead < 0 else 3 * c
            for left in range(begin, end, STRETCH):
                right = min(left + STRETCH, end)
                g, at, width = left - begin, i * c + left, right - left
                padded = (width + TOGETHER - 1) & -TOGETHER
                computed = i >= start - 1  # before, rows are only loaded
                if computed:
                    # As the work on this stretch goes on, the next one arrives, a third at a time; all of it
                    # at once would have to be waited for.
                    if left == begin:
                        first_quad(planes, p, q, work, coarse)
                    ask(points, first + 3 * right)
                    if vectors:
                        ask_to_write(Hn, 3 * (at + width))
                    if numbers:
                        ask_to_write(H, at + width)
                    if normals:
                        ask_to_write(normal, 3 * (at + width))
                    if areas:
                        ask_to_write(area, at + width)
                    rings = wanted and not (liu and not (numbers or normals))
                    if not rings:
                        least = quad_normals(planes, p, q, work, g, width, padded)
                    elif numbers or normals:
                        least = quad_and_ring_normals(planes, o, p, q, work, g, width, padded)
                    else:
                        least = quad_normals_ring_squares(planes, o, p, q, work, g, width, padded)
                    if not is_clear(least, far, coarse):
                        known_squares(planes, o, p, q, work, g, padded, rings, coarse)
                    ask(points, first + 3 * right + STRETCH)
                    if vectors:
                        ask_to_write(Hn, 3 * (at + width) + STRETCH)
                    if normals:
                        ask_to_write(normal, 3 * (at + width) + STRETCH)
                to = fresh + FIRST
                far = load_row(planes, to + g, points, beyond, inside, first + 3 * left, width, far)
                if not computed:
                    continue
                if liu:
                    liu_scales(work, part, g, padded)
                    if numbers or normals:
                        ring_scales(work, padded)
                else:
                    finite_volume_scales(work, padded)
                ask(points, first + 3 * right + 2 * STRETCH)
                if vectors:
                    ask_to_write(Hn, 3 * (at + width) + 2 * STRETCH)
                if normals:
                    ask_to_write(normal, 3 * (at + width) + 2 * STRETCH)
                if vectors or not wanted:
                    row_vectors(planes, p, q, work, part, unwanted, Hn, wanted, g, at, width)
                    if numbers and wanted:
                        vector_curvatures(work, scale, Hn, H, at, width)
                elif numbers:
                    row_curvatures(planes, p, q, work, part, scale, H, g, at, width)
                last_quad(work)
                if wanted and normals:
                    unit_normals(work, scale, normal, at, width)
                if wanted and areas:
                    dual_areas(work, liu, area, at, width)
            to, row = fresh + FIRST, ahead + 1
            far = load_ends(planes, to, points, beyond, beside, inside, first, begin, end, c, row, rows, far)
            o, p, q, fresh = p, q, fresh, o


def grid_curvatures(points, size, c, beyond, beside, coarse, liu, Hn, H, normal, area, start, stop):
    """Mean curvature normal, mean curvature, unit normal and dual area of the vertices of rows start..stop.

    Parameters
    ----------
    points : float64
        Vertices, row by row, rows `size` numbers apart.
    size, c : int
    beyond : (6 c,) float64
        The rows before the first one and after the last one; of size 0 where columns are closed, if rows are.
    beside : (6 (r + 2),) float64
        The columns before the first one and after the last one, those of the rows of `beyond` too. Of size 0
        where rows are closed.
    coarse : float
        See `vector.rounding`.
    liu : bool
        Dual areas of Liu's formula, not those of the finite-volume scheme.
    Hn, normal : (3 r c,) float64
        Written to; of size 0 where they are not wanted.
    H, area : (r c,) float64
        As these.
    start, stop : int
    """
    _pass(points, size, c, beyond, beside, coarse, liu, Hn, H, normal, area, start, stop, make_room())
