"""Rings at the border, closed.

A vertex at the border has an open ring, and a scheme knows nothing there until points beyond the border,
ghosts, close it. With boundary="extrapolate" they come, in this order of preference,

1. by index: the strips of quads inward from the border are continued by the quartic through five points,
   X_-1 = 5 X_0 - 10 X_1 + 10 X_2 - 5 X_3 + X_4, where the points are smooth functions of their index. The
   border then has the order and the error of the inside. Where a strip has but four points, by the cubic;
2. by arc length: the same on cumulative chord lengths, where the spacing is not smooth but the lines are;
3. from a surface: where strips are rough, too short or not to be traced (triangles, extraordinary vertices,
   re-entrant corners), or where their ghosts do not lie outside, ghosts are read off a polynomial surface
   fitted at the vertex. So are whole rings at poles, sides of a mesh or parts of them that are one point but
   for rounding or 3 % of a cell, tips of narrow triangles too, beside them, and on the skew faces past them.

Where a strip is neither clearly smooth nor clearly rough the way of the least estimated error is taken.
Open stay, and have no curvature: isolated vertices, those of several fans of faces or of an edge of more
than two, and those whose neighbours are too few for a surface, or leave it undetermined by half an edge, or
are far within a strip of faces one wide, whose points tell nothing across it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.cells import cell_ghosts, cells_at_poles, cells_within, closed_cells
from quadcurv.boundary.closing import EXTRAPOLATED, FITTED, INTERIOR, OPEN, REACH, SPREAD, closed
from quadcurv.boundary.poles import parts_at_poles, poles, poles_of_faces, welded, welded_faces
from quadcurv.boundary.sides import frame, ghost_layer, part_around
from quadcurv.boundary.strips import ghosts
from quadcurv.boundary.strips import roughness as rough_lines
from quadcurv.boundary.surface import Surfaces, Trials, fitted, tangent_frames, trials, wide
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.stencils import Stencils
from quadcurv.types import Floats

__all__ = [
    "BOUNDARIES",
    "EXTRAPOLATED",
    "FITTED",
    "INTERIOR",
    "OPEN",
    "REACH",
    "SPREAD",
    "Surfaces",
    "Trials",
    "boundary_treatment",
    "cell_ghosts",
    "cells_at_poles",
    "cells_within",
    "checked_boundary",
    "closed",
    "closed_cells",
    "fitted",
    "frame",
    "ghost_layer",
    "ghosts",
    "one_rings",
    "part_around",
    "parts_at_poles",
    "poles",
    "poles_of_faces",
    "roughness",
    "tangent_frames",
    "trials",
    "welded",
    "wide",
]

BOUNDARIES = ("extrapolate", "nan")


def checked_boundary(boundary: str) -> str:
    """The treatment of the boundary by name, if there is one of that name."""
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary: expected one of {BOUNDARIES}, got {boundary!r}")
    return boundary


def one_rings(mesh: Mesh, boundary: str = "extrapolate") -> Stencils:
    """One-ring stencils of a mesh, its boundary treated.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid
    boundary : {"extrapolate", "nan"}
        "extrapolate" closes rings at the boundary by ghosts, see :mod:`quadcurv.boundary`. "nan" leaves them
        open: their curvature is NaN.

    Returns
    -------
    Stencils

    Raises
    ------
    ValueError
        Unknown boundary.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> stencils = qc.one_rings(ball)
    >>> stencils.n, bool(stencils.closed.all())
    (98, True)
    """
    return _treated(mesh, boundary)[0]


def boundary_treatment(mesh: Mesh, boundary: str = "extrapolate") -> NDArray[np.uint8]:
    """What closes the ring of every vertex.

    Parameters
    ----------
    mesh, boundary
        As for :func:`one_rings`.

    Returns
    -------
    (n,) or (r, c) uint8
        ``INTERIOR`` (1): faces of the mesh, or ghost cells that it came with. ``EXTRAPOLATED`` (2): ghosts on
        polynomials through strips. ``FITTED`` (3): ghosts on a fitted surface. ``OPEN`` (0): nothing, and the
        curvature is NaN; isolated vertices too.

    Raises
    ------
    ValueError
        As for :func:`one_rings`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> sheet, _, _ = qc.surfaces.hyperbolic_paraboloid().sample((8, 8))
    >>> qc.boundary_treatment(sheet)[:2, :3]
    array([[2, 2, 2],
           [2, 1, 1]], dtype=uint8)
    """
    return mesh.in_shape(_treated(mesh, boundary)[1])


@np.errstate(all="ignore")  # what overflows, or has no length, is NaN and has no ghosts
def _treated(mesh: Mesh, boundary: str) -> tuple[Stencils, NDArray[np.uint8]]:
    checked_boundary(boundary)
    if isinstance(mesh, QuadGrid) and mesh.mask is not None:
        mesh = mesh.to_mesh()
    given = mesh.stencils()
    at_poles = None
    if isinstance(mesh, QuadGrid) and (found := poles(mesh)) is not None:
        at_poles = welded(mesh, found)
    elif isinstance(mesh, QuadMesh) and (found := poles_of_faces(given)) is not None:
        at_poles = welded_faces(given, found), found
    if at_poles is not None:
        treated, treatment = closed(*at_poles)
        if boundary == "nan":
            treatment = np.where(given.closed, treatment, OPEN).astype(np.uint8)
            treated = replace(treated, closed=treatment != OPEN)
        return treated, treatment
    if boundary == "nan" or (isinstance(mesh, StaggeredGrid) and mesh.has_ghosts):
        return given, np.where(given.closed, INTERIOR, OPEN).astype(np.uint8)
    if not isinstance(mesh, StaggeredGrid):
        return closed(given)
    return closed_cells(mesh)


@np.errstate(all="ignore")
def roughness(mesh: Mesh) -> Floats:
    """How rough the lines of points are that end at the border: a bound of the error there.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid

    Returns
    -------
    (n,) or (r, c) float64
        The length of X_0 - 4 X_1 + 6 X_2 - 4 X_3 + X_4 over that of X_1 - X_0, plus its part along the normal
        once more, over what the surface turns there; the largest of the lines around the vertex. 0
        inside, NaN in an open ring and where no such lines end. Below one half the error of the mean
        curvature, by a scheme that converges and beyond the error it has inside, is at most twice this
        part of the larger principal curvature; from one half on nothing is said.
    """
    if isinstance(mesh, StaggeredGrid):
        if mesh.has_ghosts:
            return np.zeros(mesh.shape)
        mesh = QuadGrid(mesh.primal, mesh.wrap)
    rough = rough_lines(mesh.stencils())
    return mesh.in_shape(np.where(np.isfinite(rough), rough, np.nan))
