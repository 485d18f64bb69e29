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


@formula(contract=True)
def continue_lines(
    points, first, along, inward, count, wraps, smooth, earlier, hidden, rounding, ghosts, to, excess, line
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


@formula
def continue_corner(ghosts, first, along, to):
    """The ghost beyond a line of ghosts."""
    x = triple(ghosts, first, 1)
    line = [less(triple(ghosts, first + along * min(j, 4), 1), x) for j in range(6)]
    place(ghosts, to, 1, plus(x, [continued(numbers)[0] for numbers in zip(*line, strict=True)]))


@kernel
def _continue(points, sides, corners, smooth, earlier, hidden, rounding, ghosts, excess):
    for k in range(0, sides.size, 7):
        first, along, inward, count, wraps = sides[k], sides[k + 1], sides[k + 2], sides[k + 3], sides[k + 4]
        to, line = sides[k + 5], sides[k + 6]
        continue_lines(
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
            ghosts,
            to,
            excess,
            line,
        )
    for k in range(0, corners.size, 3):
        continue_corner(ghosts, corners[k], corners[k + 1], corners[k + 2])


def open_sides(shape, wrap):
    """Of each open side of a grid: axis and end, then, of numbers of its points, first, along and inward.

    The last two are the way from line to line, and along a line.
    """
    r, c = shape
    for axis, depth, along, inward in ((0, r, 3, 3 * c), (1, c, 3 * c, 3)):
        if not wrap[axis]:
            yield axis, 0, 0, along, inward
            yield axis, 1, inward * (depth - 1), along, -inward


def continue_sides(points, wrap, limits):
    """One ghost beyond each line of a grid that ends at an open side, and whether it is right.

    Parameters
    ----------
    points : (r, c, 3) float64
    wrap : (bool, bool)
        Directions that are closed.
    limits : (float, float, float, float)
        SMOOTH, EARLIER, HIDDEN and ROUNDING of quadcurv.boundary.lines.

    Returns
    -------
    beyond : (2, c, 3) float64
        The rows before the first one and after the last one; those of the grid where it is closed.
    beside : (2, r + 2, 3) float64
        The columns before the first one and after the last one, with ghosts of the rows; (2, 0, 3) where
        these are closed. NaN as of lines of fewer than six points, at corners five.
    excess : (2 c + 2 r,) float64
        Line by line in the same order: the square of what the sixth point changes, less the most that it
        may; infinite where the ghost does not lie outside, -infinite where there are no lines.
    """
    (r, c, _), lines = points.shape, (2 * points.shape[1], 2 * points.shape[0])
    excess = np.full(sum(lines), -inf)
    ghosts = np.full(6 * c + (0 if wrap[1] else 6 * (r + 2)), nan)
    beyond, beside = ghosts[: 6 * c].reshape(2, c, 3), ghosts[6 * c :].reshape(2, -1, 3)
    sides, corners = [], []
    for axis, end, first, along, inward in open_sides((r, c), wrap):
        count = lines[axis] // 2
        to, line = (3 * c * end, c * end) if axis == 0 else (6 * c + 3 * (r + 2) * end + 3, 2 * c + r * end)
        if points.shape[axis] < 6:
            excess[line : line + count] = inf
        else:
            sides += [first, along, inward, count, wrap[1 - axis], to, line]
        if axis == 1 and c > 4 and not wrap[0]:  # lines of ghosts before the first and after the last row
            corners += [first, inward, to - 3, 3 * c + first, inward, to + 3 * r]
    if wrap[0]:
        beyond[:] = points[-1], points[0]
    tables = np.array(sides, np.int64), np.array(corners, np.int64)
    _continue(flat(points), *tables, *limits, ghosts, excess)
    if wrap[0] and not wrap[1]:
        beside[:, 0], beside[:, -1] = beside[:, -2], beside[:, 1]
    return beyond, beside, excess


@formula
def crowded(points, first, along, inward, count, wraps, tolerance):
    """Whether a point of a side is, but for `tolerance`, that of the next one: 1 or 0."""
    found = Carried((MOST, 0))
    for k in span(0, count):
        at = first + along * k
        x, y = triple(points, at, 1), triple(points, at + inward, 1)
        step = less(
            triple(points, where(k < count - 1, at + along, where(wraps > 0, first, at - along)), 1), x
        )
        near, far = found.get()
        far = larger(larger(far, bits(dot(x, x))), bits(dot(y, y)))
        found.set((smaller(near, bits(dot(step, step))), far))
    near, far = (from_bits(x) for x in found.get())
    return where(near > tolerance * far, 0, 1)


@kernel
def _crowded(points, sides, tolerance):
    number = 0
    for k in range(0, sides.size, 5):
        first, along, inward, count, wraps = sides[k], sides[k + 1], sides[k + 2], sides[k + 3], sides[k + 4]
        number += crowded(points, first, along, inward, count, wraps, tolerance)
    return number


def all_apart(points, wrap, tolerance):
    """Whether no point (r, c, 3) of an open side of a grid is that of the next one.

    `tolerance` is the least square of their distance, in squares of the coordinates there.
    """
    sides = [
        (first, along, inward, points.shape[1 - axis], wrap[1 - axis])
        for axis, _, first, along, inward in open_sides(points.shape[:2], wrap)
    ]
    return not sides or _crowded(flat(points), np.array(sides, np.int64).reshape(-1), tolerance) == 0
