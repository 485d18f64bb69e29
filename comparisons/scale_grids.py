"""Grids from disk, in slabs and through dask, beside the same grids in memory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import quadcurv as qc
from comparisons import scale
from comparisons.scale import Cost, Setting, cost, table

HERE = "comparisons.scale_grids"
PEAK, TIMES = 300.0, 1.35  # what slabs have to keep to: 10^6 bytes, and times the processor time of memory
H = "mean_curvature"


def write_points(path: Path, n: int, r: int = 64) -> None:
    """A sheet of n x n points, open on all sides, as an .npy file."""
    array = np.lib.format.open_memmap(path, "w+", np.float64, (n, n, 3))
    t = np.linspace(0, 1, n)
    for i in range(0, n, r):
        u, v = t[i : i + r, None], t[None]
        array[i : i + r] = np.stack(np.broadcast_arrays(u, v, 0.1 * np.sin(7 * u) * np.cos(5 * v)), axis=-1)
    array.flush()


def _compiled(scheme: str) -> None:
    """Compile, on a small grid, what will be measured."""
    i, j = np.meshgrid(np.arange(90.0), np.arange(90.0), indexing="ij")
    points = np.stack([i, j, 0.01 * (i - j / 2) ** 2], axis=-1)
    qc.evaluate(qc.ChunkedGrid(points), H, scheme=scheme)
    qc.mean_curvature(qc.QuadGrid(points), scheme)


def in_memory(points: str, out: str, scheme: str) -> None:
    """Load, compute, save."""
    _compiled(scheme)
    scale.begin()
    np.save(out, qc.mean_curvature(qc.QuadGrid(np.load(points)), scheme))


def in_slabs(points: str, out: str, scheme: str) -> None:
    """From file to file, both mapped into memory."""
    _compiled(scheme)
    scale.begin()
    x = np.load(points, mmap_mode="r")
    into = np.lib.format.open_memmap(out, "w+", np.float64, x.shape[:2])
    qc.evaluate(qc.ChunkedGrid(x), scheme=scheme, out={H: into})
    into.flush()


def to_zarr(points: str, store: str, rows: int, columns: int) -> None:
    """A copy as a zarr array of such chunks."""
    import zarr

    x = np.load(points, mmap_mode="r")
    chunks = (min(rows, len(x)), min(columns, len(x)), 3)
    array = zarr.create_array(store=store, shape=x.shape, chunks=chunks, dtype="f8", compressors=None)
    for i in range(0, len(x), chunks[0]):
        array[i : i + chunks[0]] = x[i : i + chunks[0]]


def zarr_in_slabs(store: str, out: str, scheme: str) -> None:
    """From zarr to zarr, block by block."""
    import zarr

    _compiled(scheme)
    scale.begin()
    x: Any = zarr.open(store, mode="r")
    into = zarr.create_array(
        store=out, shape=x.shape[:2], chunks=x.chunks[:2], dtype="f8", compressors=None, overwrite=True
    )
    qc.evaluate(qc.ChunkedGrid(x), scheme=scheme, out={H: into})


def through_dask(store: str, out: str, scheme: str, threads: int) -> dict[str, Any]:
    """From zarr to zarr, a task a chunk, by so many threads."""
    import dask
    import dask.array as da
    import zarr

    _compiled(scheme)
    # What is run, once what comes to nothing has been taken out.
    planned: Any = dask.optimize(qc.mean_curvature(qc.ChunkedGrid(da.from_zarr(store)), scheme))[0]
    tasks = len(planned.__dask_graph__())
    scale.begin()
    x = da.from_zarr(store)
    lazy: Any = qc.mean_curvature(qc.ChunkedGrid(x), scheme)
    into: Any = zarr.create_array(
        store=out, shape=x.shape[:2], chunks=x.chunksize[:2], dtype="f8", compressors=None, overwrite=True
    )
    with dask.config.set(scheduler="threads", num_workers=threads):
        da.store(lazy, into, lock=False)
    return {"tasks": tasks}


def fitted_whole(points: str) -> None:
    """A fit of a grid in memory, all at once."""
    from quadcurv import drivers

    _compiled("jet")
    grid = qc.QuadGrid(np.load(points))
    scale.begin()
    drivers.fit(grid, qc.SCHEMES["jet"])  # type: ignore[arg-type]


def fitted(points: str) -> None:
    """A fit of a grid in memory, as the verb does it: block by block."""
    _compiled("jet")
    grid = qc.QuadGrid(np.load(points))
    scale.begin()
    qc.mean_curvature(grid)


def same(one: Any, other: Any) -> bool:
    """Whether two arrays are bitwise the same, NaN included, looked at in rows."""
    step = max(1, 2**22 // one.shape[1])
    return all(
        np.array_equal(one[i : i + step], other[i : i + step], equal_nan=True)
        for i in range(0, one.shape[0], step)
    )


def room() -> float:
    """Memory that is free, in bytes; 0 where nobody says."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
    except OSError:
        return 0.0
    return next((1024.0 * float(x.split()[1]) for x in lines if x.startswith("MemAvailable")), 0.0)


