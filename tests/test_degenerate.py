"""Faces, halves of faces and rings without area but for rounding: right, or NaN there, never an error."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.kernels import vector
from quadcurv.schemes import SCHEMES, Laplacian, cotan

LAPLACIANS = {name: scheme for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)}
each = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
each_laplacian = pytest.mark.parametrize("scheme", LAPLACIANS.values(), ids=LAPLACIANS)
# On triangles these are all the cotan formula; the finite-volume scheme reads the triangles beside too.
COTAN = [name for name in LAPLACIANS if name != "finite_volume"]
HALVES = {cotan(valence, area).name for valence in (4, 6, 8) for area in ("barycentric", "voronoi")}
PLACES = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e3), (1.0, 1e6), (1e-3, 1e6)]  # scale, offset

skew = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")


def turn(seed):
    return Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T


# ---- needles and caps -----------------------------------------------------------------------------------


def with_thin_triangle(kind, size, seed=0):
    """An ellipsoid of triangles, one of them divided from a point near a corner of it, or near a side."""
    mesh = surfaces.cubed_ellipsoid().sample((4, 4), "faces")[0]
    triangles = np.concatenate((mesh.faces[:, [0, 1, 2]], mesh.faces[:, [2, 3, 0]]))
    points = mesh.points @ turn(seed)
    corners = triangles[20]
    a, b, c = points[corners]
    along, up = b - a, c - a
    if kind == "needle":
        new = a + size * (0.3 * along + 0.7 * up) / np.linalg.norm(along)
    else:
        up = up - (up @ along) / (along @ along) * along
        new = 0.45 * a + 0.55 * b + size * up / np.linalg.norm(up)
    v = len(points)
    fan = [[corners[i - 1], corners[i], v] for i in range(3)]
    return np.vstack((points, new)), np.concatenate((np.delete(triangles, 20, axis=0), fan))


def cotan_in_long_doubles(points, triangles):
    """Stiffness and a third of the triangles' areas, relative to these very positions."""
    x = points.astype(np.longdouble)
    S, A = np.zeros((len(x), len(x)), np.longdouble), np.zeros(len(x), np.longdouble)
    for t in triangles:
        double = np.sqrt((np.cross(x[t[1]] - x[t[0]], x[t[2]] - x[t[0]]) ** 2).sum())
        for i in range(3):
            c, a, b = t[i], t[i - 2], t[i - 1]
            half = ((x[a] - x[c]) * (x[b] - x[c])).sum() / (2 * double)
            S[[a, b], [b, a]] -= half
            S[[a, b], [a, b]] += half
            A[c] += double / 6
    return S, A


@skew
@pytest.mark.parametrize("scheme", COTAN)
@pytest.mark.parametrize("kind", ["needle", "cap"])
@pytest.mark.parametrize("size", [1e-3, 1e-6, 1e-8, 1e-9, 1e-10, 1e-12])
def test_thin_triangles_are_as_exact_as_their_positions(scheme, kind, size):
    points, triangles = with_thin_triangle(kind, size)
    S, A = cotan_in_long_doubles(points, triangles)
    found = qc.stiffness_matrix((points, triangles), scheme).toarray()
    scale = np.sqrt(np.outer(np.diag(S), np.diag(S)))
    rounding = 2.0**-52 / size
    assert (np.abs(found - S) / scale).max() < 1e-11 + 10 * rounding
    Hn = qc.mean_curvature_normal((points, triangles), scheme)
    assert np.isfinite(Hn).all()
    if np.allclose(qc.dual_areas((points, triangles), scheme), A.astype(float), rtol=1e-9):
        expected = -(S @ points.astype(np.longdouble)) / (2 * A[:, None])
        assert np.linalg.norm(Hn - expected, axis=1).max() < (1e-11 + 10 * rounding) * np.abs(expected).max()


