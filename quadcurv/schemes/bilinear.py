"""The bilinear element: Laplacian and area of the patch that a quad's corners span."""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.assembly import flux_from_faces, from_faces
from quadcurv.schemes.base import Laplacian
from quadcurv.schemes.triangles import cross, cut_up, dot, length, linear, squared_distance
from quadcurv.types import Floats

# The corners of a face, and Gauss's 2 x 2 points, on [-1, 1] x [-1, 1].
_CORNERS = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
_GAUSS = _CORNERS / np.sqrt(3)
_FACTORS = (1 + _GAUSS[:, None] * _CORNERS) / 2  # (point, corner, direction)
_VALUES = _FACTORS.prod(axis=2)
_SLOPES = np.moveaxis(_CORNERS / 2 * _FACTORS[:, :, ::-1], 2, 0)  # (direction, point, corner)
# What the squares and the product of the tangents' lengths are multiplied by in the stiffness.
_FORMS = np.einsum("agi,bgj->abgij", _SLOPES, _SLOPES)


def local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
    """Matrices and lumped masses of quads (m, 4, 3), or of linear triangles (m, 3, 3)."""
    if x.shape[1] == 3:
        return linear(x, coarse)
    # Relative to a corner: slopes sum to zero, but only up to rounding.
    tangents = np.tensordot(_SLOPES, (x - x[:, :1]).T, ((2,), (1,)))  # (direction, point, 3, m)
    u, v = np.moveaxis(tangents, 2, 1)
    uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
    area = length(cross(u, v), uu + vv, squared_distance(x), coarse)
    metric = np.array([(vv, -uv), (-uv, uu)]) / area
    matrices = np.tensordot(metric, _FORMS, ((0, 1, 2), (0, 1, 2)))
    parts = area.T @ _VALUES
    # Where a quad is not convex the bilinear map folds. Two triangles have the same edges.
    after = (np.roll(x, -1, axis=1) - x).T
    turns = cross(np.roll(after, 1, axis=1), after)
    turns = dot(turns, turns.sum(axis=1)[:, None])
    folded = np.flatnonzero(turns.min(axis=0) < 0)
    if folded.size:
        matrices[folded], parts[folded] = cut_up(x[folded], coarse)
    return matrices, parts


# Polygons of more than four sides are cut into triangles.
BILINEAR = Laplacian(
    "bilinear",
    2,
    "Isoparametric element with 2 x 2 Gauss points and lumped masses (Hughes 1987, ch. 3); "
    "one point gives Liu, Xu and Zhang 2008",
    from_faces(local),
    flux_from_faces(local),
)
