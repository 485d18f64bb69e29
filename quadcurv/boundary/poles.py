"""Sides of a mesh, or parts of them, that are one point or nearly: poles of a sphere, tips of patches.

Quads beside them are triangles, many and narrow, and past the end of a pole skew, on which most schemes are
far off or have no value. Both the pole and what is beside it get their rings from fitted surfaces instead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy

from quadcurv.boundary.closing import REACH, SPREAD, beside_poles, narrow
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, Indices, Ints

# Distance of such points from each other, in distances to the next row, and in those of the points there. A
# side not as short as that is narrow, no more, and of one much shorter the surface is known at one point.
_POINT, _FAN = 0.03, 0.25
_STEPS = 10.0 ** np.arange(0, -8, -1)  # how much nearer than that they are sought: others may be near, too
_LEAST = 3  # of such points: a quad with two corners at one place is no pole


def poles(grid: QuadGrid | StaggeredGrid) -> Indices | None:
    """The vertices of a grid, or corners of cells, that are at a pole: (r, c), the first one there, else -1.

    None if none is.
    """
    from quadcurv.kernels.border import all_apart

    if isinstance(grid, QuadGrid) and grid.mask is not None:
        return None
    points = grid.points if isinstance(grid, QuadGrid) else grid.dual
    if all_apart(points, grid.wrap, 2 * _POINT, 32 * grid.roundoff):
        return None
    number = np.arange(points[..., 0].size).reshape(points.shape[:2])
    sides = []
    for axis in (0, 1):
        if grid.wrap[axis]:
            continue
        rows = np.moveaxis(number, axis, 0)
        for end, beside in ((0, 1), (-1, -2)):
            side = np.stack((rows[end], np.roll(rows[end], -1), rows[beside], np.roll(rows[beside], -1)))
            sides.append(side if grid.wrap[1 - axis] and isinstance(grid, QuadGrid) else side[:, :-1])
    a, b, beside_a, beside_b = np.concatenate(sides, axis=1)
    found = _at_one_place(points.reshape(-1, 3), a, b, beside_a, beside_b, grid.roundoff)
    return None if found is None else found.reshape(number.shape)


@np.errstate(all="ignore")
def _at_one_place(
    points: Floats, a: Indices, b: Indices, beside_a: Indices, beside_b: Indices, roundoff: float
) -> Indices | None:
    """Vertices at one place, joined by edges (a, b) of the border: (n,), the first one of each, else -1.

    `beside_a` and `beside_b` are the vertices inward from each edge.
    """
    edge = np.abs(points[b] - points[a]).max(axis=1)
    step = np.linalg.norm(points[beside_a] - points[a], axis=1)
    rounding = 16 * roundoff * np.abs(points[a]).max(axis=1)
    vertices, ends = np.unique(np.concatenate((a, b)), return_inverse=True)
    begins, ends = ends.reshape(2, -1)
    found = np.full(vertices.size, -1)
    for nearer in _STEPS:
        one = (edge <= nearer * _POINT * step + rounding) & (rounding < 1e-3 * step)
        one &= (found[begins] < 0) & (found[ends] < 0)
        if not one.any():
            break
        u, v = begins[one], ends[one]
        graph = scipy.sparse.coo_array((np.ones(u.size, bool), (u, v)), (found.size, found.size))
        _, of = scipy.sparse.csgraph.connected_components(graph, directed=False)
        _, first, number = np.unique(of, return_index=True, return_counts=True)
        # How far apart they are, how far those beside them, and the least distance between.
        size, fan, rounded = np.zeros((3, number.size))
        inward = np.full(number.size, np.inf)
        begin = np.full(number.size, -1)
        begin[of[u[::-1]]] = beside_a[one][::-1]
        for end, other in ((a[one], beside_a[one]), (b[one], beside_b[one])):
            at_first = points[vertices[first[of[u]]]]
            np.maximum.at(size, of[u], np.linalg.norm(points[end] - at_first, axis=1))
            np.maximum.at(fan, of[u], np.linalg.norm(points[other] - points[begin[of[u]]], axis=1))
            np.minimum.at(inward, of[u], np.linalg.norm(points[other] - points[end], axis=1))
        np.maximum.at(rounded, of[u], rounding[one])
        near = (
            (number >= _LEAST) & (size <= _POINT * inward + 2 * rounded) & (size <= _FAN * fan + 2 * rounded)
        )
        found[near[of]] = vertices[first[of[near[of]]]]
    if found.max(initial=-1) < 0:
        return None
    pole = np.full(len(points), -1)
    pole[vertices] = found
    return pole


@np.errstate(all="ignore")
def poles_of_faces(stencils: Stencils) -> Indices | None:
    """Border vertices of a face list at a pole: (n,), the first one there, else -1; None if none is.

    One vertex is a pole of its own if several triangles are narrow there.
    """
    faces, n = stencils.faces, stencils.n
    if stencils.polygons is not None or stencils.closed.all():
        return None
    border = np.append(~stencils.closed, np.zeros(len(stencils.points) - n + 1, bool))
    faces = faces[border[faces].any(axis=1)]
    sides = np.where(faces[:, 3] < 0, 3, 4)
    row, slot = np.nonzero((faces >= 0) & border[faces])
    before, b, after = (faces[row, (slot + k) % sides[row]] for k in (-1, 1, 2))
    a, kept, x = faces[row, slot], border[b], stencils.points[:n]
    found = _at_one_place(x, a[kept], b[kept], before[kept], after[kept], stencils.roundoff)
    tip = (faces[row, 3] < 0) & narrow(x[b] - x[a], x[before] - x[a])
    tips = np.flatnonzero(np.bincount(a[tip], minlength=n) >= _LEAST)
    if tips.size:
        found = np.full(n, -1) if found is None else found
        found[tips] = np.where(found[tips] < 0, tips, found[tips])
    return found


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
    return replace(grid.stencils(), faces=_without_repetition(_grid_faces(vertex, grid.wrap))), pole.ravel()


def _grid_faces(vertex: Ints, wrap: tuple[bool, bool]) -> Ints:
    return grid_faces(np.pad(vertex, [(0, int(w)) for w in wrap], mode="wrap"))


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
            size = min(REACH + SPREAD + 3, grid.shape[axis])
            rows = slice(0, size) if end == 0 else slice(grid.shape[axis] - size, None)
            cut = (rows, slice(None)) if axis == 0 else (slice(None), rows)
            wrap = [w and i != axis for i, w in enumerate(grid.wrap)]
            part = QuadGrid(grid.points[cut], wrap).with_roundoff(grid.roundoff)
            place = np.arange(part.points[..., 0].size).reshape(part.shape)
            own = np.moveaxis(place, axis, 0)[end]
            vertex = place.astype(np.int32)
            for first in np.unique(side[at]):
                np.moveaxis(vertex, axis, 0)[end][side == first] = own[side == first][0]
            faces = _without_repetition(_grid_faces(vertex, part.wrap))
            beside = np.zeros(place.size, bool)
            beside[beside_poles(part.points.reshape(-1, 3), faces, np.unique(vertex[place != vertex]))] = True
            beside[own[at]] = True
            near.append((number[cut].ravel(), part, beside))
    return near


def _without_repetition(faces: Ints) -> Ints:
    """Quads with an edge of no length as triangles; those without an area left out."""
    same = faces == np.roll(faces, -1, axis=1)
    first = np.where(same.any(axis=1), same.argmax(axis=1), 0)
    triangles = np.take_along_axis(faces, (np.arange(1, 5) + first[:, None]) % 4, axis=1)
    triangles[:, 3] = -1
    return np.where(same.any(axis=1)[:, None], triangles, faces)[same.sum(axis=1) < 2]
