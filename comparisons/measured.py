"""Numbers that claims are judged by, and the columns that figures and tables show."""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv import ConsistencyWarning, mean_curvature_normal, vertex_normals
from quadcurv.mesh import Mesh
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import Laplacian
from quadcurv.surfaces import Surface


class Columns(dict[str, Any]):
    """Columns of one length by name; of a refinement the first is "n"."""

    def at(self, n: int, name: str) -> float:
        """Value of a column at a size."""
        return float(np.asarray(self[name])[np.asarray(self["n"]).tolist().index(n)])


class Measured:
    """Numbers that claims are judged by, and the columns that figures show.

    Attributes
    ----------
    numbers : dict of str to float
    series : dict of str to Columns
        By the stem of the figure.
    """

    def __init__(self) -> None:
        self.numbers: dict[str, float] = {}
        self.series: dict[str, Columns] = {}

    def add(self, stem: str, columns: Mapping[str, ArrayLike]) -> Columns:
        """Keep the columns of a figure, and return them."""
        self.series[stem] = Columns(columns)
        return self.series[stem]


def doublings(first: int, last: int) -> NDArray[np.int64]:
    """first, 2 first, 4 first, ... up to last."""
    return first * 2 ** np.arange(int(np.log2(last / first)) + 1)


def rate_in(columns: Columns, name: str, first: float, last: float = np.inf) -> float:
    """Rate fitted to a column between two sizes; NaN where an error is zero or not finite."""
    n = np.asarray(columns["n"], float)
    inside = (n >= first) & (n <= last)
    return fitted_rate(n[inside], np.asarray(columns[name])[inside])


def one_and_inf(errors: Sequence[NDArray[Any]]) -> dict[str, list[float]]:
    """One- and inf-norm of errors on each grid; places without an answer are left out."""
    return {
        "one-norm": [float(np.nanmean(e)) for e in errors],
        "inf-norm": [float(np.nanmax(e)) for e in errors],
    }


@dataclass(frozen=True)
class Errors:
    """Absolute errors at the vertices of a mesh, or in its cells.

    Attributes
    ----------
    mesh : QuadGrid, StaggeredGrid or QuadMesh
    norm : ndarray
        Of kappa = |H n|, which the thesis takes (3.23).
    signed : ndarray
        Of H = -(H n) . n, as the package gives it.
    xi, eta : ndarray
        Parameters.
    """

    mesh: Mesh
    norm: NDArray[np.float64]
    signed: NDArray[np.float64]
    xi: NDArray[np.float64]
    eta: NDArray[np.float64]


def curvature_errors(
    surface: Surface, cells: tuple[int, int], scheme: str | Laplacian, layout: str = "staggered"
) -> Errors:
    """Errors of a scheme on a surface of so many cells."""
    mesh, xi, eta = surface.sample(cells, layout)
    exact = surface.mean_curvature(xi, eta)
    with warnings.catch_warnings(action="ignore", category=ConsistencyWarning):  # errors show it
        Hn = mean_curvature_normal(mesh, scheme)
    kappa = np.linalg.norm(Hn, axis=-1)
    H = -np.einsum("...x,...x", Hn, vertex_normals(mesh))
    return Errors(mesh, np.abs(kappa - np.abs(exact)), np.abs(H - exact), xi, eta)
