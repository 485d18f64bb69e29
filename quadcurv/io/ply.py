"""PLY files, text and binary: polygons, doubles, and values at the vertices.

The libraries at hand do not keep both polygons and doubles: trimesh splits polygons and cannot read
binary files with faces of several sizes, VTK reads single precision, plyfile is GPL.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError

PlyElements = dict[str, tuple[int, list[tuple[str, ...]]]]
PLY_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}


def read_ply(path: Path) -> Content:
    """Positions and polygons of a PLY file, ASCII or binary."""
    header, _, body = path.read_bytes().partition(b"end_header")
    try:
        order, elements = _ply_header(header.decode("ascii", errors="replace"))
        if order:
            offset = 2 if body.startswith(b"\r\n") else 1
        else:  # numbers as text: from here on doubles
            body, order, offset = np.array(body.split(), float).tobytes(), "=", 0
            elements = {e: (n, [(k, *["f8"] * len(t)) for k, *t in p]) for e, (n, p) in elements.items()}
        data: dict[str, dict[str, Any]] = {}
        for element, (count, properties) in elements.items():
            data[element], offset = _ply_element(body, offset, order, count, properties)
        points = np.stack([data["vertex"][axis] for axis in "xyz"], axis=-1).astype(float)
        faces = data.get("face", {})
        names = [k for k in ("vertex_indices", "vertex_index") if k in faces]
        sizes, corners = faces[names[0]] if names else ([], [])
    except (ValueError, TypeError, OverflowError) as error:
        raise MeshError(f"not a PLY file: {error}") from None
    except KeyError as error:
        raise MeshError(f"not a PLY file of a mesh: no {error}") from None
    return Content(points, polygons(sizes, corners))


def _ply_header(header: str) -> tuple[str, PlyElements]:
    """Byte order ("" for ASCII), and for every element how many there are and (name, type, type) ..."""
    first, *lines = header.split("\n")
    if first.strip() != "ply":
        raise ValueError("it does not begin with 'ply'")
    order, elements = None, PlyElements()
    properties: list[tuple[str, ...]] = []
    for line in lines:
        match line.split():
            case ["format", kind, _]:
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}.get(kind)
            case ["element", name, count]:
                properties = []
                elements[name] = int(count), properties
            case ["property", "list", count_type, item_type, name]:
                properties.append((name, PLY_TYPES[count_type], PLY_TYPES[item_type]))
            case ["property", item_type, name]:
                properties.append((name, PLY_TYPES[item_type]))
            case ["property" | "element" | "format", *_]:
                raise ValueError(f"header line {line.strip()!r}")
    if order is None:
        raise ValueError("no known format in its header")
    return order, elements


def _ply_element(
    body: bytes, offset: int, order: str, count: int, properties: list[tuple[str, ...]]
) -> tuple[dict[str, Any], int]:
    """Columns of an element, lists as (sizes, items), and where the next element begins."""
    if count <= 0:
        return {}, offset
    # As if every list were as long as the first of its name; true of most files.
    fields: list[tuple[Any, ...]] = []
    end = offset
    for name, *types in properties:
        if len(types) == 2:
            length = int(np.frombuffer(body, order + types[0], 1, end)[0])
            fields += [(f"{name} size", order + types[0]), (name, order + types[1], (max(length, 0),))]
        else:
            fields.append((name, order + types[0]))
        end = offset + np.dtype(fields).itemsize
    lists = [name for name, *types in properties if len(types) == 2]
    row = np.dtype(fields)
    if not lists or offset + count * row.itemsize <= len(body):
        table = np.frombuffer(body, row, count, offset)
        if all((table[f"{k} size"] == table[k].shape[1]).all() for k in lists):
            columns: dict[str, Any] = {name: table[name] for name, *_ in properties}
            for k in lists:
                columns[k] = table[f"{k} size"], table[k].ravel()
            return columns, offset + table.nbytes
    ragged: dict[str, list[Any]] = {name: [] for name, *_ in properties}
    for _ in range(count):
        for name, *types in properties:
            length = 1
            if len(types) == 2:
                length = int(np.frombuffer(body, order + types[0], 1, offset)[0])
                offset += np.dtype(types[0]).itemsize
                if length < 0:
                    raise ValueError(f"a list of {length} items")
            ragged[name].append(np.frombuffer(body, order + types[-1], length, offset) if length else ())
            offset += length * np.dtype(types[-1]).itemsize
    columns = {name: np.concatenate(items) for name, items in ragged.items()}
    for k in lists:
        columns[k] = [len(items) for items in ragged[k]], columns[k]
    return columns, offset


def write_ply(path: Path, mesh: QuadMesh, point_data: Values) -> None:
    """Binary PLY; values (n,) as a property of that name, (n, 3) as name_x, name_y, name_z.

    Values named "normal" or "normals" become nx, ny, nz, which other readers take for normals. Booleans
    are stored as uchar, integers as int where they fit, all else as double.

    Raises
    ------
    MeshError
        A ValueError: names that repeat, or are no words of ASCII.
    """
    points, faces = mesh.points, FaceList.of(mesh)
    columns = dict(zip("xyz", points.T, strict=True))
    for name, values in point_data.items():
        if values.ndim == 1:
            columns[name] = values
        else:
            keys = (
                ["nx", "ny", "nz"]
                if name.lower() in ("normal", "normals")
                else [f"{name}_{k}" for k in "xyz"]
            )
            columns.update(zip(keys, values.T, strict=True))
    if len(columns) < 3 + sum(v.size for v in point_data.values()) // len(points):
        raise MeshError(f"point_data: names {list(point_data)} repeat each other's or x, y, z in a PLY file")
    if bad := [name for name in columns if not name.isascii() or len(name.split()) != 1]:
        raise MeshError(f"point_data: {bad[0]!r} is no PLY name: one word of ASCII letters")
    vertices = np.empty(len(points), [(name, _ply_type(values)) for name, values in columns.items()])
    for name, values in columns.items():
        vertices[name] = values
    spelled = {"u1": "uchar", "i4": "int", "f8": "double"}
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {len(points)}"]
    header += [f"property {spelled[vertices.dtype[k].str[1:]]} {k}" for k in columns]
    small = faces.sizes.max() < 256
    header += [f"element face {len(faces.sizes)}"]
    header += [f"property list {'uchar' if small else 'int'} int vertex_indices", "end_header", ""]
    begin = np.cumsum(faces.sizes) - faces.sizes
    corners = faces.corners.astype("<i4")
    rows = (
        np.insert(corners.view(np.uint8), 4 * begin, faces.sizes)
        if small
        else np.insert(corners, begin, faces.sizes)
    )
    path.write_bytes("\n".join(header).encode("ascii") + vertices.tobytes() + rows.tobytes())


def _ply_type(values: NDArray[Any]) -> str:
    if values.dtype.kind == "b":
        return "<u1"
    int32 = np.iinfo(np.int32)
    if values.dtype.kind in "iu" and int32.min <= values.min() and values.max() <= int32.max:
        return "<i4"
    return "<f8"


register(Format((".ply",), read_ply, write_ply, holds_values=True))
