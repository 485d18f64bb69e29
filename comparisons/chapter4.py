"""Other formulas: Figures 4.1 to 4.4 of the thesis, error maps, and the claims of its chapter 4."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from rich.console import Console

from comparisons.common import (
    COLOURS,
    Claim,
    Verdict,
    arguments,
    below,
    convergence_plot,
    figure,
    paper_style,
    print_claims,
    save_figure,
)
from quadcurv import surfaces, viewing
from quadcurv.comparison import compare
from quadcurv.refinement import Convergence, convergence
from quadcurv.schemes import SCHEMES, cotan
from quadcurv.schemes.finite_volume import FINITE_VOLUME
from quadcurv.schemes.liu import LIU
from quadcurv.stencils import Stencils

Results = dict[str, float]

LABELS = {
    "finite_volume": "finite volume",
    "liu": "Liu",
    "cotan-4": "cotan 4",
    "cotan-6": "cotan 6",
    "cotan-6'": "cotan 6, other diagonal",
    "cotan-8": "cotan 8",
    "cotan-4-voronoi": "cotan 4, Voronoi",
    "cotan-6-voronoi": "cotan 6, Voronoi",
    "cotan-8-voronoi": "cotan 8, Voronoi",
}
# Valence 6 keeps two of the four primal neighbours: those along the first direction, or the others.
OTHER = cotan(6, diagonal=1)
ALL = tuple(OTHER if name == OTHER.name else SCHEMES[name] for name in LABELS)
CELLS = "cells $n$ around the cylinder"
ERROR = r"error of $H$ (1/length)"


def wave(theta: np.ndarray) -> np.ndarray:
    """The f of the thesis's second cylinder (Figure 3.2)."""
    return np.sin(2 * theta)


WAVY = replace(surfaces.cylinder(f=wave), name="cylinder, f = sin 2 theta")


def refinements(quick: bool) -> list[int]:
    """Doublings from 8 to 256 cells; for a quick look 16, 32 and 64."""
    return [16, 32, 64] if quick else [8 * 2**k for k in range(6)]


def stencil_diagram(output: Path) -> None:
    """Figure 4.1 beside the primal/dual stencil of Figure 3.1: the same, turned by 45 degrees."""
    fig, (left, right) = figure(1, 2, size=(6.6, 3.5))
    offsets = np.array([(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)], float)
    turn = np.array([[1, -1], [1, 1]]) / 2  # the a's onto cell corners, the d's onto cell centres
    _stencil(left, offsets @ turn.T, "primal and dual points")
    _stencil(right, offsets, "vertices of a mesh")
    for line in np.linspace(-1.5, 1.5, 4):
        left.plot([line, line], [-1.5, 1.5], color="0.8", linewidth=0.8, zorder=0)
        left.plot([-1.5, 1.5], [line, line], color="0.8", linewidth=0.8, zorder=0)
    for line in (-1, 0, 1):
        right.plot([line, line], [-1.5, 1.5], color="0.8", linewidth=0.8, zorder=0)
        right.plot([-1.5, 1.5], [line, line], color="0.8", linewidth=0.8, zorder=0)
    handles, names = right.get_legend_handles_labels()
    fig.legend(handles, names, loc="outside lower center", ncols=3)
    save_figure(fig, output, "figure_4_1")


def _stencil(axes: Axes, ring: np.ndarray, title: str) -> None:
    dual, primal = ring[::2], ring[1::2]
    polygon = np.vstack((dual, dual[:1]))
    axes.fill(*polygon.T, color=COLOURS[5], alpha=0.25, linewidth=0)
    axes.plot(*polygon.T, color=COLOURS[0], label="edges $t_2 = b - a$ of the dual cell")
    for k, d in enumerate(primal):
        label = "$t_1 = d - c$, crossing an edge" if k == 0 else None
        axes.annotate(
            "", tuple(d), (0, 0), arrowprops={"arrowstyle": "->", "color": COLOURS[1], "shrinkB": 5}
        )
        axes.plot([], [], color=COLOURS[1], label=label)
    axes.plot(*dual.T, "s", color=COLOURS[0], label="$a$, $b$: dual points")
    axes.plot(*primal.T, "o", color=COLOURS[1], label="$d$: primal points")
    axes.plot(0, 0, "o", color="black", label="$c$: the point in question")
    for point, name in ((dual[0], "$a$"), (primal[0], "$d$"), (dual[1], "$b$"), (np.zeros(2), "$c$")):
        axes.annotate(name, tuple(point), (6, 5), textcoords="offset points", fontsize=11)
    axes.set(title=title, aspect="equal", xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), xticks=[], yticks=[])
    axes.spines[:].set_visible(False)
    axes.grid(False)


