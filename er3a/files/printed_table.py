"""A D-H table in any text, as columns with er3a's headings.

The text is cut into cells (:mod:`er3a.files.table_cells`, :mod:`er3a.files.table_code`), headings say what the columns
mean (:mod:`er3a.files.table_headings`), and cells are parsed (:mod:`er3a.files.arithmetic`). What can be read in two
ways is refused, with both.
"""

from __future__ import annotations

import html
import json
import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any, NoReturn

from er3a.by_value import frozen
from er3a.errors import InputError, given_bytes
from er3a.files.arithmetic import CALLED, TWO_VALUES, UNITS, CellAmount, amount_of, name_of, plain, words_of
from er3a.files.code_lists import Lists
from er3a.files.column_order import LIBRARIES, only_order, program
from er3a.files.csv_file import Lines
from er3a.files.program_text import BLOCK, Cells, Code
from er3a.files.table_cells import MARKS, Grid, Words, html_grids, latex_grids, line_grids, without_latex
from er3a.files.table_code import code_grids
from er3a.files.table_headings import Heading, heading_of, place_of, quantities_of
from er3a.formats.mesh_file import text_of
from er3a.numerics.si_units import RADIANS_BELOW_DEG
from er3a.robots.robot import CONVENTIONS, Convention

FIXED = "fixed", "tool"
NEEDED = frozenset({"a", "alpha", "d"})
PER_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
_SCALES = PER_MM | {"deg": 1.0, "rad": math.degrees(1.0)}
OWN = words_of("type theta beta calibrated direction convention lower upper speed")
_NUMBERED = re.compile(r"\d")
_TOOL = re.compile(r"tool|tcp|grip|hand|effector|^\s*g\s*$|工具|夹")  # a row's name, of what the flange carries
_CELL = (
    (r"[{}$]", ""),
    (r"\((?:t|float|double|fixed|var(?:iable|\.)?|[一-鿿]+)\)|(?<=[\w°])\s+(?:fixed|var(?:iable|\.)?)$", ""),
    (r"\[(mm|cm|m|in|deg|rad|°)\]", r" \1"),
    (r"""^(?:\w+\.)?symbols?\(["']([^"',]+)["'].*\)$""", r"\1"),
    (r"^(?:\*+|None|null|var(?:iable|\.)?|变量)(?=[-+]|$)", "q"),
    (r"\b[A-Za-z]\w*(?:::|\.(?=[A-Za-z]))", ""),
    (r"(?<=[\d.])f\b|^\*(?=[A-Za-z])", ""),
    (r"\^?\*+(?=$|\s*[-+])|(?<=\d)(?<!atan2)\s*\(\s*-?[\d.]+°?\s*,[^(),]*\)", ""),
    (r"^([^\W\d]\w*\d)\s*\((.+)\)$", r"\1+(\2)"),
)
"""Marks of variables in cells: of time, of SymPy, a star, and an offset in brackets."""
_STARRED = re.compile(r"^\*$|\w\^?\*+\s*(?:$|[-+])")
_COMMA = re.compile(r"([-+]?\d+),(\d+)((?:e[-+]?\d+)?\s*(?:°|mm|cm|m|in|deg|rad)?)", re.IGNORECASE)
_NAMED = re.compile(r"(?:[^\W\d]+\.?\s*)?\d+\s*:?")
_KINDS = words_of(
    "r=revolute 0=revolute continuous=revolute rot=revolute rotational=revolute rotary=revolute 旋转=revolute "
    "p=prismatic 1=prismatic linear=prismatic 移动=prismatic"
)
_KIND_SAID = re.compile(r"(revolute|prismatic)\W?\s*[:=]\s*([0-9])\b|\b([0-9])\s*[:=]\s*(revolute|prismatic)")
"""What a number of a type is, as a comment or an enumeration says it."""
_KIND_ELSEWHERE = re.compile(
    r"(?:Joint\([^;\n]*[\"'](?:prismatic|fixed)|types?\w*[\"']?\s*[:=][^\n\w]*(?:r(?:evolute)?\W*)*(?:prismatic|p[pr]*)\b|"
    r"(?:types?|sigma)\s*=\s*[\[{(][^\n]*(?:prismatic|\b1\b)|[%#/][^\n]*(?:\bprismatic\b|平动|移动关节))",
    re.I,
)
"""A joint that slides, said outside the table."""
_LISTS = re.compile(
    r"\b((?:(?!link_?offset)\w*offsets?(?:_[a-z]\w*)?)|th(?:eta)?_?0|"
    r"\w*(?:types?|sigma|signs?|directions?|dirs?|polarity|inv_joints?))\s*(?:\[\d*\])?\s*[:=]"
    r"\s*([\w.(]*)[\[{]([^\[\]{}]*[1-9a-z][^\[\]{}]*)[\]}](?:[ \t]*(\*[^;\n]+))?",
    re.I,
)
"""A list of offsets, of types, or of directions, and a call that its elements are in."""
_WORD = re.compile(r"[^,;\s\"']+")
_CONVERTED = "deg2rad(", "np.deg2rad(", "radians(", "np.radians("
_JOINTS_SAID = re.compile(r"(?i)\b(?:n(?:um(?:ber)?)?_?(?:of_)?)?(?:dofs?|joints)\s*=\s*(\d+)\b")
_TYPES = {*words_of("r p revolute prismatic fixed")}
_JOINTS = re.compile(r"Joint\([^;\n]*[\"'](revolute|prismatic|fixed)[\"']")
_TURN, _ARGUMENT = r"(?<![a-z])(?:\w+\.)?(?:t?rot_?|r_?)", r"\b(?:\([^()\n]*\))?"
_THEN = rf"{_ARGUMENT}\s*[@*]\s*(?:(?:\w+\.)?t(?!rot)\w*{_ARGUMENT}\s*[@*]\s*){{1,2}}"
"""A turn in a product of a row's transforms, and what is between two of them."""
SIGNS = {
    "modified": re.compile(
        rf"{_TURN}x{_THEN}{_TURN}z\b|"
        r"modified[\s_-]*(?:d-?h\b|denavit)|convention\W*[:=]\W*modified|(?:alpha|α)[\s_({\[]*i\s*-\s*1|"
        r"(?<![a-z])(?:revolute|serialmanipulator)?(?:mdh|moddh|dhm)(?![a-z])|khalil|改进|修改\s*d-?h|\bcraig(?:'?s)?\b|[\"']modified[\"']|"
        r"(?:(?:sin|cos)\([^\n,;*]{0,30}(?:al\w*|α)[^\n,;*]{0,9}\)|\b[sc]a)\s*\*\s*(?:[\w\]]+\.)*d(?:_?i)?\b|"
        r"\bd(?:_?i|isp\w*)?\s*\*\s*(?:\w+\.)*(?:(?:sin|cos)\([^\n,;*]{0,30}(?:al|α)|[sc]a\b)|"
        r"cos\((?P<twist>[^\n;]{1,40}?)\)[\s,;]+-(?:\w+\.)*sin\((?P=twist)\)[\s,;]+-[^,;\n]{0,40}sin\((?P=twist)\)",
        re.I,
    ),
    "standard": re.compile(
        rf"{_TURN}z{_THEN}{_TURN}x\b|"
        r"(?:standard|classic\w*)[\s_-]*(?:d-?h\b|denavit)|convention\W*[:=]\W*standard|stddh|(?<![a-z])sdh(?![a-z])|标准|"
        r"[\"'](?:standard|classic|normal)[\"']|"
        r"\b[ar](?:_?i)?(?:\s*\*\s*(?:\w+\.)*(?:cos\([^\n,;*]{0,30}(?:th|θ|q)|ct\b)|\s*·?\s*\\?cos[\s(\\]{1,2}(?:th|θ|q))|"
        r"(?:cos\([^\n,;*]{0,30}(?:th|θ|q)[^\n,;*]{0,9}\)|\bct)\s*\*\s*(?:[\w\]]+\.)*[ar](?:_?i)?\b",
        re.I,
    ),
}
"""What a text says of its convention: words, a toolbox's option, or the transform of a row, of which Craig's alone has
``d sin(alpha)``, whatever its names (``cos(x), -sin(x), -sin(x)*y``), and the other alone ``a cos(theta)``."""
_GIVEN = re.compile(
    r"""
    (?<![\w.\])}])(?:\w+\.)*([^\W\d]\w*(?:[_({\[]*\d+[)}\]]*)?)      # a name: a2, a_2, a(2), self.a2
    [ \t]*=(?!=)[ \t]*
    ((?:\((?:[^()\n]|\([^()\n]*\))*\)|[^=\n()])+?)                   # its value, with all of its brackets
    (?=[),;，；。%\#≈`\n]|:\s|$                                       # which ends at a mark,
    |\s+(?:and|und|et|y)\b                                          # a word,
    |(?<=[\w.°])\s+\((?:[^\W\d]{3,}[\s)]|[^()]*°\))                  # a remark in brackets,
    |\s+[^\W\d][\w{}]*[ \t]*=)                                      # or the next name
    (?:[;,]?[ \t]*[%\#]+[ \t]*[\[(]?(?:in[ \t]+)?(mm|cm|m|in(?![ \t]+\w))\b(?!\W*to\b))?  # a comment that says the unit
    """,
    re.VERBOSE,
)
"""A name that has a value."""

