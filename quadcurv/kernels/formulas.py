"""Formulas: plain functions of numbers, tuples and arrays that become part of compiled loops.

A formula runs once, while a kernel that calls it is compiled, on values that write down what is done to
them. So it costs the compiler no more than its result: there are no types to infer and no calls to inline,
and no index is looked at, whether it counts from the end. Given numbers and arrays a formula computes.

What a formula decides by `if` and repeats by `range` is decided and repeated as it is written down; `where`
and `span` leave it to the kernel. Arrays that a formula is given must not overlap if it writes to one.
"""

from __future__ import annotations

import inspect
import threading
from itertools import count

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

WIDTH = 8  # numbers that stand side by side in `Lanes`
_DOUBLE, _INT, _BOOL = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_LANES, _FLAGS = ir.VectorType(_DOUBLE, WIDTH), ir.VectorType(_BOOL, WIDTH)
_fresh = count()


class _Desk(threading.local):
    """The formulas that a thread writes down, the last one at the moment."""

    drafts: tuple[_Draft, ...] = ()


_desk = _Desk()


class _Draft:
    """Where a formula is written down."""

    def __init__(self, builder, arrays, contract):
        self.builder, self.arrays, self.contract = builder, arrays, contract
        self._scopes = []

    def __enter__(self):
        _desk.drafts = (*_desk.drafts, self)
        return self

    def __exit__(self, *_):
        _desk.drafts = _desk.drafts[:-1]

    def marked(self, instruction, owners):
        """A load or store that is of some of the arrays and of no other one.

        The compiler, told so, need not compare addresses where a loop begins, nor keep a slow copy of it.
        """
        others = set(range(self.arrays)) - owners
        if others:
            module = self.builder.module
            if not self._scopes:
                domain = module.add_metadata([ir.MetaDataString(module, f"formula {next(_fresh)}")])
                names = [ir.MetaDataString(module, f"array {next(_fresh)}") for _ in range(self.arrays)]
                self._scopes = [module.add_metadata([name, domain]) for name in names]
            for kind, chosen in (("alias.scope", owners), ("noalias", others)):
                scopes = [self._scopes[i] for i in sorted(chosen)]
                instruction.set_metadata(kind, module.add_metadata(scopes))
        return instruction


class _Value:
    """A value of the code that is written down."""

    def __init__(self, value):
        self.value = value

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self):
        raise TypeError("a formula is written down before its values are known: use where, not if")

    @classmethod
    def of(cls, x):
        """What x is in the code, a constant where it is a number; None if it is of another kind."""
        if isinstance(x, cls):
            return x.value
        return ir.Constant(cls.kind, cls.number(x)) if isinstance(x, cls.numbers) else None


def _operator(instruction, swapped=False):
    def operate(self, other):
        a, b = self.value, self.of(other)
        if b is None:
            return NotImplemented
        a, b = (b, a) if swapped else (a, b)
        draft = _desk.drafts[-1]
        flags = {"flags": ("contract",)} if draft.contract and self.kind in (_DOUBLE, _LANES) else {}
        return type(self)(getattr(draft.builder, instruction)(a, b, **flags))

    return operate


def _comparison(instruction, sign):
    def compare(self, other):
        value = getattr(_desk.drafts[-1].builder, instruction)(sign, self.value, self.of(other))
        return (Flags if self.kind is _LANES else Truth)(value)

    return compare


class Real(_Value):
    """A float64."""

    kind, number, numbers = _DOUBLE, float, (float, int)
    __add__, __sub__, __mul__, __truediv__ = map(_operator, ("fadd", "fsub", "fmul", "fdiv"))
    __radd__, __rsub__ = _operator("fadd", swapped=True), _operator("fsub", swapped=True)
    __rmul__, __rtruediv__ = _operator("fmul", swapped=True), _operator("fdiv", swapped=True)
    __lt__, __le__, __gt__, __ge__, __eq__ = (
        _comparison("fcmp_ordered", sign) for sign in ("<", "<=", ">", ">=", "==")
    )
    __ne__ = _comparison("fcmp_unordered", "!=")

    def __neg__(self):
        return Real(_desk.drafts[-1].builder.fneg(self.value))


