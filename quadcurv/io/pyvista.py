"""Datasets of pyvista and VTK: polygons as face lists, StructuredGrids as grids, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.io.base import Content, FaceList, Library, checked_values, is_a, register
from quadcurv.io.vtk import dataset
from quadcurv.mesh import QuadMesh
from quadcurv.types import Floats, MeshError


def content(data: Any) -> Content:
    """Polygons of a PolyData or UnstructuredGrid, or the one layer of a StructuredGrid."""
    data = wrapped(data)
    meta: dict[str, Any] = {"kind": type(data).__name__}
    arrays = {"points": np.asarray(data.points)}
    if is_a(data, "StructuredGrid"):
        meta["dimensions"] = data.dimensions
    elif is_a(data, "PolyData"):
        # pyvista makes a vertex cell of every point of a PolyData without faces.
        meta |= {"strips": data.n_strips, "left_out": data.n_lines + data.n_verts}
        _add_cells(arrays, data.GetPolys())
    else:
        arrays["types"] = np.asarray(data.celltypes)
        _add_cells(arrays, data.GetCells())
    for name in data.point_data.keys():  # noqa: SIM118
        arrays[f"value {name}"] = np.asarray(data.point_data[name])
    return dataset(meta, arrays)


def _add_cells(arrays: dict[str, NDArray[Any]], cells: Any) -> None:
    from pyvista import convert_array

    arrays["offsets"] = np.array(convert_array(cells.GetOffsetsArray()), np.int64)
    arrays["corners"] = np.array(convert_array(cells.GetConnectivityArray()), np.int64)


def wrapped(dataset: Any) -> Any:
    """A dataset of VTK as one of pyvista."""
    if not any(base.__module__.startswith("pyvista") for base in type(dataset).__mro__):
        need("pyvista")
        import pyvista

        dataset = pyvista.wrap(dataset)
    if not is_a(dataset, "PolyData", "UnstructuredGrid", "StructuredGrid"):
        raise TypeError(
            f"mesh: expected a PolyData, StructuredGrid or UnstructuredGrid, got {type(dataset).__name__}; "
            "extract_surface() or combine() may give one"
        )
    return dataset


def from_mesh(mesh: QuadMesh) -> Any:
    """A PolyData of the same faces."""
    need("pyvista")
    import pyvista

    faces = FaceList.of(mesh)
    begin = np.cumsum(faces.sizes) - faces.sizes
    rows = np.insert(faces.corners.astype(np.int64), begin, faces.sizes)
    return pyvista.PolyData(mesh.points.copy(), faces=rows)


def from_grid(points: Floats, wrap: tuple[bool, bool]) -> Any:
    """A StructuredGrid whose last row or column repeats the first one where the grid wraps."""
    need("pyvista")
    import pyvista

    points = np.pad(points, [*((0, int(w)) for w in wrap), (0, 0)], mode="wrap")
    return pyvista.StructuredGrid(*np.moveaxis(points, -1, 0))


def in_vtk_order(values: NDArray[Any], dataset: Any) -> NDArray[Any]:
    """Values of a QuadGrid, (r, c) or (r, c, 3), as the points of its StructuredGrid are numbered.

    A row or column that the StructuredGrid has more than `values` repeats the first one.
    """
    shape = [size for size in dataset.dimensions if size != 1]
    more = [size - given for size, given in zip(shape, values.shape, strict=False)]
    if len(shape) != 2 or not set(more) <= {0, 1}:
        raise MeshError(f"values: shape {values.shape} does not fit a grid of {tuple(shape)} points")
    values = np.pad(values, [(0, more[0]), (0, more[1]), *[(0, 0)] * (values.ndim - 2)], mode="wrap")
    return np.swapaxes(values, 0, 1).reshape(-1, *values.shape[2:])


def attach(dataset: Any, name: str, values: NDArray[Any], colormap: str | None) -> None:
    """Point data, made the active scalars or vectors; pyvista chooses colours itself."""
    dataset = wrapped(dataset)
    if is_a(dataset, "StructuredGrid") and values.ndim >= 2 and len(values) != dataset.n_points:
        values = in_vtk_order(values, dataset)
    values = checked_values(name, values, (dataset.n_points,))
    dataset.point_data.set_array(values, name, deep_copy=True)
    setattr(dataset.point_data, f"active_{'scalars' if values.ndim == 1 else 'vectors'}_name", name)


register(Library(("pyvista", "vtkmodules"), content, attach))
