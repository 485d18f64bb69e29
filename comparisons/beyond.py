"""Beyond the thesis: boundaries, extraordinary vertices, grids that are not smooth, areas of valence 8."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from comparisons.common import (
    COLOURS,
    MARKERS,
    arguments,
    below,
    convergence_plot,
    figure,
    paper_style,
    save_figure,
    save_maps,
)
from quadcurv import QuadGrid, QuadMesh, mean_curvature
from quadcurv.boundary import ghost_layer
from quadcurv.refinement import convergence, fitted_rate
from quadcurv.schemes import cotan
from quadcurv.schemes.finite_volume import FINITE_VOLUME
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.surfaces import (
    Surface,
    catenoid,
    cubed_ellipsoid,
    cubed_sphere,
    cylinder,
    elliptic_paraboloid,
    sphere,
    tanh_sheet,
    torus,
)

Array = NDArray[Any]
Results = dict[str, float]

SIZES = np.array([16, 32, 64, 128, 256])
CELLS = "cells $n$ in each direction"
NAMES = {
    "finite_volume": "finite volume",
    "liu": "Liu",
    "cotan-4": "cotan 4",
    "cotan-6": "cotan 6",
    "cotan-8": "cotan 8",
    "cotan-4-voronoi": "cotan 4, Voronoi",
    "cotan-6-voronoi": "cotan 6, Voronoi",
    "cotan-8-voronoi": "cotan 8, Voronoi",
}


# Boundaries

TREATMENTS = {"none": None, "quadratic ghosts": 2, "cubic ghosts": 3, "quartic ghosts": 4}


def bordered(grid: QuadGrid, degree: int | None) -> Stencils:
    """Stencils of a grid with ghosts of that degree; without any, open rings are taken as they are."""
    if degree is None:
        return grid.stencils()
    index, ghosts = ghost_layer(grid.points, grid.wrap, degree)
    index = np.pad(index, [(0, int(w)) for w in grid.wrap], mode="wrap")
    points = np.concatenate((grid.points.reshape(-1, 3), ghosts))
    closed = np.ones(grid.shape[0] * grid.shape[1], bool)
    return Stencils(points, grid_faces(index), grid.shape, closed)


def border_errors(surface: Surface, n: int, degree: int | None) -> tuple[float, float]:
    """Largest error of H by the finite-volume scheme on the border and inside."""
    grid, xi, eta = surface.sample((n, n))
    assert isinstance(grid, QuadGrid)
    stencils = bordered(grid, degree)
    flux, area = FINITE_VOLUME.flux(stencils)
    normal = stencils.ring_areas / np.linalg.norm(stencils.ring_areas, axis=1, keepdims=True)
    H = -np.einsum("ix,ix->i", flux, normal) / (2 * area)
    e = np.abs(H - surface.mean_curvature(xi, eta).ravel())
    border = ~grid.stencils().closed
    return float(e[border].max()), float(e[~border].max())


def boundaries(output: Path) -> Results:
    """Error on the border by treatment, on the hyperbolic-tangent sheet and the catenoid."""
    fig, panels = figure(1, 2, size=(7.2, 3.7))
    table: dict[str, Any] = {"n": SIZES}
    results: Results = {}
    for axes, surface, title in (
        (panels[0], tanh_sheet(), "Hyperbolic-tangent sheet"),
        (panels[1], catenoid(), "Catenoid"),
    ):
        series: dict[str, list[float]] = {}
        for name, degree in TREATMENTS.items():
            found = [border_errors(surface, n, degree) for n in SIZES]
            series[name] = [border for border, _ in found]
            series["inside"] = [inside for _, inside in found]
        series["inside"] = series.pop("inside")  # drawn last
        convergence_plot(axes, SIZES, series, dict.fromkeys(series, (64, 256)))
        axes.set(xlabel=CELLS, ylabel="largest error of $H$ on the border (1/length)", title=title)
        axes.set_ylim(bottom=8e-7)
        axes.legend(loc="lower left")
        for name, e in series.items():
            table[f"{surface.name}: {name}"] = e
            results[f"border, {surface.name}: {name}, at 256"] = e[-1]
            results[f"border, {surface.name}: {name}, rate"] = fitted_rate(SIZES[2:], e[2:])
    save_figure(fig, output, "beyond_boundaries", table)
    return results


# Extraordinary vertices

GROUPS = ("valence 3, largest", "valence 4, largest", "valence 5, largest", "all, mean")


def icosahedral_sphere(n: int) -> QuadMesh:
    """Each triangle of an icosahedron cut into three quads of n x n, projected to the unit sphere."""
    import trimesh

    solid = trimesh.creation.icosahedron()
    corners = np.array(solid.vertices)[np.array(solid.faces)]  # (20, 3, 3)
    a = np.concatenate([np.roll(corners, -k, axis=1) for k in range(3)])
    first, middle, last = (a[:, 0] + a[:, 1]) / 2, a.mean(axis=1), (a[:, 0] + a[:, 2]) / 2
    s, t = np.meshgrid(*(np.linspace(0, 1, n + 1),) * 2, indexing="ij")
    weights = np.stack(((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)).reshape(4, -1)
    points = np.einsum("cp,qcx->qpx", weights, np.stack((a[:, 0], first, middle, last), axis=1))
    points = points.reshape(-1, 3) / np.linalg.norm(points.reshape(-1, 3), axis=1, keepdims=True)
    one = grid_faces(np.arange((n + 1) ** 2, dtype=np.int32).reshape(n + 1, n + 1))
    faces = np.concatenate([one + k * (n + 1) ** 2 for k in range(len(a))])
    _, kept, label = np.unique(np.round(points, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
    return QuadMesh(points[kept], label.ravel()[faces])


def cubed(surface: Surface, n: int) -> tuple[QuadMesh, Array]:
    """Welded mesh of a cubed surface and its exact H."""
    mesh, xi, eta = surface.sample((n, n), "faces")
    assert isinstance(mesh, QuadMesh)
    return mesh, surface.mean_curvature(xi, eta)


def extraordinary_map(output: Path) -> str | None:
    """Map of the finite-volume error; returns why there are pages in place of the picture, if so."""
    cube, exact = cubed(cubed_ellipsoid(), 24)
    ball = icosahedral_sphere(12)
    panels = {
        "cubed ellipsoid": (cube, np.abs(mean_curvature(cube, "finite_volume") - exact)),
        "icosahedral sphere": (ball, np.abs(mean_curvature(ball, "finite_volume") - 1)),
    }
    label = "error of $H$ (1/length)"
    return save_maps(output, "beyond_extraordinary_map", panels, label, (-5, -1), (1.0, 0.8, 0.9))


def extraordinary(output: Path) -> Results:
    """Errors by valence where 3 or 5 quads meet."""
    schemes = ("finite_volume", "liu", "cotan-6")
    sizes = SIZES[:-1] // 4
    solids = {
        "cubed sphere": lambda n: cubed(cubed_sphere(), n),
        "cubed ellipsoid": lambda n: cubed(cubed_ellipsoid(), n),
        "icosahedral sphere": lambda n: (icosahedral_sphere(n), np.ones(1)),
    }
    shown = ("cubed ellipsoid", "icosahedral sphere")
    fig, panels = figure(2, 3, size=(7.2, 5.6), sharex=True, sharey=True)
    rows = dict(zip(shown, panels, strict=True))
    table: dict[str, Any] = {"n": sizes}
    results: Results = {}
    for solid, build in solids.items():
        found: dict[str, dict[str, list[float]]] = {s: {} for s in schemes}
        for n in sizes:
            mesh, exact = build(n)
            valence = mesh.stencils().valence
            for scheme in schemes:
                e = np.abs(mean_curvature(mesh, scheme) - exact)
                into = found[scheme]
                for v in np.unique(valence):
                    into.setdefault(f"valence {v}, largest", []).append(float(e[valence == v].max()))
                into.setdefault("all, mean", []).append(float(e.mean()))
        for k, scheme in enumerate(schemes):
            for group, e in found[scheme].items():
                key = f"{solid}, {scheme}: {group}"
                table[key] = e
                results[f"{key}, at 32"] = e[-1]
                results[f"{key}, rate"] = fitted_rate(sizes[1:], e[1:]) if min(e) > 0 else np.nan
            if solid in shown:
                axes = rows[solid][k]
                seen = {g: e for g, e in found[scheme].items() if e[-1] > 1e-9}
                exact_at = [g.split(",")[0] for g in found[scheme] if g not in seen]
                for group, e in seen.items():
                    c = GROUPS.index(group)
                    rate = round(results[f"{solid}, {scheme}: {group}, rate"], 2) + 0.0  # not -0.00
                    axes.loglog(sizes, e, color=COLOURS[c], marker=MARKERS[c], label=f"{group}: {rate:.2f}")
                if exact_at:
                    axes.plot([], [], " ", label=" and ".join(exact_at) + ": exact")
                axes.set_xscale("log", base=2)
                axes.minorticks_off()
                axes.set_title(f"{solid}, {NAMES[scheme]}", fontsize=9)
                axes.legend(fontsize=7, loc="lower left")
    panels[0, 0].set_ylim(bottom=2e-6)
    for axes in panels[-1]:
        axes.set_xlabel("cells $n$ along a panel")
    for axes in panels[:, 0]:
        axes.set_ylabel("error of $H$ (1/length)")
    save_figure(fig, output, "beyond_extraordinary", table)
    return results


# Grids that are not smooth


def jittered_torus(n: int, jitter: float) -> tuple[QuadGrid, Array]:
    """Torus whose points are moved within it by up to jitter times the spacing, and its exact H."""
    t = -np.pi + 2 * np.pi / n * np.arange(n)
    move = jitter * 2 * np.pi / n * np.random.default_rng(n).uniform(-1, 1, (2, n, n))
    xi, eta = np.meshgrid(t, t, indexing="ij") + move
    return QuadGrid(torus().mapping(xi, eta), (True, True)), torus().mean_curvature(xi, eta)


def not_smooth(output: Path) -> Results:
    """Every scheme on a torus with 0, 5, 10 and 20 % of jitter."""
    levels, sizes = (0.0, 0.05, 0.1, 0.2), SIZES[:-1]
    names = NAMES | {"jet-2": "jet of degree 2", "jet": "jet of degree 4"}
    fig, panels = figure(1, 4, size=(7.4, 3.6), sharex=True, sharey=True)
    table: dict[str, Any] = {"n": sizes}
    results: Results = {}
    for axes, jitter in zip(panels, levels, strict=True):
        errors: dict[str, list[Array]] = {s: [] for s in names}
        for n in sizes:
            grid, exact = jittered_torus(n, jitter)
            for scheme in names:
                errors[scheme].append(np.abs(mean_curvature(grid, scheme) - exact))
        for k, (scheme, found) in enumerate(errors.items()):
            colour = (*COLOURS[:5], *COLOURS[2:5], *COLOURS[5:])[k]
            dash = (*["-"] * 5, *["--"] * 3, *["-"] * 2)[k]
            one, largest = [float(e.mean()) for e in found], [float(e.max()) for e in found]
            axes.loglog(
                sizes, one, dash, color=colour, marker=MARKERS[k % 7], markersize=3.5, label=names[scheme]
            )
            for norm, e in (("one-norm", one), ("inf-norm", largest)):
                key = f"jitter {100 * jitter:.0f} %, {scheme}: {norm}"
                table[key] = e
                results[f"{key}, at 128"] = e[-1]
                results[f"{key}, rate"] = fitted_rate(sizes[-3:], e[-3:])
        axes.set_xscale("log", base=2)
        axes.minorticks_off()
        axes.set(title=f"jitter {100 * jitter:.0f} %", xlabel="cells $n$")
    panels[0].set_ylabel("one-norm of the error of $H$ (1/length)")
    handles, labels = panels[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=5)
    save_figure(fig, output, "beyond_jitter", table)
    return results


# Valence 8 and 4


def valence_areas(output: Path) -> Results:
    """Cotan with barycentric and with Voronoi areas, on orthogonal grids and on another."""
    schemes = [s for s in NAMES if s[:7] in ("cotan-4", "cotan-8")]
    sizes = SIZES // 2
    fig, panels = figure(2, 4, size=(7.4, 4.8), sharex=True, sharey=True)
    table: dict[str, Any] = {"n": sizes}
    results: Results = {}
    for column, (surface, title) in enumerate(
        (
            (cylinder(), "cylinder"),
            (torus(), "torus"),
            (sphere(), "lon-lat sphere"),
            (elliptic_paraboloid(), "paraboloid"),
        )
    ):
        for row, layout in enumerate(("grid", "staggered")):
            run = convergence(surface, schemes, sizes.tolist(), layout)
            axes = panels[row, column]
            for k, scheme in enumerate(schemes):
                e = run.errors[scheme]["one"]
                key = f"areas, {surface.name}, {layout}, {scheme}"
                table[key] = e
                results[f"{key}: at 128"] = float(e[-1])
                results[f"{key}: rate"] = run.fitted_rate(scheme, "one", 3)
                axes.loglog(
                    sizes,
                    np.where(e < 1e-9, np.nan, e),
                    color=COLOURS[(0, 1, 0, 1)[k]],
                    linestyle=("-", "-", "--", "--")[k],
                    marker=MARKERS[k],
                    label=NAMES[scheme],
                )
                if e.max() < 1e-9 and scheme == "cotan-8-voronoi":
                    axes.text(
                        0.5, 0.08, "Voronoi: exact", transform=axes.transAxes, ha="center", fontsize=8.5
                    )
            axes.set_xscale("log", base=2)
            axes.minorticks_off()
            axes.set_title(f"{title}, {'vertices' if layout == 'grid' else 'primal/dual'}", fontsize=8.5)
    for axes in panels[-1]:
        axes.set_xlabel("cells $n$")
    for axes in panels[:, 0]:
        axes.set_ylabel("one-norm, error of $H$")
    handles, labels = panels[1, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=4)
    save_figure(fig, output, "beyond_valence_8", table)
    for valence in (4, 8):
        stencils = cylinder().sample((64, 64))[0].stencils()
        third, dual = (cotan(valence, area).flux(stencils)[1] for area in ("barycentric", "voronoi"))
        results[f"areas: barycentric over Voronoi, valence {valence}"] = float(
            (third / dual)[stencils.closed].mean()
        )
    return results


@paper_style
def main(output: Path, quick: bool = False) -> Results:
    """Write all figures to a folder.

    Parameters
    ----------
    output : Path
        Folder, made where there is none.
    quick : bool
        No map; all numbers are the same.

    Returns
    -------
    dict
        Measured errors and rates by name.
    """
    if not quick:
        problem = extraordinary_map(output)
        if problem:
            Console(stderr=True).print(f"Pages .html in place of a picture of the map: {problem}")
    return {**boundaries(output), **extraordinary(output), **not_smooth(output), **valence_areas(output)}


def findings(results: Results) -> list[tuple[str, str, str]]:
    """Question, measured answer and stem of the figure, from the results of `main`."""
    r = results

    def border(surface: str, treatment: str) -> str:
        e, rate = (r[f"border, {surface}: {treatment}, {k}"] for k in ("at 256", "rate"))
        return f"{e:.1e} (rate {round(rate, 1) + 0.0:.1f})"

    def rate(mesh: str, scheme: str, group: str) -> str:
        return f"{round(r[f'{mesh}, {scheme}: {group}, rate'], 1) + 0.0:.1f}"

    def jittered(scheme: str) -> str:
        return " / ".join(f"{r[f'jitter {j} %, {scheme}: one-norm, at 128']:.1e}" for j in (0, 5, 10, 20))

    def area(surface: str, layout: str, scheme: str) -> str:
        key = f"areas, {surface}, {layout}, {scheme}"
        e, rate = r[f"{key}: at 128"], r[f"{key}: rate"]
        return f"rate {rate:.1f}" if rate > 0.5 else below(e, 10) if e < 1e-9 else f"stays at {e:.2f}"

    cube, ball = "cubed ellipsoid", "icosahedral sphere"
    fv, three, five = "finite_volume", "valence 3, largest", "valence 5, largest"
    eight, voronoi = "cotan-8", "cotan-8-voronoi"
    return [
        (
            "What does an open boundary need?",
            "Quartic ghosts. Largest error of H on the border of the hyperbolic-tangent sheet at 256 cells: "
            + "; ".join(
                f"{name} {border('tanh_sheet', name)}"
                for name in ("none", "quadratic ghosts", "cubic ghosts", "quartic ghosts")
            )
            + f"; inside {border('tanh_sheet', 'inside')}. On the catenoid: "
            + "; ".join(
                f"{name} {border('catenoid', name)}"
                for name in ("none", "quadratic ghosts", "cubic ghosts", "quartic ghosts", "inside")
            )
            + ". Where the surface is a polynomial of degree 2 (paraboloids) all ghosts are the same.",
            "beyond_boundaries",
        ),
        (
            "What happens at extraordinary vertices?",
            "The finite-volume scheme is first order there: rates "
            f"{rate(cube, fv, three)} at valence 3 ({cube}), {rate(ball, fv, three)} at valence 3 and "
            f"{rate(ball, fv, five)} at valence 5 ({ball}), as along the seams between panels "
            f"({rate(ball, fv, 'valence 4, largest')}); the mean error is second order "
            f"({rate(ball, fv, 'all, mean')}). Liu's formula: {rate(cube, 'liu', three)} at valence 3 of the "
            f"{cube}, exact at the symmetric vertices of the spheres. Cotan with valence 6 does not converge "
            f"at valence 3 of the {cube} (error {r[f'{cube}, cotan-6: {three}, at 32']:.2f}) nor at valence "
            f"5 ({r[f'{ball}, cotan-6: {five}, at 32']:.2f}).",
            "beyond_extraordinary",
        ),
        (
            "What does a grid that is not smooth do?",
            "Finite volume, Liu and cotan stop converging; fitted jets do not. One-norm of the error of H "
            "on a torus of 128 x 128 points "
            "moved within the surface by up to 0 / 5 / 10 / 20 % of the spacing: "
            + "; ".join(f"{NAMES[s]} {jittered(s)}" for s in ("finite_volume", "liu", "cotan-6"))
            + f"; jet of degree 2 {jittered('jet-2')}, of degree 4 {jittered('jet')} (rates at "
            f"20 %: {r['jitter 20 %, jet-2: one-norm, rate']:.1f} and "
            f"{r['jitter 20 %, jet: one-norm, rate']:.1f}).",
            "beyond_jitter",
        ),
        (
            "Why does valence 8 fail?",
            "On the vertices of an orthogonal grid because of its area: its fluxes are those of the "
            "five-point Laplacian, but a third of the ring is "
            f"{r['areas: barycentric over Voronoi, valence 8']:.2f} times the Voronoi area (valence 4: "
            f"{r['areas: barycentric over Voronoi, valence 4']:.2f} times). Cylinder, torus and "
            f"longitude-latitude sphere, barycentric: {area('cylinder', 'grid', eight)}, "
            f"{area('torus', 'grid', eight)}, {area('sphere', 'grid', eight)}; Voronoi: "
            f"{area('cylinder', 'grid', voronoi)}, {area('torus', 'grid', voronoi)}, "
            f"{area('sphere', 'grid', voronoi)}. On the non-orthogonal grid of the paraboloid it fails with "
            f"either ({area('elliptic_paraboloid', 'grid', eight)}; "
            f"{area('elliptic_paraboloid', 'grid', voronoi)}), and so it does on primal/dual points of the "
            "torus and the sphere, where the sides of the stencil's quads are not orthogonal "
            f"({area('torus', 'staggered', voronoi)}; {area('sphere', 'staggered', voronoi)}).",
            "beyond_valence_8",
        ),
    ]


def print_findings(results: Results) -> None:
    """Print the findings as a table."""
    table = Table("question", "measured", "figure", title="Beyond the thesis", show_lines=True)
    for row in findings(results):
        table.add_row(*row)
    Console().print(table)


if __name__ == "__main__":
    options = arguments(__doc__)
    print_findings(main(options.output, options.quick))
