"""Lines of points that end at the border, continued by ghosts; and how far these are off.

A polynomial through the first points of a line X_0, X_1, ... is read off beyond X_0: by index, X_-1 = 5 X_0 -
10 X_1 + 10 X_2 - 5 X_3 + X_4, where the points are smooth functions of their index, else by arc length, on
cumulative chord lengths, at the mirror images of X_1, X_2. What a sixth point would change tells the error:
clearly less than what the fifth has changed where the line is smooth, twice as much where there is noise.
"""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np

from quadcurv.types import Bools, Floats, Indices

NODES, LEAST = 6, 4  # points of a line; how many there must be
# A line is smooth where, in squares, the last point changes less than this part of what the last but one
# does, or this part of what the one before does (the last but one does nothing where a line is odd); along
# the normal, where noise of the surface shows, but for this part of all that the last but one does.
SMOOTH, EARLIER, HIDDEN = 0.15, 0.002, 0.002
# How far apart the ghosts of two lines are, along what their ends are: less means that they cross.
OPEN = 0.2
ROUNDING = 2.0**-95  # of coordinates, squared, as extrapolation magnifies it
# Fourth-order schemes ask for more: the last point changes no more than this, squared, of what the changes of
# the two points before it, as a geometric series, lead to expect.
_EXPECTED = 9.0
# And noise may cause no more than this part of the curvature there.
_DOUBT = 0.03
# What a sixth point changes by index where X_0 alone is out of step, is a part of what the ghost is off.
_SHIFTED = 5.0
# Where the last point changes less than the last but one there is little noise: then what a fitted surface
# leaves at the points is but a third of what it misses beyond the border.
_CALM, _FAITHFUL = 0.6, 0.1


class Continued(NamedTuple):
    """Lines with ghosts.

    Attributes
    ----------
    ghosts : (k, layers, 3) float64
    error : (k,) float64
        Their estimated error, infinite where they do not lie outside.
    smooth, even : (k,) bool
        Whether the points are smooth functions of length or of their index, beyond doubt; whether they are
        continued by index.
    """

    ghosts: Floats
    error: Floats
    smooth: Bools
    even: Bools


def index_weights(degree: int, layer: int = 1) -> Floats:
    """Lagrange polynomials of the nodes 0, ..., degree at -layer."""
    return np.array(
        [(-1.0) ** k * comb(degree + layer, degree - k) * comb(layer + k - 1, k) for k in range(degree + 1)]
    )


def rounding_of(points: Floats) -> float:
    """Square of what the rounding of points (..., 3) makes a sixth one change.

    Of the farthest of them: a point near the origin may be a small difference of large numbers.
    """
    return ROUNDING * float(np.square(points).sum(axis=-1).max(initial=0.0))


@np.errstate(all="ignore")  # what overflows, or has no length, is NaN and has no ghosts
def extended(lines: Floats, turn: Floats, degree: int, layers: int, beside: Indices) -> Continued:
    """Continue lines by ghosts.

    Parameters
    ----------
    lines : (k, 6, 3) float64
        Points from the border inward; NaN for the last ones that are missing, of a line of four or five.
    turn : (k,) float64
        Sine of the angle by which the surface turns from X_0 to the next points.
    degree, layers : int
        Of the polynomial, as high as there are points for; how many ghosts beyond it.
    beside : (m, 2) int64
        Lines that end beside each other, all in the same sense.
    """
    number = np.isfinite(lines).all(axis=2).sum(axis=1)
    lines = _completed(lines)
    x = lines - lines[:, :1]  # an offset costs no digits
    size = np.linalg.norm(x[:, 1], axis=1)
    size = np.where(size > 0, size, 1.0)[:, None]
    x /= size[:, None]  # so that no power of lengths is too large or too small
    normal = np.cross(x[:, 1], _sideways(lines[:, 0], beside) / size)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rounding = rounding_of(lines[:, ::4]) / size[:, 0] ** 2
    ends = _Ends(x[:, 1], normal, turn, rounding, beside, number)
    terms = np.stack([np.einsum("j,kjx->kx", w, x[:, : w.size]) for w in _DIFFERENCES])
    every = np.ones(len(lines), bool)
    ghosts = continued(x[:, : degree + 1], layers, every)
    error, even = _error(terms, ghosts, ends, degree)
    smooth = by_index = even
    if not even.all():
        s, table = _newton(x)
        steps = _beyond(s, 0)[:, None] - s
        terms = np.stack([table[:, k] * np.prod(steps[:, :k], axis=1) for k in (1, 2, 3, 4, 5)])
        by_length = continued(x[:, : degree + 1], layers, ~every)
        for few in range(LEAST, degree + 1):  # points in place of missing ones are on polynomials by index
            rows = number == few
            by_length[rows] = continued(x[rows, :few], layers, ~every[rows])
        other, smooth = _error(terms, by_length, ends, degree)
        by_index = even | (~smooth & (_SHIFTED * error <= other))
        ghosts = np.where(by_index[:, None, None], ghosts, by_length)
        error = np.where(by_index, error, other)
    ghosts, error, smooth = lines[:, :1] + ghosts * size[:, None], error * size[:, 0], even | smooth
    crossed = beside[_crossed(lines[:, 0], ghosts[:, 0], beside)].ravel()
    error[crossed], smooth[crossed] = np.inf, False
    return Continued(ghosts, error, smooth, by_index)


