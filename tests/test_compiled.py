"""Compiled code is kept where it can be, made again where it must be, and nothing hangs or fails over it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import quadcurv

# Half the vector areas of a square's corners, by a kernel whose formulas lie in two files.
PROGRAM = """
import logging, resource, signal, sys
import numpy as np
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="said %(name)s %(message)s")
from quadcurv.kernels import faces
square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
normal = np.zeros((4, 4))
{before}
faces.ring_normals(square, np.array([(0, 1, 2, 3)], np.int32), normal)
print(normal[:, 2].sum())
{after}
"""


class Copy:
    """A copy of the package without compiled files."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.kernels = folder, folder / "quadcurv" / "kernels"
        shutil.copytree(
            Path(quadcurv.__file__).parent, folder / "quadcurv", ignore=shutil.ignore_patterns("__pycache__")
        )

    def start(self, before: str = "", after: str = "", **environment: str) -> subprocess.Popen[str]:
        program = PROGRAM.format(before=before, after=after)
        environment = {"PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1", **environment}
        kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
        return subprocess.Popen(
            [sys.executable, "-c", program],
            env={**kept, **environment},
            cwd=self.folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run(self, *given: str, **environment: str) -> tuple[float, int]:
        """The result, and how often it was said that something is compiled."""
        return result_of(self.start(*given, **environment))

    def files(self) -> list[Path]:
        return sorted(self.folder.rglob("*.nbc"))


def result_of(process: subprocess.Popen[str]) -> tuple[float, int]:
    output, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    *said, result = output.split("\n")[:-1]
    assert all(line.startswith("said quadcurv compiling") for line in said)
    return float(result), len(said)


@pytest.fixture
def copy(tmp_path):
    return Copy(tmp_path)


def test_an_edit_to_a_helper_in_another_file_is_seen(copy):
    assert copy.run() == (1.0, 1)
    (kept,) = copy.files()
    assert copy.run() == (1.0, 0)
    source = copy.kernels / "vector.py"
    text = source.read_text()
    assert "a[0] * b[1] - a[1] * b[0]," in text
    source.write_text(text.replace("a[0] * b[1] - a[1] * b[0],", "5 * (a[0] * b[1] - a[1] * b[0]),"))
    assert copy.run() == (5.0, 1)
    assert len(copy.files()) == 1  # what was kept of the old files is gone
    assert copy.files() != [kept]
    assert copy.run() == (5.0, 0)


def test_several_kernels_are_announced_once(copy):
    other = "faces.quad_fluxes(square, np.array([(0, 1, 2, 3)], np.int32), np.zeros((4, 3)), np.zeros(4))"
    assert copy.run(other) == (1.0, 1)
    assert len(copy.files()) == 2


def test_the_folder_that_numba_is_told_is_used(copy):
    folder = copy.folder / "elsewhere"
    assert copy.run(NUMBA_CACHE_DIR=str(folder)) == (1.0, 1)
    assert copy.run(NUMBA_CACHE_DIR=str(folder)) == (1.0, 0)
    assert all(file.is_relative_to(folder) for file in copy.files())


def test_nothing_needs_to_be_writeable(copy):
    """Neither the package, nor a home, nor a folder for caches: files stand where folders would be made."""
    nowhere = copy.folder / "file"
    nowhere.write_text("")
    (copy.kernels / "__pycache__").write_text("")
    environment = dict.fromkeys(("HOME", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR"), str(nowhere))
    assert copy.run(**environment) == (1.0, 1)
    assert copy.run(**environment) == (1.0, 1)
    assert copy.files() == []


@pytest.mark.skipif(sys.platform == "win32", reason="no limit on the size of files")
def test_a_full_disk_costs_only_time(copy):
    full = "resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))"
    assert copy.run(full) == (1.0, 1)
    assert not [file for file in copy.folder.rglob("*") if file.suffix in (".nbc", ".tmp")]
    assert copy.run() == (1.0, 1)
    assert copy.run() == (1.0, 0)


@pytest.mark.parametrize(
    "damage",
    [
        lambda data: b"",
        lambda data: data[:10],
        lambda data: data[: len(data) // 2],
        lambda data: data[:-1],
        lambda data: data[:2000] + bytes([data[2000] ^ 1]) + data[2001:],
        lambda data: bytes(len(data)),
    ],
    ids=["empty", "head", "half", "last", "bit", "zeros"],
)
def test_damaged_files_are_as_good_as_missing(copy, damage):
    assert copy.run() == (1.0, 1)
    (file,) = copy.files()
    file.write_bytes(damage(file.read_bytes()))
    assert copy.run() == (1.0, 1)
    assert copy.run() == (1.0, 0)


def test_many_start_at_once_with_nothing_kept(copy):
    for process in [copy.start() for _ in range(6)]:
        assert result_of(process)[0] == 1.0
    assert copy.run() == (1.0, 0)
    assert len(copy.files()) == 1


FORK = """
import os, threading, time, numba
def compile_on():
    while True:
        numba.njit(lambda x: x + 1)(1)
threading.Thread(target=compile_on, daemon=True).start()
time.sleep(1)
child = os.fork()
if child == 0:
    signal.alarm(60)
    faces.ring_normals(square, np.array([(0, 1, 2, 3)], np.int32), normal)
    os._exit(0 if normal[:, 2].sum() == 1 else 1)
assert os.waitpid(child, 0)[1] == 0
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_fork_while_another_thread_compiles_does_not_hang(copy):
    assert copy.run(FORK, "sys.stdout.flush(); os._exit(0)")[0] == 1.0


def test_there_is_one_program_for_all_results_areas_and_arrays():
    """Whatever is wanted of whatever arrays: each kernel is compiled once."""
    program = """
import importlib, pkgutil
import numpy as np
import quadcurv as qc, quadcurv.kernels
points = np.random.default_rng(0).random((12, 13, 3))
faces = qc.QuadGrid(points).stencils().faces.astype(np.int64)
meshes = [
    lambda: qc.QuadGrid(points), lambda: qc.QuadGrid(np.asfortranarray(points)),
    lambda: qc.QuadGrid(points.astype(np.float32), (True, False)),
    lambda: qc.StaggeredGrid(points[1:11, 1:11], points[:11, :11]),
    lambda: qc.QuadMesh(points.reshape(-1, 3), faces),
    lambda: qc.QuadMesh(points.reshape(-1, 3), faces).reordered(),
]
verbs = [qc.mean_curvature, qc.mean_curvature_normal, qc.dual_areas, qc.stiffness_matrix]
for mesh in (make() for make in meshes):
    qc.vertex_normals(mesh)
    for scheme in ("finite_volume", "liu"):
        for verb in verbs:
            verb(mesh, scheme)
    qc.evaluate(mesh, "mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas", scheme="liu")
    qc.principal_curvatures(mesh, "jet")
programs = {}
for module in pkgutil.iter_modules(quadcurv.kernels.__path__):
    module = importlib.import_module(f"quadcurv.kernels.{module.name}")
    for name, kernel in vars(module).items():
        if hasattr(kernel, "overloads") and kernel.py_func.__module__ == module.__name__:
            programs[f"{module.__name__}.{name}"] = len(kernel.overloads)
print({name: count for name, count in programs.items() if count > 1})
print(sum(programs.values()))
"""
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    several, total = done.stdout.split("\n")[:2]
    assert several == "{}"
    assert int(total) > 15
