"""Short tables for notebooks, of what has no table of text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def table(title: str, rows: Iterable[Sequence[str]], header: Sequence[str] = ()) -> str:
    """A table below its title, the first column to the left; nothing in it is read as markup."""
    lines = [f"<caption style='caption-side: top; text-align: left'>{escape(title)}</caption>"]
    if header:
        lines.append(_row("th", header))
    lines += [_row("td", row) for row in rows]
    return "<table>" + "".join(lines) + "</table>"


def _row(tag: str, cells: Sequence[str]) -> str:
    align = ["left", *["right"] * (len(cells) - 1)]
    inner = "".join(
        f"<{tag} style='text-align: {side}'>{escape(cell)}</{tag}>"
        for side, cell in zip(align, cells, strict=True)
    )
    return f"<tr>{inner}</tr>"
