"""What a scheme is: a stiffness matrix and a dual area at every vertex, or a fit that has neither."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np
import scipy

from quadcurv import html
from quadcurv.stencils import Stencils
from quadcurv.types import Bools, Floats, Indices, Ints

if TYPE_CHECKING:
    from quadcurv.kernels.lines import Lines


@dataclass(frozen=True)
class Diamond:
    """What a driver needs to know to apply the diamond scheme to positions without a matrix.

    Attributes
    ----------
    area : {"ring", "quads"}
        Dual area: half the vector area of the ring polygon (finite volumes), or a quarter of each quad
        around (Liu's formula).

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.SCHEMES["liu"].fast
    Diamond(area='quads')
    """

    area: Literal["ring", "quads"]


@dataclass(frozen=True)
class Laplacian:
    """A discrete Laplace-Beltrami operator, local to the corners of faces.

    With stiffness S and dual areas A the mean curvature normal is H n = -(S x) / (2 A) and the
    Laplace-Beltrami operator of f is -(S f) / A.

    Attributes
    ----------
    name : str
        Key in ``SCHEMES`` and label in tables and figures.
    order : int
        Order of convergence of H on smooth meshes of regular vertices; 0 where it does not converge.
    reference : str
        Where the formula stands.
    assemble : callable
        Stencils -> (S, A): csr_array (n, p) and float64 (n,). This is the law; all else agrees with it.
    flux : callable, optional
        Stencils -> (-S x, A): float64 (n, 3) and (n,), where that can be had without building S.
    fast : Diamond, optional
        What a compiled driver needs to know of the scheme.
    symmetric : bool
        Whether S is symmetric on every mesh of quads.
    checkerboard : bool
        Whether, beside the constants, S does not see values that alternate like the colours of a
        chessboard, on meshes of quads whose vertices can be coloured so.
    polygons : bool
        Whether polygons of more than four sides are kept; else their triangles are seen.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> S, A = qc.SCHEMES["liu"].assemble(ball.stencils())
    >>> S.shape, A.shape
    ((98, 98), (98,))
    """

    name: str
    order: int
    reference: str
    assemble: Callable[[Stencils], tuple[scipy.sparse.csr_array, Floats]]
    flux: Callable[[Stencils], tuple[Floats, Floats]] | None = None
    fast: Diamond | None = None
    symmetric: bool = True
    checkerboard: bool = False
    polygons: bool = False


class StandardErrors(NamedTuple):
    """One standard deviation of H, K, k1 and k2, of the shape of these.

    Examples
    --------
    >>> import quadcurv as qc
    >>> ball, _, _ = qc.surfaces.cubed_sphere().sample((4, 4), "faces")
    >>> qc.curvatures(ball).standard_error.mean.shape
    (98,)
    """

    mean: Floats
    gaussian: Floats
    k1: Floats
    k2: Floats


@dataclass(frozen=True, eq=False)
class Curvatures:
    """All a fit knows at the vertices, (n,) or (r, c); NaN where it has no answer.

    Attributes
    ----------
    mean, gaussian : float64
        H in 1 / length, positive where the surface bends away from its normal, and K in 1 / length^2.
    k1, k2 : float64
        Principal curvatures in 1 / length with the sign of H, k1 >= k2.
    direction1, direction2 : (..., 3) float64
        Unit tangents of k1 and k2. Their signs are arbitrary, direction1 x direction2 = normal; at an
        umbilic any two orthogonal tangents.
    normal : (..., 3) float64
        Unit normal of the fitted surface.
    standard_error : StandardErrors or None
        From the fit's residuals, for errors of the positions along the normal that are independent and
        of equal size: noise, not what a smooth surface leaves. NaN where a fit has no residuals.
    interval : StandardErrors or None
        Half widths of intervals about H, K, k1 and k2 that hold the exact values in 95 % of cases: the noise
        by Student's t, and twice the bias as far as the fit knows of it. Residuals count as noise as far as
        they also move the fitted surface off its vertices; without noise widths are some 2 to 5 times what
        errors ask for. Of "jet" alone.
    noise : float64 or None
        Standard deviation of the positions along the normal, from the residuals, in length.
    degree, rings : int32 or None
        Degree and neighbourhood of the fit at each vertex, 0 where there is none, 1 for the sphere nearest
        to a ring of too few vertices, degree 8 for differences along the lines of the mesh.
    feature : bool or None
        Vertices on creases: the surface has no curvature there, and what is given grows as the mesh is
        refined. Fits beside a crease look at their own side of it. Of "jet" alone.

    Examples
    --------
    >>> import quadcurv as qc
    >>> found = qc.curvatures(qc.surfaces.torus().sample((32, 24))[0])
    >>> bool((found.k1 >= found.k2).all()), found.direction1.shape
    (True, (32, 24, 3))
    """

    mean: Floats
    gaussian: Floats
    k1: Floats
    k2: Floats
    direction1: Floats
    direction2: Floats
    normal: Floats
    standard_error: StandardErrors | None = None
    interval: StandardErrors | None = None
    noise: Floats | None = None
    degree: Ints | None = None
    rings: Ints | None = None
    feature: Bools | None = None

    def __repr__(self) -> str:
        known = self.mean[np.isfinite(self.mean)]
        size = " x ".join(map(str, self.mean.shape))
        ends = f"H {known.min():.4g} to {known.max():.4g}, " if known.size else ""
        return f"Curvatures({size} vertices, {ends}{self.mean.size - known.size} without)"

    def _repr_html_(self) -> str:
        """What a notebook shows: the range of every curvature, and how many vertices have none."""
        errors = self.standard_error
        rows = []
        for symbol, name in (("H", "mean"), ("K", "gaussian"), ("k1", "k1"), ("k2", "k2")):
            known = (values := np.ravel(getattr(self, name)))[np.isfinite(values)]
            ends = np.quantile(known, (0, 0.5, 1)) if known.size else [np.nan] * 3
            deviation = np.ravel(getattr(errors, name)) if errors is not None else np.empty(0)
            deviation = deviation[np.isfinite(deviation)]
            bar = f"{np.median(deviation):.1e}" if deviation.size else "-"
            rows.append((symbol, *(f"{end:.4g}" for end in ends), bar, str(values.size - known.size)))
        header = ("", "min", "median", "max", "standard error", "without")
        return html.table(f"Curvatures at {np.size(self.mean)} vertices", rows, header)

    @property
    def shape_index(self) -> Floats:
        """2 / pi arctan((k1 + k2) / (k1 - k2)): 1 on spheres seen from outside, 0 at symmetric saddles.

        0.5 on ridges, -0.5 in ruts, -1 in cups; NaN where the surface is flat (Koenderink and van Doorn 1992,
        with the sign of H here).
        """
        index = 2 / np.pi * np.arctan2(self.k1 + self.k2, self.k1 - self.k2)
        return np.where((self.k1 == 0) & (self.k2 == 0), np.nan, index)

    @property
    def curvedness(self) -> Floats:
        """((k1^2 + k2^2) / 2)^(1/2) in 1 / length (Koenderink and van Doorn 1992)."""
        return np.hypot(self.k1, self.k2) / np.sqrt(2)


class Neighbourhoods(Protocol):
    """All that a fit sees of a mesh: its vertices and what lies around each, across a smooth border too.

    Attributes
    ----------
    present, wanted : (n,) bool
        Vertices of one fan of faces, open or closed; those of them that want a curvature.
    rounding : float
        Of the positions, in length.
    on_border : (n,) bool
        Vertices whose ring of faces is open.
    ghost_error : (n,) float64
        What ghosts beyond smooth borders may be off by at border vertices, in length, by what the last of
        their points changes; 0 inside, NaN where nothing tells.
    on_crease, on_jump : (n,) bool
        Vertices on creases, and on lines at which the curvature jumps; round neighbourhoods end at both.
    points : (n, 3) float64
        Positions of the vertices.
    lines : Lines
        Lines straight on through vertices at which quads meet by four; none where no side is the outer one.
    """

    @property
    def present(self) -> Bools: ...  # noqa: D102
    @property
    def wanted(self) -> Bools: ...  # noqa: D102

    @property
    def rounding(self) -> float: ...  # noqa: D102
    @property
    def on_border(self) -> Bools: ...  # noqa: D102
    @property
    def ghost_error(self) -> Floats: ...  # noqa: D102
    @property
    def on_crease(self) -> Bools: ...  # noqa: D102
    @property
    def on_jump(self) -> Bools: ...  # noqa: D102
    @property
    def points(self) -> Floats: ...  # noqa: D102
    @property
    def lines(self) -> Lines: ...  # noqa: D102

    def polynomials(
        self, vertices: Indices, degree: int, rings: int, ghosts: bool = True, kind: int = 0, nested: int = 1
    ) -> Floats:
        """Least-squares polynomials of height over the tangent planes of vertices (k,), compiled.

        Returns
        -------
        (k, COLUMNS) or (nested, k, COLUMNS) float64
            See :mod:`quadcurv.kernels.jet`, also for the kinds of fits. With `ghosts` neighbourhoods of up to
            three rings go on beyond smooth borders; else, and over more rings, they end there. With `nested`
            2 or 3 also the fits of two and four degrees less to the same points, which then take little time;
            not of fits with weights.
        """

    def border_error(self, rings: int) -> Floats:
        """(n,): error of H where `polynomials` completed that many rings by a surface fitted at the border.

        NaN elsewhere.
        """

    def pooled(self, values: Floats, times: int = 1) -> Floats:
        """Means of values (n, k) over vertices and their neighbours, of known ones, taken so often."""

    def positions(self, vertices: Indices, rings: int, ghosts: bool = True) -> tuple[Floats, Floats]:
        """Positions around vertices (k,), for fits written in numpy.

        Returns
        -------
        positions : (k, m, 3) float64
            The vertex itself, then those of `rings` rings of faces around it, with `ghosts` those beyond
            smooth borders among them, else what lies on the vertex's own side of creases; NaN behind.
        normals : (k, 3) float64
            Normals of the rings of faces, of any length.
        """

    def lattice(self, layers: int) -> Floats:
        """Positions of a grid relative to one of them, for fits along rows and columns.

        Returns
        -------
        (r + 2 layers, c + 2 layers, 3) float64
            With so many layers around it: the other side, ghosts, or NaN; r c = n.

        Raises
        ------
        ValueError
            The mesh is no grid; fewer points than the extrapolation reads.
        """


@dataclass(frozen=True)
class Fit:
    """A scheme that fits a surface around every vertex: all curvatures at once, and no matrix.

    Attributes
    ----------
    name, order, reference
        As for `Laplacian`.
    fit : callable
        Neighbourhoods -> Curvatures at all n vertices, arrays (n,) and (n, 3). A driver gives them the mesh's
        shape, puts NaN at vertices that want none, and takes the side with H >= 0 where no side is the
        outer one.
    reach : int or None
        Rings of faces that a result rests on at most; None where all of the mesh decides.
    pooled : int
        Rings over which results of neighbours are looked at.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.SCHEMES["jet"].order
    8
    """

    name: str
    order: int
    reference: str
    fit: Callable[[Neighbourhoods], Curvatures]
    reach: int | None = None
    pooled: int = 0


Scheme = Laplacian | Fit
