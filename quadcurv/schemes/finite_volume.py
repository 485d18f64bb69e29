"""The finite-volume scheme of Hutchins 2013 (after Calhoun and Helzel 2009), at any valence."""

from __future__ import annotations

import numpy as np
import scipy

from quadcurv.schemes.assembly import assembled
from quadcurv.schemes.base import Diamond, Laplacian
from quadcurv.schemes.diamond import diamond
from quadcurv.schemes.triangles import squared_distance
from quadcurv.stencils import Stencils, face_pairs
from quadcurv.types import Floats, Ints


def _flaps(stencils: Stencils) -> tuple[Ints, scipy.sparse.csr_array]:
    """Corners (c, a, d, b) of triangles, d numbered from p on, and the matrix that places these d.

    d is the mean of the vertices across the edge (a, b), a + b - c where nothing lies across: on a mesh
    of triangles d is a point of the mesh, beside a quad the middle of its far edge.
    """
    p, faces = len(stencils.points), stencils.faces
    face = np.flatnonzero(faces[:, 3] < 0)
    c = faces[face, :3].ravel()
    a = faces[face][:, [1, 2, 0]].ravel()
    b = faces[face][:, [2, 0, 1]].ravel()
    corner_of = np.full((len(faces), 3), -1)
    corner_of[face] = np.arange(c.size).reshape(-1, 3)

    f, i, g, j = face_pairs(faces)
    f, i, g, j = (np.concatenate(x) for x in ((f, g), (i, j), (g, f), (j, i)))
    f, i, g, j = (x[faces[f, 3] < 0] for x in (f, i, g, j))
    flap = corner_of[f, (i + 2) % 3]
    beyond_quad = faces[g, 3] >= 0
    sides = np.where(beyond_quad, 4, 3)
    far = np.stack((faces[g, (j + 2) % sides], faces[g, (j + sides - 1) % sides]), axis=1)
    lacking = np.ones(c.size, bool)
    lacking[flap] = False
    alone = np.flatnonzero(lacking)
    rows = np.concatenate((flap, flap, alone, alone, alone))
    columns = np.concatenate((far[:, 0], far[:, 1], a[alone], b[alone], c[alone]))
    ones = np.ones(alone.size)
    values = np.concatenate((np.full(2 * flap.size, 0.5), ones, ones, -ones))
    place = scipy.sparse.csr_array((values, (rows, columns)), shape=(c.size, p))
    return np.stack((c, a, np.arange(p, p + c.size, dtype=np.int32), b), axis=1), place


def _flap_points(stencils: Stencils) -> tuple[Ints, scipy.sparse.csr_array, Floats]:
    """Triangle corners as `_flaps`, and all points, relative to one, with the d of these corners appended."""
    corners, place = _flaps(stencils)
    x = stencils.points - stencils.points[0]
    return corners, place, np.concatenate((x, place @ x))


def _dual_areas(stencils: Stencils) -> Floats:
    return np.linalg.norm(stencils.ring_areas, axis=1)


def _flux(stencils: Stencils) -> tuple[Floats, Floats]:
    from quadcurv.kernels import faces

    flux, unused = np.zeros_like(stencils.points), np.zeros(len(stencils.points))
    faces.quad_fluxes(stencils.points, stencils.faces, flux, unused, stencils.coarse)
    if stencils.has_triangles:
        corners, _, points = _flap_points(stencils)
        faces.flap_fluxes(points, corners, stencils.points[0], flux, stencils.coarse)
    return flux[: stencils.n], _dual_areas(stencils)


def _assemble(stencils: Stencils) -> tuple[scipy.sparse.csr_array, Floats]:
    n, p = stencils.n, len(stencils.points)
    S, _ = assembled(stencils, [stencils.faces[stencils.faces[:, 3] >= 0]], diamond, n)
    if stencils.has_triangles:
        corners, place, points = _flap_points(stencils)
        far = squared_distance(stencils.points[corners[:, :1]])
        row = diamond(points[corners], stencils.coarse, far)[0][:, 0]
        where = np.repeat(corners[:, 0], 4), corners.ravel()
        flaps = scipy.sparse.csr_array((row.ravel(), where), (p, len(points)))[:n]
        S = S + flaps[:, :p] + flaps[:, p:] @ place
    return S, _dual_areas(stencils)


FINITE_VOLUME = Laplacian(
    "finite_volume",
    2,
    "Hutchins 2013, eq. 3.16-3.35; Calhoun and Helzel 2009",
    _assemble,
    _flux,
    Diamond("ring"),
    checkerboard=True,
)
