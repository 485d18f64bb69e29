"""Face lists larger than memory: in parts, one after the other or by workers, beside one mesh in memory."""

from __future__ import annotations

import os
import pickle
import shutil
import signal
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

import quadcurv as qc
from comparisons.scale import Setting, begin, cost, table

# Vertices a side of a torus, natural and shuffled; the large ones are measured where QUADCURV_LARGE is set.
SIDE, SHUFFLED, LARGE, HUGE = 4096, 2048, 8192, 16384
_ROWS = 256
_HERE = (("into parts", "cut", ()), ("part by part", "by_parts", (0,)))
_WORKERS = (("1 worker", "by_parts", (1,)), ("2 workers", "by_parts", (2,)))
_WHOLE = (("one mesh in memory", "in_memory", ()),)


def section(setting: Setting) -> list[str]:
    """The lines of the report."""
    side, other = (128, 96) if setting.quick else (SIDE, SHUFFLED)
    large = bool(os.environ.get("QUADCURV_LARGE")) and not setting.quick
    rows = measured(setting, side, "natural", (*_WHOLE, *_HERE, *_WORKERS))
    killed = cost("comparisons.scale_faces:killed", str(setting.folder / f"natural{side}"))
    if not killed.told["same"]:
        raise AssertionError("with a worker killed the result is not bitwise one mesh")
    _remove(setting, "natural", side)
    rows += measured(setting, other, "shuffled", (*_WHOLE, *_HERE))
    _remove(setting, "shuffled", other)
    sizes = [side]
    for n, ways in ((LARGE, (*_HERE, *_WORKERS)), (HUGE, _HERE)) if large else ():
        rows += measured(setting, n, "natural", ways)
        sizes.append(n)
        _remove(setting, "natural", n)
    lines = [
        "A bumpy torus of quads from .npy files, the mean curvature by finite volumes into one. *Into parts*",
        "writes the faces of each part of about a million vertices to a file, once; the rest is without it.",
        "What *workers* cost begins with their start, two seconds each; their peak is that of the largest",
        "one. Peaks count pages of mapped files, which can be taken back. Wherever one mesh in memory was",
        "measured all ways were bitwise the same.",
        "",
        *table(["mesh", "way", "CPU s", "ns a vertex", "peak MB"], rows),
        "",
        "One of two workers killed after a third of the vertices: the result was bitwise the same.",
    ]
    if not large:
        left = f"{LARGE**2 / 1e6:.3g}M and {HUGE**2 / 1e6:.3g}M"
        return [*lines, "", f"{left} vertices: not measured; QUADCURV_LARGE=1 measures them."]
    return [*lines, "", growth(sizes, rows)]


def growth(sizes: Sequence[int], rows: Sequence[Sequence[object]]) -> str:
    """How the cost grows from size to size of meshes in natural order, into parts and part by part."""
    said = []
    for way, _, _ in _HERE:
        cpu = [float(str(row[2])) for row in rows if row[1] == way and str(row[0]).endswith("natural")]
        slope = np.polyfit(np.log([n * n for n in sizes]), np.log(cpu), 1)[0]
        said.append(f"{slope:.2f} {way}")
    each = ", ".join(f"{n * n / 1e6:.3g}M" for n in sizes)
    return f"Over {each} vertices processor time grows like their number to the power {' and '.join(said)}."


def _remove(setting: Setting, order: str, n: int) -> None:
    shutil.rmtree(setting.folder / f"{order}{n}")


Way = tuple[str, str, tuple[int, ...]]


def measured(setting: Setting, n: int, order: str, ways: Sequence[Way]) -> list[list[object]]:
    """Rows of the table for n x n vertices."""
    folder, rows = str(setting.folder / f"{order}{n}"), []
    cost("comparisons.scale_faces:write", folder, n, order)
    for way, job, more in ways:
        spent = cost(f"comparisons.scale_faces:{job}", folder, *more)
        if spent.told.get("same") is False:
            raise AssertionError(f"{n} x {n}, {order}: {way} is not bitwise one mesh")
        peak = spent.told.get("peak", spent.peak)
        rows.append([f"{n * n / 1e6:.3g}M, {order}", way, spent.cpu, spent.cpu / (n * n) * 1e9, peak])
        print(*rows[-1], file=sys.stderr, flush=True)
    return rows


