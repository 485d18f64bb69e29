"""Mean curvature by every library at hand beside our schemes: error, rate, time and memory.

Each library is called as its users would call it, on triangles where it knows no quads (each quad cut from
its first to its third vertex), and its result brought to ours: H rather than 2 H, pointwise rather than
integrated, positive on a sphere seen from outside. Libraries that are not installed are left out.
"""

from __future__ import annotations

import contextlib
import importlib
import multiprocessing
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import spearmanr

from comparisons.common import arguments
from comparisons.figures import COLOURS, MARKERS, figure, paper_style, save_figure
from quadcurv import SCHEMES, Fit, QuadGrid, QuadMesh, mean_curvature
from quadcurv.estimate import disagreement
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import Scheme, fundamental_forms
from quadcurv.surfaces import (
    Surface,
    cubed_ellipsoid,
    cubed_sphere,
    elliptic_paraboloid,
    pillow_sphere,
    torus,
)
from quadcurv.tables import by_column, write_csv

Array = NDArray[np.float64]
OURS = "quadcurv"
NORMS = ("one", "inf")

# The libraries -----------------------------------------------------------------------------------------


def triangles(mesh: QuadMesh) -> NDArray[np.int64]:
    """Triangles of a mesh, quads cut from their first to their third vertex."""
    faces = mesh.faces.astype(np.int64)
    return np.concatenate((faces[:, :3], faces[faces[:, 3] >= 0][:, [2, 3, 0]]))


def _from_laplacian(points: Array, cut: Any, laplacian: Any, area: Array) -> Array:
    """H = -(L x / 2 A) . n, L negative semi-definite, n by libigl."""
    import igl

    Hn = (laplacian @ points) / (2 * area[:, None])
    return -np.einsum("ix,ix->i", Hn, igl.per_vertex_normals(points, cut))


def _igl_cotan(mesh: QuadMesh, area: str = "VORONOI") -> Array:
    import igl

    points, cut = np.array(mesh.points), triangles(mesh)
    mass = igl.massmatrix(points, cut, getattr(igl, f"MASSMATRIX_TYPE_{area}"))
    return _from_laplacian(points, cut, igl.cotmatrix(points, cut), mass.diagonal())


def _igl_bunge(mesh: QuadMesh) -> Array:
    import igl

    sides = np.where(mesh.faces[:, 3] < 0, 3, 4)
    corners = mesh.faces[np.arange(4) < sides[:, None]].astype(np.int64)
    points = np.array(mesh.points)
    L, M, _ = igl.cotmatrix(points, corners, np.concatenate(([0], np.cumsum(sides))))
    return _from_laplacian(points, triangles(mesh), L, np.asarray(M.sum(axis=1)).ravel())


def _igl_principal(mesh: QuadMesh, radius: int = 5) -> Array:
    import igl

    _, _, k1, k2, _ = igl.principal_curvature(np.array(mesh.points), triangles(mesh), radius)
    return (k1 + k2) / 2


def _vtk(mesh: QuadMesh) -> Array:
    import pyvista

    cut = triangles(mesh)
    surface = pyvista.PolyData(np.array(mesh.points), np.c_[np.full(len(cut), 3), cut].ravel())
    return np.asarray(surface.curvature("mean"))


def _vtk_quads(mesh: QuadMesh) -> Array:
    import pyvista

    quads = mesh.faces[mesh.faces[:, 3] >= 0]
    surface = pyvista.PolyData(np.array(mesh.points), np.c_[np.full(len(quads), 4), quads].ravel())
    return np.asarray(surface.curvature("mean"))


def _meshlab(mesh: QuadMesh, filter_name: str, factor: float = 1.0, **parameters: Any) -> Array:
    import pymeshlab

    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(np.array(mesh.points), triangles(mesh).astype(np.int32)))
    getattr(meshes, filter_name)(**parameters)
    return factor * meshes.current_mesh().vertex_scalar_array()


_discrete = partial(
    _meshlab,
    filter_name="compute_scalar_by_discrete_curvature_per_vertex",
    curvaturetype="Mean Curvature",
)
_directions = partial(
    _meshlab,
    filter_name="compute_curvature_principal_directions_per_vertex",
    curvcolormethod="Mean Curvature",
    autoclean=False,
)
_apss = partial(_meshlab, filter_name="compute_curvature_and_color_apss_per_vertex", curvaturetype="Mean")


