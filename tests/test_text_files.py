"""OBJ, OFF, PLY and STL as other programs spell them: all the same cube, or nearly."""

from __future__ import annotations

import struct
import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import quadcurv as qc
from quadcurv import MeshError, QuadMesh, read, read_values, surfaces, write
from quadcurv.io.text import Words, numbers, parts

CUBE = [(-1, -1, -1), (1, -1, -1), (1, 1, -1), (-1, 1, -1), (-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)]
FACES = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
ROWS = [" ".join(map(str, point)) for point in CUBE]
QUADS = [f"4 {' '.join(map(str, face))}" for face in FACES]
MARK = b"\xef\xbb\xbf"


def text(*blocks) -> bytes:
    return "\n".join(
        line for block in blocks for line in ([block] if isinstance(block, str) else block)
    ).encode()


def is_the_cube(path):
    mesh = read(path)
    np.testing.assert_array_equal(mesh.points, CUBE)
    np.testing.assert_array_equal(mesh.faces, FACES)
    return True


# ---------------------------------------------------------------------------------------------- OBJ

V = [f"v {row}" for row in ROWS]
F = ["f " + " ".join(str(v + 1) for v in face) for face in FACES]
OBJ = {
    "plain": text(V, F),
    "byte order mark": MARK + text(V, F),
    "CR": text(V, F).replace(b"\n", b"\r"),
    "UTF-16": text(V, F).decode().encode("utf-16"),
    "CR LF": text(V, F).replace(b"\n", b"\r\n"),
    "form feeds and separators in comments": text("# a\x0cb\x0bc\u2028d\u0085e", V, F),
    "faces over two lines": text(V, [line.replace(" ", " \\\n", 2) for line in F]),
    "faces before vertices": text(F, V),
    "in turns, counted back": text(V[:4], "f -4 -1 -2 -3", V[4:], F[1:]),
    "texture and normals": text(V, "vt 0 0", "vn 0 0 1", [line.replace(" ", " \t") + "/1/1" for line in F]),
    "normals only": text(
        V, "vn 0 0 1", [" ".join(w + "//1" if w != "f" else w for w in line.split()) for line in F]
    ),
    "colours and weights": text([f"{line} 0.5 0.5 0.5" for line in V], F),
    "groups, lines, points, curves": text(
        "o a", "g b c", V, "l 1 2", "p 1", "vp 0.5", "usemtl m#1", "s 1", F
    ),
    "indented": text([f"\t {line}  " for line in V + F]),
    "signs and exponents": text([line.replace("1", "+1.0e0").replace("-+", "-") for line in V], F),
}


@pytest.mark.parametrize("name", OBJ)
def test_obj_is_read_however_it_is_spelled(tmp_path, name):
    (tmp_path / "cube.obj").write_bytes(OBJ[name])
    assert is_the_cube(tmp_path / "cube.obj")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("v 1 2", "line 15: 'v 1 2' is not OBJ"),
        ("v 1 2 x", "line 15: 'v 1 2 x' is not OBJ"),
        ("f 1 2 3.5", "line 15: 'f 1 2 3.5' is not OBJ"),
        ("f 1 2 /3", "line 15: 'f 1 2 /3' is not OBJ"),
        ("f 1 2 99999999999999999999999", "line 15: 'f 1 2 9|outside 0"),
        ("f 1 2 9", "outside 0..7, first face 6"),
        ("f 1 2 -9", "invalid indices, first face 6"),
        ("v 1 2 \x00", "line 15"),
        ("f", "face 6 has 0"),
    ],
)
def test_lines_that_are_no_obj_are_named(tmp_path, line, message):
    (tmp_path / "cube.obj").write_bytes(text(V, F, line))
    with pytest.raises(MeshError, match=message):
        read(tmp_path / "cube.obj")


# ---------------------------------------------------------------------------------------------- OFF

COUNTS = "8 6 12"


def binary_off(order=">"):
    body = struct.pack(">3i", 8, 6, 12) + b"".join(struct.pack(">3f", *point) for point in CUBE)
    colour = struct.pack(">3f", 1, 0, 0)
    return (
        b"OFF BINARY\n"
        + body
        + b"".join(
            struct.pack(">6i", 4, *face, 0) if k % 2 else struct.pack(">6i", 4, *face, 3) + colour
            for k, face in enumerate(FACES)
        )
    )


def more(tail):
    return [row + tail for row in ROWS]


