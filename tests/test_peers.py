"""Adapters to other libraries, and what the comparison with them says."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from comparisons import cases, cgal, libraries, peers
from comparisons.children import surviving
from quadcurv import SCHEMES
from quadcurv.surfaces import cubed_sphere, elliptic_paraboloid

ALL = {m.name: m for m in (*libraries.PEERS, *libraries.ours())}
PEERS = [m.name for m in libraries.PEERS]


@pytest.fixture(scope="module")
def sphere():
    return cubed_sphere(2.0).sample((24, 24), "faces")[0]


def called(name, mesh):
    method = ALL[name]
    if method.missing:
        pytest.skip(f"{name}: {method.missing}")
    with np.errstate(all="ignore"):
        return method.call(mesh)


@pytest.mark.parametrize("name", ALL)
def test_sign_and_factor_on_a_sphere(sphere, name):
    """H = 1/2 and K = 1/4 outward on a sphere of radius 2, pointwise and not 2 H."""
    found = called(name, sphere)
    assert set(found) <= set(libraries.QUANTITIES)
    exact = {"H": 0.5, "K": 0.25, "k1": 0.5, "k2": 0.5}
    biased = name.startswith(("cotan-4", "cotan-8")) or name == "MeshLab Taubin"  # which do not converge
    for quantity, values in found.items():
        assert values.shape == (len(sphere.points),)
        rel = (0.7 if biased else 0.05) + (0.15 if name == "PyGEL quadric on quads" else 0)
        assert np.median(values) == pytest.approx(exact[quantity], rel=rel), quantity
    if "k1" in found:
        assert (found["k1"] >= found["k2"]).all()


@pytest.mark.parametrize("name", [name for name in PEERS if name != "trimesh"])
def test_bowl_seen_from_inside_is_negative(name):
    mesh, xi, eta = elliptic_paraboloid().sample((16, 16), "faces")
    middle = np.argmin(np.hypot(xi, eta))
    found = called(name, mesh)
    assert found["H"][middle] == pytest.approx(-2, rel=0.5)
    if "K" in found:
        assert found["K"][middle] == pytest.approx(4, rel=0.9)


def test_libigl_cotan_and_bunge_are_ours(sphere):
    for peer, own in (("libigl cotan, Voronoi", "cotan-6-voronoi"), ("libigl Bunge", "bunge")):
        # The same H n, on different normals.
        assert np.abs(ALL[peer].call(sphere)["H"] - ALL[own].call(sphere)["H"]).max() < 2e-3


def test_vtk_is_wrong_on_quads(sphere):
    assert np.abs(np.median(libraries.vtk_quads(sphere)) - 0.5) > 0.1
    assert np.abs(np.median(ALL["VTK"].call(sphere)["H"]) - 0.5) < 0.01


def test_neighbourhoods_are_rings_of_faces():
    mesh = cases.patch(8).mesh
    for rings in (1, 2, 3):
        around = cgal.neighbourhoods(mesh, rings)
        middle = len(mesh.points) // 2
        assert around[[middle]].nnz == (2 * rings + 1) ** 2 - 1
        assert around[[0]].nnz == (rings + 1) ** 2 - 1
        assert around.diagonal().sum() == 0


def test_cgal_without_a_compiler_says_so(monkeypatch, tmp_path):
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setattr(cgal.shutil, "which", lambda name: None)
    cgal.program.cache_clear()
    assert cgal.program(tmp_path) == (None, "no C++ compiler")
    assert ALL["CGAL jet 4, 2 rings"].missing == "" or cgal.program(libraries.OUTPUT)[0] is None
    cgal.program.cache_clear()


def test_cgal_without_headers_says_so(monkeypatch, tmp_path):
    broken = tmp_path / "broken.cpp"
    broken.write_text("#include <no_such_header_anywhere.h>\n")
    monkeypatch.setattr(cgal, "SOURCE", broken)
    cgal.program.cache_clear()
    path, why = cgal.program(tmp_path)
    cgal.program.cache_clear()
    assert path is None
    assert "no_such_header_anywhere" in why or why == "no C++ compiler"


def test_sixteen_meshes():
    assert len(peers.MESHES) == 16
    for name, (title, make) in peers.MESHES.items():
        case = make(8)
        assert title
        assert case.H.shape == case.K.shape == (len(case.mesh.points),), name
        known = np.isfinite(case.H)
        assert known.mean() > 0.6, name
        np.testing.assert_allclose((case.k1 * case.k2)[known], case.K[known], atol=1e-9 * np.nanmax(case.K))


def record(mesh, method, H, own=False, **rest):
    values = {"H mean": H, "K mean": H, "k1 mean": H, "k2 mean": H}
    return {"mesh": mesh, "method": method, "ours": own, "vertices": 100, "without": 0, **values, **rest}


def made(jet=1.0, peer=2.0):
    return [
        record("smooth", "VTK", peer),
        record("smooth", "trimesh", 5.0),
        record("smooth", "jet", jet, True),
        record("smooth", "liu", 1.5, True),
        record("fillet", "VTK", 3.0),
        record("fillet", "jet", 3.0, True),
    ]


def test_words_follow_from_the_numbers():
    """A spoilt number takes the word with it, in the row and in the sentence."""
    text = "\n".join(peers.opening(made(), "H"))
    assert "| smooth | VTK | 2.0e+00 | 1.0e+00 | 2 | first | jet | 1.0e+00 | 2 | first |" in text
    assert "`jet` is first on 1 of 2 meshes, equal to the best peer on 1 (fillet)." in text
    spoilt = "\n".join(peers.opening(made(jet=2.5), "H"))
    assert "| smooth | VTK | 2.0e+00 | 2.5e+00 | 0.8 | behind | liu | 1.5e+00 | 1.33 | first |" in spoilt
    assert "`jet` is first on 0 of 2 meshes" in spoilt
    assert "and not first on 1: smooth." in spoilt
    assert "The best of our schemes, in hindsight, is first on 1 of 2 meshes" in spoilt
    better = "\n".join(peers.opening(made(peer=0.5), "k"))
    assert "| smooth | VTK | 5.0e-01 | 1.0e+00 | 0.5 | behind |" in better


def test_choice_follows_from_the_numbers():
    records = [*made(), record("smooth", "bilinear", 3.0, True)]
    text = "\n".join(peers.choice(records))
    assert text.startswith(peers.CHOICE[0])
    assert "| smooth | jet | 1.00 | liu | 2.00 | jet | 1.00 |" in text
    assert "`jet` is the best of ours for H, or within 10 % of it, on 2 of 2." in text
    spoilt = "\n".join(peers.choice([*made(jet=4.5), record("smooth", "bilinear", 3.0, True)]))
    assert "| smooth | liu | 3.00 | liu | 2.00 | liu | 3.00 |" in spoilt
    assert (
        "on 1 of 2. Elsewhere another has less error, by the factor given: smooth (`liu`, 3 times)." in spoilt
    )


@pytest.mark.parametrize(
    ("ratio", "word"),
    [
        (2, "first"),
        (1.006, "first"),
        (1.004, "equal"),
        (0.996, "equal"),
        (0.99, "behind"),
        (np.nan, "behind"),
    ],
)
def test_word(ratio, word):
    assert peers.word(ratio) == word


def test_who_has_no_values_does_not_count():
    records = [*made(), record("smooth", "cheat", 1e-9, without=2), record("smooth", "one", 1.9, without=1)]
    assert peers.standings(records, "H")[0].peer == "one"
    records = [r for r in made() if r["method"] != "jet"]
    assert peers.word(peers.standings(records, "H")[1].ratio) == "behind"  # ours is nowhere


def test_jets_are_best_where_grids_are_not_smooth():
    """Jittered torus: only fits converge, and the jet has a third of the Laplacians' errors at least."""
    case = cases.ring().jittered(cases.ring_grid(96, 48).mesh, 0.2)
    chosen = [m for m in ALL.values() if not m.missing and m.library != "CGAL"]
    found = {m.name: peers.error(peers.measured(m, case), "H") for m in chosen if m.name != "trimesh"}
    best = found.pop("jet")
    assert best < 1.5e-3
    others = {name: e for name, e in found.items() if not name.startswith("jet")}
    assert np.nanmin(list(others.values())) > 3 * best


