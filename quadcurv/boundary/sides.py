"""Open sides of grids, without a face list: what is beyond by index, and where that is not enough."""

from __future__ import annotations

import numpy as np
import scipy

from quadcurv.boundary.lines import (
    EARLIER,
    HIDDEN,
    OPEN,
    ROUNDING,
    SMOOTH,
    index_weights,
    without_excess,
)
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.stencils import Frame, Stencils
from quadcurv.types import Bools, Floats, Indices, Ints, MeshError

DEGREE = 4


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


def frame(grid: QuadGrid | StaggeredGrid, boundary: str) -> tuple[Frame, Indices]:
    """Ghosts by index around a grid, NaN where nothing is known; border vertices that they do not serve."""
    points = grid.points if isinstance(grid, QuadGrid) else grid.primal
    (r, c, _), wrap = points.shape, grid.wrap
    if all(wrap) or boundary == "nan":
        beyond = points[[-1, 0]] if wrap[0] else np.full((2, c, 3), np.nan)
        return Frame(beyond, np.full((2, 0 if wrap[1] else r + 2, 3), np.nan)), np.empty(0, np.int64)
    around, uneven = continued_sides(points, wrap)
    if not uneven:
        return around, np.empty(0, np.int64)
    bad = np.zeros((r, c), bool)
    for (axis, end), even in uneven.items():
        np.moveaxis(bad, axis, 0)[-end] |= _unserved(even, wrap[1 - axis])
    return around, np.flatnonzero(bad)


def continued_sides(points: Floats, wrap: tuple[bool, bool]) -> tuple[Frame, dict[tuple[int, int], Bools]]:
    """Ghosts by index around a grid that is open somewhere; of sides (axis, end) not all even, which are."""
    from quadcurv.kernels import border

    r, c, _ = points.shape
    beyond, beside, excess = border.continue_sides(points, wrap, (SMOOTH, EARLIER, HIDDEN, ROUNDING, OPEN))
    uneven = {}
    if excess.max() > 0:
        with np.errstate(invalid="ignore"):
            for axis, lines in enumerate((excess[: 2 * c].reshape(2, c), excess[2 * c :].reshape(2, r))):
                for end in (0, 1):
                    if lines[end].max() > 0:
                        pairs = _beside(lines[end].size, wrap[1 - axis])
                        uneven[axis, end] = without_excess(lines[end], pairs)
    return Frame(beyond, beside), uneven


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


def part_around(grid: QuadGrid, vertices: Indices, reach: int) -> tuple[Indices, Stencils]:
    """Vertices of the part of a grid within `reach` quads of some, these first, and its stencils."""
    (r, c), wrap = grid.shape, grid.wrap
    near, step = np.zeros((r, c), bool), np.arange(-reach, reach + 1)
    i, j = np.divmod(vertices, c)
    i, j = i[:, None, None] + step[:, None], j[:, None, None] + step
    near[i % r if wrap[0] else i.clip(0, r - 1), j % c if wrap[1] else j.clip(0, c - 1)] = True
    near.ravel()[vertices] = False
    kept = np.concatenate((vertices, np.flatnonzero(near)))
    place = np.full((r, c), -1, np.int32)
    place.ravel()[kept] = np.arange(kept.size)
    # Each quad by its first vertex.
    i, j = np.divmod(kept, c)
    inside = (wrap[0] | (i < r - 1)) & (wrap[1] | (j < c - 1))
    i, j = i[inside], j[inside]
    i, j = np.stack((i, i + 1, i + 1, i)) % r, np.stack((j, j, j + 1, j + 1)) % c
    faces = place[i, j].T
    i, j = np.divmod(kept, c)
    closed = (wrap[0] | ((i > 0) & (i < r - 1))) & (wrap[1] | ((j > 0) & (j < c - 1)))
    points = grid.points.reshape(-1, 3)[kept]
    faces = np.ascontiguousarray(faces[(faces >= 0).all(axis=1)])
    return kept, Stencils(points, faces, kept.shape, closed, roundoff=grid.roundoff)
