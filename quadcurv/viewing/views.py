"""Linked views of a comparison, one a scheme, with one colour bar for all: in a window or for a picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, sqrt
from typing import TYPE_CHECKING, Any

import numpy as np

from quadcurv.comparison import Comparison
from quadcurv.extras import need
from quadcurv.types import Ints
from quadcurv.viewing.fields import Fields
from quadcurv.viewing.geometry import OVERLAYS
from quadcurv.viewing.marks import Drawing, Marks
from quadcurv.viewing.scale import Field
from quadcurv.viewing.scene import (
    Scene,
    colour_by,
    fitted_scale,
    look_at,
    lookup_table,
    make_room,
    polydata,
    surface_style,
)
from quadcurv.viewing.style import Style

if TYPE_CHECKING:
    import pyvista as pv

PANEL, HEADING, LEGEND, CONTROLS = 400, 44, 120, 95  # pixels: side of a view, heights of the rows around
SCREEN = 1600, 700  # pixels that the views of a window may take
VALUES = "values"  # name of the coloured array
_SCALE = 1.5  # pixels of a picture to one of a window
_LEAST = 0.75  # scale, below which letters cannot be read
_LARGE = 20_000  # faces; beyond that edges hide the colours, and a window draws what turns coarsely
_COARSE = 32  # cells of a coarse surface along the longest side
RING_COLOUR = "#cc3399"


class View:
    """Linked views of a comparison, one a scheme, with one colour bar.

    Parameters
    ----------
    comparison : Comparison
    field : str
        One of :attr:`quadcurv.viewing.Fields.names`.
    style : Style
    off_screen : bool
        Whether the scene is for a file rather than a window, which has a row for controls.
    refined : callable, optional
        Comparison at a refinement level 0 to 5, for a slider; `comparison` is that of level 2.

    Attributes
    ----------
    plotter : pyvista.Plotter
    comparison : Comparison
    field : str
    picked : int or None
        Vertex, or cell of a staggered grid, in the order of flattened results.
    shown : set of str
        What is drawn over the surface, of "edges", "overlays", "normals", "directions" and "histogram".
    views : list of str
        Titles of the views: the schemes, or the field's own name where no scheme enters it.

    Raises
    ------
    ValueError
        Unknown field; limits of the style that do not fit its scale.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import View
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> view = View(qc.compare(ball, "jet"), off_screen=True)  # doctest: +SKIP
    >>> view.plotter.screenshot("H.png")  # doctest: +SKIP
    """

    LEVELS = 6
    START = 2

    def __init__(
        self,
        comparison: Comparison,
        field: str = "mean_curvature",
        style: Style | None = None,
        off_screen: bool = False,
        refined: Callable[[int], Comparison] | None = None,
    ) -> None:
        need("pyvista", "matplotlib")
        self.picked: int | None = None
        self.shown: set[str] = set()
        self.style = style or Style()
        self.refined = refined
        self.level = self.START
        self._first = field
        self._drawn: dict[str, list[tuple[Any, Any]]] = {}
        self._fields = Fields(comparison)
        self._show(field)  # refuses an unknown one before there is a window
        self._lay_out(off_screen)
        self._table = lookup_table(self._shown)
        self._add_surfaces()
        self._arrange()
        self.reset_camera()
        self._recolour()
        if len(self._fields.drawn.faces) < _LARGE:
            self.toggle("edges")

    @property
    def comparison(self) -> Comparison:
        """What is seen."""
        return self._fields.comparison

    @property
    def names(self) -> list[str]:
        """Fields to choose from."""
        return self._fields.names

    @property
    def views(self) -> list[str]:
        """Titles of the views."""
        return list(self._shown.values)

    def show_field(self, name: str) -> None:
        """Colour all views by another field.

        Raises
        ------
        ValueError
            Unknown field.
        """
        for what in self.shown - {"edges", "histogram"}:
            self._clear(what)
        before = fitted_scale(self._half, self._aspect)
        self._show(name)
        self._arrange()
        self._camera.parallel_scale *= fitted_scale(self._half, self._aspect) / before
        self._recolour()
        for what in self.shown - {"edges", "histogram"}:
            self._redraw(what)

    def next_field(self, step: int = 1) -> None:
        """Colour all views by the next field, after the last one the first again."""
        self.show_field(self.names[(self.names.index(self.field) + step) % len(self.names)])
        self.plotter.render()

    def toggle(self, what: str) -> None:
        """Draw or remove "edges", "overlays", "normals" (of mean curvature), "directions" (principal) or
        "histogram" (of the colours, by area).
        """
        self.shown ^= {what}
        if what == "edges":
            for actor in self._surfaces:
                actor.prop.show_edges = what in self.shown
        else:
            self._redraw(what)
        if what == "histogram":
            make_room(self._camera, what in self.shown)
        self._add_legend()
        self.plotter.render()

    def refine(self, level: float) -> None:
        """Show the comparison at another refinement level, 0 to 5."""
        if self.refined is None or round(level) == self.level:
            return
        self.level = round(level)
        self._fields = Fields(self.refined(self.level))
        self.picked = None
        self._add_surfaces()
        self.show_field(self.field)
        self.write_below(f"refinement {self.level}", (0.86, 0.12), 6, name="refinement")
        self.plotter.render()

    def pick(self, x: int, y: int) -> None:
        """Choose the vertex, or cell of a staggered grid, seen at a pixel; none beside the surface.

        Parameters
        ----------
        x, y : int
            From the lower left corner of the window.
        """
        from vtkmodules.vtkRenderingCore import vtkCellPicker

        picker = vtkCellPicker()
        picker.SetTolerance(0)
        renderer = self.plotter.iren.interactor.FindPokedRenderer(x, y)
        hit = picker.Pick(x, y, 0, renderer) and picker.GetActor() in self._surfaces
        self.picked = None
        if hit:
            points, faces, on_cells = self._fields.drawn
            face = faces[picker.GetCellId()]
            corners = face[face >= 0]
            distance = np.linalg.norm(points[corners] - picker.GetPickPosition(), axis=1)
            self.picked = picker.GetCellId() if on_cells else int(corners[distance.argmin()])
        self._report()
        self.plotter.render()

    def turn_coarse(self, coarse: bool) -> None:
        """Draw a large surface coarsely, as while it is turned, or whole again."""
        if not self._coarse:
            return
        for mapper, panel in zip(self._mappers, self._coarse if coarse else self._panels, strict=True):
            mapper.dataset = panel
        self.plotter.render()

    def reset_camera(self) -> None:
        """Fit the surface into the views."""
        points, turned = self._fields.drawn.points, not self.plotter.off_screen
        self._half = look_at(self._camera, points, self.style.camera, self._aspect, turned)
        if "histogram" in self.shown:
            make_room(self._camera, True)

    def write_below(self, text: str, position: tuple[float, float], size: float, name: str) -> None:
        """Write into the row of the controls, in letters that do not depend on the window's size."""
        self.plotter.subplot(self.control_row, 0)
        self._scene.text(text, position, size / self._scene.scale, name=name)

    def _show(self, name: str) -> None:
        shown = self._fields.field(name)
        self._shown: Field = self.style.applied(shown) if name == self._first else shown
        self.field = name

    def _recolour(self) -> None:
        colour_by(self._table, self._shown)
        for i, view in enumerate(self.views):
            values = self._shown.coloured(view)
            self._panels[i][VALUES] = values
            if self._coarse:
                self._coarse[i][VALUES] = values[self._nearest]
            self._mappers[i].scalar_range = self._shown.limits
        self._add_legend()
        self._redraw("histogram")
        self._report()

    @property
    def _camera(self) -> pv.Camera:
        """The one that all views share."""
        return self.plotter.renderers[self._heads].camera

    def _lay_out(self, off_screen: bool) -> None:
        """Rows for the heading, if there is one, the views, the legend and, in a window, the controls.

        A picture is as large as its own field needs.
        """
        import pyvista as pv

        panels = len(self.comparison.schemes)
        views = len(self.views) if off_screen else panels
        self._heads = int(self.style.title is not None)
        around, controls = HEADING * self._heads + LEGEND, CONTROLS * (not off_screen)
        if self.style.size is None:
            rows = max(1, round(sqrt(views / 2)))  # twice as wide as high
            width, height = PANEL * max(ceil(views / rows), 2), PANEL * rows
            scale = _SCALE if off_screen else min(1.0, SCREEN[0] / width, SCREEN[1] / height)
            size = [int(width * scale), int((height + around) * scale) + controls]
        else:
            size = [int(pixels) for pixels in self.style.size]
            high = max(size[1] - controls, 50)

            def scaled(rows: int) -> float:
                wide = PANEL * max(ceil(views / rows), 2)
                return min(size[0] / wide, high / (PANEL * rows + around))

            scale = max(_LEAST, *map(scaled, range(1, views + 1)))
        self._area = size[0], size[1] - controls - around * scale  # pixels of all views
        rows, self._columns = _grid(panels, self._area)
        heights = [HEADING * scale] * self._heads + [self._area[1] / rows] * rows + [LEGEND * scale]
        heights += [controls] * (not off_screen)
        self._edge = 1 - heights[0] / size[1] if self._heads else 1.0  # upper, of the area, to the window
        self.legend_row = self._heads + rows
        self.control_row = self.legend_row + 1
        across = [*range(self._heads), *range(self.legend_row, len(heights))]
        groups: Any = [(row, slice(None)) for row in across]
        self.plotter: Any = pv.Plotter(
            shape=(len(heights), self._columns),
            row_weights=[round(height) for height in heights],
            groups=groups,
            border=False,
            off_screen=off_screen,
            window_size=size,
            title="quadcurv",
        )
        self.plotter.set_background("white")  # type: ignore[arg-type]  # self is hidden by a decorator
        self._scene = Scene(self.plotter, scale)
        self._cells = range(self._heads, self._heads + rows * self._columns)
        self.plotter.link_views(list(self._cells[:panels]))
        if self.style.title is not None:
            self.plotter.subplot(0, 0)
            self._scene.text(self.style.title, (0.5, 0.45), 13)

    def _arrange(self) -> None:
        """Give the views of the field the whole area; empty places are drawn, too, or they were black."""
        rows, columns = _grid(len(self.views), self._area)
        self._aspect = self._area[0] / columns / (self._area[1] / rows)
        wide, high = 1 / columns, self._area[1] / self.plotter.window_size[1] / rows
        for i, cell in enumerate(self._cells):
            renderer, seen = self.plotter.renderers[cell], i < len(self.views)
            for prop in renderer.GetViewProps():
                prop.SetVisibility(seen)
            renderer.SetInteractive(seen)
            renderer.SetDraw(i < rows * columns)
            row, column = divmod(i, columns)
            if row < rows:
                left, top = column * wide, self._edge - row * high
                renderer.viewport = left, top - high, left + wide, top

    def _subplot(self, i: int) -> None:
        row, column = divmod(i, self._columns)
        self.plotter.subplot(self._heads + row, column)

    def _add_surfaces(self) -> None:
        points, faces, _ = self._fields.drawn
        self._marks = Marks(self._fields, self._scene.scale)
        surface = polydata(points, faces)
        surface[VALUES] = np.zeros(self.comparison.valence.size)
        if self.style.shading:  # smoothly
            surface.compute_normals(
                cell_normals=False, split_vertices=False, consistent_normals=False, inplace=True
            )
            surface.point_data.active_normals_name = "Normals"
        self._panels, self._surfaces, self._mappers, self._coarse = [], [], [], []
        if large := len(faces) > _LARGE and not self.plotter.off_screen:
            self.plotter.disable_anti_aliasing()
            coarse, self._nearest = self._coarser(surface)
        for i in range(len(self.comparison.schemes)):
            self._subplot(i)
            panel = surface.copy(deep=False)
            actor = self.plotter.add_mesh(
                panel,
                scalars=VALUES,
                cmap=self._table,
                show_edges="edges" in self.shown,
                line_width=self._scene.scale,
                show_scalar_bar=False,
                reset_camera=False,
                name="surface",
                render=False,
                **surface_style(self.style.shading),
            )
            if self.style.shading:
                actor.prop.interpolation = "Phong"
            self._panels.append(panel)
            if large:
                self._coarse.append(coarse.copy(deep=False))
            self._surfaces.append(actor)
            self._mappers.append(actor.mapper)

    def _coarser(self, surface: pv.PolyData) -> tuple[pv.PolyData, Ints]:
        """Surface of fewer cells, and the vertex or cell nearest to each of its points or cells."""
        import pyvista as pv
        from scipy.spatial import cKDTree
        from vtkmodules.vtkFiltersCore import vtkQuadricClustering

        cluster = vtkQuadricClustering()
        cluster.SetInputData(surface.triangulate())
        cluster.SetNumberOfDivisions(_COARSE, _COARSE, _COARSE)
        cluster.Update()
        coarse = pv.PolyData(cluster.GetOutput())
        places = coarse.cell_centers().points if self._fields.drawn.on_cells else coarse.points
        return coarse, cKDTree(self._marks.sites).query(places)[1]

    def _redraw(self, what: str) -> None:
        """Bring what lies over the surface up to date."""
        self._clear(what)
        if what not in self.shown:
            return
        if what == "histogram":
            self._add_histograms()
            return
        draw: Callable[[str], Iterator[Drawing]] = getattr(self._marks, what)
        for i, view in enumerate(self.views):
            self._subplot(i)
            for mesh, style in draw(view):
                self._draw(what, mesh, **style)

    def _draw(self, what: str, mesh: pv.PolyData, **style: Any) -> None:
        actor = self._scene.draw(mesh, **style)
        self._drawn.setdefault(what, []).append((self.plotter.renderer, actor))

    def _clear(self, what: str) -> None:
        for renderer, actor in self._drawn.pop(what, []):
            renderer.remove_actor(actor, render=False)

    def _add_histograms(self) -> None:
        """Under each surface how much of the area has which colour; the scale across is the colour bar's."""
        parts = [self._shown.histogram(view, self.comparison.areas) for view in self.views]
        highest = max(p.max() for p in parts) or 1.0
        for i, part in enumerate(parts):
            self._subplot(i)
            bars = self._scene.histogram(part, highest, self._table)
            self._drawn.setdefault("histogram", []).extend((self.plotter.renderer, bar) for bar in bars)

    def _report(self) -> None:
        """Titles with the values at the picked vertex, and its ring on the surfaces."""
        import pyvista as pv

        points, faces, on_cells = self._fields.drawn
        self._clear("picked")
        for i, view in enumerate(self.views):
            self._subplot(i)
            value = (
                "" if self.picked is None else f": {self._shown.text(self._shown.values[view][self.picked])}"
            )
            self._scene.text(view + value, (0.5, 0.95), 12, name="title")
            if self.picked is None:
                continue
            rows = [self.picked] if on_cells else (faces == self.picked).any(axis=1)
            ring, line = polydata(points, faces[rows]), 4 * self._scene.scale
            self._draw("picked", ring, style="wireframe", color=RING_COLOUR, line_width=line)
            dot = pv.PolyData(self._marks.sites[[self.picked]])
            self._draw("picked", dot, color="black", point_size=9 * self._scene.scale)
        if not self.plotter.off_screen:
            what = "click on the surface for values"
            if self.picked is not None:
                kind = "cell" if on_cells else "vertex"
                what = f"{kind} {self.picked}, valence {self.comparison.valence.ravel()[self.picked]}"
            self.write_below(what, (0.5, 0.85), 9, name="picked")

    def _add_legend(self) -> None:
        marks = [(name, OVERLAYS[name]) for name in self._fields.overlays] if "overlays" in self.shown else []
        self.plotter.subplot(self.legend_row, 0)
        self._scene.legend(self._shown, self._table, marks)


def _grid(n: int, area: tuple[float, float]) -> tuple[int, int]:
    """Rows and columns of n views, as large as the area lets them be."""
    return max(
        ((rows, ceil(n / rows)) for rows in range(1, n + 1)),
        key=lambda shape: min(area[0] / shape[1], area[1] / shape[0]),
    )
