"""Polygons cut into triangles: no sliver where a cut without one exists, and nothing lost or turned over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import quadcurv as qc
from quadcurv.polygons import cut
from quadcurv.schemes import SCHEMES

PLACES = [(1.0, 0.0), (1e-6, 0.0), (1e6, 0.0), (1.0, 1e6)]  # scale, offset


def turned(flat, seed=0, scale=1.0, offset=0.0):
    """Points (n, 2) in a plane turned in space."""
    points = np.column_stack((flat, np.zeros(len(flat))))
    return points @ Rotation.random(rng=np.random.default_rng(seed)).as_matrix().T * scale + offset


def pieces(points, *polygons):
    """Triangles of polygons, and the polygon of each."""
    indptr = np.concatenate(([0], np.cumsum([len(p) for p in polygons])))
    return cut(np.asarray(points, float), indptr, np.concatenate(polygons).astype(np.int32))


def signed_areas(flat, triangles):
    a, b, c = (flat[triangles[:, i]] for i in range(3))
    (ux, uy), (vx, vy) = (b - a).T, (c - a).T
    return (ux * vy - uy * vx) / 2


def shoelace(flat):
    x, y = flat.T
    return np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y) / 2


def star(sides, inner=0.4):
    """Corners at two radii by turns."""
    angle = 2 * np.pi * np.arange(sides) / sides
    radius = np.where(np.arange(sides) % 2, inner, 1.0)
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))


# ---- hanging nodes --------------------------------------------------------------------------------------


def refined(n=12):
    """Cells of a unit square, those in the middle cut in four: the ones beside have five sides."""
    place, flat, faces = {}, [], []

    def vertex(x, y):
        if (x, y) not in place:
            place[x, y] = len(flat)
            flat.append((x / (2 * n), y / (2 * n)))
        return place[x, y]

    def fine(i, j):
        return n <= 3 * i < 2 * n and n <= 3 * j < 2 * n

    for i in range(n):
        for j in range(n):
            x, y = 2 * i, 2 * j
            if fine(i, j):
                for a, b in ((x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)):
                    faces.append([vertex(a, b), vertex(a + 1, b), vertex(a + 1, b + 1), vertex(a, b + 1)])
                continue
            face, beside = [], ((i, j - 1), (i + 1, j), (i, j + 1), (i - 1, j))
            corners = [(x, y), (x + 2, y), (x + 2, y + 2), (x, y + 2)]
            for k, (p, q) in enumerate(corners):
                face.append(vertex(p, q))
                if fine(*beside[k]):
                    r, s = corners[(k + 1) % 4]
                    face.append(vertex((p + r) // 2, (q + s) // 2))
            faces.append(face)
    return np.array(flat), faces


@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("seed", range(3))
def test_hanging_nodes_leave_no_sliver(seed, scale, offset):
    flat, faces = refined()
    mesh = qc.QuadMesh(turned(flat, seed, scale, offset), faces)
    triangles = mesh.faces[mesh.faces[:, 3] < 0, :3]
    assert len(triangles) == 16 * 3
    assert signed_areas(flat, triangles).min() == pytest.approx(1 / (4 * 144))
    for scheme in SCHEMES:
        H = qc.mean_curvature(mesh, scheme)
        assert np.isfinite(H[mesh.stencils().closed]).all()
        # As exact as the positions: their rounding over the square of an edge.
        rounding = 2.0**-52 * np.abs(mesh.points).max() / (scale / 24) ** 2
        assert np.nanmax(np.abs(H)) < 100 * rounding


# ---- single polygons ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("scale", "offset"), PLACES)
@pytest.mark.parametrize("sides", [5, 6, 8, 12, 40, 41, 42, 100])
def test_concave_polygons(sides, scale, offset):
    """A star: every triangle lies inside, and together they are the star."""
    flat = star(sides)
    for start in (0, 1, sides // 2):
        triangles, _ = pieces(turned(flat, sides, scale, offset), np.roll(np.arange(sides), start))
        areas = signed_areas(flat, triangles)
        assert len(triangles) == sides - 2
        assert areas.min() > -1e-7
        assert areas.sum() == pytest.approx(shoelace(flat), rel=1e-6)


def every_cut(first, last):
    """All ways to cut the corners first, ..., last into triangles."""
    if last - first < 2:
        return [[]]
    return [
        [(first, middle, last), *left, *right]
        for middle in range(first + 1, last)
        for left in every_cut(first, middle)
        for right in every_cut(middle, last)
    ]


def test_no_cut_has_a_better_worst_triangle():
    def worst(flat, triangles):
        t = np.array(triangles)
        edges = sum(((flat[t[:, i]] - flat[t[:, i - 1]]) ** 2).sum(axis=1) for i in range(3))
        return (signed_areas(flat, t) / edges).min()

    assert len(every_cut(0, 6)) == 42
    rng = np.random.default_rng(5)
    for seed in range(30):
        angle = 2 * np.pi * (np.arange(7) + rng.uniform(0, 0.9, 7)) / 7
        flat = np.column_stack((np.cos(angle), np.sin(angle))) * rng.uniform(0.3, 1, (7, 1))
        found, _ = pieces(turned(flat, seed), range(7))
        assert worst(flat, found) > max(worst(flat, t) for t in every_cut(0, 6)) - 1e-12


@pytest.mark.parametrize("sides", [6, 60])
def test_polygons_that_cross_themselves(sides):
    """Twice round a circle: triangles cannot all lie inside, but all corners are kept, and nothing fails."""
    angle = 4 * np.pi * np.arange(sides) / sides
    radius = 1 + 0.1 * np.arange(sides) / sides
    flat = np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))
    triangles, _ = pieces(turned(flat), range(sides))
    assert len(triangles) == sides - 2
    assert set(triangles.ravel()) == set(range(sides))
    assert signed_areas(flat, triangles).sum() == pytest.approx(shoelace(flat))


@pytest.mark.parametrize(("scale", "offset"), PLACES)
def test_bridged_polygons(scale, offset):
    """A square with a square hole, its rims joined by an edge that is run through to and fro."""
    flat = np.array([(0, 0), (3, 0), (3, 3), (0, 3), (1, 1), (2, 1), (2, 2), (1, 2)], float)
    bridged = [0, 1, 2, 3, 0, 4, 7, 6, 5, 4]
    triangles, _ = pieces(turned(flat, 3, scale, offset), bridged)
    areas = signed_areas(flat, triangles)
    assert areas.sum() == pytest.approx(8)
    assert areas.min() > 0.4
    inside = flat[triangles].mean(axis=1)
    assert not ((inside > 1) & (inside < 2)).all(axis=1).any()


def test_a_bridged_polygon_in_every_scheme():
    """A plate with a hole in it, filled by a quad, inside a larger plane."""
    x, y = np.meshgrid(np.arange(6.0), np.arange(6.0), indexing="ij")
    flat = np.column_stack((x.ravel(), y.ravel()))
    number = np.arange(36).reshape(6, 6)
    quads = [
        [number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]]
        for i in range(5)
        for j in range(5)
        if not (1 <= i < 4 and 1 <= j < 4) or (i, j) == (2, 2)
    ]
    outer = [*number[1:4, 1], *number[4, 1:4], *number[4:1:-1, 4], *number[1, 4:1:-1]]
    inner = [number[2, 2], number[2, 3], number[3, 3], number[3, 2]]
    bridged = [*outer, outer[0], *inner, inner[0]]
    mesh = qc.QuadMesh(turned(flat), [*quads, bridged])
    assert mesh.report["cut"] == 1
    for scheme in SCHEMES:
        H = qc.mean_curvature(mesh, scheme)
        assert np.isfinite(H).any()
        assert np.nanmax(np.abs(H)) < 1e-9


@settings(max_examples=40, deadline=None)
@given(sides=st.integers(5, 12), seed=st.integers(0, 2**31))
def test_any_simple_polygon(sides, seed):
    """Radii at random about the middle: the area is kept, no triangle is turned over, wherever it begins."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(sides) + rng.uniform(0, 0.8, sides)) / sides
    flat = np.column_stack((np.cos(angle), np.sin(angle))) * rng.uniform(0.2, 1, (sides, 1))
    triangles, polygon = pieces(turned(flat, seed), range(sides))
    areas = signed_areas(flat, triangles)
    assert areas.sum() == pytest.approx(shoelace(flat), rel=1e-12)
    assert areas.min() > 0
    assert (polygon == 0).all()
    again, _ = pieces(turned(flat, seed), np.roll(range(sides), seed % sides))
    assert {frozenset(t) for t in again.tolist()} == {frozenset(t) for t in triangles.tolist()}


def test_many_polygons_of_several_sizes_come_out_in_order():
    flats = [star(5), star(7) + 3, star(5) + 6]
    points = turned(np.concatenate(flats))
    triangles, polygon = pieces(points, range(5), range(5, 12), range(12, 17))
    assert polygon.tolist() == [0] * 3 + [1] * 5 + [2] * 3
    assert [set(triangles[polygon == k].ravel()) for k in range(3)] == [
        set(range(5)),
        set(range(5, 12)),
        set(range(12, 17)),
    ]
