"""One bad thing does not refuse a model: what is kept, mended, counted, and right beside it."""

from __future__ import annotations

import time
import warnings

import numpy as np
import pytest
import trimesh

import quadcurv as qc
from quadcurv import MeshWarning, QuadMesh, surfaces
from quadcurv.kernels import topology
from quadcurv.schemes import SCHEMES

every_scheme = pytest.mark.parametrize("scheme", SCHEMES)


def sphere(n=12):
    mesh, xi, eta = surfaces.cubed_ellipsoid().sample((n, n), "faces")
    return (
        mesh.points,
        [list(map(int, f)) for f in mesh.faces],
        surfaces.cubed_ellipsoid().mean_curvature(xi, eta),
    )


def ring_of(faces, vertices):
    """Vertices that share a face with some."""
    return sorted({v for face in faces for v in face if set(face) & set(vertices)})


@every_scheme
def test_a_fin_costs_the_ends_of_its_edge_alone(scheme):
    points, faces, _ = sphere()
    whole = qc.mean_curvature((points, faces), scheme)
    a, b = faces[100][:2]
    n = len(points)
    out = points[[a, b]] * 1.2
    with pytest.warns(MeshWarning, match=rf"1 edge\(s\) with more than two faces.* vertex {min(a, b)} to"):
        mesh = QuadMesh(np.vstack((points, out)), [*faces, [b, a, n, n + 1]])
    assert mesh.report["nonmanifold"] == 1
    assert (mesh.connectivity.kind[[a, b]] == topology.NONMANIFOLD).all()
    H = qc.mean_curvature(mesh, scheme)
    assert np.isnan(H[[a, b]]).all()
    far = np.setdiff1d(np.arange(n), ring_of(faces, ring_of(faces, ring_of(faces, [a, b]))))
    np.testing.assert_allclose(H[far], whole[far], rtol=1e-11)
    # Beside the fin a fit has fewer neighbours, not the fin's; a Laplacian reads its own ring.
    beside = np.setdiff1d(ring_of(faces, ring_of(faces, [a, b])), [a, b])
    tolerance = 0.15 if "jet" in scheme else 1e-9
    assert np.nanmax(np.abs(H[beside] - whole[beside])) < tolerance
    assert np.isfinite(H[beside]).all()


@every_scheme
def test_sheets_that_touch_in_a_vertex_do_not_see_each_other(scheme):
    points, faces, _ = sphere(8)
    whole = qc.mean_curvature((points, faces), scheme)
    n, v = len(points), int(np.argmax(points[:, 0]))
    number = np.concatenate((np.arange(n) + n - (np.arange(n) > v), []))
    number[v] = v
    other = 2 * points[v] - points  # its mirror image in that vertex
    twice = faces + [[int(number[k]) for k in face] for face in faces]
    mesh = QuadMesh(np.vstack((points, np.delete(other, v, axis=0))), twice)
    assert mesh.report["fans"] == 1
    assert "1 vertices where several fans touch" in str(mesh.report)
    H = qc.mean_curvature(mesh, scheme)
    assert np.isnan(H[v])
    beside = np.setdiff1d(ring_of(faces, ring_of(faces, [v])), [v])
    assert np.nanmax(np.abs(H[beside] - whole[beside])) < (0.15 if "jet" in scheme else 1e-9)


@every_scheme
def test_faces_given_twice_or_the_other_way_round_change_nothing(scheme):
    points, faces, _ = sphere(6)
    whole = qc.mean_curvature((points, faces), scheme)
    for more, match in (
        ([faces[7], faces[50]], r"2 face\(s\) given twice, taken once, first face 216"),
        ([faces[7][::-1]], r"1 face\(s\) given twice, taken once, first face 216"),
        ([[1, 1, 2, 2], [5, 5, 5, 5]], r"2 face\(s\) of fewer than three .* first face 216"),
    ):
        with pytest.warns(MeshWarning, match=match):
            mesh = QuadMesh(points, [*faces, *more])
        np.testing.assert_array_equal(qc.mean_curvature(mesh, scheme), whole)


@every_scheme
def test_a_collapsed_quad_is_the_triangle(scheme):
    points, faces, _ = sphere(6)
    a, b, c, d = faces[30]
    as_triangle = [*faces[:30], [a, b, c], [a, c, d], *faces[31:]]
    for spelled in ([a, b, c, c], [a, a, b, c], [a, b, b, c], [a, b, c, a]):
        with pytest.warns(MeshWarning, match=r"1 face\(s\) with a repeated vertex, .* first face 30"):
            mesh = QuadMesh(points, [*faces[:30], spelled, [a, c, d], *faces[31:]])
        assert mesh.report["collapsed"] == 1
        H = qc.mean_curvature(mesh, scheme)
        np.testing.assert_allclose(H, qc.mean_curvature((points, as_triangle), scheme), rtol=1e-12)


@every_scheme
@pytest.mark.parametrize("nodes", [1, 2])
def test_a_vertex_that_hangs_on_an_edge_changes_nothing(scheme, nodes):
    """In one of the two faces at the edge, on the chord: not on the surface, before a crack."""
    points, faces, _ = sphere(6)
    whole = qc.mean_curvature((points, faces), scheme)
    (a, b, *_), n = faces[20], len(points)
    t = np.arange(1, nodes + 1)[:, None] / (nodes + 1)
    points = np.vstack((points, (1 - t) * points[a] + t * points[b]))
    spelled = [*faces[:20], [a, *range(n, n + nodes), *faces[20][1:]], *faces[21:]]
    match = rf"{nodes} vertices on an edge between two others, .* first vertex {n}"
    with pytest.warns(MeshWarning, match=match):
        mesh = QuadMesh(points, spelled)
    assert [(f.kind, f.number) for f in mesh.report.findings] == [("hanging", nodes)]
    assert mesh.face_source.tolist() == list(range(len(faces)))
    H = qc.mean_curvature(mesh, scheme)
    assert np.isnan(H[n:]).all()
    np.testing.assert_array_equal(H[:n], whole)


