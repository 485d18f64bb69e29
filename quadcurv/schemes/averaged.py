"""Degree and rings of plain least squares where noise prevails, chosen vertex by vertex by their risk.

The risk of a fit is the square of what noise makes of its H and that of its bias. Noise is known from the
residuals of fits that are small enough to follow the surface. The bias of a degree is told by the two next
ones: what they explain of the same points beyond what they would explain of noise counts as if every one of
their terms had the same part in it, and made as much of H. That of degree 6 is told by what its residuals
have beyond noise.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from quadcurv.boundary import tangent_frames
from quadcurv.schemes.base import Neighbourhoods
from quadcurv.types import Bools, Floats, Indices

# Rings, and those that follow where degree 6 is best and where a lower one is.
_FOLLOWING = {3: (4, 5), 4: (5, 5), 5: (6, 8), 6: (8, 8), 8: (0, 0)}
# Times that noise is averaged over neighbours, and that what terms explain is.
_NOISE, _POOL = 12, 1
POOLED = _NOISE + _POOL * len(_FOLLOWING)
_WORSE = 2.0  # times the least risk so far, from which on no more rings are taken
# Most that errors in height, of unit mean square, may grow to in the second derivatives, both in units of
# the neighbourhood's extent: regular neighbourhoods have 30 to 40, those without two rows 400 to 600, of
# which nothing is left but noise.
_CONDITION = {6: 160.0, 4: 160.0, 2: 40.0}
_TERMS = {8: 17, 6: 13, 4: 9}  # of a degree and the one before it
_MORE = {4: 7.0, 2: 12.0}  # the same, less its own, by any two degrees more, where there is no such fit
# Times that at most where such a fit is one-sided, and the same where it is hardly determined, as measured
# along borders: of what magnifies noise most a smooth surface has least.
_ONE_SIDED, _HARDLY = 2.0, 2.0
_ONE_SIDED_AT_MOST = 16.0  # the first of these in intervals: what a few terms alike make of H there
_NEXT = 3.0  # times the square of what noise grows to by degree 6, by degree 8
# Shares of the noise's square: what terms may be off by chance, and what noise may grow by with every ring.
_CHANCE, _UNEVEN = 0.2, 0.02
# Times the bias as it seems that of H, K, k1 and k2 is taken for in intervals: terms that are alike round the
# vertex, as on humps, give H more than others, and principal curvatures more still. The same of the square
# of what one fit differs from another beyond noise.
_CAUTION = np.array((1.55, 1.3, 2.3, 2.3))
_BEYOND = 1.7
# Times its square that of bias counts in the risk: it is known less well than noise.
_DOUBT = 2.0
_ALIKE = 5.0  # vertices whose residuals are one another's


# Times its square that of H's bias counts for directions: terms that are not looked at make the principal
# curvatures less different and turn them little.
_TURNED = 0.1


class Directions:
    """Directions of k1 from all fits that were made, each the more sure the less noise and bias turn it.

    Fits of different degree and rings err in different ways: together they are off by a fifth less than the
    best of them. What is averaged is the difference of the principal curvatures as it is turned, in a plane.
    """

    def begin(self, normals: Floats) -> None:
        """Take the planes of these normals (k, 3)."""
        self.first, self.second = tangent_frames(normals).swapaxes(0, 1)[:2]
        self.sums, self.unit = np.zeros(len(normals), complex), np.full(len(normals), np.nan)

    def add(self, at: Indices | slice, candidate: Candidate, noise2: Floats) -> None:
        """Add a fit at some of the vertices."""
        from quadcurv.kernels import jet as kernel

        fits, gain2 = candidate.fits, candidate.gain2
        parts2 = (fits[:, kernel.GAIN + 2] ** 2 + fits[:, kernel.GAIN + 3] ** 2) / 2
        off2 = np.maximum(parts2 - gain2, 0.0) * noise2 + _TURNED * candidate.bias2
        known = candidate.good & (off2 > 0)
        self.unit[at] = np.where(np.isnan(self.unit[at]) & known, off2, self.unit[at])
        weight = np.divide(self.unit[at], off2, out=np.zeros(off2.size), where=known) ** 2
        weight *= fits[:, kernel.K1] - fits[:, kernel.K2]
        x, y = (np.einsum("kx,kx->k", fits[:, kernel.DIRECTION1], e[at]) for e in (self.first, self.second))
        self.sums[at] += np.nan_to_num(weight) * np.nan_to_num(x + 1j * y) ** 2

    def of_k1(self) -> Floats:
        """(k, 3): in the planes of the given normals; NaN where nothing is known."""
        with np.errstate(invalid="ignore"):
            half = np.sqrt(self.sums / np.abs(self.sums))
        return half.real[:, None] * self.first + half.imag[:, None] * self.second


class Candidate:
    """A fit that vertices could have: results, squares of its bias as it seems and in intervals, its risk."""

    def __init__(self, fits: Floats, degree: int, bias2: Floats, most2: Floats, noise2: Floats) -> None:
        from quadcurv.kernels import jet as kernel

        self.fits, self.degree, self.bias2, self.most2 = fits, degree, bias2, most2
        self.gain2 = fits[:, kernel.GAIN] ** 2
        self.good = sound(fits, degree)
        risk = self.gain2 * noise2 + _DOUBT * bias2
        self.risk = np.where(self.good & ~np.isnan(risk), risk, np.inf)


def least_risks(
    around: Neighbourhoods, vertices: Indices, directions: Directions
) -> Iterator[tuple[Indices, Floats, Indices, int, int, Floats, Floats]]:
    """Fits that are better than those before: vertices, results, their rows, degree, rings, noise, biases.

    To `directions` all fits are added. Noise is the variance of the positions along the normal, biases (k, 4)
    are those of H, K, k1 and k2.
    """
    from quadcurv.kernels import jet as kernel

    following, least = np.full(vertices.size, min(_FOLLOWING)), np.full(vertices.size, np.inf)
    noise2, (values, made2) = np.empty(0), np.full((2, 4, vertices.size), np.nan)
    for r, (even, lower) in _FOLLOWING.items():
        at = np.flatnonzero(following == r)
        if at.size == 0:
            continue
        some = at if at.size < vertices.size else slice(None)  # of which nothing is copied
        here = vertices[some]
        fits = around.polynomials(here, 6, r, ghosts=False, kind=kernel.ROUND, nested=3)
        if noise2.size == 0:  # all have begun
            of = fits[0][:, [kernel.SQUARE, kernel.FREEDOM]]
            of = np.where(of[:, 1:] > 0, of, np.nan)  # a fit that magnifies noise tells of it
            square, freedom = spread(around, vertices, of, _NOISE).T
            noise2 = square / freedom
            directions.begin(fits[2][:, kernel.NORMAL])
        noise2_here = noise2[some]
        candidates = list(_candidates(around, here, r, noise2_here, fits))
        for c in candidates:
            directions.add(some, c, noise2_here)
        risks = np.stack([c.risk for c in candidates])
        best, risk = np.argmin(risks, axis=0), np.min(risks, axis=0)
        most2 = _of_best(best, [c.most2 for c in candidates])
        # What the difference to the fit before has beyond noise is bias (Hausman 1978). Columns of fits lie
        # one after the other.
        new = _of_best(best, [c.fits.T[:4] for c in candidates])
        gain = _of_best(best, [c.fits.T[kernel.GAIN : kernel.GAIN + 4] for c in candidates])
        made = (gain * np.sqrt(noise2_here)) ** 2  # by noise; squares of gains alone may overflow
        beyond = (new - values[:, some]) ** 2 - np.maximum(made2[:, some] - made, 0.0)
        better = risk < least[some]
        beyond = spread(around, here, np.where(better, beyond, np.nan).T, _POOL).T
        bias2 = np.fmax(most2 * (_CAUTION[:, None] * gain / gain[:1]) ** 2, _BEYOND * beyond)
        bias = np.sqrt(np.fmax(bias2, 0.0)).T
        for k, c in enumerate(candidates):
            rows = np.flatnonzero((best == k) & better)
            yield here[rows], c.fits, rows, c.degree, r, noise2_here[rows], bias[rows]
        on = (risk < _WORSE * least[some]) | np.isinf(least[some])
        least[some] = np.minimum(risk, least[some])
        values[:, some] = np.where(better, new, values[:, some])
        made2[:, some] = np.where(better, made, made2[:, some])
        following[some] = np.where(on, np.where(best > 0, lower, even), 0)


def _of_best(best: Indices, values: list[Floats]) -> Floats:
    """Those of the best of three candidates."""
    return np.where(best == 0, values[0], np.where(best == 1, values[1], values[2]))


def _candidates(
    around: Neighbourhoods, vertices: Indices, r: int, noise2: Floats, fits: Floats
) -> Iterator[Candidate]:
    """Degrees 6, 4 and 2 over so many rings."""
    from quadcurv.kernels import jet as kernel

    six, four, two = fits
    excess = six[:, kernel.SQUARE] - six[:, kernel.FREEDOM] * noise2
    of = np.stack((excess, six[:, kernel.FREEDOM]), axis=1)
    of = np.where(of[:, 1:] > 0, of, np.nan)
    excess, freedom = np.nan_to_num(spread(around, vertices, of, _POOL)).T
    chance = noise2 * np.sqrt(freedom / _ALIKE)
    share = _NEXT / _TERMS[8] * six[:, kernel.GAIN] ** 2
    uneven = _UNEVEN * (r - min(_FOLLOWING)) * noise2 * freedom
    seen, most = (np.maximum(x, 0.0) * share for x in (excess - uneven - chance, excess))
    before = Candidate(six, 6, seen, most, noise2)
    yield before
    for degree, lower in ((4, four), (2, two)):
        explained = before.fits[:, kernel.LOWER] - before.fits[:, kernel.SQUARE]
        explained = np.where(before.fits[:, kernel.FREEDOM] > 0, explained, np.nan)[:, None]
        per_term = spread(around, vertices, explained, _POOL)[:, 0] / _TERMS[degree + 2]
        excess = np.maximum(per_term - (1 + _CHANCE) * noise2, 0.0)
        gain2 = lower[:, kernel.GAIN] ** 2
        most = _MORE[degree] * gain2
        known = np.isfinite(before.fits[:, kernel.CONDITION])
        otherwise = np.where(known, _HARDLY * gain2, most)
        less, more = (
            np.where(before.good, np.clip(before.gain2 - gain2, 0.0, times * most), otherwise)
            for times in (_ONE_SIDED, _ONE_SIDED_AT_MOST)
        )
        # Where the fit before is hardly determined its own bias is that of what this one does not look at.
        share = np.minimum(1.0, (gain2 + most) / before.gain2)
        seen = excess * less + np.nan_to_num(share * before.bias2)
        left = before.most2 * (gain2 / before.gain2)
        most = np.maximum(per_term - noise2, 0.0) * more + np.nan_to_num(left)
        before = Candidate(lower, degree, seen, most, noise2)
        yield before


def rounded(around: Neighbourhoods, degree: int, rings: int, vertices: Indices) -> Floats:
    """Plain least squares over the nearest sphere."""
    from quadcurv.kernels import jet as kernel

    return around.polynomials(vertices, degree, rings, ghosts=False, kind=kernel.ROUND)


def sound(fits: Floats, degree: int) -> Bools:
    """Whether a fit is well conditioned, and has residuals."""
    from quadcurv.kernels import jet as kernel

    return (fits[:, kernel.CONDITION] <= _CONDITION[degree]) & (fits[:, kernel.FREEDOM] > 0)


def spread(around: Neighbourhoods, vertices: Indices, values: Floats, rings: int) -> Floats:
    """Means over neighbours among some vertices."""
    whole = values
    if vertices.size < around.wanted.size:
        whole = np.full((around.wanted.size, values.shape[1]), np.nan)
        whole[vertices] = values
    whole = around.pooled(whole, rings)
    return whole if vertices.size == len(whole) else whole[vertices]
