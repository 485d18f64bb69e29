"""Exact derivatives of a mapping written with numpy functions, and the curvature they give.

A `Jet` carries a function of (u, v) with its first and second derivatives through a formula (automatic
differentiation in forward mode); what the formula uses is differentiated by rules of one line each.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin
from numpy.typing import ArrayLike

from quadcurv.types import Floats

_LN2, _LN10, _DEGREE = np.log(2.0), np.log(10.0), np.pi / 180


def curvatures_of(mapping: Callable[[Any, Any], Any], u: ArrayLike, v: ArrayLike) -> tuple[Floats, Floats]:
    """Mean and Gaussian curvature of ``mapping(u, v) -> (x, y, z)`` by its fundamental forms.

    Parameters
    ----------
    mapping : callable
        Made of numpy functions that `Jet` knows.
    u, v : array_like
        Parameters; they broadcast.

    Returns
    -------
    H, K : ndarray, shape (...)
        Signed by the normal X_u x X_v, H positive for a sphere oriented outward; in 1/length and
        1/length**2. NaN where X_u x X_v vanishes.

    Raises
    ------
    TypeError
        For a function without a rule.
    """
    u, v = np.broadcast_arrays(np.asarray(u, np.float64), np.asarray(v, np.float64))
    one, zero = np.ones(u.shape), np.zeros(u.shape)
    found = mapping(Jet(u, (one, zero), (zero, zero, zero)), Jet(v, (zero, one), (zero, zero, zero)))
    jets = [jet if isinstance(jet, Jet) else constant(jet) for jet in found]
    Xu, Xv, Xuu, Xuv, Xvv = (
        np.stack([np.broadcast_to(part, u.shape) for part in parts], axis=-1)
        for parts in zip(*((*jet.first, *jet.second) for jet in jets), strict=True)
    )
    E, F, G = (np.sum(a * b, axis=-1) for a, b in ((Xu, Xu), (Xu, Xv), (Xv, Xv)))
    area = np.cross(Xu, Xv)
    W2 = np.sum(area**2, axis=-1)
    L, M, N = (np.sum(second * area, axis=-1) for second in (Xuu, Xuv, Xvv))
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = -(E * N - 2 * F * M + G * L) / (2 * W2 * np.sqrt(W2))
        gaussian = (L * N - M**2) / W2**2
        return np.where(W2 > 0, mean, np.nan), np.where(W2 > 0, gaussian, np.nan)


def constant(value: ArrayLike) -> Jet:
    """A number or an array that depends on neither parameter."""
    value = np.asarray(value, np.float64)
    zero = np.zeros(value.shape)
    return Jet(value, (zero, zero), (zero, zero, zero))


class Jet(NDArrayOperatorsMixin):
    """Values of a function of (u, v), its derivatives by u, v and by uu, uv, vv."""

    def __init__(self, value: Floats, first: tuple[Floats, ...], second: tuple[Floats, ...]) -> None:
        self.value, self.first, self.second = value, first, second

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the values."""
        return self.value.shape

    def __float__(self) -> float:
        raise TypeError("a mapping works on arrays: write np.sin where math.sin stands, and so on")

    def __bool__(self) -> bool:
        raise TypeError("a mapping works on arrays: write np.where(condition, a, b) where `if` stands")

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> Any:
        if method != "__call__" or kwargs:
            raise _unknown(
                f"{ufunc.__name__}.{method}" if method != "__call__" else f"{ufunc.__name__}(out=)"
            )
        if ufunc in _PIECEWISE_CONSTANT:
            return ufunc(*(x.value if isinstance(x, Jet) else x for x in inputs))
        if ufunc in _COMPOSED:
            return _COMPOSED[ufunc](*inputs)
        if ufunc not in _RULES:
            raise _unknown(ufunc.__name__)
        jets = [x if isinstance(x, Jet) else constant(x) for x in inputs]
        values = [jet.value for jet in jets]
        with np.errstate(divide="ignore", invalid="ignore"):
            return _chain(ufunc(*values), *_RULES[ufunc](*values), jets)

    def __array_function__(self, function: Any, types: Any, args: Any, kwargs: Any) -> Any:
        if function not in _FUNCTIONS:
            raise _unknown(function.__name__)
        return _FUNCTIONS[function](*args, **kwargs)


