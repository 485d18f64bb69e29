"""Finite-volume and Liu's operators: one diamond flux, two dual areas.

With a quad's diagonals u and v, n = u x v and |n| twice its area, half the finite-volume flux into its
first vertex is (v x n) / (2 |n|) and into its second (n x u) / (2 |n|); the opposite vertices get the
same with the other sign. This is Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| / 2 of the finite-volume scheme with t1 = d - c, t2 = b - a.
|n| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.

The loops over grids and over rings are written for the compiler to vectorise and the processor to overlap:

* Coordinates are first de-interleaved into x, y and z planes that a loop only reads. What it writes is in
  few other arrays, so that there is little to prove about what overlaps.
* All indices are unsigned and the distances between planes constant. (A signed index may count from the
  end of an array and becomes a gather.)
* On grids the fluxes of the quad before are carried from one turn of the loop to the next instead of
  stored, which the compiler knows how to shift along its vectors.
* Roots and divisions have loops of their own, which leave them in the second-level cache. (With them the
  way from points to result takes 90 cycles, and a processor that looks 250 instructions ahead would see a
  single turn of the loop, and wait. Computing u x v a second time costs less.)

Every vertex sums its quads in the same order however the work is cut: results are bitwise the same.
"""

from math import nan, sqrt

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel, prefetch

WIDTH = 2048  # columns done at once: their rows stay in the second-level cache
BLOCK = 64  # vertices of a face list done at once: their rings stay in the first-level cache
AHEAD = 16  # vertices: where the points of rings lie far apart, they are asked for that early
LEAST_ROWS = 64  # of a range of its own, which computes a row of quads that others compute too
STRIDE = WIDTH + 16
FIRST = np.uint64(8)  # place of the first vertex in a plane, its left neighbour before it
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)
Y, Z, A = np.uint64(STRIDE), np.uint64(2 * STRIDE), np.uint64(3 * STRIDE)
SIDE, TWICE, POINT = np.uint64(BLOCK), np.uint64(2 * BLOCK), np.uint64(3 * BLOCK)


@inlined
def apart(x, i, y, j, plane):
    """Point i of planes x less point j of planes y."""
    return x[i] - y[j], x[i + plane] - y[j + plane], x[i + TWO * plane] - y[j + TWO * plane]


@inlined
def cross(a, b):
    """Cross product of two triples."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def dot(a, b):
    """Inner product of two triples."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def norm(a):
    """Length of a triple."""
    return sqrt(dot(a, a))


@inlined
def quotient(x, y):
    """Quotient by a positive y, else NaN: where an area underflows, u x v does not vanish."""
    return x / y if y > 0 else nan


@inlined
def half_fluxes(u, v, scale):
    """Half fluxes into a quad's first and second vertex from its diagonals; scale is 1 / (2 |u x v|)."""
    n = cross(u, v)
    n = n[0] * scale, n[1] * scale, n[2] * scale
    return cross(v, n), cross(n, u)


@inlined
def weigh(weights, i, a, b, liu, lengths, Hn, H, normal, area, k):
    """Put what a sum of half fluxes is multiplied by at place i; write normal and area of vertex k.

    The dual area is |a x b| / 4, in Liu's formula lengths / 8. The first plane of weights makes Hn, the
    others H. What is not wanted is None.
    """
    n = cross(a, b)
    square = dot(n, n)
    length = sqrt(square)
    unit = quotient(1, length)
    scale = 2 * unit if liu is None else quotient(4, lengths)  # 1 / (2 dual area)
    if Hn is not None:
        weights[i] = scale
    if H is not None:
        along = quotient(-2, square) if liu is None else -scale * unit  # the former has no root
        weights[i + Y] = along * n[0]
        weights[i + Z] = along * n[1]
        weights[i + A] = along * n[2]
    if normal is not None:
        normal[THREE * k] = n[0] * unit
        normal[THREE * k + ONE] = n[1] * unit
        normal[THREE * k + TWO] = n[2] * unit
    if area is not None:
        area[k] = 0.25 * length if liu is None else 0.125 * lengths


