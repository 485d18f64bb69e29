"""Stencils whose rings are closed at the border, each in the best way there is."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.lines import NODES
from quadcurv.boundary.stars import Stars, fans, stars
from quadcurv.boundary.strips import Ghosts, ghosts
from quadcurv.boundary.surface import fitted
from quadcurv.stencils import Stencils
from quadcurv.types import Indices

OPEN, INTERIOR, EXTRAPOLATED, FITTED = 0, 1, 2, 3
REACH = NODES - 1  # faces from the border inward that closing it looks at


class Part(NamedTuple):
    """The faces near the border of a mesh: which vertices these are, and their stencils."""

    vertices: Indices
    stencils: Stencils


def border_part(given: Stencils) -> Part:
    """All that closing the border of a mesh looks at."""
    from quadcurv.kernels import topology

    border = np.flatnonzero(~given.closed)
    vertices, faces = topology.part_around(given.faces, border, given.n, REACH)
    closed = given.closed[vertices]
    return Part(vertices, Stencils(given.points[vertices], faces, closed.shape, closed, given.orientable))


def closed(given: Stencils) -> tuple[Stencils, NDArray[np.uint8]]:
    """Stencils of a face list with rings closed at the border, and what closes each."""
    treatment = np.where(given.closed, INTERIOR, OPEN).astype(np.uint8)
    if given.closed.all():
        return given, treatment
    vertices, part = border_part(given)
    layer = ghosts(part)
    star_of = _stars(part, layer)
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
    polygons = given.polygons
    if polygons is not None:
        face = np.pad(polygons.face, (0, len(table) - len(given.faces)), constant_values=-1)
        polygons = polygons._replace(corners=copies[polygons.corners].astype(np.int32), face=face)
    treated = replace(
        given, points=np.concatenate(points), faces=table, closed=treatment != OPEN, polygons=polygons
    )
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
        rows = begin + np.flatnonzero(error < layer.error[fan.vertex])
        begin += fan.vertex.size
        fan = fan.of(rows - (begin - fan.vertex.size))
        if fan.vertex.size:
            found += [(fan.vertex[at], star) for at, star in stars(part, fan, surfaces.of(rows))]
    return found
