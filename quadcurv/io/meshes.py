"""as_mesh, read and write: whatever holds a mesh as one of ours, and ours as a file or another library's."""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.io.base import FORMATS, STORES, Content, checked_values, joined, library
from quadcurv.io.quads import quads_by_order
from quadcurv.io.replacing import replacing
from quadcurv.io.seams import closed_grid, warn_of_open_sides, warn_of_seam
from quadcurv.mesh import (
    ChunkedGrid,
    FaceParts,
    GridBlocks,
    Mesh,
    QuadGrid,
    QuadMesh,
    Recovery,
    StaggeredGrid,
)
from quadcurv.types import MeshError, warn

Wrap = Sequence[bool]
TRIANGULATED = (".obj", ".off", ".ply", ".stl")  # formats in which trimesh writes quads as triangles


class PartsError(MeshError):
    """A file holds several parts; `count` says how many."""

    def __init__(self, message: str, count: int) -> None:
        super().__init__(message)
        self.count = count


def as_mesh(mesh: Any, quads: ArrayLike | None = None, wrap: Wrap | None = None) -> Mesh:
    """Make a mesh of anything that holds one.

    Parameters
    ----------
    mesh : object
        One of

        - QuadMesh, QuadGrid, StaggeredGrid: returned as they are;
        - GridBlocks of vertices: as one QuadMesh; the verbs take blocks as they are;
        - trimesh.Trimesh, or a Scene of one: its triangles are paired into the quads they were cut from,
          see Notes;
        - pyvista.PolyData, or UnstructuredGrid of polygons;
        - pyvista.StructuredGrid of one layer: a QuadGrid, indexed (i, j) whereas VTK runs through j first;
        - pymeshlab.MeshSet (its current mesh) or Mesh: faux edges join triangles to polygons;
        - a path: see :func:`read`;
        - a tuple (points, faces): the arguments of QuadMesh.
    quads : (m, 4) array_like of int or sequence of polygons, optional
        The faces of a Trimesh, where the caller knows them.
    wrap : (bool, bool), optional
        Which directions of a StructuredGrid are closed; its last row (column) then repeats the first and is
        left out.

    Returns
    -------
    QuadMesh, QuadGrid or StaggeredGrid
        Vertices in the order of `mesh`, double precision; nothing of `mesh` is modified.

    Raises
    ------
    MeshError
        A ValueError: the content is not a surface mesh.
    OSError
        A path that cannot be opened.
    TypeError
        None of these types; `quads` for what is no Trimesh, `wrap` for what is no StructuredGrid.

    Warns
    -----
    MeshWarning
        Boundary vertices coincide, so that the mesh is open although it looks closed; cells were left out.

    Notes
    -----
    trimesh cuts a quad (a, b, c, d) into (a, b, c) and (c, d, a). They are joined again by the first of
    these rules that applies; it is named in the mesh's ``recovery``:

    - "given": by `quads`;
    - "carrier": the face attribute that :func:`to_trimesh` leaves; it survives shuffling and copies;
    - "ply": the polygons of the PLY file that the Trimesh was loaded from;
    - "file": the polygons of the OBJ, OFF or PLY file that it was loaded from by ``trimesh.load``, if that
      is still there and these are its triangles; looked for where the order does not tell all;
    - "block", "interleaved", "diagonal": by the order of the triangles, or by their closing edges;
    - "none": they are triangles. :func:`quadcurv.pair_triangles` pairs them by their shape.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.as_mesh(([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]]))
    QuadMesh(4 points, 1 quads)
    """
    found = as_mesh_or_chunks(mesh, quads, wrap)
    if isinstance(found, ChunkedGrid):
        raise TypeError(
            f"mesh: {found!r} is read block by block, which the verbs of curvature, qc.evaluate and "
            "qc.laplace_beltrami do; all else wants it in memory: qc.QuadGrid(points[:])"
        )
    return found


