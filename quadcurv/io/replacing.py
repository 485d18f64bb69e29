"""Files written beside and then renamed, so that an old one survives a full disk, an error and a kill."""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path beside to write to; what is there in the end takes the place of `path`, if nothing went wrong.

    Parameters
    ----------
    path : path-like
        A file, whether it exists or not; where it is a link, what it leads to is replaced.

    Yields
    ------
    Path
        In the same folder, with the same suffix.

    Raises
    ------
    OSError
        `path` is a folder, a device or a pipe, or cannot be written.
    """
    target = Path(os.path.realpath(path))
    mode = target.stat().st_mode if target.exists() else None
    if mode is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if mode is not None and not stat.S_ISREG(mode):
        raise OSError(f"{path}: no regular file, so that it cannot be replaced")
    beside = target.with_name(f".{target.stem[:100]}.{secrets.token_hex(4)}{target.suffix}")
    # Made here, so that the name is ours and has the permissions that a new file has.
    os.close(os.open(beside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o666))
    try:
        if mode is not None:
            os.chmod(beside, stat.S_IMODE(mode))
        yield beside
        _to_disk(beside)
        os.replace(beside, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(beside)
        raise
    with contextlib.suppress(OSError):  # some systems do not open folders
        _to_disk(target.parent)


def _to_disk(path: Path) -> None:
    """Wait until what is written is there after a loss of power."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
