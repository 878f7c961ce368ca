"""How this package compiles kernels, and divides the rows of a batch among threads.

Kernels are numba's, and so is the cache of their machine code. numba does not notice when a kernel in one file calls
one in another file that changed, and would serve stale machine code; so they are kept in a folder that is named by the
content of all files with kernels. An edit of one of them compiles all kernels again as they are needed.
"""

from __future__ import annotations

import gc
import hashlib
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from itertools import pairwise
from numbers import Integral
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

import numba
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator

from er3a.errors import Er3aError

_PACKAGE = Path(__file__).resolve().parents[1]
_KERNEL = b"kernel\ndef "  # @kernel or @inner_kernel

Function = TypeVar("Function", bound=Callable[..., Any])


def cache_folder() -> Path:
    """Folder in which compiled kernels are kept on this machine.

    Returns
    -------
    path : ``er3a`` below ``NUMBA_CACHE_DIR``, else ``XDG_CACHE_HOME``, else ``~/.cache``; it need not exist
    """
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "er3a"


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


class SharedByCopies(UserProvidedCacheLocator):
    """Numba's folders below a named one, by the place of a file in this package instead of the place of the package:
    copies of a checkout share what one of them has compiled."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """Folder for the kernels of a file, below the folder of this version. numba calls it.

        Parameters
        ----------
        py_file : path of a source file in this package

        Returns
        -------
        name : the module's full name, such as ``er3a.kinematics.chain``
        """
        return ".".join(Path(py_file).resolve().relative_to(_PACKAGE.parent).with_suffix("").parts)


class _Waiting(event.Listener):
    """Counts the time in which numba compiles or loads kernels; nothing is collected in it.

    Compiling makes millions of objects that live until it ends: going through them takes a tenth of it.
    """

    def __init__(self) -> None:
        self.seconds, self._depth, self._start, self._collects = 0.0, 0, 0.0, False

    def on_start(self, event: event.Event) -> None:
        """Called by numba as it starts to compile or load one more kernel, which another one may need."""
        if not self._depth:
            self._start, self._collects = time.monotonic(), gc.isenabled()
            gc.disable()
        self._depth += 1

    def on_end(self, event: event.Event) -> None:
        """Called by numba as one kernel is ready; after the outermost one, collecting garbage goes on."""
        self._depth -= 1
        if not self._depth:
            self.seconds += time.monotonic() - self._start
            if self._collects:
                gc.enable()


_waiting = _Waiting()
event.register("numba:compiler_lock", _waiting)  # type: ignore[no-untyped-call]


def compile_seconds() -> float:
    """Time that this process has waited for kernels so far, compiled or loaded.

    Returns
    -------
    seconds : s, wall time; nested compilations count once
    """
    return _waiting.seconds


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
    No fastmath and no contraction across operations: results must not depend on the machine's vector width. Kernels
    release the interpreter's lock, so threads can run them side by side.
    """
    return _compiled(function)


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
    Leaving the entry out spares a sixth of the compiling.
    """
    return _compiled(function, no_cpython_wrapper=True)


def _compiled(function: Function, **wrappers: bool) -> Function:
    """A function compiled by numba, its machine code kept in the folder of this version."""
    config: Any = numba.config
    compiling: Any = numba.njit
    options = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **wrappers}
    before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
    config.CACHE_DIR = str(kernels_folder())
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{SharedByCopies.__name__}"
    try:
        compiled: Function = compiling(function, cache=True, **options)
    except RuntimeError:  # no folder to write into: compiled again by each process
        compiled = compiling(function, **options)
    finally:  # other packages keep what they compile where they always do
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
    return compiled


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
