"""Differences along the lines of a mesh: exact, of order eight, not believed where points are not smooth."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv import surfaces
from quadcurv.drivers.fits import MeshNeighbourhoods
from quadcurv.kernels.lines import lines
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import lattice

LINES = lattice.DEGREE  # what `Curvatures.degree` says of differences


def patch(n, heights, seed=None):
    """Grid of a graph z(x, y) over the unit square, not square to the axes, and its exact H."""
    surface = surfaces.Surface.from_mapping(lambda u, v: (u, v, heights(u, v)), ((0, 1), (0, 1)))
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    u, v = u + 0.2 * v * v, v + 0.1 * u * v  # lines that bend
    return qc.QuadGrid(surface.mapping(u, v)), surface.mean_curvature(u, v)


def shuffled(grid, seed):
    """The same as a face list whose vertices, faces and first corners are in any order."""
    mesh, rng = grid.to_mesh(), np.random.default_rng(seed)
    order = rng.permutation(len(mesh.points))
    faces = np.argsort(order)[mesh.faces][rng.permutation(len(mesh.faces))]
    first = rng.integers(4, size=len(faces))
    faces = np.take_along_axis(faces, (np.arange(4) + first[:, None]) % 4, axis=1)
    return qc.QuadMesh(mesh.points[order], faces), order


def differences(mesh):
    """H at all vertices, whatever fits claim."""
    around = MeshNeighbourhoods(mesh, "extrapolate")
    every = np.arange(around.wanted.size)
    found, H = lattice.differences(around, every, np.full(every.size, np.inf)), np.full(every.size, np.nan)
    H[found.at] = found.fits[:, 0]
    return H


# ---- formulas ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("offset", range(9))
@pytest.mark.parametrize(("k", "degree"), [(0, 4), (1, 6), (2, 8)])
def test_weights_are_exact_for_polynomials(offset, k, degree):
    t = np.arange(9.0) - offset
    for power in range(degree + 1):
        first, second = lattice.weights()[offset, k] @ t**power
        scale = 9.0**power
        assert first == pytest.approx(float(power == 1), abs=1e-13 * scale)
        assert second == pytest.approx(2.0 * (power == 2), abs=1e-13 * scale)
    # The next one is not, but that second derivatives are better in the middle.
    inside = degree // 2 <= offset <= 8 - degree // 2
    assert abs(lattice.weights()[offset, k, int(not inside)] @ t ** (degree + 1)) > 1.0


def test_what_noise_is_in_the_highest_differences():
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(200.0), np.arange(200.0), indexing="ij")
    points = np.stack((x, y, 0 * x), axis=-1) + 0.01 * rng.standard_normal((200, 200, 3))
    around = MeshNeighbourhoods(qc.QuadGrid(points), "extrapolate")
    every = np.arange(points.size // 3)
    found = lattice.differences(around, every, np.full(every.size, np.inf))
    inside = np.zeros((200, 200), bool)
    inside[10:-10, 10:-10] = True
    assert np.sqrt(np.mean(found.noise[inside.ravel()] ** 2)) == pytest.approx(0.01, rel=0.02)
    assert np.sqrt(np.mean(found.noise**2)) == pytest.approx(0.01, rel=0.04)
    # H of the plane is noise alone: as large as the gains say.
    error = found.fits[:, 0] / (found.fits[:, 14] * found.noise)
    assert np.sqrt(np.mean(error**2)) == pytest.approx(1.0, rel=0.05)


# ---- lines ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (True, True)])
def test_lines_are_rows_and_columns(wrap):
    index = np.arange(12 * 10).reshape(12, 10)
    points = np.stack((*np.meshgrid(range(12), range(10), indexing="ij"), np.zeros((12, 10))), axis=-1)
    found = lines(qc.QuadGrid(points * 1.0, wrap).stencils().links)
    assert found.begin.size == 22
    assert found.closed.sum() == 10 * wrap[0] + 12 * wrap[1]
    for begin, end in zip(found.begin, found.end, strict=True):
        at = found.vertices[begin:end]
        rows, columns = np.unravel_index(at, index.shape)
        assert np.ptp(rows) == 0 or np.ptp(columns) == 0
        assert at.size == (10 if np.ptp(rows) == 0 else 12)
    for axis in range(2):
        assert (found.vertices[found.place[axis]] == index.ravel()).all()


def test_lines_end_at_irregular_vertices():
    mesh, _, _ = (
        surfaces.sphere().sample((6, 6), "faces")
        if False
        else surfaces.cubed_sphere().sample((6, 6), "faces")
    )
    links = mesh.stencils().links
    valence = mesh.stencils().valence
    assert (links[valence == 3] == -1).all()
    found = lines(links)
    assert found.vertices.size == 2 * (valence == 4).sum()
    assert not np.isin(found.vertices, np.flatnonzero(valence == 3)).any()


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_lines_of_any_mesh_are_paths(seed):
    """Steps lead along edges, every vertex is on each of its lines once, and ways back are opposite."""
    rng = np.random.default_rng(seed)
    mesh, _, _ = surfaces.cubed_sphere().sample((4, 4), "faces")
    kept = rng.random(len(mesh.faces)) < 0.9
    mesh = qc.QuadMesh(mesh.points, mesh.faces[kept])
    links = mesh.stencils().links
    found = lines(links)
    for begin, end, closed in zip(found.begin, found.end, found.closed, strict=True):
        at, ways = found.vertices[begin:end], found.ways[begin:end]
        following = np.append(at[1:], at[0])[: at.size if closed else -1]
        assert (links[at, ways][: following.size] == following).all()
        assert len({(v, way & 1) for v, way in zip(at.tolist(), ways.tolist(), strict=True)}) == at.size


# ---- numbers -------------------------------------------------------------------------------------------


def test_polynomials_are_exact_up_to_the_corners():
    """Of a sheared and bent grid of a paraboloid, positions are of degree four in their numbers."""
    grid, exact = patch(14, lambda u, v: 0.6 * u * u - 0.3 * u * v)
    assert np.abs(differences(grid) - exact.ravel()).max() < 1e-11
    assert np.abs(qc.mean_curvature(grid) - exact).max() < 1e-11
    mesh, order = shuffled(grid, 3)
    assert np.abs(differences(mesh) - exact.ravel()[order]).max() < 1e-11


@pytest.mark.parametrize("faces", [False, True])
def test_order_eight_with_borders(faces):
    errors = []
    for n in (16, 24, 32):
        grid, exact = patch(n, lambda u, v: np.sin(2 * u) * np.cos(v))
        mesh, order = shuffled(grid, n) if faces else (grid, np.arange(n * n))
        errors.append(np.abs(differences(mesh) - exact.ravel()[order]).max())
        H = np.ravel(qc.mean_curvature(mesh))
        assert np.abs(H - exact.ravel()[order]).max() < 2 * errors[-1]
    assert errors[-1] < 3e-8
    assert fitted_rate((16, 24, 32), errors) > 6.5  # seven at borders


def test_coarse_tubes():
    """Twelve points around: heights over a plane are no function, and fits were off by 8 %."""
    torus = surfaces.torus()
    grid, xi, eta = torus.sample((24, 12))
    exact = torus.mean_curvature(xi, eta)
    error = np.abs(qc.mean_curvature(grid) - exact).max()
    assert error < 2e-5
    assert error < np.abs(qc.mean_curvature(grid, "liu") - exact).max() / 1000


@pytest.mark.parametrize(("size", "turn"), [(1.0, 1), (2.0**-40, 2), (2.0**40, 3)])
def test_orientation_and_size(size, turn):
    grid, _ = patch(16, lambda u, v: np.exp(u) * v * v)
    H = qc.curvatures(grid)
    turned = qc.curvatures(qc.QuadGrid(size * np.rot90(grid.points, turn)))
    assert np.allclose(size * turned.mean, np.rot90(H.mean, turn), rtol=1e-10, atol=1e-12)
    assert np.allclose(size * turned.interval.mean, np.rot90(H.interval.mean, turn), rtol=1e-4)
    mirrored = qc.curvatures(qc.QuadGrid(grid.points[:, ::-1]))
    assert np.allclose(-mirrored.mean, H.mean[:, ::-1], rtol=1e-10, atol=1e-12)


# ---- where they are not believed ---------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torus", "catenoid", "enneper", "dupin_cyclide"])
@pytest.mark.parametrize("noise", [1e-6, 1e-5, 1e-4])
def test_intervals_hold_with_little_noise(name, noise):
    surface = getattr(surfaces, name)()
    grid, xi, eta = surface.sample((32, 32))
    exact, rng = surface.mean_curvature(xi, eta), np.random.default_rng(5)
    edge = np.median(np.linalg.norm(np.diff(grid.points, axis=0), axis=-1))
    held, taken = [], []
    for _ in range(4):
        moved = qc.QuadGrid(grid.points + noise * edge * rng.standard_normal(grid.points.shape), grid.wrap)
        found = qc.curvatures(moved)
        held.append(np.abs(found.mean - exact) <= found.interval.mean)
        taken.append(found.degree == LINES)
    held, taken = np.stack(held), np.stack(taken)
    assert held.mean() > 0.95
    if taken.mean() > 0.1:  # else those whose noise seems least by chance
        assert held[taken].mean() > 0.95
    assert noise > 1e-6 or taken.mean() > 0.5


def test_vertices_moved_along_the_surface_are_fitted():
    torus = surfaces.torus()
    _, xi, eta = torus.sample((48, 24))
    rng = np.random.default_rng(2)
    step = 0.01 * 2 * np.pi / 24
    moved = torus.mapping(xi + step * rng.uniform(-1, 1, xi.shape), eta + step * rng.uniform(-1, 1, xi.shape))
    assert not (qc.curvatures(qc.QuadGrid(moved, (True, True))).degree == LINES).any()


def test_one_wrong_point_is_seen_from_all_around():
    grid, exact = patch(24, lambda u, v: np.sin(2 * u) * np.cos(v))
    points = grid.points.copy()
    points[12, 11] += 1e-3 / 24 * np.array([0.0, 0.0, 1.0])
    found = qc.curvatures(qc.QuadGrid(points))
    error = np.abs(found.mean - exact)
    assert error.max() > 1e-3
    assert (error <= 2 * found.interval.mean)[error > 1e-6].all()


@pytest.mark.parametrize("power", [1, 2, 3])
@pytest.mark.parametrize("place", [0.5, 0.5 + 0.4 / 30])
def test_kinks_and_jumps_are_not_differenced_across(power, place):
    """A crease, a jump of curvature and one of its slope, along a line of the mesh and between two."""
    grid, exact = patch_straight(
        31, lambda u, v: np.where(u > place, (u - place) ** power, 0.0) + 0.2 * v * v
    )
    found = qc.curvatures(grid)
    off = np.abs(found.mean - exact) > 3 * found.interval.mean + 1e-10
    assert not off[found.degree == LINES].any()


def patch_straight(n, heights):
    surface = surfaces.Surface.from_mapping(lambda u, v: (u, v, heights(u, v)), ((0, 1), (0, 1)))
    u, v = np.meshgrid(np.linspace(0, 1, n), np.linspace(0, 1, n), indexing="ij")
    return qc.QuadGrid(surface.mapping(u, v)), surface.mean_curvature(u, v)


def test_sheets_of_one_side_and_short_lines_are_fitted():
    grid, _ = patch(8, lambda u, v: u * u * v)
    assert not (qc.curvatures(grid).degree == LINES).any()
    u, v = np.meshgrid(np.arange(40) * np.pi / 20, np.linspace(-0.3, 0.3, 12), indexing="ij")
    r = 1 + v * np.cos(u / 2)
    band = np.stack((r * np.cos(u), r * np.sin(u), v * np.sin(u / 2)), axis=-1).reshape(-1, 3)
    index = np.arange(40 * 12).reshape(40, 12)
    index = np.concatenate((index, index[:1, ::-1]))
    faces = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1).reshape(-1, 4)
    with pytest.warns(qc.MeshWarning, match="non-orientable"):
        mesh = qc.QuadMesh(band, faces)
    assert not mesh.stencils().orientable
    assert not (qc.curvatures(mesh).degree == LINES).any()


def test_masked_grids_have_lines():
    grid, exact = patch(40, lambda u, v: np.sin(2 * u) * np.cos(v))
    mask = np.zeros(grid.shape, bool)
    mask[18:21, 18:23] = True
    found = qc.curvatures(qc.QuadGrid(grid.points, mask=mask))
    far = np.ones(grid.shape, bool)
    far[10:29, 10:31] = False
    assert (found.degree[far] == LINES).mean() > 0.9
    assert np.nanmax(np.abs(found.mean - exact)[far]) < 1e-7


def test_cells_have_lines():
    """Between the centres of a staggered grid, closed or not; its corners are not read."""
    hyperboloid, torus, errors = surfaces.hyperboloid(), surfaces.torus(), []
    for n in (16, 24, 32):
        cells, xi, eta = hyperboloid.sample((n, n), "staggered")
        open_ = np.abs(qc.mean_curvature(cells) - hyperboloid.mean_curvature(xi, eta)).max()
        ends = np.arange(n + 1) * 2 * np.pi / n
        corners = torus.mapping(*np.meshgrid(ends, ends, indexing="ij"))
        xi, eta = np.meshgrid(ends[:-1] + np.pi / n, ends[:-1] + np.pi / n, indexing="ij")
        closed = qc.StaggeredGrid(torus.mapping(xi, eta), corners, (True, True))
        errors.append((open_, np.abs(qc.mean_curvature(closed) - torus.mean_curvature(xi, eta)).max()))
    (*_, last_open), (*_, last_closed) = zip(*errors, strict=True)
    assert last_open < 2e-5
    assert last_closed < 6e-9
    rates = [fitted_rate((16, 24, 32), each) for each in zip(*errors, strict=True)]
    assert rates[0] > 6
    assert rates[1] > 7.8