_OF_JOINT = r"(?:q|θ|th|theta|t|ang[a-z]*|joint[a-z]*|servo|motor)"
_JOINT = re.compile(rf"(?<!\w){_OF_JOINT}_?[\[(]?\d")
"""A variable of a joint, which one of another name may be given by: ``theta2 = q2 - pi/2``."""
_CHAIN = re.compile(
    r"(?<![=!<>])=(?=[^=\n]*[-+*/^(])[ \t]*-?[\w.()]+(?:[ \t]*[-+*/^][ \t]*[\w.()]+)*[ \t]*=(?=[ \t]*[-+.\d])"
)
_BOTH = re.compile(r"(?<![\w.])([^\W\d]\w*)[ \t]*=[ \t]*(?=[^\W\d]\w*[ \t]*=[ \t]*([-+\d.]+(?:[ \t]*(?:mm|cm|m)\b)?))")
"""One of two names that have a value, ``a2 = a3 = 125 mm``."""
_SEVERAL = re.compile(r"(?m)^[ \t]*(\w+(?:[ \t]*,[ \t]*\w+)+)[ \t]*=[ \t]*([^=\n(]+)$")
_ROW_SAID = r"(?m)^[ \t]*(?://|#|%)+[ \t]*([^\W\d]+)[ \t]*(\d)[ \t]*(?=:[ \t]*\[[^\]\n,]*,[^\]\n,]*,[^\]\n]*\][ \t]*$)"
"""The mark of a comment before a row, ``// Link 1: [0, 0, 135, th1]``."""
_NAMED_SUM = re.compile(r"[-+*/]\s*(?![qθ]|th)[^\W\d]|(?![qθ]|th)[^\W\d]\w*\s*[-+*/]")
"""Arithmetic with a constant that has a name, as a drawing has it and no pose."""
_IN_UNIT = re.compile(
    r"\b(?:length|unit|distance|dimension|measure)[\w \"']*[^.;]{0,25}?(?:\bin\b|[:=(\[])[\s\"']{0,2}"
    r"(mm|cm|m|inch|met(?:er|re)s?)\b",
    re.I,
)
"""What lengths are in, as a text says it."""
_LENGTH_UNIT = re.compile(r"(?<![\w.])(mm|cm|m(?!\s*=)|inch|[Mm]et(?:er|re)s?)\b")
_PLACED = r"\b(?:base|tool)(?:\s*=(?!=)|[\"']\s*,)[ \t]*(?![\s\"'\]})]|None|eye\(|SE3\(\)|transl\([0., ]*\))"
"""A base or tool that is put somewhere, other than at nothing."""
_CALL = re.compile(r"(?:\w+\.)*(\w+)\([\w.,\[\] ]*[^\W\d][\w.,\[\] ]*\)\s*")
"""A call of a function of names, whose value nobody knows."""


@frozen
class PrintedTable:
    """Lines as a file's lines, under er3a's headings; what was read into them, in words; columns of which neither the
    heading nor cells say the unit."""

    lines: Lines
    notes: tuple[str, ...]
    without_unit: frozenset[str] = frozenset()


MAX_BYTES = 200_000
LONGEST_IN_M = 2.5  # a link of a robot; the same number of mm is none
SMALLEST_DEG = 10.0  # of a twist without a unit
RIGHT_WITHIN = 1e-3  # rad and deg: right angles as printed with three decimals or more


