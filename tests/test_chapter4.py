"""The figures of chapter 4: every case with its rate and an absolute bound."""

from __future__ import annotations

import numpy as np
import pytest
from scripts import assert_as_declared, assert_one_size_of_type, drawn

from comparisons import chapter4, common, printed
from comparisons.chapter4 import figures, measure
from comparisons.figures import STYLES
from comparisons.measured import Measured
from quadcurv import mean_curvature, mean_curvature_normal, surfaces
from quadcurv.refinement import convergence
from quadcurv.schemes import SCHEMES


@pytest.fixture(scope="module")
def found() -> Measured:
    return common.measure(chapter4)


def last(found: Measured, case: str, scheme: str, norm: str) -> tuple[float, float]:
    """Rate of the last doubling of the signed H, to 256 cells, and the error there."""
    key = f"{case}: {scheme}, {norm}-norm, signed"
    return found.numbers[f"{key}, last rate"], found.numbers[key]


def errors(found: Measured, case: str, scheme: str, norm: str = "one") -> np.ndarray:
    """Errors of the signed H on all grids."""
    return np.array(found.series[f"chapter4_{case.replace(' ', '_')}"][f"{scheme}, {norm}-norm, signed"])


def test_verdicts_and_report(found) -> None:
    assert_as_declared(chapter4, found)


@pytest.mark.parametrize("scheme", ["finite_volume", "liu"])
@pytest.mark.parametrize("f", [None, measure.wave])
@pytest.mark.parametrize("radius", [1.0, 0.3, 40.0])
def test_cylinder_is_exact_to_rounding(scheme, f, radius):
    for n in (16, 32, 64):
        mesh, *_ = surfaces.cylinder(radius, f).sample((n, n), "staggered")
        H = mean_curvature(mesh, scheme)
        assert np.abs(2 * radius * H - 1).max() < 1e-12


@pytest.mark.parametrize("case", ["cylinder", "wavy cylinder"])
def test_cylinder_keeping_the_neighbours_along_the_axis_is_exact(found, case):
    assert errors(found, case, "cotan-6'", "inf").max() < 1e-10


def test_cylinder_keeping_the_neighbours_around_it_is_second_order(found):
    rate, error = last(found, "cylinder", "cotan-6", "inf")
    assert rate == pytest.approx(2.00, abs=0.005)
    assert error == pytest.approx(1.88e-5, rel=0.01)
    # "Inf-norm mirrors exactly the one-norm" (Figure 4.2).
    one, largest = (errors(found, "cylinder", "cotan-6", norm)[1:] for norm in ("one", "inf"))
    assert np.allclose(one, largest, rtol=1e-6, atol=0)
    rate, error = last(found, "wavy cylinder", "cotan-6", "one")
    assert rate == pytest.approx(2.00, abs=0.01)
    assert error < 4e-4


def test_cylinder_valence_eight_and_four_by_area(found):
    assert errors(found, "cylinder", "cotan-8")[-1] == pytest.approx(0.125, abs=1e-4)
    assert errors(found, "cylinder", "cotan-4")[-1] == pytest.approx(0.25, abs=1e-4)
    for scheme, bound in (("cotan-8-voronoi", 2.1e-5), ("cotan-4-voronoi", 1.7e-6)):
        rate, error = last(found, "cylinder", scheme, "inf")
        assert rate == pytest.approx(2.00, abs=0.01)
        assert error < bound
        # The area is at fault on orthogonal grids only.
        assert abs(last(found, "wavy cylinder", scheme, "one")[0]) < 0.01
        assert errors(found, "wavy cylinder", scheme)[-1] > 0.4
    assert errors(found, "wavy cylinder", "cotan-8")[-1] > 0.4


@pytest.mark.parametrize(
    ("scheme", "norm", "rate", "bound"),
    [
        ("finite_volume", "one", 2.00, 1.6e-5),
        ("liu", "one", 1.96, 1.0e-5),
        ("finite_volume", "inf", 0.98, 3.0e-3),
        ("liu", "inf", 0.98, 1.0e-3),
    ],
)
def test_pillow_sphere(found, scheme, norm, rate, bound):
    measured, error = last(found, "pillow", scheme, norm)
    assert measured == pytest.approx(rate, abs=0.015)
    assert error < bound


def test_pillow_sphere_cotan(found):
    rates = -np.diff(np.log2(errors(found, "pillow", "cotan-6")[1:]))
    assert (np.diff(rates) > 0).all()  # rising to 1
    assert 0.80 < rates[-1] < 1
    for scheme in ("cotan-6", "cotan-6'", "cotan-6-voronoi", "cotan-8", "cotan-8-voronoi"):
        assert last(found, "pillow", scheme, "inf")[0] == pytest.approx(-1, abs=0.05)
    for scheme in ("cotan-4", "cotan-8", "cotan-4-voronoi", "cotan-8-voronoi"):
        assert errors(found, "pillow", scheme)[-1] > 0.4


