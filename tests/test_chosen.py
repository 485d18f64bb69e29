"""The default fit, chosen vertex by vertex: orders, error bars, coarse meshes, borders."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.stats import spearmanr
from test_jet import box, noisy, sampled

import quadcurv as qc
from comparisons import accuracy, cases
from quadcurv import surfaces
from quadcurv.boundary.lines import extended
from quadcurv.boundary.septic import sharpened
from quadcurv.drivers.fits import MeshNeighbourhoods
from quadcurv.estimate import disagreement
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import jet

# ---- convergence ---------------------------------------------------------------------------------------

ORDERS = [
    ("tanh_sheet", "grid", 0, (32, 64, 128), 5.5, 1.2e-7),
    ("hyperboloid", "grid", 0, (12, 16, 24, 32), 7.7, 6e-9),
    ("catenoid", "grid", 0, (12, 16, 24, 32), 7.7, 6e-9),
    ("torus", "grid", 0, (12, 16, 24, 32), 7.7, 6e-9),
    ("dupin_cyclide", "grid", 0, (12, 16, 24, 32), 7.5, 1e-5),
    ("dupin_cyclide", "grid", 0, (32, 64, 128), 6.2, 1e-9),
    ("ellipsoid", "grid", 0, (12, 16, 24, 32), 7.7, 6e-9),
    ("cubed_ellipsoid", "faces", 0, (16, 32, 64), 5.3, 1.4e-7),
    # Lines of the mesh are of no use from here on.
    ("torus", "grid", 0.01, (32, 64, 128), 4.7, 2.8e-6),
    ("dupin_cyclide", "grid", 0.01, (32, 64, 128), 4.1, 4.5e-5),
    ("ellipsoid", "grid", 0.01, (32, 64, 128), 5.5, 8e-7),
    ("cubed_ellipsoid", "faces", 0.01, (16, 32, 64), 5.3, 1.4e-7),
    ("elliptic_paraboloid", "grid", 0.2, (32, 64, 128), 4.2, 2e-6),
    ("tanh_sheet", "grid", 0.2, (32, 64, 128), 4.1, 8e-6),
    ("enneper", "grid", 0.2, (32, 64, 128), 3.8, 8e-5),
    ("hyperboloid", "grid", 0.2, (32, 64, 128), 2.8, 3e-5),
    ("torus", "grid", 0.2, (32, 64, 128), 4.2, 1e-5),
    ("dupin_cyclide", "grid", 0.2, (32, 64, 128), 4.1, 1.4e-4),
    ("cubed_ellipsoid", "faces", 0.2, (16, 32, 64), 4.8, 1e-6),
]


@pytest.mark.parametrize(("name", "layout", "jitter", "sizes", "rate", "bound"), ORDERS)
def test_order(name, layout, jitter, sizes, rate, bound):
    """In the inf-norm, borders, seams and vertices of valence 3 included; vertices moved along it."""
    errors = []
    for n in sizes:
        mesh, exact = sampled(name, n, jitter, layout)
        found = qc.curvatures(mesh)
        assert not (jitter and n > sizes[0] and (found.degree == 8).any())
        errors.append(np.abs(found.mean - exact).max())
    assert errors[-1] < bound
    assert fitted_rate(sizes, errors) > rate


@pytest.mark.parametrize(
    ("case", "H", "K"),
    [
        (cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), 4)), 4e-4, 1.5e-3),
        (cases.patch(34, 0.2, 11), 1e-5, 1e-5),
        (cases.cyclide(48, 48), 3e-4, 6e-4),
    ],
    ids=["star", "patch", "cyclide"],
)
def test_spheres_are_left_where_planes_do_better(case, H, K):
    """On saddles, dents and graphs spheres make terms of higher degree: errors were 2 to 5 times as large."""
    found = qc.curvatures(case.mesh)
    assert np.abs(found.mean - case.H).mean() < H
    assert np.abs(found.gaussian - case.K).mean() < K


@pytest.mark.parametrize("jitter", [0.0, 0.2])
def test_a_tenth_of_the_error_of_plain_fits(jitter):
    mesh, exact = sampled("cubed_ellipsoid", 24, jitter, "faces")
    error, plain = (np.abs(qc.mean_curvature(mesh, s) - exact) for s in ("jet", jet(4)))
    assert error.mean() < 0.03 * plain.mean()
    assert error.max() < 0.1 * plain.max()


@pytest.mark.parametrize("layout", ["faces", "grid"])
def test_spheres_are_exact(layout):
    """To rounding; where a grid ends around a pole ghosts are not."""
    for n in (6, 16):
        surface = surfaces.cubed_sphere(2.0) if layout == "faces" else surfaces.sphere(2.0)
        mesh, _, _ = surface.sample((n, n), layout)
        found = qc.curvatures(mesh)
        inside = slice(None) if layout == "faces" else np.s_[:, 3:-3]
        assert np.abs(found.mean - 0.5)[inside].max() < 1e-7
        assert np.abs(found.gaussian - 0.25)[inside].max() < 1e-7


def test_grids_and_face_lists_agree():
    mesh, _ = sampled("tanh_sheet", 24)
    grid, faces = qc.curvatures(mesh), qc.curvatures(mesh.to_mesh())
    assert np.abs(grid.mean.ravel() - faces.mean).max() < 1e-7
    assert np.array_equal(grid.degree.ravel(), faces.degree)


def test_fine_meshes_lose_no_more_to_rounding():
    grid, exact = sampled("elliptic_paraboloid", 512)
    error, plain = (np.abs(qc.mean_curvature(grid, s) - exact)[8:-8, 8:-8] for s in ("jet", jet(4)))
    assert error.max() < plain.max()


# ---- coarse meshes -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("n", "bound"), [(2, 1e-9), (4, 5e-3), (8, 1e-3)])
def test_coarse_ellipsoids(n, bound):
    """Of 26, 98 and 386 vertices, the axes 1.3 : 1 : 0.8."""
    axes = np.array([1, 0.8, 1.3])
    mesh = surfaces.cubed_sphere().sample((n, n), "faces")[0]
    points = mesh.points * axes
    support = 1 / np.linalg.norm(points / axes**2, axis=1)
    exact = support**3 * (np.sum(axes**2) - np.sum(points**2, axis=1)) / (2 * np.prod(axes) ** 2)
    error = np.abs(qc.mean_curvature(mesh.with_points(points)) - exact)
    assert error.mean() < bound


@pytest.mark.parametrize(("shape", "bound"), [((6, 4), 1e-9), ((8, 5), 1e-9), ((10, 5), 1e-9)])
def test_low_cylinders(shape, bound):
    grid, _, _ = surfaces.cylinder().sample(shape)
    assert np.abs(qc.mean_curvature(grid) - 0.5).max() < bound


@pytest.mark.parametrize("n", [12, 20, 40])
def test_nothing_is_undefined_on_random_points_of_a_sphere(n):
    points = np.random.default_rng(1).normal(size=(n, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    faces = ConvexHull(points).simplices
    a, b, c = points[faces].swapaxes(0, 1)
    inward = np.einsum("fx,fx->f", np.cross(b - a, c - a), a) < 0
    faces[inward] = faces[inward, ::-1]
    error, peer = (np.abs(qc.mean_curvature((points, faces), s) - 1) for s in ("jet", "cotan-6"))
    assert error.mean() < peer.mean()


# ---- creases, and jumps of curvature -------------------------------------------------------------------


def roof(degrees, n=33, curved=1.0):
    """Two halves of z = -s |x| - y^2 / 2 that meet at an angle, and H of each."""
    slope = np.tan(np.radians(degrees) / 2)
    x, y = np.meshgrid(*[np.linspace(-1, 1, n)] * 2, indexing="ij")
    x = x / np.hypot(1, slope)
    grid = qc.QuadGrid(np.stack((x, y, -slope * np.abs(x) - curved * y * y / 2), axis=-1))
    return grid, (1 + slope**2) * curved / (2 * (1 + slope**2 + (curved * y) ** 2) ** 1.5)


@pytest.mark.parametrize("degrees", [10, 30, 60, 90])
@pytest.mark.parametrize("layout", ["grid", "faces"])
def test_creases_are_flagged_and_not_looked_across(degrees, layout):
    grid, exact = roof(degrees)
    found = qc.curvatures(grid if layout == "grid" else grid.to_mesh())
    feature, mean = (x.reshape(grid.shape) for x in (found.feature, found.mean))
    assert np.array_equal(feature.any(axis=1), np.arange(33) == 16)
    assert feature[16].all()
    error, best = np.abs(mean - exact), np.abs(qc.mean_curvature(grid, "liu") - exact)
    assert error[[15, 17], 4:-4].max() < 5e-6 < best[[15, 17], 4:-4].max() / 10


def test_flat_sides_of_a_cube_are_flat():
    mesh, sides = box(5)
    found = qc.curvatures(mesh)
    assert np.array_equal(found.feature, sides > 1)
    assert np.abs(found.mean[sides == 1]).max() < 1e-12
    assert (found.mean[sides > 1] > 4.5).all()


@pytest.mark.parametrize("cells", [4, 8])
def test_fillets(cells):
    """An arc between its two tangents, of H = 0, 1 / 2 and 0."""
    s, t = np.linspace(-1, 0, 11)[:-1], np.linspace(0, np.pi / 2, cells + 1)
    profile = np.concatenate(
        [
            np.stack([s, 0 * s + 1], axis=1),
            np.stack([np.sin(t), np.cos(t)], axis=1),
            np.stack([0 * s + 1, s], axis=1)[::-1],
        ]
    )
    x, y = np.meshgrid(np.arange(len(profile)), np.linspace(0, 2, 21), indexing="ij")
    grid = qc.QuadGrid(np.stack((profile[x, 0], y, profile[x, 1]), axis=-1)[:, ::-1])
    found = qc.curvatures(grid)
    flat = np.r_[0:9, len(profile) - 9 : len(profile)]
    assert np.abs(found.mean[flat]).max() < 1e-9
    assert np.abs(np.abs(found.mean[11 : 10 + cells]) - 0.5).max() < 3e-4
    assert not found.feature.any()


@pytest.mark.parametrize("name", surfaces.SURFACES)
def test_nothing_smooth_is_a_feature(name):
    for n in (16, 64):
        mesh, _, _ = surfaces.SURFACES[name]().sample((n, n), "faces" if "cubed" in name else "grid")
        around = MeshNeighbourhoods(mesh, "nan")
        assert not around.on_crease.any()
        assert not around.on_jump.any()


@pytest.mark.parametrize("noise", [1e-3, 1e-2, 5e-2])
def test_noise_is_no_feature(noise):
    mesh, _ = noisy("cubed_ellipsoid", 24, noise)
    around = MeshNeighbourhoods(mesh, "nan")
    assert around.on_crease.sum() + around.on_jump.sum() < 5


# ---- error bars ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("noise", [1e-4, 1e-3, 1e-2, 5e-2, 0.3])
@pytest.mark.parametrize(("name", "n"), [("torus", 64), ("cubed_ellipsoid", 24), ("enneper", 48)])
def test_intervals_cover(name, n, noise):
    mesh, exact = noisy(name, n, noise)
    found = qc.curvatures(mesh)
    assert 0.92 < np.mean(np.abs(found.mean - exact[0]) <= found.interval.mean) < 0.997


HUMPS = cases.Quartic(np.diag((1.2, 0.9, 1.0)), np.array((-0.35, -0.25, -0.3)))


@pytest.mark.parametrize("noise", [0.05, 0.1])
def test_intervals_cover_on_humps(noise):
    """Where terms that are not looked at are alike round the vertex, and bias is largest; all quantities."""
    smooth = cases.on(HUMPS, cases.cubed(18, (1, 1, 1)))
    found = qc.curvatures(smooth.noisy(noise, 101).mesh)
    exact = smooth.H, smooth.K, smooth.k1, smooth.k2
    values = found.mean, found.gaussian, found.k1, found.k2
    for value, true, half in zip(values, exact, found.interval, strict=True):
        assert np.mean(np.abs(value - true) <= half) > 0.9


@pytest.mark.parametrize(
    ("case", "most"),
    [
        (cases.on(cases.ellipsoid(), cases.cubed(16)), 3.5),
        (cases.ellipsoid().jittered(cases.cubed(16), 0.2), 3.0),
        (cases.cyclide(48, 48), 3.0),
        (cases.ring().jittered(cases.ring_grid(60, 36).mesh, 0.15, 7), 4.5),
    ],
    ids=["ellipsoid", "jitter", "cyclide", "torus"],
)
def test_intervals_are_no_wider_than_errors_ask_for(case, most):
    """Without noise: what a fit of degree 6 leaves is then the surface's, and seen at the vertex."""
    found = qc.curvatures(case.mesh)
    error = np.abs(found.mean - case.H)
    assert np.mean(error <= found.interval.mean) > 0.95
    assert found.interval.mean.mean() / 2 < most * error.mean()


