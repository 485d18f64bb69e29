"""Polynomials of height over tangent planes, by weighted least squares over rings, WIDTH vertices at once.

Unlike the fits of `jet` these look to one side and may hardly be determined: instead of normal equations the
terms of the points are made orthogonal (modified Gram-Schmidt, the heights as a last column, which is as
stable as reflections: Bjorck 1967). What there is of every fit lies in rows of WIDTH numbers, see `moments`.
"""

from math import inf, nan

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import WIDTH, Carried, formula, real, root, span, where
from quadcurv.kernels.moments import new_rows, put_row, row, step

DEGREE = 5
TERMS = tuple((d - b, b) for d in range(1, DEGREE + 1) for b in range(d + 1))  # x^a y^b
THIN = 1e-8  # of a neighbourhood's spread: no more than a line
CONDITION = 1e5
SPREAD = 1.3  # radius at which weights vanish, of the neighbourhood's
STEEP = 0.45  # cosine between normals; where it is less, polynomials of several rings do not follow
SPARE = 2  # points more than terms; with fewer residuals are small by chance
TALL = 5  # columns that are done at once
COLUMNS = len(TERMS) + 1
TINY = 2.0**-1022
# Rows of a result: the map, coefficients, noise, its gain beyond the border and in H.
MAP, COEFFICIENTS, NOISE, GAIN, BEND = 0, 4, 24, 25, 26
RESULTS = 27
# Rows of `lane`: how many points of each are fitted, and in its first ring; sums of squares; how well.
COUNT, FIRST, SQUARES, LEAST, MOST, WELL, LANES = range(7)
# Rows of a point: x, y, z; over the map; the weight.
X, Z, U, W, POINT = 0, 2, 3, 5, 6


def terms_at(x, y):
    """Values of all terms."""
    values = [x, y]
    for a, b in TERMS[2:]:
        values.append(values[TERMS.index((a - 1, b))] * x if a else values[TERMS.index((a, b - 1))] * y)
    return values


@step()
def into_map(P, lane, size, out):
    """Maps that make the spread of points round and their distance 1 at most, if there is any spread."""
    count, zero = row(lane, COUNT), 0.0 * row(lane, COUNT)

    def seen(m):
        return [where(count > real(m), row(P, POINT * m + X + a), 0.0) for a in range(2)]

    largest = Carried((zero,))
    for m in span(1, size):
        (most,) = largest.get()
        for x in seen(m):
            x = where(x < 0, -x, x)
            most = where(x > most, x, most)
        largest.set((most,))
    (extent,) = largest.get()
    scale = 1.0 / where(extent > 0, extent, 1.0)
    sums = Carried((zero,) * 3)
    for m in span(1, size):
        x, y = (v * scale for v in seen(m))
        xx, xy, yy = sums.get()
        sums.set((xx + x * x, xy + x * y, yy + y * y))
    xx, xy, yy = sums.get()
    spread = (extent > 0) & (xx * yy - xy * xy > THIN * xx * yy)
    xx, xy, yy = (where(spread, v, w) for v, w in ((xx, 1.0), (xy, 0.0), (yy, 1.0)))
    # The inverse of the Cholesky factor of the second moments.
    one, other = 1.0 / root(xx), 1.0 / root(yy - xy * xy / xx)
    across = -xy / xx * other
    largest = Carried((zero,))
    for m in span(1, size):
        x, y = (v * scale for v in seen(m))
        u, v = one * x, across * x + other * y
        square, (most,) = u * u + v * v, largest.get()
        largest.set((where(square > most, square, most),))
    scale = scale / root(where(spread, largest.get()[0], 1.0))
    for k, x in enumerate((one * scale, zero, across * scale, other * scale)):
        put_row(out, MAP + k, x)
    put_row(lane, WELL, where(spread, 1.0, 0.0))


