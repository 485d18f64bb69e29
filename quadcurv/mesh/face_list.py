"""A face list: points and a connectivity that meshes share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from quadcurv import html
from quadcurv.checks import Finding, Report, checked_points, unit_roundoff
from quadcurv.connectivity import Connectivity, connect
from quadcurv.device_arrays import on_host
from quadcurv.stencils import Stencils
from quadcurv.types import Floats, Indices, Ints, warn


class Recovery(NamedTuple):
    """How the quads of a mesh were found among triangles.

    Attributes
    ----------
    rule : {"given", "carrier", "ply", "block", "interleaved", "diagonal", "shape", "none"}
        See :func:`quadcurv.as_mesh` and :func:`quadcurv.pair_triangles` ("shape").
    paired : float
        Fraction of the triangles that went into quads.
    """

    rule: str
    paired: float


@dataclass(frozen=True, eq=False, init=False, repr=False)
class QuadMesh:
    """Quads, or quads and triangles, over points.

    Parameters
    ----------
    points : (n, 3) array_like of float
        Positions. C-contiguous float64 is not copied but seen read-only; all else is converted.
        float32 is accepted and computed with in float64, yet its rounding, eps / h^2 in a curvature,
        stays. Positions on a device (cupy, or what has __cuda_array_interface__ or DLPack) stay there.
    faces : (m, 4) or (m, 3) array_like of int, or sequence of polygons
        Vertex indices, counter-clockwise. In an (m, 4) array a last entry of -1 marks a triangle.
        A polygon of more than four sides is kept for the schemes that are made for polygons, and cut into
        triangles for the others, the worst of them as good as can be.

    Attributes
    ----------
    points : (n, 3) float64, read-only
    connectivity : Connectivity
        What does not depend on the positions; meshes made by :meth:`with_points` share it.
    recovery : Recovery or None
        How the quads were found, where they come from triangles.
    roundoff : float
        Relative rounding error of the positions as they were given, 2^-24 for float32.

    Raises
    ------
    MeshError
        A ValueError: wrong shapes or types, masked entries, non-finite points, coordinates beyond 1e70 or
        all within 1e-70 of each other, indices out of range, no proper face.

    Warns
    -----
    MeshWarning
        Once, with what was mended and where: faces that repeat a vertex or another face, faces turned to
        agree with their neighbours; edges of more than two faces; a mesh that cannot be oriented.

    Notes
    -----
    Vertices without a face, vertices where several fans touch and the ends of edges of more than two faces
    are accepted: their curvature is NaN. `report` counts all of these.

    Examples
    --------
    >>> import quadcurv as qc
    >>> points = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0]]
    >>> qc.QuadMesh(points, [[0, 1, 2, 3], [1, 4, 2]])
    QuadMesh(5 points, 1 quads, 1 triangles)
    """

    points: Floats
    connectivity: Connectivity
    recovery: Recovery | None
    roundoff: float

    def __init__(
        self,
        points: ArrayLike,
        faces: ArrayLike | Sequence[Sequence[int]],
    ) -> None:
        checked = checked_points(points, "points", ("n", 3))
        self.__dict__.update(
            points=checked,
            connectivity=connect(on_host(faces), on_host(checked)),
            recovery=None,
            roundoff=unit_roundoff(points),
        )
        warn_of(self.connectivity.findings)

    @classmethod
    def of(cls, points: Floats, connectivity: Connectivity, roundoff: float) -> QuadMesh:
        """Checked points under a connectivity that is known."""
        mesh = object.__new__(cls)
        mesh.__dict__.update(points=points, connectivity=connectivity, recovery=None, roundoff=roundoff)
        return mesh

    def __repr__(self) -> str:
        triangles = int(np.count_nonzero(self.faces[:, 3] < 0))
        kinds = f"{len(self.faces) - triangles} quads" + (f", {triangles} triangles" if triangles else "")
        return f"QuadMesh({len(self.points)} points, {kinds})"

    def _repr_html_(self) -> str:
        return summary_table(repr(self), self.points, self.report)

    @property
    def faces(self) -> Ints:
        """(m, 4) int32, read-only: the faces computed with; a triangle's last entry is -1."""
        return self.connectivity.faces

    @property
    def face_source(self) -> Indices:
        """(m,) int64: the index of the given face that each of `faces` stems from."""
        source = self.connectivity.source
        return np.arange(len(self.faces)) if source is None else source

    @property
    def orientable(self) -> bool:
        """False for a mesh such as a Moebius strip; its mean curvature is given without sign."""
        return self.connectivity.orientable

    @cached_property
    def report(self) -> Report:
        """What was mended, and what has no answer; a closed mesh that is inside out is told of too."""
        findings = self.connectivity.findings
        if (
            self.orientable
            and self.connectivity.closed.all()
            and _volume(on_host(self.points), self.faces) < 0
        ):
            findings += (Finding("inside_out", 1, ""),)
        return Report(findings)

    def stencils(self) -> Stencils:
        """One-ring stencils of the vertices as they are; rings at a boundary stay open."""
        c = self.connectivity
        stencils = Stencils(
            self.points, c.faces, (len(self.points),), c.closed, c.orientable, c.polygons, self.roundoff
        )
        stencils.__dict__.update(ring=c.ring, irregular=c.irregular)
        return stencils

    def irregular_part(self) -> tuple[Indices, Stencils]:
        """Vertices without a regular ring, and the stencils of a part of the mesh around them.

        The first vertices of the part are these; it reaches five faces beyond them, so that they have there
        all that a ghost layer or a scheme may look at.
        """
        c = self.connectivity
        if c.irregular.size == 0:
            return c.irregular, Stencils(self.points[:0], self.faces[:0], (0,), np.empty(0, bool))
        vertices, faces = c.irregular_part
        points, closed = self.points[vertices], c.closed[vertices]
        part = Stencils(points, faces, vertices.shape, closed, c.orientable, roundoff=self.roundoff)
        return c.irregular, part

    def with_points(self, points: ArrayLike) -> QuadMesh:
        """Return the same faces, not checked again, over other positions of the same shape."""
        checked = checked_points(points, "points", self.points.shape)
        return self._like(points=checked, roundoff=unit_roundoff(points))

    def reordered(self) -> QuadMesh:
        """Return the same mesh with an order of its vertices in which neighbours are near in memory.

        Results stay in the order of the vertices; FV and Liu are faster by it on large meshes whose
        neighbours are far apart in memory. It takes the time of several evaluations, and pays where many
        follow, as with :meth:`with_points`. Where it would not pay, nothing is done.
        """
        return self._like(connectivity=self.connectivity.reordered())

    def in_shape(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values (n, ...) of the vertices that :meth:`stencils` has, in the shape of results."""
        return values

    def with_recovery(self, recovery: Recovery) -> QuadMesh:
        """Return the same mesh that knows how its quads were found."""
        return self._like(recovery=recovery)

    def with_roundoff(self, roundoff: float) -> QuadMesh:
        """Return the same mesh whose positions were given in another precision."""
        return self._like(roundoff=roundoff)

    def with_connectivity(self, connectivity: Connectivity) -> QuadMesh:
        """Return the same points under another connectivity of as many vertices."""
        return self._like(connectivity=connectivity)

    def flat(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return values in the shape of results as (n, ...): what :meth:`in_shape` takes."""
        return values

    def arrays(self) -> dict[str, Floats]:
        """Arrays of positions by name, which results must not overlap."""
        return {"points": self.points}

    def _like(self, **changed: Any) -> QuadMesh:
        mesh = object.__new__(QuadMesh)
        kept = {name: self.__dict__[name] for name in ("points", "connectivity", "recovery", "roundoff")}
        mesh.__dict__.update(kept | changed)
        return mesh


def summary_table(title: str, points: Floats, report: Report) -> str:
    """What a notebook shows of a mesh: its extent and what was mended."""
    x = on_host(points).reshape(-1, 3)
    low, high = np.nanmin(x, axis=0), np.nanmax(x, axis=0)
    rows = [(name, f"{a:.4g} to {b:.4g}") for name, a, b in zip("xyz", low, high, strict=True)]
    return html.table(title, [*rows, ("report", str(report))])


def _volume(points: Floats, faces: Ints) -> float:
    """Six times the signed volume that a closed mesh encloses."""
    x = points - points[0]
    a, b, c = (x[faces[:, k]] for k in range(3))
    volume = np.einsum("ix,ix->", np.cross(a, b), c)
    quad = faces[:, 3] >= 0
    d = x[faces[quad, 3]]
    return float(volume + np.einsum("ix,ix->", np.cross(a[quad], c[quad]), d))


def warn_of(findings: Sequence[Finding]) -> None:
    """Say once what was mended, above the one who made the mesh."""
    said = Report(findings).warning
    if said:
        warn(said)
