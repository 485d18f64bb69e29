"""The whole thesis: all scripts, its claims beside what was measured, and the report REPRODUCTION.md."""

from __future__ import annotations

import re
import sys
from collections import Counter
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from importlib import import_module
from multiprocessing import get_context
from pathlib import Path

from rich.console import Console

from comparisons import overall
from comparisons.claims import Claim, Judgement, judge, markdown, print_judgements
from comparisons.common import OUTPUT, arguments, draw, measure, report_changes, save_series
from quadcurv.tables import WIDTH

REPORT = Path(__file__).with_name("REPRODUCTION.md")
SCRIPTS = ("chapter2", "chapter3", "chapter4", "beyond", "functions")
FIGURES = {2: 7, 3: 12, 4: 4}  # figures of each chapter
NUMBER = re.compile(r"(?<![\w.^])-?\d+(?:\.\d+)?(?:e-?\d+)?")
TWO_PLACES = re.compile(r"-?\d\.\d\d")
_WORKERS = 2
UNITS_OF_ROUNDING = re.compile(r"[\d.]+ eps")


def numbers_of_all(found: Iterable[dict[str, float]]) -> dict[str, float]:
    """Numbers of several scripts in one dict.

    Raises
    ------
    ValueError
        Two scripts have a number of one name.
    """
    together: dict[str, float] = {}
    for numbers in found:
        twice = together.keys() & numbers
        if twice:
            raise ValueError(f"numbers of one name in two scripts: {sorted(twice)}")
        together |= numbers
    return together


def sections() -> dict[str, list[Claim]]:
    """Claims by the title of their section, in the order of the report."""
    scripts = [import_module(f"comparisons.{name}") for name in SCRIPTS]
    chapters = {script.TITLE: script.CLAIMS for script in scripts if script.TITLE.startswith("Chapter")}
    rest = {script.TITLE: script.CLAIMS for script in scripts if script.TITLE not in chapters}
    return {
        "Chapter 1: introduction": overall.FIRST,
        **chapters,
        "Chapter 5: conclusion": overall.LAST,
        **rest,
    }


def report(judged: dict[str, list[Judgement]]) -> str:
    """Text of REPRODUCTION.md."""
    everything = [j for judgements in judged.values() for j in judgements]
    thesis = [j for j in everything if j.claim.verdict != "holds"]
    count = Counter(j.verdict for j in thesis)
    verdicts = ", ".join(f"{count[v]} {v.rstrip(' .')}" for v in sorted(count, key=lambda v: -count[v]))
    figures = ", ".join(
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
        f"{len(thesis)} claims: {verdicts}. A slip is a printed formula or reason that does not hold; what "
        "does is beside it. Every number is measured; *required* are the ranges in which they must lie, in "
        "their order, for the verdict: where one leaves its range the verdict falls, and the script exits "
        "with 1. Curvatures are in 1/length. kappa is the norm of the mean curvature normal, as in the "
        "thesis, H its signed length, positive on a sphere oriented outward. Layouts: the thesis says (4.1) "
        "that it compared the stencil of Figure 4.1, on the vertices of a mesh; but its Figures 4.2 to 4.4 "
        "are those of primal and dual points, on which alone the scheme is exact on the cylinder. Both are "
        "measured.",
        "",
        f"Figures: {figures}.",
    ]
    for title, judgements in judged.items():
        lines += ["", f"## {title}", "", markdown(judgements).rstrip()]
    return "\n".join(lines) + "\n"


def drift(fresh: str, committed: str) -> list[str]:
    """Lines of a fresh report that a committed one does not say: in other words, or off in a number.

    Numbers may differ by 5 %, rates and the like of two decimal places by 0.02; multiples of eps are not
    compared. Machines differ in them.
    """

    def words_and_numbers(line: str) -> tuple[str, list[str]]:
        line = UNITS_OF_ROUNDING.sub("some eps", line)
        return NUMBER.sub("#", line), NUMBER.findall(line)

    def near(new: str, old: str) -> bool:
        slack = 0.02 if TWO_PLACES.fullmatch(new) and TWO_PLACES.fullmatch(old) else 0.0
        return abs(float(new) - float(old)) <= 0.05 * abs(float(old)) + slack

    said: dict[str, list[list[str]]] = {}
    for words, numbers in map(words_and_numbers, committed.splitlines()):
        said.setdefault(words, []).append(numbers)
    return [
        line
        for line in fresh.splitlines()
        for words, numbers in [words_and_numbers(line)]
        if not any(all(map(near, numbers, known)) for known in said.get(words, []))
    ]


def run(name: str, output: Path, quick: bool) -> dict[str, float]:
    """Numbers of one script; its columns and, unless it is to be quick, its figures go to a folder."""
    script = import_module(f"comparisons.{name}")
    found = measure(script, f"{name}: ")
    save_series(found, output)
    if not quick and hasattr(script, "FIGURES"):
        draw(script, found, output, f"{name}: ")
    return found.numbers


def main(output: Path, quick: bool = False) -> dict[str, list[Judgement]]:
    """Run all scripts and write the report.

    Parameters
    ----------
    output : Path
        Folder of the figures; of a quick run also of REPRODUCTION.md, which else goes beside this file
        and links to ``output`` there.
    quick : bool
        No figures; all numbers are the same.

    Returns
    -------
    dict
        Judgements by section.

    Raises
    ------
    ValueError
        A full run into another folder, where the report's links would not lead.
    """
    if not quick and output.resolve() != OUTPUT.resolve():
        raise ValueError(f"output: the report beside {Path(__file__).name} links to figures in {OUTPUT}")
    names = (*SCRIPTS, "overall")
    with ProcessPoolExecutor(min(len(names), _WORKERS), get_context("spawn")) as pool:
        numbers = list(pool.map(run, names, [output] * len(names), [quick] * len(names)))
    together = numbers_of_all(numbers)
    judged = {title: judge(claims, together) for title, claims in sections().items()}
    path = output / REPORT.name if quick else REPORT
    path.write_text(report(judged), encoding="utf-8")
    print(f"figures in {output}, report in {path}", file=sys.stderr)
    return judged


if __name__ == "__main__":
    options = arguments(__doc__)
    found = main(options.output, options.quick)
    for title, judgements in found.items():
        print_judgements(judgements, title, Console(width=min(WIDTH, Console().width)))
    sys.exit(report_changes([j for judgements in found.values() for j in judgements]))
