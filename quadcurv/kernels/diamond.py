"""Finite-volume and Liu's operators: one diamond flux, two dual areas.

With a quad's diagonals u and v, n = u x v and |n| twice its area, half the finite-volume flux into its
first vertex is (v x n) / (2 |n|) and into its second (n x u) / (2 |n|); the opposite vertices get the
same with the other sign. This is Liu's alpha (a - c) + beta (b - c) + gamma (d - c) at every corner, and
(a^11 t1 + a^12 t2) / |t^(1)| |t2| / 2 of the finite-volume scheme with t1 = d - c, t2 = b - a.
|n| rather than the Gram determinant (thesis, eq. 3.27): no cancellation.

The loops over grids and over rings are written for the compiler to vectorise:

* Coordinates are first de-interleaved into x, y and z planes that the loop only reads. What it writes is in
  few other arrays, so that there is little to prove about what overlaps.
* All indices are unsigned and the distances between planes constant. (A signed index may count from the
  end of an array and becomes a gather.)
* On grids the fluxes of the quad before are carried from one turn of the loop to the next instead of
  stored, which the compiler knows how to shift along its vectors.

Every vertex sums its quads in the same order however the work is cut: results are bitwise the same.
"""

from math import nan, sqrt

import numpy as np

from quadcurv.kernels.compiled import helper, inlined, kernel

WIDTH = 4096  # columns done at once: their rows stay in the second-level cache
BLOCK = 64  # vertices of a face list done at once: their rings stay in the first-level cache
LEAST_ROWS = 64  # of a range of its own, which computes a row of quads that others compute too
STRIDE = WIDTH + 16
FIRST = np.uint64(8)  # place of the first vertex in a plane, its left neighbour before it
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)
Y, Z, A = np.uint64(STRIDE), np.uint64(2 * STRIDE), np.uint64(3 * STRIDE)
SIDE, TWICE, POINT = np.uint64(BLOCK), np.uint64(2 * BLOCK), np.uint64(3 * BLOCK)


