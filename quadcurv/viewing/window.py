"""A window: buttons, keys, the slider and the mouse around linked views."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from quadcurv.comparison import Comparison
from quadcurv.viewing.style import Style
from quadcurv.viewing.views import View

_COLOUR = "#0072b2"


def window(
    comparison: Comparison,
    field: str = "mean_curvature",
    style: Style | None = None,
    refined: Callable[[int], Comparison] | None = None,
) -> View:
    """Views with controls, to be shown by ``.plotter.show()``.

    The keys, and the buttons below the views, are: right and left arrow for the next and previous field,
    ``m`` for the edges of the mesh, ``o`` for boundaries, seams and extraordinary vertices, ``n`` for mean
    curvature normals, ``d`` for principal directions, ``h`` for the histogram by area under each view,
    ``r`` to fit the camera. A click on the surface shows the values at the nearest vertex and its ring in
    all views.

    Parameters
    ----------
    comparison, field, style, refined
        As for :class:`quadcurv.viewing.View`.
    """
    view = View(comparison, field, style, refined=refined)
    _add_buttons(view)
    if refined is not None:
        _add_slider(view)
    _listen_to_mouse(view)
    return view


def _add_buttons(view: View) -> None:
    plotter = view.plotter
    plotter.subplot(view.control_row, 0)
    width = plotter.window_size[0]
    buttons = [
        ("next field (→)", "Right", view.next_field),
        ("edges (m)", "m", lambda: view.toggle("edges")),
        ("overlays (o)", "o", lambda: view.toggle("overlays")),
        ("normals (n)", "n", lambda: view.toggle("normals")),
        ("directions (d)", "d", lambda: view.toggle("directions")),
        ("histogram (h)", "h", lambda: view.toggle("histogram")),
    ]
    for i, (label, key, action) in enumerate(buttons):
        x = 35 + 95 * i
        plotter.add_checkbox_button_widget(
            lambda _, action=action: action(),
            position=(x, 30),
            size=26,
            border_size=2,
            color_on=_COLOUR,
            color_off=_COLOUR,
            background_color="black",
        )
        view.write_below(label, ((x + 13) / width, 0.15), 6, name=label)
        plotter.add_key_event(key, action)
    plotter.add_key_event("Left", lambda: view.next_field(-1))


def _add_slider(view: View) -> None:
    slider = view.plotter.add_slider_widget(
        view.refine,
        rng=(0, view.LEVELS - 1),
        value=view.START,
        pointa=(0.75, 0.42),
        pointb=(0.97, 0.42),
        fmt="%.0f",
        color=_COLOUR,
        slider_width=0.1,
        tube_width=0.02,
    )
    slider.GetRepresentation().ShowSliderLabelOff()  # it would be tiny
    view.write_below(f"refinement {view.level}", (0.86, 0.12), 6, name="refinement")


def _listen_to_mouse(view: View) -> None:
    """A click without a drag picks; a large surface turns coarsely."""
    pressed: list[tuple[int, int]] = []
    interactor = view.plotter.iren.interactor

    def press(*_: Any) -> None:
        pressed[:] = [interactor.GetEventPosition()]

    def release(*_: Any) -> None:
        if pressed and pressed.pop() == interactor.GetEventPosition():
            view.pick(*interactor.GetEventPosition())

    view.plotter.iren.style.AddObserver("StartInteractionEvent", lambda *_: view.turn_coarse(True))
    view.plotter.iren.style.AddObserver("EndInteractionEvent", lambda *_: view.turn_coarse(False))
    view.plotter.iren.add_observer("LeftButtonPressEvent", press)
    view.plotter.iren.add_observer("LeftButtonReleaseEvent", release)
