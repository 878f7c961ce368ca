"""The text of a program file, whatever its encoding."""

from __future__ import annotations

import codecs
import re
import stat
from dataclasses import dataclass
from pathlib import Path

from er3a.errors import InputError
from er3a.programs.program_findings import OtherEncoding

MAX_PROGRAM_BYTES = 32_000_000
MARKS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))
HIGH_RUNS = re.compile(rb"[\x80-\xff]+")
DECLARED = re.compile(r"""^\s*<\?xml[^>]*?encoding=["']([\w.-]+)["']""")


@dataclass(frozen=True)
class ProgramText:
    """A file's text with lines that end in line feeds."""

    path: Path
    text: str
    encoding: str

    @property
    def lines(self) -> tuple[str, ...]:
        """The lines without their ends."""
        return tuple(self.text.split("\n"))

    @property
    def findings(self) -> tuple[OtherEncoding, ...]:
        """What is to be said about the encoding."""
        return () if self.encoding == "utf-8" else (OtherEncoding(self.encoding),)


def read_program_text(path: Path) -> ProgramText:
    """Read a program file.

    Raises
    ------
    InputError
        if it is missing, too large, or no text
    """
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise InputError(path, None, "not a file", "Check the path")
        if status.st_size > MAX_PROGRAM_BYTES:
            raise InputError(path, None, f"larger than {MAX_PROGRAM_BYTES} bytes", "Programs are small text files")
        raw = path.read_bytes()
    except FileNotFoundError:
        raise InputError(path, None, "there is no such file", "Check the path") from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(path, None, f"can't be read ({reason})", "Check the path and its permissions") from None
    text, encoding = decoded(raw, path)
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    control = re.search(r"[\x00-\x08\x0e-\x19\x1b-\x1f]", text)
    if control is not None:
        line = text.count("\n", 0, control.start()) + 1
        raise InputError(
            path, f"line {line}", "holds control characters, so it is no text", "Export the program as text"
        )
    return ProgramText(path, text.rstrip("\x1a"), encoding)


def decoded(raw: bytes, path: Path | None = None) -> tuple[str, str]:
    """Text and encoding: by its mark, as UTF-8, as UTF-16 without a mark, as GBK, or as Windows-1252.

    Raises
    ------
    InputError
        if a file with a mark does not keep to it
    """
    for mark, encoding in MARKS:
        if raw.startswith(mark):
            try:
                return raw[len(mark) :].decode(encoding), encoding
            except UnicodeDecodeError as error:
                problem = f"begins as {encoding}, but is not"
                raise InputError(path, f"byte {error.start}", problem, "Save the file as UTF-8") from None
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = ""
    if text and "\x00" not in text:
        return text, "utf-8"
    for encoding, zeros in (("utf-16-le", raw[1::2]), ("utf-16-be", raw[::2])):
        if len(raw) % 2 == 0 and zeros.count(0) * 4 > len(raw):
            try:
                return raw.decode(encoding), encoding
            except UnicodeDecodeError:
                continue
    if text or not raw:
        return text, "utf-8"
    if all(len(run) % 2 == 0 for run in HIGH_RUNS.findall(raw)):
        try:
            return raw.decode("gb18030"), "gb18030"
        except UnicodeDecodeError:
            pass
    return raw.decode("cp1252", errors="replace"), "windows-1252"
