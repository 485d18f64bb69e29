"""Maps of a comparison on the surface: one linked view a scheme, one colour bar for all."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from math import ceil, floor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadcurv.compare import Comparison
from quadcurv.mesh import Floats, Mesh, QuadGrid, QuadMesh

if TYPE_CHECKING:
    import pyvista as pv

FIELDS = ("mean_curvature", "error")
NAN_COLOUR = "#d0d0d0"
ZERO_COLOUR = "#ffffff"
_DECADES = 6


class NoOpenGLError(RuntimeError):
    """No OpenGL is usable for rendering; the message says what to install."""


@functools.cache
def opengl_problem() -> str | None:
    """Why pyvista cannot render here, None if it can.

    Probed once, in a process of its own: without a usable OpenGL library VTK ends the process.
    """
    probe = "import pyvista as pv; p = pv.Plotter(off_screen=True); p.add_mesh(pv.Plane()); p.screenshot()"
    run = subprocess.run([sys.executable, "-c", probe], capture_output=True, timeout=120, check=False)
    if run.returncode == 0:
        return None
    return (
        "no usable OpenGL: on Debian install libgl1, libegl1 and libopengl0 (a window also needs a display, "
        "such as that of xvfb-run)"
    )


def save_maps(comparison: Comparison, path: str | Path, field: str = "error") -> None:
    """Write the maps of :func:`maps` to a file.

    Parameters
    ----------
    comparison : Comparison
    path : path-like
        ``.png`` for a picture, which needs a usable OpenGL; ``.html`` for a page with linked views that
        needs none and no network.
    field : {"mean_curvature", "error"}
        See :func:`maps`.

    Raises
    ------
    NoOpenGLError
        A picture is asked for where nothing can render.
    ValueError
        Any other suffix, or an unknown field.
    """
    path = Path(path)
    if path.suffix not in (".png", ".html"):
        raise ValueError(f"path: expected a name ending in .png or .html, got {path.name}")
    problem = opengl_problem()
    if path.suffix == ".png" and problem:
        raise NoOpenGLError(problem)
    if problem:  # VTK then describes the scene without opening a context
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkOSOpenGLRenderWindow"
    plotter = maps(comparison, field)
    if path.suffix == ".png":
        plotter.screenshot(path)
    else:
        plotter.trame.export_html(path)
    plotter.close()


def maps(comparison: Comparison, field: str = "error", off_screen: bool = True) -> pv.Plotter:
    """Scene with one linked view a scheme and one colour bar.

    Parameters
    ----------
    comparison : Comparison
    field : {"mean_curvature", "error"}
        Signed H on a diverging scale that ends at the 99th percentile of |H|; or |H - exact| (without an
        exact answer the difference to the median of the schemes) on a logarithmic scale of whole decades.
        NaN is grey; in error maps what is exactly 0 is white.
    off_screen : bool
        Whether the scene is for a file rather than a window.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError
        Unknown field.
    """
    import pyvista as pv

    if field not in FIELDS:
        raise ValueError(f"field: expected one of {FIELDS}, got {field!r}")
    scale = _signed_scale if field == "mean_curvature" else _decades
    values, title, mapper = scale(comparison)
    columns = min(4, len(values))
    rows = ceil(len(values) / columns)
    plotter = pv.Plotter(
        shape=(rows + 1, columns),
        row_weights=[1.0] * rows + [0.3],
        groups=[(rows, slice(None))],
        border=False,
        off_screen=off_screen,
        window_size=(400 * columns, 400 * rows + 120),
    )
    plotter.set_background("white")
    surface, on_cells = _surface(comparison.mesh)
    for i, (name, value) in enumerate(values.items()):
        plotter.subplot(*divmod(i, columns))
        panel = surface.copy(deep=False)
        (panel.cell_data if on_cells else panel.point_data)[name] = value.ravel()
        plotter.add_mesh(
            panel,
            scalars=name,
            lighting=False,
            show_edges=panel.n_cells < 20_000,
            edge_opacity=0.25,
            nan_color=NAN_COLOUR,
            show_scalar_bar=False,
            **mapper,
        )
        plotter.add_text(name, position="upper_edge", font_size=11, color="black", shadow=False)
    plotter.link_views(list(range(len(values))))
    plotter.subplot(0, 0)
    plotter.view_isometric()
    plotter.camera.zoom(1.15)
    plotter.subplot(rows, 0)
    _colour_bar(plotter, title, mapper, field)
    return plotter


def _signed_scale(comparison: Comparison) -> tuple[dict[str, Floats], str, dict[str, Any]]:
    H = dict(comparison.mean_curvature)
    known = np.concatenate([h[np.isfinite(h)] for h in H.values()])
    end = float(np.percentile(np.abs(known), 99)) if known.size else 1.0
    return H, "mean curvature H (1/length)", {"cmap": "RdBu_r", "clim": (-(end or 1.0), end or 1.0)}


def _decades(comparison: Comparison) -> tuple[dict[str, Floats], str, dict[str, Any]]:
    with np.errstate(divide="ignore"):
        logs = {name: np.log10(np.abs(e)) for name, e in comparison.errors.items()}
    known = np.concatenate([e[np.isfinite(e)] for e in logs.values()])
    high = ceil(known.max()) if known.size else 0
    low = floor(np.percentile(known, 1)) if known.size else -1
    low = min(max(low, high - _DECADES), high - 1)
    title = "error |H - exact| (1/length)"
    if comparison.exact is None:
        title = "difference to the median of the schemes |H - median| (1/length)"
    mapper = {"cmap": "viridis", "clim": (low, high), "below_color": ZERO_COLOUR}
    return {k: np.maximum(e, low) if (e > -np.inf).all() else e for k, e in logs.items()}, title, mapper


def _surface(mesh: Mesh) -> tuple[pv.PolyData, bool]:
    """Surface to paint, and whether its values live on its cells (of a staggered grid) or its points."""
    import pyvista as pv

    if isinstance(mesh, QuadMesh | QuadGrid):
        stencils = mesh.stencils()
        points, faces, on_cells = stencils.points, stencils.faces, False
    else:
        grid = QuadGrid(mesh.dual).stencils()
        points, faces, on_cells = grid.points, grid.faces, True
    quads = faces[:, 3] >= 0
    polygons = np.concatenate(
        (
            np.insert(faces[quads], 0, 4, axis=1).ravel(),
            np.insert(faces[~quads, :3], 0, 3, axis=1).ravel(),
        )
    )
    return pv.PolyData(np.array(points), polygons), on_cells


def _colour_bar(plotter: pv.Plotter, title: str, mapper: dict[str, Any], field: str) -> None:
    """Alone in the current view: of a point too small to be seen."""
    import pyvista as pv

    low, high = mapper["clim"]
    dot = pv.PolyData(np.zeros((2, 3)))
    dot["scale"] = np.array([low, high], float)
    plotter.add_mesh(dot, scalars="scale", opacity=0.0, point_size=1, show_scalar_bar=False, **mapper)
    bar = plotter.add_scalar_bar(
        title=title,
        n_labels=(int(high - low) + 1) if field == "error" else 5,
        fmt="1e%.0f" if field == "error" else "%.3g",
        title_font_size=20,
        label_font_size=18,
        color="black",
        width=0.7,
        height=0.75,
        position_x=0.15,
        position_y=0.1,
        vertical=False,
    )
    bar.SetUnconstrainedFontSize(True)
