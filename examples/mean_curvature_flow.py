r"""
Mean curvature flow
===================

A surface that moves along its mean curvature normal, dx/dt = 2 H n, loses area as fast as it can. One
implicit step solves a linear system of the mass and stiffness matrices,

.. math:: (M + \tau S) \, x_{new} = M x .
"""

import numpy as np
import pyvista as pv
from scipy.sparse.linalg import spsolve

import quadcurv as qc

ball, xi, eta = qc.surfaces.cubed_sphere().sample((14, 14), "faces")
bumps = 1 + 0.25 * np.sin(4 * ball.points[:, :1]) * np.cos(5 * ball.points[:, 1:2])
mesh = ball.with_points(ball.points * bumps)

# %%
# The bilinear element serves here: its matrices are symmetric and see every bump. ``with_points`` moves the
# points and keeps the connectivity, which is checked once. A sphere of radius R shrinks as R² = 1 - 4 t.
STEP, SCHEME = 0.004, "bilinear"
stages, time = [mesh], 0.0
for step in range(40):
    M, S = qc.mass_matrix(mesh, SCHEME), qc.stiffness_matrix(mesh, SCHEME)
    mesh = mesh.with_points(spsolve((M + STEP * S).tocsc(), M @ mesh.points))
    if step in (3, 12, 39):
        stages.append(mesh)

# %%
# Mean curvature from -4, blue, to 4, red. The bumps go first, the sphere last.
STYLE = {
    "cmap": "RdBu_r",
    "show_edges": True,
    "edge_opacity": 0.25,
    "lighting": False,
    "show_scalar_bar": False,
}
plotter = pv.Plotter(shape=(1, 4), off_screen=True, window_size=(1600, 420), border=False)
for k, stage in enumerate(stages):
    plotter.subplot(0, k)
    H = qc.mean_curvature(stage)
    plotter.add_mesh(qc.to_pyvista(stage), scalars=H, clim=(-4, 4), **STYLE)
plotter.link_views()
plotter.view_vector((1, 0.6, 0.5))
plotter.camera.zoom(0.9)


# %%
def main() -> float:
    """Return by how much the distance from the centre varies in the end, over its mean."""
    radius = np.linalg.norm(mesh.points - mesh.points.mean(axis=0), axis=1)
    return float(radius.std() / radius.mean())


print(main())
