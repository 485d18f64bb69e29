"""Faces of any number of sides as two arrays."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import overload

import numpy as np

from quadcurv.types import Bools, Indices

_LARGEST = int(np.iinfo(np.int64).max)


class Faces(Sequence[list[int]]):
    """A sequence of polygons that is no list: a tenth of the memory, and the time of arrays.

    Parameters
    ----------
    sizes : (m,) int64
    corners : (sum of sizes,) int64
        The vertices of all faces, one after the other.
    """

    def __init__(self, sizes: Indices, corners: Indices) -> None:
        self.sizes, self.corners = sizes, corners
        self.ends = np.cumsum(sizes)

    @classmethod
    def of(cls, faces: Iterable[Iterable[int]]) -> Faces:
        """Any sequence of polygons.

        Raises
        ------
        TypeError
            It is none, or an index is no integer.
        """
        if isinstance(faces, Faces):
            return faces
        rows = [[operator.index(v) for v in face] for face in faces]
        sizes = np.fromiter(map(len, rows), np.int64, len(rows))
        # Beyond 64 bits an index is as wrong as at the end of them.
        corners = (max(-_LARGEST, min(v, _LARGEST)) for v in chain.from_iterable(rows))
        return cls(sizes, np.fromiter(corners, np.int64, int(sizes.sum())))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __len__(self) -> int:
        return len(self.sizes)

    @overload
    def __getitem__(self, face: int) -> list[int]: ...
    @overload
    def __getitem__(self, face: slice) -> Faces: ...
    def __getitem__(self, face: int | slice) -> list[int] | Faces:
        if isinstance(face, slice):
            return self.chosen(np.arange(len(self))[face])
        end, size = self.ends[face], self.sizes[face]
        found: list[int] = self.corners[end - size : end].tolist()
        return found

    @property
    def begins(self) -> Indices:
        """(m,) int64: where the corners of each face begin."""
        return self.ends - self.sizes

    def chosen(self, faces: Indices) -> Faces:
        """Some of the faces, in that order."""
        return Faces(self.sizes[faces], self.corners[runs(self.begins[faces], self.sizes[faces])])

    def repeating(self) -> Bools:
        """(m,) bool: faces that have a vertex twice."""
        found = np.zeros(len(self), bool)
        for size in np.unique(self.sizes):
            which = np.flatnonzero(self.sizes == size)
            rows = np.sort(self.corners[self.begins[which, None] + np.arange(size)], axis=1)
            found[which] = (rows[:, 1:] == rows[:, :-1]).any(axis=1)
        return found


def runs(begin: Indices, length: Indices) -> Indices:
    """begin[0], begin[0] + 1, ... of each run, one run after the other."""
    end = np.cumsum(length)
    return np.repeat(begin - (end - length), length) + np.arange(end[-1] if len(end) else 0)
