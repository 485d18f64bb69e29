"""Curvature as a method of pyvista's meshes."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv

import quadcurv
import quadcurv as qc
from quadcurv import mean_curvature, mean_curvature_normal, surfaces


def test_the_accessor_needs_no_import():
    code = """
import sys, numpy as np, pyvista as pv
assert "quadcurv" not in sys.modules
H = pv.Sphere(radius=2.0, theta_resolution=60, phi_resolution=60).quadcurv.mean_curvature("liu")
print(np.median(H))
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert float(run.stdout) == pytest.approx(0.5, rel=2e-3)
    assert run.stderr == ""


def test_the_accessor_of_polydata():
    quads = surfaces.torus().sample((8, 6), "faces")[0]
    data = qc.to_pyvista(quads)
    before = data.copy()
    np.testing.assert_array_equal(data.quadcurv.mean_curvature(), mean_curvature(quads))
    np.testing.assert_array_equal(
        data.quadcurv.mean_curvature("liu", "nan"), mean_curvature(quads, "liu", "nan")
    )
    np.testing.assert_array_equal(data.quadcurv.mean_curvature_normal(), mean_curvature_normal(quads))
    np.testing.assert_array_equal(data.quadcurv.vertex_normals(), quadcurv.vertex_normals(quads))
    K = quadcurv.gaussian_curvature(quads)
    np.testing.assert_array_equal(data.quadcurv.gaussian_curvature(), K)
    for ours, theirs in zip(
        data.quadcurv.principal_curvatures(), qc.principal_curvatures(quads), strict=True
    ):
        np.testing.assert_array_equal(ours, theirs)
    assert data == before
    assert data.array_names == []
    with pytest.raises(ValueError, match="scheme: expected one of"):
        data.quadcurv.mean_curvature("no such scheme")
    with pytest.raises(TypeError, match="only a StructuredGrid has directions to wrap"):
        data.quadcurv.mean_curvature(wrap=(True, False))


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_accessor_of_structured_grids(torus, axis):
    closed = np.pad(torus.points, [(0, 1), (0, 1), (0, 0)], mode="wrap")
    data = pv.StructuredGrid(*np.moveaxis(np.expand_dims(closed, axis), -1, 0))
    H, Hn = mean_curvature(torus), mean_curvature_normal(torus)
    assert (data.quadcurv.mean_curvature(wrap=(True, True)).reshape(12, 15).T[:14, :11] == H).all()
    found = data.quadcurv.mean_curvature_normal(wrap=(True, True))
    assert (found.reshape(12, 15, 3).swapaxes(0, 1)[:14, :11] == Hn).all()
    assert (found[0] == found[14]).all()
    assert data.quadcurv.vertex_normals(wrap=(True, True)).shape == (180, 3)


def test_the_accessor_compares(torus):
    quads = torus.to_mesh()
    found = qc.to_pyvista(quads).quadcurv.compare(["finite_volume", "liu"], exact=0.5)
    assert list(found.mean_curvature) == ["finite_volume", "liu"]
    np.testing.assert_array_equal(found.mean_curvature["liu"], mean_curvature(quads, "liu"))


def test_no_window_is_opened(tmp_path):
    code = f"""
import sys
import quadcurv
from quadcurv import surfaces
mesh = surfaces.torus().sample((4, 5), "faces")[0]
quadcurv.write("{tmp_path}/a.vtp", mesh, {{"H": quadcurv.mean_curvature(mesh)}})
quadcurv.to_pyvista("{tmp_path}/a.vtp").quadcurv.mean_curvature()
print(*(m for m in sys.modules if "OpenGL" in m or m == "pyvista.plotting"))
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == ""
