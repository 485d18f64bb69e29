"""What every scheme promises, read off the registry: there is no list to keep when one is added."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import SCHEMES, Fit, Laplacian, SchemeName, as_scheme

LAPLACIANS = {name: scheme for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)}
each = pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
each_laplacian = pytest.mark.parametrize("scheme", LAPLACIANS.values(), ids=LAPLACIANS)


# ---- order of convergence -------------------------------------------------------------------------------

# Smooth surfaces with quads neither square nor planar; polynomials are exact to order eight.
SURFACES = {8: ("hyperboloid", "catenoid")}
GRAPHS = ("elliptic_paraboloid", "hyperbolic_paraboloid")
SIZES = {8: (12, 16, 24, 32)}
BOUND = {0: 0.5, 2: 1.3e-4, 4: 3e-6, 6: 1e-8, 8: 1e-8}  # of the mean error on the finest grid, by order


@cache
def mean_errors(name, surface, sizes):
    errors = []
    for n in sizes:
        grid, xi, eta = surfaces.SURFACES[surface]().sample((n, n))
        errors.append(
            np.abs(
                qc.mean_curvature(grid, name) - surfaces.SURFACES[surface]().mean_curvature(xi, eta)
            ).mean()
        )
    return errors


def converges(scheme, number, order):
    """Whether the errors of a scheme fall by an order, on the surfaces of its own one."""
    sizes, surface = SIZES.get(scheme.order, (32, 64, 128)), SURFACES.get(scheme.order, GRAPHS)[number]
    errors = mean_errors(scheme.name, surface, sizes)
    return abs(fitted_rate(sizes, errors) - order) < 0.15 and errors[-1] < BOUND[order]


@each
@pytest.mark.parametrize("number", range(2))
def test_declared_order(scheme, number):
    assert converges(scheme, number, scheme.order)


@each
def test_any_other_order_would_fail(scheme):
    for order in {0, 2, 4, 6, 8} - {scheme.order}:
        assert not any(converges(scheme, number, order) for number in range(2))


# ---- the registry ---------------------------------------------------------------------------------------


@each
def test_found_by_its_name_and_says_where_it_is_from(scheme):
    assert as_scheme(scheme.name) is scheme is as_scheme(scheme)
    assert scheme.reference
    assert hash(scheme) == hash(replace(scheme))


def test_names_for_completion_are_those_of_the_registry():
    assert set(get_args(SchemeName)) == {*SCHEMES, "angle_defect"}


# ---- planes ---------------------------------------------------------------------------------------------


def turned(points, seed=1):
    return points @ Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T


def planar(kind):
    """Positions in the plane z = 0 and faces without any symmetry; "mixed": triangles and hexagons too."""
    points = surfaces.plane().sample((9, 7))[0].points.copy()
    points[1:-1, 1:-1, :2] += np.random.default_rng(6).uniform(-0.05, 0.05, (8, 6, 2))
    quads = qc.QuadGrid(points).to_mesh().faces.reshape(9, 7, 4)
    faces = quads.reshape(-1, 4).tolist()
    if kind == "mixed":
        triangles = [t for a, b, c, d in quads[3:6].reshape(-1, 4).tolist() for t in ((a, b, c), (c, d, a))]
        pairs = np.concatenate((quads[6:, 0:6:2, [0, 1]], quads[6:, 1:6:2][..., [1, 2, 3, 0]]), axis=2)
        faces = [*quads[:3].reshape(-1, 4).tolist(), *triangles]
        faces += [*pairs[..., [0, 1, 2, 3, 4, 5]].reshape(-1, 6).tolist(), *quads[6:, 6].tolist()]
    return points.reshape(-1, 3), faces


@each
@pytest.mark.parametrize("kind", ["quads", "mixed"])
def test_planes_have_no_curvature(scheme, kind):
    points, faces = planar(kind)
    H = qc.mean_curvature((turned(points), faces), scheme)
    assert np.isfinite(H).sum() >= 48
    assert np.nanmax(np.abs(H)) < 1e-9


@each_laplacian
@pytest.mark.parametrize("kind", ["quads", "mixed"])
def test_linear_precision(scheme, kind):
    """S u = 0 inside for linear u, whatever the faces; at the border it is the flux through it."""
    points, faces = planar(kind)
    mesh = qc.QuadMesh(turned(points), faces)
    S = qc.stiffness_matrix(mesh, scheme)
    inside = mesh.stencils().closed
    assert inside.sum() == 48
    for u in (np.ones(len(points)), points[:, 0], 2 + 3 * points[:, 0] - 5 * points[:, 1]):
        assert np.abs(S @ u)[inside].max() < 1e-12
    assert np.abs(S @ u)[~inside].max() > 0.1


@each_laplacian
def test_areas_add_up_to_the_area(scheme):
    """Those of schemes whose vertices share one matrix: others count each triangle more or less than once."""
    points, faces = planar("quads")
    areas = qc.dual_areas((turned(points), faces), scheme)
    assert (areas > 0).all()
    assert (abs(areas.sum() - 4) < 1e-12) == scheme.symmetric


# ---- matrices -------------------------------------------------------------------------------------------


def noisy(n=4, size=0.02):
    """A closed ellipsoid of quads none of which is planar, valences 3 and 4."""
    mesh = surfaces.cubed_ellipsoid().sample((n, n), "faces")[0]
    return mesh.with_points(mesh.points + np.random.default_rng(4).normal(0, size, mesh.points.shape))


@each_laplacian
def test_matrix_on_quads(scheme):
    """Rows sum to zero; as symmetric as declared; the null space is the constants, and what is declared."""
    S = qc.stiffness_matrix(noisy(), scheme).toarray()
    size = np.abs(S).max()
    assert np.abs(S.sum(axis=1)).max() < 1e-13 * size
    assert (np.abs(S - S.T).max() < 1e-13 * size) == scheme.symmetric
    assert (np.linalg.svd(S, compute_uv=False) < 1e-9 * size).sum() == 1 + scheme.checkerboard
    if scheme.symmetric:
        assert np.linalg.eigvalsh(S)[0] > -1e-12 * size


@each_laplacian
def test_checkerboard(scheme):
    """On a torus of even size; one of odd size has none."""
    for shape, null in (((12, 10), 1 + scheme.checkerboard), ((11, 9), 1)):
        S = qc.stiffness_matrix(surfaces.torus().sample(shape)[0], scheme).toarray()
        assert (np.linalg.svd(S, compute_uv=False) < 1e-9 * np.abs(S).max()).sum() == null
        board = np.where(np.indices(shape).sum(axis=0) % 2, 1.0, -1.0).ravel()
        assert (np.abs(S @ board).max() < 1e-12) == (null == 2)


@each_laplacian
@pytest.mark.parametrize("kind", ["torus", "mixed"])
def test_matrices_give_the_curvature_normal(request, kind, scheme):
    mesh = request.getfixturevalue(kind)
    S, M = qc.stiffness_matrix(mesh, scheme), qc.mass_matrix(mesh, scheme)
    x = mesh.stencils().points
    Hn = qc.mean_curvature_normal(mesh, scheme).reshape(-1, 3)
    assert relative(-(S @ x) / (2 * M.diagonal()[:, None]), Hn) < 1e-11
    assert np.abs(S.sum(axis=1)).max() < 1e-11 * abs(S).max()
    assert np.array_equal(M.diagonal(), qc.dual_areas(mesh, scheme).ravel())
    assert S.has_sorted_indices
    assert S.has_canonical_format


def relative(value, expected):
    return np.abs(value - expected).max() / np.abs(expected).max()


@each_laplacian
def test_the_law_is_all_a_driver_needs(scheme, mixed):
    """`flux` and `fast` are shortcuts: without them the same comes out."""
    law = replace(scheme, flux=None, fast=None)
    assert relative(qc.mean_curvature_normal(mixed, law), qc.mean_curvature_normal(mixed, scheme)) < 1e-11
    assert relative(qc.dual_areas(mixed, law), qc.dual_areas(mixed, scheme)) < 1e-12


# ---- what must not matter -------------------------------------------------------------------------------


@each
@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 2**31),
    shift=st.tuples(*[st.floats(-10, 10)] * 3),
    scale=st.floats(1e-3, 1e3),
)
def test_rigid_motion_scaling_flip_and_renumbering(scheme, seed, shift, scale):
    mesh = surfaces.cubed_ellipsoid().sample((3, 3), "faces")[0]
    rng = np.random.default_rng(seed)
    points = mesh.points + rng.normal(0, 0.01, mesh.points.shape)
    H = qc.mean_curvature((points, mesh.faces), scheme)
    assert np.isfinite(H).all()

    def same(faces, positions=points, expected=H):
        # Schemes that look at how a quad differs from a planar one are no more exact than this.
        found = qc.mean_curvature((positions, faces), scheme)
        return np.abs(found - expected).max() < 1e-8 * np.abs(expected).max()

    assert same(mesh.faces, points @ Rotation.random(rng=rng).as_matrix().T + shift)
    assert same(mesh.faces, points * scale, H / scale)
    assert same(mesh.faces[:, [0, 3, 2, 1]], points, -H)
    order = rng.permutation(len(points))
    number = np.argsort(order)
    assert same(number[mesh.faces][rng.permutation(len(mesh.faces))], points[order], H[order])


@each
@pytest.mark.parametrize("wrap", [(True, True), (True, False), (False, True), (False, False)])
def test_grid_and_face_list_agree(torus, scheme, wrap):
    grid = qc.QuadGrid(torus.points, wrap)
    on_grid = qc.mean_curvature(grid, scheme, boundary="nan")
    on_faces = qc.mean_curvature(grid.to_mesh(), scheme, boundary="nan")
    assert np.array_equal(np.isnan(on_grid).ravel(), np.isnan(on_faces))
    known = np.isfinite(on_faces)
    assert known.sum() >= 12 * 9
    assert relative(on_grid.ravel()[known], on_faces[known]) < 1e-11


@each_laplacian
def test_staggered_grid_is_its_diamonds(scheme):
    grid = surfaces.torus().sample((10, 12), "staggered")[0]
    stencils = grid.stencils()
    H = qc.mean_curvature(grid, scheme).ravel()
    mesh = qc.QuadMesh(stencils.points, stencils.faces)
    faces = qc.mean_curvature(mesh, scheme, boundary="nan")[: stencils.n]
    assert relative(H, faces) < 1e-12


@each
@pytest.mark.parametrize("kind", ["torus", "mixed"])
def test_an_offset_costs_no_digits(request, kind, scheme):
    """A million away, of positions that are the same numbers there."""
    mesh = request.getfixturevalue(kind)
    far = mesh.points + 1e6
    make = (lambda x: qc.QuadGrid(x, mesh.wrap)) if kind == "torus" else mesh.with_points
    near, away = (qc.mean_curvature(make(x), scheme) for x in (far - 1e6, far))
    assert np.abs(away - near).max() < 1e-10 * np.abs(near).max()


# ---- sign and missing answers ---------------------------------------------------------------------------


@each
def test_sign_is_positive_on_a_sphere_oriented_outward(scheme):
    mesh = surfaces.cubed_sphere(2.0).sample((6, 6), "faces")[0]
    H = qc.mean_curvature(mesh, scheme)
    assert (H > 0).all()
    inward = qc.mean_curvature_normal(mesh, scheme)
    assert (np.einsum("ix,ix->i", inward, mesh.points) < 0).all()


@each
def test_minimal_surfaces_have_finite_signed_curvature(scheme):
    """n comes from the vector area: nothing is divided by |H| = 0."""
    grid = surfaces.helicoid().sample((8, 20))[0]
    assert np.isfinite(qc.mean_curvature(grid, scheme)).all()


@each
def test_missing_answers_are_nan_at_that_vertex_alone(scheme):
    mesh = surfaces.cubed_sphere().sample((3, 3), "faces")[0]
    points = np.vstack((mesh.points, [(5.0, 5.0, 5.0)]))
    H = qc.mean_curvature((points, mesh.faces), scheme)
    assert np.flatnonzero(np.isnan(H)).tolist() == [len(points) - 1]


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
def test_fits_have_all_curvatures_and_laplacians_matrices(scheme, torus):
    if isinstance(scheme, Fit):
        assert np.isfinite(qc.gaussian_curvature(torus, scheme)).all()
        with pytest.raises(ValueError, match=f"{scheme.name} is a fit"):
            qc.stiffness_matrix(torus, scheme)
    else:
        assert qc.stiffness_matrix(torus, scheme).shape == (154, 154)
        with pytest.raises(ValueError, match=f"{scheme.name} gives the mean curvature alone"):
            qc.gaussian_curvature(torus, scheme)


# ---- polygons -------------------------------------------------------------------------------------------


@each_laplacian
def test_polygons_are_kept_by_those_that_say_so(scheme):
    points, faces = planar("mixed")
    mesh = qc.QuadMesh(points, faces)
    whole, cut = (qc.stiffness_matrix(m, scheme) for m in (mesh, qc.QuadMesh(points, mesh.faces)))
    assert (abs(whole - cut).max() > 1e-3) == scheme.polygons
