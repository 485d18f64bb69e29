"""Liu, Xu and Zhang's formula on quads; on triangles the cotan formula."""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.assembly import from_faces
from quadcurv.schemes.base import Diamond, Laplacian
from quadcurv.schemes.diamond import diamond
from quadcurv.schemes.triangles import linear
from quadcurv.stencils import Stencils
from quadcurv.types import Floats


def _local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
    return linear(x, coarse) if x.shape[1] == 3 else diamond(x, coarse)


def _flux(stencils: Stencils) -> tuple[Floats, Floats]:
    from quadcurv.kernels import faces

    flux, area = np.zeros_like(stencils.points), np.zeros(len(stencils.points))
    faces.quad_fluxes(stencils.points, stencils.faces, flux, area, stencils.coarse)
    if stencils.has_triangles:
        faces.triangle_fluxes(stencils.points, stencils.faces, flux, area, stencils.coarse)
    return flux[: stencils.n], area[: stencils.n]


# Polygons of more than four sides are cut into triangles.
LIU = Laplacian(
    "liu",
    2,
    "Liu, Xu and Zhang 2008, eq. 2.4 and 2.10 (thesis, eq. 4.4-4.7)",
    from_faces(_local),
    _flux,
    Diamond("quads"),
    checkerboard=True,
)
