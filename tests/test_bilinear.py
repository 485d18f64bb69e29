"""The bilinear element: its quadrature written out, spectra, quads that fold."""

from __future__ import annotations

import igl
import numpy as np
import pytest
import scipy

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.schemes import bilinear

CORNERS = [(-1, -1), (1, -1), (1, 1), (-1, 1)]


def element(x, points, weights):
    """Stiffness and row sums of the mass of one quad by quadrature on [-1, 1] x [-1, 1]."""
    K, mass = np.zeros((4, 4)), np.zeros(4)
    for a, wa in zip(points, weights, strict=True):
        for b, wb in zip(points, weights, strict=True):
            N = np.array([(1 + a * s) * (1 + b * t) / 4 for s, t in CORNERS])
            dN = np.array([[s * (1 + b * t) / 4, t * (1 + a * s) / 4] for s, t in CORNERS])
            J = dN.T @ x  # tangents, one a row
            area = np.sqrt(np.linalg.det(J @ J.T))
            gradient = np.linalg.inv(J @ J.T) @ dN.T
            K += wa * wb * area * gradient.T @ (J @ J.T) @ gradient
            mass += wa * wb * area * N
    return K, mass


@pytest.fixture
def quads():
    """Corners of convex quads that are not planar."""
    square = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)
    return square + np.random.default_rng(8).uniform(-0.2, 0.2, (50, 4, 3))


@pytest.mark.parametrize(("points", "local"), [(2, bilinear.local), (1, None)])
def test_quadrature(quads, points, local):
    """Two points a direction are the bilinear element, a single one is Liu's formula."""
    for x in quads:
        K, mass = element(x, *np.polynomial.legendre.leggauss(points))
        if local is not None:
            found, parts = (a[0] for a in local(x[None], 1.0))
        else:
            found = qc.stiffness_matrix((x, [[0, 1, 2, 3]]), "liu").toarray()
            parts = qc.dual_areas((x, [[0, 1, 2, 3]]), "liu")
        assert np.abs(found - K).max() < 3e-15 * max(1, np.abs(K).max())
        assert np.abs(parts - mass).max() < 3e-16


def lowest(mesh, scheme, number):
    """Eigenvalues of S u = lambda M u."""
    S, M = qc.stiffness_matrix(mesh, scheme), qc.mass_matrix(mesh, scheme)
    return np.sort(scipy.sparse.linalg.eigsh(S, number, M.tocsc(), sigma=-0.5, return_eigenvectors=False))


def test_spectrum_of_the_sphere_without_checkerboard():
    """l (l + 1), 2 l + 1 times; Liu's one point sees each twice, alternating from vertex to vertex."""
    sphere = surfaces.cubed_sphere().sample((24, 24), "faces")[0]
    values = lowest(sphere, "bilinear", 9)
    assert abs(values[0]) < 1e-9
    assert values[1:4] == pytest.approx(2, rel=2e-3)
    assert values[4:9] == pytest.approx(6, rel=5e-3)
    values = lowest(sphere, "liu", 8)
    assert np.abs(values[:2]).max() < 1e-9
    assert values[2:5] == pytest.approx(2, rel=2e-2)
    assert values[5:8] == pytest.approx(2, rel=2e-3)


def test_triangles_are_linear_elements():
    mesh = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]
    faces = mesh.faces.astype(np.int64)
    triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]]))
    points = np.array(mesh.points)
    assert (
        abs(qc.stiffness_matrix((points, triangles), "bilinear") + igl.cotmatrix(points, triangles)).max()
        < 1e-13
    )
    mass = igl.massmatrix(points, triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC).diagonal()
    assert np.abs(qc.dual_areas((points, triangles), "bilinear") - mass).max() < 1e-14


@pytest.mark.parametrize("start", range(4))
def test_a_quad_that_folds_is_two_triangles(start):
    """An arrow: the bilinear map turns over beside the corner that points inward, (0.3, 0.3)."""
    points = np.array([(0, 0, 0), (1, 0, 0), (0.3, 0.3, 0), (0, 1, 0)], float)
    quad = np.roll(np.arange(4), start)
    S = qc.stiffness_matrix((points, [quad]), "bilinear").toarray()
    areas = qc.dual_areas((points, [quad]), "bilinear")
    triangles = [[0, 1, 2], [0, 2, 3]]
    assert np.abs(S - qc.stiffness_matrix((points, triangles), "bilinear").toarray()).max() < 1e-15
    assert areas == pytest.approx(qc.dual_areas((points, triangles), "bilinear"), rel=1e-15)
    assert areas.sum() == pytest.approx(0.3)


def test_planes_of_folded_quads():
    """Arrows and kites by turns: linear precision, positive areas, no negative eigenvalue."""
    grid = surfaces.plane().sample((8, 8))[0]
    points = grid.points.copy()
    points[2:-1:2, 2:-1:2, :2] += 0.19
    mesh = qc.QuadGrid(points).to_mesh()
    inside = mesh.stencils().closed
    S = qc.stiffness_matrix(mesh, "bilinear")
    assert (bilinear.local(mesh.points[mesh.faces], 1.0)[1] > 0).all()
    for u in mesh.points.T[:2]:
        assert np.abs(S @ u)[inside].max() < 1e-12
    assert np.linalg.eigvalsh(S.toarray())[0] > -1e-12
    assert qc.dual_areas(mesh, "bilinear").sum() == pytest.approx(4, rel=1e-12)
