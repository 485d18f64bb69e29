"""Cells of finite-element codes as polygons: the faces, and of curved ones the corners."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Polygons, polygons
from quadcurv.io.text import runs
from quadcurv.types import Indices, MeshError

# VTK's numbers of cell types by dimension.
_POINTS_AND_LINES = (0, 1, 2, 3, 4, 21, 35, 68, 75)
_TRIANGLES, _QUADS = (5, 22, 34, 69, 76), (8, 9, 23, 28, 30, 70, 77)
_VOLUMES = (*range(10, 17), *range(24, 28), 29, 31, 32, 33, 37, 41, 42, *range(71, 75), *range(78, 83))
POLYGON, QUADRATIC_POLYGON, PIXEL = 7, 36, 8
_DIMENSION = np.full(256, -1, np.int8)
for _types, _dimension in (
    (_POINTS_AND_LINES, 1),
    ((*_TRIANGLES, *_QUADS, POLYGON, QUADRATIC_POLYGON), 2),
    (_VOLUMES, 3),
):
    _DIMENSION[list(_types)] = _dimension
_TYPE_OF_NAME = (  # of meshio and its kin, as the first that fits
    (r"triangle", 5),
    (r"triangle\d+|VTK_LAGRANGE_TRIANGLE", 22),
    (r"quad", 9),
    (r"quad\d+|VTK_LAGRANGE_QUADRILATERAL", 23),
    (r"polygon2", QUADRATIC_POLYGON),
    (r"polygon\d*", POLYGON),
    (r"vertex|line\d*|VTK_LAGRANGE_CURVE", 3),
    (r".*", 10),
)


class Faces(NamedTuple):
    """Polygons, and what is to be said of the cells that are none."""

    faces: Polygons
    notes: tuple[str, ...]


def type_of_name(name: str) -> int:
    """VTK's number of a cell type by its name in meshio and its kin."""
    return next(number for pattern, number in _TYPE_OF_NAME if re.fullmatch(pattern, name))


def faces_of_cells(types: NDArray[Any], sizes: Indices, corners: NDArray[Any]) -> Faces:
    """Polygons of cells of VTK's types, listed one after the other in `corners`.

    Points, lines and, beside faces, volumes are left out; of faces with nodes on their sides the corners are
    taken.

    Raises
    ------
    MeshError
        A ValueError: cells of unknown types, or volumes alone.
    """
    types = np.asarray(types, np.uint8)
    dimension = _DIMENSION[types]
    refused = dimension < 0 if (dimension == 2).any() else (dimension < 0) | (dimension == 3)
    if refused.any():
        first = int(np.argmax(refused))
        raise MeshError(
            f"mesh: {np.count_nonzero(refused)} cells are no polygons, first cell {first} of VTK type "
            f"{types[first]}; extract_surface() takes the outside of volumes"
        )
    kept = dimension == 2
    notes = []
    for dimensions, what in ((1, "cells that are points and lines"), (3, "cells that are volumes")):
        if count := np.count_nonzero(dimension == dimensions):
            notes.append(f"{count} {what} left out")
    begin = np.cumsum(sizes) - sizes
    types, begin, sizes = types[kept], begin[kept], sizes[kept]
    sides = np.where(np.isin(types, _TRIANGLES), 3, np.where(np.isin(types, _QUADS), 4, sizes))
    sides = np.where(types == QUADRATIC_POLYGON, sizes // 2, sides)
    if (sizes < sides).any():
        raise MeshError(f"mesh: cells of {sizes[sizes < sides][0]} nodes are too small for their type")
    if curved := np.count_nonzero(sizes > sides):
        notes.append(f"{curved} faces with nodes on their sides taken by their corners")
    found = np.array(corners[runs(begin, sides)])
    third = (np.cumsum(sides) - 2)[types == PIXEL]
    found[third], found[third + 1] = found[third + 1], found[third]
    return Faces(polygons(sides, found), tuple(notes))
