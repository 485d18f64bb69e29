"""Curves whose curvature and torsion are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from quadcurv.curves.finite_volumes import Function


@dataclass(frozen=True)
class Curve:
    """A curve whose curvature and torsion are known.

    Attributes
    ----------
    mapping : callable
        From parameters of shape (n,) to points of shape (n, 2) or (n, 3).
    curvature, torsion : callable
        From parameters of shape (n,) to exact values of shape (n,), in 1/length; kappa >= 0, and
        tau > 0 on a right-handed helix, NaN where it is not defined.
    domain : tuple of float
        First and last parameter; a whole period where the curve is closed.
    closed : bool
        Whether the two ends of the domain are one point.
    reference : str
        Where the formulas are found.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> circle = qc.curves.circle(radius=4.0)
    >>> float(circle.curvature(np.array([0.0]))[0]), circle.closed
    (0.25, True)
    """

    mapping: Function
    curvature: Function
    torsion: Function
    domain: tuple[float, float]
    closed: bool
    reference: str


def line(origin: Sequence[float] = (0.0, 0.0), direction: Sequence[float] = (0.8, 0.6)) -> Curve:
    """Straight line origin + t direction for t in [0, 1]: kappa = 0, torsion not defined (2.33).

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> float(qc.curves.line().curvature(np.array([0.5]))[0])
    0.0
    """
    start, slope = np.array(origin, dtype=float), np.array(direction, dtype=float)
    return Curve(
        mapping=lambda t: start + np.multiply.outer(t, slope),
        curvature=np.zeros_like,
        torsion=lambda t: np.full_like(t, np.nan),
        domain=(0.0, 1.0),
        closed=False,
        reference="Hutchins (2013), eq. 2.33",
    )


def circle(radius: float = 1.0) -> Curve:
    """Circle about the origin, counter-clockwise: kappa = 1 / radius (2.38).

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> float(qc.curves.circle(2.0).curvature(np.array([0.5]))[0])
    0.5
    """
    return Curve(
        mapping=lambda t: radius * np.column_stack([np.cos(t), np.sin(t)]),
        curvature=lambda t: np.full_like(t, 1 / radius),
        torsion=np.zeros_like,
        domain=(-np.pi, np.pi),
        closed=True,
        reference="Hutchins (2013), eq. 2.38",
    )


def ellipse(a: float = 5.0, b: float = 2.0) -> Curve:
    """Ellipse with half-axes a along x and b along y, counter-clockwise (2.50, 2.51).

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> float(qc.curves.ellipse(5.0, 2.0).curvature(np.array([0.0]))[0])
    1.25
    """
    return Curve(
        mapping=lambda t: np.column_stack([a * np.cos(t), b * np.sin(t)]),
        curvature=lambda t: a * b / np.hypot(b * np.cos(t), a * np.sin(t)) ** 3,
        torsion=np.zeros_like,
        domain=(-np.pi, np.pi),
        closed=True,
        reference="Hutchins (2013), eqs. 2.50 and 2.51",
    )


def euler_spiral() -> Curve:
    """Euler spiral (C(t), S(t)) of arc length t for t in [-30, 30]: kappa = 2 |t| (2.52).

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> float(qc.curves.euler_spiral().curvature(np.array([3.0]))[0])
    6.0
    """
    from scipy.special import fresnel

    unit = np.sqrt(np.pi / 2)  # scipy integrates sin(pi u^2 / 2), the thesis sin(u^2)

    return Curve(
        mapping=lambda t: unit * np.column_stack(fresnel(t / unit)[::-1]),
        curvature=lambda t: 2 * np.abs(t),
        torsion=np.zeros_like,
        domain=(-30.0, 30.0),
        closed=False,
        reference="Hutchins (2013), eq. 2.52",
    )


def helix(radius: float = 1.0, rise: float = 0.5) -> Curve:
    """Helix (radius cos t, radius sin t, rise t) for t in [0, 4 pi]; right-handed for rise > 0.

    kappa = radius / (radius^2 + rise^2), tau = rise / (radius^2 + rise^2).

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> float(qc.curves.helix(1.0, 0.5).torsion(np.array([0.0]))[0])
    0.4
    """
    square = radius**2 + rise**2
    return Curve(
        mapping=lambda t: np.column_stack([radius * np.cos(t), radius * np.sin(t), rise * t]),
        curvature=lambda t: np.full_like(t, radius / square),
        torsion=lambda t: np.full_like(t, rise / square),
        domain=(0.0, 4 * np.pi),
        closed=False,
        reference="do Carmo (1976), Differential Geometry of Curves and Surfaces, section 1-5",
    )
