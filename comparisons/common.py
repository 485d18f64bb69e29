"""What the comparison scripts share: figures, tables, claims and the command line."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.figure import Figure
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table

from quadcurv import tables, viewing
from quadcurv.comparison import Comparison
from quadcurv.curvature import dual_areas
from quadcurv.mesh import Mesh
from quadcurv.viewing.figures import COLOURS
from quadcurv.viewing.figures import MARKERS as MARKERS
from quadcurv.viewing.figures import convergence_plot as convergence_plot

MAP = "viridis"
OUTPUT = Path(__file__).parent / "output"

paper_style = mpl.rc_context(
    {
        "axes.axisbelow": True,
        "axes.grid": True,
        "axes.prop_cycle": cycler(color=COLOURS),
        "axes.spines.right": False,
        "axes.spines.top": False,
        "axes.titlesize": 10,
        "figure.constrained_layout.use": True,
        "font.size": 9.5,
        "grid.alpha": 0.3,
        "grid.linewidth": 0.5,
        "legend.fontsize": 8.5,
        "legend.framealpha": 0.9,
        "lines.linewidth": 1.3,
        "lines.markersize": 4.5,
        "savefig.dpi": 200,
        "svg.hashsalt": "quadcurv",
    }
)
"""Decorator of functions that make and save figures: type and colours for print."""

Verdict = Literal["reproduced", "reproduced only if ...", "not reproduced", "slip"]


@dataclass(frozen=True)
class Claim:
    """A claim of the thesis beside what was measured.

    Attributes
    ----------
    where : str
        Section, equation or figure.
    claim, measured : str
        What is printed there, and what comes out.
    verdict : str
        "reproduced", "reproduced only if ...", "not reproduced" or "slip".
    """

    where: str
    claim: str
    measured: str
    verdict: Verdict


def print_claims(claims: Sequence[Claim], title: str, console: Console | None = None) -> None:
    """Print claims as a table."""
    styles = {"reproduced": "green", "not reproduced": "red"}
    table = Table(*(f.name for f in fields(Claim)), title=title, show_lines=True)
    for c in claims:
        table.add_row(*astuple(c), style=styles.get(c.verdict, "yellow"))
    (console or Console()).print(table)


def claims_markdown(claims: Sequence[Claim]) -> str:
    """Claims as a Markdown table."""
    names = [f.name for f in fields(Claim)]
    cells = [[cell.replace("|", "\\|") for cell in astuple(c)] for c in claims]
    rows = [names, ["---"] * len(names), *cells]
    return "".join(f"| {' | '.join(row)} |\n" for row in rows)


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


def save_figure(fig: Figure, output: Path, stem: str, columns: Mapping[str, ArrayLike] | None = None) -> None:
    """Write output/stem.png (200 dpi) and .svg, and the data they show, in columns, to stem.csv."""
    output.mkdir(parents=True, exist_ok=True)
    fig.savefig(output / f"{stem}.png", metadata={"Software": None})
    fig.set_layout_engine("none")  # laid out by now
    fig.savefig(output / f"{stem}.svg", metadata={"Date": None})
    if columns is not None:
        write_csv(output, stem, columns)


def write_csv(output: Path, stem: str, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of one length to output/stem.csv, in full precision."""
    output.mkdir(parents=True, exist_ok=True)
    tables.write_csv(output / f"{stem}.csv", columns)


def below(value: float, power: int) -> str:
    """Rounding as its bound, "below 1e-power", which no machine changes; a value above it as it is."""
    return f"below 1e-{power}" if value < 10.0**-power else f"{value:.1e}"


def save_maps(
    output: Path,
    stem: str,
    panels: Mapping[str, tuple[Mesh, ArrayLike]],
    label: str = "",
    decades: tuple[int, int] | None = None,
    camera: tuple[float, float, float] = (1.0, 1.0, 0.7),
    height: float = 3.2,
) -> str | None:
    """Paint values on surfaces side by side, on one scale: output/stem.png, .svg and .csv.

    Where nothing can render, pages output/stem_1.html, ..., each on a scale of its own, take the place
    of the pictures.

    Parameters
    ----------
    output, stem
        As for `save_figure`.
    panels : mapping from title to (mesh, values)
        Values at the vertices of the mesh, or in the cells of a staggered grid. NaN is grey.
    label : str
        Of the colour bar.
    decades : (low, high), optional
        Powers of ten at the ends of the logarithmic scale. Without them values only show the shape: lit,
        on a linear scale, without a bar.
    camera : (x, y, z)
        Direction from the surface to the viewer.
    height : float
        Of the figure in inches; the panels give its width.

    Returns
    -------
    str or None
        Why nothing can render, if so.
    """
    output.mkdir(parents=True, exist_ok=True)
    table = [
        (title, *x, v)
        for title, (mesh, values) in panels.items()
        for x, v in zip(mesh.stencils().points, np.ravel(values).tolist(), strict=False)
    ]
    header = ("panel", "x", "y", "z", "value")
    write_csv(output, stem, dict(zip(header, zip(*table, strict=True), strict=True)))
    problem = viewing.opengl_problem()
    if problem:
        for i, (title, (mesh, values)) in enumerate(panels.items(), 1):
            viewing.save_maps(_as_error(mesh, title, values), output / f"{stem}_{i}.html")
        return problem
    save_figure(viewing.surfaces_figure(panels, label, decades, camera, height), output, stem)
    return None


def _as_error(mesh: Mesh, title: str, values: ArrayLike) -> Comparison:
    """Comparison whose errors are the given values."""
    stencils = mesh.stencils()
    e = np.reshape(values, stencils.shape)
    valence = stencils.valence.reshape(stencils.shape)
    return Comparison(mesh, {title: e}, np.zeros(stencils.shape), dual_areas(mesh, "liu"), valence)


def arguments(description: str | None) -> argparse.Namespace:
    """Command line of a comparison script: output (folder) and quick (bool)."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder for figures and tables")
    parser.add_argument("--quick", action="store_true", help="smaller sizes, a few seconds")
    return parser.parse_args()
