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
from quadcurv.viewing import fields
from quadcurv.viewing.fields import NAN_COLOUR, OVERLAYS, ZERO_COLOUR, Field

_UNDEFINED = -1e30  # what the page takes for NaN


def save_page(comparison: Comparison, path: str | Path, field: str = "mean_curvature") -> None:
    """Write one page with linked views, one a scheme, and every field to choose from.

    Parameters
    ----------
    comparison : Comparison
    path : path-like
    field : str
        The one of :func:`quadcurv.viewing.fields.names` to show first.

    Raises
    ------
    ValueError
        Unknown field.
    """
    fields.field(comparison, field)
    points, faces, on_cells = fields.drawn(comparison.mesh)
    towards, up = fields.viewpoint(points)
    arrays: dict[bytes, int] = {}
    shown = [_field(name, fields.field(comparison, name), arrays) for name in fields.names(comparison)]
    data = {
        "field": field,
        "schemes": comparison.schemes,
        "on_cells": on_cells,
        "points": _encode(points - points.mean(axis=0), "<f4"),
        "faces": _encode(faces, "<i4"),
        "valence": _encode(comparison.valence, "u1"),
        "areas": _encode(np.nan_to_num(comparison.areas), "<f4"),
        "bars": fields.BARS,
        "towards": towards.tolist(),
        "up": up.tolist(),
        "overlays": [
            {
                "name": name,
                "colour": OVERLAYS[name],
                "lines": vertices.ndim == 2,
                "vertices": _encode(vertices, "<u4"),
            }
            for name, vertices in fields.overlays(comparison.mesh).items()
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
        "label": name.replace("_", " ") if name in fields.FIELDS else name,
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
