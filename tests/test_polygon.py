"""Polygon Laplacians: what their papers promise, and second order where faces are regular."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import trimesh

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import alexa_wardetzky, bunge, de_goes
from quadcurv.schemes.assembly import MOST_SIDES

POLYGON = ["bunge", "de_goes", "alexa_wardetzky"]
each = pytest.mark.parametrize("scheme", POLYGON)


@pytest.fixture
def skew():
    """A noisy ellipsoid: no quad is planar."""
    mesh = surfaces.cubed_ellipsoid().sample((6, 6), "faces")[0]
    return mesh.with_points(mesh.points + np.random.default_rng(4).normal(0, 0.03, mesh.points.shape))


@each
def test_reduces_to_cotan_on_triangles(skew, scheme):
    faces = skew.faces.astype(np.int64)
    triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]]))
    S = qc.stiffness_matrix((skew.points, triangles), scheme)
    assert abs(S + igl.cotmatrix(skew.points, triangles)).max() < 1e-12


@each
def test_symmetric_positive_semidefinite_with_constants_alone_in_the_null_space(skew, scheme):
    S = qc.stiffness_matrix(skew, scheme)
    assert abs(S - S.T).max() < 1e-13 * abs(S).max()
    values = np.linalg.eigvalsh(S.toarray())
    assert abs(values[0]) < 1e-12
    assert values[1] > 1e-2


@each
def test_linear_precision_on_any_planar_mesh(scheme):
    """S u = 0 inside for linear u, on quads without any symmetry and triangles among them."""
    rng = np.random.default_rng(6)
    mesh = surfaces.plane().sample((9, 7))[0].to_mesh()
    moved = mesh.points + np.c_[rng.uniform(-0.05, 0.05, (len(mesh.points), 2)), np.zeros(len(mesh.points))]
    quads = mesh.faces.tolist()
    faces = quads[:30] + [t for a, b, c, d in quads[30:] for t in ((a, b, c), (c, d, a))]
    planar = qc.QuadMesh(moved, faces)
    inside = planar.stencils().closed
    u = 2 + 3 * moved[:, 0] - 5 * moved[:, 1]
    assert inside.sum() == 48
    assert np.abs(qc.stiffness_matrix(planar, scheme) @ u)[inside].max() < 1e-12
    assert np.abs(qc.stiffness_matrix(planar, scheme) @ u)[~inside].max() > 0.1


@each
def test_dirichlet_energy_of_planar_polygons(scheme):
    """u^T S u = |grad u|^2 area for linear u, boundary included."""
    mesh = surfaces.plane().sample((6, 5))[0].to_mesh()
    x, y, _ = mesh.points.T
    bent = mesh.with_points(np.stack((x + 0.2 * y * x, y + 0.1 * x * y * y, 0 * x), axis=1))
    area = qc.dual_areas(bent, "liu").sum()
    u = 3 * bent.points[:, 0] - 4 * bent.points[:, 1]
    S = qc.stiffness_matrix(bent, scheme)
    assert u @ S @ u == pytest.approx(25 * area, rel=1e-12)
    assert qc.dual_areas(bent, scheme).sum() == pytest.approx(area, rel=1e-12)


def test_bunge_is_libigl(skew):
    corners = skew.faces.astype(np.int64)
    L, M, _ = igl.cotmatrix(skew.points, corners.ravel(), np.arange(0, corners.size + 1, 4))
    # libigl solves for the weights by normal equations, which costs digits where quads are nearly planar.
    assert abs(qc.stiffness_matrix(skew, "bunge") + L).max() < 1e-10
    assert np.abs(qc.dual_areas(skew, "bunge") - np.asarray(M.sum(axis=1)).ravel()).max() < 1e-11


def polygon_literally(x, scheme, weight):
    """Papers' matrices for one polygon, written with explicit loops and a null space by SVD."""
    k = len(x)
    edge = np.array([x[(i + 1) % k] - x[i] for i in range(k)])
    middle = np.array([(x[(i + 1) % k] + x[i]) / 2 for i in range(k)])
    vector = sum(np.cross(x[i], x[(i + 1) % k]) for i in range(k)) / 2
    area = np.linalg.norm(vector)
    n = vector / area
    d = np.roll(np.eye(k), 1, axis=1) - np.eye(k)
    if scheme == "alexa_wardetzky":
        flat = edge - np.outer(edge @ n, n)
        _, s, vt = np.linalg.svd(flat.T)
        null = vt[np.sum(s > 1e-10) :].T
        M = middle @ middle.T / area + weight * null @ null.T
    else:
        bracket = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        V = edge @ (np.eye(3) - np.outer(n, n))
        U = bracket @ (middle.T - x.mean(axis=0)[:, None]) / area
        P = np.eye(k) - V @ U
        M = area * U.T @ U + weight * P.T @ P
    return d.T @ M @ d


