"""The command line: what it prints, what it writes, and how it refuses."""

from __future__ import annotations

import csv
import json
import logging
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import pyvista
import trimesh

import quadcurv
from quadcurv import cli, surfaces
from quadcurv.cli import commands
from quadcurv.cli.values import VALUES
from quadcurv.comparison import compare
from quadcurv.viewing import opengl_problem


@pytest.fixture
def ball(tmp_path):
    """File of a sphere of quads in eight corners of valence 3."""
    mesh = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    path = tmp_path / "ball.obj"
    quadcurv.io.write(path, mesh)
    return path


def run(*arguments):
    """Exit code of the command line."""
    try:
        cli.main([str(a) for a in arguments])
    except SystemExit as end:
        return end.code or 0
    return 0


def table(path):
    with path.open() as file:
        return list(csv.DictReader(file))


def refusal(capsys, *arguments):
    """The one line that a refused call leaves behind."""
    assert run(*arguments) == 2
    out, error = capsys.readouterr()
    assert out == ""
    assert error.startswith("quadcurv: ")
    assert error.count("\n") == 1
    return error.removeprefix("quadcurv: ").strip()


def test_compare_prints_tables_of_80_columns_and_saves_pictures(ball, tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert run("compare", ball, "--output", tmp_path / "maps") == 0
    out, error = capsys.readouterr()
    assert all(name in out for name in quadcurv.SCHEMES)
    assert "…" not in out
    assert max(map(len, out.splitlines())) <= 80
    suffix = "html" if opengl_problem() else "png"
    written = sorted(p.name for p in (tmp_path / "maps").iterdir())
    assert written == [f"ball_disagreement.{suffix}", f"ball_mean_curvature.{suffix}"]
    assert all(name in error for name in written)


def test_compare_of_chosen_schemes_as_json(ball, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert run("compare", ball, "-s", "liu", "--scheme", "cotan-6", "--json") == 0
    out, error = capsys.readouterr()
    found = json.loads(out)
    assert found.pop("mesh") == "nothing mended"
    assert found == compare(ball, ["liu", "cotan-6"]).to_dict()
    assert error == ""
    assert [p.name for p in tmp_path.iterdir()] == ["ball.obj"]  # scripts get no pictures


def test_compare_writes_csv(ball, tmp_path):
    assert run("compare", ball, "-s", "liu", "-s", "jet", "--json", "--csv", tmp_path / "norms.csv") == 0
    rows = table(tmp_path / "norms.csv")
    assert {(r["scheme"], r["valence"]) for r in rows} == {
        (s, v) for s in ("liu", "jet") for v in ("all", "3", "4")
    }


@pytest.mark.parametrize("suffix", [".ply", ".vtp"])
def test_curvature_is_written_beside_the_mesh(ball, tmp_path, suffix):
    path = tmp_path / f"out{suffix}"
    assert run("curvature", ball, "-o", path, "-s", "liu") == 0
    mesh = quadcurv.read(ball)
    assert np.array_equal(quadcurv.read(path).faces, mesh.faces)
    if suffix == ".ply":
        raw = trimesh.load(path, process=False).metadata["_ply_raw"]
        found, names = raw["vertex"]["data"]["mean_curvature"].ravel(), raw["vertex"]["data"].dtype.names
    else:
        data = pyvista.read(path).point_data
        found, names = data["mean_curvature"], data.keys()
    assert np.array_equal(found, quadcurv.mean_curvature(mesh, "liu"))
    assert {"valence", "skew", "aspect", "nonplanarity"} <= set(names)


def test_counts_of_a_mesh_are_printed(tmp_path, capsys):
    """A pentagon, a triangle, two quads, one face the wrong way round, and an isolated vertex."""
    points = [(x, y, x * y) for y in range(3) for x in range(3)]
    faces = [(0, 1, 4, 3), (1, 4, 5, 2), (3, 4, 6), (5, 8, 7, 6, 4)]
    path = tmp_path / "mixed.off"
    rows = [(len(points) + 1, len(faces), 0), *points, (0, 0, 0), *((len(face), *face) for face in faces)]
    path.write_text("OFF\n" + "\n".join(" ".join(map(str, row)) for row in rows))
    assert run("curvature", path, "-o", tmp_path / "out.csv", "-s", "jet-2") == 0
    out = capsys.readouterr().out.splitlines()
    with pytest.warns(quadcurv.MeshWarning, match="turned"):
        mesh = quadcurv.read(path)
    valence = mesh.stencils().valence
    assert "1 face(s) turned" in str(mesh.report)
    H = [row["mean_curvature"] for row in table(tmp_path / "out.csv")]
    assert out == [
        f"QuadMesh(10 points, 2 quads, 4 triangles): {mesh.report}",
        "faces: 2 quads, 4 triangles (1 larger polygon(s) cut into such); 1 turned",
        "vertices: 10, 1 of them where another one is",
        "valence: " + ", ".join(f"{v} ({(valence == v).sum()})" for v in np.unique(valence)),
        "rings: 1 interior, 0 extrapolated, 1 fitted, 8 open",
        f"undefined: {H.count('nan')} of mean_curvature",
    ]
    assert run("compare", path, "-s", "liu", "--output", tmp_path) == 0
    assert capsys.readouterr().out.splitlines()[:5] == out[:5]


def test_curvature_as_csv(ball, tmp_path):
    assert run("curvature", ball, "-o", tmp_path / "out.csv") == 0
    mesh = quadcurv.read(ball)
    rows = table(tmp_path / "out.csv")
    for columns, expected in (
        (["x", "y", "z"], mesh.points),
        (["normal_x", "normal_y", "normal_z"], quadcurv.curvatures(mesh).normal),
        (["mean_curvature"], quadcurv.mean_curvature(mesh, "jet")[:, None]),
        (["valence"], mesh.stencils().valence[:, None]),
    ):
        assert np.array_equal([[float(row[c]) for c in columns] for row in rows], expected)


@pytest.mark.parametrize("name", ["torus", "cubed_sphere"])
def test_view_of_a_surface_shows_exact_errors(name, tmp_path):
    page = tmp_path / "page.html"
    assert run("view", name, "-s", "liu", "--field", "error", "--html", page) == 0
    assert "H \\u2212 exact" in page.read_text()


@pytest.mark.skipif(opengl_problem() is not None, reason=f"cannot render: {opengl_problem()}")
def test_view_as_a_picture(ball, tmp_path):
    from PIL import Image

    assert run("view", ball, "-s", "liu", "-s", "jet", "--png", tmp_path / "map.png") == 0
    with Image.open(tmp_path / "map.png") as image:
        assert image.width > image.height > 300
    style = ["--size", "640", "480", "--camera", "0", "0", "1", "--range", "0", "2", "--colours", "magma"]
    arguments = ["view", ball, *style, "--title", "Ball", "--shading", "-s", "liu", "--png"]
    assert run(*arguments, tmp_path / "styled.png") == 0
    with Image.open(tmp_path / "styled.png") as image:
        assert image.size == (640, 480)


def test_view_without_a_display(ball, capsys, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    assert "--html FILE writes a page instead" in refusal(capsys, "view", ball, "-s", "liu")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["compare"], "requires an argument"),
        (["compare", "nosuch.obj"], r"nosuch\.obj: No such file or directory"),
        (["compare", "{folder}/folder.obj"], "folder.obj: Is a directory"),
        (["compare", "{ball}", "-s", "mean"], "scheme: expected one of finite_volume, liu, .*, got 'mean'"),
        (["compare", "{ball}", "-s", "liu", "-s", "liu"], "--scheme: expected each once, got liu, liu"),
        (["compare", "{ball}", "--colour"], "Unknown option"),
        (["compare", "{broken}"], r"broken\.obj: line 1: 'v a b c' is not OBJ"),
        (["compare", "{far}"], "faces: .*out of range|far.obj"),
        (["compare", "notes.txt"], r"notes\.txt: cannot read \.txt"),
        (["curvature", "{ball}"], "--output"),
        (["curvature", "{ball}", "-o", "out.xyz"], r"cannot write \.xyz"),
        (["curvature", "{ball}", "-o", "{folder}/no/out.csv"], "--output: there is no folder .*no$"),
        (["view", "klein_bottle", "--html", "page.html"], "neither a file nor a surface, .*torus"),
        (
            ["view", "torus", "--field", "colour", "--html", "page.html"],
            "field: expected one of mean_curvature",
        ),
        (["view", "torus", "--png", "page.html.jpg"], r"--png: cannot write \.jpg; there are \.png"),
        (["view", "torus", "--merge", "--html", "page.html"], "a surface is sampled; --merge"),
        (["compare", "{scene}", "--no-join"], "a scene of 2 shapes, which --join joins"),
        (["compare", "{ball}", "--wrap", "rows"], "wrap: only a StructuredGrid has directions to wrap"),
        # What is wrong with an option is said before a file is opened.
        (["compare", "nosuch.obj", "--merge", "-1"], "--merge: expected a length, got -1"),
        (["compare", "nosuch.obj", "--merge", "nan"], "--merge: expected a length, got nan"),
        (["compare", "nosuch.obj", "--boundary", "mirror"], "mirror.*boundary.*extrapolate"),
        (["compare", "nosuch.obj", "--camera", "0", "0", "0"], "camera: expected a direction"),
        (["compare", "nosuch.obj", "--camera", "1", "0"], "--camera"),
        (["compare", "nosuch.obj", "--size", "20", "20"], "size: expected whole numbers of pixels"),
        (["compare", "nosuch.obj", "--colours", "plaid"], "colours: matplotlib has no map .plaid"),
        (["compare", "nosuch.obj", "--csv", "{folder}"], "--csv: .* is a folder"),
        (["compare", "nosuch.obj", "-o", "notes.txt"], "--output: notes.txt is no folder"),
        (["compare", "nosuch.obj", "-s", "mean"], "scheme: expected one of"),
        (
            ["curvature", "nosuch.obj", "-o", "out.obj"],
            r"--output: cannot write \.obj; there are \.csv, .*\.ply",
        ),
        (["curvature", "nosuch.obj", "-o", "out.ply", "-v", "torsion"], "value.*torsion"),
        (["curvature", "nosuch.obj", "-o", "out.ply", "-v", "estimate"], "--value: jet has no estimate"),
        (
            ["curvature", "nosuch.obj", "-o", "a.ply", "-s", "jet-2", "-v", "interval_k1"],
            "--value: jet-2 has no interval_k1",
        ),
        (
            ["view", "nosuch.obj", "--html", "a.html", "--field", "error", "-s", "jet"],
            "field: expected one of mean_curvature, gaussian_curvature, .*, got 'error'",
        ),
        (
            ["view", "nosuch.obj", "--html", "a.html", "--field", "difference to liu", "-s", "jet"],
            "field: .*",
        ),
        (["view", "nosuch.obj", "--html", "a.html", "--range", "2", "1"], "limits: expected low < high"),
        (["view", "nosuch.obj", "--html", "a.html", "--title", "a\nb"], "title: expected one line"),
        (["render"], "Unknown command"),
    ],
)
def test_refusals_take_one_line(arguments, message, ball, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.obj").write_text("v a b c\n")
    (tmp_path / "far.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n")
    (tmp_path / "notes.txt").touch()
    (tmp_path / "folder.obj").mkdir()
    trimesh.Scene([trimesh.creation.box(), trimesh.creation.icosphere()]).export(tmp_path / "scene.glb")
    paths = {
        "scene": tmp_path / "scene.glb",
        "ball": ball,
        "folder": tmp_path,
        "broken": tmp_path / "broken.obj",
        "far": tmp_path / "far.obj",
    }
    line = refusal(capsys, *(a.format(**paths) for a in arguments))
    assert re.search(message, line), line
    assert "Traceback" not in line


@pytest.fixture
def tube(tmp_path):
    """File of a tube whose vertices come once a cell, and the number of places they lie at."""
    grid = surfaces.cylinder().sample((8, 24))[0]
    mesh = grid.to_mesh()
    soup = mesh.points[mesh.faces].reshape(-1, 3)
    cells = np.insert(np.arange(len(soup)).reshape(-1, 4), 0, 4, axis=1)
    path = tmp_path / "tube.vtu"
    pyvista.UnstructuredGrid(cells.ravel(), np.full(len(cells), 9, np.uint8), soup).save(path)
    return path, len(mesh.points)


@pytest.mark.parametrize("merge", [[], ["--merge"], ["--merge", "1e-6"]])
def test_seams_are_merged_and_told_of(tube, merge, capsys):
    path, n = tube
    assert run("compare", *merge, path, "-s", "liu", "--json") == 0
    out, error = capsys.readouterr()
    assert json.loads(out)["vertices"] == n
    assert json.loads(out)["undefined"] == {"liu": 0}
    assert re.match(r"quadcurv: \d+ vertices merged with others at the same place, to (1|6.3)e-06", error)
    assert ("--no-merge keeps them apart" in error) == (not merge)
    assert error.count("\n") == 1


def test_seams_that_are_to_stay(tube, capsys):
    path, n = tube
    assert run("compare", path, "--no-merge", "-s", "liu", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert found["vertices"] == found["undefined"]["liu"] > 3 * n


def test_values_go_to_the_vertices_of_the_file(tube, tmp_path):
    path, _ = tube
    assert run("curvature", path, "-o", tmp_path / "out.csv", "-s", "liu", "-v", "mean_curvature") == 0
    rows = table(tmp_path / "out.csv")
    assert list(rows[0]) == ["x", "y", "z", "mean_curvature"]
    points = pyvista.read(path).points
    assert np.array_equal([[float(row[c]) for c in "xyz"] for row in rows], points)
    assert [float(row["mean_curvature"]) for row in rows] == pytest.approx([0.5] * len(points), abs=0.01)


def test_merge_takes_a_length(tmp_path, capsys):
    """Two squares, a gap of 0.01 between them."""
    path = tmp_path / "gap.off"
    corners = [(x, y, 0) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1), (1.01, 0), (2, 0), (2, 1), (1.01, 1))]
    rows = [(8, 2, 0), *corners, (4, 0, 1, 2, 3), (4, 4, 5, 6, 7)]
    path.write_text("OFF\n" + "\n".join(" ".join(map(str, row)) for row in rows))
    for merge, n in ((["--merge", "0.02"], 6), (["--merge"], 8), ([], 8)):
        assert run("compare", path, *merge, "-s", "jet", "--json") == 0
        assert json.loads(capsys.readouterr().out)["vertices"] == n


