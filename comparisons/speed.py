"""What `comparisons.performance` measured, as Markdown and figures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from comparisons import gpu
from comparisons.figures import COLOURS, MARKERS, figure, paper_style, save_figure
from comparisons.goals import Ratio
from comparisons.operations import THESIS, operations
from comparisons.scale import machine

Times = dict[str, dict[int, dict[str, NDArray[np.float64]]]]
PEERS = ("libigl", "vtk", "pymeshlab", "robust-laplacian", "scipy", "numpy", "numba")


def short(name: str) -> str:
    """A name as figures have it."""
    return name.replace("finite_volume", "FV").replace("liu", "Liu")


def markdown(ratios: list[Ratio], times: Times, peak: dict[str, float], quick: bool = False) -> str:
    """The report."""
    counted = operations()
    lines = [
        "# Speed",
        "",
        "Written by `python -m comparisons.performance`. Median and quartiles, over the rounds, of the ratio",
        "of two wall times taken in one round of one process; *must* and *aim* were set beforehand.",
        "Validation is never left out: *one call* checks the mesh, sorts its corners and evaluates;",
        "*repeated* moves the points of a mesh (`mesh.with_points(points)`, which checks them; of",
        "`mesh.reordered()`, which was made before) and evaluates. A *copy* reads and writes the 24 + 24",
        "bytes a vertex that the mean curvature normal",
        "reads and writes, on as many threads. Every round has an order of its own. Grids and copies are",
        "called once a round: what they read and write was last used by another of them, and of 65 536",
        "and a million vertices may still be in the last cache. Face lists and their peers are called",
        "again until 0.1 s have passed, and the last call counts. *numpy.take* does nothing but bring",
        "points into a random order: so memory's own cost grows there. *First call* is a fresh process,",
        "until its result is there; *nothing compiled* are processor seconds of one with an empty cache.",
        "*Warm* are processor times of the same calls by this and by another checkout, named by --against,",
        "each in a process of its own, in turn. Matrices of quads by *igl.cotmatrix* are those of triangles,",
        "of *igl.cotmatrix(V, I, C)* those of the quads themselves (Bunge's). Fits are processor times on",
        "one thread, by mesh and by noise in spacings: libigl's over those of quartics over two rings, and",
        "microseconds a vertex of the default, which chooses degree and rings vertex by vertex.",
        "",
        machine(PEERS),
        "",
        f"Floating-point operations a vertex: {counted['all']} "
        f"({', '.join(f'{n} {name}' for name, n in counted.items() if name != 'all')}); "
        f"the thesis's implementation took {THESIS}. "
        f"A reciprocal root counts as two; made of products and sums as it is, the total is "
        f"{operations(newton=True)['all']}.",
    ]
    if peak:
        per = ", ".join(f"{who} {b:.0f}" for who, b in peak.items())
        lines += ["", f"Peak memory of one call beyond points and faces, bytes a vertex: {per}."]
    lines += [
        "",
        "| what | against | vertices | threads | median | quartiles | must | aim | reached |",
        "| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | --- |",
    ]
    for r in ratios:
        goal = ["", ""] if np.isnan(r.must) else [f"{r.must:.3g}", f"{r.aim:.3g}"]
        cells = [
            r.name,
            r.against,
            str(r.vertices),
            str(r.threads),
            f"{r.median:.3g}",
            f"{r.low:.3g} to {r.high:.3g}",
            *goal,
            r.verdict,
        ]
        lines.append(f"| {' | '.join(cells)} |")
    lines += ["", "Nanoseconds a vertex, median, 2 threads:", ""]
    for table in times.values():
        sizes = sorted(table)
        lines.append(f"| | {' | '.join(str(n) for n in sizes)} |")
        lines.append("| --- |" + " ---: |" * len(sizes))
        for name in table[sizes[0]]:
            row = [f"{np.median(table[n][name]) / n * 1e9:.1f}" if name in table[n] else "" for n in sizes]
            lines.append(f"| {name} | {' | '.join(row)} |")
        lines.append("")
    lines += ["## On a graphics processor", "", *gpu.lines(quick), ""]
    return "\n".join(lines)


@paper_style
def plots(output: Path, ratios: list[Ratio], times: Times) -> None:
    """Time a vertex against size, and how often faster than the peers."""
    fig, (left, right) = figure(1, 2, size=(9.2, 4.2), sharey=True)
    chosen = {
        left: ("grids", "grids", ("copy", "finite_volume, wrapped grid", "liu, open grid", "numpy")),
        right: (
            "faces",
            "face lists",
            (
                "finite_volume, repeated, natural",
                "finite_volume, repeated, shuffled",
                "finite_volume, one call, natural",
                "libigl",
                "VTK",
                "MeshLab",
                "robust_laplacian",
            ),
        ),
    }
    for axes, (table, title, names) in chosen.items():
        by_size = times[table]
        for i, name in enumerate(names):
            sizes = np.array([n for n in sorted(by_size) if name in by_size[n]])
            if sizes.size == 0:
                continue
            nanoseconds = [np.median(by_size[n][name]) / n * 1e9 for n in sizes]
            style = {"color": COLOURS[i % len(COLOURS)], "marker": MARKERS[i % len(MARKERS)]}
            axes.plot(sizes, nanoseconds, label=short(name), **style)
        axes.set(xscale="log", yscale="log", xlabel="vertices", title=title)
    left.legend(fontsize=7, loc="upper right")
    right.legend(fontsize=7, loc="lower right", ncols=2)
    left.set_ylabel("time per vertex (ns)")
    save_figure(fig, output, "performance-time")

    # A goal for each in the largest size that it is asked of.
    goals = {(r.name, r.against): r for r in ratios if not np.isnan(r.must) and "growth" not in r.name}
    fig, axes = figure(size=(7.2, 0.32 * len(goals) + 1.2))
    for i, r in enumerate(goals.values()):
        sign = 1 if r.must <= r.aim else -1
        share = [(x / r.must) ** sign for x in (r.low, r.median, r.high, r.aim)]
        axes.plot(sorted([share[0], share[2]]), [i, i], color=COLOURS[0])
        axes.plot(share[1], i, "o", color=COLOURS[0], label="measured, quartiles" if i == 0 else None)
        axes.plot(share[3], i, "|", color=COLOURS[1], markersize=10, label="aim" if i == 0 else None)
    axes.axvline(1, color=COLOURS[6], linewidth=0.9, label="must")
    labels = [short(f"{r.name} / {r.against}") for r in goals.values()]
    axes.set(
        xscale="log", xlabel="times better than it must be", yticks=range(len(goals)), yticklabels=labels
    )
    axes.minorticks_off()
    axes.set_xticks((0.5, 1, 2, 4), ("0.5", "1", "2", "4"))
    axes.invert_yaxis()
    axes.legend(fontsize=7)
    save_figure(fig, output, "performance-goals")
