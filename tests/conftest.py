"""Meshes that several tests look at."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from quadcurv import QuadGrid, QuadMesh, surfaces

SHARED_MESHES = Path(__file__).parents[2] / "shared" / "meshes"


@pytest.fixture(scope="session")
def rng() -> np.random.Generator:
    return np.random.default_rng(20130802)


@pytest.fixture
def torus() -> QuadGrid:
    """A wrapped grid whose points are off the surface by noise: nothing is orthogonal or planar."""
    grid = surfaces.torus().sample((14, 11))[0]
    noise = np.random.default_rng(7).normal(0, 0.02, grid.points.shape)
    return QuadGrid(grid.points + noise, grid.wrap)


@pytest.fixture
def mixed() -> QuadMesh:
    """A closed ellipsoid of quads and triangles, valences 3 to 7."""
    mesh = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]
    rng = np.random.default_rng(3)
    cut = rng.random(len(mesh.faces)) < 0.3
    quads = mesh.faces[cut]
    faces = [
        *mesh.faces[~cut].tolist(),
        *quads[:, [0, 1, 2]].tolist(),
        *quads[:, [2, 3, 0]].tolist(),
    ]
    return QuadMesh(mesh.points, faces)


@pytest.fixture
def shared_meshes() -> Path:
    if not SHARED_MESHES.is_dir():
        pytest.skip(f"no folder of real meshes at {SHARED_MESHES}")
    return SHARED_MESHES


@pytest.fixture(scope="module")
def browser():
    """A browser without a window, and without a network."""
    if shutil.which("chromedriver") is None or shutil.which("chromium") is None:
        pytest.skip("not installed: chromium and chromium-driver")
    webdriver = pytest.importorskip("selenium.webdriver")
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for argument in (
        "headless=new",
        "no-sandbox",
        "use-angle=swiftshader",
        "enable-unsafe-swiftshader",
        "window-size=1000,700",
        "host-resolver-rules=MAP * ~NOTFOUND",
    ):
        options.add_argument(f"--{argument}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    driver = webdriver.Chrome(options, service)
    yield driver
    driver.quit()
