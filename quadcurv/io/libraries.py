"""Meshes of other libraries, and files, as ours and back. Imports stay inside the functions."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from quadcurv import repair
from quadcurv.io import formats
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, Recovery, StaggeredGrid
from quadcurv.types import MeshError

CARRIER = "quadcurv"  # face attribute of a Trimesh that says which quad a triangle was cut from
SAME_PLACE = 1e-6  # of the extent of a mesh: single precision is what many files have


def as_mesh(mesh: Any) -> Mesh:
    """Make a mesh of anything that holds one.

    Parameters
    ----------
    mesh : object
        One of

        - QuadMesh, QuadGrid, StaggeredGrid: returned as they are;
        - trimesh.Trimesh, or a Scene of one: see :meth:`QuadMesh.from_trimesh` for the quads;
        - pyvista.PolyData, or UnstructuredGrid of polygons: see :meth:`QuadMesh.from_pyvista`;
        - pyvista.StructuredGrid of one layer: a QuadGrid, see :meth:`QuadGrid.from_pyvista`;
        - pymeshlab.MeshSet or Mesh: see :meth:`QuadMesh.from_pymeshlab`;
        - a path: see :func:`read`;
        - a tuple (points, faces): the arguments of QuadMesh.

    Returns
    -------
    QuadMesh, QuadGrid or StaggeredGrid
        Vertices in the order of `mesh`; of a StructuredGrid indexed as (i, j), VTK's own order being
        the transposed one.

    Raises
    ------
    MeshError
        A ValueError: the content is not a surface mesh.
    TypeError
        None of these types.
    """
    if isinstance(mesh, QuadMesh | QuadGrid | StaggeredGrid):
        return mesh
    if isinstance(mesh, str | os.PathLike):
        return read(mesh)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return QuadMesh(*mesh)
    match _library(mesh):
        case "trimesh":
            return from_trimesh(mesh)
        case "pymeshlab":
            return from_pymeshlab(mesh)
        case "pyvista" | "vtkmodules":
            dataset = _pyvista_dataset(mesh)
            return from_structured(dataset) if _is(dataset, "StructuredGrid") else from_pyvista(dataset)
    raise TypeError(
        "mesh: expected a quadcurv mesh, a mesh of trimesh, pyvista or pymeshlab, a path or a tuple "
        f"(points, faces), got {type(mesh).__name__}"
    )


def _library(mesh: Any) -> str | None:
    """The library a mesh or the class it inherits from stems from, without importing any."""
    roots = {base.__module__.partition(".")[0] for base in type(mesh).__mro__}
    return next((name for name in ("trimesh", "pyvista", "pymeshlab", "vtkmodules") if name in roots), None)


def _is(mesh: Any, *names: str) -> bool:
    return not {base.__name__ for base in type(mesh).__mro__}.isdisjoint(names)


# ---------------------------------------------------------------------------------------------- trimesh


def from_trimesh(mesh: Any, quads: ArrayLike | None = None) -> QuadMesh:
    """See :meth:`quadcurv.QuadMesh.from_trimesh`."""
    mesh = _sole_geometry(mesh)
    triangles = np.asarray(mesh.faces)
    faces, recovery = _recovered_quads(mesh, triangles) if quads is None else (quads, None)
    result = QuadMesh(np.asarray(mesh.vertices), faces)
    n_quads = int(np.count_nonzero(result.faces[:, 3] >= 0))
    result = result.with_recovery(Recovery(recovery or "given", 2 * n_quads / max(len(triangles), 1)))
    _warn_of_seam(result)
    return result


def _sole_geometry(mesh: Any) -> Any:
    """The one Trimesh of a scene, where it stands there; a Trimesh itself."""
    if _library(mesh) != "trimesh" or not _is(mesh, "Trimesh", "Scene"):
        raise TypeError(f"mesh: expected a trimesh.Trimesh or a Scene of one, got {type(mesh).__name__}")
    if _is(mesh, "Trimesh"):
        return mesh
    nodes = list(mesh.graph.nodes_geometry)
    if len(nodes) != 1:
        hint = "; to_mesh() joins them" if nodes else ""
        raise MeshError(f"mesh: a Scene of {len(nodes)} geometries, expected one{hint}")
    transform, name = mesh.graph[nodes[0]]
    if not _is(mesh.geometry[name], "Trimesh"):
        raise TypeError(f"mesh: a Scene of a {type(mesh.geometry[name]).__name__}, expected a Trimesh")
    return mesh.geometry[name].copy().apply_transform(transform)


def _recovered_quads(mesh: Any, triangles: NDArray[np.int64]) -> tuple[Any, str]:
    """Faces of a Trimesh, the quads it was given or loaded with put together again, and by which rule."""
    if triangles.size and triangles.min() < 0:  # left to QuadMesh to name
        return triangles, "none"
    carrier = np.asarray(mesh.face_attributes.get(CARRIER, ()))
    if carrier.shape == (len(triangles),) and carrier.dtype.kind in "iu":
        return repair.quads_by_carrier(triangles, carrier), "carrier"
    if (polygons := _ply_polygons(mesh)) is not None:
        return polygons, "ply"
    return repair.quads_by_order(triangles)


def _ply_polygons(mesh: Any) -> Any:
    """Polygons of the PLY file that a Trimesh was loaded from, if its triangles are still those."""
    from trimesh.geometry import triangulate_quads

    try:
        data = mesh.metadata["_ply_raw"]["face"]["data"]
        binary = isinstance(data, np.ndarray)
        names = data.dtype.names if binary else data
        name = next(name for name in ("vertex_indices", "vertex_index") if name in names)
        table = data[name]["f1"] if binary else data[name]
        polygons = table if np.ndim(table) == 2 else [list(map(int, face)) for face in table]
        unchanged = np.array_equal(triangulate_quads(polygons), mesh.faces)
    except (KeyError, TypeError, ValueError, AttributeError, IndexError, StopIteration):
        return None
    return polygons if unchanged and len(polygons) < len(mesh.faces) else None


def to_trimesh(mesh: QuadMesh) -> Any:
    """See :meth:`quadcurv.QuadMesh.to_trimesh`."""
    import trimesh

    triangles, carrier = repair.split_quads(mesh.faces)
    return trimesh.Trimesh(mesh.points.copy(), triangles, process=False, face_attributes={CARRIER: carrier})


# -------------------------------------------------------------------------------------------- pyvista


def _pyvista_dataset(dataset: Any) -> Any:
    if _library(dataset) == "vtkmodules":
        import pyvista

        dataset = pyvista.wrap(dataset)
    if not _is(dataset, "PolyData", "UnstructuredGrid", "StructuredGrid"):
        raise TypeError(
            f"mesh: expected a PolyData, StructuredGrid or UnstructuredGrid, got {type(dataset).__name__}; "
            "extract_surface() or combine() may give one"
        )
    return dataset


def from_pyvista(dataset: Any) -> QuadMesh:
    """See :meth:`quadcurv.QuadMesh.from_pyvista`."""
    dataset = _pyvista_dataset(dataset)
    if _is(dataset, "StructuredGrid"):
        raise TypeError("mesh: a StructuredGrid is a QuadGrid: use QuadGrid.from_pyvista(...).to_mesh()")
    if _is(dataset, "PolyData"):
        if dataset.n_strips:
            raise MeshError(f"mesh: {dataset.n_strips} triangle strip(s); triangulate() makes them faces")
        sizes, corners = _sizes_and_corners(dataset.GetPolys())
    else:
        sizes, corners = _polygon_cells(dataset)
    result = QuadMesh(np.asarray(dataset.points), formats.polygons(sizes, corners))
    _warn_of_seam(result)
    return result


def _sizes_and_corners(cells: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    from pyvista import convert_array

    offsets, corners = (
        np.array(convert_array(array), np.int64)
        for array in (cells.GetOffsetsArray(), cells.GetConnectivityArray())
    )
    return np.diff(offsets), corners


def _polygon_cells(dataset: Any) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sizes and corners of an UnstructuredGrid of triangles, quads, pixels and polygons."""
    triangle, polygon, pixel, quad = 5, 7, 8, 9
    types = np.asarray(dataset.celltypes)
    if (other := ~np.isin(types, (triangle, polygon, pixel, quad))).any():
        first = int(np.argmax(other))
        raise MeshError(
            f"mesh: {np.count_nonzero(other)} cells are no polygons, first cell {first} of VTK type "
            f"{types[first]}; extract_surface() takes the outside of volumes"
        )
    sizes, corners = _sizes_and_corners(dataset.GetCells())
    third = (np.cumsum(sizes) - 2)[types == pixel]
    corners[third], corners[third + 1] = corners[third + 1], corners[third]
    return sizes, corners


