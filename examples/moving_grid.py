"""
A grid that moves
=================

In a simulation the points move and the connectivity stays. ``with_points`` keeps what was found of it, and
``out=`` writes into arrays that are there already.
"""

import numpy as np
import pyvista as pv

import quadcurv as qc

xi, eta = np.meshgrid(np.linspace(-3, 3, 61), np.linspace(-3, 3, 61), indexing="ij")
distance = np.hypot(xi, eta)


def height(time: float) -> np.ndarray:
    """A wave that runs outward from the middle."""
    return 0.15 * np.cos(3 * distance - 4 * time) * np.exp(-((distance - 1.2 * time) ** 2))


mesh = qc.QuadGrid(np.stack([xi, eta, height(0)], axis=-1)).to_mesh()
out = {"mean_curvature": np.empty(len(mesh.points)), "mean_curvature_normal": np.empty((len(mesh.points), 3))}

# %%
# Eleven times, one connectivity, no new array.
largest, shown = [], []
for time in np.linspace(0, 1.5, 11):
    points = np.column_stack([xi.ravel(), eta.ravel(), height(time).ravel()])
    moved = mesh.with_points(points)
    qc.evaluate(moved, *out, scheme="finite_volume", out=out)
    largest.append(np.nanmax(np.abs(out["mean_curvature"])))
    if len(largest) in (1, 6, 11):
        shown.append((moved, out["mean_curvature"].copy()))
print(np.round(largest, 2))

# %%
# Mean curvature from -2, blue, to 2, red, at the beginning, half way and in the end.
STYLE = {
    "cmap": "RdBu_r",
    "show_edges": True,
    "edge_opacity": 0.25,
    "lighting": False,
    "show_scalar_bar": False,
}
plotter = pv.Plotter(shape=(1, 3), off_screen=True, window_size=(1600, 460), border=False)
for k, (moved, H) in enumerate(shown):
    plotter.subplot(0, k)
    plotter.add_mesh(qc.to_pyvista(moved), scalars=H, clim=(-2, 2), **STYLE)
plotter.link_views()
plotter.view_vector((0.3, -1, 0.9))
plotter.camera.zoom(1.2)


# %%
def main() -> float:
    """Return the largest |H| at the last time."""
    return float(largest[-1])


print(main())
