"""Grids that are read block by block give what grids in memory give."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

import quadcurv as qc
from quadcurv.drivers import chunked, windows
from quadcurv.io import as_mesh_or_chunks
from tests.test_poles import opened

# Points in any order make faces that fold over: what is told of them is tested elsewhere.
pytestmark = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")

NAMES = ("mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas")
WRAPS = list(itertools.product((False, True), repeat=2))
KINDS = ("smooth", "uneven", "rough", "pole")


class Chunks:
    """An array that counts what is read of it at a time, with chunks as zarr has them."""

    def __init__(self, array, chunks):
        self.array, self.chunks = array, chunks
        self.shape, self.dtype, self.most = array.shape, array.dtype, 0

    def __getitem__(self, index):
        found = self.array[index]
        self.most = max(self.most, found.size)
        return found.copy()


def points(kind, wrap, r=41, c=37):
    rng = np.random.default_rng(3)
    u, v = (
        np.linspace(0.2, 2 * np.pi if w else 2.4, n, endpoint=not w)
        for w, n in zip(wrap, (r, c), strict=True)
    )
    if kind == "uneven":
        u = u if wrap[0] else np.sort(rng.uniform(0, 2, r))
    if kind == "pole":
        u = u if wrap[0] else np.linspace(0, 2.2, r)
        u, v = np.meshgrid(u, v, indexing="ij")
        return np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
    u, v = np.meshgrid(u, v, indexing="ij")
    x = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1)
    return x + 1e-3 * rng.normal(size=x.shape) if kind == "rough" else x


@pytest.fixture
def small(monkeypatch):
    """Blocks of a few rows."""
    monkeypatch.setattr(chunked, "_MOST", 300)
    monkeypatch.setattr(chunked, "_MOST_SMALL", 400)


def equal(one, other):
    return np.array_equal(one, other, equal_nan=True)


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
def test_slabs_are_the_whole_grid_to_the_bit(small, wrap, kind, boundary):
    x = points(kind, wrap)
    for scheme in ("finite_volume", "liu"):
        whole = qc.evaluate(qc.QuadGrid(x, wrap), *NAMES, scheme=scheme, boundary=boundary)
        slabs = qc.evaluate(qc.ChunkedGrid(x, wrap), *NAMES, scheme=scheme, boundary=boundary)
        for name in NAMES:
            assert equal(whole[name], slabs[name]), (scheme, name)


@pytest.mark.parametrize("chunks", [(1, 1), (1, 37), (41, 1), (13, 35), (39, 7)], ids=str)
@pytest.mark.parametrize("wrap", WRAPS)
def test_any_chunks_are_the_whole_grid_to_the_bit(monkeypatch, wrap, chunks):
    """Chunks of 1, last ones of 2."""
    monkeypatch.setattr(chunked, "_MOST", 1)
    x = points("rough", wrap)
    array = Chunks(x, (*chunks, 3))
    if chunks == (1, 1):  # each vertex by itself takes long
        x = x[:9, :8]
        array = Chunks(x, (1, 1, 3))
        monkeypatch.setattr(windows, "blocks", windows.blocks)
    slabs = qc.evaluate(qc.ChunkedGrid(array, wrap), *NAMES, scheme="liu")
    whole = qc.evaluate(qc.QuadGrid(x, wrap), *NAMES, scheme="liu")
    for name in NAMES:
        assert equal(whole[name], slabs[name]), name


@pytest.mark.parametrize("shape", [(2, 2), (2, 9), (3, 3), (5, 4), (6, 7), (12, 3)])
@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
def test_small_grids_are_as_in_memory(small, shape, boundary):
    x = points("smooth", (False, False))[: shape[0], : shape[1]]
    for wrap in WRAPS:
        if any(w and n < 3 for w, n in zip(wrap, shape, strict=True)):
            continue
        whole = qc.mean_curvature(qc.QuadGrid(x, wrap), "finite_volume", boundary)
        assert equal(whole, qc.mean_curvature(qc.ChunkedGrid(x, wrap), "finite_volume", boundary))


@pytest.mark.parametrize("scheme", ["finite_volume", "cotan-6", "angle_defect"])
@pytest.mark.parametrize("opening", ["half", "by and by", "both ends", "half nearly"])
@pytest.mark.parametrize("swapped", [False, True])
def test_skew_cells_past_a_pole_are_those_of_the_whole_grid(monkeypatch, opening, swapped, scheme):
    """They lie up to seven rows from the side, and other chunks do not see the pole."""
    monkeypatch.setattr(chunked, "_MOST", 400)
    monkeypatch.setattr(chunked, "_MOST_SMALL", 400)
    x = opened(opening, "grid")[0].points
    x = x.swapaxes(0, 1) if swapped else x
    verb = qc.gaussian_curvature if scheme == "angle_defect" else qc.mean_curvature
    whole, blocks = (verb(grid(x), scheme) for grid in (qc.QuadGrid, qc.ChunkedGrid))
    np.testing.assert_allclose(whole, blocks, rtol=0, atol=1e-9)


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("kind", KINDS)
def test_fits_are_those_of_the_whole_grid(monkeypatch, wrap, kind):
    """To the bit but where the grid wraps, whose faces come in another order; noise magnifies rounding."""
    if kind == "pole" and wrap[0]:
        pytest.skip("rows that wrap have no pole")
    monkeypatch.setattr(chunked, "_MOST_SMALL", 400)
    x = points(kind, wrap)
    ways = [(scheme, "extrapolate") for scheme in ("jet", "jet-2", qc.schemes.jet(4))] + [("jet", "nan")]
    for scheme, boundary in ways:
        whole = qc.curvatures(qc.QuadGrid(x, wrap), scheme, boundary)
        blocks = qc.curvatures(qc.ChunkedGrid(x, wrap), scheme, boundary)
        for name in ("degree", "rings", *(["feature"] if scheme == "jet" else [])):
            assert equal(getattr(whole, name), getattr(blocks, name)), name
        for name in ("mean", "gaussian", "k1", "k2", "normal", "noise"):
            one, other = getattr(whole, name), getattr(blocks, name)
            if scheme != "jet" or not any(wrap):
                assert equal(one, other), (scheme, name)
            atol = (1e-13 if kind in ("smooth", "uneven") else 2e-12) * max(np.nanmax(np.abs(one)), 1)
            np.testing.assert_allclose(one, other, rtol=0, atol=atol, err_msg=name)
        assert blocks.degree.dtype == np.int32
        if scheme == "jet":
            np.testing.assert_allclose(whole.interval.mean, blocks.interval.mean, rtol=1e-6, atol=1e-9)


def test_creases_are_found_in_blocks(monkeypatch):
    """A roof, whose ridge one block sees and others do not."""
    monkeypatch.setattr(chunked, "_MOST_SMALL", 400)
    u, v = np.meshgrid(np.linspace(-1, 1, 81), np.linspace(0, 1, 41), indexing="ij")
    x = np.stack([u, v, 0.2 * np.sin(3 * v) - np.abs(u)], axis=-1)
    whole, blocks = qc.curvatures(qc.QuadGrid(x)), qc.curvatures(qc.ChunkedGrid(x))
    assert whole.feature.sum() == 41
    assert equal(whole.feature, blocks.feature)
    assert equal(whole.degree, blocks.degree)
    # With a crease anywhere the grid in memory is fitted as a face list, a block without one by windows.
    np.testing.assert_allclose(whole.mean, blocks.mean, rtol=0, atol=1e-7)


def test_other_fits_of_other_reach(small):
    x = points("rough", (False, True))
    for scheme in (qc.schemes.jet(4, rings=4), qc.schemes.jet(2, rings=3)):
        whole = qc.mean_curvature(qc.QuadGrid(x, (False, True)), scheme)
        blocks = qc.mean_curvature(qc.ChunkedGrid(x, (False, True)), scheme)
        np.testing.assert_allclose(whole, blocks, rtol=0, atol=1e-12)
    everywhere = replace(qc.schemes.jet(4), name="everywhere", reach=None)
    with pytest.raises(ValueError, match="everywhere looks at all of a grid at once"):
        qc.mean_curvature(qc.ChunkedGrid(x), everywhere)


@pytest.mark.parametrize("scheme", [name for name in qc.SCHEMES if not name.startswith("jet")])
def test_every_laplacian(small, scheme):
    x = points("rough", (False, True))
    whole = qc.evaluate(qc.QuadGrid(x, (False, True)), *NAMES, scheme=scheme)
    slabs = qc.evaluate(qc.ChunkedGrid(x, (False, True)), *NAMES, scheme=scheme)
    for name in NAMES:
        size = np.nanmax(np.abs(whole[name]))
        np.testing.assert_allclose(whole[name], slabs[name], rtol=0, atol=1e-12 * size, err_msg=name)


@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("scheme", ["finite_volume", "jet"])
def test_holes(monkeypatch, wrap, scheme):
    """The ways to say that there are some, and at their rims fitted surfaces."""
    monkeypatch.setattr(chunked, "_MOST", 300)
    monkeypatch.setattr(chunked, "_MOST_SMALL", 900)
    rng = np.random.default_rng(5)
    x = points("rough", wrap)
    mask = rng.random(x.shape[:2]) < 0.01
    mask[10:14, 20:29] = True
    whole = qc.mean_curvature(qc.QuadGrid(x, wrap, mask), scheme)
    masked = qc.mean_curvature(qc.ChunkedGrid(x, wrap, mask), scheme)
    assert np.isfinite(whole).sum() > 0.9 * whole.size
    # One-sided fits at a seam, whose faces come in another order, magnify rounding most.
    atol = (2e-10 if scheme == "jet" else 1e-12) * np.nanmax(np.abs(whole))
    np.testing.assert_allclose(whole, masked, rtol=0, atol=atol)
    if scheme == "finite_volume":
        inner = qc.QuadGrid(x, wrap, mask).to_mesh().stencils().closed
        at = np.zeros(mask.shape, bool)
        at[~mask] = inner
        at[[0, -1]] = at[:, [0, -1]] = False  # a seam has its faces in another order
        assert equal(whole[at], masked[at])


def test_ways_to_have_holes(monkeypatch):
    monkeypatch.setattr(chunked, "_MOST_SMALL", 900)
    x = points("smooth", (False, True))
    x[10:14, 20:29] = np.nan
    with pytest.warns(qc.MeshWarning, match="without a position"):
        whole = qc.mean_curvature(qc.QuadGrid(x, (False, True)), "liu")
    declared = qc.mean_curvature(qc.ChunkedGrid(x, (False, True), "nan"), "liu")
    with pytest.warns(qc.MeshWarning, match=r"taken as holes, first found vertex \(10, 20\)"):
        found = qc.mean_curvature(qc.ChunkedGrid(x, (False, True)), "liu")
    np.testing.assert_allclose(whole, declared, rtol=0, atol=1e-12)
    assert equal(declared, found)


def test_a_mask_that_hides_nothing_and_one_that_hides_nearly_all(small):
    x = points("pole", (False, True))
    nothing = np.zeros(x.shape[:2], bool)
    whole = qc.mean_curvature(qc.QuadGrid(x, (False, True)), "liu")
    assert equal(whole, qc.mean_curvature(qc.ChunkedGrid(x, (False, True), nothing), "liu"))
    assert equal(whole, qc.mean_curvature(qc.ChunkedGrid(x, (False, True), "nan"), "liu"))
    much = ~nothing
    much[3:6, 3:6] = much[30, 30] = False
    for scheme in ("liu", "jet"):
        whole = qc.mean_curvature(qc.QuadGrid(x, mask=much), scheme)
        np.testing.assert_allclose(whole, qc.mean_curvature(qc.ChunkedGrid(x, mask=much), scheme), atol=1e-12)
    areas = qc.dual_areas(qc.QuadGrid(x, mask=much))
    assert equal(np.isnan(areas), much)
    np.testing.assert_allclose(areas, qc.dual_areas(qc.ChunkedGrid(x, mask=much)), rtol=1e-13)


STAGGERED = [("smooth", wrap) for wrap in WRAPS] + [("rough", (False, True)), ("pole", (False, True))]


@pytest.mark.parametrize(("kind", "wrap"), [*STAGGERED, ("ghosts", (False, False))])
def test_staggered_grids(small, kind, wrap):
    def fine(n, w):
        return np.linspace(0.2, 0.2 + 2 * np.pi if w else 2.4, 2 * n + 1)

    u, v = fine(20, wrap[0]), fine(18, wrap[1])
    if kind == "pole":
        u = np.linspace(0, 2, u.size)
    u, v = np.meshgrid(u, v, indexing="ij")
    x = np.stack([(3 + np.cos(v)) * np.cos(u), (3 + np.cos(v)) * np.sin(u), np.sin(v)], axis=-1)
    if kind == "pole":
        x = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=-1)
    primal, dual = x[1::2, 1::2], x[::2, ::2]
    if kind == "rough":
        primal = primal + 1e-3 * np.random.default_rng(1).normal(size=primal.shape)
    if kind == "ghosts":
        dual = dual[1:-1, 1:-1]
    whole, parts = qc.StaggeredGrid(primal, dual, wrap), qc.ChunkedGrid(primal, wrap, dual=dual)
    for boundary in ("extrapolate", "nan"):
        for scheme in ("finite_volume", "liu"):
            one = qc.evaluate(whole, *NAMES, scheme=scheme, boundary=boundary)
            other = qc.evaluate(parts, *NAMES, scheme=scheme, boundary=boundary)
            for name in NAMES:
                assert equal(one[name], other[name]), (scheme, name, boundary)
        one, other = (qc.mean_curvature(mesh, "jet", boundary) for mesh in (whole, parts))
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-12)


@pytest.mark.parametrize("wrap", WRAPS)
def test_operators_and_angles(small, wrap):
    x = points("pole", wrap)
    whole, parts = qc.QuadGrid(x, wrap), qc.ChunkedGrid(x, wrap)
    for f in (x, x[..., 0], x[..., 2] > 0.3):
        for scheme in ("liu", "bilinear"):
            one, other = (qc.laplace_beltrami(mesh, f, scheme) for mesh in (whole, parts))
            size = np.nanmax(np.abs(one))
            np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * size)
    one, other = (qc.gaussian_curvature(mesh, "angle_defect") for mesh in (whole, parts))
    np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    one, other = (qc.vertex_normals(mesh) for mesh in (whole, parts))
    assert equal(one, other)
    one, other = (qc.principal_curvatures(mesh) for mesh in (whole, parts))
    np.testing.assert_allclose(one.k1, other.k1, rtol=0, atol=1e-11)


def test_what_is_read_at_a_time(monkeypatch):
    monkeypatch.setattr(chunked, "_MOST", 400)
    x = points("smooth", (True, True), 120, 30)
    array = Chunks(x, None)
    qc.evaluate(qc.ChunkedGrid(array, (True, True)), "mean_curvature")
    assert array.most <= (400 + 8 * 30) * 3


def test_few_chunks_are_read_at_a_time(monkeypatch):
    """An array on disk holds, decoded, all chunks that a slice touches."""
    monkeypatch.setattr(chunked, "_MOST", 300)
    monkeypatch.setattr(windows, "_DECODED", 2 * 13 * 7 * 3 * 8)
    touched = []

    class Counted(Chunks):
        def __getitem__(self, index):
            ends = [s.indices(n)[:2] for s, n in zip(index, self.shape, strict=False)]
            spans = [(b - 1) // n - a // n + 1 for (a, b), n in zip(ends, self.chunks, strict=False)]
            touched.append(spans[0] * spans[1])
            return super().__getitem__(index)

    for wrap in WRAPS:
        x = points("rough", wrap)
        slabs = qc.evaluate(qc.ChunkedGrid(Counted(x, (13, 7, 3)), wrap), *NAMES, scheme="liu")
        whole = qc.evaluate(qc.QuadGrid(x, wrap), *NAMES, scheme="liu")
        assert all(equal(whole[name], slabs[name]) for name in NAMES)
    assert max(touched) == 2


def test_results_into_files(tmp_path, small):
    zarr, h5py = pytest.importorskip("zarr"), pytest.importorskip("h5py")
    x, wrap = points("rough", (False, True)), (False, True)
    np.save(tmp_path / "x.npy", x)
    z = zarr.create_array(store=tmp_path / "x.zarr", shape=x.shape, chunks=(10, 7, 3), dtype="f8")
    z[:] = x
    whole = qc.evaluate(qc.QuadGrid(x, wrap), "mean_curvature", "mean_curvature_normal", scheme="liu")
    with h5py.File(tmp_path / "x.h5", "w") as file:
        d = file.create_dataset("points", data=x, chunks=(5, 11, 3))
        for source in (np.load(tmp_path / "x.npy", mmap_mode="r"), z, d):
            into = {
                "mean_curvature": np.lib.format.open_memmap(tmp_path / "H.npy", "w+", float, x.shape[:2]),
                "mean_curvature_normal": zarr.create_array(
                    store=tmp_path / "Hn.zarr", shape=x.shape, chunks=(8, 8, 3), dtype="f8", overwrite=True
                ),
            }
            found = qc.evaluate(qc.ChunkedGrid(source, wrap), scheme="liu", out=into)
            assert found["mean_curvature"] is into["mean_curvature"]
            assert equal(into["mean_curvature"], whole["mean_curvature"])
            assert equal(into["mean_curvature_normal"][:], whole["mean_curvature_normal"])
            verb = qc.mean_curvature(qc.ChunkedGrid(source, wrap), "liu")
            assert equal(verb, whole["mean_curvature"])
    open_ = qc.mean_curvature(qc.QuadGrid(x), "liu")
    for source in (np.load(tmp_path / "x.npy", mmap_mode="r"), z, tmp_path / "x.npy", tmp_path / "x.zarr"):
        assert isinstance(as_mesh_or_chunks(source), qc.ChunkedGrid)
        assert equal(qc.mean_curvature(source, "liu"), open_)
    assert equal(qc.mean_curvature(tmp_path / "x.h5", "liu"), open_)


def test_what_results_must_not_be_written_to(tmp_path):
    zarr, h5py = pytest.importorskip("zarr"), pytest.importorskip("h5py")
    x = points("smooth", (False, False))
    np.save(tmp_path / "x.npy", x)
    z = zarr.create_array(store=tmp_path / "x.zarr", data=x, chunks=(20, 20, 3))

    def refused(source, target, name="mean_curvature_normal", match="overlaps the memory"):
        with pytest.raises(ValueError, match=f"out: {name} .*{match}"):
            qc.evaluate(qc.ChunkedGrid(source), out={name: target})

    def mapped(mode="r", name="x.npy"):
        return np.load(tmp_path / name, mmap_mode=mode)

    refused(mapped(), mapped("r+"))  # another view of the same file
    refused(mapped()[5:30], mapped("r+")[10:35])
    refused(z, zarr.open(tmp_path / "x.zarr", mode="r+"))
    refused(z, zarr.open(tmp_path / "x.zarr", mode="r"), match="read-only")
    refused(x, mapped(), match="read-only")
    refused(x, "H.npy", match=r"got object of shape \(\) \(str\)")
    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["points"], file["other"] = x, x
        refused(file["points"], file["points"])
        qc.evaluate(qc.ChunkedGrid(file["points"]), out={"mean_curvature_normal": file["other"]})
        assert equal(file["other"][:], qc.mean_curvature_normal(qc.QuadGrid(x), "finite_volume"))
    with h5py.File(tmp_path / "x.h5", "r") as file:
        refused(x, file["other"], match="read-only")
    # One file may hold both, apart.
    both = np.memmap(tmp_path / "both.bin", np.float64, "w+", shape=(4, *x.shape[:2]))
    both[:3] = x.reshape(3, *x.shape[:2])
    source = np.memmap(tmp_path / "both.bin", np.float64, "r", shape=x.shape)
    target = np.memmap(tmp_path / "both.bin", np.float64, "r+", 24 * 41 * 37, shape=x.shape[:2])
    qc.evaluate(qc.ChunkedGrid(source), scheme="liu", out={"mean_curvature": target})
    assert equal(both[3], qc.mean_curvature(qc.QuadGrid(x), "liu"))
    assert equal(source, x)
    refused(source, both[1], "mean_curvature")


def test_sizes_that_dask_does_not_know():
    da = pytest.importorskip("dask.array")
    x = da.from_array(points("smooth", (False, False)))
    with pytest.raises(qc.MeshError, match=r"points: of unknown size, .* compute_chunk_sizes\(\)"):
        qc.ChunkedGrid(x[x[:, 0, 0] > 0])


@pytest.mark.parametrize("most", [1, 90, 400])
def test_grids_in_vtkhdf_files(tmp_path, monkeypatch, most):
    """From the points of a face list in the order of a grid, to its values."""
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("vtk")
    monkeypatch.setattr(chunked, "_MOST", most)
    monkeypatch.setattr(chunked, "_MOST_SMALL", 400)
    x, wrap = points("rough", (False, True)), (False, True)
    grid = qc.QuadGrid(x, wrap)
    qc.write(tmp_path / "x.vtkhdf", grid)
    whole = qc.evaluate(grid, "mean_curvature", "mean_curvature_normal", scheme="liu")
    with h5py.File(tmp_path / "x.vtkhdf", "r+") as file:
        mesh = qc.io.vtkhdf.VtkHdf(file)
        rows = qc.ChunkedGrid(mesh.grid(*grid.shape), wrap)
        out = {
            "mean_curvature": mesh.grid_values("H", *grid.shape),
            "mean_curvature_normal": mesh.grid_values("Hn", *grid.shape, 3),
        }
        qc.evaluate(rows, scheme="liu", out=out)
        if most > 1:
            qc.evaluate(rows, "k1", scheme="jet-2", out={"k1": mesh.grid_values("k1", *grid.shape)})
        with pytest.raises(qc.MeshError, match="are no grid of 3 x 5"):
            mesh.grid(3, 5)
    read = qc.read_values(tmp_path / "x.vtkhdf")
    assert equal(read["H"], whole["mean_curvature"].ravel())
    assert equal(read["Hn"], whole["mean_curvature_normal"].reshape(-1, 3))
    if most > 1:
        assert equal(read["k1"], qc.curvatures(grid, "jet-2").k1.ravel())


@pytest.mark.parametrize("chunks", [(1, 1), (13, 5), (4, 12)], ids=str)
@pytest.mark.parametrize("wrap", WRAPS)
@pytest.mark.parametrize("kind", ["npy", "zarr", "h5py"])
def test_any_chunks_on_disk(tmp_path, small, kind, wrap, chunks):
    """Chunks of 1, last ones of 2, in arrays of every library, read and written."""
    x = points("rough", wrap, 15, 14)
    H = np.empty(x.shape[:2])
    if kind == "npy":
        np.save(tmp_path / "x.npy", x)
        source = np.load(tmp_path / "x.npy", mmap_mode="r")
        target = np.lib.format.open_memmap(tmp_path / "H.npy", "w+", float, H.shape)
    else:
        library = pytest.importorskip(kind)
        if kind == "zarr":
            group = library.open_group(library.storage.MemoryStore(), mode="w")
            make = group.create_array
        else:
            make = library.File(tmp_path / "x.h5", "w").create_dataset
        source = make("x", shape=x.shape, chunks=(*chunks, 3), dtype="f8")
        target = make("H", shape=H.shape, chunks=chunks, dtype="f8")
        source[:] = x
    for scheme in ("finite_volume", "jet-2"):
        qc.evaluate(qc.ChunkedGrid(source, wrap), scheme=scheme, out={"mean_curvature": target})
        assert equal(target[:], qc.mean_curvature(qc.QuadGrid(x, wrap), scheme))


def test_single_precision_and_a_leading_dimension(small):
    x = np.stack([points("smooth", (False, True)), 2 * points("rough", (False, True))]).astype(np.float32)
    found = qc.mean_curvature(qc.ChunkedGrid(x, (False, True)), "liu")
    for t in (0, 1):
        assert equal(found[t], qc.mean_curvature(qc.QuadGrid(x[t], (False, True)), "liu"))


def test_rounding_is_told(small):
    ball = qc.surfaces.sphere().sample((300, 300))[0]
    far = (ball.points + 100).astype(np.float32)
    with pytest.warns(qc.PrecisionWarning) as whole:
        qc.mean_curvature(qc.QuadGrid(far, ball.wrap), "liu")
    with pytest.warns(qc.PrecisionWarning) as parts:
        qc.mean_curvature(qc.ChunkedGrid(far, ball.wrap), "liu")
    size = len("positions are rounded to 1.2e-07 of their size, which causes errors of about 1e+0")
    assert str(whole[0].message)[:size] == str(parts[0].message)[:size]


def test_progress_is_shown(small, capsys):
    qc.evaluate(qc.ChunkedGrid(points("smooth", (True, True)), (True, True)), "mean_curvature", progress=True)
    assert "blocks" in capsys.readouterr().err


def test_large_grids_in_memory_are_fitted_in_parts(monkeypatch):
    """With the same results, and warnings that name the caller's line."""
    from quadcurv.drivers import parts

    x = points("rough", (False, True))
    whole = qc.mean_curvature(qc.QuadGrid(x, (False, True)))
    K, Hn = (f(qc.QuadGrid(x, (False, True))) for f in (qc.gaussian_curvature, qc.mean_curvature_normal))
    k1 = qc.curvatures(qc.QuadGrid(x, (False, True))).k1
    monkeypatch.setattr(parts, "_LARGE", 1)
    monkeypatch.setattr(chunked, "_MOST_SMALL", 500)
    seen = []
    evaluate = chunked.evaluate
    monkeypatch.setattr(chunked, "evaluate", lambda *a: seen.append(a) or evaluate(*a))
    grid = qc.QuadGrid(x, (False, True))
    np.testing.assert_allclose(qc.mean_curvature(grid), whole, rtol=0, atol=1e-12)
    np.testing.assert_allclose(qc.gaussian_curvature(grid), K, rtol=0, atol=1e-12 * np.abs(K).max())
    np.testing.assert_allclose(qc.mean_curvature_normal(grid), Hn, rtol=0, atol=1e-12)
    np.testing.assert_allclose(qc.principal_curvatures(grid).k1, k1, rtol=0, atol=1e-12)
    assert len(seen) == 4
    monkeypatch.setattr(chunked, "evaluate", evaluate)
    far = (x + 1e4).astype(np.float32)
    with pytest.warns(qc.PrecisionWarning) as said:
        qc.mean_curvature(qc.QuadGrid(far, (False, True)), "jet-2")
    assert said[0].filename == __file__


