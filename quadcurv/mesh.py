"""Meshes, checked once and frozen."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.checks import Finding, Report, checked_points, checked_wrap, masked_points, unit_roundoff
from quadcurv.connectivity import Connectivity, connect
from quadcurv.stencils import Stencils, grid_faces
from quadcurv.types import Bools, Floats, Indices, Ints, MeshError, MeshWarning

_SEAM = 1e-9  # of the extent: nearer than that two rows are one


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


@dataclass(frozen=True, eq=False, init=False, repr=False)
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
        A polygon of more than four sides is kept for the schemes that are made for polygons, and cut into
        triangles for the others, the worst of them as good as can be.

    Attributes
    ----------
    points : (n, 3) float64, read-only
    connectivity : Connectivity
        What does not depend on the positions; meshes made by :meth:`with_points` share it.
    recovery : Recovery or None
        How the quads were found, where they come from triangles.
    roundoff : float
        Relative rounding error of the positions as they were given, 2^-24 for float32.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes or types, masked entries, non-finite points, coordinates beyond 1e70 or
        all within 1e-70 of each other, indices out of range, no proper face.

    Warns
    -----
    MeshWarning
        Once, with what was mended and where: faces that repeat a vertex or another face, faces turned to
        agree with their neighbours; edges of more than two faces; a mesh that cannot be oriented.

    Notes
    -----
    Vertices without a face, vertices where several fans touch and the ends of edges of more than two faces
    are accepted: their curvature is NaN. `report` counts all of these.
    """

    points: Floats
    connectivity: Connectivity
    recovery: Recovery | None
    roundoff: float

    def __init__(
        self,
        points: ArrayLike,
        faces: ArrayLike | Sequence[Sequence[int]],
    ) -> None:
        checked = checked_points(points, "points", ("n", 3))
        self.__dict__.update(
            points=checked,
            connectivity=connect(faces, checked),
            recovery=None,
            roundoff=unit_roundoff(points),
        )
        _warn(self.connectivity.findings)

    def __repr__(self) -> str:
        triangles = int(np.count_nonzero(self.faces[:, 3] < 0))
        kinds = f"{len(self.faces) - triangles} quads" + (f", {triangles} triangles" if triangles else "")
        return f"QuadMesh({len(self.points)} points, {kinds})"

    @property
    def faces(self) -> Ints:
        """(m, 4) int32, read-only: the faces computed with; a triangle's last entry is -1."""
        return self.connectivity.faces

    @property
    def face_source(self) -> Indices:
        """(m,) int64: the index of the given face that each of `faces` stems from."""
        source = self.connectivity.source
        return np.arange(len(self.faces)) if source is None else source

    @property
    def orientable(self) -> bool:
        """False for a mesh such as a Moebius strip; its mean curvature is given without sign."""
        return self.connectivity.orientable

    @cached_property
    def report(self) -> Report:
        """What was mended, and what has no answer; a closed mesh that is inside out is told of too."""
        findings = self.connectivity.findings
        if self.orientable and self.connectivity.closed.all() and _volume(self.points, self.faces) < 0:
            findings += (Finding("inside_out", 1, ""),)
        return Report(findings)

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at a boundary stay open."""
        c = self.connectivity
        stencils = Stencils(self.points, c.faces, (len(self.points),), c.closed, c.orientable, c.polygons)
        stencils.__dict__.update(ring=c.ring, irregular=c.irregular)
        return stencils

    def irregular_part(self) -> tuple[Indices, Stencils]:
        """Vertices without a regular ring, and the stencils of a part of the mesh around them.

        The first vertices of the part are these; it reaches four faces beyond them, so that they have there
        all that a ghost layer or a scheme may look at.
        """
        c = self.connectivity
        if c.irregular.size == 0:
            return c.irregular, Stencils(self.points[:0], self.faces[:0], (0,), np.empty(0, bool))
        vertices, faces = c.irregular_part
        part = Stencils(
            self.points[vertices], faces, (vertices.size,), c.closed[vertices], orientable=c.orientable
        )
        return c.irregular, part

    def with_points(self, points: ArrayLike) -> QuadMesh:
        """Return the same faces, not checked again, over other positions of the same shape."""
        checked = checked_points(points, "points", self.points.shape)
        return self._like(points=checked, roundoff=unit_roundoff(points))

    def reordered(self) -> QuadMesh:
        """Return the same mesh with an order of its vertices in which neighbours are near in memory.

        Results stay in the order of the vertices; FV and Liu are faster by it on large meshes whose
        neighbours are far apart in memory. It takes the time of several evaluations, and pays where many
        follow, as with :meth:`with_points`. Where it would not pay, nothing is done.
        """
        return self._like(connectivity=self.connectivity.reordered())

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results."""
        return values

    def with_recovery(self, recovery: Recovery) -> QuadMesh:
        """Return the same mesh that knows how its quads were found."""
        return self._like(recovery=recovery)

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"points": self.points}

    def _like(self, **changed: Any) -> QuadMesh:
        mesh = object.__new__(QuadMesh)
        kept = {name: self.__dict__[name] for name in ("points", "connectivity", "recovery", "roundoff")}
        mesh.__dict__.update(kept | changed)
        return mesh