def table_text(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16, or of standard input for ``-``; a cell in another encoding can't be read,
    a comment can be left out.

    Raises
    ------
    InputError
        if it is missing, too large or no text
    """
    pasted = str(path) == "-"
    raw = _pasted() if pasted else given_bytes(path, MAX_BYTES, "Give the table without the rest")
    return text_of(path, raw, errors="replace")


@cache
def _pasted() -> bytes:
    """Standard input, which can be read once."""
    return sys.stdin.buffer.read(MAX_BYTES)


def printed_table(
    path: Path, text: str, columns: Sequence[str] = (), convention: Convention | None = None
) -> PrintedTable | None:
    """The one D-H table in a text, under er3a's headings, its cells as numbers.

    Parameters
    ----------
    path : named in errors
    columns : what the columns mean, in their order, in place of their headings: ``theta``, ``d``, ``a``, ``alpha``,
        ``joint``, ``offset``, or ``-`` for one that is not read
    convention : the reader's, of a text that names both

    Returns
    -------
    table : None if no row of the text has the headings of a D-H table

    Raises
    ------
    InputError
        naming line and cell: for two tables, for what can be read in two ways, and for what can't be read
    """
    if '"cell_type"' in text:
        with suppress(ValueError, KeyError, TypeError):  # a notebook, if it is whole
            text = "\n\n".join("".join(cell["source"]) for cell in json.loads(text)["cells"])
    text = re.sub(r"(?m)^[ \t]*#define[ \t]+(\w+)(?:\(\w+\))?[ \t]+(.+)$", r"\1 = \2;", text)
    text = re.sub(r"&#?\w+;", lambda found: html.unescape(found[0]), text)
    if not re.search(r"(?m)^[ \t]*(?![#%]|//)\S", text):  # all of it is a comment
        text = re.sub(r"(?m)^[ \t]*(?:[#%]+|//+)", "", text)
    try:
        (found, from_code), *others = _tables(text, columns)
    except InputError as error:
        raise InputError(path, error.field, error.problem, error.remedy) from None
    if not found and (bare := re.sub(_ROW_SAID, r"\1\2", text)) != text:
        with suppress(InputError):
            (found, from_code), *others = _tables(bare, columns)
    tables = [*{str([row for _, row in table]): table for table in found[:9]}.values()]
    ranks = [(*_has_twists(table), "theta" in map(place_of, table[0][1])) for table in tables]
    if from_code:  # which has colours, poses and symbols, too
        tables = [table for table, rank in zip(tables, ranks) if rank == max(ranks)]
    if not tables:
        return None
    tables += [grid for grids, _ in others for grid in grids if _differ(tables[0], grid)]
    pair = len(tables) == 2 and not from_code
    twice = [one for one in tables if pair and _moved_on(one, *tables)]
    if twice:
        convention = convention or "standard"
        tables = [one for one in tables if (one is twice[0]) == (convention == "standard")]
    if len(tables) > 1:
        problem = f"{len(tables)} D-H tables, at lines {' and '.join(str(t[0][0] or t[1][0]) for t in tables[:2])}"
        raise InputError(path, None, problem, "Give a file with one of them")
    made = _Table(path, text, tables[0], from_code, convention)
    if twice:
        made.convention = convention
        made.notes[:] = [f"of two tables, one arm's in both conventions, the {convention} one was read"]
    return made.converted()


def _moved_on(one: Grid, *both: Grid) -> bool:
    """Whether of two tables the other is the same arm's modified one: its a and alpha stand a row later."""
    found = list[dict[str, list[Any]]]()
    for (_, header), *rows in (one, *(table for table in both if table is not one)):
        columns = {name: [row[k] for _, row in rows] for k, each in enumerate(header) for name in quantities_of([each])}
        try:
            numbers = {name: [amount_of(cell).number for cell in columns[name]] for name in sorted(NEEDED)}
        except (KeyError, ValueError):
            return False
        found.append(numbers | {"theta": [re.sub(r"\W", "", cell) for cell in columns.get("theta", [])]})
    same = (found[0][name][:-1] == found[-1][name][1:] for name in ("a", "alpha"))
    alike = all(found[0][name][:-1] == found[-1][name][:-1] for name in ("d", "theta"))
    return len(found) == 2 and all(same) and alike and found[0]["a"] != found[1]["a"]


def _differ(one: Grid, other: Grid) -> bool:
    """Whether each of two tables has a length that the other lacks, in whatever unit: their digits are compared."""
    first, second = _lengths(one), _lengths(other)
    return bool(first - second and second - first)


def _has_twists(table: Grid) -> tuple[bool, bool]:
    """Whether each twist of a table is 0, a multiple of 45 degrees, or an angle with its unit or of 10 degrees on, and
    any is not 0."""
    (_, header), *rows = table
    any_twist = False
    for cell in (cell for _, row in rows for name, cell in zip(header, row) if quantities_of([name]) == ["alpha"]):
        with suppress(ValueError):
            found = amount_of(re.sub(r"(?<=[\d.])f\b|\b[a-z]\w*(?:::|\.)", "", cell))
            size, off = abs(found.number), abs(math.remainder(found.number, math.pi / 4))
            if not found.variables and (found.unit or not size or size > SMALLEST_DEG or off < RIGHT_WITHIN < size):
                any_twist |= size > 0
                continue
        return False, False
    return True, any_twist


def _lengths(table: Grid) -> set[str]:
    """The digits of a table's lengths without zeros at their ends."""
    (_, header), *rows = table
    own = (cell for _, row in rows for name, cell in zip(header, row) if quantities_of([name]) in (["a"], ["d"]))
    return {each.strip("0") for each in re.findall(r"(?<!\w)\d+", " ".join(own).replace(".", ""))}


def table_in(path: Path) -> bool:
    """Whether a file, or standard input for ``-``, holds a D-H table.

    Raises
    ------
    InputError
        for a table that can't be read
    """
    small = str(path) == "-" or (path.is_file() and path.stat().st_size < MAX_BYTES)
    return small and printed_table(path, table_text(path)) is not None


def is_printed_table(header: Iterable[str]) -> bool:
    """Whether a table's headings are those of a D-H table, printed or er3a's own.

    Parameters
    ----------
    header : column names in any order; further columns are allowed

    Returns
    -------
    found : whether a, alpha and d are all among them
    """
    return {*quantities_of(map(str.strip, header))} >= NEEDED


def nearest_headings(text: str) -> str:
    """The line of a text with most headings of a D-H table, and what is missing among them, in words; "" if no line has
    two."""
    rows = (row for _, grid in line_grids(text) for row in grid)
    line, cells = max(rows, key=lambda row: len({*quantities_of(row[1])}), default=(0, []))
    found = quantities_of(cells)
    missing = ", ".join(sorted(NEEDED.difference(found))) or "rows below"
    return f"line {line} has headings of {', '.join(found)}, and lacks {missing}" if len({*found}) > 1 else ""


_UNNAMED = -1
"""The line of headings that no text has."""


# Where the table is ---------------------------------------------------------------------------------------------------


def _tables(text: str, columns: Sequence[str]) -> list[tuple[list[Grid], bool]]:
    """All tables of the first reader that finds one, their headings first, and whether they are a program's; then those
    of the other readers, but for cells between blanks or commas, which programs have, too."""
    found: list[tuple[list[Grid], bool]] = []
    refused: InputError | None = None
    for read, kind in _readers(text, columns):
        if (found or refused) and kind == "lines":
            break
        try:
            tables = [_with_names(_first_columns(table)) for grid in read() for table in _headed(grid, columns)]
            found += [(tables, kind == "program")] if tables else []
        except InputError as error:
            if not found and "of a loop" not in error.problem:
                raise
            refused = refused or error
    if refused and not found:
        raise refused
    bare = [] if found else code_grids(text, headed=False)
    orders = [(order, grid) for grid in bare if (order := only_order(grid))]
    if len(orders) == 1:
        return [([[(_UNNAMED, order), *grid] for order, grid in orders], True)]
    if bare:
        problem = f"a matrix whose columns have no names: {', '.join(bare[0][0][1])[:60]}"
        remedy = "Say what they are: --column theta,d,a,alpha, or --column alpha,a,theta,d, or as they are meant"
        raise InputError(None, f"line {bare[0][0][0]}", problem, remedy)
    return found or [([], False)]


def _readers(text: str, columns: Sequence[str]) -> Iterator[tuple[Callable[[], list[Grid]], str]]:
    """What reads a text, and what it takes it for: marks of a document, a program, or lines."""
    if columns:
        bare = (grid for grid in code_grids(text, headed=False) if len(grid[0][1]) == len(columns))
        yield partial(list, [[(0, [*columns]), *grid] for grid in bare]), "program"
    yield lambda: html_grids(text) or latex_grids(text), "marks"
    yield lambda: code_grids(text), "program"
    for mark, grid in line_grids(text):
        yield partial(list, [grid]), "marks" if mark == MARKS[0] else "lines"
    yield lambda: _stacked(text), "lines"


def _headed(grid: Grid, columns: Sequence[str]) -> list[Grid]:
    """The tables of a grid: rows of headings, each with the rows below it."""
    tables: list[Grid] = []
    open_one, broken = False, 0
    width = len(columns)
    for line, cells in grid:
        if len(cells) == 1 + (width or (len(tables[-1][0][1]) if tables else 0)) and not cells[-1]:
            cells = cells[:-1]  # the mark at the end of a line
        titled = is_printed_table(cells)
        if titled and columns and len(cells) != width:
            if width in (len(other) for _, other in grid):
                continue
            raise InputError(
                None,
                f"line {line}",
                f"--column names {width} columns, and the table has {len(cells)}",
                "Name each, - for one that is not read",
            )
        if titled or (columns and len(cells) == width and not tables and _numeric(cells)):
            tables.append([(line, list(columns) or cells)])
            if not titled:
                tables[-1].append((line, cells))
            open_one, broken = True, 0
        elif open_one:
            filled = [cell for cell in cells if cell]
            header = tables[-1][0][1]
            if len(tables[-1]) == 1 and filled and all(map(_unit_in, filled)) and len(cells) == len(header):
                tables[-1][0] = line, [f"{name} [{unit}]" for name, unit in zip(header, map(_unit_in, cells))]
            elif len(filled) < 2 or all("=" in cell for cell in filled):
                broken = line
            elif not _numeric(filled) and (broken or len(cells) != len(header)):
                open_one = False
            elif broken and len(tables[-1]) > 1:
                raise InputError(None, f"line {broken}", "a line of text within the table", "Remove it")
            else:
                tables[-1].append((line, cells))
    return [table for table in tables if len(table) > 1] or _turned(grid)


def _numeric(cells: Words) -> bool:
    return 2 * sum(bool(re.search(r"\d|π", cell)) for cell in cells) > len(cells)


def _unit_in(cell: str) -> str:
    return UNITS.get(plain(cell).strip("()[] .").lower(), "")


def _with_names(table: Grid) -> Grid:
    """A table with a heading for a first column of joints' names or numbers that has none."""
    (line, header), *rows = table
    firsts = [cells[0] for _, cells in rows if len(cells) == len(header) + 1]
    named = len(firsts) == len(rows) and all(map(_NAMED.fullmatch, firsts))
    return [(line, ["joint", *header]), *rows] if named else table


def _first_columns(table: Grid) -> Grid:
    """A table without further columns whose headings are not as many as their cells, as on pages of Universal Robots:
    all of its own cells hold numbers, and a word follows them."""
    header, rows = table[0][1], [cells for _, cells in table[1:] if len(cells) != len(table[0][1])]
    width = 1 + max((k for k, name in enumerate(header) if quantities_of([name])), default=-1)
    ended = [cells for cells in rows if len(cells) > width and re.fullmatch(r"[^\W\d]+", cells[width])]
    cut = ended and all(re.search(r"\d|π", cell) for cells in ended for cell in cells[1:width])
    return [(line, cells[:width]) for line, cells in table] if cut and len(ended) == len(table) - 1 else table


def _stacked(text: str) -> list[Grid]:
    """A table that was copied with each cell on a line of its own, as far as its rows are a table's."""
    lines = without_latex(plain(text)).split("\n")
    cells = [(number, line.strip()) for number, line in enumerate(lines, 1) if line.strip()]
    titles = "".join("t" if heading_of(cell) else " " for _, cell in cells)
    for found in re.finditer("t{4,}", titles):
        width, first = len(found[0]), found.start()
        starts = range(first, len(cells), width)
        grid = [(cells[k][0], [cell for _, cell in cells[k : k + width]]) for k in starts]
        if is_printed_table(grid[0][1]):
            end = next((k for k, (_, row) in enumerate(grid) if k and not (len(row) == width and _numeric(row))), None)
            if end and re.fullmatch(r"[-\d.]+", grid[end][1][0]):
                raise InputError(None, f"line {grid[0][0]}", "cells are missing in the last row", "Add them")
            return [grid[:end]]
    return []


def _turned(grid: Grid) -> list[Grid]:
    """A table whose rows are what columns usually are."""
    rows = [(line, cells) for line, cells in grid if len(cells) > 2 and heading_of(cells[0])]
    if not is_printed_table(cells[0] for _, cells in rows) or not all(_numeric(cells[1:]) for _, cells in rows):
        return []
    alike = len({len(cells) for _, cells in rows}) == 1
    return [[(rows[0][0], list(column)) for column in zip(*(cells for _, cells in rows))]] * alike


def _with_lists(path: Path, text: str, grid: Grid) -> Grid:
    """A program's table with a separate list of types as a column, and one of offsets if no theta is in the table; a
    list of directions is asked back, as an offset may be added before or after."""
    (line, header), *rows = grid
    lists = [
        (name, [f"{call}{cell}){factor}" if call in _CONVERTED else cell + factor for cell in _WORD.findall(cells)])
        for name, call, cells, factor in _LISTS.findall(text)
    ]
    found = [each for each in lists if len(each[1]) > 1]  # not an element: offset = table[i]
    own = "".join(cell for _, row in rows for each, cell in zip(header, row) if quantities_of([each]) == ["offset"])
    of_links = re.search(r"(?s)SerialLink\(.*\boffset\s*=\s*(?:\[[^\]]*\]|\w+)\s*[*;\s]", text)
    for name, cells in [("type", _JOINTS.findall(text)), *found]:
        quantities, said = quantities_of(header), {each.lower() for each in cells}
        of_types, of_signs = (re.search(words, name, re.I) for words in ("type|sigma", "sign|dir|polar|inv"))
        if of_types:
            settled = "type" in header or not said <= _TYPES
        else:
            settled = "direction" in header or not said & {"-1", "-1.0"} if of_signs else bool(own.strip("0."))
        of_angles = re.match(r"(?i)(?:th|q|joint|angle).*offset", name) and f"- {name}" not in text
        whole = len(cells) == len(rows)
        if settled or not (whole or of_angles):
            continue
        added = (name == "offset" and of_links) or (of_angles and not {"theta", "offset"} & {*quantities})
        if of_signs or not (of_types or (whole and added)):
            what = "directions" if of_signs else "offsets"
            raise InputError(
                path,
                f"line {text.count(chr(10), 0, text.index(name)) + 1}",
                f"'{name}' may be {what} of the table's joints, and no column holds them",
                "Add a column direction, or add offsets to theta, or remove that line",
            )
        unit = re.search(r"_(?:deg|rad)$", name.lower())
        header = [*header, "type" if of_types else f"offset{unit[0] if unit else ''}"]
        rows = [(number, [*row, cell]) for (number, row), cell in zip(rows, cells)]
    return [(line, header), *rows]


# What it says ---------------------------------------------------------------------------------------------------------


class _Table:
    """A table with its headings, of which each cell becomes an amount."""

    def __init__(self, path: Path, text: str, grid: Grid, from_code: bool, convention: Convention | None):
        self.path, self.notes, self.unsaid = path, Words(), set[str]()
        of_words = re.sub(r"\*\*([\w ]+)\*\*", r"\1", text)
        without_comments = re.sub(r"(?m)^[ \t]*(?:[%#]|//).*$", "", BLOCK.sub("", of_words))
        self.text = without_comments if from_code else without_latex(plain(of_words))
        grid = _with_lists(path, self.text, grid) if from_code else grid
        self.header, self.rows = [name.strip() for name in grid[0][1]], grid[1:]
        if grid[0][0] == _UNNAMED:
            order = ", ".join(self.header)
            why = "in other orders two joints turn about one line"
            self.notes.append(f"columns without names were read as {order}: {why}")
        for line, cells in self.rows:
            if len(cells) != len(self.header):
                raise InputError(
                    path,
                    f"row {line}",
                    f"{len(cells)} fields where the header has {len(self.header)}: {', '.join(self.header)[:80]}",
                    "Correct the separators, or say what the fields of a row are: --column joint,theta,d,a,alpha",
                )
        found = {k: own for k, name in enumerate(self.header) if (own := heading_of(name))}
        if "theta_deg" in self.header and not {"type", "offset_deg"} & set(self.header):
            found[self.header.index("theta_deg")] = Heading("theta", "deg", False)
        labels = [k for k, own in found.items() if own.quantity == "joint"]
        self.headings = {k: own for k, own in found.items() if k not in labels[1:]}
        self.column = dict[str, int]()
        self.from_code = from_code
        self.of_toolbox = from_code and bool(re.search(r"\bSerialLink\(|\bLink\(\[", self.text))
        self.given = self._given(Lists(program(text)) if from_code else None)
        self._check_headings(text)
        self.convention = self._stated(program(text) if from_code else None, text, convention)
        # Below its print the Robotics Toolbox writes both, as translations t.
        if re.search(_PLACED if from_code else r"\b(?:base|tool)\W+t\s*=", text):
            self.notes.append("base and tool of the text are not read")
        self.amounts = {name: self._amounts(k) for name, k in self.column.items() if name not in ("joint", "type")}
        self.lengths = self._said_unit(text)
        self.kinds = self._kinds(text)
        self._offset_slides()
        if from_code and "type" not in {*self.column, *self.header} and (kind := _KIND_ELSEWHERE.search(self.text)):
            raise InputError(path, "types of joints", f"'{kind[0]}' is no column of the table", "Add a column of types")
        moving = len(self.kinds) - sum(map(self.kinds.count, FIXED))
        said = [int(each) for each in _JOINTS_SAID.findall(text)] if from_code else []
        if said and max(said) < moving:
            problem = f"the table has {moving} rows that move, and the text says {max(said)} joints"
            raise InputError(path, "joints", problem, "Leave out rows of flange and tool, or name them so")
        self.columns: dict[str, Words] = {"joint": self._joints()}

    def _refuse(self, row: int | None, k: int, problem: str, remedy: str) -> NoReturn:
        place = f"column {self.header[k]}"
        raise InputError(self.path, place if row is None else f"row {self.rows[row][0]}, {place}", problem, remedy)

    def _said_unit(self, text: str) -> Words:
        """The unit of lengths that a text says, if it names no other and converts none; metres are known by numbers."""
        longest = max((abs(each.number) for name in ("a", "d") for each in self.amounts[name] if each), default=0.0)
        units = {UNITS[each.lower()] for each in _LENGTH_UNIT.findall(text)}
        said = _IN_UNIT.search(text) and not re.search(r"100\b|1000\b|(?<!\d)0?\.0+1\b|25\.4|1e-?3", text)
        return [*units - {"m"}] if said and len(units) == 1 and longest > LONGEST_IN_M else []

    def _check_headings(self, text: str) -> None:
        """Refuse two columns of one quantity, but for angles in both units; and d beside r, of which either can be the
        link's length, where no convention is said: of modified tables it is Khalil's d."""
        for k, own in [*self.headings.items()]:
            first = self.column.setdefault(own.quantity, k)
            if k != first and own.unit != self.headings[first].unit and self._alike(first, k):
                self.headings = {place: each for place, each in self.headings.items() if place != k}
            elif k != first:
                other = self.header[first]
                self._refuse(
                    None,
                    k,
                    f"it and column '{other}' both mean {own.quantity}",
                    "Say what the columns are, - for one that is not read: --column joint,theta,d,a,alpha",
                )
        signs = [own.sign if own.sign in ("d", "r") else own.quantity for own in self.headings.values()]
        if [each for each in signs if each in ("alpha", "d", "r")] == ["alpha", "d", "r"] and signs[0] != "theta":
            modified, standard = (bool(SIGNS[name].search(text)) for name in ("modified", "standard"))
            if modified and not standard:
                a, d = self.column["a"], self.column["d"]
                self.column |= {"a": d, "d": a}
                for k, quantity in ((a, "d"), (d, "a")):
                    self.headings[k] = replace(self.headings[k], quantity=quantity)
            elif modified == standard:
                self._refuse(
                    None,
                    self.column["a"],
                    "columns d and r: either can be the link's length",
                    "Say which by --column: a for d and d for r (Khalil), or d for d and a for r",
                )

    def _alike(self, *columns: int) -> bool:
        """Whether two columns hold the same angles, by the units of their headings."""
        scales = [_SCALES[self.headings[k].unit] if self.headings[k].unit in ("deg", "rad") else 0.0 for k in columns]
        try:
            one, other = ([amount_of(cells[k]).number for _, cells in self.rows] for k in columns)
        except ValueError:
            return False
        return all(scales) and all(abs(a * scales[0] - b * scales[1]) < 0.1 for a, b in zip(one, other))

    def _stated(self, code: Code | None, text: str, asked: Convention | None) -> Convention | None:
        """The convention that headings, the program, or the text around the table says, a program before words; the
        one asked for where these say both."""
        if "convention" in self.header:
            return None
        if {own.before for own in self.headings.values() if own.quantity in ("a", "alpha")} == {True}:
            self.notes.append("a and alpha of the link before the joint (i-1): read as modified D-H (Craig)")
            return "modified"
        near = "\n".join(text.split("\n")[max(self.rows[0][0] - 10, 0) : self.rows[-1][0]])
        library = {each for library, (_, each) in LIBRARIES.items() if each and re.search(library, text)}
        library |= code.conventions if code else set()
        for part in (code.text if code else "", near, text):
            said = library | {name for name, sign in SIGNS.items() if sign.search(part)}
            if len(said) > 1 and asked:
                return asked
            if len(said) > 1 and part is not text:
                remedy = "Give --convention, or leave one of them"
                raise InputError(self.path, "convention", "the text says standard and modified D-H", remedy)
            for one in CONVENTIONS if len(said) == 1 else ():
                if one in said:
                    self.notes.append(f"the text says {one} D-H, and was read so")
                    return one
        return None

    def _given(self, lists: Lists | None) -> Cells:
        """Values of symbols, as expressions; a symbol with two values has none."""
        # a2 = sqrt(3^2 + 4^2) = 5: what it amounts to
        self.text = re.sub(_CHAIN, "=", self.text)
        pairs = (zip(names.split(","), values.split(",")) for names, values in _SEVERAL.findall(self.text))
        self.text = "\n".join(
            [_SEVERAL.sub("", self.text), *(f"{name} = {value}" for each in pairs for name, value in each)]
        )
        self.text = re.sub(r"(?<![\w.,])(\d+),(\d+)(?=\s*(?:mm|cm|m)\b)", r"\1.\2", self.text)
        self.text = re.sub(_BOTH, r"\1 = \2, ", self.text)
        given = _GIVEN.findall(self.text)
        given += re.findall(r"[{,]\s*([a-z]\w*\d)\s*:\s*([-\d.]+)()(?=\s*[,}])", self.text)
        given += ((name, TWO_VALUES, "") for name in re.findall(r"(\w+)[ \t]*[-+*/]=(?!=)", self.text))
        found: Cells = {}
        for name, value, unit in given:
            made = _CALL.fullmatch(value)
            if made and made[1] not in CALLED and name in found:
                found[name] = TWO_VALUES
            elif not re.search(r"[\"']|\[(?!\d+\])|\(\)$", value) and (made is None or made[1] in CALLED):
                value = f"({value}) {unit}" if unit else value.rstrip(" \t.")
                value = lists.resolved(value) if lists else value
                found[name] = value if found.get(name, value) == value else TWO_VALUES
        plainly: Cells = {}
        for name, value in found.items():
            plainly[name_of(name)] = value if plainly.get(name_of(name), value) == value else TWO_VALUES
        return plainly | found

    def converted(self) -> PrintedTable:
        """The table under er3a's headings, with variables taken out of the cells of theta and d.

        Returns
        -------
        table : its lines as those of a file, the header first. Offsets and directions come from cells such as
            ``q2-90``. The convention is modified if a and alpha belong to link i-1, and no column names another one.
        """
        unused = []
        for k, name in enumerate(self.header):
            quantity = self.headings[k].quantity if k in self.headings else ""
            stem = re.sub(r"_(m|in|cm|rad|mm|deg)(_s)?$", "", name)
            if quantity == "theta":
                self._theta(k)
            elif quantity not in ("", "joint", "type"):
                self._constants(k, quantity)
            elif not quantity and stem in OWN:
                self.columns[name] = [cells[k] for _, cells in self.rows]
            elif not quantity and name not in ("", "-"):
                unused.append(name)
                if {cells[k].strip() for _, cells in self.rows} == {"0", "1"} and "type" not in {
                    *self.column,
                    *self.header,
                }:
                    self._refuse(
                        None, k, "0 and 1 may be types of joints", "Say so by --column: type, or - if it is not read"
                    )
        signs = [self._variable(row)[1] for row in range(len(self.rows))]
        if min(signs) < 0:
            if "direction" in self.header:
                self._refuse(None, self.header.index("direction"), "signs of variables are directions too", "Keep one")
            self.columns["direction"] = ["-1" if sign < 0 else "1" for sign in signs]
        if set(self.kinds) - {"revolute"} or "type" in self.columns:
            self.columns["type"] = self.kinds
        if self.convention:
            self.columns["convention"] = [self.convention] * len(self.kinds)
        if unused:
            self.notes.append(f"not used: {', '.join(unused)}")
        made = [(line, list(cells)) for (line, _), cells in zip(self.rows, zip(*self.columns.values()))]
        return PrintedTable([(0, list(self.columns)), *made], tuple(self.notes), frozenset(self.unsaid))

    def _amounts(self, k: int) -> list[CellAmount | None]:
        """The amounts of a column's cells; None for an empty one."""
        cells = [cells[k] for _, cells in self.rows]
        commas = [found for cell in cells if (found := _COMMA.fullmatch(cell.strip()))]
        thousands = [found[0] for found in commas if len(found[2]) == 3 and found[1].strip("+-") != "0"]
        if thousands and len(thousands) == len(commas):
            self._refuse(
                None,
                k,
                f"'{thousands[0]}' is not a number",
                "Write a number with a point before decimals and nothing between thousands",
            )
        cells = [_COMMA.sub(r"\1.\2\3", cell) for cell in cells] if commas else cells
        return [self._amount(row, k, cell) for row, cell in enumerate(cells)]

    def _amount(self, row: int, k: int, cell: str) -> CellAmount | None:
        text = plain(without_latex(cell)).strip().rpartition("=")[2]
        for pattern, plainly in _CELL:
            text = re.sub(pattern, plainly, text, flags=re.IGNORECASE)
        if not text:
            return None
        given = self.given
        if self.headings[k].quantity == "theta":  # a value of a joint there is a pose
            given = {
                name: value
                for name, value in given.items()
                if not re.fullmatch(rf"{_OF_JOINT}_?\d*", name)
                or (_JOINT.search(value) and name_of(name) not in name_of(value))
            }
        try:
            found = amount_of(text, given)
        except ValueError as error:
            self._refuse(
                row,
                k,
                f"'{cell}' {error}",
                "Write a number without a unit, or arithmetic with pi and names whose values are given",
            )
        turned = math.degrees(1.0) if found.unit == "rad" else 1.0  # a variable in degrees: theta1*pi/180
        names = {name: times for name, times in found.variables.items() if times}
        names = {name: times if abs(times) == 1.0 else round(times * turned, 9) for name, times in names.items()}
        if len(names) > 1:
            self._refuse(row, k, f"'{cell}' holds two variables", f"Give a value: {min(names)} = ... below the table")
        for name in names if self.headings[k].quantity == "theta" else ():
            own = heading_of(name)
            if not (_NUMBERED.search(name) or (own and own.quantity == "theta")):
                self._refuse(row, k, f"'{name}' has no value", f"Write {name} = ... below the table")
        if {*map(abs, names.values())} - {1.0}:
            self._refuse(row, k, f"'{cell}' is not a number", "Write a number")
        return replace(found, variables=names)

    def _kinds(self, text: str) -> Words:
        """The type of each row: its d slides if that is a variable, and theta none; nothing moves in a row that has no
        variable although others have one, or at an end if it alone has no number in its name."""
        k = self.column.get("type", self.header.index("type") if "type" in self.header else None)
        if k is not None:
            types = [re.sub(r"^[a-z]\w*\.", "", cells[k].strip().lower()) for _, cells in self.rows]
            if self.from_code and "prismatic" in types:  # a class has a default
                types = [each or "revolute" for each in types]
            given = {number or other: kind or word for kind, number, other, word in _KIND_SAID.findall(text.lower())}
            if not {*types} <= {*given} or "revolute" not in map(given.get, types):  # or how many there are of a kind
                given = _KINDS
                if {*types} == {"1"}:
                    self._refuse(
                        None, k, "1 may be a joint that turns or one that slides", "Write revolute or prismatic"
                    )
            return [given.get(each, each) for each in types]
        turns, slides = ([bool(each and each.variables) for each in self._of(name)] for name in ("theta", "d"))
        blank = [each is None for each in self._of("theta")]  # which says nothing of what moves
        starred = [bool(_STARRED.search(cells[self.column["d"]].strip())) for _, cells in self.rows]
        moving = any(turns) or any(starred)
        zeros = [bool(each and not each.number) for each in self._of("theta")]
        if not moving and any(blank) and any(zeros):
            self._refuse(
                zeros.index(True),
                self.column["theta"],
                "0 among blank cells may be a joint, or a row where nothing moves",
                "Write q1, q2, ... where a joint turns",
            )
        names = [
            cells[self.column["joint"]].strip().lower() if "joint" in self.column else "" for _, cells in self.rows
        ]
        ends = {row for row, name in enumerate(names) if not _NUMBERED.search(name) or "fixed" in name}
        ends = ends if ends <= {0, len(names) - 1} and len(ends) < len(names) else set()
        found = []
        for row, name in enumerate(names):
            kind = "tool" if _TOOL.search(name) else "fixed"
            unsaid = blank[row] and not slides[row] and row not in ends
            if turns[row] or (unsaid if moving else not (row in ends and name)):
                kind = "revolute"
            elif slides[row] and (starred[row] or any(turns)):
                kind = "prismatic"
            found.append(kind)
        if found.count("fixed") > max(2, len(found) // 2):
            self._refuse(
                found.index("fixed"),
                self.column["theta"],
                "rows without a variable may be joints",
                "Write q1, q2, ... where a joint turns, and one row for what is fixed",
            )
        return found

    def _offset_slides(self) -> None:
        """Make the offset of a joint that slides, a length, part of its d."""
        for row, (d, offset, kind) in enumerate(zip(self._of("d"), self._of("offset"), self.kinds)):
            unit = offset and (offset.unit or self.headings[self.column["offset"]].unit or offset.variables)
            if offset and kind == "prismatic" and not unit:
                self.amounts["d"][row] = replace(d, number=d.number + offset.number) if d else offset
                self.amounts["offset"][row] = None

    def _of(self, quantity: str) -> list[CellAmount | None]:
        return self.amounts.get(quantity) or [None] * len(self.rows)

    def _variable(self, row: int) -> tuple[str, float]:
        """Name and sign of the variable of a row's joint."""
        found = self._of("d" if self.kinds[row] == "prismatic" else "theta")[row]
        return next(iter(found.variables.items()), ("", 1.0)) if found else ("", 1.0)

    def _joints(self) -> Words:
        """The number of each row's joint, "" where nothing moves.

        The variables' numbers, from 0 or 1 on, are held against the order of the rows. Where some rows are fixed, the
        table's numbers may be those of its rows; they become those of its joints.
        """
        moving = [row for row, kind in enumerate(self.kinds) if kind not in FIXED]
        numbers = [re.search(r"\d+$", self._variable(row)[0]) for row in moving]
        variables = [int(number[0]) if number else None for number in numbers]
        stems = [self._variable(row)[0].rstrip("0123456789") for row in moving]
        own = {stem: [number for each, number in zip(stems, variables) if each == stem] for stem in stems}
        if len(own) > 1 and all(each == [*range(1, len(each) + 1)] for each in own.values()):  # d1, theta1, theta2
            variables = [None] * len(moving)
        start = 0 if variables[:1] == [0] else 1
        of_rows = all(number in (None, row + start) for row, number in zip(moving, variables))
        for joint, (row, number) in enumerate(zip(moving, variables), start):
            if number not in (None, joint) and not of_rows:
                problem = f"the variable is number {number} where that of joint {joint} belongs"
                raise InputError(
                    self.path, f"row {self.rows[row][0]}", problem, "Give the rows of one arm, in their order"
                )
        labels = order = [str(joint) for joint in range(1, len(moving) + 1)]
        k = self.column.get("joint", -1)
        texts = [re.findall(r"\d+", plain(self.rows[row][1][k])) for row in moving] if k >= 0 else []
        if texts and all(texts):  # names such as Elbow, Wrist 1 say no order
            named = [[text[end] for text in texts] for end in (0, -1)]  # 0-1 is joint 1
            firsts = [int(number) for number in named[0]]
            by_row = len(moving) < len(self.kinds) and len({each - row for each, row in zip(firsts, moving)}) == 1
            if order not in named and firsts != [*range(len(moving))] and not by_row:
                labels = named[-1]
        found = dict(zip(moving, labels))
        return [found.get(row, "") for row in range(len(self.kinds))]

    def _constants(self, k: int, quantity: str) -> None:
        """A column of constants; a sliding joint's d keeps the constant beside its variable."""
        for row, (found, kind) in enumerate(zip(self.amounts[quantity], self.kinds)):
            if found and found.variables and not (quantity == "d" and kind == "prismatic"):
                self._refuse(
                    row,
                    k,
                    f"'{min(found.variables)}' has no value",
                    f"Write {min(found.variables)} = ... below the table",
                )
        if quantity == "offset" and self.header[k].endswith("0"):
            self.notes.append(f"'{self.header[k]}' was read as offsets: theta = q + {self.header[k]}")
        self._add(k, quantity, self.amounts[quantity])

    def _theta(self, k: int) -> None:
        """Offsets of joints that turn, and theta of those that slide."""
        sliding = [kind == "prismatic" for kind in self.kinds]
        found = [each or CellAmount(0.0) for each in self.amounts["theta"]]
        turning = [None if slides else each for slides, each in zip(sliding, found)]
        rows = zip(self.columns["joint"], turning, self.rows)
        offsets = [f"joint {n} {cells[k].strip()}" for n, each, (_, cells) in rows if n and each and each.number]
        if self.of_toolbox and offsets:
            self.notes.append(f"theta is not read, as the Robotics Toolbox ignores it: {', '.join(offsets)}")
        elif "offset" not in self.column:
            if not any(each.variables for each in found):
                self._check_pose(k)
            self._add(k, "offset", turning)
            if offsets:
                self.notes.append(f"theta was read as the joint's angle with an offset: {', '.join(offsets)}")
        elif offsets:
            self._refuse(
                None,
                k,
                f"{offsets[0]}, and there are offsets too",
                "Add it to the offset, or leave it out",
            )
        for row, (slides, each) in enumerate(zip(sliding, found)):
            if slides and each.variables:
                name = min(each.variables)
                self._refuse(
                    row, k, f"'{name}' of a joint that slides has no value", f"Write {name} = ... below the table"
                )
        if any(sliding):
            self._add(k, "theta", [each if slides else None for slides, each in zip(sliding, found)])

    def _check_pose(self, k: int) -> None:
        """Refuse angles that are no right ones, which may be those of a pose."""
        for row, each in enumerate(self.amounts["theta"]):
            right = {"deg": (90.0,), "rad": (math.pi / 2,)}.get(each.unit, (90.0, math.pi / 2)) if each else ()
            cell = re.sub(r"(?i)\w*pi\b|π|°|deg\w*|rad\w*|\w+\.", "", self.rows[row][1][k])
            if (
                each
                and not _NAMED_SUM.search(cell)
                and all(abs(math.remainder(each.number, quarter)) > RIGHT_WITHIN for quarter in right)
            ):
                self._refuse(
                    row,
                    k,
                    f"'{self.rows[row][1][k]}' may be an offset, or the angle of a pose",
                    "Say so by --column: offset if theta = q + offset, or - if it is a pose",
                )

    def _add(self, k: int, name: str, found: list[CellAmount | None]) -> None:
        """A column of a quantity, in the unit that its heading or cells say; in mm or degrees if none do."""
        length = name in ("a", "d")
        for row, each in enumerate(found):
            if each and each.unit and (each.unit in PER_MM) != length:
                self._refuse(row, k, f"'{self.rows[row][1][k]}' is in {each.unit}", f"That is no unit of {name}")
        units = sorted({each.unit for each in found if each and each.unit and each.number}) or self.lengths * length
        bare = max((abs(each.number) for each in found if each and not each.unit), default=0.0)
        unit = self.headings[k].unit or (units[0] if len(units) == 1 else "")
        if not unit and not units and not length and bare < RADIANS_BELOW_DEG and self._has_radians():
            unit = "rad"
        if bare and ((len(units) > 1 and not unit) or (unit == "rad" and units and bare > 2 * math.pi)):
            self._refuse(None, k, f"{bare:g} among values in {' and '.join(units)}", "Write all in one unit")
        column = f"{name}_{unit or ('mm' if length else 'deg')}"
        if not unit and not units:
            self.unsaid.add(column)
        unit = column.rpartition("_")[2]
        self.columns[column] = ["" if each is None else repr(_in(each, unit)) for each in found]

    def _has_radians(self) -> bool:
        """Whether other columns are in radians, whose small angles are radians then."""
        in_pi = (re.search("(?i)π|pi", cell) for _, cells in self.rows for cell in cells)
        of_toolbox = self.from_code and re.search(r"\b(?:SerialLink|DHRobot)\(", self.text)  # which takes nothing else
        if of_toolbox:
            return True
        return any(own.unit == "rad" for own in self.headings.values()) or any(in_pi)


def _in(amount: CellAmount, unit: str) -> float:
    """An amount's number in a unit, which is its own if it has none."""
    return amount.number * (_SCALES[amount.unit] / _SCALES[unit] if amount.unit else 1.0)
