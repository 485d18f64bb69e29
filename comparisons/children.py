"""Results from processes of their own, since some libraries end theirs."""

from __future__ import annotations

import contextlib
import multiprocessing
from collections.abc import Callable, Iterator
from multiprocessing.connection import Connection
from typing import Any


def surviving(results: Callable[..., Iterator[Any]], count: int, *given: Any) -> list[Any]:
    """The `count` results of ``results(first, *given)``, which begins at the one of number `first`.

    A result on whose way the process ends, by a signal or an exception, is None; another process goes on
    behind it.
    """
    context = multiprocessing.get_context("spawn")
    found: list[Any] = []
    while len(found) < count:
        ours, theirs = context.Pipe(duplex=False)
        child = context.Process(target=_send, args=(theirs, results, len(found), given))
        child.start()
        theirs.close()
        with contextlib.suppress(EOFError):
            while len(found) < count:
                found.append(ours.recv())
        child.join()
        if len(found) < count:
            found.append(None)
    return found


def _send(
    pipe: Connection, results: Callable[..., Iterator[Any]], first: int, given: tuple[Any, ...]
) -> None:
    for result in results(first, *given):
        pipe.send(result)
