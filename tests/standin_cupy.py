"""A stand-in for cupy where there is no device: arrays in memory, passes compiled by g++, thread by thread.

It is as strict as cupy is: no function of numpy takes its arrays, and none of its own takes numpy's.
"""

from __future__ import annotations

import ctypes
import hashlib
import subprocess
import sys
import types
from functools import cache
from pathlib import Path

import numpy as np
import scipy.sparse

_PLACE = """
GLOBAL void set_place(unsigned block, unsigned size, unsigned thread) {
  blockIdx.x = block; blockDim.x = size; threadIdx.x = thread;
}
"""


class ndarray(np.ndarray):  # noqa: N801
    """An array that says it lies on a device."""

    @property
    def __cuda_array_interface__(self):
        return {
            "shape": self.shape,
            "typestr": self.dtype.str,
            "data": (self.ctypes.data, False),
            "version": 3,
        }

    def get(self):
        return np.array(self.view(np.ndarray))

    def __array_function__(self, function, kinds, args, kwargs):
        raise TypeError(f"{function.__name__} of an array on a device")

    def __array_ufunc__(self, ufunc, method, *inputs, out=None, **kwargs):
        for x in (*inputs, *(out or ())):
            if isinstance(x, np.ndarray) and not isinstance(x, ndarray) and x.ndim:
                raise TypeError(f"Unsupported type {type(x)}")
        plain = [x.view(np.ndarray) if isinstance(x, ndarray) else x for x in inputs]
        if out:
            kwargs["out"] = tuple(x.view(np.ndarray) for x in out)
        result = getattr(ufunc, method)(*plain, **kwargs)
        return out[0] if out else asarray(result)

    def __getitem__(self, index):
        _refuse(index)
        return super().__getitem__(index)

    def __setitem__(self, index, value):
        _refuse(index)
        _refuse(value)
        super().__setitem__(index, value)


def _refuse(x):
    for part in x if isinstance(x, tuple) else (x,):
        if isinstance(part, np.ndarray) and not isinstance(part, ndarray) and part.ndim:
            raise TypeError(f"Unsupported type {type(part)}")


def asarray(x, dtype=None):
    """A copy, as of what lies elsewhere; of its own arrays the same memory."""
    if isinstance(x, ndarray):
        return x
    return np.array(x, dtype, order="C").view(ndarray)


def empty(shape, dtype=np.float64):
    """Full of what is no result."""
    return np.full(shape, 77, dtype).view(ndarray)


class RawModule:
    """Passes, compiled once."""

    def __init__(self, code, options):
        assert "--fmad=false" in options
        self._library = library(code)

    def get_function(self, name):
        function = getattr(self._library, name)
        function.restype = None

        def run(grid, block, arguments):
            given = [_argument(x) for x in arguments]
            for number in range(grid[0]):
                for thread in range(block[0]):
                    self._library.set_place(number, block[0], thread)
                    function(*given)

        return run


def _argument(x):
    if isinstance(x, ndarray):
        assert x.flags.c_contiguous
        return ctypes.c_void_p(x.ctypes.data)
    if isinstance(x, np.float64):
        return ctypes.c_double(x)
    return {np.uintp: ctypes.c_void_p, np.int64: ctypes.c_longlong, np.int32: ctypes.c_int}[type(x)](int(x))


FOLDER: Path | None = None


@cache
def library(code: str) -> ctypes.CDLL:
    """C++ of the passes as a library."""
    assert FOLDER is not None
    name = hashlib.blake2b(code.encode(), digest_size=6).hexdigest()
    source, target = FOLDER / f"{name}.cpp", FOLDER / f"{name}.so"
    source.write_text(code + _PLACE)
    command = ["g++", "-DHOST", "-O1", "-std=c++17", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run([*command, str(source), "-o", str(target)], check=True, timeout=120)
    return ctypes.CDLL(str(target))


class _Matrix(scipy.sparse.csr_matrix):
    def __init__(self, arrays, shape):
        super().__init__(tuple(x.view(np.ndarray) for x in arrays), shape=shape)

    def __matmul__(self, other):
        assert isinstance(other, ndarray)
        return asarray(scipy.sparse.csr_array(self) @ other.get())

    def get(self):
        return scipy.sparse.csr_matrix(self)


def modules(folder: Path) -> dict[str, types.ModuleType]:
    """What is to be put into sys.modules."""
    global FOLDER
    FOLDER = folder
    sparse = types.ModuleType("cupyx.scipy.sparse")
    sparse.csr_matrix = _Matrix
    sparse.diags = lambda x, format: _Diagonal(x)
    return {
        "cupy": sys.modules[__name__],
        "cupyx": types.ModuleType("cupyx"),
        "cupyx.scipy": types.ModuleType("cupyx.scipy"),
        "cupyx.scipy.sparse": sparse,
    }


class _Diagonal:
    def __init__(self, x):
        self._x = x

    def get(self):
        return scipy.sparse.diags_array(self._x.get()).tocsr()


def may_share_memory(a, b):
    """As numpy's."""
    return np.may_share_memory(a.view(np.ndarray), b.view(np.ndarray))
