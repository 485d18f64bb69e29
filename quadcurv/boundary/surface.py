"""Surfaces fitted at border vertices: polynomials of height over the tangent plane, through the vertex.

Least squares over rings of faces, which lie on one side only, with weights that fall with the distance. Which
degree, over as many rings, is best depends on the mesh: a high one follows the surface, a low one averages
noise. Taken is the one whose residuals, read as errors of the positions, do least harm beyond the border.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

RINGS = 5
# Degree and rings of fits; a corner of one triangle has points for all terms only with one ring more.
_FITS = ((5, 5), (4, 4), (3, 3), (2, 2), (3, 4), (2, 3))
ROOM = 128  # vertices of a neighbourhood
_CHUNK = 1024  # fits at a time
_CONDITION = 1e5
_SPREAD = 1.3  # radius at which weights vanish, of the neighbourhood's
_THIN = 1e-8  # of a neighbourhood's spread: no more than a line
_DETERMINED = 0.5  # error of points about the mirror images, in edges, from which on there is no surface
_STEEP = 0.45  # cosine between normals; where it is less, polynomials of several rings do not follow
_TERMS = [(a, d - a) for d in range(1, RINGS + 1) for a in range(d, -1, -1)]


class Surfaces(NamedTuple):
    """Polynomials z = sum of c x^a y^b over the tangent planes of vertices.

    Attributes
    ----------
    points : (k, 3) float64
        The vertices, where z = 0.
    frames : (k, 3, 3) float64
        Two tangents and the normal.
    maps : (k, 2, 2) float64
        From tangent coordinates to those, of unit size and spread, in which the polynomials are given.
    coefficients : (k, terms) float64
        In the order of `_TERMS`; NaN where none is determined.
    error : (k,) float64
        Of points about the mirror images of the first ring, estimated; infinite where none is determined.
    noise : (k,) float64
        Error of the positions, by the residuals.
    gain : (k,) float64
        Error of the mean curvature by such errors of size 1.
    around : (k, m) int32
        The vertex and those of the rings around it, -1 behind.
    ring : (k, m) uint8
        In which ring they are.
    """

    points: Floats
    frames: Floats
    maps: Floats
    coefficients: Floats
    error: Floats
    noise: Floats
    gain: Floats
    around: Ints
    ring: Ints

    def flat(self, positions: Floats) -> Floats:
        """Tangent coordinates (k, j, 2) of positions (k, j, 3)."""
        return np.einsum("kax,kjx->kja", self.frames[:, :2], positions - self.points[:, None])

    def lifted(self, x: Floats) -> Floats:
        """Points (k, j, 3) of the surfaces over tangent coordinates (k, j, 2), not finite where too far."""
        with np.errstate(over="ignore", invalid="ignore"):
            terms = _terms(np.einsum("kab,kjb->kja", self.maps, x), RINGS)
            z = np.einsum("kjt,kt->kj", terms, self.coefficients)
        local = np.concatenate((x, z[..., None]), axis=2)
        return np.einsum("kax,kja->kjx", self.frames, local) + self.points[:, None]

    def of(self, rows: Indices) -> Surfaces:
        """Some of them."""
        return Surfaces._make(values[rows] for values in self)


def fitted(stencils: Stencils, vertices: Indices) -> Surfaces:
    """Fit surfaces at vertices (k,) of a face list."""
    from quadcurv.kernels import nearby, topology

    indptr, corners = topology.corners_by_vertex(stencils.faces, len(stencils.points))
    around, ring = nearby.rings_around(stencils.faces, indptr, corners, vertices, RINGS, ROOM)
    size = _padded((around >= 0).sum(axis=1).max(initial=1))
    around, ring = around[:, :size], ring[:, :size]
    frames = _frames(_normals(stencils, vertices, around, ring))
    k = vertices.size
    chunks = [slice(begin, begin + _CHUNK) for begin in range(0, max(k, 1), _CHUNK)]
    fits = [_fits(stencils, frames[at], around[at], ring[at]) for at in chunks]
    maps, coefficients, noise, gain, bend = (np.concatenate(x) for x in zip(*fits, strict=True))
    # Residuals of the vertices near tell more than those of one, which may be few.
    place = np.full(len(stencils.points), -1)
    place[vertices] = np.arange(k)
    near = np.where((around >= 0) & (ring <= 2), place[around], -1)
    square = np.where((near >= 0)[..., None], noise[near] ** 2, np.nan)
    known = np.isfinite(square)
    shared = np.where(known, square, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    noise = np.where(np.isfinite(noise), np.sqrt(shared), np.inf)
    with np.errstate(invalid="ignore"):  # an infinite one times nothing is none
        error = np.where(np.isfinite(noise), noise * gain, np.inf)
    error = np.where(error < _DETERMINED * _distance(stencils, around, ring)[:, None], error, np.inf)
    best = np.arange(k), np.argmin(error, axis=1)
    chosen = [values[best] for values in (maps, coefficients, error, noise, bend)]
    return Surfaces._make((stencils.points[vertices], frames, *chosen, around, ring))


def _padded(size: int) -> int:
    """A width for so many neighbours, at which zeros behind them do not change how sums are rounded."""
    return int(-(-size // 16) * 16)


def _distance(stencils: Stencils, around: Ints, ring: Ints) -> Floats:
    """Mean distance (k,) of the first ring."""
    away = np.linalg.norm(stencils.points[around] - stencils.points[around[:, :1]], axis=2)
    return np.asarray(away.sum(axis=1, where=ring == 1) / np.maximum((ring == 1).sum(axis=1), 1))


def _normals(stencils: Stencils, vertices: Indices, around: Ints, ring: Ints) -> Floats:
    """Unit normals of open rings, or of their neighbours' where a ring has no area."""
    areas = stencils.ring_areas
    normal = areas[vertices]
    for k in np.flatnonzero(~normal.any(axis=1)):
        near = around[k][(ring[k] == 1) & (around[k] < stencils.n)]
        normal[k] = areas[near].sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _frames(normal: Floats) -> Floats:
    """Two tangents and the normal (k, 3, 3), without a branch (Duff et al. 2017)."""
    x, y, z = normal.T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (sign + z)
    b = x * y * a
    one = np.stack((1 + sign * x * x * a, sign * b, -sign * x), axis=1)
    return np.stack((one, np.stack((b, sign + y * y * a, -y), axis=1), normal), axis=1)


