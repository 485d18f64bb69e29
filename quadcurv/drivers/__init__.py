"""What runs a scheme on a mesh: `fits`, the choice of `direct` or `compiled`, and the caller's arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import scipy

from quadcurv.boundary import checked_boundary, stencils
from quadcurv.drivers import compiled, direct
from quadcurv.drivers.fits import fit
from quadcurv.mesh import Mesh, QuadGrid, QuadMesh
from quadcurv.schemes import Laplacian
from quadcurv.types import Floats

__all__ = ["fit", "run", "stiffness"]


def run(
    mesh: Mesh,
    scheme: Laplacian,
    wanted: Iterable[str],
    boundary: str = "extrapolate",
    out: Mapping[str, Floats] | None = None,
) -> dict[str, Floats]:
    """Results by name (see `direct.PER_VERTEX`), into the arrays of `out` where there are any."""
    checked_boundary(boundary)
    results = _arrays(mesh, wanted, out or {})
    if isinstance(mesh, QuadGrid) and mesh.mask is not None:
        found = run(mesh.to_mesh(), scheme, results, boundary)
        for name, values in found.items():
            results[name].fill(np.nan)
            results[name][~mesh.mask] = values
    elif scheme.fast is None:
        direct.evaluate(mesh.stencils(), stencils(mesh, boundary), scheme, results)
    elif isinstance(mesh, QuadMesh):
        compiled.evaluate_faces(mesh, scheme, boundary, results)
    else:
        compiled.evaluate_grid(mesh, scheme, boundary, results)
    return results


def stiffness(
    mesh: Mesh, scheme: Laplacian, out: scipy.sparse.csr_array | None = None
) -> scipy.sparse.csr_array:
    """Stiffness matrix without ghosts, NaN wherever it is not finite; `out` is for the fast schemes."""
    if scheme.fast is not None:
        return compiled.stiffness(mesh.stencils(), scheme, out)
    if out is not None:
        raise ValueError(f"out: {scheme.name} assembles a new matrix each time")
    return direct.without_infinity(scheme.assemble(mesh.stencils())[0])


def _arrays(mesh: Mesh, wanted: Iterable[str], out: Mapping[str, Floats]) -> dict[str, Floats]:
    """The caller's arrays, which kernels will write to without looking again, or new ones."""
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
