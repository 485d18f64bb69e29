"""Points, faces and values in VTKHDF files, read and written in slices by h5py; ParaView opens these."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from quadcurv.types import Indices, MeshError

_FLAT = (5, 7, 9)  # VTK's numbers of triangles, polygons and quads


@dataclass(frozen=True, eq=False, init=False, repr=False)
class VtkHdf:
    """An open VTKHDF file of one piece: a face list of triangles and quads, or a grid as one.

    Nothing is read before it is sliced.

    Parameters
    ----------
    file : h5py.File
        Open, to be written to where :meth:`values` are asked for.

    Attributes
    ----------
    points : (n, 3) dataset
    faces : (m, 4) int64, in slices of its rows
        Vertices, -1 behind those of a triangle.

    Raises
    ------
    MeshError
        A ValueError: no VTKHDF file of PolyData or an UnstructuredGrid, several pieces or time steps; when
        they are read, cells that are neither triangles nor quads.

    Examples
    --------
    >>> import h5py, quadcurv as qc
    >>> from tempfile import TemporaryDirectory
    >>> ball = qc.surfaces.cubed_sphere().sample((16, 16), "faces")[0]
    >>> with TemporaryDirectory() as folder:
    ...     qc.write(f"{folder}/ball.vtkhdf", ball)
    ...     with h5py.File(f"{folder}/ball.vtkhdf", "r+") as file:
    ...         mesh = qc.io.vtkhdf.VtkHdf(file)
    ...         parts = qc.FaceParts(mesh.points, mesh.faces, f"{folder}/parts")
    ...         found = qc.evaluate(parts, out={"mean_curvature": mesh.values("H")})
    ...     H = qc.read_values(f"{folder}/ball.vtkhdf")["H"]
    >>> bool((H == qc.mean_curvature(ball, "finite_volume")).all())
    True
    """

    points: Any
    faces: _Faces
    _group: Any

    def __init__(self, file: Any) -> None:
        group = file.get("VTKHDF")
        kind = b"" if group is None else np.bytes_(group.attrs.get("Type", b""))
        if kind not in (b"PolyData", b"UnstructuredGrid"):
            raise MeshError(f"{file.filename}: no VTKHDF file of PolyData or an UnstructuredGrid")
        if "Steps" in group or len(group["NumberOfPoints"]) != 1:
            raise MeshError(f"{file.filename}: a VTKHDF file of several pieces or time steps")
        faces = group["Polygons"] if kind == b"PolyData" else group
        self.__dict__.update(points=group["Points"], faces=_Faces(faces), _group=group)

    def __repr__(self) -> str:
        return f"VtkHdf({self.points.shape[0]} points, {self.faces.shape[0]} faces)"

    def values(self, name: str, *more: int) -> Any:
        """Dataset of float64 ``(n, *more)`` of values at the points, made if there is none of that name."""
        shape = (self.points.shape[0], *more)
        return self._group.require_group("PointData").require_dataset(name, shape, "float64")

    def grid(self, r: int, c: int) -> Rows:
        """Points in the order of a grid, (r, c, 3) in slices of rows and columns."""
        return Rows(self.points, r, c)

    def grid_values(self, name: str, r: int, c: int, *more: int) -> Rows:
        """:meth:`values` of such a grid, ``(r, c, *more)``."""
        return Rows(self.values(name, *more), r, c)


class _Faces:
    """Faces as a table that is read in slices of its rows."""

    def __init__(self, group: Any) -> None:
        self._corners, self._offsets, self._kinds = (
            group["Connectivity"],
            group["Offsets"],
            group.get("Types"),
        )
        self.shape, self.dtype = (int(self._offsets.shape[0]) - 1, 4), np.dtype(np.int64)

    def __getitem__(self, rows: slice) -> Indices:
        begin, end, step = rows.indices(self.shape[0])
        offsets = np.asarray(self._offsets[begin : max(end, begin) + 1])
        corners, size = np.asarray(self._corners[offsets[0] : offsets[-1]]), np.diff(offsets)
        wrong = (size < 3) | (size > 4)
        if self._kinds is not None:
            wrong |= ~np.isin(self._kinds[begin : max(end, begin)], _FLAT)
        if wrong.any():
            first = int(np.argmax(wrong))
            raise MeshError(f"faces: cell {begin + first} is neither a triangle nor a quad")
        table = np.full((len(size), 4), -1, np.int64)
        table[np.arange(4) < size[:, None]] = corners
        return table[::step]


class Rows:
    """An array (r c, ...) as a grid (r, c, ...) that is read and written in slices of rows and columns."""

    def __init__(self, array: Any, r: int, c: int) -> None:
        if array.shape[0] != r * c:
            raise MeshError(f"points: {array.shape[0]} are no grid of {r} x {c}")
        self._array, self.shape, self.dtype = array, (r, c, *array.shape[1:]), array.dtype

    def __getitem__(self, index: tuple[slice, slice]) -> Any:
        (begin, end, _), columns = index[0].indices(self.shape[0]), index[1]
        c = self.shape[1]
        rows = self._array[begin * c : max(end, begin) * c]
        return rows.reshape(-1, *self.shape[1:])[:, columns]

    def __setitem__(self, index: tuple[slice, slice], values: Any) -> None:
        (begin, end, _), (first, last, _) = (s.indices(n) for s, n in zip(index, self.shape, strict=False))
        c = self.shape[1]
        if last - first == c:
            self._array[begin * c : end * c] = np.asarray(values).reshape(-1, *self.shape[2:])
            return
        for i in range(begin, end):
            self._array[i * c + first : i * c + last] = values[i - begin]
