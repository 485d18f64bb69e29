"""How far a Laplacian may be off for its rings alone, and that it is told where that is far."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.boundary import one_rings
from quadcurv.schemes import SCHEMES, Laplacian
from quadcurv.schemes.consistency import FAR, FAR_ANYHOW, consistency, far_off

LAPLACIANS = {name: scheme for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)}
CONVERGENT = {name: scheme for name, scheme in LAPLACIANS.items() if scheme.order > 0}


def bent(u, v, k1=0.0, k2=0.0, angle=0.0):
    """Points over a plane on a surface that is hardly bent, along some directions."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack((u, v, (k1 * (c * u + s * v) ** 2 + k2 * (c * v - s * u) ** 2) / 2), axis=-1)


def lattice(shear=0.0, aspect=1.0, jitter=0.0, rng=None, n=9):
    u, v = np.meshgrid(np.arange(float(n)), aspect * np.arange(float(n)), indexing="ij")
    u = u + shear * v
    if jitter:
        u, v = u + jitter * rng.uniform(-1, 1, u.shape), v + jitter * aspect * rng.uniform(-1, 1, u.shape)
    return u, v


@pytest.mark.parametrize("name", ["finite_volume", "liu", "bilinear", "cotan-6", "bunge"])
@pytest.mark.parametrize("aspect", [0.01, 0.3, 1.0])
@pytest.mark.parametrize("shear", [0.0, 0.5])
def test_consistent_on_lattices(name, aspect, shear):
    mesh = qc.QuadGrid(bent(*lattice(shear, aspect)))
    if name == "bunge" and shear:
        pytest.skip("of first order there")
    off = consistency(mesh.stencils(), SCHEMES[name])
    assert np.nanmax(off) < 1e-6
    assert np.isnan(off).sum() == 32  # the border


@given(
    seed=st.integers(0, 10**6),
    shear=st.floats(0, 5),
    aspect=st.floats(0.2, 1),
    jitter=st.floats(0, 0.45),
    angle=st.floats(0, 3),
    k2=st.floats(-1, 1),
    name=st.sampled_from(sorted(LAPLACIANS)),
    cut=st.booleans(),
)
def test_it_bounds_the_error_of_h(seed, shear, aspect, jitter, angle, k2, name, cut):
    """Of surfaces bent so little that nothing but the quadratic part counts."""
    rng, k = np.random.default_rng(seed), 1e-6
    u, v = lattice(shear, aspect, jitter, rng)
    mesh = qc.QuadGrid(bent(u, v)).to_mesh()
    faces = mesh.faces
    if cut:
        faces = [*faces[:20].tolist(), *faces[20:, [0, 1, 2]].tolist(), *faces[20:, [0, 2, 3]].tolist()]
    middle = 4 * 9 + 4
    points = bent(u - u[4, 4], v - v[4, 4], k, k * k2, angle).reshape(-1, 3)
    mesh = qc.QuadMesh(points, faces)
    off = consistency(mesh.stencils(), LAPLACIANS[name], np.array([middle]))[0]
    with warnings.catch_warnings(action="ignore", category=qc.ConsistencyWarning):
        H = qc.mean_curvature(mesh, name)[middle]
    if np.isfinite(off) and off < 1e4:
        assert abs(abs(H) / k - abs(1 + k2) / 2) < off * (1 + 1e-3) + 1e-3


