"""VTK's files written without VTK: doubles and quads kept, every kind of value as it is.

VTK's own writers say nothing of a full disk, or die of it, and do not spell names so that XML survives them.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.io.base import FaceList, Format, Values, register
from quadcurv.io.cells import POLYGON
from quadcurv.io.isolation import isolated
from quadcurv.io.vtk import read_vtk
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError

_XML_TYPES = {"f": "Float", "i": "Int", "u": "UInt"}
_LEGACY_TYPES = {
    "u1": "unsigned_char",
    "i1": "signed_char",
    "u2": "unsigned_short",
    "i2": "short",
    "u4": "unsigned_int",
    "i4": "int",
    "u8": "vtktypeuint64",
    "i8": "vtktypeint64",
    "f4": "float",
    "f8": "double",
}
_BOOLEANS = "_PYVISTA_BITARRAY_POINT_"  # pyvista's list of the arrays that are booleans


class Appended:
    """Arrays whose bytes follow the XML."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self.offset = 0

    def add(self, name: str, array: NDArray[Any]) -> str:
        """The element that stands for an array."""
        stored = _plain(array).astype(f"<{_plain(array).dtype.str[1:]}")
        kind = f"{_XML_TYPES[stored.dtype.kind]}{8 * stored.dtype.itemsize}"
        width = stored.shape[1] if stored.ndim == 2 else 1
        element = (
            f'<DataArray type="{kind}" Name={_attribute(name)} NumberOfComponents="{width}" '
            f'format="appended" offset="{self.offset}"/>'
        )
        self.blocks += [stored.nbytes.to_bytes(8, "little"), stored.tobytes()]
        self.offset += 8 + stored.nbytes
        return element


def _attribute(name: str) -> str:
    from xml.sax.saxutils import quoteattr  # which imports all that fetches files from elsewhere

    return quoteattr(_checked(name))


def _checked(name: str) -> str:
    if any(ord(letter) < 32 for letter in name):
        raise MeshError(f"point_data: {name!r} is no name in a file of VTK, which has no control characters")
    return name


def _plain(array: NDArray[Any]) -> NDArray[Any]:
    """The same in a type that VTK has."""
    if array.dtype.kind == "b":
        return array.astype(np.uint8)
    if array.dtype.kind == "f" and array.dtype.itemsize not in (4, 8):
        return array.astype(np.float32 if array.dtype.itemsize < 4 else np.float64)
    return array


def _active(values: Values) -> dict[str, str]:
    """Which of the values are the scalars, vectors and normals that a viewer shows first."""
    found: dict[str, str] = {}
    for name, array in values.items():
        if array.ndim == 1:
            found.setdefault("Scalars", name)
        else:
            found.setdefault("Normals" if name.lower() in ("normal", "normals") else "Vectors", name)
    return found


def _xml(path: Path, kind: str, piece: str, data: Appended, body: list[str], values: Values) -> None:
    """A file of one piece whose `body` are points and cells."""
    active = "".join(f" {what}={_attribute(name)}" for what, name in _active(values).items())
    booleans = [name for name, array in values.items() if array.dtype.kind == "b"]
    letters = " ".join(str(letter) for name in booleans for letter in (*name.encode(), 0))
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="{kind}" version="1.0" byte_order="LittleEndian" header_type="UInt64">',
        f"<{kind}>",
        f'<FieldData><Array type="String" Name="{_BOOLEANS}" NumberOfTuples="{len(booleans)}" format="ascii">'
        f"{letters}</Array></FieldData>"
        if booleans
        else "",
        f"<Piece {piece}>",
        f"<PointData{active}>",
        *(data.add(name, array) for name, array in values.items()),
        "</PointData>",
        *body,
        "</Piece>",
        f"</{kind}>",
        '<AppendedData encoding="raw">',
    ]
    with path.open("wb") as file:
        file.write("\n".join(line for line in lines if line).encode())
        file.write(b"\n_")
        for block in data.blocks:
            file.write(block)
        file.write(b"\n</AppendedData>\n</VTKFile>\n")


class _Cells(NamedTuple):
    ends: NDArray[Any]
    corners: NDArray[Any]


def _cells(faces: FaceList) -> _Cells:
    ends = np.cumsum(faces.sizes)
    return _Cells(ends.astype(np.int32 if len(faces.corners) < 2**31 else np.int64), faces.corners)


