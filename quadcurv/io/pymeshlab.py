"""Meshes of MeshLab, and back. pymeshlab is GPL-3: an extra, imported on demand."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.io import ply
from quadcurv.io.base import Content, Library, checked_values, is_a, polygons, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError


def content(mesh: Any) -> Content:
    """Polygons of a Mesh, or of a MeshSet's current one, where its transformation puts them."""
    mesh = _current_mesh(mesh)
    points, triangles = mesh.transformed_vertex_matrix(), mesh.face_matrix()
    if _has_edges_of_many_faces(triangles):
        # polygonal_face_list() would walk around these for ever.
        note = "more than two triangles share an edge, so that MeshLab cannot tell which make polygons"
        return Content(points, triangles, notes=(note,))
    faces = mesh.polygonal_face_list()
    corners = np.concatenate(faces) if len(faces) else ()
    return Content(points, polygons([len(f) for f in faces], corners))


def _has_edges_of_many_faces(triangles: NDArray[np.integer]) -> bool:
    one, other = triangles.astype(np.int64), np.roll(triangles, -1, axis=1).astype(np.int64)
    edges = np.sort((np.minimum(one, other) << 32 | np.maximum(one, other)).ravel())
    return bool((edges[2:] == edges[:-2]).any())


def _current_mesh(mesh: Any) -> Any:
    if not is_a(mesh, "MeshSet", "Mesh"):
        raise TypeError(f"mesh: expected a pymeshlab.MeshSet or Mesh, got {type(mesh).__name__}")
    if is_a(mesh, "MeshSet"):
        if mesh.mesh_number() == 0:
            raise MeshError("mesh: an empty MeshSet")
        mesh = mesh.current_mesh()
    if not mesh.is_compact():
        raise MeshError("mesh: the MeshLab mesh has deleted elements; compact() removes them")
    return mesh


def from_mesh(mesh: QuadMesh) -> Any:
    """A MeshSet of one mesh, quads and doubles kept."""
    need("pymeshlab")
    try:
        import pymeshlab
    except ImportError as error:
        raise ImportError(f"pymeshlab lacks a system library (on Debian, libgl1): {error}") from None
    meshes = pymeshlab.MeshSet()
    # A file, since the constructor that takes polygons rounds positions to single precision.
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "quadcurv.ply"
        ply.write_ply(path, mesh, {})
        meshes.load_new_mesh(str(path))
    return meshes


def attach(mesh: Any, name: str, values: NDArray[Any], colormap: str | None) -> None:
    """A custom vertex attribute, and in a MeshSet, for scalars, the vertex scalar too."""
    import pymeshlab

    target = _current_mesh(mesh)
    values = checked_values(name, values, (target.vertex_number(),)).astype(float)
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


register(Library(("pymeshlab",), content, attach))
