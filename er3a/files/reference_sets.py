"""Reading reference sets: folders of CSV files, one kind each."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from er3a.by_value import frozen
from er3a.errors import InputError, InputWarning
from er3a.files.csv_file import (
    METRES,
    RADIANS,
    UNITS_CHECKED,
    CsvColumn,
    Written,
    columns_of,
    read_csv,
    refuse_unit,
    sizes_of,
)
from er3a.files.kept_files import names, own_or_shipped
from er3a.files.orientations import BY_ROW, NoRotationError, rotations
from er3a.files.robot_file import NAME_PATTERN
from er3a.files.units import WIDEST_IN_RADIANS, doubt
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import NEAR_STEP, STEP_IN_RADIANS
from er3a.references.predict import with_rounding
from er3a.references.quantities import (
    ZERO_POSE,
    NotOfArm,
    Pose,
    Quantity,
    Rotation3,
    not_of_arm,
    rotation_vectors_deg,
)
from er3a.references.reference import NO_DOCUMENT, Document, Documents, Reference, ReferenceSet, Row, conflicts
from er3a.references.rows import ENVELOPE_CORNERS, ENVELOPE_EXTENTS, KINDS, reference_set
from er3a.references.seen import COARSE_DEG, SEEN
from er3a.references.subjects import key_of
from er3a.robots.robot import GRADES, MAX_JOINTS, Robot

Fields = dict[str, Any]
Fault = tuple[str, str, str]
"""Column, problem and remedy."""

STATED_AS = "stated_as"
STANDARD_DEVIATION = "standard_deviation"
UNCERTAINTIES = ("uncertainty_mm", "uncertainty_deg", "uncertainty_deg_s", "uncertainty_mm_s")
_SOURCE = columns_of(
    f"source:word grade:{'|'.join(GRADES)} origin:word {STATED_AS}:half_width|{STANDARD_DEVIATION}?~ "
    f"{UNITS_CHECKED}:yes?~"
)
_XYZ = ("x_mm", "y_mm", "z_mm")
_DIRECTION = ("direction_x", "direction_y", "direction_z")
ORIENTATION_COLUMNS = tuple(column for columns in BY_ROW.values() for column in columns)
NOT_RIGID = 2e-3
_POSE = tuple(f"q{joint}_deg" for joint in range(1, len(ZERO_POSE) + 1))
_FURTHER = tuple(f"q{joint}_deg" for joint in range(len(ZERO_POSE) + 1, MAX_JOINTS + 1))


@frozen
class Format:
    """The table of a kind.

    Attributes
    ----------
    columns : without source, grade, origin and uncertainty, which every table has
    gather : converts a line's fields to those of the row
    faults : errors of a line
    coarse : the default uncertainty of tables without digits
    mixed : whether single lines in metres or radians among others are refused
    """

    columns: Mapping[str, CsvColumn]
    gather: Callable[[Fields], Fields] = dict
    faults: Callable[[Fields], Iterator[Fault]] = lambda fields: iter(())
    coarse: float | None = None
    mixed: bool = False

    @property
    def all_columns(self) -> dict[str, CsvColumn]:
        """The columns of the file."""
        return {**self.columns, **_SOURCE}

    def filled(self, fields: Fields) -> tuple[str, tuple[str, ...]]:
        """Which column of a line's uncertainty can be filled in, and from what.

        Parameters
        ----------
        fields : of one line; whether it has values in mm or in degrees decides, where a table may have either

        Returns
        -------
        column : the name of the column of the uncertainty
        digits : the columns whose last printed digits fill it in
        """
        uncertainties = [name for name in self.columns if name in UNCERTAINTIES]
        column = uncertainties[-1 if _slides(fields) else 0]
        ending = column.removeprefix("uncertainty")
        return column, tuple(name for name in self.columns if name.endswith(ending) and name[0] not in "uq")


def _axis_fields(fields: Fields) -> Fields:
    fields["direction"] = tuple(fields.pop(name) for name in _DIRECTION)
    point = tuple(fields.pop(name) for name in _XYZ)
    fields["point_mm"] = None if None in point else point
    fields["signed"] = fields["signed"] == "yes"
    return fields


def _axis_faults(fields: Fields) -> Iterator[Fault]:
    length = math.hypot(*(fields[name] for name in _DIRECTION))
    if abs(length - 1) > 1e-3:
        yield "direction_x", f"the direction has length {length:g}", "Write a unit vector"
    given = [fields[name] is not None for name in _XYZ]
    if any(given) and not all(given):
        yield _XYZ[given.index(False)], "empty", "Give all three, or none of a joint that slides"


def _position_fields(fields: Fields) -> Fields:
    fields["pose"] = _pose(fields)
    fields["xyz_mm"] = tuple(fields.pop(name) for name in _XYZ)
    fields["orientation"] = _orientation(fields)
    for name in ORIENTATION_COLUMNS:
        del fields[name]
    return fields


def _written_as(fields: Fields) -> list[str]:
    """The forms of ``BY_ROW`` that a row uses."""
    return [form for form, columns in BY_ROW.items() if any(fields[name] is not None for name in columns)]


def _rotation(form: str, fields: Fields, tolerance: float = math.inf) -> Reals:
    """The rotation (3, 3) nearest to what a row states in a form; :class:`NoRotationError` if it is off by more."""
    return rotations(form, [[fields[name] for name in BY_ROW[form]]], tolerance)[0]


def _orientation(fields: Fields) -> Rotation3 | None:
    """Rows of the rotation matrix that a row states; None if it states no orientation."""
    written = _written_as(fields)
    return tuple(map(tuple, _rotation(written[0], fields).tolist())) if written else None  # type: ignore[return-value]


def _position_faults(fields: Fields) -> Iterator[Fault]:
    written = _written_as(fields)
    if len(written) > 1:
        yield BY_ROW[written[1]][0], "the orientation is written in two ways", "Keep one of the two"
    for form in written[:1]:
        columns = BY_ROW[form]
        missing = [name for name in columns if fields[name] is None]
        if missing:
            yield missing[0], "empty, but the row gives other parts of the orientation", f"Give {', '.join(columns)}"
        elif fields["point"] != "flange":
            yield "point", f"an orientation of the {fields['point']}", "Write flange: its orientation alone is checked"
        else:
            try:
                _rotation(form, fields, NOT_RIGID)
            except NoRotationError as error:
                yield columns[0], error.problem, error.remedy


def _pose(fields: Fields) -> Pose:
    """The joint values, taken out of the fields: six, and those of further joints up to the last that is not 0."""
    values = [fields.pop(name) for name in (*_POSE, *_FURTHER)]
    last = max((k for k, value in enumerate(values) if value), default=0)
    return tuple(value or 0.0 for value in values[: max(last + 1, len(_POSE))])


def _observation_fields(fields: Fields) -> Fields:
    fields["pose"] = _pose(fields)
    return fields


def _envelope_fields(fields: Fields) -> Fields:
    corner = (fields.pop("q2_deg"), fields.pop("q3_deg"))
    fields["corner_deg"] = None if corner == (None, None) else corner
    return fields


def _envelope_faults(fields: Fields) -> Iterator[Fault]:
    for column in ("q2_deg", "q3_deg"):
        given = fields[column] is not None
        if given != (fields["quantity"] in ENVELOPE_CORNERS):
            problem = f"{'given' if given else 'missing'} for {fields['quantity']}"
            yield column, problem, f"Corners ({', '.join(ENVELOPE_CORNERS)}) have J2 and J3, extents have none"


def _reach_faults(fields: Fields) -> Iterator[Fault]:
    if fields["from_axis"] not in (1, 2):
        yield "from_axis", f"reach from axis {fields['from_axis']} is not checked", "Write 1 or 2"


def _slides(fields: Fields) -> bool:
    """Whether a row gives a limit or a speed of a prismatic joint."""
    return any(fields[name] is not None for name in ("lower_mm", "upper_mm", "speed_mm_s") if name in fields)


def _in_one_unit(fields: Fields) -> Fields:
    """Limits or a speed, without the columns of the other unit."""
    slides = _slides(fields)
    own, other = ("_mm", "_deg") if slides else ("_deg", "_mm")
    values = {name.replace(own, ""): value for name, value in fields.items() if other not in name}
    return {name.removesuffix("_s"): value for name, value in values.items()} | {"slides": slides}


def _limit_faults(fields: Fields) -> Iterator[Fault]:
    yield from _mixed_units(fields)
    for unit in ("deg", "mm"):
        lower, upper = fields[f"lower_{unit}"], fields[f"upper_{unit}"]
        if lower is not None and upper is not None and lower >= upper:
            remedy = "Swap them" if lower > upper else "Correct one of them"
            yield f"lower_{unit}", f"{lower:g} is not below upper_{unit} {upper:g}", remedy


def _speed_faults(fields: Fields) -> Iterator[Fault]:
    yield from _mixed_units(fields)
    for column in ("speed_deg_s", "speed_mm_s"):
        speed = fields[column]
        if speed is not None and speed <= 0:
            yield column, f"{speed:g} is not positive", "Write the greatest speed, without sign"


def _mixed_units(fields: Fields) -> Iterator[Fault]:
    for column in ("lower_deg", "upper_deg", "speed_deg_s"):
        if _slides(fields) and fields.get(column) is not None:
            yield column, "given beside millimetres", "Leave it empty of a joint that slides"


_JOINTS = " ".join([*_POSE, *(f"{name}~" for name in _FURTHER)])
_TURN = " ".join(f"{name}?~" for name in ORIENTATION_COLUMNS)
_POINT = "point:flange|wrist_centre"


def _format(columns: str, **more: Any) -> Format:
    return Format(columns_of(columns, Written), **more)


FORMATS: dict[str, Format] = {
    "axes": _format(
        "joint:int direction_x direction_y direction_z x_mm? y_mm? z_mm? signed:yes|no uncertainty_mm uncertainty_deg",
        gather=_axis_fields,
        faults=_axis_faults,
    ),
    "positions": _format(
        f"name:word {_POINT} {_JOINTS} x_mm? y_mm? z_mm? uncertainty_mm? {_TURN} uncertainty_deg?~",
        gather=_position_fields,
        faults=_position_faults,
        mixed=True,
    ),
    "directions": _format("segment:upper_arm|forearm angle_from_vertical_deg uncertainty_deg?"),
    "envelope": _format(
        f"quantity:{'|'.join((*ENVELOPE_CORNERS, *ENVELOPE_EXTENTS))} q2_deg? q3_deg? value_mm uncertainty_mm?",
        gather=_envelope_fields,
        faults=_envelope_faults,
    ),
    "reach": _format(
        f"{_POINT} from_axis:int extreme:greatest|least value_mm uncertainty_mm?",
        faults=_reach_faults,
        mixed=True,
    ),
    "limits": _format(
        "joint:int lower_deg? upper_deg? uncertainty_deg? lower_mm?~ upper_mm?~ uncertainty_mm?~",
        gather=_in_one_unit,
        faults=_limit_faults,
        mixed=True,
    ),
    "speeds": _format(
        "joint:int speed_deg_s? uncertainty_deg_s? speed_mm_s?~ uncertainty_mm_s?~",
        gather=_in_one_unit,
        faults=_speed_faults,
    ),
    "observations": _format(
        f"{_JOINTS} joint:int {_POINT} seen:{'|'.join(SEEN)} uncertainty_deg?",
        gather=_observation_fields,
        coarse=COARSE_DEG,
    ),
    "lengths": _format("joint:int length:a|d value_mm uncertainty_mm?"),
    "angles": _format("joint:int angle:alpha|offset value_deg uncertainty_deg?"),
}


def row_of(kind: str, fields: Mapping[str, Any]) -> Row:
    """The reference row that the fields of a CSV line describe.

    Parameters
    ----------
    kind : the table's name without ending, a key of ``FORMATS``
    fields : the line's values by column, as read and checked; ``row`` is the line's number

    Returns
    -------
    row : of the kind's class, in the units of its columns
    """
    values = FORMATS[kind].gather(dict(fields))
    values["line"] = values.pop("row")
    values["gaussian"] = values.pop(STATED_AS) == STANDARD_DEVIATION
    del values[UNITS_CHECKED]
    return KINDS[kind](**values)


FILE = "documents.csv"
COLUMNS = columns_of("name:word title:word publisher:word derived_from:word?")


def load_documents(path: str | Path) -> Documents:
    """Read a set's documents; ``derived_from`` holds names, separated by semicolons.

    Raises
    ------
    InputError
        for an invalid or repeated name, for an unknown name in ``derived_from``, and for documents that are derived
        from each other in a circle
    """
    path = Path(path)
    found: dict[str, Document] = {}
    table = read_csv(path, COLUMNS)
    for fields in table:
        name, where = fields["name"], f"row {fields['row']}, column name"
        if not re.match(NAME_PATTERN, name) or name == NO_DOCUMENT:
            remedy = f"Write a short name in small letters, digits and _, other than '{NO_DOCUMENT}'"
            raise InputError(path, where, f"'{name}' is not a document's name", remedy)
        if name in found:
            raise InputError(path, where, f"the document '{name}' is given twice", "Keep one of the two")
        parents = tuple(part.strip() for part in fields["derived_from"].split(";")) if fields["derived_from"] else ()
        found[name] = Document(name, fields["title"], fields["publisher"], parents)
    for fields in table:
        for parent in found[fields["name"]].derived_from:
            if parent not in found:
                where = f"row {fields['row']}, column derived_from"
                raise InputError(path, where, f"the document '{parent}' is not known", _known(found))
    documents = Documents(found)
    if circle := documents.circle():
        chain = " from ".join((*circle, circle[0]))
        problem = f"documents made from each other in a circle: {chain}"
        raise InputError(path, "column derived_from", problem, "Leave out the step that isn't true")
    return documents


def check_origins(path: Path, rows: Iterable[Row], documents: Documents) -> None:
    """Reject rows that come from a document which their set does not declare.

    Parameters
    ----------
    path : the table, for the error
    documents : of the set that the table belongs to

    Raises
    ------
    InputError
        naming the first such row, and the documents that are known
    """
    for row in rows:
        if row.origin not in documents.by_name:
            problem = f"the document '{row.origin}' is not known"
            raise InputError(path, f"row {row.line}, column origin", problem, _known(documents.by_name))


def check_robot_origins(robot: Robot, documents: Collection[str]) -> None:
    """Reject a robot whose values name documents that its reference sets don't declare.

    Parameters
    ----------
    documents : names in the robot's sets; empty for a robot without sets, which may name any

    Raises
    ------
    InputError
        naming the group or entry, and the documents that are known
    """
    named = {f"{group}.origin": source.origin for group, source in robot.sources.items() if source.origin}
    named |= {f"the origin of {entry}": name for entry, name in robot.origins.items()}
    for field, name in named.items():
        if documents and name not in documents and name != NO_DOCUMENT:
            raise InputError(f"{robot.name}.yaml", field, f"the document '{name}' is not known", _known(documents))


def _known(names: Iterable[str]) -> str:
    return f"Write one of: {', '.join(names) or 'none yet'}; or declare it in {FILE}"


HALF_DEG, COMMANDED_DEG = 0.5, 2.5
LEAST_COMMANDED = 4  # values of a row; rounded to whole degrees they would all be commanded ones once in 600 rows
LONGEST_ARM = 4.0  # times the farther of both points from the base


AS_WRITTEN = f"if the values are meant as they are written, add a column {UNITS_CHECKED} that says yes"
IN_DEGREES = f"Convert to degrees; {AS_WRITTEN}"
LENGTHS = (*_XYZ, "value_mm", "lower_mm", "upper_mm", "speed_mm_s")
ANGLES = ("lower_deg", "upper_deg", "speed_deg_s")


def load_references(name_or_folder: str | Path, robot: Robot | None = None) -> ReferenceSet:
    """Load a reference set by its name in data/manual_refs, or by the path of a folder.

    A name is looked up below the working folder first, then among the references that come with er3a.

    Parameters
    ----------
    robot : rows that do not apply to it are left out with a warning (:class:`er3a.InputWarning`): joints that it does
        not have, a wrist centre, or limits in the other unit. What the last digits of joint values leave open on it
        is added to the uncertainties

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
    files = [each for each in sorted(folder.iterdir()) if each.suffix.lower() == ".csv" and each.name != FILE]
    if not files:
        raise InputError(folder, None, "the folder holds no CSV file", f"Add one of: {_file_names()}")
    tables = {file.stem: check_reference_file(file) for file in files}
    documents = load_documents(folder / FILE)
    for file in files:
        check_origins(file, tables[file.stem], documents)
    if robot is None:
        return reference_set(folder.name, tables, documents)
    aside = {row: why for rows in tables.values() for row in rows if (why := _not_of_arm(row, robot))}
    for row, why in aside.items():
        told = f"{folder / row.kind}.csv: row {row.line} is set aside: {_WHY[why].format(robot=robot)}"
        warnings.warn(told, InputWarning, stacklevel=2)
    usable = {kind: tuple(row for row in rows if row not in aside) for kind, rows in tables.items()}
    found = reference_set(folder.name, usable, documents)
    return replace(found, references=with_rounding(robot, found.references), set_aside=tuple(aside.items()))


