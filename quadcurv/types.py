"""Names that every floor uses: array types, what is wrong with a mesh, what a mesh warns of."""

from __future__ import annotations

import os
import sys
import warnings

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Indices = NDArray[np.int64]
Bools = NDArray[np.bool_]


class MeshError(ValueError):
    """What is wrong with a mesh: which argument, where first (face or vertex), and how often.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.as_mesh(([[0, 0, 0], [1, 0, 0], [1, 1, 0]], [[0, 1, 7]]))  # doctest: +IGNORE_EXCEPTION_DETAIL
    Traceback (most recent call last):
        ...
    quadcurv.types.MeshError: faces: indices out of range
    """


class MeshWarning(UserWarning):
    """What was mended in a mesh, or which part of it has no answer: what, where first, how often.

    Examples
    --------
    >>> import warnings
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> with warnings.catch_warnings(record=True) as said:
    ...     warnings.simplefilter("always")
    ...     mesh = qc.as_mesh((ball.points, [*ball.faces, ball.faces[7]]))
    >>> print(said[0].message)
    1 face(s) given twice, taken once, first face 96
    """


class PrecisionWarning(MeshWarning):
    """Positions are rounded so coarsely that it shows in the curvature.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np, quadcurv as qc
    >>> ball, _, _ = qc.surfaces.sphere().sample((300, 300))
    >>> far = (ball.points + 100).astype(np.float32)
    >>> with warnings.catch_warnings(record=True) as said:
    ...     warnings.simplefilter("always")
    ...     H = qc.mean_curvature(qc.QuadGrid(far, ball.wrap), "liu")
    >>> said[0].category.__name__
    'PrecisionWarning'
    """


class ConsistencyWarning(MeshWarning):
    """Faces are so skew that a scheme is far off the mean curvature there, whatever the surface.

    Told where H may be off by more than three times the larger principal curvature for this alone, six times
    of schemes that converge on no skew mesh (valence 4 and 8); where rounding makes as much, in 1 / extent;
    and where faces fold over each other.

    Examples
    --------
    >>> import warnings
    >>> import numpy as np, quadcurv as qc
    >>> x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij")
    >>> skew = qc.QuadGrid(np.stack((x + 20 * y, y, x * x), axis=-1))
    >>> with warnings.catch_warnings(record=True) as said:
    ...     warnings.simplefilter("always")
    ...     H = qc.mean_curvature(skew, "cotan-4")
    >>> said[0].category.__name__
    'ConsistencyWarning'
    """


def warn(message: str, kind: type[UserWarning] = MeshWarning) -> None:
    """A warning that names the line of the user's that led here."""
    package, level, frame = os.path.dirname(__file__), 1, sys._getframe(0)
    while frame.f_back is not None and frame.f_code.co_filename.startswith(package):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, kind, stacklevel=level)
