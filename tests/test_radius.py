"""Means of curvature over a radius, against exact integrals."""

from __future__ import annotations

import numpy as np
import pytest

import quadcurv as qc
from quadcurv.kernels import discs
from quadcurv.refinement import fitted_rate


def flat_grid(n=20, size=1.0):
    x, y = np.meshgrid(*[np.linspace(-size, size, n + 1)] * 2, indexing="ij")
    return qc.QuadGrid(np.stack((x, y, 0 * x), axis=-1)).to_mesh()


@pytest.mark.parametrize("radius", [0.03, 0.1, 0.17, 0.5, 0.777])
def test_discs_of_a_plane_are_exact(radius):
    """Areas of a disc and a quarter of one, and the mean of a linear function over both, to rounding."""
    mesh = flat_grid()
    x, y, _ = mesh.points.T
    areas, sums = discs.integrals(mesh.points, mesh.faces, np.stack((1 + 2 * x + 3 * y, x), axis=1), radius)
    middle, corner = np.argmin(np.hypot(x, y)), 0
    assert areas[middle] == pytest.approx(np.pi * radius**2, rel=1e-12)
    assert areas[corner] == pytest.approx(np.pi * radius**2 / 4, rel=1e-12)
    np.testing.assert_allclose(sums[middle] / areas[middle], [1, 0], atol=1e-12)
    off = 4 * radius / (3 * np.pi) - 1
    np.testing.assert_allclose(sums[corner] / areas[corner], [1 + 5 * off, off], atol=1e-12)


def test_disc_larger_than_the_mesh_is_all_of_it():
    mesh = flat_grid(6)
    areas, sums = discs.integrals(mesh.points, mesh.faces, mesh.points[:, :1] + 1, 9.0)
    np.testing.assert_allclose(areas, 4, rtol=1e-13)
    np.testing.assert_allclose(sums, 4, rtol=1e-13)


def test_discs_do_not_depend_on_threads_quads_or_order():
    ball = qc.surfaces.cubed_sphere().sample((12, 12), "faces")[0]
    values = ball.points[:, :2] ** 2
    areas, sums = discs.integrals(ball.points, ball.faces, values, 0.35)
    rng = np.random.default_rng(0)
    order = rng.permutation(len(ball.points))
    faces = np.argsort(order)[ball.faces][rng.permutation(len(ball.faces))]
    again, others = discs.integrals(ball.points[order], faces, values[order], 0.35)
    np.testing.assert_allclose(again, areas[order], rtol=1e-12)
    np.testing.assert_allclose(others, sums[order], rtol=1e-11)
    qc.set_threads(1)
    try:
        one, _ = discs.integrals(ball.points, ball.faces, values, 0.35)
    finally:
        qc.set_threads(None)
    assert (one == areas).all()


def test_caps_of_a_sphere():
    """Within a chord r of a point of a sphere lies an area of pi r^2 (Archimedes)."""
    found = []
    for n in (8, 16, 32):
        ball = qc.surfaces.cubed_sphere().sample((n, n), "faces")[0]
        areas, _ = discs.integrals(ball.points, ball.faces, np.ones((len(ball.points), 1)), 0.6)
        found.append(np.abs(areas / (np.pi * 0.36) - 1).max())
    assert fitted_rate((8, 16, 32), found) > 1.8
    assert found[-1] < 2e-3


def test_constant_curvature_stays():
    """Sphere of radius 2 and cylinder: H, K, k1, k2 as without a radius; directions too."""
    ball = qc.surfaces.cubed_sphere(2.0).sample((24, 24), "faces")[0]
    found = qc.curvatures(ball, radius=0.7)
    np.testing.assert_allclose(found.mean, 0.5, atol=1e-4)
    np.testing.assert_allclose(found.gaussian, 0.25, atol=1e-4)
    np.testing.assert_allclose(np.einsum("nx,nx->n", found.normal, ball.points), 2, atol=1e-3)
    tube = qc.surfaces.cylinder().sample((48, 24))[0]
    found = qc.curvatures(tube, radius=0.5)
    np.testing.assert_allclose(found.k1, 1, atol=2e-3)
    np.testing.assert_allclose(found.k2, 0, atol=2e-3)
    inside = (slice(None), slice(6, -6))
    np.testing.assert_allclose(np.abs(found.direction2[inside][..., 2]), 1, atol=1e-6)
    right = np.cross(found.direction1, found.direction2)
    np.testing.assert_allclose(right, found.normal, atol=1e-12)


def exact_means(axes, at, radius, size=1500):
    """Means of H and K over a ball around a point of an ellipsoid, by a fine sum over its parameters."""
    a, b, c = axes
    u = (np.arange(size) + 0.5) / size * np.pi
    v = (np.arange(2 * size) + 0.5) / size * np.pi
    u, v = np.meshgrid(u, v, indexing="ij")
    x = np.stack((a * np.sin(u) * np.cos(v), b * np.sin(u) * np.sin(v), c * np.cos(u)), axis=-1)
    near = np.linalg.norm(x - at, axis=-1) <= radius
    x, u = x[near], u[near]
    g = x / np.square(axes)
    length = np.linalg.norm(g, axis=1)
    area = a * b * c * length * np.sin(u)  # of an ellipsoid, per du dv
    K = 1 / (a * b * c) ** 2 / length**4
    H = ((1 / np.square(axes)).sum() - (g**2 / np.square(axes)).sum(axis=1) / length**2) / (2 * length)
    return np.array([(H * area).sum(), (K * area).sum()]) / area.sum()


