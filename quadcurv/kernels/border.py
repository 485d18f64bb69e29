"""What continues the lines of points that end at an open side of a grid."""

from math import inf

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, span, where
from quadcurv.kernels.vector import apart, cross, dot, less, place, plus, times, triple


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
    points, first, along, inward, count, wraps, smooth, earlier, hidden, rounding, ghosts, excess
):
    """A ghost and an excess for each line."""
    for k in span(0, count):
        at = first + along * k
        before = where(k > 0, at - along, where(wraps, first + along * (count - 1), at))
        after = where(k < count - 1, at + along, where(wraps, first, at))
        x = triple(points, at, 1)
        line = [less(triple(points, at + inward * j, 1), x) for j in range(6)]
        ghost, third, fourth, fifth = zip(*map(continued, zip(*line, strict=True)), strict=True)
        place(ghosts, 3 * k, 1, plus(x, ghost))
        a = line[1]
        edge = dot(a, a)
        normal = times(cross(a, apart(points, after, points, before, 1)), 1 / edge)
        behind, long_ago = smooth * dot(fourth, fourth), earlier * dot(third, third)
        p, q, r = dot(fifth, normal), dot(fourth, normal), dot(third, normal)
        q, r = smooth * (q * q), earlier * (r * r)
        up = (p * p - where(q > r, q, r)) / dot(normal, normal) - hidden * dot(fourth, fourth)
        over = dot(fifth, fifth) - where(behind > long_ago, behind, long_ago)
        over = where(up > over, up, over) - rounding
        outside = (dot(ghost, a) < -0.2 * edge) & (dot(ghost, ghost) < 4.0 * edge) & (over == over)
        excess[k] = where(outside, over, inf)


@kernel
def _continue_lines(
    points, first, along, inward, count, wraps, smooth, earlier, hidden, rounding, ghosts, excess
):
    continue_lines(
        points, first, along, inward, count, wraps, smooth, earlier, hidden, rounding, ghosts, excess
    )


def continue_side(points, first, along, inward, wraps, limits, ghosts, excess):
    """One ghost beyond each line that ends at a side, and whether it is right.

    Parameters
    ----------
    points : float64
    first, along, inward : int
        Point j of line k begins at number ``first + along * k + inward * j``; each has at least six.
    wraps : bool
        Whether the first line is beside the last one.
    limits : (float, float, float, float)
        SMOOTH, EARLIER and HIDDEN of quadcurv.boundary.lines, and what is rounding, in squares of lengths.
    ghosts : (count, 3) float64
        Written to.
    excess : (count,) float64
        Written to: the square of what the sixth point changes, less the most that it may; infinite where the
        ghost does not lie outside.
    """
    sizes = first, along, inward, excess.size, wraps
    _continue_lines(flat(points), *sizes, *limits, ghosts.reshape(-1), excess)
