"""Rings at the border closed by points of a surface fitted at the vertex.

A fan of quads, or of three triangles, is completed by its mirror image through the vertex, in the tangent
plane: as the other side of a regular vertex looks. Where that leaves a wide gap, edges are put between; the
ghosts lie on the fitted surface. Four quads on the surface, of the same area, take the place of other fans of
triangles, on whose rings Laplacians are off by a part of the curvature however small they are; and smaller
ones that of a fan that leaves no room or has a face of no width.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from quadcurv.boundary.surface import Surfaces
from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Indices, Ints

_NARROW = np.radians(10)  # a gap less than that leaves no room for a face
_THIN = 1e-3  # an angle less than that, or less from straight, is a face of no width
_BENT = 0.1  # how far a ghost quad may be from a parallelogram, in sums of its edges
# Which edges of so many quads, or of three triangles, have mirror images that make them four, or six.
_QUADS = {1: (1, 1), 2: (0, 1, 0), 3: (0, 0, 0, 0)}
_TRIANGLES = {3: (0, 1, 1, 0)}


class Fans(NamedTuple):
    """Open fans of k faces around n vertices, counter-clockwise.

    Attributes
    ----------
    vertex : (n,) int64
    edges : (n, k + 1) int32
        The edge neighbours.
    across : (n, k) int32
        The vertices across the quads, -1 in triangles.
    slot : (n, k) int64
        The vertex's own place in each face: where a fixed diagonal goes.
    """

    vertex: Indices
    edges: Ints
    across: Ints
    slot: Indices

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
        found.append(Fans(vertex, np.column_stack((following, last)), across, slot))
    return found


def stars(stencils: Stencils, fan: Fans, surfaces: Surfaces) -> list[tuple[Indices, Stars]]:
    """Close fans, those alike together: which of them, and their stars."""
    edges = surfaces.flat(stencils.points[fan.edges])
    angle = np.arctan2(edges[..., 1], edges[..., 0])
    corner = np.diff(angle, axis=1) % (2 * np.pi)
    total = corner.sum(axis=1)
    sound = ((corner > _THIN) & (corner < np.pi - _THIN)).all(axis=1) & (total < 2 * np.pi - _NARROW)
    k, quads = corner.shape[1], (fan.across >= 0).all(axis=1)
    regular = quads | ((k == 3) & (fan.across < 0).all(axis=1))
    gap = 2 * np.pi - total
    # Mirror images of the edges, by their angle from the last one, that stand free in the gap.
    right = np.where(quads, np.pi / 2, np.pi / 3)
    offset = (angle + np.pi - angle[:, -1:]) % (2 * np.pi)
    free = np.minimum(total / k, right)[:, None] / 2
    kept = (offset >= free) & (offset <= gap[:, None] - free)
    widest = 1.5 * right
    for lattice, alike in ((_QUADS, quads), (_TRIANGLES, ~quads & regular)):
        if k in lattice:  # if these are what is missing, however skew
            mirrored = np.array(lattice[k], bool)
            step = _steps(offset[:, mirrored], gap)
            alike = alike & ((step > _NARROW) & (step < np.pi - _NARROW)).all(axis=1)
            kept[alike] = mirrored
            widest[alike] = np.pi

    found = []
    for rows in _alike(np.column_stack((kept, right, widest, sound, regular, fan.slot % 2))):
        if not (sound & regular)[rows[0]]:
            own = stencils, fan.of(rows), edges[rows], surfaces.of(rows), total[rows]
            axes = _axes(*own) if sound[rows[0]] else None
            found.append((rows, regular_stars(stencils, surfaces.of(rows), axes)))
            continue
        mirrored = kept[rows[0]]
        step = _steps(offset[rows][:, mirrored], gap[rows])
        offsets = np.pad(np.cumsum(step, axis=1), [(0, 0), (1, 0)])
        length = np.linalg.norm(edges[rows], axis=2)
        lengths = np.concatenate((length[:, -1:], length[:, mirrored], length[:, :1]), axis=1)
        between = np.where(step > widest[rows, None], np.round(step / right[rows, None]) - 1, 0)
        for some in _alike(between):
            o, size = (_subdivided(x[some], between[some[0]].astype(int)) for x in (offsets, lengths))
            turn = angle[rows[some], -1:] + o
            ghosts = size[..., None] * np.stack((np.cos(turn), np.sin(turn)), axis=-1)
            at = rows[some]
            found.append((at, _star(stencils, fan.of(at), surfaces.of(at), ghosts[:, 1:-1])))
    return found


def _axes(stencils: Stencils, fan: Fans, edges: Floats, surfaces: Surfaces, total: Floats) -> Floats:
    """Edges (n, 2, 2) of four quads, of the area that fans have when completed, where triangles count twice.

    Along a side as long as the fan's, at a corner like its two sides, else squares.
    """
    across = surfaces.flat(stencils.points[fan.across])
    a, b = edges[:, :-1], edges[:, 1:]
    area = np.where(fan.across < 0, 2 * _cross(a, b), _cross(a, across) + _cross(across, b)).sum(axis=1) / 2
    area = np.maximum(area, 0.0) * 2 * np.pi / total / 4
    along = (edges[:, 0] - edges[:, -1]) / 2
    turned = np.stack((-along[:, 1], along[:, 0]), axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        side = np.stack((along, turned * (area / (along * along).sum(axis=1))[:, None]), axis=1)
        corner = edges[:, [0, -1]] * np.sqrt(area / _cross(edges[:, 0], edges[:, -1]))[:, None, None]
    square = np.sqrt(area)[:, None, None] * np.eye(2)
    straight = np.abs(total - np.pi) < np.pi / 4
    return np.where(straight[:, None, None], side, np.where((total < np.pi)[:, None, None], corner, square))


def _cross(a: Floats, b: Floats) -> Floats:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _steps(offset: Floats, gap: Floats) -> Floats:
    """Angles from the last edge to the first by way of edges between them."""
    return np.diff(np.column_stack((np.zeros_like(gap), offset, gap)), axis=1)


def _alike(rows: Floats) -> list[Indices]:
    """Indices of equal rows together."""
    _, group = np.unique(rows, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    return np.split(order, np.cumsum(np.bincount(group.ravel()))[:-1])


def _subdivided(x: Floats, between: Indices) -> Floats:
    """Rows with `between` values put evenly between one and the next."""
    columns = [x[:, :1]]
    for j, count in enumerate(between):
        t = np.arange(1, count + 2) / (count + 1)
        columns.append(x[:, j, None] * (1 - t) + x[:, j + 1, None] * t)
    return np.concatenate(columns, axis=1)


def _star(stencils: Stencils, fan: Fans, surfaces: Surfaces, ghosts: Floats) -> Stars:
    """Faces of fans that all look alike, and of the ghosts (n, g, 2) that close them."""
    k = fan.across.shape[1]
    edges, across = (surfaces.flat(stencils.points[x]) for x in (fan.edges, fan.across))
    as_quads = fan.across[0, 0] >= 0
    ring = np.concatenate((edges[:, -1:], ghosts, edges[:, :1]), axis=1)
    beyond = ring[:, :-1] + ring[:, 1:]
    if as_quads:
        twist, parity = _twists(edges, across, fan.slot, ring)
        beyond += twist
    outer = np.empty((len(edges), 0, 2)) if as_quads else edges[:, :-1] + edges[:, 1:]
    local = np.concatenate((ghosts, beyond, outer), axis=1)
    lifted = surfaces.lifted(local)

    # Columns: the vertex, its edge neighbours, the vertices across its quads, the ghosts.
    own = [
        stencils.points[fan.vertex][:, None],
        stencils.points[fan.edges],
        stencils.points[fan.across if as_quads else fan.across[:, :0]],
    ]
    points = np.concatenate((*own, lifted), axis=1)
    first = k + 2 + as_quads * k
    g = ghosts.shape[1]
    a = np.concatenate(([k + 1], first + np.arange(g), [1]))
    d = first + g + np.arange(g + 1)
    faces: list[Any] = []
    for i in range(k):
        if as_quads:
            faces.append(np.roll((0, 1 + i, k + 2 + i, 2 + i), fan.slot[0, i]))
        else:
            faces += [(0, 1 + i, 2 + i, -1), (2 + i, 1 + i, first + 2 * g + 1 + i, -1)]
    for i in range(g + 1):
        if as_quads:
            faces.append(np.roll((0, a[i], d[i], a[i + 1]), parity[i]))
        else:
            faces += [(0, a[i], a[i + 1], -1), (a[i + 1], a[i], d[i], -1)]
    return _numbered(points, np.array(faces))


def _twists(edges: Floats, across: Floats, slot: Indices, ring: Floats) -> tuple[Floats, list[int]]:
    """What ghost quads have beyond a parallelogram (n, g + 1, 2), and where they begin.

    As the opposite quad has it, for x y is the same there; less than that a quarter of a turn away.
    """
    n, k = across.shape[:2]
    bend = across - edges[:, :-1] - edges[:, 1:]
    angle = np.arctan2(edges[..., 1], edges[..., 0])
    fan = np.concatenate((np.zeros((n, 1)), np.cumsum(np.diff(angle, axis=1) % (2 * np.pi), axis=1)), axis=1)
    length = np.linalg.norm(ring, axis=2, keepdims=True)
    unit = ring / np.where(length > 0, length, 1.0)
    middle = unit[:, :-1] + unit[:, 1:]
    middle = np.arctan2(middle[..., 1], middle[..., 0]) - angle[:, :1]
    twist, parity = np.zeros((*middle.shape, 2)), [0] * middle.shape[1]
    for turn, sign in ((np.pi / 2, -1), (-np.pi / 2, -1), (np.pi, 1)):
        at = (middle + turn) % (2 * np.pi)
        face = (at[..., None] >= fan[:, None, 1:]).sum(axis=2)
        met = face < k
        face = np.minimum(face, k - 1)
        twist = np.where(met[..., None], sign * np.take_along_axis(bend, face[..., None], axis=1), twist)
        for j in np.flatnonzero(met[0]):
            parity[j] = int(slot[0, face[0, j]] + (sign < 0)) % 2
    return bent(twist, ring[:, :-1], ring[:, 1:]), parity


def bent(twist: Floats, a: Floats, b: Floats) -> Floats:
    """What a ghost quad of edges a, b has beyond a parallelogram: a rough mesh's own would be too much."""
    edges = np.linalg.norm(a, axis=-1) + np.linalg.norm(b, axis=-1)
    most = np.minimum(_BENT * edges, 2.5 * _BENT * np.linalg.norm(a + b, axis=-1))
    size = np.linalg.norm(twist, axis=-1)
    return twist * np.divide(most, size, out=np.ones_like(size), where=size > most)[..., None]


