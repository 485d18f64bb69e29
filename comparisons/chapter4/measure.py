"""What chapter 4 measures: every operator on the thesis's surfaces, in both norms and both layouts."""

from __future__ import annotations

import warnings
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from comparisons import printed
from comparisons.measured import Columns, Measured, doublings, one_and_inf, rate_in
from quadcurv import ConsistencyWarning, StaggeredGrid, mean_curvature_normal, vertex_normals
from quadcurv.schemes import SCHEMES, Laplacian, cotan
from quadcurv.surfaces import (
    Surface,
    catenoid,
    cylinder,
    ellipsoid,
    elliptic_paraboloid,
    helicoid,
    pillow_sphere,
    sphere,
    torus,
)

Array = NDArray[np.float64]

COMPARED = (
    "finite_volume",
    "liu",
    "bilinear",
    "cotan-4",
    "cotan-6",
    "cotan-6'",
    "cotan-8",
    "cotan-4-voronoi",
    "cotan-6-voronoi",
    "cotan-8-voronoi",
)
# Valence 6 keeps two of the four primal neighbours: those along the first direction, or the others.
OTHER = cotan(6, diagonal=1)
FIRST = 16
"""Cells of the coarsest grid that rates are fitted to."""


def schemes() -> dict[str, Laplacian]:
    """The operators compared, by name."""
    return {name: OTHER if name == OTHER.name else SCHEMES[name] for name in COMPARED}  # type: ignore[misc]


def wave(theta: Array) -> Array:
    """The f of the thesis's second cylinder (Figure 3.2)."""
    return np.asarray(np.sin(2 * theta))


class Case(NamedTuple):
    """A surface in a layout, and the operators on it.

    `around` is how many times as many cells it has in xi as in eta.
    """

    surface: Surface
    layout: str
    operators: tuple[str, ...] = COMPARED
    around: int = 1


FEW = tuple(s for s in COMPARED if s not in ("cotan-6'", "cotan-4-voronoi", "cotan-8-voronoi"))
CASES = {
    "cylinder": Case(cylinder(), "staggered"),
    "wavy cylinder": Case(cylinder(f=wave), "staggered"),
    "cylinder vertices": Case(cylinder(), "grid"),
    "pillow": Case(pillow_sphere(), "staggered", COMPARED, 2),
    "pillow vertices": Case(pillow_sphere(), "faces", FEW, 2),
    "sphere": Case(sphere(), "staggered", FEW),
}


def runs(into: Measured) -> None:
    """Errors of kappa = |H n|, as the thesis takes it, and of the signed H, on doublings to 256 cells."""
    sizes = doublings(8, 256)
    for name, case in CASES.items():
        found: dict[str, dict[str, list[Array]]] = {s: {"kappa": [], "H": []} for s in case.operators}
        for n in sizes:
            mesh, xi, eta = case.surface.sample((case.around * n, n), case.layout)
            exact, normal = case.surface.mean_curvature(xi, eta), vertex_normals(mesh)
            for scheme in case.operators:
                with warnings.catch_warnings(action="ignore", category=ConsistencyWarning):  # shown here
                    Hn = mean_curvature_normal(mesh, schemes()[scheme])
                kappa, H = np.linalg.norm(Hn, axis=-1), -np.einsum("...x,...x", Hn, normal)
                found[scheme]["kappa"].append(np.abs(kappa - np.abs(exact)))
                found[scheme]["H"].append(np.abs(H - exact))
        if case.layout == "faces":
            into.numbers[f"{name}: left out"] = float(np.isnan(found["finite_volume"]["H"][-1]).sum())
        stem = f"chapter4_{name.replace(' ', '_')}"
        columns = {
            f"{scheme}, {norm}" + ("" if quantity == "kappa" else ", signed"): e
            for scheme, quantities in found.items()
            for quantity, errors in quantities.items()
            for norm, e in one_and_inf(errors).items()
        }
        keep(into, name, into.add(stem, {"n": sizes, **columns}))


def keep(into: Measured, case: str, columns: Columns) -> None:
    """Numbers of a case: errors on the finest grid and rates, fitted and of the last doubling."""
    n = np.asarray(columns["n"])
    for name in columns:
        if name != "n":
            into.numbers[f"{case}: {name}"] = float(columns[name][-1])
            into.numbers[f"{case}: {name}, rate"] = rate_in(columns, name, FIRST)
            into.numbers[f"{case}: {name}, last rate"] = rate_in(columns, name, float(n[-2]))


def relations(into: Measured) -> None:
    """How the numbers of two schemes stand to each other."""
    r = into.numbers
    cotan6 = into.series["chapter4_cylinder"]
    ratio = np.array(cotan6["cotan-6, one-norm"]) / cotan6["cotan-6, inf-norm"]
    r["cylinder: one over inf of cotan-6"] = float(ratio.min())
    for case in ("pillow", "pillow vertices", "sphere"):
        for norm in ("one-norm", "inf-norm"):
            r[f"{case}: liu less finite_volume, {norm}, rate"] = (
                r[f"{case}: liu, {norm}, rate"] - r[f"{case}: finite_volume, {norm}, rate"]
            )
        r[f"{case}: bilinear over liu"] = r[f"{case}: bilinear, one-norm"] / r[f"{case}: liu, one-norm"]
        r[f"{case}: liu over finite_volume"] = (
            r[f"{case}: liu, one-norm"] / r[f"{case}: finite_volume, one-norm"]
        )


