"""Files that other libraries read: damaged ones end no process, take no memory, run nothing."""

from __future__ import annotations

import json
import os
import resource
import struct
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import pyvista as pv
import trimesh

import quadcurv as qc
from quadcurv import MeshError, QuadGrid, QuadMesh, read, read_values, write
from quadcurv.io import isolation
from quadcurv.io.cells import faces_of_cells, type_of_name

PACKAGE = Path(qc.__file__).parents[1]


@pytest.fixture
def plane():
    data = pv.Plane(i_resolution=2, j_resolution=2)
    data["H"] = np.arange(9.0)
    return data


def damaged(path, old, new):
    content = path.read_bytes()
    assert old in content
    path.write_bytes(content.replace(old, new))


# ------------------------------------------------------------------------------------ what kills VTK


@pytest.mark.parametrize(
    ("suffix", "old", "new"),
    [
        ("vtp", b'NumberOfPoints="9"', b'NumberOfPoints="1000000000000"'),
        ("vtp", b'NumberOfPoints="9"', b'NumberOfPoints="8"'),
        ("vtp", b'NumberOfPolys="4"', b'NumberOfPolys="400000000"'),
        ("vtu", b'NumberOfCells="4"', b'NumberOfCells="9"'),
        ("vtk", b"POINTS 9", b"POINTS 999999999999"),
        ("vtk", b"POLYGONS 4 20", b"POLYGONS 4 2000000000"),
        ("vtk", b"4 0 1 4 3", b"99999999 0 1 4 3"),
        ("vts", b"0 1 0 2 0 0", b"0 1000000 0 1000000 0 0"),
        ("vts", b'WholeExtent="0 1 0 2 0 0"', b'WholeExtent="0 1 0 9 0 0"'),
    ],
)
def test_small_broken_vtk_files_are_mesh_errors(tmp_path, plane, suffix, old, new):
    path = tmp_path / f"a.{suffix}"
    if suffix == "vts":
        plane = pv.StructuredGrid(*np.meshgrid([0.0, 1], [0.0, 1, 2], [0.0], indexing="ij"))
    elif suffix == "vtu":
        plane = plane.cast_to_unstructured_grid()
    if suffix == "vtk":
        rows = "\n".join("4 " + " ".join(map(str, face)) for face in plane.regular_faces)
        points = "\n".join(" ".join(map(str, point)) for point in plane.points)
        head = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\n"
        path.write_text(f"{head}POINTS 9 float\n{points}\nPOLYGONS 4 20\n{rows}\n")
    else:
        plane.save(path, binary=False)
    assert read(path)
    damaged(path, old, new)
    start = time.monotonic()
    with pytest.raises(MeshError):
        read(path)
    assert time.monotonic() - start < 20


def test_a_partial_piece_is_no_grid(tmp_path):
    pv.StructuredGrid(*np.meshgrid([0.0, 1], [0.0, 1, 2], [0.0], indexing="ij")).save(tmp_path / "a.vts")
    damaged(tmp_path / "a.vts", b'WholeExtent="0 1 0 2 0 0"', b'WholeExtent="0 1 0 5 0 0"')
    with pytest.raises(MeshError, match="2 of 5 cells of the StructuredGrid are in the file"):
        read(tmp_path / "a.vts")


