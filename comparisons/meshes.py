"""The mesh that speeds are measured on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def torus(n: int) -> NDArray[np.float64]:
    """(n, n, 3) points that wrap in both directions; the normal points outward."""
    u, v = np.meshgrid(*[2 * np.pi * np.arange(n) / n] * 2, indexing="ij")
    r = 3 + np.cos(u) + 0.2 * np.sin(3 * v)
    return np.stack([r * np.cos(v), r * np.sin(v), np.sin(u)], axis=-1)


def triangles(faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """Each quad cut along its first diagonal."""
    return np.ascontiguousarray(np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]])))
