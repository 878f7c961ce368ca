"""Reading reference sets: folders of CSV files, one kind each."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from er3a.errors import InputError
from er3a.files.csv_file import Written, read_csv
from er3a.files.reference_documents import FILE as DOCUMENTS
from er3a.files.reference_documents import check_origins, load_documents
from er3a.files.reference_rows import FORMATS, UNCERTAINTIES, Fields, Format, row_of
from er3a.files.shipped import names, own_or_shipped
from er3a.files.units import LEAST_SPAN_MM, WIDEST_IN_RADIANS
from er3a.references.documents import Documents
from er3a.references.quantities import Quantity
from er3a.references.reference import Reference, ReferenceSet, Row, conflicts
from er3a.references.rows import reference_set

SHORTEST_BESIDE_LONG_MM, LONG_MM = 2.0, 100.0
WIDE_DEG = 30.0
STEP_IN_RADIANS, NEAR_STEP = math.pi / 12, 2e-3  # 15 deg, written with four digits
LENGTHS = ("x_mm", "y_mm", "z_mm", "value_mm")
ANGLES = ("lower_deg", "upper_deg", "speed_deg_s")
POSE = tuple(f"q{joint}_deg" for joint in range(1, 7))


@dataclass(frozen=True)
class Mistaken:
    """A unit that values were written in by mistake."""

    unit: str
    other: str
    remedy: str


METRES = Mistaken("mm", "metres", "Multiply by 1000")
RADIANS = Mistaken("deg", "radians", "Convert to degrees")


def load_references(name_or_folder: str | Path) -> ReferenceSet:
    """Load a reference set by its name in data/manual_refs, or by the path of a folder.

    A name is looked up below the working folder first, then among the references that come with er3a.

    Raises
    ------
    InputError
        naming file, row and column
    """
    folder = Path(name_or_folder)
    if isinstance(name_or_folder, str) and "/" not in name_or_folder:
        folder = reference_folder(name_or_folder)
    if not folder.is_dir():
        known = ", ".join(names("data/manual_refs", "*/"))
        raise InputError(folder, None, "there is no such reference set", f"Known: {known}; or give a folder's path")
    files = [file for file in sorted(folder.glob("*.csv")) if file.name != DOCUMENTS]
    if not files:
        raise InputError(folder, None, "the folder holds no CSV file", f"Add one of: {_file_names()}")
    tables = {file.stem: check_reference_file(file) for file in files}
    documents = load_documents(folder / DOCUMENTS)
    for file in files:
        check_origins(file, tables[file.stem], documents)
    return reference_set(folder.name, tables, documents)


def reference_folder(name: str) -> Path:
    """The folder of a reference set: the study's own, else the project's."""
    return own_or_shipped(f"data/manual_refs/{name}")


def check_reference_file(path: str | Path) -> tuple[Row, ...]:
    """Read one CSV file, whose name says its kind, and check all that can be checked in it alone.

    Raises
    ------
    InputError
        for an unknown kind, a missing column, a wrong unit, an empty or non-finite number, an unknown grade, a pose
        with missing joints, values in metres or radians, rows of one document that repeat or contradict each other, and
        an origin that the documents beside the file don't hold
    """
    path = Path(path)
    kind = path.stem
    if kind not in FORMATS:
        raise InputError(path, None, f"'{path.name}' is no kind of reference table", f"Name it one of: {_file_names()}")
    table = read_csv(path, FORMATS[kind].all_columns)
    if not table:
        raise InputError(path, None, "the table has a header but no rows", "Add a row, or remove the file")
    for fields in table:
        _fill_uncertainty(FORMATS[kind], fields)
        _check_row(path, FORMATS[kind], fields)
    _check_units(path, FORMATS[kind], table)
    rows = tuple(row_of(kind, fields) for fields in table)
    _check_repeats(path, rows)
    if documents := _documents_beside(path):
        check_origins(path, rows, documents)
    return rows


def _documents_beside(path: Path) -> Documents | None:
    """The documents of a table's set; None if there are none that can be read, which is another file's fault."""
    try:
        return load_documents(path.parent / DOCUMENTS)
    except InputError:
        return None


def _fill_uncertainty(format: Format, fields: Fields) -> None:
    """Half the last digit that the source prints, where the row gives no uncertainty; then plain numbers."""
    if format.digits and fields[format.uncertainty] is None:
        decimals = [fields[name].decimals for name in format.digits if fields[name] is not None]
        fields[format.uncertainty] = 0.5 * 10.0 ** -max(decimals, default=0)
    if format.coarse and fields[format.uncertainty] is None:
        fields[format.uncertainty] = format.coarse
    for name, value in fields.items():
        fields[name] = float(value) if isinstance(value, Written) else value


def _check_row(path: Path, format: Format, fields: Fields) -> None:
    faults = []
    for column, value in fields.items():
        if column in UNCERTAINTIES and value <= 0:
            remedy = "Half the last digit that the source prints, if it gives none"
            faults.append((column, f"{value:g} is not positive", remedy))
    if fields.get("joint", 1) not in range(1, 7):
        faults.append(("joint", f"there is no joint {fields['joint']}", "Write a number from 1 to 6"))
    for column, problem, remedy in (*faults, *format.faults(fields)):
        raise InputError(path, f"row {fields['row']}, column {column}", problem, remedy)


def _check_units(path: Path, format: Format, table: list[Fields]) -> None:
    _check_span(path, table, LENGTHS, LEAST_SPAN_MM, METRES)
    if format.mixed_lengths:
        _check_mixed(path, table, LENGTHS, SHORTEST_BESIDE_LONG_MM, LONG_MM, METRES)
    if format.mixed_limits:
        _check_mixed(path, table, ANGLES, WIDEST_IN_RADIANS, WIDE_DEG, RADIANS)
    if POSE[0] in format.columns:
        _check_angles(path, table)
    _check_span(path, table, ANGLES, WIDEST_IN_RADIANS, RADIANS)


def _check_span(path: Path, table: list[Fields], columns: tuple[str, ...], least: float, mistaken: Mistaken) -> None:
    """Refuse a table whose values are all too small."""
    present = [column for column in columns if column in table[0]]
    largest = max(_sizes(table, present))
    if "length" not in table[0] and 0 < largest < least:
        problem = f"the largest value is {largest:g} {mistaken.unit}, which can only be {mistaken.other}"
        raise InputError(path, f"columns {', '.join(present)}", problem, mistaken.remedy)


def _check_mixed(
    path: Path, table: list[Fields], columns: tuple[str, ...], least: float, most: float, mistaken: Mistaken
) -> None:
    """Refuse a row of small values beside rows of large ones."""
    present = [column for column in columns if column in table[0]]
    sizes = _sizes(table, present)
    for fields, size in zip(table, sizes):
        if 0 < size < least and max(sizes) > most:
            beside = f"{size:g} {mistaken.unit} at most beside up to {max(sizes):g} {mistaken.unit} in other rows"
            where = f"row {fields['row']}, columns {', '.join(present)}"
            raise InputError(path, where, f"{beside} looks like {mistaken.other}", mistaken.remedy)


def _sizes(table: list[Fields], columns: list[str]) -> list[float]:
    """The largest size in these columns of each row."""
    return [max((abs(row[column]) for column in columns if row[column] is not None), default=0.0) for row in table]


def _check_angles(path: Path, table: list[Fields]) -> None:
    for fields in table:
        for column in POSE:
            steps = fields[column] / STEP_IN_RADIANS
            if round(steps) and abs(fields[column]) < WIDEST_IN_RADIANS and abs(steps - round(steps)) < NEAR_STEP:
                problem = f"{fields[column]:g} deg looks like radians"
                remedy = f"Write {round(steps) * 15:g}"
                raise InputError(path, f"row {fields['row']}, column {column}", problem, remedy)


def _check_repeats(path: Path, rows: tuple[Row, ...]) -> None:
    seen: dict[tuple[str, Quantity], tuple[int, Reference]] = {}
    for row in rows:
        for reference in row.references():
            key = (reference.document, reference.quantity)
            line, first = seen.setdefault(key, (row.line, reference))
            if line == row.line:
                continue
            if _same(first, reference):
                problem = f"repeats row {line} of the same document ({reference.subject.key})"
            elif conflicts((first, reference)):
                problem = f"contradicts row {line} of the same document ({reference.subject.key})"
            else:
                continue
            raise InputError(path, f"row {row.line}", problem, "Keep one of the two, or name the document of each")


def _same(first: Reference, second: Reference) -> bool:
    if first.expected is None or second.expected is None:
        return first.expected == second.expected
    return first.quantity.apart(first.expected, second.quantity, second.expected) == 0


def _file_names() -> str:
    return ", ".join(f"{kind}.csv" for kind in FORMATS)
