"""Ghost layers: stencils whose rings are closed at open sides too."""

from __future__ import annotations

from math import comb
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.stencils import Frame, Stencils, face_pairs, grid_faces
from quadcurv.types import Bools, Floats, MeshError

Indices = NDArray[np.int64]

BOUNDARIES = ("extrapolate", "nan")
OPEN, INTERIOR, EXTRAPOLATED = 0, 1, 2
DEGREE = 4


def checked_boundary(boundary: str) -> str:
    """The treatment of the boundary by name, if there is one of that name."""
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary: expected one of {BOUNDARIES}, got {boundary!r}")
    return boundary


def one_rings(mesh: Mesh, boundary: str = "extrapolate") -> Stencils:
    """One-ring stencils of a mesh, its boundary treated.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid
    boundary : {"extrapolate", "nan"}
        "extrapolate" closes rings at the boundary by one layer of ghost points,
        X_-1 = 5 X_0 - 10 X_1 + 10 X_2 - 5 X_3 + X_4, which keeps second order up to the border with the
        interior's own error. "nan" leaves them open: their curvature is NaN.

    Returns
    -------
    Stencils

    Raises
    ------
    MeshError
        A ValueError: an open direction of a grid has fewer than the 5 points that the extrapolation
        reads. (The same side of a face list stays open.)
    ValueError
        Unknown boundary.

    Notes
    -----
    Of a face list, the strip of quads inward from each boundary edge is continued by one ghost quad. Its two
    sides run X_0, ..., X_4 straight through X_1, X_2, X_3, which must be regular: four quads around, or
    two on the boundary. At a corner, a boundary vertex of one quad, the two ghost layers are
    extrapolated once more to the point across. A face list of a grid thus gets the ghosts of the grid.
    A boundary vertex is closed if it has one or two faces and all ghost quads around it exist.

    Nothing is known, and the curvature by every stiffness and dual area is NaN, at other boundary
    vertices: of three or more faces (also at a re-entrant corner), of several fans, of a triangle, and where
    a strip beside them is too short or meets a triangle or an extraordinary vertex within four quads.
    :func:`boundary_treatment` tells which is which. Fits need no ghosts there: they look to one side.

    The extrapolation trusts the strips to be smooth: an error of one position reaches a ghost up to 10
    times as large, that across a corner up to 100 times. :func:`roughness` tells what to expect of it.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> stencils = qc.one_rings(ball)
    >>> stencils.n, bool(stencils.closed.all())
    (98, True)
    """
    checked_boundary(boundary)
    if boundary == "nan":
        return mesh.stencils()
    if isinstance(mesh, QuadGrid) and mesh.mask is not None:
        mesh = mesh.to_mesh()
    if isinstance(mesh, QuadMesh):
        given = mesh.stencils()
        return with_ghosts(given, ghosts(given))[0]
    if isinstance(mesh, QuadGrid):
        return _ghosted_grid(mesh)
    if mesh.has_ghosts:
        return mesh.stencils()
    return _ghosted_cells(mesh)


def boundary_treatment(mesh: Mesh, boundary: str = "extrapolate") -> NDArray[np.uint8]:
    """What closes the ring of every vertex.

    Parameters
    ----------
    mesh, boundary
        As for :func:`one_rings`.

    Returns
    -------
    (n,) or (r, c) uint8
        ``INTERIOR`` (1): faces of the mesh, or ghost cells that it came with. ``EXTRAPOLATED`` (2): ghost
        quads. ``OPEN`` (0): nothing, and the curvature is NaN; isolated vertices too.

    Raises
    ------
    ValueError
        As for :func:`one_rings`.

    Examples
    --------
    >>> import quadcurv as qc
    >>> sheet, _, _ = qc.surfaces.tanh_sheet().sample((8, 8))
    >>> qc.boundary_treatment(sheet)[:2, :3]
    array([[2, 2, 2],
           [2, 1, 1]], dtype=uint8)
    """
    given, treated = mesh.stencils().closed, one_rings(mesh, boundary)
    treatment = np.where(given, INTERIOR, np.where(treated.closed, EXTRAPOLATED, OPEN))
    return mesh.in_shape(treatment.astype(np.uint8))


