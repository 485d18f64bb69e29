"""Looking at results: maps on the surface in a window, as pictures and pages, and figures of convergence.

Public names are listed in ``__init__.pyi`` and imported when they are first asked for, as are pyvista and
matplotlib, which the extra "view" installs.
"""

from typing import Any

import lazy_loader

from quadcurv.extras import need

_attribute, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
_FIGURES = ("convergence_plot", "plot", "surfaces_figure")


def __getattr__(name: str) -> Any:
    if name in _FIGURES:  # their modules import matplotlib
        need("matplotlib")
    return _attribute(name)
