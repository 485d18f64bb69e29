"""Names that every floor uses: array types, what is wrong with a mesh, what a mesh warns of."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Indices = NDArray[np.int64]
Bools = NDArray[np.bool_]


class MeshError(ValueError):
    """What is wrong with a mesh: which argument, where first (face or vertex), and how often."""


class MeshWarning(UserWarning):
    """What was mended in a mesh, or which part of it has no answer: what, where first, how often."""


class PrecisionWarning(MeshWarning):
    """Positions are rounded so coarsely that it shows in the curvature."""
