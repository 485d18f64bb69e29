import csv

import numpy as np
import pytest

from comparisons import chapter3, common, reproduction
from quadcurv import StaggeredGrid, mean_curvature_normal, viewing
from quadcurv.surfaces import torus

FIGURES = ["3_1", "3_4", "3_5", "3_7", "3_9", "3_10", "3_12", "3_henneberg", "3_others"]
MAPS = ["3_2", "3_3", "3_6", "3_8", "3_11", "3_henneberg_map"]


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    return tmp_path_factory.mktemp("chapter3") / "new"


@pytest.fixture(scope="module")
def results(output):
    return chapter3.main(output, quick=True)


def test_files(output, results) -> None:
    expected = {f"figure_{name}.{kind}" for name in FIGURES for kind in ("png", "svg", "csv")}
    assert {file.name for file in output.iterdir()} == expected - {"figure_3_1.csv"}
    with open(output / "figure_3_5.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["n"]) for row in rows] == [16, 32, 64, 128, 256]
    assert float(rows[-1]["inf-norm"]) == results["helicoid: inf-norm at 256"]


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


def test_errors_of_enneper_are_around_the_origin(results) -> None:
    assert results["enneper: where the largest error is"] < 0.7
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


def test_counted_formulas_give_the_schemes_curvature() -> None:
    mesh, *_ = torus().sample((12, 16), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    primal, dual = mesh.primal[1:-1, 1:-1], mesh.dual[:-1, :-1]
    Hn = mean_curvature_normal(mesh, "finite_volume")
    for formula in (chapter3.printed_curvature_normal, chapter3.staggered_curvature_normal):
        np.testing.assert_allclose(formula(primal, dual), Hn, atol=1e-12)
    grid, *_ = torus().sample((12, 16))
    np.testing.assert_allclose(
        chapter3.shared_curvature_normal(grid.points),
        mean_curvature_normal(grid, "finite_volume"),
        atol=1e-12,
    )
    liu = mean_curvature_normal(grid, "liu")
    np.testing.assert_allclose(chapter3.shared_curvature_normal(grid.points, "liu"), liu, atol=1e-12)
    np.testing.assert_allclose(chapter3.printed_liu(grid.points), liu, atol=1e-12)


def test_operations(results) -> None:
    counts = {k.removeprefix("operations: "): v for k, v in results.items() if k.startswith("operations")}
    assert counts == {
        "difference to a larger grid": 0,
        "as printed, each cell on its own": 244,
        "as printed, each edge once": 148,
        "primal/dual": 102,
        "vertices": 80,
        "Liu as printed": 384,
        "Liu, vertices": 61,
    }


def test_counting() -> None:
    x, y = (np.array([[[v, 2.0, 3.0]]]) for v in (1.0, 4.0))
    assert chapter3.operations(chapter3.dot, x, y) == 5
    assert chapter3.operations(chapter3.cross, x, y) == 9
    assert chapter3.operations(lambda a, b: np.sqrt(2 / a + b), x, y) == 9
    assert chapter3.operations(lambda a, b: -a, x, y) == 0


def test_time_follows_a_quadratic(results) -> None:
    assert 0 < results["time: n^2 coefficient (ns)"] < 2000
    assert results["time: 1 - R^2"] < 0.2


def test_report_says_what_is_measured(results) -> None:
    assert not reproduction.drift(
        reproduction.table(chapter3.claims(results)), reproduction.REPORT.read_text(encoding="utf-8")
    )


@pytest.fixture
def panels():
    mesh, *_ = torus().sample((8, 6), "staggered")
    values = np.logspace(-7, 0, 48).reshape(8, 6)
    values[0, 0] = np.nan
    vertices, *_ = torus().sample((8, 6), "faces")
    return {"cells": (mesh, values), "vertices": (vertices, np.full(48, 1e-3))}


def test_maps(tmp_path, panels) -> None:
    if viewing.opengl_problem():
        pytest.skip("nothing can render here")
    assert common.save_maps(tmp_path, "map", panels, "error", (-5, -1)) is None
    assert {f.name for f in tmp_path.iterdir()} == {"map.png", "map.svg", "map.csv"}
    assert (tmp_path / "map.png").stat().st_size > 20_000
    with open(tmp_path / "map.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 96
    assert float(rows[47]["value"]) == 1.0


def test_pages_where_nothing_can_render(tmp_path, panels, monkeypatch) -> None:
    monkeypatch.setattr(viewing, "opengl_problem", lambda: "no usable OpenGL")
    assert common.save_maps(tmp_path, "map", panels, "error", (-5, -1)) == "no usable OpenGL"
    assert {f.name for f in tmp_path.iterdir()} == {"map_1.html", "map_2.html", "map.csv"}


def test_all_maps(tmp_path, monkeypatch) -> None:
    drawn = {}
    monkeypatch.setattr(
        chapter3, "save_maps", lambda output, stem, panels, *_, **__: drawn.update({stem: panels})
    )
    chapter3.maps(tmp_path)
    assert set(drawn) == {f"figure_{name}" for name in MAPS}
    low, high = (10.0**power for power in chapter3.MINIMAL)
    for stem in ("figure_3_3", "figure_3_6"):
        for mesh, e in drawn[stem].values():
            assert e.shape == mesh.shape
            assert np.mean((e > low) & (e < high)) > 0.8
    assert max(e.max() for _, e in drawn["figure_3_8"].values()) < 10.0 ** chapter3.SPHERES[1]


def test_below() -> None:
    assert common.below(3e-13, 11) == "below 1e-11"
    assert common.below(3e-10, 11) == "3.0e-10"
