"""Reading and writing: every cell of the tables in the docstrings of read and write."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import pyvista as pv
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv import (
    MeshError,
    QuadGrid,
    QuadMesh,
    StaggeredGrid,
    as_mesh,
    mean_curvature,
    read,
    surfaces,
    vertex_normals,
    write,
)
from quadcurv.io.base import polygons
from quadcurv.io.ply import read_ply
from quadcurv.ragged import Faces

SINGLE = np.finfo(np.float32).eps
# Two quads and two triangles of irrational positions, the faces' kinds mixed.
POINTS = np.pi * np.array(
    [[0, 0, 0], [1, 0, 0.1], [2, 0, 0], [0, 1, 0], [1, 1, 0.2], [2, 1, 0], [3, 0, 0.3], [3, 1, 0.1]]
)
FACES = [[0, 1, 4, 3], [1, 2, 5], [5, 4, 1], [2, 6, 7, 5]]
PENTAGON = (
    [[0, 0, 0], [2, 0, 0], [3, 1, 0], [1, 2, 0], [0, 1, 0], [0.5, 0.5, 1]],
    [[0, 1, 2, 3, 4], [0, 4, 5]],
)


@pytest.fixture
def mesh() -> QuadMesh:
    return QuadMesh(POINTS, FACES)


def obj(points, faces, corner="{}"):
    lines = ["v {!r} {!r} {!r}".format(*map(float, p)) for p in points]
    lines += ["f " + " ".join(corner.format(v + 1) for v in face) for face in faces]
    return "\n".join(lines)


def off(points, faces, header="OFF\n{} {} 0", colour=""):
    lines = [header.format(len(points), len(faces))]
    lines += ["{!r} {!r} {!r}".format(*map(float, p)) for p in points]
    lines += [f"{len(face)} " + " ".join(map(str, face)) + colour for face in faces]
    return "\n".join(lines)


def ply(points, faces, form="ascii", real="double", index="int", extra=""):
    """A PLY file of any kind; `extra` is a scalar property before x, and one after the face's list."""
    order = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    header = f"ply\nformat {form} 1.0\ncomment made by hand\nelement vertex {len(points)}\n"
    header += f"property {extra} before\n" * bool(extra)
    header += "".join(f"property {real} {k}\n" for k in "xyz")
    header += f"element face {len(faces)}\nproperty list uchar {index} vertex_indices\n"
    header += f"property {extra} after\n" * bool(extra)
    header += "element edge 1\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    if not order:
        body = "".join("7 " * bool(extra) + " ".join(repr(float(x)) for x in p) + "\n" for p in points)
        body += "".join(" ".join(map(str, (len(f), *f))) + " 9" * bool(extra) + "\n" for f in faces)
        return (header + body + "0 1\n").encode()
    code = {"double": "d", "float": "f", "int": "i", "uint": "I", "ushort": "H", "uchar": "B"}
    more = code[extra] if extra else ""
    body = b"".join(struct.pack(f"{order}{more}3{code[real]}", *[7] * bool(extra), *p) for p in points)
    for face in faces:
        form_ = f"{order}B{len(face)}{code[index]}{more}"
        body += struct.pack(form_, len(face), *face, *[9] * bool(extra))
    return header.encode() + body + struct.pack(f"{order}2i", 0, 1)


def with_text(path, text):
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


# ---------------------------------------------------------------------------------------------- read


@pytest.mark.parametrize("faces", [FACES, [[0, 1, 4, 3], [2, 6, 7, 5]]], ids=["mixed", "quads"])
@pytest.mark.parametrize(
    ("suffix", "text"),
    [
        ("obj", obj),
        ("off", off),
        ("ply", ply),
        ("ply", lambda p, f: ply(p, f, "binary_little_endian")),
        ("ply", lambda p, f: ply(p, f, "binary_big_endian", index="uint", extra="float")),
        ("ply", lambda p, f: ply(p, f, "ascii", extra="uchar")),
    ],
    ids=["obj", "off", "ply-ascii", "ply-little", "ply-big", "ply-more-properties"],
)
def test_text_and_ply_files_keep_quads_and_every_digit(tmp_path, suffix, text, faces):
    read_back = read(with_text(tmp_path / f"mesh.{suffix}", text(POINTS, faces)))
    np.testing.assert_array_equal(read_back.points, POINTS)
    np.testing.assert_array_equal(read_back.faces, QuadMesh(POINTS, faces).faces)


