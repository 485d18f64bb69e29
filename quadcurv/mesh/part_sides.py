"""Which faces of a mesh in parts to turn so that neighbours agree: told by all parts together.

Faces of a part that hang together agree but for which of them are turned. Those that several parts have join
these components, as edges join faces: what is left is one question for each component of the whole mesh.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from quadcurv.connectivity import Connectivity, connect, fewest_turned, sides
from quadcurv.mesh import part_files
from quadcurv.stencils import face_pairs
from quadcurv.types import Bools, Indices, Ints

if TYPE_CHECKING:
    from quadcurv.mesh.face_parts import FaceParts


class Sides(NamedTuple):
    """Which faces are turned.

    Attributes
    ----------
    orientable : bool
        Whether neighbours agree then; components where they cannot are left as they are.
    turned : int
        How many are.
    first : int
        The first of them, where there is one.
    """

    orientable: bool
    turned: int
    first: int


class SidesError(Exception):
    """Faces run against their neighbours, and which are to turn is not known."""


class _Components(NamedTuple):
    """What hangs together among the faces of a part: two kinds of faces, those of one kind agree.

    Attributes
    ----------
    faces : (c, 2) int64
        How many faces of each kind the components have that this part counts: each face is by one part.
    first : (c, 2) int64
        The first of them.
    seam : (s, 3) int64
        Faces that other parts have, too: number, component, kind.
    twisted : (t,) int64
        Components where neighbours cannot agree.
    """

    faces: Indices
    first: Indices
    seam: Indices
    twisted: Indices


_FILE = "sides.npy"
_NONE = np.iinfo(np.int64).max


def known(folder: Path) -> Sides | None:
    """What was found before."""
    try:
        orientable, turned, first = np.load(folder / _FILE).tolist()
    except FileNotFoundError:
        return None
    return Sides(bool(orientable), turned, first)


def find(mesh: FaceParts) -> Sides:
    """Find which faces to turn, as one mesh does, and write it to the files of the parts."""
    parts = [_written(mesh, p) for p in range(mesh.parts)]
    begin = np.concatenate(([0], np.cumsum([len(found.faces) for found in parts])))
    # Component a of all: a as it is, and a + number the other way round.
    number = int(begin[-1])
    seam = np.concatenate([found.seam for found in parts])
    seam[:, 1] += np.repeat(begin[:-1], [len(found.seam) for found in parts])
    seam = seam[np.argsort(seam[:, 0], kind="stable")]
    again = np.flatnonzero(np.diff(seam[:, 0]) == 0)
    (_, a, x), (_, b, y) = seam[again].T, seam[again + 1].T
    twisted = np.concatenate([found.twisted + first for found, first in zip(parts, begin, strict=False)])
    label = sides(
        number,
        np.concatenate((a, twisted)),
        np.concatenate((b, twisted)),
        np.concatenate((x != y, np.ones(twisted.size, bool))),
    )
    # Faces of a component are of two kinds: those of one are turned, or those of the other.
    label = np.concatenate((label, np.roll(label, number)))
    faces = np.concatenate([found.faces for found in parts]).T.ravel()
    first = np.concatenate([found.first for found in parts]).T.ravel()
    turn = fewest_turned(label, faces, first)
    for p, k in enumerate(begin[:-1].tolist()):
        _turn(mesh.folder, p, turn.reshape(2, -1)[:, k : begin[p + 1]])
    result = Sides(
        orientable=not bool((label[:number] == label[number : 2 * number]).any()),
        turned=int(faces[turn].sum()),
        first=int(first[turn].min(initial=_NONE)),
    )
    np.save(mesh.folder / "found.npy", np.array(result))
    os.replace(mesh.folder / "found.npy", mesh.folder / _FILE)  # whole, or not there
    return result


def _written(mesh: FaceParts, p: int) -> _Components:
    """Components of a part; which of them each of its faces belongs to goes to a file."""
    given, begin, end = mesh.faces_of(p), int(mesh.cuts[p]), int(mesh.cuts[p + 1])
    if len(given) == 0:
        none = np.empty((0, 2), np.int64)
        return _Components(none, none, np.empty((0, 3), np.int64), none[:, 0])
    made, vertices = mesh.mesh_of(given, begin, end, connected=_as_given)
    table, source = made.faces, made.face_source
    inner = (vertices >= begin) & (vertices < end)
    f, i, g, j = face_pairs(table)
    # Edges that end beyond the part may have faces that it does not know of.
    start, stop = table[f, i], table[f, (i + 1) % np.where(table[f, 3] < 0, 3, 4)]
    whole = inner[start] | inner[stop]
    f, i, g, j = f[whole], i[whole], g[whole], j[whole]
    label = sides(len(table), f, g, table[f, i] == table[g, j])
    ours, theirs = np.split(label, 2)
    names, component = np.unique(np.minimum(ours, theirs), return_inverse=True)
    kind = (ours > theirs).astype(np.int64)
    numbers = part_files.numbers(given)[source].astype(np.int64)
    np.save(mesh.folder / f"sides{p}.npy", np.stack((source, component, kind), axis=1))
    # A face is counted by the part that owns the first of its vertices.
    corners = np.where(table < 0, np.iinfo(np.int64).max, vertices[table])
    counted = (corners.min(axis=1) >= begin) & (corners.min(axis=1) < end)
    faces, first = np.zeros((len(names), 2), np.int64), np.full((len(names), 2), _NONE)
    at = component[counted], kind[counted]
    np.add.at(faces, at, 1)
    np.minimum.at(first, at, numbers[counted])
    shared = ~inner[np.where(table < 0, table[:, :1], table)].all(axis=1)
    seam = np.stack((numbers, component, kind), axis=1)[shared]
    return _Components(faces, first, seam, np.unique(component[ours == theirs]))


def _turn(folder: Path, p: int, turn: Bools) -> None:
    """Turn the faces of a part: those of so many components, of either kind."""
    path = folder / f"sides{p}.npy"
    if not path.exists():
        return
    source, component, kind = np.load(path).T
    part_files.write_turned(folder, p, source[turn[kind, component]])
    path.unlink()


def _as_given(table: Ints, points: Any, turned: Bools) -> Connectivity:
    """Faces of a part, none of them turned."""
    return connect(table, points, np.zeros(len(table), bool))
