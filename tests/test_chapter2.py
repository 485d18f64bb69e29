import csv
import io

import numpy as np
import pytest
from rich.console import Console

from comparisons import chapter2, common
from quadcurv.curves import curvature, euler_spiral, staggered

FIGURES = ["2_1", "2_2", "2_3", "2_4", "2_5", "2_6", "2_7", "2_exact", "2_open_ends", "2_uneven"]


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    return tmp_path_factory.mktemp("chapter2") / "new"


@pytest.fixture(scope="module")
def results(output):
    return chapter2.main(output, quick=True)


def test_files(output, results) -> None:
    expected = {f"figure_{name}.{kind}" for name in FIGURES for kind in ("png", "svg", "csv")}
    assert {file.name for file in output.iterdir()} == expected - {"figure_2_1.csv"}
    with open(output / "figure_2_3.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [int(row["n"]) for row in rows] == [16, 32, 64, 128, 256, 512, 1024]
    assert float(rows[4]["polyline"]) == results["ellipse polyline error at 256"]


@pytest.mark.parametrize(
    ("name", "value", "tolerance"),
    [
        ("ellipse primal/dual rate", 2.0, 0.01),
        ("ellipse polyline rate", 2.0, 0.01),
        ("spiral rate", 4.0, 0.1),
        ("helix curvature rate", 2.0, 0.02),
        ("helix torsion rate", 2.0, 0.02),
        ("arc curvature end rate", 2.0, 0.05),
        ("helix torsion end rate", 2.0, 0.15),
        ("uneven circle rate, polyline", 2.0, 0.1),
        ("uneven helix torsion rate, three edges", 2.0, 0.2),
        ("arc curvature end error over inside at 256", 1.0, 0.1),
        ("helix torsion end error over inside at 256", 1.0, 0.2),
        ("2.45 x component of H at t = 0", -1.0, 1e-12),
        ("2.54 printed torsion of the helix", 0.8, 0.003),
        ("2.54 corrected torsion of the helix", 0.4, 3e-5),
        ("uneven circle error at 256, primal halfway", 0.86, 0.01),
        ("uneven helix torsion error at 256, one edge", 0.70, 0.01),
    ],
)
def test_measured(results, name, value, tolerance) -> None:
    assert results[name] == pytest.approx(value, abs=tolerance)


@pytest.mark.parametrize(
    ("name", "bound"),
    [
        ("circle error to 256", 1e-12),
        ("line turn to 256", 1e-12),
        ("ellipse primal/dual error at 256", 5e-4),
        ("ellipse polyline error at 256", 1e-3),
        ("spiral error at 8192", 1.6e-9),
        ("spiral error at 32768 over eps/h^2", 10),
        ("helix curvature error at 256", 3.3e-5),
        ("helix torsion error at 256", 9.8e-5),
        ("uneven circle error at 256, dual halfway", 2e-12),
        ("uneven circle error at 256, polyline", 2e-5),
        ("uneven helix torsion error at 256, three edges", 2e-4),
        ("2.31 largest cosine of printed and exact normal", 0.03),
    ],
)
def test_bounds(results, name, bound) -> None:
    assert 0 < results[name] < bound


def test_claims(results) -> None:
    claims = chapter2.claims(results)
    verdicts = {c.where: c.verdict for c in claims}
    assert verdicts["(2.31)"] == verdicts["(2.54)"] == verdicts["(2.48)"] == "slip"
    assert verdicts["2.1.4, Figure 2.3"] == "reproduced"
    console = Console(file=io.StringIO(), width=200)
    common.print_claims(claims, "Chapter 2", console)
    printed = console.file.getvalue()
    markdown = common.claims_markdown(claims)
    for c in claims:
        assert c.where in printed
        assert c.claim.replace("|", "\\|") in markdown
    assert {line.replace("\\|", "").count("|") for line in markdown.splitlines()} == {5}


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


def test_convergence_plot() -> None:
    _, axes = common.figure()
    n = np.array([8, 16, 32, 64])
    series = {"exact": [0.0] * 4, "second": 3.0 / n**2, "partly": [1.0, np.nan, 0.0, 0.1]}
    fit = {"second": (16, 64), "exact": (8, 64)}
    rates = common.convergence_plot(axes, n, series, fit, slopes=(1, 2), rounding=(1e-16 * n**2.0, "eps"))
    assert rates["second"] == pytest.approx(2)
    assert np.isnan(rates["exact"])
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == ["exact", "second: rate 2.00", "partly", "range of the fit", "rounding, eps"]
    dashed = [line.get_xdata()[0] for line in axes.lines if line.get_linestyle() == "--"]
    assert dashed == [8, 16, 64]
    open_markers = [line for line in axes.lines if line.get_fillstyle() == "none"]
    assert [len(line.get_xdata()) for line in open_markers] == [4, 1]
    assert all((line.get_ydata() == axes.get_ylim()[0]).all() for line in open_markers)


def test_figures_are_the_same_on_every_run(tmp_path) -> None:
    @common.paper_style
    def draw(folder) -> None:
        fig, axes = common.figure()
        axes.plot([1, 2, 3], label="a")
        axes.legend()
        common.save_figure(fig, folder, "figure", {"x": [1, 2], "y": [0.1, 1 / 3]})

    for folder in ("first", "second"):
        draw(tmp_path / folder)
    for kind in ("png", "svg", "csv"):
        assert len({(tmp_path / f / f"figure.{kind}").read_bytes() for f in ("first", "second")}) == 1
    assert (tmp_path / "first" / "figure.csv").read_text() == "x,y\n1,0.1\n2,0.3333333333333333\n"


def test_columns_of_different_lengths(tmp_path) -> None:
    with pytest.raises(ValueError, match="columns: expected one length"):
        common.write_csv(tmp_path, "table", {"a": [1, 2], "b": [1]})


def test_command_line(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr("sys.argv", ["chapter2", "--quick", "--output", str(tmp_path)])
    options = common.arguments("text")
    assert options.quick
    assert options.output == tmp_path
    monkeypatch.setattr("sys.argv", ["chapter2"])
    assert common.arguments(None).output.parts[-2:] == ("comparisons", "output")
