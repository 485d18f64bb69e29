"""Ghosts beyond the boundary: exactness, order, and which vertices get none."""

from __future__ import annotations

from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadcurv import (
    SCHEMES,
    Laplacian,
    MeshError,
    QuadGrid,
    QuadMesh,
    mean_curvature,
    one_rings,
    surfaces,
    vertex_normals,
)
from quadcurv.boundary import (
    EXTRAPOLATED,
    FITTED,
    INTERIOR,
    OPEN,
    boundary_treatment,
    ghost_layer,
    ghosts,
    strips,
)
from quadcurv.refinement import fitted_rate

every_laplacian = pytest.mark.parametrize(
    "scheme", [name for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)]
)


def grid_quads(index):
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return quads.reshape(-1, 4)


def square(n):
    """A square of 2 n x 2 n cells: parameters (p, 2) and quads."""
    t = np.linspace(-1, 1, 2 * n + 1)
    uv = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    return uv, grid_quads(np.arange(t.size**2).reshape(t.size, t.size))


def without_unused(points, faces):
    used, faces = np.unique(faces, return_inverse=True)
    return points[used], faces.reshape(-1, 4)


def l_shape(n):
    """The square without a quarter: one re-entrant corner, at the origin."""
    uv, quads = square(n)
    return without_unused(uv, quads[~(uv[quads].mean(axis=1) > 0).all(axis=1)])


def annulus(n):
    """Cells around a closed direction eta in [0, 2 pi), open in xi."""
    xi, eta = np.linspace(-1, 1, 2 * n + 1), np.arange(4 * n) * np.pi / (2 * n)
    index = np.arange(xi.size * eta.size).reshape(xi.size, eta.size)
    uv = np.stack(np.meshgrid(xi, eta, indexing="ij"), axis=-1).reshape(-1, 2)
    return uv, grid_quads(np.pad(index, [(0, 0), (0, 1)], mode="wrap"))


def disc(valence):
    """Sectors of n x n quads around one vertex, bent by z^(4 / valence): smooth but at that vertex."""

    def cells(n):
        t = np.linspace(0, 1, n + 1)
        z = t[:, None] + 1j * t
        z = (np.abs(z) * np.exp(1j * np.angle(z))) ** (4 / valence)
        sectors = np.concatenate([(z * np.exp(2j * np.pi * k / valence)).ravel() for k in range(valence)])
        xy = np.stack((sectors.real, sectors.imag), axis=1)
        _, first, welded = np.unique(np.round(xy, 9) + 0.0, axis=0, return_index=True, return_inverse=True)
        index = np.arange(sectors.size).reshape(valence, n + 1, n + 1)
        return xy[first], welded.ravel()[np.concatenate([grid_quads(i) for i in index])]

    return cells


def shuffled(points, faces, rng, turn_starts=True):
    """The same quads, vertices and faces in another order, each beginning at another corner."""
    order = rng.permutation(len(points))
    faces = np.argsort(order)[rng.permutation(faces)]
    if turn_starts:
        start = rng.integers(0, 4, len(faces))
        faces = np.take_along_axis(faces, (np.arange(4) + start[:, None]) % 4, axis=1)
    return points[order], faces, order


# ---- face lists of grids ------------------------------------------------------------------------------

GRIDS = {
    "5 x 5": (surfaces.elliptic_paraboloid, (5, 5)),
    "5 x 9": (surfaces.hyperbolic_paraboloid, (5, 9)),
    "12 x 7": (surfaces.tanh_sheet, (12, 7)),
    "catenoid": (surfaces.catenoid, (6, 11)),
    "narrow tube": (surfaces.cylinder, (3, 5)),
    "torus": (surfaces.torus, (6, 7)),
}


