"""The plugin under pvpython, where that is installed: in a process of its own, with ParaView's own VTK."""

from __future__ import annotations

import json
import shutil
import subprocess
import sysconfig
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PVPYTHON = shutil.which("pvpython")
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(PVPYTHON is None, reason="no pvpython"),
]

# ParaView's VTK is loaded before the folder of packages, which may hold the wheel of another, comes ahead.
HEAD = """
import inspect, json, sys
if not hasattr(inspect, "getargspec"):  # ParaView 5.11 asks for what Python 3.11 no longer has
    inspect.getargspec = lambda function: inspect.getfullargspec(function)[:4]
import vtkmodules.vtkCommonCore
sys.path[:0] = sys.argv[1:3]
import paraview.simple as pv
pv.LoadPlugin(sys.argv[1] + "/quadcurv/paraview_plugin.py", remote=False, ns=globals())

def arrays(source):
    return {name: source.PointData[name].GetRange() for name in source.PointData.keys()}
"""
PLANE = """
plane = pv.Plane(XResolution=12, YResolution=9)
bent = pv.Calculator(Input=plane, ResultArrayName="x", CoordinateResults=1)
bent.Function = "coordsX*iHat + coordsY*jHat + sqrt(4 - coordsX^2)*kHat"  # a cylinder of radius 2
"""


@pytest.fixture
def run(tmp_path):
    def run(script):
        path = tmp_path / "script.py"
        path.write_text(HEAD + script)
        command = [PVPYTHON, path, ROOT, sysconfig.get_path("purelib")]
        found = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        lines = [line for line in found.stdout.splitlines() if line.startswith("{")]
        assert lines, found.stdout + found.stderr
        return json.loads(lines[-1]), found.stderr + found.stdout

    return run


def test_polygons(run):
    script = "f = QuadCurvature(Input=bent, ErrorBars={})\nf.UpdatePipeline()\nprint(json.dumps(arrays(f)))"
    found, _ = run(PLANE + script.format(0))
    curvatures, bars = (
        {"H", "K", "k1", "k2"},
        {"H interval", "K interval", "k1 interval", "k2 interval", "crease"},
    )
    assert set(found) & (curvatures | bars) == curvatures
    assert [abs(end) for end in found["H"]] == pytest.approx([0.25, 0.25], abs=1e-4)
    assert found["K"] == pytest.approx([0, 0], abs=1e-4)
    found, _ = run(PLANE + script.format(1))
    assert set(found) >= curvatures | bars
    assert 0 <= found["H interval"][0] <= found["H interval"][1] < 1e-3
    assert found["crease"] == [0, 0]


def test_structured_grids_and_schemes(run):
    found, _ = run(
        """
wavelet = pv.Wavelet(WholeExtent=[0, 9, 0, 7, 0, 0])
moved = pv.Transform(Input=wavelet)  # a structured grid
grid = pv.Calculator(Input=moved, ResultArrayName="x", CoordinateResults=1)
grid.Function = "coordsX*iHat + coordsY*jHat + sqrt(400 - coordsX^2)*kHat"
f = QuadCurvature(Input=grid, Scheme="liu", Boundary="nan")
f.UpdatePipeline()
inside = pv.Threshold(Input=f, Scalars=["POINTS", "H"], LowerThreshold=-1, UpperThreshold=1)
inside.UpdatePipeline()
print(json.dumps(arrays(inside)))
"""
    )
    assert "K" not in found
    assert [abs(end) for end in found["H"]] == pytest.approx([0.025, 0.025], abs=1e-4)


def test_errors_are_in_the_log(run):
    found, log = run(
        """
f = QuadCurvature(Input=pv.Line())
f.UpdatePipeline()
print(json.dumps(arrays(f)))
"""
    )
    assert "H" not in found
    assert "ERR| quadcurv: faces: none given" in log