OFF = {
    "plain": text("OFF", COUNTS, ROWS, QUADS),
    "no space after OFF": text("OFF" + COUNTS, ROWS, QUADS),
    "counts on the header line": text("OFF 8 6 12", ROWS, QUADS),
    "no number of edges": text("OFF", "8 6", ROWS, QUADS),
    "no header word": text(COUNTS, ROWS, QUADS),
    "comments and empty lines": text("# a", "OFF # b", "", COUNTS + "# 3", "", ROWS, "# c", QUADS),
    "byte order mark": MARK + text("OFF", COUNTS, ROWS, QUADS),
    "CR": text("OFF", COUNTS, ROWS, QUADS).replace(b"\n", b"\r"),
    "UTF-16": text("OFF", COUNTS, ROWS, QUADS).decode().encode("utf-16"),
    "small letters": text("off", COUNTS, ROWS, QUADS),
    "NOFF": text("NOFF", COUNTS, more(" 0 0 1"), QUADS),
    "COFF": text("COFF", COUNTS, more(" 255 0 0 255"), QUADS),
    "COFF of three": text("COFF", COUNTS, more(" 255 0 0"), QUADS),
    "NCOFF": text("NCOFF", COUNTS, more(" 0 0 1 255 0 0 255"), QUADS),
    "CNOFF": text("CNOFF", COUNTS, more(" 255 0 0 255 0 0 1"), QUADS),
    "STOFF": text("STOFF", COUNTS, more(" 0.5 0.5"), QUADS),
    "STNCOFF": text("STNCOFF", COUNTS, more(" 0 0 1 255 0 0 255 0 0"), QUADS),
    "4OFF": text(
        "4OFF", COUNTS, [" ".join(str(2 * int(x)) for x in row.split()) + " 2" for row in ROWS], QUADS
    ),
    "nOFF": text("nOFF", "3", COUNTS, ROWS, QUADS),
    "colours of faces": text("OFF", COUNTS, ROWS, [f"{q} 3 255 0 0" for q in QUADS]),
    "colours of some faces": text("OFF", COUNTS, ROWS, QUADS[:3], [f"{q} 0.5 0.5 0.5 1" for q in QUADS[3:]]),
    "faces over lines": text("OFF", "8 6 0", ROWS, [w for q in QUADS for w in (q.replace(" ", "\n", 2), "")]),
    "all in one line": text("OFF 8 6 12 " + " ".join(ROWS) + " " + " ".join(QUADS)),
    "vertices on a line": text("OFF 8 6 12", " ".join(ROWS), " ".join(QUADS)),
    "two vertices on a line": text(
        "OFF", COUNTS, [f"{a} {b}" for a, b in zip(ROWS[::2], ROWS[1::2], strict=True)], QUADS
    ),
    "a number on a line": text("OFF", "\n".join(" ".join([COUNTS, *ROWS, *QUADS]).split())),
    "binary": binary_off(),
    "more behind": text("OFF", COUNTS, ROWS, QUADS, "1 2 3"),
}


@pytest.mark.parametrize("name", OFF)
def test_off_is_read_however_it_is_spelled(tmp_path, name):
    (tmp_path / "cube.off").write_bytes(OFF[name])
    assert is_the_cube(tmp_path / "cube.off")


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (text("4nOFF", "4", COUNTS, more(" 1"), QUADS), "points of 4 dimensions"),
        (text("OFF", "8 -6 0", ROWS, QUADS), "a count of -6"),
        (text("OFF", "8.5 6 0", ROWS, QUADS), "a count of 8.5"),
        (text("OFF", "9999999999999 6 0", ROWS, QUADS), "are more than its .* numbers hold"),
        (text("OFF", COUNTS, ROWS, QUADS[:5]), "the face list is cut short"),
        (text("OFF", COUNTS, ROWS, QUADS[:5], "4 0 1 x 2"), "not an OFF file"),
        (text("OFF", COUNTS, ROWS, QUADS[:5], "9 0 1 2 3"), "the face list is cut short"),
        (binary_off()[:-4], "the face list is cut short"),
        (binary_off()[:40], "are more than its 40 bytes hold"),
        (text("4OFF", COUNTS, more(" 0"), QUADS), "8 non-finite point"),
    ],
)
def test_off_files_that_are_none(tmp_path, content, message):
    (tmp_path / "cube.off").write_bytes(content)
    with pytest.raises(MeshError, match=message):
        read(tmp_path / "cube.off")


# ---------------------------------------------------------------------------------------------- PLY

HEAD = [
    "element vertex 8",
    *(f"property float {axis}" for axis in "xyz"),
    "element face 6",
    "property list uchar int vertex_indices",
]


def ply(head=HEAD, rows=(*ROWS, *QUADS)):
    return text("ply", "format ascii 1.0", head, "end_header", list(rows), "")


