"""The same quads through trimesh as in the file, whoever wrote the file; colours of what is attached."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import trimesh

import quadcurv as qc
from quadcurv import QuadMesh, as_mesh, attach, read, surfaces, write
from quadcurv.io.base import FaceList
from quadcurv.mesh import Recovery

BALL = surfaces.cubed_ellipsoid().sample((5, 5), "faces")[0]


def with_triangles(fraction):
    """Quads of which some are cut, along either diagonal, into halves that follow each other."""
    rng = np.random.default_rng(0)
    faces = []
    for a, b, c, d in BALL.faces.tolist():
        if rng.random() >= fraction:
            faces.append([a, b, c, d])
        else:
            faces += [[a, b, c], [c, d, a]] if rng.random() < 0.5 else [[b, c, d], [b, d, a]]
    return QuadMesh(BALL.points, faces)


def with_hexagons():
    """Pairs of quads that have lost the edge between them."""
    faces = dict(enumerate(BALL.faces.tolist()))
    at = {(face[i], face[(i + 1) % 4]): (k, i) for k, face in faces.items() for i in range(4)}
    found = []
    for k in list(faces)[::7]:
        if k in faces:
            a, b, c, d = faces[k]
            other, i = at[b, a]
            if other in faces and other != k:
                face = faces.pop(other)
                del faces[k]
                found.append([b, c, d, a, face[(i + 2) % 4], face[(i + 3) % 4]])
    return QuadMesh(BALL.points, [*found, *faces.values()])


MESHES = {
    "quads": BALL,
    "few triangles": with_triangles(0.2),
    "as many": with_triangles(0.5),
    "few quads": with_triangles(0.8),
    "hexagons": with_hexagons(),
}


def textured(path, mesh, materials):
    """OBJ with texture coordinates of every corner for itself, which trimesh splits vertices at."""
    faces = FaceList.of(mesh)
    lines = ["v " + " ".join(map(repr, point)) for point in mesh.points.tolist()]
    lines += [f"vt {k / 1000!r} 0.5" for k in range(len(faces.corners))]
    for k, (face, end) in enumerate(zip(faces.words(1), np.cumsum(faces.sizes), strict=True)):
        if materials and k % 40 == 0:
            lines.append(f"usemtl m{k}")
        lines.append("f " + " ".join(f"{v}/{end - len(face) + j + 1}" for j, v in enumerate(face)))
    path.write_text("\n".join(lines) + "\n")


def by_meshlab(path, mesh):
    pytest.importorskip("pymeshlab", exc_type=ImportError)
    qc.to_pymeshlab(mesh).save_current_mesh(str(path))


WRITERS = {
    "ours, obj": ("obj", write),
    "ours, off": ("off", write),
    "ours, glb": ("glb", write),
    "MeshLab, obj": ("obj", by_meshlab),
    "MeshLab, ply": ("ply", by_meshlab),
    "trimesh, obj": ("obj", lambda path, mesh: qc.to_trimesh(mesh).export(path)),
    "trimesh, off": ("off", lambda path, mesh: qc.to_trimesh(mesh).export(path)),
    "trimesh, ply": ("ply", lambda path, mesh: qc.to_trimesh(mesh).export(path)),
    "trimesh, stl": ("stl", lambda path, mesh: qc.to_trimesh(mesh).export(path)),
    "textured obj": ("obj", lambda path, mesh: textured(path, mesh, False)),
    "obj of several materials": ("obj", lambda path, mesh: textured(path, mesh, True)),
}


def normal_form(mesh):
    """Polygons by their positions, each from its least corner on."""
    x, faces = np.round(mesh.points, 5) + 0.0, FaceList.of(mesh)
    found = []
    for face in np.split(faces.corners, np.cumsum(faces.sizes)[:-1]):
        corners = [tuple(x[v]) for v in face]
        least = corners.index(min(corners))
        found.append(tuple(corners[least:] + corners[:least]))
    return sorted(found)


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("writer", WRITERS)
def test_the_file_and_trimesh_give_the_same_faces(tmp_path, writer, name):
    suffix, write_to = WRITERS[writer]
    if suffix == "off" and name == "hexagons" and writer == "ours, off":
        pytest.skip("trimesh does not read polygons of five sides and more in OFF")
    path = tmp_path / f"mesh.{suffix}"
    write_to(path, MESHES[name])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of seams that trimesh makes at texture coordinates
        found = as_mesh(trimesh.load(path))
        expected = read(path)
    assert normal_form(found) == normal_form(expected)
    if writer in ("ours, obj", "ours, off", "textured obj", "MeshLab, obj"):
        assert normal_form(found) == normal_form(MESHES[name])


def test_a_file_is_not_asked_where_the_mesh_has_changed(tmp_path):
    mesh = MESHES["few quads"]
    write(tmp_path / "a.obj", mesh)
    loaded = trimesh.load(tmp_path / "a.obj")
    n_quads = np.count_nonzero(mesh.faces[:, 3] >= 0)
    assert as_mesh(loaded).recovery == Recovery("file", 2 * n_quads / 300)
    moved = loaded.copy()
    moved.vertices = moved.vertices + 1
    assert as_mesh(moved).recovery.rule == "interleaved"
    fewer = loaded.copy()
    fewer.update_faces(np.arange(len(fewer.faces)) > 0)
    assert as_mesh(fewer).recovery.rule != "file"
    write(tmp_path / "a.obj", MESHES["as many"])
    assert as_mesh(loaded).recovery.rule != "file"
    (tmp_path / "a.obj").write_text("nonsense")
    assert as_mesh(loaded).recovery.rule != "file"
    (tmp_path / "a.obj").unlink()
    assert as_mesh(loaded).recovery.rule != "file"


def test_values_of_the_same_file_fit_the_trimesh(tmp_path):
    write(tmp_path / "a.obj", MESHES["few quads"])
    loaded = trimesh.load(tmp_path / "a.obj")
    found = as_mesh(loaded)
    np.testing.assert_array_equal(found.points, loaded.vertices)
    attach(loaded, "H", qc.mean_curvature(loaded))


def test_files_of_triangles_in_other_orders_stay_triangles(tmp_path):
    for order in ("halves in turn", "genuine"):
        ball = trimesh.creation.icosphere(subdivisions=2)
        triangles = ball.faces if order == "genuine" else None
        points = ball.vertices if order == "genuine" else BALL.points
        if triangles is None:
            triangles = np.stack((BALL.faces[:, [0, 1, 2]], BALL.faces[:, [2, 3, 0]]), axis=1).reshape(-1, 3)
        for suffix in ("obj", "off", "ply", "stl"):
            trimesh.Trimesh(points, triangles, process=False).export(tmp_path / f"a.{suffix}")
            mesh = read(tmp_path / f"a.{suffix}")
            assert (mesh.faces[:, 3] < 0).all()
            assert mesh.recovery is None


def test_colours_span_the_middle_of_the_values():
    box = trimesh.creation.icosphere(subdivisions=3)
    values = np.linspace(0, 1, len(box.vertices))
    values[0], values[-1], values[5] = -1e6, 1e6, np.nan
    attach(box, "H", values)
    colours = np.asarray(box.visual.vertex_colors).astype(int)
    dark, bright = [68, 1, 84, 255], [253, 231, 36, 255]
    assert colours[0].tolist() == dark
    assert colours[-1].tolist() == bright
    assert colours[5].tolist() == [128, 128, 128, 255]
    # Two outliers do not make all others alike.
    assert np.ptp(colours[6:-1, :3], axis=0).min() > 100
    assert (np.diff(colours[50:-50, 1]) >= 0).all()
    spike = np.zeros(len(box.vertices))
    spike[7] = 1
    attach(box, "spike", spike)
    assert np.asarray(box.visual.vertex_colors)[7].tolist() == bright
