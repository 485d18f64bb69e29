"""Exact curvature of the parametrised surfaces, against sympy and against finite differences."""

import inspect
import itertools
from dataclasses import replace

import mpmath
import numpy as np
import pytest
import sympy
from scipy.spatial import cKDTree

from quadcurv import surfaces
from quadcurv.surfaces import SURFACES, Surface, as_surface
from quadcurv.surfaces.differentiation import Jet

EPS = np.finfo(np.float64).eps
U, V = sympy.symbols("u v", real=True)
HALF = sympy.Rational(1, 2)


def sin_twice(theta):
    return np.sin(2 * theta)


# The mappings once more, as formulas -------------------------------------------------------------


def scaled(factors, xyz):
    return tuple(sympy.nsimplify(f) * x for f, x in zip(factors, xyz, strict=True))


def ring(radius, angle, z):
    return radius * sympy.cos(angle), radius * sympy.sin(angle), z


def cube_panel(p):
    """Panel p of the equiangular cubed sphere."""
    a = sympy.tan(sympy.pi / 2 * (U - 2 * p - HALF))
    b = sympy.tan(sympy.pi / 2 * (V - HALF))
    directions = [(1, a, b), (-a, 1, b), (-1, -a, b), (a, -1, b), (-b, a, 1), (b, a, -1)]
    return tuple(x / sympy.sqrt(1 + a**2 + b**2) for x in directions[p])


def pillow_sector(lower, wide, sign):
    """Calhoun, Helzel and LeVeque's construction where d = sign x (wide) or d = sign y."""
    x, y = (-2 - U, V) if lower else (U, V)
    d = sign * (x if wide else y)
    D = d * (2 - d) / sympy.sqrt(2)
    across = D / d * (y if wide else x)
    along = sign * (D - sympy.sqrt(1 - D**2) + sympy.sqrt(1 - across**2))
    z = (-1 if lower else 1) * sympy.sqrt(1 - along**2 - across**2)
    return (along, across, z) if wide else (across, along, z)


def in_pillow_sector(lower, wide, sign):
    def contains(xi, eta):
        x = -2 - xi if lower else xi
        d, other = (x, eta) if wide else (eta, x)
        return (np.abs(x) < 1) & (sign * d > np.abs(other))

    return contains


def cyclide(a, d, c):
    b = sympy.sqrt(a**2 - c**2)
    s, t = sympy.cos(U), sympy.cos(V)
    numerators = (
        d * (c - a * s * t) + b**2 * s,
        b * sympy.sin(U) * (a - d * t),
        b * sympy.sin(V) * (c * s - d),
    )
    return tuple(x / (a - c * s * t) for x in numerators)


LON_LAT = ring(sympy.cos(V), U, sympy.sin(V))
AXES = {"a": 3.0, "b": 0.5, "c": 1.25}
SIN, COS, SINH, COSH = sympy.sin, sympy.cos, sympy.sinh, sympy.cosh


def case(name, arguments, mapping, offset=0, contains=lambda xi, eta: np.full(xi.shape, True)):
    """The formula of a surface; for one of its panels or sectors, where in xi and eta it holds."""
    return pytest.param(name, arguments, mapping, offset, contains, id=name)


