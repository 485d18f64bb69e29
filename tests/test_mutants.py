"""What is broken on purpose makes a verdict fall, and nothing wrong is called reproduced."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from types import ModuleType

import numpy as np
import pytest

from comparisons import beyond, chapter2, chapter3, common, overall, reproduction
from comparisons.chapter2 import measure as curves
from comparisons.chapter3 import measure as surfaces
from comparisons.chapter4 import measure as formulas
from comparisons.claims import judge, markdown
from comparisons.measured import Measured
from quadcurv import MeshWarning, StaggeredGrid
from quadcurv.kernels import border
from quadcurv.schemes import SCHEMES, Laplacian
from quadcurv.surfaces import Surface, catenoid

Mutant = Callable[[pytest.MonkeyPatch], None]


def finite_volumes(factor: float = 1.0, area: str = "finite_volume") -> Mutant:
    """The scheme with its fluxes multiplied, or with the dual areas of another."""

    def mutate(monkeypatch: pytest.MonkeyPatch) -> None:
        scheme, other = SCHEMES["finite_volume"], SCHEMES[area]
        assert isinstance(scheme, Laplacian)
        assert isinstance(other, Laplacian)

        def assemble(stencils):
            return factor * scheme.assemble(stencils)[0], other.assemble(stencils)[1]

        def flux(stencils):
            return factor * scheme.flux(stencils)[0], other.flux(stencils)[1]

        mutant = replace(scheme, assemble=assemble, flux=flux, fast=None)
        monkeypatch.setitem(SCHEMES, "finite_volume", mutant)

    return mutate


def valences(monkeypatch: pytest.MonkeyPatch) -> None:
    """Valence 4 where 8 is asked for, and 8 where 4 is."""
    for area in ("", "-voronoi"):
        four, eight = SCHEMES[f"cotan-4{area}"], SCHEMES[f"cotan-8{area}"]
        monkeypatch.setitem(SCHEMES, f"cotan-4{area}", replace(eight, name=f"cotan-4{area}"))
        monkeypatch.setitem(SCHEMES, f"cotan-8{area}", replace(four, name=f"cotan-8{area}"))


def torsion_sign(monkeypatch: pytest.MonkeyPatch) -> None:
    right = curves.torsion
    monkeypatch.setattr(curves, "torsion", lambda *given, **named: -right(*given, **named))


def ghost_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extrapolation of surfaces 0.2 off, the sum of its weights kept, wherever they are read."""

    def off(weights):
        weights = np.array(weights)
        weights[..., 0] += 0.2
        weights[..., 1] -= 0.2
        return weights

    found = 0
    for module in [m for name, m in sys.modules.items() if name.startswith("quadcurv.boundary")]:
        for name in ("_weights", "index_weights"):
            if hasattr(module, name):
                right = getattr(module, name)
                monkeypatch.setattr(
                    module, name, lambda *given, right=right, **named: off(right(*given, **named))
                )
                found += 1
    assert found
    continue_sides = border.continue_sides

    def continued(points, wrap, limits):
        beyond, beside, excess = continue_sides(points, wrap, limits)
        if not wrap[0]:
            beyond += 0.2 * (points[[0, -1]] - points[[1, -2]])
        if not wrap[1]:
            beside[:, 1:-1] += 0.2 * np.swapaxes(points[:, [0, -1]] - points[:, [1, -2]], 0, 1)
        return beyond, beside, excess

    monkeypatch.setattr(border, "continue_sides", continued)


def no_dual_points_of_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("curvature", "curvature_normal"):
        right = getattr(curves, name)
        monkeypatch.setattr(
            curves, name, lambda points, closed=False, dual=None, right=right: right(points, closed)
        )


def no_dual_points_of_surfaces(monkeypatch: pytest.MonkeyPatch) -> None:
    """Corners of cells as the means of the centres around them."""
    right = StaggeredGrid.from_mapping.__func__

    def averaged(cls, *given, **named):
        mesh = right(cls, *given, **named)
        p = mesh.primal
        return cls(p, (p[1:, 1:] + p[1:, :-1] + p[:-1, 1:] + p[:-1, :-1]) / 4, mesh.wrap)

    monkeypatch.setattr(StaggeredGrid, "from_mapping", classmethod(averaged))


