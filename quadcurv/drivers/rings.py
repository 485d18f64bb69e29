"""Fits over the neighbourhoods that a mesh has by itself: windows of a grid, and rings of faces."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy

from quadcurv.mesh import QuadGrid
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

_AVERAGED = 5  # rings that normals are averaged over where noise prevails
_WORK = 30  # of one fit, in vertices of the finite-volume scheme


class GridWindows:
    """Windows of a grid."""

    def __init__(self, grid: QuadGrid, faces: FaceRings) -> None:
        self.grid, self._faces = grid, faces

    def overlap(self, rings: int) -> bool:
        """Whether windows see a point twice."""
        return any(
            wraps and size <= 2 * rings for size, wraps in zip(self.grid.shape, self.grid.wrap, strict=True)
        )

    def polynomials(self, vertices: Indices, degree: int, rings: int, kind: int, nested: int = 1) -> Floats:
        """(k, nested COLUMNS): see `Neighbourhoods`, the lower degrees behind."""
        from quadcurv.kernels import jet

        normals = self._faces.averaged if kind == jet.ROUND else self._normals
        at = vertices.astype(np.int32)
        given = self.grid.points, normals, self.grid.wrap, at, degree, rings, kind
        return _over(lambda *target: jet.grid_fits(*given, *target), at.size, nested)

    @cached_property
    def _normals(self) -> Floats:
        """(r, c, 3): across the ring of edge neighbours, missing ones being at the vertex itself.

        The same in every part of a grid, to the last digit. Zero where there is none but for rounding.
        """
        from quadcurv.kernels import vector

        points = self.grid.points
        a, b = (_across(points, axis, wraps) for axis, wraps in enumerate(self.grid.wrap))
        normals = np.stack(vector.cross(np.moveaxis(a, 2, 0), np.moveaxis(b, 2, 0)), axis=2)
        square, first, second, far = (np.einsum("ijx,ijx->ij", x, x) for x in (normals, a, b, points))
        known = square > np.maximum(vector.rounding(2 * (first + second), far), np.finfo(float).tiny)
        if not known.all():
            normals[~known] = 0.0
        return normals


class FaceRings:
    """Rings of faces.

    Rings do not go on through vertices that are not `present`: beyond those of several fans, or of an edge of
    more than two faces, lies another sheet.
    """

    def __init__(
        self, stencils: Stencils, normals: Floats | None = None, present: Bools | None = None
    ) -> None:
        self.stencils = stencils
        # Of those that no ring goes on through, those that there are.
        self._hidden = np.empty(0, int) if present is None else np.flatnonzero(~present)
        if normals is not None:
            self.normals = normals

    @cached_property
    def corners(self) -> tuple[Indices, Ints]:
        """Corners by vertex, see topology.corners_by_vertex; none of hidden ones."""
        from quadcurv.kernels import topology

        indptr, corners = topology.corners_by_vertex(self.stencils.faces, len(self.stencils.points))
        if self._hidden.size:
            size = np.diff(indptr)
            seen = np.ones(size.size, bool)
            seen[self._hidden] = False
            indptr, corners = np.append(0, np.cumsum(np.where(seen, size, 0))), corners[np.repeat(seen, size)]
        return indptr, corners

    @cached_property
    def normals(self) -> Floats:
        """(n, 3): normals of the rings; where the polygon around a vertex has no area its neighbours'."""
        stencils, (indptr, corners) = self.stencils, self.corners
        normals = stencils.ring_areas
        flat = np.flatnonzero((np.diff(indptr)[: stencils.n] > 0) & ~normals.any(axis=1))
        normals = normals.copy() if flat.size else normals
        for v in flat:  # of valence 2
            around = stencils.faces[corners[indptr[v] : indptr[v + 1]] // 4]
            around = around[(around >= 0) & (around < stencils.n)]
            normals[v] = stencils.ring_areas[np.unique(around)].sum(axis=0)
        return normals

    def polynomials(self, vertices: Indices, degree: int, rings: int, kind: int, nested: int = 1) -> Floats:
        """(k, nested COLUMNS): see `Neighbourhoods`, the lower degrees behind."""
        from quadcurv.kernels import jet

        s, at = self.stencils, vertices.astype(np.int32)
        normals = self.averaged if kind == jet.ROUND else self.normals
        if len(normals) < len(s.points):
            normals = np.pad(normals, ((0, len(s.points) - len(normals)), (0, 0)))
        windows = self._windows if rings > 1 else (np.empty(0, np.int32),) * 2
        given = s.points, s.faces, *self.corners, *windows, normals, s.orientable, at, degree, rings, kind
        return _over(lambda *target: jet.face_fits(*given, *target), at.size, nested)

    @cached_property
    def _windows(self) -> tuple[Ints, Ints]:
        """(p, 8) and (p,): rings of regular vertices that are not hidden, and their runs."""
        from quadcurv.kernels import gather

        ring = self.stencils.ring
        if self._hidden.size:
            ring = ring.copy()
            ring[self._hidden, 0] = -1
        return ring, gather.runs(ring)

    @cached_property
    def averaged(self) -> Floats:
        """(n, 3): normals over more rings, of which noise leaves little."""
        incidence = self._incidence[:, : len(self.normals)].astype(np.float64)
        normals = self.normals
        for _ in range(_AVERAGED):
            normals = incidence.T @ (incidence @ normals)
        return normals

    @cached_property
    def _incidence(self) -> scipy.sparse.csr_array:
        """(faces, points) bool."""
        faces, sides = self.stencils.faces, self.stencils.faces >= 0
        indptr = np.concatenate(([0], np.cumsum(sides.sum(axis=1))))
        shape = len(faces), len(self.stencils.points)
        return scipy.sparse.csr_array((np.ones(indptr[-1], bool), faces[sides], indptr), shape)

    @cached_property
    def _neighbours(self) -> tuple[Ints, Ints]:
        """Vertices of the faces around each of the first n, themselves among them, in CSR form."""
        incidence, n = self._incidence[:, : self.stencils.n].astype(np.int8), self.stencils.n
        near = (incidence.T @ incidence).tocsr()[:n]
        return near.indptr.astype(np.int64), near.indices

    def means(self, values: Floats) -> Floats:
        """(n, k): means of values (n, k) over vertices and their neighbours, of those that are known."""
        from quadcurv.kernels import nearby

        return nearby.means(*self._neighbours, values)

    @cached_property
    def _onward(self) -> scipy.sparse.csr_array:
        """(points, faces) bool: of vertices that rings go on through, not those of very many faces."""
        from quadcurv.kernels.gather import CROWDED

        faces = np.diff(self.corners[0])
        return self._incidence.multiply((faces > 0) & (faces <= 2 * CROWDED)).tocsr().T

    def positions(self, vertices: Indices, rings: int) -> Floats:
        """(k, m, 3): see `Neighbourhoods`."""
        incidence, k = self._incidence, vertices.size
        around = scipy.sparse.csr_array(
            (np.ones(k, bool), vertices, np.arange(k + 1)), (k, len(self.stencils.points))
        )
        for _ in range(rings):
            around = around + around @ self._onward @ incidence
        around.sort_indices()
        row, column = around.nonzero()
        other = column != vertices[row]
        row, column = row[other], column[other]
        size = np.bincount(row, minlength=k)
        out = np.full((k, 1 + size.max(initial=0), 3), np.nan)
        out[:, 0] = self.stencils.points[vertices]
        out[row, 1 + np.arange(row.size) - np.repeat(np.cumsum(size) - size, size)] = self.stencils.points[
            column
        ]
        return out


def _across(points: Floats, axis: int, wraps: bool) -> Floats:
    """(r, c, 3): from the neighbour before to the one behind, along one direction of a grid."""
    x, out = np.moveaxis(points, axis, 0), np.empty_like(points)
    way = np.moveaxis(out, axis, 0)
    np.subtract(x[2:], x[:-2], out=way[1:-1])
    np.subtract(x[1], x[-1 if wraps else 0], out=way[0])
    np.subtract(x[0 if wraps else -1], x[-2], out=way[-1])
    return out


def bundles(points: Floats) -> Stencils:
    """Faces that lead from the first of each (k, m, 3) points to its others, and nowhere else."""
    k, m, _ = points.shape
    missing = np.isnan(points[:, 1:, 0])
    faces = np.full((k, -(-(m - 1) // 3), 4), -1, np.int32)
    index = np.full((k, 3 * faces.shape[1]), -1, np.int32)
    index[:, : m - 1] = np.where(missing, -1, np.arange(k * (m - 1)).reshape(k, m - 1) + k)
    faces[..., 0], faces[..., 1:] = np.arange(k)[:, None], index.reshape(k, -1, 3)
    flat = np.concatenate((points[:, 0], np.where(missing[..., None], 0.0, points[:, 1:]).reshape(-1, 3)))
    return Stencils(flat, faces.reshape(-1, 4), (k,), np.ones(k, bool))


def _over(fits: Callable[[Floats, int, int], None], size: int, nested: int) -> Floats:
    """(size, nested COLUMNS): run a kernel over ranges, by several threads where they are many."""
    from quadcurv.kernels import formulas, jet, ranges

    out = jet.results(nested, size)
    ranges.over(lambda start, stop: fits(out, start, stop), size, _WORK * size, formulas.WIDTH)
    return out[:, :size].T
