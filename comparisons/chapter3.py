"""Surfaces: Figures 3.1 to 3.12 of the thesis and the claims of its chapter 3."""

from __future__ import annotations

import operator
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console

from comparisons.common import (
    COLOURS,
    MARKERS,
    Claim,
    arguments,
    below,
    convergence_plot,
    figure,
    paper_style,
    print_claims,
    save_figure,
    save_maps,
)
from quadcurv import StaggeredGrid, mean_curvature, mean_curvature_normal
from quadcurv.refinement import fitted_rate
from quadcurv.surfaces import (
    Surface,
    catenoid,
    cylinder,
    elliptic_paraboloid,
    enneper,
    helicoid,
    henneberg,
    hyperbolic_paraboloid,
    hyperboloid,
    pillow_sphere,
    plane,
    sphere,
    tanh_sheet,
    torus,
)

Array = NDArray[Any]
Results = dict[str, float]

SIZES = np.array([16, 32, 64, 128, 256])
WINDOW = (64, 256)
CELLS = "cells $n$ in each direction"
HEMISPHERE = "cells $n$; the sphere has $2n \\times n$"
ERROR = r"error of $\kappa = \|\mathbf{H}\|$ (1/length)"
MINIMAL, SPHERES = (-6, -3), (-6, -1)  # decades of the two colour scales


def wave(theta: Array) -> Array:
    """The f of the sheared cylinder."""
    return np.asarray(np.sin(2 * theta))


def shape(surface: Surface, n: int) -> tuple[int, int]:
    """Cells: n in each direction, on spheres 2n around."""
    return (2 * n, n) if "sphere" in surface.name else (n, n)


def norm_errors(surface: Surface, cells: tuple[int, int]) -> tuple[StaggeredGrid, Array, Array, Array]:
    """Primal/dual grid, absolute errors of kappa = |H n| (3.23), and parameters of its cells."""
    mesh, xi, eta = surface.sample(cells, "staggered")
    kappa = np.linalg.norm(mean_curvature_normal(mesh, "finite_volume"), axis=-1)
    assert isinstance(mesh, StaggeredGrid)
    return mesh, np.abs(kappa - np.abs(surface.mean_curvature(xi, eta))), xi, eta


def signed_errors(surface: Surface, cells: tuple[int, int]) -> Array:
    """Absolute errors of H = -(H n) . n on the same grid."""
    mesh, xi, eta = surface.sample(cells, "staggered")
    return np.abs(mean_curvature(mesh, "finite_volume") - surface.mean_curvature(xi, eta))


def one_and_inf(found: list[Array]) -> dict[str, list[float]]:
    """One- and inf-norm of errors on each grid."""
    return {"one-norm": [float(e.mean()) for e in found], "inf-norm": [float(e.max()) for e in found]}


def schematic(output: Path) -> None:
    """Figure 3.1: dual points are the nodes of the cells, primal points their centres."""
    fig, axes = figure(size=(4.4, 3.6))

    def bent(x: Any, y: Any) -> tuple[Array, Array]:
        return np.asarray(x + 0.12 * np.sin(y)), np.asarray(y + 0.18 * np.cos(1.1 * x))

    line = np.linspace(-0.5, 2.5, 60)
    for c in range(-1, 4):
        for along in (bent(line, c - 0.5), bent(c - 0.5, line)):
            axes.plot(*along, color="0.75", linewidth=0.9, zorder=0)
    axes.set(aspect="equal", xlim=(-0.72, 2.75), ylim=(-0.78, 2.75))
    x, y = np.meshgrid(np.arange(4) - 0.5, np.arange(4) - 0.5)
    axes.plot(*(c.ravel() for c in bent(x, y)), "s", color=COLOURS[1], label="dual points (nodes)")
    x, y = np.meshgrid(np.arange(3), np.arange(3))
    axes.plot(*(c.ravel() for c in bent(x, y)), "o", color=COLOURS[0], label="primal points (centres)")
    arrow = {"arrowstyle": "-|>", "shrinkA": 4, "shrinkB": 4, "linewidth": 1.5}
    for start, end, colour, name, shift in (
        ((0, 1), (1, 1), COLOURS[0], r"$\mathbf{t}_{(1)}$", (-16, 7)),
        ((0.5, 0.5), (0.5, 1.5), COLOURS[1], r"$\mathbf{t}_{(2)}$", (12, 14)),
    ):
        a, b = np.array(bent(*start)), np.array(bent(*end))
        axes.annotate("", b, a, arrowprops=arrow | {"color": colour})
        axes.annotate(name, (a + b) / 2, shift, textcoords="offset points", ha="center", color=colour)
    for at, name, shift in (
        ((1, 1), r"$T_{p,i,j}$", (16, 8)),
        ((0, 1), r"$T_{p,i,j-1}$", (-12, -15)),
        ((0.5, 0.5), r"$T_{d,i,j}$", (-17, -13)),
        ((0.5, 1.5), r"$T_{d,i+1,j}$", (-20, 8)),
    ):
        axes.annotate(name, bent(*at), shift, textcoords="offset points", ha="center")
    axes.axis("off")
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, -0.1), ncols=2, frameon=False)
    save_figure(fig, output, "figure_3_1")


