from __future__ import annotations

import csv

import numpy as np
import pytest
from scripts import assert_as_declared, assert_one_size_of_type, drawn

from comparisons import chapter3, common, maps, printed
from comparisons.chapter3 import figures, measure
from quadcurv import StaggeredGrid, mean_curvature_normal, viewing
from quadcurv.surfaces import torus

MAPS = ["3_2", "3_3", "3_6", "3_8", "3_11", "3_henneberg_map"]


@pytest.fixture(scope="module")
def found():
    return common.measure(chapter3)


@pytest.fixture(scope="module")
def results(found):
    return found.numbers


def test_verdicts_and_report(found) -> None:
    assert_as_declared(chapter3, found)


def test_figures_and_columns(found, tmp_path) -> None:
    assert_one_size_of_type(drawn(chapter3, found))
    common.save_series(found, tmp_path)
    with open(tmp_path / "figure_3_5.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["n"]) for row in rows] == [16, 32, 64, 128, 256]
    assert float(rows[-1]["inf-norm"]) == found.numbers["helicoid: inf-norm at 256"]


@pytest.mark.parametrize(
    ("surface", "one", "largest"),
    [
        ("catenoid", 1.57e-6, 2.55e-6),
        ("helicoid", 7.2e-7, 9.9e-7),
        ("enneper", 9.3e-7, 2.2e-6),
        ("sphere", 9.8e-6, 1.9e-5),
        ("hyperboloid", 2.1e-6, 3.9e-6),
        ("elliptic_paraboloid", 5.4e-6, 6.2e-5),
        ("hyperbolic_paraboloid", 4.6e-6, 1.7e-5),
        ("tanh_sheet", 1.2e-5, 3.6e-5),
        ("torus", 2.7e-5, 4.0e-5),
    ],
)
def test_second_order_in_both_norms(results, surface, one, largest) -> None:
    for norm, bound in (("one-norm", one), ("inf-norm", largest)):
        assert results[f"{surface}: {norm} rate"] == pytest.approx(2, abs=0.02)
        assert 0.9 * bound < results[f"{surface}: {norm} at 256"] < bound


def test_pillow_sphere_is_second_order_in_the_mean_and_first_on_its_seams(results) -> None:
    assert results["pillow_sphere: one-norm rate"] == pytest.approx(2.00, abs=0.01)
    assert results["pillow_sphere: inf-norm rate"] == pytest.approx(0.98, abs=0.01)
    assert results["pillow_sphere: one-norm at 256"] == pytest.approx(1.49e-5, rel=0.01)
    assert results["pillow_sphere: inf-norm at 256"] == pytest.approx(2.90e-3, rel=0.01)
    assert results["pillow: largest error off the seams over on them"] < 0.02
    assert results["pillow: largest over smallest cell, 128"] == pytest.approx(1.664, abs=0.001)
    assert results["sphere with poles: largest over smallest cell, 128"] > 80


def test_two_grids_of_the_sphere(results) -> None:
    assert results["sphere to 80 over pillow, median"] == pytest.approx(4.63, abs=0.01)
    assert results["sphere to 80 over pillow, one-norm"] == pytest.approx(1.05, abs=0.01)
    assert results["sphere to 60 over pillow, one-norm"] == pytest.approx(0.65, abs=0.01)
    assert results["sphere to 80 over pillow, inf-norm"] < 0.02


@pytest.mark.parametrize("surface", ["cylinder", "wavy cylinder", "plane"])
def test_exact(results, surface) -> None:
    assert results[f"{surface}: largest error"] < 1e-11


def test_signed_curvature_of_the_helicoid_is_rounding(results) -> None:
    assert results["helicoid: signed, inf-norm at 256"] < 1e-11
    assert results["helicoid: inf-norm at 256"] > 9e-7
    assert results["catenoid: signed, inf-norm at 256"] == pytest.approx(
        results["catenoid: inf-norm at 256"], rel=1e-3
    )


def test_henneberg_fails_only_around_its_singular_points(results) -> None:
    assert results["henneberg: near, at 256"] == pytest.approx(0.0313, abs=2e-4)
    assert results["henneberg: near, rate"] == pytest.approx(0, abs=0.01)
    assert results["henneberg: far, at 256"] < 1.3e-4
    assert results["henneberg: far, rate"] == pytest.approx(2, abs=0.06)
    assert results["henneberg: signed, rate"] == pytest.approx(1, abs=0.01)
    assert results["henneberg: turn of the normal around a singular point"] < 0.0021


def test_errors_of_enneper_are_around_the_origin_but_do_not_vanish(results) -> None:
    assert results["enneper: where the largest error is"] < 0.7
    assert results["enneper: largest error on the figure's edge over all"] == pytest.approx(0.394, abs=0.01)
    assert results["enneper: largest error beyond 2.5 over all"] < 0.03


def test_slips(results) -> None:
    r = results
    assert r["corrected: error at 64"] / r["corrected: error at 128"] == pytest.approx(4, abs=0.05)
    assert r["corrected: error at 128"] < 1.1e-4
    assert r["3.29: error at 128"] == pytest.approx(0.069, abs=0.001)
    assert r["3.34: error at 128"] == pytest.approx(0.317, abs=0.001)
    assert r["3.79: off the catenoid, Z = xi"] < 1e-14
    assert r["3.79: off the helicoid, Z = eta"] < 1e-14
    assert r["3.79: off the catenoid, Z = eta"] > 9
    assert r["3.22: largest cosine on the helicoid"] < 1e-6
    assert r["3.22: H n . outward normal on the sphere"] == pytest.approx(-1, abs=0.01)


def test_slips_of_the_proof_by_finite_differences() -> None:
    # t^(2) of (3.5) on the edge, against the solution of t_(i) . t^(j) = delta_ij (3.6).
    R, theta, h, dz = 1.5, 0.7, 0.2, 0.3
    angles = np.array([theta, theta + h])
    first = np.diff(np.stack((R * np.cos(angles), R * np.sin(angles), [0, dz]), axis=1), axis=0)[0]
    basis = np.stack((first, [0, 0, 1], np.cross(first, (0, 0, 1))))
    second = np.linalg.solve(basis, (0, 1, 0))
    half = 2 * R * np.sin(h / 2)
    assert second == pytest.approx(
        [dz * np.sin(theta + h / 2) / half, -dz * np.cos(theta + h / 2) / half, 1], rel=1e-12
    )
    ratios = printed.cylinder_edge(R, theta, h, dz)
    assert ratios["3.49"] == pytest.approx(-dz * np.sin(theta + h / 2) / half / second[0])
    assert ratios["3.59"] == pytest.approx(-1)


def test_counted_formulas_give_the_schemes_curvature() -> None:
    mesh, *_ = torus().sample((12, 16), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    primal, dual = mesh.primal[1:-1, 1:-1], mesh.dual[:-1, :-1]
    Hn = mean_curvature_normal(mesh, "finite_volume")
    for formula in (printed.printed_curvature_normal, printed.staggered_curvature_normal):
        np.testing.assert_allclose(formula(primal, dual), Hn, atol=1e-12)
    grid, *_ = torus().sample((12, 16))
    fv, liu = (mean_curvature_normal(grid, scheme) for scheme in ("finite_volume", "liu"))
    np.testing.assert_allclose(printed.shared_curvature_normal(grid.points), fv, atol=1e-12)
    np.testing.assert_allclose(printed.shared_curvature_normal(grid.points, "liu"), liu, atol=1e-12)
    np.testing.assert_allclose(printed.printed_liu(grid.points), liu, atol=1e-12)


def test_operations(results) -> None:
    counts = {k.removeprefix("operations: "): v for k, v in results.items() if k.startswith("operations:")}
    assert counts == {
        "as printed, each cell on its own": 244,
        "as printed, each edge once": 148,
        "primal/dual": 102,
        "vertices": 80,
        "Liu as printed": 384,
        "Liu, vertices": 61,
        "counts that are 197": 0,
    }
    assert printed.operations(printed.staggered_curvature_normal, *measure.torus_grid(12)) == 102


def test_counting() -> None:
    x, y = (np.array([[[v, 2.0, 3.0]]]) for v in (1.0, 4.0))
    assert printed.operations(printed.dot, x, y) == 5
    assert printed.operations(printed.cross, x, y) == 9
    assert printed.operations(lambda a, b: np.sqrt(2 / a + b), x, y) == 9
    assert printed.operations(lambda a, b: -a, x, y) == 0


def test_bytes_are_those_of_the_arrays(results) -> None:
    mesh, *_ = torus().sample((100, 100), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    read = mesh.primal[1:-1, 1:-1].nbytes + mesh.dual[:-1, :-1].nbytes
    written = mean_curvature_normal(mesh, "finite_volume").nbytes
    assert results["bytes: each cell on its own"] == (read + written) / 100**2


def test_a_cell_depends_on_eight_points(results) -> None:
    assert results["points that a cell's H depends on, itself not counted"] == 8
    assert results["blocks against the whole"] == 0


@pytest.mark.parametrize(("power", "holds"), [(1, False), (2, True), (3, False)])
def test_the_test_of_time_knows_n_squared_from_others(power, holds) -> None:
    (claim,) = (c for c in chapter3.CLAIMS if c.claim == "The time is O(n^2)")
    overhead = 1.5
    times = overhead + 35 * (measure.TIMED / measure.TIMED[-1]) ** power
    exponent = measure.growth(measure.TIMED, times)
    judged = claim.judged({"time: exponent": exponent, "operations: primal/dual": 102})
    assert (judged.verdict == "reproduced") == holds


def test_time_is_measured(found) -> None:
    times = np.asarray(found.series["figure_3_12"]["time (ms)"])
    assert (times > 0).all()
    assert found.numbers["time: exponent"] == measure.growth(measure.TIMED, times)


@pytest.fixture
def panels():
    mesh, *_ = torus().sample((8, 6), "staggered")
    values = np.logspace(-7, 0, 48).reshape(8, 6)
    values[0, 0] = np.nan
    vertices, *_ = torus().sample((8, 6), "faces")
    return maps.Maps({"cells": (mesh, values), "vertices": (vertices, np.full(48, 1e-3))}, "error", (-5, -1))


def test_maps(tmp_path, panels) -> None:
    if viewing.opengl_problem():
        pytest.skip("nothing can render here")
    assert maps.save_maps(panels, tmp_path, "map") is None
    assert {f.name for f in tmp_path.iterdir()} == {"map.png", "map.svg", "map.csv"}
    assert (tmp_path / "map.png").stat().st_size > 20_000
    with open(tmp_path / "map.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 96
    assert float(rows[47]["value"]) == 1.0


def test_panels_have_one_scale(tmp_path) -> None:
    if viewing.opengl_problem():
        pytest.skip("nothing can render here")
    small, large = (torus(2.0 * s, 1.0 * s).sample((24, 24))[0] for s in (1, 2))
    figure = viewing.surfaces_figure(
        {"small": (small, np.ones(576)), "large": (large, np.ones(576))}, camera=(1.0, 0.0, 0.0)
    )
    widths = [axes.images[0].get_array().shape[1] for axes in figure.axes]
    assert widths[1] / widths[0] == pytest.approx(2, abs=0.02)
    heights = {np.ptp(axes.get_ylim()) for axes in figure.axes}
    assert len(heights) == 1


def test_pages_where_nothing_can_render(tmp_path, panels, monkeypatch) -> None:
    monkeypatch.setattr(viewing, "opengl_problem", lambda: "no usable OpenGL")
    assert maps.save_maps(panels, tmp_path, "map") == "no usable OpenGL"
    assert {f.name for f in tmp_path.iterdir()} == {"map_1.html", "map_2.html", "map.csv"}


def test_all_maps() -> None:
    made = {stem: make() for stem, make in chapter3.MAPS.items()}
    assert set(made) == {f"figure_{name}" for name in MAPS}
    low, high = (10.0**power for power in figures.MINIMAL)
    for stem in ("figure_3_3", "figure_3_6"):
        for mesh, e in made[stem].panels.values():
            assert e.shape == mesh.shape
            assert np.mean((e > low) & (e < high)) > 0.8
    assert max(e.max() for _, e in made["figure_3_8"].panels.values()) < 10.0 ** figures.SPHERES[1]
