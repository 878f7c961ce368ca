"""A D-H table in any text, as columns with er3a's headings.

The text is cut into cells (:mod:`er3a.files.table_cells`, :mod:`er3a.files.table_code`), headings say what the columns
mean (:mod:`er3a.files.table_headings`), cells are parsed (:mod:`er3a.files.arithmetic`). What can be read in two ways is
refused, with both.
"""

from __future__ import annotations

import difflib
import math
import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from er3a.errors import InputError
from er3a.files.arithmetic import UNITS, Amount, amount_of, name_of, plain
from er3a.files.csv_file import Lines, check_widths
from er3a.files.table_cells import Grid, html_grids, latex_grids, line_grids, without_latex
from er3a.files.table_code import LIBRARIES, code_grids, elements
from er3a.files.table_headings import Heading, heading_of
from er3a.formats.mesh_file import read_raw, text_of
from er3a.numerics.si_units import RADIANS_BELOW_DEG
from er3a.robots.robot import Convention

FIXED = "fixed", "tool"
NEEDED = frozenset({"a", "alpha", "d"})
PER_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
OWN = "type", "theta_deg", "beta_deg", "calibrated", "direction", "convention", "lower_deg", "upper_deg", "lower_mm"
OWN += "upper_mm", "speed_deg_s", "speed_mm_s"
_NUMBERED = re.compile(r"\d")
_TOOL = re.compile(r"tool|tcp|grip|hand|effector|^\s*g\s*$|工具|夹")  # a row's name, of what the flange carries
_VARIES = re.compile(r"\*|var(?:iable|\.)?|变量")
_STARRED = re.compile(r"^\*$|\w\*+\s*(?:$|[-+])")
_COMMA = re.compile(r"([-+]?\d+),(\d+)((?:e[-+]?\d+)?\s*(?:°|mm|cm|m|in|deg|rad)?)", re.IGNORECASE)
_NAMED = re.compile(r"[^\W\d]+\.?\s*\d+\s*:?")
_BY_NAME = re.compile(r"(?:^|\()([PR])\*?(?:\)|$)", re.IGNORECASE)
_KINDS = {"r": "revolute", "0": "revolute", "rot": "revolute", "rotational": "revolute", "rotary": "revolute"}
_KINDS |= {"p": "prismatic", "1": "prismatic", "linear": "prismatic", "旋转": "revolute", "移动": "prismatic"}
_MODIFIED = re.compile(r"modified[\s-]*(?:d-?h\b|denavit)|(?<![a-z])(?:mdh|moddh)(?![a-z])|改进|\bcraig'?s\b", re.I)
_STANDARD = re.compile(r"(?:standard|classic\w*)[\s-]*(?:d-?h\b|denavit)|stddh|标准", re.I)
_GIVEN = re.compile(
    r"(?<![\w.\])}])([^\W\d]\w*(?:[_({\[]*\d+[)}\]]*)?)[ \t]*=(?!=)[ \t]*((?:\([^()\n]*\)|[^=\n(])+?)"
    r"(?=[,;，；。%#\n]|\s+and\b|\s+[^\W\d][\w{}]*[ \t]*=|$)(?:[;,]?[ \t]*[%#]+[ \t]*[\[(]?(mm|cm|m|in)\b)?"
)


@dataclass(frozen=True)
class PrintedTable:
    """Lines as a file's lines, under er3a's headings; what was read into them, in words; columns of which neither heading
    nor cells say the unit."""

    lines: Lines
    notes: tuple[str, ...]
    without_unit: frozenset[str] = frozenset()


MAX_BYTES = 2_000_000


def table_text(path: Path) -> str:
    """The text of a file in UTF-8 or UTF-16, or of standard input for ``-``.

    Raises
    ------
    InputError
        if it is missing, too large or no text
    """
    if str(path) == "-":
        raw = sys.stdin.buffer.read(MAX_BYTES)
    else:
        raw = read_raw(path, MAX_BYTES)
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return raw.decode("utf-16", errors="replace")
    return text_of(path, raw)


