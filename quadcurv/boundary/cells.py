"""Staggered grids: cells beyond open sides, whose centres alone are missing.

By index where the centres are even. Elsewhere, and where the corners of a side are one point, a pole, the
cells there have regular rings on fitted surfaces: a single centre beyond leaves the ring of a narrow cell
lopsided, and finite volumes are off by as much as the widths of cells differ.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.closing import EXTRAPOLATED, FITTED, INTERIOR, OPEN, SPREAD, skew, with_stars
from quadcurv.boundary.poles import poles
from quadcurv.boundary.sides import continued_sides
from quadcurv.boundary.stars import regular_stars
from quadcurv.boundary.surface import fitted
from quadcurv.mesh import StaggeredGrid
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices


def closed_cells(grid: StaggeredGrid, beyond: Floats | None = None) -> tuple[Stencils, NDArray[np.uint8]]:
    """Stencils with closed rings, and what closes each.

    `beyond` (r + 2, c + 2, 3) has around it the centres of cells that are known, other grids', else NaN.
    """
    centres, rough = cell_ghosts(grid, beyond)
    given = grid.stencils() if beyond is None else cells_within(grid, beyond)
    treated = cells_within(grid, centres)
    treatment = np.where(given.closed, INTERIOR, np.where(treated.closed, EXTRAPOLATED, OPEN))
    anew = np.union1d(cells_at_poles(grid), rough)
    if anew.size:
        surfaces = fitted(given, anew)
        rows = np.flatnonzero(np.isfinite(surfaces.error))
        treatment[anew] = OPEN
        treatment[anew[rows]] = FITTED
        treated = with_stars(treated, [(anew[rows], regular_stars(given, surfaces.of(rows)))])
        treated.closed[anew] = treatment[anew] != OPEN
    return treated, treatment.astype(np.uint8)


def cells_within(grid: StaggeredGrid, centres: Floats) -> Stencils:
    """Stencils of a grid among those cells of the rim of (r + 2, c + 2, 3) centres that are not NaN."""
    r, c = grid.shape
    index = np.full((r + 2, c + 2), -1, np.int32)
    index[1:-1, 1:-1] = np.arange(r * c).reshape(r, c)
    for axis in (0, 1):
        if grid.wrap[axis]:
            np.moveaxis(index, axis, 0)[[0, -1]] = np.moveaxis(index, axis, 0)[[-2, 1]]
    known = (index < 0) & np.isfinite(centres).all(axis=2)
    index[known] = np.arange(r * c, r * c + np.count_nonzero(known))
    return grid.diamonds(index, centres[known])


def cells_at_poles(grid: StaggeredGrid) -> Indices:
    """Cells, flat, with a side that is one point, those beyond them, as narrow, and beside skew ones."""
    pole, x = poles(grid), grid.dual
    if pole is None:
        return np.empty(0, np.int64)
    beside = np.zeros(grid.shape, bool)
    for axis in (0, 1):
        corners, cells = np.moveaxis(pole, axis, 0), np.moveaxis(beside, axis, 0)
        for end, rows in ((0, [0, 1]), (-1, [-1, -2])):
            one = (corners[end][1:] >= 0) & (corners[end][1:] == corners[end][:-1])
            cells[rows[: len(cells)]] |= one
    skewed = skew(np.stack([x[:-1, :-1], x[1:, :-1], x[1:, 1:], x[:-1, 1:]], axis=2))
    for _ in range(SPREAD):
        beside |= skewed & _with_neighbours(beside)
    beside |= _with_neighbours(beside & skewed)
    return np.flatnonzero(beside)


def _with_neighbours(cells: Bools) -> Bools:
    around = np.lib.stride_tricks.sliding_window_view(np.pad(cells, 1), (3, 3))
    return np.asarray(around.any(axis=(2, 3)))


@np.errstate(all="ignore")
def cell_ghosts(grid: StaggeredGrid, known: Floats | None = None) -> tuple[Floats, Indices]:
    """Centres of ghost cells around a staggered grid, (r + 2, c + 2, 3) with its own in the middle.

    Those of `known` that are not NaN, else by index where the centres are even, else NaN. Second, the cells,
    flat, beside which they are not even.
    """
    x = np.pad(grid.primal, [(1, 1), (1, 1), (0, 0)], constant_values=np.nan)
    rough = np.zeros(grid.shape, bool)
    around, uneven = continued_sides(grid.primal, grid.wrap)
    for axis in (0, 1):
        inner, beyond = np.moveaxis(grid.primal, axis, 0), np.moveaxis(x, axis, 0)
        if grid.wrap[axis]:
            beyond[[0, -1], 1:-1] = inner[[-1, 0]]
            continue
        others = None if known is None else np.moveaxis(known, axis, 0)
        for end in (0, -1):
            if others is not None and np.isfinite(others[end, 1:-1]).any():  # a side meets another as a whole
                beyond[end, 1:-1] = others[end, 1:-1]
                continue
            ghosts = (around.beyond if axis == 0 else around.beside[:, 1:-1])[end]
            if (axis, -end) in uneven:
                at = ~uneven[axis, -end]
                ghosts[at] = np.nan
                np.moveaxis(rough, axis, 0)[end][at] = True
            beyond[end, 1:-1] = ghosts
    return x, np.flatnonzero(rough)
