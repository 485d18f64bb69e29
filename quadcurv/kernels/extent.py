"""How large the numbers of an array are, in the one pass that memory asks for."""

from math import inf

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import Carried, bits, formula, span, where
from quadcurv.kernels.vector import dot, larger, less, smaller, triple

_MAGNITUDE = 2**63 - 1  # all bits but that of the sign


@formula
def largest_bits(values, start, stop):
    """Largest of the bits of magnitudes: those of NaN and of infinity are larger than all others."""
    most = Carried((0,))
    for k in span(start, stop, 4):
        magnitude, (before,) = bits(values[k]) & _MAGNITUDE, most.get()
        most.set((where(magnitude > before, magnitude, before),))
    return most.get()[0]


@kernel
def _largest(values, start, stop, found, at):
    found[at] = largest_bits(values, start, stop)


def largest(values):
    """Largest magnitude in a float64 array, 0 of none: NaN if there is one, else infinity if there is one."""
    values, found = flat(values), []

    def look(start: int, stop: int) -> None:
        part = np.empty(1, np.int64)
        _largest(values, start, stop, part, 0)
        found.append(part)

    ranges.over(look, values.size, values.size // 3)
    return float(np.max(found, initial=0).astype(np.int64).reshape(1).view(np.float64)[0])


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
