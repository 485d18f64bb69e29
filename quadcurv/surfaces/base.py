"""Parametrised surfaces: what one knows, how it is sampled, and how one is made of a mapping."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import ArrayLike
from scipy.spatial import cKDTree

from quadcurv.mesh import QuadGrid, QuadMesh, StaggeredGrid
from quadcurv.stencils import grid_faces
from quadcurv.surfaces.differentiation import Jet, curvatures_of
from quadcurv.types import Floats

Field = Callable[[ArrayLike, ArrayLike], Floats]
Formula = Callable[[Any, Any], Any]

CIRCLE = (-np.pi, np.pi)
HUTCHINS = (
    "J. T. Hutchins, Computing curvature and curvature normals on smooth logically Cartesian "
    "surface meshes, MSc thesis, Boise State University, 2013"
)
DO_CARMO = "M. P. do Carmo, Differential Geometry of Curves and Surfaces, Prentice-Hall, 1976"


@dataclass(frozen=True)
class Surface:
    """A parametrised surface X(xi, eta) with exact curvature.

    The orientation is that of X_xi x X_eta. Another part of the same surface is
    ``dataclasses.replace(surface, domain=...)``; a surface of one's own is `Surface.from_mapping`.

    Attributes
    ----------
    name : str
        Its key in `SURFACES`, or what its maker calls it.
    mapping : callable
        ``mapping(xi, eta)``: positions, shape (..., 3), float64; broadcasts. Defined some cells
        beyond the domain too, where ghost cells are sampled.
    mean_curvature : callable
        ``mean_curvature(xi, eta)``: signed mean curvature in 1/length, shape (...), + for a sphere
        oriented outward.
    gaussian_curvature : callable
        ``gaussian_curvature(xi, eta)``: Gaussian curvature in 1/length**2, shape (...).
    domain : tuple
        ``((xi0, xi1), (eta0, eta1))``: the parameters of the surface, or of each of its panels.
    wrap : tuple of bool
        Whether the mapping is periodic in xi, eta with the length of the domain as the period.
    reference : str
        Where the parametrisation or its curvature is published.
    panels : tuple of float, default (0.0,)
        Offsets in xi, one a panel: panel p is the image of the domain shifted by ``panels[p]``, its
        ends included, and the surface is the union of its panels. Panels meet in space, not in xi:
        a panel is continued smoothly beyond its own edges, by half its width, so that both its ends
        and its ghost cells have a position of their own. One panel, not shifted, save for the cubed
        surfaces.
    singular_points : tuple of (float, float), default ()
        Parameters (xi, eta) of the domain where X_xi x X_eta vanishes. The curvature returned there
        is the limit, infinities included.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball = qc.surfaces.sphere(radius=2.0)
    >>> float(ball.mean_curvature(0.3, 0.2)), ball.mapping(0.3, 0.2).shape
    (0.5, (3,))
    """

    name: str
    mapping: Field
    mean_curvature: Field
    gaussian_curvature: Field
    domain: tuple[tuple[float, float], tuple[float, float]]
    wrap: tuple[bool, bool]
    reference: str
    panels: tuple[float, ...] = (0.0,)
    singular_points: tuple[tuple[float, float], ...] = ()

    @classmethod
    def from_mapping(
        cls,
        f: Formula,
        domain: tuple[tuple[float, float], tuple[float, float]],
        wrap: tuple[bool, bool] = (False, False),
        name: str = "surface",
    ) -> Surface:
        """Surface of a mapping of one's own, with exact curvature by automatic differentiation.

        Parameters
        ----------
        f : callable
            ``f(u, v) -> (x, y, z)`` for float64 arrays u and v of one shape, made of arithmetic and
            numpy's elementwise functions (``np.cos`` and the like, ``np.where``); components may be
            numbers. One array of shape (..., 3) or (3, ...) is taken too.
        domain : ((float, float), (float, float))
            First and last u, first and last v.
        wrap : (bool, bool), default (False, False)
            Whether f is periodic in u, v with the length of the domain as the period.
        name : str, default "surface"

        Returns
        -------
        Surface
            Its curvature is exact to rounding, and NaN where X_u x X_v vanishes. Of a mapping in pieces
            (``np.where``) each piece's own.

        Raises
        ------
        TypeError
            f uses a function that has no derivative here, which is named.
        ValueError
            The domain is not two increasing, finite intervals; f does not give three components, is
            not finite at the middle of the domain, or is not periodic where it is said to be.

        Examples
        --------
        >>> import numpy as np
        >>> bump = Surface.from_mapping(lambda u, v: (u, v, np.exp(-u**2 - v**2)), ((-2, 2), (-2, 2)))
        >>> float(bump.mean_curvature(0, 0))
        2.0
        """
        corner, opposite = _corners(domain)
        middle = (corner + opposite) / 2
        # Two by four values: 3 can be the number of components only.
        probe = f(np.full((2, 4), middle[0]), np.full((2, 4), middle[1]))
        leading = isinstance(probe, np.ndarray) and probe.shape[:1] == (3,)

        def split(u: Any, v: Any) -> tuple[Any, ...]:
            found = f(u, v)
            if isinstance(found, np.ndarray) and not leading and found.dtype != object:
                found = np.moveaxis(found, -1, 0)
            parts = tuple(found)
            if len(parts) != 3:
                raise ValueError(f"f: a position has three components (x, y, z), got {len(parts)}")
            return parts

        surface = cls(
            name,
            positions(split),
            lambda u, v: curvatures_of(split, u, v)[0],
            lambda u, v: curvatures_of(split, u, v)[1],
            ((float(corner[0]), float(opposite[0])), (float(corner[1]), float(opposite[1]))),
            (bool(wrap[0]), bool(wrap[1])),
            "automatic differentiation",
        )
        if not np.isfinite(surface.mapping(*middle)).all():
            raise ValueError(f"f: not finite at the middle of the domain, {tuple(middle.tolist())}")
        surface.mean_curvature(*middle)  # here a function without a derivative is refused
        for axis in np.flatnonzero(wrap):
            u, v = corner[:, None] + (opposite - corner)[:, None] * np.linspace(0.1, 0.9, 5)
            ends = [[u, v], [u, v]]
            ends[0][axis], ends[1][axis] = corner[axis], opposite[axis]
            first, last = (surface.mapping(*end) for end in ends)
            if not np.allclose(first, last, rtol=0, atol=1e-9 * np.ptp(first, axis=0).max()):
                raise ValueError(f"wrap: f is not periodic in {'uv'[axis]}, its ends lie apart")
        return surface

    def principal_curvatures(self, xi: ArrayLike, eta: ArrayLike) -> tuple[Floats, Floats]:
        """Exact principal curvatures k1 >= k2, from H and K.

        Parameters
        ----------
        xi, eta : array_like
            Parameters; they broadcast.

        Returns
        -------
        k1, k2 : ndarray, shape (...)
            H +- sqrt(H**2 - K) in 1/length, signed as H. Where the surface is umbilic to rounding both
            are H; beside it, as the root halves the digits, they have an error of up to 3e-8 |H|.
        """
        H, K = self.mean_curvature(xi, eta), self.gaussian_curvature(xi, eta)
        square = H**2 - K
        half = np.sqrt(np.where(square <= 4 * np.finfo(np.float64).eps * H**2, 0.0, square))
        return H + half, H - half

    def sample(self, shape: tuple[int, int], layout: str = "grid") -> tuple[Any, Floats, Floats]:
        """Mesh of evenly spaced parameters.

        Parameters
        ----------
        shape : (int, int)
            Number of cells r, c in xi and eta, of each panel.
        layout : {"grid", "staggered", "faces"}
            "grid": vertices of the cells, ends of open directions included, as a `QuadGrid` that wraps
            where the surface does. "staggered": cell centres and corners with one layer of ghost cells
            sampled beyond the domain, as a `StaggeredGrid` (the primal/dual points of the thesis).
            "faces": the vertices of all panels as a `QuadMesh`, those that coincide (folds, seams, edges
            of panels) welded.

        Returns
        -------
        mesh : QuadGrid, StaggeredGrid or QuadMesh
        xi, eta : ndarray, shape (r, c) or (n,)
            Parameters of the vertices, where `mean_curvature` gives the exact answer.

        Raises
        ------
        ValueError
            If the layout is unknown, or a surface of several panels is asked for as one grid.
        """
        cells = tuple(shape) if np.iterable(shape) and not isinstance(shape, str) else (shape,)
        if len(cells) != 2 or not all(isinstance(n, int | np.integer) and n > 0 for n in cells):
            raise ValueError(f"shape: expected two positive whole numbers, got {shape}")
        if layout not in ("grid", "staggered", "faces"):
            raise ValueError(f"layout must be 'grid', 'staggered' or 'faces', got {layout!r}")
        if layout == "faces":
            return self._welded(shape)
        if len(self.panels) > 1:
            raise ValueError(f"{self.name} has {len(self.panels)} panels, only layout 'faces' joins them")
        if layout == "staggered":
            dual = [
                a + (b - a) / n * np.arange(-1, n + 2) for (a, b), n in zip(self.domain, shape, strict=True)
            ]
            xi, eta = np.meshgrid(*((d[1:-2] + d[2:-1]) / 2 for d in dual), indexing="ij")
            return StaggeredGrid.from_mapping(self.mapping, *dual), xi, eta
        ends = [
            np.linspace(a, b, n if wraps else n + 1, endpoint=not wraps)
            for (a, b), n, wraps in zip(self.domain, shape, self.wrap, strict=True)
        ]
        xi, eta = np.meshgrid(*ends, indexing="ij")
        return QuadGrid(self.mapping(xi, eta), self.wrap), xi, eta

    def _welded(self, shape: tuple[int, int]) -> tuple[QuadMesh, Floats, Floats]:
        xi, eta = np.meshgrid(
            *(np.linspace(a, b, n + 1) for (a, b), n in zip(self.domain, shape, strict=True)), indexing="ij"
        )
        xi = np.stack([xi + offset for offset in self.panels])
        eta = np.broadcast_to(eta, xi.shape)
        points = self.mapping(xi, eta).reshape(-1, 3)
        index = np.arange(len(points), dtype=np.int32).reshape(xi.shape)
        faces = np.concatenate([grid_faces(panel) for panel in index])
        pairs = cKDTree(points).query_pairs(1e-9 * np.ptp(points, axis=0).max(), output_type="ndarray")
        same = scipy.sparse.coo_array((np.ones(len(pairs)), tuple(pairs.T)), shape=(len(points),) * 2)
        label = scipy.sparse.csgraph.connected_components(same, directed=False)[1]
        # Labels come in the order of first appearance, so the first vertex of each is kept.
        first = np.unique(label, return_index=True)[1]
        return QuadMesh(points[first], label[faces]), xi.ravel()[first], eta.ravel()[first]


def _corners(domain: Any) -> tuple[Floats, Floats]:
    try:
        corner, opposite = np.array(domain, dtype=np.float64).reshape(2, 2).T
    except (TypeError, ValueError):
        raise ValueError(f"domain: expected ((u0, u1), (v0, v1)), got {domain!r}") from None
    if not (np.isfinite([corner, opposite]).all() and (corner < opposite).all()):
        raise ValueError(f"domain: expected two increasing, finite intervals, got {domain!r}")
    return corner, opposite


def field(formula: float | Formula) -> Field:
    """Let a constant or a function of two float64 arrays of one shape take what broadcasts."""

    def values(xi: ArrayLike, eta: ArrayLike) -> Floats:
        xi, eta = np.broadcast_arrays(np.asarray(xi, np.float64), np.asarray(eta, np.float64))
        return formula(xi, eta) if callable(formula) else np.full(xi.shape, formula)

    return values


def positions(formula: Formula) -> Field:
    """Let a function to (x, y, z) take what broadcasts, and give shape (..., 3); jets pass through."""

    def mapping(xi: Any, eta: Any) -> Any:
        if isinstance(xi, Jet):
            return formula(xi, eta)
        xi, eta = np.broadcast_arrays(np.asarray(xi, np.float64), np.asarray(eta, np.float64))
        return np.stack([np.broadcast_to(x, xi.shape) for x in formula(xi, eta)], axis=-1, dtype=np.float64)

    return mapping


def closed_form(
    name: str,
    mapping: Formula,
    mean_curvature: float | Formula,
    gaussian_curvature: float | Formula,
    **attributes: Any,
) -> Surface:
    """Surface of a formula to (x, y, z) whose curvature is published in closed form."""
    return Surface(name, positions(mapping), field(mean_curvature), field(gaussian_curvature), **attributes)


def require_positive(**parameters: float) -> None:
    """Refuse a parameter of a surface that is not a positive, finite number."""
    for name, value in parameters.items():
        if not 0 < value < np.inf:
            raise ValueError(f"{name} must be positive and finite, got {value!r}")
