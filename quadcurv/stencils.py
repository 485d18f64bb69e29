"""The one-ring stencils that every scheme reads."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.types import Bools, Floats, Indices, Ints


class CornerTable(NamedTuple):
    """One-ring stencils: the corners (c, a, d, b) around every vertex, in CSR form.

    Corners ``indptr[c]:indptr[c + 1]`` are those of vertex c, counter-clockwise; at a boundary vertex
    they begin at the boundary edge. Faces that run against their neighbours are turned.

    Attributes
    ----------
    indptr : (n + 1,) int64
    centre : (k,) int32
        The vertex c itself.
    next : (k,) int32
        The next edge neighbour a.
    diagonal : (k,) int32
        The vertex d across the quad, -1 in a triangle.
    previous : (k,) int32
        The previous edge neighbour b; in a closed ring it is the next corner's a.
    """

    indptr: NDArray[np.int64]
    centre: Ints
    next: Ints
    diagonal: Ints
    previous: Ints


class Polygons(NamedTuple):
    """Faces of more than four sides, which a face list has cut into triangles.

    Attributes
    ----------
    indptr : (k + 1,) int64
    corners : (c,) int32
        Polygon f has the vertices ``corners[indptr[f]:indptr[f + 1]]``, counter-clockwise.
    face : (m,) int64
        The polygon that each of the faces is a piece of, -1 where it is a face by itself.
    """

    indptr: Indices
    corners: Ints
    face: Indices

    def turned(self, turn: Bools) -> Polygons:
        """The same, those polygons turned over whose pieces are."""
        corners = self.corners.copy()
        for f in np.unique(self.face[turn & (self.face >= 0)]).tolist():
            begin, end = self.indptr[f], self.indptr[f + 1]
            corners[begin + 1 : end] = corners[begin + 1 : end][::-1]
        return self._replace(corners=corners)


class Frame(NamedTuple):
    """What surrounds a grid of points: ghosts, or the other side where it wraps.

    Attributes
    ----------
    beyond : (2, c, 3) float64
        The rows before the first and after the last one.
    beside : (2, r + 2, 3) float64
        The columns before the first and after the last one, those of the rows of `beyond` too; empty where
        rows are closed.
    """

    beyond: Floats
    beside: Floats


DOUBLE = 2.0**-53  # unit roundoff


def coarse(roundoff: float) -> float:
    """Square of how much larger a unit roundoff is than that of doubles, 1 at least."""
    return max(1.0, (roundoff / DOUBLE) ** 2)


@dataclass(frozen=True, eq=False)
class Stencils:
    """What a scheme reads: faces over points, and which of the points want a curvature.

    Attributes
    ----------
    points : (p, 3) float64
        Positions: first the n vertices with a stencil, then ghosts and dual points.
    faces : (m, 4) int32
        Counter-clockwise faces over `points`; a triangle's last entry is -1.
    shape : tuple of int
        Shape of a result, (n,) or (r, c) with r c = n.
    closed : (n,) bool
        Whether the ring is one closed fan; elsewhere no curvature is known.
    orientable : bool
        False where no choice of sides agrees; normals then have an arbitrary sign.
    polygons : Polygons or None
        Faces of more than four sides, which `faces` has cut: for schemes that are made for polygons.
    roundoff : float
        Relative rounding error of the positions as they were given.
    """

    points: Floats
    faces: Ints
    shape: tuple[int, ...]
    closed: Bools
    orientable: bool = True
    polygons: Polygons | None = None
    roundoff: float = DOUBLE

    @property
    def coarse(self) -> float:
        """Square of how much coarser positions are rounded than doubles: see `kernels.vector.rounding`."""
        return coarse(self.roundoff)

    @property
    def n(self) -> int:
        """Number of vertices with a stencil."""
        return int(np.prod(self.shape))

    def part(self, vertices: Indices, faces: Ints) -> Stencils:
        """Those of some vertices with stencils, by faces of these in their own numbers."""
        closed = self.closed[vertices]
        return replace(
            self, points=self.points[vertices], faces=faces, shape=closed.shape, closed=closed, polygons=None
        )

    @property
    def has_triangles(self) -> bool:
        """Whether any face is a triangle."""
        return bool((self.faces[:, 3] < 0).any())

    @property
    def valence(self) -> Ints:
        """(n,) int32: number of faces at each vertex."""
        count = np.bincount(self.faces[self.faces >= 0], minlength=len(self.points))
        return count[: self.n].astype(np.int32)

    @cached_property
    def ring(self) -> Ints:
        """(p, 8) int32: (a, d, a, d, ...) around each regular vertex inside, first -1 for all others."""
        from quadcurv.kernels import topology

        return topology.rings(self.faces, len(self.points))

    @cached_property
    def links(self) -> Ints:
        """(n, 4) int32: neighbours straight across, counter-clockwise, -1 where there is none.

        Of vertices inside four quads, and of those on the border beside them, which lie on two quads or one.
        """
        n, ring, valence = self.n, self.ring[: self.n], self.valence
        links, border = ring[:, ::2].copy(), ~self.closed
        links[ring[:, 0] < 0] = -1
        inside = np.flatnonzero(ring[:, 0] >= 0)
        for k in range(4):
            before, here, behind, last = (ring[inside, (2 * k + step) % 8] for step in (-1, 0, 1, 2))
            side = (here < n) & border[here % n] & (valence[here % n] == 2)
            links[here[side]] = np.column_stack((behind, inside, before, np.full(inside.size, -1)))[side]
            corner = (behind < n) & border[behind % n] & (valence[behind % n] == 1)
            links[behind[corner], :2] = np.column_stack((last, here))[corner]
        links[links >= n] = -1
        return links

    @cached_property
    def irregular(self) -> NDArray[np.int64]:
        """Vertices with a stencil that have no such ring."""
        return np.flatnonzero(self.ring[: self.n, 0] < 0)

    @cached_property
    def ring_areas(self) -> Floats:
        """(n, 3) float64: half the vector area of each ring polygon; it points along the normal.

        Zero where there is none but for rounding.
        """
        from quadcurv.kernels import faces

        if self.orientable:
            sums = np.zeros((len(self.points), 4))
            faces.ring_normals(self.points, self.faces, sums)
            sums = sums[: self.n]
        else:  # faces disagree somewhere: the corner table has each ring turned one way
            indptr, c, a, _, b = self.corner_table
            u, v = self.points[a] - self.points[c], self.points[b] - self.points[c]
            corner = np.column_stack((np.cross(u, v) / 4, (u**2 + v**2).sum(axis=1)))
            sums = scipy.sparse.csr_array((np.ones(c.size), np.arange(c.size), indptr)) @ corner
        return faces.known_areas(self.points, sums, self.coarse)

    @cached_property
    def corner_table(self) -> CornerTable:
        """Corners of the n vertices, ring by ring."""
        from quadcurv.kernels import topology

        indptr, corners = topology.corners_by_vertex(self.faces, len(self.points))
        _, flipped, *_ = topology.order_rings(self.faces, indptr, corners, np.arange(self.n))
        indptr = indptr[: self.n + 1]
        face, slot = np.divmod(corners[: indptr[-1]], 4)
        quad = self.faces[face, 3] >= 0
        sides = np.where(quad, 4, 3)
        turn = np.where(flipped[: indptr[-1]], -1, 1)

        def vertex(step: Any) -> Ints:
            return self.faces[face, (slot + step) % sides]

        return CornerTable(
            indptr,
            vertex(0),
            vertex(turn),
            np.where(quad, vertex(2), np.int32(-1)),
            vertex(-turn),
        )


def grid_faces(index: Ints) -> Ints:
    """Quads of a grid of vertex indices, counter-clockwise about first times second direction."""
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return quads.reshape(-1, 4)


class Edges(NamedTuple):
    """Edges of a face list by how many faces they have: those of one, of two, and of more.

    Attributes
    ----------
    border : (b, 2) int64
        Face and slot at which the edge begins.
    pairs : (k, 4) int64
        Faces f, g on the two sides, and the slots i, j at which the edge begins in each: (f, i, g, j).
    shared_by_many : (e, 2) int32
        Vertices of each edge of more than two faces.
    """

    border: Indices
    pairs: Indices
    shared_by_many: Ints


def edges(faces: Ints) -> Edges:
    """Sort the edges of a face list by their number of faces."""
    triangles, ends = faces[:, 3] < 0, np.roll(faces, -1, axis=1)
    ends[triangles, 2] = faces[triangles, 0]
    start, end = faces.ravel(), ends.ravel()
    edge = np.minimum(start, end).astype(np.int64) << 32 | np.maximum(start, end)
    edge[3::4][triangles] = -1  # no edge
    order = np.argsort(edge, kind="stable")[np.count_nonzero(triangles) :]
    edge = edge[order]
    first = np.flatnonzero(np.append(True, edge[1:] != edge[:-1])[: edge.size])
    count = np.diff(np.append(first, edge.size))
    one, two, many = (first[count == 1], first[count == 2], edge[first[count > 2]])
    ends_of_many = np.stack((many >> 32, many & 0xFFFFFFFF), axis=1).astype(np.int32)
    return Edges(_places(order[one]), _places(order[two], order[two + 1]), ends_of_many)


def _places(*corners: Indices) -> Indices:
    """Columns of faces and slots."""
    return np.array([part for k in corners for part in (k >> 2, k & 3)]).T


def face_pairs(faces: Ints) -> tuple[Indices, ...]:
    """Faces f, g on the two sides of every edge of two faces, and the slots i, j at which it begins there."""
    f, i, g, j = edges(faces).pairs.T
    return f, i, g, j
