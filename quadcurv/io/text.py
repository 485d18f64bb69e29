"""Words and numbers of text files, many at a time."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadcurv.types import Indices

_PART = 8 << 20  # bytes looked at together, so that what is needed beside a file does not grow with it
_END = -(2**53 - 1)  # added to numbers that are read, to see that all of them were
_SPACE = 32  # and all control characters; those that are no white space end in the numbers' own check


def text_of(path: Path) -> bytes:
    """The content of a file without a byte order mark and comments, all its lines ending in a line feed."""
    text = path.read_bytes().removeprefix(codecs.BOM_UTF8)
    if text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):  # as Windows' own tools save text
        text = text.decode("utf-16", errors="replace").encode()
    if b"\r" in text:
        text = text.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return re.sub(rb"#[^\n]*", b"", text) if b"#" in text else text


def parts(text: bytes) -> Iterator[bytes]:
    """The text in parts that end where lines do."""
    begin = 0
    while begin < len(text):
        end = text.rfind(b"\n", begin, begin + _PART) + 1 or (text.find(b"\n", begin) + 1 or len(text))
        yield text[begin:end]
        begin = end


class Words(NamedTuple):
    """Words of a text by their places.

    Attributes
    ----------
    text : (b,) uint8
    start, end : (k,) int64
        Where each word begins, and where the byte behind it is.
    first : (l + 1,) int64
        The first word of each line that has any, and k.
    """

    text: NDArray[np.uint8]
    start: Indices
    end: Indices
    first: Indices

    @classmethod
    def of(cls, text: bytes) -> Words:
        """All words of a text."""
        letters = np.frombuffer(text, np.uint8)
        inside = np.zeros(len(text) + 2, bool)
        np.greater(letters, _SPACE, out=inside[1:-1])
        turn = inside[1:] != inside[:-1]
        place: Indices = np.flatnonzero(turn)
        start, end = place[::2], place[1::2]
        after = np.searchsorted(start, np.flatnonzero(letters == 10))
        return cls(letters, start, end, distinct(np.concatenate(([0], after, [len(start)]))))

    @staticmethod
    def lines(text: bytes) -> Indices:
        """The first word of each line that has any, and how many words there are."""
        found, count = [np.zeros(1, np.int64)], 0
        for part in parts(text):
            first = Words.of(part).first
            found.append(first[1:].astype(np.int64) + count)
            count += int(first[-1])
        return distinct(np.concatenate(found))

    def numbers(self, chosen: Any, kind: type, end: Any = None) -> NDArray[Any]:
        """Words as numbers, of which `end` may cut something off.

        Raises
        ------
        ValueError
            One of them is no number.
        """
        step = np.zeros(len(self.text) + 1, np.int8)
        step[self.start[chosen]] = 1
        step[(self.end if end is None else end)[chosen]] -= 1
        kept = np.cumsum(step[:-1], dtype=np.int8).view(bool)
        found = numbers(np.where(kept, self.text, np.uint8(32)).tobytes(), kind)
        if len(found) != len(self.start[chosen]):
            raise ValueError("not a number")
        return found


def numbers(text: bytes, kind: type = float) -> NDArray[Any]:
    """All words of a text as numbers.

    Raises
    ------
    ValueError
        One of them is no number.
    """
    # An older numpy stops, with a warning that few see, where a word is no number: so does it before the end.
    try:
        found: NDArray[Any] = np.fromstring(text + b" %d" % _END, kind, sep=" ")
    except DeprecationWarning as error:  # where warnings are errors
        raise ValueError(str(error)) from None
    if not len(found) or found[-1] != _END:
        raise ValueError("a word is no number")
    return found[:-1]


def distinct(ascending: NDArray[Any]) -> NDArray[Any]:
    """The same without repetitions."""
    return ascending[np.append(True, ascending[1:] != ascending[:-1])]


def runs(begin: Indices, length: Indices) -> Indices:
    """begin[0], begin[0] + 1, ... of each run, one run after the other."""
    end = np.cumsum(length)
    return np.repeat(begin - (end - length), length) + np.arange(end[-1] if len(end) else 0)