def cylinder_figure(output: Path, runs: dict[str, Convergence]) -> None:
    """Figure 4.2, one panel each for f = 0 and f = sin 2 theta."""
    shown = ("cotan-6", "cotan-6'", "cotan-8", "cotan-8-voronoi", "finite_volume")
    names = {**LABELS, "cotan-6": r"cotan 6 keeping $\theta$", "cotan-6'": r"cotan 6 keeping $\zeta$"}
    fig, panels = figure(1, 2, size=(7.2, 4.2), sharey=True)
    columns = {}
    for axes, (f, run) in zip(panels, runs.items(), strict=True):
        n = run.sizes
        series = {names[s]: run.errors[s]["one"] for s in shown}
        fitted = {names["cotan-6"]: (n[1], n[-1])}
        if f == "0":
            fitted[names["cotan-8-voronoi"]] = (n[1], n[-1])
        convergence_plot(
            axes, n, series, fitted, rounding=(np.finfo(float).eps * n**2 / 8, r"$\epsilon n^2 / 8$")
        )
        axes.set(title=rf"$f(\theta) = {f}$", xlabel=CELLS)
        axes.legend(loc="center left", bbox_to_anchor=(0.0, 0.42))
        for s in shown:
            for norm in ("one", "inf"):
                columns[f"{run.surface}: {LABELS[s]}, {norm}-norm"] = run.errors[s][norm]
    panels[0].set_ylabel(ERROR + ", one-norm")
    save_figure(fig, output, "figure_4_2", {"n": runs["0"].sizes, **columns})


def pillow_figure(output: Path, run: Convergence, norm: str, stem: str) -> None:
    """Figures 4.3 and 4.4."""
    shown = ("cotan-8", "cotan-8-voronoi", "cotan-6", "cotan-6-voronoi", "finite_volume", "liu")
    n = np.array([c for _, c in run.shapes], float)
    fig, axes = figure(size=(5.4, 5.0))
    fitted = {LABELS[s]: (n[1], n[-1]) for s in ("cotan-6", "finite_volume", "liu")}
    convergence_plot(axes, n, {LABELS[s]: run.errors[s][norm] for s in shown}, fitted)
    axes.set(xlabel="cells $n$ across a hemisphere of the pillow grid", ylabel=f"{ERROR}, {norm}-norm")
    axes.get_legend().remove()
    fig.legend(loc="outside lower center", ncols=2)
    save_figure(fig, output, stem, {"n": n, **{LABELS[s]: run.errors[s][norm] for s in run.schemes}})


def error_maps(output: Path, console: Console, quick: bool) -> None:
    """Error of every scheme on the pillow sphere, on one logarithmic colour scale."""
    surface = surfaces.pillow_sphere()
    n = 16 if quick else 48
    mesh, xi, eta = surface.sample((2 * n, n), "staggered")
    comparison = compare(mesh, ALL, surface.mean_curvature(xi, eta))
    viewing.save_maps(comparison, output / "pillow_error_maps.html", "error")
    try:
        viewing.save_maps(comparison, output / "pillow_error_maps.png", "error")
    except viewing.NoOpenGLError as missing:
        console.print(f"No picture of the maps, only the page pillow_error_maps.html: {missing}")


def fluxes_differ(n: int = 24) -> float:
    """Largest relative difference of Liu's and the finite-volume H n times area on noisy quads."""
    mesh, *_ = surfaces.torus().sample((n, n))
    noise = np.random.default_rng(0).normal(0, 0.02, mesh.points.shape)
    stencils = type(mesh)(mesh.points + noise, mesh.wrap).stencils()
    fv, liu = (scheme.flux(stencils)[0] for scheme in (FINITE_VOLUME, LIU))
    return float(np.abs(fv - liu).max() / np.abs(liu).max())


def factor_of_4_1(n: int = 32) -> float:
    """|K| as eq. 4.1 is printed, over the exact H of the cylinder: 6 rather than 1 (or 2 for 2 H)."""
    surface = surfaces.cylinder()
    mesh, *_ = surface.sample((n, n))
    stencils: Stencils = mesh.stencils()
    stiffness, mixed = cotan(6, "voronoi").assemble(stencils)
    # libigl's stiffness has (cot + cot) / 2 as weights.
    printed = 3 / (2 * mixed[:, None]) * 2 * (stiffness @ stencils.points)
    inside = stencils.closed
    return float(np.linalg.norm(printed[inside], axis=1).mean() * 2 * 1.0)


