"""Polygons cut into triangles, without slivers where there is a cut that has none."""

from __future__ import annotations

import numpy as np

from quadcurv.types import Floats, Indices, Ints

_MOST = 40  # sides up to which all cuts are compared; beyond, ears are clipped


def cut(points: Floats, indptr: Indices, corners: Ints) -> tuple[Indices, Indices]:
    """Cut polygons along diagonals so that the worst triangle is as good as can be.

    The quality of a triangle is its area, seen along the polygon's vector area, over the sum of its
    squared edges: negative where it is turned over. Of all triangulations by diagonals one with the
    largest least quality is found by dynamic programming (G. T. Klincsek 1980, Minimal triangulations of
    polygonal domains), at a cost of k^3 for k sides. Larger polygons are cut by ear clipping, or, where
    they cross themselves, as a fan.

    Parameters
    ----------
    points : (n, 3) float64
    indptr : (m + 1,) int64
    corners : (c,) int32
        Polygon f has the vertices ``corners[indptr[f]:indptr[f + 1]]``.

    Returns
    -------
    triangles : (t, 3) int64
        Those of each polygon one after the other, without such as have a vertex twice.
    polygon : (t,) int64
        The polygon each comes from.
    """
    sizes = np.diff(indptr)
    pieces, of = [np.empty((0, 3), np.int64)], [np.empty(0, np.int64)]
    for k in np.unique(sizes):
        which = np.flatnonzero(sizes == k)
        polygons = corners[indptr[which, None] + np.arange(k)].astype(np.int64)
        # From the least vertex on: of cuts that are equally good the same one, wherever a polygon begins.
        turn = (np.arange(k) + polygons.argmin(axis=1)[:, None]) % k
        polygons = np.take_along_axis(polygons, turn, axis=1)
        x = points[polygons] - points[polygons[:, :1]]  # an offset costs no digits
        slots = _best(x) if k <= _MOST else np.stack([_clipped(polygon) for polygon in x])
        pieces.append(np.take_along_axis(polygons[:, None], slots, axis=2).reshape(-1, 3))
        of.append(np.repeat(which, slots.shape[1]))
    triangles, polygon = np.concatenate(pieces), np.concatenate(of)
    order = np.argsort(polygon, kind="stable")
    triangles, polygon = triangles[order], polygon[order]
    a, b, c = triangles.T
    proper = (a != b) & (b != c) & (c != a)
    return triangles[proper], polygon[proper]


def _best(x: Floats) -> Indices:
    """Slots (m, k - 2, 3) of the triangles of polygons (m, k, 3)."""
    m, k, _ = x.shape
    normal = np.cross(x, np.roll(x, -1, axis=1)).sum(axis=1)
    size = np.linalg.norm(normal, axis=1, keepdims=True)
    normal = np.divide(normal, size, out=np.zeros_like(normal), where=size > 0)
    # best[:, i, j]: the least quality of the best cut of the corners i, ..., j.
    best, apex = np.full((m, k, k), np.inf), np.zeros((m, k, k), np.int64)
    for length in range(2, k):
        for i in range(k - length):
            j = i + length
            middle = np.arange(i + 1, j)
            a, b = x[:, middle] - x[:, [i]], x[:, [j]] - x[:, [i]]
            area = np.einsum("mtx,mx->mt", np.cross(a, b), normal)
            edges = (a**2).sum(axis=2) + (b**2).sum(axis=2) + ((b - a) ** 2).sum(axis=2)
            quality = np.divide(area, edges, out=np.zeros_like(area), where=edges > 0)
            least = np.minimum(np.minimum(best[:, i, middle], best[:, middle, j]), quality)
            chosen = least.argmax(axis=1)
            best[:, i, j], apex[:, i, j] = least[np.arange(m), chosen], middle[chosen]
    slots = np.empty((m, k - 2, 3), np.int64)
    rows = np.arange(m)
    low, high = np.zeros((2, m, k), np.int64)  # intervals still to be cut
    high[:, 0] = k - 1
    depth = np.ones(m, np.int64)
    for t in range(k - 2):
        # The interval on top of each polygon's stack has at least one corner between its ends.
        depth -= 1
        first, last = low[rows, depth], high[rows, depth]
        middle = apex[rows, first, last]
        slots[:, t] = np.stack((first, middle, last), axis=1)
        for begin, end in ((middle, last), (first, middle)):
            more = end - begin > 1
            low[rows[more], depth[more]], high[rows[more], depth[more]] = begin[more], end[more]
            depth += more
    return slots


def _clipped(x: Floats) -> Indices:
    """Slots (k - 2, 3) of one polygon's triangles by ear clipping, or of a fan where it crosses itself."""
    import mapbox_earcut

    normal = np.cross(x, np.roll(x, -1, axis=0)).sum(axis=0)
    # The plane across the normal: the right singular vectors of a row begin with the row.
    _, _, (along, *plane) = np.linalg.svd(normal[None])
    if np.linalg.det([along, *plane]) * np.dot(along, normal) < 0:
        plane.reverse()
    flat = np.ascontiguousarray(x @ np.transpose(plane))
    ears = mapbox_earcut.triangulate_float64(flat, np.array([len(x)], np.uint32)).astype(np.int64)
    if len(ears) == 3 * (len(x) - 2):
        return ears.reshape(-1, 3)
    middle = np.arange(1, len(x) - 1)
    return np.stack((np.zeros_like(middle), middle, middle + 1), axis=1)
