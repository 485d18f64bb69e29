"""Maps of a comparison on the surface: one linked view a scheme, one colour bar for all."""

from __future__ import annotations

import functools
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from math import ceil, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.comparison import Comparison
from quadcurv.curvature import vertex_normals
from quadcurv.types import Floats, Ints
from quadcurv.viewing import fields
from quadcurv.viewing.fields import NAN_COLOUR, OVERLAYS, ZERO_COLOUR
from quadcurv.viewing.page import save_page

if TYPE_CHECKING:
    import pyvista as pv
    from vtkmodules.vtkRenderingCore import vtkActor2D

PANEL, LEGEND, CONTROLS = 400, 120, 95  # pixels: side of a view, heights of the rows below
SCREEN = 1600, 700  # pixels that the views of a window may take
VALUES = "values"  # name of the coloured array
_SCALE = 1.5  # pixels of a picture to one of a window
_LARGE = 20_000  # faces; beyond that edges hide the colours, and a window draws what turns coarsely
_COARSE = 32  # cells of a coarse surface along the longest side
_HISTOGRAM = 0.1  # height of a histogram to that of a view
RING_COLOUR = "#cc3399"


Drawing = tuple["pv.PolyData", dict[str, Any]]  # and its style


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
    return "no usable OpenGL: on Debian install libgl1, libegl1 and libopengl0"


def window_problem() -> str | None:
    """Why no window can be opened here, None if one can."""
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        return "no display to open a window on (DISPLAY is not set)"
    return opengl_problem()


def save_maps(comparison: Comparison, path: str | Path, field: str = "error") -> None:
    """Write maps to a file: one linked view a scheme, one colour bar for all.

    Parameters
    ----------
    comparison : Comparison
    path : path-like
        ``.png`` for a picture, which needs a usable OpenGL; ``.html`` for a page with linked views that
        needs none and no network.
    field : str
        One of :func:`quadcurv.viewing.fields.names`.

    Raises
    ------
    NoOpenGLError
        A picture is asked for where nothing can render.
    ValueError
        Any other suffix, or an unknown field.
    """
    path = Path(path)
    if path.suffix == ".html":
        save_page(comparison, path, field)
    elif path.suffix == ".png":
        problem = opengl_problem()
        if problem:
            raise NoOpenGLError(problem)
        import pyvista as pv

        with pv.vtk_verbosity("off"):  # it would warn of every way to draw that it tries in vain
            plotter = maps(comparison, field)
            plotter.screenshot(path)
            plotter.close()
    else:
        raise ValueError(f"path: expected a name ending in .png or .html, got {path.name}")


def maps(comparison: Comparison, field: str = "error") -> pv.Plotter:
    """Scene for a file, with one linked view a scheme and one colour bar.

    Signed fields have a diverging scale, its ends passed on 5 % of the area; errors a logarithmic one of
    whole decades. NaN is grey; in errors what is exactly 0 is pale pink.

    Parameters
    ----------
    comparison : Comparison
    field : str
        One of :func:`quadcurv.viewing.fields.names`.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError
        Unknown field.
    """
    return View(comparison, field, off_screen=True).plotter


def view(
    comparison: Comparison,
    field: str = "mean_curvature",
    refined: Callable[[int], Comparison] | None = None,
) -> None:
    """Open a :class:`View` in a window, until it is closed.

    Parameters
    ----------
    comparison, field, refined
        As for :class:`View`.

    Raises
    ------
    NoOpenGLError
        There is no display or no usable OpenGL.
    ValueError
        Unknown field.
    """
    problem = window_problem()
    if problem:
        raise NoOpenGLError(problem)
    View(comparison, field, refined=refined).plotter.show()


