"""Face lists in parts: bitwise those of one mesh, whatever the order, wherever the cuts are."""

from __future__ import annotations

import tempfile
import warnings

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv.boundary import poles_of_faces
from quadcurv.kernels import parts as kernels
from quadcurv.mesh import part_files
from quadcurv.surfaces import cubed_ellipsoid, torus

WANTED = ("mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas")


@pytest.fixture(autouse=True)
def small_chunks(monkeypatch):
    """Files are read in many pieces."""
    monkeypatch.setattr(part_files, "CHUNK", 37)


def noisy(points, size=0.01):
    return points + np.random.default_rng(5).normal(0, size, points.shape)


def closed() -> tuple[np.ndarray, np.ndarray]:
    mesh = cubed_ellipsoid().sample((8, 8), "faces")[0]
    return noisy(mesh.points), mesh.faces


def sheet(n=26, m=17) -> tuple[np.ndarray, np.ndarray]:
    """An open sheet, uneven and rough in places."""
    x, y = np.meshgrid(np.linspace(0, 1, n) ** 1.5, np.linspace(0, 1, m), indexing="ij")
    points = np.stack([x, y, np.sin(2 * x) * np.cos(3 * y)], axis=-1)
    points[:6] = noisy(points[:6], 0.004)
    mesh = qc.QuadGrid(points).to_mesh()
    return mesh.points, mesh.faces


def with_triangles(points, faces) -> tuple[np.ndarray, np.ndarray]:
    cut = np.random.default_rng(1).random(len(faces)) < 0.3
    halves = np.concatenate((faces[cut][:, [0, 1, 2]], faces[cut][:, [2, 3, 0]]))
    halves = np.insert(halves, 3, -1, axis=1)
    return points, np.concatenate((faces[~cut], halves))


def triangles(points, faces) -> tuple[np.ndarray, np.ndarray]:
    return points, np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]]))


def shuffled(points, faces) -> tuple[np.ndarray, np.ndarray]:
    order = np.random.default_rng(2).permutation(len(points))
    number = np.append(np.argsort(order), -1)
    faces = number[faces]
    return points[order], faces[np.random.default_rng(3).permutation(len(faces))]


MESHES = {
    "closed": closed(),
    "shuffled": shuffled(*closed()),
    "sheet": sheet(),
    "shuffled sheet": shuffled(*sheet()),
    "mixed": with_triangles(*sheet()),
    "shuffled mixed": shuffled(*with_triangles(*closed())),
    "triangles": triangles(*closed()),
    "shuffled triangles": shuffled(*triangles(*sheet())),
}


def check(one, other, at=slice(None)):
    for name, values in other.items():
        np.testing.assert_array_equal(np.asarray(values)[at], one[name][at], err_msg=name)


@pytest.mark.parametrize("number", [1, 2, 7])
@pytest.mark.parametrize("mesh", MESHES)
def test_parts_are_bitwise_one_mesh(mesh, number, tmp_path):
    points, faces = MESHES[mesh]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=number)
    assert number == 1 or parts.renumbered or not mesh.startswith("shuffled")
    whole = qc.QuadMesh(points, faces)
    for boundary in ("extrapolate", "nan"):
        for scheme in ("finite_volume", "liu"):
            one = qc.evaluate(whole, *WANTED, scheme=scheme, boundary=boundary)
            check(one, qc.evaluate(parts, *WANTED, scheme=scheme, boundary=boundary))
        for scheme in ("bilinear", "cotan-6"):  # sparse matrices sum their rows in any order
            one = qc.evaluate(whole, *WANTED, scheme=scheme, boundary=boundary)
            for name, values in qc.evaluate(parts, *WANTED, scheme=scheme, boundary=boundary).items():
                np.testing.assert_allclose(values, one[name], rtol=1e-11, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("mesh", ["closed", "shuffled", "sheet", "shuffled mixed"])
def test_fits_are_bitwise_one_mesh(mesh, tmp_path):
    points, faces = MESHES[mesh]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=5)
    for scheme in ("jet", "jet-2"):
        for boundary in ("extrapolate", "nan"):
            found = qc.curvatures(qc.QuadMesh(points, faces), scheme, boundary)
            one = {name: getattr(found, name) for name in ("k1", "k2", "direction1", "direction2", "normal")}
            one |= {"mean_curvature": found.mean, "gaussian_curvature": found.gaussian}
            one |= {name: getattr(found, name) for name in ("noise", "degree", "rings")}
            if scheme == "jet":
                one |= {name: stacked(getattr(found, name)) for name in ("standard_error", "interval")}
                one["feature"] = found.feature
            check(one, qc.evaluate(parts, *one, scheme=scheme, boundary=boundary))


