"""Colours of scalars: by their percentiles, grey where nothing is known."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.extras import need
from quadcurv.types import Bools, Floats

# Every fifteenth of the 256 colours of viridis (S. van der Walt, N. Smith 2015), for files, which need no
# matplotlib to be written; between them no channel is off by more than 5 of 255.
_VIRIDIS = bytes.fromhex(
    "440154471669472a79433c843c4d8a355d8c2e6c8e287a8e23898d1e978a20a5852eb27c45bf6f64cb5d88d547afdc2ed7e219fde724"
)
_GREY = (128, 128, 128, 255)


def viridis(values: NDArray[Any]) -> NDArray[np.uint8]:
    """(n, 4) RGBA of scalars over the range from their 2nd to their 98th percentile."""
    table = np.frombuffer(_VIRIDIS, np.uint8).reshape(-1, 3)
    known, share = _share(values)
    rgba = np.full((len(values), 4), _GREY, np.uint8)
    for channel in range(3):
        found = np.interp(share, np.linspace(0, 1, len(table)), table[:, channel])
        rgba[known, channel] = np.round(found)
    return rgba


def colours(values: NDArray[Any], colormap: str) -> NDArray[np.uint8]:
    """The same by any colormap of matplotlib."""
    need("matplotlib")
    from matplotlib import colormaps

    if colormap not in colormaps:
        raise ValueError(f"colormap: matplotlib has no {colormap!r}")
    known, share = _share(values)
    rgba = np.full((len(values), 4), _GREY, np.uint8)
    rgba[known] = colormaps[colormap](share, bytes=True)
    return rgba


def _share(values: NDArray[Any]) -> tuple[Bools, Floats]:
    """Which values are finite, and where each of these lies in the range, from 0 to 1."""
    known = np.isfinite(values)
    finite = values[known].astype(float)
    if not finite.size:
        return known, finite
    low, high = np.percentile(finite, (2, 98))
    if not low < high:  # all but a few are equal
        low, high = finite.min(), finite.max()
    with np.errstate(over="ignore", invalid="ignore"):
        return known, np.nan_to_num(np.clip((finite - low) / ((high - low) or 1.0), 0, 1))
