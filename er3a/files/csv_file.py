"""Tidy CSV tables: known columns, no NaN, one error naming row and column."""

from __future__ import annotations

import csv
import difflib
import io
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from er3a.by_value import frozen
from er3a.errors import InputError, given_bytes
from er3a.files.units import MIN_SPAN_MM, WIDEST_IN_RADIANS
from er3a.formats.mesh_file import TOO_LARGE, read_text, text_of

LARGEST_DIGITS = 9

MAX_BYTES = 50_000_000

Lines = list[tuple[int, list[str]]]
CsvRow = dict[str, Any]
"""A row by its columns; ``row`` is its line."""
CsvRows = list[CsvRow]
"""Fields of a file's lines, with the lines' numbers."""
OWN_HEAD = re.compile(r"(?m)^# er3a: .*$")
"""Remarks at the head of a table of motion that er3a has written."""


class Written(float):
    """A number, with the number of decimals with which it was written."""

    decimals: int

    def __new__(cls, text: str) -> Written:
        number = super().__new__(cls, text)
        mantissa, _, exponent = text.lower().partition("e")
        number.decimals = max(len(mantissa.partition(".")[2]) - int(exponent or 0), -LARGEST_DIGITS)
        return number


@frozen
class CsvColumn:
    """One column of a CSV table.

    Attributes
    ----------
    type : float, Written, int or str
    optional : an empty field is read as None
    choices : the allowed values, for columns of words
    always : whether the table must have the column; if not, all its values are None
    digits : greatest number of digits before the decimal point; quantity : what such numbers are
    """

    type: type = float
    optional: bool = False
    choices: tuple[str, ...] = ()
    always: bool = True
    digits: int = LARGEST_DIGITS
    quantity: str = "length or angle"


def columns_of(text: str, number: type = float) -> dict[str, CsvColumn]:
    """The columns of a table, by name.

    Parameters
    ----------
    text : names of columns of numbers; ``name:int`` holds whole numbers, ``name:word`` texts, ``name:a|b`` one of some
        words. A field may be empty with ``?`` behind, and the column be missing with ``~``
    number : type of numbers
    """
    found: dict[str, CsvColumn] = {}
    for word in text.split():
        name, _, kind = word.rstrip("?~").partition(":")
        choices = tuple(kind.split("|")) if kind not in ("", "int", "word") else ()
        found[name] = CsvColumn({"": number, "int": int}.get(kind, str), "?" in word, choices, "~" not in word)
    return found


UNITS_CHECKED = "units_checked"
CHECKED_COLUMN = columns_of(f"{UNITS_CHECKED}:yes?~")
"""The column that says yes where numbers which look like metres or radians are mm and degrees."""


def read_csv(path: str | Path, columns: Mapping[str, CsvColumn], lines: Lines | None = None) -> CsvRows:
    """Read a CSV file with exactly these columns (any order); rows as dicts with a ``row`` key (file line).

    ``lines``: what :func:`read_lines` found, if it has been read.

    Raises
    ------
    InputError
        for a missing or unknown column, a wrong unit in a column name, an empty or non-finite number, a ragged row
    """
    path = Path(path)
    lines = read_lines(path) if lines is None else lines
    if not lines:
        raise InputError(path, None, "the file is empty", f"Write a header: {','.join(columns)}")
    header = [name.strip() for name in lines[0][1]]
    _check_header(path, lines[0][0], header, columns)
    check_widths(path, lines)
    rows = []
    for number, line in lines[1:]:
        row = {name: cell_value(path, number, name, text.strip(), columns[name]) for name, text in zip(header, line)}
        absent = dict.fromkeys(name for name in columns if name not in row)
        rows.append({"row": number, **row, **absent})
    return rows


def read_header(path: str | Path) -> list[str]:
    """The column names of a CSV file.

    Returns
    -------
    names : texts of the first line that is not blank, without surrounding spaces; [] for an empty file

    Raises
    ------
    InputError
        if the file is missing, too large or not CSV
    """
    lines = read_lines(Path(path))
    return [name.strip() for name in lines[0][1]] if lines else []


def is_own(path: str | Path) -> bool:
    """Whether er3a has written a table of motion: it then has er3a's remarks, and columns of both joints and tool.

    Returns
    -------
    own : whether a line begins with ``# er3a:``

    Raises
    ------
    InputError
        if the file is missing, too large or not text
    """
    return OWN_HEAD.match(read_text(Path(path), MAX_BYTES)) is not None