def reference_folder(name: str) -> Path:
    """The folder of a reference set: the study's own, else er3a's.

    Parameters
    ----------
    name : of the set, below ``data/manual_refs``

    Returns
    -------
    folder : may be missing, if neither has a set of this name
    """
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
        raise InputError(
            path, None, f"'{path.name}' is not a kind of reference table", f"Name it one of: {_file_names()}"
        )
    table = read_csv(path, FORMATS[kind].all_columns)
    if not table:
        raise InputError(path, None, "the table has a header but no rows", "Add a row, or remove the file")
    _fill_rounding(table)
    for fields in table:
        _fill_uncertainty(FORMATS[kind], fields)
        _check_row(path, FORMATS[kind], fields)
    _check_units(path, FORMATS[kind], table)
    rows = tuple(row_of(kind, fields) for fields in table)
    _check_repeats(path, rows)
    if documents := _documents_beside(path):
        check_origins(path, rows, documents)
    return rows


_WHY: dict[NotOfArm, str] = {
    "no_such_joint": "{robot.name} has {robot.joints} joints",
    "no_wrist_centre": "{robot.name} has no wrist centre",
    "joint_slides": "the joint slides: write its limits and speed in mm (lower_mm, upper_mm, speed_mm_s)",
    "joint_turns": "the joint turns: write its limits and speed in deg",
}


