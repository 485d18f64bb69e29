"""What is no mesh is rejected with the place of the error; what is a poor one gives NaN where it is poor."""

from __future__ import annotations

import re
import warnings
from contextlib import contextmanager, suppress
from copy import deepcopy

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv import SCHEMES, Laplacian, MeshError, MeshWarning, QuadGrid, QuadMesh, StaggeredGrid, surfaces
from quadcurv.boundary import OPEN, boundary_treatment, roughness
from quadcurv.comparison import compare
from quadcurv.mesh_quality import quality, summary

LAPLACIANS = [name for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)]
every_scheme = pytest.mark.parametrize("scheme", SCHEMES)
every_laplacian = pytest.mark.parametrize("scheme", LAPLACIANS)

SQUARE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0, 0), (2, 1, 0)], float)
QUADS = np.array([(0, 1, 2, 3), (1, 4, 5, 2)])


def grid_quads(r, c):
    index = np.arange(r * c).reshape(r, c)
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1)
    return quads.reshape(-1, 4)


def bowl(r, c, bend=0.5):
    """A grid on a paraboloid, as points (r c, 3) and quads."""
    x, y = np.meshgrid(np.linspace(-1, 1, r), np.linspace(-1, 1, c), indexing="ij")
    return np.stack((x, y, bend * (x**2 + 2 * y**2)), axis=-1).reshape(-1, 3), grid_quads(r, c)


# ---- rejections ---------------------------------------------------------------------------------------


def entry(array, index, value):
    array = array.copy()
    array[index] = value
    return array


BAD_POINTS = {
    "none": (None, "points: expected real numbers, got dtype object"),
    "text": ("abc", "points: expected real numbers, got dtype <U3"),
    "strings": ([["a", "b", "c"]] * 6, "points: expected real numbers, got dtype <U1"),
    "objects": (SQUARE.astype(object), "points: expected real numbers, got dtype object"),
    "booleans": (SQUARE > 0, "points: expected real numbers, got dtype bool"),
    "complex": (SQUARE + 0j, "points: expected real numbers, got dtype complex128"),
    "dates": (SQUARE.astype("M8[s]"), r"points: expected real numbers, got dtype datetime64\[s\]"),
    "a dict": ({0: 1}, "points: expected real numbers, got dtype object"),
    "a generator": ((p for p in SQUARE), "points: expected real numbers, got dtype object"),
    "ragged": ([[0, 0, 0], [1, 1]], "points: expected real numbers, got dtype object"),
    "too big an integer": ([[10**400, 0, 0.5]] * 6, "points: expected real numbers"),
    "masked": (np.ma.array(SQUARE, mask=SQUARE > 1), "points: masked entries"),
    "one point": (SQUARE[0], r"points: shape \(3,\), expected \(n, 3\)"),
    "two coordinates": (SQUARE[:, :2], r"points: shape \(6, 2\), expected \(n, 3\)"),
    "four coordinates": (np.ones((6, 4)), r"points: shape \(6, 4\), expected \(n, 3\)"),
    "a grid": (np.ones((2, 3, 3)), r"points: shape \(2, 3, 3\), expected \(n, 3\)"),
    "a number": (3.0, r"points: shape \(\), expected \(n, 3\)"),
    "nothing": (np.empty((0, 3)), "points: none given"),
    "NaN": (
        entry(SQUARE, (4, 1), np.nan),
        r"points: 1 non-finite point\(s\), first vertex 4: \[ 2. nan  0.\]",
    ),
    "inf": (entry(SQUARE, ([2, 5], 0), np.inf), r"points: 2 non-finite point\(s\), first vertex 2"),
    "long doubles": (SQUARE * np.longdouble("1e400"), r"points: 5 non-finite point\(s\), first vertex 1"),
    "huge": (
        entry(SQUARE, (3, 2), -1e150),
        r"points: 1 point\(s\) beyond 1e\+70, whose areas overflow, first vertex 3",
    ),
    "tiny": (SQUARE * 1e-150, "points: all within 1e-70 of each other, where areas vanish"),
}

