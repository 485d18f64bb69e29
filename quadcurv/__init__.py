"""Mean curvature on quad meshes and logically Cartesian grids, with every operator side by side."""

from quadcurv.boundary import boundary_treatment, stencils
from quadcurv.curvature import (
    dual_areas,
    evaluate,
    gaussian_curvature,
    mass_matrix,
    mean_curvature,
    mean_curvature_normal,
    principal_curvatures,
    stiffness_matrix,
    vertex_normals,
)
from quadcurv.io import as_mesh, attach, read, read_values, to_pymeshlab, to_pyvista, to_trimesh, write
from quadcurv.kernels.ranges import set_threads
from quadcurv.mesh import QuadGrid, QuadMesh, Recovery, StaggeredGrid
from quadcurv.repair import as_grid, duplicate_points, flip, merge_points, orient, pair_triangles
from quadcurv.schemes import SCHEMES, Curvatures, Fit, Laplacian, Scheme
from quadcurv.stencils import CornerTable, Stencils
from quadcurv.types import MeshError, MeshWarning, PrecisionWarning

__all__ = [
    "SCHEMES",
    "CornerTable",
    "Curvatures",
    "Fit",
    "Laplacian",
    "MeshError",
    "MeshWarning",
    "PrecisionWarning",
    "QuadGrid",
    "QuadMesh",
    "Recovery",
    "Scheme",
    "StaggeredGrid",
    "Stencils",
    "as_grid",
    "as_mesh",
    "attach",
    "boundary_treatment",
    "dual_areas",
    "duplicate_points",
    "evaluate",
    "flip",
    "gaussian_curvature",
    "mass_matrix",
    "mean_curvature",
    "mean_curvature_normal",
    "merge_points",
    "orient",
    "pair_triangles",
    "principal_curvatures",
    "read",
    "read_values",
    "set_threads",
    "stencils",
    "stiffness_matrix",
    "to_pymeshlab",
    "to_pyvista",
    "to_trimesh",
    "vertex_normals",
    "write",
]
__version__ = "0.2.0"