def test_corners_of_one_polygon_that_hang_on_no_edge_stay():
    """At a true border, and off the chord: nobody knows that these are not on the surface."""
    points, faces, _ = sphere(6)
    (a, b, *rest), n = faces[20], len(points)
    whole = [*faces[:20], [a, n, b, *rest], *faces[21:]]
    beside = next(k for k, f in enumerate(faces) if k != 20 and {a, b} <= set(f))
    middle = (points[a] + points[b]) / 2
    for x, given in ((middle, np.delete(np.array(whole, object), beside)), (1.001 * middle, whole)):
        mesh = QuadMesh(np.vstack((points, x)), [list(face) for face in given])
        assert mesh.report["hanging"] == 0
        assert mesh.report["cut"] == 1


def test_the_warning_comes_once_and_the_report_keeps_all():
    points, faces, _ = sphere(6)
    damaged = [*faces, faces[3], [0, 0, 1, 1]]
    damaged[5] = damaged[5][::-1]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        mesh = QuadMesh(np.vstack((points, [[9, 9, 9]])), damaged)
        for scheme in ("liu", "jet"):
            qc.mean_curvature(mesh, scheme)
    assert len(said) == 1
    assert said[0].category is MeshWarning
    assert said[0].filename == __file__
    found = {f.kind: f.number for f in mesh.report.findings}
    assert found == {"dropped": 1, "double": 1, "turned": 1, "isolated": 1}
    with pytest.raises(KeyError, match="expected one of collapsed"):
        mesh.report["nonsense"]


def test_a_closed_mesh_inside_out_is_told_of():
    points, faces, H = sphere(6)
    inside_out = [face[::-1] for face in faces]
    assert QuadMesh(points, faces).report["inside_out"] == 0
    mesh = QuadMesh(points, inside_out)
    assert str(mesh.report) == "the mesh is closed and inside out: its normals point inward"
    np.testing.assert_allclose(qc.mean_curvature(mesh, "liu"), -qc.mean_curvature((points, faces), "liu"))
    turned = qc.orient(mesh)
    assert turned.report["inside_out"] == 0
    assert np.abs(qc.mean_curvature(turned) - H).max() < 0.1
    np.testing.assert_allclose(qc.mean_curvature(qc.flip(turned)), -qc.mean_curvature(turned), rtol=1e-9)
    assert (
        QuadMesh(points, faces[:-5]).report["inside_out"] == 0
    )  # open: nobody knows which side is the outer


# ---- the cost of bad input ------------------------------------------------------------------------------


def fan(k):
    """A cone's tip of k triangles within a belt of k quads."""
    t = np.arange(k) * 2 * np.pi / k
    inner = np.stack((np.cos(t), np.sin(t), np.full(k, -0.1)), axis=1)
    i, j = np.arange(k) + 1, (np.arange(k) + 1) % k + 1
    triangles = np.stack((np.zeros(k, int), i, j, np.full(k, -1)), axis=1)
    quads = np.stack((i, i + k, j + k, j), axis=1)
    return np.vstack(([(0, 0, 0)], inner, 2 * inner + (0, 0, -0.2))), np.vstack((triangles, quads))


@pytest.mark.parametrize("scheme", ["finite_volume", "liu", "bilinear", "cotan-6", "jet-2", "jet"])
def test_the_time_grows_with_the_valence_not_with_its_square(scheme):
    qc.mean_curvature(fan(100), scheme)
    seconds = []
    for k in (2_000, 32_000):
        begin = time.process_time()
        qc.mean_curvature(fan(k), scheme)
        seconds.append(time.process_time() - begin)
    assert seconds[1] < 80 * seconds[0] + 0.5  # 16 times as large; its square would be 256 times


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scheme", "seconds"), [("finite_volume", 10), ("liu", 10), ("bunge", 10), ("jet", 40)]
)
def test_valence_of_a_hundred_thousand(scheme, seconds):
    """Its border has as many vertices, each closed by a surface of its own: 3 to 4 s and 15 s."""
    begin = time.process_time()
    H = qc.mean_curvature(fan(100_000), scheme)
    assert time.process_time() - begin < seconds
    assert np.isfinite(H[1:100_001]).mean() > 0.9


def test_merging_with_a_tolerance_as_large_as_the_mesh(rng):
    points = rng.random((22_500, 3))
    begin = time.process_time()
    found = qc.duplicate_points((points, np.arange(22_500).reshape(-1, 4)), 2.0)
    assert (found == 0).all()
    assert time.process_time() - begin < 10


def test_a_seam_of_a_hundred_thousand_vertices():
    n = 100_000
    x = np.linspace(0, 1, n)[:, None] * (1, 0, 0) + np.array([(0, 0, 0), (0, 1e-5, 0)])[:, None]
    i = np.arange(n - 1)
    faces = np.stack((i, i + 1, i + n + 1, i + n), axis=1)
    both = np.vstack((x.reshape(-1, 3), x.reshape(-1, 3) * (1, -1, 1)))
    begin = time.process_time()

    with pytest.warns(UserWarning, match="boundary vertices lie where others do"):
        qc.as_mesh(trimesh.Trimesh(both, np.vstack((faces[:, :3], faces[:, :3] + 2 * n)), process=False))
    assert time.process_time() - begin < 20
