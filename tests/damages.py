"""Damages that were added later, and two at a time: borders of all kinds, touching patches, holes everywhere.

Drawn by seeds from `LATER` on, so that those before stay what they were; see `tests/promise.py`.
"""

from __future__ import annotations

import numpy as np

import quadcurv as qc
from quadcurv.stencils import grid_faces
from tests.promise import (
    Damaged,
    Sample,
    around,
    border,
    faces_of,
    inner_face,
    one_sided,
    pole,
    single_precision,
    with_neighbours,
)

LATER = 10_000_000


def part(s, faces, points=None, H=None, off=None):
    """Faces of a grid, or others over its vertices and some more.

    Near borders that the grid does not have fits are one-sided. What is not seen to be one, as a corner less
    a triangle, is given as `off`.
    """
    n = s.xi.size if points is None else len(points)
    missing = _open_edges(faces) - _open_edges(faces_of(s))
    near = np.zeros(n, bool)
    near[list({v for edge in missing for v in edge})] = True
    for _ in range(5):
        near = with_neighbours(near, faces)
    explained = np.where(near, np.append(one_sided(s), np.full(n - s.xi.size, one_sided(s).max())), 0.0)
    flat = s.points.reshape(-1, 3) if points is None else points
    explained = explained if off is None else np.maximum(explained, off)
    return Damaged(flat, lambda x: qc.QuadMesh(x, faces), s.H.ravel() if H is None else H, explained)


def _open_edges(faces):
    count = {}
    for face in faces:
        for edge in zip(face, [*face[1:], face[0]], strict=True):
            count[frozenset(edge)] = count.get(frozenset(edge), 0) + 1
    return {edge for edge, number in count.items() if number == 1}


def bow_tie(s, rng):
    """Two quads across from each other at a vertex are missing: two fans touch there."""
    faces, k, (i, j) = inner_face(s, rng)
    v = i * s.xi.shape[1] + j
    other = next(f for f, face in enumerate(faces) if v in face and len({*face} & {*faces[k]}) == 1)
    return part(s, [face for f, face in enumerate(faces) if f not in (k, other)])


def opposite_doubles(s, rng):
    """Faces given once more the other way round."""
    faces = faces_of(s)
    faces += [faces[k][::-1] for k in rng.choice(len(faces), rng.integers(1, 9), replace=False)]
    return Damaged(s.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, faces), s.H.ravel())


def many_holes(s, rng):
    """Up to half of the points of a grid are NaN: bridges and islands of a few quads."""
    x = s.points.copy()
    x[rng.random(s.xi.shape) < rng.uniform(0.05, 0.5)] = np.nan
    return Damaged(x, lambda x: qc.QuadGrid(x, s.surface.wrap), s.H, one_sided(s) + 1.5 * s.bend)


def many_faces_missing(s, rng):
    """Up to 70 % of the faces are missing."""
    faces, kept = faces_of(s), rng.uniform(0.3, 0.95)
    damaged = part(s, [face for face in faces if rng.random() < kept])
    damaged.explained = np.where(damaged.explained > 0, damaged.explained + s.bend, 0.0)
    return damaged


def lone_faces(s, rng):
    """A few faces, most of them alone: nothing is known of any curvature."""
    faces = faces_of(s)
    chosen = [faces[k] for k in rng.choice(len(faces), rng.integers(1, 5), replace=False)]
    while np.bincount(np.ravel(chosen)).max() > 2:  # three about a vertex tell of one
        chosen = [faces[k] for k in rng.choice(len(faces), rng.integers(1, 5), replace=False)]
    return Damaged(s.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, chosen), np.full(s.xi.size, np.inf))


def narrow(s, rng):
    """A strip of one to three rows of quads; of one nothing is known."""
    axis, width = rng.integers(2), rng.integers(1, 4)
    begin = rng.integers(0, s.xi.shape[axis] - width - 1)
    x, H, off = (
        np.take(v, np.arange(begin, begin + width + 1), axis) for v in (s.points, s.H, one_sided(s) + s.bend)
    )
    wrap = tuple(bool(w) and a != axis for a, w in enumerate(s.surface.wrap))
    return Damaged(x, lambda x: qc.QuadGrid(x, wrap), H if width > 1 else np.full(H.shape, np.inf), off)