def test_noise_is_averaged():
    case = peers.MESHES["noise 5e-2"][1](16)
    found = {
        name: peers.error(peers.measured(ALL[name], case), "H") for name in ("finite_volume", "liu", "jet")
    }
    assert found["jet"] < 0.2 * min(found["finite_volume"], found["liu"])


def test_records_table_and_figure(tmp_path):
    methods = [
        ALL[name] for name in ("finite_volume", "jet", "libigl cotan, Voronoi", "libigl principal, radius 2")
    ]
    records = [record for method in methods for record in peers.errors(method, 8)]
    assert len(records) == 16 * len(methods)
    assert {r["mesh"] for r in records} == set(peers.MESHES)
    peers.draw(records, tmp_path)
    cost = {m.name: peers.Cost(1.0, np.nan) for m in methods}
    peers.save(records, cost, tmp_path)
    again, known = peers.others(tmp_path, methods[2:])
    assert again == [r for r in records if r["method"].startswith("libigl")]
    assert set(known) == {m.name for m in methods[2:]}
    with pytest.raises(ValueError, match="is of other methods or meshes"):
        peers.others(tmp_path, [*methods, ALL["liu"]])
    assert (tmp_path / "peers.png").stat().st_size > 10_000
    assert (tmp_path / "peers.csv").read_text().count("\n") == len(records) + 1
    text = peers.markdown(records, {"jet": peers.Cost(1.0, 2.0)}, 8, methods)
    assert text.index("Who is first") < text.index("Mesh by mesh")
    for quantity in peers.TITLES.values():
        assert quantity in text
    assert "| jet | 1.00 | 2 | as they are |  |" in text
    assert "vtkCurvatures takes a quad's corners" in text


