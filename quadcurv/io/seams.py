"""Seams: what looks closed and is open."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.checks import checked_wrap
from quadcurv.coincidence import first_at_place
from quadcurv.device_arrays import is_on_device
from quadcurv.io.base import SAME_PLACE
from quadcurv.mesh import QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.types import Floats, MeshError, warn

_NAMES = "rows", "columns"
_SAMPLES = 16  # points a direction that tell the extent of a grid


def warn_of_seam(mesh: QuadMesh) -> None:
    """Say so where boundary vertices coincide."""
    stencils = mesh.stencils()
    rim = np.flatnonzero(~stencils.closed)
    if not rim.size:
        return
    of_faces = np.zeros(stencils.n + 1, bool)  # the last one for the marks of triangles, -1
    of_faces[stencils.faces] = True
    rim = rim[of_faces[rim]]
    points = mesh.points[rim]
    first = first_at_place(points, SAME_PLACE * float(np.ptp(mesh.points, axis=0).max()))
    doubled = first != np.arange(len(rim))
    if doubled.any():
        shared = np.isin(first, first[doubled])
        gap = np.linalg.norm(points - points[first], axis=1).max()
        one = int(np.argmax(shared))
        other = int(np.flatnonzero(first == one)[1])
        # Chains of points within the tolerance are one place: no gap is wider than twice that to the first.
        tolerance = f", tolerance={2 * gap:.1e}" if gap else ""
        warn(
            f"{np.count_nonzero(shared)} boundary vertices lie where others do, to {gap:.2g}, "
            f"first vertices {rim[one]} and {rim[other]}: the mesh is open along a seam; "
            f"merge_points(mesh{tolerance}) closes it"
        )


def warn_of_open_sides(grid: QuadGrid | StaggeredGrid) -> None:
    """Say so where the first and the last row or column of an open grid coincide."""
    points, argument = (grid.points, "points") if isinstance(grid, QuadGrid) else (grid.dual, "dual")
    if is_on_device(points) or (isinstance(grid, StaggeredGrid) and grid.has_ghosts):
        return
    open_ = [axis for axis in (0, 1) if not grid.wrap[axis] and _may_meet(points, axis)]
    if not open_:
        return
    gaps = {axis: gap for axis in open_ if (gap := _gap(points, axis)) <= SAME_PLACE * _extent(points)}
    if not gaps:
        return
    names = " and of the ".join(_NAMES[axis] for axis in gaps)
    wrap = tuple(wraps or axis in gaps for axis, wraps in enumerate(grid.wrap))
    left = ", ".join(":-1" if axis in gaps else ":" for axis in (0, 1)).removesuffix(", :")
    given = f"{argument}[{left}]" if isinstance(grid, QuadGrid) else "primal, dual"
    warn(
        f"the first and the last of the {names} of {argument} coincide, to {max(gaps.values()):.2g}: the "
        f"grid is open along a seam; {type(grid).__name__}({given}, wrap={wrap}) closes it"
    )


def _may_meet(points: Floats, axis: int) -> bool:
    """Whether the first corner says no at once: the other side is farther from it than the next point."""
    others = (points[-1, 0], points[1, 0]) if axis == 0 else (points[0, -1], points[0, 1])
    (x, y, z), *ends = (point.tolist() for point in (points[0, 0], *others))
    away, step = (max(abs(x - a), abs(y - b), abs(z - c)) for a, b, c in ends)
    return not away > step > 0  # NaN says nothing


def _gap(points: NDArray[np.floating[Any]], axis: int) -> float:
    """How far the first and the last row or column are apart, infinite where they have other holes."""
    one, other = points.take(0, axis), points.take(-1, axis)
    gap = np.where(np.isnan(one) & np.isnan(other), 0, np.abs(one - other)).max()
    return float("inf") if np.isnan(gap) or not np.isfinite(one).any() else float(gap)


def _extent(points: NDArray[np.floating[Any]]) -> float:
    steps = (max(1, size // _SAMPLES) for size in points.shape[:2])
    some = points[tuple(slice(None, None, step) for step in steps)].reshape(-1, 3)
    some = some[np.isfinite(some).all(axis=1)]
    return float(np.ptp(some, axis=0).max()) if len(some) else 0.0


def closed_grid(points: NDArray[np.floating[Any]], wrap: Sequence[bool] | None, seams: bool) -> QuadGrid:
    """The grid of a StructuredGrid, whose last row or column repeats the first where it wraps."""
    wraps = (False, False) if wrap is None else checked_wrap(wrap)
    extent = _extent(points)
    gaps = [_gap(points, axis) for axis in (0, 1)]
    meets = tuple(gap <= SAME_PLACE * extent for gap in gaps)
    for axis, name in enumerate(_NAMES):
        if wraps[axis] and not meets[axis]:
            raise MeshError(f"mesh: first and last {name} differ by {gaps[axis]:.3g} although they wrap")
        if meets[axis] and seams and wrap is None:
            warn(
                f"first and last {name} of the StructuredGrid coincide: it is open along a seam that "
                f"wrap={meets} closes"
            )
    return QuadGrid(points[tuple(slice(-1 if wrap else None) for wrap in wraps)], wraps)
