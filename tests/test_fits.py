"""What a fit sees of a mesh, and what the driver of fits makes of its answer."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import quadcurv as qc
from quadcurv import drivers, surfaces
from quadcurv.schemes import Curvatures, Fit, jet


def plainly(around):
    """Quadratic heights over the normals of rings, one vertex at a time: all that a new fit takes."""
    vertices = np.flatnonzero(around.wanted)
    n = around.wanted.size
    H, K = np.full((2, n), np.nan)
    normals = np.full((n, 3), np.nan)
    for v, x, normal in zip(vertices, *around.positions(vertices, 1), strict=True):
        x = x[~np.isnan(x[:, 0])] - x[0]
        normal = normal / np.linalg.norm(normal)
        tangents = np.linalg.svd(normal[None])[2][1:]
        (a, b), z = tangents @ x.T, x @ normal
        terms = np.stack((np.ones_like(a), a, b, a * a / 2, a * b, b * b / 2), axis=1)
        _, p, q, r, s, t = np.linalg.lstsq(terms, z)[0]
        W = np.sqrt(1 + p * p + q * q)
        H[v] = -((1 + q * q) * r - 2 * p * q * s + (1 + p * p) * t) / (2 * W**3)
        K[v] = (r * t - s * s) / W**4
        normals[v] = normal
    root = np.sqrt(np.maximum(H * H - K, 0))
    return Curvatures(H, K, H + root, H - root, normals, normals, normals)


PLAIN = Fit("plain", 2, "these lines", plainly)


def moebius_strip(r=24, c=7):
    t, s = np.arange(r)[:, None] * 2 * np.pi / r, np.linspace(-0.4, 0.4, c)
    R = 2 + s * np.cos(t / 2)
    index = np.arange(r * c).reshape(r, c)
    index = np.vstack((index, index[:1, ::-1]))
    faces = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    points = np.stack((R * np.cos(t), R * np.sin(t), s * np.sin(t / 2)), axis=-1)
    with pytest.warns(UserWarning, match="non-orientable"):
        return qc.QuadMesh(points.reshape(-1, 3), faces.reshape(-1, 4))


@pytest.mark.parametrize("layout", ["grid", "faces", "staggered"])
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("name", ["elliptic_paraboloid", "catenoid"])
def test_a_fit_in_plain_numpy_sees_what_the_compiled_ones_see(name, boundary, layout):
    grid = surfaces.SURFACES[name]().sample((12, 10), "staggered" if layout == "staggered" else "grid")[0]
    mesh = grid.to_mesh() if layout == "faces" else grid
    plain, compiled = (qc.curvatures(mesh, s, boundary) for s in (PLAIN, jet(2)))
    assert plain.mean.shape == compiled.mean.shape
    assert plain.normal.shape == (*compiled.mean.shape, 3)
    same = compiled.rings == 1
    assert same.mean() > 0.6
    assert np.isfinite(plain.mean[same]).all()
    assert np.abs(plain.mean - compiled.mean)[same].max() < 1e-11
    if boundary == "nan":
        assert np.array_equal(np.isnan(plain.mean), np.isnan(compiled.mean))


def test_where_nothing_is_known_is_nan_whatever_a_fit_says():
    """Isolated vertices, several fans, open rings with boundary="nan": of every array."""

    def careless(around):
        n = around.wanted.size
        ones, normals = np.ones(n), np.ones((n, 3))
        return replace(
            Curvatures(ones, ones, ones, ones, normals, normals, normals, jet().fit(around).standard_error),
            noise=ones,
            degree=np.ones(n, np.int32),
        )

    grid = surfaces.elliptic_paraboloid().sample((12, 12))[0].to_mesh()
    middle = 6 * 13 + 6
    around = np.flatnonzero((grid.faces == middle).any(axis=1))
    points = np.vstack((grid.points, [(0, 0, 9)]))
    mesh = qc.QuadMesh(points, np.delete(grid.faces, around[[0, 3]], axis=0))
    for boundary in ("extrapolate", "nan"):
        found = qc.curvatures(mesh, Fit("careless", 0, "", careless), boundary)
        unknown = np.zeros(len(points), bool)
        unknown[[middle, -1]] = True
        if boundary == "nan":
            unknown |= ~mesh.stencils().closed
        assert np.array_equal(np.isnan(found.mean), unknown)
        assert np.array_equal(np.isnan(found.normal).all(axis=1), unknown)
        assert np.array_equal(np.isnan(found.noise), unknown)
        assert np.isnan(found.standard_error.k1[unknown]).all()
        assert np.array_equal(found.degree == 0, unknown)
        assert found.rings is None


def test_where_no_side_is_the_outer_one_every_fit_takes_that_of_positive_mean_curvature():
    strip = moebius_strip()
    fits = qc.curvatures(strip, PLAIN)
    assert (fits.mean >= 0).all()
    assert np.abs((fits.k1 + fits.k2) / 2 - fits.mean).max() < 1e-12
    assert np.abs(fits.mean - qc.mean_curvature(strip, jet(2))).max() < 1e-11


def test_a_mask_cuts_holes_of_the_grids_shape():
    grid = surfaces.elliptic_paraboloid().sample((12, 10))[0]
    mask = np.zeros(grid.shape, bool)
    mask[5, 4:7] = mask[0, 0] = True
    masked = qc.QuadGrid(grid.points, mask=mask)
    for scheme in (jet(), PLAIN):
        fits = qc.curvatures(masked, scheme)
        expected = qc.curvatures(masked.to_mesh(), scheme)
        assert np.array_equal(fits.mean[~mask], expected.mean)
        assert np.array_equal(fits.normal[~mask], expected.normal)
        assert np.isnan(fits.mean[mask]).all()
        assert np.isnan(fits.normal[mask]).all()


def test_rejections():
    grid = surfaces.torus().sample((8, 8))[0]
    for boundary in ("mirror", None):
        with pytest.raises(ValueError, match="boundary: expected one of"):
            drivers.fit(grid, PLAIN, boundary)
    short = Fit("short", 2, "", lambda around: plainly(around) and replace(plainly(around), mean=np.ones(3)))
    with pytest.raises(ValueError, match=r"short: its fit gave H of shape \(3,\), expected \(64,\)"):
        drivers.fit(grid, short)