@pytest.mark.parametrize("weight", [1.0, 0.3])
@pytest.mark.parametrize("factory", [de_goes, alexa_wardetzky])
def test_published_matrices(skew, factory, weight):
    scheme = factory(weight)
    expected = np.zeros((len(skew.points),) * 2)
    for face in skew.faces:
        expected[np.ix_(face, face)] += polygon_literally(skew.points[face], scheme.name, weight)
    assert np.abs(qc.stiffness_matrix(skew, scheme).toarray() - expected).max() < 1e-12


@each
@pytest.mark.parametrize(
    ("name", "bound"), [("torus", 4e-4), ("elliptic_paraboloid", 1.4e-3), ("catenoid", 1e-3)]
)
def test_second_order_on_smooth_grids(scheme, name, bound):
    surface = surfaces.SURFACES[name]()
    errors = []
    for n in (32, 64, 128):
        grid, xi, eta = surface.sample((n, n))
        errors.append(np.abs(qc.mean_curvature(grid, scheme) - surface.mean_curvature(xi, eta)).max())
    assert errors[-1] < bound
    # Mixed Voronoi areas jump where triangles turn obtuse, as those of a slanted grid do.
    slanted = (scheme, name) == ("bunge", "elliptic_paraboloid")
    assert fitted_rate((32, 64, 128), errors) > (1.7 if slanted else 1.9)


def test_only_bunge_converges_at_extraordinary_vertices():
    """Inf-norm on the cubed ellipsoid: the others' areas are wrong at its corners."""
    surface = surfaces.cubed_ellipsoid()
    found = {}
    for n in (8, 16, 32):
        mesh, xi, eta = surface.sample((n, n), "faces")
        for scheme in POLYGON:
            found.setdefault(scheme, []).append(
                np.abs(qc.mean_curvature(mesh, scheme) - surface.mean_curvature(xi, eta)).max()
            )
    assert found["bunge"][-1] < 6e-3
    assert fitted_rate((8, 16, 32), found["bunge"]) > 1.5
    assert min(found["de_goes"]) > 0.5
    assert min(found["alexa_wardetzky"]) > 0.5


@each
def test_face_without_area_is_nan_at_its_corners_alone(scheme):
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    face = mesh.faces[10]
    points = mesh.points.copy()
    points[face[1]] = points[face[3]] = points[face[0]]
    missing = np.flatnonzero(np.isnan(qc.mean_curvature((points, mesh.faces), scheme)))
    assert set(face) <= set(missing)
    touched = np.unique(mesh.faces[np.isin(mesh.faces, face).any(axis=1)])
    assert set(missing) <= set(touched)


# ---- more than four sides ----------------------------------------------------------------------------------


def dual_of_an_icosphere(subdivisions):
    """Points on the unit sphere, and one pentagon or hexagon around each vertex of the icosphere."""
    ball = trimesh.creation.icosphere(subdivisions)
    corners = np.asarray(ball.vertices)[ball.faces].mean(axis=1)
    beside = {}
    for f, (a, b, c) in enumerate(ball.faces.tolist()):
        beside |= {(a, b): (f, c), (b, c): (f, a), (c, a): (f, b)}
    polygons = {}
    for start, end in beside:
        if start not in polygons:
            polygons[start], turn = [], end
            while not polygons[start] or turn != end:
                face, turn = beside[start, turn]
                polygons[start].append(face)
    return corners / np.linalg.norm(corners, axis=1, keepdims=True), list(polygons.values())


