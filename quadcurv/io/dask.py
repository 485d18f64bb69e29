"""Arrays of dask: grids whose points are yet to be computed."""

from __future__ import annotations

from quadcurv.io.base import Library, is_a, no_mesh, register

register(Library(("dask",), no_mesh, is_array=lambda array: is_a(array, "Array")))
