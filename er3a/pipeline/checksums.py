"""Checksums of views, in a hidden file beside each."""

from __future__ import annotations

from pathlib import Path

from er3a.errors import ResultError
from er3a.files.kept_files import sha256, write_atomically

OVERALL = ("index.html", "compare.html", "junit.xml")


def write_checksum(path: Path) -> None:
    """Write the checksum of a finished view beside it."""
    checksum = sha256(path)
    write_atomically(_checksum_file(path), lambda file: file.write_text(checksum, encoding="ascii"))


def check_checksum(path: Path) -> None:
    """Raise :class:`ResultError` if a view is not as it was written."""
    try:
        kept = _checksum_file(path).read_bytes()
    except OSError:
        raise ResultError(path, "no checksum of it was kept") from None
    if kept != sha256(path).encode("ascii"):
        raise ResultError(path, "damaged (its checksum does not agree)")


def _checksum_file(path: Path) -> Path:
    return path.with_name(f".{path.name}.sha256")
