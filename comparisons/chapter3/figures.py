"""The figures and maps of chapter 3."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from comparisons.chapter3.measure import CONVERGENCE, FV, LARGE, OTHERS, PORTION, SIZES, wave
from comparisons.figures import COLOURS, MARKERS, figure, plot_errors
from comparisons.maps import Maps
from comparisons.measured import Measured, curvature_errors
from quadcurv import StaggeredGrid
from quadcurv.surfaces import Surface, catenoid, cylinder, helicoid, henneberg, pillow_sphere, sphere

Array = NDArray[Any]

CELLS = "cells $n$ in each direction"
HEMISPHERE = "cells $n$; the sphere has $2n \\times n$"
ERROR = r"error of $\kappa = \|\mathbf{H}\|$ (1/length)"
BAR = r"error of $\kappa$ (1/length)"
MINIMAL, SPHERES = (-6, -3), (-6, -1)  # decades of the two colour scales


def schematic(found: Measured) -> Figure:
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
    return fig


def rates_figure(stem: str) -> Any:
    """Figure of a surface in both norms."""

    def draw(found: Measured) -> Figure:
        columns, (surface, title) = found.series[stem], CONVERGENCE[stem]
        names = {"one-norm": "one-norm", "inf-norm": "inf-norm"}
        rounding = None
        if surface.name == "helicoid":
            names["signed, inf-norm"] = "signed $H$, inf-norm"
            rounding = np.finfo(float).eps * SIZES**2 / 8, r"$\epsilon n^2/8$"
        fig, axes = figure()
        window = dict.fromkeys(("one-norm", "inf-norm"), (64, 256))
        plot_errors(axes, columns, names, window, rounding)
        axes.set(xlabel=HEMISPHERE if "sphere" in surface.name else CELLS, ylabel=ERROR, title=title)
        return fig

    return draw


def others_figure(found: Measured) -> Figure:
    """Further surfaces, both norms."""
    columns = found.series["figure_3_others"]
    fig, panels = figure(1, 2, size=(7.2, 4.3), sharey=True)
    for axes, norm in zip(panels, ("one-norm", "inf-norm"), strict=True):
        labels = {f"{s.name}, {norm}": s.name.replace("_", " ") for s in OTHERS}
        plot_errors(axes, columns, labels, (64, 256))
        axes.set(xlabel=CELLS, title=norm)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), frameon=False)
    panels[0].set_ylabel("error of $H$ (1/length)")
    return fig


def henneberg_figure(found: Measured) -> Figure:
    """Error against the distance to the singular points."""
    columns = found.series["figure_3_henneberg"]
    fig, axes = figure()
    for k, n in enumerate((64, 128, 256)):
        axes.plot(columns["distance"], columns[f"n = {n}"], label=f"$n = {n}$", marker=MARKERS[k])
    axes.axvline(0.25, color="0.4", linestyle="--", linewidth=0.9)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=r"distance to the nearest singular point, in $(\xi, \eta)$",
        ylabel="largest " + ERROR,
        title="Henneberg's surface",
    )
    axes.legend()
    return fig


def time_figure(found: Measured) -> Figure:
    """Figure 3.12: time with its quadratic fit, and operations a point."""
    columns, r = found.series["figure_3_12"], found.numbers
    n, t = np.asarray(columns["n"], float), np.asarray(columns["time (ms)"])
    fit = np.polynomial.Polynomial.fit(n[n >= LARGE], t[n >= LARGE], 2)
    square = 1e6 * float(fit.convert().coef[2])
    fig, (left, right) = figure(1, 2, size=(7.4, 3.6), width_ratios=(1, 0.95))
    fine = np.linspace(LARGE, n[-1], 200)
    label = f"quadratic fit from $n = {LARGE}$:\n{square:.1f} ns $\\times\\, n^2 + \\ldots$"
    left.plot(fine, fit(fine), color=COLOURS[1], label=label)
    left.plot(n, t, "o", color=COLOURS[0], label="measured, least of 9")
    left.axvline(LARGE, color="0.4", linestyle="--", linewidth=0.9)
    left.annotate(
        "in the caches of a core",
        (LARGE, 0),
        (-4, 24),
        textcoords="offset points",
        ha="right",
        rotation=90,
        color="0.4",
    )
    left.set(xlabel=CELLS, ylabel="processor time (ms)", title=r"Time of $\mathbf{H}$ at $n \times n$ cells")
    left.set_ylim(0, 1.35 * t.max())
    left.legend(loc="upper left", borderaxespad=0)
    bars = {
        "thesis, as stated": 197.0,
        "thesis, as printed,\neach cell on its own": r["operations: as printed, each cell on its own"],
        "thesis, as printed,\neach edge once": r["operations: as printed, each edge once"],
        "quadcurv, primal/dual": r["operations: primal/dual"],
        "quadcurv, vertices": r["operations: vertices"],
        "Liu as printed": r["operations: Liu as printed"],
        "quadcurv, Liu, vertices": r["operations: Liu, vertices"],
    }
    colours = ["0.6"] * 3 + [COLOURS[0]] * 2 + ["0.6", COLOURS[0]]
    bar = right.barh(list(bars), list(bars.values()), color=colours)
    right.bar_label(bar, fmt="%.0f", padding=3)
    right.invert_yaxis()
    right.grid(axis="y", visible=False)
    right.set(
        xlabel="floating-point operations a point", title="Arithmetic", xlim=(0, 1.15 * max(bars.values()))
    )
    return fig


FIGURES = {
    "figure_3_1": schematic,
    **{stem: rates_figure(stem) for stem in CONVERGENCE},
    "figure_3_others": others_figure,
    "figure_3_henneberg": henneberg_figure,
    "figure_3_12": time_figure,
}


def errors_map(surface: Surface, cells: tuple[int, int]) -> tuple[StaggeredGrid, Array]:
    """Panel of a map: mesh and errors of kappa."""
    found = curvature_errors(surface, cells, FV)
    assert isinstance(found.mesh, StaggeredGrid)
    return found.mesh, found.norm


def cylinders() -> Maps:
    """Figure 3.2, both at one size."""
    panels = {}
    for title, f in ((r"$f(\theta) = \sin 2\theta$", wave), (r"$f(\theta) = 0$", None)):
        mesh, *_ = replace(cylinder(f=f), domain=((0, 2 * np.pi), (0, 3))).sample((60, 20))
        panels[title] = mesh, mesh.stencils().points[:, 2]
    return Maps(panels, camera=(1.0, 0.5, 0.5))


def minimal_surfaces() -> Maps:
    """Figure 3.3."""
    panels = {
        "helicoid": errors_map(replace(helicoid(), domain=((-1.5, 1.5), (-np.pi, np.pi))), (48, 48)),
        "catenoid": errors_map(catenoid(), (48, 48)),
    }
    return Maps(panels, BAR, MINIMAL, (1.0, -0.7, 0.7), height=3.6)


def henneberg_map() -> Maps:
    """Henneberg's surface; the whole domain covers it twice."""
    sheet = replace(henneberg(), domain=((0.0, 0.5), henneberg().domain[1]))
    return Maps({"Henneberg": errors_map(sheet, (24, 48))}, BAR, (-4, -1), (1.0, 0.6, 0.8))


MAPS = {
    "figure_3_2": cylinders,
    "figure_3_3": minimal_surfaces,
    "figure_3_6": lambda: Maps({"Enneper": errors_map(PORTION, (48, 48))}, BAR, MINIMAL, (0.3, -1.0, 1.4)),
    "figure_3_8": lambda: Maps({"pillow": errors_map(pillow_sphere(), (80, 40))}, BAR, SPHERES),
    "figure_3_11": lambda: Maps(
        {"longitude-latitude": errors_map(sphere(latitude=np.radians(80)), (80, 40))}, BAR, SPHERES
    ),
    "figure_3_henneberg_map": henneberg_map,
}
