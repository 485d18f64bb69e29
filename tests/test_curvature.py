"""The verbs as a user meets them: defaults, shapes, holes, functions on a surface, what rounding costs."""

from __future__ import annotations

import doctest
import warnings

import numpy as np
import pytest

import quadcurv as qc
from quadcurv import (
    MeshError,
    MeshWarning,
    PrecisionWarning,
    QuadGrid,
    QuadMesh,
    StaggeredGrid,
    curvature,
    operators,
    surfaces,
)
from quadcurv.precision import rounding_error
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import SCHEMES, Fit, SchemeName


def test_one_default_scheme_for_all_curvatures():
    grid = surfaces.torus().sample((24, 20))[0]
    H, K = qc.mean_curvature(grid), qc.gaussian_curvature(grid)
    k1, k2, along1, along2 = qc.principal_curvatures(grid)
    found = qc.curvatures(grid)
    np.testing.assert_allclose((k1 + k2) / 2, H, rtol=0, atol=1e-13)
    np.testing.assert_allclose(k1 * k2, K, rtol=0, atol=1e-13)
    for one, other in ((H, found.mean), (K, found.gaussian), (k1, found.k1), (along2, found.direction2)):
        np.testing.assert_array_equal(one, other)
    np.testing.assert_array_equal(qc.mean_curvature_normal(grid), -H[..., None] * found.normal)
    assert along1.shape == (24, 20, 3)


def test_matrices_have_one_default_scheme_too():
    mesh = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    default = operators.DEFAULT_MATRIX
    assert abs(qc.stiffness_matrix(mesh) - qc.stiffness_matrix(mesh, default)).max() == 0
    np.testing.assert_array_equal(qc.mass_matrix(mesh).diagonal(), qc.dual_areas(mesh, default))


def test_names_for_completion_are_those_of_the_registry():
    assert set(SchemeName.__args__) == {*SCHEMES, "angle_defect"}


def test_docstrings_are_true():
    for name in qc.__all__:
        thing = getattr(qc, name)
        if getattr(thing, "__module__", "").startswith("quadcurv."):
            found = doctest.DocTestFinder().find(thing, name, globs={})
            runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
            for test in found:
                assert runner.run(test).failed == 0, test.name


# ---- functions on a surface -----------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["liu", "finite_volume", "cotan-6", "bunge"])
def test_laplace_beltrami_of_spherical_harmonics(scheme):
    """x is an eigenfunction with eigenvalue -2, x y one with -6."""
    sizes, errors = (24, 48, 96), []
    for n in sizes:
        grid = surfaces.sphere().sample((2 * n, n))[0]
        x, y, _ = np.moveaxis(grid.points, -1, 0)
        found = qc.laplace_beltrami(grid, np.stack((x, x * y), axis=-1), scheme)
        assert found.shape == (2 * n, n + 1, 2)
        assert np.isnan(found[:, [0, -1]]).all()  # what x is beyond the border nobody knows
        error = np.abs(found - np.stack((-2 * x, -6 * x * y), axis=-1))[:, 1:-1]
        errors.append(error.mean())
    assert fitted_rate(sizes, errors) > 1.9
    assert errors[-1] < 2e-3


def test_laplace_beltrami_shapes_and_rejections():
    mesh = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    n = len(mesh.points)
    f = mesh.points[:, 0]
    one = qc.laplace_beltrami(mesh, f)
    assert one.shape == (n,)
    np.testing.assert_allclose(qc.laplace_beltrami(mesh, np.stack((f, 2 * f), axis=1))[:, 1], 2 * one)
    assert np.abs(qc.laplace_beltrami(mesh, np.full(n, 3.0))).max() == 0
    Hn = qc.mean_curvature_normal(mesh, "liu")
    np.testing.assert_allclose(qc.laplace_beltrami(mesh, mesh.points, "liu"), 2 * Hn, rtol=0, atol=1e-12)
    with pytest.raises(ValueError, match=rf"f: shape \(5,\), expected \({n},\) or \({n}, 'k'\)"):
        qc.laplace_beltrami(mesh, np.zeros(5))
    with pytest.raises(ValueError, match="f: expected real numbers"):
        qc.laplace_beltrami(mesh, np.zeros(n, complex))
    with pytest.raises(ValueError, match="jet is a fit"):
        qc.laplace_beltrami(mesh, f, "jet")


