"""Time and memory of the fast schemes beside other libraries and beside a copy of the same bytes.

All contestants of a table run in one process in turn, round after round; what is given is the median over
the rounds of the ratio within a round, and its quartiles. Run on a quiet computer, some fifteen minutes:

    python -m comparisons.performance [--against PATH]

PATH is another checkout of quadcurv, whose first and warm calls are measured in turn with ours.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

import quadcurv as qc
from comparisons import fit_speed
from comparisons.common import OUTPUT
from comparisons.fresh import beside, cold_calls, first_call, memory
from comparisons.goals import Ratio
from comparisons.meshes import torus, triangles
from comparisons.operations import operations
from comparisons.speed import Times, markdown, plots
from quadcurv.kernels import ranges
from quadcurv.schemes.diamond import diamond

Floats = NDArray[np.float64]
Job = Callable[[], Any]
Jobs = dict[str, Job]
Key = TypeVar("Key", str, tuple[int, str])
REPORT = Path(__file__).with_name("PERFORMANCE.md")
SIZES = {256: 7, 1024: 7, 2048: 3}
"""Vertices in each direction, 65 thousand, 1 and 4 million, and rounds."""
LOOP = 0.1  # seconds, of calls that are repeated
QUAD_MATRICES = ("bilinear", "bunge", "de_goes", "alexa_wardetzky")


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
    if n <= 2**16:
        try:
            import robust_laplacian
        except ImportError:
            pass
        else:
            yield "robust_laplacian", lambda: robust_laplacian.mesh_laplacian(points, cut)[0] @ points


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
            (diamond(points[faces], 1.0)[0].ravel(), (i, j)), shape=S.shape
        )
    peers["igl.cotmatrix"] = lambda: igl.cotmatrix(points, cut)
    if len(points) <= 2**16:  # a million take it ten seconds and 2 GB
        starts = np.arange(0, faces.size + 1, 4)
        peers["igl.cotmatrix(V, I, C)"] = lambda: igl.cotmatrix(points, faces.ravel(), starts)
        for scheme in QUAD_MATRICES:
            ours[f"stiffness, {scheme}"] = partial(_stiffness_at_once, points, faces, scheme)
    return ours, peers


def _stiffness_at_once(points: Floats, faces: NDArray[np.int64], scheme: str) -> Any:
    """Of arrays, as libigl takes them: the mesh is checked too."""
    return qc.stiffness_matrix(qc.QuadMesh(points, faces), scheme)


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
    if "igl.cotmatrix(V, I, C)" in times:
        for scheme in QUAD_MATRICES:
            yield ratio(f"stiffness, {scheme}", "igl.cotmatrix(V, I, C)", times, False, **goal(1, 5))


def growth(times: Mapping[int, Mapping[str, Floats]]) -> dict[str, float]:
    """Exponent p of median time = c n^p in the number of vertices, of all that ran at three sizes."""
    sizes = sorted(times)
    common = [name for name in times[sizes[0]] if all(name in times[n] for n in sizes)]
    return {
        name: float(np.polyfit(np.log(sizes), [np.log(np.median(times[n][name])) for n in sizes], 1)[0])
        for name in common
    }


def measure(quick: bool, old: Path | None = None) -> tuple[list[Ratio], Times, dict[str, float]]:
    """All ratios; times of the grid and of the face-list table by size, two threads; bytes a vertex."""
    sizes = {64: 2, 128: 2} if quick else SIZES
    times: Times = {"grids": {}, "faces": {}}
    ratios: list[Ratio] = []
    try:
        for n, count in sizes.items():
            grids, faces = on_threads(*grid_jobs(n), 3 * count), on_threads(*face_jobs(n), count, LOOP)
            times["grids"][n * n], times["faces"][n * n] = grids[2], faces[2]
            for threads in (1, 2):
                ratios += [*of_grids(n, threads, grids[threads]), *of_faces(n, threads, faces[threads])]
        qc.set_threads(2)
        used, peak = memory(128 if quick else 1024) if sys.platform == "linux" else (None, {})
        ratios += [r for r in (used, first_call(3 if quick else 9)) if r]
        ratios += cold_calls(1 if quick else 5, old)
        ratios += fit_speed.measured(quick)
        if old:
            ratios += beside(old, 2 if quick else 9, (64, 32, 16) if quick else (1024, 200, 128))
    finally:
        qc.set_threads(None)
    if not quick:
        for table in times.values():
            for name, p in growth(table).items():
                ours = name.startswith(("finite_volume", "liu", "stiffness"))
                must, aim = (1.05, 1.0) if ours else (np.nan, np.nan)
                vertices = max(sizes) ** 2
                ratios.append(Ratio(f"exponent of growth, {name}", "n", vertices, 2, p, p, p, must, aim))
    return ratios, times, peak


def main(output: Path, quick: bool = False, old: Path | None = None) -> dict[str, Any]:
    """Measure, and write the report and the figures.

    Parameters
    ----------
    output : path
        Folder for figures, and for the report of a quick run.
    quick : bool
        Small meshes and few rounds, in which no ratio means much.
    old : path, optional
        Another checkout of quadcurv.

    Returns
    -------
    dict
        "ratios": list of Ratio. "operations": as from :func:`operations`. "report": path of the report.
    """
    ratios, times, peak = measure(quick, old)
    output.mkdir(parents=True, exist_ok=True)
    report = output / REPORT.name if quick else REPORT
    report.write_text(markdown(ratios, times, peak, quick))
    plots(output, ratios, times)
    return {"ratios": ratios, "operations": operations(), "report": report}


if __name__ == "__main__":
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder for figures")
    parser.add_argument("--quick", action="store_true", help="small meshes, the report into the folder")
    parser.add_argument("--against", type=Path, help="another checkout of quadcurv")
    given = parser.parse_args()
    old = given.against.resolve() if given.against else None
    print(main(given.output, given.quick, old)["report"].read_text())
