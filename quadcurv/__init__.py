"""Mean curvature on quad meshes and logically Cartesian grids, with every operator side by side."""

from quadcurv.boundary import stencils
from quadcurv.curvature import (
    dual_areas,
    mass_matrix,
    mean_curvature,
    mean_curvature_normal,
    stiffness_matrix,
    vertex_normals,
)
from quadcurv.interop import as_mesh, read
from quadcurv.mesh import CornerTable, MeshError, QuadGrid, QuadMesh, StaggeredGrid, Stencils
from quadcurv.schemes import SCHEMES, Scheme

__all__ = [
    "SCHEMES",
    "CornerTable",
    "MeshError",
    "QuadGrid",
    "QuadMesh",
    "Scheme",
    "StaggeredGrid",
    "Stencils",
    "as_mesh",
    "dual_areas",
    "mass_matrix",
    "mean_curvature",
    "mean_curvature_normal",
    "read",
    "stencils",
    "stiffness_matrix",
    "vertex_normals",
]
__version__ = "0.1.0"
