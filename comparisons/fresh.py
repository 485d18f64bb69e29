"""What takes a process of its own: peak memory, first calls, and the same calls by another checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from comparisons.goals import Ratio
from quadcurv.kernels import ranges

HERE = Path(__file__).parents[1]
MEMORY = """
import resource, sys
import numpy as np, igl, quadcurv as qc
from comparisons.performance import face_lists, triangles
def run(points, faces, cut):
    if sys.argv[1] == "libigl":
        return igl.massmatrix(points, cut), igl.cotmatrix(points, cut) @ points
    mesh = qc.QuadMesh(points, faces)
    return mesh, qc.mean_curvature_normal(mesh, "finite_volume")
points, faces = face_lists(16)["natural"]
run(points, faces, triangles(faces))
points, faces = face_lists(int(sys.argv[2]))["natural"]
cut = triangles(faces)
def now():
    pages = int(open("/proc/self/statm").read().split()[1])
    return pages * resource.getpagesize()
before = now()
open("/proc/self/clear_refs", "w").write("5")
kept = run(points, faces, cut)
peak = [int(l.split()[1]) * 1024 for l in open("/proc/self/status") if l.startswith("VmHWM")][0]
print((peak - before) / len(points))
"""
FIRST_CALL = """
import numpy as np
import quadcurv
x, y = np.meshgrid(*[np.linspace(0, 1, 64)] * 2)
quadcurv.mean_curvature(quadcurv.QuadGrid(np.stack([x, y, x * y], axis=-1)), "finite_volume")
"""
COLD = """
import sys, time
import numba, numpy as np, scipy.sparse, quadcurv as qc
x, y = np.meshgrid(*[np.linspace(0, 1, 65)] * 2)
points = np.stack([x, y, x * y], axis=-1)
grid = qc.QuadGrid(points[:-1, :-1])
cells = qc.StaggeredGrid(points[1::2, 1::2], points[::2, ::2])
verbs = qc.mean_curvature, qc.mean_curvature_normal, qc.dual_areas, qc.stiffness_matrix
begin = time.process_time()
if sys.argv[1] == "first verb, grid":
    qc.mean_curvature(grid, "finite_volume")
elif sys.argv[1] == "jets, grid and faces":
    for mesh in grid, grid.to_mesh():
        qc.principal_curvatures(mesh, "jet")
else:
    for mesh in grid, cells, grid.to_mesh():
        qc.vertex_normals(mesh)
        for scheme in "finite_volume", "liu":
            for verb in verbs:
                verb(mesh, scheme)
print(time.process_time() - begin)
"""
COLD_GOALS = {"first verb, grid": (2.0, 1.5), "all verbs": (6.0, 5.0), "jets, grid and faces": (4.0, 3.0)}


def python(code: str, *given: object, folder: Path = HERE, **environment: str) -> str:
    """Run code in a fresh process, with the quadcurv and the comparisons that lie in a folder."""
    command = [sys.executable, "-c", code, *map(str, given)]
    environment = {**os.environ, **environment, "PYTHONPATH": str(folder)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=True)
    return done.stdout


def memory(n: int) -> tuple[Ratio, dict[str, float]]:
    """Peak of memory beyond the mesh, as it is given, of one call: Linux only."""
    peak = {who: float(python(MEMORY, who, n)) for who in ("finite_volume", "libigl")}
    share = peak["finite_volume"] / peak["libigl"]
    name = "peak memory, one call"
    return Ratio(name, "libigl", n * n, ranges.threads(), share, share, share, 1 / 10, 1 / 15), peak


def first_call(count: int) -> Ratio:
    """Seconds until the first mean curvature is there, less those of a bare interpreter.

    Compiled code is on disk, Python's own too, as it is of what is installed. What an interpreter with numba
    in it takes to end, some 0.3 s, is not counted.
    """
    with tempfile.TemporaryDirectory() as folder:

        def until_there(code: str) -> float:
            begin = time.monotonic()  # the same clock in all processes
            code += "import time; print(time.monotonic())"
            found = python(code, PYTHONDONTWRITEBYTECODE="", PYTHONPYCACHEPREFIX=folder)
            return float(found) - begin

        until_there(FIRST_CALL)
        seconds = [until_there(FIRST_CALL) - until_there("") for _ in range(count)]
    low, median, high = np.quantile(seconds, (0.25, 0.5, 0.75))
    return Ratio("first call, seconds", "bare python", 64 * 64, 1, low, median, high, 0.5, 0.4)


def cold_calls(count: int, old: Path | None = None) -> Iterator[Ratio]:
    """Processor seconds of first calls with nothing compiled, less those of imports.

    All verbs are H, H n, normals, dual areas and stiffness by both schemes on a grid, a staggered grid and a
    face list. Where there is another checkout, its seconds in turn, and the ratio of the two.
    """
    for name, (must, aim) in COLD_GOALS.items():
        seconds: dict[Path, list[float]] = {folder: [] for folder in (HERE, old) if folder}
        for _ in range(count):
            for folder, found in seconds.items():
                with tempfile.TemporaryDirectory() as cache:
                    found.append(float(python(COLD, name, folder=folder, NUMBA_CACHE_DIR=cache)))
        what = f"nothing compiled, seconds, {name}"
        new = quartiles(seconds[HERE])
        yield Ratio(what, "imports", 4096, 1, *new, must, aim)
        if old:
            before = quartiles(seconds[old])
            yield Ratio(f"{what}, of the other checkout", "imports", 4096, 1, *before)
            share = quartiles(np.array(seconds[HERE]) / seconds[old])
            yield Ratio(what, "the other checkout", 4096, 1, *share, 1.0, 0.5)


def quartiles(values: list[float] | NDArray[np.float64]) -> tuple[float, float, float]:
    """The lower quartile, the median and the upper one."""
    low, median, high = np.quantile(values, (0.25, 0.5, 0.75)).tolist()
    return low, median, high


WARM = """
import sys, time
import numpy as np, quadcurv as qc
qc.set_threads(1)
large, small, few = map(int, sys.argv[1:])
def torus(n):
    u, v = np.meshgrid(*[2 * np.pi * np.arange(n) / n] * 2, indexing="ij")
    r = 3 + np.cos(u) + 0.2 * np.sin(3 * v)
    return np.stack([r * np.cos(v), r * np.sin(v), np.sin(u)], axis=-1)
