"""Polynomial fits of height over the tangent plane ("jets", Cazals and Pouget 2005), many at a time.

Around a vertex, in a frame whose z axis is the normal of its ring, the neighbourhood is fitted by
z = sum c_ab x^a y^b, a + b <= degree, in the least-squares sense. x and y are first made to have unit second
moments (an affine map, under which the polynomials stay what they are): the conditioning then depends on
the shape of the neighbourhood alone, neither on its size nor on its stretching. The normal equations
are those of the moments sum x^a y^b, 45 numbers for degree 4. Their terms are eliminated highest degree
first, so that what the curvature needs (c10, c01, c20, c11, c02) comes last: the last block of the
Cholesky factor gives it without the others. The very last term is the constant one: less its row
the factor is that of fits through the vertex.

Four KINDS of fits: PLAIN ones; ROUND ones, over the sphere instead of the plane (see `moments`); SMOOTH
ones, round, through the vertex, and with weights (1 - r^2)^4 that fall to nearly nothing at the rim (Jiao and
Zha 2008 interpolate and weigh): of these bias is least, of the others noise; FLAT ones, like the SMOOTH but
over the plane. All but the first are of even degree.

WIDTH fits, a block, go through every step together, in registers side by side.
"""

from math import inf, nan

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.factor import TALL, factor, last_rows, table_of
from quadcurv.kernels.formulas import WIDTH, put_lanes, real, root, span, where
from quadcurv.kernels.gather import Blocks, Rings, Windows
from quadcurv.kernels.moments import (
    AXES,
    BEND,
    CHUNK,
    COUNT,
    LEAST,
    LEFT,
    LESS,
    ROWS,
    ROWS_OF_LANE,
    SPREAD,
    STEEP,
    XX,
    YX,
    YY,
    add_moments_2,
    add_moments_4,
    add_moments_6,
    clear,
    frames,
    into_frames,
    into_frames_beside,
    into_maps,
    into_planes,
    into_planes_beside,
    moments_degree,
    moments_of,
    new_rows,
    row,
    rows,
    spread_2,
    spread_4,
    spread_6,
    step,
)
from quadcurv.kernels.shape import INDICES, curvatures, variances

PLAIN, ROUND, SMOOTH, FLAT = KINDS = range(4)
# Below this part of a term's square nothing is left but rounding.
PIVOT = 1e-9
# Columns of a result.
MEAN, GAUSSIAN, K1, K2 = 0, 1, 2, 3
DIRECTION1, DIRECTION2, NORMAL = slice(4, 7), slice(7, 10), slice(10, 13)
# GAIN, BIAS: four of them.
SIGMA, GAIN, CONDITION, BIAS, SQUARE, FREEDOM, LOWER, WHOLE, COLUMNS = 13, 14, 18, 19, 23, 24, 25, 26, 27


def count_of(degree):
    """Of terms."""
    return (degree + 1) * (degree + 2) // 2


