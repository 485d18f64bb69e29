"""Vertices that hang on an edge: corners of one polygon alone, between two vertices that another face joins.

They leave a crack of no area in the mesh, and lie on the chord instead of the surface.
"""

from __future__ import annotations

import numpy as np

from quadcurv.checks import Finding, GivenFaces
from quadcurv.ragged import Faces
from quadcurv.stencils import Polygons
from quadcurv.types import Bools, Floats, Indices

_STRAIGHT = 1e-6  # distance from an edge, in lengths of it


def without_hanging(given: GivenFaces, points: Floats) -> GivenFaces:
    """Take hanging vertices out of the polygons of more than four sides that have them."""
    if given.large is None:
        return given
    polygons = Faces(np.diff(given.large.indptr), given.large.corners.astype(np.int64))
    hanging = _hanging(polygons, given, points)
    if not hanging.any():
        return given
    vertices = polygons.corners[hanging]
    owner = np.repeat(np.arange(len(polygons)), polygons.sizes)
    polygons = Faces(
        polygons.sizes - np.bincount(owner[hanging], minlength=len(polygons)), polygons.corners[~hanging]
    )
    small, large = (np.flatnonzero(x) for x in (polygons.sizes <= 4, polygons.sizes > 4))
    of_four = polygons.chosen(small)
    more = np.full((small.size, 4), -1, np.int32)
    more[np.arange(4) < of_four.sizes[:, None]] = of_four.corners
    source = np.arange(len(given.table)) if given.source is None else given.source
    source = np.concatenate((source, given.large_source[small]))
    order = np.argsort(source, kind="stable")
    rest = polygons.chosen(large)
    cut = [Finding("cut", large.size, f"face {given.large_source[large[0]]}")] if large.size else []
    return GivenFaces(
        np.concatenate((given.table, more))[order],
        source[order],
        Polygons(np.append(0, rest.ends), rest.corners.astype(np.int32), given.large.face)
        if large.size
        else None,
        given.large_source[large],
        [
            *(finding for finding in given.findings if finding.kind != "cut"),
            *cut,
            Finding("hanging", vertices.size, f"vertex {vertices.min()}"),
        ],
    )


def _hanging(polygons: Faces, given: GivenFaces, points: Floats) -> Bools:
    """Which corners of polygons are hanging vertices."""
    n, corners = len(points), polygons.corners
    of_one = np.bincount(corners, minlength=n) + np.bincount(given.table[given.table >= 0], minlength=n) == 1
    alone = of_one[corners]
    found = np.zeros(corners.size, bool)
    # Few lie between the corners before and after them: others need not be looked at.
    place = np.flatnonzero(alone)
    owner = np.searchsorted(polygons.ends, place, side="right")
    begin, size = polygons.begins[owner], polygons.sizes[owner]
    before, after = (points[corners[begin + (place - begin + k) % size]] for k in (-1, 1))
    straight = _straight(points[corners[place]] - before, after - before)
    runs, keys = [], []
    for f in np.unique(owner[straight]).tolist():
        m = int(polygons.sizes[f])
        at = polygons.begins[f] + np.arange(m)
        kept = np.flatnonzero(~alone[at])
        for i, j in zip(kept, np.roll(kept, -1), strict=True):  # runs of such corners between two others
            run = at[(i + 1 + np.arange((j - i - 1) % m)) % m]
            a, b = corners[at[i]], corners[at[j]]
            if run.size and a != b and _between(points[corners[run]] - points[a], points[b] - points[a]):
                runs.append(run)
                keys.append(min(a, b) * n + max(a, b))
    if runs:
        for run, joined in zip(runs, np.isin(keys, _edges(polygons, given, n)), strict=True):
            found[run] = joined
    return found


def _straight(x: Floats, edge: Floats) -> Bools:
    """Whether points (k, 3) lie on edges (k, 3)."""
    apart = np.cross(x, edge)
    return np.asarray((apart * apart).sum(axis=-1) <= (_STRAIGHT * (edge * edge).sum(axis=-1)) ** 2)


def _between(x: Floats, edge: Floats) -> bool:
    """Whether points lie on an edge, one after the other."""
    along = np.concatenate(([0.0], x @ edge, [edge @ edge]))
    return bool((np.diff(along) > 0).all() and _straight(x, np.broadcast_to(edge, x.shape)).all())


def _edges(polygons: Faces, given: GivenFaces, n: int) -> Indices:
    """Pairs of vertices that an edge joins, as numbers."""
    table = given.table.astype(np.int64)
    following = np.where(np.roll(table, -1, axis=1) < 0, table[:, :1], np.roll(table, -1, axis=1))
    there = table >= 0
    after = np.arange(polygons.corners.size) + 1
    after[polygons.ends - 1] = polygons.begins
    a = np.concatenate((table[there], polygons.corners))
    b = np.concatenate((following[there], polygons.corners[after]))
    return np.asarray(np.minimum(a, b) * n + np.maximum(a, b))
