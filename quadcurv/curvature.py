"""The public verbs: one question each, asked of anything that holds a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike

from quadcurv import drivers
from quadcurv.boundary import one_rings
from quadcurv.drivers import face_parts, parts
from quadcurv.io import as_mesh, as_mesh_or_chunks
from quadcurv.mesh import ChunkedGrid, FaceParts, GridBlocks, Mesh, StaggeredGrid
from quadcurv.precision import warn_of_rounding
from quadcurv.schemes import Curvatures, Fit, Laplacian, Scheme, SchemeName, as_scheme
from quadcurv.schemes.angle_defect import gaussian_curvature as angle_gaussian_curvature
from quadcurv.types import Floats

DEFAULT = "jet"
"""Scheme of H, K, k1 and k2 where none is named, so that H = (k1 + k2) / 2."""

DEFAULT_MATRIX = "bilinear"
"""Scheme of matrices and dual areas where none is named: unlike others it sees a checkerboard."""


class PrincipalCurvatures(NamedTuple):
    """The principal part of :class:`quadcurv.Curvatures`, to be unpacked.

    Attributes
    ----------
    k1, k2 : (n,) or (r, c) float64
        In 1 / length, k1 >= k2.
    direction1, direction2 : (n, 3) or (r, c, 3) float64
        Unit tangents.
    """

    k1: Floats
    k2: Floats
    direction1: Floats
    direction2: Floats


def curvatures(
    mesh: Any,
    scheme: SchemeName | str | Fit = DEFAULT,
    boundary: str = "extrapolate",
    radius: float | None = None,
) -> Curvatures:
    """All that a fit knows at every vertex: H, K, k1, k2, directions, normal, standard errors.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid, trimesh.Trimesh, pyvista.PolyData, path or (points, faces)
        See :func:`quadcurv.as_mesh`; or GridBlocks, for which results are tuples, one a block.
    scheme : str or Fit
        A fit: "jet" and its kin.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.one_rings`.
    radius : float, optional
        In length: means at this scale; see Notes.

    Returns
    -------
    Curvatures
        ``mean``, ``gaussian``, ``k1``, ``k2`` (n,) or (r, c), signed as :func:`mean_curvature`;
        ``direction1``, ``direction2``, ``normal`` (n, 3) or (r, c, 3); standard errors. On a
        non-orientable mesh the side with H >= 0 is taken. NaN as for :func:`mean_curvature`.

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        Unknown scheme or boundary; a scheme that is no fit; a radius that is no positive length,
        or one for a grid in chunks.

    Notes
    -----
    With a radius H, K, k1 and k2 are area-weighted means over what lies within that distance (in space) and
    hangs together with the vertex there, as in Cohen-Steiner and Morvan (2003), and directions those of the
    mean shape operator; the guide's page on scales has the formulas. H = (k1 + k2) / 2, but K is not k1 k2.
    NaN where a vertex without value has a part in a mean: with boundary="nan" wherever a border has. Else
    means end at borders. There are no standard errors, as those of neighbours are not independent.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0).sample((24, 24))[0]
    >>> found = qc.curvatures(ball)
    >>> bool(np.abs(found.k1 - 0.5).max() < 5e-3)
    True
    """
    chosen, scale = _as_fit(scheme), None if radius is None else drivers.checked_radius(radius)
    mesh = _taken(mesh) if scale else parts.in_parts(_taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        if scale:
            raise ValueError("radius: means reach beyond the chunks of a grid; give it as one in memory")
        return parts.curvatures(mesh, chosen, boundary)
    found = _fitted(mesh, chosen, boundary)
    return _split(mesh, found if scale is None else drivers.averaged(mesh, found, scale))


def principal_curvatures(
    mesh: Any, scheme: SchemeName | str | Fit = DEFAULT, boundary: str = "extrapolate"
) -> PrincipalCurvatures:
    """Principal curvatures k1 >= k2 and their directions, to be unpacked.

    Parameters
    ----------
    mesh, scheme, boundary
        As for :func:`curvatures`, which gives more.

    Returns
    -------
    PrincipalCurvatures
        ``k1, k2, direction1, direction2``; in 1 / length, signed as :func:`mean_curvature`. NaN as there.

    Raises
    ------
    ValueError
        As for :func:`curvatures`.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> tube = qc.surfaces.cylinder().sample((24, 12))[0]
    >>> k1, k2, around, along = qc.principal_curvatures(tube)
    >>> bool(np.abs(k1 - 1).max() < 5e-3 and np.abs(k2).max() < 5e-3)
    True
    """
    chosen = _as_fit(scheme)
    mesh = parts.in_parts(_taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        return PrincipalCurvatures(*parts.principal_curvatures(mesh, chosen, boundary))
    found = _fitted(mesh, chosen, boundary)
    return PrincipalCurvatures(
        *(_split(mesh, x) for x in (found.k1, found.k2, found.direction1, found.direction2))
    )


def mean_curvature(
    mesh: Any, scheme: SchemeName | str | Scheme = DEFAULT, boundary: str = "extrapolate"
) -> Floats:
    """Mean curvature H = (k1 + k2) / 2 at every vertex.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid, StaggeredGrid, trimesh.Trimesh, pyvista.PolyData, path or (points, faces)
        See :func:`quadcurv.as_mesh`; or GridBlocks, for which results are tuples, one array a block.
    scheme : str or Scheme
        A name in ``quadcurv.schemes.SCHEMES``, or one of :mod:`quadcurv.schemes`. The default is the one a
        user should take without reading; "finite_volume" is the thesis's.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.one_rings`.

    Returns
    -------
    (n,) or (r, c) float64
        In 1 / length, a density, not integrated over the vertex; positive where the surface bends away
        from its normal (+1 / R on a sphere of radius R with outward normals); H = -(H n) . n with n from
        :func:`vertex_normals`, or a fit's own normal. Without sign on a non-orientable mesh. NaN where the
        ring is not one closed fan (isolated vertices, boundaries that are not extrapolated, several fans,
        edges of more than two faces) or degenerate (a face without area; for the cotan formula also half
        of one).

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        Unknown scheme or boundary.

    Warns
    -----
    MeshWarning
        The mesh was mended; see ``mesh.report``.
    PrecisionWarning
        The rounding of the positions reaches a hundredth of H.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0).sample((24, 24))[0]
    >>> bool(np.abs(qc.mean_curvature(ball) - 0.5).max() < 5e-3)
    True
    """
    chosen = as_scheme(scheme)
    if isinstance(mesh, FaceParts):
        return face_parts.evaluate(mesh, ["mean_curvature"], chosen, boundary)["mean_curvature"]
    mesh = parts.in_parts(_taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        return parts.verb(mesh, "mean_curvature", chosen, boundary)
    if isinstance(chosen, Fit):
        return _split(mesh, _fitted(mesh, chosen, boundary).mean)
    H = drivers.run(mesh, chosen, ["mean_curvature"], boundary)["mean_curvature"]
    warn_of_rounding(mesh, H)
    return _split(mesh, H)


def mean_curvature_normal(
    mesh: Any, scheme: SchemeName | str | Scheme = DEFAULT, boundary: str = "extrapolate"
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

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0).sample((24, 24))[0]
    >>> Hn = qc.mean_curvature_normal(ball, "finite_volume")
    >>> bool((np.einsum("ijx,ijx->ij", Hn, ball.points) < 0).all())
    True
    """
    chosen = as_scheme(scheme)
    if isinstance(mesh, FaceParts):
        return face_parts.evaluate(mesh, ["mean_curvature_normal"], chosen, boundary)["mean_curvature_normal"]
    mesh = parts.in_parts(_taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        return parts.verb(mesh, "mean_curvature_normal", chosen, boundary)
    if isinstance(chosen, Fit):
        fits = _fitted(mesh, chosen, boundary)
        return _split(mesh, -fits.mean[..., None] * fits.normal)
    Hn = drivers.run(mesh, chosen, ["mean_curvature_normal"], boundary)["mean_curvature_normal"]
    warn_of_rounding(mesh, Hn)
    return _split(mesh, Hn)


def gaussian_curvature(
    mesh: Any, scheme: SchemeName | str | Fit = DEFAULT, boundary: str = "extrapolate"
) -> Floats:
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
        In 1 / length^2, a density. NaN as for :func:`mean_curvature`.

    Raises
    ------
    ValueError
        As for :func:`mean_curvature`; a scheme that has no Gaussian curvature.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0).sample((24, 24))[0]
    >>> bool(np.abs(qc.gaussian_curvature(ball) - 0.25).max() < 5e-3)
    True
    """
    angles = isinstance(scheme, str) and scheme == "angle_defect"
    chosen = scheme if angles else _as_fit(scheme)
    if isinstance(mesh, FaceParts):
        return face_parts.evaluate(mesh, ["gaussian_curvature"], _as_fit(scheme), boundary)[
            "gaussian_curvature"
        ]
    mesh = parts.in_parts(_taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        return parts.verb(mesh, "gaussian_curvature", chosen, boundary)
    if isinstance(chosen, Fit):
        return _split(mesh, _fitted(mesh, chosen, boundary).gaussian)
    if drivers.device.holds(mesh):
        raise ValueError("scheme: angle_defect does not run on a device; give it positions in memory")
    K = angle_gaussian_curvature(one_rings(mesh.mesh if isinstance(mesh, GridBlocks) else mesh, boundary))
    return _split(mesh, K[: mesh.n] if isinstance(mesh, GridBlocks) else mesh.in_shape(K))


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

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere().sample((24, 24))[0]
    >>> bool(np.abs(qc.vertex_normals(ball) - ball.points).max() < 0.01)
    True
    """
    return evaluate(mesh, "vertex_normals", boundary=boundary)["vertex_normals"]


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
    return evaluate(mesh, "dual_areas", scheme=scheme, boundary="nan")["dual_areas"]


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
    return drivers.stiffness(_in_memory(mesh), _as_laplacian(scheme), out)


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
    mesh, chosen = _taken(mesh), _as_laplacian(scheme)
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
    return _split(mesh, result.reshape(*stencils.shape, *values.shape[1:]))