@paper_style
def main(output: Path, quick: bool = False, console: Console | None = None) -> Results:
    """Make all figures and tables of chapter 4.

    Parameters
    ----------
    output : Path
        Folder for PNG, SVG, CSV and HTML files.
    quick : bool
        Fewer refinements.
    console : rich.console.Console, optional
        Where the tables go.

    Returns
    -------
    dict of str to float
        Errors on the finest grid and fitted rates by "case: scheme, norm".
    """
    console = console or Console()
    output.mkdir(parents=True, exist_ok=True)
    sizes = refinements(quick)
    cases: dict[str, tuple[surfaces.Surface, list, str]] = {
        "cylinder": (surfaces.cylinder(), sizes, "staggered"),
        "wavy cylinder": (WAVY, sizes, "staggered"),
        "pillow": (surfaces.pillow_sphere(), [(2 * n, n) for n in sizes], "staggered"),
        "sphere": (surfaces.sphere(), sizes, "staggered"),
        "cylinder vertices": (surfaces.cylinder(), sizes[1:], "grid"),
    }
    runs: dict[str, Convergence] = {}
    results: Results = {}
    for case, (surface, shapes, layout) in cases.items():
        runs[case] = run = convergence(surface, ALL, shapes, layout)
        console.print(run)
        run.to_csv(output / f"chapter4_{case.replace(' ', '_')}.csv")
        for scheme in run.schemes:
            for norm in ("one", "inf"):
                results[f"{case}: {scheme}, {norm}"] = float(run.errors[scheme][norm][-1])
                results[f"{case}: {scheme}, {norm}-rate"] = run.fitted_rate(scheme, norm, len(sizes) - 1)
                results[f"{case}: {scheme}, last {norm}-rate"] = float(run.rates(scheme, norm)[-1])
    stencil_diagram(output)
    cylinder_figure(output, {"0": runs["cylinder"], r"\sin 2\theta": runs["wavy cylinder"]})
    pillow_figure(output, runs["pillow"], "one", "figure_4_3")
    pillow_figure(output, runs["pillow"], "inf", "figure_4_4")
    error_maps(output, console, quick)
    one, inf = (runs["cylinder"].errors["cotan-6"][norm] for norm in ("one", "inf"))
    results["cylinder: one over inf of cotan-6"] = float((one / inf).min())
    results["flux difference"] = fluxes_differ()
    results["factor of 4.1"] = factor_of_4_1()
    return results