def _trimesh(mesh: QuadMesh) -> Array:
    import trimesh

    surface = trimesh.Trimesh(mesh.points, triangles(mesh), process=False)
    radius = 2 * np.median(surface.edges_unique_length)
    measure = trimesh.curvature.discrete_mean_curvature_measure(surface, surface.vertices, radius)
    return measure / (np.pi * radius**2)


def _robust(mesh: QuadMesh) -> Array:
    robust_laplacian = importlib.import_module("robust_laplacian")
    cut = triangles(mesh)
    L, M = robust_laplacian.mesh_laplacian(np.array(mesh.points), cut)
    return _from_laplacian(mesh.points, cut, -L, M.diagonal())


def _potpourri(mesh: QuadMesh) -> Array:
    potpourri3d = importlib.import_module("potpourri3d")
    points, cut = np.array(mesh.points), triangles(mesh)
    areas = potpourri3d.vertex_areas(points, cut)
    return _from_laplacian(points, cut, -potpourri3d.cotan_laplacian(points, cut), areas)


@dataclass(frozen=True)
class Method:
    """One way to a mean curvature.

    Attributes
    ----------
    name, library : str
    call : callable
        QuadMesh -> (n,) mean curvature, in our sign and factor.
    quads : str
        What becomes of quads.
    note : str
        What was done to the result.
    needs : tuple of str
        Other packages that the call imports.
    """

    name: str
    library: str
    call: Callable[[QuadMesh], Array]
    quads: str = "cut into triangles first"
    note: str = ""
    needs: tuple[str, ...] = ()

    @property
    def installed(self) -> bool:
        """Whether its libraries can be imported; pymeshlab, say, may lack a system library."""
        try:
            for name in (self.library, *self.needs):
                importlib.import_module(name)
        except ImportError:
            return False
        return True


PEERS = (
    Method("libigl cotan, Voronoi", "igl", _igl_cotan, note="-(L x / 2 M) . n"),
    Method("libigl Bunge", "igl", _igl_bunge, "as they are", "-(L x / 2 M) . n"),
    Method("libigl principal, radius 2", "igl", partial(_igl_principal, radius=2), note="(k1 + k2) / 2"),
    Method("libigl principal, radius 5", "igl", _igl_principal, note="(k1 + k2) / 2, the default radius"),
    Method("VTK", "pyvista", _vtk, note="of vtkCurvatures, as it is"),
    Method("MeshLab discrete", "pymeshlab", _discrete, note="as it is"),
    Method("MeshLab Taubin", "pymeshlab", partial(_directions, method="Taubin approximation")),
    Method("MeshLab quadric", "pymeshlab", partial(_directions, method="Quadric Fitting")),
    Method(
        "MeshLab quadric, scale-dependent",
        "pymeshlab",
        partial(_directions, method="Scale Dependent Quadric Fitting"),
        note="scale at its default, 10 % of the diagonal",
    ),
    Method("MeshLab APSS", "pymeshlab", partial(_apss, factor=0.5), note="gives 2 H: halved"),
    Method(
        "trimesh",
        "trimesh",
        _trimesh,
        note="integrated over a ball of two edges: over pi r^2",
        needs=("rtree",),
    ),
    Method("robust_laplacian", "robust_laplacian", _robust, note="-(L x / 2 M) . n"),
    Method("potpourri3d", "potpourri3d", _potpourri, note="-(L x / 2 A) . n"),
)

UNUSABLE = {
    "VTK on quads": "vtkCurvatures takes a quad's corners for a triangle's: H = {vtk:.2f} on a unit sphere",
    "libigl on quads": "cotmatrix takes an array of four columns for tetrahedra, principal_curvature reads "
    "three columns of it; neither says so",
    "robust_laplacian, potpourri3d on quads": "raise a ValueError",
    "MeshLab, trimesh on quads": "split quads into triangles on loading",
    "MeshLab principal component analysis": "not a curvature: H = {pca:.0f} on a unit sphere",
    "MeshLab normal cycles": "integrated over an unstated region: H = {cycles:.3f} on a unit sphere",
    "MeshLab RIMLS": "H = {rimls:.2f} on a unit sphere",
}


def ours() -> tuple[Method, ...]:
    """Our schemes as methods."""

    def method(scheme: Scheme | Fit) -> Method:
        return Method(scheme.name, OURS, lambda mesh: mean_curvature(mesh, scheme).ravel(), "as they are")

    return tuple(map(method, SCHEMES.values()))