def printed_table(path: Path, text: str, columns: Sequence[str] = ()) -> PrintedTable | None:
    """The one D-H table in a text, under er3a's headings, its cells as numbers.

    Parameters
    ----------
    path : named in errors
    columns : what the columns mean, in their order, in place of their headings: ``theta``, ``d``, ``a``, ``alpha``,
        ``joint``, ``offset``, or ``-`` for one that is not read

    Returns
    -------
    table : None if no row of the text has the headings of a D-H table

    Raises
    ------
    InputError
        naming line and cell: for two tables, for what can be read in two ways, and for what can't be read
    """
    try:
        found, from_code = _tables(text, columns)
    except InputError as error:
        raise InputError(path, error.field, error.problem, error.remedy) from None
    tables = [table for n, table in enumerate(found) if [row for _, row in table] not in _rows_of(found[:n])]
    if not tables:
        return None
    if len(tables) > 1:
        lines = " and ".join(str(table[0][0] or table[1][0]) for table in tables[:2])
        raise InputError(path, None, f"{len(tables)} D-H tables, at lines {lines}", "Give a file with one of them")
    return _Table(path, text, tables[0], from_code).converted()


def is_printed_table(header: Iterable[str]) -> bool:
    """Whether a table's headings are those of a D-H table, printed or er3a's own.

    Parameters
    ----------
    header : column names in any order; further columns are allowed

    Returns
    -------
    found : whether a, alpha and d are all among them
    """
    return NEEDED <= {found.quantity for name in header if (found := heading_of(name.strip()))}


def _rows_of(grids: list[Grid]) -> list[list[list[str]]]:
    return [[row for _, row in grid] for grid in grids]


# Where the table is ---------------------------------------------------------------------------------------------------


def _tables(text: str, columns: Sequence[str]) -> tuple[list[Grid], bool]:
    """All tables that the first reader finds which finds one, their headings first; and whether they are a program's."""
    page = html_grids(text) or latex_grids(text)
    if tables := [table for grid in page for table in _headed(grid, columns)]:
        return tables, False
    if tables := [table for grid in code_grids(text) for table in _headed(grid, columns)]:
        return tables, True
    for grid in line_grids(text):
        if tables := _headed(grid, columns):
            return tables, False
    if bare := code_grids(text, headed=False):
        if columns:
            return [table for grid in bare for table in _headed([(0, list(columns)), *grid], columns)], True
        problem = "a matrix whose columns have no names"
        remedy = "Say what they are: --column theta,d,a,alpha, or --column alpha,a,theta,d, or as they are meant"
        raise InputError(None, f"line {bare[0][0][0]}", problem, remedy)
    return [], False


def _headed(grid: Grid, columns: Sequence[str]) -> list[Grid]:
    """The tables of a grid: rows of headings, each with the rows below it."""
    tables: list[Grid] = []
    open_one, broken = False, 0
    for line, cells in grid:
        if is_printed_table(cells) or columns and len(cells) == len(columns) and not tables:
            tables.append([(line, list(columns) if len(cells) == len(columns) else cells)])
            if not is_printed_table(cells):
                tables[-1].append((line, cells))
            open_one, broken = True, 0
        elif open_one:
            filled = [cell for cell in cells if cell]
            header = tables[-1][0][1]
            if len(tables[-1]) == 1 and filled and all(_unit_in(cell) for cell in filled) and len(filled) > 1:
                tables[-1][0] = line, _with_units(header, cells)
            elif len(filled) < 2 or all("=" in cell for cell in filled):
                broken = line
            elif len(cells) != len(header) and not _numeric(filled):
                open_one = False
            elif broken and not _numeric(filled):
                open_one = False
            elif broken and len(tables[-1]) > 1 and _numeric(filled):
                raise InputError(None, f"line {broken}", "a line of text within the table", "Remove it")
            else:
                tables[-1].append((line, cells))
    tables = [_trimmed(table) for table in tables if len(table) > 1]
    return tables or _turned(grid)


def _numeric(cells: list[str]) -> bool:
    return 2 * sum(bool(re.search(r"\d|π", cell)) for cell in cells) > len(cells)


def _unit_in(cell: str) -> str:
    return UNITS.get(plain(cell).strip("()[] .").lower(), "")


def _with_units(header: list[str], cells: list[str]) -> list[str]:
    return [f"{name} [{_unit_in(cell)}]" if _unit_in(cell) else name for name, cell in zip(header, cells)]


