"""The diamond schemes on a graphics processor: positions and results stay there, bitwise the processor's.

Regular vertices are done by the passes of `kernels/diamond.cu`. Borders of grids, and vertices without a
regular ring, come from the drivers of the host on copies of the parts around them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

import numpy as np

from quadcurv.boundary import REACH, SPREAD, checked_boundary, closed, poles
from quadcurv.device_arrays import as_cupy, is_on_device, on_host, taken
from quadcurv.drivers import answers, compiled, direct
from quadcurv.drivers.targets import Kind, checked_out, targets
from quadcurv.mesh import QuadGrid, QuadMesh
from quadcurv.schemes import Fit, Laplacian, Scheme
from quadcurv.stencils import Stencils, coarse
from quadcurv.types import Floats

_THREADS = 64
# Rows along a side that are copied, and those of them whose results are taken: that of the side and, where it
# is a pole, those beside it. Closing rings looks REACH quads inward.
_COPIED, _TAKEN = REACH + SPREAD + 5, SPREAD + 2


def holds(mesh: Any) -> bool:
    """Whether the positions of a mesh lie on a device."""
    return isinstance(mesh, QuadMesh | QuadGrid) and is_on_device(mesh.points)


def checked_scheme(scheme: Scheme) -> Laplacian:
    """A scheme that runs on a device.

    Raises
    ------
    ValueError
        It does not.
    """
    if isinstance(scheme, Fit) or scheme.fast is None:
        raise ValueError(
            f"scheme: {scheme.name} does not run on a device, as 'finite_volume' and 'liu' do; "
            "give it positions in memory"
        )
    return scheme


def evaluate(
    mesh: QuadMesh | QuadGrid,
    scheme: Laplacian,
    wanted: Iterable[str],
    boundary: str = "extrapolate",
    out: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Results by name, cupy arrays, into those of `out` where there are any."""
    checked_boundary(boundary)
    checked_scheme(scheme)
    assert scheme.fast is not None
    given, shape = checked_out(out), evaluate_shape(mesh)
    full = {name: shape + one for name, one in answers.shapes(scheme, (*wanted, *given)).items()}
    results = targets(full, given, {"points": mesh.points}, _KIND)
    if isinstance(mesh, QuadMesh):
        _evaluate_faces(mesh, scheme, boundary, results)
    else:
        _evaluate_grid(mesh, scheme, boundary, results)
    return results


def stiffness(mesh: QuadMesh | QuadGrid, scheme: Laplacian) -> Any:
    """Stiffness matrix as cupyx.scipy.sparse.csr_matrix."""
    from cupyx.scipy.sparse import csr_matrix

    checked_scheme(scheme)
    stencils = mesh.stencils()
    indptr, others, rows = compiled.row_starts(stencils, scheme)
    if indptr[-1] > np.iinfo(np.int32).max:
        raise ValueError(f"mesh: a matrix of {indptr[-1]} entries is beyond 32-bit indices")
    starts = as_cupy(indptr.astype(np.int32))
    data, indices = _empty(indptr[-1]), _empty(indptr[-1], np.int32)
    ring = as_cupy(stencils.ring) if isinstance(mesh, QuadGrid) else mesh.connectivity.ring_on_device
    sizes = np.int64(stencils.n), np.float64(stencils.coarse)
    _launch("ring_stiffness", stencils.n, stencils.points, ring, starts, *sizes, indices, data)
    if rows is not None:
        place = as_cupy(compiled.row_places(indptr, others, rows))
        data[place], indices[place] = as_cupy(rows.data), as_cupy(rows.indices.astype(np.int32))
    return csr_matrix((data, indices, starts), shape=(stencils.n, len(stencils.points)))


def mass_matrix(areas: Any) -> Any:
    """Diagonal matrix of dual areas as cupyx's."""
    from cupyx.scipy.sparse import diags

    return diags(areas.ravel(), format="csr")


def laplace_beltrami(mesh: QuadMesh | QuadGrid, f: Any, scheme: Laplacian) -> Any:
    """-M^-1 S f, as the verb has it."""
    values, shape = as_cupy(f), evaluate_shape(mesh)
    if values.shape[: len(shape)] != shape or values.ndim > len(shape) + 1:
        raise ValueError(f"f: shape {values.shape}, expected {shape} or {(*shape, 'k')}")
    trail = values.shape[len(shape) :]
    values = values.reshape(-1, *trail).astype(np.float64)
    areas = evaluate(mesh, scheme, ["dual_areas"], "nan")["dual_areas"].ravel()
    result = stiffness(mesh, scheme) @ (values - values[:1])
    result /= -areas.reshape(-1, *[1] * len(trail))
    result[~as_cupy(mesh.stencils().closed)] = np.nan
    result[~(abs(result) < np.inf)] = np.nan
    return result.reshape(*shape, *trail)


def evaluate_shape(mesh: QuadMesh | QuadGrid) -> tuple[int, ...]:
    """Shape of a result."""
    return (len(mesh.points),) if isinstance(mesh, QuadMesh) else mesh.shape


