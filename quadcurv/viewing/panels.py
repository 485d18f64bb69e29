"""Values on several surfaces side by side in one figure, for papers: what the maps of comparisons are not."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import ArrayLike, NDArray

from quadcurv.mesh import Mesh
from quadcurv.types import Floats
from quadcurv.viewing.geometry import drawn
from quadcurv.viewing.opengl import NoOpenGLError, opengl_problem
from quadcurv.viewing.scale import NAN_COLOUR
from quadcurv.viewing.scene import polydata, surface_style

_COLOURS = "viridis"
_PIXELS = 1400
# Inches: beside a panel, of the colour bar, of titles, of the whole figure at least.
_GAP, _BAR, _HEADING, _NARROW = 0.15, 0.95, 0.35, 2.0
_MANY = 20_000  # faces, beyond which edges cannot be told apart


def surfaces_figure(
    panels: Mapping[str, tuple[Mesh, ArrayLike]],
    label: str = "",
    decades: tuple[int, int] | None = None,
    camera: tuple[float, float, float] = (1.0, 1.0, 0.7),
    height: float = 3.2,
) -> Figure:
    """Paint values on surfaces side by side, all at one size and on one colour scale.

    Parameters
    ----------
    panels : mapping from title to (mesh, values)
        Values at the vertices of the mesh, or in the cells of a staggered grid. NaN is grey.
    label : str
        Of the colour bar.
    decades : (low, high), optional
        Powers of ten at the ends of the logarithmic scale. Without them values only show the shape: lit,
        on a linear scale, without a bar.
    camera : (x, y, z)
        Direction from the surface to the viewer; z is up.
    height : float
        Of the tallest panel in inches; lengths have one scale in all of them.

    Returns
    -------
    matplotlib.figure.Figure

    Raises
    ------
    NoOpenGLError
        Nothing can render here.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import surfaces_figure
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> panels = {"jet": (ball, abs(qc.mean_curvature(ball) - 1))}
    >>> surfaces_figure(panels, "error", (-4, -1)).savefig("error.png")  # doctest: +SKIP
    """
    problem = opengl_problem()
    if problem:
        raise NoOpenGLError(problem)
    values = {title: np.ravel(np.asarray(given, float)) for title, (_, given) in panels.items()}
    view = _axes_of(camera)
    extent = max(np.ptp(drawn(mesh).points @ view[:2].T, axis=0).max() / 2 for mesh, _ in panels.values())
    images = [_picture(mesh, values[title], decades, view, extent) for title, (mesh, _) in panels.items()]
    rows = max(image.shape[0] for image in images)
    widths = [image.shape[1] * height / rows + _GAP for image in images]
    figure = Figure(figsize=(max(sum(widths) + _BAR * (decades is not None), _NARROW), height + _HEADING))
    axes = figure.subplots(1, len(images), width_ratios=widths, squeeze=False)
    for ax, title, image in zip(axes.flat, panels, images, strict=True):
        ax.imshow(image, interpolation="antialiased")
        middle = image.shape[0] / 2
        ax.set(title=title, ylim=(middle + rows / 2, middle - rows / 2))
        ax.axis("off")
    if decades is not None:
        low, high = (10.0**power for power in decades)
        known = np.concatenate(list(values.values()))
        ends = {(True, True): "both", (True, False): "min", (False, True): "max"}
        extend = ends.get((bool((known < low).any()), bool((known > high).any())), "neither")
        scale = ScalarMappable(LogNorm(low, high), _COLOURS)
        figure.colorbar(scale, ax=axes, label=label, extend=extend, shrink=0.85, aspect=25, pad=0.03)
    return figure


def _axes_of(camera: tuple[float, float, float]) -> Floats:
    """Axes of the picture (3, 3): across, up and towards the viewer, z being up."""
    towards = np.array(camera) / np.linalg.norm(camera)
    across = np.cross((0, 0, 1), towards)
    across /= np.linalg.norm(across)
    return np.stack((across, np.cross(towards, across), towards))


def _picture(
    mesh: Mesh, values: Floats, decades: tuple[int, int] | None, view: Floats, extent: float
) -> NDArray[np.uint8]:
    """Painted surface, without the empty margin; edges are drawn where they can be told apart.

    `extent` is half the length that the picture's side shows.
    """
    import pyvista as pv

    points, faces, on_cells = drawn(mesh)
    surface = polydata(np.array(points), faces)
    style: dict[str, Any] = {"smooth_shading": True, **surface_style(shading=True)}
    if not np.isfinite(values).any():
        style["clim"] = 0, 1
    if decades is not None:
        values = np.log10(np.maximum(values, 10.0 ** decades[0]))
        style = {"clim": decades, **surface_style()}
    (surface.cell_data if on_cells else surface.point_data)["value"] = values
    with pv.vtk_verbosity("off"):  # it would warn of every way to draw that it tries in vain
        plotter: Any = pv.Plotter(off_screen=True, window_size=[_PIXELS, _PIXELS])
        plotter.enable_parallel_projection()
        plotter.enable_anti_aliasing("msaa")
        plotter.add_mesh(
            surface,
            scalars="value",
            cmap=_COLOURS,
            show_edges=surface.n_cells <= _MANY,
            nan_color=NAN_COLOUR,
            show_scalar_bar=False,
            **style,
        )
        flat = points @ view.T
        centre = (flat.max(axis=0) + flat.min(axis=0)) / 2 @ view
        plotter.camera_position = (centre + 4 * extent * view[2], centre, view[1])
        plotter.camera.parallel_scale = 1.02 * extent
        plotter.reset_camera_clipping_range()
        image = np.asarray(plotter.screenshot(transparent_background=True, return_img=True))
        plotter.close()
    rows, columns = (np.flatnonzero(image[..., 3].any(axis=axis)) for axis in (1, 0))
    return image[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