class Whole(_Value):
    """An int64."""

    kind, number, numbers = _INT, int, (int, np.integer)
    __add__, __sub__, __mul__ = map(_operator, ("add", "sub", "mul"))
    __radd__, __rsub__ = _operator("add", swapped=True), _operator("sub", swapped=True)
    __rmul__, __rshift__, __and__ = _operator("mul", swapped=True), _operator("ashr"), _operator("and_")
    __mod__ = _operator("srem")  # of what is not negative
    __lt__, __le__, __gt__, __ge__, __eq__, __ne__ = (
        _comparison("icmp_signed", sign) for sign in ("<", "<=", ">", ">=", "==", "!=")
    )


class Truth(_Value):
    """A bool."""

    kind, number, numbers = _BOOL, int, (bool,)
    __and__, __or__ = _operator("and_"), _operator("or_")


class Lanes(Real):
    """WIDTH float64 side by side; a single one stands for as many that are equal."""

    kind = _LANES

    # Named again: only so does Python ask the right one of two operands first.
    __add__, __sub__, __mul__, __truediv__ = map(_operator, ("fadd", "fsub", "fmul", "fdiv"))
    __radd__, __rsub__ = _operator("fadd", swapped=True), _operator("fsub", swapped=True)
    __rmul__, __rtruediv__ = _operator("fmul", swapped=True), _operator("fdiv", swapped=True)

    def __neg__(self):
        return Lanes(_desk.drafts[-1].builder.fneg(self.value))

    @classmethod
    def of(cls, x):
        """The same for numbers, of which there are many then."""
        if isinstance(x, cls):
            return x.value
        if isinstance(x, Real):
            builder, undefined = _desk.drafts[-1].builder, ir.Constant(_LANES, ir.Undefined)
            first = builder.insert_element(undefined, x.value, ir.IntType(32)(0))
            return builder.shuffle_vector(
                first, undefined, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
            )
        return ir.Constant(_LANES, [float(x)] * WIDTH) if isinstance(x, cls.numbers) else None


class Flags(Truth):
    """WIDTH bools side by side."""

    kind = _FLAGS
    __and__, __or__ = _operator("and_"), _operator("or_")


class Memory:
    """A C-contiguous array of one dimension: one of the formula's, or a choice among several."""

    def __init__(self, data, size, dtype, owners):
        self.data, self.size, self.dtype, self.owners = data, size, dtype, owners

    def address(self, index):
        """Pointer to an entry, which need not exist."""
        return _desk.drafts[-1].builder.gep(self.data, [Whole.of(index)])

    def __getitem__(self, index):
        draft = _desk.drafts[-1]
        value = draft.marked(draft.builder.load(self.address(index)), self.owners)
        return _written(self.dtype, value)

    def __setitem__(self, index, x):
        draft, machine = _desk.drafts[-1], _machine(self.dtype)
        value = _kind(self.dtype).of(x)
        if value.type != machine:
            value = (draft.builder.zext if value.type == _BOOL else draft.builder.trunc)(value, machine)
        draft.marked(draft.builder.store(value, self.address(index)), self.owners)