@every_laplacian
@pytest.mark.parametrize("name", GRIDS)
def test_a_grid_as_a_shuffled_face_list_has_the_ghosts_of_the_grid(name, scheme, rng):
    surface, cells = GRIDS[name]
    surface = surface()
    axes = [
        np.linspace(a, b, k, endpoint=not wraps)
        for (a, b), k, wraps in zip(surface.domain, cells, surface.wrap, strict=True)
    ]
    grid = QuadGrid(surface.mapping(axes[0][:, None], axes[1]), surface.wrap)
    mesh = grid.to_mesh()
    # One fixed diagonal per quad goes from its first vertex: there, faces must begin where they did.
    points, faces, order = shuffled(mesh.points, mesh.faces, rng, not scheme.startswith("cotan-6"))
    mesh = QuadMesh(points, faces)
    H = mean_curvature(grid, scheme).ravel()[order]
    assert np.isfinite(H).all()
    assert np.abs(mean_curvature(mesh, scheme) - H).max() < 1e-12 * max(np.abs(H).max(), 1)
    assert np.array_equal(boundary_treatment(mesh), boundary_treatment(grid).ravel()[order])
    assert len(one_rings(mesh).points) == len(one_rings(grid).points)


def quartic(i, j):
    """A surface whose coordinates are quartic in each index: extrapolation continues it exactly."""
    x, y = i / 8 - 0.7, j / 8 - 0.6
    return np.stack((x + 0.1 * y**2, y - 0.1 * x**2 * y, 0.5 * x**2 + y**2 * x**2 - 0.3 * y**4 * x), axis=-1)


@pytest.mark.parametrize(("degree", "layers"), [(5, 2), (4, 1), (4, 2)])
@pytest.mark.parametrize("shape", [(6, 6), (13, 8)])
def test_layers_of_a_face_list_are_those_of_the_grid(shape, degree, layers, rng):
    grid = QuadGrid(quartic(*np.mgrid[: shape[0], : shape[1]]))
    mesh = grid.to_mesh()
    points, faces, _ = shuffled(mesh.points, mesh.faces, rng)
    given = QuadMesh(points, faces).stencils()
    layer = ghosts(given, degree, layers)
    index, expected = ghost_layer(grid.points, grid.wrap, degree, layers)
    assert len(layer.points) == len(expected)
    apart = np.linalg.norm(layer.points[:, None] - expected, axis=2)
    assert max(apart.min(axis=0).max(), apart.min(axis=1).max()) < 1e-11
    # The quads are those of the larger grid: all vertices but its outermost are closed.
    whole = QuadMesh(np.vstack((given.points, layer.points)), np.vstack((given.faces, layer.quads)))
    assert whole.report["turned"] == 0
    outermost = 2 * sum(index.shape)
    assert np.count_nonzero(~whole.stencils().closed) == outermost - 4


def test_strips_go_on_past_the_corners_of_a_hole():
    """Only the lines that a hole cuts short have no ghosts of their own."""
    points = quartic(*np.mgrid[:14, :12])
    hidden = np.zeros((14, 12), bool)
    hidden[3, 6] = True
    treatment = boundary_treatment(QuadGrid(points, mask=hidden))[0]
    assert (treatment[[5, 6, 7]] == FITTED).all()
    assert (np.delete(treatment, [5, 6, 7]) == EXTRAPOLATED).all()


@given(st.data())
@settings(max_examples=60, derandomize=True, deadline=None)
def test_ghosts_of_any_part_of_a_grid_continue_it(data):
    """On a part of a quartic grid vertices have the curvature that they have inside the whole, or NaN.

    Save where a surface is fitted.
    """
    size = 14
    kept = np.zeros((size, size), bool)
    for _ in range(data.draw(st.integers(1, 4))):
        low = data.draw(st.tuples(st.integers(0, 9), st.integers(0, 9)))
        high = data.draw(st.tuples(st.integers(low[0] + 1, size), st.integers(low[1] + 1, size)))
        kept[low[0] : high[0], low[1] : high[1]] ^= True
    if not kept.any():
        return
    i, j = np.mgrid[0 : size + 1, 0 : size + 1]
    faces = grid_quads((size + 1) * i + j)[kept.ravel()]
    mesh = QuadMesh(quartic(i, j).reshape(-1, 3), faces)
    i, j = np.mgrid[-1 : size + 2, -1 : size + 2]
    whole = QuadGrid(quartic(i, j))
    treated, closed = boundary_treatment(mesh), one_rings(mesh).closed
    for scheme in ("finite_volume", "liu", "cotan-4", "cotan-6"):
        expected = mean_curvature(whole, scheme, boundary="nan")[1:-1, 1:-1].ravel()
        H = mean_curvature(mesh, scheme)
        assert not np.isfinite(H[~closed]).any()
        assert np.isfinite(H[treated != FITTED]).sum() == np.count_nonzero(closed & (treated != FITTED))
        # Of five points alone nobody can tell that they are even.
        with mock.patch.object(strips, "LEAST", 6):
            of_six = np.isfinite(ghosts(mesh.stencils(), 5).error) & (treated == EXTRAPOLATED)
        assert np.abs(H - expected)[of_six | (treated == INTERIOR)].max(initial=0) < 1e-9
    # Ghosts make a mesh of their own; its closed rings are the ones that are said to be closed.
    ghosted = one_rings(mesh)
    if len(ghosted.points) > len(mesh.points):
        again = QuadMesh(ghosted.points, ghosted.faces)
        assert again.report["turned"] == 0
        assert np.array_equal(again.stencils().closed[: ghosted.n], closed)
    assert np.array_equal(treated == INTERIOR, mesh.stencils().closed)


