"""Meshes of surfaces whose curvature is known at every point: smooth, uneven, noisy, coarse and creased."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import ConvexHull

from quadcurv import QuadGrid, QuadMesh
from quadcurv.surfaces import Surface, cubed_sphere, dupin_cyclide, pillow_sphere, torus

Array = NDArray[np.float64]
AXES = (1.0, 0.8, 1.3)
"""Of the ellipsoid."""


@dataclass(frozen=True)
class Case:
    """A mesh and the exact curvature at its vertices, NaN where the surface has none (on creases).

    Attributes
    ----------
    mesh : QuadMesh
    H, K : (n,) float64
        In 1 / length and 1 / length^2.
    """

    mesh: QuadMesh
    H: Array
    K: Array

    @property
    def k1(self) -> Array:
        """Exact k1 >= k2 in 1 / length."""
        return self.H + np.sqrt(np.maximum(self.H**2 - self.K, 0))

    @property
    def k2(self) -> Array:
        """Exact k2 <= k1 in 1 / length."""
        return 2 * self.H - self.k1

    @property
    def spacing(self) -> float:
        """Mean length of the edges."""
        return mean_edge(self.mesh)

    def noisy(self, level: float, seed: int = 0) -> Case:
        """Positions with Gaussian noise in all directions, its standard deviation in spacings."""
        noise = np.random.default_rng(seed).normal(0, level * self.spacing, self.mesh.points.shape)
        return replace(self, mesh=QuadMesh(self.mesh.points + noise, self.mesh.faces))


# Surfaces in space -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Quartic:
    """The surface s.B s + q.s + p.x + c = 0 with s = (x^2, y^2, z^2), its normal along the gradient.

    Curvature at any of its points needs no parameters: R. Goldman (2005), Curvature formulas for implicit
    curves and surfaces, Computer Aided Geometric Design 22, 632-658, (4.1) and (4.2).
    """

    B: Array
    q: Array
    p: Array = field(default_factory=lambda: np.zeros(3))
    c: float = -1.0

    def _gradient(self, x: Array) -> tuple[Array, Array]:
        s, B = x**2, self.B
        inner = 2 * s @ B + self.q
        return (s @ B * s + s * self.q + x * self.p).sum(axis=1) + self.c, 2 * x * inner + self.p

    def projected(self, x: Array) -> Array:
        """Points of the surface near to given ones, by Newton's method along the gradient."""
        for _ in range(20):
            value, gradient = self._gradient(x)
            x = x - (value / (gradient**2).sum(axis=1))[:, None] * gradient
        return x

    def _hessian(self, x: Array) -> Array:
        hessian = 8 * x[:, :, None] * x[:, None, :] * self.B
        hessian[:, range(3), range(3)] += 4 * x**2 @ self.B + 2 * self.q
        return hessian

    def direction1(self, x: Array) -> Array:
        """Unit tangents of k1 at points of the surface, either way round."""
        _, g = self._gradient(x)
        n = g / np.linalg.norm(g, axis=1)[:, None]
        across = np.eye(3) - n[:, :, None] * n[:, None, :]
        # Along the normal far below any curvature.
        shape = across @ self._hessian(x) @ across
        shape -= 1e3 * np.abs(shape).max(axis=(1, 2))[:, None, None] * n[:, :, None] * n[:, None, :]
        return np.linalg.eigh(shape)[1][:, :, 2]

    def case(self, mesh: QuadMesh) -> Case:
        """Exact curvature at the vertices of a mesh that lie on the surface."""
        x = np.asarray(mesh.points)
        _, g = self._gradient(x)
        hessian = self._hessian(x)
        size = np.linalg.norm(g, axis=1)
        trace = np.trace(hessian, axis1=1, axis2=2)
        H = (size**2 * trace - np.einsum("ni,nij,nj->n", g, hessian, g)) / (2 * size**3)
        rows = [np.cross(hessian[:, (i + 1) % 3], hessian[:, (i + 2) % 3]) for i in range(3)]
        K = np.einsum("ni,nij,nj->n", g, np.stack(rows, axis=1), g) / size**4
        return Case(mesh, H, K)

    def jittered(self, mesh: QuadMesh, amount: float, seed: int = 0) -> Case:
        """Vertices moved within the surface, by up to so many spacings in both directions."""
        x = np.asarray(mesh.points)
        _, g = self._gradient(x)
        n = g / np.linalg.norm(g, axis=1)[:, None]
        by = np.random.default_rng(seed).uniform(-1, 1, x.shape) * amount * mean_edge(mesh)
        return self.case(QuadMesh(self.projected(x + by - (by * n).sum(axis=1)[:, None] * n), mesh.faces))


