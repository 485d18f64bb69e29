"""What each file format keeps of a mesh and its values: tried, one file each, and written as FORMATS.md.

Files of formats that quadcurv writes are its own; the others come from pyvista, trimesh and meshlane.
"""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from quadcurv import QuadGrid, QuadMesh, attach, read, read_values, to_pyvista, to_trimesh, write
from quadcurv.io.base import FORMATS
from quadcurv.surfaces import torus

TABLE = Path(__file__).with_name("FORMATS.md")
SINGLE = 2.0**-22  # relative, a few times the rounding of single precision


@dataclass(frozen=True)
class Kept:
    """What a format keeps.

    Attributes
    ----------
    by : str
        Who wrote the file that was read.
    quads, polygons, doubles : str
        "yes"; "paired again" of quads that are stored as triangles; "cut" of polygons that are; "single" of
        positions in single precision; "grids" where there is nothing but a grid.
    values_in, values_out : str
        "double", "single" or "no": how values at the vertices come back, some of them NaN; and how they are
        written. "-" where quadcurv does not write the format.
    """

    by: str
    quads: str
    polygons: str
    doubles: str
    values_in: str
    values_out: str


def surface() -> QuadMesh:
    """A torus of quads."""
    return torus().sample((8, 6), "faces")[0]


def with_polygons() -> QuadMesh:
    """The same with two of its quads and their common edge as one hexagon."""
    a, b, c, d = surface().faces[0].tolist()
    faces = surface().faces[1:].tolist()
    k = next(k for k, face in enumerate(faces) if {b, c} <= set(face))
    other = faces.pop(k)
    at = other.index(c)  # it runs from c to b
    hexagon = [c, d, a, b, other[(at + 2) % 4], other[(at + 3) % 4]]
    return QuadMesh(surface().points, [hexagon, *faces])


def values() -> np.ndarray:
    """Values of which one is not known."""
    n = len(surface().points)
    return np.where(np.arange(n) == 3, np.nan, np.arange(n) / 7)


# Files of formats that quadcurv does not write -------------------------------------------------------------


def by_pyvista(path: Path, mesh: QuadMesh) -> None:
    """A grid, as that is what .vts holds."""
    data = to_pyvista(QuadGrid(surface().points.reshape(8, 6, 3)))
    attach(data, "H", values().reshape(8, 6))
    data.save(path)


def by_trimesh(path: Path, mesh: QuadMesh) -> None:
    """STL, and glTF in files of their own."""
    found = to_trimesh(mesh).export(file_type=path.suffix[1:])
    for name, content in found.items() if isinstance(found, dict) else [(path.name, found)]:
        (path if name.endswith(".gltf") else path.parent / name).write_bytes(content)


def by_meshlane(path: Path, mesh: QuadMesh) -> None:
    """Blocks of quads and polygons, with H where the format has room for it."""
    import meshlane

    blocks: dict[str, list[list[int]]] = {}
    cut = mesh.connectivity.polygons
    rows = [face for k, face in enumerate(mesh.faces.tolist()) if cut is None or cut.face[k] < 0]
    for row in rows:
        blocks.setdefault("quad" if row[3] >= 0 else "triangle", []).append([v for v in row if v >= 0])
    if cut is not None:
        blocks["polygon6"] = [cut.corners.tolist()]
    cells = [(name, np.array(faces)) for name, faces in blocks.items()]
    kinds = {".msh": "gmsh22", ".inp": "abaqus", ".nas": "nastran", ".bdf": "nastran"}
    file_format = kinds.get(path.suffix) or meshlane.extension_to_filetypes[path.suffix][0]
    data = {"H": values()}
    points = np.round(mesh.points, 6) if file_format == "nastran" else mesh.points
    meshlane.write(str(path), meshlane.Mesh(points, cells, point_data=data), file_format=file_format)