def as_mesh_or_chunks(mesh: Any, quads: ArrayLike | None = None, wrap: Wrap | None = None) -> Any:
    """As as_mesh, or a ChunkedGrid of an array that is not in memory."""
    if isinstance(mesh, QuadMesh | QuadGrid | StaggeredGrid):
        return opened(mesh, quads, wrap)
    if isinstance(mesh, ChunkedGrid):
        _refuse(quads, wrap, "ChunkedGrid")
        return mesh
    if isinstance(mesh, FaceParts):
        raise TypeError(
            f"mesh: {mesh!r} is computed part by part, which qc.evaluate does, of fits by names as 'k1' and "
            "'interval', and the verbs of one of these; all else wants it in memory: QuadMesh(points, faces)"
        )
    if isinstance(mesh, str | os.PathLike) and (store := STORES.get(Path(mesh).suffix.lower())) is not None:
        _refuse(quads, None, "grid on disk")
        return ChunkedGrid(store.open(Path(mesh)), (False, False) if wrap is None else wrap)
    entry = library(mesh)
    if isinstance(mesh, np.memmap) or (entry and entry.is_array is not None and entry.is_array(mesh)):
        _refuse(quads, None, "grid")
        return ChunkedGrid(mesh, (False, False) if wrap is None else wrap)
    return opened(mesh, quads, wrap)


def opened(
    mesh: Any, quads: Any = None, wrap: Wrap | None = None, seams: bool = True, join: bool = False
) -> Mesh:
    """As as_mesh, or of a path as read, without the warning of seams for who is about to close them."""
    if isinstance(mesh, QuadMesh | QuadGrid | StaggeredGrid):
        _refuse(quads, wrap, type(mesh).__name__)
        if seams and not isinstance(mesh, QuadMesh):  # of whose seams the one was told who read it
            warn_of_open_sides(mesh)
        return mesh
    if isinstance(mesh, GridBlocks):
        _refuse(quads, wrap, "GridBlocks")
        return mesh.to_mesh()
    if isinstance(mesh, str | os.PathLike):
        return _read(mesh, quads, wrap, seams, join)
    if isinstance(mesh, tuple) and len(mesh) == 2:
        _refuse(quads, wrap, "tuple")
        made = QuadMesh(*mesh)
        if seams:
            warn_of_seam(made)
        return made
    entry = library(mesh)
    if entry is None:
        raise TypeError(
            "mesh: expected a quadcurv mesh, a mesh of trimesh, pyvista or pymeshlab, a path or a tuple "
            f"(points, faces), got {type(mesh).__name__}"
        )
    return _made(entry.content(mesh), quads, wrap, seams)


def _refuse(quads: Any, wrap: Any, kind: str) -> None:
    if quads is not None:
        raise TypeError(f"quads: only a Trimesh has triangles to take them for, not a {kind}")
    if wrap is not None:
        raise TypeError(f"wrap: only a StructuredGrid has directions to wrap, not a {kind}")


def _made(content: Content, quads: Any, wrap: Wrap | None, seams: bool) -> QuadMesh | QuadGrid:
    """The mesh of what was read, with all that there is to warn of."""
    if content.faces is None:
        _refuse(quads, None, "StructuredGrid")
        return closed_grid(content.points, wrap, seams)
    _refuse(None, wrap, "face list")
    faces, recovery = content.faces, None
    if content.pairing is None:
        _refuse(quads, None, "mesh that has its own")
    else:
        rule, n_triangles = content.pairing
        if quads is not None:
            faces, rule = quads, "given"
        recovery = Recovery(rule, 2 * _count_quads(faces) / max(n_triangles, 1))
    mesh = QuadMesh(content.points, faces)
    if recovery is not None:
        mesh = mesh.with_recovery(recovery)
    for note in content.notes:
        warn(note)
    if seams:
        warn_of_seam(mesh)
    return mesh


def _count_quads(faces: Any) -> int:
    if isinstance(faces, np.ndarray) and faces.ndim == 2:
        return int(np.count_nonzero(faces[:, 3] >= 0)) if faces.shape[1] == 4 else 0
    return sum(len(face) == 4 and face[3] >= 0 for face in faces)


