"""One mesh made into another: triangles into quads, a face list into a grid, coincident points into one."""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.mesh import QuadGrid, QuadMesh, Recovery
from quadcurv.stencils import face_pairs
from quadcurv.types import Floats, Ints, MeshError


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


def pair_triangles(mesh: QuadMesh) -> QuadMesh:
    """Pair the triangles of a mesh into quads by their shape.

    Neighbouring triangles are matched so that as many as possible make quads as flat, convex and right-
    angled as possible: a matching of maximum weight, 1 plus the least sine of a quad's angles each. What
    finds no partner stays a triangle. Of quads that were split and shuffled nearly all come back, unless
    they are sheared so far that other pairs look better.

    Parameters
    ----------
    mesh : QuadMesh
        Its quads stay as they are.

    Returns
    -------
    QuadMesh
        Over the same points; its `recovery` has the rule "shape" and the fraction of triangles paired.

    Notes
    -----
    The fractional matching of maximum weight is half a matching of the bipartite double cover, which has
    every triangle on both sides; where it leaves an odd cycle the best pairs are taken first. About a
    second per 50,000 triangles.
    """
    m = len(mesh.faces)
    f, i, g, j = face_pairs(mesh.faces)
    # Triangle f = (a, b, c) has the common edge from c to a; d is the corner of g across it.
    c, a, b = (mesh.faces[f, (i + s) % 3] for s in range(3))
    quads = np.stack((a, b, c, mesh.faces[g, (j + 2) % 3]), axis=-1)
    quality = _least_sine(mesh.points[quads])
    good = (mesh.faces[f, 3] < 0) & (mesh.faces[g, 3] < 0) & (quality > 0)
    f, g, quads, quality = f[good], g[good], quads[good], quality[good]
    # Costs, all positive: 3 for staying alone, against 2 - quality on either side of the cover.
    alone = np.arange(m)
    cost = scipy.sparse.csr_array(
        (
            np.concatenate((2 - quality, 2 - quality, np.full(m, 3.0))),
            (np.concatenate((f, g, alone)), np.concatenate((g, f, alone))),
        ),
        shape=(m, m),
    )
    _, partner = scipy.sparse.csgraph.min_weight_full_bipartite_matching(cost)
    matched = (partner[f] == g) & (partner[g] == f)
    free = np.ones(m, bool)
    chosen = []
    for pair in np.lexsort((-quality, ~matched)).tolist():
        if free[f[pair]] and free[g[pair]]:
            free[f[pair]] = free[g[pair]] = False
            chosen.append(pair)
    faces = mesh.faces.copy()
    faces[np.minimum(f, g)[chosen]] = quads[chosen]
    paired = QuadMesh(mesh.points, np.delete(faces, np.maximum(f, g)[chosen], axis=0))
    n_triangles = int(np.count_nonzero(mesh.faces[:, 3] < 0))
    return paired.with_recovery(Recovery("shape", 2 * len(chosen) / max(n_triangles, 1)))


def _least_sine(quads: Floats) -> Floats:
    """Least sine of the angles seen along the normal: 1 for a rectangle, negative for a reflex corner."""
    edges = np.roll(quads, -1, axis=1) - quads
    back = -np.roll(edges, 1, axis=1)
    normal = np.cross(quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1])
    lengths = np.linalg.norm(edges, axis=2) * np.linalg.norm(back, axis=2)
    with np.errstate(divide="ignore", invalid="ignore"):
        sine = np.einsum(
            "qkx,qx->qk", np.cross(edges, back), normal / np.linalg.norm(normal, axis=1)[:, None]
        )
        return np.nan_to_num((sine / lengths).min(axis=1), nan=-1.0)


def duplicate_points(mesh: QuadMesh, tolerance: float = 0.0) -> NDArray[np.int64]:
    """For every vertex the first one at the same place.

    Parameters
    ----------
    mesh : QuadMesh
    tolerance : float, default 0
        Points this far apart, and chains of them, count as one place; a length.

    Returns
    -------
    (n,) int64
        Its own index where a vertex is alone or the first.
        ``(duplicate_points(mesh) != np.arange(n)).sum()`` vertices could be merged.

    Raises
    ------
    MeshError
        A ValueError: tolerance is negative or not a number.
    """
    if not tolerance >= 0:
        raise MeshError(f"tolerance: expected a length >= 0, got {tolerance!r}")
    n = len(mesh.points)
    if tolerance == 0:
        order = np.lexsort(mesh.points.T)
        moved = (np.diff(mesh.points[order], axis=0) != 0).any(axis=1)
        place = np.empty(n, np.int64)
        place[order] = np.concatenate(([0], np.cumsum(moved)))
    else:
        pairs = scipy.spatial.cKDTree(mesh.points).query_pairs(tolerance, output_type="ndarray")
        near = scipy.sparse.coo_array((np.ones(len(pairs), bool), (pairs[:, 0], pairs[:, 1])), shape=(n, n))
        _, place = scipy.sparse.csgraph.connected_components(near, directed=False)
    _, first, of = np.unique(place, return_index=True, return_inverse=True)
    return first[of]


