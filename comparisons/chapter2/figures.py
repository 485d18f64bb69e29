"""The figures of chapter 2."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from comparisons.chapter2.measure import parameters
from comparisons.figures import COLOURS, figure, legend_below, plot_errors
from comparisons.measured import Measured
from quadcurv.curves import circle, ellipse, helix

POINTS = "number of points $n$"
CURVATURE_ERROR = r"largest error $|\kappa_j - \kappa|$ (1/length)"
AROUND = {"fillstyle": "none", "markersize": 8}  # so that nothing hides under it


def schematic(found: Measured) -> Figure:
    """Figure 2.1: primal and dual points, a cell, its two tangents and its curvature normal."""
    edges = np.radians(np.linspace(150, 30, 6))
    unit = circle().mapping
    points, dual = unit((edges[1:] + edges[:-1]) / 2), unit(edges)
    fig, axes = figure(size=(5.2, 2.7))
    axes.plot(*unit(np.linspace(edges[0], edges[-1], 200)).T, color="0.6", zorder=1)
    cell = unit(np.linspace(edges[2], edges[3], 50))
    axes.plot(*cell.T, color=COLOURS[4], linewidth=4, alpha=0.6, zorder=1, label="cell $C_j$")
    for p in dual:  # a mark across the curve
        axes.plot(*np.outer([0.975, 1.025], p).T, color=COLOURS[1], label="dual points")
    axes.plot(*points.T, "o", color=COLOURS[0], markersize=6, label="primal points")
    arrow = {"arrowstyle": "-|>", "shrinkA": 3, "shrinkB": 3, "linewidth": 1.3}
    for start, end, colour in (
        (points[1], points[2], COLOURS[2]),
        (points[2], points[3], COLOURS[2]),
        (points[2], 0.72 * points[2], COLOURS[3]),
    ):
        axes.annotate("", end, start, arrowprops=arrow | {"color": colour})
    for position, text, shift in (
        (points[1], r"$T_{p,j-1}$", (-6, 9)),
        (points[2], r"$T_{p,j}$", (0, 9)),
        (points[3], r"$T_{p,j+1}$", (6, 9)),
        (dual[2], r"$T_{d,j}$", (-3, 11)),
        (dual[3], r"$T_{d,j+1}$", (3, 11)),
        ((points[1] + points[2]) / 2, r"$t_{(1),j}$", (2, -14)),
        ((points[2] + points[3]) / 2, r"$t_{(1),j+1}$", (-2, -14)),
        (0.78 * points[2], r"$\mathbf{H}_j$", (11, 0)),
    ):
        axes.annotate(text, position, shift, textcoords="offset points", ha="center")
    axes.set(aspect="equal", xlim=(-1, 1), ylim=(0.45, 1.16))
    axes.axis("off")
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes.legend(unique.values(), unique.keys(), loc="lower center", ncols=3)
    return fig


def ellipse_normals(found: Measured) -> Figure:
    """Figure 2.2; H varies by a factor of 16, the root of its length by 4."""
    c = found.series["figure_2_2"]
    root = np.sqrt(np.hypot(c["Hx"], c["Hy"]))
    fig, axes = figure(size=(5.6, 2.8))
    axes.plot(*ellipse().mapping(np.linspace(*ellipse().domain, 400)).T)
    axes.quiver(
        c["x"],
        c["y"],
        0.7 * c["Hx"] / root,
        0.7 * c["Hy"] / root,
        color=COLOURS[1],
        angles="xy",
        scale_units="xy",
        scale=1,
        width=2.5e-3,
        headwidth=5,
        headlength=6,
        headaxislength=5.5,
    )
    axes.set(aspect="equal", xlabel="$x$", ylabel="$y$")
    axes.set_title(r"Curvature normals of the ellipse, $n = 64$; length $0.7\,\|\mathbf{H}\|^{1/2}$")
    return fig


def ellipse_figure(found: Measured) -> Figure:
    """Figure 2.3."""
    columns = found.series["figure_2_3"]
    fig, axes = figure()
    plot_errors(axes, columns, ("primal/dual points", "polyline"), window=(64, 1024))
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title="Ellipse, $a = 5$, $b = 2$")
    return fig


def spiral(found: Measured) -> Figure:
    """Figure 2.4."""
    columns = found.series["figure_2_4"]
    fig, axes = figure(size=(4.2, 4.0))
    axes.plot(columns["x"], columns["y"], linewidth=0.5)
    axes.set(aspect="equal", xlabel="$C(t)$", ylabel="$S(t)$", title="Euler spiral, $-30 < t < 30$")
    ticks = np.linspace(-1, 1, 5)
    axes.set(xticks=ticks, yticks=ticks)
    return fig


def spiral_figure(found: Measured) -> Figure:
    """Figure 2.5."""
    columns = found.series["figure_2_5"]
    names = {
        "computed": "inside, scipy's integrals",
        "rounded": "inside, integrals correctly rounded",
        "exact": "inside, positions not rounded",
        "ends": "the two ends",
    }
    fig, axes = figure(size=(5.2, 4.4))
    plot_errors(
        axes,
        columns,
        names,
        window={"computed": (1024, 8192)},
        rounding=(columns["eps/h^2"], r"$\epsilon/h^2$"),
        styles={"rounded": AROUND, "exact": {"marker": "+", "markersize": 6}},
    )
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title="Euler spiral, $-30 < t < 30$")
    axes.text(2**8.6, 1e-3, "under-\nresolved", color="0.4", ha="center")
    legend_below(fig, axes)
    return fig


def helix_normals(found: Measured) -> Figure:
    """Figure 2.6."""
    c = found.series["figure_2_6"]
    fig, axes = figure(size=(4.0, 4.6), subplot_kw={"projection": "3d", "box_aspect": (1, 1, 1.5)})
    axes.plot(*helix().mapping(parameters(helix(), 800)).T, label="helix")
    arrows = [c[name] for name in ("x", "y", "z", "Hx", "Hy", "Hz")]
    axes.quiver(*arrows, color=COLOURS[1], length=0.6, linewidth=0.8, label=r"$0.6\,\mathbf{H}$")
    axes.set(xlabel="$x$", ylabel="$y$", zlabel="$z$", xticks=(-1, 0, 1), yticks=(-1, 0, 1))
    axes.legend(loc="upper left")
    return fig


def helix_figure(found: Measured) -> Figure:
    """Figure 2.7."""
    columns = found.series["figure_2_7"]
    names = {"curvature": r"$\kappa$", "printed torsion": r"$\tau$, (2.54) to (2.56), corrected"}
    fig, axes = figure()
    plot_errors(axes, columns, names, window=(64, 1024))
    axes.set(xlabel=POINTS, ylabel="largest error (1/length)", title=r"Helix, $\kappa = 0.8$, $\tau = 0.4$")
    return fig


def exact_figure(found: Measured) -> Figure:
    """Circle and line."""
    columns = found.series["figure_2_exact"]
    fig, axes = figure()
    rounding = columns["eps/h^2"], r"$\epsilon/h^2$"
    plot_errors(axes, columns, ("circle", "line", "ends of the line"), rounding=rounding)
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title=r"Circle and line of length $2\pi$")
    return fig


def open_ends_figure(found: Measured) -> Figure:
    """Ends beside the inside."""
    columns = found.series["figure_2_open_ends"]
    fig, panels = figure(1, 2, size=(7.2, 3.6))
    for axes, name, title in zip(
        panels,
        ("arc curvature", "helix torsion"),
        (r"$\kappa$, ellipse, $\pi/6 < t < 5\pi/6$", r"$\tau$, helix"),
        strict=True,
    ):
        labels = {f"{name}, {where}": where for where in ("inside", "ends")}
        plot_errors(axes, columns, labels, window=(256, 1024), styles={f"{name}, ends": AROUND})
        axes.set(xlabel=POINTS, ylabel="largest error (1/length)", title=title)
    return fig


def uneven_figure(found: Measured) -> Figure:
    """Steps that vary by half."""
    columns = found.series["figure_2_uneven"]
    fig, (left, right) = figure(1, 2, size=(7.2, 4.4), sharex=True)
    circles = {
        "primal halfway": "primal halfway (2.48)",
        "polyline": "polyline",
        "dual halfway": "dual halfway",
    }
    helices = {"printed torsion": "over one edge (2.54)", "torsion": "over a third of three"}
    plot_errors(left, columns, circles, window={"polyline": (64, 1024)})
    plot_errors(right, columns, helices, window={"torsion": (64, 1024)})
    left.set(ylabel="largest error (1/length)", title=r"$\kappa$, circle, steps $\pm 50\,\%$")
    right.set(title=r"$\tau$, helix, steps $\pm 50\,\%$")
    for axes in (left, right):
        axes.set(xlabel=POINTS)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False)
    return fig


FIGURES = {
    "figure_2_1": schematic,
    "figure_2_2": ellipse_normals,
    "figure_2_3": ellipse_figure,
    "figure_2_4": spiral,
    "figure_2_5": spiral_figure,
    "figure_2_6": helix_normals,
    "figure_2_7": helix_figure,
    "figure_2_exact": exact_figure,
    "figure_2_open_ends": open_ends_figure,
    "figure_2_uneven": uneven_figure,
}
