"""What the tests of comparison scripts share."""

from __future__ import annotations

from types import ModuleType

from matplotlib.figure import Figure
from matplotlib.text import Text

from comparisons import reproduction
from comparisons.claims import judge, markdown
from comparisons.figures import SIZE, paper_style
from comparisons.measured import Measured


def assert_as_declared(script: ModuleType, found: Measured) -> None:
    """Every verdict is the declared one, and the committed report says what is measured."""
    judged = judge(script.CLAIMS, found.numbers)
    assert [j.wrong for j in judged if j.wrong] == []
    committed = reproduction.REPORT.read_text(encoding="utf-8")
    assert reproduction.drift(markdown(judged), committed) == []


@paper_style
def drawn(script: ModuleType, found: Measured) -> dict[str, Figure]:
    """All figures of a script, laid out."""
    figures = {stem: make(found) for stem, make in script.FIGURES.items()}
    for figure in figures.values():
        figure.draw_without_rendering()
    return figures


def assert_one_size_of_type(figures: dict[str, Figure]) -> None:
    """Whatever is written in a figure has one size, but exponents and the like."""
    for stem, figure in figures.items():
        sizes = {
            text.get_fontsize() for text in figure.findobj(Text) if text.get_text() and text.get_visible()
        }
        assert sizes == {SIZE}, stem
