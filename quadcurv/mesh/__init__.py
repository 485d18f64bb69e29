"""Meshes, checked once and frozen."""

from quadcurv.mesh.blocks import GridBlocks
from quadcurv.mesh.chunked import ChunkedGrid
from quadcurv.mesh.connections import Connection
from quadcurv.mesh.face_list import QuadMesh, Recovery
from quadcurv.mesh.face_parts import FaceParts
from quadcurv.mesh.grid import QuadGrid
from quadcurv.mesh.staggered import StaggeredGrid

__all__ = [
    "ChunkedGrid",
    "Connection",
    "FaceParts",
    "GridBlocks",
    "Mesh",
    "QuadGrid",
    "QuadMesh",
    "Recovery",
    "StaggeredGrid",
]

Mesh = QuadMesh | QuadGrid | StaggeredGrid
