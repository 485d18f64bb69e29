"""Creases, across which a mesh turns far more than beside them, and lines at which its curvature jumps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadcurv.stencils import Stencils, face_pairs
from quadcurv.types import Bools, Floats, Indices, Ints

# Least angle of a crease, in radians, and times the angles next to it.
_LEAST, _TIMES = np.radians(4.0), 4.0
# Least step of curvature at a jump: times those beside it, as a share of the curvature, and as an angle.
_STEP, _SHARE, _TURN = 7.0, 0.5, 1e-3
_MILD = np.radians(45.0)  # most that a tangent turns there
# Where a strip turns it meets another of the surface's curvatures: a change by at most so many times the
# largest one around and the sine of its kink (2 of all directions, of which strips show two); from so large
# kinks on nothing is told.
_TURNED, _KINK = 3.0, np.sin(np.radians(15.0))
_LENGTH = 2  # edges at least, to both sides of an edge, that a crease goes on for


class Features(NamedTuple):
    """Vertices on creases, and those between two sides of different curvature but one tangent, (n,) bool."""

    creases: Bools
    jumps: Bools


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # where points coincide nothing is known
def features(stencils: Stencils) -> Features:
    """Find creases and jumps of curvature along the edges of a mesh.

    The angle between the faces at an edge is compared with those at the other edges of both: of quads the
    opposite ones, across which a smooth surface turns alike. Where an arc ends in its tangent, the edges
    behind it turn alike, and so do those before it, but not the ones like the others. Single edges
    that stand out by chance make no feature: it has neighbours at both its ends, or ends at a border.
    """
    faces, n = stencils.faces, stencils.n
    if len(faces) == 0 or not stencils.orientable:
        return Features(*np.zeros((2, n), bool))
    f, i, g, j = face_pairs(faces)
    normals, centres = _planes(stencils)
    apart = centres[g] - centres[f]
    cos = np.einsum("ex,ex->e", normals[f], normals[g])
    turn = np.arccos(np.clip(cos, -1.0, 1.0))
    angle = np.full(faces.shape, np.nan)
    angle[f, i] = angle[g, j] = turn
    sharp = np.flatnonzero(turn > _LEAST)  # NaN is not
    beside = np.fmax(_beside(faces, angle, f[sharp], i[sharp]), _beside(faces, angle, g[sharp], j[sharp]))
    sharp = sharp[turn[sharp] > _TIMES * beside]

    # Curvature across every edge, by face and slot, and the edge that the other face has it as.
    bend = np.einsum("ex,ex->e", normals[g] - normals[f], apart)  # twisted faces turn, too
    length = np.linalg.norm(apart, axis=1)
    angle[f, i] = angle[g, j] = bend / length**2
    other = np.full(faces.size + 4, faces.size)  # the corner behind all others is of no face
    other[4 * f + i], other[4 * g + j] = 4 * g + j, 4 * f + i
    near, far = (_following(faces, angle, other, corner) for corner in (4 * f + i, 4 * g + j))
    step, own = np.abs(near[0] - far[0]), angle[f, i]
    calm = np.abs(np.diff((near, far), axis=1)).max(axis=(0, 1))  # NaN where a strip ends
    between = np.abs(2 * own - near[0] - far[0]) <= step
    largest = np.maximum(_SHARE * np.maximum(np.abs(near[0]), np.abs(far[0])), _TURN / length)
    jumps = np.flatnonzero((step > _STEP * calm) & (step > largest) & between & (turn <= _MILD))
    sides = (f[jumps], i[jumps]), (g[jumps], j[jumps])
    kink = np.max([_kinks(stencils, other, *side) for side in (sides[0], *map(_opposite, sides))], axis=0)
    known = np.fmax(*(np.nanmax(np.abs(angle[side[0]]), axis=1, initial=0.0) for side in sides))
    jumps = jumps[(kink < _KINK) & (step[jumps] > _TURNED * kink * known)]
    return Features(_along(stencils, f[sharp], i[sharp]), _along(stencils, f[jumps], i[jumps]))


def _opposite(side: tuple[Indices, Indices]) -> tuple[Indices, Indices]:
    """The next edges of strips, as the same quads have them."""
    return side[0], (side[1] + 2) % 4


def _kinks(stencils: Stencils, other: Indices, f: Indices, i: Indices) -> Floats:
    """Sines of how far strips of quads change their direction at edges, where they meet another curvature."""
    across = other[4 * f + i]
    beyond = across < stencils.faces.size
    g, j = np.divmod(np.where(beyond, across, 0), 4)
    turn = _slants(stencils, f, i) - _slants(stencils, g, j)
    return np.where(beyond & np.isfinite(turn), np.abs(np.sin(turn)), 0.0)


def _slants(stencils: Stencils, f: Indices, i: Indices) -> Floats:
    """Angles between edges of quads and the way from there to the opposite ones."""
    corners = stencils.faces[f[:, None], (i[:, None] + np.arange(4)) % 4]
    a, b, c, d = np.moveaxis(stencils.points[corners], 1, 0)
    edge, way = b - a, (c + d - a - b) / 2
    cosine = np.einsum("ex,ex->e", edge, way)
    cosine = cosine / (np.linalg.norm(edge, axis=1) * np.linalg.norm(way, axis=1))
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _along(stencils: Stencils, f: Indices, i: Indices) -> Bools:
    """(n,): vertices of edges that go on at both ends."""
    faces, n, size = stencils.faces, stencils.n, len(stencils.points)
    sides = np.where(faces[f, 3] < 0, 3, 4)
    ends = np.stack((faces[f, i], faces[f, (i + 1) % sides]), axis=1)
    free = np.zeros(size, bool)
    free[:n] = ~stencils.closed
    for _ in range(_LENGTH):
        count = np.bincount(ends.ravel(), minlength=size)
        ends = ends[((count[ends] > 1) | free[ends]).all(axis=1)]
    found = np.zeros(size, bool)
    found[ends.ravel()] = True
    return found[:n]


def _following(faces: Ints, values: Floats, other: Indices, corner: Indices) -> Floats:
    """(3, e): values at the next edges of strips of quads from corners 4 f + i on; NaN where they end."""
    of_quads = np.append(np.where(faces[:, 3:] < 0, np.nan, values), np.full(4, np.nan))
    found = np.empty((3, corner.size))
    for k in range(3):
        opposite = corner ^ 2
        of_quads.take(opposite, out=found[k])
        corner = other.take(opposite)
    return found


def _planes(stencils: Stencils) -> tuple[Floats, Floats]:
    """(m, 3): unit normals of faces, NaN where they have no area; their centres."""
    x, faces = stencils.points, stencils.faces
    last = np.where(faces[:, 3] < 0, faces[:, 0], faces[:, 3])
    a, b, c, d = x[faces[:, 0]], x[faces[:, 1]], x[faces[:, 2]], x[last]
    normal = np.cross(c - a, d - b)
    triangle = (faces[:, 3] < 0)[:, None]
    centres = np.where(triangle, (a + b + c) / 3, (a + b + c + d) / 4)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True), centres


def _beside(faces: Ints, angle: Floats, f: Indices, i: Indices) -> Floats:
    """The angle at the edge opposite to one of a quad, the larger one of the others of a triangle."""
    quad = faces[f, 3] >= 0
    one = np.where(quad, (i + 2) % 4, (i + 1) % 3)
    two = np.where(quad, one, (i + 2) % 3)
    return np.fmax(angle[f, one], angle[f, two])
