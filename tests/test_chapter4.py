"""The figures of chapter 4: every case with its rate and an absolute bound."""

from __future__ import annotations

import io

import numpy as np
import pytest
from rich.console import Console

from comparisons import chapter4
from quadcurv import mean_curvature, surfaces
from quadcurv.refinement import Convergence, convergence

SIZES = [16, 32, 64, 128, 256]


@pytest.fixture(scope="module")
def cylinder() -> Convergence:
    return convergence(surfaces.cylinder(), chapter4.ALL, SIZES)


@pytest.fixture(scope="module")
def wavy() -> Convergence:
    return convergence(surfaces.cylinder(f=chapter4.wave), chapter4.ALL, SIZES)


@pytest.fixture(scope="module")
def pillow() -> Convergence:
    return convergence(surfaces.pillow_sphere(), chapter4.ALL, [(2 * n, n) for n in SIZES])


@pytest.fixture(scope="module")
def sphere() -> Convergence:
    return convergence(surfaces.sphere(), chapter4.ALL, SIZES)


def last(run: Convergence, scheme: str, norm: str) -> tuple[float, float]:
    """Rate of the last doubling, to 256 cells, and the error there."""
    return run.rates(scheme, norm)[-1], run.errors[scheme][norm][-1]


@pytest.mark.parametrize("scheme", ["finite_volume", "liu"])
@pytest.mark.parametrize("f", [None, chapter4.wave])
@pytest.mark.parametrize("radius", [1.0, 0.3, 40.0])
def test_cylinder_is_exact_to_rounding(scheme, f, radius):
    for n in (16, 32, 64):
        mesh, *_ = surfaces.cylinder(radius, f).sample((n, n), "staggered")
        H = mean_curvature(mesh, scheme)
        assert np.abs(2 * radius * H - 1).max() < 1e-12


@pytest.mark.parametrize("case", ["cylinder", "wavy"])
def test_cylinder_keeping_the_neighbours_along_the_axis_is_exact(request, case):
    run = request.getfixturevalue(case)
    assert run.errors["cotan-6'"]["inf"].max() < 1e-10


def test_cylinder_keeping_the_neighbours_around_it_is_second_order(cylinder, wavy):
    rate, error = last(cylinder, "cotan-6", "inf")
    assert rate == pytest.approx(2.00, abs=0.005)
    assert error == pytest.approx(1.88e-5, rel=0.01)
    # "Inf-norm mirrors exactly the one-norm" (Figure 4.2).
    errors = cylinder.errors["cotan-6"]
    assert np.allclose(errors["one"], errors["inf"], rtol=1e-6, atol=0)
    rate, error = last(wavy, "cotan-6", "one")
    assert rate == pytest.approx(2.00, abs=0.01)
    assert error < 4e-4


def test_cylinder_valence_eight_and_four_by_area(cylinder, wavy):
    assert cylinder.errors["cotan-8"]["one"][-1] == pytest.approx(0.125, abs=1e-4)
    assert cylinder.errors["cotan-4"]["one"][-1] == pytest.approx(0.25, abs=1e-4)
    for scheme, bound in (("cotan-8-voronoi", 2.1e-5), ("cotan-4-voronoi", 1.7e-6)):
        rate, error = last(cylinder, scheme, "inf")
        assert rate == pytest.approx(2.00, abs=0.01)
        assert error < bound
        # The area is at fault on orthogonal grids only.
        assert abs(last(wavy, scheme, "one")[0]) < 0.01
        assert wavy.errors[scheme]["one"][-1] > 0.4
    assert wavy.errors["cotan-8"]["one"][-1] > 0.4


@pytest.mark.parametrize(
    ("scheme", "norm", "rate", "bound"),
    [
        ("finite_volume", "one", 2.00, 1.6e-5),
        ("liu", "one", 1.96, 1.0e-5),
        ("finite_volume", "inf", 0.98, 3.0e-3),
        ("liu", "inf", 0.98, 1.0e-3),
    ],
)
def test_pillow_sphere(pillow, scheme, norm, rate, bound):
    found, error = last(pillow, scheme, norm)
    assert found == pytest.approx(rate, abs=0.015)
    assert error < bound


