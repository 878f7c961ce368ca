"""How this package compiles kernels, and divides the rows of a batch among threads.

numba does not notice when a kernel in one file calls one in another file that changed, so a plain ``cache=True`` can
serve stale machine code. Each kernel is therefore kept in a folder named by a digest of its file and of all files with
kernels that this one imports. Copies of the package with equal kernels share what one of them has compiled, and an
edit compiles again what depends on it. Nothing of numba's own settings is touched.

Compiling is what a first run on a machine waits for, so three things are spared: kernels that only kernels call get no
entry for Python (a quarter of the time), integer constants in a call make no version of their own, and processes that
need a kernel at once compile it once: one holds its lock, the others wait and load. Kernels release the interpreter's
lock.
"""

from __future__ import annotations

import fcntl
import gc
import hashlib
import os
import re
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from functools import cache
from itertools import pairwise
from numbers import Integral
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, TypeVar, cast

import numba
from numba.core import types
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator
from numba.core.compiler import Flags
from numba.core.registry import CPUDispatcher

from er3a.errors import Er3aError

_PACKAGE = Path(__file__).resolve().parents[1]
_KERNEL = b"kernel\ndef "  # @kernel or @inner_kernel
_IMPORT = re.compile(r"^from er3a\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)

Function = TypeVar("Function", bound=Callable[..., Any])


def cache_folder() -> Path:
    """Where compiled kernels are kept on this machine."""
    home = os.environ.get("NUMBA_CACHE_DIR") or os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "er3a"


def kernel(function: Function) -> Function:
    """Compile a function on its first call and keep the machine code on disk; its signature stays visible.

    No fastmath and no contraction across operations: results must not depend on the machine's vector width.
    """
    return _compiled(function, _Kernel, no_cfunc_wrapper=True)


def inner_kernel(function: Function) -> Function:
    """A kernel that only kernels call: it is compiled without the entry that Python would call it by.

    Called from Python it raises a TypeError, unless numba is switched off (``NUMBA_DISABLE_JIT``).
    """
    return _compiled(function, _InnerKernel, no_cfunc_wrapper=True, no_cpython_wrapper=True)


def compile_seconds() -> float:
    """Wall time (s) for which this thread has waited for kernels: compiled by itself or another process, or loaded."""
    return _waited.seconds


class _Waited(threading.local):
    depth, seconds = 0, 0.0


_waited = _Waited()


@contextmanager
def _counted() -> Iterator[None]:
    """Count the time of a block, once where such blocks lie in each other; nothing is collected in it.

    Compiling makes millions of objects that live until it ends: going through them took an eighth of it.
    """
    start, collects = time.monotonic(), gc.isenabled()
    gc.disable()
    _waited.depth += 1
    try:
        yield
    finally:
        if collects:
            gc.enable()
        _waited.depth -= 1
        if not _waited.depth:
            _waited.seconds += time.monotonic() - start


def _compiled(function: Function, kind: type[_Kernel], **wrappers: bool) -> Function:
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        return function
    dispatcher = kind(function, targetoptions={"nopython": True, "error_model": "numpy", "nogil": True, **wrappers})
    with suppress(RuntimeError):  # no folder to write into: compiled again by each process
        dispatcher._cache = _KernelCache(function)  # type: ignore[no-untyped-call]
    return cast(Function, dispatcher)


class _Flags(Flags):
    """What kernels are compiled with; numba compares it 30 000 times for a hundred kernels, 22 properties each time."""

    __slots__ = ()
    _HASH = hash(Flags())  # type: ignore[no-untyped-call]  # of the names alone

    def __hash__(self) -> int:
        return self._HASH

    def __eq__(self, other: object) -> bool:
        same = isinstance(other, _Flags) and self._values == other._values
        return same or bool(super().__eq__(other))  # type: ignore[no-untyped-call]


class _Kernel(CPUDispatcher):
    _cache: Any
    _compiler: Any

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._compiler._customize_flags = _Flags

    def compile(self, sig: Any) -> Any:
        with _counted(), _alone(self._cache, self.py_func.__qualname__):
            return super().compile(sig)  # type: ignore[no-untyped-call]

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Numba compiles a call with a constant integer for that very integer; one version serves all."""
        unliteral: Callable[[Any], Any] = types.unliteral
        named = {name: unliteral(kind) for name, kind in kws.items()}
        return super().get_call_template(tuple(map(unliteral, args)), named)  # type: ignore[no-untyped-call]


class _InnerKernel(_Kernel):
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        raise TypeError(f"{self.py_func.__qualname__} is compiled for kernels only; make it a @kernel to call it")


@contextmanager
def _alone(cache: object, name: str) -> Iterator[None]:
    """One process at a time compiles a kernel: what another has compiled meanwhile is then loaded.

    A kernel's lock is held while those that it calls are compiled, theirs never while it is: no two processes can wait
    for each other, because kernels call each other in one direction.
    """
    lock = None
    if isinstance(cache, _KernelCache):
        with suppress(OSError):  # a file system without locks
            lock = os.open(Path(cache.cache_path) / f"{name}.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC)
            fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


class _KernelLocator(_CacheLocator):
    """Where a kernel is kept: a folder that names the content of all kernels it may call."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        path = Path(file).resolve()
        self._folder = cache_folder() / f"{path.stem}-{_kernels_digest(path)}"
        self._line = function.__code__.co_firstlineno

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return "named by the folder"

    def get_disambiguator(self) -> str:
        return str(self._line)

    @classmethod
    def from_function(cls, py_func: Callable[..., Any], py_file: str) -> _KernelLocator | None:
        locator = cls(py_func, py_file)
        try:
            locator.ensure_cache_path()  # type: ignore[no-untyped-call]
        except OSError:
            return None
        return locator


class _KernelCacheImpl(CompileResultCacheImpl):
    _locator_classes = [_KernelLocator]


class _KernelCache(FunctionCache):
    _impl_class = _KernelCacheImpl


@cache
def _kernels_digest(path: Path) -> str:
    """A digest of a file and of all files with kernels that it imports, directly or through another such file."""
    reached, todo = {path: path.read_bytes()}, [path]
    while todo:
        for other in _kernel_files(todo.pop()):
            if other not in reached:
                reached[other] = other.read_bytes()
                todo.append(other)
    digest = hashlib.sha256()
    for file, text in sorted(reached.items()):
        digest.update(file.name.encode() + b"\0" + text + b"\0")
    return digest.hexdigest()[:16]


@cache
def _kernel_files(path: Path) -> tuple[Path, ...]:
    """The files with kernels that a file imports."""
    found = []
    for module, names in _IMPORT.findall(path.read_text(encoding="utf-8")):
        parts = [module, *(f"{module}.{name}" for name in re.findall(r"\w+", names))]
        files = [_PACKAGE.joinpath(*part.split(".")).with_suffix(".py") for part in parts]
        found += [file for file in files if file.is_file() and _KERNEL in file.read_bytes()]
    return tuple(found)


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