@inlined
def finish(tx, ty, tz, weights, i, Hn, H, k):
    """Write the curvatures of vertex k from the sum t of its half fluxes and the weights at place i."""
    if Hn is not None:
        Hn[THREE * k] = tx * weights[i]
        Hn[THREE * k + ONE] = ty * weights[i]
        Hn[THREE * k + TWO] = tz * weights[i]
    if H is not None:
        H[k] = tx * weights[i + Y] + ty * weights[i + Z] + tz * weights[i + A]


@inlined
def quad(p, q, i):
    """Diagonals of the quad whose first two vertices are at i in rows p and q, the others beside them."""
    return apart(q, i + ONE, p, i, Y), apart(p, i + ONE, q, i, Y)


@inlined
def root(roots, i, u, v):
    """Put 1 / (2 |u x v|) and |u x v| at place i."""
    length = norm(cross(u, v))
    roots[i] = quotient(0.5, length)
    roots[i + Y] = length


@inlined
def load(planes, i, row, k):
    """Put point k of a row at place i of the planes."""
    planes[i] = row[THREE * k]
    planes[i + Y] = row[THREE * k + ONE]
    planes[i + Z] = row[THREE * k + TWO]


@helper
def root_row(p, q, roots, row, fresh, width):
    """`root` of the quads between two rows, from the one before the first.

    `row`, the one after q, becomes planes on the way: it arrives from memory while the roots are computed.
    """
    u, v = quad(p, q, FIRST - ONE)
    root(roots, FIRST - ONE, u, v)
    for k in range(np.uint64(0), width):
        u, v = quad(p, q, FIRST + k)
        root(roots, FIRST + k, u, v)
        load(fresh, FIRST + k, row, k)


@helper
def first_row(p, q, roots, part, width):
    """Begin the sums of the vertices in row q with the quads between rows p and q."""
    u, v = quad(p, q, FIRST - ONE)
    (gx, gy, gz), _ = half_fluxes(u, v, roots[FIRST - ONE])
    for i in range(FIRST, FIRST + width):
        u, v = quad(p, q, i)
        (hx, hy, hz), (fx, fy, fz) = half_fluxes(u, v, roots[i])
        part[i] = fx - gx
        part[i + Y] = fy - gy
        part[i + Z] = fz - gz
        part[i + A] = roots[i + Y] + roots[i + Y - ONE]
        gx, gy, gz = hx, hy, hz


@helper
def weigh_row(o, p, q, roots, part, weights, liu, Hn, H, normal, area, at, width):
    """`weigh` the vertices of row p between rows o and q."""
    for k in range(np.uint64(0), width):
        i = FIRST + k
        a, b = apart(q, i, o, i, Y), apart(p, i + ONE, p, i - ONE, Y)
        lengths = part[i + A] + (roots[i + Y] + roots[i + Y - ONE])
        weigh(weights, i, a, b, liu, lengths, Hn, H, normal, area, at + k)


@helper
def vertex_row(p, q, roots, weights, part, liu, Hn, H, at, width):
    """Finish the vertices of row p; begin those of row q.

    A row of quads adds to two rows of vertices. The sums of the upper one are finished and written in the
    same loop; those of the lower one wait in `part` for the next row of quads.
    """
    u, v = quad(p, q, FIRST - ONE)
    (gx, gy, gz), (ex, ey, ez) = half_fluxes(u, v, roots[FIRST - ONE])
    for k in range(np.uint64(0), width):
        i = FIRST + k
        u, v = quad(p, q, i)
        (hx, hy, hz), (fx, fy, fz) = half_fluxes(u, v, roots[i])
        tx = part[i] + (hx - ex)
        ty = part[i + Y] + (hy - ey)
        tz = part[i + Z] + (hz - ez)
        part[i] = fx - gx
        part[i + Y] = fy - gy
        part[i + Z] = fz - gz
        if liu is not None:
            part[i + A] = roots[i + Y] + roots[i + Y - ONE]
        gx, gy, gz, ex, ey, ez = hx, hy, hz, fx, fy, fz
        finish(tx, ty, tz, weights, i, Hn, H, at + k)


@helper
def line(points, beyond, i):
    """Row i of the points, or the one beyond either end."""
    if i < 0:
        return beyond[0]
    if i >= points.shape[0]:
        return beyond[1]
    return points[i]


@helper
def load_row(planes, row, width):
    """Put a row into planes."""
    for k in range(np.uint64(0), width):
        load(planes, FIRST + k, row, k)