def printed_catenoid(monkeypatch: pytest.MonkeyPatch) -> None:
    """(3.79) as it is printed: Z = eta."""
    right = catenoid()

    def mapping(xi, eta):
        points = right.mapping(xi, eta)
        points[..., 2] = eta
        return points

    wrong: Surface = replace(right, mapping=mapping, wrap=(False, False))
    for module in (surfaces, formulas, beyond.measure):
        monkeypatch.setattr(module, "catenoid", lambda: wrong)
    monkeypatch.setitem(surfaces.CONVERGENCE, "figure_3_4", (wrong, "Catenoid"))
    for module, name in ((formulas, "DOUBLED"), (beyond.measure, "BORDERED")):
        those = getattr(module, name)
        monkeypatch.setattr(module, name, tuple(wrong if s.name == "catenoid" else s for s in those))


# Of each mutant: the script and steps that show it, and a claim of its own that must fall.
MUTANTS: dict[str, tuple[Mutant, ModuleType, tuple[str, ...], str]] = {
    "FV x 2": (
        finite_volumes(2.0),
        chapter3,
        ("exact cases",),
        "Exact on the cylinder, whatever f(theta) shifts its rulings",
    ),
    "FV x 1.0001": (
        finite_volumes(1.0001),
        chapter3,
        ("exact cases",),
        "Exact on the cylinder, whatever f(theta) shifts its rulings",
    ),
    "FV with Liu's area": (
        finite_volumes(area="liu"),
        chapter3,
        ("convergence",),
        "On the pillow sphere second order in the one-norm, first order in the inf-norm",
    ),
    "valences 4 and 8 exchanged": (
        valences,
        overall,
        ("against cotan",),
        "Triangulations of a quadrilateral mesh produce different results with the cotan formula",
    ),
    "torsion's sign": (
        torsion_sign,
        chapter2,
        ("helix",),
        "Second order for curvature and torsion on the helix",
    ),
    "ghost weights off by 0.2": (
        ghost_weights,
        beyond,
        ("boundaries",),
        "What does an open boundary need?",
    ),
    "dual points of curves ignored": (
        no_dual_points_of_curves,
        chapter2,
        ("line and circle", "uneven spacing"),
        "The circle is exact for any spacing",
    ),
    "dual points of surfaces ignored": (
        no_dual_points_of_surfaces,
        chapter3,
        ("exact cases",),
        "Exact on the cylinder, whatever f(theta) shifts its rulings",
    ),
    "catenoid with Z = eta": (
        printed_catenoid,
        chapter3,
        ("convergence", "printed equations"),
        "Second order on the catenoid",
    ),
}


def judged(scripts, steps=None):
    """Judgements by claim of what scripts measure."""
    numbers = []
    for script in scripts:
        found = Measured()
        for title, step in script.STEPS.items():
            if steps is None or title in steps:
                step(found)
        numbers.append(found.numbers)
    together = reproduction.numbers_of_all(numbers)
    claims = [c for section in reproduction.sections().values() for c in section]
    return {j.claim.claim: j for j in judge(claims, together)}


@pytest.mark.parametrize("name", MUTANTS)
def test_a_claim_of_its_own_falls(monkeypatch, name):
    mutate, script, steps, claim = MUTANTS[name]
    assert not judged([script], steps)[claim].wrong
    mutate(monkeypatch)
    fallen = judged([script], steps)[claim]
    assert fallen.wrong
    assert fallen.verdict != fallen.claim.verdict


def all_scripts() -> list[ModuleType]:
    return [*(import_module(f"comparisons.{name}") for name in reproduction.SCRIPTS), overall]


@pytest.fixture(scope="module")
def right():
    return judged(all_scripts())


@pytest.mark.slow
def test_all_verdicts_are_as_declared(right):
    assert [j.wrong for j in right.values() if j.wrong] == []


@pytest.mark.slow
@pytest.mark.parametrize("name", MUTANTS)
def test_nothing_wrong_keeps_its_verdict(monkeypatch, right, name):
    mutate, _, _, claim = MUTANTS[name]
    mutate(monkeypatch)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", MeshWarning)  # what is spoilt may be warned of, too
        wrong = judged(all_scripts())
    assert wrong[claim].wrong
    for text, judgement in wrong.items():
        if not judgement.wrong:
            fresh, known = markdown([judgement]), markdown([right[text]])
            assert reproduction.drift(fresh, known) == []


def test_scripts_share_their_progress(capsys):
    script = type(common)("script")
    script.STEPS = {"one": lambda into: into.numbers.update(a=1.0)}
    assert common.measure(script, "name: ").numbers == {"a": 1.0}
    assert capsys.readouterr().err.startswith("name: [1/1] one: ")
