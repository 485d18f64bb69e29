"""What the rounding of positions costs: eps |x| / h^2 in a curvature."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadcurv.device_arrays import is_on_device, on_host, taken
from quadcurv.mesh import GridBlocks, Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.types import Floats, Indices, PrecisionWarning, warn

_SAMPLE = 512  # of the edges, whose lengths are looked at
_FOUND = "magnified_rounding"  # where a mesh keeps what was found of it
_VALUES = 4096  # of the mean curvature, of which the median is taken
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
    if _FOUND not in mesh.__dict__:  # of the points alone: copies of a mesh may be rounded otherwise
        mesh.__dict__[_FOUND] = _magnified(mesh)
    by, extent = mesh.__dict__[_FOUND]
    return mesh.roundoff * by, extent


def _magnified(mesh: Mesh | GridBlocks) -> tuple[float, float]:
    """The same for a roundoff of 1."""
    from quadcurv.kernels.extent import steps

    if isinstance(mesh, GridBlocks):
        begin, end = zip(*map(_ends, mesh), strict=True)
        return error_at_edges(np.concatenate(begin), np.concatenate(end), 1.0)
    points = _points(mesh)
    if is_on_device(points) or (isinstance(mesh, QuadGrid) and mesh.mask is not None):
        return error_at_edges(*_ends(mesh), 1.0)
    return _error(1.0, *steps(points, *_edges(mesh)))


def error_at_edges(begin: Floats, end: Floats, roundoff: float) -> tuple[float, float]:
    """The same of the ends (k, 3) of some edges, those at holes NaN."""
    from quadcurv.kernels.extent import steps

    known = np.isfinite(begin).all(axis=1) & np.isfinite(end).all(axis=1)
    points = np.concatenate((begin[known], end[known]))
    first = np.arange(len(points) // 2)
    return _error(roundoff, *steps(points, first, first + first.size))


def _error(roundoff: float, square: Floats, far: float, size: float) -> tuple[float, float]:
    """The same of squares of edges, the largest coordinate, and the extent."""
    square = square[square > 0]
    if not square.size:
        return 0.0, 0.0
    short = square.size // 10
    square.partition(short)
    return 2 * roundoff * far / float(square[short]), size


def warn_of_rounding(mesh: Mesh | GridBlocks, H: Floats) -> None:
    """Warn where rounding reaches a hundredth of the mean curvature, or of 1 / extent where that is larger.

    Warns
    -----
    PrecisionWarning
        With the figure.
    """
    warn_of_error(*rounding_error(mesh), mesh.roundoff, H)


def warn_of_error(error: float, extent: float, roundoff: float, H: Floats) -> None:
    """The same of an error that is known, with some of the values of H."""
    if error * extent < _NOTED:  # most meshes: nothing of H needs to be looked at
        return
    usual = typical(H, extent)
    if error >= _NOTED * usual:
        warn(
            f"positions are rounded to {2 * roundoff:.1e} of their size, which causes errors of about "
            f"{error:.1g} (1/length) in H, where H is about {usual:.1g}: move the mesh near the origin "
            "and give double precision, or smooth more",
            PrecisionWarning,
        )


def some(values: Floats, most: int) -> Floats:
    """Evenly, at most so many or a few more of all values; of vectors each coordinate in turn."""
    values = values.reshape(-1)
    every = values.size // most + 1
    return values[:: every + (every % 3 == 0)]


def typical(H: Floats, extent: float) -> float:
    """Median size of the mean curvature, of some of its values, or 1 / extent where that is larger."""
    H = on_host(some(H, _VALUES))
    known = np.abs(H[np.isfinite(H)])
    return max(float(np.median(known)) if known.size else 0.0, 1 / extent)


def sample(r: int, c: int) -> tuple[Indices, Indices]:
    """Rows and columns of some vertices of a grid."""
    i, j = np.divmod(np.arange(0, r * c, _every(r * c)), c)
    return i, j


def _every(number: int) -> int:
    """One of how many is looked at."""
    return number // _SAMPLE + 1


def _points(mesh: Mesh) -> Any:
    return mesh.primal if isinstance(mesh, StaggeredGrid) else mesh.points


def _edges(mesh: Mesh) -> tuple[Indices, Indices]:
    """Numbers of the vertices at the ends of some edges."""
    if isinstance(mesh, QuadMesh):
        faces = mesh.faces[:: _every(len(mesh.faces))].astype(np.int64)
        return faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel()
    r, c = _points(mesh).shape[:2]
    i, j = sample(r, c)
    # Of a single row or column these edges end where they begin.
    above, left = (np.maximum(np.minimum(k, size - 2), 0) for k, size in ((i, r), (j, c)))
    first = np.concatenate((above * c + j, i * c + left))
    return first, first + np.repeat((c * (r > 1), int(c > 1)), i.size)


def _ends(mesh: Mesh) -> tuple[Floats, Floats]:
    """Positions (k, 3) of these ends, in memory wherever the mesh is."""
    x, (first, second) = _points(mesh).reshape(-1, 3), _edges(mesh)
    return on_host(taken(x, first)), on_host(taken(x, second))
