"""Passes on a device: compiled for it, run on a processor in its place, bitwise what the processor has."""

from __future__ import annotations

import importlib.util
import shutil
import sys

import numpy as np
import pytest
import standin_cupy

import quadcurv as qc
from quadcurv.drivers import device
from quadcurv.kernels import cuda
from quadcurv.surfaces import cubed_sphere, sphere, torus

WANTED = ["mean_curvature", "mean_curvature_normal", "vertex_normals", "dual_areas"]
SCHEMES = ["finite_volume", "liu"]


def no_device() -> str | None:
    if importlib.util.find_spec("cupy") is None:
        return "cupy is not installed"
    import cupy

    return None if cupy.cuda.is_available() else "there is no device"


@pytest.fixture(params=["stand-in", "cupy"])
def cupy(request, monkeypatch, tmp_path_factory):
    """The library, or what stands in for it."""
    if request.param == "cupy":
        if no_device():
            pytest.skip(no_device())
        return pytest.importorskip("cupy")
    if shutil.which("g++") is None:
        pytest.skip("there is no g++ to run the passes without a device")
    for name, module in standin_cupy.modules(tmp_path_factory.getbasetemp()).items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr("quadcurv.device_arrays.need", lambda *libraries: None)
    return standin_cupy


def noisy(points, size=0.01):
    return points + np.random.default_rng(3).normal(0, size, points.shape)


def bumpy(r, c) -> np.ndarray:
    """A torus with bumps, noise and a quad without area."""
    u, v = np.meshgrid(2 * np.pi * np.arange(r) / r, 2 * np.pi * np.arange(c) / c, indexing="ij")
    a = 1 + 0.1 * np.cos(3 * u) * np.cos(2 * v)
    x = np.stack([(3 + a * np.cos(v)) * np.cos(u), (3 + a * np.cos(v)) * np.sin(u), a * np.sin(v)], axis=-1)
    return noisy(x)


def check(cupy, mesh, on_device, scheme, boundary="extrapolate"):
    """Every result, alone and with the others."""
    expected = qc.evaluate(mesh, *WANTED, scheme=scheme, boundary=boundary)
    found = qc.evaluate(on_device, *WANTED, scheme=scheme, boundary=boundary)
    for name in WANTED:
        assert isinstance(found[name], cupy.ndarray)
        np.testing.assert_array_equal(found[name].get(), expected[name], err_msg=name)
        alone = qc.evaluate(on_device, name, scheme=scheme, boundary=boundary)[name]
        np.testing.assert_array_equal(alone.get(), expected[name], err_msg=name)


@pytest.mark.parametrize("architecture", ["sm_80", "sm_90"])
def test_the_source_compiles_for_devices(architecture):
    nvrtc = pytest.importorskip(
        "cupy_backends.cuda.libs.nvrtc", reason="cupy, or CUDA's compiler, is not here"
    )
    try:
        nvrtc.getVersion()
    except Exception as error:
        pytest.skip(f"CUDA's compiler cannot be had: {error}")
    program = nvrtc.createProgram(cuda.source(), "diamond.cu", (), ())
    try:
        nvrtc.compileProgram(program, (*cuda.OPTIONS, f"--gpu-architecture={architecture}"))
    except nvrtc.NVRTCError:
        pytest.fail(nvrtc.getProgramLog(program))
    assert len(nvrtc.getCUBIN(program)) > 10_000


def test_formulas_are_those_of_the_processor():
    """Every fused operation is written as such, everything else is a statement of its own."""
    source = cuda.source()
    assert "DEVICE triple fused_cross(triple a, triple b) {" in source
    assert "fma(a.y, b.z, " in source
    body = source[source.index("DEVICE triple less") : source.index("DEVICE triple load")]
    for line in body.splitlines():
        if "=" in line and "r0" not in line and "r1" not in line:
            assert sum(line.count(sign) for sign in (" + ", " - ", " * ", " / ")) <= 1, line


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (False, True), (True, True)])
@pytest.mark.parametrize("shape", [(45, 70), (33, 131), (64, 20)])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_grids_are_bitwise_those_of_the_processor(cupy, scheme, shape, wrap):
    x = bumpy(*shape)
    x[7, 11] = x[7, 12] = x[8, 12] = x[8, 11]  # a quad without area
    check(cupy, qc.QuadGrid(x, wrap), qc.QuadGrid(cupy.asarray(x), wrap), scheme)


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", ["smooth", "uneven", "small", "pole", "corner poles", "far"])
@pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")  # which devices do not tell
def test_borders_are_those_of_the_processor(cupy, kind, scheme, boundary):
    t = np.linspace(0, 1, 41)
    u, v = np.meshgrid(t, t[:33], indexing="ij")
    if kind == "uneven":
        u, v = u**2, v**3
    x = np.stack([u, v, np.sin(3 * u) * np.cos(2 * v)], axis=-1)
    wrap = (False, False)
    if kind == "small":
        x = x[:12, :15]
    if kind == "far":
        x = x + 1e6
    if kind == "pole":
        phi, theta = np.meshgrid(2 * np.pi * np.arange(36) / 36, np.linspace(0, np.pi, 31), indexing="ij")
        x = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
        wrap = (True, False)
    if kind == "corner poles":
        x[:, 0] = x[0, 0]
        x[..., 2] += 1
    mesh, there = qc.QuadGrid(x, wrap), qc.QuadGrid(cupy.asarray(x), wrap)
    check(cupy, mesh, there, scheme, boundary)