def to_pyvista(mesh: QuadMesh) -> Any:
    """See :meth:`quadcurv.QuadMesh.to_pyvista`."""
    import pyvista

    rows = np.column_stack(((mesh.faces >= 0).sum(axis=1), mesh.faces))
    return pyvista.PolyData(mesh.points.copy(), faces=rows[rows >= 0])


def from_structured(dataset: Any, wrap: Sequence[bool] = (False, False)) -> QuadGrid:
    """See :meth:`quadcurv.QuadGrid.from_pyvista`."""
    dataset = _pyvista_dataset(dataset)
    if not _is(dataset, "StructuredGrid"):
        raise TypeError(f"mesh: expected a pyvista.StructuredGrid, got {type(dataset).__name__}")
    shape = dataset.dimensions
    if sum(size == 1 for size in shape) != 1:
        raise MeshError(f"mesh: a StructuredGrid of dimensions {tuple(shape)}, expected one layer")
    points = np.asarray(dataset.points).reshape(*shape[::-1], 3).transpose(2, 1, 0, 3)
    points = points.squeeze(axis=shape.index(1))
    grid = QuadGrid(points, wrap)
    for axis, name in enumerate(("rows", "columns")):
        gap = np.abs(grid.points.take(0, axis) - grid.points.take(-1, axis)).max()
        meets = gap <= SAME_PLACE * np.ptp(grid.points.reshape(-1, 3), axis=0).max()
        if grid.wrap[axis]:
            if not meets:
                raise MeshError(f"mesh: first and last {name} differ by {gap:.3g} although they wrap")
            points = points.take(range(points.shape[axis] - 1), axis)
        elif meets:
            warnings.warn(
                f"first and last {name} of the StructuredGrid coincide: it is open along a seam that "
                "wrap=... closes",
                stacklevel=3,
            )
    return QuadGrid(points, wrap)


