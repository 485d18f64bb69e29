"""A model on paper: what a grid of 10^12 vertices would take, from constants measured on this machine."""

from __future__ import annotations

import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np

import quadcurv as qc
from comparisons import scale
from comparisons.scale import Setting, cost, table
from comparisons.scale_grids import HERE as GRIDS
from comparisons.scale_grids import H, write_points

HERE, FACES = "comparisons.scale_paper", "comparisons.scale_faces"
NODES, CORES, RATE = 256, 64, 2e9  # nodes, cores of each, bytes a second that each reads and writes
VERTICES = 1e12
TASK = 64e6  # vertices a task


def quartic(points: str, out: str) -> None:
    """Jets of degree four from file to file."""
    scheme = qc.schemes.jet(4)
    qc.evaluate(qc.ChunkedGrid(qc.surfaces.torus().sample((90, 90))[0].points), H, scheme=scheme)
    scale.begin()
    x = np.load(points, mmap_mode="r")
    into = np.lib.format.open_memmap(out, "w+", np.float64, x.shape[:2])
    qc.evaluate(qc.ChunkedGrid(x), scheme=scheme, out={H: into})


def scheduled(number: int) -> dict[str, Any]:
    """Processor seconds that a scheduler of dask.distributed takes for a task that does nothing."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(1, threads_per_worker=2, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        client.gather(client.map(abs, range(16)))
        begin = time.process_time()
        client.gather(client.map(float, range(number)))
        return {"seconds": (time.process_time() - begin) / number}


def section(setting: Setting) -> list[str]:
    """Seconds on so many nodes, and what they rest on."""
    n = 256 if setting.quick else 2048
    points, out, mesh = (str(setting.folder / name) for name in ("paper.npy", "paper_out.npy", "paper"))
    write_points(Path(points), n)
    slabs, jets = (
        cost(f"{GRIDS}:in_slabs", points, out, scheme).cpu / n**2 for scheme in ("finite_volume", "jet")
    )
    quartics = cost(f"{HERE}:quartic", points, out).cpu / n**2
    cost(f"{FACES}:write", mesh, n, "natural")
    into = cost(f"{FACES}:cut", mesh).cpu / n**2
    parts = cost(f"{FACES}:by_parts", mesh, 0).cpu / n**2
    task = cost(f"{HERE}:scheduled", 200 if setting.quick else 4000).told["seconds"]
    for path in (points, out):
        Path(path).unlink()
    shutil.rmtree(mesh)
    cores, moved = NODES * CORES, VERTICES / (NODES * RATE)
    rows: list[tuple[object, ...]] = [
        ("grid: 24 bytes of a point read, 8 of H written", "", 32 * moved),
        ("face list, also 16 of a face read, 20 written and read again", "", (32 + 16 + 40) * moved),
        *(
            (name, 1e9 * each, each * VERTICES / cores)
            for name, each in (
                ("finite volumes, grid in slabs", slabs),
                ("finite volumes, face list: into parts", into),
                ("finite volumes, face list: part by part", parts),
                ("jets of degree four, grid", quartics),
                ("jets as they are by default, grid", jets),
            )
        ),
        (
            f"one scheduler, {VERTICES / TASK:,.0f} tasks of {TASK / 1e6:g} million",
            "",
            task * VERTICES / TASK,
        ),
    ]
    number = "200" if setting.quick else "4,000"
    text = (
        f"Nothing of this was run: 10^12 vertices on {NODES} nodes of {CORES} cores, each node reading and "
        f"writing {RATE / 1e9:g} GB a second. Processor time a vertex was measured here, on {n} x {n} "
        f"vertices from file to file; a task's, of the process that schedules it, by {number} tasks that do "
        "nothing. Assumed are cores as fast as these, none of which waits for memory or for another one; "
        "files that every node reaches at its full rate; tasks that share no more than the rows around them, "
        "0.1 % of 64 million vertices; and of face lists that each node has a piece of the mesh whose "
        "indices 32 bits number, with the halo that it shares with others, the order of vertices being good. "
        "Reading and writing then overlap with computing, and the largest row is what a run takes."
    )
    return [text, "", *table(("what", "ns a vertex", "seconds"), rows)]