def merge_points(mesh: QuadMesh, tolerance: float = 0.0) -> tuple[QuadMesh, NDArray[np.int64]]:
    """Merge vertices at the same place, as at a seam; vertices without a face stay.

    A quad with a side of length zero becomes a triangle; a face with fewer than three places is left out.

    Parameters
    ----------
    mesh : QuadMesh
    tolerance : float, default 0
        As in :func:`duplicate_points`; of merged vertices the first one's position is kept.

    Returns
    -------
    merged : QuadMesh
    vertex : (n,) int64
        Where each of the given vertices went: values of the merged mesh are ``values[vertex]`` on the
        given one.

    Raises
    ------
    MeshError
        A ValueError: faces that meet where more than two share an edge, or no face is left.
    """
    kept, vertex = np.unique(duplicate_points(mesh, tolerance), return_inverse=True)
    corners = mesh.faces >= 0
    faces = np.where(corners, vertex[mesh.faces], -1)
    following = np.where(corners, np.roll(faces, -1, axis=1), -1)
    triangle = ~corners[:, 3]
    following[triangle, 2] = faces[triangle, 0]
    moved = corners & (faces != following)
    faces[~moved] = -1
    # Left-justify the corners that remain.
    faces = np.take_along_axis(faces, np.argsort(~moved, axis=1, kind="stable"), axis=1)
    return QuadMesh(mesh.points[kept], faces[moved.sum(axis=1) >= 3]), vertex


def as_grid(mesh: QuadMesh) -> tuple[QuadGrid, NDArray[np.int64]]:
    """Make a grid of a logically Cartesian face list: a rectangle, a tube or a torus of quads.

    Parameters
    ----------
    mesh : QuadMesh
        Quads only; four at every inner vertex, two at the boundary, one at a corner. The first direction
        of the grid runs along the first edge of the first face.

    Returns
    -------
    grid : QuadGrid
        With the wraps found.
    vertex : (r, c) int64
        ``grid.points = mesh.points[vertex]``. Values go over as ``f_grid = f[vertex]``, and back as
        ``f[vertex] = f_grid``.

    Raises
    ------
    MeshError
        A ValueError: triangles, another valence (with the first vertex), several components,
        a non-orientable mesh, a torus whose lines close with a shift, or fewer than three vertices around.
    """
    faces = mesh.faces
    if (faces[:, 3] < 0).any():
        raise MeshError(f"mesh: not a grid, {np.count_nonzero(faces[:, 3] < 0)} of its faces are triangles")
    if not mesh.orientable:
        raise MeshError("mesh: not a grid, it is non-orientable")
    valence, closed = mesh.stencils().valence, mesh.stencils().closed
    irregular = np.where(closed, valence != 4, valence > 2)
    if irregular.any():
        v = int(np.argmax(irregular))
        place = "an inner vertex" if closed[v] else "a boundary vertex"
        raise MeshError(
            f"mesh: not a grid, {np.count_nonzero(irregular)} extraordinary vertices, first vertex {v}: "
            f"{place} with {valence[v]} faces"
        )
    # Half-edge 4 f + s runs from slot s of face f to the next slot, the face on its left.
    origin, twin = faces.ravel(), np.full(faces.size, -1)
    f, i, g, j = face_pairs(faces)
    twin[4 * f + i], twin[4 * g + j] = 4 * g + j, 4 * f + i

    def turn(h: Any, quarters: int) -> Any:
        return h - h % 4 + (h + quarters) % 4

    def step(h: Any, out: int, on: int) -> Any:
        """The parallel half-edge beyond side `out` of the face, -1 where the mesh ends."""
        other = twin[turn(h, out)]
        return np.where(other < 0, -1, turn(other, on))

    ahead, back, left, right = (1, 1), (-1, -1), (2, 0), (0, 2)

    def line(h: int, way: tuple[int, int]) -> tuple[list[int], bool]:
        """Half-edges from h on, and whether they return to h."""
        path = [h]
        while (after := int(step(path[-1], *way))) >= 0 and after != h:
            path.append(after)
        return path, after == h

    start = 0
    for way in (back, right):
        path, returns = line(start, way)
        start = start if returns else path[-1]
    first, wraps = line(start, ahead)
    lines = [np.array(first)]
    while (after := step(lines[-1], *left))[0] >= 0 and after[0] not in first:
        lines.append(after)
    if len(lines) * len(first) != len(faces):
        raise MeshError("mesh: not a grid, its faces make several components")
    closes = bool(after[0] >= 0)
    if closes and (shift := first.index(after[0])):
        raise MeshError(
            f"mesh: not a grid but a twisted torus: {len(lines)} lines of {len(first)} quads close with a "
            f"shift of {shift}"
        )
    ends = [] if closes else [turn(lines[-1], 3)]
    vertex = np.stack([origin[h] for h in lines + ends], axis=1)
    if not wraps:
        last = [turn(h[-1], 1) for h in lines] + [turn(h[-1], -1) for h in ends]
        vertex = np.concatenate((vertex, [origin[last]]))
    if len(np.unique(vertex)) < vertex.size:
        raise MeshError("mesh: not a grid, some vertices lie at several places of its border")
    return QuadGrid(mesh.points[vertex], (wraps, closes)), vertex.astype(np.int64)
