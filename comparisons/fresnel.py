"""Fresnel integrals whose differences are good to the last place, and the curvature they give.

Figure 2.5 ends in rounding: this tells how much of it is the integrals', how much the positions'.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadcurv.curves import curvature

Array = NDArray[np.float64]

_FRACTION = 62  # bits behind the point of the fixed-point sums: the integrals stay below 1


def increments(t: Array) -> Array:
    """Integrals (m - 1, 2) of cos s^2 and sin s^2 between successive t, with a relative error of about eps.

    Ten Gauss points a step, for steps of |t| dt < 1. The phase is taken relative to the step's start a,
    s^2 = a^2 + (2a + x) x, and a^2 with the rounding error of its product (Dekker), since at t = 30 one
    unit of its last place is 1e-13.
    """
    nodes, weights = np.polynomial.legendre.leggauss(10)
    a, h = t[:-1, None], np.diff(t)[:, None]
    x = h / 2 * (nodes + 1)
    phase = (2 * a + x) * x
    high = 134217729.0 * a  # 2^27 + 1
    high -= high - a
    low = a - high
    square = a * a
    rest = ((high * high - square) + 2 * high * low) + low * low
    c, s = np.cos(square) - rest * np.sin(square), np.sin(square) + rest * np.cos(square)
    along = (c * np.cos(phase) - s * np.sin(phase)) @ weights
    across = (s * np.cos(phase) + c * np.sin(phase)) @ weights
    return np.stack((along, across), axis=1) * h / 2


def positions(steps: Array) -> Array:
    """Sums of the steps from the middle of an even number, rounded once, to doubles."""
    whole = np.rint(np.ldexp(steps, _FRACTION)).astype(np.int64)
    total = np.concatenate((np.zeros((1, 2), np.int64), np.cumsum(whole, axis=0)))
    return np.ldexp((total - total[len(steps) // 2]).astype(float), -_FRACTION)


def curvatures(t: Array) -> tuple[Array, Array]:
    """Curvature of the Euler spiral at parameters t symmetric to 0 (2.32), dual points halfway between.

    Returns
    -------
    rounded : ndarray, shape (n,)
        From correctly rounded positions.
    exact : ndarray, shape (n - 2,)
        At the points inside, from differences of positions that are not rounded.
    """
    fine = np.empty(2 * len(t) - 1)
    fine[::2], fine[1::2] = t, (t[1:] + t[:-1]) / 2
    steps = increments(fine)
    points = positions(steps)
    rounded = curvature(points[::2], dual=points[1::2])
    edge, cell = steps[::2] + steps[1::2], steps[1:-1:2] + steps[2::2]
    tangent = edge / np.hypot.reduce(edge, axis=1)[:, None]
    exact = np.hypot.reduce(np.diff(tangent, axis=0), axis=1) / np.hypot.reduce(cell, axis=1)
    return rounded, exact