def operators(into: Measured) -> None:
    """Liu's formula as printed, its fluxes beside the scheme's, and (4.1)."""
    grid, *_ = torus().sample((24, 24))
    noisy = type(grid)(grid.points + np.random.default_rng(0).normal(0, 0.02, grid.points.shape), grid.wrap)
    r = into.numbers
    r["Liu as printed"] = float(
        np.abs(printed.printed_liu(noisy.points) - mean_curvature_normal(noisy, "liu")).max()
    )
    fluxes = [printed.printed_fluxes(noisy.points), 2 * printed.printed_liu(noisy.points, divided=False)]
    r["flux difference"] = float(np.abs(fluxes[0] - fluxes[1]).max() / np.abs(fluxes[1]).max())
    stencils = cylinder().sample((32, 32))[0].stencils()
    stiffness, mixed = cotan(6, "voronoi").assemble(stencils)
    third = cotan(6).assemble(stencils)[1]
    inside = stencils.closed
    # The stiffness has (cot + cot) / 2 as weights; H of the cylinder is 1/2.
    sums = 2 * np.linalg.norm((stiffness @ stencils.points)[inside], axis=1)
    r["4.1 over H"] = float((3 / (2 * mixed[inside]) * sums).mean() / 0.5)
    r["4.1 without the 3 over H"] = float((1 / (2 * mixed[inside]) * sums).mean() / 0.5)
    r["4.3 over H"] = float((3 / (4 * 3 * third[inside]) * sums).mean() / 0.5)


def obtuse(into: Measured) -> None:
    """Triangles of the pillow grid cut for valence 6, and its two areas."""
    stencils = pillow_sphere().sample((64, 32), "staggered")[0].stencils()
    quads = stencils.points[stencils.faces]
    corners = np.concatenate((quads[:, [0, 1, 3]], quads[:, [2, 3, 1]]))
    before, after = (np.roll(corners, k, axis=1) - corners for k in (1, -1))
    blunt = (np.einsum("tix,tix->ti", before, after) < -1e-12).any(axis=1)
    into.numbers["obtuse triangles, in %"] = 100 * float(blunt.mean())
    third, mixed = (cotan(6, area).assemble(stencils)[1] for area in ("barycentric", "voronoi"))
    into.numbers["mixed area over a third, valence 6, smallest"] = float((mixed / third).min())
    into.numbers["mixed area over a third, valence 6, largest"] = float((mixed / third).max())
    stencils = cylinder().sample((64, 64))[0].stencils()
    for valence in (4, 8):
        third, mixed = (cotan(valence, area).assemble(stencils)[1] for area in ("barycentric", "voronoi"))
        ratio = float((mixed / third)[stencils.closed].mean())
        into.numbers[f"mixed area over a third, valence {valence}"] = ratio


DOUBLED = (torus(), sphere(), ellipsoid(), helicoid(), elliptic_paraboloid(), catenoid())


def doubled_spacing(into: Measured) -> None:
    """Every other point of a grid as primal, those between as dual, over the stencil of Figure 4.1."""
    n = 128
    for surface in DOUBLED:
        grid, xi, eta = surface.sample((n, n))
        exact = np.abs(surface.mean_curvature(xi, eta))[1::2, 1::2]
        points, dual = grid.points[1::2, 1::2], grid.points[::2, ::2]
        r, c = (size - 1 for size in dual.shape[:2])
        coarse = mean_curvature_normal(StaggeredGrid(points[:r, :c], dual), "finite_volume", boundary="nan")
        near = mean_curvature_normal(grid, "finite_volume")[1::2, 1::2][:r, :c]
        errors = [np.abs(np.linalg.norm(Hn, axis=-1) - exact[:r, :c]) for Hn in (coarse, near)]
        known = np.isfinite(errors[0])
        into.numbers[f"doubled spacing, {surface.name}"] = float(
            errors[0][known].mean() / errors[1][known].mean()
        )


def quadrature(into: Measured) -> None:
    """The bilinear element with 2 x 2 points over that with one, which is Liu's, on vertices."""
    for surface in (torus(), replace(ellipsoid(), name="ellipsoid"), catenoid()):
        mesh, xi, eta = surface.sample((128, 128))
        exact = np.abs(surface.mean_curvature(xi, eta))
        errors = [
            np.abs(np.linalg.norm(mean_curvature_normal(mesh, s), axis=-1) - exact).mean()
            for s in ("bilinear", "liu")
        ]
        into.numbers[f"bilinear over liu, {surface.name}"] = float(errors[0] / errors[1])


STEPS = {
    "all operators, all cases": runs,
    "relations": relations,
    "operators as printed": operators,
    "obtuse triangles": obtuse,
    "doubled spacing": doubled_spacing,
    "quadrature": quadrature,
}