class View:
    """Linked views of a comparison, one a scheme, with one colour bar.

    In a window the keys, and the buttons below, are: right and left arrow for the next and previous
    field, ``m`` for the edges of the mesh, ``o`` for boundaries, seams and extraordinary vertices, ``n``
    for mean curvature normals, ``d`` for principal directions, ``h`` for the histogram by area under each
    view, ``r`` to fit the camera. A click on the surface shows the values at the nearest vertex and its
    ring in all views.

    Parameters
    ----------
    comparison : Comparison
    field : str
        One of :func:`quadcurv.viewing.fields.names`.
    off_screen : bool
        Whether the scene is for a file rather than a window; it then has no controls.
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

    Raises
    ------
    ValueError
        Unknown field.
    """

    LEVELS = 6
    START = 2

    def __init__(
        self,
        comparison: Comparison,
        field: str = "mean_curvature",
        off_screen: bool = False,
        refined: Callable[[int], Comparison] | None = None,
    ) -> None:
        import pyvista as pv

        self.comparison = comparison
        self.field = field
        self.picked: int | None = None
        self.shown: set[str] = set()
        self._refined = refined
        self._level = self.START
        self._drawn: dict[str, list[tuple[Any, Any]]] = {}
        views = len(fields.field(comparison, field).values)
        self._rows = max(1, round(sqrt(views / 2)))  # twice as wide as high
        self._columns = ceil(views / self._rows)
        width, height = PANEL * max(self._columns, 2), PANEL * self._rows
        self._scale = _SCALE if off_screen else min(1.0, SCREEN[0] / width, SCREEN[1] / height)
        rows = [PANEL] * self._rows + [LEGEND]
        heights = [int(row * self._scale) for row in rows] + [CONTROLS] * (not off_screen)
        groups: Any = [(row, slice(None)) for row in range(self._rows, len(heights))]
        self.plotter: Any = pv.Plotter(
            shape=(len(heights), self._columns),
            row_weights=heights,
            groups=groups,
            border=False,
            off_screen=off_screen,
            window_size=[int(width * self._scale), sum(heights)],
            title="quadcurv",
        )
        self.plotter.set_background("white")  # type: ignore[arg-type]  # self is hidden by a decorator
        self._table: Any = pv.LookupTable(nan_color=NAN_COLOUR)
        self.plotter.link_views(list(range(views)))
        self._add_surfaces()
        self.reset_camera()
        self.show_field(field)
        if len(comparison.mesh.stencils().faces) < _LARGE:
            self.toggle("edges")
        if not off_screen:
            self._add_controls()

    def show_field(self, name: str) -> None:
        """Colour all views by another field.

        Raises
        ------
        ValueError
            Unknown field.
        """
        shown = fields.field(self.comparison, name)
        self.field = name
        self._table.apply_cmap(shown.colours)
        self._table.scalar_range = shown.limits
        self._table.below_range_color = ZERO_COLOUR if shown.shows_zero else None
        for mapper, values, panel, coarse in zip(
            self._mappers, shown.values.values(), self._panels, self._coarse or self._panels, strict=True
        ):
            panel[VALUES] = values
            if self._coarse:
                coarse[VALUES] = values[self._nearest]
            mapper.scalar_range = shown.limits
        self._add_legend()
        self._redraw("histogram")
        self._report()

    def next_field(self, step: int = 1) -> None:
        """Colour all views by the next field, after the last one the first again."""
        names = fields.names(self.comparison)
        self.show_field(names[(names.index(self.field) + step) % len(names)])
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
            _make_room(self.plotter.renderers[0].camera, what in self.shown)
        self._add_legend()
        self.plotter.render()

    def refine(self, level: float) -> None:
        """Show the comparison at another refinement level, 0 to 5."""
        if self._refined is None or round(level) == self._level:
            return
        self._level = round(level)
        self.comparison = self._refined(self._level)
        self.picked = None
        self._add_surfaces()
        for what in self.shown - {"edges"}:
            self._redraw(what)
        self.show_field(self.field)
        self.plotter.subplot(self._rows + 1, 0)
        self._text(f"refinement {self._level}", (0.86, 0.12), 6 / self._scale, name="refinement")
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
            face = self._faces[picker.GetCellId()]
            corners = face[face >= 0]
            distance = np.linalg.norm(self._points[corners] - picker.GetPickPosition(), axis=1)
            self.picked = picker.GetCellId() if self._on_cells else int(corners[distance.argmin()])
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
        self.plotter.subplot(0, 0)
        _look_at(self.plotter.camera, self._points)
        if "histogram" in self.shown:
            _make_room(self.plotter.camera, True)

    def _subplot(self, i: int) -> None:
        self.plotter.subplot(*divmod(i, self._columns))

    def _add_surfaces(self) -> None:
        self._points, self._faces, self._on_cells = fields.drawn(self.comparison.mesh)
        n = self.comparison.valence.size
        self._sites = self._points[self._faces].mean(axis=1) if self._on_cells else self._points[:n]
        surface = polydata(self._points, self._faces)
        surface[VALUES] = np.zeros(self.comparison.valence.size)
        self._panels, self._surfaces, self._mappers, self._coarse = [], [], [], []
        if large := len(self._faces) > _LARGE and not self.plotter.off_screen:
            self.plotter.disable_anti_aliasing()
            coarse, self._nearest = self._coarser(surface)
        self._diagonal = float(np.linalg.norm(np.ptp(self._points, axis=0)))
        for i in range(len(self.comparison.schemes)):
            self._subplot(i)
            panel = surface.copy(deep=False)
            actor = self.plotter.add_mesh(
                panel,
                scalars=VALUES,
                cmap=self._table,
                lighting=False,
                show_edges="edges" in self.shown,
                edge_opacity=0.25,
                line_width=self._scale,
                show_scalar_bar=False,
                reset_camera=False,
                name="surface",
                render=False,
            )
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
        places = coarse.cell_centers().points if self._on_cells else coarse.points
        return coarse, cKDTree(self._sites).query(places)[1]

    def _redraw(self, what: str) -> None:
        """Bring what lies over the surface up to date."""
        self._clear(what)
        if what not in self.shown:
            return
        if what == "histogram":
            self._add_histograms()
            return
        draw = {"overlays": self._overlays, "normals": self._normals, "directions": self._directions}[what]
        for i, scheme in enumerate(self.comparison.schemes):
            self._subplot(i)
            for mesh, style in draw(scheme):
                self._draw(what, mesh, **style)

    def _draw(self, what: str, mesh: pv.PolyData, **style: Any) -> None:
        actor = self.plotter.add_mesh(
            mesh,
            lighting=False,
            pickable=False,
            reset_camera=False,
            show_scalar_bar=False,
            render_points_as_spheres=True,
            render=False,
            **style,
        )
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()  # before the surface it lies in
        for offset in ("Line", "Polygon"):
            getattr(actor.mapper, f"SetRelativeCoincidentTopology{offset}OffsetParameters")(-2.0, -2.0)
        actor.mapper.SetRelativeCoincidentTopologyPointOffsetParameter(-20.0)
        self._drawn.setdefault(what, []).append((self.plotter.renderer, actor))

    def _clear(self, what: str) -> None:
        for renderer, actor in self._drawn.pop(what, []):
            renderer.remove_actor(actor, render=False)

    def _add_histograms(self) -> None:
        """Under each surface how much of the area has which colour; the scale across is the colour bar's."""
        shown = fields.field(self.comparison, self.field)
        parts = {s: shown.histogram(s, self.comparison.areas) for s in self.comparison.schemes}
        highest = max(p.max() for p in parts.values()) or 1.0
        colours = self._table.values[np.linspace(0, 255, fields.BARS).astype(int), :3]
        for i, part in enumerate(parts.values()):
            self._subplot(i)
            heights = _HISTOGRAM * part / highest
            outline = heights + 0.004 * (heights > 0)  # for what is pale
            for fill, tops in (([[128] * 3] * fields.BARS, outline), (colours, heights)):
                bars = self._strip(np.linspace(0.1, 0.9, fields.BARS + 1), fill, 0.0, tops)
                self._drawn.setdefault("histogram", []).append((self.plotter.renderer, bars))

    def _overlays(self, _: str) -> Iterator[Drawing]:
        """Edges of the boundary and of seams, and extraordinary vertices, each in the colour of its name."""
        import pyvista as pv

        for name, vertices in fields.overlays(self.comparison.mesh).items():
            style: dict[str, Any] = {"color": OVERLAYS[name]}
            if vertices.ndim == 2:
                style["line_width"] = 4 * self._scale
                lines = np.insert(vertices, 0, 2, axis=1)
                yield pv.PolyData(np.array(self._points), lines=lines), style
            else:
                style["point_size"] = 9 * self._scale
                yield pv.PolyData(self._points[vertices]), style

    def _normals(self, scheme: str) -> Iterator[Drawing]:
        """Arrows H n, towards the centre of curvature; as long as 5 % of the surface at the scale's end."""
        import pyvista as pv

        H = self.comparison.mean_curvature[scheme].ravel()
        end = fields.field(self.comparison, "mean_curvature").limits[1]
        length = 0.05 * self._diagonal * np.clip(H / end, -1, 1)
        vectors = -length[:, None] * self._vertex_normals()
        some = self._some(vectors)
        inward = (H > 0)[some, None]  # such an arrow ends on the surface, where it can be seen
        tails = pv.PolyData(self._sites[some] - np.where(inward, vectors[some], 0.0))
        tails["vectors"] = vectors[some]
        arrow = pv.Arrow(
            tip_length=0.3, tip_radius=0.1, shaft_radius=0.04, tip_resolution=12, shaft_resolution=8
        )
        yield tails.glyph(orient="vectors", scale="vectors", geom=arrow), {"color": "black"}

    def _directions(self, _: str) -> Iterator[Drawing]:
        """Principal directions by jet, that of the larger curvature k1 black, that of k2 white."""
        import pyvista as pv

        fit = fields.jet(self.comparison)
        normals = self._vertex_normals()
        for direction, colour in ((fit.direction1, "black"), (fit.direction2, "white")):
            vectors = 0.018 * self._diagonal * direction.reshape(-1, 3)
            some = self._some(vectors)
            middle = self._sites[some] + 2e-3 * self._diagonal * normals[some]
            ends = np.stack((middle - vectors[some], middle + vectors[some]), axis=1).reshape(-1, 3)
            lines = np.insert(np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1)
            yield pv.PolyData(ends, lines=lines), {"color": colour, "line_width": 2.5 * self._scale}

    def _vertex_normals(self) -> Floats:
        return vertex_normals(self.comparison.mesh, "nan").reshape(-1, 3)

    def _some(self, vectors: Floats) -> Ints:
        """One site in every cube of 5 % of the surface's size, among those with a vector."""
        known = np.flatnonzero(np.isfinite(vectors).all(axis=1) & (vectors != 0).any(axis=1))
        cubes = np.floor(self._sites[known] / (0.05 * self._diagonal)).astype(np.int32)
        return known[np.unique(cubes, axis=0, return_index=True)[1]].astype(np.int32)

    def _report(self) -> None:
        """Titles with the values at the picked vertex, and its ring on the surfaces."""
        import pyvista as pv

        shown = fields.field(self.comparison, self.field)
        self._clear("picked")
        for i, scheme in enumerate(self.comparison.schemes):
            self._subplot(i)
            value = "" if self.picked is None else f": {shown.text(shown.values[scheme][self.picked])}"
            self._text(scheme + value, (0.5, 0.95), 12, name="title")
            if self.picked is None:
                continue
            rows = [self.picked] if self._on_cells else (self._faces == self.picked).any(axis=1)
            ring = polydata(self._points, self._faces[rows])
            self._draw("picked", ring, style="wireframe", color=RING_COLOUR, line_width=4 * self._scale)
            dot = pv.PolyData(self._sites[[self.picked]])
            self._draw("picked", dot, color="black", point_size=9 * self._scale)
        if not self.plotter.off_screen:
            what = "click on the surface for values"
            if self.picked is not None:
                kind = "cell" if self._on_cells else "vertex"
                what = f"{kind} {self.picked}, valence {self.comparison.valence.ravel()[self.picked]}"
            self.plotter.subplot(self._rows + 1, 0)
            self._text(what, (0.5, 0.85), 9 / self._scale, name="picked")

    def _add_legend(self) -> None:
        """Colour bar with title above and labels below, and patches of all colours beyond it."""
        import pyvista as pv

        shown = fields.field(self.comparison, self.field)
        self.plotter.subplot(self._rows, 0)
        self.plotter.renderer.RemoveAllViewProps()
        low, high = shown.limits
        patches = shown.patches()
        if "overlays" in self.shown:
            patches += [(name, OVERLAYS[name]) for name in fields.overlays(self.comparison.mesh)]
        left, right = 0.08, 0.92 - 0.11 * len(patches)
        self._strip(np.linspace(left, right, 257), self._table.values[:, :3])
        self._text(shown.title, ((left + right) / 2, 0.82), 11)
        for place, label in shown.ticks():
            self._text(label, (left + (place - low) / (high - low) * (right - left), 0.2), 10)
        for i, (label, colour) in enumerate(patches):
            x = right + 0.11 * (i + 1)
            for margin, fill in ((1.0, "grey"), (0.0, colour)):  # an outline, for what is pale
                dx, dy = margin / self.plotter.window_size[0], margin / LEGEND
                ends = np.array([x - 0.03 - dx, x + 0.03 + dx])
                self._strip(ends, [pv.Color(fill).int_rgb], 0.4 - dy, 0.62 + dy)
            self._text(label, (x, 0.2), 9)

    def _strip(
        self, edges: Floats, colours: ArrayLike, bottom: float = 0.4, tops: ArrayLike = 0.62
    ) -> vtkActor2D:
        """Coloured cells side by side in the current view, between edges from 0 to 1."""
        from vtkmodules.vtkRenderingCore import vtkActor2D, vtkCoordinate, vtkPolyDataMapper2D

        left, right, low, high, zero = np.broadcast_arrays(edges[:-1], edges[1:], bottom, tops, 0.0)
        corners = np.array([(left, low, zero), (right, low, zero), (right, high, zero), (left, high, zero)])
        faces = np.arange(4 * len(left), dtype=np.int32).reshape(-1, 4)
        strip = polydata(np.moveaxis(corners, 2, 0).reshape(-1, 3), faces)
        strip.cell_data["colours"] = np.array(colours, np.uint8)
        strip.cell_data.active_scalars_name = "colours"
        coordinate = vtkCoordinate()
        coordinate.SetCoordinateSystemToNormalizedViewport()
        mapper = vtkPolyDataMapper2D()
        mapper.SetInputData(strip)
        mapper.SetTransformCoordinate(coordinate)
        mapper.SetScalarModeToUseCellData()
        actor = vtkActor2D()
        actor.SetMapper(mapper)
        self.plotter.renderer.AddViewProp(actor)
        return actor

    def _text(self, text: str, position: tuple[float, float], size: float, name: str | None = None) -> None:
        """Text centred at a position of the current view, in coordinates from 0 to 1."""
        import matplotlib as mpl

        actor = self.plotter.add_text(
            text.replace("|", "∣"),  # VTK takes an ASCII bar for a column's end
            position=position,
            font_size=size * self._scale,
            color="black",
            viewport=True,
            font_file=f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf",
            name=name,
            render=False,
        )
        actor.prop.justification_horizontal = "center"
        actor.prop.justification_vertical = "center"
        actor.prop.background_color = "white"  # arrows may reach behind a title
        actor.prop.background_opacity = 0.85

    def _add_controls(self) -> None:
        plotter = self.plotter
        plotter.subplot(self._rows + 1, 0)
        width = plotter.window_size[0]
        buttons = [
            ("next field (→)", "Right", self.next_field),
            ("edges (m)", "m", lambda: self.toggle("edges")),
            ("overlays (o)", "o", lambda: self.toggle("overlays")),
            ("normals (n)", "n", lambda: self.toggle("normals")),
            ("directions (d)", "d", lambda: self.toggle("directions")),
            ("histogram (h)", "h", lambda: self.toggle("histogram")),
        ]
        for i, (label, key, action) in enumerate(buttons):
            x = 35 + 95 * i
            plotter.add_checkbox_button_widget(
                lambda _, action=action: action(),
                position=(x, 30),
                size=26,
                border_size=2,
                color_on="#0072b2",
                color_off="#0072b2",
                background_color="black",
            )
            self._text(label, ((x + 13) / width, 0.15), 6 / self._scale)
            plotter.add_key_event(key, action)
        plotter.add_key_event("Left", lambda: self.next_field(-1))
        if self._refined is not None:
            slider = plotter.add_slider_widget(
                self.refine,
                rng=(0, self.LEVELS - 1),
                value=self.START,
                pointa=(0.75, 0.42),
                pointb=(0.97, 0.42),
                fmt="%.0f",
                color="#0072b2",
                slider_width=0.1,
                tube_width=0.02,
            )
            slider.GetRepresentation().ShowSliderLabelOff()  # it would be tiny
            self._text(f"refinement {self._level}", (0.86, 0.12), 6 / self._scale, name="refinement")
        pressed: list[tuple[int, int]] = []
        interactor = plotter.iren.interactor

        def press(*_: Any) -> None:
            pressed[:] = [interactor.GetEventPosition()]

        def release(*_: Any) -> None:
            if pressed and pressed.pop() == interactor.GetEventPosition():
                self.pick(*interactor.GetEventPosition())

        plotter.iren.style.AddObserver("StartInteractionEvent", lambda *_: self.turn_coarse(True))
        plotter.iren.style.AddObserver("EndInteractionEvent", lambda *_: self.turn_coarse(False))
        plotter.iren.add_observer("LeftButtonPressEvent", press)
        plotter.iren.add_observer("LeftButtonReleaseEvent", release)