def test_the_dual_area_of_a_cell_is_its_area():
    cells = surfaces.torus().sample((32, 24), "staggered")[0]
    areas = qc.dual_areas(cells, "liu")
    assert areas.sum() == pytest.approx(4 * np.pi**2 * 2, rel=0.02)
    flat = surfaces.plane().sample((4, 5), "staggered")[0]
    np.testing.assert_allclose(qc.dual_areas(flat, "finite_volume"), 4 / 20, rtol=1e-13)
    Hn = qc.mean_curvature_normal(cells, "liu").reshape(-1, 3)
    S = qc.stiffness_matrix(cells, "liu")
    again = -(S @ cells.stencils().points) / (2 * areas.reshape(-1, 1))
    np.testing.assert_allclose(again, Hn, rtol=0, atol=1e-12)


# ---- holes ----------------------------------------------------------------------------------------------


def with_hole(surface, shape, rows, columns):
    grid, xi, eta = surface.sample(shape)
    mask = np.zeros(grid.shape, bool)
    mask[rows, columns] = True
    return grid, mask, surface.mean_curvature(xi, eta)


@pytest.mark.parametrize("scheme", ["finite_volume", "liu", "cotan-6", "bunge", "jet"])
@pytest.mark.parametrize("given", ["mask", "masked array", "NaN"])
def test_holes_are_open_sides(scheme, given):
    grid, mask, H = with_hole(surfaces.torus(), (30, 26), slice(8, 13), slice(20, 24))
    points = grid.points.copy()
    match given:
        case "mask":
            points[mask] = 1e9  # nobody looks there
            holed = QuadGrid(points, grid.wrap, mask=mask)
        case "masked array":
            holed = QuadGrid(np.ma.array(points, mask=np.repeat(mask[..., None], 3, axis=2)), grid.wrap)
        case "NaN":
            points[mask, 1] = np.nan
            with pytest.warns(
                MeshWarning, match=r"20 point\(s\) without a position.* first vertex \(8, 20\)"
            ):
                holed = QuadGrid(points, grid.wrap)
            assert holed.report["masked"] == 20
    found = qc.mean_curvature(holed, scheme)
    whole = qc.mean_curvature(grid, scheme)
    assert np.isnan(found[mask]).all()
    rim = np.zeros_like(mask)
    rim[5:16, 17:] = rim[5:16, 0] = True
    error = np.abs(found - H)
    if scheme == "jet":  # which looks along lines that end at the hole
        assert np.nanmax(error) < 0.05
        rim[:] = False
        rim[2:19, 14:] = rim[2:19, :3] = True
    else:
        assert np.nanmax(error[rim]) < 30 * np.abs(whole - H).max()
    np.testing.assert_allclose(found[~rim], whole[~rim], rtol=0, atol=1e-12)
    assert np.isfinite(found[7, 22])  # beside the hole, by ghosts


def test_holes_in_every_verb():
    grid, mask, _ = with_hole(surfaces.catenoid(), (20, 16), slice(5, 8), slice(3, 5))
    holed = QuadGrid(grid.points, grid.wrap, mask=mask)
    n = np.count_nonzero(~mask)
    S, M = qc.stiffness_matrix(holed, "liu"), qc.mass_matrix(holed, "liu")
    assert S.shape == M.shape == (n, n)
    f = np.where(mask, np.nan, grid.points[..., 2])
    found = qc.laplace_beltrami(holed, f, "liu")
    assert found.shape == mask.shape
    assert np.isnan(found[mask]).all()
    for values in (
        qc.gaussian_curvature(holed),
        qc.gaussian_curvature(holed, "angle_defect"),
        qc.vertex_normals(holed)[..., 0],
        qc.dual_areas(holed, "liu"),
        qc.quality(holed)["skew"],
    ):
        assert values.shape == mask.shape
        assert np.isnan(values[mask]).all()
        assert np.isfinite(values[15, 8])
    assert (qc.boundary_treatment(holed)[mask] == 0).all()
    assert qc.compare(holed, ["liu", "jet"]).valence.shape == mask.shape
    assert repr(holed) == "QuadGrid(21 x 16 points, wrap=(False, True), 6 masked)"


