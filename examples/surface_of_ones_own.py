"""
A surface of one's own
======================

Any mapping that is written with numpy's functions is a surface with exact curvature, by automatic
differentiation: a test case of one's own takes one line.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import maps


def shell(u, v):
    """A tube along a trefoil-like ring that swells and shrinks."""
    radius = 0.5 + 0.15 * np.cos(3 * u)
    return (
        (2 + radius * np.cos(v)) * np.cos(u),
        (2 + radius * np.cos(v)) * np.sin(u),
        radius * np.sin(v) + 0.3 * np.sin(3 * u),
    )


ring = qc.surfaces.Surface.from_mapping(shell, ((0, 2 * np.pi), (0, 2 * np.pi)), (True, True), "ring")
grid, u, v = ring.sample((120, 40))
found = qc.compare(grid, ["finite_volume", "jet"], ring.mean_curvature(u, v))
maps(found, "mean_curvature")

# %%
# Errors, and how they fall.
maps(found, "error")

# %%
run = qc.convergence(ring, ["finite_volume", "liu", "jet"], [(60, 20), (120, 40), (240, 80)], "grid")
run


# %%
def main() -> float:
    """Return the order of jets on this surface."""
    return float(run.rates("jet", "inf")[-1])


print(main())
