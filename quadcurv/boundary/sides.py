"""Open sides of grids, without a face list: what is beyond by index, and where that is not enough."""

from __future__ import annotations

import numpy as np
import scipy

from quadcurv.boundary.lines import HIDDEN, NODES, ROUNDING, SMOOTH, extended, index_weights, without_excess
from quadcurv.boundary.stars import bent
from quadcurv.boundary.surface import fitted
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.stencils import Frame, Stencils
from quadcurv.types import Bools, Floats, Indices, Ints, MeshError

DEGREE = 4
_WEIGHTS = index_weights(DEGREE)


@np.errstate(all="ignore")
def ghost_layer(
    points: Floats, wrap: tuple[bool, bool], degree: int = DEGREE, layers: int = 1
) -> tuple[Ints, Floats]:
    """Surround a grid of points by ghosts where it is open, by index: it must be smooth there.

    Parameters
    ----------
    points : (r, c, 3) float64
    wrap : (bool, bool)
        Directions that wrap, hence have no open side.
    degree : int
        Degree of the polynomial through the degree + 1 points next to an open side.
    layers : int
        How many ghosts X_-1, X_-2, ... beyond an open side, all on the same polynomial. Second-order
        schemes that read one ring want one layer of degree 4, fourth-order ones that read two rings
        two layers of degree 5.

    Returns
    -------
    index : (r or r + 2 layers, c or c + 2 layers) int32
        Indices of the grid with its ghosts: the points row by row, then the ghosts from r c on.
    ghosts : (g, 3) float64

    Raises
    ------
    MeshError
        A ValueError: fewer than degree + 1 points in an open direction.
    """
    shape = points.shape[:2]
    for size, wraps, name in zip(shape, wrap, ("rows", "columns"), strict=True):
        if not wraps and size <= degree:
            raise MeshError(
                f"points: {size} {name}, but extrapolation beyond an open side needs at least "
                f'{degree + 1}; boundary="nan" needs none'
            )
    number = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)
    index = np.pad(number, [(0 if w else layers,) * 2 for w in wrap], constant_values=-1)
    is_ghost = index < 0
    index[is_ghost] = np.arange(number.size, number.size + np.count_nonzero(is_ghost))
    along, across = (_extension(s, w, degree, layers) for s, w in zip(shape, wrap, strict=True))
    extend = scipy.sparse.kron(along, across, format="csr")
    # Relative to one of the points, so that an offset of the whole surface costs no digits.
    origin = points[0, 0]
    ghosts = extend[np.flatnonzero(is_ghost)] @ (points - origin).reshape(-1, 3) + origin
    return index, ghosts


def _extension(size: int, wraps: bool, degree: int, layers: int) -> scipy.sparse.csr_array:
    """Identity, between rows of extrapolation where the direction is open."""
    identity = scipy.sparse.eye_array(size, format="csr")
    if wraps:
        return identity
    rows = np.zeros((layers, size))
    for layer in range(1, layers + 1):
        rows[-layer, : degree + 1] = index_weights(degree, layer)
    before, after = scipy.sparse.csr_array(rows), scipy.sparse.csr_array(rows[::-1, ::-1])
    return scipy.sparse.vstack((before, identity, after), format="csr")


@np.errstate(all="ignore")
def frame(grid: QuadGrid | StaggeredGrid, boundary: str) -> tuple[Frame, Indices]:
    """Ghosts by index around a grid, NaN where nothing is known; border vertices that they do not serve."""
    points = grid.points if isinstance(grid, QuadGrid) else grid.primal
    (r, c, _), wrap = points.shape, grid.wrap
    beyond, beside = np.full((2, c, 3), np.nan), np.full((2, 0 if wrap[1] else r + 2, 3), np.nan)
    if wrap[0]:
        beyond[:] = points[[-1, 0]]
    bad = None
    for axis, outside in enumerate((beyond, beside[:, 1:-1])):
        if wrap[axis] or boundary == "nan":
            continue
        for end in (0, 1):
            even = _continue(points, axis, end, outside[end], wrap[1 - axis])
            if even is not None:
                bad = np.zeros((r, c), bool) if bad is None else bad
                np.moveaxis(bad, axis, 0)[-end] |= _unserved(even, wrap[1 - axis])
    for end in () if wrap[1] else (0, 1):
        line = beyond[:, :: 1 - 2 * end]
        beside[end, [0, -1]] = beside[end, [-2, 1]] if wrap[0] else _at_corner(line)
    return Frame(beyond, beside), np.empty(0, np.int64) if bad is None else np.flatnonzero(bad)


