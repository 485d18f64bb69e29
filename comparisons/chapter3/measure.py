"""What chapter 3 measures."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from comparisons import printed
from comparisons.measured import Measured, curvature_errors, one_and_inf, rate_in
from comparisons.printed import cross, dot
from quadcurv import StaggeredGrid, mean_curvature_normal, set_threads
from quadcurv.refinement import fitted_rate
from quadcurv.surfaces import (
    Surface,
    catenoid,
    cylinder,
    elliptic_paraboloid,
    enneper,
    helicoid,
    henneberg,
    hyperbolic_paraboloid,
    hyperboloid,
    pillow_sphere,
    plane,
    sphere,
    tanh_sheet,
    torus,
)

Array = NDArray[Any]

FV = "finite_volume"
SIZES = np.array([16, 32, 64, 128, 256])
PORTION = replace(enneper(), domain=((-1.2, 1.2), (-1.2, 1.2)))  # what Figure 3.6 shows
CONVERGENCE = {
    "figure_3_4": (catenoid(), "Catenoid"),
    "figure_3_5": (helicoid(), "Helicoid"),
    "figure_3_7": (enneper(), "Enneper's surface"),
    "figure_3_9": (pillow_sphere(), "Pillow sphere"),
    "figure_3_10": (sphere(), r"Longitude-latitude sphere to $\pm 60^\circ$"),
}
OTHERS = (hyperboloid(), elliptic_paraboloid(), hyperbolic_paraboloid(), tanh_sheet(), torus())
LARGE = 512  # cells in one direction whose arrays, 19 MB, leave the caches of a core
TIMED = np.array([64, 128, 256, 384, 512, 640, 768, 896, 1024, 1280, 1536])


def wave(theta: Array) -> Array:
    """The f of the sheared cylinder."""
    return np.asarray(np.sin(2 * theta))


def shape(surface: Surface, n: int) -> tuple[int, int]:
    """Cells: n in each direction, on spheres 2n around."""
    return (2 * n, n) if "sphere" in surface.name else (n, n)


def exactness(into: Measured) -> None:
    """Surfaces on which only rounding is left."""
    for name, surface in {
        "cylinder": cylinder(),
        "wavy cylinder": cylinder(f=wave),
        "plane": plane(),
    }.items():
        found = [curvature_errors(surface, (n, n), FV).norm.max() for n in SIZES]
        into.numbers[f"{name}: largest error"] = float(max(found))


def convergence(into: Measured) -> None:
    """Figures 3.4, 3.5, 3.7, 3.9 and 3.10."""
    for stem, (surface, _) in CONVERGENCE.items():
        found = [curvature_errors(surface, shape(surface, n), FV) for n in SIZES]
        columns = into.add(
            stem,
            {
                "n": SIZES,
                **one_and_inf([e.norm for e in found]),
                "signed, inf-norm": [float(e.signed.max()) for e in found],
            },
        )
        for norm in ("one-norm", "inf-norm"):
            into.numbers[f"{surface.name}: {norm} rate"] = rate_in(columns, norm, 64)
            into.numbers[f"{surface.name}: {norm} at 256"] = columns.at(256, norm)
        into.numbers[f"{surface.name}: signed, inf-norm at 256"] = columns.at(256, "signed, inf-norm")


def other_surfaces(into: Measured) -> None:
    """Surfaces that the thesis names and does not show."""
    series: dict[str, list[float]] = {}
    for surface in OTHERS:
        found = one_and_inf([curvature_errors(surface, (n, n), FV).signed for n in SIZES])
        series |= {f"{surface.name}, {norm}": e for norm, e in found.items()}
    columns = into.add("figure_3_others", {"n": SIZES, **series})
    for surface in OTHERS:
        for norm in ("one-norm", "inf-norm"):
            into.numbers[f"{surface.name}: {norm} rate"] = rate_in(columns, f"{surface.name}, {norm}", 64)
            into.numbers[f"{surface.name}: {norm} at 256"] = columns.at(256, f"{surface.name}, {norm}")


def henneberg_surface(into: Measured) -> None:
    """Error of Henneberg's surface against the distance to its singular points."""
    surface, edges = henneberg(), np.geomspace(0.004, 0.8, 24)
    columns: dict[str, Any] = {"distance": np.sqrt(edges[1:] * edges[:-1])}
    far, near_, signed = [], [], []
    for n in SIZES:
        found = curvature_errors(surface, (n, n), FV)
        r = singular_distance(surface, found.xi, found.eta)
        far.append(float(found.norm[r > 0.25].max()))
        near_.append(float(found.norm[r <= 0.25].max()))
        signed.append(float(found.signed.max()))
        bins = np.digitize(r, edges)
        columns[f"n = {n}"] = [
            found.norm[bins == b].max() if (bins == b).any() else np.nan for b in range(1, edges.size)
        ]
    into.add("figure_3_henneberg", columns)
    into.numbers |= {
        "henneberg: near, at 256": near_[-1],
        "henneberg: near, rate": fitted_rate(SIZES[2:], near_[2:]),
        "henneberg: far, at 256": far[-1],
        "henneberg: far, rate": fitted_rate(SIZES[2:], far[2:]),
        "henneberg: signed, rate": fitted_rate(SIZES[2:], signed[2:]),
        "henneberg: turn of the normal around a singular point": normal_turn(surface),
    }


