"""Gaussian curvature of a polyhedron: what the angles around a vertex lack of a full turn."""

from __future__ import annotations

import numpy as np

from quadcurv.stencils import Stencils
from quadcurv.types import Floats


def angle_defect(stencils: Stencils) -> tuple[Floats, Floats]:
    """2 pi less the angles at each vertex, and a third of the triangles around it.

    Parameters
    ----------
    stencils : Stencils
        Quads are cut from their first to their third vertex, polygons of more sides into triangles.

    Returns
    -------
    defect, area : (n,) float64
        K = defect / area at vertices with a closed ring; NaN where an edge has no length but for rounding.

    References
    ----------
    M. Meyer, M. Desbrun, P. Schröder, A. H. Barr (2003), Discrete differential-geometry operators for
    triangulated 2-manifolds, eq. 9.
    """
    from quadcurv.kernels import vector

    faces = stencils.faces
    triangles = np.concatenate((faces[:, :3], faces[faces[:, 3] >= 0][:, [2, 3, 0]]))
    corner = stencils.points[triangles]
    a, b = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    sine = np.linalg.norm(np.cross(a, b), axis=-1)  # times both lengths, as the cosine
    angle = np.arctan2(sine, np.einsum("tsx,tsx->ts", a, b))
    # A triangle without area has angles all the same, but for those beside an edge without length.
    aa, bb, far = (np.einsum("tsx,tsx->ts", x, x) for x in (a, b, corner))
    angle[np.minimum(aa, bb) <= vector.ROUNDING * stencils.coarse * far] = np.nan
    size = len(stencils.points)
    turn, area = np.zeros((2, size))
    np.add.at(turn, triangles, angle)
    np.add.at(area, triangles, sine / 6)
    return 2 * np.pi - turn[: stencils.n], area[: stencils.n]


def gaussian_curvature(stencils: Stencils) -> Floats:
    """(n,) the angle defect over the area, NaN in open rings."""
    defect, area = angle_defect(stencils)
    with np.errstate(divide="ignore", invalid="ignore"):
        K = defect / area
    K[~stencils.closed | ~np.isfinite(K)] = np.nan
    return K
