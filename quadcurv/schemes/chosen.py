"""Degree, rings and weights of fits chosen vertex by vertex, with error bars that know of noise and of bias.

Where a neighbourhood resolves the surface, terms of higher degree explain nearly all that those of lower
degree leave, and what is left says how far the fit is off: there a fit of degree 6 over three rings, through
the vertex and with weights that fall with the distance, has the least error, over the nearest sphere or over
the plane. Where they explain no more than chance does, the rest is noise: there plain least squares over as
many points as the bias permits are best. Which of the two it is, an F test tells at every vertex.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy

from quadcurv.boundary import tangent_frames
from quadcurv.schemes import averaged, lattice
from quadcurv.schemes.base import Curvatures, Neighbourhoods, StandardErrors
from quadcurv.schemes.quadric import quadrics
from quadcurv.types import Bools, Floats, Indices

# Degree, rings, and whether these go on beyond the border.
_SIDES = ((6, 3, True), (6, 4, False), (6, 5, False), (4, 2, True), (4, 3, False), (4, 4, False))
_LAST = (1, 2, 3, 4)  # rings of quadratic fits
# Most that errors in height, of unit mean square, may grow to in the second derivatives, both in units of
# the neighbourhood's extent; regular neighbourhoods have 40, 16 and 4.
_CONDITION = {6: 500.0, 4: 160.0, 2: 40.0}
# The same of one-sided fits; over fewer rows than one more than the degree what they leave out is not seen.
_ONE_SIDED = {(6, 3): 2e3, (6, 4): 2e3, (6, 5): 1e4, (4, 2): 1e3, (4, 3): 1e3, (4, 4): 1e3}
_FREE = 2  # points more than terms, with which a one-sided fit still passes through all by chance
# What noise leaves of its square in weighted residuals, and their degrees of freedom, both per point more
# than terms: measured on quads and triangles, jittered or not, at valences 3 to 5.
_LEFT = {6: (0.41, 0.67), 4: (0.31, 0.62), 2: (0.06, 0.57)}
# Of the squares of all heights: less is the rounding of what the terms are taken from.
_DIGITS = 2.0**-46
# Times what noise explains with as many terms, from which on terms are the surface's, and from which on noise
# is so little that no fit over more rings is better.
_RESOLVED, _CLEARLY = 5.0, 15.0
_WORTH = 2.0  # the same, from which on other fits are tried
# Of what one fit leaves, as much as another must: what noise leaves is no choice. The same of one-sided fits.
_LESS, _FAR_LESS = 0.7, 0.3
# Where noise prevails of which nobody near knows how large it is.
_MORE = ((4, 3), (4, 4), (4, 5), (2, 3), (2, 4))
_QUANTILE = 0.975
# H through the vertex differs from H of a surface that passes it by 0.6 times what noise makes of H, so says
# noise, and by less where what residuals are left is the surface's own: then H is off by up to 1.9 times as
# much, K, k1 and k2 by up to 3. What is left between, so many times the difference counts as that of noise.
_SEEN = np.array((2.5, 3.8, 3.8, 3.8))
_NEAR, _INSIDE = 4, 3  # rings over which that is looked at, and rings to the border from which on
_SMALLER = ((4, 2), (2, 1))
_AT_ONCE = 2**13  # vertices that quadrics are fitted at
_EXACT = 1e-3  # of the residuals of quadratic fits: all lie on one quadric
_DOUBT = 0.02  # of the curvature, from which errors on others are asked
_NEARLY_ALL, _MOST = 0.8, 0.5
# Of an error, as much as another way must claim to be taken, and to be believed against it.
_CLEARLY_LESS, _SURER = 0.3, 0.1
_FAR = 12  # rings over which noise is looked for at most, where all is steep
POOLED = _FAR + averaged.POOLED
# Fits over five rings at these, the normals of the rings, and how far creases and jumps are looked for.
REACH = POOLED + 5 + 1 + 6


def unpacked(out: Floats, **more: Any) -> Curvatures:
    """Columns of fits by their names, and what else is known."""
    from quadcurv.kernels import jet as kernel

    return Curvatures(
        mean=out[:, kernel.MEAN],
        gaussian=out[:, kernel.GAUSSIAN],
        k1=out[:, kernel.K1],
        k2=out[:, kernel.K2],
        direction1=out[:, kernel.DIRECTION1],
        direction2=out[:, kernel.DIRECTION2],
        normal=out[:, kernel.NORMAL],
        **more,
    )


class _Found:
    """Results so far, vertex by vertex."""

    def __init__(self, around: Neighbourhoods) -> None:
        from quadcurv.kernels import jet as kernel

        n = around.wanted.size
        self.around, self.kernel = around, kernel
        self.values = np.full((kernel.COLUMNS, n), np.nan).T
        self.degree, self.rings = np.zeros((2, n), np.int32)
        self.is_smooth = np.zeros(n, bool)
        self.sigma, self.freedom = np.full((2, n), np.nan)
        self.bias = np.full((4, n), np.nan).T

    def put(self, at: Indices | slice, fits: Floats, d: int, r: int, beyond: Floats | float = 0.0) -> None:
        """Results of smooth fits, H being off by so much for what is beyond a border."""
        kernel, left = self.kernel, fits[:, self.kernel.FREEDOM]
        share, part = _LEFT[d]
        if isinstance(at, slice):
            self.values = fits
        else:
            self.values[at] = fits
        self.degree[at], self.rings[at], self.is_smooth[at] = d, r, True
        square = np.divide(
            fits[:, kernel.SQUARE], share * left, out=np.full(len(fits), np.nan), where=left > 0
        )
        self.sigma[at], self.freedom[at] = np.sqrt(square), np.maximum(part * left, 1.0)
        gain = fits[:, kernel.GAIN : kernel.GAIN + 4]
        others = np.reshape(beyond, (-1, 1)) * gain / gain[:, :1]
        self.bias[at] = np.hypot(fits[:, kernel.BIAS : kernel.BIAS + 4], others)

    def put_noisy(
        self, at: Indices, fits: Floats, d: int, r: int, noise: Floats, bias: Any, rows: Any = slice(None)
    ) -> None:
        """Results of fits by plain least squares, or of some rows of them, and their bias."""
        for own, column in zip(self.values.T, fits.T, strict=True):  # which lie one after the other
            own[at] = column[rows]
        self.degree[at], self.rings[at], self.is_smooth[at] = d, r, False
        self.sigma[at], self.freedom[at] = noise, np.maximum(fits[rows, self.kernel.FREEDOM], 1.0)
        self.bias[at] = bias

    def turn(self, at: Indices, directions: Floats) -> None:
        """Take directions of k1 from other fits, in the tangent planes of these."""
        kernel = self.kernel
        normal = self.values[at, kernel.NORMAL]
        first = directions - np.einsum("kx,kx->k", directions, normal)[:, None] * normal
        size = np.linalg.norm(first, axis=1, keepdims=True)
        known = (size > 0.5)[:, 0]
        first = first[known] / size[known]
        self.values[at[known], kernel.DIRECTION1] = first
        self.values[at[known], kernel.DIRECTION2] = np.cross(normal[known], first)

    def take(self, other: _Found, at: Indices) -> None:
        """Results of another, which is nobody's then."""
        for name in ("values", "degree", "rings", "is_smooth", "sigma", "freedom", "bias"):
            if at.size == len(self.values):
                setattr(self, name, getattr(other, name))
                continue
            own, others = (np.atleast_2d(getattr(x, name).T) for x in (self, other))
            for k in range(len(own)):
                own[k, at] = others[k, at]

    def clear(self, at: Indices) -> None:
        """Nothing is known again."""
        for values in (self.values, self.sigma, self.freedom, self.bias):
            values[at] = np.nan
        self.degree[at] = self.rings[at] = self.is_smooth[at] = 0

    def errors(self, at: Any = slice(None)) -> Floats:
        """(k, 4): half of intervals that hold the exact values in 95 % of cases, were all residuals noise."""
        gain = self.values[at, self.kernel.GAIN : self.kernel.GAIN + 4]
        noise = self._quantile(at)[:, None] * gain * self.sigma[at, None]
        return np.hypot(np.nan_to_num(noise), 2 * self.bias[at])

    def _quantile(self, at: Any) -> Floats:
        """(k,): of Student's t."""
        freedom = self.freedom[at]
        few = np.sort(freedom[np.isfinite(freedom)])
        few = few[np.diff(few, prepend=-1.0) > 0]
        of_few = np.append(scipy.special.stdtrit(few, _QUANTILE), np.nan)
        return of_few[np.searchsorted(few, freedom)]

    def intervals(self) -> Floats:
        """(n, 4): the same, residuals being noise as far as they also move surfaces off their vertices."""
        kernel, around, out = self.kernel, self.around, self.errors()
        inside = around.pooled(around.on_border.astype(np.float64)[:, None], _INSIDE)
        gain = self.values[:, kernel.GAIN : kernel.GAIN + 4]
        # What ghosts are off by shows in no residual.
        at = np.flatnonzero(self.is_smooth & (self.rings <= 3) & (around.ghost_error > 0))
        out[at] = np.hypot(out[at], gain[at] * around.ghost_error[at, None])
        at = np.flatnonzero(self.is_smooth & (inside[:, 0] == 0))
        if at.size == 0:
            return out
        gain = gain[at]
        off = np.full((len(out), 1), np.nan)
        off[at, 0] = (self.values[at, kernel.BIAS] / gain[:, 0]) ** 2
        off = around.pooled(off, _NEAR)
        sigma = np.fmin(self.sigma[at, None], _SEEN * np.sqrt(off[at]))
        noise = self._quantile(at)[:, None] * gain * sigma
        out[at] = np.hypot(np.nan_to_num(noise), self.bias[at])
        return out

    def doubt(self, at: Indices, rounding: float) -> Floats:
        """Errors of H over the curvature, 0 where they are rounding."""
        kernel, values, error = self.kernel, self.values[at], self.errors(at)[:, 0]
        size = np.maximum(np.abs(values[:, kernel.K1]), np.abs(values[:, kernel.K2]))
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(error <= rounding * values[:, kernel.GAIN], 0.0, error / size)

    def curvatures(self, on_crease: Bools) -> Curvatures:
        """What is known."""
        gain = self.values[:, self.kernel.GAIN : self.kernel.GAIN + 4]
        return unpacked(
            self.values,
            standard_error=StandardErrors(*(gain * self.sigma[:, None]).T),
            interval=StandardErrors(*self.intervals().T),
            noise=self.sigma,
            degree=self.degree,
            rings=self.rings,
            feature=on_crease,
        )