def regular_stars(stencils: Stencils, surfaces: Surfaces, axes: Floats | None = None) -> Stars:
    """Four quads on each surface, with edges (n, 2, 2), or half as long as the distance of the first ring."""
    if axes is None:  # the smaller they are the less a scheme is off; noise is in the surface already
        first = surfaces.ring == 1
        near = surfaces.flat(stencils.points[surfaces.around])
        size = np.linalg.norm(near, axis=2).sum(axis=1, where=first) / np.maximum(first.sum(axis=1), 1)
        axes = size[:, None, None] / 2 * np.eye(2)
    x, y = np.meshgrid([-1.0, 0, 1], [-1.0, 0, 1], indexing="ij")
    local = np.stack((x.ravel(), y.ravel()), axis=1) @ axes
    points = surfaces.lifted(local)[:, [4, 0, 1, 2, 3, 5, 6, 7, 8]]
    points[:, 0] = surfaces.points
    index = np.array([[1, 2, 3], [4, 0, 5], [6, 7, 8]])
    faces = [
        (index[i, j], index[i + 1, j], index[i + 1, j + 1], index[i, j + 1]) for i in (0, 1) for j in (0, 1)
    ]
    return _numbered(points, np.array(faces))


def _numbered(points: Floats, faces: Indices) -> Stars:
    """Stars of n centres from points (n, q, 3), the centre first, and the faces of one of them."""
    n, q, _ = points.shape
    column = np.arange(q)[None, :] - 1
    number = n + np.arange(n)[:, None] * (q - 1) + column
    number[:, 0] = np.arange(n)
    number = np.column_stack((number, np.full(n, -1)))  # the last one, which -1 reads, stays -1
    flat = np.concatenate((points[:, 0], points[:, 1:].reshape(-1, 3)))
    return Stars(flat, number[:, faces].reshape(-1, faces.shape[1]).astype(np.int32))
