"""Errors on refinements of a surface, their rates and tables."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray
from rich.console import Console
from rich.table import Table

from quadcurv.comparison import NORMS, Evaluation, norms, schemes_of
from quadcurv.curvature import gaussian_curvature, principal_curvatures
from quadcurv.extras import need
from quadcurv.operators import dual_areas
from quadcurv.schemes import Scheme
from quadcurv.surfaces import SURFACES, Surface
from quadcurv.tables import as_html, as_latex, by_column, finite, progress, short, text_table, write_csv
from quadcurv.types import Floats, Ints

Quantity = Literal["mean_curvature", "gaussian_curvature", "k1", "k2"]

_SYMBOLS = {"mean_curvature": "H", "gaussian_curvature": "K", "k1": "k1", "k2": "k2"}
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


@dataclass(frozen=True, eq=False, repr=False)
class Convergence:
    """Errors of several schemes on refinements of a surface, as made by :func:`convergence`.

    Attributes
    ----------
    surface, layout : str
    quantity : {"mean_curvature", "gaussian_curvature", "k1", "k2"}
        What the errors are of, in 1 / length, or of "gaussian_curvature" in 1 / length^2.
    shapes : tuple of (int, int)
        Cells in the two directions.
    errors : dict of str to dict of str to float64 array
        ``errors[scheme][norm]``, one number a shape; norms as in :func:`norms`.
    undefined : dict of str to int array
        Number of vertices without a result, one number a shape; they are left out of the norms.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.convergence("torus", "liu", [8, 16])
    Convergence(H on torus, staggered, 8x8, 16x16, by liu)
    """

    surface: str
    layout: str
    quantity: Quantity
    shapes: tuple[tuple[int, int], ...]
    errors: Mapping[str, Mapping[str, Floats]]
    undefined: Mapping[str, Ints]

    def __repr__(self) -> str:
        sizes = ", ".join(f"{r}x{c}" for r, c in self.shapes)
        schemes = ", ".join(self.schemes)
        return f"Convergence({self.symbol} on {self.surface}, {self.layout}, {sizes}, by {schemes})"

    @property
    def schemes(self) -> tuple[str, ...]:
        """Names of the schemes."""
        return tuple(self.errors)

    @property
    def symbol(self) -> str:
        """Of the quantity: H, K, k1 or k2."""
        return _SYMBOLS[self.quantity]

    @property
    def sizes(self) -> Floats:
        """Refinement: geometric mean of the numbers of cells in the two directions."""
        return _sizes(self.shapes)

    def norm(self, scheme: str, norm: str = "one") -> Floats:
        """Errors of a scheme in a norm, one number a shape.

        Raises
        ------
        ValueError
            Not one of :attr:`schemes`, or not one of :data:`quadcurv.comparison.NORMS`.
        """
        for name, given, known in (("scheme", scheme, self.schemes), ("norm", norm, NORMS)):
            if given not in known:
                raise ValueError(f"{name}: expected one of {', '.join(known)}, got {given!r}")
        return self.errors[scheme][norm]

    def rates(self, scheme: str, norm: str = "one") -> Floats:
        """Rate between successive refinements, positive where errors fall; NaN beside a zero error.

        Raises
        ------
        ValueError
            As :meth:`norm`.
        """
        return successive_rates(self.sizes, self.norm(scheme, norm))

    def fitted_rate(self, scheme: str, norm: str = "one", last: int | None = None) -> float:
        """Rate by least squares over all, or the `last`, refinements (the thesis's best-fit line).

        Raises
        ------
        ValueError
            As :meth:`norm`; `last` is not between 2 and the number of refinements.
        """
        errors, n = self.norm(scheme, norm), len(self.shapes)
        last = n if last is None else last
        if last not in range(2, n + 1):
            raise ValueError(f"last: expected a whole number from 2 to {n}, got {last!r}")
        return fitted_rate(self.sizes[n - last :], errors[n - last :])

    def rate_label(self, scheme: str, norm: str = "one") -> str:
        """Fitted rate to two digits, "exact" where all errors are rounding."""
        exact = self.norm(scheme, norm).max() < _ROUNDING
        return "exact" if exact else f"{self.fitted_rate(scheme, norm):.2f}"

    def rows(self) -> list[dict[str, Any]]:
        """One flat record a scheme, shape and norm, with the rate from the shape before."""
        return [
            {
                "surface": self.surface,
                "layout": self.layout,
                "quantity": self.quantity,
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
                "quantity": self.quantity,
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
        write_csv(path, by_column(self.rows()))

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame of :meth:`rows`.

        Raises
        ------
        ImportError
            pandas, of the extra "notebook", is not installed.
        """
        need("pandas")
        import pandas as pd

        return pd.DataFrame(self.rows())

    def table(self, norm: str = "one") -> Table:
        """Rich table of one norm: errors, below them successive rates, at the end the fitted one.

        Where all errors are rounding the last column says "exact": their rate, about -2, is that of
        eps / h^2. Vertices without a result are left out; the title says where there are any.
        """
        title, header, rows = self._rows_of(norm)
        return text_table(title, header, rows, dim=range(1, len(rows), 2))

    def to_latex(self, norm: str = "one") -> str:
        r"""Return :meth:`table` for LaTeX, with the package booktabs.

        Examples
        --------
        >>> import quadcurv as qc
        >>> print(qc.convergence("torus", "liu", [8, 16]).to_latex("inf").splitlines()[-2])
        \end{table}
        """
        return as_latex(*self._rows_of(norm))

    def _rows_of(self, norm: str) -> tuple[str, list[str], list[list[str]]]:
        rows: list[list[str]] = []
        for scheme in self.schemes:
            rates = ("" if np.isnan(r) else f"{r:.2f}" for r in self.rates(scheme, norm))
            rows.append([scheme, *map(short, self.norm(scheme, norm)), self.rate_label(scheme, norm)])
            rows.append(["", "", *rates, ""])
        title = f"{self.surface}, {self.layout}: {norm}-norm of the error in {self.symbol}, and rates"
        lost = [scheme for scheme in self.schemes if self.undefined[scheme].any()]
        if lost:
            title += f"\n(vertices left out: {', '.join(f'{s} {self.undefined[s].tolist()}' for s in lost)})"
        header = ["scheme", *(f"{r}x{c}" for r, c in self.shapes), "fit"]
        return title, header, rows

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table]:
        yield self.table("one")
        yield self.table("one-area")
        yield self.table("inf")

    def _repr_html_(self) -> str:
        return as_html(self)


