"""Grids larger than memory, block by block: what one grid in memory gives, to the bit or to rounding.

A block is read with the rows around it and computed as a grid of its own, without ghosts. What depends on
open sides, in rows near them, comes from strips along whole sides that are computed beforehand: whether
ghosts go by index or by fitted surfaces, and whether a side is a pole, is decided as for the whole grid.
Where points are missing a block is computed as a face list, with so much around it that what closes its
rings is the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from quadcurv.boundary import checked_boundary
from quadcurv.drivers import answers
from quadcurv.drivers.progress import tracked
from quadcurv.drivers.targets import IN_SLICES, checked_out, targets
from quadcurv.drivers.tasks import BORDER, Task, with_holes
from quadcurv.drivers.windows import (
    Cut,
    HoleError,
    Range,
    Window,
    arrays_of,
    blocks,
    edges,
    opened,
    ranges,
    taken,
)
from quadcurv.mesh import ChunkedGrid
from quadcurv.mesh.grid import refuse_repetition
from quadcurv.mesh.mapped import forget
from quadcurv.precision import error_at_edges, sample, warn_of_error
from quadcurv.types import Floats, MeshError, warn

_MOST = 2**20  # vertices of a block
_MOST_SMALL = 2**16  # where each takes much memory
# Windows whose results are cut from a larger one: what a side of the window that is none of the grid does to
# rows near it, such as to be taken for a pole, must not be seen.
MARGIN = 2


class Region(NamedTuple):
    """Results in a rectangle of a grid."""

    rows: Range
    columns: Range
    values: Mapping[str, Any]

    def patch(self, rows: Range, columns: Range, into: Mapping[str, Floats]) -> None:
        """Write what it shares with a block to arrays of the block."""
        (a, b), (c, d) = (
            (max(own[0], other[0]), min(own[1], other[1]))
            for own, other in ((self.rows, rows), (self.columns, columns))
        )
        if a >= b or c >= d:
            return
        for name, array in into.items():
            own = self.values[name][
                a - self.rows[0] : b - self.rows[0], c - self.columns[0] : d - self.columns[0]
            ]
            array[a - rows[0] : b - rows[0], c - columns[0] : d - columns[0]] = own


@dataclass
class _Sample:
    """Edges at some vertices, by which the cost of rounding is told, and H there."""

    i: Any
    j: Any
    found: list[tuple[Floats, Floats]]
    H: list[Floats]

    def look(self, window: Window, shape: tuple[int, int], into: Mapping[str, Floats]) -> None:
        """Add those in a block."""
        (a, b), (c, d) = ((cut.first, cut.last) for cut in (window.rows, window.columns))
        inside = (self.i >= a) & (self.i < b) & (self.j >= c) & (self.j < d)
        if not inside.any():
            return
        i, j = self.i[inside], self.j[inside]
        begin, end = edges(window, i, j, shape)
        self.found.append((begin, end))
        if (name := answers.telling(into)) is not None:
            self.H.append(into[name][i - a, j - c].ravel())

    def warn(self, roundoff: float) -> None:
        """Say what rounding costs."""
        begin, end = (np.concatenate(x) for x in zip(*self.found, strict=True))
        H = np.concatenate(self.H) if self.H else np.empty(0)
        warn_of_error(*error_at_edges(begin, end, roundoff), roundoff, H)


def evaluate(
    grid: ChunkedGrid,
    task: Task,
    boundary: str = "extrapolate",
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
    look_at_rounding: bool = False,
) -> dict[str, Any]:
    """Results by name, into the arrays of `out` where there are any."""
    checked_boundary(boundary)
    lead = tuple(int(n) for n in grid.points.shape[:-3])
    shapes = {name: lead + grid.shape + more for name, more in task.shapes.items()}
    sources = {"points": grid.points, "dual": grid.dual, "mask": grid.mask}
    sources |= {f"function {k}": f for k, f in enumerate(task.others)}
    results = targets(shapes, checked_out(out), sources, IN_SLICES)
    for at in np.ndindex(*lead):
        own = {name: _entry(array, at) for name, array in results.items()}
        one = entry(grid, at)
        sampled = _Sample(*sample(*grid.shape), [], []) if look_at_rounding else None
        holes, declared = holes_of(one), one.mask is not None
        try:
            _by_blocks(one, task, boundary, own, holes, progress, sampled)
        except HoleError as hole:
            if not declared:
                place = f"first found vertex {hole.place}"
                warn(f'points without a position, taken as holes, {place}; mask="nan" declares them')
            sampled = None if sampled is None else _Sample(sampled.i, sampled.j, [], [])
            _by_blocks(one, task, boundary, own, True, progress, sampled)
        if sampled is not None:
            sampled.warn(grid.roundoff)
    return results


def entry(grid: ChunkedGrid, at: tuple[int, ...]) -> ChunkedGrid:
    """One of the grids along the dimensions before rows and columns."""
    if not at:
        return grid
    mask = grid.mask
    if mask is not None and not isinstance(mask, str) and len(mask.shape) > 2:
        mask = _entry(mask, at)
    dual = None if grid.dual is None else _entry(grid.dual, at)
    return grid.replaced(points=_entry(grid.points, at), dual=dual, mask=mask)


def _entry(array: Any, at: tuple[int, ...]) -> Any:
    """An entry of an array, not read."""
    if not at:
        return array
    return (
        array[at] if isinstance(array, np.ndarray) or hasattr(array, "__dask_graph__") else _Entry(array, at)
    )


class _Entry:
    """What is at some indices of an array on disk."""

    def __init__(self, array: Any, at: tuple[int, ...]) -> None:
        self.array, self.at, self.dtype = array, at, array.dtype
        self.shape = tuple(array.shape[len(at) :])
        chunks = getattr(array, "chunks", None)
        self.chunks = chunks[len(at) :] if chunks else None

    def __getitem__(self, index: tuple[Any, ...]) -> Any:
        return self.array[(*self.at, *index)]

    def __setitem__(self, index: tuple[Any, ...], values: Any) -> None:
        self.array[(*self.at, *index)] = values


def holes_of(grid: ChunkedGrid) -> bool:
    """Whether a mask that is an array hides anything."""
    if grid.mask is None or isinstance(grid.mask, str):
        return False
    rows = ranges(grid.shape[0], max(1, 2**24 // grid.shape[1]))
    return any(np.asarray(grid.mask[begin:end, :]).any() for begin, end in rows)


def sides(grid: ChunkedGrid, task: Task) -> Iterator[tuple[int, int, Cut, Cut]]:
    """Open sides: axis, end, and what is read of rows and columns for results in the rows along it."""
    if grid.has_ghosts:
        return
    for axis in (1, 0):
        size = grid.shape[axis]
        if grid.wrap[axis]:
            continue
        whole = [Cut.around((0, n), n, w, 0) for n, w in zip(grid.shape, grid.wrap, strict=True)]
        for end in (0, -1):
            rows, columns = _replaced(whole, axis, size, end, task)
            yield axis, end, rows, columns


def _replaced(cuts: list[Cut], axis: int, size: int, end: int, task: Task) -> list[Cut]:
    near = min(size, task.depth)
    depth = min(size, max(2 * BORDER, task.depth + task.reach + MARGIN))
    begin, first = (0, 0) if end == 0 else (size - depth, size - near)
    own = Cut(begin, begin + depth, first, first + near, size, False)
    if size <= 2 * depth:  # both sides
        own = own._replace(begin=0, end=size)
    return [own if i == axis else cut for i, cut in enumerate(cuts)]


def region(task: Task, window: Window, boundary: str | None, others: tuple[Any, ...] = ()) -> Region:
    """Results of a window's block."""
    rows, columns = ((cut.first, cut.last) for cut in (window.rows, window.columns))
    shape = rows[1] - rows[0], columns[1] - columns[0]
    into = {name: np.empty(shape + more) for name, more in task.shapes.items()}
    task.write(window, boundary, into, *others)
    return Region(rows, columns, into)


