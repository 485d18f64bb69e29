"""The whole thesis: all scripts, its claims beside what was measured, and the report REPRODUCTION.md."""

from __future__ import annotations

import re
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
from rich.console import Console

from comparisons import beyond
from comparisons.common import OUTPUT, Claim, arguments, below, claims_markdown, print_claims
from quadcurv import QuadGrid, QuadMesh, mean_curvature
from quadcurv.refinement import convergence
from quadcurv.surfaces import cubed_ellipsoid, torus

Results = dict[str, float]

REPORT = Path(__file__).with_name("REPRODUCTION.md")
CHAPTERS = {
    "chapter2": "Chapter 2: curves",
    "chapter3": "Chapter 3: surfaces",
    "chapter4": "Chapter 4: other formulas",
}
FIGURES = {2: 7, 3: 12, 4: 4}  # figures of each chapter
NUMBER = re.compile(r"(?<![\w.^])-?\d+(?:\.\d+)?(?:e[-+]\d+)?")
UNITS_OF_ROUNDING = re.compile(r"[\d.]+ eps")
ROUNDING = re.compile(r"(?<!below )\b\d(?:\.\d+)?e-1[1-9]\b")


def as_face_list() -> float:
    """Largest difference of H between a grid and the same quads as a shuffled face list."""
    grid, *_ = torus().sample((48, 48))
    assert isinstance(grid, QuadGrid)
    faces = grid.to_mesh().faces
    rng = np.random.default_rng(0)
    start = (rng.integers(4, size=(len(faces), 1)) + np.arange(4)) % 4
    shuffled = rng.permutation(np.take_along_axis(faces, start, axis=1))
    H = mean_curvature(QuadMesh(grid.points.reshape(-1, 3), shuffled), "finite_volume")
    return float(np.abs(H - mean_curvature(grid, "finite_volume").ravel()).max())


def mixed(n: int = 32) -> Results:
    """One-norm of the error on an ellipsoid of which every third quad, at random, is cut in two."""
    mesh, xi, eta = cubed_ellipsoid().sample((n, n), "faces")
    assert isinstance(mesh, QuadMesh)
    faces = np.array(mesh.faces)
    cut = np.random.default_rng(0).random(len(faces)) < 1 / 3
    quads, halves = faces[~cut], faces[cut]
    triangles = np.concatenate((halves[:, [0, 1, 2]], halves[:, [2, 3, 0]]))
    pieces = np.concatenate((quads, np.pad(triangles, ((0, 0), (0, 1)), constant_values=-1)))
    exact = cubed_ellipsoid().mean_curvature(xi, eta)
    return {
        f"mixed mesh, {scheme}": float(
            np.abs(mean_curvature(QuadMesh(mesh.points, pieces), scheme) - exact).mean()
        )
        for scheme in ("finite_volume", "liu")
    }


def conclusions() -> Results:
    """Numbers behind chapters 1 and 5 that no other script measures."""
    results: Results = {"grid against shuffled faces": as_face_list(), **mixed()}
    for layout in ("staggered", "grid"):
        run = convergence(torus(), ("finite_volume", "cotan-6"), (64, 128), layout)
        fv, cotan = (run.errors[s]["one"][-1] for s in run.schemes)
        results[f"torus, {layout}: finite_volume over cotan-6"] = float(fv / cotan)
    xi, eta, d = 0.0, 1.0, 1e-5
    tangents = np.stack(
        (
            torus().mapping(xi + d, eta) - torus().mapping(xi - d, eta),
            torus().mapping(xi, eta + d) - torus().mapping(xi, eta - d),
        )
    ) / (2 * d)
    H, K = torus().mean_curvature(xi, eta), torus().gaussian_curvature(xi, eta)
    first, second = np.linalg.eigvalsh(tangents @ tangents.T)
    root = np.sqrt(H**2 - K)
    return results | {
        "1.1.1 metric, smaller": float(first),
        "1.1.1 metric, larger": float(second),
        "1.1.1 curvature, smaller": float(H - root),
        "1.1.1 curvature, larger": float(H + root),
    }


