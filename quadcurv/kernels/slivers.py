"""Faces with two edges that run along each other."""

import numpy as np

from quadcurv.kernels.compiled import flat, kernel
from quadcurv.kernels.formulas import formula, where
from quadcurv.kernels.vector import cross, dot, less, triple


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
