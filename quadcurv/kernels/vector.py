"""Triples of numbers, the planes they are kept in, and their lengths.

Planes hold the coordinates of points one after the other: all x, then all y, then all z. A plane of 1 is an
array of points as everybody has it.
"""

from math import nan

from quadcurv.kernels.formulas import less_half, muladd, where

MAGIC = 0x5FE6EB50C7B537A9  # M. Robertson, A Brief History of InvSqrt, 2012
LEAST = 2.2250738585072014e-308  # of the numbers whose exponent is not that of zero
ROUNDING = (32 * 2.0**-52) ** 2


def triple(x, i, plane):
    """Point i of planes."""
    return x[i], x[i + plane], x[i + 2 * plane]


def place(x, i, plane, a):
    """Make a triple point i of planes."""
    x[i], x[i + plane], x[i + 2 * plane] = a


def smaller(a, b):
    """The smaller one of two numbers."""
    return where(b < a, b, a)


def larger(a, b):
    """The larger one of two numbers."""
    return where(b > a, b, a)


def less(a, b):
    """A triple less another."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def plus(a, b):
    """Sum of two triples."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(a, scale):
    """A triple times a number."""
    return a[0] * scale, a[1] * scale, a[2] * scale


def apart(x, i, y, j, plane):
    """Point i of planes x less point j of planes y."""
    return less(triple(x, i, plane), triple(y, j, plane))


def cross(a, b):
    """Cross product of two triples, zero where they are equal: its products are rounded alike."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def fused_cross(a, b):
    """Cross product of two triples; equal ones may leave a rounding error."""
    return (
        muladd(a[1], b[2], -(a[2] * b[1])),
        muladd(a[2], b[0], -(a[0] * b[2])),
        muladd(a[0], b[1], -(a[1] * b[0])),
    )


def dot(a, b):
    """Inner product of two triples."""
    return muladd(a[0], b[0], muladd(a[1], b[1], a[2] * b[2]))


def rounding(edges, far):
    """Square of a cross product up to which it is zero but for the rounding of its factors and of points.

    `edges` is the sum of the squares of the factors, `far` that of the coordinates of a point beside them. Of
    positions that are rounded more coarsely than doubles it is larger by the square of how much: `coarse`.
    """
    return ROUNDING * edges * (edges + far)


def most_rounding(far, coarse):
    """`rounding` of whatever factors and points, `far` being the largest square of any point's coordinates.

    A difference of two points has at most four times it, the eight of a ring at most 32 times.
    """
    return coarse * rounding(32.1 * far, far)


def middle(a, b, c, d):
    """Middle of the quad of the diagonals (a, b) and (c, d): the same wherever the quad begins."""
    return times(plus(plus(a, b), plus(c, d)), 0.25)


def known_square(n, u, v, point, coarse):
    """Square of n = u x v of a quad about a point, zero where n is but for rounding."""
    square = dot(n, n)
    return where(square > coarse * rounding(dot(u, u) + dot(v, v), dot(point, point)), square, 0.0)


def known_ring_square(n, around, c, coarse):
    """Square of n, the sum of the cross products of neighbours around c, zero where n is but for rounding.

    Each neighbour is a factor of two of these products.
    """
    square, spokes = dot(n, n), [less(a, c) for a in around]
    one, two, three, four = [dot(spoke, spoke) for spoke in spokes]
    edges = 2.0 * ((one + two) + (three + four))
    return where(square > coarse * rounding(edges, dot(c, c)), square, 0.0)


def quotient(x, y):
    """Quotient by a positive y, else NaN."""
    return where(y > 0, x / y, nan)


def reciprocal_root(x):
    """1 / sqrt(x) to the last digit or two; if x is zero or as good as zero, some large number.

    The guess, minus half the exponent and straight lines for the fraction, is right to 3.4 %. Two steps
    y (1 - e)^(-1/2), e = 1 - x y^2, follow: by the quadratic that is nearest where the guess leaves e, to
    2.5e-5, and by the series, of which 2e-18 is left out.
    """
    y = less_half(MAGIC, x)
    e = muladd(-(x * y), y, 1.0)
    y *= muladd(e, muladd(e, 0.375131542, 0.501100402), 1.000000670)
    e = muladd(-(x * y), y, 1.0)
    return muladd(y * e, muladd(e, muladd(e, 0.3125, 0.375), 0.5), y)


def unless_zero(x, square):
    """The number x, but NaN where a square is zero or as good as zero."""
    return where(square >= LEAST, x, nan)


def unit(n, square):
    """A triple over its length, NaN if that is zero, and the length; the square of it is known."""
    scale = reciprocal_root(square)
    return times(n, unless_zero(scale, square)), square * scale
