"""Time and memory of the cotan schemes beside one plain libigl call on the same mesh."""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time

import igl
import numpy as np
from rich.console import Console
from rich.table import Table

from quadcurv import QuadMesh, mean_curvature
from quadcurv.schemes import SCHEMES, as_scheme
from quadcurv.surfaces import torus
from quadcurv.tables import progress

PLAIN = "plain igl.cotmatrix + massmatrix"
CASES = (PLAIN, *(name for name in SCHEMES if name.startswith("cotan")))


def mesh_of(side: int) -> QuadMesh:
    """A torus of side^2 vertices as a face list."""
    return torus().sample((side, side))[0].to_mesh()


def measure(case: str, side: int) -> dict[str, float]:
    """Seconds of one call, and the peak memory in GiB of the process that makes it."""
    mesh = mesh_of(side)
    mean_curvature(mesh_of(8), "cotan-6" if case == PLAIN else case)  # compile and import first
    start = time.perf_counter()
    if case == PLAIN:
        faces = mesh.faces.astype(np.int64)
        triangles = np.concatenate((faces[:, [0, 1, 2]], faces[:, [2, 3, 0]]))
        igl.cotmatrix(mesh.points, triangles)
        igl.massmatrix(mesh.points, triangles, igl.MASSMATRIX_TYPE_BARYCENTRIC)
    else:
        mean_curvature(mesh, as_scheme(case))
    seconds = time.perf_counter() - start
    return {"seconds": seconds, "GiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20}


def main(side: int = 1000, console: Console | None = None) -> dict[str, dict[str, float]]:
    """Measure every case in a process of its own.

    Parameters
    ----------
    side : int
        The mesh has side^2 vertices.
    console : rich.console.Console, optional
        Where the table goes.

    Returns
    -------
    dict of str to dict
        "seconds", "GiB" (peak of the whole process, mesh and imports included) and "ratio" (time over
        that of the plain call) by case.
    """
    found: dict[str, dict[str, float]] = {}
    for case in progress(CASES, "cost of cotan", weight=side**2):
        command = [sys.executable, "-m", "comparisons.cotan_cost", "--side", str(side), "--case", case]
        run = subprocess.run(command, capture_output=True, text=True, check=True)
        found[case] = json.loads(run.stdout)
        found[case]["ratio"] = found[case]["seconds"] / found[PLAIN]["seconds"]
    table = Table("case", "seconds", "ratio", "peak GiB", title=f"{side**2:,} vertices", box=None)
    for case, cost in found.items():
        table.add_row(case, f"{cost['seconds']:.2f}", f"{cost['ratio']:.2f}", f"{cost['GiB']:.2f}")
    (console or Console()).print(table)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--side", type=int, default=1000, help="the mesh has side^2 vertices")
    parser.add_argument("--case", choices=CASES, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.case:
        print(json.dumps(measure(given.case, given.side)))
    else:
        main(given.side)
