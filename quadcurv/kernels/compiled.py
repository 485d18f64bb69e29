"""How kernels are compiled: strict arithmetic, no lock held, and kept on disk where anything can be written.

A file of kernels holds its helpers too: numba notices an edit to the file of the function it keeps, no
other. Arithmetic is strict (no `fastmath`): NaN is seen, and results do not depend on how loops are cut.
"""

from llvmlite import ir
from numba import njit, types
from numba.core import cgutils
from numba.extending import intrinsic

helper = njit(nogil=True, error_model="numpy")
inlined = njit(nogil=True, error_model="numpy", forceinline=True)


def kernel(function):
    """Compile an entry point, kept on disk unless there is no folder for it."""
    try:
        return njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # numba finds no folder that it can write to
        return helper(function)


@intrinsic
def prefetch(typing, array, index):
    """Ask for the cache line of array.ravel()[index] of a C-contiguous array; the index must be inside it."""

    def generate(context, builder, signature, arguments):
        values, place = arguments
        data = context.make_array(signature.args[0])(context, builder, values).data
        line = builder.bitcast(builder.gep(data, [place]), cgutils.voidptr_t)
        number = ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), (line.type, number, number, number))
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(function, (line, number(0), number(3), number(1)))  # to read, keep near, data
        return context.get_dummy_value()

    return types.void(array, types.intp), generate
