"""Errors of the mean curvature without an exact answer: between operators, and between grids."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadcurv.curvature import mean_curvature
from quadcurv.io import as_mesh
from quadcurv.mesh import QuadGrid
from quadcurv.schemes import Scheme, as_scheme
from quadcurv.types import Floats


def disagreement(
    mesh: Any,
    scheme: str | Scheme,
    reference: str | Scheme = "jet",
    boundary: str = "extrapolate",
) -> Floats:
    """Estimate the error of a scheme by its difference to a better one.

    Parameters
    ----------
    mesh, scheme, boundary
        As for :func:`quadcurv.mean_curvature`.
    reference : str, Scheme or Fit
        A scheme whose own error is small beside that of `scheme`: of a higher order on a smooth mesh, or
        consistent on an irregular or a noisy one.

    Returns
    -------
    (n,) or (r, c) float64
        H - H_reference, in 1 / length, the sign that of H - exact. NaN where either is.

    Raises
    ------
    ValueError
        As for :func:`quadcurv.mean_curvature`; the reference is the scheme itself.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> from quadcurv.estimate import disagreement
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((12, 12), "faces")
    >>> error = qc.mean_curvature(ball, "liu") - 1
    >>> bool(np.abs(disagreement(ball, "liu") - error).max() < 0.2 * np.abs(error).max())
    True
    """
    scheme, reference = as_scheme(scheme), as_scheme(reference)
    if scheme.name == reference.name:
        raise ValueError(f"reference: expected another scheme than {scheme.name}")
    mesh = as_mesh(mesh)
    return mean_curvature(mesh, scheme, boundary) - mean_curvature(mesh, reference, boundary)


def richardson(
    grid: QuadGrid,
    scheme: str | Scheme,
    order: float | None = None,
    boundary: str = "extrapolate",
) -> Floats:
    """Estimate the error of a scheme on a grid by its change when every second vertex is left out.

    An error of C h^p is 2^p C h^p on the coarse grid, so that it is the difference between the two, over
    2^p - 1. At vertices that the coarse grid does not have, the mean of the estimates of the nearest that it
    has. Subtracting it from H raises the order at the vertices of the coarse grid.

    Parameters
    ----------
    grid : QuadGrid
        Sampled evenly from smooth coordinates: the estimate means nothing on a jittered or noisy grid.
    scheme, boundary
        As for :func:`quadcurv.mean_curvature`.
    order : float, optional
        p, by default the scheme's own.

    Returns
    -------
    (r, c) float64
        Estimate of H - exact, in 1 / length. NaN where either H is.

    Raises
    ------
    ValueError
        Not a QuadGrid; an odd number of vertices in a direction that wraps, or an even one in one that
        does not (the coarse grid would end elsewhere); no positive order; as for
        :func:`quadcurv.mean_curvature` on the coarse grid.

    References
    ----------
    L. F. Richardson (1911), The approximate arithmetical solution by finite differences of physical
    problems, Philosophical Transactions of the Royal Society A 210, 307-357.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> from quadcurv.estimate import richardson
    >>> torus = qc.surfaces.torus()
    >>> grid, xi, eta = torus.sample((32, 32))
    >>> error = qc.mean_curvature(grid, "liu") - torus.mean_curvature(xi, eta)
    >>> bool(np.abs(richardson(grid, "liu") - error).max() < 0.2 * np.abs(error).max())
    True
    """
    scheme = as_scheme(scheme)
    if not isinstance(grid, QuadGrid):
        raise ValueError(f"grid: expected a QuadGrid, got {type(grid).__name__}")
    p = scheme.order if order is None else order
    if not isinstance(p, float | int | np.number) or not 0 < p < np.inf:
        raise ValueError(f"order: expected a positive number, got {p!r} ({scheme.name})")
    for size, wraps, name in zip(grid.shape, grid.wrap, ("rows", "columns"), strict=True):
        if size % 2 == wraps:
            kind, need = ("wrap", "even") if wraps else ("do not wrap", "odd")
            raise ValueError(
                f"grid: {size} {name} that {kind}, an {need} number is needed to take every second"
            )
    mask = None if grid.mask is None else grid.mask[::2, ::2]
    fine = mean_curvature(grid, scheme, boundary)
    coarse = mean_curvature(QuadGrid(grid.points[::2, ::2], grid.wrap, mask), scheme, boundary)
    estimate = (coarse - fine[::2, ::2]) / (2**p - 1)
    for axis, wraps in enumerate(grid.wrap):
        following = np.roll(estimate, -1, axis)
        between = np.stack((estimate, (estimate + following) / 2), axis=axis + 1)
        size = between.shape[axis] * 2 - (0 if wraps else 1)
        estimate = between.reshape(*estimate.shape[:axis], -1, *estimate.shape[axis + 1 :]).take(
            range(size), axis
        )
    return np.where(np.isnan(fine), np.nan, estimate)
