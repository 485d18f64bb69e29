"""Ghost layers: stencils whose rings are closed at open sides too."""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from quadcurv.mesh import (
    Floats,
    Mesh,
    MeshError,
    QuadGrid,
    QuadMesh,
    StaggeredGrid,
    Stencils,
    grid_faces,
)

BOUNDARIES = ("extrapolate", "nan")


def stencils(mesh: Mesh, boundary: str = "extrapolate") -> Stencils:
    """One-ring stencils of a mesh, its boundary treated.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid
    boundary : {"extrapolate", "nan"}
        "extrapolate" closes the rings at open sides of a grid by one layer of ghost points,
        X_-1 = 5 X_0 - 10 X_1 + 10 X_2 - 5 X_3 + X_4, which keeps second order up to the border with the
        interior's own error. "nan" leaves them open: their curvature is NaN. The boundary of a face list
        stays open in either case.

    Returns
    -------
    Stencils

    Raises
    ------
    MeshError
        A ValueError: an open direction has fewer than the 5 points that the extrapolation reads.
    """
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary: expected one of {BOUNDARIES}, got {boundary!r}")
    if boundary == "nan" or isinstance(mesh, QuadMesh):
        return mesh.stencils()
    if isinstance(mesh, QuadGrid):
        return _ghosted_grid(mesh)
    if mesh.has_ghosts:
        return mesh.stencils()
    return _ghosted_cells(mesh)


def ghost_layer(points: Floats, wrap: tuple[bool, bool], degree: int = 4) -> tuple[NDArray[np.int32], Floats]:
    """Surround a grid of points by ghosts where it is open.

    Parameters
    ----------
    points : (r, c, 3) float64
    wrap : (bool, bool)
        Directions that wrap, hence have no open side.
    degree : int
        Degree of the polynomial through the degree + 1 points next to an open side.

    Returns
    -------
    index : (r or r + 2, c or c + 2) int32
        Indices of the grid with its ghosts: the points row by row, then the ghosts from r c on.
    ghosts : (g, 3) float64

    Raises
    ------
    MeshError
        A ValueError: fewer than degree + 1 points in an open direction.
    """
    shape = points.shape[:2]
    for size, wraps, name in zip(shape, wrap, ("rows", "columns"), strict=True):
        if not wraps and size <= degree:
            raise MeshError(
                f"points: {size} {name}, but extrapolation beyond an open side needs at least "
                f'{degree + 1}; boundary="nan" needs none'
            )
    number = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)
    index = np.pad(number, [(int(not w),) * 2 for w in wrap], constant_values=-1)
    is_ghost = index < 0
    index[is_ghost] = np.arange(number.size, number.size + np.count_nonzero(is_ghost))
    extend = sparse.kron(*(_extension(s, w, degree) for s, w in zip(shape, wrap, strict=True)), format="csr")
    # Relative to one of the points, so that an offset of the whole surface costs no digits.
    origin = points[0, 0]
    ghosts = extend[np.flatnonzero(is_ghost)] @ (points - origin).reshape(-1, 3) + origin
    return index, ghosts


def _extension(size: int, wraps: bool, degree: int) -> sparse.csr_array:
    """Identity, between two rows of extrapolation where the direction is open."""
    identity = sparse.eye_array(size, format="csr")
    if wraps:
        return identity
    row = np.zeros((1, size))
    row[0, : degree + 1] = [(-1) ** k * comb(degree + 1, k + 1) for k in range(degree + 1)]
    return sparse.vstack((sparse.csr_array(row), identity, sparse.csr_array(row[:, ::-1])), format="csr")


def _ghosted_grid(grid: QuadGrid) -> Stencils:
    index, ghosts = ghost_layer(grid.points, grid.wrap)
    index = np.pad(index, [(0, int(w)) for w in grid.wrap], mode="wrap")
    points = np.concatenate((grid.points.reshape(-1, 3), ghosts))
    closed = np.ones(grid.shape[0] * grid.shape[1], bool)
    return Stencils(points, grid_faces(index), grid.shape, closed)


def _ghosted_cells(grid: StaggeredGrid) -> Stencils:
    index, ghosts = ghost_layer(grid.primal, grid.wrap)
    index = np.pad(index, [(int(w),) * 2 for w in grid.wrap], mode="wrap")
    return grid.diamonds(index, ghosts)
