"""Run the comparison: python -m comparisons.beyond."""

from comparisons import beyond
from comparisons.common import command

command(beyond)