@pytest.mark.parametrize("scheme", ["finite_volume", "liu", "cotan-4"])
def test_a_moebius_strip_has_the_ghosts_of_its_double_cover(scheme):
    r, c = 20, 6
    u, v = np.arange(2 * r)[:, None] * 2 * np.pi / r, np.linspace(-0.4, 0.4, c)
    R = 2 + v * np.cos(u / 2)
    points = np.stack((R * np.cos(u), R * np.sin(u), v * np.sin(u / 2)), axis=-1)
    index = np.arange(r * c).reshape(r, c)
    faces = grid_quads(np.vstack((index, index[:1, ::-1])))
    with pytest.warns(UserWarning, match="non-orientable"):
        strip = QuadMesh(points[:r].reshape(-1, 3), faces)
    H = np.abs(mean_curvature(QuadGrid(points, (True, False)), scheme))[:r].ravel()
    assert np.abs(mean_curvature(strip, scheme) - H).max() < 1e-12
    assert np.count_nonzero(boundary_treatment(strip) == EXTRAPOLATED) == 2 * r


# ---- order --------------------------------------------------------------------------------------------

# On the discs the cotan formula is of first order where diagonals of two sectors meet, inside as well.
ORDER = [
    # surface, cells, bounds of the error on the boundary at the finest of 12, 24 and 48 cells
    ("elliptic_paraboloid", square, {"finite_volume": 1.7e-5, "liu": 3.5e-5, "cotan-6": 4e-5}),
    ("hyperbolic_paraboloid", square, {"finite_volume": 6e-5, "liu": 8e-5, "cotan-6": 8e-5}),
    ("catenoid", annulus, {"finite_volume": 2.4e-5, "liu": 2.4e-5, "cotan-6": 2.4e-5}),
    ("elliptic_paraboloid", l_shape, {"finite_volume": 9e-4, "liu": 1.8e-3, "cotan-6": 1.8e-3}),
    ("hyperbolic_paraboloid", l_shape, {"finite_volume": 2e-4, "liu": 2.8e-4, "cotan-6": 2.8e-4}),
    ("elliptic_paraboloid", disc(3), {"finite_volume": 5e-5, "liu": 1.4e-4}),
    ("elliptic_paraboloid", disc(5), {"finite_volume": 5e-5, "liu": 3.5e-5}),
    ("hyperbolic_paraboloid", disc(3), {"finite_volume": 1.1e-4, "liu": 1.5e-4}),
]


@pytest.mark.parametrize(
    ("name", "cells", "scheme", "bound"),
    [(name, cells, scheme, bound) for name, cells, bounds in ORDER for scheme, bound in bounds.items()],
)
def test_second_order_on_the_boundary_with_the_error_of_the_interior(name, cells, scheme, bound, rng):
    surface = surfaces.SURFACES[name]()
    sizes, errors = (12, 24, 48), []
    for n in sizes:
        uv, faces = cells(n)
        uv, faces, _ = shuffled(uv, faces, rng, scheme != "cotan-6")
        mesh = QuadMesh(surface.mapping(*uv.T), faces)
        treatment = boundary_treatment(mesh)
        error = np.abs(mean_curvature(mesh, scheme) - surface.mean_curvature(*uv.T))
        assert np.isfinite(error[treatment != OPEN]).all()
        # Near an extraordinary vertex no scheme is of second order.
        odd = (treatment == INTERIOR) & (mesh.stencils().valence != 4)
        away = (np.linalg.norm(uv - uv[odd][:, None], axis=2) > 0.5).all(axis=0)
        border = error[(treatment == EXTRAPOLATED) & away].max()
        if n == sizes[-1]:  # on coarse meshes lines end beside bends that five points do not tell
            assert border < 2 * error[(treatment == INTERIOR) & away].max()
        errors.append(border)
    assert fitted_rate(sizes, errors) > 1.9
    assert errors[-1] < bound