def _crossed(ends: Floats, ghosts: Floats, beside: Indices) -> Bools:
    """Pairs of lines that meet before their ghosts: towards a hole narrower than a cell, or a tip."""
    along, beyond = (x[beside[:, 1]] - x[beside[:, 0]] for x in (ends, ghosts))
    return ~(_dot(along, beyond) > OPEN * _dot(along, along))


def continued(lines: Floats, layers: int, even: Bools) -> Floats:
    """Ghosts (k, layers, ..., 3) on polynomials through lines (k, degree + 1, ..., 3): by index if even."""
    degree = lines.shape[1] - 1
    x = lines - lines[:, :1]
    weights = np.stack([index_weights(degree, m + 1) for m in range(layers)])
    ghosts = np.einsum("lj,kj...->kl...", weights, x)
    if not even.all():
        size = np.abs(x[~even]).max(axis=tuple(range(1, x.ndim)), keepdims=True)
        size = np.where(size > 0, size, 1.0)
        s, table = _newton(x[~even] / size)
        ghosts[~even] = size * np.stack([_value(s, table, _beyond(s, m)) for m in range(layers)], axis=1)
    return lines[:, :1] + ghosts


def _completed(lines: Floats) -> Floats:
    """Lines with points in place of missing ones, on the polynomials through those that are there."""
    whole = lines.copy()
    for k in range(LEAST, NODES):
        missing = np.isnan(whole[:, k]).any(axis=1)
        x = whole[missing, :k][:, ::-1]
        whole[missing, k] = x[:, 0] + np.einsum("j,kjx->kx", index_weights(k - 1), x - x[:, :1])
    return whole


_DIFFERENCES = [np.array([(-1.0) ** j * comb(order, j) for j in range(order + 1)]) for order in range(1, 6)]


def doubtful_corners(blocks: Floats, layers: int, turn: Floats) -> tuple[Floats, Bools]:
    """What noise makes ghosts of ghosts, at corners, be off by (k,), and whether that is too much.

    `blocks` (k, 2, m, m, 3) are the m points of the first m lines of either side. Of a smooth surface their
    last difference along the lines and from line to line is as good as nothing.
    """
    order = blocks.shape[2] - 1
    last = _DIFFERENCES[order - 1]
    off = np.einsum("i,j,ksijx->ksx", last, last, blocks - blocks[:, :, :1, :1])
    # Short lines tell nothing.
    noise = np.nan_to_num(np.linalg.norm(off, axis=2)).max(axis=1) / (last @ last)
    error = noise * np.square(index_weights(order, layers)).sum() / 2
    edge = np.linalg.norm(blocks[:, 0, 0, 1] - blocks[:, 0, 0, 0], axis=1)
    return error, ~(error < _DOUBT * turn * edge)


class _Ends(NamedTuple):
    """Where lines end: the first step inward and the normal, and what else a ghost's error rests on.

    `number` is that of the points of each line.
    """

    inward: Floats
    normal: Floats
    turn: Floats
    rounding: Floats
    beside: Indices
    number: Indices


