"""Every script in examples/ runs without a warning, makes its pictures and returns its number."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
import pyvista as pv

from quadcurv.viewing import opengl_problem

EXAMPLES = Path(__file__).parents[1] / "examples"
RETURNS = {
    "blocks_that_meet": pytest.approx(2.217e-5, rel=1e-3),
    "cad_fillet": pytest.approx(1.00215, abs=1e-4),
    "cubed_sphere": pytest.approx(6.796, rel=1e-3),
    "damaged_mesh": 4.0,
    "eigenmodes": pytest.approx(6.643e-3, rel=1e-3),
    "functions_on_surfaces": pytest.approx(1.888, abs=2e-3),
    "mean_curvature_flow": pytest.approx(0.02881, abs=1e-4),
    "membrane_in_time": pytest.approx(0.029166, abs=1e-5),
    "meshlab_smoothing": pytest.approx(2.930, abs=2e-3),
    "minimal_surfaces": pytest.approx(1.995, abs=2e-3),
    "moving_grid": pytest.approx(0.7865, abs=1e-3),
    "noisy_scan": pytest.approx(0.994, abs=5e-3),
    "one_operator_two_areas": pytest.approx(1.3213, abs=1e-3),
    "other_programs": 0.0,
    "pyvista_accessor": pytest.approx(3.870, abs=2e-3),
    "readme_picture": pytest.approx(259.09, rel=1e-3),
    "subdivision_surface": pytest.approx(1.0, abs=1e-12),
    "surface_of_ones_own": pytest.approx(7.857, abs=5e-3),
    "terrain_with_holes": 1.0,
    "triangles_to_grid": pytest.approx(0.0, abs=1e-12),
    "trimesh_curvature": pytest.approx(1.08198e-3, rel=1e-4),
}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.stem)
def test_example(path, capsys):
    if opengl_problem():
        pytest.skip(opengl_problem())
    if "meshlab" in path.stem:
        pytest.importorskip("pymeshlab", exc_type=ImportError)
    if "time" in path.stem:
        pytest.importorskip("xarray")
    assert path.stem in RETURNS, f"say in this test what {path.name} returns"
    try:
        assert runpy.run_path(str(path))["main"]() == RETURNS[path.stem]
    finally:
        pv.close_all()


def test_every_number_has_its_example():
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(RETURNS)