@pytest.mark.parametrize("cells", [square, l_shape, annulus, disc(3), disc(5)])
def test_normals_on_the_boundary_converge(cells):
    surface = surfaces.catenoid() if cells is annulus else surfaces.tanh_sheet()
    errors = []
    for n in (8, 16):
        uv, faces = cells(n)
        mesh = QuadMesh(surface.mapping(*uv.T), faces)
        step = 1e-5
        sides = [surface.mapping(*(uv + d).T) - surface.mapping(*(uv - d).T) for d in step * np.eye(2)]
        normal = np.cross(*sides)
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        border = boundary_treatment(mesh) == EXTRAPOLATED
        errors.append(np.linalg.norm(vertex_normals(mesh) - normal, axis=1)[border].max())
    assert errors[1] < 0.02
    assert errors[1] < errors[0] / 3.2


@pytest.mark.parametrize("degree", [4, 5])
def test_lines_whose_differences_vanish_to_the_last_digit_are_smooth(degree):
    """A quadratic on a grid of binary fractions: nothing over nothing is no doubt."""
    x, y = np.meshgrid(np.arange(17) / 16, np.arange(13) / 16, indexing="ij")
    layer = ghosts(QuadGrid(np.stack((x, y, x * y + x * x), axis=-1)).stencils(), degree, 3)
    beyond = layer.points[np.isfinite(layer.points).all(axis=1)]
    assert np.count_nonzero(layer.smooth) == 2 * (17 + 13) - 4
    assert np.abs(beyond[:, 2] - beyond[:, 0] * (beyond[:, 1] + beyond[:, 0])).max() < 1e-11


# ---- where there are no ghosts ------------------------------------------------------------------------


def flat(uv):
    return np.column_stack((uv, uv[:, 0] ** 2))


def fitted_vertices(uv, faces):
    treatment = boundary_treatment(QuadMesh(flat(uv), faces))
    assert OPEN not in treatment
    return uv[treatment == FITTED]


def test_a_reentrant_corner_gets_a_surface_alone():
    assert fitted_vertices(*l_shape(8)).tolist() == [[0, 0]]


def test_strips_too_short_get_surfaces():
    """Three points across are one too few for a cubic, on a grid as well."""
    uv, faces = square(8)
    three, faces = without_unused(uv, faces[uv[faces][:, :, 1].max(axis=1) <= -1 + 2 / 8 + 1e-9])
    assert len(np.unique(three[:, 1])) == 3
    mesh, grid = QuadMesh(flat(three), faces), QuadGrid(flat(three).reshape(17, 3, 3))
    treatment = boundary_treatment(mesh)
    short_end = (np.abs(three[:, 0]) == 1) & (np.abs(three[:, 1] + 1 - 1 / 8) < 1e-9)
    assert np.array_equal(treatment == EXTRAPOLATED, short_end)
    assert np.count_nonzero(treatment == FITTED) == 2 * 17
    assert np.array_equal(boundary_treatment(grid).ravel(), treatment)
    for scheme in ("finite_volume", "bunge"):
        H = mean_curvature(grid, scheme).ravel()
        assert np.abs(H - mean_curvature(mesh, scheme)).max() < 1e-12
        x = three[:, 0]
        assert np.abs(H + 1 / (1 + 4 * x * x) ** 1.5).max() < 0.1


def test_a_triangle_at_the_boundary_stops_the_strips_of_its_vertices_and_their_neighbours():
    uv, faces = square(8)
    cut = np.flatnonzero((uv[faces][:, :, 0].min(axis=1) == 0) & (uv[faces][:, :, 1].min(axis=1) == -1))
    assert cut.size == 1
    a, b, c, d = faces[cut[0]]
    rest = np.delete(faces, cut, axis=0).tolist()
    stopped = fitted_vertices(uv, [*rest, [a, b, c], [c, d, a]])
    assert sorted(stopped.tolist()) == [[-0.125, -1], [0, -1], [0.125, -1], [0.25, -1]]


