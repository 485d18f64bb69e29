"""Faces with two edges that run along each other, and faces that fold over."""

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, where
from quadcurv.kernels.vector import cross, dot, less, triple

_SMALL = 1e-6  # an area, over the squares of the edges: which way such a face lies is by chance


@formula
def is_sliver(points, faces, f, least):
    """Whether two edges of a face run along each other, or it has a corner of more than half a turn."""
    v = [faces[4 * f + s] for s in range(4)]
    triangle = v[3] < 0
    a, b, c, d = (triple(points, 3 * i, 1) for i in (*v[:3], where(triangle, v[0], v[3])))
    edges = less(b, a), less(c, b), less(d, c), less(a, d)
    side = cross(less(c, a), less(d, b))
    found = v[0] < 0  # never
    for k, (ahead, behind) in enumerate(zip(edges, edges[-1:] + edges[:-1], strict=True)):
        area, sizes = cross(behind, ahead), dot(ahead, ahead) + dot(behind, behind)
        narrow = (dot(area, area) < least * (sizes * sizes)) | (dot(area, side) < 0.0)
        if k == 0:  # of a triangle the last edge, of no length, is none
            own, closing = cross(edges[2], ahead), dot(ahead, ahead) + dot(edges[2], edges[2])
            narrow = where(triangle, dot(own, own) < least * (closing * closing), narrow)
        elif k == 3:
            narrow = where(triangle, found, narrow)
        found = found | narrow
    return found


@kernel
def _mark(points, faces, least, marked):
    for f in range(faces.size // 4):
        if is_sliver(points, faces, f, least):
            for s in range(4):
                if faces[4 * f + s] >= 0:
                    marked[faces[4 * f + s]] = True


def beside_slivers(points, faces, least):
    """(p,): vertices of faces that have a corner like a needle, or of more than half a turn.

    There the product of the sides is less than `least` of the sum of their squares: half the sine of the
    angle if they are equal, one over the other if they are not and at right angles.
    """
    marked = np.zeros(len(points), np.bool_)
    _mark(flat(points), flat(faces), least**2, marked)
    return marked


@formula
def normal_of(points, faces, f, least):
    """Twice the vector area of a face, none if it is small, and how many of its corners are turned away."""
    v = [faces[4 * f + s] for s in range(4)]
    a, b, c, d = (triple(points, 3 * i, 1) for i in (*v[:3], where(v[3] < 0, v[0], v[3])))
    side, edges = cross(less(c, a), less(d, b)), (less(b, a), less(c, b), less(d, c), less(a, d))
    size = dot(edges[0], edges[0]) + dot(edges[1], edges[1]) + dot(edges[2], edges[2])
    number, least = 0, least * (size * size)
    for ahead, behind in zip(edges, edges[-1:] + edges[:-1], strict=True):
        number = number + where(dot(cross(behind, ahead), side) < -1 * least, 1, 0)
    large = dot(side, side) > least
    return *(where(large, x, 0.0) for x in side), number


@kernel
def _mark_folds(points, faces, areas, least, marked):
    n = areas.size // 3
    for f in range(faces.size // 4):
        x, y, z, turned = normal_of(points, faces, f, least)
        for s in range(4):
            v = faces[4 * f + s]
            if 0 <= v < n:
                up = x * areas[3 * v] + y * areas[3 * v + 1] + z * areas[3 * v + 2]
                marked[v] |= up < 0 or turned > 1


def at_folds(points, faces, areas):
    """(n,): vertices of a face that crosses itself, or is turned away from the ring's vector area (n, 3)."""
    marked = np.zeros(len(areas), np.bool_)
    _mark_folds(flat(points), flat(faces), flat(areas), _SMALL**2, marked)
    return marked
