"""Tables and progress: what results look like as text, CSV and JSON."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

T = TypeVar("T")


def progress(items: Sequence[T], description: str, weight: int = 0) -> Iterable[T]:
    """Iterate behind a progress bar on a terminal, if the work is of a size to take seconds."""
    console = Console(stderr=True)
    if weight < 20_000 or not console.is_terminal:
        return items
    return track(items, description, console=console, transient=True)


def text_table(title: str, columns: Sequence[str]) -> Table:
    """Empty rich table that fits 80 columns, the first one to the left."""
    found = Table(
        title=title,
        title_justify="left",
        min_width=len(title),
        box=None,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for i, column in enumerate(columns):
        found.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    return found


def short(value: float) -> str:
    """Two digits and the exponent without its padding: 1.2e-3."""
    mantissa, _, exponent = f"{value:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def write_csv(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows of the same keys to a CSV file."""
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def finite(value: Any) -> Any:
    """JSON has no NaN: None instead."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
