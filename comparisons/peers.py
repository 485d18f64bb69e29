"""H, K, k1 and k2 by every library at hand beside our schemes: errors on 16 meshes, time and memory.

    python -m comparisons.peers           PEERS.md is written, in some minutes
    python -m comparisons.peers --ours    our schemes alone anew, other libraries as in the last run
    python -m comparisons.peers --quick   coarser meshes, into the output folder

Libraries that are not installed are left out, and named; see :mod:`comparisons.libraries`.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import resource
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console

from comparisons import cases
from comparisons.cases import Case
from comparisons.children import surviving
from comparisons.common import OUTPUT
from comparisons.figures import COLOURS, MARKERS, figure, paper_style, save_figure
from comparisons.libraries import OURS, PEERS, QUANTITIES, Method, ours, quirks
from quadcurv.schemes import SCHEMES, Laplacian
from quadcurv.surfaces import cubed_sphere
from quadcurv.tables import by_column, write_csv

DEFAULT, MATRIX = "jet", "bilinear"
CHOICE = ("<!-- choice of operator -->", "<!-- end of choice -->")
FULL, QUICK = 32, 8
Record = dict[str, Any]


class Cost(NamedTuple):
    """Of one call, a vertex; bytes are NaN where they are not known."""

    microseconds: float
    bytes: float


# The meshes ---------------------------------------------------------------------------------------


def _ellipsoid(n: int) -> Case:
    return cases.on(cases.ellipsoid(), cases.cubed(n))


def _noisy(n: int, level: float) -> Case:
    return _ellipsoid(n).noisy(level)


def _star(n: int) -> Case:
    return cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), int(np.log2(n)) - 1))


MESHES: Mapping[str, tuple[str, Callable[[int], Case]]] = {
    "smooth": ("cubed ellipsoid", _ellipsoid),
    "jitter": (
        "cubed ellipsoid, vertices moved within it by up to 20 % of the spacing",
        lambda n: cases.ellipsoid().jittered(cases.cubed(n), 0.2),
    ),
    "mixed": ("cubed ellipsoid, 30 % of the quads cut into triangles", lambda n: cases.mixed(_ellipsoid(n))),
    "pillow": ("pillow sphere: folds, and four vertices of valence 2", lambda n: cases.pillow(2 * n)),
    "valence 3 and 5": ("star-shaped surface, subdivided as by Catmull and Clark", _star),
    "slanted": ("torus, slanted grid", lambda n: cases.ring_grid(4 * n, 2 * n, 0.8)),
    "border": ("open patch, its border too", lambda n: cases.patch(2 * n)),
    "border, jitter": (
        "open patch, vertices moved along it by up to 20 %, its border too",
        lambda n: cases.patch(2 * n, 0.2),
    ),
    **{
        f"noise {text}": (f"cubed ellipsoid, noise of {text} of the spacing", partial(_noisy, level=level))
        for text, level in (("1e-3", 1e-3), ("1e-2", 1e-2), ("5e-2", 5e-2))
    },
    "aspect 20:1": ("torus, cells long along its large circle", lambda n: cases.ring_grid(n, 10 * n)),
    "bump": ("bump, five cells wide", lambda n: cases.bump(2 * n)),
    "26 vertices": ("cubed ellipsoid, coarse", lambda n: _ellipsoid(2)),
    "98 vertices": ("cubed ellipsoid, coarse", lambda n: _ellipsoid(4)),
    "fillet": (
        "cube, edges and corners rounded by eight cells; where it has curvature",
        lambda n: cases.fillet(n // 8 * 5, 8),
    ),
}


# What is measured ---------------------------------------------------------------------------------


def processor() -> float:
    """Processor seconds so far, of programs that were started too."""
    both = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(used.ru_utime + used.ru_stime for used in both)


def measured(method: Method, case: Case) -> Record:
    """Mean and largest error of every quantity where there is a result, how many have none, seconds."""
    start = processor()
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        found = method.call(case.mesh)
    record: Record = {"seconds": processor() - start, "vertices": len(case.H), "without": 0}
    for quantity, values in found.items():
        exact = getattr(case, quantity)
        error = np.abs(values - exact)[np.isfinite(exact)]
        known = error[np.isfinite(error)]
        record[f"{quantity} mean"] = float(known.mean()) if known.size else np.nan
        record[f"{quantity} max"] = float(known.max()) if known.size else np.nan
        record["without"] = max(record["without"], error.size - known.size)
    return record


def errors(method: Method, n: int, first: int = 0) -> Iterator[Record]:
    """One record a mesh, from the first one that is asked for."""
    for name, (_, make) in list(MESHES.items())[first:]:
        who = {"mesh": name, "method": method.name, "ours": method.library == OURS}
        yield who | measured(method, make(n))


def survey(name: str, n: int, cost_size: int) -> tuple[list[Record], Cost]:
    """Errors and cost of a method; where it ends its process a record has no errors and says so."""
    cost, *found = surviving(_surveyed, 1 + len(MESHES), name, n, cost_size)
    if cost is None:
        raise RuntimeError(f"{name}: ended its process before anything was measured")
    ended = {"method": name, "ours": False, "ended": True}
    return [{"mesh": mesh, **ended} if r is None else r for mesh, r in zip(MESHES, found, strict=True)], cost


def _surveyed(first: int, name: str, n: int, cost_size: int) -> Iterator[Cost | Record]:
    method = next(m for m in (*PEERS, *ours()) if m.name == name)
    if first == 0:
        yield cost_of(method, cost_size)
    yield from errors(method, n, max(first - 1, 0))


def hindsight(chosen: Sequence[Case], quantities: Sequence[str] = ("H",)) -> list[list[float]]:
    """Mean errors of the best peer on each mesh, of those with values at 99 % of the vertices at least."""
    records = surviving(_measured, len(chosen) * len(PEERS), chosen)
    by_mesh = [records[i : i + len(PEERS)] for i in range(0, len(records), len(PEERS))]
    return [[min(error(r, q) for r in some if r and complete(r, q)) for q in quantities] for some in by_mesh]


def _measured(first: int, chosen: Sequence[Case]) -> Iterator[Record]:
    pairs = [(case, method) for case in chosen for method in PEERS]
    for case, method in pairs[first:]:
        yield {} if method.missing else measured(method, case)


# Who is first -------------------------------------------------------------------------------------


def error(record: Record, quantity: str) -> float:
    """Mean error of "H", "K", or of "k", the mean of those of k1 and k2; NaN where a method has none."""
    names = ("k1", "k2") if quantity == "k" else (quantity,)
    return float(np.mean([record.get(f"{name} mean", np.nan) for name in names]))


def complete(record: Record, quantity: str) -> bool:
    """Whether a method has the quantity at 99 % of the vertices at least."""
    return bool(np.isfinite(error(record, quantity))) and record["without"] <= 0.01 * record["vertices"]


@dataclass(frozen=True)
class Standing:
    """Where we stand on one mesh: the best peer, our default and our best, in hindsight, by mean errors.

    Attributes
    ----------
    mesh, peer, best : str
        Names of the mesh, of the best peer, of our best scheme.
    peer_error, default_error, best_error : float
        NaN where nobody has the quantity.
    """

    mesh: str
    peer: str
    peer_error: float
    default_error: float
    best: str
    best_error: float

    @property
    def ratio(self) -> float:
        """The best peer's error over that of our default."""
        return self.peer_error / self.default_error

    @property
    def best_ratio(self) -> float:
        """The best peer's error over that of our best."""
        return self.peer_error / self.best_error


