"""Files and objects of other programs, made by their own writers, read to the same mesh."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh

import quadcurv as qc
from quadcurv import MeshError, QuadMesh, as_mesh, mean_curvature, read, read_values, surfaces

TORUS = surfaces.torus().sample((12, 8), "faces")[0]
# Two of its quads are cut in two.
QUADS, CUT = TORUS.faces[:-2], TORUS.faces[-2:]
TRIANGLES = np.concatenate((CUT[:, [0, 1, 2]], CUT[:, [2, 3, 0]]))
MESH = QuadMesh(TORUS.points, [*QUADS.tolist(), *TRIANGLES.tolist()])
H = np.arange(len(MESH.points)) / 7


def normal_form(points, faces, digits):
    """Faces as positions, each from its least corner on, sorted."""
    rounded = np.round(points, digits) + 0.0
    found = []
    for face in faces:
        corners = [tuple(rounded[v]) for v in face if v >= 0]
        least = corners.index(min(corners))
        found.append(tuple(corners[least:] + corners[:least]))
    return sorted(found)


def assert_same(mesh, digits=12, expected=MESH):
    ours = normal_form(expected.points, expected.faces, digits)
    assert normal_form(mesh.points, mesh.faces, digits) == ours


def by_trimesh(path):
    qc.to_trimesh(MESH).export(path)


def by_pyvista(**options):
    def write(path):
        data = qc.to_pyvista(MESH)
        data["H"] = H
        if path.suffix == ".vtu":
            data = data.cast_to_unstructured_grid()
        data.save(path, **options)

    return write


def by_meshlab(path):
    pytest.importorskip("pymeshlab", exc_type=ImportError)
    qc.to_pymeshlab(MESH).save_current_mesh(str(path))


def by_potpourri(path):
    potpourri3d = pytest.importorskip("potpourri3d")
    triangles = np.asarray(qc.to_trimesh(MESH).faces)
    potpourri3d.write_mesh(MESH.points, triangles, str(path))


def by_gmsh(**options):
    def write(path):
        try:
            import gmsh
        except (ImportError, OSError) as error:  # its wheel leaves libraries of windows to the system
            pytest.skip(f"no gmsh: {error}")
        gmsh.initialize(interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            for name, value in options.items():
                gmsh.option.setNumber(f"Mesh.{name}", value)
            surface = gmsh.model.addDiscreteEntity(2)
            tags = np.arange(1, len(MESH.points) + 1)
            gmsh.model.mesh.addNodes(2, surface, tags, MESH.points.ravel())
            gmsh.model.mesh.addElementsByType(surface, 3, [], (QUADS + 1).ravel())
            gmsh.model.mesh.addElementsByType(surface, 2, [], (TRIANGLES + 1).ravel())
            curve = gmsh.model.addDiscreteEntity(1)
            gmsh.model.mesh.addElementsByType(curve, 1, [], (QUADS[:5, :2] + 1).ravel())
            gmsh.write(str(path))
        finally:
            gmsh.finalize()

    return write


def meshlane_mesh(lines=True):
    meshlane = pytest.importorskip("meshlane")
    cells = [("quad", QUADS.astype(np.int64)), ("triangle", TRIANGLES.astype(np.int64))]
    if lines:
        cells.insert(0, ("line", QUADS[:5, :2].astype(np.int64)))
    return meshlane.Mesh(MESH.points, cells, point_data={"H": H})


def by_meshlane(file_format, lines=True, needs=None):
    def write(path):
        if needs:
            pytest.importorskip(needs)
        import meshlane

        meshlane.write(str(path), meshlane_mesh(lines), file_format=file_format)

    return write


# writer, suffix, decimal digits kept, whether H comes along
PROGRAMS = {
    "trimesh obj": (by_trimesh, "obj", 7, False),
    "trimesh off": (by_trimesh, "off", 7, False),
    "trimesh ply": (by_trimesh, "ply", 5, False),
    "trimesh stl": (by_trimesh, "stl", 5, False),
    "trimesh glb": (by_trimesh, "glb", 5, False),
    "pyvista ply": (by_pyvista(), "ply", 5, False),
    "pyvista ply, text": (by_pyvista(binary=False), "ply", 4, False),
    "pyvista vtp": (by_pyvista(), "vtp", 12, True),
    "pyvista vtp, text": (by_pyvista(binary=False), "vtp", 9, True),
    "pyvista vtu": (by_pyvista(), "vtu", 12, True),
    "pyvista vtk": (by_pyvista(), "vtk", 12, True),
    "pyvista vtk, text": (by_pyvista(binary=False), "vtk", 4, True),
    "MeshLab obj": (by_meshlab, "obj", 5, False),
    "MeshLab off": (by_meshlab, "off", 5, False),
    "gmsh msh 2.2": (by_gmsh(MshFileVersion=2.2), "msh", 12, False),
    "gmsh msh 2.2, binary": (by_gmsh(MshFileVersion=2.2, Binary=1), "msh", 12, False),
    "gmsh msh 4.1": (by_gmsh(MshFileVersion=4.1), "msh", 12, False),
    "gmsh msh 4.1, binary": (by_gmsh(MshFileVersion=4.1, Binary=1), "msh", 12, False),
    "gmsh vtk": (by_gmsh(), "vtk", 12, False),
    "gmsh inp": (by_gmsh(), "inp", 10, False),
    "gmsh off": (by_gmsh(), "off", 3, False),
    "meshlane msh": (by_meshlane("gmsh22"), "msh", 12, True),
    "meshlane inp": (by_meshlane("abaqus"), "inp", 12, False),
    "meshlane vtu": (by_meshlane("vtu"), "vtu", 12, True),
    "meshlane avs": (by_meshlane("avsucd"), "avs", 12, True),
    "meshlane ugrid": (by_meshlane("ugrid", lines=False), "ugrid", 5, False),
    "meshlane mesh": (by_meshlane("medit"), "mesh", 12, False),
    "meshlane med": (by_meshlane("med", needs="h5py"), "med", 12, True),
    "meshlane xdmf": (by_meshlane("xdmf", needs="h5py"), "xdmf", 12, True),
    "meshlane exodus": (by_meshlane("exodus", needs="netCDF4"), "e", 12, False),
}


@pytest.mark.parametrize("name", PROGRAMS)
def test_files_of_other_programs_are_the_same_mesh(tmp_path, name):
    write, suffix, digits, has_values = PROGRAMS[name]
    if suffix in ("msh", "inp", "avs", "ugrid", "mesh", "med", "xdmf"):
        pytest.importorskip("meshlane")
    path = tmp_path / f"torus.{suffix}"
    write(path)
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", ".*points and lines left out", qc.MeshWarning)
        if name == "MeshLab off":  # it writes triangles the other way round
            warnings.filterwarnings("ignore", "4 face.s. turned to agree", qc.MeshWarning)
        assert_same(read(path), digits)
    if has_values:
        np.testing.assert_allclose(read_values(path)["H"], H, rtol=1e-5)


@pytest.mark.parametrize(
    ("write", "suffix"),
    [(by_meshlab, "ply"), (by_meshlab, "stl"), (by_potpourri, "obj"), (by_pyvista(), "stl")],
)
def test_files_of_triangles_alone_have_all_of_them(tmp_path, write, suffix):
    path = tmp_path / f"torus.{suffix}"
    if write.__name__ == "write" and suffix == "stl":
        qc.to_pyvista(MESH).triangulate().save(path)
    else:
        write(path)
    mesh = read(path)
    assert len(mesh.points) == len(MESH.points)
    assert (mesh.faces[:, 3] < 0).sum() + 2 * (mesh.faces[:, 3] >= 0).sum() == 2 * len(QUADS) + len(TRIANGLES)
    assert mesh.stencils().closed.all()


@pytest.mark.parametrize("order", [8, 9])
def test_quads_of_eight_and_nine_nodes_are_taken_by_their_corners(tmp_path, order):
    meshlane = pytest.importorskip("meshlane")
    n = len(TORUS.points)
    middle = n + np.arange(TORUS.faces.size).reshape(-1, 4)
    nodes = [TORUS.faces, middle, n + 4 * len(TORUS.faces) + np.arange(len(TORUS.faces))[:, None]]
    corners = TORUS.points[TORUS.faces]
    points = np.concatenate(
        (TORUS.points, ((corners + np.roll(corners, -1, axis=1)) / 2).reshape(-1, 3), corners.mean(axis=1))
    )
    cells = np.concatenate(nodes[: order - 6], axis=1).astype(np.int64)
    meshlane.write(str(tmp_path / "a.vtu"), meshlane.Mesh(points, [(f"quad{order}", cells)]))
    with pytest.warns(qc.MeshWarning, match="96 faces with nodes on their sides taken by their corners"):
        mesh = read(tmp_path / "a.vtu")
    np.testing.assert_array_equal(mesh.faces, TORUS.faces)
    np.testing.assert_array_equal(mean_curvature(mesh)[:n], mean_curvature(TORUS))


def test_volumes_beside_their_skin_are_left_out_and_alone_refused(tmp_path):
    meshlane = pytest.importorskip("meshlane")
    points = np.array([[x, y, z] for z in (0.0, 1) for y in (0.0, 1) for x in (0.0, 1)])[
        [0, 1, 3, 2, 4, 5, 7, 6]
    ]
    skin = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    volume = ("hexahedron", np.arange(8)[None])
    meshlane.write(str(tmp_path / "a.vtu"), meshlane.Mesh(points, [volume, ("quad", skin)]))
    with pytest.warns(qc.MeshWarning, match="1 cells that are volumes left out"):
        assert len(read(tmp_path / "a.vtu").faces) == 6
    for suffix in ("vtu", "msh"):
        meshlane.write(str(tmp_path / f"b.{suffix}"), meshlane.Mesh(points, [volume]))
        with pytest.raises(MeshError, match="1 cells are no polygons, first cell 0 of VTK type 1"):
            read(tmp_path / f"b.{suffix}")


def test_elements_that_a_library_skips_are_told(tmp_path):
    pytest.importorskip("meshlane")
    lines = ["*NODE", *(f"{k + 1}, {x}, {y}, 0" for k, (x, y) in enumerate(np.ndindex(3, 3)))]
    lines += ["*ELEMENT, TYPE=M3D4", "1, 1, 4, 5, 2", "*ELEMENT, TYPE=CPS4R", "2, 2, 5, 6, 3"]
    lines += ["*ELEMENT, TYPE=QUAX99", "3, 4, 7, 8, 5"]
    (tmp_path / "a.inp").write_text("\n".join(lines) + "\n")
    with pytest.warns(qc.MeshWarning, match="QUAX99"):
        assert read(tmp_path / "a.inp").faces.tolist() == [[0, 3, 4, 1], [1, 4, 5, 2]]


# ---------------------------------------------------------------------------------- objects in memory


def test_objects_with_points_and_cells():
    blocks = [SimpleNamespace(type="line", data=QUADS[:3, :2]), SimpleNamespace(type="quad", data=QUADS)]
    blocks.append(SimpleNamespace(type="triangle", data=TRIANGLES))
    likes = [
        SimpleNamespace(points=MESH.points, cells=blocks, point_data={"H": H}),
        SimpleNamespace(points=MESH.points, cells=[(b.type, b.data) for b in blocks]),
        SimpleNamespace(points=MESH.points, cells={b.type: b.data for b in blocks}),
    ]
    for like in likes:
        with pytest.warns(qc.MeshWarning, match="3 cells that are points and lines left out"):
            assert_same(as_mesh(like))
    assert_same(as_mesh(SimpleNamespace(points=MESH.points.tolist(), cells=[*QUADS.tolist(), *TRIANGLES])))
    flat = SimpleNamespace(points=[[0, 0], [1, 0], [1, 1], [0, 1]], cells=[("quad", [[0, 1, 2, 3]])])
    assert as_mesh(flat).points[:, 2].tolist() == [0, 0, 0, 0]


def test_meshes_of_meshlane_and_vedo():
    assert_same(as_mesh(meshlane_mesh(lines=False)))
    vedo = pytest.importorskip("vedo", exc_type=ImportError)
    assert_same(as_mesh(vedo.Mesh([MESH.points, [*QUADS.tolist(), *TRIANGLES.tolist()]])), 5)


def test_meshes_of_compas_by_what_they_offer():
    faces = [[0, 1, 2, 3], [1, 4, 5, 6, 2]]
    points = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2.5, 0.5], [2, 1]])
    points = np.insert(points, 2, 0.0, axis=1)
    like = SimpleNamespace(to_vertices_and_faces=lambda: (points.tolist(), faces))
    assert as_mesh(like).face_source.tolist() == as_mesh((points, faces)).face_source.tolist()
    compas = pytest.importorskip("compas.datastructures", exc_type=ImportError)
    assert_same(
        as_mesh(
            compas.Mesh.from_vertices_and_faces(MESH.points.tolist(), [*QUADS.tolist(), *TRIANGLES.tolist()])
        )
    )


def test_meshes_of_open3d_by_what_they_offer():
    box = trimesh.creation.box()
    legacy = SimpleNamespace(vertices=list(box.vertices), triangles=list(box.faces), textures=[])
    tensor = SimpleNamespace(
        vertex={"positions": SimpleNamespace(numpy=lambda: np.asarray(box.vertices, np.float32))},
        triangle={"indices": SimpleNamespace(numpy=lambda: np.asarray(box.faces))},
    )
    for like in (legacy, tensor):
        mesh = as_mesh(like)
        np.testing.assert_array_equal(mesh.points, box.vertices)
        np.testing.assert_array_equal(mesh.faces[:, :3], box.faces)
    assert as_mesh(tensor).roundoff > as_mesh(legacy).roundoff


def test_a_meshlab_mesh_of_edges_with_three_triangles_takes_no_memory_for_ever():
    pytest.importorskip("pymeshlab", exc_type=ImportError)
    # Two quads on either side of an edge that is a diagonal of a third: a valid mesh.
    points = np.array([[0, 0, 0], [1, 0, 0.0], [1, 1, 0], [0, 1, 0], [0.5, 0.5, 1], [0.3, 0.7, 1], [2, 2, 2]])
    faces = [[0, 1, 2, 3], [0, 2, 4, 5], [2, 0, 6]]
    mesh = QuadMesh(points, faces)
    assert not mesh.report["nonmanifold"]
    with pytest.warns(qc.MeshWarning) as told:
        found = as_mesh(qc.to_pymeshlab(mesh))
    assert any("MeshLab cannot tell which make polygons" in str(w.message) for w in told)
    assert len(found.faces) == 5