@pytest.mark.parametrize(
    ("name", "layout", "n", "jitter"),
    [("torus", "grid", 64, 0), ("cubed_ellipsoid", "faces", 24, 0), ("cubed_ellipsoid", "faces", 24, 0.2)],
)
def test_the_error_of_plain_fits_is_known(name, layout, n, jitter):
    mesh, exact = sampled(name, n, jitter, layout)
    error = np.abs(qc.mean_curvature(mesh, jet(4)) - exact)
    estimate = np.abs(disagreement(mesh, jet(4)))
    assert spearmanr(error.ravel(), estimate.ravel()).statistic > 0.97
    assert 0.9 < estimate.mean() / error.mean() < 1.1


def test_noise_is_averaged():
    mesh, (H, *_) = noisy("cubed_ellipsoid", 24, 1e-2)
    error, plain = (np.abs(qc.mean_curvature(mesh, s) - H).mean() for s in ("jet", jet(4)))
    assert error < plain / 10
    found = qc.curvatures(mesh)
    assert np.mean(found.rings > 3) > 0.9


@pytest.mark.parametrize(("noise", "bound"), [(1e-3, 1.5e-3), (1e-2, 6e-3), (5e-2, 1.8e-2), (0.3, 0.1)])
def test_more_rings_where_noise_prevails(noise, bound):
    """Vertex by vertex, with intervals that hold."""
    mesh, (H, *_) = noisy("cubed_ellipsoid", 24, noise)
    found = qc.curvatures(mesh)
    error = np.abs(found.mean - H)
    assert error.mean() < bound
    assert np.mean(error <= found.interval.mean) > 0.92
    assert np.unique(found.rings).size > 2


