"""Liu, Xu and Zhang's formula on quads; on triangles the cotan formula."""

from __future__ import annotations

import numpy as np
import scipy

from quadcurv.schemes.base import Diamond, Laplacian
from quadcurv.schemes.cotan import cotan_matrices
from quadcurv.schemes.diamond import quad_stiffness
from quadcurv.stencils import Stencils
from quadcurv.types import Floats


def _flux(stencils: Stencils) -> tuple[Floats, Floats]:
    from quadcurv.kernels import faces

    flux, area = np.zeros_like(stencils.points), np.zeros(len(stencils.points))
    faces.quad_fluxes(stencils.points, stencils.faces, flux, area)
    if stencils.has_triangles:
        faces.triangle_fluxes(stencils.points, stencils.faces, flux, area)
    return flux[: stencils.n], area[: stencils.n]


def _rows(stencils: Stencils) -> scipy.sparse.csr_array:
    S = quad_stiffness(stencils)
    if stencils.has_triangles:
        triangles = stencils.faces[stencils.faces[:, 3] < 0, :3]
        S = S + cotan_matrices(stencils.points, triangles, "barycentric")[0]
    return S


def _assemble(stencils: Stencils) -> tuple[scipy.sparse.csr_array, Floats]:
    return _rows(stencils)[: stencils.n], _flux(stencils)[1]


LIU = Laplacian(
    "liu",
    2,
    "Liu, Xu and Zhang 2008, eq. 2.4 and 2.10 (thesis, eq. 4.4-4.7)",
    _assemble,
    _flux,
    Diamond("quads"),
)