def results(nested, size):
    """Room for (nested COLUMNS, size) results, or some more.

    A block of a column is one line of the caches, and long columns are an odd number of pages of memory and
    one line apart: else processors would remember all of them in the same few places.
    """
    lines, page = -(-size // WIDTH), 64
    if lines > page:
        lines = (-(-lines // page) | 1) * page + 1
    return new_rows(nested * COLUMNS * lines).reshape(nested * COLUMNS, -1)


def workspace(degree, room):
    """Scratch of `_fit`.

    Returns
    -------
    P, lane, px, q, mu, A, diagonal, G, results
        Rows: points and what there is of every fit (see `moments`); powers of x, and of y times the weight;
        moments; the Cholesky factor, with the right-hand side as its last row, and what is left of the
        squares; what the last three of the terms before 1 are of the points; results of a block.
    table, starts
        See `factor`.
    """
    T, even = count_of(degree), moments_degree(degree)
    sizes = (
        ROWS * room, ROWS_OF_LANE, 2 * even * CHUNK, CHUNK, len(moments_of(even)), (T + 1 + TALL) * T,
        T + 1 + TALL, 3 * T, COLUMNS,
    )  # fmt: skip
    return *map(new_rows, sizes), *table_of(degree)


@step()
def result(A, lane, mu, szz, T, through, is_seen, column, at, stop, out, n, results):
    """All results of a block, of vertices from `at` on: to `out`, but to `results` where there are fewer."""
    is_full = at + WIDTH <= stop
    target, stride, first = (
        where(is_full, x, y) for x, y in ((out, results), (n, WIDTH), (column * n + at, 0))
    )
    # The last rows and columns of the Cholesky factor, (7, 6), the right-hand side last; inverses on its
    # diagonal.
    B = {(i, j): row(A, (T - 6 + i) * T + T - 6 + j) for i in range(7) for j in range(6) if j <= i}
    frame, maps = rows(lane, AXES, 9), [row(lane, k) for k in (XX, YX, YY, BEND)]
    count, left, whole = row(lane, COUNT), row(lane, LEFT), row(mu, szz)
    square, constant = where(left < 0, 0.0, left), B[6, 5] * B[5, 5]
    # Points less the terms, weighted ones for as much as they count.
    freedom = count - real(T)
    sigma = where(freedom > 0, root(square / freedom), nan)
    sums = rows(lane, SPREAD, 9)
    # A vertex that all pass through is in the other points, turned round.
    S = [
        where(through, x + sums[i] * sums[j], y)
        for x, y, (i, j) in zip(sums[3:], variances(B), INDICES, strict=True)
    ]
    values, gains = curvatures(B, where(through, 0.0, constant), *maps, frame, S)
    others, _ = curvatures(B, where(through, constant, 0.0), *maps, frame, S)
    bias = (b - a for a, b in zip(values[:4], others[:4], strict=True))
    condition = where(count > 0, root((S[0] + S[2] + S[5]) * count), nan)
    squares = square, freedom, row(lane, LESS), whole
    is_determined, is_steep = row(lane, LEAST) > PIVOT, where(is_seen, row(lane, STEEP), 0.0) > 0
    for k, x in enumerate((*values, sigma, *gains, condition, *bias, *squares)):
        known = where(is_determined, x, inf if k == CONDITION else nan)
        put_lanes(target, first + k * stride, where(is_steep, nan, known))


@step()
def rest(results, column, at, stop, out, n):
    """Copy the results of a block that is not full."""
    for k in span(0, where(stop - at < WIDTH, stop - at, 0)):
        for j in span(0, COLUMNS):
            out[(column + j) * n + at + k] = results[j * WIDTH + k]


@kernel
def _fit(
    points, normals, centres, blocks, index, counts, beside, room, is_seen, degree, kind, nested, out, at,
    stop, P, lane, px, q, mu, A, diagonal, G, results, table, starts,
):  # fmt: skip
    n, szz = out.size // (nested * COLUMNS), mu.size // WIDTH - 1
    is_round, through = (kind == ROUND) | (kind == SMOOTH), kind >= SMOOTH
    for block in range(blocks):
        first, size = block * room, 0
        for k in range(block * WIDTH, (block + 1) * WIDTH):
            size = max(size, counts[k])
        frames(points, normals, centres, counts, block, lane)
        if beside[block]:
            into_frames_beside(points, index, first, size, is_round, P, lane)
            into_planes_beside(normals, index, first, size, kind == ROUND, P, lane)
        else:
            into_frames(points, index, first, size, is_round, P, lane)
            into_planes(normals, index, first, size, kind == ROUND, P, lane)
        into_maps(P, size, through, lane)
        clear(mu, szz + 1)
        for begin in range(0, size, CHUNK):
            some = min(CHUNK, size - begin)
            if degree > 4:
                add_moments_6(P, begin, some, px, q, mu)
            elif degree > 2:
                add_moments_4(P, begin, some, px, q, mu)
            else:
                add_moments_2(P, begin, some, px, q, mu)
        for k in range(nested, -1, -1):
            d = degree - 2 * k
            T = (d + 1) * (d + 2) // 2
            if d >= 0:
                factor(A, diagonal, mu, table, starts[d // 2], T, lane)
            if k < nested:
                if through:  # of least squares without weights the factor tells all
                    last_rows(A, G, T)
                    if degree > 4:
                        spread_6(P, size, G, lane)
                    elif degree > 2:
                        spread_4(P, size, G, lane)
                    else:
                        spread_2(P, size, G, lane)
                result(A, lane, mu, szz, T, through, is_seen, k * COLUMNS, at, stop, out, n, results)
                rest(results, k * COLUMNS, at, stop, out, n)
        at += WIDTH


def _fits(points, normals, vertices, degree, kind, rings, sided, gather, out, start, stop):
    """Results start..stop; `gather` puts neighbourhoods into blocks and tells what room one needs."""
    given, nested, is_seen = (flat(points), flat(normals)), len(out) // COLUMNS, bool(sided and rings > 1)
    blocks, scratch = Blocks((2 * rings + 1) ** 2), None
    while start < stop:
        some = vertices[start : min(stop, start + WIDTH * blocks.most)]
        blocks.begin(some)
        if (needed := gather(blocks)) > blocks.room:
            blocks, scratch = Blocks(2 * needed), None
            continue
        scratch = scratch or workspace(degree, blocks.room)
        _fit(
            *given, blocks.centres, blocks.size, blocks.index, blocks.counts, blocks.beside, blocks.room,
            is_seen, degree, kind, nested, out.reshape(-1), start, start + len(some), *scratch,
        )  # fmt: skip
        start += len(some)


def grid_fits(points, normals, wrap, vertices, degree, rings, kind, out, start, stop):
    """Fit a grid's vertices over windows of 2 rings + 1 points in both directions.

    Parameters
    ----------
    points, normals : (r, c, 3) float64
        Normals of any length.
    wrap : (bool, bool)
    vertices : (k,) int32
        Vertices to fit, row by row.
    degree : int
    rings : int
    kind : int
        One of KINDS.
    out : (COLUMNS, k), (2 COLUMNS, k) or (3 COLUMNS, k) float64, or more columns
        Columns from `start` to `stop` are filled, further rows by the same fits of two and of four degrees
        less, at least 2, which need no moments of their own; not of SMOOTH and FLAT ones. With several rings
        all is NaN, the CONDITION too, where the neighbourhood is too steep; with any, all but the CONDITION,
        infinite then, where it does not determine the polynomial.
    """
    around = Windows(points.shape[:2], wrap, rings)
    _fits(points, normals, vertices, degree, kind, rings, True, around.put, out, start, stop)


def face_fits(
    points, faces, indptr, corners, ring, run, normals, sided, vertices, degree, rings, kind, out, start, stop
):
    """Fit vertices of a face list over all vertices of `rings` rings of faces around them.

    Parameters
    ----------
    points : (p, 3) float64
    faces : (m, 4) int32
    indptr, corners
        Corners by vertex, see topology.corners_by_vertex.
    ring, run
        Where windows are, see gather.Rings.
    normals : (p, 3) float64
        Of any length, zero where nobody knows one.
    sided : bool
        Whether they are all on the same side; if not, nobody knows what is too steep.
    vertices : (k,) int32
        Vertices to fit.
    degree, rings, kind, out, start, stop
        As for grid_fits.
    """
    around = Rings(faces, indptr, corners, ring, run, rings)
    _fits(points, normals, vertices, degree, kind, rings, sided, around.put, out, start, stop)
