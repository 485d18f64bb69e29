"""The pass over the primal points of a staggered grid, whose quads lie across the edges of its cells."""

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel, wide
from quadcurv.kernels.quad import flux_scale, fluxes, ring_normal, store_curvature
from quadcurv.kernels.rows import (
    FIRST,
    LENGTH,
    RING,
    SHORT,
    STRETCH,
    STRIDE,
    WIDTH,
    A,
    S,
    Y,
    Z,
    aligned,
    last_quad,
    load_line,
    load_row,
)
from quadcurv.kernels.vector import ONE, THREE, apart, cross, place, triple, unit

EDGE = np.uint64(8 * SHORT)  # of the quads beside the points of a row, after what belongs to those below


@inlined
def below(planes, p, q, b, i):
    """Diagonals of the quad of the edge between rows p and q, across dual row b."""
    return apart(planes, q + i, planes, p + i, Y), apart(planes, b + i + ONE, planes, b + i, Y)


@inlined
def beside(planes, p, a, b, i):
    """Diagonals of the quad of the edge to the right in row p, from dual row b to a."""
    return apart(planes, p + i + ONE, planes, p + i, Y), apart(planes, a + i + ONE, planes, b + i + ONE, Y)


@helper
def first_fluxes(planes, p, q, b, part, width):
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
def cell_normals(planes, p, q, a, b, work, liu, H, normal, g, width):
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
        ring_normal(work, j + RING, S, u, v, liu, H, normal)


@helper
def cell_scales(work, part, liu, H, normal, area, at, g, width):
    """As `row_scales`."""
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
        flux_scale(work, j + RING, S, lengths, liu, H, normal, area, at + k)


@helper
def cell_curvatures(planes, p, q, a, b, work, part, Hn, H, at, g, width):
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
        store_curvature((tx, ty, tz), work, j + RING, S, Hn, H, at + k)


@kernel
def staggered_curvatures(points, beyond, across, halo, dual, liu, Hn, H, normal, area, start, stop):
    """As `grid_curvatures`, of the primal points of a staggered grid.

    Parameters
    ----------
    points : (3 r c,) float64
        Primal points; with halo = 1 (3 (r + 2) (c + 2),), those around them too.
    beyond : (6 c,) float64
        As for `grid_curvatures`; with halo = 1 not read.
    across
        As for `grid_curvatures`; with halo = 1 not read.
    halo : int
    dual : (3 (r + 1) (c + 1),) float64
        Dual points; those of the first row and column come before the first primal ones.
    liu, Hn, H, normal, area, start, stop
        As for `grid_curvatures`.
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
                first_fluxes(planes, p, q, b, part, np.uint64(end - begin))
            elif i > start:
                first_edge(planes, p, a, b, work)
                for left in range(begin, end, STRETCH):
                    right = min(left + STRETCH, end)
                    g, width = np.uint64(left - begin), np.uint64(right - left)
                    at = np.uint64((i - 1) * c + left)
                    cell_normals(planes, p, q, a, b, work, liu, H, normal, g, width)
                    cell_scales(work, part, liu, H, normal, area, at, g, width)
                    cell_curvatures(planes, p, q, a, b, work, part, Hn, H, at, g, width)
                    last_quad(work, FIRST + EDGE, width)
            p, q, a, b = q, p, b, a