BAD_FACES = {
    "none": (None, "faces: expected an integer array"),
    "text": ("abc", "faces: expected an integer array"),
    "strings": (QUADS.astype(str), "faces: expected integer indices, got dtype <U21"),
    "floats": (QUADS.astype(float), "faces: expected integer indices, got dtype float64"),
    "NaN": (entry(QUADS.astype(float), (0, 3), np.nan), "faces: expected integer indices, got dtype float64"),
    "booleans": (QUADS > 0, "faces: expected integer indices, got dtype bool"),
    "objects": (QUADS.astype(object), "faces: expected integer indices, got dtype object"),
    "complex": (QUADS + 0j, "faces: expected integer indices, got dtype complex128"),
    "ragged floats": ([[0.0, 1.0, 2.0], [0, 1, 2, 3]], "faces: expected an integer array"),
    "masked": (np.ma.array(QUADS, mask=QUADS == 3), "faces: masked entries"),
    "one face": ([0, 1, 2, 3], "faces: expected an integer array"),
    "too many axes": (QUADS[None], "faces: expected an integer array"),
    "a dict": ({0: (0, 1, 2)}, "faces: expected an integer array"),
    "a number": (4, "faces: expected an integer array"),
    "no faces": ([], "faces: none given"),
    "no quads": (np.empty((0, 4), int), "faces: none given"),
    "an empty face": ([[]], "faces: a face has at least 3 vertices, face 0 has 0"),
    "an edge": ([[0, 1, 2], [3, 4]], "faces: a face has at least 3 vertices, face 1 has 2"),
    "too large": (
        entry(QUADS, (1, 2), 6),
        r"faces: 1 face\(s\) with an index outside 0..5, first face 1: \[1, 4, 6, 2\]",
    ),
    "negative": (
        entry(QUADS, (slice(None), 1), -1),
        r"faces: 2 face\(s\) with an index outside 0..5, first face 0",
    ),
    "below -1": (entry(QUADS, (0, 3), -2), r"faces: 1 face\(s\) with an index outside 0..5, first face 0"),
    "all -1": (np.full((1, 4), -1), r"faces: 1 face\(s\) with an index outside 0..5"),
    "a triangle with -1": ([[0, 1, -1]], r"faces: 1 face\(s\) with an index outside 0..5"),
    "wrapped around": (
        entry(QUADS.astype(np.uint64), (0, 3), 2**64 - 1),
        r"faces: 1 face\(s\) with an index outside 0..5, first face 0",
    ),
    "beyond 64 bits": ([[0, 1, 2], [0, 1, 2, 10**30]], "faces: face 1 has an index outside 0..5"),
    "in a pentagon": (
        [[0, 1, 2, 3], [0, 1, 2, 3, 9]],
        r"faces: face 1 has an index outside 0..5: \[0, 1, 2, 3, 9\]",
    ),
    "negative in a pentagon": ([[0, 1, 2, 3, -1]], "faces: face 0 has an index outside 0..5"),
    "repeated in a triangle": (
        [[0, 1, 1]],
        r"faces: none is left of those given: 1 face\(s\) of fewer than three .* first face 0",
    ),
}


@pytest.mark.parametrize("name", BAD_POINTS)
def test_points_rejected(name):
    points, match = BAD_POINTS[name]
    with pytest.raises(MeshError, match=match):
        QuadMesh(points, QUADS)


@pytest.mark.parametrize("name", BAD_FACES)
def test_faces_rejected(name):
    faces, match = BAD_FACES[name]
    with pytest.raises(MeshError, match=match):
        QuadMesh(SQUARE, faces)


MENDED = {
    "spike in a quad": (
        entry(QUADS, (1, 3), 4),
        r"1 face\(s\) of fewer than three .* left out, first face 1",
    ),
    "collapsed quad": (entry(QUADS, (1, 3), 5), r"1 face\(s\) with a repeated vertex, .* first face 1"),
    "collapsed pentagon": ([[0, 1, 2, 3, 0]], r"1 face\(s\) with a repeated vertex, .* first face 0"),
    "three on an edge": (
        [[0, 1, 2, 3], [1, 4, 5, 2], [1, 2, 4]],
        r"1 edge\(s\) with more than two faces, .* first the one from vertex 1 to 2",
    ),
    "a quad thrice": ([[0, 1, 2, 3]] * 3, r"2 face\(s\) given twice, taken once, first face 1"),
}


@pytest.mark.parametrize("name", MENDED)
def test_faces_mended_and_said(name):
    faces, match = MENDED[name]
    with pytest.warns(MeshWarning, match=match):
        mesh = QuadMesh(SQUARE, faces)
    assert re.search(match, str(mesh.report))


@pytest.mark.parametrize("name", ["two coordinates", "NaN", "text", "huge"])
def test_what_meshes_reject_all_verbs_reject(name):
    points, match = BAD_POINTS[name]
    for verb in (
        qc.mean_curvature,
        qc.mean_curvature_normal,
        qc.vertex_normals,
        qc.dual_areas,
        quality,
        summary,
    ):
        with pytest.raises(MeshError, match=match):
            verb((points, QUADS))
    mesh = QuadMesh(SQUARE, QUADS)
    with pytest.raises(MeshError, match="points: "):
        mesh.with_points(points)


CELLS = np.ones((3, 4, 3)) * np.arange(4)[:, None]


@pytest.mark.parametrize(
    ("wrap", "match"),
    [
        (None, "wrap: expected two booleans, got None"),
        (True, "wrap: expected two booleans, got True"),
        ((1, 0), r"wrap: expected two booleans, got \(1, 0\)"),
        ("TF", "wrap: expected two booleans, got 'TF'"),
        ((True,) * 3, "wrap: expected two booleans"),
        (np.ones((2, 2), bool), "wrap: expected two booleans"),
        (iter(()), "wrap: expected two booleans"),
    ],
)
def test_wraps_rejected(wrap, match):
    with pytest.raises(MeshError, match=match):
        QuadGrid(np.ones((5, 5, 3)), wrap)
    assert QuadGrid(np.ones((5, 5, 3)), (w for w in (True, False))).wrap == (True, False)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: QuadGrid(np.ones((0, 5, 3))), "points: 0 rows, at least 2 are needed"),
        (
            lambda: QuadGrid(np.ones((5, 2, 3)), (False, True)),
            "points: 2 columns, at least 3 are needed where",
        ),
        (lambda: QuadGrid(np.ones((5, 5, 2))), r"points: shape \(5, 5, 2\), expected \(r, c, 3\)"),
        (lambda: StaggeredGrid(CELLS, np.ones((4, 5, 2))), r"dual: shape \(4, 5, 2\), expected"),
        (lambda: StaggeredGrid("abc", np.ones((4, 5, 3))), "primal: expected real numbers, got dtype <U3"),
        (
            lambda: StaggeredGrid(CELLS * np.nan, np.ones((4, 5, 3))),
            r"primal: 12 non-finite .* first vertex \(0, 0\)",
        ),
        (lambda: StaggeredGrid(CELLS, np.ones((4, 4, 3))), "primal: shape .* does not fit dual of shape"),
        (
            lambda: StaggeredGrid(np.ones((1, 1, 3)), np.ones((2, 2, 3))),
            "primal: a single cell needs ghost cells",
        ),
        (lambda: StaggeredGrid(CELLS, 1e80 * np.ones((4, 5, 3))), r"dual: 20 point\(s\) beyond 1e\+70"),
    ],
)
def test_grids_rejected(make, match):
    with pytest.raises(MeshError, match=match):
        make()


