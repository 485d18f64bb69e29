"""The floors of the house: imports point down, and heavy libraries wait until they are needed."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "quadcurv"
MODULES = sorted(PACKAGE.rglob("*.py"))
HEAVY = {"trimesh", "pymeshlab", "pyvista", "igl", "matplotlib", "vtk"}
# Floor of each module or package; none imports from a floor above its own.
FLOORS = [
    ["kernels", "mesh", "rates"],
    ["schemes", "boundary", "convert", "files", "interop"],
    ["curvature", "curves", "quality", "surfaces"],
    ["compare", "estimate"],
    ["fields", "figures", "page", "view", "plugin", "scene", "cli"],
]
FLOOR = {name: i for i, floor in enumerate(FLOORS) for name in floor}


def part(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def module_level_imports(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            names |= {f"{base}.{alias.name}" for alias in node.names} if base == "quadcurv" else {base}
    return names


def all_imports(path: Path) -> set[str]:
    tree = ast.parse(path.read_text())
    names = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    return names | {
        node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.level == 0
    }


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_point_down(path):
    here = part(path)
    if here == "__init__":
        return
    assert here in FLOOR, f"give {here} a floor in this test"
    for name in module_level_imports(path):
        if not name.startswith("quadcurv."):
            continue
        there = name.split(".")[1]
        assert there in FLOOR, f"{path}: {name}"
        assert FLOOR[there] <= FLOOR[here], f"{here} imports {there} from a floor above"
        if here == "kernels":
            assert there == "kernels", "a kernel knows no mesh"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_the_package_knows_nothing_of_scripts_and_tests(path):
    assert not {n.split(".")[0] for n in all_imports(path)} & {"comparisons", "tests", "examples"}


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_are_imported_inside_functions(path):
    if part(path) == "figures":  # the top floor, and itself imported inside functions
        return
    assert not {n.split(".")[0] for n in module_level_imports(path)} & HEAVY


def test_surfaces_are_independent_of_the_kernels():
    assert not any(
        n.startswith(("quadcurv.kernels", "quadcurv.schemes")) for n in all_imports(PACKAGE / "surfaces.py")
    )


def test_import_loads_nothing_heavy():
    code = "import sys, quadcurv; print(*sys.modules)"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in run.stdout.split()}
    assert not loaded & (HEAVY | {"numba"})
