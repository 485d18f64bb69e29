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
    "interval_mean_curvature",
    "interval_gaussian_curvature",
    "interval_k1",
    "interval_k2",
    "estimate",
    "feature",
    "boundary",
    "valence",
    "nonplanarity",
    "skew",
    "aspect",
    "roughness",
]
VALUES: tuple[Value, ...] = get_args(Value)


def values_of(scheme: str, wanted: Iterable[Value] | None) -> list[Value]:
    """The values wanted, by default all that the scheme has, in the order of VALUES.

    Intervals and creases are known to "jet" alone, which Laplacians take for all but H;
    the error of "jet", by which errors are estimated, has no estimate.

    Raises
    ------
    ValueError
        The scheme does not have one.
    """
    chosen = as_scheme(scheme)
    without: set[str] = set()
    if isinstance(chosen, Fit) and chosen.name != jet().name:
        without = {name for name in VALUES if name.startswith("interval_")} | {"feature"}
    if chosen.name == jet().name:
        without |= {"estimate"}
    wanted = set(VALUES) - without if wanted is None else set(wanted)
    for name in VALUES:
        if name in wanted & without:
            raise ValueError(f"--value: {scheme} has no {name}")
    return [name for name in VALUES if name in wanted]


def values(mesh: Mesh, scheme: str, boundary: str, wanted: Iterable[Value]) -> dict[str, NDArray[Any]]:
    """Values by name, those of :func:`values_of`.

    All but the mean curvature of a Laplacian, which knows no other, come from a fit: the scheme, or "jet".
    """
    chosen = as_scheme(scheme)
    fit = curvatures(mesh, chosen if isinstance(chosen, Fit) else jet(), boundary)
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
        "boundary": boundary_treatment(mesh, boundary),
        **quality(mesh),
    }
    for prefix, errors in (("error", fit.standard_error), ("interval", fit.interval)):
        if errors is not None:
            found |= {
                f"{prefix}_mean_curvature": errors.mean,
                f"{prefix}_gaussian_curvature": errors.gaussian,
                f"{prefix}_k1": errors.k1,
                f"{prefix}_k2": errors.k2,
            }
    if fit.feature is not None:
        found["feature"] = fit.feature.astype(np.int32)
    wanted = list(wanted)
    if "estimate" in wanted:
        reference = mean_curvature(mesh, jet(), boundary) if isinstance(chosen, Fit) else fit.mean
        found["estimate"] = found["mean_curvature"] - reference
    return {name: np.asarray(found[name]) for name in wanted}
