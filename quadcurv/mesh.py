"""Meshes, checked once and frozen, and the one-ring stencils that every scheme reads."""

from __future__ import annotations

import operator
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Bools = NDArray[np.bool_]

_LARGEST = 1e70
_FAR = 100_000  # vertices between neighbours in memory, on average, from which on reordering pays


class MeshError(ValueError):
    """What is wrong with a mesh: which argument, where first (face or vertex), and how often."""


class Recovery(NamedTuple):
    """How the quads of a mesh were found among triangles.

    Attributes
    ----------
    rule : {"given", "carrier", "ply", "block", "interleaved", "diagonal", "shape", "none"}
        See :meth:`QuadMesh.from_trimesh` and :func:`quadcurv.pair_triangles` ("shape").
    paired : float
        Fraction of the triangles that went into quads.
    """

    rule: str
    paired: float


class CornerTable(NamedTuple):
    """One-ring stencils: the corners (c, a, d, b) around every vertex, in CSR form.

    Corners ``indptr[c]:indptr[c + 1]`` are those of vertex c, counter-clockwise; at a boundary vertex
    they begin at the boundary edge. Faces that run against their neighbours are turned.

    Attributes
    ----------
    indptr : (n + 1,) int64
    centre : (k,) int32
        The vertex c itself.
    next : (k,) int32
        The next edge neighbour a.
    diagonal : (k,) int32
        The vertex d across the quad, -1 in a triangle.
    previous : (k,) int32
        The previous edge neighbour b; in a closed ring it is the next corner's a.
    """

    indptr: NDArray[np.int64]
    centre: Ints
    next: Ints
    diagonal: Ints
    previous: Ints


class Frame(NamedTuple):
    """What surrounds a grid of points: ghosts, or the other side where it wraps.

    Attributes
    ----------
    beyond : (6 c,) float64
        The rows before the first and after the last one.
    across : (k,) float64
        The point before the first one of a row is x_0 + sum of across_k (x_k - x_0), that after the last
        one alike; empty where rows are closed.
    """

    beyond: Floats
    across: Floats


