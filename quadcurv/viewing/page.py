"""Maps of a comparison as one page in HTML that needs no network, and no OpenGL where it is made."""

from __future__ import annotations

import base64
import html
import json
from dataclasses import dataclass
from importlib.resources import files
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from quadcurv.comparison import Comparison
from quadcurv.io.replacing import replacing
from quadcurv.types import Floats, warn
from quadcurv.viewing.fields import FIELDS, Fields
from quadcurv.viewing.geometry import OVERLAYS, thinned, viewpoint
from quadcurv.viewing.scale import BARS, NAN_COLOUR, ZERO_COLOUR, Field
from quadcurv.viewing.style import Style

LIMIT = 20_000_000  # bytes; beyond that fields are left out, or the surface is thinned
_UNDEFINED, _MOST, _LEAST = -1e38, 1e27, 1e-37  # what the page takes for NaN; sizes of values that it takes
_DESCRIPTION = 4000  # bytes of a field without its values
_FEW = 100  # vertices, below which a page is not thinned
_SINGLE = 1e-20, 1e20  # limits of a scale that single precision holds with room around


@dataclass(frozen=True, repr=False)
class Page:
    """A page, to be saved or shown in a notebook.

    Attributes
    ----------
    text : str
        The whole page in HTML.
    """

    text: str

    def __repr__(self) -> str:
        return f"Page({len(self.text) / 1e6:.1f} MB)"

    def save(self, path: str | Path) -> None:
        """Write the page to a file; one that was there stays as it was if that fails."""
        with replacing(path) as beside:
            beside.write_text(self.text, encoding="utf-8")

    def _repr_html_(self) -> str:
        """How a notebook shows it: in a frame of its own."""
        return (
            f'<iframe srcdoc="{html.escape(self.text)}" width="100%" height="560" style="border: 0" '
            'sandbox="allow-scripts"></iframe>'
        )


def make_page(comparison: Comparison, field: str, style: Style) -> Page:
    """Linked views, one a scheme, and every field to choose from; see :func:`quadcurv.viewing.html_page`."""
    fields = Fields(comparison)
    first = style.applied(fields.field(field))
    towards, up = viewpoint(fields.drawn.points, style.camera)
    described = {
        "title": style.title,
        "shading": style.shading,
        "size": style.size,
        "towards": towards.tolist(),
        "up": up.tolist(),
        "field": field,
        "schemes": comparison.schemes,
        "bars": BARS,
        "undefined": _UNDEFINED,
        "most": _MOST,
        "undefined_colour": NAN_COLOUR,
        "zero_colour": ZERO_COLOUR,
    }
    template = _template()
    content = (_all_on_fewer if style.thin else _fewer_on_all)(fields, first, field, len(template))
    text = json.dumps(described | content).replace("<", "\\u003c")  # no name can end the script
    return Page(template.replace("@DATA@", text))


def _all_on_fewer(fields: Fields, first: Field, field: str, fixed: int) -> dict[str, Any]:
    """All fields, on as many vertices as the limit leaves room for."""
    shown = {name: first if name == field else fields.field(name) for name in fields.names}
    part, surface = 1.0, _Surface(fields)
    while True:
        arrays: dict[bytes, int] = {}
        found = [_field(name, f, arrays, surface.kept) for name, f in shown.items()]
        geometry, descriptions = surface.describe(), len(json.dumps(found))
        growing = len(json.dumps(geometry)) + len(arrays) * _in_base64(4 * len(surface.kept))
        room = LIMIT - fixed - descriptions - _DESCRIPTION
        if growing <= room or len(surface.kept) < _FEW:
            return geometry | {"fields": found, "arrays": _as_text(arrays)}
        part *= 0.97 * room / growing
        surface = _Surface(fields, part)


def _fewer_on_all(fields: Fields, first: Field, field: str, fixed: int) -> dict[str, Any]:
    """The fields that the limit leaves room for, the one to show first in any case, on all vertices."""
    surface, n = _Surface(fields), fields.comparison.valence.size
    geometry = surface.describe()
    size, one = fixed + len(json.dumps(geometry)), _in_base64(4 * n)
    arrays: dict[bytes, int] = {}
    found = {field: _field(field, first, arrays, surface.kept)}
    left_out = []
    for other in fields.names:
        if other == field:
            continue
        described = sum(len(json.dumps(f)) for f in found.values()) + _DESCRIPTION
        if size + described + one * (len(arrays) + len(fields.comparison.schemes)) > LIMIT:
            left_out.append(other)
        else:
            found[other] = _field(other, fields.field(other), arrays, surface.kept)
    size += one * len(arrays)
    if left_out:
        beyond = "" if size <= LIMIT else f", and it still takes {size / 1e6:.0f} MB"
        warn(
            f"a page with all fields of {n} vertices would take more than {LIMIT / 1e6:.0f} MB: without "
            f"{', '.join(left_out)}{beyond}; Style(thin=True), or --thin, shows all on fewer vertices",
            UserWarning,
        )
    in_order = [found[name] for name in fields.names if name in found]
    return geometry | {"fields": in_order, "arrays": _as_text(arrays)}


