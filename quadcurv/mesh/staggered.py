"""A grid of cell centres and cell corners, as finite-volume codes have."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv.checks import Report, checked_points, checked_wrap, refuse_on_device, unit_roundoff
from quadcurv.mesh.face_list import summary_table
from quadcurv.mesh.grid import refuse_repetition
from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Ints, MeshError

_SEAM = 1e-9  # of the extent: nearer than that two rows are one


@dataclass(frozen=True, eq=False, init=False, repr=False)
class StaggeredGrid:
    """A grid of primal points (cell centres) and dual points (cell corners), as finite-volume codes have.

    The stencil is that of the thesis's Figures 3.1 and 4.1: around a primal point its four dual corners
    are the edge neighbours a, b and the four primal neighbours the vertices d across.

    Parameters
    ----------
    primal : (r, c, 3) or (r + 2, c + 2, 3) array_like of float
        Cell centres, without or with one layer of ghost cells around; the four corner ghosts are not read.
    dual : (r + 1, c + 1, 3) array_like of float
        Cell corners; dual[i, j] comes before primal[i, j] in both directions.
    wrap : (bool, bool)
        Whether the last row (column) of cells is followed by the first; only without ghost cells.
        The last row (column) of dual then repeats the first.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes, non-finite points, or a seam that does not meet.

    Examples
    --------
    >>> import quadcurv as qc
    >>> cells, _, _ = qc.surfaces.cylinder().sample((16, 8), "staggered")
    >>> cells
    StaggeredGrid(16 x 8 cells, wrap=(False, False))
    >>> qc.mean_curvature(cells, "finite_volume").round(12).max().item()
    0.5
    """

    primal: Floats
    dual: Floats
    wrap: tuple[bool, bool]
    shape: tuple[int, int]
    roundoff: float

    def __init__(self, primal: ArrayLike, dual: ArrayLike, wrap: Sequence[bool] = (False, False)) -> None:
        refuse_on_device(primal, "primal")
        refuse_on_device(dual, "dual")
        self.__dict__.update(
            wrap=checked_wrap(wrap),
            dual=checked_points(dual, "dual", ("r + 1", "c + 1", 3)),
            roundoff=max(unit_roundoff(primal), unit_roundoff(dual)),
        )
        r, c = (self.dual.shape[0] - 1, self.dual.shape[1] - 1)
        self.__dict__.update(primal=checked_points(primal, "primal", ("r", "c", 3)), shape=(r, c))
        if r < 1 or c < 1 or self.primal.shape[:2] not in ((r, c), (r + 2, c + 2)):
            raise MeshError(
                f"primal: shape {self.primal.shape} does not fit dual of shape {self.dual.shape}; "
                f"expected {(r, c, 3)}, or {(r + 2, c + 2, 3)} with ghost cells"
            )
        if self.primal.shape[:2] == (r + 2, c + 2) and any(self.wrap):
            raise MeshError("wrap: primal has ghost cells already, so no side is left to wrap")
        if self.primal.shape[:2] == (1, 1):
            raise MeshError("primal: a single cell needs ghost cells around it")
        for axis, name in enumerate(("rows", "columns")):
            if not self.wrap[axis]:
                continue
            if self.shape[axis] < 3:
                raise MeshError(f"primal: {self.shape[axis]} {name}, at least 3 are needed to wrap")
            refuse_repetition(self.primal, axis, name, "primal")
            gap = np.abs(self.dual.take(0, axis) - self.dual.take(-1, axis)).max()
            if gap > _SEAM * np.ptp(self.dual.reshape(-1, 3), axis=0).max():
                raise MeshError(f"dual: first and last {name} differ by {gap:.3g} although they wrap")

    def __repr__(self) -> str:
        return f"StaggeredGrid({self.shape[0]} x {self.shape[1]} cells, wrap={self.wrap})"

    def _repr_html_(self) -> str:
        return summary_table(repr(self), self.dual, self.report)

    @property
    def report(self) -> Report:
        """Nothing is ever mended in a staggered grid."""
        return Report(())

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results."""
        return values.reshape(*self.shape, *values.shape[1:])

    def flat(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values in the shape of results as (n, ...): what :meth:`in_shape` takes."""
        return values.reshape(-1, *values.shape[2:])

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"primal": self.primal, "dual": self.dual}

    def side(self, axis: int, end: int) -> StaggeredGrid:
        """Return the two rows (axis 0) or columns (1) at the first (end 0) or last (-1) open side."""
        size = self.shape[axis]
        kept = range(min(2, size)) if end == 0 else range(max(0, size - 2), size)
        corners = range(kept.start, kept.stop + 1)
        wrap = [w and i != axis for i, w in enumerate(self.wrap)]
        side = StaggeredGrid(self.primal.take(kept, axis), self.dual.take(corners, axis), wrap)
        side.__dict__.update(roundoff=self.roundoff)
        return side

    @property
    def has_ghosts(self) -> bool:
        """Whether primal carries a layer of ghost cells."""
        return self.primal.shape[:2] != self.shape

    @classmethod
    def from_mapping(
        cls,
        mapping: Callable[[Floats, Floats], ArrayLike],
        xi: ArrayLike,
        eta: ArrayLike,
    ) -> StaggeredGrid:
        """Sample a surface at cell corners and, midway between them, at cell centres.

        Parameters
        ----------
        mapping : callable
            (xi, eta) -> (..., 3), broadcasting.
        xi, eta : (r + 3,), (c + 3,) array_like of float
            Coordinates of the dual points, one ghost cell on each side included.
        """
        xi, eta = np.asarray(xi, float), np.asarray(eta, float)
        for name, t in (("xi", xi), ("eta", eta)):
            if t.ndim != 1 or t.size < 4:
                raise MeshError(f"{name}: shape {t.shape}, expected (cells + 3,)")
        centre_xi, centre_eta = (xi[1:] + xi[:-1]) / 2, (eta[1:] + eta[:-1]) / 2
        return cls(
            mapping(centre_xi[:, None], centre_eta[None, :]),
            mapping(xi[1:-1, None], eta[None, 1:-1]),
        )

    def stencils(self) -> Stencils:
        """Stencils of the cells as given; without ghost cells rings at open sides stay open."""
        r, c = self.shape
        index = np.full((r + 2, c + 2), -1, np.int32)
        index[1:-1, 1:-1] = np.arange(r * c).reshape(r, c)
        if self.has_ghosts:
            index[index < 0] = np.arange(r * c, index.size)
            ring = index >= r * c
            return self.diamonds(index, self.primal[ring])
        if self.wrap[0]:
            index[[0, -1]] = index[[-2, 1]]
        if self.wrap[1]:
            index[:, [0, -1]] = index[:, [-2, 1]]
        return self.diamonds(index, np.empty((0, 3)))

    def diamonds(self, index: Ints, ghosts: Floats) -> Stencils:
        """Stencils of the quads (primal, dual, primal, dual) across the edges of the cells.

        Parameters
        ----------
        index : (r + 2, c + 2) int32
            Indices of the cells with one layer around: row by row, from r c on ghosts, -1 for none.
        ghosts : (g, 3) float64
            Centres of the ghost cells.

        Notes
        -----
        Across edges of the first direction the quads begin at a primal point, across those of the second
        at a dual point, so that one choice of diagonal keeps two primal neighbours of each cell.
        """
        r, c = self.shape
        centres = self.primal[1:-1, 1:-1] if self.has_ghosts else self.primal
        dual = np.arange((r + 1) * (c + 1), dtype=np.int32).reshape(r + 1, c + 1)
        dual += r * c + len(ghosts)
        if self.wrap[0]:
            dual[-1] = dual[0]
        if self.wrap[1]:
            dual[:, -1] = dual[:, 0]
        p, q = index[:, 1:-1], index[1:-1]
        first = np.stack((p[:-1], dual[:, :-1], p[1:], dual[:, 1:]), axis=-1)
        second = np.stack((dual[1:], q[:, 1:], dual[:-1], q[:, :-1]), axis=-1)
        # Where the grid wraps the first and the last edge are the same.
        first = first[int(self.wrap[0]) :].reshape(-1, 4)
        second = second[:, int(self.wrap[1]) :].reshape(-1, 4)
        faces = np.concatenate((first, second))
        around = np.stack((p[:-2], p[2:], q[:, :-2], q[:, 2:]))
        return Stencils(
            np.concatenate((centres.reshape(-1, 3), ghosts, self.dual.reshape(-1, 3))),
            np.ascontiguousarray(faces[(faces >= 0).all(axis=1)]),
            self.shape,
            (around >= 0).all(axis=0).ravel(),
            roundoff=self.roundoff,
        )
