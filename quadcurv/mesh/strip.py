"""What lies around the sides of grids that meet, as one mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from quadcurv.mesh.face_list import QuadMesh
from quadcurv.mesh.grid import QuadGrid
from quadcurv.types import Bools, Floats, Indices, Ints

# Quads from sides inward: a vertex at a side, or beside one that is a point, looks five faces far at most.
_DEPTH = 6


class Strip(NamedTuple):
    """A mesh of what lies around the sides of grids.

    Attributes
    ----------
    mesh : QuadMesh
        Of its vertices those alone are irregular that are so among all quads of the grids.
    place, number : (k,) int64
        Vertices at sides and other irregular ones, and their numbers among all vertices of the grids.
    """

    mesh: QuadMesh
    place: Indices
    number: Indices


def strip(
    grids: Sequence[QuadGrid], numbers: Sequence[Indices], faces: Sequence[Ints], points: Floats
) -> Strip:
    """The strip along all sides of grids without masks, from the numbers of their vertices and the quads."""
    from quadcurv.kernels import topology

    side, complete = np.zeros(len(points), bool), np.ones(len(points), bool)
    near = []
    for grid, number, quads in zip(grids, numbers, faces, strict=True):
        inside = _inside(grid)
        complete[number[inside]] = False
        for axis in (0, 1):
            if not grid.wrap[axis]:
                side[np.moveaxis(number, axis, 0)[[0, -1]]] = True
        near.append(quads[~_between(inside, grid.wrap).ravel()])
    chosen = np.concatenate(near)
    number = np.unique(chosen)
    place = np.zeros(len(points), np.int32)
    place[number] = np.arange(number.size)
    mesh = QuadMesh(points[number], place[chosen])
    known = mesh.connectivity
    # Vertices at the inner rim have more faces than the strip: they are no border.
    irregular = known.irregular[complete[number[known.irregular]]]
    kind = np.where(complete[number], known.kind, np.uint8(topology.INTERIOR))
    wanted = side[number]
    wanted[irregular] = True
    served = np.flatnonzero(wanted)
    return Strip(
        mesh.with_connectivity(replace(known, irregular=irregular, kind=kind)), served, number[served]
    )


def _inside(grid: QuadGrid) -> Bools:
    """Vertices farther than the depth of a strip from all sides, or as far."""
    inside = np.ones(grid.shape, bool)
    for axis in (0, 1):
        if not grid.wrap[axis]:
            rows = np.moveaxis(inside, axis, 0)
            rows[:_DEPTH] = rows[-_DEPTH:] = False
    return inside


def _between(inside: Bools, wrap: tuple[bool, bool]) -> Bools:
    """Quads all of whose vertices are inside."""
    x = np.pad(inside, [(0, int(w)) for w in wrap], mode="wrap")
    return x[:-1, :-1] & x[1:, :-1] & x[1:, 1:] & x[:-1, 1:]