@pytest.mark.parametrize("valence", [3, 5, 6, 8])
def test_kinks_of_lines_are_no_features(valence):
    """Where the sectors around an extraordinary vertex meet lines bend, and the surface does not."""
    errors = []
    for n in (16, 32, 64):
        case = cases.fan(valence, n)
        found = qc.curvatures(case.mesh)
        assert not found.feature.any()
        near = accuracy.near_extraordinary(case.mesh, valence)
        assert (found.degree[near] == 6).all()
        errors.append(np.abs(found.mean - case.H)[near].max())
    assert errors[-1] < 2e-8
    assert fitted_rate((16, 32, 64), errors) > 4.5


@pytest.mark.parametrize("seed", [0, 5])
def test_open_sheets_in_strong_noise(seed):
    """What completes neighbourhoods at borders is smooth, and no evidence: there K was off by up to 3,000."""
    smooth = cases.patch(40)
    found = qc.curvatures(smooth.noisy(0.3, seed).mesh)
    assert np.abs(found.gaussian - smooth.K).mean() < 0.4
    assert np.abs(found.mean - smooth.H).mean() < 0.2


@pytest.mark.parametrize(
    ("name", "noise", "bound"),
    [
        ("catenoid", 1e-2, 0.32),
        ("hyperboloid", 1e-3, 0.08),
        ("hyperboloid", 1e-2, 0.2),
        ("enneper", 1e-2, 0.045),
    ],
)
def test_noise_at_borders(name, noise, bound):
    """Root mean squares of the border rows, where fits are one-sided and choose between noise and bias."""
    squares = []
    for seed in (3, 4, 5):
        mesh, (H, *_) = noisy(name, 40, noise, seed)
        square = (qc.mean_curvature(mesh) - H) ** 2
        rows = [np.moveaxis(square, axis, 0)[[0, -1]] for axis in (0, 1) if not mesh.wrap[axis]]
        squares.append(np.mean(rows))
    assert np.sqrt(np.mean(squares)) < bound


