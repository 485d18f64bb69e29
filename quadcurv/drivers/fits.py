"""Any fit on any mesh: what it sees of the mesh, NaN where nothing is known, the sign, the shape.

Borders: with boundary="extrapolate" grids and face lists go on by up to two layers of ghosts, by quintic
extrapolation along strips of six points, wherever the strips are complete and smooth (see `boundary`).
Elsewhere a neighbourhood ends at the border and a fit is one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import cached_property
from typing import Any

import numpy as np
import scipy

from quadcurv.boundary import checked_boundary, ghost_layer, ghosts, with_ghosts
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.schemes import Curvatures, Fit, StandardErrors
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

_GHOST_DEGREE, _GHOST_LAYERS = 5, 2
# Of one fit, in vertices of the finite-volume scheme.
_WORK = 30


def fit(mesh: Mesh, scheme: Fit, boundary: str = "extrapolate") -> Curvatures:
    """Curvatures of a fit at every vertex of a mesh, in the shape of its results."""
    checked_boundary(boundary)
    return fit_around(MeshNeighbourhoods(mesh, boundary), scheme)


def fit_around(around: MeshNeighbourhoods, scheme: Fit) -> Curvatures:
    """The same over neighbourhoods that several fits may share."""
    found = scheme.fit(around)
    if found.mean.shape != around.wanted.shape:
        raise ValueError(
            f"{scheme.name}: its fit gave H of shape {found.mean.shape}, expected {around.wanted.shape}"
        )
    unknown = ~around.wanted
    if unknown.any():
        found = each(found, lambda values: _masked(values, unknown))
    if not around.stencils.orientable:  # no side is the outer one: that with H >= 0
        found = _turned(found, found.mean < 0)
    shape = around.stencils.shape
    return each(found, lambda values: values.reshape(*shape, *values.shape[1:]))


class MeshNeighbourhoods:
    """The `Neighbourhoods` of a mesh."""

    def __init__(self, mesh: Mesh, boundary: str) -> None:
        self.mesh, self.boundary = mesh, boundary
        self.stencils, self.present = _stencils(mesh)
        self.wanted = self.present & self.stencils.closed if boundary == "nan" else self.present

    def polynomials(self, vertices: Indices, degree: int, rings: int, ghosts: bool = True) -> Floats:
        """(k, COLUMNS): see `Neighbourhoods`."""
        out = (self._windows or self._faces).polynomials(vertices, degree, rings)
        continued = self._continued(rings) if ghosts else None
        if continued is not None:
            faces, place = continued
            at = place[vertices]
            out[at >= 0] = faces.polynomials(at[at >= 0], degree, rings)
        return out

    def positions(self, vertices: Indices, rings: int) -> tuple[Floats, Floats]:
        """(k, m, 3) and (k, 3): see `Neighbourhoods`."""
        out, normals = self._faces.positions(vertices, rings), self._faces.normals[vertices]
        continued = self._continued(rings)
        if continued is not None:
            faces, place = continued
            at = place[vertices]
            kept = at >= 0
            out = _replaced(out, kept, faces.positions(at[kept], rings))
            normals[kept] = faces.normals[at[kept]]
        return out, normals

    def lattice(self, layers: int) -> Floats:
        """(r + 2 layers, c + 2 layers, 3): see `Neighbourhoods`."""
        if isinstance(self.mesh, QuadMesh):
            raise ValueError("mesh: this fit and its kind need a QuadGrid or a StaggeredGrid, got a QuadMesh")
        x, wrap = self.mesh.points if isinstance(self.mesh, QuadGrid) else self.mesh.primal, self.mesh.wrap
        if isinstance(self.mesh, StaggeredGrid) and self.mesh.has_ghosts:
            x = x[1:-1, 1:-1]
        x = x - x[0, 0]  # an offset costs no digits
        extrapolated = self.boundary == "extrapolate" and not all(wrap)
        if extrapolated:
            index, beyond = ghost_layer(x, wrap, 3 + layers, layers)
            x = np.concatenate((x.reshape(-1, 3), beyond))[index]
        for axis, wraps in enumerate(wrap):
            if wraps or not extrapolated:
                x = _padded(x, axis, wraps, layers)
        return x

    @cached_property
    def _faces(self) -> _FaceNeighbourhoods:
        return _FaceNeighbourhoods(self.stencils)

    @cached_property
    def _windows(self) -> _GridNeighbourhoods | None:
        if isinstance(self.mesh, QuadGrid) and self.mesh.mask is None:
            return _GridNeighbourhoods(self.mesh, self.stencils)
        return None

    def _continued(self, layers: int) -> tuple[_FaceNeighbourhoods, Indices] | None:
        """The mesh near its border with ghosts, and places there of vertices whose ghosts are all smooth."""
        if (
            self.boundary == "nan"
            or layers > _GHOST_LAYERS
            or isinstance(self.mesh, StaggeredGrid)
            or self.stencils.closed.all()
        ):
            return None
        if layers not in self._ghosted:
            self._ghosted[layers] = _continued(self.stencils, layers)
        return self._ghosted[layers]

    @cached_property
    def _ghosted(self) -> dict[int, tuple[_FaceNeighbourhoods, Indices] | None]:
        return {}


class _GridNeighbourhoods:
    """Windows of a grid."""

    def __init__(self, grid: QuadGrid, stencils: Stencils) -> None:
        self.grid, self.normals = grid, stencils.ring_areas.reshape(grid.points.shape)

    def polynomials(self, vertices: Indices, degree: int, rings: int) -> Floats:
        from quadcurv.kernels import jet

        at = np.stack(np.divmod(vertices, self.grid.shape[1]), axis=1) + rings
        points, normals = self.grid.points, self.normals
        for axis, wraps in enumerate(self.grid.wrap):
            points, normals = (_padded(x, axis, wraps, rings) for x in (points, normals))
        return _over(
            lambda v, out: jet.grid_fits(points, normals, v, degree, rings, out), at.astype(np.int32)
        )


class _FaceNeighbourhoods:
    """Rings of faces."""

    def __init__(self, stencils: Stencils) -> None:
        from quadcurv.kernels import topology

        self.stencils = stencils
        self.corners = topology.corners_by_vertex(stencils.faces, len(stencils.points))

    @cached_property
    def normals(self) -> Floats:
        """(n, 3): normals of the rings; where the polygon around a vertex has no area its neighbours'."""
        stencils, (indptr, corners) = self.stencils, self.corners
        normals = stencils.ring_areas
        flat = np.flatnonzero((np.diff(indptr)[: stencils.n] > 0) & ~normals.any(axis=1))
        normals = normals.copy() if flat.size else normals
        for v in flat:  # of valence 2
            around = stencils.faces[corners[indptr[v] : indptr[v + 1]] // 4]
            around = around[(around >= 0) & (around < stencils.n)]
            normals[v] = stencils.ring_areas[np.unique(around)].sum(axis=0)
        return normals

    def polynomials(self, vertices: Indices, degree: int, rings: int) -> Floats:
        from quadcurv.kernels import jet

        s, (indptr, corners), normals = self.stencils, self.corners, self.normals

        def fits(vertices: Ints, out: Floats) -> None:
            jet.face_fits(
                s.points, s.faces, indptr, corners, normals, s.orientable, vertices, degree, rings, out
            )

        return _over(fits, vertices.astype(np.int32))

    @cached_property
    def _incidence(self) -> scipy.sparse.csr_array:
        """(faces, points) bool."""
        faces, sides = self.stencils.faces, self.stencils.faces >= 0
        indptr = np.concatenate(([0], np.cumsum(sides.sum(axis=1))))
        shape = len(faces), len(self.stencils.points)
        return scipy.sparse.csr_array((np.ones(indptr[-1], bool), faces[sides], indptr), shape)

    def positions(self, vertices: Indices, rings: int) -> Floats:
        incidence, k = self._incidence, vertices.size
        around = scipy.sparse.csr_array(
            (np.ones(k, bool), vertices, np.arange(k + 1)), (k, len(self.stencils.points))
        )
        for _ in range(rings):
            around = around + around @ incidence.T @ incidence
        around.sort_indices()
        row, column = around.nonzero()
        other = column != vertices[row]
        row, column = row[other], column[other]
        size = np.bincount(row, minlength=k)
        out = np.full((k, 1 + size.max(initial=0), 3), np.nan)
        out[:, 0] = self.stencils.points[vertices]
        out[row, 1 + np.arange(row.size) - np.repeat(np.cumsum(size) - size, size)] = self.stencils.points[
            column
        ]
        return out


def _continued(stencils: Stencils, layers: int) -> tuple[_FaceNeighbourhoods, Indices] | None:
    from quadcurv.kernels import topology

    border = np.flatnonzero(~stencils.closed)
    kept, faces = topology.part_around(stencils.faces, border, stencils.n, _GHOST_DEGREE)
    closed = stencils.closed[kept]
    part = Stencils(stencils.points[kept], faces, closed.shape, closed, stencils.orientable)
    layer = ghosts(part, _GHOST_DEGREE, layers)
    if layer.quads.size == 0:
        return None
    ghosted, rough = with_ghosts(part, layer)
    near = np.arange(rough.size) >= part.n
    # Ghosts err by some ten times their roughness, one-sided fits by some ten times the turn's third power.
    bad = rough > _turn(part) ** 3
    corners = np.where(ghosted.faces < 0, ghosted.faces[:, :1], ghosted.faces)
    for _ in range(layers):
        for mark in (near, bad):
            mark[corners[mark[corners].any(axis=1)]] = True
        bad[: part.n] |= ~ghosted.closed  # beside these, ghosts are missing
    chosen = np.flatnonzero((near & ~bad)[: part.n])
    place = np.full(stencils.n, -1)
    place[kept[chosen]] = chosen
    return _FaceNeighbourhoods(ghosted), place


def _turn(mesh: Stencils) -> float:
    """Sine of the angle by which the normal turns across a face, on average."""
    size = np.linalg.norm(mesh.ring_areas, axis=1, keepdims=True)
    normals = np.divide(mesh.ring_areas, size, out=np.zeros_like(mesh.ring_areas), where=size > 0)
    ends = normals[mesh.faces[:, 0]], normals[mesh.faces[:, 2]]
    return float(np.linalg.norm(np.cross(*ends), axis=1).mean())


def _stencils(mesh: Mesh) -> tuple[Stencils, Bools]:
    """Stencils of all vertices, those that a mask hides without faces; which ones are one fan of faces."""
    from quadcurv.kernels import topology

    if isinstance(mesh, QuadGrid) and mesh.mask is not None:
        known, (stencils, one_fan) = np.flatnonzero(~mesh.mask), _stencils(mesh.to_mesh())
        closed, present = np.zeros((2, mesh.mask.size), bool)
        closed[known], present[known] = stencils.closed, one_fan
        faces = known.astype(np.int32)[stencils.faces]
        return Stencils(mesh.points.reshape(-1, 3), faces, mesh.shape, closed), present
    stencils, present = mesh.stencils(), np.ones(mesh.stencils().n, bool)
    if isinstance(mesh, QuadMesh):
        kind = mesh.connectivity.kind
        present = (kind == topology.INTERIOR) | (kind == topology.BOUNDARY)
    return stencils, present


def _padded(values: Floats, axis: int, wraps: bool, layers: int) -> Floats:
    """With layers at both ends of an axis: the other side where it wraps, else NaN."""
    pad = [(layers, layers) if x == axis else (0, 0) for x in range(3)]
    return np.pad(values, pad, "wrap") if wraps else np.pad(values, pad, constant_values=np.nan)


def _replaced(positions: Floats, kept: Bools, others: Floats) -> Floats:
    """Positions (k, m, 3), some of the k from another array of another m."""
    m = max(positions.shape[1], others.shape[1])
    out = np.full((len(positions), m, 3), np.nan)
    out[~kept, : positions.shape[1]] = positions[~kept]
    out[kept, : others.shape[1]] = others
    return out


def _over(fits: Callable[[Any, Floats], None], vertices: Ints) -> Floats:
    """Run a kernel over vertices, in ranges by several threads where there are many."""
    from quadcurv.kernels import jet, ranges

    out = np.empty((len(vertices), jet.COLUMNS))
    ranges.over(
        lambda start, stop: fits(vertices[start:stop], out[start:stop]),
        len(vertices),
        _WORK * len(vertices),
        jet.LANES,
    )
    return out


def each(found: Curvatures, change: Callable[[Any], Any]) -> Curvatures:
    """Curvatures with all arrays changed."""
    values = {f.name: getattr(found, f.name) for f in fields(found)}
    for name, value in values.items():
        if isinstance(value, StandardErrors):
            values[name] = StandardErrors(*map(change, value))
        elif value is not None:
            values[name] = change(value)
    return Curvatures(**values)


def _masked(values: Any, unknown: Bools) -> Any:
    values = values.copy()
    values[unknown] = np.nan if values.dtype.kind == "f" else 0
    return values


def _turned(found: Curvatures, turn: Bools) -> Curvatures:
    """Seen from the other side at some vertices: H -> -H, k1 -> -k2."""

    def signed(values: Floats) -> Floats:
        return np.where(turn if values.ndim == 1 else turn[:, None], -values, values)

    def swapped(one: Floats, other: Floats) -> tuple[Floats, Floats]:
        at = turn if one.ndim == 1 else turn[:, None]
        return np.where(at, other, one), np.where(at, one, other)

    k1, k2 = swapped(found.k1, found.k2)
    direction1, direction2 = swapped(found.direction1, found.direction2)
    errors = found.standard_error
    if errors is not None:
        errors = StandardErrors(errors.mean, errors.gaussian, *swapped(errors.k1, errors.k2))
    return Curvatures(
        signed(found.mean), found.gaussian, signed(k1), signed(k2), direction1, direction2,
        signed(found.normal), errors, found.noise, found.degree, found.rings,
    )  # fmt: skip
