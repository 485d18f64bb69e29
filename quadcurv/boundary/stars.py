"""Rings at the border closed by points of a surface fitted at the vertex.

Four quads on the surface, parallelograms in the tangent plane, take the place of the fan of faces, with a
quarter of the area that it has when completed: along a side half as long as the fan's edges are. The fan's
own faces with mirror images would do where they are alike; but a rough ring, or one of quads and triangles,
is no ring on which Laplacians are consistent, and the surface knows better.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadcurv.boundary.surface import Surfaces
from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Indices, Ints

_NARROW = np.radians(10)  # a gap less than that: the fan is as good as closed
_SIDE = np.radians(126)  # an angle of the mesh less than that is a corner
_THIN = 1e-3  # an angle less than that, or less from straight, is a face of no width


class Fans(NamedTuple):
    """Open fans of k faces around n vertices, counter-clockwise.

    Attributes
    ----------
    vertex : (n,) int64
    edges : (n, k + 1) int32
        The edge neighbours.
    across : (n, k) int32
        The vertices across the quads, -1 in triangles.
    """

    vertex: Indices
    edges: Ints
    across: Ints

    def of(self, rows: Indices) -> Fans:
        """Some of them."""
        return Fans._make(values[rows] for values in self)


class Stars(NamedTuple):
    """Closed rings with points of their own: `faces` (m, 4) over `points`, the first n of these centres."""

    points: Floats
    faces: Ints


def fans(stencils: Stencils) -> list[Fans]:
    """Open fans at the border, by number of faces; vertices of several fans have none."""
    from quadcurv.kernels import topology

    faces = stencils.faces
    border = np.flatnonzero(~stencils.closed)
    indptr, corners = topology.corners_by_vertex(faces, len(stencils.points))
    kind, flipped, *_ = topology.order_rings(faces, indptr, corners, border)
    border = border[kind[border] == topology.BOUNDARY]
    valence = indptr[border + 1] - indptr[border]
    found = []
    for k in np.unique(valence):
        vertex = border[valence == k]
        at = indptr[vertex, None] + np.arange(k)
        face, slot = np.divmod(corners[at].astype(np.int64), 4)
        sides = np.where(faces[face, 3] < 0, 3, 4)
        turn = np.where(flipped[at], -1, 1)
        following = faces[face, (slot + turn) % sides]
        last = faces[face[:, -1], (slot - turn)[:, -1] % sides[:, -1]]
        across = np.where(sides == 4, faces[face, (slot + 2) % sides], np.int32(-1))
        found.append(Fans(vertex, np.column_stack((following, last)), across))
    return found


def stars(stencils: Stencils, fan: Fans, surfaces: Surfaces) -> Stars:
    """Close fans by quads half as long as they are; by others where a fan is not sound."""
    edges = surfaces.flat(stencils.points[fan.edges])
    angle = np.arctan2(edges[..., 1], edges[..., 0])
    corner = np.diff(angle, axis=1) % (2 * np.pi)
    total = corner.sum(axis=1)
    sound = ((corner > _THIN) & (corner < np.pi - _THIN)).all(axis=1) & (total < 2 * np.pi - _NARROW)
    across = surfaces.flat(stencils.points[fan.across])
    a, b = edges[:, :-1], edges[:, 1:]
    area = np.where(fan.across < 0, 2 * _cross(a, b), _cross(a, across) + _cross(across, b)).sum(axis=1) / 2
    sound &= area > 0
    # Of one quad; triangles count twice. Half as long: what a scheme is off by is a quarter.
    area = np.where(sound, area, 1.0) * 2 * np.pi / total / 16
    first, last = edges[:, 0], edges[:, -1]
    sizes = np.linalg.norm(first, axis=1), np.linalg.norm(last, axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        # One edge along a side; at a corner two about its bisector, as long as the sides are to each other.
        side = (first - last) / 2
        ratio = np.where(total < _SIDE, sizes[0] / sizes[1], 1.0)
        half = first / sizes[0][:, None] + last / sizes[1][:, None]
        half = np.stack((half[:, 0] + half[:, 1], half[:, 1] - half[:, 0]), axis=1)
        half *= (np.sqrt(area * ratio) / np.linalg.norm(half, axis=1))[:, None]
        one = np.where((np.abs(total - np.pi) < np.pi - _SIDE)[:, None], side, half)
        other = np.stack((-one[:, 1], one[:, 0]), axis=1) * (area / (one * one).sum(axis=1))[:, None]
    axes = np.stack((one, other), axis=1)
    sound &= np.isfinite(axes).all(axis=(1, 2))
    return regular_stars(stencils, surfaces, np.where(sound[:, None, None], axes, _small(stencils, surfaces)))


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def regular_stars(stencils: Stencils, surfaces: Surfaces, axes: Floats | None = None) -> Stars:
    """Four quads on each surface, with edges (n, 2, 2), or half as long as the distance of the first ring."""
    axes = _small(stencils, surfaces) if axes is None else axes
    x, y = np.meshgrid([-1.0, 0, 1], [-1.0, 0, 1], indexing="ij")
    local = np.stack((x.ravel(), y.ravel()), axis=1) @ axes
    points = surfaces.lifted(local)[:, [4, 0, 1, 2, 3, 5, 6, 7, 8]]
    points[:, 0] = surfaces.points
    index = np.array([[1, 2, 3], [4, 0, 5], [6, 7, 8]])
    faces = [
        (index[i, j], index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i in (0, 1) for j in (0, 1)
    ]
    return _numbered(points, np.array(faces))


def _small(stencils: Stencils, surfaces: Surfaces) -> Floats:
    """Edges (n, 2, 2): the smaller the less a scheme is off, and noise is in the surface already."""
    first = surfaces.ring == 1
    near = surfaces.flat(stencils.points[surfaces.around])
    size = np.linalg.norm(near, axis=2).sum(axis=1, where=first) / np.maximum(first.sum(axis=1), 1)
    return np.asarray(size[:, None, None] / 2 * np.eye(2))


def _numbered(points: Floats, faces: Indices) -> Stars:
    """Stars of n centres from points (n, q, 3), the centre first, and the faces of one of them."""
    n, q, _ = points.shape
    column = np.arange(q)[None, :] - 1
    number = n + np.arange(n)[:, None] * (q - 1) + column
    number[:, 0] = np.arange(n)
    number = np.column_stack((number, np.full(n, -1)))  # the last one, which -1 reads, stays -1
    flat = np.concatenate((points[:, 0], points[:, 1:].reshape(-1, 3)))
    return Stars(flat, number[:, faces].reshape(-1, faces.shape[1]).astype(np.int32))
