"""How far a Laplacian may be off for its rings alone, and that it is told where that is far."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
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


@settings(deadline=None)
@given(
    seed=st.integers(0, 10**6),
    shear=st.floats(0, 5),
    aspect=st.floats(0.2, 1),
    jitter=st.floats(0, 0.25),
    angle=st.floats(0, 3),
    k2=st.floats(-1, 1),
    name=st.sampled_from(sorted(LAPLACIANS)),
    cut=st.booleans(),
)
def test_it_bounds_the_error_of_h(seed, shear, aspect, jitter, angle, k2, name, cut):
    """Of surfaces bent so little that nothing but the quadratic part counts, by faces that are convex.

    Finite volumes at triangles see linear functions, too: how the ring lies counts beside.
    """
    cut = cut and name != "finite_volume"
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


# ---- faces that fold over, and those that are too thin -----------------------------------------------------


def wrong_in_silence(mesh, exact, name):
    """Vertices where H is off by more than may be, and is not told of."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        H = np.ravel(qc.mean_curvature(mesh, name))
    off = np.abs(np.abs(H) - np.abs(np.ravel(exact)))
    bound = FAR if LAPLACIANS[name].order else FAR_ANYHOW
    # Of these regular vertices inside are looked at where H is six times 1 / extent, which is 1 / 2.
    bound = 6 * 0.5 + 0.3 if LAPLACIANS[name].fast is not None else bound * 0.82
    wrong = off > bound
    if any(issubclass(warning.category, qc.ConsistencyWarning) for warning in said):
        wrong[far_off(one_rings(mesh), LAPLACIANS[name])[0]] = False
    return np.flatnonzero(wrong)


def sheet(u, v):
    """Points and H of z = 0.4 u^2 - 0.15 v^2 + 0.1 u v, whose larger principal curvature is 0.82 at most."""
    zu, zv = 0.8 * u + 0.1 * v, -0.3 * v + 0.1 * u
    slope = 1 + zu**2 + zv**2
    H = ((1 + zv**2) * 0.8 - 0.2 * zu * zv - (1 + zu**2) * 0.3) / (2 * slope**1.5)
    return np.stack((u, v, 0.4 * u * u - 0.15 * v * v + 0.1 * u * v), axis=-1), H


t = np.linspace(-1, 1, 17)
U, V = np.meshgrid(t, t, indexing="ij")


def shifted(du, dv, place):
    u, v = U.copy(), V.copy()
    u[place] += du / 8
    v[place] += dv / 8
    return u, v


def twice(axis, place, gap):
    """A row or column given once more, or nearly."""
    s = np.sort(np.append(t, t[place] + gap))
    return np.meshgrid(*((s, t) if axis == 0 else (t, s)), indexing="ij")


SHAPES = {
    **{
        f"{name} {amount}": shifted(*amount, place)
        for name, place in (("vertex", (8, 8)), ("row", 8), ("side", (0, 8)), ("corner", (0, 0)))
        for amount in ((0.9, 0.9), (0.99, 0.0), (1.3, 0.2), (2.2, 0.1))
    },
    **{
        f"{name} twice {gap:g}": twice(0, place, gap)
        for name, place in (("row", 8), ("side", 0), ("second", 1))
        for gap in (0.0, 1e-9, 1e-6, 1e-3)
    },
    "rows exchanged": (U[[*range(8), 9, 8, *range(10, 17)]], V),
    "rows that cross": (U + np.where(np.arange(17)[:, None] == 8, 0.2 * V, 0.0), V),
    "second row crosses": (U + np.where(np.arange(17)[:, None] == 1, 0.2 * V, 0.0), V),
    "a row of no length": (U, np.where(np.arange(17)[:, None] == 8, 0.0, V)),
    "a row of hardly any length": (U, np.where(np.arange(17)[:, None] == 8, 1e-9 * V, V)),
    "columns cross in a point": (U, U * V),
    "columns cross between rows": (U, (U - 0.03) * V),
    "nearly pinched": (U, V * (np.abs(U) + 1e-3)),
    "checkerboard": (U + 0.3 / 8 * (np.indices(U.shape).sum(axis=0) % 2 * 2 - 1), V),
    "zigzag": (U, V + 1.2 / 8 * (np.arange(17) % 2 * 2 - 1)[:, None]),
}


@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")
@pytest.mark.parametrize("name", LAPLACIANS)
@pytest.mark.parametrize("given_as", ["grid", "faces"])
def test_what_folds_over_or_has_no_width_is_told(given_as, name):
    """H was off by up to 1e10 beside a row of hardly any length, 126 where a vertex lay beyond the next."""
    for shape, uv in SHAPES.items():
        points, H = sheet(*uv)
        mesh = qc.QuadGrid(points)
        mesh = mesh.to_mesh() if given_as == "faces" else mesh
        assert not wrong_in_silence(mesh, H.ravel(), name).size, shape


@pytest.mark.parametrize(
    "shape", ["vertex (2.2, 0.1)", "side (1.3, 0.2)", "a row of hardly any length", "rows that cross"]
)
def test_angle_defects_at_folds_are_told(shape):
    points, _ = sheet(*SHAPES[shape])
    with pytest.warns(qc.ConsistencyWarning, match=r"angle_defect: K, as .* vertex \(\d+, \d+\)"):
        K = qc.gaussian_curvature(qc.QuadGrid(points), "angle_defect")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        plain = qc.gaussian_curvature(qc.QuadGrid(sheet(U, V)[0]), "angle_defect")
    assert np.nanmax(np.abs(K)) > 3 * np.abs(plain).max()


def test_rows_that_cross_in_large_grids_are_seen():
    """Of more than 16,384 vertices not all are looked at first."""
    t = np.linspace(-1, 1, 301)
    u, v = np.meshgrid(t, t, indexing="ij")
    points, _ = sheet(u + np.where(np.arange(301)[:, None] == 150, 0.2 * v, 0.0), v)
    with pytest.warns(qc.ConsistencyWarning, match="finite_volume"):
        qc.mean_curvature(qc.QuadGrid(points), "finite_volume")
    with pytest.warns(qc.ConsistencyWarning, match="finite_volume"):
        qc.mean_curvature_normal(qc.QuadGrid(points), "finite_volume")


def test_folds_are_none_of_sharp_edges():
    """A roof as steep as that: each face is turned less than a quarter from the mean."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(5.0), indexing="ij")
    roof = np.stack((x, y, -3 * np.abs(x - 2)), axis=-1)
    with warnings.catch_warnings():
        warnings.simplefilter("error", qc.ConsistencyWarning)
        for name in ("liu", "cotan-6", "bunge"):
            assert np.nanmax(np.abs(qc.mean_curvature(qc.QuadGrid(roof), name))) > 0.1
