"""Meshes of other libraries and files, as ours and back."""

from quadcurv.io.libraries import as_mesh, attach, read, to_pymeshlab, to_pyvista, to_trimesh, write

__all__ = ["as_mesh", "attach", "read", "to_pymeshlab", "to_pyvista", "to_trimesh", "write"]
