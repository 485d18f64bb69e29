"""What of a mesh is drawn, and from where it is seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from quadcurv.mesh import Mesh, QuadGrid, StaggeredGrid
from quadcurv.types import Floats, Indices, Ints

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


def thinned(whole: Drawn, most: int) -> tuple[Drawn, Indices, Indices]:
    """Fewer points and faces: in every cube of space one point stands for all, that next to their mean.

    Returns
    -------
    shape : Drawn
        Of at most that many points, those without a face left out, and of the faces with corners in three
        cubes or more, each once.
    kept : (k,) int64
        The points that are left or, where values belong to cells, the faces.
    place : (n,) int64
        To which of the points that are left each went, -1 of those without a face.
    """
    points, faces, on_cells = whole
    used = np.unique(faces[faces >= 0])
    x = points[used] - points[used].min(axis=0)
    side = np.linalg.norm(np.ptp(x, axis=0)) / max(most, 1) ** 0.5
    while True:
        cubes, cube = np.unique(np.floor(x / (side or 1.0)).astype(np.int64), axis=0, return_inverse=True)
        if len(cubes) <= max(most, 1):
            break
        side *= 1.1
    cube = cube.ravel()
    mean = np.stack([np.bincount(cube, axis) for axis in x.T], axis=1) / np.bincount(cube)[:, None]
    nearest = np.argsort(np.linalg.norm(x - mean[cube], axis=1), kind="stable")
    stands = used[nearest[np.unique(cube[nearest], return_index=True)[1]]]
    place = np.full(len(points), -1, np.int64)
    place[used] = cube
    corners = place[np.where(faces < 0, faces[:, 2:3], faces)]
    apart = corners != np.roll(corners, 1, axis=1)
    sides = apart.sum(axis=1)
    crossed = (corners[:, 0] == corners[:, 2]) | (corners[:, 1] == corners[:, 3])
    left = np.flatnonzero((sides == 3) | ((sides == 4) & ~crossed))
    first = np.argsort(~apart[left], axis=1, kind="stable")
    corners = np.take_along_axis(corners[left], first, axis=1)
    corners[:, 3] = np.where(sides[left] == 3, -1, corners[:, 3])
    once = np.sort(np.unique(np.sort(corners, axis=1), axis=0, return_index=True)[1])
    shape = Drawn(points[stands], corners[once].astype(np.int32), on_cells)
    return shape, (left[once] if on_cells else stands).astype(np.int64), place


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