def roughness(mesh: Mesh) -> Floats:
    """How rough the lines are that extrapolation continues: about the relative error it makes.

    Parameters
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid

    Returns
    -------
    (n,) or (r, c) float64
        Length of the last difference X_0 - 4 X_1 + 6 X_2 - 4 X_3 + X_4 over that of X_1 - X_0, the
        largest of all ghosts around the vertex; 0 inside, NaN in an open ring. On a smooth mesh it falls
        with the third power of the edges. Where points are uneven instead, the error of the mean
        curvature is once or twice this part of the larger principal curvature (up to six times at the
        corners of a grid), and beyond one half nothing can be said.

    Raises
    ------
    MeshError
        As for :func:`one_rings`.
    """
    if isinstance(mesh, StaggeredGrid):
        if mesh.has_ghosts:
            return np.zeros(mesh.shape)
        mesh = QuadGrid(mesh.primal, mesh.wrap)
    return mesh.in_shape(_roughness(mesh.stencils())[1])


def ghost_layer(
    points: Floats, wrap: tuple[bool, bool], degree: int = DEGREE, layers: int = 1
) -> tuple[NDArray[np.int32], Floats]:
    """Surround a grid of points by ghosts where it is open.

    Parameters
    ----------
    points : (r, c, 3) float64
    wrap : (bool, bool)
        Directions that wrap, hence have no open side.
    degree : int
        Degree of the polynomial through the degree + 1 points next to an open side.
    layers : int
        How many ghosts X_-1, X_-2, ... beyond an open side, all on the same polynomial. Second-order
        schemes that read one ring want one layer of degree 4, fourth-order ones that read two rings
        two layers of degree 5.

    Returns
    -------
    index : (r or r + 2 layers, c or c + 2 layers) int32
        Indices of the grid with its ghosts: the points row by row, then the ghosts from r c on.
    ghosts : (g, 3) float64

    Raises
    ------
    MeshError
        A ValueError: fewer than degree + 1 points in an open direction.
    """
    shape = points.shape[:2]
    _require(shape, wrap, degree)
    number = np.arange(shape[0] * shape[1], dtype=np.int32).reshape(shape)
    index = np.pad(number, [(0 if w else layers,) * 2 for w in wrap], constant_values=-1)
    is_ghost = index < 0
    index[is_ghost] = np.arange(number.size, number.size + np.count_nonzero(is_ghost))
    along, across = (_extension(s, w, degree, layers) for s, w in zip(shape, wrap, strict=True))
    extend = scipy.sparse.kron(along, across, format="csr")
    # Relative to one of the points, so that an offset of the whole surface costs no digits.
    origin = points[0, 0]
    ghosts = extend[np.flatnonzero(is_ghost)] @ (points - origin).reshape(-1, 3) + origin
    return index, ghosts


def frame(grid: QuadGrid | StaggeredGrid, boundary: str = "extrapolate") -> Frame:
    """What :func:`one_rings` puts around a grid, as rows and columns; NaN where nothing is known.

    Parameters
    ----------
    grid : QuadGrid or StaggeredGrid
        The ghost cells of a grid that has them are not copied: NaN stands for them.
    boundary
        As for :func:`one_rings`.

    Returns
    -------
    Frame

    Raises
    ------
    ValueError
        As for :func:`one_rings`.
    """
    checked_boundary(boundary)
    points = grid.points if isinstance(grid, QuadGrid) else grid.primal
    if isinstance(grid, StaggeredGrid) and grid.has_ghosts:
        points, boundary = points[1:-1, 1:-1], "nan"
    if boundary == "extrapolate":
        _require(points.shape[:2], grid.wrap, DEGREE)

    across = np.zeros(0) if grid.wrap[1] else np.array([np.nan]) if boundary == "nan" else _weights(DEGREE)
    if grid.wrap[0]:
        beyond = points[[-1, 0]]
    elif boundary == "nan":
        beyond = np.full((2, *points.shape[1:]), np.nan)
    else:
        beyond = points[[0, -1]]
        for row, near in zip(beyond, (points, points[::-1]), strict=True):
            for k, weight in enumerate(_weights(DEGREE)[1:], 1):
                row += weight * (near[k] - near[0])  # an offset costs no digits
    return Frame(beyond.ravel(), across)


def _require(shape: tuple[int, ...], wrap: tuple[bool, bool], degree: int) -> None:
    for size, wraps, name in zip(shape, wrap, ("rows", "columns"), strict=True):
        if not wraps and size <= degree:
            raise MeshError(
                f"points: {size} {name}, but extrapolation beyond an open side needs at least "
                f'{degree + 1}; boundary="nan" needs none'
            )


def _weights(degree: int, layer: int = 1) -> Floats:
    """Lagrange polynomials of the nodes 0, ..., degree at -layer."""
    return np.array(
        [(-1.0) ** k * comb(degree + layer, degree - k) * comb(layer + k - 1, k) for k in range(degree + 1)]
    )


