"""Several grids that meet: the panels of a cubed sphere, the blocks of a multi-block code."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.checks import refuse_on_device
from quadcurv.mesh.chunked import ChunkedGrid
from quadcurv.mesh.connections import (
    SIDES,
    Connection,
    found_connections,
    given_connections,
    numbering,
    open_sides,
    refuse_different_sides,
)
from quadcurv.mesh.face_list import QuadMesh
from quadcurv.mesh.grid import QuadGrid
from quadcurv.mesh.staggered import StaggeredGrid
from quadcurv.mesh.strip import Strip, strip
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, Indices, Ints, MeshError

_APART = 1e-9  # of the largest value: as far apart those of two blocks may be where they meet


@dataclass(frozen=True, eq=False, init=False, repr=False)
class GridBlocks:
    """Several grids that meet along whole sides: cubed spheres, pillows, multi-block codes.

    Parameters
    ----------
    blocks : sequence of QuadGrid, of (r, c, 3) array_like, or of StaggeredGrid
        All grids of vertices, or all of cells without ghost cells: these are the neighbours' cells.
    connections : sequence of (int, str, int, str), optional
        Sides that meet, as (block, side, other block, its side) with "first row", "last row", "first column"
        and "last column". By default all sides whose points coincide, to 1e-9 of the extent or, of
        positions in single precision, to their rounding; given, these and no others, whose points may
        differ by a thousandth of the spacing. A side may meet another one of its block, or itself folded in
        the middle.

    Attributes
    ----------
    blocks : tuple of QuadGrid, or of StaggeredGrid
    connections : tuple of Connection
        (block, side, other, other_side, reverse).
    numbers : tuple of (r, c) int64
        For the vertices (cells) of each block their number 0..n - 1 among all, rows and columns of the
        matrices. Vertices where blocks meet have one number; -1 where a mask hides them.
    n : int
        How many there are.
    roundoff : float
        Relative rounding error of the positions as they were given, 2^-24 for float32.

    Raises
    ------
    MeshError
        A ValueError that names block and side: sides that meet halfway, blocks whose normals point to
        different sides of the surface, sides said to meet that do not; blocks of both kinds, cells with
        ghost cells.

    Notes
    -----
    Every verb takes blocks and answers with a tuple, one array a block. At vertices the values are those of
    the one mesh that the blocks make, three-valent corners included: sides to the last digit, inner vertices
    to rounding. Sides that meet nothing are borders. Vertices of one place that no connection joins stay two,
    as at the tip of a slit.

    Cells have their neighbours' cells around them, wherever the neighbour is.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> sphere = qc.surfaces.cubed_sphere()
    >>> xi, eta = np.meshgrid(np.linspace(0, 1, 17), np.linspace(0, 1, 17), indexing="ij")
    >>> panels = qc.GridBlocks([sphere.mapping(xi + offset, eta) for offset in sphere.panels])
    >>> panels
    GridBlocks(6 blocks, 12 connections, 1538 vertices)
    >>> H = qc.mean_curvature(panels, "finite_volume")
    >>> len(H), H[0].shape
    (6, (17, 17))
    """

    blocks: tuple[QuadGrid, ...] | tuple[StaggeredGrid, ...]
    connections: tuple[Connection, ...]
    numbers: tuple[Indices, ...]
    n: int
    roundoff: float

    def __init__(
        self,
        blocks: Iterable[QuadGrid | StaggeredGrid | ArrayLike],
        connections: Iterable[tuple[int, str, int, str]] | None = None,
    ) -> None:
        grids = _checked_blocks(blocks)
        points = [b.dual if isinstance(b, StaggeredGrid) else b.points for b in grids]
        sides, roundoff = open_sides(points, [b.wrap for b in grids]), max(b.roundoff for b in grids)
        if connections is None:
            found = found_connections(sides, roundoff)
        else:
            found = given_connections(sides, connections, len(grids))
        refuse_different_sides(found)
        number = numbering(sides, found)
        cells = isinstance(grids[0], StaggeredGrid)
        self.__dict__.update(
            blocks=tuple(grids), connections=tuple(found), roundoff=roundoff, corners=_split(number, points)
        )
        if cells:
            size = sum(b.shape[0] * b.shape[1] for b in grids)
            self.__dict__.update(numbers=_split(np.arange(size), grids), n=size)
        else:
            self.__dict__.update(numbers=self.corners, n=int(number.max(initial=-1)) + 1)

    corners: tuple[Indices, ...]
    """Numbers of the vertices, or of the corners of cells, which where blocks meet have one."""

    def __repr__(self) -> str:
        kind = "cells" if self.of_cells else "vertices"
        return f"GridBlocks({len(self.blocks)} blocks, {len(self.connections)} connections, {self.n} {kind})"

    def __len__(self) -> int:
        return len(self.blocks)

    def __iter__(self) -> Any:
        return iter(self.blocks)

    def __getitem__(self, block: int) -> QuadGrid | StaggeredGrid:
        return self.blocks[block]

    @property
    def of_cells(self) -> bool:
        """Whether the blocks are of cells."""
        return isinstance(self.blocks[0], StaggeredGrid)

    @property
    def shape(self) -> tuple[int]:
        """(n,): of values over all blocks, before they are split."""
        return (self.n,)

    def split(self, values: NDArray[Any]) -> tuple[NDArray[Any], ...]:
        """Return values (n, ...) of all vertices or cells as one array a block; NaN, or 0, where masked."""
        parts = []
        for number in self.numbers:
            part = values[number]
            part[number < 0] = np.nan if values.dtype.kind == "f" else 0
            parts.append(part)
        return tuple(parts)

    def joined(self, values: Any) -> NDArray[Any]:
        """Return one array (r, c, ...) a block as values (n, ...) of all vertices or cells.

        Raises
        ------
        ValueError
            Other shapes than the blocks'; blocks that differ where they meet.
        """
        arrays = [np.asarray(v) for v in values]
        if len(arrays) != len(self.blocks):
            raise ValueError(f"values: {len(arrays)} arrays for {len(self.blocks)} blocks")
        trail = arrays[0].shape[2:]
        for b, (array, number) in enumerate(zip(arrays, self.numbers, strict=True)):
            if array.shape != (*number.shape, *trail):
                raise ValueError(
                    f"values: shape {array.shape} of block {b}, expected {(*number.shape, *trail)}"
                )
        result = self._gathered(arrays)
        size = np.abs(result).max(initial=0)
        for b, (array, number) in enumerate(zip(arrays, self.numbers, strict=True)):
            apart = np.abs(array - result[number])[number >= 0].max(initial=0)
            if apart > _APART * size:
                raise ValueError(f"values: block {b} differs by {apart:.3g} from another where they meet")
        return result

    flat = joined

    @cached_property
    def points(self) -> Floats:
        """(n, 3): vertices, or centres of cells; where blocks meet those of the first."""
        return self._gathered([b.primal if isinstance(b, StaggeredGrid) else b.points for b in self.blocks])

    @cached_property
    def mesh(self) -> QuadMesh:
        """The faces of all blocks as one mesh, whose first n vertices are those of the blocks.

        Of cells the quads (cell, corner, cell, corner) across their edges.
        """
        if not self.of_cells:
            faces = np.concatenate([self.faces(block) for block in range(len(self.blocks))])
            return QuadMesh(self.points, faces)
        stencils = self.stencils()
        used = np.zeros(len(stencils.points), bool)
        used[: self.n] = used[stencils.faces] = True
        place = np.cumsum(used, dtype=np.int32) - 1
        return QuadMesh(stencils.points[used], place[stencils.faces])

    def to_mesh(self) -> QuadMesh:
        """Return the blocks as one mesh of n vertices.

        Raises
        ------
        MeshError
            A ValueError: of cells.
        """
        if self.of_cells:
            raise MeshError("mesh: blocks of cells are no mesh of vertices; the verbs take them as they are")
        return self.mesh

    def stencils(self) -> Stencils:
        """One-ring stencils of all n vertices or cells as they are; rings at borders stay open.

        Of cells the points are the n centres, then the corners.
        """
        if not self.of_cells:
            return self.mesh.stencils()
        duals = np.empty((1 + max(int(number.max()) for number in self.corners), 3))
        for block, number in zip(reversed(self.blocks), reversed(self.corners), strict=True):
            assert isinstance(block, StaggeredGrid)
            duals[number] = block.dual
        faces, closed = [], np.ones(self.n, bool)
        for block, index in enumerate(self.around):
            faces.append(self._diamonds(block, index))
            beside = np.stack((index[:-2, 1:-1], index[2:, 1:-1], index[1:-1, :-2], index[1:-1, 2:]))
            closed[self.numbers[block]] = (beside >= 0).all(axis=0)
        points = np.concatenate((self.points, duals))
        return Stencils(points, np.concatenate(faces), self.shape, closed, roundoff=self.roundoff)

    def faces(self, block: int) -> Ints:
        """(m, 4) int32: the quads of a block of vertices, by the numbers of these."""
        number = self.numbers[block].astype(np.int32)
        quads = grid_faces(np.pad(number, [(0, int(w)) for w in self.blocks[block].wrap], mode="wrap"))
        return quads[(quads >= 0).all(axis=1)]

    @cached_property
    def strip(self) -> Strip:
        """What lies around the sides of blocks of vertices, as one mesh."""
        faces = [self.faces(block) for block in range(len(self.blocks))]
        return strip(self.blocks, self.numbers, faces, self.points)  # type: ignore[arg-type]

    @cached_property
    def around(self) -> tuple[Ints, ...]:
        """(r + 2, c + 2) int32 a block of cells: their numbers and those around them, -1 beyond borders."""
        found = []
        for k, number in enumerate(self.numbers):
            index, wrap = np.pad(number.astype(np.int32), 1, constant_values=-1), self.blocks[k].wrap
            if wrap[0]:
                index[[0, -1]] = index[[-2, 1]]
            if wrap[1]:
                index[:, [0, -1]] = index[:, [-2, 1]]
            found.append(index)
        for c in self.connections:
            for block, side, other, its in (c[:4], (*c[2:4], *c[:2])):
                (axis, end), (other_axis, other_end) = SIDES[side], SIDES[its]
                beyond = np.moveaxis(self.numbers[other], other_axis, 0)[other_end]
                beyond = beyond[::-1] if c.reverse else beyond
                own = np.moveaxis(self.numbers[block], axis, 0)[end]
                # In the middle of a fold a cell would be its own neighbour, across an edge of no length.
                np.moveaxis(found[block], axis, 0)[end, 1:-1] = np.where(beyond == own, -1, beyond)
        return tuple(found)

    def open_sides(self, block: int) -> list[tuple[int, int]]:
        """Sides of a block, as axis and end, that meet no other."""
        met = {x for c in self.connections for x in (c[:2], c[2:4])}
        wrap = self.blocks[block].wrap
        return [at for side, at in SIDES.items() if not wrap[at[0]] and (block, side) not in met]

    def _diamonds(self, block: int, index: Ints) -> Ints:
        """The quads across the edges of a block of cells, those of seams with one of the two blocks alone.

        They begin as :meth:`StaggeredGrid.diamonds` has them.
        """
        dual = (self.corners[block] + self.n).astype(np.int32)
        p, q = index[:, 1:-1], index[1:-1]
        quads = (
            np.stack((p[:-1], dual[:, :-1], p[1:], dual[:, 1:]), axis=-1),
            np.stack((dual[1:], q[:, 1:], dual[:-1], q[:, :-1]), axis=-1),
        )
        kept: list[Bools] = [np.min(quad, axis=-1) >= 0 for quad in quads]
        for axis, wraps in enumerate(self.blocks[block].wrap):
            if wraps:  # the first and the last edge are the same
                np.moveaxis(kept[axis], axis, 0)[0] = False
        for c in self.connections:
            if c.other == block:
                axis, end = SIDES[c.other_side]
                edges = np.moveaxis(kept[axis], axis, 0)[end]
                fold = (c.block, c.side) == (c.other, c.other_side)
                edges[len(edges) // 2 if fold else 0 :] = False
        return np.concatenate([quad[k] for quad, k in zip(quads, kept, strict=True)])

    def _gathered(self, arrays: Sequence[NDArray[Any]]) -> NDArray[Any]:
        """Arrays (r, c, ...) a block as one (n, ...), where blocks meet those of the first."""
        result = np.zeros((self.n, *arrays[0].shape[2:]), np.result_type(*arrays))
        for array, number in zip(reversed(arrays), reversed(self.numbers), strict=True):
            known = number >= 0
            result[number[known][::-1]] = array[known][::-1]
        return result


def _checked_blocks(blocks: Iterable[Any]) -> list[Any]:
    """Grids of one kind."""
    given = list(blocks)
    if not given:
        raise MeshError("blocks: none given")
    grids: list[QuadGrid | StaggeredGrid] = []
    for b, block in enumerate(given):
        if isinstance(block, ChunkedGrid):
            raise MeshError(f"blocks[{b}]: a ChunkedGrid, blocks are in memory: QuadGrid(points[:])")
        try:
            grids.append(block if isinstance(block, QuadGrid | StaggeredGrid) else QuadGrid(block))
            if isinstance(grids[-1], QuadGrid):
                refuse_on_device(grids[-1].points, "points")
        except MeshError as error:
            raise MeshError(f"blocks[{b}]: {error}") from None
    cells = [isinstance(grid, StaggeredGrid) for grid in grids]
    if any(cells) and not all(cells):
        raise MeshError(
            f"blocks: block {cells.index(True)} is of cells, block {cells.index(False)} of vertices: "
            "they must be of one kind"
        )
    for b, grid in enumerate(grids):
        if isinstance(grid, StaggeredGrid) and grid.has_ghosts:
            raise MeshError(
                f"blocks[{b}]: has ghost cells, but its neighbours' cells are these: leave them out, as "
                "primal[1:-1, 1:-1] does"
            )
    return grids


def _split(number: Indices, like: Sequence[Any]) -> tuple[Indices, ...]:
    """Numbers of all points as one array a block."""
    shapes = [x.shape[:2] for x in like]
    ends = np.cumsum([r * c for r, c in shapes])[:-1]
    return tuple(part.reshape(shape) for part, shape in zip(np.split(number, ends), shapes, strict=True))
