"""How kernels are compiled: strict arithmetic, no lock held, and kept on disk where anything can be written.

A file of kernels holds its helpers too: numba notices an edit to the file of the function it keeps, no
other. Arithmetic is strict (no `fastmath`): NaN is seen, and results do not depend on how loops are cut.
"""

from numba import njit

helper = njit(nogil=True, error_model="numpy")
inlined = njit(nogil=True, error_model="numpy", forceinline=True)


def kernel(function):
    """Compile an entry point, kept on disk unless there is no folder for it."""
    try:
        return njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # numba finds no folder that it can write to
        return helper(function)