def maps(output: Path) -> str | None:
    """Figure 3.2; 3.3 and 3.6 on one colour scale, 3.8 and 3.11 on another; Henneberg's surface.

    Returns why there are pages in place of pictures, if so.
    """
    bar = r"error of $\kappa$ (1/length)"

    def panel(surface: Surface, cells: tuple[int, int]) -> tuple[StaggeredGrid, Array]:
        return norm_errors(surface, cells)[:2]

    cylinders = {}
    for title, f in ((r"$f(\theta) = \sin 2\theta$", wave), (r"$f(\theta) = 0$", None)):
        mesh, *_ = replace(cylinder(f=f), domain=((0, 2 * np.pi), (0, 3))).sample((60, 20))
        cylinders[title] = mesh, mesh.stencils().points[:, 2]
    save_maps(output, "figure_3_2", cylinders, camera=(1.0, 0.5, 0.5))
    minimal = {
        "helicoid": panel(replace(helicoid(), domain=((-1.5, 1.5), (-np.pi, np.pi))), (48, 48)),
        "catenoid": panel(catenoid(), (48, 48)),
    }
    save_maps(output, "figure_3_3", minimal, bar, MINIMAL, (1.0, -0.7, 0.7))
    portion = {"Enneper": panel(replace(enneper(), domain=((-1.2, 1.2), (-1.2, 1.2))), (48, 48))}
    save_maps(output, "figure_3_6", portion, bar, MINIMAL, (0.3, -1.0, 1.4))
    pillow = {"pillow": panel(pillow_sphere(), (80, 40))}
    save_maps(output, "figure_3_8", pillow, bar, SPHERES)
    globe = {"longitude-latitude": panel(sphere(latitude=np.radians(80)), (80, 40))}
    save_maps(output, "figure_3_11", globe, bar, SPHERES)
    sheet = replace(henneberg(), domain=((0.0, 0.5), henneberg().domain[1]))  # the whole covers it twice
    branches = {"Henneberg": panel(sheet, (24, 48))}
    return save_maps(output, "figure_3_henneberg_map", branches, bar, (-4, -1), (1.0, 0.6, 0.8))


def exactness() -> Results:
    """Surfaces on which only rounding is left."""
    cases = {"cylinder": cylinder(), "wavy cylinder": cylinder(f=wave), "plane": plane()}
    return {
        f"{name}: largest error": float(max(norm_errors(surface, (n, n))[1].max() for n in SIZES))
        for name, surface in cases.items()
    }


def rates(output: Path) -> Results:
    """Figures 3.4, 3.5, 3.7, 3.9 and 3.10."""
    results: Results = {}
    for stem, surface, title in (
        ("figure_3_4", catenoid(), "Catenoid"),
        ("figure_3_5", helicoid(), "Helicoid"),
        ("figure_3_7", enneper(), "Enneper's surface"),
        ("figure_3_9", pillow_sphere(), "Pillow sphere"),
        ("figure_3_10", sphere(), r"Longitude-latitude sphere to $\pm 60^\circ$"),
    ):
        found = [norm_errors(surface, shape(surface, n))[1] for n in SIZES]
        series = one_and_inf(found)
        fit = dict.fromkeys(series, WINDOW)
        signed = [float(signed_errors(surface, shape(surface, n)).max()) for n in SIZES]
        rounding = None
        table: dict[str, Any] = {"n": SIZES, **series, "signed, inf-norm": signed}
        if surface.name == "helicoid":
            series["signed $H$, inf-norm"] = signed
            level = np.finfo(float).eps * SIZES**2 / 8
            rounding = level, r"$\epsilon n^2/8$"
        fig, axes = figure()
        fitted = convergence_plot(axes, SIZES, series, fit, rounding=rounding)
        axes.set(xlabel=HEMISPHERE if "sphere" in surface.name else CELLS, ylabel=ERROR, title=title)
        save_figure(fig, output, stem, table)
        for norm in fit:
            results[f"{surface.name}: {norm} rate"] = fitted[norm]
            results[f"{surface.name}: {norm} at 256"] = series[norm][-1]
        results[f"{surface.name}: signed, inf-norm at 256"] = signed[-1]
        results[f"{surface.name}: signed, inf-norm rate"] = fitted_rate(SIZES[1:], signed[1:])
    return results


