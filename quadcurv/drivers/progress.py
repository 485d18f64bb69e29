"""How far a long computation is, on standard error."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")


def tracked(items: Iterable[T], what: str, number: int, shown: bool) -> Iterable[T]:
    """So many items, with how many are done where that is to be shown."""
    if not shown:
        return items
    from rich.console import Console
    from rich.progress import track

    return track(items, what, number, console=Console(stderr=True))
