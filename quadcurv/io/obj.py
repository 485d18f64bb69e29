"""OBJ files: polygons and every digit of the positions; no values."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.io.text import Words, parts, runs, text_of
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError


def read_obj(path: Path) -> Content:
    """Positions and polygons; texture and normal indices do not split vertices."""
    text = text_of(path).replace(b"\\\n", b" ")
    points, sizes, corners = [np.empty((0, 3))], [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    n = 0
    for part in parts(text):
        try:
            x, size, corner = _statements(Words.of(part), n)
        except (ValueError, OverflowError):
            raise MeshError(_bad_line(text)) from None
        n += len(x)
        points.append(x)
        sizes.append(size)
        corners.append(corner)
    return Content(np.concatenate(points), polygons(np.concatenate(sizes), np.concatenate(corners)))


def _statements(words: Words, n: int) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int64]]:
    """Vertices, sizes of faces and their corners, with n vertices read before."""
    first, count = words.first[:-1], np.diff(words.first)
    if not len(first):
        return np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64)
    letter = np.where(words.end[first] - words.start[first] == 1, words.text[words.start[first]], 0)
    vertex, face = letter == ord("v"), letter == ord("f")
    if (count[vertex] < 4).any():
        raise ValueError("a vertex of fewer than three coordinates")
    points = words.numbers((first[vertex, None] + np.arange(1, 4)).ravel(), float).reshape(-1, 3)
    sizes = count[face].astype(np.int64) - 1
    chosen = runs(first[face].astype(np.int64) + 1, sizes)
    # Of a corner 1/2/3 only the vertex is of interest.
    slash = np.flatnonzero(words.text == ord("/"))
    word, at = np.unique(np.searchsorted(words.start, slash, side="right") - 1, return_index=True)
    end = words.end.copy()
    end[word] = slash[at]
    if (end[chosen] == words.start[chosen]).any():
        raise ValueError("a corner without a vertex")
    index = words.numbers(chosen, np.int64, end)
    # Counted from 1, or back from the last vertex read.
    before = np.repeat(n + np.cumsum(vertex)[face], sizes)
    return points, sizes, np.where(index > 0, index - 1, np.where(index < 0, before + index, -1))


def _bad_line(text: bytes) -> str:
    """Which line is no OBJ."""
    for number, line in enumerate(text.split(b"\n"), 1):
        kind, *words = line.split() or [b""]
        try:
            if kind == b"v":
                if len([float(word) for word in words[:3]]) < 3:
                    raise ValueError(line)
            elif kind == b"f":
                for word in words:
                    int(word.partition(b"/")[0])
        except ValueError:
            return f"line {number}: {line.decode(errors='replace').strip()[:80]!r} is not OBJ"
    return "a number is not OBJ"


def write_obj(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Every digit of the positions."""
    lines = ["v " + " ".join(map(repr, point)) for point in mesh.points.tolist()]
    lines += ["f " + " ".join(face) for face in FaceList.of(mesh).words(1)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


register(Format((".obj",), read_obj, write_obj))
