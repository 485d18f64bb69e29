"""What lies over a surface: overlays, arrows of mean curvature normals, principal directions."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from quadcurv.curvature import vertex_normals
from quadcurv.types import Floats, Ints
from quadcurv.viewing.fields import Fields
from quadcurv.viewing.geometry import OVERLAYS

if TYPE_CHECKING:
    import pyvista as pv

_SPACING = 0.05  # of arrows, to the surface's size

Drawing = tuple["pv.PolyData", dict[str, Any]]  # and its style


class Marks:
    """Drawings over the surface of a comparison.

    Parameters
    ----------
    fields : Fields
    scale : float
        Size of dots and lines.
    """

    def __init__(self, fields: Fields, scale: float) -> None:
        self._fields, self._scale = fields, scale
        points, faces, on_cells = fields.drawn
        n = fields.comparison.valence.size
        self.sites: Floats = points[faces].mean(axis=1) if on_cells else points[:n]
        self._diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))

    def overlays(self, _: str) -> Iterator[Drawing]:
        """Edges of the boundary and of seams, and extraordinary vertices, each in the colour of its name."""
        import pyvista as pv

        points = self._fields.drawn.points
        for name, vertices in self._fields.overlays.items():
            style: dict[str, Any] = {"color": OVERLAYS[name]}
            if vertices.ndim == 2:
                style["line_width"] = 4 * self._scale
                yield pv.PolyData(np.array(points), lines=np.insert(vertices, 0, 2, axis=1)), style
            else:
                style["point_size"] = 9 * self._scale
                yield pv.PolyData(points[vertices]), style

    def normals(self, view: str) -> Iterator[Drawing]:
        """Arrows H n, towards the centre of curvature; as long as 5 % of the surface at the scale's end.

        In a view that is no scheme's H is that of jet.
        """
        import pyvista as pv

        by_scheme = self._fields.comparison.mean_curvature
        H = by_scheme[view].ravel() if view in by_scheme else self._fields.curvatures.mean.ravel()
        end = self._fields.field("mean_curvature").limits[1]
        length = 0.05 * self._diagonal * np.clip(H / end, -1, 1)
        vectors = -length[:, None] * self._vertex_normals()
        some = self._some(vectors)
        if some.size == 0:
            return
        inward = (H > 0)[some, None]  # such an arrow ends on the surface, where it can be seen
        tails = pv.PolyData(self.sites[some] - np.where(inward, vectors[some], 0.0))
        tails["vectors"] = vectors[some]
        arrow = pv.Arrow(
            tip_length=0.3, tip_radius=0.1, shaft_radius=0.04, tip_resolution=12, shaft_resolution=8
        )
        yield tails.glyph(orient="vectors", scale="vectors", geom=arrow), {"color": "black"}

    def directions(self, _: str) -> Iterator[Drawing]:
        """Principal directions by jet, that of the larger curvature k1 black, that of k2 white."""
        import pyvista as pv

        fit = self._fields.curvatures
        normals = self._vertex_normals()
        for direction, colour in ((fit.direction1, "black"), (fit.direction2, "white")):
            vectors = 0.018 * self._diagonal * direction.reshape(-1, 3)
            some = self._some(vectors)
            if some.size == 0:
                continue
            middle = self.sites[some] + 2e-3 * self._diagonal * normals[some]
            ends = np.stack((middle - vectors[some], middle + vectors[some]), axis=1).reshape(-1, 3)
            lines = np.insert(np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1)
            yield pv.PolyData(ends, lines=lines), {"color": colour, "line_width": 2.5 * self._scale}

    def _vertex_normals(self) -> Floats:
        return vertex_normals(self._fields.comparison.mesh, "nan").reshape(-1, 3)

    def _some(self, vectors: Floats) -> Ints:
        """One site in every cube of 5 % of the surface's size, among those with a vector."""
        known = np.flatnonzero(np.isfinite(vectors).all(axis=1) & (vectors != 0).any(axis=1))
        if known.size == 0:
            return known.astype(np.int32)
        from_corner = self.sites[known] - self.sites[known].min(axis=0)
        cubes = np.floor(from_corner / (_SPACING * self._diagonal)).astype(np.int32)
        return known[np.unique(cubes, axis=0, return_index=True)[1]].astype(np.int32)
