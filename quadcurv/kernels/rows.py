"""The pass over the vertices of a grid, row by row: see `quad` for how its loops are written.

Planes of a row begin where a page of memory begins, or in its middle. (A load that follows a store to the
same place of another page waits for it; so placed, loads keep ahead of stores.)
"""

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel, prefetch, prefetch_to_write, wide
from quadcurv.kernels.quad import flux_scale, fluxes, ring_normal, store_curvature
from quadcurv.kernels.vector import ONE, THREE, TWO, apart, cross, place, triple, unit

WIDTH = 2048  # columns done at once: their rows stay in the second-level cache
STRETCH = 80  # of them, by one loop after the other: what these leave stays in the first-level cache
LEAST_ROWS = 16  # of a range of its own, which computes a row of quads that others compute too
PAGE = 512  # doubles
STRIDE = WIDTH + PAGE // 2  # between planes of a row
SHORT = STRETCH + 16  # between planes of a stretch
FIRST = np.uint64(8)  # place of the first vertex in a plane, its left neighbour before it
Y, Z, A, S = np.uint64(STRIDE), np.uint64(2 * STRIDE), np.uint64(3 * STRIDE), np.uint64(SHORT)
LENGTH, RING = np.uint64(3 * SHORT), np.uint64(4 * SHORT)
U, V = np.uint64(8 * SHORT), np.uint64(11 * SHORT)


@helper
def aligned(size):
    """Room for doubles that begins a page of memory."""
    room = np.empty(size + PAGE)
    return room[-np.int64(room.ctypes.data // 8) % PAGE :]


@inlined
def prefetch_results(values, size, at, turn):
    """Ask for the memory of a third of the results of the stretch from vertex `at` on, if they are wanted."""
    if values is not None:
        third = size * STRETCH // 3
        begin = size * at + turn * third
        if begin + third <= values.size:
            for k in range(0, third, 8):
                prefetch_to_write(values, begin + k)


@helper
def prefetch_stretch(points, first, Hn, H, normal, area, at, turn):
    """Ask for the stretch of the points from points[first] on and for its results', one third a turn.

    As the work on another stretch goes on it arrives; all of it at once would have to be waited for.
    """
    begin = first + turn * STRETCH
    if begin + STRETCH <= points.size:
        for k in range(0, STRETCH, 8):
            prefetch(points, begin + k)
    prefetch_results(Hn, 3, at, turn)
    prefetch_results(H, 1, at, turn)
    prefetch_results(normal, 3, at, turn)
    prefetch_results(area, 1, at, turn)


@helper
def load_row(planes, p, points, at, width):
    """Put a row that begins at points[at] into planes p."""
    wide()
    for k in range(np.uint64(0), width):
        place(planes, p + FIRST + k, Y, triple(points, at + THREE * k, ONE))


@helper
def load_ends(planes, p, points, first, size, across, begin, end):
    """Put what is beside columns begin..end of the row of `size` coordinates from points[first] on.

    Beyond the row it follows from `across`: see `grid_curvatures`.
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
def diagonals(planes, p, q, i):
    """Diagonals of the quad whose first two vertices are at i in rows p and q, the others beside them."""
    return apart(planes, q + i + ONE, planes, p + i, Y), apart(planes, p + i + ONE, planes, q + i, Y)


@helper
def first_sums(planes, p, q, part, liu, width):
    """Begin the sums of the vertices in row q with the quads between rows p and q."""
    wide()
    u, v = diagonals(planes, p, q, FIRST - ONE)
    n, before = unit(cross(u, v))
    (gx, gy, gz), _ = fluxes(u, v, n)
    for i in range(FIRST, FIRST + width):
        u, v = diagonals(planes, p, q, i)
        n, length = unit(cross(u, v))
        (hx, hy, hz), (fx, fy, fz) = fluxes(u, v, n)
        place(part, i, Y, (fx - gx, fy - gy, fz - gz))
        if liu is not None:
            part[i + A] = length + before
        gx, gy, gz, before = hx, hy, hz, length


@helper
def first_quad(planes, p, q, work):
    """The quad before the first one of a row."""
    u, v = diagonals(planes, p, q, FIRST - ONE)
    n, work[FIRST - ONE + LENGTH] = unit(cross(u, v))
    place(work, FIRST - ONE, S, n)


@helper
def row_normals(planes, o, p, q, work, liu, H, normal, g, width):
    """Diagonals and normals of the quads between rows p and q, normals of the rings around row p.

    As all that follows of a stretch of `width` columns, from column g on.
    """
    wide()
    for k in range(np.uint64(0), width):
        i, j = FIRST + g + k, FIRST + k
        u, v = diagonals(planes, p, q, i)
        place(work, j + U, S, u)
        place(work, j + V, S, v)
        place(work, j, S, cross(u, v))
        a = apart(planes, q + i, planes, o + i, Y)
        b = apart(planes, p + i + ONE, planes, p + i - ONE, Y)
        ring_normal(work, j + RING, S, a, b, liu, H, normal)


@helper
def row_scales(work, part, liu, H, normal, area, at, g, width):
    """Normals of quads made of length one, in Liu's formula their lengths summed; see `flux_scale`."""
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
        flux_scale(work, j + RING, S, lengths, liu, H, normal, area, at + k)


@helper
def row_curvatures(planes, p, q, work, part, Hn, H, at, g, width):
    """Finish the vertices of row p; begin those of row q.

    A row of quads adds to two rows of vertices. The sums of the upper one are finished and written in the
    same loop; those of the lower one wait in `part` for the next row of quads.
    """
    wide()
    u, v = diagonals(planes, p, q, FIRST + g - ONE)
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
        store_curvature((tx, ty, tz), work, j + RING, S, Hn, H, at + k)


@helper
def last_quad(work, first, width):
    """Make the last normal and length of a stretch those before the next one."""
    for x in (np.uint64(0), S, TWO * S, LENGTH):
        work[first + x - ONE] = work[first + x + width - ONE]


@kernel
def grid_curvatures(points, beyond, across, liu, Hn, H, normal, area, start, stop):
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
        first_sums(planes, o, p, part, liu, np.uint64(end - begin))
        for i in range(start, stop):
            ahead = min(i + 2, stop)  # the row that is loaded
            inside = 3 * c * ahead < points.size
            first = 3 * c * ahead if inside else 3 * c
            first_quad(planes, p, q, work)
            for left in range(begin, end, STRETCH):
                right = min(left + STRETCH, end)
                g, at, width = np.uint64(left - begin), np.uint64(i * c + left), np.uint64(right - left)
                prefetch_stretch(points, first + 3 * right, Hn, H, normal, area, i * c + right, 0)
                row_normals(planes, o, p, q, work, liu, H, normal, g, width)
                prefetch_stretch(points, first + 3 * right, Hn, H, normal, area, i * c + right, 1)
                if inside:
                    load_row(planes, fresh + g, points, np.uint64(first + 3 * left), width)
                else:
                    load_row(planes, fresh + g, beyond, np.uint64(first + 3 * left), width)
                row_scales(work, part, liu, H, normal, area, at, g, width)
                prefetch_stretch(points, first + 3 * right, Hn, H, normal, area, i * c + right, 2)
                row_curvatures(planes, p, q, work, part, Hn, H, at, g, width)
                last_quad(work, FIRST, width)
            if inside:
                load_ends(planes, fresh, points, first, 3 * c, across, begin, end)
            else:
                load_ends(planes, fresh, beyond, first, 3 * c, across, begin, end)
            o, p, q, fresh = p, q, fresh, o
