"""The cotan formula by libigl, on triangulations that give every vertex valence 4, 6 or 8."""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.assembly import flux_from_faces, from_faces
from quadcurv.schemes.base import Laplacian
from quadcurv.schemes.triangles import EDGES, half_cotans, squared_distance, voronoi
from quadcurv.types import Floats

VALENCES = (4, 6, 8)
AREAS = ("barycentric", "voronoi")
_THIN = 1e-2  # twice the area over the sum of the squared edges


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
    ``face[[0, 3, 2, 1]]`` to keep its diagonal. Polygons of more than four sides are cut into triangles,
    the same for every valence.

    libigl computes from the lengths of edges, which loses twice the digits that a thin triangle's height
    does: cotans of triangles whose area is less than a hundredth of their squared edges are computed from
    coordinates instead.

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
    # Cuts by the corner of the quad that they cut off, and those of its corners whose rows they give.
    corners, given = {
        4: (range(4), [1]),
        6: ((0, 2) if diagonal else (1, 3), [0, 1, 2]),
        8: (range(4), [0, 2]),
    }[valence]

    def local(x: Floats, coarse: float) -> tuple[Floats, Floats]:
        if x.shape[1] == 3:
            return _by_libigl(x, coarse, area)
        matrices, parts = np.zeros((len(x), 4, 4)), np.zeros((len(x), 4))
        for s in corners:
            triangle = np.array([s - 1, s, s + 1]) % 4
            K, third = _by_libigl(x[:, triangle], coarse, area)
            matrices[:, triangle[given, None], triangle] += K[:, given]
            parts[:, triangle[given]] += third[:, given]
        return matrices, parts

    name = f"cotan-{valence}" + ("'" if diagonal else "") + ("-voronoi" if area == "voronoi" else "")
    reference = "Meyer et al. 2003, eq. 8 (thesis, eq. 4.3), by libigl"
    return Laplacian(
        name,
        2 if valence == 6 else 0,
        reference,
        from_faces(local),
        flux_from_faces(local),
        symmetric=valence == 6,
    )


def _by_libigl(x: Floats, coarse: float, area: str) -> tuple[Floats, Floats]:
    """Stiffness (m, 3, 3) and dual areas (m, 3) of triangles (m, 3, 3), no two of which share a vertex."""
    import igl

    # Relative to a corner, so that an offset of the whole mesh costs no digits.
    points = np.ascontiguousarray(x - x[:, :1]).reshape(-1, 3)
    triangles = np.arange(len(points)).reshape(-1, 3)
    kind = igl.MASSMATRIX_TYPE_VORONOI if area == "voronoi" else igl.MASSMATRIX_TYPE_BARYCENTRIC
    weights = igl.cotmatrix_entries(points, triangles)  # halves of cotans, by the edge across from a corner
    parts = igl.massmatrix(points, triangles, kind).diagonal().reshape(-1, 3)
    # The sum of the squared edges is twice that of the cotans times twice the area.
    thin = np.flatnonzero(~(4 * weights.sum(axis=1) < 1 / _THIN))
    if thin.size:
        own, double = half_cotans(x[thin].transpose(1, 2, 0), squared_distance(x[thin]), coarse)
        weights[thin] = own.T
        parts[thin] = voronoi(own, double).T if area == "voronoi" else double[:, None] / 6
    return np.tensordot(weights, EDGES, 1), parts