def singular_distance(surface: Surface, xi: Array, eta: Array) -> Array:
    """Distance in the parameters to the nearest singular point; eta has the period 2 pi."""
    return np.min(
        [np.hypot(xi - a, (eta - b + np.pi) % (2 * np.pi) - np.pi) for a, b in surface.singular_points],
        axis=0,
    )


def normal_turn(surface: Surface, radius: float = 1e-3) -> float:
    """Largest sine of the angle between unit normals on a circle around a singular point (xi, eta)."""
    angle = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    a, b = surface.singular_points[0]
    xi, eta, d = a + radius * np.cos(angle), b + radius * np.sin(angle), radius * 1e-3
    n = cross(
        surface.mapping(xi + d, eta) - surface.mapping(xi - d, eta),
        surface.mapping(xi, eta + d) - surface.mapping(xi, eta - d),
    )
    n /= np.linalg.norm(n, axis=1, keepdims=True)
    return float(np.linalg.norm(n - n[0], axis=1).max())


def places(into: Measured) -> None:
    """Where the errors of the pillow sphere and of Enneper's surface sit, and the two grids of the sphere."""
    found = curvature_errors(pillow_sphere(), (256, 128), FV)
    pillow, xi, eta = found.norm, found.xi, found.eta
    x = np.abs(np.where(xi < -1, -2 - xi, xi))
    from_seams = np.minimum.reduce([np.abs(x - np.abs(eta)), 1 - x, 1 - np.abs(eta)])
    globe = {d: curvature_errors(sphere(latitude=np.radians(d)), (256, 128), FV).norm for d in (60, 80)}
    whole = replace(sphere(), domain=((-np.pi, np.pi), (-np.pi / 2, np.pi / 2)))
    far = curvature_errors(replace(enneper(), domain=((-3, 3), (-3, 3))), (128, 128), FV)
    from_origin = np.hypot(far.xi, far.eta)
    shown = curvature_errors(PORTION, (128, 128), FV).norm
    rim = np.ones(shown.shape, bool)
    rim[1:-1, 1:-1] = False
    into.numbers |= {
        "pillow: largest error off the seams over on them": float(
            pillow[from_seams > 2 / 128].max() / pillow[from_seams <= 2 / 128].max()
        ),
        "pillow: largest over smallest cell, 32": cell_ratio(pillow_sphere(), 32),
        "pillow: largest over smallest cell, 128": cell_ratio(pillow_sphere(), 128),
        "sphere with poles: largest over smallest cell, 32": cell_ratio(whole, 32),
        "sphere with poles: largest over smallest cell, 128": cell_ratio(whole, 128),
        "sphere to 80 over pillow, one-norm": float(globe[80].mean() / pillow.mean()),
        "sphere to 60 over pillow, one-norm": float(globe[60].mean() / pillow.mean()),
        "sphere to 80 over pillow, median": float(np.median(globe[80]) / np.median(pillow)),
        "sphere to 80 over pillow, inf-norm": float(globe[80].max() / pillow.max()),
        "enneper: where the largest error is": float(from_origin.flat[far.norm.argmax()]),
        "enneper: largest error beyond 2.5 over all": float(
            far.norm[from_origin > 2.5].max() / far.norm.max()
        ),
        "enneper: largest error on the figure's edge over all": float(shown[rim].max() / shown.max()),
    }


