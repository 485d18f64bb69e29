"""Errors on refinements of a surface, their rates and tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.console import Console
from rich.table import Table

from quadcurv.comparison import NORMS, compare, schemes_of
from quadcurv.schemes import Scheme
from quadcurv.surfaces import Surface
from quadcurv.tables import finite, progress, short, text_table, write_csv
from quadcurv.types import Floats, Ints

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_ROUNDING = 1e-9


def fitted_rate(sizes: ArrayLike, errors: ArrayLike) -> float:
    """Rate p of the least-squares fit error = C size^-p on logarithmic axes.

    Parameters
    ----------
    sizes : array_like, shape (m,)
        Distinct numbers of points (or cells) in one direction, m >= 2.
    errors : array_like, shape (m,)
        Errors, not negative.

    Returns
    -------
    float
        Positive for convergence; NaN where an error is zero or not finite.

    Raises
    ------
    ValueError
        For shapes that differ, fewer than two sizes, sizes that are not positive and distinct, or
        negative errors.
    """
    x, y = _logarithms(sizes, errors)
    x = x - x.mean()
    return -float(x @ y / (x @ x))


def successive_rates(sizes: ArrayLike, errors: ArrayLike) -> NDArray[np.float64]:
    """Rates between neighbouring sizes.

    Parameters
    ----------
    sizes, errors : array_like, shape (m,)
        As for `fitted_rate`.

    Returns
    -------
    ndarray, shape (m - 1,)
        Positive for convergence; NaN on both sides of an error that is zero or not finite.

    Raises
    ------
    ValueError
        As `fitted_rate`.
    """
    x, y = _logarithms(sizes, errors)
    return -np.diff(y) / np.diff(x)


def _logarithms(sizes: ArrayLike, errors: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    x, y = np.array(sizes, dtype=float), np.array(errors, dtype=float)
    if x.ndim != 1 or x.shape != y.shape or len(x) < 2:
        raise ValueError(
            "sizes and errors must be one-dimensional, of one length and at least two, "
            f"got shapes {x.shape} and {y.shape}"
        )
    if not (np.isfinite(x).all() and (x > 0).all() and len(np.unique(x)) == len(x)):
        raise ValueError(f"sizes must be positive, finite and distinct, got {x}")
    if (y < 0).any():
        raise ValueError(f"errors must not be negative, got {y.min():g}")
    y[(y == 0) | ~np.isfinite(y)] = np.nan
    return np.log(x), np.log(y)


@dataclass(frozen=True, eq=False)
class Convergence:
    """Errors of several schemes on refinements of a surface, as made by :func:`convergence`.

    Attributes
    ----------
    surface, layout : str
    shapes : tuple of (int, int)
        Cells in the two directions.
    errors : dict of str to dict of str to float64 array
        ``errors[scheme][norm]``, one number a shape; norms as in :func:`norms`.
    undefined : dict of str to int array
        Number of vertices without a result, one number a shape.
    """

    surface: str
    layout: str
    shapes: tuple[tuple[int, int], ...]
    errors: Mapping[str, Mapping[str, Floats]]
    undefined: Mapping[str, Ints]

    @property
    def schemes(self) -> tuple[str, ...]:
        """Names of the schemes."""
        return tuple(self.errors)

    @property
    def sizes(self) -> Floats:
        """Refinement: geometric mean of the numbers of cells in the two directions."""
        return np.sqrt(np.prod(self.shapes, axis=1, dtype=float))

    def rates(self, scheme: str, norm: str = "one") -> Floats:
        """Rate between successive refinements, positive where errors fall; NaN beside a zero error."""
        return successive_rates(self.sizes, self.errors[scheme][norm])

    def fitted_rate(self, scheme: str, norm: str = "one", last: int | None = None) -> float:
        """Rate by least squares over all, or the `last`, refinements (the thesis's best-fit line)."""
        start = 0 if last is None else -last
        return fitted_rate(self.sizes[start:], self.errors[scheme][norm][start:])

    def rate_label(self, scheme: str, norm: str = "one") -> str:
        """Fitted rate to two digits, "exact" where all errors are rounding."""
        exact = self.errors[scheme][norm].max() < _ROUNDING
        return "exact" if exact else f"{self.fitted_rate(scheme, norm):.2f}"

    def rows(self) -> list[dict[str, Any]]:
        """One flat record a scheme, shape and norm, with the rate from the shape before."""
        return [
            {
                "surface": self.surface,
                "layout": self.layout,
                "scheme": scheme,
                "rows": shape[0],
                "columns": shape[1],
                "norm": norm,
                "error": float(e),
                "rate": float(rate),
                "undefined": int(self.undefined[scheme][i]),
            }
            for scheme in self.schemes
            for norm in NORMS
            for i, (shape, e, rate) in enumerate(
                zip(
                    self.shapes,
                    self.errors[scheme][norm],
                    np.concatenate(([np.nan], self.rates(scheme, norm))),
                    strict=True,
                )
            )
        ]

    def to_dict(self) -> dict[str, Any]:
        """Errors and rates, ready for JSON (non-finite ones as None)."""
        return finite(
            {
                "surface": self.surface,
                "layout": self.layout,
                "shapes": [list(s) for s in self.shapes],
                "schemes": {
                    s: {
                        "errors": {k: v.tolist() for k, v in self.errors[s].items()},
                        "rates": {k: self.rates(s, k).tolist() for k in NORMS},
                        "fitted_rate": {k: self.fitted_rate(s, k) for k in NORMS},
                        "undefined": self.undefined[s].tolist(),
                    }
                    for s in self.schemes
                },
            }
        )

    def to_csv(self, path: str | Path) -> None:
        """Write :meth:`rows` to a CSV file."""
        write_csv(path, self.rows())

    def table(self, norm: str = "one") -> Table:
        """Rich table of one norm: errors, below them successive rates, at the end the fitted one.

        Where all errors are rounding the last column says "exact": their rate, about -2, is that of
        eps / h^2.
        """
        table = text_table(
            f"{self.surface}, {self.layout}: {norm}-norm of the error in H, and rates",
            ["scheme", *(f"{r}x{c}" for r, c in self.shapes), "fit"],
        )
        for scheme in self.schemes:
            rates = ("" if np.isnan(r) else f"{r:.2f}" for r in self.rates(scheme, norm))
            errors = self.errors[scheme][norm]
            table.add_row(scheme, *map(short, errors), self.rate_label(scheme, norm))
            table.add_row("", "", *rates, "", style="dim")
        return table

    def plot(self, norms: Sequence[str] = ("one", "inf")) -> Figure:
        """Errors against cells, see :func:`quadcurv.viewing.figures.convergence_figure`."""
        from quadcurv.viewing.figures import convergence_figure

        return convergence_figure(self, norms)

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table]:
        yield self.table("one")
        yield self.table("one-area")
        yield self.table("inf")