def _evaluate_faces(mesh: QuadMesh, scheme: Laplacian, boundary: str, results: Mapping[str, Any]) -> None:
    n, ring = len(mesh.points), mesh.connectivity.ring_on_device
    _launch("ring_curvatures", n, mesh.points, ring, np.int64(n), *_options(mesh, scheme, results))
    others = mesh.connectivity.irregular
    if others.size:
        vertices, faces = mesh.connectivity.irregular_part
        part = Stencils(
            taken(mesh.points, vertices),
            faces,
            vertices.shape,
            mesh.connectivity.closed[vertices],
            mesh.orientable,
            roundoff=mesh.roundoff,
        )
        inner = {name: np.empty(part.shape + direct.PER_VERTEX[name]) for name in results}
        direct.evaluate(part, closed(part)[0] if boundary == "extrapolate" else part, scheme, inner)
        place = as_cupy(others)
        for name, values in inner.items():
            results[name][place] = as_cupy(values[: others.size])
    if not mesh.orientable and "mean_curvature" in results:
        results["mean_curvature"][...] = abs(results["mean_curvature"])


def _evaluate_grid(grid: QuadGrid, scheme: Laplacian, boundary: str, results: Mapping[str, Any]) -> None:
    from quadcurv.kernels.cuda import HIGH, WIDE

    (r, c), wrap = grid.shape, grid.wrap
    if any(not wraps and size < 2 * _COPIED for wraps, size in zip(wrap, grid.shape, strict=True)):
        whole = QuadGrid(on_host(grid.points), wrap).with_roundoff(grid.roundoff)
        _copy(results, (slice(None), slice(None)), _on_host(whole, scheme, boundary, results))
        return
    number = -(-c // (WIDE * _THREADS)) * _THREADS * -(-r // HIGH)
    sizes = np.int64(r), np.int64(c), np.int32(wrap[0]), np.int32(wrap[1])
    _launch("grid_curvatures", number, grid.points, *sizes, *_options(grid, scheme, results))
    # Sides that are poles come last: strips along others end in a part of the pole.
    poles_copied: list[Callable[[], None]] = []
    for axis, end in ((axis, end) for axis in (0, 1) if not wrap[axis] for end in (0, -1)):
        along = (slice(None),) * axis
        copied, kept = (slice(0, n) if end == 0 else slice(-n, None) for n in (_COPIED, _TAKEN))
        strip_wrap = (wrap[0] and axis != 0, wrap[1] and axis != 1)
        strip = QuadGrid(on_host(grid.points[(*along, copied)]), strip_wrap).with_roundoff(grid.roundoff)
        found = _on_host(strip, scheme, boundary, results)
        at = (*along, kept)
        copy = partial(_copy, results, at, {name: values[at] for name, values in found.items()})
        pole = poles(strip)
        if pole is not None and np.moveaxis(pole, axis, 0)[end].max() >= 0:
            poles_copied.append(copy)
        else:
            copy()
    for copied_last in poles_copied:
        copied_last()


def _on_host(
    grid: QuadGrid, scheme: Laplacian, boundary: str, results: Mapping[str, Any]
) -> dict[str, Floats]:
    """What the host has for a grid in its memory."""
    found = {name: np.empty((*grid.shape, *direct.PER_VERTEX[name])) for name in results}
    compiled.evaluate_grid(grid, scheme, boundary, found)
    return found


def _copy(results: Mapping[str, Any], at: Any, values: Mapping[str, Floats]) -> None:
    for name, array in values.items():
        results[name][at] = as_cupy(np.ascontiguousarray(array))


def _launch(name: str, number: int, *arguments: Any) -> None:
    """Run so many threads of a pass."""
    import cupy

    from quadcurv.kernels import cuda

    # cupy keeps what it has compiled, in memory and on disk, by the source.
    passes = cupy.RawModule(code=cuda.source(), options=cuda.OPTIONS).get_function(name)
    passes((max(1, -(-int(number) // _THREADS)),), (_THREADS,), arguments)


def _options(mesh: QuadMesh | QuadGrid, scheme: Laplacian, results: Mapping[str, Any]) -> list[Any]:
    """How positions are rounded, whether it is Liu's area, and the results in the order of the passes.

    Null where nobody asks.
    """
    assert scheme.fast is not None
    order = ("mean_curvature_normal", "mean_curvature", "vertex_normals", "dual_areas")
    given = np.float64(coarse(mesh.roundoff)), np.int32(scheme.fast.area == "quads")
    return [*given, *(results.get(name, np.uintp(0)) for name in order)]


def _empty(shape: Any, dtype: Any = np.float64) -> Any:
    import cupy

    return cupy.empty(shape, dtype)


def _on_device(array: Any, shape: tuple[int, ...]) -> Any:
    """What passes write to without looking again."""
    if not is_on_device(array):
        return None
    given = as_cupy(array)
    fits = given.shape == shape and given.dtype == np.float64 and given.flags.c_contiguous
    return given if fits else None


def _share(one: Any, other: Any) -> bool:
    import cupy

    return bool(cupy.may_share_memory(one, other))


_KIND = Kind("a C-contiguous float64 array of shape {} on the device", _empty, _on_device, _share)
