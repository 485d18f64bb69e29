import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from quadcurv import curves
from quadcurv.curves import Curve, curvature, curvature_normal, frenet_frame, staggered, torsion
from quadcurv.refinement import fitted_rate

SIZES = [64, 128, 256, 512]


def evenly(curve: Curve, n: int) -> np.ndarray:
    return np.linspace(*curve.domain, n + curve.closed)[:n]


def unevenly(curve: Curve, n: int, part: float = 0.5) -> np.ndarray:
    """Steps that vary by up to the given part, at random."""
    steps = 1 + part * np.random.default_rng(n).uniform(-1, 1, n - 1 + curve.closed)
    t = np.append(0, np.cumsum(steps)) / steps.sum()
    return curve.domain[0] + np.ptp(curve.domain) * t[:n]


def smoothly(curve: Curve, n: int) -> np.ndarray:
    """Steps that vary smoothly, by a factor of 4."""
    u = (evenly(curve, n) - curve.domain[0]) / np.ptp(curve.domain)
    return curve.domain[0] + np.ptp(curve.domain) * (u + 0.1 * np.sin(2 * np.pi * u))


def dual_of(curve: Curve, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return staggered(curve.mapping, t, np.ptp(curve.domain) if curve.closed else None)


def twisted_cubic() -> Curve:
    """(t, t^2, t^3): curvature and torsion vary, its speed does too."""
    return Curve(
        mapping=lambda t: np.column_stack([t, t**2, t**3]),
        curvature=lambda t: 2 * np.sqrt(9 * t**4 + 9 * t**2 + 1) / (9 * t**4 + 4 * t**2 + 1) ** 1.5,
        torsion=lambda t: 3 / (9 * t**4 + 9 * t**2 + 1),
        domain=(0.2, 1.0),
        closed=False,
        reference="by hand",
    )


def arc() -> Curve:
    whole = curves.ellipse()
    return Curve(whole.mapping, whole.curvature, whole.torsion, (np.pi / 6, 5 * np.pi / 6), False, "")


def literal_curvature(p: np.ndarray, d: np.ndarray) -> np.ndarray:
    """(2.32), point by point, for a closed curve with d[j] after p[j]."""
    n = len(p)
    kappa = np.empty(n)
    for j in range(n):
        after, before = p[(j + 1) % n] - p[j], p[j] - p[j - 1]
        jump = after / np.sqrt(after @ after) - before / np.sqrt(before @ before)
        cell = d[j] - d[j - 1]
        kappa[j] = np.sqrt(jump @ jump) / np.sqrt(cell @ cell)
    return kappa


# ---------------------------------------------------------------- the formula


def test_literal_formula() -> None:
    curve = curves.ellipse()
    for t in (evenly(curve, 37), unevenly(curve, 37)):
        points, dual = dual_of(curve, t)
        np.testing.assert_allclose(curvature(points, True, dual), literal_curvature(points, dual), rtol=1e-13)


def test_curvature_is_the_length_of_the_normal() -> None:
    points, dual = dual_of(curves.helix(), evenly(curves.helix(), 50))
    for edge in (None, dual):
        H = curvature_normal(points, dual=edge)
        assert H.shape == (50, 3)
        np.testing.assert_allclose(curvature(points, dual=edge), np.linalg.norm(H, axis=1), rtol=1e-14)
    kappa = np.linalg.norm(curvature_normal(points), axis=1, keepdims=True)
    np.testing.assert_allclose(frenet_frame(points).normal, curvature_normal(points) / kappa, atol=1e-12)


def test_dual_points_matter_inside_only() -> None:
    points, dual = dual_of(curves.helix(), unevenly(curves.helix(), 50))
    with_dual, without = curvature(points, dual=dual), curvature(points)
    assert with_dual[[0, -1]].tolist() == without[[0, -1]].tolist()
    assert (with_dual[1:-1] != without[1:-1]).all()


# ---------------------------------------------------------------- exact cases


@pytest.mark.parametrize("n", [6, 16, 64, 256])
@pytest.mark.parametrize("sampling", [evenly, unevenly])
def test_line(n, sampling) -> None:
    curve = curves.line((1.0, -2.0, 0.5), (2.0, 3.0, -1.0))
    points = curve.mapping(sampling(curve, n))
    step = np.linalg.norm(np.diff(points, axis=0), axis=1).min()
    assert (curvature(points) * step).max() < 1e-12
    frame = frenet_frame(points)
    assert np.isnan(frame.normal).all()
    assert np.isnan(frame.binormal).all()
    assert np.isnan(torsion(points)).all()
    direction = np.array([2.0, 3.0, -1.0]) / np.sqrt(14)
    np.testing.assert_allclose(frame.tangent, np.tile(direction, (n, 1)), atol=1e-11)


def test_line_along_an_axis_has_no_rounding() -> None:
    points = np.column_stack([np.cumsum(np.arange(1, 30)), np.full(29, 7)])
    assert not curvature(points).any()


@pytest.mark.parametrize("n", [3, 4, 16, 64, 256])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 70.0])
def test_circle(n, radius) -> None:
    points, dual = dual_of(curves.circle(radius), evenly(curves.circle(), n))
    for edge in (None, dual):
        assert np.abs(curvature(points, True, edge) * radius - 1).max() < 1e-12
        H = curvature_normal(points, True, edge)
        np.testing.assert_allclose(H * radius, -points / radius, atol=1e-12)


