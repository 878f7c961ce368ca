"""Files that are written whole or not at all, and read with one clear error."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path

from er3a.errors import ResultError, WriteError
from er3a.files.shipped import ROOT

_DIGEST_BYTES = hashlib.sha256().digest_size
_TEMPORARY = re.compile(r"\..+\.[0-9]+(\.\w+)?")  # as `write_atomically` names them


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary path beside ``path``, then move the finished file, kept on disk, into place.

    Raises
    ------
    WriteError
        naming ``path``, if the system refuses; the file that was there before stays
    """
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            write(temporary)
            with temporary.open("rb") as written:
                os.fsync(written.fileno())
            os.replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise WriteError(path, error) from None


def write_checked(path: Path, content: bytes) -> None:
    """Write bytes behind their checksum."""
    write_atomically(path, lambda file: file.write_bytes(hashlib.sha256(content).digest() + content))


def read_checked(path: Path) -> bytes:
    """Read what :func:`write_checked` wrote, or raise :class:`ResultError` if it is missing or damaged."""
    content = read_bytes(path)
    checksum, content = content[:_DIGEST_BYTES], content[_DIGEST_BYTES:]
    if hashlib.sha256(content).digest() != checksum:
        raise ResultError(path, "damaged (its checksum does not agree)")
    return content


def half_written(folder: Path) -> list[Path]:
    """The temporary files that killed processes left below a folder."""
    return [path for path in sorted(folder.rglob(".*")) if _TEMPORARY.fullmatch(path.name)]


def sha256(path: Path) -> str:
    """Checksum of a file, in hex."""
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def read_bytes(path: Path) -> bytes:
    """A file's content; :class:`ResultError` if it is missing or can't be read."""
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise ResultError(path, "missing", "Run the study, which writes it") from None
    except OSError as error:
        raise ResultError(path, f"can't be read ({error.strerror})") from None


def shown_path(path: Path) -> str:
    """Path from the project's root or the study's folder, so that the summary names no machine."""
    resolved = Path(path).resolve()
    for root in (ROOT, Path.cwd()):
        if resolved.is_relative_to(root):
            return resolved.relative_to(root).as_posix()
    return resolved.name
