"""What continues the lines of points that end at open sides of a grid, and tells whether these are points."""

from math import inf, nan

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import Carried, bits, formula, from_bits, span, where
from quadcurv.kernels.vector import apart, cross, dot, larger, less, place, plus, smaller, times, triple

MOST = 2**63 - 1  # of bits


def continued(line):
    """Beyond a line of six numbers less its first one: what five points continue, and what they change.

    That is X_-1 - X_0 with X_-1 = 5 X_0 - 10 X_1 + 10 X_2 - 5 X_3 + X_4, and the last differences of four,
    five and six points.
    """
    differences = [line]
    for _ in range(5):
        differences.append([b - a for a, b in zip(differences[-1], differences[-1][1:], strict=False)])
    first = [d[0] for d in differences]
    return (first[2] - first[1]) + (first[4] - first[3]), *first[3:]


@formula
def continue_lines(
    points,
    first,
    along,
    inward,
    count,
    wraps,
    smooth,
    earlier,
    hidden,
    rounding,
    open,
    ghosts,
    to,
    excess,
    line,
):
    """A ghost and an excess for each line of a side."""
    far = Carried((0,))
    for k in span(0, count):
        ends = [triple(points, first + along * k + inward * j, 1) for j in (0, 4)]
        far.set((larger(far.get()[0], larger(*[bits(dot(x, x)) for x in ends])),))
    rounding = rounding * from_bits(far.get()[0])
    for k in span(0, count):
        at = first + along * k
        before = where(k > 0, at - along, where(wraps > 0, first + along * (count - 1), at))
        after = where(k < count - 1, at + along, where(wraps > 0, first, at))
        x = triple(points, at, 1)
        points_of = [less(triple(points, at + inward * j, 1), x) for j in range(6)]
        ghost, third, fourth, fifth = zip(*map(continued, zip(*points_of, strict=True)), strict=True)
        place(ghosts, to + 3 * k, 1, plus(x, ghost))
        a = points_of[1]
        edge = dot(a, a)
        normal = times(cross(a, apart(points, after, points, before, 1)), 1 / edge)
        behind, long_ago = smooth * dot(fourth, fourth), earlier * dot(third, third)
        p, q, r = dot(fifth, normal), dot(fourth, normal), dot(third, normal)
        q, r = smooth * (q * q), earlier * (r * r)
        up = (p * p - where(q > r, q, r)) / dot(normal, normal) - hidden * dot(fourth, fourth)
        over = dot(fifth, fifth) - where(behind > long_ago, behind, long_ago)
        over = where(up > over, up, over) - rounding
        outside = (dot(ghost, a) < -0.2 * edge) & (dot(ghost, ghost) < 4.0 * edge) & (over == over)
        excess[line + k] = where(outside, over, inf)
        # Lines that cross the one before.
        last = where(k > 0, k - 1, k)
        ends, beyond = (
            apart(points, at, points, first + along * last, 1),
            apart(ghosts, to + 3 * k, ghosts, to + 3 * last, 1),
        )
        crossed = (k > 0) & (dot(ends, beyond) <= open * dot(ends, ends))
        for j in (last, k):
            excess[line + j] = where(crossed, inf, excess[line + j])


@formula
def continue_corner(ghosts, first, along, to):
    """The ghost beyond a line of ghosts."""
    x = triple(ghosts, first, 1)
    line = [less(triple(ghosts, first + along * min(j, 4), 1), x) for j in range(6)]
    place(ghosts, to, 1, plus(x, [continued(numbers)[0] for numbers in zip(*line, strict=True)]))


@formula
def side(r, c, axis, end):
    """Of a side of a grid, in numbers of its points: the first, the way to the next line and along a line.

    Then how many lines there are.
    """
    is_column = axis > 0
    along, inward = where(is_column, 3 * c, 3), where(is_column, 3, 3 * c)
    depth, count = where(is_column, c, r), where(is_column, r, c)
    return where(end > 0, inward * (depth - 1), 0), along, where(end > 0, -1 * inward, inward), count


@formula
def fill(values, begin, end, x):
    """Make some numbers x."""
    for k in span(begin, end):
        values[k] = x


