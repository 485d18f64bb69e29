import re
from pathlib import Path

import pytest

from comparisons import chapter2, reproduction
from comparisons.common import Claim
from quadcurv.viewing import opengl_problem

COMMITTED = reproduction.REPORT.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def conclusions():
    return reproduction.conclusions()


def test_conclusions(conclusions) -> None:
    r = conclusions
    assert r["grid against shuffled faces"] < 1e-11
    assert r["mixed mesh, finite_volume"] == pytest.approx(5.6e-3, rel=0.05)
    assert r["mixed mesh, liu"] > 8 * r["mixed mesh, finite_volume"]
    assert r["torus, staggered: finite_volume over cotan-6"] == pytest.approx(0.21, abs=0.01)
    assert r["torus, grid: finite_volume over cotan-6"] == pytest.approx(1.48, abs=0.01)
    # On the torus with R = 2, r = 1 the metric is diag((2 + cos eta)^2, 1).
    assert r["1.1.1 metric, larger"] == pytest.approx(6.4530, abs=1e-3)
    assert r["1.1.1 metric, smaller"] == pytest.approx(1, abs=1e-6)
    assert r["1.1.1 curvature, smaller"] == pytest.approx(0.21269, abs=1e-5)
    assert r["1.1.1 curvature, larger"] == pytest.approx(1, abs=1e-9)


def test_drift() -> None:
    committed = "| rate 2.00, error 1.0e-04 |\n| a below 1e-10 |\n| 4.6 eps/h^2 |\n"
    assert reproduction.drift(committed, committed) == []
    assert reproduction.drift("| rate 2.01, error 1.03e-04 |\n| 5.1 eps/h^2 |", committed) == []
    for changed in (
        "| rate 2.00, error 1.1e-04 |",
        "| rate 2.2, error 1.0e-04 |",
        "| a below 1e-09 |",
        "| b |",
    ):
        assert reproduction.drift(changed, committed) == [changed]


def test_rounding_is_a_bound_in_the_report() -> None:
    text = reproduction.table([Claim("5", "exact", "error 3.4e-13 and 2e-16, not 2e-09", "reproduced")])
    assert "error < 1e-10 and < 1e-10, not 2e-09" in text
    assert not re.search(r"\de-1[1-9]", COMMITTED.replace("below 1e-1", ""))


def test_links() -> None:
    claim = reproduction.linked(Claim("3.3.3, Figures 3.8 and 3.11", "", "", "reproduced"))
    assert claim.where == ("3.3.3, Figures [3.8](output/figure_3_8.png) and [3.11](output/figure_3_11.png)")
    assert reproduction.linked(Claim("(3.79)", "", "", "slip")).where == "(3.79)"


def test_committed_report_has_every_chapter_slip_and_figure() -> None:
    assert re.findall(r"^## (\w+ \w+)", COMMITTED, re.M) == [
        "Chapter 1",
        "Chapter 2",
        "Chapter 3",
        "Chapter 4",
        "Chapter 5",
        "Beyond the",
    ]
    slips = [line for line in COMMITTED.splitlines() if line.endswith("| slip |")]
    for where in ("1.1.1", "(2.31)", "(2.54)", "(3.22)", "(3.29)", "(3.34)", "(3.79)", "4.1"):
        assert any(where in line.split("|")[1] for line in slips), where
    for chapter, last in ((2, 7), (3, 12), (4, 4)):
        for k in range(1, last + 1):
            assert f"[{chapter}.{k}](output/figure_{chapter}_{k}.png)" in COMMITTED
    counted = sum(
        line.endswith(f"| {verdict} |")
        for line in COMMITTED.splitlines()
        for verdict in ("reproduced", "reproduced only if ...", "not reproduced", "slip")
    )
    assert re.search(r"(\d+) claims", COMMITTED)[1] == str(counted)


def test_chapter_2_in_the_report(tmp_path) -> None:
    results = chapter2.main(tmp_path, quick=True)
    assert reproduction.drift(reproduction.table(chapter2.claims(results)), COMMITTED) == []


def test_quick_run_writes_elsewhere(tmp_path, monkeypatch, conclusions) -> None:
    class Script:
        @staticmethod
        def main(output: Path, quick: bool) -> dict[str, float]:
            assert quick
            return {"x": 1.0}

    monkeypatch.setattr(reproduction, "import_module", lambda name: Script)
    monkeypatch.setattr(reproduction, "conclusions", lambda: conclusions)
    monkeypatch.setattr(reproduction, "report", lambda results: ", ".join(results))
    reproduction.main(tmp_path, quick=True)
    written = (tmp_path / "REPRODUCTION.md").read_text(encoding="utf-8")
    assert written == "chapter2, chapter3, chapter4, beyond, conclusions"
    assert reproduction.REPORT.read_text(encoding="utf-8") == COMMITTED
    with pytest.raises(ValueError, match=r"the report .* links to figures in"):
        reproduction.main(tmp_path / "elsewhere", quick=False)


@pytest.mark.slow
def test_full_run_gives_the_committed_report(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(reproduction, "REPORT", tmp_path / "REPRODUCTION.md")
    monkeypatch.setattr(reproduction, "OUTPUT", tmp_path / "output")
    reproduction.main(tmp_path / "output", quick=False)
    fresh = (tmp_path / "REPRODUCTION.md").read_text(encoding="utf-8")
    assert reproduction.drift(fresh, COMMITTED) == []
    assert reproduction.drift(COMMITTED, fresh) == []
    if not opengl_problem():
        for link in re.findall(r"\(output/([\w.]+)\)", fresh):
            assert (tmp_path / "output" / link).exists(), link
