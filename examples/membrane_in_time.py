"""
A membrane in time
==================

Positions with labels: rows, columns, coordinates, and time. Curvatures have the same labels; where the
positions are in chunks of dask nothing is computed before it is asked for.
"""

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

import quadcurv as qc

time = xr.DataArray(np.linspace(0, 2, 9), dims="time", attrs={"units": "s"})
x = xr.DataArray(np.linspace(0, 4, 81), dims="x")
y = xr.DataArray(np.linspace(0, 3, 61), dims="y")
height = 0.2 * np.sin(np.pi * x / 2) * np.sin(np.pi * y / 3) * np.cos(np.pi * time) + 0.02 * x * y

# %%
# The three coordinates along a dimension of their own, one chunk a time.
points = xr.concat(xr.broadcast(x, y, height), "xyz").assign_coords(time=time, x=x, y=y)
points = points.assign_attrs(units="m").chunk(time=1)
print(points.sizes)

# %%
# The first two names are those of rows and columns: x before y has the normal upward.
H = qc.mean_curvature(qc.from_xarray(points, ("x", "y", "xyz")), "finite_volume")
print(H.dims, H.attrs["units"], "lazy" if H.chunks else "in memory")

# %%
# Whatever xarray does with labels, it does with curvatures.
bending = (H**2).mean(["x", "y"]).compute()
print(bending.round(3).values)

# %%
# Mean curvature at three times, from -1 per metre, blue, to 1, red.
figure = H.isel(time=[0, 2, 4]).plot(x="x", y="y", col="time", vmin=-1, vmax=1, cmap="RdBu_r").fig


# %%
def main() -> float:
    """Return the mean of H^2 at the first time."""
    return float(bending[0])


print(main())
plt.close("all")
