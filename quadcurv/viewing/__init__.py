"""Looking at results: maps on the surface in a window, as pictures and pages, and figures of convergence.

Names are imported when they are first asked for, as are pyvista and matplotlib.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quadcurv.viewing.fields import FIELDS, Fields
    from quadcurv.viewing.figures import convergence_plot, plot
    from quadcurv.viewing.opengl import NoOpenGLError, opengl_problem, window_problem
    from quadcurv.viewing.show import maps, save_maps, view
    from quadcurv.viewing.style import Style
    from quadcurv.viewing.views import View

_MODULES = {
    "FIELDS": "fields",
    "Fields": "fields",
    "NoOpenGLError": "opengl",
    "Style": "style",
    "View": "views",
    "convergence_plot": "figures",
    "maps": "show",
    "opengl_problem": "opengl",
    "plot": "figures",
    "save_maps": "show",
    "view": "show",
    "window_problem": "opengl",
}

__all__ = [
    "FIELDS",
    "Fields",
    "NoOpenGLError",
    "Style",
    "View",
    "convergence_plot",
    "maps",
    "opengl_problem",
    "plot",
    "save_maps",
    "view",
    "window_problem",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)


def __dir__() -> list[str]:
    return __all__