def test_scenes_are_joined(tmp_path, capsys):
    box, ball = trimesh.creation.box(), trimesh.creation.icosphere()
    scene = trimesh.Scene([box, ball])
    scene.add_geometry(box, transform=trimesh.transformations.translation_matrix([9, 0, 0]))
    scene.export(tmp_path / "scene.glb")
    assert run("compare", tmp_path / "scene.glb", "-s", "liu", "--json") == 0
    out, error = capsys.readouterr()
    assert json.loads(out)["vertices"] == 2 * len(box.vertices) + len(ball.vertices)
    assert "scene.glb: 3 shapes joined" in error
    assert run("curvature", tmp_path / "scene.glb", "--join", "-o", tmp_path / "out.csv") == 0
    assert max(float(row["x"]) for row in table(tmp_path / "out.csv")) == pytest.approx(9.5)


def test_grids_are_closed_where_they_meet(tmp_path, capsys):
    grid = surfaces.cylinder().sample((8, 24))[0]
    quadcurv.to_pyvista(grid).save(tmp_path / "tube.vts")
    closed = "rows" if grid.wrap[0] else "columns"
    for wrap, said in (([], "closed there; --no-merge keeps it open"), (["--wrap", closed], "")):
        assert run("curvature", tmp_path / "tube.vts", *wrap, "-o", tmp_path / "out.csv", "-s", "liu") == 0
        out, error = capsys.readouterr()
        assert said in error
        assert "wrap=(" in out.splitlines()[0]
        rows = table(tmp_path / "out.csv")
        assert [float(row["mean_curvature"]) for row in rows] == pytest.approx([0.5] * len(rows), abs=0.01)
    assert (
        run("compare", tmp_path / "tube.vts", "--no-merge", "--boundary", "nan", "-s", "liu", "--json") == 0
    )
    assert json.loads(capsys.readouterr().out)["undefined"]["liu"] == 2 * (9 + 24) - 2


