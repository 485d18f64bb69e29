"""What continues the lines of points that end at an open side of a grid."""

from math import inf

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, span, where


def continued(line):
    """Beyond a line of six numbers less its first one: what five points continue, and what they change.

    That is X_-1 - X_0 with X_-1 = 5 X_0 - 10 X_1 + 10 X_2 - 5 X_3 + X_4, the last difference of five points,
    and that of six.
    """
    differences = [line]
    for _ in range(5):
        differences.append([b - a for a, b in zip(differences[-1], differences[-1][1:], strict=False)])
    first = [d[0] for d in differences]
    return (first[2] - first[1]) + (first[4] - first[3]), first[4], first[5]


@formula(contract=True)
def continue_lines(points, first, along, inward, count, smooth, rounding, ghosts, excess):
    """A ghost and an excess for each line."""
    for k in span(0, count):
        at = first + along * k
        over = outward = edge = step = 0.0
        for i in range(3):
            x = points[at + i]
            line = [points[at + inward * j + i] - x for j in range(6)]
            ghost, fourth, fifth = continued(line)
            last = x + line[4]
            over += fifth * fifth - smooth * (fourth * fourth) - rounding * (x * x + last * last)
            outward -= ghost * line[1]
            edge += line[1] * line[1]
            step += ghost * ghost
            ghosts[3 * k + i] = x + ghost
        outside = (outward > 0.2 * edge) & (step < 4.0 * edge)
        excess[k] = where(outside, over, inf)


@kernel
def _continue_lines(points, first, along, inward, count, smooth, rounding, ghosts, excess):
    continue_lines(points, first, along, inward, count, smooth, rounding, ghosts, excess)


def continue_side(points, first, along, inward, smooth, rounding, ghosts, excess):
    """One ghost beyond each line that ends at a side, and whether it is right.

    Parameters
    ----------
    points : float64
    first, along, inward : int
        Point j of line k begins at number ``first + along * k + inward * j``; each has at least six.
    smooth, rounding : float
        See quadcurv.boundary.lines.
    ghosts : (count, 3) float64
        Written to.
    excess : (count,) float64
        Written to: the square of what the sixth point changes, less the most that it may; infinite where the
        ghost does not lie outside.
    """
    count = excess.size
    _continue_lines(flat(points), first, along, inward, count, smooth, rounding, ghosts.reshape(-1), excess)
