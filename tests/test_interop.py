"""Meshes of trimesh, pyvista and MeshLab as ours and back; results where their users look for them."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
import pyvista as pv
import trimesh

import quadcurv as qc
from quadcurv import (
    MeshError,
    QuadGrid,
    QuadMesh,
    as_mesh,
    attach,
    mean_curvature,
    mean_curvature_normal,
    read,
    surfaces,
    write,
)
from quadcurv.mesh import Recovery

# Points in any order make faces that fold over: what is told of them is tested elsewhere.
pytestmark = pytest.mark.filterwarnings("ignore::quadcurv.ConsistencyWarning")

POINTS = np.pi * np.array(
    [[0, 0, 0], [1, 0, 0.1], [2, 0, 0], [0, 1, 0], [1, 1, 0.2], [2, 1, 0], [3, 0, 0.3], [3, 1, 0.1]]
)
MIXED = [[0, 1, 4, 3], [1, 2, 4], [2, 5, 4], [2, 6, 7, 5]]
SURFACES = [surfaces.torus(), surfaces.cubed_ellipsoid()]


@pytest.fixture
def mesh() -> QuadMesh:
    return QuadMesh(POINTS, MIXED)


@pytest.fixture
def meshlab():
    return pytest.importorskip("pymeshlab", exc_type=ImportError)


# ----------------------------------------------------------------------------------------- as_mesh


def test_what_is_ours_is_returned_as_it_is(mesh, torus):
    assert as_mesh(mesh) is mesh
    assert as_mesh(torus) is torus


def test_points_and_faces(mesh):
    np.testing.assert_array_equal(as_mesh((POINTS, MIXED)).faces, mesh.faces)


@pytest.mark.parametrize(
    "thing",
    [
        None,
        3,
        [POINTS, MIXED],
        POINTS,
        (POINTS, MIXED, None),
        trimesh.PointCloud(POINTS),
        trimesh.Scene(trimesh.PointCloud(POINTS)),
        trimesh.load_path([[0, 0, 0], [1, 1, 1]]),
        pv.ImageData(dimensions=(3, 3, 1)),
        pv.MultiBlock([pv.Plane()]),
    ],
    ids=lambda thing: type(thing).__name__,
)
def test_other_things_are_a_type_error(thing):
    with pytest.raises(TypeError, match=r"^mesh: .*expected"):
        as_mesh(thing)


def test_libraries_are_told_apart_without_importing_them():
    code = """
import sys, numpy as np, quadcurv
mesh = quadcurv.QuadMesh(np.eye(4, 3), [[0, 1, 2, 3]])
assert quadcurv.as_mesh(mesh) is mesh
quadcurv.as_mesh((np.eye(4, 3), [[0, 1, 2, 3]]))
try:
    quadcurv.as_mesh(object())
except TypeError:
    print(*sys.modules)
