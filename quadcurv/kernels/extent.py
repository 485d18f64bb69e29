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
    for k in span(0, square.size):
        a, b = triple(points, 3 * first[k], 1), triple(points, 3 * second[k], 1)
        step = less(b, a)
        square[k] = dot(step, step)
        lower, higher = ([some(x, y) for x, y in zip(a, b, strict=True)] for some in (smaller, larger))
        low.set([smaller(x, y) for x, y in zip(low.get(), lower, strict=True)])
        high.set([larger(x, y) for x, y in zip(high.get(), higher, strict=True)])
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