@helper
def load_ends(planes, row, beside, begin, end):
    """Put the neighbours of columns begin and end - 1 at the ends of a row in planes."""
    right = FIRST + np.uint64(end - begin)
    for x in range(3):
        plane = np.uint64(x) * Y
        planes[FIRST - ONE + plane] = row[3 * begin - 3 + x] if begin > 0 else beside[0, x]
        planes[right + plane] = row[3 * end + x] if 3 * end < row.size else beside[1, x]


@kernel
def vertices(points, beyond, beside, liu, Hn, H, normal, area, start, stop):
    """Mean curvature normal, mean curvature, unit normal and dual area of the vertices of rows start..stop.

    Parameters
    ----------
    points : (r, 3 c) float64
        Vertices, row by row.
    beyond : (2, 3 c) float64
        The rows before the first one and after the last one.
    beside : (r + 2, 2, 3) float64
        What lies before the first and after the last column, from the row before the first one on.
    liu : 0 or None
        None: the finite-volume scheme.
    Hn, normal : (3 r c,) float64 or None
        Written to, unless None; a version for each choice of None is compiled as it is called for.
    H, area : (r c,) float64 or None
    start, stop : int
    """
    c = points.shape[1] // 3
    planes = np.empty((4, 3 * STRIDE))
    part, roots, weights = np.empty(4 * STRIDE), np.empty(2 * STRIDE), np.empty(4 * STRIDE)
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        width = np.uint64(end - begin)
        o, p, q, fresh = planes[0], planes[1], planes[2], planes[3]
        for i, row_planes in ((start - 1, p), (start, q)):
            row = line(points, beyond, i)
            load_row(row_planes, row[3 * begin : 3 * end], width)
            load_ends(row_planes, row, beside[i + 1], begin, end)
        for i in range(start - 1, stop):  # the row of quads below the vertices of row i
            ahead, at = min(i + 2, stop), np.uint64(i * c + begin)
            row = line(points, beyond, ahead)
            root_row(p, q, roots, row[3 * begin : 3 * end], fresh, width)
            load_ends(fresh, row, beside[ahead + 1], begin, end)
            if i < start:
                first_row(p, q, roots, part, width)
            else:
                weigh_row(o, p, q, roots, part, weights, liu, Hn, H, normal, area, at, width)
                vertex_row(p, q, roots, weights, part, liu, Hn, H, at, width)
            o, p, q, fresh = p, q, fresh, o


@helper
def across_rows(p, q, b, roots, width):
    """`root` of the edges between primal rows p and q, along dual row b."""
    for i in range(FIRST, FIRST + width):
        root(roots, i, apart(q, i, p, i, Y), apart(b, i + ONE, b, i, Y))


@helper
def along_row(p, a, b, roots, width):
    """`root` of the edges between the points of primal row p, from dual row b to a."""
    for i in range(FIRST - ONE, FIRST + width):
        root(roots, i, apart(p, i + ONE, p, i, Y), apart(a, i + ONE, b, i + ONE, Y))


@helper
def first_cells(p, q, b, below, part, width):
    """Fluxes from primal row q into row p, across dual row b."""
    for i in range(FIRST, FIRST + width):
        (gx, gy, gz), _ = half_fluxes(apart(q, i, p, i, Y), apart(b, i + ONE, b, i, Y), below[i])
        part[i] = gx
        part[i + Y] = gy
        part[i + Z] = gz
        part[i + A] = below[i + Y]


@helper
def weigh_cells(a, b, below, beside, part, weights, liu, Hn, H, normal, area, at, width):
    """`weigh` the primal points between dual rows a and b."""
    for k in range(np.uint64(0), width):
        i = FIRST + k
        u, v = apart(b, i + ONE, a, i, Y), apart(a, i + ONE, b, i, Y)
        lengths = (below[i + Y] + part[i + A]) + (beside[i + Y] + beside[i + Y - ONE])
        weigh(weights, i, u, v, liu, lengths, Hn, H, normal, area, at + k)


