"""Operators side by side: errors, differences, norms, rates and their tables."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.progress import track
from rich.table import Table

from quadcurv.curvature import dual_areas, mean_curvature
from quadcurv.interop import as_mesh
from quadcurv.mesh import Floats, Ints, Mesh
from quadcurv.rates import fitted_rate, successive_rates
from quadcurv.schemes import SCHEMES, Fit, Scheme, as_scheme
from quadcurv.surfaces import Surface

if TYPE_CHECKING:
    import pyvista as pv
    from matplotlib.figure import Figure

_ROUNDING = 1e-9
NORMS = ("one", "two", "inf", "one-area", "two-area")
T = TypeVar("T")


def norms(errors: ArrayLike, areas: ArrayLike) -> dict[str, float]:
    """One-, two- and inf-norm of errors, plain and weighted by area; non-finite errors are left out.

    Parameters
    ----------
    errors, areas : array_like of one shape

    Returns
    -------
    dict
        "one": mean |e|, "two": root mean e^2, "inf": max |e|, "one-area": sum A |e| / sum A, "two-area":
        (sum A e^2 / sum A)^(1/2). All NaN where no error is finite.
    """
    e, A = np.abs(np.ravel(errors)), np.ravel(areas)
    known = np.isfinite(e)
    if not known.any():
        return dict.fromkeys(NORMS, np.nan)
    e, A = e[known], A[known]
    return {
        "one": float(e.mean()),
        "two": float(np.sqrt(np.mean(e**2))),
        "inf": float(e.max()),
        "one-area": float(np.average(e, weights=A)),
        "two-area": float(np.sqrt(np.average(e**2, weights=A))),
    }


@dataclass(frozen=True, eq=False)
class Comparison:
    """Mean curvature of one mesh by several schemes, as made by :func:`compare`.

    Attributes
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid
    mean_curvature : dict of str to float64 array of shape (n,) or (r, c)
        By scheme, in 1 / length.
    exact : float64 array of that shape, or None
    areas : float64 array of that shape
        Liu's dual areas, the weights of the area-weighted norms.
    valence : (n,) or (r, c) int32
        Faces at each vertex.
    """

    mesh: Mesh
    mean_curvature: Mapping[str, Floats]
    exact: Floats | None
    areas: Floats
    valence: Ints

    @property
    def schemes(self) -> tuple[str, ...]:
        """Names of the schemes."""
        return tuple(self.mean_curvature)

    @property
    def reference(self) -> str:
        """What :attr:`errors` are taken against: "exact", "median of the schemes", or of two the first."""
        if self.exact is not None:
            return "exact"
        return "median of the schemes" if len(self.schemes) > 2 else self.schemes[0]

    @cached_property
    def errors(self) -> dict[str, Floats]:
        """H minus the :attr:`reference` by scheme."""
        reference = self.consensus if self.exact is None else self.exact
        return {name: H - reference for name, H in self.mean_curvature.items()}

    @cached_property
    def consensus(self) -> Floats:
        """Median of all schemes at each vertex, NaN where any of them is; of two schemes the first."""
        H = list(self.mean_curvature.values())
        return np.median(H, axis=0) if len(H) > 2 else H[0]

    @cached_property
    def spread(self) -> Floats:
        """Largest minus smallest H of all schemes at each vertex; NaN where any of them is."""
        return np.ptp(list(self.mean_curvature.values()), axis=0)

    def norms(self) -> dict[str, dict[str, float]]:
        """Norms of :attr:`errors` by scheme, see :func:`norms`."""
        return {name: norms(e, self.areas) for name, e in self.errors.items()}

    def by_valence(self) -> dict[int, dict[str, dict[str, float]]]:
        """Norms of :attr:`errors` by valence and scheme."""
        return {
            int(v): {
                name: norms(e[self.valence == v], self.areas[self.valence == v])
                for name, e in self.errors.items()
            }
            for v in np.unique(self.valence)
        }

    def differences(self) -> dict[tuple[str, str], dict[str, float]]:
        """Norms of the difference in H between every two schemes."""
        H = self.mean_curvature
        return {(a, b): norms(H[a] - H[b], self.areas) for a, b in combinations(H, 2)}

    def to_dict(self) -> dict[str, Any]:
        """Numbers of the tables, ready for JSON (non-finite ones as None)."""
        summary = {
            "vertices": int(self.valence.size),
            "valence": {str(v): int(np.sum(self.valence == v)) for v in np.unique(self.valence)},
            "reference": self.reference,
            "undefined": {k: int(np.count_nonzero(np.isnan(H))) for k, H in self.mean_curvature.items()},
            "errors": self.norms(),
            "errors_by_valence": {str(v): e for v, e in self.by_valence().items()},
            "differences": {f"{a} - {b}": d for (a, b), d in self.differences().items()},
        }
        return _finite(summary)

    def to_csv(self, path: str | Path) -> None:
        """Write one row a scheme and valence ("all" included): count and norms of the errors."""
        groups = {"all": self.norms(), **{str(v): e for v, e in self.by_valence().items()}}
        rows = [
            {"scheme": name, "valence": group, "vertices": self._count(group), **values}
            for group, by_scheme in groups.items()
            for name, values in by_scheme.items()
        ]
        _write_csv(path, rows)

    def _count(self, group: str) -> int:
        return self.valence.size if group == "all" else int(np.sum(self.valence == int(group)))

    def tables(self) -> list[Table]:
        """Rich tables, 80 columns at most: curvature and norms by scheme, by valence, by pair."""
        against = self.reference
        main = _table(
            f"Mean curvature H (1/length) and |H - {against}|",
            ["scheme", "min H", "max H", "undefined", "mean", "by area", "rms", "max"],
        )
        for name, H in self.mean_curvature.items():
            e = norms(self.errors[name], self.areas)
            known = H[np.isfinite(H)]
            low, high = (known.min(), known.max()) if known.size else (np.nan, np.nan)
            main.add_row(
                name,
                f"{low:.4g}",
                f"{high:.4g}",
                str(H.size - known.size),
                *(_short(e[k]) for k in ("one", "one-area", "two", "inf")),
            )
        groups = self.by_valence()
        valence = _table(
            f"Mean |H - {against}| by valence",
            ["scheme", *(f"{v} ({self._count(str(v))})" for v in groups)],
        )
        for name in self.schemes:
            valence.add_row(name, *(_short(e[name]["one"]) for e in groups.values()))
        if self.exact is not None:
            return [main, valence]
        number = {name: str(i + 1) for i, name in enumerate(self.schemes)}
        mean = {pair: _short(d["one"]) for pair, d in self.differences().items()}
        tables = [main, valence]
        for start in range(0, len(number), 8):  # more columns do not fit
            columns = self.schemes[start : start + 8]
            pairs = _table("Mean difference |H - H'| between schemes", ["", *(number[b] for b in columns)])
            for a in self.schemes:
                pairs.add_row(f"{number[a]} {a}", *(mean.get((a, b), mean.get((b, a), "-")) for b in columns))
            tables.append(pairs)
        return tables

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table]:
        yield from self.tables()

    def plot(self, field: str = "error") -> pv.Plotter:
        """Maps of a field, one view a scheme: a scene to show or save, see :func:`quadcurv.view.maps`."""
        from quadcurv.view import maps

        return maps(self, field)

    def view(self, field: str = "mean_curvature") -> None:
        """Open a window with linked views, one a scheme, see :class:`quadcurv.view.View`."""
        from quadcurv.view import view

        view(self, field)


def compare(
    mesh: Any,
    schemes: str | Scheme | Fit | Iterable[str | Scheme | Fit] | None = None,
    exact: ArrayLike | Callable[[Floats], ArrayLike] | None = None,
    boundary: str = "extrapolate",
) -> Comparison:
    """Mean curvature of a mesh by several schemes.

    Parameters
    ----------
    mesh
        Anything :func:`quadcurv.as_mesh` takes.
    schemes : str, Scheme or iterable of them, optional
        By default all of ``quadcurv.SCHEMES``.
    exact : array_like or callable, optional
        Exact mean curvature in 1 / length: a number, an array of the shape of the result, or a function
        of the points. Without it schemes are compared with their median,
        two with the first.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.stencils`.

    Returns
    -------
    Comparison

    Raises
    ------
    ValueError
        As :func:`quadcurv.mean_curvature`; no or repeated schemes; exact does not fit.
    """
    mesh = as_mesh(mesh)
    chosen = _chosen(SCHEMES if schemes is None else schemes)
    names = [s.name for s in chosen]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"schemes: expected at least one, each once, got {names}")
    stencils = mesh.stencils()
    H = {
        s.name: mean_curvature(mesh, s, boundary)
        for s in progress(chosen, "schemes", weight=stencils.n * len(chosen))
    }
    if callable(exact):
        exact = exact(stencils.points[: stencils.n].reshape(*stencils.shape, 3))
    if exact is not None:
        try:
            exact = np.broadcast_to(np.asarray(exact, np.float64), stencils.shape)
        except ValueError:
            raise ValueError(
                f"exact: shape {np.shape(exact)} does not fit the result's {stencils.shape}"
            ) from None
    return Comparison(mesh, H, exact, dual_areas(mesh, "liu"), stencils.valence.reshape(stencils.shape))


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
        return _finite(
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
        _write_csv(path, self.rows())

    def table(self, norm: str = "one") -> Table:
        """Rich table of one norm: errors, below them successive rates, at the end the fitted one.

        Where all errors are rounding the last column says "exact": their rate, about -2, is that of
        eps / h^2.
        """
        table = _table(
            f"{self.surface}, {self.layout}: {norm}-norm of the error in H, and rates",
            ["scheme", *(f"{r}x{c}" for r, c in self.shapes), "fit"],
        )
        for scheme in self.schemes:
            rates = ("" if np.isnan(r) else f"{r:.2f}" for r in self.rates(scheme, norm))
            errors = self.errors[scheme][norm]
            table.add_row(scheme, *map(_short, errors), self.rate_label(scheme, norm))
            table.add_row("", "", *rates, "", style="dim")
        return table

    def plot(self, norms: Sequence[str] = ("one", "inf")) -> Figure:
        """Errors against cells on logarithmic axes, see :func:`quadcurv.figures.convergence_figure`."""
        from quadcurv.figures import convergence_figure

        return convergence_figure(self, norms)

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table]:
        yield self.table("one")
        yield self.table("one-area")
        yield self.table("inf")


def convergence(
    surface: Surface,
    schemes: str | Scheme | Fit | Iterable[str | Scheme | Fit],
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
    chosen = _chosen(schemes)
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


def progress(items: Sequence[T], description: str, weight: int = 0) -> Iterable[T]:
    """Iterate behind a progress bar on a terminal, if the work is of a size to take seconds."""
    console = Console(stderr=True)
    if weight < 20_000 or not console.is_terminal:
        return items
    return track(items, description, console=console, transient=True)


def _chosen(schemes: str | Scheme | Fit | Iterable[str | Scheme | Fit]) -> list[Scheme | Fit]:
    """Schemes by name, one or several."""
    return [as_scheme(s) for s in ([schemes] if isinstance(schemes, str | Scheme | Fit) else schemes)]


def _table(title: str, columns: Sequence[str]) -> Table:
    table = Table(
        title=title,
        title_justify="left",
        min_width=len(title),
        box=None,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for i, column in enumerate(columns):
        table.add_column(column, justify="left" if i == 0 else "right", no_wrap=True)
    return table


def _short(value: float) -> str:
    """Two digits and the exponent without its padding: 1.2e-3."""
    mantissa, _, exponent = f"{value:.1e}".partition("e")
    return f"{mantissa}e{int(exponent)}" if exponent else mantissa


def _write_csv(path: str | Path, rows: Sequence[Mapping[str, Any]]) -> None:
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)


def _finite(value: Any) -> Any:
    """JSON has no NaN: None instead."""
    if isinstance(value, dict):
        return {k: _finite(v) for k, v in value.items()}
    if isinstance(value, list):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value
