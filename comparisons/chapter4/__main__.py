"""Run the comparison: python -m comparisons.chapter4."""

from comparisons import chapter4
from comparisons.common import command

command(chapter4)
