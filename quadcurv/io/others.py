"""Meshes and results handed to the other libraries."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from quadcurv.io import pymeshlab, pyvista, trimesh
from quadcurv.io.base import library
from quadcurv.io.meshes import as_mesh, face_list
from quadcurv.mesh import QuadGrid


def to_trimesh(mesh: Any) -> Any:
    """Return a trimesh.Trimesh of the same vertices, quads cut in two.

    Parameters
    ----------
    mesh : object
        Anything :func:`as_mesh` takes but a StaggeredGrid; a grid becomes its faces, row by row.

    Returns
    -------
    trimesh.Trimesh
        Not processed: no vertex merged or dropped. Quads (a, b, c, d) as (a, b, c) and (c, d, a), as trimesh
        cuts them; the face attribute "quadcurv" tells :func:`as_mesh` which belong together.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> len(qc.to_trimesh(ball).faces)
    192
    """
    return trimesh.from_mesh(face_list(mesh))


def to_pyvista(mesh: Any) -> Any:
    """Return a pyvista dataset of the same points: of a grid a StructuredGrid, else a PolyData.

    Parameters
    ----------
    mesh : object
        Anything :func:`as_mesh` takes but a StaggeredGrid.

    Returns
    -------
    pyvista.PolyData or pyvista.StructuredGrid
        In double precision. Where a grid wraps the last row or column repeats the first.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> surface = qc.to_pyvista(ball)
    >>> surface["H"] = qc.mean_curvature(ball)
    >>> surface.n_points, surface.n_cells
    (98, 96)
    """
    mesh = as_mesh(mesh)
    if isinstance(mesh, QuadGrid):
        return pyvista.from_grid(mesh.points, mesh.wrap)
    return pyvista.from_mesh(face_list(mesh))


def to_pymeshlab(mesh: Any) -> Any:
    """Return a pymeshlab.MeshSet of one mesh, quads kept as pairs of triangles with a faux edge.

    Parameters
    ----------
    mesh : object
        Anything :func:`as_mesh` takes but a StaggeredGrid; a grid becomes its faces, row by row.

    Returns
    -------
    pymeshlab.MeshSet
        In double precision.

    Raises
    ------
    ImportError
        pymeshlab, the extra "meshlab", or a system library that it needs is not installed.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> meshes = qc.to_pymeshlab(ball)  # doctest: +SKIP
    >>> meshes.current_mesh().vertex_number()  # doctest: +SKIP
    98
    """
    return pymeshlab.from_mesh(face_list(mesh))


def attach(mesh: Any, name: str, values: ArrayLike, colormap: str | None = "viridis") -> None:
    """Put values at the vertices of another library's mesh, where its users look for them.

    Parameters
    ----------
    mesh : trimesh.Trimesh, pyvista.PolyData, StructuredGrid, UnstructuredGrid, pymeshlab.MeshSet or Mesh
        Changed in place:

        - trimesh: ``vertex_attributes[name]``, and for scalars the colours of the vertices from their 2nd
          to their 98th percentile, grey where not finite; they replace the mesh's visual;
        - pyvista: ``point_data[name]``, made the active scalars (or vectors);
        - pymeshlab: the custom vertex attribute `name`, and in a MeshSet, for scalars, the vertex scalar
          ("quality") of its current mesh too.
    name : str
        In a MeshSet a word that MeshLab's functions can use: letters, digits and underscores.
    values : (n,) or (n, 3) array_like
        One entry a vertex; of a StructuredGrid also (r, c) or (r, c, 3), as quadcurv returns them.
    colormap : str or None
        A matplotlib colormap for trimesh; None leaves the visual alone.

    Raises
    ------
    MeshError
        A ValueError: another number of values, or MeshLab refuses the name.
    TypeError
        None of these types.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> triangles = qc.to_trimesh(ball)
    >>> qc.attach(triangles, "H", qc.mean_curvature(triangles))
    >>> triangles.vertex_attributes["H"].shape
    (98,)
    """
    entry = library(mesh)
    if entry is None or entry.attach is None:
        raise TypeError(
            f"mesh: expected a Trimesh, a pyvista dataset, a MeshSet or Mesh, got {type(mesh).__name__}"
        )
    entry.attach(mesh, name, np.asarray(values), colormap)
