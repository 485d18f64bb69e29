"""Operators side by side: errors, differences, norms, rates and their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table

from quadcurv.curvature import dual_areas, mean_curvature
from quadcurv.io import as_mesh
from quadcurv.mesh import Mesh
from quadcurv.schemes import SCHEMES, Scheme, as_scheme
from quadcurv.tables import finite, progress, short, text_table, write_csv
from quadcurv.types import Floats, Ints

if TYPE_CHECKING:
    import pyvista as pv

NORMS = ("one", "two", "inf", "one-area", "two-area")


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
        return finite(summary)

    def to_csv(self, path: str | Path) -> None:
        """Write one row a scheme and valence ("all" included): count and norms of the errors."""
        groups = {"all": self.norms(), **{str(v): e for v, e in self.by_valence().items()}}
        rows = [
            {"scheme": name, "valence": group, "vertices": self._count(group), **values}
            for group, by_scheme in groups.items()
            for name, values in by_scheme.items()
        ]
        write_csv(path, rows)

    def _count(self, group: str) -> int:
        return self.valence.size if group == "all" else int(np.sum(self.valence == int(group)))

    def tables(self) -> list[Table]:
        """Rich tables, 80 columns at most: curvature and norms by scheme, by valence, by pair."""
        against = self.reference
        main = text_table(
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
                *(short(e[k]) for k in ("one", "one-area", "two", "inf")),
            )
        groups = self.by_valence()
        valence = text_table(
            f"Mean |H - {against}| by valence",
            ["scheme", *(f"{v} ({self._count(str(v))})" for v in groups)],
        )
        for name in self.schemes:
            valence.add_row(name, *(short(e[name]["one"]) for e in groups.values()))
        if self.exact is not None:
            return [main, valence]
        number = {name: str(i + 1) for i, name in enumerate(self.schemes)}
        mean = {pair: short(d["one"]) for pair, d in self.differences().items()}
        tables = [main, valence]
        for start in range(0, len(number), 8):  # more columns do not fit
            columns = self.schemes[start : start + 8]
            pairs = text_table(
                "Mean difference |H - H'| between schemes", ["", *(number[b] for b in columns)]
            )
            for a in self.schemes:
                pairs.add_row(f"{number[a]} {a}", *(mean.get((a, b), mean.get((b, a), "-")) for b in columns))
            tables.append(pairs)
        return tables

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table]:
        yield from self.tables()

    def plot(self, field: str = "error") -> pv.Plotter:
        """Maps of a field, one view a scheme: see :func:`quadcurv.viewing.window.maps`."""
        from quadcurv.viewing.window import maps

        return maps(self, field)

    def view(self, field: str = "mean_curvature") -> None:
        """Open a window with linked views, one a scheme, see :class:`quadcurv.viewing.window.View`."""
        from quadcurv.viewing.window import view

        view(self, field)


def compare(
    mesh: Any,
    schemes: str | Scheme | Iterable[str | Scheme] | None = None,
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
        See :func:`quadcurv.one_rings`.

    Returns
    -------
    Comparison

    Raises
    ------
    ValueError
        As :func:`quadcurv.mean_curvature`; no or repeated schemes; exact does not fit.
    """
    mesh = as_mesh(mesh)
    chosen = schemes_of(SCHEMES if schemes is None else schemes)
    names = [s.name for s in chosen]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"schemes: expected at least one, each once, got {names}")
    stencils = mesh.stencils()
    H = {
        s.name: mean_curvature(mesh, s, boundary)
        for s in progress(chosen, "schemes", weight=stencils.n * len(chosen))
    }
    areas = dual_areas(mesh, "liu")
    if callable(exact):
        exact = exact(mesh.in_shape(stencils.points[: stencils.n]))
    if exact is not None:
        try:
            exact = np.broadcast_to(np.asarray(exact, np.float64), areas.shape)
        except ValueError:
            raise ValueError(
                f"exact: shape {np.shape(exact)} does not fit the result's {areas.shape}"
            ) from None
    return Comparison(mesh, H, exact, areas, mesh.in_shape(stencils.valence))


def schemes_of(schemes: str | Scheme | Iterable[str | Scheme]) -> list[Scheme]:
    """Schemes by name, one or several."""
    return [as_scheme(s) for s in ([schemes] if isinstance(schemes, str | Scheme) else schemes)]