def convergence(
    surface: Surface,
    schemes: str | Scheme | Iterable[str | Scheme],
    shapes: Iterable[int | tuple[int, int]],
    layout: str = "staggered",
) -> Convergence:
    """Errors in the mean curvature of a surface on a sequence of refinements.

    Parameters
    ----------
    surface : Surface
        One of :mod:`quadcurv.surfaces`.
    schemes : str, Scheme or iterable of them
    shapes : iterable of int or (int, int)
        Cells in the two directions; one number stands for both.
    layout : {"staggered", "grid", "faces"}
        See :meth:`quadcurv.surfaces.Surface.sample`.

    Returns
    -------
    Convergence

    Raises
    ------
    ValueError
        Unknown scheme or layout, or fewer than two shapes.
    """
    pairs = [(s, s) if isinstance(s, int | np.integer) else (int(s[0]), int(s[1])) for s in shapes]
    if len(pairs) < 2:
        raise ValueError(f"shapes: a rate needs at least two, got {pairs}")
    chosen = schemes_of(schemes)
    found: dict[str, list[dict[str, float]]] = {s.name: [] for s in chosen}
    undefined: dict[str, list[int]] = {s.name: [] for s in chosen}
    work = max(r * c for r, c in pairs) * len(chosen)
    for shape in progress(pairs, f"{surface.name}, {layout}", weight=work):
        mesh, xi, eta = surface.sample(shape, layout)
        result = compare(mesh, chosen, surface.mean_curvature(xi, eta))
        for name, values in result.norms().items():
            found[name].append(values)
            undefined[name].append(int(np.count_nonzero(np.isnan(result.mean_curvature[name]))))
    return Convergence(
        surface.name,
        layout,
        tuple(pairs),
        {s: {k: np.array([e[k] for e in es]) for k in NORMS} for s, es in found.items()},
        {s: np.array(counts, np.int32) for s, counts in undefined.items()},
    )