def cell_ratio(surface: Surface, n: int) -> float:
    """Area of the largest over that of the smallest cell."""
    mesh, *_ = surface.sample(shape(surface, n), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    d = mesh.dual
    areas = np.linalg.norm(cross(d[1:, 1:] - d[:-1, :-1], d[:-1, 1:] - d[1:, :-1]), axis=-1)
    return float(areas.max() / areas.min())


def torus_grid(n: int) -> tuple[Array, Array]:
    """Primal and dual points of a torus that wrap both ways, n by n."""
    mesh, *_ = torus().sample((n, n), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    return mesh.primal[1:-1, 1:-1], mesh.dual[:-1, :-1]


def operation_counts(into: Measured) -> None:
    """Operations a point: the printed formulas and ours."""
    primal, dual = torus_grid(6)
    alone = printed.operations(printed.printed_curvature_normal, primal, dual)
    edge = printed.operations(
        lambda p, d: printed.printed_edge(np.roll(p, 1, 1) - p, np.roll(d, 1, 1) - d), primal, dual
    )
    counts = {
        "as printed, each cell on its own": alone,
        "as printed, each edge once": alone - 2 * edge,
        "primal/dual": printed.operations(printed.staggered_curvature_normal, primal, dual),
        "vertices": printed.operations(printed.shared_curvature_normal, primal),
        "Liu as printed": printed.operations(printed.printed_liu, primal),
        "Liu, vertices": printed.operations(lambda p: printed.shared_curvature_normal(p, "liu"), primal),
    }
    into.numbers |= {f"operations: {name}": count for name, count in counts.items()}
    into.numbers["operations: counts that are 197"] = float(sum(c == 197 for c in counts.values()))
    # A processor that keeps all it has read: positions of a cell are read once, 48 bytes, and 24 written.
    # Edges that are computed once are written and read by both cells, 2 x 3 x 24 bytes more.
    into.numbers["bytes: each cell on its own"] = 72.0
    into.numbers["bytes: each edge once"] = 72.0 + 2 * 3 * 24
    into.numbers["operations a byte: each cell on its own"] = alone / 72


def dependence(into: Measured) -> None:
    """Points that H of a cell depends on; blocks with ghosts against the whole."""
    mesh, *_ = torus().sample((9, 9), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    reference = mean_curvature_normal(mesh, FV)[4, 4]
    moved = 0
    for name in ("primal", "dual"):
        points = getattr(mesh, name)
        for i, j in np.ndindex(points.shape[:2]):
            other = points.copy()
            other[i, j] += 1e-3
            changed = StaggeredGrid(**{"primal": mesh.primal, "dual": mesh.dual, name: other})
            moved += bool((mean_curvature_normal(changed, FV)[4, 4] != reference).any())
    into.numbers["points that a cell's H depends on, itself not counted"] = moved - 1.0
    n = 256
    mesh, *_ = torus().sample((n, n), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    whole, half = mean_curvature_normal(mesh, FV), n // 2
    gap = 0.0
    for i in (0, half):
        for j in (0, half):
            block = StaggeredGrid(
                mesh.primal[i : i + half + 2, j : j + half + 2],
                mesh.dual[i : i + half + 1, j : j + half + 1],
            )
            part = whole[i : i + half, j : j + half]
            gap = max(gap, float(np.abs(mean_curvature_normal(block, FV) - part).max()))
    into.numbers["blocks against the whole"] = gap
    once, blocks = 2 * n * (n + 1), 4 * 2 * half * (half + 1)
    into.numbers["edges of four blocks over those of the whole, in %"] = 100 * (blocks / once - 1)


def measured_time(into: Measured) -> None:
    """Figure 3.12: processor time of one thread, the least of several rounds over all sizes."""
    mesh, *_ = torus().sample((TIMED[-1], TIMED[-1]), "staggered")
    assert isinstance(mesh, StaggeredGrid)
    patches = [StaggeredGrid(mesh.primal[: n + 2, : n + 2], mesh.dual[: n + 1, : n + 1]) for n in TIMED]
    least = np.full(len(TIMED), np.inf)
    set_threads(1)
    try:
        for _ in range(9):
            for i, patch in enumerate(patches):
                start = time.process_time()
                mean_curvature_normal(patch, FV)
                least[i] = min(least[i], time.process_time() - start)
    finally:
        set_threads(None)
    columns = into.add("figure_3_12", {"n": TIMED, "time (ms)": 1e3 * least})
    into.numbers["time: exponent"] = growth(columns["n"], columns["time (ms)"])


def growth(n: Array, times: Array) -> float:
    """Exponent in n of the times less that of the smallest grid, from where arrays leave the caches.

    That one is what a call costs whatever the size; left in, it would make n^3 look like n^2.
    """
    large = n >= LARGE
    return -fitted_rate(n[large], np.maximum(times[large] - times[0], 1e-9))


def slips(into: Measured) -> None:
    """Numbers behind the printed equations that do not hold."""
    r = into.numbers
    for n in (64, 128):
        primal, dual = torus_grid(n)
        exact = torus().mean_curvature(*torus().sample((n, n), "staggered")[1:])
        for slip in ("", "3.20", "3.29", "3.34"):
            kappa = np.linalg.norm(printed.printed_curvature_normal(primal, dual, slip), axis=-1)
            r[f"{slip or 'corrected'}: error at {n}"] = float(np.abs(kappa - exact).mean())
    for equation, ratio in printed.cylinder_edge(1.5, 0.7, 0.2, 0.3).items():
        r[f"{equation}: printed over right"] = float(ratio)
    first, second = 0.7, 0.9  # two angles in a row, of steps 0.2 and 0.3
    r["3.74: left as printed"] = float(np.sin(first + 0.1) - np.sin(first + 0.1))
    r["3.74: left with the second angle"] = float(np.sin(second + 0.15) - np.sin(first + 0.1))
    mesh, xi, eta = helicoid().sample((64, 64), "staggered")
    Hn = mean_curvature_normal(mesh, FV)
    normal = np.stack((np.sin(eta), -np.cos(eta), xi), axis=-1) / np.sqrt(1 + xi**2)[..., None]
    r["3.22: largest cosine on the helicoid"] = float(
        (np.abs(dot(Hn, normal)) / np.linalg.norm(Hn, axis=-1)).max()
    )
    mesh, xi, eta = sphere().sample((64, 32), "staggered")
    r["3.22: H n . outward normal on the sphere"] = float(
        dot(mean_curvature_normal(mesh, FV), sphere().mapping(xi, eta)).mean()
    )
    xi, eta = np.mgrid[-1:1:9j, -3:3:9j]
    x, y, z = np.moveaxis(catenoid().mapping(xi, eta), -1, 0)
    r["3.79: off the catenoid, Z = xi"] = float(np.abs(np.hypot(x, y) - np.cosh(z)).max())
    r["3.79: off the catenoid, Z = eta"] = float(np.abs(np.hypot(x, y) - np.cosh(eta)).max())
    r["3.79: off the helicoid, Z = eta"] = float(np.abs(x * np.sin(eta) - y * np.cos(eta)).max())


STEPS = {
    "exact cases": exactness,
    "convergence": convergence,
    "further surfaces": other_surfaces,
    "Henneberg's surface": henneberg_surface,
    "where the errors are": places,
    "operations": operation_counts,
    "what a cell depends on": dependence,
    "time": measured_time,
    "printed equations": slips,
}
