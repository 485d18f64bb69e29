"""Sides of a grid, or parts of them, that are one point but for rounding: poles of a sphere, tips of patches.

Quads beside them are triangles, many and narrow, on which most schemes are far off or have no value. Both the
pole and the row beside it get their rings from fitted surfaces instead, without these triangles.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from quadcurv.boundary.closing import REACH
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, Indices, Ints

_POINT = 1e-9  # distance of such points, in distances to the next row
_LEAST = 3  # of such points: a quad with two corners at one place is no pole


def poles(grid: QuadGrid | StaggeredGrid) -> Indices | None:
    """The vertices of a grid, or corners of cells, that are at a pole: (r, c), the first one there, else -1.

    None if none is.
    """
    from quadcurv.kernels.border import all_apart

    if isinstance(grid, QuadGrid) and grid.mask is not None:
        return None
    points, apart = grid.points if isinstance(grid, QuadGrid) else grid.dual, 4 * _POINT + 32 * grid.roundoff
    return None if all_apart(points, grid.wrap, apart * apart) else _found(grid, points)


@np.errstate(all="ignore")
def _found(grid: QuadGrid | StaggeredGrid, points: Floats) -> Indices | None:
    found = None
    for axis in (0, 1):
        if grid.wrap[axis]:
            continue
        rows = np.moveaxis(points, axis, 0)
        for end in (0, -1):
            side, beside = rows[end], rows[1 if end == 0 else -2]
            step = np.linalg.norm(beside - side, axis=1)
            most = _POINT * step + 16 * grid.roundoff * np.abs(side).max()
            one = (np.abs(side - np.roll(side, -1, axis=0)).max(axis=1) <= most) & (most < 1e-3 * step)
            if not (grid.wrap[1 - axis] and isinstance(grid, QuadGrid)):
                one[-1] = False
            number = np.moveaxis(np.arange(points[..., 0].size).reshape(points.shape[:2]), axis, 0)[end]
            if one.any() and (pole := _of_runs(one, number)).max() >= 0:
                found = np.full(points.shape[:2], -1) if found is None else found
                of_side = np.moveaxis(found, axis, 0)[end]
                of_side[pole >= 0] = pole[pole >= 0]
    return found


def _of_runs(one: Bools, number: Indices) -> Indices:
    """The first number of each run of points that are one with the next, -1 for others."""
    size = one.size
    begin = 0 if one.all() else int(np.argmin(one)) + 1  # of a run, even across a seam
    order = (begin + np.arange(size)) % size
    goes_on = np.concatenate(([False], one[order][:-1]))
    run = np.cumsum(~goes_on) - 1
    first = number[order][~goes_on][run]
    pole = np.empty(size, np.int64)
    pole[order] = np.where(np.bincount(run)[run] >= _LEAST, first, -1)
    return pole


@np.errstate(all="ignore")
def poles_of_faces(stencils: Stencils) -> Indices | None:
    """Border vertices of a face list at a pole: (n,), the first one there, else -1; None if none is.

    Those are joined by edges of no length, at least three of them.
    """
    faces, points, n = stencils.faces, stencils.points, stencils.n
    if stencils.polygons is not None or stencils.closed.all():
        return None
    border = np.append(~stencils.closed, np.zeros(len(points) - n + 1, bool))
    faces = faces[np.count_nonzero(border[faces], axis=1) > 1]
    following = np.roll(faces, -1, axis=1)
    following = np.where(following < 0, faces[:, :1], following)
    row, slot = np.nonzero(border[faces] & border[following] & (faces >= 0))
    a, b = faces[row, slot], following[row, slot]
    size = np.abs(points[faces[row]] - points[a][:, None]).max(axis=2)
    size = np.where(faces[row] >= 0, size, 0.0).max(axis=1)
    most = _POINT * size + 16 * stencils.roundoff * np.abs(points[a]).max(axis=1)
    one = (np.abs(points[a] - points[b]).max(axis=1) <= most) & (most < 1e-3 * size)
    if not one.any():
        return None
    graph = scipy.sparse.coo_array((np.ones(one.sum(), bool), (a[one], b[one])), (n, n))
    _, of = scipy.sparse.csgraph.connected_components(graph, directed=False)
    _, first = np.unique(of, return_index=True)
    many = np.bincount(of)[of] >= _LEAST
    return np.where(many, first[of], -1) if many.any() else None


def welded_faces(stencils: Stencils, pole: Indices) -> Stencils:
    """Stencils of a face list with one vertex, and triangles, at each pole."""
    vertex = np.append(np.where(pole >= 0, pole, np.arange(pole.size)), -1).astype(np.int32)
    faces = vertex[stencils.faces]
    triangle = faces[:, 3] < 0
    a, b, c = faces[:, :3].T
    kept = np.concatenate(
        (_without_repetition(faces[~triangle]), faces[triangle & (a != b) & (b != c) & (c != a)])
    )
    return replace(stencils, faces=kept)


def welded(grid: QuadGrid, pole: Indices) -> tuple[Stencils, Indices]:
    """Stencils with one vertex and triangles at each pole; that vertex for each point of a pole, else -1."""
    vertex = np.where(pole >= 0, pole, np.arange(pole.size).reshape(pole.shape)).astype(np.int32)
    faces = grid_faces(np.pad(vertex, [(0, int(w)) for w in grid.wrap], mode="wrap"))
    given = grid.stencils()
    return replace(given, faces=_without_repetition(faces)), pole.ravel()


def parts_at_poles(grid: QuadGrid) -> list[tuple[Indices, QuadGrid, Bools]]:
    """Vertices of the rows near each pole, the grids of these, which of them are at or beside it."""
    near: list[tuple[Indices, QuadGrid, Bools]] = []
    pole = poles(grid)
    if pole is None:
        return near
    number = np.arange(pole.size).reshape(pole.shape)
    for axis in (0, 1):
        for end in (0, -1):
            side = np.moveaxis(pole, axis, 0)[end]
            at = (side >= 0) & ((side == np.roll(side, 1)) | (side == np.roll(side, -1)))
            if grid.wrap[axis] or not at.any():  # a pole's end is a corner of another side
                continue
            size = min(REACH + 3, grid.shape[axis])
            rows = slice(0, size) if end == 0 else slice(grid.shape[axis] - size, None)
            cut = (rows, slice(None)) if axis == 0 else (slice(None), rows)
            beside = np.zeros(number[cut].shape, bool)
            around = np.pad(at, 1, mode="wrap" if grid.wrap[1 - axis] else "constant")
            of_side = around[:-2] | around[1:-1] | around[2:]
            np.moveaxis(beside, axis, 0)[[0, 1] if end == 0 else [-1, -2]] = of_side
            wrap = [w and i != axis for i, w in enumerate(grid.wrap)]
            part = QuadGrid(grid.points[cut], wrap).with_roundoff(grid.roundoff)
            near.append((number[cut].ravel(), part, beside.ravel()))
    return near


def _without_repetition(faces: Ints) -> Ints:
    """Quads with an edge of no length as triangles; those without an area left out."""
    same = faces == np.roll(faces, -1, axis=1)
    first = np.where(same.any(axis=1), same.argmax(axis=1), 0)
    triangles = np.take_along_axis(faces, (np.arange(1, 5) + first[:, None]) % 4, axis=1)
    triangles[:, 3] = -1
    return np.where(same.any(axis=1)[:, None], triangles, faces)[same.sum(axis=1) < 2]