def csv_text(path: Path) -> str:
    """The text of a CSV file, in UTF-8 or UTF-16.

    Raises
    ------
    InputError
        if it is missing, too large or no text
    """
    return text_of(path, given_bytes(path, MAX_BYTES, TOO_LARGE))


def read_lines(path: Path) -> Lines:
    """Lines of a CSV file that aren't blank; the head of a table of motion that er3a has written is left out."""
    return lines_of(path, OWN_HEAD.sub("", csv_text(path)))


def lines_of(path: Path, text: str, mixed: bool = False) -> Lines:
    """Lines of a table that aren't blank, with their numbers; the first is the header.

    Spreadsheets of some countries separate by semicolons and write decimal commas, which are read as points. Fields
    may have blanks between them where a header has no other mark.

    Parameters
    ----------
    path : named in errors
    mixed : whether numbers may have points in one column and commas in another

    Raises
    ------
    InputError
        naming the line, if quotes are not closed, or numbers have commas and points
    """
    header = text.strip().partition("\n")[0].strip()
    mark = next((each for each in ";\t" if each in header and "," not in header), "," if "," in header else " ")
    if mark == " ":
        text = re.sub(r"(?m)[ \t\r]+$", "", text)
    reader = csv.reader(io.StringIO(text), strict=True, delimiter=mark, skipinitialspace=mark == " ")
    try:
        lines = [(reader.line_num, line) for line in reader if any(field.strip() for field in line)]
    except csv.Error as error:
        raise InputError(path, f"line {reader.line_num}", f"not valid CSV ({error})", "Correct this line") from None
    while lines and all(len(line) == len(lines[0][1]) > 1 and not line[-1].strip() for _, line in lines):
        lines = [(number, line[:-1]) for number, line in lines]  # columns that a spreadsheet leaves behind
    return lines if mark == "," else _with_points(path, lines, mixed)


def check_widths(path: Path, lines: Lines) -> None:
    """Reject a row with another number of fields than the header.

    Parameters
    ----------
    path : named in the error
    lines : pairs of line number and fields; the first is the header

    Raises
    ------
    InputError
        naming the first such row and both numbers of fields
    """
    for number, line in lines[1:]:
        if len(line) != len(lines[0][1]):
            problem = f"{len(line)} fields where the header has {len(lines[0][1])}"
            raise InputError(path, f"row {number}", problem, "Correct the separators; quote texts that hold one")


def _with_points(path: Path, lines: Lines, mixed: bool) -> Lines:
    """Lines with decimal points, of a table in which commas separate nothing."""
    comma = re.compile(r"\s*[-+−]?\d+,\d+(?:[eE][-+]?\d+)?\s*(?:°|mm|cm|m|in|deg|rad)?\s*")
    fields = [field for _, line in lines[1:] for field in line]
    written = next((field.strip() for field in fields if comma.fullmatch(field)), "")
    pointed = next((field.strip() for field in fields if "." in field and comma.fullmatch(field.replace(".", ","))), "")
    if written and pointed and not mixed:
        problem = f"decimal commas and points in one table ('{written}', '{pointed}')"
        raise InputError(path, None, problem, "Write all numbers with a point")
    return [
        (number, [field.replace(",", ".") if comma.fullmatch(field) else field for field in line])
        for number, line in lines
    ]


def _check_header(path: Path, number: int, header: list[str], columns: Mapping[str, CsvColumn]) -> None:
    for name in filter(None, header):
        if header.count(name) > 1:
            raise InputError(path, f"column {name}", "is in the header twice", "Keep one of the two")
    missing = [name for name, column in columns.items() if column.always and name not in header]
    needed = f"The header must hold: {', '.join(name for name, column in columns.items() if column.always)}"
    if other := [name for name, column in columns.items() if not column.always]:
        needed += f"; it may hold: {', '.join(other)}"
    stems = {name.rsplit("_", 1)[0] for name in columns}
    if len(missing) > 1 and not any(name in columns or name.rpartition("_")[0] in stems for name in header):
        raise InputError(path, f"row {number}", "no header of this table: no column has a known name", needed)
    for name in header:
        if name in columns:
            continue
        stem = name.rsplit("_", 1)[0]
        same_stem = [other for other in missing if other.rsplit("_", 1)[0] == stem or other.startswith(name + "_")]
        if same_stem:
            problem, remedy = "not a unit this column can have", f"Convert the values and name it '{same_stem[0]}'"
            raise InputError(path, f"column {name}", problem, remedy)
        if not name:
            raise InputError(path, f"column {header.index(name) + 1}", "has no name", "Name it, or remove a comma")
        close = difflib.get_close_matches(name, missing, n=1)
        remedy = f"Did you mean '{close[0]}'?" if close else f"Known columns: {', '.join(columns)}"
        raise InputError(path, f"column {name}", "unknown column", remedy)
    if missing:
        raise InputError(path, f"column {missing[0]}", "missing", needed)


