"""Without its extras the package computes, reads and writes, and names what is missing with its command."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import quadcurv as qc
from quadcurv import extras, surfaces
from quadcurv.cli import main

HIDDEN = ("matplotlib", "pyvista", "vtkmodules", "vtk", "meshlane", "pymeshlab")


@pytest.fixture
def mesh():
    return surfaces.cubed_sphere().sample((4, 4), "faces")[0]


@pytest.fixture
def alone(monkeypatch):
    for name in HIDDEN:
        for loaded in [m for m in sys.modules if m == name or m.startswith(f"{name}.")]:
            monkeypatch.delitem(sys.modules, loaded)
        monkeypatch.setitem(sys.modules, name, None)
    qc.viewing.opengl_problem.cache_clear()
    yield
    qc.viewing.opengl_problem.cache_clear()


def named(extra):
    return rf'is not installed: pip install "quadcurv\[{extra}\]"'


@pytest.mark.parametrize(
    ("ask", "extra"),
    [
        (qc.to_pyvista, "view"),
        (qc.to_pymeshlab, "meshlab"),
        (lambda mesh: qc.viewing.html_page(mesh), "view"),
        (lambda mesh: qc.viewing.maps(mesh), "view"),
        (lambda mesh: qc.viewing.Style(colours="viridis"), "view"),
        (lambda mesh: qc.viewing.surfaces_figure({}), "view"),
        (lambda mesh: qc.attach(qc.to_trimesh(mesh), "H", qc.mean_curvature(mesh)), "view"),
    ],
)
def test_what_is_missing_is_named(alone, mesh, ask, extra):
    with pytest.raises((ImportError, qc.viewing.NoOpenGLError), match=named(extra)):
        ask(mesh)


@pytest.mark.parametrize(("suffix", "extra"), [(".vtu", "view"), (".msh", "formats")])
def test_formats_name_their_extra(alone, tmp_path, suffix, extra):
    path = tmp_path / f"mesh{suffix}"
    path.write_text("something")
    with pytest.raises(ImportError, match=named(extra)):
        qc.read(path)


def test_formats_that_vtk_writes_name_their_extra(alone, mesh, tmp_path):
    qc.write(tmp_path / "mesh.vtp", mesh)  # this one is written without VTK
    with pytest.raises(ImportError, match=named("view")):
        qc.write(tmp_path / "mesh.vtkhdf", mesh)


def test_pictures_name_their_extra(alone, mesh, tmp_path):
    with pytest.raises(qc.viewing.NoOpenGLError, match=named("view")):
        qc.viewing.save_maps(mesh, tmp_path / "map.png")


def test_command_line_compares_without_pictures(alone, mesh, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    qc.write("mesh.obj", mesh)
    with pytest.raises(SystemExit) as end:
        main(["compare", "mesh.obj", "-s", "liu", "-s", "jet"])
    assert end.value.code in (0, None)
    said = capsys.readouterr()
    assert "liu" in said.out
    assert 'no pictures: matplotlib is not installed: pip install "quadcurv[view]"' in said.err
    for command in (["compare", "mesh.obj", "-o", "there"], ["view", "mesh.obj"]):
        with pytest.raises(SystemExit) as end:
            main(command)
        assert end.value.code == 2
        assert 'pip install "quadcurv[view]"' in capsys.readouterr().err


def test_core_needs_no_extra():
    """In a process of its own, as other tests have imported all of them."""
    code = f"""
import sys
for name in {HIDDEN!r}:
    sys.modules[name] = None
import quadcurv as qc
ball = qc.surfaces.cubed_sphere().sample((4, 4), "faces")[0]
for scheme in qc.SCHEMES:
    qc.mean_curvature(ball, scheme)
print(qc.compare(ball, ["liu", "cotan-6"], exact=1.0), qc.stiffness_matrix(ball).shape)
"""
    command = [sys.executable, "-c", code]
    run = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    assert "(98, 98)" in run.stdout


def test_every_extra_is_declared():
    project = tomllib.loads((Path(__file__).parents[1] / "pyproject.toml").read_text())["project"]
    declared = project["optional-dependencies"]
    for library, extra in extras._EXTRAS.items():
        names = {re.match(r"[\w-]+", requirement)[0] for requirement in declared[extra]}
        assert {"vtkmodules": "vtk", "cupy": "cupy-cuda13x"}.get(library, library) in names


def test_nothing_is_missing_where_all_is_there():
    assert extras.missing("matplotlib", "pyvista") is None