def test_arrays_of_points_are_grids(tmp_path, capsys):
    grid = surfaces.torus().sample((24, 16))[0]
    path, out = tmp_path / "grid.npy", tmp_path / "H.csv"
    np.save(path, grid.points)
    assert run("curvature", path, "--wrap", "both", "-o", out, "-s", "liu") == 0
    H = np.genfromtxt(out, delimiter=",", names=True)["mean_curvature"]
    np.testing.assert_allclose(H, quadcurv.mean_curvature(grid, "liu").ravel(), rtol=1e-12)
    np.save(path, np.pad(grid.points, ((0, 1), (0, 1), (0, 0)), mode="wrap"))
    capsys.readouterr()
    assert run("view", path, "-s", "jet", "--html", tmp_path / "map.html") == 0
    assert "closed there" in capsys.readouterr().err
    np.save(path, np.zeros((3, 4)))
    page = tmp_path / "map.html"
    assert "points: shape (3, 4), expected (r, c, 3)" in refusal(capsys, "view", path, "--html", page)


def test_without_a_command_help_is_shown(capsys):
    assert run() == 0
    assert "Usage: quadcurv COMMAND" in capsys.readouterr().out


def test_closed_parts_are_oriented(tmp_path, capsys):
    mesh = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    path = tmp_path / "inside_out.obj"
    quadcurv.write(path, quadcurv.QuadMesh(mesh.points, mesh.faces[:, ::-1]))
    for options, sign in (([], -1), (["--orient"], 1)):
        assert run("curvature", path, *options, "-o", tmp_path / "out.vtp", "-s", "liu") == 0
        H = quadcurv.read_values(tmp_path / "out.vtp")["mean_curvature"]
        assert (sign * H > 0.9).all()
        assert ("inside out" in capsys.readouterr().out) == (sign < 0)