def test_masks_rejected():
    points = surfaces.torus().sample((8, 8))[0].points
    with pytest.raises(MeshError, match=r"mask: expected booleans of shape \(8, 8\), got bool of \(3,\)"):
        QuadGrid(points, mask=np.zeros(3, bool))
    with pytest.raises(MeshError, match="mask: expected booleans"):
        QuadGrid(points, mask=np.zeros((8, 8)))
    with pytest.raises(MeshError, match="mask: all 64 points are masked"):
        QuadGrid(points, mask=np.ones((8, 8), bool))
    with pytest.raises(MeshError, match="faces: none"):
        qc.mean_curvature(QuadGrid(points, mask=(np.indices((8, 8)).sum(axis=0) % 2).astype(bool)))
    infinite = points.copy()
    infinite[2, 3, 0] = np.inf
    with pytest.raises(MeshError, match=r"1 non-finite point\(s\), first vertex \(2, 3\)"):
        QuadGrid(infinite)


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("offset", [0, 1e6])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_a_wrap_whose_first_row_is_repeated_is_refused(axis, offset, dtype):
    grid = surfaces.torus().sample((24, 30))[0]
    repeated = np.concatenate((grid.points, grid.points.take([0], axis)), axis)
    name = ("rows", "columns")[axis]
    with pytest.raises(MeshError, match=f"wrap: the last of the {name} repeats the first one"):
        QuadGrid((1e-3 * repeated + offset * 1e-3).astype(dtype), (True, True))
    assert QuadGrid(repeated, (axis == 1, axis == 0)).shape == repeated.shape[:2]
    QuadGrid(grid.points, (True, True))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("count", [2, 3])
def test_a_wrap_whose_first_rows_are_repeated_is_refused(axis, count):
    grid = surfaces.torus().sample((24, 30))[0]
    repeated = np.concatenate((grid.points, grid.points.take(range(count), axis)), axis)
    for view in (repeated, np.flip(repeated, axis)):
        with pytest.raises(MeshError, match=f"wrap: the last {count} of the .* repeat the first ones"):
            QuadGrid(view, (True, True))


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("count", [1, 2])
def test_cells_that_a_wrap_repeats_are_refused(axis, count):
    p, t = np.linspace(0.5, 2.5, 25), np.linspace(0, 2 * np.pi, 49)
    x = np.stack(np.broadcast_arrays(np.cos(t), np.sin(t), p[:, None]), axis=-1)
    x[:, -1] = x[:, 0]
    primal, dual = x[1::2, 1::2], x[::2, ::2]
    repeated = np.concatenate((primal, primal[:, :count]), axis=1)
    corners = np.concatenate((dual[:, :-1], dual[:, :count], dual[:, :1]), axis=1)
    if axis == 0:
        repeated, corners = np.swapaxes(repeated, 0, 1), np.swapaxes(corners, 0, 1)
    with pytest.raises(MeshError, match=r"wrap: the last .* as primal\[:"):
        StaggeredGrid(repeated, corners, (axis == 0, axis == 1))


# ---- rounding -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torus", "catenoid", "cubed_sphere"])
@pytest.mark.parametrize(("dtype", "offset"), [(np.float32, 0.0), (np.float32, 30.0), (np.float64, 1e8)])
def test_the_stated_error_of_rounding_is_that_of_rounding(name, dtype, offset):
    surface = surfaces.SURFACES[name]()
    mesh = surface.sample((96, 96), "faces")[0]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PrecisionWarning)
        rounded = mesh.with_points((mesh.points + offset).astype(dtype))
        H = qc.mean_curvature(rounded, "finite_volume")
    error = np.nanmax(np.abs(H - qc.mean_curvature(mesh, "finite_volume")))
    stated, _ = rounding_error(rounded)
    assert stated / 20 < error < 6 * stated  # at borders fitted surfaces magnify it


