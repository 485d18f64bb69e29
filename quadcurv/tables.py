"""Tables and progress: what results look like as text, CSV and JSON."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track
from rich.table import Table
from rich.text import Text

from quadcurv.io.replacing import replacing

T = TypeVar("T")

WIDTH = 80
"""Columns of text that a table may take."""


def progress(items: Sequence[T], description: str, weight: int = 0) -> Iterable[T]:
    """Iterate behind a progress bar on a terminal, if the work is of a size to take seconds."""
    console = Console(stderr=True)
    if weight < 20_000 or not console.is_terminal:
        return items
    return track(items, description, console=console, transient=True)


def text_table(
    title: str, columns: Sequence[str], rows: Iterable[Sequence[str]], dim: Iterable[int] = ()
) -> Table:
    """Rich table that fits 80 columns, the first one to the left; no cell is read as markup.

    Parameters
    ----------
    title : str
    columns : sequence of str
    rows : iterable of sequence of str
    dim : iterable of int
        Rows in a fainter colour.
    """
    table = Table(
        title=Text(title, style="italic"),
        title_justify="left",
        min_width=min(len(title), WIDTH),
        box=None,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for i, column in enumerate(columns):
        table.add_column(Text(column), justify="left" if i == 0 else "right", no_wrap=True)
    faint = set(dim)
    for i, row in enumerate(rows):
        table.add_row(*map(Text, row), style="dim" if i in faint else None)
    return table


def text_tables(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> list[Table]:
    """As many tables as the columns need to fit 80 columns of text, each with the first of them."""
    widths = [max(map(len, column)) + 1 for column in zip(columns, *rows, strict=True)]
    tables: list[Table] = []
    start = 1
    while start < len(columns) or not tables:
        end = start + 1
        while end < len(columns) and widths[0] + sum(widths[start : end + 1]) <= WIDTH:
            end += 1
        part = [[row[0], *row[start:end]] for row in (columns, *rows)]
        tables.append(text_table(title, part[0], part[1:]))
        start = end
    return tables


def as_html(*tables: Any) -> str:
    """What a console would show, for a notebook: text in one width, no markup but its own."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_jupyter=False)
    console.print(*tables)
    block = '<pre style="line-height: 1.2; white-space: pre">{code}</pre>'
    return console.export_html(code_format=block, inline_styles=True)


_LATEX = {c: f"\\{c}" for c in "&%$#_{}"} | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}"}
_LATEX |= {"^": r"\textasciicircum{}", "|": "$|$", "<": "$<$", ">": "$>$"}


def as_latex(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Table for LaTeX with the package booktabs; numbers as a paper has them."""
    lines = [" & ".join(map(_latex, row)) + r" \\" for row in (columns, *rows)]
    return "\n".join(
        (
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{_latex(title)}}}",
            rf"\begin{{tabular}}{{l{'r' * (len(columns) - 1)}}}",
            r"\toprule",
            lines[0],
            r"\midrule",
            *lines[1:],
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        )
    )


def _latex(text: str) -> str:
    number = re.fullmatch(r"(-?[\d.]+)(?:e([+-]?\d+))?", text)
    if number is None:
        return "".join(_LATEX.get(c, c) for c in text)
    power = f" \\cdot 10^{{{int(number[2])}}}" if number[2] else ""
    return f"${number[1]}{power}$"


def short(value: float) -> str:
    """Two digits and the exponent without its padding: 1.2e-3."""
    mantissa, _, exponent = f"{value:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def write_csv(path: str | Path, columns: Mapping[str, ArrayLike]) -> None:
    """Write columns of one length to a CSV file, numbers in full precision.

    Parameters
    ----------
    path : path-like
    columns : mapping of str to (n,) or (n, 3) array_like
        Vectors take three columns: NAME_x, NAME_y and NAME_z; those of the empty name x, y and z.

    Raises
    ------
    ValueError
        Columns of different lengths.
    OSError
        It cannot be written; a file that was there is as it was.
    """
    flat: dict[str, list[Any]] = {}
    for name, given in columns.items():
        values = np.asarray(given)
        if values.ndim == 1:
            flat[name] = values.tolist()
            continue
        for axis, component in zip("xyz", values.T, strict=True):
            flat[f"{name}_{axis}" if name else axis] = component.tolist()
    sizes = {name: len(values) for name, values in flat.items()}
    if len(set(sizes.values())) > 1:
        raise ValueError(f"columns: expected one length, got {sizes}")
    with replacing(path) as beside, open(beside, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(flat)
        writer.writerows(zip(*flat.values(), strict=True))


def by_column(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Records of the same keys as columns."""
    return {name: [row[name] for row in rows] for name in rows[0]}


def finite(value: Any) -> Any:
    """JSON has no NaN: None instead."""
    if isinstance(value, dict):
        return {k: finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [finite(v) for v in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
