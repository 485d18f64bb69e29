"""What lies past one machine's memory: grids from disk, blocks, parts; processor time, memory, and paper.

Every row is measured in a process of its own: processor seconds of the work and of its children, and the
most memory that the process held at any time. Sections can be run one by one, the others are kept:

    python -m comparisons.scale [SECTION ...] [--quick] [--folder FOLDER]
"""

from __future__ import annotations

import argparse
import importlib
import json
import os
import platform
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

REPORT = Path(__file__).with_name("SCALE.md")
LIBRARIES = ("numpy", "numba", "dask", "distributed", "zarr", "xarray", "h5py")
INTRODUCTION = """# Scale

Written by `python -m comparisons.scale`. Every row is a process of its own. *CPU* is the processor time of
the work, reading and writing included, of all threads and of worker processes, after a small run that
compiles. *Peak* is the most memory that the process held at any time, 150 MB of it Python with its
libraries; of workers it is that of the largest one."""


@dataclass(frozen=True)
class Cost:
    """What a job cost.

    Attributes
    ----------
    cpu : float
        Processor seconds, those of children too.
    peak : float
        Most memory of the process, or of the largest of its children, in 10^6 bytes.
    told : dict
        What the job returned.
    """

    cpu: float
    peak: float
    told: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Setting:
    """Where and how large.

    Attributes
    ----------
    folder : Path
        For files.
    quick : bool
        Small sizes, as the tests take them.
    """

    folder: Path
    quick: bool


Section = Callable[[Setting], list[str]]
"""Measures, and gives the lines of a section of the report."""


def cost(job: str, *given: Any) -> Cost:
    """Run a job, "module:function", in a process of its own on arguments that JSON can hold.

    The function gets the arguments, and returns None or a dictionary that JSON can hold. It calls
    :func:`begin` where the work begins that is to be measured; what comes before, such as compiling, is not.
    """
    run = subprocess.run(
        [sys.executable, "-m", "comparisons.scale", "--job", job, json.dumps(given)],
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return Cost(**json.loads(run.stdout.splitlines()[-1]))


_begun = 0.0


def begin() -> None:
    """What has been spent so far is not counted."""
    global _begun
    _begun = _spent()


def _spent() -> float:
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(u.ru_utime + u.ru_stime for u in used)


def _run_job(job: str, given: str) -> None:
    told = _named(job)(*json.loads(given)) or {}
    spent = _spent() - _begun
    print(json.dumps({"cpu": spent, "peak": _peak(), "told": told}))


def _peak() -> float:
    """Most memory of this process, or of the largest of its children, in 10^6 bytes."""
    unit = 1 if sys.platform == "darwin" else 1024
    children = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit
    own = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    try:  # the other figure is, at the least, that of the process which started this one
        lines = Path("/proc/self/status").read_text().splitlines()
        own = next(1024 * int(line.split()[1]) for line in lines if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        pass
    return max(own, children) / 1e6


def _named(name: str) -> Any:
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def table(header: Sequence[str], rows: Sequence[Sequence[object]]) -> list[str]:
    """Lines of a table whose first column is text."""

    def cells(row: Sequence[object]) -> str:
        return "| " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row) + " |"

    return [cells(header), "| --- |" + " ---: |" * (len(header) - 1), *map(cells, rows)]


SECTIONS: dict[str, tuple[str, str]] = {
    "grids": ("Grids from disk", "comparisons.scale_grids:section"),
    "dask": ("Grids through dask", "comparisons.scale_grids:dask_section"),
    "faces": ("Face lists in parts", "comparisons.scale_faces:section"),
    "gpu": ("On a graphics processor", "comparisons.gpu:section"),
    "paper": ("On paper", "comparisons.scale_paper:section"),
}
"""By name: the heading, and the `Section` that measures, as "module:function"."""


def machine(libraries: Sequence[str] = LIBRARIES) -> str:
    """Python, the cores and the versions of libraries."""
    versions = []
    for name in libraries:
        try:
            versions.append(f"{name} {version(name)}")
        except PackageNotFoundError:
            versions.append(f"no {name}")
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return f"Python {platform.python_version()}, {cores} cores, {', '.join(versions)}."


def kept_sections(report: Path) -> dict[str, list[str]]:
    """The lines below each heading of a report, none if there is no file."""
    found: dict[str, list[str]] = {}
    lines: list[str] = []
    for line in report.read_text().splitlines() if report.exists() else []:
        if line.startswith("## "):
            lines = found.setdefault(line[3:], [])
        else:
            lines.append(line)
    return found


def main(
    names: Sequence[str] = (), quick: bool = False, folder: Path | None = None, report: Path = REPORT
) -> Path:
    """Measure sections, all if none is named, and write the report with the others as they were."""
    for name in names:
        if name not in SECTIONS:
            raise ValueError(f"section: expected some of {', '.join(SECTIONS)}, got {name!r}")
    kept = kept_sections(report)
    with tempfile.TemporaryDirectory(dir=folder) as place:
        for name, (heading, section) in SECTIONS.items():
            if names and name not in names:
                continue
            start = time.perf_counter()
            kept[heading] = ["", machine(), "", *_named(section)(Setting(Path(place), quick)), ""]
            print(f"{name}: {time.perf_counter() - start:.1f} s", file=sys.stderr, flush=True)
            text = [INTRODUCTION, ""]
            for known, _ in SECTIONS.values():
                if known in kept:
                    text += [f"## {known}", *kept[known]]
            report.write_text("\n".join(text).rstrip() + "\n")
    return report


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m comparisons.scale", description=__doc__)
    parser.add_argument("sections", nargs="*", metavar="SECTION", help="by default all")
    parser.add_argument("--quick", action="store_true", help="small sizes, as the tests take them")
    parser.add_argument("--folder", type=Path, help="where files are written, 20 GB of them")
    parser.add_argument("--report", type=Path, default=REPORT)
    parser.add_argument("--job", nargs=2, help=argparse.SUPPRESS)
    return parser.parse_args()


if __name__ == "__main__":
    # One module, whether it is run or imported by the sections.
    from comparisons import scale

    given = _arguments()
    if given.job:
        scale._run_job(*given.job)
    else:
        print(scale.main(given.sections, given.quick, given.folder, given.report))
