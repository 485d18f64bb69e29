from __future__ import annotations

import csv

import numpy as np
import pytest
from scripts import assert_as_declared, assert_one_size_of_type, drawn

from comparisons import chapter2, common, figures, fresnel
from comparisons.chapter2 import measure
from comparisons.measured import Columns, rate_in
from quadcurv.curves import curvature, euler_spiral, staggered
from quadcurv.tables import write_csv

FIGURES = ["2_1", "2_2", "2_3", "2_4", "2_5", "2_6", "2_7", "2_exact", "2_open_ends", "2_uneven"]


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    return tmp_path_factory.mktemp("chapter2") / "new"


@pytest.fixture(scope="module")
def found(output):
    return common.main(chapter2, output)


def test_files(output, found) -> None:
    expected = {f"figure_{name}.{kind}" for name in FIGURES for kind in ("png", "svg", "csv")}
    assert {file.name for file in output.iterdir()} == expected - {"figure_2_1.csv"}
    with open(output / "figure_2_3.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["n"]) for row in rows] == [16, 32, 64, 128, 256, 512, 1024]
    assert float(rows[4]["polyline"]) == found.numbers["ellipse polyline, error at 256"]


def test_verdicts_and_report(found) -> None:
    assert_as_declared(chapter2, found)


def test_figures(found) -> None:
    assert_one_size_of_type(drawn(chapter2, found))


@pytest.mark.parametrize(
    ("name", "value", "tolerance"),
    [
        ("ellipse primal/dual points, rate", 2.0, 0.01),
        ("ellipse polyline, rate", 2.0, 0.01),
        ("spiral rate", 4.0, 0.1),
        ("helix curvature, rate", 2.0, 0.02),
        ("helix torsion, rate", 2.0, 0.02),
        ("arc curvature, rate at the ends", 2.0, 0.05),
        ("helix torsion, rate at the ends", 2.3, 0.15),
        ("uneven, polyline, rate", 2.0, 0.1),
        ("uneven, torsion, rate", 2.0, 0.2),
        ("arc curvature, ends over inside at 256", 1.0, 0.1),
        ("helix torsion, ends over inside at 256", 1.7, 0.1),
        ("2.45 x component of H at t = 0", -1.0, 1e-12),
        ("2.54 printed torsion of the helix", 0.8, 0.003),
        ("2.54 corrected torsion of the helix", 0.4, 3e-5),
        ("uneven, primal halfway, error at 256", 0.86, 0.01),
        ("uneven, printed torsion, error at 256", 0.32, 0.01),
        ("torsion of the left-handed helix", -0.4, 3e-4),
    ],
)
def test_measured(found, name, value, tolerance) -> None:
    assert found.numbers[name] == pytest.approx(value, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "bound"),
    [
        ("circle error to 256", 1e-12),
        ("line turn to 256", 1e-12),
        ("ellipse primal/dual points, error at 256", 5e-4),
        ("ellipse polyline, error at 256", 1e-3),
        ("spiral error at 8192", 1.6e-9),
        ("spiral, computed, at 32768 over eps/h^2", 10),
        ("helix curvature, error at 256", 3.3e-5),
        ("helix torsion, error at 256", 2.5e-5),
        ("uneven, dual halfway, error at 256", 2e-12),
        ("uneven, polyline, error at 256", 2e-5),
        ("uneven, torsion, error at 256", 7e-5),
        ("2.31 largest cosine of printed and exact normal", 0.03),
    ],
)
def test_bounds(found, name, bound) -> None:
    assert 0 < found.numbers[name] < bound


def test_rounding_of_integrals_and_of_positions(found) -> None:
    shares = [found.numbers[f"spiral, {k}, at 32768 over eps/h^2"] for k in ("computed", "rounded", "exact")]
    assert shares[0] > 1.8 * shares[1]
    assert shares[1] > 1.2 * shares[2]


def test_precision_of_the_fresnel_integrals() -> None:
    # The tail of Figure 2.5: correctly rounded points lower it, but rounding is still what it is.
    mpmath = pytest.importorskip("mpmath")
    t = np.linspace(*euler_spiral().domain, 32768)[15300:15400]
    unit = mpmath.sqrt(mpmath.pi / 2)

    def rounded(t) -> np.ndarray:
        z = [mpmath.mpf(float(x)) / unit for x in t]
        return np.array([[float(unit * f(x)) for f in (mpmath.fresnelc, mpmath.fresnels)] for x in z])

    errors = []
    with mpmath.workdps(30):
        for mapping in (euler_spiral().mapping, rounded):
            points, dual = staggered(mapping, t)
            errors.append(np.abs(curvature(points, dual=dual) - 2 * np.abs(t))[1:-1].max())
        assert np.abs(euler_spiral().mapping(t) - rounded(t)).max() < 1e-15
    unavoidable = np.finfo(float).eps * (32768 / 60) ** 2
    assert 0.3 * unavoidable < errors[1] < 2 * unavoidable
    assert 3 * errors[1] < errors[0] < 10 * unavoidable


