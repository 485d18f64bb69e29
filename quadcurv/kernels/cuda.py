"""The formulas of `vector` and `quad` as CUDA C, and the source of the passes on a device.

A formula stands once: here it runs on values that write down C instead of the compiler's code. Every
operation is a statement of its own, a product and a sum that are rounded at once an `fma`, and the source is
to be compiled without contraction (`OPTIONS`), so that results are those of the processor, bit by bit.
"""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from itertools import count

import numpy as np
from llvmlite import ir

from quadcurv.kernels import quad, vector
from quadcurv.kernels.formulas import Real, _desk

OPTIONS = ("--std=c++17", "--fmad=false")
WIDE, HIGH = 2, 32  # columns and rows of a grid that a thread does

_DOUBLE, _INT, _BOOL = ir.DoubleType(), ir.IntType(64), ir.IntType(1)
_TYPES = {"double": "double", "i64": "long long", "i1": "bool"}

# What loops of the device call: by name the formula, and what it takes, triples (t) or numbers (d).
_FORMULAS = {
    "less": (vector.less, "tt"),
    "plus": (vector.plus, "tt"),
    "times": (vector.times, "td"),
    "cross": (vector.cross, "tt"),
    "fused_cross": (vector.fused_cross, "tt"),
    "dot": (vector.dot, "tt"),
    "known_square": (vector.known_square, "ttttd"),
    "unit": (vector.unit, "td"),
    "fluxes": (quad.fluxes, "ttt"),
    "ring_scale": (quad.ring_scale, "d"),
    "ring_area": (quad.ring_area, "d"),
    "quads_scale": (quad.quads_scale, "d"),
    "quads_area": (quad.quads_area, "d"),
    "conductance": (quad.conductance, "tttd"),
}


@cache
def source() -> str:
    """CUDA C of the formulas and the passes; C++ for a processor where HOST is defined."""
    passes = files(__package__).joinpath("diamond.cu").read_text()
    formulas = "\n".join(_function(name, *formula) for name, formula in _FORMULAS.items())
    return f"#define WIDE {WIDE}\n#define HIGH {HIGH}\n" + passes.replace("// FORMULAS\n", formulas)


class _Named:
    """A value that C has a name for."""

    def __init__(self, kind, name):
        self.type, self.name = kind, name


def _operation(sign):
    def write(self, a, b, flags=()):
        assert not flags, "on a device nothing is contracted"
        return self.named(a.type, f"{_text(a)} {sign} {_text(b)}")

    return write


class _Writer:
    """Writes down C where a compiler's builder would its own code."""

    def __init__(self):
        self.module, self.statements, self._fresh = ir.Module(), [], count()

    fadd, fsub, fmul, fdiv = map(_operation, "+-*/")
    add, sub, mul = map(_operation, "+-*")
    and_, or_ = map(_operation, "&|")

    def named(self, kind, expression):
        value = _Named(kind, f"v{next(self._fresh)}")
        self.statements.append(f"  {_TYPES[str(kind)]} {value.name} = {expression};")
        return value

    def fneg(self, a):
        return self.named(a.type, f"-{_text(a)}")

    def fcmp_ordered(self, sign, a, b):
        return self.named(_BOOL, f"{_text(a)} {sign} {_text(b)}")

    def select(self, condition, a, b):
        return self.named(a.type, f"{_text(condition)} ? {_text(a)} : {_text(b)}")

    def lshr(self, a, b):
        return self.named(a.type, f"(long long)((unsigned long long){_text(a)} >> {_text(b)})")

    def bitcast(self, a, kind):
        return self.named(kind, f"{'bits' if kind == _INT else 'from_bits'}({_text(a)})")

    def call(self, function, arguments):
        name = {"llvm.fmuladd.f64": "fma", "llvm.sqrt.f64": "sqrt"}[function.name]
        return self.named(function.ftype.return_type, f"{name}({', '.join(map(_text, arguments))})")


def _text(value):
    """A value in C."""
    if isinstance(value, _Named):
        return value.name
    if value.type != _DOUBLE:
        return f"{int(value.constant)}ll"
    return "from_bits(0x7ff8000000000000ll)" if np.isnan(value.constant) else float(value.constant).hex()


class _Draft:
    """What `formulas` asks for the writer."""

    contract = False

    def __init__(self):
        self.builder = _Writer()

    def __enter__(self):
        _desk.drafts = (*_desk.drafts, self)
        return self

    def __exit__(self, *_):
        _desk.drafts = _desk.drafts[:-1]


def _function(name, formula, kinds):
    """A formula as a function of C: one result is returned, several are written to references."""
    letters = "abcdefgh"[: len(kinds)]
    with _Draft() as draft:
        arguments = [
            tuple(Real(_Named(_DOUBLE, f"{x}.{axis}")) for axis in "xyz")
            if kind == "t"
            else Real(_Named(_DOUBLE, x))
            for x, kind in zip(letters, kinds, strict=True)
        ]
        result = formula(*arguments)
    given = [f"{_kind(kind)} {x}" for x, kind in zip(letters, kinds, strict=True)]
    results = (result,) if _is_one(result) else result
    values = [_result(x) for x in results]
    if len(values) == 1:
        returned, last = _kind("d" if isinstance(result, Real) else "t"), [f"  return {values[0]};"]
    else:
        returned, last = "void", [f"  r{i} = {value};" for i, value in enumerate(values)]
        given += [f"{_kind('d' if isinstance(x, Real) else 't')} &r{i}" for i, x in enumerate(results)]
    body = "\n".join([*draft.builder.statements, *last])
    return f"DEVICE {returned} {name}({', '.join(given)}) {{\n{body}\n}}\n"


def _kind(letter):
    return "triple" if letter == "t" else "double"


def _is_one(result):
    """Whether a formula returns one number or one triple."""
    return isinstance(result, Real) or (len(result) == 3 and all(isinstance(x, Real) for x in result))


def _result(x):
    return _text(x.value) if isinstance(x, Real) else f"{{{', '.join(_text(y.value) for y in x)}}}"
