"""Curvature on quad meshes and logically Cartesian grids, with every operator side by side.

Public names are listed in ``__init__.pyi`` and imported when they are first asked for, so that programs that
use a part of the package do not wait for the rest.
"""

import lazy_loader

__version__ = "0.2.0"

__getattr__, _, __all__ = lazy_loader.attach_stub(__name__, __file__)
__all__ += ["__version__"]


def __dir__() -> list[str]:
    return __all__
