"""The record of a program language: how its files are recognised, read, interpreted and written."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from er3a.programs.evaluation import Dialect
from er3a.programs.instructions import Listing
from er3a.programs.lexing import ProgramText
from er3a.programs.syntax import Program
from er3a.programs.writing import WriteOptions, Writer

SIX_ANGLES = range(6, 7)


@dataclass(frozen=True)
class Language:
    """A language of robot programs.

    Attributes
    ----------
    title : what it is called
    suffixes : of its files, the usual one first, in small letters
    sign : what texts of the language have; None where the opening alone decides
    opening : with what all its texts begin, and those of no other language
    dialect : the meaning of its expressions, motions and functions when a program runs
    writer : None of a table over time (:func:`er3a.programs.csv_program.write_csv`)
    joints : how many joint angles a target can have; None for any number, of prismatic joints too
    points : suffix of the file with a program's points, where they stand in one of their own
    contents : suffix of a file that only lists a program's modules
    companions : what finds the files that belong to a program: modules that it calls, points, the controller's data
    """

    title: str
    suffixes: tuple[str, ...]
    sign: re.Pattern[str] | None
    reader: Callable[[ProgramText], Program]
    dialect: Callable[[], Dialect]
    writer: Callable[[Listing, WriteOptions], Writer] | None
    joints: range | None
    opening: str = ""
    points: str = ""
    contents: str = ""
    companions: Callable[[Path], tuple[Path, ...]] = lambda path: ()
