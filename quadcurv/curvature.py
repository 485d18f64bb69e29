"""The verbs of curvature: one question each, asked of anything that holds a mesh."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from quadcurv import drivers
from quadcurv.boundary import one_rings
from quadcurv.drivers import parts
from quadcurv.drivers.dispatch import as_fit, fitted, results, split, taken
from quadcurv.mesh import ChunkedGrid, GridBlocks
from quadcurv.schemes import Curvatures, Fit, Scheme, SchemeName, as_scheme
from quadcurv.schemes.angle_defect import gaussian_curvature as angle_gaussian_curvature
from quadcurv.schemes.consistency import far_off
from quadcurv.schemes.cotan import cotan
from quadcurv.types import Floats

DEFAULT = "jet"
"""Scheme of H, K, k1 and k2 where none is named, so that H = (k1 + k2) / 2."""


_COTAN = cotan(6)


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
    chosen, scale = as_fit(scheme), None if radius is None else drivers.checked_radius(radius)
    mesh = taken(mesh) if scale else parts.in_parts(taken(mesh), chosen)
    if isinstance(mesh, ChunkedGrid):
        if scale:
            raise ValueError("radius: means reach beyond the chunks of a grid; give it as one in memory")
        return parts.curvatures(mesh, chosen, boundary)
    found = fitted(mesh, chosen, boundary)
    return split(mesh, found if scale is None else drivers.averaged(mesh, found, scale))


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
    names = "k1", "k2", "direction1", "direction2"
    found = results(mesh, names, as_fit(scheme), boundary)
    return PrincipalCurvatures(*(found[name] for name in names))


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
    ConsistencyWarning
        Faces are too skew for a Laplacian, and where.
    PrecisionWarning
        The rounding of the positions reaches a hundredth of H.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0).sample((24, 24))[0]
    >>> bool(np.abs(qc.mean_curvature(ball) - 0.5).max() < 5e-3)
    True
    """
    return results(mesh, ["mean_curvature"], as_scheme(scheme), boundary)["mean_curvature"]


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
    return results(mesh, ["mean_curvature_normal"], as_scheme(scheme), boundary)["mean_curvature_normal"]


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
    if not (isinstance(scheme, str) and scheme == "angle_defect"):
        return results(mesh, ["gaussian_curvature"], as_fit(scheme), boundary)["gaussian_curvature"]
    mesh = taken(mesh)
    if isinstance(mesh, ChunkedGrid):
        return parts.angle_defect(mesh, boundary)
    if drivers.device.holds(mesh):
        raise ValueError("scheme: angle_defect does not run on a device; give it positions in memory")
    if isinstance(mesh, GridBlocks):
        return split(mesh, angle_gaussian_curvature(one_rings(mesh.mesh, boundary))[: mesh.n])
    stencils = one_rings(mesh, boundary)
    # On triangles as skew as make the cotan formula far off angles tell no curvature either.
    K = angle_gaussian_curvature(stencils)
    far = far_off(stencils, _COTAN).known(K)
    place = np.flatnonzero(mesh.in_shape(np.ones(stencils.n, bool)))
    far._replace(vertices=place[far.vertices]).warn(
        "angle_defect: K, as H by cotan-6,", mesh.in_shape(K).shape
    )
    return mesh.in_shape(K)


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
    return results(mesh, ["vertex_normals"], as_scheme("finite_volume"), boundary)["vertex_normals"]


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
    *wanted : str
        "mean_curvature", "mean_curvature_normal", "vertex_normals" or "dual_areas"; of a fit
        "mean_curvature", "mean_curvature_normal", "gaussian_curvature", "k1", "k2", "direction1",
        "direction2", "normal", "standard_error" and "interval" (..., 4) of H, K, k1 and k2, "noise",
        "degree", "rings" and "feature".
    scheme : str or Scheme
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
    return results(mesh, wanted, as_scheme(scheme), boundary, out, progress)
