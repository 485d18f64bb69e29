"""How large the numbers of an array are, in the one pass that memory asks for."""

import numpy as np

from quadcurv.kernels import ranges
from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import Carried, bits, formula, span, where

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