def test_arguments_of_verbs_rejected():
    mesh = QuadMesh(*bowl(5, 5))
    with pytest.raises(ValueError, match="boundary: expected one of"):
        qc.mean_curvature(mesh, "finite_volume", boundary="mirror")
    with pytest.raises(ValueError, match="scheme: expected one of finite_volume, liu"):
        qc.mean_curvature(mesh, "simplest")
    with pytest.raises(TypeError, match="mesh: expected a quadcurv mesh"):
        qc.mean_curvature(mesh.points, "finite_volume")


# ---- every layout is the same mesh --------------------------------------------------------------------


class Disguise:
    """An array by protocol only."""

    def __init__(self, array):
        self.array = array

    def __array__(self, dtype=None, copy=None):
        return np.array(self.array, dtype)


def spread(array):
    """The same values, not contiguous."""
    return np.repeat(np.repeat(array, 2, axis=0), 2, axis=1)[::2, ::2]


def frozen(array):
    array = array.copy()
    array.flags.writeable = False
    return array


LAYOUTS = {
    "Fortran order": np.asfortranarray,
    "spread": spread,
    "reversed strides": lambda a: a[::-1].copy()[::-1],
    "list": np.ndarray.tolist,
    "tuples": lambda a: tuple(map(tuple, a.tolist())),
    "list of arrays": list,
    "read-only": frozen,
    "other byte order": lambda a: a.astype(a.dtype.newbyteorder()),
    "masked, nothing hidden": np.ma.array,
    "by protocol": Disguise,
}


@pytest.mark.parametrize("layout", LAYOUTS)
def test_results_do_not_depend_on_the_layout(layout):
    points, faces = bowl(6, 7)
    expected = [qc.mean_curvature((points, faces), scheme) for scheme in SCHEMES]
    disguised = LAYOUTS[layout](points), LAYOUTS[layout](faces)
    for scheme, H in zip(SCHEMES, expected, strict=True):
        assert np.array_equal(qc.mean_curvature(disguised, scheme), H)
    grid = qc.mean_curvature(QuadGrid(points.reshape(6, 7, 3)), "finite_volume")
    disguised = LAYOUTS[layout](points.reshape(6, 7, 3))
    assert np.array_equal(qc.mean_curvature(QuadGrid(disguised), "finite_volume"), grid)


@pytest.mark.parametrize(
    "dtype", [np.int8, np.uint8, np.int16, np.int32, np.uint32, np.int64, np.uint64, ">i4"]
)
def test_results_do_not_depend_on_the_type_of_indices(dtype):
    points, faces = bowl(6, 7)
    mesh = QuadMesh(points, faces.astype(dtype))
    assert mesh.faces.dtype == np.int32
    assert np.array_equal(
        qc.mean_curvature(mesh, "finite_volume"), qc.mean_curvature((points, faces), "finite_volume")
    )


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.longdouble, np.int8, np.uint16, np.int64])
def test_points_of_other_types_are_the_numbers_they_are(dtype):
    points, faces = bowl(5, 5)
    points = np.round(8 * points + 10).astype(dtype)
    H = qc.mean_curvature((points, faces), "finite_volume")
    assert H.dtype == np.float64
    assert np.array_equal(H, qc.mean_curvature((points.astype(float), faces), "finite_volume"))


def test_nothing_of_the_callers_changes():
    points, faces = bowl(6, 7)
    faces[3] = faces[3][::-1]  # will be turned, in our copy
    before = points.copy(), faces.copy()
    with pytest.warns(MeshWarning, match=r"1 face\(s\) turned to agree with their neighbours, first face 3"):
        mesh = QuadMesh(points, faces)
    assert mesh.report["turned"] == 1
    for scheme in SCHEMES:
        with pytest.warns(MeshWarning, match="turned"):
            qc.mean_curvature((points, faces), scheme)
    quality(mesh), summary(mesh, ["liu"]), mesh.stencils().corner_table
    assert np.array_equal(points, before[0])
    assert np.array_equal(faces, before[1])
    assert points.flags.writeable
    assert faces.flags.writeable


# ---- size and place -----------------------------------------------------------------------------------


