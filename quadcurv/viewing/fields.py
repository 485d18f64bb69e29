"""What a map shows: fields of a comparison, each on its colour scale."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations_with_replacement
from math import ceil, floor, log10

import numpy as np
from scipy.spatial import cKDTree

from quadcurv.comparison import Comparison
from quadcurv.curvature import curvatures
from quadcurv.mesh import Mesh, QuadGrid, StaggeredGrid
from quadcurv.quality import quality
from quadcurv.schemes import Curvatures
from quadcurv.types import Floats, Ints, MeshError

NAN_COLOUR, ZERO_COLOUR = "#b0b0b0", "#f7cbdc"
OVERLAYS = {"boundary": "#000000", "seam": "#e69f00", "valence < 4": "#56b4e9", "valence > 4": "#d55e00"}
BARS = 40  # of a histogram
_DECADES = 6
_DIFFERENCE = "difference to "
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
        return np.asarray(found / weights.sum())

    def within(self, limits: tuple[float, float]) -> Field:
        """The same errors on a scale with other ends, given as errors.

        Raises
        ------
        ValueError
            They are not positive and ascending.
        """
        low, high = limits
        if not 0 < low < high:
            raise ValueError(f"limits: expected 0 < low < high, got {limits}")
        low, high = log10(low), log10(high)
        zero = self.limits[0]
        values = {k: np.where(v < zero, low - 1, np.maximum(v, low)) for k, v in self.values.items()}
        return replace(self, values=values, limits=(low, high))

    def ticks(self) -> list[tuple[float, str]]:
        """Positions on the scale and their labels; "≤" and "≥" where values lie beyond its ends."""
        low, high = self.limits
        places = np.arange(low, high + 0.5) if self.logarithmic else np.linspace(low, high, 5)
        labels = [f"1e{p:.0f}" if self.logarithmic else f"{p:.3g}".replace("-", "−") for p in places]
        known = np.concatenate([v[np.isfinite(v)] for v in self.values.values()])
        if (known == low if self.shows_zero else known < low).any():
            labels[0] = f"≤ {labels[0]}"
        if (known > high).any():
            labels[-1] = f"≥ {labels[-1]}"
        return list(zip(places.tolist(), labels, strict=True))

    def text(self, value: float) -> str:
        """What a coloured value stands for: a number, "undefined", or the end of a scale of decades."""
        if np.isnan(value):
            return "undefined"
        if self.shows_zero and value < self.limits[0]:
            return "0"
        number = f"{10 ** max(value, self.limits[0]) if self.logarithmic else value:.4g}".replace("-", "−")
        return f"≤ {number}" if self.logarithmic and value <= self.limits[0] else number


def names(comparison: Comparison) -> list[str]:
    """Fields of a comparison: :data:`FIELDS` and, of several schemes, "difference to SCHEME" for each."""
    references = comparison.schemes if len(comparison.schemes) > 1 else ()
    return [*FIELDS, *(_DIFFERENCE + scheme for scheme in references)]


@functools.lru_cache(maxsize=2)
def field(comparison: Comparison, name: str) -> Field:
    """Field of a comparison, on its colour scale.

    Parameters
    ----------
    comparison : Comparison
    name : str
        Of :func:`names`.

    Returns
    -------
    Field

    Raises
    ------
    ValueError
        Unknown name.
    """
    if name not in names(comparison):
        expected = ", ".join([*FIELDS, f"{_DIFFERENCE}SCHEME"])
        raise ValueError(f"field: expected one of {expected}, got {name!r}")
    if name in FIELDS:
        return FIELDS[name](comparison)
    return _difference(comparison, name.removeprefix(_DIFFERENCE))


def _mean_curvature(comparison: Comparison) -> Field:
    unsigned = not comparison.mesh.stencils().orientable
    title = "mean curvature |H| (1/length)" if unsigned else "mean curvature H (1/length)"
    return _linear(comparison, title, comparison.mean_curvature, unsigned)


def _error(comparison: Comparison) -> Field:
    if comparison.exact is None:
        title = f"difference |H − {comparison.reference}| (1/length)"
        return _decades(title, comparison.errors, shows_zero=False)
    return _decades("error |H − exact| (1/length)", comparison.errors, shows_zero=True)


def _signed_error(comparison: Comparison) -> Field:
    return _linear(comparison, f"H − {comparison.reference} (1/length)", comparison.errors)


def _difference(comparison: Comparison, reference: str) -> Field:
    differences = _differences(comparison)
    values = {s: differences.values[_pair(s, reference)] for s in comparison.schemes}
    return replace(differences, title=f"difference to {reference}, |H − H'| (1/length)", values=values)


@functools.lru_cache(maxsize=1)
def _differences(comparison: Comparison) -> Field:
    """Of every two schemes, on one scale whichever is the reference."""
    pairs = combinations_with_replacement(comparison.mean_curvature.items(), 2)
    return _decades("", {_pair(a, b): H - other for (a, H), (b, other) in pairs}, shows_zero=True)


def _pair(a: str, b: str) -> str:
    return " − ".join(sorted((a, b)))


def _gaussian_curvature(comparison: Comparison) -> Field:
    K = jet(comparison).gaussian
    values = dict.fromkeys(comparison.schemes, K)
    return _linear(comparison, "Gaussian curvature K by jet (1/length²)", values)


def _principal_curvature(sign: int, name: str) -> Callable[[Comparison], Field]:
    def field(comparison: Comparison) -> Field:
        K = jet(comparison).gaussian
        values = {
            scheme: H + sign * np.sqrt(np.maximum(H**2 - K, 0))
            for scheme, H in comparison.mean_curvature.items()
        }
        operation = "+" if sign > 0 else "−"
        return _linear(comparison, f"{name} = H {operation} √(H² − K), K by jet (1/length)", values)

    return field


def _quality(measure: str, title: str, limits: tuple[float, float]) -> Callable[[Comparison], Field]:
    def field(comparison: Comparison) -> Field:
        found = _quality_of(comparison.mesh)[measure].ravel()
        return Field(title, dict.fromkeys(comparison.schemes, found), "viridis", limits)

    return field


def _small_quality(measure: str, title: str) -> Callable[[Comparison], Field]:
    def field(comparison: Comparison) -> Field:
        values = dict.fromkeys(comparison.schemes, _quality_of(comparison.mesh)[measure])
        return _decades(title, values, shows_zero=True)

    return field


@functools.lru_cache(maxsize=1)
def _quality_of(mesh: Mesh) -> dict[str, Floats]:
    return quality(mesh)


def _valence(comparison: Comparison) -> Field:
    valence = comparison.valence.ravel().astype(np.float64)
    values = dict.fromkeys(comparison.schemes, valence)
    return Field("valence (faces at the vertex)", values, "PuOr_r", (2.0, 6.0))


def _linear(
    comparison: Comparison, title: str, values: Mapping[str, Floats], unsigned: bool = False
) -> Field:
    """Scale about zero whose ends are passed on 5 % of the area."""
    flat = {name: np.ravel(v) for name, v in values.items()}
    size = np.abs(np.concatenate(list(flat.values())))
    weight = np.tile(comparison.areas.ravel(), len(flat))
    known = np.isfinite(size)
    end = _round_up(_quantile(size[known], weight[known], 1 - _SATURATED)) if known.any() else 1.0
    return Field(title, flat, "viridis" if unsigned else "RdBu_r", (0.0 if unsigned else -end, end))


def _decades(title: str, values: Mapping[str, Floats], shows_zero: bool) -> Field:
    """Logarithmic scale of whole decades, six at most, whose upper end is never passed."""
    with np.errstate(divide="ignore"):
        logs = {name: np.log10(np.abs(np.ravel(v))) for name, v in values.items()}
    known = np.concatenate([v[np.isfinite(v)] for v in logs.values()])
    high = ceil(known.max()) if known.size else 0
    low = floor(np.percentile(known, 1)) if known.size else -1
    low = min(max(low, high - _DECADES), high - 1)
    if shows_zero:  # small errors have the lowest colour, zeros alone lie below the scale
        logs = {k: np.where(v == -np.inf, low - 1, np.maximum(v, low)) for k, v in logs.items()}
    else:
        logs = {k: np.maximum(v, low - 1) for k, v in logs.items()}
    return Field(title, logs, "viridis", (low, high), logarithmic=True, shows_zero=shows_zero)


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


FIELDS: dict[str, Callable[[Comparison], Field]] = {
    "mean_curvature": _mean_curvature,
    "error": _error,
    "signed_error": _signed_error,
    "gaussian_curvature": _gaussian_curvature,
    "k1": _principal_curvature(+1, "k1"),
    "k2": _principal_curvature(-1, "k2"),
    "valence": _valence,
    "skew": _quality("skew", "skew of the worst face (degrees from 90, in triangles 60)", (0.0, 90.0)),
    "aspect": _quality("aspect", "longest over shortest edge of the worst face", (1.0, 5.0)),
    "nonplanarity": _small_quality("nonplanarity", "gap over mean length of the diagonals, worst face"),
    "roughness": _small_quality("roughness", "relative error of extrapolation at the boundary, about"),
}
"""Fields that a map of any comparison can show, by name."""


@functools.lru_cache(maxsize=2)
def jet(comparison: Comparison) -> Curvatures:
    """All curvatures by jet; what is beyond a grid too narrow to be continued is left out of the fits."""
    try:
        return curvatures(comparison.mesh)
    except MeshError:
        return curvatures(comparison.mesh, boundary="nan")


def drawn(mesh: Mesh) -> tuple[Floats, Ints, bool]:
    """Points and faces, (m, 4) with -1 behind triangles, to draw; and whether values belong to faces.

    Values of a mesh or grid belong to its points; those of a staggered grid to its cells.
    """
    if isinstance(mesh, StaggeredGrid):
        cells = QuadGrid(mesh.dual).stencils()
        return cells.points, cells.faces, True
    stencils = mesh.stencils()
    return stencils.points, stencils.faces, False


@functools.lru_cache(maxsize=2)
def overlays(mesh: Mesh) -> dict[str, Ints]:
    """Edges (k, 2) of the boundary and of seams, vertices (k,) of too few and too many faces.

    Extraordinary vertices are interior ones of a valence other than 4; a staggered grid, made of cells,
    has none. Seams are where a grid wraps, and where two edges of the boundary lie at the same place, as
    along a fold. What a mesh has none of is left out.
    """
    points, faces, on_cells = drawn(mesh)
    sides = np.where(faces[:, 3] < 0, 3, 4)
    face, slot = np.nonzero(np.arange(4) < sides[:, None])
    ends = np.stack((faces[face, slot], faces[face, (slot + 1) % sides[face]])).astype(np.int64)
    ends.sort(axis=0)
    key, count = np.unique(ends[0] * len(points) + ends[1], return_counts=True)
    edges = np.stack(np.divmod(key, len(points)), axis=1).astype(np.int32)
    interior = np.ones(len(points), bool)
    border = edges[count == 1]
    interior[border] = False
    middles = points[border].mean(axis=1)
    gap = cKDTree(middles).query(middles, k=2)[0][:, 1]
    meets = gap < 1e-9 * np.ptp(points, axis=0).max()
    seams = border[meets]
    if isinstance(mesh, QuadGrid):
        index = np.arange(len(points), dtype=np.int32).reshape(mesh.shape)
        along = [line for line, wraps in ((index[0], mesh.wrap[0]), (index[:, 0], mesh.wrap[1])) if wraps]
        seams = np.concatenate([seams, *(np.stack((line[:-1], line[1:]), axis=1) for line in along)])
    valence = np.full(len(points), 4) if on_cells else mesh.stencils().valence
    marks = {
        "boundary": border[~meets],
        "seam": seams,
        "valence < 4": np.flatnonzero(interior & (valence < 4) & (valence > 0)).astype(np.int32),
        "valence > 4": np.flatnonzero(interior & (valence > 4)).astype(np.int32),
    }
    return {name: vertices for name, vertices in marks.items() if len(vertices)}


def viewpoint(points: Floats) -> tuple[Floats, Floats]:
    """Unit vectors towards the viewer and up: at an angle to the least extent; up is y where that can be."""
    extent = np.ptp(points, axis=0)
    depth = int(np.argmin(np.minimum(extent, 0.8 * extent.max())))  # above that all count as equal
    up = 2 if depth == 1 else 1
    towards = np.zeros(3)
    towards[[depth, up, 3 - depth - up]] = 1.0, 0.45, 0.55
    return towards / np.linalg.norm(towards), np.eye(3)[up]
