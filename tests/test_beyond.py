import numpy as np
import pytest
from scripts import assert_as_declared, assert_one_size_of_type, drawn

from comparisons import beyond, common
from comparisons.beyond import measure
from quadcurv import QuadGrid, mean_curvature
from quadcurv.surfaces import catenoid, tanh_sheet

FIGURES = ["boundaries", "extraordinary", "jitter", "valence_8"]


@pytest.fixture(scope="module")
def found():
    return common.measure(beyond)


@pytest.fixture(scope="module")
def results(found):
    return found.numbers


def test_verdicts_and_report(found) -> None:
    assert_as_declared(beyond, found)


def test_figures(found) -> None:
    made = drawn(beyond, found)
    assert set(made) == {f"beyond_{name}" for name in FIGURES}
    assert_one_size_of_type(made)


@pytest.mark.parametrize(
    ("surface", "none", "quadratic", "cubic", "quartic", "inside"),
    [
        ("tanh_sheet", 0.135, 3.84e-3, 9.5e-5, 2.0e-5, 8.7e-5),
        ("catenoid", 0.204, 1.25e-3, 2.55e-5, 1.30e-5, 7.3e-5),
    ],
)
def test_boundaries(results, surface, none, quadratic, cubic, quartic, inside) -> None:
    expected = {
        "none": (none, 0, 0.07),
        "quadratic ghosts": (quadratic, 1, 0.05),
        "cubic ghosts": (cubic, 2, 0.06),
        "quartic ghosts": (quartic, 2, 0.08),
        "inside": (inside, 2, 0.01),
    }
    for name, (error, rate, tolerance) in expected.items():
        assert results[f"border, {surface}: {name}, at 256"] == pytest.approx(error, rel=0.02)
        assert results[f"border, {surface}: {name}, rate"] == pytest.approx(rate, abs=tolerance)


@pytest.mark.parametrize("surface", [tanh_sheet(), catenoid()], ids=lambda s: s.name)
def test_quartic_ghosts_are_those_of_the_package(surface) -> None:
    grid, *_ = surface.sample((32, 32))
    np.testing.assert_allclose(
        measure.border_curvature(grid, 4), mean_curvature(grid, "finite_volume"), atol=1e-11
    )


def test_ghosts_continue_polynomials() -> None:
    x, y = np.meshgrid(np.arange(7.0), np.arange(6.0), indexing="ij")
    for degree in (2, 3, 4):
        grid = QuadGrid(np.stack((x, y, x**degree - y * x), axis=-1))
        X, Y, Z = np.moveaxis(measure.with_ghosts(grid, degree).points, -1, 0)
        assert X.shape == (9, 8)
        np.testing.assert_allclose(Z, X**degree - Y * X, atol=1e-9)


def test_icosahedral_sphere() -> None:
    mesh = measure.icosahedral_sphere(4)
    valence = mesh.stencils().valence
    assert np.bincount(valence).tolist() == [0, 0, 0, 20, len(valence) - 32, 12]
    assert len(mesh.points) - 2 * len(mesh.faces) + len(mesh.faces) == 2
    np.testing.assert_allclose(np.linalg.norm(mesh.points, axis=1), 1, rtol=1e-14)
    assert mean_curvature(mesh, "finite_volume").min() > 0.7  # oriented outward


@pytest.mark.parametrize(
    ("mesh", "valence", "bound"),
    [
        ("cubed sphere", 3, 0.035),
        ("cubed ellipsoid", 3, 0.020),
        ("icosahedral sphere", 3, 0.032),
        ("icosahedral sphere", 4, 0.016),
        ("icosahedral sphere", 5, 0.0020),
    ],
)
def test_finite_volume_is_first_order_at_extraordinary_vertices(results, mesh, valence, bound) -> None:
    key = f"{mesh}, finite_volume: valence {valence}, largest"
    assert 0.9 < results[f"{key}, rate"] < 1.25
    assert 0.9 * bound < results[f"{key}, at 32"] < bound
    assert results[f"{mesh}, finite_volume: all, mean, rate"] == pytest.approx(1.96, abs=0.04)


