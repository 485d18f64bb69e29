"""Arrays of zarr, on disk or elsewhere."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quadcurv.extras import need
from quadcurv.io.base import Library, Store, is_a, no_mesh, register
from quadcurv.types import MeshError

_CHUNK = 1024  # rows and columns


def opened(path: Path) -> Any:
    """The array of a folder; of a group that called points, or its only one."""
    need("zarr")
    import zarr

    if not path.exists():
        raise FileNotFoundError(2, "No such file or directory", str(path))
    try:
        found = zarr.open(path, mode="r")
    except Exception as error:  # zarr has errors of its own for each kind of damage
        raise MeshError(f"{path}: no array of zarr: {error}") from None
    if not isinstance(found, zarr.Group):
        return found
    arrays = dict(found.arrays())
    if "points" in arrays or len(arrays) == 1:
        return arrays.get("points", *arrays.values() if len(arrays) == 1 else (None,))
    raise MeshError(f"{path}: a group of {len(arrays)} arrays, none of which is called points")


def create(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Any]:
    """An array, or a group of several, by name."""
    need("zarr")
    import zarr

    def made(where: Any, shape: tuple[int, ...], **place: Any) -> Any:
        chunks = tuple(min(_CHUNK, n) for n in shape[:2]) + shape[2:]
        nan = float("nan")
        return where.create_array(shape=shape, chunks=chunks, dtype="float64", fill_value=nan, **place)

    if len(shapes) == 1:
        ((name, shape),) = shapes.items()
        return {name: made(zarr, shape, store=str(path))}
    group = zarr.open_group(path, mode="w-")
    return {name: made(group, shape, name=name) for name, shape in shapes.items()}


register(Library(("zarr",), no_mesh, is_array=lambda array: is_a(array, "Array")))
register(Store((".zarr",), opened, create))
