"""The figures beyond the thesis."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from comparisons.beyond.measure import (
    AREA_SCHEMES,
    AREA_SURFACES,
    BORDERED,
    JITTERED,
    JITTERS,
    RING_SCHEMES,
    RINGS,
    TREATMENTS,
    cubed,
    icosahedral_sphere,
)
from comparisons.figures import COLOURS, LABELS, MARKERS, STYLES, figure, plot_errors
from comparisons.maps import Maps
from comparisons.measured import Measured
from quadcurv import mean_curvature
from quadcurv.surfaces import cubed_ellipsoid

CELLS = "cells $n$ in each direction"
JOINED = {"linestyle": "-", "linewidth": 1.0}


def boundaries_figure(found: Measured) -> Figure:
    """Error on the border by treatment."""
    columns = found.series["beyond_boundaries"]
    fig, panels = figure(1, 2, size=(7.2, 4.6), sharey=True)
    for axes, surface, title in zip(panels, BORDERED, ("Hyperbolic-tangent sheet", "Catenoid"), strict=True):
        labels = {f"{surface.name}: {name}": name for name in (*TREATMENTS, "inside")}
        plot_errors(axes, columns, labels, (64, 256))
        axes.set(xlabel=CELLS, title=title)
        axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False)
    panels[0].set_ylabel("largest error of $H$ on the border (1/length)")
    return fig


def extraordinary_figure(found: Measured) -> Figure:
    """Errors by valence, one panel a solid and scheme."""
    columns = found.series["beyond_extraordinary"]
    fig, panels = figure(2, 3, size=(7.4, 6.8), sharex=True, sharey=True)
    for row, solid in zip(panels, ("cubed ellipsoid", "icosahedral sphere"), strict=True):
        for axes, scheme in zip(row, RING_SCHEMES, strict=True):
            names, styles, window = {}, {}, {}
            for k, group in enumerate(RINGS):
                name = f"{solid}, {scheme}: {group}"
                if name in columns and columns[name][-1] > 1e-9:
                    names[name], styles[name] = group, {"color": COLOURS[k], "marker": MARKERS[k]}
                    window[name] = (8, 32)
            plot_errors(axes, columns, names, window, styles=styles)
            for line in list(axes.lines):  # the window is the same everywhere: the three finest
                if line.get_linestyle() == "--":
                    line.remove()
            axes.set_title(f"{solid}, {LABELS[scheme]}")
            axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.22), frameon=False, handletextpad=0.2)
            axes.xaxis.set_tick_params(labelbottom=True)
    for axes in panels.flat:
        axes.set_xlabel("cells $n$ along a panel", labelpad=1)
    for axes in panels[:, 0]:
        axes.set_ylabel("error of $H$ (1/length)")
    return fig


def jitter_figure(found: Measured) -> Figure:
    """One-norm with growing jitter."""
    columns = found.series["beyond_jitter"]
    fig, panels = figure(1, 4, size=(7.4, 4.0), sharex=True, sharey=True)
    for axes, jitter in zip(panels, JITTERS, strict=True):
        names = {f"jitter {100 * jitter:.0f} %, {s}: one-norm": LABELS[s] for s in JITTERED}
        styles = {name: STYLES[s] | JOINED for name, s in zip(names, JITTERED, strict=True)}
        plot_errors(axes, columns, names, styles=styles)
        axes.get_legend().remove()
        axes.set(title=f"jitter {100 * jitter:.0f} %", xlabel="cells $n$")
    panels[0].set_ylabel("one-norm of the error of $H$ (1/length)")
    handles, labels = panels[0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return fig


def areas_figure(found: Measured) -> Figure:
    """Barycentric and Voronoi areas."""
    columns = found.series["beyond_valence_8"]
    fig, panels = figure(2, 4, size=(7.4, 5.2), sharex=True, sharey=True)
    titles = ("cylinder", "torus", "lon-lat sphere", "paraboloid")
    for row, layout in zip(panels, ("grid", "staggered"), strict=True):
        for axes, surface, title in zip(row, AREA_SURFACES, titles, strict=True):
            names = {f"{surface.name}, {layout}, {scheme}": LABELS[scheme] for scheme in AREA_SCHEMES}
            exact = [name for name in names if np.max(columns[name]) < 1e-9]
            styles = {name: STYLES[scheme] | JOINED for name, scheme in zip(names, AREA_SCHEMES, strict=True)}
            plot_errors(axes, columns, {n: t for n, t in names.items() if n not in exact}, styles=styles)
            axes.get_legend().remove()
            if exact:
                axes.text(0.5, 0.08, "Voronoi: exact", transform=axes.transAxes, ha="center")
            axes.set_title(f"{title},\n{'vertices' if layout == 'grid' else 'primal/dual'}")
    for axes in panels[-1]:
        axes.set_xlabel("cells $n$")
    for axes in panels[:, 0]:
        axes.set_ylabel("one-norm, error of $H$")
    handles, labels = panels[1, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
    return fig


FIGURES = {
    "beyond_boundaries": boundaries_figure,
    "beyond_extraordinary": extraordinary_figure,
    "beyond_jitter": jitter_figure,
    "beyond_valence_8": areas_figure,
}


def extraordinary_map() -> Maps:
    """Errors of the finite-volume scheme where 3 and 5 quads meet."""
    cube, exact = cubed(cubed_ellipsoid(), 24)
    ball = icosahedral_sphere(12)
    panels = {
        "cubed ellipsoid": (cube, np.abs(mean_curvature(cube, "finite_volume") - exact)),
        "icosahedral sphere": (ball, np.abs(mean_curvature(ball, "finite_volume") - 1)),
    }
    return Maps(panels, "error of $H$ (1/length)", (-5, -1), (1.0, 0.8, 0.9))


MAPS = {"beyond_extraordinary_map": extraordinary_map}