def ellipsoid(axes: Sequence[float] = AXES) -> Quartic:
    """Ellipsoid of these half axes."""
    return Quartic(np.zeros((3, 3)), 1 / np.asarray(axes) ** 2)


def ring(major: float = 2.0, minor: float = 1.0) -> Quartic:
    """Torus around the axis of z."""
    d = major**2 - minor**2
    q = 2 * d - 4 * major**2 * np.array((1.0, 1.0, 0.0))
    return Quartic(np.ones((3, 3)), q, c=d**2)


STAR = Quartic(np.diag((1.0, 1.1, 0.9)), np.full(3, -0.3))
"""Star-shaped around the origin, with eight humps and six dents."""


# Meshes -----------------------------------------------------------------------------------------------------


def mean_edge(mesh: QuadMesh) -> float:
    """Mean length of the edges, those of two faces twice."""
    faces = mesh.faces
    following = np.roll(faces, -1, axis=1)
    following[faces[:, 3] < 0, 2] = faces[faces[:, 3] < 0, 0]
    known = (faces >= 0) & (following >= 0)
    ends = mesh.points[following[known]] - mesh.points[faces[known]]
    return float(np.linalg.norm(ends, axis=1).mean())


def cubed(n: int, axes: Sequence[float] = AXES) -> QuadMesh:
    """Cubed ellipsoid of n x n quads a panel, 6 n^2 + 2 vertices."""
    ball = cubed_sphere().sample((n, n), "faces")[0]
    return QuadMesh(ball.points * axes, ball.faces)


def prism(sides: int) -> tuple[Array, list[list[int]]]:
    """Corners and faces of a prism over a regular polygon."""
    angles = 2 * np.pi * np.arange(sides) / sides
    base = np.stack((np.cos(angles), np.sin(angles)), axis=1)
    corners = np.concatenate([np.c_[base, np.full(sides, z)] for z in (-0.8, 0.8)])
    around = [[i, (i + 1) % sides, sides + (i + 1) % sides, sides + i] for i in range(sides)]
    return corners, [*around, list(range(sides))[::-1], list(range(sides, 2 * sides))]


def dodecahedron() -> tuple[Array, list[list[int]]]:
    """Corners and faces of the regular dodecahedron."""
    g = (1 + np.sqrt(5)) / 2
    signs = np.array(np.meshgrid([-1, 1], [-1, 1])).reshape(2, -1).T
    ico = np.concatenate([np.roll(np.c_[np.zeros(4), signs * (1, g)], k, axis=1) for k in range(3)])
    hull = ConvexHull(ico)
    corners = ico[hull.simplices].mean(axis=1)
    faces = []
    for i, axis in enumerate(ico):
        around = np.flatnonzero((hull.simplices == i).any(axis=1))
        first = np.cross(axis, corners[around[0]])
        angle = np.arctan2(corners[around] @ first, corners[around] @ np.cross(first, axis))
        faces.append(around[np.argsort(angle)].tolist())
    outward = [np.linalg.det(corners[f[:3]]) > 0 for f in faces]
    return corners, [f if out else f[::-1] for f, out in zip(faces, outward, strict=True)]


def catmull_clark(solid: tuple[Array, Sequence[Sequence[int]]], levels: int) -> QuadMesh:
    """Quads by subdivision, smoothed as by E. Catmull and J. Clark (1978), of a closed solid."""
    points, faces = solid
    for _ in range(levels):
        n, m = len(points), len(faces)
        sides = np.array([len(f) for f in faces])
        corner, face = np.concatenate([np.asarray(f) for f in faces]), np.repeat(np.arange(m), sides)
        last = np.cumsum(sides) - 1
        following = np.roll(corner, -1)
        following[last] = corner[last - sides + 1]
        pairs, edge = np.unique(np.sort(np.c_[corner, following], axis=1), axis=0, return_inverse=True)
        edge = edge.ravel()
        centre = _sums(face, points[corner], m) / sides[:, None]
        middle = points[pairs].sum(axis=1)
        edge_point = (middle + _sums(edge, centre[face], len(pairs))) / 4
        valence = np.bincount(corner)[:, None]
        around = _sums(corner, centre[face], n) / valence
        beside = _sums(pairs.ravel(), np.repeat(middle / 2, 2, axis=0), n) / valence
        vertex = (around + 2 * beside + (valence - 3) * points) / valence
        previous = np.roll(edge, 1)
        previous[last - sides + 1] = edge[last]
        points = np.concatenate((vertex, edge_point, centre))
        faces = np.c_[corner, n + edge, n + len(pairs) + face, n + previous]
    return QuadMesh(points, faces)


