"""
The error of every operator, on one page
========================================

A sphere in six panels has kinks in its grid lines along twelve seams, and eight corners where three quads
meet. Both are where operators differ.
"""

import quadcurv as qc
from quadcurv.viewing import html_page, maps

sphere = qc.surfaces.cubed_sphere()
mesh, xi, eta = sphere.sample((16, 16), "faces")
mesh

# %%
# :func:`quadcurv.compare` runs several operators on one mesh. Here the exact answer is known; where it is
# not they are held against their median.
found = qc.compare(mesh, ["finite_volume", "liu", "cotan-6", "jet"], sphere.mean_curvature(xi, eta))
found

# %%
# The errors, on one logarithmic scale. The jets look for the nearest sphere first, and are exact here.
maps(found, "error")

# %%
# The same as one file of HTML that needs no network. Drag to turn, roll to zoom, click on a vertex for its
# values, and choose another field.
html_page(found, "error")


# %%
def main() -> float:
    """Return how many times larger the largest error of finite volumes is than that of Liu's formula."""
    errors = found.norms()
    return errors["finite_volume"]["inf"] / errors["liu"]["inf"]


print(main())