@pytest.mark.parametrize(("valence", "n", "count"), [(3, 2, 12), (5, 2, 20), (3, 3, 0), (5, 3, 0)])
def test_an_extraordinary_vertex_within_three_quads_stops_its_line(valence, n, count):
    """It may be the fourth point of a line. Nearer, the line's end gets a surface, with the vertices on both
    sides of it and the corners whose ghost would rest on its ghost.
    """
    uv, faces = disc(valence)(n)
    given = QuadMesh(flat(uv), faces).stencils()
    assert np.count_nonzero(~given.closed & np.isinf(ghosts(given).error)) == count
    assert len(fitted_vertices(uv / 4, faces)) >= count


@pytest.mark.parametrize("touch", [(1, 1), (1, 0)])
def test_patches_that_touch_in_a_vertex_stay_open_there_alone(touch):
    """At a corner of both, and at a corner of one in the middle of a side of the other."""
    uv, faces = square(4)
    one = np.flatnonzero((uv == touch).all(axis=1))[0]
    other = np.flatnonzero((uv == (-1, -1)).all(axis=1))[0]
    faces_of_other = np.where(faces == other, one, faces + len(uv))
    mesh = QuadMesh(flat(np.vstack((uv, uv + touch + (1, 1)))), np.vstack((faces, faces_of_other)))
    # The second one of the pair has lost its faces.
    assert np.flatnonzero(boundary_treatment(mesh) == OPEN).tolist() == [one, len(uv) + other]


@pytest.mark.parametrize("faces", [[[0, 1, 2, 3]], [[0, 1, 2, 3], [3, 2, 4, 5]], [[0, 1, 2]]])
def test_a_face_or_two_have_no_curvature(faces):
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (1, 2, 0), (0, 2, 0)], float)
    mesh = QuadMesh(points, faces)
    assert (boundary_treatment(mesh) == OPEN).all()
    for scheme in ("finite_volume", "liu", "cotan-4", "cotan-6"):
        assert np.isnan(mean_curvature(mesh, scheme)).all()


def test_boundaries_can_be_left_open():
    uv, faces = square(4)
    mesh = QuadMesh(flat(uv), faces)
    inside = (np.abs(uv) < 1).all(axis=1)
    assert np.array_equal(np.isnan(mean_curvature(mesh, "finite_volume", boundary="nan")), ~inside)
    assert np.array_equal(boundary_treatment(mesh, "nan"), np.where(inside, INTERIOR, OPEN))
    with pytest.raises(ValueError, match="boundary: expected one of"):
        one_rings(mesh, "mirror")


def test_the_real_strip(shared_meshes):
    from quadcurv import read

    with pytest.warns(UserWarning, match="non-orientable"):
        mesh = read(shared_meshes / "moebius.obj")
    assert np.bincount(boundary_treatment(mesh)).tolist() == [0, 168, 98, 14]
    assert np.isfinite(mean_curvature(mesh, "finite_volume")).all()


# ---- ghost layers of grids ----------------------------------------------------------------------------


def test_one_layer_is_the_quartic_formula(rng):
    points = rng.random((6, 5, 3))
    index, ghosts = ghost_layer(points, (False, True))
    assert index.shape == (8, 5)
    assert np.array_equal(index[1:-1], np.arange(30).reshape(6, 5))
    X = np.concatenate((points.reshape(-1, 3), ghosts))[index]
    quartic_formula = 5 * points[0] - 10 * points[1] + 10 * points[2] - 5 * points[3] + points[4]
    assert np.allclose(X[0], quartic_formula, rtol=0, atol=1e-13)


@pytest.mark.parametrize(("degree", "layers"), [(4, 1), (5, 2), (5, 3), (2, 2)])
def test_layers_lie_on_the_polynomial_of_their_degree_and_no_higher(degree, layers):
    def grid(power):
        i, j = np.mgrid[-layers : 7 + layers, -layers : 8 + layers] / 4.0
        return np.stack((i**power + j, j**power, i**power * j**power), axis=-1)

    inner = (slice(layers, -layers),) * 2
    for power, exact in ((degree, True), (degree + 1, False)):
        whole = grid(power)
        index, ghosts = ghost_layer(whole[inner], (False, False), degree, layers)
        found = np.concatenate((whole[inner].reshape(-1, 3), ghosts))[index]
        error = np.abs(found - whole).max() / np.abs(whole).max()
        assert error < 1e-12 if exact else error > 1e-4


