"""From a heap of triangles to quads, and from quads to a grid: what was lost on the way is found again."""

import numpy as np

import quadcurv
from quadcurv import surfaces


def main() -> float:
    """Return the largest difference of |H| between the grid that was found and the one we began with."""
    torus, *_ = surfaces.torus().sample((36, 24))
    rng = np.random.default_rng(0)
    faces = torus.to_mesh().faces
    heap = rng.permutation(np.concatenate((faces[:, [0, 1, 2]], faces[:, [0, 2, 3]])))

    triangles = quadcurv.QuadMesh(torus.points.reshape(-1, 3), heap)
    quads = quadcurv.pair_triangles(triangles)
    grid, vertex = quadcurv.as_grid(quads)
    print(triangles, quads, quads.recovery, grid, sep="\n")

    # Values of the grid, put back in the order of the points.
    H = np.empty(len(quads.points))
    H[vertex] = quadcurv.mean_curvature(grid)
    return float(np.abs(np.abs(H) - np.abs(quadcurv.mean_curvature(torus).ravel())).max())


if __name__ == "__main__":
    print(main())
