"""Which driver computes what a verb asks for: it rests on where a mesh is, and on the kind of scheme."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from quadcurv import drivers
from quadcurv.drivers import answers, face_parts, parts
from quadcurv.io import as_mesh_or_chunks
from quadcurv.mesh import ChunkedGrid, FaceParts, GridBlocks, Mesh
from quadcurv.precision import warn_of_rounding
from quadcurv.schemes import Curvatures, Fit, Laplacian, Scheme, as_scheme


def results(
    mesh: Any,
    wanted: Iterable[str],
    scheme: Scheme,
    boundary: str,
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Results by name, of whatever holds a mesh, into arrays of `out` where there are any."""
    if isinstance(mesh, FaceParts):
        return face_parts.evaluate(mesh, wanted, scheme, boundary, out, progress)
    mesh = parts.in_parts(taken(mesh), scheme)
    if isinstance(mesh, ChunkedGrid):
        return parts.evaluate(mesh, wanted, scheme, boundary, out, progress)
    if isinstance(scheme, Laplacian):
        found = drivers.run(mesh, scheme, wanted, boundary, out, tell=True)
    else:
        if drivers.device.holds(mesh):
            drivers.device.checked_scheme(scheme)
        found = drivers.arrays(mesh, scheme, wanted, out)
        curvatures = fitted(mesh, scheme, boundary)
        for name, values in found.items():
            values[...] = answers.FITTED[name][1](curvatures)
    return {name: split(mesh, values) for name, values in found.items()}


def taken(mesh: Any) -> Any:
    """What a verb is asked of, as the drivers take it; grids that are not in memory, too."""
    return mesh if isinstance(mesh, GridBlocks) else as_mesh_or_chunks(mesh)


def split(mesh: Any, values: Any) -> Any:
    """Results as a verb gives them: of blocks (n, ...) as one array, or Curvatures, a block."""
    if not isinstance(mesh, GridBlocks):
        return values
    if not isinstance(values, Curvatures):
        return mesh.split(values)
    return tuple(
        drivers.each(values, lambda x, k=k: mesh.split(x)[k])  # type: ignore[misc]
        for k in range(len(mesh))
    )


def fitted(mesh: Mesh | GridBlocks, scheme: Fit, boundary: str) -> Curvatures:
    """All that a fit finds, with a warning where rounding shows in it."""
    found = drivers.fit(mesh, scheme, boundary)
    warn_of_rounding(mesh, found.mean)
    return found


def as_laplacian(scheme: str | Scheme) -> Laplacian:
    """The scheme, if it has a matrix."""
    scheme = as_scheme(scheme)
    if isinstance(scheme, Fit):
        raise ValueError(f"scheme: {scheme.name} is a fit, which has no stiffness matrix and no dual areas")
    return scheme


def as_fit(scheme: str | Scheme) -> Fit:
    """The scheme, if it is a fit."""
    scheme = as_scheme(scheme)
    if isinstance(scheme, Laplacian):
        raise ValueError(
            f"scheme: {scheme.name} gives the mean curvature alone; a fit is needed, such as 'jet'"
        )
    return scheme
