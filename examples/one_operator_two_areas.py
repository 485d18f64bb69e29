"""
One operator, two areas
=======================

The finite-volume scheme integrates over a cell, Liu's formula differentiates a bilinear patch. On quads
they have one and the same stiffness matrix and differ in the area of a vertex only; see :doc:`/theory`.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import maps

grid, xi, eta = qc.surfaces.torus().sample((40, 24), "faces")
rough = grid.with_points(grid.points + np.random.default_rng(0).normal(0, 0.03, grid.points.shape))
S, S_liu = (qc.stiffness_matrix(rough, scheme) for scheme in ("finite_volume", "liu"))
print(f"largest difference of the matrices: {np.abs((S - S_liu).data).max(initial=0):.0e}")

# %%
# So at every vertex the two curvatures are one flux over two areas.
areas = [qc.dual_areas(rough, scheme) for scheme in ("finite_volume", "liu")]
Hn = [qc.mean_curvature_normal(rough, scheme) for scheme in ("finite_volume", "liu")]
difference = np.abs(areas[0][:, None] * Hn[0] - areas[1][:, None] * Hn[1]).max()
print(f"largest difference of the fluxes: {difference:.0e}")

# %%
# On the pillow sphere, whose grid lines kink along the diagonals of two squares, both are second order in
# the mean and first order on the seams.
pillow = qc.surfaces.pillow_sphere()
mesh, xi, eta = pillow.sample((80, 40), "staggered")
maps(qc.compare(mesh, ["finite_volume", "liu"], pillow.mean_curvature(xi, eta)), "error")


# %%
def main() -> float:
    """Return the largest ratio of the two areas on the rough torus."""
    return float((areas[1] / areas[0]).max())


print(main())
