"""Whether anything can be rendered here, found out without risking this process."""

from __future__ import annotations

import functools
import os
import subprocess
import sys

from quadcurv.extras import missing

_PROBE = """
import sys
sys.path[:] = sys.argv[1:]
import pyvista
plotter = pyvista.Plotter(off_screen=True)
plotter.add_mesh(pyvista.Plane())
plotter.screenshot()
"""
_SECONDS = 120


class NoOpenGLError(RuntimeError):
    """No OpenGL is usable for rendering; the message says what to install.

    Examples
    --------
    >>> from quadcurv.viewing import NoOpenGLError
    >>> issubclass(NoOpenGLError, RuntimeError)
    True
    """


@functools.cache
def opengl_problem() -> str | None:
    """Why pyvista cannot render here, None if it can.

    Probed once, in a process of its own: without a usable OpenGL library VTK ends the process. It is
    isolated: nothing in the current folder is run, whatever its name.

    Examples
    --------
    >>> from quadcurv.viewing import opengl_problem
    >>> if opengl_problem() is None:
    ...     print("pictures can be made")  # doctest: +SKIP
    """
    problem = missing("pyvista")
    if problem:
        return problem
    here = os.path.realpath(os.curdir)
    folders = [folder for folder in sys.path if folder and os.path.realpath(folder) != here]
    command = [sys.executable, "-I", "-c", _PROBE, *folders]
    try:
        run = subprocess.run(command, capture_output=True, timeout=_SECONDS, check=False)
    except subprocess.TimeoutExpired:
        return f"OpenGL gives no picture within {_SECONDS} seconds"
    if run.returncode == 0:
        return None
    return "no usable OpenGL: on Debian install libgl1, libegl1 and libopengl0"


def window_problem() -> str | None:
    """Why no window can be opened here, None if one can.

    Examples
    --------
    >>> from quadcurv.viewing import window_problem
    >>> window_problem()  # doctest: +SKIP
    'no display to open a window on (DISPLAY is not set)'
    """
    if sys.platform == "linux" and not os.environ.get("DISPLAY"):
        return "no display to open a window on (DISPLAY is not set)"
    return opengl_problem()