@every_scheme
@pytest.mark.parametrize("scale", [1e-60, 1e-9, 1e9, 1e60])
def test_every_size_has_the_same_relative_accuracy(scale, scheme):
    points, faces = bowl(6, 7)
    mixed = [*faces[:-1].tolist(), faces[-1, :3].tolist()]
    for cells in (faces, mixed):
        H = qc.mean_curvature((points, cells), scheme)
        scaled = scale * qc.mean_curvature((scale * points, cells), scheme)
        assert np.allclose(scaled, H, rtol=1e-10, atol=1e-10, equal_nan=True)


@every_scheme
@pytest.mark.parametrize("power", [-200, 200])
def test_powers_of_two_change_no_digit(power, scheme):
    points, faces = bowl(6, 7)
    scaled = 2.0**power * qc.mean_curvature((2.0**power * points, faces), scheme)
    assert np.array_equal(scaled, qc.mean_curvature((points, faces), scheme), equal_nan=True)


@pytest.mark.parametrize("power", [-200, 200])
@pytest.mark.parametrize("scheme", ["jet", "jet-2"])
def test_powers_of_two_change_no_digit_of_error_bars(scheme, power):
    points, faces = bowl(9, 9)
    one, other = (qc.curvatures((f * points, faces), scheme) for f in (1.0, 2.0**power))
    for bars, scaled in ((one.standard_error, other.standard_error), (one.interval, other.interval)):
        for name in bars._fields if bars is not None else ():
            factor = 2.0 ** (power * (2 if name == "gaussian" else 1))
            assert np.array_equal(factor * getattr(scaled, name), getattr(bars, name), equal_nan=True)


@every_scheme
def test_an_offset_costs_nothing_but_the_digits_of_the_positions(scheme):
    """Positions that an offset of a million leaves as they are: results stay, ghosts too."""
    points, faces = bowl(7, 8)
    points = np.round(points * 2**24) / 2**24
    offset = np.array([2.0**20, -(2.0**20), 2.0**20])
    assert np.array_equal(points + offset - offset, points)
    H = qc.mean_curvature((points, faces), scheme)
    assert np.allclose(qc.mean_curvature((points + offset, faces), scheme), H, rtol=1e-9, atol=1e-8)
    on_grid = qc.mean_curvature(QuadGrid((points + offset).reshape(7, 8, 3)), scheme)
    assert np.allclose(
        on_grid, qc.mean_curvature(QuadGrid(points.reshape(7, 8, 3)), scheme), rtol=1e-9, atol=1e-8
    )
    # Any offset: error of the positions, 2e-10, over the square of the edges.
    shifted = qc.mean_curvature((points + 1e6, faces), scheme)
    assert np.abs(shifted - H).max() < 31 * 2e-10 / 0.28**2


# ---- poor meshes --------------------------------------------------------------------------------------


def undefined(points, faces, scheme="finite_volume"):
    H = qc.mean_curvature((points, faces), scheme, boundary="nan")
    inside = qc.one_rings(QuadMesh(points, faces), "nan").closed
    return np.flatnonzero(np.isnan(H) & inside).tolist()


@every_laplacian
def test_a_quad_without_area_has_no_curvature_at_its_own_vertices(scheme):
    """Four distinct vertices in line: each triangle of the quad is without area too."""
    points, faces = bowl(9, 9)
    quad = faces[27]
    points[quad] = 0.125 * np.array([(-1, 1, 4), (0, 1, 4), (2, 1, 4), (1, 1, 4)])
    assert undefined(points, faces, scheme) == sorted(quad.tolist())


@every_laplacian
def test_coincident_vertices_leave_all_others_alone(scheme):
    points, faces = bowl(9, 9)
    points[faces[27]] = points[faces[27, 0]]
    H = qc.mean_curvature((points, faces), scheme, boundary="nan")
    inside = qc.one_rings(QuadMesh(points, faces), "nan").closed
    around = np.unique(faces[np.isin(faces, faces[27]).any(axis=1)])
    assert np.isnan(H[faces[27]]).all()
    assert set(np.flatnonzero(inside & np.isnan(H))) <= set(around)
    assert not np.isinf(H).any()


@every_scheme
def test_all_points_in_one_place_or_in_line(scheme):
    points, faces = bowl(6, 6)
    for flat in (0 * points, 0 * points + 1e6, points * (1, 0, 0), np.outer(points[:, 0], (1, 2, 3))):
        H = qc.mean_curvature((flat, faces), scheme)
        assert H.shape == (36,)
        assert not np.isinf(H).any()
        for scale in (1e-60, 1e60):
            assert not np.isinf(qc.mean_curvature((scale * flat, faces), scheme)).any()


@every_laplacian
def test_a_quad_that_crosses_itself_spoils_nothing_beyond_its_neighbours(scheme):
    points, faces = bowl(12, 12)
    quad = faces[60]
    H = qc.mean_curvature((points, faces), scheme)
    swapped = points.copy()
    swapped[quad[:2]] = points[quad[1::-1]]
    far = ~np.isin(np.arange(144), faces[np.isin(faces, quad[:2]).any(axis=1)])
    far &= np.pad(np.ones((10, 10), bool), 1).ravel()  # surfaces are fitted at the border, over several rings
    moved = qc.mean_curvature((swapped, faces), scheme)
    assert np.allclose(moved[far], H[far], rtol=1e-12)
    assert not np.isinf(moved).any()
    # With its sides for diagonals: a twist in the sheet, so that the mesh has one side only.
    twisted = entry(faces, 60, quad[[0, 2, 1, 3]])
    with pytest.warns(UserWarning, match="non-orientable"):
        mesh = QuadMesh(points, twisted)
    near = np.isin(np.arange(144), quad)
    assert not np.isinf(qc.mean_curvature(mesh, scheme)[near]).any()  # at the border of a slit
    inside = ~near & np.pad(np.ones((10, 10), bool), 1).ravel()
    assert np.allclose(qc.mean_curvature(mesh, scheme)[inside], np.abs(H[inside]), rtol=1e-9)