def test_fresnel_integrals_are_good_to_the_last_place() -> None:
    mpmath = pytest.importorskip("mpmath")
    t = np.linspace(-30, 30, 2 * 4096 - 1)
    steps = fresnel.increments(t)
    points = fresnel.positions(steps)
    with mpmath.workdps(40):
        unit = mpmath.sqrt(mpmath.pi / 2)
        for j in (0, 1234, 4000, 4095, 4096, 7000, 8189):
            first, last = (mpmath.mpf(float(x)) / unit for x in t[j : j + 2])
            for k, f in enumerate((mpmath.fresnelc, mpmath.fresnels)):
                exact = unit * (f(last) - f(first))
                assert abs(steps[j, k] - exact) < 4e-16 * np.linalg.norm(steps[j])
                assert abs(points[j + 1, k] - unit * f(last)) < 2.3e-16
    assert (points[len(points) // 2] == 0).all()


def test_the_spiral_is_quartic_on_even_steps_of_its_length_alone(found) -> None:
    assert found.numbers["spiral rate"] > 3.9
    assert found.numbers["spiral rate on steps that vary slowly"] == pytest.approx(2, abs=0.02)


def test_figures_are_the_same_on_every_run(tmp_path) -> None:
    @figures.paper_style
    def draw(folder) -> None:
        fig, axes = figures.figure()
        axes.plot([1, 2, 3], label="a")
        axes.legend()
        figures.save_figure(fig, folder, "figure")

    for folder in ("first", "second"):
        draw(tmp_path / folder)
    for kind in ("png", "svg"):
        assert len({(tmp_path / f / f"figure.{kind}").read_bytes() for f in ("first", "second")}) == 1


def test_columns(tmp_path) -> None:
    columns = Columns({"n": np.array([8, 16, 32]), "e": [1.0, 0.25, 0.0625]})
    assert columns.at(16, "e") == 0.25
    assert rate_in(columns, "e", 8) == pytest.approx(2)
    assert np.isnan(rate_in(Columns({"n": [8, 16], "e": [1.0, 0.0]}), "e", 8))
    write_csv(tmp_path / "a.csv", {"x": [1, 2], "y": [0.1, 1 / 3]})
    assert (tmp_path / "a.csv").read_text() == "x,y\n1,0.1\n2,0.3333333333333333\n"
    with pytest.raises(ValueError, match="length"):
        write_csv(tmp_path / "b.csv", {"a": [1, 2], "b": [1]})


def test_command_line(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr("sys.argv", ["chapter2", "--quick", "--output", str(tmp_path)])
    options = common.arguments("text")
    assert options.quick
    assert options.output == tmp_path
    monkeypatch.setattr("sys.argv", ["chapter2"])
    assert common.arguments(None).output.parts[-2:] == ("comparisons", "output")


@pytest.mark.parametrize("spoiled", [False, True])
def test_command_prints_claims_first_in_80_columns_and_exits(monkeypatch, tmp_path, capsys, spoiled) -> None:
    steps = {name: chapter2.STEPS[name] for name in chapter2.STEPS}
    if spoiled:
        steps["ellipse"] = lambda into: (
            measure.ellipse_convergence(into),
            into.numbers.update({"ellipse primal/dual points, rate": 1.0}),
        )
    monkeypatch.setattr(chapter2, "STEPS", steps)
    monkeypatch.setattr("sys.argv", ["chapter2", "--quick", "--output", str(tmp_path)])
    with pytest.raises(SystemExit) as stop:
        common.command(chapter2)
    assert stop.value.code == int(spoiled)
    printed, progress = capsys.readouterr()
    lines = printed.splitlines()
    assert max(map(len, lines[:-1])) <= 80
    assert lines[0].startswith("Chapter 2")
    assert printed.index("The curvature of a straight line") < printed.index(
        "Ellipse: largest error of kappa"
    )
    assert "[2/7] ellipse: " in progress
    assert ("ellipse primal/dual points, rate = 1, required 2 ± 0.05" in progress) == spoiled
    assert not list(tmp_path.glob("*.png"))
    assert len(list(tmp_path.glob("*.csv"))) == 9