"""
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert not {"trimesh", "pyvista", "pymeshlab", "vtk", "vtkmodules", "igl"} & set(loaded.split())


def test_subclasses_are_recognised(mesh):
    class Mine(trimesh.Trimesh):
        pass

    class Yours(pv.PolyData):
        pass

    assert as_mesh(Mine(POINTS, [[0, 1, 4, 3]], process=False)).faces.tolist() == [[0, 1, 4, 3]]
    np.testing.assert_array_equal(as_mesh(Yours(qc.to_pyvista(mesh))).faces, mesh.faces)


# ----------------------------------------------------------------------------------------- trimesh


@pytest.mark.parametrize("process", [True, False])
@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: s.name)
def test_a_quad_file_gives_the_same_quads_through_trimesh(tmp_path, surface, suffix, process):
    quads = surface.sample((5, 6), "faces")[0]
    write(tmp_path / f"quads.{suffix}", quads)
    found = qc.as_mesh(trimesh.load_mesh(tmp_path / f"quads.{suffix}", process=process))
    np.testing.assert_array_equal(found.faces, quads.faces)
    np.testing.assert_array_equal(found.points, quads.points)
    assert found.recovery == Recovery("ply" if suffix == "ply" else "block", 1.0)


def ascii_ply(path, mesh):
    """PLY as trimesh can read it with faces of several sizes."""
    faces = [[v for v in face if v >= 0] for face in mesh.faces.tolist()]
    path.write_text(
        f"ply\nformat ascii 1.0\nelement vertex {len(mesh.points)}\n"
        "property double x\nproperty double y\nproperty double z\n"
        f"element face {len(faces)}\nproperty list uchar int vertex_index\nend_header\n"
        + "".join(" ".join(map(repr, p)) + "\n" for p in mesh.points.tolist())
        + "".join(" ".join(map(str, (len(f), *f))) + "\n" for f in faces)
    )


@pytest.mark.parametrize(("suffix", "rule"), [("obj", "interleaved"), ("off", "block"), ("ply", "ply")])
def test_a_quad_dominant_file_gives_the_same_faces_through_trimesh(tmp_path, mesh, suffix, rule):
    path = tmp_path / f"mixed.{suffix}"
    (ascii_ply if suffix == "ply" else write)(path, mesh)
    found = qc.as_mesh(trimesh.load_mesh(path))
    assert found.recovery == Recovery(rule, 4 / 6)
    assert sorted(found.faces.tolist()) == sorted(mesh.faces.tolist())


def test_polygons_of_a_ply_file_come_back_through_trimesh(tmp_path):
    points = [[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 2, 0], [0, 1, 0], [0, 0, 1]]
    header = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
    header += "element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    body = "".join(" ".join(map(str, p)) + "\n" for p in points) + "5 0 1 2 3 4\n4 0 4 5 1\n"
    (tmp_path / "a.ply").write_text(header + body)
    found = as_mesh(trimesh.load_mesh(tmp_path / "a.ply"))
    assert found.report["cut"] == 1
    assert found.recovery == Recovery("ply", 2 / 5)


def test_triangles_that_are_no_longer_those_of_the_ply_file(tmp_path):
    quads = surfaces.torus().sample((5, 6), "faces")[0]
    write(tmp_path / "a.ply", quads)
    loaded = trimesh.load_mesh(tmp_path / "a.ply")
    loaded.update_faces(np.arange(len(loaded.faces)) != 7)
    found = as_mesh(loaded)
    assert found.recovery == Recovery("diagonal", 58 / 59)
    assert len(found.faces) == 30  # half of quad 7 is left, a triangle
    assert np.flatnonzero(found.faces[:, 3] < 0).size == 1


def test_quads_given_to_trimesh_or_by_the_caller(mesh):
    given = trimesh.Trimesh(POINTS, [[0, 1, 4, 3], [2, 6, 7, 5]], process=False)
    assert as_mesh(given).recovery == Recovery("block", 1.0)
    assert as_mesh(given).faces.tolist() == [[0, 1, 4, 3], [2, 6, 7, 5]]
    # The caller's word comes first, even against the order.
    found = qc.as_mesh(given, quads=[[1, 4, 3, 0], [6, 7, 5]])
    assert found.faces.tolist() == [[1, 4, 3, 0], [6, 7, 5, -1]]
    assert found.recovery == Recovery("given", 0.5)
    with pytest.raises(MeshError, match=r"outside 0\.\.7"):
        qc.as_mesh(given, quads=[[1, 4, 3, 8]])
    assert QuadMesh(given.vertices, given.faces).faces[:, 3].max() == -1


@pytest.mark.parametrize("change", ["none", "copy", "shuffle", "invert", "scale", "join"])
def test_what_to_trimesh_leaves_finds_the_quads_again(mesh, rng, change):
    out = qc.to_trimesh(mesh)
    np.testing.assert_array_equal(out.vertices, mesh.points)
    faces = mesh.faces
    if change == "copy":
        out = out.copy()
    elif change == "shuffle":
        out.update_faces(rng.permutation(len(out.faces)))
    elif change == "invert":
        out.invert()
        faces = np.where(faces < 0, -1, np.c_[faces[:, 2::-1], faces[:, 3]])
    elif change == "scale":
        out.apply_scale(2.0)
    elif change == "join":
        out = trimesh.util.concatenate([out, out])
        faces = np.repeat(faces, 2, axis=0)
        faces[1::2] += np.where(faces[1::2] < 0, 0, len(POINTS))
    with pytest.warns(UserWarning, match="merge_points") if change == "join" else _quiet():
        found = as_mesh(out)
    np.testing.assert_array_equal(found.faces, faces)
    assert found.recovery == Recovery("carrier", 4 / 6)


def _quiet():
    import contextlib

    return contextlib.nullcontext()


def test_genuine_triangles_stay_triangles():
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=2.0)
    found = as_mesh(sphere)
    assert found.recovery == Recovery("none", 0.0)
    np.testing.assert_array_equal(found.faces[:, :3], sphere.faces)
    np.testing.assert_allclose(mean_curvature(sphere, "liu"), 0.5, rtol=0.14)


def test_a_trimesh_is_not_changed(mesh):
    given = trimesh.Trimesh(POINTS, [[0, 1, 4, 3], [2, 6, 7, 5]], process=False)
    before = given.identifier_hash, given.vertices.copy(), given.faces.copy()
    mean_curvature(given, "finite_volume", boundary="nan")
    assert given.identifier_hash == before[0]
    np.testing.assert_array_equal(given.faces, before[2])
    given.vertices += 1.0  # not frozen either
    out = qc.to_trimesh(mesh)
    out.vertices += 1.0
    np.testing.assert_array_equal(mesh.points, POINTS)


def test_a_scene_of_one_mesh_is_taken_where_it_stands(mesh):
    turn = trimesh.transformations.rotation_matrix(0.3, [1, 2, 3])
    turn[:3, 3] = 1, 2, 3
    scene = trimesh.Scene()
    scene.add_geometry(qc.to_trimesh(mesh), transform=turn)
    found = as_mesh(scene)
    np.testing.assert_allclose(found.points, POINTS @ turn[:3, :3].T + turn[:3, 3], rtol=0, atol=1e-14)
    np.testing.assert_array_equal(found.faces, mesh.faces)
    scene.add_geometry(qc.to_trimesh(mesh))
    with pytest.raises(MeshError, match="a Scene of 2 geometries, expected one; to_mesh"):
        as_mesh(scene)
    with pytest.raises(MeshError, match=r"a Scene of 0 geometries, expected one$"):
        as_mesh(trimesh.Scene())


def test_an_empty_or_damaged_trimesh():
    with pytest.raises(MeshError, match="none given"):
        as_mesh(trimesh.Trimesh())
    with pytest.raises(MeshError, match="1 non-finite point"):
        as_mesh(trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, np.nan, 0]], [[0, 1, 2]], process=False))
    for bad in (-1, 99, 2**32 + 1):
        broken = trimesh.Trimesh(POINTS, [[0, 1, 4], [4, bad, 0]], process=False)
        with pytest.raises(MeshError, match=r"outside 0\.\.7, first face"):
            as_mesh(broken)


# ----------------------------------------------------------------------------------------- pyvista


def test_polydata_both_ways(mesh):
    data = qc.to_pyvista(mesh)
    assert data.points.dtype == np.float64
    np.testing.assert_array_equal(data.faces, [4, 0, 1, 4, 3, 3, 1, 2, 4, 3, 2, 5, 4, 4, 2, 6, 7, 5])
    for found in (as_mesh(data), qc.as_mesh(data)):
        np.testing.assert_array_equal(found.points, POINTS)
        np.testing.assert_array_equal(found.faces, mesh.faces)
        assert found.recovery is None
    data.points += 1.0
    np.testing.assert_array_equal(mesh.points, POINTS)


def test_polydata_of_every_kind(mesh):
    regular = pv.PolyData.from_regular_faces(POINTS, np.array([[0, 1, 4, 3], [2, 6, 7, 5]]))
    assert as_mesh(regular).faces.tolist() == [[0, 1, 4, 3], [2, 6, 7, 5]]
    pentagon = pv.PolyData(POINTS, [5, 0, 1, 2, 5, 3])
    assert as_mesh(pentagon).report["cut"] == 1
    single = qc.to_pyvista(mesh)
    single.points = single.points.astype(np.float32)
    np.testing.assert_array_equal(as_mesh(single).points, POINTS.astype(np.float32))
    # Quads that were triangulated on purpose stay triangles.
    assert (as_mesh(regular.triangulate()).faces[:, 3] == -1).all()
    raw = pv.PolyData(regular)
    assert as_mesh(pv._vtk.vtkPolyData.SafeDownCast(raw)).faces.tolist() == as_mesh(regular).faces.tolist()


def test_unstructured_grids_of_polygons(mesh):
    pixels = pv.ImageData(dimensions=(3, 3, 1)).cast_to_unstructured_grid()
    assert as_mesh(pixels).faces.tolist() == [[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]]
    grid = qc.to_pyvista(mesh).cast_to_unstructured_grid()
    np.testing.assert_array_equal(as_mesh(grid).faces, mesh.faces)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (
            lambda: pv.ImageData(dimensions=(2, 2, 2)).cast_to_unstructured_grid(),
            "first cell 0 of VTK type 11",
        ),
        (lambda: pv.PolyData(POINTS), "faces: none given"),
        (lambda: pv.PolyData(POINTS, lines=[2, 0, 1]), "faces: none given"),
        (lambda: pv.PolyData(), "none given"),
        (lambda: pv.Plane().triangulate().strip(), r"triangle strip\(s\); triangulate"),
        (lambda: pv.PolyData(POINTS, [3, 0, 1, 99]), r"outside 0\.\.7"),
        (lambda: pv.StructuredGrid(*np.mgrid[:3, :3, :3].astype(float)), r"\(3, 3, 3\), expected one layer"),
        (lambda: pv.StructuredGrid(*np.mgrid[:3, :1, :1].astype(float)), r"\(3, 1, 1\), expected one layer"),
        (lambda: pv.StructuredGrid(), "expected one layer"),
    ],
    ids=["volume", "vertices", "line", "empty", "strips", "index", "3d", "1d", "empty grid"],
)
def test_pyvista_data_that_is_no_surface(data, message):
    with pytest.raises(MeshError, match=message):
        as_mesh(data())


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_structured_grids_whatever_the_axis_of_one_layer(axis, rng):
    points = rng.standard_normal((5, 6, 3))
    data = pv.StructuredGrid(*np.moveaxis(np.expand_dims(points, axis), -1, 0))
    grid = as_mesh(data)
    assert isinstance(grid, QuadGrid)
    np.testing.assert_array_equal(grid.points, points)
    # VTK's own quads, its own way round.
    ours = data.points.reshape(6, 5, 3).swapaxes(0, 1)
    np.testing.assert_array_equal(ours, points)
    cells = np.array([data.get_cell(k).point_ids for k in range(data.n_cells)])
    mine = np.swapaxes(np.arange(30).reshape(6, 5), 0, 1).ravel()[grid.to_mesh().faces]
    assert {tuple(np.roll(c, -np.argmin(c))) for c in cells} == {
        tuple(np.roll(f, -np.argmin(f))) for f in mine
    }


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (False, True), (True, True)])
def test_grids_both_ways(wrap, rng):
    grid = QuadGrid(rng.standard_normal((5, 6, 3)), wrap)
    data = qc.to_pyvista(grid)
    assert data.dimensions == (5 + wrap[0], 6 + wrap[1], 1)
    found = qc.as_mesh(data, wrap=wrap)
    assert found.wrap == wrap
    np.testing.assert_array_equal(found.points, grid.points)


def test_seams_of_grids_are_reported_and_closed_on_request(torus):
    data = qc.to_pyvista(torus)
    with pytest.warns(UserWarning, match="coincide: it is open along a seam") as warned:
        as_mesh(data)
    assert [str(w.message).split()[3] for w in warned] == ["rows", "columns"]
    open_ = qc.to_pyvista(QuadGrid(np.random.default_rng(0).random((4, 5, 3))))
    with pytest.raises(MeshError, match=r"first and last columns differ by .* although they wrap"):
        qc.as_mesh(open_, wrap=(False, True))


@pytest.mark.parametrize(
    ("thing", "kind"),
    [
        (lambda: QuadMesh(POINTS, MIXED), "QuadMesh"),
        (lambda: surfaces.torus().sample((4, 5))[0], "QuadGrid"),
        (lambda: (POINTS, MIXED), "tuple"),
        (lambda: pv.Plane(), "mesh that has its own"),
        (lambda: qc.to_pyvista(QuadGrid(np.random.default_rng(0).random((4, 5, 3)))), "StructuredGrid"),
    ],
    ids=["QuadMesh", "QuadGrid", "tuple", "PolyData", "StructuredGrid"],
)
def test_quads_are_for_a_trimesh_alone(thing, kind):
    with pytest.raises(TypeError, match=f"quads: only a Trimesh has triangles .*, not a {kind}"):
        as_mesh(thing(), quads=[[0, 1, 4, 3]])


@pytest.mark.parametrize(
    ("thing", "kind"),
    [
        (lambda: QuadMesh(POINTS, MIXED), "QuadMesh"),
        (lambda: surfaces.torus().sample((4, 5))[0], "QuadGrid"),
        (lambda: (POINTS, MIXED), "tuple"),
        (lambda: pv.Plane(), "face list"),
        (lambda: trimesh.creation.box(), "face list"),
    ],
    ids=["QuadMesh", "QuadGrid", "tuple", "PolyData", "Trimesh"],
)
def test_wrap_is_for_a_structured_grid_alone(thing, kind):
    with pytest.raises(TypeError, match=f"wrap: only a StructuredGrid has .*, not a {kind}"):
        as_mesh(thing(), wrap=(True, False))


def test_seams_of_face_lists_are_reported():
    points, faces = np.concatenate((POINTS, POINTS[[1, 4]] + 1e-7)), [[0, 1, 4, 3], [8, 2, 5, 9]]
    with pytest.warns(UserWarning, match=r"4 boundary vertices .* to 1\.7e-07, first vertices 1 and 8"):
        as_mesh(pv.PolyData.from_regular_faces(points, np.array(faces)))


# --------------------------------------------------------------------------------------- pymeshlab


def test_meshlab_both_ways_in_double(meshlab, mesh):
    meshes = qc.to_pymeshlab(mesh)
    np.testing.assert_array_equal(meshes.current_mesh().vertex_matrix(), POINTS)
    for found in (as_mesh(meshes), as_mesh(meshes.current_mesh()), qc.as_mesh(meshes)):
        np.testing.assert_array_equal(found.points, POINTS)
        assert [sorted(f) for f in found.faces.tolist()] == [sorted(f) for f in mesh.faces.tolist()]
    H, ours = (
        mean_curvature(meshes, "finite_volume", boundary="nan"),
        mean_curvature(mesh, "finite_volume", boundary="nan"),
    )
    np.testing.assert_allclose(H, ours, rtol=0, atol=1e-12)


def test_a_meshlab_mesh_is_taken_where_it_stands(meshlab, mesh):
    meshes = qc.to_pymeshlab(mesh)
    meshes.compute_matrix_from_translation(traslmethod=0, axisx=1.0, axisy=2.0, axisz=3.0, freeze=False)
    np.testing.assert_allclose(as_mesh(meshes).points, POINTS + np.array([1, 2, 3]), rtol=0, atol=1e-14)


def test_meshlab_meshes_that_are_none(meshlab):
    with pytest.raises(MeshError, match="an empty MeshSet"):
        as_mesh(meshlab.MeshSet())
    with pytest.raises(MeshError, match="faces: none given"):
        as_mesh(meshlab.Mesh(POINTS))
    with pytest.raises(TypeError, match=r"expected a pymeshlab.MeshSet or Mesh, got"):
        as_mesh(meshlab.PercentageValue(3))


def test_without_meshlab_its_extra_is_named(monkeypatch, mesh):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(ImportError, match=r'pip install "quadcurv\[meshlab\]"'):
        qc.to_pymeshlab(mesh)


# ------------------------------------------------------------------------------------------ attach


def test_results_in_trimesh():
    quads = surfaces.torus().sample((8, 6), "faces")[0]
    out = qc.to_trimesh(quads)
    H, Hn = mean_curvature(out, "finite_volume"), mean_curvature_normal(out, "finite_volume")
    attach(out, "H", H)
    attach(out, "Hn", Hn)
    np.testing.assert_array_equal(out.vertex_attributes["H"], H)
    np.testing.assert_array_equal(out.vertex_attributes["Hn"], Hn)
    colours = np.asarray(out.visual.vertex_colors)
    assert colours[np.argmin(H)].tolist() == [68, 1, 84, 255]
    assert colours[np.argmax(H)].tolist() == [253, 231, 36, 255]
    H[3] = np.nan
    attach(out, "H", H, colormap="cividis")
    assert np.asarray(out.visual.vertex_colors)[3].tolist() == [128, 128, 128, 255]
    visual = out.visual
    attach(out, "again", H, colormap=None)
    assert out.visual is visual
    attach(out, "constant", np.ones(48))
    attach(out, "nothing", np.full(48, np.inf))
    with pytest.raises(ValueError, match="matplotlib has no 'rainbows'"):
        attach(out, "H", H, colormap="rainbows")


def test_results_in_pyvista(mesh):
    data = qc.to_pyvista(mesh)
    values = np.arange(8.0)
    attach(data, "H", values)
    attach(data, "Hn", np.ones((8, 3)))
    assert data.active_scalars_name == "H"
    assert data.active_vectors_name == "Hn"
    values[:] = 0
    assert data["H"].tolist() == list(range(8))


@pytest.mark.parametrize("wrap", [(False, False), (True, False), (True, True)])
def test_results_in_structured_grids(rng, wrap):
    grid = QuadGrid(rng.standard_normal((7, 6, 3)), wrap)
    data = qc.to_pyvista(grid)
    attach(data, "H", mean_curvature(grid, "finite_volume"))
    attach(data, "Hn", mean_curvature_normal(grid, "finite_volume"))
    attach(data, "at", grid.points)
    np.testing.assert_array_equal(data["at"], data.points)
    np.testing.assert_array_equal(data["Hn"].shape, data.points.shape)
    attach(data, "flat", data["H"])
    np.testing.assert_array_equal(data["flat"], data["H"])
    i, j = 4, 3
    assert data["H"][i + data.dimensions[0] * j] == mean_curvature(grid, "finite_volume")[i, j]


def test_results_in_meshlab(meshlab, mesh):
    meshes = qc.to_pymeshlab(mesh)
    H = np.pi * np.arange(8.0)
    H[2] = np.nan
    attach(meshes, "H", H)
    attach(meshes, "Hn", POINTS)
    found = meshes.current_mesh()
    np.testing.assert_array_equal(found.vertex_custom_scalar_attribute_array("H"), H)
    np.testing.assert_array_equal(found.vertex_scalar_array(), H)
    np.testing.assert_array_equal(found.vertex_custom_point_attribute_matrix("Hn"), POINTS)
    attach(found, "K", -H)
    np.testing.assert_array_equal(found.vertex_custom_scalar_attribute_array("K"), -H)
    np.testing.assert_array_equal(found.vertex_scalar_array(), H)
    with pytest.raises(MeshError, match=r"MeshLab refuses 'H': .*already has"):
        attach(meshes, "H", H)
    with pytest.raises(MeshError, match="letters, digits and underscores for MeshLab, got 'mean curvature'"):
        attach(meshes, "mean curvature", H)


def test_results_that_do_not_fit(meshlab, mesh):
    grid = qc.to_pyvista(QuadGrid(np.random.default_rng(0).random((7, 6, 3))))
    for target, n in (
        (qc.to_trimesh(mesh), 8),
        (qc.to_pyvista(mesh), 8),
        (qc.to_pymeshlab(mesh), 8),
        (grid, 42),
    ):
        with pytest.raises(MeshError, match=rf"H: shape \(7,\), expected \({n},\) or \({n}, 3\)"):
            attach(target, "H", np.zeros(7))
        with pytest.raises(MeshError, match="H: expected real numbers"):
            attach(target, "H", np.full(n, "a"))
        with pytest.raises(TypeError, match="name: expected a word"):
            attach(target, 3, np.zeros(n))
    with pytest.raises(MeshError, match=r"shape \(4, 6\) does not fit a grid of \(7, 6\) points"):
        attach(grid, "H", np.zeros((4, 6)))
    for target in (mesh, "mesh.obj", trimesh.Scene(), pv.ImageData()):
        with pytest.raises(TypeError, match=r"^mesh: expected"):
            attach(target, "H", np.zeros(8))


# -------------------------------------------------------------------------------------- real meshes


@pytest.mark.parametrize(
    "name",
    ["spot_quadrangulated", "spot_control_mesh", "fish_control_mesh", "penguin_control_mesh", "quadknot"],
)
def test_real_meshes_through_every_library(shared_meshes, tmp_path, meshlab, name):
    path = shared_meshes / f"{name}.obj"
    mesh = read(path)
    H = mean_curvature(mesh, "liu", "nan")
    kept = trimesh.Trimesh(mesh.points, process=False)
    kept.faces = trimesh.geometry.triangulate_quads([[v for v in f if v >= 0] for f in mesh.faces.tolist()])
    for other in (qc.to_trimesh(mesh), qc.to_pyvista(mesh), qc.to_pymeshlab(mesh), kept):
        found = mean_curvature(other, "liu", "nan")
        np.testing.assert_allclose(found, H, rtol=0, atol=1e-9 * np.nanmax(np.abs(H)))
    for suffix in ("obj", "off", "ply", "vtp"):
        write(tmp_path / f"a.{suffix}", mesh)
        np.testing.assert_array_equal(mean_curvature(tmp_path / f"a.{suffix}", "liu", "nan"), H)
