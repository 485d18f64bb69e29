"""One mesh made into another: triangles into quads, a face list into a grid, coincident points into one,
sides turned. Each takes whatever :func:`quadcurv.as_mesh` takes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.coincidence import first_at_place
from quadcurv.io.base import FaceList, polygons
from quadcurv.io.meshes import as_mesh, face_list
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, Recovery, StaggeredGrid
from quadcurv.stencils import face_pairs
from quadcurv.types import Bools, Floats, MeshError


def pair_triangles(mesh: Any) -> QuadMesh:
    """Pair the triangles of a mesh into quads by their shape.

    Neighbouring triangles are matched so that as many as possible make quads as flat, convex and right-
    angled as possible: a matching of maximum weight, 1 plus the least sine of a quad's angles each. What
    finds no partner stays a triangle. Of quads that were split and shuffled nearly all come back, unless
    they are sheared so far that other pairs look better.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes but a StaggeredGrid. Its quads stay as they are.

    Returns
    -------
    QuadMesh
        Over the same points; its `recovery` has the rule "shape" and the fraction of triangles paired.

    Notes
    -----
    The fractional matching of maximum weight is half a matching of the bipartite double cover, which has
    every triangle on both sides; where it leaves an odd cycle the best pairs are taken first. About a
    second per 50,000 triangles.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> halves = [*ball.faces[:, [0, 1, 2]], *ball.faces[:, [2, 3, 0]]]
    >>> qc.pair_triangles((ball.points, halves))
    QuadMesh(98 points, 96 quads)
    """
    mesh = face_list(mesh)
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
    n_triangles = int(np.count_nonzero(mesh.faces[:, 3] < 0))
    recovery = Recovery("shape", 2 * len(chosen) / max(n_triangles, 1))
    paired = QuadMesh(_given_points(mesh), np.delete(faces, np.maximum(f, g)[chosen], axis=0))
    return paired.with_recovery(recovery)


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


def duplicate_points(mesh: Any, tolerance: float = 0.0) -> NDArray[np.int64]:
    """For every vertex the first one at the same place.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes but a StaggeredGrid; vertices of a grid row by row.
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

    Examples
    --------
    >>> import quadcurv as qc
    >>> points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]]
    >>> qc.duplicate_points((points, [[0, 1, 2, 3], [4, 5, 6, 7]])).tolist()
    [0, 1, 2, 3, 1, 5, 6, 2]
    """
    if not (isinstance(tolerance, int | float | np.number) and tolerance >= 0):
        raise MeshError(f"tolerance: expected a length >= 0, got {tolerance!r}")
    return first_at_place(face_list(mesh, seams=False).points, tolerance)


def merge_points(mesh: Any, tolerance: float = 0.0) -> tuple[QuadMesh, NDArray[np.int64]]:
    """Merge vertices at the same place, as at a seam; vertices without a face stay.

    A side of length zero is left out, so that a quad becomes a triangle; so is a face with fewer than three
    places.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes but a StaggeredGrid; vertices of a grid row by row.
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
        A ValueError: no face is left.

    Warns
    -----
    MeshWarning
        Faces now meet where more than two share an edge, or are the same one.

    Examples
    --------
    >>> import quadcurv as qc
    >>> points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]]
    >>> merged, vertex = qc.merge_points((points, [[0, 1, 2, 3], [4, 5, 6, 7]]))
    >>> merged, vertex.tolist()
    (QuadMesh(6 points, 2 quads), [0, 1, 2, 3, 1, 4, 5, 2])
    """
    mesh = face_list(mesh, seams=False)
    kept, vertex = np.unique(duplicate_points(mesh, tolerance), return_inverse=True)
    given = FaceList.of(mesh)
    corners = vertex[given.corners]
    end = np.cumsum(given.sizes)
    following = np.arange(1, len(corners) + 1)
    following[end - 1] = end - given.sizes
    moved = corners != corners[following]
    sides = np.add.reduceat(moved, end - given.sizes, dtype=np.int64)
    moved &= np.repeat(sides >= 3, given.sizes)
    return QuadMesh(_given_points(mesh)[kept], polygons(sides[sides >= 3], corners[moved])), vertex


def as_grid(mesh: Any) -> tuple[QuadGrid, NDArray[np.int64]]:
    """Make a grid of a logically Cartesian face list: a rectangle, a tube or a torus of quads.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes but a StaggeredGrid. Quads only; four at every inner
        vertex, two at the boundary, one at a corner. The first direction of the grid runs along the
        first edge of the first face.

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

    Examples
    --------
    >>> import quadcurv as qc
    >>> torus = qc.surfaces.torus().sample((12, 8))[0].to_mesh()
    >>> grid, vertex = qc.as_grid(torus)
    >>> sorted(grid.shape), grid.wrap
    ([8, 12], (True, True))
    """
    mesh = face_list(mesh)
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
    return QuadGrid(_given_points(mesh)[vertex], (wraps, closes)), vertex.astype(np.int64)


def flip(mesh: Any) -> Mesh:
    """Turn all faces round, so that normals point to the other side and H changes its sign.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes.

    Returns
    -------
    QuadMesh, QuadGrid or StaggeredGrid
        Of a face list the same vertices, every face beginning with the same one. Of a grid its transpose:
        rows become columns, and values (r, c) become ``values.T``.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> bool((qc.mean_curvature(qc.flip(ball)) < 0).all())
    True
    """
    mesh = as_mesh(mesh)
    if isinstance(mesh, QuadGrid):
        mask = None if mesh.mask is None else mesh.mask.T
        return QuadGrid(_given_points(mesh).swapaxes(0, 1), mesh.wrap[::-1], mask)
    if isinstance(mesh, StaggeredGrid):
        return StaggeredGrid(mesh.primal.swapaxes(0, 1), mesh.dual.swapaxes(0, 1), mesh.wrap[::-1])
    return _turned(mesh, np.ones(len(mesh.faces), bool))


def _turned(mesh: QuadMesh, turn: Bools) -> QuadMesh:
    """The mesh with some of its faces given the other way round."""
    faces = FaceList.of(mesh).turned(turn)
    turned = QuadMesh(_given_points(mesh), polygons(faces.sizes, faces.corners))
    return turned if mesh.recovery is None else turned.with_recovery(mesh.recovery)


def orient(mesh: Any) -> Mesh:
    """Turn closed parts of a mesh so that their normals point outward, and H > 0 on a sphere.

    Parameters
    ----------
    mesh : object
        Anything :func:`quadcurv.as_mesh` takes.

    Returns
    -------
    QuadMesh, QuadGrid or StaggeredGrid
        Every part that is joined by edges and closed has a positive signed volume; a part inside another,
        as the wall of a cavity, too. Open parts have no outside and are left as they are, as are parts
        without volume and non-orientable meshes. Where nothing is turned the mesh itself is returned, a
        grid that is turned is transposed as in :func:`flip`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> inside_out = qc.flip(ball)
    >>> bool((qc.mean_curvature(qc.orient(inside_out)) > 0).all())
    True
    """
    mesh = as_mesh(mesh)
    if isinstance(mesh, QuadMesh):
        turn = _inside_out(mesh)
        return _turned(mesh, turn) if turn.any() else mesh
    surface = QuadGrid(mesh.primal, mesh.wrap) if isinstance(mesh, StaggeredGrid) else mesh
    return flip(mesh) if all(mesh.wrap) and _inside_out(surface.to_mesh()).any() else mesh


def _inside_out(mesh: QuadMesh) -> Bools:
    """Faces of the closed parts whose signed volume is negative."""
    if not mesh.orientable:
        return np.zeros(len(mesh.faces), bool)
    m = len(mesh.faces)
    f, _, g, _ = face_pairs(mesh.faces)
    joined = scipy.sparse.coo_array((np.ones(f.size, bool), (f, g)), shape=(m, m))
    n_parts, part = scipy.sparse.csgraph.connected_components(joined, directed=False)
    sides = np.where(mesh.faces[:, 3] < 0, 3, 4)
    closed = np.bincount(part, sides - np.bincount(f, minlength=m) - np.bincount(g, minlength=m)) == 0
    a, b, c, d = np.moveaxis(mesh.points[np.where(mesh.faces < 0, mesh.faces[:, :1], mesh.faces)], 1, 0)
    # About a point of the part itself: about a distant origin the volume would drown in rounding.
    _, first = np.unique(part, return_index=True)
    a, b, c, d = (corner - a[first[part]] for corner in (a, b, c, d))
    # The mean of the corners times the vector area, which for quads is half the product of the diagonals.
    middle = (a + b + c + np.where(sides[:, None] == 4, d, 0)) / sides[:, None]
    volume = np.einsum("fx,fx->f", middle, np.cross(c - a, d - b))
    return (closed & (np.bincount(part, volume, minlength=n_parts) < 0))[part]


def _given_points(mesh: QuadMesh | QuadGrid) -> NDArray[np.floating]:
    """Positions as precise as they were given, so that what is made of them knows."""
    return mesh.points.astype(np.float32) if mesh.roundoff > 2.0**-50 else mesh.points
