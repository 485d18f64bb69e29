"""Time and memory of the fast schemes beside other libraries and beside a copy of the same bytes.

All contestants of a table run in one process in turn, round after round; what is given is the median over
the rounds of the ratio within a round, and its quartiles. Run on a quiet computer:

    python -m comparisons.performance
"""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import quadcurv as qc
from comparisons import gpu
from comparisons.common import arguments
from comparisons.figures import COLOURS, MARKERS, figure, paper_style, save_figure
from quadcurv.kernels import quad, ranges, vector
from quadcurv.schemes.diamond import diamond

Floats = NDArray[np.float64]
Job = Callable[[], Any]
Jobs = dict[str, Job]
Key = TypeVar("Key", str, tuple[int, str])
REPORT = Path(__file__).with_name("PERFORMANCE.md")
SIZES = (256, 1024, 2048)  # vertices in each direction: 65 thousand, 1 and 4 million
PEERS = ("libigl", "vtk", "pymeshlab", "robust-laplacian", "scipy", "numpy", "numba")
LOOP = 0.1  # seconds, of calls that are repeated
THESIS_OPERATIONS = 197  # a vertex, as the thesis counts its own implementation (above Figure 3.12)


@dataclass(frozen=True)
class Ratio:
    """A ratio of two times (or bytes): median and quartiles over the rounds, and what it is to reach.

    Attributes
    ----------
    name, against : str
    vertices, threads : int
    low, median, high : float
    must, aim : float
        NaN where nothing is asked. A ratio that has to be small has must >= aim, others must <= aim.
    """

    name: str
    against: str
    vertices: int
    threads: int
    low: float
    median: float
    high: float
    must: float = np.nan
    aim: float = np.nan

    @property
    def verdict(self) -> str:
        """Which of the two is reached."""
        if np.isnan(self.must):
            return ""
        sign = 1 if self.must <= self.aim else -1
        if sign * self.median >= sign * self.aim:
            return "aim"
        return "must" if sign * self.median >= sign * self.must else "missed"


def torus(n: int) -> Floats:
    """(n, n, 3) points that wrap in both directions; the normal points outward."""
    u, v = np.meshgrid(*[2 * np.pi * np.arange(n) / n] * 2, indexing="ij")
    r = 3 + np.cos(u) + 0.2 * np.sin(3 * v)
    return np.stack([r * np.cos(v), r * np.sin(v), np.sin(u)], axis=-1)


def numpy_finite_volume(points: Floats) -> Floats:
    """H n of the finite-volume scheme on a grid that wraps, as one writes it with whole arrays."""

    def at(i: int, j: int) -> Floats:
        return np.roll(points, (-i, -j), axis=(0, 1))

    flux = np.zeros_like(points)
    for a, d, b in (
        ((1, 0), (1, 1), (0, 1)),
        ((0, 1), (-1, 1), (-1, 0)),
        ((-1, 0), (-1, -1), (0, -1)),
        ((0, -1), (1, -1), (1, 0)),
    ):
        t1, t2 = at(*d) - points, at(*b) - at(*a)
        t11 = (t1 * t1).sum(axis=-1, keepdims=True)
        t12 = (t1 * t2).sum(axis=-1, keepdims=True)
        t22 = (t2 * t2).sum(axis=-1, keepdims=True)
        flux += (t22 * t1 - t12 * t2) / np.sqrt(t11 * t22 - t12**2)
    area = np.linalg.norm(np.cross(at(1, 0) - at(-1, 0), at(0, 1) - at(0, -1)), axis=-1, keepdims=True) / 2
    return flux / (2 * area)


def interpreted(*modules: ModuleType, **instead: Any) -> dict[str, Any]:
    """What is in modules of kernels, these as plain Python that calls plain Python; some names replaced."""
    names = {name: value for module in modules for name, value in vars(module).items()}
    plain = {name: getattr(value, "py_func", value) for name, value in names.items()}
    for name, f in plain.items():
        if isinstance(f, FunctionType) and f.__module__ in {module.__name__ for module in modules}:
            names[name] = FunctionType(f.__code__, names, name, f.__defaults__)
    names.update(instead)
    return names


def short(name: str) -> str:
    """A name as figures have it."""
    return name.replace("finite_volume", "FV").replace("liu", "Liu")


