"""Arrays in the memory of a graphics processor: which ones are, and the way there and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadcurv.extras import need

_CUDA = (2, 13)  # kinds of DLPack's devices: CUDA, and memory that CUDA manages


def is_on_device(array: Any) -> bool:
    """Whether an array of any library lies in a device's memory."""
    if type(array) is np.ndarray:
        return False
    if hasattr(array, "__cuda_array_interface__"):
        return True
    device = getattr(array, "__dlpack_device__", None)
    return device is not None and int(device()[0]) in _CUDA


def as_cupy(array: Any) -> Any:
    """The same memory as a cupy array; what is not on the device is copied there.

    Raises
    ------
    ImportError
        cupy is not installed.
    """
    need("cupy")
    import cupy

    if is_on_device(array) and not hasattr(array, "__cuda_array_interface__"):
        return cupy.from_dlpack(array)
    return cupy.asarray(array)


def on_host(array: Any) -> Any:
    """A numpy array of what lies on a device; anything else as it is."""
    return as_cupy(array).get() if is_on_device(array) else array


def taken(array: Any, index: Any) -> Any:
    """Some entries of an array, in memory wherever the array is."""
    return on_host(array[as_cupy(index)]) if is_on_device(array) else array[index]
