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
_TURN = 5  # triangles, of which quads are two, around a vertex with points on nearly all sides
# Error of points about the mirror images, in edges, or of the mean curvature, in their inverse, from which on
# there is no surface.
_DETERMINED = 0.5
_BIAS = 2.0  # times as much harm as noise what a surface misses of the points does beyond them
_ENOUGH = 28  # points of a quartic, which has 14 terms
_FREE = 0.5  # how far a mirror image must be from all points, in distances of points from their nearest


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
        In the order of `kernels.surfaces.TERMS`; NaN where none is determined.
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
        from quadcurv.kernels import surfaces as kernel

        with np.errstate(over="ignore", invalid="ignore"):
            z = kernel.lifted(self.maps, self.coefficients, x)
        local = np.concatenate((x, z[..., None]), axis=2)
        return np.einsum("kax,kja->kjx", self.frames, local) + self.points[:, None]

    def mirrored(self, points: Floats, rings: int) -> Floats:
        """Points (k, m, 3) of rings, and their mirror images through the vertex where there is room.

        The vertex first; NaN behind.
        """
        from quadcurv.kernels import surfaces as kernel

        given = self.around, self.ring, rings, self.frames, self.maps, self.coefficients
        return np.asarray(kernel.mirrored(points, *given, _FREE))

    def of(self, rows: Indices) -> Surfaces:
        """Some of them."""
        return Surfaces._make(values[rows] for values in self)


class Trials(NamedTuple):
    """Polynomials of several degrees at vertices, of which `fitted` chooses.

    Attributes
    ----------
    around, ring, frames
        As those of `Surfaces`, ROOM wide.
    found : (k, fits, RESULTS) float64
        See `kernels.surfaces.fits`.
    """

    around: Ints
    ring: Ints
    frames: Floats
    found: Floats

    def of(self, rows: Indices) -> Trials:
        """Some of them."""
        return Trials._make(values[rows] for values in self)

    def and_(self, others: Trials) -> Trials:
        """These and others."""
        return Trials._make(np.concatenate((self[i], others[i])) for i in range(len(self)))


def trials(stencils: Stencils, vertices: Indices, corners: tuple[Indices, Ints] | None = None) -> Trials:
    """Fit surfaces of all degrees at vertices (k,) of a face list; its `corners` by vertex may be known."""
    from quadcurv.kernels import nearby, topology
    from quadcurv.kernels import surfaces as kernel

    indptr, of_vertex = corners or topology.corners_by_vertex(stencils.faces, len(stencils.points))
    around, ring = nearby.rings_around(stencils.faces, indptr, of_vertex, vertices, RINGS, ROOM)
    near, of = _filled(around, ring)
    frames = tangent_frames(_normals(stencils, vertices, near, of))
    given = stencils.points, stencils.ring_areas, stencils.orientable, near, of, frames
    return Trials(around, ring, frames, kernel.fits(*given, *zip(*_FITS, strict=True)))


def _filled(around: Ints, ring: Ints) -> tuple[Ints, Ints]:
    """Without the columns behind all neighbourhoods."""
    size = int((around >= 0).sum(axis=1).max(initial=1))
    return around[:, :size], ring[:, :size]