def _sums(index: ArrayLike, values: Array, size: int) -> Array:
    return np.stack([np.bincount(index, values[:, k], size) for k in range(3)], axis=1)


def on(surface: Quartic, mesh: QuadMesh) -> Case:
    """The mesh brought to a surface nearby."""
    return surface.case(QuadMesh(surface.projected(np.asarray(mesh.points)), mesh.faces))


def mixed(case: Case, share: float = 0.3, seed: int = 0) -> Case:
    """The same with so many of the quads cut into triangles."""
    faces = case.mesh.faces
    cut = np.random.default_rng(seed).random(len(faces)) < share
    quads = faces[cut]
    padded = np.full((2 * len(quads), 4), -1)
    padded[:, :3] = np.concatenate((quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]))
    return replace(case, mesh=QuadMesh(case.mesh.points, np.concatenate((faces[~cut], padded))))


def sampled(surface: Surface, xi: Array, eta: Array, wrap: tuple[bool, bool] = (False, False)) -> Case:
    """A grid of parameters on a surface, as faces."""
    mesh = QuadGrid(surface.mapping(xi, eta), wrap).to_mesh()
    return Case(mesh, surface.mean_curvature(xi, eta).ravel(), surface.gaussian_curvature(xi, eta).ravel())


def welded(surface: Surface, shape: tuple[int, int]) -> Case:
    """All panels of a surface, welded."""
    mesh, xi, eta = surface.sample(shape, "faces")
    return Case(mesh, surface.mean_curvature(xi, eta), surface.gaussian_curvature(xi, eta))


def ring_grid(rows: int, columns: int, skew: float = 0.0) -> Case:
    """Torus of rows along its large circle, slanted where asked."""
    xi, eta = _circles(rows, columns)
    return sampled(torus(), xi + skew * np.sin(eta), eta, (True, True))


def cyclide(rows: int, columns: int) -> Case:
    """The cyclide of Dupin."""
    return sampled(dupin_cyclide(), *_circles(rows, columns), (True, True))


def _circles(rows: int, columns: int) -> tuple[Array, Array]:
    ends = (2 * np.pi * np.arange(n) / n for n in (rows, columns))
    u, v = np.meshgrid(*ends, indexing="ij")
    return u, v


PATCH = Surface.from_mapping(
    lambda u, v: (u + 0.1 * v**2, v - 0.1 * u * v, 0.4 * np.sin(1.7 * u) * np.cos(1.3 * v) + 0.2 * u * v),
    ((-1.0, 1.0), (-1.0, 1.0)),
    name="open patch",
)


def patch(n: int, jitter: float = 0.0, seed: int = 0) -> Case:
    """Open patch of (n + 1)^2 vertices, moved along it by up to so many spacings, borders too."""
    u, v = np.meshgrid(*[np.linspace(-1, 1, n + 1)] * 2, indexing="ij")
    by = np.random.default_rng(seed).uniform(-1, 1, (2, *u.shape)) * jitter * 2 / n
    return sampled(PATCH, u + by[0], v + by[1])


def fan(valence: int, n: int) -> Case:
    """Open patch of so many sectors of n x n rhombi around one vertex."""
    s, t = np.meshgrid(*[np.arange(n + 1) / n] * 2, indexing="ij")
    turns = 2 * np.pi * np.arange(valence) / valence
    arms = 0.8 * np.stack((np.cos(turns), np.sin(turns)), axis=1)
    flat = [s[..., None] * arms[i] + t[..., None] * arms[(i + 1) % valence] for i in range(valence)]
    place = np.stack(flat).reshape(-1, 2)
    index = np.arange(len(place)).reshape(valence, n + 1, n + 1)
    quads = np.stack((index[:, :-1, :-1], index[:, 1:, :-1], index[:, 1:, 1:], index[:, :-1, 1:]), axis=-1)
    _, first, label = np.unique(np.rint(place * 1e9), axis=0, return_index=True, return_inverse=True)
    u, v = place[first].T
    mesh = QuadMesh(PATCH.mapping(u, v), label.ravel()[quads.reshape(-1, 4)])
    return Case(mesh, PATCH.mean_curvature(u, v), PATCH.gaussian_curvature(u, v))