def word(ratio: float) -> str:
    """What a ratio of a peer's error to ours means: "first", "equal" within half a per cent, "behind"."""
    if not np.isfinite(ratio):
        return "behind"
    if abs(ratio - 1) <= 0.005:
        return "equal"
    return "first" if ratio > 1 else "behind"


def standings(records: Sequence[Record], quantity: str) -> list[Standing]:
    """One a mesh."""
    found = []
    for mesh in dict.fromkeys(r["mesh"] for r in records):
        here = [r for r in records if r["mesh"] == mesh and complete(r, quantity)]
        peer, best = (
            min((r for r in here if r["ours"] == own), key=lambda r: error(r, quantity), default=None)
            for own in (False, True)
        )
        default = next((r for r in here if r["method"] == DEFAULT), None)
        values = [np.nan if r is None else error(r, quantity) for r in (peer, default, best)]
        names = ["none" if r is None else r["method"] for r in (peer, best)]
        found.append(Standing(mesh, names[0], values[0], values[1], names[1], values[2]))
    return found


TITLES = {"H": "Mean curvature H", "K": "Gaussian curvature K", "k": "Principal curvatures k1 and k2"}


def opening(records: Sequence[Record], quantity: str) -> list[str]:
    """The table of standings of a quantity, and the sentences that follow from it."""
    found = standings(records, quantity)
    lines = [
        f"### {TITLES[quantity]}",
        "",
        f"| mesh | best peer | its error | `{DEFAULT}` | peer / `{DEFAULT}` | "
        "| our best | its error | peer / ours | |",
        "| --- | --- | ---: | ---: | ---: | --- | --- | ---: | ---: | --- |",
    ]
    for s in found:
        lines.append(
            f"| {s.mesh} | {s.peer} | {s.peer_error:.1e} | {s.default_error:.1e} | {s.ratio:.3g} | "
            f"{word(s.ratio)} | {s.best} | {s.best_error:.1e} | {s.best_ratio:.3g} | {word(s.best_ratio)} |"
        )
    return [*lines, "", verdict(found, lambda s: s.ratio, f"`{DEFAULT}`"), "",
            verdict(found, lambda s: s.best_ratio, "The best of our schemes, in hindsight,"), ""]  # fmt: skip


