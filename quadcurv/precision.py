"""What the rounding of positions costs: eps |x| / h^2 in a curvature."""

from __future__ import annotations

import warnings

import numpy as np

from quadcurv.device_arrays import on_host, taken
from quadcurv.mesh import GridBlocks, Mesh, QuadGrid, QuadMesh
from quadcurv.types import Floats, Indices, PrecisionWarning

_SAMPLE = 512  # of the edges, whose lengths are looked at
_NOTED = 0.01  # of the mean curvature


def rounding_error(mesh: Mesh | GridBlocks) -> tuple[float, float]:
    """Error of H that the rounding of positions causes, about, and the extent of the mesh.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid or GridBlocks

    Returns
    -------
    error : float
        eps |x| / h^2 in 1 / length: eps is the distance of 1 to the next number of the type given, |x| the
        largest coordinate, h an edge, shorter than nine in ten. Errors that each coordinate's rounding
        makes add up to about this at their largest, in schemes that read one ring.
    extent : float
        Largest side of the bounding box, in length; both are of a sample of the edges.
    """
    begin, end = map(on_host, _edges(mesh))
    return error_at_edges(begin, end, mesh.roundoff)


def error_at_edges(begin: Floats, end: Floats, roundoff: float) -> tuple[float, float]:
    """The same of the ends (k, 3) of some edges."""
    step = end - begin
    length2 = np.einsum("ix,ix->i", step, step)
    known = np.isfinite(length2) & (length2 > 0)
    if not known.any():
        return 0.0, 0.0
    if not known.all():
        begin, end, length2 = begin[known], end[known], length2[known]
    ends = np.ascontiguousarray(np.concatenate((begin, end)).T)
    low, high = ends.min(axis=1), ends.max(axis=1)
    short = length2.size // 10
    h2 = np.partition(length2, short)[short]
    return float(2 * roundoff * max(-low.min(), high.max()) / h2), float((high - low).max())


def warn_of_rounding(mesh: Mesh | GridBlocks, H: Floats) -> None:
    """Warn where rounding reaches a hundredth of the mean curvature, or of 1 / extent where that is larger.

    Warns
    -----
    PrecisionWarning
        With the figure.
    """
    warn_of_error(*rounding_error(mesh), mesh.roundoff, H, 5)


def warn_of_error(error: float, extent: float, roundoff: float, H: Floats, level: int) -> None:
    """The same of an error that is known, with some of the values of H."""
    if error * extent < _NOTED:  # most meshes: nothing of H needs to be looked at
        return
    H = on_host(H)
    known = np.abs(H[np.isfinite(H)])
    typical = max(float(np.median(known)) if known.size else 0.0, 1 / extent)
    if error >= _NOTED * typical:
        warnings.warn(
            f"positions are rounded to {2 * roundoff:.1e} of their size, which causes errors of about "
            f"{error:.1g} (1/length) in H, where H is about {typical:.1g}: move the mesh near the origin "
            "and give double precision, or smooth more",
            PrecisionWarning,
            stacklevel=level,
        )


def sample(r: int, c: int) -> tuple[Indices, Indices]:
    """Rows and columns of some vertices of a grid."""
    i, j = np.unravel_index(np.arange(0, r * c, r * c // _SAMPLE + 1), (r, c))
    return i, j


def _edges(mesh: Mesh | GridBlocks) -> tuple[Floats, Floats]:
    """Ends (k, 3) of some edges."""
    if isinstance(mesh, GridBlocks):
        begin, end = zip(*map(_edges, mesh), strict=True)
        return np.concatenate(begin), np.concatenate(end)
    if isinstance(mesh, QuadMesh):
        faces = mesh.faces[:: len(mesh.faces) // _SAMPLE + 1]
        return taken(mesh.points, faces[:, [0, 1]].ravel()), taken(mesh.points, faces[:, [1, 2]].ravel())
    x = mesh.points if isinstance(mesh, QuadGrid) else mesh.primal
    r, c = x.shape[:2]
    i, j = sample(r, c)
    below, beside = np.minimum(i, r - 2), np.minimum(j, c - 2)
    first = np.concatenate((below * c + j, i * c + beside))
    second = np.concatenate((below * c + c + j, i * c + beside + 1))
    return taken(x.reshape(-1, 3), first), taken(x.reshape(-1, 3), second)
