"""The discrete operators, each registered once."""

from __future__ import annotations

from quadcurv.schemes.base import Scheme
from quadcurv.schemes.cotan import cotan
from quadcurv.schemes.finite_volume import FINITE_VOLUME
from quadcurv.schemes.liu import LIU

__all__ = ["SCHEMES", "Scheme", "as_scheme", "cotan"]

SCHEMES: dict[str, Scheme] = {
    scheme.name: scheme
    for scheme in (
        FINITE_VOLUME,
        LIU,
        cotan(4),
        cotan(6),
        cotan(8),
        cotan(4, "voronoi"),
        cotan(6, "voronoi"),
        cotan(8, "voronoi"),
    )
}


def as_scheme(scheme: str | Scheme) -> Scheme:
    """Return the scheme of that name, or the scheme itself.

    Raises
    ------
    ValueError
        The name is not in ``SCHEMES``.
    """
    if isinstance(scheme, Scheme):
        return scheme
    if scheme not in SCHEMES:
        raise ValueError(f"scheme: expected one of {', '.join(SCHEMES)}, got {scheme!r}")
    return SCHEMES[scheme]
