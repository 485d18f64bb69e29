"""Finite differences of the fundamental forms."""

from __future__ import annotations

import numpy as np
import pytest

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import SCHEMES, fundamental_forms, jet

SURFACES = ["torus", "ellipsoid", "tanh_sheet", "catenoid", "helicoid", "hyperboloid"]


@pytest.mark.parametrize("layout", ["grid", "staggered"])
@pytest.mark.parametrize(("order", "rate", "bound"), [(2, 1.85, 1.5e-3), (4, 3.7, 5e-6)])
@pytest.mark.parametrize("name", SURFACES)
def test_order_up_to_the_border(name, order, rate, bound, layout):
    surface = surfaces.SURFACES[name]()
    errors = []
    for n in (64, 128, 256):
        grid, xi, eta = surface.sample((n, n), layout)
        fits = qc.curvatures(grid, fundamental_forms(order))
        H, K = surface.mean_curvature(xi, eta), surface.gaussian_curvature(xi, eta)
        errors.append([np.abs(fits.mean - H).max(), np.abs(fits.gaussian - K).max()])
    assert max(errors[-1]) < bound
    for column in np.transpose(errors):
        assert fitted_rate((64, 128, 256), column) > rate


@pytest.mark.parametrize(
    ("name", "order"), [("elliptic_paraboloid", 2), ("elliptic_paraboloid", 4), ("enneper", 4)]
)
def test_polynomial_mappings_are_exact(name, order):
    """Of degree 2 and 3: nothing but rounding, eps / h^2."""
    surface = surfaces.SURFACES[name]()
    for layout in ("grid", "staggered"):
        grid, xi, eta = surface.sample((64, 64), layout)
        fits = qc.curvatures(grid, fundamental_forms(order))
        assert np.abs(fits.mean - surface.mean_curvature(xi, eta)).max() < 1e-11
        assert np.abs(fits.gaussian - surface.gaussian_curvature(xi, eta)).max() < 1e-11


@pytest.mark.parametrize("order", [2, 4])
def test_quadratic_graphs_are_exact(order):
    x, y = np.meshgrid(np.linspace(-1, 1, 9), np.linspace(-1, 1.5, 11), indexing="ij")
    z = 0.3 * x * x - 0.8 * x * y + 0.1 * y * y + 0.2 * x - 0.5 * y
    grid = qc.QuadGrid(np.stack((x, y, z), axis=-1))
    fits = qc.curvatures(grid, fundamental_forms(order))
    p, q = 0.6 * x - 0.8 * y + 0.2, -0.8 * x + 0.2 * y - 0.5
    W = np.sqrt(1 + p * p + q * q)
    H = -((1 + q * q) * 0.6 + 2 * p * q * 0.8 + (1 + p * p) * 0.2) / (2 * W**3)
    assert np.abs(fits.mean - H).max() < 1e-11
    assert np.abs(fits.gaussian - (0.6 * 0.2 - 0.64) / W**4).max() < 1e-11
    assert np.abs(fits.k1 - (H + np.sqrt(H**2 - fits.gaussian))).max() < 1e-10
    normal = np.stack((-p, -q, np.ones_like(p)), axis=-1) / W[..., None]
    assert np.abs(fits.normal - normal).max() < 1e-12


def test_principal_directions_of_a_sheared_torus():
    """A grid that follows neither family of curvature lines."""
    n = 96
    xi, eta = np.meshgrid(*[2 * np.pi / n * np.arange(n)] * 2, indexing="ij")
    surface = surfaces.torus()
    fits = qc.curvatures(qc.QuadGrid(surface.mapping(xi + eta, eta), (True, True)), fundamental_forms(4))
    around = np.stack((-np.sin(xi + eta), np.cos(xi + eta), np.zeros_like(xi)), axis=-1)
    assert np.abs(np.einsum("rcx,rcx->rc", fits.direction1, around)).max() < 2e-3
    assert np.abs(np.abs(np.einsum("rcx,rcx->rc", fits.direction2, around)) - 1).max() < 2e-6
    frame = np.stack((fits.direction1, fits.direction2, fits.normal), axis=-2)
    assert np.abs(np.linalg.det(frame) - 1).max() < 1e-13
    assert np.abs(fits.k1 * fits.k2 - fits.gaussian).max() < 1e-12


def test_fourth_order_agrees_with_the_jet_to_its_error():
    """Without the exact answer: the difference of two fourth-order schemes is fourth-order."""
    differences = []
    for n in (64, 128, 256):
        grid = surfaces.tanh_sheet().sample((n, n))[0]
        differences.append(
            np.abs(qc.mean_curvature(grid, fundamental_forms(4)) - qc.mean_curvature(grid, jet(4))).max()
        )
    assert differences[-1] < 1e-6
    assert fitted_rate((64, 128, 256), differences) > 3.7


@pytest.mark.parametrize(("order", "layers"), [(2, 1), (4, 2)])
def test_boundary_nan(order, layers):
    grid = surfaces.elliptic_paraboloid().sample((12, 12))[0]
    scheme = fundamental_forms(order)
    H = qc.mean_curvature(grid, scheme, boundary="nan")
    assert np.array_equal(
        H[layers:-layers, layers:-layers], qc.mean_curvature(grid, scheme)[layers:-layers, layers:-layers]
    )
    assert np.isnan(H).sum() == H.size - (13 - 2 * layers) ** 2
    cylinder = surfaces.cylinder().sample((16, 12))[0]
    H = qc.mean_curvature(cylinder, scheme, boundary="nan")
    assert np.isnan(H).sum() == 16 * 2 * layers


def test_degenerate_points_are_nan_alone():
    grid = surfaces.sphere().sample((24, 20))[0]
    points = grid.points.copy()
    points[:, -1] = (0, 0, 1)  # a pole: the first direction has no length
    H = qc.mean_curvature(qc.QuadGrid(points, grid.wrap), fundamental_forms(2))
    assert np.isnan(H[:, -1]).all()
    assert np.isfinite(H[:, :-1]).all()


def test_rejections():
    with pytest.raises(ValueError, match="order: expected one of"):
        fundamental_forms(3)
    scheme = fundamental_forms(4)
    assert scheme.name not in SCHEMES
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    with pytest.raises(ValueError, match="need a QuadGrid or a StaggeredGrid"):
        qc.mean_curvature(mesh, scheme)
    grid = surfaces.torus().sample((8, 8))[0]
    with pytest.raises(ValueError, match="boundary: expected one of"):
        qc.mean_curvature(grid, scheme, boundary="mirror")
    with pytest.raises(qc.MeshError, match="extrapolation beyond an open side needs at least 6"):
        qc.mean_curvature(qc.QuadGrid(grid.points[:5]), scheme)
