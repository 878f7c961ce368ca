"""Writes a sequence in the language of a controller: :func:`write_program`."""

from __future__ import annotations

from er3a.errors import InputError
from er3a.programs.instructions import JointTarget, Listing
from er3a.programs.krl_writer import KrlWriter
from er3a.programs.rpl_writer import RplWriter, XplWriter
from er3a.programs.syntax import Language
from er3a.programs.urscript_writer import UrScriptWriter
from er3a.programs.writing import WriteOptions, Writer, WrittenProgram, not_expressed, other_count

WRITERS: dict[Language, type[Writer]] = {
    "krl": KrlWriter,
    "urscript": UrScriptWriter,
    "rpl": RplWriter,
    "xpl": XplWriter,
}
WITHOUT_JOINTS = "Write a table (csv), or a language that has these joints"


def write_program(listing: Listing, language: Language, options: WriteOptions | None = None) -> WrittenProgram:
    """A sequence as the files of a language; tables over time are written by
    :func:`er3a.programs.csv_program.write_csv`.

    Raises
    ------
    ValueError
        for a language that is none of krl, urscript, rpl, xpl
    InputError
        for an arm that the language has no joint targets for
    """
    if language not in WRITERS:
        raise ValueError(f"no writer for {language!r}; known: {', '.join(WRITERS)}")
    options = options or WriteOptions()
    counts = {len(each.target.joints) for each in listing.motions if isinstance(each.target, JointTarget)}
    reasons = [not_expressed(language, options.robot)] if options.robot is not None else []
    for reason in (*reasons, *(other_count(language, count) for count in sorted(counts))):
        if reason:
            raise InputError(None, None, reason, WITHOUT_JOINTS)
    return WRITERS[language](listing, options).write()