def overall_claims(results: dict[str, Results]) -> tuple[list[Claim], list[Claim]]:
    """Claims of chapter 1 and of chapter 5, from the results of all scripts."""
    own, curves, surfaces = results["conclusions"], results["chapter2"], results["chapter3"]
    lines = results["beyond"]
    first = [
        Claim(
            "1.1.1",
            "The principal curvatures are the eigenvalues of the metric tensor",
            "at eta = 1 on the torus the eigenvalues of the metric tensor are "
            f"{own['1.1.1 metric, smaller']:.2f} and {own['1.1.1 metric, larger']:.2f}, the principal "
            f"curvatures {own['1.1.1 curvature, smaller']:.2f} and {own['1.1.1 curvature, larger']:.2f}: "
            "those of the shape operator",
            "slip",
        )
    ]
    last = [
        Claim(
            "5",
            "Exact for the line and the circle, second order on the ellipse",
            f"circle on even spacing {below(curves['circle error to 256'], 10)}; ellipse rate "
            f"{curves['ellipse primal/dual rate']:.2f}; conditions under chapter 2",
            "reproduced",
        ),
        Claim(
            "5",
            "Exact for the cylinder, second order in the one-norm on two grids of the sphere",
            f"cylinder {below(surfaces['cylinder: largest error'], 11)}; rates "
            f"{surfaces['pillow_sphere: one-norm rate']:.2f} (pillow) and "
            f"{surfaces['sphere: one-norm rate']:.2f} (longitude-latitude)",
            "reproduced",
        ),
        Claim(
            "5",
            "An improvement upon the cotan formula on quadrilateral meshes",
            "one-norm of the error over that of cotan with valence 6, torus, 128 cells: "
            f"{own['torus, staggered: finite_volume over cotan-6']:.2f} on primal/dual points, but "
            f"{own['torus, grid: finite_volume over cotan-6']:.2f} on the vertices of a grid",
            "reproduced only if ...",
        ),
        Claim(
            "5",
            "Given a complete mesh the scheme requires fewer calculations than Liu's formula",
            "as printed, each point on its own: "
            f"{surfaces['operations: as printed, each cell on its own']:.0f} operations against "
            f"{surfaces['operations: Liu as printed']:.0f}. Both have the same fluxes; computed once a "
            f"quad they take {surfaces['operations: vertices']:.0f} against "
            f"{surfaces['operations: Liu, vertices']:.0f}, Liu's area being the cheaper one",
            "reproduced only if ...",
        ),
        Claim(
            "5",
            "On listings of faces Liu's formula needs no one-ring and takes triangles among the quads; with "
            "additional work so could the scheme",
            "its sums run over quads as well. H of a grid and of the same quads in random order differ by "
            f"{below(own['grid against shuffled faces'], 10)}; with every third quad of an ellipsoid cut in "
            f"two the one-norm of its error is {own['mixed mesh, finite_volume']:.1e}, that of Liu's "
            f"{own['mixed mesh, liu']:.1e}",
            "reproduced",
        ),
        Claim(
            "5",
            "Neither scheme has been proven to converge over such meshes",
            "neither does where the mesh is not smooth: with points moved by 5 % of the spacing the one-norm "
            f"of the error stays at {lines['jitter 5 %, finite_volume: one-norm, at 128']:.3f} and "
            f"{lines['jitter 5 %, liu: one-norm, at 128']:.3f}",
            "reproduced",
        ),
    ]
    return first, last


def linked(claim: Claim) -> Claim:
    """Numbers of figures in `where` as links to the pictures."""
    text, figures, numbers = claim.where.partition("Figure")
    links = re.sub(r"(\d)\.(\d+)", r"[\1.\2](output/figure_\1_\2.png)", numbers)
    return replace(claim, where=text + figures + links)


def table(claims: Sequence[Claim]) -> str:
    """Claims as a Markdown table with links; errors that are rounding appear as a bound."""
    return ROUNDING.sub("< 1e-10", claims_markdown([linked(c) for c in claims])).rstrip()


def findings_table(rows: Sequence[tuple[str, str, str]]) -> str:
    """Findings of `beyond` as a Markdown table."""
    lines = [f"| {question} | {answer} | [figure](output/{stem}.png) |" for question, answer, stem in rows]
    return "\n".join(["| question | measured | figure |", "| --- | --- | --- |", *lines])


