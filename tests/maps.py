"""What tests of maps share: comparisons to look at, and pictures to tell apart."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from quadcurv import QuadGrid, surfaces
from quadcurv.comparison import Comparison, compare
from quadcurv.viewing import opengl_problem

needs_opengl = pytest.mark.skipif(opengl_problem() is not None, reason=f"cannot render: {opengl_problem()}")


def made_up(exact=0.0, areas=None, **H):
    """Comparison on a strip of quads, with the curvature that a test wants to see."""
    n = len(next(iter(H.values())))
    mesh = QuadGrid(np.stack(np.meshgrid(np.arange(n / 2), [0.0, 1.0], [0.0], indexing="ij"), -1)[:, :, 0])
    areas = np.ones(n) if areas is None else areas
    by_scheme = {name: np.array(values, float).reshape(-1, 2) for name, values in H.items()}
    return Comparison(
        mesh,
        by_scheme,
        None if exact is None else np.full((n // 2, 2), exact),
        np.reshape(areas, (-1, 2)).astype(float),
        np.full((n // 2, 2), 4, np.int32),
    )


def on_pillow():
    """Cells of a sphere with folds in its grid: exact errors of two schemes."""
    surface = surfaces.pillow_sphere()
    mesh, xi, eta = surface.sample((24, 24), "staggered")
    return compare(mesh, ["finite_volume", "cotan-6"], surface.mean_curvature(xi, eta))


def on_ellipsoid():
    """Vertices, eight of them of valence 3: exact errors of three schemes."""
    surface = surfaces.cubed_ellipsoid()
    mesh, xi, eta = surface.sample((8, 8), "faces")
    return compare(mesh, ["finite_volume", "liu", "cotan-6"], surface.mean_curvature(xi, eta))


def pixels(path, size=None):
    """(rows, columns, 3) of a picture, from 0 to 255."""
    with Image.open(path) as image:
        image = image.convert("RGB")
        return np.asarray(image.resize(size) if size else image, float)


def differences(picture, reference):
    """Mean difference of two pictures, and the part of their pixels that differ by more than a tenth."""
    gap = np.abs(picture - reference).max(axis=2) / 255
    return gap.mean(), np.mean(gap > 0.1)


def is_like(picture, reference):
    """Alike but for smoothed edges and the width of lines, which drivers draw differently."""
    mean, part = differences(picture, reference)
    return mean < 0.01 and part < 0.02
