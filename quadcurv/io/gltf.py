"""glTF files by trimesh: triangles of single precision, paired into quads again where they were."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadcurv.io import trimesh as adapter
from quadcurv.io.base import Content, Format, Values, foreign, register
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError


def read_gltf(path: Path) -> Content:
    """Faces as from a Trimesh."""
    import trimesh

    return adapter.content(foreign(trimesh.load_scene, path, process=False))


def write_glb(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Values as _NAME in single precision, the first scalars also as colours."""
    surface = adapter.from_mesh(mesh)
    coloured = False
    for name, array in values.items():
        if not np.isfinite(array).all():
            raise MeshError(f"{name}: glTF holds finite values only; .ply and .vtp hold others")
        adapter.attach(surface, name, array.astype(np.float32), None if coloured else "viridis")
        coloured |= array.ndim == 1
    path.write_bytes(surface.export(file_type="glb"))


register(Format((".glb",), read_gltf, write_glb, holds_values=True))
register(Format((".gltf",), read_gltf))
