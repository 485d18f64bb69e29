"""PLY files, text and binary: polygons, doubles, and values at the vertices.

The libraries at hand do not keep both polygons and doubles: trimesh splits polygons and cannot read
binary files with faces of several sizes, VTK reads single precision, plyfile is GPL.
"""

from __future__ import annotations

import re
import struct
from array import array
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Content, FaceList, Format, Values, polygons, register
from quadcurv.io.colours import viridis
from quadcurv.io.text import numbers, runs
from quadcurv.mesh import QuadMesh
from quadcurv.types import Indices, MeshError, PrecisionWarning, warn

CODES = {
    **dict.fromkeys(("char", "int8"), "b"),
    **dict.fromkeys(("uchar", "uint8"), "B"),
    **dict.fromkeys(("short", "int16"), "h"),
    **dict.fromkeys(("ushort", "uint16"), "H"),
    **dict.fromkeys(("int", "int32"), "i"),
    **dict.fromkeys(("uint", "uint32"), "I"),
    **dict.fromkeys(("long", "int64", "longlong"), "q"),
    **dict.fromkeys(("ulong", "uint64", "ulonglong"), "Q"),
    **dict.fromkeys(("float", "float32"), "f"),
    **dict.fromkeys(("double", "float64"), "d"),
}
COLOURS_OF = "colours of "  # begins the comment that says which values red, green, blue and alpha show
COLOURS = ("red", "green", "blue", "alpha")
NORMAL = ("nx", "ny", "nz")
CORNERS = ("vertex_indices", "vertex_index", "vertexindices", "vertexindex")
_ROWS = 1 << 16  # elements gathered together, so that memory does not grow with them


class Property(NamedTuple):
    """A property of an element by its code in `struct`; `size` is that of a list's length, "" of a scalar."""

    name: str
    item: str
    size: str


class Element(NamedTuple):
    """A kind of element, how many there are, and what each has."""

    name: str
    number: int
    properties: list[Property]


class Header(NamedTuple):
    """What a file says of itself; `order` is "" of text, `begin` the first byte after it."""

    order: str
    elements: dict[str, Element]
    comments: list[str]
    begin: int


def read_ply(path: Path) -> Content:
    """Positions, polygons and triangle strips, and what else the vertices have."""
    data = path.read_bytes()
    try:
        header = _header(data)
        body, order, offset, columns = data, header.order or "=", header.begin, {}
        if not header.order:
            body, offset = numbers(data[header.begin :]).tobytes(), 0
        for element in header.elements.values():
            if not header.order:  # numbers as text: from here on doubles
                doubles = [p._replace(item="d", size=p.size and "d") for p in element.properties]
                element = element._replace(properties=doubles)
            columns[element.name], offset = _columns(body, offset, order, element)
        points = np.stack([columns["vertex"][axis] for axis in "xyz"], axis=-1)
        sizes, corners = _faces(columns, header)
    except (ValueError, TypeError, OverflowError, struct.error) as error:
        raise MeshError(f"not a PLY file: {error}") from None
    except KeyError as error:
        raise MeshError(f"not a PLY file of a mesh: no {error}") from None
    values = _values(columns["vertex"], header.comments)
    return Content(points.astype(points.dtype.newbyteorder("=")), polygons(sizes, corners), values)


def _header(data: bytes) -> Header:
    begin = len(data) - len(data.removeprefix(b"\xef\xbb\xbf"))
    first = re.compile(rb"ply[ \t]*(\r\n|\n|\r)").match(data, begin)
    if not first:
        raise ValueError("it does not begin with 'ply'")
    begin, lines = first.end(), list[str]()
    while not lines or lines[-1] != "end_header":
        end = data.find(first[1], begin)
        if end < 0:
            raise ValueError("its header does not end")
        lines.append(data[begin:end].decode("ascii", errors="replace").strip())
        begin = end + len(first[1])
    order, elements, comments = None, dict[str, Element](), list[str]()
    properties: list[Property] = []
    for line in lines[:-1]:
        match line.split():
            case [] | ["obj_info", *_]:
                pass
            case ["comment", *_]:
                comments.append(line.removeprefix("comment").strip())
            case ["format", kind, _]:
                order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}.get(kind)
            case ["element", name, count] if name not in elements:
                elements[name] = Element(name, int(count), properties := [])
            case ["property", "list", size, item, name]:
                properties.append(Property(name, CODES[item], CODES[size]))
            case ["property", item, name]:
                properties.append(Property(name, CODES[item], ""))
            case _:
                raise ValueError(f"header line {line!r}")
    if order is None:
        raise ValueError("no known format in its header")
    return Header(order, elements, comments, begin)


