"""How large the numbers of an array are, in the one pass that memory asks for."""

from math import inf

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import Carried, bits, formula, from_bits, span, where
from quadcurv.kernels.vector import dot, larger, less, smaller, triple

_MAGNITUDE = 2**63 - 1  # all bits but that of the sign


@formula
def largest_of(values, start, stop):
    """Largest magnitude, by its bits: those of NaN and of infinity are larger than all others."""
    most = Carried((0,))
    for k in span(start, stop, 4):
        magnitude, (before,) = bits(values[k]) & _MAGNITUDE, most.get()
        most.set((where(magnitude > before, magnitude, before),))
    return from_bits(most.get()[0])


@kernel
def _largest(values, start, stop):
    return largest_of(values, start, stop)


def largest(values):
    """Largest magnitude in a float64 array, 0 of none: NaN if there is one, else infinity if there is one."""
    values, found = flat(values), []
    ranges.over(
        lambda start, stop: found.append(_largest(values, start, stop)), values.size, values.size // 3
    )
    return found[0] if len(found) == 1 else float(np.max(found))


@formula
def measured(points, first, second, square):
    """Squares of the lengths of steps; the largest coordinate of their ends, the largest extent of these."""
    low, high = Carried((inf,) * 3), Carried((-inf,) * 3)
    for k in span(0, first.size):
        a, b = triple(points, 3 * first[k], 1), triple(points, 3 * second[k], 1)
        step = less(b, a)
        square[k] = dot(step, step)
        low.set(
            [smaller(x, smaller(*ends)) for x, ends in zip(low.get(), zip(a, b, strict=True), strict=True)]
        )
        high.set(
            [larger(x, larger(*ends)) for x, ends in zip(high.get(), zip(a, b, strict=True), strict=True)]
        )
    far, extent = 0.0, 0.0
    for x, y in zip(low.get(), high.get(), strict=True):
        far, extent = larger(far, larger(-x, y)), larger(extent, y - x)
    return far, extent


@kernel
def _steps(points, first, second, square):
    return measured(points, first, second, square)


def steps(points, first, second):
    """Squares (k,) of the lengths of steps from some points to others, whose numbers are int64.

    Then the largest coordinate of these, and the largest side of their bounding box; of none -infinity.
    """
    square = np.empty(first.size)
    return square, *_steps(flat(points), flat(first), flat(second), square)


@kernel
def _grid_steps(points, r, c, every, first, second, square):
    number = square.size // 2
    for k in range(number):
        i, j = every * k // c, every * k % c
        # Of a single row or column these steps end where they begin.
        above, left = max(0, min(i, r - 2)), max(0, min(j, c - 2))
        first[k], first[number + k] = c * above + j, c * i + left
        second[k], second[number + k] = c * min(above + 1, r - 1) + j, c * i + min(left + 1, c - 1)
    return measured(points, first, second, square)


def grid_steps(points, every):
    """As `steps`, from points (r, c, 3) of a grid to those in the next row and column, one of so many."""
    r, c, _ = points.shape
    number = 2 * -(-r * c // every)
    square, (first, second) = np.empty(number), np.empty((2, number), np.int64)
    return square, *_grid_steps(flat(points), r, c, every, first, second, square)


@kernel
def _face_steps(points, faces, every, first, second, square):
    for k in range(square.size // 2):
        corner = 4 * every * k
        first[2 * k], first[2 * k + 1] = faces[corner], faces[corner + 1]
        second[2 * k], second[2 * k + 1] = faces[corner + 1], faces[corner + 2]
    return measured(points, first, second, square)


def face_steps(points, faces, every):
    """As `steps`, along the first two edges of one of so many faces (m, 4)."""
    number = 2 * -(-len(faces) // every)
    square, (first, second) = np.empty(number), np.empty((2, number), np.int64)
    return square, *_face_steps(flat(points), flat(faces), every, first, second, square)
