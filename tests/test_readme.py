"""What the README says, run as written."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import trimesh

from quadcurv import surfaces

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def command(name: str) -> str:
    return re.search(rf"<!-- command: {name} -->\n```bash\n(.*?)```", README, re.DOTALL)[1]


@pytest.fixture
def example(tmp_path, monkeypatch):
    """A folder with the files, and the variables, that the README's examples speak of."""
    monkeypatch.chdir(tmp_path)
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.points.tolist()]
    lines += ["f " + " ".join(str(i + 1) for i in face) for face in mesh.faces.tolist()]
    Path("mesh.obj").write_text("\n".join(lines))
    return {
        "points": mesh.points,
        "faces": mesh.faces,
        "a_trimesh": trimesh.Trimesh(mesh.points, mesh.faces, process=False),
        "X": surfaces.cylinder().sample((12, 9))[0].points,
    }


def test_python_example(example, capsys):
    code = re.search(r"```python\n(.*?)```", README, re.DOTALL)[1]
    exec(code, example)
    assert example["H"].shape == (98,)
    assert np.median(example["H"]) == pytest.approx(1, abs=0.1)
    assert example["Hn"].shape == (12, 10, 3)
    assert "finite_volume" in capsys.readouterr().out


def test_compare_command(example):
    line = re.search(r"^\.venv/bin/(quadcurv compare mesh\.obj)$", README, re.MULTILINE)[1]
    tool = Path(sys.executable).parent / "quadcurv"
    run = subprocess.run([tool, *line.split()[1:]], capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    assert "finite_volume" in run.stdout


def test_own_file_in_three_commands(example):
    """The last of them as written; all three, in a clone, below."""
    lines = command("own").splitlines()
    assert len(lines) == 3
    tool = Path(sys.executable).parent / "quadcurv"
    words = lines[2].removeprefix(".venv/bin/quadcurv ").split()
    run = subprocess.run([tool, *words], capture_output=True, text=True, timeout=300, check=False)
    assert run.returncode == 0, run.stderr
    assert Path("map.html").read_text()[:15].lower() == "<!doctype html>"


def test_names_exist():
    """There are no links, which would not hold on an index page, but for the picture."""
    assert re.findall(r"\]\(([^)]+)\)", README) == ["examples/readme.png"]
    for target in re.findall(r"`((?:comparisons|examples)/[\w./]+\.\w+|[A-Z]+\.\w+)`", README):
        assert (ROOT / target).exists(), target
    for module in re.findall(r"-m (comparisons\.\w+)", README):
        place = ROOT / module.replace(".", "/")
        assert place.is_dir() or place.with_suffix(".py").exists(), module


def test_extras_exist():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]
    assert set(re.findall(r'"\.\[(\w+)\]"', README)) <= set(declared)


def test_ci_runs_the_readme_test_command():
    script = (ROOT / ".ci" / "run").read_text()
    assert "readme_command test" in script
    assert command("test").startswith("python3 -m venv .venv && ")


@pytest.mark.slow
def test_main_command_in_a_clean_clone(tmp_path):
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
    run = subprocess.run(
        ["bash", "-c", command("main")], cwd=clone, capture_output=True, text=True, timeout=1200, check=False
    )
    assert run.returncode == 0, run.stderr
    assert (clone / "comparisons" / "output" / "figure_4_4.png").exists()
    assert (clone / "comparisons" / "output" / "pillow_error_maps.html").exists()
    assert "reproduced" in run.stdout


@pytest.mark.slow
def test_own_file_in_a_clean_clone(example, tmp_path):
    clone = tmp_path / "clone"
    subprocess.run(["git", "clone", "--quiet", ROOT, clone], check=True)
    (clone / "mesh.obj").write_bytes(Path("mesh.obj").read_bytes())
    script = "set -e\n" + command("own")
    run = subprocess.run(
        ["bash", "-c", script], cwd=clone, capture_output=True, text=True, timeout=1200, check=False
    )
    assert run.returncode == 0, run.stderr
    assert (clone / "map.html").stat().st_size > 10_000