def chosen(around: Neighbourhoods) -> Curvatures:
    """All curvatures by the best fit that each vertex can have."""
    from quadcurv.kernels import jet as kernel

    found = _Found(around)
    feature = around.on_crease | around.on_jump
    creased = np.flatnonzero(around.wanted & feature)
    if creased.size:
        here = around.polynomials(creased, 2, 1, False)
        known = here[:, kernel.CONDITION] <= _CONDITION[2]
        found.put_noisy(creased[known], here[known], 2, 1, here[known, kernel.SIGMA], 0.0)
    vertices = np.flatnonzero(around.wanted & ~feature)
    noisy = _smooth_or_noisy(around, vertices, found) if vertices.size else feature
    _along_lines(around, noisy, found)
    return found.curvatures(around.on_crease)


def _smooth_or_noisy(around: Neighbourhoods, vertices: Indices, found: _Found) -> Bools:
    """Take fits of heights, by what the three rings of vertices tell; where noise prevails."""
    from quadcurv.kernels import jet as kernel

    fits = _smooth(around, vertices, 6, 3)
    good = (fits[:, kernel.CONDITION] <= _CONDITION[6]) & np.isnan(around.border_error(3)[vertices])
    unresolved = good & ~_resolved(fits, 6, around.rounding)
    hardly = good & ~unresolved & ~_resolved(fits, 6, around.rounding, _CLEARLY)
    at = slice(None) if good.all() else good
    found.put(vertices[at], fits[at], 6, 3)
    n = around.wanted.size
    noisy, untold, hard, sure = np.zeros((4, n), bool)
    at_sides = _at_sides(around, vertices[~good], fits[~good], found)
    noisy[at_sides[0]], untold[at_sides[1]] = True, True
    noisy[vertices[unresolved]], hard[vertices[hardly]], sure[vertices[good]] = True, True, True
    if noisy.any():
        untold[vertices[np.isnan(fits[:, kernel.CONDITION]) | (found.degree[vertices] <= 2)]] = True
        noisy = _in_noise(around, vertices, untold, noisy)
    noisy = _average(around, noisy, hard & ~noisy, found)
    _doubted(around, np.flatnonzero(sure & ~noisy), found)
    vertices = vertices[~noisy[vertices]]
    least = np.where(sure[vertices], _DOUBT, 0.0)
    _quadrics(around, vertices[~(found.doubt(vertices, around.rounding) <= least)], found)
    return noisy


