"""Finite-volume and Liu's operators: one diamond flux, two dual areas.

With a quad's diagonals u and v and its unit normal n, along u x v, the finite-volume flux into its first
vertex is v x n and into its second n x u; the opposite vertices get the same with the other sign. This is
twice Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| of the finite-volume scheme with t1 = d - c, t2 = b - a.
|u x v| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.

The loops over grids and over rings are written for the compiler to vectorise and the processor to overlap:

* Coordinates are first de-interleaved into x, y and z planes that a loop only reads. What it writes is in
  few other arrays, so that there is little to prove about what overlaps.
* All indices are unsigned and the distances between planes constant. (A signed index may count from the
  end of an array and becomes a gather.)
* On grids the fluxes of the quad before are carried from one turn of the loop to the next instead of
  stored, which the compiler knows how to shift along its vectors.
* Normals, roots and fluxes have loops of their own. (A processor keeps about a hundred operations that
  wait for others. A turn of one loop that did it all would be a chain of 150 cycles, of which hardly two
  overlapped.) The loops follow each other on short stretches of a row: what one leaves for the next stays
  near, and memory is read and written evenly, ahead of its use.
* Roots are Newton's rather than the processor's, which take five cycles a number whatever else is done.
* Planes of a grid begin where a page of memory begins, or in its middle. (A load that follows a store to
  the same place of another page waits for it; so placed, loads keep ahead of stores.)

Every vertex sums its quads in the same order however the work is cut: results are bitwise the same.
"""

from math import nan, sqrt

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel, muladd, prefetch, prefetch_to_write, wide

WIDTH = 2048  # columns done at once: their rows stay in the second-level cache
STRETCH = 80  # of them, by one loop after the other: what these leave stays in the first-level cache
BLOCK = 64  # vertices of a face list done at once: their rings stay in the first-level cache
AHEAD = 16  # vertices: where the points of rings lie far apart, they are asked for that early
LEAST_ROWS = 16  # of a range of its own, which computes a row of quads that others compute too
PAGE = 512  # doubles
STRIDE = WIDTH + PAGE // 2  # between planes of a row
SHORT = STRETCH + 16  # between planes of a stretch
MAGIC = np.uint64(0x5FE6EB50C7B537A9)  # M. Robertson, A Brief History of InvSqrt, 2012
LEAST = 2.2250738585072014e-308  # of the numbers whose exponent is not that of zero
FIRST = np.uint64(8)  # place of the first vertex in a plane, its left neighbour before it
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)
Y, Z, A, S = np.uint64(STRIDE), np.uint64(2 * STRIDE), np.uint64(3 * STRIDE), np.uint64(SHORT)
LENGTH, RING, EDGE = np.uint64(3 * SHORT), np.uint64(4 * SHORT), np.uint64(8 * SHORT)
U, V = np.uint64(8 * SHORT), np.uint64(11 * SHORT)
SIDE, TWICE, POINT = np.uint64(BLOCK), np.uint64(2 * BLOCK), np.uint64(3 * BLOCK)
CORNERS = np.uint64(4 * BLOCK)


@inlined
def triple(x, i, plane):
    """Point i of planes."""
    return x[i], x[i + plane], x[i + TWO * plane]


@inlined
def place(x, i, plane, a):
    """Make a triple point i of planes."""
    x[i], x[i + plane], x[i + TWO * plane] = a


@inlined
def apart(x, i, y, j, plane):
    """Point i of planes x less point j of planes y."""
    return x[i] - y[j], x[i + plane] - y[j + plane], x[i + TWO * plane] - y[j + TWO * plane]


@inlined
def times(a, scale):
    """A triple times a number."""
    return a[0] * scale, a[1] * scale, a[2] * scale


