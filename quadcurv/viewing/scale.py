"""Values on a colour scale: linear about zero, or decades."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from math import ceil, floor, log10

import numpy as np

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
        By scheme, as coloured: log10 where `logarithmic`. NaN where undefined.
    colours : str
        Name of a matplotlib colour map.
    limits : (float, float)
        Ends of the scale; values beyond take the colours of its ends.
    logarithmic : bool
    shows_zero : bool
        Whether what is below the scale is exactly 0 and has a colour of its own.
    """

    title: str
    values: Mapping[str, Floats]
    colours: str
    limits: tuple[float, float]
    logarithmic: bool = False
    shows_zero: bool = False

    def patches(self) -> list[tuple[str, str]]:
        """Labels and colours of what has no place on the scale: exact zeros and NaN, if there are any."""
        values = list(self.values.values())
        zero = self.shows_zero and any((v < self.limits[0]).any() for v in values)
        undefined = any(np.isnan(v).any() for v in values)
        return [("exactly 0", ZERO_COLOUR)] * zero + [("undefined", NAN_COLOUR)] * undefined

    def histogram(self, scheme: str, areas: Floats) -> Floats:
        """(BARS,) parts of the area whose values lie in equal parts of the scale.

        The first and the last include what lies beyond; exact zeros and NaN are in none.
        """
        low, high = self.limits
        values, weights = self.values[scheme], np.nan_to_num(areas).ravel()
        some = np.isfinite(values) & ~(self.shows_zero & (values < low))
        found = np.histogram(np.clip(values[some], low, high), BARS, self.limits, weights=weights[some])[0]
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
        if not self.logarithmic:
            return replace(self, limits=(float(low), float(high)))
        low, high = log10(low), log10(high)
        zero = self.limits[0]
        values = {k: np.where(v < zero, low - 1, np.maximum(v, low)) for k, v in self.values.items()}
        return replace(self, values=values, limits=(low, high))

    def ticks(self) -> list[tuple[float, str]]:
        """Positions on the scale and their labels; "≤" and "≥" where values lie beyond its ends."""
        low, high = self.limits
        places = self._decades() if self.logarithmic else np.linspace(low, high, 5).tolist()
        labels = [self._label(p) for p in places]
        known = np.concatenate([v[np.isfinite(v)] for v in self.values.values()])
        if (known == low if self.shows_zero else known < low).any():
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
            return f"{place:.3g}".replace("-", "−")
        return f"1e{place:.0f}" if abs(place - round(place)) < 1e-9 else f"{10**place:.1e}"

    def text(self, value: float) -> str:
        """What a coloured value stands for: a number, "undefined", or the end of a scale of decades."""
        if np.isnan(value):
            return "undefined"
        if self.shows_zero and value < self.limits[0]:
            return "0"
        number = f"{10 ** max(value, self.limits[0]) if self.logarithmic else value:.4g}".replace("-", "−")
        return f"≤ {number}" if self.logarithmic and value <= self.limits[0] else number


def linear(title: str, values: Mapping[str, Floats], areas: Floats, unsigned: bool = False) -> Field:
    """Scale about zero, or from zero on, whose ends are passed on 5 % of the area."""
    flat = {name: np.ravel(v) for name, v in values.items()}
    size = np.abs(np.concatenate(list(flat.values())))
    weight = np.tile(np.nan_to_num(areas).ravel(), len(flat))
    known = np.isfinite(size)
    end = _round_up(_quantile(size[known], weight[known], 1 - _SATURATED)) if known.any() else 1.0
    return Field(title, flat, "viridis" if unsigned else "RdBu_r", (0.0 if unsigned else -end, end))


def decades(
    title: str, values: Mapping[str, Floats], shows_zero: bool, limits: tuple[float, float] | None = None
) -> Field:
    """Logarithmic scale, by default of the :func:`decade_limits` of the values."""
    low, high = decade_limits(values.values()) if limits is None else limits
    logs = {name: logarithms(v) for name, v in values.items()}
    if shows_zero:  # small errors have the lowest colour, zeros alone lie below the scale
        logs = {k: np.where(v == -np.inf, low - 1, np.maximum(v, low)) for k, v in logs.items()}
    else:
        logs = {k: np.maximum(v, low - 1) for k, v in logs.items()}
    return Field(title, logs, "viridis", (low, high), logarithmic=True, shows_zero=shows_zero)


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