@pytest.mark.parametrize("n", [16, 64, 128])
def test_circle_with_uneven_cells(n) -> None:
    # (2.48), and with it (2.49), needs dual points halfway between primal ones ...
    curve, t = curves.circle(), unevenly(curves.circle(), n)
    points, dual = dual_of(curve, t)
    assert np.abs(curvature(points, True, dual) - 1).max() < 1e-12
    # ... and fails with primal points halfway between dual ones,
    assert np.abs(curvature(dual, True, np.roll(points, -1, axis=0)) - 1).max() > 0.3
    # save where the width of the cells grows linearly.
    edges = np.linspace(0.1, 1.5, n + 1) ** 2
    middle = curve.mapping((edges[1:] + edges[:-1]) / 2)
    kappa = curvature(middle, dual=curve.mapping(edges[1:-1]))
    assert np.abs(kappa[1:-1] - 1).max() < 1e-10
    # Points alone are of second order.
    assert np.abs(curvature(points, True) - 1).max() < 1.5 / n**2


# ---------------------------------------------------------------- convergence


def check(errors: list[float], rate: float, bound: float, tolerance: float, sizes=SIZES) -> None:
    assert fitted_rate(sizes, errors) == pytest.approx(rate, abs=tolerance)
    assert errors[-1] < bound


@pytest.mark.parametrize(("primal_dual", "bound"), [(True, 1.3e-4), (False, 2.5e-4)])
def test_ellipse(primal_dual, bound) -> None:
    curve, errors = curves.ellipse(), []
    for n in SIZES:
        t = evenly(curve, n)
        points, dual = dual_of(curve, t)
        kappa = curvature(points, True, dual if primal_dual else None)
        errors.append(np.abs(kappa - curve.curvature(t)).max())
    check(errors, 2.0, bound, 0.02)


def test_euler_spiral() -> None:
    curve, sizes, inside, end = curves.euler_spiral(), [1024, 2048, 4096, 8192], [], []
    for n in sizes:
        t = evenly(curve, n)
        points, dual = dual_of(curve, t)
        inside.append(np.abs(curvature(points, dual=dual) - curve.curvature(t))[1:-1].max())
    check(inside, 4.0, 2e-9, 0.1, sizes)
    sizes = [16384, 32768, 65536]  # the ends lie where the curve turns the most
    for n in sizes:
        t = evenly(curve, n)
        error = np.abs(curvature(curve.mapping(t)) - curve.curvature(t))
        end.append(error[[0, -1]].max())
        assert error[1:-1].max() < 5e-9
    check(end, 4.0, 1e-3, 0.3, sizes)


CURVED = {
    "helix": (curves.helix(), 8.2e-6, 6.2e-6),
    "left-handed helix": (curves.helix(2.0, -1.0), 4.2e-6, 3.1e-6),
    "twisted cubic": (twisted_cubic(), 5.7e-6, 1.2e-5),
}


@pytest.mark.parametrize("name", CURVED)
def test_space_curves(name) -> None:
    curve, kappa_bound, tau_bound = CURVED[name]
    kappa_errors, tau_errors = [], []
    for n in SIZES:
        t = evenly(curve, n)
        points = curve.mapping(t)
        kappa_errors.append(np.abs(curvature(points) - curve.curvature(t))[1:-1].max())
        tau_errors.append(np.abs(torsion(points) - curve.torsion(t))[2:-2].max())
    check(kappa_errors, 2.0, kappa_bound, 0.03)
    check(tau_errors, 2.0, tau_bound, 0.15)