def verdict(found: Sequence[Standing], ratio: Callable[[Standing], float], who: str) -> str:
    """Sentence on where we are first and where we are not."""
    words = {s.mesh: word(ratio(s)) for s in found}
    groups = {w: [m for m, has in words.items() if has == w] for w in ("first", "equal", "behind")}
    text = f"{who} is first on {len(groups['first'])} of {len(found)} meshes"
    if groups["equal"]:
        text += f", equal to the best peer on {len(groups['equal'])} ({'; '.join(groups['equal'])})"
    if groups["behind"]:
        return f"{text}, and not first on {len(groups['behind'])}: {'; '.join(groups['behind'])}."
    return f"{text}."


def choice(records: Sequence[Record]) -> list[str]:
    """Which of our schemes to take on which mesh, between two marks that the documentation looks for."""
    lines = [
        CHOICE[0],
        "",
        f"| mesh | best for H | `{DEFAULT}` / best | best Laplacian | `{MATRIX}` / best | best for K "
        f"| `{DEFAULT}` / best |",
        "| --- | --- | ---: | --- | ---: | --- | ---: |",
    ]
    others = []
    for mesh in dict.fromkeys(r["mesh"] for r in records):
        here = [r for r in records if r["mesh"] == mesh and r["ours"]]
        laplacians = [r for r in here if isinstance(SCHEMES.get(r["method"]), Laplacian)]
        H, matrix, K = _best(here, "H", DEFAULT), _best(laplacians, "H", MATRIX), _best(here, "K", DEFAULT)
        if H[1] > 1.1 or not np.isfinite(H[1]):
            others.append(f"{mesh} (`{H[0]}`, {H[1]:.2g} times)")
        cells = (f"{name} | {ratio:.2f}" for name, ratio in (H, matrix, K))
        lines.append(f"| {mesh} | {' | '.join(cells)} |")
    count = len(lines) - 4
    text = (
        f"`{DEFAULT}` is the best of ours for H, or within 10 % of it, on {count - len(others)} of {count}."
    )
    if others:
        text += f" Elsewhere another has less error, by the factor given: {'; '.join(others)}."
    return [*lines, "", text, "", CHOICE[1], ""]


def _best(records: Sequence[Record], quantity: str, of: str) -> tuple[str, float]:
    """Method of the least error, and the error of another one over that."""
    known = {r["method"]: error(r, quantity) for r in records if complete(r, quantity)}
    if not known:
        return "none", np.nan
    best = min(known, key=lambda name: known[name])
    return best, known.get(of, np.nan) / known[best]


# Time and memory ----------------------------------------------------------------------------------