def other_surfaces(output: Path) -> Results:
    """Surfaces that the thesis names and does not show."""
    series, results = {}, {}
    for surface in (
        hyperboloid(),
        elliptic_paraboloid(),
        hyperbolic_paraboloid(),
        tanh_sheet(),
        torus(),
    ):
        found = one_and_inf([signed_errors(surface, (n, n)) for n in SIZES])
        series[surface.name.replace("_", " ")] = found["inf-norm"]
        for norm, e in found.items():
            results[f"{surface.name}: {norm} rate"] = fitted_rate(SIZES[1:], e[1:])
            results[f"{surface.name}: {norm} at 256"] = e[-1]
    fig, axes = figure()
    convergence_plot(axes, SIZES, series, dict.fromkeys(series, WINDOW))
    axes.set(xlabel=CELLS, ylabel="error of $H$, inf-norm (1/length)", title="Further surfaces")
    axes.set_ylim(bottom=2e-7)
    axes.legend(loc="lower left")
    save_figure(fig, output, "figure_3_others", {"n": SIZES, **series})
    return results


def singular_distance(surface: Surface, xi: Array, eta: Array) -> Array:
    """Distance in the parameters to the nearest singular point; eta has the period 2 pi."""
    return np.min(
        [np.hypot(xi - a, (eta - b + np.pi) % (2 * np.pi) - np.pi) for a, b in surface.singular_points],
        axis=0,
    )


def henneberg_surface(output: Path) -> Results:
    """Error of Henneberg's surface against the distance to its singular points."""
    surface = henneberg()
    fig, axes = figure()
    columns: dict[str, Any] = {}
    edges = np.geomspace(0.004, 0.8, 24)
    far, near, signed = [], [], []
    for n in SIZES:
        _, e, xi, eta = norm_errors(surface, (n, n))
        r = singular_distance(surface, xi, eta)
        far.append(float(e[r > 0.25].max()))
        near.append(float(e[r <= 0.25].max()))
        signed.append(float(signed_errors(surface, (n, n)).max()))
        bins = np.digitize(r, edges)
        largest = np.array(
            [e[bins == b].max() if (bins == b).any() else np.nan for b in range(edges.size + 1)]
        )
        columns[f"n = {n}"] = largest[1:-1]
        if n >= 64:
            k = list(SIZES).index(n) - 2
            axes.plot(
                np.sqrt(edges[1:] * edges[:-1]),
                largest[1:-1],
                label=f"$n = {n}$",
                marker=MARKERS[k],
                markersize=4,
            )
    axes.axvline(0.25, color="0.4", linestyle="--", linewidth=0.9)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=r"distance to the nearest singular point, in $(\xi, \eta)$",
        ylabel="largest " + ERROR,
        title="Henneberg's surface",
    )
    axes.legend()
    save_figure(fig, output, "figure_3_henneberg", {"distance": np.sqrt(edges[1:] * edges[:-1]), **columns})
    return {
        "henneberg: near, at 256": near[-1],
        "henneberg: near, rate": fitted_rate(SIZES[2:], near[2:]),
        "henneberg: far, at 256": far[-1],
        "henneberg: far, rate": fitted_rate(SIZES[2:], far[2:]),
        "henneberg: signed, rate": fitted_rate(SIZES[2:], signed[2:]),
        "henneberg: turn of the normal around a singular point": normal_turn(surface),
    }


