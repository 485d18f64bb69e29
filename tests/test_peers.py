"""Adapters to other libraries, and what the comparison with them says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from comparisons import peers
from quadcurv import SCHEMES
from quadcurv.surfaces import cubed_sphere, elliptic_paraboloid

ALL = {m.name: m for m in (*peers.PEERS, *peers.ours())}


@pytest.fixture(scope="module")
def sphere():
    return cubed_sphere(2.0).sample((24, 24), "faces")[0]


@pytest.mark.parametrize("name", ALL)
def test_sign_and_factor_on_a_sphere(sphere, name):
    """H = 1/2 outward on a sphere of radius 2, pointwise and not 2 H."""
    method = ALL[name]
    if not method.installed:
        pytest.skip(f"{method.library} is not installed")
    H = method.call(sphere)
    assert H.shape == (len(sphere.points),)
    biased = name.startswith(("cotan-4", "cotan-8"))  # which do not converge: not 1 all the same
    assert np.median(H) == pytest.approx(0.5, rel=0.6 if biased else 0.05)


@pytest.mark.parametrize("name", [m.name for m in peers.PEERS if not m.name.startswith("trimesh")])
def test_bowl_seen_from_inside_is_negative(name):
    method = ALL[name]
    if not method.installed:
        pytest.skip(f"{method.library} is not installed")
    mesh, xi, eta = elliptic_paraboloid().sample((16, 16), "faces")
    middle = np.argmin(np.hypot(xi, eta))
    assert method.call(mesh)[middle] == pytest.approx(-2, rel=0.5)


def test_libigl_cotan_and_bunge_are_ours(sphere):
    for peer, own in (("libigl cotan, Voronoi", "cotan-6-voronoi"), ("libigl Bunge", "bunge")):
        # The same H n, on different normals.
        assert np.abs(ALL[peer].call(sphere) - ALL[own].call(sphere)).max() < 2e-3


def test_vtk_is_wrong_on_quads(sphere):
    assert np.abs(np.median(peers._vtk_quads(sphere)) - 0.5) > 0.1
    assert np.abs(np.median(ALL["VTK"].call(sphere)) - 0.5) < 0.01


def test_jets_are_best_where_grids_are_not_smooth():
    """Jittered torus: only fits converge, and the jet has a third of the others' errors at least."""
    sample = peers.MESHES["jittered"](48)
    chosen = [m for m in ALL.values() if m.installed and m.name not in ("trimesh", "jet-auto")]
    found = {m.name: peers.measured(m, sample)["one"] for m in chosen}
    best = found.pop("jet")
    assert best < 1e-3
    assert min(found.values()) > 3 * best


def test_noise_wants_the_automatic_fit():
    sample = peers.MESHES["noisy"](64)
    found = {
        name: peers.measured(ALL[name], sample)["one"] for name in ("finite_volume", "liu", "jet", "jet-auto")
    }
    assert found["jet-auto"] < 0.4 * min(found["finite_volume"], found["liu"], found["jet"])


def test_records_table_and_figure(tmp_path):
    methods = [
        ALL[name] for name in ("finite_volume", "jet", "libigl cotan, Voronoi", "libigl principal, radius 2")
    ]
    records = list(peers.errors(methods, (8, 16)))
    assert len(records) == 2 * (8 * len(methods) + 4 * 2)
    assert {r["mesh"] for r in records} == set(peers.MESHES) == set(peers.TITLES)
    peers.draw(records, tmp_path)
    assert (tmp_path / "peers.png").stat().st_size > 10_000
    text = peers.markdown(records, {"jet": (1.0, 2.0)}, 8, methods)
    for title in peers.TITLES.values():
        assert title[1:] in text
    assert "| jet | 1.00 | 2 | as they are |  |" in text
    assert "vtkCurvatures takes a quad's corners" in text


def test_memory_and_time_are_those_of_one_call():
    seconds, mebibytes, vertices = peers._cost("finite_volume", 16)
    assert 0 < seconds < 5
    assert 0 <= mebibytes < 1000
    assert vertices == 6 * 16**2 + 2


def test_written_table_has_every_scheme():
    text = Path(peers.__file__).with_name("PEERS.md").read_text()
    known = [name for name in SCHEMES if name != "bilinear"]  # which came after the last measurement
    for name in (*known, "fundamental_forms-4", *(m.name for m in peers.PEERS)):
        assert f"| {name} |" in text
    for title in peers.TITLES.values():
        assert title[1:] in text


def test_not_installed_is_left_out():
    method = peers.Method("none", "no_such_library_anywhere", lambda mesh: mesh)
    assert not method.installed
    assert not peers.Method("none", "numpy", lambda mesh: mesh, needs=("no_such_library_anywhere",)).installed
