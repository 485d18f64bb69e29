"""Meshes of compas and Open3D, told by what they offer and never imported."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadcurv.io.base import Content, Library, register


def compas(mesh: Any) -> Content:
    """Vertices and polygons of a compas mesh, in the order in which it lists them."""
    points, faces = mesh.to_vertices_and_faces()
    return Content(np.asarray(points, float), faces)


def open3d(mesh: Any) -> Content:
    """Vertices and triangles of a TriangleMesh, legacy or of tensors."""
    if hasattr(mesh, "triangles"):
        return Content(np.asarray(mesh.vertices), np.asarray(mesh.triangles))
    return Content(mesh.vertex["positions"].numpy(), mesh.triangle["indices"].numpy())


def _like_compas(mesh: Any) -> bool:
    return callable(getattr(mesh, "to_vertices_and_faces", None))


def _like_open3d(mesh: Any) -> bool:
    names = (("vertices", "triangles"), ("vertex", "triangle"))
    return any(hasattr(mesh, one) and hasattr(mesh, other) for one, other in names)


register(Library(("compas",), compas, takes=_like_compas))
register(Library(("open3d",), open3d, takes=_like_open3d))