@every_laplacian
def test_two_fans_at_a_vertex_spoil_that_vertex_only(scheme):
    """Two bowls that share one vertex inside."""
    points, faces = bowl(11, 11)
    n, shared = 121, 60
    other = np.where(faces == shared, shared, faces + n)
    both = np.vstack((points, points * (1, 1, -1)))
    alone = qc.mean_curvature((points, faces), scheme)
    H = qc.mean_curvature((both, np.vstack((faces, other))), scheme)
    assert np.flatnonzero(np.isnan(H)).tolist() == [shared, n + shared]
    kept = np.arange(n) != shared
    assert np.allclose(H[:n][kept], alone[kept], rtol=1e-12)
    assert np.allclose(np.abs(H[n:][kept]), np.abs(alone[kept]), rtol=1e-9)


@every_laplacian
def test_isolated_vertices_are_nan_alone(scheme):
    points, faces = bowl(6, 6)
    H = qc.mean_curvature((points, faces), scheme)
    more = qc.mean_curvature((np.vstack((points, [(9, 9, 9)], points[:2])), faces), scheme)
    assert np.array_equal(more[:36], H)
    assert np.isnan(more[36:]).all()


def test_seams_of_duplicated_vertices_are_boundaries_and_are_counted():
    """A tube whose first and last row are the same points twice over."""
    angle = np.linspace(0, 2 * np.pi, 13)
    angle[-1] = 0
    points = np.stack(
        np.broadcast_arrays(np.cos(angle)[:, None], np.sin(angle)[:, None], np.arange(6) / 5.0), -1
    )
    mesh = QuadGrid(points).to_mesh()
    assert summary(mesh, [])["coincident"] == 6
    assert np.isnan(qc.mean_curvature(mesh, "finite_volume", boundary="nan").reshape(13, 6)[[0, -1]]).all()
    assert summary(QuadGrid(points[:-1], (True, False)), [])["coincident"] == 0


@every_scheme
def test_a_sheet_folded_onto_itself(scheme):
    points, faces = bowl(9, 6)
    points[:, 0] = np.abs(points[:, 0])
    H = qc.mean_curvature((points, faces), scheme)
    assert H.shape == (54,)
    assert not np.isinf(H).any()


@every_laplacian
def test_the_two_sides_of_one_quad_enclose_nothing(scheme):
    H = qc.mean_curvature((SQUARE[:4], [[0, 1, 2, 3], [3, 2, 1, 0]]), scheme)
    assert H.shape == (4,)
    assert not np.isinf(H).any()


def test_mixed_orientation_is_mended_by_the_fewest_turns(rng):
    points, faces = bowl(9, 9)
    turned = rng.permutation(64)[:20]
    mixed = faces.copy()
    mixed[turned] = mixed[turned][:, [0, 3, 2, 1]]
    with pytest.warns(MeshWarning, match=r"20 face\(s\) turned"):
        mesh = QuadMesh(points, mixed)
    assert mesh.report["turned"] == 20
    assert np.array_equal(mesh.faces, faces)
    assert np.array_equal(
        qc.mean_curvature(mesh, "finite_volume"), qc.mean_curvature((points, faces), "finite_volume")
    )


@every_scheme
def test_a_moebius_strip_is_unsigned_and_says_so(scheme):
    u, v = np.arange(20)[:, None] * np.pi / 10, np.linspace(-0.4, 0.4, 6)
    R = 2 + v * np.cos(u / 2)
    points = np.stack((R * np.cos(u), R * np.sin(u), v * np.sin(u / 2)), axis=-1).reshape(-1, 3)
    index = np.arange(120).reshape(20, 6)
    index = np.vstack((index, index[:1, ::-1]))
    faces = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1).reshape(-1, 4)
    with pytest.warns(UserWarning, match="non-orientable: its mean curvature has no sign"):
        mesh = QuadMesh(points, faces)
    H = qc.mean_curvature(mesh, scheme)
    assert np.isfinite(H).all()
    assert (H >= 0).all()


# ---- everything at once -------------------------------------------------------------------------------


@contextmanager
def rejection_names_the_place():
    try:
        yield
    except ValueError as error:
        if not re.match(r"(points|faces|wrap|mask|primal|dual): ", str(error)):
            raise AssertionError("this message names no place") from error