def test_pillow_sphere_cotan(pillow):
    rates = pillow.rates("cotan-6", "one")
    assert (np.diff(rates) > 0).all()  # rising to 1
    assert 0.80 < rates[-1] < 1
    for scheme in ("cotan-6", "cotan-6'", "cotan-6-voronoi", "cotan-8", "cotan-8-voronoi"):
        assert pillow.rates(scheme, "inf")[-1] == pytest.approx(-1, abs=0.05)
    for scheme in ("cotan-4", "cotan-8", "cotan-4-voronoi", "cotan-8-voronoi"):
        assert pillow.errors[scheme]["one"][-1] > 0.4


@pytest.mark.parametrize(
    ("scheme", "rate", "bound"),
    [("finite_volume", 2.0, 6.1e-5), ("liu", 4.0, 6e-10), ("cotan-6", 2.0, 2.4e-4)],
)
def test_sphere_without_poles(sphere, scheme, rate, bound):
    for norm in ("one", "inf"):
        found, error = last(sphere, scheme, norm)
        assert found == pytest.approx(rate, abs=0.02)
        assert error < bound
    for failing in ("cotan-4", "cotan-8"):
        assert sphere.errors[failing]["one"][-1] > 1


def test_vertex_grid_along_the_axis():
    run = convergence(surfaces.cylinder(), chapter4.ALL, SIZES, "grid")
    rate, error = last(run, "finite_volume", "inf")
    assert rate == pytest.approx(2.00, abs=0.01)
    assert 1e-5 < error < 4e-5  # not exact
    for exact in ("liu", "cotan-6", "cotan-6'"):
        assert run.errors[exact]["inf"].max() < 1e-10
    assert run.errors["cotan-8"]["inf"][-1] == pytest.approx(0.125, abs=1e-4)


@pytest.mark.parametrize("surface", ["torus", "catenoid", "elliptic_paraboloid", "hyperboloid"])
def test_smooth_surfaces_are_second_order(surface):
    run = convergence(
        surfaces.SURFACES[surface](), ("finite_volume", "liu", "cotan-6", "cotan-8"), [32, 64, 128]
    )
    for scheme in ("finite_volume", "liu", "cotan-6"):
        rate, error = last(run, scheme, "inf")
        assert rate == pytest.approx(2.00, abs=0.03)
        assert error < 2e-2
    assert run.errors["cotan-8"]["one"][-1] > 0.1


@pytest.fixture(scope="module")
def quick(tmp_path_factory) -> tuple[dict[str, float], str, set[str]]:
    output = tmp_path_factory.mktemp("chapter4")
    console = Console(file=io.StringIO(), width=110)
    results = chapter4.main(output, quick=True, console=console)
    return results, console.file.getvalue(), {p.name for p in output.iterdir()}


def test_script_writes_every_figure(quick):
    _, printed, files = quick
    for figure in ("figure_4_1", "figure_4_2", "figure_4_3", "figure_4_4"):
        assert {f"{figure}.png", f"{figure}.svg"} <= files
    assert {"figure_4_2.csv", "figure_4_3.csv", "figure_4_4.csv", "chapter4_pillow.csv"} <= files
    assert "pillow_error_maps.html" in files
    assert "pillow_error_maps.png" in files or "no usable OpenGL" in printed
    assert "pillow_sphere, staggered: inf-norm" in printed


def test_script_figures_and_verdicts(quick):
    results, *_ = quick
    assert results["cylinder: finite_volume, inf"] < 1e-13
    assert results["factor of 4.1"] == pytest.approx(6, rel=1e-9)
    assert results["flux difference"] < 1e-13
    assert results["pillow: finite_volume, one-rate"] == pytest.approx(2.00, abs=0.01)
    verdicts = {(c.where, c.claim.split(",")[0]): c.verdict for c in chapter4.claims(results)}
    assert len(verdicts) == 12
    assert sum(v == "reproduced" for v in verdicts.values()) == 6
    assert sum(v == "reproduced only if ..." for v in verdicts.values()) == 5
    assert sum(v == "slip" for v in verdicts.values()) == 1


@pytest.mark.parametrize("spoiled", [0.5, 999.0, float("nan")])
def test_verdicts_come_from_the_figures(quick, spoiled):
    results = dict.fromkeys(quick[0], spoiled)
    assert {c.verdict for c in chapter4.claims(results)} == {"not reproduced"}
