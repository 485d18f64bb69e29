"""Values on a colour scale: linear about zero, decades, or a few kinds."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, floor, log10

import numpy as np
from numpy.typing import NDArray

from quadcurv.types import Floats

NAN_COLOUR, ZERO_COLOUR = "#b0b0b0", "#f7cbdc"
BARS = 40  # of a histogram
_DECADES = 6
_SATURATED = 0.05


@dataclass(frozen=True, eq=False)
class Field:
    """One field, an array a view, on the colour scale that all views share.

    Attributes
    ----------
    title : str
        What it is, with its unit.
    values : dict of str to (n,) float64 array
        By view: the scheme, or the field's own name where no scheme enters it. NaN where undefined.
    colours : str
        Name of a matplotlib colour map.
    limits : (float, float)
        Ends of the scale, of log10 |value| where `logarithmic`; values beyond take the colours of its ends.
    logarithmic : bool
        Whether the scale is of decades: what is exactly 0 has a colour of its own.
    kinds : sequence of str
        Names of the values 0, 1, ... where there are no others.
    """

    title: str
    values: Mapping[str, Floats]
    colours: str
    limits: tuple[float, float]
    logarithmic: bool = False
    kinds: Sequence[str] = ()

    def coloured(self, view: str) -> Floats:
        """(n,) places on the scale: exact zeros lie one below it, other small ones at its lower end."""
        values = self.values[view]
        if not self.logarithmic:
            return values
        low = self.limits[0]
        return np.where(values == 0, low - 1, np.maximum(logarithms(values), low))

    def colour_table(self) -> NDArray[np.uint8]:
        """(256, 4) colours from the lower to the upper end of the scale."""
        import matplotlib as mpl

        table, places = mpl.colormaps[self.colours], np.arange(256)
        if self.kinds:
            n = len(self.kinds)
            table, places = table.resampled(n), places * n // 256
        return np.asarray(table(places, bytes=True))

    def patches(self) -> list[tuple[str, str]]:
        """Labels and colours of what has no place on the scale: exact zeros and NaN, if there are any."""
        values = list(self.values.values())
        zero = self.logarithmic and any((v == 0).any() for v in values)
        undefined = any(np.isnan(v).any() for v in values)
        return [("exactly 0", ZERO_COLOUR)] * zero + [("undefined", NAN_COLOUR)] * undefined

    def histogram(self, view: str, areas: Floats) -> Floats:
        """(BARS,) parts of the area whose values lie in equal parts of the scale.

        The first and the last include what lies beyond; NaN, and exact zeros of a scale of decades, are in
        none.
        """
        low, high = self.limits
        places, weights = self.coloured(view), np.nan_to_num(areas).ravel()
        some = ~np.isnan(places) & ~(self.logarithmic & (places < low))
        found = np.histogram(np.clip(places[some], low, high), BARS, self.limits, weights=weights[some])[0]
        return np.asarray(found / (weights.sum() or 1.0))

    def within(self, limits: tuple[float, float]) -> Field:
        """The same values on a scale with other ends, given as the quantity itself, not its logarithm.

        Raises
        ------
        ValueError
            They are not finite and ascending, or not positive although the scale is logarithmic.
        """
        low, high = limits
        if not (np.isfinite(limits).all() and low < high and (low > 0 or not self.logarithmic)):
            expected = "0 < low < high" if self.logarithmic else "low < high"
            raise ValueError(f"limits: expected {expected}, got {limits}")
        return replace(
            self, limits=(log10(low), log10(high)) if self.logarithmic else (float(low), float(high))
        )

    def ticks(self) -> list[tuple[float, str]]:
        """Positions on the scale and their labels; "≤" and "≥" where values lie beyond its ends."""
        if self.kinds:
            return list(enumerate(self.kinds))
        low, high = self.limits
        places = self._decades() if self.logarithmic else np.linspace(low, high, 5).tolist()
        labels = [self._label(p) for p in places]
        known = np.concatenate([v[~np.isnan(v)] for v in self.values.values()])
        if self.logarithmic:
            known = logarithms(known[known != 0])
        if (known < low).any():
            labels[0] = f"≤ {labels[0]}"
        if (known > high).any():
            labels[-1] = f"≥ {labels[-1]}"
        return list(zip(places, labels, strict=True))

    def _decades(self) -> list[float]:
        """Whole powers of ten, nine at most, and the ends of the scale."""
        low, high = self.limits
        step = ceil((high - low) / 8)
        inside = [p for p in range(ceil(low), ceil(high), step) if low + 0.4 < p < high - 0.4 * step]
        return [low, *map(float, inside), high]

    def _label(self, place: float) -> str:
        if not self.logarithmic:
            return _short(place, 3)
        mantissa, exponent = f"{10**place:.1e}".split("e")
        return f"{float(mantissa):g}e{int(exponent)}"

    def text(self, value: float) -> str:
        """A value as a reader wants it: a number, of errors without its sign, its kind, or "undefined"."""
        if np.isnan(value):
            return "undefined"
        if self.kinds:
            return self.kinds[round(value)]
        return _short(abs(value) if self.logarithmic else value, 5)


def _short(value: float, digits: int) -> str:
    mantissa, _, exponent = f"{value:.{digits}g}".partition("e")
    return (f"{mantissa}e{int(exponent)}" if exponent else mantissa).replace("-", "−")


def linear(title: str, values: Mapping[str, Floats], areas: Floats, unsigned: bool = False) -> Field:
    """Scale about zero, or from zero on, whose ends are passed on 5 % of the area."""
    flat = {name: np.ravel(v) for name, v in values.items()}
    size = np.abs(np.concatenate(list(flat.values())))
    weight = np.tile(np.nan_to_num(areas).ravel(), len(flat))
    known = np.isfinite(size)
    end = _round_up(_quantile(size[known], weight[known], 1 - _SATURATED)) if known.any() else 1.0
    return Field(title, flat, "viridis" if unsigned else "RdBu_r", (0.0 if unsigned else -end, end))


def decades(title: str, values: Mapping[str, Floats], limits: tuple[float, float] | None = None) -> Field:
    """Logarithmic scale, by default of the :func:`decade_limits` of the values."""
    flat = {name: np.ravel(v) for name, v in values.items()}
    ends = decade_limits(flat.values()) if limits is None else limits
    return Field(title, flat, "viridis", ends, logarithmic=True)


def decade_limits(values: Iterable[Floats]) -> tuple[float, float]:
    """Whole powers of ten about all values, six decades at most, whose upper end is never passed."""
    logs = [logarithms(v) for v in values]
    known = np.concatenate([v[np.isfinite(v)] for v in logs])
    high = ceil(known.max()) if known.size else 0
    low = floor(np.percentile(known, 1)) if known.size else -1
    return min(max(low, high - _DECADES), high - 1), high


def logarithms(values: Floats) -> Floats:
    """log10 of the sizes, -inf of zero."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log10(np.abs(np.ravel(values))))


def _quantile(values: Floats, weights: Floats, part: float) -> float:
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(below, part * below[-1])])


def _round_up(value: float) -> float:
    """To the next of 1, 1.2, 1.6, 2, 3, 4, 5, 6, 8 times a power of ten."""
    if value == 0:
        return 1.0
    power = 10.0 ** floor(log10(value))
    steps = (1, 1.2, 1.6, 2, 3, 4, 5, 6, 8, 10)
    return float(next(step for step in steps if step * power >= value * (1 - 1e-9)) * power)
