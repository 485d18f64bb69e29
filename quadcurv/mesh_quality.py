"""How good a mesh is, vertex by vertex, and how much of what it holds."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv import drivers
from quadcurv.boundary import EXTRAPOLATED, FITTED, INTERIOR, OPEN, boundary_treatment, roughness
from quadcurv.io import as_mesh
from quadcurv.mesh import Mesh
from quadcurv.schemes import SCHEMES, Fit, Scheme, as_scheme
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats


def quality(mesh: Any) -> dict[str, NDArray[Any]]:
    """Shape of the worst face at every vertex, and how far to trust the boundary.

    Parameters
    ----------
    mesh
        As for :func:`quadcurv.mean_curvature`.

    Returns
    -------
    dict of str to array of shape (n,) or (r, c)
        ``valence``, int32
            Number of faces.
        ``nonplanarity``, float64
            Distance between the diagonals of a quad over their mean length; 0 where it is planar.
        ``skew``, float64
            Deviation of an angle from 90 degrees in a quad, from 60 in a triangle, in degrees; above 90
            where a quad is not convex or crosses itself.
        ``aspect``, float64
            Longest over shortest edge of a face.
        ``roughness``, float64
            About the relative error that extrapolation makes at the boundary, 0 inside; see
            :func:`quadcurv.boundary.roughness`.

        NaN at isolated vertices and where it has no meaning: beside a face whose vector area vanishes
        (nonplanarity and skew) or an edge without length (skew and aspect), in an open ring (roughness).

    Raises
    ------
    ValueError
        As for :func:`quadcurv.mean_curvature`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> found = qc.quality(ball)
    >>> int(found["valence"].min()), float(found["nonplanarity"].max()) < 0.1
    (3, True)
    """
    mesh = as_mesh(mesh)
    stencils = mesh.stencils()
    faces, valence = stencils.faces, stencils.valence
    x, given = _corners(stencils)
    fields: dict[str, NDArray[Any]] = {"valence": valence}
    for name, measure in (("nonplanarity", _nonplanarity), ("skew", _skew), ("aspect", _aspect)):
        of_face = np.broadcast_to(measure(x, given)[:, None], faces.shape)
        worst = np.zeros(len(stencils.points))
        with np.errstate(invalid="ignore"):  # NaN stays
            np.maximum.at(worst, faces[given], of_face[given])
        fields[name] = np.where(valence > 0, worst[: stencils.n], np.nan)
    return {name: mesh.in_shape(values) for name, values in fields.items()} | {"roughness": roughness(mesh)}


def summary(mesh: Any, schemes: Iterable[str] | None = None, boundary: str = "extrapolate") -> dict[str, Any]:
    """Count what a mesh holds and what is lost of it.

    Parameters
    ----------
    mesh, boundary
        As for :func:`quadcurv.mean_curvature`.
    schemes : iterable of str, optional
        Those to run; by default all of ``quadcurv.SCHEMES``.

    Returns
    -------
    dict
        ``vertices``, ``quads``, ``triangles``: how many. ``polygons``: faces of more than four sides that
        were split into triangles. ``turned``: faces turned to agree with their neighbours.
        ``coincident``: vertices at the very position of another one, as on the two sides of a seam.
        ``valence``: vertices by number of faces. ``boundary``: vertices whose ring is "interior",
        "extrapolated", "fitted" or "open", see :func:`quadcurv.boundary.boundary_treatment`. ``undefined``:
        vertices without mean curvature, by scheme.

    Raises
    ------
    ValueError
        As for :func:`quadcurv.mean_curvature`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> found = qc.summary(ball, ["liu"])
    >>> found["quads"], found["valence"], found["undefined"]
    (96, {3: 8, 4: 90}, {'liu': 0})
    """
    mesh = as_mesh(mesh)
    stencils = mesh.stencils()
    present = mesh.in_shape(np.ones(stencils.n, bool))  # but the holes of a grid
    treatment = boundary_treatment(mesh, boundary)[present]
    triangles = int(np.count_nonzero(stencils.faces[:, 3] < 0))
    return {
        "vertices": stencils.n,
        "quads": len(stencils.faces) - triangles,
        "triangles": triangles,
        "polygons": mesh.report["cut"],
        "turned": mesh.report["turned"],
        "coincident": stencils.n - len(np.unique(stencils.points[: stencils.n] + 0.0, axis=0)),
        "valence": {k: int(count) for k, count in enumerate(np.bincount(stencils.valence)) if count},
        "boundary": {
            name: int(np.count_nonzero(treatment == code))
            for name, code in (
                ("interior", INTERIOR),
                ("extrapolated", EXTRAPOLATED),
                ("fitted", FITTED),
                ("open", OPEN),
            )
        },
        "undefined": {
            name: int(np.count_nonzero(np.isnan(_mean_curvature(mesh, as_scheme(name), boundary)[present])))
            for name in (SCHEMES if schemes is None else schemes)
        },
    }


def _mean_curvature(mesh: Mesh, scheme: Scheme, boundary: str) -> Floats:
    if isinstance(scheme, Fit):
        return drivers.fit(mesh, scheme, boundary).mean
    return drivers.run(mesh, scheme, ["mean_curvature"], boundary)["mean_curvature"]


def _corners(stencils: Stencils) -> tuple[Floats, Bools]:
    """Positions (m, 4, 3) of the corners of faces, and which (m, 4) there are.

    A triangle's fourth corner is its first one again, so that diagonals give its vector area too.
    """
    faces = stencils.faces
    return stencils.points[np.where(faces < 0, faces[:, :1], faces)], faces >= 0


def _edges(x: Floats, given: Bools) -> tuple[Floats, Floats]:
    """Edges (m, 4, 3) to the next vertex of a face and from the previous one."""
    ahead = np.roll(x, -1, axis=1) - x
    behind = np.roll(ahead, 1, axis=1)
    behind[~given[:, 3], 0] = ahead[~given[:, 3], 2]
    return ahead, behind


def _nonplanarity(x: Floats, given: Bools) -> Floats:
    u, v = x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]
    normal = np.cross(u, v)
    gap = np.abs(np.einsum("ix,ix->i", x[:, 1] - x[:, 0], normal))
    length = (np.linalg.norm(u, axis=1) + np.linalg.norm(v, axis=1)) / 2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        ratio = gap / np.linalg.norm(normal, axis=1) / length
    return np.where(given[:, 3], np.where(np.isfinite(ratio), ratio, np.nan), 0.0)


def _skew(x: Floats, given: Bools) -> Floats:
    ahead, behind = _edges(x, given)
    corner = np.cross(behind, ahead)
    normal = np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1])
    angle = np.arctan2(np.linalg.norm(corner, axis=2), -np.einsum("isx,isx->is", behind, ahead))
    reflex = np.einsum("isx,ix->is", corner, normal) < 0
    angle = np.degrees(np.where(reflex, 2 * np.pi - angle, angle))
    no_length = (ahead == 0).all(axis=2) | (behind == 0).all(axis=2)
    angle[no_length | (normal == 0).all(axis=1, keepdims=True)] = np.nan
    right = np.where(given[:, 3:], 90.0, 60.0)
    return np.abs(angle - right).max(axis=1, where=given, initial=0.0)


def _aspect(x: Floats, given: Bools) -> Floats:
    length = np.linalg.norm(_edges(x, given)[0], axis=2)
    shortest = length.min(axis=1, where=given, initial=np.inf)
    shortest[shortest == 0] = np.nan
    return length.max(axis=1, where=given, initial=0.0) / shortest
