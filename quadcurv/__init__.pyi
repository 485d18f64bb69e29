from . import curves, schemes, surfaces
from .boundary import boundary_treatment, one_rings
from .comparison import compare
from .curvature import (
    curvatures,
    dual_areas,
    evaluate,
    gaussian_curvature,
    laplace_beltrami,
    mass_matrix,
    mean_curvature,
    mean_curvature_normal,
    principal_curvatures,
    stiffness_matrix,
    vertex_normals,
)
from .io import as_mesh, attach, read, read_values, to_pymeshlab, to_pyvista, to_trimesh, write
from .kernels.ranges import set_threads
from .mesh import QuadGrid, QuadMesh, StaggeredGrid
from .mesh_quality import quality, summary
from .refinement import convergence
from .repair import as_grid, duplicate_points, flip, merge_points, orient, pair_triangles
from .schemes import SCHEMES, Curvatures, Fit, Laplacian
from .types import MeshError, MeshWarning, PrecisionWarning
from .viewing import plot, view

__version__: str
__all__: list[str]