def convergence(
    surface: str | Surface,
    schemes: str | Scheme | Iterable[str | Scheme],
    shapes: Iterable[int | tuple[int, int]],
    layout: str = "staggered",
    quantity: Quantity = "mean_curvature",
) -> Convergence:
    """Errors in a curvature of a surface on a sequence of refinements.

    Parameters
    ----------
    surface : str or Surface
        One of :mod:`quadcurv.surfaces`, by its name in ``SURFACES`` or itself.
    schemes : str, Scheme or iterable of them
    shapes : iterable of int or (int, int)
        Cells in the two directions; one number stands for both. At least two, of different sizes.
    layout : {"staggered", "grid", "faces"}
        See :meth:`quadcurv.surfaces.Surface.sample`.
    quantity : {"mean_curvature", "gaussian_curvature", "k1", "k2"}
        All but the first by fits alone, "gaussian_curvature" also by "angle_defect".

    Returns
    -------
    Convergence

    Raises
    ------
    ValueError
        Unknown surface, scheme, layout or quantity; shapes that are no numbers of cells, fewer than two of
        them, or two of one size; a scheme that does not know the quantity.

    Examples
    --------
    >>> import quadcurv as qc
    >>> run = qc.convergence("torus", "liu", [16, 32, 64])
    >>> run.rates("liu", "inf").round(1)
    array([1.9, 2. ])
    """
    surface = surface_of(surface)
    pairs = _pairs(shapes)
    if quantity not in get_args(Quantity):
        raise ValueError(f"quantity: expected one of {', '.join(get_args(Quantity))}, got {quantity!r}")
    by_name = _by_name(schemes, quantity)
    found: dict[str, list[dict[str, float]]] = {name: [] for name in by_name}
    undefined: dict[str, list[int]] = {name: [] for name in by_name}
    work = max(r * c for r, c in pairs) * len(by_name)
    for shape in progress(pairs, f"{surface.name}, {layout}", weight=work):
        mesh, xi, eta = surface.sample(shape, layout)
        exact, areas = _exact(surface, quantity, xi, eta), dual_areas(mesh, "liu")
        evaluation = Evaluation(mesh, "extrapolate")
        for name, scheme in by_name.items():
            errors = _values(evaluation, scheme, quantity) - exact
            found[name].append(norms(errors, areas))
            undefined[name].append(int(np.count_nonzero(~np.isfinite(errors))))
    return Convergence(
        surface.name,
        layout,
        quantity,
        pairs,
        {s: {k: np.array([e[k] for e in es]) for k in NORMS} for s, es in found.items()},
        {s: np.array(counts, np.int32) for s, counts in undefined.items()},
    )