def test_arrays_on_the_command_line(tmp_path, monkeypatch, capsys):
    zarr = pytest.importorskip("zarr")
    from quadcurv.cli import main as command

    def main(words, code=0):
        with pytest.raises(SystemExit) as end:
            command(words)
        assert end.value.code == code

    monkeypatch.chdir(tmp_path)
    x = points("smooth", (False, True))
    zarr.create_array(store="x.zarr", shape=x.shape, chunks=(20, 20, 3), dtype="f8")[:] = x
    main(["curvature", "x.zarr", "-o", "H.zarr", "-s", "liu", "--wrap", "columns"])
    assert "blocks" in capsys.readouterr().err
    assert equal(zarr.open("H.zarr")[:], qc.mean_curvature(qc.QuadGrid(x, (False, True)), "liu"))
    main(["curvature", "x.zarr", "-o", "k.zarr", "-v", "k1", "-v", "normal"])
    group = zarr.open("k.zarr")
    np.testing.assert_allclose(group["k1"][:], qc.curvatures(qc.QuadGrid(x)).k1, rtol=0, atol=1e-12)
    np.save("x.npy", x)
    main(["curvature", "x.npy", "-o", "H.npy", "--boundary", "nan"])
    assert np.isnan(np.load("H.npy")).sum() == 2 * (41 + 37) - 4
    main(["curvature", "x.npy", "-o", "H.h5", "-s", "liu"])
    assert np.isfinite(qc.io.hdf5.opened(tmp_path / "H.h5")[:]).all()
    for words, said in (
        (["x.npy", "-o", "H.npy"], "H.npy: exists already"),
        (["x.npy", "-o", "H.obj"], "--output: cannot write .obj"),
        (
            ["x.npy", "-o", "a.npy", "-v", "k1", "-s", "liu"],
            "--value: expected some of mean_curvature, ",
        ),
        (["x.npy", "-o", "a.npy", "-v", "k1", "-v", "k2"], "an .npy file holds one array"),
        (["x.npy", "-o", "a.npy", "--merge"], "an array is taken as it is"),
        (["y.zarr", "-o", "a.npy"], "y.zarr: No such file"),
        (["y.npy", "-o", "a.npy"], "y.npy: No such file"),
        (["y.h5", "-o", "a.npy"], "y.h5: No such file"),
    ):
        main(["curvature", *words], 2)
        assert said in capsys.readouterr().err
    x[30, 20] = np.inf
    np.save("bad.npy", x)
    main(["curvature", "bad.npy", "-o", "a.zarr"], 2)
    assert "first vertex (30, 20)" in capsys.readouterr().err
    assert not (tmp_path / "a.zarr").exists()