def normal_turn(surface: Surface, radius: float = 1e-3) -> float:
    """Largest sine of the angle between unit normals on a circle around a singular point (xi, eta)."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    a, b = surface.singular_points[0]
    xi, eta, d = a + radius * np.cos(angle), b + radius * np.sin(angle), radius * 1e-3
    n = cross(
        surface.mapping(xi + d, eta) - surface.mapping(xi - d, eta),
        surface.mapping(xi, eta + d) - surface.mapping(xi, eta - d),
    )
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return float(np.linalg.norm(n - n[0], axis=1).max())


def places() -> Results:
    """Where the errors of the pillow sphere and of Enneper's surface sit, and the two grids of the sphere."""
    pillow, xi, eta = norm_errors(pillow_sphere(), (256, 128))[1:]
    x = np.abs(np.where(xi < -1, -2 - xi, xi))
    from_seams = np.minimum.reduce([np.abs(x - np.abs(eta)), 1 - x, 1 - np.abs(eta)])
    globe = {d: norm_errors(sphere(latitude=np.radians(d)), (256, 128))[1] for d in (60, 80)}
    whole = replace(sphere(), domain=((-np.pi, np.pi), (-np.pi / 2, np.pi / 2)))
    _, far, *parameters = norm_errors(replace(enneper(), domain=((-3, 3), (-3, 3))), (128, 128))
    from_origin = np.hypot(*parameters)
    return {
        "pillow: largest error off the seams over on them": float(
            pillow[from_seams > 2 / 128].max() / pillow[from_seams <= 2 / 128].max()
        ),
        "pillow: largest over smallest cell, 32": cell_ratio(pillow_sphere(), 32),
        "pillow: largest over smallest cell, 128": cell_ratio(pillow_sphere(), 128),
        "sphere with poles: largest over smallest cell, 32": cell_ratio(whole, 32),
        "sphere with poles: largest over smallest cell, 128": cell_ratio(whole, 128),
        "sphere to 80 over pillow, one-norm": float(globe[80].mean() / pillow.mean()),
        "sphere to 60 over pillow, one-norm": float(globe[60].mean() / pillow.mean()),
        "sphere to 80 over pillow, median": float(np.median(globe[80]) / np.median(pillow)),
        "sphere to 80 over pillow, inf-norm": float(globe[80].max() / pillow.max()),
        "enneper: where the largest error is": float(from_origin.flat[far.argmax()]),
        "enneper: largest error beyond 2.5 over all": float(far[from_origin > 2.5].max() / far.max()),
    }


