"""pyvista plugin: ``mesh.quadcurv.mean_curvature()`` and its sisters on PolyData and StructuredGrid, and
``plotter.quadcurv.add_error_map()``.

pyvista finds this module through the entry-point groups "pyvista.accessors" and
"pyvista.plotter_components" when ``.quadcurv`` is first asked for; nothing needs to be imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from quadcurv import curvature, interop
from quadcurv.mesh import Floats, Mesh, QuadGrid, QuadMesh
from quadcurv.schemes import Fit, Scheme

if TYPE_CHECKING:
    import pyvista as pv

    from quadcurv.compare import Comparison

Wrap = Sequence[bool]
OPEN = (False, False)


class Accessor:
    """Curvature of a pyvista mesh.

    Every method returns an array with one entry a point, in the order of ``mesh.points``, and leaves the
    mesh as it is; ``mesh["H"] = mesh.quadcurv.mean_curvature()`` keeps it. `scheme` and `boundary` are
    those of :func:`quadcurv.mean_curvature`; `wrap` says which directions of a StructuredGrid are closed,
    as in :meth:`quadcurv.QuadGrid.from_pyvista`.

    Parameters
    ----------
    dataset : pyvista.PolyData or pyvista.StructuredGrid
        A StructuredGrid of one layer.
    """

    def __init__(self, dataset: pv.PolyData | pv.StructuredGrid) -> None:
        self._dataset = dataset
        self._is_grid = hasattr(dataset, "dimensions")

    def mean_curvature(
        self,
        scheme: str | Scheme | Fit = "finite_volume",
        boundary: str = "extrapolate",
        wrap: Wrap = OPEN,
    ) -> Floats:
        """(n,) mean curvature in 1 / length; see :func:`quadcurv.mean_curvature`."""
        return self._by_point(curvature.mean_curvature(self._mesh(wrap), scheme, boundary))

    def mean_curvature_normal(
        self,
        scheme: str | Scheme | Fit = "finite_volume",
        boundary: str = "extrapolate",
        wrap: Wrap = OPEN,
    ) -> Floats:
        """(n, 3) mean curvature normal in 1 / length; see :func:`quadcurv.mean_curvature_normal`."""
        return self._by_point(curvature.mean_curvature_normal(self._mesh(wrap), scheme, boundary))

    def gaussian_curvature(
        self, scheme: str | Fit = "jet", boundary: str = "extrapolate", wrap: Wrap = OPEN
    ) -> Floats:
        """(n,) Gaussian curvature in 1 / length^2; see :func:`quadcurv.gaussian_curvature`."""
        return self._by_point(curvature.gaussian_curvature(self._mesh(wrap), scheme, boundary))

    def vertex_normals(self, boundary: str = "extrapolate", wrap: Wrap = OPEN) -> Floats:
        """(n, 3) unit normals; see :func:`quadcurv.vertex_normals`."""
        return self._by_point(curvature.vertex_normals(self._mesh(wrap), boundary))

    def compare(
        self, schemes: Any = None, exact: Any = None, wrap: Wrap = OPEN, **options: Any
    ) -> Comparison:
        """Mean curvature by several schemes; see :func:`quadcurv.compare.compare`."""
        from quadcurv.compare import compare

        return compare(self._mesh(wrap), schemes, exact, **options)

    def _mesh(self, wrap: Wrap) -> Mesh:
        if self._is_grid:
            return QuadGrid.from_pyvista(self._dataset, wrap)
        if tuple(wrap) != OPEN:
            raise TypeError("wrap: only a StructuredGrid has directions to wrap")
        return QuadMesh.from_pyvista(self._dataset)

    def _by_point(self, values: Floats) -> Floats:
        return interop.in_vtk_order(values, self._dataset) if self._is_grid else values


class PlotterComponent:
    """Error maps for scenes of one's own: ``plotter.quadcurv``.

    Parameters
    ----------
    plotter : pyvista.Plotter
    """

    def __init__(self, plotter: pv.Plotter) -> None:
        self._plotter: Any = plotter

    def add_error_map(
        self,
        mesh: Any,
        exact: Any,
        scheme: str | Scheme | Fit = "finite_volume",
        limits: tuple[float, float] | None = None,
        **options: Any,
    ) -> pv.Actor:
        """Add a mesh coloured by the error |H - exact| on a logarithmic scale.

        Parameters
        ----------
        mesh
            Anything :func:`quadcurv.as_mesh` takes. Values of a staggered grid belong to its cells.
        exact : array_like or callable
            Exact mean curvature in 1 / length; see :func:`quadcurv.compare.compare`.
        scheme : str, Scheme or Fit
            A name in ``quadcurv.SCHEMES``, or one of ``quadcurv.schemes``.
        limits : (float, float), optional
            Ends of the scale in 1 / length, such as (1e-6, 1e-1), to share it among maps; by default
            the whole decades around the errors.
        **options
            For :meth:`pyvista.Plotter.add_mesh`; the defaults here are no lighting, faint edges and a
            bar of powers of ten.

        Returns
        -------
        pyvista.Actor
            Its array is "log10 error". NaN is grey; what is exactly 0 is white.

        Raises
        ------
        ValueError
            As :func:`quadcurv.compare.compare`; limits that are not positive and ascending.
        """
        from quadcurv import fields
        from quadcurv.compare import compare
        from quadcurv.view import polydata

        comparison = compare(mesh, [scheme], exact)
        shown = fields.field(comparison, "error")
        if limits is not None:
            shown = shown.within(limits)
        points, faces, on_cells = fields.drawn(comparison.mesh)
        surface = polydata(points, faces)
        (name,) = comparison.schemes
        (surface.cell_data if on_cells else surface.point_data)["log10 error"] = shown.values[name]
        bar = {
            "title": f"error in H, {name}\n",  # the empty line keeps it off the labels
            "fmt": "1e%.0f",
            "n_labels": round(shown.limits[1] - shown.limits[0]) + 1,
        }
        defaults = {
            "cmap": shown.colours,
            "clim": shown.limits,
            "nan_color": fields.NAN_COLOUR,
            "lighting": False,
            "show_edges": True,
            "edge_opacity": 0.25,
            "scalar_bar_args": bar,
        }
        if (shown.values[name] < shown.limits[0]).any():
            defaults["below_color"] = fields.ZERO_COLOUR
            bar["below_label"] = "exactly 0"
        return self._plotter.add_mesh(surface, scalars="log10 error", **(defaults | options))


def _register() -> None:
    import pyvista as pv

    for target in (pv.PolyData, pv.StructuredGrid):
        pv.register_dataset_accessor("quadcurv", target)(Accessor)
    pv.register_plotter_component("quadcurv")(PlotterComponent)


_register()
