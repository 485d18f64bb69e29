"""Meshes, checked once and frozen."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.checks import checked_faces, checked_points, checked_wrap, consistent_sides
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Floats, Ints, MeshError

_FAR = 100_000  # vertices between neighbours in memory, on average, from which on reordering pays


class Recovery(NamedTuple):
    """How the quads of a mesh were found among triangles.

    Attributes
    ----------
    rule : {"given", "carrier", "ply", "block", "interleaved", "diagonal", "shape", "none"}
        See :func:`quadcurv.as_mesh` and :func:`quadcurv.pair_triangles` ("shape").
    paired : float
        Fraction of the triangles that went into quads.
    """

    rule: str
    paired: float


class QuadMesh:
    """Quads, or quads and triangles, over points.

    Parameters
    ----------
    points : (n, 3) array_like of float
        Positions. C-contiguous float64 is not copied but seen read-only; all else is converted.
        float32 is accepted and computed with in float64, yet its rounding, eps / h^2 in a curvature,
        stays.
    faces : (m, 4) or (m, 3) array_like of int, or sequence of polygons
        Vertex indices, counter-clockwise. In an (m, 4) array a last entry of -1 marks a triangle.
        A polygon of more than four sides is split into triangles: by ear clipping, or as a fan where it
        crosses itself seen along its vector area.

    Attributes
    ----------
    points : (n, 3) float64, read-only
    faces : (m, 4) int32, read-only
        The faces computed with; a triangle's last entry is -1.
    face_source : (m,) int64
        The index of the given face that each of `faces` stems from.
    n_split : int
        How many polygons of more than four sides were split.
    n_flipped : int
        How many faces were turned so that neighbours agree.
    orientable : bool
        False for a mesh such as a Moebius strip; its mean curvature is given without sign.
    recovery : Recovery or None
        How the quads were found, where they come from triangles.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes or types, masked entries, non-finite points, coordinates beyond 1e70 or
        all within 1e-70 of each other, indices out of range or repeated in a face, edges with more than
        two faces.

    Warns
    -----
    UserWarning
        The mesh is non-orientable.

    Notes
    -----
    Vertices without a face and vertices where several fans touch are accepted: their curvature is NaN.
    """

    points: Floats
    faces: Ints
    n_split: int
    n_flipped: int
    orientable: bool
    recovery: Recovery | None = None

    def __init__(self, points: ArrayLike, faces: ArrayLike | Sequence[Sequence[int]]) -> None:
        self.points = checked_points(points, "points", ("n", 3))
        self.faces, self._source, self.n_split = checked_faces(faces, self.points)
        self.n_flipped, self.orientable = 0, True
        self._shared: dict[str, Any] = {}
        self._orient()
        self.faces.flags.writeable = False

    def __repr__(self) -> str:
        triangles = int(np.count_nonzero(self.faces[:, 3] < 0))
        kinds = f"{len(self.faces) - triangles} quads" + (f", {triangles} triangles" if triangles else "")
        return f"QuadMesh({len(self.points)} points, {kinds})"

    @property
    def face_source(self) -> NDArray[np.int64]:
        """(m,) int64: the index of the given face that each of `faces` stems from."""
        return np.arange(len(self.faces)) if self._source is None else self._source

    def _orient(self) -> None:
        """Reject non-manifold edges; turn faces until neighbours agree, or find that they cannot."""
        from quadcurv.kernels import topology

        ring, others, kind, bad_edge, n_disagree = topology.fans(self.faces, len(self.points))
        if bad_edge[2]:
            raise MeshError(
                f"faces: {bad_edge[2]} edge(s) with more than two faces, "
                f"first the one from vertex {bad_edge[0]} to {bad_edge[1]}"
            )
        if n_disagree:
            turn, self.orientable = consistent_sides(self.faces)
            self.n_flipped = int(np.count_nonzero(turn))
            quad = self.faces[:, 3] >= 0
            self.faces[turn & quad] = self.faces[turn & quad][:, [0, 3, 2, 1]]
            self.faces[turn & ~quad] = self.faces[turn & ~quad][:, [0, 2, 1, 3]]
            ring, others, kind, *_ = topology.fans(self.faces, len(self.points))
            if not self.orientable:
                warnings.warn(
                    "the mesh is non-orientable: its mean curvature has no sign, |H| is given",
                    stacklevel=3,
                )
        self._kind, self._ring, self._others = kind, ring, others

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at a boundary stay open."""
        from quadcurv.kernels import topology

        closed = self._kind == topology.INTERIOR
        stencils = Stencils(self.points, self.faces, (len(self.points),), closed, self.orientable)
        stencils.__dict__.update(ring=self._ring, irregular=self._others)
        return stencils

    def remember(self, name: str, make: Callable[[], Any]) -> Any:
        """Return what depends on the connectivity alone, made once for all meshes that share it."""
        if name not in self._shared:
            self._shared[name] = make()
        return self._shared[name]

    @property
    def distance(self) -> float:
        """Mean distance in memory of neighbours, in vertices."""
        from quadcurv.kernels import topology

        return float(self.remember("distance", lambda: topology.mean_distance(self.faces)))

    def ring_order(self) -> tuple[tuple[Ints, Ints] | None, Ints]:
        """Rings (n, 8) of the regular vertices inside, first -1 for all others; and an order of them.

        The order is None for that of the vertices; else rings are in it, numbered by it, and it comes with
        the place of every vertex in it. It pays on large meshes whose neighbours are far apart in memory,
        and takes the time of several evaluations: it is made the second time that a connectivity is used.
        """
        from quadcurv.kernels import order as orders

        shared = self._shared
        given: tuple[tuple[Ints, Ints] | None, Ints] = None, self._ring
        if "rings" not in shared and shared.setdefault("uses", 0) > 0:
            found = given
            if self.distance > _FAR:
                order = orders.nearby_order(self._ring)
                ring, place = orders.renumbered(self._ring, order)
                found = (order, place), ring
            shared["rings"] = found  # at once: other threads see both or neither
        shared["uses"] = 1
        return shared.get("rings", given)

    def others(self) -> tuple[NDArray[np.int64], Stencils]:
        """Vertices that are not regular or not inside, and the stencils of a part of the mesh around them.

        The first vertices of the part are these; it reaches four faces beyond them, so that they have there
        all that a ghost layer or a scheme may look at.
        """
        from quadcurv.kernels import topology

        if self._others.size == 0:
            return self._others, Stencils(self.points[:0], self.faces[:0], (0,), np.empty(0, bool))
        vertices, faces = self.remember(
            "part", lambda: topology.part_around(self.faces, self._others, len(self.points), 4)
        )
        closed = self._kind[vertices] == topology.INTERIOR
        return self._others, Stencils(self.points[vertices], faces, (vertices.size,), closed, self.orientable)

    def with_points(self, points: ArrayLike) -> QuadMesh:
        """Return the same faces, not checked again, over other positions of the same shape."""
        mesh = object.__new__(QuadMesh)
        mesh.__dict__.update(self.__dict__)
        mesh.points = checked_points(points, "points", self.points.shape)
        return mesh


