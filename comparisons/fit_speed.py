"""Processor time of fits: quartic ones beside libigl's, and of the automatic choice a vertex.

Both on one thread, in turn, on the same mesh, cut into triangles for libigl, whose `principal_curvature`
with radius 2 fits quadrics to two rings of them. Ours takes the mesh as it is made: what is told of its
connectivity then is not counted.

    python -m comparisons.fit_speed
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

import quadcurv as qc
from comparisons.fresh import quartiles
from comparisons.goals import Ratio
from comparisons.meshes import torus, triangles

Floats = NDArray[np.float64]
SIZES = {100: 9, 256: 5}
"""Vertices a side, and rounds."""
NOISE = (0.0, 1e-3, 1e-2, 5e-2)
"""Of every coordinate, in spacings."""


def noisy(n: int, noise: float) -> Floats:
    """The torus with noise."""
    points = torus(n)
    spacing = np.linalg.norm(np.diff(points, axis=0), axis=2).mean()
    return points + np.random.default_rng(0).normal(size=points.shape) * noise * spacing


def meshes(n: int, noise: float = 0.0) -> Iterator[tuple[str, Any, NDArray[np.int64]]]:
    """Meshes of n^2 vertices by name, and their triangles."""
    rng, points = np.random.default_rng(1), noisy(n, noise)
    grid = qc.QuadGrid(points, (True, True))
    flat, faces = points.reshape(-1, 3), grid.stencils().faces.astype(np.int64)
    cut = triangles(faces)
    yield "grid", grid, cut
    sides = qc.QuadGrid(points)
    quads = sides.stencils().faces.astype(np.int64)
    yield "open grid", sides, triangles(quads)
    yield "quads", qc.QuadMesh(flat, faces), cut
    order = rng.permutation(len(flat))
    shuffled = np.argsort(order)[faces][rng.permutation(len(faces))]
    yield "quads, shuffled", qc.QuadMesh(flat[order], shuffled), triangles(shuffled)
    some = rng.random(len(faces)) < 0.3
    pieces = np.concatenate((faces[some, :3], faces[some][:, [2, 3, 0]]))
    mixed = np.concatenate((faces[~some], np.pad(pieces, ((0, 0), (0, 1)), constant_values=-1)))
    yield "quads and triangles", qc.QuadMesh(flat, mixed), cut


def processor(call: Callable[[], Any]) -> float:
    """Processor seconds of a call."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def measured(quick: bool = False) -> Iterator[Ratio]:
    """Times of libigl over ours; microseconds a vertex."""
    import igl

    def row(name: str, against: str, found: list[float], must: float, aim: float) -> Ratio:
        return Ratio(name, against, n * n, 1, *quartiles(found), must, aim)

    qc.set_threads(1)
    try:
        for n, count in {24: 2}.items() if quick else SIZES.items():
            for name, mesh, cut in meshes(n):
                points = np.ascontiguousarray(mesh.points).reshape(-1, 3)
                ours = partial(qc.curvatures, mesh, scheme=qc.schemes.jet(4))
                other = partial(igl.principal_curvature, points, cut, radius=2)
                ours()
                found = [processor(other) / processor(ours) for _ in range(count)]
                yield row(f"jet-4, {name}", "igl.principal_curvature", found, 12, 20)
            for noise in NOISE:
                for name, mesh, _ in meshes(n, noise):
                    ours = partial(qc.curvatures, mesh)
                    ours()
                    found = [1e6 * processor(ours) / n**2 for _ in range(count)]
                    yield row(f"jet, {name}, noise {noise:g}, microseconds", "a vertex", found, 10, 5)
    finally:
        qc.set_threads(None)


def main(quick: bool = False) -> list[Ratio]:
    """Print every row as it is measured."""
    found = []
    for r in measured(quick):
        print(f"{r.name:50} {r.vertices:8} {r.median:7.2f} ({r.low:.2f} to {r.high:.2f}) {r.verdict}")
        found.append(r)
    return found


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small meshes")
    main(parser.parse_args().quick)
