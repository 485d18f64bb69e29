"""Any Laplacian by its law: from stiffness or flux and dual area, vertex by vertex, in numpy."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy

from quadcurv.schemes import Laplacian
from quadcurv.schemes.assembly import ring_areas
from quadcurv.schemes.consistency import NOWHERE, FarOff, far_off
from quadcurv.stencils import Stencils
from quadcurv.types import Floats

PER_VERTEX: dict[str, tuple[int, ...]] = {
    "mean_curvature": (),
    "mean_curvature_normal": (3,),
    "vertex_normals": (3,),
    "dual_areas": (),
}
"""What can be asked for, and the shape of one vertex's answer."""


def evaluate(given: Stencils, treated: Stencils, scheme: Laplacian, results: Mapping[str, Floats]) -> FarOff:
    """Write results by name; `treated` has its boundary closed, dual areas are those of `given`.

    Where H may be far off is found if it is asked for.
    """
    if "dual_areas" in results:
        results["dual_areas"][...] = flux_and_area(given, scheme)[1].reshape(given.shape)
    if results.keys() <= {"dual_areas"}:
        return NOWHERE
    normals = unit_normals(treated, scheme)
    if "vertex_normals" in results:
        results["vertex_normals"][...] = normals.reshape(*treated.shape, 3)
    if results.keys() <= {"dual_areas", "vertex_normals"}:
        return NOWHERE
    Hn = mean_curvature_normal(treated, scheme)
    if "mean_curvature_normal" in results:
        results["mean_curvature_normal"][...] = Hn.reshape(*treated.shape, 3)
    if "mean_curvature" in results:
        H = -np.einsum("ix,ix->i", Hn, normals)
        results["mean_curvature"][...] = (H if treated.orientable else np.abs(H)).reshape(treated.shape)
    return far_off(treated, scheme).known(Hn)


def flux_and_area(stencils: Stencils, scheme: Laplacian) -> tuple[Floats, Floats]:
    """-S x (n, 3) and A (n,)."""
    if scheme.flux is not None:
        return scheme.flux(stencils)
    stiffness, area = scheme.assemble(stencils)
    # Relative to one of the points: rows sum to zero, but only up to the rounding of their weights.
    return -(stiffness @ (stencils.points - stencils.points[:1])), area


def mean_curvature_normal(stencils: Stencils, scheme: Laplacian) -> Floats:
    """(n, 3): NaN in open rings, where it is not finite, and where the scheme's area is not positive."""
    flux, area = flux_and_area(stencils, scheme)
    with np.errstate(divide="ignore", invalid="ignore"):
        Hn = flux / (2 * area[:, None])
    Hn[~stencils.closed | ~(area > 0) | ~np.isfinite(Hn).all(axis=1)] = np.nan
    return Hn


def unit_normals(stencils: Stencils, scheme: Laplacian) -> Floats:
    """(n, 3): directions of the vector areas of the rings that a scheme sees, NaN where these vanish."""
    areas = ring_areas(stencils) if scheme.polygons else stencils.ring_areas
    with np.errstate(divide="ignore", invalid="ignore"):
        return areas / np.linalg.norm(areas, axis=1, keepdims=True)


def without_infinity(matrix: scipy.sparse.csr_array) -> scipy.sparse.csr_array:
    """The matrix itself, NaN wherever it is not finite."""
    with np.errstate(invalid="ignore"):
        if not np.isfinite(matrix.data.sum()):
            matrix.data[~np.isfinite(matrix.data)] = np.nan
    return matrix
