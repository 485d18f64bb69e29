"""What can be asked for by name: of schemes with a matrix, and of fits."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from quadcurv.drivers.direct import PER_VERTEX
from quadcurv.schemes import Curvatures, Fit, Scheme, StandardErrors
from quadcurv.types import Floats

FITTED: dict[str, tuple[tuple[int, ...], Callable[[Curvatures], Any]]] = {
    "mean_curvature": ((), lambda found: found.mean),
    "mean_curvature_normal": ((3,), lambda found: -found.mean[..., None] * found.normal),
    "gaussian_curvature": ((), lambda found: found.gaussian),
    "k1": ((), lambda found: found.k1),
    "k2": ((), lambda found: found.k2),
    "direction1": ((3,), lambda found: found.direction1),
    "direction2": ((3,), lambda found: found.direction2),
    "normal": ((3,), lambda found: found.normal),
    "standard_error": ((4,), lambda found: _stacked(found.standard_error, found.mean)),
    "interval": ((4,), lambda found: _stacked(found.interval, found.mean)),
    "noise": ((), lambda found: np.full(found.mean.shape, np.nan) if found.noise is None else found.noise),
    "degree": ((), lambda found: found.degree),
    "rings": ((), lambda found: found.rings),
    "feature": ((), lambda found: np.zeros(found.mean.shape) if found.feature is None else found.feature),
}
"""What a fit gives by name, and the shape of one vertex's answer."""


_TELLING = ("mean_curvature", "mean_curvature_normal", "k1")


def telling(names: Iterable[str]) -> str | None:
    """The result by which what rounding costs is told, the first of its kind, if there is one."""
    given = set(names)
    return next((name for name in _TELLING if name in given), None)


def shapes(scheme: Scheme, wanted: Iterable[str], argument: str = "wanted") -> dict[str, tuple[int, ...]]:
    """Shapes of one vertex's answers by name, each once; ValueError where a scheme gives none."""
    known = {name: shape for name, (shape, _) in FITTED.items()} if isinstance(scheme, Fit) else PER_VERTEX
    names = list(dict.fromkeys(wanted))
    for name in names:
        if name not in known:
            raise ValueError(
                f"{argument}: expected some of {', '.join(known)}, as {scheme.name} gives, got {name!r}"
            )
    return {name: known[name] for name in names}


def _stacked(errors: StandardErrors | None, like: Floats) -> Floats:
    return np.full((*like.shape, 4), np.nan) if errors is None else np.stack(errors, axis=-1)