def formula(function=None, *, contract=False):
    """Make a plain function callable in kernels; with `contract` it may round a product and a sum at once."""
    if function is None:
        return lambda function: formula(function, contract=contract)

    def definition(typing, *given):
        # What it returns is told by the formula itself, written down where nobody reads it.
        nowhere = ir.Function(ir.Module(), ir.FunctionType(ir.VoidType(), []), "nowhere")
        with _Draft(ir.IRBuilder(nowhere.append_basic_block()), 1, contract):
            result = _type(function(*map(_unknown, given)))

        def generate(context, builder, signature, arguments):
            with _Draft(builder, sum(isinstance(t, types.Array) for t in given), contract):
                owners = (frozenset((i,)) for i in count())
                values = [
                    _memory(context.make_array(t)(context, builder, x), t.dtype, next(owners))
                    if isinstance(t, types.Array)
                    else _written(t, x)
                    for t, x in zip(given, arguments, strict=True)
                ]
                return _packed(context, builder, signature.return_type, function(*values))

        return result(*given), generate

    parameters = inspect.signature(function).parameters.values()
    typing = inspect.Parameter("typing", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    definition.__signature__ = inspect.Signature([typing, *parameters])
    definition.__name__, definition.__doc__ = function.__name__, function.__doc__
    made = intrinsic(definition)
    made.py_func = function
    return made


@intrinsic
def part_of(typing, array, begin, size):
    """So many numbers of an array from one on, as an array: a slice whose ends nobody looks at."""

    def generate(context, builder, signature, arguments):
        given, begin, size = arguments
        whole, part = context.make_array(array)(context, builder, given), context.make_array(array)
        made, width = part(context, builder), whole.itemsize
        populate_array(made, builder.gep(whole.data, [begin]), [size], [width], width, None)
        return made._getvalue()

    return array(array, types.int64, types.int64), generate


def _kind(t):
    """The class of values of a type of numba's."""
    return Truth if isinstance(t, types.Boolean) else Real if isinstance(t, types.Float) else Whole


def _machine(t):
    """How it lies in memory."""
    return (
        ir.IntType(8)
        if isinstance(t, types.Boolean)
        else _DOUBLE
        if t == types.float64
        else ir.IntType(t.bitwidth)
    )


def _written(t, value):
    """A value of a type of numba's as formulas see it."""
    builder = _desk.drafts[-1].builder
    if isinstance(t, types.BaseTuple):
        return tuple(map(_written, t, cgutils.unpack_tuple(builder, value)))
    kind = _kind(t)
    if value.type != kind.kind:
        value = (builder.trunc if kind is Truth else builder.sext if t.signed else builder.zext)(
            value, kind.kind
        )
    return kind(value)


def _memory(array, dtype, owners):
    """An array of numba's as formulas see it."""
    return Memory(array.data, Whole(array.nitems), dtype, owners)


def _unknown(t):
    """The same where there is no value yet."""
    if isinstance(t, types.BaseTuple):
        return tuple(map(_unknown, t))
    if isinstance(t, types.Array):
        if t.ndim != 1 or t.layout != "C":
            raise TypeError(f"formula: expected C-contiguous arrays of one dimension, got {t}")
        data, size = (ir.Constant(kind, ir.Undefined) for kind in (_machine(t.dtype).as_pointer(), _INT))
        return Memory(data, Whole(size), t.dtype, frozenset())
    return _kind(t)(ir.Constant(_kind(t).kind, ir.Undefined))


def _type(result):
    """Numba's type of what a formula returns."""
    if isinstance(result, tuple):
        return types.Tuple([_type(x) for x in result])
    return {type(None): types.void, Real: types.float64, Whole: types.int64, Truth: types.boolean}[
        type(result)
    ]


def _packed(context, builder, t, result):
    """What a formula returns as numba wants it."""
    if isinstance(result, tuple):
        return context.make_tuple(
            builder, t, [_packed(context, builder, u, x) for u, x in zip(t, result, strict=True)]
        )
    return context.get_dummy_value() if result is None else result.value


def where(condition, a, b):
    """A where a condition holds, else b: numbers, or arrays."""
    if not isinstance(condition, Truth):
        return np.where(condition, a, b) if isinstance(condition, np.ndarray) else a if condition else b
    builder = _desk.drafts[-1].builder
    if isinstance(a, Memory):
        data, size = builder.select(condition.value, a.data, b.data), where(condition, a.size, b.size)
        return Memory(data, size, a.dtype, a.owners | b.owners)
    kind = next((k for k in (Lanes, Flags, Truth, Real) if isinstance(a, k) or isinstance(b, k)), Whole)
    if kind is Whole and (isinstance(a, float) or isinstance(b, float)):
        kind = Real
    if isinstance(condition, Flags) and kind is not Flags:
        kind = Lanes
    return kind(builder.select(condition.value, kind.of(a), kind.of(b)))


def span(start, stop, together=None):
    """A loop of the kernel, over start..stop, by the widest vectors there are.

    Compilers use half of them, since the first processors with 512 bits slowed down; but loads that take
    the coordinates of points apart use them all the same, and then the other half of the unit stands idle.
    With `together` so many vectors go through the loop side by side: none waits long for its own results.
    """
    if not _desk.drafts:
        yield from range(start, stop)
        return
    builder, module = _desk.drafts[-1].builder, _desk.drafts[-1].builder.module
    if isinstance(builder.function.attributes, set):  # which knows no attribute of a single processor
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
    start, stop, before = Whole.of(start), Whole.of(stop), builder.block
    body, after = builder.append_basic_block("span"), builder.append_basic_block("span.end")
    builder.cbranch(builder.icmp_signed("<", start, stop), body, after)
    builder.position_at_end(body)
    index = builder.phi(_INT)
    index.add_incoming(start, before)
    yield Whole(index)
    following = builder.add(index, _INT(1), flags=("nsw",))
    index.add_incoming(following, builder.block)
    again = builder.cbranch(builder.icmp_signed("<", following, stop), body, after)
    if together:
        name = ir.MetaDataString(module, "llvm.loop.interleave.count")
        hint = module.add_metadata([name, ir.IntType(32)(together)])
        loop = module.add_metadata([ir.MetaDataString(module, f"loop {next(_fresh)}"), hint])
        loop.operands = (loop, hint)  # a loop's description begins with itself
        again.set_metadata("llvm.loop", loop)
    builder.position_at_end(after)


class Carried:
    """A tuple of values that one turn of a `span` leaves for the next."""

    def __init__(self, values):
        self._values = values
        if _desk.drafts:
            self._kinds = [
                Lanes if isinstance(x, Lanes) else Real if Whole.of(x) is None else Whole for x in values
            ]
            self._places = [
                cgutils.alloca_once_value(_desk.drafts[-1].builder, kind.of(x))
                for kind, x in zip(self._kinds, values, strict=True)
            ]

    def get(self):
        """What the turn before left, or the loop begins with."""
        if not _desk.drafts:
            return self._values
        load = _desk.drafts[-1].builder.load
        return tuple(kind(load(place)) for kind, place in zip(self._kinds, self._places, strict=True))

    def set(self, values):
        """Leave other values."""
        if not _desk.drafts:
            self._values = values
            return
        for kind, place, x in zip(self._kinds, self._places, values, strict=True):
            _desk.drafts[-1].builder.store(kind.of(x), place)


def _called(name, returned, arguments):
    """A call of a function of the compiler's own."""
    builder = _desk.drafts[-1].builder
    kind = ir.FunctionType(returned, [x.type for x in arguments])
    return builder.call(cgutils.get_or_insert_function(builder.module, kind, name), arguments)


def _of_reals(name, *given):
    """A call of one that takes and returns reals, side by side if any of them are."""
    kind = Lanes if any(isinstance(x, Lanes) for x in given) else Real
    name = f"llvm.{name}.{'v8f64' if kind is Lanes else 'f64'}"
    return kind(_called(name, kind.kind, [kind.of(x) for x in given]))


def muladd(a, b, c):
    """Product of a and b, plus c, rounded once where the processor can.

    Left to the compiler (`contract`), it would depend on what else a loop does.
    """
    if not any(isinstance(x, Real) for x in (a, b, c)):
        return a * b + c
    return _of_reals("fmuladd", a, b, c)


def root(x):
    """Square root."""
    return _of_reals("sqrt", x) if isinstance(x, Real) else np.sqrt(x)


def lanes(values, index):
    """The WIDTH entries of an array of float64 from an index on."""
    if not isinstance(values, Memory):
        return values[index : index + WIDTH].copy()
    draft = _desk.drafts[-1]
    address = draft.builder.bitcast(values.address(index), _LANES.as_pointer())
    return Lanes(draft.marked(draft.builder.load(address, align=8), values.owners))


def put_lanes(values, index, x):
    """Write them."""
    if not isinstance(values, Memory):
        values[index : index + WIDTH] = x
        return
    draft = _desk.drafts[-1]
    address = draft.builder.bitcast(values.address(index), _LANES.as_pointer())
    draft.marked(draft.builder.store(Lanes.of(x), address, align=8), values.owners)


def side_by_side(numbers):
    """WIDTH numbers as lanes."""
    if not isinstance(numbers[0], Real):
        return np.array(numbers)
    builder, value = _desk.drafts[-1].builder, ir.Constant(_LANES, ir.Undefined)
    for k, x in enumerate(numbers):
        value = builder.insert_element(value, x.value, ir.IntType(32)(k))
    return Lanes(value)


def three_lanes(values, index):
    """WIDTH triples that follow each other, as lanes of their first, second and third numbers."""
    if not isinstance(values, Memory):
        return tuple(values[index : index + 3 * WIDTH].reshape(WIDTH, 3).T.copy())
    draft, found = _desk.drafts[-1], []
    one, two, three = (lanes(values, index + k * WIDTH).value for k in range(3))

    def shuffled(a, b, places):
        return draft.builder.shuffle_vector(a, b, ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), places))

    for k in range(3):
        places = range(k, 3 * WIDTH, 3)
        near, far = [at for at in places if at < 2 * WIDTH], [at for at in places if at >= 2 * WIDTH]
        both = shuffled(one, two, near + [0] * len(far))
        found.append(Lanes(shuffled(both, three, [*range(len(near)), *(at - WIDTH for at in far)])))
    return tuple(found)


