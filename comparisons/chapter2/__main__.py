"""Run the comparison: python -m comparisons.chapter2."""

from comparisons import chapter2
from comparisons.common import command

command(chapter2)