def writer(suffix: str) -> tuple[str, Callable[[Path, QuadMesh], None]]:
    """Who writes files of a suffix, and how."""
    if FORMATS[suffix].write is not None:
        holds = FORMATS[suffix].holds_values
        return "quadcurv", lambda path, mesh: write(path, mesh, {"H": values()} if holds else None)
    if suffix == ".vts":
        return "pyvista", by_pyvista
    if suffix in (".stl", ".gltf"):
        return "trimesh", by_trimesh
    return "meshlane", by_meshlane


# What comes back -------------------------------------------------------------------------------------------


def kept(suffix: str) -> Kept:
    """Write a file of a suffix and look at what is read from it."""
    name, write_to = writer(suffix)
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of seams, where a grid is open
        path = Path(folder) / f"mesh{suffix}"
        write_to(path, surface())
        mesh, found = read(path), read_values(path)
        doubles = _precision(mesh.points.reshape(-1, 3), surface().points)
        values_in = _values(found.get("H"))
        if isinstance(mesh, QuadGrid):
            return Kept(name, "grids", "no", doubles, values_in, "-")
        quads = "no" if (mesh.faces[:, 3] < 0).any() else "paired again" if mesh.recovery else "yes"
        polygons = _polygons(write_to, Path(folder) / f"polygons{suffix}")
    out = "-" if name != "quadcurv" else values_in if FORMATS[suffix].holds_values else "no"
    return Kept(name, quads, polygons, doubles, values_in, out)


def _polygons(write_to: Callable[[Path, QuadMesh], None], path: Path) -> str:
    try:
        write_to(path, with_polygons())
        mesh = read(path)
    except Exception:  # other writers refuse in their own words
        return "no"
    if not isinstance(mesh, QuadMesh) or not mesh.stencils().closed.all():
        return "no"
    polygons = mesh.connectivity.polygons
    return "yes" if polygons is not None and np.diff(polygons.indptr).tolist() == [6] else "cut"


def _precision(found: np.ndarray, expected: np.ndarray) -> str:
    if found.shape != expected.shape:  # in another order, as of STL
        found, expected = (np.unique(np.round(x, 5) + 0.0, axis=0) for x in (found, expected))
        return "single" if np.array_equal(found, expected) else "no"
    if np.array_equal(found, expected):
        return "yes"
    order, other = (np.lexsort(np.round(x, 4).T + 0.0) for x in (found, expected))
    close = np.allclose(found[order], expected[other], rtol=0, atol=SINGLE * np.abs(expected).max())
    return "single" if close else "no"


def _values(found: Any) -> str:
    if found is None:
        return "no"
    found = np.ravel(found)
    if np.array_equal(found, values(), equal_nan=True):
        return "double"
    return "single" if np.allclose(found, values(), rtol=SINGLE, equal_nan=True) else "no"


def table(rows: Mapping[str, Kept]) -> str:
    """All as Markdown, suffixes that keep the same in one row."""
    alike: dict[Kept, list[str]] = {}
    for suffix, row in rows.items():
        alike.setdefault(row, []).append(suffix)
    lines = [
        "# What file formats keep",
        "",
        "Written by `python -m comparisons.formats`: a torus of quads, once with a hexagon, and values one",
        "of which is NaN, written and read back. Files that quadcurv does not write come from the library",
        "named; of these meshlane, the extra `formats`, also reads its own, but for Exodus (.e).",
        "",
        "| suffix | written by | quads | polygons | doubles | values in | values out |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row, suffixes in alike.items():
        cells = (row.by, row.quads, row.polygons, row.doubles, row.values_in, row.values_out)
        lines.append(f"| {' '.join(suffixes)} | {' | '.join(cells)} |")
    lines += [
        "",
        '"paired again": stored as triangles, and put together by the order in which trimesh cuts quads.',
        '"cut": polygons of more than four sides come back as triangles. Values at vertices only.',
        "",
    ]
    return "\n".join(lines)


def main(target: Path = TABLE) -> dict[str, Kept]:
    """Try every format and write the table."""
    rows = {suffix: kept(suffix) for suffix in sorted(FORMATS) if FORMATS[suffix].read is not None}
    target.write_text(table(rows), encoding="utf-8")
    return rows


if __name__ == "__main__":
    main()
    print(TABLE.read_text(encoding="utf-8"))
