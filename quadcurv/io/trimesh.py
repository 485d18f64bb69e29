"""Meshes of trimesh, whose quads are cut into triangles, and back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io import loaded
from quadcurv.io.base import Content, Library, checked_values, is_a, register
from quadcurv.io.colours import colours
from quadcurv.io.quads import quads_by_carrier, quads_by_order, split_quads
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError

CARRIER = "quadcurv"  # face attribute of a Trimesh that says which quad a triangle was cut from


def content(mesh: Any) -> Content:
    """Quads by, in this order: our own carrier, the file that was loaded, the order of the triangles."""
    if is_a(mesh, "Scene") and (whole := _file_of_scene(mesh)) is not None:
        return whole
    mesh = sole_geometry(mesh)
    triangles = np.asarray(mesh.faces)
    faces, rule = _recovered(mesh, triangles)
    n = len(mesh.vertices)
    values = {name: np.asarray(v) for name, v in mesh.vertex_attributes.items() if len(v) == n}
    return Content(np.asarray(mesh.vertices), faces, values, (rule, len(triangles)))


def sole_geometry(mesh: Any) -> Any:
    """The one Trimesh of a scene, where it stands there; a Trimesh itself."""
    if is_a(mesh, "Trimesh"):
        return mesh
    if not is_a(mesh, "Scene"):
        raise TypeError(f"mesh: expected a trimesh.Trimesh or a Scene of one, got {type(mesh).__name__}")
    nodes = list(mesh.graph.nodes_geometry)
    if len(nodes) != 1:
        hint = "; to_mesh() joins them" if nodes else ""
        raise MeshError(f"mesh: a Scene of {len(nodes)} geometries, expected one{hint}")
    transform, name = mesh.graph[nodes[0]]
    if not is_a(mesh.geometry[name], "Trimesh"):
        raise TypeError(f"mesh: a Scene of a {type(mesh.geometry[name]).__name__}, expected a Trimesh")
    return mesh.geometry[name].copy().apply_transform(transform)


def _file_of_scene(scene: Any) -> Content | None:
    """The mesh of a file that trimesh took apart by materials or groups."""
    meshes = list(scene.geometry.values())
    files = {loaded.source(mesh) for mesh in meshes if is_a(mesh, "Trimesh")}
    path = files.pop() if len(files) == 1 else None
    if len(meshes) < 2 or path is None:
        return None
    if not all(np.array_equal(scene.graph[node][0], np.eye(4)) for node in scene.graph.nodes_geometry):
        return None
    corners = np.concatenate([np.asarray(mesh.triangles) for mesh in meshes])
    found = loaded.faces_of_source(path, corners)
    return None if found is None else replace(found[0], pairing=("file", len(corners)))


def _recovered(mesh: Any, triangles: NDArray[np.int64]) -> tuple[Any, str]:
    """Faces of a Trimesh, the quads it was given or loaded with put together again, and by which rule."""
    if triangles.size and triangles.min() < 0:  # left to QuadMesh to name
        return triangles, "none"
    carrier = np.asarray(mesh.face_attributes.get(CARRIER, ()))
    if carrier.shape == (len(triangles),) and carrier.dtype.kind in "iu":
        return quads_by_carrier(triangles, carrier), "carrier"
    if (polygons := _ply_polygons(mesh)) is not None:
        return polygons, "ply"
    faces, rule = quads_by_order(triangles)
    # Where not all is told by the order the file may know, if it is still there and still the same.
    if rule == "block" and 2 * len(faces) == len(triangles):
        return faces, rule
    path = loaded.source(mesh)
    if path is None or triangles.max(initial=-1) >= len(mesh.vertices):
        return faces, rule
    found = loaded.faces_of_source(path, np.asarray(mesh.triangles))
    if found is None:
        return faces, rule
    as_read = loaded.with_corners(found[0], triangles.ravel()[found[1]])
    if len(as_read) == len(triangles) and rule == "block":  # quads that trimesh wrote as triangles
        return faces, rule
    n_quads = np.count_nonzero(faces[:, 3] >= 0)
    agreed = isinstance(as_read, np.ndarray) and np.count_nonzero(as_read[:, 3] >= 0) == n_quads
    return as_read, rule if agreed else "file"


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


def from_mesh(mesh: QuadMesh) -> Any:
    """A Trimesh of quads cut in two, which carries which quad each triangle was cut from."""
    import trimesh

    triangles, carrier = split_quads(mesh.faces)
    return trimesh.Trimesh(mesh.points.copy(), triangles, process=False, face_attributes={CARRIER: carrier})


def attach(mesh: Any, name: str, values: NDArray[Any], colormap: str | None) -> None:
    """Vertex attributes, and colours for scalars."""
    if not is_a(mesh, "Trimesh"):
        raise TypeError(f"mesh: expected a Trimesh, got {type(mesh).__name__}")
    values = checked_values(name, values, (len(mesh.vertices),))
    mesh.vertex_attributes[name] = values.copy()
    if colormap is not None and values.ndim == 1:
        show(mesh, colours(values, colormap))


def show(mesh: Any, rgba: NDArray[np.uint8]) -> None:
    """Colours of the vertices as the visual of a Trimesh."""
    from trimesh.visual import ColorVisuals

    mesh.visual = ColorVisuals(mesh, vertex_colors=rgba)


register(Library(("trimesh",), content, attach))