def write(folder: str, n: int, order: str) -> None:
    """A bumpy torus of n x n vertices as .npy files."""
    place = Path(folder)
    place.mkdir(parents=True)
    points = np.lib.format.open_memmap(place / "points.npy", "w+", np.float64, (n * n, 3))
    faces = np.lib.format.open_memmap(place / "faces.npy", "w+", np.int32, (n * n, 4))
    number = np.random.default_rng(0).permutation(n * n).astype(np.int32) if order == "shuffled" else None
    v = 2 * np.pi * np.arange(n) / n
    along = np.arange(n, dtype=np.int32)
    for first in range(0, n, _ROWS):
        rows = np.arange(first, min(first + _ROWS, n))
        u = 2 * np.pi * rows[:, None] / n
        a = 1 + 0.1 * np.cos(3 * u) * np.cos(2 * v)
        x = np.stack(
            [(3 + a * np.cos(v)) * np.cos(u), (3 + a * np.cos(v)) * np.sin(u), a * np.sin(v)], axis=-1
        )
        here, below = rows[:, None] * n, (rows[:, None] + 1) % n * n
        beside = np.roll(along, -1)
        quads = np.stack([here + along, below + along, below + beside, here + beside], axis=-1)
        at = slice(first * n, (first + len(rows)) * n)
        quads = quads.reshape(-1, 4)
        faces[at] = quads if number is None else number[quads]
        points[at if number is None else number[at]] = x.reshape(-1, 3)


def _mapped(folder: str) -> tuple[np.ndarray, np.ndarray]:
    x, f = (np.load(Path(folder) / f"{name}.npy", mmap_mode="r") for name in ("points", "faces"))
    return x, f


def _warm() -> None:
    """Compile what will be run."""
    from tempfile import TemporaryDirectory

    mesh, _, _ = qc.surfaces.cubed_sphere().sample((8, 8), "faces")
    with TemporaryDirectory() as folder:
        shuffled = np.random.default_rng(0).permutation(len(mesh.points))
        parts = qc.FaceParts(mesh.points[shuffled], np.argsort(shuffled)[mesh.faces], folder, parts=3)
        qc.evaluate(parts, "mean_curvature")
    begin()


def in_memory(folder: str) -> None:
    """Load, make a mesh, compute, and save."""
    _warm()
    points, faces = (np.array(x) for x in _mapped(folder))
    np.save(
        Path(folder) / "expected.npy",
        qc.evaluate(qc.QuadMesh(points, faces), "mean_curvature")["mean_curvature"],
    )


def cut(folder: str) -> None:
    """Write parts of a million vertices."""
    _warm()
    points, faces = _mapped(folder)
    parts = qc.FaceParts(points, faces, Path(folder) / "parts", parts=max(4, len(points) >> 20))
    (Path(folder) / "parts.pickle").write_bytes(pickle.dumps(parts))


def _cut_before(folder: str) -> qc.FaceParts:
    """Parts that `cut` has written."""
    return pickle.loads((Path(folder) / "parts.pickle").read_bytes())


def _same(folder: str, H: np.ndarray) -> bool | None:
    expected = Path(folder) / "expected.npy"
    return (
        bool(np.array_equal(np.load(expected, mmap_mode="r"), H, equal_nan=True))
        if expected.exists()
        else None
    )


def by_parts(folder: str, workers: int) -> dict[str, Any]:
    """Compute parts, here if there are no workers, into a file."""
    _warm()
    parts = _cut_before(folder)
    begin()
    H = np.lib.format.open_memmap(Path(folder) / "H.npy", "w+", np.float64, parts.shape)
    told: dict[str, Any] = {}
    if workers == 0:
        qc.evaluate(parts, out={"mean_curvature": H})
    else:
        with _cluster(workers) as client:
            qc.evaluate(_with(parts, client), out={"mean_curvature": H})
            told["peak"] = max(client.run(_peak).values())
    told["same"] = _same(folder, H)
    return told


def killed(folder: str) -> dict[str, Any]:
    """One of two workers dies while they compute."""
    parts = _cut_before(folder)
    with _cluster(2) as client:
        H = np.full(parts.shape, np.nan)
        victim = next(iter(client.run(os.getpid).values()))

        def kill() -> None:
            while np.isfinite(H).mean() < 1 / 3:
                time.sleep(0.005)
            os.kill(victim, signal.SIGKILL)

        thread = threading.Thread(target=kill)
        thread.start()
        qc.evaluate(_with(parts, client), out={"mean_curvature": H})
        thread.join()
    return {"same": _same(folder, H)}


def _with(parts: qc.FaceParts, client: Any) -> qc.FaceParts:
    parts.__dict__["client"] = client
    return parts


@contextmanager
def _cluster(workers: int) -> Iterator[Any]:
    from distributed import Client, LocalCluster

    with (
        LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


def _peak() -> float:
    """Most memory that the process held, in 10^6 bytes; what it was begun by held is not counted."""
    status = Path("/proc/self/status")
    if status.exists():
        (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) * 1024 / 1e6
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
