"""Arrays of the caller's, in memory or on disk, that results are written to in slices."""

from __future__ import annotations

import mmap
import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np


def checked_out(out: Mapping[str, Any] | None) -> Mapping[str, Any]:
    """The caller's arrays by name, none where there is no mapping; ValueError where it is something else."""
    if out is not None and not isinstance(out, Mapping):
        raise ValueError(f"out: expected a mapping from names to arrays, got {type(out).__name__}")
    return {} if out is None else out


class Kind(NamedTuple):
    """Arrays of one kind, that a driver writes results to.

    Attributes
    ----------
    wanted : str
        What they are, for who gives others; {} for their shape.
    new : callable
        Shape -> array.
    taken : callable
        (array, shape) -> the caller's array as the driver takes it, None if it does not.
    share : callable
        (array, array) -> whether they have memory, or a place in a file, in common.
    """

    wanted: str
    new: Callable[[tuple[int, ...]], Any]
    taken: Callable[[Any, tuple[int, ...]], Any]
    share: Callable[[Any, Any], bool]


def targets(
    shapes: Mapping[str, tuple[int, ...]], out: Mapping[str, Any], sources: Mapping[str, Any], kind: Kind
) -> dict[str, Any]:
    """Arrays of some shapes by name, those of `out` or new ones, that share nothing with what is read.

    Raises
    ------
    ValueError
        One of `out` is of another kind, or shares memory, or a place in a file, with what is read or with
        another result.
    """
    results: dict[str, Any] = {}
    for name, shape in shapes.items():
        if name not in out:
            results[name] = kind.new(shape)
            continue
        array = kind.taken(out[name], shape)
        if array is None:
            raise ValueError(f"out: {name} wants {kind.wanted.format(shape)}, got {_said(out[name])}")
        for other, there in (*sources.items(), *results.items()):
            if kind.share(array, there):
                raise ValueError(f"out: {name} overlaps the memory of {other}")
        results[name] = array
    return results


def _said(array: Any) -> str:
    """What an array is, for who gave it."""
    kind = "array that is read-only" if _is_read_only(array) else type(array).__name__
    dtype = getattr(array, "dtype", np.dtype(object))
    return f"{dtype} of shape {tuple(getattr(array, 'shape', ()))} ({kind})"


def _as_ndarray(array: Any, shape: tuple[int, ...]) -> Any:
    """What kernels write to without looking again."""
    fits = (
        type(array) is np.ndarray
        and array.shape == shape
        and array.dtype == np.float64
        and array.flags.c_contiguous
        and array.flags.writeable
    )
    return array if fits else None


def _in_slices(array: Any, shape: tuple[int, ...]) -> Any:
    """What takes results block by block, whatever their precision."""
    writeable = hasattr(array, "__setitem__") and not _is_read_only(array)
    given, dtype = tuple(getattr(array, "shape", ())), np.dtype(getattr(array, "dtype", object))
    return array if writeable and given == shape and dtype.kind == "f" else None


def _is_read_only(array: Any) -> bool:
    if isinstance(array, np.ndarray):
        return not array.flags.writeable
    file = getattr(array, "file", None)  # of h5py
    return bool(getattr(array, "read_only", getattr(file, "mode", "") == "r"))


def _share(one: Any, other: Any) -> bool:
    if one is other:
        return True
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return np.may_share_memory(one, other) or _share_a_file(one, other)
    if type(one) is not type(other) or not hasattr(one, "name"):
        return False
    # Arrays of zarr and datasets of h5py know which one they are.
    place = [(getattr(array, "store", getattr(array, "file", None)), array.name) for array in (one, other)]
    return bool(place[0] == place[1])


def _share_a_file(one: Any, other: Any) -> bool:
    places = [_place(array) for array in (one, other)]
    (file, begin, end), (other_file, other_begin, other_end) = places
    if file is None or other_file is None or not os.path.samefile(file, other_file):
        return False
    return max(begin, other_begin) < min(end, other_end)


def _place(array: Any) -> tuple[Any, int, int]:
    """The file that an array is mapped from, and where in it the array begins and ends."""
    base = array
    while isinstance(base.base, np.ndarray):
        base = base.base
    if not isinstance(array, np.memmap) or not isinstance(base.base, mmap.mmap):
        return None, 0, 0
    # An offset is that of the file's first entry in memory, whatever slice of it this is.
    mapped = np.frombuffer(base.base, np.uint8).__array_interface__["data"][0]
    first = array.offset // mmap.ALLOCATIONGRANULARITY * mmap.ALLOCATIONGRANULARITY - mapped
    low, high = np.lib.array_utils.byte_bounds(array)
    return array.filename, first + low, first + high


IN_MEMORY = Kind(
    "a writeable C-contiguous float64 ndarray of shape {}", np.empty, _as_ndarray, np.may_share_memory
)
IN_SLICES = Kind("an array of floats of shape {} that can be written to", np.empty, _in_slices, _share)