@pytest.mark.parametrize("form", ["binary_little_endian", "ascii"])
def test_ply_of_single_precision_stays_single(tmp_path, form):
    points = POINTS.astype(np.float32)
    read_back = read(with_text(tmp_path / "mesh.ply", ply(points, FACES, form, "float", "ushort")))
    np.testing.assert_array_equal(read_back.points, points)


@pytest.mark.parametrize(("suffix", "text"), [("obj", obj), ("off", off), ("ply", ply)])
def test_polygons_are_kept_and_split_by_us(tmp_path, suffix, text):
    mesh = read(with_text(tmp_path / f"mesh.{suffix}", text(*PENTAGON)))
    assert mesh.report["cut"] == 1
    assert mesh.face_source.tolist() == [0, 0, 0, 1]


def test_obj_texture_seams_do_not_split_vertices(tmp_path):
    text = obj(POINTS, FACES, "{0}/1/2") + "\nvt 0 0\nvt 1 1\nvn 0 0 1\n"
    seam = text.replace("f 2/1/2 3/1/2", "f 2/2/2 3/2/2")
    assert len(read(with_text(tmp_path / "mesh.obj", seam)).points) == len(POINTS)
    np.testing.assert_array_equal(read(tmp_path / "mesh.obj").faces, QuadMesh(POINTS, FACES).faces)


def test_obj_counts_back_continues_lines_and_ignores_the_rest(tmp_path):
    text = "# é\nmtllib a.mtl\nv 0 0 0\nv 1 0 0 1\nv 1 1 0 0.5 0.5 0.5\nv 0 1 0\ns off\n"
    text += "f -4 -3 \\\n -2 -1 # quad\n"
    mesh = read(with_text(tmp_path / "mesh.obj", text.encode("latin-1")))
    assert mesh.faces.tolist() == [[0, 1, 2, 3]]


@pytest.mark.parametrize(
    ("header", "colour"),
    [("OFF {} {} 0", ""), ("# made\nOFF # by hand\n\n{} {}\n", ""), ("COFF\n{} {} 0", " 255 0 0")],
)
def test_off_headers(tmp_path, header, colour):
    mesh = read(with_text(tmp_path / "mesh.off", off(POINTS, FACES, header, colour)))
    np.testing.assert_array_equal(mesh.faces, QuadMesh(POINTS, FACES).faces)


