"""Fits that go side by side are those that each would be by itself; what lies around a vertex, as indices."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

import quadcurv as qc
from quadcurv.drivers.fits import MeshNeighbourhoods
from quadcurv.kernels import gather, jet, nearby, topology
from quadcurv.kernels.formulas import (
    WIDTH,
    Carried,
    formula,
    lanes,
    muladd,
    put_lanes,
    root,
    side_by_side,
    span,
    three_lanes,
    where,
)


def torus(r, c):
    u, v = np.meshgrid(2 * np.pi * np.arange(r) / r, 2 * np.pi * np.arange(c) / c, indexing="ij")
    ring = 3 + np.cos(u) + 0.2 * np.sin(3 * v)
    return np.stack([ring * np.cos(v), ring * np.sin(v), np.sin(u)], axis=-1)


GRIDS = {
    "closed": lambda: qc.QuadGrid(torus(30, 34), (True, True)),
    "open": lambda: qc.QuadGrid(torus(30, 34)),
    "list": lambda: qc.QuadGrid(torus(30, 34), (True, True)).to_mesh(),
    "cube": lambda: qc.surfaces.cubed_sphere().sample((9, 9), "faces")[0],
}


def arithmetic(x, y, number):
    a, b = lanes(x, 8), lanes(y, 0)
    total = Carried((0.0 * a,))
    for k in span(0, 4):
        (before,) = total.get()
        total.set((muladd(a, lanes(x, k * WIDTH), before),))
    one, two, three = three_lanes(x, 3)
    some = side_by_side([x[3 * k] for k in range(WIDTH)])
    numbers = a + b, a - b, a * b, a / (1 + b * b), number * a - b / number, -a, root(1 + a * a)
    choices = where(a < b, a, number), where((a < b) | (a >= 0.5), 1.0, b), where(number < 0.5, a, b)
    return (*numbers, *choices, total.get()[0], one, two, three, some)


@settings(deadline=None, max_examples=20)  # the first call compiles
@given(st.integers(0, 10**6), st.floats(0.1, 2))
def test_lanes_compute_as_numbers_do(seed, number):
    made = _written_down()
    x, y = np.random.default_rng(seed).random((2, 64))
    plain = arithmetic(x, y, number)
    out = np.zeros(len(plain) * WIDTH)
    made(x, y, number, out)
    np.testing.assert_allclose(out.reshape(-1, WIDTH), plain, rtol=1e-14, atol=1e-15)


_MADE = []


def _written_down():
    if not _MADE:

        def results(x, y, number, out):
            for k, value in enumerate(arithmetic(x, y, number)):
                put_lanes(out, k * WIDTH, value)

        made = formula(results)
        _MADE.append(njit(lambda x, y, number, out: made(x, y, number, out)))
    return _MADE[0]


@pytest.mark.parametrize("kind", [jet.PLAIN, jet.ROUND, jet.SMOOTH])
@pytest.mark.parametrize("name", GRIDS)
def test_results_do_not_depend_on_what_goes_beside(name, kind):
    """To the last digit: threads and blocks cut vertices wherever they like."""
    around = MeshNeighbourhoods(GRIDS[name](), "nan")
    n = around.wanted.size
    whole = around.polynomials(np.arange(n), 4, 2, kind=kind)
    rng = np.random.default_rng(0)
    for some in (np.arange(5, n - 3), rng.permutation(n)[: n // 2], np.array([n // 2])):
        np.testing.assert_array_equal(around.polynomials(some, 4, 2, kind=kind), whole[some])


@pytest.mark.parametrize(("degree", "nested"), [(6, 2), (6, 3), (4, 2)])
@pytest.mark.parametrize("name", ["open", "cube"])
def test_nested_fits_are_those_of_lower_degree(name, degree, nested):
    around = MeshNeighbourhoods(GRIDS[name](), "nan")
    vertices = np.arange(around.wanted.size)
    all_of_them = around.polynomials(vertices, degree, 3, kind=jet.ROUND, nested=nested)
    assert all_of_them.shape == (nested, vertices.size, jet.COLUMNS)
    for k, found in enumerate(all_of_them):
        alone = around.polynomials(vertices, degree - 2 * k, 3, kind=jet.ROUND)
        known = alone[:, jet.CONDITION] < 1e3
        assert known.mean() > 0.6
        for column in (jet.MEAN, jet.GAUSSIAN, jet.GAIN, jet.CONDITION, jet.FREEDOM):
            np.testing.assert_allclose(found[known, column], alone[known, column], rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(np.isnan(found[:, jet.MEAN]), np.isnan(alone[:, jet.MEAN]))


def neighbourhoods(mesh, rings, windows):
    """Sets of points around every vertex."""
    stencils = mesh.stencils()
    n = stencils.n
    corners = topology.corners_by_vertex(stencils.faces, n)
    ring = stencils.ring if windows else stencils.ring[:0]
    blocks = gather.Blocks(4 * (2 * rings + 1) ** 2)
    around, found, beside = gather.Rings(stencils.faces, *corners, ring, gather.runs(ring), rings), [], []
    for start in range(0, n, WIDTH * blocks.most):
        some = np.arange(start, min(n, start + WIDTH * blocks.most), dtype=np.int32)
        blocks.begin(some)
        assert around.put(blocks) == blocks.room
        index = blocks.index.reshape(-1, blocks.room, WIDTH)
        for k in range(some.size):
            block, lane, count = k // WIDTH, k % WIDTH, blocks.counts[k]
            rows = index[block, :count, 0] + lane if blocks.beside[block] else index[block, :count, lane]
            assert count == len(set(rows.tolist()))
            found.append(set(rows.tolist()))
        beside += blocks.beside[: blocks.size].tolist()
    return found, beside


@pytest.mark.parametrize("rings", [2, 3, 4, 5, 8])
@pytest.mark.parametrize(
    "mesh",
    [
        lambda: qc.QuadGrid(torus(23, 26), (True, True)).to_mesh(),
        lambda: qc.QuadGrid(torus(23, 26), (True, False)).to_mesh(),
        lambda: qc.QuadGrid(torus(5, 40), (True, True)).to_mesh(),  # windows meet themselves
        lambda: qc.surfaces.cubed_sphere().sample((12, 12), "faces")[0],
    ],
    ids=["torus", "tube", "thin", "cube"],
)
def test_windows_are_what_rings_of_faces_reach(mesh, rings):
    by_windows, beside = neighbourhoods(mesh(), rings, True)
    by_faces, never = neighbourhoods(mesh(), rings, False)
    assert by_windows == by_faces
    assert not any(never)
    assert any(beside) or rings > 2


def test_windows_are_found_however_vertices_are_numbered():
    rng, mesh = np.random.default_rng(0), qc.QuadGrid(torus(12, 14), (True, True)).to_mesh()
    place = rng.permutation(len(mesh.points))
    turned = np.array(
        [np.roll(face, k) for face, k in zip(mesh.faces, rng.integers(0, 4, len(mesh.faces)), strict=True)]
    )
    other = qc.QuadMesh(mesh.points[np.argsort(place)], place[turned][rng.permutation(len(turned))])
    assert neighbourhoods(other, 3, True)[0] == neighbourhoods(other, 3, False)[0]


def test_runs_end_where_a_ring_does_not_follow():
    ring = np.arange(8) + np.array([0, 1, 2, 9, 10, -1, 5])[:, None]
    assert gather.runs(ring.astype(np.int32)).tolist() == [2, 1, 0, 1, 0, 0, 0]
    assert gather.runs(np.empty((0, 8), np.int32)).size == 0


def test_means_are_of_what_is_known():
    indptr, indices = np.array([0, 2, 4, 5]), np.array([0, 1, 1, 2, 2], np.int32)
    values = np.array([[1.0, np.nan], [3.0, 2.0], [np.inf, 4.0]])
    expected = [[2.0, 2.0], [3.0, 3.0], [np.nan, 4.0]]
    np.testing.assert_array_equal(nearby.means(indptr, indices, values), expected)


@pytest.mark.parametrize("wrap", [(True, True), (False, True), (False, False)])
@pytest.mark.parametrize("rings", [1, 3])
def test_windows_of_grids_end_at_its_sides(rings, wrap):
    rows, columns = 12, 30
    blocks, found = gather.Blocks((2 * rings + 1) ** 2), []
    blocks.begin(np.arange(rows * columns, dtype=np.int32))
    gather.Windows((rows, columns), wrap, rings).put(blocks)
    index = blocks.index.reshape(-1, blocks.room, WIDTH)
    for k in range(rows * columns):
        i, j = divmod(k, columns)
        at = [np.arange(x - rings, x + rings + 1) for x in (i, j)]
        at = [
            x % n if wraps else x[(x >= 0) & (x < n)]
            for x, n, wraps in zip(at, (rows, columns), wrap, strict=True)
        ]
        block, lane, count = k // WIDTH, k % WIDTH, blocks.counts[k]
        here = index[block, :count, 0] + lane if blocks.beside[block] else index[block, :count, lane]
        np.testing.assert_array_equal(here, np.add.outer(at[0] * columns, at[1]).ravel())
        found.append(blocks.beside[block])
    assert any(found)
    assert not all(found)