@skew
@each_laplacian
@pytest.mark.parametrize("kind", ["needle", "cap"])
@pytest.mark.parametrize("size", [1e-5, 1e-7, 1e-9, 1e-11, 1e-13, 1e-14, 1e-15, 1e-17, 0.0])
def test_thinner_ones_are_nan_at_the_triangle_alone(scheme, kind, size):
    points, triangles = with_thin_triangle(kind, size, seed=3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        H = qc.mean_curvature((points, triangles), scheme)
    missing = np.flatnonzero(np.isnan(H))
    assert set(missing) <= set(np.unique(triangles[-3:]))
    if size >= 1e-12:
        assert missing.size == 0
    elif size <= 1e-15 and scheme.name != "finite_volume":  # which looks across a triangle without area
        assert missing.size >= 3
    right = qc.mean_curvature(with_thin_triangle(kind, 1e-5, seed=3), scheme)
    assert np.nanmax(np.abs(H) * dual(points, triangles)) < 2 * np.nanmax(
        np.abs(right) * dual(points, triangles)
    )


def dual(points, triangles):
    return qc.dual_areas((points, triangles), "liu")


@pytest.mark.parametrize("kind", ["needle", "cap"])
@pytest.mark.parametrize("size", [1e-7, 1e-9, 1e-12, 1e-14, 1e-16, 0.0])
def test_compare_survives(kind, size):
    points, triangles = with_thin_triangle(kind, size)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = qc.compare((points, triangles), tuple(SCHEMES))
    assert all(np.isfinite(H).sum() >= len(points) - 4 for H in found.mean_curvature.values())


# ---- faces without area ---------------------------------------------------------------------------------


def plane_with_slivers(seed, scale, offset):
    """Squares of a plane turned in space; along the middle vertices of one side divide the other's edges.

    Triangles (a, m, b) over the middle m of (a, b) fill what is between.
    """
    n = 10
    place, points, faces = {}, [], []

    def vertex(x, y):
        if (x, y) not in place:
            place[x, y] = len(points)
            points.append((x, y, 0.0))
        return place[x, y]

    for i in range(n):
        for j in range(n):
            if j < n // 2:
                faces.append([vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)])
                continue
            for x in (i, i + 0.5):
                faces.append([vertex(x, j), vertex(x + 0.5, j), vertex(x + 0.5, j + 1), vertex(x, j + 1)])
        faces.append([vertex(i, n // 2), vertex(i + 0.5, n // 2), vertex(i + 1, n // 2)][::-1])
    return np.array(points) / n @ turn(seed) * scale + offset, faces, scale / n


@each_laplacian
@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("seed", range(3))
def test_slivers_of_a_turned_plane(scheme, seed, scale, offset):
    """Their area is what rounding makes of 0: NaN at their corners inside, right everywhere else."""
    points, faces, h = plane_with_slivers(seed, scale, offset)
    mesh = qc.QuadMesh(points, faces)
    inside = np.flatnonzero(mesh.stencils().closed)
    sliver = np.intersect1d(mesh.faces[mesh.faces[:, 3] < 0, :3], inside)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qc.PrecisionWarning)
        H = qc.mean_curvature(mesh, scheme)
    lost = np.isnan(qc.stiffness_matrix(mesh, scheme).sum(axis=1))
    assert np.array_equal(lost[inside], np.isnan(H[inside]))
    if scheme.name != "finite_volume":  # it looks across the slivers, and is right there
        assert np.isnan(H[sliver]).all()
    assert np.isfinite(H[np.setdiff1d(inside, sliver)]).all()
    assert np.nanmax(np.abs(H)) < 1e3 * 2.0**-52 * np.abs(points).max() / h**2


@each_laplacian
@pytest.mark.parametrize(("scale", "offset"), PLACES)
def test_a_quad_without_area(scheme, scale, offset):
    """Two corners of a quad moved to the middle between the other two, and a little beyond."""
    grid = surfaces.torus().sample((12, 10))[0]
    points = grid.points @ turn(5) * scale + offset
    points[4, 4], points[5, 5] = (2 * points[5, 4] + points[4, 5]) / 3, (points[5, 4] + 2 * points[4, 5]) / 3
    broken = qc.QuadGrid(points, grid.wrap)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qc.PrecisionWarning)
        on_grid = qc.mean_curvature(broken, scheme)
        on_faces = qc.mean_curvature(broken.to_mesh(), scheme).reshape(on_grid.shape)
        by_law = qc.mean_curvature(broken, replace(scheme, fast=None))
    assert np.array_equal(np.isnan(on_grid), np.isnan(on_faces))
    assert np.array_equal(np.isnan(on_grid), np.isnan(by_law))
    corners = {(4, 4), (5, 4), (5, 5), (4, 5)}
    missing = set(zip(*np.nonzero(np.isnan(on_grid)), strict=True))
    assert missing == corners or (missing < corners and scheme.name == "cotan-4")


def nan_by_path(mesh, scheme):
    """Which vertices have no curvature: on the grid, its face list, one that begins elsewhere, by the law."""
    by_law = replace(scheme, fast=None)
    faces, rolled = mesh.to_mesh(), np.roll(mesh.to_mesh().faces, 1, axis=1)
    found = [qc.mean_curvature(m, s, boundary="nan") for m in (mesh, faces) for s in (scheme, by_law)]
    found.append(qc.mean_curvature((faces.points, rolled), scheme, boundary="nan"))
    return [np.isnan(H.ravel()) for H in found]


def place(points, rng):
    """Points turned, of any size, near the origin or far from it."""
    offset = rng.choice([0, 0, 1, 10, 1e3, 1e5]) * rng.normal(size=3)
    return 10.0 ** rng.integers(-6, 7) * (points @ turn(rng.integers(1 << 30)) + offset)


@skew
@pytest.mark.parametrize("scheme", [s for s in LAPLACIANS.values() if s.fast], ids=lambda s: s.name)
@pytest.mark.parametrize("kind", ["line", "cap", "needle"])
def test_all_paths_agree_on_quads_at_the_threshold(scheme, kind, rng):
    """Quads whose area is within three parts in a hundred of what is taken for rounding."""
    grid, missing = surfaces.torus().sample((12, 10))[0], 0
    for seed in range(12):
        away = rng.normal(size=3)

        def points(size, seed=seed, away=away):
            x = grid.points.copy()
            if kind == "needle":
                x[4, 4], x[5, 4] = x[4, 5] + size * away, x[5, 5] + size * away
            else:
                x[4, 4] = (2 * x[5, 4] + x[4, 5]) / 3 + size * away
                part = 2 / 3 if kind == "line" else 0.4
                x[5, 5] = x[4, 4] * (1 - part) + part * x[4, 5]
            return place(x, np.random.default_rng(seed))

        def square(x):
            u, v = x[5, 5] - x[4, 4], x[4, 5] - x[5, 4]
            middle = (x[4, 4] + x[5, 5] + x[4, 5] + x[5, 4]) / 4
            return np.cross(u, v) @ np.cross(u, v) / vector.rounding(u @ u + v @ v, middle @ middle)

        least, most = 1e-17, 1e-1
        for _ in range(40):
            between = np.sqrt(least * most)
            least, most = (least, between) if square(points(between)) > 1 else (between, most)
        paths = nan_by_path(qc.QuadGrid(points(most * rng.uniform(0.97, 1.03)), grid.wrap), scheme)
        assert all(np.array_equal(path, paths[0]) for path in paths)
        missing += paths[0].any()
    assert 0 < missing < 12


@pytest.mark.filterwarnings("ignore::quadcurv.MeshWarning")  # sides of a fold coincide
@pytest.mark.parametrize("scheme", [s for s in LAPLACIANS.values() if s.fast], ids=lambda s: s.name)
def test_all_paths_agree_on_rings_at_the_threshold(scheme, rng):
    """A fold whose rings have an area like rounding; cells of a staggered grid as flat.

    The law adds up the area of a ring in another order: where it is rounding, the sum may be another, too.
    """
    x, y = np.meshgrid(np.arange(-4.0, 5), np.arange(9.0), indexing="ij")
    cells, missing, apart = surfaces.torus().sample((10, 12), "staggered")[0], 0, 0
    for _ in range(20):
        size = 10.0 ** rng.uniform(-15, -12)
        fold = np.stack((np.abs(x), y, 0 * x), axis=-1) + size * rng.normal(size=(*x.shape, 3))
        grid, law, faces, law_of_faces, rolled = nan_by_path(qc.QuadGrid(place(fold, rng)), scheme)
        assert np.array_equal(grid, faces)
        assert np.array_equal(grid, rolled)
        assert np.array_equal(law, law_of_faces)
        apart += np.count_nonzero(law != grid)
        missing += np.count_nonzero(grid)
        primal, dual = cells.primal.copy(), cells.dual.copy()
        dual[5, 5:7] = primal[[5, 4], 5] + size * rng.normal(size=(2, 3))
        both = place(np.concatenate((primal.reshape(-1, 3), dual.reshape(-1, 3))), rng)
        one, other = np.split(both, [primal.size // 3])
        moved = qc.StaggeredGrid(one.reshape(primal.shape), other.reshape(dual.shape), cells.wrap)
        found = [np.isnan(qc.mean_curvature(moved, s)) for s in (scheme, replace(scheme, fast=None))]
        assert np.array_equal(*found)
    assert 0 < missing < 20 * 81
    assert apart <= 1


@skew
@each_laplacian
@pytest.mark.parametrize(
    ("scale", "offset"), [(1.0, 0.0), (1e-6, 1e-6), (1e6, 1e6), (3.0, 3.0), (1.0, 100.0)]
)
def test_slivers_in_single_precision(scheme, scale, offset):
    """What single precision makes of no area is no area: NaN there, and elsewhere no more than it costs."""
    points, faces, h = plane_with_slivers(3, scale, offset)
    points = points.astype(np.float32)
    mesh = qc.QuadMesh(points, faces)
    inside = np.flatnonzero(mesh.stencils().closed)
    sliver = np.intersect1d(mesh.faces[mesh.faces[:, 3] < 0, :3], inside)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qc.PrecisionWarning)
        H = qc.mean_curvature(mesh, scheme)
    if scheme.name != "finite_volume":
        assert np.isnan(H[sliver]).all()
    assert np.isfinite(H[np.setdiff1d(inside, sliver)]).all()
    assert np.nanmax(np.abs(H)) < 10 * np.finfo(np.float32).eps * np.abs(points).max() / h**2


@each_laplacian
def test_half_a_face_without_area(scheme):
    """Squares of a plane, one corner of some in line with two others: no curvature, or none known there."""
    x, y = np.meshgrid(np.arange(8.0), np.arange(8.0), indexing="ij")
    points = np.stack((x, y, 0 * x), axis=-1)
    points[3, 3, :2] = 3.5, 3.5  # in the middle between (4, 3) and (3, 4)
    H = qc.mean_curvature(qc.QuadGrid(points @ turn(2)), scheme)
    missing = set(zip(*np.nonzero(np.isnan(H)), strict=True))
    assert missing <= {(3, 3), (4, 3), (4, 4), (3, 4)}
    assert np.nanmax(np.abs(H)) < 1e-12
    if scheme.name not in HALVES:
        assert not missing


# ---- rings without area ---------------------------------------------------------------------------------


@each_laplacian
@pytest.mark.parametrize("offset", [0.0, 1e3, 1e6])
def test_a_fold_has_no_normal(scheme, offset):
    """A sheet folded back on itself along a line: the rings there have no vector area, hence no side."""
    x, y = np.meshgrid(np.arange(-4.0, 5), np.arange(9.0), indexing="ij")
    points = np.stack((np.abs(x), y, 0 * x), axis=-1) @ turn(7) + offset
    for mesh in (qc.QuadGrid(points), qc.QuadGrid(points).to_mesh()):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", qc.MeshWarning)  # its sides coincide
            H = qc.mean_curvature(mesh, scheme).reshape(9, 9)
            normals = qc.vertex_normals(mesh).reshape(9, 9, 3)
        assert np.isnan(H[4, 1:-1]).all()
        assert np.isnan(normals[4, 1:-1]).all()
        assert np.isfinite(H[[2, 6], 2:-2]).all()


def test_angle_defect_beside_an_edge_without_length():
    """An angle there is anything; elsewhere at a triangle without area angles are known all the same."""
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    points = mesh.points.copy()
    a, b = mesh.faces[10, :2]
    points[b] = points[a]
    K = qc.gaussian_curvature((points, mesh.faces), "angle_defect")
    assert set(np.flatnonzero(np.isnan(K))) == {a, b}
    points, faces, _ = plane_with_slivers(0, 1.0, 0.0)
    mesh = qc.QuadMesh(points, faces)
    K = qc.gaussian_curvature(mesh, "angle_defect")
    assert np.isfinite(K[mesh.stencils().closed]).all()
    assert np.nanmax(np.abs(K)) < 1e-11


# ---- strips ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", ["quads", "triangles", "bent"])
def test_strips_of_faces_one_wide_tell_nothing_across(scheme, kind):
    """Two rows of a coarse mesh bend, and so determined a quadric: H was up to 2.7 of curvatures of 1."""
    points, wrap = surfaces.catenoid().sample((20, 20))[0].points, (False, True)
    if kind == "bent":  # a row, a column, and a wide part eight faces away
        hidden = np.ones((21, 20), bool)
        hidden[:2, :10] = hidden[:14, 8:10] = hidden[14:, 4:14] = False
        H = qc.mean_curvature(qc.QuadGrid(points, wrap, mask=hidden), scheme)
        assert np.isfinite(H[17:20, 5:13]).all()
        assert np.isnan(H[:2, :5]).all()
        assert np.isnan(H[4:11, 8:10]).all()
        return
    mesh = qc.QuadGrid(points[3:5], wrap).to_mesh()
    faces = mesh.faces
    if kind == "triangles":
        faces = np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]))
    assert np.isnan(qc.mean_curvature((mesh.points, faces), scheme)).all()
    assert np.isfinite(qc.mean_curvature(qc.QuadGrid(points[3:6], wrap), scheme)).all()


