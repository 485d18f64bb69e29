"""Triples of numbers, the planes they are kept in, and their lengths.

Planes hold the coordinates of points one after the other: all x, then all y, then all z.
"""

from math import nan, sqrt

import numpy as np

from quadcurv.kernels.compiled import inlined, muladd

MAGIC = np.uint64(0x5FE6EB50C7B537A9)  # M. Robertson, A Brief History of InvSqrt, 2012
LEAST = 2.2250738585072014e-308  # of the numbers whose exponent is not that of zero
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


@inlined
def triple(x, i, plane):
    """Point i of planes."""
    return x[i], x[i + plane], x[i + TWO * plane]


@inlined
def place(x, i, plane, a):
    """Make a triple point i of planes."""
    x[i], x[i + plane], x[i + TWO * plane] = a


@inlined
def apart(x, i, y, j, plane):
    """Point i of planes x less point j of planes y."""
    return x[i] - y[j], x[i + plane] - y[j + plane], x[i + TWO * plane] - y[j + TWO * plane]


@inlined
def times(a, scale):
    """A triple times a number."""
    return a[0] * scale, a[1] * scale, a[2] * scale


@inlined
def difference(points, i, j):
    """points[i] - points[j] as a triple."""
    return (
        points[i, 0] - points[j, 0],
        points[i, 1] - points[j, 1],
        points[i, 2] - points[j, 2],
    )


@inlined
def cross(a, b):
    """Cross product of two triples, zero where they are equal: its products are rounded alike."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def fused_cross(a, b):
    """Cross product of two triples; equal ones may leave a rounding error."""
    return (
        muladd(a[1], b[2], -(a[2] * b[1])),
        muladd(a[2], b[0], -(a[0] * b[2])),
        muladd(a[0], b[1], -(a[1] * b[0])),
    )


@inlined
def dot(a, b):
    """Inner product of two triples."""
    return muladd(a[0], b[0], muladd(a[1], b[1], a[2] * b[2]))


@inlined
def norm(a):
    """Length of a triple."""
    return sqrt(dot(a, a))


@inlined
def quotient(x, y):
    """Quotient by a positive y, else NaN."""
    return x / y if y > 0 else nan


@inlined
def guess(x):
    """1 / sqrt(x) to 3.4 %: minus half the exponent, and straight lines for the fraction."""
    half = np.float64(x).view(np.uint64) >> ONE
    return np.uint64(MAGIC - half).view(np.float64)


@inlined
def reciprocal_root(x):
    """1 / sqrt(x) to the last digit or two; if x is zero or as good as zero, some large number.

    Two steps y (1 - e)^(-1/2), e = 1 - x y^2: by the quadratic that is nearest where the guess leaves e, to
    2.5e-5, and by the series, of which 2e-18 is left out.
    """
    y = guess(x)
    e = muladd(-(x * y), y, 1.0)
    y *= muladd(e, muladd(e, 0.375131542, 0.501100402), 1.000000670)
    e = muladd(-(x * y), y, 1.0)
    return muladd(y * e, muladd(e, muladd(e, 0.3125, 0.375), 0.5), y)


@inlined
def unless_zero(x, square):
    """The number x, but NaN where a square is zero or as good as zero."""
    return x if square >= LEAST else nan


@inlined
def unit(n):
    """A triple over its length, NaN if that is zero, and the length."""
    square = dot(n, n)
    scale = reciprocal_root(square)
    length, scale = square * scale, unless_zero(scale, square)
    return times(n, scale), length
