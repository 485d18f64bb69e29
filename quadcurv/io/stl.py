"""STL files by trimesh: triangles whose corners, given once a triangle, are merged."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from quadcurv.coincidence import first_at_place
from quadcurv.io import trimesh as adapter
from quadcurv.io.base import SAME_PLACE, Content, Format, foreign, register


def read_stl(path: Path) -> Content:
    """Triangles over their corners, merged where they coincide.

    Corners on an open edge are merged as well where they differ by rounding.
    """
    import trimesh

    soup = adapter.sole_geometry(foreign(trimesh.load_scene, path, process=False))
    points = np.asarray(soup.vertices, float)
    kept, corner = np.unique(first_at_place(points), return_inverse=True)
    points, triangles = points[kept], corner[np.asarray(soup.faces)]
    rim = _on_open_edges(triangles)
    if rim.size:
        place = np.arange(len(points))
        tolerance = SAME_PLACE * float(np.ptp(points, axis=0).max())
        place[rim] = rim[first_at_place(points[rim], tolerance)]
        kept, corner = np.unique(place, return_inverse=True)
        points, triangles = points[kept], corner[triangles]
    a, b, c = triangles.T
    return Content(points, triangles[(a != b) & (b != c) & (c != a)])


def _on_open_edges(triangles: np.ndarray) -> np.ndarray:
    """Vertices of the edges that one triangle has for itself."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends, count = np.unique(edges, axis=0, return_counts=True)
    return np.unique(ends[count == 1])


register(Format((".stl",), read_stl))