@pytest.mark.parametrize("mesh", ["sheet", "shuffled mixed"])
def test_parts_of_one_vertex(mesh, tmp_path):
    points, faces = MESHES[mesh]
    whole = qc.evaluate(qc.QuadMesh(points, faces), *WANTED)
    check(whole, qc.evaluate(qc.FaceParts(points, faces, tmp_path, parts=len(points)), *WANTED))


def stacked(errors):
    return np.stack(errors, axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 16])
def test_large_parts_are_bitwise_one_mesh(number, tmp_path, monkeypatch):
    monkeypatch.setattr(part_files, "CHUNK", 1 << 16)
    grid = torus().sample((512, 300))[0]
    mesh = qc.QuadMesh(noisy(grid.points.reshape(-1, 3), 1e-3), grid.to_mesh().faces[:-7000])
    points, faces = shuffled(mesh.points, mesh.faces)
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=number)
    check(qc.evaluate(qc.QuadMesh(points, faces), *WANTED), qc.evaluate(parts, *WANTED))


def test_results_go_into_files(tmp_path):
    points, faces = MESHES["shuffled"]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=4)
    out = np.lib.format.open_memmap(tmp_path / "H.npy", "w+", np.float64, (len(points),))
    found = qc.evaluate(parts, scheme="liu", out={"mean_curvature": out})
    assert found["mean_curvature"] is out
    out.flush()
    np.testing.assert_array_equal(
        np.load(tmp_path / "H.npy"),
        qc.evaluate(qc.QuadMesh(points, faces), *found, scheme="liu")["mean_curvature"],
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("mesh", ["closed", "shuffled"])
def test_files_are_read_where_they_are(mesh, dtype, tmp_path):
    h5py = pytest.importorskip("h5py")
    points, faces = MESHES[mesh]
    points = points.astype(dtype)
    expected = qc.evaluate(qc.QuadMesh(points, faces), *WANTED)
    np.save(tmp_path / "x.npy", points)
    np.save(tmp_path / "f.npy", faces.astype(np.int64))
    mapped = np.load(tmp_path / "x.npy", mmap_mode="r"), np.load(tmp_path / "f.npy", mmap_mode="r")
    parts = qc.FaceParts(*mapped, tmp_path / "a", parts=3)
    assert (tmp_path / "a" / "points.npy").exists() == parts.renumbered
    check(expected, qc.evaluate(parts, *WANTED))
    with h5py.File(tmp_path / "m.h5", "w") as file:
        file["Points"], file["Faces"] = points, faces
        parts = qc.FaceParts(file["Points"], file["Faces"], tmp_path / "b", parts=3)
    check(expected, qc.evaluate(parts, *WANTED))
    # A part of a mapped array is not what the file holds.
    cut = qc.FaceParts(mapped[0][: -0 or None][::1], mapped[1], tmp_path / "c", parts=3)
    check(expected, qc.evaluate(cut, *WANTED))


@pytest.mark.parametrize("mesh", ["closed", "shuffled mixed", "triangles"])
def test_from_vtkhdf_to_vtkhdf(mesh, tmp_path):
    """Values go into the file that VTK has written, where VTK finds them."""
    h5py = pytest.importorskip("h5py")
    pytest.importorskip("vtk")
    points, faces = MESHES[mesh]
    whole = qc.QuadMesh(points, faces)
    qc.write(tmp_path / "m.vtkhdf", whole)
    expected = qc.evaluate(whole, "mean_curvature", "vertex_normals")
    with h5py.File(tmp_path / "m.vtkhdf", "r+") as file:
        found = qc.io.vtkhdf.VtkHdf(file)
        assert repr(found) == f"VtkHdf({len(points)} points, {len(faces)} faces)"
        parts = qc.FaceParts(found.points, found.faces, tmp_path / "parts", parts=4)
        out = {"mean_curvature": found.values("H"), "vertex_normals": found.values("n", 3)}
        check(expected, qc.evaluate(parts, out=out))
    read = qc.read_values(tmp_path / "m.vtkhdf")
    np.testing.assert_array_equal(read["H"], expected["mean_curvature"])
    np.testing.assert_array_equal(read["n"], expected["vertex_normals"])


def test_other_vtkhdf_files(tmp_path):
    h5py = pytest.importorskip("h5py")
    points, faces = MESHES["closed"]
    with h5py.File(tmp_path / "m.vtkhdf", "w") as file:
        with pytest.raises(qc.MeshError, match="no VTKHDF file"):
            qc.io.vtkhdf.VtkHdf(file)
        group = file.create_group("VTKHDF")
        group.attrs["Type"] = np.bytes_(b"ImageData")
        with pytest.raises(qc.MeshError, match="no VTKHDF file of PolyData"):
            qc.io.vtkhdf.VtkHdf(file)
        group.attrs["Type"] = np.bytes_(b"UnstructuredGrid")
        group["Points"], group["NumberOfPoints"] = points, [len(points)]
        group["Connectivity"], group["Offsets"] = faces.ravel(), 4 * np.arange(len(faces) + 1)
        group["Types"] = np.full(len(faces), 9, np.uint8)
        found = qc.io.vtkhdf.VtkHdf(file)
        np.testing.assert_array_equal(found.faces[5:17], faces[5:17])
        assert found.faces[5:5].shape == (0, 4)
        parts = qc.FaceParts(found.points, found.faces, tmp_path / "parts", parts=3)
        check(qc.evaluate(qc.QuadMesh(points, faces), *WANTED), qc.evaluate(parts, *WANTED))
        group["Types"][71] = 10  # a tetrahedron
        with pytest.raises(qc.MeshError, match="cell 71 is neither a triangle nor a quad"):
            qc.FaceParts(found.points, found.faces, tmp_path / "other", parts=3)
        del group["NumberOfPoints"]
        group["NumberOfPoints"] = [3, len(points) - 3]
        with pytest.raises(qc.MeshError, match="several pieces"):
            qc.io.vtkhdf.VtkHdf(file)


@pytest.mark.parametrize("mesh", ["closed", "shuffled"])
@pytest.mark.parametrize("kind", ["zarr", "h5py"])
def test_results_go_into_arrays_of_other_libraries(kind, mesh, tmp_path):
    library = pytest.importorskip(kind)
    points, faces = MESHES[mesh]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=4)
    expected = qc.evaluate(qc.QuadMesh(points, faces), "mean_curvature", "mean_curvature_normal")
    if kind == "zarr":
        group = library.open_group(tmp_path / "out.zarr", mode="w")
        make = group.create_array
    else:
        group = library.File(tmp_path / "out.h5", "w")
        make = group.create_dataset
    out = {
        "mean_curvature": make("H", shape=(len(points),), dtype="f4"),
        "mean_curvature_normal": make("Hn", shape=points.shape, dtype="f8"),
    }
    qc.evaluate(parts, out=out)
    np.testing.assert_array_equal(out["mean_curvature"][:], expected["mean_curvature"].astype(np.float32))
    np.testing.assert_array_equal(out["mean_curvature_normal"][:], expected["mean_curvature_normal"])


