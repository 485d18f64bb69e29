"""Laplacians of polygons: of virtual triangles (Bunge et al.), and by discrete exterior calculus."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from quadcurv.schemes.base import Laplacian
from quadcurv.schemes.diamond import scatter
from quadcurv.stencils import Stencils
from quadcurv.types import Floats

# Corners (m, k, 3) of polygons of k sides -> their stiffness (m, k, k) and parts of the dual areas (m, k).
Local = Callable[[Floats], tuple[Floats, Floats]]


def bunge() -> Laplacian:
    """Cotan formula on fans about a virtual vertex in each face.

    The virtual vertex minimises the sum of the squared areas of its triangles and is the affine
    combination of the corners with the smallest weights, so that the matrix has none but the mesh's own
    vertices. On a triangle this is the cotan formula. The weights say how a quad differs from a planar one:
    on nearly planar quads they are sensitive to rounding. The dual area is the mixed Voronoi area of the
    fans, as in libigl.

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

    def local(x: Floats) -> tuple[Floats, Floats]:
        m, k, _ = x.shape
        arm = x - x.mean(axis=1, keepdims=True)
        next_arm = np.roll(arm, -1, axis=1)
        edge = next_arm - arm
        # Triangles arm x next - virtual x edge: the sum of their squares is least where its gradient is 0.
        cross = (
            np.einsum("mkx,mkx->m", edge, edge)[:, None, None] * np.eye(3) - np.swapaxes(edge, 1, 2) @ edge
        )
        torque = np.cross(edge, np.cross(arm, next_arm)).sum(axis=1)
        virtual = np.linalg.pinv(cross, hermitian=True) @ torque[:, :, None]
        weights = 1 / k + (np.swapaxes(np.linalg.pinv(arm, rcond=1e-9), 1, 2) @ virtual)[:, :, 0]

        fan = np.stack((arm, next_arm, np.broadcast_to(np.swapaxes(virtual, 1, 2), arm.shape)), axis=2)
        across = np.roll(fan, 1, axis=2) - np.roll(fan, -1, axis=2)  # (m, k, 3, 3): edge across from a corner
        double = np.linalg.norm(np.cross(across[:, :, 0], across[:, :, 1]), axis=-1)
        cotan = across @ np.swapaxes(across, 2, 3) / (2 * double[:, :, None, None])
        # From the fan's corners, triangle by triangle, to those of the polygon.
        own = np.eye(k)
        spread = np.empty((m, k, 3, k))
        spread[:, :, 0], spread[:, :, 1] = own, np.roll(own, 1, axis=1)
        spread[:, :, 2] = weights[:, None]
        stiffness = np.einsum("mtia,mtij,mtjb->mab", spread, cotan, spread, optimize=True)
        return stiffness, np.einsum("mti,mtia->ma", _voronoi(across, double), spread)

    return _scheme("bunge", "Bunge, Herholz, Kazhdan and Botsch 2020", local)