def test_sign_of_torsion() -> None:
    t = evenly(curves.helix(), 100)
    assert (torsion(curves.helix(1.0, 0.5).mapping(t)) > 0.39).all()
    assert (torsion(curves.helix(1.0, -0.5).mapping(t)) < -0.39).all()


@pytest.mark.parametrize("curve", [arc(), curves.helix(), twisted_cubic()], ids=["arc", "helix", "cubic"])
def test_open_ends(curve) -> None:
    sizes = [256, 512, 1024]
    quantities = [(curvature, curve.curvature, 1.2, 1.85)]
    if curve.mapping(np.zeros(1)).shape[1] == 3:
        quantities.append((torsion, curve.torsion, 1.8, 1.7))
    for found, exact, factor, rate in quantities:
        end = []
        for n in sizes:
            t = evenly(curve, n)
            error = np.abs(found(curve.mapping(t)) - exact(t))
            end.append(error[[0, 1, -2, -1]].max())
            assert end[-1] < factor * error[2:-2].max()
        assert fitted_rate(sizes, end) > rate


def test_smooth_uneven_spacing_keeps_second_order() -> None:
    for curve, kappa_bound, tau_bound in (
        (curves.ellipse(), 7e-4, None),
        (curves.helix(), 2.2e-5, 6.6e-5),
        (twisted_cubic(), 1.5e-5, 4.6e-5),
    ):
        sizes, errors = [256, 512, 1024], {"polyline": [], "dual": [], "torsion": []}
        for n in sizes:
            t = smoothly(curve, n)
            points, dual = dual_of(curve, t)
            inside = slice(None) if curve.closed else slice(2, -2)
            for name, found in (
                ("polyline", curvature(points, curve.closed) - curve.curvature(t)),
                ("dual", curvature(points, curve.closed, dual) - curve.curvature(t)),
                ("torsion", torsion(points, curve.closed) - curve.torsion(t)),
            ):
                errors[name].append(np.abs(found[inside]).max())
        assert errors["polyline"][1] < kappa_bound
        assert errors["dual"][1] < kappa_bound
        for name in errors if tau_bound else ("polyline", "dual"):
            assert fitted_rate(sizes, errors[name]) == pytest.approx(2.0, abs=0.1)
        assert errors["torsion"][1] < (tau_bound or 1e-12)


def test_jumping_spacing_costs_an_order_and_no_more() -> None:
    sizes = [64, 256, 1024, 4096]
    curve, kappa_errors, tau_errors = twisted_cubic(), [], []
    for n in sizes:
        t = unevenly(curve, n)
        points = curve.mapping(t)
        kappa_errors.append(np.abs(curvature(points) - curve.curvature(t)).max())
        tau_errors.append(np.abs(torsion(points) - curve.torsion(t)).max())
    check(kappa_errors, 1.0, 1e-3, 0.15, sizes)
    check(tau_errors, 1.0, 2e-3, 0.25, sizes)


def test_documented_cost_of_jumping_spacing() -> None:
    curve = curves.ellipse()
    relative = {}
    for sampling in (evenly, unevenly):
        t = sampling(curve, 256)
        relative[sampling] = np.abs(curvature(curve.mapping(t), True) / curve.curvature(t) - 1).max()
    assert relative[evenly] == pytest.approx(8e-4, rel=0.1)
    assert relative[unevenly] == pytest.approx(2e-2, rel=0.2)


def printed_torsion(points, step) -> np.ndarray:
    """(2.54) with a step of its own, (2.55) and (2.56), as the mean of a point's two edges: unsigned."""
    H = curvature_normal(points)
    kappa = np.linalg.norm(H, axis=1, keepdims=True)
    edge = np.diff(points, axis=0)
    spacing = np.linalg.norm(edge, axis=1, keepdims=True)
    tau_b = np.diff(H / kappa, axis=0) / step(spacing) + (kappa[1:] + kappa[:-1]) / 2 * edge / spacing
    tau = np.linalg.norm(tau_b, axis=1)
    return (tau[1:] + tau[:-1]) / 2


