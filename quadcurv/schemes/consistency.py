"""How far a Laplacian is from the mean curvature of quadratic surfaces: on skew rings, far.

Over the tangent plane at a vertex a smooth surface is z = (k1 x^2 + k2 y^2) / 2 about. Of this a scheme with
stiffness S and dual area A makes H = tr(T B) / 2, where B has the eigenvalues k1 and k2, and T is the sum of
-S x x^T / (2 A) over the ring: the identity of a scheme that is consistent. What T is off by says how far H
may be off, whatever the surface, the ring being what it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from quadcurv.schemes.base import Laplacian
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, ConsistencyWarning, Floats, Indices, warn

FAR = 3.0  # times the larger principal curvature: jitter of 30 % of the spacing makes H as far off
FAR_ANYHOW = 6.0  # of a scheme that converges on no skew mesh
_SLIVER = 0.25  # faces beyond that, see `kernels.slivers`, are not as bad


class FarOff(NamedTuple):
    """Vertices, flat, where H of a scheme may be far off for their rings, and by how much."""

    vertices: Indices
    off: Floats

    def of(self, place: Indices, n: int) -> FarOff:
        """Those of some places (k,) among n, as the k."""
        row = np.full(n, -1)
        row[place] = np.arange(place.size)
        at = row[self.vertices]
        return FarOff(at[at >= 0], self.off[at >= 0])

    def known(self, values: Floats) -> FarOff:
        """Those where values (n, ...) are finite."""
        kept = np.isfinite(values.reshape(len(values), -1)[self.vertices]).all(axis=1)
        return FarOff(self.vertices[kept], self.off[kept])

    def joined(self, other: FarOff) -> FarOff:
        """Both."""
        return FarOff(np.concatenate((self.vertices, other.vertices)), np.concatenate((self.off, other.off)))

    def warn(self, name: str, shape: tuple[int, ...]) -> None:
        """Name the first one, and how many there are, and what is off.

        Warns
        -----
        ConsistencyWarning
        """
        if not self.vertices.size:
            return
        first = tuple(map(int, np.unravel_index(self.vertices.min(), shape)))
        folds = np.count_nonzero(np.isinf(self.off))
        said = []
        if folds < self.off.size:
            said.append(
                f"by up to {self.off[np.isfinite(self.off)].max():.2g} times the larger principal curvature "
                f"at {self.off.size - folds} vertices of faces too skew or too thin for it"
            )
        if folds:
            said.append(f"by any amount at {folds} vertices whose faces fold over each other or have no area")
        warn(
            f"{name} may be off {' and '.join(said)}, first vertex {first if len(first) > 1 else first[0]}; "
            "'jet' does not depend on faces",
            ConsistencyWarning,
        )


NOWHERE = FarOff(np.empty(0, np.int64), np.empty(0))


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
        Half the sum of the sizes of the eigenvalues of T - 1, see this module, and what the rounding of the
        positions makes H be off by, in 1 / extent; NaN in open rings, and where the scheme has no value.
    """
    rows = np.arange(stencils.n) if vertices is None else vertices
    whole = vertices is None or (scheme.polygons and stencils.polygons is not None)
    part = stencils if whole else around(stencils, rows)
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
        extent = np.ptp(stencils.points[: stencils.n], axis=0).max()
        far = np.abs(part.points[at]).max(axis=1)
        rounded = np.bincount(row, np.abs(S.data), at.size) * part.roundoff * far * extent / (2 * A)
    known = stencils.closed[rows] & (A > 0) & np.isfinite(off).all(axis=(1, 2))
    sizes = np.full(rows.size, np.nan)
    sizes[known] = np.abs(np.linalg.eigvalsh(off[known])).sum(axis=1) / 2 + rounded[known]
    return sizes


def far_off(stencils: Stencils, scheme: Laplacian) -> FarOff:
    """Vertices where H of a scheme may be far off for their rings, and by how much: see `consistency`.

    Infinite where faces fold over each other, and in rings without area: these are none of a surface over a
    plane.
    """
    from quadcurv.kernels.slivers import beside_slivers

    off = np.where(folded(stencils), np.inf, 0.0)
    marked = beside_slivers(stencils.points, stencils.faces, _SLIVER)[: stencils.n]
    vertices = np.flatnonzero(marked & stencils.closed & (off == 0))
    if vertices.size:
        found = consistency(stencils, scheme, vertices)
        without_area = np.isnan(found) & ~stencils.ring_areas[vertices].any(axis=1)
        off[vertices] = np.where(without_area, np.inf, np.nan_to_num(found))
    far = np.flatnonzero(off > (FAR if scheme.order > 0 else FAR_ANYHOW))
    return FarOff(far, off[far])


def folded(stencils: Stencils) -> Bools:
    """(n,): vertices with a closed ring of which some faces lie over others."""
    from quadcurv.kernels.slivers import at_folds

    if not stencils.orientable:
        return np.zeros(stencils.n, bool)
    return np.asarray(at_folds(stencils.points, stencils.faces, stencils.ring_areas) & stencils.closed)


def around(stencils: Stencils, vertices: Indices) -> Stencils:
    """Stencils of some vertices alone."""
    from quadcurv.kernels import topology

    kept, faces = topology.part_around(stencils.faces, vertices, len(stencils.points), 1)
    closed, shape = stencils.closed[vertices], vertices.shape
    points, orientable = stencils.points[kept], stencils.orientable
    return Stencils(points, faces, shape, closed, orientable, roundoff=stencils.roundoff)
