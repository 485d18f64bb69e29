"""A face list cut into parts on disk: which vertices each owns, and a file a part of the faces it needs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from quadcurv.checks import LARGEST, refuse_on_device
from quadcurv.mesh.mapped import forget
from quadcurv.types import Indices, Ints, MeshError

CHUNK = 1 << 20  # vertices or faces that are read at a time
_SAMPLE = 200_000  # of the points, by which space is divided
_SIDES = 512  # faces, whose sides tell what rounding costs
_SCATTERED = 1.3  # parts that a face has vertices of, on average, from which on the order of vertices is bad


def checked_shape(array: Any, name: str, kinds: str, columns: tuple[int, ...]) -> int:
    """How many rows an array has, of some kinds of numbers and one of so many columns."""
    refuse_on_device(array, name)
    shape, dtype = getattr(array, "shape", None), getattr(array, "dtype", None)
    if shape is None or dtype is None:
        raise MeshError(f"{name}: expected an array with slices, got {type(array).__name__}")
    if len(shape) != 2 or shape[1] not in columns or shape[0] < 1:
        raise MeshError(f"{name}: shape {tuple(shape)}, expected ({'nm'[name == 'faces']}, {columns[-1]})")
    if dtype.kind not in kinds:
        raise MeshError(f"{name}: expected numbers of kind {kinds!r}, got dtype {dtype}")
    return int(shape[0])


def _chunks(array: Any) -> Iterator[tuple[int, Any]]:
    """Where each chunk of rows begins, and the chunk in memory, until the next one is asked for."""
    for begin in range(0, array.shape[0], CHUNK):
        yield begin, np.asarray(array[begin : begin + CHUNK])
        forget(array, begin, begin + CHUNK)


def largest(points: Any) -> float:
    """Largest size of any coordinate.

    Raises
    ------
    MeshError
        Points that are not finite.
    """
    from quadcurv.kernels import extent

    found = 0.0
    for begin, x in _chunks(points):
        size = extent.largest(np.asarray(x, np.float64))
        if not size <= LARGEST:
            bad = ~(np.abs(np.asarray(x, np.float64)) <= LARGEST).all(axis=1)
            raise MeshError(
                f"points: {np.count_nonzero(bad)} point(s) from {begin} on that are not finite, or "
                f"beyond {LARGEST:g}, first vertex {begin + int(np.argmax(bad))}"
            )
        found = max(found, size)
    return found


def is_a_file(points: Any) -> bool:
    """Whether points are all that a file holds from some place on, so that others can map it as well."""
    return (
        isinstance(points, np.memmap)
        and points.filename is not None
        and points.flags.c_contiguous
        and points.offset + points.nbytes == os.path.getsize(points.filename)
    )


def mapped(points: np.memmap) -> tuple[str, int, str, tuple[int, ...]]:
    """Where a worker finds points."""
    return os.path.abspath(str(points.filename)), points.offset, points.dtype.str, points.shape


def _new_points(points: Any, place: Path) -> np.memmap:
    dtype = points.dtype if points.dtype.kind == "f" else np.dtype(float)
    return np.lib.format.open_memmap(place / "points.npy", "w+", dtype, (int(points.shape[0]), 3))


def copied(points: Any, place: Path) -> tuple[str, int, str, tuple[int, ...]]:
    """Copy points to a file; where a worker finds them."""
    copy = _new_points(points, place)
    for begin, x in _chunks(points):
        copy[begin : begin + len(x)] = x
    copy.flush()
    return mapped(np.load(place / "points.npy", mmap_mode="r"))


def _as_table(x: Any, n: int, begin: int) -> Ints:
    """A chunk of faces as (k, 4) int32, checked."""
    from quadcurv.kernels import topology

    if x.dtype == np.uint64:  # the largest must not come out as -1
        x = np.minimum(x, np.uint64(np.iinfo(np.int64).max))
    given = np.ascontiguousarray(x, np.int32 if x.dtype == np.int32 else np.int64)
    table = np.empty((len(x), 4), np.int32)
    (first, count), _ = topology.checked(given, n, table)
    if count:
        raise MeshError(
            f"faces: {count} face(s) with an index outside 0..{n - 1}, first face {begin + first}: "
            f"{x[first].tolist()}"
        )
    return table


def scattered(faces: Any, cuts: Indices) -> bool:
    """Whether ranges of vertices would have many faces in common."""
    step = max(1, faces.shape[0] // 64)
    parts: list[int] = []
    for begin in range(0, faces.shape[0], step):
        x = np.asarray(faces[begin : begin + 256])
        owner = np.sort(np.searchsorted(cuts, np.maximum(x, 0), side="right"), axis=1)
        parts += (1 + (np.diff(owner, axis=1) != 0).sum(axis=1)).tolist()
    return float(np.mean(parts)) > _SCATTERED


def renumber(points: Any, parts: int, place: Path) -> tuple[Indices, Ints]:
    """Write points in the order of parts that are pieces of space; where parts begin, new numbers of all."""
    from quadcurv.kernels.parts import curve

    n = int(points.shape[0])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, x in _chunks(points):
        low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
    size = float((high - low).max())
    step = max(1, n // _SAMPLE)
    sample = np.concatenate([x[-begin % step :: step] for begin, x in _chunks(points)])
    keys = np.sort(curve(sample, low, size))
    split = keys[np.arange(1, parts) * len(keys) // parts]
    owner = np.empty(n, np.int32)
    for begin, x in _chunks(points):
        owner[begin : begin + len(x)] = np.searchsorted(split, curve(x, low, size), side="right")
    cuts = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=parts))))
    number, begin_of = np.empty(n, np.int32), cuts[:-1].copy()
    moved = _new_points(points, place)
    order = np.lib.format.open_memmap(place / "order.npy", "w+", np.int32, (n,))
    for begin, x in _chunks(points):
        own = owner[begin : begin + len(x)]
        at = np.argsort(own, kind="stable")
        count = np.bincount(own, minlength=parts)
        to = np.repeat(begin_of - np.concatenate(([0], np.cumsum(count)[:-1])), count) + np.arange(len(x))
        number[begin + at] = to
        moved[to], order[to] = x[at], begin + at
        begin_of += count
    moved.flush()
    order.flush()
    np.save(place / "number.npy", number)
    return cuts, number


def read_faces(place: Path, p: int) -> Ints:
    """(k, 5) int32: faces of a part as :func:`write_parts` has written them."""
    return np.fromfile(place / f"faces{p}.bin", np.int32).reshape(-1, 5)


def numbers(faces: Ints) -> Ints:
    """Numbers of faces (k, 5) in the whole mesh, whether they are turned or not."""
    return np.maximum(faces[:, 0], ~faces[:, 0])


def write_turned(place: Path, p: int, turned: Indices) -> None:
    """Write down which faces of a part are turned, all others not, as ~number in place of their number."""
    file = np.memmap(place / f"faces{p}.bin", np.int32, "r+")
    faces = file.reshape(-1, 5)
    faces[:, 0] = numbers(faces)
    faces[turned, 0] = ~faces[turned, 0]
    file.flush()


def write_parts(faces: Any, n: int, cuts: Indices, number: Ints, place: Path) -> tuple[bool, Ints]:
    """Write to a file a part all faces with a vertex of it, in their order.

    Returns
    -------
    has_triangles : bool
    sample : (k, 3) int32
        First three vertices of some faces, by their new numbers if there are any.
    """
    from quadcurv.kernels.parts import by_part

    has_triangles, step, sample = False, int(faces.shape[0]) // _SIDES + 1, []
    files = [open(place / f"faces{p}.bin", "wb") for p in range(len(cuts) - 1)]  # noqa: SIM115
    try:
        for begin, x in _chunks(faces):
            table = _as_table(x, n, begin)
            has_triangles |= bool((table[:, 3] < 0).any())
            sample.append(table[-begin % step :: step, :3])
            out, first = by_part(table, begin, cuts, number)
            for p in np.flatnonzero(np.diff(first)).tolist():
                files[p].write(memoryview(out[first[p] : first[p + 1]]).cast("B"))
    finally:
        for file in files:
            file.close()
    some = np.concatenate(sample)
    return has_triangles, number[some] if number.size else some