def test_files_without_points(tmp_path):
    zarr, h5py = pytest.importorskip("zarr"), pytest.importorskip("h5py")
    (tmp_path / "a.npy").write_bytes(b"nothing")
    (tmp_path / "a.h5").write_bytes(b"nothing")
    (tmp_path / "a.zarr").mkdir()
    group = zarr.open_group(tmp_path / "b.zarr", mode="w")
    for name in ("one", "two"):
        group.create_array(name, shape=(3, 3, 3), dtype="f8")
    with h5py.File(tmp_path / "b.h5", "w") as file:
        file["one"] = file["two"] = np.zeros((3, 3, 3))
    for name, match in (
        ("a.npy", "no array of numbers"),
        ("a.h5", "no HDF5 file"),
        ("a.zarr", "no array of zarr"),
        ("b.zarr", "none of which is called points"),
        ("b.h5", "2 datasets, none of which is called points"),
    ):
        with pytest.raises(qc.MeshError, match=match):
            qc.mean_curvature(tmp_path / name, "liu")
    group.create_array("points", data=X)
    assert qc.mean_curvature(tmp_path / "b.zarr", "liu").shape == (41, 37)


def infinite(x):
    x = x.copy()
    x[33, 30] = np.inf
    return x


X = points("smooth", (False, False))


