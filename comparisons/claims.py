"""Claims of the thesis: the numbers they rest on, what each must be, and the verdict that follows.

A claim prints no number that it does not judge: every place in its sentence belongs to a `Number`, which
says where the measured value may lie. The verdict is the declared one if all of them lie there.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from rich.console import Console
from rich.table import Table
from rich.text import Text

from quadcurv.tables import WIDTH, short

Verdict = Literal[
    "reproduced", "reproduced only if ...", "not reproduced", "slip", "holds", "undecided", "changed"
]

# What a verdict becomes when a number leaves its range. Of a slip, or of what was found not to hold, a
# wrong number proves nothing.
_OTHERWISE: dict[Verdict, Verdict] = {
    "reproduced": "not reproduced",
    "reproduced only if ...": "not reproduced",
    "not reproduced": "undecided",
    "slip": "undecided",
    "holds": "changed",  # of findings beyond the thesis
}
_STYLES = {"reproduced": "green", "holds": "green", "not reproduced": "red"}


@dataclass(frozen=True)
class Number:
    """A measured number and where it must lie.

    Attributes
    ----------
    key : str
        Of the results.
    low, high : float
        Ends of the range, which belong to it; NaN lies in none.
    required : str
        The range in words.
    form : str
        Format of the number; empty where it is shown as the range it lies in, since machines differ in it.
    """

    key: str
    low: float
    high: float
    required: str
    form: str = ""

    def holds(self, value: float) -> bool:
        """Whether a value lies in the range."""
        return bool(self.low <= value <= self.high)

    def shown(self, value: float) -> str:
        """Text of a value."""
        if not self.form:
            return self.required if self.holds(value) else short(value)
        text = short(value) if self.form == "e" else f"{value:{self.form}}"
        return text.lstrip("-") if float(text) == 0 else text


def rate(key: str, order: float, by: float = 0.05) -> Number:
    """A rate of convergence near an order."""
    return Number(key, order - by, order + by, f"{order:g} ± {by:g}", ".2f")


def near(key: str, value: float, percent: float = 3.0, form: str = "") -> Number:
    """A number within some per cent of the one that is known."""
    low, high = sorted(value * (1 + sign * percent / 100) for sign in (-1, 1))
    return Number(key, low, high, f"{_text(value)} ± {percent:g} %", form or _form(value))


def equal(key: str, value: float, form: str = ".2f") -> Number:
    """A number that is known exactly, up to rounding."""
    slack = 1e-9 * max(abs(value), 1e-3)
    return Number(key, value - slack, value + slack, f"{value:g}", form)


def between(key: str, low: float, high: float, form: str = "") -> Number:
    """A number in a range."""
    return Number(key, low, high, f"between {_text(low)} and {_text(high)}", form or _form(high))


def within(key: str, low: float, high: float) -> Number:
    """A number in a range, as which it is shown, since machines differ in it."""
    return Number(key, low, high, f"between {_text(low)} and {_text(high)}")


def below(key: str, power: int) -> Number:
    """An error that is rounding: below 10^-power, as which it is shown."""
    return Number(key, 0.0, 10.0**-power, f"below 1e-{power}")


def exactly(key: str, count: int) -> Number:
    """A count."""
    return Number(key, count, count, str(count), ".0f")


def _text(value: float) -> str:
    """Three digits, the exponent without its padding."""
    text = f"{value:.2e}" if 0 < abs(value) < 0.01 else f"{value:.3g}"
    mantissa, _, exponent = text.partition("e")
    return f"{float(mantissa):g}e{int(exponent)}" if exponent else mantissa


def _form(value: float) -> str:
    """Format of two or three digits for numbers of that size."""
    for above, form in ((100, ".0f"), (10, ".1f"), (0.095, ".2f"), (0.01, ".3f")):
        if abs(value) >= above:
            return form
    return "e"


@dataclass(frozen=True)
class Claim:
    """A claim of the thesis, and the sentence and numbers that answer it.

    Attributes
    ----------
    where : str
        Section, equation or figure.
    claim : str
        What is printed there.
    answer : str
        What comes out, with one pair of braces a number.
    numbers : tuple of Number
        In the order of the braces.
    verdict : str
        That of the claim if every number lies in its range.
    """

    where: str
    claim: str
    answer: str
    numbers: tuple[Number, ...]
    verdict: Verdict = "reproduced"

    def __post_init__(self) -> None:
        places = self.answer.count("{}")
        if places != len(self.numbers) or not places:
            raise ValueError(f"{self.where}: {places} places for {len(self.numbers)} numbers")

    def judged(self, results: Mapping[str, float]) -> Judgement:
        """What was measured and the verdict that follows."""
        values = [float(results.get(number.key, np.nan)) for number in self.numbers]
        measured = self.answer.format(
            *(number.shown(value) for number, value in zip(self.numbers, values, strict=True))
        )
        wrong = tuple(
            f"{number.key} = {value:.4g}, required {number.required}"
            for number, value in zip(self.numbers, values, strict=True)
            if not number.holds(value)
        )
        return Judgement(self, measured, _OTHERWISE[self.verdict] if wrong else self.verdict, wrong)

    @property
    def required(self) -> str:
        """Ranges of the numbers in their order, equal neighbours once."""
        texts = [number.required for number in self.numbers]
        return "; ".join(text for i, text in enumerate(texts) if i == 0 or text != texts[i - 1])


@dataclass(frozen=True)
class Judgement:
    """A claim beside what was measured.

    Attributes
    ----------
    claim : Claim
    measured : str
    verdict : str
    wrong : tuple of str
        The numbers outside of their ranges.
    """

    claim: Claim
    measured: str
    verdict: Verdict
    wrong: tuple[str, ...] = field(default=())


def judge(claims: Iterable[Claim], results: Mapping[str, float]) -> list[Judgement]:
    """Judge claims by results."""
    return [claim.judged(results) for claim in claims]


def print_judgements(judgements: Sequence[Judgement], title: str, console: Console) -> None:
    """Print claims with their verdicts, in 80 columns."""
    table = Table(
        title=Text(title, style="bold"), title_justify="left", box=None, width=WIDTH, padding=(0, 2, 1, 0)
    )
    table.add_column("verdict", no_wrap=True)
    table.add_column("claim, measured, required")
    for judgement in judgements:
        claim = judgement.claim
        text = Text(f"{claim.where}: {claim.claim}\n")
        text.append(judgement.measured, style="bold")
        text.append(f"\n[{claim.required}]", style="dim")
        for line in judgement.wrong:
            text.append(f"\nchanged: {line}", style="red")
        verdict = judgement.verdict.replace("reproduced only if ...", "only if ...")
        style = "red" if judgement.wrong else _STYLES.get(judgement.verdict, "yellow")
        table.add_row(Text(verdict, style=style), text)
    console.print(table)


def markdown(judgements: Sequence[Judgement]) -> str:
    """Claims as a Markdown table; numbers of figures in `where` are links to the pictures."""
    rows = [("where", "claim", "measured", "required", "verdict"), ("---",) * 5]
    rows += [
        (_linked(j.claim.where), j.claim.claim, j.measured, j.claim.required, j.verdict) for j in judgements
    ]
    lines = (" | ".join(cell.replace("|", "\\|") for cell in row) for row in rows)
    return "".join(f"| {line} |\n" for line in lines)


def _linked(where: str) -> str:
    text, figures, numbers = where.partition("Figure")
    links = re.sub(r"(\d)\.(\d+)", r"[\1.\2](output/figure_\1_\2.png)", numbers)
    return re.sub(r"^(\w+)\.png$", r"[figure](output/\1.png)", text) + figures + links