def _as_text(arrays: dict[bytes, int]) -> list[str]:
    return [base64.b64encode(array).decode() for array in arrays]


def _template() -> str:
    """The page without its data, in one file."""
    room = files("quadcurv.viewing")
    page, style, surface, controls = (
        room.joinpath(name).read_text(encoding="utf-8")
        for name in ("page.html", "page.css", "page_surface.js", "page_controls.js")
    )
    return page.replace("@STYLE@", style).replace("@SCRIPT@", surface + controls)


class _Surface:
    """What is drawn: all of a comparison's mesh, or a part of as many points and faces."""

    def __init__(self, fields: Fields, part: float = 1.0) -> None:
        self._fields = fields
        self._drawn = fields.drawn
        self._place: NDArray[Any] = np.arange(len(self._drawn.points))
        self.kept: NDArray[Any] = np.arange(fields.comparison.valence.size)  # whose values are shown
        self._areas: NDArray[Any] = np.nan_to_num(fields.comparison.areas).ravel()
        if part < 1:
            self._drawn, self.kept, self._place = thinned(self._drawn, int(part * len(self._place)))
            if self._drawn.on_cells:
                self._areas = self._areas[self.kept]
            else:  # of all that a point stands for
                some = self._place >= 0
                self._areas = np.bincount(self._place[some], self._areas[some], len(self.kept))

    def describe(self) -> dict[str, Any]:
        """Geometry, counts and marks as the page reads them."""
        points, faces, on_cells = self._drawn
        centre = points.min(axis=0) / 2 + points.max(axis=0) / 2
        extent = float(np.ptp(points, axis=0).max()) or 1.0
        return {
            "on_cells": on_cells,
            "points": _encode((points - centre) / extent, "<f4"),
            "middle": centre.tolist(),
            "extent": extent,
            "faces": _encode(faces, "<i4"),
            "numbers": _counts(self.kept),
            "valence": _counts(self._fields.comparison.valence.ravel()[self.kept]),
            "areas": _encode(self._areas / (self._areas.max() or 1.0), "<f4"),
            "overlays": [
                {
                    "name": name,
                    "colour": OVERLAYS[name],
                    "lines": vertices.ndim == 2,
                    "vertices": _encode(self._placed(vertices), "<u4"),
                }
                for name, vertices in self._fields.overlays.items()
            ],
        }

    def _placed(self, vertices: NDArray[Any]) -> NDArray[Any]:
        """Edges or vertices where they are drawn, each once."""
        place = self._place[vertices]
        if place.ndim == 2:
            place = place[place[:, 0] != place[:, 1]]
        return np.unique(place, axis=0)


def _field(name: str, field: Field, arrays: dict[bytes, int], kept: NDArray[Any]) -> dict[str, Any]:
    """Description of a field; its values by view are numbers of arrays."""
    unit = _unit(field)
    values = {}
    for view, v in field.values.items():
        array = _in_single_precision(v[kept], unit)
        values[view] = arrays.setdefault(array.tobytes(), len(arrays))
    return {
        "name": name,
        "label": name.replace("_", " ") if name in FIELDS else name,
        "title": field.title,
        "limits": list(field.limits) if field.logarithmic else [end / unit for end in field.limits],
        "unit": unit,
        "logarithmic": field.logarithmic,
        "kinds": list(field.kinds),
        "colours": _encode(field.colour_table(), "u1"),
        "values": values,
    }


def _unit(field: Field) -> float:
    """Power of ten that brings a scale into the range of single precision."""
    end = field.limits[1] if field.logarithmic else log10(max(map(abs, field.limits)))
    return 1.0 if log10(_SINGLE[0]) <= end <= log10(_SINGLE[1]) else 10.0 ** floor(end)


def _in_single_precision(values: Floats, unit: float) -> NDArray[np.float32]:
    """Values in a unit, NaN as the page knows it; what is not 0 does not become it."""
    with np.errstate(over="ignore", under="ignore"):
        size = np.clip(np.abs(values / unit), _LEAST, _MOST)
    small = np.where(values == 0, 0.0, np.copysign(size, values))
    return np.nan_to_num(small, nan=_UNDEFINED).astype("<f4")


def _in_base64(size: int) -> int:
    return 4 * -(-size // 3)


def _counts(values: NDArray[Any]) -> dict[str, str]:
    """Whole numbers in as few bytes as the largest needs."""
    bits = next(b for b in (8, 16, 32) if values.max(initial=0) < 2**b)
    return {"type": f"Uint{bits}Array", "data": _encode(values, f"<u{bits // 8}")}


def _encode(array: ArrayLike, dtype: DTypeLike) -> str:
    return base64.b64encode(np.asarray(array).astype(dtype).tobytes()).decode()
