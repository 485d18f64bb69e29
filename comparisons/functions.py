"""The Laplace-Beltrami operator of functions: spherical harmonics on four grids of the unit sphere.

Chapter 4 compares the operators on positions. Liu, Xu and Zhang (2008) and Calhoun and Helzel (2009) apply
them to functions. Spherical harmonics of degree l are the eigenfunctions of the sphere, with eigenvalue
-l (l + 1); those of degree 1 are the coordinates, hence what mean curvature is made of.
"""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from comparisons.beyond.measure import icosahedral_sphere
from comparisons.claims import Claim, Number, near, rate
from comparisons.common import command
from comparisons.figures import LABELS, STYLES, figure, plot_errors
from comparisons.measured import Measured, rate_in
from quadcurv import ConsistencyWarning, laplace_beltrami
from quadcurv.mesh import Mesh
from quadcurv.schemes import SCHEMES, Laplacian
from quadcurv.surfaces import cubed_sphere, pillow_sphere, sphere

Array = NDArray[np.float64]

TITLE = "Functions: spherical harmonics"
SIZES = np.array([12, 24, 48, 96])
DEGREES = (1, 2, 3)
SHOWN = 3
"""Degree that the figure shows."""

SPHERES: dict[str, Callable[[int], Mesh]] = {
    "longitude-latitude": lambda n: sphere().sample((2 * n, n), "staggered")[0],
    "pillow": lambda n: pillow_sphere().sample((2 * n, n), "staggered")[0],
    "cubed": lambda n: cubed_sphere().sample((n // 2, n // 2), "faces")[0],
    "icosahedral": lambda n: icosahedral_sphere(n // 4),
}
# Two orthogonal unit vectors along no axis of any grid.
_AXES = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 2)))[0]


def harmonic(degree: int, points: Array) -> Array:
    """Spherical harmonic Re (x.u + i x.v)^l of unit vectors u, v at right angles: a harmonic polynomial."""
    return np.asarray(((points @ _AXES @ (1, 1j)) ** degree).real)


def operators() -> list[str]:
    """Names of all Laplacians."""
    return [name for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)]


def errors(mesh: Mesh, scheme: str) -> dict[int, Array]:
    """Absolute errors of the Laplace-Beltrami of the harmonics by degree, where a scheme has an answer."""
    points = mesh.stencils().points
    given = np.stack([harmonic(degree, points) for degree in DEGREES], axis=-1)
    n = int(np.prod(mesh.stencils().shape))
    values = given if len(points) > n else given.reshape(*mesh.stencils().shape, -1)
    with warnings.catch_warnings(action="ignore", category=ConsistencyWarning):  # errors show it
        found = laplace_beltrami(mesh, values, scheme).reshape(n, -1)
    eigenvalues = np.array([-degree * (degree + 1) for degree in DEGREES])
    e = np.abs(found - eigenvalues * given[:n])
    return {degree: e[np.isfinite(e[:, k]), k] for k, degree in enumerate(DEGREES)}


def convergence(into: Measured) -> None:
    """Errors in both norms on refinements of the four spheres."""
    for name, build in SPHERES.items():
        columns: dict[str, Any] = {"n": SIZES}
        for n in SIZES:
            mesh = build(int(n))
            for scheme in operators():
                for degree, e in errors(mesh, scheme).items():
                    key = f"{scheme}, l = {degree}"
                    columns.setdefault(f"{key}, one-norm", []).append(float(e.mean()))
                    columns.setdefault(f"{key}, inf-norm", []).append(float(e.max()))
        kept = into.add(f"functions_{name.replace('-', '_')}", columns)
        for key in columns:
            if key != "n":
                into.numbers[f"{name}: {key}"] = kept.at(96, key)
                into.numbers[f"{name}: {key}, rate"] = rate_in(kept, key, 24)


def failures(into: Measured) -> None:
    """Valence 4 and 8 with barycentric areas on all spheres, degree 2."""
    keys = [f"{on}: {s}, l = 2, one-norm" for on in SPHERES for s in ("cotan-4", "cotan-8")]
    rates = [into.numbers[f"{key}, rate"] for key in keys]
    into.numbers["valence 4 and 8, smallest rate"] = min(rates)
    into.numbers["valence 4 and 8, largest rate"] = max(rates)
    into.numbers["valence 4 and 8, smallest error"] = min(into.numbers[key] for key in keys)


STEPS = {"four spheres": convergence, "valence 4 and 8": failures}
TABLES = {
    f"functions_{name.replace('-', '_')}": f"{name}: errors of the Laplace-Beltrami" for name in SPHERES
}


def tabulated(name: str) -> bool:
    """Whether a column is printed: those of the degree that the figure shows."""
    return f"l = {SHOWN}" in name


def order(on: str, scheme: str, degree: int, norm: str, expected: float, by: float = 0.06) -> Number:
    """Rate of a scheme on harmonics of a degree."""
    return rate(f"{on}: {scheme}, l = {degree}, {norm}, rate", expected, by)


def error(on: str, scheme: str, degree: int, norm: str, value: float) -> Number:
    """Error of a scheme at 96 cells."""
    return near(f"{on}: {scheme}, l = {degree}, {norm}", value)


