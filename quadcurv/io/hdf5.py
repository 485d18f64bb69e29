"""Datasets of HDF5 files, by h5py."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from quadcurv.extras import need
from quadcurv.io.base import Library, Store, is_a, no_mesh, register
from quadcurv.types import MeshError


def opened(path: Path) -> Any:
    """The dataset called points, or the only one at the top of a file."""
    need("h5py")
    import h5py

    try:
        file = h5py.File(path, "r")
    except FileNotFoundError:
        raise FileNotFoundError(2, "No such file or directory", str(path)) from None
    except OSError as error:
        raise MeshError(f"{path}: no HDF5 file: {error}") from None
    arrays = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
    if "points" in arrays or len(arrays) == 1:
        return arrays.get("points", next(iter(arrays.values())))
    raise MeshError(f"{path}: {len(arrays)} datasets, none of which is called points")


def create(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Any]:
    """Datasets by name in a new file."""
    need("h5py")
    import h5py

    file = h5py.File(path, "w-")
    return {name: file.create_dataset(name, shape, "float64") for name, shape in shapes.items()}


register(Library(("h5py",), no_mesh, is_array=lambda array: is_a(array, "Dataset")))
register(Store((".h5", ".hdf5"), opened, create))