@step()
def weighted(P, lane, size, out, rows):
    """Wendland's weights, smooth, and zero from a radius on; terms and heights times these."""
    count, a, b, c = row(lane, COUNT), row(out, MAP), row(out, MAP + 2), row(out, MAP + 3)
    squares = Carried((0.0 * count,))
    for m in span(0, size):
        x, y = row(P, POINT * m + X), row(P, POINT * m + X + 1)
        x, y = a * x, b * x + c * y
        r = root(x * x + y * y) / SPREAD
        w = 1.0 - r
        w = w * w
        w = where((count > real(m)) & (0.0 * count < real(m)), w * w * (4.0 * r + 1.0), 0.0)
        for k, value in enumerate((x, y, w)):
            put_row(P, POINT * m + U + k, value)
        for t, value in enumerate(terms_at(x, y)):
            put_row(rows, COLUMNS * m + t, value * w)
        put_row(rows, COLUMNS * m + COLUMNS - 1, row(P, POINT * m + Z) * w)
        squares.set((squares.get()[0] + w * w,))
    put_row(lane, SQUARES, squares.get()[0])
    put_row(lane, LEAST, 1.0 / TINY)
    put_row(lane, MOST, 0.0)


@step()
def factor(rows, size, T, groups, upper, lane):
    """Make the first T columns orthonormal, and leave of the last one what is orthogonal to them.

    TALL columns at once, which then stay in the first-level cache, against all that are before them.
    """
    last, zero = COLUMNS - 1, 0.0 * row(lane, COUNT)
    for t in span(0, groups):
        j = TALL * t
        for k in span(0, j + TALL):
            for _ in span(0, where(k < j, 0, 1)):  # a column of this group: its turn to be made normal
                sums = Carried((zero, zero))
                for m in span(1, size):
                    x, (square, height) = row(rows, COLUMNS * m + k), sums.get()
                    sums.set((square + x * x, height + x * row(rows, COLUMNS * m + last)))
                square, height = sums.get()
                norm, least, most = root(square), row(lane, LEAST), row(lane, MOST)
                inverse = 1.0 / where(norm > 0, norm, 1.0)
                height = where(k < T, height * inverse, 0.0)  # of columns beyond the terms nothing is left
                put_row(lane, LEAST, where(k < T, where(norm < least, norm, least), least))
                put_row(lane, MOST, where(k < T, where(norm > most, norm, most), most))
                for m in span(1, size):
                    x = row(rows, COLUMNS * m + k) * inverse
                    put_row(rows, COLUMNS * m + k, x)
                    put_row(rows, COLUMNS * m + last, row(rows, COLUMNS * m + last) - x * height)
                put_row(upper, COLUMNS * k + k, norm)
                put_row(upper, COLUMNS * k + last, height)
            sums = Carried((zero,) * TALL)
            for m in span(1, size):
                x = row(rows, COLUMNS * m + k)
                sums.set(tuple(s + x * row(rows, COLUMNS * m + j + i) for i, s in enumerate(sums.get())))
            sums = sums.get()
            for m in span(1, size):
                x = row(rows, COLUMNS * m + k)
                for i, s in enumerate(sums):
                    at = COLUMNS * m + j + i
                    put_row(rows, at, where(j + i > k, row(rows, at) - x * s, row(rows, at)))
            for i, s in enumerate(sums):
                at = COLUMNS * k + j + i
                put_row(upper, at, where(j + i > k, s, row(upper, at)))


@step()
def solve(upper, T, inverse, lane, out):
    """Invert the factor: coefficients, and whether all is well conditioned."""
    zero = 0.0 * row(lane, COUNT)
    sizes = Carried((zero, zero))
    for t in span(0, T):
        i = T - 1 - t
        own = row(upper, COLUMNS * i + i)
        scale = 1.0 / where(own > 0, own, 1.0)
        put_row(inverse, COLUMNS * i + i, scale)
        whole, of_inverse = sizes.get()
        sizes.set((whole + own * own, of_inverse + scale * scale))
        value = Carried((scale * row(upper, COLUMNS * i + COLUMNS - 1),))
        for j in span(i + 1, T):
            entry = Carried((zero,))
            for k in span(i + 1, j + 1):
                x = row(upper, COLUMNS * i + k) * row(inverse, COLUMNS * k + j)
                entry.set((entry.get()[0] - x,))
            x, y = entry.get()[0] * scale, row(upper, COLUMNS * i + j)
            put_row(inverse, COLUMNS * i + j, x)
            whole, of_inverse = sizes.get()
            sizes.set((whole + y * y, of_inverse + x * x))
            value.set((value.get()[0] + x * row(upper, COLUMNS * j + COLUMNS - 1),))
        put_row(out, COEFFICIENTS + i, value.get()[0])
    for t in span(T, len(TERMS)):
        put_row(out, COEFFICIENTS + t, 0.0)
    whole, of_inverse = sizes.get()
    well = (row(lane, LEAST) * CONDITION > row(lane, MOST)) & (row(lane, WELL) > 0)
    well = well & (root(whole) * root(of_inverse) < CONDITION)
    put_row(lane, WELL, where(well, 1.0, 0.0))