def _not_of_arm(row: Row, robot: Robot) -> NotOfArm | None:
    """Why an arm does not have what a row is about; None if it has."""
    for each in row.references():
        why = not_of_arm(each.quantity, robot)
        if why and (each.expected is not None or why == "no_such_joint"):
            return why
    return None


def _documents_beside(path: Path) -> Documents | None:
    """The documents of a table's set; None if there are none that can be read, which is another file's fault."""
    try:
        return load_documents(path.parent / FILE)
    except InputError:
        return None


def _fill_uncertainty(format: Format, fields: Fields) -> None:
    """Half the last digit that the source prints, where the row gives no uncertainty; then plain numbers."""
    column, digits = format.filled(fields)
    if fields[column] is None:
        decimals = [fields[name].decimals for name in digits if fields[name] is not None]
        fields[column] = format.coarse or 0.5 * 10.0 ** -max(decimals, default=0)
    if ORIENTATION_COLUMNS[0] in fields:
        _fill_orientation_uncertainty(fields)
    for name, value in fields.items():
        fields[name] = float(value) if isinstance(value, Written) else value


def _fill_rounding(table: list[Fields]) -> None:
    """Half the last digit of each joint value, cell by cell; none of commanded values, which are exact.

    A table of whole and half degrees alone is of commanded poses. Beside typed ones of the same source, a row counts as
    commanded only if all its values are multiples of 2.5 degrees: six others, rounded to whole degrees, are so once in
    15 000 rows. Four and more such values in a row whose others are written longer are commanded, too.
    """
    typed = [[fields[name] for name in (*_POSE, *_FURTHER) if fields.get(name) is not None] for fields in table]
    mixed = {fields["source"] for fields, values in zip(table, typed) if not _multiples_of(HALF_DEG, values)}
    for fields, values in zip(table, typed):
        commanded = _multiples_of(COMMANDED_DEG if fields["source"] in mixed else HALF_DEG, values)
        cells = [fields.get(name) for name in (*_POSE, *_FURTHER)]
        short = [value for value in values if value.decimals <= 1]
        exact = short if len(short) >= LEAST_COMMANDED and _multiples_of(COMMANDED_DEG, short) else []
        halves = [
            0.0 if cell is None or any(cell is each for each in exact) else 0.5 * 10.0**-cell.decimals for cell in cells
        ]
        fields["rounding"] = () if commanded else tuple(halves)