PLY = {
    "plain": ply(),
    "end_header in a comment": ply(["comment all before end_header is text", *HEAD]),
    "obj_info": ply(["obj_info num_cols 3", *HEAD]),
    "CR": ply().replace(b"\n", b"\r"),
    "CR LF": ply().replace(b"\n", b"\r\n"),
    "byte order mark": MARK + ply(),
    "vertexIndices": ply([line.replace("vertex_indices", "vertexIndices") for line in HEAD]),
    "another name": ply([line.replace("vertex_indices", "corners") for line in HEAD]),
    "64 bits": ply([line.replace("int vertex", "int64 vertex").replace("float", "float64") for line in HEAD]),
    "a list of texture coordinates before": ply(
        [*HEAD[:5], "property list uchar float texcoord", HEAD[5]],
        [*ROWS, *(f"{2 * k} {'0.5 ' * 2 * k}{quad}" for k, quad in enumerate(QUADS))],
    ),
    "a list of every vertex": ply(
        [*HEAD[:4], "property list uchar int near", *HEAD[4:]],
        [*(f"{row} {k} {'1 ' * k}" for k, row in enumerate(ROWS)), *QUADS],
    ),
    "an element without properties": ply([*HEAD[:4], "element nothing 3", *HEAD[4:]]),
    "lines as they like": ply(rows=" ".join([*ROWS, *QUADS]).split()),
}


@pytest.mark.parametrize("name", PLY)
def test_ply_is_read_however_it_is_spelled(tmp_path, name):
    (tmp_path / "cube.ply").write_bytes(PLY[name])
    assert is_the_cube(tmp_path / "cube.ply")


@pytest.mark.parametrize("order", "<>")
def test_binary_ply_of_every_type_and_any_lists(tmp_path, order):
    codes = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "int64": "q"}
    codes |= {"uint64": "Q", "float": "f", "double": "d"}
    kind = {"<": "binary_little_endian", ">": "binary_big_endian"}[order]
    rng = np.random.default_rng(0)
    for item in ("char", "ushort", "uint64", "int64", "double"):
        for size in ("uchar", "short", "uint64"):
            head = ["element vertex 8", "property short w", *(f"property double {axis}" for axis in "xyz")]
            head += ["element face 6", "property float a", f"property list {size} {item} vertex_index"]
            head += ["property list uchar double more", "property ushort b"]
            body = b"".join(struct.pack(f"{order}h3d", k, *point) for k, point in enumerate(CUBE))
            for k, face in enumerate(FACES):
                extra = rng.random(k % 3)
                form = f"{order}f{codes[size]}4{codes[item]}B{len(extra)}dH"
                body += struct.pack(form, 0.5, 4, *face, len(extra), *extra, k)
            (tmp_path / "cube.ply").write_bytes(
                text("ply", f"format {kind} 1.0", head, "end_header", "") + body
            )
            assert is_the_cube(tmp_path / "cube.ply")
            assert read_values(tmp_path / "cube.ply")["w"].tolist() == list(range(8))


def test_triangle_strips_turn_every_other_triangle(tmp_path):
    head = ["element vertex 6", *(f"property float {axis}" for axis in "xyz"), "element tristrips 1"]
    head.append("property list int int vertex_indices")
    rows = ["0 0 0", "1 0 0", "0 1 0", "1 1 0", "0 2 0", "1 2 0"]
    # Two strips; the second begins by repeating a vertex, which makes no triangle.
    path = tmp_path / "strips.ply"
    path.write_bytes(ply(head, [*rows, "12 0 1 2 3 -1 2 2 2 3 4 5 -1"]))
    mesh = read(path)
    assert mesh.faces.tolist() == [[0, 1, 2, -1], [2, 1, 3, -1], [2, 3, 4, -1], [4, 3, 5, -1]]
    assert not mesh.report["turned"]


def test_values_of_a_ply_file_come_back_by_name(tmp_path):
    head = [*HEAD[:4], "property float nx", "property float ny", "property float nz", "property double H"]
    head += [
        "property int flow_x",
        "property int flow_y",
        "property int flow_z",
        "property uchar a_x",
        *HEAD[4:],
    ]
    rows = [f"{row} 0 0 1 {k / 7!r} 1 2 {k} 5" for k, row in enumerate(ROWS)]
    (tmp_path / "cube.ply").write_bytes(ply(head, [*rows, *QUADS]))
    values = read_values(tmp_path / "cube.ply")
    assert list(values) == ["normal", "H", "flow", "a_x"]
    np.testing.assert_array_equal(values["H"], np.arange(8) / 7)
    np.testing.assert_array_equal(values["flow"], [[1, 2, k] for k in range(8)])
    assert values["normal"].shape == (8, 3)


# ---------------------------------------------------------------------------------------------- STL


