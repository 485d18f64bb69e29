"""What is refused of a mesh, and how it is said: which argument, where first, how often."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from quadcurv.stencils import face_pairs
from quadcurv.types import Bools, Floats, Ints, MeshError

_LARGEST = 1e70


def _first_and_count(bad: Any) -> tuple[int, int]:
    return int(np.argmax(bad)), int(np.count_nonzero(bad))


def checked_points(points: ArrayLike, name: str, shape: tuple[Any, ...]) -> Floats:
    """Read-only C-contiguous float64; a number in `shape` is required, a letter is free."""
    try:
        given = np.asarray(points)
    except (ValueError, OverflowError):  # rows of different lengths, integers beyond all floats
        given = np.empty(0, object)
    if np.ma.is_masked(points):
        raise MeshError(f"{name}: masked entries, expected a number in each")
    if given.dtype.kind not in "fiu":
        raise MeshError(f"{name}: expected real numbers, got dtype {given.dtype}")
    if given.ndim != len(shape) or any(
        isinstance(want, int) and have != want for have, want in zip(given.shape, shape, strict=True)
    ):
        raise MeshError(f"{name}: shape {given.shape}, expected ({', '.join(map(str, shape))})")
    with np.errstate(over="ignore"):  # of long doubles; they are found below
        array = np.ascontiguousarray(given, dtype=np.float64).view()
    array.flags.writeable = False
    extremes = _extremes(array)
    if not np.isfinite(extremes).all():  # both are NaN if any entry is
        first, count = _first_and_count(~np.isfinite(array.reshape(-1, 3)).all(axis=1))
        where = np.unravel_index(first, array.shape[:-1])
        at = first if array.ndim == 2 else tuple(map(int, where))
        raise MeshError(f"{name}: {count} non-finite point(s), first vertex {at}: {array[where]}")
    if array.size:
        rows = array.reshape(-1, 3)
        # The square of an area, hence the fourth power of a length, must neither overflow nor vanish.
        if np.abs(extremes).max() > _LARGEST:
            first, count = _first_and_count((np.abs(rows) > _LARGEST).any(axis=1))
            raise MeshError(
                f"{name}: {count} point(s) beyond {_LARGEST:g}, whose areas overflow, first vertex {first}"
            )
        if np.ptp(rows[:: len(rows) // 8 + 1], axis=0).max() < 1 / _LARGEST and (
            0 < np.ptp(rows, axis=0).max() < 1 / _LARGEST
        ):
            raise MeshError(f"{name}: all within {1 / _LARGEST:g} of each other, where areas vanish")
    return array


def _extremes(array: Floats) -> tuple[float, float]:
    """Least and largest entry, both NaN if any entry is; 0 of an empty array."""
    from quadcurv.kernels import ranges

    if array.size == 0:
        return 0.0, 0.0
    found = []

    def look(start: int, stop: int) -> None:
        part = array[start:stop]
        with np.errstate(invalid="ignore"):
            found.append((part.min(), part.max()))

    ranges.over(look, len(array), array.size // 3)
    low, high = np.transpose(found)
    return low.min(), high.max()


def checked_wrap(wrap: Sequence[bool]) -> tuple[bool, bool]:
    """Two booleans."""
    given = list(wrap) if np.iterable(wrap) else []
    if len(given) != 2 or not all(isinstance(w, bool | np.bool_) for w in given):
        raise MeshError(f"wrap: expected two booleans, got {wrap!r}")
    return bool(given[0]), bool(given[1])


def checked_faces(faces: Any, points: Floats) -> tuple[Ints, NDArray[np.int64] | None, int]:
    """Faces as (m, 4) int32, the given face each stems from (None: itself), and how many were split."""
    from quadcurv.kernels import topology

    if len(points) == 0:
        raise MeshError("points: none given")
    try:
        given = np.asarray(faces)
    except ValueError:  # polygons of different lengths
        given = np.empty(0, object)
    if np.ma.is_masked(faces):
        raise MeshError("faces: masked entries, expected an index in each")
    if given.ndim == 2 and given.shape[1] in (3, 4) and given.dtype.kind in "iu":
        if given.dtype == np.uint64:  # the largest must not come out as -1
            given = np.minimum(given, np.uint64(np.iinfo(np.int64).max))
        table = np.ascontiguousarray(given, np.int32 if given.dtype == np.int32 else np.int64).view()
        source, n_split = None, 0
    elif given.ndim == 2 and given.shape[1] in (3, 4):
        raise MeshError(f"faces: expected integer indices, got dtype {given.dtype}")
    else:
        table, source, n_split = _from_polygons(faces, points)
    if len(table) == 0:
        raise MeshError("faces: none given")
    n = len(points)
    if n > np.iinfo(np.int32).max // 4:
        raise MeshError(f"points: {n} are more than 32-bit indices can number")
    table.flags.writeable = False  # of one type for the compiler, whatever the caller's is
    checked = np.empty((len(table), 4), np.int32)
    (outside, n_outside), (repeated, n_repeated) = topology.checked(table, n, checked)

    def given_face(face: int) -> int:
        return face if source is None else int(source[face])

    if n_outside:
        raise MeshError(
            f"faces: {n_outside} face(s) with an index outside 0..{n - 1}, "
            f"first face {given_face(outside)}: {_padded(table[outside])}"
        )
    if n_repeated:
        raise MeshError(
            f"faces: {n_repeated} face(s) with a repeated vertex, "
            f"first face {given_face(repeated)}: {_padded(table[repeated])}"
        )
    return checked, source, n_split


def _padded(face: Any) -> list[int]:
    return [*face.tolist(), -1][:4]


def _from_polygons(faces: Any, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Triangles and quads as they are, larger polygons by ear clipping across their vector area."""
    import mapbox_earcut

    rows: list[list[int]] = []
    source: list[int] = []
    n_split = 0
    try:
        polygons = [[operator.index(v) for v in face] for face in faces]
    except TypeError:
        raise MeshError(
            "faces: expected an integer array of shape (m, 3) or (m, 4), or a sequence of polygons"
        ) from None
    for i, polygon in enumerate(polygons):
        if len(polygon) < 3:
            raise MeshError(f"faces: a face has at least 3 vertices, face {i} has {len(polygon)}")
        if min(polygon) < (-1 if len(polygon) == 4 else 0) or max(polygon) >= len(points):
            raise MeshError(f"faces: face {i} has an index outside 0..{len(points) - 1}: {polygon}")
        pieces = [polygon]
        if len(polygon) > 4:
            if len(set(polygon)) < len(polygon):
                raise MeshError(f"faces: face {i} has a repeated vertex: {polygon}")
            corners = points[polygon] - points[polygon[0]]
            normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
            # The plane across the normal: the right singular vectors of a row begin with the row.
            _, _, (along, *plane) = np.linalg.svd(normal[None])
            if np.linalg.det([along, *plane]) * np.dot(along, normal) < 0:
                plane.reverse()
            flat = np.ascontiguousarray(corners @ np.transpose(plane))
            ears = mapbox_earcut.triangulate_float64(flat, np.array([len(polygon)], np.uint32))
            if len(ears) != 3 * (len(polygon) - 2):  # it crosses itself, or vertices are in line
                ears = np.array([(0, v, v + 1) for v in range(1, len(polygon) - 1)])
            pieces = [[polygon[v] for v in ear] for ear in ears.reshape(-1, 3)]
            n_split += 1
        for piece in pieces:
            rows.append(piece + [-1] * (4 - len(piece)))
            source.append(i)
    table = np.array(rows, np.int64).reshape(-1, 4)
    return table, np.array(source, np.int64), n_split