def operations(newton: bool = False) -> dict[str, int]:
    """Floating-point operations a vertex of H n on a grid, counted while the kernels' own code runs.

    Parameters
    ----------
    newton : bool
        Count what a reciprocal root is made of; else it is a root and a quotient, as in the thesis.

    Returns
    -------
    dict
        "differences": 2 x 3 for the diagonals of the quad, and as many for those of the ring. "normal": of
        unit length. "fluxes": of one quad, whose four fluxes are two and their opposites. "sums": 3 x 3 of
        fluxes into vertices. "area", "scaling": of one vertex. "all": the total. Not counted is what tells
        an area from rounding, of the quad and of the ring: the thesis has nothing of the kind.
    """
    count = 0

    class Counted(float):
        pass

    def counting(name: str) -> Callable[[float, float], Counted]:
        def operator(a: float, b: float) -> Counted:
            nonlocal count
            count += 1
            return Counted(getattr(float, name)(float(a), float(b)))

        return operator

    for name in ("add", "sub", "mul", "truediv"):
        for kind in ("__{}__", "__r{}__"):
            setattr(Counted, kind.format(name), counting(kind.format(name)))

    names = interpreted(
        vector,
        quad,
        less_half=lambda _, x: Counted(float(x) ** -0.5),  # no floating-point operation
        **({} if newton else {"reciprocal_root": lambda x: 1 / (x * 1)}),  # counts as two
    )

    def run(name: str, *given: Any) -> int:
        nonlocal count
        count = 0
        names[name](*given)
        return count

    u, v = (tuple(map(Counted, x)) for x in ((1.0, 0.2, 0.3), (-0.1, 1.1, 0.4)))
    parts = {
        "differences": 12,
        "normal": run("cross", u, v) + run("dot", u, u) + run("reciprocal_root", u[0]) + 3,
        "fluxes": run("fluxes", u, v, u),
        "sums": 9,
        "area": run("cross", u, v) + run("dot", u, u) + run("ring_scale", u[0]),
        "scaling": run("times", u, u[0]),
    }
    return {**parts, "all": sum(parts.values())}


def rounds(jobs: Mapping[Key, Job], count: int, loop: float = 0) -> dict[Key, Floats]:
    """Wall time of each job in each round; all run once beforehand.

    Every round has an order of its own: what a job leaves in the caches, and whether it leaves other
    threads awake, is then not always for the same one. A job runs until `loop` seconds have passed, and its
    last call counts: threads are slow to wake after a pause, of which calls repeated in a loop see nothing.
    With 0 it is one call.
    """
    for job in jobs.values():
        job()
    times = np.empty((len(jobs), count))
    calls, rng = list(jobs.values()), np.random.default_rng(0)
    for k in range(count):
        for i in rng.permutation(len(calls)):
            job = calls[i]
            first = time.perf_counter()
            while True:
                begin = time.perf_counter()
                job()
                now = time.perf_counter()
                if now - first >= loop:
                    break
            times[i, k] = now - begin
    return dict(zip(jobs, times, strict=True))


def ratio(name: str, against: str, times: Mapping[str, Floats], small: bool, **rest: Any) -> Ratio:
    """Ratio of times within a round, of `name` to `against` where it is to be small, else of these to it."""
    quotient = times[name] / times[against] if small else times[against] / times[name]
    low, median, high = np.quantile(quotient, (0.25, 0.5, 0.75))
    return Ratio(name, against, low=low, median=median, high=high, **rest)


def grid_jobs(n: int) -> tuple[Jobs, Jobs]:
    """The grid passes and a copy of the bytes they read and write, by our threads; the scheme by numpy."""
    points = torus(n)
    closed, open_ = qc.QuadGrid(points, (True, True)), qc.QuadGrid(points)
    out = {"mean_curvature_normal": np.empty_like(points)}
    target = out["mean_curvature_normal"]

    def copy() -> None:
        ranges.over(lambda i, j: np.copyto(target[i:j], points[i:j]), n, n * n)

    ours: Jobs = {"copy": copy}
    for scheme in ("finite_volume", "liu"):
        for kind, grid in (("wrapped", closed), ("open", open_)):
            ours[f"{scheme}, {kind} grid"] = partial(qc.evaluate, grid, scheme=scheme, out=out)
    return ours, {"numpy": lambda: numpy_finite_volume(points)}