def _multiples_of(step: float, values: list[Written]) -> bool:
    """Whether joint values (deg), written with one decimal at most, are whole steps."""
    return all(value.decimals <= 1 and value % step == 0 for value in values)


def _states_none(fields: Fields) -> bool:
    """Whether a row could give an orientation and does not."""
    return ORIENTATION_COLUMNS[0] in fields and not _written_as(fields)


def _fill_orientation_uncertainty(fields: Fields) -> None:
    """The most that half the last digit of each number of an orientation turns the flange by about x, y or z together;
    0 of a row without one."""
    written = _written_as(fields)
    if not written:
        fields["uncertainty_deg"] = 0.0
    elif fields["uncertainty_deg"] is None and not any(_position_faults(fields)):
        form, values = written[0], np.array([fields[name] for name in BY_ROW[written[0]]])
        half = 0.5 * 10.0 ** -max(fields[name].decimals for name in BY_ROW[form])
        if not form.endswith("_deg"):
            half = min(half, NOT_RIGID)  # 0 and 1 alone are no rounded numbers, which would not be rigid to this
        turned = rotations(form, values + half * np.eye(len(values)), math.inf) @ _rotation(form, fields).T
        fields["uncertainty_deg"] = float(np.abs(rotation_vectors_deg(turned)).sum(axis=0).max())


