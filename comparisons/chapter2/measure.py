"""What chapter 2 measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons import fresnel
from comparisons.measured import Measured, doublings, rate_in
from quadcurv.curves import (
    Curve,
    circle,
    curvature,
    curvature_normal,
    ellipse,
    euler_spiral,
    helix,
    line,
    staggered,
    torsion,
)

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
LINE = line(origin=(0.3, 0.1), direction=(1.6 * np.pi, 1.2 * np.pi))  # as long as the circle
ARC = replace(ellipse(), domain=(np.pi / 6, 5 * np.pi / 6), closed=False)
EVEN, JUMPING = 0.0, 0.5  # the part of itself that a step varies by, at random


def parameters(curve: Curve, n: int, jitter: float = EVEN) -> Array:
    """Spread n parameters over the domain; jitter is the part of itself that a step varies by."""
    steps = 1 + jitter * np.random.default_rng(n).uniform(-1, 1, n - (not curve.closed))
    t = np.append(0, np.cumsum(steps)) / steps.sum()
    return curve.domain[0] + np.ptp(curve.domain) * (t[:-1] if curve.closed else t)


def primal_dual(curve: Curve, t: Array) -> tuple[Array, Array]:
    """Primal points at t and dual points halfway between in the parameter."""
    return staggered(curve.mapping, t, float(np.ptp(curve.domain)) if curve.closed else None)


def errors(curve: Curve, t: Array, quantity: str = "primal/dual") -> Array:
    """Absolute error at points t of the curvature ("primal/dual" or "polyline") or "torsion"."""
    points, dual = primal_dual(curve, t)
    if quantity == "torsion":
        return np.abs(torsion(points, curve.closed) - curve.torsion(t))
    between_them = dual if quantity == "primal/dual" else None
    return np.abs(curvature(points, curve.closed, between_them) - curve.curvature(t))


def inside(found: Sequence[Array]) -> list[float]:
    """Largest errors at the points whose stencil holds no ghost point."""
    return [float(e[2:-2].max()) for e in found]


def ends(found: Sequence[Array]) -> list[float]:
    """Largest errors at the first and last point."""
    return [float(max(e[0], e[-1])) for e in found]


def printed_torsion(points: Array, slip: bool = False) -> Array:
    """Unsigned torsion of the inner edges, literally (2.54) to (2.56).

    With the slip the difference of normals is divided by |t^(1)| = 1 / |t_(1)|, as printed.
    """
    tangent = np.diff(points, axis=0)[1:-1]
    spacing = np.linalg.norm(tangent, axis=1, keepdims=True)
    H = curvature_normal(points)[1:-1]
    kappa = np.linalg.norm(H, axis=1, keepdims=True)
    slope = np.diff(H / kappa, axis=0) / (1 / spacing if slip else spacing)
    binormal = slope + (kappa[1:] + kappa[:-1]) / 2 * tangent / spacing
    return np.asarray(np.linalg.norm(binormal, axis=1))


def printed_torsion_errors(curve: Curve, t: Array) -> Array:
    """Errors of the corrected (2.54) to (2.56), the mean of a point's two edges, at the points inside."""
    tau = printed_torsion(curve.mapping(t))
    return np.abs((tau[1:] + tau[:-1]) / 2 - np.abs(curve.torsion(t[2:-2])))


def ellipse_convergence(into: Measured) -> None:
    """Figures 2.2 and 2.3."""
    sizes = doublings(16, 1024)
    series = {
        label: [float(errors(ellipse(), parameters(ellipse(), n), quantity).max()) for n in sizes]
        for quantity, label in (("primal/dual", "primal/dual points"), ("polyline", "polyline"))
    }
    columns = into.add("figure_2_3", {"n": sizes, **series})
    for label in series:
        into.numbers[f"ellipse {label}, rate"] = rate_in(columns, label, 64)
        into.numbers[f"ellipse {label}, error at 256"] = columns.at(256, label)
    t = parameters(ellipse(), 64)
    points, dual = primal_dual(ellipse(), t)
    H = curvature_normal(points, True, dual)
    into.add("figure_2_2", {"t": t, **vectors("x y Hx Hy", np.hstack([points, H]))})


