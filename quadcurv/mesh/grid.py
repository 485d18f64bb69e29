"""A logically Cartesian grid of vertices, which may have holes."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.checks import Report, checked_wrap, masked_points, unit_roundoff
from quadcurv.device_arrays import on_host
from quadcurv.mesh.face_list import QuadMesh, summary_table, warn_of
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, MeshError

_REPEATED = 3  # rows at most that are looked for at both ends of a wrap


@dataclass(frozen=True, eq=False, init=False, repr=False)
class QuadGrid:
    """A logically Cartesian grid of vertices.

    Parameters
    ----------
    points : (r, c, 3) array_like of float
        Positions; the surface normal is that of the first direction times the second. Grids of
        ``numpy.meshgrid(x, y, indexing="ij")`` with z = f(x, y) have it along +z, those of
        ``indexing="xy"``, where x runs along the second direction, along -z, and H of the other sign.
        Positions on a device (cupy, or what has __cuda_array_interface__ or DLPack) stay there.
    wrap : (bool, bool)
        Whether the last row (column) is followed by the first, which is not repeated.
    mask : (r, c) array_like of bool, optional
        True where there is no point, as in numpy's masked arrays; so are points that `points` masks, or
        whose coordinates are NaN. Holes are open sides: results are NaN in them, and beside them as at
        every border.

    Attributes
    ----------
    points : (r, c, 3) float64, read-only
        NaN where masked.
    wrap : (bool, bool)
    mask : (r, c) bool or None
    roundoff : float
        Relative rounding error of the positions as they were given, 2^-24 for float32.

    Raises
    ------
    MeshError
        A ValueError: wrong shape, fewer than 2 points a direction (3 where it wraps), infinite points, a
        wrap whose first row (column) is given twice, a mask that leaves no quad.

    Warns
    -----
    MeshWarning
        Points that are NaN without being masked.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> x, y = np.meshgrid(np.linspace(-1, 1, 21), np.linspace(-1, 1, 21), indexing="ij")
    >>> hill = qc.QuadGrid(np.stack([x, y, np.exp(-(x**2) - y**2)], axis=-1))
    >>> hill
    QuadGrid(21 x 21 points, wrap=(False, False))
    >>> round(float(qc.mean_curvature(hill)[10, 10]), 1)
    2.0
    """

    points: Floats
    wrap: tuple[bool, bool]
    mask: Bools | None
    roundoff: float

    def __init__(
        self, points: ArrayLike, wrap: Sequence[bool] = (False, False), mask: ArrayLike | None = None
    ) -> None:
        wraps = checked_wrap(wrap)
        checked, hidden, unexpected = masked_points(points, mask)
        self.__dict__.update(points=checked, wrap=wraps, mask=hidden, roundoff=unit_roundoff(points))
        for axis, name in enumerate(("rows", "columns")):
            least = 3 if wraps[axis] else 2
            if checked.shape[axis] < least:
                raise MeshError(
                    f"points: {checked.shape[axis]} {name}, at least {least} are needed"
                    + (" where the grid wraps" if wraps[axis] else "")
                )
            if wraps[axis]:
                refuse_repetition(checked, axis, name)
        self.__dict__["report"] = Report(unexpected)
        warn_of(unexpected)

    def __repr__(self) -> str:
        masked = f", {np.count_nonzero(self.mask)} masked" if self.mask is not None else ""
        return f"QuadGrid({self.shape[0]} x {self.shape[1]} points, wrap={self.wrap}{masked})"

    def _repr_html_(self) -> str:
        return summary_table(repr(self), self.points, self.report)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of vertices."""
        return self.points.shape[0], self.points.shape[1]

    report: Report
    """Points without a position, taken as holes."""

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at open sides stay open.

        Of a grid with a mask these are the stencils of :meth:`to_mesh`, in whose order they are.
        """
        if self.mask is not None:
            return self.to_mesh().stencils()
        index = np.arange(self.shape[0] * self.shape[1], dtype=np.int32).reshape(self.shape)
        index = np.pad(index, [(0, int(w)) for w in self.wrap], mode="wrap")
        closed = np.ones(self.shape, bool)
        if not self.wrap[0]:
            closed[[0, -1]] = False
        if not self.wrap[1]:
            closed[:, [0, -1]] = False
        points, faces = self.points.reshape(-1, 3), grid_faces(index)
        return Stencils(points, faces, self.shape, closed.ravel(), roundoff=self.roundoff)

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results.

        Where masked they are NaN, integers 0.
        """
        if self.mask is None:
            return values.reshape(*self.shape, *values.shape[1:])
        fill = np.nan if values.dtype.kind == "f" else 0
        placed = np.full((*self.shape, *values.shape[1:]), fill, values.dtype)
        placed[~self.mask] = values
        return placed

    def flat(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values in the shape of results as (n, ...): what :meth:`in_shape` takes."""
        if self.mask is not None:
            return values[~self.mask]
        return values.reshape(-1, *values.shape[2:])

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"points": self.points}

    def side(self, axis: int, end: int) -> QuadGrid:
        """Return the two rows (axis 0) or columns (1) at the first (end 0) or last (-1) open side."""
        size = self.shape[axis]
        kept = range(2) if end == 0 else range(size - 2, size)
        wrap = [w and i != axis for i, w in enumerate(self.wrap)]
        return QuadGrid(self.points.take(kept, axis), wrap).with_roundoff(self.roundoff)

    def with_roundoff(self, roundoff: float) -> QuadGrid:
        """Return the same grid whose positions were given in another precision."""
        grid = copy(self)
        grid.__dict__.update(roundoff=roundoff)
        return grid

    def to_mesh(self) -> QuadMesh:
        """Return the same quads as a face list, vertices in row-major order, masked ones left out."""
        if self.mask is None:
            stencils = self.stencils()
            return QuadMesh(stencils.points, stencils.faces).with_roundoff(self.roundoff)
        index = np.full(self.shape, -1, np.int32)
        index[~self.mask] = np.arange(np.count_nonzero(~self.mask))
        faces = grid_faces(np.pad(index, [(0, int(w)) for w in self.wrap], mode="wrap"))
        mesh = QuadMesh(self.points[~self.mask], faces[(faces >= 0).all(axis=1)])
        return mesh.with_roundoff(self.roundoff)


def refuse_repetition(points: Floats, axis: int, name: str, argument: str = "points") -> None:
    """Rows at the end of a wrap that repeat the first ones would make quads without area, or twice."""
    most = min(_REPEATED, points.shape[axis] - 2)
    ends = (*range(most + 1), *range(-most, 0))
    rows = np.moveaxis(on_host(points.take(ends, axis)), axis, 0)
    with np.errstate(invalid="ignore"):
        step = np.nanmax(np.abs(rows[1] - rows[0]), initial=0.0)
        gaps = [np.abs(rows[-count:] - rows[:count]) for count in range(1, most + 1)]
    for count, gap in enumerate(gaps, 1):
        known = np.isfinite(gap)
        # Files in single precision, and grids far from the origin, repeat a row to some digits only.
        if not known.any() or not gap[known].max() <= 1e-3 * step > 0:
            continue
        if count == 1:
            what = f"the last of the {name} repeats the first one, which follows it"
        else:
            what = f"the last {count} of the {name} repeat the first ones, which follow them"
        left = f"[:-{count}]" if axis == 0 else f"[:, :-{count}]"
        raise MeshError(
            f"wrap: {what} where the grid wraps: leave out what is repeated, as {argument}{left} does"
        )
