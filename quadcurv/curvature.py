"""The public verbs: treat the boundary, run the scheme, divide, give the sign."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import sparse

from quadcurv.boundary import stencils as with_boundary
from quadcurv.interop import as_mesh
from quadcurv.mesh import Floats, Stencils
from quadcurv.schemes import Scheme, as_scheme


def mean_curvature(
    mesh: Any, scheme: str | Scheme = "finite_volume", boundary: str = "extrapolate"
) -> Floats:
    """Mean curvature H = (k1 + k2) / 2 at every vertex.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid, trimesh.Trimesh, pyvista.PolyData, path or (points, faces)
        See :func:`quadcurv.as_mesh`.
    scheme : str or Scheme
        A name in ``quadcurv.SCHEMES``.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.stencils`.

    Returns
    -------
    (n,) or (r, c) float64
        In 1 / length, positive where the surface bends away from its normal (+1 / R on a sphere of
        radius R with outward normals); H = -(H n) . n with n from :func:`vertex_normals`. Without sign
        on a non-orientable mesh. NaN where the ring is not one closed fan (isolated vertices, boundaries
        that are not extrapolated, several fans) or degenerate (a face without area).

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        Unknown scheme or boundary.
    """
    stencils = with_boundary(as_mesh(mesh), boundary)
    H = -np.einsum("ix,ix->i", _curvature_normal(stencils, as_scheme(scheme)), _normals(stencils))
    return (H if stencils.orientable else np.abs(H)).reshape(stencils.shape)


def mean_curvature_normal(
    mesh: Any, scheme: str | Scheme = "finite_volume", boundary: str = "extrapolate"
) -> Floats:
    """Mean curvature normal H n, once the mean curvature (half the Laplace-Beltrami of the positions).

    Parameters
    ----------
    mesh, scheme, boundary
        As for :func:`mean_curvature`.

    Returns
    -------
    (n, 3) or (r, c, 3) float64
        In 1 / length, pointing to the centre of curvature: inward on a sphere, whatever the orientation
        (thesis, eq. 3.21). NaN as for :func:`mean_curvature`.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`.
    """
    stencils = with_boundary(as_mesh(mesh), boundary)
    return _curvature_normal(stencils, as_scheme(scheme)).reshape(*stencils.shape, 3)


def vertex_normals(mesh: Any, boundary: str = "extrapolate") -> Floats:
    """Unit normals: the direction of each ring polygon's vector area.

    Parameters
    ----------
    mesh, boundary
        As for :func:`mean_curvature`.

    Returns
    -------
    (n, 3) or (r, c, 3) float64
        Counter-clockwise faces seen from the tip; of a grid, first direction times second. An open
        ring gives its part of the polygon. NaN at isolated vertices and where the vector area vanishes.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`.
    """
    stencils = with_boundary(as_mesh(mesh), boundary)
    return _normals(stencils).reshape(*stencils.shape, 3)


def dual_areas(mesh: Any, scheme: str | Scheme = "finite_volume") -> Floats:
    """Area that a scheme gives to each vertex: the diagonal of its mass matrix.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`.

    Returns
    -------
    (n,) or (r, c) float64
        In length^2; 0 at isolated vertices. Boundary vertices have the part inside the mesh. The areas
        of Liu's formula and of valence 6 add up to the area of the mesh; those of the finite-volume
        scheme, half the vector area of each ring polygon, do so on quads to second order.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`.
    """
    stencils = as_mesh(mesh).stencils()
    return as_scheme(scheme).apply(stencils)[1].reshape(stencils.shape)


def stiffness_matrix(mesh: Any, scheme: str | Scheme = "finite_volume") -> sparse.csr_array:
    """Stiffness matrix S; the Laplace-Beltrami operator is -M^-1 S, and H n = -M^-1 S x / 2.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`.

    Returns
    -------
    (n, n) csr_array
        Rows sum to zero; natural boundary conditions, no ghosts. Symmetric positive semi-definite but
        for cotan of valence 4 and 8, and for finite_volume where there are triangles. On quads the
        finite-volume and Liu's matrix (they are the same) do not see a checkerboard: where vertices can
        be coloured like a chessboard, the alternating mode lies in the null space beside the constants.
        Of a staggered grid (n, p): rows are the n cells, columns the p points of ``stencils().points``.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`.
    """
    return as_scheme(scheme).assemble(as_mesh(mesh).stencils())[0]


def mass_matrix(mesh: Any, scheme: str | Scheme = "finite_volume") -> sparse.dia_array:
    """Diagonal mass matrix M of a scheme: its :func:`dual_areas`.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`.

    Returns
    -------
    (n, n) dia_array

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`.
    """
    return sparse.diags_array(dual_areas(mesh, scheme).ravel())


def _curvature_normal(stencils: Stencils, scheme: Scheme) -> Floats:
    flux, area = scheme.apply(stencils)
    with np.errstate(divide="ignore", invalid="ignore"):
        Hn = flux / (2 * area[:, None])
    Hn[~stencils.closed | ~np.isfinite(Hn).all(axis=1)] = np.nan
    return Hn


def _normals(stencils: Stencils) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        return stencils.ring_areas / np.linalg.norm(stencils.ring_areas, axis=1, keepdims=True)
