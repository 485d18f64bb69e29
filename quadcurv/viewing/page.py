"""Maps of a comparison as one page in HTML that needs no network, and no OpenGL where it is made."""

from __future__ import annotations

import base64
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from quadcurv.comparison import Comparison
from quadcurv.viewing.fields import FIELDS, Fields
from quadcurv.viewing.geometry import OVERLAYS, viewpoint
from quadcurv.viewing.scale import BARS, NAN_COLOUR, ZERO_COLOUR, Field
from quadcurv.viewing.style import Style

_UNDEFINED = -1e30  # what the page takes for NaN


def save_page(
    comparison: Comparison, path: str | Path, field: str = "mean_curvature", style: Style | None = None
) -> None:
    """Write one page with linked views, one a scheme, and every field to choose from.

    Parameters
    ----------
    comparison : Comparison
    path : path-like
    field : str
        The one of :attr:`quadcurv.viewing.Fields.names` to show first.
    style : Style

    Raises
    ------
    ValueError
        Unknown field; limits of the style that do not fit its scale.
    """
    style = style or Style()
    fields = Fields(comparison)
    first = style.applied(fields.field(field))
    points, faces, on_cells = fields.drawn
    towards, up = viewpoint(points, style.camera)
    arrays: dict[bytes, int] = {}
    shown = [_field(name, first if name == field else fields.field(name), arrays) for name in fields.names]
    data = {
        "field": field,
        "schemes": comparison.schemes,
        "on_cells": on_cells,
        "points": _encode(points - points.mean(axis=0), "<f4"),
        "faces": _encode(faces, "<i4"),
        "valence": _encode(comparison.valence, "u1"),
        "areas": _encode(np.nan_to_num(comparison.areas), "<f4"),
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
        "undefined_colour": NAN_COLOUR,
        "zero_colour": ZERO_COLOUR,
        "fields": shown,
        "arrays": [base64.b64encode(a).decode() for a in arrays],
    }
    template = files("quadcurv.viewing").joinpath("page.html").read_text(encoding="utf-8")
    text = json.dumps(data).replace("<", "\\u003c")  # no name can end the script
    Path(path).write_text(template.replace("@DATA@", text), encoding="utf-8")


def _field(name: str, field: Field, arrays: dict[bytes, int]) -> dict[str, Any]:
    """Description of a field; its values by scheme are numbers of arrays, each stored once."""
    import matplotlib as mpl

    values = {}
    for scheme, v in field.values.items():
        array = np.nan_to_num(v, nan=_UNDEFINED).astype("<f4").tobytes()
        values[scheme] = arrays.setdefault(array, len(arrays))
    return {
        "name": name,
        "label": name.replace("_", " ") if name in FIELDS else name,
        "title": field.title,
        "limits": field.limits,
        "logarithmic": field.logarithmic,
        "shows_zero": field.shows_zero,
        "colours": _encode(mpl.colormaps[field.colours](np.arange(256), bytes=True), "u1"),
        "ticks": field.ticks(),
        "patches": field.patches(),
        "values": values,
    }


def _encode(array: ArrayLike, dtype: DTypeLike) -> str:
    return base64.b64encode(np.asarray(array).astype(dtype).tobytes()).decode()
