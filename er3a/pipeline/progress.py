"""Progress of long sampling on standard error: a bar on a terminal, a line now and then in a log."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

EVERY_S = 10.0


@contextmanager
def shown_progress(total: int, what: str) -> Iterator[Callable[[int], object]]:
    """Show how many of ``total`` are done while the block runs.

    Yields
    ------
    advance : function of the number done since it was called last
    """
    if not sys.stderr.isatty():
        yield _lines(total, what)
        return
    # Only here: loading rich takes longer than a small run.
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TimeRemainingColumn

    columns = ("{task.description}", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=total)
        yield lambda count: bar.advance(task, count)


def _lines(total: int, what: str) -> Callable[[int], None]:
    """A line every few seconds, none for what is done sooner."""
    start = last = time.monotonic()
    done = 0

    def advance(count: int) -> None:
        nonlocal done, last
        done, now = done + count, time.monotonic()
        if now - last >= EVERY_S:
            left = (now - start) * (total - done) / done
            print(
                f"{what}: {done:,} of {total:,} ({done / total:.0%}), about {left:.0f} s left",
                file=sys.stderr,
                flush=True,
            )
            last = now

    return advance
