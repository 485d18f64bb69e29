"""Meshes: what is accepted, how faces are split and turned, and the corner table."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from quadcurv import (
    MeshError,
    MeshWarning,
    QuadGrid,
    QuadMesh,
    StaggeredGrid,
    mean_curvature,
    surfaces,
)

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], float)


def corners(table, v):
    k = slice(table.indptr[v], table.indptr[v + 1])
    return list(zip(table.next[k], table.diagonal[k], table.previous[k], strict=True))


def test_corner_table_of_a_grid():
    points = np.stack((*np.mgrid[0:3, 0:3], np.zeros((3, 3))), axis=-1).astype(float)
    table = QuadGrid(points).stencils().corner_table
    assert table.indptr.tolist() == [0, 1, 3, 4, 6, 10, 12, 13, 15, 16]
    assert (table.centre == np.repeat(np.arange(9), np.diff(table.indptr))).all()
    # Vertex 4 is the middle; 7 lies in the first direction from it, 5 in the second.
    ring = corners(table, 4)
    start = ring.index((7, 8, 5))
    assert ring[start:] + ring[:start] == [(7, 8, 5), (5, 2, 1), (1, 0, 3), (3, 6, 7)]
    assert corners(table, 1) == [(4, 5, 2), (0, 3, 4)] or corners(table, 1) == [(0, 3, 4), (4, 5, 2)]


def test_corners_turn_counter_clockwise_and_close(mixed):
    table = mixed.stencils().corner_table
    assert table.indptr[-1] == np.count_nonzero(mixed.faces >= 0)
    for v in range(len(mixed.points)):
        ring = corners(table, v)
        assert all(b == following[0] for (_, _, b), following in zip(ring, ring[1:] + ring[:1], strict=True))
    assert (table.diagonal == -1).sum() == 3 * np.count_nonzero(mixed.faces[:, 3] < 0)


def test_open_rings_begin_at_the_boundary():
    """An open fan is listed from its boundary edge on, so that it can be walked without a jump."""
    grid = surfaces.elliptic_paraboloid().sample((4, 5))[0]
    rng = np.random.default_rng(5)
    faces = grid.to_mesh().faces
    order = rng.permutation(len(faces))
    faces = np.stack([np.roll(f, rng.integers(4)) for f in faces[order]])
    mesh = QuadMesh(grid.points.reshape(-1, 3), faces)
    table = mesh.stencils().corner_table
    for v in np.flatnonzero(~mesh.stencils().closed):
        ring = corners(table, v)
        assert all(b == following[0] for (_, _, b), following in pairwise(ring))
        assert ring[-1][2] != ring[0][0]


def test_faces_in_every_accepted_form():
    expected = [[0, 1, 2, 3]]
    for faces in ([[0, 1, 2, 3]], np.array([[0, 1, 2, 3]], np.uint8), ((0, 1, 2, 3),), [np.arange(4)]):
        assert QuadMesh(SQUARE, faces).faces.tolist() == expected
    for faces in ([(0, 1, 2), (0, 2, 3)], np.array([(0, 1, 2, -1), (0, 2, 3, -1)])):
        assert QuadMesh(SQUARE, faces).faces.tolist() == [[0, 1, 2, -1], [0, 2, 3, -1]]
    points = np.vstack((SQUARE, [(2, 0.5, 0)]))
    mesh = QuadMesh(points, [[0, 1, 2, 3], [1, 4, 2]])
    assert mesh.faces.tolist() == [[0, 1, 2, 3], [1, 4, 2, -1]]
    assert repr(mesh) == "QuadMesh(5 points, 1 quads, 1 triangles)"


@pytest.mark.parametrize("sides", [5, 6, 9])
def test_polygons_are_split_counted_and_traced_to_their_source(sides):
    """A star of alternating radii: a fan from its first vertex would leave the polygon."""
    angle = 2 * np.pi * np.arange(sides) / sides
    radius = np.where(np.arange(sides) % 2, 0.35, 1.0)
    rim = np.stack((radius * np.cos(angle), radius * np.sin(angle), np.zeros(sides)), axis=1)
    points = np.vstack((rim, [(5, 0, 0), (6, 0, 0), (6, 1, 0)]))
    mesh = QuadMesh(points, [[sides, sides + 1, sides + 2], list(range(sides))])
    assert mesh.report["cut"] == 1
    assert mesh.face_source.tolist() == [0] + [1] * (sides - 2)
    normals = [np.cross(points[b] - points[a], points[c] - points[a]) / 2 for a, b, c in mesh.faces[1:, :3]]
    assert (np.array(normals)[:, 2] > 0).all()  # no ear is turned over
    shoelace = np.sum(np.cross(rim, np.roll(rim, -1, axis=0)), axis=0)[2] / 2
    assert np.sum(normals, axis=0)[2] == pytest.approx(shoelace)


def test_faces_are_turned_to_agree_and_counted():
    mesh = surfaces.cubed_sphere().sample((3, 3), "faces")[0]
    turned = np.array([1, 17, 30, 31])
    faces = mesh.faces.copy()
    faces[turned] = faces[turned][:, [0, 3, 2, 1]]
    with pytest.warns(MeshWarning, match=r"4 face\(s\) turned to agree with their neighbours, first face 1"):
        again = QuadMesh(mesh.points, faces)
    assert again.report["turned"] == 4
    assert np.array_equal(again.faces, mesh.faces)
    assert np.array_equal(faces[turned], mesh.faces[turned][:, [0, 3, 2, 1]])  # the caller's stay
    assert np.array_equal(mean_curvature(again, "finite_volume"), mean_curvature(mesh, "finite_volume"))


def moebius(n=24, m=5, turns=1):
    """A strip of n x m cells with a number of half twists."""
    u = np.arange(n) * 2 * np.pi / n
    v = np.linspace(-0.3, 0.3, m + 1)
    r = 1 + v * np.cos(turns * u / 2)[:, None]
    points = np.stack(
        (r * np.cos(u)[:, None], r * np.sin(u)[:, None], v * np.sin(turns * u / 2)[:, None]), -1
    )
    index = np.arange(n * (m + 1)).reshape(n, m + 1)
    index = np.vstack((index, index[:1, ::-1] if turns % 2 else index[:1]))
    faces = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return points.reshape(-1, 3), faces.reshape(-1, 4)


def test_a_moebius_strip_has_curvature_without_sign():
    points, faces = moebius()
    with pytest.warns(UserWarning, match="non-orientable: its mean curvature has no sign"):
        mesh = QuadMesh(points, faces)
    assert not mesh.orientable
    H = mean_curvature(mesh, "finite_volume", boundary="nan").reshape(24, 6)
    assert (H[:, 1:-1] >= 0).all()
    assert np.isnan(H[:, [0, -1]]).all()
    # The same geometry cut open has a sign and, away from the cut, the same size.
    open_faces = faces[5:-5]
    cut = np.abs(mean_curvature((points, open_faces), "finite_volume", boundary="nan")).reshape(24, 6)
    assert np.allclose(H[3:-3, 1:-1], cut[3:-3, 1:-1], rtol=1e-12)


def test_two_half_twists_are_orientable():
    points, faces = moebius(turns=2)
    mesh = QuadMesh(points, faces)
    assert mesh.orientable
    assert mesh.report["turned"] == 0


def test_meshes_are_frozen_views_that_change_nothing():
    points = surfaces.plane().sample((4, 4))[0].points.copy()
    grid = QuadGrid(points)
    assert np.shares_memory(grid.points, points)
    assert points.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        grid.points[0, 0, 0] = 1
    mesh = grid.to_mesh()
    with pytest.raises(ValueError, match="read-only"):
        mesh.faces[0, 0] = 1


def test_with_points_keeps_the_faces():
    mesh = surfaces.cubed_sphere().sample((3, 3), "faces")[0]
    moved = mesh.with_points(2 * mesh.points)
    assert moved.faces is mesh.faces
    assert np.allclose(
        mean_curvature(moved, "finite_volume") * 2, mean_curvature(mesh, "finite_volume"), rtol=1e-14
    )
    with pytest.raises(MeshError, match=r"points: shape \(3, 3\), expected \(56, 3\)"):
        mesh.with_points(np.eye(3))


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: QuadGrid(np.zeros((4, 3))), r"points: shape \(4, 3\), expected \(r, c, 3\)"),
        (lambda: QuadGrid(np.zeros((1, 4, 3))), "points: 1 rows, at least 2 are needed"),
        (
            lambda: QuadGrid(np.zeros((4, 2, 3)), (False, True)),
            "2 columns, at least 3 .* where the grid wraps",
        ),
        (lambda: QuadGrid(np.zeros((4, 4, 3)), (True,)), "wrap: expected two booleans"),
        (lambda: QuadGrid(np.zeros((4, 4, 3)), "no"), "wrap: expected two booleans"),
        (lambda: QuadGrid(np.full((4, 4, 3), np.inf)), r"16 non-finite point\(s\), first vertex \(0, 0\)"),
        (lambda: QuadGrid(np.full((4, 4, 3), np.nan)), "mask: all 16 points are masked"),
        (
            lambda: StaggeredGrid(np.zeros((3, 3, 3)), np.zeros((3, 3, 3))),
            "primal: shape .* does not fit dual",
        ),
        (
            lambda: StaggeredGrid(np.zeros((4, 4, 3)), np.zeros((3, 3, 3)), (True, False)),
            "wrap: primal has ghost cells already",
        ),
        (
            lambda: StaggeredGrid(np.zeros((2, 3, 3)), np.zeros((3, 4, 3)), (True, False)),
            "2 rows, at least 3 are needed to wrap",
        ),
        (
            lambda: StaggeredGrid(
                np.zeros((4, 4, 3)), np.random.default_rng(0).random((5, 5, 3)), (True, False)
            ),
            "dual: first and last rows differ by .* although they wrap",
        ),
        (
            lambda: StaggeredGrid.from_mapping(surfaces.plane().mapping, [0, 1, 2], np.arange(5)),
            r"xi: shape \(3,\), expected \(cells \+ 3,\)",
        ),
    ],
)
def test_what_grids_reject(make, match):
    with pytest.raises(MeshError, match=match):
        make()


def test_unknown_boundary_is_rejected():
    with pytest.raises(ValueError, match="boundary: expected one of"):
        mean_curvature(surfaces.plane().sample((6, 6))[0], "finite_volume", boundary="mirror")


def test_offset_costs_no_more_than_the_rounding_of_the_positions():
    """At an offset of 1e6 positions are rounded to 1e-10: ghosts must not amplify that further."""
    grid = surfaces.elliptic_paraboloid().sample((16, 16))[0]
    shifted = grid.points + 1e6
    near = QuadGrid(shifted - 1e6)  # the same rounded positions, brought back exactly
    difference = np.abs(
        mean_curvature(QuadGrid(shifted), "finite_volume") - mean_curvature(near, "finite_volume")
    )
    assert difference[1:-1, 1:-1].max() < 1e-12
    assert difference.max() < 1e-6
