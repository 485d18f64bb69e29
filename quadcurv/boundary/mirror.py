"""Neighbourhoods at the border completed by points of a surface fitted at the vertex."""

from __future__ import annotations

import numpy as np

from quadcurv.boundary.surface import Surfaces
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats

_CHUNK = 1024  # neighbourhoods at a time
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
    chunks = [slice(begin, begin + _CHUNK) for begin in range(0, max(len(x), 1), _CHUNK)]
    free = inside & np.concatenate([_free(x[at]) for at in chunks])
    ghosts = surfaces.lifted(np.where(free[..., None], -x, 0.0))
    free &= np.isfinite(ghosts).all(axis=2)
    ghosts = np.where(free[..., None], ghosts, np.nan)
    both = np.concatenate((points, ghosts), axis=1)
    # Those there are first.
    order = np.argsort(np.isnan(both[..., 0]), axis=1, kind="stable")
    both = np.take_along_axis(both, order[..., None], axis=1)
    return both[:, : int((~np.isnan(both[..., 0])).sum(axis=1).max(initial=1))]


def _free(x: Floats) -> Bools:
    """Which points (k, m, 2) have mirror images (k, m) where no other point is; NaN is none."""
    itself = np.eye(x.shape[1], dtype=bool)
    to_others = np.sqrt(np.where(itself, np.inf, _squares(x, x)).min(axis=2, initial=np.inf))
    known = np.isfinite(x[..., 0])
    spacing = np.where(known, to_others, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return np.asarray(_squares(-x, x).min(axis=2, initial=np.inf) > np.square(_FREE * spacing)[:, None])


def _squares(x: Floats, y: Floats) -> Floats:
    """Of the distances (k, m, m) of points from others; infinite from where there is none."""
    d, e = (x[:, :, None, a] - y[:, None, :, a] for a in (0, 1))
    return np.nan_to_num(d * d + e * e, nan=np.inf, posinf=np.inf)