@pytest.mark.parametrize("order", [lambda *mesh: mesh, shuffled])
def test_rounding_is_told_of(order, tmp_path):
    mesh = qc.surfaces.cubed_sphere().sample((24, 24), "faces")[0]
    points, faces = order((mesh.points + 1000).astype(np.float32), mesh.faces)
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=3)
    for verb in (qc.mean_curvature, qc.mean_curvature_normal):
        with pytest.warns(qc.PrecisionWarning) as whole:
            verb(qc.QuadMesh(points, faces), "liu")
        with pytest.warns(qc.PrecisionWarning) as said:
            verb(parts, "liu")
        assert said[0].filename == __file__
        assert str(said[0].message) == str(whole[0].message)
    with pytest.warns(qc.PrecisionWarning):
        qc.principal_curvatures(parts, "jet-2")


def test_progress_is_shown(tmp_path, capsys):
    points, faces = MESHES["closed"]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=3)
    qc.evaluate(parts, "mean_curvature", progress=True)
    assert "parts" in capsys.readouterr().err


@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")
@pytest.mark.filterwarnings("ignore::quadcurv.PrecisionWarning")
def test_slivers_of_rounded_positions(tmp_path):
    """No area but for the rounding of its positions, however far those of other parts are."""
    points, faces = sheet(20, 12)
    points = points.astype(np.float32)
    points[36:48] = points[48:60] + np.float32([1e-4, 0, 0])
    points[-30:, 0] += 9000
    for name, moved, is_missing in (("near", 0, False), ("far", 900, True)):
        points[:-30, 0] += np.float32(moved)
        one = qc.evaluate(qc.QuadMesh(points, faces), *WANTED)
        assert np.isnan(one["mean_curvature"][40]) == is_missing
        parts = qc.FaceParts(points, faces, tmp_path / name, parts=5)
        check(one, qc.evaluate(parts, *WANTED))