# The meshes --------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Sample:
    """A mesh and its exact mean curvature; the grid that it is, if any."""

    mesh: QuadMesh
    exact: Array
    grid: QuadGrid | None = None


def _torus(n: int, skew: float = 0.0, jitter: float = 0.0, noise: float = 0.0) -> Sample:
    """Torus of 2 n x n vertices: slanted, its vertices moved along the surface, or off it, in spacings."""
    surface, rng = torus(), np.random.default_rng(n)
    xi, eta = np.meshgrid(
        np.linspace(-np.pi, np.pi, 2 * n, endpoint=False),
        np.linspace(-np.pi, np.pi, n, endpoint=False),
        indexing="ij",
    )
    xi = xi + skew * np.sin(eta) + jitter * rng.uniform(-1, 1, xi.shape) * np.pi / n
    eta = eta + jitter * rng.uniform(-1, 1, xi.shape) * 2 * np.pi / n
    points = surface.mapping(xi, eta)
    points = points + rng.normal(0, noise * 2 * np.pi / n, points.shape)
    grid = QuadGrid(points, (True, True))
    return Sample(grid.to_mesh(), surface.mean_curvature(xi, eta).ravel(), grid)


def _welded(surface: Surface, rows: int, columns: int) -> tuple[QuadMesh, Array]:
    mesh, xi, eta = surface.sample((rows, columns), "faces")
    assert isinstance(mesh, QuadMesh)
    return mesh, surface.mean_curvature(xi, eta)


def _mixed(n: int) -> Sample:
    """Cubed ellipsoid, three of ten quads cut into triangles."""
    mesh, exact = _welded(cubed_ellipsoid(), n // 2, n // 2)
    cut = np.random.default_rng(n).random(len(mesh.faces)) < 0.3
    quads = mesh.faces[cut]
    padded = np.full((2 * len(quads), 4), -1)
    padded[:, :3] = np.concatenate((quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]))
    both = QuadMesh(mesh.points, np.concatenate((mesh.faces[~cut], padded)))
    return Sample(both, exact)