ONE, INF, FV = "one-norm", "inf-norm", "finite_volume"
WHERE = "functions.png"
CLAIMS = [
    Claim(
        WHERE,
        "Do operators that agree on positions agree on functions?",
        "On the longitude-latitude sphere (primal and dual points) yes: for harmonics of degree 3 the "
        "finite volumes, Liu and cotan 6 have the rates {}, {} and {} (one-norm) and {}, {} and {} "
        "(inf-norm), errors {}, {} and {} at 96 cells. For the coordinates Liu's rate is {} as well: its "
        "fourth order in H is that of their normal component alone.",
        (
            *(order("longitude-latitude", s, 3, ONE, 2) for s in (FV, "liu", "cotan-6")),
            *(order("longitude-latitude", s, 3, INF, 2) for s in (FV, "liu", "cotan-6")),
            error("longitude-latitude", FV, 3, ONE, 1.45e-3),
            error("longitude-latitude", "liu", 3, ONE, 1.78e-3),
            error("longitude-latitude", "cotan-6", 3, ONE, 1.04e-3),
            order("longitude-latitude", "liu", 1, ONE, 2),
        ),
        "holds",
    ),
    Claim(
        WHERE,
        "Does the first order along the seams of the pillow grid hold for functions?",
        "No. For the coordinates the inf-norm has the rates {} (finite volumes) and {} (Liu); for degree "
        "2 {} and {}, errors {} and {} at 96 cells, and the one-norm {} and {}: across a seam the fluxes "
        "of a function are inconsistent, those of the positions add up to the normal.",
        (
            order("pillow", FV, 1, INF, 0.96),
            order("pillow", "liu", 1, INF, 0.95),
            order("pillow", FV, 2, INF, -0.08, 0.1),
            order("pillow", "liu", 2, INF, -0.06, 0.1),
            error("pillow", FV, 2, INF, 0.41),
            error("pillow", "liu", 2, INF, 0.41),
            order("pillow", FV, 2, ONE, 1.11, 0.1),
            order("pillow", "liu", 2, ONE, 1.11, 0.1),
        ),
        "holds",
    ),
    Claim(
        WHERE,
        "And where 3 or 5 quads meet?",
        "Finite volumes and Liu are first order there for every degree: inf-norm rates of degree 3 {} and {} "
        "on the cubed sphere, {} and {} on the icosahedral one, one-norm {}, {}, {} and {}. Cotan 6 does not "
        "converge, {} and {}, nor does the polygon Laplacian of de Goes, {} and {}.",
        (
            order("cubed", FV, 3, INF, 0.9),
            order("cubed", "liu", 3, INF, 0.94),
            order("icosahedral", FV, 3, INF, 0.99),
            order("icosahedral", "liu", 3, INF, 0.98),
            order("cubed", FV, 3, ONE, 1.92),
            order("cubed", "liu", 3, ONE, 1.95),
            order("icosahedral", FV, 3, ONE, 1.94),
            order("icosahedral", "liu", 3, ONE, 1.92),
            order("cubed", "cotan-6", 3, INF, -0.04),
            order("icosahedral", "cotan-6", 3, INF, -0.01),
            order("cubed", "de_goes", 3, INF, -0.05),
            order("icosahedral", "de_goes", 3, INF, -0.08),
        ),
        "holds",
    ),
    Claim(
        WHERE,
        "Do valence 4 and 8 fail for functions too?",
        "Yes, on all four spheres: one-norm rates of degree 2 with barycentric areas between {} and {}, "
        "smallest error {} at 96 cells.",
        (
            rate("valence 4 and 8, smallest rate", -0.01, 0.02),
            rate("valence 4 and 8, largest rate", 0.03, 0.02),
            near("valence 4 and 8, smallest error", 0.73, 5),
        ),
        "holds",
    ),
]


def figure_of_spheres(found: Measured) -> Figure:
    """Both norms on the four spheres."""
    fig, panels = figure(2, 4, size=(7.4, 6.6), sharex=True, sharey="row")
    names = operators()
    for column, sphere_ in enumerate(SPHERES):
        columns = found.series[f"functions_{sphere_.replace('-', '_')}"]
        for row, norm in enumerate(("one-norm", "inf-norm")):
            axes = panels[row, column]
            labels = {f"{s}, l = {SHOWN}, {norm}": LABELS[s] for s in names}
            styles = {
                key: STYLES[s] | {"linestyle": "-", "linewidth": 0.8}
                for key, s in zip(labels, names, strict=True)
            }
            plot_errors(axes, columns, labels, styles=styles)
            axes.get_legend().remove()
            if row == 0:
                axes.set_title(sphere_)
    for axes in panels[-1]:
        axes.set_xlabel("cells $n$")
    for axes, norm in zip(panels[:, 0], ("one-norm", "inf-norm"), strict=True):
        axes.set_ylabel(rf"error of $\Delta Y_{SHOWN}$, {norm}")
    handles, texts = panels[0, 0].get_legend_handles_labels()
    fig.legend(handles, texts, loc="outside lower center", ncols=4, frameon=False)
    return fig


FIGURES = {"functions": figure_of_spheres}


if __name__ == "__main__":
    command(sys.modules[__name__])
