"""The pass over the primal points of a staggered grid, whose quads lie across the edges of its cells.

As that of `rows`; a and b are the rows of dual points before and after row p.
"""

from quadcurv.kernels.compiled import kernel
from quadcurv.kernels.formulas import Carried, bits, formula, part_of, span, where
from quadcurv.kernels.quad import fluxes, quads_scale, ring_scale
from quadcurv.kernels.rows import (
    AREA,
    FIRST,
    LENGTH,
    MOST,
    NORMAL,
    PLANES,
    QUAD_SQUARE,
    RING,
    RING_SCALE,
    ROW,
    SCALE,
    SQUARE,
    STRETCH,
    TOGETHER,
    WIDTH,
    WORK,
    S,
    Y,
    clear,
    dual_areas,
    is_clear,
    last_quad,
    load_ends,
    load_row,
    make_room,
    ring_normal,
    unit_normals,
    vector_curvatures,
)
from quadcurv.kernels.vector import (
    cross,
    dot,
    known_ring_square,
    known_square,
    less,
    middle,
    place,
    plus,
    smaller,
    times,
    triple,
    unit,
)

# In `work`, `NORMAL`, `QUAD_SQUARE`, `LENGTH` are of the quads beside the points of row p. Those below them:
BELOW, BELOW_LENGTH, BELOW_SQUARE = 18 * S, 21 * S, 22 * S


def corners_below(planes, p, q, b, i):
    """Ends of the diagonals of the quad of the edge between rows p and q, across dual row b."""
    return [triple(planes, k + i, Y) for k in (q, p, b + 1, b)]


def corners_right(planes, p, a, b, i):
    """Ends of those of the quad of the edge to the right in row p, from dual row b to a."""
    return [triple(planes, k + i, Y) for k in (p + 1, p, a + 1, b + 1)]


def below(planes, p, q, b, i):
    """Diagonals of the quad of `corners_below`."""
    return diagonals(corners_below(planes, p, q, b, i))


def beside_right(planes, p, a, b, i):
    """Diagonals of the quad of `corners_right`."""
    return diagonals(corners_right(planes, p, a, b, i))


def diagonals(corners):
    """From the second corner to the first, from the fourth to the third."""
    return less(corners[0], corners[1]), less(corners[2], corners[3])


@formula
def first_fluxes(planes, p, q, b, part, width, coarse):
    """Begin the sums of row q."""
    for i in span(FIRST, FIRST + width):
        u, v = below(planes, p, q, b, i)
        n = cross(u, v)
        point = middle(*corners_below(planes, p, q, b, i))
        n, part[i + ROW] = unit(n, known_square(n, u, v, point, coarse))
        place(part, i, Y, fluxes(u, v, n)[0])


@formula
def first_edge(planes, p, a, b, work, coarse):
    """The edge to the left of the first point of row p."""
    u, v = beside_right(planes, p, a, b, FIRST - 1)
    n = cross(u, v)
    square = known_square(n, u, v, middle(*corners_right(planes, p, a, b, FIRST - 1)), coarse)
    n, work[FIRST - 1 + LENGTH] = unit(n, square)
    place(work, FIRST - 1 + NORMAL, S, n)


def quads(p, q, a, b, i, planes):
    """Of the quads below and beside a point: planes of normals and of squares in `work`, corners."""
    yield BELOW, BELOW_SQUARE, corners_below(planes, p, q, b, i)
    yield NORMAL, QUAD_SQUARE, corners_right(planes, p, a, b, i)


def ring(planes, a, b, i):
    """The dual points around a point."""
    return [triple(planes, k + i, Y) for k in (b + 1, a, a + 1, b)]


@formula
def edge_and_ring_normals(planes, p, q, a, b, work, g, width, padded):
    """Normals of the quads below and beside row p, and of the rings around it; bits of the least square."""
    least = Carried((MOST,))
    for k in span(0, padded):
        i, j = FIRST + g + k, FIRST + k
        n = cross(*diagonals(ring(planes, a, b, i)))
        place(work, j + RING, S, n)
        work[j + SQUARE] = square = dot(n, n)
        found = bits(square)
        for plane, squares, corners in quads(p, q, a, b, i, planes):
            n = cross(*diagonals(corners))
            place(work, j + plane, S, n)
            work[j + squares] = square = dot(n, n)
            found = smaller(found, bits(square))
        (before,) = least.get()
        least.set((smaller(before, where(k < width, found, MOST)),))
    return least.get()[0]


@formula
def known_squares(planes, p, q, a, b, work, g, padded, coarse):
    """Make squares zero that are but for rounding."""
    for k in span(0, padded, 1):
        i, j = FIRST + g + k, FIRST + k
        for plane, squares, corners in quads(p, q, a, b, i, planes):
            n = triple(work, j + plane, S)
            work[j + squares] = known_square(n, *diagonals(corners), middle(*corners), coarse)
        n, around = triple(work, j + RING, S), ring(planes, a, b, i)
        work[j + SQUARE] = known_ring_square(n, around, triple(planes, p + i, Y), coarse)


@formula
def edge_scales(work, padded):
    """Make normals of quads of length one; scales from the squares of the rings' normals."""
    for j in span(FIRST, FIRST + padded, 2):
        for normal, square, lengths in (
            (BELOW, BELOW_SQUARE, BELOW_LENGTH),
            (NORMAL, QUAD_SQUARE, LENGTH),
        ):
            n, length = unit(triple(work, j + normal, S), work[j + square])
            place(work, j + normal, S, n)
            work[j + lengths] = length
        work[j + SCALE] = ring_scale(work[j + SQUARE])