def _extension(size: int, wraps: bool, degree: int, layers: int) -> scipy.sparse.csr_array:
    """Identity, between rows of extrapolation where the direction is open."""
    identity = scipy.sparse.eye_array(size, format="csr")
    if wraps:
        return identity
    rows = np.zeros((layers, size))
    for layer in range(1, layers + 1):
        rows[-layer, : degree + 1] = _weights(degree, layer)
    before, after = scipy.sparse.csr_array(rows), scipy.sparse.csr_array(rows[::-1, ::-1])
    return scipy.sparse.vstack((before, identity, after), format="csr")


def _ghosted_grid(grid: QuadGrid) -> Stencils:
    index, ghosts = ghost_layer(grid.points, grid.wrap)
    index = np.pad(index, [(0, int(w)) for w in grid.wrap], mode="wrap")
    points = np.concatenate((grid.points.reshape(-1, 3), ghosts))
    closed = np.ones(grid.shape[0] * grid.shape[1], bool)
    return Stencils(points, grid_faces(index), grid.shape, closed)


def _ghosted_cells(grid: StaggeredGrid) -> Stencils:
    index, ghosts = ghost_layer(grid.primal, grid.wrap)
    index = np.pad(index, [(int(w),) * 2 for w in grid.wrap], mode="wrap")
    return grid.diamonds(index, ghosts)


class Ghosts(NamedTuple):
    """The ghost layers of a face list, as far as its connectivity settles them.

    Attributes
    ----------
    layers : int
    lines : (g, degree + 1) int64
        The vertices that the ghosts beside an edge, `layers` of them, are extrapolated from.
    across : (2 h, degree + 1) int64
        The lines of two sides whose ghosts those across a corner, `layers` squared, are the mean
        extrapolation of.
    quads : (k, 4) int32
        Ghost quads over the n vertices, the ghosts of the g lines and those across h corners.
    closed : (n,) bool
        Whether the ring is closed with them.
    """

    layers: int
    lines: Indices
    across: Indices
    quads: NDArray[np.int32]
    closed: Bools


