"""Writes a sequence in the language of a controller: :func:`write_program`."""

from __future__ import annotations

from er3a.programs.instructions import Listing
from er3a.programs.krl_writer import KrlWriter
from er3a.programs.rpl_writer import RplWriter, XplWriter
from er3a.programs.syntax import Language
from er3a.programs.urscript_writer import UrScriptWriter
from er3a.programs.writing import WriteOptions, Writer, WrittenProgram

WRITERS: dict[Language, type[Writer]] = {
    "krl": KrlWriter,
    "urscript": UrScriptWriter,
    "rpl": RplWriter,
    "xpl": XplWriter,
}


def write_program(listing: Listing, language: Language, options: WriteOptions | None = None) -> WrittenProgram:
    """A sequence as the files of a language; tables over time are written by
    :func:`er3a.programs.csv_program.write_csv`.

    Raises
    ------
    ValueError
        for a language that is none of krl, urscript, rpl, xpl
    """
    if language not in WRITERS:
        raise ValueError(f"no writer for {language!r}; known: {', '.join(WRITERS)}")
    return WRITERS[language](listing, options or WriteOptions()).write()