def face_lists(n: int) -> dict[str, tuple[Floats, NDArray[np.int64]]]:
    """The torus as a face list, in natural order and with vertices and faces shuffled."""
    points = torus(n).reshape(-1, 3)
    faces = qc.QuadGrid(torus(n), (True, True)).stencils().faces.astype(np.int64)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(points))
    shuffled = np.argsort(order)[faces][rng.permutation(len(faces))]
    return {"natural": (points, faces), "shuffled": (points[order], shuffled)}


def triangles(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each quad cut along its first diagonal."""
    return np.ascontiguousarray(np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]])))


def peer_jobs(points: Floats, faces: NDArray[np.int64]) -> Iterator[tuple[str, Job]]:
    """Mean curvature by every other library that is installed; meshes are made beforehand."""
    cut, n = triangles(faces), len(points)
    import igl

    def cotan() -> Any:
        return igl.massmatrix(points, cut), igl.cotmatrix(points, cut) @ points

    yield "libigl", cotan

    import pyvista
    import vtk

    surface = pyvista.PolyData.from_regular_faces(points, cut.astype(int))
    curvatures = vtk.vtkCurvatures()
    curvatures.SetInputData(surface)
    curvatures.SetCurvatureTypeToMean()

    def mean() -> None:
        curvatures.Modified()
        curvatures.Update()

    yield "VTK", mean
    if n <= 2**20:
        try:
            import pymeshlab
        except ImportError:
            pass
        else:
            meshes = pymeshlab.MeshSet()
            meshes.add_mesh(pymeshlab.Mesh(points, cut))
            yield (
                "MeshLab",
                lambda: meshes.compute_scalar_by_discrete_curvature_per_vertex(
                    curvaturetype="Mean Curvature"
                ),
            )
        try:
            import robust_laplacian
        except ImportError:
            pass
        else:
            yield "robust_laplacian", lambda: robust_laplacian.mesh_laplacian(points, cut)[0] @ points
    if n <= 2**16:
        yield "igl.principal_curvature", lambda: igl.principal_curvature(points, cut, radius=2)


def face_jobs(n: int) -> tuple[Jobs, Jobs]:
    """Face lists, once and repeatedly, in natural and in shuffled order, stiffness matrices; peers."""
    import igl
    import scipy.sparse

    def moved(mesh: qc.QuadMesh, points: Floats, scheme: str) -> Floats:
        return qc.mean_curvature_normal(mesh.with_points(points), scheme)

    lists = face_lists(n)
    ours: Jobs = {}
    for scheme in ("finite_volume", "liu"):
        for kind, (x, f) in lists.items():
            mesh = qc.QuadMesh(x, f).reordered()
            moved(mesh, x, scheme)
            ours[f"{scheme}, repeated, {kind}"] = partial(moved, mesh, x, scheme)
    for kind, given in lists.items():
        ours[f"finite_volume, one call, {kind}"] = partial(qc.mean_curvature_normal, given, "finite_volume")

    points, faces = lists["natural"]
    cut = triangles(faces)
    peers = dict(peer_jobs(points, faces))
    if "igl.principal_curvature" in peers:
        ours["jet, one call"] = partial(qc.principal_curvatures, (points, faces))
        ours["jet, grid"] = partial(qc.principal_curvatures, qc.QuadGrid(torus(n), (True, True)))
    mesh = qc.QuadMesh(points, faces)
    S = qc.stiffness_matrix(mesh, "finite_volume")
    ours["stiffness"] = lambda: qc.stiffness_matrix(mesh, "finite_volume")
    ours["stiffness in place"] = lambda: qc.stiffness_matrix(mesh, "finite_volume", out=S)
    local = np.ones(16 * len(faces))
    i, j = np.repeat(faces, 4, axis=1).ravel(), np.tile(faces, (1, 4)).ravel()
    order, target = np.random.default_rng(1).permutation(len(points)), np.empty_like(points)
    peers["numpy.take, shuffled"] = partial(np.take, points, order, 0, target, "clip")
    peers["scipy coo->csr"] = lambda: scipy.sparse.csr_array((local, (i, j)), shape=S.shape)
    if len(points) <= 2**20:
        peers["scipy assembly"] = lambda: scipy.sparse.csr_array(
            (diamond(points[faces])[0].ravel(), (i, j)), shape=S.shape
        )
    peers["igl.cotmatrix"] = lambda: igl.cotmatrix(points, cut)
    return ours, peers


def on_threads(ours: Jobs, peers: Jobs, count: int, loop: float = 0) -> dict[int, dict[str, Floats]]:
    """Times by number of threads: ours on one and on two, the peers as they are, in common rounds."""

    def on(threads: int, job: Job) -> Job:
        def run() -> None:
            qc.set_threads(threads)
            job()

        return run

    times = rounds(
        {(t, name): on(t, job) for name, job in ours.items() for t in (1, 2)}
        | {(0, name): job for name, job in peers.items()},
        count,
        loop,
    )
    return {t: {name: taken for (s, name), taken in times.items() if s in (0, t)} for t in (1, 2)}


def of_grids(n: int, threads: int, times: dict[str, Floats]) -> Iterator[Ratio]:
    """Ratios of the grid table."""
    asked = n >= 1024 and threads == 2
    rest: dict[str, Any] = {"vertices": n * n, "threads": threads}
    for name in times:
        if "grid" in name:
            yield ratio(name, "copy", times, True, **rest, **({"must": 2.0, "aim": 1.5} if asked else {}))
            if "wrapped" in name:
                yield ratio(name, "numpy", times, False, **rest, **({"must": 25, "aim": 60} if asked else {}))


def of_faces(n: int, threads: int, times: dict[str, Floats]) -> Iterator[Ratio]:
    """Ratios of the face-list table."""
    rest: dict[str, Any] = {"vertices": n * n, "threads": threads}

    def goal(must: float, aim: float) -> dict[str, Any]:
        """What is asked of large meshes and two threads."""
        return {**rest, "must": must, "aim": aim} if n >= 256 and threads == 2 else rest

    goals = {"libigl": goal(35, 80), "VTK": goal(28, 40), "MeshLab": goal(50, 90)}
    peers = ("libigl", "VTK", "MeshLab", "robust_laplacian")
    for scheme in ("finite_volume", "liu"):
        natural, shuffled = (f"{scheme}, repeated, {kind}" for kind in ("natural", "shuffled"))
        for peer in peers:
            if peer in times:
                yield ratio(natural, peer, times, False, **goals.get(peer, rest))
        yield ratio(shuffled, natural, times, True, **goal(3, 1.5))
    once = "finite_volume, one call, "
    yield ratio(once + "natural", "libigl", times, False, **goal(10, 20))
    yield ratio(once + "shuffled", once + "natural", times, True, **rest)
    yield ratio("stiffness", "scipy coo->csr", times, False, **goal(5, 6))
    if "scipy assembly" in times:
        yield ratio("stiffness", "scipy assembly", times, False, **rest)
    yield ratio("stiffness", "igl.cotmatrix", times, False, **goal(20, 30))
    yield ratio("stiffness in place", "igl.cotmatrix", times, False, **rest)
    for name in ("jet, one call", "jet, grid"):
        if name in times:
            yield ratio(name, "igl.principal_curvature", times, False, **goal(8, 8))


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


def python(code: str, *given: object, **environment: str) -> str:
    """Run code in a fresh process, in the folder that holds this package."""
    command = [sys.executable, "-c", code, *map(str, given)]
    folder, environment = Path(__file__).parents[1], {**os.environ, **environment}
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

    Compiled code is on disk. What an interpreter with numba in it takes to end, some 0.3 s, is not counted.
    """

    def until_there(code: str) -> float:
        begin = time.monotonic()  # the same clock in all processes
        return float(python(code + "import time; print(time.monotonic())")) - begin

    until_there(FIRST_CALL)
    seconds = [until_there(FIRST_CALL) - until_there("") for _ in range(count)]
    low, median, high = np.quantile(seconds, (0.25, 0.5, 0.75))
    return Ratio("first call, seconds", "bare python", 64 * 64, 1, low, median, high, 1.0, 0.5)


def cold_calls(count: int) -> Iterator[Ratio]:
    """Processor seconds of first calls with nothing compiled, less those of imports.

    All verbs are H, H n, normals, dual areas and stiffness by both schemes on a grid, a staggered grid and a
    face list.
    """
    for name, (must, aim) in COLD_GOALS.items():
        seconds = []
        for _ in range(count):
            with tempfile.TemporaryDirectory() as folder:
                seconds.append(float(python(COLD, name, NUMBA_CACHE_DIR=folder)))
        low, median, high = np.quantile(seconds, (0.25, 0.5, 0.75))
        yield Ratio(f"nothing compiled, seconds, {name}", "imports", 4096, 1, low, median, high, must, aim)


def growth(times: Mapping[int, Mapping[str, Floats]]) -> dict[str, float]:
    """Exponent p of median time = c n^p in the number of vertices, of all that ran at three sizes."""
    sizes = sorted(times)
    common = [name for name in times[sizes[0]] if all(name in times[n] for n in sizes)]
    return {
        name: float(np.polyfit(np.log(sizes), [np.log(np.median(times[n][name])) for n in sizes], 1)[0])
        for name in common
    }


def measure(quick: bool) -> tuple[list[Ratio], dict[str, dict[int, dict[str, Floats]]], dict[str, float]]:
    """All ratios; times of the grid and of the face-list table by size, two threads; bytes a vertex."""
    sizes, count = ((64, 128), 2) if quick else (SIZES, 7)
    times: dict[str, dict[int, dict[str, Floats]]] = {"grids": {}, "faces": {}}
    ratios: list[Ratio] = []
    try:
        for n in sizes:
            grids, faces = on_threads(*grid_jobs(n), 3 * count), on_threads(*face_jobs(n), count, LOOP)
            times["grids"][n * n], times["faces"][n * n] = grids[2], faces[2]
            for threads in (1, 2):
                ratios += [*of_grids(n, threads, grids[threads]), *of_faces(n, threads, faces[threads])]
        qc.set_threads(2)
        n = sizes[-1] if quick else 1024
        used, peak = memory(n) if sys.platform == "linux" else (None, {})
        ratios += [r for r in (used, first_call(3 if quick else 9)) if r]
        ratios += cold_calls(1 if quick else 5)
    finally:
        qc.set_threads(None)
    if not quick:
        for table in times.values():
            for name, p in growth(table).items():
                ours = name.startswith(("finite_volume", "liu", "stiffness"))
                must, aim = (1.05, 1.0) if ours else (np.nan, np.nan)
                ratios.append(
                    Ratio(f"exponent of growth, {name}", "n", sizes[-1] ** 2, 2, p, p, p, must, aim)
                )
    return ratios, times, peak


def versions() -> str:
    """Libraries that took part."""
    found = []
    for name in PEERS:
        try:
            found.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            found.append(f"{name} not installed")
    return ", ".join(found)


def markdown(
    ratios: list[Ratio],
    times: dict[str, dict[int, dict[str, Floats]]],
    peak: dict[str, float],
    quick: bool = False,
) -> str:
    """The report."""
    counted = operations()
    lines = [
        "# Speed",
        "",
        "Written by `python -m comparisons.performance`. Median and quartiles, over the rounds, of the ratio",
        "of two wall times taken in one round of one process; *must* and *aim* were set beforehand.",
        "Validation is never left out: *one call* checks the mesh, sorts its corners and evaluates;",
        "*repeated* moves the points of a mesh (`mesh.with_points(points)`, which checks them; of",
        "`mesh.reordered()`, which was made before) and evaluates. A *copy* reads and writes the 24 + 24",
        "bytes a vertex that the mean curvature normal",
        "reads and writes, on as many threads. Every round has an order of its own. Grids and copies are",
        "called once a round: what they read and write was last used by another of them, and of 65 536",
        "and a million vertices may still be in the last cache. Face lists and their peers are called",
        "again until 0.1 s have passed, and the last call counts. *numpy.take* does nothing but bring",
        "points into a random order: so memory's own cost grows there. *First call* is a fresh process,",
        "until its result is there; *nothing compiled* are processor seconds of one with an empty cache.",
        "",
        f"Python {platform.python_version()}, {os.cpu_count()} cores, {versions()}.",
        "",
        f"Floating-point operations a vertex: {counted['all']} "
        f"({', '.join(f'{n} {name}' for name, n in counted.items() if name != 'all')}); "
        f"the thesis's implementation took {THESIS_OPERATIONS}. "
        f"A reciprocal root counts as two; made of products and sums as it is, the total is "
        f"{operations(newton=True)['all']}.",
    ]
    if peak:
        per = ", ".join(f"{who} {b:.0f}" for who, b in peak.items())
        lines += ["", f"Peak memory of one call beyond points and faces, bytes a vertex: {per}."]
    lines += [
        "",
        "| what | against | vertices | threads | median | quartiles | must | aim | reached |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |",
    ]
    for r in ratios:
        goal = ["", ""] if np.isnan(r.must) else [f"{r.must:.3g}", f"{r.aim:.3g}"]
        cells = [
            r.name,
            r.against,
            str(r.vertices),
            str(r.threads),
            f"{r.median:.3g}",
            f"{r.low:.3g} to {r.high:.3g}",
            *goal,
            r.verdict,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "Nanoseconds a vertex, median, 2 threads:", ""]
    for table in times.values():
        sizes = sorted(table)
        lines.append(f"| | {' | '.join(str(n) for n in sizes)} |")
        lines.append("| --- |" + " ---: |" * len(sizes))
        for name in table[sizes[0]]:
            row = [f"{np.median(table[n][name]) / n * 1e9:.1f}" if name in table[n] else "" for n in sizes]
            lines.append(f"| {name} | {' | '.join(row)} |")
        lines.append("")
    lines += ["## On a graphics processor", "", *gpu.lines(quick), ""]
    return "\n".join(lines)


@paper_style
def plots(output: Path, ratios: list[Ratio], times: dict[str, dict[int, dict[str, Floats]]]) -> None:
    """Time a vertex against size, and how often faster than the peers."""
    fig, (left, right) = figure(1, 2, size=(9.2, 4.2), sharey=True)
    chosen = {
        left: ("grids", "grids", ("copy", "finite_volume, wrapped grid", "liu, open grid", "numpy")),
        right: (
            "faces",
            "face lists",
            (
                "finite_volume, repeated, natural",
                "finite_volume, repeated, shuffled",
                "finite_volume, one call, natural",
                "libigl",
                "VTK",
                "MeshLab",
                "robust_laplacian",
            ),
        ),
    }
    for axes, (table, title, names) in chosen.items():
        by_size = times[table]
        for i, name in enumerate(names):
            sizes = np.array([n for n in sorted(by_size) if name in by_size[n]])
            if sizes.size == 0:
                continue
            nanoseconds = [np.median(by_size[n][name]) / n * 1e9 for n in sizes]
            style = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
            axes.plot(sizes, nanoseconds, label=short(name), **style)
        axes.set(xscale="log", yscale="log", xlabel="vertices", title=title)
    left.legend(fontsize=7, loc="upper right")
    right.legend(fontsize=7, loc="lower right", ncols=2)
    left.set_ylabel("time per vertex (ns)")
    save_figure(fig, output, "performance-time")

    # A goal for each in the largest size that it is asked of.
    goals = {(r.name, r.against): r for r in ratios if not np.isnan(r.must) and "growth" not in r.name}
    fig, axes = figure(size=(7.2, 0.32 * len(goals) + 1.2))
    for i, r in enumerate(goals.values()):
        sign = 1 if r.must <= r.aim else -1
        share = [(x / r.must) ** sign for x in (r.low, r.median, r.high, r.aim)]
        axes.plot(sorted([share[0], share[2]]), [i, i], color=COLOURS[0])
        axes.plot(share[1], i, "o", color=COLOURS[0], label="measured, quartiles" if i == 0 else None)
        axes.plot(share[3], i, "|", color=COLOURS[1], markersize=10, label="aim" if i == 0 else None)
    axes.axvline(1, color=COLOURS[6], linewidth=0.9, label="must")
    labels = [short(f"{r.name} / {r.against}") for r in goals.values()]
    axes.set(
        xscale="log", xlabel="times better than it must be", yticks=range(len(goals)), yticklabels=labels
    )
    axes.minorticks_off()
    axes.set_xticks((0.5, 1, 2, 4), ("0.5", "1", "2", "4"))
    axes.invert_yaxis()
    axes.legend(fontsize=7)
    save_figure(fig, output, "performance-goals")


def main(output: Path, quick: bool = False) -> dict[str, Any]:
    """Measure, and write the report and the figures.

    Parameters
    ----------
    output : path
        Folder for figures, and for the report of a quick run.
    quick : bool
        Small meshes and few rounds, in which no ratio means much.

    Returns
    -------
    dict
        "ratios": list of Ratio. "operations": as from :func:`operations`. "report": path of the report.
    """
    ratios, times, peak = measure(quick)
    output.mkdir(parents=True, exist_ok=True)
    report = output / REPORT.name if quick else REPORT
    report.write_text(markdown(ratios, times, peak, quick))
    plots(output, ratios, times)
    return {"ratios": ratios, "operations": operations(), "report": report}


if __name__ == "__main__":
    given = arguments(__doc__)
    found = main(given.output, given.quick)
    print(found["report"].read_text())
