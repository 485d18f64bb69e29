"""Laplacians of polygons: of virtual triangles (Bunge et al.), and by discrete exterior calculus.

Faces of more than four sides are kept as they are, up to ``assembly.MOST_SIDES`` of these.
"""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.assembly import Local, flux_from_faces, from_faces
from quadcurv.schemes.base import Laplacian
from quadcurv.schemes.triangles import (
    cross,
    cut_up,
    dot,
    half_cotans,
    length,
    linear,
    squared_distance,
    voronoi,
)
from quadcurv.types import Floats

_PLANAR = 1e-9  # heights of corners over their distances, of a polygon that is taken to be planar


def bunge() -> Laplacian:
    """Cotan formula on fans about a virtual vertex in each face.

    The virtual vertex minimises the sum of the squared areas of its triangles and is the affine
    combination of the corners with the smallest weights, so that the matrix has none but the mesh's own
    vertices. On a triangle this is the cotan formula. The weights say how a quad differs from a planar one:
    on nearly planar quads they are sensitive to rounding. The dual area is the mixed Voronoi area of the
    fans, as in libigl. Polygons of more than four sides are kept, those of more than 128 cut into triangles,
    as are faces so far from convex that a triangle of the fan turns over.

    Returns
    -------
    Laplacian

    References
    ----------
    A. Bunge, P. Herholz, M. Kazhdan, M. Botsch (2020), Polygon Laplacian made simple, Computer Graphics
    Forum 39, 303-313.

    Examples
    --------
    >>> from quadcurv import schemes
    >>> schemes.bunge().name
    'bunge'
    """

    def local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
        arm, _ = _in_plane(x, coarse)
        _, k, m = arm.shape
        if k == 3:
            virtual, weights = np.zeros((3, m)), np.full((3, m), 1 / 3)
        else:
            virtual = _virtual_vertex(arm)
            weights = 1 / k + _least_weights(arm, virtual)
        fan = arm, np.roll(arm, -1, axis=1), np.broadcast_to(virtual[:, None], arm.shape)
        halves, double = half_cotans(fan, squared_distance(x), coarse)
        own, following, middle = voronoi(halves, double)
        parts = own + np.roll(following, 1, axis=0) + weights * middle.sum(axis=0)
        if k == 3:
            return linear(x, coarse)[0], parts.T
        # Weights of the edges to the virtual vertex, those of the sides, and the virtual vertex left out.
        spoke, side = halves[1] + np.roll(halves[0], 1, axis=0), halves[2]
        mixed = (spoke.sum(axis=0) / 2 * weights - spoke) * weights[:, None]
        matrices = mixed + mixed.swapaxes(0, 1)
        i, j = np.arange(k), (np.arange(k) + 1) % k
        matrices[i, i] += spoke + side + np.roll(side, 1, axis=0)
        matrices[i, j] -= side
        matrices[j, i] -= side
        matrices, parts = matrices.T, parts.T
        # Where the virtual vertex does not see all sides from within, triangles would overlap.
        spokes = arm - virtual[:, None]
        over = np.flatnonzero((cross(spokes, np.roll(spokes, -1, axis=1))[2] <= 0).any(axis=0))
        if over.size:
            matrices[over], parts[over] = cut_up(x[over], coarse, voronoi)
        return matrices, parts

    return _scheme("bunge", "Bunge, Herholz, Kazhdan and Botsch 2020", local)


def de_goes(stabilisation: float = 1.0) -> Laplacian:
    """Laplacian of de Goes, Butts and Desbrun (2020): gradients and 1-forms of polygons.

    Polygons of more than four sides are kept, those of more than 128 cut into triangles.

    Parameters
    ----------
    stabilisation : float
        Weight lambda >= 0 of 1-forms that no constant vector has.

    Returns
    -------
    Laplacian

    Raises
    ------
    ValueError
        A negative stabilisation.

    References
    ----------
    F. de Goes, A. Butts, M. Desbrun (2020), Discrete differential operators on polygonal meshes, ACM
    Transactions on Graphics 39, 110.

    Examples
    --------
    >>> from quadcurv import schemes
    >>> schemes.de_goes().name
    'de_goes'
    """
    _checked(stabilisation)

    def local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
        if x.shape[1] == 3:
            return linear(x, coarse)
        arm, area = _in_plane(x, coarse)
        edge, middle = _edges(arm)
        sharp = np.stack((-middle[1], middle[0])) / area
        rest = np.eye(x.shape[1])[..., None] - np.einsum("xim,xjm->ijm", edge[:2], sharp)
        inner = np.einsum("xim,xjm->ijm", area * sharp, sharp)
        return _laplacian(inner + stabilisation * np.einsum("jim,jkm->ikm", rest, rest), area)

    return _scheme("de_goes", "de Goes, Butts and Desbrun 2020", local)


