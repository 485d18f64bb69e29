"""Maps of a comparison as one page in HTML that needs no network, and no OpenGL where it is made."""

from __future__ import annotations

import base64
import html
import json
import warnings
from dataclasses import dataclass
from importlib.resources import files
from math import floor, log10
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from quadcurv.comparison import Comparison
from quadcurv.io.replacing import replacing
from quadcurv.types import Floats
from quadcurv.viewing.fields import FIELDS, OF_MESH, Fields
from quadcurv.viewing.geometry import OVERLAYS, viewpoint
from quadcurv.viewing.scale import BARS, NAN_COLOUR, ZERO_COLOUR, Field
from quadcurv.viewing.style import Style

LIMIT = 20_000_000  # bytes; beyond that fields are left out
_UNDEFINED, _MOST = -1e38, 1e27  # what the page takes for NaN, and the largest value it takes
_DESCRIPTION = 2000  # bytes of a field without its values
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


def make_page(comparison: Comparison, field: str = "mean_curvature", style: Style | None = None) -> Page:
    """Linked views, one a scheme, and every field to choose from.

    Parameters
    ----------
    comparison : Comparison
    field : str
        The one of :attr:`quadcurv.viewing.Fields.names` to show first.
    style : Style
        All but its size.

    Returns
    -------
    Page
        Of 20 MB at most where that can be: fields are left out, the one to show first excepted.

    Raises
    ------
    ValueError
        Unknown field; limits of the style that do not fit its scale.

    Warns
    -----
    UserWarning
        Fields were left out, or the page is larger nevertheless.
    """
    style = style or Style()
    fields = Fields(comparison)
    first = style.applied(fields.field(field))
    points, faces, on_cells = fields.drawn
    towards, up = viewpoint(points, style.camera)
    centre = points.min(axis=0) / 2 + points.max(axis=0) / 2
    extent = np.ptp(points, axis=0).max() or 1.0
    areas = np.nan_to_num(comparison.areas)
    data: dict[str, Any] = {
        "title": style.title,
        "shading": style.shading,
        "field": field,
        "schemes": comparison.schemes,
        "on_cells": on_cells,
        "points": _encode((points - centre) / extent, "<f4"),
        "faces": _encode(faces, "<i4"),
        "valence": _counts(comparison.valence),
        "areas": _encode(areas / (areas.max() or 1.0), "<f4"),
        "bars": BARS,
        "towards": towards.tolist(),
        "up": up.tolist(),
        "overlays": [
            {
                "name": name,
                "colour": OVERLAYS[name],
                "lines": vertices.ndim == 2,
                "vertices": _encode(vertices, "<u4"),
            }
            for name, vertices in fields.overlays.items()
        ],
        "undefined": _UNDEFINED,
        "most": _MOST,
        "undefined_colour": NAN_COLOUR,
        "zero_colour": ZERO_COLOUR,
    }
    template = files("quadcurv.viewing").joinpath("page.html").read_text(encoding="utf-8")
    size = len(template) + len(json.dumps(data))
    data |= _chosen_fields(fields, field, first, size)
    text = json.dumps(data).replace("<", "\\u003c")  # no name can end the script
    return Page(template.replace("@DATA@", text))


def _chosen_fields(fields: Fields, name: str, first: Field, size: int) -> dict[str, Any]:
    """Descriptions of the fields that the limit leaves room for, and their arrays, each stored once."""
    arrays: dict[bytes, int] = {}
    found = {name: _field(name, first, arrays)}
    one = 4 * -(-4 * fields.comparison.valence.size // 3)  # bytes of an array in base64
    left_out = []
    for other in fields.names:
        if other == name:
            continue
        most = 1 if other in OF_MESH else len(fields.comparison.schemes)
        described = sum(len(json.dumps(f)) for f in found.values()) + _DESCRIPTION
        if size + described + one * (len(arrays) + most) > LIMIT:
            left_out.append(other)
        else:
            found[other] = _field(other, fields.field(other), arrays)
    size += one * len(arrays)
    if left_out:
        beyond = "" if size <= LIMIT else f", and it still takes {size / 1e6:.0f} MB"
        warnings.warn(
            f"a page with all fields of {fields.comparison.valence.size} vertices would take more than "
            f"{LIMIT / 1e6:.0f} MB: without {', '.join(left_out)}{beyond}",
            stacklevel=4,
        )
    return {
        "fields": [found[other] for other in fields.names if other in found],
        "arrays": [base64.b64encode(a).decode() for a in arrays],
    }


def _field(name: str, field: Field, arrays: dict[bytes, int]) -> dict[str, Any]:
    """Description of a field; its values by scheme are numbers of arrays."""
    import matplotlib as mpl

    unit = _unit(field)
    values = {}
    for scheme, v in field.values.items():
        array = _in_single_precision(v, unit)
        values[scheme] = arrays.setdefault(array.tobytes(), len(arrays))
    return {
        "name": name,
        "label": name.replace("_", " ") if name in FIELDS else name,
        "title": field.title,
        "limits": [end / unit for end in field.limits],
        "unit": unit,
        "logarithmic": field.logarithmic,
        "shows_zero": field.shows_zero,
        "colours": _encode(mpl.colormaps[field.colours](np.arange(256), bytes=True), "u1"),
        "ticks": [(place / unit, label) for place, label in field.ticks()],
        "patches": field.patches(),
        "values": values,
    }


def _unit(field: Field) -> float:
    """Power of ten that brings a linear scale into the range of single precision."""
    end = max(map(abs, field.limits))
    return 1.0 if field.logarithmic or _SINGLE[0] <= end <= _SINGLE[1] else 10.0 ** floor(log10(end))


def _in_single_precision(values: Floats, unit: float) -> NDArray[np.float32]:
    with np.errstate(over="ignore"):
        return np.nan_to_num(np.clip(values / unit, -_MOST, _MOST), nan=_UNDEFINED).astype("<f4")


def _counts(values: NDArray[Any]) -> dict[str, str]:
    """Whole numbers in as few bytes as the largest needs."""
    bits = next(b for b in (8, 16, 32) if values.max(initial=0) < 2**b)
    return {"type": f"Uint{bits}Array", "data": _encode(values, f"<u{bits // 8}")}


def _encode(array: ArrayLike, dtype: DTypeLike) -> str:
    return base64.b64encode(np.asarray(array).astype(dtype).tobytes()).decode()
