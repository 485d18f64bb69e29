"""Any fit on any mesh: what it sees of the mesh, NaN where nothing is known, the sign, the shape.

Borders: with boundary="extrapolate" grids and face lists go on by up to three layers of ghosts, by quintic
extrapolation along strips of six points, three layers by that of degree seven along smooth strips of eight,
wherever the strips are complete and smooth (see `boundary`). Elsewhere a neighbourhood ends at the border and
a fit is one-sided.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from quadcurv.boundary import (
    Surfaces,
    Trials,
    checked_boundary,
    fitted,
    ghost_layer,
    ghosts,
    poles,
    trials,
    welded,
    wide,
)
from quadcurv.drivers.features import Features, features
from quadcurv.drivers.rings import FaceRings, GridWindows, bundles
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.schemes import Curvatures, Fit, StandardErrors
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

if TYPE_CHECKING:
    from quadcurv.kernels.lines import Lines

_GHOST_LAYERS = 3
_GHOST_DEGREE = {1: 5, 2: 5, 3: 7}  # by layers: one more than that of the fits at least
ROUNDING = 2.0**-49  # of positions, and of what is computed from them
_SURE = 0.01
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
        from quadcurv.kernels.extent import largest

        self.mesh, self.boundary = mesh, boundary
        self.stencils, self.present = _stencils(mesh)
        if boundary == "nan":
            self.wanted = self.present & self.stencils.closed
        else:
            self.wanted = self.present & _seen_across(mesh, self.stencils)
        self.completed: dict[int, Floats] = {}
        self._tried: Trials | None = None
        self._tried_at = np.full(self.stencils.n, -1)
        x = self.stencils.points[: self.stencils.n]
        self.rounding = ROUNDING * largest(x if self.present.all() else x[self.present])

    def polynomials(
        self, vertices: Indices, degree: int, rings: int, ghosts: bool = True, kind: int = 0, nested: int = 1
    ) -> Floats:
        """(k, COLUMNS) or (nested, k, COLUMNS): see `Neighbourhoods`."""
        from quadcurv.kernels import jet

        one_sided = kind != jet.PLAIN and bool((self.on_crease | self.on_jump).any())
        if one_sided:
            own: GridWindows | FaceRings = self._sides
        else:
            narrow = kind == jet.ROUND and self._windows is not None and self._windows.overlap(rings)
            own = self._faces if self._windows is None or narrow else self._windows
        out = own.polynomials(vertices, degree, rings, kind, nested)
        for faces, place, reach, error, _ in (
            *(self._beyond(rings) if ghosts else ()),
            *self._at_poles(rings),
        ):
            at = np.where(self._at_crease[vertices], -1, place[vertices]) if one_sided else place[vertices]
            if error is not None:  # one-sided fits follow a smooth surface as well, but magnify noise
                if kind in (jet.SMOOTH, jet.FLAT):
                    continue  # which the scheme looks at itself
                own_error = out[:, jet.SIGMA] * out[:, jet.GAIN]
                at = np.where(own_error <= _CLEARLY * error[at], -1, at)
                self.border_error(rings)[vertices[at >= 0]] = error[at[at >= 0]]
            once, again = np.unique(at[at >= 0], return_inverse=True)  # all points of a pole are one vertex
            out[at >= 0] = faces.polynomials(once, degree, reach, kind, nested)[again]
        return out if nested == 1 else out.reshape(-1, nested, jet.COLUMNS).swapaxes(0, 1)

    def border_error(self, rings: int) -> Floats:
        """(n,): see `Neighbourhoods`."""
        return self.at_border(rings)[0]

    @cached_property
    def ghost_error(self) -> Floats:
        """(n,): see `Neighbourhoods`."""
        out = np.zeros(self.stencils.n)
        for _, place, _, _, change in self._beyond(_GHOST_LAYERS):
            if change is not None:
                at = np.flatnonzero(self.on_border & (place >= 0))
                out[at] = change[place[at]]
        return out

    def at_border(self, rings: int) -> Floats:
        """(2, n): standard error of H and noise by surfaces fitted at the border.

        Points read off these show none. NaN where neighbourhoods of so many rings have no such points.
        """
        if rings not in self.completed:
            self.completed[rings] = np.full((2, self.stencils.n), np.nan)
        return self.completed[rings]

    def positions(self, vertices: Indices, rings: int, ghosts: bool = True) -> tuple[Floats, Floats]:
        """(k, m, 3) and (k, 3): see `Neighbourhoods`."""
        if not ghosts:
            own = self._sides if bool((self.on_crease | self.on_jump).any()) else self._faces
            return own.positions(vertices, rings), own.normals[vertices]
        out, normals = self._faces.positions(vertices, rings), self._faces.normals[vertices]
        for faces, place, reach, error, _ in (*self._beyond(rings), *self._at_poles(rings)):
            at = place[vertices]
            kept = (at >= 0) & (error is None)
            out = _replaced(out, kept, faces.positions(at[kept], reach))
            normals[kept] = faces.normals[at[kept]]
        return out, normals

    def pooled(self, values: Floats, times: int = 1) -> Floats:
        """(n, k): see `Neighbourhoods`."""
        for _ in range(times):
            values = self._faces.means(values)
        return values

    @property
    def points(self) -> Floats:
        """(n, 3): see `Neighbourhoods`."""
        return self.stencils.points[: self.stencils.n]

    @cached_property
    def lines(self) -> Lines:
        """See `Neighbourhoods`."""
        from quadcurv.kernels.lines import lines

        links = _across(self.mesh) if isinstance(self.mesh, StaggeredGrid) else self.stencils.links
        ends = ~self.present | (not self.stencils.orientable)
        if ends.any():
            links = np.where(ends[links] | ends[:, None], np.int32(-1), links)
        return lines(links)

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
    def _faces(self) -> FaceRings:
        return FaceRings(self.stencils, present=self.present)

    @property
    def on_border(self) -> Bools:
        """(n,): see `Neighbourhoods`."""
        return self.present & ~self.stencils.closed

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
        near = (self.on_crease | self.on_jump).astype(np.float64)[:, None]
        for _ in range(_GHOST_LAYERS):
            near = self._faces.means(near)
        return near[:, 0] > 0

    @cached_property
    def _sides(self) -> FaceRings:
        """Rings that end at creases and jumps of curvature."""
        return FaceRings(self.stencils, present=self.present & ~(self.on_crease | self.on_jump))

    @cached_property
    def _windows(self) -> GridWindows | None:
        if isinstance(self.mesh, QuadGrid) and self.mesh.mask is None:
            return GridWindows(self.mesh, self._faces)
        return None

    def _beyond(self, rings: int) -> list[_Beyond]:
        """What takes the place of neighbourhoods over so many rings that would end at the border."""
        if self.boundary == "nan" or rings > _GHOST_LAYERS or self.stencils.closed.all():
            return []
        if rings not in self._replaced:
            cells = isinstance(self.mesh, StaggeredGrid)
            self._replaced[rings] = [] if cells else _continued(self.stencils, rings, self._fitted)
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
        return [_Beyond(FaceRings(stencils), place, 0)]

    def _mirrored(self, vertices: Indices, rings: int, inside: bool = False) -> list[_Beyond]:
        """Neighbourhoods completed by points of fitted surfaces, as stencils that lead to these points."""
        if not vertices.size:
            return []
        surfaces = self._fitted(vertices)
        rows = np.flatnonzero(np.isfinite(surfaces.error))
        if rows.size == 0:
            return []
        vertices, surfaces = vertices[rows], surfaces.of(rows)
        error = surfaces.noise * surfaces.gain
        if not inside:
            self.at_border(rings)[:, vertices] = error, surfaces.noise
        points = surfaces.mirrored(self.stencils.points, rings)
        place = np.full(self.stencils.n, -1)
        place[vertices] = np.arange(vertices.size)
        faces = FaceRings(bundles(points), surfaces.frames[:, 2])
        return [_Beyond(faces, place, 1, error if inside else None)]

    def _fitted(self, vertices: Indices) -> Surfaces:
        """Surfaces at vertices, none of which is fitted twice."""
        new = vertices[self._tried_at[vertices] < 0]
        if new.size or self._tried is None:
            tried, before = trials(self.stencils, new, self._corners), self._tried
            self._tried_at[new] = np.arange(new.size) + (0 if before is None else len(before.found))
            self._tried = tried if before is None else before.and_(tried)
        return fitted(self.stencils, vertices, self._tried.of(self._tried_at[vertices]))

    @cached_property
    def _corners(self) -> tuple[Indices, Ints]:
        from quadcurv.kernels import topology

        if self.present.all():
            return self._faces.corners
        return topology.corners_by_vertex(self.stencils.faces, len(self.stencils.points))

    @cached_property
    def _replaced(self) -> dict[int, list[_Beyond]]:
        return {}


class _Beyond(NamedTuple):
    """Neighbourhoods of `reach` rings that go on beyond the border, and the places of vertices in them.

    Where there is an `error`, of H by these, they are taken if that of the one-sided fit is clearly larger.
    `change` is that of ghosts, see `boundary.strips.Ghosts`, at their places.
    """

    faces: FaceRings
    place: Indices
    reach: int
    error: Floats | None = None
    change: Floats | None = None


def _continued(stencils: Stencils, layers: int, fitted: Callable[[Indices], Surfaces]) -> list[_Beyond]:
    """The mesh near its border with ghosts, for vertices whose ghosts are all smooth.

    Where it is in doubt whether they are, surfaces `fitted` there are asked.
    """
    from quadcurv.kernels import topology

    border, degree = np.flatnonzero(~stencils.closed), _GHOST_DEGREE[layers]
    kept, faces = topology.part_around(stencils.faces, border, stencils.n, degree)
    part = stencils.part(kept, faces)
    layer = ghosts(part, degree, layers)
    if layer.quads.size == 0:
        return []
    points = np.concatenate((part.points, layer.points))
    faces = np.concatenate((part.faces, layer.quads))
    closed = part.closed | layer.smooth
    unsure = np.flatnonzero(np.isfinite(layer.error) & ~layer.smooth)
    if unsure.size:
        # What is looked at with many others, by polynomials of a higher degree, must be right beyond doubt.
        share = 1.0 if layers < _GHOST_LAYERS else _SURE
        closed[unsure] = layer.error[unsure] <= share * fitted(kept[unsure]).error
    ghosted = replace(part, points=points, faces=faces, closed=closed)
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
    return [_Beyond(FaceRings(ghosted), place, layers, change=layer.change)]


def _seen_across(mesh: Mesh, stencils: Stencils) -> Bools:
    """(n,): not vertices far within strips of faces one wide, whose points tell nothing across them."""
    from quadcurv.kernels import topology

    seen = np.ones(stencils.n, bool)
    if isinstance(mesh, StaggeredGrid) or stencils.closed.all():
        return seen
    inside = np.flatnonzero(stencils.closed)
    if topology.surroundings(stencils.faces, inside, len(stencils.points), 1).size == len(stencils.faces):
        return seen
    seen = wide(stencils)
    for _ in range(2):
        seen = _with_neighbours(stencils, seen)
    return seen


def _with_neighbours(stencils: Stencils, chosen: Bools) -> Bools:
    """Vertices and those of the faces around them."""
    from quadcurv.kernels import topology

    near, faces = np.pad(chosen, (0, len(stencils.points) - stencils.n)), stencils.faces
    faces = faces[topology.surroundings(faces, np.flatnonzero(near), near.size, 1)]
    near[faces[faces >= 0]] = True
    return near[: stencils.n]


def _stencils(mesh: Mesh) -> tuple[Stencils, Bools]:
    """Stencils of all vertices, those that a mask hides without faces; which ones are one fan of faces."""
    from quadcurv.kernels import topology

    if isinstance(mesh, QuadGrid) and mesh.mask is not None:
        known, (stencils, one_fan) = np.flatnonzero(~mesh.mask), _stencils(mesh.to_mesh())
        closed, present = np.zeros((2, mesh.mask.size), bool)
        closed[known], present[known] = stencils.closed, one_fan
        faces = known.astype(np.int32)[stencils.faces]
        points = mesh.points.reshape(-1, 3)
        return Stencils(points, faces, mesh.shape, closed, roundoff=mesh.roundoff), present
    stencils, present = mesh.stencils(), np.ones(mesh.stencils().n, bool)
    if isinstance(mesh, QuadMesh):
        kind = mesh.connectivity.kind
        present = (kind == topology.INTERIOR) | (kind == topology.BOUNDARY)
    return stencils, present


def _across(grid: StaggeredGrid) -> Ints:
    """(n, 4): the cells next to each, counter-clockwise, -1 where there is none."""
    index = np.arange(grid.stencils().n, dtype=np.int32).reshape(grid.shape)
    links = [np.roll(index, step, axis) for step, axis in ((-1, 0), (-1, 1), (1, 0), (1, 1))]
    for axis, wraps in enumerate(grid.wrap):
        if not wraps:
            links[axis].swapaxes(0, axis)[-1] = links[axis + 2].swapaxes(0, axis)[0] = -1
    return np.stack(links, axis=-1).reshape(-1, 4)


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
    if not around.completed:
        return found
    own = found.standard_error.mean
    error, noise = np.full((2, own.size), np.nan)
    for r, here in around.completed.items():
        at = np.full(own.size, True) if found.rings is None else found.rings == r
        error[at], noise[at] = np.fmax(error, here[0])[at], np.fmax(noise, here[1])[at]
    larger = error > own
    if not larger.any():
        return found
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
