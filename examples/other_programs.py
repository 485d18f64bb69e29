"""
Meshes of other programs
========================

The two arrays of points and faces suffice, whoever has them: Gmsh, compas, Blender, a solver. Files go
through :func:`quadcurv.read` and :func:`quadcurv.write`.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import quadcurv as qc
from quadcurv.viewing import Style, maps

# %%
# Polygons of any number of sides are lists of indices. compas calls this ``mesh.to_vertices_and_faces()``.
points = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 1, 1]]
pyramid = qc.as_mesh((points, [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
print(pyramid)

# %%
# A solver's structured grid is a QuadGrid; its results travel in files that ParaView (.vtp) and Blender
# (.ply) read, quads and values kept.
hyperboloid = qc.surfaces.hyperboloid()
grid, xi, eta = hyperboloid.sample((48, 24))
H = qc.mean_curvature(grid)
with TemporaryDirectory() as folder:
    for name in ("hull.vtp", "hull.ply"):
        path = Path(folder) / name
        qc.write(path, grid, {"H": H})
        print(f"{name}: {qc.read(path)} with values {list(qc.read_values(path))}")
    back = qc.read_values(Path(folder) / "hull.ply")["H"]

# %%
maps(qc.compare(grid, "jet"), "mean_curvature", Style(camera=(1, 1, 0.5)))


# %%
def main() -> float:
    """Return the largest difference between the values written and those read back."""
    return float(np.abs(back - H.ravel()).max())


print(main())