def ghosts(mesh: Stencils, degree: int = DEGREE, layers: int = 1) -> Ghosts:
    """Find ghost quads beyond every boundary edge whose strip is long enough, see :func:`one_rings`."""
    n = mesh.n
    rails, slot, valence, n_edges = _strips(mesh, degree)
    if len(rails) == 0:
        none = np.empty((0, degree + 1), np.int64)
        return Ghosts(layers, none, none, np.empty((0, 4), np.int32), mesh.closed)
    # One line for each rail X_0, X_1, ...: at a side the strips to the left and right share it.
    _, first, line = np.unique(rails[:, 0] * n + rails[:, 1], return_index=True, return_inverse=True)
    outward = np.concatenate((rails[:, :1], n + layers * line[:, None] + np.arange(layers)), axis=1)
    quads = _block_quads(outward.reshape(-1, 2, layers + 1).transpose(0, 2, 1)[..., ::-1], slot)

    both = np.bincount(rails[:, 0], minlength=n) == 2
    side = both & (valence == 2) & (n_edges == 2)
    corner = both & (valence == 1)
    # At a corner one strip begins and another ends: the rail of each runs along the edges of the other.
    at = np.flatnonzero(corner[rails[:, 0]])
    at = at[np.lexsort((at % 2, rails[at, 0]))]
    across, known = _beside(rails, line, rails[at], n)
    known = known[::2] & known[1::2]
    across, (begin, end) = across[np.repeat(known, 2)], at.reshape(-1, 2)[known].T
    c = rails[begin, 0]
    block = np.empty((c.size, layers + 1, layers + 1), np.int64)
    block[:, :, 0], block[:, 0, :] = outward[begin], outward[end]
    number = n + layers * len(first) + np.arange(c.size * layers**2)
    block[:, 1:, 1:] = number.reshape(-1, layers, layers)
    corner_quads = _block_quads(block, slot[begin // 2])

    closed = mesh.closed | side
    closed[c] = True
    return Ghosts(layers, rails[first], across, np.concatenate((quads, corner_quads)), closed)


def with_ghosts(mesh: Stencils, layer: Ghosts) -> tuple[Stencils, Floats]:
    """Stencils with ghost layers at their positions; how rough the extrapolation is (p,), 0 inside."""
    beside, rough = _extrapolated(mesh.points[layer.lines], layer.layers)
    across, rough_across = _extrapolated(beside[layer.across], layer.layers)
    corner = (across[::2] + across[1::2].swapaxes(1, 2)) / 2
    rough_corner = np.maximum(rough_across[::2, None, :], rough_across[1::2, :, None])
    points = np.concatenate((mesh.points, beside.reshape(-1, 3), corner.reshape(-1, 3)))
    faces = np.concatenate((mesh.faces, layer.quads))
    rough = np.concatenate((np.zeros(mesh.n), np.repeat(rough, layer.layers), rough_corner.ravel()))
    return Stencils(points, faces, mesh.shape, layer.closed, mesh.orientable, mesh.polygons), rough


def _roughness(mesh: Stencils) -> tuple[Stencils, Floats]:
    """Stencils with the ghost layer; the worst roughness of the ghost quads at each vertex (n,)."""
    layer = ghosts(mesh)
    treated, rough = with_ghosts(mesh, layer)
    worst = np.zeros(rough.size)
    np.maximum.at(worst, layer.quads, rough[layer.quads].max(axis=1, keepdims=True))
    worst = worst[: mesh.n]
    return treated, np.where(layer.closed & np.isfinite(worst), worst, np.nan)


def _block_quads(blocks: Indices, slot: Indices) -> NDArray[np.int32]:
    """Quads of blocks (k, p, q) of vertices, outward from [0, 0].

    Each begins where the block's face does, moved outward: a fixed diagonal goes on in the ghosts.
    """
    b = blocks.astype(np.int32)
    quads = np.stack((b[:, 1:, 1:], b[:, 1:, :-1], b[:, :-1, :-1], b[:, :-1, 1:]), axis=-1)
    turned = (np.arange(4) - slot[:, None]) % 4
    return np.take_along_axis(quads, turned[:, None, None], axis=3).reshape(-1, 4)


def _extrapolated(lines: Floats, layers: int) -> tuple[Floats, Floats]:
    """X_-1, X_-2, ... of lines X_0, X_1, ... (k, degree + 1, ..., 3), and how rough these are (k, ...)."""
    degree = lines.shape[1] - 1
    x = lines - lines[:, :1]  # an offset costs no digits
    difference = np.linalg.norm(np.diff(x, degree, axis=1)[:, 0], axis=-1)
    edge = np.linalg.norm(x[:, 1], axis=-1)
    rough = np.divide(difference, edge, out=np.full(edge.shape, np.inf), where=edge > 0)
    beyond = [np.einsum("k,lk...->l...", _weights(degree, m + 1), x) for m in range(layers)]
    return lines[:, :1] + np.stack(beyond, axis=1), rough


def _beside(rails: Indices, line: Indices, along: Indices, n: int) -> tuple[Indices, Bools]:
    """Lines of ghosts beside vertices `along` a side, as the strips there have them; whether all exist."""
    key = rails[:, 0] * n + rails[:, 0].reshape(-1, 2)[:, ::-1].ravel()
    order = np.argsort(key)
    wanted = along * n + along[:, [1, *range(along.shape[1] - 1)]]
    place = order[np.minimum(np.searchsorted(key, wanted, sorter=order), key.size - 1)]
    return line[place], (key[place] == wanted).all(axis=1)


def _strips(mesh: Stencils, degree: int) -> tuple[Indices, Indices, Indices, Indices]:
    """Strips of quads inward from boundary edges, straight through regular vertices.

    Returns
    -------
    rails : (2 k, degree + 1) int64
        The two sides of each strip; its first face runs from the first one to the second.
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
    regular = valence == np.where(mesh.closed, 4, 2)
    regular[faces[faces[:, 3] < 0, :3]] = False
    kept &= faces[f, 3] >= 0
    f, i, j = f[kept], i[kept], j[kept]
    slot = i
    strips = np.empty((f.size, 2, degree + 1), np.int64)
    strips[:, 0, 0], strips[:, 1, 0] = faces[f, i], faces[f, j]
    for k in range(1, degree + 1):
        i, j = (2 * i - j) % 4, (2 * j - i) % 4  # across the quad, where the edge begins and ends
        u, v = faces[f, i], faces[f, j]
        strips[:, 0, k], strips[:, 1, k] = u, v
        if k == degree:
            break
        around = corners[np.minimum(indptr[u, None] + np.arange(4), indptr[u + 1, None] - 1)] // 4
        beyond = (faces[around] == v[:, None, None]).any(axis=2) & (around != f[:, None])
        kept = regular[u] & regular[v] & beyond.any(axis=1)
        strips, slot, u, v = strips[kept], slot[kept], u[kept], v[kept]
        f = around[kept, beyond[kept].argmax(axis=1)]
        i, j = (faces[f] == u[:, None]).argmax(axis=1), (faces[f] == v[:, None]).argmax(axis=1)
    return strips.reshape(-1, degree + 1), slot, valence, n_edges