def cell_ratio(surface: Surface, n: int) -> float:
    """Area of the largest over that of the smallest cell."""
    mesh, *_ = surface.sample(shape(surface, n), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    d = mesh.dual
    areas = np.linalg.norm(cross(d[1:, 1:] - d[:-1, :-1], d[:-1, 1:] - d[1:, :-1]), axis=-1)
    return float(areas.max() / areas.min())


# The formulas as they are printed and as this package evaluates them, on arrays of any kind of number.


def dot(a: Array, b: Array) -> Array:
    """Inner products of vectors (..., 3)."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: Array, b: Array) -> Array:
    """Cross products of vectors (..., 3)."""
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack((ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx), axis=-1)


def printed_edge(across: Array, along: Array, slip: str = "") -> Array:
    """Edge normal times length, n_k Delta s_k of (3.26) to (3.30): 48 operations with both differences.

    across, along are t_(1), t_(2) on edges of the first kind and t_(2), t_(1) on those of the second.
    """
    if slip == "3.34":  # t^(1) where t^(2) is meant
        return np.asarray(
            printed_edge(along, across) * np.sqrt(dot(along, along) / dot(across, across))[..., None]
        )
    a11, a12, a22 = dot(across, across), dot(across, along), dot(along, along)
    det = a11 * a22 - a12 * a12
    second = a11 / det if slip == "3.29" else -a12 / det
    t = (a22 / det)[..., None] * across + second[..., None] * along
    return np.asarray(t / np.sqrt(dot(t, t))[..., None] * np.sqrt(a22)[..., None])


def printed_curvature_normal(primal: Array, dual: Array, slip: str = "") -> Array:
    """H n of (3.34) on a grid that wraps both ways, each cell on its own.

    primal[i, j] lies between dual[i, j] and dual[i + 1, j + 1]; both are (r, c, 3).
    """
    corner = [dual, np.roll(dual, -1, 0), np.roll(dual, (-1, -1), (0, 1)), np.roll(dual, -1, 1)]
    flux = None
    for k, (step, axis) in enumerate(((1, 1), (-1, 0), (-1, 1), (1, 0))):
        across, along = np.roll(primal, step, axis) - primal, corner[(k + 1) % 4] - corner[k]
        wrong = "" if slip == "3.34" and axis == 0 else slip
        edge = printed_edge(across, along, wrong)
        flux = edge if flux is None else flux + edge
    c01, c10 = corner[1] - corner[0], corner[3] - corner[0]
    half = (corner[2] - corner[1] - corner[3] + corner[0]) / 2
    normal = cross(c01 + half, c10 + half)
    return np.asarray(flux / (2 * np.sqrt(dot(normal, normal)))[..., None])


def printed_liu(points: Array) -> Array:
    """H n of (4.4) to (4.7) on a vertex grid that wraps both ways, each corner on its own."""
    ring = [np.roll(points, (-i, -j), (0, 1)) for i, j in ((1, 0), (1, 1), (0, 1), (-1, 1))]
    ring += [np.roll(points, (-i, -j), (0, 1)) for i, j in ((-1, 0), (-1, -1), (0, -1), (1, -1))]
    total: Any = None
    area: Any = None
    for k in (0, 2, 4, 6):
        a, d, b = (ring[(k + m) % 8] for m in range(3))
        su = 0.5 * (b - points) + 0.5 * (d - a)
        sv = 0.5 * (a - points) + 0.5 * (d - b)
        uu, vv, uv = dot(su, su), dot(sv, sv), dot(su, sv)
        aj = np.sqrt(vv * uu - uv * uv)
        alpha, beta = (uu - vv) / (4 * aj), (vv - uu) / (4 * aj)
        gamma = dot(su - sv, su - sv) / (4 * aj)
        term = (
            alpha[..., None] * (a - points) + beta[..., None] * (b - points) + gamma[..., None] * (d - points)
        )
        total, area = (term, aj) if total is None else (total + term, area + aj)
    return np.asarray((2 / area)[..., None] * total)


def diamond_flux(u: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Normal n = u x v, |n|, 1/|n| and the flux v x n / |n| across the edge v."""
    n = cross(u, v)
    length = np.sqrt(dot(n, n))
    scale = 1 / length
    return n, length, scale, scale[..., None] * cross(v, n)


def shared_curvature_normal(points: Array, area: str = "finite_volume") -> Array:
    """H n on a vertex grid that wraps both ways, as the kernels share it: each quad once.

    Operations a vertex: diagonals u, v 6; n = u x v 9; |n| 6; 1/|n| 1; two fluxes 24; their sum 9; then
    the finite-volume area 21 and the division 4, together 80; or Liu's area 2 and the division 4, 61.
    """
    i, j, k = np.roll(points, -1, 0), np.roll(points, (-1, -1), (0, 1)), np.roll(points, -1, 1)
    u, v = j - points, k - i
    n, length, scale, g = diamond_flux(u, v)
    e = scale[..., None] * cross(n, u)
    flux = g + np.roll(e, 1, 0) - np.roll(g, (1, 1), (0, 1)) - np.roll(e, 1, 1)
    if area == "liu":
        rows = length + np.roll(length, 1, 0)
        return np.asarray((2 / (rows + np.roll(rows, 1, 1)))[..., None] * flux)
    ring = cross(i - np.roll(points, 1, 0), k - np.roll(points, 1, 1))
    return np.asarray((1 / np.sqrt(dot(ring, ring)))[..., None] * flux)


def staggered_curvature_normal(primal: Array, dual: Array) -> Array:
    """H n on a primal/dual grid that wraps both ways, each edge once.

    Operations a cell: two edges of 34, their sum 9, the area 21 and the division 4, together 102.
    """
    up, left, across = np.roll(dual, -1, 0), np.roll(dual, -1, 1), np.roll(dual, (-1, -1), (0, 1))
    first = diamond_flux(primal - np.roll(primal, 1, 0), left - dual)[-1]
    second = diamond_flux(primal - np.roll(primal, 1, 1), dual - up)[-1]
    flux = np.roll(first, -1, 0) - first + np.roll(second, -1, 1) - second
    cell = cross(across - dual, left - up)
    return np.asarray((1 / np.sqrt(dot(cell, cell)))[..., None] * flux)


class Counted(float):
    """A float that counts the operations it takes part in; a change of sign is none."""

    count = 0

    def sqrt(self) -> Counted:
        """Square root, which numpy.sqrt calls."""
        Counted.count += 1
        return Counted(np.sqrt(float(self)))

    def __neg__(self) -> Counted:
        return Counted(-float(self))


def _counting(operation: Callable[[float, float], float], swapped: bool = False) -> Any:
    def counted(self: Counted, other: float) -> Counted:
        Counted.count += 1
        a, b = float(self), float(other)
        return Counted(operation(b, a) if swapped else operation(a, b))

    return counted


for _name in ("add", "sub", "mul", "truediv"):
    setattr(Counted, f"__{_name}__", _counting(getattr(operator, _name)))
    setattr(Counted, f"__r{_name}__", _counting(getattr(operator, _name), swapped=True))


def operations(formula: Callable[..., Array], *points: Array) -> float:
    """Floating-point operations (sums, products, divisions, roots) a point of the grid."""
    counted = [np.vectorize(Counted, otypes=[object])(p) for p in points]
    Counted.count = 0
    formula(*counted)
    return Counted.count / points[0][..., 0].size


def torus_grid(n: int) -> tuple[Array, Array]:
    """Primal and dual points of a torus that wrap both ways, n by n."""
    mesh, *_ = torus().sample((n, n), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    return mesh.primal[1:-1, 1:-1], mesh.dual[:-1, :-1]


def operation_counts() -> Results:
    """Operations a point: the printed formulas and ours."""
    primal, dual = torus_grid(6)
    alone = operations(printed_curvature_normal, primal, dual)
    edge = operations(lambda p, d: printed_edge(np.roll(p, 1, 1) - p, np.roll(d, 1, 1) - d), primal, dual)
    return {
        "operations: difference to a larger grid": operations(staggered_curvature_normal, *torus_grid(12))
        - operations(staggered_curvature_normal, primal, dual),
        "operations: as printed, each cell on its own": alone,
        "operations: as printed, each edge once": alone - 2 * edge,
        "operations: primal/dual": operations(staggered_curvature_normal, primal, dual),
        "operations: vertices": operations(shared_curvature_normal, primal),
        "operations: Liu as printed": operations(printed_liu, primal),
        "operations: Liu, vertices": operations(lambda p: shared_curvature_normal(p, "liu"), primal),
    }


def performance(output: Path, quick: bool) -> Results:
    """Figure 3.12: time against the number of cells with its quadratic fit, and operations a point."""
    sizes = np.array([64, 128, 192, 256] if quick else [64, 128, 256, 384, 512, 640, 768, 896, 1024])
    seconds = []
    for n in sizes:
        mesh, *_ = torus().sample((n, n), "staggered")
        laps = []
        for _ in range(15):
            start = time.perf_counter()
            mean_curvature_normal(mesh, "finite_volume")
            laps.append(time.perf_counter() - start)
        seconds.append(min(laps))
    t = 1e3 * np.array(seconds)
    fit = np.polynomial.Polynomial.fit(sizes, t, 2)
    counts = operation_counts()
    fig, (left, right) = figure(1, 2, size=(7.4, 3.4), width_ratios=(1, 0.95))
    fine = np.linspace(0, sizes[-1], 200)
    square = 1e6 * float(fit.convert().coef[2])
    left.plot(
        fine,
        fit(fine),
        color=COLOURS[1],
        label=f"quadratic fit, {square:.0f} ns $\\times\\, n^2 + \\ldots$",
    )
    left.plot(sizes, t, "o", color=COLOURS[0], label="measured, least of 15")
    left.set(
        xlabel=CELLS, ylabel="time (ms)", title=r"Time of $\mathbf{H}$ at $n \times n$ cells", ylim=(0, None)
    )
    left.legend(loc="upper left", borderaxespad=0)
    left.set_ylim(0, 1.25 * max(t.max(), fit(sizes[-1])))
    bars = {
        "thesis, as stated": 197.0,
        "thesis, as printed,\neach cell on its own": counts["operations: as printed, each cell on its own"],
        "thesis, as printed,\neach edge once": counts["operations: as printed, each edge once"],
        "quadcurv, primal/dual": counts["operations: primal/dual"],
        "quadcurv, vertices": counts["operations: vertices"],
        "Liu as printed": counts["operations: Liu as printed"],
        "quadcurv, Liu, vertices": counts["operations: Liu, vertices"],
    }
    colours = ["0.6"] * 3 + [COLOURS[0]] * 2 + ["0.6", COLOURS[0]]
    drawn = right.barh(list(bars), list(bars.values()), color=colours)
    right.bar_label(drawn, fmt="%.0f", padding=3)
    right.invert_yaxis()
    right.grid(axis="y", visible=False)
    right.set(
        xlabel="floating-point operations a point", title="Arithmetic", xlim=(0, 1.15 * max(bars.values()))
    )
    save_figure(fig, output, "figure_3_12", {"n": sizes, "time (ms)": t, "fit (ms)": fit(sizes)})
    deviation = np.sqrt(np.sum((t - fit(sizes)) ** 2) / np.sum((t - t.mean()) ** 2))
    return counts | {"time: n^2 coefficient (ns)": square, "time: 1 - R^2": float(deviation**2)}


def slips() -> Results:
    """Numbers behind the printed equations that do not hold."""
    results: Results = {}
    for n in (64, 128):
        primal, dual = torus_grid(n)
        exact = torus().mean_curvature(*torus().sample((n, n), "staggered")[1:])
        for slip in ("", "3.29", "3.34"):
            kappa = np.linalg.norm(printed_curvature_normal(primal, dual, slip), axis=-1)
            results[f"{slip or 'corrected'}: error at {n}"] = float(np.abs(kappa - exact).mean())
    mesh, xi, eta = helicoid().sample((64, 64), "staggered")
    Hn = mean_curvature_normal(mesh, "finite_volume")
    normal = np.stack((np.sin(eta), -np.cos(eta), xi), axis=-1) / np.sqrt(1 + xi**2)[..., None]
    cosine = np.abs(dot(Hn, normal)) / np.linalg.norm(Hn, axis=-1)
    mesh, xi, eta = sphere().sample((64, 32), "staggered")
    inward = dot(mean_curvature_normal(mesh, "finite_volume"), sphere().mapping(xi, eta))
    xi, eta = np.mgrid[-1:1:9j, -3:3:9j]
    x, y, z = np.moveaxis(catenoid().mapping(xi, eta), -1, 0)
    return results | {
        "3.79: off the catenoid, Z = xi": float(np.abs(np.hypot(x, y) - np.cosh(z)).max()),
        "3.79: off the catenoid, Z = eta": float(np.abs(np.hypot(x, y) - np.cosh(eta)).max()),
        "3.79: off the helicoid, Z = eta": float(np.abs(x * np.sin(eta) - y * np.cos(eta)).max()),
        "3.22: largest cosine on the helicoid": float(cosine.max()),
        "3.22: H n . outward normal on the sphere": float(inward.mean()),
    }


@paper_style
def main(output: Path, quick: bool = False) -> Results:
    """Write all figures to a folder.

    Parameters
    ----------
    output : Path
        Folder, made where there is none.
    quick : bool
        No maps, and smaller grids in Figure 3.12; all numbers but its times are the same.

    Returns
    -------
    dict
        Measured errors, rates and counts by name.
    """
    schematic(output)
    if not quick:
        problem = maps(output)
        if problem:
            Console(stderr=True).print(f"Pages .html in place of pictures of the maps: {problem}")
    return {
        **exactness(),
        **rates(output),
        **other_surfaces(output),
        **henneberg_surface(output),
        **places(),
        **slips(),
        **performance(output, quick),
    }


def claims(results: Results) -> list[Claim]:
    """Claims of chapter 3 beside the results of `main`."""
    r = results

    def orders(name: str) -> str:
        return (
            f"rates {r[f'{name}: one-norm rate']:.2f} (one-norm) and {r[f'{name}: inf-norm rate']:.2f} "
            f"(inf-norm), errors {r[f'{name}: one-norm at 256']:.1e} and {r[f'{name}: inf-norm at 256']:.1e} "
            "at 256 cells"
        )

    named = ("hyperboloid", "elliptic_paraboloid", "hyperbolic_paraboloid", "tanh_sheet")
    return [
        Claim(
            "3.3",
            "Second order or better on hyperboloids, paraboloids, hyperbolic-tangent sheets and cylinders",
            "inf-norm rates "
            + ", ".join(f"{r[f'{n}: inf-norm rate']:.2f} ({n.replace('_', ' ')})" for n in named)
            + "; cylinders exact",
            "reproduced",
        ),
        Claim(
            "3.3.1, (3.78), Figure 3.2",
            "Exact on the cylinder, whatever f(theta) shifts its rulings",
            f"largest error {below(r['cylinder: largest error'], 11)} with f = 0 and "
            f"{below(r['wavy cylinder: largest error'], 11)} with f = sin 2 theta, up to 256 cells",
            "reproduced",
        ),
        Claim(
            "3.3.2",
            "Exact on the plane",
            f"largest error {below(r['plane: largest error'], 14)}",
            "reproduced",
        ),
        Claim("3.3.2, Figure 3.4", "Second order on the catenoid", orders("catenoid"), "reproduced"),
        Claim(
            "3.3.2, Figure 3.5",
            "Second order on the helicoid",
            f"for kappa = |H n| {orders('helicoid')}; the signed -(H n) . n vanishes by symmetry, "
            f"{below(r['helicoid: signed, inf-norm at 256'], 10)}",
            "reproduced",
        ),
        Claim("3.3.2, Figure 3.7", "Second order on Enneper's surface", orders("enneper"), "reproduced"),
        Claim(
            "3.3.2, Figure 3.6",
            "The errors on Enneper's surface are centred on the origin and vanish outside",
            f"largest at a distance of {r['enneper: where the largest error is']:.1f} from the origin of the "
            f"parameters, {100 * r['enneper: largest error beyond 2.5 over all']:.0f} % of that beyond 2.5",
            "reproduced",
        ),
        Claim(
            "3.3.2",
            "On Henneberg's surface the scheme fails to converge around the origin",
            f"kappa stays {r['henneberg: near, at 256']:.3f} off around the singular points (0, k pi/2), "
            f"though further than 0.25 from them its rate is {r['henneberg: far, rate']:.2f}, "
            f"error {r['henneberg: far, at 256']:.1e} at 256 cells; the signed H converges even at the "
            f"singular points, rate {r['henneberg: signed, rate']:.2f}",
            "reproduced",
        ),
        Claim(
            "3.3.2",
            "because it is not continuous there and has no consistent normals",
            "mapping and unit normal are smooth there (on a circle of radius 0.001 the normal turns by "
            f"{r['henneberg: turn of the normal around a singular point']:.3f}); they are branch points: "
            "X_xi x X_eta vanishes and K is infinite",
            "slip",
        ),
        Claim(
            "3.3.3, Figure 3.9",
            "On the pillow sphere second order in the one-norm, first order in the inf-norm",
            orders("pillow_sphere"),
            "reproduced",
        ),
        Claim(
            "3.3.3, Figure 3.8",
            "The errors of the pillow sphere sit on its seams, the equator and the diagonals",
            "at 128 cells the largest error off the seams is "
            f"{100 * r['pillow: largest error off the seams over on them']:.0f} % of that on them",
            "reproduced",
        ),
        Claim(
            "3.3.3",
            "The ratio of its largest to its smallest cell stays fixed under refinement",
            f"{r['pillow: largest over smallest cell, 32']:.2f} at 32 and "
            f"{r['pillow: largest over smallest cell, 128']:.2f} at 128 cells; longitude-latitude to the "
            f"poles {r['sphere with poles: largest over smallest cell, 32']:.0f} and "
            f"{r['sphere with poles: largest over smallest cell, 128']:.0f}",
            "reproduced",
        ),
        Claim(
            "3.3.3, Figure 3.10",
            "Second order in spherical coordinates without the poles",
            orders("sphere"),
            "reproduced",
        ),
        Claim(
            "3.3.3, Figures 3.8 and 3.11",
            "Overall the errors are greater in spherical coordinates than on the pillow grid",
            "to 80 degrees of latitude, with as many cells, the median error is "
            f"{r['sphere to 80 over pillow, median']:.1f} times and the one-norm "
            f"{r['sphere to 80 over pillow, one-norm']:.2f} times that of the pillow grid (to 60 degrees "
            f"{r['sphere to 60 over pillow, one-norm']:.2f} times), but the inf-norm "
            f"{r['sphere to 80 over pillow, inf-norm']:.3f} times",
            "reproduced only if ...",
        ),
        Claim(
            "3.4, Figure 3.12",
            "The time is O(n^2)",
            f"{r['operations: primal/dual']:.0f} operations a cell, on a larger grid "
            f"{r['operations: difference to a larger grid']:.0f} more; the figure shows measured times",
            "reproduced",
        ),
        Claim(
            "3.4",
            "197 n^2 + C floating-point operations",
            "the printed formulas (3.24) to (3.34) take "
            f"{r['operations: as printed, each cell on its own']:.0f} a cell on its own and "
            f"{r['operations: as printed, each edge once']:.0f} if each edge is computed once, 197 lies "
            f"between; as a diamond scheme {r['operations: primal/dual']:.0f}, on the vertices of a grid "
            f"{r['operations: vertices']:.0f}",
            "reproduced only if ...",
        ),
        Claim(
            "(3.22)",
            "The surface normal is H/|H|",
            "undefined where H = 0: on the helicoid the computed H/|H| lies in the surface (cosine with the "
            f"normal {below(r['3.22: largest cosine on the helicoid'], 6)}); on the sphere it points inward",
            "slip",
        ),
        Claim(
            "(3.29)",
            "The edge normal is along a^11 t1 + a^22 t2",
            f"on the torus its error stays at {r['3.29: error at 64']:.3f} and {r['3.29: error at 128']:.3f} "
            f"(64 and 128 cells); with a^12 for a^22 it falls from {r['corrected: error at 64']:.1e} to "
            f"{r['corrected: error at 128']:.1e}",
            "slip",
        ),
        Claim(
            "(3.34), (3.35)",
            "t^(1) on all four edges",
            f"on the torus its error stays at {r['3.34: error at 64']:.2f} and "
            f"{r['3.34: error at 128']:.2f}; it is t^(1) or t^(2) as the edge runs",
            "slip",
        ),
        Claim(
            "(3.79)",
            "The catenoid has Z = eta",
            "these points lie on the helicoid (3.80), "
            f"{below(r['3.79: off the helicoid, Z = eta'], 12)} off, and up to "
            f"{r['3.79: off the catenoid, Z = eta']:.1f} off the catenoid; with Z = xi "
            f"{below(r['3.79: off the catenoid, Z = xi'], 12)} off",
            "slip",
        ),
    ]


if __name__ == "__main__":
    options = arguments(__doc__)
    print_claims(claims(main(options.output, options.quick)), "Chapter 3")
