"""What is written: an old file survives, names and numbers that a format cannot hold are refused or said."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import trimesh

import quadcurv as qc
from quadcurv import MeshError, PrecisionWarning, QuadGrid, QuadMesh, read, read_values, surfaces, write
from quadcurv.io.colours import viridis
from quadcurv.io.replacing import replacing

SUFFIXES = ["ply", "obj", "off", "vtp", "vtu", "vtk", "vtkhdf", "glb"]
PACKAGE = str(Path(qc.__file__).parents[1])


@pytest.fixture
def mesh() -> QuadMesh:
    return surfaces.torus().sample((6, 5), "faces")[0]


# -------------------------------------------------------------------------------- an old file survives


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_full_disk_leaves_the_old_file(tmp_path, suffix, mesh):
    path = tmp_path / f"a.{suffix}"
    write(path, mesh)
    old = path.read_bytes()
    code = f"""
import resource, numpy as np
import quadcurv as qc
from quadcurv import surfaces
mesh = surfaces.torus().sample((60, 50), "faces")[0]
resource.setrlimit(resource.RLIMIT_FSIZE, (2000, 2000))
try:
    qc.write({str(path)!r}, mesh)
except (OSError, qc.MeshError) as error:
    print("refused", type(error).__name__)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=_env())
    assert run.stdout.startswith("refused"), run.stderr
    assert path.read_bytes() == old
    assert os.listdir(tmp_path) == [path.name]


def _env():
    return {**os.environ, "PYTHONPATH": PACKAGE}


def test_a_kill_leaves_the_old_file_or_the_new_one(tmp_path, mesh):
    path = tmp_path / "a.obj"
    write(path, mesh)
    old = path.read_bytes()
    code = f"""
import quadcurv as qc
from quadcurv import surfaces
mesh = surfaces.torus().sample((100, 100), "faces")[0]
print("ready", flush=True)
while True:
    qc.write({str(path)!r}, mesh)
"""
    for wait in (0.0, 0.1):
        path.write_bytes(old)
        run = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, env=_env())
        run.stdout.readline()
        time.sleep(wait)
        run.kill()
        run.wait()
        run.stdout.close()
        assert len(read(path).points) in (30, 10_000)


def interrupted(path):
    with replacing(path) as beside:
        assert beside.parent == path.parent
        assert beside.suffix == path.suffix
        beside.write_text("new")
        raise KeyboardInterrupt


def test_an_error_leaves_the_old_file_and_nothing_beside(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(KeyboardInterrupt):
        interrupted(path)
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]
    with replacing(path) as beside:
        beside.write_text("new")
    assert path.read_text() == "new"


