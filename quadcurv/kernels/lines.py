"""Lines of a mesh: straight on from vertex to vertex, as rows and columns of a grid."""

from typing import NamedTuple

import numpy as np

from quadcurv.kernels.compiled import flat, kernel


class Lines(NamedTuple):
    """The lines of a mesh, one after the other; every vertex lies on two, on the second one turned left.

    Attributes
    ----------
    vertices : (m,) int32
        Vertices along the lines.
    ways : (m,) int8
        The slots in which they go on there.
    place : (2, n) int64
        Where the two lines of a vertex, of slots 0 and 2 and of 1 and 3, pass through it; -1 where none does.
    line : (m,) int64
        Which of the lines it is.
    begin, end : (k,) int64
        Their first vertex, and the one behind the last.
    closed : (k,) bool
        Whether the last is followed by the first.
    """

    vertices: np.ndarray
    ways: np.ndarray
    place: np.ndarray
    line: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    closed: np.ndarray


@kernel
def _trace(onward, order, seen, ends):
    count, size = 0, 0
    for first in range(onward.size):
        if seen[first & -3] or (onward[first] < 0 and onward[first ^ 2] < 0):
            continue
        s = first ^ 2  # back to the beginning, if there is one
        while onward[s] >= 0 and onward[s] != first ^ 2:
            s = onward[s]
        s = s ^ 2
        while s >= 0 and not seen[s & -3]:
            order[size] = s
            seen[s & -3] = True
            size += 1
            s = onward[s]
        ends[count] = size
        count += 1
    return count


def _onward(links):
    """(4 n,): from slot w of vertex v, as 4 v + w, to that which goes on at the next vertex; -1 at ends."""
    n = len(links)
    onward, vertices = np.full((n, 4), -1), np.arange(n)
    for way in range(4):
        there = links[:, way].astype(np.int64)
        back = links[there] == vertices[:, None]
        known = (there >= 0) & (back.sum(axis=1) == 1)
        onward[known, way] = (4 * there + (back.argmax(axis=1) ^ 2))[known]
    onward = onward.reshape(-1)
    here = np.arange(4 * n)
    return np.where(onward[onward ^ 2] == here ^ 2, onward, -1)  # one may not lead back


def lines(links):
    """Lines through the vertices whose neighbours straight across are links (n, 4), counter-clockwise.

    -1 where there is none.
    """
    n = len(links)
    onward, order, ends = _onward(links), np.empty(2 * n, np.int64), np.empty(2 * n, np.int64)
    end = ends[: _trace(flat(onward), order, np.zeros(4 * n, bool), ends)]
    begin = np.append(0, end)[:-1]
    order = order[: end[-1] if end.size else 0]
    vertices, ways, place = (order >> 2).astype(np.int32), (order & 3).astype(np.int8), np.full((2, n), -1)
    place[order & 1, vertices] = np.arange(order.size)
    line, closed = np.repeat(np.arange(end.size), end - begin), onward[order[end - 1]] == order[begin]
    return Lines(vertices, ways, place, line, begin, end, closed)