def _smooth(around: Neighbourhoods, vertices: Indices, d: int, r: int, ghosts: bool = True) -> Floats:
    """Fits through the vertex over the nearest sphere, or over the plane where these leave less.

    Spheres make short work of what is round, and of what is not they make terms of higher degree. With terms
    of the highest degrees and without: along straight lines of a mesh these go through all of a few rows. One
    side alone tells less.
    """
    from quadcurv.kernels import jet as kernel

    fits = around.polynomials(vertices, d, r, ghosts, kernel.SMOOTH)
    at = np.flatnonzero(~(_explained(fits, d) < _WORTH) & ~_exact(fits, around.rounding))
    flat = around.polynomials(vertices[at], d, r, ghosts, kernel.FLAT)
    left, before = (x[:, [kernel.SQUARE, kernel.LOWER]] for x in (flat, fits[at]))
    less = _LESS if ghosts else _FAR_LESS
    better = (np.isfinite(left) & ~(left >= less * before)).all(axis=1)
    fits[at[better]] = flat[better]
    return fits


def _doubted(around: Neighbourhoods, vertices: Indices, found: _Found) -> None:
    """Take smaller neighbourhoods where those of three rings are off and these are not, as far as they tell.

    At jumps of curvature, where an arc ends in a tangent, and on meshes too coarse for three rings.
    """
    from quadcurv.kernels import jet as kernel

    vertices = vertices[found.doubt(vertices, around.rounding) > _DOUBT]
    for d, r in _SMALLER:
        if vertices.size == 0:
            return
        fits, other = _smooth(around, vertices, d, r), _Found(around)
        other.put(vertices, fits, d, r)
        better = other.errors(vertices)[:, 0] < found.errors(vertices)[:, 0]
        better &= fits[:, kernel.CONDITION] <= _CONDITION[d]
        found.put(vertices[better], fits[better], d, r)


