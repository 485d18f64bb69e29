"""The verbs on chunked grids: by blocks now, or as tasks for later; labelled if the points are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from quadcurv.drivers import answers, chunked, lazy, tasks
from quadcurv.mesh import ChunkedGrid, QuadGrid
from quadcurv.schemes import Curvatures, Fit, Scheme, StandardErrors

_LARGE = 2**18  # vertices


def in_parts(mesh: Any, scheme: Any) -> Any:
    """A large grid in memory as one that is fitted block by block, in less memory; else the mesh."""
    large = isinstance(mesh, QuadGrid) and mesh.mask is None and mesh.shape[0] * mesh.shape[1] >= _LARGE
    if not large or not isinstance(mesh.points, np.ndarray):
        return mesh
    if not isinstance(scheme, Fit) or scheme.reach is None:
        return mesh
    return ChunkedGrid(mesh.points, mesh.wrap).replaced(roundoff=mesh.roundoff)


def evaluate(
    grid: ChunkedGrid,
    wanted: Iterable[str],
    scheme: Scheme,
    boundary: str,
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Several results in one pass."""
    names = dict.fromkeys((*wanted, *(out if isinstance(out, Mapping) else ())))
    look = answers.telling(names) is not None
    return _run(grid, _task(scheme, names), boundary, out, progress, look)


def angle_defect(grid: ChunkedGrid, boundary: str) -> Any:
    """Gaussian curvature by angles."""
    return _run(grid, tasks.angle_defect(), boundary)["gaussian_curvature"]


def curvatures(grid: ChunkedGrid, scheme: Fit, boundary: str) -> Curvatures:
    """All that a fit knows."""
    left_out = (
        {"mean_curvature_normal"} if scheme.pooled else {"mean_curvature_normal", "interval", "feature"}
    )
    names = [name for name in answers.FITTED if name not in left_out]
    found = _run(grid, _task(scheme, names), boundary, look_at_rounding=True)
    arrays: dict[str, Any] = dict(found)
    for name in ("standard_error", "interval"):
        if name in found:
            arrays[name] = StandardErrors(*(found[name][..., k] for k in range(4)))
    for name in ("degree", "rings"):
        arrays[name] = found[name].astype(np.int32)
    if "feature" in found:
        arrays["feature"] = found["feature"] > 0
    return Curvatures(arrays.pop("mean_curvature"), arrays.pop("gaussian_curvature"), **arrays)


def laplace_beltrami(grid: ChunkedGrid, f: Any, scheme: Any) -> Any:
    """The operator on functions (r, c) or (r, c, k), which may be on disk, too."""
    if grid.dual is not None or len(grid.points.shape) > 3:
        raise ValueError("mesh: functions are taken on one grid of vertices, no staggered one, not several")
    if not (hasattr(f, "shape") and hasattr(f, "dtype")):
        f = np.asarray(f)
    if f.dtype.kind not in "biuf":
        raise ValueError(f"f: expected real numbers, got dtype {f.dtype}")
    if tuple(f.shape[:2]) != grid.shape or len(f.shape) > 3:
        raise ValueError(f"f: shape {tuple(f.shape)}, expected {grid.shape} or {(*grid.shape, 'k')}")
    return _run(grid, tasks.laplace_beltrami(scheme, f), "nan")["laplace_beltrami"]


def _task(scheme: Scheme, names: Iterable[str]) -> tasks.Task:
    return tasks.fit(scheme, names) if isinstance(scheme, Fit) else tasks.laplacian(scheme, names)


def _run(
    grid: ChunkedGrid,
    task: tasks.Task,
    boundary: str,
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
    look_at_rounding: bool = False,
) -> dict[str, Any]:
    if grid.is_lazy:
        if out is not None:
            raise ValueError("out: of a dask array results are dask arrays, which dask.array.store writes")
        found = lazy.evaluate(grid, task, boundary)
    else:
        found = chunked.evaluate(grid, task, boundary, out, progress, look_at_rounding)
    if grid.label is None:
        return found
    return {name: grid.label(values, name) for name, values in found.items()}