def fitted(stencils: Stencils, vertices: Indices, tried: Trials | None = None) -> Surfaces:
    """Fit surfaces at vertices (k,) of a face list, which may have been `tried`."""
    from quadcurv.kernels import nearby
    from quadcurv.kernels import surfaces as kernel

    around, ring, frames, found = tried or trials(stencils, vertices)
    around, ring = _filled(around, ring)
    k = vertices.size
    noise, gain = found[..., kernel.NOISE], found[..., kernel.GAIN]
    # Residuals of the vertices near tell more than those of one, which may be few.
    place = np.full(len(stencils.points), -1)
    place[vertices] = np.arange(k)
    near = np.where((around >= 0) & (ring <= 2), place[around], -1)
    indptr = np.concatenate(([0], np.cumsum((near >= 0).sum(axis=1))))
    shared = nearby.means(indptr, near[near >= 0], noise**2)
    own, noise = noise, np.where(np.isfinite(noise), np.sqrt(shared), np.inf)
    with np.errstate(invalid="ignore"):  # an infinite one times nothing is none
        error = np.where(np.isfinite(noise), _with_bias(noise, (around >= 0).sum(axis=1)) * gain, np.inf)
    distance = _distance(stencils, around, ring)[:, None]
    known = _wide(stencils, around, ring)[:, None] & (error < _DETERMINED * distance)
    with np.errstate(invalid="ignore"):
        known &= np.maximum(own, noise) * found[..., kernel.BEND] * distance < _DETERMINED
    error = np.where(known, error, np.inf)
    best = np.arange(k), np.argmin(error, axis=1)
    found = found[best]
    maps = found[:, kernel.MAP : kernel.COEFFICIENTS].reshape(k, 2, 2)
    coefficients = found[:, kernel.COEFFICIENTS : kernel.NOISE]
    chosen = maps, coefficients, error[best], noise[best], found[:, kernel.BEND]
    return Surfaces._make((stencils.points[vertices], frames, *chosen, around, ring))


def _with_bias(noise: Floats, number: Indices) -> Floats:
    """Errors of the positions (k, fits): of enough points, what a quartic leaves is all that is by chance."""
    quartic = _FITS.index((4, 4))
    few = (np.array(_FITS)[:, 0] < 4) & (number >= _ENOUGH)[:, None]
    least = np.minimum(noise, noise[:, quartic : quartic + 1])
    return np.where(few, np.sqrt(least**2 + _BIAS**2 * (noise**2 - least**2)), noise)


def wide(stencils: Stencils) -> Bools:
    """(n,): vertices with points on all sides, or all but a quarter of a turn: three rows in any direction.

    Strips of faces one wide have none, and tell nothing of the curvature across them.
    """
    from quadcurv.kernels import topology

    faces, open_ = stencils.faces, np.flatnonzero(~stencils.closed)
    faces = faces[topology.surroundings(faces, open_, len(stencils.points), 1)]
    corners = np.where(faces[:, 3:] < 0, 1, 2) * (faces >= 0)
    turn = np.bincount(np.abs(faces).ravel(), corners.ravel(), len(stencils.points))
    return np.asarray(stencils.closed | (turn[: stencils.n] >= _TURN))


def _wide(stencils: Stencils, around: Ints, ring: Ints) -> Bools:
    """Whether there are such vertices within two rings; cells have corners on either side."""
    if len(stencils.points) > stencils.n:
        return np.ones(len(around), bool)
    return np.asarray((wide(stencils)[around] & (around >= 0) & (ring <= 2)).any(axis=1))


def _distance(stencils: Stencils, around: Ints, ring: Ints) -> Floats:
    """Mean distance (k,) of the first ring."""
    first = ring == 1
    around, first = (x[:, : int(np.sum(ring <= 1, axis=1).max(initial=1))] for x in (around, first))
    away = np.linalg.norm(stencils.points[around] - stencils.points[around[:, :1]], axis=2)
    return np.asarray(away.sum(axis=1, where=first) / np.maximum(first.sum(axis=1), 1))


def _normals(stencils: Stencils, vertices: Indices, around: Ints, ring: Ints) -> Floats:
    """Unit normals of open rings, or of their neighbours' where a ring has no area."""
    areas = stencils.ring_areas
    normal = areas[vertices]
    without = np.flatnonzero(~normal.any(axis=1))
    if without.size:
        near = (ring[without] == 1) & (around[without] < stencils.n)
        normal[without] = areas[np.where(near, around[without], 0)].sum(axis=1, where=near[..., None])
    with np.errstate(divide="ignore", invalid="ignore"):
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def tangent_frames(normal: Floats) -> Floats:
    """Two tangents and the unit normal (k, 3, 3), without a branch (Duff et al. 2017)."""
    x, y, z = normal.T
    sign = np.where(z >= 0, 1.0, -1.0)
    a = -1 / (sign + z)
    b = x * y * a
    one = np.stack((1 + sign * x * x * a, sign * b, -sign * x), axis=1)
    return np.stack((one, np.stack((b, sign + y * y * a, -y), axis=1), normal), axis=1)