def crack(s, rng):
    """A quad cut in two from side to side, in the middle of the mesh or at its border; the others are not.

    The ends of the cut are on chords, off the surface, and the mesh is open behind them.
    """
    faces, r, c = faces_of(s), *s.xi.shape
    i, j = (rng.integers(0, r - 1), 0) if rng.random() < 0.5 else (rng.integers(r - 1), rng.integers(c - 1))
    k = next(
        (
            k
            for k, f in enumerate(faces)
            if {*f} == {i * c + j, i * c + j + 1, (i + 1) * c + j, (i + 1) * c + j + 1}
        )
    )
    a, b, d, e = faces[k]
    flat, H, n = s.points.reshape(-1, 3), s.H.ravel(), s.xi.size
    faces[k] = [a, n, n + 1, e]
    faces.append([n, b, d, n + 1])
    points = np.vstack((flat, (flat[a] + flat[b]) / 2, (flat[d] + flat[e]) / 2))
    H = np.append(H, [(H[a] + H[b]) / 2, (H[d] + H[e]) / 2])
    off = around(s, faces, [a, b, d, e, n, n + 1], H.size, 2 * s.bend)
    return part(s, faces, points, H, off)


def pole_of_faces(s, rng):
    """A sphere to its poles as a face list, every point of a pole a vertex."""
    damaged = pole(s, rng)
    shape, wrap = damaged.H.shape, damaged.mesh(damaged.points).wrap
    faces = grid_faces(
        np.pad(np.arange(damaged.H.size).reshape(shape), [(0, int(w)) for w in wrap], mode="wrap")
    )
    return Damaged(damaged.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, faces), damaged.H.ravel(), 0.05)


def doublet(s, rng):
    """A quad as two that share two edges: a vertex of valence two between."""
    faces, k, _ = inner_face(s, rng)
    (a, b, c, d), n = faces[k], s.xi.size
    faces[k] = [a, b, c, n]
    faces.append([a, n, c, d])
    points = np.vstack((s.points.reshape(-1, 3), s.points.reshape(-1, 3)[[a, b, c, d]].mean(axis=0)))
    H = np.append(s.H.ravel(), s.H.ravel()[[a, b, c, d]].mean())
    near = np.zeros(H.size, bool)
    near[[a, b, c, d, n]] = True  # off the surface, and read by fits over three rings
    explained = around(s, faces, np.flatnonzero(with_neighbours(near, faces)), H.size, 2 * s.bend)
    return Damaged(points, lambda x: qc.QuadMesh(x, faces), H, explained)


def triangle_at_a_corner(s, rng):
    """A quad at an end cut into triangles, of which one may be missing."""
    faces = faces_of(s)
    k, turn = rng.choice([0, len(faces) - 1]), rng.integers(4)
    face = faces[k][turn:] + faces[k][:turn]
    faces[k] = face[:3]
    if rng.random() < 0.5:
        faces.append([face[2], face[3], face[0]])
    near = np.zeros(s.xi.size, bool)
    near[face] = True
    for _ in range(5):
        near = with_neighbours(near, faces)
    return part(s, faces, off=np.where(near, one_sided(s).ravel() + 0.3 * s.bend, 0.0))


def single_precision_far_away(s, rng):
    """A mesh in single precision away from the origin; two rows at sides magnify its rounding as noise."""
    offset = 10.0 ** rng.uniform(0, 6)
    damaged = single_precision(s, rng)
    damaged.explained *= (1 + offset / np.abs(s.points).max()) * np.where(border(s, 2), 25, 1)
    damaged.points = s.points + offset
    return damaged


def several(s, rng):
    """Faces missing, given twice the other way round and cut into triangles, all vertices moved by jitter."""
    faces = faces_of(s)
    chosen = rng.choice(len(faces), 6, replace=False)
    doubled = [faces[k][::-1] for k in chosen[2:4]]
    cut = [[faces[k][2], faces[k][3], faces[k][0]] for k in chosen[4:]]
    for k in chosen[4:]:
        faces[k] = faces[k][:3]
    damaged = part(s, [face for k, face in enumerate(faces) if k not in chosen[:2]] + doubled + cut)
    share = rng.choice([0.05, 0.1])
    moved = Sample(
        s.surface,
        s.xi + share * rng.uniform(-1, 1, s.xi.shape) * np.abs(s.xi[1, 0] - s.xi[0, 0]),
        s.eta + share * rng.uniform(-1, 1, s.xi.shape) * np.abs(s.eta[0, 1] - s.eta[0, 0]),
    )
    explained = damaged.explained + 12 * share * s.bend
    return Damaged(moved.points.reshape(-1, 3), damaged.mesh, moved.H.ravel(), explained)


DAMAGES = (
    bow_tie,
    opposite_doubles,
    many_holes,
    many_faces_missing,
    lone_faces,
    narrow,
    crack,
    pole_of_faces,
    doublet,
    triangle_at_a_corner,
    single_precision_far_away,
    several,
)
AS_GIVEN = (single_precision_far_away,)  # turned, they would be rounded in another way