def _fits(
    stencils: Stencils, frames: Floats, around: Ints, ring: Ints
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Maps, coefficients, noise, its gain beyond the border and in H, all (k, fits, ...)."""
    x = stencils.points[around] - stencils.points[around[:, :1]]
    x = np.einsum("kax,kmx->kma", frames, x)
    known = (around >= 0) & (ring > 0)
    steep = _steep(stencils, frames[:, 2], around, known)
    shape = len(x), len(_FITS)
    maps, coefficients = np.full((*shape, 2, 2), np.nan), np.full((*shape, len(_TERMS)), np.nan)
    noise, gain, bend = np.full((3, *shape), np.nan)
    for d, (degree, rings) in enumerate(_FITS):
        inside = known & (ring <= rings)
        terms = (degree + 1) * (degree + 2) // 2 - 1
        fit = (inside.sum(axis=1) > terms) & np.isfinite(frames[:, 2, 0])
        if degree > 2:
            fit &= ~(steep & inside).any(axis=1)
        at = np.flatnonzero(fit)
        own, spread_out = _maps(x[at], inside[at])
        at, own = at[spread_out], own[spread_out]
        if at.size:
            m = _padded(inside[at].sum(axis=1).max() + 1)  # the rings come one after the other
            u = x[at, :m, :2] @ np.swapaxes(own, 1, 2)
            c, noise[at, d], gain[at, d], bend[at, d] = _fit(
                u, x[at, :m, 2], inside[at, :m], ring[at, :m] == 1, degree, own @ np.swapaxes(own, 1, 2)
            )
            maps[at, d], coefficients[at, d] = own, np.pad(c, [(0, 0), (0, len(_TERMS) - terms)])
    return maps, coefficients, noise, gain, bend


def _maps(x: Floats, inside: Bools) -> tuple[Floats, Bools]:
    """Linear maps that make the spread of points round and their distance 1 at most; whether there is any."""
    x = np.where(inside[..., None], x[..., :2], 0.0)
    size = np.abs(x).max(axis=(1, 2), initial=0.0)
    spread_out = size > 0
    x = x / np.where(spread_out, size, 1.0)[:, None, None]
    xx, xy, yy = (np.einsum("km,km->k", x[..., a], x[..., b]) for a, b in ((0, 0), (0, 1), (1, 1)))
    spread_out &= xx * yy - xy * xy > _THIN * xx * yy
    xx, xy, yy = (np.where(spread_out, v, w) for v, w in ((xx, 1.0), (xy, 0.0), (yy, 1.0)))
    # The inverse of the Cholesky factor of the second moments.
    one, other = 1 / np.sqrt(xx), 1 / np.sqrt(yy - xy * xy / xx)
    maps = np.zeros((len(x), 2, 2))
    maps[:, 0, 0], maps[:, 1, 0], maps[:, 1, 1] = one, -xy / xx * other, other
    distance = np.linalg.norm(np.einsum("kab,kmb->kma", maps, x), axis=2).max(axis=1, initial=0.0)
    return maps / np.where(spread_out, size * distance, 1.0)[:, None, None], spread_out


def _steep(stencils: Stencils, normal: Floats, around: Ints, known: Bools) -> Bools:
    """Which neighbours' normals are far from the vertex's."""
    areas = stencils.ring_areas
    inner = known & (around < len(areas))
    other = areas[np.where(inner, around, 0)]
    up = np.einsum("kmx,kx->km", other, normal)
    if not stencils.orientable:
        up = np.abs(up)
    return inner & (up < _STEEP * np.linalg.norm(other, axis=2))


def _terms(x: Floats, degree: int) -> Floats:
    """x^a y^b (..., terms) with 0 < a + b <= degree."""
    terms = np.empty((*x.shape[:-1], (degree + 1) * (degree + 2) // 2 - 1))
    terms[..., :2] = x
    for t, (a, b) in enumerate(_TERMS[2 : terms.shape[-1]], 2):  # a coordinate times one of less degree
        lower = (a - 1, b) if a else (a, b - 1)
        np.multiply(terms[..., _TERMS.index(lower)], x[..., int(not a)], out=terms[..., t])
    return terms


def _fit(
    u: Floats, z: Floats, inside: Bools, first: Bools, degree: int, metric: Floats
) -> tuple[Floats, Floats, Floats, Floats]:
    """Coefficients, noise by the residuals, what of it reaches mirror images of the first ring, and H."""
    r = np.where(inside, np.hypot(u[..., 0], u[..., 1]), 0.0)
    # Wendland's function: smooth, and zero from there on.
    weight = np.where(inside, (1 - r / _SPREAD) ** 4 * (4 * r / _SPREAD + 1), 0.0)
    terms = _terms(np.where(inside[..., None], u, 0.0), degree)
    q, upper = np.linalg.qr(terms * weight[..., None])
    diagonal = np.abs(np.diagonal(upper, axis1=1, axis2=2))
    regular = diagonal.min(axis=1) * _CONDITION > diagonal.max(axis=1)
    inverse = np.linalg.inv(np.where(regular[:, None, None], upper, np.eye(upper.shape[-1])))
    sizes = np.linalg.norm(upper, axis=(1, 2)), np.linalg.norm(inverse, axis=(1, 2))
    well = regular & (sizes[0] * sizes[1] < _CONDITION)
    z = np.where(inside, z, 0.0)
    from_heights = (inverse @ np.swapaxes(q, 1, 2)) * weight[:, None]
    coefficients = (from_heights @ z[..., None])[..., 0]
    residual = weight * (z - (terms @ coefficients[..., None])[..., 0])
    # The mean square of weighted residuals, for independent errors of one size.
    square = weight**2
    free = square.sum(axis=1) - ((q * q).sum(axis=2) * square).sum(axis=1)
    noise = np.sqrt((residual**2).sum(axis=1) / np.maximum(free, np.finfo(float).tiny))
    beyond = _terms(np.where(first[..., None], -u, 0.0)[:, : first.sum(axis=1).max() + 1], degree)
    gain = np.sqrt(((beyond @ from_heights) ** 2).sum(axis=(1, 2)) / first.sum(axis=1))
    second = np.zeros((len(u), terms.shape[2]))
    for t, (a, b) in (((2, 0), (0, 0)), ((1, 1), (0, 1)), ((0, 2), (1, 1))):
        second[:, _TERMS.index(t)] = metric[:, a, b]
    bend = np.linalg.norm(second[:, None] @ from_heights, axis=(1, 2))
    coefficients[~well] = noise[~well] = np.nan
    return coefficients, noise, gain, bend
