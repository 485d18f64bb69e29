"""What a map shows: fields of a comparison, each on its colour scale."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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


class Fields:
    """Fields of a comparison, and what several of them need, made when it is first asked for.

    Parameters
    ----------
    comparison : Comparison

    Attributes
    ----------
    names : list of str
        :data:`FIELDS` and, of several schemes, "difference to SCHEME" for each.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import Fields
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> Fields(qc.compare(ball, "jet")).names[:2]
    ['mean_curvature', 'error']
    """

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        references = comparison.schemes if len(comparison.schemes) > 1 else ()
        self.names = [*FIELDS, *(_DIFFERENCE + scheme for scheme in references)]

    def field(self, name: str) -> Field:
        """Field of that name.

        Raises
        ------
        ValueError
            Unknown name.
        """
        if name not in self.names:
            expected = ", ".join([*FIELDS, f"{_DIFFERENCE}SCHEME"])
            raise ValueError(f"field: expected one of {expected}, got {name!r}")
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

    def of_mesh(self, values: NDArray[Any]) -> dict[str, Floats]:
        """What does not depend on the scheme, for each."""
        return dict.fromkeys(self.comparison.schemes, values.ravel().astype(np.float64))

    @cached_property
    def _difference_limits(self) -> tuple[float, float]:
        """Of the differences of every two schemes: one scale whichever is the reference."""
        pairs = combinations_with_replacement(self.comparison.mean_curvature.values(), 2)
        return decade_limits(a - b for a, b in pairs)

    def _difference(self, reference: str) -> Field:
        H = self.comparison.mean_curvature
        title = f"difference to {reference}, |H − H'| (1/length)"
        values = {scheme: H[scheme] - H[reference] for scheme in self.comparison.schemes}
        return decades(title, values, shows_zero=True, limits=self._difference_limits)


def _mean_curvature(fields: Fields) -> Field:
    unsigned = not fields.comparison.mesh.stencils().orientable
    title = "mean curvature |H| (1/length)" if unsigned else "mean curvature H (1/length)"
    return fields.linear(title, fields.comparison.mean_curvature, unsigned)


def _error(fields: Fields) -> Field:
    comparison = fields.comparison
    if comparison.exact is None:
        title = f"difference |H − {comparison.reference}| (1/length)"
        return decades(title, comparison.errors, shows_zero=False)
    return decades("error |H − exact| (1/length)", comparison.errors, shows_zero=True)


def _signed_error(fields: Fields) -> Field:
    return fields.linear(f"H − {fields.comparison.reference} (1/length)", fields.comparison.errors)


def _gaussian_curvature(fields: Fields) -> Field:
    values = fields.of_mesh(fields.curvatures.gaussian)
    return fields.linear("Gaussian curvature K by jet (1/length²)", values)


def _principal_curvature(sign: int, name: str) -> Callable[[Fields], Field]:
    def field(fields: Fields) -> Field:
        K = fields.curvatures.gaussian
        values = {
            scheme: H + sign * np.sqrt(np.maximum(H**2 - K, 0))
            for scheme, H in fields.comparison.mean_curvature.items()
        }
        operation = "+" if sign > 0 else "−"
        return fields.linear(f"{name} = H {operation} √(H² − K), K by jet (1/length)", values)

    return field


def _valence(fields: Fields) -> Field:
    values = fields.of_mesh(fields.comparison.valence)
    return Field("valence (faces at the vertex)", values, "PuOr_r", (2.0, 6.0))


def _quality(measure: str, title: str, limits: tuple[float, float]) -> Callable[[Fields], Field]:
    return lambda fields: Field(title, fields.of_mesh(fields.quality[measure]), "viridis", limits)


def _small_quality(measure: str, title: str) -> Callable[[Fields], Field]:
    return lambda fields: decades(title, fields.of_mesh(fields.quality[measure]), shows_zero=True)


FIELDS: dict[str, Callable[[Fields], Field]] = {
    "mean_curvature": _mean_curvature,
    "error": _error,
    "signed_error": _signed_error,
    "gaussian_curvature": _gaussian_curvature,
    "k1": _principal_curvature(+1, "k1"),
    "k2": _principal_curvature(-1, "k2"),
    "valence": _valence,
    "skew": _quality("skew", "skew of the worst face (degrees from 90, in triangles 60)", (0.0, 90.0)),
    "aspect": _quality("aspect", "longest over shortest edge of the worst face", (1.0, 5.0)),
    "nonplanarity": _small_quality("nonplanarity", "gap over mean length of the diagonals, worst face"),
    "roughness": _small_quality("roughness", "relative error of extrapolation at the boundary, about"),
}
"""Fields that a map of any comparison can show, by name."""

OF_MESH = ("gaussian_curvature", "valence", "skew", "aspect", "nonplanarity", "roughness")
"""Those that do not depend on the scheme."""
