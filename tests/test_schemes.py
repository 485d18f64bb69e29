"""The formulas against their sources, libigl and exact cases; what holds of all is in test_registry.py."""

from __future__ import annotations

import igl
import numpy as np
import pytest

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.schemes import SCHEMES, as_scheme, cotan
from quadcurv.schemes.cotan import AREAS


def relative(value, expected):
    return np.abs(value - expected).max() / np.abs(expected).max()


# ---- the literal formulas -------------------------------------------------------------------------


def finite_volume_literally(c, ring):
    """Thesis, eq. 3.24-3.34 with its slips mended; ring = [(a, d, b), ...] around c."""
    total, polygon = np.zeros(3), []
    for a, d, b in ring:
        t1, t2 = d - c, b - a
        metric = np.array([[t1 @ t1, t1 @ t2], [t1 @ t2, t2 @ t2]])
        inverse = np.array([[metric[1, 1], -metric[0, 1]], [-metric[0, 1], metric[0, 0]]]) / np.linalg.det(
            metric
        )
        conjugate = inverse[0, 0] * t1 + inverse[0, 1] * t2
        total += conjugate / np.linalg.norm(conjugate) * np.linalg.norm(t2)
        polygon.append(a)
    c00, c10, opposite, c01 = polygon
    e01, e10, e11 = c01 - c00, c10 - c00, opposite - c10 - c01 + c00
    area = np.linalg.norm(np.cross(e01 + e11 / 2, e10 + e11 / 2))
    return total / (2 * area)


def liu_literally(c, ring):
    """Thesis, eq. 4.4-4.7: p_j = a, p_j' = d, p_(j+1) = b."""
    total, area = np.zeros(3), 0.0
    for a, d, b in ring:
        S_u = (b - c) / 2 + (d - a) / 2
        S_v = (a - c) / 2 + (d - b) / 2
        A = np.sqrt(S_v @ S_v * (S_u @ S_u) - (S_u @ S_v) ** 2)
        alpha = (S_u @ S_u - S_v @ S_v) / (4 * A)
        gamma = (S_u - S_v) @ (S_u - S_v) / (4 * A)
        total += alpha * (a - c) - alpha * (b - c) + gamma * (d - c)
        area += A
    return 2 * total / area


def rings(mesh):
    table = mesh.stencils().corner_table
    x = mesh.stencils().points
    for c in range(len(table.indptr) - 1):
        k = slice(table.indptr[c], table.indptr[c + 1])
        yield x[c], list(zip(x[table.next[k]], x[table.diagonal[k]], x[table.previous[k]], strict=True))


@pytest.mark.parametrize(
    ("scheme", "literally"), [("finite_volume", finite_volume_literally), ("liu", liu_literally)]
)
def test_source_formula_on_noisy_quads(torus, scheme, literally):
    expected = np.array([literally(c, ring) for c, ring in rings(torus)])
    Hn = qc.mean_curvature_normal(torus, scheme).reshape(-1, 3)
    assert relative(Hn, expected) < 1e-12


def test_finite_volume_and_liu_are_one_flux_over_two_areas(torus):
    stencils = torus.stencils()
    fluxes = [SCHEMES[s].flux(stencils)[0] for s in ("finite_volume", "liu")]
    assert relative(*fluxes) < 1e-14
    assert abs(qc.stiffness_matrix(torus, "finite_volume") - qc.stiffness_matrix(torus, "liu")).max() == 0
    quad_area, ring_area = qc.dual_areas(torus, "liu"), qc.dual_areas(torus, "finite_volume")
    assert relative(ring_area, quad_area) > 1e-3


def cotan_literally(points, triangles, area):
    """Thesis, eq. 4.3, on each vertex's own triangles."""
    L, M = igl.cotmatrix(points, triangles), igl.massmatrix(points, triangles, area)
    used = M.shape[0]  # libigl's mass matrix ends at the last vertex of a triangle
    with np.errstate(invalid="ignore"):  # and has zeros for vertices without one
        return (L @ points)[:used] / (2 * M.diagonal()[:, None])


