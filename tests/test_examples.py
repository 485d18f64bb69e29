"""Every script in examples/ runs without a warning and returns the number pinned here."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
RETURNS = {
    "meshlab_smoothing": pytest.approx(2.930, abs=2e-3),
    "pyvista_accessor": pytest.approx(3.870, abs=2e-3),
    "readme_picture": pytest.approx(259.09, rel=1e-3),
    "triangles_to_grid": pytest.approx(0.0, abs=1e-12),
    "trimesh_curvature": pytest.approx(1.08198e-3, rel=1e-4),
}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_example(path, capsys):
    if "meshlab" in path.stem:
        pytest.importorskip("pymeshlab", exc_type=ImportError)
    assert path.stem in RETURNS, f"say in this test what {path.name} returns"
    assert runpy.run_path(str(path))["main"]() == RETURNS[path.stem]


def test_every_number_has_its_example():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(RETURNS)
