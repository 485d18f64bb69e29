"""What the finite-volume scheme and Liu's formula share.

Their stiffness, S = sum over quads of B^T K B, and the pass over grids and face lists that does without it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
import scipy

from quadcurv.mesh import Mesh, QuadGrid, QuadMesh
from quadcurv.stencils import Frame, Stencils
from quadcurv.types import Floats, Ints

# Of one vertex of a face list and of one row of a matrix, in vertices of a grid.
_RING_WORK, _ROW_WORK = 4, 8

# Diagonals (u, v) of a quad from its four vertices.
_B = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])


def local_stiffness(points: Floats, quads: Ints) -> Floats:
    """(m, 4, 4) stiffness of each quad, not finite for one without area."""
    from quadcurv.kernels import faces

    with np.errstate(invalid="ignore"):
        return np.einsum("ai,mab,bj->mij", _B, faces.conductances(points, quads), _B, optimize=True)


def scatter(local: Floats, rows: Ints, columns: Ints, shape: tuple[int, int]) -> scipy.sparse.csr_array:
    """Sum local matrices (m, i, j) with vertices rows (m, i) and columns (m, j) into one."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return scipy.sparse.csr_array((local.ravel(), (i.ravel(), j.ravel())), shape=shape)


def stiffness(
    stencils: Stencils,
    out: scipy.sparse.csr_array | None = None,
    *,
    general: Callable[[Stencils], scipy.sparse.csr_array],
) -> scipy.sparse.csr_array:
    """(n, p) stiffness: regular rows straight into CSR, the others by `general` on the faces around them.

    `general` gives the rows of all vertices of its stencils. The arrays of `out`, of the same pattern, are
    written to.
    """
    from quadcurv.kernels import ranges, rings, topology

    n, p, others = stencils.n, len(stencils.points), stencils.irregular
    indptr, rows = np.arange(0, 9 * n + 1, 9), None
    if others.size:
        size = np.full(n, 9)
        vertices, faces = topology.part_around(stencils.faces, others, p, 2)
        closed = np.zeros(vertices.size, bool)
        part = Stencils(stencils.points[vertices], faces, (vertices.size,), closed, stencils.orientable)
        rows = scipy.sparse.csr_array(without_infinity(general(part))[: others.size])
        rows = scipy.sparse.csr_array((rows.data, vertices[rows.indices], rows.indptr), (others.size, p))
        rows.sort_indices()
        size[others] = np.diff(rows.indptr)
        np.cumsum(size, out=indptr[1:])
    if indptr[-1] > np.iinfo(np.int32).max:
        return without_infinity(general(stencils)[:n])
    indptr = indptr.astype(np.int32)
    if out is None:
        arrays = np.empty(indptr[-1]), np.empty(indptr[-1], np.int32), indptr
        out = scipy.sparse.csr_array(arrays, (n, p))
    elif out.shape != (n, p) or not np.array_equal(out.indptr, indptr):
        raise ValueError("out: expected a stiffness matrix of the same mesh and scheme")
    if rows is not None:
        place = np.repeat(indptr[others] - rows.indptr[:-1], np.diff(rows.indptr)) + np.arange(rows.nnz)
        out.indices[place], out.data[place] = rows.indices, rows.data
    points, ring = stencils.points.ravel(), stencils.ring
    kernel = partial(rings.ring_stiffness, points, ring, indptr, out.indices, out.data)
    ranges.over(kernel, n, _ROW_WORK * n, rings.BLOCK)
    return out


def without_infinity(matrix: scipy.sparse.csr_array) -> scipy.sparse.csr_array:
    """The matrix itself, NaN wherever it is not finite."""
    with np.errstate(invalid="ignore"):
        if not np.isfinite(matrix.data.sum()):
            matrix.data[~np.isfinite(matrix.data)] = np.nan
    return matrix


def quad_stiffness(stencils: Stencils) -> scipy.sparse.csr_array:
    """(p, p) stiffness of all quads, triangles left out."""
    p = len(stencils.points)
    quads = stencils.faces[stencils.faces[:, 3] >= 0]
    return scatter(local_stiffness(stencils.points, quads), quads, quads, (p, p))


def write(mesh: Mesh, frame: Frame | None, results: dict[str, Floats], *, liu: int | None) -> None:
    """Run the kernels: see `Scheme.write`; liu is 0 for Liu's dual area, None for the ring polygon's."""
    from quadcurv.kernels import cells, ranges, rows

    names = ("mean_curvature_normal", "mean_curvature", "vertex_normals", "dual_areas")
    wanted = [results[name].ravel() if name in results else None for name in names]
    if isinstance(mesh, QuadMesh):
        _write_rings(mesh, liu, wanted)
        return
    assert frame is not None
    r, c = mesh.shape
    if isinstance(mesh, QuadGrid):
        kernel = partial(rows.grid_curvatures, mesh.points.ravel(), *frame, liu, *wanted)
    else:
        dual = mesh.dual
        for axis in (0, 1):
            first, last = np.moveaxis(dual, axis, 0)[[0, -1]]
            if mesh.wrap[axis] and not np.array_equal(first, last):  # the seam is that of the first
                dual = dual.copy()
                np.moveaxis(dual, axis, 0)[-1] = first
        points, halo = mesh.primal.ravel(), int(mesh.has_ghosts)
        kernel = partial(cells.staggered_curvatures, points, *frame, halo, dual.ravel(), liu, *wanted)
    ranges.over(kernel, r, r * c, rows.LEAST_ROWS)


def _write_rings(mesh: QuadMesh, liu: int | None, wanted: list[Floats | None]) -> None:
    """Regular vertices, in an order that keeps neighbours close where the mesh's own does not."""
    from quadcurv.kernels import order as orders
    from quadcurv.kernels import ranges, rings, topology

    n = len(mesh.points)
    order, ring = mesh.ring_order()
    points, found = mesh.points.ravel(), wanted
    if order is not None:
        there, back = order
        points = np.empty(3 * n)
        ranges.over(partial(orders.gather, mesh.points.ravel(), there, points), n, n)
        found = [None if values is None else np.empty_like(values) for values in wanted]
    far = order is None and mesh.distance > topology.FAR
    ranges.over(
        partial(rings.ring_curvatures, points, ring, far, liu, *found), n, _RING_WORK * n, rings.BLOCK
    )
    if order is not None:
        # Reads from everywhere overlap, writes to everywhere wait: hence not straight to their places.
        for values, ordered in zip(wanted, found, strict=True):
            if values is not None:
                ranges.over(partial(orders.gather, ordered, back, values), n, n)
