"""The discrete operators, each registered once."""

from __future__ import annotations

from typing import Literal

from quadcurv.schemes.base import Curvatures, Diamond, Fit, Laplacian, Scheme, StandardErrors
from quadcurv.schemes.bilinear import BILINEAR
from quadcurv.schemes.cotan import cotan
from quadcurv.schemes.finite_volume import FINITE_VOLUME
from quadcurv.schemes.fundamental_forms import fundamental_forms
from quadcurv.schemes.jet import jet
from quadcurv.schemes.liu import LIU
from quadcurv.schemes.polygon import alexa_wardetzky, bunge, de_goes

__all__ = [
    "SCHEMES",
    "Curvatures",
    "Diamond",
    "Fit",
    "Laplacian",
    "Scheme",
    "StandardErrors",
    "alexa_wardetzky",
    "as_scheme",
    "bunge",
    "cotan",
    "de_goes",
    "fundamental_forms",
    "jet",
]

SCHEMES: dict[str, Scheme] = {
    scheme.name: scheme
    for scheme in (
        FINITE_VOLUME,
        LIU,
        BILINEAR,
        cotan(4),
        cotan(6),
        cotan(8),
        cotan(4, "voronoi"),
        cotan(6, "voronoi"),
        cotan(8, "voronoi"),
        bunge(),
        de_goes(),
        alexa_wardetzky(),
        jet(2),
        jet(),
    )
}


SchemeName = Literal[
    "finite_volume",
    "liu",
    "bilinear",
    "cotan-4",
    "cotan-6",
    "cotan-8",
    "cotan-4-voronoi",
    "cotan-6-voronoi",
    "cotan-8-voronoi",
    "bunge",
    "de_goes",
    "alexa_wardetzky",
    "jet-2",
    "jet",
    "angle_defect",
]
"""Names that the verbs take, for completion in editors."""


def as_scheme(scheme: str | Scheme) -> Scheme:
    """Return the scheme of that name, or the scheme itself.

    Raises
    ------
    ValueError
        The name is not in ``SCHEMES``.

    Examples
    --------
    >>> from quadcurv import schemes
    >>> schemes.as_scheme("liu").order
    2
    """
    if isinstance(scheme, Scheme):
        return scheme
    if not isinstance(scheme, str) or scheme not in SCHEMES:
        raise ValueError(f"scheme: expected one of {', '.join(SCHEMES)}, got {scheme!r}")
    return SCHEMES[scheme]