@step()
def leave(rows, P, size, T, lane, out):
    """The mean square of weighted residuals, for independent errors of one size; weigh the rows once more."""
    sums = Carried((0.0 * row(lane, COUNT), row(lane, SQUARES)))
    for m in span(1, size):
        w, explained = row(P, POINT * m + W), Carried((0.0 * row(lane, COUNT),))
        for t in span(0, T):
            x = row(rows, COLUMNS * m + t)
            explained.set((explained.get()[0] + x * x,))
            put_row(rows, COLUMNS * m + t, x * w)
        z, (square, free) = row(rows, COLUMNS * m + COLUMNS - 1), sums.get()
        sums.set((square + z * z, free - explained.get()[0] * w * w))
    square, free = sums.get()
    put_row(out, NOISE, root(square / where(free > TINY, free, TINY)))


@step()
def reached(own, rows, inverse, size, T, lane, out, target, share):
    """Add the square of what errors in height make of a linear combination of the coefficients."""
    zero = 0.0 * row(lane, COUNT)
    for t in span(0, T):  # from the last one on, in place
        j, value = T - 1 - t, Carried((zero,))
        for i in span(0, j + 1):
            value.set((value.get()[0] + row(own, i) * row(inverse, COLUMNS * i + j),))
        put_row(own, j, value.get()[0])
    total = Carried((zero,))
    for m in span(1, size):
        value = Carried((zero,))
        for t in span(0, T):
            value.set((value.get()[0] + row(rows, COLUMNS * m + t) * row(own, t),))
        total.set((total.get()[0] + value.get()[0] * value.get()[0],))
    put_row(out, target, row(out, target) + total.get()[0] * where(row(lane, FIRST) > share, 1.0, 0.0))


@step()
def mirror_terms(P, m, own):
    """Terms of a mirror image."""
    for t, value in enumerate(terms_at(-row(P, POINT * m + U), -row(P, POINT * m + U + 1))):
        put_row(own, t, value)


@step()
def mean_terms(out, own):
    """What the coefficients have in twice the mean curvature."""
    a, b, c = row(out, MAP), row(out, MAP + 2), row(out, MAP + 3)
    for t in range(len(TERMS)):
        put_row(own, t, 0.0)
    for term, value in (((2, 0), a * a), ((1, 1), a * b), ((0, 2), b * b + c * c)):
        put_row(own, TERMS.index(term), value)
    put_row(out, GAIN, 0.0)
    put_row(out, BEND, 0.0)


@step()
def rooted(lane, out):
    """Gains from sums of squares."""
    put_row(out, GAIN, root(row(out, GAIN) / (row(lane, FIRST) - 1.0)))
    put_row(out, BEND, root(row(out, BEND)))


@formula
def put_neighbourhood(
    points, areas, orientable, around, ring, room, frames, degrees, rings, at, k, P, lane, counts,
):  # fmt: skip
    """Write the points around a vertex, in its frame, into a column; how many of them each fit has, or 0."""
    base, frame, n, c = room * at, 9 * at, areas.size, around[room * at]
    axes = [[frames[frame + 3 * i + a] for a in range(3)] for i in range(3)]
    found = Carried((room + 1, 0))
    for m in span(0, room):
        is_there = around[base + m] >= 0
        v, (steep, first) = where(is_there, around[base + m], c), found.get()
        d = [points[3 * v + a] - points[3 * c + a] for a in range(3)]
        for i, (x, y, z) in enumerate(axes):
            P[(POINT * m + i) * WIDTH + k] = x * d[0] + y * d[1] + z * d[2]
        is_seen = is_there & (m > 0) & (3 * v < n)
        at_v = where(is_seen, 3 * v, 0)
        d, e, f = areas[at_v], areas[at_v + 1], areas[at_v + 2]
        x, y, z = axes[2]
        up = d * x + e * y + f * z
        up = where(orientable | (up >= 0), up, -up)
        is_steep = is_seen & (up < STEEP * root(d * d + e * e + f * f)) & (m < steep)
        is_first = is_there & (ring[base + m] <= 1)
        found.set((where(is_steep, m, steep), first + where(is_first, 1, 0)))
    steep, first = found.get()
    lane[WIDTH * FIRST + k] = real(first)
    for i in span(0, degrees.size):
        size, degree = Carried((0,)), degrees[i]
        for m in span(0, room):
            is_near = (around[base + m] >= 0) & (ring[base + m] <= rings[i])
            size.set((size.get()[0] + where(is_near, 1, 0),))
        (size,) = size.get()
        is_enough = size >= (((degree + 1) * (degree + 2)) >> 1) + SPARE
        is_followed = ((degree <= 2) | (steep >= size)) & (axes[2][0] == axes[2][0])
        counts[WIDTH * i + k] = where(is_enough & is_followed, size, 0)


