"""Blocks of a chunked grid with what lies around them: where they are, how they are read, what is refused."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np

from quadcurv.checks import LARGEST, checked_points
from quadcurv.mesh import ChunkedGrid, QuadGrid, StaggeredGrid
from quadcurv.mesh.chunked import part
from quadcurv.mesh.mapped import forget
from quadcurv.types import Bools, Floats, MeshError

Range = tuple[int, int]


class Cut(NamedTuple):
    """What is read of an axis for a block; where the axis wraps these may lie beyond its ends.

    Attributes
    ----------
    begin, end : int
        Rows that are read.
    first, last : int
        Those of the block among them.
    size : int
        Rows of the axis.
    closed : bool
        Whether the axis wraps.
    """

    begin: int
    end: int
    first: int
    last: int
    size: int
    closed: bool

    @classmethod
    def around(cls, block: Range, size: int, closed: bool, halo: int) -> Cut:
        """A block with so many rows on either side."""
        first, last = block
        begin, end = first - halo, last + halo
        if not closed or (first, last) == (0, size):
            begin, end = max(begin, 0), min(end, size)
        return cls(begin, end, first, last, size, closed)

    @property
    def wraps(self) -> bool:
        """Whether all of an axis that wraps is read, once."""
        return self.closed and (self.begin, self.end) == (0, self.size)

    @property
    def inner(self) -> slice:
        """The block within what is read."""
        return slice(self.first - self.begin, self.last - self.begin)

    def slices(self, more: int = 0) -> list[slice]:
        """Slices of an array that together are what is read, and so many rows more."""
        end = self.end + more
        if self.wraps or not self.closed:
            return [slice(self.begin, end)]
        found, at = [], self.begin
        while at < end:
            start = at % self.size
            stop = min(self.size, start + end - at)
            found.append(slice(start, stop))
            at += stop - start
        return found


class Window(NamedTuple):
    """A block with what lies around it, as a grid of its own.

    Attributes
    ----------
    grid : QuadGrid or StaggeredGrid
        Its sides are those of the whole grid, or lie where it was cut.
    rows, columns : Cut
    size : float or None
        Largest coordinate of the whole grid, where it is known.
    """

    grid: QuadGrid | StaggeredGrid
    rows: Cut
    columns: Cut
    size: float | None = None

    @property
    def inner(self) -> tuple[slice, slice]:
        """The block within the grid."""
        return self.rows.inner, self.columns.inner


class HoleError(Exception):
    """A point without a position, at a place of the whole grid."""

    def __init__(self, place: tuple[int, int]) -> None:
        super().__init__(place)
        self.place = place


def blocks(grid: ChunkedGrid, most: int, square: bool) -> list[tuple[Range, Range]]:
    """Rows and columns of blocks of about `most` vertices: slabs of rows, or as square as chunks allow."""
    r, c = grid.shape
    chunks = getattr(grid.points, "chunks", None)
    tall, wide = (int(n) for n in chunks[-3:-1]) if chunks and isinstance(chunks[-2], int) else (1, 1)
    if square and tall == wide == 1:
        wide = tall = max(1, int(most**0.5))
    if wide > 1 or c > most:
        wide = min(c, max(wide, most // min(tall, r) // wide * wide) if wide > 1 else most)
    else:
        wide = c
    tall = min(r, max(tall, most // wide // tall * tall))
    return list(product(ranges(r, tall), ranges(c, wide)))


def ranges(size: int, step: int) -> list[Range]:
    """0..size in steps."""
    return [(begin, min(begin + step, size)) for begin in range(0, size, step)]


def taken(
    array: Any,
    rows: Sequence[slice],
    columns: Sequence[slice],
    concatenate: Callable[..., Any] = np.concatenate,
) -> Any:
    """Rows and columns of an array, of any kind, put together from slices of it."""
    parts = [[_slice(array, i, j) for j in columns] for i in rows]
    bands = [row[0] if len(row) == 1 else concatenate(row, axis=1) for row in parts]
    return bands[0] if len(bands) == 1 else concatenate(bands, axis=0)


def _slice(array: Any, rows: slice, columns: slice) -> Any:
    """A slice; of less than rows of a file mapped into memory a copy, the file being let go of.

    Of chunks a few are read at a time: an array holds, decoded, all those that a slice of it touches.
    """
    chunks = getattr(array, "chunks", None)
    if chunks and isinstance(chunks[0], int):
        return _slice_of_chunks(array, rows.indices(array.shape[0])[:2], columns.indices(array.shape[1])[:2])
    if not isinstance(array, np.memmap) or array[:1, columns].shape[1] == array.shape[1]:
        return array[rows, columns]
    begin, end, _ = rows.indices(array.shape[0])
    found = np.empty((end - begin, *array[:1, columns].shape[1:]), array.dtype)
    step = max(1, _MAPPED // array.strides[0])
    for first, last in ranges(end - begin, step):
        found[first:last] = array[begin + first : begin + last, columns]
        forget(array, begin + first, begin + last)
    return found


_MAPPED = 2**25  # bytes of a file in memory at a time
_DECODED = 2**25  # bytes of chunks


def _slice_of_chunks(array: Any, rows: Range, columns: Range) -> Any:
    tall, wide = array.chunks[:2]
    size = int(np.prod(array.chunks)) * array.dtype.itemsize
    across = (columns[1] - 1) // wide - columns[0] // wide + 1
    at_once = max(1, _DECODED // (size * across))
    found = np.empty((rows[1] - rows[0], columns[1] - columns[0], *array.shape[2:]), array.dtype)
    for a, b in _cut_at(rows, tall * at_once):
        for c, d in _cut_at(columns, wide * max(1, _DECODED // size)):
            found[a - rows[0] : b - rows[0], c - columns[0] : d - columns[0]] = array[a:b, c:d]
    return found


def _cut_at(whole: Range, step: int) -> list[Range]:
    """A range cut at multiples of a number."""
    begin, end = whole
    cuts = [begin, *range((begin // step + 1) * step, end, step), end]
    return list(pairwise(cuts)) if end > begin else []


def arrays_of(grid: ChunkedGrid, rows: Cut, columns: Cut, concatenate: Any = np.concatenate) -> list[Any]:
    """Points, dual points or None, mask or None, of the kind that the grid has them."""
    more = 2 if grid.has_ghosts else 0
    read = [taken(grid.points, rows.slices(more), columns.slices(more), concatenate)]
    for array, extra in ((grid.dual, 1), (grid.mask, 0)):
        known = array is not None and not isinstance(array, str)
        read.append(taken(array, rows.slices(extra), columns.slices(extra), concatenate) if known else None)
    return read


def opened(
    grid: ChunkedGrid,
    rows: Cut,
    columns: Cut,
    read: Sequence[Any],
    holes: bool,
    size: float | None = None,
) -> Window:
    """The window of what was read; with `holes` it has a mask, even if that hides nothing.

    Raises
    ------
    HoleError
        A point is NaN, and there are to be no holes.
    MeshError
        Any other point that no grid may have, with its place in the whole grid.
    """
    points, dual, hidden = read
    wrap = rows.wraps, columns.wraps
    at, extent = (rows.begin, columns.begin), grid.shape
    if dual is not None:
        points = _checked(points, "points", at, extent)
        return Window(
            part(points, wrap, grid.roundoff, None, _checked(dual, "dual", at, extent)), rows, columns
        )
    mask: Bools | None = None
    if holes:
        points, mask = _with_holes(points, hidden, at, extent)
    else:
        points = _checked(points, "points", at, extent, may_be_nan=True)
    return Window(part(points, wrap, grid.roundoff, mask), rows, columns, size)


def _checked(
    points: Any, name: str, at: tuple[int, int], extent: tuple[int, int], may_be_nan: bool = False
) -> Floats:
    try:
        return checked_points(points, name, (None, None, 3))
    except MeshError:
        x = np.asarray(points)
        bad = ~(np.abs(x, where=np.isfinite(x), out=np.full(x.shape, np.inf)) <= LARGEST).all(axis=2)
        if not bad.any():
            raise
        count, first = int(np.count_nonzero(bad)), np.argwhere(bad)[0]
        place = tuple(int((k + start) % size) for k, start, size in zip(first, at, extent, strict=True))
        if may_be_nan and np.isnan(x).any():
            first = np.argwhere(np.isnan(x).any(axis=2))[0]
            nan = [int((k + start) % size) for k, start, size in zip(first, at, extent, strict=True)]
            raise HoleError((nan[0], nan[1])) from None
        size = (
            f"beyond {LARGEST:g}, whose areas overflow"
            if np.isfinite(x[tuple(first)]).all()
            else "non-finite"
        )
        raise MeshError(
            f"{name}: {count} point(s) of the block read {size}, first vertex {place}: {x[tuple(first)]}"
        ) from None


def _with_holes(
    points: Any, hidden: Any, at: tuple[int, int], extent: tuple[int, int]
) -> tuple[Floats, Bools]:
    """Points, NaN where they are hidden or have no position; these."""
    x = np.array(points, np.float64)
    mask: Bools = np.asarray(np.isnan(x).any(axis=2))
    if hidden is not None:
        mask |= np.asarray(hidden)
    x[mask] = 0.0
    x = np.array(_checked(x, "points", at, extent))
    x[mask] = np.nan
    return x, mask


def edges(window: Window, i: Any, j: Any, shape: tuple[int, int]) -> Iterator[Floats]:
    """Ends (k, 3), (k, 3) of the edges at some vertices, those whose neighbours are in the window."""
    x = window.grid.points if isinstance(window.grid, QuadGrid) else window.grid.primal
    shift = int(isinstance(window.grid, StaggeredGrid) and window.grid.has_ghosts)
    i, j = np.minimum(i, shape[0] - 2) - window.rows.begin, np.minimum(j, shape[1] - 2) - window.columns.begin
    inside = (i >= 0) & (j >= 0) & (i + 1 < x.shape[0]) & (j + 1 < x.shape[1])
    i, j = i[inside] + shift, j[inside] + shift
    yield np.concatenate((x[i, j], x[i, j]))
    yield np.concatenate((x[i + 1, j], x[i, j + 1]))