def cost_of(method: Method, n: int) -> Cost:
    """Processor microseconds, and bytes of the peak memory beyond the mesh, a vertex of one call."""
    method.call(cases.cubed(8))  # compiled and imported
    mesh = cases.cubed(n)
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")  # the peak so far is forgotten
    before = _mebibytes("VmRSS")
    method.call(mesh)
    memory = _mebibytes("VmHWM") - before
    seconds: list[float] = []
    while not seconds or (len(seconds) < 3 and sum(seconds) < 0.3):
        start = processor()
        method.call(mesh)
        seconds.append(processor() - start)
    if method.library == "CGAL":  # whose memory is that of another program
        memory = np.nan
    return Cost(1e6 * min(seconds) / len(mesh.points), memory * 2**20 / len(mesh.points))


def _mebibytes(key: str) -> float:
    """Memory in use, or its peak, as Linux tells; NaN elsewhere."""
    try:
        lines = Path("/proc/self/status").read_text().splitlines()
    except OSError:
        return np.nan
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith(key))


# What is written ----------------------------------------------------------------------------------


def markdown(
    records: Sequence[Record],
    cost: Mapping[str, Cost],
    cost_size: int,
    methods: Sequence[Method],
) -> str:
    """Everything as Markdown."""
    lines = [
        "# Curvature by other libraries, and by ours",
        "",
        "## Who is first",
        "",
        f"Mean errors on {len(MESHES)} meshes whose exact curvature is known: of the best peer in hindsight,",
        f"of our default `{DEFAULT}`, and of our best in hindsight. A peer's error over ours is above 1",
        "where we are first; within half a per cent we are equal. Who has no value at more than 1 % of the",
        "vertices does not count. No method was tuned; those with a radius stand with several.",
        "",
    ]
    for quantity in TITLES:
        lines += opening(records, quantity)
    lines += ["## Which of ours", "", "Mean errors over those of the best of our schemes, in hindsight.", ""]
    lines += choice(records)
    lines += [
        "Written by `python -m comparisons.peers`. Errors are in 1 / length, of K in 1 / length^2; the",
        "surfaces are of size 2 to 6.",
        "",
        "## Mesh by mesh",
        "",
    ]
    for mesh in dict.fromkeys(r["mesh"] for r in records):
        lines += _details(mesh, [r for r in records if r["mesh"] == mesh])
    lines += [
        "## Time and memory",
        "",
        f"One call on a cubed ellipsoid of {6 * cost_size**2 + 2} vertices, after one on a small mesh; each",
        "in a process of its own. Processor time of all threads, for all quantities that a method has;",
        "memory is what the peak grew by.",
        "",
        "| method | microseconds a vertex | bytes a vertex | quads | result |",
        "| --- | ---: | ---: | --- | --- |",
    ]
    by_name = {m.name: m for m in methods}
    for name, (micro, memory) in sorted(cost.items(), key=lambda item: item[1][0]):
        method = by_name[name]
        size = "" if np.isnan(memory) else f"{memory:.0f}"
        lines.append(f"| {name} | {micro:.2f} | {size} | {method.quads} | {method.note} |")
    lines += ["", "## Not usable", "", "| what | why |", "| --- | --- |"]
    sphere = cubed_sphere().sample((16, 16), "faces")[0]
    lines += [f"| {name} | {why} |" for name, why in quirks(sphere).items()]
    lines += [f"| {m.name} | not here: {m.missing} |" for m in PEERS if m.missing]
    return "\n".join(lines) + "\n"