def _check_row(path: Path, format: Format, fields: Fields) -> None:
    faults = []
    for column, value in fields.items():
        if column not in UNCERTAINTIES or value is None or (column == "uncertainty_deg" and _states_none(fields)):
            continue
        if value <= 0:
            remedy = "Half the last digit that the source prints, if it gives none"
            faults.append((column, f"{value:g} is not positive", remedy))
    if fields.get("joint", 1) not in range(1, MAX_JOINTS + 1):
        faults.append(("joint", f"there is no joint {fields['joint']}", f"Write a number from 1 to {MAX_JOINTS}"))
    for column, problem, remedy in (*faults, *format.faults(fields)):
        raise InputError(path, f"row {fields['row']}, column {column}", problem, remedy)


def _check_units(path: Path, format: Format, table: list[Fields]) -> None:
    """Reject values in metres or radians, but where a person has checked the units of every row."""
    if all(fields[UNITS_CHECKED] for fields in table):
        return
    columns = (METRES, LENGTHS, f"Multiply by 1000; {AS_WRITTEN}"), (RADIANS, ANGLES, IN_DEGREES)
    for mistaken, judged, remedy in columns:
        refuse_unit(path, table, judged, mistaken, remedy, whole="length" not in table[0], mixed=format.mixed)
    if _POSE[0] in format.columns:
        _check_angles(path, table)


