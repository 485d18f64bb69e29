"""Sides of meshes, or parts of them, that are one point, or nearly."""

from __future__ import annotations

from contextlib import nullcontext

import numpy as np
import pytest

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.boundary import FITTED, INTERIOR, OPEN, boundary_treatment, poles, poles_of_faces
from quadcurv.schemes import SCHEMES

ALL = [*SCHEMES]
DIVERGENT = {name for name, scheme in SCHEMES.items() if scheme.order == 0}
AXES = np.array([2.0, 1.5, 1.0])


def ball(n, m, *, wraps=True, ends=(0.0, np.pi), turned=0.0, axes=(1.0, 1.0, 1.0)):
    """Longitude by colatitude: points of a sphere or an ellipsoid, about an axis turned by an angle."""
    t = np.linspace(0, 2 * np.pi, n, endpoint=not wraps)[:, None]
    p = np.linspace(*ends, m)
    x = np.stack(np.broadcast_arrays(np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)), axis=-1)
    c, s = np.cos(turned), np.sin(turned)
    return x * axes @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T


def mean_curvature_of_ellipsoid(points, axes):
    support = 1 / np.linalg.norm(points / axes**2, axis=-1)
    return support**3 * (np.sum(axes**2) - np.sum(points**2, axis=-1)) / (2 * np.prod(axes) ** 2)


@pytest.mark.parametrize("scheme", [*ALL, "angle_defect"])
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
def test_poles_and_the_rows_beside_them_are_right(scheme, boundary):
    """The sine of pi is not quite zero: one pole is one point, the other but for rounding."""
    grid = qc.QuadGrid(ball(48, 25), (True, False))
    if scheme == "angle_defect":
        found = qc.gaussian_curvature(grid, scheme, boundary=boundary)
    else:
        found = np.abs(qc.mean_curvature(grid, scheme, boundary=boundary))
    near = found[:, [0, 1, -2, -1]]
    if boundary == "nan":
        assert np.isnan(near[:, [0, -1]]).all()
        near = near[:, 1:-1]
    assert np.isfinite(near).all()
    assert np.abs(near - 1).max() < (0.6 if scheme in DIVERGENT else 0.03)


@pytest.mark.parametrize("scheme", ["finite_volume", "cotan-6", "bunge", "jet"])
def test_second_order_at_the_poles_of_an_ellipsoid(scheme):
    errors = []
    for n in (12, 24, 48):
        points = ball(2 * n, n + 1, axes=AXES)
        H = np.abs(qc.mean_curvature(qc.QuadGrid(points, (True, False)), scheme))
        error = np.abs(H - mean_curvature_of_ellipsoid(points, AXES))
        errors.append(error[:, [0, 1, -2, -1]].max())
        if scheme != "jet":  # which is exact to eight digits along the lines of the grid, where there are any
            assert error[:, [0, 1, -2, -1]].max() < 3 * error[:, 2:-2].max()
    assert errors[-1] < (1e-6 if scheme == "jet" else 0.02)
    assert errors[-1] < errors[0] / 8


@pytest.mark.parametrize("scheme", ["finite_volume", "de_goes", "cotan-6-voronoi", "jet"])
@pytest.mark.parametrize("turned", [0.0, 1.0])
@pytest.mark.parametrize("wraps", [True, False])
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-6, 0), (1e6, 0), (1, 1e5)])
def test_size_place_orientation_and_seam_do_not_matter(
    scheme, turned, wraps, swapped, backwards, scale, offset
):
    points = scale * ball(32 + (not wraps), 17, wraps=wraps, turned=turned) + offset
    wrap = (wraps, False)
    if backwards:
        points = points[:, ::-1]
    if swapped:
        points, wrap = np.swapaxes(points, 0, 1), wrap[::-1]
    grid = qc.QuadGrid(points, wrap)
    axis = 0 if swapped else 1
    at_pole = np.moveaxis(poles(grid), axis, 0)
    assert (at_pole[1:-1] == -1).all()
    assert (at_pole[[0, -1]] == at_pole[[0, -1], :1]).all()
    assert (at_pole[[0, -1]] >= 0).all()
    seam = "the columns of points" if swapped else "the rows of points"
    with nullcontext() if wraps else pytest.warns(qc.MeshWarning, match=seam):
        H = np.moveaxis(scale * np.abs(qc.mean_curvature(grid, scheme)), axis, 0)
    assert np.abs(H[[0, 1, -2, -1]] - 1).max() < 0.05
    for end in (0, -1):  # one point, one value
        assert np.ptp(H[end]) < 1e-9


