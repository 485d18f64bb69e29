"""Arrays of numpy in files, mapped into memory."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from quadcurv.io.base import Store, register
from quadcurv.types import MeshError


def mapped(path: Path) -> Any:
    """The array of a file."""
    try:
        return np.load(path, mmap_mode="r")
    except ValueError as error:
        raise MeshError(f"{path}: no array of numbers: {error}") from None


def create(path: Path, shapes: Mapping[str, tuple[int, ...]]) -> dict[str, Any]:
    """One new array; a file of this kind holds no more."""
    if len(shapes) != 1:
        raise ValueError(f"{path}: an .npy file holds one array, not {len(shapes)}: {', '.join(shapes)}")
    ((name, shape),) = shapes.items()
    return {name: np.lib.format.open_memmap(path, "w+", np.float64, shape)}


register(Store((".npy",), mapped, create))
