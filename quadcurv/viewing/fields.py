"""What a map shows: fields of a comparison, each on its colour scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import combinations_with_replacement
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv import drivers
from quadcurv.comparison import Comparison
from quadcurv.mesh_quality import quality
from quadcurv.schemes import Curvatures, jet
from quadcurv.types import Floats, Ints, MeshError
from quadcurv.viewing.geometry import Drawn, drawn, overlays
from quadcurv.viewing.scale import Field, decade_limits, decades, linear

_DIFFERENCE = "difference to "
_FIT = "jet"  # what knows more than the mean curvature


def field_names(schemes: Sequence[str], exact: bool) -> list[str]:
    """Fields of a comparison of these schemes.

    Without an exact answer a single scheme has no error, and "jet", by which errors are estimated, has no
    estimate.
    """
    without: set[str] = set()
    if len(schemes) == 1 and not exact:
        without |= {"error", "signed_error"}
    if list(schemes) == [_FIT]:
        without |= {"estimate"}
    differences = [_DIFFERENCE + scheme for scheme in schemes] if len(schemes) > 1 else []
    return [name for name in FIELDS if name not in without] + differences


class Fields:
    """Fields of a comparison, and what several of them need, made when it is first asked for.

    Parameters
    ----------
    comparison : Comparison

    Attributes
    ----------
    names : list of str
        Those of :data:`FIELDS` that the comparison has and, of several schemes, "difference to SCHEME" for
        each.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import Fields
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> Fields(qc.compare(ball, "liu", exact=1.0)).names[:4]
    ['mean_curvature', 'error', 'signed_error', 'estimate']
    """

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        self.names = field_names(comparison.schemes, comparison.exact is not None)

    @property
    def first(self) -> str:
        """What to show where nothing is asked for: the error, or the mean curvature where there is none."""
        return "error" if "error" in self.names else "mean_curvature"

    def field(self, name: str) -> Field:
        """Field of that name.

        Raises
        ------
        ValueError
            Unknown name.
        """
        if name not in self.names:
            raise ValueError(f"field: expected one of {', '.join(self.names)}, got {name!r}")
        return FIELDS[name](self) if name in FIELDS else self._difference(name.removeprefix(_DIFFERENCE))

    @cached_property
    def curvatures(self) -> Curvatures:
        """All curvatures by jet; what is beyond a grid too narrow to be continued is left out of the fits."""
        try:
            return drivers.fit(self.comparison.mesh, jet())
        except MeshError:
            return drivers.fit(self.comparison.mesh, jet(), boundary="nan")

    @cached_property
    def quality(self) -> dict[str, NDArray[Any]]:
        """Shape of the worst face at every vertex."""
        return quality(self.comparison.mesh)

    @cached_property
    def drawn(self) -> Drawn:
        """Points and faces."""
        return drawn(self.comparison.mesh)

    @cached_property
    def overlays(self) -> dict[str, Ints]:
        """Edges and vertices to mark."""
        return overlays(self.comparison.mesh)

    def linear(self, title: str, values: Mapping[str, Floats], unsigned: bool = False) -> Field:
        """On a linear scale about zero."""
        return linear(title, values, self.comparison.areas, unsigned)

    def against(self, reference: str, values: Mapping[str, Floats]) -> dict[str, Floats]:
        """What is taken against a scheme, without that scheme itself."""
        return {name: v for name, v in values.items() if name != reference}

    @cached_property
    def _difference_limits(self) -> tuple[float, float]:
        """Of the differences of every two schemes: one scale whichever is the reference."""
        pairs = combinations_with_replacement(self.comparison.mean_curvature.values(), 2)
        return decade_limits(a - b for a, b in pairs)

    def _difference(self, reference: str) -> Field:
        H = self.comparison.mean_curvature
        title = f"difference to {reference}, |H − H'| (1/length)"
        values = {scheme: np.abs(H[scheme] - H[reference]) for scheme in self.against(reference, H)}
        return decades(title, values, self._difference_limits)


def _once(name: str, values: NDArray[Any]) -> dict[str, Floats]:
    """What no scheme enters, under its own name."""
    return {name: np.ravel(values).astype(np.float64)}


def _mean_curvature(fields: Fields) -> Field:
    unsigned = not fields.comparison.mesh.stencils().orientable
    title = "mean curvature |H| (1/length)" if unsigned else "mean curvature H (1/length)"
    return fields.linear(title, fields.comparison.mean_curvature, unsigned)


def _errors(fields: Fields) -> dict[str, Floats]:
    return fields.against(fields.comparison.reference, fields.comparison.errors)


def _error(fields: Fields) -> Field:
    reference = fields.comparison.reference
    kind = "error" if reference == "exact" else "difference"
    return decades(f"{kind} |H − {reference}| (1/length)", _errors(fields))


def _signed_error(fields: Fields) -> Field:
    return fields.linear(f"H − {fields.comparison.reference} (1/length)", _errors(fields))


def _estimate(fields: Fields) -> Field:
    H = fields.against(_FIT, fields.comparison.mean_curvature)
    values = {scheme: values - fields.curvatures.mean for scheme, values in H.items()}
    return decades("estimated error |H − H by jet| (1/length)", values)


def _fitted(attribute: str, symbol: str, name: str, unit: str) -> Callable[[Fields], Field]:
    def field(fields: Fields) -> Field:
        title = f"{name} {symbol} by jet ({unit})"
        return fields.linear(title, _once(f"{symbol} by jet", getattr(fields.curvatures, attribute)))

    return field


def _interval(attribute: str, symbol: str, unit: str) -> Callable[[Fields], Field]:
    def field(fields: Fields) -> Field:
        bars = fields.curvatures.interval
        assert bars is not None  # of jet
        title = f"half width of the 95 % interval of {symbol} by jet ({unit})"
        return decades(title, _once(f"± of {symbol} by jet", getattr(bars, attribute)))

    return field


def _feature(fields: Fields) -> Field:
    found = fields.curvatures
    assert found.feature is not None  # of jet
    unknown = np.isnan(found.mean) & ~found.feature
    values = _once("creases", np.where(unknown, np.nan, found.feature))
    title = "creases, on which the surface has no curvature"
    return Field(title, values, "binary", (-0.5, 1.5), kinds=("smooth", "crease"))


def _valence(fields: Fields) -> Field:
    values = _once("valence", fields.comparison.valence)
    return Field("valence (faces at the vertex)", values, "PuOr_r", (2.0, 6.0))


def _quality(measure: str, title: str, limits: tuple[float, float]) -> Callable[[Fields], Field]:
    return lambda fields: Field(title, _once(measure, fields.quality[measure]), "viridis", limits)


def _small_quality(measure: str, title: str) -> Callable[[Fields], Field]:
    return lambda fields: decades(title, _once(measure, fields.quality[measure]))


FIELDS: dict[str, Callable[[Fields], Field]] = {
    "mean_curvature": _mean_curvature,
    "error": _error,
    "signed_error": _signed_error,
    "estimate": _estimate,
    "gaussian_curvature": _fitted("gaussian", "K", "Gaussian curvature", "1/length²"),
    "k1": _fitted("k1", "k1", "larger principal curvature", "1/length"),
    "k2": _fitted("k2", "k2", "smaller principal curvature", "1/length"),
    "interval_mean_curvature": _interval("mean", "H", "1/length"),
    "interval_gaussian_curvature": _interval("gaussian", "K", "1/length²"),
    "interval_k1": _interval("k1", "k1", "1/length"),
    "interval_k2": _interval("k2", "k2", "1/length"),
    "feature": _feature,
    "valence": _valence,
    "skew": _quality("skew", "skew of the worst face (degrees from 90, in triangles 60)", (0.0, 90.0)),
    "aspect": _quality("aspect", "longest over shortest edge of the worst face", (1.0, 5.0)),
    "nonplanarity": _small_quality("nonplanarity", "gap over mean length of the diagonals, worst face"),
    "roughness": _small_quality("roughness", "relative error of extrapolation at the boundary, about"),
}
"""Fields that maps can show, by name: of every scheme, and from "gaussian_curvature" on once."""
