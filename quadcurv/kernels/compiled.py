"""How kernels are compiled: strict arithmetic, no lock held, and kept on disk where anything can be written.

A file of kernels holds its helpers too: numba notices an edit to the file of the function it keeps, no
other. Arithmetic is strict (no `fastmath`): NaN is seen, and results do not depend on how loops are cut.
Where a product and a sum may be rounded once instead of twice, `muladd` says so: left to the compiler,
that would depend on what else a loop does.
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
def muladd(typing, a, b, c):
    """Product of a and b, plus c, rounded once where the processor can."""

    def generate(context, builder, signature, arguments):
        kind = ir.FunctionType(ir.DoubleType(), [ir.DoubleType()] * 3)
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.fmuladd.f64")
        return builder.call(function, arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def wide(typing):
    """Have the loops of the function that this stands in use the widest vectors there are.

    Compilers use half of them, since the first processors with 512 bits slowed down; but loads that take
    the coordinates of points apart use them all the same, and then the other half of the unit stands idle.
    """

    def generate(context, builder, signature, arguments):
        attributes = builder.function.attributes
        if isinstance(attributes, set):  # which knows no attribute of a single processor
            set.add(attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.void(), generate


def asking(write):
    """Make an intrinsic that asks for memory."""

    @intrinsic
    def ask(typing, array, index):
        def generate(context, builder, signature, arguments):
            values, place = arguments
            data = context.make_array(signature.args[0])(context, builder, values).data
            line = builder.bitcast(builder.gep(data, [place]), cgutils.voidptr_t)
            number = ir.IntType(32)
            kind = ir.FunctionType(ir.VoidType(), (line.type, number, number, number))
            function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
            builder.call(function, (line, number(write), number(3), number(1)))  # keep near, data
            return context.get_dummy_value()

        return types.void(array, types.intp), generate

    return ask


# Ask for the cache line of array.ravel()[index] of a C-contiguous array; the index must be inside it.
prefetch, prefetch_to_write = asking(write=0), asking(write=1)
