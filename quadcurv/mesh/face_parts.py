"""A face list larger than memory, in parts on disk, each to be read with what lies around it."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quadcurv.checks import Finding, Report, unit_roundoff
from quadcurv.mesh.face_list import QuadMesh
from quadcurv.types import Bools, Indices, Ints, MeshError, MeshWarning

CHUNK = 1 << 20  # vertices or faces that are read at a time
_SAMPLE = 200_000  # of the points, by which space is divided
_SCATTERED = 1.3  # parts that a face has vertices of, on average, from which on the order of vertices is bad


class Part(NamedTuple):
    """A part of a mesh with what lies around it.

    Attributes
    ----------
    mesh : QuadMesh
        Vertices in their order in the whole mesh, beyond the rim with the rings that they have there.
    own : (k,) int64
        Which of its vertices are the part's.
    vertices : (k,) int64
        Their numbers in the whole mesh.
    said : str
        What a mesh of these faces warns of, "" if of nothing.
    """

    mesh: QuadMesh
    own: Indices
    vertices: Indices
    said: str


@dataclass(frozen=True, eq=False, init=False, repr=False)
class FaceParts:
    """A face list larger than memory, computed part by part, here or by the workers of a dask client.

    Making one reads faces and points once and writes the faces of each part to a folder. A part is read with
    as many rings of faces around it as its vertices look at: results are bitwise those of one
    :class:`QuadMesh`.

    Parameters
    ----------
    points : (n, 3) array-like
        Anything with ``shape``, ``dtype`` and slices: a ``numpy.memmap`` of an .npy file, a dataset of h5py
        such as ``Points`` of a VTKHDF file. What is no memmap is copied into the folder.
    faces : (m, 4) or (m, 3) array-like of int
        As of :class:`QuadMesh`, with slices.
    folder : path-like
        Where the parts are kept, 20 bytes a face, and of vertices in no good order 28 bytes each; workers
        must see it. It must be empty, or not there.
    parts : int, optional
        How many; by default so many that each has half a million vertices.
    client : distributed.Client, optional
        Whose workers compute, one part each at a time; a part whose worker dies is computed by another one.
        Without it parts are computed here, one after the other.

    Attributes
    ----------
    shape : (int,)
        How many vertices there are.
    parts : int
    renumbered : bool
        Whether parts are pieces of space, in the order of Morton's curve, since neighbours are far apart in
        the given order. Results are in the given order.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes or types, indices out of range, points that are not finite; when computed,
        faces that run against their neighbours: which way they are to turn no part knows alone.

    See Also
    --------
    quadcurv.evaluate : Computes, into arrays on disk too.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from tempfile import TemporaryDirectory
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((16, 16), "faces")
    >>> with TemporaryDirectory() as folder:
    ...     parts = qc.FaceParts(ball.points, ball.faces, folder, parts=3)
    ...     H = qc.evaluate(parts, "mean_curvature", scheme="liu")["mean_curvature"]
    >>> bool((H == qc.mean_curvature(ball, "liu")).all())
    True
    """

    folder: Path
    shape: tuple[int]
    cuts: Indices
    renumbered: bool
    has_triangles: bool
    roundoff: float
    largest: float
    client: Any
    _source: tuple[str, int, str, tuple[int, ...]]

    def __init__(
        self,
        points: Any,
        faces: Any,
        folder: str | os.PathLike[str],
        parts: int | None = None,
        client: Any = None,
    ) -> None:
        n = _checked_shape(points, "points", "fiu", (3,))
        m = _checked_shape(faces, "faces", "iu", (3, 4))
        if n > np.iinfo(np.int32).max // 4 or m > np.iinfo(np.int32).max:
            raise MeshError(f"points: {n} and {m} faces are more than 32-bit indices can number")
        if parts is None:
            parts = max(1, n // (CHUNK // 2))
        if isinstance(parts, bool) or not isinstance(parts, int | np.integer) or not 1 <= parts <= n:
            raise MeshError(f"parts: expected a whole number from 1 to {n}, got {parts!r}")
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        if any(place.iterdir()):
            raise MeshError(f"folder: {place} is not empty")
        cuts = np.arange(parts + 1) * n // parts
        number, largest = np.empty(0, np.int32), _largest(points)
        renumbered = parts > 1 and _scattered(faces, cuts)
        if renumbered:
            cuts, number = _renumber(points, parts, place)
            source = _mapped(np.load(place / "points.npy", mmap_mode="r"))
        else:
            source = _mapped(points) if _is_a_file(points) else _copied(points, place)
        self.__dict__.update(
            folder=place, shape=(n,), cuts=cuts, renumbered=renumbered, client=client,
            roundoff=unit_roundoff(points), largest=largest, _source=source,
        )  # fmt: skip
        self.__dict__["has_triangles"] = _write_parts(faces, n, cuts, number, place)

    def __repr__(self) -> str:
        return f"FaceParts({self.shape[0]} points in {self.parts} parts)"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"client": None}

    @property
    def parts(self) -> int:
        """How many parts there are."""
        return len(self.cuts) - 1

    def part(self, p: int, rings: int, everywhere: bool, origin: int | None = None) -> Part | None:
        """Part p with so many rings of faces around its irregular vertices, or around all of them.

        None if it has no faces. Schemes compute relative to a vertex, the first one of all or, if there is an
        `origin`, this one for irregular vertices: both come first, without faces.

        Raises
        ------
        MeshError
            Faces run against their neighbours.
        """
        faces = self._faces(p)
        if len(faces) == 0:
            return None
        begin, end = int(self.cuts[p]), int(self.cuts[p + 1])
        first = [0] if origin is None else [0, origin]
        origins = np.array([self._number(v) for v in first], np.int64)
        made, vertices = self._mesh(faces, begin, end, origins)
        inner = self._inner(vertices, begin, end, len(origins))
        irregular = made.connectivity.irregular
        wanted = np.flatnonzero(inner) if everywhere else irregular[inner[irregular]]
        complete = inner
        if wanted.size:
            more, reached = self._around(faces, np.sort(vertices[wanted]), rings, begin, end)
            if len(more) > len(faces):
                made, vertices = self._mesh(more, begin, end, origins)
                inner = self._inner(vertices, begin, end, len(origins))
            complete = inner | np.isin(vertices, reached)
            complete[: len(origins)] = False
        known = made.connectivity
        _refuse_turned(known.findings)
        own = np.flatnonzero(inner)
        irregular = known.irregular[complete[known.irregular]]
        if origin is not None:
            irregular = np.concatenate(([1], irregular))
        # Vertices at the rim have more faces than are here: they are no border.
        kind = np.where(complete, known.kind, _interior()).astype(np.uint8)
        said = Report([finding._replace(first="") for finding in known.findings]).warning
        made = made.with_connectivity(replace(known, irregular=irregular, kind=kind))
        return Part(made, own, self._given_numbers(vertices[own]), said)

    def owned(self, p: int) -> Indices:
        """Numbers of the vertices of part p in the whole mesh."""
        return self._given_numbers(np.arange(self.cuts[p], self.cuts[p + 1]))

    def first_irregular(self) -> int | None:
        """The first vertex without a regular ring, None if there is none; the first parts tell, or all."""
        found = []
        for p in range(self.parts):
            faces = self._faces(p)
            if len(faces) == 0:
                continue
            begin, end = int(self.cuts[p]), int(self.cuts[p + 1])
            made, vertices = self._mesh(faces, begin, end, np.empty(0, np.int64))
            irregular = vertices[made.connectivity.irregular]
            irregular = irregular[(irregular >= begin) & (irregular < end)]
            if irregular.size:
                found.append(int(self._given_numbers(irregular).min()))
                if not self.renumbered:
                    break
        return min(found, default=None)

    @staticmethod
    def _inner(vertices: Indices, begin: int, end: int, origins: int) -> Bools:
        """Which vertices of a mesh are begin..end, its first ones aside."""
        inner = (vertices >= begin) & (vertices < end)
        inner[:origins] = False
        return inner

    def _number(self, vertex: int) -> int:
        """Number of a vertex here."""
        if not self.renumbered:
            return vertex
        order = np.load(self.folder / "order.npy", mmap_mode="r")
        return next(
            begin + int(np.flatnonzero(x == vertex)[0]) for begin, x in _chunks(order) if (x == vertex).any()
        )

    def _faces(self, p: int) -> Ints:
        """(k, 5): number and vertices of all faces with a vertex of part p."""
        return np.fromfile(self.folder / f"faces{p}.bin", np.int32).reshape(-1, 5)

    def _points(self, vertices: Indices) -> Any:
        path, offset, dtype, shape = self._source
        return np.asarray(np.memmap(path, dtype, "r", offset, shape)[vertices])

    def _given_numbers(self, vertices: Indices) -> Indices:
        if not self.renumbered:
            return vertices.astype(np.int64)
        return np.load(self.folder / "order.npy", mmap_mode="r")[vertices].astype(np.int64)

    def _mesh(self, faces: Ints, begin: int, end: int, origins: Indices) -> tuple[QuadMesh, Indices]:
        """A mesh of faces (k, 5), most of them of vertices begin..end, and the numbers of its vertices.

        They are in the order that the whole mesh has.
        """
        corners = faces[:, 1:]
        own = (corners >= begin) & (corners < end)
        used = np.zeros(end - begin, bool)
        used[corners[own] - begin] = True
        beyond = np.unique(corners[~own])
        beyond = beyond[beyond >= 0].astype(np.int64)
        vertices: Indices = np.concatenate(
            (beyond[beyond < begin], begin + np.flatnonzero(used), beyond[beyond >= end])
        )
        place = np.arange(len(vertices), dtype=np.int32)
        if self.renumbered:
            order = np.argsort(self._given_numbers(vertices))
            place[order] = np.arange(len(vertices))
        local = np.full(corners.shape, -1, np.int32)
        within = np.cumsum(used) - 1 + np.count_nonzero(beyond < begin)
        local[own] = place[within[corners[own] - begin]]
        other = ~own & (corners >= 0)
        local[other] = place[np.searchsorted(vertices, corners[other])]
        vertices = vertices[order] if self.renumbered else vertices
        # Vertices that schemes have as origins in the whole mesh come first, without faces.
        vertices = np.concatenate((origins, vertices))
        local[local >= 0] += len(origins)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MeshWarning)
            return QuadMesh(self._points(vertices), local), vertices

    def _around(
        self, faces: Ints, vertices: Indices, rings: int, begin: int, end: int
    ) -> tuple[Ints, Indices]:
        """Faces with those of so many rings around some vertices, and the vertices inside these rings."""
        known = {begin: _Owned(faces, begin, end)}
        fetched, reached, fresh = [faces], np.empty(0, np.int64), vertices
        for ring in range(rings):
            if fresh.size == 0:
                break
            near = []
            owner = np.searchsorted(self.cuts, fresh, side="right") - 1
            for q in np.unique(owner).tolist():
                first, last = int(self.cuts[q]), int(self.cuts[q + 1])
                if first not in known:
                    known[first] = _Owned(self._faces(q), first, last)
                near.append(known[first].touching(fresh[owner == q], rings - ring))
                if first != begin:
                    fetched.append(near[-1])
            reached = np.union1d(reached, fresh)
            corners = np.unique(np.concatenate(near)[:, 1:])
            fresh = np.setdiff1d(corners[corners >= 0], reached)
        everything = np.concatenate(fetched)
        if len(everything) > len(faces):
            _, first_of = np.unique(everything[:, 0], return_index=True)
            everything = everything[first_of]
        return everything, reached


class _Owned:
    """Faces of a part (k, 5), of which those near some of its vertices are asked for again and again."""

    def __init__(self, faces: Ints, begin: int, end: int) -> None:
        self._faces, self._begin, self._n = faces, begin, end - begin
        self._near, self._covered = faces[:0], np.zeros(end - begin, bool)

    def touching(self, vertices: Indices, rings: int) -> Ints:
        """Faces around vertices of the part; soon those of so many rings will have been asked for."""
        from quadcurv.kernels import topology

        at = vertices - self._begin
        if not self._covered[at].all():
            # Only what lies within so many rings of these is looked at again, until others are asked for.
            self._covered[at] = True
            local = self._local(self._faces)
            some = np.flatnonzero(self._covered)
            inside = local[topology.surroundings(local, some, self._n + 1, rings - 1)]
            self._near = self._faces[topology.surroundings(local, some, self._n + 1, rings)]
            self._covered[inside[(inside >= 0) & (inside < self._n)]] = True
        marked = np.zeros(self._n + 1, bool)
        marked[at] = True
        return self._near[np.max(marked[self._local(self._near)], axis=1)]

    def _local(self, faces: Ints) -> Ints:
        """Vertices of faces counted from the first one of the part, those of others all as one behind it."""
        corners = faces[:, 1:]
        local = corners - np.int32(self._begin)
        beyond = np.where(corners < 0, np.int32(-1), np.int32(self._n))
        return np.ascontiguousarray(np.where((local >= 0) & (local < self._n), local, beyond))


def _refuse_turned(findings: tuple[Finding, ...]) -> None:
    if any(finding.kind in ("turned", "non_orientable") for finding in findings):
        raise MeshError(
            "faces: some run against their neighbours, and which way they are to turn no part knows alone: "
            "give faces that agree, as quadcurv.orient makes them"
        )


def _interior() -> int:
    from quadcurv.kernels import topology

    return topology.INTERIOR


def _checked_shape(array: Any, name: str, kinds: str, columns: tuple[int, ...]) -> int:
    shape, dtype = getattr(array, "shape", None), getattr(array, "dtype", None)
    if shape is None or dtype is None:
        raise MeshError(f"{name}: expected an array with slices, got {type(array).__name__}")
    if len(shape) != 2 or shape[1] not in columns or shape[0] < 1:
        raise MeshError(f"{name}: shape {tuple(shape)}, expected ({'nm'[name == 'faces']}, {columns[-1]})")
    if dtype.kind not in kinds:
        raise MeshError(f"{name}: expected numbers of kind {kinds!r}, got dtype {dtype}")
    return int(shape[0])


def _chunks(array: Any) -> Iterator[tuple[int, Any]]:
    """Where each chunk of rows begins, and the chunk in memory."""
    for begin in range(0, array.shape[0], CHUNK):
        yield begin, np.asarray(array[begin : begin + CHUNK])


def _largest(points: Any) -> float:
    """Largest size of any coordinate.

    Raises
    ------
    MeshError
        Points that are not finite.
    """
    largest = 0.0
    for begin, x in _chunks(points):
        bad = ~np.isfinite(x).all(axis=1)
        if bad.any():
            raise MeshError(
                f"points: {np.count_nonzero(bad)} non-finite point(s) among those from {begin} on, first "
                f"vertex {begin + int(np.argmax(bad))}"
            )
        largest = max(largest, float(np.abs(x).max()))
    return largest


def _is_a_file(points: Any) -> bool:
    """Whether points are all that a file holds from some place on, so that others can map it as well."""
    return (
        isinstance(points, np.memmap)
        and points.filename is not None
        and points.flags.c_contiguous
        and points.offset + points.nbytes == os.path.getsize(points.filename)
    )


def _mapped(points: np.memmap) -> tuple[str, int, str, tuple[int, ...]]:
    """Where a worker finds points."""
    return os.path.abspath(str(points.filename)), points.offset, points.dtype.str, points.shape


def _new_points(points: Any, place: Path) -> np.memmap:
    dtype = points.dtype if points.dtype.kind == "f" else np.dtype(float)
    return np.lib.format.open_memmap(place / "points.npy", "w+", dtype, (int(points.shape[0]), 3))


def _copied(points: Any, place: Path) -> tuple[str, int, str, tuple[int, ...]]:
    copy = _new_points(points, place)
    for begin, x in _chunks(points):
        copy[begin : begin + len(x)] = x
    copy.flush()
    return _mapped(np.load(place / "points.npy", mmap_mode="r"))


def _as_table(x: Any, n: int, begin: int) -> Ints:
    """A chunk of faces as (k, 4) int32, checked."""
    low, high = (-1 if x.shape[1] == 4 else 0), n - 1
    wrong = (x > high) | (x < low)
    if x.shape[1] == 4:
        wrong[:, :3] |= x[:, :3] < 0
    bad = wrong.any(axis=1)
    if bad.any():
        first = int(np.argmax(bad))
        raise MeshError(
            f"faces: {np.count_nonzero(bad)} face(s) with an index outside 0..{n - 1}, first face "
            f"{begin + first}: {x[first].tolist()}"
        )
    table = np.full((len(x), 4), -1, np.int32)
    table[:, : x.shape[1]] = x
    return table


def _scattered(faces: Any, cuts: Indices) -> bool:
    """Whether ranges of vertices would have many faces in common."""
    step = max(1, faces.shape[0] // 64)
    parts: list[int] = []
    for begin in range(0, faces.shape[0], step):
        x = np.asarray(faces[begin : begin + 256])
        owner = np.sort(np.searchsorted(cuts, np.maximum(x, 0), side="right"), axis=1)
        parts += (1 + (np.diff(owner, axis=1) != 0).sum(axis=1)).tolist()
    return float(np.mean(parts)) > _SCATTERED


def _renumber(points: Any, parts: int, place: Path) -> tuple[Indices, Ints]:
    """Write points in the order of parts that are pieces of space; where parts begin, new numbers of all."""
    from quadcurv.kernels.parts import curve

    n = int(points.shape[0])
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for _, x in _chunks(points):
        low, high = np.minimum(low, x.min(axis=0)), np.maximum(high, x.max(axis=0))
    size = float((high - low).max())
    step = max(1, n // _SAMPLE)
    sample = np.concatenate([x[-begin % step :: step] for begin, x in _chunks(points)])
    keys = np.sort(curve(sample, low, size))
    split = keys[np.arange(1, parts) * len(keys) // parts]
    owner = np.empty(n, np.int32)
    for begin, x in _chunks(points):
        owner[begin : begin + len(x)] = np.searchsorted(split, curve(x, low, size), side="right")
    cuts = np.concatenate(([0], np.cumsum(np.bincount(owner, minlength=parts))))
    number, begin_of = np.empty(n, np.int32), cuts[:-1].copy()
    moved = _new_points(points, place)
    order = np.lib.format.open_memmap(place / "order.npy", "w+", np.int32, (n,))
    for begin, x in _chunks(points):
        own = owner[begin : begin + len(x)]
        at = np.argsort(own, kind="stable")
        count = np.bincount(own, minlength=parts)
        to = np.repeat(begin_of - np.concatenate(([0], np.cumsum(count)[:-1])), count) + np.arange(len(x))
        number[begin + at] = to
        moved[to], order[to] = x[at], begin + at
        begin_of += count
    moved.flush()
    order.flush()
    return cuts, number


def _write_parts(faces: Any, n: int, cuts: Indices, number: Ints, place: Path) -> bool:
    """Write to a file a part all faces with a vertex of it, in their order; whether any is a triangle."""
    from quadcurv.kernels.parts import by_part

    has_triangles = False
    files = [open(place / f"faces{p}.bin", "wb") for p in range(len(cuts) - 1)]  # noqa: SIM115
    try:
        for begin, x in _chunks(faces):
            table = _as_table(x, n, begin)
            has_triangles |= bool((table[:, 3] < 0).any())
            out, first = by_part(table, begin, cuts, number)
            for p in np.flatnonzero(np.diff(first)).tolist():
                files[p].write(memoryview(out[first[p] : first[p + 1]]).cast("B"))
    finally:
        for file in files:
            file.close()
    return has_triangles