OPEN = {
    "patch": cases.PATCH,
    "saddle": lambda u, v: (u, v, 0.3 * (u**2 - v**2) + 0.1 * np.sin(2 * u + v)),
    "wave": lambda u, v: (u + 0.05 * np.sin(2 * v), v, 0.3 * np.sin(2 * u) * np.exp(-(v**2))),
    "hills": lambda u, v: (u, v + 0.1 * u**2, 0.3 * np.cos(2.2 * u + 1) * np.sin(1.5 * v - 0.4)),
    "tanh_sheet": surfaces.tanh_sheet(),
    "enneper": surfaces.enneper(),
    "catenoid": surfaces.catenoid(),
}


def open_sheet(name):
    """A grid of 41 x 41 vertices, and its exact mean curvature."""
    surface = OPEN[name]
    if not isinstance(surface, surfaces.Surface):
        surface = surfaces.Surface.from_mapping(surface, ((-1, 1), (-1, 1)), name=name)
    mesh, xi, eta = surface.sample((41, 41))
    return mesh, surface.mean_curvature(xi, eta)


@pytest.mark.parametrize("name", OPEN)
def test_the_error_of_plain_fits_is_known_at_borders(name):
    """Ghosts that both fits read alike would hide what they are off by: the better one has better ghosts."""
    mesh, H = open_sheet(name)
    error = np.abs(qc.mean_curvature(mesh, jet(4)) - H)
    estimate = np.abs(disagreement(mesh, jet(4)))
    sides = np.ones(error.shape, bool)
    sides[tuple(slice(None) if wraps else slice(2, -2) for wraps in mesh.wrap)] = False
    assert spearmanr(error.ravel(), estimate.ravel()).statistic > 0.98
    assert 0.94 < estimate.mean() / error.mean() < 1.06
    assert 0.75 < estimate[sides].mean() / error[sides].mean() < 1.1


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-3])
@pytest.mark.parametrize("name", OPEN)
def test_intervals_cover_at_borders(name, noise):
    """What ghosts are off by shows in no residual, but in what the last of their points changes."""
    mesh, H = open_sheet(name)
    edge = np.linalg.norm(np.diff(mesh.points, axis=0), axis=2).mean()
    shaken = mesh.points + np.random.default_rng(1).normal(0, noise * edge, mesh.points.shape)
    found = qc.curvatures(qc.QuadGrid(shaken, mesh.wrap))
    covered = np.abs(found.mean - H) <= found.interval.mean
    for row in range(3):
        ends = [
            covered[tuple(k if x == axis else slice(None) for x in range(2))]
            for axis, wraps in enumerate(mesh.wrap)
            if not wraps
            for k in (row, -1 - row)
        ]
        assert np.mean(np.concatenate(ends)) > 0.9


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-2])
def test_ghosts_of_degree_seven(noise):
    """Far better where lines are smooth, and not there where noise would be magnified; noise in edges."""
    n, h = 20, 0.08
    u, v = np.meshgrid(h * np.arange(-3, 12), h * np.arange(n), indexing="ij")
    x = np.stack((u, v, 0.3 * np.sin(2 * u + 0.4) * np.cos(v)), axis=-1)
    lines = (x + np.random.default_rng(0).normal(0, noise * h, x.shape))[3:11].swapaxes(0, 1)
    beside = np.stack((np.arange(n - 1), np.arange(1, n)), axis=1)
    five = extended(lines[:, :6], np.full(n, 0.1), 5, 3, beside)
    seven, _ = sharpened(five, lines, np.tile((0.0, 0.0, 1.0), (n, 1)), beside)
    off = [np.abs(found.ghosts - x[2::-1].swapaxes(0, 1)).max() for found in (five, seven)]
    if noise == 0:
        assert off[1] < 0.05 * off[0]
    elif noise == 1e-6:
        assert off[1] < 2 * off[0]
    else:
        np.testing.assert_array_equal(seven.ghosts, five.ghosts)


def test_directions_under_noise_are_those_of_all_fits():
    """Two thirds as far off as those of the fit whose H is taken, and still a frame with its normal."""
    star = cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), 4))
    true = cases.STAR.direction1(np.asarray(star.mesh.points))
    apart = star.k1 - star.k2 > 0.1 * np.maximum(np.abs(star.k1), np.abs(star.k2))
    found = qc.curvatures(star.noisy(0.05).mesh)
    angles = np.rad2deg(np.arccos(np.minimum(np.abs(np.einsum("kx,kx->k", found.direction1, true)), 1)))
    assert angles[apart].mean() < 3.6  # 4.3 by the fit itself
    frame = np.stack((found.direction1, found.direction2, found.normal), axis=1)
    np.testing.assert_allclose(
        frame @ frame.swapaxes(1, 2), np.tile(np.eye(3), (len(frame), 1, 1)), atol=1e-12
    )
    np.testing.assert_allclose(np.linalg.det(frame), 1, atol=1e-12)
