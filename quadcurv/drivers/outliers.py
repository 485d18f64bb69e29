"""Regular vertices of compiled passes, which do not look at the shape of faces: those whose H stands out."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from quadcurv.boundary import part_around
from quadcurv.drivers.answers import telling
from quadcurv.mesh import Mesh, QuadGrid
from quadcurv.precision import rounding_error, some, typical
from quadcurv.schemes import Laplacian
from quadcurv.schemes.consistency import NOWHERE, FarOff, around, far_off
from quadcurv.types import Floats

_VALUES = 2**14  # of H, by which it is seen whether any stand out: all would take a fifth of a pass
_OUTSTANDING = 6.0  # times what H is about, or 1 / extent: those are looked at that are more


def far_off_inside(mesh: Mesh, scheme: Laplacian, results: Mapping[str, Floats]) -> FarOff:
    """Where H may be far off, among those that are much larger than most."""
    name = telling(results)
    if name is None:
        return NOWHERE
    H, extent = results[name], rounding_error(mesh)[1]
    most = np.fmax.reduce(np.abs(some(H, _VALUES)), initial=0.0)  # NaN is passed over
    if most * extent < _OUTSTANDING or not extent > 0:
        return NOWHERE
    H = np.abs(H.reshape(-1) if name == "mean_curvature" else np.abs(H.reshape(-1, 3)).max(axis=1))
    with np.errstate(invalid="ignore"):
        vertices = np.flatnonzero(_OUTSTANDING * typical(H, extent) < H)
    if not vertices.size:
        return NOWHERE
    if isinstance(mesh, QuadGrid):
        stencils, n = part_around(mesh, vertices, 1)[1], vertices.size
    else:
        whole = mesh.stencils()
        vertices = vertices[whole.closed[vertices]]
        stencils, n = around(whole, vertices), vertices.size
    found, off = far_off(stencils, scheme)
    inside = found < n
    return FarOff(vertices[found[inside]], off[inside])
