"""Grids of dask arrays and of xarray: lazy and labelled where the points are, and the same numbers."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from test_chunked import NAMES, WRAPS, equal, points

import quadcurv as qc
from quadcurv.kernels import ranges

# Points in any order make faces that fold over: what is told of them is tested elsewhere.
pytestmark = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")

da = pytest.importorskip("dask.array")
dask = pytest.importorskip("dask")
xr = pytest.importorskip("xarray")


@pytest.mark.parametrize("chunks", [(41, 37), (13, 35), (39, 12), (7, 9)], ids=str)
@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("kind", ["rough", "pole"])
def test_tasks_are_the_whole_grid_to_the_bit(kind, wrap, chunks):
    """Last chunks of 2 among them."""
    x = points(kind, wrap)
    lazy = qc.evaluate(qc.ChunkedGrid(da.from_array(x, (*chunks, 2)), wrap), *NAMES, scheme="finite_volume")
    whole = qc.evaluate(qc.QuadGrid(x, wrap), *NAMES, scheme="finite_volume")
    for array in lazy.values():
        assert isinstance(array, da.Array)
        assert array.chunks[:2] == da.core.normalize_chunks(chunks, x.shape[:2])
    for name, array in dask.compute(lazy)[0].items():
        assert equal(array, whole[name]), name


@pytest.mark.parametrize("wrap", WRAPS)
def test_chunks_of_one(wrap):
    x = points("rough", wrap)[:8, :7]
    found = qc.mean_curvature(qc.ChunkedGrid(da.from_array(x, (1, 1, 3)), wrap), "liu")
    assert equal(found.compute(scheduler="sync"), qc.mean_curvature(qc.QuadGrid(x, wrap), "liu"))


def test_nothing_is_computed_before_it_is_asked():
    def fail(block):
        raise RuntimeError("computed")

    x = da.from_array(points("smooth", (False, False)), (10, 10, 3)).map_blocks(
        fail, meta=np.empty((0, 0, 0))
    )
    lazy = [
        qc.mean_curvature(qc.ChunkedGrid(x), "liu"),
        qc.curvatures(x).k1,
        qc.gaussian_curvature(x, "angle_defect"),
        qc.laplace_beltrami(x, x[..., 0]),
        qc.vertex_normals(x),
    ]
    for array in lazy:
        with pytest.raises(RuntimeError, match="computed"):
            array.compute(scheduler="sync")


def test_the_other_verbs():
    wrap = (False, True)
    x = points("rough", wrap)
    lazy, whole = qc.ChunkedGrid(da.from_array(x, (17, 12, 3)), wrap), qc.QuadGrid(x, wrap)
    one, other = qc.curvatures(whole), qc.curvatures(lazy)
    for name in ("mean", "k1", "normal", "noise"):
        np.testing.assert_allclose(getattr(other, name).compute(), getattr(one, name), rtol=0, atol=1e-12)
    assert equal(other.degree.compute(), one.degree)
    assert other.standard_error.mean.shape == x.shape[:2]
    f = da.from_array(x[..., :2], (17, 12, 2))
    found = qc.laplace_beltrami(lazy, f, "liu").compute()
    np.testing.assert_allclose(found, qc.laplace_beltrami(whole, x[..., :2], "liu"), rtol=0, atol=1e-9)
    assert equal(qc.dual_areas(lazy, "liu").compute(), qc.dual_areas(whole, "liu"))


def test_holes_have_to_be_declared():
    x = points("smooth", (False, True))
    mask = np.zeros(x.shape[:2], bool)
    mask[10:14, 20:29] = True
    holed = da.from_array(np.where(mask[..., None], np.nan, x), (21, 20, 3))
    whole = qc.mean_curvature(qc.QuadGrid(x, (False, True), mask), "liu")
    for grid in (
        qc.ChunkedGrid(holed, (False, True), "nan"),
        qc.ChunkedGrid(da.from_array(x, (21, 20, 3)), (False, True), da.from_array(mask, (21, 20))),
        qc.ChunkedGrid(da.from_array(x, (21, 20, 3)), (False, True), mask),
    ):
        np.testing.assert_allclose(qc.mean_curvature(grid, "liu").compute(), whole, rtol=0, atol=1e-12)
    with pytest.raises(qc.MeshError, match=r'NaN at vertex \(10, 20\); ChunkedGrid\(points, mask="nan"\)'):
        qc.mean_curvature(qc.ChunkedGrid(holed[:, :35]), "liu").compute(scheduler="sync")


@pytest.mark.parametrize("ghosts", [False, True])
def test_staggered_tasks(ghosts):
    u, v = np.meshgrid(np.linspace(0.2, 2.4, 45), np.linspace(0, 2 * np.pi, 41), indexing="ij")
    x = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1)
    primal, dual = x[1::2, 1::2], x[::2, ::2]
    wrap = (False, not ghosts)
    if ghosts:
        dual = dual[1:-1, 1:-1]
    whole = qc.mean_curvature(qc.StaggeredGrid(primal, dual, wrap), "liu")
    grid = qc.ChunkedGrid(da.from_array(primal, (9, 8, 3)), wrap, dual=da.from_array(dual, (5, 30, 3)))
    assert equal(qc.mean_curvature(grid, "liu").compute(), whole)


def test_places_are_those_of_the_whole_grid():
    x = points("smooth", (False, False))
    x[33, 30] = np.inf
    with pytest.raises(qc.MeshError, match=r"first vertex \(33, 30\)"):
        qc.mean_curvature(da.from_array(x, (10, 10, 3)), "liu").compute(scheduler="sync")


def test_tasks_do_not_wake_threads(monkeypatch):
    """Those of dask are at work already."""
    monkeypatch.setattr(ranges, "SERIAL_BELOW", 0)
    qc.set_threads(3)
    try:
        assert ranges.threads() == 3
        with ranges.serial():
            assert ranges.threads() == 1
            with ranges.serial():
                pass
            assert ranges.threads() == 1
        assert ranges.threads() == 3
        monkeypatch.setattr(ranges, "_pool", None)
        x = points("smooth", (True, True))
        qc.mean_curvature(qc.ChunkedGrid(da.from_array(x, (20, 20, 3)), (True, True)), "liu").compute()
        assert ranges._pool is None
    finally:
        qc.set_threads(None)


@pytest.mark.filterwarnings("default")
def test_other_processes():
    from distributed import Client, LocalCluster

    x = points("rough", (False, True))
    lazy = qc.mean_curvature(qc.ChunkedGrid(da.from_array(x, (20, 20, 3)), (False, True)), "finite_volume")
    whole = qc.mean_curvature(qc.QuadGrid(x, (False, True)), "finite_volume")
    cluster = LocalCluster(1, threads_per_worker=2, processes=True, dashboard_address=None)
    with cluster, Client(cluster):
        assert equal(lazy.compute(), whole)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_killed_in_the_middle_changes_nothing(tmp_path):
    """The tasks that it was at are done again by the other one; blocks go from zarr to zarr."""
    import os
    import signal
    import threading

    from distributed import Client, LocalCluster

    zarr = pytest.importorskip("zarr")
    x, wrap = points("rough", (False, True), 120, 90), (False, True)
    z = zarr.create_array(store=tmp_path / "x.zarr", shape=x.shape, chunks=(8, 9, 3), dtype="f8")
    z[:] = x
    whole = qc.mean_curvature(qc.QuadGrid(x, wrap), "finite_volume")
    cluster = LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, Client(cluster) as client:
        victim, done = next(iter(client.run(os.getpid).values())), []
        timer = threading.Timer(1.0, lambda: done.append(os.kill(victim, signal.SIGKILL)))
        timer.start()
        for k in range(30):
            into = zarr.create_array(
                store=tmp_path / f"{k}.zarr", shape=x.shape[:2], chunks=(8, 9), dtype="f8"
            )
            lazy = qc.mean_curvature(qc.ChunkedGrid(da.from_zarr(tmp_path / "x.zarr"), wrap), "finite_volume")
            da.store(lazy, into, lock=False)
            if done:
                break
        timer.join()
        assert done
        assert equal(into[:], whole)


@pytest.mark.parametrize("lazy", [da.from_array, None], ids=["dask", "numpy"])
def test_a_grid_in_memory_refuses_what_is_not(lazy, tmp_path):
    if lazy is None:
        zarr = pytest.importorskip("zarr")
        array = zarr.create_array(store=tmp_path / "x.zarr", shape=(5, 5, 3), dtype="f8", fill_value=1.0)
    else:
        array = da.map_blocks(lambda: 1 / 0, chunks=((5,), (5,), (3,)), meta=np.empty((0, 0, 0)))
    for make in (qc.QuadGrid, lambda x: qc.StaggeredGrid(x, x), lambda x: qc.QuadMesh(x, [[0, 1, 2]])):
        with pytest.raises(qc.MeshError, match=r"lazy array .*qc\.ChunkedGrid computes it"):
            make(array)
    with pytest.raises(ValueError, match=r"out: of a dask array results are dask arrays"):
        qc.evaluate(qc.ChunkedGrid(da.ones((5, 5, 3))), out={"mean_curvature": np.empty((5, 5))})


# xarray -------------------------------------------------------------------------------------------


def labelled(chunked=False):
    x = points("smooth", (False, True))
    array = xr.DataArray(
        x,
        dims=("y", "x", "xyz"),
        coords={"y": np.arange(41.0), "depth": (("y", "x"), x[..., 2]), "xyz": list("xyz"), "run": 7},
        attrs={"units": "m"},
    )
    return array.chunk(y=20, x=17) if chunked else array


@pytest.mark.parametrize("chunked", [False, True])
@pytest.mark.parametrize("order", list(itertools.permutations(("y", "x", "xyz"))), ids=" ".join)
def test_dimensions_have_names(order, chunked):
    array = labelled(chunked).transpose(*order)
    grid = qc.from_xarray(array, ("y", "x", "xyz"), (False, True))
    H, Hn = qc.mean_curvature(grid, "liu"), qc.mean_curvature_normal(grid, "liu")
    whole = qc.QuadGrid(points("smooth", (False, True)), (False, True))
    assert H.dims == tuple(d for d in order if d != "xyz")
    assert Hn.dims == order
    assert equal(H.transpose("y", "x").values, qc.mean_curvature(whole, "liu"))
    assert equal(Hn.transpose("y", "x", "xyz").values, qc.mean_curvature_normal(whole, "liu"))
    assert (H.chunks is not None) == chunked
    assert set(H.coords) == {"y", "depth", "run"}
    assert set(Hn.coords) == {"y", "depth", "xyz", "run"}
    assert H.attrs == {"units": "m-1", "long_name": "mean curvature (k1 + k2) / 2"}
    assert H.name == "mean_curvature"


def test_the_order_of_names_decides_the_sign():
    one = qc.mean_curvature(qc.from_xarray(labelled(), ("y", "x", "xyz"), (False, True)), "liu")
    other = qc.mean_curvature(qc.from_xarray(labelled(), ("x", "y", "xyz"), (True, False)), "liu")
    np.testing.assert_allclose(one, -other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("chunked", [False, True])
def test_time_is_kept(chunked):
    time = np.arange(3)
    array = xr.concat([labelled(chunked) * (1 + t) for t in time], "time").assign_coords(time=time)
    array = array.assign_attrs(units="mm").transpose("y", "time", "x", "xyz")
    grid = qc.from_xarray(array, ("y", "x", "xyz"), (False, True))
    assert repr(grid).startswith("ChunkedGrid(3 times 41 x 37 points")
    found = qc.curvatures(grid)
    assert found.mean.dims == ("y", "time", "x")
    assert found.gaussian.attrs["units"] == "mm-2"
    assert found.degree.dtype == np.int32
    one = qc.mean_curvature(qc.from_xarray(labelled(), ("y", "x", "xyz"), (False, True)))
    np.testing.assert_allclose(found.mean.sel(time=1), one / 2, rtol=0, atol=1e-12)


def test_a_dataset_and_units():
    array = labelled().rename(y="i", x="j")
    data = array.drop_vars("depth").to_dataset("xyz")

    def of(data):
        return qc.from_xarray(data, ("i", "j"), (False, True))

    H = qc.mean_curvature(of(data), "liu")
    one = qc.mean_curvature(qc.from_xarray(array, ("i", "j", "xyz"), (False, True)), "liu")
    assert equal(H.transpose("i", "j").values, one.values)
    assert H.attrs["units"] == "m-1"
    data = data.drop_attrs()
    assert "units" not in qc.mean_curvature(of(data), "liu").attrs
    for variable in data.data_vars.values():
        variable.attrs["units"] = "km"
    assert qc.dual_areas(of(data), "liu").attrs["units"] == "km2"
    for variable in data.data_vars.values():
        variable.attrs["units"] = "earth radii"
    assert qc.dual_areas(of(data), "liu").attrs["units"] == "(earth radii)2"
    for variable in data.data_vars.values():
        variable.attrs["units"] = "km"
    assert "units" not in qc.vertex_normals(of(data)).attrs
    data["x"].attrs["units"] = "m"
    with pytest.raises(qc.MeshError, match="coordinates in different units"):
        of(data)


def test_a_labelled_mask():
    array = labelled()
    mask = xr.DataArray(np.zeros((37, 41), bool), dims=("x", "y"))
    mask[20:25, 10:14] = True
    H = qc.mean_curvature(qc.from_xarray(array, ("y", "x", "xyz"), (False, True), mask), "liu")
    assert equal(np.isnan(H), mask.transpose("y", "x"))


@pytest.mark.parametrize(
    ("ask", "error", "match"),
    [
        (lambda: qc.mean_curvature(labelled()), TypeError, "qc.from_xarray.*decides the sign of H"),
        (lambda: qc.from_xarray(labelled(), ("y", "x")), qc.MeshError, "dims: expected names of rows"),
        (lambda: qc.from_xarray(labelled(), ("y", "z", "xyz")), qc.MeshError, "dims: expected names of rows"),
        (lambda: qc.from_xarray(labelled(), ("xyz", "x", "y")), qc.MeshError, "y has 41 entries"),
        (lambda: qc.from_xarray(np.ones((3, 3, 3)), ("y", "x", "z")), TypeError, "expected a DataArray"),
        (
            lambda: qc.from_xarray(xr.Dataset({"a": labelled()}), ("y", "x")),
            qc.MeshError,
            "expected three var",
        ),
    ],
)
def test_what_is_refused(ask, error, match):
    with pytest.raises(error, match=match):
        ask()


def test_what_is_not_installed_is_named(monkeypatch, tmp_path):
    from quadcurv import extras

    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    for ask in (
        lambda: qc.from_xarray(labelled(), ("y", "x", "xyz")),
        lambda: qc.mean_curvature(tmp_path / "x.zarr"),
        lambda: qc.mean_curvature(tmp_path / "x.h5"),
        lambda: qc.mean_curvature(da.ones((5, 5, 3)), "liu"),
    ):
        with pytest.raises(ImportError, match=r'is not installed: pip install "quadcurv\[scale\]"'):
            ask()
