"""A model on paper: what a grid of 10^12 vertices would take, from constants measured on this machine."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import quadcurv as qc
from comparisons import scale
from comparisons.scale import Setting, cost, table
from comparisons.scale_grids import HERE as GRIDS
from comparisons.scale_grids import H, write_points

HERE = "comparisons.scale_paper"
NODES, CORES, RATE = 256, 64, 2e9  # nodes, cores of each, bytes a second that each reads and writes
VERTICES = 1e12
TASK = 64e6  # vertices a task


def faces_in_memory(points: str) -> None:
    """Finite volumes on the face list of a grid, checked and sorted."""
    small = qc.surfaces.cubed_sphere().sample((16, 16), "faces")[0]
    qc.evaluate(small, H)
    x = np.load(points)
    n = len(x)
    index = np.arange(n * n, dtype=np.int32).reshape(n, n)
    quads = np.stack((index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]), axis=-1).reshape(-1, 4)
    scale.begin()
    qc.evaluate((x.reshape(-1, 3), quads), H)


def scheduled(number: int) -> dict[str, Any]:
    """Seconds a task of a scheduler of dask.distributed, of tasks that do nothing."""
    from distributed import Client, LocalCluster

    with (
        LocalCluster(1, threads_per_worker=2, processes=True, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        client.gather(client.map(abs, range(16)))
        begin = time.perf_counter()
        client.gather(client.map(float, range(number)))
        return {"seconds": (time.perf_counter() - begin) / number}


def section(setting: Setting) -> list[str]:
    """Seconds on so many nodes, and what they rest on."""
    n = 256 if setting.quick else 2048
    points, out = setting.folder / "paper.npy", setting.folder / "paper_out.npy"
    write_points(points, n)
    slabs = cost(f"{GRIDS}:in_slabs", str(points), str(out), "finite_volume").cpu / n**2
    jets = cost(f"{GRIDS}:in_slabs", str(points), str(out), "jet").cpu / n**2
    faces = cost(f"{HERE}:faces_in_memory", str(points)).cpu / n**2
    task = cost(f"{HERE}:scheduled", 200 if setting.quick else 4000).told["seconds"]
    points.unlink()
    out.unlink()
    cores, moved = NODES * CORES, 32 * VERTICES / (NODES * RATE)
    rows: list[tuple[object, ...]] = [
        ("reading points, writing H: 32 bytes a vertex", "", moved),
        ("finite volumes, grid in slabs", 1e9 * slabs, slabs * VERTICES / cores),
        ("finite volumes, face list", 1e9 * faces, faces * VERTICES / cores),
        ("jets, grid", 1e9 * jets, jets * VERTICES / cores),
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
        f"vertices from file to file, faces in memory; a task's by {number} tasks that do nothing. Assumed "
        "are cores as fast as these, none of which waits for memory or for another one; files that every "
        "node reaches at its full rate; and tasks that share no more than the rows around them, 0.1 % of 64 "
        "million vertices. Reading and writing then overlap with computing, and the largest row is what a "
        "run takes."
    )
    return [text, "", *table(("what", "ns a vertex", "seconds"), rows)]
