"""Memory of the cotan schemes on a large mesh."""

from __future__ import annotations

import io

import pytest
from rich.console import Console

from comparisons import cotan_cost


def test_every_case_is_measured():
    console = Console(file=io.StringIO(), width=80)
    found = cotan_cost.main(30, console)
    assert list(found) == list(cotan_cost.CASES)
    assert found[cotan_cost.PLAIN]["ratio"] == 1
    assert all(cost["seconds"] > 0 for cost in found.values())
    assert "900 vertices" in console.file.getvalue()


@pytest.mark.slow
def test_a_million_vertices_fit_into_three_gib():
    found = cotan_cost.main(1000, Console(file=io.StringIO()))
    assert max(cost["GiB"] for cost in found.values()) < 3