def _trimmed(table: Grid) -> Grid:
    """A table without what follows its last known column, where headings or cells hold blanks."""
    header = table[0][1]
    if all(len(cells) == len(header) + 1 and _NAMED.fullmatch(cells[0]) for _, cells in table[1:]):
        header = ["joint", *header]  # a column of names that has no heading
        table = [(table[0][0], header), *table[1:]]
    widths = {len(cells) for _, cells in table}
    known = [bool(heading_of(name)) for name in header]
    last = len(known) - known[::-1].index(True)
    if len(widths) > 1 and all(known[1:last]) and min(widths) >= last < len(header):
        return [(line, cells[:last]) for line, cells in table]
    return table


def _turned(grid: Grid) -> list[Grid]:
    """A table whose rows are what columns usually are."""
    rows = [(line, cells) for line, cells in grid if len(cells) > 2 and heading_of(cells[0])]
    sizes = {len(cells) for _, cells in rows}
    numbers = [_numeric(cells[1:]) for _, cells in rows]
    if not is_printed_table(cells[0] for _, cells in rows) or len(sizes) > 1 or not all(numbers):
        return []
    return [[(rows[0][0], list(column)) for column in zip(*(cells for _, cells in rows))]]


# What it says ---------------------------------------------------------------------------------------------------------