def test_survey_is_of_all_meshes_and_of_one_call():
    records, cost = peers.survey("finite_volume", 8, 16)
    assert [r["mesh"] for r in records] == list(peers.MESHES)
    assert 0 < cost.microseconds < 1e5
    assert 0 <= cost.bytes < 1e9


def ending(first, count, bad):
    for k in range(first, count):
        if k == bad:
            os._exit(1)
        if k == bad + 1:
            raise SystemExit
        yield k * k


def test_what_ends_its_process_is_left_out():
    assert surviving(ending, 5, 5, 2) == [0, 1, None, None, 16]


def test_record_of_an_ended_process(monkeypatch):
    found = [peers.Cost(1, 2), *(record(mesh, "liu", 1.0) for mesh in peers.MESHES)]
    found[3] = None
    monkeypatch.setattr(peers, "surviving", lambda *given: found)
    records, _ = peers.survey("liu", 8, 16)
    assert [r["mesh"] for r in records] == list(peers.MESHES)
    assert not peers.complete(records[2], "H")
    assert peers._details("mixed", records[2:3])[-2].endswith("| ended its process |")
    found[0] = None
    with pytest.raises(RuntimeError, match="liu: ended its process"):
        peers.survey("liu", 8, 16)


def test_hindsight_is_the_least_error_of_all_peers():
    chosen = [cases.on(cases.ellipsoid(), cases.cubed(n)) for n in (3, 4)]
    for case, (found,) in zip(chosen, peers.hindsight(chosen), strict=True):
        records = [peers.measured(m, case) for m in libraries.PEERS if not m.missing]
        best = min(peers.error(r, "H") for r in records if peers.complete(r, "H"))
        assert found == pytest.approx(best, rel=0.05)  # APSS differs from call to call


def test_written_table_has_every_scheme_and_every_peer():
    text = Path(peers.__file__).with_name("PEERS.md").read_text()
    for name in (*SCHEMES, "angle_defect", *PEERS):
        assert f"| {name} |" in text
    for name in peers.MESHES:
        assert f"### {name[0].upper()}{name[1:]}" in text


def test_documentation_shows_the_choice():
    """The page on operators includes the table itself, between the marks that are in it."""
    text = Path(peers.__file__).with_name("PEERS.md").read_text()
    page = Path(peers.__file__).parents[1].joinpath("docs/guide/operators.md").read_text()
    begin, end = peers.CHOICE
    assert f":start-after: {begin!r}" in page.replace('"', "'")
    assert f":end-before: {end!r}" in page.replace('"', "'")
    assert text.count(begin) == text.count(end) == 1
    assert text.index(begin) < text.index(end)


def test_not_installed_is_left_out_and_named():
    method = libraries.Method("none", "no_such_library_anywhere", lambda mesh: {})
    assert "no_such_library_anywhere" in method.missing
    needy = libraries.Method("none", "numpy", lambda mesh: {}, needs=("no_such_library_anywhere",))
    assert "no_such_library_anywhere" in needy.missing
