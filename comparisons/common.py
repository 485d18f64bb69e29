"""What runs the comparison scripts: measure, judge, print, draw."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from matplotlib.figure import Figure
from rich.console import Console

from comparisons.claims import Judgement, judge, print_judgements
from comparisons.figures import paper_style, save_figure
from comparisons.maps import save_maps
from comparisons.measured import Measured
from quadcurv import viewing
from quadcurv.tables import WIDTH, short, text_tables, write_csv

OUTPUT = Path(__file__).parent / "output"
# Scripts -----------------------------------------------------------------------------------------


def measure(script: ModuleType, prefix: str = "") -> Measured:
    """Take the ``STEPS`` of a script, titles and functions of a `Measured`, saying which one it is at."""
    into = Measured()
    for i, (title, step) in enumerate(script.STEPS.items(), 1):
        with progress(f"{prefix}[{i}/{len(script.STEPS)}] {title}"):
            step(into)
    return into


@contextmanager
def progress(what: str) -> Iterator[None]:
    """Say on stderr what is being done, then how long it took: on a terminal, in a file and in a pipe."""
    start = time.perf_counter()
    print(what, end=": ", file=sys.stderr, flush=True)
    yield
    print(f"{time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)


@paper_style
def draw(script: ModuleType, found: Measured, output: Path, prefix: str = "") -> None:
    """Make the ``FIGURES`` of a script, and its ``MAPS`` and ``PAGES`` where it has any."""
    figures: dict[str, Callable[[Measured], Figure]] = script.FIGURES
    with progress(f"{prefix}{len(figures)} figures"):
        for stem, make in figures.items():
            save_figure(make(found), output, stem)
    maps = getattr(script, "MAPS", {})
    problem = None
    if maps:
        with progress(f"{prefix}{len(maps)} maps"):
            for stem, make in maps.items():
                problem = save_maps(make(), output, stem) or problem
    pages = getattr(script, "PAGES", {})
    if pages:
        with progress(f"{prefix}{len(pages)} pages"):
            for stem, make in pages.items():
                viewing.save_maps(make(), output / f"{stem}.html", "error")
    if problem:
        Console(stderr=True).print(f"Pages .html in place of pictures of the maps: {problem}")


def save_series(found: Measured, output: Path) -> None:
    """Write the columns of every figure, in full precision."""
    output.mkdir(parents=True, exist_ok=True)
    for stem, columns in found.series.items():
        write_csv(output / f"{stem}.csv", columns)


def print_tables(script: ModuleType, found: Measured, console: Console) -> None:
    """Print the columns of the ``TABLES`` of a script, one row a series, in 80 columns."""
    tabulated = getattr(script, "tabulated", lambda name: True)  # which of the columns
    for stem, title in script.TABLES.items():
        columns = found.series[stem]
        sizes = [f"{n:g}" for n in columns["n"]]
        rows = [
            [name, *map(short, values)] for name, values in columns.items() if name != "n" and tabulated(name)
        ]
        for table in text_tables(title, ["n", *sizes], rows):
            console.print(table)
        console.print()


def main(script: ModuleType, output: Path, quick: bool = False) -> Measured:
    """Measure, write the columns, and unless it is to be quick make the figures.

    Parameters
    ----------
    script : module
        A comparison script.
    output : Path
        Folder, made where there is none.
    quick : bool
        No figures and no maps; all numbers are the same.

    Returns
    -------
    Measured
    """
    found = measure(script)
    save_series(found, output)
    if not quick:
        draw(script, found, output)
    return found


def command(script: ModuleType) -> None:
    """Command line of a comparison script: claims, then tables; exits with 1 if a verdict has changed."""
    options = arguments(script.__doc__)
    console = Console(width=min(WIDTH, Console().width))
    found = main(script, options.output, options.quick)
    judgements = judge(script.CLAIMS, found.numbers)
    print_judgements(judgements, script.TITLE, console)
    print_tables(script, found, console)
    console.print(f"Figures and columns are in {options.output}", highlight=False, soft_wrap=True)
    sys.exit(report_changes(judgements))


def report_changes(judgements: Sequence[Judgement]) -> int:
    """Say on stderr which verdicts are not the declared ones; the exit status, 1 if there are any."""
    changed = [j for j in judgements if j.wrong]
    for judgement in changed:
        print(f"changed: {judgement.claim.where}: {'; '.join(judgement.wrong)}", file=sys.stderr)
    return int(bool(changed))


def arguments(description: str | None) -> argparse.Namespace:
    """Command line of a comparison script: output (folder) and quick (bool)."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--output", type=Path, default=OUTPUT, help="folder for figures and tables")
    parser.add_argument("--quick", action="store_true", help="numbers and verdicts alone, no figures")
    return parser.parse_args()
