"""Figures for print: one size of type, one palette, the same bytes on every run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from comparisons.measured import Columns
from quadcurv.viewing.figures import COLOURS, MARKERS, convergence_plot

__all__ = [
    "COLOURS",
    "LABELS",
    "MARKERS",
    "STYLES",
    "figure",
    "legend_below",
    "paper_style",
    "plot_errors",
    "save_figure",
]

SIZE = 9.0
"""Of all type in figures, in points."""

paper_style = mpl.rc_context(
    {
        "axes.axisbelow": True,
        "axes.grid": True,
        "axes.labelsize": SIZE,
        "axes.prop_cycle": cycler(color=COLOURS),
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlesize": SIZE,
        "axes.unicode_minus": True,
        "figure.constrained_layout.use": True,
        "figure.titlesize": SIZE,
        "font.size": SIZE,
        "grid.alpha": 0.3,
        "grid.linewidth": 0.5,
        "legend.fontsize": SIZE,
        "legend.framealpha": 0.9,
        "lines.linewidth": 1.3,
        "lines.markersize": 4.5,
        "mathtext.fontset": "dejavusans",
        "savefig.dpi": 200,
        "svg.hashsalt": "quadcurv",
        "xtick.labelsize": SIZE,
        "ytick.labelsize": SIZE,
    }
)
"""Decorator of functions that make and save figures: type and colours for print."""


def figure(
    rows: int = 1, columns: int = 1, size: tuple[float, float] = (5.2, 3.6), **keywords: Any
) -> tuple[Figure, Any]:
    """Figure of the given size in inches and its axes, or an array of them, without pyplot.

    Parameters
    ----------
    rows, columns, size
        Of the whole figure.
    **keywords
        As for `matplotlib.figure.Figure.subplots`.
    """
    fig = Figure(figsize=size)
    return fig, fig.subplots(rows, columns, **keywords)


def plot_errors(
    axes: Axes,
    columns: Columns,
    names: Iterable[str] | Mapping[str, str],
    window: tuple[float, float] | Mapping[str, tuple[float, float]] = {},
    rounding: tuple[ArrayLike, str] | None = None,
    styles: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Draw columns against n on logarithmic axes, fitted lines over a window of sizes.

    Parameters
    ----------
    axes : matplotlib axes
    columns : Columns
    names : iterable of str, or mapping to the labels
        The columns to draw.
    window : (first, last), or mapping from names to such
        Sizes to fit; one window serves all names.
    rounding, styles
        As for :func:`quadcurv.viewing.convergence_plot`, styles by name.
    """
    labels = dict(names) if isinstance(names, Mapping) else {name: name for name in names}
    windows = window if isinstance(window, Mapping) else dict.fromkeys(labels, window)
    convergence_plot(
        axes,
        columns["n"],
        {label: columns[name] for name, label in labels.items()},
        {labels[name]: span for name, span in windows.items()},
        rounding=rounding,
        styles={labels[name]: style for name, style in (styles or {}).items() if name in labels},
    )


def legend_below(fig: Figure, axes: Axes, columns: int = 2) -> None:
    """Move the legend of axes below the figure, off the data."""
    handles, labels = axes.get_legend_handles_labels()
    legend = axes.get_legend()
    if legend is not None:
        legend.remove()
    fig.legend(handles, labels, loc="outside lower center", ncols=columns, frameon=False)


def save_figure(fig: Figure, output: Path, stem: str) -> None:
    """Write output/stem.png (200 dpi) and .svg, the same on every run."""
    output.mkdir(parents=True, exist_ok=True)
    fig.savefig(output / f"{stem}.png", metadata={"Software": None})
    fig.set_layout_engine("none")  # laid out by now
    fig.savefig(output / f"{stem}.svg", metadata={"Date": None})


LABELS = {
    "finite_volume": "finite volume",
    "liu": "Liu",
    "bilinear": "bilinear, 2 x 2 points",
    "cotan-4": "cotan 4",
    "cotan-6": "cotan 6",
    "cotan-6'": "cotan 6, other diagonal",
    "cotan-8": "cotan 8",
    "cotan-4-voronoi": "cotan 4, Voronoi",
    "cotan-6-voronoi": "cotan 6, Voronoi",
    "cotan-8-voronoi": "cotan 8, Voronoi",
    "bunge": "Bunge",
    "de_goes": "de Goes",
    "alexa_wardetzky": "Alexa, Wardetzky",
    "jet-2": "jet of degree 2",
    "jet": "jet of degree 4",
}
"""Of the schemes, in the order they are drawn in: what lies under another is larger."""


def _marker(colour: int, marker: str, size: float = 4.5, hollow: bool = False) -> dict[str, Any]:
    return {
        "color": COLOURS[colour],
        "marker": marker,
        "markersize": size,
        "fillstyle": "none" if hollow else "full",
    }


STYLES = {
    "finite_volume": _marker(0, "o"),
    "liu": _marker(1, "s", 7.5, hollow=True),
    "bilinear": _marker(6, "x", 6),
    "cotan-4": _marker(4, "P", 5.5),
    "cotan-6": _marker(2, "^", 5.5),
    "cotan-6'": _marker(5, "v", 5.5),
    "cotan-8": _marker(3, "D"),
    "cotan-4-voronoi": _marker(4, "p", 8, hollow=True),
    "cotan-6-voronoi": _marker(2, "^", 9, hollow=True),
    "cotan-8-voronoi": _marker(3, "D", 7.5, hollow=True),
    "bunge": _marker(5, "*", 7),
    "de_goes": _marker(6, "h", 7.5, hollow=True),
    "alexa_wardetzky": _marker(1, "+", 7),
    "jet-2": _marker(5, "<", 5.5),
    "jet": _marker(6, ">", 5.5),
}
"""One colour and marker a scheme through all figures; what coincides is hollow around full."""
