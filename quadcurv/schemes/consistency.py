"""How far a Laplacian is from the mean curvature of quadratic surfaces: on skew rings, far.

Over the tangent plane at a vertex a smooth surface is z = (k1 x^2 + k2 y^2) / 2 about. Of this a scheme with
stiffness S and dual area A makes H = tr(T B) / 2, where B has the eigenvalues k1 and k2, and T is the sum of
-S x x^T / (2 A) over the ring: the identity of a scheme that is consistent. What T is off by says how far H
may be off, whatever the surface, the ring being what it is.
"""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.base import Laplacian
from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Indices

FAR = 3.0  # times the larger principal curvature: jitter of 30 % of the spacing makes H as far off
FAR_ANYHOW = 6.0  # of a scheme that converges on no skew mesh
_SLIVER = 0.25  # faces beyond that, see `kernels.slivers`, are not as bad


def consistency(stencils: Stencils, scheme: Laplacian, vertices: Indices | None = None) -> Floats:
    """By how many times the larger principal curvature H of a scheme may be off, for its rings alone.

    Parameters
    ----------
    stencils : Stencils
        With rings closed at the border.
    scheme : Laplacian
    vertices : (k,) int64, optional
        Of those with stencils; by default all of them.

    Returns
    -------
    (k,) or (n,) float64
        Half the sum of the sizes of the eigenvalues of T - 1, see this module; NaN in open rings, and where
        the scheme has no value.
    """
    rows = np.arange(stencils.n) if vertices is None else vertices
    part = stencils if vertices is None else _around(stencils, scheme, vertices)
    at = rows if part is stencils else np.arange(rows.size)
    with np.errstate(all="ignore"):
        S, A = scheme.assemble(part)
        S, A = S[at], A[at]
        normal = part.ring_areas[at]
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        row = np.repeat(np.arange(at.size), np.diff(S.indptr))
        x = part.points[S.indices] - part.points[at[row]]
        x = x - np.einsum("ix,ix->i", x, normal[row])[:, None] * normal[row]
        off = np.empty((at.size, 3, 3))
        for i in range(3):
            for j in range(i, 3):
                sums = np.bincount(row, S.data * x[:, i] * x[:, j], at.size)
                off[:, i, j] = off[:, j, i] = -sums / (2 * A) - (i == j) + normal[:, i] * normal[:, j]
    known = stencils.closed[rows] & (A > 0) & np.isfinite(off).all(axis=(1, 2))
    sizes = np.full(rows.size, np.nan)
    sizes[known] = np.abs(np.linalg.eigvalsh(off[known])).sum(axis=1) / 2
    return sizes


def far_off(stencils: Stencils, scheme: Laplacian) -> tuple[Indices, Floats]:
    """Vertices where H of a scheme may be far off for their rings, and by how much: see `consistency`."""
    from quadcurv.kernels.slivers import beside_slivers

    marked = beside_slivers(stencils.points, stencils.faces, _SLIVER)[: stencils.n]
    vertices = np.flatnonzero(marked & stencils.closed)
    if not vertices.size:
        return vertices, np.empty(0)
    off = consistency(stencils, scheme, vertices)
    far = off > (FAR if scheme.order > 0 else FAR_ANYHOW)
    return vertices[far], off[far]


def _around(stencils: Stencils, scheme: Laplacian, vertices: Indices) -> Stencils:
    """Stencils of some vertices, these first; all where polygons are looked at as such."""
    from quadcurv.kernels import topology

    if scheme.polygons and stencils.polygons is not None:
        return stencils
    kept, faces = topology.part_around(stencils.faces, vertices, len(stencils.points), 1)
    closed, shape = stencils.closed[vertices], vertices.shape
    points, orientable = stencils.points[kept], stencils.orientable
    return Stencils(points, faces, shape, closed, orientable, roundoff=stencils.roundoff)
