"""Grids that meet: values as one mesh has them, cells among their neighbours, and what is refused."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import quadcurv as qc
from quadcurv.mesh.connections import SIDES
from quadcurv.surfaces import cubed_ellipsoid, cubed_sphere, pillow_sphere, torus

LAPLACIANS = [name for name, scheme in qc.SCHEMES.items() if isinstance(scheme, qc.Laplacian)]


def spread(n: int, first: float = 0.0, last: float = 1.0) -> np.ndarray:
    return np.linspace(first, last, n + 1)


def vertices(surface, n, m=None, **options) -> qc.GridBlocks:
    """The panels of a surface in grids of vertices."""
    xi, eta = np.meshgrid(spread(n), spread(m or n), indexing="ij")
    return qc.GridBlocks([surface.mapping(xi + offset, eta) for offset in surface.panels], **options)


def cells_of(mapping, xi, eta) -> qc.StaggeredGrid:
    """Cells without ghost cells."""
    middle = (xi[1:] + xi[:-1]) / 2, (eta[1:] + eta[:-1]) / 2
    return qc.StaggeredGrid(mapping(middle[0][:, None], middle[1]), mapping(xi[:, None], eta))


def cells(surface, n) -> qc.GridBlocks:
    return qc.GridBlocks([cells_of(surface.mapping, spread(n) + o, spread(n)) for o in surface.panels])


@pytest.fixture
def rough() -> qc.GridBlocks:
    """A closed ellipsoid in six panels, off the surface by noise; some panels turned and mirrored twice."""
    surface = cubed_ellipsoid()
    xi, eta = np.meshgrid(spread(9), spread(9), indexing="ij")
    panels = [surface.mapping(xi + offset, eta) for offset in surface.panels]
    noise = np.random.default_rng(5)
    blocks = []
    for k, panel in enumerate(panels):
        inner = panel[1:-1, 1:-1]
        inner += noise.normal(0, 0.01, inner.shape)
        blocks.append(np.rot90(panel, k))
    return qc.GridBlocks(blocks)


def sheet(r, c, x0=0.0, y0=0.0) -> np.ndarray:
    """Part of a hill of spacing 0.1."""
    x, y = np.meshgrid(x0 + 0.1 * np.arange(r), y0 + 0.1 * np.arange(c), indexing="ij")
    return np.stack([x, y, np.sin(x) * np.cos(y)], axis=-1)


# Connections


def test_a_cubed_sphere_has_twelve_seams_and_eight_corners():
    blocks = vertices(cubed_sphere(), 6)
    assert len(blocks.connections) == 12
    assert blocks.n == 6 * 6 * 6 + 2
    assert np.bincount(blocks.mesh.stencils().valence)[3:].tolist() == [8, blocks.n - 8]
    assert repr(blocks) == "GridBlocks(6 blocks, 12 connections, 218 vertices)"
    assert not blocks.mesh.report


@pytest.mark.parametrize("turns", range(4))
def test_sides_are_found_whichever_way_a_block_is_turned(turns):
    blocks = qc.GridBlocks([sheet(7, 6), np.rot90(sheet(8, 6, 0.6), turns)])
    (found,) = blocks.connections
    names = ["first row", "first column", "last row", "last column"]
    assert found[:3] == (0, "last row", 1)
    assert found.other_side == names[(-turns) % 4] or found.other_side == names[turns]
    reference = qc.mean_curvature(qc.QuadGrid(sheet(14, 6)), "liu")
    H = qc.mean_curvature(blocks, "liu")
    np.testing.assert_allclose(H[0], reference[:7], atol=1e-9)
    np.testing.assert_allclose(np.rot90(H[1], -turns), reference[6:], atol=1e-9)


def test_given_connections_are_the_only_ones():
    blocks = [sheet(7, 6), sheet(8, 6, 0.6)]
    assert len(qc.GridBlocks(blocks).connections) == 1
    apart = qc.GridBlocks(blocks, connections=[])
    assert apart.connections == ()
    assert apart.n == 7 * 6 + 8 * 6
    alone = qc.mean_curvature(qc.QuadGrid(blocks[0]), "liu")
    np.testing.assert_allclose(qc.mean_curvature(apart, "liu")[0], alone, atol=1e-9)
    given = qc.GridBlocks(blocks, [(1, "first row", 0, "last row")])
    assert given.connections == ((1, "first row", 0, "last row", False),)
    for one, other in zip(qc.mean_curvature(given), qc.mean_curvature(qc.GridBlocks(blocks)), strict=True):
        np.testing.assert_allclose(one, other, atol=1e-12)


def test_given_connections_join_points_that_are_almost_one():
    blocks = [sheet(7, 6), sheet(8, 6, 0.6) + 5e-5]
    assert qc.GridBlocks(blocks).connections == ()
    assert qc.GridBlocks(blocks, [(0, "last row", 1, "first row")]).n == 13 * 6 + 6


def test_single_precision_is_known_by_its_rounding():
    blocks = vertices(cubed_sphere(), 8)
    single = qc.GridBlocks([(b.points + 3).astype(np.float32) for b in blocks])
    assert len(single.connections) == 12
    assert single.roundoff == 2.0**-24


def test_a_side_may_fold_onto_itself():
    """A pillow in one block: both sides of the second direction are folded in the middle."""
    surface = pillow_sphere()
    xi, eta = np.meshgrid(spread(16, -3, 1)[:-1], spread(8, -1, 1), indexing="ij")
    # Of xi in [-3, 1) the fold takes xi to -2 - xi: the rows must begin at a fold.
    block = qc.QuadGrid(surface.mapping(xi, eta), (True, False))
    with pytest.raises(qc.MeshError, match="the first column of block 0 meets itself halfway"):
        qc.GridBlocks([block])
    xi, eta = np.meshgrid(spread(16, -3, 1), spread(8, -1, 1), indexing="ij")
    blocks = qc.GridBlocks([surface.mapping(xi, eta)])
    assert {c[:4] for c in blocks.connections} == {
        (0, "first row", 0, "last row"),
        (0, "first column", 0, "first column"),
        (0, "last column", 0, "last column"),
    }
    reference, *_ = surface.sample((16, 8), "faces")
    assert blocks.n == len(reference.points)
    H, expected = (qc.mean_curvature(x, "finite_volume") for x in (blocks.mesh, reference))
    assert np.isnan(H).sum() == 4  # where two quads meet back to back
    np.testing.assert_allclose(np.sort(H), np.sort(expected), rtol=1e-9)
    np.testing.assert_allclose(blocks.split(H)[0], qc.mean_curvature(blocks, "finite_volume")[0], rtol=1e-9)


def test_blocks_that_wrap_meet_at_their_ends():
    whole = torus().sample((24, 12))[0]
    parts = [whole.points[:9], whole.points[8:17], np.concatenate((whole.points[16:], whole.points[:1]))]
    blocks = qc.GridBlocks([qc.QuadGrid(part, (False, True)) for part in parts])
    assert len(blocks.connections) == 3
    reference = qc.mean_curvature(whole)
    for H, part in zip(
        qc.mean_curvature(blocks), ([*range(9)], [*range(8, 17)], [*range(16, 24), 0]), strict=True
    ):
        np.testing.assert_allclose(H, reference[part], atol=1e-10)


# Values


@pytest.mark.parametrize("scheme", qc.SCHEMES)
def test_values_are_those_of_one_mesh(rough, scheme):
    H = rough.joined(qc.mean_curvature(rough, scheme))
    reference = qc.mean_curvature(rough.mesh, scheme)
    at_sides = np.zeros(rough.n, bool)
    at_sides[rough.strip.number] = True
    assert np.isfinite(H).all()
    np.testing.assert_array_equal(H[at_sides], reference[at_sides])
    np.testing.assert_allclose(H, reference, rtol=0, atol=1e-11 * np.abs(reference).max())


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("scheme", LAPLACIANS)
def test_open_blocks_have_the_borders_of_one_mesh(scheme, boundary):
    """Five panels, uneven; the sixth side of the cube is open."""
    surface = cubed_ellipsoid()
    t = spread(14) ** 1.1
    xi, eta = np.meshgrid(t, t, indexing="ij")
    blocks = qc.GridBlocks([surface.mapping(xi + offset, eta) for offset in surface.panels[:5]])
    wanted = ["mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas"]
    found = qc.evaluate(blocks, *wanted, scheme=scheme, boundary=boundary)
    reference = qc.evaluate(blocks.mesh, *wanted, scheme=scheme, boundary=boundary)
    at_sides = np.zeros(blocks.n, bool)
    at_sides[blocks.strip.number] = True
    for name in wanted:
        values = blocks.joined([np.nan_to_num(x, nan=7.0) for x in found[name]])
        expected = np.nan_to_num(reference[name], nan=7.0)
        np.testing.assert_array_equal(values[at_sides], expected[at_sides], err_msg=name)
        np.testing.assert_allclose(values, expected, rtol=0, atol=1e-10, err_msg=name)


def test_every_verb_answers_block_by_block(rough):
    shapes = [b.shape for b in rough]
    normal = [(*shape, 3) for shape in shapes]
    for verb, expected in (
        (qc.mean_curvature, shapes),
        (qc.gaussian_curvature, shapes),
        (qc.dual_areas, shapes),
        (qc.mean_curvature_normal, normal),
        (qc.vertex_normals, normal),
    ):
        assert [x.shape for x in verb(rough)] == expected, verb.__name__
    found, reference = qc.curvatures(rough), qc.curvatures(rough.mesh)
    assert [x.k1.shape for x in found] == shapes
    assert [x.standard_error.gaussian.shape for x in found] == shapes
    np.testing.assert_array_equal(rough.joined([x.gaussian for x in found]), reference.gaussian)
    k1, _, direction1, _ = qc.principal_curvatures(rough)
    assert [x.shape for x in direction1] == normal
    np.testing.assert_array_equal(rough.joined(k1), reference.k1)
    K = rough.joined(qc.gaussian_curvature(rough, "angle_defect"))
    area = rough.joined(qc.dual_areas(rough, "cotan-6"))
    assert K @ area == pytest.approx(4 * np.pi)


def test_matrices_are_numbered_over_all_blocks(rough):
    S, M = qc.stiffness_matrix(rough), qc.mass_matrix(rough)
    assert S.shape == M.shape == (rough.n, rough.n)
    Hn = -(S @ rough.points) / (2 * M.diagonal()[:, None])
    np.testing.assert_allclose(Hn, rough.joined(qc.mean_curvature_normal(rough, "bilinear")), atol=1e-9)
    x = [b.points for b in rough]
    for f, h in zip(qc.laplace_beltrami(rough, x), qc.mean_curvature_normal(rough, "bilinear"), strict=True):
        np.testing.assert_allclose(f, 2 * h, atol=1e-9)
    x[2] = x[2] + 1
    with pytest.raises(ValueError, match="values: block 2 differs by 1 from another where they meet"):
        qc.laplace_beltrami(rough, x)
    with pytest.raises(ValueError, match="out: blocks have an array each"):
        qc.evaluate(rough, out={"dual_areas": np.empty(3)})


def test_holes_stay_holes():
    points = sheet(9, 8, 0.6)
    points[3:5, 4] = np.nan
    with pytest.warns(qc.MeshWarning, match="without a position"):
        blocks = qc.GridBlocks([sheet(7, 8), points])
    H = qc.mean_curvature(blocks, "liu")
    assert np.isnan(H[1]).sum() == 2
    assert np.isnan(H[1][3:5, 4]).all()
    assert (blocks.numbers[1] < 0).sum() == 2
    reference = qc.mean_curvature(blocks.mesh, "liu")
    np.testing.assert_array_equal(reference[blocks.numbers[0]], H[0])


def test_other_functions_see_one_mesh(rough):
    assert isinstance(qc.as_mesh(rough), qc.QuadMesh)
    found = qc.compare(rough, ["liu", "finite_volume"])
    assert found.mean_curvature["liu"].shape == (rough.n,)


def test_a_pole_is_one_vertex():
    """A polar cap in four sectors: all have a side that is one point, the same one."""
    blocks = []
    for k in range(4):
        phi, theta = np.meshgrid(k * np.pi / 2 + spread(8, 0, np.pi / 2), spread(10, 0, 1), indexing="ij")
        blocks.append(np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], -1))
    cap = qc.GridBlocks([b.swapaxes(0, 1) for b in blocks])
    with pytest.warns(qc.MeshWarning, match="repeated vertex"):
        H = qc.mean_curvature(cap, "finite_volume")
    assert cap.n == 4 * 8 * 10 + 1
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", qc.MeshWarning)
        reference = qc.mean_curvature(cap.mesh, "finite_volume")
    np.testing.assert_allclose(cap.joined(H), reference, atol=1e-9)
    assert len({float(h[0, 0]) for h in H}) == 1


# Cells


@pytest.mark.parametrize(
    "scheme",
    ["finite_volume", "liu", "bilinear", qc.schemes.jet(4)],
    ids=["finite_volume", "liu", "bilinear", "jet-4"],
)
def test_cells_have_their_neighbours_around_them(scheme):
    """Inside, whatever a panel is, and along seams where panels go on smoothly: as one grid has them."""
    surface = torus()
    whole = cells_of(surface.mapping, spread(24, 0, 2 * np.pi), spread(12, 0, 2 * np.pi))
    whole = qc.StaggeredGrid(whole.primal, whole.dual, (True, True))
    p, d = whole.primal, whole.dual
    parts = [(p[:9], d[:10]), (p[9:, :5], d[9:, :6]), (p[9:, 5:], d[9:, 5:])]
    blocks = qc.GridBlocks(
        [qc.StaggeredGrid(*parts[0], (False, True)), *(qc.StaggeredGrid(*x) for x in parts[1:])],
        connections=[(1, "last column", 2, "first column"), (2, "last column", 1, "first column")],
    )
    assert blocks.of_cells
    H, reference = qc.mean_curvature(blocks, scheme, "nan"), qc.mean_curvature(whole, scheme)
    np.testing.assert_allclose(H[1][2:-2], reference[11:-2, :5], atol=1e-11)
    np.testing.assert_allclose(H[2][2:-2], reference[11:-2, 5:], atol=1e-11)
    assert np.isnan(H[1][0]).all()
    assert np.isnan(H[0][[0, -1]]).all()


@pytest.mark.parametrize(
    ("scheme", "n", "order", "mean_order", "bound"),
    [("finite_volume", 64, 1, 2, 4e-3), ("liu", 64, 1, 2, 2e-3), (qc.schemes.jet(4), 16, 4, 4, 1.1e-4)],
)
def test_cells_of_a_cubed_sphere_converge(scheme, n, order, mean_order, bound):
    """Seams are kinks of the grid lines, where second-order schemes are of first order, as on one mesh."""
    errors = []
    for size in (n, 2 * n):
        blocks = cells(cubed_sphere(), size)
        assert len(blocks.connections) == 12
        error = np.abs(blocks.joined(qc.mean_curvature(blocks, scheme)) - 1)
        errors.append((error.max(), error.mean()))
    assert errors[0][0] < bound
    most, mean = np.log2(np.divide(*errors))
    assert most > order - 0.15
    assert mean > mean_order - 0.15


def test_cells_cover_the_sphere_once():
    blocks = cells(cubed_sphere(), 24)
    for scheme in ("finite_volume", "liu"):
        assert sum(x.sum() for x in qc.dual_areas(blocks, scheme)) == pytest.approx(4 * np.pi, rel=4e-3)
    S = qc.stiffness_matrix(blocks, "liu")
    stencils = blocks.stencils()
    assert S.shape == (6 * 24**2, 6 * 24**2 + 6 * 24**2 + 2) == (blocks.n, len(stencils.points))
    area = blocks.joined(qc.dual_areas(blocks, "liu"))
    Hn = -(S @ stencils.points) / (2 * area[:, None])
    np.testing.assert_allclose(Hn, blocks.joined(qc.mean_curvature_normal(blocks, "liu")), atol=1e-9)
    f = qc.laplace_beltrami(blocks, stencils.points, "liu")
    np.testing.assert_allclose(blocks.joined(f), 2 * Hn, atol=1e-9)
    assert qc.gaussian_curvature(blocks, "angle_defect")[0].shape == (24, 24)
    with pytest.raises(qc.MeshError, match="blocks of cells are no mesh of vertices"):
        qc.as_mesh(blocks)


@pytest.mark.parametrize("scheme", LAPLACIANS)
def test_cells_at_borders_are_those_of_one_grid(scheme):
    surface = qc.surfaces.hyperbolic_paraboloid()
    t = spread(20, -1, 1)
    whole = cells_of(surface.mapping, t, t)
    halves = [
        qc.StaggeredGrid(whole.primal[:8], whole.dual[:9]),
        qc.StaggeredGrid(whole.primal[8:], whole.dual[8:]),
    ]
    blocks = qc.GridBlocks(halves)
    for boundary in ("extrapolate", "nan"):
        wanted = ["mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas"]
        found = qc.evaluate(blocks, *wanted, scheme=scheme, boundary=boundary)
        reference = qc.evaluate(whole, *wanted, scheme=scheme, boundary=boundary)
        for name in wanted:
            np.testing.assert_allclose(np.concatenate(found[name]), reference[name], atol=1e-8, err_msg=name)
    S, one = (qc.stiffness_matrix(x, scheme) for x in (blocks, whole))
    x, y = blocks.stencils().points, whole.stencils().points
    np.testing.assert_allclose(S @ x, one @ y, atol=1e-12)


def test_the_fold_of_an_odd_number_of_cells_is_open():
    surface = pillow_sphere()
    for n, unknown in ((16, 0), (14, 4)):
        block = cells_of(surface.mapping, spread(n, -3, 1), spread(8, -1, 1))
        blocks = qc.GridBlocks([block])
        assert len(blocks.connections) == 3
        H = qc.mean_curvature(blocks, "liu", "nan")[0]
        assert np.isnan(H).sum() <= unknown


# What is refused


LAST, FIRST, OTHER = "the last row of block 0", "the first row of block 1", "the first column of block 1"
MEET = [(0, "last row", 1, "first row")]
REFUSED = {
    "none": ([], None, "blocks: none given"),
    "no grid": ([sheet(5, 5), sheet(5, 5)[0]], None, r"blocks\[1\]: points"),
    "normals": (
        [sheet(7, 6), sheet(5, 6, 0.6).swapaxes(0, 1)],
        None,
        f"{LAST} meets {OTHER}, but the normals of the two point to different sides",
    ),
    "longer": (
        [sheet(7, 9), sheet(5, 5, 0.6)],
        None,
        rf"{LAST} \(9 points\) and {FIRST} \(5 points\) have 5 points in common",
    ),
    "coarser": (
        [sheet(7, 5), sheet(5, 9, 0.6)[:, ::2]],
        None,
        rf"{LAST} \(5 points\) and {FIRST} \(5 points\) have 3 points in common",
    ),
    "shifted": (
        [sheet(7, 6), sheet(5, 6, 0.6, 0.3)],
        None,
        f"{LAST} .* and {FIRST} .* have 3 points in common",
    ),
    "other size": (
        [sheet(5, 5), sheet(5, 6, 0.4)],
        MEET,
        rf"connections\[0\]: {LAST} has 5 points, {FIRST} 6, but sides meet point by point",
    ),
    "apart": (
        [sheet(5, 5), sheet(5, 5, 0.5)],
        MEET,
        rf"connections\[0\]: {LAST} and {FIRST} do not meet: 5 of their 5 points are up to 0\.1",
    ),
    "no side": ([sheet(5, 5)], [(0, "top", 0, "first row")], r"connections\[0\]: expected a block below 1"),
    "no block": ([sheet(5, 5)], [(0, "first row", 3, "first row")], "expected a block below 1 and one of"),
    "too few": ([sheet(5, 5)], [(0, "first row")], r"expected \(block, side, block, side\)"),
    "wraps": (
        [torus().sample((8, 8))[0]],
        [(0, "first row", 0, "last row")],
        "the first row of block 0 does not exist, for it wraps",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case):
    blocks, connections, message = REFUSED[case]
    with pytest.raises(qc.MeshError, match=message):
        qc.GridBlocks(blocks, connections)


def test_kinds_and_ghost_cells_are_refused():
    with pytest.raises(qc.MeshError, match=r"blocks\[0\]: a ChunkedGrid, blocks are in memory"):
        qc.GridBlocks([qc.ChunkedGrid(np.zeros((4, 4, 3)))])
    grid = qc.StaggeredGrid.from_mapping(torus().mapping, spread(8), spread(8))
    with pytest.raises(qc.MeshError, match=r"blocks\[0\]: has ghost cells"):
        qc.GridBlocks([grid])
    with pytest.raises(qc.MeshError, match="block 1 is of cells, block 0 of vertices"):
        qc.GridBlocks([sheet(4, 4), grid])


def test_arrays_of_blocks_must_fit(rough):
    with pytest.raises(ValueError, match="values: 1 arrays for 6 blocks"):
        rough.joined([np.zeros((10, 10))])
    with pytest.raises(ValueError, match=r"values: shape \(3, 3\) of block 1"):
        rough.joined([np.zeros((10, 10)), *[np.zeros((3, 3))] * 5])


def test_sides_that_touch_in_a_point_are_no_seam():
    """Blocks that meet at a corner alone, like squares of one colour of a chessboard."""
    blocks = qc.GridBlocks([sheet(6, 6), sheet(6, 6, 0.5, 0.5)])
    assert blocks.connections == ()
    assert np.isfinite(blocks.joined(qc.mean_curvature(blocks, "liu"))).all()
    assert set(SIDES) == {"first row", "last row", "first column", "last column"}