def _by_blocks(
    grid: ChunkedGrid,
    task: Task,
    boundary: str,
    results: Mapping[str, Any],
    holes: bool,
    progress: bool,
    sampled: _Sample | None,
) -> None:
    regions, size = [], None
    if not holes:
        _check_seams(grid)
    if task.scaled:
        size = _size(grid)
    if not holes:
        for _, _, rows, columns in sides(grid, task):
            window = opened(grid, rows, columns, arrays_of(grid, rows, columns), False, size)
            others = tuple(taken(f, rows.slices(), columns.slices()) for f in task.others)
            regions.append(region(task, window, boundary, others))
    else:
        task = with_holes(task)
    found = blocks(grid, _MOST_SMALL if task.small else _MOST, task.small)
    halo = task.reach + MARGIN
    for (a, b), (c, d) in tracked(found, "blocks", len(found), progress):
        rows, columns = (
            Cut.around(own, size, wraps, halo)
            for own, size, wraps in zip(((a, b), (c, d)), grid.shape, grid.wrap, strict=True)
        )
        window = opened(grid, rows, columns, arrays_of(grid, rows, columns), holes, size)
        others = tuple(taken(f, rows.slices(), columns.slices()) for f in task.others)
        into = {name: _target(results[name], (a, b), (c, d), more) for name, more in task.shapes.items()}
        task.write(window, boundary if holes else None, into, *others)
        for side in regions:
            side.patch((a, b), (c, d), into)
        if sampled is not None:
            sampled.look(window, grid.shape, into)
        for name, values in into.items():
            if values.base is None:
                results[name][a:b, c:d] = values
            elif d == grid.shape[1]:
                forget(results[name], 0, a)
        if d == grid.shape[1]:
            for array in (grid.points, grid.dual):
                forget(array, 0, a)


