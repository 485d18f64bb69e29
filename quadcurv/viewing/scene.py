"""What scenes of pyvista are made of: surfaces, coloured strips, text, the colour bar, the camera."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.types import Floats, Ints
from quadcurv.viewing.geometry import viewpoint
from quadcurv.viewing.scale import NAN_COLOUR, ZERO_COLOUR, Field

if TYPE_CHECKING:
    import pyvista as pv
    from vtkmodules.vtkRenderingCore import vtkActor2D

HISTOGRAM = 0.1  # its height to that of a view
_LEGEND_HEIGHT = 120.0  # pixels, at scale 1
_LETTER = 1.0  # pixels that a letter is wide, to the size of its type
_PATCHES, _ROWS = 0.42, 3  # part of the legend's width for patches side by side; else they stand in rows


def polydata(points: Floats, faces: Ints) -> pv.PolyData:
    """Surface of pyvista; faces (m, 4) end with -1 where they are triangles."""
    import pyvista as pv

    if (faces[:, 3] >= 0).all():
        return pv.PolyData.from_regular_faces(points, faces)  # type: ignore[arg-type]  # any integer will do
    sized = np.insert(faces, 0, np.where(faces[:, 3] < 0, 3, 4), axis=1)
    return pv.PolyData(np.array(points), sized[sized >= 0])


def lookup_table(field: Field) -> Any:
    """Colours of a field."""
    import pyvista as pv

    table = pv.LookupTable(nan_color=NAN_COLOUR)
    colour_by(table, field)
    return table


def colour_by(table: Any, field: Field) -> None:
    """Make a lookup table that of another field."""
    table.values = field.colour_table()
    table.scalar_range = field.limits
    table.below_range_color = ZERO_COLOUR if field.logarithmic else None


def surface_style(shading: bool = False) -> dict[str, Any]:
    """Options of `Plotter.add_mesh` for a coloured surface: colours as they are, or lit."""
    light = {"ambient": 0.25, "specular": 0.2} if shading else {"lighting": False}
    return {"edge_opacity": 0.25, **light}


@dataclass(frozen=True)
class Scene:
    """Drawing into the current view of a plotter.

    Attributes
    ----------
    plotter : pyvista.Plotter
    scale : float
        Size of letters and lines.
    """

    plotter: Any
    scale: float

    def draw(self, mesh: pv.PolyData, **style: Any) -> Any:
        """Lines, dots or glyphs over a surface, before what of it lies at the same depth."""
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
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        for offset in ("Line", "Polygon"):
            getattr(actor.mapper, f"SetRelativeCoincidentTopology{offset}OffsetParameters")(-2.0, -2.0)
        actor.mapper.SetRelativeCoincidentTopologyPointOffsetParameter(-20.0)
        return actor

    def text(
        self,
        text: str,
        position: tuple[float, float],
        size: float,
        name: str | None = None,
        justified: str = "center",
    ) -> None:
        """Text at a position of the view, in coordinates from 0 to 1."""
        import matplotlib as mpl

        actor = self.plotter.add_text(
            text.replace("|", "∣"),  # VTK takes an ASCII bar for a column's end
            position=position,
            font_size=size * self.scale,
            color="black",
            viewport=True,
            font_file=f"{mpl.get_data_path()}/fonts/ttf/DejaVuSans.ttf",
            name=name,
            render=False,
        )
        actor.prop.justification_horizontal = justified
        actor.prop.justification_vertical = "center"
        actor.prop.background_color = "white"  # arrows may reach behind a title
        actor.prop.background_opacity = 0.85

    def strip(
        self, edges: Floats, colours: ArrayLike, bottom: float = 0.4, tops: ArrayLike = 0.62
    ) -> vtkActor2D:
        """Coloured cells side by side, between edges from 0 to 1."""
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

    def legend(self, field: Field, table: Any, marks: Sequence[tuple[str, str]]) -> None:
        """Colour bar with title above and labels below, and patches of all colours beyond it."""
        import pyvista as pv

        self.plotter.renderer.RemoveAllViewProps()
        low, high = field.limits
        patches = [*field.patches(), *marks]
        width = self.plotter.window_size[0]
        step = max(0.11, 115 * self.scale / width)  # room for the labels side by side
        in_rows = step * len(patches) > _PATCHES  # else
        columns = -(-len(patches) // _ROWS) if in_rows else len(patches)
        step = 135 * self.scale / width if in_rows else step
        left = max(0.08, 30 * self.scale / width)  # for half of the first label
        right = min(1 - left, 1 - 0.5 * step) - step * columns - 0.02 * in_rows
        self.strip(np.linspace(left, right, 257), table.values[:, :3])
        middle = (left + right) / 2
        fits = 2 * middle * width / (_LETTER * self.scale * len(field.title))
        self.text(field.title, (middle, 0.82), min(11, fits))
        for place, label in field.ticks():
            self.text(label, (left + (place - low) / (high - low) * (right - left), 0.2), 10)
        for i, (label, colour) in enumerate(patches):
            column, row = divmod(i, _ROWS) if in_rows else (i, 0)
            x = right + 0.04 + step * (column + 0.25) if in_rows else right + step * (column + 1)
            half, low_edge, high_edge = (0.13 * step, 0.7, 0.86) if in_rows else (0.03, 0.4, 0.62)
            for margin, fill in ((1.0, "grey"), (0.0, colour)):  # an outline, for what is pale
                dx, dy = margin / width, margin / _LEGEND_HEIGHT
                ends = np.array([x - half - dx, x + half + dx])
                drop = 0.28 * row
                self.strip(ends, [pv.Color(fill).int_rgb], low_edge - drop - dy, high_edge - drop + dy)
            if in_rows:
                self.text(label, (x + 1.3 * half, 0.78 - drop), 8, justified="left")
            else:
                self.text(label, (x, 0.2), 9)

    def histogram(self, parts: Floats, highest: float, table: Any) -> list[vtkActor2D]:
        """Bars along the lower edge of the view, in the colours of equal parts of the scale."""
        colours = table.values[np.linspace(0, 255, parts.size).astype(int), :3]
        heights = HISTOGRAM * parts / highest
        outline = heights + 0.004 * (heights > 0)  # for what is pale
        edges = np.linspace(0.1, 0.9, parts.size + 1)
        return [
            self.strip(edges, fill, 0.0, tops)
            for fill, tops in (([[128] * 3] * parts.size, outline), (colours, heights))
        ]


def look_at(
    camera: pv.Camera,
    points: Floats,
    direction: tuple[float, float, float] | None,
    aspect: float,
    turned: bool,
) -> Floats:
    """Fit the points into a view of some width to its height, the upper tenth left to the title.

    Returns
    -------
    (2,) float64
        Half of what is seen across and up: of what is to be `turned` the radius of a ball around it all.
    """
    towards, up = viewpoint(points, direction)
    right = np.cross(up, towards)
    right /= np.linalg.norm(right)
    axes = np.array([right, np.cross(towards, right), towards])
    seen = points @ axes.T
    centre, half = (seen.max(axis=0) + seen.min(axis=0)) / 2, np.ptp(seen, axis=0) / 2
    distance = 4 * np.linalg.norm(half)
    if turned:
        half[:] = 1.1 * np.linalg.norm(seen - centre, axis=1).max()  # arrows stand out
    camera.focal_point = centre @ axes
    camera.position = centre @ axes + distance * towards
    camera.up = axes[1]
    camera.parallel_projection = True
    camera.parallel_scale = fitted_scale(half[:2], aspect)
    camera.SetWindowCenter(0, 0.08)
    return half[:2]


def fitted_scale(half: Floats, aspect: float) -> float:
    """Half the height of a view, of some width to its height, that just holds half widths across and up."""
    return float(max(half[0] / 0.96 / aspect, half[1] / 0.88)) or 1.0


def make_room(camera: pv.Camera, room: bool) -> None:
    """Draw all smaller above a histogram, or as before."""
    factor = 0.88 / (0.88 - HISTOGRAM)
    camera.parallel_scale *= factor if room else 1 / factor
    camera.SetWindowCenter(0, 0.08 - HISTOGRAM * room)
