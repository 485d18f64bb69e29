"""Rates of convergence; runs over refinements with their tables, CSV and dict."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from rich.console import Console

from quadcurv import surfaces
from quadcurv.comparison import NORMS
from quadcurv.refinement import convergence, fitted_rate, successive_rates


def printed(thing, width=80):
    console = Console(file=io.StringIO(), width=width)
    console.print(thing)
    return console.file.getvalue()


def test_power_laws_are_recovered() -> None:
    n = np.array([10, 20, 50, 200])
    for rate in (-2.0, 0.0, 1.0, 4.0):
        assert fitted_rate(n, 3 * n**-rate) == pytest.approx(rate, abs=1e-13)
        assert successive_rates(n, 3 * n**-rate) == pytest.approx([rate] * 3, abs=1e-13)


def test_fit_is_least_squares_in_the_logarithms() -> None:
    n, errors = np.array([8, 16, 64, 128]), np.array([1.0, 0.3, 0.02, 0.004])
    assert fitted_rate(n, errors) == pytest.approx(-np.polyfit(np.log(n), np.log(errors), 1)[0])
    assert successive_rates(n, errors)[1] == pytest.approx(np.log(0.3 / 0.02) / np.log(4))


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_zero_or_not_finite_errors_give_nan(bad: float) -> None:
    errors = [1.0, 0.25, bad, 0.01]
    assert np.isnan(fitted_rate([8, 16, 32, 64], errors))
    assert np.isnan(successive_rates([8, 16, 32, 64], errors)).tolist() == [False, True, True]


@pytest.mark.parametrize(
    ("sizes", "errors", "message"),
    [
        ([8, 16], [1.0], r"one length.*got shapes \(2,\) and \(1,\)"),
        ([8], [1.0], "at least two"),
        ([[8, 16]], [[1.0, 2.0]], "one-dimensional"),
        ([8, 8], [1.0, 2.0], "distinct"),
        ([0, 8], [1.0, 2.0], "positive"),
        ([8, np.inf], [1.0, 2.0], "finite"),
        ([8, 16], [1.0, -2.0], "errors must not be negative, got -2"),
    ],
)
def test_rejections(sizes: list, errors: list, message: str) -> None:
    for rates in (fitted_rate, successive_rates):
        with pytest.raises(ValueError, match=message):
            rates(sizes, errors)


def test_arguments_are_not_modified() -> None:
    errors = np.array([1.0, 0.0, 0.1])
    fitted_rate([1, 2, 3], errors)
    assert errors.tolist() == [1.0, 0.0, 0.1]


def test_convergence_table_csv_and_dict(tmp_path):
    run = convergence(surfaces.cylinder(), ["finite_volume", "cotan-6"], [16, (32, 32), 64])
    assert run.shapes == ((16, 16), (32, 32), (64, 64))
    assert run.rates("cotan-6", "inf") == pytest.approx([2, 2], abs=0.05)
    assert run.fitted_rate("cotan-6", "inf", last=2) == pytest.approx(run.rates("cotan-6", "inf")[-1])
    text = printed(run)
    assert "exact" in text
    assert "2.00" in text
    run.to_csv(tmp_path / "run.csv")
    with pytest.raises(IsADirectoryError):
        run.to_csv(tmp_path)
    rows = list(csv.DictReader((tmp_path / "run.csv").read_text().splitlines()))
    assert len(rows) == 2 * 3 * len(NORMS)
    assert float(rows[1]["error"]) == run.errors["finite_volume"]["one"][1]
    assert "inf-norm of the error in H" in run._repr_html_()
    as_dict = json.loads(json.dumps(run.to_dict(), allow_nan=False))
    assert as_dict["schemes"]["cotan-6"]["undefined"] == [0, 0, 0]


def test_convergence_rejects_a_single_shape_and_unknown_layouts():
    with pytest.raises(ValueError, match="shapes: a rate needs at least two"):
        convergence(surfaces.torus(), ["liu"], [8])
    with pytest.raises(ValueError, match="shapes: a rate needs at least two of different sizes"):
        convergence(surfaces.torus(), ["liu"], [8, 8])
    with pytest.raises(ValueError, match="layout must be"):
        convergence(surfaces.torus(), ["liu"], [8, 16], "hexagons")
    with pytest.raises(ValueError, match="6 panels, only layout 'faces' joins them"):
        convergence(surfaces.cubed_sphere(), ["liu"], [8, 16], "grid")


def test_surfaces_by_name():
    by_name = convergence("torus", "liu", [8, 16])
    assert by_name.to_dict() == convergence(surfaces.torus(), ["liu"], [8, 16]).to_dict()
    assert repr(by_name) == "Convergence(H on torus, staggered, 8x8, 16x16, by liu)"
    for wrong in ("klein_bottle", 3):
        with pytest.raises(
            ValueError, match=f"surface: expected a Surface or one of .*torus.*, got {wrong!r}"
        ):
            convergence(wrong, "liu", [8, 16])


@pytest.mark.parametrize("shapes", [[0, 8], ["8", 16], [8.0, 16], [(8, 8, 8), 16], 8, [8, -16], [8, None]])
def test_shapes_are_numbers_of_cells(shapes):
    with pytest.raises(ValueError, match="shapes: expected whole numbers of cells, at least 1"):
        convergence("torus", "liu", shapes)


def test_what_there_is_no_rate_of():
    run = convergence("torus", ["liu", "jet"], [8, 16])
    for ask in (run.rates, run.fitted_rate, run.rate_label, run.norm):
        with pytest.raises(ValueError, match=r"norm: expected one of one, two, inf, .*, got 'max'"):
            ask("liu", "max")
        with pytest.raises(ValueError, match="scheme: expected one of liu, jet, got 'cotan'"):
            ask("cotan", "inf")
    with pytest.raises(ValueError, match="last: expected a whole number from 2 to 2, got 3"):
        run.fitted_rate("liu", last=3)
    with pytest.raises(ValueError, match=r"quantity: expected one of mean_curvature, .*, got 'H'"):
        convergence("torus", "jet", [8, 16], quantity="H")
    with pytest.raises(ValueError, match="scheme: liu gives the mean curvature alone"):
        convergence("torus", "liu", [8, 16], quantity="k1")


@pytest.mark.parametrize("quantity", ["mean_curvature", "gaussian_curvature", "k1", "k2"])
def test_every_curvature_converges(quantity):
    run = convergence("torus", ["jet", "jet-2"], [16, 32, 64], "grid", quantity)
    assert run.rates("jet", "one")[-1] == pytest.approx(8, abs=0.1)
    assert run.rates("jet-2", "inf")[-1] == pytest.approx(2, abs=0.15)
    assert run.errors["jet"]["inf"][-1] < 1e-10
    symbol = {"mean_curvature": "H", "gaussian_curvature": "K"}.get(quantity, quantity)
    assert f"error in {symbol}, and rates" in printed(run)
    assert {row["quantity"] for row in run.rows()} == {quantity}


def test_gaussian_curvature_by_angles():
    run = convergence("torus", ["angle_defect", "jet"], [16, 32, 64], "grid", "gaussian_curvature")
    assert run.schemes == ("angle_defect", "jet")
    assert run.rates("angle_defect", "one")[-1] == pytest.approx(2, abs=0.1)


def test_vertices_left_out_are_told_of():
    run = convergence("cubed_sphere", ["liu"], [4, 8], "faces")
    assert "left out" not in printed(run)
    strip = surfaces.tanh_sheet()
    run = convergence(strip, ["cotan-6"], [6, 12], "grid")
    some = dict(run.undefined) | {"cotan-6": np.array([3, 0], np.int32)}
    object.__setattr__(run, "undefined", some)
    assert "(vertices left out: cotan-6 [3, 0])" in printed(run)