def test_all_points_of_a_pole_share_everything():
    grid = qc.QuadGrid(ball(24, 13), (True, False))
    fits = qc.curvatures(grid)
    found = qc.evaluate(grid, "mean_curvature", "mean_curvature_normal", "vertex_normals", scheme="liu")
    arrays = (fits.mean, fits.gaussian, fits.normal, *found.values())
    for values in arrays:
        for end in (0, -1):
            assert np.isfinite(values[:, end]).all()
            assert np.abs(values[:, end] - values[:1, end]).max() < 1e-12
    up = found["vertex_normals"][0, [0, -1]]
    assert np.abs(np.abs(up) - [0, 0, 1]).max() < 1e-2


def test_treatment_of_poles():
    grid = qc.QuadGrid(ball(24, 13), (True, False))
    treatment = boundary_treatment(grid)
    assert (treatment[:, [0, 1, -2, -1]] == FITTED).all()
    assert (treatment[:, 2:-2] == INTERIOR).all()
    left = boundary_treatment(grid, "nan")
    assert (left[:, [0, -1]] == OPEN).all()
    assert (left[:, [1, -2]] == FITTED).all()


@pytest.mark.parametrize("scheme", ["finite_volume", "bunge", "jet"])
def test_an_octant_with_one_side_collapsed(scheme):
    """A triangular patch: its tip is a corner, where fits look to one side."""
    t, p = np.linspace(0, np.pi / 2, 17)[:, None], np.linspace(0, np.pi / 2, 17)
    x = np.stack(np.broadcast_arrays(np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)), axis=-1)
    H = np.abs(qc.mean_curvature(qc.QuadGrid(x), scheme))
    assert np.abs(H - 1).max() < 0.05


def test_what_is_no_pole():
    """A short side, single coincident points, a whole grid far away: all is left as it is."""
    x = ball(24, 13, ends=(0.02, 3.0))
    assert poles(qc.QuadGrid(x, (True, False))) is None
    x = ball(24, 13, ends=(0.3, 2.5))
    x[3, 0] = x[4, 0]
    assert poles(qc.QuadGrid(x, (True, False))) is None
    assert poles(surfaces.torus().sample((8, 8))[0]) is None
    plane = np.stack((*np.meshgrid(np.arange(5.0), np.arange(6.0), indexing="ij"), np.zeros((5, 6))), axis=-1)
    assert poles(qc.QuadGrid(1e-8 * plane + 1e8)) is None


@pytest.mark.parametrize("scheme", [name for name in ALL if name not in DIVERGENT])
def test_staggered_grids_with_poles(scheme):
    """The corners of the first and last cells are one point: these cells are triangles."""
    n, m = 32, 16
    t, p = np.linspace(0, 2 * np.pi, 2 * n + 1)[:, None], np.linspace(0, np.pi, 2 * m + 1)
    x = np.stack(np.broadcast_arrays(np.sin(p) * np.cos(t), np.sin(p) * np.sin(t), np.cos(p)), axis=-1)
    x[-1] = x[0]
    grid = qc.StaggeredGrid(x[1::2, 1::2], x[::2, ::2], (True, False))
    H = np.abs(qc.mean_curvature(grid, scheme))
    assert np.abs(H[:, [0, -1]] - 1).max() < 0.05


@pytest.mark.parametrize("scheme", [name for name in ALL if name not in DIVERGENT])
@pytest.mark.parametrize("part", [0.2, 0.5, 0.8])
@pytest.mark.parametrize("view", ["as it is", "swapped", "backwards"])
def test_a_side_of_which_a_part_is_one_point(scheme, part, view):
    """Polar coordinates about a corner, and beyond it about nothing: a fan of triangles, then quads."""
    points = partly_one_point(part)
    x, y = points[..., 0], points[..., 1]
    slope = 1 + (0.6 * x) ** 2 + (0.4 * y) ** 2
    exact = ((1 + (0.4 * y) ** 2) * 0.6 + (1 + (0.6 * x) ** 2) * 0.4) / (2 * slope**1.5)
    if view == "swapped":
        points, exact = np.swapaxes(points, 0, 1), exact.T
    elif view == "backwards":
        points, exact = points[::-1, ::-1], exact[::-1, ::-1]
    grid = qc.QuadGrid(points)
    error = np.abs(np.abs(qc.mean_curvature(grid, scheme)) - exact)
    assert np.isfinite(error).all()
    at_pole = poles(grid) >= 0
    beside = np.roll(
        at_pole, {"as it is": 1, "swapped": 1, "backwards": -1}[view], 1 if view == "swapped" else 0
    )
    assert at_pole.sum() > 32 * part
    assert error[at_pole | beside].max() < 0.1
    if scheme in ("finite_volume", "liu", "jet", "jet-2"):  # the quads beyond are skew and narrow
        assert error.max() < 0.1