MESHES: Mapping[str, Callable[[int], Sample]] = {
    "smooth": _torus,
    "skewed": partial(_torus, skew=0.8),
    "jittered": partial(_torus, jitter=0.2),
    "pillow": lambda n: Sample(*_welded(pillow_sphere(), 2 * n, n)),
    "corners": lambda n: Sample(*_welded(cubed_ellipsoid(), n // 2, n // 2)),
    "mixed": _mixed,
    "boundary": lambda n: Sample(*_welded(elliptic_paraboloid(), n, n)),
    "noisy": partial(_torus, noise=1e-3),
}
TITLES = {
    "smooth": "torus, evenly sampled",
    "skewed": "torus, slanted grid",
    "jittered": "torus, vertices moved along it by up to 20 % of their spacing",
    "pillow": "pillow sphere: folds, and four vertices of valence 2",
    "corners": "cubed ellipsoid: eight vertices of valence 3",
    "mixed": "cubed ellipsoid, 30 % of the quads cut into triangles",
    "boundary": "paraboloid over a square, with its boundary",
    "noisy": "torus, positions with noise of 0.1 % of the spacing",
}


# What is measured -----------------------------------------------------------------------------------------


def measured(method: Method, sample: Sample) -> dict[str, float]:
    """Mean and largest error where there is a result, how many have none, and seconds of the fastest call."""
    seconds: list[float] = []
    while not seconds or (len(seconds) < 3 and sum(seconds) < 0.3):
        start = time.perf_counter()
        H = method.call(sample.mesh)
        seconds.append(time.perf_counter() - start)
    error = np.abs(H - sample.exact)
    known = np.isfinite(error)
    return {
        "one": float(error[known].mean()),
        "inf": float(error[known].max()),
        "missing": int((~known).sum()),
        "seconds": min(seconds),
        "vertices": sample.exact.size,
    }


def errors(methods: Sequence[Method], sizes: Sequence[int]) -> Iterator[dict[str, Any]]:
    """One record a mesh, method and size."""
    for mesh, make in MESHES.items():
        samples = {n: make(n) for n in sizes}
        chosen = list(methods)
        if samples[sizes[0]].grid is not None:
            for order in (2, 4):
                scheme = fundamental_forms(order)
                grids = {id(s.mesh): s.grid for s in samples.values()}
                call = partial(_on_grid, grids=grids, scheme=scheme)
                chosen.append(Method(scheme.name, OURS, call, "as a grid"))
        for method in chosen:
            method.call(samples[sizes[0]].mesh)  # compiled and imported
            for n, sample in samples.items():
                yield {"mesh": mesh, "method": method.name, "n": n, **measured(method, sample)}


def _on_grid(mesh: QuadMesh, grids: Mapping[int, Any], scheme: Fit) -> Array:
    return mean_curvature(grids[id(mesh)], scheme).ravel()


def _cost(name: str, n: int) -> tuple[float, float, int]:
    method = next(m for m in (*PEERS, *ours()) if m.name == name)
    method.call(_welded(cubed_ellipsoid(), 8, 8)[0])
    sample = Sample(*_welded(cubed_ellipsoid(), n, n))
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")  # the peak so far is forgotten
    before = _mebibytes("VmRSS")
    method.call(sample.mesh)
    memory = _mebibytes("VmHWM") - before
    return measured(method, sample)["seconds"], memory, sample.exact.size


def _mebibytes(key: str) -> float:
    """Memory in use, or its peak, as Linux tells; NaN elsewhere."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return np.nan
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(key))


def costs(methods: Sequence[Method], n: int) -> dict[str, tuple[float, float]]:
    """Microseconds, and bytes of the peak memory beyond the mesh, a vertex; each in a process of its own."""
    found = {}
    context = multiprocessing.get_context("spawn")
    for method in methods:
        with context.Pool(1) as pool:
            seconds, mebibytes, vertices = pool.apply(_cost, (method.name, n))
        found[method.name] = (1e6 * seconds / vertices, mebibytes * 2**20 / vertices)
    return found


def ranking(n: int) -> list[tuple[str, str, float, float]]:
    """How well the disagreement with a jet ranks the true errors: Spearman, and mean ratio of the sizes."""
    rows = []
    for name in ("smooth", "skewed", "jittered", "corners", "mixed", "boundary"):
        sample = MESHES[name](n)
        for scheme in ("finite_volume", "liu", "cotan-6"):
            estimate = disagreement(sample.mesh, scheme).ravel()
            error = mean_curvature(sample.mesh, scheme).ravel() - sample.exact
            known = np.isfinite(estimate)
            estimate, error = np.abs(estimate[known]), np.abs(error[known])
            rows.append((name, scheme, spearmanr(estimate, error).statistic, estimate.mean() / error.mean()))
    return rows


def quirks() -> dict[str, str]:
    """What cannot be used, with the number that shows it."""
    sphere, _ = _welded(cubed_sphere(), 16, 16)
    values = {"vtk": float(np.median(_vtk_quads(sphere)))}
    if PEERS[5].installed:
        for key, call in (
            ("pca", partial(_directions, method="Principal Component Analysis")),
            ("cycles", partial(_directions, method="Normal Cycles")),
            ("rimls", partial(_meshlab, filter_name="compute_curvature_and_color_rimls_per_vertex")),
        ):
            values[key] = float(np.median(call(sphere)))
    return {
        name: why.format(**values)
        for name, why in UNUSABLE.items()
        if "{" not in why or why.split("{")[1].split(":")[0] in values
    }


# What is written ------------------------------------------------------------------------------------------


def markdown(
    records: Sequence[dict[str, Any]],
    cost: Mapping[str, tuple[float, float]],
    cost_size: int,
    methods: Sequence[Method],
) -> str:
    """Everything as Markdown."""
    sizes = sorted({r["n"] for r in records})
    vertices = 6 * cost_size**2 + 2
    lines = [
        "# Mean curvature by other libraries, and by ours",
        "",
        "Written by `python -m comparisons.peers`. Errors are those of H in 1 / length, their mean and their",
        f"maximum, at the finest of the sizes n = {', '.join(map(str, sizes))}; beside them the rate fitted "
        "over all sizes.",
        "Vertices without a result are counted and left out. Nothing of a method was tuned.",
        "",
    ]
    for mesh, title in TITLES.items():
        mine = [r for r in records if r["mesh"] == mesh]
        count = max(r["vertices"] for r in mine)
        lines += [
            f"## {title[0].upper()}{title[1:]}",
            "",
            f"{count} vertices at n = {sizes[-1]}.",
            "",
            "| method | mean | rate | max | rate | without |",
            "| --- | ---: | ---: | ---: | ---: | ---: |",
        ]
        names = dict.fromkeys(r["method"] for r in mine)
        for name in sorted(names, key=lambda m: _last(mine, m)["one"]):
            last, cells = _last(mine, name), []
            for norm in NORMS:
                series = [r[norm] for r in mine if r["method"] == name]
                cells += [f"{last[norm]:.1e}", f"{fitted_rate(sizes, series):.1f}"]
            lines.append(f"| {name} | {' | '.join(cells)} | {last['missing'] or ''} |")
        lines.append("")
    lines += [
        "## Time and memory",
        "",
        f"One call on a cubed ellipsoid of {vertices} vertices, after one on a small mesh; each in",
        "a process of its own. Memory is what the peak grew by.",
        "",
        "| method | microseconds a vertex | bytes a vertex | quads | result |",
        "| --- | ---: | ---: | --- | --- |",
    ]
    by_name = {m.name: m for m in methods}
    for name, (micro, memory) in sorted(cost.items(), key=lambda item: item[1][0]):
        method = by_name[name]
        lines.append(f"| {name} | {micro:.2f} | {memory:.0f} | {method.quads} | {method.note} |")
    lines += ["", "## Not usable", "", "| what | why |", "| --- | --- |"]
    lines += [f"| {name} | {why} |" for name, why in quirks().items()]
    lines += [f"| {m.name} | not installed |" for m in PEERS if not m.installed]
    lines += [
        "",
        "## Errors estimated without the exact answer",
        "",
        "By the difference to a jet: Spearman's rank correlation with the true error, and the mean estimate",
        "over the mean error.",
        "",
        "| mesh | scheme | rank correlation | estimated / true |",
        "| --- | --- | ---: | ---: |",
    ]
    lines += [f"| {m} | {s} | {r:.3f} | {q:.2f} |" for m, s, r, q in ranking(sizes[-1])]
    return "\n".join(lines) + "\n"


def _last(records: Sequence[dict[str, Any]], method: str) -> dict[str, Any]:
    return max((r for r in records if r["method"] == method), key=lambda r: r["n"])


SHOWN = (
    "finite_volume",
    "cotan-6-voronoi",
    "jet",
    "jet-auto",
    "libigl Bunge",
    "libigl principal, radius 2",
    "libigl principal, radius 5",
    "VTK",
    "MeshLab quadric",
    "MeshLab APSS",
    "robust_laplacian",
)


@paper_style
def draw(records: Sequence[dict[str, Any]], output: Path) -> None:
    """Mean error against seconds of one call, ours filled and others open, over the sizes."""
    fig, axes = figure(2, 2, size=(7.2, 6.6), sharey=True, sharex=True)
    shown = [name for name in SHOWN if any(r["method"] == name for r in records)]
    for ax, mesh in zip(axes.flat, ("smooth", "jittered", "corners", "noisy"), strict=True):
        for i, name in enumerate(shown):
            mine = sorted(
                (r for r in records if r["mesh"] == mesh and r["method"] == name), key=lambda r: r["n"]
            )
            own = name in SCHEMES
            ax.plot(
                [r["seconds"] for r in mine],
                [r["one"] for r in mine],
                color=COLOURS[i % len(COLOURS)],
                marker=MARKERS[(i + i // len(COLOURS)) % len(MARKERS)],
                fillstyle="full" if own else "none",
                linestyle="-" if own else "--",
                label=name,
            )
        ax.set_title(f"{mesh}: {TITLES[mesh].split(',')[0].split(':')[0]}")
        ax.set_xscale("log")
        ax.set_yscale("log")
    for ax in axes[1]:
        ax.set_xlabel("time of one call (s)")
    for ax in axes[:, 0]:
        ax.set_ylabel("mean error of $H$ (1/length)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=3)
    save_figure(fig, output, "peers")
    write_csv(output / "peers.csv", by_column(records))


def main() -> None:
    """Measure, and write PEERS.md, the figure and the numbers behind them."""
    options = arguments(__doc__)
    console = Console()
    methods = [m for m in PEERS if m.installed] + list(ours())
    sizes, cost_size = ((12, 24), 16) if options.quick else ((24, 48, 96), 64)
    start = time.perf_counter()
    records = list(errors(methods, sizes))
    draw(records, options.output)
    cost = costs(methods, cost_size)
    write_csv(
        options.output / "peers_cost.csv",
        {
            "method": list(cost),
            "microseconds": [c[0] for c in cost.values()],
            "bytes": [c[1] for c in cost.values()],
        },
    )
    text = markdown(records, cost, cost_size, methods)
    target = options.output / "PEERS.md" if options.quick else Path(__file__).with_name("PEERS.md")
    target.write_text(text)
    console.print(f"{target} in {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
