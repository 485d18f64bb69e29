"""What the finite-volume scheme and Liu's formula share: their stiffness, S = sum over quads of B^T K B."""

from __future__ import annotations

import numpy as np

from quadcurv.schemes.triangles import cross, dot, length, squared_distance
from quadcurv.types import Floats

# Diagonals of a quad from its corners; their squares and product in the stiffness.
_B = np.array([(-1.0, 0.0, 1.0, 0.0), (0.0, -1.0, 0.0, 1.0)])
_FORMS = np.einsum("ai,bj->abij", _B, _B)


def diamond(x: Floats, coarse: float, far: Floats | None = None) -> tuple[Floats, Floats]:
    """Stiffness (m, 4, 4) of quads (m, 4, 3), and a quarter of the area of each at its corners (m, 4).

    `far` is their squared distance from the origin, where `x` is relative to some other point.
    """
    far = squared_distance(x) if far is None else far
    u, v = (x[:, 2] - x[:, 0]).T, (x[:, 3] - x[:, 1]).T
    uu, uv, vv = dot(u, u), dot(u, v), dot(v, v)
    double = length(cross(u, v), uu + vv, far, coarse)
    K = np.array([(vv, -uv), (-uv, uu)]) / (2 * double)
    return np.tensordot(K, _FORMS, ((0, 1), (0, 1))), np.repeat(double[:, None] / 8, 4, axis=1)
