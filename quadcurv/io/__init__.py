"""Meshes of other libraries and files, as ours and back.

A format or a library is one file here, which ends in its registration line: every module of this package is
imported, so that no list of them is to be kept.
"""

import importlib
import pkgutil

from quadcurv.io.meshes import as_mesh, as_mesh_or_chunks, read, read_values, write
from quadcurv.io.others import attach, to_pymeshlab, to_pyvista, to_trimesh
from quadcurv.io.xarray import from_xarray

__all__ = [
    "as_mesh",
    "as_mesh_or_chunks",
    "attach",
    "from_xarray",
    "read",
    "read_values",
    "to_pymeshlab",
    "to_pyvista",
    "to_trimesh",
    "write",
]

for _module in pkgutil.iter_modules(__path__):
    importlib.import_module(f"{__name__}.{_module.name}")