def _unknown(name: str) -> TypeError:
    known = sorted(f.__name__ for f in (*_RULES, *_COMPOSED, *_PIECEWISE_CONSTANT, *_FUNCTIONS))
    return TypeError(f"np.{name} has no derivative here; a mapping may use {', '.join(known)}")


def _chain(value: Floats, first: Any, second: Any, jets: list[Jet]) -> Jet:
    """Chain rule: partial derivatives of the outer function, jets of the inner ones."""
    order = range(len(jets))
    return Jet(
        value,
        tuple(sum(first[i] * jets[i].first[a] for i in order) for a in (0, 1)),
        tuple(
            sum(first[i] * jets[i].second[k] for i in order)
            + sum(second[i][j] * jets[i].first[a] * jets[j].first[b] for i in order for j in order)
            for k, (a, b) in enumerate(((0, 0), (0, 1), (1, 1)))
        ),
    )


def _one(rule: Callable[[Floats], tuple[Any, Any]]) -> Callable[[Floats], tuple[Any, Any]]:
    """Rule of a function of one variable from its two derivatives."""

    def partials(x: Floats) -> tuple[Any, Any]:
        first, second = rule(x)
        return (first,), ((second,),)

    return partials


def _power(x: Floats, p: Floats) -> tuple[Any, Any]:
    """Derivatives of x**p; a power that does not vary may have a base that is not positive."""
    log = np.log(np.where(x > 0, x, 1.0))
    by_x = np.where(p == 0, 0.0, p * x ** np.where(p == 0, 1.0, p - 1))
    by_xx = np.where(p * (p - 1) == 0, 0.0, p * (p - 1) * x ** np.where(p * (p - 1) == 0, 1.0, p - 2))
    mixed = np.where(x > 0, x ** (p - 1) * (1 + p * log), 0.0)
    return (by_x, x**p * log), ((by_xx, mixed), (mixed, x**p * log**2))


def _arctan2(y: Floats, x: Floats) -> tuple[Any, Any]:
    r2 = x**2 + y**2
    yy, yx = -2 * x * y / r2**2, (y**2 - x**2) / r2**2
    return (x / r2, -y / r2), ((yy, yx), (yx, -yy))


def _hypot(x: Floats, y: Floats) -> tuple[Any, Any]:
    r = np.hypot(x, y)
    return (x / r, y / r), ((y**2 / r**3, -x * y / r**3), (-x * y / r**3, x**2 / r**3))