def partly_one_point(part):
    """Polar coordinates about a corner, and beyond it about nothing: (33, 33, 3)."""
    u, v = np.linspace(0, 1, 33)[:, None], np.linspace(0, 1, 33)
    r, t = 0.8 * u + np.maximum(0, 0.6 * (v - part)), 0.6 * np.pi * v
    x, y = r * np.cos(t), r * np.sin(t)
    return np.stack((x, y, 0.3 * x * x + 0.2 * y * y), axis=-1)


@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")
@pytest.mark.parametrize("scheme", ALL)
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("shape", ["ball", "part", "octant"])
def test_face_lists_have_the_poles_of_grids(shape, boundary, scheme, rng):
    """Their quads beside a pole were slivers like others: H was off by 0.9 in the next row, or NaN."""
    points, wrap = partly_one_point(0.5), (False, False)
    if shape == "ball":
        points, wrap = ball(24, 13), (True, False)
    elif shape == "octant":
        points = ball(13, 9, wraps=False, ends=(0, np.pi / 2))[:4]
    grid = qc.QuadGrid(1e3 * points + 7.0, wrap)
    mesh = grid.to_mesh()
    order = rng.permutation(len(mesh.points))
    mesh = qc.QuadMesh(mesh.points[order], np.argsort(order)[mesh.faces])
    assert np.array_equal(
        boundary_treatment(mesh, boundary), boundary_treatment(grid, boundary).ravel()[order]
    )
    H, expected = (qc.mean_curvature(m, scheme, boundary=boundary) for m in (mesh, grid))
    off = np.abs(H - expected.ravel()[order])
    if scheme not in ("jet", "jet-2"):  # one-sided fits see the points of a face list by rings of faces
        assert np.array_equal(np.isnan(H), np.isnan(expected).ravel()[order])
        # Of grids the compiled schemes read the ghosts by index at a pole's end, where a side is short.
        tolerance = 0.02 if scheme in ("finite_volume", "liu") else 1e-6
        assert np.nanmax(off) < tolerance * np.nanmax(np.abs(expected))


def test_what_is_no_pole_of_a_face_list():
    """Two points of a border at one place, and points inside: left as they are."""
    grid = surfaces.elliptic_paraboloid().sample((9, 9))[0]
    for places in (((0, 3), (0, 4)), ((4, 3), (4, 4), (4, 5))):
        points = grid.points.copy()
        points[tuple(zip(*places[1:], strict=True))] = points[places[0]]
        mesh = qc.QuadGrid(points).to_mesh()
        assert poles_of_faces(mesh.stencils()) is None
    assert poles_of_faces(grid.to_mesh().stencils()) is None


@pytest.mark.parametrize("scheme", [name for name in ALL if name not in DIVERGENT])
def test_poles_of_grids_with_holes(scheme):
    """Which are face lists; one hole ends at a pole."""
    hidden = np.zeros((24, 13), bool)
    hidden[5:7, 5:7] = hidden[:2, :3] = True
    H = np.abs(qc.mean_curvature(qc.QuadGrid(ball(24, 13), (True, False), mask=hidden), scheme))
    assert np.isfinite(H[~hidden]).all()
    assert np.abs(H[~hidden] - 1).max() < (0.2 if scheme == "jet-2" else 0.1)


# ---- collapsed parts of sides, and sides nearly collapsed -------------------------------------------------


def on_a_graph(r, t):
    """Points, H and K of z = 0.3 x^2 + 0.2 y^2 over polar coordinates."""
    x, y = r * np.cos(t), r * np.sin(t)
    slope = 1 + (0.6 * x) ** 2 + (0.4 * y) ** 2
    H = ((1 + (0.4 * y) ** 2) * 0.6 + (1 + (0.6 * x) ** 2) * 0.4) / (2 * slope**1.5)
    return np.stack((x, y, 0.3 * x * x + 0.2 * y * y), axis=-1), H, 0.24 / slope**2