@inlined
def flux(ux, uy, uz, vx, vy, vz):
    """Half fluxes into a quad's first and second vertex, and twice its area, from its diagonals."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = sqrt(nx * nx + ny * ny + nz * nz)
    scale = 0.5 / length if length > 0 else nan  # where an area underflows, n does not vanish
    nx, ny, nz = nx * scale, ny * scale, nz * scale
    return (
        vy * nz - vz * ny,
        vz * nx - vx * nz,
        vx * ny - vy * nx,
        ny * uz - nz * uy,
        nz * ux - nx * uz,
        nx * uy - ny * ux,
        length,
    )


@inlined
def quad(ring, p, q):
    """`flux` of the quad whose first two vertices are at p and q, the others beside them."""
    return flux(
        ring[q + ONE] - ring[p],
        ring[q + ONE + Y] - ring[p + Y],
        ring[q + ONE + Z] - ring[p + Z],
        ring[p + ONE] - ring[q],
        ring[p + ONE + Y] - ring[q + Y],
        ring[p + ONE + Z] - ring[q + Z],
    )


@inlined
def finish(k, tx, ty, tz, ax, ay, az, bx, by, bz, liu, lengths, Hn, H, normal, area):
    """Write what is wanted at vertex k.

    t is the sum of half fluxes; the dual area is |a x b| / 4, in Liu's formula lengths / 8.
    """
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    square = nx * nx + ny * ny + nz * nz
    length = sqrt(square)
    unit = 1 / length if length > 0 else nan
    scale = 2 * unit  # 1 / (2 dual area)
    if liu is not None:
        scale = 4 / lengths if lengths > 0 else nan
    if Hn is not None:
        Hn[THREE * k] = tx * scale
        Hn[THREE * k + ONE] = ty * scale
        Hn[THREE * k + TWO] = tz * scale
    if H is not None:
        along = tx * nx + ty * ny + tz * nz
        if liu is None:
            H[k] = -2 * along / square if square > 0 else nan  # = -scale * unit * along without the root
        else:
            H[k] = -scale * unit * along
    if normal is not None:
        normal[THREE * k] = nx * unit
        normal[THREE * k + ONE] = ny * unit
        normal[THREE * k + TWO] = nz * unit
    if area is not None:
        area[k] = 0.25 * length if liu is None else 0.125 * lengths


@helper
def first_row(ring, p, q, part, width):
    """Sums of the vertices in row q from the quads between rows p and q."""
    p, q = p + FIRST, q + FIRST
    gx, gy, gz, _, _, _, before = quad(ring, p - ONE, q - ONE)
    for k in range(np.uint64(0), width):
        hx, hy, hz, fx, fy, fz, length = quad(ring, p + k, q + k)
        part[k] = fx - gx
        part[k + Y] = fy - gy
        part[k + Z] = fz - gz
        part[k + A] = length + before
        gx, gy, gz, before = hx, hy, hz, length


@helper
def vertex_row(ring, o, p, q, part, row, fresh, liu, Hn, H, normal, area, at, width):
    """Finish the vertices of row p between rows o and q; begin those of row q.

    A row of quads adds to two rows of vertices. The sums of the upper one are finished, divided and written
    in the same loop; those of the lower one wait in `part` for the next row of quads. `row`, the one after q,
    is de-interleaved on the way: it arrives from memory while the quads are computed.
    """
    o, p, q = o + FIRST, p + FIRST, q + FIRST
    gx, gy, gz, ex, ey, ez, before = quad(ring, p - ONE, q - ONE)
    for k in range(np.uint64(0), width):
        hx, hy, hz, fx, fy, fz, length = quad(ring, p + k, q + k)
        tx = part[k] + (hx - ex)
        ty = part[k + Y] + (hy - ey)
        tz = part[k + Z] + (hz - ez)
        part[k] = fx - gx
        part[k + Y] = fy - gy
        part[k + Z] = fz - gz
        lengths = 0.0
        if liu is not None:
            lengths = part[k + A] + (length + before)
            part[k + A] = length + before
        gx, gy, gz, ex, ey, ez, before = hx, hy, hz, fx, fy, fz, length
        fresh[k] = row[THREE * k]
        fresh[k + Y] = row[THREE * k + ONE]
        fresh[k + Z] = row[THREE * k + TWO]
        finish(
            at + k,
            tx,
            ty,
            tz,
            ring[q + k] - ring[o + k],
            ring[q + k + Y] - ring[o + k + Y],
            ring[q + k + Z] - ring[o + k + Z],
            ring[p + k + ONE] - ring[p + k - ONE],
            ring[p + k + ONE + Y] - ring[p + k - ONE + Y],
            ring[p + k + ONE + Z] - ring[p + k - ONE + Z],
            liu,
            lengths,
            Hn,
            H,
            normal,
            area,
        )


@helper
def line(points, beyond, i):
    """Row i of the points, or the one beyond either end."""
    if i < 0:
        return beyond[0]
    if i >= points.shape[0]:
        return beyond[1]
    return points[i]


@helper
def load(ring, at, row, width):
    """De-interleave a row."""
    at += FIRST
    for k in range(np.uint64(0), width):
        ring[at + k] = row[THREE * k]
        ring[at + k + Y] = row[THREE * k + ONE]
        ring[at + k + Z] = row[THREE * k + TWO]


@helper
def load_ends(ring, at, row, beside, begin, end):
    """Put the neighbours of columns begin and end - 1 at the ends of a row in the ring."""
    left, right = at + FIRST - ONE, at + FIRST + np.uint64(end - begin)
    for x in range(3):
        plane = np.uint64(x * STRIDE)
        ring[left + plane] = row[3 * begin - 3 + x] if begin > 0 else beside[0, x]
        ring[right + plane] = row[3 * end + x] if 3 * end < row.size else beside[1, x]


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
    ring, fresh, part = np.empty(9 * STRIDE), np.empty(3 * STRIDE), np.empty(4 * STRIDE)
    size = np.uint64(3 * STRIDE)
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        width = np.uint64(end - begin)
        o, p, q = np.uint64(0), size, TWO * size
        for i, at in ((start - 1, o), (start, p), (start + 1, q)):
            row = line(points, beyond, i)
            load(ring, at, row[3 * begin : 3 * end], width)
            load_ends(ring, at, row, beside[i + 1], begin, end)
        first_row(ring, o, p, part, width)
        for i in range(start, stop):
            ahead = min(i + 2, stop)
            row = line(points, beyond, ahead)
            vertex_row(
                ring,
                o,
                p,
                q,
                part,
                row[3 * begin : 3 * end],
                fresh,
                liu,
                Hn,
                H,
                normal,
                area,
                np.uint64(i * c + begin),
                width,
            )
            for x in range(3):
                plane = np.uint64(x * STRIDE)
                for k in range(np.uint64(0), width):
                    ring[o + FIRST + plane + k] = fresh[plane + k]
            load_ends(ring, o, row, beside[ahead + 1], begin, end)
            o, p, q = p, q, o


@inlined
def across(ring, c, d, corners, a, b):
    """Half flux from the primal point at d into that at c, across the dual edge from a to b."""
    gx, gy, gz, _, _, _, length = flux(
        ring[d] - ring[c],
        ring[d + Y] - ring[c + Y],
        ring[d + Z] - ring[c + Z],
        corners[b] - corners[a],
        corners[b + Y] - corners[a + Y],
        corners[b + Z] - corners[a + Z],
    )
    return gx, gy, gz, length


@helper
def first_cells(ring, p, q, corners, b, part, width):
    """Fluxes from row q of primal points into row p, across row b of dual points."""
    p, q, b = p + FIRST, q + FIRST, b + FIRST
    for k in range(np.uint64(0), width):
        part[k], part[k + Y], part[k + Z], part[k + A] = across(
            ring, p + k, q + k, corners, b + k, b + k + ONE
        )


@helper
def cell_row(ring, p, q, corners, a, b, part, liu, Hn, H, normal, area, at, width):
    """Finish the primal points of row p, between rows a and b of dual points; q is the next one."""
    p, q, a, b = p + FIRST, q + FIRST, a + FIRST, b + FIRST
    ex, ey, ez, before = across(ring, p - ONE, p, corners, b, a)
    for k in range(np.uint64(0), width):
        gx, gy, gz, length = across(ring, p + k, q + k, corners, b + k, b + k + ONE)
        fx, fy, fz, beside = across(ring, p + k, p + k + ONE, corners, b + k + ONE, a + k + ONE)
        tx = (gx - part[k]) + (fx - ex)
        ty = (gy - part[k + Y]) + (fy - ey)
        tz = (gz - part[k + Z]) + (fz - ez)
        lengths = (length + part[k + A]) + (beside + before)
        part[k], part[k + Y], part[k + Z], part[k + A] = gx, gy, gz, length
        ex, ey, ez, before = fx, fy, fz, beside
        finish(
            at + k,
            tx,
            ty,
            tz,
            corners[b + k + ONE] - corners[a + k],
            corners[b + k + ONE + Y] - corners[a + k + Y],
            corners[b + k + ONE + Z] - corners[a + k + Z],
            corners[a + k + ONE] - corners[b + k],
            corners[a + k + ONE + Y] - corners[b + k + Y],
            corners[a + k + ONE + Z] - corners[b + k + Z],
            liu,
            lengths,
            Hn,
            H,
            normal,
            area,
        )


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
    ring, corners, part = np.empty(6 * STRIDE), np.empty(6 * STRIDE), np.empty(4 * STRIDE)
    for begin in range(0, c, WIDTH):
        end = min(begin + WIDTH, c)
        width = np.uint64(end - begin)
        p, q = np.uint64(0), np.uint64(3 * STRIDE)
        for i in range(start - 1, stop + 1):
            row = line(points, beyond, i + halo)
            load(ring, q, row[3 * (begin + halo) : 3 * (end + halo)], width)
            load_ends(ring, q, row, beside[i + 1], begin + halo, end + halo)
            if i >= start:
                load(corners, q, dual[i, 3 * begin : 3 * end + 3], width + ONE)
            if i == start:
                first_cells(ring, p, q, corners, q, part, width)
            elif i > start:
                at = np.uint64((i - 1) * c + begin)
                cell_row(ring, p, q, corners, p, q, part, liu, Hn, H, normal, area, at, width)
            p, q = q, p


@inlined
def corner(x, k, a, d, b):
    """Flux v x n of vertex k of a block in its corner (a, d, b), not divided by 2 |n| yet, and |n|."""
    ux, uy, uz = x[d + k] - x[k], x[d + k + SIDE] - x[k + SIDE], x[d + k + TWICE] - x[k + TWICE]
    vx, vy, vz = x[b + k] - x[a + k], x[b + k + SIDE] - x[a + k + SIDE], x[b + k + TWICE] - x[a + k + TWICE]
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = sqrt(nx * nx + ny * ny + nz * nz)
    return vy * nz - vz * ny, vz * nx - vx * nz, vx * ny - vy * nx, length


@inlined
def two_corners(x, k, a, d, b, e, c):
    """Half fluxes into vertex k from its corners (a, d, b) and (b, e, c), and |n| of both: one division."""
    px, py, pz, p = corner(x, k, a, d, b)
    qx, qy, qz, q = corner(x, k, b, e, c)
    product = p * q
    scale = 0.5 / product if product > 0 else nan
    s, t = q * scale, p * scale
    return s * px + t * qx, s * py + t * qy, s * pz + t * qz, p + q


@helper
def block(x, size, at, liu, Hn, H, normal, area):
    """Finish the vertices of a block from the planes x of their nine points."""
    a0, d0, a1, d1 = np.uint64(1) * POINT, np.uint64(2) * POINT, np.uint64(3) * POINT, np.uint64(4) * POINT
    a2, d2, a3, d3 = np.uint64(5) * POINT, np.uint64(6) * POINT, np.uint64(7) * POINT, np.uint64(8) * POINT
    for k in range(np.uint64(0), size):
        px, py, pz, p = two_corners(x, k, a0, d0, a1, d1, a2)
        qx, qy, qz, q = two_corners(x, k, a2, d2, a3, d3, a0)
        finish(
            at + k,
            px + qx,
            py + qy,
            pz + qz,
            x[a2 + k] - x[a0 + k],
            x[a2 + k + SIDE] - x[a0 + k + SIDE],
            x[a2 + k + TWICE] - x[a0 + k + TWICE],
            x[a3 + k] - x[a1 + k],
            x[a3 + k + SIDE] - x[a1 + k + SIDE],
            x[a3 + k + TWICE] - x[a1 + k + TWICE],
            liu,
            p + q,
            Hn,
            H,
            normal,
            area,
        )


@inlined
def gather_ring(points, ring, v, x, k):
    """Put vertex v and its ring, or v nine times, at place k of the planes of nine points."""
    regular = ring[v, 0] >= 0
    for j in range(9):
        i = THREE * np.uint64(ring[v, j - 1] if regular and j > 0 else v)
        at = np.uint64(j) * POINT + k
        x[at], x[at + SIDE], x[at + TWICE] = points[i], points[i + ONE], points[i + TWO]


@kernel
def rings(points, ring, liu, Hn, H, normal, area, start, stop):
    """As `vertices`, of the regular vertices start..stop of a face list.

    Parameters
    ----------
    points : (3 n,) float64
    ring : (n, 8) int32
        The ring (a, d, a, d, ...) of each vertex, counter-clockwise; negative first where the vertex is not
        regular, whose results are NaN.
    liu, Hn, H, normal, area, start, stop
        As for `vertices`.
    """
    x = np.empty(9 * 3 * BLOCK)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        for k in range(end - begin):
            gather_ring(points, ring, begin + k, x, np.uint64(k))
        block(x, np.uint64(end - begin), np.uint64(begin), liu, Hn, H, normal, area)


@inlined
def conductance(ux, uy, uz, vx, vy, vz):
    """K_00 and K_01 of a quad: K (u, v) are the half fluxes into its first two vertices."""
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    length = sqrt(nx * nx + ny * ny + nz * nz)
    scale = 0.5 / length if length > 0 else nan
    return scale * (vx * vx + vy * vy + vz * vz), -scale * (ux * vx + uy * vy + uz * vz)


@helper
def weights(x, size, row):
    """Rows of the stiffness of a block, planes of the weights of the nine points in `row`."""
    for j in range(4):
        a = np.uint64(2 * j + 1) * POINT
        d, b = a + POINT, np.uint64((2 * j + 2) % 8 + 1) * POINT
        to_a, to_d, to_b = (
            np.uint64(2 * j + 1) * SIDE,
            np.uint64(2 * j + 2) * SIDE,
            np.uint64((2 * j + 2) % 8 + 1) * SIDE,
        )
        for k in range(np.uint64(0), size):
            own, cross_ = conductance(
                x[d + k] - x[k],
                x[d + k + SIDE] - x[k + SIDE],
                x[d + k + TWICE] - x[k + TWICE],
                x[b + k] - x[a + k],
                x[b + k + SIDE] - x[a + k + SIDE],
                x[b + k + TWICE] - x[a + k + TWICE],
            )
            row[k] += own
            row[to_d + k] -= own
            row[to_a + k] += cross_
            row[to_b + k] -= cross_


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
    column, rank = np.empty(9 * BLOCK, np.int32), np.empty(9 * BLOCK, np.int32)
    for begin in range(start, stop, BLOCK):
        end = min(begin + BLOCK, stop)
        size = np.uint64(end - begin)
        for k in range(end - begin):
            gather_ring(points, ring, begin + k, x, np.uint64(k))
            column[k] = begin + k
            for j in range(8):
                column[BLOCK * (j + 1) + k] = ring[begin + k, j]
        row[:] = 0
        weights(x, size, row)
        ranks(column, size, rank)
        for v in range(begin, end):
            if ring[v, 0] < 0:
                continue
            for j in range(9):
                at = BLOCK * j + v - begin
                indices[indptr[v] + rank[at]] = column[at]
                data[indptr[v] + rank[at]] = row[at]


@kernel
def gather(values, order, ordered, start, stop):
    """ordered[k] = values[order[k]] for start <= k < stop."""
    for k in range(start, stop):
        for x in range(values.shape[1]):
            ordered[k, x] = values[order[k], x]


@kernel
def scatter(ordered, order, values, start, stop):
    """values[order[k]] = ordered[k] for start <= k < stop."""
    for k in range(start, stop):
        for x in range(values.shape[1]):
            values[order[k], x] = ordered[k, x]


@inlined
def cross(a, b):
    """Cross product of two triples."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


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
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
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
        scale = 0.5 / np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
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
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
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
        scale = 0.5 / np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        K[f, 0, 0] = scale * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
        K[f, 0, 1] = K[f, 1, 0] = -scale * (u[0] * v[0] + u[1] * v[1] + u[2] * v[2])
        K[f, 1, 1] = scale * (u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
    return K