def _columns(body: bytes, offset: int, order: str, element: Element) -> tuple[dict[str, Any], int]:
    """Columns of an element, lists as (sizes, items), and where the next element begins."""
    _, count, properties = element
    if count <= 0 or not properties:
        return {}, offset
    least = sum(struct.calcsize(order + (p.size or p.item)) for p in properties)
    if offset + count * least > len(body):
        raise ValueError(f"buffer is smaller than its {count} elements {element.name!r}")
    table = _table(body, offset, order, element)
    if table is None:
        return _walked(body, offset, order, element)
    columns: dict[str, Any] = {p.name: table[p.name] for p in properties if not p.size}
    for p in properties:
        if p.size:
            columns[p.name] = table[f"{p.name} size"], table[p.name].ravel()
    return columns, offset + table.nbytes


def _table(body: bytes, offset: int, order: str, element: Element) -> NDArray[Any] | None:
    """The element as a table if every list is as long as the first of its name, as in most files."""
    fields: list[tuple[Any, ...]] = []
    end = offset
    for name, item, size in element.properties:
        if size:
            if end + struct.calcsize(order + size) > len(body):
                return None
            length = _length(struct.unpack_from(order + size, body, end)[0])
            fields += [(f"{name} size", order + size), (name, order + item, (length,))]
        else:
            fields.append((name, order + item))
        end = offset + np.dtype(fields).itemsize
    row = np.dtype(fields)
    if offset + element.number * row.itemsize > len(body):
        return None
    table = np.frombuffer(body, row, element.number, offset)
    uniform = all(
        (table[f"{p.name} size"] == table[p.name].shape[1]).all() for p in element.properties if p.size
    )
    return table if uniform else None


def _length(value: float) -> int:
    if not (value >= 0 and value == int(value)):
        raise ValueError(f"a list of {value:g} items")
    return int(value)


def _walked(body: bytes, offset: int, order: str, element: Element) -> tuple[dict[str, Any], int]:
    """Columns of an element whose lists have different lengths: found row by row."""
    lists = [p for p in element.properties if p.size]
    # Where each property stands, counted from the beginning of the row or the end of the list before.
    place: dict[str, tuple[int, int]] = {}
    since, gaps, rest = 0, [], 0
    for p in element.properties:
        place[p.name] = since, rest
        if p.size:
            gaps.append(rest)
            since, rest = since + 1, 0
        else:
            rest += struct.calcsize(order + p.item)
    steps = [
        (gap, struct.Struct(order + p.size), struct.calcsize(order + p.item))
        for gap, p in zip(gaps, lists, strict=True)
    ]
    ends, lengths = [array("q") for _ in range(len(lists) + 1)], [array("q") for _ in lists]
    for _ in range(element.number):
        ends[0].append(offset)
        for k, (gap, size, width) in enumerate(steps):
            if offset + gap + size.size > len(body):
                raise ValueError(f"buffer is smaller than its {element.number} elements {element.name!r}")
            length = _length(size.unpack_from(body, offset + gap)[0])
            offset += gap + size.size + length * width
            lengths[k].append(length)
            ends[k + 1].append(offset)
        offset += rest
        if offset > len(body):
            raise ValueError(f"buffer is smaller than its {element.number} elements {element.name!r}")
    end = [np.frombuffer(e, np.int64) for e in ends]
    columns: dict[str, Any] = {}
    single = np.ones(element.number, np.int64)
    for p in element.properties:
        since, gap = place[p.name]
        if p.size:
            sides = np.frombuffer(lengths[since], np.int64)
            begin = end[since + 1] - sides * struct.calcsize(order + p.item)
            columns[p.name] = sides, _items(body, begin, sides, order + p.item)
        else:
            columns[p.name] = _items(body, end[since] + gap, single, order + p.item)
    return columns, offset


def _items(body: bytes, begin: Indices, count: Indices, code: str) -> NDArray[Any]:
    """`count` items from each place on."""
    data, kind = np.frombuffer(body, np.uint8), np.dtype(code)
    found = []
    for k in range(0, len(begin), _ROWS):
        rows = slice(k, k + _ROWS)
        byte = runs(begin[rows], count[rows] * kind.itemsize)
        found.append(data[byte].view(kind))
    return np.concatenate(found)


def _faces(columns: dict[str, dict[str, Any]], header: Header) -> tuple[Any, Any]:
    """Sizes and corners of polygons, and of the triangles of strips."""
    sizes, corners = [np.empty(0, np.int64)], [np.empty(0, np.int64)]
    for name in ("face", "tristrips"):
        if name not in header.elements or not columns[name]:
            continue
        lists = [
            p.name
            for p in header.elements[name].properties
            if p.size and (p.item not in "fd" or p.name.lower() in CORNERS)
        ]
        lists.sort(key=lambda key: key.lower() not in CORNERS)
        if not lists:
            raise KeyError("list of vertices")
        size, corner = columns[name][lists[0]]
        if name == "tristrips":
            size, corner = _triangles(np.asarray(size, np.int64), corner)
        sizes.append(size)
        corners.append(corner)
    return np.concatenate(sizes), np.concatenate(corners)


