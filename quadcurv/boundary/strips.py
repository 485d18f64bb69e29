"""Strips of quads inward from the border of a face list, and the quads of ghosts that continue them.

The two sides of a strip run X_0, ..., X_5 straight through X_1, ..., X_4, which must be regular: four quads
around, or on the border two, or three about the corner of a hole; the sixth point may be missing for a
quartic. At a corner, a border vertex of one quad, the ghosts of its two sides are extrapolated once more to
the point across. A face list of a grid thus gets the ghosts of the grid.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary.lines import LEAST, NODES, continued, doubtful_corners, extended
from quadcurv.boundary.septic import LONG, sharpened
from quadcurv.stencils import Stencils, face_pairs
from quadcurv.types import Bools, Floats, Indices

_CORNER = 8.0  # what extrapolating once more makes of errors


class Ghosts(NamedTuple):
    """Ghosts beyond the border of a face list, wherever its strips are long enough.

    Attributes
    ----------
    points : (g, 3) float64
    quads : (k, 4) int32
        Ghost quads over the n vertices and, from n on, the ghosts.
    error : (n,) float64
        The estimated error of the ghosts around a border vertex; infinite where they do not close its ring.
    smooth : (n,) bool
        Whether they close it and are right beyond doubt.
    change : (n,) float64
        What the last point of the lines changes along the normal; NaN where lines are too short to tell.
    """

    points: Floats
    quads: NDArray[np.int32]
    error: Floats
    smooth: Bools
    change: Floats


class _Lines(NamedTuple):
    """Strips of a face list: their sides, and each line of points once.

    Attributes
    ----------
    rails : (2 k, NODES) int64
        The two sides of each strip, see `_strips`.
    line : (2 k,) int64
        Which of the lines each of them is: at a side the strips to the left and right share it.
    vertices : (g, NODES) int64
        The lines, -1 for missing points.
    slot, valence, n_edges
        See `_strips`.
    """

    rails: Indices
    line: Indices
    vertices: Indices
    slot: Indices
    valence: Indices
    n_edges: Indices

    @property
    def beside(self) -> Indices:
        """(k, 2) int64: lines that end beside each other."""
        return self.line.reshape(-1, 2)


def _lines(mesh: Stencils, least: int, nodes: int = NODES) -> _Lines:
    rails, slot, valence, n_edges = _strips(mesh, least, nodes)
    long_first = np.argsort((rails < 0).sum(axis=1), kind="stable")
    key = rails[long_first, 0] * mesh.n + rails[long_first, 1]
    _, first, line = np.unique(key, return_index=True, return_inverse=True)
    line = line[np.argsort(long_first)]
    return _Lines(rails, line, rails[long_first[first]], slot, valence, n_edges)


@np.errstate(all="ignore")
def ghosts(mesh: Stencils, degree: int = 4, layers: int = 1) -> Ghosts:
    """Continue the strips inward from border edges by `layers` ghosts on polynomials of a degree.

    Of degree seven where the lines are smooth enough, else of degree five at most.
    """
    n, found = mesh.n, _lines(mesh, LEAST, NODES if degree < NODES else LONG)
    rails, line, lines, slot, valence, n_edges = found
    if len(rails) == 0:
        none = np.empty((0, 3)), np.empty((0, 4), np.int32)
        return Ghosts(*none, np.full(n, np.inf), np.zeros(n, bool), np.full(n, np.nan))
    x = np.where(lines[..., None] >= 0, mesh.points[lines], np.nan)
    normals, turn = _normals(mesh)
    degree = min(degree, NODES - 1)
    beside = extended(x[:, :NODES], turn[lines[:, 0]], degree, layers, found.beside)
    change = np.full(len(lines), np.nan)
    if x.shape[1] > NODES:
        beside, change = sharpened(beside, x, normals[lines[:, 0]], found.beside)
    outward = np.concatenate((rails[:, :1], n + layers * line[:, None] + np.arange(layers)), axis=1)
    quads = _block_quads(outward.reshape(-1, 2, layers + 1).transpose(0, 2, 1)[..., ::-1], slot)

    both = np.bincount(rails[:, 0], minlength=n) == 2
    side = both & (valence == 2) & (n_edges == 2)
    corner = both & (valence == 1)
    # At a corner one strip begins and another ends: the rail of each runs along the edges of the other.
    at = np.flatnonzero(corner[rails[:, 0]])
    at = at[np.lexsort((at % 2, rails[at, 0]))]
    across, known = _beside(rails, line, rails[at, : degree + 1], n)
    known = known[::2] & known[1::2]
    across, (begin, end) = across[np.repeat(known, 2)], at.reshape(-1, 2)[known].T
    c = rails[begin, 0]
    block = np.empty((c.size, layers + 1, layers + 1), np.int64)
    block[:, :, 0], block[:, 0, :] = outward[begin], outward[end]
    number = n + layers * len(lines) + np.arange(c.size * layers**2)
    block[:, 1:, 1:] = number.reshape(-1, layers, layers)
    corner_quads = _block_quads(block, slot[begin // 2])

    all_even = beside.even[across].all(axis=1).reshape(-1, 2).all(axis=1)
    beyond = continued(beside.ghosts[across], layers, np.repeat(all_even, 2))  # (2 h, layers, layers, 3)
    points = (beyond[::2] + beyond[1::2].swapaxes(1, 2)) / 2

    # The lines of a vertex and of those beside it; of a corner, those that its ghost reads.
    error, smooth = np.zeros(n), np.ones(n, bool)
    np.maximum.at(error, rails[:, 0], beside.error[line].reshape(-1, 2).max(axis=1).repeat(2))
    smooth[rails[~beside.smooth[line].reshape(-1, 2).all(axis=1).repeat(2), 0]] = False
    closed = side
    error[c] = _CORNER * beside.error[across].max(axis=1).reshape(-1, 2).max(axis=1)
    smooth[c] = beside.smooth[across].all(axis=1).reshape(-1, 2).all(axis=1)
    if degree > 4 and c.size:  # ghosts of ghosts, which magnify noise by thousands
        blocks = x[across, : degree + 1].reshape(-1, 2, degree + 1, degree + 1, 3)
        doubt, doubtful = doubtful_corners(blocks, layers, turn[c])
        error[c], smooth[c] = np.maximum(error[c], doubt), smooth[c] & ~doubtful
    closed[c] = True
    ghosts = np.concatenate((beside.ghosts.reshape(-1, 3), points.reshape(-1, 3)))
    error[~closed] = np.inf
    most = np.zeros(n)
    np.maximum.at(most, rails[:, 0], change[line])  # NaN stays
    most[~closed] = np.nan
    return Ghosts(ghosts, np.concatenate((quads, corner_quads)), error, smooth & closed, most)


def roughness(mesh: Stencils) -> Floats:
    """(n,): see `quadcurv.boundary.roughness`; NaN where no strips end at both sides of a border vertex."""
    found, n = _lines(mesh, 5), mesh.n
    rough = np.where(mesh.closed, 0.0, np.nan)
    if len(found.rails) == 0:
        return rough
    x = mesh.points[found.vertices[:, :5]]
    normals, turn = _normals(mesh)
    at = found.vertices[:, 0]
    difference = np.einsum("j,kjx->kx", [1, -4, 6, -4, 1], x - x[:, :1])
    edge = np.linalg.norm(x[:, 1] - x[:, 0], axis=1)
    along, across = np.linalg.norm(difference, axis=1), np.einsum("kx,kx->k", difference, normals[at])
    with np.errstate(divide="ignore", invalid="ignore"):
        of_line = along / edge + np.where(across == 0, 0.0, 4 * np.abs(across) / (edge * turn[at]))
    worst = np.zeros(n)
    np.maximum.at(worst, found.rails[:, 0], of_line[found.beside].max(axis=1).repeat(2))
    served = np.bincount(found.rails[:, 0], minlength=n) == 2
    return np.where(served, worst, rough)


def _normals(mesh: Stencils) -> tuple[Floats, Floats]:
    """Unit normals; of border vertices the sine of the angle by which they turn along or across faces."""
    size = np.linalg.norm(mesh.ring_areas, axis=1, keepdims=True)
    normals = np.divide(mesh.ring_areas, size, out=np.zeros_like(mesh.ring_areas), where=size > 0)
    turn = np.zeros(mesh.n)
    faces = np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)
    faces = faces[~mesh.closed[faces].all(axis=1)]
    for step in (1, 2):
        other = np.roll(faces, step, axis=1)
        angle = np.linalg.norm(np.cross(normals[faces], normals[other]), axis=2)
        np.maximum.at(turn, faces, angle)
        np.maximum.at(turn, other, angle)
    return normals, turn


def _block_quads(blocks: Indices, slot: Indices) -> NDArray[np.int32]:
    """Quads of blocks (k, p, q) of vertices, outward from [0, 0].

    Each begins where the block's face does, moved outward: a fixed diagonal goes on in the ghosts.
    """
    b = blocks.astype(np.int32)
    quads = np.stack((b[:, 1:, 1:], b[:, 1:, :-1], b[:, :-1, :-1], b[:, :-1, 1:]), axis=-1)
    turned = (np.arange(4) - slot[:, None]) % 4
    return np.take_along_axis(quads, turned[:, None, None], axis=3).reshape(-1, 4)


def _beside(rails: Indices, line: Indices, along: Indices, n: int) -> tuple[Indices, Bools]:
    """Lines of ghosts beside vertices `along` a side, as the strips there have them; whether all exist."""
    key = rails[:, 0] * n + rails[:, 0].reshape(-1, 2)[:, ::-1].ravel()
    order = np.argsort(key)
    wanted = along * n + along[:, [1, *range(along.shape[1] - 1)]]
    place = order[np.minimum(np.searchsorted(key, wanted, sorter=order), key.size - 1)]
    return line[place], (key[place] == wanted).all(axis=1)


def _strips(mesh: Stencils, least: int, nodes: int) -> tuple[Indices, Indices, Indices, Indices]:
    """Strips of quads inward from border edges, straight through regular vertices.

    Returns
    -------
    rails : (2 k, nodes) int64
        The two sides of each strip; its first face runs from the first one to the second. -1 for the last
        points, if there are at least `least`.
    slot : (k,) int64
        Where the boundary edge begins in that face.
    valence, n_edges : (n,) int64
        Number of faces and of boundary edges at each vertex.
    """
    from quadcurv.kernels import topology

    faces, n = mesh.faces, mesh.n
    border = np.flatnonzero(~mesh.closed[faces].all(axis=1))
    sides = np.where(faces[border, 3] < 0, 3, 4)
    outer = np.arange(4) < sides[:, None]
    f, i, g, j = face_pairs(faces[border])
    outer[f, i] = outer[g, j] = False
    near, i = np.nonzero(outer)
    f, j = border[near], (i + 1) % sides[near]
    # An edge with an end inside is none: its other face is not among those at the border.
    kept = ~mesh.closed[faces[f, i]] & ~mesh.closed[faces[f, j]]
    n_edges = np.bincount(np.concatenate((faces[f, i][kept], faces[f, j][kept])), minlength=n)

    indptr, corners = topology.corners_by_vertex(faces, n)
    valence = np.diff(indptr)
    # On the border two quads, or three about the corner of a hole.
    regular = np.where(mesh.closed, valence == 4, (valence == 2) | (valence == 3))
    regular[faces[faces[:, 3] < 0, :3]] = False
    kept &= faces[f, 3] >= 0
    f, i, j = f[kept], i[kept], j[kept]
    slot = i
    strips = np.full((f.size, 2, nodes), -1)
    strips[:, 0, 0], strips[:, 1, 0] = faces[f, i], faces[f, j]
    place = np.arange(f.size)
    for k in range(1, nodes):
        i, j = (2 * i - j) % 4, (2 * j - i) % 4  # across the quad, where the edge begins and ends
        u, v = faces[f, i], faces[f, j]
        strips[place, 0, k], strips[place, 1, k] = u, v
        around = corners[np.minimum(indptr[u, None] + np.arange(4), indptr[u + 1, None] - 1)] // 4
        beyond = (faces[around] == v[:, None, None]).any(axis=2) & (around != f[:, None])
        kept = regular[u] & regular[v] & beyond.any(axis=1)
        place, u, v = place[kept], u[kept], v[kept]
        f = around[kept, beyond[kept].argmax(axis=1)]
        i, j = (faces[f] == u[:, None]).argmax(axis=1), (faces[f] == v[:, None]).argmax(axis=1)
    long_enough = strips[:, 0, least - 1] >= 0
    return strips[long_enough].reshape(-1, nodes), slot[long_enough], valence, n_edges
