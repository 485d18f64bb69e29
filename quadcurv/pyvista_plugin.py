"""pyvista plugin: ``mesh.quadcurv.mean_curvature()`` and its sisters on PolyData and StructuredGrid.

pyvista finds this module through the entry-point group "pyvista.accessors" when ``.quadcurv`` is first asked
for; nothing needs to be imported.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from quadcurv import curvature
from quadcurv.io import as_mesh
from quadcurv.io.pyvista import in_vtk_order
from quadcurv.mesh import Mesh
from quadcurv.schemes import Fit, Scheme
from quadcurv.types import Floats

if TYPE_CHECKING:
    import pyvista as pv

    from quadcurv.comparison import Comparison

Wrap = Sequence[bool] | None


class Accessor:
    """Curvature of a pyvista mesh.

    Every method returns an array with one entry a point, in the order of ``mesh.points``, and leaves the
    mesh as it is; ``mesh["H"] = mesh.quadcurv.mean_curvature()`` keeps it. `scheme` and `boundary` are
    those of :func:`quadcurv.mean_curvature`; `wrap` says which directions of a StructuredGrid are closed,
    as in :meth:`quadcurv.as_mesh`.

    Parameters
    ----------
    dataset : pyvista.PolyData or pyvista.StructuredGrid
        A StructuredGrid of one layer.

    Examples
    --------
    >>> import quadcurv as qc
    >>> grid = qc.to_pyvista(qc.surfaces.tanh_sheet().sample((16, 16))[0])
    >>> grid.quadcurv.mean_curvature().shape
    (289,)
    """

    def __init__(self, dataset: pv.PolyData | pv.StructuredGrid) -> None:
        self._dataset = dataset
        self._is_grid = hasattr(dataset, "dimensions")

    def mean_curvature(
        self,
        scheme: str | Scheme = curvature.DEFAULT,
        boundary: str = "extrapolate",
        wrap: Wrap = None,
    ) -> Floats:
        """(n,) mean curvature in 1 / length; see :func:`quadcurv.mean_curvature`."""
        return self._by_point(curvature.mean_curvature(self._mesh(wrap), scheme, boundary))

    def mean_curvature_normal(
        self,
        scheme: str | Scheme = curvature.DEFAULT,
        boundary: str = "extrapolate",
        wrap: Wrap = None,
    ) -> Floats:
        """(n, 3) mean curvature normal in 1 / length; see :func:`quadcurv.mean_curvature_normal`."""
        return self._by_point(curvature.mean_curvature_normal(self._mesh(wrap), scheme, boundary))

    def gaussian_curvature(
        self, scheme: str | Fit = curvature.DEFAULT, boundary: str = "extrapolate", wrap: Wrap = None
    ) -> Floats:
        """(n,) Gaussian curvature in 1 / length^2; see :func:`quadcurv.gaussian_curvature`."""
        return self._by_point(curvature.gaussian_curvature(self._mesh(wrap), scheme, boundary))

    def principal_curvatures(
        self, scheme: str | Fit = curvature.DEFAULT, boundary: str = "extrapolate", wrap: Wrap = None
    ) -> curvature.PrincipalCurvatures:
        """k1, k2 (n,) and their directions (n, 3); see :func:`quadcurv.principal_curvatures`."""
        found = curvature.principal_curvatures(self._mesh(wrap), scheme, boundary)
        return curvature.PrincipalCurvatures(*map(self._by_point, found))

    def vertex_normals(self, boundary: str = "extrapolate", wrap: Wrap = None) -> Floats:
        """(n, 3) unit normals; see :func:`quadcurv.vertex_normals`."""
        return self._by_point(curvature.vertex_normals(self._mesh(wrap), boundary))

    def compare(
        self, schemes: Any = None, exact: Any = None, wrap: Wrap = None, **options: Any
    ) -> Comparison:
        """Mean curvature by several schemes; see :func:`quadcurv.comparison.compare`."""
        from quadcurv.comparison import compare

        return compare(self._mesh(wrap), schemes, exact, **options)

    def _mesh(self, wrap: Wrap) -> Mesh:
        return as_mesh(self._dataset, wrap=wrap)

    def _by_point(self, values: Floats) -> Floats:
        return in_vtk_order(values, self._dataset) if self._is_grid else values


def _register() -> None:
    import pyvista as pv

    for target in (pv.PolyData, pv.StructuredGrid):
        pv.register_dataset_accessor("quadcurv", target)(Accessor)


_register()
