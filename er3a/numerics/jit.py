"""How this package compiles kernels, and divides the rows of a batch among threads.

Kernels are compiled by numba. Where it is not installed (``er3a[fast]``) they run as Python: slower, with the same
results up to rounding. numba does not notice when a kernel in one file calls one in another file that changed, and
would serve stale machine code; so it is kept in a folder that is named by the content of all files with kernels. An
edit of one of them compiles all kernels again as they are needed.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from numbers import Integral
from pathlib import Path
from queue import Empty, SimpleQueue
from types import ModuleType
from typing import Any, TypeVar

import numpy as np

from er3a.errors import Er3aError

machine_code: ModuleType | None
try:
    if os.environ.get("NUMBA_DISABLE_JIT", "0") == "0":
        from er3a.numerics import machine_code
    else:  # importing numba takes longer than some commands do
        machine_code = None
except ModuleNotFoundError:  # no numba
    machine_code = None

_PACKAGE = Path(__file__).resolve().parents[1]
_KERNEL = b"kernel\ndef "  # @kernel, @inner_kernel and so on

Function = TypeVar("Function", bound=Callable[..., Any])


def cache_folder() -> Path:
    """Folder in which compiled kernels are kept on this machine.

    Returns
    -------
    path : ``er3a`` below ``NUMBA_CACHE_DIR``, else ``XDG_CACHE_HOME``, else ``~/.cache``; it need not exist
    """
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "er3a"


def is_compiled() -> bool:
    """Whether kernels are compiled here.

    Returns
    -------
    compiled : False where numba is not installed, or ``NUMBA_DISABLE_JIT`` switches it off
    """
    return machine_code is not None


@cache
def kernels_folder() -> Path:
    """Folder of the kernels of this version, named by the content of all files that hold some.

    Returns
    -------
    path : below :func:`cache_folder`; an edit of any kernel gives another one, so stale code is never loaded
    """
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        if _KERNEL in (content := path.read_bytes()):
            digest.update(path.relative_to(_PACKAGE).as_posix().encode() + b"\0" + content + b"\0")
    return cache_folder() / f"kernels-{digest.hexdigest()[:16]}"


def compile_seconds() -> float:
    """Time that this process has waited for kernels so far, compiled or loaded.

    Returns
    -------
    seconds : s, wall time; nested compilations count once
    """
    return float(machine_code.waiting.seconds) if machine_code else 0.0


def kernel(function: Function) -> Function:
    """Compile a function on its first call and keep the machine code on disk; its signature stays visible.

    Parameters
    ----------
    function : of numbers and arrays, in the subset of Python that numba compiles

    Returns
    -------
    function : called as before

    Notes
    -----
    Where it runs as Python, it says nothing of infinities and NaN either.
    No fastmath and no contraction across operations: results must not depend on the machine's vector width. Kernels
    release the interpreter's lock, so threads can run them side by side.
    """
    return _compiled(function if machine_code else np.errstate(all="ignore")(function))


def inner_kernel(function: Function) -> Function:
    """Compile a function that only kernels call, without the entry that Python would call it by.

    Parameters
    ----------
    function : as for :func:`kernel`

    Returns
    -------
    function : must not be called from Python, unless numba is switched off (``NUMBA_DISABLE_JIT``)

    Notes
    -----
    Leaving the entry out spares a sixth of the compiling. A literal as an argument, alone or in a tuple, compiles the
    function once more for that number; ``int(0)`` does not.
    """
    return _compiled(function, no_cpython_wrapper=True, _nrt=True)


def borrowing_kernel(function: Function) -> Function:
    """Compile an inner kernel that makes no array and returns none, so that it need not count who holds its arguments.

    Parameters
    ----------
    function : as for :func:`inner_kernel`; numba refuses one that assigns a slice, or makes an array

    Returns
    -------
    function : as of :func:`inner_kernel`

    Notes
    -----
    A tuple of thirty arrays is counted thirty times at each call, which took half of the time of a collision question.
    """
    return _compiled(function, no_cpython_wrapper=True, _nrt=False)


def inlined_kernel(function: Function) -> Function:
    """Compile a function into each kernel that calls it: for what is called so often that handing over its arrays takes
    longer than its work.

    Parameters
    ----------
    function : as for :func:`inner_kernel`; short, as each call compiles it again

    Returns
    -------
    function : must not be called from Python, unless numba is switched off (``NUMBA_DISABLE_JIT``)
    """
    return _compiled(function, inline="always")


def _compiled(function: Function, **asked: bool | str) -> Function:
    return machine_code.compiled(function, kernels_folder(), **asked) if machine_code else function


# Enough parts that a thread on a busy processor is outrun by the others, few enough that handing out costs nothing.
PARTS_PER_THREAD = 8


def parallel_for(count: int, threads: int, smallest: int, work: Callable[[slice], None]) -> None:
    """Divide the rows of a batch among threads.

    Parameters
    ----------
    count : rows in all
    threads : how many, the caller's thread included
    smallest : rows that a part has at least; a batch with fewer than two such parts runs in the caller alone
    work : called with slices of the rows, in any order and from any thread

    Raises
    ------
    Er3aError
        if ``threads`` is no whole number of at least 1

    Notes
    -----
    Threads take the next part as they are ready, so that one on a busy processor holds up nothing. An error in ``work``
    is raised here.
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
