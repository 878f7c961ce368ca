"""The one place that imports Open3D.

Open3D's Linux wheels need ``libusb-1.0.so.0``, which many systems lack. The ``libusb-package`` wheel carries it; loaded
with global symbols before the import, it serves Open3D without a system package.
"""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress
from functools import cache
from types import ModuleType


@cache
def load_open3d() -> ModuleType:
    """The ``open3d`` module; its import takes seconds, so it is done on first use."""
    if sys.platform == "linux":
        with suppress(ModuleNotFoundError):  # a conda environment has the library where its open3d finds it
            import libusb_package

            ctypes.CDLL(str(libusb_package.get_library_path()), mode=ctypes.RTLD_GLOBAL)
    import open3d

    return open3d