def test_torsion_is_the_printed_one_corrected_on_even_spacing() -> None:
    # (2.54) with the primal spacing, (2.55) and (2.56), on the inner edges: unsigned.
    for n in SIZES:
        points = curves.helix(1.0, -0.5).mapping(evenly(curves.helix(), n))
        printed = printed_torsion(points, lambda spacing: spacing)
        assert np.abs(printed + torsion(points)[1:-1])[1:-1].max() < 1e-13


def test_where_the_printed_torsion_wins_and_where_it_fails() -> None:
    curve, found = twisted_cubic(), {}
    for sampling in (evenly, unevenly):
        t = sampling(curve, 256)
        points = curve.mapping(t)
        printed = printed_torsion(points, lambda spacing: spacing) - curve.torsion(t)[1:-1]
        found[sampling] = [
            np.abs(e).max() for e in (printed[1:-1], (torsion(points) - curve.torsion(t))[2:-2])
        ]
    np.testing.assert_allclose(found[evenly], [1.9e-5, 4.4e-5], rtol=0.05)
    assert found[unevenly][0] > 0.5
    assert found[unevenly][1] < 8e-3
    t = unevenly(curves.helix(), 256)
    assert np.abs(torsion(curves.helix().mapping(t)) - 0.4)[2:-2].max() < 7e-5


# ---------------------------------------------------------------- the frame


def test_frame_of_a_helix() -> None:
    errors = []
    for n in SIZES:
        t = evenly(curves.helix(), n)
        frame = frenet_frame(curves.helix().mapping(t))
        for a in range(3):
            for b in range(3):
                dots = np.einsum("ij,ij->i", frame[a], frame[b])
                np.testing.assert_allclose(dots, a == b, atol=1e-11)
        tangent = np.column_stack([-np.sin(t), np.cos(t), np.full(n, 0.5)]) / np.sqrt(1.25)
        normal = -np.column_stack([np.cos(t), np.sin(t), np.zeros(n)])
        exact = tangent, normal, np.cross(tangent, normal)
        errors.append(max(np.abs(f - e).max() for f, e in zip(frame, exact, strict=True)))
    assert fitted_rate(SIZES, errors) > 1.9
    assert errors[-1] < 1e-4


def test_signed_curvature_in_the_plane() -> None:
    x = np.linspace(0.1, 2 * np.pi - 0.1, 400)
    points = np.column_stack([x, np.sin(x)])  # turns right, then left
    frame = frenet_frame(points)
    assert [f.shape for f in frame] == [(400, 2), (400, 2), (400, 3)]
    signed = curvature(points) * frame.binormal[:, 2]
    np.testing.assert_allclose(signed, -np.sin(x) / (1 + np.cos(x) ** 2) ** 1.5, atol=1e-4)


def test_torsion_of_plane_curves() -> None:
    points = curves.ellipse().mapping(evenly(curves.ellipse(), 40))
    assert not torsion(points, True).any()
    tilt = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    assert np.abs(torsion(np.pad(points, ((0, 0), (0, 1))) @ tilt, True)).max() < 1e-12


# ---------------------------------------------------------------- zero curvature


def test_point_of_inflection() -> None:
    x = np.arange(-10, 11) / 8
    points = np.column_stack([x, x**3, np.zeros(21)])
    kappa, frame, tau = curvature(points), frenet_frame(points), torsion(points)
    assert kappa[10] == 0
    assert np.isfinite(kappa).all()
    assert np.isfinite(frame.tangent).all()
    assert np.flatnonzero(np.isnan(frame.normal).any(axis=1)).tolist() == [10]
    assert np.flatnonzero(np.isnan(frame.binormal).any(axis=1)).tolist() == [10]
    assert np.flatnonzero(np.isnan(tau)).tolist() == [9, 10, 11]
    assert not np.nan_to_num(tau).any()


def test_torsion_across_an_inflection() -> None:
    # (t, t^3, t^4) has torsion 2 where its curvature vanishes and its normal turns over.
    away = []
    for n in SIZES:
        t = np.linspace(-0.1, 0.1, n)  # n is even: no point at the inflection
        d1 = np.column_stack([np.ones(n), 3 * t**2, 4 * t**3])
        d2 = np.column_stack([np.zeros(n), 6 * t, 12 * t**2])
        d3 = np.column_stack([np.zeros(n), np.full(n, 6), 24 * t])
        normal = np.cross(d1, d2)
        exact = np.einsum("ij,ij->i", normal, d3) / np.einsum("ij,ij->i", normal, normal)
        tau = torsion(np.column_stack([t, t**3, t**4]))
        assert np.abs(tau - exact).max() < 0.5  # of the right sign and size beside it
        away.append(np.abs(tau - exact)[np.abs(t) > 0.01].max())
    check(away, 2.0, 5e-4, 0.1)