u, v = np.linspace(0, 1, 33)[:, None], np.linspace(0, 1, 33)
OPENINGS = {  # the radius of the first row along it, in a row's width of 1 / 40
    "a fifth": 24 * np.maximum(0, v - 0.2),
    "half": 24 * np.maximum(0, v - 0.5),
    "most": 24 * np.maximum(0, v - 0.8),
    "a few": 24 * np.maximum(0, v - 1 / 8),
    "the middle": 40 * np.maximum(0, np.abs(v - 0.5) - 0.2),
    "both ends": 40 * np.maximum(0, 0.2 - np.abs(v - 0.5)),
    "by and by": 80 * np.maximum(0, v - 0.5) ** 2,
    "half nearly": np.maximum(1e-3, 24 * (v - 0.5)),
    "half but for 1e-6": np.maximum(1e-6, 24 * (v - 0.5)),
    **{f"all but for {e:g}": e + 0 * v for e in (0.1, 1e-2, 1e-3, 1e-6, 1e-9, 1e-12)},
}


def opened(opening, given_as):
    """A patch whose first row is collapsed in part: a mesh, its H and K."""
    points, H, K = on_a_graph((32 * u + OPENINGS[opening]) / 40, 0.6 * np.pi * v)
    if given_as == "cells":
        return qc.StaggeredGrid(points[1::2, 1::2], points[::2, ::2]), H[1::2, 1::2], K[1::2, 1::2]
    grid = qc.QuadGrid(points)
    if given_as == "grid":
        return grid, H, K
    mesh = grid.to_mesh()
    if given_as == "triangles":  # about one vertex at each place
        _, first, place = np.unique(np.round(mesh.points, 9), axis=0, return_index=True, return_inverse=True)
        faces = [
            [int(a) for a, b in zip(face, np.roll(face, 1), strict=True) if a != b]
            for face in first[place.ravel()][mesh.faces]
        ]
        used, faces = np.unique(np.concatenate(faces), return_inverse=True)[0], faces
        number = np.full(len(mesh.points), -1)
        number[used] = np.arange(used.size)
        mesh = qc.QuadMesh(mesh.points[used], [number[face].tolist() for face in faces])
        return mesh, H.ravel()[used], K.ravel()[used]
    return mesh, H.ravel(), K.ravel()


@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")
@pytest.mark.parametrize("given_as", ["grid", "faces", "triangles", "cells"])
@pytest.mark.parametrize("opening", OPENINGS)
def test_sides_that_are_collapsed_in_part_or_nearly(opening, given_as):
    """Skew cells past a pole's end, ghosts across a hole less than a cell wide: H was off by up to 2e5."""
    mesh, H, K = opened(opening, given_as)
    treatment = boundary_treatment(mesh)
    for scheme in ALL:
        off = np.abs(np.abs(qc.mean_curvature(mesh, scheme)) - H)
        two_fans = (opening, given_as) == ("both ends", "triangles")  # about one vertex
        assert np.isnan(off).sum() == two_fans
        off[np.isnan(off)] = 0.0
        assert off[treatment == FITTED].max(initial=0) < (0.6 if scheme in DIVERGENT else 0.3)
        # Cells past these are as skew as 20 degrees: of those schemes that are off by more it is told.
        assert off.max() < (15 if scheme in DIVERGENT else 0.6 if opening == "by and by" else 0.5)
        if scheme in ("finite_volume", "liu", "bunge", "jet"):
            assert off.max() < 0.1
    off = np.abs(qc.gaussian_curvature(mesh, "angle_defect") - K)
    assert np.nanmax(off) < 0.5


def test_narrow_cells_alone_are_no_pole():
    """Columns a thousandth as wide as rows are high, along the whole of a grid; a strip of such."""
    for columns in (4, 33):
        x, y = np.meshgrid(np.linspace(0, 1, 17), 1e-3 / 16 * np.arange(columns), indexing="ij")
        assert poles(qc.QuadGrid(np.stack((x, y, x * x), axis=-1))) is None
        assert poles(qc.QuadGrid(np.stack((x, y, x * x), axis=-1).swapaxes(0, 1))) is None
