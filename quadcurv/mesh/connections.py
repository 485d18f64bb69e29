"""Which sides of several grids are one and the same, and what each point is called once they are joined."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import numpy as np
import scipy

from quadcurv.coincidence import first_at_place
from quadcurv.types import Bools, Floats, Indices, MeshError

SIDES = {"first row": (0, 0), "last row": (0, -1), "first column": (1, 0), "last column": (1, -1)}
# Whether the quads along a side, counter-clockwise, run in the direction of its points.
_FORWARD = {"first row": False, "last row": True, "first column": True, "last column": False}
_SAME = 1e-9  # of the extent: nearer than that two points are one
_NEAR = 1e-3  # of the longest step along a side: as far apart the points of sides said to meet may be


class Connection(NamedTuple):
    """Two sides that are one and the same line of points.

    Attributes
    ----------
    block, side, other, other_side : int, str, int, str
        Numbers of the blocks, and "first row", "last row", "first column" or "last column".
    reverse : bool
        Whether the points of the other side come in the opposite order.
    """

    block: int
    side: str
    other: int
    other_side: str
    reverse: bool


class Sides(NamedTuple):
    """Open sides of several arrays of points, row by row, numbered through.

    Attributes
    ----------
    name : list of (int, str)
        Block and side.
    numbers : list of (m,) int64
        Of the points along each; -1 where there is no point.
    points : (n, 3) float64
        Of all blocks, one after the other.
    """

    name: list[tuple[int, str]]
    numbers: list[Indices]
    points: Floats

    def said(self, k: int) -> str:
        """What a reader calls the k-th side."""
        return said(*self.name[k])


def said(block: int, side: str) -> str:
    """What a reader calls a side."""
    return f"the {side} of block {block}"


def open_sides(points: Sequence[Floats], wraps: Sequence[tuple[bool, bool]]) -> Sides:
    """Sides of arrays (r, c, 3) in the directions that do not wrap."""
    found, numbers, start = [], [], 0
    for b, (x, wrap) in enumerate(zip(points, wraps, strict=True)):
        number = np.arange(start, start + x.shape[0] * x.shape[1]).reshape(x.shape[:2])
        number = np.where(np.isfinite(x[..., 0]), number, -1)
        start += number.size
        for side, (axis, end) in SIDES.items():
            if not wrap[axis]:
                found.append((b, side))
                numbers.append(np.moveaxis(number, axis, 0)[end])
    return Sides(found, numbers, np.concatenate([x.reshape(-1, 3) for x in points]))


def found_connections(sides: Sides, roundoff: float) -> list[Connection]:
    """Connections of all sides whose points coincide.

    Raises
    ------
    MeshError
        A ValueError: sides that have inner points in common without being one.
    """
    labels = _labels(sides, roundoff)
    groups: dict[bytes, list[int]] = {}
    found = []
    for k, label in enumerate(labels):
        known = label[label >= 0]
        if known.size < 2 or (known == known[0]).all():  # a pole
            continue
        groups.setdefault(min(label.tobytes(), label[::-1].tobytes()), []).append(k)
        if np.array_equal(label, label[::-1]):
            found.append(Connection(*sides.name[k], *sides.name[k], True))
    for group in groups.values():
        for i, k in enumerate(group):
            for other in group[i + 1 :]:
                reverse = not np.array_equal(labels[k], labels[other])
                found.append(Connection(*sides.name[k], *sides.name[other], reverse))
    found.sort(key=lambda c: (c.block, list(SIDES).index(c.side), c.other))
    _refuse_halves(sides, labels, found)
    return found


def given_connections(sides: Sides, given: Iterable[Any], n_blocks: int) -> list[Connection]:
    """Connections as the caller has them, (block, side, other block, its side), checked.

    Raises
    ------
    MeshError
        A ValueError: no such block or side, sides of different length, sides that do not meet.
    """
    place = {name: k for k, name in enumerate(sides.name)}
    found: list[Connection] = []
    for i, entry in enumerate(given):
        ends = tuple(entry)
        if len(ends) not in (4, 5):
            raise MeshError(f"connections[{i}]: expected (block, side, block, side), got {entry!r}")
        for block, side in (ends[:2], ends[2:4]):
            if side not in SIDES or block not in range(n_blocks):
                raise MeshError(
                    f"connections[{i}]: expected a block below {n_blocks} and one of {', '.join(SIDES)}, got "
                    f"{block!r} and {side!r}"
                )
            if (block, side) not in place:
                raise MeshError(f"connections[{i}]: {said(block, side)} does not exist, for it wraps")
        one, other = place[ends[0], ends[1]], place[ends[2], ends[3]]
        reverse = _order(sides, one, other, f"connections[{i}]")
        found.append(Connection(*sides.name[one], *sides.name[other], reverse))
    return found


def refuse_different_sides(connections: Sequence[Connection]) -> None:
    """Blocks that meet must have their normals on one side of the surface."""
    for c in connections:
        same_way = _FORWARD[c.side] == _FORWARD[c.other_side]
        if same_way != c.reverse:
            raise MeshError(
                f"blocks: {said(c.block, c.side)} meets {said(c.other, c.other_side)}, but the normals of "
                f"the two point to different sides of the surface: give block {c.other} with its first two "
                "axes exchanged, points.swapaxes(0, 1), or the other one"
            )


def numbering(sides: Sides, connections: Sequence[Connection]) -> Indices:
    """For every point the number that it has once sides are joined, -1 where there is none.

    Numbers go up in the order in which points come first. The points of a side that is one point, a pole, are
    joined too.
    """
    place = {name: k for k, name in enumerate(sides.name)}
    n, known = len(sides.points), np.isfinite(sides.points[:, 0])
    extent = np.ptp(sides.points[known], axis=0).max()
    representative = np.arange(n)
    one, other = [], []
    for c in connections:
        a, b = sides.numbers[place[c.block, c.side]], sides.numbers[place[c.other, c.other_side]]
        one.append(a)
        other.append(b[::-1] if c.reverse else b)
    for number in sides.numbers:
        x = sides.points[number[number >= 0]]
        if x.size and np.ptp(x, axis=0).max() <= _SAME * extent:
            one.append(number)
            other.append(np.full(number.size, number[number >= 0][0]))
    if one:
        pairs = np.stack((np.concatenate(one), np.concatenate(other)))
        pairs = pairs[:, (pairs >= 0).all(axis=0)]
        joined, ends = np.unique(pairs, return_inverse=True)
        size, ends = joined.size, ends.reshape(2, -1)
        graph = scipy.sparse.coo_array((np.ones(ends.shape[1], bool), tuple(ends)), shape=(size, size))
        label = scipy.sparse.csgraph.connected_components(graph, directed=False)[1]
        first = np.full(label.max(initial=-1) + 1, n)
        np.minimum.at(first, label, joined)
        representative[joined] = first[label]
    kept = (representative == np.arange(n)) & known
    number = np.where(kept, np.cumsum(kept) - 1, -1)
    return number[representative]


def _labels(sides: Sides, roundoff: float) -> list[Indices]:
    """For the points of all sides one label a place, -1 where there is no point."""
    flat = np.concatenate(sides.numbers) if sides.numbers else np.empty(0, np.int64)
    labels, known = np.full(flat.size, -1), flat >= 0
    x = sides.points[flat[known]]
    if len(x):
        tolerance = max(_SAME * np.ptp(x, axis=0).max(), 8 * roundoff * np.abs(x).max())
        labels[known] = first_at_place(x, tolerance)
    return np.split(labels, np.cumsum([number.size for number in sides.numbers])[:-1])


def _refuse_halves(sides: Sides, labels: Sequence[Indices], connections: Sequence[Connection]) -> None:
    """Sides that share a point inside one of them must be one line."""
    k = len(labels)
    if k == 0:
        return
    joined: Bools = np.zeros((k, k), bool)
    place = {name: i for i, name in enumerate(sides.name)}
    for c in connections:
        one, other = place[c.block, c.side], place[c.other, c.other_side]
        joined[one, other] = joined[other, one] = True
    inner, all_ = [], []
    for i, label in enumerate(labels):
        ends = label[label >= 0][[0, -1]] if (label >= 0).any() else label
        own = np.unique(label[label >= 0])
        within = np.setdiff1d(own, ends)
        inner.append((np.full(within.size, i), within))
        all_.append((np.full(own.size, i), own))
        repeated = np.unique(label[label >= 0][1:-1]).size < np.count_nonzero(label[1:-1] >= 0)
        if repeated and not joined[i, i] and own.size > 1:
            raise MeshError(
                f"blocks: {sides.said(i)} meets itself halfway: cut the block where it begins to, so that "
                "sides meet as a whole"
            )
    size = max((int(label.max(initial=-1)) for label in labels), default=-1) + 1

    def incidence(entries: list[tuple[Indices, Indices]]) -> scipy.sparse.csr_array:
        rows, columns = (np.concatenate(x) for x in zip(*entries, strict=True))
        return scipy.sparse.csr_array((np.ones(rows.size), (rows, columns)), shape=(k, max(size, 1)))

    shared = (incidence(inner) @ incidence(all_).T).toarray() * ~joined
    np.fill_diagonal(shared, 0)
    if shared.any():
        one, other = sorted(map(int, np.unravel_index(np.argmax(shared), shared.shape)))
        common = np.intersect1d(labels[one], labels[other])
        raise MeshError(
            f"blocks: {sides.said(one)} ({labels[one].size} points) and {sides.said(other)} "
            f"({labels[other].size} points) have {np.count_nonzero(common >= 0)} points in common, but sides "
            "meet as a whole, point by point in one order or the other: cut blocks where they begin to meet, "
            "refine the coarse one, or give the connections"
        )


def _order(sides: Sides, one: int, other: int, where: str) -> bool:
    """Whether the points of a side said to meet another come in the opposite order there."""
    a, b = sides.numbers[one], sides.numbers[other]
    if a.size != b.size:
        raise MeshError(
            f"{where}: {sides.said(one)} has {a.size} points, {sides.said(other)} {b.size}, but sides meet "
            "point by point"
        )
    x, y = (np.where(n[:, None] >= 0, sides.points[n], np.inf) for n in (a, b))
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(np.diff(x, axis=0), axis=1)
        within = _NEAR * steps[np.isfinite(steps)].max(initial=0.0)
        gaps = [
            np.where((a < 0) & (n < 0), 0.0, np.linalg.norm(x - z, axis=1))
            for n, z in ((b, y), (b[::-1], y[::-1]))
        ]
    far = [np.nan_to_num(gap, nan=np.inf) > within for gap in gaps]
    reverse = bool(far[1].sum() < far[0].sum() or one == other)
    gap, bad = gaps[reverse], far[reverse]
    if bad.any():
        raise MeshError(
            f"{where}: {sides.said(one)} and {sides.said(other)} do not meet: {np.count_nonzero(bad)} of "
            f"their {a.size} points are up to {np.max(gap[bad]):.3g} apart, first point {np.argmax(bad)}"
        )
    return reverse