@pytest.mark.parametrize(
    ("ask", "error", "match"),
    [
        (lambda: qc.ChunkedGrid([[1]]), qc.MeshError, "points: expected an array with shape"),
        (lambda: qc.ChunkedGrid(X[0]), qc.MeshError, r"points: shape \(37, 3\), expected"),
        (lambda: qc.ChunkedGrid(X[..., :2]), qc.MeshError, r"points: shape \(41, 37, 2\)"),
        (lambda: qc.ChunkedGrid(X.astype(complex)), qc.MeshError, "expected real numbers, got dtype complex"),
        (lambda: qc.ChunkedGrid(np.ma.masked_invalid(X)), qc.MeshError, "a masked array; give its data"),
        (lambda: qc.ChunkedGrid(X[:1]), qc.MeshError, "1 rows, at least 2"),
        (lambda: qc.ChunkedGrid(X, (True,)), qc.MeshError, "wrap: expected two booleans"),
        (lambda: qc.ChunkedGrid(X, mask=np.zeros(3, bool)), qc.MeshError, "mask: shape"),
        (lambda: qc.ChunkedGrid(X, mask=np.zeros((41, 37))), qc.MeshError, "mask: expected booleans"),
        (lambda: qc.ChunkedGrid(X, dual=X), qc.MeshError, "does not fit dual"),
        (lambda: qc.ChunkedGrid(X, mask="nan", dual=X[:, :, :]), qc.MeshError, "does not fit dual"),
        (
            lambda: qc.ChunkedGrid(X[1:, 1:], mask="nan", dual=X),
            qc.MeshError,
            "mask: a staggered grid has none",
        ),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(infinite(X)), "liu"),
            qc.MeshError,
            r"points: 1 point\(s\) of the block read non-finite, first vertex \(33, 30\)",
        ),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(X * np.where(infinite(X) == np.inf, 1e80, 1)), "liu"),
            qc.MeshError,
            r"overflow, first vertex \(33, 30\)",
        ),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(infinite(X)[1:, 1:], dual=X), "liu"),
            qc.MeshError,
            r"first vertex \(32, 29\)",
        ),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(np.concatenate((X, X[:1])), (True, False)), "liu"),
            qc.MeshError,
            "wrap: the last of the rows repeats",
        ),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(X[1:, 1:], (True, False), dual=X), "liu"),
            qc.MeshError,
            "dual: first and last rows differ",
        ),
        (lambda: qc.evaluate(qc.ChunkedGrid(X), "torsion"), ValueError, "wanted: expected some of"),
        (lambda: qc.evaluate(qc.ChunkedGrid(X), "dual_areas", scheme="jet"), ValueError, "wanted: expected"),
        (
            lambda: qc.mean_curvature(qc.ChunkedGrid(X), "liu", "open"),
            ValueError,
            "boundary: expected one of",
        ),
        (
            lambda: qc.evaluate(qc.ChunkedGrid(X), out={"mean_curvature": np.empty(3)}),
            ValueError,
            r"out: mean_curvature wants an array of floats of shape \(41, 37\)",
        ),
        (lambda: qc.evaluate(qc.ChunkedGrid(X), out=[1]), ValueError, "out: expected a mapping"),
        (
            lambda: qc.evaluate(qc.ChunkedGrid(X), out={"mean_curvature": X[..., 0]}),
            ValueError,
            "overlaps the memory",
        ),
        (lambda: qc.stiffness_matrix(qc.ChunkedGrid(X)), TypeError, "read block by block"),
        (lambda: qc.compare(qc.ChunkedGrid(X)), TypeError, "read block by block"),
        (lambda: qc.laplace_beltrami(qc.ChunkedGrid(X), X[0]), ValueError, "f: shape"),
        (lambda: qc.laplace_beltrami(qc.ChunkedGrid(X), "f"), ValueError, "f: expected real numbers"),
        (
            lambda: qc.laplace_beltrami(qc.ChunkedGrid(X[1:, 1:], dual=X), X),
            ValueError,
            "functions are taken on one grid",
        ),
    ],
)
def test_what_is_refused(monkeypatch, ask, error, match):
    monkeypatch.setattr(chunked, "_MOST", 300)
    with pytest.raises(error, match=match):
        ask()