@helper
def cell_row(p, q, a, b, below, beside, weights, part, liu, Hn, H, at, width):
    """Finish the points of primal row p, between dual rows a and b; q is the next one."""
    u, v = apart(p, FIRST, p, FIRST - ONE, Y), apart(a, FIRST, b, FIRST, Y)
    (ex, ey, ez), _ = half_fluxes(u, v, beside[FIRST - ONE])
    for k in range(np.uint64(0), width):
        i = FIRST + k
        (gx, gy, gz), _ = half_fluxes(apart(q, i, p, i, Y), apart(b, i + ONE, b, i, Y), below[i])
        u, v = apart(p, i + ONE, p, i, Y), apart(a, i + ONE, b, i + ONE, Y)
        (fx, fy, fz), _ = half_fluxes(u, v, beside[i])
        tx = (gx - part[i]) + (fx - ex)
        ty = (gy - part[i + Y]) + (fy - ey)
        tz = (gz - part[i + Z]) + (fz - ez)
        part[i] = gx
        part[i + Y] = gy
        part[i + Z] = gz
        if liu is not None:
            part[i + A] = below[i + Y]
        ex, ey, ez = fx, fy, fz
        finish(tx, ty, tz, weights, i, Hn, H, at + k)


@kernel
def cells(points, beyond, beside, halo, dual, liu, Hn, H, normal, area, start, stop):
    """As `vertices`, of the primal points of a staggered grid.

    Parameters
    ----------
    points : (r, 3 c) float64
        Primal points; with halo = 1 (r + 2, 3 c + 6), those beyond and beside among them.
    beyond, beside
        As for `vertices`; with halo = 1 not read.
    halo : int
    dual : (r + 1, 3 c + 3) float64
        Dual points; those of the first row and column come before the first primal ones.
    liu, Hn, H, normal, area, start, stop
        As for `vertices`.
    """
    c = dual.shape[1] // 3 - 1
    primal, corners = np.empty((2, 3 * STRIDE)), np.empty((2, 3 * STRIDE))
    part, below, right = np.empty(4 * STRIDE), np.empty(2 * STRIDE), np.empty(2 * STRIDE)
    weights = np.empty(4 * STRIDE)
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        width = np.uint64(end - begin)
        p, q, a, b = primal[0], primal[1], corners[0], corners[1]
        for i in range(start - 1, stop + 1):  # p and a are rows i - 1 once they are there
            row = line(points, beyond, i + halo)
            load_row(q, row[3 * (begin + halo) : 3 * (end + halo)], width)
            load_ends(q, row, beside[i + 1], begin + halo, end + halo)
            if i >= start:
                load_row(b, dual[i, 3 * begin : 3 * end + 3], width + ONE)
                across_rows(p, q, b, below, width)
            if i == start:
                first_cells(p, q, b, below, part, width)
            elif i > start:
                at = np.uint64((i - 1) * c + begin)
                along_row(p, a, b, right, width)
                weigh_cells(a, b, below, right, part, weights, liu, Hn, H, normal, area, at, width)
                cell_row(p, q, a, b, below, right, weights, part, liu, Hn, H, at, width)
            p, q, a, b = q, p, b, a


@inlined
def two_corners(x, k, a, d, b, e, c):
    """Half fluxes into vertex k from its corners (a, d, b) and (b, e, c), and |n| of both: one division."""
    u, v, w, z = (
        apart(x, d + k, x, k, SIDE),
        apart(x, b + k, x, a + k, SIDE),
        apart(x, e + k, x, k, SIDE),
        apart(x, c + k, x, b + k, SIDE),
    )
    m, n = cross(u, v), cross(w, z)
    p, q = norm(m), norm(n)
    f, g = cross(v, m), cross(z, n)
    scale = quotient(0.5, p * q)
    s, t = q * scale, p * scale
    return s * f[0] + t * g[0], s * f[1] + t * g[1], s * f[2] + t * g[2], p + q