def _at_corner(lines: Floats) -> Floats:
    """Continue two lines of ghosts by index, NaN where these are too few."""
    if lines.shape[1] <= DEGREE:
        return np.full((2, 3), np.nan)
    return lines[:, 0] + _WEIGHTS @ (lines[:, : DEGREE + 1] - lines[:, :1])


def _continue(points: Floats, axis: int, end: int, ghosts: Floats, wraps: bool) -> Bools | None:
    """Write ghosts beyond a side; which lines are even, None if all are."""
    from quadcurv.kernels import border

    size, steps = len(ghosts), (3 * points.shape[1], 3)
    if points.shape[axis] < NODES:
        return np.zeros(size, bool)
    inward, along = steps[axis], steps[1 - axis]
    first = end * inward * (points.shape[axis] - 1)
    excess = np.empty(size)
    way = inward * (1 - 2 * end)
    limits = SMOOTH, HIDDEN, ROUNDING
    border.continue_side(points, first, along, way, wraps, limits, ghosts, excess)
    return without_excess(excess, _beside(size, wraps)) if excess.max() > 0 else None


def _unserved(even: Bools, wraps: bool) -> Bools:
    """Vertices of a side that read the ghost of an uneven line."""
    around = np.pad(~even, 1, mode="wrap" if wraps else "constant")
    bad = around[:-2] | around[1:-1] | around[2:]
    if not wraps:  # a corner's ghost reads five lines
        bad[0] |= ~even[: DEGREE + 1].all()
        bad[-1] |= ~even[-DEGREE - 1 :].all()
    return bad


def _beside(size: int, wraps: bool) -> Indices:
    """Pairs of lines beside each other."""
    pairs = np.stack((np.arange(size), np.arange(1, size + 1)), axis=1)
    return pairs % size if wraps else pairs[:-1]


@np.errstate(all="ignore")
def cell_ghosts(grid: StaggeredGrid) -> tuple[Floats, Bools]:
    """Centres of ghost cells around a staggered grid, (r + 2, c + 2, 3) with its own in the middle.

    By index where the centres are even, else on a surface fitted at the centre beside; NaN where nothing is
    known. Second, which (r, c) have one of the last kind.
    """
    r, c = grid.shape
    x = np.pad(grid.primal, [(1, 1), (1, 1), (0, 0)], constant_values=np.nan)
    rough, stencils = np.zeros(grid.shape, bool), grid.stencils()
    for axis, size in ((0, c), (1, r)):
        inner, beyond = np.moveaxis(grid.primal, axis, 0), np.moveaxis(x, axis, 0)
        if grid.wrap[axis]:
            beyond[[0, -1], 1:-1] = inner[[-1, 0]]
            continue
        dual = np.moveaxis(grid.dual, axis, 0)
        number = np.moveaxis(np.arange(r * c).reshape(r, c), axis, 0)
        for end, next_, far in ((0, 1, 1), (-1, -2, -2)):
            ghosts = np.empty((size, 3))
            even = _continue(grid.primal, axis, -end, ghosts, grid.wrap[1 - axis])
            if even is not None and len(inner) >= NODES:
                lines = np.moveaxis(inner[:: -1 if end else 1][:NODES], 0, 1)
                found = extended(lines, np.zeros(size), DEGREE, 1, _beside(size, grid.wrap[1 - axis]))
                smooth = found.smooth & ~even
                ghosts[smooth], even = found.ghosts[smooth, 0], even | smooth
            at = np.empty(0, int) if even is None else np.flatnonzero(~even)
            if at.size:
                edges = np.stack((dual[end][at], dual[end][at + 1], dual[far][at], dual[far][at + 1]), axis=1)
                across = inner[next_][at] if len(inner) > 1 else None
                ghosts[at] = _fitted_cells(stencils, number[end][at], edges, across)
                np.moveaxis(rough, axis, 0)[end][at] = True
            beyond[end, 1:-1] = ghosts
    return x, rough


def _fitted_cells(stencils: Stencils, vertices: Indices, edges: Floats, across: Floats | None) -> Floats:
    """Centres beyond border edges: a parallelogram, bent as the one on the cell's other side is.

    `edges` (k, 4, 3) are the ends of these edges and of the opposite ones, `across` the centres beyond those.
    """
    surfaces = fitted(stencils, vertices)
    x = surfaces.flat(edges)
    ghost = x[:, 0] + x[:, 1]
    if across is not None:
        twist = surfaces.flat(across[:, None])[:, 0] - x[:, 2] - x[:, 3]
        ghost += bent(twist, x[:, 0], x[:, 1])
    return surfaces.lifted(ghost[:, None])[:, 0]
