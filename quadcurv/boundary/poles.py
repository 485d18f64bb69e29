"""Sides of a grid that are one point but for rounding: the poles of a sphere, the tip of a triangular patch.

Quads beside them are triangles, many and narrow, on which most schemes are far off or have no value. Both the
pole and the row beside it get their rings from fitted surfaces instead, without these triangles.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.closing import REACH, closed
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Indices, Ints

_POINT = 1e-9  # extent of such a side, in distances to the next row


class Pole(NamedTuple):
    """A side that is one point: the first (end 0) or last (-1) row of an axis."""

    axis: int
    end: int


@np.errstate(all="ignore")
def poles(grid: QuadGrid | StaggeredGrid) -> list[Pole]:
    """The sides of a grid, or of the corners of its cells, that are one point."""
    found: list[Pole] = []
    points = grid.points if isinstance(grid, QuadGrid) else grid.dual
    if isinstance(grid, QuadGrid) and grid.mask is not None:
        return found
    for axis in (0, 1):
        if grid.wrap[axis]:
            continue
        rows = np.moveaxis(points, axis, 0)
        for end in (0, -1):
            side, beside = rows[end], rows[1 if end == 0 else -2]
            step = np.linalg.norm(beside[0] - side[0])
            most = _POINT * step + 16 * grid.roundoff * np.abs(side[0]).max()
            # One point first, which tells of nearly all grids that there is no more to look at.
            far = np.abs(side[len(side) // 2] - side[0]).max()
            if far <= most < 1e-3 * step and np.abs(side - side[0]).max() <= most:
                found.append(Pole(axis, end))
    return found


def welded(grid: QuadGrid, found: list[Pole]) -> tuple[Stencils, Indices]:
    """Stencils with one vertex and triangles at each pole; that vertex for each point of a pole, else -1."""
    vertex = np.arange(grid.shape[0] * grid.shape[1], dtype=np.int32).reshape(grid.shape)
    pole = np.full(grid.shape, -1)
    for axis, end in found:
        side = np.moveaxis(vertex, axis, 0)[end]
        side[...] = side[0]
        np.moveaxis(pole, axis, 0)[end] = side[0]
    faces = grid_faces(np.pad(vertex, [(0, int(w)) for w in grid.wrap], mode="wrap"))
    given = grid.stencils()
    return Stencils(given.points, _without_repetition(faces), given.shape, given.closed), pole.ravel()


def closed_grid(grid: QuadGrid, found: list[Pole]) -> tuple[Stencils, NDArray[np.uint8]]:
    """Stencils with closed rings, each point of a pole with the same one, and what closes each."""
    return closed(*welded(grid, found))


@np.errstate(all="ignore")
def parts_at_poles(grid: QuadGrid) -> list[tuple[Indices, QuadGrid, Bools]]:
    """Vertices of the rows near each pole, the grids of these, which of them are at or beside it."""
    near: list[tuple[Indices, QuadGrid, Bools]] = []
    found = poles(grid)
    if not found:
        return near
    number = np.arange(grid.shape[0] * grid.shape[1]).reshape(grid.shape)
    for axis, end in found:
        size = min(REACH + 3, grid.shape[axis])
        rows = slice(0, size) if end == 0 else slice(grid.shape[axis] - size, None)
        cut = (rows, slice(None)) if axis == 0 else (slice(None), rows)
        beside = np.zeros(number[cut].shape, bool)
        np.moveaxis(beside, axis, 0)[[0, 1] if end == 0 else [-1, -2]] = True
        wrap = [w and i != axis for i, w in enumerate(grid.wrap)]
        near.append((number[cut].ravel(), QuadGrid(grid.points[cut], wrap), beside.ravel()))
    return near


def _without_repetition(faces: Ints) -> Ints:
    """Quads with an edge of no length as triangles; those without an area left out."""
    same = faces == np.roll(faces, -1, axis=1)
    first = np.where(same.any(axis=1), same.argmax(axis=1), 0)
    triangles = np.take_along_axis(faces, (np.arange(1, 5) + first[:, None]) % 4, axis=1)
    triangles[:, 3] = -1
    return np.where(same.any(axis=1)[:, None], triangles, faces)[same.sum(axis=1) < 2]