def test_isolated_vertices_and_parts_without_faces(tmp_path):
    points, faces = MESHES["closed"]
    points = np.concatenate((points, np.full((200, 3), 9.0)))
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=6)
    expected = qc.evaluate(qc.QuadMesh(points, faces), *WANTED)
    check(expected, qc.evaluate(parts, *WANTED))
    assert np.isnan(expected["mean_curvature"][-200:]).all()


def test_what_is_mended_is_told_of(tmp_path):
    points, faces = MESHES["sheet"]
    faces = np.concatenate((faces, faces[3:4]))
    with pytest.warns(qc.MeshWarning, match="given twice"):
        expected = qc.evaluate(qc.QuadMesh(points, faces), *WANTED)
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=3)
    with pytest.warns(qc.MeshWarning, match=r"part\(s\) of the mesh have what is mended, .* given twice"):
        found = qc.evaluate(parts, *WANTED)
    check(expected, found)


def moebius(n=40, m=4) -> tuple[np.ndarray, np.ndarray]:
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.linspace(-0.4, 0.4, m), indexing="ij")
    x = np.stack(
        [(2 + v * np.cos(u / 2)) * np.cos(u), (2 + v * np.cos(u / 2)) * np.sin(u), v * np.sin(u / 2)]
    )
    index = np.arange(n * m).reshape(n, m)
    index = np.concatenate((index, index[:1, ::-1]))
    faces = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return x.reshape(3, -1).T.copy(), faces.reshape(-1, 4)


