"""Parametrised surfaces with their exact mean and Gaussian curvature in closed form.

Every factory returns a `Surface`; `SURFACES` lists the factories by name. Lengths are in the units
of the factory's parameters, mean curvature in 1/length, Gaussian curvature in 1/length**2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from quadcurv.mesh import QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.stencils import grid_faces

__all__ = [
    "SURFACES",
    "Surface",
    "catenoid",
    "cubed_ellipsoid",
    "cubed_sphere",
    "cylinder",
    "ellipsoid",
    "elliptic_paraboloid",
    "enneper",
    "helicoid",
    "henneberg",
    "hyperbolic_paraboloid",
    "hyperboloid",
    "pillow_sphere",
    "plane",
    "sphere",
    "tanh_sheet",
    "torus",
]

Array = NDArray[np.float64]
Field = Callable[[ArrayLike, ArrayLike], Array]

_CIRCLE = (-np.pi, np.pi)
_HUTCHINS = (
    "J. T. Hutchins, Computing curvature and curvature normals on smooth logically Cartesian "
    "surface meshes, MSc thesis, Boise State University, 2013"
)
_DO_CARMO = "M. P. do Carmo, Differential Geometry of Curves and Surfaces, Prentice-Hall, 1976"


@dataclass(frozen=True)
class Surface:
    """A parametrised surface X(xi, eta) with exact curvature.

    The orientation is that of X_xi x X_eta. Another part of the same surface is
    ``dataclasses.replace(surface, domain=...)``.

    Attributes
    ----------
    name : str
        Its key in `SURFACES`.
    mapping : callable
        ``mapping(xi, eta)``: positions, shape (..., 3), float64; broadcasts. Defined some cells
        beyond the domain too, where ghost cells are sampled.
    mean_curvature : callable
        ``mean_curvature(xi, eta)``: signed mean curvature in 1/length, shape (...), + for a sphere
        oriented outward.
    gaussian_curvature : callable
        ``gaussian_curvature(xi, eta)``: Gaussian curvature in 1/length**2, shape (...).
    domain : tuple
        ``((xi0, xi1), (eta0, eta1))``: the parameters of the surface, or of each of its panels.
    wrap : tuple of bool
        Whether the mapping is periodic in xi, eta with the length of the domain as the period.
    reference : str
        Where the parametrisation or its curvature is published.
    panels : tuple of float, default (0.0,)
        Offsets in xi, one a panel: panel p is the image of the domain shifted by ``panels[p]``, its
        ends included, and the surface is the union of its panels. Panels meet in space, not in xi:
        a panel is continued smoothly beyond its own edges, by half its width, so that both its ends
        and its ghost cells have a position of their own. One panel, not shifted, save for the cubed
        surfaces.
    singular_points : tuple of (float, float), default ()
        Parameters (xi, eta) of the domain where X_xi x X_eta vanishes. The curvature returned there
        is the limit, infinities included.
    """

    name: str
    mapping: Field
    mean_curvature: Field
    gaussian_curvature: Field
    domain: tuple[tuple[float, float], tuple[float, float]]
    wrap: tuple[bool, bool]
    reference: str
    panels: tuple[float, ...] = (0.0,)
    singular_points: tuple[tuple[float, float], ...] = ()

    def sample(self, shape: tuple[int, int], layout: str = "grid") -> tuple[Any, Array, Array]:
        """Mesh of evenly spaced parameters.

        Parameters
        ----------
        shape : (int, int)
            Number of cells r, c in xi and eta, of each panel.
        layout : {"grid", "staggered", "faces"}
            "grid": vertices of the cells, ends of open directions included, as a `QuadGrid` that wraps
            where the surface does. "staggered": cell centres and corners with one layer of ghost cells
            sampled beyond the domain, as a `StaggeredGrid` (the primal/dual points of the thesis).
            "faces": the vertices of all panels as a `QuadMesh`, those that coincide (folds, seams, edges
            of panels) welded.

        Returns
        -------
        mesh : QuadGrid, StaggeredGrid or QuadMesh
        xi, eta : ndarray, shape (r, c) or (n,)
            Parameters of the vertices, where `mean_curvature` gives the exact answer.

        Raises
        ------
        ValueError
            If the layout is unknown, or a surface of several panels is asked for as one grid.
        """
        if layout not in ("grid", "staggered", "faces"):
            raise ValueError(f"layout must be 'grid', 'staggered' or 'faces', got {layout!r}")
        if layout == "faces":
            return self._welded(shape)
        if len(self.panels) > 1:
            raise ValueError(f"{self.name} has {len(self.panels)} panels, only layout 'faces' joins them")
        if layout == "staggered":
            dual = [
                a + (b - a) / n * np.arange(-1, n + 2) for (a, b), n in zip(self.domain, shape, strict=True)
            ]
            xi, eta = np.meshgrid(*((d[1:-2] + d[2:-1]) / 2 for d in dual), indexing="ij")
            return StaggeredGrid.from_mapping(self.mapping, *dual), xi, eta
        ends = [
            np.linspace(a, b, n if wraps else n + 1, endpoint=not wraps)
            for (a, b), n, wraps in zip(self.domain, shape, self.wrap, strict=True)
        ]
        xi, eta = np.meshgrid(*ends, indexing="ij")
        return QuadGrid(self.mapping(xi, eta), self.wrap), xi, eta

    def _welded(self, shape: tuple[int, int]) -> tuple[QuadMesh, Array, Array]:
        xi, eta = np.meshgrid(
            *(np.linspace(a, b, n + 1) for (a, b), n in zip(self.domain, shape, strict=True)), indexing="ij"
        )
        xi = np.stack([xi + offset for offset in self.panels])
        eta = np.broadcast_to(eta, xi.shape)
        points = self.mapping(xi, eta).reshape(-1, 3)
        index = np.arange(len(points), dtype=np.int32).reshape(xi.shape)
        faces = np.concatenate([grid_faces(panel) for panel in index])
        pairs = cKDTree(points).query_pairs(1e-9 * np.ptp(points, axis=0).max(), output_type="ndarray")
        same = scipy.sparse.coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(points),) * 2)
        label = scipy.sparse.csgraph.connected_components(same, directed=False)[1]
        # Labels come in the order of first appearance, so the first vertex of each is kept.
        first = np.unique(label, return_index=True)[1]
        return QuadMesh(points[first], label[faces]), xi.ravel()[first], eta.ravel()[first]


def _field(values: float | Callable[[Array, Array], Array]) -> Field:
    """Let a constant or a function of two float64 arrays of one shape take what broadcasts."""

    def field(xi: ArrayLike, eta: ArrayLike) -> Array:
        xi, eta = np.broadcast_arrays(np.asarray(xi, np.float64), np.asarray(eta, np.float64))
        return values(xi, eta) if callable(values) else np.full(xi.shape, values)

    return field


def _points(x: ArrayLike, y: ArrayLike, z: ArrayLike) -> Array:
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)


def _surface(
    name: str,
    mapping: Callable[[Array, Array], Array],
    mean_curvature: float | Callable[[Array, Array], Array],
    gaussian_curvature: float | Callable[[Array, Array], Array],
    **attributes: Any,
) -> Surface:
    return Surface(name, _field(mapping), _field(mean_curvature), _field(gaussian_curvature), **attributes)


def _positive(**parameters: float) -> None:
    for name, value in parameters.items():
        if not 0 < value < np.inf:
            raise ValueError(f"{name} must be positive and finite, got {value!r}")


def _polar_cut(latitude: float) -> tuple[float, float]:
    if not 0 < latitude < np.pi / 2:
        raise ValueError(f"latitude must lie between 0 and pi/2 (the poles are excluded), got {latitude!r}")
    return -latitude, latitude


def plane() -> Surface:
    """Plane (xi, eta, 0).

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Normal (0, 0, 1); H = K = 0.

    References
    ----------
    Hutchins (2013), section 3.3.2.
    """
    return _surface(
        "plane",
        lambda x, y: _points(x, y, 0.0),
        mean_curvature=0.0,
        gaussian_curvature=0.0,
        domain=((-1.0, 1.0), (-1.0, 1.0)),
        wrap=(False, False),
        reference=f"{_HUTCHINS}, section 3.3.2",
    )


def cylinder(radius: float = 1.0, f: Callable[[Array], Array] | None = None) -> Surface:
    """Circular cylinder (R cos theta, R sin theta, zeta + f(theta)) with xi = theta, eta = zeta.

    Parameters
    ----------
    radius : float, default 1
        R > 0.
    f : callable, optional
        Shift of the rulings along the axis, array of angles to array of lengths; zero by default.
        It shears the grid and leaves the surface as it is.

    Returns
    -------
    Surface
        Domain [0, 2 pi] x [0, 2 pi]. Wraps in xi if f has the period 2 pi, which is tried at a few
        angles. Oriented outward; H = 1/(2R), K = 0.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    Hutchins (2013), eq. 3.36 and section 4.2.
    """
    _positive(radius=radius)
    shift = f if f is not None else np.zeros_like
    angles = np.linspace(0.0, 2 * np.pi, 17)
    return _surface(
        "cylinder",
        lambda t, zeta: _points(radius * np.cos(t), radius * np.sin(t), zeta + shift(t)),
        mean_curvature=0.5 / radius,
        gaussian_curvature=0.0,
        domain=((0.0, 2 * np.pi), (0.0, 2 * np.pi)),
        wrap=(bool(np.allclose(shift(angles), shift(angles + 2 * np.pi))), False),
        reference=f"{_HUTCHINS}, eq. 3.36",
    )


def _sphere(
    name: str, direction: Callable[[Array, Array], Array], radius: float, **attributes: Any
) -> Surface:
    _positive(radius=radius)
    return _surface(
        name,
        lambda xi, eta: radius * direction(xi, eta),
        mean_curvature=1 / radius,
        gaussian_curvature=1 / radius**2,
        **attributes,
    )


def _longitude_latitude(xi: Array, eta: Array) -> Array:
    return _points(np.cos(xi) * np.cos(eta), np.sin(xi) * np.cos(eta), np.sin(eta))


def sphere(radius: float = 1.0, latitude: float = np.pi / 3) -> Surface:
    """Sphere by longitude xi and latitude eta: R (cos xi cos eta, sin xi cos eta, sin eta).

    Parameters
    ----------
    radius : float, default 1
        R > 0.
    latitude : float, default pi/3
        Where the polar caps are cut off, between 0 and pi/2. Ghost cells must not reach over a
        pole.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-latitude, latitude], wraps in xi. Oriented outward; H = 1/R,
        K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite, or the latitude not between 0 and pi/2.

    References
    ----------
    Hutchins (2013), section 3.3.3, figures 3.10 and 3.11.
    """
    return _sphere(
        "sphere",
        _longitude_latitude,
        radius,
        domain=(_CIRCLE, _polar_cut(latitude)),
        wrap=(True, False),
        reference=f"{_HUTCHINS}, section 3.3.3",
    )


def _pillow(xi: Array, eta: Array) -> Array:
    """Pillow mapping of the unit sphere, continued through the folds and around."""
    folded = np.abs(eta) > 1
    x = np.where(folded, -2 - xi, xi)
    y = np.where(folded, np.copysign(2, eta) - eta, eta)
    x = x - 4 * np.floor((x + 3) / 4)
    lower = x < -1
    x = np.where(lower, -2 - x, x)

    wide = np.abs(x) >= np.abs(y)
    d = np.maximum(np.abs(x), np.abs(y))
    # The circle of radius 1 through the diagonal point (D, D) with its centre on an axis, at D - q:
    # `across` is the coordinate D m/d off that axis, `along` = D - q + p the one on it.
    D = d * (2 - d) / np.sqrt(2)
    across = (2 - d) * np.minimum(np.abs(x), np.abs(y)) / np.sqrt(2)
    p, q = np.sqrt(1 - across**2), np.sqrt(1 - D**2)
    along = D + (D - across) * (D + across) / (p + q)
    # 1 - along**2 - across**2 = (p + along)(q - D) with q**2 - D**2 = (1 - d)**2 (1 + d(2 - d)):
    # no digits cancel at the equator d = 1.
    z = (1 - d) * np.sqrt((1 + d * (2 - d)) * (p + along) / (q + D))
    return _points(
        np.copysign(np.where(wide, along, across), x),
        np.copysign(np.where(wide, across, along), y),
        np.where(lower, -z, z),
    )


def pillow_sphere(radius: float = 1.0) -> Surface:
    """Sphere by the pillow grid mapping of Calhoun, Helzel and LeVeque.

    With d = max(|xi|, |eta|) and D = d (2 - d)/sqrt(2), the square of half-width d is mapped to
    four arcs of radius R through (+-R D, +-R D), and z = sqrt(R**2 - x**2 - y**2). xi in [-1, 1] is
    the upper hemisphere, xi in [-3, -1] the lower one, by (xi, z) -> (-2 - xi, -z).

    Parameters
    ----------
    radius : float, default 1
        R > 0.

    Returns
    -------
    Surface
        Domain [-3, 1] x [-1, 1], wraps in xi. The sides eta = +-1 are folds: (xi, +-1) is the same
        point as (-2 - xi, +-1), and beyond them, up to |eta| = 3, the mapping continues as
        (xi, eta) -> (-2 - xi, +-2 - eta). Continuous everywhere; the derivatives jump across the
        equator and the diagonals of the two squares. Oriented outward on both hemispheres;
        H = 1/R, K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    D. A. Calhoun, C. Helzel, R. J. LeVeque (2008), Logically rectangular grids and finite volume
    methods for PDEs in circular and spherical domains, SIAM Review 50(4), 723-752.
    """
    return _sphere(
        "pillow_sphere",
        _pillow,
        radius,
        domain=((-3.0, 1.0), (-1.0, 1.0)),
        wrap=(True, False),
        reference="D. A. Calhoun, C. Helzel, R. J. LeVeque, Logically rectangular grids and finite "
        "volume methods for PDEs in circular and spherical domains, SIAM Review 50(4), 2008",
    )


# Axes of the panels: outward normal, direction of xi, direction of eta; right-handed.
_CUBE = np.array(
    [
        [(1, 0, 0), (0, 1, 0), (0, 0, 1)],
        [(0, 1, 0), (-1, 0, 0), (0, 0, 1)],
        [(-1, 0, 0), (0, -1, 0), (0, 0, 1)],
        [(0, -1, 0), (1, 0, 0), (0, 0, 1)],
        [(0, 0, 1), (0, 1, 0), (-1, 0, 0)],
        [(0, 0, -1), (0, 1, 0), (1, 0, 0)],
    ],
    dtype=np.float64,
)


def _cube(xi: Array, eta: Array) -> Array:
    """Equiangular mapping of the cube to the unit sphere."""
    panel = np.floor((xi + 0.5) / 2)
    a = np.tan(np.pi / 2 * (xi - 2 * panel - 0.5))
    b = np.tan(np.pi / 2 * (eta - 0.5))
    direction = np.einsum("...i,...ij->...j", _points(1.0, a, b), _CUBE[panel.astype(int) % 6])
    return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def cubed_sphere(radius: float = 1.0) -> Surface:
    """Sphere as the equiangular projection of the six sides of a cube.

    Panel p = 0, ..., 5 has xi in [2p, 2p + 1] and is R (n + a u + b v)/sqrt(1 + a**2 + b**2) with
    a = tan(pi/2 (xi - 2p - 1/2)), b = tan(pi/2 (eta - 1/2)) and the right-handed axes u, v, n of
    the cube's side: n = +x, +y, -x, -y around the equator, then +z and -z.

    Parameters
    ----------
    radius : float, default 1
        R > 0.

    Returns
    -------
    Surface
        Domain [0, 1] x [0, 1], open, panels (0, 2, 4, 6, 8, 10). Neighbouring panels share their
        edge; beyond it each continues by half its width along its own great circles. Oriented
        outward; H = 1/R, K = 1/R**2.

    Raises
    ------
    ValueError
        If the radius is not positive and finite.

    References
    ----------
    C. Ronchi, R. Iacono, P. S. Paolucci (1996), The "cubed sphere": a new method for the solution
    of partial differential equations in spherical geometry, J. Comput. Phys. 124, 93-114.
    """
    return _sphere(
        "cubed_sphere",
        _cube,
        radius,
        domain=((0.0, 1.0), (0.0, 1.0)),
        wrap=(False, False),
        reference='C. Ronchi, R. Iacono, P. S. Paolucci, The "cubed sphere": a new method for the '
        "solution of partial differential equations in spherical geometry, J. Comput. Phys. 124, "
        "1996",
        panels=(0.0, 2.0, 4.0, 6.0, 8.0, 10.0),
    )


def _scaled(name: str, unit_sphere: Surface, a: float, b: float, c: float) -> Surface:
    """Ellipsoid as the image of a unit sphere under scaling."""
    _positive(a=a, b=b, c=c)
    axes = np.array([a, b, c], dtype=np.float64)
    product = a * b * c

    def support(xi: ArrayLike, eta: ArrayLike) -> Array:
        """Distance of the tangent plane from the centre."""
        return 1 / np.linalg.norm(unit_sphere.mapping(xi, eta) / axes, axis=-1)

    def mean_curvature(xi: ArrayLike, eta: ArrayLike) -> Array:
        square = np.sum((axes * unit_sphere.mapping(xi, eta)) ** 2, axis=-1)
        return support(xi, eta) ** 3 * (np.sum(axes**2) - square) / (2 * product**2)

    return replace(
        unit_sphere,
        name=name,
        mapping=lambda xi, eta: axes * unit_sphere.mapping(xi, eta),
        mean_curvature=mean_curvature,
        gaussian_curvature=lambda xi, eta: support(xi, eta) ** 4 / product**2,
        reference="R. Goldman, Curvature formulas for implicit curves and surfaces, Computer Aided "
        "Geometric Design 22, 2005",
    )


def ellipsoid(a: float = 2.0, b: float = 1.5, c: float = 1.0, latitude: float = np.pi / 3) -> Surface:
    """Ellipsoid (a cos xi cos eta, b sin xi cos eta, c sin eta), the scaled `sphere`.

    Parameters
    ----------
    a, b, c : float, default 2, 1.5, 1
        Semi-axes > 0 along x, y, z.
    latitude : float, default pi/3
        Largest |eta|, between 0 and pi/2. Ghost cells must not reach over a pole.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-latitude, latitude], wraps in xi. Oriented outward;
        H = h**3 (a**2 + b**2 + c**2 - |X|**2)/(2 (a b c)**2) and K = h**4/(a b c)**2, where
        h = (x**2/a**4 + y**2/b**4 + z**2/c**4)**(-1/2) is the distance of the tangent plane from
        the centre.

    Raises
    ------
    ValueError
        If a semi-axis is not positive and finite, or the latitude not between 0 and pi/2.

    References
    ----------
    R. Goldman (2005), Curvature formulas for implicit curves and surfaces, Computer Aided Geometric
    Design 22, 632-658.
    """
    return _scaled("ellipsoid", sphere(latitude=latitude), a, b, c)


def cubed_ellipsoid(a: float = 2.0, b: float = 1.5, c: float = 1.0) -> Surface:
    """Ellipsoid x**2/a**2 + y**2/b**2 + z**2/c**2 = 1 in six panels, the scaled `cubed_sphere`.

    Parameters
    ----------
    a, b, c : float, default 2, 1.5, 1
        Semi-axes > 0 along x, y, z.

    Returns
    -------
    Surface
        Domain and panels of `cubed_sphere`, orientation and curvature of `ellipsoid`.

    Raises
    ------
    ValueError
        If a semi-axis is not positive and finite.

    References
    ----------
    R. Goldman (2005), Curvature formulas for implicit curves and surfaces, Computer Aided Geometric
    Design 22, 632-658.
    """
    return _scaled("cubed_ellipsoid", cubed_sphere(), a, b, c)


def torus(major: float = 2.0, minor: float = 1.0) -> Surface:
    """Torus ((R + r cos eta) cos xi, (R + r cos eta) sin xi, r sin eta).

    Parameters
    ----------
    major : float, default 2
        R > r, from the axis to the centre of the tube.
    minor : float, default 1
        r > 0, radius of the tube.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-pi, pi], wraps in both. Oriented outward;
        H = (R + 2 r cos eta)/(2 r (R + r cos eta)), K = cos eta/(r (R + r cos eta)).

    Raises
    ------
    ValueError
        If a radius is not positive and finite, or the minor one not less than the major one.

    References
    ----------
    do Carmo (1976), section 3-3.
    """
    _positive(major=major, minor=minor)
    if minor >= major:
        raise ValueError(f"minor must be less than major, got major={major!r}, minor={minor!r}")

    def axis_distance(eta: Array) -> Array:
        return major + minor * np.cos(eta)

    return _surface(
        "torus",
        lambda xi, eta: _points(
            axis_distance(eta) * np.cos(xi),
            axis_distance(eta) * np.sin(xi),
            minor * np.sin(eta),
        ),
        mean_curvature=lambda xi, eta: (1 / minor + np.cos(eta) / axis_distance(eta)) / 2,
        gaussian_curvature=lambda xi, eta: np.cos(eta) / (minor * axis_distance(eta)),
        domain=(_CIRCLE, _CIRCLE),
        wrap=(True, True),
        reference=f"{_DO_CARMO}, section 3-3",
    )


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
    """
    _positive(waist=waist)
    return _surface(
        "catenoid",
        lambda xi, eta: waist * _points(np.cosh(xi) * np.cos(eta), np.cosh(xi) * np.sin(eta), xi),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -1 / (waist * np.cosh(xi) ** 2) ** 2,
        domain=((-1.0, 1.0), _CIRCLE),
        wrap=(False, True),
        reference=f"{_HUTCHINS}, eq. 3.79",
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
    """
    _positive(pitch=pitch)
    c = pitch / (2 * np.pi)
    return _surface(
        "helicoid",
        lambda xi, eta: _points(xi * np.cos(eta), xi * np.sin(eta), c * eta),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -((c / (c**2 + xi**2)) ** 2),
        domain=((-1.0, 1.0), _CIRCLE),
        wrap=(False, False),
        reference=f"{_HUTCHINS}, eq. 3.80",
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
    """
    return _surface(
        "enneper",
        lambda xi, eta: _points(xi - xi**3 / 3 + xi * eta**2, eta - eta**3 / 3 + eta * xi**2, xi**2 - eta**2),
        mean_curvature=0.0,
        gaussian_curvature=lambda xi, eta: -4 / (1 + xi**2 + eta**2) ** 4,
        domain=((-1.0, 1.0), (-1.0, 1.0)),
        wrap=(False, False),
        reference=f"{_DO_CARMO}, section 3-5",
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
    """

    def gaussian_curvature(xi: Array, eta: Array) -> Array:
        branch = np.sinh(2 * xi) ** 2 + np.sin(2 * eta) ** 2
        with np.errstate(divide="ignore"):
            return -1 / (16 * np.cosh(xi) ** 4 * branch)

    return _surface(
        "henneberg",
        lambda xi, eta: _points(
            2 * np.sinh(xi) * np.cos(eta) - 2 / 3 * np.sinh(3 * xi) * np.cos(3 * eta),
            2 * np.sinh(xi) * np.sin(eta) + 2 / 3 * np.sinh(3 * xi) * np.sin(3 * eta),
            2 * np.cosh(2 * xi) * np.cos(2 * eta),
        ),
        mean_curvature=0.0,
        gaussian_curvature=gaussian_curvature,
        domain=((-0.5, 0.5), _CIRCLE),
        wrap=(False, True),
        reference="L. Henneberg, Ueber solche Minimalflaechen, welche eine vorgeschriebene ebene "
        "Curve zur geodaetischen Linie haben, dissertation, ETH Zuerich, 1875",
        singular_points=((0.0, -np.pi / 2), (0.0, 0.0), (0.0, np.pi / 2), (0.0, np.pi)),
    )


def hyperboloid(radius: float = 1.0, height: float = 1.0) -> Surface:
    """Hyperboloid of one sheet (a cosh eta cos xi, a cosh eta sin xi, c sinh eta).

    Parameters
    ----------
    radius : float, default 1
        a > 0, radius of the waist.
    height : float, default 1
        c > 0: (x**2 + y**2)/a**2 - z**2/c**2 = 1.

    Returns
    -------
    Surface
        Domain [-pi, pi] x [-1, 1], wraps in xi. Oriented away from the axis;
        H = c (s**2 - a**2)/(2 a s**3), K = -(c/s**2)**2, s = hypot(a sinh eta, c cosh eta).

    Raises
    ------
    ValueError
        If the radius or the height is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3 (surfaces of revolution).
    """
    _positive(radius=radius, height=height)

    def speed(eta: Array) -> Array:
        return np.hypot(radius * np.sinh(eta), height * np.cosh(eta))

    def mean_curvature(xi: Array, eta: Array) -> Array:
        s = speed(eta)
        return height * (s - radius) * (s + radius) / (2 * radius * s**3)

    return _surface(
        "hyperboloid",
        lambda xi, eta: _points(
            radius * np.cosh(eta) * np.cos(xi),
            radius * np.cosh(eta) * np.sin(xi),
            height * np.sinh(eta),
        ),
        mean_curvature=mean_curvature,
        gaussian_curvature=lambda xi, eta: -((height / speed(eta) ** 2) ** 2),
        domain=(_CIRCLE, (-1.0, 1.0)),
        wrap=(True, False),
        reference=f"{_DO_CARMO}, section 3-3",
    )


def _graph(name: str, jet: Callable[[Array, Array], tuple[ArrayLike, ...]], half_width: float) -> Surface:
    """Graph over a square, from `jet` = z and its derivatives z_x, z_y, z_xx, z_xy, z_yy."""

    def mean_curvature(x: Array, y: Array) -> Array:
        _, zx, zy, zxx, zxy, zyy = map(np.asarray, jet(x, y))
        bending = (1 + zy**2) * zxx - 2 * zx * zy * zxy + (1 + zx**2) * zyy
        return -bending / (2 * (1 + zx**2 + zy**2) ** 1.5)

    def gaussian_curvature(x: Array, y: Array) -> Array:
        _, zx, zy, zxx, zxy, zyy = map(np.asarray, jet(x, y))
        return (zxx * zyy - zxy**2) / (1 + zx**2 + zy**2) ** 2

    return _surface(
        name,
        lambda x, y: _points(x, y, jet(x, y)[0]),
        mean_curvature,
        gaussian_curvature,
        domain=((-half_width, half_width), (-half_width, half_width)),
        wrap=(False, False),
        reference=f"{_DO_CARMO}, section 3-3, example 5",
    )


def elliptic_paraboloid(a: float = 1.0, b: float = 1.0) -> Surface:
    """Elliptic paraboloid z = x**2/a**2 + y**2/b**2 with xi = x, eta = y.

    Over a square: the grid is not orthogonal.

    Parameters
    ----------
    a, b : float, default 1
        Semi-axes > 0 of the ellipse at z = 1.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Oriented upward, into the bowl: H < 0 and K > 0, by
        H = -((1 + z_y**2) z_xx - 2 z_x z_y z_xy + (1 + z_x**2) z_yy)/(2 W**3),
        K = (z_xx z_yy - z_xy**2)/W**4, W**2 = 1 + z_x**2 + z_y**2.

    Raises
    ------
    ValueError
        If a or b is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.
    """
    _positive(a=a, b=b)

    def jet(x: Array, y: Array) -> tuple[ArrayLike, ...]:
        z = (x / a) ** 2 + (y / b) ** 2
        return z, 2 * x / a**2, 2 * y / b**2, 2 / a**2, 0.0, 2 / b**2

    return _graph("elliptic_paraboloid", jet, half_width=1.0)


def hyperbolic_paraboloid(a: float = 1.0, b: float = 1.0) -> Surface:
    """Hyperbolic paraboloid z = x**2/a**2 - y**2/b**2 with xi = x, eta = y.

    Over a square: the grid is not orthogonal.

    Parameters
    ----------
    a, b : float, default 1
        Semi-axes > 0 of the hyperbolas at z = 1 and z = -1.

    Returns
    -------
    Surface
        Domain [-1, 1] x [-1, 1], open. Oriented upward; K < 0 and H changes sign (with a = b, on
        the diagonals). Formulas as in `elliptic_paraboloid`.

    Raises
    ------
    ValueError
        If a or b is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.
    """
    _positive(a=a, b=b)

    def jet(x: Array, y: Array) -> tuple[ArrayLike, ...]:
        z = (x / a) ** 2 - (y / b) ** 2
        return z, 2 * x / a**2, -2 * y / b**2, 2 / a**2, 0.0, -2 / b**2

    return _graph("hyperbolic_paraboloid", jet, half_width=1.0)


def tanh_sheet(height: float = 1.0) -> Surface:
    """Hyperbolic-tangent sheet z = h tanh(x) tanh(y) with xi = x, eta = y.

    Four plateaus at z = +-h joined by steep fronts: H and K both change sign, and the grid is not
    orthogonal.

    Parameters
    ----------
    height : float, default 1
        h > 0.

    Returns
    -------
    Surface
        Domain [-2, 2] x [-2, 2], open. Oriented upward; H = 0 on both axes. Formulas as in
        `elliptic_paraboloid`.

    Raises
    ------
    ValueError
        If the height is not positive and finite.

    References
    ----------
    do Carmo (1976), section 3-3, example 5.
    """
    _positive(height=height)

    def jet(x: Array, y: Array) -> tuple[ArrayLike, ...]:
        s, t = np.tanh(x), np.tanh(y)
        ds, dt = 1 - s**2, 1 - t**2
        derivatives = s * t, ds * t, s * dt, -2 * s * ds * t, ds * dt, -2 * s * t * dt
        return tuple(height * derivative for derivative in derivatives)

    return _graph("tanh_sheet", jet, half_width=2.0)


SURFACES: dict[str, Callable[..., Surface]] = {
    factory.__name__: factory
    for factory in (
        plane,
        cylinder,
        sphere,
        pillow_sphere,
        cubed_sphere,
        ellipsoid,
        cubed_ellipsoid,
        torus,
        catenoid,
        helicoid,
        enneper,
        henneberg,
        hyperboloid,
        elliptic_paraboloid,
        hyperbolic_paraboloid,
        tanh_sheet,
    )
}