def stl(soup, binary):
    if binary:
        return (
            b"solid by another".ljust(80)
            + struct.pack("<I", len(soup) // 3)
            + b"".join(
                struct.pack("<12fH", 0, 0, 0, *np.ravel(soup[k : k + 3]), 0) for k in range(0, len(soup), 3)
            )
        )
    lines = ["solid name of it"]
    for k in range(0, len(soup), 3):
        corners = ["  vertex {:.9g} {:.9g} {:.9g}".format(*point) for point in soup[k : k + 3]]
        lines += ["facet normal 0 0 0", " outer loop", *corners, " endloop", "endfacet"]
    return text([*lines, "endsolid name of it", ""])


@pytest.mark.parametrize("binary", [True, False])
def test_corners_of_stl_that_differ_by_rounding_are_one(tmp_path, binary):
    sphere = surfaces.cubed_sphere().sample((6, 6), "faces")[0]
    faces = np.concatenate((sphere.faces[:, [0, 1, 3]], sphere.faces[:, [1, 2, 3]]))
    rng = np.random.default_rng(0)
    soup = sphere.points[faces].reshape(-1, 3) + np.array([100, 0, 0])
    soup += rng.uniform(-3e-6, 3e-6, soup.shape)
    (tmp_path / "a.stl").write_bytes(stl(soup, binary))
    mesh = read(tmp_path / "a.stl")
    assert len(mesh.points) == len(sphere.points)
    assert mesh.stencils().closed.all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not an STL file"),
        (b"solid a\nfacet\nouter loop\nvertex 0 0\n", "not an STL file"),
        (b"solid a\nvertex 0 0 0\nvertex 1 0 0\n", "2 corners do not make triangles"),
        (b"solid a\nendsolid a\n", "none given"),
        (stl(np.eye(3), True)[:-4], "130 bytes are too few for 1 triangles|does not begin"),
        (b"\0" * 80 + b"\xff\xff\xff\xff" + b"\0" * 50, "too few for 4294967295 triangles"),
    ],
)
def test_stl_files_that_are_none(tmp_path, content, message):
    (tmp_path / "a.stl").write_bytes(content)
    with pytest.raises(MeshError, match=message):
        read(tmp_path / "a.stl")


# ------------------------------------------------------------------------------------------ the words


@settings(max_examples=200, deadline=None)
@given(st.lists(st.sampled_from(["1", "-2.5", "3e4", "\n", " ", "\t", "\r\n", "nan"]), max_size=40))
def test_words_and_their_lines(pieces):
    content = " ".join(pieces).encode()
    words = Words.of(content)
    assert [bytes(words.text[a:b]) for a, b in zip(words.start, words.end, strict=True)] == content.split()
    counts = [len(line.split()) for line in content.split(b"\n")]
    assert np.diff(words.first).tolist() == [count for count in counts if count]
    np.testing.assert_array_equal(Words.lines(content), words.first)
    np.testing.assert_array_equal(numbers(content), [float(word) for word in content.split()])


def test_long_texts_are_cut_where_lines_end(monkeypatch):
    monkeypatch.setattr("quadcurv.io.text._PART", 10)
    content = b"abc def\nghijklmnopqrstuvwxyz 1 2 3\n\n4 5\n6"
    assert b"".join(parts(content)) == content
    assert all(part.endswith(b"\n") for part in list(parts(content))[:-1])
    np.testing.assert_array_equal(Words.lines(content), Words.of(content).first)


def test_large_files_are_read_in_parts_alike(tmp_path, monkeypatch):
    mesh = surfaces.torus().sample((30, 20), "faces")[0]
    write(tmp_path / "a.obj", mesh)
    monkeypatch.setattr("quadcurv.io.text._PART", 1000)
    monkeypatch.setattr("quadcurv.io.ply._ROWS", 7)
    np.testing.assert_array_equal(read(tmp_path / "a.obj").faces, mesh.faces)
    mixed = QuadMesh(
        mesh.points, [*mesh.faces[:-1].tolist(), mesh.faces[-1, :3].tolist(), mesh.faces[-1, [2, 3, 0]]]
    )
    for suffix in ("off", "ply"):
        write(tmp_path / f"a.{suffix}", mixed)
        np.testing.assert_array_equal(read(tmp_path / f"a.{suffix}").faces, mixed.faces)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["obj", "off", "ply"])
def test_a_million_quads_in_twice_the_time_of_potpourri3d(tmp_path, suffix):
    potpourri3d = pytest.importorskip("potpourri3d")
    path = tmp_path / f"large.{suffix}"
    write(path, surfaces.torus().sample((1000, 1000), "faces")[0])
    taken = {}
    for _ in range(2):
        for name, reader in (("ours", qc.read), ("theirs", potpourri3d.read_polygon_mesh)):
            start = time.process_time()
            reader(str(path))
            taken[name] = min(time.process_time() - start, taken.get(name, np.inf))
    assert taken["ours"] < 2 * taken["theirs"]