@pytest.mark.parametrize("area", AREAS)
@pytest.mark.parametrize("valence", [4, 6, 8])
@pytest.mark.parametrize("diagonal", [0, 1])
def test_cotan_is_libigl_on_each_vertex_own_triangulation(torus, valence, area, diagonal):
    if diagonal and valence != 6:
        return
    mass = getattr(igl, f"MASSMATRIX_TYPE_{area.upper()}")
    stencils = torus.stencils()
    table, x, faces = stencils.corner_table, stencils.points, stencils.faces.astype(np.int64)
    Hn = qc.mean_curvature_normal(torus, cotan(valence, area, diagonal)).reshape(-1, 3)
    if valence == 6:
        cut = faces[:, [1, 2, 3, 0]] if diagonal else faces
        triangles = np.concatenate((cut[:, [0, 1, 2]], cut[:, [2, 3, 0]]))
        assert relative(Hn, cotan_literally(x, triangles, mass)) < 1e-12
        return
    expected = np.empty_like(Hn)
    for v in range(len(x)):
        k = slice(table.indptr[v], table.indptr[v + 1])
        a, d, b = table.next[k], table.diagonal[k], table.previous[k]
        c = np.full_like(a, v)
        fan = [(c, a, b)] if valence == 4 else [(c, a, d), (c, d, b)]
        triangles = np.concatenate([np.stack(t, axis=1) for t in fan]).astype(np.int64)
        expected[v] = cotan_literally(x, triangles, mass)[v]
    assert relative(Hn, expected) < 1e-12


def test_cotan_rejects_what_it_does_not_know():
    for arguments, match in (
        ({"valence": 5}, "valence: expected one of"),
        ({"area": "mixed"}, "area: expected one of"),
        ({"valence": 8, "diagonal": 1}, "only valence 6 has a choice"),
    ):
        with pytest.raises(ValueError, match=match):
            cotan(**arguments)
    with pytest.raises(ValueError, match="scheme: expected one of finite_volume, liu"):
        as_scheme("no such scheme")


def test_valences_four_and_eight_where_vertices_are_no_chessboard():
    """On an odd torus; every vertex is served by its own cut all the same."""
    grid = surfaces.torus().sample((9, 7))[0]
    table = grid.stencils().corner_table
    H = qc.mean_curvature(grid, "cotan-4")
    even = surfaces.torus().sample((18, 14))[0]
    assert np.isfinite(H).all()
    # The torus is symmetric in its first direction, so each column has one value.
    assert np.ptp(H, axis=0).max() < 1e-12
    assert np.ptp(qc.mean_curvature(even, "cotan-4"), axis=0).max() < 1e-12
    assert (np.diff(table.indptr) == 4).all()


# ---- triangles among the quads -----------------------------------------------------------------------


def test_liu_on_triangles_is_the_barycentric_cotan_formula():
    mesh = surfaces.cubed_ellipsoid().sample((6, 6), "faces")[0]
    faces = mesh.faces.astype(np.int64)
    triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]]))
    Hn = qc.mean_curvature_normal((mesh.points, triangles), "liu")
    expected = cotan_literally(mesh.points, triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    assert relative(Hn, expected) < 1e-12


def flap_literally(mesh, v):
    """Finite-volume H n at v with d across the edge (a, b) of each triangle, face by face."""
    x = mesh.points
    faces = [[i for i in f if i >= 0] for f in mesh.faces.tolist()]
    total, area = np.zeros(3), np.zeros(3)
    for face in faces:
        if v not in face:
            continue
        s, k = face.index(v), len(face)
        a, b = face[(s + 1) % k], face[s - 1]
        if k == 4:
            d = x[face[(s + 2) % 4]]
        else:
            beyond = [g for g in faces if a in g and b in g and g is not face]
            d = np.mean([x[i] for i in beyond[0] if i not in (a, b)], axis=0)
        t1, t2 = d - x[v], x[b] - x[a]
        normal = t1 - (t1 @ t2) / (t2 @ t2) * t2
        total += np.linalg.norm(t2) * normal / np.linalg.norm(normal)
        area += np.cross(x[a] - x[v], x[b] - x[v]) / 2
    return total / (2 * np.linalg.norm(area))


def test_flap_rule_on_a_mixed_mesh(mixed):
    Hn = qc.mean_curvature_normal(mixed, "finite_volume")
    expected = np.array([flap_literally(mixed, v) for v in range(len(Hn))])
    assert relative(Hn, expected) < 1e-12
    assert set(np.unique(mixed.stencils().valence)) >= {3, 4, 5, 6}


def test_mixed_ellipsoid_stays_bounded_and_beats_liu():
    """Random triangles among the quads: no divergence, and a mean error far below Liu's."""
    found = {}
    for n in (8, 16, 32):
        mesh, xi, eta = surfaces.cubed_ellipsoid().sample((n, n), "faces")
        cut = np.random.default_rng(n).random(len(mesh.faces)) < 0.3
        quads = mesh.faces[cut]
        faces = np.full((len(quads) * 2, 4), -1)
        faces[:, :3] = np.concatenate((quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]))
        both = qc.QuadMesh(mesh.points, np.concatenate((mesh.faces[~cut], faces)))
        exact = surfaces.cubed_ellipsoid().mean_curvature(xi, eta)
        for scheme in ("finite_volume", "liu"):
            found[scheme, n] = np.abs(qc.mean_curvature(both, scheme) - exact)
    assert found["finite_volume", 32].max() < 0.5
    assert found["finite_volume", 32].mean() < 0.25 * found["liu", 32].mean()