SECTORS = list(itertools.product((False, True), (False, True), (-1, 1)))
CASES = [
    case("plane", {}, (U, V, 0 * U)),
    case("cylinder", {"radius": 0.75}, scaled((0.75, 0.75, 1), ring(1, U, V))),
    case(
        "cylinder",
        {"radius": 0.75, "f": sin_twice},
        scaled((0.75, 0.75, 1), ring(1, U, V + SIN(2 * U))),
    ),
    case("sphere", {"radius": 2.5, "latitude": 1.5}, scaled([2.5] * 3, LON_LAT)),
    *(
        case(
            "pillow_sphere",
            {"radius": 2.5},
            scaled([2.5] * 3, pillow_sector(*sector)),
            contains=in_pillow_sector(*sector),
        )
        for sector in SECTORS
    ),
    *(
        case("cubed_sphere", {"radius": 2.5}, scaled([2.5] * 3, cube_panel(p)), offset=2 * p)
        for p in range(6)
    ),
    case("ellipsoid", AXES, scaled(AXES.values(), LON_LAT)),
    *(case("cubed_ellipsoid", AXES, scaled(AXES.values(), cube_panel(p)), offset=2 * p) for p in range(6)),
    case(
        "torus",
        {"major": 3.0, "minor": 1.25},
        scaled([1.25] * 3, ring(sympy.Rational(12, 5) + COS(V), U, SIN(V))),
    ),
    case(
        "dupin_cyclide",
        {"major": 2.5, "minor": 1.25, "offset": 0.7},
        cyclide(sympy.Rational(5, 2), sympy.Rational(5, 4), sympy.Rational(7, 10)),
    ),
    case("catenoid", {"waist": 1.5}, scaled([1.5] * 3, ring(COSH(U), V, U))),
    case("helicoid", {"pitch": 3.0}, ring(U, V, 3 * V / (2 * sympy.pi))),
    case("enneper", {}, (U - U**3 / 3 + U * V**2, V - V**3 / 3 + V * U**2, U**2 - V**2)),
    case(
        "henneberg",
        {},
        (
            2 * SINH(U) * COS(V) - SINH(3 * U) * COS(3 * V) * 2 / 3,
            2 * SINH(U) * SIN(V) + SINH(3 * U) * SIN(3 * V) * 2 / 3,
            2 * COSH(2 * U) * COS(2 * V),
        ),
    ),
    case(
        "hyperboloid",
        {"radius": 0.5, "height": 1.5},
        scaled((0.5, 0.5, 1.5), ring(COSH(V), U, SINH(V))),
    ),
    case("elliptic_paraboloid", {"a": 0.5, "b": 1.25}, (U, V, 4 * U**2 + 16 * V**2 / 25)),
    case("hyperbolic_paraboloid", {"a": 0.5, "b": 1.25}, (U, V, 4 * U**2 - 16 * V**2 / 25)),
    case("tanh_sheet", {"height": 0.75}, (U, V, sympy.tanh(U) * sympy.tanh(V) * 3 / 4)),
]


def exact_fields(mapping, xi, eta):
    """Columns x, y, z, H, K from the fundamental forms of a symbolic mapping, in 60 digits."""
    X = sympy.Matrix(mapping)
    Xu, Xv = X.diff(U), X.diff(V)
    area = Xu.cross(Xv)
    E, F, G = Xu.dot(Xu), Xu.dot(Xv), Xv.dot(Xv)
    L, M, N = (second.dot(area) for second in (Xu.diff(U), Xu.diff(V), Xv.diff(V)))
    H = -(E * N - 2 * F * M + G * L) / (2 * area.dot(area) ** (3 * HALF))
    K = (L * N - M**2) / area.dot(area) ** 2
    fields = sympy.lambdify((U, V), [*X, H, K], modules="mpmath", cse=True)
    with mpmath.workdps(60):
        return np.array(
            [[float(x) for x in fields(mpmath.mpf(u), mpmath.mpf(v))] for u, v in zip(xi, eta, strict=True)]
        ).T


@pytest.mark.parametrize(("name", "arguments", "mapping", "offset", "contains"), CASES)
def test_mapping_and_curvature_are_the_symbolic_ones(name, arguments, mapping, offset, contains):
    surface = SURFACES[name](**arguments)
    corner, opposite = np.array(surface.domain).T
    xi, eta = np.random.default_rng(7).uniform(corner, opposite, (200, 2)).T
    xi += offset
    xi, eta = (parameter[contains(xi, eta)][:10] for parameter in (xi, eta))
    assert len(xi) == 10

    *xyz, H, K = exact_fields(mapping, xi, eta)
    points = surface.mapping(xi, eta)
    assert np.abs(points - np.stack(xyz, axis=-1)).max() <= 4 * EPS * np.abs(points).max()
    scale = np.abs(H).max() + np.sqrt(np.abs(K).max())
    np.testing.assert_allclose(surface.mean_curvature(xi, eta), H, 1e-12, 1e-15 * scale)
    np.testing.assert_allclose(surface.gaussian_curvature(xi, eta), K, 1e-12, 1e-15 * scale**2)


def test_every_surface_has_a_symbolic_case():
    assert {parameters.values[0] for parameters in CASES} == set(SURFACES)


# Finite differences of the implemented mapping: every entry of SURFACES ---------------------------