def spiral_convergence(into: Measured) -> None:
    """Figures 2.4 and 2.5: under-resolved at first, then of fourth order, then rounding."""
    curve, sizes = euler_spiral(), doublings(256, 2**17)
    found: dict[str, list[float]] = {name: [] for name in ("computed", "rounded", "exact", "ends")}
    for n in sizes:
        t = parameters(curve, n)
        e = errors(curve, t)
        found["computed"].append(float(e[2:-2].max()))
        found["ends"].append(float(max(e[0], e[-1])))
        rounded, exact = fresnel.curvatures(t)
        found["rounded"].append(float(np.abs(rounded - curve.curvature(t))[2:-2].max()))
        found["exact"].append(float(np.abs(exact - curve.curvature(t[1:-1]))[1:-1].max()))
    unit = EPS * (sizes / 60) ** 2
    columns = into.add("figure_2_5", {"n": sizes, **found, "eps/h^2": unit})
    into.numbers["spiral rate"] = rate_in(columns, "computed", 1024, 8192)
    into.numbers["spiral error at 512"] = columns.at(512, "computed")
    into.numbers["spiral error at 8192"] = columns.at(8192, "computed")
    for name in ("computed", "rounded", "exact"):
        into.numbers[f"spiral, {name}, at 32768 over eps/h^2"] = columns.at(32768, name) / columns.at(
            32768, "eps/h^2"
        )
    smooth = []
    for n in (4096, 8192, 16384):
        u = np.linspace(-1, 1, n)
        smooth.append(errors(curve, 30 * (u + 0.1 * np.sin(np.pi * u)))[2:-2].max())
    into.numbers["spiral rate on steps that vary slowly"] = float(np.log2(smooth[0] / smooth[2]) / 2)
    t = parameters(curve, 12000)
    into.add("figure_2_4", {"t": t, **vectors("x y", curve.mapping(t))})


def helix_convergence(into: Measured) -> None:
    """Figures 2.6 and 2.7, away from the ends."""
    sizes = doublings(16, 1024)
    t = [parameters(helix(), n) for n in sizes]
    columns = into.add(
        "figure_2_7",
        {
            "n": sizes,
            "curvature": inside([errors(helix(), x) for x in t]),
            "torsion": inside([errors(helix(), x, "torsion") for x in t]),
            "printed torsion": [float(printed_torsion_errors(helix(), x).max()) for x in t],
        },
    )
    for name in ("curvature", "torsion", "printed torsion"):
        into.numbers[f"helix {name}, rate"] = rate_in(columns, name, 64)
        into.numbers[f"helix {name}, error at 256"] = columns.at(256, name)
    few = parameters(helix(), 65)
    points = helix().mapping(few)
    table = np.hstack([points, curvature_normal(points)])
    into.add("figure_2_6", {"t": few, **vectors("x y z Hx Hy Hz", table)})


def exactness(into: Measured) -> None:
    """Line and circle: rounding is all there is, and it grows like eps/h^2."""
    sizes = doublings(8, 2**14)
    straight = [errors(LINE, parameters(LINE, n), "polyline") for n in sizes]
    h = 2 * np.pi / sizes
    columns = into.add(
        "figure_2_exact",
        {
            "n": sizes,
            "circle": [float(errors(circle(), parameters(circle(), n)).max()) for n in sizes],
            "line": inside(straight),
            "ends of the line": ends(straight),
            "eps/h^2": EPS / h**2,
        },
    )
    few = sizes <= 256
    turns = [np.asarray(columns[name]) * h for name in ("line", "ends of the line")]
    into.numbers["circle error to 256"] = float(np.asarray(columns["circle"])[few].max())
    into.numbers["line turn to 256"] = float(np.array(turns)[:, few].max())


def open_ends(into: Measured) -> None:
    """Ends of open curves beside their inside, on an arc of the ellipse and on the helix."""
    sizes = doublings(32, 1024)
    table: dict[str, Any] = {"n": sizes}
    for name, curve, quantity in (("arc curvature", ARC, "polyline"), ("helix torsion", helix(), "torsion")):
        found = [errors(curve, parameters(curve, n), quantity) for n in sizes]
        table |= {f"{name}, inside": inside(found), f"{name}, ends": ends(found)}
    columns = into.add("figure_2_open_ends", table)
    for name in ("arc curvature", "helix torsion"):
        into.numbers[f"{name}, rate at the ends"] = rate_in(columns, f"{name}, ends", 256)
        into.numbers[f"{name}, ends over inside at 256"] = columns.at(256, f"{name}, ends") / columns.at(
            256, f"{name}, inside"
        )