def face_lists():
    """Small meshes of every kind: (points, faces)."""
    torus = surfaces.torus().sample((5, 6))[0].to_mesh()
    cube = surfaces.cubed_sphere().sample((2, 2), "faces")[0]
    strip = np.array([(0, 1, 2, 3), (3, 2, 4, 5), (5, 4, 1, 0)])
    points, quads = bowl(7, 6)
    mixed = np.vstack((quads[::2], np.column_stack((quads[1::2, :3], np.full(15, -1)))))
    l_shape = quads[~((quads[:, 0] > 20) & (quads[:, 0] % 6 > 2))]
    return [
        bowl(7, 6),
        bowl(2, 2),
        (torus.points, torus.faces.astype(int)),
        (cube.points, cube.faces.astype(int)),
        (points, mixed),
        (points, quads[:, :3]),
        (points, l_shape),
        (SQUARE[[0, 1, 2, 3, 4, 5]] + np.arange(6)[:, None] * (0, 0, 0.3), strip),
        (points, [*quads[:9].tolist(), [0, 6, 12, 13, 7, 1][::-1]]),
        (points, [*quads[9:].tolist(), [0, 6, 12, 18, 19, 13, 7, 1]]),
    ]


@np.errstate(all="ignore")
def damaged_points(points, rng):
    """One thing wrong with positions, or nothing."""
    n = len(points)
    some = rng.integers(0, n, rng.integers(1, 4))
    kind = rng.integers(0, 19)
    match kind:
        case 0 | 1:
            return entry(points, some, rng.choice([np.nan, np.inf, -np.inf, 1e150, -1e308, 1e69, 1e-300]))
        case 2:
            return points * rng.choice([1e-150, 1e-70, 1e-60, 1e-9, 1e9, 1e60, 1e69, 1e150, 1e300, 5e-324])
        case 3:
            return points + rng.choice([1e6, -1e12, 1e17, 1e69])
        case 4:
            return entry(points, some, points[rng.integers(n)])
        case 5:
            return points * rng.choice(
                [(0, 1, 1), (1, 0, 0), (0, 0, 0), (0, 0, 1), (1e-12, 1, 1), (1, 1, 1e69)]
            )
        case 6:
            return np.abs(points)
        case 7:
            return rng.permutation(points)
        case 8:
            return points + rng.normal(0, 10.0 ** rng.integers(-16, 3), points.shape)
        case 9:
            return np.round(points)
        case 10:
            dtypes = ["f2", "f4", "i1", "i8", "u8", "?", "c16", "O", "U8", ">f8", "g"]
            return points.astype(rng.choice(dtypes))
        case 11:
            return [points.T, points[:, :2], points.ravel(), points[None], points[0], points[:0]][
                rng.integers(6)
            ]
        case 12:
            return [points[: n // 2], points[:1], points.tolist()][rng.integers(3)]
        case 13:
            return np.ma.array(points, mask=rng.random(points.shape) < rng.choice([0, 0.02]))
        case 14:
            return [[1.0, 2.0], *points.tolist()]
        case 15:
            return entry(points, some, points[some] * 1e-170)
    return points


def damaged_faces(faces, n, rng):
    """One thing wrong with faces, or nothing."""
    if isinstance(faces, list):
        faces = [list(face) for face in faces]
        which, slot = rng.integers(len(faces)), rng.integers(3)
        match rng.integers(0, 7):
            case 0:
                faces[which][slot] = int(rng.choice([-1, -2, n, 2**31, 2**62])) * int(rng.choice([1, 10**9]))
            case 1:
                faces[which] = faces[which][:slot]
            case 2:
                faces[which] = rng.integers(0, n, rng.integers(3, 9)).tolist()
            case 3:
                faces[which] = rng.permutation(faces[which]).tolist()
            case 4:
                faces[which] = [None, "abc", 3, [0.5, 1, 2], [[0], [1], [2]], {0, 1, 2}][rng.integers(6)]
            case 5:
                faces += faces[which : which + slot]
        return faces
    m = len(faces)
    some, slot = rng.integers(0, m, rng.integers(1, 4)), rng.integers(faces.shape[1])
    match rng.integers(0, 19):
        case 0:
            return entry(faces, (some, slot), rng.choice([-1, -2, n, n + 1, 2**31, -(2**31), 2**32, 2**62]))
        case 1:
            return entry(faces, (some, slot), faces[some, slot - 1])
        case 2:
            return entry(faces, (some, slot), rng.integers(0, n))
        case 3:
            return np.vstack((faces, faces[some]))
        case 4:
            return np.vstack((faces, faces[some][:, ::-1]))
        case 5:
            return entry(faces, some, faces[some][:, ::-1])
        case 6:
            return entry(faces, some, rng.permuted(faces[some], axis=1))
        case 7:
            return np.where(faces == rng.integers(0, n), rng.integers(0, n), faces)
        case 8:
            return np.delete(faces, rng.integers(0, m, rng.integers(0, m)), axis=0)
        case 9:
            return np.vstack((faces, rng.integers(0, n, (rng.integers(1, 4), faces.shape[1]))))
        case 10:
            return faces.astype(
                rng.choice(["f8", "?", "O", "U4", "u1", "i1", "u2", "i4", "u4", "u8", ">i8", "c16"])
            )
        case 11:
            return [faces.T, faces[:, :2], faces.ravel(), faces[None], faces[0], faces[:0]][rng.integers(6)]
        case 12:
            return np.ma.array(faces, mask=rng.random(faces.shape) < rng.choice([0, 0.02]))
        case 13:
            return rng.integers(0, n, faces.shape)
        case 14:
            return rng.permuted(faces, axis=1)
        case 15:
            return rng.permutation(faces.ravel()).reshape(faces.shape)
        case 16:
            return np.stack([np.roll(f, rng.integers(4)) for f in rng.permutation(faces)])
    return faces


def whole(x, dtype):
    """Whether it can be damaged further."""
    if isinstance(x, list):
        return dtype is int and all(isinstance(y, list) and len(y) > 2 for y in x)
    return x.dtype == dtype and x.ndim == 2 and len(x) > 0 and x.shape[1] in (3, 4)


def same(x, y):
    if not isinstance(x, np.ndarray):
        return x == y
    x, y = np.asarray(x), np.asarray(y)
    return np.array_equal(x, y, equal_nan=True) if x.dtype.kind in "fc" else x.tolist() == y.tolist()


def check(values, shape):
    """A result is of its shape, and finite or NaN."""
    assert values.shape == shape
    assert values.dtype == np.float64
    assert not np.isinf(values).any()


def run_everything(mesh, scheme, boundary):
    """Every public verb; what it rejects it rejects with the name of an argument."""
    shape = mesh.shape if isinstance(mesh, QuadGrid) else mesh.stencils().shape
    n = int(np.prod(shape))
    laplacian = isinstance(SCHEMES[scheme], Laplacian)
    verbs = [
        lambda: check(qc.mean_curvature(mesh, scheme, boundary), shape),
        lambda: check(qc.mean_curvature_normal(mesh, scheme, boundary), (*shape, 3)),
        lambda: check(qc.vertex_normals(mesh, boundary), (*shape, 3)),
        lambda: check(qc.gaussian_curvature(mesh, "angle_defect" if laplacian else scheme, boundary), shape),
        lambda: summary(mesh, [scheme], boundary),
        lambda: [check(x, shape) for name, x in quality(mesh).items() if name != "valence"],
        lambda: check(roughness(mesh), shape),
        lambda: check_stencils(mesh, boundary),
    ]
    if laplacian:
        verbs += [
            lambda: check(qc.dual_areas(mesh, scheme), shape),
            lambda: check(qc.mass_matrix(mesh, scheme).diagonal(), (mesh.stencils().n,)),
            lambda: check_matrix(mesh, scheme),
        ]
    else:
        verbs += [lambda: check(qc.curvatures(mesh, scheme, boundary).k1, shape)]
    for verb in verbs:
        with rejection_names_the_place():
            verb()
    if isinstance(mesh, qc.QuadMesh):
        for convert in (qc.as_grid, qc.pair_triangles, qc.merge_points, qc.duplicate_points):
            with suppress(MeshError):
                convert(mesh)
    with rejection_names_the_place():
        assert compare(mesh, scheme, boundary=boundary).to_dict()["vertices"] == n


def check_stencils(mesh, boundary):
    stencils = qc.one_rings(mesh, boundary)
    table, points = stencils.corner_table, stencils.points
    assert np.isfinite(points).all()
    assert stencils.faces.min(initial=0) >= -1
    assert stencils.faces.max(initial=-1) < len(points)
    assert table.indptr.shape == (stencils.n + 1,)
    assert np.array_equal(table.centre, np.repeat(np.arange(stencils.n), np.diff(table.indptr)))
    check(stencils.ring_areas, (stencils.n, 3))
    treatment = boundary_treatment(mesh, boundary).ravel()
    assert np.array_equal(treatment == OPEN, ~mesh.in_shape(stencils.closed).ravel())


def check_matrix(mesh, scheme):
    matrix = qc.stiffness_matrix(mesh, scheme)
    assert not np.isinf(matrix.data).any()
    assert matrix.shape == (mesh.stencils().n, len(mesh.stencils().points))


@pytest.fixture(autouse=True)
def one_warning_is_ours():
    """All others are errors."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MeshWarning)
        yield


FACE_LISTS = face_lists()
fuzz = settings(derandomize=True, deadline=None, database=None)
schemes = st.sampled_from(list(SCHEMES))
boundaries = st.sampled_from(["extrapolate", "nan"])
seeds = st.integers(0, 2**32 - 1)


@given(
    which=st.sampled_from(range(len(FACE_LISTS))),
    damages=st.tuples(st.integers(0, 2), st.integers(0, 2)),
    scheme=schemes,
    boundary=boundaries,
    seed=seeds,
)
@settings(fuzz, max_examples=2000)
def test_damaged_face_lists(which, damages, scheme, boundary, seed):
    points, faces = FACE_LISTS[which]
    n, rng = len(points), np.random.default_rng(seed)
    for _ in range(damages[0]):
        faces = damaged_faces(faces, n, rng) if whole(faces, int) else faces
    for _ in range(damages[1]):
        points = damaged_points(points, rng) if whole(points, float) else points
    before = deepcopy((points, faces))
    with rejection_names_the_place():
        run_everything(qc.as_mesh((points, faces)), scheme, boundary)
    assert same(points, before[0])
    assert same(faces, before[1])


@given(
    shape=st.tuples(st.integers(1, 7), st.integers(1, 7)),
    wrap=st.sampled_from([(False, False), (True, False), (False, True), (True, True), (0, 1), "no", None]),
    scheme=schemes,
    boundary=boundaries,
    seed=seeds,
)
@settings(fuzz, max_examples=400)
def test_damaged_grids(shape, wrap, scheme, boundary, seed):
    points = damaged_array(shape, np.random.default_rng(seed))
    before = deepcopy(points)
    with rejection_names_the_place():
        run_everything(QuadGrid(points, wrap), scheme, boundary)
    assert same(points, before)


@given(
    shape=st.tuples(st.integers(1, 6), st.integers(1, 6)),
    ghosts=st.sampled_from([0, 2]),
    wrap=st.tuples(st.booleans(), st.booleans()),
    scheme=schemes,
    boundary=boundaries,
    seed=seeds,
)
@settings(fuzz, max_examples=400)
def test_damaged_cells(shape, ghosts, wrap, scheme, boundary, seed):
    rng = np.random.default_rng(seed)
    primal = damaged_array([k + ghosts for k in shape], rng)
    dual = damaged_array([k + 1 for k in shape], rng)
    if isinstance(dual, np.ndarray) and dual.ndim == 3:
        dual = dual.copy()
        dual[-1] = dual[0] if wrap[0] else dual[-1]
        dual[:, -1] = dual[:, 0] if wrap[1] else dual[:, -1]
    before = deepcopy((primal, dual))
    with rejection_names_the_place():
        run_everything(StaggeredGrid(primal, dual, wrap), scheme, boundary)
    assert same(primal, before[0])
    assert same(dual, before[1])


def damaged_array(shape, rng):
    """An uneven bowl as an array (r, c, 3), damaged every other time."""
    r, c = shape
    t = [np.linspace(-1, 1, k) + rng.normal(0, 0.1 / k, k) for k in shape]
    x, y = np.meshgrid(*t, indexing="ij")
    points = np.stack((x, y, x**2 + y**2 / 2), axis=-1).reshape(-1, 3)
    points = damaged_points(points, rng) if rng.random() < 0.5 else points
    return points.reshape(r, c, 3) if isinstance(points, np.ndarray) and points.size == 3 * r * c else points


# ---- open sides that coincide -----------------------------------------------------------------------------


def tube(n=16, m=7, scale=1.0, offset=0.0):
    """Around by along: the last row is the first one once more, but for rounding."""
    t, z = np.meshgrid(np.linspace(0, 2 * np.pi, n), np.linspace(0, 1, m), indexing="ij")
    return scale * np.stack((np.cos(t), np.sin(t), z), axis=-1) + offset


@pytest.mark.parametrize(("scale", "offset"), [(1, 0), (1e-6, 0), (1e6, 0), (1e-3, 1e3)])
@pytest.mark.parametrize("scheme", ["finite_volume", "bunge", "jet"])
@pytest.mark.parametrize("axis", [0, 1])
def test_open_sides_that_coincide_are_told_of_and_the_advice_works(axis, scheme, scale, offset):
    points = np.moveaxis(tube(scale=scale, offset=offset), 0, axis)
    name = ("rows", "columns")[axis]
    with pytest.warns(MeshWarning, match=f"first and the last of the {name} of points coincide") as said:
        qc.mean_curvature(QuadGrid(points), scheme)
    advice = str(said[0].message).split("; ")[1].removesuffix(" closes it")
    closed = eval(advice, {"QuadGrid": QuadGrid, "points": points})
    assert closed.wrap == (axis == 0, axis == 1)
    assert np.isfinite(qc.mean_curvature(closed, scheme)).all()

    mesh = QuadGrid(points).to_mesh()
    mesh = mesh.points, mesh.faces
    with pytest.warns(MeshWarning, match="14 boundary vertices lie where others do") as said:
        qc.mean_curvature(mesh, scheme)
    advice = str(said[0].message).split("; ")[1].removesuffix(" closes it")
    merged, _ = eval(advice, {"merge_points": qc.merge_points, "mesh": mesh})
    assert np.count_nonzero(~merged.stencils().closed) == 2 * 15
    assert np.abs(np.abs(qc.mean_curvature(merged, scheme)) * scale - 0.5).max() < 0.1


def test_a_torus_is_closed_both_ways():
    t = np.linspace(0, 2 * np.pi, 13)
    u, v = np.meshgrid(t, t, indexing="ij")
    points = np.stack(((2 + np.cos(u)) * np.cos(v), (2 + np.cos(u)) * np.sin(v), np.sin(u)), axis=-1)
    with pytest.warns(MeshWarning, match=r"QuadGrid\(points\[:-1, :-1\], wrap=\(True, True\)\) closes it"):
        qc.mean_curvature(QuadGrid(points))


def test_cells_whose_open_sides_coincide_are_told_of():
    corners = tube(33, 15)
    primal, dual = corners[1::2, 1::2], corners[::2, ::2]
    said = r"StaggeredGrid\(primal, dual, wrap=\(True, False\)\) closes it"
    with pytest.warns(MeshWarning, match=said):
        qc.mean_curvature(qc.StaggeredGrid(primal, dual))
    qc.mean_curvature(qc.StaggeredGrid(primal, dual, wrap=(True, False)))


def test_sides_that_are_only_near_are_not_told_of():
    points = tube()
    points[-1] *= 1 + 1e-4
    qc.mean_curvature(QuadGrid(points))
    hidden = np.zeros(points.shape[:2], bool)
    hidden[[0, -1]] = True  # sides of holes alone coincide nowhere
    qc.mean_curvature(QuadGrid(tube(), mask=hidden))