@pytest.mark.parametrize("boundary", ["extrapolate", "nan"])
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize("kind", ["ball", "mixed", "open", "moebius"])
def test_face_lists_are_bitwise_those_of_the_processor(cupy, mixed, kind, scheme, boundary):
    ball = cubed_sphere().sample((9, 9), "faces")[0]
    mesh = qc.QuadMesh(noisy(ball.points), ball.faces) if kind != "mixed" else mixed
    if kind == "open":
        mesh = qc.QuadMesh(ball.points, ball.faces[:-70])
    if kind == "moebius":
        u, v = np.meshgrid(2 * np.pi * np.arange(40) / 40, np.linspace(-0.4, 0.4, 7), indexing="ij")
        x = (1 + v * np.cos(u / 2)) * np.array([np.cos(u), np.sin(u)])
        points = np.stack([*x, v * np.sin(u / 2)], axis=-1).reshape(-1, 3)
        index = np.arange(280).reshape(40, 7)
        index = np.concatenate((index, index[:1, ::-1]))
        quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
        with pytest.warns(qc.MeshWarning, match="non-orientable"):
            mesh = qc.QuadMesh(points, quads.reshape(-1, 4))
    check(cupy, mesh, mesh.with_points(cupy.asarray(mesh.points)), scheme, boundary)


def test_verbs_take_and_give_arrays_of_the_device(cupy):
    grid = torus().sample((24, 20))[0]
    there = qc.QuadGrid(cupy.asarray(grid.points), grid.wrap)
    for verb in (qc.mean_curvature, qc.mean_curvature_normal, qc.dual_areas):
        found = verb(there, "liu")
        assert isinstance(found, cupy.ndarray)
        np.testing.assert_array_equal(found.get(), verb(grid, "liu"))
    assert isinstance(qc.vertex_normals(there), cupy.ndarray)
    mesh = cubed_sphere().sample((6, 6), "faces")[0]
    made = qc.QuadMesh(cupy.asarray(mesh.points), mesh.faces)
    np.testing.assert_array_equal(qc.mean_curvature(made, "liu").get(), qc.mean_curvature(mesh, "liu"))
    out = {"mean_curvature": cupy.empty((24, 20))}
    assert qc.evaluate(there, out=out)["mean_curvature"] is out["mean_curvature"]
    assert repr(there) == repr(grid)
    assert there._repr_html_() == grid._repr_html_()


def test_rounding_is_warned_of(cupy):
    far = (sphere().sample((300, 300))[0].points + 100).astype(np.float32)
    with pytest.warns(qc.PrecisionWarning):
        qc.mean_curvature(qc.QuadGrid(cupy.asarray(far), (True, False)), "liu")


@pytest.mark.parametrize("kind", ["grid", "faces"])
@pytest.mark.parametrize("scheme", SCHEMES)
def test_matrices_are_those_of_the_processor(cupy, mixed, kind, scheme):
    if kind == "grid":
        x = bumpy(21, 23)
        mesh, there = qc.QuadGrid(x, (True, False)), qc.QuadGrid(cupy.asarray(x), (True, False))
    else:
        mesh, there = mixed, mixed.with_points(cupy.asarray(mixed.points))
    S, expected = qc.stiffness_matrix(there, scheme).get(), qc.stiffness_matrix(mesh, scheme)
    for name in ("data", "indices", "indptr"):
        np.testing.assert_array_equal(getattr(S, name), getattr(expected, name), err_msg=name)
    M = qc.mass_matrix(there, scheme).get()
    np.testing.assert_array_equal(M.diagonal(), qc.mass_matrix(mesh, scheme).diagonal())
    for f in (mesh.points, mesh.points[..., 0]):
        found = qc.laplace_beltrami(there, cupy.asarray(f), scheme).get()
        np.testing.assert_allclose(found, qc.laplace_beltrami(mesh, f, scheme), rtol=1e-12, atol=1e-10)
    with pytest.raises(ValueError, match="f: shape"):
        qc.laplace_beltrami(there, cupy.asarray(np.zeros(5)), scheme)