def _quadrics(around: Neighbourhoods, vertices: Indices, found: _Found) -> None:
    """Take the quadric that all of three rings lie on, where there is one.

    What is between it and what was found before is how far either may be off, as over few rows, through which
    more than one surface goes.
    """
    kernel = found.kernel
    for start in range(0, vertices.size, _AT_ONCE):
        at = vertices[start : start + _AT_ONCE]
        fits = quadrics(around, at, 3)
        least = (around.rounding**2 * fits[:, kernel.FREEDOM], _EXACT**2 * fits[:, kernel.LOWER])
        exact = fits[:, kernel.SQUARE] <= np.maximum(*least)
        # Few rows along a border are on many quadrics: there a fit that knows its error knows better.
        apart = np.abs(fits[:, 0] - found.values[at, 0])
        exact &= ~((apart > found.errors(at)[:, 0]) & np.isfinite(around.border_error(3)[at]))
        at, fits = at[exact], fits[exact]
        apart = np.nan_to_num(np.abs(fits[:, :4] - found.values[at, :4])) / 2
        found.put_noisy(at, fits, 2, 3, fits[:, kernel.SIGMA], apart)


def _along_lines(around: Neighbourhoods, noisy: Bools, found: _Found) -> None:
    """Take differences along the lines of the mesh where these claim less error, and do not contradict.

    Not amid noise, nor where errors are rounding.
    """
    kernel, before = found.kernel, found.errors()
    values, error = found.values, before[:, 0]
    with np.errstate(invalid="ignore"):
        asked = around.wanted & (error > around.rounding * values[:, kernel.GAIN])
    if noisy.any():
        share = around.pooled(noisy.astype(np.float64)[:, None], _NEAR)
        asked &= ~(noisy & (share[:, 0] > _NEARLY_ALL))
    vertices, other = np.flatnonzero(asked), _Found(around)
    if vertices.size == 0:
        return
    at, fits, noise, bias = lattice.differences(around, vertices, error[vertices])
    other.put_noisy(at, fits, lattice.DEGREE, lattice.RINGS, noise, bias)
    before, now = before[at], other.errors(at)
    # Where both are sure of something else, what is between them counts.
    apart = np.abs(values[at, :4] - fits[:, :4])
    other.bias[at] = np.where((apart > before + now) & (now > _SURER * before), apart / 2, bias)
    found.take(other, at[now[:, 0] < _CLEARLY_LESS * before[:, 0]])


