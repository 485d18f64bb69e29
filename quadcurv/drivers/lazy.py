"""Grids of dask arrays: a task a chunk, which reads what lies around it, and a task an open side."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from quadcurv.boundary import checked_boundary
from quadcurv.drivers.chunked import MARGIN, Region, entry, hole_refused, region, sides
from quadcurv.drivers.tasks import Task, with_holes
from quadcurv.drivers.windows import Cut, HoleError, Range, arrays_of, opened, taken
from quadcurv.extras import need
from quadcurv.mesh import ChunkedGrid
from quadcurv.types import Floats


def evaluate(grid: ChunkedGrid, task: Task, boundary: str) -> dict[str, Any]:
    """Results by name as dask arrays, in the chunks of the points."""
    checked_boundary(boundary)
    need("dask")
    import dask.array as da

    lead = tuple(int(n) for n in grid.points.shape[:-3])
    found = {at: _evaluate_one(entry(grid, at), task, boundary) for at in np.ndindex(*lead)}
    results = {}
    for name, more in task.shapes.items():
        arrays = [own[name] for own in found.values()]
        result = da.stack(arrays).reshape(*lead, *grid.shape, *more) if lead else arrays[0]
        results[name] = result
    return results


def _evaluate_one(grid: ChunkedGrid, task: Task, boundary: str) -> dict[str, Any]:
    import dask.array as da
    from dask import delayed

    if len(grid.points.chunks[2]) > 1:
        grid = grid.replaced(points=grid.points.rechunk({2: -1}))
    holes, others = grid.mask is not None, task.others
    task = replace(with_holes(task) if holes else task, others=())
    halo = task.reach + MARGIN
    # What a task has to know of the whole grid, without its arrays.
    none = np.empty((0, 0, 3), grid.points.dtype)
    dual = None if grid.dual is None else np.empty((0, 0, 3), grid.dual.dtype)
    facts = grid.replaced(points=none, dual=dual, mask=None, label=None)
    compute = delayed(_block, pure=False)

    size = None
    if task.scaled:
        size = da.nanmax(da.absolute(grid.points))
        if grid.dual is not None:
            size = da.maximum(size, da.absolute(grid.dual).max())

    def inputs(rows: Cut, columns: Cut) -> list[Any]:
        more = [taken(f, rows.slices(), columns.slices(), da.concatenate) for f in others]
        return [size, *arrays_of(grid, rows, columns, da.concatenate), more]

    strips = [
        ((rows.first, rows.last), (columns.first, columns.last),
         delayed(_side, pure=False)(facts, task, boundary, rows, columns, *inputs(rows, columns)))
        for _, _, rows, columns in ([] if holes else sides(grid, task))
    ]  # fmt: skip
    cut = delayed(_shared, pure=False)
    blocks: dict[str, list[list[Any]]] = {name: [] for name in task.shapes}
    tall, wide = (_ranges(sizes) for sizes in _chunks(grid))
    for own_rows in tall:
        for row in blocks.values():
            row.append([])
        for own_columns in wide:
            rows = Cut.around(own_rows, grid.shape[0], grid.wrap[0], halo)
            columns = Cut.around(own_columns, grid.shape[1], grid.wrap[1], halo)
            near = [
                cut(strip, own_rows, own_columns)
                for rows_, columns_, strip in strips
                if _meet(rows_, own_rows) and _meet(columns_, own_columns)
            ]
            found = compute(facts, task, boundary, holes, rows, columns, near, *inputs(rows, columns))
            shape = own_rows[1] - own_rows[0], own_columns[1] - own_columns[0]
            for name, more in task.shapes.items():
                own = found if len(task.shapes) == 1 else found[name]
                blocks[name][-1].append(da.from_delayed(own, shape + more, np.float64))
    return {
        name: da.concatenate([da.concatenate(row, axis=1) for row in rows], axis=0)
        for name, rows in blocks.items()
    }


def _chunks(grid: ChunkedGrid) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Rows and columns of vertices, or of cells, by the chunks of the points."""
    if not grid.has_ghosts:
        return grid.points.chunks[0], grid.points.chunks[1]
    found = []
    for sizes in grid.points.chunks[:2]:
        ends = np.clip(np.cumsum(sizes) - 1, 0, sum(sizes) - 2)
        own = np.diff(ends, prepend=0)
        found.append(tuple(int(n) for n in own[own > 0]))
    return found[0], found[1]


def _ranges(sizes: tuple[int, ...]) -> list[Range]:
    ends = [0, *np.cumsum(sizes).tolist()]
    return [(a, b) for a, b in pairwise(ends) if b > a]


def _meet(one: Range, other: Range) -> bool:
    return one[0] < other[1] and other[0] < one[1]


def _side(facts: ChunkedGrid, task: Task, boundary: str, rows: Cut, columns: Cut, *read: Any) -> Region:
    """Results along an open side."""
    return _computed(facts, task, boundary, False, rows, columns, *read)


def _shared(side: Region, rows: Range, columns: Range) -> Region:
    """What a side has for a block."""
    (a, b), (c, d) = (
        (max(own[0], other[0]), min(own[1], other[1]))
        for own, other in ((side.rows, rows), (side.columns, columns))
    )
    at = slice(a - side.rows[0], b - side.rows[0]), slice(c - side.columns[0], d - side.columns[0])
    return Region((a, b), (c, d), {name: values[at] for name, values in side.values.items()})


def _block(
    facts: ChunkedGrid,
    task: Task,
    boundary: str,
    holes: bool,
    rows: Cut,
    columns: Cut,
    near: list[Region],
    *read: Any,
) -> Any:
    """Results of one block."""
    own = _computed(facts, task, boundary if holes else None, holes, rows, columns, *read)
    values: dict[str, Floats] = dict(own.values)
    for side in near:
        side.patch(own.rows, own.columns, values)
    return values if len(values) > 1 else next(iter(values.values()))


def _computed(
    facts: ChunkedGrid,
    task: Task,
    boundary: str | None,
    holes: bool,
    rows: Cut,
    columns: Cut,
    size: Any,
    points: Any,
    dual: Any,
    mask: Any,
    others: list[Any],
) -> Region:
    from quadcurv.kernels import ranges

    with ranges.serial():  # other blocks are computed beside this one
        try:
            window = opened(facts, rows, columns, [points, dual, mask], holes, size)
        except HoleError as hole:
            raise hole_refused(hole) from None
        return region(task, window, boundary, tuple(others))
