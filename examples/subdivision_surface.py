"""
A subdivision surface
=====================

Catmull and Clark's scheme makes a smooth surface of a coarse control mesh. Its curvature is continuous but
at the extraordinary vertices, where other than four quads meet, and there operators are put to the test.
"""

from collections import Counter

import numpy as np

import quadcurv as qc
from quadcurv.viewing import maps


def catmull_clark(points: np.ndarray, quads: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Refine a closed mesh of quads once."""
    n, m = len(points), len(quads)
    centre = points[quads].mean(axis=1)
    sides = np.stack([quads, np.roll(quads, -1, axis=1)], axis=-1).reshape(-1, 2)
    edges, edge = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    edge = edge.reshape(m, 4)
    middle = points[edges].mean(axis=1)
    beside = np.zeros_like(middle)
    np.add.at(beside, edge, centre[:, None])
    valence = np.bincount(quads.ravel(), minlength=n)[:, None]
    around, beyond = np.zeros_like(points), np.zeros_like(points)
    np.add.at(around, quads, centre[:, None])
    np.add.at(beyond, edges, middle[:, None])
    vertex = (around / valence + 2 * beyond / valence + (valence - 3) * points) / valence
    face = n + len(edges) + np.arange(m)
    corners = [(quads[:, k], n + edge[:, k], face, n + edge[:, k - 1]) for k in range(4)]
    fine = np.concatenate([np.stack(corner, axis=-1) for corner in corners])
    return np.concatenate([vertex, (beside / 2 + middle) / 2, centre]), fine


# %%
# Two cubes joined along a side make a bar; four steps make it smooth.
points = np.array([[x, y, z] for x in (-2.0, 0.0, 2.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
points[4:8, 1:] *= 0.55
quads = [[0, 1, 3, 2], [8, 10, 11, 9]]
for left, right in ((0, 4), (4, 8)):
    for a, b in ((0, 2), (2, 3), (3, 1), (1, 0)):
        quads.append([left + a, left + b, right + b, right + a])
quads = np.array(quads)
for _ in range(4):
    points, quads = catmull_clark(points, quads)
mesh = qc.orient((points, quads))
print(mesh, Counter(mesh.stencils().valence.tolist()))

# %%
# Nobody knows the exact curvature here; each operator is held against their median.
found = qc.compare(mesh, ["finite_volume", "liu", "cotan-6", "jet"])
maps(found, "mean_curvature")

# %%
# They part at the eight vertices of valence 3.
found


# %%
def main() -> float:
    """Return the integral of the Gaussian curvature over 4 pi: 1 on every mesh of a sphere's topology."""
    K, area = qc.gaussian_curvature(mesh, "angle_defect"), qc.dual_areas(mesh, "cotan-6")
    return float(K @ area / (4 * np.pi))


print(main())
