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
from quadcurv.types import Indices, Ints

OPEN, INTERIOR, EXTRAPOLATED, FITTED = 0, 1, 2, 3
REACH = NODES - 1  # faces from the border inward that closing it looks at


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
        border = np.union1d(border, _beside(given.faces, np.unique(pole[pole >= 0])))
    if border.size == 0:
        return given, treatment
    vertices, faces = topology.part_around(given.faces, border, given.n, REACH)
    part = Stencils(given.points[vertices], faces, vertices.shape, given.closed[vertices], given.orientable)
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
    treatment[vertices[extrapolated]] = EXTRAPOLATED
    centres = vertices[np.concatenate([rows for rows, _ in star_of] or [np.empty(0, np.int64)])]
    treatment[centres] = FITTED

    # Ghost quads around vertices that they close, over the points of the mesh and then the ghosts.
    n = len(given.points)
    near = np.concatenate((extrapolated, np.zeros(len(layer.points), bool)))
    quads = layer.quads[near[layer.quads].any(axis=1)]
    index = np.concatenate((vertices, n + np.arange(len(layer.points))))
    points, faces = [given.points, layer.points], [given.faces, index[quads]]
    # A star is no part of the mesh: there, copies take the places of centres.
    size = n + len(layer.points)
    copies = np.append(np.arange(size), -1)
    copies[centres] = size + np.arange(centres.size)
    points.append(given.points[centres])
    faces = [copies[f] for f in faces]
    size += centres.size
    for rows, star in star_of:
        k, extra = rows.size, len(star.points) - rows.size
        index = np.concatenate((vertices[rows], size + np.arange(extra), [-1]))
        points.append(star.points[k:])
        faces.append(index[star.faces])
        size += extra
    table = np.concatenate(faces).astype(np.int32)
    places = np.concatenate(points)
    lost = ~np.isfinite(places).all(axis=1)
    if lost.any():  # ghosts that overflow close nothing
        bad = np.append(lost, False)[table].any(axis=1)
        around = table[bad]
        around = around[(around >= 0) & (around < given.n)]
        treatment[around[treatment[around] > INTERIOR]] = OPEN
        places[lost], table = given.points[0], table[~bad | (np.arange(len(table)) < len(given.faces))]
    polygons = given.polygons
    if polygons is not None:
        face = np.pad(polygons.face, (0, len(table) - len(given.faces)), constant_values=-1)
        polygons = polygons._replace(corners=copies[polygons.corners].astype(np.int32), face=face)
    treated = replace(given, points=places, faces=table, closed=treatment != OPEN, polygons=polygons)
    return treated, treatment


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
            own, at = fan.of(kept), surfaces.of(begin + kept)
            found += [(own.vertex[rows], star) for rows, star in stars(part, own, at)]
        begin += fan.vertex.size
    return found


def _stars_at_poles(part: Stencils, layer: Ghosts, pole: Indices) -> list[tuple[Indices, Stars]]:
    """As `_stars`; of poles and the vertices beside them regular ones, in place of their narrow triangles."""
    poles = np.unique(pole[pole >= 0])
    beside = _beside(part.faces, poles)
    layer.error[beside], layer.smooth[beside] = np.inf, True
    found = _stars(part, layer)
    rows = np.union1d(beside, np.flatnonzero(pole >= 0))
    fit_at = np.where(pole[rows] >= 0, pole[rows], rows)
    at, own = np.unique(fit_at, return_inverse=True)
    surfaces = fitted(part, at)
    known = np.isfinite(surfaces.error[own])
    return [*found, (rows[known], regular_stars(part, surfaces.of(own[known])))]


def _beside(faces: Ints, poles: Indices) -> Indices:
    """Vertices of the faces at poles, these too."""
    near = np.unique(faces[np.isin(faces, poles).any(axis=1)])
    return near[near >= 0].astype(np.int64)