def test_all_values_are_written_and_read_back(ball, tmp_path):
    assert run("curvature", ball, "-o", tmp_path / "out.vtp") == 0
    found, mesh = quadcurv.read_values(tmp_path / "out.vtp"), quadcurv.read(ball)
    assert set(found) == set(VALUES) - {"estimate"}
    fit = quadcurv.curvatures(mesh)
    for name, expected in (
        ("mean_curvature", fit.mean),
        ("gaussian_curvature", fit.gaussian),
        ("k1", fit.k1),
        ("direction2", fit.direction2),
        ("error_gaussian_curvature", fit.standard_error.gaussian),
        ("interval_k1", fit.interval.k1),
        ("interval_gaussian_curvature", fit.interval.gaussian),
        ("feature", fit.feature),
        ("normal", fit.normal),
    ):
        assert np.array_equal(found[name], expected)
    assert found["shape_index"] == pytest.approx(1, abs=0.05)
    assert found["curvedness"] == pytest.approx(1, abs=0.05)


def test_values_depend_on_what_the_scheme_knows(ball, tmp_path):
    H = quadcurv.mean_curvature(ball, "liu")
    assert run("curvature", ball, "-o", tmp_path / "liu.vtp", "-s", "liu") == 0
    found = quadcurv.read_values(tmp_path / "liu.vtp")
    assert set(found) == set(VALUES)
    np.testing.assert_allclose(found["estimate"], H - quadcurv.mean_curvature(ball, "jet"), atol=1e-14)
    assert run("curvature", ball, "-o", tmp_path / "jet-2.vtp", "-s", "jet-2") == 0
    found = quadcurv.read_values(tmp_path / "jet-2.vtp")
    assert not {name for name in found if name.startswith("interval")}
    assert "feature" not in found
    assert np.abs(found["estimate"]).max() > 1e-6


