"""Norms, tables, CSV and dict of comparisons and convergence runs."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
from rich.console import Console

from quadcurv import QuadMesh, surfaces
from quadcurv.comparison import NORMS, compare, norms
from quadcurv.convergence import convergence
from quadcurv.schemes import SCHEMES, cotan


def printed(thing, width=80):
    console = Console(file=io.StringIO(), width=width)
    console.print(thing)
    return console.file.getvalue()


def test_norms_by_hand():
    found = norms([1, -3, np.nan, 0], [1, 2, 5, 1])
    assert found == pytest.approx(
        {
            "one": 4 / 3,
            "two": np.sqrt(10 / 3),
            "inf": 3,
            "one-area": 7 / 4,
            "two-area": np.sqrt(19 / 4),
        }
    )
    assert all(np.isnan(v) for v in norms([np.nan], [1.0]).values())


def test_comparison_with_an_exact_answer(tmp_path):
    surface = surfaces.cubed_sphere(2.0)
    mesh, xi, eta = surface.sample((6, 6), "faces")
    result = compare(mesh, ["liu", cotan(6, diagonal=1)], surface.mean_curvature(xi, eta))
    assert result.schemes == ("liu", "cotan-6'")
    assert np.array_equal(result.errors["liu"], result.mean_curvature["liu"] - 0.5)
    assert set(result.by_valence()) == {3, 4}
    assert result.areas.sum() == pytest.approx(16 * np.pi, rel=0.03)
    text = printed(result)
    assert max(map(len, text.splitlines())) <= 80
    assert "3 (8)" in text
    assert "4 (210)" in text
    result.to_csv(tmp_path / "result.csv")
    rows = list(csv.DictReader((tmp_path / "result.csv").read_text().splitlines()))
    assert {(r["scheme"], r["valence"]) for r in rows} == {
        (s, v) for s in result.schemes for v in ("all", "3", "4")
    }
    assert float(rows[0]["inf"]) == result.norms()["liu"]["inf"]
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["valence"] == {"3": 8, "4": 210}


def test_exact_as_number_or_function_of_the_points():
    mesh = surfaces.sphere(2.0).sample((12, 10))[0]
    by_number = compare(mesh, ["liu"], 0.5)
    by_function = compare(mesh, ["liu"], lambda x: 1 / np.linalg.norm(x, axis=-1))
    assert np.allclose(by_number.errors["liu"], by_function.errors["liu"], atol=1e-15)
    with pytest.raises(ValueError, match=r"exact: shape \(3,\) does not fit the result's \(12, 11\)"):
        compare(mesh, ["liu"], [1, 2, 3])


def test_comparison_without_an_exact_answer():
    mesh = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]
    result = compare(mesh)
    assert result.exact is None
    assert result.schemes == tuple(SCHEMES)
    assert result.reference == "median of the schemes"
    stack = np.array(list(result.mean_curvature.values()))
    assert np.array_equal(result.consensus, np.median(stack, axis=0))
    assert np.array_equal(result.spread, stack.max(axis=0) - stack.min(axis=0))
    difference = result.differences()
    assert len(difference) == len(SCHEMES) * (len(SCHEMES) - 1) // 2
    by_hand = np.abs(result.mean_curvature["finite_volume"] - result.mean_curvature["liu"]).mean()
    assert difference["finite_volume", "liu"]["one"] == pytest.approx(by_hand)
    text = printed(result)
    assert "Mean difference |H - H'| between schemes" in text
    assert "…" not in text


def test_of_two_schemes_the_first_is_the_reference():
    mesh = surfaces.cubed_ellipsoid().sample((4, 4), "faces")[0]
    result = compare(mesh, ["liu", "finite_volume"])
    assert result.reference == "liu"
    assert result.norms()["liu"]["inf"] == 0
    assert result.norms()["finite_volume"] == result.differences()["liu", "finite_volume"]
    assert compare(mesh, "liu").schemes == ("liu",)


def test_undefined_vertices_are_counted_and_left_out():
    sphere = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    mesh = QuadMesh(np.vstack((sphere.points, [[9, 9, 9]])), sphere.faces)
    result = compare(mesh, ["liu", "finite_volume"], 1.0)
    assert result.to_dict()["undefined"] == {"liu": 1, "finite_volume": 1}
    assert np.isfinite(list(result.norms()["liu"].values())).all()
    assert result.to_dict()["errors_by_valence"]["0"]["liu"]["one"] is None
    json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize("schemes", [[], ["liu", "liu"]])
def test_schemes_are_given_once(schemes):
    with pytest.raises(ValueError, match="schemes: expected at least one, each once"):
        compare(surfaces.torus().sample((5, 5))[0], schemes)


def test_convergence_table_csv_and_dict(tmp_path):
    run = convergence(surfaces.cylinder(), ["finite_volume", "cotan-6"], [16, (32, 32), 64])
    assert run.shapes == ((16, 16), (32, 32), (64, 64))
    assert run.rates("cotan-6", "inf") == pytest.approx([2, 2], abs=0.05)
    assert run.fitted_rate("cotan-6", "inf", last=2) == pytest.approx(run.rates("cotan-6", "inf")[-1])
    text = printed(run)
    assert "exact" in text
    assert "2.00" in text
    run.to_csv(tmp_path / "run.csv")
    rows = list(csv.DictReader((tmp_path / "run.csv").read_text().splitlines()))
    assert len(rows) == 2 * 3 * len(NORMS)
    assert float(rows[1]["error"]) == run.errors["finite_volume"]["one"][1]
    as_dict = json.loads(json.dumps(run.to_dict(), allow_nan=False))
    assert as_dict["schemes"]["cotan-6"]["undefined"] == [0, 0, 0]


def test_convergence_rejects_a_single_shape_and_unknown_layouts():
    with pytest.raises(ValueError, match="shapes: a rate needs at least two"):
        convergence(surfaces.torus(), ["liu"], [8])
    with pytest.raises(ValueError, match="layout must be"):
        convergence(surfaces.torus(), ["liu"], [8, 16], "hexagons")
    with pytest.raises(ValueError, match="6 panels, only layout 'faces' joins them"):
        convergence(surfaces.cubed_sphere(), ["liu"], [8, 16], "grid")


def test_welded_layouts_are_closed():
    pillow = surfaces.pillow_sphere().sample((16, 8), "faces")[0]
    assert np.bincount(pillow.stencils().valence)[2:].tolist() == [4, 0, len(pillow.points) - 4]
    assert pillow.stencils().closed.all()
    cube = surfaces.cubed_sphere().sample((5, 5), "faces")[0]
    assert np.bincount(cube.stencils().valence)[3:].tolist() == [8, 6 * 25 + 2 - 8]
    torus = surfaces.torus().sample((6, 7), "faces")[0]
    assert len(torus.points) == 42
    assert (torus.stencils().valence == 4).all()
