"""The public verbs: treat the boundary, run the scheme, divide, give the sign."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import scipy

from quadcurv import drivers
from quadcurv.boundary import stencils as with_boundary
from quadcurv.io import as_mesh
from quadcurv.schemes import Curvatures, Fit, Laplacian, Scheme, as_scheme
from quadcurv.schemes.angle_defect import angle_defect
from quadcurv.types import Floats


def mean_curvature(
    mesh: Any, scheme: str | Scheme = "finite_volume", boundary: str = "extrapolate"
) -> Floats:
    """Mean curvature H = (k1 + k2) / 2 at every vertex.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid, trimesh.Trimesh, pyvista.PolyData, path or (points, faces)
        See :func:`quadcurv.as_mesh`.
    scheme : str, Scheme or Fit
        A name in ``quadcurv.SCHEMES``, or one of ``quadcurv.schemes``.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.stencils`.

    Returns
    -------
    (n,) or (r, c) float64
        In 1 / length, positive where the surface bends away from its normal (+1 / R on a sphere of
        radius R with outward normals); H = -(H n) . n with n from :func:`vertex_normals`, or a fit's
        own normal. Without sign
        on a non-orientable mesh. NaN where the ring is not one closed fan (isolated vertices, boundaries
        that are not extrapolated, several fans) or degenerate (a face without area; for the cotan formula
        also half of one).

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        Unknown scheme or boundary.
    """
    mesh, scheme = as_mesh(mesh), as_scheme(scheme)
    if isinstance(scheme, Fit):
        return drivers.fit(mesh, scheme, boundary).mean
    return evaluate(mesh, "mean_curvature", scheme=scheme, boundary=boundary)["mean_curvature"]


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
    mesh, scheme = as_mesh(mesh), as_scheme(scheme)
    if isinstance(scheme, Fit):
        fits = drivers.fit(mesh, scheme, boundary)
        return -fits.mean[..., None] * fits.normal
    return evaluate(mesh, "mean_curvature_normal", scheme=scheme, boundary=boundary)["mean_curvature_normal"]


def gaussian_curvature(mesh: Any, scheme: str | Fit = "jet", boundary: str = "extrapolate") -> Floats:
    """Gaussian curvature K = k1 k2 at every vertex.

    Parameters
    ----------
    mesh, boundary
        As for :func:`mean_curvature`.
    scheme : str or Fit
        A fit, or "angle_defect": 2 pi less the angles around a vertex, over a third of the triangles
        around it, quads being cut as for "cotan-6". On a closed mesh these sum to 2 pi times the Euler
        characteristic, at any resolution; vertex by vertex they converge on regular meshes only.

    Returns
    -------
    (n,) or (r, c) float64
        In 1 / length^2. NaN as for :func:`mean_curvature`.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; a scheme that has no Gaussian curvature.
    """
    mesh = as_mesh(mesh)
    if scheme != "angle_defect":
        return drivers.fit(mesh, _as_fit(scheme), boundary).gaussian
    stencils = with_boundary(mesh, boundary)
    defect, area = angle_defect(stencils)
    with np.errstate(divide="ignore", invalid="ignore"):
        K = defect / area
    K[~stencils.closed | ~np.isfinite(K)] = np.nan
    return K.reshape(stencils.shape)


def principal_curvatures(mesh: Any, scheme: str | Fit = "jet", boundary: str = "extrapolate") -> Curvatures:
    """Principal curvatures k1 >= k2, their directions, and all else a fit knows.

    Parameters
    ----------
    mesh, boundary
        As for :func:`mean_curvature`.
    scheme : str or Fit

    Returns
    -------
    Curvatures
        ``k1``, ``k2`` (n,) or (r, c) in 1 / length, signed as the mean curvature; ``direction1``,
        ``direction2`` and ``normal`` (n, 3) or (r, c, 3); standard errors. On a non-orientable mesh the
        side with H >= 0 is taken. NaN as for :func:`mean_curvature`.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; a scheme that is no fit.
    """
    return drivers.fit(as_mesh(mesh), _as_fit(scheme), boundary)


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
    return evaluate(mesh, "vertex_normals", boundary=boundary)["vertex_normals"]


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
        As for :func:`mean_curvature`; the scheme is a fit.
    """
    return evaluate(mesh, "dual_areas", scheme=scheme, boundary="nan")["dual_areas"]


def stiffness_matrix(
    mesh: Any, scheme: str | Scheme = "finite_volume", out: scipy.sparse.csr_array | None = None
) -> scipy.sparse.csr_array:
    """Stiffness matrix S; the Laplace-Beltrami operator is -M^-1 S, and H n = -M^-1 S x / 2.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`.
    out : csr_array, optional
        The matrix of the same connectivity and scheme at other positions, to be overwritten and returned.
        For the finite-volume scheme and Liu's formula.

    Returns
    -------
    (n, n) csr_array
        Rows sum to zero; natural boundary conditions, no ghosts; NaN at the vertices of a face without
        area. Symmetric positive semi-definite but for cotan of valence 4 and 8, and for finite_volume
        where there are triangles. On quads the finite-volume and Liu's matrix (they are the same) do not
        see a checkerboard: where vertices can be coloured like a chessboard, the alternating mode lies in
        the null space beside the constants.
        Of a staggered grid (n, p): rows are the n cells, columns the p points of ``stencils().points``.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; the scheme is a fit.
    """
    return drivers.stiffness(as_mesh(mesh), _as_laplacian(scheme), out)


def mass_matrix(mesh: Any, scheme: str | Scheme = "finite_volume") -> scipy.sparse.dia_array:
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
        As for :func:`mean_curvature`; the scheme is a fit.
    """
    return scipy.sparse.diags_array(dual_areas(mesh, scheme).ravel())


def evaluate(
    mesh: Any,
    *wanted: str,
    scheme: str | Scheme = "finite_volume",
    boundary: str = "extrapolate",
    out: Mapping[str, Floats] | None = None,
) -> dict[str, Floats]:
    """Several of the verbs in one pass, into arrays of the caller's if there are any.

    Parameters
    ----------
    mesh, scheme, boundary
        As for :func:`mean_curvature`; a fit gives none of these.
    *wanted : {"mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas"}
        Names of verbs.
    out : mapping from name to float64 array, optional
        C-contiguous arrays of the shape of the result, to be written to. Others are allocated.

    Returns
    -------
    dict
        Results by name: what the verbs return, the arrays of `out` among them.

    Raises
    ------
    ValueError
        As for the verbs; an unknown name; an array in `out` of another shape, type or layout.
    """
    return drivers.run(as_mesh(mesh), _as_laplacian(scheme), wanted, boundary, out)


def _as_laplacian(scheme: str | Scheme) -> Laplacian:
    scheme = as_scheme(scheme)
    if isinstance(scheme, Fit):
        raise ValueError(f"scheme: {scheme.name} is a fit, which has no stiffness matrix and no dual areas")
    return scheme


def _as_fit(scheme: str | Scheme) -> Fit:
    scheme = as_scheme(scheme)
    if isinstance(scheme, Laplacian):
        raise ValueError(
            f"scheme: {scheme.name} gives the mean curvature alone; a fit is needed, such as 'jet'"
        )
    return scheme