@each
def test_hexagons_of_a_sphere(scheme):
    points, polygons = dual_of_an_icosphere(3)
    H = qc.mean_curvature((points, polygons), scheme)
    assert np.abs(H - 1).max() < (1e-3 if scheme == "bunge" else 0.06)
    assert qc.dual_areas((points, polygons), scheme).sum() == pytest.approx(4 * np.pi, rel=0.01)


@each
def test_a_dodecahedron_has_the_curvature_of_its_sphere(scheme):
    """By symmetry the curvature normal is radial, and its size is flux over area of any one vertex."""
    points, polygons = dual_of_an_icosphere(0)
    assert {len(p) for p in polygons} == {5}
    H = qc.mean_curvature((points, polygons), scheme)
    assert np.ptp(H) < 1e-12
    assert H[0] == pytest.approx(1, abs=0.01)


@pytest.fixture
def bent():
    """Hexagons, pentagons and quads, none of them planar, and triangles."""
    points, polygons = dual_of_an_icosphere(1)
    moved = points * np.array([1.0, 1.3, 0.8]) + np.random.default_rng(2).normal(0, 0.03, points.shape)
    cut = [part for p in polygons[:20] for part in (p[:4], [*p[3:], p[0]])]
    return qc.QuadMesh(moved, cut + polygons[20:])


def faces_of(mesh):
    """Faces as given, those of more than four sides last."""
    whole = mesh.stencils().polygons
    small = mesh.faces[whole.face < 0].tolist()
    return [[v for v in f if v >= 0] for f in small] + [
        f.tolist() for f in np.split(whole.corners, whole.indptr[1:-1])
    ]


@pytest.mark.parametrize("factory", [de_goes, alexa_wardetzky])
def test_published_matrices_of_polygons(bent, factory):
    scheme, x = factory(), bent.points
    assert {len(face) for face in faces_of(bent)} == {3, 4, 5, 6}
    expected = np.zeros((len(x), len(x)))
    for face in faces_of(bent):
        expected[np.ix_(face, face)] += polygon_literally(x[face], scheme.name, 1.0)
    assert np.abs(qc.stiffness_matrix(bent, scheme).toarray() - expected).max() < 1e-12


def test_bunge_on_polygons_is_libigl(bent):
    faces = faces_of(bent)
    ends = np.cumsum([0, *map(len, faces)])
    L, M, _ = igl.cotmatrix(np.array(bent.points), np.concatenate(faces).astype(np.int64), ends)
    assert abs(qc.stiffness_matrix(bent, "bunge") + L).max() < 1e-10
    assert np.abs(qc.dual_areas(bent, "bunge") - np.asarray(M.sum(axis=1)).ravel()).max() < 1e-10


@each
@pytest.mark.parametrize(
    "flat",
    [
        [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)],
        [(0, 0), (3, 0), (3, 3), (2, 3), (2, 1), (1, 1), (1, 3), (0, 3)],
    ],
)
def test_linear_precision_of_concave_polygons(scheme, flat):
    """L and U: rows of S x are the flux through the two edges of each corner."""
    points = np.column_stack((flat, np.zeros(len(flat))))
    S = qc.stiffness_matrix((points, [range(len(flat))]), scheme)
    across = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    expected = np.column_stack((across[:, 1], -across[:, 0])) / 2
    assert np.abs(S @ points[:, :2] - expected).max() < 1e-13
    assert np.linalg.eigvalsh(S.toarray())[0] > -1e-13


@each
@pytest.mark.parametrize("sides", [MOST_SIDES, MOST_SIDES + 1, 5_000])
def test_polygons_of_very_many_sides_are_cut(scheme, sides):
    angle = 2 * np.pi * np.arange(sides) / sides
    points = np.column_stack((np.cos(angle), np.sin(angle), np.zeros(sides)))
    S = qc.stiffness_matrix((points, [range(sides)]), scheme)
    assert (S.nnz == sides**2) == (sides == MOST_SIDES)
    u = points[:, 0]
    assert u @ S @ u == pytest.approx(np.pi, rel=1e-3)


def test_rejections():
    for factory in (de_goes, alexa_wardetzky):
        for wrong in (-1.0, np.nan):
            with pytest.raises(ValueError, match="stabilisation: expected a number, not negative"):
                factory(wrong)
    assert [f().order for f in (bunge, de_goes, alexa_wardetzky)] == [2, 2, 2]
