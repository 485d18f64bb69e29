"""Curves: Figures 2.1 to 2.7 of the thesis and the claims of its chapter 2."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from comparisons.common import (
    COLOURS,
    Claim,
    arguments,
    convergence_plot,
    figure,
    paper_style,
    print_claims,
    save_figure,
)
from quadcurv.curves import (
    Curve,
    circle,
    curvature,
    curvature_normal,
    ellipse,
    euler_spiral,
    helix,
    line,
    staggered,
    torsion,
)

Array = NDArray[np.float64]
Results = dict[str, float]

EPS = float(np.finfo(float).eps)
POINTS = "number of points $n$"
CURVATURE_ERROR = r"largest error $|\kappa_j - \kappa|$"
LINE = line(origin=(0.3, 0.1), direction=(1.6 * np.pi, 1.2 * np.pi))  # as long as the circle
ARC = replace(ellipse(), domain=(np.pi / 6, 5 * np.pi / 6), closed=False)


def doublings(first: int, last: int) -> NDArray[np.int64]:
    """first, 2 first, 4 first, ... up to last."""
    return first * 2 ** np.arange(int(np.log2(last / first)) + 1)


def parameters(curve: Curve, n: int, jitter: float = 0.0) -> Array:
    """Spread n parameters over the domain; jitter is the part of itself that a step varies by."""
    steps = 1 + jitter * np.random.default_rng(n).uniform(-1, 1, n - (not curve.closed))
    t = np.append(0, np.cumsum(steps)) / steps.sum()
    return curve.domain[0] + np.ptp(curve.domain) * (t[:-1] if curve.closed else t)


def primal_dual(curve: Curve, t: Array) -> tuple[Array, Array]:
    """Primal points at t and dual points halfway between in the parameter."""
    return staggered(curve.mapping, t, float(np.ptp(curve.domain)) if curve.closed else None)


def errors(curve: Curve, n: int, quantity: str = "primal/dual", jitter: float = 0.0) -> Array:
    """Absolute error at n points of the curvature ("primal/dual" or "polyline") or "torsion"."""
    t = parameters(curve, n, jitter)
    points, dual = primal_dual(curve, t)
    if quantity == "torsion":
        return np.abs(torsion(points, curve.closed) - curve.torsion(t))
    between = dual if quantity == "primal/dual" else None
    return np.abs(curvature(points, curve.closed, between) - curve.curvature(t))


def inside(found: Sequence[Array]) -> list[float]:
    """Largest errors at the points whose stencil holds no ghost point."""
    return [float(e[2:-2].max()) for e in found]


def ends(found: Sequence[Array]) -> list[float]:
    """Largest errors at the first and last point."""
    return [float(max(e[0], e[-1])) for e in found]


def printed_torsion(points: Array, slip: bool) -> Array:
    """Unsigned torsion of the inner edges, literally (2.54) to (2.56).

    With the slip the difference of normals is divided by |t^(1)| = 1 / |t_(1)|, as printed.
    """
    tangent = np.diff(points, axis=0)[1:-1]
    spacing = np.linalg.norm(tangent, axis=1, keepdims=True)
    H = curvature_normal(points)[1:-1]
    kappa = np.linalg.norm(H, axis=1, keepdims=True)
    slope = np.diff(H / kappa, axis=0) / (1 / spacing if slip else spacing)
    binormal = slope + (kappa[1:] + kappa[:-1]) / 2 * tangent / spacing
    return np.asarray(np.linalg.norm(binormal, axis=1))


def schematic(output: Path) -> None:
    """Figure 2.1: primal and dual points, a cell, its two tangents and its curvature normal."""
    edges = np.radians(np.linspace(150, 30, 6))
    unit = circle().mapping
    points, dual = unit((edges[1:] + edges[:-1]) / 2), unit(edges)
    fig, axes = figure(size=(5.2, 2.7))
    axes.plot(*unit(np.linspace(edges[0], edges[-1], 200)).T, color="0.6", zorder=1)
    cell = unit(np.linspace(edges[2], edges[3], 50))
    axes.plot(*cell.T, color=COLOURS[4], linewidth=4, alpha=0.6, zorder=1, label="cell $C_j$")
    for p in dual:  # a mark across the curve
        axes.plot(*np.outer([0.975, 1.025], p).T, color=COLOURS[1], label="dual points")
    axes.plot(*points.T, "o", color=COLOURS[0], markersize=6, label="primal points")
    arrow = {"arrowstyle": "-|>", "shrinkA": 3, "shrinkB": 3, "linewidth": 1.3}
    for start, end, colour in (
        (points[1], points[2], COLOURS[2]),
        (points[2], points[3], COLOURS[2]),
        (points[2], 0.72 * points[2], COLOURS[3]),
    ):
        axes.annotate("", end, start, arrowprops=arrow | {"color": colour})
    for position, text, shift in (
        (points[1], r"$T_{p,j-1}$", (-6, 9)),
        (points[2], r"$T_{p,j}$", (0, 9)),
        (points[3], r"$T_{p,j+1}$", (6, 9)),
        (dual[2], r"$T_{d,j}$", (-3, 11)),
        (dual[3], r"$T_{d,j+1}$", (3, 11)),
        ((points[1] + points[2]) / 2, r"$t_{(1),j}$", (2, -14)),
        ((points[2] + points[3]) / 2, r"$t_{(1),j+1}$", (-2, -14)),
        (0.78 * points[2], r"$\mathbf{H}_j$", (11, 0)),
    ):
        axes.annotate(text, position, shift, textcoords="offset points", ha="center")
    axes.set(aspect="equal", xlim=(-1, 1), ylim=(0.45, 1.16))
    axes.axis("off")
    handles, labels = axes.get_legend_handles_labels()
    unique = dict(zip(labels, handles, strict=True))
    axes.legend(unique.values(), unique.keys(), loc="lower center", ncols=3)
    save_figure(fig, output, "figure_2_1")


def ellipse_normals(output: Path) -> None:
    """Figure 2.2."""
    curve = ellipse()
    t = parameters(curve, 64)
    points, dual = primal_dual(curve, t)
    H = curvature_normal(points, True, dual)
    fig, axes = figure(size=(5.2, 2.7))
    axes.plot(*curve.mapping(np.linspace(*curve.domain, 400)).T)
    axes.quiver(*points.T, *H.T, color=COLOURS[1], angles="xy", scale_units="xy", scale=1, width=3e-3)
    axes.set(aspect="equal", xlabel="$x$", ylabel="$y$")
    axes.set_title(r"Curvature normals $\mathbf{H}$ of the ellipse, $n = 64$")
    save_figure(fig, output, "figure_2_2", {"t": t, **columns("x y Hx Hy", np.hstack([points, H]))})


def ellipse_convergence(output: Path) -> Results:
    """Figure 2.3."""
    sizes = doublings(16, 1024)
    labels = {"primal/dual": "primal/dual points", "polyline": "polyline"}
    series = {
        label: [float(errors(ellipse(), n, quantity).max()) for n in sizes]
        for quantity, label in labels.items()
    }
    fig, axes = figure()
    rates = convergence_plot(axes, sizes, series, dict.fromkeys(series, (64, sizes[-1])))
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title="Ellipse, $a = 5$, $b = 2$")
    save_figure(fig, output, "figure_2_3", {"n": sizes, **series})
    at_256 = list(sizes).index(256)
    return {f"ellipse {quantity} rate": rates[label] for quantity, label in labels.items()} | {
        f"ellipse {quantity} error at 256": series[label][at_256] for quantity, label in labels.items()
    }


def spiral(output: Path) -> None:
    """Figure 2.4."""
    curve = euler_spiral()
    t = parameters(curve, 12000)
    points = curve.mapping(t)
    fig, axes = figure(size=(4.2, 4.0))
    axes.plot(*points.T, linewidth=0.5)
    axes.set(aspect="equal", xlabel="$C(t)$", ylabel="$S(t)$", title="Euler spiral, $-30 < t < 30$")
    save_figure(fig, output, "figure_2_4", {"t": t, **columns("x y", points)})


def spiral_convergence(output: Path, quick: bool) -> Results:
    """Figure 2.5: under-resolved at first, then of fourth order, then rounding."""
    sizes = doublings(256, 2**15 if quick else 2**17)
    found = [errors(euler_spiral(), n) for n in sizes]
    series = {"inside": inside(found), "the two ends": ends(found)}
    rounding = EPS * (sizes / 60) ** 2
    fig, axes = figure()
    rates = convergence_plot(
        axes, sizes, series, {"inside": (1024, 8192)}, rounding=(4 * rounding, r"$4\,\epsilon/h^2$")
    )
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title="Euler spiral, $-30 < t < 30$")
    axes.text(2**8.5, 1e-5, "under-\nresolved", color="0.4", ha="center")
    save_figure(fig, output, "figure_2_5", {"n": sizes, **series, "rounding": 4 * rounding})
    at = {int(n): e for n, e in zip(sizes, series["inside"], strict=True)}
    return {
        "spiral rate": rates["inside"],
        "spiral error at 8192": at[8192],
        "spiral error at 32768 over eps/h^2": at[32768] / (EPS * (32768 / 60) ** 2),
    }


def helix_normals(output: Path) -> None:
    """Figure 2.6."""
    curve = helix()
    t = parameters(curve, 97)
    points = curve.mapping(t)
    H = curvature_normal(points)
    fig, axes = figure(size=(4.0, 4.6), subplot_kw={"projection": "3d", "box_aspect": (1, 1, 1.5)})
    axes.plot(*curve.mapping(parameters(curve, 800)).T, label="helix")
    axes.quiver(*points.T, *H.T, color=COLOURS[1], length=0.6, linewidth=0.7, label=r"$0.6\,\mathbf{H}$")
    axes.set(xlabel="$x$", ylabel="$y$", zlabel="$z$", xticks=(-1, 0, 1), yticks=(-1, 0, 1))
    axes.legend(loc="upper left")
    save_figure(fig, output, "figure_2_6", {"t": t, **columns("x y z Hx Hy Hz", np.hstack([points, H]))})


def helix_convergence(output: Path) -> Results:
    """Figure 2.7, away from the ends."""
    sizes = doublings(16, 1024)
    series = {
        "curvature": inside([errors(helix(), n) for n in sizes]),
        "torsion": inside([errors(helix(), n, "torsion") for n in sizes]),
    }
    fig, axes = figure()
    rates = convergence_plot(axes, sizes, series, dict.fromkeys(series, (64, sizes[-1])))
    axes.set(xlabel=POINTS, ylabel="largest error", title=r"Helix, $\kappa = 0.8$, $\tau = 0.4$")
    save_figure(fig, output, "figure_2_7", {"n": sizes, **series})
    at_256 = list(sizes).index(256)
    return {f"helix {name} rate": rates[name] for name in series} | {
        f"helix {name} error at 256": e[at_256] for name, e in series.items()
    }


def exactness(output: Path, quick: bool) -> Results:
    """Line and circle: rounding is all there is, and it grows like eps/h^2."""
    sizes = doublings(8, 1024 if quick else 2**14)
    straight = [errors(LINE, n, "polyline") for n in sizes]
    series = {
        "circle": [float(errors(circle(), n).max()) for n in sizes],
        "line": inside(straight),
        "ends of the line": ends(straight),
    }
    h = 2 * np.pi / sizes
    rounding = EPS / h**2
    fig, axes = figure()
    convergence_plot(axes, sizes, series, {}, rounding=(rounding, r"$\epsilon/h^2$"))
    axes.set(xlabel=POINTS, ylabel=CURVATURE_ERROR, title=r"Circle and line of length $2\pi$")
    save_figure(fig, output, "figure_2_exact", {"n": sizes, **series, "rounding": rounding})
    few = sizes <= 256
    return {
        "circle error to 256": float(np.array(series["circle"])[few].max()),
        "line turn to 256": float((np.array([series["line"], series["ends of the line"]]) * h)[:, few].max()),
    }


def open_ends(output: Path) -> Results:
    """Ends of open curves beside their inside, on an arc of the ellipse and on the helix."""
    sizes = doublings(32, 1024)
    fig, panels = figure(1, 2, size=(7.0, 3.4))
    table: dict[str, Sequence[float]] = {}
    results = {}
    for axes, curve, quantity, title in (
        (panels[0], ARC, "polyline", r"$\kappa$, ellipse, $\pi/6 < t < 5\pi/6$"),
        (panels[1], helix(), "torsion", r"$\tau$, helix"),
    ):
        found = [errors(curve, n, quantity) for n in sizes]
        series = {"inside": inside(found), "ends": ends(found)}
        fit = dict.fromkeys(series, (sizes[-3], sizes[-1]))
        rates = convergence_plot(axes, sizes, series, fit, slopes=(2,))
        axes.set(xlabel=POINTS, ylabel="largest error", title=title)
        name = "arc curvature" if curve is ARC else "helix torsion"
        table |= {f"{name} {where}": e for where, e in series.items()}
        at_256 = list(sizes).index(256)
        results[f"{name} end rate"] = rates["ends"]
        results[f"{name} end error over inside at 256"] = series["ends"][at_256] / series["inside"][at_256]
    save_figure(fig, output, "figure_2_open_ends", {"n": sizes, **table})
    return results


def uneven(output: Path) -> Results:
    """Circle and helix on steps that vary by up to half of themselves."""
    sizes = doublings(16, 1024)
    exact, halfway, polyline, one, three = [np.empty(len(sizes)) for _ in range(5)]
    for i, n in enumerate(sizes):
        exact[i] = errors(circle(), n, "primal/dual", 0.5).max()
        polyline[i] = errors(circle(), n, "polyline", 0.5).max()
        primal, dual = primal_dual(circle(), parameters(circle(), n, 0.5))
        # The other way round: the primal points lie halfway between the dual ones.
        halfway[i] = np.abs(curvature(dual, True, np.roll(primal, -1, axis=0)) - 1).max()
        points = helix().mapping(parameters(helix(), n, 0.5))
        one[i] = np.abs(printed_torsion(points, slip=False) - 0.4).max()
        three[i] = errors(helix(), n, "torsion", 0.5)[2:-2].max()
    fig, (left, right) = figure(1, 2, size=(7.0, 3.4), sharex=True)
    window = (64, sizes[-1])
    circles = {"primal halfway (2.48)": halfway, "polyline": polyline, "dual halfway": exact}
    helices = {"over one edge": one, "over three edges": three}
    circle_rates = convergence_plot(left, sizes, circles, {"polyline": window})
    helix_rates = convergence_plot(right, sizes, helices, {"over three edges": window})
    left.set(xlabel=POINTS, ylabel="largest error", title=r"$\kappa$, circle, steps $\pm 50\,\%$")
    right.set(xlabel=POINTS, ylabel="largest error", title=r"$\tau$, helix, steps $\pm 50\,\%$")
    save_figure(fig, output, "figure_2_uneven", {"n": sizes, **circles, **helices})
    at_256 = list(sizes).index(256)
    return {
        "uneven circle error at 256, dual halfway": float(exact[at_256]),
        "uneven circle error at 256, primal halfway": float(halfway[at_256]),
        "uneven circle error at 256, polyline": float(polyline[at_256]),
        "uneven circle rate, polyline": circle_rates["polyline"],
        "uneven helix torsion error at 256, one edge": float(one[at_256]),
        "uneven helix torsion error at 256, three edges": float(three[at_256]),
        "uneven helix torsion rate, three edges": helix_rates["over three edges"],
    }


def slips() -> Results:
    """Numbers behind the printed equations that do not hold."""
    points = helix().mapping(parameters(helix(), 256))
    H = curvature_normal(circle().mapping(parameters(circle(), 256)), True)
    tangent = np.diff(points, axis=0)
    normal = curvature_normal(points)[1:-1]
    cosine = np.einsum("ij,ij->i", tangent[1:], normal) / (
        np.linalg.norm(tangent[1:], axis=1) * np.linalg.norm(normal, axis=1)
    )
    return {
        "2.31 largest cosine of printed and exact normal": float(np.abs(cosine).max()),
        "2.45 x component of H at t = 0": float(H[128, 0]),
        "2.54 printed torsion of the helix": float(printed_torsion(points, slip=True).mean()),
        "2.54 corrected torsion of the helix": float(printed_torsion(points, slip=False).mean()),
    }


@paper_style
def main(output: Path, quick: bool = False) -> Results:
    """Write all figures to a folder.

    Parameters
    ----------
    output : Path
        Folder, made where there is none.
    quick : bool
        Stop at fewer points.

    Returns
    -------
    dict
        Measured rates and errors by name.
    """
    schematic(output)
    ellipse_normals(output)
    spiral(output)
    helix_normals(output)
    return {
        **slips(),
        **exactness(output, quick),
        **ellipse_convergence(output),
        **spiral_convergence(output, quick),
        **helix_convergence(output),
        **open_ends(output),
        **uneven(output),
    }


def claims(results: Results) -> list[Claim]:
    """Claims of chapter 2 beside the results of `main`."""
    r = results
    return [
        Claim(
            "2.1.2",
            "The curvature of a straight line is zero",
            f"turns by at most {r['line turn to 256']:.0e} per point up to 256 points: rounding",
            "reproduced",
        ),
        Claim(
            "2.1.3, (2.39) to (2.49)",
            "The circle is exact for any spacing",
            f"error {r['uneven circle error at 256, dual halfway']:.0e} with steps that vary by half "
            "if dual points lie halfway between primal ones; "
            f"{r['uneven circle error at 256, primal halfway']:.1f} with primal points halfway "
            f"between dual ones; {r['circle error to 256']:.0e} on even spacing, either way",
            "reproduced only if ...",
        ),
        Claim(
            "(2.48)",
            "(h_j + h_{j-1})/2 = h_j^d since primal points are halfway between dual ones",
            "holds for dual points halfway between primal ones; for the reverse only where cell "
            "widths grow linearly",
            "slip",
        ),
        Claim(
            "2.1.4, Figure 2.3",
            "Second order on the ellipse",
            f"rate {r['ellipse primal/dual rate']:.2f}, error "
            f"{r['ellipse primal/dual error at 256']:.1e} at 256 points",
            "reproduced",
        ),
        Claim(
            "2.1.5, Figure 2.5",
            "Nearly fourth order on the Euler spiral",
            f"rate {r['spiral rate']:.2f}, error {r['spiral error at 8192']:.1e} at 8192 points",
            "reproduced",
        ),
        Claim(
            "2.1.5, Figure 2.5",
            "The last error deviates due to the precision of the Fresnel integrals",
            "it does so with Fresnel integrals good to a few units in the last place: positions rounded to "
            f"doubles make it grow like eps/h^2, {r['spiral error at 32768 over eps/h^2']:.1f} eps/h^2 at "
            "32768 points, as on the circle, which has no such integrals",
            "slip",
        ),
        Claim(
            "2.2, Figure 2.7",
            "Second order for curvature and torsion on the helix",
            f"rates {r['helix curvature rate']:.2f} and {r['helix torsion rate']:.2f}, errors "
            f"{r['helix curvature error at 256']:.1e} and {r['helix torsion error at 256']:.1e} "
            "at 256 points",
            "reproduced",
        ),
        Claim(
            "2.2, (2.54) to (2.56)",
            "Torsion from the difference of two normals over one edge",
            "on steps that vary by half the error stays at "
            f"{r['uneven helix torsion error at 256, one edge']:.2f}; over the mean of three edges it "
            f"is {r['uneven helix torsion error at 256, three edges']:.0e} at 256 points, rate "
            f"{r['uneven helix torsion rate, three edges']:.1f}",
            "reproduced only if ...",
        ),
        Claim(
            "(2.31)",
            "The surface normal is the unit edge vector t_(1)/|t_(1)|",
            "that is the tangent: its cosine with H/|H| is at most "
            f"{r['2.31 largest cosine of printed and exact normal']:.3f}; n_s = H/|H| (2.23)",
            "slip",
        ),
        Claim(
            "(2.45)",
            "H of the circle points along (cos, -sin)",
            f"along (-cos, -sin): H = {r['2.45 x component of H at t = 0']:.3f} along x at t = 0; "
            "the sign of (2.44) is lost, its norm is right",
            "slip",
        ),
        Claim(
            "(2.54)",
            "dn/ds divides by |t^(1)|",
            f"gives tau = {r['2.54 printed torsion of the helix']:.3f}, the curvature; divided by the "
            f"primal spacing |t_(1)| {r['2.54 corrected torsion of the helix']:.4f}, exact 0.4",
            "slip",
        ),
    ]


def columns(names: str, table: Array) -> dict[str, Array]:
    """Columns of a table by name."""
    return dict(zip(names.split(), table.T, strict=True))


if __name__ == "__main__":
    options = arguments(__doc__)
    print_claims(claims(main(options.output, options.quick)), "Chapter 2")