@dataclass(frozen=True, eq=False)
class Stencils:
    """What a scheme reads: faces over points, and which of the points want a curvature.

    Attributes
    ----------
    points : (p, 3) float64
        Positions: first the n vertices with a stencil, then ghosts and dual points.
    faces : (m, 4) int32
        Counter-clockwise faces over `points`; a triangle's last entry is -1.
    shape : tuple of int
        Shape of a result, (n,) or (r, c) with r c = n.
    closed : (n,) bool
        Whether the ring is one closed fan; elsewhere no curvature is known.
    orientable : bool
        False where no choice of sides agrees; normals then have an arbitrary sign.
    """

    points: Floats
    faces: Ints
    shape: tuple[int, ...]
    closed: Bools
    orientable: bool = True

    @property
    def n(self) -> int:
        """Number of vertices with a stencil."""
        return int(np.prod(self.shape))

    @property
    def has_triangles(self) -> bool:
        """Whether any face is a triangle."""
        return bool((self.faces[:, 3] < 0).any())

    @property
    def valence(self) -> Ints:
        """(n,) int32: number of faces at each vertex."""
        count = np.bincount(self.faces[self.faces >= 0], minlength=len(self.points))
        return count[: self.n].astype(np.int32)

    @cached_property
    def ring(self) -> Ints:
        """(p, 8) int32: (a, d, a, d, ...) around each regular vertex inside, first -1 for all others."""
        from quadcurv.kernels import topology

        return topology.rings(self.faces, len(self.points))

    @cached_property
    def irregular(self) -> NDArray[np.int64]:
        """Vertices with a stencil that have no such ring."""
        return np.flatnonzero(self.ring[: self.n, 0] < 0)

    @cached_property
    def ring_areas(self) -> Floats:
        """(n, 3) float64: half the vector area of each ring polygon; it points along the normal."""
        from quadcurv.kernels import diamond

        if self.orientable:
            normal = np.zeros_like(self.points)
            diamond.ring_normals(self.points, self.faces, normal)
            normal = normal[: self.n]
        else:  # faces disagree somewhere: the corner table has each ring turned one way
            indptr, c, a, _, b = self.corner_table
            corner = np.cross(self.points[a] - self.points[c], self.points[b] - self.points[c])
            sums = scipy.sparse.csr_array((np.full(c.size, 0.25), np.arange(c.size), indptr))
            normal = sums @ corner
        # A length that is lost to underflow gives no direction.
        normal[np.einsum("ix,ix->i", normal, normal) < np.finfo(float).tiny] = 0
        return normal

    @cached_property
    def corner_table(self) -> CornerTable:
        """Corners of the n vertices, ring by ring."""
        from quadcurv.kernels import topology

        indptr, corners = topology.corners_by_vertex(self.faces, len(self.points))
        _, flipped, *_ = topology.order_rings(self.faces, indptr, corners, np.arange(self.n))
        indptr = indptr[: self.n + 1]
        face, slot = np.divmod(corners[: indptr[-1]], 4)
        quad = self.faces[face, 3] >= 0
        sides = np.where(quad, 4, 3)
        turn = np.where(flipped[: indptr[-1]], -1, 1)

        def vertex(step: Any) -> Ints:
            return self.faces[face, (slot + step) % sides]

        return CornerTable(
            indptr,
            vertex(0),
            vertex(turn),
            np.where(quad, vertex(2), np.int32(-1)),
            vertex(-turn),
        )


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
        self.points = _checked_points(points, "points", ("n", 3))
        self.faces, self._source, self.n_split = _checked_faces(faces, self.points)
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
            turn, self.orientable = _consistent_sides(self.faces)
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

    @staticmethod
    def from_trimesh(mesh: Any, quads: ArrayLike | None = None) -> QuadMesh:
        """Make a mesh of a trimesh.Trimesh, its quads put together again where its data says how.

        trimesh knows triangles only. The first rule that fits is used, and named in `recovery`:

        - "given": `quads`;
        - "carrier": what :meth:`to_trimesh` left; it survives reordering and removing of faces;
        - "ply": polygons of the PLY file the Trimesh was loaded from, if the triangles are still those;
        - "block", "interleaved": the two orders in which trimesh cuts quads (a, b, c, d) into (a, b, c) and
          (c, d, a). Every pair is checked to share that diagonal. At least half of the triangles must pair:
          a mesh of genuine triangles has few such pairs, and they are left alone;
        - "diagonal": the same pairs in any order, if nine in ten triangles pair;
        - "none": genuine triangles, as far as one can know; :func:`quadcurv.pair_triangles` pairs them by
          their shape, on request only.

        ``QuadMesh(mesh.vertices, mesh.faces)`` keeps the triangles whatever their order says.

        Parameters
        ----------
        mesh : trimesh.Trimesh or trimesh.Scene
            A Scene of one Trimesh is taken where it stands.
        quads : (m, 4) array_like of int or sequence of polygons, optional
            The faces over the vertices of `mesh`, where the caller knows them.

        Returns
        -------
        QuadMesh
            Over all vertices of `mesh`, in their order.

        Raises
        ------
        MeshError
            A ValueError: no mesh, or a Scene of several.
        TypeError
            Another type.
        """
        from quadcurv import interop

        return interop.from_trimesh(mesh, quads)

    def to_trimesh(self) -> Any:
        """Return a trimesh.Trimesh; its triangles are the quads (a, b, c, d) cut as (a, b, c), (c, d, a).

        Triangles come first, then the first halves, then the second ones, as trimesh cuts quads itself.
        The face attribute "quadcurv" says what they were cut from, for :meth:`from_trimesh`.
        """
        from quadcurv import interop

        return interop.to_trimesh(self)

    @staticmethod
    def from_pyvista(dataset: Any) -> QuadMesh:
        """Make a mesh of a pyvista.PolyData, or of an UnstructuredGrid of polygons.

        Triangles stay triangles: pyvista keeps quads by itself. Lines and vertex cells of a PolyData are
        not read. A StructuredGrid is a :class:`QuadGrid`.

        Raises
        ------
        MeshError
            A ValueError: triangle strips, volume cells (with the first), no faces.
        TypeError
            Another type.
        """
        from quadcurv import interop

        return interop.from_pyvista(dataset)

    def to_pyvista(self) -> Any:
        """Return a pyvista.PolyData with the same points, in double precision, and faces."""
        from quadcurv import interop

        return interop.to_pyvista(self)

    @staticmethod
    def from_pymeshlab(mesh: Any) -> QuadMesh:
        """Make a mesh of a pymeshlab.Mesh, or of the current mesh of a MeshSet, where it stands.

        MeshLab keeps a quad as two triangles and a hidden diagonal: quads and polygons come back, but the
        vertex that a face begins with may be another.

        Raises
        ------
        MeshError
            A ValueError: an empty MeshSet, deleted elements, no faces.
        TypeError
            Another type.
        """
        from quadcurv import interop

        return interop.from_pymeshlab(mesh)

    def to_pymeshlab(self) -> Any:
        """Return a pymeshlab.MeshSet with this mesh in it, in double precision.

        The set, since a pymeshlab.Mesh taken out of it does not outlive it.

        Raises
        ------
        ImportError
            pymeshlab, of the extra ``quadcurv[meshlab]``, is not installed.
        """
        from quadcurv import interop

        return interop.to_pymeshlab(self)

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
        from quadcurv.kernels import topology

        shared = self._shared
        given: tuple[tuple[Ints, Ints] | None, Ints] = None, self._ring
        if "rings" not in shared and shared.setdefault("uses", 0) > 0:
            found = given
            if self.distance > _FAR:
                order = topology.nearby_order(self._ring)
                ring, place = topology.renumbered(self._ring, order)
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
        mesh.points = _checked_points(points, "points", self.points.shape)
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
        self.wrap = _checked_wrap(wrap)
        self.points = _checked_points(points, "points", ("r", "c", 3))
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

    @staticmethod
    def from_pyvista(dataset: Any, wrap: Sequence[bool] = (False, False)) -> QuadGrid:
        """Make a grid of a pyvista.StructuredGrid of one layer.

        Parameters
        ----------
        dataset : pyvista.StructuredGrid
            Of dimensions (r, c, 1), (r, 1, c) or (1, r, c).
        wrap : (bool, bool)
            Directions that are closed: the last row (column), which repeats the first, is dropped.

        Returns
        -------
        QuadGrid
            points[i, j] is VTK's point i + r j.

        Raises
        ------
        MeshError
            A ValueError: a volume, or a seam that does not meet.
        TypeError
            Another type.

        Warns
        -----
        UserWarning
            The first and the last row (column) coincide although `wrap` says nothing of it.
        """
        from quadcurv import interop

        return interop.from_structured(dataset, wrap)

    def to_pyvista(self) -> Any:
        """Return a pyvista.StructuredGrid, (r, c, 1), wraps closed by repeating the first row or column."""
        from quadcurv import interop

        return interop.to_structured(self)

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
        self.wrap = _checked_wrap(wrap)
        self.dual = _checked_points(dual, "dual", ("r + 1", "c + 1", 3))
        r, c = (self.dual.shape[0] - 1, self.dual.shape[1] - 1)
        self.primal = _checked_points(primal, "primal", ("r", "c", 3))
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


