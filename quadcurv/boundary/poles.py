"""Sides of a grid that are one point but for rounding: the poles of a sphere, the tip of a triangular patch.

Quads beside them are triangles, many and narrow, on which most schemes are far off or have no value. Both the pole
and the row beside it get their rings from fitted surfaces instead, without these triangles.
"""

from __future__ import annotations

import numpy as np

from quadcurv.mesh import QuadGrid
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, Indices, Ints

_POINT = 1e-9  # extent of such a side, in distances to the next row


def poles(grid: QuadGrid) -> list[tuple[int, int]]:
    """Axis and end, 0 or -1, of the sides of a grid that are one point."""
    found = []
    for axis in (0, 1):
        if grid.wrap[axis] or grid.mask is not None:
            continue
        rows = np.moveaxis(grid.points, axis, 0)
        for end, inner in ((0, 1), (-1, -2)):
            side, step = rows[end], np.linalg.norm(rows[inner, 0] - rows[end, 0])
            most = _POINT * step + 16 * grid.roundoff * np.abs(side[0]).max()
            # One point first, which tells of nearly all grids that there is no more to look at.
            if np.abs(side[len(side) // 2] - side[0]).max() <= most < 1e-3 * step:
                if np.abs(side - side[0]).max() <= most:
                    found.append((axis, end))
    return found


def beside_poles(grid: QuadGrid, found: list[tuple[int, int]]) -> Bools:
    """(r, c): poles and the rows beside them."""
    beside = np.zeros(grid.shape, bool)
    for axis, end in found:
        np.moveaxis(beside, axis, 0)[[end, 1 if end == 0 else -2]] = True
    return beside


def welded(grid: QuadGrid, found: list[tuple[int, int]]) -> tuple[Stencils, Indices]:
    """Stencils with one vertex for each pole, triangles around it; the vertex of every point, flat."""
    vertex = np.arange(grid.shape[0] * grid.shape[1], dtype=np.int32).reshape(grid.shape)
    for axis, end in found:
        side = np.moveaxis(vertex, axis, 0)[end]
        side[...] = side[0]
    faces = grid_faces(np.pad(vertex, [(0, int(w)) for w in grid.wrap], mode="wrap"))
    faces = _without_repetition(faces)
    given = grid.stencils()
    return Stencils(given.points, faces, given.shape, given.closed), vertex.ravel().astype(np.int64)


def _without_repetition(faces: Ints) -> Ints:
    """Quads with an edge of no length as triangles; those without an area left out."""
    same = faces == np.roll(faces, -1, axis=1)
    first = np.where(same.any(axis=1), same.argmax(axis=1), 0)
    turned = np.take_along_axis(faces, (np.arange(1, 5) + first[:, None]) % 4, axis=1)
    triangles = turned.copy()
    triangles[:, 3] = -1
    return np.where(same.any(axis=1)[:, None], triangles, faces)[same.sum(axis=1) < 2]


def spread(values: Floats, vertex: Indices) -> None:
    """Give all points of a pole, in place, the value of its vertex."""
    values[...] = values[vertex]