@dataclass(frozen=True, eq=False, init=False, repr=False)
class QuadGrid:
    """A logically Cartesian grid of vertices.

    Parameters
    ----------
    points : (r, c, 3) array_like of float
        Positions; the surface normal is that of the first direction times the second. Grids of
        ``numpy.meshgrid(x, y, indexing="ij")`` with z = f(x, y) have it along +z, those of
        ``indexing="xy"``, where x runs along the second direction, along -z, and H of the other sign.
    wrap : (bool, bool)
        Whether the last row (column) is followed by the first, which is not repeated.
    mask : (r, c) array_like of bool, optional
        True where there is no point, as in numpy's masked arrays; so are points that `points` masks, or
        whose coordinates are NaN. Holes are open sides: results are NaN in them, and beside them as at
        every border.

    Attributes
    ----------
    points : (r, c, 3) float64, read-only
        NaN where masked.
    wrap : (bool, bool)
    mask : (r, c) bool or None
    roundoff : float
        Relative rounding error of the positions as they were given, 2^-24 for float32.

    Raises
    ------
    MeshError
        A ValueError: wrong shape, fewer than 2 points a direction (3 where it wraps), infinite points, a
        wrap whose first row (column) is given twice, a mask that leaves no quad.

    Warns
    -----
    MeshWarning
        Points that are NaN without being masked.
    """

    points: Floats
    wrap: tuple[bool, bool]
    mask: Bools | None
    roundoff: float

    def __init__(
        self, points: ArrayLike, wrap: Sequence[bool] = (False, False), mask: ArrayLike | None = None
    ) -> None:
        wraps = checked_wrap(wrap)
        checked, hidden, unexpected = masked_points(points, mask)
        self.__dict__.update(points=checked, wrap=wraps, mask=hidden, roundoff=unit_roundoff(points))
        for axis, name in enumerate(("rows", "columns")):
            least = 3 if wraps[axis] else 2
            if checked.shape[axis] < least:
                raise MeshError(
                    f"points: {checked.shape[axis]} {name}, at least {least} are needed"
                    + (" where the grid wraps" if wraps[axis] else "")
                )
            if wraps[axis]:
                _refuse_repetition(checked, axis, name)
        self.__dict__["report"] = Report(unexpected)
        _warn(unexpected)

    def __repr__(self) -> str:
        masked = f", {np.count_nonzero(self.mask)} masked" if self.mask is not None else ""
        return f"QuadGrid({self.shape[0]} x {self.shape[1]} points, wrap={self.wrap}{masked})"

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of vertices."""
        return self.points.shape[0], self.points.shape[1]

    report: Report
    """Points without a position, taken as holes."""

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at open sides stay open.

        Of a grid with a mask these are the stencils of :meth:`to_mesh`, in whose order they are.
        """
        if self.mask is not None:
            return self.to_mesh().stencils()
        index = np.arange(self.shape[0] * self.shape[1], dtype=np.int32).reshape(self.shape)
        index = np.pad(index, [(0, int(w)) for w in self.wrap], mode="wrap")
        closed = np.ones(self.shape, bool)
        if not self.wrap[0]:
            closed[[0, -1]] = False
        if not self.wrap[1]:
            closed[:, [0, -1]] = False
        return Stencils(self.points.reshape(-1, 3), grid_faces(index), self.shape, closed.ravel())

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results.

        Where masked they are NaN, integers 0.
        """
        if self.mask is None:
            return values.reshape(*self.shape, *values.shape[1:])
        fill = np.nan if values.dtype.kind == "f" else 0
        placed = np.full((*self.shape, *values.shape[1:]), fill, values.dtype)
        placed[~self.mask] = values
        return placed

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"points": self.points}

    def side(self, axis: int, end: int) -> QuadGrid:
        """Return the two rows (axis 0) or columns (1) at the first (end 0) or last (-1) open side."""
        size = self.shape[axis]
        kept = range(2) if end == 0 else range(size - 2, size)
        return QuadGrid(self.points.take(kept, axis), [w and i != axis for i, w in enumerate(self.wrap)])

    def to_mesh(self) -> QuadMesh:
        """Return the same quads as a face list, vertices in row-major order, masked ones left out."""
        if self.mask is None:
            stencils = self.stencils()
            return QuadMesh(stencils.points, stencils.faces)
        index = np.full(self.shape, -1, np.int32)
        index[~self.mask] = np.arange(np.count_nonzero(~self.mask))
        faces = grid_faces(np.pad(index, [(0, int(w)) for w in self.wrap], mode="wrap"))
        return QuadMesh(self.points[~self.mask], faces[(faces >= 0).all(axis=1)])


@dataclass(frozen=True, eq=False, init=False, repr=False)
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

    primal: Floats
    dual: Floats
    wrap: tuple[bool, bool]
    shape: tuple[int, int]
    roundoff: float

    def __init__(self, primal: ArrayLike, dual: ArrayLike, wrap: Sequence[bool] = (False, False)) -> None:
        self.__dict__.update(
            wrap=checked_wrap(wrap),
            dual=checked_points(dual, "dual", ("r + 1", "c + 1", 3)),
            roundoff=max(unit_roundoff(primal), unit_roundoff(dual)),
        )
        r, c = (self.dual.shape[0] - 1, self.dual.shape[1] - 1)
        self.__dict__.update(primal=checked_points(primal, "primal", ("r", "c", 3)), shape=(r, c))
        if r < 1 or c < 1 or self.primal.shape[:2] not in ((r, c), (r + 2, c + 2)):
            raise MeshError(
                f"primal: shape {self.primal.shape} does not fit dual of shape {self.dual.shape}; "
                f"expected {(r, c, 3)}, or {(r + 2, c + 2, 3)} with ghost cells"
            )
        if self.primal.shape[:2] == (r + 2, c + 2) and any(self.wrap):
            raise MeshError("wrap: primal has ghost cells already, so no side is left to wrap")
        if self.primal.shape[:2] == (1, 1):
            raise MeshError("primal: a single cell needs ghost cells around it")
        for axis, name in enumerate(("rows", "columns")):
            if not self.wrap[axis]:
                continue
            if self.shape[axis] < 3:
                raise MeshError(f"primal: {self.shape[axis]} {name}, at least 3 are needed to wrap")
            gap = np.abs(self.dual.take(0, axis) - self.dual.take(-1, axis)).max()
            if gap > _SEAM * np.ptp(self.dual.reshape(-1, 3), axis=0).max():
                raise MeshError(f"dual: first and last {name} differ by {gap:.3g} although they wrap")

    def __repr__(self) -> str:
        return f"StaggeredGrid({self.shape[0]} x {self.shape[1]} cells, wrap={self.wrap})"

    @property
    def report(self) -> Report:
        """Nothing is ever mended in a staggered grid."""
        return Report(())

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results."""
        return values.reshape(*self.shape, *values.shape[1:])

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"primal": self.primal, "dual": self.dual}

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


