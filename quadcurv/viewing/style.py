"""How maps look."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quadcurv.extras import need
from quadcurv.viewing.scale import Field


@dataclass(frozen=True)
class Style:
    """How maps look: what is None is chosen for the mesh and the field.

    Attributes
    ----------
    camera : (float, float, float), optional
        Direction from the surface to the viewer.
    size : (int, int), optional
        Width and height of a picture, a page or a window, in pixels.
    limits : (float, float), optional
        Ends of the colour scale of the field that is shown first, in its unit.
    colours : str, optional
        The matplotlib colour map of that field.
    title : str, optional
        A line above all views.
    shading : bool
        Whether surfaces are lit, which shows their shape and falsifies colours.
    thin : bool
        Whether a page of more than 20 MB shows all fields on fewer vertices, one for all in a cube of space,
        instead of fewer fields on all vertices.

    Raises
    ------
    ValueError
        A direction without length, a size below 100 pixels, limits that do not ascend, an unknown colour
        map, a title of several lines.

    Examples
    --------
    >>> from quadcurv.viewing import Style
    >>> Style(camera=(1, 0, 0.5), limits=(-1, 1), title="A ball").limits
    (-1, 1)
    """

    camera: tuple[float, float, float] | None = None
    size: tuple[int, int] | None = None
    limits: tuple[float, float] | None = None
    colours: str | None = None
    title: str | None = None
    shading: bool = False
    thin: bool = False

    def __post_init__(self) -> None:
        for name, number in (("camera", 3), ("size", 2), ("limits", 2)):
            given: Any = getattr(self, name)
            if given is not None and not _are_numbers(given, number):
                raise ValueError(f"{name}: expected {number} finite numbers, got {given!r}")
        if self.camera is not None and not any(self.camera):
            raise ValueError(f"camera: expected a direction, got {self.camera!r}")
        if self.size is not None and (min(self.size) < 100 or any(s != int(s) for s in self.size)):
            raise ValueError(f"size: expected whole numbers of pixels, at least 100, got {self.size!r}")
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise ValueError(f"limits: expected low < high, got {self.limits!r}")
        if self.title is not None and len(self.title.splitlines()) != 1:
            raise ValueError(f"title: expected one line, got {self.title!r}")
        if self.colours is not None:
            need("matplotlib")
            import matplotlib as mpl

            if self.colours not in mpl.colormaps:
                raise ValueError(
                    f"colours: matplotlib has no map {self.colours!r}; it has viridis, RdBu_r, ..."
                )

    def applied(self, field: Field) -> Field:
        """The field with the limits and colours asked for.

        Raises
        ------
        ValueError
            Limits that are not positive on a logarithmic scale.
        """
        if self.limits is not None:
            field = field.within(self.limits)
        return field if self.colours is None else replace(field, colours=self.colours)


def _are_numbers(given: Any, number: int) -> bool:
    try:
        values = np.asarray(given, float)
    except (TypeError, ValueError):
        return False
    return values.shape == (number,) and bool(np.isfinite(values).all())