@formula
def put_results(out, lane, counts, fits, i, begin, stop, found):
    """Results of a block, of vertices from `begin` on."""
    for k in span(0, where(stop - begin < WIDTH, stop - begin, WIDTH)):
        at, is_known = ((begin + k) * fits + i) * RESULTS, counts[WIDTH * i + k] > 0
        is_known = is_known & (lane[WIDTH * WELL + k] > 0)
        for j in span(0, RESULTS):
            found[at + j] = where(is_known, out[WIDTH * j + k], nan)


@kernel
def _fits(
    points, areas, orientable, around, ring, room, frames, degrees, rings, found, start, stop,
    P, lane, out, rows, upper, inverse, own, counts,
):  # fmt: skip
    fits = degrees.size
    for begin in range(start, stop, WIDTH):
        most = 0
        for k in range(WIDTH):  # the last one again where there are fewer
            put_neighbourhood(
                points, areas, orientable, around, ring, room, frames, degrees, rings,
                min(begin + k, stop - 1), k, P, lane, counts,
            )  # fmt: skip
            most = max(most, int(lane[WIDTH * FIRST + k]))
        for i in range(fits):
            size, T = 0, (degrees[i] + 1) * (degrees[i] + 2) // 2 - 1
            for k in range(WIDTH):
                lane[WIDTH * COUNT + k] = counts[WIDTH * i + k]
                size = max(size, counts[WIDTH * i + k])
            if size > 0:
                into_map(P, lane, size, out)
                weighted(P, lane, size, out, rows)
                factor(rows, size, T, (T + TALL - 1) // TALL, upper, lane)
                solve(upper, T, inverse, lane, out)
                leave(rows, P, size, T, lane, out)
                mean_terms(out, own)
                reached(own, rows, inverse, size, T, lane, out, BEND, 0.0)
                for m in range(1, most):
                    mirror_terms(P, m, own)
                    reached(own, rows, inverse, size, T, lane, out, GAIN, float(m))
                rooted(lane, out)
            put_results(out, lane, counts, fits, i, begin, stop, found)


def fits(points, areas, orientable, around, ring, frames, degrees, rings):
    """Fit polynomials of some degrees over as many rings at vertices.

    Parameters
    ----------
    points : (n, 3) float64
    areas : (m, 3) float64
        Vector areas of rings.
    orientable : bool
        Whether these tell which side is which.
    around, ring : (k, room)
        See `nearby.rings_around`.
    frames : (k, 3, 3) float64
        Two tangents and the normal.
    degrees, rings : (j,)

    Returns
    -------
    (k, j, RESULTS) float64
        NaN where a polynomial is not determined.
    """
    (k, room), j = around.shape, len(degrees)
    given = flat(points), flat(areas), orientable, flat(around), flat(ring), room, flat(frames)
    given += flat(degrees, np.int64), flat(rings, np.int64)
    found = np.empty((k, j, RESULTS))
    sizes = POINT * room, LANES, RESULTS, COLUMNS * room, COLUMNS * COLUMNS, COLUMNS * COLUMNS, COLUMNS

    def part(start, stop):
        scratch = map(new_rows, sizes)
        _fits(*given, found.reshape(-1), start, stop, *scratch, np.zeros(WIDTH * j, np.int64))

    ranges.over(part, k, 200 * k, WIDTH)
    return found


def value_at(u, v, coefficients, first):
    """Value of a polynomial."""
    return sum(coefficients[first + t] * term for t, term in enumerate(terms_at(u, v)))


height = formula(value_at)


@kernel
def _lifted(maps, coefficients, x, size, z):
    for k in range(z.size):
        at = k // size
        a, b, c, d = maps[4 * at], maps[4 * at + 1], maps[4 * at + 2], maps[4 * at + 3]
        u, v = x[2 * k], x[2 * k + 1]
        z[k] = height(a * u + b * v, c * u + d * v, coefficients, len(TERMS) * at)


def lifted(maps, coefficients, x):
    """Heights (k, j) of polynomials over points (k, j, 2) of their planes."""
    z = np.empty(x.shape[:2])
    _lifted(flat(maps), flat(coefficients), flat(x), x.shape[1], z.reshape(-1))
    return z


def nearest(x, count, u, v, but):
    """Square of the distance from a point of the plane to the nearest of some, all but one."""
    least = Carried((inf,))
    for j in span(0, count):
        d, e = x[2 * j] - u, x[2 * j + 1] - v
        square = d * d + e * e
        least.set((where((j != but) & (square < least.get()[0]), square, least.get()[0]),))
    return least.get()[0]


@formula
def mirror(points, around, ring, room, rings, frames, maps, coefficients, share, x, out, size, k):
    """Write the points of the rings around a vertex and their mirror images behind each other; how many."""
    base, first, to = room * k, 3 * around[room * k], 3 * size * k
    axes = [[frames[9 * k + 3 * i + a] for a in range(3)] for i in range(3)]
    number, spacing = Carried((0,)), Carried((0.0,))
    for m in span(0, room):
        is_there = (around[base + m] >= 0) & (ring[base + m] <= rings)  # ring after ring
        for _ in span(0, where(is_there, 1, 0)):
            v = 3 * around[base + m]
            d, e, f = (points[v + a] - points[first + a] for a in range(3))
            for a, (p, q, r) in enumerate(axes[:2]):
                x[2 * m + a] = p * d + q * e + r * f
            for a in range(3):
                out[to + 3 * m + a] = points[v + a]
            number.set((m + 1,))
    (count,) = number.get()
    for i in span(0, count):
        spacing.set((spacing.get()[0] + root(nearest(x, count, x[2 * i], x[2 * i + 1], i)),))
    free = spacing.get()[0] * (share / real(count))
    a, b, c, d = (maps[4 * k + i] for i in range(4))
    for i in span(0, count):
        u, v = -x[2 * i], -x[2 * i + 1]
        w = value_at(a * u + b * v, c * u + d * v, coefficients, len(TERMS) * k)
        (m,) = number.get()
        for j in range(3):
            p, q, r = (axes[axis][j] for axis in range(3))
            out[to + 3 * m + j] = points[first + j] + p * u + q * v + r * w
        is_free = (nearest(x, count, u, v, -1) > free * free) & (w - w == 0)
        number.set((m + where(is_free, 1, 0),))
    (m,) = number.get()
    for i in span(3 * m, 3 * size):
        out[to + i] = nan
    return m


@kernel
def _mirrored(points, around, ring, room, rings, frames, maps, coefficients, share, x, out, size, counts):
    for k in range(counts.size):
        counts[k] = mirror(
            points, around, ring, room, rings, frames, maps, coefficients, share, x, out, size, k
        )


def mirrored(points, around, ring, rings, frames, maps, coefficients, share):
    """Points of the rings around vertices, and their mirror images on polynomials where there is room.

    Parameters
    ----------
    points : (n, 3) float64
    around, ring : (k, room)
        See `nearby.rings_around`.
    rings : int
    frames : (k, 3, 3) float64
    maps : (k, 2, 2) float64
    coefficients : (k, len(TERMS)) float64
    share : float
        How far an image must be from all points, in mean distances of points from their nearest.

    Returns
    -------
    (k, m, 3) float64
        NaN behind.
    """
    k, room = around.shape
    size = 2 * int(((around >= 0) & (ring <= rings)).sum(axis=1).max(initial=1))
    out, counts, x = np.empty((k, size, 3)), np.zeros(k, np.int64), np.empty(2 * room)
    given = (flat(frames), flat(maps), flat(coefficients), share, x, out.reshape(-1), size, counts)
    _mirrored(flat(points), flat(around), flat(ring), room, rings, *given)
    return out[:, : counts.max(initial=1)]