def _in_noise(around: Neighbourhoods, vertices: Indices, untold: Bools, noisy: Bools) -> Bools:
    """Noisy vertices, those nearly all of whose neighbours are, and untold ones where most of the others are.

    But for those most of whose neighbours are not: noise of one vertex is seen from all around, so that there
    it is chance, or a corner's ghosts.
    """
    evidence = np.full(around.wanted.size, np.nan)
    evidence[vertices] = 0.0
    evidence[untold], evidence[noisy] = np.nan, 1.0
    found, nearest = np.zeros(evidence.size, bool), np.full(evidence.size, np.nan)
    for rings in range(1, _FAR + 1):
        evidence = around.pooled(evidence[:, None])[:, 0]
        if rings == 2:
            found[vertices] = evidence[vertices] > _NEARLY_ALL
        if rings == 3:
            found |= noisy & (evidence > _MOST)
        if rings > 2:  # what is nearest counts, however far others have to look
            nearest = np.where(np.isnan(nearest), evidence, nearest)
            if np.isfinite(nearest[untold]).all():
                break
    return found | (untold & (nearest > _MOST))


def _at_sides(
    around: Neighbourhoods, vertices: Indices, first: Floats, found: _Found
) -> tuple[Indices, Indices]:
    """Fits where three rings do not do, at rough borders above all.

    Then those vertices where noise prevails, and those of which nothing but what completes them tells.

    One-sided fits over more rings, and fits to neighbourhoods completed by a surface fitted at the border:
    that of the least error, as far as they and their neighbours can tell.
    """
    from quadcurv.kernels import jet as kernel

    if vertices.size == 0:
        return vertices, vertices
    n = around.wanted.size
    fits, beyond, errors, (noisy, told) = [], [], [], np.zeros((2, vertices.size), bool)
    for d, r, ghosts in _SIDES:
        here = first if (d, r) == (6, 3) else _smooth(around, vertices, d, r, ghosts)
        good = (here[:, kernel.CONDITION] <= _ONE_SIDED[d, r]) & (here[:, kernel.FREEDOM] > _FREE)
        if ghosts:  # points beyond a border are never too steep: look at those that are there
            there = around.polynomials(vertices, 2, r, False, kernel.SMOOTH)
            good &= ~np.isnan(there[:, kernel.CONDITION])
        at = np.flatnonzero(good)
        resolved = _resolved(here[at], d, around.rounding)
        if not ghosts:
            noisy[at[~resolved]], told[at] = True, True
            at = at[resolved]
        beyond.append(np.nan_to_num(around.border_error(r)[vertices]) if ghosts else np.zeros(vertices.size))
        found.put(vertices[at], here[at], d, r, beyond[-1][at])
        own = found.errors(vertices[at])[:, 0] ** 2
        whole = np.full((n, 1), np.nan)
        whole[vertices[at], 0] = own
        error = np.full(vertices.size, np.inf)
        # Neighbours tell more than one vertex, but those on the border itself may be worse off. A fit that is
        # hardly determined may look good by chance, here or beside.
        near = around.pooled(whole)[vertices[at], 0]
        hardly = here[at, kernel.CONDITION] > _CONDITION[d]
        error[at] = np.where(hardly, np.maximum(own, near), np.minimum(own, near))
        fits.append(here)
        errors.append(error)
    best = np.argmin(errors, axis=0)
    known = np.isfinite(np.min(errors, axis=0))
    found.clear(vertices)
    for k, (d, r, _) in enumerate(_SIDES):
        at = known & (best == k)
        found.put(vertices[at], fits[k][at], d, r, beyond[k][at])
    todo = np.flatnonzero(~known)
    for r in _LAST:
        here = around.polynomials(vertices[todo], 2, r, r == 1, kernel.SMOOTH)
        good = here[:, kernel.CONDITION] <= _CONDITION[2]
        off = np.nan_to_num(around.border_error(r)[vertices[todo[good]]]) if r == 1 else 0.0
        found.put(vertices[todo[good]], here[good], 2, r, off)
        todo = todo[~good]
    if todo.size:
        _spheres(around, vertices[todo], found)
    return vertices[noisy], vertices[~told]