@inlined
def cross(a, b):
    """Cross product of two triples, zero where they are equal: its products are rounded alike."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def fused_cross(a, b):
    """Cross product of two triples; equal ones may leave a rounding error."""
    return (
        muladd(a[1], b[2], -(a[2] * b[1])),
        muladd(a[2], b[0], -(a[0] * b[2])),
        muladd(a[0], b[1], -(a[1] * b[0])),
    )


@inlined
def dot(a, b):
    """Inner product of two triples."""
    return muladd(a[0], b[0], muladd(a[1], b[1], a[2] * b[2]))


@inlined
def norm(a):
    """Length of a triple."""
    return sqrt(dot(a, a))


@inlined
def quotient(x, y):
    """Quotient by a positive y, else NaN."""
    return x / y if y > 0 else nan


@inlined
def guess(x):
    """1 / sqrt(x) to 3.4 %: minus half the exponent, and straight lines for the fraction."""
    half = np.float64(x).view(np.uint64) >> ONE
    return np.uint64(MAGIC - half).view(np.float64)


@inlined
def reciprocal_root(x):
    """1 / sqrt(x) to the last digit or two; if x is zero or as good as zero, some large number.

    Two steps y (1 - e)^(-1/2), e = 1 - x y^2: by the quadratic that is nearest where the guess leaves e, to
    2.5e-5, and by the series, of which 2e-18 is left out.
    """
    y = guess(x)
    e = muladd(-(x * y), y, 1.0)
    y *= muladd(e, muladd(e, 0.375131542, 0.501100402), 1.000000670)
    e = muladd(-(x * y), y, 1.0)
    return muladd(y * e, muladd(e, muladd(e, 0.3125, 0.375), 0.5), y)


@inlined
def unless_zero(x, square):
    """The number x, but NaN where a square is zero or as good as zero."""
    return x if square >= LEAST else nan


@inlined
def unit(n):
    """A triple over its length, NaN if that is zero, and the length."""
    square = dot(n, n)
    scale = reciprocal_root(square)
    length, scale = square * scale, unless_zero(scale, square)
    return times(n, scale), length


@inlined
def fluxes(u, v, n):
    """Fluxes into a quad's first and second vertex from its diagonals and its unit normal."""
    return fused_cross(v, n), fused_cross(n, u)


@inlined
def enclose(ring, i, plane, a, b, liu, H, normal):
    """Keep n = a x b of the diagonals of a vertex's ring polygon, as far as it is wanted, and n . n."""
    if liu is None or H is not None or normal is not None:
        n = cross(a, b)
        ring[i + THREE * plane] = dot(n, n)
        if H is not None or normal is not None:
            place(ring, i, plane, n)


@inlined
def weigh(ring, i, plane, lengths, liu, H, normal, area, k):
    """What the sum of fluxes is multiplied by, in the fourth plane; write normal and area of vertex k.

    Before it, `ring` holds what `enclose` left there. The dual area is a quarter of the length of n, in
    Liu's formula lengths / 8. What is not wanted is None.
    """
    scale = nan
    if liu is None or H is not None or normal is not None:
        square = ring[i + THREE * plane]
        scale = reciprocal_root(square)
        if liu is None and area is not None:
            area[k] = 0.25 * square * scale
        scale = unless_zero(scale, square)
        if H is not None or normal is not None:
            n = times(triple(ring, i, plane), scale)
            place(ring, i, plane, n)
        if normal is not None:
            place(normal, THREE * k, ONE, n)
    if liu is not None:
        scale = quotient(2, lengths)
        if area is not None:
            area[k] = 0.125 * lengths
    ring[i + THREE * plane] = scale


@inlined
def finish(t, ring, i, plane, Hn, H, k):
    """Write the curvatures of vertex k from the sum t of its fluxes and what `weigh` left at place i."""
    scale = ring[i + THREE * plane]
    h = times(t, scale)
    if Hn is not None:
        place(Hn, THREE * k, ONE, h)
    if H is not None:
        H[k] = -dot(h, triple(ring, i, plane))