def test_fits_through_all_points_know_nothing_of_their_errors(rng):
    """A quartic through 14 neighbours leaves no residuals: in meshes full of holes H was up to 60, +-0.3."""
    surface = surfaces.catenoid()
    grid, u, v = surface.sample((20, 20))
    for _ in range(6):
        hidden = rng.random(grid.shape) < rng.uniform(0.2, 0.4)
        found = qc.curvatures(qc.QuadGrid(grid.points, grid.wrap, mask=hidden))
        error = np.abs(found.mean - surface.mean_curvature(u, v))
        known = np.isfinite(error)
        assert (error[known] < np.maximum(2.0, 2 * found.interval.mean[known])).all()


@each_laplacian
@pytest.mark.parametrize(("offset", "is_missing"), [(0.0, False), (900.0, True)])
def test_slivers_of_grids_in_single_precision(scheme, offset, is_missing):
    """A narrow row has an area in single precision near the origin and none farther away, on every path."""
    x, y = np.meshgrid(np.linspace(0, 1, 12), np.linspace(0, 1, 12), indexing="ij")
    points = np.stack((x, y, 0.2 * np.sin(3 * x) + 0.1 * y * y), axis=-1).astype(np.float32)
    points[5] = points[6] - np.float32((1e-4, 0, 0))
    points[..., 0] += np.float32(offset)
    grid, double = qc.QuadGrid(points), qc.QuadGrid(points.astype(np.float64))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qc.PrecisionWarning)
        found = [qc.mean_curvature(mesh, scheme).reshape(12, 12) for mesh in (grid, grid.to_mesh(), double)]
    for H in found[:2]:
        assert np.isnan(H[5, 3:-3]).all() == np.isnan(H[6, 3:-3]).all() == is_missing
    one, other = (H[2:-2, 2:-2] for H in found[::2])
    assert np.isfinite(other).all()
    assert np.array_equal(one[np.isfinite(one)], other[np.isfinite(one)])
