"""What the finite-volume scheme and Liu's formula share: their stiffness, S = sum over quads of B^T K B."""

from __future__ import annotations

import numpy as np
import scipy

from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Ints

# Of one vertex of a face list and of one row of a matrix, in vertices of a grid.
_RING_WORK, _ROW_WORK = 4, 8

# Diagonals (u, v) of a quad from its four vertices.
_B = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])


def local_stiffness(points: Floats, quads: Ints) -> Floats:
    """(m, 4, 4) stiffness of each quad, not finite for one without area."""
    from quadcurv.kernels import faces

    with np.errstate(invalid="ignore"):
        return np.einsum("ai,mab,bj->mij", _B, faces.conductances(points, quads), _B, optimize=True)


def scatter(local: Floats, rows: Ints, columns: Ints, shape: tuple[int, int]) -> scipy.sparse.csr_array:
    """Sum local matrices (m, i, j) with vertices rows (m, i) and columns (m, j) into one."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return scipy.sparse.csr_array((local.ravel(), (i.ravel(), j.ravel())), shape=shape)


def quad_stiffness(stencils: Stencils) -> scipy.sparse.csr_array:
    """(p, p) stiffness of all quads, triangles left out."""
    p = len(stencils.points)
    quads = stencils.faces[stencils.faces[:, 3] >= 0]
    return scatter(local_stiffness(stencils.points, quads), quads, quads, (p, p))