@formula
def liu_edge_scales(work, part, g, padded):
    """Scales from the lengths of the quads' normals instead, the rings' elsewhere."""
    before = Carried((work[FIRST - 1 + LENGTH],))
    for k in span(0, padded):
        i, j = FIRST + g + k + ROW, FIRST + k
        under, length = work[j + BELOW_LENGTH], work[j + LENGTH]
        lengths = (under + part[i]) + (length + before.get()[0])
        before.set((length,))
        part[i] = under
        work[j + AREA] = lengths
        work[j + RING_SCALE] = work[j + SCALE]
        work[j + SCALE] = quads_scale(lengths)


def sums(planes, p, q, a, b, work, part, g, width):
    """Curvature normals of the points of row p; the sums of those of row q begin."""
    u, v = beside_right(planes, p, a, b, FIRST + g - 1)
    before = Carried(fluxes(u, v, triple(work, FIRST - 1 + NORMAL, S))[0])
    for k in span(0, width):
        i, j = FIRST + g + k, FIRST + k
        u, v = below(planes, p, q, b, i)
        under, _ = fluxes(u, v, triple(work, j + BELOW, S))
        u, v = beside_right(planes, p, a, b, i)
        right, _ = fluxes(u, v, triple(work, j + NORMAL, S))
        t = plus(less(under, triple(part, i, Y)), less(right, before.get()))
        before.set(right)
        place(part, i, Y, under)
        yield k, times(t, work[j + SCALE])


@formula
def cell_vectors(planes, p, q, a, b, work, part, Hn, g, at, width):
    """Write the curvature normals of row p from point number `at` on."""
    for k, h in sums(planes, p, q, a, b, work, part, g, width):
        place(Hn, 3 * (at + k), 1, h)


@formula
def cell_curvatures(planes, p, q, a, b, work, part, scale, H, g, at, width):
    """Write the curvatures of row p from point number `at` on."""
    for k, h in sums(planes, p, q, a, b, work, part, g, width):
        H[at + k] = -dot(h, ring_normal(work, scale, k))


@kernel
def _pass(points, size, c, beyond, beside, dual, coarse, liu, Hn, H, normal, area, start, stop, room):
    planes, part = part_of(room, 0, 4 * ROW), part_of(room, 4 * ROW, 4 * Y)
    work = part_of(room, PLANES * Y, WORK)
    rows, around = points.size // size, beyond.size == 0
    vectors, numbers, normals, areas = Hn.size > 0, H.size > 0, normal.size > 0, area.size > 0
    scale = RING_SCALE if liu else SCALE
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        p, q, a, b, far = 0, ROW, 2 * ROW, 3 * ROW, 0
        clear(planes, part, work, end - begin)
        for i in range(start - 1, stop + 1):  # p and a are rows i - 1 once they are there
            ahead = i
            if around and not 0 <= i < rows:
                ahead += rows if i < 0 else -rows
            inside = 0 <= ahead < rows
            first = size * ahead if inside else 0 if ahead < 0 else 3 * c
            to, width, row = q + FIRST, end - begin, ahead + 1
            far = load_row(planes, to, points, beyond, inside, first + 3 * begin, width, far)
            far = load_ends(planes, to, points, beyond, beside, inside, first, begin, end, c, row, rows, far)
            if i >= start:
                at = 3 * ((c + 1) * i + begin)
                far = load_row(planes, b + FIRST, dual, dual, True, at, width + 1, far)
            if i == start:
                first_fluxes(planes, p, q, b, part, width, coarse)
            elif i > start:
                first_edge(planes, p, a, b, work, coarse)
                for left in range(begin, end, STRETCH):
                    right = min(left + STRETCH, end)
                    g, at, width = left - begin, (i - 1) * c + left, right - left
                    padded = (width + TOGETHER - 1) & -TOGETHER
                    least = edge_and_ring_normals(planes, p, q, a, b, work, g, width, padded)
                    if not is_clear(least, far, coarse):
                        known_squares(planes, p, q, a, b, work, g, padded, coarse)
                    edge_scales(work, padded)
                    if liu:
                        liu_edge_scales(work, part, g, padded)
                    if vectors:
                        cell_vectors(planes, p, q, a, b, work, part, Hn, g, at, width)
                        if numbers:
                            vector_curvatures(work, scale, Hn, H, at, width)
                    elif numbers:
                        cell_curvatures(planes, p, q, a, b, work, part, scale, H, g, at, width)
                    if normals:
                        unit_normals(work, scale, normal, at, width)
                    if areas:
                        dual_areas(work, liu, area, at, width)
                    last_quad(work)
            p, q, a, b = q, p, b, a


def staggered_curvatures(
    points, size, c, beyond, beside, dual, coarse, liu, Hn, H, normal, area, start, stop
):
    """As `grid_curvatures`, of the primal points of a staggered grid.

    Parameters
    ----------
    points, size, c, beyond, beside
        As for `grid_curvatures`, of primal points.
    dual : (3 (r + 1) (c + 1),) float64
        Dual points; those of the first row and column come before the first primal ones.
    coarse, liu, Hn, H, normal, area, start, stop
        As for `grid_curvatures`.
    """
    _pass(points, size, c, beyond, beside, dual, coarse, liu, Hn, H, normal, area, start, stop, make_room())
