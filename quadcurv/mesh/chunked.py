"""A grid whose points stay where they are, on disk or in a graph of tasks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from quadcurv.checks import Report, checked_wrap, refuse_on_device, unit_roundoff
from quadcurv.mesh.grid import QuadGrid
from quadcurv.mesh.staggered import StaggeredGrid
from quadcurv.types import Bools, Floats, MeshError

Label = Callable[[Any, str], Any]
"""Makes a labelled array of the result of that name."""


@dataclass(frozen=True, eq=False, init=False, repr=False)
class ChunkedGrid:
    """A logically Cartesian grid that is read and computed block by block.

    Nothing is read before a verb is asked. What a verb then gives is what it gives of a :class:`QuadGrid`
    (with `dual`, a :class:`StaggeredGrid`) of the same points.

    Parameters
    ----------
    points : (r, c, 3) array-like
        Anything with ``shape``, ``dtype`` and slices: a ``numpy.memmap``, a zarr array, a dataset of h5py;
        of a dask array results are dask arrays, computed when these are. Of a staggered grid the cell
        centres, (r + 2, c + 2, 3) with ghost cells. Dimensions before these three are kept: each of their
        entries is a grid.
    wrap : (bool, bool)
        As of :class:`QuadGrid`.
    mask : (r, c) array-like of bool, or "nan", optional
        True where there is no point; "nan": where a coordinate is NaN.
    dual : (r + 1, c + 1, 3) array-like, optional
        Cell corners of a staggered grid.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes or types. What is wrong with the points is found, with its place, when they
        are read.

    See Also
    --------
    quadcurv.from_xarray : The same of a DataArray, with labelled results.
    quadcurv.evaluate : Results into arrays on disk.

    Examples
    --------
    >>> import numpy as np, quadcurv as qc
    >>> from tempfile import NamedTemporaryFile
    >>> ball = qc.surfaces.torus().sample((64, 32))[0]
    >>> with NamedTemporaryFile(suffix=".npy") as file:
    ...     np.save(file.name, ball.points)
    ...     grid = qc.ChunkedGrid(np.load(file.name, mmap_mode="r"), ball.wrap)
    ...     H = qc.mean_curvature(grid, "liu")
    >>> bool((H == qc.mean_curvature(ball, "liu")).all())
    True
    """

    points: Any
    wrap: tuple[bool, bool]
    mask: Any
    dual: Any
    shape: tuple[int, int]
    roundoff: float
    label: Label | None

    def __init__(
        self,
        points: Any,
        wrap: Sequence[bool] = (False, False),
        mask: Any = None,
        dual: Any = None,
    ) -> None:
        _check_array(points, "points", ("...", "r", "c", 3))
        if points.dtype.kind not in "fiu":
            raise MeshError(f"points: expected real numbers, got dtype {points.dtype}")
        r, c = (int(size) for size in points.shape[-3:-1])
        if dual is not None:
            _check_array(dual, "dual", ("...", "r + 1", "c + 1", 3))
            p, (r, c) = (r, c), (int(size) - 1 for size in dual.shape[-3:-1])
            if p not in ((r, c), (r + 2, c + 2)) or points.shape[:-3] != dual.shape[:-3]:
                raise MeshError(
                    f"points: shape {tuple(points.shape)} does not fit dual of shape {tuple(dual.shape)}; "
                    f"expected {(r, c, 3)}, or {(r + 2, c + 2, 3)} with ghost cells"
                )
            if mask is not None:
                raise MeshError("mask: a staggered grid has none")
        wraps = checked_wrap(wrap)
        if mask is not None and not (isinstance(mask, str) and mask == "nan"):
            _check_array(mask, "mask", ("...", "r", "c"))
            if tuple(mask.shape[-2:]) != (r, c) or mask.dtype != bool:
                raise MeshError(
                    f"mask: expected booleans of shape {(r, c)}, got {mask.dtype} of {tuple(mask.shape)}"
                )
        roundoff = max(unit_roundoff(points), 0.0 if dual is None else unit_roundoff(dual))
        self.__dict__.update(points=points, wrap=wraps, mask=mask, dual=dual, shape=(r, c))
        self.__dict__.update(roundoff=roundoff, label=None)
        for axis, name in enumerate(("rows", "columns")):
            least = 3 if wraps[axis] else 2 if dual is None else 1
            if self.shape[axis] < least:
                raise MeshError(f"points: {self.shape[axis]} {name}, at least {least} are needed")
        if self.has_ghosts and any(wraps):
            raise MeshError("wrap: points have ghost cells already, so no side is left to wrap")

    def __repr__(self) -> str:
        kind = "points" if self.dual is None else "cells"
        lead = "".join(f"{n} times " for n in self.points.shape[:-3])
        of = f"{type(self.points).__module__.partition('.')[0]}.{type(self.points).__name__}"
        return f"ChunkedGrid({lead}{self.shape[0]} x {self.shape[1]} {kind} of a {of}, wrap={self.wrap})"

    @property
    def has_ghosts(self) -> bool:
        """Whether cells come with a layer of ghost cells."""
        return self.dual is not None and tuple(self.points.shape[-3:-1]) != self.shape

    @property
    def is_lazy(self) -> bool:
        """Whether points are a dask array: results are one too then."""
        return hasattr(self.points, "__dask_graph__")

    @property
    def report(self) -> Report:
        """Nothing is known of points that have not been read."""
        return Report(())

    def replaced(self, **given: Any) -> ChunkedGrid:
        """Return the same with other attributes, which are not checked."""
        other = object.__new__(ChunkedGrid)
        other.__dict__.update({**self.__dict__, **given})
        return other


def part(
    points: Floats,
    wrap: tuple[bool, bool],
    roundoff: float,
    mask: Bools | None = None,
    dual: Floats | None = None,
) -> QuadGrid | StaggeredGrid:
    """A part of a larger grid, of arrays that have been checked."""
    grid: Any
    if dual is None:
        grid = object.__new__(QuadGrid)
        grid.__dict__.update(points=points, wrap=wrap, mask=mask, roundoff=roundoff, report=Report(()))
    else:
        grid = object.__new__(StaggeredGrid)
        shape = dual.shape[0] - 1, dual.shape[1] - 1
        grid.__dict__.update(primal=points, dual=dual, wrap=wrap, shape=shape, roundoff=roundoff)
    made: QuadGrid | StaggeredGrid = grid
    return made


def _check_array(array: Any, name: str, shape: tuple[Any, ...]) -> None:
    """Refuse what has no shape and dtype of its own, or another shape than that after `shape`'s dots."""
    if not (hasattr(array, "shape") and hasattr(array, "dtype") and hasattr(array, "__getitem__")):
        raise MeshError(f"{name}: expected an array with shape, dtype and slices, got {type(array).__name__}")
    refuse_on_device(array, name)
    if isinstance(array, np.ma.MaskedArray):
        raise MeshError(f"{name}: a masked array; give its data, and its mask as mask=")
    given, wanted = tuple(array.shape), shape[1:]
    if any(size != size for size in given):  # dask's for what it does not know
        raise MeshError(f"{name}: of unknown size, {given}; its compute_chunk_sizes() finds out")
    if len(given) < len(wanted) or any(
        isinstance(w, int) and have != w for have, w in zip(given[-len(wanted) :], wanted, strict=True)
    ):
        raise MeshError(f"{name}: shape {given}, expected ({', '.join(map(str, shape))})")
