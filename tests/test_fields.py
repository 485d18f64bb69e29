"""Fields and their scales by numbers; what of a mesh is drawn, and from where it is seen."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest
from maps import made_up

from quadcurv import QuadGrid, QuadMesh, curvatures, surfaces
from quadcurv.comparison import compare
from quadcurv.mesh_quality import quality
from quadcurv.viewing import FIELDS, Fields
from quadcurv.viewing.geometry import drawn, overlays, viewpoint
from quadcurv.viewing.scale import BARS, ZERO_COLOUR


def field(comparison, name):
    return Fields(comparison).field(name)


def test_errors_have_whole_decades_and_colours_of_their_own_for_zero_and_nan():
    H = [3e-3, 2e-5, 0.0, np.nan, 5e-4, -3e-3]
    shown = field(made_up(a=H), "error")
    assert shown.limits == (-5, -2)
    np.testing.assert_allclose(
        shown.coloured("a"), [*np.log10([3e-3, 2e-5]), -6, np.nan, *np.log10([5e-4, 3e-3])]
    )
    np.testing.assert_array_equal(shown.values["a"], H)
    assert [label for _, label in shown.ticks()] == ["1e-5", "1e-4", "1e-3", "1e-2"]
    assert [label for label, _ in shown.patches()] == ["exactly 0", "undefined"]
    assert [shown.text(v) for v in shown.values["a"][:4]] == ["0.003", "2e−5", "0", "undefined"]


def test_errors_span_six_decades_and_smaller_ones_take_the_lowest_colour():
    shown = field(made_up(a=[1e-1, 1e-3, 1e-5, 1e-7, 1e-9, 1e-11]), "error")
    assert shown.limits == (-7, -1)
    assert shown.coloured("a").min() == -7
    assert shown.ticks()[0][1] == "≤ 1e-7"
    assert [shown.text(v) for v in shown.values["a"][2:]] == [
        "1e−5",
        "1e−7",
        "1e−9",
        "1e−11",
    ]  # the true ones
    assert shown.patches() == []


def test_without_an_exact_answer_schemes_are_compared_with_their_median():
    shown = field(made_up(None, a=[1.0] * 4, b=[1.1] * 4, c=[3.0] * 4), "error")
    np.testing.assert_allclose(10 ** shown.coloured("a"), 0.1)
    np.testing.assert_allclose(10 ** shown.coloured("c"), 1.9)
    assert "median" in shown.title
    assert shown.patches() == [("exactly 0", ZERO_COLOUR)]  # zero looks alike in all fields


def test_an_error_against_itself_is_not_shown():
    two = Fields(made_up(None, a=[1.0] * 4, b=[1.1] * 4))
    for name in ("error", "signed_error", "difference to a"):
        assert list(two.field(name).values) == ["b"]
    assert list(two.field("difference to b").values) == ["a"]
    assert list(two.field("mean_curvature").values) == ["a", "b"]
    alone = Fields(made_up(None, a=[1.0] * 4))
    assert alone.first == "mean_curvature"
    assert {"error", "signed_error"}.isdisjoint(alone.names)
    with pytest.raises(ValueError, match=r"field: expected one of mean_curvature, estimate, .*, got 'error'"):
        alone.field("error")
    assert Fields(made_up(a=[1.0] * 4)).first == "error"
    ball = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    assert "estimate" not in Fields(compare(ball, ["jet"])).names
    assert list(Fields(compare(ball, ["jet", "liu"])).field("estimate").values) == ["liu"]


def test_difference_to_a_scheme_of_choice():
    found = made_up(a=[1.0, 2.0] * 2, b=[1.5, 2.0] * 2, c=[31.0, 2.5] * 2)
    assert Fields(found).names[-3:] == ["difference to a", "difference to b", "difference to c"]
    for reference, differences in (("a", ["0.5", "0", "30", "0.5"]), ("b", ["0.5", "0", "29.5", "0.5"])):
        shown = field(found, f"difference to {reference}")
        texts = [shown.text(v) for values in shown.values.values() for v in values[:2]]
        assert texts == differences
        assert list(shown.values) == [scheme for scheme in "abc" if scheme != reference]
        assert shown.title.startswith(f"difference to {reference}")
        assert shown.patches() == [("exactly 0", ZERO_COLOUR)]
        assert shown.limits == (-1, 2)  # whichever is the reference
    with pytest.raises(ValueError, match=r"field: expected .*, difference to c, got 'difference to d'"):
        field(found, "difference to d")
    assert Fields(made_up(a=[1.0] * 4)).names == list(FIELDS)


def test_histogram_weighs_by_area_and_leaves_out_what_has_no_place_on_the_scale():
    H = [0.0, np.nan, 1.0, 1.0, 1e-8, 1e-3, 1e-3, 1.0]
    shown = field(made_up(a=H, areas=[2, 2, 1, 1, 4, 3, 3, np.nan]), "error")
    assert shown.limits == (-6, 0)
    expected = np.zeros(BARS)
    expected[[0, BARS // 2, -1]] = np.array([4, 6, 2]) / 16
    np.testing.assert_allclose(shown.histogram("a", np.array([2, 2, 1, 1, 4, 3, 3, np.nan])), expected)


def test_qualities_of_every_kind():
    bent = surfaces.tanh_sheet().sample((6, 6))[0]
    found = compare(bent, ["liu"])
    for measure, values in quality(bent).items():
        shown = field(found, measure)
        assert list(shown.values) == [measure]  # once, under its own name
        np.testing.assert_array_equal(shown.values[measure], values.ravel())
        assert (values > 1e-5).any()


def test_signed_scale_ends_where_five_percent_of_the_area_lie_beyond():
    H, areas = np.full(100, 0.7), np.ones(100)
    H[:20], areas[:20] = 50.0, 0.01  # many vertices, hardly any area
    assert field(made_up(a=H, areas=areas), "mean_curvature").limits == (-0.8, 0.8)
    areas[:20] = 1.0
    assert field(made_up(a=H, areas=areas), "mean_curvature").limits == (-50.0, 50.0)


def test_fields_of_nothing_but_zero_or_nan_still_have_a_scale():
    for name in ("mean_curvature", "error", "signed_error"):
        for value in (0.0, np.nan):
            low, high = field(made_up(a=[value] * 4), name).limits
            assert low < high


def test_unsigned_curvature_has_no_negative_half(shared_meshes):
    with pytest.warns(UserWarning, match="non-orientable"):
        moebius = compare(shared_meshes / "moebius.obj", ["liu"])
    shown = field(moebius, "mean_curvature")
    assert shown.limits[0] == 0
    assert "|H|" in shown.title


def test_principal_curvatures_on_a_torus():
    surface = surfaces.torus()
    errors = []
    for n in (32, 64):
        mesh, xi, eta = surface.sample((n, n), "faces")
        found = compare(mesh, ["jet"])
        H, K = surface.mean_curvature(xi, eta), surface.gaussian_curvature(xi, eta)
        gap = np.sqrt(H**2 - K)
        errors.append(
            [
                np.abs(field(found, name).values[f"{symbol} by jet"] - exact.ravel()).max()
                for name, symbol, exact in (
                    ("k1", "k1", H + gap),
                    ("k2", "k2", H - gap),
                    ("gaussian_curvature", "K", K),
                )
            ]
        )
    assert max(errors[1]) < 0.02
    assert np.all(np.divide(*errors) > 6)  # better than second order


def test_error_bars_estimates_and_creases():
    surface = surfaces.torus()
    mesh, xi, eta = surface.sample((48, 48), "faces")
    shown = Fields(compare(mesh, ["finite_volume", "jet"], surface.mean_curvature(xi, eta)))
    fit = curvatures(mesh)
    for name, symbol, bars in (
        ("mean_curvature", "H", fit.interval.mean),
        ("gaussian_curvature", "K", fit.interval.gaussian),
        ("k1", "k1", fit.interval.k1),
        ("k2", "k2", fit.interval.k2),
    ):
        found = shown.field(f"interval_{name}")
        np.testing.assert_array_equal(found.values[f"± of {symbol} by jet"], bars)
        assert "95 %" in found.title
        assert found.title.endswith("(1/length²)" if symbol == "K" else "(1/length)")
        assert found.logarithmic
    estimate = shown.field("estimate")
    error = shown.field("error").values["finite_volume"].ravel()
    assert list(estimate.values) == ["finite_volume"]
    assert np.abs(estimate.values["finite_volume"] - error).max() < 0.1 * np.abs(error).max()
    assert [shown.field("feature").text(v) for v in (0.0, 1.0, np.nan)] == ["smooth", "crease", "undefined"]


def test_creases_of_a_box():
    steps = np.linspace(0, 1, 9)
    x, y = np.meshgrid(np.linspace(-1, 1, 17), steps, indexing="ij")
    roof = QuadGrid(np.stack((x, y, -0.8 * np.abs(x)), axis=-1))
    shown = field(compare(roof, ["liu"]), "feature")
    creased = np.argwhere(shown.values["creases"].reshape(17, 9) == 1)
    assert set(creased[:, 0]) == {8}
    assert shown.ticks() == [(0, "smooth"), (1, "crease")]
    assert [tuple(colour) for colour in shown.colour_table()[[0, 127, 128, 255], :3]] == [(255,) * 3] * 2 + [
        (0,) * 3
    ] * 2


def test_unknown_field():
    with pytest.raises(ValueError, match=r"field: expected one of mean_curvature, error, .*, got 'colour'"):
        field(made_up(a=[1.0] * 4), "colour")


def test_overlays_of_a_cube_of_patches_and_of_an_open_tube():
    ball = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    marks = overlays(ball)
    assert list(marks) == ["valence < 4"]
    np.testing.assert_allclose(np.abs(ball.points[marks["valence < 4"]]), 3**-0.5)  # the cube's corners
    tube = surfaces.cylinder().sample((6, 5), "grid")[0]
    assert sorted(tube.wrap) == [False, True]
    marks = overlays(tube)
    assert {name: len(edges) for name, edges in marks.items()} == {"boundary": 12, "seam": 5}


def test_seams_where_a_grid_is_folded_or_closed():
    pillow = surfaces.pillow_sphere()
    for layout in ("grid", "staggered"):  # 16 edges along each fold, 8 where it wraps
        mesh = pillow.sample((16, 8), layout)[0]
        marks = overlays(mesh)
        assert list(marks) == ["seam"]
        points = drawn(mesh).points[marks["seam"]].reshape(-1, 3)
        z = points[:, 2]
        assert len(np.unique(np.sort(points.reshape(-1, 6).round(9), axis=1), axis=0)) > 8
        assert len(marks["seam"]) == 2 * 16 + 8 * (1 if layout == "grid" else 2)
        assert np.abs(z).min() < 1e-12  # the folds lie on the equator
    half = surfaces.hyperboloid().sample((8, 4), "staggered")[0]
    marks = overlays(half)
    assert {name: len(edges) for name, edges in marks.items()} == {"boundary": 16, "seam": 8}


def test_extraordinary_vertices_are_not_counted_on_the_boundary():
    fan = np.array([[np.cos(t), np.sin(t), 0] for t in np.arange(10) * np.pi / 5])
    star = QuadMesh([*fan, [0, 0, 0]], [[10, i, i + 1, (i + 2) % 10] for i in range(0, 10, 2)])
    marks = overlays(star)
    assert marks["valence > 4"].tolist() == [10]
    assert "valence < 4" not in marks


@pytest.mark.parametrize("thin", [0, 1, 2])
def test_the_viewer_stands_before_the_broad_side(thin):
    points = np.random.default_rng(0).uniform(-1, 1, (50, 3))
    points[:, thin] *= 0.1
    towards, up = viewpoint(points)
    assert towards.argmax() == thin
    assert np.linalg.norm(towards) == pytest.approx(1)
    assert np.argmax(up) == (2 if thin == 1 else 1)


def test_fields_die_with_their_comparison():
    found = compare(surfaces.torus().sample((8, 8), "faces")[0], ["liu", "jet"])
    shown = Fields(found)
    for name in shown.names:
        shown.field(name)
    assert shown.overlays == {}
    alive = weakref.ref(found.mesh)
    del found, shown
    gc.collect()
    assert alive() is None


def test_grid_with_holes():
    x, y = np.meshgrid(np.arange(9.0), np.arange(8.0), indexing="ij")
    points = np.stack((x, y, 0.1 * x * y), axis=-1)
    mask = np.zeros((9, 8), bool)
    mask[3:5, 3:6] = True
    found = compare(QuadGrid(points, mask=mask), ["liu", "jet"])
    assert field(found, "mean_curvature").values["jet"].shape == (72,)
    shown = Fields(found)
    assert np.isfinite(shown.drawn.points).all()
    assert len(shown.drawn.points) == 72
    assert not mask.ravel()[shown.drawn.faces].any()
    assert {name: len(edges) for name, edges in shown.overlays.items()} == {"boundary": 30 + 14}
