"""How far the curvatures can be trusted: orders, error bars, extraordinary vertices, creases, coarse meshes.

python -m comparisons.accuracy                    every part, ACCURACY.md written
python -m comparisons.accuracy creases coverage   these alone, printed
python -m comparisons.accuracy --scheme jet-2     of another fit
python -m comparisons.accuracy --against PATH     also beside the "jet" of another checkout
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from scipy.stats import spearmanr

import quadcurv as qc
from comparisons import cases
from comparisons.cases import Array, Case
from comparisons.goals import Goal, table
from comparisons.peers import hindsight
from quadcurv.estimate import disagreement
from quadcurv.refinement import fitted_rate
from quadcurv.schemes import SCHEMES, Fit, Laplacian

REPORT = Path(__file__).with_name("ACCURACY.md")
SEEDS = (0, 1, 2)
QUANTITIES = ("mean", "gaussian", "k1", "k2")
Records = list[tuple[str, ...]]
NAN = float("nan")
ROUNDING = 1e-11
"""Errors of H below it are rounding, which has no order: what is exact is of every order."""


def fit(case: Case, scheme: str | Fit) -> qc.Curvatures:
    """Curvatures by name, without what is warned of."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return qc.curvatures(case.mesh, scheme)


def flagged(found: qc.Curvatures) -> NDArray[np.bool_]:
    """Vertices that a scheme says lie at a feature; none where it does not say."""
    feature = getattr(found, "feature", None)
    return np.zeros(found.mean.shape, bool) if feature is None else np.asarray(feature) != 0


def exact(case: Case) -> dict[str, Array]:
    """By the names of `Curvatures`."""
    return {"mean": case.H, "gaussian": case.K, "k1": case.k1, "k2": case.k2}


# Orders -------------------------------------------------------------------------------------------

SMOOTH = (
    "sphere",
    "ellipsoid",
    "torus",
    "dupin_cyclide",
    "hyperboloid",
    "catenoid",
    "enneper",
    "elliptic_paraboloid",
)


