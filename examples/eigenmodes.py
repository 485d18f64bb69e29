"""
Eigenmodes, and why not with a checkerboard
===========================================

The stiffness S and the mass M of an operator give the modes of a vibrating shell, S u = λ M u. On the unit
sphere the eigenvalues are l (l + 1), each 2 l + 1 times: 0, 2, 2, 2, 6, ...
"""

import numpy as np
import pyvista as pv
from scipy.sparse.linalg import eigsh

import quadcurv as qc

mesh, xi, eta = qc.surfaces.cubed_sphere().sample((12, 12), "faces")


def modes(scheme: str) -> tuple[np.ndarray, np.ndarray]:
    """The ten lowest eigenvalues and their modes, one a column."""
    S, M = qc.stiffness_matrix(mesh, scheme), qc.mass_matrix(mesh, scheme)
    return eigsh(S.tocsc(), 10, M.tocsc(), sigma=-0.1, v0=np.ones(len(mesh.points)) + mesh.points @ [1, 2, 3])


# %%
# The bilinear element finds them, Liu's formula finds each of them twice.
bilinear, shapes = modes("bilinear")
liu, shapes_of_liu = modes("liu")
print("bilinear", np.round(bilinear, 2) + 0.0)
print("liu     ", np.round(liu, 2) + 0.0)

# %%
# Liu's matrix, which is that of finite volumes too, is built of the two diagonals of every quad. On a mesh
# whose vertices can be coloured like a chessboard both diagonals join vertices of one colour, so that the
# two colours do not feel each other: every mode comes once more with one colour negated, the first as a
# checkerboard. For curvature this does no harm. Where a system is solved or a spectrum is computed take the
# bilinear element, which is what :func:`quadcurv.stiffness_matrix` gives unless told otherwise.
n = len(mesh.points)
colour = shapes_of_liu[:, :2] @ np.linalg.lstsq(shapes_of_liu[:, :2], np.eye(n)[0], rcond=None)[0]
pictures = {
    "l = 1": shapes[:, 1],
    "l = 2": shapes[:, 4],
    "l = 2, another": shapes[:, 7],
    "checkerboard": colour,
}
plotter = pv.Plotter(shape=(1, 4), off_screen=True, window_size=(1600, 430), border=False)
for k, (name, mode) in enumerate(pictures.items()):
    plotter.subplot(0, k)
    surface = qc.to_pyvista(mesh)
    surface[name] = mode / np.abs(mode).max()
    plotter.add_mesh(
        surface, cmap="RdBu_r", show_edges=True, edge_opacity=0.2, lighting=False, show_scalar_bar=False
    )
    plotter.add_text(name, font_size=12, position="upper_edge")
plotter.link_views()
plotter.view_vector((1, 0.7, 0.5))
plotter.camera.zoom(1.3)


# %%
def main() -> float:
    """Return the largest relative error of the eigenvalues 2 and 6 by the bilinear element."""
    return float(np.abs(bilinear[1:9] / [2, 2, 2, 6, 6, 6, 6, 6] - 1).max())


print(main())
