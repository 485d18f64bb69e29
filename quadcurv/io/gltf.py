"""glTF files by trimesh: triangles of single precision, paired into quads again where they were."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadcurv.io import trimesh as adapter
from quadcurv.io.base import Content, Format, Values, register
from quadcurv.io.colours import viridis
from quadcurv.io.isolation import isolated
from quadcurv.io.quads import quads_by_order
from quadcurv.mesh import QuadMesh
from quadcurv.types import MeshError, PrecisionWarning, warn

COARSE = 1e-3  # of an edge: rounding by more is said
KNOWN = "_known"  # ends the name of the values that tell where others are known: glTF has no NaN


def read_gltf(path: Path) -> list[Content]:
    """The meshes of a scene where they stand, quads paired as from a Trimesh."""
    answer, arrays = isolated("read_trimesh", path)
    parts = []
    for k, kind in enumerate(answer["kinds"]):
        if kind != "Trimesh":
            raise MeshError(f"mesh: a Scene of a {kind}, expected a Trimesh")
        prefix = f"{k} value _"
        values = {name.removeprefix(prefix): v for name, v in arrays.items() if name.startswith(prefix)}
        triangles = arrays[f"{k} triangles"]
        faces, rule = quads_by_order(triangles) if triangles.size else (triangles, "none")
        points = _single(arrays[f"{k} points"])
        parts.append(Content(points, faces, _with_nan(values), (rule, len(triangles))))
    return parts


def _single(points: NDArray[np.float64]) -> NDArray[np.floating]:
    """Positions in single precision where they are no more precise."""
    with np.errstate(over="ignore"):
        single = points.astype(np.float32)
    return single if np.array_equal(single, points) else points


def _with_nan(values: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Values as they were before :func:`write_glb` put zeros where none was known."""
    found = {}
    for name, array in values.items():
        if name.endswith(KNOWN) and name.removesuffix(KNOWN) in values:
            continue
        known = values.get(name + KNOWN)
        if known is not None and array.dtype.kind == "f":
            array = np.where(known.reshape(len(array), *[1] * (array.ndim - 1)) > 0, array, np.nan)
        found[name] = array[:, 0] if array.ndim == 2 and array.shape[1] == 1 else array
    return found


def write_glb(path: Path, mesh: QuadMesh, values: Values) -> None:
    """Values as _NAME in single precision, the first scalars also as colours, grey where not known.

    Where a value is not finite it is stored as 0, and _NAME_known is 0, else 1.
    """
    surface = adapter.from_mesh(mesh)
    rounding = np.abs(_checked_single("points", mesh.points) - mesh.points).max()
    edge = np.median(np.linalg.norm(mesh.points[mesh.faces[:, 1]] - mesh.points[mesh.faces[:, 0]], axis=1))
    if rounding > COARSE * edge:
        text = f"points: single precision, which is what glTF holds, moves them by up to {rounding:.2g}"
        warn(f"{text}, {rounding / edge:.2g} of an edge" if edge else text, PrecisionWarning)
    coloured, taken = False, set[str]()
    for name, array in values.items():
        known = np.isfinite(array).reshape(len(array), -1).all(axis=1)
        if infinite := np.count_nonzero(np.isinf(array)):
            warn(f"{name}: {infinite} infinite values are not known in a GLB file", PrecisionWarning)
        stored = _checked_single(name, np.where(known.reshape(-1, *[1] * (array.ndim - 1)), array, 0))
        names = [name] if known.all() else [name, name + KNOWN]
        if taken & set(names):
            raise MeshError(f"point_data: names {list(values)} repeat each other's in a GLB file")
        taken |= set(names)
        surface.vertex_attributes[name] = stored
        if not known.all():
            surface.vertex_attributes[name + KNOWN] = known.astype(np.float32)
        if array.ndim == 1 and not coloured:
            adapter.show(surface, viridis(array))
            coloured = True
    path.write_bytes(surface.export(file_type="glb"))


def _checked_single(name: str, array: NDArray[Any]) -> NDArray[np.float32]:
    """Values in single precision, if it can hold them; said where it cannot hold the small ones."""
    with np.errstate(over="ignore", under="ignore"):
        single = array.astype(np.float32)
    if beyond := np.count_nonzero(~np.isfinite(single)):
        raise MeshError(f"{name}: {beyond} values beyond single precision, which is what glTF holds")
    if lost := np.count_nonzero((single == 0) & (array != 0)):
        warn(f"{name}: {lost} values below single precision are 0 in a GLB file", PrecisionWarning)
    return single


register(Format((".glb",), read_gltf, write_glb, holds_values=True))
register(Format((".gltf",), read_gltf))