def test_what_is_refused(cupy):
    x = bumpy(24, 24)
    there = qc.QuadGrid(cupy.asarray(x), (True, True))
    for verb in (qc.mean_curvature, qc.curvatures, qc.dual_areas, qc.gaussian_curvature):
        with pytest.raises(ValueError, match="does not run on a device"):
            verb(there)
    with pytest.raises(ValueError, match="angle_defect does not run on a device"):
        qc.gaussian_curvature(there, "angle_defect")
    with pytest.raises(ValueError, match="expected some of"):
        qc.evaluate(there, "area")
    with pytest.raises(ValueError, match=r"out: mean_curvature wants a C-contiguous float64 array of shape"):
        qc.evaluate(there, out={"mean_curvature": np.empty((24, 24))})
    with pytest.raises(ValueError, match="overlaps the memory of points"):
        qc.evaluate(there, out={"mean_curvature_normal": there.points})
    with pytest.raises(qc.MeshError, match="mask: grids on a device have no holes"):
        qc.QuadGrid(cupy.asarray(x), mask=np.zeros((24, 24), bool))
    cells, there_too = qc.surfaces.sphere().sample((8, 6), "staggered")[0], cupy.asarray(x)
    for make, name in (
        (lambda: qc.StaggeredGrid(cupy.asarray(cells.primal), cells.dual), "primal"),
        (lambda: qc.StaggeredGrid(cells.primal, cupy.asarray(cells.dual)), "dual"),
        (lambda: qc.ChunkedGrid(there_too), "points"),
        (lambda: qc.GridBlocks([there_too]), r"blocks\[0\]: points"),
        (lambda: qc.GridBlocks([there]), r"blocks\[0\]: points"),
        (lambda: qc.FaceParts(there_too.reshape(-1, 3), np.zeros((1, 3), int), "nowhere"), "points"),
    ):
        with pytest.raises(qc.MeshError, match=f"{name}: on a device, where QuadGrid and QuadMesh alone"):
            make()
    with pytest.raises(qc.MeshError, match=r"shape \(24, 24\), expected \(r, c, 3\)"):
        qc.QuadGrid(cupy.asarray(x[..., 0]))
    with pytest.raises(qc.MeshError, match="complex"):
        qc.QuadGrid(cupy.asarray(x + 0j))
    x[3, 4, 1] = np.nan
    with pytest.raises(qc.MeshError, match=r"1 point.* not finite .* first vertex 76"):
        qc.QuadGrid(cupy.asarray(x))
    with pytest.raises(qc.MeshError, match="wrap: the last of the rows repeats"):
        qc.QuadGrid(cupy.asarray(np.concatenate((bumpy(24, 24), bumpy(24, 24)[:1]))), (True, True))


def test_other_libraries_are_known_by_what_they_offer():
    class Cuda:
        __cuda_array_interface__ = None

    class Dlpack:
        def __init__(self, kind):
            self._kind = kind

        def __dlpack_device__(self):
            return self._kind, 0

    from quadcurv.device_arrays import is_on_device

    assert is_on_device(Cuda())
    assert is_on_device(Dlpack(2))
    assert not is_on_device(Dlpack(1))
    assert not is_on_device(np.zeros(3))
    assert not is_on_device([1, 2])
    assert not device.holds(qc.QuadGrid(bumpy(4, 4), (True, True)))


def test_the_comparison_says_what_it_has_not_measured(monkeypatch):
    from comparisons import gpu

    monkeypatch.setattr(gpu, "no_device", lambda: "there was no device")
    assert gpu.lines() == [
        "Not measured: there was no device. `python -m comparisons.gpu` measures where there is one."
    ]


def test_the_comparison_measures_on_a_device():
    from comparisons import gpu

    if gpu.no_device():
        pytest.skip(gpu.no_device())
    assert len(gpu.lines(quick=True)) == 8