def test_what_replaces_a_file_has_its_permissions_and_place(tmp_path):
    path, link = tmp_path / "a.txt", tmp_path / "link.txt"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to("a.txt")
    with replacing(link) as beside:
        beside.write_text("new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    (tmp_path / "plain").write_text("")
    with replacing(tmp_path / "fresh.txt") as beside:
        beside.write_text("new")
    assert (tmp_path / "fresh.txt").stat().st_mode == (tmp_path / "plain").stat().st_mode


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_folders_and_pipes_are_not_written_to(tmp_path, suffix, mesh):
    (tmp_path / f"folder.{suffix}").mkdir()
    os.mkfifo(tmp_path / f"pipe.{suffix}")
    with pytest.raises(IsADirectoryError, match="folder"):
        write(tmp_path / f"folder.{suffix}", mesh)
    with pytest.raises(OSError, match=r"pipe.*no regular file"):
        write(tmp_path / f"pipe.{suffix}", mesh)
    with pytest.raises(FileNotFoundError):
        write(tmp_path / "none" / f"a.{suffix}", mesh)
    assert sorted(os.listdir(tmp_path)) == [f"folder.{suffix}", f"pipe.{suffix}"]


# ---------------------------------------------------------------------------------------------- names


NAMES = ["mean curvature", 'a"b', "a<b>&c", "größe", "100%", "a\\b", "x y\tz", "]]>"]


@pytest.mark.parametrize("suffix", ["vtp", "vtu", "vtk", "vtkhdf", "glb"])
def test_names_come_back_whatever_letters_they_have(tmp_path, suffix, mesh):
    names = [name for name in NAMES if "\t" not in name and not ("/" in name and suffix == "vtkhdf")]
    H = np.arange(len(mesh.points)) / 7
    write(tmp_path / f"a.{suffix}", mesh, {name: H + k for k, name in enumerate(names)})
    values = read_values(tmp_path / f"a.{suffix}")
    assert set(values) == set(names)
    for k, name in enumerate(names):
        np.testing.assert_allclose(values[name], H + k, rtol=1e-6)
    assert len(read(tmp_path / f"a.{suffix}").faces) == len(mesh.faces)


@pytest.mark.parametrize(
    ("suffix", "name"),
    [
        ("ply", "end_header"),
        ("ply", "a\nend_header"),
        ("ply", "a b"),
        ("ply", "größe"),
        ("ply", "a\0b"),
        ("vtp", "a\nb"),
        ("vtu", "a\0b"),
        ("vtk", "a\0b"),
        ("glb", ""),
    ],
)
def test_names_that_a_format_cannot_hold_are_refused(tmp_path, suffix, name, mesh):
    with pytest.raises((MeshError, TypeError), match=r"is no (PLY )?name|no name|expected a word"):
        write(tmp_path / f"a.{suffix}", mesh, {name: np.zeros(len(mesh.points))})
    assert os.listdir(tmp_path) == []


# -------------------------------------------------------------------------------------------- numbers


def test_single_precision_says_what_it_loses(tmp_path, mesh):
    n = len(mesh.points)
    with pytest.raises(MeshError, match=r"H: 1 values beyond single precision"):
        write(tmp_path / "a.glb", mesh, {"H": np.where(np.arange(n) == 3, 1e39, 1.0)})
    with pytest.warns(PrecisionWarning, match=r"H: 2 values below single precision are 0"):
        write(tmp_path / "a.glb", mesh, {"H": np.where(np.arange(n) < 2, 1e-60, 1.0)})
    with pytest.warns(PrecisionWarning, match=r"H: 1 infinite values are not known"):
        write(tmp_path / "a.glb", mesh, {"H": np.where(np.arange(n) == 3, np.inf, 1.0)})
    far = mesh.with_points(mesh.points + 1e6)
    with pytest.warns(PrecisionWarning, match=r"moves them by up to 0\.\d+, .* of an edge"):
        write(tmp_path / "a.glb", far)
    with pytest.raises(MeshError, match=r"points: 74 values beyond single precision"):
        write(tmp_path / "a.glb", mesh.with_points(mesh.points * 1e40))


def test_integers_beyond_doubles_are_said(tmp_path, mesh):
    count = np.full(len(mesh.points), 2**60 + 1)
    with pytest.warns(PrecisionWarning, match=r"k: integers up to 1152921504606846977 are rounded"):
        write(tmp_path / "a.ply", mesh, {"k": count})
    write(tmp_path / "a.ply", mesh, {"k": count // 2**10})
    np.testing.assert_array_equal(read_values(tmp_path / "a.ply")["k"], count // 2**10)
    write(tmp_path / "a.vtp", mesh, {"k": count})
    np.testing.assert_array_equal(read_values(tmp_path / "a.vtp")["k"], count)


@pytest.mark.parametrize("suffix", ["vtp", "vtu", "vtk", "vtkhdf"])
def test_vtk_keeps_every_type_of_number(tmp_path, suffix, mesh):
    n = len(mesh.points)
    types = ["f2", "f4", "f8", "g", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "?"]
    data = {f"a_{kind}": (np.arange(n) % 2).astype(kind) for kind in types}
    write(tmp_path / f"a.{suffix}", mesh, data)
    values = read_values(tmp_path / f"a.{suffix}")
    seen = pv.read(tmp_path / f"a.{suffix}")
    for kind in types:
        stored = {"f2": "f4", "g": "f8"}.get(kind, kind)
        if kind == "?" and suffix == "vtk":
            stored = "u1"
        assert values[f"a_{kind}"].dtype == np.dtype(stored), kind
        assert seen[f"a_{kind}"].dtype == np.dtype(stored), kind
        np.testing.assert_array_equal(values[f"a_{kind}"], data[f"a_{kind}"])


# ------------------------------------------------------------------------- what other programs then see


def test_unknown_values_are_grey_in_a_glb_and_come_back(tmp_path, mesh):
    n = len(mesh.points)
    H = np.where(np.arange(n) == 3, np.nan, np.arange(n) / 8)
    flow = np.where(np.arange(n)[:, None] == 4, np.nan, mesh.points)
    write(tmp_path / "a.glb", mesh, {"H": H, "flow": flow})
    values = read_values(tmp_path / "a.glb")
    np.testing.assert_array_equal(values["H"], H.astype(np.float32))
    np.testing.assert_array_equal(values["flow"], flow.astype(np.float32))
    (found,) = trimesh.load_scene(tmp_path / "a.glb", process=False).geometry.values()
    assert np.isfinite(found.vertex_attributes["_H"]).all()
    assert found.visual.vertex_colors[3].tolist() == [128, 128, 128, 255]
    with pytest.raises(MeshError, match="repeat each other's in a GLB file"):
        write(tmp_path / "a.glb", mesh, {"H": H, "H_known": np.zeros(n)})


def test_the_first_scalars_of_a_ply_file_are_seen_as_colours(tmp_path, mesh):
    H = np.arange(len(mesh.points)) / 8
    H[3] = np.nan
    write(tmp_path / "a.ply", mesh, {"n": mesh.points, "H": H, "K": -H})
    dark, bright, grey = [68, 1, 84, 255], [253, 231, 36, 255], [128, 128, 128, 255]
    by_pyvista = np.asarray(pv.read(tmp_path / "a.ply")["RGBA"])
    by_trimesh = np.asarray(trimesh.load(tmp_path / "a.ply", process=False).visual.vertex_colors)
    for colours in (by_pyvista, by_trimesh):
        assert colours[[0, -1, 3]].tolist() == [dark, bright, grey]
    assert list(read_values(tmp_path / "a.ply")) == ["n", "H", "K"]
    # Colours that are given are values as others.
    given = dict(zip(("red", "green", "blue"), np.eye(3, len(mesh.points), dtype=np.uint8), strict=True))
    write(tmp_path / "a.ply", mesh, {"H": H, **given})
    assert list(read_values(tmp_path / "a.ply")) == ["H", "red", "green", "blue"]


def test_colours_of_files_are_those_of_viridis():
    from matplotlib import colormaps

    values = np.linspace(-1, 1, 1001)
    share = np.clip((values + 0.96) / 1.92, 0, 1)
    expected = colormaps["viridis"](share, bytes=True).astype(int)
    np.testing.assert_allclose(viridis(values).astype(int), expected, atol=6)
    assert viridis(np.full(3, np.nan)).tolist() == [[128, 128, 128, 255]] * 3
    assert viridis(np.ones(2)).tolist() == [[68, 1, 84, 255]] * 2


def test_files_with_values_need_no_extra(tmp_path):
    code = f"""
import sys
for name in ("matplotlib", "pyvista", "vtk", "vtkmodules", "meshlane", "pymeshlab"):
    sys.modules[name] = None
import numpy as np, quadcurv as qc
mesh = qc.surfaces.torus().sample((6, 5), "faces")[0]
for suffix in ("ply", "vtp", "vtu", "vtk", "glb"):
    qc.write({str(tmp_path)!r} + "/a." + suffix, mesh, {{"H": np.arange(30.0)}})
print(qc.read_values({str(tmp_path)!r} + "/a.ply")["H"].sum())
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=_env())
    assert run.stdout.split() == ["435.0"], run.stderr
    assert len(os.listdir(tmp_path)) == 5


def test_polygons_of_many_sides_are_written(tmp_path):
    angle = 2 * np.pi * np.arange(300) / 300
    disk = QuadMesh(np.stack((np.cos(angle), np.sin(angle), 0 * angle), axis=-1), [range(300)])
    for suffix in ("ply", "obj", "off", "vtp", "vtu", "vtk"):
        write(tmp_path / f"a.{suffix}", disk)
        found = read(tmp_path / f"a.{suffix}")
        np.testing.assert_array_equal(found.points, disk.points)
        np.testing.assert_array_equal(found.faces, disk.faces)
    assert pv.read(tmp_path / "a.vtu").n_cells == pv.read(tmp_path / "a.vtk").n_cells == 1


def test_the_active_values_are_the_first_of_their_kind(tmp_path, mesh):
    data = {"a": mesh.points, "H": mesh.points[:, 0], "normal": mesh.points, "K": mesh.points[:, 1]}
    for suffix in ("vtp", "vtu", "vtk"):
        write(tmp_path / f"a.{suffix}", mesh, data)
        seen = pv.read(tmp_path / f"a.{suffix}")
        assert seen.point_data.active_scalars_name == "H"
        assert seen.point_data.active_vectors_name == "a"
        assert seen.point_data.active_normals_name == "normal"


def test_a_grid_with_holes_is_written_without_them(tmp_path):
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    mask = np.zeros((5, 6), bool)
    mask[2, 1] = True
    grid = QuadGrid(np.stack((x, y, x * y), axis=-1), mask=mask)
    write(tmp_path / "a.ply", grid, {"height": x * y, "at": np.stack((x, y, x * y), axis=-1)})
    found = read(tmp_path / "a.ply")
    assert len(found.points) == 29
    np.testing.assert_array_equal(read_values(tmp_path / "a.ply")["height"], (x * y)[~mask])
    np.testing.assert_array_equal(read_values(tmp_path / "a.ply")["at"], found.points)


def test_unknown_suffixes_list_what_there_is(tmp_path, mesh):
    with pytest.raises(MeshError, match=r"cannot write \.step; \.glb, \.obj, \.off, \.ply, .* can be"):
        write(tmp_path / "a.step", mesh)
    with pytest.raises(MeshError, match=r"\.obj holds no values; \.glb, \.ply, .*\.vtu do"):
        write(tmp_path / "a.obj", mesh, {"H": np.zeros(30)})
    (tmp_path / "a.step").write_text("")
    with pytest.raises(MeshError, match=r"cannot read \.step; .*\.msh, \.nas, \.obj, .* can be"):
        read(tmp_path / "a.step")