@pytest.mark.parametrize(
    ("k1", "k2", "index", "curvedness"),
    [(2, 2, 1, 2), (1, 0, 0.5, 0.5**0.5), (3, -3, 0, 3), (0, -1, -0.5, 0.5**0.5), (-1, -1, -1, 1)],
)
def test_shape_index_and_curvedness(k1, k2, index, curvedness):
    of_one = [np.array([0.0])] * 2 + [np.array([float(k)]) for k in (k1, k2)] + [np.zeros((1, 3))] * 3
    found = quadcurv.Curvatures(*of_one)
    assert found.shape_index == pytest.approx([index])
    assert found.curvedness == pytest.approx([curvedness])
    flat = quadcurv.Curvatures(*[np.zeros(1)] * 4, *[np.zeros((1, 3))] * 3)
    assert np.isnan(flat.shape_index[0])
    assert flat.curvedness == [0]


def test_what_the_package_logs_is_said(ball, capsys, monkeypatch):
    def slow(*arguments):
        logging.getLogger("quadcurv.kernels").info("compiling for the first time")
        return real(*arguments)

    real = commands.load
    monkeypatch.setattr(commands, "load", slow)
    assert run("compare", ball, "-s", "liu", "--json") == 0
    assert capsys.readouterr().err == "quadcurv: compiling for the first time\n"
    assert not logging.getLogger("quadcurv").handlers