@helper
def aligned(size):
    """Room for doubles that begins a page of memory."""
    room = np.empty(size + PAGE)
    return room[-np.int64(room.ctypes.data // 8) % PAGE :]


@inlined
def claim(values, size, at, turn):
    """Ask for the memory of a third of the results of the stretch from vertex `at` on, if they are wanted."""
    if values is not None:
        third = size * STRETCH // 3
        begin = size * at + turn * third
        if begin + third <= values.size:
            for k in range(0, third, 8):
                prefetch_to_write(values, begin + k)


@helper
def ask_ahead(points, first, Hn, H, normal, area, at, turn):
    """Ask for the stretch of the points from points[first] on and for its results', one third a turn.

    As the work on another stretch goes on it arrives; all of it at once would have to be waited for.
    """
    begin = first + turn * STRETCH
    if begin + STRETCH <= points.size:
        for k in range(0, STRETCH, 8):
            prefetch(points, begin + k)
    claim(Hn, 3, at, turn)
    claim(H, 1, at, turn)
    claim(normal, 3, at, turn)
    claim(area, 1, at, turn)


@helper
def load_row(planes, p, points, at, width):
    """Put a row that begins at points[at] into planes p."""
    wide()
    for k in range(np.uint64(0), width):
        place(planes, p + FIRST + k, Y, triple(points, at + THREE * k, ONE))


@helper
def load_ends(planes, p, points, first, size, across, begin, end):
    """Put what is beside columns begin..end of the row of `size` coordinates from points[first] on.

    Beyond the row it follows from `across`: see `vertices`.
    """
    last = first + size - 3
    for side in range(2):
        near, far, step = (first, last, 3) if side == 0 else (last, first, -3)
        beside = first + (3 * begin - 3 if side == 0 else 3 * end)
        to = p + FIRST - ONE if side == 0 else p + FIRST + np.uint64(end - begin)
        for x in range(3):
            if first <= beside <= last:
                value = points[beside + x]
            elif across.size == 0:
                value = points[far + x]
            else:
                value = points[near + x]
                for k in range(across.size):
                    value += across[k] * (points[near + x + step * k] - points[near + x])
            planes[to + np.uint64(x) * Y] = value


@helper
def load_line(planes, p, points, beyond, i, size, across, begin, end):
    """Put columns begin..end of row i of the points, or of the one beyond either end, into planes p."""
    width = np.uint64(end - begin)
    if 0 <= size * i < points.size:
        load_row(planes, p, points, np.uint64(size * i + 3 * begin), width)
        load_ends(planes, p, points, size * i, size, across, begin, end)
    else:
        first = 0 if i < 0 else size
        load_row(planes, p, beyond, np.uint64(first + 3 * begin), width)
        load_ends(planes, p, beyond, first, size, across, begin, end)


@inlined
def quad(planes, p, q, i):
    """Diagonals of the quad whose first two vertices are at i in rows p and q, the others beside them."""
    return apart(planes, q + i + ONE, planes, p + i, Y), apart(planes, p + i + ONE, planes, q + i, Y)


@helper
def first_row(planes, p, q, part, liu, width):
    """Begin the sums of the vertices in row q with the quads between rows p and q."""
    wide()
    u, v = quad(planes, p, q, FIRST - ONE)
    n, before = unit(cross(u, v))
    (gx, gy, gz), _ = fluxes(u, v, n)
    for i in range(FIRST, FIRST + width):
        u, v = quad(planes, p, q, i)
        n, length = unit(cross(u, v))
        (hx, hy, hz), (fx, fy, fz) = fluxes(u, v, n)
        place(part, i, Y, (fx - gx, fy - gy, fz - gz))
        if liu is not None:
            part[i + A] = length + before
        gx, gy, gz, before = hx, hy, hz, length


@helper
def first_quad(planes, p, q, work):
    """The quad before the first one of a row."""
    u, v = quad(planes, p, q, FIRST - ONE)
    n, work[FIRST - ONE + LENGTH] = unit(cross(u, v))
    place(work, FIRST - ONE, S, n)


@helper
def normal_row(planes, o, p, q, work, liu, H, normal, g, width):
    """Diagonals and normals of the quads between rows p and q, normals of the rings around row p.

    As all that follows of a stretch of `width` columns, from column g on.
    """
    wide()
    for k in range(np.uint64(0), width):
        i, j = FIRST + g + k, FIRST + k
        u, v = quad(planes, p, q, i)
        place(work, j + U, S, u)
        place(work, j + V, S, v)
        place(work, j, S, cross(u, v))
        a = apart(planes, q + i, planes, o + i, Y)
        b = apart(planes, p + i + ONE, planes, p + i - ONE, Y)
        enclose(work, j + RING, S, a, b, liu, H, normal)


@helper
def weigh_row(work, part, liu, H, normal, area, at, g, width):
    """Give the normals of quads length one, in Liu's formula sum their lengths, and `weigh` the vertices."""
    wide()
    before = work[FIRST - ONE + LENGTH]
    for k in range(np.uint64(0), width):
        j, lengths = FIRST + k, 0.0
        n, length = unit(triple(work, j, S))
        place(work, j, S, n)
        if liu is not None:
            i, both = j + g, length + before
            lengths = part[i + A] + both
            part[i + A] = both
            work[j + LENGTH] = before = length
        weigh(work, j + RING, S, lengths, liu, H, normal, area, at + k)


@helper
def vertex_row(planes, p, q, work, part, Hn, H, at, g, width):
    """Finish the vertices of row p; begin those of row q.

    A row of quads adds to two rows of vertices. The sums of the upper one are finished and written in the
    same loop; those of the lower one wait in `part` for the next row of quads.
    """
    wide()
    u, v = quad(planes, p, q, FIRST + g - ONE)
    (gx, gy, gz), (ex, ey, ez) = fluxes(u, v, triple(work, FIRST - ONE, S))
    for k in range(np.uint64(0), width):
        i, j = FIRST + g + k, FIRST + k
        u, v = triple(work, j + U, S), triple(work, j + V, S)
        (hx, hy, hz), (fx, fy, fz) = fluxes(u, v, triple(work, j, S))
        tx = part[i] + (hx - ex)
        ty = part[i + Y] + (hy - ey)
        tz = part[i + Z] + (hz - ez)
        place(part, i, Y, (fx - gx, fy - gy, fz - gz))
        gx, gy, gz, ex, ey, ez = hx, hy, hz, fx, fy, fz
        finish((tx, ty, tz), work, j + RING, S, Hn, H, at + k)


@helper
def carry(work, first, width):
    """Make the last normal and length of a stretch those before the next one."""
    for x in (np.uint64(0), S, TWO * S, LENGTH):
        work[first + x - ONE] = work[first + x + width - ONE]


@kernel
def vertices(points, beyond, across, liu, Hn, H, normal, area, start, stop):
    """Mean curvature normal, mean curvature, unit normal and dual area of the vertices of rows start..stop.

    Parameters
    ----------
    points : (3 r c,) float64
        Vertices, row by row.
    beyond : (6 c,) float64
        The rows before the first one and after the last one.
    across : (k,) float64
        How rows go on: the point before the first one is x_0 + sum of across_k (x_k - x_0), that after the
        last one alike. Empty: rows are closed, and these are the last and the first one.
    liu : 0 or None
        None: the finite-volume scheme.
    Hn, normal : (3 r c,) float64 or None
        Written to, unless None; a version for each choice of None is compiled as it is called for.
    H, area : (r c,) float64 or None
    start, stop : int
    """
    # No array is made inside the loops: counting who holds it would wait for all that is being written.
    c = beyond.size // 6
    room = aligned(16 * STRIDE + 14 * SHORT)
    planes, part, work = room[: 12 * STRIDE], room[12 * STRIDE : 16 * STRIDE], room[16 * STRIDE :]
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        o, p, q, fresh = np.uint64(0), THREE * Y, THREE * Z, THREE * A
        load_line(planes, o, points, beyond, start - 1, 3 * c, across, begin, end)
        load_line(planes, p, points, beyond, start, 3 * c, across, begin, end)
        load_line(planes, q, points, beyond, start + 1, 3 * c, across, begin, end)
        first_row(planes, o, p, part, liu, np.uint64(end - begin))
        for i in range(start, stop):
            ahead = min(i + 2, stop)  # the row that is loaded
            inside = 3 * c * ahead < points.size
            first = 3 * c * ahead if inside else 3 * c
            first_quad(planes, p, q, work)
            for left in range(begin, end, STRETCH):
                right = min(left + STRETCH, end)
                g, at, width = np.uint64(left - begin), np.uint64(i * c + left), np.uint64(right - left)
                ask_ahead(points, first + 3 * right, Hn, H, normal, area, i * c + right, 0)
                normal_row(planes, o, p, q, work, liu, H, normal, g, width)
                ask_ahead(points, first + 3 * right, Hn, H, normal, area, i * c + right, 1)
                if inside:
                    load_row(planes, fresh + g, points, np.uint64(first + 3 * left), width)
                else:
                    load_row(planes, fresh + g, beyond, np.uint64(first + 3 * left), width)
                weigh_row(work, part, liu, H, normal, area, at, g, width)
                ask_ahead(points, first + 3 * right, Hn, H, normal, area, i * c + right, 2)
                vertex_row(planes, p, q, work, part, Hn, H, at, g, width)
                carry(work, FIRST, width)
            if inside:
                load_ends(planes, fresh, points, first, 3 * c, across, begin, end)
            else:
                load_ends(planes, fresh, beyond, first, 3 * c, across, begin, end)
            o, p, q, fresh = p, q, fresh, o


@inlined
def below(planes, p, q, b, i):
    """Diagonals of the quad of the edge between rows p and q, across dual row b."""
    return apart(planes, q + i, planes, p + i, Y), apart(planes, b + i + ONE, planes, b + i, Y)


@inlined
def beside(planes, p, a, b, i):
    """Diagonals of the quad of the edge to the right in row p, from dual row b to a."""
    return apart(planes, p + i + ONE, planes, p + i, Y), apart(planes, a + i + ONE, planes, b + i + ONE, Y)


@helper
def first_cells(planes, p, q, b, part, width):
    """Fluxes from primal row q into row p, across dual row b."""
    wide()
    for i in range(FIRST, FIRST + width):
        u, v = below(planes, p, q, b, i)
        n, part[i + A] = unit(cross(u, v))
        flux, _ = fluxes(u, v, n)
        place(part, i, Y, flux)


@helper
def first_edge(planes, p, a, b, work):
    """The edge to the left of the first point of row p."""
    u, v = beside(planes, p, a, b, FIRST - ONE)
    n, work[FIRST - ONE + EDGE + LENGTH] = unit(cross(u, v))
    place(work, FIRST - ONE + EDGE, S, n)


@helper
def normal_cells(planes, p, q, a, b, work, liu, H, normal, g, width):
    """Normals of the quads below and beside row p, and of the rings around it, of a stretch from column g."""
    wide()
    for k in range(np.uint64(0), width):
        i, j = FIRST + g + k, FIRST + k
        u, v = below(planes, p, q, b, i)
        place(work, j, S, cross(u, v))
        u, v = beside(planes, p, a, b, i)
        place(work, j + EDGE, S, cross(u, v))
        u = apart(planes, b + i + ONE, planes, a + i, Y)
        v = apart(planes, a + i + ONE, planes, b + i, Y)
        enclose(work, j + RING, S, u, v, liu, H, normal)


@helper
def weigh_cells(work, part, liu, H, normal, area, at, g, width):
    """As `weigh_row`."""
    wide()
    before = work[FIRST - ONE + EDGE + LENGTH]
    for k in range(np.uint64(0), width):
        j, lengths = FIRST + k, 0.0
        n, under = unit(triple(work, j, S))
        place(work, j, S, n)
        n, length = unit(triple(work, j + EDGE, S))
        place(work, j + EDGE, S, n)
        if liu is not None:
            i = j + g
            lengths = (under + part[i + A]) + (length + before)
            part[i + A] = under
            work[j + EDGE + LENGTH] = before = length
        weigh(work, j + RING, S, lengths, liu, H, normal, area, at + k)


@helper
def cell_row(planes, p, q, a, b, work, part, Hn, H, at, g, width):
    """Finish the points of primal row p, between dual rows a and b; q is the next one."""
    wide()
    u, v = beside(planes, p, a, b, FIRST + g - ONE)
    (ex, ey, ez), _ = fluxes(u, v, triple(work, FIRST - ONE + EDGE, S))
    for k in range(np.uint64(0), width):
        i, j = FIRST + g + k, FIRST + k
        u, v = below(planes, p, q, b, i)
        (gx, gy, gz), _ = fluxes(u, v, triple(work, j, S))
        u, v = beside(planes, p, a, b, i)
        (fx, fy, fz), _ = fluxes(u, v, triple(work, j + EDGE, S))
        tx = (gx - part[i]) + (fx - ex)
        ty = (gy - part[i + Y]) + (fy - ey)
        tz = (gz - part[i + Z]) + (fz - ez)
        place(part, i, Y, (gx, gy, gz))
        ex, ey, ez = fx, fy, fz
        finish((tx, ty, tz), work, j + RING, S, Hn, H, at + k)


@kernel
def cells(points, beyond, across, halo, dual, liu, Hn, H, normal, area, start, stop):
    """As `vertices`, of the primal points of a staggered grid.

    Parameters
    ----------
    points : (3 r c,) float64
        Primal points; with halo = 1 (3 (r + 2) (c + 2),), those around them too.
    beyond : (6 c,) float64
        As for `vertices`; with halo = 1 not read.
    across
        As for `vertices`; with halo = 1 not read.
    halo : int
    dual : (3 (r + 1) (c + 1),) float64
        Dual points; those of the first row and column come before the first primal ones.
    liu, Hn, H, normal, area, start, stop
        As for `vertices`.
    """
    c = beyond.size // 6
    room = aligned(16 * STRIDE + 12 * SHORT)
    planes, part, work = room[: 12 * STRIDE], room[12 * STRIDE : 16 * STRIDE], room[16 * STRIDE :]
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        p, q, a, b = np.uint64(0), THREE * Y, THREE * Z, THREE * A
        for i in range(start - 1, stop + 1):  # p and a are rows i - 1 once they are there
            size = 3 * (c + 2 * halo)
            load_line(planes, q, points, beyond, i + halo, size, across, begin + halo, end + halo)
            if i >= start:
                at = np.uint64(3 * ((c + 1) * i + begin))
                load_row(planes, b, dual, at, np.uint64(end - begin + 1))
            if i == start:
                first_cells(planes, p, q, b, part, np.uint64(end - begin))
            elif i > start:
                first_edge(planes, p, a, b, work)
                for left in range(begin, end, STRETCH):
                    right = min(left + STRETCH, end)
                    g, width = np.uint64(left - begin), np.uint64(right - left)
                    at = np.uint64((i - 1) * c + left)
                    normal_cells(planes, p, q, a, b, work, liu, H, normal, g, width)
                    weigh_cells(work, part, liu, H, normal, area, at, g, width)
                    cell_row(planes, p, q, a, b, work, part, Hn, H, at, g, width)
                    carry(work, FIRST + EDGE, width)
            p, q, a, b = q, p, b, a


@helper
def corner_normals(x, a, d, b, normals, size):
    """Normals (d - c) x (b - a) of one corner of every vertex c of a block."""
    wide()
    for k in range(np.uint64(0), size):
        place(normals, k, CORNERS, cross(apart(x, d + k, x, k, SIDE), apart(x, b + k, x, a + k, SIDE)))


@helper
def block(x, size, normals, ring, at, liu, Hn, H, normal, area):
    """Finish the vertices of a block from the planes x of their nine points."""
    wide()
    a, d, b, e = POINT, THREE * POINT, np.uint64(5) * POINT, np.uint64(7) * POINT  # along the edges
    for j, first, last in ((0, a, d), (1, d, b), (2, b, e), (3, e, a)):
        corner_normals(x, first, first + POINT, last, normals[BLOCK * j :], size)
    for k in range(np.uint64(0), CORNERS):
        n, normals[k + THREE * CORNERS] = unit(triple(normals, k, CORNERS))
        place(normals, k, CORNERS, n)
    for k in range(np.uint64(0), size):
        u, v = apart(x, b + k, x, a + k, SIDE), apart(x, e + k, x, d + k, SIDE)
        enclose(ring, k, SIDE, u, v, liu, H, normal)
    for k in range(np.uint64(0), size):
        i = k + THREE * CORNERS
        lengths = (normals[i] + normals[i + SIDE]) + (normals[i + TWICE] + normals[i + POINT])
        weigh(ring, k, SIDE, lengths, liu, H, normal, area, at + k)
    for k in range(np.uint64(0), size):
        f = fused_cross(apart(x, d + k, x, a + k, SIDE), triple(normals, k, CORNERS))
        g = fused_cross(apart(x, b + k, x, d + k, SIDE), triple(normals, k + SIDE, CORNERS))
        h = fused_cross(apart(x, e + k, x, b + k, SIDE), triple(normals, k + TWICE, CORNERS))
        t = fused_cross(apart(x, a + k, x, e + k, SIDE), triple(normals, k + POINT, CORNERS))
        t = (f[0] + g[0]) + (h[0] + t[0]), (f[1] + g[1]) + (h[1] + t[1]), (f[2] + g[2]) + (h[2] + t[2])
        finish(t, ring, k, SIDE, Hn, H, at + k)


@inlined
def gather_ring(points, ring, v, x, k):
    """Put vertex v and its ring, or v nine times, at place k of the planes of nine points."""
    regular = ring[v, 0] >= 0
    for j in range(9):
        i = THREE * np.uint64(ring[v, j - 1] if regular and j > 0 else v)
        place(x, np.uint64(j) * POINT + k, SIDE, triple(points, i, ONE))


@kernel
def rings(points, ring, far, liu, Hn, H, normal, area, start, stop):
    """As `vertices`, of the regular vertices start..stop of a face list.

    Parameters
    ----------
    points : (3 n,) float64
    ring : (n, 8) int32
        The ring (a, d, a, d, ...) of each vertex, counter-clockwise; negative first where the vertex is not
        regular, whose results are NaN.
    far : bool
        Whether neighbours are far apart in `points`.
    liu, Hn, H, normal, area, start, stop
        As for `vertices`.
    """
    x, normals, weights = np.empty(9 * 3 * BLOCK), np.ones(16 * BLOCK), np.empty(4 * BLOCK)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            ahead = begin + k + AHEAD
            if far and ahead < stop and ring[ahead, 0] >= 0:
                for j in range(8):
                    prefetch(points, 3 * ring[ahead, j])
            gather_ring(points, ring, begin + k, x, np.uint64(k))
        block(x, size, normals, weights, np.uint64(begin), liu, Hn, H, normal, area)


@inlined
def conductance(u, v):
    """K_00 and K_01 of a quad: K (u, v) are the half fluxes into its first two vertices."""
    n = cross(u, v)
    square = dot(n, n)
    scale = 0.5 * unless_zero(reciprocal_root(square), square)
    return scale * dot(v, v), -scale * dot(u, v)


@helper
def corner_weights(x, a, d, b, own, mixed, size):
    """Planes of `conductance` of the corner (a, d, b) of each vertex of a block."""
    wide()
    for k in range(np.uint64(0), size):
        own[k], mixed[k] = conductance(apart(x, d + k, x, k, SIDE), apart(x, b + k, x, a + k, SIDE))


@helper
def weigh_points(own, mixed, size, row):
    """Rows of the stiffness of a block, planes of the weights of the nine points in `row`."""
    for k in range(np.uint64(0), size):
        row[k] = (own[k] + own[k + SIDE]) + (own[k + TWICE] + own[k + POINT])
        for j in range(4):
            at, before = np.uint64(j) * SIDE + k, np.uint64((j + 3) % 4) * SIDE + k
            row[np.uint64(2 * j + 1) * SIDE + k] = mixed[at] - mixed[before]
            row[np.uint64(2 * j + 2) * SIDE + k] = -own[at]


@helper
def ranks(column, size, rank):
    """Place of each of the nine columns in its row when sorted: how many are smaller."""
    for i in range(9):
        at = np.uint64(i) * SIDE
        for k in range(np.uint64(0), size):
            smaller = np.int32(0)
            for j in range(9):
                smaller += np.int32(column[np.uint64(j) * SIDE + k] < column[at + k])
            rank[at + k] = smaller


@kernel
def ring_stiffness(points, ring, indptr, indices, data, start, stop):
    """Rows start..stop of the stiffness in CSR, columns sorted, of regular vertices; others are left alone.

    Parameters
    ----------
    points, ring
        As for `rings`.
    indptr : (n + 1,) int32
        Nine entries a row.
    indices, data : int32, float64
        Written to.
    start, stop : int
    """
    x, row = np.empty(9 * 3 * BLOCK), np.empty(9 * BLOCK)
    own, mixed = np.empty(4 * BLOCK), np.empty(4 * BLOCK)
    column, rank = np.empty(9 * BLOCK, np.int32), np.empty(9 * BLOCK, np.int32)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            gather_ring(points, ring, begin + k, x, np.uint64(k))
            column[k] = begin + k
            for j in range(8):
                column[BLOCK * (j + 1) + k] = ring[begin + k, j]
        for j in range(4):
            a, b = np.uint64(2 * j + 1) * POINT, np.uint64((2 * j + 2) % 8 + 1) * POINT
            corner_weights(x, a, a + POINT, b, own[BLOCK * j :], mixed[BLOCK * j :], size)
        weigh_points(own, mixed, size, row)
        ranks(column, size, rank)
        for k in range(np.uint64(0), size):
            v = begin + np.int64(k)
            if ring[v, 0] < 0:
                continue
            first = np.uint64(indptr[v])
            for j in range(9):
                at = np.uint64(j) * SIDE + k
                i = first + np.uint64(rank[at])
                indices[i], data[i] = column[at], row[at]


@kernel
def gather(values, order, ordered, start, stop):
    """Triples (3 n,) or numbers (n,) in another order: the k-th is number order[k], for start <= k < stop."""
    if values.size == order.size:
        for k in range(np.uint64(start), np.uint64(stop)):
            ordered[k] = values[np.uint64(order[k])]
    else:
        for k in range(np.uint64(start), np.uint64(stop)):
            place(ordered, THREE * k, ONE, triple(values, THREE * np.uint64(order[k]), ONE))


@inlined
def difference(points, i, j):
    """points[i] - points[j] as a triple."""
    return (
        points[i, 0] - points[j, 0],
        points[i, 1] - points[j, 1],
        points[i, 2] - points[j, 2],
    )


@kernel
def quads(points, faces, flux, area):
    """Add each quad's half fluxes (p, 3) and a quarter of its area (p,) to its vertices."""
    for f in range(faces.shape[0]):
        h, i, j, k = faces[f, 0], faces[f, 1], faces[f, 2], faces[f, 3]
        if k < 0:
            continue
        u, v = difference(points, j, h), difference(points, k, i)
        n = cross(u, v)
        length = norm(n)
        g, e = cross(v, n), cross(n, u)
        scale = 0.5 / length
        for x in range(3):
            flux[h, x] += scale * g[x]
            flux[i, x] += scale * e[x]
            flux[j, x] -= scale * g[x]
            flux[k, x] -= scale * e[x]
        for s in range(4):
            area[faces[f, s]] += 0.125 * length


@kernel
def flaps(points, corners, flux):
    """Add to each corner's centre the half flux of (c, a, d, b), to no other vertex."""
    for t in range(corners.shape[0]):
        c = corners[t, 0]
        u = difference(points, corners[t, 2], c)
        v = difference(points, corners[t, 3], corners[t, 1])
        n = cross(u, v)
        g = cross(v, n)
        scale = 0.5 / norm(n)
        for x in range(3):
            flux[c, x] += scale * g[x]


@kernel
def triangles(points, faces, flux, area):
    """Add each triangle's cotan fluxes and a third of its area to its vertices."""
    for f in range(faces.shape[0]):
        if faces[f, 3] >= 0:
            continue
        n = cross(
            difference(points, faces[f, 1], faces[f, 0]),
            difference(points, faces[f, 2], faces[f, 0]),
        )
        length = norm(n)
        for s in range(3):
            c, a, b = faces[f, s], faces[f, (s + 1) % 3], faces[f, (s + 2) % 3]
            # Cotan weights at c sum to the opposite edge, turned by 90 degrees into the triangle, halved.
            g = cross(difference(points, b, a), n)
            for x in range(3):
                flux[c, x] += 0.5 / length * g[x]
            area[c] += length / 6


@kernel
def ring_normals(points, faces, normal):
    """Add to each vertex half the vector area of its ring polygon, corner by corner (a - c) x (b - c)."""
    for f in range(faces.shape[0]):
        sides = 3 if faces[f, 3] < 0 else 4
        for s in range(sides):
            c = faces[f, s]
            n = cross(
                difference(points, faces[f, (s + 1) % sides], c),
                difference(points, faces[f, (s + sides - 1) % sides], c),
            )
            for x in range(3):
                normal[c, x] += 0.25 * n[x]


@kernel
def conductances(points, quads):
    """K (m, 2, 2) with half fluxes K (u, v) into a quad's first two vertices."""
    K = np.empty((quads.shape[0], 2, 2))
    for f in range(quads.shape[0]):
        u = difference(points, quads[f, 2], quads[f, 0])
        v = difference(points, quads[f, 3], quads[f, 1])
        n = cross(u, v)
        scale = 0.5 / norm(n)
        K[f, 0, 0] = scale * dot(v, v)
        K[f, 0, 1] = K[f, 1, 0] = -scale * dot(u, v)
        K[f, 1, 1] = scale * dot(u, u)
    return K
