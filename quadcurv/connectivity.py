"""Faces over vertices, mended, turned to agree, and what follows from them alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.checks import Finding, GivenFaces, checked_faces
from quadcurv.device_arrays import as_cupy
from quadcurv.hanging import without_hanging
from quadcurv.polygons import cut
from quadcurv.stencils import Polygons, edges, face_pairs
from quadcurv.types import Bools, Floats, Indices, Ints

_FAR = 100_000  # vertices between neighbours in memory, on average, from which on reordering pays


class Order(NamedTuple):
    """Vertices in an order that keeps neighbours near in memory.

    Attributes
    ----------
    vertices : (n,) int32
        The k-th vertex in this order.
    place : (n,) int32
        Where each vertex stands in it.
    ring : (n, 8) int32
        Rings in this order, numbered by it.
    """

    vertices: Ints
    place: Ints
    ring: Ints


@dataclass(frozen=True, eq=False)
class Connectivity:
    """What a face list is but for the positions; meshes that differ in these alone share it.

    Attributes
    ----------
    faces : (m, 4) int32, read-only
        Faces computed with, counter-clockwise; a triangle's last entry is -1.
    source : (m,) int64 or None
        The given face that each of `faces` stems from; None: itself.
    polygons : Polygons or None
        Faces of more than four sides, which `faces` has cut.
    kind : (n,) uint8
        What the faces around each vertex are, see :mod:`quadcurv.kernels.topology`.
    ring : (n, 8) int32
        (a, d, a, d, ...) around each regular vertex inside, first -1 for all others.
    irregular : (k,) int64
        Vertices without such a ring.
    orientable : bool
    findings : tuple of Finding
        What was mended or has no answer.
    order : Order or None
    """

    faces: Ints
    source: Indices | None
    polygons: Polygons | None
    kind: NDArray[np.uint8]
    ring: Ints
    irregular: Indices
    orientable: bool
    findings: tuple[Finding, ...]
    order: Order | None = None

    @property
    def closed(self) -> Bools:
        """(n,) bool: whether the faces around a vertex are one closed fan."""
        from quadcurv.kernels import topology

        return self.kind == topology.INTERIOR

    @cached_property
    def ring_on_device(self) -> Any:
        """`ring` on a device, copied there once."""
        return as_cupy(self.ring)

    @cached_property
    def scattered(self) -> bool:
        """Whether neighbours lie so far apart in memory that no cache holds both."""
        from quadcurv.kernels import topology

        return bool(topology.mean_distance(self.faces) > topology.FAR)

    @cached_property
    def irregular_part(self) -> tuple[Indices, Ints]:
        """Vertices and faces of the part of the mesh within five faces of irregular vertices, these first.

        They have there all that a ghost layer or a scheme may look at.
        """
        from quadcurv.kernels import topology

        return topology.part_around(self.faces, self.irregular, len(self.kind), 5)

    def reordered(self) -> Connectivity:
        """Return the same with an order that keeps neighbours near, where that pays."""
        from quadcurv.kernels import order, topology

        if self.order is not None or topology.mean_distance(self.faces) <= _FAR:
            return self
        vertices = order.nearby_order(self.ring)
        ring, place = order.renumbered(self.ring, vertices)
        return replace(self, order=Order(vertices, place, ring))


def connect(faces: Any, points: Floats, turn: Bools | None = None) -> Connectivity:
    """Check and mend faces, turn them to agree with their neighbours, find the rings.

    Which of the given faces to turn may be known, as of a part of a larger mesh: then no others are.

    Raises
    ------
    MeshError
        What :func:`quadcurv.checks.checked_faces` refuses.
    """
    from quadcurv.kernels import topology

    given = without_hanging(checked_faces(faces, len(points)), points)
    findings = list(given.findings)
    table, source, polygons = _without_polygons(given, points)
    n = len(points)
    ring, others, kind, bad_edge, n_disagree = topology.fans(table, n)
    if bad_edge[2] or n_disagree:
        kept = _first_of_doubles(table)
        if kept.size < len(table):
            first = np.delete(np.arange(len(table)), kept)[0]
            first = int(first if source is None else source[first])
            findings.append(Finding("double", len(table) - kept.size, f"face {first}"))
            source = kept if source is None else source[kept]
            table = table[kept]
            if polygons is not None:
                polygons = polygons._replace(face=polygons.face[kept])
            ring, others, kind, bad_edge, n_disagree = topology.fans(table, n)
    orientable = True
    if turn is not None:
        turn = turn if source is None else turn[source]
    elif n_disagree:
        turn, orientable = _consistent_sides(table)
    if turn is not None and turn.any():
        faces_turned = np.unique(np.flatnonzero(turn) if source is None else source[turn])
        findings.append(Finding("turned", faces_turned.size, f"face {faces_turned[0]}"))
        table = table.copy()
        quad = table[:, 3] >= 0
        table[turn & quad] = table[turn & quad][:, [0, 3, 2, 1]]
        table[turn & ~quad] = table[turn & ~quad][:, [0, 2, 1, 3]]
        if polygons is not None:
            polygons = polygons.turned(turn)
        ring, others, kind, bad_edge, _ = topology.fans(table, n)
    if bad_edge[2]:
        ends = np.unique(edges(table).shared_by_many)
        kind[ends] = topology.NONMANIFOLD
        first_edge = f"the one from vertex {bad_edge[0]} to {bad_edge[1]}"
        findings.append(Finding("nonmanifold", int(bad_edge[2]), first_edge))
    several = np.flatnonzero(kind == topology.SEVERAL_FANS)
    if several.size:
        findings.append(Finding("fans", several.size, f"vertex {several[0]}"))
    isolated = np.flatnonzero(kind == topology.ISOLATED)
    hanging = sum(finding.number for finding in findings if finding.kind == "hanging")
    if isolated.size > hanging:
        findings.append(Finding("isolated", isolated.size - hanging, f"vertex {isolated[0]}"))
    if not orientable:
        findings.append(Finding("non_orientable", 1, ""))
    for array in (table, kind, ring, others):
        array.flags.writeable = False
    return Connectivity(table, source, polygons, kind, ring, others, orientable, tuple(findings))


def _without_polygons(given: GivenFaces, points: Floats) -> tuple[Ints, Indices | None, Polygons | None]:
    """Faces of three and four sides, those of more being cut, in the order of the given ones."""
    if given.large is None:
        return given.table, given.source, None
    large = given.large
    triangles, of = cut(points, large.indptr, large.corners)
    table = np.concatenate((given.table, np.insert(triangles, 3, -1, axis=1).astype(np.int32)))
    small = np.arange(len(given.table)) if given.source is None else given.source
    source = np.concatenate((small, given.large_source[of]))
    face = np.concatenate((np.full(len(given.table), -1), of))
    order = np.argsort(source, kind="stable")
    polygons = Polygons(large.indptr, large.corners, face[order])
    return np.ascontiguousarray(table[order]), source[order], polygons


def _first_of_doubles(faces: Ints) -> Indices:
    """Of faces over the same vertices, whichever way round, the first ones."""
    _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
    return np.sort(first)


def _consistent_sides(faces: Ints) -> tuple[Bools, bool]:
    """Which faces to turn, as few as possible, so that neighbours agree; and whether all then do.

    Non-orientable components are left as they are.
    """
    f, i, g, j = face_pairs(faces)
    label = sides(len(faces), f, g, faces[f, i] == faces[g, j])
    m = len(faces)
    return fewest_turned(label, np.ones(m), np.arange(m)), not bool((label[:m] == label[m:]).any())


def sides(m: int, f: Indices, g: Indices, differ: Bools) -> Indices:
    """What goes together of m things (2 m,), as they are, then turned, if f and g agree or differ."""
    rows = np.concatenate((f, f + m))
    columns = np.concatenate((np.where(differ, g + m, g), np.where(differ, g, g + m)))
    graph = scipy.sparse.coo_array((np.ones(rows.size, bool), (rows, columns)), shape=(2 * m, 2 * m))
    label: Indices = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
    return label


def fewest_turned(label: Indices, faces: NDArray[Any], first: Indices) -> Bools:
    """Which things to turn: what goes together and its mirror image differ in which are, keep that of fewer.

    Each of them is so many faces; of as many the one that leaves the first face is kept.
    """
    ours, theirs = np.split(label, 2)
    kept = np.bincount(ours, faces, minlength=label.max(initial=-1) + 1)
    earliest = np.full(kept.size, np.iinfo(np.int64).max)
    np.minimum.at(earliest, ours, first)
    tie = (kept[ours] == kept[theirs]) & (earliest[ours] > earliest[theirs])
    turn: Bools = (kept[ours] < kept[theirs]) | tie
    return turn
