"""What of a mesh is drawn, and from where it is seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from quadcurv.mesh import Mesh, QuadGrid, StaggeredGrid
from quadcurv.types import Floats, Ints

OVERLAYS = {"boundary": "#000000", "seam": "#e69f00", "valence < 4": "#56b4e9", "valence > 4": "#d55e00"}
"""What can be marked on a surface, and its colour."""


class Drawn(NamedTuple):
    """Points and faces, (m, 4) with -1 behind triangles, to draw.

    Values of a mesh or grid belong to its points; those of a staggered grid to its cells: `on_cells`.
    """

    points: Floats
    faces: Ints
    on_cells: bool


def drawn(mesh: Mesh) -> Drawn:
    """Of a staggered grid its cells, of all else the faces as they are.

    What a grid has no point for lies at a point that it has, and in no face.
    """
    if isinstance(mesh, StaggeredGrid):
        cells = QuadGrid(mesh.dual).stencils()
        return Drawn(cells.points, cells.faces, True)
    stencils = mesh.stencils()
    if not isinstance(mesh, QuadGrid) or mesh.mask is None:
        return Drawn(stencils.points, stencils.faces, False)
    place = np.flatnonzero(~mesh.mask.ravel()).astype(np.int32)
    points = np.tile(stencils.points[0], (mesh.mask.size, 1))
    points[place] = stencils.points
    return Drawn(points, np.where(stencils.faces < 0, -1, place[stencils.faces]), False)


def overlays(mesh: Mesh) -> dict[str, Ints]:
    """Edges (k, 2) of the boundary and of seams, vertices (k,) of too few and too many faces.

    Extraordinary vertices are interior ones of a valence other than 4; a staggered grid, made of cells,
    has none. Seams are where a grid wraps, and where two edges of the boundary lie at the same place, as
    along a fold. What a mesh has none of is left out.
    """
    points, faces, on_cells = drawn(mesh)
    sides = np.where(faces[:, 3] < 0, 3, 4)
    face, slot = np.nonzero(np.arange(4) < sides[:, None])
    ends = np.stack((faces[face, slot], faces[face, (slot + 1) % sides[face]])).astype(np.int64)
    ends.sort(axis=0)
    key, count = np.unique(ends[0] * len(points) + ends[1], return_counts=True)
    edges = np.stack(np.divmod(key, len(points)), axis=1).astype(np.int32)
    interior = np.ones(len(points), bool)
    border = edges[count == 1]
    interior[border] = False
    middles = points[border].mean(axis=1)
    gap = cKDTree(middles).query(middles, k=2)[0][:, 1]
    meets = gap < 1e-9 * np.ptp(points, axis=0).max()
    seams = border[meets]
    if isinstance(mesh, QuadGrid):
        index = np.arange(len(points), dtype=np.int32).reshape(mesh.shape)
        along = [line for line, wraps in ((index[0], mesh.wrap[0]), (index[:, 0], mesh.wrap[1])) if wraps]
        seams = np.concatenate([seams, *(np.stack((line[:-1], line[1:]), axis=1) for line in along)])
        if mesh.mask is not None:
            seams = seams[~mesh.mask.ravel()[seams].any(axis=1)]
    valence = np.full(len(points), 4) if on_cells else np.bincount(faces[faces >= 0], minlength=len(points))
    marks = {
        "boundary": border[~meets],
        "seam": seams,
        "valence < 4": np.flatnonzero(interior & (valence < 4) & (valence > 0)).astype(np.int32),
        "valence > 4": np.flatnonzero(interior & (valence > 4)).astype(np.int32),
    }
    return {name: vertices for name, vertices in marks.items() if len(vertices)}


def viewpoint(points: Floats, camera: tuple[float, float, float] | None = None) -> tuple[Floats, Floats]:
    """Unit vectors towards the viewer and up.

    By default at an angle to the least extent. Up is y where that can be, else z; with a `camera`, the
    direction towards the viewer, the one of them that is farther from it.
    """
    extent = np.ptp(points, axis=0)
    depth = int(np.argmin(np.minimum(extent, 0.8 * extent.max())))  # above that all count as equal
    up = 2 if depth == 1 else 1
    if camera is None:
        towards = np.zeros(3)
        towards[[depth, up, 3 - depth - up]] = 1.0, 0.45, 0.55
    else:
        towards = np.array(camera, float)
        if abs(towards[up]) > 0.95 * np.linalg.norm(towards):
            up = 3 - up
    return towards / np.linalg.norm(towards), np.eye(3)[up]
