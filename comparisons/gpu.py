"""Curvature on a graphics processor: its time over that of a copy of as many bytes, and over the host's.

    python -m comparisons.gpu [--quick]

Where there is no device it says so and measures nothing.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import Any

import numpy as np

import quadcurv as qc
from comparisons.scale import Setting

HEADER = ("mesh", "vertices", "result", "ns a vertex", "over a copy", "beside the processor")
NOT_MEASURED = "Not measured: {}. `python -m comparisons.gpu` measures where there is one."
_RESULTS = {"mean_curvature": 32, "mean_curvature_normal": 48}  # bytes read and written a vertex
_RING = 32  # bytes of a ring


def no_device() -> str | None:
    """Why nothing can be measured, None if it can."""
    if find_spec("cupy") is None:
        return "cupy is not installed"
    import cupy

    return None if cupy.cuda.is_available() else "there was no device"


def section(setting: Setting) -> list[str]:
    """The lines of a section of `SCALE.md`."""
    return lines(setting.quick)


def lines(quick: bool = False) -> list[str]:
    """The lines of a report, a table of Markdown where there is a device."""
    problem = no_device()
    if problem:
        return [NOT_MEASURED.format(problem)]
    import cupy

    name = cupy.cuda.runtime.getDeviceProperties(0)["name"].decode()
    rows = [
        row
        for n in ((256,) if quick else (1024, 4096, 8192))
        for kind in ("grid", "face list")
        for row in measured(kind, n)
    ]
    return [
        f"{name}, cupy {cupy.__version__}; medians of 20 calls. Closed meshes, finite volumes.",
        "",
        "| " + " | ".join(HEADER) + " |",
        "| --- |" + " ---: |" * (len(HEADER) - 1),
        *(
            "| " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row) + " |"
            for row in rows
        ),
    ]


def measured(kind: str, n: int) -> list[tuple[object, ...]]:
    """Rows of the table for a torus of n x n vertices."""
    import cupy

    grid = qc.surfaces.torus().sample((n, n))[0]
    mesh: Any = grid if kind == "grid" else grid.to_mesh()
    points = cupy.asarray(mesh.points)
    there = qc.QuadGrid(points, grid.wrap) if kind == "grid" else mesh.with_points(points)
    rows: list[tuple[object, ...]] = []
    for name, size in _RESULTS.items():
        size += _RING * (kind == "face list")
        expected = qc.evaluate(mesh, name)[name]
        out = {name: cupy.asarray(np.zeros_like(expected))}
        qc.evaluate(there, out=out)
        if not np.array_equal(out[name].get(), expected, equal_nan=True):
            raise AssertionError(f"{kind} of {n} x {n}: {name} differs from the processor's")
        source = cupy.zeros(size * n * n // 16)
        target = cupy.empty_like(source)
        device = _on_device(partial(qc.evaluate, there, out=out))
        copy = _on_device(partial(cupy.copyto, target, source))
        host = _on_host(partial(qc.evaluate, mesh, out={name: expected}))
        rows.append((kind, n * n, name, device / (n * n) * 1e9, device / copy, host / device))
    return rows


def _on_device(call: Callable[[], Any]) -> float:
    """Median of the seconds between two events around a call."""
    import cupy

    begin, end, times = cupy.cuda.Event(), cupy.cuda.Event(), []
    for _ in range(23):
        begin.record()
        call()
        end.record()
        end.synchronize()
        times.append(cupy.cuda.get_elapsed_time(begin, end) / 1e3)
    return float(np.median(times[3:]))


def _on_host(call: Callable[[], Any]) -> float:
    times = []
    for _ in range(5):
        start = time.perf_counter()
        call()
        times.append(time.perf_counter() - start)
    return float(np.median(times))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m comparisons.gpu", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a small mesh alone")
    print("\n".join(lines(parser.parse_args().quick)))
