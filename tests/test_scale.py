"""The comparison of scale runs at small sizes; what a busy machine measures is not asserted, bits are."""

from __future__ import annotations

import numpy as np
import pytest

from comparisons import scale, scale_grids, scale_paper

pytest.importorskip("dask")
pytest.importorskip("zarr")


@pytest.mark.filterwarnings("default")
def test_quick_run(tmp_path):
    report = tmp_path / "SCALE.md"
    report.write_text("# Scale\n\n## Grids from disk\n\nold\n\n## On paper\n\nkept\n")
    assert scale.main(["grids", "dask"], True, tmp_path, report) == report
    text = report.read_text()
    assert "\nold\n" not in text
    assert text.endswith("## On paper\n\nkept\n")
    assert text.count("bitwise the same") == 4
    assert "NOT" not in text
    for name in ("liu, in slabs", "to the power", "jet, from disk", "dask, 2 thread(s)"):
        assert name in text, name
    with pytest.raises(ValueError, match="section: expected some of grids"):
        scale.main(["nobody"], True, tmp_path, report)


@pytest.mark.filterwarnings("default")
def test_the_model_is_what_its_constants_make(tmp_path):
    lines = scale_paper.section(scale.Setting(tmp_path, True))
    rows = {line.split(" | ")[0][2:]: line.strip("| ").split(" | ")[1:] for line in lines if line[:1] == "|"}
    slabs = [float(x) for x in rows["finite volumes, grid in slabs"]]
    assert slabs[1] == pytest.approx(slabs[0] * 1e-9 * 1e12 / (256 * 64), rel=0.02)
    assert float(rows["grid: 24 bytes of a point read, 8 of H written"][1]) == pytest.approx(62.5)


def test_cost_is_of_a_process_of_its_own(tmp_path):
    scale_grids.write_points(tmp_path / "x.npy", 100)
    files = str(tmp_path / "x.npy"), str(tmp_path / "H.npy")
    found = scale.cost("comparisons.scale_grids:in_slabs", *files, "liu")
    assert 0 < found.cpu < 60
    assert 50 < found.peak < 2000
    assert np.load(tmp_path / "H.npy").shape == (100, 100)
