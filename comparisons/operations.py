"""Floating-point operations of the compiled finite-volume scheme, counted while its own code runs."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType, ModuleType
from typing import Any

from quadcurv.kernels import quad, vector

THESIS = 197
"""A vertex, as the thesis counts its own implementation (above Figure 3.12)."""


def interpreted(*modules: ModuleType, **instead: Any) -> dict[str, Any]:
    """What is in modules of kernels, these as plain Python that calls plain Python; some names replaced."""
    names = {name: value for module in modules for name, value in vars(module).items()}
    plain = {name: getattr(value, "py_func", value) for name, value in names.items()}
    for name, f in plain.items():
        if isinstance(f, FunctionType) and f.__module__ in {module.__name__ for module in modules}:
            names[name] = FunctionType(f.__code__, names, name, f.__defaults__)
    names.update(instead)
    return names


def operations(newton: bool = False) -> dict[str, int]:
    """Floating-point operations a vertex of H n on a grid, counted while the kernels' own code runs.

    Parameters
    ----------
    newton : bool
        Count what a reciprocal root is made of; else it is a root and a quotient, as in the thesis.

    Returns
    -------
    dict
        "differences": 2 x 3 for the diagonals of the quad, and as many for those of the ring. "normal": of
        unit length. "fluxes": of one quad, whose four fluxes are two and their opposites. "sums": 3 x 3 of
        fluxes into vertices. "area", "scaling": of one vertex. "all": the total. Not counted is what tells
        an area from rounding, of the quad and of the ring: the thesis has nothing of the kind.
    """
    count = 0

    class Counted(float):
        pass

    def counting(name: str) -> Callable[[float, float], Counted]:
        def operator(a: float, b: float) -> Counted:
            nonlocal count
            count += 1
            return Counted(getattr(float, name)(float(a), float(b)))

        return operator

    for name in ("add", "sub", "mul", "truediv"):
        for kind in ("__{}__", "__r{}__"):
            setattr(Counted, kind.format(name), counting(kind.format(name)))

    names = interpreted(
        vector,
        quad,
        less_half=lambda _, x: Counted(float(x) ** -0.5),  # no floating-point operation
        **({} if newton else {"reciprocal_root": lambda x: 1 / (x * 1)}),  # counts as two
    )

    def run(name: str, *given: Any) -> int:
        nonlocal count
        count = 0
        names[name](*given)
        return count

    u, v = (tuple(map(Counted, x)) for x in ((1.0, 0.2, 0.3), (-0.1, 1.1, 0.4)))
    parts = {
        "differences": 12,
        "normal": run("cross", u, v) + run("dot", u, u) + run("reciprocal_root", u[0]) + 3,
        "fluxes": run("fluxes", u, v, u),
        "sums": 9,
        "area": run("cross", u, v) + run("dot", u, u) + run("ring_scale", u[0]),
        "scaling": run("times", u, u[0]),
    }
    return {**parts, "all": sum(parts.values())}
