"""Error estimates against true errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import spearmanr

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.estimate import disagreement, richardson
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import fundamental_forms


def ranked(estimate, error):
    """Spearman's correlation of the sizes, and how many of the worst tenth are found in the worst tenth."""
    estimate, error = np.abs(estimate).ravel(), np.abs(error).ravel()
    worst, found = (x >= np.quantile(x, 0.9) for x in (error, estimate))
    return spearmanr(estimate, error).statistic, (worst & found).sum() / worst.sum()


@pytest.mark.parametrize("scheme", ["finite_volume", "liu", "cotan-6", "bunge"])
@pytest.mark.parametrize(
    ("name", "layout", "n", "reference"),
    [
        ("torus", "grid", 96, fundamental_forms(4)),  # 96 around the outer equator are few for a jet
        ("elliptic_paraboloid", "grid", 64, "jet"),
        ("tanh_sheet", "grid", 64, "jet"),
        ("cubed_ellipsoid", "faces", 32, "jet"),
    ],
)
def test_disagreement_with_a_better_scheme_ranks_errors(name, layout, n, reference, scheme):
    surface = surfaces.SURFACES[name]()
    mesh, xi, eta = surface.sample((n, n), layout)
    error = qc.mean_curvature(mesh, scheme) - surface.mean_curvature(xi, eta)
    estimate = disagreement(mesh, scheme, reference)
    correlation, found = ranked(estimate, error)
    assert correlation > 0.92
    assert found > 0.85
    assert np.abs(estimate - error).mean() < 0.25 * np.abs(error).mean()


@pytest.mark.parametrize("jitter", [0.05, 0.2])
def test_disagreement_ranks_errors_on_jittered_grids(jitter):
    surface = surfaces.torus()
    rng = np.random.default_rng(1)
    t = 2 * np.pi / 96
    xi, eta = np.meshgrid(*[t * np.arange(96)] * 2, indexing="ij")
    xi, eta = (
        xi + rng.uniform(-jitter, jitter, xi.shape) * t,
        eta + rng.uniform(-jitter, jitter, xi.shape) * t,
    )
    grid = qc.QuadGrid(surface.mapping(xi, eta), (True, True))
    error = qc.mean_curvature(grid, "finite_volume") - surface.mean_curvature(xi, eta)
    correlation, found = ranked(disagreement(grid, "finite_volume"), error)
    assert correlation > 0.97
    assert found > 0.9


@pytest.mark.parametrize(
    ("scheme", "bound"),
    [("finite_volume", 0.1), ("liu", 0.1), ("cotan-6", 0.1), (fundamental_forms(4), 0.1)],
)
@pytest.mark.parametrize("name", ["torus", "tanh_sheet", "hyperboloid"])
def test_richardson(name, scheme, bound):
    surface = surfaces.SURFACES[name]()
    grid, xi, eta = surface.sample((128, 128))
    error = qc.mean_curvature(grid, scheme) - surface.mean_curvature(xi, eta)
    estimate = richardson(grid, scheme)
    correlation, found = ranked(estimate, error)
    assert correlation > 0.9
    assert found > 0.7
    assert np.abs(estimate - error).mean() < bound * np.abs(error).mean()


def test_richardson_correction_raises_the_order():
    surface = surfaces.torus()
    errors = []
    for n in (32, 64, 128):
        grid, xi, eta = surface.sample((n, n))
        H = qc.mean_curvature(grid, "finite_volume") - richardson(grid, "finite_volume")
        errors.append(np.abs(H - surface.mean_curvature(xi, eta))[::2, ::2].max())
    assert errors[-1] < 1e-4
    assert fitted_rate((32, 64, 128), errors) > 3.7


@pytest.mark.filterwarnings("ignore:the first and the last:quadcurv.MeshWarning")  # cut open
@pytest.mark.parametrize("wrap", [(True, False), (False, True)])
def test_estimates_have_the_shape_and_place_of_the_grid(wrap):
    """A sampled torus, cut open or not: vertices between coarse ones get the mean of their neighbours."""
    grid = surfaces.torus().sample((32, 32))[0]
    points = np.concatenate((grid.points, grid.points[:1]))[:, :] if wrap[1] else grid.points
    if wrap[0]:
        points = np.concatenate((points, points[:, :1]), axis=1)
    estimate = richardson(qc.QuadGrid(points, wrap), "finite_volume")
    assert estimate.shape == points.shape[:2]
    assert estimate[3, 4] == pytest.approx((estimate[2, 4] + estimate[4, 4]) / 2, abs=1e-15)
    assert estimate[6, 5] == pytest.approx((estimate[6, 4] + estimate[6, 6]) / 2, abs=1e-15)
    last = (-1, 4) if wrap[0] else (4, -1)
    first, second = ((0, 4), (-2, 4)) if wrap[0] else ((4, 0), (4, -2))
    assert estimate[last] == pytest.approx((estimate[first] + estimate[second]) / 2, abs=1e-15)
    assert np.isnan(richardson(qc.QuadGrid(points, wrap), "finite_volume", boundary="nan")).any()


def test_noise_is_estimated_by_the_automatic_fit():
    surface = surfaces.torus()
    grid, xi, eta = surface.sample((96, 96))
    noise = np.random.default_rng(3).normal(0, 0.002, grid.points.shape)
    noisy = qc.QuadGrid(grid.points + noise, grid.wrap)
    error = qc.mean_curvature(noisy, "finite_volume") - surface.mean_curvature(xi, eta)
    assert ranked(disagreement(noisy, "finite_volume"), error)[0] > 0.98
    assert ranked(disagreement(noisy, "finite_volume", "liu"), error)[0] < 0.5


def test_rejections():
    torus = surfaces.torus()
    grid = torus.sample((9, 8))[0]
    with pytest.raises(ValueError, match="reference: expected another scheme than liu"):
        disagreement(grid, "liu", "liu")
    with pytest.raises(ValueError, match="9 rows that wrap, an even number is needed"):
        richardson(grid, "liu")
    with pytest.raises(ValueError, match="10 columns that do not wrap, an odd number is needed"):
        richardson(surfaces.plane().sample((8, 9))[0], "liu")
    with pytest.raises(ValueError, match="grid: expected a QuadGrid, got QuadMesh"):
        richardson(grid.to_mesh(), "liu")
    with pytest.raises(ValueError, match=r"order: expected a positive number, got 0 \(cotan-8\)"):
        richardson(torus.sample((8, 8))[0], "cotan-8")
    for order in ("2", np.nan, np.inf, -1):
        with pytest.raises(ValueError, match="order: expected a positive number, got"):
            richardson(torus.sample((8, 8))[0], "liu", order)


def test_estimates_on_a_grid_with_holes():
    grid = surfaces.torus().sample((24, 16))[0]
    mask = np.zeros((24, 16), bool)
    mask[3, 4] = mask[10:12, 5:9] = True
    holed = qc.QuadGrid(grid.points, grid.wrap, mask=mask)
    for estimate in (richardson(holed, "liu"), disagreement(holed, "liu")):
        assert estimate.shape == (24, 16)
        assert np.isnan(estimate[mask]).all()
    whole = richardson(grid, "liu")
    far = np.s_[16:22, 2:14]
    assert richardson(holed, "liu")[far] == pytest.approx(whole[far], abs=1e-12)
