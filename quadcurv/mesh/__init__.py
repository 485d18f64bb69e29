"""Meshes, checked once and frozen."""

from quadcurv.mesh.face_list import QuadMesh, Recovery
from quadcurv.mesh.grid import QuadGrid
from quadcurv.mesh.staggered import StaggeredGrid

__all__ = ["Mesh", "QuadGrid", "QuadMesh", "Recovery", "StaggeredGrid"]

Mesh = QuadMesh | QuadGrid | StaggeredGrid