def to_structured(grid: QuadGrid) -> Any:
    """See :meth:`quadcurv.QuadGrid.to_pyvista`."""
    import pyvista

    points = np.pad(grid.points, [*((0, int(w)) for w in grid.wrap), (0, 0)], mode="wrap")
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


# ------------------------------------------------------------------------------------------- pymeshlab


def from_pymeshlab(mesh: Any) -> QuadMesh:
    """See :meth:`quadcurv.QuadMesh.from_pymeshlab`."""
    mesh = _current_mesh(mesh)
    faces = mesh.polygonal_face_list()
    corners = np.concatenate(faces) if len(faces) else ()
    result = QuadMesh(mesh.transformed_vertex_matrix(), formats.polygons([len(f) for f in faces], corners))
    _warn_of_seam(result)
    return result


def _current_mesh(mesh: Any) -> Any:
    if _library(mesh) != "pymeshlab" or not _is(mesh, "MeshSet", "Mesh"):
        raise TypeError(f"mesh: expected a pymeshlab.MeshSet or Mesh, got {type(mesh).__name__}")
    if _is(mesh, "MeshSet"):
        if mesh.mesh_number() == 0:
            raise MeshError("mesh: an empty MeshSet")
        mesh = mesh.current_mesh()
    if not mesh.is_compact():
        raise MeshError("mesh: the MeshLab mesh has deleted elements; compact() removes them")
    return mesh


