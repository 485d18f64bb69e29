"""Tables as text, HTML and CSV."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from rich.console import Console

import quadcurv as qc
from quadcurv.tables import as_html, as_latex, finite, short, text_table, text_tables, write_csv


def printed(*things, width=80):
    console = Console(file=io.StringIO(), width=width)
    console.print(*things, sep="\n")
    return console.file.getvalue()


def test_columns_of_every_kind(tmp_path):
    columns = {
        "": np.array([[0.1, 2.0, -3.0], [1 / 3, np.nan, np.inf]]),
        "n": np.array([1, 2], np.int32),
        "name": ["a,b", 'say "x"'],
        "normal": np.eye(3)[:2],
    }
    write_csv(tmp_path / "table.csv", columns)
    with (tmp_path / "table.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x", "y", "z", "n", "name", "normal_x", "normal_y", "normal_z"]
    assert [float(row["x"]) for row in rows] == [0.1, 1 / 3]  # to the last digit
    assert [row["n"] for row in rows] == ["1", "2"]
    assert [row["name"] for row in rows] == ["a,b", 'say "x"']
    assert rows[1]["y"] == "nan"


def test_a_table_that_fails_leaves_the_old_one(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(ValueError, match=r"columns: expected one length, got {'a': 2, 'b': 1}"):
        write_csv(path, {"a": [1, 2], "b": [1]})
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["table.csv"]


def test_wide_tables_are_cut_into_several_of_80_columns():
    header = ["scheme", *(f"column {i}" for i in range(20))]
    rows = [[f"[red]{i}[/x]", *map(str, range(100 * i, 100 * i + 20))] for i in range(3)]
    tables = text_tables("A title", header, rows)
    text = printed(*tables)
    assert max(map(len, text.splitlines())) <= 80
    assert "…" not in text
    assert text.count("[red]2[/x]") == len(tables) > 1
    assert all(f" {200 + i}" in text for i in range(20))
    assert len(text_tables("A title", ["a", "b"], [])) == 1


def test_a_notebook_gets_text_and_no_markup_of_names():
    shown = as_html(text_table("T < U", ["a"], [["<script>"]]))
    assert "T &lt; U" in shown
    assert "<script>" not in shown


@pytest.mark.parametrize(
    ("value", "text"), [(0.00123, "1.2e-3"), (12, "1.2e1"), (0, "0.0e0"), (np.nan, "nan")]
)
def test_short_numbers(value, text):
    assert short(value) == text


def test_json_has_no_nan():
    found = finite({"a": [1.0, np.nan, {"b": np.inf}], "c": 3})
    assert json.dumps(found, allow_nan=False) == '{"a": [1.0, null, {"b": null}], "c": 3}'


def test_latex_escapes_names_and_writes_numbers_as_papers_do():
    text = as_latex("a_b & 5 %", ["scheme", "n^2"], [["x_1", "-1.2e-3"], ["~", "0.5"], ["\\", "8x8"]])
    assert text.splitlines()[2:9] == [
        r"\caption{a\_b \& 5 \%}",
        r"\begin{tabular}{lr}",
        r"\toprule",
        r"scheme & n\textasciicircum{}2 \\",
        r"\midrule",
        r"x\_1 & $-1.2 \cdot 10^{-3}$ \\",
        r"\textasciitilde{} & $0.5$ \\",
    ]
    assert r"\textbackslash{} & 8x8 \\" in text


def test_results_in_latex_hold_what_their_tables_do():
    ball = qc.surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    found = qc.compare(ball, ["liu", "cotan-8"], exact=1.0)
    rows = [line.split(" & ") for line in found.to_latex().splitlines() if line.endswith(r"\\")]
    assert [row[0] for row in rows] == ["scheme", "liu", "cotan-8"]
    assert rows[1][3] == "$98$"
    run = qc.convergence("torus", "liu", [8, 16, 32])
    assert f"${run.rates('liu', 'inf')[-1]:.2f}$" in run.to_latex("inf")