@pytest.fixture(params=SURFACES)
def surface(request):
    return SURFACES[request.param]()


def derivatives(mapping, xi, eta, h):
    """X_xi, X_eta, X_xixi, X_xieta, X_etaeta by fourth-order central differences."""
    steps = np.arange(-2, 3)
    first = np.array([1, -8, 0, 8, -1]) / 12
    second = np.array([-1, 16, -30, 16, -1]) / 12
    X = mapping(xi[:, None, None] + h[0] * steps[:, None], eta[:, None, None] + h[1] * steps)
    return (
        np.einsum("i,nik->nk", first, X[:, :, 2]) / h[0],
        np.einsum("j,njk->nk", first, X[:, 2]) / h[1],
        np.einsum("i,nik->nk", second, X[:, :, 2]) / h[0] ** 2,
        np.einsum("i,j,nijk->nk", first, first, X) / (h[0] * h[1]),
        np.einsum("j,njk->nk", second, X[:, 2]) / h[1] ** 2,
    )


def dot(x, y):
    return np.sum(x * y, axis=-1)


def seam_distance(xi, eta):
    """Distance of a parameter of the pillow sphere to the jumps of its derivatives."""
    x, y = (np.abs(np.abs((s + 1) % 4 - 2) - 1) for s in (xi, eta))
    return np.minimum(np.abs(x - y), 1 - np.maximum(x, y))


def smooth_samples(surface, h, n=300):
    """Random parameters in all panels, up to a tenth of the domain outside it."""
    corner, opposite = np.array(surface.domain).T
    margin = (opposite - corner) / 10
    samples = np.random.default_rng(3).uniform(corner - margin, opposite + margin, (n, 2))
    samples[:, 0] += np.resize(surface.panels, n)
    for singular in surface.singular_points:
        period = opposite - corner
        offset = (samples - singular + period / 2) % period - period / 2
        samples = samples[np.linalg.norm(offset, axis=1) > 0.1]
    if surface.name == "pillow_sphere":
        samples = samples[seam_distance(*samples.T) > 4 * max(h)]
    assert len(samples) > n / 2
    return samples.T


def test_curvature_follows_from_the_mapping(surface):
    h = 1e-3 * np.diff(surface.domain)[:, 0]
    xi, eta = smooth_samples(surface, h)
    Xu, Xv, Xuu, Xuv, Xvv = derivatives(surface.mapping, xi, eta, h)
    area = np.cross(Xu, Xv)
    J = np.linalg.norm(area, axis=-1)
    L, M, N = (dot(second, area) / J for second in (Xuu, Xuv, Xvv))
    H = -(dot(Xu, Xu) * N - 2 * dot(Xu, Xv) * M + dot(Xv, Xv) * L) / (2 * J**2)
    K = (L * N - M**2) / J**2

    scale = np.abs(H) + np.sqrt(np.abs(K)) + 1e-3
    assert (np.abs(surface.mean_curvature(xi, eta) - H) / scale).max() < 1e-6
    assert (np.abs(surface.gaussian_curvature(xi, eta) - K) / scale**2).max() < 1e-6


def test_curvature_is_that_of_its_own_mapping_differentiated(surface):
    own = Surface.from_mapping(surface.mapping, surface.domain, surface.wrap)
    xi, eta = smooth_samples(surface, np.array([1e-3, 1e-3]))
    np.testing.assert_array_equal(own.mapping(xi, eta), surface.mapping(xi, eta))
    H, K = surface.mean_curvature(xi, eta), surface.gaussian_curvature(xi, eta)
    scale = np.abs(H).max() + np.sqrt(np.abs(K).max())
    np.testing.assert_allclose(own.mean_curvature(xi, eta), H, rtol=1e-10, atol=1e-12 * scale)
    np.testing.assert_allclose(own.gaussian_curvature(xi, eta), K, rtol=1e-10, atol=1e-12 * scale**2)