@pytest.mark.parametrize("name", [name for name in LAPLACIANS if name != "finite_volume"])
def test_it_is_told_where_and_by_how_much(name):
    """A vertex beside an edge, in a quad cut into triangles: on the surface, and H is off by tens of k.

    But for finite volumes, which see an edge and its ends there as they are.
    """
    u, v = lattice(n=13)
    grid, c = qc.QuadGrid(bent(u, v, 1e-3, 5e-4)), 13
    faces = grid.to_mesh().faces.tolist()
    quad = faces.pop(faces.index([5 * c + 5, 6 * c + 5, 6 * c + 6, 5 * c + 6]))
    faces += [[quad[k], quad[(k + 1) % 4], c * c] for k in range(4)]
    mesh = qc.QuadMesh(np.vstack((grid.points.reshape(-1, 3), bent(5.5, 5.01, 1e-3, 5e-4))), faces)
    with pytest.warns(qc.ConsistencyWarning, match=rf"{name}: H may be off by .* first vertex \d+;"):
        H = qc.mean_curvature(mesh, name)
    with pytest.warns(qc.ConsistencyWarning, match=name):
        qc.laplace_beltrami(mesh, mesh.points, name)
    off = np.abs(np.abs(H) / 1e-3 - 0.75)
    told, size = far_off(one_rings(mesh), LAPLACIANS[name])
    assert set(told) <= {*quad, c * c}
    bound = FAR if LAPLACIANS[name].order else FAR_ANYHOW
    assert (size >= bound).all()
    assert (off[told] < 1.1 * size).all()
    assert np.delete(off, told).max() < bound
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        qc.mean_curvature(mesh)  # fits do not look at faces


def test_the_place_is_that_of_the_grid():
    u, v = lattice()
    u = u + np.where(u > 4, 3 * v, 0)
    grid = qc.QuadGrid(bent(u, v, 0.01, 0.01))
    with pytest.warns(qc.ConsistencyWarning, match=r"first vertex \((?P<i>\d), (?P<j>\d)\)") as said:
        qc.mean_curvature(grid, "cotan-4")
    mask = np.zeros(grid.shape, bool)
    mask[0, :] = True
    with pytest.warns(qc.ConsistencyWarning, match=r"first vertex \(\d, \d\)") as hidden:
        qc.mean_curvature(qc.QuadGrid(grid.points, mask=mask), "cotan-4")
    with pytest.warns(qc.ConsistencyWarning, match=r"first vertex \d+;"):
        qc.mean_curvature(grid.to_mesh(), "cotan-4")
    places = [str(w[0].message).split("first vertex ")[1].split(";")[0] for w in (said, hidden)]
    assert places[0] == places[1]


@pytest.mark.parametrize("name", LAPLACIANS)
def test_nothing_is_told_of_ordinary_meshes(name, rng):
    """Jitter of a tenth, thin cells, meshes of quads and triangles, cubed spheres, poles."""
    ball = surfaces.cubed_sphere().sample((8, 8), "faces")[0]
    tube = surfaces.cylinder().sample((12, 90))[0]
    t = np.linspace(0, 1, 17)
    u, v = np.meshgrid(t, t, indexing="ij")
    u, v = (x + 0.1 / 16 * rng.uniform(-1, 1, x.shape) for x in (u, v))
    sheet = qc.QuadGrid(bent(u, v, 1.0, 0.5)).to_mesh()
    mixed = [f if k % 3 else f[:3] for k, f in enumerate(sheet.faces.tolist())]
    mixed += [[f[0], f[2], f[3]] for f in sheet.faces[::3].tolist()]
    with warnings.catch_warnings():
        warnings.simplefilter("error", qc.ConsistencyWarning)
        for mesh in (ball, tube, sheet, qc.QuadMesh(sheet.points, mixed)):
            assert np.isfinite(qc.mean_curvature(mesh, name)).all()


@pytest.mark.parametrize("name", CONVERGENT)
def test_those_looked_at_are_all_that_are_far_off(name, rng):
    """Faces without a narrow corner are passed over: nothing beyond the bound by more than a tenth is."""
    for shear in (0.0, 1.0, 2.0, 4.0):
        mesh = qc.QuadGrid(bent(*lattice(shear, 0.7, 0.3, rng, 17), 0.01, 0.01))
        stencils = one_rings(mesh)
        off = consistency(stencils, SCHEMES[name])
        assert np.isin(np.flatnonzero(off > 1.1 * FAR), far_off(stencils, SCHEMES[name])[0]).all()
