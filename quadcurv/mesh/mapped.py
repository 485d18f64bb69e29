"""Files that are mapped into memory."""

from __future__ import annotations

import mmap
from typing import Any

import numpy as np


def forget(array: Any, begin: int, end: int) -> None:
    """Let go of the memory of rows of a file that is mapped into memory; they stay in the file."""
    if not isinstance(array, np.memmap) or array.mode == "c" or not array.flags.c_contiguous:
        return
    mapped = array
    while isinstance(mapped.base, np.ndarray):
        mapped = mapped.base  # type: ignore[assignment]
    if not isinstance(mapped.base, mmap.mmap) or not hasattr(mmap, "MADV_DONTNEED") or end <= begin:
        return
    whole = np.frombuffer(mapped.base, np.uint8).__array_interface__["data"][0]
    start = array.__array_interface__["data"][0] - whole
    page = mmap.PAGESIZE
    low, high = (
        (start + begin * array.strides[0]) // page * page,
        (start + end * array.strides[0]) // page * page,
    )
    if high > low:
        mapped.base.madvise(mmap.MADV_DONTNEED, low, high - low)