def alexa_wardetzky(stabilisation: float = 1.0) -> Laplacian:
    """Laplacian of Alexa and Wardetzky (2011): that of the largest projection of a polygon.

    Polygons of more than four sides are kept, those of more than 128 cut into triangles.

    Parameters
    ----------
    stabilisation : float
        Weight lambda >= 0 of 1-forms that the projected polygon does not see.

    Returns
    -------
    Laplacian

    Raises
    ------
    ValueError
        A negative stabilisation.

    References
    ----------
    M. Alexa, M. Wardetzky (2011), Discrete Laplacians on general polygonal meshes, ACM Transactions on
    Graphics 30, 102.

    Examples
    --------
    >>> from quadcurv import schemes
    >>> schemes.alexa_wardetzky().name
    'alexa_wardetzky'
    """
    _checked(stabilisation)

    def local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
        if x.shape[1] == 3:
            return linear(x, coarse)
        arm, area = _in_plane(x, coarse)
        edge, middle = _edges(arm)
        seen = _orthonormal(edge[:2])  # what the projected edges span
        rest = np.eye(x.shape[1])[..., None] - np.einsum("xim,xjm->ijm", seen, seen)
        inner = np.einsum("xim,xjm->ijm", middle, middle) / area
        return _laplacian(inner + stabilisation * rest, area)

    return _scheme("alexa_wardetzky", "Alexa and Wardetzky 2011", local)


def _checked(stabilisation: float) -> None:
    if not (isinstance(stabilisation, int | float) and 0 <= stabilisation < np.inf):
        raise ValueError(f"stabilisation: expected a number, not negative, got {stabilisation!r}")


def _scheme(name: str, reference: str, local: Local) -> Laplacian:
    assemble, flux = from_faces(local, polygons=True), flux_from_faces(local, polygons=True)
    return Laplacian(name, 2, reference, assemble, flux, polygons=True)


def _in_plane(x: Floats, coarse: float) -> tuple[Floats, Floats]:
    """Corners (3, k, m) of faces (m, k, 3) relative to their mean, and their areas (m,), NaN without one.

    The area is that of the largest projection, across the vector area. The last coordinate is that along the
    vector area, the first along the longest edge across it: thin polygons keep the digits of their width.
    """
    arm = (x - x[:, :1]).T.copy()
    arm -= arm.mean(axis=1, keepdims=True)
    edge, _ = _edges(arm)
    vector = cross(arm, edge).sum(axis=1)
    double = length(vector, dot(edge, edge).sum(axis=0), squared_distance(x), coarse)
    normal = vector / double
    flat = edge - normal[:, None] * dot(edge, normal[:, None])
    square = dot(flat, flat)
    longest = square.argmax(axis=0)[None]
    along = np.take_along_axis(flat, longest[None], axis=1)[:, 0]
    along /= np.sqrt(np.take_along_axis(square, longest, axis=0)[0])
    axes = np.stack((along, cross(normal, along), normal))
    return np.einsum("xym,yim->xim", axes, arm), double / 2


def _edges(arm: Floats) -> tuple[Floats, Floats]:
    """Edges and their middles (3, k, m)."""
    after = np.roll(arm, -1, axis=1)
    return after - arm, (after + arm) / 2


def _virtual_vertex(arm: Floats) -> Floats:
    """Point p (3, m) with the least sum of squared areas arm x next arm - p x edge of its triangles."""
    edge, _ = _edges(arm)
    # The gradient is 0 where (|edge|^2 - edge edge^T) p = edge x (arm x edge), summed.
    system = -np.einsum("xim,yim->xym", edge, edge)
    square = -np.einsum("xxm->xm", system)
    system[range(3), range(3)] = square[[1, 2, 0]] + square[[2, 0, 1]]
    torque = cross(edge, cross(arm, edge)).sum(axis=1)
    scale = 1 / np.sqrt(np.einsum("xxm->xm", system))  # rows of a thin polygon differ by its aspect's square
    system = system * scale * scale[:, None]
    minors = np.stack([cross(system[i - 2], system[i - 1]) for i in range(3)])
    return scale * dot(minors, (scale * torque)[:, None]) / dot(system[0], minors[0])


def _least_weights(arm: Floats, virtual: Floats) -> Floats:
    """Smallest numbers (k, m) of sum 0 by which the corners add up to the virtual vertex (3, m)."""
    weights = np.zeros(arm.shape[1:])
    size = np.sqrt(dot(arm, arm).sum(axis=0))
    for column, unit, wanted, least in zip(arm, _orthonormal(arm), virtual, (0, 0, _PLANAR), strict=True):
        share = dot(column, unit)
        more = (wanted - dot(column, weights)) / share * unit
        weights += np.where(share > least * size, more, 0.0)
    return weights


def _orthonormal(columns: Floats) -> Floats:
    """Gram and Schmidt's orthonormal vectors (c, k, m) from columns, NaN where nothing is left of one."""
    basis = np.empty_like(columns)
    for i, column in enumerate(columns):
        for unit in (*basis[:i], *basis[:i]):  # twice is enough
            column = column - dot(column, unit) * unit
        basis[i] = column / np.sqrt(dot(column, column))
    return basis


def _laplacian(inner: Floats, area: Floats) -> tuple[Floats, Floats]:
    """d^T M d with d the difference along each edge; equal parts of the area."""
    half = np.roll(inner, 1, axis=1) - inner
    k = len(inner)
    return (np.roll(half, 1, axis=0) - half).T, np.repeat(area[:, None] / k, k, axis=1)