def read(
    path: str | os.PathLike[str],
    quads: ArrayLike | None = None,
    wrap: Wrap | None = None,
    join: bool = False,
) -> QuadMesh | QuadGrid:
    """Read a mesh file; quads and polygons are kept wherever the format has them.

    Parameters
    ----------
    path : path-like
        =========================  =======================  ===========================================
        suffix                     quads and polygons       positions
        =========================  =======================  ===========================================
        .obj                       kept                     double
        .off, text and binary      kept                     double; binary single
        .ply                       kept                     as the file has them, up to double
        .vtp .vtu .vtk .vtkhdf     kept                     as the file has them, up to double
        .vts .vtk                  a grid: QuadGrid         as the file has them, up to double
        .e .exo .ex2 (Exodus)      kept                     double
        .msh .inp .med .xdmf       kept                     double; by meshlane, the extra "formats"
        .stl                       triangles, or quads      text double, binary single; corners merged
                                   as trimesh writes them
        .glb .gltf                 triangles, or quads      single
                                   again as from a Trimesh
        =========================  =======================  ===========================================
    quads, wrap
        As in :func:`as_mesh`, for .glb and .gltf, and for grids.
    join : bool, default False
        Whether the parts of a scene, or the blocks of a file, are taken as one mesh.

    Returns
    -------
    QuadMesh or QuadGrid
        Vertices as in the file; none is merged (but for STL, which repeats every corner) and none is
        split where only texture coordinates or normals differ (but for GLB, which stores them so).
        Where a file holds triangles alone, in the two blocks of halves that trimesh writes for quads, these
        are paired again, and ``recovery`` says "block". Of faces with nodes on their sides, as quads of 8
        and 9 nodes, the corners are taken.

    Raises
    ------
    MeshError
        A ValueError: the file holds no surface mesh, or not one of these formats, or several parts; or it
        is no regular file but a pipe or a device.
    OSError
        It cannot be opened.

    Warns
    -----
    MeshWarning
        Boundary vertices coincide: see :func:`quadcurv.merge_points`. Cells that are no faces were left
        out. What the mesh itself warns of.

    Notes
    -----
    VTK's files, Exodus, glTF and those of meshlane are read in a process of its own, which may take 20 times
    the memory of the file and 200 MB, and 8 seconds of the processor and one more for every 5 MB.

    Examples
    --------
    >>> import tempfile
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     qc.write(f"{folder}/ball.ply", ball)
    ...     qc.read(f"{folder}/ball.ply")
    QuadMesh(98 points, 96 quads)
    """
    if not isinstance(path, str | os.PathLike):
        raise TypeError(f"path: expected the name of a file, got {type(path).__name__}")
    return _read(path, quads, wrap, True, join)


def _read(path: Any, quads: Any, wrap: Any, seams: bool, join: bool = False) -> QuadMesh | QuadGrid:
    try:
        return _made(_content(path, join), quads, wrap, seams)
    except PartsError as error:
        raise PartsError(f"{os.fspath(path)}: {error}", error.count) from None
    except MeshError as error:
        raise MeshError(f"{os.fspath(path)}: {error}") from error.__cause__


