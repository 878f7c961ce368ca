"""Machine code of kernels, by numba: compiled, kept on disk, and the time that this takes.

The only module that imports numba; :mod:`er3a.numerics.jit` goes on without it.
"""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import event
from numba.core.caching import UserProvidedCacheLocator

_PACKAGE = Path(__file__).resolve().parents[1]

Function = TypeVar("Function", bound=Callable[..., Any])


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


waiting = _Waiting()
event.register("numba:compiler_lock", waiting)  # type: ignore[no-untyped-call]


def compiled(function: Function, folder: Path, **asked: bool | str) -> Function:
    """A function compiled by numba on its first call, its machine code kept in a folder.

    Parameters
    ----------
    function : of numbers and arrays
    folder : of this version's kernels; need not exist
    asked : further options of numba: entries to leave out, whether to inline
    """
    config: Any = numba.config
    compiling: Any = numba.njit
    options = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **asked}
    before = config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES
    config.CACHE_DIR = str(folder)
    config.CACHE_LOCATOR_CLASSES = f"{__name__}.{SharedByCopies.__name__}"
    try:
        made: Function = compiling(function, cache=True, **options)
    except RuntimeError:  # no folder to write into: compiled again by each process
        made = compiling(function, **options)
    finally:  # other packages keep what they compile where they always do
        config.CACHE_DIR, config.CACHE_LOCATOR_CLASSES = before
    return made
