"""Operators side by side: errors, differences, norms and their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from rich.console import Console
from rich.table import Table
from rich.text import Text

from quadcurv import drivers
from quadcurv.boundary import checked_boundary, one_rings
from quadcurv.drivers import direct, fits
from quadcurv.extras import need
from quadcurv.io import as_mesh
from quadcurv.mesh import Mesh
from quadcurv.operators import dual_areas
from quadcurv.precision import warn_of_rounding
from quadcurv.schemes import SCHEMES, Fit, Scheme, as_scheme
from quadcurv.stencils import Stencils
from quadcurv.tables import as_html, as_latex, by_column, finite, progress, short, text_tables, write_csv
from quadcurv.types import Bools, Floats, Ints

NORMS = ("one", "two", "inf", "one-area", "two-area")


def norms(errors: ArrayLike, areas: ArrayLike) -> dict[str, float]:
    """One-, two- and inf-norm of errors, plain and weighted by area; non-finite errors are left out.

    Parameters
    ----------
    errors, areas : array_like of one shape
        An area that is not finite has no weight.

    Returns
    -------
    dict
        "vertices": number of finite errors, "one": mean |e|, "two": root mean e^2, "inf": max |e|,
        "one-area": sum A |e| / sum A, "two-area": (sum A e^2 / sum A)^(1/2). NaN where no error is finite,
        and by area where those of the finite ones add up to nothing.

    Examples
    --------
    >>> from quadcurv.comparison import norms
    >>> found = norms([1.0, -3.0], [1.0, 1.0])
    >>> found["one"], found["inf"], found["vertices"]
    (2.0, 3.0, 2)
    """
    e, A = np.abs(np.ravel(errors)), np.ravel(areas)
    known = np.isfinite(e)
    e, A = e[known], np.where(np.isfinite(A[known]), A[known], 0.0)
    if e.size == 0:
        return {"vertices": 0, **dict.fromkeys(NORMS, np.nan)}
    # In units of the largest, so that neither squares nor areas leave the range of doubles.
    largest, most = e.max() or 1.0, A.max()
    unit, A = e / largest, A / (most or 1.0)
    total = A.sum() if most > 0 else np.nan
    return {
        "vertices": e.size,
        "one": float(unit.mean() * largest),
        "two": float(np.sqrt(np.mean(unit**2)) * largest),
        "inf": float(e.max()),
        "one-area": float(A @ unit / total * largest),
        "two-area": float(np.sqrt(A @ unit**2 / total) * largest),
    }


@dataclass(frozen=True, eq=False, repr=False)
class Comparison:
    """Mean curvature of one mesh by several schemes, as made by :func:`compare`.

    Attributes
    ----------
    mesh : QuadMesh, QuadGrid or StaggeredGrid
    mean_curvature : dict of str to float64 array of shape (n,) or (r, c)
        By scheme, in 1 / length; NaN where a scheme has no answer.
    exact : float64 array of that shape, or None
    areas : float64 array of that shape
        Liu's dual areas, the weights of the area-weighted norms.
    valence : (n,) or (r, c) int32
        Faces at each vertex.
    families : dict of str to str
        What each scheme stems from: schemes of one family have one vote in the :attr:`consensus`. A scheme
        that is not named is its own.
    notes : dict of str to str
        By scheme, why it has no answer anywhere.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> qc.compare(ball, ["liu", "jet"], exact=1.0)
    Comparison(QuadMesh(98 points, 96 quads), 2 schemes against exact)
    """

    mesh: Mesh
    mean_curvature: Mapping[str, Floats]
    exact: Floats | None
    areas: Floats
    valence: Ints
    families: Mapping[str, str] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)

    def __repr__(self) -> str:
        schemes = f"{len(self.schemes)} schemes" if len(self.schemes) > 1 else self.schemes[0]
        return f"Comparison({self.mesh!r}, {schemes} against {self.reference})"

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
        """H minus the :attr:`reference` by scheme; NaN where either is."""
        reference = self.consensus if self.exact is None else self.exact
        return {name: H - reference for name, H in self.mean_curvature.items()}

    @cached_property
    def consensus(self) -> Floats:
        """Median at each vertex of the schemes that have an answer there; of two schemes the first.

        Every family of schemes has one vote, shared by those of it that have an answer. NaN where none has.
        """
        if len(self.schemes) < 3:
            return self.mean_curvature[self.schemes[0]]
        H = np.array([values.ravel() for values in self.mean_curvature.values()])
        return _median(H, self._votes(np.isfinite(H))).reshape(self.valence.shape)

    def _votes(self, known: Bools) -> Floats:
        """(schemes, n) parts of a vote, 0 where a scheme has no answer."""
        family = [self.families.get(name, name) for name in self.schemes]
        votes = known.astype(float)
        for name in set(family):
            members = [i for i, other in enumerate(family) if other == name]
            votes[members] /= np.maximum(votes[members].sum(axis=0), 1)
        return votes

    @cached_property
    def spread(self) -> Floats:
        """Largest minus smallest H of the schemes that have one; NaN where fewer than two have."""
        H = np.array(list(self.mean_curvature.values()))
        known = np.isfinite(H)
        gap = np.max(H, axis=0, where=known, initial=-np.inf) - np.min(H, axis=0, where=known, initial=np.inf)
        return np.where(known.sum(axis=0) > 1, gap, np.nan)

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
        """Norms of the difference in H between every two schemes, where both have one."""
        H = self.mean_curvature
        return {(a, b): norms(H[a] - H[b], self.areas) for a, b in combinations(H, 2)}

    def to_dict(self) -> dict[str, Any]:
        """Numbers of the tables, ready for JSON (non-finite ones as None)."""
        summary = {
            "vertices": int(self.valence.size),
            "valence": {str(v): int(np.sum(self.valence == v)) for v in np.unique(self.valence)},
            "reference": self.reference,
            "undefined": {k: int(np.count_nonzero(np.isnan(H))) for k, H in self.mean_curvature.items()},
            "notes": dict(self.notes),
            "errors": self.norms(),
            "errors_by_valence": {str(v): e for v, e in self.by_valence().items()},
            "differences": {f"{a} - {b}": d for (a, b), d in self.differences().items()},
        }
        return finite(summary)

    def to_csv(self, path: str | Path) -> None:
        """Write one row a scheme and valence ("all" included): norms of the errors over how many vertices."""
        write_csv(path, by_column(self._rows()))

    def to_dataframe(self) -> Any:
        """Return a pandas.DataFrame of what :meth:`to_csv` writes.

        Raises
        ------
        ImportError
            pandas, of the extra "notebook", is not installed.
        """
        need("pandas")
        import pandas as pd

        return pd.DataFrame(self._rows())

    def _rows(self) -> list[dict[str, Any]]:
        groups = {"all": self.norms(), **{str(v): e for v, e in self.by_valence().items()}}
        return [
            {"scheme": name, "valence": group, **values}
            for group, by_scheme in groups.items()
            for name, values in by_scheme.items()
        ]

    def tables(self) -> list[Table]:
        """Rich tables, 80 columns at most: curvature and norms by scheme, by valence, by pair."""
        tables = [*text_tables(*self._main_rows()), *self._valence_tables()]
        return tables if self.exact is not None else tables + self._pair_tables()

    def to_latex(self) -> str:
        r"""Return the first of :meth:`tables` for LaTeX, with the package booktabs.

        Examples
        --------
        >>> import quadcurv as qc
        >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
        >>> print(qc.compare(ball, ["liu"], exact=1.0).to_latex().splitlines()[0])
        \begin{table}
        """
        return as_latex(*self._main_rows())

    def _main_rows(self) -> tuple[str, list[str], list[list[str]]]:
        title = f"Mean curvature H (1/length) and |H - {self.reference}| where both are known"
        header = ["scheme", "min H", "max H", "vertices", "mean", "by area", "rms", "max"]
        rows = []
        for name, e in self.norms().items():
            H = self.mean_curvature[name]
            known = H[np.isfinite(H)]
            low, high = (known.min(), known.max()) if known.size else (np.nan, np.nan)
            ends = f"{low:.4g}", f"{high:.4g}", str(e["vertices"])
            rows.append([name, *ends, *(short(e[k]) for k in ("one", "one-area", "two", "inf"))])
        return title, header, rows

    def _valence_tables(self) -> list[Table]:
        groups = self.by_valence()
        sizes = {v: int(np.sum(self.valence == v)) for v in groups}
        header = ["scheme", *(f"{v} ({size})" for v, size in sizes.items())]

        def cell(v: int, name: str) -> str:
            e = groups[v][name]
            return short(e["one"]) + (f" ({e['vertices']})" if 0 < e["vertices"] < sizes[v] else "")

        rows = [[name, *(cell(v, name) for v in groups)] for name in self.schemes]
        return text_tables(f"Mean |H - {self.reference}| by valence (of vertices)", header, rows)

    def _pair_tables(self) -> list[Table]:
        number = {name: str(i + 1) for i, name in enumerate(self.schemes)}
        mean = {pair: short(d["one"]) for pair, d in self.differences().items()}
        rows = [
            [f"{number[a]} {a}", *(mean.get((a, b), mean.get((b, a), "-")) for b in self.schemes)]
            for a in self.schemes
        ]
        return text_tables("Mean difference |H - H'| between schemes", ["", *number.values()], rows)

    def __rich_console__(self, console: Console, options: Any) -> Iterator[Table | Text]:
        yield from self.tables()
        for name, reason in self.notes.items():
            yield Text(f"{name}: {reason}")

    def _repr_html_(self) -> str:
        return as_html(self)


def _median(values: Floats, weights: Floats) -> Floats:
    """Weighted median along the first axis, the mean of two where they share the middle; NaN weighs 0."""
    order = np.argsort(values, axis=0)  # NaN last
    values, weights = (np.take_along_axis(x, order, axis=0) for x in (values, weights))
    below = np.cumsum(weights, axis=0)
    half, slack = below[-1] / 2, 1e-9  # for what thirds of votes leave
    ends = [np.argmax(below >= half - slack, axis=0), np.argmax(below > half + slack, axis=0)]
    low, high = (np.take_along_axis(values, end[None], axis=0)[0] for end in ends)
    return np.where(half > 0, (low + high) / 2, np.nan)


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
        of the points. Without it schemes are compared with their median, two with the first.
    boundary : {"extrapolate", "nan"}
        See :func:`quadcurv.one_rings`.

    Returns
    -------
    Comparison
        A scheme that cannot be evaluated is NaN everywhere; ``notes`` says why.

    Raises
    ------
    MeshError
        A ValueError: the mesh is not one.
    ValueError
        Unknown scheme or boundary; no or repeated schemes; exact does not fit.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((12, 12), "faces")
    >>> found = qc.compare(ball, ["finite_volume", "jet"], exact=1.0)
    >>> errors = found.norms()
    >>> errors["jet"]["inf"] < errors["finite_volume"]["inf"] / 20
    True
    """
    mesh = as_mesh(mesh)
    chosen = schemes_of(SCHEMES if schemes is None else schemes)
    evaluation = Evaluation(mesh, boundary)
    given = evaluation.given
    if callable(exact):
        exact = exact(mesh.in_shape(given.points[: given.n]))
    valence = mesh.in_shape(given.valence)
    if exact is not None:
        exact = _fitting(exact, valence.shape)
    H, notes = {}, {}
    for scheme in progress(chosen, "schemes", weight=given.n * len(chosen)):
        try:
            H[scheme.name] = evaluation.mean_curvature(scheme)
        except Exception as error:  # of one scheme, which says nothing of the others
            H[scheme.name] = np.full(valence.shape, np.nan)
            notes[scheme.name] = f"{type(error).__name__}: {error}"
    families = {scheme.name: scheme.reference or scheme.name for scheme in chosen}
    found = Comparison(mesh, H, exact, dual_areas(mesh, "liu"), valence, families, notes)
    warn_of_rounding(mesh, found.consensus)
    return found


