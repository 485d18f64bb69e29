"""The compiled passes give what the stencils give, whatever the grid, the threads and the caller's arrays."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from llvmlite.binding import get_host_cpu_features
from numba import config, njit

import quadcurv as qc
from comparisons.operations import interpreted
from quadcurv import SCHEMES, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.kernels import extent, formulas, order, ranges, rows, topology, vector

# Points in any order make faces that fold over: what is told of them is tested elsewhere.
pytestmark = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")

NAMES = ("mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas")
DIRECT = ("finite_volume", "liu")
WRAPS = [(False, False), (True, False), (False, True), (True, True)]


@pytest.fixture(autouse=True)
def _own_threads():
    yield
    qc.set_threads(None)


def rough(shape, seed=0):
    """Points of a surface with noise of half its spacing: curvatures as large as the fluxes they sum."""
    rng = np.random.default_rng(seed)
    i, j = np.meshgrid(*map(np.arange, shape), indexing="ij")
    points = np.stack([i, j, np.sin(i) + np.cos(2 * j)], axis=-1).astype(float)
    return points + rng.uniform(-0.25, 0.25, points.shape)


def same(mesh, scheme, boundary):
    """Both ways agree to 1e-12 of the largest entry, NaN where NaN is."""
    fast = qc.evaluate(mesh, *NAMES, scheme=scheme, boundary=boundary)
    plain = qc.evaluate(mesh, *NAMES, scheme=replace(SCHEMES[scheme], fast=None), boundary=boundary)
    for name in NAMES:
        np.testing.assert_array_equal(np.isnan(fast[name]), np.isnan(plain[name]), err_msg=name)
        if np.isfinite(plain[name]).any():
            scale = np.nanmax(np.abs(plain[name]))
            np.testing.assert_allclose(fast[name], plain[name], rtol=0, atol=1e-12 * scale, err_msg=name)
    return fast


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("scheme", DIRECT)
@pytest.mark.parametrize("shape", [(5, 7), (6, 5), (23, 41)])
def test_grids(scheme, wrap, boundary, shape):
    same(QuadGrid(rough(shape), wrap), scheme, boundary)


@pytest.mark.parametrize("shape", [(2, 2), (2, 3), (3, 2), (4, 9)])
@pytest.mark.parametrize("scheme", DIRECT)
def test_small_grids_have_nothing_inside(scheme, shape):
    H = same(QuadGrid(rough(shape)), scheme, "nan")["mean_curvature"]
    assert np.isfinite(H).sum() == (shape[0] - 2) * (shape[1] - 2)


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("scheme", DIRECT)
def test_staggered_grids(scheme, wrap, boundary):
    points = rough((17, 23))
    primal, dual = points[1::2, 1::2], points[::2, ::2].copy()
    for axis in (0, 1):
        if wrap[axis]:
            np.moveaxis(dual, axis, 0)[-1] = np.moveaxis(dual, axis, 0)[0]
    if wrap[0]:
        dual[-1] += 1e-12  # a seam that does not quite meet: the first side counts
    same(StaggeredGrid(primal, dual, wrap), scheme, boundary)


@pytest.mark.parametrize("shape", [(3, 3), (3, 7), (9, 13)])
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("scheme", DIRECT)
def test_ghost_cells(scheme, boundary, shape):
    points = rough([2 * s + 3 for s in shape])
    grid = StaggeredGrid(points[::2, ::2][: shape[0] + 2, : shape[1] + 2], points[1:-1:2, 1:-1:2])
    assert grid.has_ghosts
    assert np.isfinite(same(grid, scheme, boundary)["mean_curvature"]).all()


@pytest.mark.parametrize("scheme", DIRECT)
def test_columns_beyond_the_width_done_at_once(scheme):
    shape = (6, rows.WIDTH + 3)
    for wrap in WRAPS:
        same(QuadGrid(rough(shape), wrap), scheme, "nan")
    points = rough((2 * shape[0] + 1, 2 * shape[1] + 1))
    same(StaggeredGrid(points[1::2, 1::2], points[::2, ::2]), scheme, "nan")


@pytest.mark.parametrize("scheme", DIRECT)
def test_degenerate_rings(scheme):
    """A quad without area, a fold that closes on itself and a ring without vector area."""
    points = rough((12, 14))
    points[4, 4] = points[5, 5] = points[4, 5] = points[5, 4]
    points[2, 10:13] = points[2, 10]
    for boundary in ("extrapolate", "nan"):
        H = same(QuadGrid(points), scheme, boundary)["mean_curvature"]
        assert np.isnan(H[4:6, 4:6]).all()
        assert np.isfinite(H[6, 1:-1]).any()
        same(QuadGrid(points).to_mesh(), scheme, boundary)
    points[8, 9] = points[10, 9]  # sums of corners round to an area instead
    assert np.isnan(qc.mean_curvature(QuadGrid(points), scheme)[9, 9])


def sheet(shape, n_triangles=0, hole=False, seed=0):
    """Quads of a grid, some cut into triangles, some left out, vertices and faces in random order."""
    rng = np.random.default_rng(seed)
    mesh = QuadGrid(rough(shape, seed)).to_mesh()
    faces = mesh.faces[rng.permutation(len(mesh.faces))].tolist()
    if hole:
        faces = faces[8:]
    cut, kept = faces[:n_triangles], faces[n_triangles:]
    faces = [*kept, *((a, b, c) for a, b, c, _ in cut), *((c, d, a) for a, _, c, d in cut)]
    order = rng.permutation(len(mesh.points))
    return mesh.points[np.argsort(order)], [[order[v] for v in face] for face in faces]


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("kind", [{}, {"hole": True}, {"n_triangles": 20}, {"n_triangles": 11 * 13}])
@pytest.mark.parametrize("scheme", DIRECT)
def test_face_lists(scheme, kind, boundary):
    points, faces = sheet((12, 14), **kind)
    mesh = QuadMesh(points, faces)
    first = same(mesh, scheme, boundary)
    again = qc.evaluate(mesh.with_points(points), *NAMES, scheme=scheme, boundary=boundary)
    for name in NAMES:
        np.testing.assert_array_equal(again[name], first[name])
    moved = mesh.with_points(1 + 2 * points[:, [1, 2, 0]])
    np.testing.assert_array_equal(
        qc.mean_curvature(moved, scheme, boundary), qc.mean_curvature((moved.points, faces), scheme, boundary)
    )


@pytest.mark.parametrize("scheme", DIRECT)
def test_extraordinary_isolated_and_non_orientable(scheme):
    cube = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    faces = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    assert np.isfinite(same(QuadMesh(cube, faces), scheme, "extrapolate")["mean_curvature"]).all()
    with_isolated = QuadMesh(np.vstack((cube, [9, 9, 9])), faces)
    assert np.isnan(same(with_isolated, scheme, "extrapolate")["mean_curvature"][-1])
    n, m = 24, 9
    t, s = np.meshgrid(2 * np.pi * np.arange(n) / n, np.linspace(-0.4, 0.4, m), indexing="ij")
    strip = np.stack(
        [(1 + s * np.cos(t / 2)) * np.cos(t), (1 + s * np.cos(t / 2)) * np.sin(t), s * np.sin(t / 2)], -1
    )
    index = np.arange(n * m).reshape(n, m)
    index = np.vstack((index, index[:1, ::-1]))
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), -1).reshape(-1, 4)
    with pytest.warns(UserWarning, match="non-orientable"):
        moebius = QuadMesh(strip.reshape(-1, 3), quads)
    H = qc.mean_curvature(moebius, scheme, "nan")
    plain = qc.mean_curvature(moebius, replace(SCHEMES[scheme], fast=None), "nan")
    np.testing.assert_allclose(H, plain, rtol=0, atol=1e-12 * np.nanmax(plain))
    assert np.nanmin(H) >= 0


reciprocal_root = formulas.formula(vector.reciprocal_root)


@njit
def reciprocal_roots(x):
    """`vector.reciprocal_root` of all numbers."""
    y = np.empty_like(x)
    for k in range(x.size):
        y[k] = reciprocal_root(x[k])
    return y


def test_reciprocal_roots_are_right_to_the_last_digit_or_two():
    """The guess depends on two octaves, the exponent is halved; the rest of the range is sampled."""
    rng = np.random.default_rng(0)
    x = np.concatenate((np.linspace(1, 4, 300_001), np.exp(rng.uniform(-708, 709, 100_000)), [vector.LEAST]))
    y = reciprocal_roots(x)
    exact = 1 / np.sqrt(x.astype(np.longdouble))
    assert np.abs(y / exact - 1).max() < 4 * 2.0**-53  # 1.25 where products and sums are rounded once
    assert np.isnan(reciprocal_roots(np.array([np.nan, np.inf]))).all()
    assert np.isfinite(reciprocal_roots(np.array([0, 5e-324]))).all()  # so that 0 has the root 0


@pytest.mark.parametrize("scheme", DIRECT)
def test_whether_squares_are_looked_at_one_by_one_changes_nothing(scheme, monkeypatch):
    """They are where some are as small as rounding could make them, by the farthest point seen so far.

    A single far point has all rows after it looked at, in the range of rows that it is in; a quad without
    area the stretch of 64 columns that it is in.
    """
    points = rough((120, 150))
    far = points.copy()
    far[20, 140] = 1e9
    without_area = points.copy()
    without_area[50, 70:72] = without_area[51, 70:72] = points[50, 70]
    for changed in (far, without_area, points + 1e9):
        grid = QuadGrid(changed)
        whole = qc.evaluate(grid, *NAMES, scheme=scheme, boundary="nan")
        if changed is not far:  # what is known of the far point's own ring depends on what is looked at
            same(grid, scheme, "nan")
        assert np.isfinite(whole["mean_curvature"]).sum() > 0.9 * 118 * 148
        with monkeypatch.context() as patch:
            patch.setattr(ranges, "SERIAL_BELOW", 0)
            patch.setattr(rows, "LEAST_ROWS", 1)
            qc.set_threads(3)
            cut = qc.evaluate(grid, *NAMES, scheme=scheme, boundary="nan")
            qc.set_threads(None)
        for name in NAMES:
            np.testing.assert_array_equal(cut[name], whole[name])


@pytest.mark.parametrize("scheme", DIRECT)
@pytest.mark.parametrize("size", [1e-70, 1e-30, 1e30, 1e68])
def test_sizes_far_from_one(scheme, size):
    """The square of u x v is that of an area: the fourth power of a length."""
    points = rough((12, 14))
    H = qc.mean_curvature(QuadGrid(points), scheme)
    assert np.isfinite(H[1:-1, 1:-1]).all()  # the border is too rough for a surface
    for mesh in (QuadGrid(size * points), QuadGrid(size * points).to_mesh()):
        scaled = qc.mean_curvature(mesh, scheme).reshape(H.shape)
        np.testing.assert_allclose(scaled * size, H, rtol=0, atol=1e-12 * np.nanmax(np.abs(H)))


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize(
    ("entries", "expected"),
    [
        ([], 0),
        ([0.0, -0.0], 0),
        ([1, -3, 2], 3),
        ([5e-324, 0], 5e-324),
        ([-1.7e308, 1], 1.7e308),
        ([1, -np.inf], np.inf),
        ([np.inf, np.nan, 1], np.nan),
        ([1, -np.nan], np.nan),
    ],
)
def test_the_largest_magnitude_of_an_array(entries, expected, threads, monkeypatch):
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    qc.set_threads(threads)
    assert extent.largest(np.array(entries, float)) == pytest.approx(expected, rel=0, abs=0, nan_ok=True)
    where = np.random.default_rng(0).permutation(1000)[: len(entries)]
    many = np.zeros(1000)
    many[where] = entries
    assert extent.largest(many) == pytest.approx(expected, rel=0, abs=0, nan_ok=True)


def test_products_and_sums_are_rounded_once_or_twice():
    a, b = 1 + 2.0**-30, 1 - 2.0**-30  # a b = 1 - 2^-60, rounded 1
    muladd = formulas.formula(formulas.muladd)
    assert njit(lambda a, b, c: muladd(a, b, c))(a, b, -1.0) in (0.0, -(2.0**-60))
    assert formulas.muladd(a, b, -1.0) == 0.0


def test_loops_are_as_wide_as_the_processor():
    """`span` asks by a name that llvmlite does not know: an upgrade could lose it, and much of the speed."""

    @formulas.formula
    def doubled(x, y):
        for k in formulas.span(0, 1000):
            y[k] = 2 * x[k]

    @njit
    def double(x, y):
        doubled(x, y)

    double(np.ones(1000), np.ones(1000))
    if config.CPU_FEATURES is not None or not get_host_cpu_features().get("avx512f", False):
        pytest.skip("no AVX-512")
    assert "zmm" in double.inspect_asm(double.signatures[0])


@pytest.mark.parametrize(("size", "least"), [(1, 1), (31, 16), (32, 16), (1000, 16), (10**6, 64), (7, 100)])
@pytest.mark.parametrize("threads", [2, 3, 16])
def test_ranges_become_smaller_and_make_up_the_whole(size, least, threads, monkeypatch):
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    done = []
    qc.set_threads(threads)
    ranges.over(lambda start, stop: done.append((start, stop)), size, size, least)
    done.sort()
    assert [start for start, _ in done] == [0, *(stop for _, stop in done[:-1])]
    assert done[-1][1] == size
    rows = np.array([stop - start for start, stop in done])
    assert (rows >= min(least, size)).all()
    assert (np.diff(rows[:-1]) <= 0).all()
    if size >= 100 * threads * least:
        assert rows.max() <= size / 2 / threads
        assert rows.min() <= size / 16 / threads


@pytest.mark.parametrize("threads", [1, 2, 3, 7])
@pytest.mark.parametrize("scheme", DIRECT)
def test_results_are_bitwise_the_same_for_any_number_of_threads(scheme, threads, monkeypatch):
    grid = QuadGrid(rough((301, 257)))
    mesh = QuadMesh(*sheet((60, 70)))
    points = rough((401, 131))
    cells = StaggeredGrid(points[1::2, 1::2], points[::2, ::2])
    meshes = (grid, mesh, cells)
    before = [qc.evaluate(m, *NAMES, scheme=scheme) for m in meshes]
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    monkeypatch.setattr(rows, "LEAST_ROWS", 1)
    qc.set_threads(threads)
    for one, many in zip(before, (qc.evaluate(m, *NAMES, scheme=scheme) for m in meshes), strict=True):
        for name in NAMES:
            np.testing.assert_array_equal(one[name], many[name])


@pytest.mark.parametrize("wanted", [NAMES[:1], NAMES[1:2], NAMES[2:], NAMES[::2]])
@pytest.mark.parametrize("scheme", DIRECT)
def test_any_subset_in_one_pass_into_given_arrays(scheme, wanted):
    grid = QuadGrid(rough((30, 20)))
    everything = qc.evaluate(grid, *NAMES, scheme=scheme)
    out = {name: np.empty_like(everything[name]) for name in wanted}
    some = qc.evaluate(grid, scheme=scheme, out=out)
    assert some.keys() == set(wanted)
    for name in wanted:
        assert some[name] is out[name]
        np.testing.assert_array_equal(some[name], everything[name])


def test_rejected_arguments():
    grid = QuadGrid(rough((6, 6)))
    with pytest.raises(ValueError, match=r"wanted: expected some of mean_curvature, .* got 'torsion'"):
        qc.evaluate(grid, "torsion")
    for bad in (np.empty((6, 5)), np.empty((6, 6), np.float32), np.empty((6, 12))[:, ::2]):
        with pytest.raises(ValueError, match=r"out: mean_curvature wants a writeable .* \(6, 6\)"):
            qc.evaluate(grid, out={"mean_curvature": bad})
    with pytest.raises(ValueError, match="number: expected at least 1 thread and at most 1024, got 0"):
        qc.set_threads(0)
    with pytest.raises(ValueError, match=r"scheme: .* is a fit"):
        qc.stiffness_matrix(grid, "jet")


def test_neither_points_nor_order_nor_type_are_the_callers_problem():
    points = rough((20, 30))
    H = qc.mean_curvature(QuadGrid(points), "finite_volume")
    for given in (np.asfortranarray(points), np.repeat(points, 2, axis=1)[:, ::2], points.tolist()):
        np.testing.assert_array_equal(qc.mean_curvature(QuadGrid(given), "finite_volume"), H)


def test_far_neighbours_are_brought_together(monkeypatch):
    points, faces = sheet((40, 50))
    mesh = QuadMesh(points, faces)
    first = qc.evaluate(mesh, *NAMES)
    assert mesh.reordered().connectivity is mesh.connectivity  # too small for it to pay
    monkeypatch.setattr("quadcurv.connectivity._FAR", 0)
    again = mesh.reordered().with_points(points)
    second = qc.evaluate(again, *NAMES)
    nearby, place, ring = again.connectivity.order
    np.testing.assert_array_equal(nearby[place], np.arange(len(points)))
    assert sorted(nearby) == list(range(len(points)))
    regular = ring[:, 0] >= 0
    assert np.median(np.abs(ring[regular] - np.flatnonzero(regular)[:, None])) < 100
    for name in NAMES:
        np.testing.assert_array_equal(first[name], second[name])


def test_asking_for_memory_ahead_changes_nothing(monkeypatch):
    points, faces = sheet((40, 50), n_triangles=30, hole=True)
    before = qc.evaluate(QuadMesh(points, faces), *NAMES)
    monkeypatch.setattr(topology, "FAR", -1)
    mesh = QuadMesh(points, faces)
    assert mesh.connectivity.scattered
    distance = topology.mean_distance(mesh.faces)
    assert distance == pytest.approx(2000 / 3, rel=0.2)  # of two random numbers below 2000
    after = qc.evaluate(mesh, *NAMES)
    for name in NAMES:
        np.testing.assert_array_equal(before[name], after[name])


@pytest.mark.parametrize(("patch", "near"), [(1, 0), (50, 0.8), (700, 0.95), (10_000, 1)])
def test_patches_hold_every_vertex_once_and_keep_neighbours_together(patch, near):
    points, faces = sheet((40, 50), n_triangles=30, hole=True)
    ring = QuadMesh(points, faces).connectivity.ring
    nearby = interpreted(order, PATCH=patch)["nearby_order"](ring)
    assert sorted(nearby) == list(range(len(points)))
    regular = np.flatnonzero(ring[:, 0] >= 0)
    place = np.argsort(nearby)
    apart = np.abs(place[ring[regular, ::2]] - place[regular, None])
    assert (apart < patch).mean() >= near  # 5 % and 58 % for 50 and 700 in random order


def large_and_serial():
    """Sum of H of a grid large enough for threads, and of the same with one."""
    grid = QuadGrid(rough((600, 500)))
    qc.set_threads(2)
    two = qc.mean_curvature(grid, "finite_volume")
    qc.set_threads(1)
    return bool(np.array_equal(two, qc.mean_curvature(grid, "finite_volume"), equal_nan=True))


@pytest.mark.filterwarnings("ignore:.*use of fork:DeprecationWarning")
def test_after_a_fork_and_from_other_threads():
    assert large_and_serial()  # the pool exists before the fork
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.apply_async(large_and_serial).get(60)
    grid = QuadGrid(rough((600, 500)))
    qc.set_threads(3)
    H = qc.mean_curvature(grid, "finite_volume")
    with ThreadPoolExecutor(4) as callers:
        for other in callers.map(lambda _: qc.mean_curvature(grid, "finite_volume"), range(8)):
            np.testing.assert_array_equal(other, H)


@pytest.mark.filterwarnings("default")
def test_inside_dask_workers():
    """Tasks of two threads a process, each of which calls our own threads."""
    from distributed import Client, LocalCluster

    grid = QuadGrid(rough((600, 500)))
    H = qc.mean_curvature(grid, "finite_volume")
    cluster = LocalCluster(2, threads_per_worker=2, processes=True, dashboard_address=None)
    with cluster, Client(cluster) as client:
        tasks = [client.submit(qc.mean_curvature, grid, "finite_volume", pure=False) for _ in range(8)]
        for other in client.gather(tasks):
            np.testing.assert_array_equal(other, H)


def test_number_of_threads_from_the_environment(monkeypatch):
    monkeypatch.setenv("QUADCURV_NUM_THREADS", "3")
    assert ranges.threads() == 3
    qc.set_threads(2)
    assert ranges.threads() == 2
    qc.set_threads(None)
    monkeypatch.setenv("QUADCURV_NUM_THREADS", "many")
    assert 1 <= ranges.threads() <= (os.cpu_count() or 1)


def test_without_a_thread_to_be_had_the_caller_computes(monkeypatch):
    def refuse(*_):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    monkeypatch.setattr(ThreadPoolExecutor, "submit", refuse)
    done = []
    qc.set_threads(2)
    ranges.over(lambda start, stop: done.append((start, stop)), 10, 10)
    assert [i for cut in done for i in range(*cut)] == list(range(10))


def test_an_error_in_another_thread_is_raised_and_nothing_waits_inside_another_call(monkeypatch):
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    qc.set_threads(2)
    caller = threading.get_ident()

    def fail(start, stop):
        if threading.get_ident() != caller:
            raise ZeroDivisionError("far away")
        time.sleep(0.05)

    with pytest.raises(ZeroDivisionError, match="far away"):
        ranges.over(fail, 10, 10)

    done = []

    def inner(start, stop):
        ranges.over(lambda i, j: done.extend(range(start + i, start + j)), stop - start, stop - start)

    ranges.over(inner, 100, 100)  # by a pool all of whose threads are busy with the outer call
    assert sorted(done) == list(range(100))


def general(stencils, scheme):
    """Stiffness summed entry by entry, as scipy does."""
    return SCHEMES[scheme].assemble(stencils)[0]


@pytest.mark.parametrize("scheme", DIRECT)
def test_stiffness_straight_into_csr(scheme):
    points = rough((17, 23))
    meshes = [
        QuadGrid(rough((12, 14))),
        QuadGrid(rough((12, 14)), (True, True)),
        StaggeredGrid(points[1::2, 1::2], points[::2, ::2]),
        *(QuadMesh(*sheet((12, 14), **kind)) for kind in ({}, {"hole": True}, {"n_triangles": 20})),
    ]
    for mesh in meshes:
        S = qc.stiffness_matrix(mesh, scheme)
        # A cell's diamonds make up half of its area.
        expected = (2 if isinstance(mesh, StaggeredGrid) else 1) * general(mesh.stencils(), scheme)
        assert S.shape == expected.shape
        assert abs(S - expected).max() < 1e-12 * abs(expected).max()
        S.check_format(full_check=True)
        assert S.has_canonical_format
        assert S.nnz <= expected.nnz


@pytest.mark.parametrize("scheme", DIRECT)
def test_stiffness_is_refreshed_in_place(scheme, monkeypatch):
    points, faces = sheet((60, 50), n_triangles=30, hole=True)
    mesh = QuadMesh(points, faces)
    S = qc.stiffness_matrix(mesh, scheme)
    arrays = S.indptr, S.indices, S.data
    moved = mesh.with_points(points + 0.1 * np.sin(points[:, ::-1]))
    fresh = qc.stiffness_matrix(moved, scheme)
    assert abs(S - fresh).max() > 0.01
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    qc.set_threads(3)
    assert qc.stiffness_matrix(moved, scheme, out=S) is S
    for one, other, expected in zip(
        arrays, (S.indptr, S.indices, S.data), (fresh.indptr, fresh.indices, fresh.data), strict=True
    ):
        assert one is other
        np.testing.assert_array_equal(one, expected)
    with pytest.raises(ValueError, match="out: expected a stiffness matrix of the same mesh"):
        qc.stiffness_matrix(QuadMesh(*sheet((12, 14))), scheme, out=S)
    with pytest.raises(ValueError, match="out: cotan-6 assembles a new matrix each time"):
        qc.stiffness_matrix(mesh, "cotan-6", out=S)


def test_a_ring_with_a_vertex_twice_is_not_regular():
    """A torus so thin and twisted that the two vertices diagonally across are one."""

    def vertex(i, j):
        return 5 * (i % 2) + (j - 2 * (i // 2)) % 5

    quads = [
        [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)]
        for i in range(2)
        for j in range(5)
    ]
    mesh = QuadMesh(rough((2, 5)).reshape(-1, 3), quads)
    assert (mesh.connectivity.ring[:, 0] < 0).all()
    same(mesh, "finite_volume", "nan")
    S = qc.stiffness_matrix(mesh, "finite_volume")
    assert S.has_canonical_format
    assert abs(S - general(mesh.stencils(), "finite_volume")).max() < 1e-13 * abs(S).max()
