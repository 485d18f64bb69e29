"""What runs a scheme on a mesh: `fits`, the choice of `direct` or `compiled`, and the caller's arrays."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Mapping
from typing import TypeGuard

import numpy as np
import scipy

from quadcurv.boundary import checked_boundary, one_rings
from quadcurv.drivers import compiled, direct, fits
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.schemes import Curvatures, Fit, Laplacian
from quadcurv.types import Floats

__all__ = ["fit", "has_holes", "run", "stiffness"]


# The quads of a staggered grid cover it twice, once for its cells and once for their corners: so that the
# dual area of a cell is its area, matrix and areas are twice those of a mesh of these quads.
_CELLS = 2.0
_DOUBLE = 2.0**-53  # unit roundoff


def fit(mesh: Mesh, scheme: Fit, boundary: str = "extrapolate") -> Curvatures:
    """Curvatures by a fit at every vertex of a mesh, in the shape of its results."""
    if has_holes(mesh):
        return fits.each(fits.fit(mesh.to_mesh(), scheme, boundary), mesh.in_shape)
    return fits.fit(mesh, scheme, boundary)


def run(
    mesh: Mesh,
    scheme: Laplacian,
    wanted: Iterable[str],
    boundary: str = "extrapolate",
    out: Mapping[str, Floats] | None = None,
) -> dict[str, Floats]:
    """Results by name (see `direct.PER_VERTEX`), into the arrays of `out` where there are any."""
    checked_boundary(boundary)
    results = _arrays(mesh, wanted, {} if out is None else out)
    if has_holes(mesh):
        for name, values in run(mesh.to_mesh(), scheme, results, boundary).items():
            results[name][...] = mesh.in_shape(values)
    elif scheme.fast is None:
        direct.evaluate(mesh.stencils(), one_rings(mesh, boundary), scheme, results)
    elif isinstance(mesh, QuadMesh):
        compiled.evaluate_faces(mesh, scheme, boundary, results)
    else:
        compiled.evaluate_grid(mesh, scheme, boundary, results)
    if isinstance(mesh, StaggeredGrid) and "dual_areas" in results:
        results["dual_areas"] *= _CELLS
    if mesh.roundoff > _DOUBLE and not has_holes(mesh):
        far = run(_far_away(mesh), scheme, results.keys() - {"dual_areas"}, boundary)
        for name, values in far.items():
            results[name][np.isnan(values)] = np.nan
    return results


def _far_away(mesh: Mesh) -> Mesh:
    """The mesh so far from the origin that its positions are rounded, in double precision, as those given.

    What has no area but for rounding is then NaN by the same test as everywhere.
    """
    moved, arrays = copy.copy(mesh), mesh.arrays()
    size = max(float(np.abs(x).max()) for x in arrays.values())
    far = {name: x + size * mesh.roundoff / _DOUBLE for name, x in arrays.items()}
    moved.__dict__.update(far, roundoff=_DOUBLE)
    return moved


def stiffness(
    mesh: Mesh, scheme: Laplacian, out: scipy.sparse.csr_array | None = None
) -> scipy.sparse.csr_array:
    """Stiffness matrix without ghosts, NaN wherever it is not finite; `out` is for the fast schemes."""
    if scheme.fast is not None:
        matrix = compiled.stiffness(mesh.stencils(), scheme, out)
    elif out is not None:
        raise ValueError(f"out: {scheme.name} assembles a new matrix each time")
    else:
        matrix = direct.without_infinity(scheme.assemble(mesh.stencils())[0])
    if isinstance(mesh, StaggeredGrid):
        matrix.data *= _CELLS
    return matrix


def has_holes(mesh: Mesh) -> TypeGuard[QuadGrid]:
    """Whether points of a grid are masked: it is computed as a face list then."""
    return isinstance(mesh, QuadGrid) and mesh.mask is not None


def _arrays(mesh: Mesh, wanted: Iterable[str], out: Mapping[str, Floats]) -> dict[str, Floats]:
    """The caller's arrays, which kernels will write to without looking again, or new ones."""
    if not isinstance(out, Mapping):
        raise ValueError(f"out: expected a mapping from names to arrays, got {type(out).__name__}")
    shape = (len(mesh.points),) if isinstance(mesh, QuadMesh) else mesh.shape
    results: dict[str, Floats] = {}
    for name in dict.fromkeys((*wanted, *out)):
        if name not in direct.PER_VERTEX:
            raise ValueError(f"wanted: expected some of {', '.join(direct.PER_VERTEX)}, got {name!r}")
        full = shape + direct.PER_VERTEX[name]
        if name not in out:
            results[name] = np.empty(full)
            continue
        array = out[name]
        if (
            type(array) is not np.ndarray
            or array.shape != full
            or array.dtype != np.float64
            or not (array.flags.c_contiguous and array.flags.writeable)
        ):
            raise ValueError(f"out: {name} wants a writeable C-contiguous float64 ndarray of shape {full}")
        for other, taken in (*mesh.arrays().items(), *results.items()):
            if np.may_share_memory(array, taken):
                raise ValueError(f"out: {name} overlaps the memory of {other}")
        results[name] = array
    return results