def consistent_sides(faces: Ints) -> tuple[Bools, bool]:
    """Which faces to turn, as few as possible, so that neighbours agree; and whether all then do.

    Non-orientable components are left as they are.
    """
    m = len(faces)
    f, i, g, j = face_pairs(faces)
    same_way = faces[f, i] == faces[g, j]
    # Node f is face f as given, node f + m the same face turned; an edge joins what goes together.
    rows = np.concatenate((f, f + m))
    columns = np.concatenate((np.where(same_way, g + m, g), np.where(same_way, g, g + m)))
    graph = scipy.sparse.coo_array((np.ones(rows.size, bool), (rows, columns)), shape=(2 * m, 2 * m))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    orientable = not bool((label[:m] == label[m:]).any())
    kept = np.bincount(label[:m], minlength=label.max() + 1)
    turned = np.bincount(label[m:], minlength=label.max() + 1)
    # A component and its mirror image differ in which faces they turn: keep the one that turns fewer.
    ours, theirs = kept[label[:m]], turned[label[:m]]
    first = np.full(label.max() + 1, m)
    np.minimum.at(first, label[:m], np.arange(m))
    mirror = np.empty(label.max() + 1, np.int64)
    mirror[label[:m]] = label[m:]
    tie = first[label[:m]] > first[mirror[label[:m]]]
    return (ours < theirs) | ((ours == theirs) & tie), orientable
