"""pyvista plugin: ``plotter.quadcurv.add_error_map()``.

pyvista finds this module through the entry-point group "pyvista.plotter_components" when
``plotter.quadcurv`` is first asked for. Apart from the accessor, which needs nothing of pyvista's plotting.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from quadcurv.comparison import compare
from quadcurv.schemes import Scheme
from quadcurv.viewing.fields import Fields
from quadcurv.viewing.scale import NAN_COLOUR, ZERO_COLOUR
from quadcurv.viewing.scene import polydata, surface_style

if TYPE_CHECKING:
    import pyvista as pv

_VALUES = "log10 error"


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
        scheme: str | Scheme = "jet",
        limits: tuple[float, float] | None = None,
        **options: Any,
    ) -> pv.Actor:
        """Add a mesh coloured by the error |H - exact| on a logarithmic scale.

        Parameters
        ----------
        mesh
            Anything :func:`quadcurv.as_mesh` takes. Values of a staggered grid belong to its cells.
        exact : array_like or callable
            Exact mean curvature in 1 / length; see :func:`quadcurv.comparison.compare`.
        scheme : str or Scheme
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
            Its array is "log10 error". NaN is grey; what is exactly 0 is pale pink.

        Raises
        ------
        ValueError
            As :func:`quadcurv.comparison.compare`; limits that are not positive and ascending.
        """
        fields = Fields(compare(mesh, scheme, exact))
        shown = fields.field("error")
        if limits is not None:
            shown = shown.within(limits)
        (name,) = fields.comparison.schemes
        surface = polydata(fields.drawn.points, fields.drawn.faces)
        (surface.cell_data if fields.drawn.on_cells else surface.point_data)[_VALUES] = shown.coloured(name)
        bar = {
            "title": f"error in H, {name}\n",  # the empty line keeps it off the labels
            "fmt": "1e%.0f",
            "n_labels": round(shown.limits[1] - shown.limits[0]) + 1,
        }
        defaults = {
            "cmap": shown.colours,
            "clim": shown.limits,
            "nan_color": NAN_COLOUR,
            "show_edges": True,
            "scalar_bar_args": bar,
            **surface_style(),
        }
        if (shown.values[name] == 0).any():
            defaults["below_color"] = ZERO_COLOUR
            bar["below_label"] = "exactly 0"
        return self._plotter.add_mesh(surface, scalars=_VALUES, **(defaults | options))


def _register() -> None:
    import pyvista as pv

    pv.register_plotter_component("quadcurv")(PlotterComponent)


_register()
