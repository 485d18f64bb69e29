"""Neighbourhoods at the border completed by points of a surface fitted at the vertex."""

from __future__ import annotations

import numpy as np

from quadcurv.boundary.surface import Surfaces
from quadcurv.stencils import Stencils
from quadcurv.types import Floats

_FREE = 0.5  # how far a mirror image must be from all points, in distances of points from their nearest


def mirrored(stencils: Stencils, surfaces: Surfaces, rings: int) -> Floats:
    """Points of the rings around vertices, and their mirror images through these where nothing is there yet.

    Returns
    -------
    (k, m, 3) float64
        The vertex first; NaN behind.
    """
    from quadcurv.kernels import surfaces as kernel

    s = surfaces
    return np.asarray(
        kernel.mirrored(stencils.points, s.around, s.ring, rings, s.frames, s.maps, s.coefficients, _FREE)
    )
