"""Triangles into quads, face lists into grids, coincident points into one."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
import scipy
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from quadcurv import (
    MeshError,
    MeshWarning,
    QuadGrid,
    QuadMesh,
    as_grid,
    duplicate_points,
    mean_curvature,
    merge_points,
    pair_triangles,
    read,
    surfaces,
)
from quadcurv.coincidence import first_at_place
from quadcurv.io.base import FaceList
from quadcurv.io.quads import quads_by_carrier, quads_by_order, split_quads
from quadcurv.mesh import Recovery
from quadcurv.repair import flip, orient

# Points in any order make faces that fold over: what is told of them is tested elsewhere.
pytestmark = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")


def same_faces(one, other):
    """Whether two lists of faces are equal up to their order and the vertex that each begins with."""

    def normal_form(faces):
        polygons = [[v for v in face if v >= 0] for face in np.asarray(faces).tolist()]
        return sorted(tuple(p[p.index(min(p)) :] + p[: p.index(min(p))]) for p in polygons)

    return normal_form(one) == normal_form(other)


def shuffled_triangles(mesh, rng, which="random"):
    """The quads of a mesh cut along random or always the same diagonals, in any order and rotation."""
    quads = mesh.faces[mesh.faces[:, 3] >= 0]
    if which == "random":
        quads = np.where(rng.integers(0, 2, (len(quads), 1)), quads, np.roll(quads, 1, axis=1))
    triangles = split_quads(quads)[0]
    turn = (np.arange(3) + rng.integers(0, 3, (len(triangles), 1))) % 3
    return np.take_along_axis(triangles, turn, axis=1)[rng.permutation(len(triangles))]


# ------------------------------------------------------------------------------------------ by order


@pytest.fixture
def quads():
    return surfaces.cubed_sphere().sample((4, 4), "faces")[0].faces


def test_block_order(quads):
    triangles = np.concatenate((quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]))
    faces, rule = quads_by_order(triangles)
    assert rule == "block"
    np.testing.assert_array_equal(faces, quads)


def test_block_order_between_triangles_and_fans(quads):
    quads, cut, fans = quads[:80], quads[80:88], quads[88:]
    before = np.concatenate((cut[:, [0, 1, 3]], cut[:, [1, 2, 3]]))
    after = np.concatenate((fans[:, [0, 1, 2]], fans[:, [0, 2, 3]]))
    triangles = np.concatenate((before, quads[:, [0, 1, 2]], quads[:, [2, 3, 0]], after))
    faces, rule = quads_by_order(triangles)
    assert rule == "block"
    np.testing.assert_array_equal(faces[16:96], quads)
    np.testing.assert_array_equal(faces[:16, :3], before)
    np.testing.assert_array_equal(faces[96:, :3], after)
    assert (faces[:16, 3] == -1).all()


def test_one_wrong_pair_makes_no_block(quads):
    triangles = np.concatenate((quads[:, [0, 1, 2]], quads[:, [2, 3, 0]]))
    triangles[[3, 5]] = triangles[[5, 3]]
    faces, rule = quads_by_order(triangles)
    # Every triangle still has its other half; they are found, though not by counting.
    assert rule == "diagonal"
    assert same_faces(faces, quads)


def test_interleaved_order_with_triangles(quads):
    triangles = [t for a, b, c, d in quads.tolist() for t in ([a, b, c], [c, d, a])]
    faces, rule = quads_by_order(np.array(triangles))
    assert rule == "interleaved"
    np.testing.assert_array_equal(faces, quads)
    triangles[6:8] = [[0, 1, 5], [7, 8, 9]]
    faces, rule = quads_by_order(np.array(triangles))
    assert rule == "interleaved"
    np.testing.assert_array_equal(np.delete(faces, [3, 4], axis=0), np.delete(quads, 3, axis=0))
    np.testing.assert_array_equal(faces[3:5], [[0, 1, 5, -1], [7, 8, 9, -1]])


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.icosphere(subdivisions=3),
        trimesh.creation.box(),
        trimesh.creation.box().subdivide(),
        trimesh.creation.cylinder(1.0, 2.0),
        trimesh.creation.uv_sphere(),
        trimesh.creation.capsule(),
        trimesh.creation.torus(2.0, 1.0),
        trimesh.creation.annulus(1.0, 2.0, 1.0),
        trimesh.creation.box().subdivide_loop(1),
    ],
    ids=lambda mesh: f"{len(mesh.faces)} triangles",
)
def test_genuine_triangles_are_left_alone(mesh):
    faces, rule = quads_by_order(mesh.faces)
    assert rule == "none"
    np.testing.assert_array_equal(faces[:, :3], mesh.faces)
    assert (faces[:, 3] == -1).all()


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_genuine_triangles_are_left_alone_whatever_their_order(seed):
    rng = np.random.default_rng(seed)
    triangles = rng.permutation(trimesh.creation.icosphere(subdivisions=2).faces)
    turn = (np.arange(3) + rng.integers(0, 3, (len(triangles), 1))) % 3
    assert quads_by_order(np.take_along_axis(triangles, turn, axis=1))[1] == "none"


def test_a_triangle_and_its_back_make_no_quad():
    back_to_back = np.array([[0, 1, 2], [2, 1, 0]])
    faces, rule = quads_by_order(back_to_back)
    assert rule == "none"
    assert faces.tolist() == [[0, 1, 2, -1], [2, 1, 0, -1]]


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40))
def test_any_list_of_triangles_gives_faces_of_its_own_triangles(seed, k):
    triangles = np.random.default_rng(seed).integers(0, 7, (k, 3))
    faces, rule = quads_by_order(triangles)
    cut, _ = split_quads(faces)
    assert sorted(map(tuple, cut.tolist())) == sorted(map(tuple, triangles.tolist()))
    if rule != "none" and k > 1:
        assert 4 * np.count_nonzero(faces[:, 3] >= 0) >= k


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_the_carrier_survives_shuffling_and_mirroring(seed, mirror):
    rng = np.random.default_rng(seed)
    mesh = surfaces.torus().sample((4, 5), "faces")[0]
    faces = np.concatenate((mesh.faces[:12], np.insert(mesh.faces[12:, :3], 3, -1, axis=1)))
    faces = faces[rng.permutation(len(faces))].astype(np.int32)
    triangles, carrier = split_quads(faces)
    order = rng.permutation(len(triangles))
    if mirror:
        triangles, faces = triangles[:, ::-1], np.where(faces < 0, -1, faces[:, [2, 1, 0, 3]])
    np.testing.assert_array_equal(quads_by_carrier(triangles[order], carrier[order]), faces)


def test_a_carrier_of_half_a_quad_leaves_a_triangle(quads):
    triangles, carrier = split_quads(quads)
    faces = quads_by_carrier(triangles[1:], carrier[1:])
    np.testing.assert_array_equal(faces, np.insert(quads[1:], 0, [*triangles[len(quads)], -1], axis=0))


# ------------------------------------------------------------------------------------------ by shape


@pytest.mark.parametrize("which", ["random", "same"])
@pytest.mark.parametrize(
    ("surface", "fraction"),
    [
        (surfaces.torus(), 1.0),
        (surfaces.catenoid(), 1.0),
        (surfaces.cubed_sphere(), 1.0),
        (surfaces.cubed_ellipsoid(), 0.99),
        (surfaces.hyperbolic_paraboloid(), 0.75),  # sheared: other pairs look better
    ],
    ids=lambda x: getattr(x, "name", ""),
)
def test_shuffled_quads_come_back_by_shape(surface, fraction, which, rng):
    mesh = surface.sample((16, 16), "faces")[0]
    paired = pair_triangles(QuadMesh(mesh.points, shuffled_triangles(mesh, rng, which)))
    true = {frozenset(face) for face in mesh.faces.tolist()}
    found = {frozenset(face) for face in paired.faces.tolist() if face[3] >= 0}
    assert len(found & true) >= fraction * len(true)
    assert paired.recovery is not None
    assert paired.recovery.rule == "shape"
    assert paired.recovery.paired == 2 * len(found) / (2 * len(true)) >= 0.98
    if fraction == 1.0:
        assert same_faces(paired.faces, mesh.faces)


def test_real_quads_come_back_by_shape(shared_meshes, rng):
    for name, fraction in (("spot_quadrangulated", 0.99), ("quadknot", 1.0)):
        mesh = read(shared_meshes / f"{name}.obj")
        paired = pair_triangles(QuadMesh(mesh.points, shuffled_triangles(mesh, rng)))
        true = {frozenset(face) for face in mesh.faces.tolist()}
        assert len({frozenset(face) for face in paired.faces.tolist()} & true) >= fraction * len(true)


def test_pairing_keeps_quads_and_lonely_triangles():
    points = [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [3, 0.5, 0]]
    faces = [[0, 1, 4, 3], [1, 2, 5], [5, 4, 1], [2, 6, 5]]
    paired = pair_triangles(QuadMesh(points, faces))
    assert same_faces(paired.faces, [[0, 1, 4, 3], [1, 2, 5, 4], [2, 6, 5, -1]])
    assert paired.recovery == Recovery("shape", 2 / 3)


def test_neither_folds_nor_arrowheads_are_paired():
    folded = QuadMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.2, 0.1, 0.01]], [[0, 1, 2], [0, 3, 1]])
    assert pair_triangles(folded).recovery == Recovery("shape", 0.0)
    arrow = QuadMesh([[0, 0, 0], [3, -1, 0], [1, 0, 0], [3, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    np.testing.assert_array_equal(pair_triangles(arrow).faces, arrow.faces)
    quads = surfaces.torus().sample((4, 4), "faces")[0]
    np.testing.assert_array_equal(pair_triangles(quads).faces, quads.faces)


# ---------------------------------------------------------------------------------- coincident points


def test_duplicate_points_are_found_exactly_or_within_a_tolerance():
    points = [[0.0, 0, 0], [1, 0, 0], [-0.0, 0, 0], [1, 1e-9, 0], [0, 1, 0]]
    mesh = QuadMesh(points, [[0, 1, 4], [2, 3, 4]])
    assert duplicate_points(mesh).tolist() == [0, 1, 0, 3, 4]
    assert duplicate_points(mesh, 1e-8).tolist() == [0, 1, 0, 1, 4]
    for tolerance in (-1.0, np.nan):
        with pytest.raises(MeshError, match=r"tolerance: expected a length >= 0"):
            duplicate_points(mesh, tolerance)


@pytest.mark.parametrize("tolerance", [0.0, 1e-12])
def test_a_closed_seam_has_the_curvature_of_the_closed_grid(torus, tolerance):
    open_ = QuadMesh(*_with_seam(torus))
    assert np.isnan(mean_curvature(open_, "finite_volume", boundary="nan")).any()
    merged, vertex = merge_points(open_, tolerance)
    assert len(merged.points) == torus.points[..., 0].size
    H = mean_curvature(merged, "finite_volume")[vertex].reshape(15, 12)
    np.testing.assert_allclose(H[:14, :11], mean_curvature(torus, "finite_volume"), rtol=0, atol=1e-12)
    np.testing.assert_array_equal(H[-1], H[0])


def _with_seam(grid):
    closed = np.pad(grid.points, [(0, 1), (0, 1), (0, 0)], mode="wrap")
    return closed.reshape(-1, 3), QuadGrid(closed).to_mesh().faces


def test_a_pole_of_quads_becomes_triangles():
    theta, phi = np.meshgrid(np.linspace(0, np.pi, 7), 2 * np.pi * np.arange(9) / 8, indexing="ij")
    sphere = np.stack((np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), axis=-1)
    merged, vertex = merge_points(QuadGrid(sphere).to_mesh(), 1e-12)
    assert merged.stencils().closed.all()
    assert len(merged.points) == 2 + 5 * 8
    assert np.count_nonzero(merged.faces[:, 3] < 0) == 2 * 8
    assert len({*vertex[:9]}) == 1
    assert merged.stencils().ring_areas.sum(axis=0) == pytest.approx([0, 0, 0], abs=1e-12)


def test_merging_drops_faces_without_three_places_and_tells_of_edges_of_many_faces():
    points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 0], [1, 0, 0]]
    merged, vertex = merge_points(QuadMesh(points, [[0, 1, 2, 3], [0, 4, 5, 1]]))
    assert merged.faces.tolist() == [[0, 1, 2, 3]]
    assert vertex.tolist() == [0, 1, 2, 3, 0, 1]
    book = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, 0], [1, 0, 0]]
    with pytest.warns(MeshWarning, match="1 edge.s. with more than two faces"):
        merge_points(QuadMesh(book, [[0, 1, 2], [1, 0, 3], [5, 6, 4]]))


def test_polygons_stay_polygons_where_points_are_merged_or_faces_turned():
    angle = np.arange(5) * 2 * np.pi / 5
    points = np.zeros((12, 3))
    points[:5, :2] = np.stack((np.cos(angle), np.sin(angle)), axis=-1)
    points[5:10, :2] = 2 * points[:5, :2]
    points[10], points[11] = points[0], points[1]
    mesh = QuadMesh(points, [[0, 5, 6, 1], [11, 6, 7, 2], [0, 1, 2, 3, 4], [10, 1, 11]])
    merged, _ = merge_points(mesh)
    assert [f.tolist() for f in np.split(*_csr(merged))] == [[0, 5, 6, 1], [1, 6, 7, 2], [0, 1, 2, 3, 4]]
    assert [f.tolist() for f in np.split(*_csr(flip(merged)))] == [
        [0, 1, 6, 5],
        [1, 2, 7, 6],
        [0, 4, 3, 2, 1],
    ]


def _csr(mesh):
    faces = FaceList.of(mesh)
    return faces.corners, np.cumsum(faces.sizes)[:-1]


# -------------------------------------------------------------------------------------------- as_grid


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (False, True), (True, True)])
def test_the_faces_of_a_grid_give_that_grid(wrap, rng):
    grid = QuadGrid(rng.standard_normal((5, 4, 3)), wrap)
    found, vertex = as_grid(grid.to_mesh())
    assert found.wrap == wrap
    np.testing.assert_array_equal(found.points, grid.points)
    np.testing.assert_array_equal(vertex, np.arange(20).reshape(5, 4))


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.tuples(st.integers(3, 6), st.integers(3, 6)),
    st.tuples(st.booleans(), st.booleans()),
)
def test_shuffled_grids_are_recognised_and_values_map_both_ways(seed, shape, wrap):
    rng = np.random.default_rng(seed)
    grid = QuadGrid(rng.standard_normal((*shape, 3)), wrap)
    n = shape[0] * shape[1]
    label = rng.permutation(n)
    points = np.empty((n + 1, 3))
    points[label] = grid.points.reshape(-1, 3)
    points[n] = 7.0  # a vertex without a face
    faces = label[grid.to_mesh().faces][rng.permutation(len(grid.to_mesh().faces))]
    faces = np.array([np.roll(face, rng.integers(4)) for face in faces])
    mesh = QuadMesh(points, faces)
    found, vertex = as_grid(mesh)
    assert sorted(zip(found.shape, found.wrap, strict=True)) == sorted(zip(shape, wrap, strict=True))
    np.testing.assert_array_equal(found.points, mesh.points[vertex])
    assert same_faces(vertex.ravel()[found.to_mesh().faces], mesh.faces)
    on_grid, on_mesh = (
        mean_curvature(found, "finite_volume", boundary="nan"),
        mean_curvature(mesh, "finite_volume", boundary="nan"),
    )
    np.testing.assert_allclose(on_grid, on_mesh[vertex], rtol=1e-9, atol=1e-9)
    back = np.full(n + 1, np.nan)
    back[vertex] = on_grid
    np.testing.assert_allclose(back, on_mesh, rtol=1e-9, atol=1e-9)


def test_the_torus_knot_is_a_grid(shared_meshes):
    mesh = read(shared_meshes / "quadknot.obj")
    grid, vertex = as_grid(mesh)
    assert grid.shape == (12, 120)
    assert grid.wrap == (True, True)
    assert np.sort(vertex, axis=None).tolist() == list(range(1440))
    np.testing.assert_allclose(
        mean_curvature(grid, "finite_volume"),
        mean_curvature(mesh, "finite_volume")[vertex],
        rtol=0,
        atol=1e-12,
    )


def twisted_torus(r, c, shift):
    i, j = np.meshgrid(np.arange(r), np.arange(c), indexing="ij")

    def index(i, j):
        return (i % r) * c + (j + shift * (i // r)) % c

    quads = np.stack((index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)), axis=-1)
    return QuadMesh(np.random.default_rng(1).standard_normal((r * c, 3)), quads.reshape(-1, 4))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (
            lambda: QuadMesh(np.eye(4, 3), [[0, 1, 2], [0, 2, 3]]),
            "not a grid, 2 of its faces are triangles",
        ),
        (
            lambda: surfaces.cubed_sphere().sample((3, 3), "faces")[0],
            "8 extraordinary vertices, first vertex 0: an inner vertex with 3 faces",
        ),
        (
            lambda: QuadMesh(
                np.random.default_rng(0).random((16, 3)),
                QuadGrid(np.zeros((4, 4, 3)) + 0.0).to_mesh().faces[:8],
            ),
            "1 extraordinary vertices, first vertex 10: a boundary vertex with 3 faces",
        ),
        (lambda: twisted_torus(6, 5, 2), "a twisted torus: 1 lines of 30 quads close with a shift of 18"),
        (
            lambda: QuadMesh(np.random.default_rng(0).random((8, 3)), [[0, 1, 2, 3], [4, 5, 6, 7]]),
            "its faces make several components",
        ),
    ],
    ids=["triangles", "extraordinary", "reflex corner", "twisted", "components"],
)
def test_what_is_no_grid(mesh, message):
    with pytest.raises(MeshError, match=message):
        as_grid(mesh())


def test_a_moebius_strip_and_corners_that_meet_are_no_grids():
    i = np.arange(8)
    strip = np.stack((i, i + 8, (i + 1) % 8 + 8, (i + 1) % 8), axis=-1)
    strip[-1] = [7, 15, 0, 8]
    with pytest.warns(UserWarning, match="non-orientable"):
        mesh = QuadMesh(np.random.default_rng(0).random((16, 3)), strip)
    with pytest.raises(MeshError, match="not a grid, it is non-orientable"):
        as_grid(mesh)
    faces = QuadGrid(np.random.default_rng(0).random((5, 2, 3))).to_mesh().faces.copy()
    faces[faces == 9] = 0  # the last corner is the first one
    bent = QuadMesh(np.random.default_rng(0).random((9, 3)), faces)
    with pytest.raises(MeshError, match="some vertices lie at several places of its border"):
        as_grid(bent)


# ----------------------------------------------------------------------------------- sides turned round


@pytest.mark.parametrize("layout", ["faces", "grid", "staggered"])
def test_flipping_changes_the_sign_and_twice_gives_the_mesh_back(layout):
    mesh = surfaces.torus().sample((12, 8), layout)[0]
    flipped = flip(mesh)
    assert type(flipped) is type(mesh)
    H, other = mean_curvature(mesh, "liu"), mean_curvature(flipped, "liu")
    np.testing.assert_allclose(other if layout == "faces" else other.T, -H, rtol=1e-12)
    if layout == "faces":
        np.testing.assert_array_equal(flip(flipped).faces, mesh.faces)
        np.testing.assert_array_equal(flipped.faces[:, 0], mesh.faces[:, 0])
    else:
        np.testing.assert_array_equal(mean_curvature(flip(flipped), "liu"), H)


def test_closed_parts_are_turned_outward_and_open_ones_left():
    sphere = surfaces.cubed_sphere().sample((4, 4), "faces")[0]
    n, far = len(sphere.points), 1e6
    inside_out, patch = sphere.faces[:, ::-1], sphere.faces[:20, ::-1]
    cut = np.insert(np.concatenate((sphere.faces[:, [0, 1, 2]], sphere.faces[:, [0, 2, 3]])), 3, -1, axis=1)
    cut = np.where(cut < 0, -1, cut[:, [2, 1, 0, 3]])
    parts = [sphere.faces, inside_out, patch, cut]
    points = np.concatenate([sphere.points + far * k * np.eye(3)[0] for k in range(4)])
    faces = np.concatenate([np.where(part < 0, -1, part + n * k) for k, part in enumerate(parts)])
    mesh = QuadMesh(points, faces)
    turned = orient(mesh)
    H = mean_curvature(turned, "liu", "nan").reshape(4, n)
    assert (H[[0, 1, 3]] > 0.5).all()
    assert np.nanmax(H[2]) < -0.5
    np.testing.assert_array_equal(turned.faces[: len(sphere.faces)], sphere.faces)
    assert orient(turned) is turned


def test_what_has_no_outside_is_left_as_it_is(torus):
    assert orient(torus) is torus
    inner = orient(flip(torus))
    np.testing.assert_allclose(mean_curvature(inner), mean_curvature(torus), rtol=1e-12)
    tube = surfaces.catenoid().sample((5, 6))[0]
    assert orient(tube) is tube
    staggered = surfaces.torus().sample((6, 7), "staggered")[0]
    assert orient(staggered) is staggered
    twice = QuadMesh(np.eye(4, 3), [[0, 1, 2, 3], [0, 3, 2, 1]])  # closed, no volume
    assert orient(twice) is twice


def test_repairs_take_what_the_verbs_take(tmp_path):
    box = trimesh.creation.box()
    assert isinstance(flip(box), QuadMesh)
    assert orient(box).faces.tolist() == QuadMesh(box.vertices, box.faces).faces.tolist()
    assert len(pair_triangles(box).faces) == 6
    torus = surfaces.torus().sample((5, 6))[0]
    grid, _ = as_grid(torus)
    np.testing.assert_array_equal(grid.points, torus.points)
    assert (duplicate_points(torus) == np.arange(30)).all()
    soup = trimesh.Trimesh(box.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3), process=False)
    soup.export(tmp_path / "soup.obj")
    # Neither warns of the seams that it is there to close.
    assert len(merge_points(soup)[0].points) == len(merge_points(tmp_path / "soup.obj")[0].points) == 8


def test_a_tolerance_as_large_as_the_mesh_costs_little_memory(rng):
    points = np.concatenate((rng.random((22_500, 3)), [[5.0, 0, 0]]))
    mesh = QuadMesh(points, [[0, 1, 2]])
    tracemalloc.start()
    try:
        place = duplicate_points(mesh, 2.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert place.tolist() == [0] * 22_500 + [22_500]
    assert peak < 20e6


@settings(max_examples=200, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.floats(-3, 0.5), st.booleans())
def test_places_are_the_components_of_the_graph_of_near_points(seed, n, exponent, lattice):
    rng = np.random.default_rng(seed)
    points = rng.integers(0, 4, (n, 3)).astype(float) if lattice else rng.random((n, 3))
    tolerance = float(rng.integers(1, 3)) if lattice else 10.0**exponent
    near = scipy.spatial.distance.cdist(points, points) <= tolerance
    _, first, of = np.unique(
        scipy.sparse.csgraph.connected_components(near)[1], return_index=True, return_inverse=True
    )
    np.testing.assert_array_equal(first_at_place(points, tolerance), first[of])
