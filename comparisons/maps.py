"""Maps for print: values painted on surfaces side by side, all at one size and on one colour scale."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from comparisons.figures import save_figure
from quadcurv import viewing
from quadcurv.comparison import Comparison
from quadcurv.mesh import Mesh
from quadcurv.operators import dual_areas
from quadcurv.tables import write_csv


@dataclass(frozen=True)
class Maps:
    """Surfaces to paint.

    Attributes
    ----------
    panels : dict of str to (mesh, values)
        By title; values at the vertices of the mesh, or in the cells of a staggered grid. NaN is grey.
    label : str
        Of the colour bar.
    decades : (low, high), optional
        Powers of ten at the ends of the logarithmic scale. Without them values only show the shape: lit,
        on a linear scale, without a bar.
    camera : (x, y, z)
        Direction from the surface to the viewer.
    height : float
        Of the tallest panel in inches; all have one scale, so that sizes can be compared.
    """

    panels: Mapping[str, tuple[Mesh, ArrayLike]]
    label: str = ""
    decades: tuple[int, int] | None = None
    camera: tuple[float, float, float] = (1.0, 1.0, 0.7)
    height: float = 2.8


def save_maps(maps: Maps, output: Path, stem: str) -> str | None:
    """Write output/stem.png, .svg and .csv, or pages stem_1.html, ... where nothing can render.

    Returns
    -------
    str or None
        Why nothing can render, if so.
    """
    output.mkdir(parents=True, exist_ok=True)
    _save_values(maps, output / f"{stem}.csv")
    problem = viewing.opengl_problem()
    if problem:
        for i, (title, (mesh, values)) in enumerate(maps.panels.items(), 1):
            viewing.save_maps(_as_error(mesh, title, values), output / f"{stem}_{i}.html")
        return problem
    fig = viewing.surfaces_figure(maps.panels, maps.label, maps.decades, maps.camera, maps.height)
    save_figure(fig, output, stem)
    return None


def _save_values(maps: Maps, path: Path) -> None:
    panels, points, values = [], [], []
    for title, (mesh, field) in maps.panels.items():
        flat = np.ravel(field)
        panels += [title] * len(flat)
        points.append(mesh.stencils().points[: len(flat)])
        values.append(flat)
    write_csv(path, {"panel": panels, "": np.concatenate(points), "value": np.concatenate(values)})


def _as_error(mesh: Mesh, title: str, values: ArrayLike) -> Comparison:
    """Comparison whose errors are the given values."""
    stencils = mesh.stencils()
    e = np.reshape(values, stencils.shape)
    valence = stencils.valence.reshape(stencils.shape)
    return Comparison(mesh, {title: e}, np.zeros(stencils.shape), dual_areas(mesh, "liu"), valence)