def de_goes(stabilisation: float = 1.0) -> Laplacian:
    """Laplacian of de Goes, Butts and Desbrun (2020): gradients and 1-forms of polygons.

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

    def local(x: Floats) -> tuple[Floats, Floats]:
        edge, middle, normal, area = _polygon(x)
        flat = edge - np.einsum("mkx,mx,my->mky", edge, normal, normal)
        arm = middle - x.mean(axis=1, keepdims=True)
        sharp = np.cross(normal[:, None], arm) / area[:, None, None]  # (m, k, 3), transposed
        rest = np.eye(x.shape[1]) - flat @ np.swapaxes(sharp, 1, 2)
        inner = area[:, None, None] * sharp @ np.swapaxes(sharp, 1, 2)
        return _laplacian(inner + stabilisation * np.swapaxes(rest, 1, 2) @ rest, area)

    return _scheme("de_goes", "de Goes, Butts and Desbrun 2020", local)


def alexa_wardetzky(stabilisation: float = 1.0) -> Laplacian:
    """Laplacian of Alexa and Wardetzky (2011): that of the largest projection of a polygon.

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

    def local(x: Floats) -> tuple[Floats, Floats]:
        edge, middle, normal, area = _polygon(x)
        flat = edge - np.einsum("mkx,mx,my->mky", edge, normal, normal)
        middle = middle - x.mean(axis=1, keepdims=True)
        metric = np.swapaxes(flat, 1, 2) @ flat + np.einsum("m,mx,my->mxy", area, normal, normal)
        # Diagonals in parallel but for rounding: the quad has no plane.
        metric[~(area > 1e-14 * np.einsum("mkx,mkx->m", edge, edge))] = np.nan
        span = flat @ np.linalg.inv(metric) @ np.swapaxes(flat, 1, 2)  # onto what the projected edges span
        rest = np.eye(x.shape[1]) - span
        inner = middle @ np.swapaxes(middle, 1, 2) / area[:, None, None]
        return _laplacian(inner + stabilisation * rest, area)

    return _scheme("alexa_wardetzky", "Alexa and Wardetzky 2011", local)


def _checked(stabilisation: float) -> None:
    if not (isinstance(stabilisation, int | float) and 0 <= stabilisation < np.inf):
        raise ValueError(f"stabilisation: expected a number, not negative, got {stabilisation!r}")


def _scheme(name: str, reference: str, local: Local) -> Laplacian:
    def assemble(stencils: Stencils) -> tuple[scipy.sparse.csr_array, Floats]:
        p = len(stencils.points)
        stiffness, areas = scipy.sparse.csr_array((p, p)), np.zeros(p)
        triangle = stencils.faces[:, 3] < 0
        for faces in (stencils.faces[triangle, :3], stencils.faces[~triangle]):
            # Relative to a corner, so that an offset of the whole mesh costs no digits.
            x = stencils.points[faces] - stencils.points[faces[:, :1]]
            with np.errstate(all="ignore"):  # a face without area: NaN at its corners
                matrices, parts = local(x)
            stiffness = stiffness + scatter(matrices, faces, faces, (p, p))
            np.add.at(areas, faces, parts)
        return stiffness[: stencils.n], areas[: stencils.n]

    return Laplacian(name, 2, reference, assemble)


def _voronoi(across: Floats, double: Floats) -> Floats:
    """Mixed Voronoi areas (..., 3) of triangles (Meyer et al. 2003) with edges `across` from each corner."""
    before, after = np.roll(across, 1, axis=-2), np.roll(across, -1, axis=-2)
    cosine = -np.einsum("...x,...x->...", before, after)  # at the corner, times both lengths
    square = np.einsum("...x,...x->...", across, across)
    share = cosine * square / double[..., None]
    # Half of each neighbouring edge's share; of an obtuse triangle, half for that corner.
    acute = (share.sum(axis=-1, keepdims=True) - share) / 8
    area = double[..., None] / 2
    obtuse = np.where(cosine < 0, area / 2, area / 4)
    return np.where((cosine < 0).any(axis=-1, keepdims=True), obtuse, acute)


def _polygon(x: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Edges and their middles (m, k, 3), unit normals (m, 3) and areas (m,), those of the vector area."""
    following = np.roll(x, -1, axis=1)
    arm = x - x.mean(axis=1, keepdims=True)
    vector = np.cross(arm, np.roll(arm, -1, axis=1)).sum(axis=1) / 2
    area = np.linalg.norm(vector, axis=1)
    return following - x, (following + x) / 2, vector / area[:, None], area


def _laplacian(inner: Floats, area: Floats) -> tuple[Floats, Floats]:
    """d^T M d with d the difference along each edge; equal parts of the area."""
    half = np.roll(inner, 1, axis=2) - inner
    k = inner.shape[1]
    return np.roll(half, 1, axis=1) - half, np.repeat(area[:, None] / k, k, axis=1)
