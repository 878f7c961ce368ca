"""Progress of long work on standard error: a bar or a changing line on a terminal, a line from time to time in a
log."""

from __future__ import annotations

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY_S = 10.0


@contextmanager
def shown_work(what: str) -> Iterator[Callable[[str], None]]:
    """Show that work whose length is not known goes on, and for how long it has, while the block runs.

    Yields
    ------
    at : function of the words for what is done now
    """
    doing, over, start = [what], threading.Event(), time.monotonic()
    if sys.stderr.isatty():
        from rich.console import Console

        with Console(stderr=True).status(what) as status:
            yield status.update
        return

    def tell() -> None:
        while not over.wait(EVERY_S):
            print(f"{doing[-1]} ({time.monotonic() - start:.0f} s)", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield doing.append
    finally:
        over.set()
        teller.join()


def work_clock() -> float:
    """A clock of the work itself: it stops while kernels are compiled, as they are once on a machine.

    Returns
    -------
    t : s, from an arbitrary moment on; only differences mean anything
    """
    from er3a.numerics.jit import compile_seconds  # numba only where work is timed: all commands load this file

    return time.monotonic() - compile_seconds()


class TimeOverError(Exception):
    """A block has not ended in its time."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Limit the time of a block.

    Parameters
    ----------
    seconds : after which the block is interrupted, wherever it is

    Raises
    ------
    TimeOverError
        in the block, once the time is over; only in the main thread, and not on Windows
    """
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> None:
        raise TimeOverError

    before, rest = signal.signal(signal.SIGALRM, end), signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        # A limit from outside goes on, with the time that it had left when this one began.
        signal.setitimer(signal.ITIMER_REAL, *rest)
        signal.signal(signal.SIGALRM, before)


def time_left(seconds: float) -> Callable[[], bool]:
    """Whether some work may go on.

    Parameters
    ----------
    seconds : from now on, by :func:`work_clock`

    Returns
    -------
    holds : False once they are over
    """
    end = work_clock() + seconds
    return lambda: work_clock() < end