def test_straight_piece_has_nan_where_the_direction_is_rounding() -> None:
    # A straight run into a helix, tangent to it: NaN on the run alone.
    t = np.arange(0, 41) * 0.1
    start = np.column_stack([np.ones(20), 0.1 * np.arange(-20, 0), 0.05 * np.arange(-20, 0)])
    points = np.vstack([start, curves.helix().mapping(t)])
    assert np.isfinite(curvature(points)).all()
    undefined = np.isnan(frenet_frame(points).normal).any(axis=1)
    assert np.flatnonzero(undefined).tolist() == list(range(20))
    assert np.flatnonzero(np.isnan(torsion(points))).tolist() == list(range(21))


def test_fold() -> None:
    x = 7.0 - np.abs(np.arange(-7, 8))
    points = np.column_stack([x, np.zeros(15)])
    assert curvature(points).tolist() == [0] * 7 + [2] + [0] * 7
    for line in (points, points @ [[0.6, 0.8], [-0.8, 0.6]] / 3 + 0.1):
        assert np.flatnonzero(np.isnan(frenet_frame(line).tangent).any(axis=1)).tolist() == [7]


# ---------------------------------------------------------------- invariants

SPACE_CURVES = st.tuples(
    st.integers(8, 30), st.floats(0.3, 2.0), st.floats(-2.0, 2.0), st.integers(0, 2**31), st.booleans()
)


def random_curve(n, a, b, seed, closed) -> np.ndarray:
    """Smooth space curve of moderate curvature."""
    t = 2 * np.pi * np.arange(n) / n
    if not closed:
        t = t / 2
    wiggle = 0.1 * np.random.default_rng(seed).normal(size=3)
    return np.column_stack(
        [np.cos(t) + wiggle[0] * np.cos(2 * t), a * np.sin(t), b * np.sin(2 * t + wiggle[1]) + wiggle[2] * t]
    )


def random_rotation(seed) -> np.ndarray:
    q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return q * np.sign(np.linalg.det(q))


@settings(max_examples=40, deadline=None)
@given(SPACE_CURVES)
def test_rigid_motion(case) -> None:
    *_, seed, closed = case
    points, R = random_curve(*case), random_rotation(seed)
    moved = points @ R.T + [3.0, -2.0, 5.0]
    H, frame = curvature_normal(points, closed), frenet_frame(points, closed)
    scale = curvature(points, closed).max()
    np.testing.assert_allclose(curvature_normal(moved, closed), H @ R.T, atol=1e-8 * scale)
    for f, g in zip(frame, frenet_frame(moved, closed), strict=True):
        np.testing.assert_allclose(g, f @ R.T, atol=1e-6)
    tau = torsion(points, closed)
    np.testing.assert_allclose(torsion(moved, closed), tau, atol=1e-6 * (1 + np.abs(tau).max()))


@settings(max_examples=40, deadline=None)
@given(SPACE_CURVES, st.floats(1e-6, 1e6))
def test_scaling(case, s) -> None:
    closed = case[-1]
    points = random_curve(*case)
    np.testing.assert_allclose(
        curvature(s * points, closed) * s, curvature(points, closed), rtol=1e-8, atol=1e-8
    )
    tau = torsion(points, closed)
    np.testing.assert_allclose(
        torsion(s * points, closed) * s, tau, rtol=1e-6, atol=1e-6 * (1 + np.abs(tau).max())
    )


@settings(max_examples=40, deadline=None)
@given(SPACE_CURVES)
def test_reversal_and_mirror(case) -> None:
    closed = case[-1]
    points = random_curve(*case)
    kappa, tau = curvature(points, closed), torsion(points, closed)
    scale = 1 + np.abs(tau).max()
    back = points[::-1]
    np.testing.assert_allclose(curvature(back, closed)[::-1], kappa, rtol=1e-8, atol=1e-8)
    np.testing.assert_allclose(torsion(back, closed)[::-1], tau, atol=1e-6 * scale)
    mirror = points * [1, 1, -1]
    np.testing.assert_allclose(curvature(mirror, closed), kappa, rtol=1e-12)
    np.testing.assert_allclose(torsion(mirror, closed), -tau, atol=1e-10 * scale)


