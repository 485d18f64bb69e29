"""What can be asked of a block of a grid: results at its vertices, from a window around it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from quadcurv.boundary import SPREAD, one_rings
from quadcurv.drivers import answers, apply, compiled, fits, has_holes, run
from quadcurv.drivers.windows import Window
from quadcurv.mesh import QuadGrid, StaggeredGrid
from quadcurv.mesh.chunked import part
from quadcurv.schemes import Diamond, Fit, Laplacian
from quadcurv.schemes.angle_defect import gaussian_curvature
from quadcurv.stencils import Frame
from quadcurv.types import Floats

Into = Mapping[str, Floats]


@dataclass(frozen=True)
class Task:
    """Something that is asked at every vertex.

    Attributes
    ----------
    shapes : dict
        By name the shape of one vertex's answer.
    reach : int
        Rings of faces that an answer inside rests on.
    write : callable
        (window, boundary, into, *others): write to arrays of the block's shape. With boundary None the sides
        of the window are not to be looked at: what is near them will be replaced.
    others : tuple of array-like
        Functions (r, c) or (r, c, k) that the task reads, too.
    small : bool
        Whether a vertex takes much memory and time, so that blocks are small.
    depth : int
        Rows along open sides whose answers rest on what is beyond the side.
    scaled : bool
        Whether the size of the whole grid's coordinates is asked for.
    """

    shapes: dict[str, tuple[int, ...]]
    reach: int
    write: Callable[..., None]
    others: tuple[Any, ...] = ()
    small: bool = False
    depth: int = 3
    scaled: bool = False


def laplacian(scheme: Laplacian, wanted: Iterable[str]) -> Task:
    """Mean curvatures, normals and areas of a scheme with a stiffness matrix."""
    names = answers.shapes(scheme, wanted)

    def write(window: Window, boundary: str | None, into: Into) -> None:
        grid = window.grid
        inside = boundary is None and isinstance(grid, QuadGrid) and not has_holes(grid)
        if scheme.fast is not None and inside:
            assert isinstance(grid, QuadGrid)
            _pass(window, grid, scheme.fast, into)
            return
        found = {}
        if _has_quads(grid):
            found = run(grid, scheme, names, boundary or "nan")
        _put(window, found, into)

    return Task(names, 1, write, small=scheme.fast is None, depth=SPREAD + 3)


def fit(scheme: Fit, wanted: Iterable[str]) -> Task:
    """Whatever a fit gives."""
    names = answers.shapes(scheme, wanted)
    if scheme.reach is None:
        raise ValueError(
            f"scheme: {scheme.name} looks at all of a grid at once, which is read block by block; "
            "qc.schemes.jet(degree, rings) does not"
        )

    def write(window: Window, boundary: str | None, into: Into) -> None:
        if not _has_quads(window.grid):
            _put(window, {}, into)
            return
        grid = window.grid
        around = fits.MeshNeighbourhoods(grid.to_mesh() if has_holes(grid) else grid, boundary or "nan")
        asked = np.zeros(grid.shape, bool)
        asked[tuple(_wider(inner, scheme.pooled) for inner in window.inner)] = True
        around.wanted = around.wanted & grid.flat(asked)
        if window.size is not None:
            around.rounding = fits.ROUNDING * window.size
        found = fits.fit_around(around, scheme)
        if has_holes(grid):
            found = fits.each(found, grid.in_shape)
        _put(window, {name: answers.FITTED[name][1](found) for name in names}, into)

    return Task(names, scheme.reach, write, small=True, depth=3 + scheme.pooled, scaled=True)


def angle_defect() -> Task:
    """Gaussian curvature by angles."""

    def write(window: Window, boundary: str | None, into: Into) -> None:
        grid = window.grid
        found = {}
        if _has_quads(grid):
            found["gaussian_curvature"] = grid.in_shape(
                gaussian_curvature(one_rings(grid, boundary or "nan"))
            )
        _put(window, found, into)

    return Task({"gaussian_curvature": ()}, 1, write, small=True, depth=SPREAD + 3)


def laplace_beltrami(scheme: Laplacian, f: Any) -> Task:
    """The operator on one or several functions at the vertices."""
    more = tuple(int(n) for n in f.shape[2:])
    lazy = hasattr(f, "__dask_graph__")
    origin = (
        None if lazy else np.asarray(f[:1, :1], np.float64).reshape(1, *more)
    )  # an offset costs no digits

    def write(window: Window, boundary: str | None, into: Into, values: Any) -> None:
        grid, given = window.grid, np.asarray(values, np.float64)
        found = {}
        if _has_quads(grid):
            mesh, at = (grid.to_mesh(), None) if has_holes(grid) else (grid, origin)
            found["laplace_beltrami"] = grid.in_shape(apply(mesh, scheme, grid.flat(given), at))
        _put(window, found, into)

    return Task({"laplace_beltrami": more}, 1, write, (f,), small=True)


def with_holes(task: Task) -> Task:
    """The same where vertices may be at the border of a hole, on whose depth their answers rest."""
    return replace(task, reach=task.reach + BORDER, small=True)


BORDER = 16
"""Rows inward from the border, or along it, that what closes a ring there rests on at most."""


def _wider(inner: slice, rings: int) -> slice:
    return slice(max(inner.start - rings, 0), inner.stop + rings)


def _has_quads(grid: QuadGrid | StaggeredGrid) -> bool:
    """Whether a mask leaves any quad."""
    if isinstance(grid, StaggeredGrid) or grid.mask is None:
        return True
    known = np.pad(~grid.mask, [(0, int(w)) for w in grid.wrap], mode="wrap")
    return bool((known[:-1, :-1] & known[1:, :-1] & known[:-1, 1:] & known[1:, 1:]).any())


def _put(window: Window, found: Mapping[str, Any], into: Into) -> None:
    """Results of a window into arrays of its block; without any, those of vertices without a face."""
    for name, array in into.items():
        if name in found:
            array[...] = found[name][window.inner]
        elif name in ("degree", "rings", "feature"):
            array[...] = 0
        else:
            array[...] = np.nan
            if name == "dual_areas" and isinstance(window.grid, QuadGrid) and window.grid.mask is not None:
                array[~window.grid.mask[window.inner]] = 0


def _pass(window: Window, grid: Any, diamond_of: Diamond, into: Into) -> None:
    inner, around = _surrounded(window, grid)
    compiled.evaluate_rows(inner, diamond_of, "nan", into, around)


def _surrounded(window: Window, grid: QuadGrid) -> tuple[QuadGrid | StaggeredGrid, Frame]:
    """The points of a block and those around it: neighbours, or NaN."""
    x, (rows, columns) = grid.points, window.inner
    r, c = x.shape[:2]
    inner = np.ascontiguousarray(x[rows, columns])
    beyond = np.full((2, inner.shape[1], 3), np.nan)
    for end, i in ((0, rows.start - 1), (1, rows.stop)):
        if grid.wrap[0] or 0 <= i < r:
            beyond[end] = x[i % r, columns]
    closed = grid.wrap[1] and inner.shape[1] == c
    beside = np.full((2, 0 if closed else inner.shape[0] + 2, 3), np.nan)
    if not closed:
        i = np.arange(rows.start - 1, rows.stop + 1)
        known = (i >= 0) & (i < r) | grid.wrap[0]
        for end, j in ((0, columns.start - 1), (1, columns.stop)):
            if grid.wrap[1] or 0 <= j < c:
                beside[end, known] = x[i[known] % r, j % c]
    return part(inner, (False, False), grid.roundoff), Frame(beyond, beside)
