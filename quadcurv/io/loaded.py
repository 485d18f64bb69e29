"""The faces of the file that a Trimesh was loaded from, if its triangles are still those of the file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.coincidence import first_at_place
from quadcurv.io.base import FORMATS, Content, polygons
from quadcurv.io.text import runs
from quadcurv.ragged import Faces
from quadcurv.types import Indices, MeshError

SUFFIXES = (".obj", ".off", ".ply")  # formats of polygons that trimesh cuts


def source(mesh: Any) -> Path | None:
    """The file that a Trimesh knows it was loaded from, if it is there and has polygons."""
    name = getattr(getattr(mesh, "source", None), "file_path", None)
    if not isinstance(name, str) or not name.lower().endswith(SUFFIXES) or not os.path.isfile(name):
        return None
    return Path(name)


def faces_of_source(path: Path, corners: NDArray[np.float64]) -> tuple[Content, Indices] | None:
    """What the file holds, and for each corner of its faces one of the given corners.

    Parameters
    ----------
    path : Path
    corners : (k, 3, 3) float64
        Positions of the corners of triangles.

    Returns
    -------
    content : Content
    corner : (c,) int64
        For the corners of the file's faces, one after the other, the number 0..3k - 1 of the given corner
        that it is. None instead of both where the file's faces are not cut into exactly these triangles.
    """
    read = FORMATS[path.suffix.lower()].read
    try:
        content = read(path) if read is not None else None
    except (MeshError, OSError):
        return None
    if not isinstance(content, Content) or not len(content.points) or not len(corners):
        return None
    sizes, index = _corners(content.faces)
    if (sizes < 3).any() or index.max(initial=-1) >= len(content.points) or (sizes - 2).sum() != len(corners):
        return None
    place = first_at_place(np.concatenate((corners.reshape(-1, 3), np.asarray(content.points, float))))
    given, ours = place[: 3 * len(corners)].reshape(-1, 3), place[3 * len(corners) :][index]
    # Each face as the fan of triangles (first, j + 1, j + 2), whichever corner a triangle begins with.
    begin = np.cumsum(sizes) - sizes
    second = runs(begin + 1, sizes - 2)
    fan = np.stack((np.repeat(begin, sizes - 2), second, second + 1), axis=-1)
    order, other = (np.lexsort(_from_least(t).T) for t in (ours[fan], given))
    if not np.array_equal(_from_least(ours[fan])[order], _from_least(given)[other]):
        return None
    partner = np.empty(len(corners), np.int64)
    partner[order] = other
    # Corners 0 and 1 of a face lie in its first triangle, corner j in the one where it is the last.
    within = np.arange(len(index)) - np.repeat(begin, sizes)
    first = np.cumsum(sizes - 2) - (sizes - 2)
    triangle = partner[np.repeat(first, sizes) + np.maximum(within - 2, 0)]
    at = np.argmax(given[triangle] == ours[:, None], axis=1)
    return content, 3 * triangle + at


def with_corners(content: Content, vertex: Indices) -> Any:
    """The faces of a file with other vertices at their corners."""
    sizes, _ = _corners(content.faces)
    return polygons(sizes, vertex)


def _corners(faces: Any) -> tuple[Indices, Indices]:
    """Sizes and corners of faces as a reader gives them."""
    if isinstance(faces, np.ndarray):
        table = faces.astype(np.int64)
        return (table >= 0).sum(axis=1), table[table >= 0]
    ragged = Faces.of(faces)
    return ragged.sizes, ragged.corners


def _from_least(triangles: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same triangles turned to begin with their least vertex."""
    turn = (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3
    return np.take_along_axis(triangles, turn, axis=1)
