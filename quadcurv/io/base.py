"""What files and other libraries' meshes hold, and the registries that their modules enter themselves in."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.mesh import QuadMesh
from quadcurv.ragged import Faces
from quadcurv.types import Bools, Indices, Ints, MeshError

SAME_PLACE = 1e-6  # of the extent of a mesh: single precision is what many files have

Polygons = NDArray[np.int64] | Faces
Values = Mapping[str, NDArray[Any]]


@dataclass(frozen=True)
class Content:
    """What a file, or a mesh of another library, holds.

    Attributes
    ----------
    points : (n, 3) float, or (r, c, 3) of a grid
    faces : (m, 4) or (m, 3) int, or list of list of int; None of a grid
        As :class:`quadcurv.QuadMesh` takes them.
    values : mapping of str to (n, ...) array
        What is known at the points.
    pairing : (str, int) or None
        Where faces were put together from triangles: by which rule, and from how many.
    notes : tuple of str
        What was left out; said in a MeshWarning.
    """

    points: NDArray[Any]
    faces: Any
    values: Values = field(default_factory=dict)
    pairing: tuple[str, int] | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A file format.

    Attributes
    ----------
    suffixes : tuple of str
        In lower case, with their dot.
    read : callable or None
        Path -> Content, or a list of them where a file holds several parts. MeshError where it is no
        such file.
    write : callable or None
        (path, mesh, values) into a new file.
    holds_values : bool
        Whether `write` takes values.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path], Content | list[Content]] | None = None
    write: Callable[[Path, QuadMesh, Values], None] | None = None
    holds_values: bool = False


@dataclass(frozen=True)
class Library:
    """Another library of meshes.

    Attributes
    ----------
    modules : tuple of str
        Top-level modules that its classes stem from.
    content : callable
        Its mesh -> Content; TypeError for what is no mesh.
    attach : callable or None
        (mesh, name, values, colormap): see :func:`quadcurv.attach`.
    takes : callable or None
        Whether an object of other modules has what it takes; asked where no module fits.
    is_array : callable or None
        Whether an object of these modules is an array that is not in memory, the points of a ChunkedGrid.
    """

    modules: tuple[str, ...]
    content: Callable[[Any], Content]
    attach: Callable[[Any, str, NDArray[Any], str | None], None] | None = None
    takes: Callable[[Any], bool] | None = None
    is_array: Callable[[Any], bool] | None = None


@dataclass(frozen=True)
class Store:
    """A kind of file that holds an array, which is read and written in slices.

    Attributes
    ----------
    suffixes : tuple of str
        In lower case, with their dot.
    open : callable
        Path -> array with shape, dtype and slices. MeshError where there is no such array.
    create : callable
        (path, arrays) -> arrays to write to by name, of the shapes of float64 given by name, in a new file.
    """

    suffixes: tuple[str, ...]
    open: Callable[[Path], Any]
    create: Callable[[Path, Mapping[str, tuple[int, ...]]], dict[str, Any]]


FORMATS: dict[str, Format] = {}
LIBRARIES: dict[str, Library] = {}
STORES: dict[str, Store] = {}


def no_mesh(array: Any) -> Content:
    """Refuse what a library holds that is no mesh."""
    raise TypeError(f"mesh: {type(array).__module__}.{type(array).__qualname__} holds no mesh")


def register(entry: Format | Library | Store) -> None:
    """Enter a format or a store by its suffixes, a library by its modules."""
    if isinstance(entry, Format):
        FORMATS.update(dict.fromkeys(entry.suffixes, entry))
    elif isinstance(entry, Store):
        STORES.update(dict.fromkeys(entry.suffixes, entry))
    else:
        LIBRARIES.update(dict.fromkeys(entry.modules, entry))


def library(mesh: Any) -> Library | None:
    """The library that a mesh or the class it inherits from stems from, or is like, without importing any."""
    roots = {base.__module__.partition(".")[0] for base in type(mesh).__mro__}
    known = next((entry for name, entry in LIBRARIES.items() if name in roots), None)
    return known or next((e for e in LIBRARIES.values() if e.takes is not None and e.takes(mesh)), None)


def is_a(mesh: Any, *names: str) -> bool:
    """Whether the class of a mesh, or one it inherits from, has one of these names."""
    return not {base.__name__ for base in type(mesh).__mro__}.isdisjoint(names)


def polygons(sizes: Sequence[int] | NDArray[Any], vertices: Sequence[int] | NDArray[Any]) -> Polygons:
    """Faces of `sizes` corners each, listed one after the other in `vertices`.

    Returns
    -------
    (m, 4) int64 or Faces
        A table, -1 after the corners of a triangle, where all faces are triangles and quads.

    Raises
    ------
    MeshError
        A ValueError: an index that is negative (the table could not tell it from the mark of a triangle)
        or, as text formats may have it, no whole number.
    """
    sizes, given = np.asarray(sizes, np.int64), np.asarray(vertices)
    ends = np.cumsum(sizes)
    if (sizes < 0).any() or sizes.sum() != len(given):
        raise MeshError(f"faces: {len(given)} corners do not make {len(sizes)} faces of the sizes given")
    with np.errstate(invalid="ignore"):
        vertices = given.astype(np.int64)
    bad = (vertices < 0) | (vertices != given)
    if bad.any():
        face = int(np.searchsorted(ends, np.argmax(bad), side="right"))
        raise MeshError(f"faces: {np.count_nonzero(bad)} invalid indices, first face {face}: {given[bad][0]}")
    if np.isin(sizes, (3, 4)).all():
        table = np.full((len(sizes), 4), -1, np.int64)
        table[np.arange(4) < sizes[:, None]] = vertices
        return table
    return Faces(sizes, vertices)


def joined(parts: Sequence[Content]) -> Content:
    """Parts of a scene as one; of the values those that all of them have."""
    if len(parts) == 1:
        return parts[0]
    if any(part.faces is None for part in parts):
        raise MeshError("mesh: grids cannot be joined")
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    tables = [np.asarray(p.faces) for p in parts if isinstance(p.faces, np.ndarray)]
    faces: Any
    if len(tables) == len(parts):
        tables = [np.insert(t, 3, -1, axis=1) if t.shape[1] == 3 else t for t in tables]
        faces = np.concatenate([np.where(t < 0, -1, t + n) for t, n in zip(tables, first, strict=False)])
    else:
        faces = [
            [v + n for v in face if v >= 0]
            for p, n in zip(parts, first.tolist(), strict=False)
            for face in p.faces
        ]
    values = {}
    for name in parts[0].values:
        arrays = [part.values[name] for part in parts if name in part.values]
        if len(arrays) == len(parts) and len({array.shape[1:] for array in arrays}) == 1:
            values[name] = np.concatenate(arrays)
    pairings = [part.pairing for part in parts if part.pairing is not None]
    rules = sorted({rule for rule, _ in pairings})
    pairing = (", ".join(rules), sum(count for _, count in pairings)) if pairings else None
    notes = tuple(note for part in parts for note in part.notes)
    return Content(np.concatenate([part.points for part in parts]), faces, values, pairing, notes)


class FaceList(NamedTuple):
    """Faces as a mesh was given them, polygons uncut.

    Attributes
    ----------
    sizes : (m,) int64
    corners : (sum of sizes,) int32
        The vertices of all faces, one after the other.
    piece : (m,) int64
        For each the first of the mesh's `faces` that is a piece of it.
    """

    sizes: Indices
    corners: Ints
    piece: Indices

    @classmethod
    def of(cls, mesh: QuadMesh) -> FaceList:
        """Triangles, quads and polygons of a mesh, in the order of its faces."""
        faces, cut = mesh.faces, mesh.connectivity.polygons
        sizes = np.where(faces[:, 3] < 0, 3, 4)
        if cut is None:
            return cls(sizes, faces[faces >= 0], np.arange(len(faces)))
        # Each polygon takes the place of the first of its pieces.
        whole = cut.face < 0
        polygon, first = np.unique(cut.face[~whole], return_index=True)
        first = np.flatnonzero(~whole)[first]
        sizes[~whole] = 0
        sides = np.diff(cut.indptr)[polygon]
        at = np.repeat((np.cumsum(sizes))[first], sides)
        kept = np.isin(np.repeat(np.arange(len(cut.indptr) - 1), np.diff(cut.indptr)), polygon)
        single = faces[whole]
        order = np.argsort(at, kind="stable")
        corners = np.insert(single[single >= 0], at[order], cut.corners[kept][order])
        sizes[first] = sides
        piece = np.flatnonzero(sizes)
        return cls(sizes[piece], corners, piece)

    def words(self, shift: int = 0) -> list[list[str]]:
        """The vertices of every face in decimal, `shift` added."""
        corners = list(map(str, (self.corners + shift).tolist()))
        ends = np.cumsum(self.sizes).tolist()
        return [corners[begin:end] for begin, end in zip([0, *ends], ends, strict=False)]

    def turned(self, turn: Bools) -> FaceList:
        """The same, those of the faces turned over whose pieces are, each from the same first vertex."""
        end = np.cumsum(self.sizes)
        begin = np.repeat(end - self.sizes, self.sizes)
        place = np.arange(len(self.corners))
        kept = np.repeat(~turn[self.piece], self.sizes)
        back = np.where((place == begin) | kept, place, begin + np.repeat(end, self.sizes) - place)
        return self._replace(corners=self.corners[back])


def checked_values(name: str, values: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """Real scalars or vectors, one a vertex, under a name."""
    if not isinstance(name, str) or not name:
        raise TypeError(f"name: expected a word, got {name!r}")
    if values.dtype.kind not in "biuf":
        raise MeshError(f"{name}: expected real numbers, got dtype {values.dtype}")
    if values.shape not in (shape, (*shape, 3)):
        raise MeshError(f"{name}: shape {values.shape}, expected {shape} or {(*shape, 3)}")
    return values
