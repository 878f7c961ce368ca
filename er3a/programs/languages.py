"""Programs read and written in the languages that are registered here: one record for each language.

:func:`read_program` detects a file's language and reads it; :func:`write_program` writes a sequence;
:func:`execute` runs what was read, by the language's dialect.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from er3a.by_value import frozen
from er3a.errors import InputError, ShapeError
from er3a.geometry.transforms import check_poses
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.programs.evaluation import MAX_ROBOT_AXES, Cell, Dialect
from er3a.programs.execution import Execution, Mover, RunLimits
from er3a.programs.instructions import JointTarget, Listing
from er3a.programs.krl.dialect import KrlDialect
from er3a.programs.krl.reader import companions as krl_files
from er3a.programs.krl.reader import read_krl
from er3a.programs.krl.writer import KrlWriter
from er3a.programs.lexing import ProgramText, read_program_text
from er3a.programs.machine import Machine
from er3a.programs.program_names import LanguageName
from er3a.programs.rapid.dialect import RapidDialect
from er3a.programs.rapid.reader import SUFFIXES as RAPID_SUFFIXES
from er3a.programs.rapid.reader import modules_of, read_rapid
from er3a.programs.rapid.writer import RapidWriter
from er3a.programs.rpl.dialect import RplDialect
from er3a.programs.rpl.reader import companions as rpl_files
from er3a.programs.rpl.reader import read_rpl
from er3a.programs.rpl.writer import RplWriter, XplWriter
from er3a.programs.rpl.xml_reader import read_xpl
from er3a.programs.syntax import Program
from er3a.programs.urscript.dialect import UrScriptDialect
from er3a.programs.urscript.reader import read_urscript
from er3a.programs.urscript.writer import UrScriptWriter
from er3a.programs.writing import WriteOptions, Writer, WrittenProgram
from er3a.robots.robot import Robot


@frozen
class Language:
    """A language of robot programs.

    Attributes
    ----------
    title : what it is called
    suffixes : of its files, the usual one first, in small letters
    sign : a regular expression that texts of the language match; empty where the opening alone decides
    opening : with what all its texts begin, and those of no other language
    dialect : the meaning of its expressions, motions and functions when a program runs
    joints : how many joint angles a target can have
    points : suffix of the file with a program's points, where they stand in one of their own
    contents : suffix of a file that only lists a program's modules
    companions : what finds the files that belong to a program: modules that it calls, points, the controller's data
    """

    title: str
    suffixes: tuple[str, ...]
    sign: str
    reader: Callable[[ProgramText], Program]
    dialect: Callable[[], Dialect]
    writer: Callable[[Listing, WriteOptions], Writer]
    joints: range
    opening: str = ""
    points: str = ""
    contents: str = ""
    companions: Callable[[Path], tuple[Path, ...]] = lambda path: ()


KRL_SIGN = r"(?im)^\s*(?:&ACCESS|(?:GLOBAL\s+)?DEF(?:FCT)?\s+[\w$\[\]\s]*\([^)]*\)\s*(?:;.*)?$|(?:S?PTP|S?LIN)\s+[{X])"
UR_SIGN = r"(?m)^\s*(?:def\s+\w+\(.*\)\s*:|move[jlpc]\(|set_tcp\()"
RPL_SIGN = r"(?m)\bM(?:JOINT|LIN)\s*\(|:=|^\s*END_\w+\s*;"
RAPID_SIGN = r"(?im)^\s*(?:%%%\s*$|MODULE\s+\w+|(?:LOCAL\s+)?PROC\s+\w+\s*\(|(?:CONST|PERS|VAR)\s+\w+\s+\w+.*:=\s*\[)"
SIX = range(6, 7)
UP_TO_SIX = range(1, MAX_ROBOT_AXES + 1)  # A1 to A6; E1 to E6 are axes beside the arm
LANGUAGES: dict[LanguageName, Language] = {
    "krl": Language(
        "KRL",
        (".src", ".sub"),
        KRL_SIGN,
        read_krl,
        KrlDialect,
        KrlWriter,
        UP_TO_SIX,
        points=".dat",
        companions=krl_files,
    ),
    "urscript": Language(
        "URScript", (".script", ".urscript"), UR_SIGN, read_urscript, UrScriptDialect, UrScriptWriter, SIX
    ),
    "rpl": Language(
        "RPL", (".pgm",), RPL_SIGN, read_rpl, RplDialect, RplWriter, SIX, points=".var", companions=rpl_files
    ),
    "xpl": Language("XPL", (".xpl",), "", read_xpl, RplDialect, XplWriter, SIX, opening="<"),
    "rapid": Language(
        *("RAPID", RAPID_SUFFIXES, RAPID_SIGN, read_rapid, RapidDialect, RapidWriter, SIX),
        contents=".pgf",
        companions=modules_of,
    ),
}
"""Languages by name, in the order in which their signs are looked for."""
SUFFIXES: dict[str, LanguageName] = {suffix: name for name, each in LANGUAGES.items() for suffix in each.suffixes}
KNOWN = ", ".join(f"{each.title} ({each.suffixes[0]})" for each in LANGUAGES.values())
WITHOUT_JOINTS = "Write a table (csv), or a language that has these joints"


def read_program(path: str | Path) -> Program:
    """Read a robot program in one of the registered languages.

    Raises
    ------
    InputError
        for a file that is none of these, or with unterminated blocks, strings or comments
    """
    path = Path(path)
    if path.suffix.lower() == ".csv":
        problem = "a table of joint values is a path, not a program"
        raise InputError(path, None, problem, "Name it in a path of kind table (docs/paths.md)")
    for each in LANGUAGES.values():
        held = {each.points: "holds the points", each.contents: "lists the modules"}.get(path.suffix.lower() or "none")
        if held is not None:
            remedy = f"Give its {each.suffixes[0]} file"
            raise InputError(path, None, f"{held} of a program, not the program", remedy)
    source = read_program_text(path)
    try:
        return LANGUAGES[language_of(source)].reader(source)
    except RecursionError:
        raise InputError(path, None, "is nested too deeply", "Split its longest lines") from None


def language_of(source: ProgramText) -> LanguageName:
    """The language of a text by what it holds; where that decides nothing, by the name of its file.

    Raises
    ------
    InputError
        if neither decides
    """
    if not source.text.strip():
        raise InputError(source.path, None, "is empty", f"Give a program in {KNOWN}")
    text, named = source.text.lstrip(), SUFFIXES.get(source.path.suffix.lower())
    opened = next((name for name, each in LANGUAGES.items() if each.opening and text.startswith(each.opening)), None)
    if opened is not None:
        return opened
    shown = [name for name, each in LANGUAGES.items() if each.sign and re.search(each.sign, source.text)]
    if named is not None and (named in shown or not shown or not LANGUAGES[named].sign):
        return named
    if not shown:
        raise InputError(source.path, None, "is not a known robot program", f"Give one in {KNOWN}")
    return shown[0]


def files_of(path: Path) -> tuple[Path, ...]:
    """A program's file and those that belong to it: modules that it calls, points, the controller's own data.

    Parameters
    ----------
    path : of the program

    Returns
    -------
    files : the program's first; it alone if its text is in none of the languages
    """
    try:
        return (path, *LANGUAGES[language_of(read_program_text(path))].companions(path))
    except InputError:
        return (path,)


def execute(
    program: Program,
    robot: Robot | None = None,
    start: Reals | None = None,
    frames: Mapping[str, Reals] | None = None,
    limits: RunLimits | None = None,
    mover: Mover | None = None,
) -> Execution:
    """Execute a program symbolically: its instructions in order, on every path through it.

    Parameters
    ----------
    robot : the arm, needed for partial and relative targets
    start : (n,), rad or m, joint values at the start of the program
    frames : T_flange_tool of tools and T_robot_base of bases (4, 4) in m, by the program's names for them
    mover : as of :class:`Machine`

    Raises
    ------
    InputError
        for an arm with another number of joints than the program's language or table supports
    ShapeError, PoseError
        for a start without one value for each joint, and a frame that is not a rigid transform
    """
    known = {name: check_poses(pose, name) for name, pose in (frames or {}).items()}
    cell = Cell(None, start, frames=known)
    if robot is not None:
        if reason := not_written(program.language, robot):
            raise InputError(program.file, None, reason, "Give the arm that the program is meant for")
        if start is not None and np.shape(start) != robot.lower.shape:
            raise ShapeError("start", np.shape(start), f"({len(robot.lower)},)")
        bare = robot.without_tool().replace(base=np.eye(4))
        cell = Cell(partial(forward, bare), start, robot.joints, known, robot.tool, np.eye(4))
    dialect = LANGUAGES[program.language].dialect()
    return Machine(program, dialect, cell, limits or RunLimits(), mover).run()


def write_program(listing: Listing, language: LanguageName, options: WriteOptions | None = None) -> WrittenProgram:
    """Write a listing as the files of a language; tables over time: :func:`er3a.programs.motion_table.write_csv`.

    Raises
    ------
    ValueError
        for a language that has no writer
    InputError
        for an arm for which the language has no joint targets
    """
    if language not in LANGUAGES:
        raise ValueError(f"no writer for {language!r}; known: {', '.join(LANGUAGES)}")
    options = options or WriteOptions()
    counts = {len(each.target.joints) for each in listing.motions if isinstance(each.target, JointTarget)}
    reasons = [not_written(language, options.robot)] if options.robot is not None else []
    for reason in (*reasons, *(_other_count(LANGUAGES[language], count) for count in sorted(counts))):
        if reason:
            raise InputError(None, None, reason, WITHOUT_JOINTS)
    return LANGUAGES[language].writer(listing, options).write()


def not_written(language: LanguageName, robot: Robot) -> str:
    """Why a language has no joint targets for an arm.

    Parameters
    ----------
    language : one of those registered, or a table over time (csv), which holds any joints

    Returns
    -------
    reason : in words, such as too many joints, or one that slides; empty if it has
    """
    if language == "csv":
        return ""
    if robot.slides.any():
        slide = int(robot.slides.argmax()) + 1
        return f"joint {slide} of this arm slides, and joint targets are read and written as angles"
    return _other_count(LANGUAGES[language], robot.joints)


def titles_unwritten(languages: Iterable[LanguageName], robot: Robot) -> list[str]:
    """Titles of those languages that have no joint targets for an arm.

    Parameters
    ----------
    languages : by their short names

    Returns
    -------
    titles : as people write them, such as ``KRL``, in the order given
    """
    return [LANGUAGES[each].title for each in languages if not_written(each, robot)]


def _other_count(language: Language, joints: int) -> str:
    """Why a language has no joint targets of so many angles; empty if it has."""
    known = language.joints
    if joints in known:
        return ""
    has = f"{known[0]} to {known[-1]}" if len(known) > 1 else str(known[0])
    return f"{language.title} gives an arm {has} joint angles, and this arm has {joints}"
