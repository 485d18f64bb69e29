"""Other libraries' readers in a process of their own, which may die, hang or take all memory.

The process imports nothing from the current folder, whatever the caller's path says.
"""

from __future__ import annotations

import json
import math
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io import child
from quadcurv.types import MeshError

MEMORY = 200 << 20  # bytes beyond 20 times those of the file
SECONDS = 8  # of the processor, and one more for every 5 MB
WALL = 30.0  # seconds on the wall beyond five times those of the processor


def isolated(job: str, path: Path) -> tuple[dict[str, Any], dict[str, NDArray[Any]]]:
    """What a job of :mod:`quadcurv.io.child` makes of a file: what it says, and arrays by name.

    Raises
    ------
    MeshError
        A ValueError: the library refuses the file, or dies of it, or needs too much memory or time.
    """
    if not sys.executable or getattr(sys, "frozen", False):
        raise MeshError("it is read by a second Python, and this program has none")
    size = _size(path)
    memory, seconds = MEMORY + 20 * size, SECONDS + size // 5_000_000
    run = f"import sys; sys.path += {_search_path()!r}; sys.argv = sys.argv[1:]; "
    run += "import runpy; runpy.run_path(sys.argv[0], run_name='__main__')"
    command = [sys.executable, "-I", "-c", run, child.__file__, job, os.path.abspath(path)]
    process = subprocess.Popen(
        [*command, str(memory), str(seconds)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    # On the wall much longer, so that a busy machine ends nothing that gets on.
    late = threading.Timer(WALL + 5 * seconds, process.kill)
    late.start()
    try:
        answer, arrays = _received(process, memory)
        code = process.wait()
    finally:
        late.cancel()
        process.kill()
        process.wait()
        if process.stdout is not None:
            process.stdout.close()
    if answer is None:
        raise MeshError(_death(code, seconds, memory))
    if "error" in answer:
        raise MeshError(answer["error"])
    return answer, arrays


def _size(path: Path) -> int:
    """Bytes of a file, and of those in its folder that it names where its format is made of several."""
    size = path.stat().st_size
    if path.suffix.lower() in (".gltf", ".xdmf", ".xmf"):
        text = path.read_bytes()
        size += sum(
            f.stat().st_size for f in path.parent.iterdir() if f.name.encode() in text and f.is_file()
        )
    return size


def _search_path() -> list[str]:
    """Where we import from, without the current folder, which may hold anything."""
    here = os.path.realpath(os.curdir)
    return [p for p in sys.path if os.path.isabs(p) and os.path.realpath(p) != here]


def _received(
    process: subprocess.Popen[bytes], most: int
) -> tuple[dict[str, Any] | None, dict[str, NDArray[Any]]]:
    """The answer of a process; None if there is none that is whole."""
    assert process.stdout is not None
    arrays: dict[str, NDArray[Any]] = {}
    try:
        answer = json.loads(process.stdout.readline(1 << 24))
        for name, kind, shape in answer.get("arrays", ()):
            dtype = np.dtype(kind)
            if dtype.kind not in "biuf" or math.prod(shape) * dtype.itemsize > most:
                return None, {}
            data = bytearray(math.prod(shape) * dtype.itemsize)
            if process.stdout.readinto(data) != len(data):  # type: ignore[attr-defined]
                return None, {}
            arrays[name] = np.frombuffer(data, dtype).reshape(shape)
    except (ValueError, AttributeError, TypeError, MemoryError):
        return None, {}
    return answer, arrays


def _death(code: int, seconds: int, memory: int) -> str:
    """Why a process ended without an answer."""
    if code in (-signal.SIGKILL, -getattr(signal, "SIGXCPU", signal.SIGKILL)):
        return (
            f"reading it takes more than {seconds} s or {memory >> 20} MB, so it is damaged or no such file"
        )
    how = signal.Signals(-code).name if code < 0 else f"exit code {code}"
    return (
        f"the library that reads it died of it ({how}): it is damaged, or needs more than {memory >> 20} MB"
    )