def evaluate(
    mesh: Any,
    *wanted: str,
    scheme: SchemeName | str | Scheme = "finite_volume",
    boundary: str = "extrapolate",
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Several of the verbs in one pass, into arrays of the caller's if there are any.

    Parameters
    ----------
    mesh, boundary
        As for :func:`mean_curvature`.
    *wanted : {"mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas"}
        Names of verbs.
    scheme : str or Laplacian
        A fit gives none of these; :func:`curvatures` has what it gives. Of a :class:`ChunkedGrid` it may be a
        fit, which gives "mean_curvature", "mean_curvature_normal", "gaussian_curvature", "k1", "k2",
        "direction1", "direction2", "normal", "standard_error" (r, c, 4) of H, K, k1 and k2, "noise",
        "degree" and "rings".
    out : mapping from name to float64 array, optional
        C-contiguous arrays of the shape of the result, to be written to. Others are allocated. Of a
        :class:`ChunkedGrid` anything that takes slices, such as a zarr array or a ``numpy.memmap``.
    progress : bool
        Whether to show how many blocks of a :class:`ChunkedGrid` are done, on standard error.

    Returns
    -------
    dict
        Results by name: what the verbs return, the arrays of `out` among them.

    Raises
    ------
    ValueError
        As for the verbs; an unknown name; an array in `out` of another shape, type or layout, or one that
        overlaps the mesh or another one.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball = qc.surfaces.cubed_sphere().sample((8, 8), "faces")[0]
    >>> sorted(qc.evaluate(ball, "mean_curvature", "dual_areas"))
    ['dual_areas', 'mean_curvature']
    """
    chosen = as_scheme(scheme)
    if isinstance(mesh, FaceParts):
        return face_parts.evaluate(mesh, wanted, chosen, boundary, out)
    mesh = _taken(mesh)
    if isinstance(mesh, ChunkedGrid):
        return parts.evaluate(mesh, wanted, chosen, boundary, out, progress)
    found = drivers.run(mesh, _as_laplacian(chosen), wanted, boundary, out)
    return {name: _split(mesh, values) for name, values in found.items()}


def _in_memory(mesh: Any) -> Any:
    """What a matrix is asked of, as the drivers take it."""
    return mesh if isinstance(mesh, GridBlocks) else as_mesh(mesh)


def _taken(mesh: Any) -> Any:
    """What a verb is asked of, as the drivers take it; grids that are not in memory, too."""
    return mesh if isinstance(mesh, GridBlocks) else as_mesh_or_chunks(mesh)


def _split(mesh: Any, values: Any) -> Any:
    """Results as a verb gives them: of blocks (n, ...) as one array, or Curvatures, a block."""
    if not isinstance(mesh, GridBlocks):
        return values
    if not isinstance(values, Curvatures):
        return mesh.split(values)
    return tuple(
        drivers.each(values, lambda x, k=k: mesh.split(x)[k])  # type: ignore[misc]
        for k in range(len(mesh))
    )


def _fitted(mesh: Mesh | GridBlocks, scheme: Fit, boundary: str) -> Curvatures:
    found = drivers.fit(mesh, scheme, boundary)
    warn_of_rounding(mesh, found.mean)
    return found


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
