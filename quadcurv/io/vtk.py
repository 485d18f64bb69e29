"""VTK's own files, and Exodus: polygons and grids, values as they are; VTK reads them elsewhere."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.io.base import Content, polygons
from quadcurv.io.cells import faces_of_cells
from quadcurv.io.isolation import isolated
from quadcurv.types import MeshError

HIDDEN_POINT = 2  # the bit of vtkGhostType that hides a point


def read_vtk(path: Path) -> Content:
    """Polygons, or the one layer of a grid, and all point data."""
    need("vtkmodules")
    if path.suffix.lower() == ".vts":
        _refuse_missing_pieces(path)
    return dataset(*isolated("read_vtk", path))


def dataset(meta: dict[str, Any], arrays: dict[str, NDArray[Any]]) -> Content:
    """What the arrays of a dataset of VTK hold; see :mod:`quadcurv.io.child`."""
    if "points" not in arrays:
        raise MeshError(f"mesh: a {meta['kind']}, expected a PolyData, StructuredGrid or UnstructuredGrid")
    values = {name.removeprefix("value "): v for name, v in arrays.items() if name.startswith("value ")}
    values.update({name: values[name].astype(bool) for name in meta.get("booleans", ()) if name in values})
    points = arrays["points"]
    if "dimensions" in meta:
        shape = tuple(meta["dimensions"])
        if sum(size == 1 for size in shape) != 1 or math.prod(shape) != len(points):
            raise MeshError(f"mesh: a StructuredGrid of dimensions {shape}, expected one layer")
        axis = shape.index(1)
        values = {name: by_row(v, shape, axis) for name, v in values.items() if len(v) == len(points)}
        points = by_row(points, shape, axis)
        ghost = values.get("vtkGhostType")
        if ghost is not None and (ghost & HIDDEN_POINT).any():
            hidden = np.repeat(((ghost & HIDDEN_POINT) > 0)[..., None], 3, axis=-1)
            points = np.ma.masked_array(points, hidden)
        return Content(points, None, values)
    values = {name: v for name, v in values.items() if len(v) == len(points)}
    offsets, corners = arrays["offsets"].astype(np.int64), arrays["corners"]
    if (np.diff(offsets) < 0).any() or (offsets.size and not 0 <= offsets[0] <= offsets[-1] <= len(corners)):
        raise MeshError("mesh: cells that begin and end outside the list of their points")
    corners = corners[offsets[0] : offsets[-1]] if offsets.size else corners[:0]
    if "types" in arrays:
        if len(arrays["types"]) != max(len(offsets) - 1, 0):
            raise MeshError(f"mesh: {len(arrays['types'])} types of {len(offsets) - 1} cells")
        found = faces_of_cells(arrays["types"], np.diff(offsets), corners)
        return Content(points, found.faces, values, notes=found.notes)
    if meta["strips"]:
        raise MeshError(f"mesh: {meta['strips']} triangle strip(s); triangulate() makes them faces")
    left = meta["left_out"]
    notes = (f"{left} cells that are points and lines left out",) if left and offsets.size > 1 else ()
    return Content(points, polygons(np.diff(offsets), corners), values, notes=notes)


def by_row(array: NDArray[Any], shape: tuple[int, ...], axis: int) -> NDArray[Any]:
    """Entries (n, ...), which VTK numbers with the first index fastest, as (r, c, ...)."""
    given = array.reshape(*shape[::-1], *array.shape[1:])
    return np.moveaxis(given, (2, 1, 0), (0, 1, 2)).squeeze(axis=axis)


def _refuse_missing_pieces(path: Path) -> None:
    """VTK leaves memory as it finds it where no piece of a grid lies."""
    head = path.read_bytes().partition(b"<AppendedData")[0]
    extents = [
        [int(word) for word in found.split()]
        for found in re.findall(rb'Extent\s*=\s*["\']([\d\s+-]+)["\']', head)
    ]
    if not extents or any(len(extent) != 6 for extent in extents):
        raise MeshError("mesh: a StructuredGrid without extents")
    whole, *pieces = (
        math.prod(max(high - low, 1) for low, high in zip(e[::2], e[1::2], strict=True)) for e in extents
    )
    if sum(pieces) < whole:
        raise MeshError(f"mesh: {sum(pieces)} of {whole} cells of the StructuredGrid are in the file")