class _Table:
    """A table with its headings, of which each cell becomes an amount."""

    def __init__(self, path: Path, text: str, grid: Grid, from_code: bool):
        self.path, self.notes = path, list[str]()
        self.header, self.rows = [name.strip() for name in grid[0][1]], grid[1:]
        self.headings = {k: own for k, name in enumerate(self.header) if (own := heading_of(name))}
        self.text = re.sub(r"(?m)^\s*[%#].*$", "", text) if from_code else without_latex(plain(text))
        self.given = self._given(from_code)
        self.convention = self._stated(text)
        self._check_headings()
        self.column = {own.quantity: k for k, own in self.headings.items()}

    def _check_headings(self) -> None:
        names: dict[str, int] = {}
        if "theta_deg" in self.header and not {"type", "offset_deg"} & set(self.header):
            self.headings[self.header.index("theta_deg")] = Heading("theta", "deg", False)
        if {"d", "r"} <= {own.sign for own in self.headings.values()}:
            order = [own.sign if own.sign in "dr" else own.quantity for own in self.headings.values()]
            if [each for each in order if each in ("alpha", "d", "theta", "r")] == ["alpha", "d", "theta", "r"]:
                remedy = "--column says them: a for d and d for r (Khalil), or d and a (r is the link's length)"
                raise InputError(self.path, "columns d, r", "either can be the link's length", remedy)
        labels = [k for k, own in self.headings.items() if own.quantity == "joint"]
        for k in labels[:-1]:
            del self.headings[k]
        for k, own in self.headings.items():
            if own.quantity in names:
                problem = f"columns '{self.header[names[own.quantity]]}' and '{self.header[k]}' both mean {own.quantity}"
                remedy = "Say what the columns are, - for one that is not read: --column joint,theta,d,a,alpha"
                raise InputError(self.path, f"line {self.rows[0][0]}", problem, remedy)
            names[own.quantity] = k

    def _stated(self, text: str) -> Convention | None:
        """The convention that headings, the library, or the text around the table says."""
        before = {own.before for own in self.headings.values() if own.quantity in ("a", "alpha")}
        if "convention" in self.header:
            return None
        if before == {True}:
            self.notes.append("a and alpha of the link before the joint (i-1): read as modified D-H (Craig)")
            return "modified"
        said = {each for library, (_, each) in LIBRARIES.items() if each and library in text}
        said |= {"modified"} if _MODIFIED.search(text) else set()
        said |= {"standard"} if _STANDARD.search(text) else set()
        if len(said) != 1:
            return None
        self.notes.append(f"the text says {min(said)} D-H, and was read so")
        return "modified" if "modified" in said else "standard"

    def _given(self, from_code: bool) -> dict[str, str]:
        """Values of symbols, as expressions; a symbol with two values has none."""
        found: dict[str, str] = elements(self.text) if from_code else {}
        for name, value, unit in _GIVEN.findall(self.text):
            if re.search(r"[\[\"']|\(\)$", value):
                continue
            symbol, value = name_of(name), f"({value}) {unit}" if unit else value.strip()
            found[symbol] = value if found.get(symbol, value) == value else "two values"
        for names, values in re.findall(r"(?m)^[ \t]*(\w+(?:[ \t]*,[ \t]*\w+)+)[ \t]*=[ \t]*([^=\n(]+)$", self.text):
            if names.count(",") == values.count(","):
                found |= dict(zip(map(name_of, names.split(",")), map(str.strip, values.strip(" ;").split(","))))
        return found

    def converted(self) -> PrintedTable:
        """The table under er3a's headings, with variables taken out of the cells of theta and d.

        Returns
        -------
        table : its lines as those of a file, the header first. Offsets and directions come from cells such as
            ``q2-90``. The convention is modified if a and alpha belong to link i-1, and no column names another one.
        """
        check_widths(self.path, [(0, self.header), *self.rows])
        amounts = {k: self._amounts(k) for k, own in self.headings.items() if own.quantity not in ("joint", "type")}
        kinds = self._kinds(amounts)
        columns: dict[str, list[str]] = {"joint": self._joints(kinds, amounts)}
        unused = []
        for k, name in enumerate(self.header):
            own = self.headings.get(k)
            cells = [cells[k] for _, cells in self.rows]
            if own is None and name not in OWN and re.sub(r"_(m|in|cm|rad)(_s)?$", "", name) not in _STEMS:
                if difflib.get_close_matches(name.lower(), OWN, n=1, cutoff=0.8):
                    columns[name] = cells
                elif name:
                    unused.append(name)
            elif own is None:
                columns[name] = cells
            elif own.quantity == "theta":
                self._theta(k, kinds, amounts, columns)
            elif own.quantity not in ("joint", "type"):
                self._plain(k, own, kinds, amounts, columns)
        if set(kinds) - {"revolute"} or "type" in columns:
            columns["type"] = kinds
        if self.convention:
            columns["convention"] = [self.convention] * len(kinds)
        if unused:
            self.notes.append(f"not used: {', '.join(unused)}")
        numbers = [number for number, _ in self.rows]
        made = [(number, list(cells)) for number, cells in zip(numbers, zip(*columns.values()))]
        return PrintedTable([(0, list(columns)), *made], tuple(self.notes), frozenset(self.unsaid))

    def _where(self, row: int, k: int) -> str:
        return f"row {self.rows[row][0]}, column {self.header[k]}"

    def _amounts(self, k: int) -> list[Amount | None]:
        """The amounts of a column's cells; None for an empty one."""
        cells = [cells[k] for _, cells in self.rows]
        commas = [found for cell in cells if (found := _COMMA.fullmatch(cell.strip()))]
        thousands = [found[0] for found in commas if len(found[2]) == 3 and found[1].strip("+-") != "0"]
        if thousands and len(thousands) == len(commas):
            remedy = "Write a number with a point before decimals and nothing between thousands"
            raise InputError(self.path, f"column {self.header[k]}", f"'{thousands[0]}' is not a number", remedy)
        return [self._amount(row, k, _COMMA.sub(r"\1.\2\3", cell) if commas else cell) for row, cell in enumerate(cells)]

    def _amount(self, row: int, k: int, cell: str) -> Amount | None:
        text = re.sub(r"\(t\)", "", plain(without_latex(cell)).strip()).rpartition("=")[2]
        text = re.sub(r"""^(?:\w+\.)?symbols?\(["']([^"',]+)["'].*\)$""", r"\1", text, flags=re.IGNORECASE)
        text = re.sub(r"\*+(?=$|\s*[-+])", "", text).strip() or ("q" if text.strip() else "")
        text = "q" if _VARIES.fullmatch(text.lower()) else text
        text = re.sub(r"^([^\W\d]\w*\d)\s*\((.+)\)$", r"\1+(\2)", text)
        if not text:
            return None
        given = self.given
        if self.headings[k].quantity == "theta":  # a value of a joint there is a pose
            given = {name: value for name, value in given.items() if not re.fullmatch(r"(q|θ|th|theta|t)\d*", name)}
        try:
            found = amount_of(text, given)
        except ValueError as error:
            remedy = "Write a number without a unit, or arithmetic with pi and names whose values are given"
            raise InputError(self.path, self._where(row, k), f"'{cell}' {error}", remedy) from None
        names = {name: times for name, times in found.variables.items() if times}
        if len(names) > 1:
            remedy = f"Write one variable and a number, or values as {next(iter(names))} = ... below the table"
            raise InputError(self.path, self._where(row, k), f"'{cell}' holds two variables", remedy)
        if names and abs(next(iter(names.values()))) != 1.0:
            raise InputError(self.path, self._where(row, k), f"'{cell}' is not a number", "Write a number")
        return replace(found, variables=names)

    def _kinds(self, amounts: dict[int, list[Amount | None]]) -> list[str]:
        """The type of each row: its d slides if that is a variable, and theta none; nothing moves in a row that has no
        variable although others have one, or no number although others have one."""
        k = self.column.get("type", self.header.index("type") if "type" in self.header else None)
        if k is not None:
            return [_KINDS.get(cells[k].strip().lower(), cells[k].strip().lower()) for _, cells in self.rows]
        turns, slides = ([self._variable(amounts, name, row) != "" for row in range(len(self.rows))] for name in ("theta", "d"))
        names = [cells[self.column["joint"]] if "joint" in self.column else "" for _, cells in self.rows]
        ends = {row for row, name in enumerate(names) if not _NUMBERED.search(name) or "fixed" in name.lower()}
        ends = ends if ends <= {0, len(names) - 1} and len(ends) < len(names) else set()
        starred = [bool(_STARRED.search(cells[self.column["d"]].strip())) for _, cells in self.rows]
        found = []
        for row, (turned, slid, star, name) in enumerate(zip(turns, slides, starred, names)):
            still = any(turns) or any(starred) or row in ends and name.strip()
            fixed = "tool" if _TOOL.search(name.lower()) else "fixed"
            sliding = slid and (star or any(turns))
            found.append("revolute" if turned else "prismatic" if sliding else fixed if still else "revolute")
            said = _BY_NAME.search(name.strip())
            if said and (_KINDS[said[1].lower()] == "prismatic") != (found[-1] == "prismatic"):
                problem = f"'{name}' is {_KINDS[said[1].lower()]} by its name, and {found[-1]} by its variable"
                raise InputError(self.path, f"row {self.rows[row][0]}", problem, "Write the variable into theta or d")
        return found

    def _variable(self, amounts: dict[int, list[Amount | None]], quantity: str, row: int) -> str:
        """The name of a cell's variable, "" if it has none."""
        found = amounts[self.column[quantity]][row] if quantity in self.column else None
        return next(iter(found.variables), "") if found else ""

    def _joints(self, kinds: list[str], amounts: dict[int, list[Amount | None]]) -> list[str]:
        """The number of each row's joint, "" where nothing moves.

        The variables' numbers, from 0 or 1 on, are held against the order of the rows. Where some rows are fixed, the
        table's numbers may be those of its rows; they become those of its joints.
        """
        moving = [row for row, kind in enumerate(kinds) if kind not in FIXED]
        names = [self._variable(amounts, "d" if kinds[row] == "prismatic" else "theta", row) for row in moving]
        variables = [int(found[0]) if (found := re.search(r"\d+$", name)) else None for name in names]
        start = 0 if variables[:1] == [0] else 1
        for joint, (row, number) in enumerate(zip(moving, variables), start):
            if number not in (None, joint):
                problem = f"the variable is number {number} where that of joint {joint} belongs"
                raise InputError(self.path, f"row {self.rows[row][0]}", problem, "Order the rows, or correct it")
        order = [str(joint) for joint in range(1, len(moving) + 1)]
        labels = order
        if (k := self.column.get("joint")) is not None:
            texts = [plain(self.rows[row][1][k]) for row in moving]
            labels = [_label(text) for text in texts]
            numbers = {int(label) - row for row, label in enumerate(labels) if label.isdecimal()}
            by_row = {int(label) - row for label, row in zip(labels, moving) if label.isdecimal()}
            all_numbered = all(map(str.isdecimal, labels))
            if all_numbered and len(moving) < len(kinds) and len(by_row) == 1:
                labels = order
            elif all_numbered and numbers == {0}:
                self.notes.append("joints are numbered from 0")
                labels = order
            elif not any(map(_NUMBERED.search, texts)):
                labels = order
        found = dict(zip(moving, labels))
        return [found.get(row, "") for row in range(len(kinds))]

    def _plain(self, k: int, own: Heading, kinds: list[str], amounts: dict[int, list[Amount | None]], columns: dict[str, list[str]]) -> None:
        """A column of constants; a sliding joint's d keeps the constant beside its variable."""
        for row, (found, kind) in enumerate(zip(amounts[k], kinds)):
            if found and found.variables and not (own.quantity == "d" and kind == "prismatic"):
                name = next(iter(found.variables))
                known = "two" if self.given.get(name) else "no"
                raise InputError(self.path, self._where(row, k), f"'{name}' has no value", f"Write {name} = ... below the table")
        self._add(k, own.quantity, amounts[k], columns)

    def _theta(self, k: int, kinds: list[str], amounts: dict[int, list[Amount | None]], columns: dict[str, list[str]]) -> None:
        """Directions and offsets of joints that turn, and theta of those that slide."""
        sliding = [kind == "prismatic" for kind in kinds]
        found = [each or Amount(0.0) for each in amounts[k]]
        turning = [None if slides else each for slides, each in zip(sliding, found)]
        offsets = [f"joint {joint} {self.rows[row][1][k].strip()}" for row, (joint, each) in enumerate(zip(columns["joint"], turning)) if joint and each and each.number]
        if "offset" not in self.column:
            self._add(k, "offset", turning, columns)
            if offsets:
                self.notes.append(f"theta was read as the joint's angle with an offset: {', '.join(offsets)}")
        elif offsets:
            raise InputError(self.path, f"column {self.header[k]}", f"{offsets[0]}: another column holds offsets too", "Keep one")
        if any(sliding):
            self._add(k, "theta", [each if slides else None for slides, each in zip(sliding, found)], columns)
        signs = [next(iter(each.variables.values()), 1.0) for each in found]
        if min(signs) < 0:
            if "direction" in self.header:
                problem = "another column holds directions too"
                raise InputError(self.path, f"column {self.header[k]}", problem, "Keep one")
            columns["direction"] = ["-1" if sign < 0 else "1" for sign in signs]

    unsaid: frozenset[str] = frozenset()

    def _add(self, k: int, name: str, found: list[Amount | None], columns: dict[str, list[str]]) -> None:
        """A column of a quantity, in the unit that its heading or cells say; in mm or degrees if none do."""
        length = name in ("a", "d")
        units = {each.unit for each in found if each and each.unit and each.number}
        for row, each in enumerate(found):
            if each and each.unit and (each.unit in PER_MM) != length:
                raise InputError(self.path, self._where(row, k), f"'{self.rows[row][1][k]}' is in {each.unit}", f"That is no unit of {name}")
        said = self.headings[k].unit or (min(units) if len(units) == 1 else "")
        if not said and len(units) > 1:
            said = "mm" if length else "deg"
        bare = [abs(each.number) for each in found if each and not each.unit and each.number]
        unit = said or ("mm" if length else self._angle_unit(bare))
        if unit == "rad" and not self.headings[k].unit and max(bare, default=0.0) > 2 * math.pi:
            problem = f"{max(bare):g} among fractions of pi: degrees, or radians?"
            raise InputError(self.path, f"column {self.header[k]}", problem, "Write all its angles in one unit")
        if not said and not (unit == "rad"):
            self.unsaid |= {f"{name}_{unit}"}
        columns[f"{name}_{unit}"] = ["" if each is None else repr(_in(each, unit)) for each in found]

    def _angle_unit(self, numbers: list[float]) -> str:
        """Radians for small angles of a table that has others in radians; else degrees."""
        texts = [cell for _, cells in self.rows for cell in cells]
        radians = any(own.unit == "rad" for own in self.headings.values()) or any("π" in x or "pi" in x for x in map(str.lower, texts))
        return "rad" if radians and max(numbers, default=0.0) < RADIANS_BELOW_DEG else "deg"


_STEMS = {re.sub(r"_(mm|deg)(_s)?$", "", each) for each in OWN if each.endswith(("_mm", "_deg", "_s"))}


def _in(amount: Amount, unit: str) -> float:
    """An amount's number in a unit, which is its own if it has none."""
    if amount.unit in ("", unit):
        return amount.number
    if unit in PER_MM:
        return amount.number * PER_MM[amount.unit] / PER_MM[unit]
    return math.degrees(amount.number) if unit == "deg" else math.radians(amount.number)


def _label(cell: str) -> str:
    """The number of a joint in its name; of two, as in 0-1, the second."""
    found = re.search(r"\d+\s*(?:[-→>/]|to)+\s*(\d+)", cell) or re.search(r"(\d+)", cell)
    return found[1] if found else cell.strip()
