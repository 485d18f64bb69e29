"""The meshes of exact curvature, goals and their verdicts, and that every part of the table is measured."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

import quadcurv as qc
from comparisons import accuracy, cases
from comparisons.goals import Goal, table, verdict
from quadcurv.schemes import SCHEMES, Fit
from quadcurv.surfaces import cubed_ellipsoid


def test_curvature_of_quartics_is_that_of_parameters():
    """Torus, cyclide-like and ellipsoid: from F alone as by differentiating mappings."""
    grid = cases.ring_grid(24, 16, 0.8)
    implicit = cases.ring().case(grid.mesh)
    np.testing.assert_allclose(implicit.H, grid.H, atol=1e-13)
    np.testing.assert_allclose(implicit.K, grid.K, atol=1e-13)
    surface = cubed_ellipsoid(*cases.AXES)
    mesh, xi, eta = surface.sample((8, 8), "faces")
    found = cases.ellipsoid().case(mesh)
    np.testing.assert_allclose(found.H, surface.mean_curvature(xi, eta), rtol=1e-11)
    np.testing.assert_allclose(found.K, surface.gaussian_curvature(xi, eta), rtol=1e-11)
    np.testing.assert_allclose(found.k1 * found.k2, found.K, rtol=1e-9)


def test_star_is_smooth_and_has_saddles():
    """Its exact curvature is what a fine mesh shows, with errors that fall by their order."""
    errors = []
    for level in (3, 4):
        case = cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), level))
        errors.append(np.abs(qc.gaussian_curvature(case.mesh, "jet") - case.K).mean())
    assert case.K.min() < -0.3 < 5 < case.K.max()
    assert errors[1] < errors[0] / 4
    assert errors[1] < 0.02


def test_jittered_vertices_stay_on_their_surface():
    smooth = cases.cubed(8)
    moved = cases.ellipsoid().jittered(smooth, 0.2, seed=3)
    on = (moved.mesh.points / cases.AXES) ** 2
    np.testing.assert_allclose(on.sum(axis=1), 1, rtol=1e-13)
    step = np.linalg.norm(moved.mesh.points - smooth.points, axis=1) / cases.mean_edge(smooth)
    assert 0.1 < step.mean() < step.max() < 0.36


@pytest.mark.parametrize(
    ("solid", "faces", "valences"),
    [
        (cases.dodecahedron(), 60, {3: 20, 5: 12}),
        (cases.prism(4), 24, {3: 8}),
        (cases.prism(8), 48, {3: 16, 8: 2}),
    ],
)
def test_catmull_clark(solid, faces, valences):
    mesh = cases.catmull_clark(solid, 3)
    assert len(mesh.faces) == faces * 16
    assert len(mesh.points) == len(mesh.faces) + 2
    counts = np.bincount(np.bincount(mesh.faces.ravel()))
    assert {v: c for v, c in enumerate(counts) if c and v != 4} == valences
    assert mesh.report["turned"] == 0
    assert np.median(qc.mean_curvature(mesh)) > 0


def test_mixed_keeps_its_vertices():
    case = cases.mixed(cases.on(cases.ellipsoid(), cases.cubed(8)))
    triangles = (case.mesh.faces[:, 3] < 0).sum()
    assert 0.2 < triangles / 2 / 384 < 0.4
    assert np.abs(qc.mean_curvature(case.mesh, "jet") - case.H).mean() < 0.02


def test_fillet_is_flat_round_and_spherical():
    """Flat parts without curvature, H = 1 / 2r on edges, K = 1 / r^2 at corners; lines between have none."""
    case = cases.fillet(10, 8, 0.2)
    assert set(np.unique(case.H[np.isfinite(case.H)])) == {0.0, 2.5, 5.0}
    np.testing.assert_allclose(np.unique(case.K[np.isfinite(case.K)]), [0, 25])
    assert np.abs(case.mesh.points).max() == pytest.approx(1)
    on_edge = case.H == 2.5
    far = np.sort(np.abs(case.mesh.points[on_edge]), axis=1) - 0.8
    np.testing.assert_allclose(np.hypot(far[:, 1], far[:, 2]), 0.2, rtol=1e-12)
    counts = np.bincount(np.bincount(case.mesh.faces.ravel()))
    assert counts[3] == 8
    assert counts[5:].sum() == 0


@pytest.mark.parametrize("degrees", [10, 30, 60, 90])
def test_crease_has_its_angle(degrees):
    case, off = cases.crease(degrees, n=16)
    x = case.mesh.points.reshape(17, 17, 3)[:, 8]
    left, right = x[8] - x[7], x[9] - x[8]
    # Chords of curved sides bend by a little more.
    angle = np.rad2deg(np.arccos(left @ right / np.linalg.norm(left) / np.linalg.norm(right)))
    assert angle == pytest.approx(degrees, abs=6)
    assert (np.isnan(case.H) == (off == 0)).all()
    smooth = (off > 4) & (np.abs(case.mesh.points[:, :2]) < 0.8).all(axis=1)
    assert np.abs(qc.mean_curvature(case.mesh, "jet") - case.H)[smooth].max() < 1e-3


def test_fans_have_their_valence():
    for valence in (3, 5, 6, 8):
        case = cases.fan(valence, 6)
        assert (np.bincount(case.mesh.faces.ravel()) == valence).any()
        near = accuracy.near_extraordinary(case.mesh, valence)
        assert near.sum() == 1 + valence * (2 + 4 + 2 - 2) if valence != 4 else True
        assert np.abs(qc.mean_curvature(case.mesh, "jet") - case.H)[near].max() < 0.05


@pytest.mark.parametrize(
    ("value", "must", "aim", "word"),
    [
        (0.5, 1, 0.7, "aim"),
        (0.9, 1, 0.7, "must"),
        (1.1, 1, 0.7, "missed"),
        (3.9, 3.8, 6, "must"),
        (6.1, 3.8, 6, "aim"),
        (3.7, 3.8, 6, "missed"),
        (np.nan, 3.8, 6, "missed"),
        (0, 0, 0, "aim"),
        (1, np.nan, np.nan, ""),
    ],
)
def test_verdicts_follow_from_numbers(value, must, aim, word):
    assert verdict(value, must, aim) == word
    row = table([Goal("what", value, must, aim, "there")])[-1]
    assert f"| {word} | there |" in row


def test_parts_take_the_worst():
    part = accuracy.Part()
    part.most("a", {"x": 1.0, "y": 3.0}, 2, 1)
    part.least("b", {"x": 1.0, "y": 3.0}, 2, 4)
    part.most("c", {"x": 1.0, "y": np.nan}, 2, 1)
    assert [(g.value, g.where, g.verdict) for g in part.goals[:2]] == [(3, "y", "missed"), (1, "x", "missed")]
    assert part.goals[2].where == "y"
    assert part.goals[2].verdict == "missed"


def test_coverage_is_a_share(monkeypatch):
    """Intervals that are wide enough hold all, those of no width none; their mean error stands beside."""
    monkeypatch.setattr(accuracy, "NOISE", (1e-2,))
    monkeypatch.setattr(accuracy, "SEEDS", (0,))
    smooth = cases.on(cases.ellipsoid(), cases.cubed(8))
    monkeypatch.setattr(accuracy, "surfaces", lambda: {"ellipsoid": smooth})
    rows = list(accuracy.coverage(["jet"]))
    assert [r[3] for r in rows] == list(accuracy.QUANTITIES)
    assert all(0.8 < r[4] <= 1 and r[5] > 0 for r in rows)
    for width, share in ((1e9, 1), (0, 0)):
        monkeypatch.setattr(accuracy, "error_bars", lambda found, name, w=width: np.full(found.mean.shape, w))
        assert {r[4] for r in accuracy.coverage(["jet"])} == {share}
    monkeypatch.setattr(accuracy, "error_bars", lambda found, name: None)
    assert list(accuracy.coverage(["jet"])) == []


def test_flags_of_curvatures_are_seen():
    found = SimpleNamespace(mean=np.zeros(3), feature=np.array([0, 1, 2]))
    assert accuracy.flagged(found).tolist() == [False, True, True]
    assert not accuracy.flagged(SimpleNamespace(mean=np.zeros(3))).any()


@pytest.mark.parametrize("name", ["features", "speed"])
def test_parts_are_measured_and_written(name):
    part = accuracy.PARTS[name]("jet")
    text = accuracy.markdown({name: part}, "jet")
    assert all(np.isfinite(g.value) and g.verdict for g in part.goals)
    for goal in part.goals:
        assert f"| {goal.name} |" in text
    for title, header, rows in part.details:
        assert rows
        assert all(len(row) == len(header) for row in rows), title


def test_another_checkout_is_measured():
    from pathlib import Path

    rows = list(accuracy.against("jet", Path(qc.__file__).parents[1]))
    assert len(rows) == 5
    assert all(own == pytest.approx(other, rel=1e-9) for _, own, other in rows)


def test_committed_report_has_every_row():
    text = accuracy.REPORT.read_text()
    for goal in (g for name in ("features", "speed") for g in accuracy.PARTS[name]("jet").goals):
        assert f"| {goal.name} |" in text
    ball = cases.cubed(4)
    for scheme in (name for name, s in SCHEMES.items() if isinstance(s, Fit)):
        has_intervals = qc.curvatures(ball, scheme).interval is not None
        assert (f"coverage of 95 % intervals, {scheme}: least" in text) == has_intervals