def uneven(into: Measured) -> None:
    """Circle and helix on steps that vary by up to half of themselves."""
    sizes = doublings(16, 1024)
    names = ("dual halfway", "primal halfway", "polyline", "printed torsion", "torsion")
    found: dict[str, list[float]] = {name: [] for name in names}
    for n in sizes:
        t = parameters(circle(), n, JUMPING)
        found["dual halfway"].append(errors(circle(), t).max())
        found["polyline"].append(errors(circle(), t, "polyline").max())
        primal, dual = primal_dual(circle(), t)
        # The other way round: the primal points lie halfway between the dual ones.
        found["primal halfway"].append(np.abs(curvature(dual, True, np.roll(primal, -1, axis=0)) - 1).max())
        t = parameters(helix(), n, JUMPING)
        found["printed torsion"].append(printed_torsion_errors(helix(), t).max())
        found["torsion"].append(errors(helix(), t, "torsion")[2:-2].max())
    columns = into.add("figure_2_uneven", {"n": sizes, **found})
    for name in names:
        into.numbers[f"uneven, {name}, error at 256"] = columns.at(256, name)
    for name in ("polyline", "torsion"):
        into.numbers[f"uneven, {name}, rate"] = rate_in(columns, name, 64)


def slips(into: Measured) -> None:
    """Numbers behind the printed equations that do not hold."""
    points = helix().mapping(parameters(helix(), 256))
    tangent = np.diff(points, axis=0)
    normal = curvature_normal(points)[1:-1]
    cosine = np.einsum("ij,ij->i", tangent[1:], normal) / (
        np.linalg.norm(tangent[1:], axis=1) * np.linalg.norm(normal, axis=1)
    )
    into.numbers["2.31 largest cosine of printed and exact normal"] = float(np.abs(cosine).max())
    # (2.39) on a circle of radius 2 with a step of 0.3: its second line has no root.
    radius, theta, h = 2.0, 0.5, 0.3
    chord = np.linalg.norm(np.diff(circle(radius).mapping(np.array([theta, theta + h])), axis=0))
    middle = [2 * radius * f(theta + h / 2) * np.sin(h / 2) for f in (np.sin, np.cos)]
    into.numbers["2.39 second line over the chord squared"] = float(np.dot(middle, middle) / chord**2)
    into.numbers["2.39 last line over the chord"] = float(2 * radius * np.sin(h / 2) / chord)
    H = curvature_normal(circle().mapping(parameters(circle(), 256)), True)
    into.numbers["2.45 x component of H at t = 0"] = float(H[128, 0])
    # (2.48) at the middle cell of edges whose widths are 1, 2, 1 and of edges 1, 2, 3.
    for name, widths in (("jump", (1, 2, 1)), ("grow linearly", (1, 2, 3))):
        edges = np.append(0, np.cumsum(widths))
        centres = (edges[1:] + edges[:-1]) / 2
        into.numbers[f"2.48 left over right where widths {name}"] = float(
            (centres[2] - centres[0]) / 2 / (edges[2] - edges[1])
        )
    into.numbers["2.54 printed torsion of the helix"] = float(printed_torsion(points, slip=True).mean())
    into.numbers["2.54 corrected torsion of the helix"] = float(printed_torsion(points).mean())
    into.numbers["torsion of the left-handed helix"] = float(
        torsion(helix(1.0, -0.5).mapping(parameters(helix(), 256))).mean()
    )


def vectors(names: str, table: Array) -> dict[str, Array]:
    """Columns of a table by name."""
    return dict(zip(names.split(), table.T, strict=True))


STEPS = {
    "line and circle": exactness,
    "ellipse": ellipse_convergence,
    "Euler spiral": spiral_convergence,
    "helix": helix_convergence,
    "ends of open curves": open_ends,
    "uneven spacing": uneven,
    "printed equations": slips,
}