def bump(n: int, cells: float = 5.0, height: float = 0.03) -> Case:
    """Gaussian bump on a plane, so many cells wide between its points of inflection and twice so high."""
    width = cells * 2 / n / 2
    surface = Surface.from_mapping(
        lambda u, v: (u, v, height * np.exp(-(u**2 + v**2) / (2 * width**2))), ((-1.0, 1.0), (-1.0, 1.0))
    )
    u, v = np.meshgrid(*[np.linspace(-1, 1, n + 1)] * 2, indexing="ij")
    return sampled(surface, u, v)


def pillow(n: int) -> Case:
    """Pillow sphere with its folds."""
    return welded(pillow_sphere(), (2 * n, n))


def fillet(n: int = 20, cells: int = 8, radius: float = 0.2) -> Case:
    """Cube of n flat cells a side, edges and corners rounded by so many cells over their 90 degrees.

    The curvature jumps along the lines where flat, round and spherical parts meet: NaN there.
    """
    flat = 1 - radius
    bend = radius * np.tan(np.linspace(0, np.pi / 4, cells // 2 + 1)[1:])
    line = np.concatenate((-flat - bend[::-1], np.linspace(-flat, flat, n + 1), flat + bend))
    ball = cubed_sphere().sample((line.size - 1,) * 2, "faces")[0]
    # The panels of a cubed sphere are even in angles; what is at each step of those goes to our lines.
    cube = ball.points / np.abs(ball.points).max(axis=1)[:, None]
    step = np.arctan(cube) * 2 / np.pi + 0.5
    q = line[np.rint(step * (line.size - 1)).astype(int)]
    inner = np.clip(q, -flat, flat)
    away = q - inner
    points = inner + radius * away / np.linalg.norm(away, axis=1)[:, None]
    round_axes = (np.abs(q) > flat + 1e-12).sum(axis=1)
    H = np.choose(round_axes - 1, (0, 1 / (2 * radius), 1 / radius)).astype(float)
    K = np.where(round_axes == 3, 1 / radius**2, 0.0)
    border = (np.abs(np.abs(q) - flat) < 1e-12).any(axis=1)
    H[border], K[border] = np.nan, np.nan
    return Case(QuadMesh(points, ball.faces), H, K)


def crease(degrees: float, n: int = 32, curved: float = 0.3) -> tuple[Case, NDArray[np.int64]]:
    """Two sheets, mirror images, that meet along a line of the grid at an angle; how many rows off it.

    Each is a graph over its half plane, straight along the crease's slope and bent along and across it.
    """
    slope = np.tan(np.deg2rad(degrees) / 2)
    side = Surface.from_mapping(
        lambda u, v: (u, v, -slope * u + curved * (0.5 * v**2 - u**2 + 0.4 * u**2 * v)),
        ((-1.0, 1.0), (-1.0, 1.0)),
    )
    u, v = np.meshgrid(np.linspace(-1, 1, n + 1), np.linspace(-1, 1, n + 1), indexing="ij")
    found = sampled(side, np.abs(u), v)
    mirrored = found.mesh.points * np.where(u.ravel() < 0, -1, 1)[:, None] ** np.array([1, 0, 0])
    off = np.abs(np.arange(n + 1) - n // 2)[:, None] + np.zeros_like(u, int)
    H, K = np.where(off.ravel() == 0, np.nan, (found.H, found.K))
    return Case(QuadMesh(mirrored, found.mesh.faces), H, K), off.ravel()


def knife(n: int = 12, thickness: float = 1e-5) -> QuadMesh:
    """A plate of unit size and so little thickness, a cube of n cells a side pressed flat."""
    ball = cubed_sphere().sample((n, n), "faces")[0]
    cube = np.arctan(ball.points / np.abs(ball.points).max(axis=1)[:, None]) * 4 / np.pi
    return QuadMesh(cube * (0.5, 0.5, thickness / 2), ball.faces)


def open_cylinder(around: int, along: int, radius: float = 1.0) -> Case:
    """Cylinder of few cells, open at both ends."""
    angle, height = np.meshgrid(
        2 * np.pi * np.arange(around) / around, np.linspace(0, 2, along), indexing="ij"
    )
    points = np.stack((radius * np.cos(angle), radius * np.sin(angle), height), axis=-1)
    mesh = QuadGrid(points, (True, False)).to_mesh()
    return Case(mesh, np.full(len(mesh.points), 0.5 / radius), np.zeros(len(mesh.points)))