def glb(document, body=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    if body:
        chunks += struct.pack("<II", len(body), 0x004E4942) + body
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def test_a_small_glb_does_not_take_all_memory(tmp_path):
    count = 700_000_000
    document = {
        "asset": {"version": "2.0"},
        "accessors": [
            {"componentType": 5126, "count": count, "type": "VEC3"},
            {"componentType": 5125, "count": 3, "type": "SCALAR"},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
        "scene": 0,
    }
    (tmp_path / "bomb.glb").write_bytes(glb(document))
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    with pytest.raises(MeshError):
        read(tmp_path / "bomb.glb")
    after = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    assert after == before or after < 700_000  # kB; the library itself is most of it


def test_what_kills_a_reader_is_told(tmp_path, monkeypatch, plane):
    plane.save(tmp_path / "a.vtp")
    script = tmp_path / "child.py"

    class Other:
        __file__ = str(script)

    monkeypatch.setattr(isolation, "child", Other)
    monkeypatch.setattr(isolation, "SECONDS", 1)
    for body, message in (
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "died of it .SIGSEGV"),
        ("import os; os._exit(3)", "died of it .exit code 3"),
        ("print('{')", "died of it .exit code 0"),
        ('print(\'{"arrays": [["points", "<f8", [1000000000, 3]]]}\')', "died of it"),
        ('print(\'{"arrays": [["points", "O", [1]]]}\')', "died of it"),
        ('print(\'{"error": "no mesh"}\')', "no mesh"),
        (
            "import resource\nresource.setrlimit(resource.RLIMIT_CPU, (1, 1))\nwhile True: pass",
            "takes more than 1 s",
        ),
    ):
        script.write_text(body)
        with pytest.raises(MeshError, match=rf"a\.vtp: .*{message}"):
            read(tmp_path / "a.vtp")
    monkeypatch.setattr(sys, "executable", "")
    with pytest.raises(MeshError, match="by a second Python, and this program has none"):
        read(tmp_path / "a.vtp")


def test_a_reader_that_hangs_is_ended(tmp_path, monkeypatch, plane):
    plane.save(tmp_path / "a.vtp")
    script = tmp_path / "child.py"
    script.write_text("import time; time.sleep(60)")
    monkeypatch.setattr(isolation, "child", type("Other", (), {"__file__": str(script)}))
    monkeypatch.setattr(isolation, "WALL", 0.5)
    monkeypatch.setattr(isolation, "SECONDS", 0)
    start = time.monotonic()
    with pytest.raises(MeshError, match="takes more than"):
        read(tmp_path / "a.vtp")
    assert time.monotonic() - start < 10


# ---------------------------------------------------------------------------- the current folder, links


@pytest.mark.parametrize("how", ["-c", "script"])
def test_nothing_of_the_current_folder_is_run(tmp_path, plane, how):
    plane.save(tmp_path / "a.vtp")
    trimesh.creation.box().export(tmp_path / "b.glb")
    for name in ("vtkmodules", "trimesh", "meshlane", "json", "runpy", "resource", "contextlib", "pyvista"):
        (tmp_path / f"{name}.py").write_text(
            "import os; open(os.path.join(os.path.dirname(__file__), 'ran.txt'), 'a').write(__name__)"
        )
    # The caller's own imports are done before it goes there, as if it had started elsewhere.
    code = (
        "import sys, os, json, runpy, resource, contextlib; import quadcurv as qc; "
        f"os.chdir({str(tmp_path)!r}); sys.path.insert(0, ''); sys.path.insert(0, os.getcwd()); "
        "print(len(qc.read('a.vtp').points), len(qc.read('b.glb').points))"
    )
    script = tmp_path.parent / f"{tmp_path.name}_script.py"
    script.write_text(code)
    command = {"-c": ["-c", code], "script": [str(script)]}[how]
    run = subprocess.run(
        [sys.executable, *command],
        env={**os.environ, "PYTHONPATH": f"{PACKAGE}{os.pathsep}{script.parent}"},
        capture_output=True,
        text=True,
    )
    assert run.stdout.split() == ["9", "8"], run.stderr
    assert not (tmp_path / "ran.txt").exists()


def test_pipes_devices_and_folders_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.ply")
    (tmp_path / "zero.obj").symlink_to("/dev/zero")
    (tmp_path / "folder.vtp").mkdir()
    (tmp_path / "loop.off").symlink_to("loop.off")
    for name in ("pipe.ply", "zero.obj"):
        with pytest.raises(MeshError, match=f"{name}: no regular file"):
            read(tmp_path / name)
    with pytest.raises(IsADirectoryError, match=r"folder\.vtp"):
        read(tmp_path / "folder.vtp")
    with pytest.raises(OSError, match=r"loop\.off"):
        read(tmp_path / "loop.off")
    with pytest.raises(MeshError, match="null"):
        read("a\0.obj")
    (tmp_path / "link.obj").symlink_to("real.obj")
    (tmp_path / "real.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert len(read(tmp_path / "link.obj").faces) == 1


# --------------------------------------------------------------------------- cells that are no polygons


def test_cells_of_other_dimensions_are_left_out_and_counted():
    types = [1, 3, 9, 23, 28, 22, 7, 8, 12, 36, 5]
    cells = [
        [0],
        [0, 1],
        [0, 1, 2, 3],
        [0, 1, 2, 3, 4, 5, 6, 7],
        [0, 1, 2, 3, 4, 5, 6, 7, 8],
        [0, 1, 2, 3, 4, 5],
        [0, 1, 2, 3, 4],
        [0, 1, 2, 3],
        list(range(8)),
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9],
        [3, 2, 1],
    ]
    found = faces_of_cells(np.array(types), np.array([len(c) for c in cells]), np.concatenate(cells))
    quad, triangle, pentagon = [0, 1, 2, 3], [0, 1, 2], [0, 1, 2, 3, 4]
    assert found.faces == [quad, quad, quad, triangle, pentagon, [0, 1, 3, 2], pentagon, [3, 2, 1]]
    assert found.notes == (
        "2 cells that are points and lines left out",
        "1 cells that are volumes left out",
        "4 faces with nodes on their sides taken by their corners",
    )
    with pytest.raises(MeshError, match="1 cells are no polygons, first cell 0 of VTK type 12"):
        faces_of_cells(np.array([12]), np.array([8]), np.arange(8))
    with pytest.raises(MeshError, match="1 cells are no polygons, first cell 1 of VTK type 99"):
        faces_of_cells(np.array([5, 99]), np.array([3, 3]), np.arange(6))
    with pytest.raises(MeshError, match="cells of 3 nodes are too small for their type"):
        faces_of_cells(np.array([9]), np.array([3]), np.arange(3))


def test_names_of_cells_of_meshio_and_its_kin():
    names = ["vertex", "line3", "triangle", "triangle7", "quad", "quad9", "polygon", "polygon5", "polygon2"]
    assert [type_of_name(n) for n in names] == [3, 3, 5, 22, 9, 23, 7, 7, 36]
    assert [type_of_name(n) for n in ("VTK_LAGRANGE_QUADRILATERAL", "hexahedron", "what")] == [23, 10, 10]


def test_lines_beside_polygons_are_left_out_and_counted(tmp_path, plane):
    both = pv.PolyData(plane.points, faces=plane.faces, lines=[2, 0, 1, 2, 1, 2])
    with pytest.warns(qc.MeshWarning, match="2 cells that are points and lines left out"):
        assert len(qc.as_mesh(both).faces) == 4
    both.save(tmp_path / "a.vtp")
    with pytest.warns(qc.MeshWarning, match="2 cells that are points and lines left out"):
        assert len(read(tmp_path / "a.vtp").faces) == 4


# ------------------------------------------------------------------------------------- scenes of parts


def test_parts_of_a_scene_are_joined_on_request(tmp_path):
    box, ball = trimesh.creation.box(), trimesh.creation.icosphere()
    moved = trimesh.transformations.translation_matrix([5, 0, 0])
    scene = trimesh.Scene([box])
    scene.add_geometry(ball, transform=moved)
    scene.export(tmp_path / "two.glb")
    with pytest.raises(MeshError, match=r"a Scene of 2 geometries, expected one; join=True"):
        read(tmp_path / "two.glb")
    mesh = read(tmp_path / "two.glb", join=True)
    assert len(mesh.points) == len(box.vertices) + len(ball.vertices)
    assert mesh.points[:, 0].max() == pytest.approx(6)
    assert mesh.stencils().closed.all()


def test_gltf_may_stand_in_several_files(tmp_path):
    ball = trimesh.creation.icosphere(subdivisions=5)
    for name, content in ball.export(file_type="gltf").items():
        (tmp_path / name).write_bytes(content)
    (path,) = tmp_path.glob("*.gltf")
    assert len(read(path).points) == len(ball.vertices)


def test_hidden_points_of_a_grid_are_its_mask(tmp_path):
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    data = pv.StructuredGrid(x, y, x * y)
    data.hide_points([7, 8])
    data.save(tmp_path / "a.vts")
    for grid in (read(tmp_path / "a.vts"), qc.as_mesh(data)):
        assert isinstance(grid, QuadGrid)
        assert np.argwhere(grid.mask).tolist() == [[2, 1], [3, 1]]


def test_values_of_a_grid_are_in_its_shape(tmp_path):
    x, y = np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij")
    data = pv.StructuredGrid(x, y, x * y)
    data["at"] = data.points.copy()
    data["z"] = data.points[:, 2].copy()
    data.save(tmp_path / "a.vts")
    values = read_values(tmp_path / "a.vts")
    np.testing.assert_array_equal(values["z"], x * y)
    np.testing.assert_array_equal(values["at"], read(tmp_path / "a.vts").points)


# ------------------------------------------------------------------------------------------- signals


def test_a_process_that_reads_leaves_no_other_behind(tmp_path, plane, monkeypatch):
    plane.save(tmp_path / "a.vtp")

    def interrupted(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(isolation, "_received", interrupted)
    with pytest.raises(KeyboardInterrupt):
        read(tmp_path / "a.vtp")
    with pytest.raises(ChildProcessError):
        os.waitpid(-1, os.WNOHANG)


def test_meshes_made_by_us_survive_every_format(tmp_path):
    points = np.pi * np.array(
        [[0, 0, 0], [1, 0, 0.1], [2, 0, 0], [0, 1, 0], [1, 1, 0.2], [2, 1, 0], [1, 2, 0.0]]
    )
    mesh = QuadMesh(points, [[0, 1, 2, 5, 4], [0, 4, 3], [3, 4, 5, 6]])
    H = np.where(np.arange(7) == 2, np.nan, np.arange(7) / 7)
    for suffix in ("vtp", "vtu", "vtk", "vtkhdf", "ply"):
        path = tmp_path / f"a.{suffix}"
        write(path, mesh, {"H": H, "n": points, "k": np.arange(7)})
        found, values = read(path), read_values(path)
        np.testing.assert_array_equal(found.points, points)
        np.testing.assert_array_equal(found.faces, mesh.faces)
        np.testing.assert_array_equal(found.face_source, mesh.face_source)
        np.testing.assert_array_equal(values["H"], H)
        np.testing.assert_array_equal(values["n"], points)
        np.testing.assert_array_equal(values["k"], np.arange(7))
        assert values["H"].dtype == np.float64
