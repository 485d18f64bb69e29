"""The command line: what it prints, what it writes, and how it refuses."""

from __future__ import annotations

import csv
import json
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
    assert json.loads(out) == compare(ball, ["liu", "cotan-6"]).to_dict()
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
        valence = quadcurv.read(path).stencils().valence
    H = [row["mean_curvature"] for row in table(tmp_path / "out.csv")]
    assert out == [
        "faces: 2 quads, 4 triangles (1 larger polygon(s) cut into such); 1 turned",
        "vertices: 10, 1 of them where another one is",
        "valence: " + ", ".join(f"{v} ({(valence == v).sum()})" for v in np.unique(valence)),
        "rings: 1 interior, 0 extrapolated, 9 open",
        f"undefined: {H.count('nan')} by jet-2",
    ]
    assert run("compare", path, "-s", "liu", "--output", tmp_path) == 0
    assert capsys.readouterr().out.splitlines()[:4] == out[:4]


def test_curvature_as_csv(ball, tmp_path):
    assert run("curvature", ball, "-o", tmp_path / "out.csv") == 0
    mesh = quadcurv.read(ball)
    rows = table(tmp_path / "out.csv")
    for columns, expected in (
        (["x", "y", "z"], mesh.points),
        (["Normals_x", "Normals_y", "Normals_z"], quadcurv.vertex_normals(mesh)),
        (["mean_curvature"], quadcurv.mean_curvature(mesh, "finite_volume")[:, None]),
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


def test_view_without_a_display(ball, capsys, monkeypatch):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    assert "--html FILE writes a page instead" in refusal(capsys, "view", ball, "-s", "liu")


def test_reproduce_passes_options_on_and_the_exit_code_back(monkeypatch, tmp_path):
    (tmp_path / "comparisons").mkdir()
    for name, code in (
        ("__init__", ""),
        ("chapter1", "import sys; print(*sys.argv[1:])"),
        ("other", "exit(3)"),
    ):
        (tmp_path / "comparisons" / f"{name}.py").write_text(code)
    monkeypatch.setattr(cli, "_COMPARISONS", tmp_path / "comparisons")
    called = []
    real = subprocess.run

    def spy(command, **options):
        called.append(command)
        return real(command, **options)

    monkeypatch.setattr(subprocess, "run", spy)
    assert run("reproduce", "--quick", "--output", tmp_path) == 0
    assert called == [[sys.executable, "-m", "comparisons.chapter1", "--quick", "--output", str(tmp_path)]]
    assert run("reproduce", "other") == 3


def test_reproduce_knows_the_chapters():
    known = {p.stem for p in cli._COMPARISONS.glob("chapter*.py")}
    assert "chapter4" in known


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["compare"], "requires an argument"),
        (["compare", "nosuch.obj"], r"nosuch\.obj: No such file or directory"),
        (["compare", "{folder}"], "Is a directory"),
        (["compare", "{ball}", "-s", "mean"], "scheme: expected one of finite_volume, liu, .*, got 'mean'"),
        (["compare", "{ball}", "-s", "liu", "-s", "liu"], "schemes: expected at least one, each once"),
        (["compare", "{ball}", "--colour"], "Unknown option"),
        (["compare", "{broken}"], r"broken\.obj: line 1: 'v a b c' is not OBJ"),
        (["compare", "{far}"], "faces: .*out of range|far.obj"),
        (["compare", "notes.txt"], r"notes\.txt: cannot read \.txt"),
        (["curvature", "{ball}"], "--output"),
        (["curvature", "{ball}", "-o", "out.xyz"], r"cannot write \.xyz"),
        (["curvature", "{ball}", "-o", "{folder}/no/out.csv"], "No such file or directory"),
        (["view", "klein_bottle", "--html", "page.html"], "neither a file nor a surface, .*torus"),
        (
            ["view", "torus", "--field", "colour", "--html", "page.html"],
            "field: expected one of mean_curvature",
        ),
        (["view", "torus", "--png", "page.html.jpg"], r"expected a name ending in \.png or \.html"),
        (["reproduce", "chapter9"], "expected any of .*chapter4.*, got 'chapter9'"),
        (["render"], "Unknown command"),
    ],
)
def test_refusals_take_one_line(arguments, message, ball, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.obj").write_text("v a b c\n")
    (tmp_path / "far.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n")
    (tmp_path / "notes.txt").touch()
    paths = {"ball": ball, "folder": tmp_path, "broken": tmp_path / "broken.obj", "far": tmp_path / "far.obj"}
    line = refusal(capsys, *(a.format(**paths) for a in arguments))
    assert re.search(message, line), line
    assert "Traceback" not in line


def test_an_installed_package_without_scripts_says_so(capsys, monkeypatch, tmp_path):
    monkeypatch.setattr(cli, "_COMPARISONS", tmp_path / "comparisons")
    assert "not part of the installed package" in refusal(capsys, "reproduce")


def test_warnings_take_one_line(shared_meshes, capsys):
    assert run("compare", shared_meshes / "moebius.obj", "-s", "liu", "--json") == 0
    error = capsys.readouterr().err
    assert error.startswith("quadcurv: warning: the mesh is non-orientable")
    assert error.count("\n") == 1


@pytest.mark.parametrize("command", [[], ["compare"], ["curvature"], ["view"], ["reproduce"]])
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
    assert all(name in script for name in ("compare", "curvature", "view", "reproduce", "--scheme"))


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