# Partial derivatives of each function: the first ones, and the square of the second ones.
_RULES: dict[np.ufunc, Callable[..., tuple[Any, Any]]] = {
    np.add: lambda x, y: ((1, 1), ((0, 0), (0, 0))),
    np.subtract: lambda x, y: ((1, -1), ((0, 0), (0, 0))),
    np.multiply: lambda x, y: ((y, x), ((0, 1), (1, 0))),
    np.divide: lambda x, y: ((1 / y, -x / y**2), ((0, -1 / y**2), (-1 / y**2, 2 * x / y**3))),
    np.power: _power,
    np.float_power: _power,
    np.arctan2: _arctan2,
    np.hypot: _hypot,
    np.positive: _one(lambda x: (1, 0)),
    np.negative: _one(lambda x: (-1, 0)),
    np.deg2rad: _one(lambda x: (_DEGREE, 0)),
    np.radians: _one(lambda x: (_DEGREE, 0)),
    np.rad2deg: _one(lambda x: (1 / _DEGREE, 0)),
    np.degrees: _one(lambda x: (1 / _DEGREE, 0)),
    np.absolute: _one(lambda x: (np.sign(x), 0)),
    np.fabs: _one(lambda x: (np.sign(x), 0)),
    np.square: _one(lambda x: (2 * x, 2)),
    np.reciprocal: _one(lambda x: (-1 / x**2, 2 / x**3)),
    np.sqrt: _one(lambda x: (0.5 / np.sqrt(x), -0.25 / np.sqrt(x) ** 3)),
    np.cbrt: _one(lambda x: (1 / (3 * np.cbrt(x) ** 2), -2 / (9 * np.cbrt(x) ** 5))),
    np.exp: _one(lambda x: (np.exp(x), np.exp(x))),
    np.exp2: _one(lambda x: (_LN2 * np.exp2(x), _LN2**2 * np.exp2(x))),
    np.expm1: _one(lambda x: (np.exp(x), np.exp(x))),
    np.log: _one(lambda x: (1 / x, -1 / x**2)),
    np.log2: _one(lambda x: (1 / (_LN2 * x), -1 / (_LN2 * x**2))),
    np.log10: _one(lambda x: (1 / (_LN10 * x), -1 / (_LN10 * x**2))),
    np.log1p: _one(lambda x: (1 / (1 + x), -1 / (1 + x) ** 2)),
    np.sin: _one(lambda x: (np.cos(x), -np.sin(x))),
    np.cos: _one(lambda x: (-np.sin(x), -np.cos(x))),
    np.tan: _one(lambda x: (1 / np.cos(x) ** 2, 2 * np.tan(x) / np.cos(x) ** 2)),
    np.arcsin: _one(lambda x: ((1 - x**2) ** -0.5, x * (1 - x**2) ** -1.5)),
    np.arccos: _one(lambda x: (-((1 - x**2) ** -0.5), -x * (1 - x**2) ** -1.5)),
    np.arctan: _one(lambda x: (1 / (1 + x**2), -2 * x / (1 + x**2) ** 2)),
    np.sinh: _one(lambda x: (np.cosh(x), np.sinh(x))),
    np.cosh: _one(lambda x: (np.sinh(x), np.cosh(x))),
    np.tanh: _one(lambda x: (1 - np.tanh(x) ** 2, -2 * np.tanh(x) * (1 - np.tanh(x) ** 2))),
    np.arcsinh: _one(lambda x: ((1 + x**2) ** -0.5, -x * (1 + x**2) ** -1.5)),
    np.arccosh: _one(lambda x: ((x**2 - 1) ** -0.5, -x * (x**2 - 1) ** -1.5)),
    np.arctanh: _one(lambda x: (1 / (1 - x**2), 2 * x / (1 - x**2) ** 2)),
}


def _where(condition: Any, x: Any, y: Any) -> Jet:
    x, y = (jet if isinstance(jet, Jet) else constant(jet) for jet in (x, y))
    return Jet(
        np.where(condition, x.value, y.value),
        tuple(np.where(condition, a, b) for a, b in zip(x.first, y.first, strict=True)),
        tuple(np.where(condition, a, b) for a, b in zip(x.second, y.second, strict=True)),
    )


# Functions made of others.
_COMPOSED: dict[np.ufunc, Callable[..., Any]] = {
    np.maximum: lambda x, y: _where(np.greater_equal(x, y), x, y),
    np.minimum: lambda x, y: _where(np.less_equal(x, y), x, y),
    np.copysign: lambda x, y: np.where(np.signbit(x) == np.signbit(y), x, -x),
    np.remainder: lambda x, y: x - y * np.floor(x / y),
}
_PIECEWISE_CONSTANT = {
    *(np.sign, np.signbit, np.floor, np.ceil, np.trunc, np.rint, np.isfinite, np.isnan),
    *(np.less, np.less_equal, np.greater, np.greater_equal, np.equal, np.not_equal),
}


def _stack(arrays: Any, axis: int = 0) -> tuple[Any, ...]:
    """The components side by side: stacked along a last axis they are the positions."""
    if axis != -1:
        raise TypeError("np.stack in a mapping: components go along the last axis, axis=-1")
    return tuple(arrays)


_FUNCTIONS: dict[Any, Callable[..., Any]] = {
    np.where: _where,
    np.stack: _stack,
    np.broadcast_arrays: lambda *arrays: arrays,
    np.zeros_like: lambda x: np.zeros(x.shape),
    np.ones_like: lambda x: np.ones(x.shape),
}
