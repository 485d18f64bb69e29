"""Points at the same place, exactly or within a tolerance, at a cost near linear in their number."""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.types import Floats

_FINE = 2.0**50  # cells a side, beyond which the number of a cell is no longer exact in double precision


def first_at_place(points: Floats, tolerance: float = 0.0) -> NDArray[np.int64]:
    """For every point the index of the first one at its place.

    Points up to `tolerance` apart, and chains of them, are one place.

    Notes
    -----
    Points are sorted into cells that lie within the tolerance as a whole, so that only the gaps between
    neighbouring cells are left to measure: a tolerance as large as the mesh costs no more than a small one.
    """
    place = _equal_rows(points)
    if tolerance > 0 and len(points):
        _, first = np.unique(place, return_index=True)
        place = _connected(points[first], tolerance)[place]
    _, first, of = np.unique(place, return_index=True, return_inverse=True)
    return first[of]


def _equal_rows(rows: Floats) -> NDArray[np.int64]:
    """Number of the distinct row that each row equals."""
    order = np.lexsort(rows.T)
    moved = (np.diff(rows[order], axis=0) != 0).any(axis=1)
    number = np.empty(len(rows), np.int64)
    number[order] = np.concatenate(([0], np.cumsum(moved)))[: len(rows)]
    return number


def _connected(points: Floats, tolerance: float) -> NDArray[np.int64]:
    """Component of each of distinct points in the graph of pairs up to `tolerance` apart."""
    side = 0.57 * tolerance  # a cell's diagonal is below the tolerance, two cells between are above it
    if np.ptp(points, axis=0).max() > side * _FINE:
        # A tolerance like rounding itself: distinct points have few others as near as that.
        pairs = scipy.spatial.cKDTree(points).query_pairs(tolerance, output_type="ndarray")
        return _components(len(points), pairs)
    at = np.floor((points - points.min(axis=0)) / side)
    cell = _equal_rows(at)
    order = np.argsort(cell, kind="stable")
    size = np.bincount(cell)
    begin = np.cumsum(size) - size
    members = points[order]
    pairs = scipy.spatial.cKDTree(at[order[begin]]).query_pairs(2, p=np.inf, output_type="ndarray")
    one, other = pairs.T
    joined = np.linalg.norm(members[begin[one]] - members[begin[other]], axis=1) <= tolerance
    component = _components(len(size), pairs[joined])
    low, high = (extreme.reduceat(members, begin) for extreme in (np.minimum, np.maximum))
    between = np.maximum(0, np.maximum(low[one] - high[other], low[other] - high[one]))
    unknown = (component[one] != component[other]) & (size[one] * size[other] > 1)
    unknown &= np.linalg.norm(between, axis=1) <= tolerance
    for pair in np.flatnonzero(unknown).tolist():
        few, many = sorted(pairs[pair], key=lambda c: size[c])
        tree = scipy.spatial.cKDTree(members[begin[many] : begin[many] + size[many]])
        gap, _ = tree.query(members[begin[few] : begin[few] + size[few]])
        joined[pair] = gap.min() <= tolerance
    return _components(len(size), pairs[joined])[cell]


def _components(n: int, pairs: NDArray[np.integer]) -> NDArray[np.int64]:
    graph = scipy.sparse.coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
    return scipy.sparse.csgraph.connected_components(graph, directed=False)[1].astype(np.int64)
