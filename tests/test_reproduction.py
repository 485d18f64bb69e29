from __future__ import annotations

import re

import pytest
from scripts import assert_as_declared

from comparisons import common, overall, reproduction
from comparisons.claims import exactly, judge
from comparisons.measured import Measured
from quadcurv.viewing import opengl_problem

COMMITTED = reproduction.REPORT.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def conclusions() -> Measured:
    return common.measure(overall)


def test_conclusions(conclusions) -> None:
    r = conclusions.numbers
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


def test_claims_of_its_own_numbers(conclusions) -> None:
    own = [c for c in overall.CLAIMS if all(n.key in conclusions.numbers for n in c.numbers)]
    assert len(own) == 4
    script = type(overall)("own")
    script.CLAIMS = own
    assert_as_declared(script, conclusions)


def test_drift() -> None:
    committed = "| rate 2.00, error 1.0e-4 |\n| a below 1e-10 |\n| 4.6 eps/h^2 |\n"
    assert reproduction.drift(committed, committed) == []
    assert reproduction.drift("| rate 2.01, error 1.03e-4 |\n| 5.1 eps/h^2 |", committed) == []
    for changed in (
        "| rate 2.00, error 1.1e-4 |",
        "| rate 2.2, error 1.0e-4 |",
        "| a below 1e-9 |",
        "| b |",
    ):
        assert reproduction.drift(changed, committed) == [changed]


def test_report_counts_verdicts_and_shows_what_fell() -> None:
    claims = [c for c in overall.FIRST if c.where == "1.1.1"]
    numbers = {n.key: n.low for c in claims for n in c.numbers}
    text = reproduction.report({"Chapter 1": judge(claims, numbers)})
    assert "1 claims: 1 slip." in text
    fallen = reproduction.report({"Chapter 1": judge(claims, {})})
    assert "1 claims: 1 undecided." in fallen
    assert "are nan and nan" in fallen


def test_numbers_of_two_scripts_have_names_of_their_own() -> None:
    assert reproduction.numbers_of_all([{"a": 1.0}, {"b": 2.0}]) == {"a": 1.0, "b": 2.0}
    with pytest.raises(ValueError, match=r"numbers of one name in two scripts: \['a'\]"):
        reproduction.numbers_of_all([{"a": 1.0}, {"a": 2.0}])


def test_status_of_the_command(capsys) -> None:
    claim = reproduction.Claim("3.3", "text", "{}", (exactly("n", 1),))
    assert common.report_changes(judge([claim], {"n": 1})) == 0
    assert common.report_changes(judge([claim], {"n": 2})) == 1
    assert "changed: 3.3: n = 2, required 1" in capsys.readouterr().err


def test_committed_report_has_every_chapter_claim_and_figure() -> None:
    assert re.findall(r"^## (\w+ \w+|\w+:)", COMMITTED, re.M) == [
        "Chapter 1",
        "Chapter 2",
        "Chapter 3",
        "Chapter 4",
        "Chapter 5",
        "Beyond the",
        "Functions:",
    ]
    for chapter, last in ((2, 7), (3, 12), (4, 4)):
        for k in range(1, last + 1):
            assert f"[{chapter}.{k}](output/figure_{chapter}_{k}.png)" in COMMITTED
    claims = [claim for section in reproduction.sections().values() for claim in section]
    for claim in claims:
        text = claim.claim.replace("|", "\\|")
        rows = [line for line in COMMITTED.splitlines() if f"| {text} |" in line]
        assert len(rows) == 1, claim.claim
        assert rows[0].endswith(f"| {claim.verdict} |")
    thesis = [claim for claim in claims if claim.verdict != "holds"]
    assert re.search(r"(\d+) claims", COMMITTED)[1] == str(len(thesis))


def test_a_full_run_goes_where_the_links_lead(tmp_path) -> None:
    with pytest.raises(ValueError, match=r"the report .* links to figures in"):
        reproduction.main(tmp_path / "elsewhere", quick=False)


@pytest.mark.slow
def test_full_run_gives_the_committed_report(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(reproduction, "REPORT", tmp_path / "REPRODUCTION.md")
    monkeypatch.setattr(reproduction, "OUTPUT", tmp_path / "output")
    judged = reproduction.main(tmp_path / "output", quick=False)
    assert not any(j.wrong for judgements in judged.values() for j in judgements)
    fresh = (tmp_path / "REPRODUCTION.md").read_text(encoding="utf-8")
    assert reproduction.drift(fresh, COMMITTED) == []
    assert reproduction.drift(COMMITTED, fresh) == []
    if not opengl_problem():
        for link in re.findall(r"\(output/([\w.]+)\)", fresh):
            assert (tmp_path / "output" / link).exists(), link