def test_closed_curves_have_no_first_point() -> None:
    points = random_curve(20, 1.3, 0.7, 1, True)
    shifted = np.roll(points, 7, axis=0)
    for f in (curvature, curvature_normal, torsion):
        np.testing.assert_allclose(f(shifted, True), np.roll(f(points, True), 7, axis=0), rtol=1e-11)


@pytest.mark.parametrize("scale", [1e-200, 1e-30, 1e30, 1e200])
def test_extreme_scales(scale) -> None:
    points = scale * curves.helix().mapping(evenly(curves.helix(), 200))
    np.testing.assert_allclose(curvature(points) * scale, 0.8, rtol=1e-3)
    np.testing.assert_allclose(torsion(points) * scale, 0.4, rtol=1e-2)


# ---------------------------------------------------------------- input


def test_accepted_kinds_of_arrays() -> None:
    points, dual = dual_of(curves.helix(), evenly(curves.helix(), 40))
    reference = [curvature(points, dual=dual), curvature_normal(points), torsion(points)]
    kept = points.copy()
    for kind in (np.asfortranarray, np.ndarray.tolist, lambda p: p[::-1][::-1]):
        found = [
            curvature(kind(points), dual=kind(dual)),
            curvature_normal(kind(points)),
            torsion(kind(points)),
        ]
        for f, r in zip(found, reference, strict=True):
            assert f.dtype == np.float64
            np.testing.assert_array_equal(f, r)
    single = points.astype(np.float32)
    np.testing.assert_allclose(curvature(single), reference[0], atol=2e-3)
    assert np.array_equal(points, kept)
    assert single.dtype == np.float32
    square = [[0, 0], [2, 0], [2, 2], [0, 2]]
    np.testing.assert_allclose(curvature(square, True), np.sqrt(2) / 2)


def test_rounding_of_single_precision_is_known() -> None:
    points = np.outer(np.linspace(0, 1, 50), [1 / 3, 2 / 7, -1 / 11]) + 1
    assert np.isnan(frenet_frame(points.astype(np.float32)).normal).all()
    assert np.isfinite(frenet_frame(points.astype(np.float32).astype(float)).normal).all(axis=1).any()


T = np.linspace(0, 3, 10)
GOOD = np.column_stack([np.cos(T), np.sin(T), T])


def changed(row, value, points=GOOD) -> np.ndarray:
    points = points.copy()
    points[row] = value
    return points


@pytest.mark.parametrize("f", [curvature, curvature_normal, frenet_frame, torsion])
@pytest.mark.parametrize(
    ("points", "closed", "message"),
    [
        (np.zeros(5), False, r"points must have shape \(n, 2\) or \(n, 3\), got \(5,\)"),
        (np.zeros((5, 4)), False, r"points must have shape \(n, 2\) or \(n, 3\), got \(5, 4\)"),
        (np.zeros((2, 5, 3)), False, r"got \(2, 5, 3\)"),
        ([], False, r"points must have shape .* got \(0,\)"),
        ([[0, 1], [2]], False, "points must be an array of real numbers"),
        (GOOD * 1j, False, "points must be an array of real numbers"),
        ([["a", "b"]] * 8, False, "points must be an array of real numbers"),
        (None, False, "points must be an array of real numbers"),
        (GOOD[:5], False, "points: an open curve needs at least 6 points, got 5"),
        (GOOD[:2], True, "points: a closed curve needs at least 3 points, got 2"),
        (changed([4, 7], np.nan), False, "points: 2 of 10 points not finite, the first is point 4"),
        (changed(9, -np.inf), True, "points: 1 of 10 points not finite, the first is point 9"),
        (
            changed([3, 4], GOOD[2]),
            False,
            "points: 2 of 9 points at the place of the next one, the first is point 2",
        ),
        (changed(5, GOOD[4] + 1e-16), False, "points: 1 of 9 .* the first is point 4"),
        (changed(9, GOOD[0]), True, "points: the first point of a closed curve is repeated at the end"),
        (
            curves.circle().mapping(np.linspace(0, 2 * np.pi, 20)),
            True,
            "the first point of a closed curve is repeated at the end",
        ),
    ],
)
def test_rejected_points(f, points, closed, message) -> None:
    with pytest.raises(ValueError, match=message):
        f(points, closed)


