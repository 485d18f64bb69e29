"""The floors of the house: every import points down, lazy ones too, and heavy libraries wait."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import quadcurv as qc

PACKAGE = Path(__file__).parents[1] / "quadcurv"
MODULES = sorted(PACKAGE.rglob("*.py"))
HEAVY = {"trimesh", "pymeshlab", "pyvista", "igl", "matplotlib", "vtk", "vtkmodules", "meshlane", "pandas"}
# Rooms (a module or a package) from the lowest floor up: a room imports from lower floors, or within itself.
FLOORS = [
    ["extras", "html", "types"],
    ["device_arrays"],
    ["kernels", "ragged"],
    ["coincidence", "polygons", "stencils"],
    ["checks"],
    ["hanging"],
    ["connectivity"],
    ["mesh"],
    ["boundary", "io", "precision"],
    ["repair", "schemes"],
    ["drivers"],
    ["curvature", "mesh_quality", "operators"],
    ["curves", "estimate", "surfaces", "tables"],
    ["comparison"],
    ["refinement"],
    ["viewing"],
    ["paraview_plugin", "pyvista_plugin", "cli"],
    ["__main__"],
]
FLOOR = {room: i for i, floor in enumerate(FLOORS) for room in floor}


def room(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def imports(path: Path, everywhere: bool = True) -> set[str]:
    """Full names of what a file imports, at its top or everywhere, but for type checkers alone."""
    tree = ast.parse(path.read_text())
    names: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            return
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            base = node.module or ""
            names.update(f"{base}.{alias.name}" if base == "quadcurv" else base for alias in node.names)
        if everywhere or not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            for child in ast.iter_child_nodes(node):
                visit(child)

    visit(tree)
    return names


def named(path: Path) -> str:
    return str(path.relative_to(PACKAGE))


@pytest.mark.parametrize("path", MODULES, ids=named)
def test_imports_point_down(path):
    here = room(path)
    if here == "__init__":
        return
    assert here in FLOOR, f"give {here} a floor in this test"
    for name in imports(path):
        if not name.startswith("quadcurv."):
            continue
        there = name.split(".")[1]
        assert there in FLOOR, f"{path}: {name} is no room"
        assert there == here or FLOOR[there] < FLOOR[here], f"{here} imports {there}, which is no floor below"


def test_floors_list_no_room_that_is_not_there():
    rooms = {room(path) for path in MODULES} - {"__init__"}
    assert set(FLOOR) <= rooms | {"__main__"}


@pytest.mark.parametrize("path", sorted((PACKAGE / "kernels").glob("*.py")), ids=named)
def test_kernels_know_numba_and_numpy_alone(path):
    ours = {"quadcurv.kernels", "quadcurv.types"}
    for name in imports(path):
        if name.startswith("quadcurv"):
            assert any(name == o or name.startswith(o + ".") for o in ours), f"{path}: {name}"
        else:
            root = name.split(".")[0]
            assert root in {"numba", "numpy", "llvmlite"} or root in sys.stdlib_module_names, (
                f"{path}: {name}"
            )


@pytest.mark.parametrize("path", MODULES, ids=named)
def test_the_package_knows_nothing_of_scripts_and_tests(path):
    assert not {n.split(".")[0] for n in imports(path)} & {"comparisons", "tests", "examples"}


@pytest.mark.parametrize("path", MODULES, ids=named)
def test_heavy_libraries_are_imported_inside_functions(path):
    if room(path) in ("viewing", "paraview_plugin"):  # imported when something is to be looked at
        return
    assert not {n.split(".")[0] for n in imports(path, everywhere=False)} & HEAVY


def test_exact_curvature_knows_no_operator():
    for path in (PACKAGE / "surfaces").glob("*.py"):
        assert not any(
            n.startswith(("quadcurv.kernels", "quadcurv.schemes", "quadcurv.drivers")) for n in imports(path)
        )


def loaded(code: str) -> set[str]:
    run = subprocess.run(
        [sys.executable, "-c", f"import sys; {code}; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    )
    return set(run.stdout.split())


def test_import_loads_nothing_heavy():
    assert not {name.split(".")[0] for name in loaded("import quadcurv")} & (
        HEAVY | {"numba", "numpy", "scipy"}
    )


def test_the_face_is_what_the_stub_lists():
    assert dir(qc) == sorted(qc.__all__)
    for name in qc.__all__:
        assert getattr(qc, name) is not None
    assert qc.__version__ in dir(qc) or "__version__" in dir(qc)
    internal = {"kernels", "drivers", "checks", "mesh", "io", "types", "Stencils", "Scheme"}
    assert not internal & set(dir(qc))
    with pytest.raises(AttributeError, match="nobody"):
        _ = qc.nobody


def test_every_public_object_is_documented():
    for name in qc.__all__:
        if name != "__version__":
            assert (getattr(qc, name).__doc__ or "").strip(), name
