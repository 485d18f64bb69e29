"""
Terrain with holes
==================

A digital terrain model is a grid whose missing cells are marked by a number, here -9999.
"""

import numpy as np

import quadcurv as qc
from quadcurv.viewing import Style, maps

NODATA = -9999.0
x, y = np.meshgrid(np.linspace(0, 3000, 91), np.linspace(0, 2000, 61), indexing="ij")  # metres
z = 220 * np.exp(-(((x - 900) / 500) ** 2) - ((y - 1000) / 400) ** 2)
z += 160 * np.exp(-(((x - 2100) / 350) ** 2) - ((y - 800) / 600) ** 2)
z[(x - 1500) ** 2 + (y - 1500) ** 2 < 200**2] = NODATA  # a lake
z[40:46, 10:13] = NODATA  # and a cloud

# %%
# The mask makes holes of these cells. Results are NaN in them; beside them, as at the outer border, rows
# are continued by extrapolation wherever enough points lead inward.
terrain = qc.QuadGrid(np.stack([x, y, z], axis=-1), mask=z == NODATA)
H = qc.mean_curvature(terrain)
print(terrain, f"H from {np.nanmin(H):.2e} to {np.nanmax(H):.2e} per metre")

# %%
# With ``indexing="ij"`` the normal points up: summits and ridges have H > 0, valleys H < 0.
maps(qc.compare(terrain, "jet"), "mean_curvature", Style(camera=(0, -0.6, 1), size=(1400, 900)))


# %%
def main() -> float:
    """Return the part of the points on land that have a curvature."""
    return float(np.isfinite(H).sum() / (z != NODATA).sum())


print(main())