def _triangles(sizes: Indices, corners: NDArray[Any]) -> tuple[Indices, NDArray[Any]]:
    """Triangles of strips, which end at -1 or with their list; every other one is turned."""
    head = np.zeros(len(corners) + 1, bool)
    head[np.append(0, np.cumsum(sizes))] = True
    head[1:] |= corners == -1
    begin = np.maximum.accumulate(np.where(head, np.arange(len(head)), 0))[: len(corners)]
    at = np.arange(max(len(corners) - 2, 0))
    at = at[(begin[at] == begin[at + 2]) & (corners[at + 2] != -1)]
    odd = (at - begin[at]) % 2
    triangles = np.stack((corners[at + odd], corners[at + 1 - odd], corners[at + 2]), axis=-1)
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]  # strips turn corners by repeating a vertex
    return np.full(len(triangles), 3), triangles.ravel()


def _values(vertex: dict[str, Any], comments: list[str]) -> dict[str, NDArray[Any]]:
    """Scalars, and vectors NAME_x, NAME_y, NAME_z in one; no colours that only show one of them."""
    shown = any(line.startswith(COLOURS_OF) for line in comments)
    left = {
        name: column.astype(column.dtype.newbyteorder("="))
        for name, column in vertex.items()
        if name not in ("x", "y", "z") and not isinstance(column, tuple) and not (shown and name in COLOURS)
    }
    values: dict[str, NDArray[Any]] = {}
    for name in list(left):
        base = "normal" if name == "nx" else name.removesuffix("_x")
        keys = NORMAL if name == "nx" else tuple(f"{base}_{axis}" for axis in "xyz")
        if base != name and all(key in left for key in keys):
            values[base] = np.stack([left.pop(key) for key in keys], axis=-1)
        elif name in left:
            values[name] = left[name]
    return values


def write_ply(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Binary; values (n,) as a property of that name, (n, 3) as name_x, name_y, name_z.

    Values named "normal" or "normals" become nx, ny, nz, which other readers take for normals, and the first
    scalars are shown as colours too. Booleans are stored as uchar, integers as int where they fit, single
    precision as float, all else as double.

    Raises
    ------
    MeshError
        A ValueError: names that repeat, or that a header of words and lines cannot hold.
    """
    columns = dict(zip("xyz", mesh.points.T, strict=True))
    given = 3
    for name, array_ in values.items():
        given += array_.size // len(array_)
        if array_.ndim == 1:
            columns[name] = array_
        else:
            normal = name.lower() in ("normal", "normals")
            keys = NORMAL if normal else [f"{name}_{axis}" for axis in "xyz"]
            columns.update(zip(keys, array_.T, strict=True))
    if len(columns) < given:
        raise MeshError(f"point_data: names {list(values)} repeat each other's or x, y, z in a PLY file")
    for name in columns:
        if not re.fullmatch("[!-~]+", name) or "end_header" in name:
            raise MeshError(f"point_data: {name!r} is no PLY name: one word of ASCII, not 'end_header'")
    header = ["ply", "format binary_little_endian 1.0"]
    scalars = next((name for name, array_ in values.items() if array_.ndim == 1), None)
    if scalars is not None and not set(COLOURS) & set(columns):
        header.append(f"comment {COLOURS_OF}{scalars}")
        columns.update(zip(COLOURS, viridis(values[scalars]).T, strict=True))
    vertices = np.empty(len(mesh.points), [(name, _stored(name, column)) for name, column in columns.items()])
    for name, column in columns.items():
        vertices[name] = column
    header.append(f"element vertex {len(mesh.points)}")
    spelled = {"u1": "uchar", "i4": "int", "f4": "float", "f8": "double"}
    header += [f"property {spelled[vertices.dtype[name].str[1:]]} {name}" for name in columns]
    faces = FaceList.of(mesh)
    small = bool(faces.sizes.max() < 256)
    header.append(f"element face {len(faces.sizes)}")
    header += [f"property list {'uchar' if small else 'int'} int vertex_indices", "end_header", ""]
    begin, corners = np.cumsum(faces.sizes) - faces.sizes, faces.corners.astype("<i4")
    rows = (
        np.insert(corners.view(np.uint8), 4 * begin, faces.sizes)
        if small
        else np.insert(corners, begin, faces.sizes)
    )
    path.write_bytes("\n".join(header).encode("ascii") + vertices.tobytes() + rows.tobytes())


def _stored(name: str, column: NDArray[Any]) -> str:
    """Type of a column in the file."""
    if column.dtype.kind == "b" or column.dtype == np.uint8:
        return "<u1"
    if column.dtype.kind == "f":
        return "<f4" if column.dtype.itemsize <= 4 else "<f8"
    int32 = np.iinfo(np.int32)
    low, high = int(column.min()), int(column.max())
    if int32.min <= low and high <= int32.max:
        return "<i4"
    if max(-low, high) > 2**53:
        text = f"{name}: integers up to {max(-low, high)} are rounded to doubles in a PLY file"
        warn(text, PrecisionWarning)
    return "<f8"


register(Format((".ply",), read_ply, write_ply, holds_values=True))