def report(results: dict[str, Results]) -> str:
    """Text of REPRODUCTION.md."""
    first, last = overall_claims(results)
    sections = {"Chapter 1: introduction": first}
    for name, title in CHAPTERS.items():
        sections[title] = import_module(f"comparisons.{name}").claims(results[name])
    sections["Chapter 5: conclusion"] = last
    count = Counter(claim.verdict for claims in sections.values() for claim in claims)
    verdicts = ", ".join(f"{count[v]} {v.rstrip(' .')}" for v in sorted(count, key=lambda v: -count[v]))
    figures = (
        f"[{chapter}.{k}](output/figure_{chapter}_{k}.png)"
        for chapter, n in FIGURES.items()
        for k in range(1, n + 1)
    )
    lines = [
        "# What the thesis claims and what comes out",
        "",
        "J. T. Hutchins, *Computing Curvature and Curvature Normals on Smooth Logically Cartesian Surface "
        "Meshes*, MSc thesis, Boise State University, 2013. Written by `python -m comparisons.reproduction`, "
        "which also makes the figures; not edited by hand.",
        "",
        f"{sum(count.values())} claims: {verdicts}. A slip is a printed formula or reason that does not "
        "hold; what does is beside it. Curvatures are in 1/length. kappa is the norm of the mean curvature "
        "normal, H its signed length, positive on a sphere oriented outward.",
        "",
        "Figures: " + ", ".join(figures) + ".",
    ]
    for title, claims in sections.items():
        lines += ["", f"## {title}", "", table(claims)]
    lines += ["", "## Beyond the thesis", "", findings_table(beyond.findings(results["beyond"]))]
    return "\n".join(lines) + "\n"


def drift(fresh: str, committed: str) -> list[str]:
    """Lines of a fresh report that a committed one does not say: in other words, or 5 % off in a number.

    Multiples of eps are not compared: machines differ in them.
    """

    def words_and_numbers(line: str) -> tuple[str, list[float]]:
        line = UNITS_OF_ROUNDING.sub("some eps", line)
        return NUMBER.sub("#", line), [float(number) for number in NUMBER.findall(line)]

    said: dict[str, list[list[float]]] = {}
    for words, numbers in map(words_and_numbers, committed.splitlines()):
        said.setdefault(words, []).append(numbers)
    return [
        line
        for line in fresh.splitlines()
        for words, numbers in [words_and_numbers(line)]
        if not any(np.allclose(numbers, known, rtol=0.05, atol=0) for known in said.get(words, []))
    ]


def main(output: Path, quick: bool = False, console: Console | None = None) -> dict[str, Results]:
    """Run all scripts and write the report.

    Parameters
    ----------
    output : Path
        Folder of the figures; of a quick run also of REPRODUCTION.md, which else goes beside this file
        and links to ``output`` there.
    quick : bool
        As for the scripts.
    console : rich.console.Console, optional
        Where the progress is shown.

    Returns
    -------
    dict
        Results by script, and "conclusions".

    Raises
    ------
    ValueError
        A full run into another folder, where the report's links would not lead.
    """
    if not quick and output.resolve() != OUTPUT.resolve():
        raise ValueError(f"output: the report beside {Path(__file__).name} links to figures in {OUTPUT}")
    console = console or Console()
    results: dict[str, Results] = {}
    scripts = {**CHAPTERS, "beyond": "Beyond the thesis"}
    for i, (name, title) in enumerate(scripts.items(), 1):
        console.print(f"[{i}/{len(scripts)}] {title} ...", markup=False)
        start = time.perf_counter()
        results[name] = import_module(f"comparisons.{name}").main(output, quick)
        console.print(f"    {time.perf_counter() - start:.0f} s")
    results["conclusions"] = conclusions()
    path = output / REPORT.name if quick else REPORT
    path.write_text(report(results), encoding="utf-8")
    console.print(f"Figures in {output}, report in {path}")
    return results


if __name__ == "__main__":
    options = arguments(__doc__)
    found = main(options.output, options.quick)
    for name, title in CHAPTERS.items():
        print_claims(import_module(f"comparisons.{name}").claims(found[name]), title)
    for title, claims in zip(("Chapter 1", "Chapter 5"), overall_claims(found), strict=True):
        print_claims(claims, title)
    beyond.print_findings(found["beyond"])
