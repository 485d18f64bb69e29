"""The verbs of matrices: stiffness, mass, and what they make of functions."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike

from quadcurv import drivers
from quadcurv.drivers import parts
from quadcurv.drivers.dispatch import as_laplacian, results, split, taken
from quadcurv.io import as_mesh
from quadcurv.mesh import ChunkedGrid, GridBlocks, StaggeredGrid
from quadcurv.schemes import Scheme, SchemeName
from quadcurv.schemes.consistency import far_off
from quadcurv.types import Floats

DEFAULT_MATRIX = "bilinear"
"""Scheme of matrices and dual areas where none is named: unlike others it sees a checkerboard."""


def dual_areas(mesh: Any, scheme: SchemeName | str | Scheme = DEFAULT_MATRIX) -> Floats:
    """Area that a scheme gives to each vertex: the diagonal of its mass matrix.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`.

    Returns
    -------
    (n,) or (r, c) float64
        In length^2; 0 at isolated vertices. Boundary vertices have the part inside the mesh. The areas
        of the bilinear element, Liu's formula and valence 6 add up to the area of the mesh; those of the
        finite-volume scheme, half the vector area of each ring polygon, do so on quads to second order.
        Of a staggered grid the area of each cell.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; the scheme is a fit.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.cubed_sphere().sample((24, 24), "faces")[0]
    >>> round(float(qc.dual_areas(ball).sum() / np.pi), 2)
    4.0
    """
    return results(mesh, ["dual_areas"], as_laplacian(scheme), "nan")["dual_areas"]


def stiffness_matrix(
    mesh: Any, scheme: SchemeName | str | Scheme = DEFAULT_MATRIX, out: scipy.sparse.csr_array | None = None
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
        the null space beside the constants. The bilinear element has no such mode.
        Of GridBlocks rows and columns are numbered by their ``numbers``. Of cells (n, p): rows are the n
        cells, columns the p points of ``stencils().points``.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; the scheme is a fit; `out` does not fit.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.cubed_sphere().sample((8, 8), "faces")[0]
    >>> S = qc.stiffness_matrix(ball)
    >>> bool(np.abs(S.sum(axis=1)).max() < 1e-12)
    True
    """
    return drivers.stiffness(_in_memory(mesh), as_laplacian(scheme), out)


def mass_matrix(mesh: Any, scheme: SchemeName | str | Scheme = DEFAULT_MATRIX) -> scipy.sparse.dia_array:
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

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball = qc.surfaces.cubed_sphere().sample((8, 8), "faces")[0]
    >>> qc.mass_matrix(ball).shape
    (386, 386)
    """
    mesh = _in_memory(mesh)
    if drivers.device.holds(mesh):
        return drivers.device.mass_matrix(dual_areas(mesh, scheme))
    return scipy.sparse.diags_array(mesh.flat(dual_areas(mesh, scheme)))


def laplace_beltrami(mesh: Any, f: ArrayLike, scheme: SchemeName | str | Scheme = DEFAULT_MATRIX) -> Floats:
    """Laplace-Beltrami operator of functions at the vertices, -M^-1 S f.

    Parameters
    ----------
    mesh, scheme
        As for :func:`mean_curvature`, but of a Laplacian.
    f : (n,) or (n, k) array_like
        One or several functions; of a grid (r, c) or (r, c, k). Of a staggered grid (p,) or (p, k), at
        the p points of ``stencils().points``: the cells, then the other points. Of blocks of vertices one
        array a block, which agree where these meet.

    Returns
    -------
    float64 array of the shape of `f`; of a staggered grid (r, c) or (r, c, k)
        In units of f / length^2, negative at a maximum. NaN where the ring is not closed: what f is
        beyond a border nobody knows. Where a weak form is solved, take :func:`stiffness_matrix`, which has
        natural boundary conditions there.

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        The scheme is a fit; `f` does not fit the mesh.

    Examples
    --------
    On the unit sphere the coordinates are eigenfunctions with eigenvalue -2.

    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.cubed_sphere().sample((24, 24), "faces")[0]
    >>> found = qc.laplace_beltrami(ball, ball.points, "liu")
    >>> bool(np.abs(found + 2 * ball.points).mean() < 0.01)
    True
    """
    mesh, chosen = taken(mesh), as_laplacian(scheme)
    if isinstance(mesh, ChunkedGrid):
        return parts.laplace_beltrami(mesh, f, chosen)
    if drivers.device.holds(mesh):
        return drivers.device.laplace_beltrami(mesh, f, chosen)
    stencils = mesh.stencils()
    given = mesh.joined(f) if isinstance(mesh, GridBlocks) and not mesh.of_cells else np.asarray(f)
    if given.dtype.kind not in "biuf":
        raise ValueError(f"f: expected real numbers, got dtype {given.dtype}")
    given = given.astype(np.float64, copy=False)
    if drivers.has_holes(mesh):
        if given.shape[:2] != mesh.shape:
            raise ValueError(f"f: shape {given.shape}, expected {mesh.shape} or {(*mesh.shape, 'k')}")
        return mesh.in_shape(drivers.apply(mesh.to_mesh(), chosen, mesh.flat(given)))
    lead = (len(stencils.points),) if isinstance(mesh, StaggeredGrid | GridBlocks) else stencils.shape
    if given.shape[: len(lead)] != lead or given.ndim > len(lead) + 1:
        raise ValueError(f"f: shape {given.shape}, expected {lead} or {(*lead, 'k')}")
    values = given.reshape(len(stencils.points), *given.shape[len(lead) :])
    result = drivers.apply(mesh, chosen, values)
    far_off(stencils, chosen).known(result).warn(f"{chosen.name}: the operator", stencils.shape)
    return split(mesh, result.reshape(*stencils.shape, *values.shape[1:]))


def _in_memory(mesh: Any) -> Any:
    """What a matrix is asked of, as the drivers take it."""
    return mesh if isinstance(mesh, GridBlocks) else as_mesh(mesh)
