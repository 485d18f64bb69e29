"""Formulas give in compiled loops what they give as plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from quadcurv.kernels import quad, vector
from quadcurv.kernels.formulas import Carried, bits, formula, muladd, real, root, span, where

numbers = st.floats(-1e3, 1e3).map(lambda x: 0.0 if abs(x) < 1e-3 else x)
triples = st.tuples(numbers, numbers, numbers)


def arithmetic(a, b):
    return (a + b, a - b, a * b, 1 + a, 1 - a, 2 * a, a / (1 + b * b), 1 / (1 + a * a), -a)


def comparisons(a, b):
    signs = (a < b, a <= b, a > b, a >= b, a == b, a != b)
    return tuple(where(sign, 1, 0) for sign in signs)


def wholes(i, j):
    return (
        i + j,
        i - j,
        i * j,
        3 - i,
        3 + i,
        3 * i,
        i >> 2,
        i & 3,
        where((i < j) | (j < 3), i, j),
        real(i) / 2,
    )


def geometry(u, v):
    n = vector.cross(u, v)
    return (
        n,
        vector.plus(u, v),
        vector.less(u, v),
        vector.times(u, 3.0),
        vector.quotient(u[0], v[0]),
        vector.reciprocal_root(1 + vector.dot(u, u)),
        root(1 + vector.dot(v, v)),
        quad.ring_area(1 + vector.dot(u, v) * vector.dot(u, v)),
    )


def flatten(x):
    return [z for y in x for z in flatten(y)] if isinstance(x, tuple) else [float(x)]


def in_a_loop(function):
    made = formula(function)
    return njit(lambda a, b: made(a, b))


COMPILED = {f: in_a_loop(f) for f in (arithmetic, comparisons, wholes, geometry)}


@settings(deadline=None)  # the first call compiles
@given(numbers, numbers)
def test_numbers(a, b):
    for f in (arithmetic, comparisons):
        np.testing.assert_array_equal(flatten(COMPILED[f](a, b)), flatten(f(a, b)))


def test_what_is_not_a_number_is_equal_to_nothing():
    assert COMPILED[comparisons](np.nan, np.nan) == (0, 0, 0, 0, 0, 1)


@settings(deadline=None)  # the first call compiles
@given(st.integers(-(10**6), 10**6), st.integers(-(10**6), 10**6))
def test_whole_numbers(i, j):
    assert COMPILED[wholes](i, j) == wholes(i, j)


@settings(deadline=None)  # the first call compiles
@given(triples, triples)
def test_geometry(u, v):
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = flatten(geometry(tuple(map(np.float64, u)), tuple(map(np.float64, v))))
    np.testing.assert_allclose(flatten(COMPILED[geometry](u, v)), plain, rtol=1e-12, atol=1e-9)


def running_sums(x, y, start, stop):
    before = Carried((0.0, 0))
    for k in span(start, stop, 2):
        total, count = before.get()
        y[k] = total = total + x[k]
        before.set((total, count + 1))
    return before.get()


@pytest.mark.parametrize(("start", "stop"), [(0, 100), (3, 4), (5, 5), (7, 2)])
def test_loops_and_what_they_carry(start, stop):
    made = formula(running_sums)
    loop = njit(lambda x, y, i, j: made(x, y, i, j))
    x = np.random.default_rng(0).random(100)
    one, other = np.zeros((2, 100))
    assert loop(x, one, start, stop) == running_sums(x, other, start, stop)
    np.testing.assert_array_equal(one, other)
    assert one.any() == (start < stop)


def chosen(first, a, b, out):
    x = where(first, a, b)
    for k in range(3):
        out[k] = x[k]


@pytest.mark.parametrize("dtype", [np.float64, np.int64, np.int32, np.uint8, bool])
def test_arrays_of_any_type_and_a_choice_of_them(dtype):
    made = formula(chosen)
    loop = njit(lambda first, a, b, out: made(first, a, b, out))
    a, b = np.array([1, 0, 1], dtype), np.array([0, 1, 0], dtype)
    if dtype not in (bool, np.uint8):
        b = -b
    for first in (True, False):
        out = np.empty(3, dtype)
        loop(first, a, b, out)
        np.testing.assert_array_equal(out, a if first else b)


def test_bits():
    made = formula(bits)
    assert njit(lambda x: made(x))(-2.5) == bits(-2.5) == np.float64(-2.5).view(np.int64)


@pytest.mark.parametrize("contract", [False, True])
def test_products_and_sums_are_fused_only_if_that_is_said(contract):
    made = formula(lambda a, b, c: a * b + c, contract=contract)
    loop = njit(lambda a, b, c: made(a, b, c))
    a, b = 1 + 2.0**-30, 1 - 2.0**-30  # a b = 1 - 2^-60, rounded 1
    assert loop(a, b, -1.0) in ((0.0, -(2.0**-60)) if contract else (0.0,))
    assert ("contract" in loop.inspect_llvm(loop.signatures[0])) == contract


def test_a_decision_by_value_is_refused():
    made = formula(lambda a: 1.0 if a > 0 else 2.0)
    with pytest.raises(TypeError, match="use where, not if"):
        njit(lambda a: made(a))(1.0)


def test_arrays_of_two_dimensions_are_refused():
    made = formula(lambda a: a[0])
    with pytest.raises(TypeError, match="C-contiguous arrays of one dimension"):
        njit(lambda a: made(a))(np.zeros((2, 2)))


def test_plain_numbers_are_rounded_twice():
    assert muladd(1 + 2.0**-30, 1 - 2.0**-30, -1.0) == 0.0