def _by_name(schemes: Any, quantity: Quantity) -> dict[str, Any]:
    """Schemes by name; of the Gaussian curvature "angle_defect" is one too."""
    given = [schemes] if isinstance(schemes, str | Scheme) else list(schemes)
    defect = [s for s in given if quantity == "gaussian_curvature" and s == "angle_defect"]
    others = [s for s in given if s not in defect]
    return {name: name for name in defect} | {s.name: s for s in (schemes_of(others) if others else ())}


def surface_of(surface: str | Surface) -> Surface:
    """The surface of that name with its usual parameters, or the surface itself.

    Raises
    ------
    ValueError
        The name is not in ``SURFACES``.
    """
    if isinstance(surface, Surface):
        return surface
    if not isinstance(surface, str) or surface not in SURFACES:
        raise ValueError(f"surface: expected a Surface or one of {', '.join(SURFACES)}, got {surface!r}")
    return SURFACES[surface]()


def _values(evaluation: Evaluation, scheme: Any, quantity: Quantity) -> Floats:
    if quantity == "mean_curvature":
        return evaluation.mean_curvature(scheme)
    if quantity == "gaussian_curvature":
        return gaussian_curvature(evaluation.mesh, scheme)
    k1, k2, *_ = principal_curvatures(evaluation.mesh, scheme)
    return k1 if quantity == "k1" else k2


def _exact(surface: Surface, quantity: Quantity, xi: Floats, eta: Floats) -> Floats:
    """Of k1 and k2, H +- sqrt(H^2 - K)."""
    if quantity == "gaussian_curvature":
        return surface.gaussian_curvature(xi, eta)
    H = surface.mean_curvature(xi, eta)
    if quantity == "mean_curvature":
        return H
    gap = np.sqrt(np.maximum(H**2 - surface.gaussian_curvature(xi, eta), 0))
    return H + gap if quantity == "k1" else H - gap


def _pairs(shapes: Iterable[int | tuple[int, int]]) -> tuple[tuple[int, int], ...]:
    pairs = []
    try:
        for shape in shapes:
            r, c = shape if isinstance(shape, Sequence) and len(shape) == 2 else (shape, shape)
            pairs.append((operator.index(r), operator.index(c)))
            if min(pairs[-1]) < 1:
                raise ValueError
    except (TypeError, ValueError):
        raise ValueError(
            f"shapes: expected whole numbers of cells, at least 1, or pairs of them, got {shapes!r}"
        ) from None
    sizes = _sizes(pairs)
    if len(pairs) < 2 or len(np.unique(sizes)) < len(sizes):
        raise ValueError(f"shapes: a rate needs at least two of different sizes, got {pairs}")
    return tuple(pairs)


def _sizes(shapes: Sequence[tuple[int, int]]) -> Floats:
    return np.sqrt(np.prod(np.reshape(shapes, (-1, 2)), axis=1, dtype=float))
