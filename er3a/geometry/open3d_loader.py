"""The one place that imports Open3D.

Open3D's Linux wheels need ``libusb-1.0.so.0``, which many systems lack. The ``libusb-package`` wheel carries it; loaded
with global symbols before the import, it serves Open3D without a system package.

Open3D also loads the web server Dash, three quarters of its import, for one function that shows geometry in a
browser. Nothing here calls it, so an empty module replaces Dash meanwhile.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from types import ModuleType


@cache
def load_open3d() -> ModuleType:
    """The ``open3d`` module; its import takes seconds, so it is done on first use."""
    if sys.platform == "linux":
        with suppress(ModuleNotFoundError):  # a conda environment has the library where its open3d finds it
            import libusb_package

            ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    with _without_dash():
        import open3d

    return open3d


@contextmanager
def _without_dash() -> Iterator[None]:
    """While this lasts, importing Dash gives an empty module."""
    if "dash" in sys.modules:
        yield
        return
    stand_in = ModuleType("dash")
    vars(stand_in).update(dict.fromkeys(("html", "dcc", "Dash")))
    sys.modules["dash"] = stand_in
    try:
        yield
    finally:
        del sys.modules["dash"]
