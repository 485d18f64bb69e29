"""Meshes of other libraries, and files, as ours. Imports stay inside the functions."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np

from quadcurv.mesh import Mesh, MeshError, QuadGrid, QuadMesh, StaggeredGrid


def as_mesh(mesh: Any) -> Mesh:
    """Make a mesh of anything that holds one.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid, trimesh.Trimesh, pyvista.PolyData, path or (points, faces)
        Our own meshes are returned as they are.

    Returns
    -------
    QuadMesh, QuadGrid or StaggeredGrid

    Raises
    ------
    MeshError
        A ValueError: the content is not a mesh.
    TypeError
        None of these types.
    """
    if isinstance(mesh, QuadMesh | QuadGrid | StaggeredGrid):
        return mesh
    if isinstance(mesh, str | os.PathLike):
        return read(mesh)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        return QuadMesh(*mesh)
    library = type(mesh).__module__.partition(".")[0]
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces") and library == "trimesh":
        return from_trimesh(mesh)
    if hasattr(mesh, "regular_faces"):
        return from_pyvista(mesh)
    raise TypeError(f"mesh: expected a mesh, a path or (points, faces), got {type(mesh).__name__}")


def read(path: str | os.PathLike[str]) -> QuadMesh:
    """Read a mesh file, its quads and polygons kept.

    Parameters
    ----------
    path : path-like
        OBJ.

    Returns
    -------
    QuadMesh

    Raises
    ------
    MeshError
        A ValueError: the file holds no mesh, or not one of these formats.
    OSError
        It cannot be opened.
    """
    path = Path(path)
    if path.suffix.lower() == ".obj":
        return QuadMesh(*_read_obj(path))
    raise MeshError(f"{path}: cannot read {path.suffix or 'a file without suffix'}")


def _read_obj(path: Path) -> tuple[np.ndarray, list[list[int]]]:
    """Positions and polygons of an OBJ file.

    The readers at hand triangulate (trimesh), split vertices at texture seams (VTK, trimesh) or refuse
    faces of different sizes (libigl).
    """
    points: list[list[float]] = []
    faces: list[list[int]] = []
    with path.open() as lines:
        for number, line in enumerate(lines, 1):
            kind, *words = line.split() or [""]
            try:
                if kind == "v":
                    points.append([float(w) for w in words[:3]])
                elif kind == "f":
                    vertices = [int(w.partition("/")[0]) for w in words]
                    # Negative indices count back from the last vertex read.
                    faces.append([v - 1 if v > 0 else len(points) + v for v in vertices])
            except ValueError:
                raise MeshError(f"{path}, line {number}: {line.strip()!r} is not OBJ") from None
    return np.array(points).reshape(-1, 3), faces
