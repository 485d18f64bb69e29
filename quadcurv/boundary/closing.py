"""Stencils whose rings are closed at the border, each in the best way there is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.lines import NODES
from quadcurv.boundary.stars import Stars, fans, regular_stars, stars
from quadcurv.boundary.strips import Ghosts, ghosts
from quadcurv.boundary.surface import fitted
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

OPEN, INTERIOR, EXTRAPOLATED, FITTED = 0, 1, 2, 3
REACH = NODES - 1  # faces from the border inward that closing it looks at
SPREAD = 6  # faces from a pole within which others as skew are looked for
_SKEW = 0.35  # sine of an angle


@np.errstate(all="ignore")  # what overflows, or has no length, is NaN and has no ghosts
def closed(given: Stencils, pole: Indices | None = None) -> tuple[Stencils, NDArray[np.uint8]]:
    """Stencils with rings closed at the border of a face list, and what closes each.

    With `pole` (n,), the vertex that stands for all at the place of a pole, -1 for others, rings at poles and
    beside them are closed anew by fitted surfaces.
    """
    from quadcurv.kernels import topology

    treatment = np.where(given.closed, INTERIOR, OPEN).astype(np.uint8)
    border = np.flatnonzero(~given.closed)
    if pole is not None:
        border = np.union1d(border, beside_poles(given.points, given.faces, np.unique(pole[pole >= 0])))
    if border.size == 0:
        return given, treatment
    vertices, faces = topology.part_around(given.faces, border, given.n, REACH)
    part = given.part(vertices, faces)
    layer = ghosts(part)
    if pole is None:
        star_of = _stars(part, layer)
    else:
        place = np.full(given.n + 1, -1)
        place[vertices] = np.arange(vertices.size)
        star_of = _stars_at_poles(part, layer, place[pole[vertices]])
    extrapolated = np.isfinite(layer.error)
    for rows, _ in star_of:
        extrapolated[rows] = False
        treatment[vertices[rows]] = FITTED
    treatment[vertices[extrapolated]] = EXTRAPOLATED

    # Ghost quads around vertices that they close, over the points of the mesh and then the ghosts.
    near = np.concatenate((extrapolated, np.zeros(len(layer.points), bool)))
    quads = layer.quads[near[layer.quads].any(axis=1)]
    index = np.concatenate((vertices, len(given.points) + np.arange(len(layer.points))))
    treated = _joined(given, layer.points, index[quads], treatment != OPEN)
    treated = with_stars(treated, [(vertices[rows], star) for rows, star in star_of])
    treatment[~treated.closed] = OPEN
    return treated, treatment


def with_stars(given: Stencils, star_of: list[tuple[Indices, Stars]]) -> Stencils:
    """Stencils with stars in place of the rings of some vertices."""
    if not star_of:
        return given
    # A star is no part of the mesh: there, copies take the places of centres.
    n, centres = len(given.points), np.concatenate([rows for rows, _ in star_of])
    copies = np.append(np.arange(n), -1)
    copies[centres] = n + np.arange(centres.size)
    points, faces, size = [given.points[centres]], [], n + centres.size
    for rows, star in star_of:
        extra = len(star.points) - rows.size
        index = np.concatenate((rows, size + np.arange(extra), [-1]))
        points.append(star.points[rows.size :])
        faces.append(index[star.faces])
        size += extra
    polygons = given.polygons
    if polygons is not None:
        polygons = polygons._replace(corners=copies[polygons.corners].astype(np.int32))
    own = replace(given, faces=copies[given.faces].astype(np.int32), polygons=polygons)
    closed = given.closed.copy()
    closed[centres] = True
    return _joined(own, np.concatenate(points), np.concatenate(faces), closed)


def _joined(given: Stencils, points: Floats, faces: Indices, closed: Bools) -> Stencils:
    """Stencils with more points, and faces of them that close rings."""
    lost = np.concatenate((np.zeros(len(given.points), bool), ~np.isfinite(points).all(axis=1), [False]))
    if lost.any():  # what overflows closes nothing
        bad = lost[faces].any(axis=1)
        opened = faces[bad]
        closed[opened[(opened >= 0) & (opened < given.n)]] = False
        points, faces = np.where(lost[len(given.points) : -1, None], given.points[0], points), faces[~bad]
    polygons = given.polygons
    if polygons is not None:
        polygons = polygons._replace(face=np.pad(polygons.face, (0, len(faces)), constant_values=-1))
    return replace(
        given,
        points=np.concatenate((given.points, points)),
        faces=np.concatenate((given.faces, faces.astype(np.int32).reshape(-1, 4))),
        closed=closed,
        polygons=polygons,
    )


def _stars(part: Stencils, layer: Ghosts) -> list[tuple[Indices, Stars]]:
    """Stars of the vertices where a fitted surface is nearer than the ghosts of strips."""
    groups = [fan.of(np.flatnonzero(~layer.smooth[fan.vertex])) for fan in fans(part)]
    groups = [fan for fan in groups if fan.vertex.size]
    if not groups:
        return []
    surfaces = fitted(part, np.concatenate([fan.vertex for fan in groups]))
    found, begin = [], 0
    for fan in groups:
        error = surfaces.error[begin : begin + fan.vertex.size]
        kept = np.flatnonzero(error < layer.error[fan.vertex])
        if kept.size:
            own = fan.of(kept)
            found.append((own.vertex, stars(part, own, surfaces.of(begin + kept))))
        begin += fan.vertex.size
    return found


def _stars_at_poles(part: Stencils, layer: Ghosts, pole: Indices) -> list[tuple[Indices, Stars]]:
    """As `_stars`; of poles and the vertices beside them regular ones, in place of their narrow triangles."""
    from quadcurv.kernels import topology

    poles = np.unique(pole[pole >= 0])
    beside = beside_poles(part.points, part.faces, poles)
    layer.error[beside], layer.smooth[beside] = np.inf, True
    found = _stars(part, layer)
    rows = np.union1d(beside, np.flatnonzero(pole >= 0))
    fit_at = np.where(pole[rows] >= 0, pole[rows], rows)
    at, own = np.unique(fit_at, return_inverse=True)
    surfaces = fitted(part, at)
    indptr, corners = topology.corners_by_vertex(part.faces, len(part.points))
    kind = topology.order_rings(part.faces, indptr, corners, at)[0][at]
    known = np.isfinite(surfaces.error) & (kind != topology.SEVERAL_FANS)
    known = known[own]
    return [*found, (rows[known], regular_stars(part, surfaces.of(own[known])))]


def beside_poles(points: Floats, faces: Ints, poles: Indices) -> Indices:
    """Vertices of the faces at poles, these too, and of those beyond that are as skew.

    Past the end of a pole on a part of a side rows and columns run along each other.
    """
    at = np.zeros(len(points) + 1, bool)  # the last one is read by the -1 of triangles
    at[poles] = True
    spread = np.ones(len(faces), bool)
    for step in range(SPREAD):
        near = faces[spread & at[faces].any(axis=1)]
        at[near] = True
        at[-1] = False
        if step == 0:
            spread = skew(points[faces]) & (faces[:, 3] >= 0)
    return np.flatnonzero(at[:-1])


def skew(corners: Floats) -> Bools:
    """Whether two edges of quads (..., 4, 3) run along each other."""
    ahead = np.roll(corners, -1, axis=-2) - corners
    behind = np.roll(ahead, 1, axis=-2)
    return np.asarray(narrow(ahead, behind).any(axis=-1))


def narrow(a: Floats, b: Floats) -> Bools:
    """Whether vectors (..., 3) run along each other, or against."""
    lengths = np.linalg.norm(a, axis=-1) * np.linalg.norm(b, axis=-1)
    return np.asarray(np.linalg.norm(np.cross(a, b), axis=-1) < _SKEW * lengths)
