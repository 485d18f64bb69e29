"""Differences along the lines of a mesh, where its points are smooth functions of their own numbers.

Wherever quads meet by four a mesh has parameters: how many edges a point is away along the two lines through
a vertex. The grids of codes, and surfaces by formulas, are smooth in them; there polynomials through nine
points of each line, one-sided at borders, are far better than any fit of heights, which the surface's own
bends foreshorten. How good they are, polynomials of lower degrees tell. How rough the points are along their
lines, by noise or otherwise, their eighth differences tell where these differ from those around.

Arrays of positions and their derivatives are (3, ...) here.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from quadcurv.schemes.base import Neighbourhoods
from quadcurv.schemes.fundamental_forms import dot, invariants, principal, shape_operator
from quadcurv.types import Bools, Floats, Indices, Ints

if TYPE_CHECKING:
    from quadcurv.kernels.lines import Lines

DEGREE, RINGS = 8, 4
_DEGREES = (4, 6, DEGREE)
_POINTS, _HALF = DEGREE + 1, DEGREE // 2
_LEAST = 4  # points of a closed line
_AT_ONCE = 2**12  # vertices
# Of differences, the neighbours' mean is taken off so often; then so many rings tell, by so many numbers.
_PASSES, _AROUND, _FREEDOM = 3, 2, 20.0


@cache
def weights() -> Floats:
    """(offset, degree, derivative, point): first and second derivatives at a point by those nearest to it."""
    out = np.zeros((_POINTS, len(_DEGREES), 2, _POINTS))
    for offset in range(_POINTS):
        for k, d in enumerate(_DEGREES):
            first = min(max(offset - d // 2, 0), DEGREE - d)
            nodes = np.arange(first, first + d + 1) - offset
            for j, node in enumerate(nodes):
                others = np.delete(nodes, j)
                terms = np.poly(others)[::-1] / np.prod(node - others)  # of whole numbers, hence exact
                out[offset, k, :, first + j] = terms[1], 2 * terms[2]
    return out


# Each degree changes the entries of the shape operator by a like part of what the one before did, but where
# one happens to change nothing: hence over so many rings, so many times that part, and H and the others by so
# much of all entries at least.
_WIDE, _NEXT, _SHARE = 2, 3.0, 0.3
# Square of what noise 1 is in the sum of both lines' eighth differences, less the means of neighbours.
_OF_NOISE = 60729.1


class _Windows(NamedTuple):
    """The nine points of a line that are nearest to vertices.

    Attributes
    ----------
    points : (9, k) int32
    ways : (9, k) int8
        The slots in which the line goes on.
    offset : (k,) int64
        Which of them is the vertex.
    """

    points: Ints
    ways: Ints
    offset: Indices


def _windows(lines: Lines, axis: int | Indices, vertices: Indices) -> _Windows:
    place = lines.place[axis, vertices]
    line = lines.line[place]
    begin, end, closed = lines.begin[line], lines.end[line], lines.closed[line]
    start = np.where(closed, place - _HALF, np.clip(place - _HALF, begin, end - _POINTS))
    at = start + np.arange(_POINTS)[:, None]
    beyond = np.flatnonzero(closed & ((start < begin) | (start + _POINTS > end)))
    begin, end = begin[beyond], end[beyond]
    at[:, beyond] = begin + (at[:, beyond] - begin) % (end - begin)
    return _Windows(lines.vertices[at], lines.ways[at], place - start)


def _sums(weights: Floats, offset: Indices, values: Floats) -> Floats:
    """(w, 3, k): by weights (offset, w, 9) of values (3, 9, k), a line backwards giving the same."""
    out = np.empty((weights.shape[1], 3, offset.size))
    for o in np.flatnonzero(np.bincount(offset, minlength=_POINTS)):
        at = slice(None) if (offset == o).all() else np.flatnonzero(offset == o)
        here = values[:, :, at]
        for j, row in enumerate(weights[o]):
            sums = row[_HALF] * here[:, _HALF]
            for k in range(_HALF):
                if row[k] or row[-1 - k]:
                    sums += row[k] * here[:, k] + row[-1 - k] * here[:, -1 - k]
            out[j][:, at] = sums
    return out


def _on_long_lines(lines: Lines) -> Bools:
    """(n,): vertices on two lines of enough points."""
    long = np.append(lines.end - lines.begin >= np.where(lines.closed, _LEAST, _POINTS), False)
    line = np.append(lines.line, -1)  # that of place -1
    return long[line[lines.place]].all(axis=0)


def _near(around: Neighbourhoods, vertices: Indices) -> Bools:
    """(n,): whose lines vertices on long lines ask for, at least."""
    if 2 * vertices.size > len(around.points):
        return np.ones(len(around.points), bool)
    near = np.zeros((len(around.points), 1))
    near[vertices] = 1.0
    asked = around.pooled(near, _PASSES + _AROUND)[:, 0] > 0
    for axis in range(2):
        asked[_windows(around.lines, axis, vertices).points] = True
    return asked


def _blocks(vertices: Indices) -> Iterator[slice]:
    for start in range(0, vertices.size, _AT_ONCE):
        yield slice(start, start + _AT_ONCE)


class Differences(NamedTuple):
    """Curvatures by differences.

    Attributes
    ----------
    at : (k,) int64
        The vertices that have them.
    fits : (k, COLUMNS) float64
        In the columns of `kernels.jet`; NaN what is not said of them.
    noise : (k,) float64
        Of positions along their lines.
    bias : (k, 4) float64
        Of H, K, k1 and k2.
    """

    at: Indices
    fits: Floats
    noise: Floats
    bias: Floats


def differences(around: Neighbourhoods, vertices: Indices, error: Floats) -> Differences:
    """Curvatures of vertices on two long lines, where noise alone does not make H worse than `error`."""
    from quadcurv.kernels import jet as kernel

    lines, n, slopes = around.lines, len(around.points), weights()[:, -1, :1]
    eighth = np.broadcast_to(np.poly(np.ones(DEGREE)), slopes.shape)
    both = np.concatenate((slopes, eighth), axis=1)
    points, slope, rough = around.points.T.copy(), np.full((3, 2, n), np.nan), np.full((3, n), np.nan)
    on_lines = _on_long_lines(lines)
    vertices, error = vertices[on_lines[vertices]], error[on_lines[vertices]]
    long = np.flatnonzero(on_lines & _near(around, vertices))
    for block in _blocks(long):
        at = long[block]
        here = points[:, at][:, None]
        rough[:, at] = 0.0
        for axis in range(2):
            near = _windows(lines, axis, at)
            slope[:, axis, at], last = _sums(both, near.offset, points.take(near.points, axis=1) - here)
            rough[:, at] += last
    for _ in range(_PASSES):
        rough = rough - around.pooled(rough.T).T
    square = around.pooled((dot(rough, rough) / 3)[:, None], _AROUND)
    noise = np.sqrt(square[:, 0] / _OF_NOISE)

    # The line of the longer edges comes first, whichever the numbering begins with: so parts give the same.
    edge2 = dot(slope, slope)
    first = np.argmax(edge2, axis=0)
    least = np.linalg.norm(weights()[_HALF, -1, 1]) / 2  # gain of H, times the square of the shorter edge
    found = vertices[noise[vertices] * least < error * edge2.min(axis=0)[vertices]]
    # Column by column, as all results of fits lie.
    fits, change = np.full((kernel.COLUMNS, found.size), np.nan).T, np.full((n, 6), np.nan)
    fits[:, kernel.FREEDOM] = _FREEDOM
    middle = np.zeros(n, bool)
    for block in _blocks(found):
        at, out = found[block], fits[block].T
        middle[at], change[at], out[: kernel.NORMAL.stop], out[kernel.GAIN : kernel.GAIN + 4] = _block(
            points, lines, slope, at, (first[at], 1 - first[at])
        )
    # Near the ends of lines errors are tens of times as large, row by row: there nobody else's count.
    inside = around.pooled(np.where(middle[:, None], change, np.nan), _WIDE)
    change = np.where(middle[:, None], inside, change)
    before, behind, *each = np.sqrt(change[found]).T
    larger = np.abs(fits[:, kernel.K1 : kernel.K2 + 1]).max(axis=1)
    whole = behind * np.stack((np.ones_like(larger), larger, np.ones_like(larger), np.ones_like(larger)))
    with np.errstate(divide="ignore", invalid="ignore"):
        bias = np.fmin(_NEXT * behind / before, 1.0) * np.fmax(each, _SHARE * whole)
    known = np.isfinite(fits[:, : kernel.NORMAL.stop]).all(axis=1)
    if known.all():
        return Differences(found, fits, noise[found], bias.T)
    return Differences(found[known], fits.T[:, known].T, noise[found[known]], bias.T[known])


def _block(
    points: Floats, lines: Lines, slope: Floats, at: Indices, axes: tuple[Indices, Indices]
) -> tuple[Bools, Floats, Floats, Floats]:
    """Whether lines go on both ways; squares of what each degree changes; columns of a fit; its gains."""
    first, second, mixed, near = [], [], [], [_windows(lines, axis, at) for axis in axes]
    way = [lines.ways[lines.place[axis, at]] for axis in axes]
    each = weights().reshape(_POINTS, -1, _POINTS)
    for axis, (on, ways, offset) in enumerate(near):
        sums = _sums(each, offset, points.take(on, axis=1) - points[:, at][:, None])
        first.append(sums[0::2])
        second.append(sums[1::2])
        # Slopes of the lines across, which run the way that the vertex's own does, or against it.
        across = (ways + (way[1 - axis] - way[axis])) & 3
        line = across & 1
        along = np.where(lines.ways[lines.place[line, on]] == across, 1.0, -1.0)
        slopes = slope.reshape(3, -1).take(line * np.int64(slope.shape[2]) + on, axis=1) * along
        mixed.append(_sums(each[:, 0::2], offset, slopes))
    left = np.where((way[1] - way[0]) & 3 == 1, 1.0, -1.0)  # counter-clockwise
    both = left * (mixed[0] + mixed[1]) / 2
    shapes, by = [], []
    for k in range(3):
        X1, X2 = first[0][k], left * first[1][k]
        shape, frame, sides = shape_operator(X1, X2, second[0][k], both[k], second[1][k])
        shapes.append(np.stack(shape))
        by.append(np.stack(invariants(*shape)))
    (e1, e2, normal), (cos, sin) = frame, principal(*shape)
    directions = cos * e1 + sin * e2, cos * e2 - sin * e1
    less, more = np.diff(shapes, axis=0)
    entries = [x[0] ** 2 + 2 * x[1] ** 2 + x[2] ** 2 for x in (less, more)]
    change = np.concatenate((entries, (by[2] - by[1]) ** 2)).T
    gains = _gains(by[2], cos, sin, sides, near[0].offset, near[1].offset)
    middle = (near[0].offset == _HALF) & (near[1].offset == _HALF)
    return middle, change, np.concatenate((by[2], *directions, normal)), gains


def _gains(by: Floats, cos: Floats, sin: Floats, sides: Any, first: Indices, second: Indices) -> Floats:
    """(4, k): of H, K, k1 and k2, to first order by the second derivatives alone."""
    highest = weights()[:, -1]
    slope, bend = np.einsum("ojx,ojx->jo", highest, highest)
    middle = highest[range(_POINTS), 1, range(_POINTS)]
    s, f, g = sides
    parts, gains = [], []
    with np.errstate(divide="ignore", invalid="ignore"):
        for along, across in ((cos, sin), (-sin, cos)):  # along e1, e2; p and q times s along the lines
            q = across * s / g
            p = along - q * f / s
            parts.append(np.stack((p * p, 2 * p * q, q * q)))
        k1, k2 = parts
        for u, v, w in ((k1 + k2) / 2, by[3] * k1 + by[2] * k2, k1, k2):
            square = u * u * bend[first] + v * v * slope[first] * slope[second] + w * w * bend[second]
            gains.append(np.sqrt(square + 2 * u * w * middle[first] * middle[second]) / (s * s))
    return np.stack(gains)
