"""The diamond schemes in compiled passes over grids and rings, by several threads.

What has no regular ring, and what is cut off at open sides, comes from `direct`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np
import scipy

from quadcurv.boundary import (
    REACH,
    cells_at_poles,
    closed,
    frame,
    one_rings,
    part_around,
    parts_at_poles,
    poles_of_faces,
)
from quadcurv.device_arrays import taken
from quadcurv.drivers import direct
from quadcurv.mesh import QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.schemes import Diamond, Laplacian
from quadcurv.schemes.consistency import NOWHERE, FarOff
from quadcurv.stencils import Frame, Stencils, coarse
from quadcurv.types import Floats, Indices, Ints

# Of one vertex of a face list and of one row of a matrix, in vertices of a grid.
_RING_WORK, _ROW_WORK = 4, 8
_RESULTS = ("mean_curvature_normal", "mean_curvature", "vertex_normals", "dual_areas")
_NOBODY = np.empty(0, np.int64)  # of the vertices
_NOTHING = np.empty(0)  # a result that nobody wants
_CLOSED = Frame(_NOTHING, _NOTHING)  # what is beyond a grid is its other side


def evaluate_faces(mesh: QuadMesh, scheme: Laplacian, boundary: str, results: Mapping[str, Floats]) -> FarOff:
    """Regular vertices in one pass, the others from the stencils of the part of the mesh around them.

    Of those others, where H may be far off.
    """
    assert scheme.fast is not None
    others, part = mesh.irregular_part()
    _evaluate_rings(mesh, scheme.fast, results)
    far = NOWHERE
    if others.size and poles_of_faces(part) is not None:  # rare: all of it the slow way, too
        given, treated = mesh.stencils(), one_rings(mesh, boundary)
        # Others' rings are what they were, and a part of the mesh without poles gives these in the one pass.
        differ = (np.sort(treated.ring[: given.n], axis=1) != np.sort(given.ring, axis=1)).any(axis=1)
        others = np.flatnonzero(differ | (given.ring[:, 0] < 0))
        far = _fill(results, others, given, treated, scheme, others)
    elif others.size:
        treated = closed(part)[0] if boundary == "extrapolate" else part
        far = _fill(results, others, part, treated, scheme, np.arange(others.size))
    if not mesh.orientable and "mean_curvature" in results:
        np.abs(results["mean_curvature"], out=results["mean_curvature"])
    return far


def evaluate_grid(
    grid: QuadGrid | StaggeredGrid, scheme: Laplacian, boundary: str, results: Mapping[str, Floats]
) -> FarOff:
    """All in one pass, save along open sides: what is cut off there, and rings that ghosts by index miss.

    Of those, where H may be far off.
    """
    assert scheme.fast is not None
    unserved = evaluate_rows(grid, scheme.fast, boundary, results)
    if all(grid.wrap) or (isinstance(grid, StaggeredGrid) and grid.has_ghosts):
        return NOWHERE
    found = []
    if isinstance(grid, QuadGrid):
        for vertices, part, beside in parts_at_poles(grid):
            treated, rows = one_rings(part, boundary), np.flatnonzero(beside)
            found.append(_fill(results, vertices[rows], part.stencils(), treated, scheme, rows))
            unserved = np.setdiff1d(unserved, vertices[rows])
    if unserved.size:
        found.append(_evaluate_part(grid, unserved, scheme, results))
    cut = {"dual_areas"} if boundary == "extrapolate" else {"dual_areas", "vertex_normals"}
    if cut & results.keys():
        _evaluate_sides(grid, scheme, {name: results[name] for name in cut & results.keys()})
    return FarOff._make(map(np.concatenate, zip(NOWHERE, *found, strict=True)))


def _evaluate_part(
    grid: QuadGrid | StaggeredGrid, others: Indices, scheme: Laplacian, results: Mapping[str, Floats]
) -> FarOff:
    """Vertices that the frame of a grid does not serve, from the stencils of a part around them."""
    if isinstance(grid, QuadGrid):
        given, place = part_around(grid, others, REACH)[1], np.arange(others.size)
        treated = closed(given)[0]
    else:
        given, place, treated = grid.stencils(), others, one_rings(grid)
    return _fill(results, others, given, treated, scheme, place)


def _fill(
    results: Mapping[str, Floats],
    vertices: Indices,
    given: Stencils,
    treated: Stencils,
    scheme: Laplacian,
    place: Indices,
) -> FarOff:
    """Give some vertices of a mesh the results at some places in other stencils."""
    inner = {name: np.empty(given.shape + direct.PER_VERTEX[name]) for name in results}
    far = direct.evaluate(given, treated, scheme, inner).of(place, given.n)
    for name, values in inner.items():
        rows = (-1, *direct.PER_VERTEX[name])
        results[name].reshape(rows)[vertices] = values.reshape(rows)[place]
    return far._replace(vertices=vertices[far.vertices])


def _evaluate_sides(grid: QuadGrid | StaggeredGrid, scheme: Laplacian, results: Mapping[str, Floats]) -> None:
    """Open sides of the grid as given, from the stencils of two rows along them."""
    for axis in (0, 1):
        if grid.wrap[axis]:
            continue
        for end in (0, -1):
            side = grid.side(axis, end)
            inner = {name: np.empty(side.shape + direct.PER_VERTEX[name]) for name in results}
            direct.evaluate(side.stencils(), side.stencils(), scheme, inner)
            for name, values in inner.items():
                np.moveaxis(results[name], axis, 0)[end] = np.moveaxis(values, axis, 0)[end]


def evaluate_rows(
    grid: QuadGrid | StaggeredGrid,
    diamond_of: Diamond,
    boundary: str,
    results: Mapping[str, Floats],
    around: Frame | None = None,
) -> Indices:
    """Run a pass over a grid; the border vertices that its frame does not serve.

    The frame may be known: cells of other grids, or points of the grid that this is cut from.
    """
    from quadcurv.kernels.compiled import flat
    from quadcurv.kernels.ranges import over
    from quadcurv.kernels.rows import LEAST_ROWS, grid_curvatures

    (r, c), unserved = grid.shape, _NOBODY
    if around is None and all(grid.wrap):
        around = _CLOSED
    kernel: Callable[..., None]
    more: tuple[Floats, ...] = ()
    if isinstance(grid, QuadGrid):
        if around is None:
            around, unserved = frame(grid, boundary)
        kernel, points, size = grid_curvatures, flat(grid.points), 3 * c
    else:
        from quadcurv.kernels.cells import staggered_curvatures

        kernel, points, size, more = staggered_curvatures, flat(grid.primal), 3 * c, (flat(_dual(grid)),)
        if around is not None:
            pass
        elif grid.has_ghosts:
            sides, size = grid.primal, 3 * (c + 2)
            around = Frame(sides[[0, -1], 1:-1], np.moveaxis(sides[:, [0, -1]], 1, 0))
            points = points[size + 3 :]
        else:
            around, unserved = frame(grid, boundary)
            if boundary == "extrapolate":
                unserved = np.union1d(unserved, cells_at_poles(grid))
    given = (flat(around.beyond), flat(around.beside), *more, coarse(grid.roundoff))
    options = diamond_of.area == "quads", *_wanted(results)
    over(partial(kernel, points, size, c, *given, *options), r, r * c, LEAST_ROWS)
    return unserved


def _dual(grid: StaggeredGrid) -> Floats:
    """Dual points, those of a seam being the first."""
    dual = grid.dual
    for axis in (0, 1):
        first, last = np.moveaxis(dual, axis, 0)[[0, -1]]
        if grid.wrap[axis] and not np.array_equal(first, last):
            dual = dual.copy()
            np.moveaxis(dual, axis, 0)[-1] = first
    return dual


def _wanted(results: Mapping[str, Floats]) -> list[Floats]:
    """Results in the order of kernels, each of one dimension; of size 0 where nobody asks."""
    return [results[name].reshape(-1) if name in results else _NOTHING for name in _RESULTS]


def _evaluate_rings(mesh: QuadMesh, diamond_of: Diamond, results: Mapping[str, Floats]) -> None:
    """Regular vertices, in an order that keeps neighbours close if the mesh has one."""
    from quadcurv.kernels import order as orders
    from quadcurv.kernels import ranges, rings
    from quadcurv.kernels.compiled import flat

    wanted, liu = _wanted(results), diamond_of.area == "quads"
    n, connectivity = len(mesh.points), mesh.connectivity
    points, found, order = mesh.points.ravel(), wanted, connectivity.order
    if order is not None:
        points = np.empty(3 * n)
        ranges.over(partial(orders.gather, mesh.points.ravel(), order.vertices, points), n, n)
        found = [np.empty_like(values) for values in wanted]
    ring = connectivity.ring if order is None else order.ring
    far = order is None and connectivity.scattered
    kernel = partial(rings.ring_curvatures, flat(points), flat(ring), far, coarse(mesh.roundoff), liu, *found)
    ranges.over(kernel, n, _RING_WORK * n, rings.BLOCK)
    if order is not None:
        # Reads from everywhere overlap, writes to everywhere wait: hence not straight to their places.
        for values, ordered in zip(wanted, found, strict=True):
            if values.size:
                ranges.over(partial(orders.gather, ordered, order.place, values), n, n)


def stiffness(
    stencils: Stencils, scheme: Laplacian, out: scipy.sparse.csr_array | None = None
) -> scipy.sparse.csr_array:
    """(n, p) stiffness: regular rows straight into CSR, the others assembled on the faces around them.

    The arrays of `out`, of the same pattern, are written to.
    """
    from quadcurv.kernels import ranges, rings
    from quadcurv.kernels.compiled import flat

    n, p = stencils.n, len(stencils.points)
    indptr, others, rows = row_starts(stencils, scheme)
    if indptr[-1] > np.iinfo(np.int32).max:
        return direct.without_infinity(scheme.assemble(stencils)[0])
    indptr = indptr.astype(np.int32, copy=False)
    if out is None:
        arrays = np.empty(indptr[-1]), np.empty(indptr[-1], np.int32), indptr
        out = scipy.sparse.csr_array(arrays, (n, p))
    else:
        _check_matrix(out, (n, p), indptr)
    if rows is not None:
        place = row_places(indptr, others, rows)
        out.indices[place], out.data[place] = rows.indices, rows.data
    points, ring = flat(stencils.points), flat(stencils.ring)
    kernel = partial(rings.ring_stiffness, points, ring, stencils.coarse, flat(indptr), out.indices, out.data)
    ranges.over(kernel, n, _ROW_WORK * n, rings.BLOCK)
    return out


def row_starts(
    stencils: Stencils, scheme: Laplacian
) -> tuple[Indices | Ints, Indices, scipy.sparse.csr_array | None]:
    """Where the rows of the stiffness begin (n + 1,), irregular vertices, and the rows of these if any."""
    from quadcurv.kernels import topology

    n, p, others = stencils.n, len(stencils.points), stencils.irregular
    indptr: Indices | Ints
    if 9 * n > np.iinfo(np.int32).max:
        indptr = np.arange(0, 9 * n + 1, 9)
    else:
        indptr = np.arange(0, 9 * n + 1, 9, dtype=np.int32)
    if not others.size:
        return indptr, others, None
    size = np.full(n, 9)
    vertices, faces = topology.part_around(stencils.faces, others, p, 2)
    closed = np.zeros(vertices.size, bool)
    points, orientable = taken(stencils.points, vertices), stencils.orientable
    part = Stencils(points, faces, vertices.shape, closed, orientable, roundoff=stencils.roundoff)
    rows = scipy.sparse.csr_array(direct.without_infinity(scheme.assemble(part)[0])[: others.size])
    rows = scipy.sparse.csr_array((rows.data, vertices[rows.indices], rows.indptr), (others.size, p))
    rows.sort_indices()
    size[others] = np.diff(rows.indptr)
    return np.append(0, np.cumsum(size)), others, rows


def row_places(indptr: Indices | Ints, others: Indices, rows: scipy.sparse.csr_array) -> Indices:
    """Where in all rows the entries of irregular ones stand."""
    return np.repeat(indptr[others] - rows.indptr[:-1], np.diff(rows.indptr)) + np.arange(rows.nnz)


def _check_matrix(out: scipy.sparse.csr_array, shape: tuple[int, int], indptr: np.ndarray) -> None:
    """The kernels write to the arrays of `out` without looking again."""
    fits = (
        type(out) is scipy.sparse.csr_array
        and out.shape == shape
        and all(type(a) is np.ndarray and a.flags.c_contiguous for a in (out.data, out.indices, out.indptr))
        and out.data.dtype == np.float64
        and out.indices.dtype == out.indptr.dtype == np.int32
        and out.data.shape == out.indices.shape == (indptr[-1],)
        and out.data.flags.writeable
        and out.indices.flags.writeable
        and not np.shares_memory(out.data, out.indices)
        and np.array_equal(out.indptr, indptr)
    )
    if not fits:
        raise ValueError("out: expected a stiffness matrix of the same mesh and scheme")