def write_vtp(path: Path, mesh: QuadMesh, values: Values) -> None:
    """PolyData."""
    data, faces = Appended(), FaceList.of(mesh)
    cells = _cells(faces)
    body = [
        f"<Points>{data.add('Points', mesh.points)}</Points>",
        f"<Polys>{data.add('connectivity', cells.corners)}{data.add('offsets', cells.ends)}</Polys>",
    ]
    piece = f'NumberOfPoints="{len(mesh.points)}" NumberOfPolys="{len(faces.sizes)}"'
    _xml(path, "PolyData", piece, data, body, values)


def write_vtu(path: Path, mesh: QuadMesh, values: Values) -> None:
    """UnstructuredGrid of triangles, quads and polygons."""
    data, faces = Appended(), FaceList.of(mesh)
    cells = _cells(faces)
    types = np.select([faces.sizes == 3, faces.sizes == 4], [5, 9], POLYGON).astype(np.uint8)
    arrays = {"connectivity": cells.corners, "offsets": cells.ends, "types": types}
    body = [
        f"<Points>{data.add('Points', mesh.points)}</Points>",
        f"<Cells>{''.join(data.add(name, array) for name, array in arrays.items())}</Cells>",
    ]
    piece = f'NumberOfPoints="{len(mesh.points)}" NumberOfCells="{len(faces.sizes)}"'
    _xml(path, "UnstructuredGrid", piece, data, body, values)


def write_legacy(path: Path, mesh: QuadMesh, values: Values) -> None:
    """PolyData of the legacy format, binary, which every version of VTK reads."""
    faces, active = FaceList.of(mesh), _active(values)
    begin = np.cumsum(faces.sizes) - faces.sizes
    rows = np.insert(faces.corners, begin, faces.sizes)
    blocks = [
        b"# vtk DataFile Version 3.0\nquadcurv\nBINARY\nDATASET POLYDATA\n",
        f"POINTS {len(mesh.points)} double\n".encode(),
        _big_endian(mesh.points),
        f"POLYGONS {len(faces.sizes)} {len(rows)}\n".encode(),
        _big_endian(rows.astype(np.int32)),
        f"POINT_DATA {len(mesh.points)}\n".encode(),
    ]
    fields = []
    for name, array in values.items():
        word, kind = _percent(name), _LEGACY_TYPES[_plain(array).dtype.str[1:]]
        if active.get("Scalars") == name:
            blocks.append(f"SCALARS {word} {kind} 1\nLOOKUP_TABLE default\n".encode())
            blocks.append(_big_endian(array))
        elif name in active.values():
            what = "NORMALS" if active.get("Normals") == name else "VECTORS"
            blocks += [f"{what} {word} {kind}\n".encode(), _big_endian(array)]
        else:
            width = array.shape[1] if array.ndim == 2 else 1
            fields += [f"{word} {width} {len(array)} {kind}\n".encode(), _big_endian(array)]
    if fields:
        blocks += [f"FIELD FieldData {len(fields) // 2}\n".encode(), *fields]
    with path.open("wb") as file:
        for block in blocks:
            file.write(block)


def _big_endian(array: NDArray[Any]) -> bytes:
    plain = _plain(array)
    return plain.astype(plain.dtype.newbyteorder(">")).tobytes() + b"\n"


def _percent(name: str) -> str:
    """A name as VTK spells it in its legacy files, where a space ends a word."""
    return quote(_checked(name), safe="!#$&'()*+,-./:;<=>?@[\\]^_`{|}~")


def write_vtkhdf(path: Path, mesh: QuadMesh, values: Values) -> None:
    """PolyData in HDF5, by VTK from a .vtp file beside."""
    need("vtkmodules")
    beside = path.with_suffix(".vtp")
    try:
        write_vtp(beside, mesh, values)
        isolated("write_vtkhdf", beside)
    finally:
        beside.unlink(missing_ok=True)
    if not path.exists() or not os.path.getsize(path):
        raise OSError(f"VTK wrote nothing to {path}")


register(Format((".vtp",), read_vtk, write_vtp, holds_values=True))
register(Format((".vtu",), read_vtk, write_vtu, holds_values=True))
register(Format((".vtk",), read_vtk, write_legacy, holds_values=True))
register(Format((".vtkhdf",), read_vtk, write_vtkhdf, holds_values=True))
register(Format((".vts", ".e", ".exo", ".ex2"), read_vtk))
