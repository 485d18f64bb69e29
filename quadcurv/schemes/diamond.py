"""The stiffness that the finite-volume scheme and Liu's formula share: S = sum over quads of B^T K B."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from quadcurv.mesh import Floats, Ints, Stencils

# Diagonals (u, v) of a quad from its four vertices.
_B = np.array([[-1.0, 0.0, 1.0, 0.0], [0.0, -1.0, 0.0, 1.0]])


def local_stiffness(points: Floats, quads: Ints) -> Floats:
    """(m, 4, 4) stiffness of each quad."""
    from quadcurv.kernels import diamond

    return np.einsum("ai,mab,bj->mij", _B, diamond.conductances(points, quads), _B, optimize=True)


def scatter(local: Floats, rows: Ints, columns: Ints, shape: tuple[int, int]) -> sparse.csr_array:
    """Sum local matrices (m, i, j) with vertices rows (m, i) and columns (m, j) into one."""
    i, j = np.broadcast_arrays(rows[:, :, None], columns[:, None, :])
    return sparse.csr_array((local.ravel(), (i.ravel(), j.ravel())), shape=shape)


def quad_stiffness(stencils: Stencils) -> sparse.csr_array:
    """(p, p) stiffness of all quads, triangles left out."""
    p = len(stencils.points)
    quads = stencils.faces[stencils.faces[:, 3] >= 0]
    return scatter(local_stiffness(stencils.points, quads), quads, quads, (p, p))
