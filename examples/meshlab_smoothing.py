"""
MeshLab: smoothing noise away
=============================

Quads go through MeshLab's filters and back: its faux edges keep the pairs of triangles together. This wants
the extra ``meshlab``, which is GPL-3.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import Style, maps

sphere, _, _ = qc.surfaces.cubed_sphere().sample((16, 16), "faces")
noise = np.random.default_rng(0).normal(0, 0.002, sphere.points.shape)
rough = sphere.with_points(sphere.points + noise)

# %%
# Taubin's filter smooths without shrinking.
meshes = qc.to_pymeshlab(rough)
meshes.apply_coord_taubin_smoothing(stepsmoothnum=20)
smooth = qc.as_mesh(meshes)
H_rough, H_smooth = (qc.mean_curvature(mesh, "finite_volume") for mesh in (rough, smooth))
print(f"{smooth}: H varies by {np.std(H_rough):.2g}, smoothed by {np.std(H_smooth):.2g}")

# %%
# In MeshLab the values are a custom attribute, and the vertex quality that its filters and colours use.
qc.attach(meshes, "H", H_smooth)
meshes.compute_color_from_scalar_per_vertex()

# %%
# Before and after.
maps(qc.compare(rough, "finite_volume", 1.0), "error", Style(title="with noise", limits=(1e-3, 1)))
maps(qc.compare(smooth, "finite_volume", 1.0), "error", Style(title="smoothed", limits=(1e-3, 1)))


# %%
def main() -> float:
    """Return by which factor smoothing lowers the error of the mean curvature."""
    return float(np.std(H_rough - 1) / np.std(H_smooth - 1))


print(main())