def _spheres(around: Neighbourhoods, vertices: Indices, found: _Found) -> None:
    """Take the sphere nearest to the ring where three or four neighbours determine nothing more."""
    kernel = found.kernel
    positions, normals = around.positions(vertices, 1)
    apart = positions[:, 1:] - positions[:, :1]
    with np.errstate(divide="ignore", invalid="ignore"):
        n = normals / np.linalg.norm(normals, axis=1, keepdims=True)
        square = np.sum(apart**2, axis=2)
        height = np.einsum("kmx,kx->km", apart, n)
        H = -2 * np.nansum(height * square, axis=1) / np.nansum(square**2, axis=1)
    known = np.isfinite(H) & np.isfinite(n).all(axis=1) & ((square > 0).sum(axis=1) >= 3)
    at, H, n = vertices[known], H[known], n[known]
    one, other, _ = tangent_frames(n).swapaxes(0, 1)
    values = found.values
    values[at, kernel.MEAN], values[at, kernel.GAUSSIAN] = H, H**2
    values[at, kernel.K1], values[at, kernel.K2] = H, H
    values[at, kernel.DIRECTION1], values[at, kernel.DIRECTION2] = one, other
    values[at, kernel.NORMAL] = n
    found.degree[at] = found.rings[at] = 1


def _resolved(fits: Floats, d: int, rounding: float, times: float = _RESOLVED) -> Bools:
    """Whether terms of the two highest degrees explain more than noise would, or the rest is rounding."""
    return _exact(fits, rounding) | (_explained(fits, d) > times)


def _explained(fits: Floats, d: int) -> Floats:
    """What the terms of the two highest degrees explain, as multiples of what they would of noise."""
    from quadcurv.kernels import jet as kernel

    explained = (fits[:, kernel.LOWER] - fits[:, kernel.SQUARE]) * np.maximum(fits[:, kernel.FREEDOM], 1.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return explained / ((2 * d + 1) * fits[:, kernel.SQUARE])


def _exact(fits: Floats, rounding: float) -> Bools:
    """Whether what is left is rounding."""
    from quadcurv.kernels import jet as kernel

    square = fits[:, kernel.SQUARE]
    exact = square <= rounding**2 * np.maximum(fits[:, kernel.FREEDOM], 1.0)
    return exact | (square <= _DIGITS * fits[:, kernel.WHOLE])


def _average(around: Neighbourhoods, noisy: Bools, hardly: Bools, found: _Found) -> Bools:
    """Take plain least squares at noisy vertices, and where more rings are better for hardly resolved ones.

    What is not noise grows with the rings far faster than fits over them gain.
    """
    vertices, other = np.flatnonzero(noisy | hardly), _Found(around)
    if vertices.size == 0:
        return noisy
    directions = averaged.Directions()
    for at, fits, rows, d, r, noise2, bias in averaged.least_risks(around, vertices, directions):
        other.put_noisy(at, fits, d, r, np.sqrt(noise2), bias, rows)
    other.turn(vertices, directions.of_k1())
    todo = np.flatnonzero(noisy & (other.degree == 0))
    for d, r in _MORE:
        if todo.size == 0:
            break
        fits = averaged.rounded(around, d, r, todo)
        good = averaged.sound(fits, d)
        other.put_noisy(todo[good], fits[good], d, r, fits[good, found.kernel.SIGMA], 0.0)
        todo = todo[~good]
    at = np.flatnonzero(hardly & (other.rings > 3))
    better = at[other.errors(at)[:, 0] < found.errors(at)[:, 0]]
    found.take(other, np.flatnonzero(noisy & (other.degree > 0)))
    found.take(other, better)
    noisy = noisy.copy()
    noisy[better] = True
    return noisy
