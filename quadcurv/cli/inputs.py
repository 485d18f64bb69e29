"""A file as the mesh that is computed with: read, joined, closed along its seams, oriented."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.cli.options import MeshOptions
from quadcurv.cli.say import say
from quadcurv.io.base import SAME_PLACE, STORES
from quadcurv.io.meshes import PartsError, opened
from quadcurv.io.seams import closed_grid
from quadcurv.mesh import QuadGrid, QuadMesh
from quadcurv.repair import duplicate_points, merge_points, orient
from quadcurv.types import Indices, MeshError


@dataclass(frozen=True)
class Input:
    """A mesh to compute with, and what the file held.

    Attributes
    ----------
    mesh : QuadMesh or QuadGrid
    given : QuadMesh or QuadGrid
        To write: with the vertices of the file.
    place : (n,) int64 or None
        The vertex of `mesh` that each of `given` went to, None where they are the same.
    """

    mesh: QuadMesh | QuadGrid
    given: QuadMesh | QuadGrid
    place: Indices | None = None

    def on_given(self, values: NDArray[Any]) -> NDArray[Any]:
        """Values of the mesh at the vertices of the file, in the shape of its results."""
        if self.place is None:
            return values
        n_axes = 2 if isinstance(self.mesh, QuadGrid) else 1
        flat = values.reshape(-1, *values.shape[n_axes:])[self.place]
        return flat.reshape(*self.given.shape, *flat.shape[1:]) if isinstance(self.given, QuadGrid) else flat


def load(path: Path, options: MeshOptions) -> Input:
    """Read a file and do what the options ask for, saying what was done to it.

    Raises
    ------
    MeshError, OSError
        As :func:`quadcurv.read`; a scene of several shapes that are not to be joined.
    """
    mesh = _read(path, options)
    given, place = mesh, None
    if options.merge is not False:
        mesh, place = _closed(mesh, options)
    if options.orient:
        mesh = orient(mesh)
        given = mesh if place is None else given
        if place is not None:  # faces as computed with need the vertices that they have there
            given, place = mesh, None
    return Input(mesh, given, place)


def _read(path: Path, options: MeshOptions) -> Any:
    store = STORES.get(path.suffix.lower())
    if store is not None:
        return QuadGrid(np.asarray(store.open(path)[...]), options.wraps or (False, False))
    try:
        return opened(path, wrap=options.wraps, seams=False)
    except PartsError as error:
        if not options.join:
            raise MeshError(f"{path}: a scene of {error.count} shapes, which --join joins") from None
        say(f"{path}: {error.count} shapes joined")
        return opened(path, wrap=options.wraps, seams=False, join=True)


def _closed(mesh: Any, options: MeshOptions) -> tuple[Any, Indices | None]:
    """The mesh without its seams, and where its vertices went; None where nothing was done."""
    if isinstance(mesh, QuadGrid):
        return _wrapped(mesh, options)
    extent = float(np.ptp(mesh.points, axis=0).max())
    asked = isinstance(options.merge, float | int) and not isinstance(options.merge, bool)
    tolerance = float(options.merge) if asked else SAME_PLACE * extent  # type: ignore[arg-type]
    if options.merge is None and not _has_seam(mesh, tolerance):
        return mesh, None
    merged, place = merge_points(mesh, tolerance)
    lost = len(mesh.points) - len(merged.points)
    if not lost:
        return mesh, None
    hint = "; --no-merge keeps them apart" if options.merge is None else ""
    say(f"{lost} vertices merged with others at the same place, to {tolerance:.2g}{hint}")
    return merged, place


def _has_seam(mesh: QuadMesh, tolerance: float) -> bool:
    """Whether vertices of open rings lie at the same place."""
    stencils = mesh.stencils()
    rim = ~stencils.closed & (stencils.valence > 0)
    if not rim.any():
        return False
    first = duplicate_points(mesh, tolerance)[rim]
    return len(np.unique(first)) < len(first)


def _wrapped(grid: QuadGrid, options: MeshOptions) -> tuple[QuadGrid, Indices | None]:
    """The grid closed where its first and last row, or column, are the same."""
    if options.wrap is not None:
        return grid, None
    found = []
    for axis in (0, 1):
        try:
            closed_grid(grid.points, (axis == 0, axis == 1), seams=False)
            found.append(grid.shape[axis] > 3)
        except MeshError:
            found.append(False)
    if not any(found):
        return grid, None
    closed = closed_grid(grid.points, found, seams=False)
    names = " and ".join(name for name, wraps in zip(("rows", "columns"), found, strict=True) if wraps)
    say(f"first and last {names} of the grid coincide: closed there; --no-merge keeps it open")
    index = np.arange(closed.shape[0] * closed.shape[1]).reshape(closed.shape)
    return closed, np.pad(index, [(0, int(w)) for w in found], mode="wrap").ravel()