# ---- exact cases ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", SCHEMES)
def test_start_vertex_and_sense_of_faces_matter_to_valence_six_alone(scheme):
    mesh = surfaces.cubed_ellipsoid().sample((4, 4), "faces")[0]
    rolled = np.stack([np.roll(f, k % 4) for k, f in enumerate(mesh.faces)])
    H, again = (qc.mean_curvature((mesh.points, f), scheme) for f in (mesh.faces, rolled))
    cut_along_one_diagonal = scheme in (cotan(6).name, cotan(6, "voronoi").name)
    assert (relative(again, H) < 1e-11) != cut_along_one_diagonal
    backwards = qc.mean_curvature((mesh.points, mesh.faces[:, ::-1]), scheme)
    assert (relative(-backwards, H) < 1e-11) != cut_along_one_diagonal


@pytest.mark.filterwarnings("ignore:the first and the last:quadcurv.MeshWarning")  # open where it could wrap
def test_staggered_ghosts_given_wrapped_or_extrapolated_agree():
    surface = surfaces.torus()
    given, xi, eta = surface.sample((64, 48), "staggered")
    inner, dual = given.primal[1:-1, 1:-1], given.dual
    wrapped = qc.StaggeredGrid(inner, dual, wrap=(True, True))
    assert (
        relative(qc.mean_curvature(wrapped, "finite_volume"), qc.mean_curvature(given, "finite_volume"))
        < 1e-12
    )
    open_sides = qc.mean_curvature(qc.StaggeredGrid(inner, dual), "finite_volume")
    exact = surface.mean_curvature(xi, eta)
    inside = np.abs(qc.mean_curvature(given, "finite_volume") - exact).max()
    assert np.abs(open_sides - exact).max() < 2 * inside
    assert np.isnan(
        qc.mean_curvature(qc.StaggeredGrid(inner, dual), "finite_volume", boundary="nan")
    ).sum() == 2 * (64 + 46)


# ---- matrices ------------------------------------------------------------------------------------------


def test_dual_areas_add_up_to_the_area():
    exact = 4 * np.pi**2 * 2 * 1  # of a torus, 4 pi^2 R r
    grid = surfaces.torus().sample((128, 96))[0]
    liu, fv = (qc.dual_areas(grid, s).sum() for s in ("liu", "finite_volume"))
    assert abs(liu / exact - 1) < 1e-3
    assert abs(fv / exact - 1) < 3e-3
    flat = surfaces.plane().sample((5, 4))[0]
    for scheme in ("finite_volume", "liu", "cotan-6"):
        assert qc.dual_areas(flat, scheme).sum() == pytest.approx(4, rel=1e-12)


def test_laplace_beltrami_of_a_spherical_harmonic():
    """-M^-1 S z = -2 z on the unit sphere: the matrices serve any f, not only the positions."""
    errors = []
    for n in (32, 64, 128):
        grid, *_ = surfaces.sphere().sample((2 * n, n))
        z = grid.points[..., 2].ravel()
        laplacian = (
            -(qc.stiffness_matrix(grid, "finite_volume") @ z) / qc.dual_areas(grid, "finite_volume").ravel()
        )
        errors.append(np.abs(laplacian + 2 * z).reshape(grid.shape)[:, 1:-1].max())
    assert errors[-1] < 2e-3
    assert np.log2(errors[-2] / errors[-1]) > 1.9


# ---- sign, normals, missing answers -----------------------------------------------------------------------


def test_vertex_normals_converge_and_have_unit_length():
    surface, errors = surfaces.tanh_sheet(), []
    for n in (16, 32, 64):
        grid, xi, eta = surface.sample((n, n))
        h = 1e-4
        along = surface.mapping(xi + h, eta) - surface.mapping(xi - h, eta)
        across = surface.mapping(xi, eta + h) - surface.mapping(xi, eta - h)
        exact = np.cross(along, across)
        exact /= np.linalg.norm(exact, axis=-1, keepdims=True)
        normals = qc.vertex_normals(grid)
        assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() < 1e-14
        errors.append(np.abs(normals - exact).max())
    assert errors[-1] < 1e-3
    assert np.log2(errors[-2] / errors[-1]) > 1.9


def test_a_face_without_area_spoils_its_own_vertices_only():
    mesh = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    face = mesh.faces[10]
    points = mesh.points.copy()
    points[face[2]] = points[face[0]]  # one diagonal of length zero
    assert set(np.flatnonzero(np.isnan(qc.mean_curvature((points, mesh.faces), "liu")))) == set(face)
