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
def _trace(links, n, vertices, ways, place, ends, closed):
    count, size = 0, 0
    for axis in range(2):
        for v in range(n):
            if place[axis * n + v] >= 0 or (links[4 * v + axis] < 0 and links[4 * v + axis + 2] < 0):
                continue
            here, way, cycle = v, axis + 2, False
            for turn in range(2):  # to the beginning, then along
                while True:
                    if turn == 1:
                        vertices[size], ways[size] = here, way
                        place[(way & 1) * n + here] = size
                        size += 1
                    there = links[4 * here + way]
                    if there < 0:
                        break
                    back = -1
                    for s in range(4):
                        if links[4 * there + s] == here:
                            back = s
                    if back < 0 or place[(back & 1) * n + there] >= 0:
                        break
                    here, way = there, (back + 2) & 3
                    if turn == 0 and here == v and (way & 1) == axis:
                        cycle = True
                        break
                way = (way + 2) & 3
            ends[count], closed[count] = size, cycle
            count += 1
    return count, size


def lines(links):
    """Lines through the vertices whose neighbours straight across are links (n, 4), counter-clockwise.

    -1 where there is none.
    """
    n = len(links)
    vertices, ways, place = np.empty(2 * n, np.int32), np.empty(2 * n, np.int8), np.full((2, n), -1)
    ends, closed = np.empty(2 * n, np.int64), np.empty(2 * n, bool)
    count, size = _trace(flat(links), n, vertices, ways, place.reshape(-1), ends, closed)
    end = ends[:count]
    begin = np.append(0, end)[:-1]
    line = np.repeat(np.arange(count), end - begin)
    return Lines(vertices[:size], ways[:size], place, line, begin, end, closed[:count])
