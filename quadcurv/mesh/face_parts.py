"""A face list larger than memory, in parts on disk, each to be read with what lies around it."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quadcurv.checks import Report, checked_points, unit_roundoff
from quadcurv.connectivity import Connectivity, connect
from quadcurv.mesh import part_files, part_sides
from quadcurv.mesh.face_list import QuadMesh
from quadcurv.types import Bools, Indices, Ints, MeshError

_VERTICES = 1 << 19  # of a part, where nobody says
_NONE = np.empty(0, np.int64)


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
        Where the parts are kept, 20 bytes a face, and of vertices in no good order 32 bytes each; workers
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
        A ValueError: wrong shapes or types, indices out of range, points that are not finite.

    Warns
    -----
    MeshWarning
        When computed, with what was mended. Faces that run against their neighbours are found then: which are
        to turn is told by all parts, of which those that hang together are joined, and computing begins anew.

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
    _sample: Ints

    def __init__(
        self,
        points: Any,
        faces: Any,
        folder: str | os.PathLike[str],
        parts: int | None = None,
        client: Any = None,
    ) -> None:
        n = part_files.checked_shape(points, "points", "fiu", (3,))
        m = part_files.checked_shape(faces, "faces", "iu", (3, 4))
        if n > np.iinfo(np.int32).max // 4 or m > np.iinfo(np.int32).max:
            raise MeshError(f"points: {n} and {m} faces are more than 32-bit indices can number")
        if parts is None:
            parts = max(1, n // _VERTICES)
        if isinstance(parts, bool) or not isinstance(parts, int | np.integer) or not 1 <= parts <= n:
            raise MeshError(f"parts: expected a whole number from 1 to {n}, got {parts!r}")
        if client is not None and not hasattr(client, "submit"):
            raise MeshError(f"client: expected a distributed.Client, got {type(client).__name__}")
        place = Path(folder)
        place.mkdir(parents=True, exist_ok=True)
        if any(place.iterdir()):
            raise MeshError(f"folder: {place} is not empty")
        cuts = np.arange(parts + 1) * n // parts
        number, largest = np.empty(0, np.int32), part_files.largest(points)
        renumbered = parts > 1 and part_files.scattered(faces, cuts)
        if renumbered:
            cuts, number = part_files.renumber(points, parts, place)
            source = part_files.mapped(np.load(place / "points.npy", mmap_mode="r"))
        elif part_files.is_a_file(points):
            source = part_files.mapped(points)
        else:
            source = part_files.copied(points, place)
        self.__dict__.update(
            folder=place, shape=(n,), cuts=cuts, renumbered=renumbered, client=client,
            roundoff=unit_roundoff(points), largest=largest, _source=source,
        )  # fmt: skip
        triangles, sample = part_files.write_parts(faces, n, cuts, number, place)
        self.__dict__.update(has_triangles=triangles, _sample=sample)

    def __repr__(self) -> str:
        return f"FaceParts({self.shape[0]} points in {self.parts} parts)"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"client": None}

    @property
    def parts(self) -> int:
        """How many parts there are."""
        return len(self.cuts) - 1

    @property
    def sides(self) -> part_sides.Sides | None:
        """Which faces are turned, None while nobody has asked: none need be where no part finds any."""
        return part_sides.known(self.folder)

    def part(self, p: int, rings: int, everywhere: bool, origin: int | None = None) -> Part | None:
        """Part p with so many rings of faces around its irregular vertices, or around all of them.

        None if it has no faces. Schemes compute relative to a vertex, the first one of all or, if there is an
        `origin`, this one for irregular vertices: both come first, without faces.

        Raises
        ------
        SidesError
            Faces run against their neighbours, and `sides` is None.
        """
        faces = self.faces_of(p)
        if len(faces) == 0:
            return None
        begin, end = int(self.cuts[p]), int(self.cuts[p + 1])
        first = [0] if origin is None else [0, origin]
        origins = np.array([self._number(v) for v in first], np.int64)
        made, vertices = self.mesh_of(faces, begin, end, origins)
        inner = self._inner(vertices, begin, end, len(origins))
        irregular = made.connectivity.irregular
        wanted = np.flatnonzero(inner) if everywhere else irregular[inner[irregular]]
        complete = inner
        if wanted.size:
            more, reached = self._around(faces, np.sort(vertices[wanted]), rings, begin, end)
            if len(more) > len(faces):
                made, vertices = self.mesh_of(more, begin, end, origins)
                inner = self._inner(vertices, begin, end, len(origins))
            complete = inner | np.isin(vertices, reached)
            complete[: len(origins)] = False
        known = made.connectivity
        own = np.flatnonzero(inner)
        irregular = known.irregular[complete[known.irregular]]
        if origin is not None:
            irregular = np.concatenate(([1], irregular))
        # Vertices at the rim have more faces than are here: they are no border.
        kind = np.where(complete, known.kind, _interior()).astype(np.uint8)
        mended = (finding._replace(first="") for finding in known.findings if finding.kind != "turned")
        made = made.with_connectivity(replace(known, irregular=irregular, kind=kind))
        return Part(made, own, self._given_numbers(vertices[own]), Report(mended).warning)

    def owned(self, p: int) -> Indices | slice:
        """Numbers of the vertices of part p in the whole mesh."""
        if not self.renumbered:
            return slice(int(self.cuts[p]), int(self.cuts[p + 1]))
        return self._given_numbers(np.arange(self.cuts[p], self.cuts[p + 1]))

    def first_irregular(self) -> int | None:
        """The first vertex without a regular ring, None if there is none; the first parts tell, or all."""
        found = []
        for p in range(self.parts):
            faces, begin, end = self.faces_of(p), int(self.cuts[p]), int(self.cuts[p + 1])
            if len(faces) == 0:
                irregular = np.arange(begin, end)  # isolated
            else:
                made, vertices = self.mesh_of(faces, begin, end)
                regular = np.delete(vertices, made.connectivity.irregular)
                irregular = np.setdiff1d(np.arange(begin, end), regular)
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
        return int(np.load(self.folder / "number.npy", mmap_mode="r")[vertex])

    def faces_of(self, p: int) -> Ints:
        """(k, 5): number and vertices of all faces with a vertex of part p; ~number where one is turned."""
        return part_files.read_faces(self.folder, p)

    def some_edges(self) -> tuple[Any, Any]:
        """Ends (k, 3), (k, 3) of edges of some faces."""
        corners = np.asarray(self.points[self._sample.ravel()], np.float64).reshape(-1, 3, 3)
        return corners[:, :2].reshape(-1, 3), corners[:, 1:].reshape(-1, 3)

    @property
    def points(self) -> np.memmap:
        """(n, 3), in the order of the parts: a file."""
        path, offset, dtype, shape = self._source
        return np.memmap(path, dtype, "r", offset, shape)

    def _given_numbers(self, vertices: Indices) -> Indices:
        if not self.renumbered:
            return vertices.astype(np.int64)
        return np.load(self.folder / "order.npy", mmap_mode="r")[vertices].astype(np.int64)

    def mesh_of(
        self,
        faces: Ints,
        begin: int,
        end: int,
        origins: Indices = _NONE,
        connected: Callable[[Ints, Any, Bools], Connectivity] | None = None,
    ) -> tuple[QuadMesh, Indices]:
        """A mesh of faces (k, 5), most of them of vertices begin..end, and the numbers of its vertices.

        They are in the order that the whole mesh has. Vertices that schemes have as origins in the whole mesh
        come first, without faces.
        """
        from quadcurv.kernels import parts as kernels

        used, others = kernels.corners(faces, begin, end)
        beyond = np.unique(others)
        before = np.searchsorted(beyond, begin)
        vertices: Indices = np.concatenate(
            (beyond[:before], np.arange(begin, end)[used], beyond[before:]), dtype=np.int64
        )
        place = np.arange(len(origins), len(origins) + len(vertices), dtype=np.int32)
        if self.renumbered:
            order = np.argsort(self._given_numbers(vertices))
            place[order] = place.copy()
            vertices = vertices[order]
        own = np.full(end - begin, -1, np.int32)
        last = len(place) - (len(beyond) - before)
        own[used] = place[before:last]
        table = kernels.placed(faces, begin, own, beyond, np.concatenate((place[:before], place[last:])))
        vertices = np.concatenate((origins, vertices))
        points = checked_points(np.take(np.asarray(self.points), vertices, axis=0), "points", ("n", 3))
        connectivity = (connected or self._connected)(table, points, faces[:, 0] < 0)
        return QuadMesh.of(points, connectivity, self.roundoff), vertices

    def _connected(self, table: Ints, points: Any, turned: Bools) -> Connectivity:
        """Faces of a part, turned as all of them are."""
        sides = self.sides
        if sides is not None:
            return replace(connect(table, points, turned), orientable=sides.orientable)
        known = connect(table, points)
        if any(finding.kind in ("turned", "non_orientable") for finding in known.findings):
            raise part_sides.SidesError
        return known

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
                    known[first] = _Owned(self.faces_of(q), first, last)
                near.append(known[first].touching(fresh[owner == q], rings - ring))
                if first != begin:
                    fetched.append(near[-1])
            reached = np.union1d(reached, fresh)
            corners = np.unique(np.concatenate(near)[:, 1:])
            fresh = np.setdiff1d(corners[corners >= 0], reached)
        everything = np.concatenate(fetched)
        if len(everything) > len(faces):
            _, first_of = np.unique(part_files.numbers(everything), return_index=True)
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


def _interior() -> int:
    from quadcurv.kernels import topology

    return topology.INTERIOR