def section(setting: Setting) -> list[str]:
    """Slabs beside memory, growth of their cost, fits by blocks."""
    small = setting.quick
    sizes = (200, 400) if small else (1024, 2048, 4096, 8192, 16384)
    shown = sizes[-2:]
    rows: list[tuple[object, ...]] = []
    growth: list[tuple[int, float]] = []
    notes: list[str] = []
    for n in sizes:
        points, one, other = (setting.folder / name for name in (f"{n}.npy", "memory.npy", "slabs.npy"))
        write_points(points, n)
        for scheme in ("finite_volume", "liu") if n in shown else ("finite_volume",):
            slabs = cost(f"{HERE}:in_slabs", str(points), str(other), scheme)
            if scheme == "finite_volume":
                growth.append((n, slabs.cpu))
            if n not in shown:
                continue
            rows += list(_beside(n, scheme, slabs, points, one, other, notes))
        for path in (points, one, other):
            path.unlink(missing_ok=True)
    lines = table(
        ("8 bytes of H from 24 of points", "vertices", "CPU s", "ns a vertex", "times memory", "peak MB"),
        rows,
    )
    lines += ["", *notes, "", *_growth(growth), "", *_fits(setting, 300 if small else 2048)]
    return lines


def _beside(
    n: int, scheme: str, slabs: Cost, points: Path, one: Path, other: Path, notes: list[str]
) -> Iterator[tuple[object, ...]]:
    ratio: object = ""
    if room() > 1.5 * 32 * n**2 or n < 1000:
        memory = cost(f"{HERE}:in_memory", str(points), str(one), scheme)
        yield f"{scheme}, in memory", n**2, memory.cpu, 1e9 * memory.cpu / n**2, "", round(memory.peak)
        ratio = slabs.cpu / memory.cpu
        bits = same(np.load(one, mmap_mode="r"), np.load(other, mmap_mode="r"))
        verdict = "reached" if slabs.peak <= PEAK and slabs.cpu <= TIMES * memory.cpu and bits else "missed"
        notes.append(
            f"- {scheme}, {n} x {n}: {'bitwise the same' if bits else 'NOT the same'}; at most {PEAK:g} MB "
            f"and {TIMES} times the processor time of memory: {verdict}."
        )
    else:
        notes.append(f"- {scheme}, {n} x {n}: not measured in memory, of which too little was free.")
    yield f"{scheme}, in slabs", n**2, slabs.cpu, 1e9 * slabs.cpu / n**2, ratio, round(slabs.peak)


def _growth(found: list[tuple[int, float]]) -> list[str]:
    n, cpu = (np.array(x, float) for x in zip(*found, strict=True))
    slope = np.polyfit(np.log(n**2), np.log(cpu), 1)[0]
    each = ", ".join(f"{int(k)}² {1e9 * s / k**2:.3g}" for k, s in found)
    return [
        f"Growth of the cost of slabs: nanoseconds a vertex at {each}; processor time grows like the number "
        f"of vertices to the power {slope:.2f}."
    ]


def _fits(setting: Setting, n: int) -> list[str]:
    points, out = setting.folder / "fits.npy", setting.folder / "fits_out.npy"
    write_points(points, n)
    whole = cost(f"{HERE}:fitted_whole", str(points))
    blocks = cost(f"{HERE}:fitted", str(points))
    disk = cost(f"{HERE}:in_slabs", str(points), str(out), "jet")
    rows = [
        (name, n**2, c.cpu, 1e9 * c.cpu / n**2, round(c.peak))
        for name, c in (("jet, all at once", whole), ("jet, in memory", blocks), ("jet, from disk", disk))
    ]
    points.unlink()
    out.unlink()
    return table(("fits", "vertices", "CPU s", "ns a vertex", "peak MB"), rows)


def dask_section(setting: Setting) -> list[str]:
    """Chunks of zarr by slabs and by tasks."""
    rows = []
    small = setting.quick
    for n in (256,) if small else (8192, 16384):
        points, out = setting.folder / "points.npy", setting.folder / "out.zarr"
        write_points(points, n)
        for shape in ((64, 64),) if small else ((1024, 1024), (64, n)):
            store = setting.folder / f"{shape[0]}.zarr"
            to_zarr(str(points), str(store), *shape)
            name = f"{shape[0]} x {shape[1]}"
            found = cost(f"{HERE}:zarr_in_slabs", str(store), str(out), "finite_volume")
            rows.append((f"{name}, slabs", n**2, found.cpu, 1e9 * found.cpu / n**2, round(found.peak), ""))
            for threads in (1, 2):
                found = cost(f"{HERE}:through_dask", str(store), str(out), "finite_volume", threads)
                each = 1e9 * found.cpu / n**2
                rows.append(
                    (
                        f"{name}, dask, {threads} thread(s)",
                        n**2,
                        found.cpu,
                        each,
                        round(found.peak),
                        found.told["tasks"],
                    )
                )
            _remove(store)
            _remove(out)
        points.unlink()
    text = (
        "The finite-volume scheme from a zarr array to another, not compressed. Slabs are blocks of whole "
        "chunks, one after the other; with dask a task reads its chunk and what lies around it. Chunks "
        "are held decoded, of 12 to 25 MB here: peaks grow with them."
    )
    return [text, "", *table(("chunks", "vertices", "CPU s", "ns a vertex", "peak MB", "tasks"), rows)]


def _remove(folder: Path) -> None:
    import shutil

    shutil.rmtree(folder, ignore_errors=True)
