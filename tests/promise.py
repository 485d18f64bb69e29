"""Meshes with exact curvature, damaged as people's meshes are, and what a scheme says of them.

A case is a surface, a damage, a scheme, a size, a scale, a turn and an offset, all drawn from a seed. Of
every finite value the error must be within

    10 E + explained

where E is the largest error that the scheme has on the undamaged mesh within four cells, and `explained` is
what the damage accounts for, vertex by vertex (see each damage); or, of fits on what tests/damages.py makes,
within twice the interval that they state; or the value is NaN; or a PrecisionWarning was given; or the vertex
is one of those that a ConsistencyWarning speaks of; or the mesh was refused, with an error that says why. Run
as a program it tries as many cases as asked for:

    python -m tests.promise 100000
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from scipy.spatial.transform import Rotation

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.boundary import one_rings
from quadcurv.schemes import SCHEMES
from quadcurv.schemes.consistency import FAR, FAR_ANYHOW, far_off
from quadcurv.stencils import grid_faces

SURFACES = (
    "torus",
    "dupin_cyclide",
    "ellipsoid",
    "catenoid",
    "hyperboloid",
    "elliptic_paraboloid",
    "enneper",
    "tanh_sheet",
)
CHOOSING = ("jet",)
NEAR = 4  # cells within which a fit may see what the undamaged mesh is off by


@dataclass
class Sample:
    """A grid on a surface: parameters (r, c), positions (r, c, 3), exact H (r, c), and which way it wraps."""

    surface: surfaces.Surface
    xi: np.ndarray
    eta: np.ndarray
    name: str = ""
    n: int = 0

    @cached_property
    def points(self):
        return self.surface.mapping(self.xi, self.eta)

    @cached_property
    def H(self):  # noqa: N802
        return self.surface.mean_curvature(self.xi, self.eta)

    @property
    def faces(self):
        index = np.arange(self.xi.size).reshape(self.xi.shape)
        return grid_faces(np.pad(index, [(0, int(w)) for w in self.surface.wrap], mode="wrap"))

    @cached_property
    def bend(self):
        """Largest principal curvature."""
        k1, k2 = self.surface.principal_curvatures(self.xi, self.eta)
        return float(max(np.abs(k1).max(), np.abs(k2).max()))

    @cached_property
    def edge(self):
        x = self.points
        return float(max(np.linalg.norm(np.diff(x, axis=a), axis=-1).max() for a in (0, 1)))


@dataclass
class Damaged:
    """What a damage makes: positions, a mesh of them, exact H at its vertices, what is explained.

    `noise` is the standard deviation of errors of the positions, whose part depends on the scheme.
    """

    points: np.ndarray
    mesh: Callable[[np.ndarray], object]
    H: np.ndarray
    explained: np.ndarray | float = 0.0
    noise: float = 0.0


@cache
def sample(name: str, n: int) -> Sample:
    surface = surfaces.SURFACES[name]()
    _, xi, eta = surface.sample((n, n))
    return Sample(surface, xi, eta, name, n)


@cache
def undamaged_error(name: str, n: int, scheme: str) -> np.ndarray:
    """(r, c): the largest error within `NEAR` cells, of positions as they are and rounded to 1e-7 edges.

    Polynomials in the index are exact where they are not rounded, as no other mesh is. Fits that choose for
    themselves are exact where all points lie on a quadric: one that is off it lets them take a quartic.
    """
    s, rng = sample(name, n), np.random.default_rng(0)
    error = np.zeros(s.xi.shape)
    for x in (s.points, s.points + 1e-7 * s.edge * rng.uniform(-1, 1, s.points.shape)):
        for fit in (scheme, *((qc.schemes.jet(4),) if scheme in CHOOSING else ())):
            H = qc.mean_curvature(qc.QuadGrid(x, s.surface.wrap), fit)
            error = np.maximum(error, np.abs(H - s.H))
    return windows(error, s.surface.wrap, NEAR).max(axis=(2, 3))


def windows(values: np.ndarray, wrap, reach: int) -> np.ndarray:
    """(r, c, 2 reach + 1, 2 reach + 1): what is around each place of a grid."""
    for axis, wraps in enumerate(wrap):
        pad = [(reach, reach) if a == axis else (0, 0) for a in (0, 1)]
        values = np.pad(values, pad, mode="wrap" if wraps else "edge")
    return np.lib.stride_tricks.sliding_window_view(values, (2 * reach + 1,) * 2)


@cache
def gain(name: str, n: int, scheme: str) -> float:
    """Standard deviation of H for noise of size 1: the largest of any vertex inside, by a few samples.

    A fit that chooses for itself must do no worse than a quadric over one ring, which no noise makes better.
    """
    if scheme in CHOOSING:
        return gain(name, n, "jet-2")
    s, rng = sample(name, n), np.random.default_rng(0)
    size = 1e-7 * s.edge

    def error(x):
        return qc.mean_curvature(qc.QuadGrid(x, s.surface.wrap), scheme)

    exact = error(s.points)
    off = [error(s.points + rng.normal(0, size, s.points.shape)) - exact for _ in range(8)]
    return float(np.sqrt(np.nanmean(np.square(off), axis=0))[2:-2, 2:-2].max()) / size


def by_noise(s, scheme, size):
    """What noise explains: 5 standard deviations inside, 3 times as much at sides, 10 times at corners.

    Fits read two rings, so that a side is two rows.
    """
    magnified = np.ones(s.xi.shape)
    for axis, wraps in enumerate(s.surface.wrap):
        if not wraps:
            np.moveaxis(magnified, axis, 0)[[0, 1, -2, -1]] *= 3
    magnified[magnified > 3] = 10
    return 5 * gain(s.name, s.n, scheme) * size * magnified


def around(s, faces, vertices, size, off):
    """What vertices (size,) are off by: `off` within two faces of some, and 0.02 k where strips end at them.

    These are the vertices of two rows along open sides within eight cells, where fits become one-sided.
    """
    mask = np.zeros(size, bool)
    mask[vertices] = True
    there = mask[: s.xi.size].reshape(s.xi.shape)
    strips = windows(there, s.surface.wrap, 8).any(axis=(2, 3)) & border(s, 2)
    for _ in range(2):
        mask = with_neighbours(mask, faces)
    return np.where(mask, off, np.append(0.02 * s.bend * strips, np.zeros(size - s.xi.size)))


def with_neighbours(mask, faces):
    """Vertices and those of the faces around them."""
    near = mask.copy()
    for face in faces:
        if mask[list(face)].any():
            near[list(face)] = True
    return near


def border(s, rows):
    """(r, c): mask of rows and columns along open sides."""
    mask = np.zeros(s.xi.shape, bool)
    for axis, wraps in enumerate(s.surface.wrap):
        if not wraps:
            np.moveaxis(mask, axis, 0)[[*range(rows), *range(-rows, 0)]] = True
    return mask


def steps(t):
    """Spacing of parameters around each, at least on one side."""
    return np.abs(np.gradient(t))


def jitter(s, rng):
    """Vertices moved within the surface by 5 to 20 % of the spacing: Laplacians are off by parts of k."""
    part = rng.choice([0.05, 0.1, 0.2])
    moved = Sample(
        s.surface,
        s.xi + part * rng.uniform(-1, 1, s.xi.shape) * np.abs(s.xi[1, 0] - s.xi[0, 0]),
        s.eta + part * rng.uniform(-1, 1, s.xi.shape) * np.abs(s.eta[0, 1] - s.eta[0, 0]),
    )
    return Damaged(
        moved.points, lambda x: qc.QuadGrid(x, s.surface.wrap), moved.H, explained=10 * part * s.bend
    )


def noise(s, rng):
    """Positions off the surface by noise of 1e-4 to 1e-2 edges: see `by_noise`."""
    size = rng.choice([1e-4, 1e-3, 1e-2]) * s.edge
    x = s.points + rng.normal(0, size, s.points.shape)
    return Damaged(x, lambda x: qc.QuadGrid(x, s.surface.wrap), s.H, noise=size)


def uneven_border(s, rng):
    """First cells 0.3 to 2 times as wide as the others: some of first order where the spacing jumps."""
    ratio, axis = rng.uniform(0.3, 2), rng.integers(2)
    if s.surface.wrap[axis]:
        axis = 1 - axis
    if s.surface.wrap[axis]:  # at 2 a row is where the one before it is
        ratio = min(ratio, 1.7)
    t = [s.xi[:, 0].copy(), s.eta[0].copy()]
    step = t[axis][1] - t[axis][0]
    t[axis][0] = t[axis][1] - ratio * step
    if rng.random() < 0.5:
        t[axis] = -t[axis][::-1] if not s.surface.wrap[axis] else t[axis]
    moved = Sample(s.surface, *np.meshgrid(*t, indexing="ij"))
    return Damaged(
        moved.points,
        lambda x: qc.QuadGrid(x, s.surface.wrap),
        moved.H,
        explained=0.11 * s.bend**2 * s.edge,  # jets on the even mesh have no error to add
    )


def faces_of(s):
    return [list(map(int, f)) for f in s.faces]


def inner_face(s, rng):
    """A face away from borders, and where it stands."""
    r, c = s.xi.shape
    i, j = rng.integers(4, r - 5), rng.integers(4, c - 5)
    corners = [i * c + j, (i + 1) * c + j, (i + 1) * c + j + 1, i * c + j + 1]
    faces = faces_of(s)
    return faces, next(k for k, f in enumerate(faces) if set(f) == set(corners)), (i, j)


def with_vertex(s, rng, where, off):
    """A quad cut into triangles about a further vertex at a place (u, v) within it, 0 to 1.

    What is explained is so much over the shortest side of the quad, at vertices within two faces.
    """
    faces, k, (i, j) = inner_face(s, rng)
    u, v = where
    xi = s.xi[i, j] + u * (s.xi[i + 1, j] - s.xi[i, j])
    eta = s.eta[i, j] + v * (s.eta[i, j + 1] - s.eta[i, j])
    new = s.xi.size
    quad = faces.pop(k)
    faces += [[quad[m], quad[(m + 1) % 4], new] for m in range(4)]
    points = np.vstack((s.points.reshape(-1, 3), s.surface.mapping(xi, eta)))
    H = np.append(s.H.ravel(), s.surface.mean_curvature(xi, eta))
    sides = points[quad] - points[np.roll(quad, 1)]
    local = off / np.linalg.norm(sides, axis=1).min()
    explained = around(s, faces, [*quad, new], H.size, local)
    return Damaged(points, lambda x: qc.QuadMesh(x, faces), H, explained)


def needle(s, rng):
    """A vertex 1e-12 to 1e-2 of an edge beside another one: Laplacians are off by some k around it."""
    d = 10.0 ** rng.uniform(-12, -2)
    return with_vertex(s, rng, (d, d), 1.0)


def cap(s, rng):
    """A vertex 1e-12 to 1e-2 of an edge beside an edge, on the surface: a flap that may stand upright on it.

    At its vertices H is then of the size of 1 / edge.
    """
    return with_vertex(s, rng, (rng.uniform(0.3, 0.7), 10.0 ** rng.uniform(-12, -2)), 2.0)


def hanging_node(s, rng):
    """A vertex in the middle of an edge, in one of its two faces: it lies on the chord, off the surface."""
    faces, k, _ = inner_face(s, rng)
    a, b = faces[k][:2]
    new = s.xi.size
    faces[k].insert(1, new)
    flat = s.points.reshape(-1, 3)
    points = np.vstack((flat, (flat[a] + flat[b]) / 2))
    # It is taken out again, and has no value.
    return Damaged(points, lambda x: qc.QuadMesh(x, faces), np.append(s.H.ravel(), np.inf))


def collapsed(s, rng):
    """A quad given with a vertex twice, in place of a triangle: the same as the triangle."""
    faces, k, _ = inner_face(s, rng)
    a, b, c, d = faces[k]
    faces[k] = [a, b, c, c]
    faces.append([a, c, d, d])
    explained = around(s, faces, [a, b, c, d], s.xi.size, 0.3 * s.bend)
    return Damaged(s.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, faces), s.H.ravel(), explained)


def turned(s, rng):
    """Some faces turned over."""
    faces = faces_of(s)
    for k in rng.choice(len(faces), rng.integers(1, 9), replace=False):
        faces[k] = [faces[k][0], *faces[k][:0:-1]]  # from the same vertex, where a diagonal may go
    return Damaged(s.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, faces), s.H.ravel())


def doubled(s, rng):
    """Some faces given twice."""
    faces = faces_of(s)
    faces += [faces[k] for k in rng.choice(len(faces), rng.integers(1, 9), replace=False)]
    return Damaged(s.points.reshape(-1, 3), lambda x: qc.QuadMesh(x, faces), s.H.ravel())


def fin(s, rng):
    """A quad standing on an edge: NaN at its ends, nothing elsewhere but for fewer neighbours."""
    faces, k, _ = inner_face(s, rng)
    a, b = faces[k][:2]
    n = s.xi.size
    flat = s.points.reshape(-1, 3)
    up = np.cross(flat[faces[k][2]] - flat[a], flat[faces[k][3]] - flat[b])
    up *= s.edge / np.linalg.norm(up)
    points = np.vstack((flat, flat[[a, b]] + up))
    faces.append([b, a, n, n + 1])
    H = np.append(s.H.ravel(), [np.nan, np.nan])  # of the fin's own vertices there is no exact H
    explained = around(s, faces, [a, b], n + 2, 0.05 * s.bend)
    return Damaged(points, lambda x: qc.QuadMesh(x, faces), H, explained)


def hole(s, rng):
    """Holes in a grid, masked or NaN: borders, on fitted surfaces where too few points are between two.

    Such surfaces tell the curvature of the points near: see `one_sided`. They are in two rows at
    borders up to five faces from a hole; nearer, fits are one-sided too.
    """
    points, hidden = s.points, np.zeros(s.xi.shape, bool)
    r, c = hidden.shape
    for _ in range(rng.integers(1, 3)):
        i, j = rng.integers(0, r - 2), rng.integers(0, c - 2)
        hidden[i : i + rng.integers(1, 4), j : j + rng.integers(1, 4)] = True
    given = points.copy()
    given[hidden] = np.nan
    mask = hidden if rng.random() < 0.5 else None
    beside, near_it = (windows(hidden, s.surface.wrap, k).any(axis=(2, 3)) for k in (2, 5))
    explained = np.where(beside | (border(s, 2) & near_it), one_sided(s), 0.0)
    return Damaged(given, lambda x: qc.QuadGrid(x, s.surface.wrap, mask=mask), s.H, explained)


def one_sided(s):
    """What fits to points on one side are off by: twice what the curvature varies within three edges.

    And (k edge)^2 of the curvature k, where it does not vary.
    """
    off = np.zeros(s.xi.shape)
    for k in s.surface.principal_curvatures(s.xi, s.eta):
        seen = windows(np.broadcast_to(k, s.xi.shape), s.surface.wrap, 3)
        off = np.maximum(off, np.abs(seen - k[..., None, None]).max(axis=(2, 3)))
    return 2 * off + (s.bend * s.edge) ** 2 * s.bend


def single_precision(s, rng):
    """Positions in single precision: eps |x| / h^2."""
    least = min(np.linalg.norm(np.diff(s.points, axis=a), axis=-1).min() for a in (0, 1))
    explained = 4 * np.finfo(np.float32).eps * np.abs(s.points).max() / least**2
    return Damaged(
        s.points, lambda x: qc.QuadGrid(x.astype(np.float32), s.surface.wrap), s.H, explained=explained
    )


def far_away(s, rng):
    """A mesh far from the origin: eps |x| / h^2."""
    offset = 10.0 ** rng.uniform(3, 9)
    least = min(np.linalg.norm(np.diff(s.points, axis=a), axis=-1).min() for a in (0, 1))
    return Damaged(
        s.points + offset,
        lambda x: qc.QuadGrid(x, s.surface.wrap),
        s.H,
        explained=4 * np.finfo(float).eps * offset / least**2,
    )


def repeated_row(s, rng):
    """A wrap whose first row is given once more at the end."""
    axis = int(np.argmax(s.surface.wrap)) if any(s.surface.wrap) else rng.integers(2)
    wrap = tuple(w or i == axis for i, w in enumerate(s.surface.wrap))
    x = np.concatenate((s.points, s.points.take([0], axis)), axis)
    return Damaged(x, lambda x: qc.QuadGrid(x, wrap), np.full(x.shape[:2], np.nan))


def pole(s, rng):
    """A sphere to its poles, rows of one point but for rounding: right beside the pole, there to 5 %."""
    n = s.xi.shape[0]
    p, t = np.meshgrid(
        np.linspace(0, np.pi, n), np.linspace(0, 2 * np.pi, 2 * n, endpoint=False), indexing="ij"
    )
    x = np.stack((np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)), axis=-1)
    wrap = (False, True)
    H = np.ones(p.shape)
    if rng.random() < 0.5:
        x, wrap, H = x.swapaxes(0, 1)[::-1], (True, False), H.T
    explained = np.full(H.shape, 0.05)
    return Damaged(x, lambda x: qc.QuadGrid(x, wrap), H, explained)


DAMAGES = (
    jitter,
    noise,
    uneven_border,
    needle,
    cap,
    hanging_node,
    collapsed,
    turned,
    doubled,
    fin,
    hole,
    single_precision,
    far_away,
    repeated_row,
    pole,
)


def verdict(seed: int) -> tuple[str, str]:
    """How a case ended ("right", "NaN", "warned", "refused", "wrong", "changed"), and what it was."""
    from tests import damages

    later = seed >= damages.LATER
    drawn = damages.DAMAGES if later else DAMAGES
    rng = np.random.default_rng(seed)
    name, n = str(rng.choice(SURFACES)), int(rng.choice([14, 20]))
    damage, scheme = drawn[rng.integers(len(drawn))], str(rng.choice(list(SCHEMES)))
    s = sample(name, n)
    damaged = damage(s, rng)
    scale = 10.0 ** rng.integers(-6, 7)
    plain = damage in (far_away, single_precision, *damages.AS_GIVEN)
    turn = np.eye(3) if plain else Rotation.random(rng=rng).as_matrix()
    points = scale * (damaged.points @ turn.T)
    what = f"{seed}: {scheme} on {name} {n}, {damage.__name__}, scale {scale:g}"
    before = points.copy()
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        try:
            mesh = damaged.mesh(points)
            H = qc.mean_curvature(mesh, scheme)
        except qc.MeshError as error:
            return "refused", f"{what}: {error}"
    if not np.array_equal(points, before, equal_nan=True):
        return "changed", what
    error = np.abs(H * scale - damaged.H)
    own = undamaged_error("sphere" if damage in (pole, damages.pole_of_faces) else name, n, scheme)
    if own.shape != error.shape:  # further vertices, behind the others
        own = np.append(own, np.full(max(error.size - own.size, 0), own.max()))
        own = own.reshape(error.shape) if own.size == error.size else own.max()
    explained = damaged.explained
    if damage in (needle, cap):  # beyond that it must be told
        most = FAR if SCHEMES[scheme].order else FAR_ANYHOW
        explained = np.minimum(
            explained, 1.25 * most * s.bend
        )  # rings are of no paraboloid, on coarse meshes
    allowed = 10 * own + explained + 1e-9
    if damaged.noise:
        allowed = allowed + by_noise(s, scheme, damaged.noise)
    wrong = error > allowed  # infinite where a value is one too many
    if later and scheme in CHOOSING and wrong.any():
        stated = np.asarray(qc.curvatures(mesh, scheme).interval.mean) * scale
        wrong &= ~(error <= 2 * stated)
    if wrong.any() and any(issubclass(warning.category, qc.ConsistencyWarning) for warning in said):
        stencils = one_rings(mesh)
        told = far_off(stencils, SCHEMES[scheme])[0]
        if wrong.size == stencils.n:  # grids with holes have fewer
            wrong.ravel()[told] = False
    if not wrong.any():
        return ("right" if np.isfinite(H).mean() > 0.5 else "NaN"), what
    if any(issubclass(warning.category, qc.PrecisionWarning) for warning in said):
        return "warned", what
    at = np.unravel_index(np.argmax(np.where(wrong, error - allowed, 0)), error.shape)
    return "wrong", (
        f"{what}: {np.count_nonzero(wrong)} wrong, at {tuple(map(int, at))} off by {error[at]:.3g}, "
        f"allowed {np.broadcast_to(allowed, error.shape)[at]:.3g}"
    )


def main(count: int, start: int = 0) -> None:
    """Print how many cases ended how, and those that must not be."""
    ends = Counter()
    for seed in range(start, start + count):
        try:
            end, what = verdict(seed)
        except Exception as error:  # what must not be
            end, what = "crashed", f"{seed}: {type(error).__name__}: {error}"
        ends[end] += 1
        if end in ("wrong", "changed", "crashed"):
            print(what, flush=True)
        if (seed + 1 - start) % 1000 == 0:
            print(seed + 1 - start, dict(ends), flush=True)
    print(dict(ends))


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
