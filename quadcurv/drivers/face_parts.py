"""Face lists in parts: what a part gives, one after the other or by the workers of a dask client."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from quadcurv import drivers
from quadcurv.boundary import REACH, checked_boundary
from quadcurv.checks import Finding
from quadcurv.drivers import answers, fits
from quadcurv.drivers.progress import tracked
from quadcurv.drivers.targets import IN_SLICES, checked_out, targets
from quadcurv.mesh import part_sides
from quadcurv.mesh.face_parts import FaceParts
from quadcurv.mesh.mapped import forget
from quadcurv.precision import error_at_edges, warn_of_error
from quadcurv.schemes import Fit, Laplacian, Scheme
from quadcurv.types import Floats, Indices, MeshError, warn

# Rings of faces around vertices whose rings are not regular. Closing a ring looks REACH faces far, at fits to
# the residuals of others two rings away, which look as far; and all must know which rings are closed where
# they end. A fit of up to five rings looks beyond borders as these do, and chooses by what others find up to
# six rings away.
_RINGS, _FIT_RINGS = 3 * REACH + 1, 6 * REACH
_COUNTS = ("dual_areas", "degree", "rings", "feature")
_LOOKED_AT = 1 << 20  # vertices, of whose H rounding is told


def evaluate(
    mesh: FaceParts,
    wanted: Iterable[str],
    scheme: Scheme,
    boundary: str = "extrapolate",
    out: Mapping[str, Any] | None = None,
    progress: bool = False,
) -> dict[str, Any]:
    """Results by name, into arrays of `out` where there are any; see `FaceParts`."""
    checked_boundary(boundary)
    given = checked_out(out)
    shapes = answers.shapes(scheme, (*wanted, *given))
    full = {name: mesh.shape + one for name, one in shapes.items()}
    results = targets(full, given, {"points": mesh.points}, IN_SLICES)
    try:
        said = _by_parts(mesh, scheme, boundary, results, progress)
    except part_sides.SidesError:
        part_sides.find(mesh)
        said = _by_parts(mesh, scheme, boundary, results, progress)
    if said:
        warn("; ".join(said))
    if (name := answers.telling(results)) is not None:
        some = np.asarray(results[name][:: mesh.shape[0] // _LOOKED_AT + 1])
        warn_of_error(*error_at_edges(*mesh.some_edges(), mesh.roundoff), mesh.roundoff, some)
    return results


def _by_parts(
    mesh: FaceParts, scheme: Scheme, boundary: str, results: dict[str, Any], progress: bool
) -> list[str]:
    """Compute part by part; what there is to warn of."""
    said: list[str] = []
    # Flaps of triangles are computed relative to the first irregular vertex.
    seen_from = mesh.first_irregular() if mesh.has_triangles and _is_fast(scheme) else None
    job = _Job(tuple(results), scheme, boundary, seen_from)
    for at, found, warned in tracked(_answers(mesh, job), "parts", mesh.parts, progress):
        for name, values in found.items():
            results[name][at] = values
            if isinstance(at, slice):
                forget(results[name], at.start, at.stop)
        if warned:
            said.append(warned)
    if said:
        said = [f"{len(said)} part(s) of the mesh have what is mended, one of them: {said[0]}"]
    sides = mesh.sides
    if sides is not None:
        findings = [Finding("turned", sides.turned, f"face {sides.first}")] if sides.turned else []
        findings += [] if sides.orientable else [Finding("non_orientable", 1, "")]
        said = [str(finding) for finding in findings] + said
    return said


class _Job(NamedTuple):
    """What is asked of every part."""

    wanted: tuple[str, ...]
    scheme: Scheme
    boundary: str
    origin: int | None


def _is_fast(scheme: Scheme) -> bool:
    return isinstance(scheme, Laplacian) and scheme.fast is not None


Answer = tuple["Indices | slice", dict[str, Floats], str]


def _answers(mesh: FaceParts, job: _Job) -> Iterator[Answer]:
    """What each part gives, in any order."""
    if mesh.client is None:
        for p in range(mesh.parts):
            yield part_results(mesh, p, job)
        return
    from distributed import as_completed

    # A task reads files and gives arrays, no more: done again by another worker it gives the same.
    options: dict[str, Any] = {"pure": False, "retries": 3}
    waiting = iter(range(mesh.parts))
    at_once = 2 * max(1, sum(mesh.client.nthreads().values()))

    def submitted(p: int) -> Any:
        return mesh.client.submit(part_results, mesh, p, job, alone=True, **options)

    running = as_completed([submitted(p) for _, p in zip(range(at_once), waiting, strict=False)])
    for future in running:
        answer = future.result()
        future.release()
        yield answer
        following = next(waiting, None)
        if following is not None:
            running.add(submitted(following))


def part_results(mesh: FaceParts, p: int, job: _Job, alone: bool = False) -> Answer:
    """Numbers of the vertices of a part, their results by name, and what there is to warn of."""
    from quadcurv.kernels import ranges

    if alone:  # workers compute beside each other already
        with ranges.serial():
            return part_results(mesh, p, job)
    wanted, scheme, boundary, origin = job
    is_fit = isinstance(scheme, Fit)
    try:
        rings = max(_FIT_RINGS, (scheme.reach or 0) + REACH) if isinstance(scheme, Fit) else _RINGS
        part = mesh.part(p, rings, is_fit, origin)
    except MeshError as error:
        raise MeshError(f"part {p}, vertices {mesh.cuts[p]}..{mesh.cuts[p + 1] - 1}: {error}") from None
    owned = mesh.owned(p)
    size = int(mesh.cuts[p + 1] - mesh.cuts[p])
    results = {
        name: np.full((size, *shape), 0.0 if name in _COUNTS else np.nan)  # of isolated vertices
        for name, shape in answers.shapes(scheme, wanted).items()
    }
    if part is None:
        return owned, results, ""
    if isinstance(scheme, Laplacian):
        found = drivers.run(part.mesh, scheme, wanted, boundary)
    else:
        around = fits.MeshNeighbourhoods(part.mesh, boundary)
        around.rounding = fits.ROUNDING * mesh.largest
        curvatures = fits.fit_around(around, scheme)
        found = {name: answers.FITTED[name][1](curvatures) for name in wanted}
    place = part.vertices - owned.start if isinstance(owned, slice) else _places(owned, part.vertices)
    for name, values in found.items():
        results[name][place] = values[part.own]
    return owned, results, part.said


def _places(owned: Indices, vertices: Indices) -> Indices:
    order = np.argsort(owned)
    return order[np.searchsorted(owned[order], vertices)]
