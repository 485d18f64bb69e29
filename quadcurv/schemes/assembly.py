"""Laplacians that are sums over faces: from local matrices to one in CSR, or straight to fluxes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
import scipy

from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Ints

Local = Callable[[Floats, float], tuple[Floats, Floats]]
"""Corners (m, k, 3) of faces of k sides -> their matrices (m, k, k) and parts of the dual areas (m, k).

The second argument tells how corners are rounded: `Stencils.coarse`.
"""

MOST_SIDES = 128  # of a polygon kept as one: its matrix is full
_ENTRIES = 1 << 15  # of the matrices that are there at a time


def from_faces(
    local: Local, polygons: bool = False
) -> Callable[[Stencils], tuple[scipy.sparse.csr_array, Floats]]:
    """Return `Laplacian.assemble` of a scheme that is a sum over faces.

    Parameters
    ----------
    local : callable
        A `Local`: corners (m, k, 3) of faces of k sides and how these are rounded -> (matrices (m, k, k),
        parts of the dual areas (m, k)), the first positive semi-definite; NaN for a face without area.
        Called once for k = 3, once for k = 4, a part of the mesh at a time.
    polygons : bool
        Whether faces of more than four sides, up to ``MOST_SIDES``, are given to `local` too, instead of
        the triangles that they are cut into.
    """

    def assemble(stencils: Stencils) -> tuple[scipy.sparse.csr_array, Floats]:
        return assembled(stencils, list(_by_sides(stencils, polygons)), local, stencils.n)

    return assemble


def flux_from_faces(local: Local, polygons: bool = False) -> Callable[[Stencils], tuple[Floats, Floats]]:
    """Return `Laplacian.flux` of the same scheme."""

    def flux(stencils: Stencils) -> tuple[Floats, Floats]:
        from quadcurv.kernels import assembly

        sums, areas = np.zeros((stencils.n, 3)), np.zeros(len(stencils.points))
        for faces, matrices, parts in _pieces(stencils, _by_sides(stencils, polygons), local):
            assembly.add_fluxes(matrices, stencils.points, faces, sums)
            np.add.at(areas, faces, parts)
        return sums, areas[: stencils.n]

    return flux


def ring_areas(stencils: Stencils) -> Floats:
    """As `Stencils.ring_areas`, of rings whose polygons of more than four sides are kept."""
    cut = stencils.ring_areas
    if stencils.polygons is None or not stencils.orientable:
        return cut
    areas = np.zeros_like(stencils.points)
    for faces in _by_sides(stencils, True):
        x = stencils.points[faces]
        after, before = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
        np.add.at(areas, faces, np.cross(after, before) / 4)
    whole = areas[: stencils.n]
    # Between two polygons that have two edges in common there is hardly a ring.
    size = np.linalg.norm(cut, axis=1)
    ring = (size > 0) & (np.linalg.norm(whole, axis=1) > 0.1 * size)
    return np.where(ring[:, None], whole, cut)


def assembled(
    stencils: Stencils, groups: list[Ints], local: Local, n: int
) -> tuple[scipy.sparse.csr_array, Floats]:
    """Rows 0..n of the sum of the matrices of faces (m, k), and dual areas (n,)."""
    from quadcurv.kernels import assembly

    points = stencils.points
    sides = np.concatenate([np.full(len(faces), faces.shape[1]) for faces in groups])
    first = np.concatenate(([0], np.cumsum(sides)))
    corners = np.concatenate([faces.ravel() for faces in groups])
    indptr, indices = assembly.pattern(first, corners, n, len(points))
    if indptr[-1] <= np.iinfo(np.int32).max:
        indptr = indptr.astype(np.int32)
    else:
        indices = indices.astype(np.int64)
    data, areas = np.zeros(indices.size), np.zeros(len(points))
    for faces, matrices, parts in _pieces(stencils, groups, local):
        assembly.add(matrices, faces, indptr, indices, data)
        np.add.at(areas, faces, parts)
    return scipy.sparse.csr_array((data, indices, indptr), (n, len(points))), areas[:n]


def _by_sides(stencils: Stencils, polygons: bool) -> Iterator[Ints]:
    """Triangles (m, 3), quads (m, 4), and polygons (m, k) of each size if these are kept."""
    faces, whole = stencils.faces, stencils.polygons
    larger = []
    if polygons and whole is not None:
        # Ghosts come behind the faces that `whole.face` speaks of.
        of = np.pad(whole.face, (0, len(faces) - len(whole.face)), constant_values=-1)
        sides = np.diff(whole.indptr)
        kept = np.zeros(len(sides) + 1, bool)  # the last one is that of -1
        kept[of] = True
        kept[:-1] &= sides <= MOST_SIDES
        kept[-1] = False
        faces = faces[~kept[of]]
        for k in np.unique(sides[kept[:-1]]):
            which = np.flatnonzero(kept[:-1] & (sides == k))
            larger.append(whole.corners[whole.indptr[which, None] + np.arange(k)])
    triangle = faces[:, 3] < 0
    yield np.ascontiguousarray(faces[triangle, :3])
    yield np.ascontiguousarray(faces if not triangle.any() else faces[~triangle])
    yield from larger


def _pieces(
    stencils: Stencils, groups: Iterable[Ints], local: Local
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Some faces at a time, with their matrices and areas: memory does not grow with the mesh."""
    for faces in groups:
        step = max(1, _ENTRIES // faces.shape[1] ** 2)
        for begin in range(0, len(faces), step):
            part = faces[begin : begin + step]
            with np.errstate(all="ignore"):  # faces without area
                matrices, parts = local(stencils.points[part], stencils.coarse)
            yield part, np.ascontiguousarray(matrices), parts