def _error(terms: Floats, ghosts: Floats, ends: _Ends, degree: int) -> tuple[Floats, Bools]:
    """Estimated error of ghosts, relative to X_0, and whether they are smooth beyond doubt.

    `terms` (5, k, 3) are what the second to the sixth point of lines change.
    """
    inward, normal, turn, rounding, beside, number = ends
    last, before, first = (terms[number - 1 - k, np.arange(number.size)] for k in (1, 2, 3))
    earlier = np.where((number < NODES)[:, None], 0.0, first)
    along, all_ = _dot(last, normal) ** 2, _dot(last, last)
    expected = np.maximum(SMOOTH * _dot(before, before), EARLIER * _dot(earlier, earlier))
    most = np.maximum(SMOOTH * _dot(before, normal) ** 2, EARLIER * _dot(earlier, normal) ** 2)
    most += HIDDEN * _dot(before, before)
    if degree > 4:
        most = np.fmin(most, _EXPECTED * _dot(before, before) ** 2 / _dot(first, first))  # 0 of exact lines
    excess = np.maximum(all_ - expected, along - most) - rounding
    steps = np.diff(ghosts, axis=1, prepend=0.0)
    outward, edge = -np.einsum("klx,kx->kl", steps, inward), _dot(inward, inward)
    outside = (outward[:, 0] > 0.2 * edge) & (outward > 0).all(axis=1)
    outside &= _dot(ghosts[:, 0], ghosts[:, 0]) < 4 * edge
    smooth = without_excess(np.where(outside, excess, np.inf), beside)
    smooth &= number > (LEAST if degree < 5 else LEAST + 1)
    # Along the surface an error does harm by as much as the surface turns from point to point.
    square = mean_around(along + turn**2 * all_, beside)
    lately, sooner = (mean_around(y, beside) for y in (along, _dot(before, normal) ** 2))
    calm = (number > LEAST) & (lately < _CALM * sooner)
    square = np.where(calm & (degree < 5), _FAITHFUL, 1.0) * square
    if degree > 4:
        doubt = (
            _noise2(_dot(last, normal), number, beside)
            * np.square(index_weights(degree, ghosts.shape[1])).sum()
        )
        smooth &= doubt < _DOUBT**2 * turn**2 * edge
        square = np.maximum(square, doubt)
    error = np.sqrt(square)
    return np.where(outside & ~np.isnan(error), error, np.inf), smooth


def _noise2(last: Floats, number: Indices, beside: Indices) -> Floats:
    """Square of the noise of lines, by how far their last differences are from those of the lines beside."""
    gain = np.array([comb(2 * m - 2, m - 1) for m in range(1, NODES + 1)])[number - 1]
    return mean_beside(last / np.sqrt(gain), beside)


def mean_beside(last: Floats, beside: Indices) -> Floats:
    """Mean square of what is independent from line to line, by how far each is from those beside it."""
    others = _sum_beside(np.ones_like(last), beside) - 1
    off = last - (_sum_beside(last, beside) - last) / np.maximum(others, 1)
    return mean_around(np.where(others > 0, off**2 / (1 + 1 / np.maximum(others, 1)), 0.0), beside)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("kx,kx->k", a, b)


def _sideways(ends: Floats, beside: Indices) -> Floats:
    """From the end of the line before each to that of the one after it, or its own."""
    along = np.zeros_like(ends)
    step = ends[beside[:, 1]] - ends[beside[:, 0]]
    for k in (0, 1):
        np.add.at(along, beside[:, k], step)
    return along


def without_excess(excess: Floats, beside: Indices) -> Bools:
    """Where the last point changes no more than it may, of a line and those around it together."""
    return mean_around(excess, beside) <= 0


def mean_around(values: Floats, beside: Indices) -> Floats:
    """Mean of the values of a line and, with less weight, of two lines on either side."""
    weights = np.ones_like(values)
    for _ in range(2):
        values, weights = (_sum_beside(x, beside) for x in (values, weights))
    return values / weights


def _sum_beside(values: Floats, beside: Indices) -> Floats:
    total = values.copy()
    np.add.at(total, beside[:, 0], values[beside[:, 1]])
    np.add.at(total, beside[:, 1], values[beside[:, 0]])
    return total


def _newton(x: Floats) -> tuple[Floats, Floats]:
    """Cumulative chord lengths (k, j, ..., 1) and divided differences (k, j, ..., 3) of lines."""
    chord = np.linalg.norm(np.diff(x, axis=1), axis=-1, keepdims=True)
    s = np.concatenate((np.zeros_like(chord[:, :1]), np.cumsum(chord, axis=1)), axis=1)
    table = x.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        for m in range(1, x.shape[1]):
            table[:, m:] = (table[:, m:] - table[:, m - 1 : -1]) / (s[:, m:] - s[:, :-m])
    return s, table


def _beyond(s: Floats, layer: int) -> Floats:
    """Where ghosts are: at the mirror images of points, but no further than the second edge is long."""
    first, second = s[:, 1], s[:, 2] - s[:, 1]
    step = np.divide(second, first, out=np.ones_like(first), where=second < first)
    return -step * s[:, layer + 1]


def _value(s: Floats, table: Floats, at: Floats) -> Floats:
    """Polynomials with divided differences (k, j, ..., 3) at lengths (k, ..., 1)."""
    value = np.zeros_like(table[:, 0])
    for j in range(table.shape[1] - 1, -1, -1):
        value = table[:, j] + (at - s[:, j]) * value
    return value
