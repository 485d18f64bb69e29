"""Norms, tables, CSV and dict of comparisons."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from maps import made_up
from rich.console import Console

from quadcurv import QuadGrid, QuadMesh, surfaces
from quadcurv.comparison import compare, norms
from quadcurv.schemes import SCHEMES, Laplacian, cotan


def printed(thing, width=80):
    console = Console(file=io.StringIO(), width=width)
    console.print(thing)
    return console.file.getvalue()


def test_norms_by_hand():
    found = norms([1, -3, np.nan, 0], [1, 2, 5, 1])
    assert found == pytest.approx(
        {
            "vertices": 3,
            "one": 4 / 3,
            "two": np.sqrt(10 / 3),
            "inf": 3,
            "one-area": 7 / 4,
            "two-area": np.sqrt(19 / 4),
        }
    )
    nothing = norms([np.nan], [1.0])
    assert nothing.pop("vertices") == 0
    assert all(np.isnan(v) for v in nothing.values())


@pytest.mark.parametrize("area", [0.0, np.nan])
def test_norms_without_area(area):
    found = norms([1.0, -3.0, np.nan], [area, area, 2.0])
    assert (found["vertices"], found["one"], found["inf"]) == (2, 2.0, 3.0)
    assert np.isnan([found["one-area"], found["two-area"]]).all()


@pytest.mark.parametrize("power", [-200, 200])
def test_norms_of_any_size(power):
    size = 10.0**power
    found, unit = norms([3 * size, size], [1e-300, 3e-300]), norms([3.0, 1.0], [1.0, 3.0])
    assert found.pop("vertices") == unit.pop("vertices")
    assert {k: v / size for k, v in found.items()} == pytest.approx(unit)


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
    for wrong in ([1, 2, 3], lambda x: "much"):
        with pytest.raises(ValueError, match=r"exact: expected numbers that fit the result's \(12, 11\)"):
            compare(mesh, ["liu"], wrong)


def test_comparison_without_an_exact_answer():
    mesh = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]
    result = compare(mesh)
    assert result.exact is None
    assert result.schemes == tuple(SCHEMES)
    assert result.reference == "median of the schemes"
    stack = np.array(list(result.mean_curvature.values()))
    assert np.array_equal(result.spread, stack.max(axis=0) - stack.min(axis=0))
    difference = result.differences()
    assert len(difference) == len(SCHEMES) * (len(SCHEMES) - 1) // 2
    by_hand = np.abs(result.mean_curvature["finite_volume"] - result.mean_curvature["liu"]).mean()
    assert difference["finite_volume", "liu"]["one"] == pytest.approx(by_hand)
    text = printed(result)
    assert "Mean difference |H - H'| between schemes" in text
    assert "…" not in text


def by_hand(families=None, **H):
    """Comparison of made-up values, without an exact answer."""
    return replace(made_up(None, **H), families=families or {})


def test_the_median_counts_what_is_there():
    """A scheme without an answer at a vertex has no vote there, and takes none from the others."""
    nan = np.nan
    result = by_hand(
        a=[1, 1, nan, nan, nan, 1], b=[2, 2, 2, nan, nan, 2], c=[4, nan, 3, 5, nan, 4], d=[8, 8, 8, 8, nan, 9]
    )
    assert np.array_equal(result.consensus.ravel(), [3, 2, 3, 6.5, nan, 3], equal_nan=True)
    assert np.array_equal(result.spread.ravel(), [7, 7, 6, 3, nan, 8], equal_nan=True)
    assert [e["vertices"] for e in result.norms().values()] == [3, 4, 4, 5]
    assert result.differences()["a", "c"]["vertices"] == 2
    assert result.to_dict()["undefined"] == {"a": 3, "b": 2, "c": 2, "d": 1}


def test_the_median_counts_an_operator_once():
    families = {"b": "twin", "c": "twin"}
    H = {"a": [1] * 4, "b": [8] * 4, "c": [8] * 4, "d": [2] * 4}
    assert by_hand(**H).consensus.tolist() == [[5, 5]] * 2
    assert by_hand(families, **H).consensus.tolist() == [[2, 2]] * 2
    # Where one of the twins has no answer, the other one speaks for both.
    found = by_hand(families, a=[1] * 4, b=[np.nan, 3, 3, 3], c=[3, np.nan, 3, 3], d=[9] * 4).consensus
    assert found.tolist() == [[3, 3]] * 2
    mesh = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]
    result = compare(mesh, ["liu", "jet", "jet-2", "finite_volume"])
    assert result.families["jet"] == result.families["jet-2"]
    assert len(set(result.families.values())) == 3
    H = [result.mean_curvature[name] for name in ("liu", "finite_volume")]
    jets = [result.mean_curvature[name] for name in ("jet", "jet-2")]
    expected = np.median([*H, *H, *jets], axis=0)  # each of the jets has half a vote
    assert result.consensus == pytest.approx(expected, abs=1e-12)


def test_a_scheme_that_fails_ends_nothing():
    def fail(*_):
        raise np.linalg.LinAlgError("Singular matrix")

    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    poor = Laplacian("poor", 2, "nobody", fail)
    result = compare(mesh, ["liu", poor, "finite_volume"], 1.0)
    assert np.isnan(result.mean_curvature["poor"]).all()
    assert result.notes == {"poor": "LinAlgError: Singular matrix"}
    assert result.norms()["liu"] == compare(mesh, ["liu"], 1.0).norms()["liu"]
    assert result.to_dict()["notes"] == dict(result.notes)
    assert "poor: LinAlgError: Singular matrix" in printed(result)
    assert np.isnan(compare(mesh, poor).spread).all()


def test_names_are_no_markup():
    result = by_hand(**{"[/x]": [1, 2, 3, 4], "[bold]": [1, 2, 3, 5]})
    text = printed(result)
    assert "[/x]" in text
    assert "[bold]" in text


def test_a_notebook_shows_the_tables():
    result = by_hand(**{"<b>": [1, 2, 3, 4], "liu": [1, 2, 3, 5]})
    shown = result._repr_html_()
    assert shown.startswith("<pre")
    assert "&lt;b&gt;" in shown
    assert "<b>" not in shown
    assert "Mean difference" in shown


def test_a_comparison_is_one_line():
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    assert repr(compare(mesh)) == (
        f"Comparison(QuadMesh(98 points, 96 quads), {len(SCHEMES)} schemes against median of the schemes)"
    )
    assert repr(compare(mesh, "liu", 1.0)) == "Comparison(QuadMesh(98 points, 96 quads), liu against exact)"


def test_grid_with_holes():
    """Values of a grid with holes are those of its faces, NaN in the holes."""
    grid = surfaces.torus().sample((12, 10))[0]
    mask = np.zeros((12, 10), bool)
    mask[3, 4] = mask[8, 7] = True
    holed = QuadGrid(grid.points, grid.wrap, mask=mask)
    result = compare(holed, ["liu", "bunge", "jet"], lambda x: np.linalg.norm(x, axis=-1))
    mesh = compare(holed.to_mesh(), ["liu", "bunge", "jet"], lambda x: np.linalg.norm(x, axis=-1))
    for name, H in result.mean_curvature.items():
        assert np.isnan(H[mask]).all()
        assert np.array_equal(H[~mask], mesh.mean_curvature[name], equal_nan=True)
    assert result.norms() == mesh.norms()
    assert np.isnan(result.areas[mask]).all()
    assert np.array_equal(result.valence[~mask], mesh.valence)


def test_stencils_are_made_once(monkeypatch):
    made = []
    real = QuadMesh.stencils
    monkeypatch.setattr(QuadMesh, "stencils", lambda mesh: made.append(mesh) or real(mesh))
    compare(surfaces.cubed_sphere().sample((4, 4), "faces")[0])
    assert len(made) <= 4  # as given, to be closed at its boundary, and for fits
    assert len({id(mesh) for mesh in made}) == 1


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


def test_rejections():
    mesh = surfaces.torus().sample((5, 5))[0]
    with pytest.raises(TypeError, match="schemes: expected names or schemes, got 5"):
        compare(mesh, 5)
    with pytest.raises(ValueError, match=r"boundary: expected one of .*, got 'mirror'"):
        compare(mesh, "liu", boundary="mirror")


def test_welded_layouts_are_closed():
    pillow = surfaces.pillow_sphere().sample((16, 8), "faces")[0]
    assert np.bincount(pillow.stencils().valence)[2:].tolist() == [4, 0, len(pillow.points) - 4]
    assert pillow.stencils().closed.all()
    cube = surfaces.cubed_sphere().sample((5, 5), "faces")[0]
    assert np.bincount(cube.stencils().valence)[3:].tolist() == [8, 6 * 25 + 2 - 8]
    torus = surfaces.torus().sample((6, 7), "faces")[0]
    assert len(torus.points) == 42
    assert (torus.stencils().valence == 4).all()