def cell_value(path: Path, row: int, name: str, text: str, column: CsvColumn) -> Any:
    """The value of one cell; None for an empty one, where the column allows that.

    Parameters
    ----------
    path, row, name : where it is, for errors
    text : without blanks around it

    Raises
    ------
    InputError
        for a cell that is empty, no number, not finite, too large, or none of the column's words
    """
    where = f"row {row}, column {name}"
    if not text:
        if column.optional:
            return None
        raise InputError(path, where, "empty", "Fill in a value" + _allowed(column))
    if column.type is str:
        if column.choices and text not in column.choices:
            raise InputError(path, where, f"'{text}' is not known", "Write" + _allowed(column))
        return text
    number = "a whole number" if column.type is int else "a number"
    text = text.replace("\u2212", "-")  # the minus sign of printed tables
    plain = text.isascii() and "_" not in text  # Python would read 1_000 as 1000, and the digits of any script
    try:
        value = column.type(text) if plain else None
    except ValueError:
        value = None
    if value is None:
        remedy = f"Write {number} without a unit" + (
            ", with a point before decimals and nothing between thousands" if "," in text else ""
        )
        raise InputError(path, where, f"'{text}' is not {number}", remedy)
    if not math.isfinite(value):
        raise InputError(path, where, f"'{text}' is not a finite number", "Write a number, or remove the row")
    if abs(value) > 10.0**column.digits:
        problem = f"'{text}' is too large for any {column.quantity}"
        raise InputError(path, where, problem, "Check its exponent and unit")
    return value


def _allowed(column: CsvColumn) -> str:
    return f" one of: {', '.join(column.choices)}" if column.choices else ""


@frozen
class Mistaken:
    """A unit that values were written in by mistake.

    Attributes
    ----------
    least : values are in the other unit if all are smaller; small, large : or one row's among larger ones
    """

    unit: str
    other: str
    least: float
    small: float
    large: float


METRES = Mistaken("mm", "metres", MIN_SPAN_MM, 2.0, 100.0)
RADIANS = Mistaken("deg", "radians", WIDEST_IN_RADIANS, WIDEST_IN_RADIANS, 30.0)


def refuse_unit(
    path: Path,
    table: Sequence[Mapping[str, Any]],
    columns: Iterable[str],
    mistaken: Mistaken,
    remedy: str = "Multiply by 1000",
    *,
    whole: bool = True,
    mixed: bool = True,
) -> None:
    """Reject a table whose values are all too small, and a row of small values among large ones.

    Parameters
    ----------
    table : rows by column, with the line as ``row``
    columns : those of one unit, in deg or mm; such as the table lacks are not looked at
    whole, mixed : whether all rows together are judged, and single ones among others

    Raises
    ------
    InputError
        naming the columns, and the row if it is one alone
    """
    present = [column for column in columns if column in table[0]]
    where, sizes, unit = f"columns {', '.join(present)}", sizes_of(table, present), mistaken.unit
    largest = max(sizes)
    if whole and 0 < largest < mistaken.least:
        problem = f"the largest value is {largest:g} {unit}, which can only be {mistaken.other}"
        raise InputError(path, where, problem, remedy)
    for fields, size in zip(table, sizes):
        if mixed and 0 < size < mistaken.small and largest > mistaken.large:
            problem = (
                f"{size:g} {unit} at most, with up to {largest:g} {unit} in other rows, looks like {mistaken.other}"
            )
            raise InputError(path, f"row {fields['row']}, {where}", problem, remedy)


def sizes_of(table: Iterable[Mapping[str, Any]], columns: Sequence[str]) -> list[float]:
    """The largest size in some columns of each row.

    Parameters
    ----------
    table : rows by column; values may be None

    Returns
    -------
    sizes : one for each row; 0 of rows without any value
    """
    return [max((abs(row[column]) for column in columns if row[column] is not None), default=0.0) for row in table]