@pytest.mark.parametrize("shape", [(1, 5), (5, 1)])
def test_rounding_of_a_single_row_of_cells_is_that_of_its_edges(shape):
    rng = np.random.default_rng(0)
    primal, dual = rng.normal(size=(*shape, 3)), rng.normal(size=(shape[0] + 1, shape[1] + 1, 3))
    cells = StaggeredGrid(primal, dual)
    points = primal.reshape(-1, 3)
    shortest = np.linalg.norm(np.diff(points, axis=0), axis=1).min()
    error, extent = rounding_error(cells)
    assert error == pytest.approx(2 * cells.roundoff * np.abs(points).max() / shortest**2)
    assert extent == pytest.approx(np.ptp(points, axis=0).max())


def test_rounding_of_a_copy_that_is_rounded_otherwise_is_its_own():
    grid = surfaces.torus().sample((12, 10))[0]
    error, extent = rounding_error(grid)
    assert rounding_error(grid.with_roundoff(2.0**-24)) == (error * 2.0**29, extent)


def test_rounding_that_shows_is_warned_of():
    grid = surfaces.sphere().sample((400, 200))[0]
    far = QuadGrid((grid.points + 20).astype(np.float32), grid.wrap)
    for scheme in ("finite_volume", "jet"):
        with pytest.warns(
            PrecisionWarning, match=r"rounded to 1.2e-07 of their size, .* about 0\.0\d+ \(1/length\)"
        ):
            qc.mean_curvature(far, scheme)
    with pytest.warns(PrecisionWarning):
        qc.mean_curvature((1e-4 * grid.points.reshape(-1, 3) + 1e6, grid.stencils().faces), "liu")
    for fine in (grid, QuadGrid(grid.points[::8, ::8].astype(np.float32), grid.wrap)):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            qc.mean_curvature(fine, "finite_volume")


# ---- arguments ------------------------------------------------------------------------------------------

MESH = QuadMesh(
    *(
        x
        for x in (
            surfaces.torus().sample((6, 6))[0].to_mesh().points,
            surfaces.torus().sample((6, 6))[0].to_mesh().faces,
        )
    )
)


@pytest.mark.parametrize("kind", ["grid", "faces", "staggered"])
@pytest.mark.parametrize("scheme", ["jet", "jet-2", "liu"])
def test_evaluate_gives_what_the_verbs_give(kind, scheme):
    mesh = surfaces.torus().sample((12, 10), kind)[0]
    fit = scheme != "liu"
    verbs = {"mean_curvature": qc.mean_curvature, "mean_curvature_normal": qc.mean_curvature_normal}
    if fit:
        verbs["gaussian_curvature"] = qc.gaussian_curvature
    shape = verbs["mean_curvature"](mesh, scheme).shape
    out = {"mean_curvature": np.empty(shape)}
    found = qc.evaluate(mesh, *verbs, scheme=scheme, out=out)
    assert found["mean_curvature"] is out["mean_curvature"]
    for name, verb in verbs.items():
        assert np.array_equal(found[name], verb(mesh, scheme))
    if fit:
        all_ = qc.curvatures(mesh, scheme)
        found = qc.evaluate(mesh, "standard_error", "degree", scheme=scheme)
        assert np.array_equal(found["standard_error"], np.stack(all_.standard_error, axis=-1), equal_nan=True)
        assert np.array_equal(found["degree"], all_.degree)
    with pytest.raises(ValueError, match=f"wanted: expected some of .* as {scheme} gives, got 'torsion'"):
        qc.evaluate(mesh, "torsion", scheme=scheme)


