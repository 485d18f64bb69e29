"""Arrays of points on disk, from file to file, block by block."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path

from quadcurv.cli.options import MeshOptions, check_file
from quadcurv.curvature import evaluate
from quadcurv.drivers import answers
from quadcurv.io.base import STORES
from quadcurv.mesh import ChunkedGrid
from quadcurv.schemes import as_scheme


def curvature_of_array(
    path: Path, output: Path, scheme: str, wanted: Sequence[str] | None, options: MeshOptions
) -> Path:
    """Write results of a grid of points to a new file, which is removed again if anything fails."""
    if options != MeshOptions(wrap=options.wrap, boundary=options.boundary):
        raise ValueError(f"{path}: an array is taken as it is; --merge, --join and --orient are for meshes")
    chosen, names = as_scheme(scheme), list(dict.fromkeys(wanted or ["mean_curvature"]))
    shapes = answers.shapes(chosen, names, "--value")
    check_file(output, "--output", list(STORES))
    if output.exists():
        raise FileExistsError(17, "exists already; arrays are written to new files", str(output))
    points = STORES[path.suffix.lower()].open(path)
    grid = ChunkedGrid(points, options.wraps or (False, False))
    lead = tuple(int(n) for n in points.shape[:-3])
    try:
        out = STORES[output.suffix.lower()].create(
            output, {name: lead + grid.shape + shape for name, shape in shapes.items()}
        )
        evaluate(grid, scheme=chosen, boundary=options.boundary, out=out, progress=True)
    except BaseException:
        shutil.rmtree(output, ignore_errors=True)
        output.unlink(missing_ok=True)
        raise
    return output
