"""Run the comparison: python -m comparisons.chapter3."""

from comparisons import chapter3
from comparisons.common import command

command(chapter3)
