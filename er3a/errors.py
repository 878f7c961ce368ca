"""The errors of er3a: all derive from :class:`Er3aError`.

The command line prints such an error as one line and ends with exit code 2; anything else is a defect.
"""

from __future__ import annotations

import os
import stat
from pathlib import Path

from er3a.finding import Finding


class Er3aError(Exception):
    """Base class of all errors that a user can cause and correct."""


class InputError(Er3aError):
    """A file holds a value that can't be used. The message is always one line.

    Parameters
    ----------
    file : path of the file, or None for values given in Python
    field : where in the file, e.g. ``limits.rows[2].lower_deg`` or ``row 4, column x_mm``
    problem : what is wrong, with the offending value
    remedy : how to correct it
    """

    def __init__(self, file: str | Path | None, field: str | None, problem: str, remedy: str):
        self.file = None if file is None else _line(str(file))
        self.field = field if field is None else _line(field, 120)
        self.problem = _line(problem, 300)
        self.remedy = _line(remedy, 400)
        where = ": ".join(part for part in (self.file, self.field) if part)
        message = f"{self.problem}. {self.remedy}"
        super().__init__(f"{where}: {message}" if where else message)


EXTRAS = {
    "fast": ("numba",),
    "meshes": ("collada",),
    "vision": ("cv2",),
    "xacro": ("xacrodoc",),
    "study": (
        *(
            "babel",
            "coal",
            "contourpy",
            "filelock",
            "libusb_package",
            "matplotlib",
            "ompl",
            "open3d",
            "pandas",
            "pinocchio",
        ),
        *("pyarrow", "rerun", "snakemake", "snakemake_interface_logger_plugins", "toppra"),
    ),
}
"""The extras of er3a with the modules of the libraries that each brings."""


class MissingLibraryError(Er3aError, ImportError):
    """A library that a part of er3a needs is not installed.

    Parameters
    ----------
    module : its name where it is imported
    extra : of er3a, that brings it
    """

    def __init__(self, module: str, extra: str):
        self.module, self.extra = module, extra
        super().__init__(f"this needs {module}, which is not installed; pip install 'er3a[{extra}]'")


def with_extra(error: ModuleNotFoundError) -> ImportError:
    """The error of an import, naming the extra that brings what is missing.

    Parameters
    ----------
    error : as Python raised it

    Returns
    -------
    error : itself where no extra brings the module
    """
    module = (error.name or "").partition(".")[0]
    extra = next((extra for extra, modules in EXTRAS.items() if module in modules), "")
    return MissingLibraryError(module, extra) if extra else error


def given_bytes(path: Path, most: int, too_large: str) -> bytes:
    """The content of a file that a user gave.

    Parameters
    ----------
    most : bytes that it may have
    too_large : what to do about a larger one

    Raises
    ------
    InputError
        if it is missing, not a plain file, unreadable or too large
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(path, None, "not a file", "Check the path")
        if status.st_size > most:
            raise InputError(path, None, f"larger than {most} bytes", too_large)
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(path, None, "there is no such file", "Check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, None, f"can't be read ({reason})", "Check the path and its permissions") from None


class InputWarning(UserWarning):
    """A value in a file or an argument is allowed but looks like a mistake."""


class DoubtfulUnit(InputWarning):
    """A number in a file may be in another unit than its key says; no verdict that rests on it passes.

    Parameters
    ----------
    key : where it stands within ``part``, which is a piece of the file's content; of the whole file without one
    shown : the number with its unit; other : the unit that it may be in, in plural
    file : None for values given in Python
    """

    def __init__(
        self, key: str, shown: str, other: str, *, part: object = None, more: str = "", file: str | Path | None = None
    ):
        self.key, self.shown, self.other, self.part, self.more, self.file = key, shown, other, part, more, file
        where = ": ".join(_line(str(each)) for each in (file, key) if each)
        super().__init__(f"{where}: {shown} may be {other}{more}" if where else f"{shown} may be {other}{more}")

    def at(self, file: str | Path | None, key: str) -> DoubtfulUnit:
        """The same, with its file and its whole key."""
        return DoubtfulUnit(key, self.shown, self.other, more=self.more, file=file)


class ArgumentError(Er3aError, TypeError):
    """An argument has a type that can't be used."""

    def __init__(self, argument: str, given: object, expected: str):
        self.argument, self.expected = argument, expected
        shown = f"the text {given!r}" if isinstance(given, str) else f"of type {type(given).__name__}"
        super().__init__(_line(f"{argument} is {'None' if given is None else shown}; expected {expected}", 400))


class RobotError(Er3aError, ValueError):
    """A robot has values that no arm can have; ``problem`` names entry and joint."""

    def __init__(self, robot: str, problem: str):
        self.robot, self.problem = robot, problem
        super().__init__(f"{robot}: {problem}")


class ShapeError(Er3aError, ValueError):
    """An array argument has the wrong shape."""

    def __init__(self, argument: str, shape: tuple[int, ...], expected: str):
        self.argument, self.shape, self.expected = argument, shape, expected
        super().__init__(f"{argument} has shape {shape}; expected {expected}")


class PoseError(Er3aError, ValueError):
    """A 4x4 matrix is not a rigid transform, or holds NaN."""


class PathError(Er3aError, ValueError):
    """A segment of a sequence (numbered from 1) can't be used."""

    def __init__(self, segment: int, problem: str):
        self.segment, self.problem = segment, problem
        super().__init__(f"segment {segment} {problem}")


class NotWristPartitionedError(Er3aError):
    """The closed-form inverse does not apply to this arm; ``property_missing`` says which property it lacks."""

    def __init__(self, robot: str, property_missing: Finding):
        self.robot, self.property_missing = robot, property_missing
        super().__init__(
            f"{robot}: no closed-form inverse ({property_missing.code.replace('_', ' ')}); it needs parallel axes 2 "
            "and 3, and axes 4, 5 and 6 through one point"
        )


class ResultError(Er3aError):
    """A results file is missing, damaged or of another format version; run its stage again."""

    def __init__(
        self,
        file: str | Path,
        problem: str,
        remedy: str = "Delete the file and run the study again, which writes a new one",
    ):
        self.file = _line(str(file))
        self.problem = _line(problem, 300)
        self.remedy = remedy
        super().__init__(f"{self.file}: {self.problem}. {remedy}")


class WriteError(Er3aError):
    """A file can't be written: the disk is full or permission is missing. An existing file stays unchanged."""

    def __init__(self, file: str | Path, error: OSError):
        self.file = str(file)
        reason = os.strerror(error.errno) if error.errno else str(error)
        remedy = "Free disk space or fix the permissions, then run again"
        super().__init__(f"{_line(str(file))}: can't be written ({reason}). {remedy}")


def _line(text: str, most: int | None = None) -> str:
    """Text from a file, shortened and without control characters, so that it fits one line of a terminal."""
    shown = "".join(letter if letter.isprintable() else ascii(letter)[1:-1] for letter in text)
    return shown if most is None or len(shown) <= most else f"{shown[: most - 40]} ... {shown[-30:]}"