def _size(grid: ChunkedGrid) -> float:
    """Largest coordinate, by which positions are rounded."""
    most = 0.0
    masked = grid.mask is not None and not isinstance(grid.mask, str)
    for array in (grid.points, grid.dual):
        if array is None:
            continue
        for begin, end in ranges(array.shape[0], max(1, _MOST // array.shape[1])):
            size = np.abs(array[begin:end, :])
            if masked:
                size[np.asarray(grid.mask[begin:end, :])] = 0
            most = max(most, float(np.nanmax(size, initial=0.0)))
            forget(array, 0, end)
    return most


def _target(result: Any, rows: Range, columns: Range, more: tuple[int, ...]) -> Floats:
    """Where a block's results go: to their place if that is in one piece, else (of no base) to be copied."""
    if isinstance(result, np.ndarray) and result.dtype == np.float64:
        place = np.asarray(result)[rows[0] : rows[1], columns[0] : columns[1]]
        if place.flags.c_contiguous and place.flags.writeable:
            return place
    return np.empty((rows[1] - rows[0], columns[1] - columns[0], *more))


def _check_seams(grid: ChunkedGrid) -> None:
    """Refuse, as a grid in memory does, rows (columns) that wrap and are given twice, or do not meet."""
    for axis, name in enumerate(("rows", "columns")):
        if not grid.wrap[axis]:
            continue
        array = grid.points if grid.dual is None else grid.dual
        at = (slice(0, 2), slice(None)), (slice(array.shape[0] - 1, array.shape[0]), slice(None))
        if axis == 1:
            at = (slice(None), slice(0, 2)), (slice(None), slice(array.shape[1] - 1, array.shape[1]))
        ends = np.concatenate([np.asarray(taken(array, [i], [j])) for i, j in at], axis=axis)
        if grid.dual is None:
            refuse_repetition(ends, axis, name)
            continue
        gap = np.abs(ends.take(0, axis) - ends.take(-1, axis)).max()
        if gap > _SEAM * np.ptp(ends.reshape(-1, 3), axis=0).max():
            raise MeshError(f"dual: first and last {name} differ by {gap:.3g} although they wrap")


_SEAM = 1e-9


def hole_refused(hole: HoleError) -> MeshError:
    """What is said where there are no holes to be."""
    return MeshError(
        f'points: NaN at vertex {hole.place}; ChunkedGrid(points, mask="nan") takes it for a hole'
    )