@pytest.mark.parametrize("suffix", ["vtp", "vtk", "vtu"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_vtk_files_keep_quads_and_their_own_precision(tmp_path, mesh, suffix, dtype):
    data = qc.to_pyvista(mesh)
    data.points = data.points.astype(dtype)
    (data.cast_to_unstructured_grid() if suffix == "vtu" else data).save(tmp_path / f"mesh.{suffix}")
    read_back = read(tmp_path / f"mesh.{suffix}")
    np.testing.assert_array_equal(read_back.points, POINTS.astype(dtype))
    np.testing.assert_array_equal(read_back.faces, mesh.faces)


@pytest.mark.parametrize("suffix", ["vts", "vtk"])
def test_vtk_files_of_grids(tmp_path, suffix):
    grid = surfaces.catenoid().sample((5, 6))[0]
    with pytest.warns(UserWarning, match="last columns") if grid.wrap[1] else _nothing():
        qc.to_pyvista(grid).save(tmp_path / f"grid.{suffix}")
        read_back = read(tmp_path / f"grid.{suffix}")
    assert isinstance(read_back, QuadGrid)
    r, c = grid.shape
    np.testing.assert_array_equal(read_back.points[:r, :c], grid.points)


def _nothing():
    import contextlib

    return contextlib.nullcontext()


def test_stl_corners_are_merged(tmp_path, mesh):
    triangles = qc.to_trimesh(mesh).faces[[2, 3, 5, 0, 4, 1]]  # in no order that tells of quads
    trimesh.Trimesh(POINTS * 1e-9, triangles, process=False).export(tmp_path / "mesh.stl")
    read_back = read(tmp_path / "mesh.stl")
    assert read_back.points.shape == POINTS.shape
    assert np.abs(np.sort(read_back.points, axis=0) - np.sort(POINTS, axis=0) * 1e-9).max() < SINGLE * 1e-8
    assert (read_back.faces[:, 3] < 0).sum() == len(read_back.faces) == 6
    assert read_back.roundoff == SINGLE / 2


def test_glb_is_single_precision_and_its_quads_are_found_again(tmp_path, mesh):
    write(tmp_path / "mesh.glb", mesh)
    read_back = read(tmp_path / "mesh.glb")
    assert 0 < np.abs(read_back.points - POINTS).max() < SINGLE * 3 * np.pi
    assert read_back.recovery == ("block", 4 / 6)
    assert {*map(tuple, read_back.faces.tolist())} == {*map(tuple, mesh.faces.tolist())}


# --------------------------------------------------------------------------------------------- write


@pytest.mark.parametrize("suffix", ["ply", "vtp", "obj", "off"])
def test_what_is_written_with_quads_comes_back_exactly(tmp_path, mesh, suffix):
    write(tmp_path / f"mesh.{suffix}", mesh)
    read_back = read(tmp_path / f"mesh.{suffix}")
    np.testing.assert_array_equal(read_back.points, mesh.points)
    np.testing.assert_array_equal(read_back.faces, mesh.faces)


@pytest.fixture
def values(mesh):
    n = len(mesh.points)
    return {
        "H": np.where(np.arange(n) == 2, np.nan, np.pi * np.arange(n)),
        "normal": vertex_normals(mesh),
        "flow": np.pi * np.arange(3 * n).reshape(n, 3),
        "valence": np.arange(n),
        "regular": np.arange(n) % 2 == 0,
    }


def test_ply_values_are_double_and_keep_their_kind(tmp_path, mesh, values):
    write(tmp_path / "mesh.ply", mesh, values)
    # trimesh keeps the vertex table only where all faces have the same size.
    write(tmp_path / "quads.ply", QuadMesh(POINTS, [[0, 1, 4, 3], [2, 6, 7, 5]]), values)
    stored = trimesh.load_mesh(tmp_path / "quads.ply", process=False).metadata["_ply_raw"]["vertex"]["data"]
    np.testing.assert_array_equal(stored["H"], values["H"])
    np.testing.assert_array_equal([stored[k] for k in ("nx", "ny", "nz")], values["normal"].T)
    np.testing.assert_array_equal([stored[f"flow_{k}"] for k in "xyz"], values["flow"].T)
    assert stored["H"].dtype == np.float64
    assert stored["valence"].dtype == np.int32
    assert stored["regular"].dtype == np.uint8
    assert stored["valence"].tolist() == values["valence"].tolist()
    np.testing.assert_array_equal(read(tmp_path / "mesh.ply").faces, mesh.faces)


def test_ply_quality_is_meshlabs_vertex_scalar_in_double(tmp_path, mesh, values):
    pymeshlab = pytest.importorskip("pymeshlab", exc_type=ImportError)
    write(tmp_path / "mesh.ply", mesh, {"H": values["H"], "quality": values["valence"] / 3})
    meshes = pymeshlab.MeshSet()
    meshes.load_new_mesh(str(tmp_path / "mesh.ply"))
    found = meshes.current_mesh()
    np.testing.assert_array_equal(found.vertex_matrix(), mesh.points)
    np.testing.assert_array_equal(found.vertex_scalar_array(), values["valence"] / 3)


def test_vtp_values_stay_as_they_are(tmp_path, mesh, values):
    write(tmp_path / "mesh.vtp", mesh, {**values, "single": values["flow"].astype(np.float32)})
    stored = pv.read(tmp_path / "mesh.vtp").point_data
    for name, given_ in values.items():
        np.testing.assert_array_equal(stored[name], given_)
        assert stored[name].dtype == given_.dtype
    assert stored["single"].dtype == np.float32


def test_glb_values_are_single_and_the_first_scalars_are_colours(tmp_path, mesh, values):
    data = {
        "normal": np.nan_to_num(values["normal"]),
        "H": np.nan_to_num(values["H"]),
        "valence": values["valence"],
    }
    write(tmp_path / "mesh.glb", mesh, data)
    (found,) = trimesh.load_scene(tmp_path / "mesh.glb", process=False).geometry.values()
    for name, given_ in data.items():
        stored = found.vertex_attributes[f"_{name}"]
        assert stored.dtype == np.float32
        np.testing.assert_array_equal(stored.reshape(given_.shape), given_.astype(np.float32))
    colours = np.asarray(found.visual.vertex_colors)
    assert colours[0].tolist() == colours[2].tolist() == [68, 1, 84, 255]  # viridis at H = 0
    assert colours[-1].tolist() == [253, 231, 36, 255]


@pytest.mark.parametrize(
    ("suffix", "data", "message"),
    [
        ("obj", {"H": np.zeros(8)}, r"\.obj holds no values"),
        ("off", {"H": np.zeros(8)}, r"\.off holds no values"),
        ("glb", {"H": np.full(8, 1e39)}, "H: 8 values beyond single precision"),
        ("ply", {"H": np.zeros(7)}, r"H: shape \(7,\), expected \(8,\) or \(8, 3\)"),
        ("ply", {"H": np.zeros((8, 2))}, r"H: shape \(8, 2\)"),
        ("ply", {"H": np.zeros(8, complex)}, "H: expected real numbers, got dtype complex128"),
        ("ply", {"x": np.zeros(8)}, r"names \['x'\] repeat"),
        ("ply", {"a": np.zeros((8, 3)), "a_x": np.zeros(8)}, "repeat each other's"),
        ("ply", {"mean curvature": np.zeros(8)}, "'mean curvature' is no PLY name"),
        ("step", {}, r"mesh\.step: cannot write \.step"),
    ],
)
def test_what_cannot_be_written(tmp_path, mesh, suffix, data, message):
    with pytest.raises(MeshError, match=message):
        write(tmp_path / f"mesh.{suffix}", mesh, data)
    assert not (tmp_path / f"mesh.{suffix}").exists()


@pytest.mark.filterwarnings("ignore:the first and the last:quadcurv.MeshWarning")  # open where it could wrap
def test_a_nameless_value_or_a_staggered_grid_is_refused(tmp_path, mesh):
    with pytest.raises(TypeError, match="name: expected a word, got ''"):
        write(tmp_path / "mesh.ply", mesh, {"": np.zeros(8)})
    grid = StaggeredGrid(np.zeros((2, 2, 3)) + np.arange(2)[:, None, None], np.zeros((3, 3, 3)))
    with pytest.raises(MeshError, match="a StaggeredGrid is no face list"):
        write(tmp_path / "mesh.ply", grid)


def test_a_grid_is_written_row_by_row(tmp_path, torus):
    H = mean_curvature(torus, "finite_volume")
    write(tmp_path / "grid.vtp", torus, {"H": H})
    data = pv.read(tmp_path / "grid.vtp")
    np.testing.assert_array_equal(data.points, torus.points.reshape(-1, 3))
    np.testing.assert_array_equal(data["H"], H.ravel())
    np.testing.assert_allclose(
        mean_curvature(data, "finite_volume").reshape(torus.shape), H, rtol=0, atol=1e-12
    )
    with pytest.raises(MeshError, match=r"H: shape \(154,\), expected \(14, 11\)"):
        write(tmp_path / "grid.vtp", torus, {"H": H.ravel()})


# ----------------------------------------------------------------------------------------- bad files


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.obj", "v 0 0\n", r"a\.obj: line 1: 'v 0 0' is not OBJ"),
        ("a.obj", "v 0 0 0\nf 1 x 3\n", "line 2: 'f 1 x 3' is not OBJ"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 0 1 2\n", "1 invalid indices, first face 0: -1"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 4\n", r"outside 0\.\.2, first face 0"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 1 nan 0\nf 1 2 3\n", "1 non-finite point.*vertex 2"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "face 0 has 2"),
        ("a.obj", "", r"a\.obj: .*none given"),
        ("a.off", "", "not an OFF file: nothing in it"),
        ("a.off", "4OFF\n1 1 0", "not an OFF file: 1 points and 1 faces are more than its 3 numbers"),
        ("a.off", "OFF BINARY\n", "not an OFF file: it is cut short"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1\n", "the face list is cut short"),
        ("a.off", "OFF\n3 2 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 2\n", "the face list is cut short"),
        ("a.off", "OFF\n3 1 0\n0 0\n1 0\n1 1\n3 0 1 2\n", "not an OFF file: the face list is cut short"),
        ("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 -1 2\n", "1 invalid indices, first face 0: -1"),
        ("a.ply", "solid\n", "not a PLY file: it does not begin with 'ply'"),
        ("a.ply", "ply\nelement vertex 1\nend_header\n", "no known format"),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex\nend_header\n", "header line 'element vertex'"),
        ("a.ply", "ply\nformat ascii 1.0\nproperty half x\nend_header\n", "no 'half'"),
        ("a.ply", "ply\nformat ascii 1.0\nelement face 0\nend_header\n", "no 'vertex'"),
        ("a.ply", ply(POINTS, FACES)[:-30], "not a PLY file: buffer is smaller"),
        ("a.ply", ply(POINTS, FACES, "binary_little_endian")[:-20], "not a PLY file: buffer is smaller"),
        ("a.ply", ply(POINTS, FACES).replace(b"3 1 2 5", b"3 1 inf 5"), "invalid indices, first face 1: inf"),
        ("a.ply", ply(POINTS, FACES).replace(b"3 1 2 5", b"3 1 2.5 5"), "invalid indices, first face 1: 2.5"),
        ("a.ply", ply(POINTS, FACES).replace(b"3 1 2 5", b"nan 1 2 5"), "not a PLY file"),
        ("a.ply", ply(POINTS, FACES).replace(b"3 1 2 5", b"-3 1 2 5"), "not a PLY file: a list of -3 items"),
        ("a.ply", ply(POINTS, []), "faces: none given"),
        ("a.stl", "", r"a\.stl: not an STL file"),
        ("a.glb", "glTF", r"a\.glb: "),
        ("a.vtk", "nothing", r"a\.vtk: "),
        ("a.step", "", r"a\.step: cannot read \.step"),
        ("mesh", "", "cannot read a file without suffix"),
    ],
)
def test_bad_files_are_named(tmp_path, name, text, message, capfd):
    with pytest.raises(MeshError, match=message) as caught:
        read(with_text(tmp_path / name, text))
    assert str(caught.value).startswith(str(tmp_path / name))
    capfd.readouterr()  # VTK tells its own story on stderr


def test_a_missing_file_is_an_oserror(tmp_path):
    for name in ("a.obj", "a.vtp", "a.glb"):
        with pytest.raises(FileNotFoundError, match=name):
            read(tmp_path / name)


@settings(max_examples=150, deadline=None)
@given(
    data=st.data(),
    text=st.sampled_from(
        [
            ply(POINTS, FACES),
            ply(POINTS, FACES, "binary_little_endian"),
            ply(POINTS, FACES[:1] + FACES[3:], "binary_big_endian"),
        ]
    ),
)
def test_damaged_ply_files_never_crash(tmp_path_factory, data, text):
    damaged = bytearray(text)
    for _ in range(data.draw(st.integers(1, 4))):
        damaged[data.draw(st.integers(0, len(damaged) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.ply"
    path.write_bytes(damaged[: data.draw(st.integers(0, len(damaged)))])
    try:
        content = read_ply(path)
    except MeshError:
        return
    assert content.points.shape[1:] == (3,)
    assert isinstance(content.faces, Faces) or content.faces.shape[1:] == (4,)


def test_polygons_as_table_or_list():
    assert polygons([4, 3], [0, 1, 2, 3, 4, 5, 6]).tolist() == [[0, 1, 2, 3], [4, 5, 6, -1]]
    assert polygons([3, 5], range(8)) == [[0, 1, 2], [3, 4, 5, 6, 7]]
    with pytest.raises(MeshError, match="7 corners do not make 2 faces"):
        polygons([4, 4], range(7))


def test_files_with_a_seam_say_so(tmp_path):
    points = np.concatenate((POINTS, POINTS[[1, 4]]))
    path = with_text(tmp_path / "seam.obj", obj(points, [[0, 1, 4, 3], [8, 2, 5, 9]]))
    with pytest.warns(UserWarning, match=r"4 boundary vertices lie where others do.*first vertices 1 and 8"):
        read(path)


def test_paths_are_meshes(tmp_path, mesh):
    write(tmp_path / "mesh.PLY", mesh)
    for path in (tmp_path / "mesh.PLY", str(tmp_path / "mesh.PLY")):
        np.testing.assert_array_equal(as_mesh(path).points, POINTS)
