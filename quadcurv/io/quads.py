"""Quads that were cut into triangles, put together again by the order or the marks of the halves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadcurv.types import Ints


def quads_by_order(triangles: NDArray[np.integer]) -> tuple[NDArray[np.integer], str]:
    """Quads (a, b, c, d) that were split into the triangles (a, b, c) and (c, d, a).

    The closing edge of each of the two is then the diagonal. Where triangle i has its other half at
    i + n for all n quads in a row, the rule is "block" (triangles may come before and after); where it is
    the next one, "interleaved". Each must pair at least half of the triangles. Where nine in ten have
    their other half somewhere, the rule is "diagonal"; else "none". In a triangle mesh about one closing
    edge in three meets another by chance.

    Parameters
    ----------
    triangles : (k, 3) int

    Returns
    -------
    faces : (m, 4) int
        In the order of their first triangles; the last entry of a triangle is -1.
    rule : str
    """
    k = len(triangles)
    first, last = triangles[:, 0].astype(np.int64), triangles[:, 2].astype(np.int64)
    closing, opposite = last << 32 | first, first << 32 | last
    order = np.argsort(closing)
    found = order[np.minimum(np.searchsorted(closing[order], opposite), k - 1)] if k else order
    # Mutual, so that three triangles at one edge make no two pairs; not one triangle and its back.
    mutual = (closing[found] == opposite) & (found[found] == np.arange(k))
    half = np.flatnonzero(mutual & (triangles[found, 1] != triangles[:, 1]))
    one = half[half < found[half]]
    shift = found[one] - one
    lengths, count = np.unique(shift, return_counts=True)
    blocks = [one[shift == n] for n in lengths[(lengths == count) & (lengths > 1)]]
    candidates = [("block", block) for block in blocks if block[-1] - block[0] == len(block) - 1]
    candidates.append(("interleaved", one[shift == 1]))
    candidates = [(rule, pairs) for rule, pairs in candidates if 4 * len(pairs) >= k]
    if 2 * len(one) >= 0.9 * k:
        candidates.append(("diagonal", one))
    rule, pairs = candidates[0] if candidates else ("none", one[:0])
    return _joined(triangles, pairs, found[pairs]), rule


def quads_by_carrier(triangles: NDArray[np.integer], carrier: NDArray[np.integer]) -> NDArray[np.integer]:
    """Quads of the triangles of :func:`split_quads`, whatever their order now and however many are left."""
    closing = np.sort(triangles[:, [0, 2]], axis=1)
    order = np.lexsort((carrier, *closing.T, carrier >> 1))
    one, other = order[:-1], order[1:]
    halves = (carrier[one] % 2 == 0) & (carrier[other] == carrier[one] + 1)
    halves &= (triangles[one, 2] == triangles[other, 0]) & (triangles[one, 0] == triangles[other, 2])
    one, other = one[halves], other[halves]
    faces = _joined(triangles, one, other)
    return faces[np.argsort(np.delete(carrier, other), kind="stable")]


def split_quads(faces: Ints) -> tuple[Ints, Ints]:
    """Triangles (a, b, c) and (c, d, a) of quads, as trimesh cuts and orders them: all first, all second.

    Returns
    -------
    triangles : (k, 3) int32
        Triangles of the mesh, then first halves, then second halves.
    carrier : (k,) int32
        Twice the index of the face, plus 1 for a second half.
    """
    quad = faces[:, 3] >= 0
    number = 2 * np.arange(len(faces), dtype=np.int32)
    triangles = np.concatenate((faces[~quad][:, :3], faces[quad][:, :3], faces[quad][:, [2, 3, 0]]))
    return triangles, np.concatenate((number[~quad], number[quad], number[quad] + 1))


def _joined(
    triangles: NDArray[np.integer], one: NDArray[np.integer], other: NDArray[np.integer]
) -> NDArray[np.integer]:
    """Faces in the order of `triangles`, each of `other` joined to its half in `one`."""
    faces = np.insert(triangles, 3, -1, axis=1)
    faces[one, 3] = triangles[other, 1]
    return np.delete(faces, other, axis=0)