def grid_faces(index: Ints) -> Ints:
    """Quads of a grid of vertex indices, counter-clockwise about first times second direction."""
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return quads.reshape(-1, 4)


def face_pairs(faces: Ints) -> tuple[NDArray[np.int64], ...]:
    """Faces f, g on the two sides of every interior edge, and the slots i, j at which it begins there."""
    sides = np.where(faces[:, 3] < 0, 3, 4)
    face, slot = np.nonzero(np.arange(4) < sides[:, None])
    start, end = faces[face, slot], faces[face, (slot + 1) % sides[face]]
    low, high = np.minimum(start, end), np.maximum(start, end)
    order = np.lexsort((high, low))
    pair = np.flatnonzero((np.diff(low[order]) == 0) & (np.diff(high[order]) == 0))
    one, other = order[pair], order[pair + 1]
    return face[one], slot[one], face[other], slot[other]


def _first_and_count(bad: Any) -> tuple[int, int]:
    return int(np.argmax(bad)), int(np.count_nonzero(bad))


def _checked_points(points: ArrayLike, name: str, shape: tuple[Any, ...]) -> Floats:
    """Read-only C-contiguous float64; a number in `shape` is required, a letter is free."""
    try:
        given = np.asarray(points)
    except (ValueError, OverflowError):  # rows of different lengths, integers beyond all floats
        given = np.empty(0, object)
    if np.ma.is_masked(points):
        raise MeshError(f"{name}: masked entries, expected a number in each")
    if given.dtype.kind not in "fiu":
        raise MeshError(f"{name}: expected real numbers, got dtype {given.dtype}")
    if given.ndim != len(shape) or any(
        isinstance(want, int) and have != want for have, want in zip(given.shape, shape, strict=True)
    ):
        raise MeshError(f"{name}: shape {given.shape}, expected ({', '.join(map(str, shape))})")
    with np.errstate(over="ignore"):  # of long doubles; they are found below
        array = np.ascontiguousarray(given, dtype=np.float64).view()
    array.flags.writeable = False
    extremes = _extremes(array)
    if not np.isfinite(extremes).all():  # both are NaN if any entry is
        first, count = _first_and_count(~np.isfinite(array.reshape(-1, 3)).all(axis=1))
        where = np.unravel_index(first, array.shape[:-1])
        at = first if array.ndim == 2 else tuple(map(int, where))
        raise MeshError(f"{name}: {count} non-finite point(s), first vertex {at}: {array[where]}")
    if array.size:
        rows = array.reshape(-1, 3)
        # The square of an area, hence the fourth power of a length, must neither overflow nor vanish.
        if np.abs(extremes).max() > _LARGEST:
            first, count = _first_and_count((np.abs(rows) > _LARGEST).any(axis=1))
            raise MeshError(
                f"{name}: {count} point(s) beyond {_LARGEST:g}, whose areas overflow, first vertex {first}"
            )
        if np.ptp(rows[:: len(rows) // 8 + 1], axis=0).max() < 1 / _LARGEST and (
            0 < np.ptp(rows, axis=0).max() < 1 / _LARGEST
        ):
            raise MeshError(f"{name}: all within {1 / _LARGEST:g} of each other, where areas vanish")
    return array


def _extremes(array: Floats) -> tuple[float, float]:
    """Least and largest entry, both NaN if any entry is; 0 of an empty array."""
    from quadcurv.kernels import parallel

    if array.size == 0:
        return 0.0, 0.0
    found = []

    def look(start: int, stop: int) -> None:
        part = array[start:stop]
        with np.errstate(invalid="ignore"):
            found.append((part.min(), part.max()))

    parallel.over(look, len(array), array.size // 3)
    low, high = np.transpose(found)
    return low.min(), high.max()


def _checked_wrap(wrap: Sequence[bool]) -> tuple[bool, bool]:
    given = list(wrap) if np.iterable(wrap) else []
    if len(given) != 2 or not all(isinstance(w, bool | np.bool_) for w in given):
        raise MeshError(f"wrap: expected two booleans, got {wrap!r}")
    return bool(given[0]), bool(given[1])


def _checked_faces(faces: Any, points: Floats) -> tuple[Ints, NDArray[np.int64] | None, int]:
    """Faces as (m, 4) int32, the given face each stems from (None: itself), and how many were split."""
    from quadcurv.kernels import topology

    if len(points) == 0:
        raise MeshError("points: none given")
    try:
        given = np.asarray(faces)
    except ValueError:  # polygons of different lengths
        given = np.empty(0, object)
    if np.ma.is_masked(faces):
        raise MeshError("faces: masked entries, expected an index in each")
    if given.ndim == 2 and given.shape[1] in (3, 4) and given.dtype.kind in "iu":
        if given.dtype == np.uint64:  # the largest must not come out as -1
            given = np.minimum(given, np.uint64(np.iinfo(np.int64).max))
        table = np.ascontiguousarray(given, np.int32 if given.dtype == np.int32 else np.int64).view()
        source, n_split = None, 0
    elif given.ndim == 2 and given.shape[1] in (3, 4):
        raise MeshError(f"faces: expected integer indices, got dtype {given.dtype}")
    else:
        table, source, n_split = _from_polygons(faces, points)
    if len(table) == 0:
        raise MeshError("faces: none given")
    n = len(points)
    if n > np.iinfo(np.int32).max // 4:
        raise MeshError(f"points: {n} are more than 32-bit indices can number")
    table.flags.writeable = False  # of one type for the compiler, whatever the caller's is
    checked = np.empty((len(table), 4), np.int32)
    (outside, n_outside), (repeated, n_repeated) = topology.checked(table, n, checked)

    def given_face(face: int) -> int:
        return face if source is None else int(source[face])

    if n_outside:
        raise MeshError(
            f"faces: {n_outside} face(s) with an index outside 0..{n - 1}, "
            f"first face {given_face(outside)}: {_padded(table[outside])}"
        )
    if n_repeated:
        raise MeshError(
            f"faces: {n_repeated} face(s) with a repeated vertex, "
            f"first face {given_face(repeated)}: {_padded(table[repeated])}"
        )
    return checked, source, n_split


def _padded(face: Any) -> list[int]:
    return [*face.tolist(), -1][:4]


def _from_polygons(faces: Any, points: Floats) -> tuple[NDArray[np.int64], NDArray[np.int64], int]:
    """Triangles and quads as they are, larger polygons by ear clipping across their vector area."""
    import mapbox_earcut

    rows: list[list[int]] = []
    source: list[int] = []
    n_split = 0
    try:
        polygons = [[operator.index(v) for v in face] for face in faces]
    except TypeError:
        raise MeshError(
            "faces: expected an integer array of shape (m, 3) or (m, 4), or a sequence of polygons"
        ) from None
    for i, polygon in enumerate(polygons):
        if len(polygon) < 3:
            raise MeshError(f"faces: a face has at least 3 vertices, face {i} has {len(polygon)}")
        if min(polygon) < (-1 if len(polygon) == 4 else 0) or max(polygon) >= len(points):
            raise MeshError(f"faces: face {i} has an index outside 0..{len(points) - 1}: {polygon}")
        pieces = [polygon]
        if len(polygon) > 4:
            if len(set(polygon)) < len(polygon):
                raise MeshError(f"faces: face {i} has a repeated vertex: {polygon}")
            corners = points[polygon] - points[polygon[0]]
            normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
            # The plane across the normal: the right singular vectors of a row begin with the row.
            _, _, (along, *plane) = np.linalg.svd(normal[None])
            if np.linalg.det([along, *plane]) * np.dot(along, normal) < 0:
                plane.reverse()
            flat = np.ascontiguousarray(corners @ np.transpose(plane))
            ears = mapbox_earcut.triangulate_float64(flat, np.array([len(polygon)], np.uint32))
            if len(ears) != 3 * (len(polygon) - 2):  # it crosses itself, or vertices are in line
                ears = np.array([(0, v, v + 1) for v in range(1, len(polygon) - 1)])
            pieces = [[polygon[v] for v in ear] for ear in ears.reshape(-1, 3)]
            n_split += 1
        for piece in pieces:
            rows.append(piece + [-1] * (4 - len(piece)))
            source.append(i)
    table = np.array(rows, np.int64).reshape(-1, 4)
    return table, np.array(source, np.int64), n_split


def _consistent_sides(faces: Ints) -> tuple[Bools, bool]:
    """Which faces to turn, as few as possible, so that neighbours agree; and whether all then do.

    Non-orientable components are left as they are.
    """
    m = len(faces)
    f, i, g, j = face_pairs(faces)
    same_way = faces[f, i] == faces[g, j]
    # Node f is face f as given, node f + m the same face turned; an edge joins what goes together.
    rows = np.concatenate((f, f + m))
    columns = np.concatenate((np.where(same_way, g + m, g), np.where(same_way, g, g + m)))
    graph = scipy.sparse.coo_array((np.ones(rows.size, bool), (rows, columns)), shape=(2 * m, 2 * m))
    label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    orientable = not bool((label[:m] == label[m:]).any())
    kept = np.bincount(label[:m], minlength=label.max() + 1)
    turned = np.bincount(label[m:], minlength=label.max() + 1)
    # A component and its mirror image differ in which faces they turn: keep the one that turns fewer.
    ours, theirs = kept[label[:m]], turned[label[:m]]
    first = np.full(label.max() + 1, m)
    np.minimum.at(first, label[:m], np.arange(m))
    mirror = np.empty(label.max() + 1, np.int64)
    mirror[label[:m]] = label[m:]
    tie = first[label[:m]] > first[mirror[label[:m]]]
    return (ours < theirs) | ((ours == theirs) & tie), orientable
