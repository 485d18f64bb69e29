"""What a measured number is to reach, and the word that follows from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


def verdict(value: float, must: float, aim: float) -> str:
    """Say "aim", "must" or "missed"; small values are asked for where must >= aim, large ones elsewhere.

    NaN is missed; where nothing is asked (must is NaN) there is no word.
    """
    if np.isnan(must):
        return ""
    sign = 1 if must <= aim else -1
    if sign * value >= sign * aim:
        return "aim"
    return "must" if sign * value >= sign * must else "missed"


@dataclass(frozen=True)
class Goal:
    """One row: what was measured, its worst value, where that was, and what it is to reach.

    Attributes
    ----------
    name, where : str
    value, must, aim : float
    """

    name: str
    value: float
    must: float
    aim: float
    where: str = ""

    @property
    def verdict(self) -> str:
        """Which of the two is reached."""
        return verdict(self.value, self.must, self.aim)


def table(goals: Sequence[Goal]) -> list[str]:
    """Goals as Markdown."""
    lines = [
        "| what | measured | must | aim | verdict | worst at |",
        "| --- | ---: | ---: | ---: | --- | --- |",
    ]
    for g in goals:
        asked = ["" if np.isnan(x) else f"{x:.3g}" for x in (g.must, g.aim)]
        lines.append(f"| {g.name} | {g.value:.3g} | {' | '.join(asked)} | {g.verdict} | {g.where} |")
    return lines


@dataclass(frozen=True)
class Ratio:
    """A ratio of two times (or bytes): median and quartiles over the rounds, and what it is to reach.

    Attributes
    ----------
    name, against : str
    vertices, threads : int
    low, median, high : float
    must, aim : float
        NaN where nothing is asked. A ratio that has to be small has must >= aim, others must <= aim.
    """

    name: str
    against: str
    vertices: int
    threads: int
    low: float
    median: float
    high: float
    must: float = np.nan
    aim: float = np.nan

    @property
    def verdict(self) -> str:
        """Which of the two is reached."""
        return verdict(self.median, self.must, self.aim)
