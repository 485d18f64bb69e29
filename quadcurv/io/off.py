"""OFF files: polygons and every digit of the positions; no values."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError


def read_off(path: Path) -> Content:
    """Positions and polygons of an ASCII OFF file; normals and colours are skipped."""
    text = path.read_text(encoding="utf-8", errors="replace")
    lines = [line for raw in text.splitlines() if (line := raw.partition("#")[0].strip())]
    start = re.match(r"(ST)?C?N?OFF\b(.*)", lines[0] if lines else "")
    if not start or "BINARY" in start[2]:
        raise MeshError("not an ASCII OFF file in three dimensions")
    lines[:1] = [start[2]] if start[2].strip() else []
    try:
        n, m = map(int, lines[0].split()[:2])
        points = np.array([line.split()[:3] for line in lines[1 : n + 1]], float).reshape(n, 3)
        rows = [line.split() for line in lines[n + 1 : n + m + 1]]
        sizes = [int(row[0]) for row in rows]
        faces = [[int(v) for v in row[1 : size + 1]] for row, size in zip(rows, sizes, strict=True)]
        if len(rows) != m or [len(face) for face in faces] != sizes:
            raise ValueError("the face list is cut short")
    except (ValueError, IndexError) as error:
        raise MeshError(f"not an OFF file: {error}") from None
    return Content(points, polygons(sizes, [v for face in faces for v in face]))


def write_off(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Every digit of the positions."""
    faces = FaceList.of(mesh)
    lines = ["OFF", f"{len(mesh.points)} {len(faces.sizes)} 0"]
    lines += [" ".join(map(repr, point)) for point in mesh.points.tolist()]
    lines += [f"{len(face)} " + " ".join(face) for face in faces.words()]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


register(Format((".off",), read_off, write_off))
