"""
A noisy scan, with error bars
=============================

Noise of size s in the positions makes an error of about s / h² in a curvature, which is soon larger than
the curvature. "jet", the default, looks at the residuals of its fits, takes as many rings of faces as pay,
and says how far to trust the result.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import maps

torus = qc.surfaces.torus(major=2.0, minor=0.8)
mesh, xi, eta = torus.sample((96, 48), "faces")
exact = torus.mean_curvature(xi, eta)
noise = 0.002  # of a tube of radius 0.8
rng = np.random.default_rng(1)
scan = mesh.with_points(
    mesh.points + noise * rng.normal(size=(len(mesh.points), 1)) * qc.vertex_normals(mesh)
)

# %%
# Operators of one ring pass the noise on, amplified; "jet" averages it out.
found = qc.compare(scan, ["finite_volume", "jet"], exact)
maps(found, "mean_curvature")

# %%
# The errors in numbers. Everything that is known comes from :func:`quadcurv.curvatures`: the noise itself,
# how many rings were taken, and what H may be off by in 95 % of cases.
found

# %%
all_of_it = qc.curvatures(scan)
print(f"noise {np.median(all_of_it.noise):.4f}, as put in {noise:.4f}")
print("rings", np.unique(all_of_it.rings), f"interval of H ± {np.median(all_of_it.interval.mean):.3f}")


# %%
# These intervals count what smoothing costs beside the noise; the standard errors, noise alone.
def main() -> float:
    """Return the part of the vertices whose error is within the interval of 95 %."""
    return float((np.abs(all_of_it.mean - exact) <= all_of_it.interval.mean).mean())


print(main())
