"""What is refused of a mesh, what is mended, and how it is said: what, where first, how often."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.device_arrays import as_cupy, is_on_device, on_host
from quadcurv.ragged import Faces
from quadcurv.stencils import Polygons
from quadcurv.types import Bools, Floats, Indices, Ints, MeshError

LARGEST = 1e70
_FINDINGS = {
    "collapsed": "face(s) with a repeated vertex, taken without the repetition",
    "dropped": "face(s) of fewer than three distinct vertices, left out",
    "double": "face(s) given twice, taken once",
    "hanging": "vertices on an edge between two others, in one of its faces: left out, without curvature",
    "turned": "face(s) turned to agree with their neighbours",
    "masked": "point(s) without a position, taken as holes",
    "nonmanifold": "edge(s) with more than two faces, whose ends have no curvature",
    "fans": "vertices where several fans touch, which have no curvature",
    "isolated": "vertices without a face, which have no curvature",
    "cut": "polygon(s) of more than four sides, cut into triangles for schemes of quads",
    "inside_out": "the mesh is closed and inside out: its normals point inward",
    "non_orientable": "the mesh is non-orientable: its mean curvature has no sign, |H| is given",
}
_WARNED = ("collapsed", "dropped", "double", "hanging", "turned", "masked", "nonmanifold", "non_orientable")


class Finding(NamedTuple):
    """Something in a mesh that was mended, or that has no answer: what, how often, where first (or "")."""

    kind: str
    number: int
    first: str

    def __str__(self) -> str:
        text = _FINDINGS[self.kind]
        return f"{self.number} {text}, first {self.first}" if self.first else text


class Report:
    """What was mended in a mesh, and what has no answer there.

    ``report["turned"]`` is a count, 0 where there is nothing of the kind; ``str(report)`` is one line.

    Attributes
    ----------
    findings : tuple of Finding
        Of the kinds "collapsed", "dropped", "double", "hanging", "turned" and "masked", which were mended;
        "nonmanifold", "fans" and "isolated", whose vertices are NaN; "cut", "inside_out" and
        "non_orientable".
    """

    def __init__(self, findings: Iterable[Finding]) -> None:
        self.findings = tuple(findings)

    def __getitem__(self, kind: str) -> int:
        if kind not in _FINDINGS:
            raise KeyError(f"kind: expected one of {', '.join(_FINDINGS)}, got {kind!r}")
        return sum(f.number for f in self.findings if f.kind == kind)

    def __bool__(self) -> bool:
        return bool(self.findings)

    def __str__(self) -> str:
        return "; ".join(map(str, self.findings)) or "nothing mended"

    def __repr__(self) -> str:
        return f"Report({self})"

    @property
    def warning(self) -> str:
        """What the caller should hear of without asking, in one line; empty if there is nothing."""
        return "; ".join(str(f) for f in self.findings if f.kind in _WARNED)


class GivenFaces(NamedTuple):
    """Faces as given, indices checked and repetitions taken out.

    Attributes
    ----------
    table : (m, 4) int32
        Triangles, -1 behind them, and quads.
    source : (m,) int64 or None
        The given face that each is; None: itself.
    large : Polygons or None
        Those of more than four sides.
    large_source : (k,) int64
    findings : list of Finding
    """

    table: Ints
    source: Indices | None
    large: Polygons | None
    large_source: Indices
    findings: list[Finding]


def _first_and_count(bad: Any) -> tuple[int, int]:
    return int(np.argmax(bad)), int(np.count_nonzero(bad))


def checked_points(points: ArrayLike, name: str, shape: tuple[Any, ...]) -> Floats:
    """Read-only C-contiguous float64; a number in `shape` is required, a letter is free."""
    from quadcurv.kernels.extent import largest

    if is_on_device(points):
        return _checked_on_device(points, name, shape)
    _refuse_elsewhere(points, name)
    try:
        given = np.asarray(points)
    except (ValueError, OverflowError):  # rows of different lengths, integers beyond all floats
        given = np.empty(0, object)
    if isinstance(points, np.ma.MaskedArray) and np.ma.is_masked(points):
        raise MeshError(f"{name}: masked entries, expected a number in each")
    if given.dtype.kind not in "fiu":
        raise MeshError(f"{name}: expected real numbers, got dtype {given.dtype}")
    if given.ndim != len(shape) or any(
        isinstance(want, int) and have != want for have, want in zip(given.shape, shape, strict=True)
    ):
        raise MeshError(f"{name}: shape {given.shape}, expected ({', '.join(map(str, shape))})")
    if given.dtype != np.float64:
        with np.errstate(over="ignore"):  # of long doubles; they are found below
            given = given.astype(np.float64)
    array = np.ascontiguousarray(given).view()
    array.flags.writeable = False
    size = largest(array)
    if not isfinite(size):
        first, count = _first_and_count(~np.isfinite(array.reshape(-1, 3)).all(axis=1))
        where = np.unravel_index(first, array.shape[:-1])
        at = first if array.ndim == 2 else tuple(map(int, where))
        raise MeshError(f"{name}: {count} non-finite point(s), first vertex {at}: {array[where]}")
    if array.size:
        rows = array.reshape(-1, 3)
        # The square of an area, hence the fourth power of a length, must neither overflow nor vanish.
        if size > LARGEST:
            first, count = _first_and_count((np.abs(rows) > LARGEST).any(axis=1))
            raise MeshError(
                f"{name}: {count} point(s) beyond {LARGEST:g}, whose areas overflow, first vertex {first}"
            )
        one, other = rows[0].tolist(), rows[len(rows) // 2].tolist()
        if all(abs(a - b) < 1 / LARGEST for a, b in zip(one, other, strict=True)) and (
            0 < np.ptp(rows, axis=0).max() < 1 / LARGEST
        ):
            raise MeshError(f"{name}: all within {1 / LARGEST:g} of each other, where areas vanish")
    return array


def _checked_on_device(points: Any, name: str, shape: tuple[Any, ...]) -> Any:
    """As `checked_points`, a cupy array."""
    given = as_cupy(points)
    if given.dtype.kind not in "fiu":
        raise MeshError(f"{name}: expected real numbers, got dtype {given.dtype}")
    if given.ndim != len(shape) or any(
        isinstance(want, int) and have != want for have, want in zip(given.shape, shape, strict=True)
    ):
        raise MeshError(f"{name}: shape {given.shape}, expected ({', '.join(map(str, shape))})")
    array = given.astype(np.float64, order="C", copy=False)
    good = (abs(array) <= LARGEST).reshape(-1, 3).all(axis=1)
    if array.size and not bool(good.all()):
        bad = np.flatnonzero(~on_host(good))
        raise MeshError(
            f"{name}: {bad.size} point(s) that are not finite or beyond {LARGEST:g}, first vertex {bad[0]}"
        )
    return array


def _refuse_elsewhere(points: Any, name: str) -> None:
    """Refuse what is not in memory, before anything loads it."""
    if type(points) is np.ndarray:
        return
    graph = getattr(points, "__dask_graph__", None)
    lazy = graph is not None and graph() is not None
    on_disk = type(points).__module__.partition(".")[0] in ("h5py", "zarr") and hasattr(points, "dtype")
    if lazy or on_disk:
        raise MeshError(
            f"{name}: a lazy array ({type(points).__name__}), expected one in memory: "
            "qc.ChunkedGrid computes it block by block"
        )


def refuse_on_device(points: Any, name: str) -> None:
    """Refuse what lies on a device, where only face lists and grids of vertices are computed."""
    if is_on_device(points):
        raise MeshError(
            f"{name}: on a device, where QuadGrid and QuadMesh alone are computed; give positions in memory"
        )


def unit_roundoff(points: ArrayLike) -> float:
    """Relative rounding error of positions as they are given; integers have that of doubles."""
    dtype = getattr(points, "dtype", np.dtype(float))
    return float(np.finfo(dtype if dtype.kind == "f" else float).eps) / 2


def masked_points(points: Any, mask: ArrayLike | None) -> tuple[Floats, Bools | None, list[Finding]]:
    """Points of a grid, NaN where masked; the mask if it hides any; what is NaN without being masked."""
    _refuse_elsewhere(points, "points")
    given = np.ma.getdata(points) if isinstance(points, np.ma.MaskedArray) else points
    findings: list[Finding] = []
    if is_on_device(points):
        if mask is not None:
            raise MeshError("mask: grids on a device have no holes; give points in memory")
        return checked_points(points, "points", ("r", "c", 3)), None, findings
    hidden = _hidden(points, mask)
    if hidden is None:
        try:
            return checked_points(given, "points", ("r", "c", 3)), None, findings
        except MeshError:
            nan = _without_position(given)
            if nan is None:
                raise
            hidden = np.zeros(nan.shape, bool)
    else:
        nan = _without_position(given)
    if nan is not None:
        unexpected = nan & ~hidden
        if unexpected.any():
            first = tuple(map(int, np.argwhere(unexpected)[0]))
            findings.append(Finding("masked", int(np.count_nonzero(unexpected)), f"vertex {first}"))
        hidden = hidden | nan
    if hidden.all():
        raise MeshError(f"mask: all {hidden.size} points are masked")
    # What is hidden must not be looked at: a known point stands there until all are checked.
    filled = np.array(given, np.float64)
    filled[hidden] = filled[tuple(np.argwhere(~hidden)[0])]
    filled = np.array(checked_points(filled, "points", ("r", "c", 3)))
    filled[hidden] = np.nan
    filled.flags.writeable = hidden.flags.writeable = False
    return filled, hidden, findings


def _hidden(points: Any, mask: ArrayLike | None) -> Bools | None:
    """(r, c) what a mask or a masked array hides, None if neither is there or hides anything."""
    hidden: Bools | None = None
    if isinstance(points, np.ma.MaskedArray) and np.ma.is_masked(points):
        hidden = np.asarray(np.ma.getmaskarray(points).any(axis=-1))
    if mask is not None:
        given, shape = np.asarray(mask), np.shape(points)[:-1]
        if given.dtype != bool or given.shape != shape:
            raise MeshError(f"mask: expected booleans of shape {shape}, got {given.dtype} of {given.shape}")
        hidden = given.copy() if hidden is None else np.asarray(given | hidden)
    return hidden if hidden is not None and hidden.any() else None


def _without_position(points: Any) -> Bools | None:
    """(r, c) where a coordinate is NaN; None of what is no grid of floats or has no such point."""
    try:
        array = np.asarray(points)
    except (ValueError, OverflowError):  # as in `checked_points`, which says so
        return None
    if array.ndim != 3 or array.shape[2] != 3 or array.dtype.kind != "f":
        return None
    nan = np.isnan(array).any(axis=2)
    return nan if nan.any() else None


def checked_wrap(wrap: Sequence[bool]) -> tuple[bool, bool]:
    """Two booleans."""
    given = list(wrap) if np.iterable(wrap) else []
    if len(given) != 2 or not all(isinstance(w, bool | np.bool_) for w in given):
        raise MeshError(f"wrap: expected two booleans, got {wrap!r}")
    return bool(given[0]), bool(given[1])


def checked_faces(faces: Any, n: int) -> GivenFaces:
    """Faces over n vertices as arrays.

    Raises
    ------
    MeshError
        A ValueError: no faces or points, wrong types or shapes, indices out of range, with the first face.
    """
    from quadcurv.kernels import topology

    if n == 0:
        raise MeshError("points: none given")
    if n > np.iinfo(np.int32).max // 4:
        raise MeshError(f"points: {n} are more than 32-bit indices can number")
    if np.ma.is_masked(faces):
        raise MeshError("faces: masked entries, expected an index in each")
    try:
        given = np.empty(0, object) if isinstance(faces, Faces) else np.asarray(faces)
    except ValueError:  # polygons of different lengths
        given = np.empty(0, object)
    if given.ndim == 2 and given.shape[1] in (3, 4):
        if given.dtype.kind not in "iu":
            raise MeshError(f"faces: expected integer indices, got dtype {given.dtype}")
        if given.dtype == np.uint64:  # the largest must not come out as -1
            given = np.minimum(given, np.uint64(np.iinfo(np.int64).max))
        table = np.ascontiguousarray(given, np.int32 if given.dtype == np.int32 else np.int64).view()
        table.flags.writeable = False  # of one type for the compiler, whatever the caller's is
        found = _from_table(table, n, topology.checked)
    else:
        found = _from_polygons(faces, n)
    if len(found.table) == 0 and found.large is None:
        left = f" is left of those given: {found.findings[0]}" if found.findings else " given"
        raise MeshError(f"faces: none{left}")
    return found


def _from_table(table: Any, n: int, checked: Any) -> GivenFaces:
    faces = np.empty((len(table), 4), np.int32)
    (outside, n_outside), (_, n_repeated) = checked(table, n, faces)
    if n_outside:
        raise MeshError(
            f"faces: {n_outside} face(s) with an index outside 0..{n - 1}, "
            f"first face {outside}: {[*table[outside].tolist(), -1][:4]}"
        )
    none = np.empty(0, np.int64)
    if not n_repeated:
        return GivenFaces(faces, None, None, none, [])
    a, b, c, d = faces.T
    repeated = (a == b) | (b == c) | (c == a) | ((d >= 0) & ((d == a) | (d == b) | (d == c)))
    kept, mended = np.ones(len(faces), bool), np.flatnonzero(repeated)
    for f in mended.tolist():
        face = without_repetition([v for v in faces[f].tolist() if v >= 0])
        kept[f] = len(face) >= 3
        faces[f] = [*face, -1, -1, -1][:4]
    return GivenFaces(faces[kept], np.flatnonzero(kept), None, none, _mended(mended[kept[mended]], ~kept))


def _from_polygons(faces: Any, n: int) -> GivenFaces:
    try:
        given = Faces.of(faces)
    except TypeError:
        raise MeshError(
            "faces: expected an integer array of shape (m, 3) or (m, 4), or a sequence of polygons"
        ) from None
    given = _without_marks(given)
    if (short := given.sizes < 3).any():
        i = int(np.argmax(short))
        raise MeshError(f"faces: a face has at least 3 vertices, face {i} has {given.sizes[i]}")
    if (outside := (given.corners < 0) | (given.corners >= n)).any():
        i = int(np.searchsorted(given.ends, np.argmax(outside), side="right"))
        raise MeshError(f"faces: face {i} has an index outside 0..{n - 1}: {given[i]}")
    source, collapsed, dropped = np.arange(len(given)), list[int](), np.zeros(len(given), bool)
    if (repeated := given.repeating()).any():
        mended = {i: without_repetition(given[i]) for i in np.flatnonzero(repeated).tolist()}
        dropped[[i for i, face in mended.items() if len(face) < 3]] = True
        collapsed = [i for i, face in mended.items() if 3 <= len(face) < given.sizes[i]]
        rest = np.flatnonzero(~repeated)
        kept = [i for i in mended if not dropped[i]]
        other = Faces.of([mended[i] for i in kept])
        whole = given.chosen(rest)
        both = Faces(np.append(whole.sizes, other.sizes), np.append(whole.corners, other.corners))
        source = np.append(rest, np.array(kept, np.int64))
        order = np.argsort(source)
        given, source = both.chosen(order), source[order]
    large = np.flatnonzero(given.sizes > 4)
    small = given.chosen(np.flatnonzero(given.sizes <= 4))
    table = np.full((len(small), 4), -1, np.int32)
    table[np.arange(4) < small.sizes[:, None]] = small.corners
    polygons = given.chosen(large)
    indptr, corners = np.append(0, polygons.ends), polygons.corners.astype(np.int32)
    return GivenFaces(
        table,
        source[given.sizes <= 4],
        Polygons(indptr, corners, np.empty(0, np.int64)) if large.size else None,
        source[large],
        _mended(np.array(collapsed, np.int64), dropped)
        + ([Finding("cut", large.size, f"face {source[large[0]]}")] if large.size else []),
    )


def _without_marks(faces: Faces) -> Faces:
    """Faces whose fourth entry is the mark -1 of a triangle, without it."""
    marked = np.flatnonzero(faces.sizes == 4)
    marked = marked[faces.corners[faces.ends[marked] - 1] == -1]
    if not marked.size:
        return faces
    sizes = faces.sizes.copy()
    sizes[marked] = 3
    return Faces(sizes, np.delete(faces.corners, faces.ends[marked] - 1))


def without_repetition(face: list[int]) -> list[int]:
    """The face without vertices that follow themselves and without spikes, where it runs to and fro."""
    k = 0
    while len(face) >= 3 and k < len(face):
        before, here, after = face[k - 1], face[k], face[(k + 1) % len(face)]
        if here in (before, after) or before == after:
            del face[k]
            k = 0
        else:
            k += 1
    return face


def _mended(collapsed: Any, dropped: Any) -> list[Finding]:
    found = []
    if len(collapsed):
        found.append(Finding("collapsed", len(collapsed), f"face {collapsed[0]}"))
    if dropped.any():
        first, count = _first_and_count(dropped)
        found.append(Finding("dropped", count, f"face {first}"))
    return found
