"""Datasets of pyvista and VTK: polygons as face lists, StructuredGrids as grids, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io.base import Content, FaceList, Library, checked_values, is_a, polygons, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import Floats, MeshError

TRIANGLE, POLYGON, PIXEL, QUAD = 5, 7, 8, 9


def content(dataset: Any) -> Content:
    """Polygons of a PolyData or UnstructuredGrid, or the one layer of a StructuredGrid."""
    dataset = wrapped(dataset)
    values = {name: np.asarray(dataset.point_data[name]) for name in dataset.point_data.keys()}  # noqa: SIM118
    points = np.asarray(dataset.points)
    if is_a(dataset, "StructuredGrid"):
        shape = dataset.dimensions
        if sum(size == 1 for size in shape) != 1:
            raise MeshError(f"mesh: a StructuredGrid of dimensions {tuple(shape)}, expected one layer")
        axis = shape.index(1)
        values = {name: _by_row(array, shape, axis) for name, array in values.items()}
        return Content(_by_row(points, shape, axis), None, values)
    if is_a(dataset, "PolyData"):
        if dataset.n_strips:
            raise MeshError(f"mesh: {dataset.n_strips} triangle strip(s); triangulate() makes them faces")
        sizes, corners = _sizes_and_corners(dataset.GetPolys())
    else:
        sizes, corners = _polygon_cells(dataset)
    return Content(points, polygons(sizes, corners), values)


def wrapped(dataset: Any) -> Any:
    """A dataset of VTK as one of pyvista."""
    if not any(base.__module__.startswith("pyvista") for base in type(dataset).__mro__):
        import pyvista

        dataset = pyvista.wrap(dataset)
    if not is_a(dataset, "PolyData", "UnstructuredGrid", "StructuredGrid"):
        raise TypeError(
            f"mesh: expected a PolyData, StructuredGrid or UnstructuredGrid, got {type(dataset).__name__}; "
            "extract_surface() or combine() may give one"
        )
    return dataset


def _by_row(array: NDArray[Any], shape: tuple[int, int, int], axis: int) -> NDArray[Any]:
    """Entries (n, ...), which VTK numbers with the first index fastest, as (r, c, ...)."""
    given = array.reshape(*shape[::-1], *array.shape[1:])
    return np.moveaxis(given, (2, 1, 0), (0, 1, 2)).squeeze(axis=axis)


def _sizes_and_corners(cells: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    from pyvista import convert_array

    offsets, corners = (
        np.array(convert_array(array), np.int64)
        for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray())
    )
    return np.diff(offsets), corners


def _polygon_cells(dataset: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sizes and corners of an UnstructuredGrid of triangles, quads, pixels and polygons."""
    types = np.asarray(dataset.celltypes)
    if (other := ~np.isin(types, (TRIANGLE, POLYGON, PIXEL, QUAD))).any():
        first = int(np.argmax(other))
        raise MeshError(
            f"mesh: {np.count_nonzero(other)} cells are no polygons, first cell {first} of VTK type "
            f"{types[first]}; extract_surface() takes the outside of volumes"
        )
    sizes, corners = _sizes_and_corners(dataset.GetCells())
    third = (np.cumsum(sizes) - 2)[types == PIXEL]
    corners[third], corners[third + 1] = corners[third + 1], corners[third]
    return sizes, corners


def from_mesh(mesh: QuadMesh) -> Any:
    """A PolyData of the same faces."""
    import pyvista

    faces = FaceList.of(mesh)
    begin = np.cumsum(faces.sizes) - faces.sizes
    rows = np.insert(faces.corners.astype(np.int64), begin, faces.sizes)
    return pyvista.PolyData(mesh.points.copy(), faces=rows)


def from_grid(points: Floats, wrap: tuple[bool, bool]) -> Any:
    """A StructuredGrid whose last row or column repeats the first one where the grid wraps."""
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
