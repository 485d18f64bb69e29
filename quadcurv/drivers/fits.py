"""Any fit on any mesh: what it sees of the mesh, NaN where nothing is known, the sign, the shape.

Borders: with boundary="extrapolate" grids and face lists go on by up to three layers of ghosts, by quintic
extrapolation along strips of six points, wherever the strips are complete and smooth (see `boundary`).
Elsewhere a neighbourhood ends at the border and a fit is one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy

from quadcurv.boundary import (
    REACH,
    Surfaces,
    checked_boundary,
    fitted,
    ghost_layer,
    ghosts,
    mirrored,
    poles,
    welded,
)
from quadcurv.drivers.features import Features, features
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.schemes import Curvatures, Fit, StandardErrors
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

_GHOST_DEGREE, _GHOST_LAYERS = 5, 3
ROUNDING = 2.0**-49  # of positions, and of what is computed from them
_SURE = 0.01
_AVERAGED = 5  # rings that normals are averaged over where noise prevails
# Of one fit, in vertices of the finite-volume scheme.
_WORK = 30
_CLEARLY = 3.0  # what the standard error of a one-sided fit must be of another's to be thought larger


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
    if found.standard_error is not None:
        found = _with_border_errors(found, around)
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
        self._border: dict[int, Floats] = {}
        x = self.stencils.points[: self.stencils.n][self.present]
        self.rounding = ROUNDING * float(np.abs(x).max(initial=0.0))

    def polynomials(
        self, vertices: Indices, degree: int, rings: int, ghosts: bool = True, kind: int = 0
    ) -> Floats:
        """(k, COLUMNS): see `Neighbourhoods`."""
        from quadcurv.kernels import jet

        one_sided = kind != jet.PLAIN and bool((self.on_crease | self.on_jump).any())
        if one_sided:
            own: _GridNeighbourhoods | _FaceNeighbourhoods = self._sides
        else:  # windows have the normals of their rings alone
            own = self._faces if self._windows is None or kind == jet.ROUND else self._windows
        out = own.polynomials(vertices, degree, rings, kind)
        for faces, place, reach, error in (*(self._beyond(rings) if ghosts else ()), *self._at_poles(rings)):
            at = np.where(self._at_crease[vertices], -1, place[vertices]) if one_sided else place[vertices]
            if error is not None:  # one-sided fits follow a smooth surface as well, but magnify noise
                if kind == jet.SMOOTH:
                    continue  # which the scheme looks at itself
                own_error = out[:, jet.SIGMA] * out[:, jet.GAIN]
                at = np.where(own_error <= _CLEARLY * error[at], -1, at)
                self.border_error(rings)[vertices[at >= 0]] = error[at[at >= 0]]
            once, again = np.unique(at[at >= 0], return_inverse=True)  # all points of a pole are one vertex
            out[at >= 0] = faces.polynomials(once, degree, reach, kind)[again]
        return out

    def border_error(self, rings: int) -> Floats:
        """(n,): see `Neighbourhoods`."""
        return self.at_border(rings)[0]

    def at_border(self, rings: int) -> Floats:
        """(2, n): standard error of H and noise by surfaces fitted at the border.

        Points read off these show none. NaN where neighbourhoods of so many rings have no such points.
        """
        return self._border.setdefault(rings, np.full((2, self.stencils.n), np.nan))

    def positions(self, vertices: Indices, rings: int) -> tuple[Floats, Floats]:
        """(k, m, 3) and (k, 3): see `Neighbourhoods`."""
        out, normals = self._faces.positions(vertices, rings), self._faces.normals[vertices]
        for faces, place, reach, error in (*self._beyond(rings), *self._at_poles(rings)):
            at = place[vertices]
            kept = (at >= 0) & (error is None)
            out = _replaced(out, kept, faces.positions(at[kept], reach))
            normals[kept] = faces.normals[at[kept]]
        return out, normals

    def pooled(self, values: Floats) -> Floats:
        """(n, k): see `Neighbourhoods`."""
        known = np.isfinite(values)
        count = self._adjacency @ known.astype(np.float64)
        with np.errstate(divide="ignore", invalid="ignore"):
            return self._adjacency @ np.where(known, values, 0.0) / count

    @cached_property
    def _adjacency(self) -> scipy.sparse.csr_array:
        """(n, n): 1 between vertices of one face."""
        incidence, n = self._faces._incidence[:, : self.stencils.n].astype(np.float64), self.stencils.n
        near = (incidence.T @ incidence).tocsr()
        near.data[:] = 1.0
        return near[:n, :n]

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
        return _FaceNeighbourhoods(self.stencils, present=self.present)

    @cached_property
    def on_crease(self) -> Bools:
        """(n,): see `Neighbourhoods`."""
        return self._features.creases & self.present

    @cached_property
    def on_jump(self) -> Bools:
        """(n,): see `Neighbourhoods`."""
        return self._features.jumps & self.present & ~self.on_crease

    @cached_property
    def _features(self) -> Features:
        return features(self.stencils)

    @cached_property
    def _at_crease(self) -> Bools:
        """(n,): what ghosts would continue across a crease."""
        near = (self.on_crease | self.on_jump).astype(np.float64)
        for _ in range(_GHOST_LAYERS):
            near = self._adjacency @ near
        return near > 0

    @cached_property
    def _sides(self) -> _FaceNeighbourhoods:
        """Rings that end at creases and jumps of curvature."""
        return _FaceNeighbourhoods(self.stencils, present=self.present & ~(self.on_crease | self.on_jump))

    @cached_property
    def _windows(self) -> _GridNeighbourhoods | None:
        if isinstance(self.mesh, QuadGrid) and self.mesh.mask is None:
            return _GridNeighbourhoods(self.mesh, self.stencils)
        return None

    def _beyond(self, rings: int) -> list[_Beyond]:
        """What takes the place of neighbourhoods over so many rings that would end at the border."""
        if self.boundary == "nan" or rings > _GHOST_LAYERS or self.stencils.closed.all():
            return []
        if rings not in self._replaced:
            cells = isinstance(self.mesh, StaggeredGrid)
            self._replaced[rings] = [] if cells else _continued(self.stencils, rings)
            left = self.present & ~self.stencils.closed
            for replaced in self._replaced[rings]:
                left &= replaced.place < 0
            self._replaced[rings] += self._mirrored(np.flatnonzero(left), rings)
            if rings > 1:  # neighbourhoods that end at the border all the same
                beside = _with_neighbours(self.stencils, left) & self.present
                for replaced in self._replaced[rings]:
                    beside &= replaced.place < 0
                self._replaced[rings] += self._mirrored(np.flatnonzero(beside & ~left), rings, inside=True)
        return self._replaced[rings]

    def _at_poles(self, rings: int) -> list[_Beyond]:
        """Rings of triangles around the poles of a grid, in place of windows that see them many times."""
        return [replaced._replace(reach=rings) for replaced in self._poles]

    @cached_property
    def _poles(self) -> list[_Beyond]:
        if not isinstance(self.mesh, QuadGrid) or (found := poles(self.mesh)) is None:
            return []
        stencils, pole = welded(self.mesh, found)
        near = np.isin(stencils.faces, pole[pole >= 0]).any(axis=1)
        place = pole.copy()
        beside = np.setdiff1d(stencils.faces[near], [-1, *pole[pole >= 0]])
        place[beside] = beside
        return [_Beyond(_FaceNeighbourhoods(stencils), place, 0)]

    def _mirrored(self, vertices: Indices, rings: int, inside: bool = False) -> list[_Beyond]:
        """Neighbourhoods completed by points of fitted surfaces, as stencils that lead to these points."""
        key = vertices.tobytes()
        if key not in self._surfaces:  # the same for every number of rings
            self._surfaces[key] = fitted(self.stencils, vertices)
        surfaces = self._surfaces[key]
        rows = np.flatnonzero(np.isfinite(surfaces.error))
        if rows.size == 0:
            return []
        vertices, surfaces = vertices[rows], surfaces.of(rows)
        error = surfaces.noise * surfaces.gain
        if not inside:
            self.at_border(rings)[:, vertices] = error, surfaces.noise
        points = mirrored(self.stencils, surfaces, rings)
        place = np.full(self.stencils.n, -1)
        place[vertices] = np.arange(vertices.size)
        faces = _FaceNeighbourhoods(_bundles(points), surfaces.frames[:, 2])
        return [_Beyond(faces, place, 1, error if inside else None)]

    @cached_property
    def _surfaces(self) -> dict[bytes, Surfaces]:
        return {}

    @cached_property
    def _replaced(self) -> dict[int, list[_Beyond]]:
        return {}


class _GridNeighbourhoods:
    """Windows of a grid."""

    def __init__(self, grid: QuadGrid, stencils: Stencils) -> None:
        self.grid, self.normals = grid, stencils.ring_areas.reshape(grid.points.shape)

    def polynomials(self, vertices: Indices, degree: int, rings: int, kind: int) -> Floats:
        from quadcurv.kernels import jet

        at = np.stack(np.divmod(vertices, self.grid.shape[1]), axis=1) + rings
        points, normals = self.grid.points, self.normals
        for axis, wraps in enumerate(self.grid.wrap):
            points, normals = (_padded(x, axis, wraps, rings) for x in (points, normals))
        return _over(
            lambda v, out: jet.grid_fits(points, normals, v, degree, rings, kind, out), at.astype(np.int32)
        )


class _FaceNeighbourhoods:
    """Rings of faces.

    Rings do not go on through vertices that are not `present`: beyond those of several fans, or of an edge of
    more than two faces, lies another sheet.
    """

    def __init__(
        self, stencils: Stencils, normals: Floats | None = None, present: Bools | None = None
    ) -> None:
        from quadcurv.kernels import topology

        self.stencils = stencils
        self.corners = topology.corners_by_vertex(stencils.faces, len(stencils.points))
        if present is not None and not present.all():
            indptr, corners = self.corners
            size = np.diff(indptr)
            seen = np.append(present, np.ones(size.size - present.size, bool))
            starts = np.cumsum(np.where(seen, size, 0))
            self.corners = np.concatenate(([0], starts)), corners[np.repeat(seen, size)]
        self.normals = self._ring_normals() if normals is None else normals

    def _ring_normals(self) -> Floats:
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

    def polynomials(self, vertices: Indices, degree: int, rings: int, kind: int) -> Floats:
        from quadcurv.kernels import jet

        s, (indptr, corners) = self.stencils, self.corners
        normals = self._averaged if kind == jet.ROUND else self.normals

        def fits(vertices: Ints, out: Floats) -> None:
            jet.face_fits(
                s.points, s.faces, indptr, corners, normals, s.orientable, vertices, degree, rings, kind, out
            )

        return _over(fits, vertices.astype(np.int32))

    @cached_property
    def _averaged(self) -> Floats:
        """(n, 3): normals over more rings, of which noise leaves little."""
        incidence = self._incidence[:, : len(self.normals)].astype(np.float64)
        normals = self.normals
        for _ in range(_AVERAGED):
            normals = incidence.T @ (incidence @ normals)
        return normals

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


class _Beyond(NamedTuple):
    """Neighbourhoods of `reach` rings that go on beyond the border, and the places of vertices in them.

    Where there is an `error`, of H by these, they are taken if that of the one-sided fit is clearly larger.
    """

    faces: _FaceNeighbourhoods
    place: Indices
    reach: int
    error: Floats | None = None


def _continued(stencils: Stencils, layers: int) -> list[_Beyond]:
    """The mesh near its border with ghosts, for vertices whose ghosts are all smooth."""
    from quadcurv.kernels import topology

    border = np.flatnonzero(~stencils.closed)
    kept, faces = topology.part_around(stencils.faces, border, stencils.n, REACH)
    closed = stencils.closed[kept]
    part = Stencils(stencils.points[kept], faces, closed.shape, closed, stencils.orientable)
    layer = ghosts(part, _GHOST_DEGREE, layers)
    if layer.quads.size == 0:
        return []
    points = np.concatenate((part.points, layer.points))
    faces = np.concatenate((part.faces, layer.quads))
    closed = part.closed | layer.smooth
    unsure = np.flatnonzero(np.isfinite(layer.error) & ~layer.smooth)
    # What is looked at with many others, by polynomials of a higher degree, must be right beyond doubt.
    share = 1.0 if layers < _GHOST_LAYERS else _SURE
    closed[unsure] = layer.error[unsure] <= share * fitted(part, unsure).error
    ghosted = Stencils(points, faces, part.shape, closed, part.orientable)
    near = np.arange(len(points)) >= part.n
    bad = np.zeros(len(points), bool)
    corners = np.where(faces < 0, faces[:, :1], faces)
    for _ in range(layers):
        for mark in (near, bad):
            mark[corners[mark[corners].any(axis=1)]] = True
        bad[: part.n] |= ~closed  # beside these, ghosts are missing
    chosen = np.flatnonzero((near & ~bad)[: part.n])
    place = np.full(stencils.n, -1)
    place[kept[chosen]] = chosen
    return [_Beyond(_FaceNeighbourhoods(ghosted), place, layers)]


def _with_neighbours(stencils: Stencils, chosen: Bools) -> Bools:
    """Vertices and those of the faces around them."""
    corners = np.where(stencils.faces < 0, stencils.faces[:, :1], stencils.faces)
    near = np.pad(chosen, (0, len(stencils.points) - stencils.n))
    near[corners[near[corners].any(axis=1)]] = True
    return near[: stencils.n]


def _bundles(points: Floats) -> Stencils:
    """Faces that lead from the first of each (k, m, 3) points to its others, and nowhere else."""
    k, m, _ = points.shape
    index = np.where(np.isnan(points[:, 1:, 0]), -1, np.arange(k * (m - 1)).reshape(k, m - 1) + k)
    index = np.pad(index, [(0, 0), (0, -(m - 1) % 3)], constant_values=-1).reshape(k, -1, 3)
    faces = np.concatenate(
        (np.broadcast_to(np.arange(k)[:, None, None], (*index.shape[:2], 1)), index), axis=2
    )
    flat = np.concatenate((points[:, 0], np.nan_to_num(points[:, 1:]).reshape(-1, 3)))
    return Stencils(flat, faces.reshape(-1, 4).astype(np.int32), (k,), np.ones(k, bool))


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


def _with_border_errors(found: Curvatures, around: MeshNeighbourhoods) -> Curvatures:
    """Curvatures with the errors of the surfaces that their neighbourhoods were completed from."""
    assert found.standard_error is not None
    own = found.standard_error.mean
    error, noise = np.full((2, own.size), np.nan)
    for r in range(1, _GHOST_LAYERS + 1):
        at = np.full(own.size, True) if found.rings is None else found.rings == r
        here = around.at_border(r)
        error[at], noise[at] = np.fmax(error, here[0])[at], np.fmax(noise, here[1])[at]
    larger = error > own
    factor = np.divide(error, own, out=np.ones_like(own), where=larger & (own > 0))
    errors = StandardErrors(*(e * factor for e in found.standard_error))
    return replace(
        found,
        standard_error=errors,
        noise=None if found.noise is None else np.where(larger, noise, found.noise),
    )


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
    errors, bars = (
        None if x is None else StandardErrors(x.mean, x.gaussian, *swapped(x.k1, x.k2))
        for x in (found.standard_error, found.interval)
    )
    return Curvatures(
        signed(found.mean), found.gaussian, signed(k1), signed(k2), direction1, direction2,
        signed(found.normal), errors, bars, found.noise, found.degree, found.rings, found.feature,
    )  # fmt: skip
