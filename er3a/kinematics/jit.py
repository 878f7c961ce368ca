"""The one way this package compiles kernels.

numba does not notice when a kernel in one file calls one in another file that changed, so a plain ``cache=True`` can
serve stale machine code. The cache folder therefore carries a digest of this package's kernels.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import numba

_PACKAGE = Path(__file__).resolve().parents[1]


def _cache_folder() -> Path:
    digest = hashlib.sha256()
    for source in sorted(_PACKAGE.rglob("*.py")):
        text = source.read_bytes()
        if b"@kernel" in text:
            digest.update(source.relative_to(_PACKAGE).as_posix().encode() + b"\0" + text)
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return home / "er3a" / f"numba-{digest.hexdigest()[:16]}"


if "NUMBA_CACHE_DIR" not in os.environ:
    numba.config.CACHE_DIR = str(_cache_folder())

# No fastmath and no contraction across operations: results must not depend on the machine's vector width.
kernel = numba.njit(cache=True, error_model="numpy", nogil=True)