class QuadGrid:
    """A logically Cartesian grid of vertices.

    Parameters
    ----------
    points : (r, c, 3) array_like of float
        Positions; the surface normal is that of the first direction times the second.
    wrap : (bool, bool)
        Whether the last row (column) is followed by the first, which is not repeated.

    Raises
    ------
    MeshError
        A ValueError: wrong shape, fewer than 2 points a direction (3 where it wraps), non-finite points.
    """

    def __init__(self, points: ArrayLike, wrap: Sequence[bool] = (False, False)) -> None:
        self.wrap = checked_wrap(wrap)
        self.points = checked_points(points, "points", ("r", "c", 3))
        for axis, name in enumerate(("rows", "columns")):
            least = 3 if self.wrap[axis] else 2
            if self.points.shape[axis] < least:
                raise MeshError(
                    f"points: {self.points.shape[axis]} {name}, at least {least} are needed"
                    + (" where the grid wraps" if self.wrap[axis] else "")
                )

    def __repr__(self) -> str:
        return f"QuadGrid({self.shape[0]} x {self.shape[1]} points, wrap={self.wrap})"

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of vertices."""
        return self.points.shape[0], self.points.shape[1]

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at open sides stay open."""
        index = np.arange(self.shape[0] * self.shape[1], dtype=np.int32).reshape(self.shape)
        index = np.pad(index, [(0, int(w)) for w in self.wrap], mode="wrap")
        closed = np.ones(self.shape, bool)
        if not self.wrap[0]:
            closed[[0, -1]] = False
        if not self.wrap[1]:
            closed[:, [0, -1]] = False
        return Stencils(self.points.reshape(-1, 3), grid_faces(index), self.shape, closed.ravel())

    def side(self, axis: int, end: int) -> QuadGrid:
        """Return the two rows (axis 0) or columns (1) at the first (end 0) or last (-1) open side."""
        size = self.shape[axis]
        kept = range(2) if end == 0 else range(size - 2, size)
        return QuadGrid(self.points.take(kept, axis), [w and i != axis for i, w in enumerate(self.wrap)])

    def to_mesh(self) -> QuadMesh:
        """Return the same quads as a face list, vertices in row-major order."""
        stencils = self.stencils()
        return QuadMesh(stencils.points, stencils.faces)


