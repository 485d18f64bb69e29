"""Maps of a comparison, or of a mesh: in a window, as a scene of pyvista, as a picture or a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadcurv.comparison import Comparison, compare
from quadcurv.extras import need
from quadcurv.io.replacing import replacing
from quadcurv.viewing.fields import Fields
from quadcurv.viewing.opengl import NoOpenGLError, opengl_problem, window_problem
from quadcurv.viewing.page import Page, make_page
from quadcurv.viewing.style import Style
from quadcurv.viewing.views import View
from quadcurv.viewing.window import window

if TYPE_CHECKING:
    import pyvista as pv


def view(
    what: Any,
    field: str = "mean_curvature",
    style: Style | None = None,
    refined: Callable[[int], Comparison] | None = None,
) -> None:
    """Open a window with linked views, one a scheme, until it is closed.

    Parameters
    ----------
    what : Comparison, or anything :func:`quadcurv.as_mesh` takes
        A mesh is shown with its curvature by jet.
    field : str
        What the colours show first: of :attr:`quadcurv.viewing.Fields.names`.
    style : Style
    refined : callable, optional
        Comparison at a refinement level 0 to 5, for a slider; `what` is that of level 2.

    Raises
    ------
    NoOpenGLError
        There is no display or no usable OpenGL.
    ValueError
        Unknown field; limits of the style that do not fit its scale.

    See Also
    --------
    quadcurv.viewing.window : the keys and buttons.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> qc.view(ball)  # doctest: +SKIP
    """
    problem = window_problem()
    if problem:
        raise NoOpenGLError(problem)
    window(_comparison(what), field, style, refined).plotter.show()


def maps(what: Any, field: str | None = None, style: Style | None = None) -> pv.Plotter:
    """Scene for a file or a notebook, with one linked view a scheme and one colour bar.

    Signed fields have a diverging scale, its ends passed on 5 % of the area; errors a logarithmic one of
    whole decades. NaN is grey; what is exactly 0 on a logarithmic scale is pale pink. A field that no scheme
    enters is drawn once.

    Parameters
    ----------
    what, style
        As for :func:`view`.
    field : str, optional
        By default the error, or the mean curvature where there is nothing to compare it with.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    ValueError
        Unknown field; limits of the style that do not fit its scale.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import maps
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> maps(ball, "mean_curvature").screenshot("H.png")  # doctest: +SKIP
    """
    comparison = _comparison(what)
    return View(comparison, field or Fields(comparison).first, style, off_screen=True).plotter


def html_page(what: Any, field: str = "mean_curvature", style: Style | None = None) -> Page:
    """Page in HTML with linked views, one a scheme, and every field to choose from.

    It needs neither a network nor, where it is made, OpenGL; a notebook shows it in a frame.

    Parameters
    ----------
    what, field, style
        As for :func:`view`. Without a size in the style the page is as large as its window. The reader can
        choose all but the title anew; the page's address holds what was chosen.

    Returns
    -------
    Page

    Raises
    ------
    ValueError
        Unknown field; limits of the style that do not fit its scale.

    Warns
    -----
    UserWarning
        It would take more than 20 MB: fields were left out, or it is larger nevertheless. A style that is
        `thin` has all fields on fewer vertices.

    Examples
    --------
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import html_page
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> page = html_page(ball)
    >>> page.text[:15].lower()
    '<!doctype html>'
    """
    need("matplotlib")
    return make_page(_comparison(what), field, style or Style())


def save_maps(what: Any, path: str | Path, field: str | None = None, style: Style | None = None) -> None:
    """Write maps to a file: one linked view a scheme, one colour bar for all.

    Parameters
    ----------
    what, field, style
        As for :func:`maps`.
    path : path-like
        ``.png`` for a picture, which needs a usable OpenGL; ``.html`` for a page with linked views that
        needs none and no network.

    Raises
    ------
    NoOpenGLError
        A picture is asked for where nothing can render.
    ValueError
        Any other suffix; as for :func:`view`.

    Examples
    --------
    >>> import os, tempfile
    >>> import quadcurv as qc
    >>> from quadcurv.viewing import save_maps
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_maps(ball, f"{folder}/H.html", "mean_curvature")
    ...     os.listdir(folder)
    ['H.html']
    """
    path = Path(path)
    if path.suffix == ".html":
        comparison = _comparison(what)
        html_page(comparison, field or Fields(comparison).first, style).save(path)
    elif path.suffix == ".png":
        problem = opengl_problem()
        if problem:
            raise NoOpenGLError(problem)
        import pyvista as pv

        with pv.vtk_verbosity("off"):  # it would warn of every way to draw that it tries in vain
            plotter = maps(what, field, style)
            with replacing(path) as beside:
                plotter.screenshot(beside)
            plotter.close()
    else:
        raise ValueError(f"path: expected a name ending in .png or .html, got {path.name}")


def _comparison(what: Any) -> Comparison:
    return what if isinstance(what, Comparison) else compare(what, "jet")