@helper
def block(x, size, sums, weights, at, liu, Hn, H, normal, area):
    """Finish the vertices of a block from the planes x of their nine points."""
    a0, d0, a1, d1 = np.uint64(1) * POINT, np.uint64(2) * POINT, np.uint64(3) * POINT, np.uint64(4) * POINT
    a2, d2, a3, d3 = np.uint64(5) * POINT, np.uint64(6) * POINT, np.uint64(7) * POINT, np.uint64(8) * POINT
    for k in range(np.uint64(0), size):
        sums[k], sums[k + Y], sums[k + Z], sums[k + A] = two_corners(x, k, a0, d0, a1, d1, a2)
    for k in range(np.uint64(0), size):
        tx, ty, tz, lengths = two_corners(x, k, a2, d2, a3, d3, a0)
        sums[k] += tx
        sums[k + Y] += ty
        sums[k + Z] += tz
        sums[k + A] += lengths
    for k in range(np.uint64(0), size):
        weigh(
            weights,
            k,
            apart(x, a2 + k, x, a0 + k, SIDE),
            apart(x, a3 + k, x, a1 + k, SIDE),
            liu,
            sums[k + A],
            Hn,
            H,
            normal,
            area,
            at + k,
        )
    for k in range(np.uint64(0), size):
        finish(sums[k], sums[k + Y], sums[k + Z], weights, k, Hn, H, at + k)


@inlined
def gather_ring(points, ring, v, x, k):
    """Put vertex v and its ring, or v nine times, at place k of the planes of nine points."""
    regular = ring[v, 0] >= 0
    for j in range(9):
        i = THREE * np.uint64(ring[v, j - 1] if regular and j > 0 else v)
        at = np.uint64(j) * POINT + k
        x[at], x[at + SIDE], x[at + TWICE] = points[i], points[i + ONE], points[i + TWO]


@helper
def own(values, width):
    """Room for the results of a block, where they are wanted."""
    return None if values is None else np.empty(width * BLOCK)


@helper
def put(block, order, begin, end, width, values):
    """Write the results of vertices order[begin:end], where they are wanted, to their places."""
    if values is not None:
        for k in range(end - begin):
            i, at = np.uint64(width * order[begin + k]), np.uint64(width * k)
            for x in range(np.uint64(0), np.uint64(width)):
                values[i + x] = block[at + x]


@kernel
def rings(points, ring, order, far, liu, Hn, H, normal, area, start, stop):
    """As `vertices`, of the regular vertices start..stop of a face list.

    Parameters
    ----------
    points : (3 n,) float64
    ring : (n, 8) int32
        The ring (a, d, a, d, ...) of each vertex, counter-clockwise; negative first where the vertex is not
        regular, whose results are NaN.
    order : (n,) int32 or None
        Place in the results of each vertex; None: its own.
    far : bool
        Whether neighbours are far apart in `points`.
    liu, Hn, H, normal, area, start, stop
        As for `vertices`.
    """
    x, sums, weights = np.empty(9 * 3 * BLOCK), np.empty(4 * STRIDE), np.empty(4 * STRIDE)
    if order is not None:
        b_Hn, b_H, b_normal, b_area = own(Hn, 3), own(H, 1), own(normal, 3), own(area, 1)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            ahead = begin + k + AHEAD
            if far and ahead < stop and ring[ahead, 0] >= 0:
                for j in range(8):
                    prefetch(points, 3 * ring[ahead, j])
            gather_ring(points, ring, begin + k, x, np.uint64(k))
        if order is None:
            block(x, size, sums, weights, np.uint64(begin), liu, Hn, H, normal, area)
        else:
            block(x, size, sums, weights, np.uint64(0), liu, b_Hn, b_H, b_normal, b_area)
            put(b_Hn, order, begin, end, 3, Hn)
            put(b_H, order, begin, end, 1, H)
            put(b_normal, order, begin, end, 3, normal)
            put(b_area, order, begin, end, 1, area)


@inlined
def conductance(u, v):
    """K_00 and K_01 of a quad: K (u, v) are the half fluxes into its first two vertices."""
    scale = quotient(0.5, norm(cross(u, v)))
    return scale * dot(v, v), -scale * dot(u, v)


@helper
def corner_weights(x, a, d, b, own, mixed, size):
    """Planes of `conductance` of the corner (a, d, b) of each vertex of a block."""
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
def gather(points, order, ordered, start, stop):
    """Points (3 n,) in another order: the k-th is points order[k], for start <= k < stop."""
    for k in range(start, stop):
        i, at = THREE * np.uint64(order[k]), THREE * np.uint64(k)
        ordered[at], ordered[at + ONE], ordered[at + TWO] = points[i], points[i + ONE], points[i + TWO]


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