@kernel
def _continue(points, r, c, closed, wraps, smooth, earlier, hidden, rounding, open, ghosts, excess):
    # Of axis 0 whether it is `closed`, of axis 1 whether it `wraps`.
    fill(ghosts, 0, ghosts.size, nan)
    for k in range(4):
        axis, end = k >> 1, k & 1
        other, depth, is_closed = (closed, c, wraps) if axis == 1 else (wraps, r, closed)
        first, along, inward, count = side(r, c, axis, end)
        to, line = (3 * c * end, c * end) if axis == 0 else (6 * c + 3 * (r + 2) * end + 3, 2 * c + r * end)
        fill(excess, line, line + count, -inf if is_closed else inf)
        if depth >= 6 and not is_closed:
            continue_lines(
                points, first, along, inward, count, other, smooth, earlier, hidden, rounding, open, ghosts,
                to, excess, line,
            )  # fmt: skip
    for k in range(4 if c > 4 and not wraps and not closed else 0):
        # Lines of ghosts before the first and after the last row.
        first, _, inward, _ = side(r, c, 1, k >> 1)
        row, to = k & 1, 6 * c + 3 * (r + 2) * (k >> 1)
        continue_corner(ghosts, 3 * c * row + first, inward, to + 3 * (r + 1) * row)


def continue_sides(points, wrap, limits):
    """One ghost beyond each line of a grid that ends at an open side, and whether it is right.

    Parameters
    ----------
    points : (r, c, 3) float64
    wrap : (bool, bool)
        Directions that are closed.
    limits : (float, float, float, float, float)
        SMOOTH, EARLIER, HIDDEN, ROUNDING and OPEN of quadcurv.boundary.lines.

    Returns
    -------
    beyond : (2, c, 3) float64
        The rows before the first one and after the last one; those of the grid where it is closed.
    beside : (2, r + 2, 3) float64
        The columns before the first one and after the last one, with ghosts of the rows; (2, 0, 3) where
        these are closed. NaN as of lines of fewer than six points, at corners five.
    excess : (2 c + 2 r,) float64
        Line by line in the same order: the square of what the sixth point changes, less the most that it
        may; infinite where the ghost does not lie outside, or its line crosses the next one, -infinite where
        there are no lines.
    """
    r, c, _ = points.shape
    excess, ghosts = np.empty(2 * (r + c)), np.empty(6 * c + (0 if wrap[1] else 6 * (r + 2)))
    beyond, beside = ghosts[: 6 * c].reshape(2, c, 3), ghosts[6 * c :].reshape(2, -1, 3)
    _continue(flat(points), r, c, int(wrap[0]), int(wrap[1]), *limits, ghosts, excess)
    if wrap[0]:
        beyond[:] = points[-1], points[0]
        if not wrap[1]:
            beside[:, 0], beside[:, -1] = beside[:, -2], beside[:, 1]
    return beyond, beside, excess


@formula
def crowded(points, first, along, inward, count, wraps, short, rounding):
    """Whether a point of a side is, but for rounding or a short way inward, that of the next one: 1 or 0."""
    found = Carried((MOST, 0, 0))
    for k in span(0, count):
        at = first + along * k
        x, y = triple(points, at, 1), triple(points, at + inward, 1)
        step = less(
            triple(points, where(k < count - 1, at + along, where(wraps > 0, first, at - along)), 1), x
        )
        near, far, number = found.get()
        far = larger(larger(far, bits(dot(x, x))), bits(dot(y, y)))
        edge, across = dot(step, step), less(y, x)
        number = number + where(edge > short * dot(across, across), 0, 1)
        found.set((smaller(near, bits(edge)), far, number))
    near, far, number = found.get()
    return where((from_bits(near) > rounding * from_bits(far)) & (number == 0), 0, 1)


@kernel
def _crowded(points, r, c, closed, wraps, short, rounding):
    number = 0
    for k in range(4):
        is_closed, other = (wraps, closed) if k > 1 else (closed, wraps)
        if not is_closed:
            first, along, inward, count = side(r, c, k >> 1, k & 1)
            number += crowded(points, first, along, inward, count, other, short, rounding)
    return number


def all_apart(points, wrap, short, rounding):
    """Whether no point (r, c, 3) of an open side of a grid is that of the next one.

    They are where they are as near as `short`, in distances to the next row, or as `rounding`, in
    coordinates there.
    """
    r, c, _ = points.shape
    return _crowded(flat(points), r, c, int(wrap[0]), int(wrap[1]), short**2, rounding**2) == 0
