"""Libraries that come with extras: what is missing is named with the command that installs it."""

from __future__ import annotations

from importlib.util import find_spec

_EXTRAS = {
    "matplotlib": "view",
    "pyvista": "view",
    "vtkmodules": "view",
    "cupy": "gpu",
    "meshlane": "formats",
    "pymeshlab": "meshlab",
    "pandas": "notebook",
    "dask": "scale",
    "h5py": "scale",
    "xarray": "scale",
    "zarr": "scale",
}


def missing(*libraries: str) -> str | None:
    """What is not installed of these libraries and which command installs it, None if nothing is missing."""
    for library in libraries:
        if find_spec(library) is None:
            return f'{library} is not installed: pip install "quadcurv[{_EXTRAS[library]}]"'
    return None


def need(*libraries: str) -> None:
    """Refuse to go on without these libraries.

    Raises
    ------
    ImportError
        One of them is not installed; the message says which command installs it.
    """
    problem = missing(*libraries)
    if problem:
        raise ImportError(problem)
