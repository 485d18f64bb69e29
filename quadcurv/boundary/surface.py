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
    coefficients : (k, terms) float64
        Of x^a y^b in units of `radius`, in the order of `_TERMS`; NaN where none is determined.
    radius : (k,) float64
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
    coefficients: Floats
    radius: Floats
    error: Floats
    noise: Floats
    gain: Floats
    around: Ints
    ring: Ints

    def flat(self, positions: Floats) -> Floats:
        """Tangent coordinates (k, j, 2) of positions (k, j, 3)."""
        return np.einsum("kax,kjx->kja", self.frames[:, :2], positions - self.points[:, None])

    def lifted(self, x: Floats) -> Floats:
        """Points (k, j, 3) of the surfaces over tangent coordinates (k, j, 2)."""
        terms = _terms(x / self.radius[:, None, None], RINGS)
        z = np.einsum("kjt,kt->kj", terms, self.coefficients) * self.radius[:, None]
        local = np.concatenate((x, z[..., None]), axis=2)
        return np.einsum("kax,kja->kjx", self.frames, local) + self.points[:, None]

    def of(self, rows: Indices) -> Surfaces:
        """Some of them."""
        return Surfaces(*(values[rows] for values in self))


def fitted(stencils: Stencils, vertices: Indices) -> Surfaces:
    """Fit surfaces at vertices (k,) of a face list."""
    from quadcurv.kernels import nearby, topology

    indptr, corners = topology.corners_by_vertex(stencils.faces, len(stencils.points))
    around, ring = nearby.rings_around(stencils.faces, indptr, corners, vertices, RINGS, ROOM)
    size = int((around >= 0).sum(axis=1).max(initial=1))
    around, ring = around[:, :size], ring[:, :size]
    frames = _frames(_normals(stencils, vertices, around, ring))
    k = vertices.size
    coefficients = np.full((k, len(_FITS), len(_TERMS)), np.nan)
    radius, noise, gain, bend = np.full((4, k, len(_FITS)), np.nan)
    for begin in range(0, k, _CHUNK):
        at = slice(begin, begin + _CHUNK)
        fits = _fits(stencils, frames[at], around[at], ring[at])
        coefficients[at], radius[at], noise[at], gain[at], bend[at] = fits
    # Residuals of the vertices near tell more than those of one, which may be few.
    place = np.full(len(stencils.points), -1)
    place[vertices] = np.arange(k)
    near = np.where((around >= 0) & (ring <= 2), place[around], -1)
    square = np.where((near >= 0)[..., None], noise[near] ** 2, np.nan)
    known = np.isfinite(square)
    shared = np.where(known, square, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    noise = np.where(np.isfinite(noise), np.sqrt(shared), np.inf)
    error = np.where(np.isfinite(noise), noise * gain, np.inf)
    best = np.arange(k), np.argmin(error, axis=1)
    chosen = (values[best] for values in (coefficients, radius, error, noise, bend))
    return Surfaces(stencils.points[vertices], frames, *chosen, around, ring)


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
    """Coefficients (k, degrees, terms), radius, noise, its gain and that in H (k, degrees) of every degree."""
    x = stencils.points[around] - stencils.points[around[:, :1]]
    x = np.einsum("kax,kmx->kma", frames, x)
    known = (around >= 0) & (ring > 0)
    distance = np.hypot(x[..., 0], x[..., 1])
    steep = _steep(stencils, frames[:, 2], around, known)
    coefficients = np.full((len(x), len(_FITS), len(_TERMS)), np.nan)
    radius, noise, gain, bend = np.full((4, len(x), len(_FITS)), np.nan)
    for d, (degree, rings) in enumerate(_FITS):
        inside = known & (ring <= rings)
        r = distance.max(axis=1, where=inside, initial=0.0)
        terms = (degree + 1) * (degree + 2) // 2 - 1
        fit = (inside.sum(axis=1) > terms) & (r > 0)
        if degree > 2:
            fit &= ~(steep & inside).any(axis=1)
        if not fit.any():
            continue
        scaled = x[fit] / r[fit, None, None]
        c, sigma, gain[fit, d], curving = _fit(scaled, inside[fit], ring[fit] == 1, degree)
        coefficients[fit, d] = np.pad(c, [(0, 0), (0, len(_TERMS) - terms)])
        radius[fit, d], noise[fit, d], bend[fit, d] = r[fit], sigma * r[fit], curving / r[fit] ** 2
    return coefficients, radius, noise, gain, bend


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
    powers = np.stack([x**e for e in range(degree + 1)])
    terms = [powers[a, ..., 0] * powers[b, ..., 1] for a, b in _TERMS if a + b <= degree]
    return np.stack(terms, axis=-1)


def _fit(x: Floats, inside: Bools, first: Bools, degree: int) -> tuple[Floats, Floats, Floats, Floats]:
    """Coefficients, noise by the residuals, what of it reaches mirror images of the first ring, and H."""
    r = np.hypot(x[..., 0], x[..., 1])
    # Wendland's function: smooth, and zero from there on.
    weight = np.where(inside, (1 - r / _SPREAD) ** 4 * (4 * r / _SPREAD + 1), 0.0)
    terms = _terms(np.where(inside[..., None], x[..., :2], 0.0), degree)
    q, upper = np.linalg.qr(terms * weight[..., None])
    singular = np.linalg.svd(upper, compute_uv=False)
    well = singular[:, -1] * _CONDITION > singular[:, 0]
    inverse = np.linalg.inv(np.where(well[:, None, None], upper, np.eye(upper.shape[-1])))
    z = np.where(inside, x[..., 2], 0.0)
    coefficients = np.einsum("kts,kms,km->kt", inverse, q, weight * z, optimize=True)
    residual = weight * (z - np.einsum("kmt,kt->km", terms, coefficients))
    # The mean square of weighted residuals, for independent errors of one size.
    free = (weight**2).sum(axis=1) - np.einsum("kmt,km->k", q**2, weight**2)
    sigma = np.sqrt((residual**2).sum(axis=1) / np.maximum(free, np.finfo(float).tiny))
    beyond = _terms(np.where(first[..., None], -x[..., :2], 0.0)[:, : first.sum(axis=1).max() + 1], degree)
    spread = np.einsum("kjt,kts,kms,km->kjm", beyond, inverse, q, weight, optimize=True)
    gain = np.sqrt((spread**2).sum(axis=(1, 2)) / first.sum(axis=1))
    second = np.array([float(t in ((2, 0), (0, 2))) for t in _TERMS[: terms.shape[2]]])
    bend = np.linalg.norm(np.einsum("t,kts,kms,km->km", second, inverse, q, weight, optimize=True), axis=1)
    coefficients[~well] = sigma[~well] = np.nan
    return coefficients, sigma, gain, bend