def _check_angles(path: Path, table: list[Fields]) -> None:
    """Reject poses that are all in radians; of single angles among degrees, which can be meant so, only warn."""
    all_small = max(sizes_of(table, (*_POSE, *_FURTHER))) < WIDEST_IN_RADIANS
    if all_small and _XYZ[0] in table[0]:
        _check_arcs(path, table)
    for fields in table:
        for column in (*_POSE, *(each for each in _FURTHER if fields[each] is not None)):
            steps = fields[column] / STEP_IN_RADIANS
            if round(steps) and abs(fields[column]) < WIDEST_IN_RADIANS and abs(steps - round(steps)) < NEAR_STEP:
                where, degrees = f"row {fields['row']}, column {column}", f"{round(steps) * 15:g}"
                if all_small:
                    problem = f"{fields[column]:g} deg looks like radians"
                    raise InputError(path, where, problem, f"Write {degrees}; {AS_WRITTEN}")
                doubt(None, where, f"{fields[column]:g} deg", "radians", more=f"; those would be {degrees}", file=path)


def _check_arcs(path: Path, table: list[Fields]) -> None:
    """Reject points that move by more than joints that turn so little can move them."""
    first: dict[tuple[str, str], Fields] = {}
    whole = [row for row in table if all(row[column] is not None for column in _XYZ)]
    for row in whole:
        start = first.setdefault((row.get("point", "point"), row["source"]), row)
        point, other = (np.array([each[column] for column in _XYZ]) for each in (start, row))
        turned = sum(abs((row[column] or 0.0) - (start[column] or 0.0)) for column in (*_POSE, *_FURTHER))
        moved, longest = np.linalg.norm(other - point), LONGEST_ARM * max(map(np.linalg.norm, (point, other)))
        if turned and moved > longest * math.radians(turned):
            where = f"row {row['row']}, columns {_POSE[0]} to {_POSE[-1]}"
            problem = f"{turned:.4g} deg in all from row {start['row']} can't move the point by {moved:.4g} mm; "
            raise InputError(path, where, f"{problem}the joint values can only be radians", IN_DEGREES)


def _check_repeats(path: Path, rows: tuple[Row, ...]) -> None:
    seen: dict[tuple[str, Quantity], tuple[int, Reference]] = {}
    for row in rows:
        for reference in row.references():
            key = (reference.document, reference.quantity)
            line, first = seen.setdefault(key, (row.line, reference))
            if line == row.line:
                continue
            if _same(first, reference):
                problem = f"repeats row {line} of the same document ({key_of(reference.subject)})"
            elif conflicts((first, reference)):
                problem = f"contradicts row {line} of the same document ({key_of(reference.subject)})"
            else:
                continue
            raise InputError(path, f"row {row.line}", problem, "Keep one of the two, or name the document of each")


def _same(first: Reference, second: Reference) -> bool:
    if first.expected is None or second.expected is None:
        return first.expected == second.expected
    return first.quantity.apart(first.expected, second.quantity, second.expected) == 0


def _file_names() -> str:
    return ", ".join(f"{kind}.csv" for kind in FORMATS)
