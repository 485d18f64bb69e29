"""Looking at results: maps on the surface in a window, as pictures and pages, and figures of convergence.

Public names are listed in ``__init__.pyi`` and imported when they are first asked for, as are pyvista and
matplotlib.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
