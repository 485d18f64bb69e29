"""A window: buttons, keys, the slider and the mouse around linked views."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from quadcurv.comparison import Comparison
from quadcurv.viewing.style import Style
from quadcurv.viewing.views import View

_COLOUR, _ARROW = "#0072b2", "→"
_NARROW = 80  # pixels a button, where its key has to do for a label
BUTTON, SLIDER = 26, (0.75, 0.97)  # pixels of a button; ends of the slider, parts of the width
_SWITCHES = {"edges": "m", "overlays": "o", "normals": "n", "directions": "d", "histogram": "h"}  # and keys


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
    ``r`` to fit the camera. Buttons are blue while what they name is shown. A click on the surface shows the
    values at the nearest vertex and its ring in all views.

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
    """Buttons that are blue while what they name is shown, whether by mouse or by key."""
    plotter = view.plotter
    plotter.subplot(view.control_row, 0)
    width = plotter.window_size[0]
    switches: dict[str, Any] = {}

    def toggle(what: str) -> None:
        view.toggle(what)
        show_state()
        plotter.render()

    def show_state() -> None:
        for what, button in switches.items():
            button.GetRepresentation().SetState(what in view.shown)

    buttons = [
        (f"next field ({_ARROW})", "Right", None),
        *((f"{what} ({key})", key, what) for what, key in _SWITCHES.items()),
    ]
    places = button_places(width, len(buttons), view.refined is not None)
    narrow = places[1] - places[0] < _NARROW
    for x, (label, key, what) in zip(places, buttons, strict=True):
        action = view.next_field if what is None else partial(toggle, what)
        if narrow:
            label = key if what else _ARROW
        button = plotter.add_checkbox_button_widget(
            lambda _, action=action: action(),
            position=(x, 30),
            size=BUTTON,
            border_size=2,
            color_on=_COLOUR,
            color_off=_COLOUR if what is None else "white",
            background_color="black",
        )
        if what is not None:
            switches[what] = button
        view.write_below(label, ((x + 13) / width, 0.15), 6, name=label)
        plotter.add_key_event(key, action)
    plotter.add_key_event("Left", lambda: view.next_field(-1))
    show_state()


def button_places(width: float, number: int, slider: bool) -> list[float]:
    """Left edges of buttons in a window of some width, in pixels, beside a slider or alone."""
    room = SLIDER[0] * width if slider else width
    step = min(95.0, (room - 10) / number)
    return [min(35.0, step - BUTTON) + step * i for i in range(number)]


def _add_slider(view: View) -> None:
    slider = view.plotter.add_slider_widget(
        view.refine,
        rng=(0, view.LEVELS - 1),
        value=view.START,
        pointa=(SLIDER[0], 0.42),
        pointb=(SLIDER[1], 0.42),
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
