"""Polynomial fits over the neighbourhood of every vertex: "jets"."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from quadcurv.schemes.base import Curvatures, Fit, Neighbourhoods, StandardErrors
from quadcurv.schemes.chosen import POOLED, REACH, chosen, unpacked
from quadcurv.types import Bools, Floats, Indices, Ints

# Most that errors in height, of unit mean square, may grow to in the second derivatives, both in units of
# the neighbourhood's extent: inside 2, 3 and 10 by degree; at the sides of a grid, where rings beyond the
# least are needed, 5, 30 and 100.
_CONDITION = {2: 20.0, 3: 60.0, 4: 220.0, 6: 1000.0}
_RINGS = {2: 1, 3: 2, 4: 2, 6: 3}
_GROWTH = 3
_MOST_RINGS = 64

_REFERENCE = "Cazals and Pouget 2005"
# Vertices (k,), degree, rings -> results (k, COLUMNS).
Run = Callable[[Indices, int, int], Floats]


def jet(degree: int | None = None, rings: int | None = None) -> Fit:
    """Polynomial of height over the tangent plane, by least squares over rings of neighbours.

    Parameters
    ----------
    degree : {2, 3, 4, 6}, optional
        By default ("jet") chosen vertex by vertex, with rings and weights: where the surface is resolved a
        polynomial of degree 6 over three rings, over the nearest sphere or the plane, whichever leaves less,
        through the vertex and with weights that fall with the distance; where noise prevails plain least
        squares of degree 6, 4 or 2 over three to eight rings, those of the least noise and bias together,
        both estimated from residuals of neighbours; beside rough borders one-sided fits over more. Where
        points are smooth along the mesh's own lines, as those of structured grids are, polynomials of
        degree 8 in the number of the point through nine of each line, borders included.
    rings : int, optional
        Rings of faces around a vertex whose vertices are fitted, on a grid the window of
        (2 rings + 1)^2 points. By default 1 for degree 2, 3 for degree 6 and 2 for the others.

    Returns
    -------
    Fit
        The default's H is of order 8 on grids smooth in their numbers, else of order 6 where neighbourhoods
        are nearly symmetric and of order 5 elsewhere, exact on spheres, and ``Curvatures.interval`` has its
        error bars.
        With a degree, plain least squares as published: H of order 4 with degree 4, of order 6 with degree 6
        and of order 2 with the others where neighbourhoods are nearly symmetric, of order `degree` - 1
        elsewhere.
        Where the vertices of the rings do not determine the polynomial well, up to three more rings
        are taken, and if that does not help the degree is lowered. Where several rings are steeper than 2 : 1
        over the tangent plane, or fold over, fewer are taken. ``Curvatures.degree`` and ``.rings`` report
        all this; both are 0 where there is no result.
        With boundary="extrapolate" as many ghost layers as rings, if these are no more than three,
        are put around grids and face lists, by quintic extrapolation along strips of six points as
        :func:`quadcurv.one_rings` traces them; three layers are of degree seven, through eight points, where
        these are smooth. Borders are then as good as the inside. Fits are one-sided where a strip is rough
        or cannot be traced.

    Raises
    ------
    ValueError
        Any other degree, fewer than one ring, or rings without a degree.

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
        return Fit("jet", 8, _REFERENCE, chosen, REACH, POOLED)
    if not isinstance(degree, int) or degree not in _CONDITION:
        raise ValueError(f"degree: expected one of {tuple(_CONDITION)}, got {degree!r}")
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


def _fits(wanted: Bools, run: Run, degree: int, rings: int) -> tuple[Floats, Ints, Ints]:
    """Results, degrees and rings of the first fits that are well conditioned and not too steep."""
    from quadcurv.kernels import jet as kernel

    out = np.empty((0, kernel.COLUMNS))
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
                if not good.all():
                    out[~good] = np.nan
            else:
                out = out if len(out) else np.full((kernel.COLUMNS, wanted.size), np.nan).T
                out[at[good]] = fits[good]
            at = at[good]
            degrees[at], grown[at] = d, r
            todo = todo[degrees[todo] == 0]
    return out if len(out) else np.full((wanted.size, kernel.COLUMNS), np.nan), degrees, grown


def _unpacked(out: Floats, degree: Ints, rings: Ints) -> Curvatures:
    from quadcurv.kernels import jet as kernel

    return unpacked(
        out,
        standard_error=StandardErrors(*(out[:, kernel.GAIN + k] * out[:, kernel.SIGMA] for k in range(4))),
        noise=out[:, kernel.SIGMA],
        degree=degree,
        rings=rings,
    )
