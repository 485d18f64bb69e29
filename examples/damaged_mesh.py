"""
A damaged mesh
==============

Models from the wild have faces given twice, sides turned over, seams that do not join. What can be mended
is mended and told of once; what has no answer is NaN, and nothing else is.
"""

import warnings

import numpy as np

import quadcurv as qc
from quadcurv.viewing import Style, maps

good, _, _ = qc.surfaces.cubed_sphere().sample((12, 12), "faces")
faces = good.faces.tolist()
faces[5] = faces[5][::-1]  # turned over
faces.append(faces[100])  # given twice
faces[200][3] = faces[200][2]  # a quad with a repeated vertex
faces.append([0, 1, len(good.points)])  # a fin, on an edge that has two faces already
points = np.concatenate(
    [good.points, [1.2 * good.points[:2].sum(axis=0) / 2], [[0, 0, 0]]]
)  # and a lonely vertex

with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    mesh = qc.QuadMesh(points, faces)
print(said[0].message)

# %%
# The report counts, and says where the first of each is.
print(mesh.report)

# %%
# The mean curvature is known all over the sphere but at the two ends of the fin's edge.
H = qc.mean_curvature(mesh)
print("NaN at", np.flatnonzero(np.isnan(H)))
maps(qc.compare(mesh, ["finite_volume", "jet"]), "mean_curvature", Style(camera=tuple(good.points[0])))

# %%
# A seam is a row of vertices that are there twice: :func:`quadcurv.merge_points` joins them and says where
# each went.
grid, _, _ = qc.surfaces.cylinder().sample((24, 12))
sheet = qc.QuadGrid(np.concatenate([grid.points, grid.points[:1]])).to_mesh()
merged, vertex = qc.merge_points(sheet, 1e-9)
print(f"{len(sheet.points)} vertices, {len(merged.points)} places")


# %%
def main() -> float:
    """Return the number of vertices without a curvature."""
    return float(np.isnan(H).sum())


print(main())