def together(*meshes) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one that does not hang together."""
    points, faces, n = [], [], 0
    for k, (x, f) in enumerate(meshes):
        points.append(x + np.array([0, 0, 7.0 * k]))
        faces.append(np.where(np.pad(f, ((0, 0), (0, 4 - f.shape[1])), constant_values=-1) < 0, -1, 0))
        faces[-1][:, : f.shape[1]] = np.where(f < 0, -1, f + n)
        n += len(x)
    return np.concatenate(points), np.concatenate(faces)


def some_turned(faces, share, seed) -> np.ndarray:
    """Some faces the other way round, beginning anywhere."""
    turn = np.random.default_rng(seed).random(len(faces)) < share
    faces, quad = faces.copy(), faces[:, 3] >= 0
    faces[turn & quad] = np.roll(faces[turn & quad][:, ::-1], seed % 4, axis=1)
    faces[turn & ~quad, :3] = np.roll(faces[turn & ~quad, :3][:, ::-1], seed % 3, axis=1)
    return faces


SIDED = {
    "closed": MESHES["closed"],
    "shuffled mixed": MESHES["shuffled mixed"],
    "several": together(sheet(), closed(), with_triangles(*sheet(9, 11))),
    "shuffled several": shuffled(*together(sheet(9, 6), triangles(*closed()), sheet(8, 8))),
    "moebius and a ball": together(moebius(), closed()),
    "shuffled moebius": shuffled(*together(moebius(), sheet())),
}


def both_ways(points, faces, folder, parts):
    """One mesh, parts, and what is said of either."""
    with warnings.catch_warnings(record=True) as whole:
        warnings.simplefilter("always")
        one = qc.QuadMesh(points, faces)
    parts = qc.FaceParts(points, faces, folder, parts=parts)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = qc.evaluate(parts, *WANTED)
    assert all(w.category is qc.MeshWarning and w.filename == __file__ for w in said)
    return one, parts, found, [str(w.message) for w in whole], [str(w.message) for w in said]


@pytest.mark.parametrize("share", [0.02, 0.5, 0.9])
@pytest.mark.parametrize("mesh", SIDED)
def test_faces_are_turned_as_those_of_one_mesh(mesh, share, tmp_path):
    points, faces = SIDED[mesh]
    for number in (1, 2, 7):
        turned = some_turned(faces, share, number)
        one, parts, found, whole, said = both_ways(points, turned, tmp_path / str(number), number)
        assert said == whole
        check(qc.evaluate(one, *WANTED), found)
        assert (parts.sides.orientable, parts.sides.turned) == (one.orientable, one.report["turned"])
    check(qc.evaluate(one, *WANTED, scheme="liu"), with_warnings(qc.evaluate, parts, *WANTED, scheme="liu"))
    H = qc.curvatures(one, "jet-2").mean
    check({"mean_curvature": H}, with_warnings(qc.evaluate, parts, "mean_curvature", scheme="jet-2"))


def with_warnings(call, *given, **options):
    with pytest.warns(qc.MeshWarning, match="turned to agree|non-orientable"):
        return call(*given, **options)


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 9), st.booleans())
@example(1527, 5, False)
def test_damaged_faces_are_mended_and_turned_as_those_of_one_mesh(seed, number, scattered):
    """Faces turned, given twice, with a repeated vertex, missing; edges of three faces."""
    random = np.random.default_rng(seed)
    points, faces = with_triangles(*together(sheet(7, 8), moebius(9, 3), sheet(5, 5)))
    faces = faces[random.random(len(faces)) > 0.1]
    twice, thrice = (
        faces[random.integers(len(faces), size=3)],
        faces[random.integers(len(faces), size=2)].copy(),
    )
    thrice[:, 2] = random.integers(len(points), size=2)
    thrice[:, 3] = -1
    repeated = random.integers(len(faces), size=2)
    faces[repeated, 1] = faces[repeated, 0]
    faces = some_turned(np.concatenate((faces, twice, thrice)), random.random() ** 3, seed)
    if scattered:
        points, faces = shuffled(points, faces)
    with tempfile.TemporaryDirectory() as folder:
        one, parts, found, _, _ = both_ways(points, faces, folder, number)
        # Rings beside poles are read off fitted surfaces, whose sums parts may take in another order.
        few_digits = 0.0 if poles_of_faces(one.stencils()) is None else 1e-13
        for name, values in with_any_warnings(qc.evaluate, one, *WANTED).items():
            np.testing.assert_allclose(found[name], values, few_digits, few_digits, err_msg=name)
        if parts.sides is not None:
            assert (parts.sides.orientable, parts.sides.turned) == (one.orientable, one.report["turned"])


def with_any_warnings(call, *given):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return call(*given)


def test_what_is_refused(tmp_path):
    points, faces = MESHES["closed"]

    def made(points=points, faces=faces, folder="x", **options):
        return qc.FaceParts(points, faces, tmp_path / folder, **options)

    with pytest.raises(qc.MeshError, match=r"points: shape \(4,\)"):
        made(points=np.zeros(4))
    with pytest.raises(qc.MeshError, match="points: expected an array with slices, got list"):
        made(points=points.tolist())
    with pytest.raises(qc.MeshError, match="faces: expected numbers of kind 'iu', got dtype float64"):
        made(faces=faces.astype(float))
    with pytest.raises(qc.MeshError, match="parts: expected a whole number from 1 to"):
        made(parts=0)
    wrong = faces.copy()
    wrong[71, 2] = len(points)
    with pytest.raises(qc.MeshError, match=r"1 face\(s\) with an index outside .* first face 71"):
        made(faces=wrong, folder="a", parts=2)
    lost = points.copy()
    lost[60, 1] = np.inf
    with pytest.raises(qc.MeshError, match=r"1 point.* not finite, or beyond 1e\+70, first vertex 60"):
        made(points=lost, folder="b", parts=2)
    (tmp_path / "c").mkdir()
    (tmp_path / "c" / "file").touch()
    with pytest.raises(qc.MeshError, match="is not empty"):
        made(folder="c")
    parts = made(folder="e", parts=4)
    with pytest.raises(ValueError, match="wanted: expected some of"):
        qc.evaluate(parts, "k1", scheme="liu")
    with pytest.raises(ValueError, match="out: mean_curvature wants an array of floats of shape"):
        qc.evaluate(parts, out={"mean_curvature": np.zeros(3)})
    np.save(tmp_path / "x.npy", points)
    mapped = made(np.load(tmp_path / "x.npy", mmap_mode="r"), folder="f", parts=2)
    with pytest.raises(ValueError, match="out: mean_curvature_normal overlaps the memory"):
        qc.evaluate(mapped, out={"mean_curvature_normal": np.load(tmp_path / "x.npy", mmap_mode="r+")})
    with pytest.raises(qc.MeshError, match=r"client: expected a distributed\.Client, got str"):
        made(folder="g", client="local")
    for verb in (qc.stiffness_matrix, qc.as_mesh, lambda mesh: qc.laplace_beltrami(mesh, points)):
        with pytest.raises(TypeError, match=r"is computed part by part, which qc\.evaluate does"):
            verb(parts)
    with pytest.raises(ValueError, match="out: expected a mapping"):
        qc.evaluate(parts, out=[1])
    with pytest.raises(ValueError, match="boundary: expected one of"):
        qc.evaluate(parts, "mean_curvature", boundary="none")
    assert repr(parts) == f"FaceParts({len(points)} points in 4 parts)"


def test_faces_go_to_the_parts_that_own_their_vertices():
    faces = np.array([[0, 1, 2, 3], [3, 2, 4, -1], [4, 5, 6, 7]], np.int32)
    out, begin = kernels.by_part(faces, 10, np.array([0, 3, 5, 8]), np.empty(0, np.int32))
    assert begin.tolist() == [0, 2, 5, 6]
    assert out[:, 0].tolist() == [10, 11, 10, 11, 12, 12]
    assert out[1, 1:].tolist() == [3, 2, 4, -1]
    reverse = np.arange(8, dtype=np.int32)[::-1].copy()
    out, begin = kernels.by_part(faces, 0, np.array([0, 4, 8]), reverse)
    assert out[: begin[1], 0].tolist() == [1, 2]
    assert out[0, 1:].tolist() == [4, 5, 3, -1]


def test_the_curve_keeps_neighbours_together():
    n = 16
    x = np.stack(np.meshgrid(*[np.arange(n) / (n - 1)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    key = kernels.curve(x, np.zeros(3), 1.0)
    assert np.unique(key).size == n**3
    order = np.argsort(key)
    # Each eighth is one octant.
    for octant in np.split(x[order], 8):
        assert np.ptp(octant, axis=0).max() < 0.5


# dask


@pytest.fixture
def client():
    distributed = pytest.importorskip("distributed")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with (
            distributed.LocalCluster(
                n_workers=2, threads_per_worker=1, dashboard_address=None, processes=True
            ) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield client


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_workers_compute_the_same(client, tmp_path):
    for mesh in ("shuffled", "sheet"):
        points, faces = MESHES[mesh]
        parts = qc.FaceParts(points, faces, tmp_path / mesh, parts=6, client=client)
        check(qc.evaluate(qc.QuadMesh(points, faces), *WANTED), qc.evaluate(parts, *WANTED))
    found = qc.curvatures(qc.QuadMesh(points, faces))
    np.testing.assert_array_equal(qc.evaluate(parts, "k1", scheme="jet")["k1"], found.k1)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_worker_killed_in_the_middle_changes_nothing(client, tmp_path):
    import os
    import signal
    import threading

    points, faces = MESHES["shuffled"]
    parts = qc.FaceParts(points, faces, tmp_path / "parts", parts=150, client=client)
    first = next(iter(client.run(os.getpid).values()))
    done = []

    def kill():
        os.kill(first, signal.SIGKILL)
        done.append(first)

    timer = threading.Timer(1.0, kill)
    timer.start()
    for _ in range(20):
        found = qc.evaluate(parts, *WANTED)
        if done:
            break
    timer.join()
    assert done
    check(qc.evaluate(qc.QuadMesh(points, faces), *WANTED), found)


@pytest.mark.slow
def test_the_comparison_measures_every_way(tmp_path):
    """Each way is bitwise one mesh, with a worker killed too, or the comparison ends with an error."""
    from comparisons.scale import Setting
    from comparisons.scale_faces import section

    lines = section(Setting(tmp_path, True))
    assert sum(line.startswith("| 0.0164M, natural") for line in lines) == 5
    assert any("worker" in line and "killed" in line for line in lines)
