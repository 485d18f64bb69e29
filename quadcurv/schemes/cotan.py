"""The cotan formula by libigl, on triangulations that give every vertex valence 4, 6 or 8."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy
from numpy.typing import NDArray

from quadcurv.schemes.base import Laplacian
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Ints

VALENCES = (4, 6, 8)
AREAS = ("barycentric", "voronoi")


def cotan(valence: int = 6, area: str = "barycentric", diagonal: int = 0) -> Laplacian:
    """Cotan formula (Meyer et al. 2003, eq. 8; thesis, eq. 4.3) on quads cut into triangles.

    Parameters
    ----------
    valence : {4, 6, 8}
        How the four quads around a regular vertex are cut: across it (4), through it (8), or each quad
        along one fixed diagonal (6). With 4 and 8 no one triangulation serves neighbouring vertices, so
        every vertex is computed on its own cut and the stiffness matrix is not symmetric.
    area : {"barycentric", "voronoi"}
        Dual area: a third of each triangle, or libigl's mixed Voronoi area.
    diagonal : {0, 1}
        For valence 6, from the first to the third vertex of each face or from the second to the fourth.

    Returns
    -------
    Laplacian

    Raises
    ------
    ValueError
        Any other valence, area or diagonal.

    Notes
    -----
    With valence 6 the result depends on the vertex that each face begins with: turn a face over as
    ``face[[0, 3, 2, 1]]`` to keep its diagonal.

    Examples
    --------
    >>> from quadcurv import schemes
    >>> schemes.cotan(6, "voronoi").name
    'cotan-6-voronoi'
    """
    for name, value, allowed in (
        ("valence", valence, VALENCES),
        ("area", area, AREAS),
        ("diagonal", diagonal, (0, 1)),
    ):
        if value not in allowed:
            raise ValueError(f"{name}: expected one of {allowed}, got {value!r}")
    if diagonal and valence != 6:
        raise ValueError(f"diagonal: only valence 6 has a choice of diagonals, got valence {valence}")

    def assemble(stencils: Stencils) -> tuple[scipy.sparse.csr_array, Floats]:
        p, n = len(stencils.points), stencils.n
        stiffness, areas = scipy.sparse.csr_array((n, p)), np.zeros(n)
        for triangles, served in _triangulations(stencils, valence, diagonal):
            S, A = cotan_matrices(stencils.points, triangles, area)
            if served.all():
                return S[:n], A[:n]
            rows = np.flatnonzero(served)
            place = scipy.sparse.csr_array((np.ones(rows.size), (rows, np.arange(rows.size))), (n, rows.size))
            stiffness = stiffness + place @ S[rows]
            areas[served] = A[:n][served]
        return stiffness, areas

    def flux(stencils: Stencils) -> tuple[Floats, Floats]:
        n = stencils.n
        into, areas = np.zeros((n, 3)), np.zeros(n)
        # Relative to one of the points: rows sum to zero, but only up to the rounding of their weights.
        x = stencils.points - stencils.points[0]
        for triangles, served in _triangulations(stencils, valence, diagonal):
            S, A = cotan_matrices(stencils.points, triangles, area)
            into[served] = -(S @ x)[:n][served]
            areas[served] = A[:n][served]
        return into, areas

    name = f"cotan-{valence}" + ("'" if diagonal else "") + ("-voronoi" if area == "voronoi" else "")
    reference = "Meyer et al. 2003, eq. 8 (thesis, eq. 4.3), by libigl"
    return Laplacian(name, 2 if valence == 6 else 0, reference, assemble, flux, symmetric=valence == 6)


def cotan_matrices(points: Floats, triangles: Ints, area: str) -> tuple[scipy.sparse.csr_array, Floats]:
    """Positive semi-definite (p, p) cotan stiffness and (p,) dual areas, from libigl."""
    import igl

    kind = igl.MASSMATRIX_TYPE_VORONOI if area == "voronoi" else igl.MASSMATRIX_TYPE_BARYCENTRIC
    faces = np.ascontiguousarray(triangles, dtype=np.int64)
    stiffness = scipy.sparse.csr_array(-igl.cotmatrix(points, faces))
    areas = igl.massmatrix(points, faces, kind).diagonal()
    return stiffness, np.pad(areas, (0, len(points) - areas.size))  # libigl ends at the last vertex used


def _triangulations(
    stencils: Stencils, valence: int, diagonal: int
) -> Iterator[tuple[NDArray[np.int32], Bools]]:
    """Triangles, and which of the n vertices they are the right ones for; together these are all."""
    faces = stencils.faces
    if valence == 6:
        yield _cut(faces, np.full(len(faces), bool(diagonal))), np.ones(stencils.n, bool)
        return
    colours = _colours(stencils)
    for k in range(colours.max() + 1):
        corner = (colours == k)[faces] & (faces >= 0)
        along_second = corner[:, [0, 2]].any(axis=1)  # the diagonal that passes across slots 0 and 2
        if valence == 8:
            along_second = corner[:, [1, 3]].any(axis=1)
        yield (
            _cut(faces[corner.any(axis=1)], along_second[corner.any(axis=1)]),
            colours[: stencils.n] == k,
        )


def _cut(faces: Ints, along_second: Bools) -> Ints:
    """Triangles of the quads cut along their first or second diagonal, and of the triangles as they are."""
    quad = faces[:, 3] >= 0
    first = faces[quad & ~along_second]
    second = faces[quad & along_second]
    return np.concatenate(
        (
            faces[~quad, :3],
            first[:, [0, 1, 2]],
            first[:, [2, 3, 0]],
            second[:, [1, 2, 3]],
            second[:, [3, 0, 1]],
        )
    )


def _colours(stencils: Stencils) -> NDArray[np.int64]:
    """Colour the n vertices so that no quad's edge joins two alike; -1 for ghosts and dual points.

    Vertices of one colour can all have their quads cut at once: two passes on most quad meshes.
    """
    from quadcurv.kernels import topology

    p = len(stencils.points)
    indptr, corners = topology.corners_by_vertex(stencils.faces, p)
    return topology.colour(stencils.faces, indptr, corners, stencils.n)
