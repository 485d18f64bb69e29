"""
Blocks that meet
================

Finite-volume codes cut a surface into logically Cartesian blocks. ForestClaw and Clawpack keep an array of
cells for each patch of a forest; OpenFOAM's blockMesh, CGNS and Plot3D one list of points and the size of
every block.
"""

import matplotlib.pyplot as plt
import numpy as np
import pyvista as pv

import quadcurv as qc

# %%
# Patches of cells, as in a forest of quadtrees on a cubed sphere: six trees, each cut into two by two patches
# of 16 x 16 cells. Clawpack's arrays have the index of x first; corners and centres come from one mapping.
MX = MY = 16
sphere = qc.surfaces.cubed_sphere()


def patch(tree: float, i: int, j: int) -> qc.StaggeredGrid:
    """Cell centres and corners of one patch, without its ghost cells."""
    x, y = (i + np.arange(MX + 1) / MX) / 2, (j + np.arange(MY + 1) / MY) / 2
    xc, yc = (x[1:] + x[:-1]) / 2, (y[1:] + y[:-1]) / 2
    return qc.StaggeredGrid(
        sphere.mapping(tree + xc[:, None], yc[None, :]), sphere.mapping(tree + x[:, None], y[None, :])
    )


forest = qc.GridBlocks([patch(tree, i, j) for tree in sphere.panels for i in (0, 1) for j in (0, 1)])
print(forest)

# %%
# Which sides meet follows from the corners of the cells. Across seams the neighbour's cells take the place of
# ghost cells, also where three blocks meet. The answer is one array a block, as the solution is.
H = qc.mean_curvature(forest)
worst = max(np.abs(h - 1).max() for h in H)
print(f"{len(H)} arrays of {H[0].shape}, largest error {worst:.1e}")

# %%
# The finite-volume scheme sees the kinks of the grid lines at the twelve edges of the cube.
fig, axes = plt.subplots(1, 6, figsize=(12, 2.3), layout="constrained")
error = [np.abs(h - 1) for h in qc.mean_curvature(forest, "finite_volume")]
for tree, axis in enumerate(axes):
    panel = np.block([[error[4 * tree + 2 * i + j] for j in (0, 1)] for i in (0, 1)])
    image = axis.imshow(np.log10(panel).T, origin="lower", vmin=-5, vmax=-2)
    axis.set(title=f"tree {tree}", xticks=[], yticks=[])
fig.colorbar(image, ax=axes, label="log10 of the error of H")

# %%
# Points in one list, as blockMesh writes an O-grid: a square in the middle and four blocks around it, x
# running fastest. Here it is a hill, z = exp(-x^2 - y^2), whose outer border is open.
N = 24
s, t = np.meshgrid(np.linspace(-1, 1, N + 1), np.linspace(0, 1, N + 1))


def around(side: int) -> np.ndarray:
    """Block between one side of the square and the circle of radius 2."""
    angle = np.pi / 4 * s
    straight = np.stack([np.full_like(s, 0.6), 0.6 * s], axis=-1)
    circle = 2 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    c, d = np.cos(side * np.pi / 2), np.sin(side * np.pi / 2)
    return ((1 - t[..., None]) * straight + t[..., None] * circle) @ np.array([[c, d], [-d, c]])


square = 0.6 * np.stack([s, 2 * t - 1], axis=-1)
plane = np.concatenate([x.reshape(-1, 2) for x in (square, *map(around, range(4)))])
points = np.column_stack([plane, np.exp(-(plane**2).sum(axis=1))])

# %%
# Of each block the rows are t, the columns s: first direction times second must be the same side everywhere.
# That of the square would be the other one, and ``GridBlocks`` says so.
sizes = [(N + 1, N + 1)] * 5
ends = np.cumsum([r * c for r, c in sizes])[:-1]
blocks = [part.reshape(r, c, 3) for part, (r, c) in zip(np.split(points, ends), sizes, strict=True)]
try:
    qc.GridBlocks(blocks)
except qc.MeshError as error:
    print(error)

# %%
# With the square's axes exchanged all agree: eight seams, four vertices where three blocks meet, a border.
blocks[0] = blocks[0].swapaxes(0, 1)
hill = qc.GridBlocks(blocks)
H_hill = qc.mean_curvature(hill)
print(hill)

plotter = pv.Plotter(off_screen=True, window_size=(1000, 700), border=False)
for block, values in zip(hill, H_hill, strict=True):
    mesh = pv.StructuredGrid(*np.moveaxis(block.points, -1, 0))
    plotter.add_mesh(
        mesh, scalars=values.ravel(order="F"), clim=(-2, 2), cmap="RdBu_r", lighting=False,
        show_edges=True, edge_opacity=0.25, show_scalar_bar=False,
    )  # fmt: skip
plotter.view_vector((0.3, -1, 1.2))


# %%
def main() -> float:
    """Return the largest error of the mean curvature on the hill, borders and corners of blocks included."""
    largest = 0.0
    for block, values in zip(hill, H_hill, strict=True):
        x, y, z = np.moveaxis(block.points, -1, 0)
        fx, fy = -2 * x * z, -2 * y * z
        fxx, fxy, fyy = (4 * x**2 - 2) * z, 4 * x * y * z, (4 * y**2 - 2) * z
        w = 1 + fx**2 + fy**2
        up = -((1 + fy**2) * fxx - 2 * fx * fy * fxy + (1 + fx**2) * fyy) / (2 * w**1.5)
        largest = max(largest, float(np.abs(values - up).max()))
    return largest


print(main())
