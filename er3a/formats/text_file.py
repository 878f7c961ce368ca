"""Text files that people write, read with one clear error."""

from __future__ import annotations

import stat
from pathlib import Path

from er3a.errors import InputError

MAX_BYTES = 1_000_000
TOO_LARGE = "Write long lists of targets or points as CSV tables"


def read_text(path: Path, most: int = MAX_BYTES, too_large: str = TOO_LARGE) -> str:
    """Read a UTF-8 text file of at most so many bytes, or raise :class:`InputError` (``too_large`` is its remedy)."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(path, None, "not a file", "Check the path")
        raw = path.read_bytes() if status.st_size <= most else None
    except FileNotFoundError:
        raise InputError(path, None, "there is no such file", "Check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, None, f"can't be read ({reason})", "Check the path and its permissions") from None
    if raw is None:
        raise InputError(path, None, f"larger than {most} bytes", too_large)
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "not UTF-8 text", "Save the file as UTF-8") from None
