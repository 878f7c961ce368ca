"""Atomic writes of files, and reading with one clear error.

Location of er3a's own robots, references, schemas and workflow: beside the package in a checkout, inside it in an
installed wheel (``tool.hatch.build.targets.wheel.force-include`` in ``pyproject.toml``).
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable
from pathlib import Path

from er3a.errors import ResultError, WriteError

_PACKAGE = Path(__file__).resolve().parents[1]
_IN_WHEEL = _PACKAGE / "shipped"

INSTALLED = _IN_WHEEL.is_dir()
ROOT = _IN_WHEEL if INSTALLED else _PACKAGE.parent


def own_or_shipped(place: str) -> Path:
    """The file or folder at a place such as ``data/robots/arm.yaml``: the study's own, otherwise er3a's.

    The study's folder is the current folder; all paths of a study are relative to it.
    """
    own = Path(place)
    return own if own.exists() else ROOT / place


def given_file(path: Path) -> Path:
    """A file named by the user: their own, otherwise er3a's at a place such as ``data/paths/arm.yaml``."""
    shipped = ROOT / path
    return shipped if path.parts[:1] == ("data",) and not path.exists() and shipped.is_file() else path


def names(folder: str, pattern: str) -> list[str]:
    """The file stems in a folder of the study or of the project, sorted."""
    places = (Path(folder), ROOT / folder)
    return sorted({path.stem for place in places for path in place.glob(pattern)})


def view_command(robot: str | None = None) -> str:
    """The command that shows the recordings of one robot or of all."""
    if INSTALLED:
        return f"er3a view {robot}" if robot else "er3a view"
    return f"make view ROBOT={robot}" if robot else "make view"


_TEMPORARY = re.compile(r"\..+\.[0-9]+(\.\w+)?")  # as `write_atomically` names them


def write_atomically(path: Path, write: Callable[[Path], object]) -> None:
    """Call ``write`` with a temporary path beside ``path``, then flush the finished file to disk and rename it.

    Raises
    ------
    WriteError
        naming ``path``, if the system does not allow it; an existing file stays unchanged
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
