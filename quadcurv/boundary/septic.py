"""Ghosts on polynomials of degree seven, where lines of points are long and smooth enough for them.

Fits of degree six are at a border only as good as the ghosts that they read, and those of degree five are off
by what the sixth differences of lines are, as far as from one end of a neighbourhood to the other. Two points
more bring a border to the error of the inside; of noise they make four times as much.
"""

from __future__ import annotations

from math import comb

import numpy as np

from quadcurv.boundary.lines import Continued, continued, index_weights, mean_around, mean_beside
from quadcurv.types import Floats, Indices

LONG = 8  # points of a line
# A line is smooth where, in squares, the eighth point changes less than this part of what the seventh does,
# or this part of what the sixth does (the seventh does nothing where a line is odd).
_SMOOTH, _EARLIER = 0.5, 0.1
# And where what noise makes of the ghosts, along the normal, is less than this part of what they change.
_NOISE = 0.1
_FIFTH, _SIXTH, _SEVENTH = (
    np.array([(-1.0) ** j * comb(order, j) for j in range(order + 1)]) for order in (5, 6, 7)
)


@np.errstate(invalid="ignore")
def sharpened(found: Continued, lines: Floats, normals: Floats, beside: Indices) -> tuple[Continued, Floats]:
    """`found` by index, with ghosts on polynomials of degree seven in place of those of degree five.

    And what the last point, or of others the seventh, changes along the normal, (k,).

    Parameters
    ----------
    found : Continued
        By polynomials of degree five.
    lines : (k, LONG, 3) float64
        Points from the border inward; NaN where there are none.
    normals : (k, 3) float64
    beside : (m, 2) int64
        Lines that end beside each other.
    """
    x = lines - lines[:, :1]
    size = np.linalg.norm(x[:, 1], axis=1)
    x /= np.where(size > 0, size, 1.0)[:, None, None]  # so that no square is too large or too small
    fifth, sixth, seventh = (np.einsum("j,kjx->kx", w, x[:, : w.size]) for w in (_FIFTH, _SIXTH, _SEVENTH))
    before, last = (np.einsum("kx,kx->k", y, normals) for y in (sixth, seventh))
    most = np.maximum(_SMOOTH * (sixth**2).sum(axis=1), _EARLIER * (fifth**2).sum(axis=1))
    excess = (seventh**2).sum(axis=1) - most
    usable = np.isfinite(found.error) & np.isfinite(excess)
    smooth = mean_around(np.where(usable, excess, np.inf), beside) <= 0
    # Noise is by how far last differences are from those of the lines beside.
    noise2 = mean_beside(last, beside) / (_SEVENTH @ _SEVENTH)
    noisy = noise2 * np.square(index_weights(LONG - 1)).sum() > _NOISE * mean_around(before**2, beside)
    at = smooth & ~noisy
    ghosts = found.ghosts.copy()
    ghosts[at] = continued(lines[at], ghosts.shape[1], np.ones(int(at.sum()), bool))
    change = np.where(at, last, before) * size
    return found._replace(ghosts=ghosts, smooth=found.smooth | at, even=found.even | at), np.abs(change)
