"""Grids that meet: compiled passes inside each, and where they meet one mesh of what lies around the sides.

Cells see their neighbours' cells as ghosts; at vertices of sides the values are those of a face list, which
knows no sides. All other schemes see the blocks as one face list.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import scipy

from quadcurv.boundary import cell_ghosts, cells_at_poles, cells_within, closed, closed_cells
from quadcurv.drivers import compiled, direct
from quadcurv.mesh import GridBlocks, QuadMesh, StaggeredGrid
from quadcurv.schemes import Laplacian
from quadcurv.stencils import Frame, Stencils
from quadcurv.types import Floats


def evaluate(blocks: GridBlocks, scheme: Laplacian, boundary: str, results: Mapping[str, Floats]) -> None:
    """Write results (n, ...) by name."""
    if not blocks.of_cells and (scheme.fast is None or any(grid.mask is not None for grid in blocks)):
        _evaluate_faces(blocks.mesh, scheme, boundary, results)
        return
    for k, (grid, number) in enumerate(zip(blocks, blocks.numbers, strict=True)):
        inner = {name: np.empty((*grid.shape, *direct.PER_VERTEX[name])) for name in results}
        if isinstance(grid, StaggeredGrid):
            _evaluate_cells(blocks, k, grid, scheme, boundary, inner)
        else:
            assert scheme.fast is not None
            compiled.evaluate_rows(grid, scheme.fast, "nan", inner)
        for name, values in inner.items():
            results[name][number] = values
    if not blocks.of_cells:
        mesh, place, number = blocks.strip
        inner = {name: np.empty((len(mesh.points), *direct.PER_VERTEX[name])) for name in results}
        _evaluate_faces(mesh, scheme, boundary, inner)
        for name, values in inner.items():
            results[name][number] = values[place]


def _evaluate_faces(mesh: QuadMesh, scheme: Laplacian, boundary: str, results: Mapping[str, Floats]) -> None:
    if scheme.fast is not None:
        compiled.evaluate_faces(mesh, scheme, boundary, results)
    else:
        given = mesh.stencils()
        direct.evaluate(given, closed(given)[0] if boundary == "extrapolate" else given, scheme, results)


def _evaluate_cells(
    blocks: GridBlocks,
    k: int,
    grid: StaggeredGrid,
    scheme: Laplacian,
    boundary: str,
    results: Mapping[str, Floats],
) -> None:
    """Cells of block k among those of its neighbours."""
    centres = _centres(blocks, k)
    extrapolated = bool(blocks.open_sides(k)) and boundary == "extrapolate"
    x, rough = cell_ghosts(grid, centres) if extrapolated else (centres, np.empty(0, np.int64))
    if scheme.fast is None or rough.size or cells_at_poles(grid).size:
        given = cells_within(grid, centres)
        treated = closed_cells(grid, centres)[0] if extrapolated else given
        direct.evaluate(given, treated, scheme, results)
        return
    beside = np.moveaxis(x[:, [0, -1]], 1, 0) if not grid.wrap[1] else np.empty((2, 0, 3))
    frame = Frame(np.ascontiguousarray(x[[0, -1], 1:-1]), np.ascontiguousarray(beside))
    compiled.evaluate_rows(grid, scheme.fast, boundary, results, frame)
    if "dual_areas" in results and blocks.open_sides(k):
        area = direct.flux_and_area(cells_within(grid, centres), scheme)[1]
        results["dual_areas"][...] = area.reshape(grid.shape)


def stiffness_of_cells(
    blocks: GridBlocks, assembled: Callable[[Stencils], scipy.sparse.csr_array]
) -> scipy.sparse.csr_array:
    """(n, p): row by row as `evaluate` sees the cells; columns as the points of the blocks' stencils."""
    parts, p = [], len(blocks.stencils().points)
    for k, grid in enumerate(blocks):
        assert isinstance(grid, StaggeredGrid)
        index = blocks.around[k]
        own = assembled(cells_within(grid, _centres(blocks, k))).tocoo()
        rim = np.ones(index.shape, bool)
        rim[1:-1, 1:-1] = False
        for axis in (0, 1):
            if grid.wrap[axis]:
                np.moveaxis(rim, axis, 0)[[0, -1]] = False
        beyond = index[rim & (index >= 0)]
        column = np.concatenate((blocks.numbers[k].ravel(), beyond, blocks.corners[k].ravel() + blocks.n))
        shape = own.shape[0], p
        parts.append(scipy.sparse.csr_array((own.data, (own.row, column[own.col])), shape=shape))
    return scipy.sparse.vstack(parts, format="csr")


def _centres(blocks: GridBlocks, k: int) -> Floats:
    """(r + 2, c + 2, 3): centres of the cells of a block and of those around it, NaN beyond borders."""
    index = blocks.around[k]
    return np.where(index[..., None] >= 0, blocks.points[index], np.nan)