def real(x):
    """A whole number as a float."""
    return Real(_desk.drafts[-1].builder.sitofp(x.value, _DOUBLE)) if isinstance(x, Whole) else float(x)


def bits(x):
    """The bits of a float, as a whole number."""
    return (
        Whole(_desk.drafts[-1].builder.bitcast(x.value, _INT))
        if isinstance(x, Real)
        else np.float64(x).view(int)
    )


def from_bits(x):
    """The float of these bits."""
    return (
        Real(_desk.drafts[-1].builder.bitcast(x.value, _DOUBLE))
        if isinstance(x, Whole)
        else np.int64(x).view(float)
    )


def less_half(bits, x):
    """The number whose bits are these less half of those of x."""
    if not isinstance(x, Real):
        return (np.uint64(bits) - (np.float64(x).view(np.uint64) >> np.uint64(1))).view(np.float64)
    builder = _desk.drafts[-1].builder
    half = builder.lshr(builder.bitcast(x.value, _INT), _INT(1))
    return Real(builder.bitcast(builder.sub(_INT(bits), half), _DOUBLE))


def make_zero(values, index, size):
    """Write so many zeros from an entry on."""
    draft = _desk.drafts[-1]
    first = draft.builder.bitcast(values.address(index), cgutils.voidptr_t)
    length = Whole.of(size * (values.dtype.bitwidth // 8))
    _called("llvm.memset.p0.i64", ir.VoidType(), [first, ir.IntType(8)(0), length, _BOOL(0)])


def prefetch(values, index, write=False):
    """Ask for the memory of an entry of an array, which need not exist."""
    if isinstance(values, Memory):
        word = ir.IntType(32)
        line = _desk.drafts[-1].builder.bitcast(values.address(index), cgutils.voidptr_t)
        _called(
            "llvm.prefetch.p0", ir.VoidType(), [line, word(int(write)), word(3), word(1)]
        )  # keep near, data