@pytest.mark.parametrize("f", [curvature, curvature_normal])
@pytest.mark.parametrize(
    ("dual", "closed", "message"),
    [
        (GOOD, False, r"dual must have shape \(9, 3\), got \(10, 3\)"),
        (GOOD[1:], True, r"dual must have shape \(10, 3\), got \(9, 3\)"),
        (GOOD[1:, :2], False, r"dual must have shape \(9, 3\), got \(9, 2\)"),
        (changed(2, np.nan)[1:], False, "dual: 1 of 9 points not finite, the first is point 1"),
        (changed(2, GOOD[3])[1:], False, "dual: 1 of 8 points at the place of the next one"),
        ("none", False, "dual must be an array of real numbers"),
    ],
)
def test_rejected_dual_points(f, dual, closed, message) -> None:
    with pytest.raises(ValueError, match=message):
        f(GOOD, closed, dual)


def test_open_curves_may_end_where_they_began() -> None:
    loop = curves.circle().mapping(np.linspace(0, 2 * np.pi, 100))
    assert np.abs(curvature(loop) - 1).max() < 2e-5


def test_staggered() -> None:
    t = [0.0, 1.0, 3.0, 4.0]
    points, dual = staggered(curves.circle().mapping, t)
    np.testing.assert_array_equal(points, curves.circle().mapping(np.array(t)))
    np.testing.assert_array_equal(dual, curves.circle().mapping(np.array([0.5, 2.0, 3.5])))
    points, dual = staggered(curves.circle().mapping, t, 2 * np.pi)
    assert points.shape == dual.shape == (4, 2)
    np.testing.assert_allclose(dual[-1], curves.circle().mapping(np.array([2 + np.pi]))[0])
    assert t == [0.0, 1.0, 3.0, 4.0]


@pytest.mark.parametrize(
    ("t", "period", "message"),
    [
        ([[0.0, 1.0]], None, "parameters must be one-dimensional"),
        ([0.0, np.nan], None, "finite"),
        ([0.0, 2.0, 1.0], None, "increasing"),
        ([0.0, 1.0, 7.0], 2 * np.pi, "parameters must lie within one period of 6.28"),
    ],
)
def test_staggered_rejections(t, period, message) -> None:
    with pytest.raises(ValueError, match=message):
        staggered(curves.circle().mapping, t, period)


# ---------------------------------------------------------------- the catalogue

CATALOGUE = {
    "line": (curves.line((1, 2, 3), (1, 1, 2)), 1e-7),
    "circle": (curves.circle(3.0), 1e-9),
    "ellipse": (curves.ellipse(1.0, 3.0), 1e-4),
    "euler_spiral": (curves.euler_spiral(), 1e-8),
    "helix": (curves.helix(2.0, -0.7), 1e-5),
}


@pytest.mark.parametrize("name", CATALOGUE)
def test_catalogue(name) -> None:
    curve, bound = CATALOGUE[name]
    t = evenly(curve, 2**13)
    points = curve.mapping(t)
    error = np.abs(curvature(points, curve.closed) - curve.curvature(t))
    assert error[2:-2].max() < bound
    if points.shape[1] == 3 and name != "line":
        assert np.abs(torsion(points) - curve.torsion(t)).max() < 1e-4
    first, last = curve.mapping(np.array(curve.domain))
    assert curve.closed == bool(np.abs(first - last).max() < 1e-14)
    assert curve.reference
    assert np.isnan(curves.line().torsion(t)).all()
    assert not curves.euler_spiral().torsion(t).any()


def test_euler_spiral_is_parametrised_by_arc_length() -> None:
    # Independent of Fresnel integrals: Simpson's rule for the tangent (cos t^2, sin t^2).
    t = np.linspace(0, 3, 3001)
    f = np.column_stack([np.cos(t**2), np.sin(t**2)])
    h = t[1] - t[0]
    integral = h / 3 * (f[0] + 4 * f[1:-1:2].sum(axis=0) + 2 * f[2:-2:2].sum(axis=0) + f[-1])
    np.testing.assert_allclose(curves.euler_spiral().mapping(t[-1:])[0], integral, atol=1e-10)
