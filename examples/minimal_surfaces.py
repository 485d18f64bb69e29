"""
Minimal surfaces
================

On a minimal surface the exact mean curvature is zero, so that whatever is computed is error.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import surfaces_figure

# By finite volumes.
panels = {}
for name in ("catenoid", "helicoid", "enneper"):
    grid, xi, eta = qc.surfaces.SURFACES[name]().sample((64, 64))
    panels[name] = grid, np.abs(qc.mean_curvature(grid, "finite_volume"))
figure = surfaces_figure(panels, "|H| (1/length)", decades=(-6, -2), camera=(1, 0.5, 0.7))

# %%
# The error falls with the square of the spacing, which :func:`quadcurv.convergence` measures and
# :func:`quadcurv.plot` draws.
run = qc.convergence("catenoid", ["finite_volume", "liu", "cotan-6", "jet"], [16, 32, 64, 128])
rates = qc.plot(run)
run


# %%
def main() -> float:
    """Return the order of finite volumes on the catenoid."""
    return run.fitted_rate("finite_volume", "inf")


print(main())