def test_a_large_page_says_so_first(ball, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("quadcurv.viewing.page.LIMIT", 100_000)
    assert run("view", ball, "--html", tmp_path / "page.html") == 0
    said = capsys.readouterr().err.splitlines()
    assert said[0].startswith("quadcurv: warning: a page with all fields of 218 vertices")
    assert "--thin, shows all on fewer vertices" in said[0]
    assert said[-1] == f"quadcurv: {tmp_path / 'page.html'}"
    assert run("view", ball, "--thin", "--html", tmp_path / "thin.html") == 0
    assert capsys.readouterr().err.splitlines() == [f"quadcurv: {tmp_path / 'thin.html'}"]


def test_warnings_take_one_line(shared_meshes, capsys):
    assert run("compare", shared_meshes / "moebius.obj", "-s", "liu", "--json") == 0
    error = capsys.readouterr().err
    assert error.startswith("quadcurv: warning: the mesh is non-orientable")
    assert error.count("\n") == 1


@pytest.mark.parametrize("command", [[], ["compare"], ["curvature"], ["view"]])
def test_help_has_examples(command, capsys):
    assert run(*command, "--help") == 0
    out = capsys.readouterr().out
    assert "Usage: quadcurv" in out
    if command:
        assert f"quadcurv {command[0]}" in out.split("Examples")[1]


def test_version(capsys):
    assert run("--version") == 0
    assert capsys.readouterr().out.strip() == quadcurv.__version__


def test_completion_names_the_commands():
    script = cli.app.generate_completion(shell="bash")
    assert all(name in script for name in ("compare", "curvature", "view", "--scheme", "--merge"))


def test_as_a_program_without_opengl(ball, tmp_path):
    """The whole way, as on a machine with neither OpenGL nor a display: pages instead of pictures."""
    if sys.platform != "linux":
        pytest.skip("libraries are hidden the way of Linux")
    folder = tmp_path / "empty_libraries"
    folder.mkdir()
    for name in ("GL", "GLX", "EGL", "OpenGL", "OSMesa"):
        for version in ("", ".0", ".1", ".8"):
            (folder / f"lib{name}.so{version}").touch()
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"} | {"LD_LIBRARY_PATH": str(folder)}
    program = Path(sys.executable).with_name("quadcurv")
    done = subprocess.run(
        [program, "compare", ball, "-s", "liu", "-s", "jet"],
        cwd=tmp_path,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0
    assert "writing pages instead of pictures" in done.stderr
    assert "Traceback" not in done.stderr
    assert {p.suffix for p in (tmp_path / "quadcurv-output").iterdir()} == {".html"}


def test_a_reader_that_has_seen_enough(ball):
    program = Path(sys.executable).with_name("quadcurv")
    with subprocess.Popen(
        [program, "compare", ball, "--json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as child:
        child.stdout.close()
        assert "Traceback" not in child.stderr.read()


def test_no_code_of_the_current_folder_is_run(ball, tmp_path):
    """Files named as libraries lie beside the mesh."""
    for name in ("pyvista", "matplotlib", "numpy", "trimesh", "vtkmodules", "scipy"):
        (tmp_path / f"{name}.py").write_text("open('was_run', 'w').close()")
    program = Path(sys.executable).with_name("quadcurv")
    done = subprocess.run(
        [program, "compare", ball, "-s", "liu"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert not (tmp_path / "was_run").exists()
    assert (tmp_path / "quadcurv-output").is_dir()


def test_as_a_module(tmp_path):
    done = subprocess.run(
        [sys.executable, "-m", "quadcurv", "--version"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == quadcurv.__version__
