"""The one way this package compiles kernels.

numba does not notice when a kernel in one file calls one in another file that changed, so a plain ``cache=True`` can
serve stale machine code. The cache folder therefore carries a digest of this package's kernels. In it kernels lie as in
the package: copies of the package with equal kernels share what one of them has compiled.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numba
from numba.core.caching import UserProvidedCacheLocator

_PACKAGE = Path(__file__).resolve().parents[1]


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        if b"@kernel" in text:
            digest.update(source.relative_to(_PACKAGE).as_posix().encode() + b"\0" + text)
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "er3a" / f"numba-{digest.hexdigest()[:16]}"


class PackageCacheLocator(UserProvidedCacheLocator):
    """Where numba keeps a kernel of this package; other packages' functions are left to numba's own locators."""

    @classmethod
    def get_suitable_cache_subpath(cls, py_file: str) -> str:
        """The folder of a file, from the package's."""
        return Path(py_file).resolve().parent.relative_to(_PACKAGE).as_posix()

    @classmethod
    def from_function(cls, py_func, py_file: str):
        """The locator of a function; None for one that is not of this package."""
        return super().from_function(py_func, py_file) if Path(py_file).resolve().is_relative_to(_PACKAGE) else None


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(_cache_folder())
numba.config.CACHE_LOCATOR_CLASSES = f"{__name__}.PackageCacheLocator,InTreeCacheLocator,UserWideCacheLocator"

# No fastmath and no contraction across operations: results must not depend on the machine's vector width.
kernel = numba.njit(cache=True, error_model="numpy", nogil=True)
