"""Seams: what looks closed and is open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadcurv.checks import checked_wrap
from quadcurv.coincidence import first_at_place
from quadcurv.io.base import SAME_PLACE, warn
from quadcurv.mesh import QuadGrid, QuadMesh
from quadcurv.types import MeshError


def warn_of_seam(mesh: QuadMesh) -> None:
    """Say so where boundary vertices coincide."""
    stencils = mesh.stencils()
    rim = np.flatnonzero(~stencils.closed & (stencils.valence > 0))
    if not rim.size:
        return
    points = mesh.points[rim]
    first = first_at_place(points, SAME_PLACE * float(np.ptp(mesh.points, axis=0).max()))
    doubled = first != np.arange(len(rim))
    if doubled.any():
        shared = np.isin(first, first[doubled])
        gap = np.linalg.norm(points - points[first], axis=1).max()
        one = int(np.argmax(shared))
        other = int(np.flatnonzero(first == one)[1])
        warn(
            f"{np.count_nonzero(shared)} boundary vertices lie where others do, to {gap:.2g}, "
            f"first vertices {rim[one]} and {rim[other]}: the mesh is open along a seam; "
            "merge_points closes it"
        )


def closed_grid(points: NDArray[np.floating], wrap: Sequence[bool] | None, seams: bool) -> QuadGrid:
    """The grid of a StructuredGrid, whose last row or column repeats the first where it wraps."""
    wraps = (False, False) if wrap is None else checked_wrap(wrap)
    known = points[np.isfinite(points).all(axis=2)]
    extent = np.ptp(known, axis=0).max() if len(known) else 0.0
    for axis, name in enumerate(("rows", "columns")):
        one, other = points.take(0, axis), points.take(-1, axis)
        gap = np.where(np.isnan(one) & np.isnan(other), 0, np.abs(one - other)).max()
        meets = gap <= SAME_PLACE * extent
        if wraps[axis]:
            if not meets:
                raise MeshError(f"mesh: first and last {name} differ by {gap:.3g} although they wrap")
            points = points.take(range(points.shape[axis] - 1), axis)
        elif meets and seams and wrap is None:
            warn(
                f"first and last {name} of the StructuredGrid coincide: it is open along a seam that "
                "wrap=... closes"
            )
    return QuadGrid(points, wraps)
