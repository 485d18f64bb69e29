"""How kernels are compiled: strict arithmetic, no lock held, and kept on disk where anything can be written.

Arithmetic is strict (no `fastmath`): NaN is seen, and results do not depend on how loops are cut. Kernels
make no arrays, so that numba's counting of who holds one is left out (`_nrt`): it takes time to compile, to
load, and, where it waits for all that is being written, to run.

What is compiled is kept under a digest of all files of kernels, so that these may share helpers: numba's own
cache notices an edit to the file of the function that it keeps, no other. Every compiled function has a file
of its own, which begins with its checksum: processes that start at once write the same, and what is damaged
or cut short is as good as missing. Where nothing can be written compiled code lasts as long as the process.
"""

import contextlib
import hashlib
import logging
import os
import pickle
import tempfile
from functools import cache, cached_property
from importlib.resources import files
from pathlib import Path
from typing import Any

import llvmlite
import numba
import numpy as np
from numba import njit
from numba.core.caching import CompileResultCacheImpl, _Cache
from numba.core.compiler_lock import global_compiler_lock
from numba.core.serialize import dumps

_log = logging.getLogger("quadcurv")
_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}

helper = njit(**{**_OPTIONS, "no_cpython_wrapper": True})

if hasattr(os, "register_at_fork"):
    # A child of a fork has one thread, and a lock that another one held stays locked for ever.
    os.register_at_fork(
        before=global_compiler_lock.acquire,
        after_in_parent=global_compiler_lock.release,
        after_in_child=global_compiler_lock.release,
    )


def kernel(function):
    """Compile an entry point, kept on disk unless there is no folder for it."""
    compiled = njit(**_OPTIONS)(function)
    compiled._cache = _Files(function)
    return compiled


def flat(array, dtype=None):
    """An array as kernels read it: of one dimension and read-only, so that there is one program for all."""
    array = np.ascontiguousarray(array, dtype).reshape(-1)
    if array.flags.writeable:
        array.flags.writeable = False
    return array


@cache
def _digest():
    """Of what compiled code comes from: the kernels and their compilers."""
    digest = hashlib.blake2b(f"{numba.__version__} {llvmlite.__version__}".encode(), digest_size=8)
    for file in sorted(files(__package__).iterdir(), key=lambda file: file.name):
        if file.name.endswith((".py", ".pyc")):
            digest.update(file.name.encode() + file.read_bytes())
    return digest.hexdigest()


@cache
def _announce():
    """Say that compiling begins, once a process."""
    _log.info("compiling for this processor, which takes some seconds the first time")


class _Files(_Cache):
    """The compiled versions of one function on disk, in place of numba's own cache."""

    def __init__(self, function):
        self._function = function

    @cached_property
    def _numba(self):
        """What numba knows of the function: where to keep it and how; None where nothing can be written."""
        try:
            return CompileResultCacheImpl(self._function)
        except (RuntimeError, OSError):
            return None

    @property
    def cache_path(self):
        """Folder, None if there is none."""
        return None if self._numba is None else self._numba.locator.get_cache_path()

    def _file(self, signature, codegen):
        """Of the version for a signature and a processor."""
        key = hashlib.blake2b(repr((signature, codegen.magic_tuple())).encode(), digest_size=8)
        return Path(self.cache_path, f"{self._numba.filename_base}.{_digest()}.{key.hexdigest()}.nbc")

    def load_overload(self, sig, target_context):
        """What is kept for a signature, None if there is nothing sound."""
        if self._numba is not None:
            with contextlib.suppress(Exception):  # whatever is wrong with it, it is compiled again
                data = self._file(sig, target_context.codegen()).read_bytes()
                if _checksum(data[_CHECKSUM:]) == data[:_CHECKSUM]:
                    return self._numba.rebuild(target_context, pickle.loads(data[_CHECKSUM:]))
        _announce()
        return None

    def save_overload(self, sig, data):
        """Keep what was compiled for a signature, and nothing of the files of kernels that were before."""
        if self._numba is None or not self._numba.check_cachable(data):
            return
        file, code = self._file(sig, data.codegen), dumps(self._numba.reduce(data))
        with contextlib.suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            handle, name = tempfile.mkstemp(dir=file.parent, suffix=".tmp")
            try:
                with open(handle, "wb") as target:
                    target.write(_checksum(code) + code)
                os.replace(name, file)
            except OSError:
                os.unlink(name)
                raise
            for other in file.parent.iterdir():
                if other.name.startswith(f"{self._numba.filename_base}.") and _digest() not in other.name:
                    other.unlink()

    def enable(self):
        """Nothing to do: it always is."""

    disable = flush = enable


_CHECKSUM = 16  # bytes


def _checksum(data):
    return hashlib.blake2b(data, digest_size=_CHECKSUM).digest()