def test_two_quintic_layers_are_of_sixth_order():
    sizes, errors = (10, 20, 40), []
    for n in sizes:
        t = np.arange(-2, n + 3) / n
        whole = np.stack((*np.meshgrid(t, t, indexing="ij"), np.sin(t[:, None] + 2 * t)), axis=-1)
        index, ghosts = ghost_layer(whole[2:-2, 2:-2], (False, False), 5, 2)
        found = np.concatenate((whole[2:-2, 2:-2].reshape(-1, 3), ghosts))[index]
        errors.append(np.abs(found - whole).max())
    assert fitted_rate(sizes, errors) > 5.5
    assert errors[-1] < 1e-5


def test_layers_need_points():
    with pytest.raises(MeshError, match=r"points: 5 rows, but extrapolation .* needs at least 6"):
        ghost_layer(np.zeros((5, 9, 3)), (False, False), degree=5, layers=2)


# ---- fitted surfaces ------------------------------------------------------------------------------------


def test_fitted_surfaces_are_weighted_least_squares(rng):
    """Eight at a time and alone: coefficients, noise and its gain are those of numpy's least squares."""
    from quadcurv.kernels import nearby, surfaces, topology

    uv, faces = square(5)
    points = quartic(*(5 * (uv + 1) + rng.uniform(-0.2, 0.2, uv.shape)).T)
    given = QuadMesh(points + rng.normal(0, 1e-3, points.shape), faces).stencils()
    vertices = np.flatnonzero(~given.closed)[:19]
    corners = topology.corners_by_vertex(given.faces, given.n)
    around, ring = nearby.rings_around(given.faces, *corners, vertices, 5, 80)
    frames = np.broadcast_to(np.eye(3), (19, 3, 3))
    kinds = ((5, 5), (4, 4), (2, 2), (2, 1))
    ways = frames, *zip(*kinds, strict=True)
    found = surfaces.fits(given.points, 0 * given.ring_areas, True, around, ring, *ways)
    one = surfaces.fits(
        given.points, 0 * given.ring_areas, True, around[3:4], ring[3:4], frames[:1], *ways[1:]
    )
    np.testing.assert_array_equal(one[0], found[3])
    for k, v in enumerate(vertices):
        for i, (degree, rings) in enumerate(kinds):
            near, T = around[k][(ring[k] > 0) & (ring[k] <= rings)], (degree + 1) * (degree + 2) // 2 - 1
            if near.size < T + surfaces.SPARE:
                assert np.isnan(found[k, i]).all()
                continue
            x = given.points[near] - given.points[v]
            u = x[:, :2] @ found[k, i, :4].reshape(2, 2).T
            assert np.allclose(u.T @ u / (u**2).sum() * 2, np.eye(2), atol=1e-12)
            r = np.linalg.norm(u, axis=1)
            assert np.isclose(r.max(), 1)
            w = (1 - r / surfaces.SPREAD) ** 4 * (4 * r / surfaces.SPREAD + 1)
            terms = np.stack([u[:, 0] ** a * u[:, 1] ** b for a, b in surfaces.TERMS[:T]], axis=1)
            maps = np.linalg.pinv(w[:, None] * terms) * w
            left = w * (x[:, 2] - terms @ maps @ x[:, 2])
            free = np.trace((np.eye(near.size) - (w[:, None] * terms) @ maps / w) * w**2)
            noise = np.sqrt((left**2).sum() / free)
            first = np.flatnonzero(ring[k][(ring[k] > 0) & (ring[k] <= rings)] == 1)
            beyond = np.stack([(-u[first, 0]) ** a * (-u[first, 1]) ** b for a, b in surfaces.TERMS[:T]])
            gain = np.sqrt(((beyond.T @ maps) ** 2).sum() / first.size)
            np.testing.assert_allclose(found[k, i, 4 : 4 + T], maps @ x[:, 2], rtol=1e-9, atol=1e-11)
            np.testing.assert_allclose(found[k, i, surfaces.NOISE], noise, rtol=1e-8)
            np.testing.assert_allclose(found[k, i, surfaces.GAIN], gain, rtol=1e-9)