def smooth_orders(scheme: str) -> Iterator[tuple[str, float, Array]]:
    """Order in the inf-norm on eight surfaces, a sixth of the sides that do not wrap left out."""
    for name in SMOOTH:
        surface = getattr(qc.surfaces, name)()
        found = []
        for n in (32, 64, 128):
            grid, xi, eta = surface.sample((n, n))
            error = np.abs(qc.mean_curvature(grid, scheme) - surface.mean_curvature(xi, eta))
            inside = [slice(None) if wraps else slice(n // 6, -(n // 6)) for wraps in surface.wrap]
            found.append(error[tuple(inside)].max())
        exact = found[0] < ROUNDING
        yield name, np.inf if exact else fitted_rate((32, 64, 128), found), np.array(found)


def jitter_orders(scheme: str) -> Iterator[tuple[str, float, Array]]:
    """Order in the inf-norm where vertices moved by up to 20 % of the spacing; medians over seeds."""
    torus = cases.ring()
    kinds: dict[str, Callable[[int, int], Case]] = {
        "torus": lambda n, seed: torus.jittered(cases.ring_grid(2 * n, n).mesh, 0.2, seed),
        "ellipsoid": lambda n, seed: cases.ellipsoid().jittered(cases.cubed(n // 2), 0.2, seed),
        "open patch": lambda n, seed: cases.patch(n, 0.2, seed),
    }
    sizes = (16, 32, 64, 128)
    for name, make in kinds.items():
        found = [np.median([_largest(make(n, seed), scheme) for seed in SEEDS]) for n in sizes]
        yield name, fitted_rate(sizes, found), np.array(found)


def _largest(case: Case, scheme: str) -> float:
    return float(np.nanmax(np.abs(fit(case, scheme).mean - case.H)))


def near_extraordinary(mesh: qc.QuadMesh, valence: int, rings: int = 2) -> NDArray[np.bool_]:
    """Vertices of a valence, and so many rings of faces around."""
    counts = np.bincount(mesh.faces[mesh.faces >= 0], minlength=len(mesh.points))
    near = counts == valence
    for _ in range(rings):
        near[mesh.faces[near[mesh.faces].any(axis=1)]] = True
    return near


def extraordinary_orders(scheme: str) -> Iterator[tuple[str, float, Array]]:
    """Order of the largest error at vertices of valence 3, 5, 6, 8 and within two rings of them."""
    sizes = (8, 16, 32, 64)
    for valence in (3, 5, 6, 8):
        found = []
        for n in sizes:
            case = cases.fan(valence, n)
            near = near_extraordinary(case.mesh, valence)
            found.append(np.max(np.abs(fit(case, scheme).mean - case.H)[near]))
        yield f"valence {valence}", fitted_rate(sizes, found), np.array(found)


# Error bars ---------------------------------------------------------------------------------------


def surfaces() -> dict[str, Case]:
    """Five surfaces that noise is put on."""
    return {
        "ellipsoid": cases.on(cases.ellipsoid(), cases.cubed(16)),
        "torus": cases.ring_grid(64, 32),
        "cyclide": cases.cyclide(48, 48),
        "star": cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), 4)),
        "open patch": cases.patch(40),
    }


NOISE = (1e-4, 1e-3, 1e-2, 5e-2, 0.1, 0.3)


def error_bars(found: qc.Curvatures, name: str) -> Array | None:
    """Half the width of the 95 % interval, where a scheme gives one: standard errors know of noise alone."""
    interval = getattr(found, "interval", None)
    return None if interval is None else np.asarray(getattr(interval, name))


def coverage(schemes: Sequence[str]) -> Iterator[tuple[str, str, float, str, float, float]]:
    """Scheme, surface, noise, quantity: share of the vertices whose exact value lies in the 95 % interval.

    Beside it the mean error of the same vertices. Vertices without an interval are no part of it.
    """
    for surface, smooth in surfaces().items():
        for level in NOISE:
            for scheme in schemes:
                shares, sizes = [], []
                for seed in SEEDS:
                    case = smooth.noisy(level, seed)
                    found, true = fit(case, scheme), exact(smooth)
                    bars = {q: bar for q in QUANTITIES if (bar := error_bars(found, q)) is not None}
                    if not bars:
                        break
                    error = {q: np.abs(getattr(found, q) - true[q]) for q in QUANTITIES}
                    known = {q: np.isfinite(error[q]) & np.isfinite(bars[q]) for q in QUANTITIES}
                    shares.append([np.mean((error[q] <= bars[q])[known[q]]) for q in QUANTITIES])
                    sizes.append([error[q][known[q]].mean() for q in QUANTITIES])
                else:
                    for q, share, size in zip(
                        QUANTITIES, np.mean(shares, axis=0), np.mean(sizes, axis=0), strict=True
                    ):
                        yield scheme, surface, level, q, float(share), float(size)


def estimates(scheme: str) -> Iterator[tuple[str, str, float, float]]:
    """What is estimated and how, surface, rank correlation, size over that of the true error; no noise.

    Half the half width of the scheme's own intervals, and `disagreement` of degree 4 with the scheme.
    """
    meshes = {
        **surfaces(),
        "jittered": cases.ellipsoid().jittered(cases.cubed(16), 0.2),
        "mixed": cases.mixed(cases.on(cases.ellipsoid(), cases.cubed(16))),
    }
    for name, case in meshes.items():
        found = fit(case, scheme)
        bars = error_bars(found, "mean")
        own = np.full(found.mean.shape, NAN) if bars is None else bars / 2
        yield "interval", name, *_likeness(found.mean - case.H, own)
    quartic = qc.schemes.jet(4)
    for name, case in meshes.items():
        H = fit(case, quartic).mean
        yield "degree 4", name, *_likeness(H - case.H, disagreement(case.mesh, quartic, scheme))


def _likeness(error: Array, estimate: Array) -> tuple[float, float]:
    """Rank correlation of magnitudes, and the ratio of their means."""
    error, estimate = np.abs(error), np.abs(estimate)
    known = np.isfinite(error) & np.isfinite(estimate)
    if not known.any():
        return NAN, NAN
    rank = float(spearmanr(error[known], estimate[known]).statistic)
    return rank, float(estimate[known].mean() / error[known].mean())


# Features -----------------------------------------------------------------------------------------


def laplacians() -> list[str]:
    """Names of all Laplacians."""
    return [name for name, scheme in SCHEMES.items() if isinstance(scheme, Laplacian)]


def creases(scheme: str) -> Iterator[tuple[str, float, float, float, float]]:
    """Angle; largest errors of H one row off a crease by the fit and by the best Laplacian, in hindsight.

    Then the median of the fit's standard errors there, and the share of the crease that is flagged.
    """
    for degrees in (10, 30, 60, 90):
        case, off = cases.crease(degrees)
        v = case.mesh.points[:, 1]
        beside = (off == 1) & (np.abs(v) < 0.8)
        found = fit(case, scheme)
        own = _worst(found.mean, case.H, beside)
        best = min(_worst(qc.mean_curvature(case.mesh, s), case.H, beside) for s in laplacians())
        bars = found.standard_error
        bar = NAN if bars is None else float(np.nanmedian(bars.mean[beside]))
        on = (off == 0) & (np.abs(v) < 0.8)
        yield f"crease of {degrees} degrees", own, best, bar, float(flagged(found)[on].mean())


def fillets(scheme: str) -> Iterator[tuple[str, float, float]]:
    """Mean errors of H on rounded cubes by the fit and by the best Laplacian, in hindsight."""
    for cells in (4, 8):
        case = cases.fillet(cells=cells)
        known = np.isfinite(case.H)
        own = _average(fit(case, scheme).mean, case.H, known)
        best = min(_average(qc.mean_curvature(case.mesh, s), case.H, known) for s in laplacians())
        yield f"fillet of {cells} cells", own, best


def knives(scheme: str) -> Iterator[tuple[str, float]]:
    """Largest |k| times the thickness where there is a value that is not flagged."""
    for thickness in (1e-3, 1e-5):
        mesh = cases.knife(thickness=thickness)
        found = fit(Case(mesh, np.empty(0), np.empty(0)), scheme)
        k = np.fmax(np.abs(found.k1), np.abs(found.k2))[~flagged(found)]
        yield f"thickness {thickness:g}", float(np.nanmax(k, initial=0) * thickness)


def stretched(scheme: str) -> Iterator[tuple[str, float, float]]:
    """Mean errors of H on tori of long cells, along either circle, by the fit and by Liu's formula."""
    for aspect, along, across in ((20, 48, 480), (100, 24, 1200)):
        for name, shape in (("large", (along * 2, across)), ("small", (across * 2, along))):
            case = cases.ring_grid(*shape)
            known = np.isfinite(case.H)
            own = _average(fit(case, scheme).mean, case.H, known)
            liu = _average(qc.mean_curvature(case.mesh, "liu"), case.H, known)
            yield f"aspect about {aspect}, long along the {name} circle", own, liu


def coarse() -> dict[str, Case]:
    """Meshes of few vertices."""
    return {
        "ellipsoid, 26": cases.on(cases.ellipsoid(), cases.cubed(2)),
        "ellipsoid, 98": cases.on(cases.ellipsoid(), cases.cubed(4)),
        "valence 3 and 5, 242": cases.on(cases.ellipsoid(), cases.catmull_clark(cases.dodecahedron(), 2)),
        **{f"open cylinder {r} x {c}": cases.open_cylinder(r, c) for r, c in ((6, 4), (8, 5), (10, 5))},
    }


def low_poly(scheme: str) -> Iterator[tuple[str, float, float, float]]:
    """Share of vertices without a value; mean errors of H by the fit and by the best peer, in hindsight."""
    meshes = coarse()
    for (name, case), (best,) in zip(meshes.items(), hindsight(list(meshes.values())), strict=True):
        H = fit(case, scheme).mean
        yield name, float(np.isnan(H).mean()), float(np.nanmean(np.abs(H - case.H))), best


def noise_errors(scheme: str) -> Iterator[tuple[str, str, float, float]]:
    """Quantity, mesh; mean errors under noise by the fit and by the best peer at its best, in hindsight.

    Of H, of K, and of k1 and k2 together.
    """
    meshes = {
        f"{surface}, noise {level:g}": smooth.noisy(level)
        for surface, smooth in surfaces().items()
        for level in (1e-3, 1e-2, 5e-2, 0.3)
    }
    bests = hindsight(list(meshes.values()), ("H", "K", "k"))
    for (name, case), best in zip(meshes.items(), bests, strict=True):
        found, known = fit(case, scheme), np.isfinite(case.H)
        own = {q: _average(getattr(found, q), true, known) for q, true in exact(case).items()}
        both = own["mean"], own["gaussian"], (own["k1"] + own["k2"]) / 2
        for quantity, mine, other in zip(("H", "K", "k1 and k2"), both, best, strict=True):
            yield quantity, name, mine, other


def direction_errors(scheme: str) -> Iterator[tuple[str, float, float]]:
    """Mean angles, in degrees, that directions of k1 are off: by the fit, and by libigl's best radius.

    Where k1 and k2 differ by a tenth of the larger one at least.
    """
    import igl

    dodecahedron = cases.catmull_clark(cases.dodecahedron(), 4)
    shapes = {
        "ellipsoid": (cases.ellipsoid(), cases.cubed(24)),
        "torus": (cases.ring(), cases.ring_grid(64, 32).mesh),
        "star": (cases.STAR, cases.on(cases.STAR, dodecahedron).mesh),
    }
    for name, (surface, mesh) in shapes.items():
        smooth, true = cases.on(surface, mesh), surface.direction1(np.asarray(mesh.points))
        jittered = surface.jittered(mesh, 0.2)
        meshes = {
            "smooth": (smooth, true),
            "jitter": (jittered, surface.direction1(np.asarray(jittered.mesh.points))),
            **{f"noise {level:g}": (smooth.noisy(level), true) for level in (1e-3, 1e-2, 5e-2)},
        }
        for kind, (case, direction) in meshes.items():
            apart = case.k1 - case.k2 > 0.1 * np.maximum(np.abs(case.k1), np.abs(case.k2))
            points, cut = np.array(case.mesh.points), _triangles(case.mesh)
            others = [igl.principal_curvature(points, cut, radius)[0] for radius in (2, 3, 5)]
            own = _off(fit(case, scheme).direction1, direction, apart)
            yield f"{name}, {kind}", own, min(_off(other, direction, apart) for other in others)


def _off(found: Array, true: Array, at: NDArray[np.bool_]) -> float:
    """Mean angle between lines, in degrees."""
    cosine = np.abs(np.einsum("ix,ix->i", found, true)) / np.linalg.norm(found, axis=1)
    return float(np.nanmean(np.rad2deg(np.arccos(np.minimum(cosine, 1)))[at]))


def _worst(H: Array, true: Array, at: Array) -> float:
    return float(np.max(np.abs(H - true)[at]))  # NaN where there is no value


def _average(H: Array, true: Array, at: Array) -> float:
    return float(np.nanmean(np.abs(H - true)[at]))


# Against another checkout -------------------------------------------------------------------------

_CHILD = """
import sys, warnings
warnings.simplefilter("ignore")
import numpy as np, quadcurv as qc
given = np.load(sys.argv[1])
found = {}
for name in {key[:-2] for key in given}:
    faces = given[name + " F"]
    found[name] = np.asarray(qc.mean_curvature(qc.QuadMesh(given[name + " P"], faces), "jet"))
np.savez(sys.argv[2], **found)
"""


def by_checkout(path: Path, meshes: dict[str, Case]) -> dict[str, Array]:
    """H by the "jet" of another checkout, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        given, found = Path(folder, "given.npz"), Path(folder, "found.npz")
        arrays: dict[str, Any] = {f"{k} P": c.mesh.points for k, c in meshes.items()}
        arrays |= {f"{k} F": c.mesh.faces for k, c in meshes.items()}
        np.savez(given, **arrays)
        subprocess.run(
            [sys.executable, "-c", _CHILD, given, found],
            check=True,
            cwd=folder,
            env={**os.environ, "PYTHONPATH": str(path)},
        )
        return dict(np.load(found))


def against(scheme: str, path: Path) -> Iterator[tuple[str, float, float]]:
    """Mean errors of H by the fit and by the jet of another checkout, on meshes without noise."""
    smooth = cases.on(cases.ellipsoid(), cases.cubed(32))
    meshes = {
        "smooth": smooth,
        "jitter": cases.ellipsoid().jittered(smooth.mesh, 0.2),
        "mixed": cases.mixed(smooth),
        "valence 3 and 5": cases.on(cases.STAR, cases.catmull_clark(cases.dodecahedron(), 4)),
        "pillow": cases.pillow(48),
    }
    for name, H in by_checkout(path, meshes).items():
        case = meshes[name]
        known = np.isfinite(case.H)
        yield name, _average(fit(case, scheme).mean, case.H, known), _average(H, case.H, known)


# Time ---------------------------------------------------------------------------------------------


def processor(call: Callable[[], Any], count: int = 5) -> float:
    """Least processor seconds of some calls, after one."""
    call()
    taken = []
    for _ in range(count):
        start = time.process_time()
        call()
        taken.append(time.process_time() - start)
    return min(taken)


def times(scheme: str) -> tuple[float, dict[str, float]]:
    """Processor time of libigl's principal curvature, radius 2, over degree 4's; microseconds a vertex."""
    import igl

    mesh = cases.cubed(40)
    points, cut = np.array(mesh.points), _triangles(mesh)
    quartic = processor(lambda: qc.curvatures(mesh, qc.schemes.jet(4)))
    other = processor(lambda: igl.principal_curvature(points, cut, 2), 2)
    case = cases.on(cases.ellipsoid(), mesh)
    micro = {}
    for name, made in (("without noise", case), ("noise 0.05", case.noisy(0.05, 0))):
        own = processor(lambda at=made: fit(at, scheme))  # type: ignore[misc]
        micro[name] = 1e6 * own / len(points)
    return other / quartic, micro


def _triangles(mesh: qc.QuadMesh) -> NDArray[np.int64]:
    faces = mesh.faces.astype(np.int64)
    return np.concatenate((faces[:, :3], faces[:, [2, 3, 0]]))


# The table ----------------------------------------------------------------------------------------


class Part:
    """Goals of one part of the table, and all that was measured."""

    def __init__(self) -> None:
        self.goals: list[Goal] = []
        self.details: list[tuple[str, tuple[str, ...], Records]] = []

    def least(self, name: str, values: dict[str, float], must: float, aim: float) -> None:
        """The least value counts; NaN is the least."""
        self._worst(name, values, must, aim, min)

    def most(self, name: str, values: dict[str, float], must: float, aim: float) -> None:
        """The largest value counts; NaN is the largest."""
        self._worst(name, values, must, aim, max)

    def _worst(self, name: str, values: dict[str, float], must: float, aim: float, of: Any) -> None:
        missing = [k for k, v in values.items() if np.isnan(v)]
        where = missing[0] if missing else of(values, key=lambda k: values[k])
        self.goals.append(Goal(name, values[where], must, aim, where))

    def detail(self, title: str, header: tuple[str, ...], rows: Sequence[Sequence[Any]]) -> None:
        """A table of its own below."""
        text = [tuple(x if isinstance(x, str) else f"{x:.3g}" for x in row) for row in rows]
        self.details.append((title, header, text))


def _orders(part: Part, title: str, rows: list[tuple[str, float, Array]], must: float, aim: float) -> None:
    part.least(title, {name: rate for name, rate, _ in rows}, must, aim)
    part.detail(
        title,
        ("where", "order", "largest errors"),
        [(n, r, " ".join(f"{x:.1e}" for x in e)) for n, r, e in rows],
    )


def _ratios(part: Part, title: str, rows: list[tuple[str, float, float]], must: float, aim: float) -> None:
    part.most(title, {name: own / other for name, own, other in rows}, must, aim)
    part.detail(title, ("where", "ours", "other", "ratio"), [(*row, row[1] / row[2]) for row in rows])


def orders(scheme: str) -> Part:
    """Orders in the inf-norm."""
    part = Part()
    for title, measure, must, aim in (
        ("order in the inf-norm, smooth, away from borders", smooth_orders, 3.8, 6),
        ("order in the inf-norm, jitter of 20 %, borders included", jitter_orders, 2.8, 4),
        ("order at valence 3, 5, 6, 8 and two rings around", extraordinary_orders, 3.5, 4),
    ):
        _orders(part, title, list(measure(scheme)), must, aim)
    return part


def bars(scheme: str) -> Part:
    """Error bars: coverage of every scheme that has them, and what they say without noise."""
    part = Part()
    rows = list(coverage([name for name, s in SCHEMES.items() if isinstance(s, Fit)]))
    for name in dict.fromkeys(row[0] for row in rows):
        by = {f"{row[1]}, {row[3]}, noise {row[2]:g}": row[4] for row in rows if row[0] == name}
        part.least(f"coverage of 95 % intervals, {name}: least", by, 0.9, 0.94)
        mean = float(np.mean(list(by.values())))
        part.most(
            f"coverage of 95 % intervals, {name}: mean, off 0.95",
            {f"{mean:.3f}": abs(mean - 0.95)},
            0.03,
            0.01,
        )
    part.detail(
        "coverage of 95 % intervals",
        ("scheme", "surface", "noise", "quantity", "coverage", "mean error"),
        rows,
    )
    found = list(estimates(scheme))
    for kind, what in (
        ("degree 4", "error of degree 4 by its difference to the default, no noise"),
        ("interval", "error by half an interval, no noise"),
    ):
        own = {name: (rank, share) for k, name, rank, share in found if k == kind}
        part.least(f"{what}: rank correlation", {name: rank for name, (rank, _) in own.items()}, 0.9, 0.95)
        size = {name: max(q, 1 / q) if q > 0 else NAN for name, (_, q) in own.items()}
        part.most(f"{what}: times too large or small", size, 1.5, 1.2)
    part.detail(
        "estimated error without noise", ("of", "mesh", "rank correlation", "estimated / true"), found
    )
    return part


def features(scheme: str) -> Part:
    """Creases, fillets, knives and long cells."""
    part = Part()
    rows = list(creases(scheme))
    title = "crease of 10 to 90 degrees, error one row off over the best Laplacian's"
    part.most(title, {n: own / best for n, own, best, _, _ in rows}, 1, 0.1)
    part.least("crease: share that is flagged", {n: share for n, *_, share in rows}, 1, 1)
    part.detail("creases", ("where", "ours", "best Laplacian", "standard error", "flagged"), rows)
    _ratios(part, "fillets of 4 and 8 cells, error over the best Laplacian's", list(fillets(scheme)), 1, 0.5)
    knife = list(knives(scheme))
    part.most("knife edges: largest curvature x thickness, where not flagged", dict(knife), 1, 0.5)
    part.detail("knife edges", ("where", "largest curvature x thickness"), knife)
    _ratios(part, "aspect 20:1 and 100:1, error over Liu's", list(stretched(scheme)), 1, 0.5)
    return part


def few(scheme: str) -> Part:
    """Meshes of few vertices."""
    part = Part()
    rows = list(low_poly(scheme))
    part.most("low poly: share without a value", {n: share for n, share, _, _ in rows}, 0, 0)
    part.most("low poly: error over the best peer's", {n: own / best for n, _, own, best in rows}, 1, 0.7)
    part.detail("low poly", ("mesh", "without", "ours", "best peer"), rows)
    return part


def noise(scheme: str) -> Part:
    """Errors under noise."""
    part = Part()
    rows = list(noise_errors(scheme))
    for quantity in dict.fromkeys(row[0] for row in rows):
        title = f"noise 1e-3 to 0.3, error of {quantity} over the best peer's"
        _ratios(part, title, [row[1:] for row in rows if row[0] == quantity], 1, 0.5)
    return part


def directions(scheme: str) -> Part:
    """Principal directions."""
    part = Part()
    title = "directions of k1, degrees off over libigl's at its best radius"
    _ratios(part, title, list(direction_errors(scheme)), 1, 0.5)
    return part


def speed(scheme: str) -> Part:
    """Processor time."""
    part = Part()
    ratio, micro = times(scheme)
    part.least(
        "libigl's principal curvature, radius 2: its time over degree 4's", {"cubed sphere": ratio}, 12, 20
    )
    part.most("microseconds a vertex", micro, 10, 5)
    return part


PARTS: dict[str, Callable[[str], Part]] = {
    "orders": orders,
    "bars": bars,
    "features": features,
    "few": few,
    "noise": noise,
    "directions": directions,
    "speed": speed,
}


def markdown(parts: dict[str, Part], scheme: str) -> str:
    """The table of goals, then what stands behind it."""
    lines = [
        f"# How far `{scheme}` can be trusted",
        "",
        "Written by `python -m comparisons.accuracy`. Every row is the worst of what stands behind it in the",
        "tables below; its verdict says whether it reaches what is aimed at, what it must, or neither.",
        "",
        *table([goal for part in parts.values() for goal in part.goals]),
    ]
    for part in parts.values():
        for title, header, rows in part.details:
            lines += ["", f"## {title[0].upper()}{title[1:]}", "", f"| {' | '.join(header)} |"]
            lines.append(f"| --- |{' ---: |' * (len(header) - 1)}")
            lines += [f"| {' | '.join(row)} |" for row in rows]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Measure the parts that are asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="part", help=", ".join(PARTS))
    parser.add_argument("--scheme", default="jet")
    parser.add_argument("--against", type=Path, help="another checkout of quadcurv")
    options = parser.parse_args()
    unknown = set(options.parts) - set(PARTS)
    if unknown:
        parser.error(f"part: expected some of {', '.join(PARTS)}, got {', '.join(sorted(unknown))}")
    console = Console(stderr=True)
    found: dict[str, Part] = {}
    for name, measure in PARTS.items():
        if not options.parts or name in options.parts:
            start = time.process_time()
            found[name] = measure(options.scheme)
            console.print(f"{name}: {time.process_time() - start:.0f} s of the processor")
    if options.against:
        found["against"] = Part()
        title = "error of H over that of the other checkout's jet"
        _ratios(found["against"], title, list(against(options.scheme, options.against)), 1 / 3, 0.1)
    text = markdown(found, options.scheme)
    if options.parts or options.scheme != "jet":
        print(text)
    else:
        REPORT.write_text(text)
        console.print(f"{REPORT}")


if __name__ == "__main__":
    main()
