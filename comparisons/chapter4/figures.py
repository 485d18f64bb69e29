"""Figures 4.1 to 4.4, and the maps of the pillow sphere."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from comparisons.chapter4.measure import schemes
from comparisons.figures import COLOURS, LABELS, STYLES, figure, plot_errors
from comparisons.maps import Maps
from comparisons.measured import Measured, curvature_errors
from quadcurv.comparison import Comparison, compare
from quadcurv.surfaces import pillow_sphere

ERROR = r"error of $\kappa = \|\mathbf{H}\|$ (1/length)"
HEMISPHERE = "cells $n$ across a hemisphere"
FITTED = (16, 256)


def stencils(found: Measured) -> Figure:
    """Figure 4.1 beside the primal/dual stencil of Figure 3.1: the same, turned by 45 degrees."""
    fig, (left, right) = figure(1, 2, size=(6.6, 3.5))
    offsets = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], float)
    turn = np.array([[1, -1], [1, 1]]) / 2  # the a's onto cell corners, the d's onto cell centres
    _stencil(left, offsets @ turn.T, "primal and dual points")
    _stencil(right, offsets, "vertices of a mesh")
    for axes, lines in ((left, np.linspace(-1.5, 1.5, 4)), (right, (-1, 0, 1))):
        for line in lines:
            axes.plot([line, line], [-1.5, 1.5], color="0.8", linewidth=0.8, zorder=0)
            axes.plot([-1.5, 1.5], [line, line], color="0.8", linewidth=0.8, zorder=0)
    handles, names = right.get_legend_handles_labels()
    fig.legend(handles, names, loc="outside lower center", ncols=3, frameon=False)
    return fig


def _stencil(axes: Axes, ring: np.ndarray, title: str) -> None:
    dual, primal = ring[::2], ring[1::2]
    polygon = np.vstack((dual, dual[:1]))
    axes.fill(*polygon.T, color=COLOURS[5], alpha=0.25, linewidth=0)
    axes.plot(*polygon.T, color=COLOURS[0], label="edges $t_2 = b - a$ of the dual cell")
    for k, d in enumerate(primal):
        label = "$t_1 = d - c$, crossing an edge" if k == 0 else None
        axes.annotate(
            "", tuple(d), (0, 0), arrowprops={"arrowstyle": "->", "color": COLOURS[1], "shrinkB": 5}
        )
        axes.plot([], [], color=COLOURS[1], label=label)
    axes.plot(*dual.T, "s", color=COLOURS[0], label="$a$, $b$: dual points")
    axes.plot(*primal.T, "o", color=COLOURS[1], label="$d$: primal points")
    axes.plot(0, 0, "o", color="black", label="$c$: the point in question")
    for point, name in ((dual[0], "$a$"), (primal[0], "$d$"), (dual[1], "$b$"), (np.zeros(2), "$c$")):
        axes.annotate(name, tuple(point), (6, 5), textcoords="offset points")
    axes.set(title=title, aspect="equal", xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.grid(False)


def panel(
    axes: Axes, found: Measured, case: str, norm: str, shown: Iterable[str], fitted: Iterable[str], title: str
) -> None:
    """One case in one norm; the legend, with the rates, lies below."""
    columns = found.series[f"chapter4_{case.replace(' ', '_')}"]
    names = {f"{scheme}, {norm}": LABELS[scheme] for scheme in shown}
    window = {f"{scheme}, {norm}": FITTED for scheme in fitted}
    styles = {f"{scheme}, {norm}": STYLES[scheme] for scheme in shown}
    plot_errors(axes, columns, names, window, styles=styles)
    axes.set(title=title)
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False, handletextpad=0.3)


def cylinders(found: Measured) -> Figure:
    """Figure 4.2: primal and dual points with f = 0 and f = sin 2 theta, and vertices."""
    shown = ("cotan-8", "cotan-8-voronoi", "cotan-6", "cotan-6'", "finite_volume", "liu")
    fig, panels = figure(1, 3, size=(7.4, 5.2), sharey=True)
    n = np.asarray(found.series["chapter4_cylinder"]["n"], float)
    for axes, case, fitted, title in zip(
        panels,
        ("cylinder", "wavy cylinder", "cylinder vertices"),
        (("cotan-6", "cotan-8-voronoi"), ("cotan-6",), ("finite_volume",)),
        ("primal/dual, $f = 0$", r"primal/dual, $f = \sin 2\theta$", "vertices, $f = 0$"),
        strict=True,
    ):
        panel(axes, found, case, "one-norm", shown, fitted, title)
        axes.plot(n, np.finfo(float).eps * n**2 / 8, color="0.3", linestyle=":")
        axes.text(n[-1], 4e-15, r"$\epsilon n^2 / 8$", ha="right", va="top", color="0.3")
        axes.set(xlabel="cells $n$ around")
    panels[0].set_ylabel(ERROR + ", one-norm")
    return fig


def pillow(norm: str) -> Callable[[Measured], Figure]:
    """Figures 4.3 and 4.4."""
    shown = ("cotan-8", "cotan-6-voronoi", "cotan-6", "liu", "bilinear", "finite_volume")

    def draw(found: Measured) -> Figure:
        fig, panels = figure(1, 2, size=(7.2, 5.2), sharey=True)
        for axes, case, title in zip(
            panels,
            ("pillow", "pillow vertices"),
            ("primal and dual points", "vertices, the stencil of Figure 4.1"),
            strict=True,
        ):
            panel(axes, found, case, norm, shown, shown, title)
            axes.set(xlabel=HEMISPHERE)
        panels[0].set_ylabel(f"{ERROR}, {norm}")
        return fig

    return draw


FIGURES = {
    "figure_4_1": stencils,
    "figure_4_2": cylinders,
    "figure_4_3": pillow("one-norm"),
    "figure_4_4": pillow("inf-norm"),
}


def pillow_maps() -> Maps:
    """Errors of four schemes on the pillow sphere."""
    panels = {}
    for scheme in ("finite_volume", "liu", "cotan-6", "cotan-8"):
        found = curvature_errors(pillow_sphere(), (64, 32), scheme)
        panels[LABELS[scheme]] = found.mesh, found.norm
    return Maps(panels, ERROR, (-5, 0), height=1.6)


MAPS = {"chapter4_pillow_map": pillow_maps}


def pillow_comparison() -> Comparison:
    """All operators on the pillow sphere."""
    mesh, xi, eta = pillow_sphere().sample((96, 48), "staggered")
    return compare(mesh, schemes().values(), pillow_sphere().mean_curvature(xi, eta))


PAGES = {"pillow_error_maps": pillow_comparison}
