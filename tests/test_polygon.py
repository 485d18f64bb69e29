"""Polygon Laplacians: what their papers promise, and second order where faces are regular."""

from __future__ import annotations

import igl
import numpy as np
import pytest

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import alexa_wardetzky, bunge, de_goes

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


def quad_literally(x, scheme, weight):
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
        expected[np.ix_(face, face)] += quad_literally(skew.points[face], scheme.name, weight)
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


def test_rejections():
    for factory in (de_goes, alexa_wardetzky):
        for wrong in (-1.0, np.nan):
            with pytest.raises(ValueError, match="stabilisation: expected a number, not negative"):
                factory(wrong)
    assert [f().order for f in (bunge, de_goes, alexa_wardetzky)] == [2, 2, 2]
