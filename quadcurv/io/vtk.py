"""VTK's own files by pyvista: polygons and grids, values as they are."""

from __future__ import annotations

from pathlib import Path

from quadcurv.io import pyvista as adapter
from quadcurv.io.base import Content, Format, Values, foreign, register
from quadcurv.mesh import QuadMesh


def read_vtk(path: Path) -> Content:
    """Polygons, or the one layer of a grid, and all point data."""
    import pyvista

    return adapter.content(foreign(pyvista.read, path))


def write_vtk(path: Path, mesh: QuadMesh, values: Values) -> None:
    """A PolyData with its point data."""
    surface = adapter.from_mesh(mesh)
    surface.point_data.update(values)
    surface.save(path)


register(Format((".vtp",), read_vtk, write_vtk, holds_values=True))
register(Format((".vtu", ".vtk", ".vts"), read_vtk))