def test_principal_curvatures_are_the_roots(surface):
    xi, eta = smooth_samples(surface, np.array([1e-3, 1e-3]))
    k1, k2 = surface.principal_curvatures(xi, eta)
    H, K = surface.mean_curvature(xi, eta), surface.gaussian_curvature(xi, eta)
    assert (k1 >= k2).all()
    np.testing.assert_allclose((k1 + k2) / 2, H, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(k1 * k2, K, rtol=1e-12, atol=1e-14)


def test_fields_are_float64_and_broadcast(surface):
    (xi0, xi1), (eta0, eta1) = surface.domain
    xi, eta = np.linspace(xi0, xi1, 4)[:, None], np.linspace(eta0, eta1, 3)
    fields = (surface.mapping, surface.mean_curvature, surface.gaussian_curvature)
    for field, tail in zip(fields, ((3,), (), ()), strict=True):
        values = field(xi, eta)
        assert values.dtype == np.float64
        assert values.shape == (4, 3, *tail)
        np.testing.assert_allclose(field(xi0, eta.tolist()), values[0], rtol=4 * EPS, atol=4 * EPS)
        assert np.shape(field(np.float32(0.25), 1)) == tail
        assert field(np.float32(0.25), 1).dtype == np.float64
        np.testing.assert_array_equal(field(np.float32(0.25), 1), field(0.25, 1.0))


def test_fields_are_finite_a_tenth_beyond_the_domain(surface):
    (xi0, xi1), (eta0, eta1) = surface.domain
    xi = np.linspace(1.1 * xi0 - 0.1 * xi1, 1.1 * xi1 - 0.1 * xi0, 25)
    eta = np.linspace(1.1 * eta0 - 0.1 * eta1, 1.1 * eta1 - 0.1 * eta0, 23)
    for panel in surface.panels:
        grid = np.meshgrid(xi + panel, eta, indexing="ij")
        assert np.isfinite(surface.mapping(*grid)).all()
        assert np.isfinite(surface.mean_curvature(*grid)).all()
        assert not np.isnan(surface.gaussian_curvature(*grid)).any()


def test_wrap_is_periodicity(surface):
    corner, opposite = np.array(surface.domain).T
    samples = np.random.default_rng(5).uniform(corner, opposite, (100, 2)).T
    for axis in (0, 1):
        shifted = samples.copy()
        shifted[axis] += (opposite - corner)[axis]
        points, copies = surface.mapping(*samples), surface.mapping(*shifted)
        gap = np.abs(copies - points).max() / np.abs(points).max()
        assert gap < 1e-14 if surface.wrap[axis] else gap > 0.1


def test_singular_points_are_singular(surface):
    for xi, eta in surface.singular_points:
        Xu, Xv, *_ = derivatives(surface.mapping, np.array([xi]), np.array([eta]), (1e-3, 1e-3))
        assert np.linalg.norm(np.cross(Xu, Xv)) < 1e-9


def test_registry():
    factories = {
        name
        for name in surfaces.__all__
        if inspect.isfunction(factory := getattr(surfaces, name))
        and name != "as_surface"
        and factory.__annotations__["return"] == "Surface"
    }
    assert set(SURFACES) == factories
    for name, factory in SURFACES.items():
        surface = factory()
        assert surface.name == name == factory.__name__
        assert surface.reference
        assert all(first < last for first, last in surface.domain)


# Single surfaces ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["sphere", "pillow_sphere", "cubed_sphere"])
def test_spheres_lie_on_the_sphere_and_look_outward(name):
    surface = SURFACES[name](radius=1.0)
    h = np.array([1e-3, 1e-3])
    xi, eta = smooth_samples(surface, h, n=4000)
    points = surface.mapping(xi, eta)
    assert np.abs(np.linalg.norm(points, axis=-1) - 1).max() <= 4 * EPS
    Xu, Xv, *_ = derivatives(surface.mapping, xi, eta, h)
    normal = np.cross(Xu, Xv)
    assert (dot(normal, points) / np.linalg.norm(normal, axis=-1)).min() > 1 - 1e-6


def test_pillow_sphere_keeps_its_digits_at_the_equator():
    surface = surfaces.pillow_sphere()
    d, y = 1 - 10.0 ** -np.arange(1, 15), 0.3
    _, _, z, *_ = exact_fields(pillow_sector(False, True, 1), d, np.full(d.shape, y))
    np.testing.assert_allclose(surface.mapping(d, y)[:, 2], z, rtol=8 * EPS)
    corners = surface.mapping([-1, -1, 1, 1], [-1, 1, -1, 1])
    np.testing.assert_allclose(np.abs(corners), [[0.5**0.5, 0.5**0.5, 0]] * 4, atol=EPS)
    assert surface.mapping(0, 0).tolist() == [0, 0, 1]
    assert surface.mapping(-2, 0).tolist() == [0, 0, -1]


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_pillow_sphere_is_folded(side):
    mapping = surfaces.pillow_sphere().mapping
    x = np.linspace(-3, 1, 41)
    np.testing.assert_allclose(mapping(x, side), mapping(-2 - x, side), atol=2 * EPS)
    beyond = np.linspace(0, 2, 9)[:, None]
    np.testing.assert_allclose(
        mapping(x, side * (1 + beyond)), mapping(-2 - x, side * (1 - beyond)), atol=4 * EPS
    )
    # continuous across all seams: neighbours stay as close as the parameters
    for step in (1e-9, -1e-9):
        assert np.abs(mapping(x + step, side) - mapping(x, side)).max() < 3e-9
        assert np.abs(mapping(x, side + step) - mapping(x, side)).max() < 3e-9
        assert np.abs(mapping(x + step, x / 3) - mapping(x, x / 3)).max() < 3e-9


@pytest.mark.parametrize(("name", "radius"), [("cubed_sphere", 1.0), ("cubed_ellipsoid", 2.0)])
def test_panels_share_their_edges(name, radius):
    surface = SURFACES[name]()
    n = 9
    t = np.linspace(0, 1, n)
    points = np.stack([surface.mapping(t[:, None] + panel, t) for panel in surface.panels])
    fields = np.stack([surface.mean_curvature(t[:, None] + panel, t) for panel in surface.panels])
    points, fields = points.reshape(-1, 3), fields.ravel()
    tree = cKDTree(points)
    neighbours = tree.query_ball_point(points, 4e-15 * radius)
    sizes = np.bincount([len(group) for group in neighbours])
    # corners belong to three panels, edges to two
    assert sizes.tolist() == [0, 6 * (n - 2) ** 2, 2 * 12 * (n - 2), 3 * 8]
    assert len(tree.query_pairs(1e-2)) == len(tree.query_pairs(4e-15 * radius))
    for group in neighbours:
        np.testing.assert_allclose(fields[group], fields[group[0]], rtol=1e-13)


def test_cubed_panels_continue_smoothly():
    mapping = surfaces.cubed_sphere().mapping
    t = np.linspace(-0.45, 1.45, 39)
    for panel in surfaces.cubed_sphere().panels:
        for line in (mapping(panel + t, 0.5), mapping(panel + 0.5, t)):
            # the middle lines of a panel are great circles at equal angles
            np.testing.assert_allclose(dot(line[1:], line[:-1]), np.cos(np.pi / 40), rtol=1e-13)


def test_cylinder_wraps_with_a_periodic_shift_only():
    assert surfaces.cylinder(f=sin_twice).wrap == (True, False)
    helical = surfaces.cylinder(radius=2.0, f=lambda theta: theta / 3)
    assert helical.wrap == (False, False)
    np.testing.assert_allclose(helical.mapping(np.pi, 1.0), [-2, 0, 1 + np.pi / 3], atol=4 * EPS)


def cyclide_normal(xi, eta, a=2.0, c=0.5):
    """From the centre of the ball of radius d - c cos xi, on the ellipse of the tube's centres."""
    centres = np.stack((a * np.cos(xi), np.sqrt(a**2 - c**2) * np.sin(xi), 0 * xi), axis=-1)
    return np.moveaxis(surfaces.dupin_cyclide().mapping(xi, eta) - centres, -1, 0)


NORMALS = {
    "plane": lambda xi, eta: (0 * xi, 0, 1),
    "cylinder": lambda xi, eta: (np.cos(xi), np.sin(xi), 0),
    "torus": lambda xi, eta: (np.cos(xi) * np.cos(eta), np.sin(xi) * np.cos(eta), np.sin(eta)),
    "catenoid": lambda xi, eta: (-np.cos(eta), -np.sin(eta), np.sinh(xi)),
    "helicoid": lambda xi, eta: (np.sin(eta), -np.cos(eta), xi),
    "enneper": lambda xi, eta: (-2 * xi, 2 * eta, 1 - xi**2 - eta**2),
    "dupin_cyclide": lambda xi, eta: cyclide_normal(xi, eta),
    "henneberg": lambda xi, eta: (-np.cos(eta), np.sin(eta), -np.sinh(xi)),
    "hyperboloid": lambda xi, eta: (np.cos(xi), np.sin(xi), -np.tanh(eta)),
    "elliptic_paraboloid": lambda xi, eta: (-2 * xi, -2 * eta, 1),
    "hyperbolic_paraboloid": lambda xi, eta: (-2 * xi, 2 * eta, 1),
}


@pytest.mark.parametrize("name", NORMALS)
def test_orientation_is_the_documented_one(name):
    surface = SURFACES[name]()
    h = np.array([1e-3, 1e-3])
    xi, eta = smooth_samples(surface, h)
    Xu, Xv, *_ = derivatives(surface.mapping, xi, eta, h)
    area = np.cross(Xu, Xv)
    expected = np.stack(np.broadcast_arrays(*NORMALS[name](xi, eta)), axis=-1)
    np.testing.assert_allclose(
        area / np.linalg.norm(area, axis=-1, keepdims=True),
        expected / np.linalg.norm(expected, axis=-1, keepdims=True),
        atol=1e-8,
    )


def test_henneberg_surface_is_one_sided_and_singular():
    surface = surfaces.henneberg()
    xi, eta = np.random.default_rng(2).uniform((-0.6, -4), (0.6, 4), (50, 2)).T
    np.testing.assert_allclose(surface.mapping(-xi, eta + np.pi), surface.mapping(xi, eta), atol=32 * EPS)
    assert len(surface.singular_points) == 4
    assert surface.gaussian_curvature(0.0, 0.0) == -np.inf
    assert all(surface.gaussian_curvature(*point) < -1e20 for point in surface.singular_points)
    regular = replace(surface, domain=((0.25, 0.75), surface.domain[1]))
    assert regular.gaussian_curvature(*np.meshgrid((0.25, 0.75), np.linspace(-3, 3))).min() > -0.3


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize(
    ("name", "parameter"),
    [
        (name, parameter)
        for name, factory in SURFACES.items()
        for parameter in inspect.signature(factory).parameters
        if parameter not in ("f", "latitude")
    ],
)
def test_parameters_must_be_positive_and_finite(name, parameter, bad):
    with pytest.raises(ValueError, match=f"^{parameter} must be positive and finite, got "):
        SURFACES[name](**{parameter: bad})


@pytest.mark.parametrize("latitude", [0.0, -0.5, np.pi / 2, 2.0, np.nan])
@pytest.mark.parametrize("name", ["sphere", "ellipsoid"])
def test_latitude_must_exclude_the_poles(name, latitude):
    with pytest.raises(ValueError, match=r"latitude must lie between 0 and pi/2 .* got "):
        SURFACES[name](latitude=latitude)


@pytest.mark.parametrize("minor", [2.0, 3.0])
def test_torus_must_have_a_hole(minor):
    with pytest.raises(ValueError, match=r"^minor must be less than major, got major=2\.0"):
        surfaces.torus(major=2.0, minor=minor)


@pytest.mark.parametrize(("major", "minor", "offset"), [(2.0, 1.0, 1.0), (2.0, 2.0, 0.5), (2.0, 1.0, 3.0)])
def test_cyclide_must_be_a_ring(major, minor, offset):
    with pytest.raises(ValueError, match=r"^offset < minor < major must hold, got offset="):
        surfaces.dupin_cyclide(major, minor, offset)


def test_cyclide_without_offset_is_the_torus():
    xi, eta = np.random.default_rng(1).uniform(-np.pi, np.pi, (2, 50))
    cyclide, torus = surfaces.dupin_cyclide(3.0, 1.25, 1e-9), surfaces.torus(3.0, 1.25)
    np.testing.assert_allclose(cyclide.mapping(xi, eta), torus.mapping(xi, eta + np.pi), atol=1e-8)
    np.testing.assert_allclose(cyclide.mean_curvature(xi, eta), torus.mean_curvature(xi, eta + np.pi), 1e-8)


def test_principal_curvatures_of_a_cyclide_and_of_umbilics():
    xi, eta = np.random.default_rng(1).uniform(-np.pi, np.pi, (2, 50))
    k1, k2 = surfaces.dupin_cyclide(2.0, 1.0, 0.5).principal_curvatures(xi, eta)
    np.testing.assert_allclose(k1, 1 / (1 - 0.5 * np.cos(xi)), rtol=1e-14)
    np.testing.assert_allclose(k2, np.cos(eta) / (np.cos(eta) - 2), rtol=1e-14, atol=1e-15)
    for radius in np.linspace(0.3, 3, 40):
        k1, k2 = surfaces.sphere(radius).principal_curvatures(xi, eta)
        assert (k1 == 1 / radius).all()
        assert (k2 == 1 / radius).all()


def test_surface_by_name():
    assert as_surface("torus").name == "torus"
    surface = surfaces.sphere(2.0)
    assert as_surface(surface) is surface
    with pytest.raises(ValueError, match=r"^surface: 'donut' is not one of plane, .*, tanh_sheet$"):
        as_surface("donut")
    with pytest.raises(TypeError, match=r"expected a name or a Surface .* got int"):
        as_surface(3)


# A mapping of one's own ---------------------------------------------------------------------------

SQUARE = ((-1.0, 1.0), (-1.0, 1.0))
# Every function with a derivative, on arguments 0.2 < x < 0.8 and 1.2 < y < 1.8.
ONE = [
    *("positive", "negative", "deg2rad", "radians", "rad2deg", "degrees", "absolute", "fabs", "square"),
    *("reciprocal", "sqrt", "cbrt", "exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "sin", "cos"),
    *("tan", "arcsin", "arccos", "arctan", "sinh", "cosh", "tanh", "arcsinh", "arctanh"),
]
TWO = ["add", "subtract", "multiply", "divide", "power", "float_power", "arctan2", "hypot", "maximum"]
TWO += ["minimum", "copysign", "remainder"]
FUNCTIONS = {
    **{name: lambda u, v, name=name: getattr(np, name)(u * v / 2) for name in ONE},
    "arccosh": lambda u, v: np.arccosh(u + v),
    **{name: lambda u, v, name=name: getattr(np, name)(u + v**2, 3 * u * v) for name in TWO},
    "power of a constant": lambda u, v: 2 ** (u * v),
    "constant power": lambda u, v: (u - v) ** 3 + (u * v) ** -1.5 + (u - v) ** 1 + (u - v) ** 0,
    "number over": lambda u, v: 1 / (u - 3 * v) - 2,
    "where": lambda u, v: np.where(u < 0.5, np.sin(u * v), u**2 / v),
    "remainder of a number": lambda u, v: (7 * u * v) % 2.5,
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_derivatives_of_every_function(name):
    f = FUNCTIONS[name]
    u, v = np.random.default_rng(4).uniform((0.2, 1.2), (0.8, 1.8), (30, 2)).T
    one, zero = np.ones(30), np.zeros(30)
    jet = f(Jet(u, (one, zero), (zero,) * 3), Jet(v, (zero, one), (zero,) * 3))
    h = 1e-3
    differences = derivatives(lambda x, y: f(x, y)[..., None], u, v, (h, h))
    np.testing.assert_allclose(jet.value, f(u, v), rtol=1e-13)
    found = np.stack(np.broadcast_arrays(*jet.first, *jet.second, u)[:5])
    expected = np.stack(differences)[..., 0]
    # differences that step over a jump say nothing: at most a few of the points
    close = np.isclose(found, expected, rtol=1e-6, atol=1e-7 * np.abs(found).max()).all(axis=0)
    assert close.mean() > (0.85 if "where" in name or "remainder" in name else 0.99)


def test_every_rule_is_tested():
    from quadcurv.surfaces import differentiation

    rules = {f.__name__ for f in (*differentiation._RULES, *differentiation._COMPOSED)}
    assert rules == {*ONE, *TWO, "arccosh"}


@pytest.mark.parametrize(
    "f",
    [
        lambda u, v: (u, v, u**2 - v),
        lambda u, v: [u, v, u**2 - v],
        lambda u, v: np.array([u, v, u**2 - v]),
        lambda u, v: np.stack((u, v, u**2 - v), axis=-1),
        lambda u, v: np.stack(np.broadcast_arrays(u, v, u**2 - v), axis=-1),
        lambda u, v: (u + np.zeros_like(u), v * np.ones_like(u), np.where(u > 5, 1.0, u**2 - v)),
    ],
)
def test_a_mapping_in_one_line(f):
    surface = Surface.from_mapping(f, SQUARE, name="trough")
    assert (surface.name, surface.wrap, surface.domain) == ("trough", (False, False), SQUARE)
    u, v = np.random.default_rng(4).uniform(-1, 1, (2, 3))  # as many as components
    assert surface.mapping(u, v).shape == (3, 3)
    np.testing.assert_allclose(surface.mapping(u, v)[:, 2], u**2 - v)
    np.testing.assert_allclose(surface.mean_curvature(u, v), -2 / (1 + (4 * u**2 + 1)) ** 1.5, rtol=1e-14)
    assert np.abs(surface.gaussian_curvature(u, v)).max() < 1e-15
    mesh, xi, eta = surface.sample((6, 5), "staggered")
    assert np.isfinite(mesh.stencils().points).all()
    assert surface.mean_curvature(xi[:, :1], eta[:1]).shape == (6, 5)


def test_a_constant_component_and_a_singular_point():
    cone = Surface.from_mapping(lambda u, v: (u * np.cos(v), u * np.sin(v), 0.0), SQUARE)
    assert np.isnan(cone.mean_curvature(0.0, 0.3))
    assert cone.mean_curvature(0.5, 0.3) == 0
    point = Surface.from_mapping(lambda u, v: (1.0, 2.0, 3.0), SQUARE)
    assert np.isnan(point.gaussian_curvature([0.1, 0.2], 0.3)).all()


@pytest.mark.parametrize(
    ("f", "message"),
    [
        (lambda u, v: (u, v, np.sinc(u)), r"^np\.sinc has no derivative here; a mapping may use .*cosh"),
        (lambda u, v: (u, v, np.spacing(u)), r"^np\.spacing has no derivative here"),
        (lambda u, v: (u, v, np.clip(u, 0, 1)), r"^np\.clip has no derivative here"),
        (lambda u, v: (u, v, np.einsum("...,...->...", u, v)), r"^np\.einsum has no derivative here"),
        (lambda u, v: (u, v, u @ v), "matmul"),
        (lambda u, v: (u, v, np.multiply(u, v, out=None, where=True)), r"^np\.multiply\("),
    ],
)
def test_a_function_without_derivative_is_named(f, message):
    with pytest.raises((TypeError, ValueError), match=message):
        Surface.from_mapping(f, SQUARE)


def test_scalar_code_is_explained():
    import math

    with pytest.raises(TypeError, match=r"np\.sin where math\.sin stands|only .* arrays can be converted"):
        Surface.from_mapping(lambda u, v: (u, v, math.sin(u)), SQUARE)
    one, zero = np.ones(()), np.zeros(())
    with pytest.raises(TypeError, match=r"write np\.sin where math\.sin stands"):
        math.sin(Jet(one, (one, zero), (zero,) * 3))
    with pytest.raises(TypeError, match=r"write np\.where\(condition, a, b\) where `if` stands"):
        bool(Jet(one, (one, zero), (zero,) * 3))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((lambda u, v: (u, v), SQUARE), "^f: a position has three components .* got 2"),
        ((lambda u, v: (u, v, 1 / u), SQUARE), r"^f: not finite at the middle of the domain, \(0\.0, 0\.0\)"),
        ((lambda u, v: (u, v, u), ((0, 1), (2, 2))), "^domain: expected two increasing, finite intervals"),
        ((lambda u, v: (u, v, u), ((0, np.inf), (2, 3))), "^domain: expected two increasing"),
        ((lambda u, v: (u, v, u), (0, 1)), r"^domain: expected \(\(u0, u1\), \(v0, v1\)\), got"),
        ((lambda u, v: (u, np.cos(np.pi * v), u), SQUARE, (True, True)), "^wrap: f is not periodic in u"),
        ((lambda u, v: (np.cos(np.pi * u), v, v**3), SQUARE, (True, True)), "^wrap: f is not periodic in v"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero")
def test_bad_mappings_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Surface.from_mapping(*arguments)
