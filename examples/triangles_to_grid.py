"""
From triangles to quads to a grid
=================================

What was lost on the way through a triangle format is found again: pairs of triangles by their shape, and
the grid by its connectivity.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import maps

torus, _, _ = qc.surfaces.torus().sample((36, 24))
faces = torus.to_mesh().faces
halves = np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))
triangles = qc.QuadMesh(torus.points.reshape(-1, 3), np.random.default_rng(0).permutation(halves))

# %%
quads = qc.pair_triangles(triangles)
grid, vertex = qc.as_grid(quads)
print(triangles, quads, quads.recovery, grid, sep="\n")

# %%
# Values of the grid, put back in the order of the points.
H = np.empty(len(quads.points))
H[vertex] = qc.mean_curvature(grid, "finite_volume")
maps(qc.compare(grid, "finite_volume"), "mean_curvature")


# %%
def main() -> float:
    """Return the largest difference of |H| between the grid that was found and the one we began with."""
    exact = qc.mean_curvature(torus, "finite_volume").ravel()
    return float(np.abs(np.abs(H) - np.abs(exact)).max())


print(main())
