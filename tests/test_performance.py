"""The comparison of speeds runs; what it measures on a busy machine is not asserted."""

from __future__ import annotations

import numpy as np
import pytest

import quadcurv as qc
from comparisons import fresh, operations, performance
from comparisons.goals import Ratio


@pytest.mark.filterwarnings("default")
def test_quick_run(tmp_path):
    found = performance.main(tmp_path, quick=True)
    report = found["report"].read_text()
    assert found["report"].parent == tmp_path
    for name in (
        "copy",
        "libigl",
        "VTK",
        "numpy",
        "scipy coo->csr",
        "jet",
        "peak memory",
        "first call",
        "nothing compiled",
        "igl.cotmatrix(V, I, C)",
    ):
        assert name in report
    names = {(r.name, r.against, r.threads) for r in found["ratios"]}
    assert ("finite_volume, open grid", "copy", 2) in names
    assert ("stiffness in place", "igl.cotmatrix", 1) in names
    for scheme in performance.QUAD_MATRICES:
        assert (f"stiffness, {scheme}", "igl.cotmatrix(V, I, C)", 2) in names
    assert all(0 < r.low <= r.median <= r.high for r in found["ratios"])
    for figure in ("performance-time", "performance-goals"):
        assert (tmp_path / f"{figure}.png").stat().st_size > 10_000
        assert (tmp_path / f"{figure}.svg").exists()


def test_operations_are_less_than_half_of_the_thesis():
    """By hand: cross 9, dot 5, root, quotient, 3 to scale; 2 crosses; ring's cross, dot, root, quotient."""
    counted = operations.operations()
    assert counted["normal"] == 9 + 5 + 1 + 1 + 3
    assert counted["fluxes"] == 9 + 9
    assert counted["area"] == 9 + 5 + 1 + 1
    assert counted["all"] == 12 + 19 + 18 + 9 + 16 + 3
    assert operations.operations(newton=True)["all"] - counted["all"] == 2 * (3 + 5 + 3 + 7 - 2)
    assert counted["all"] < operations.THESIS / 2


def test_the_numpy_scheme_is_the_scheme():
    points = performance.torus(24)
    Hn = qc.mean_curvature_normal(qc.QuadGrid(points, (True, True)), "finite_volume")
    np.testing.assert_allclose(performance.numpy_finite_volume(points), Hn, rtol=0, atol=1e-13)


def test_growth_is_the_slope():
    times = {n: {"job": 3e-9 * n**1.25 * np.ones(3)} for n in (100, 1000, 10_000)}
    assert performance.growth(times)["job"] == pytest.approx(1.25, abs=1e-12)


@pytest.mark.parametrize(
    ("median", "must", "aim", "verdict"),
    [
        (1.4, 2, 1.5, "aim"),
        (1.9, 2, 1.5, "must"),
        (2.1, 2, 1.5, "missed"),
        (70, 25, 60, "aim"),
        (9, 10, 20, "missed"),
    ],
)
def test_verdicts_know_which_way_is_better(median, must, aim, verdict):
    assert Ratio("a", "b", 1, 1, median, median, median, must, aim).verdict == verdict


def test_another_checkout_is_measured_in_turn():
    """Beside itself every warm call takes about as long; a folder without quadcurv of its own is told."""
    found = list(fresh.beside(fresh.HERE, 3, (64, 32, 16)))
    names = [r.name for r in found]
    assert len(set(names)) == len(names) == 13
    assert all(r.against == "the other checkout" and 0.1 < r.median < 10 for r in found)


def test_a_job_that_fails_is_told():
    with pytest.raises(RuntimeError, match="ended with"):
        fresh.Worker(fresh.HERE, 0, 0, 0)
