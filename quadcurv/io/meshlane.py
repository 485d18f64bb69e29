"""Files of finite-element codes by meshlane, and objects with `points` and `cells`, as those of its kin."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.io.base import Content, Format, Library, polygons, register
from quadcurv.io.cells import faces_of_cells, type_of_name
from quadcurv.io.isolation import isolated

Block = tuple[str, NDArray[Any], NDArray[Any]]  # type of its cells, their sizes, their nodes


def read_meshlane(path: Path) -> Content:
    """Faces and point data."""
    need("meshlane")
    answer, arrays = isolated("read_meshlane", path)
    blocks = [(name, arrays[f"{k} sizes"], arrays[f"{k} corners"]) for k, name in enumerate(answer["names"])]
    values = {name.removeprefix("value "): v for name, v in arrays.items() if name.startswith("value ")}
    content = _content(arrays["points"], blocks, values)
    return replace(content, notes=(*content.notes, *answer["notes"]))


def _content(points: NDArray[Any], blocks: list[Block], values: dict[str, NDArray[Any]]) -> Content:
    if points.ndim == 2 and points.shape[1] == 2:  # of a flat mesh
        points = np.insert(points, 2, 0.0, axis=1)
    types = [np.full(len(sizes), type_of_name(name)) for name, sizes, _ in blocks]
    none = [np.empty(0, np.int64)]
    found = faces_of_cells(
        np.concatenate(types + none),
        np.concatenate([sizes for _, sizes, _ in blocks] + none),
        np.concatenate([corners.astype(np.int64) for *_, corners in blocks] + none),
    )
    values = {name: array for name, array in values.items() if len(array) == len(points)}
    return Content(points, found.faces, values, notes=found.notes)


def content(mesh: Any) -> Content:
    """Faces of an object with `points`, and with `cells` that are blocks of one type or polygons."""
    points, cells = (np.asarray(mesh.points), mesh.cells)
    data = getattr(mesh, "point_data", None) or {}
    values = {name: np.asarray(v) for name, v in data.items()} if isinstance(data, Mapping) else {}
    if isinstance(cells, Mapping):
        cells = list(cells.items())
    blocks = [_block(block) for block in cells]
    if all(name for name, *_ in blocks):
        return _content(points, blocks, values)
    _, sizes, corners = _block((None, cells))
    return Content(points, polygons(sizes, corners), values)


def _block(block: Any) -> Block:
    """A block of cells, or a pair of type and cells; without a name of what is neither."""
    if hasattr(block, "type") and hasattr(block, "data"):
        name, rows = block.type, block.data
    elif isinstance(block, tuple) and len(block) == 2 and isinstance(block[0], str | None):
        name, rows = block
    else:
        return "", np.empty(0, np.int64), np.empty(0, np.int64)
    corners = [np.empty(0, np.int64), *(np.asarray(row, np.int64) for row in rows)]
    return name or "", np.array([len(row) for row in corners[1:]], np.int64), np.concatenate(corners)


def _has_cells(mesh: Any) -> bool:
    return hasattr(mesh, "points") and hasattr(mesh, "cells") and not callable(mesh.cells)


register(Library(("meshio", "meshlane", "vedo"), content, takes=_has_cells))
register(
    Format(
        (".msh", ".inp", ".med", ".xdmf", ".xmf", ".avs", ".ugrid", ".mesh", ".bdf", ".nas"), read_meshlane
    )
)
