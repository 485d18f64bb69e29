"""STL files, text and binary: triangles whose corners, given once a triangle, are merged."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadcurv.coincidence import first_at_place
from quadcurv.io.base import SAME_PLACE, Content, Format, register
from quadcurv.io.text import Words, parts, text_of
from quadcurv.types import Indices, MeshError

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_stl(path: Path) -> Content:
    """Triangles over their corners, merged where they coincide.

    Corners on an open edge are merged as well where they differ by rounding.
    """
    size, head = path.stat().st_size, b""
    with path.open("rb") as file:
        head = file.read(84)
    count = int.from_bytes(head[80:], "little") if len(head) == 84 else 0
    # Binary files may begin with "solid" too; their length tells, or bytes that no text has.
    if len(head) == 84 and (
        size == 84 + 50 * count or b"\0" in head or not head.lstrip().startswith(b"solid")
    ):
        if size < 84 + 50 * count:
            raise MeshError(f"not an STL file: {size} bytes are too few for {count} triangles")
        soup = np.fromfile(path, _RECORD, count, offset=84)["corners"].reshape(-1, 3)
    else:
        soup = _text(path)
    return _merged(soup)


def _text(path: Path) -> NDArray[np.float64]:
    """Positions behind each word "vertex"."""
    text = text_of(path)
    if not text.lstrip()[:5].lower() == b"solid":
        raise MeshError("not an STL file: it does not begin with 'solid'")
    found = [np.empty((0, 3))]
    for part in parts(text):
        words = Words.of(part)
        at = words.start
        long = words.end - at == 6
        letters = words.text[np.minimum(at[long, None] + np.arange(6), len(words.text) - 1)] | 32
        vertex = np.flatnonzero(long)[(letters == np.frombuffer(b"vertex", np.uint8)).all(axis=1)]
        try:
            if vertex.size and vertex[-1] + 3 >= len(at):
                raise ValueError("a vertex of fewer than three coordinates")
            found.append(words.numbers((vertex[:, None] + np.arange(1, 4)).ravel(), float).reshape(-1, 3))
        except ValueError as error:
            raise MeshError(f"not an STL file: {error}") from None
    soup = np.concatenate(found)
    if len(soup) % 3:
        raise MeshError(f"not an STL file: {len(soup)} corners do not make triangles")
    return soup


def _merged(soup: NDArray[np.floating]) -> Content:
    kept, corner = np.unique(first_at_place(soup.astype(float)), return_inverse=True)
    points, triangles = soup[kept], corner.reshape(-1, 3)
    rim = _on_open_edges(triangles)
    if rim.size and np.isfinite(points).all():
        place = np.arange(len(points))
        extent, offset = np.ptp(points.astype(float), axis=0).max(), np.abs(points).max()
        tolerance = float(max(SAME_PLACE * extent, 2 * np.finfo(np.float32).eps * offset))
        place[rim] = rim[first_at_place(points[rim].astype(float), tolerance)]
        kept, corner = np.unique(place, return_inverse=True)
        points, triangles = points[kept], corner[triangles]
    a, b, c = triangles.T
    return Content(points, triangles[(a != b) & (b != c) & (c != a)])


def _on_open_edges(triangles: Indices) -> Indices:
    """Vertices of the edges that one triangle has for itself."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    ends, count = np.unique(edges, axis=0, return_counts=True)
    return np.unique(ends[count == 1])


register(Format((".stl",), read_stl))