def to_pymeshlab(mesh: QuadMesh) -> Any:
    """See :meth:`quadcurv.QuadMesh.to_pymeshlab`."""
    try:
        import pymeshlab
    except ModuleNotFoundError:
        raise ImportError('pymeshlab is not installed: pip install "quadcurv[meshlab]"') from None
    except ImportError as error:
        raise ImportError(f"pymeshlab lacks a system library (on Debian, libgl1): {error}") from None
    meshes = pymeshlab.MeshSet()
    # A file, since the constructor that takes polygons rounds positions to single precision.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "quadcurv.ply"
        formats.write_ply(path, mesh.points, mesh.faces, {})
        meshes.load_new_mesh(str(path))
    return meshes


# --------------------------------------------------------------------------------------------- results


def attach(mesh: Any, name: str, values: ArrayLike, colormap: str | None = "viridis") -> None:
    """Put values at the vertices of another library's mesh, where its users look for them.

    Parameters
    ----------
    mesh : trimesh.Trimesh, pyvista.PolyData, StructuredGrid, UnstructuredGrid, pymeshlab.MeshSet or Mesh
        Changed in place:

        - trimesh: ``vertex_attributes[name]``, and for scalars the colours of the vertices from their
          least to their largest value, grey where not finite; they replace the mesh's visual;
        - pyvista: ``point_data[name]``, made the active scalars (or vectors);
        - pymeshlab: the custom vertex attribute `name`, and in a MeshSet, for scalars, the vertex scalar
          ("quality") of its current mesh too.
    name : str
        In a MeshSet a word that MeshLab's functions can use: letters, digits and underscores.
    values : (n,) or (n, 3) array_like
        One entry a vertex; of a StructuredGrid also (r, c) or (r, c, 3), as quadcurv returns them.
    colormap : str or None
        A matplotlib colormap for trimesh; None leaves the visual alone.

    Raises
    ------
    MeshError
        A ValueError: another number of values, or MeshLab refuses the name.
    TypeError
        None of these types.
    """
    array = np.asarray(values)
    match _library(mesh):
        case "trimesh" if _is(mesh, "Trimesh"):
            array = _checked_values(name, array, (len(mesh.vertices),))
            mesh.vertex_attributes[name] = array.copy()
            if colormap is not None and array.ndim == 1:
                from trimesh.visual import ColorVisuals

                mesh.visual = ColorVisuals(mesh, vertex_colors=_colours(array, colormap))
        case "pyvista":
            dataset = _pyvista_dataset(mesh)
            if _is(dataset, "StructuredGrid") and array.ndim >= 2 and len(array) != dataset.n_points:
                array = in_vtk_order(array, dataset)
            array = _checked_values(name, array, (dataset.n_points,))
            dataset.point_data.set_array(array, name, deep_copy=True)
            setattr(dataset.point_data, f"active_{'scalars' if array.ndim == 1 else 'vectors'}_name", name)
        case "pymeshlab":
            _attach_to_meshlab(mesh, name, array)
        case _:
            raise TypeError(
                f"mesh: expected a Trimesh, a pyvista dataset, a MeshSet or Mesh, got {type(mesh).__name__}"
            )


def _attach_to_meshlab(mesh: Any, name: str, values: NDArray[Any]) -> None:
    import pymeshlab

    target = _current_mesh(mesh)
    values = _checked_values(name, values, (target.vertex_number(),)).astype(float)
    if not (name.isascii() and name.isidentifier()):
        raise MeshError(f"name: expected letters, digits and underscores for MeshLab, got {name!r}")
    try:
        if values.ndim == 2:
            target.add_vertex_custom_point_attribute(values, name)
            return
        target.add_vertex_custom_scalar_attribute(values, name)
        if target is not mesh:
            mesh.compute_scalar_by_function_per_vertex(q=name)
    except (pymeshlab.PyMeshLabException, RuntimeError) as error:
        raise MeshError(f"name: MeshLab refuses {name!r}: {error}") from None