def claims(results: Results) -> list[Claim]:
    """Chapter 4's claims beside the measured figures, which decide on the verdicts."""
    r = results
    conditional: Verdict = "reproduced only if ..."

    def rate(case: str, scheme: str, norm: str = "one") -> float:
        return r[f"{case}: {scheme}, {norm}-rate"]

    def error(case: str, scheme: str, norm: str = "one") -> float:
        return r[f"{case}: {scheme}, {norm}"]

    def exact(case: str, scheme: str) -> bool:
        return error(case, scheme, "inf") < 1e-9

    def rounding(case: str, scheme: str) -> str:
        return below(error(case, scheme, "inf"), 9)

    def order(found: float, expected: float) -> bool:
        return abs(found - expected) < 0.15

    def stays(case: str, scheme: str, norm: str = "one") -> bool:
        return rate(case, scheme, norm) < 0.15 and error(case, scheme, norm) > 0.1

    def claim(where: str, text: str, measured: str, holds: bool, verdict: Verdict = "reproduced") -> Claim:
        return Claim(where, text, measured, verdict if holds else "not reproduced")

    last = r["pillow: cotan-6, last one-rate"]
    return [
        claim(
            "4.1, Figure 4.1",
            "the scheme applies to every vertex of a prescribed mesh",
            "the stencils of Figures 3.1 and 4.1 are one, turned by 45 degrees; on the vertices of a "
            f"cylinder rate {rate('cylinder vertices', 'finite_volume'):.2f}, no longer exact (Liu and "
            f"cotan 6 are, {rounding('cylinder vertices', 'liu')})",
            order(rate("cylinder vertices", "finite_volume"), 2) and exact("cylinder vertices", "liu"),
        ),
        claim(
            "4.2, Figure 4.2",
            "on the cylinder valence 6 converges, but is not exact",
            f"keeping the two primal neighbours along theta: rate {rate('cylinder', 'cotan-6'):.2f}, with "
            f"f = sin 2 theta {rate('wavy cylinder', 'cotan-6'):.2f}; keeping the other two: exact "
            f"({rounding('cylinder', OTHER.name)})",
            order(rate("cylinder", "cotan-6"), 2) and exact("cylinder", OTHER.name),
            conditional,
        ),
        claim(
            "4.2, Figure 4.2",
            "on the cylinder valence 8 does not converge",
            f"barycentric area: error stays at {error('cylinder', 'cotan-8'):.3f}; Voronoi area: rate "
            f"{rate('cylinder', 'cotan-8-voronoi'):.2f} (with f = sin 2 theta, a non-orthogonal grid, it "
            f"stays at {error('wavy cylinder', 'cotan-8-voronoi'):.2f})",
            stays("cylinder", "cotan-8") and order(rate("cylinder", "cotan-8-voronoi"), 2),
            conditional,
        ),
        claim(
            "Figure 4.2",
            "the inf-norm mirrors the one-norm exactly",
            f"smallest ratio of the two for valence 6: {r['cylinder: one over inf of cotan-6']:.6f}",
            abs(r["cylinder: one over inf of cotan-6"] - 1) < 1e-6,
        ),
        claim(
            "4.2",
            "only valence 6 converges, valence 4 and 8 do not",
            "barycentric area: so on the cylinder and both spheres "
            f"(cotan 4 on the cylinder stays at {error('cylinder', 'cotan-4'):.3f}); Voronoi area: valence "
            f"4 converges on the cylinder too, rate {rate('cylinder', 'cotan-4-voronoi'):.2f}",
            all(stays(c, s) for c in ("cylinder", "pillow", "sphere") for s in ("cotan-4", "cotan-8"))
            and order(rate("cylinder", "cotan-4-voronoi"), 2),
            conditional,
        ),
        claim(
            "4.2, 3.3.1",
            "the finite-volume scheme is exact on the cylinder",
            f"{rounding('cylinder', 'finite_volume')}, with f = sin 2 theta "
            f"{rounding('wavy cylinder', 'finite_volume')}; Liu's formula is exact as well",
            all(exact(c, s) for c in ("cylinder", "wavy cylinder") for s in ("finite_volume", "liu")),
        ),
        claim(
            "4.2, Figure 4.3",
            "on the pillow sphere valence 6 is first order in the one-norm",
            f"fitted rate {rate('pillow', 'cotan-6'):.2f}, that of the last doubling {last:.2f}: rising, but "
            "first order at most in the limit",
            0.6 < rate("pillow", "cotan-6") < 1 and 0.6 < last < 1,
            conditional,
        ),
        claim(
            "4.2, Figure 4.4",
            "on the pillow sphere valence 6 does not converge in the inf-norm",
            f"it diverges, rate {rate('pillow', 'cotan-6', 'inf'):.2f}, with Voronoi area "
            f"{rate('pillow', 'cotan-6-voronoi', 'inf'):.2f}; valence 8 "
            f"{rate('pillow', 'cotan-8', 'inf'):.2f}",
            all(order(rate("pillow", s, "inf"), -1) for s in ("cotan-6", "cotan-6-voronoi", "cotan-8")),
        ),
        claim(
            "Figures 4.3, 4.4",
            "on the pillow sphere the scheme is second order in the one-norm, first in the inf-norm",
            f"rates {rate('pillow', 'finite_volume'):.2f} and {rate('pillow', 'finite_volume', 'inf'):.2f}",
            order(rate("pillow", "finite_volume"), 2) and order(rate("pillow", "finite_volume", "inf"), 1),
        ),
        claim(
            "4.3, Figures 4.3, 4.4",
            "Liu's formula mirrors the scheme on the pillow sphere",
            f"rates {rate('pillow', 'liu'):.2f} and {rate('pillow', 'liu', 'inf'):.2f}, with smaller errors "
            f"({error('pillow', 'liu'):.1e} against {error('pillow', 'finite_volume'):.1e}); the fluxes are "
            f"the same (largest difference {below(r['flux difference'], 9)}), only the areas differ",
            abs(rate("pillow", "liu") - 2) < 0.3
            and order(rate("pillow", "liu", "inf"), 1)
            and r["flux difference"] < 1e-9,
        ),
        claim(
            "abstract, 4.3",
            "Liu's formula and the scheme are equivalent in performance",
            "on the pillow sphere as above; not on the longitude-latitude sphere without poles, where Liu's "
            f"rate is {rate('sphere', 'liu'):.2f} and the scheme's {rate('sphere', 'finite_volume'):.2f}",
            order(rate("sphere", "liu"), 4) and order(rate("sphere", "finite_volume"), 2),
            conditional,
        ),
        claim(
            "eq. 4.1",
            "K = 3/(2 A_mixed) sum (cot + cot)(X_i - X_j)",
            f"gives {r['factor of 4.1']:.2f} H on the cylinder; 1/(2 A_mixed) gives 2 H, eq. 4.3 gives H",
            abs(r["factor of 4.1"] - 6) < 1e-6,
            "slip",
        ),
    ]


if __name__ == "__main__":
    given = arguments(__doc__)
    print_claims(claims(main(given.output, given.quick)), "Chapter 4")
    Console().print(f"Figures, tables and maps are in {given.output}")