def _details(mesh: str, records: Sequence[Record]) -> list[str]:
    title = MESHES[mesh][0]
    lines = [
        f"### {mesh[0].upper()}{mesh[1:]}",
        "",
        f"{title[0].upper()}{title[1:]}. {max(r.get('vertices', 0) for r in records)} vertices.",
        "",
        "| method | H mean | H max | K mean | K max | k1 mean | k2 mean | without |",
        "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    for r in sorted(records, key=lambda r: (np.nan_to_num(error(r, "H"), nan=np.inf), error(r, "K"))):
        values = [r.get(f"{name}") for name in ("H mean", "H max", "K mean", "K max", "k1 mean", "k2 mean")]
        cells = ["" if x is None else f"{x:.1e}" for x in values]
        without = "ended its process" if "ended" in r else r["without"] or ""
        lines.append(f"| {r['method']} | {' | '.join(cells)} | {without} |")
    return [*lines, ""]


SHOWN = (
    "finite_volume",
    "bilinear",
    "cotan-6-voronoi",
    "jet",
    "libigl Bunge",
    "libigl principal, radius 2",
    "CGAL jet 4, 2 rings",
    "MeshLab APSS",
    "PyGEL quadric",
    "robust_laplacian",
)


@paper_style
def draw(records: Sequence[Record], output: Path) -> None:
    """Mean error of H against processor time a vertex, ours filled and others open."""
    fig, axes = figure(2, 2, size=(7.2, 6.6), sharey=True, sharex=True)
    for ax, mesh in zip(axes.flat, ("smooth", "jitter", "slanted", "noise 1e-2"), strict=True):
        here = {r["method"]: r for r in records if r["mesh"] == mesh}
        for i, name in enumerate(name for name in SHOWN if name in here):
            r = here[name]
            ax.plot(
                [1e6 * r["seconds"] / r["vertices"]],
                [r["H mean"]],
                color=COLOURS[i % len(COLOURS)],
                marker=MARKERS[(i + i // len(COLOURS)) % len(MARKERS)],
                fillstyle="full" if r["ours"] else "none",
                linestyle="none",
                label=name,
            )
        ax.set_title(mesh)
        ax.set_xscale("log")
        ax.set_yscale("log")
    for ax in axes[1]:
        ax.set_xlabel("microseconds a vertex")
    for ax in axes[:, 0]:
        ax.set_ylabel("mean error of $H$ (1/length)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=3)
    save_figure(fig, output, "peers")


def save(records: Sequence[Record], cost: Mapping[str, Cost], output: Path) -> None:
    """Write all that was measured as JSON, and the errors as CSV, NaN where a method has no such quantity."""
    output.mkdir(parents=True, exist_ok=True)
    columns = ["mesh", "method", "ours", "vertices", "without", "seconds"]
    columns += [f"{q} {norm}" for q in QUANTITIES for norm in ("mean", "max")]
    write_csv(output / "peers.csv", by_column([{c: r.get(c, np.nan) for c in columns} for r in records]))
    (output / "peers.json").write_text(json.dumps({"records": records, "cost": cost}))


def others(output: Path, methods: Sequence[Method]) -> tuple[list[Record], dict[str, Cost]]:
    """What the last run in a folder says of methods.

    Raises
    ------
    ValueError
        It was of other methods or meshes.
    """
    given = json.loads((output / "peers.json").read_text())
    names = {m.name for m in methods}
    records = [r for r in given["records"] if r["method"] in names]
    if {(r["mesh"], r["method"]) for r in records} != {(mesh, name) for mesh in MESHES for name in names}:
        raise ValueError(f"{output / 'peers.json'} is of other methods or meshes: run without --ours")
    return records, {name: Cost(*given["cost"][name]) for name in names}


def main() -> None:
    """Measure, and write PEERS.md, the figure and the numbers behind them."""
    raw = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=raw)
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder for figures and tables")
    parser.add_argument("--quick", action="store_true", help="coarser meshes, into the folder")
    parser.add_argument("--ours", action="store_true", help="other libraries as in the last run there")
    options = parser.parse_args()
    console = Console()
    start = time.perf_counter(), processor()
    own, rest = list(ours()), [m for m in PEERS if not m.missing]
    methods = rest + own
    n, cost_size = (QUICK, 16) if options.quick else (FULL, 64)
    records, cost = others(options.output, rest) if options.ours else ([], {})
    for method in own if options.ours else methods:
        found, cost[method.name] = survey(method.name, n, cost_size)
        records += found
        console.print(f"{method.name}: {time.perf_counter() - start[0]:.0f} s", highlight=False)
    records.sort(key=lambda r: list(MESHES).index(r["mesh"]))
    save(records, cost, options.output)
    draw(records, options.output)
    text = markdown(records, cost, cost_size, methods)
    target = options.output / "PEERS.md" if options.quick else Path(__file__).with_name("PEERS.md")
    target.write_text(text)
    console.print(
        f"{target} in {time.perf_counter() - start[0]:.0f} s, {processor() - start[1]:.0f} s of the processor"
    )


if __name__ == "__main__":
    main()