@pytest.mark.parametrize(
    ("scheme", "rate", "bound"),
    [("finite_volume", 2.0, 6.1e-5), ("liu", 4.0, 6e-10), ("cotan-6", 2.0, 2.4e-4)],
)
def test_sphere_without_poles(found, scheme, rate, bound):
    for norm in ("one", "inf"):
        measured, error = last(found, "sphere", scheme, norm)
        assert measured == pytest.approx(rate, abs=0.02)
        assert error < bound
    for failing in ("cotan-4", "cotan-8"):
        assert errors(found, "sphere", failing)[-1] > 1


def test_vertex_grid_along_the_axis(found):
    rate, error = last(found, "cylinder vertices", "finite_volume", "inf")
    assert rate == pytest.approx(2.00, abs=0.01)
    assert 1e-5 < error < 4e-5  # not exact
    for exact in ("liu", "cotan-6", "cotan-6'"):
        assert errors(found, "cylinder vertices", exact, "inf").max() < 1e-10
    assert errors(found, "cylinder vertices", "cotan-8", "inf")[-1] == pytest.approx(0.125, abs=1e-4)


@pytest.mark.parametrize(
    ("case", "scheme", "one", "largest"),
    [
        ("pillow", "finite_volume", 2.00, 0.96),
        ("pillow", "liu", 1.87, 0.93),
        ("pillow", "cotan-6", 0.71, -1.31),
        ("pillow vertices", "finite_volume", 1.84, 0.95),
        ("pillow vertices", "liu", 1.92, 0.80),
        ("pillow vertices", "cotan-6", 0.83, -1.01),
    ],
)
def test_kappa_on_both_layouts_of_the_pillow_grid(found, case, scheme, one, largest):
    for norm, rate in (("one", one), ("inf", largest)):
        assert found.numbers[f"{case}: {scheme}, {norm}-norm, rate"] == pytest.approx(rate, abs=0.01)


@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")  # valence 6 diverges there
def test_both_quantities_are_those_of_the_package(found):
    run = convergence(surfaces.pillow_sphere(), ("finite_volume", "cotan-6"), [(32, 16), (64, 32)])
    for scheme in run.schemes:
        np.testing.assert_allclose(errors(found, "pillow", scheme)[1:3], run.norm(scheme, "one"), rtol=1e-9)
        mesh, *_ = surfaces.pillow_sphere().sample((64, 32), "staggered")
        kappa = np.linalg.norm(mean_curvature_normal(mesh, scheme), axis=-1)
        column = found.series["chapter4_pillow"][f"{scheme}, inf-norm"]
        assert column[2] == pytest.approx(np.abs(kappa - 1).max(), rel=1e-9)


@pytest.mark.parametrize("surface", ["torus", "catenoid", "elliptic_paraboloid", "hyperboloid"])
def test_smooth_surfaces_are_second_order(surface):
    run = convergence(
        surfaces.SURFACES[surface](), ("finite_volume", "liu", "cotan-6", "cotan-8"), [32, 64, 128]
    )
    for scheme in ("finite_volume", "liu", "cotan-6"):
        assert run.rates(scheme, "inf")[-1] == pytest.approx(2.00, abs=0.03)
        assert run.errors[scheme]["inf"][-1] < 2e-2
    assert run.errors["cotan-8"]["one"][-1] > 0.1


def test_literal_fluxes_differ_where_they_should():
    points = surfaces.torus().sample((8, 8))[0].points
    assert (
        np.abs(printed.printed_fluxes(points) - 2 * printed.printed_liu(points, divided=False)).max() < 1e-14
    )
    wrong = printed.printed_edge(points[1:] - points[:-1], points[:-1] - points[1:] + 1, "3.29")
    right = printed.printed_edge(points[1:] - points[:-1], points[:-1] - points[1:] + 1)
    assert np.abs(wrong - right).max() > 1e-2


def test_figures(found):
    made = drawn(chapter4, found)
    assert set(made) == {"figure_4_1", "figure_4_2", "figure_4_3", "figure_4_4"}
    assert_one_size_of_type(made)
    # Legends lie below the axes, off the data.
    for stem in ("figure_4_2", "figure_4_3", "figure_4_4"):
        for axes in made[stem].axes:
            assert axes.get_legend().get_window_extent().y1 < axes.get_window_extent().y0


def test_one_colour_and_marker_a_scheme():
    laplacians = {name for name, scheme in SCHEMES.items() if hasattr(scheme, "assemble")}
    assert laplacians | set(measure.COMPARED) <= set(STYLES)
    looks = [tuple(sorted(style.items())) for style in STYLES.values()]
    assert len(set(looks)) == len(looks)


def test_page_of_all_operators(tmp_path):
    script = type(chapter4)("pages")
    script.FIGURES, script.PAGES = {}, figures.PAGES
    common.draw(script, Measured(), tmp_path)
    page = (tmp_path / "pillow_error_maps.html").read_text(encoding="utf-8")
    assert all(name in page for name in ("finite_volume", "bilinear", "cotan-8-voronoi"))


def test_maps_of_four_schemes():
    maps = figures.MAPS["chapter4_pillow_map"]()
    assert len(maps.panels) == 4
    for mesh, e in maps.panels.values():
        assert e.shape == mesh.shape