def _warn(findings: Sequence[Finding]) -> None:
    """Say once what was mended, above the one who made the mesh."""
    said = Report(findings).warning
    if said:
        warnings.warn(said, MeshWarning, stacklevel=3)


def _volume(points: Floats, faces: Ints) -> float:
    """Six times the signed volume that a closed mesh encloses."""
    x = points - points[0]
    a, b, c = (x[faces[:, k]] for k in range(3))
    volume = np.einsum("ix,ix->", np.cross(a, b), c)
    quad = faces[:, 3] >= 0
    d = x[faces[quad, 3]]
    return float(volume + np.einsum("ix,ix->", np.cross(a[quad], c[quad]), d))


def _refuse_repetition(points: Floats, axis: int, name: str) -> None:
    """The first row of a wrap that the last one repeats would make quads without area."""
    with np.errstate(invalid="ignore"):
        first, last, second = (points.take(k, axis) for k in (0, -1, 1))
        gap, step = np.abs(first - last), np.abs(second - first)
    known = np.isfinite(gap)
    # Files in single precision, and grids far from the origin, repeat a row to some digits only.
    if known.any() and gap[known].max() <= 1e-3 * np.nanmax(step, initial=0.0) > 0:
        raise MeshError(
            f"wrap: the last of the {name} repeats the first one, which follows it where the grid wraps: "
            f"leave it out, as points{'[:-1]' if axis == 0 else '[:, :-1]'} does"
        )