def test_other_schemes_at_extraordinary_vertices(results) -> None:
    for mesh, valence in (("cubed sphere", 3), ("icosahedral sphere", 3), ("icosahedral sphere", 5)):
        assert results[f"{mesh}, liu: valence {valence}, largest, at 32"] < 1e-10
    key = "cubed ellipsoid, liu: valence 3, largest"
    assert results[f"{key}, at 32"] == pytest.approx(1.3e-3, rel=0.05)
    assert 0.7 < results[f"{key}, rate"] < 1
    for mesh, valence in (("cubed ellipsoid", 3), ("icosahedral sphere", 5)):
        key = f"{mesh}, cotan-6: valence {valence}, largest"
        assert results[f"{key}, at 32"] > 0.55
        assert results[f"{key}, rate"] < 0.02


@pytest.mark.parametrize(
    ("scheme", "plateaus"),
    [
        ("finite_volume", (0.0115, 0.023, 0.048)),
        ("liu", (0.0082, 0.017, 0.036)),
        ("cotan-6", (0.0058, 0.0124, 0.031)),
    ],
)
def test_jitter_stops_convergence(results, scheme, plateaus) -> None:
    assert results[f"jitter 0 %, {scheme}: one-norm, rate"] == pytest.approx(2, abs=0.02)
    assert results[f"jitter 0 %, {scheme}: one-norm, at 128"] < 2.3e-4
    for jitter, plateau in zip((5, 10, 20), plateaus, strict=True):
        assert results[f"jitter {jitter} %, {scheme}: one-norm, rate"] == pytest.approx(0, abs=0.05)
        assert results[f"jitter {jitter} %, {scheme}: one-norm, at 128"] == pytest.approx(plateau, rel=0.05)
        assert results[f"jitter {jitter} %, {scheme}: inf-norm, rate"] < 0.05


def test_jet_converges_on_jittered_grids(results) -> None:
    assert results["jitter 20 %, jet: one-norm, rate"] > 3
    assert results["jitter 20 %, jet: one-norm, at 128"] < 2e-4
    assert results["jitter 20 %, jet-2: one-norm, rate"] == pytest.approx(1.1, abs=0.1)


@pytest.mark.parametrize(
    ("surface", "barycentric", "layout", "rate"),
    [
        ("torus", 0.106, "grid", 1),
        ("sphere", 0.250, "grid", 1),
        ("elliptic_paraboloid", 0.200, "grid", 0),
        ("cylinder", 0.125, "staggered", 2),
        ("torus", 0.171, "staggered", 0),
        ("sphere", 1.10, "staggered", 0),
    ],
)
def test_voronoi_area_mends_valence_8_on_orthogonal_grids_alone(
    results, surface, barycentric, layout, rate
) -> None:
    key = f"areas, {surface}, {layout}"
    assert results[f"{key}, cotan-8: at 128"] == pytest.approx(barycentric, rel=0.01)
    assert results[f"{key}, cotan-8-voronoi: rate"] == pytest.approx(rate, abs=0.06)
    assert results[f"{key}, cotan-4-voronoi: rate"] == pytest.approx(rate, abs=0.06)


def test_areas_on_the_vertices_of_a_cylinder(results) -> None:
    key = "areas, cylinder, grid"
    assert results[f"{key}, cotan-8: at 128"] == pytest.approx(0.125, abs=1e-4)
    assert results[f"{key}, cotan-4: at 128"] == pytest.approx(0.25, abs=2e-4)
    for valence in (4, 8):
        assert results[f"{key}, cotan-{valence}-voronoi: at 128"] < 1e-11
    assert results["areas: barycentric over Voronoi, valence 8"] == pytest.approx(4 / 3, abs=1e-3)
    assert results["areas: barycentric over Voronoi, valence 4"] == pytest.approx(2 / 3, abs=1e-3)


def test_map() -> None:
    maps = beyond.MAPS["beyond_extraordinary_map"]()
    for mesh, e in maps.panels.values():
        assert e.shape == (len(mesh.points),)
        assert 1e-3 < e.max() < 0.1