class StaggeredGrid:
    """A grid of primal points (cell centres) and dual points (cell corners), as finite-volume codes have.

    The stencil is that of the thesis's Figures 3.1 and 4.1: around a primal point its four dual corners
    are the edge neighbours a, b and the four primal neighbours the vertices d across.

    Parameters
    ----------
    primal : (r, c, 3) or (r + 2, c + 2, 3) array_like of float
        Cell centres, without or with one layer of ghost cells around; the four corner ghosts are not read.
    dual : (r + 1, c + 1, 3) array_like of float
        Cell corners; dual[i, j] comes before primal[i, j] in both directions.
    wrap : (bool, bool)
        Whether the last row (column) of cells is followed by the first; only without ghost cells.
        The last row (column) of dual then repeats the first.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes, non-finite points, or a seam that does not meet.
    """

    def __init__(self, primal: ArrayLike, dual: ArrayLike, wrap: Sequence[bool] = (False, False)) -> None:
        self.wrap = checked_wrap(wrap)
        self.dual = checked_points(dual, "dual", ("r + 1", "c + 1", 3))
        r, c = (self.dual.shape[0] - 1, self.dual.shape[1] - 1)
        self.primal = checked_points(primal, "primal", ("r", "c", 3))
        if r < 1 or c < 1 or self.primal.shape[:2] not in ((r, c), (r + 2, c + 2)):
            raise MeshError(
                f"primal: shape {self.primal.shape} does not fit dual of shape {self.dual.shape}; "
                f"expected {(r, c, 3)}, or {(r + 2, c + 2, 3)} with ghost cells"
            )
        if self.primal.shape[:2] == (r + 2, c + 2) and any(self.wrap):
            raise MeshError("wrap: primal has ghost cells already, so no side is left to wrap")
        if self.primal.shape[:2] == (1, 1):
            raise MeshError("primal: a single cell needs ghost cells around it")
        self.shape = r, c
        for axis, name in enumerate(("rows", "columns")):
            if not self.wrap[axis]:
                continue
            if self.shape[axis] < 3:
                raise MeshError(f"primal: {self.shape[axis]} {name}, at least 3 are needed to wrap")
            gap = np.abs(self.dual.take(0, axis) - self.dual.take(-1, axis)).max()
            if gap > 1e-9 * np.ptp(self.dual.reshape(-1, 3), axis=0).max():
                raise MeshError(f"dual: first and last {name} differ by {gap:.3g} although they wrap")

    def __repr__(self) -> str:
        return f"StaggeredGrid({self.shape[0]} x {self.shape[1]} cells, wrap={self.wrap})"

    def side(self, axis: int, end: int) -> StaggeredGrid:
        """Return the two rows (axis 0) or columns (1) at the first (end 0) or last (-1) open side."""
        size = self.shape[axis]
        kept = range(min(2, size)) if end == 0 else range(max(0, size - 2), size)
        corners = range(kept.start, kept.stop + 1)
        wrap = [w and i != axis for i, w in enumerate(self.wrap)]
        return StaggeredGrid(self.primal.take(kept, axis), self.dual.take(corners, axis), wrap)

    @property
    def has_ghosts(self) -> bool:
        """Whether primal carries a layer of ghost cells."""
        return self.primal.shape[:2] != self.shape

    @classmethod
    def from_mapping(
        cls,
        mapping: Callable[[Floats, Floats], ArrayLike],
        xi: ArrayLike,
        eta: ArrayLike,
    ) -> StaggeredGrid:
        """Sample a surface at cell corners and, midway between them, at cell centres.

        Parameters
        ----------
        mapping : callable
            (xi, eta) -> (..., 3), broadcasting.
        xi, eta : (r + 3,), (c + 3,) array_like of float
            Coordinates of the dual points, one ghost cell on each side included.
        """
        xi, eta = np.asarray(xi, float), np.asarray(eta, float)
        for name, t in (("xi", xi), ("eta", eta)):
            if t.ndim != 1 or t.size < 4:
                raise MeshError(f"{name}: shape {t.shape}, expected (cells + 3,)")
        centre_xi, centre_eta = (xi[1:] + xi[:-1]) / 2, (eta[1:] + eta[:-1]) / 2
        return cls(
            mapping(centre_xi[:, None], centre_eta[None, :]),
            mapping(xi[1:-1, None], eta[None, 1:-1]),
        )

    def stencils(self) -> Stencils:
        """Stencils of the cells as given; without ghost cells rings at open sides stay open."""
        r, c = self.shape
        index = np.full((r + 2, c + 2), -1, np.int32)
        index[1:-1, 1:-1] = np.arange(r * c).reshape(r, c)
        if self.has_ghosts:
            index[index < 0] = np.arange(r * c, index.size)
            ring = index >= r * c
            return self.diamonds(index, self.primal[ring])
        if self.wrap[0]:
            index[[0, -1]] = index[[-2, 1]]
        if self.wrap[1]:
            index[:, [0, -1]] = index[:, [-2, 1]]
        return self.diamonds(index, np.empty((0, 3)))

    def diamonds(self, index: Ints, ghosts: Floats) -> Stencils:
        """Stencils of the quads (primal, dual, primal, dual) across the edges of the cells.

        Parameters
        ----------
        index : (r + 2, c + 2) int32
            Indices of the cells with one layer around: row by row, from r c on ghosts, -1 for none.
        ghosts : (g, 3) float64
            Centres of the ghost cells.

        Notes
        -----
        Across edges of the first direction the quads begin at a primal point, across those of the second
        at a dual point, so that one choice of diagonal keeps two primal neighbours of each cell.
        """
        r, c = self.shape
        centres = self.primal[1:-1, 1:-1] if self.has_ghosts else self.primal
        dual = np.arange((r + 1) * (c + 1), dtype=np.int32).reshape(r + 1, c + 1)
        dual += r * c + len(ghosts)
        if self.wrap[0]:
            dual[-1] = dual[0]
        if self.wrap[1]:
            dual[:, -1] = dual[:, 0]
        p, q = index[:, 1:-1], index[1:-1]
        first = np.stack((p[:-1], dual[:, :-1], p[1:], dual[:, 1:]), axis=-1)
        second = np.stack((dual[1:], q[:, 1:], dual[:-1], q[:, :-1]), axis=-1)
        # Where the grid wraps the first and the last edge are the same.
        first = first[int(self.wrap[0]) :].reshape(-1, 4)
        second = second[:, int(self.wrap[1]) :].reshape(-1, 4)
        faces = np.concatenate((first, second))
        around = np.stack((p[:-2], p[2:], q[:, :-2], q[:, 2:]))
        return Stencils(
            np.concatenate((centres.reshape(-1, 3), ghosts, self.dual.reshape(-1, 3))),
            np.ascontiguousarray(faces[(faces >= 0).all(axis=1)]),
            self.shape,
            (around >= 0).all(axis=0).ravel(),
        )


Mesh = QuadMesh | QuadGrid | StaggeredGrid
