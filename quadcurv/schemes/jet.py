"""Polynomial fits over the neighbourhood of every vertex: "jets"."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np

from quadcurv.schemes.base import Curvatures, Fit, Neighbourhoods, StandardErrors
from quadcurv.schemes.chosen import chosen
from quadcurv.types import Bools, Floats, Indices, Ints

# Most that errors in height, of unit mean square, may grow to in the second derivatives, both in units of
# the neighbourhood's extent: inside 2, 3 and 10 by degree; at the sides of a grid, where rings beyond the
# least are needed, 5, 30 and 100.
_CONDITION = {2: 20.0, 3: 60.0, 4: 220.0, 6: 1000.0}
_RINGS = {2: 1, 3: 2, 4: 2, 6: 3}
_GROWTH = 3
_MOST_RINGS = 64

_REFERENCE = "Cazals and Pouget 2005"
_CANDIDATES = [(d, r) for d in (4, 3, 2) for r in range(2, 9)]
_SAMPLE, _LEAST_SAMPLE = 3000, 100

# Vertices (k,), degree, rings -> results (k, COLUMNS).
Run = Callable[[Indices, int, int], Floats]


def jet(degree: int | Literal["auto"] | None = None, rings: int | None = None) -> Fit:
    """Polynomial of height over the tangent plane, by least squares over rings of neighbours.

    Parameters
    ----------
    degree : {2, 3, 4, 6} or "auto", optional
        By default ("jet") chosen vertex by vertex, with rings and weights: where the surface is resolved a
        polynomial of degree 6 over three rings and over the nearest sphere instead of the plane, through the
        vertex and with weights that fall with the distance; where noise prevails plain least squares of
        degree 4 or 6 over three rings; beside rough borders one-sided fits over more. "auto" chooses degree
        and rings of plain fits for the whole mesh: those of the least error in the mean curvature as far as
        the fits of a sample of vertices tell, noise by their standard errors and bias by differences between
        fits.
    rings : int, optional
        Rings of faces around a vertex whose vertices are fitted, on a grid the window of
        (2 rings + 1)^2 points. By default 1 for degree 2, 3 for degree 6 and 2 for the others.

    Returns
    -------
    Fit
        The default's H is of order 6 where neighbourhoods are nearly symmetric and of order 5 elsewhere,
        exact on spheres, and ``Curvatures.interval`` has its error bars.
        With a degree, plain least squares as published: H of order 4 with degree 4, of order 6 with degree 6
        and of order 2 with the others where neighbourhoods are nearly symmetric, of order `degree` - 1
        elsewhere.
        Where the vertices of the rings do not determine the polynomial well, up to three more rings
        are taken, and if that does not help the degree is lowered. Where several rings are steeper than 2 : 1
        over the tangent plane, or fold over, fewer are taken. ``Curvatures.degree`` and ``.rings`` report
        all this; both are 0 where there is no result.
        With boundary="extrapolate" as many ghost layers as rings, if these are no more than three,
        are put around grids and face lists, by quintic extrapolation along strips of six points as
        :func:`quadcurv.one_rings` traces them: borders are then as good as the inside. Fits are one-sided
        where a strip is rough or cannot be traced.

    Raises
    ------
    ValueError
        Any other degree, fewer than one ring, or rings with "auto".

    References
    ----------
    F. Cazals, M. Pouget (2005), Estimating differential quantities using polynomial fitting of
    osculating jets, Computer Aided Geometric Design 22, 121-146.
    X. Jiao, H. Zha (2008), Consistent computation of first- and second-order differential quantities for
    surface meshes, SPM 2008, 159-170: weights, and fits through the vertex.

    Examples
    --------
    >>> import quadcurv as qc
    >>> cubic = qc.schemes.jet(3)
    >>> cubic.name
    'jet-3'
    """
    if degree is None:
        if rings is not None:
            raise ValueError(f"rings: chosen vertex by vertex without a degree, got {rings!r}")
        return Fit("jet", 6, _REFERENCE, chosen)
    if degree == "auto":
        if rings is not None:
            raise ValueError(f'rings: chosen with degree "auto", got {rings!r}')
        return Fit("jet-auto", 4, _REFERENCE, _chosen_curvatures)
    if not isinstance(degree, int) or degree not in _CONDITION:
        raise ValueError(f'degree: expected "auto" or one of {tuple(_CONDITION)}, got {degree!r}')
    if rings is None:
        rings = _RINGS[degree]
    elif not isinstance(rings, int | np.integer) or not 1 <= rings <= _MOST_RINGS:
        raise ValueError(f"rings: expected a whole number from 1 to {_MOST_RINGS}, got {rings!r}")
    standard = rings == _RINGS[degree]
    return Fit(
        f"jet-{degree}" if standard else f"jet-{degree}-{rings}",
        2 if degree < 4 else degree,
        _REFERENCE,
        lambda around: _curvatures(around, degree, rings),
        int(rings) + _GROWTH + 1,  # and the normals of these
    )


def _curvatures(around: Neighbourhoods, degree: int, rings: int) -> Curvatures:
    def run(vertices: Indices, d: int, r: int) -> Floats:
        return around.polynomials(vertices, d, r, ghosts=r <= rings <= 2)

    return _unpacked(*_fits(around.wanted, run, degree, rings))


def _chosen_curvatures(around: Neighbourhoods) -> Curvatures:
    def run(vertices: Indices, d: int, r: int) -> Floats:
        return around.polynomials(vertices, d, r, ghosts=False)

    return _curvatures(around, *_choice(np.flatnonzero(around.present), run))


def _choice(vertices: Indices, run: Run) -> tuple[int, int]:
    """Degree and rings of the least expected error of H, by noise and bias, over a sample of vertices.

    With H the mean curvature by a fit and H' that by a quartic over no more rings, H' - H is uncorrelated
    with the noise of H, the best linear estimate of all (Gauss and Markov). Hence the mean of (H' - H)^2 is
    var H' - var H and the square of how far the biases are apart (Hausman 1978). A quartic over one ring
    more bears witness too, with var H' + var H at most. Cubics do not against quadratics: their H is of the
    same order, and its bias often the larger one.
    """
    from quadcurv.kernels import jet as kernel

    total = vertices.size
    if total < _LEAST_SAMPLE:
        return _CANDIDATES[0]
    if total > _SAMPLE:
        vertices = np.random.default_rng(0).choice(vertices, _SAMPLE, replace=False)
    fits, sound = {}, {}
    for d, r in _CANDIDATES:
        fits[d, r], degrees, rings = _fits(
            np.ones(vertices.size, bool), lambda at, d, r: run(vertices[at], d, r), d, r
        )
        sound[d, r] = (degrees == d) & (rings == r) & (fits[d, r][:, kernel.SIGMA] > 0)
    # Those that most vertices have room for, at the vertices that have room for all of these.
    fits = {c: f for c, f in fits.items() if sound[c].mean() > 0.5}
    kept = np.all([sound[c] for c in fits], axis=0) if fits else np.zeros(0, bool)
    if kept.sum() < _LEAST_SAMPLE:
        return _CANDIDATES[0]
    H = {c: f[kept, kernel.MEAN] for c, f in fits.items()}
    gain2 = {c: f[kept, kernel.GAIN] ** 2 for c, f in fits.items()}
    noise2 = np.mean(fits[next(iter(fits))][kept, kernel.SIGMA] ** 2)  # of the fewest rings

    bias: dict[tuple[int, int], float] = {}
    for c in fits:
        bias[c] = 0.0
        for b in [b for b in bias if b != c and b[0] == 4 and b[1] <= c[1] + 1]:
            # One-sided fits, a tenth as precise, would drown what the others tell.
            weights = 1 / gain2[b] / np.sum(1 / gain2[b])
            shared = gain2[c] if b[1] <= c[1] else -gain2[c]
            apart2 = weights @ ((H[b] - H[c]) ** 2 - noise2 * (gain2[b] - shared))
            # What chance gives: fits nearer than their windows' width have their noise in common.
            width = 2 * max(b[1], c[1]) + 1
            chance = noise2 * (weights @ gain2[b]) * np.sqrt(2 / kept.sum() + width**2 / total)
            bias[c] = max(bias[c], np.sqrt(max(apart2 - chance, 0.0)) - bias[b])

    def risk(c: tuple[int, int]) -> float:
        return float(
            np.nanmean(np.hypot(fits[c][:, kernel.GAIN] * fits[c][:, kernel.SIGMA], bias[c]))
        )  # one-sided ones too

    return min(fits, key=risk)


def _fits(wanted: Bools, run: Run, degree: int, rings: int) -> tuple[Floats, Ints, Ints]:
    """Results, degrees and rings of the first fits that are well conditioned and not too steep."""
    from quadcurv.kernels import jet as kernel

    out = np.full((wanted.size, kernel.COLUMNS), np.nan)
    degrees, grown = np.zeros((2, wanted.size), np.int32)
    most = np.full(wanted.size, rings + _GROWTH)  # rings until it is too steep
    todo = np.flatnonzero(wanted)
    for d in (d for d in (6, 4, 3, 2) if d <= degree):
        for r in (*range(rings, rings + _GROWTH + 1), *range(rings - 1, 0, -1)):
            at = todo[(most[todo] >= r) & ((r >= rings) | (most[todo] < rings))]
            if at.size == 0:
                continue
            fits = run(at, d, r)
            good = fits[:, kernel.CONDITION] <= _CONDITION[d]
            most[at[np.isnan(fits[:, kernel.CONDITION])]] = r - 1
            if at.size == wanted.size:
                out = fits
                out[~good] = np.nan
            else:
                out[at[good]] = fits[good]
            degrees[at[good]], grown[at[good]] = d, r
            todo = todo[degrees[todo] == 0]
    return out, degrees, grown


def _unpacked(out: Floats, degree: Ints, rings: Ints) -> Curvatures:
    from quadcurv.kernels import jet as kernel

    return Curvatures(
        mean=out[:, kernel.MEAN],
        gaussian=out[:, kernel.GAUSSIAN],
        k1=out[:, kernel.K1],
        k2=out[:, kernel.K2],
        direction1=out[:, kernel.DIRECTION1],
        direction2=out[:, kernel.DIRECTION2],
        normal=out[:, kernel.NORMAL],
        standard_error=StandardErrors(*(out[:, kernel.GAIN + k] * out[:, kernel.SIGMA] for k in range(4))),
        noise=out[:, kernel.SIGMA],
        degree=degree,
        rings=rings,
    )
