"""What a notebook shows of results and meshes: short, escaped, and in a bare console one line."""

from __future__ import annotations

import base64
import io
import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import quadcurv as qc
from quadcurv import html, surfaces

ROOT = Path(__file__).parents[1]

BALL = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
SHOWN = {
    "mesh": BALL,
    "grid": surfaces.torus().sample((8, 6))[0],
    "cells": surfaces.torus().sample((8, 6), "staggered")[0],
    "curvatures": qc.curvatures(BALL),
    "comparison": qc.compare(BALL, ["liu", "jet"], exact=1.0),
    "convergence": qc.convergence("torus", "liu", [8, 16]),
}


class Cells(HTMLParser):
    """Text by table row."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []

    def handle_starttag(self, tag, attrs):
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data):
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] += data


def cells(found) -> dict[str, list[str]]:
    parser = Cells()
    parser.feed(found._repr_html_())
    return {first: rest for first, *rest in parser.rows}


@pytest.mark.parametrize("name", SHOWN)
def test_shown_in_a_few_lines(name):
    text = SHOWN[name]._repr_html_()
    assert re.match(r"<(table|pre)", text)
    assert len(text) < 8000
    assert text.count("<table") == text.count("</table")


@pytest.mark.parametrize("name", SHOWN)
def test_bare_repr_is_one_line(name):
    assert "\n" not in repr(SHOWN[name])
    assert len(repr(SHOWN[name])) < 200


def test_bare_curvatures_count_those_without():
    grid = SHOWN["grid"]
    mask = np.zeros(grid.shape, bool)
    mask[2, 3] = True
    found = qc.curvatures(qc.QuadGrid(grid.points, grid.wrap, mask))
    assert re.fullmatch(r"Curvatures\(8 x 6 vertices, H \S+ to \S+, 1 without\)", repr(found))


def test_mesh_shows_its_extent_and_report():
    points = BALL.points * [1, 2, 3]
    with pytest.warns(qc.MeshWarning):
        mesh = qc.QuadMesh(points, [*BALL.faces.tolist(), BALL.faces[0].tolist()])
    shown = cells(mesh)
    assert shown["z"] == [f"{points[:, 2].min():.4g} to {points[:, 2].max():.4g}"]
    assert "given twice" in shown["report"][0]
    assert cells(BALL)["report"] == ["nothing mended"]


def test_grid_with_holes_shows_the_extent_of_the_rest():
    grid = SHOWN["grid"]
    mask = np.zeros(grid.shape, bool)
    mask[2, 3] = True
    assert "nan" not in qc.QuadGrid(grid.points, grid.wrap, mask)._repr_html_()


def test_curvatures_show_ranges_errors_and_what_is_missing():
    found = SHOWN["curvatures"]
    shown = cells(found)
    assert shown["H"][:3] == [f"{v:.4g}" for v in np.quantile(found.mean, (0, 0.5, 1))]
    assert shown["H"][3] == f"{np.median(found.standard_error.mean):.1e}"
    assert [shown[s][4] for s in ("H", "K", "k1", "k2")] == ["0"] * 4
    points = np.concatenate([BALL.points, [[0, 0, 0]]])
    assert cells(qc.curvatures((points, BALL.faces)))["k2"][4] == "1"


def test_curvatures_of_nothing_and_without_errors():
    nothing = np.full(3, np.nan)
    vectors = np.full((3, 3), np.nan)
    found = qc.Curvatures(nothing, nothing, nothing, nothing, vectors, vectors, vectors)
    assert cells(found)["H"] == ["nan", "nan", "nan", "-", "3"]


def test_nothing_is_read_as_markup():
    assert "&lt;b&gt;" in html.table("<b>", [("<i>", "&")])
    assert "<i>" not in html.table("<b>", [("<i>", "&")])


def test_data_frames():
    pytest.importorskip("pandas")
    frame = SHOWN["comparison"].to_dataframe()
    assert list(frame["valence"].unique()) == ["all", "3", "4"]
    best = frame[(frame.scheme == "jet") & (frame.valence == "all")]
    assert best["inf"].item() == SHOWN["comparison"].norms()["jet"]["inf"]
    frame = SHOWN["convergence"].to_dataframe()
    rates = frame[frame.norm == "inf"]["rate"]
    assert rates.iloc[-1] == SHOWN["convergence"].rates("liu", "inf")[-1]


def test_data_frames_name_their_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    for name in ("comparison", "convergence"):
        with pytest.raises(ImportError, match=r'pandas is not installed: pip install "quadcurv\[notebook\]"'):
            SHOWN[name].to_dataframe()


def test_the_notebook_for_first_steps_runs_and_shows_pictures(tmp_path):
    """By nbmake, as anybody would run it; then what its cells show is looked at."""
    pytest.importorskip("nbmake")
    notebook = tmp_path / "first_steps.ipynb"
    notebook.write_bytes((ROOT / "examples" / notebook.name).read_bytes())
    command = [sys.executable, "-m", "pytest", "-q", "-c", "/dev/null", "-p", "no:cacheprovider"]
    run = subprocess.run(
        [*command, "--nbmake", "--overwrite", f"--rootdir={tmp_path}", notebook],
        capture_output=True,
        text=True,
        timeout=300,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert run.returncode == 0, run.stdout
    cells = json.loads(notebook.read_text(encoding="utf-8"))["cells"]
    shown = [output["data"] for cell in cells for output in cell.get("outputs", [])]
    assert len(shown) == sum(cell["cell_type"] == "code" for cell in cells)
    assert "jet" in "".join(shown[2]["text/html"])
    assert "<iframe" in "".join(shown[3]["text/html"])
    picture = np.asarray(Image.open(io.BytesIO(base64.b64decode(shown[4]["image/png"]))).convert("RGB"))
    ink = (picture < 200).any(axis=2)
    assert 0.01 < ink.mean() < 0.5
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 100
