"""The table of formats says what is so."""

from __future__ import annotations

import re

import pytest

from comparisons import formats
from quadcurv.io.base import FORMATS

TEXT = formats.TABLE.read_text(encoding="utf-8")


def written(suffix):
    """The row of a suffix in FORMATS.md."""
    (row,) = [line for line in TEXT.splitlines() if re.match(rf"\|.*\{suffix} ", line)]
    return formats.Kept(*(cell.strip() for cell in row.split("|")[2:-1]))


def test_every_format_has_a_row():
    for suffix, entry in FORMATS.items():
        assert written(suffix), entry
    assert formats.table({suffix: written(suffix) for suffix in sorted(FORMATS)}) == TEXT


@pytest.mark.parametrize("suffix", [".obj", ".off", ".ply", ".stl", ".vtp"])
def test_formats_keep_what_the_table_says(suffix):
    assert formats.kept(suffix) == written(suffix)


@pytest.mark.slow
def test_the_whole_table_is_so(tmp_path, capsys):
    for name in ("meshlane", "h5py", "netCDF4"):
        pytest.importorskip(name)
    formats.main(tmp_path / "FORMATS.md")
    assert (tmp_path / "FORMATS.md").read_text(encoding="utf-8") == TEXT
