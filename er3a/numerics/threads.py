"""Sharing rows of a batch out to threads; kernels release the interpreter's lock."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from numbers import Integral
from queue import Empty, SimpleQueue

from er3a.errors import Er3aError

PARTS_PER_THREAD = 8


def parallel_for(count: int, threads: int, smallest: int, work: Callable[[slice], None]) -> None:
    """Call ``work`` on parts of ``count`` rows, each at least ``smallest``, in so many threads, the caller's included.

    Threads take the next part as they are ready, so that one on a busy processor holds up nothing.

    Raises
    ------
    Er3aError
        if ``threads`` is no whole number of at least 1
    """
    if not (isinstance(threads, Integral) and threads >= 1):
        raise Er3aError(f"threads is {threads!r}; expected a whole number of at least 1")
    parts = min(threads * PARTS_PER_THREAD, count // smallest) if threads > 1 else 1
    if parts < 2:
        work(slice(0, count))
        return
    waiting: SimpleQueue[slice] = SimpleQueue()
    for start, end in pairwise(count * k // parts for k in range(parts + 1)):
        waiting.put(slice(start, end))

    def take_parts() -> None:
        try:
            while True:
                work(waiting.get_nowait())
        except Empty:
            return

    with ThreadPoolExecutor(threads - 1) as pool:
        others = [pool.submit(take_parts) for _ in range(threads - 1)]
        take_parts()
        for other in others:
            other.result()
