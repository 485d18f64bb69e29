"""Serial, nogil kernels over ranges, by a few threads.

Ranges rather than numba's own parallel loops: those kill the children of a fork (OpenMP) or abort under
concurrent callers (workqueue). A kernel gives bitwise the same for any cut into ranges.
"""

import os
import threading
from collections import deque
from contextlib import contextmanager
from itertools import pairwise

SERIAL_BELOW = 200_000  # vertices; less work does not pay for waking a thread
MOST = 1024  # threads
_pool = None
_threads = None
_own = threading.local()


def _available():
    """Cores that this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on Linux
        return os.cpu_count() or 1


def threads():
    """How many are in use: `serial`, `set_threads`, QUADCURV_NUM_THREADS, or the cores of this process."""
    if getattr(_own, "alone", False):
        return 1
    if _threads is not None:
        return _threads
    try:
        return max(1, int(os.environ["QUADCURV_NUM_THREADS"]))
    except (KeyError, ValueError):
        return _available()


def set_threads(number: int | None) -> None:
    """Set how many threads a call on a large mesh uses; smaller meshes are computed by the caller's own.

    Parameters
    ----------
    number : int or None
        At least 1. None: what the environment variable QUADCURV_NUM_THREADS says, else all cores that the
        process may use. Results do not depend on it.

    Raises
    ------
    ValueError
        No whole number, less than 1, more than 1024.

    Examples
    --------
    >>> import quadcurv as qc
    >>> qc.set_threads(1)
    >>> qc.set_threads(None)
    """
    global _threads
    if number is not None and (isinstance(number, bool) or not hasattr(number, "__index__")):
        raise ValueError(f"number: expected a whole number of threads or None, got {number!r}")
    if number is not None and not 1 <= number <= MOST:
        raise ValueError(f"number: expected at least 1 thread and at most {MOST}, got {number}")
    _threads = number


@contextmanager
def serial():
    """What the calling thread computes within, it computes alone: others compute beside it already."""
    before = getattr(_own, "alone", False)
    _own.alone = True
    try:
        yield
    finally:
        _own.alone = before


def _forget_pool():
    global _pool
    _pool = None


if hasattr(os, "register_at_fork"):  # threads do not survive a fork: a child begins without a pool
    os.register_at_fork(after_in_child=_forget_pool)


def over(kernel, size, work, least=1):
    """Call kernel(start, stop) on ranges that make up 0..size; `work` vertices in all, `least` a range."""
    global _pool
    count = 1 if work < SERIAL_BELOW or size < 2 * least else threads()
    if count == 1:
        kernel(0, size)
        return
    # Ever smaller ranges: whichever thread is held up, all end at about the same time.
    least = max(least, size // (32 * count))
    cuts = [0]
    while size - cuts[-1] >= 2 * least:
        cuts.append(cuts[-1] + max((size - cuts[-1]) // (2 * count), least))
    left = deque(pairwise([*cuts, size]))

    def take():
        while left:
            try:
                cut = left.popleft()
            except IndexError:  # another thread took the last one
                return
            kernel(*cut)

    from concurrent.futures import ThreadPoolExecutor  # not needed by small meshes

    # The caller's thread works too: nothing waits for one that is slow to wake, or busy for another caller.
    helpers = []
    try:
        if _pool is None or _pool._max_workers != count - 1:
            _pool = ThreadPoolExecutor(count - 1, thread_name_prefix="quadcurv")
        for _ in range(min(count, len(cuts)) - 1):
            helpers.append(_pool.submit(take))
    except RuntimeError:  # the interpreter shuts down, or the system has no thread left
        pass
    try:
        take()
    finally:
        left.clear()
        for helper in helpers:
            if not helper.cancel():
                helper.result()