class Evaluation:
    """A mesh and what schemes share on it, made once: its stencils and neighbourhoods.

    A grid with holes is computed as a face list.
    """

    def __init__(self, mesh: Mesh, boundary: str) -> None:
        self.mesh = mesh
        self.boundary = checked_boundary(boundary)
        self._whole: Mesh = mesh.to_mesh() if drivers.has_holes(mesh) else mesh
        self.given = self._whole.stencils()

    @cached_property
    def closed(self) -> Stencils:
        """Stencils with their boundary closed."""
        return one_rings(self._whole, self.boundary)

    @cached_property
    def neighbourhoods(self) -> fits.MeshNeighbourhoods:
        """What fits see."""
        return fits.MeshNeighbourhoods(self._whole, self.boundary)

    def mean_curvature(self, scheme: Scheme) -> Floats:
        """H in the shape of results."""
        if isinstance(scheme, Fit):
            H = fits.fit_around(self.neighbourhoods, scheme).mean
        elif scheme.fast is not None:
            H = drivers.run(self._whole, scheme, ["mean_curvature"], self.boundary)["mean_curvature"]
        else:
            H = np.empty(self.given.shape)
            direct.evaluate(self.given, self.closed, scheme, {"mean_curvature": H})
        return self.mesh.in_shape(H.ravel())


def _fitting(exact: ArrayLike, shape: tuple[int, ...]) -> Floats:
    try:
        return np.broadcast_to(np.asarray(exact, np.float64), shape)
    except (TypeError, ValueError):
        raise ValueError(
            f"exact: expected numbers that fit the result's {shape}, got shape {np.shape(exact)}"
        ) from None


def schemes_of(schemes: str | Scheme | Iterable[str | Scheme]) -> Sequence[Scheme]:
    """Schemes by name or themselves, one or several, each once."""
    if isinstance(schemes, str | Scheme):
        return [as_scheme(schemes)]
    try:
        chosen = [as_scheme(scheme) for scheme in schemes]
    except TypeError:
        raise TypeError(f"schemes: expected names or schemes, got {schemes!r}") from None
    names = [scheme.name for scheme in chosen]
    if not names or len(set(names)) < len(names):
        raise ValueError(f"schemes: expected at least one, each once, got {names}")
    return chosen
