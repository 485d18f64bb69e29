"""OBJ files: polygons and every digit of the positions; no values."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError


def read_obj(path: Path) -> Content:
    """Positions and polygons of an OBJ file; texture and normal indices do not split vertices."""
    points: list[list[float]] = []
    sizes: list[int] = []
    corners: list[int] = []
    text = path.read_text(encoding="utf-8", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), 1):
        kind, *words = line.partition("#")[0].split() or [""]
        try:
            if kind == "v":
                x, y, z = map(float, words[:3])
                points.append([x, y, z])
            elif kind == "f":
                sizes.append(len(words))
                for word in words:
                    index = int(word.partition("/")[0])
                    # Counted from 1, or back from the last vertex read.
                    corners.append(index - 1 if index > 0 else len(points) + index if index else -1)
        except ValueError:
            raise MeshError(f"line {number}: {line.strip()!r} is not OBJ") from None
    return Content(np.array(points, float).reshape(-1, 3), polygons(sizes, corners))


def write_obj(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Every digit of the positions."""
    lines = ["v " + " ".join(map(repr, point)) for point in mesh.points.tolist()]
    lines += ["f " + " ".join(face) for face in FaceList.of(mesh).words(1)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


register(Format((".obj",), read_obj, write_obj))
