"""OFF files, text and binary: polygons and every digit of the positions; no values."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.io.text import Words, distinct, numbers, runs, text_of
from quadcurv.mesh import QuadMesh
from quadcurv.types import Indices, MeshError

_HEADER = re.compile(rb"\s*((?:ST|C|N|4|n)*)(?i:OFF)(?:\s+(BINARY)[^\n]*\n)?")


def read_off(path: Path) -> Content:
    """Positions and polygons; texture, colours and normals are skipped.

    The header word may miss, and may bear ST, C, N, 4 and n before it. Words may stand on lines as they
    like, as Geomview has it; where every vertex and face has a line of its own, more may follow on it.
    """
    try:
        with path.open("rb") as file:
            head = _HEADER.match(file.read(1000).removeprefix(b"\xef\xbb\xbf"))
        if head and head[2]:
            points, sizes, corners = _binary(path.read_bytes(), head)
        else:
            points, sizes, corners = _text(text_of(path))
    except (ValueError, IndexError, OverflowError) as error:
        raise MeshError(f"not an OFF file: {error}") from None
    return Content(points, polygons(sizes, corners))


def _columns(kinds: bytes, dimensions: int = 3) -> int:
    """Numbers that a vertex has by the letters before OFF."""
    per = {b"ST": 2, b"C": 4, b"N": dimensions, b"4": 1, b"n": 0}
    return dimensions + sum(per[kind] for kind in re.findall(rb"ST|C|N|4|n", kinds))


def _positions(rows: NDArray[Any], kinds: bytes) -> NDArray[np.float64]:
    """(n, 3): of four coordinates the last divides the others."""
    x = rows[:, :3].astype(float)
    if b"4" not in kinds:
        return x
    with np.errstate(divide="ignore", invalid="ignore"):
        return x / rows[:, 3:4]


def _text(text: bytes) -> tuple[Any, Any, Any]:
    head = _HEADER.match(text)
    kinds = head[1] if head else b""
    body = text[head.end() :] if head else text
    number, row = numbers(body), Words.lines(body)
    if len(number) < 2:
        raise ValueError("nothing in it")
    if b"n" in kinds:
        if number[0] != 3:
            raise ValueError(f"points of {number[0]:g} dimensions")
        row = distinct(np.append(1, row[row > 1]))
    n, m = (_whole(x) for x in number[row[0] : row[0] + 2])
    # The number of edges, which nobody counts, may miss where the line ends before it.
    begin = row[0] + (2 if row[1] - row[0] == 2 else 3)
    if len(number) < begin + 3 * n + m:
        raise ValueError(f"{n} points and {m} faces are more than its {len(number)} numbers hold")
    rows = np.append(begin, row[row > begin])
    width = np.diff(rows)
    least = 4 if b"4" in kinds else 3
    if len(width) >= n and (width[:n] >= least).all():
        at = rows[:n, None] + np.arange(least)
        try:
            return _positions(number[at], kinds), *_faces(number, rows[n:], m)
        except ValueError:
            if (width[:n] == _columns(kinds)).all():
                raise
    end = begin + n * _columns(kinds)
    table = number[begin:end].reshape(n, _columns(kinds))
    return _positions(table, kinds), *_faces(number, np.append(end, row[row > end]), m)


def _whole(number: float) -> int:
    if not (number >= 0 and number == int(number)):
        raise ValueError(f"a count of {number:g}")
    return int(number)


def _faces(number: NDArray[np.float64], rows: NDArray[Any], m: int) -> tuple[Indices, NDArray[np.float64]]:
    """Sizes and corners of m faces, each at the beginning of a row, or one after the other."""
    begin = rows[:m].astype(np.int64)
    if len(rows) > m:
        sizes = number[begin]
        if (sizes <= np.diff(rows[: m + 1]) - 1).all() and (sizes >= 0).all() and (sizes % 1 == 0).all():
            return _gathered(number, begin, sizes.astype(np.int64))
    at, begins = int(rows[0]), np.empty(m, np.int64)
    sizes = number[at:].tolist() if m else []
    place = 0
    for face in range(m):
        begins[face] = at + place
        place += 1 + _whole(sizes[place]) if place < len(sizes) else 1
    if m and at + place > len(number):
        raise ValueError("the face list is cut short")
    return _gathered(number, begins, number[begins].astype(np.int64))


def _gathered(number: NDArray[Any], begin: Indices, sizes: Indices) -> tuple[Indices, NDArray[Any]]:
    return sizes, number[runs(begin + 1, sizes)]


def _binary(data: bytes, head: re.Match[bytes]) -> tuple[Any, Any, Any]:
    """Big-endian 32-bit words: counts; vertices; of each face its size, vertices, and colour components."""
    body = data[head.end() + (len(data) - len(data.removeprefix(b"\xef\xbb\xbf"))) :]
    word = np.frombuffer(body[: len(body) // 4 * 4], ">i4")
    begin = int(b"n" in head[1])
    if len(word) < begin + 3:
        raise ValueError("it is cut short")
    if begin and word[0] != 3:
        raise ValueError(f"points of {word[0]} dimensions")
    n, m = (_whole(x) for x in word[begin : begin + 2])
    columns = _columns(head[1])
    begin += 3
    if len(word) < begin + n * columns + 2 * m:
        raise ValueError(f"{n} points and {m} faces are more than its {len(data)} bytes hold")
    end = begin + n * columns
    points = _positions(word[begin:end].view(">f4").reshape(n, columns), head[1])
    begins = np.empty(m, np.int64)
    place = end
    for face in range(m):
        begins[face] = place
        place += 1 + _whole(word[place])
        place += 1 + (_whole(word[place]) if place < len(word) else 0)
        if place > len(word):
            raise ValueError("the face list is cut short")
    return points, *_gathered(word, begins, word[begins].astype(np.int64))


def write_off(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Every digit of the positions."""
    faces = FaceList.of(mesh)
    lines = ["OFF", f"{len(mesh.points)} {len(faces.sizes)} 0"]
    lines += [" ".join(map(repr, point)) for point in mesh.points.tolist()]
    lines += [f"{len(face)} " + " ".join(face) for face in faces.words()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


register(Format((".off",), read_off, write_off))