def polydata(points: Floats, faces: Ints) -> pv.PolyData:
    """Surface of pyvista; faces (m, 4) end with -1 where they are triangles."""
    import pyvista as pv

    if (faces[:, 3] >= 0).all():
        return pv.PolyData.from_regular_faces(points, faces)  # type: ignore[arg-type]  # any integer will do
    sized = np.insert(faces, 0, np.where(faces[:, 3] < 0, 3, 4), axis=1)
    return pv.PolyData(np.array(points), sized[sized >= 0])


def _look_at(camera: pv.Camera, points: Floats) -> None:
    """Fit the points into a square view, its upper tenth left to the title."""
    towards, up = fields.viewpoint(points)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    seen = points @ axes.T
    centre, half = (seen.max(axis=0) + seen.min(axis=0)) / 2, np.ptp(seen, axis=0) / 2
    distance = 4 * np.linalg.norm(half)
    camera.focal_point = centre @ axes
    camera.position = centre @ axes + distance * towards
    camera.up = axes[1]
    camera.parallel_projection = True
    camera.parallel_scale = float(max(half[0] / 0.96, half[1] / 0.88)) or 1.0
    camera.SetWindowCenter(0, 0.08)


def _make_room(camera: pv.Camera, room: bool) -> None:
    """Draw all smaller above a histogram, or as before."""
    factor = 0.88 / (0.88 - _HISTOGRAM)
    camera.parallel_scale *= factor if room else 1 / factor
    camera.SetWindowCenter(0, 0.08 - _HISTOGRAM * room)