@pytest.mark.parametrize("vertex", [0, 100])
def test_means_on_an_ellipsoid_are_the_exact_integrals(vertex):
    axes, errors = (1.0, 0.8, 1.3), []
    ball = qc.surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    at = ball.points[vertex] * axes
    exact = exact_means(axes, at, 0.5)
    for n in (12, 24, 48):
        ball = qc.surfaces.cubed_sphere().sample((n, n), "faces")[0]
        mesh = qc.QuadMesh(ball.points * axes, ball.faces)
        found = qc.curvatures(mesh, radius=0.5)
        here = np.argmin(np.linalg.norm(mesh.points - at, axis=1))
        errors.append(np.abs(np.array([found.mean[here], found.gaussian[here]]) - exact))
    rough = qc.curvatures(mesh)
    assert abs(rough.mean[here] - exact[0]) > 20 * errors[-1][0]  # the value is not the mean
    assert (errors[-1] < (4e-4, 8e-4)).all()
    assert fitted_rate((12, 24, 48), [e.max() for e in errors]) > 1.8


def test_other_side_of_a_thin_plate_is_not_seen():
    """Two sheets nearer than the radius that do not hang together there."""
    sheet = flat_grid(10)
    n = len(sheet.points)
    points = np.concatenate((sheet.points, sheet.points + np.array([0, 0, 0.05])))
    values = np.repeat([[1.0], [2.0]], n, axis=0)
    areas, sums = discs.integrals(points, np.concatenate((sheet.faces, sheet.faces + n)), values, 0.4)
    np.testing.assert_allclose(sums / areas[:, None], values, rtol=1e-13)


def test_noise_is_averaged():
    rng = np.random.default_rng(0)
    ball = qc.surfaces.cubed_sphere().sample((24, 24), "faces")[0]
    noisy = qc.QuadMesh(ball.points + rng.normal(0, 5e-4, ball.points.shape), ball.faces)
    quartic = qc.schemes.jet(4)  # the default averages by itself
    fine, scaled = qc.curvatures(noisy, quartic), qc.curvatures(noisy, quartic, radius=0.3)
    assert np.abs(scaled.mean - 1).mean() < 0.2 * np.abs(fine.mean - 1).mean()
    np.testing.assert_allclose(scaled.mean, (scaled.k1 + scaled.k2) / 2, rtol=1e-12)
    assert (scaled.k1 >= scaled.k2).all()
    assert scaled.standard_error is None


def test_borders_and_nan():
    """With "nan" there is no value where a border has a part in the ball; else the ball ends there."""
    grid = qc.surfaces.elliptic_paraboloid().sample((24, 24))[0]
    radius = 0.3
    with_border = qc.curvatures(grid, radius=radius)
    assert np.isfinite(with_border.mean).all()
    without = qc.curvatures(grid, boundary="nan", radius=radius)
    x = grid.points[..., :2]
    away = 1 - np.abs(x).max(axis=-1)
    step = 2 / 24
    assert np.isnan(without.mean[away < step]).all()
    unknown = np.isnan(without.mean)
    assert unknown[away < 0.15].all()
    assert not unknown[away > radius + step].any()
    assert (np.isnan(without.direction1).any(axis=-1) == unknown).all()
    np.testing.assert_allclose(without.mean[~unknown], with_border.mean[~unknown], rtol=1e-3)


def test_grids_with_holes_masks_and_cells():
    grid = qc.surfaces.torus().sample((32, 24))[0]
    surface = qc.curvatures(grid, radius=0.6)
    assert surface.mean.shape == (32, 24)
    listed = qc.curvatures(grid.to_mesh(), radius=0.6)
    np.testing.assert_allclose(surface.mean.ravel(), listed.mean, rtol=1e-6)
    mask = np.zeros((32, 24), bool)
    mask[3, 4] = True
    holed = qc.curvatures(qc.QuadGrid(grid.points, (True, True), mask=mask), radius=0.6)
    assert np.isnan(holed.mean[3, 4])
    assert np.isfinite(holed.mean[~mask]).all()
    cells = qc.surfaces.torus().sample((32, 24), "staggered")[0]
    found = qc.curvatures(cells, radius=0.6)
    assert found.mean.shape == (32, 24)
    assert np.abs(found.mean - surface.mean).max() < 0.1


def test_blocks_are_averaged_across_their_sides():
    x, y = np.meshgrid(np.linspace(0, 2, 21), np.linspace(0, 1, 11), indexing="ij")
    points = np.stack((x, y, 0.3 * x**2 + 0.1 * x * y), axis=-1)
    blocks = qc.GridBlocks([qc.QuadGrid(points[:11]), qc.QuadGrid(points[10:])])
    left, right = qc.curvatures(blocks, "jet-2", radius=0.35)
    whole = qc.curvatures(qc.QuadGrid(points).to_mesh(), "jet-2", radius=0.35)
    np.testing.assert_allclose(left.mean, whole.mean.reshape(21, 11)[:11], rtol=1e-9)
    np.testing.assert_allclose(right.gaussian, whole.gaussian.reshape(21, 11)[10:], rtol=1e-9, atol=1e-12)


def test_isolated_vertex_has_none():
    ball = qc.surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    mesh = qc.QuadMesh(np.concatenate((ball.points, [[3.0, 0, 0]])), ball.faces)
    found = qc.curvatures(mesh, radius=0.4)
    assert np.isnan(found.mean[-1])
    assert np.isfinite(found.mean[:-1]).all()


@pytest.mark.parametrize("radius", [0, -1.0, np.nan, np.inf, True, "1", [0.5], 1j])
def test_no_length_is_refused(radius):
    ball = qc.surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    with pytest.raises(ValueError, match="radius: expected a positive, finite length"):
        qc.curvatures(ball, radius=radius)