def _checked_values(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    if not isinstance(name, str) or not name:
        raise TypeError(f"name: expected a word, got {name!r}")
    if values.dtype.kind not in "biuf":
        raise MeshError(f"{name}: expected real numbers, got dtype {values.dtype}")
    if values.shape not in (shape, (*shape, 3)):
        raise MeshError(f"{name}: shape {values.shape}, expected {shape} or {(*shape, 3)}")
    return values


def _colours(values: NDArray[Any], colormap: str) -> NDArray[np.uint8]:
    """RGBA of scalars from least to largest; grey where not finite."""
    from matplotlib import colormaps

    if colormap not in colormaps:
        raise ValueError(f"colormap: matplotlib has no {colormap!r}")
    finite = np.isfinite(values)
    colours = np.full((len(values), 4), (128, 128, 128, 255), np.uint8)
    if finite.any():
        known = values[finite].astype(float)
        span = np.ptp(known)
        colours[finite] = colormaps[colormap]((known - known.min()) / (span or 1.0), bytes=True)
    return colours


def _warn_of_seam(mesh: QuadMesh) -> None:
    """Say so where boundary vertices coincide: the mesh is open although it looks closed."""
    stencils = mesh.stencils()
    open_ = np.flatnonzero(~stencils.closed & (stencils.valence > 0))
    points = mesh.points[open_]
    if not open_.size:
        return
    gap, near = scipy.spatial.cKDTree(points).query(points, k=2)
    seam = gap[:, 1] <= SAME_PLACE * np.ptp(mesh.points, axis=0).max()
    if seam.any():
        first = int(np.argmax(seam))
        other = near[first][near[first] != first][0]
        warnings.warn(
            f"{np.count_nonzero(seam)} boundary vertices lie where others do, to {gap[seam, 1].max():.2g}, "
            f"first vertices {open_[first]} and {open_[other]}: the mesh is open along a seam; "
            "merge_points closes it",
            stacklevel=4,
        )


# ----------------------------------------------------------------------------------------------- files


def read(path: str | os.PathLike[str]) -> QuadMesh | QuadGrid:
    """Read a mesh file; quads and polygons are kept wherever the format has them.

    Parameters
    ----------
    path : path-like
        ==================  ==============================  =====================================
        suffix              quads and polygons              positions
        ==================  ==============================  =====================================
        .obj                kept                            double
        .off (ASCII)        kept                            double
        .ply                kept                            as the file has them, up to double
        .vtp .vtu .vtk      kept                            as the file has them, up to double
        .vts .vtk           a grid: QuadGrid                as the file has them, up to double
        .stl                triangles                       single; its corners are merged
        .glb .gltf          triangles, or quads again       single
                            as from a Trimesh
        ==================  ==============================  =====================================

    Returns
    -------
    QuadMesh or QuadGrid
        Vertices as in the file; none is merged (but for STL, which repeats every corner) and none is
        split where only texture coordinates or normals differ (but for GLB, which stores them so).

    Raises
    ------
    MeshError
        A ValueError: the file holds no surface mesh, or not one of these formats.
    OSError
        It cannot be opened.

    Warns
    -----
    UserWarning
        Boundary vertices coincide: see :func:`merge_points`.
    """
    path = Path(path)
    path.open("rb").close()
    try:
        return _read(path)
    except MeshError as error:
        raise MeshError(f"{path}: {error}") from error.__cause__


def _read(path: Path) -> QuadMesh | QuadGrid:
    suffix = path.suffix.lower()
    if suffix in formats.READERS:
        mesh = QuadMesh(*formats.READERS[suffix](path))
        _warn_of_seam(mesh)
        return mesh
    if suffix in (".stl", ".glb", ".gltf"):
        import trimesh

        scene = _foreign(trimesh.load_scene, path, process=False)
        if suffix != ".stl":
            return from_trimesh(scene)
        soup = _sole_geometry(scene)
        return repair.merge_points(QuadMesh(soup.vertices, soup.faces))[0]
    if suffix in (".vtp", ".vtu", ".vtk", ".vts"):
        import pyvista

        dataset = _foreign(pyvista.read, path)
        return from_structured(dataset) if _is(dataset, "StructuredGrid") else from_pyvista(dataset)
    raise MeshError(f"cannot read {suffix or 'a file without suffix'}")


def _foreign(reader: Callable[..., Any], path: Path, **options: Any) -> Any:
    """What another library's reader, which may raise anything, makes of a file."""
    try:
        return reader(path, **options)
    except Exception as error:
        raise MeshError(f"{type(error).__name__}: {error}") from error


def write(path: str | os.PathLike[str], mesh: Any, point_data: Mapping[str, ArrayLike] | None = None) -> None:
    """Write a mesh file with values at its vertices.

    Parameters
    ----------
    path : path-like
        ========  ======  ============  ========================================================
        suffix    quads   positions     values
        ========  ======  ============  ========================================================
        .ply      kept    double        double; vectors as NAME_x, NAME_y, NAME_z, but "normal"
                                        as nx, ny, nz. Integers and booleans stay such.
                                        Of scalars MeshLab reads the one named "quality"
        .vtp      kept    double        as they are
        .obj      kept    double        none
        .off      kept    double        none
        .glb      cut     single        single, finite only, as _NAME; the first scalars also as
                                        colours. :func:`read` puts the quads together again
        ========  ======  ============  ========================================================

    mesh : object
        Anything :func:`as_mesh` takes but a StaggeredGrid; a grid is written as its faces, row by row.
    point_data : mapping of str to (n,) or (n, 3) array_like
        Of a grid (r, c) or (r, c, 3).

    Raises
    ------
    MeshError
        A ValueError: values of another shape, or that the format cannot hold; an unknown suffix.
    OSError
        It cannot be written.
    """
    path = Path(path)
    mesh = as_mesh(mesh)
    if isinstance(mesh, StaggeredGrid):
        raise MeshError("mesh: a StaggeredGrid is no face list")
    shape = mesh.shape if isinstance(mesh, QuadGrid) else (len(mesh.points),)
    data = {
        name: _checked_values(name, np.asarray(values), shape) for name, values in (point_data or {}).items()
    }
    data = {name: v.reshape(-1, *v.shape[len(shape) :]) for name, v in data.items()}
    if isinstance(mesh, QuadGrid):
        mesh = mesh.to_mesh()
    match path.suffix.lower():
        case ".ply":
            formats.write_ply(path, mesh.points, mesh.faces, data)
        case ".vtp":
            surface = to_pyvista(mesh)
            surface.point_data.update(data)
            surface.save(path)
        case ".glb":
            _write_glb(path, mesh, data)
        case ".obj" | ".off" as suffix:
            if data:
                raise MeshError(f"point_data: {suffix} holds no values; .ply and .vtp do")
            {".obj": formats.write_obj, ".off": formats.write_off}[suffix](path, mesh.points, mesh.faces)
        case suffix:
            raise MeshError(f"{path}: cannot write {suffix or 'a file without suffix'}")


def _write_glb(path: Path, mesh: QuadMesh, data: Mapping[str, NDArray[Any]]) -> None:
    surface = to_trimesh(mesh)
    coloured = False
    for name, values in data.items():
        if not np.isfinite(values).all():
            raise MeshError(f"{name}: glTF holds finite values only; .ply and .vtp hold others")
        attach(surface, name, values.astype(np.float32), None if coloured else "viridis")
        coloured |= values.ndim == 1
    path.write_bytes(surface.export(file_type="glb"))
