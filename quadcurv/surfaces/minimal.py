"""Minimal surfaces: H = 0 everywhere."""

from __future__ import annotations

import numpy as np

from quadcurv.surfaces.base import CIRCLE, DO_CARMO, HUTCHINS, Surface, closed_form, require_positive
from quadcurv.types import Floats


def catenoid(waist: float = 1.0) -> Surface:
    """Catenoid a (cosh xi cos eta, cosh xi sin eta, xi), a minimal surface.

    Parameters
    ----------
    waist : float, default 1
        a > 0, radius of the waist.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-pi, pi], wraps in eta. Oriented towards the axis;
        H = 0, K = -1/(a cosh(xi)**2)**2.

    Raises
    ------
    ValueError
        If the waist is not positive and finite.

    References
    ----------
    Hutchins (2013), eq. 3.79, which prints Z = eta where Z = xi is meant.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.catenoid()
    >>> H, K = surface.mean_curvature(0.0, 0.2), surface.gaussian_curvature(0.0, 0.2)
    >>> round(float(H), 6), round(float(K), 6)
    (0.0, -1.0)
    """
    require_positive(waist=waist)
    return closed_form(
        "catenoid",
        lambda xi, eta: (
            waist * np.cosh(xi) * np.cos(eta),
            waist * np.cosh(xi) * np.sin(eta),
            waist * xi,
        ),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -1 / (waist * np.cosh(xi) ** 2) ** 2,
        domain=((-1.0, 1.0), CIRCLE),
        wrap=(False, True),
        reference=f"{HUTCHINS}, eq. 3.79",
    )


def helicoid(pitch: float = 2 * np.pi) -> Surface:
    """Helicoid (xi cos eta, xi sin eta, c eta) with c = pitch/(2 pi), a minimal surface.

    Parameters
    ----------
    pitch : float, default 2 pi
        Rise > 0 along the axis in one turn.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-pi, pi], open. Normal (c sin eta, -c cos eta, xi)/sqrt(c**2 + xi**2);
        H = 0, K = -(c/(c**2 + xi**2))**2.

    Raises
    ------
    ValueError
        If the pitch is not positive and finite.

    References
    ----------
    Hutchins (2013), eq. 3.80.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.helicoid()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.0, -0.64)
    """
    require_positive(pitch=pitch)
    c = pitch / (2 * np.pi)
    return closed_form(
        "helicoid",
        lambda xi, eta: (xi * np.cos(eta), xi * np.sin(eta), c * eta),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -((c / (c**2 + xi**2)) ** 2),
        domain=((-1.0, 1.0), CIRCLE),
        wrap=(False, False),
        reference=f"{HUTCHINS}, eq. 3.80",
    )


def enneper() -> Surface:
    """Enneper's minimal surface.

    (xi - xi**3/3 + xi eta**2, eta - eta**3/3 + eta xi**2, xi**2 - eta**2).

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open; the surface meets itself only beyond xi**2 + eta**2 = 3.
        Normal (-2 xi, 2 eta, 1 - s)/(1 + s) with s = xi**2 + eta**2; H = 0, K = -4/(1 + s)**4.

    References
    ----------
    do Carmo (1976), section 3-5.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.enneper()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.0, -1.347916)
    """
    return closed_form(
        "enneper",
        lambda xi, eta: (xi - xi**3 / 3 + xi * eta**2, eta - eta**3 / 3 + eta * xi**2, xi**2 - eta**2),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -4 / (1 + xi**2 + eta**2) ** 4,
        domain=((-1.0, 1.0), (-1.0, 1.0)),
        wrap=(False, False),
        reference=f"{DO_CARMO}, section 3-5",
    )


def henneberg() -> Surface:
    """Henneberg's minimal surface, which has branch points and is one-sided.

    (2 sinh xi cos eta - 2/3 sinh 3xi cos 3eta, 2 sinh xi sin eta + 2/3 sinh 3xi sin 3eta,
    2 cosh 2xi cos 2eta).

    Returns
    -------
    Surface
        Domain [-1/2, 1/2] x [-pi, pi], wraps in eta. (-xi, eta + pi) is the same point as (xi, eta)
        with the opposite normal: the domain covers the surface twice. At the four singular points
        (0, k pi/2) the surface has no tangent plane and schemes do not converge near them; a part
        without any is ``dataclasses.replace(henneberg(), domain=((0.25, 0.75), (-pi, pi)))``.
        Normal (-cos eta, sin eta, -sinh xi)/cosh xi; H = 0,
        K = -1/(16 cosh(xi)**4 (sinh(2xi)**2 + sin(2eta)**2)).

    References
    ----------
    L. Henneberg (1875), Ueber solche Minimalflaechen, welche eine vorgeschriebene ebene Curve zur
    geodaetischen Linie haben, dissertation, ETH Zuerich; Hutchins (2013), section 3.3.2.

    Examples
    --------
    >>> import quadcurv as qc
    >>> surface = qc.surfaces.henneberg()
    >>> H, K = surface.mean_curvature(0.5, 0.25), surface.gaussian_curvature(0.5, 0.25)
    >>> round(float(H), 6), round(float(K), 6)
    (0.0, -0.023996)
    """

    def gaussian_curvature(xi: Floats, eta: Floats) -> Floats:
        branch = np.sinh(2 * xi) ** 2 + np.sin(2 * eta) ** 2
        with np.errstate(divide="ignore"):
            return -1 / (16 * np.cosh(xi) ** 4 * branch)

    return closed_form(
        "henneberg",
        lambda xi, eta: (
            2 * np.sinh(xi) * np.cos(eta) - 2 / 3 * np.sinh(3 * xi) * np.cos(3 * eta),
            2 * np.sinh(xi) * np.sin(eta) + 2 / 3 * np.sinh(3 * xi) * np.sin(3 * eta),
            2 * np.cosh(2 * xi) * np.cos(2 * eta),
        ),
        mean_curvature=0.0,
        gaussian_curvature=gaussian_curvature,
        domain=((-0.5, 0.5), CIRCLE),
        wrap=(False, True),
        reference="L. Henneberg, Ueber solche Minimalflaechen, welche eine vorgeschriebene ebene "
        "Curve zur geodaetischen Linie haben, dissertation, ETH Zuerich, 1875",
        singular_points=((0.0, -np.pi / 2), (0.0, 0.0), (0.0, np.pi / 2), (0.0, np.pi)),
    )