def faces(n):
    i = np.pad(np.arange(n * n).reshape(n, n), [(0, 1), (0, 1)], mode="wrap")
    return np.stack([i[:-1, :-1], i[1:, :-1], i[1:, 1:], i[:-1, 1:]], axis=-1).reshape(-1, 4)
grids = {n: qc.QuadGrid(torus(n), (True, True)) for n in (large, small, few)}
given = {n: (torus(n).reshape(-1, 3), faces(n)) for n in (large, few)}
mesh = qc.QuadMesh(*given[large])
points, Hn, jet = given[large][0], qc.mean_curvature_normal, qc.principal_curvatures
def sheet(n):
    x, y = np.meshgrid(*[np.linspace(-1, 1, n)] * 2, indexing="ij")
    return np.stack([x, y, x * y], axis=-1)
sheets = {n: sheet(n) for n in (large, small)}
cells = qc.StaggeredGrid(sheets[large][1:-1:2, 1:-1:2], sheets[large][:-1:2, :-1:2])
quartic = qc.schemes.jet(4)
jobs = {
    "finite_volume, grid": lambda: Hn(grids[large], "finite_volume"),
    "finite_volume, small grid": lambda: Hn(grids[small], "finite_volume"),
    "liu, open grid": lambda: Hn(qc.QuadGrid(sheets[large]), "liu"),
    "liu, small open grid": lambda: Hn(qc.QuadGrid(sheets[small]), "liu"),
    "finite_volume, staggered grid": lambda: Hn(cells, "finite_volume"),
    "finite_volume, one call": lambda: Hn(given[large], "finite_volume"),
    "finite_volume, repeated": lambda: Hn(mesh.with_points(points), "finite_volume"),
    "jet(4), grid": lambda: jet(grids[few], quartic),
    "jet(4), one call": lambda: jet(given[few], quartic),
    "jet, grid": lambda: jet(grids[few], "jet"),
    "jet, one call": lambda: jet(given[few], "jet"),
    "stiffness": lambda: qc.stiffness_matrix(mesh, "finite_volume"),
    "stiffness, bunge": lambda: qc.stiffness_matrix(qc.QuadMesh(*given[few]), "bunge"),
}
for job in jobs.values():
    job()
print(*jobs, sep=";", flush=True)
for line in sys.stdin:
    job, first = jobs[line.strip()], time.process_time()
    while True:
        begin = time.process_time()
        job()
        now = time.process_time()
        if now - first >= 0.1:
            break
    print(now - begin, flush=True)
"""


class Worker:
    """A process that runs the jobs of `WARM` with the quadcurv that lies in a folder."""

    def __init__(self, folder: Path, *sizes: int) -> None:
        self.folder = folder
        self.process = subprocess.Popen(
            [sys.executable, "-c", WARM, *map(str, sizes)],
            cwd=tempfile.gettempdir(),  # where there is no quadcurv
            env={**os.environ, "PYTHONPATH": str(folder)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.jobs = self._line().split(";")

    def _line(self) -> str:
        assert self.process.stdout
        line = self.process.stdout.readline()
        if not line:
            self.process.communicate()
            raise RuntimeError(f"the quadcurv in {self.folder} ended with {self.process.returncode}")
        return line.strip()

    def seconds(self, job: str) -> float:
        """Processor time of one call, after others for 0.1 s."""
        assert self.process.stdin
        self.process.stdin.write(f"{job}\n")
        self.process.stdin.flush()
        return float(self._line())

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.communicate()


def beside(old: Path, count: int, sizes: tuple[int, int, int]) -> Iterator[Ratio]:
    """Warm processor times over those of another checkout, in turn; large, small and few are (n, n) grids."""
    rng = np.random.default_rng(0)
    with Worker(HERE, *sizes) as new, Worker(old, *sizes) as before:
        for job in new.jobs:
            taken = np.empty((count, 2))
            for k in range(count):
                for who in rng.permutation(2):
                    taken[k, who] = (new, before)[who].seconds(job)
            n = (
                sizes[1]
                if "small" in job
                else sizes[2]
                if job.startswith(("jet", "stiffness, "))
                else sizes[0]
            )
            share = quartiles(taken[:, 0] / taken[:, 1])
            # The default fit chooses at every vertex what the one of 0.1 had fixed: jet(4) is that one.
            goal = () if job.startswith("jet,") else (1.03, 1.0)
            yield Ratio(f"{job}, warm", "the other checkout", n * n, 1, *share, *goal)
