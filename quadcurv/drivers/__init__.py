"""What runs a scheme on a mesh: `fits`, the choice of `direct` or `compiled`, and the caller's arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeGuard

import numpy as np
import scipy

from quadcurv.boundary import checked_boundary, one_rings
from quadcurv.drivers import blocks, compiled, device, direct, fits, outliers
from quadcurv.drivers.answers import shapes, telling
from quadcurv.drivers.averages import averaged, checked_radius
from quadcurv.drivers.fits import each
from quadcurv.drivers.targets import IN_MEMORY, checked_out, targets
from quadcurv.mesh import GridBlocks, Mesh, QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.precision import warn_of_rounding
from quadcurv.schemes import Curvatures, Fit, Laplacian, Scheme
from quadcurv.schemes.consistency import NOWHERE, FarOff
from quadcurv.stencils import Stencils
from quadcurv.types import Floats

__all__ = ["apply", "arrays", "averaged", "checked_radius", "each", "fit", "has_holes", "run", "stiffness"]


# The quads of a staggered grid cover it twice, once for its cells and once for their corners: so that the
# dual area of a cell is its area, matrix and areas are twice those of a mesh of these quads.
_CELLS = 2.0


def fit(mesh: Mesh | GridBlocks, scheme: Fit, boundary: str = "extrapolate") -> Curvatures:
    """Curvatures by a fit at every vertex of a mesh, in the shape of its results; of blocks (n,)."""
    if device.holds(mesh):
        device.checked_scheme(scheme)
    if isinstance(mesh, GridBlocks):
        return each(fits.fit(mesh.mesh, scheme, boundary), lambda values: values[: mesh.n])
    if has_holes(mesh):
        return each(fits.fit(mesh.to_mesh(), scheme, boundary), mesh.in_shape)
    return fits.fit(mesh, scheme, boundary)


def run(
    mesh: Mesh | GridBlocks,
    scheme: Laplacian,
    wanted: Iterable[str],
    boundary: str = "extrapolate",
    out: Mapping[str, Floats] | None = None,
    tell: bool = False,
) -> dict[str, Floats]:
    """Results by name (see `direct.PER_VERTEX`), into the arrays of `out` where there are any.

    Where the rounding of positions shows, and where H may be far off for the rings of faces alone, warnings
    say so if it is to `tell`.
    """
    if device.holds(mesh):
        far = NOWHERE
        results = device.evaluate(mesh, scheme, wanted, boundary, out)  # type: ignore[arg-type]
    else:
        checked_boundary(boundary)
        results = arrays(mesh, scheme, wanted, out)
        far = _evaluate(mesh, scheme, boundary, results)
        if _of_cells(mesh) and "dual_areas" in results:
            results["dual_areas"] *= _CELLS
        if tell and scheme.fast is not None and not (isinstance(mesh, GridBlocks) or has_holes(mesh)):
            far = far.joined(outliers.far_off_inside(mesh, scheme, results))
    if tell:
        if (name := telling(results)) is not None:
            warn_of_rounding(mesh, results[name])
        if far.vertices.size:
            far.warn(f"{scheme.name}: H", mesh.shape if isinstance(mesh, QuadGrid) else mesh.stencils().shape)
    return results


def _evaluate(
    mesh: Mesh | GridBlocks, scheme: Laplacian, boundary: str, results: dict[str, Floats]
) -> FarOff:
    """Write results; where H may be far off."""
    if isinstance(mesh, GridBlocks):
        blocks.evaluate(mesh, scheme, boundary, results)
        return NOWHERE
    if has_holes(mesh):
        inner, known = mesh.to_mesh(), np.flatnonzero(~np.asarray(mesh.mask))
        found = arrays(inner, scheme, results)
        far = _evaluate(inner, scheme, boundary, found)
        for name, values in found.items():
            results[name][...] = mesh.in_shape(values)
        return far._replace(vertices=known[far.vertices])
    if scheme.fast is None:
        return direct.evaluate(mesh.stencils(), one_rings(mesh, boundary), scheme, results)
    if isinstance(mesh, QuadMesh):
        return compiled.evaluate_faces(mesh, scheme, boundary, results)
    return compiled.evaluate_grid(mesh, scheme, boundary, results)


def stiffness(
    mesh: Mesh | GridBlocks, scheme: Laplacian, out: scipy.sparse.csr_array | None = None
) -> scipy.sparse.csr_array:
    """Stiffness matrix without ghosts, NaN wherever it is not finite; `out` is for the fast schemes."""
    if device.holds(mesh):
        if out is not None:
            raise ValueError("out: on a device a new matrix is assembled each time")
        return device.stiffness(mesh, scheme)  # type: ignore[arg-type]

    def assembled(stencils: Stencils) -> scipy.sparse.csr_array:
        if scheme.fast is not None:
            return compiled.stiffness(stencils, scheme, out)
        return direct.without_infinity(scheme.assemble(stencils)[0])

    if out is not None and (scheme.fast is None or (isinstance(mesh, GridBlocks) and mesh.of_cells)):
        raise ValueError(f"out: {scheme.name} assembles a new matrix each time")
    if isinstance(mesh, GridBlocks) and mesh.of_cells:
        matrix = blocks.stiffness_of_cells(mesh, assembled)
    else:
        matrix = assembled(mesh.stencils())
    if _of_cells(mesh):
        matrix.data *= _CELLS
    return matrix


def _of_cells(mesh: Mesh | GridBlocks) -> bool:
    return isinstance(mesh, StaggeredGrid) or (isinstance(mesh, GridBlocks) and mesh.of_cells)


def apply(mesh: Mesh | GridBlocks, scheme: Laplacian, values: Floats, origin: Floats | None = None) -> Floats:
    """(n, ...) Laplace-Beltrami operator of functions (p, ...) less `origin`, else their first value."""
    stencils = mesh.stencils()
    areas = run(mesh, scheme, ["dual_areas"], "nan")["dual_areas"]
    result = stiffness(mesh, scheme) @ (values - (values[:1] if origin is None else origin))
    with np.errstate(divide="ignore", invalid="ignore"):
        result /= -areas.reshape(-1, *[1] * (values.ndim - 1))
    result[~stencils.closed] = np.nan
    result[~np.isfinite(result)] = np.nan
    return result


def has_holes(mesh: Mesh | GridBlocks) -> TypeGuard[QuadGrid]:
    """Whether points of a grid are masked: it is computed as a face list then."""
    return isinstance(mesh, QuadGrid) and mesh.mask is not None


def arrays(
    mesh: Mesh | GridBlocks, scheme: Scheme, wanted: Iterable[str], out: Mapping[str, Floats] | None = None
) -> dict[str, Floats]:
    """The caller's arrays, which kernels will write to without looking again, or new ones."""
    out = checked_out(out)
    if isinstance(mesh, GridBlocks) and out:
        raise ValueError("out: blocks have an array each, which are new ones")
    shape = (len(mesh.points),) if isinstance(mesh, QuadMesh) else mesh.shape
    full = {name: shape + one for name, one in shapes(scheme, (*wanted, *out)).items()}
    return targets(full, out, {} if isinstance(mesh, GridBlocks) else mesh.arrays(), IN_MEMORY)
