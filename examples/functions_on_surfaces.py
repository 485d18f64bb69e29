"""
Operators on functions
======================

Curvature is the Laplace-Beltrami operator of the positions. The same operator takes any function; on the
unit sphere a spherical harmonic of degree l is multiplied by -l (l + 1).
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import surfaces_figure

sphere = qc.surfaces.cubed_sphere()


def harmonic(points: np.ndarray) -> np.ndarray:
    """A spherical harmonic of degree 3."""
    x, _, z = points.T
    return x * (5 * z**2 - 1)


# %%
# The largest and the mean error of -12 f on three refinements.
SCHEMES = ("finite_volume", "liu", "bunge", "cotan-6")
mean = {scheme: [] for scheme in SCHEMES}
for cells in (8, 16, 32):
    mesh, _, _ = sphere.sample((cells, cells), "faces")
    f = harmonic(mesh.points)
    errors = {s: np.abs(qc.laplace_beltrami(mesh, f, s) + 12 * f) for s in SCHEMES}
    for scheme, error in errors.items():
        mean[scheme].append(error.mean())
        print(f"{cells:3} {scheme:15} mean {error.mean():.4f}  largest {error.max():.3f}")

# %%
panels = {scheme: (mesh, error) for scheme, error in errors.items()}
figure = surfaces_figure(panels, "error", decades=(-4, 1), height=2.6)


# %%
def main() -> float:
    """Return the order of finite volumes in the mean, from the last two refinements."""
    return float(np.log2(mean["finite_volume"][-2] / mean["finite_volume"][-1]))


print(main())
