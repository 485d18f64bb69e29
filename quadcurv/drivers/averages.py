"""Curvatures at a scale: means over the part of the surface within a distance of every vertex."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from quadcurv.mesh import GridBlocks, Mesh, QuadGrid, StaggeredGrid
from quadcurv.schemes import Curvatures, StandardErrors
from quadcurv.types import Floats


def checked_radius(radius: Any) -> float:
    """A radius as a float; refused unless it is a positive, finite number."""
    number = isinstance(radius, float | int | np.number) and not isinstance(radius, bool)
    if not number or not 0 < float(radius) < np.inf:
        raise ValueError(f"radius: expected a positive, finite length, got {radius!r}")
    return float(radius)


def averaged(mesh: Mesh | GridBlocks, found: Curvatures, radius: float) -> Curvatures:
    """Means over balls of a radius, as `curvatures` describes them."""
    from quadcurv.kernels import discs

    if isinstance(mesh, GridBlocks):
        mesh = mesh.to_mesh()

    def flat(values: Floats) -> Floats:
        return mesh.flat(values)

    k1, k2, d1, d2 = (flat(x) for x in (found.k1, found.k2, found.direction1, found.direction2))
    tensor = k1[:, None, None] * _square(d1) + k2[:, None, None] * _square(d2)
    given = (flat(found.mean), flat(found.gaussian), k1, k2, flat(found.normal), tensor.reshape(-1, 9))
    surface = _cells(mesh) if isinstance(mesh, StaggeredGrid) else mesh.stencils()
    areas, sums = discs.integrals(surface.points, surface.faces, np.column_stack(given), radius)
    with np.errstate(divide="ignore", invalid="ignore"):
        means = sums / areas[:, None]
        normal = means[:, 4:7] / np.linalg.norm(means[:, 4:7], axis=1)[:, None]
    direction1, direction2 = _principal(means[:, 7:].reshape(-1, 3, 3), normal)
    columns = {"mean": 0, "gaussian": 1, "k1": 2, "k2": 3}
    changed: dict[str, Any] = {name: mesh.in_shape(means[:, k]) for name, k in columns.items()}
    for name, values in (("direction1", direction1), ("direction2", direction2), ("normal", normal)):
        changed[name] = mesh.in_shape(values)
    for name, value in vars(found).items():
        if isinstance(value, StandardErrors):
            changed[name] = None
    return replace(found, **changed)


def _cells(grid: StaggeredGrid) -> Any:
    """The quads between the centres of cells."""
    inner = slice(1, -1) if grid.has_ghosts else slice(None)
    return QuadGrid(grid.primal[inner, inner], grid.wrap).stencils()


def _square(d: Floats) -> Floats:
    return d[:, :, None] * d[:, None, :]


def _principal(tensor: Floats, normal: Floats) -> tuple[Floats, Floats]:
    """Unit tangents of the larger and of the smaller eigenvalue of the tangential part of tensors."""
    axis = np.eye(3)[np.argmin(np.abs(np.nan_to_num(normal)), axis=1)]
    e = np.cross(normal, axis)
    with np.errstate(divide="ignore", invalid="ignore"):
        e /= np.linalg.norm(e, axis=1)[:, None]
    f = np.cross(normal, e)
    ee, ef, ff = (np.einsum("ni,nij,nj->n", a, tensor, b) for a, b in ((e, e), (e, f), (f, f)))
    angle = np.arctan2(2 * ef, ee - ff)[:, None] / 2
    first = np.cos(angle) * e + np.sin(angle) * f
    return first, np.cross(normal, first)
