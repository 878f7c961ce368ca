"""The one way this package compiles kernels.

numba does not notice when a kernel in one file calls one in another file that changed, so a plain ``cache=True`` can
serve stale machine code. Each kernel is therefore kept in a folder named by a digest of its file and of all files with
kernels that this one imports. Copies of the package with equal kernels share what one of them has compiled, and an
edit compiles again what depends on it. Nothing of numba's own settings is touched.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba.core.caching import CompileResultCacheImpl, FunctionCache, _CacheLocator

_PACKAGE = Path(__file__).resolve().parents[1]
_IMPORT = re.compile(r"^from er3a\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)

Function = TypeVar("Function", bound=Callable[..., Any])


def kernel(function: Function) -> Function:
    """Compile a function on its first call and keep the machine code on disk; its signature stays visible.

    No fastmath and no contraction across operations: results must not depend on the machine's vector width.
    """
    dispatcher = numba.njit(error_model="numpy", nogil=True)(function)
    if not numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        with suppress(RuntimeError):  # no folder to write into: compiled again by each process
            dispatcher._cache = _KernelCache(function)  # type: ignore[attr-defined, no-untyped-call]
    return cast(Function, dispatcher)


class _KernelLocator(_CacheLocator):
    """Where a kernel is kept: a folder that names the content of all kernels it may call."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        path = Path(file).resolve()
        home = os.environ.get("NUMBA_CACHE_DIR") or Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        self._folder = Path(home) / "er3a" / f"{path.stem}-{_kernels_digest(path)}"
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
        found += [file for file in files if file.is_file() and b"@kernel" in file.read_bytes()]
    return tuple(found)
