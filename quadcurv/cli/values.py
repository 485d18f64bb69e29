"""What `quadcurv curvature` writes at every vertex."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from quadcurv.boundary import boundary_treatment
from quadcurv.curvature import curvatures, mean_curvature
from quadcurv.mesh import Mesh
from quadcurv.mesh_quality import quality
from quadcurv.schemes import Fit, as_scheme, jet

Value = Literal[
    "mean_curvature",
    "gaussian_curvature",
    "k1",
    "k2",
    "direction1",
    "direction2",
    "normal",
    "shape_index",
    "curvedness",
    "error_mean_curvature",
    "error_gaussian_curvature",
    "error_k1",
    "error_k2",
    "boundary",
    "valence",
    "nonplanarity",
    "skew",
    "aspect",
    "roughness",
]
VALUES: tuple[Value, ...] = get_args(Value)


def values(mesh: Mesh, scheme: str, boundary: str, wanted: Iterable[str] = VALUES) -> dict[str, NDArray[Any]]:
    """Values by name, in the order of VALUES.

    All but the mean curvature of a Laplacian, which knows no other, come from a fit: the scheme, or "jet".
    """
    chosen = as_scheme(scheme)
    fit = curvatures(mesh, chosen if isinstance(chosen, Fit) else jet(), boundary)
    errors = fit.standard_error
    assert errors is not None
    found: dict[str, NDArray[Any]] = {
        "mean_curvature": fit.mean if isinstance(chosen, Fit) else mean_curvature(mesh, chosen, boundary),
        "gaussian_curvature": fit.gaussian,
        "k1": fit.k1,
        "k2": fit.k2,
        "direction1": fit.direction1,
        "direction2": fit.direction2,
        "normal": fit.normal,
        "shape_index": fit.shape_index,
        "curvedness": fit.curvedness,
        "error_mean_curvature": errors.mean,
        "error_gaussian_curvature": errors.gaussian,
        "error_k1": errors.k1,
        "error_k2": errors.k2,
        "boundary": boundary_treatment(mesh, boundary),
        **quality(mesh),
    }
    kept = set(wanted)
    return {name: np.asarray(found[name]) for name in VALUES if name in kept}