def read_values(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Values that a mesh file holds at its vertices, by name.

    Parameters
    ----------
    path : path-like
        A file that :func:`read` reads.

    Returns
    -------
    dict of str to (n,) or (n, k) array
        As stored; of a grid (r, c) or (r, c, k). Empty where the format holds none.

    Raises
    ------
    MeshError, OSError
        As :func:`read`.

    Examples
    --------
    >>> import tempfile
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     qc.write(f"{folder}/ball.ply", ball, {"H": qc.mean_curvature(ball)})
    ...     {name: values.shape for name, values in qc.read_values(f"{folder}/ball.ply").items()}
    {'H': (98,)}
    """
    try:
        return dict(_content(path).values)
    except MeshError as error:
        raise MeshError(f"{os.fspath(path)}: {error}") from error.__cause__


def _content(path: str | os.PathLike[str], join: bool = False) -> Content:
    path = Path(path)
    suffix = path.suffix.lower()
    try:
        mode = path.stat().st_mode
    except ValueError as error:  # a name that no system has
        raise MeshError(str(error)) from None
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):  # a pipe or a device, which may give bytes without end, or none
        raise MeshError("no regular file")
    if suffix not in FORMATS or (reader := FORMATS[suffix].read) is None:
        raise MeshError(f"cannot read {suffix or 'a file without suffix'}; {_known('read')} can be")
    path.open("rb").close()
    parts = reader(path)
    if isinstance(parts, Content):
        return _as_trimesh_wrote(parts) if suffix in TRIANGULATED else parts
    if not (len(parts) == 1 or (parts and join)):
        hint = "; join=True takes them as one" if parts else ""
        raise PartsError(f"mesh: a Scene of {len(parts)} geometries, expected one{hint}", len(parts))
    return joined(parts)


def _as_trimesh_wrote(content: Content) -> Content:
    """Quads of a file of triangles in blocks of first and second halves, as trimesh writes quads."""
    faces = content.faces
    if not isinstance(faces, np.ndarray) or (faces[:, 3:] >= 0).any() or (faces[:, :3] < 0).any():
        return content
    paired, rule = quads_by_order(faces[:, :3])
    return replace(content, faces=paired, pairing=(rule, len(faces))) if rule == "block" else content


def _known(what: str) -> str:
    """The suffixes that can be read, be written, or hold values."""
    return ", ".join(sorted(suffix for suffix, entry in FORMATS.items() if getattr(entry, what)))


def write(path: str | os.PathLike[str], mesh: Any, point_data: Mapping[str, ArrayLike] | None = None) -> None:
    """Write a mesh file with values at its vertices.

    Parameters
    ----------
    path : path-like
        =====================  ======  =========  =================================================
        suffix                 quads   positions  values
        =====================  ======  =========  =================================================
        .ply                   kept    double     as they are up to double; vectors as NAME_x,
                                                  NAME_y, NAME_z, but "normal" as nx, ny, nz. The
                                                  first scalars are shown in colours too, which is
                                                  what pyvista, ParaView, trimesh and MeshLab see;
                                                  MeshLab also reads the one named "quality",
                                                  Blender all of them
        .vtp .vtu .vtk         kept    double     as they are; .vtkhdf is written by VTK, the extra
        .vtkhdf                                   "view"
        .obj .off              kept    double     none
        .glb                   cut     single     single, as _NAME; the first scalars also as
                                                  colours. Where a value is NaN it is 0, the colour
                                                  grey, and _NAME_known 0
        =====================  ======  =========  =================================================

        Polygons of more than four sides are kept where quads are. What is written as .glb, .ply or by VTK
        gives the same values in :func:`read_values`, and the quads of .glb are put together again.
    mesh : object
        Anything :func:`as_mesh` takes but a StaggeredGrid; a grid is written as its faces, row by row.
    point_data : mapping of str to (n,) or (n, 3) array_like
        Of a grid (r, c) or (r, c, 3).

    Raises
    ------
    MeshError
        A ValueError: values of another shape; names or values that the format cannot hold; an unknown
        suffix.
    OSError
        It cannot be written. An old file is then still there: the new one is written beside and renamed.

    Warns
    -----
    PrecisionWarning
        Values or positions lose more than their last digits in the format.

    Examples
    --------
    >>> import tempfile
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> H = qc.mean_curvature(ball)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     qc.write(f"{folder}/ball.vtp", ball, {"H": H})
    ...     bool((qc.read_values(f"{folder}/ball.vtp")["H"] == H).all())
    True
    """
    path = Path(path)
    mesh = as_mesh(mesh)
    surface = face_list(mesh)
    shape = mesh.shape if isinstance(mesh, QuadGrid) else (len(surface.points),)
    data = {
        name: checked_values(name, np.asarray(values), shape) for name, values in (point_data or {}).items()
    }
    kept = ... if not isinstance(mesh, QuadGrid) or mesh.mask is None else ~mesh.mask
    data = {name: array[kept].reshape(-1, *array.shape[len(shape) :]) for name, array in data.items()}
    suffix = path.suffix.lower()
    if suffix not in FORMATS or (writer := FORMATS[suffix].write) is None:
        raise MeshError(f"{path}: cannot write {suffix or 'a file without suffix'}; {_known('write')} can be")
    if data and not FORMATS[suffix].holds_values:
        raise MeshError(f"point_data: {suffix} holds no values; {_known('holds_values')} do")
    with replacing(path) as beside:
        writer(beside, surface, data)


def face_list(mesh: Any, seams: bool = True) -> QuadMesh:
    """Anything that as_mesh takes as a QuadMesh; a StaggeredGrid is none."""
    mesh = opened(mesh, seams=seams)
    if isinstance(mesh, StaggeredGrid):
        raise MeshError("mesh: a StaggeredGrid is no face list")
    return mesh.to_mesh() if isinstance(mesh, QuadGrid) else mesh
