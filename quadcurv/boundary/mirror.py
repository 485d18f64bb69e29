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
    inside = (surfaces.around >= 0) & (surfaces.ring <= rings)
    width = int(inside.sum(axis=1).max(initial=1))
    inside, around = inside[:, :width], surfaces.around[:, :width]
    points = np.where(inside[..., None], stencils.points[around], np.nan)
    x = surfaces.flat(points)
    apart = np.linalg.norm(x[:, :, None] - x[:, None], axis=3)
    apart[:, np.arange(width), np.arange(width)] = np.nan
    spacing = np.nanmean(np.nanmin(apart, axis=2, initial=np.inf), axis=1)
    opposite = np.linalg.norm(x[:, :, None] + x[:, None], axis=3)  # from the mirror image of one to another
    with np.errstate(invalid="ignore"):
        free = inside & (np.nanmin(opposite, axis=2, initial=np.inf) > _FREE * spacing[:, None])
    ghosts = surfaces.lifted(np.where(free[..., None], -x, 0.0))
    free &= np.isfinite(ghosts).all(axis=2)
    ghosts = np.where(free[..., None], ghosts, np.nan)
    both = np.concatenate((points, ghosts), axis=1)
    # Those there are first.
    order = np.argsort(np.isnan(both[..., 0]), axis=1, kind="stable")
    both = np.take_along_axis(both, order[..., None], axis=1)
    return both[:, : int((~np.isnan(both[..., 0])).sum(axis=1).max(initial=1))]
