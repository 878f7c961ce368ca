"""Atomic writes of files, and reading with one clear error.

Location of er3a's own robots, references, schemas and workflow: beside the package in a checkout, inside it in an
installed wheel (``tool.hatch.build.targets.wheel.force-include`` in ``pyproject.toml``).
"""

from __future__ import annotations

import hashlib
import os
import re
import time
from collections.abc import Callable
from pathlib import Path

from er3a.errors import ResultError, WriteError

_PACKAGE = Path(__file__).resolve().parents[1]
_IN_WHEEL = _PACKAGE / "shipped"

INSTALLED = _IN_WHEEL.is_dir()
ROOT = _IN_WHEEL if INSTALLED else _PACKAGE.parent


def own_or_shipped(place: str | Path) -> Path:
    """The file or folder at a place such as ``data/robots/arm.yaml``: the study's own, otherwise er3a's.

    Parameters
    ----------
    place : from the study's folder, which is the current folder; only one that begins with ``data`` is looked up among
        er3a's files

    Returns
    -------
    path : er3a's if the study has none at that place; else the path as it was given, whether or not it exists
    """
    own, shipped = Path(place), ROOT / place
    return shipped if own.parts[:1] == ("data",) and not own.exists() and shipped.exists() else own


def names(folder: str, pattern: str) -> list[str]:
    """The names of the files in a folder of the study and of er3a together.

    Parameters
    ----------
    folder : relative to both, such as ``data/robots``
    pattern : of ``glob``, such as ``*.yaml``

    Returns
    -------
    names : file names without folder and ending, each once, sorted
    """
    places = (Path(folder), ROOT / folder)
    return sorted({path.stem for place in places for path in place.glob(pattern)})


def view_command(robot: str | None = None) -> str:
    """The command that shows recordings, as a user would type it.

    Parameters
    ----------
    robot : name of one robot; None for the recordings of all

    Returns
    -------
    command : ``er3a view`` where er3a is installed as a package, ``make view`` in a checkout
    """
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
            with temporary.open("r+b") as written:  # Windows flushes only what may be written
                os.fsync(written.fileno())
            _replace(temporary, path)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        raise WriteError(path, error) from None


def write_text(path: Path, text: str) -> None:
    """Write a text atomically, as UTF-8 with the same line ends on all systems.

    Raises
    ------
    WriteError
        as :func:`write_atomically`
    """
    write_atomically(path, lambda file: file.write_bytes(text.encode()))


def _replace(temporary: Path, path: Path) -> None:
    """Rename a file over another one; Windows refuses while a scanner or a reader has that one open."""
    for wait in (0.05, 0.2, 1.0) if os.name == "nt" else ():
        try:
            os.replace(temporary, path)
            return
        except PermissionError:
            time.sleep(wait)
    os.replace(temporary, path)


def half_written(folder: Path) -> list[Path]:
    """The temporary files that killed processes left below a folder.

    Returns
    -------
    files : sorted; those named as :func:`write_atomically` names its temporary files. Those of processes that still run
        are among them.
    """
    return [path for path in sorted(folder.rglob(".*")) if _TEMPORARY.fullmatch(path.name)]


def sha256(path: Path) -> str:
    """Checksum of a file's bytes, SHA-256.

    Returns
    -------
    checksum : 64 hexadecimal digits

    Raises
    ------
    OSError
        if the file can't be read
    """
    return hashlib.sha256(Path(path).read_bytes()).hexdigest()


def read_bytes(path: Path) -> bytes:
    """A result file's content.

    Returns
    -------
    content : all bytes

    Raises
    ------
    ResultError
        if the file is missing, or the system refuses to read it
    """
    try:
        return Path(path).read_bytes()
    except FileNotFoundError:
        raise ResultError(path, "missing", "Run the study, which writes it") from None
    except OSError as error:
        raise ResultError(path, f"can't be read ({error.strerror})") from None


def from_here(path: str | Path) -> str:
    """A path as seen from the working folder.

    Returns
    -------
    path : relative; on Windows the whole one where it is on another drive
    """
    try:
        return os.path.relpath(path)
    except ValueError:
        return os.path.abspath(path)


def shown_path(path: Path) -> str:
    """A path from the project's root or the study's folder, so that results name no machine.

    Returns
    -------
    path : with forward slashes, relative to er3a's root or else the current folder; the bare file name of a path that
        is below neither
    """
    resolved = Path(path).resolve()
    for root in (ROOT, Path.cwd()):
        if resolved.is_relative_to(root):
            return resolved.relative_to(root).as_posix()
    return resolved.name