@pytest.mark.parametrize(
    ("call", "error", "match"),
    [
        (lambda: qc.set_threads(2.0), ValueError, "number: expected .*whole number"),
        (lambda: qc.set_threads(float("nan")), ValueError, "number: expected"),
        (lambda: qc.set_threads(10**6), ValueError, "number: expected"),
        (lambda: qc.set_threads("2"), ValueError, "number: expected"),
        (lambda: qc.set_threads(True), ValueError, "number: expected"),
        (lambda: qc.set_threads(0), ValueError, "number: expected at least 1"),
        (lambda: qc.schemes.jet(4, 2.0), ValueError, "rings: expected"),
        (lambda: qc.schemes.jet(4, 10**6), ValueError, "rings: expected"),
        (lambda: qc.schemes.jet([4]), ValueError, "degree: expected"),
        (lambda: qc.mean_curvature(MESH, ["liu"]), ValueError, "scheme: expected one of"),
        (lambda: qc.mean_curvature(MESH, None), ValueError, "scheme: expected one of"),
        (lambda: qc.curvatures(MESH, 3), ValueError, "scheme: expected one of"),
        (lambda: qc.mean_curvature(MESH, "liu", ["nan"]), ValueError, "boundary: expected one of"),
        (lambda: qc.evaluate(MESH, "mean_curvature", out=[1]), ValueError, "out: expected a mapping"),
        (
            lambda: qc.evaluate(MESH, out={"mean_curvature": [1.0] * 36}),
            ValueError,
            "out: mean_curvature wants",
        ),
        (lambda: qc.evaluate(MESH, 3), ValueError, "wanted: expected some of"),
        (lambda: qc.merge_points(MESH, "a"), MeshError, "tolerance: expected a length"),
        (lambda: qc.duplicate_points(MESH, None), MeshError, "tolerance: expected a length"),
        (lambda: qc.read(3), TypeError, "path: expected"),
        (lambda: qc.laplace_beltrami(MESH, "abc"), ValueError, "f: expected real numbers"),
        (lambda: qc.schemes.de_goes("1"), ValueError, "stabilisation: expected"),
        (lambda: surfaces.torus().sample("ab"), ValueError, "shape: expected"),
        (lambda: surfaces.torus().sample((8.5, 3)), ValueError, "shape: expected"),
        (lambda: surfaces.torus().sample((0, 3)), ValueError, "shape: expected"),
        (lambda: qc.convergence(surfaces.torus(), "liu", [0, 8]), ValueError, "shapes: expected"),
        (lambda: qc.convergence(surfaces.torus(), "liu", ["8", 16]), ValueError, "shapes: expected"),
        (lambda: qc.mean_curvature((1, 2, 3)), TypeError, "mesh: expected"),
    ],
)
def test_arguments_refused_at_once_by_name(call, error, match):
    with pytest.raises(error, match=match):
        call()


def test_repairs_take_what_the_verbs_take():
    grid = surfaces.torus().sample((6, 6))[0]
    assert len(qc.merge_points(grid)[0].points) == 36
    assert qc.as_grid(grid)[0].shape == (6, 6)
    assert isinstance(SCHEMES[curvature.DEFAULT], Fit)


@pytest.mark.parametrize("overlap", ["points", "each other", "a part"])
def test_arrays_to_be_written_to_must_not_overlap(overlap):
    points = MESH.points.copy()
    mesh = QuadMesh(points, MESH.faces)
    one = np.empty((36, 3))
    match overlap:
        case "points":
            out = {"mean_curvature_normal": points}
        case "each other":
            out = {"mean_curvature_normal": one, "vertex_normals": one}
        case "a part":
            room = np.empty(36 * 3 + 3)
            out = {
                "mean_curvature_normal": room[:-3].reshape(36, 3),
                "vertex_normals": room[3:].reshape(36, 3),
            }
    with pytest.raises(ValueError, match=r"out: .* overlaps the memory of"):
        qc.evaluate(mesh, scheme="liu", out=out)
    matrix = np.empty(36).view(type("Array", (np.ndarray,), {}))
    with pytest.raises(
        ValueError, match="out: mean_curvature wants a writeable C-contiguous float64 ndarray"
    ):
        qc.evaluate(mesh, scheme="liu", out={"mean_curvature": matrix})
