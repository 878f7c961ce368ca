"""D-H tables: one row per joint, under er3a's headings in mm and degrees, or in any form that people write.

Columns: ``joint`` (1 to 10), ``a_mm``, ``alpha_deg``, ``d_mm``; and, if known, ``offset_deg`` and ``direction`` (theta
= direction * q + offset), ``lower_deg``, ``upper_deg``, ``speed_deg_s``. For a prismatic joint, ``type`` is "prismatic"
(otherwise "revolute"), ``theta_deg`` is its constant theta, and its limits and speed are in ``lower_mm``, ``upper_mm``,
``speed_mm_s``. Calibrated tables may have ``beta_deg``, Hayati's rotation about y, and ``calibrated`` (true), which
allows lengths below 2 mm. Leave a cell empty if it does not apply to a joint. A column ``convention`` (standard or
modified, the same in all rows) takes precedence over the reader's argument. Columns may be in metres, inches or radians
instead, and are then named ``d_m``, ``a_in``, ``alpha_rad``, ``speed_rad_s``. A row in which nothing moves is a fixed
transform: its ``type`` is "fixed" (or "tool", after the flange), or it has no variable although others have one, or it
alone, first or last, has no number in its name (``Flange``). All other forms become such a table first
(:mod:`er3a.files.printed_table`).
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from er3a.errors import InputError
from er3a.files.csv_file import CsvRow, CsvRows, columns_of, read_csv, read_lines
from er3a.files.printed_table import (
    FIXED,
    PER_MM,
    PrintedTable,
    nearest_headings,
    printed_table,
    table_text,
)
from er3a.files.robot_file import AS_PRINTED, SHORTEST_PLAIN_LENGTH_MM, RobotFile, far_normals
from er3a.files.units import MAX_DEG, doubt, look_like_radians
from er3a.files.yaml_file import Content, parse
from er3a.geometry.transforms import rot_x, rot_y, rot_z, rpy_of, translation
from er3a.numerics.arrays import Reals
from er3a.numerics.si_units import RADIANS_BELOW_DEG, limit_in_degrees
from er3a.robots.robot import CONVENTIONS, MAX_JOINTS, Convention, Grade, Robot

NEEDED = columns_of("joint:int? a_mm alpha_deg d_mm")
OPTIONAL = columns_of(
    f"convention:{'|'.join(CONVENTIONS)} type:revolute|prismatic|fixed|tool theta_deg? beta_deg calibrated:true|false "
    "offset_deg? direction:int? lower_deg? upper_deg? lower_mm? upper_mm? speed_deg_s? speed_mm_s?"
)
ASSUMED_LIMIT_DEG = 180.0
LengthUnit = Literal["mm", "cm", "m", "in"]
AngleUnit = Literal["deg", "rad"]
WORDS = {"m": "metres", "in": "inches", "cm": "centimetres"}
PER_RAD = math.degrees(1.0)
OTHER_UNITS = {unit: ("mm", scale) for unit, scale in PER_MM.items() if unit != "mm"} | {"rad": ("deg", PER_RAD)}
SHORTEST_ARM_MM = 10.0  # a table whose lengths are all below is in metres or inches
LONGEST_LINK_M = 2.5  # of robots; the same number of inches is a link of 64 mm, below those of most
SHORTEST_LINK_MM = 80.0  # longest link of an arm in mm; the same number of cm is one, too
ROUND_MM = (0.1, 2e-3, 2), (0.01, 5e-4, 3), (0.5, 0.0135, 3)
"""What lengths in mm are multiples of, how nearly if they were in another unit, and how many it takes to say so."""
ASSUMED_SLIDE_MM = 1000.0
ONE_ENTRY, OTHERWISE = 1.2, 2.0  # numbers that a known arm has otherwise: one wrong entry; more in the other convention


def read_dh_table(
    path: str | Path,
    name: str,
    convention: Convention | None = None,
    *,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    as_printed: bool = False,
    columns: Sequence[str] = (),
    text: str | None = None,
) -> tuple[RobotFile, tuple[str, ...]]:
    """Make a robot file from a D-H table.

    Parameters
    ----------
    name : of the robot
    convention : None means standard, unless the table says another, its numbers are a known arm's in the other alone,
        or joints 1 and 2 would turn about one line
    length_unit, angle_unit : units of a table whose column names say mm and deg although its values are in other units;
        None means mm and deg, unless the values can't be
    as_printed : keep values in the unit that their column says although they look like another; each gives a
        :class:`er3a.errors.DoubtfulUnit`. Otherwise they are refused. Columns that say no unit are taken for what their
        values can only be, with a note
    columns : what the columns mean, as :func:`er3a.files.printed_table.printed_table` takes it
    text : of the file, if it has been read

    Returns
    -------
    content : values of the table have grade "claim", assumed values "inferred"
    notes : the assumptions, as sentences

    Raises
    ------
    InputError
        naming row and column, or the field of the robot file that the values do not fit
    """
    path = Path(path)
    printed = _printed(path, columns, text, convention)
    header = printed.lines[0][1] if printed.lines else []
    names = {_usual_unit(column)[0]: column for column in header}
    known = NEEDED | {column: kind for column, kind in OPTIONAL.items() if column in names}
    raw = read_csv(path, {names.get(column, column): kind for column, kind in known.items()}, printed.lines)
    rows = [_in_usual_units(row) for row in raw]
    converted = {column for column, name in names.items() if column != name}
    notes = [*printed.notes]
    notes += _in_own_units(path, rows, length_unit, angle_unit, as_printed, own=converted, printed=printed)
    given = set(names)
    if len(stated := {row["convention"] for row in rows if "convention" in given}) > 1:
        raise InputError(path, "column convention", "two conventions in one table", "Write the same in all rows")
    said = next(iter(stated), convention)
    idle = _first_is_idle(rows)
    convention = said or "standard"
    short = _short_lengths(path, rows, converted, as_printed, bool(length_unit or _calibrated(rows, convention)))
    _check_pairs_of_limits(path, given)
    if fixed := [str(row["row"]) for row in rows if row.get("type") in FIXED]:
        notes.append(f"row {', '.join(fixed)}: nothing moves there; read as a fixed transform")
    rows, placed = _without_fixed_rows(rows, convention)
    if [row["joint"] for row in rows] != list(range(1, len(rows) + 1)) or not 1 <= len(rows) <= MAX_JOINTS:
        problem = f"the joints are {', '.join(str(row['joint']) for row in rows)[:60] or 'none'}"
        remedy = f"er3a models 1 to {MAX_JOINTS} joints: write one row for each, from 1 on in order"
        raise InputError(path, "column joint", problem, remedy)
    for row in rows:
        _check_kind(path, row, given)
    kinds = {_unit(row) for row in rows}
    notes += _assumed(given, kinds, convention)
    if _far_normals(rows, convention):
        notes.append("d of more than 5 m that cancel: read as a calibrated table, with Hayati's beta in place of them")
    content = _content(rows, given, name, convention, path.name)
    content |= {group: _placement(T, path.name) for group, T in placed.items() if not np.array_equal(T, np.eye(4))}
    if angle_unit is not None:
        content["units_checked"] = True
    longest = max((abs(row[key]) for row in rows for key in ("a_mm", "d_mm")), default=0.0)
    if short or 0 < longest < SHORTEST_ARM_MM:
        content["dh"]["calibrated"] = True  # lengths of a millimetre or less are meant
    found = parse(RobotFile, content, path, AS_PRINTED if as_printed else None)
    if why := "" if said else _modified_as(path, found, rows if idle else []):
        form: Any = {"length_unit": length_unit, "angle_unit": angle_unit, "as_printed": as_printed, "text": text}
        other, assumed = read_dh_table(path, name, "modified", columns=columns, **form)
        return other, (*assumed, f"read as modified D-H: {why}")
    return found, tuple(notes)


def _first_is_idle(rows: Sequence[CsvRow]) -> bool:
    """Whether the first row alone has neither a nor alpha, as is usual in Craig's tables; read as standard, two joints
    would do one's work."""
    still = [not (row["a_mm"] or row["alpha_deg"]) for row in rows if row.get("type") not in FIXED]
    return sum(still) == 1 and still[0] and len(still) > 1 and {*map(_unit, rows[:2])} == {"deg"}


def _modified_as(path: Path, found: RobotFile, idle: CsvRows) -> str:
    """Why a table that says no convention is modified D-H, or nothing; ``idle``: its rows, if the first alone has
    neither a nor alpha."""
    way, near = _known_as(found)
    if way or not idle:
        return "so it is a known arm's, as standard D-H none's" if way == "modified" else ""
    # A table whose axes are all parallel has no joint that says which link its lengths are of.
    if near == "standard" or not idle[1]["alpha_deg"]:
        raise _two_readings(path)
    return "as standard D-H, joints 1 and 2 would turn about one line"


def _two_readings(path: Path) -> InputError:
    problem = "read as standard D-H, joints 1 and 2 turn about one line; read as modified D-H, none do"
    remedy = "Write modified D-H or standard D-H above the table, or say it by --convention"
    return InputError(path, "convention", problem, remedy)


def _known_as(content: RobotFile) -> tuple[Convention | None, str]:
    """The convention in which alone a table's numbers are those of an arm of the catalogue, but for one, None if they
    are in neither or both; and the one in which they are nearer, "" if in none."""
    from er3a.comparison.nearest import misfits  # most tables say their convention
    from er3a.files.arm_catalogue import known_arms

    rows, zeros = content.dh.rows, content.zero.rows
    with warnings.catch_warnings(action="ignore"):  # of units, which the table's own reader looks at
        robot = Robot.from_dh(
            np.array([row.a_mm for row in rows]) / 1000,
            np.radians([row.alpha_deg for row in rows]),
            np.array([row.d_mm for row in rows]) / 1000,
            offset=np.radians([zero.offset_deg or row.theta_deg or 0.0 for row, zero in zip(rows, zeros)]),
            sliding=np.array([row.type == "prismatic" for row in rows]),
        )
    arms = [each.robot for each in known_arms().values() if np.array_equal(each.robot.sliding, robot.sliding)]
    off = misfits(robot, arms).min(axis=1).tolist() if arms else [np.inf]
    nearer = CONVENTIONS[off.index(min(off))]
    near, clear = min(off) < ONE_ENTRY, max(off) > min(off) + OTHERWISE
    return nearer if near and clear else None, nearer if near else ""


def _printed(
    path: Path, columns: Sequence[str] = (), text: str | None = None, convention: Convention | None = None
) -> PrintedTable:
    """The table that a file holds, under er3a's headings.

    Raises
    ------
    InputError
        for a file without one
    """
    text = table_text(path) if text is None else text
    found = printed_table(path, text, columns, convention)
    if found is None and path.suffix != ".csv":
        problem = nearest_headings(text) or "no row of headings with a, alpha and d was found"
        remedy = (
            "Write all numbers of a row, 0 too, below a line theta,d,a,alpha, or say what its columns are: --column"
        )
        raise InputError(path, None, problem, remedy)
    return found or PrintedTable(read_lines(path), ())


def _check_pairs_of_limits(path: Path, given: set[str]) -> None:
    """Reject a column of limits without that of the other ends."""
    for pair in {"lower_deg", "upper_deg"}, {"lower_mm", "upper_mm"}:
        if len(missing := pair - given) == 1:
            problem = "missing beside the other limit"
            raise InputError(path, f"column {missing.pop()}", problem, "Give both limits, or none")


def _short_lengths(path: Path, rows: CsvRows, own: set[str], as_printed: bool, meant: bool) -> bool:
    """Whether the table has lengths below two millimetres. Unless they are meant, or in columns that said their unit
    (``own``), they are refused, or, with ``as_printed``, doubted if no length is longer."""
    short = [(row, key) for row in rows for key in ("a_mm", "d_mm") if 0 < abs(row[key]) < SHORTEST_PLAIN_LENGTH_MM]
    unsaid = [each for each in short if each[1] not in own]
    if unsaid and not meant:
        row, key = unsaid[0]
        if not as_printed:
            problem = f"{row[key]:g} mm looks like metres"
            remedy = f"Write {1000 * row[key]:g}, or name the column {key[0]}_m; if so short a length is meant, give"
            remedy += " --length-unit mm, or add a column calibrated with true in each row"
            raise InputError(path, f"row {row['row']}, column {key}", problem, remedy)
        if all(abs(each[key]) < SHORTEST_PLAIN_LENGTH_MM for each in rows):
            doubt(None, f"column {key}", f"{row[key]:g} mm", "metres", file=path)
    return bool(short)


# Rows in which nothing moves ------------------------------------------------------------------------------------------

PARALLEL = 1e-9  # sine of an angle between axes below which a common normal has no digits left
DIGITS = 9  # of mm and deg, that products of matrices leave


def _without_fixed_rows(rows: CsvRows, convention: str) -> tuple[CsvRows, dict[str, Reals]]:
    """The rows of joints, and what fixed rows before and after them make of base, flange and tool, (4, 4), mm.

    A fixed row between two joints is exactly part of the link there. Any rigid transform between two axes is
    ``Rz Tz Tx(a) Rx(alpha) Rz Tz`` along their common normal (Denavit, Hartenberg 1955); the turns and shifts at its
    ends commute with the joints' motions, so they join theta and d of the neighbouring rows.
    """
    base, between, tool = np.eye(4), np.eye(4), np.eye(4)
    joints: CsvRows = []
    waiting = carried = False
    for row in rows:
        carried |= row.get("type") == "tool"
        if row.get("type") not in FIXED:
            if waiting:
                _join(joints[-1], between @ tool, row, convention)
            joints.append(row)
            between, tool, waiting, carried = np.eye(4), np.eye(4), False, False
        elif not joints:
            base = base @ _fixed(row, convention)
        elif carried:
            tool, waiting = tool @ _fixed(row, convention), True
        else:
            between, waiting = between @ _fixed(row, convention), True
    return joints, {"base": base, "flange": between, "tool": tool}


def _across(row: CsvRow) -> Reals:
    turn: Reals = rot_x(math.radians(row["alpha_deg"])) @ rot_y(math.radians(row.get("beta_deg") or 0.0))
    return translation(row["a_mm"], 0, 0) @ turn


def _fixed(row: CsvRow, convention: str) -> Reals:
    """A row's transform (4, 4), mm, with the variable at 0."""
    theta = (row.get("offset_deg") or 0.0) + (row.get("theta_deg") or 0.0)
    along: Reals = rot_z(math.radians(theta)) @ translation(0, 0, row["d_mm"])
    return along @ _across(row) if convention == "standard" else _across(row) @ along


def _join(before: CsvRow, fixed: Reals, after: CsvRow, convention: str) -> None:
    """Make a fixed transform (4, 4), mm, part of the link between two rows."""
    link = before if convention == "standard" else after
    T = _across(link) @ fixed if convention == "standard" else fixed @ _across(link)
    skew = math.hypot(T[0, 2], T[1, 2]) > PARALLEL
    turn = math.atan2(T[0, 2], -T[1, 2]) if skew else math.atan2(*np.round(T[1::-1, 3], DIGITS))
    T = rot_z(-turn) @ T  # Tz Tx(a) Rx(alpha) Rz Tz
    far = T[1, 3] / T[1, 2] if skew else 0.0
    alpha = math.atan2(-T[1, 2] if skew else 0.0, T[2, 2])
    link |= {"a_mm": round(T[0, 3], DIGITS), "alpha_deg": round(math.degrees(alpha), DIGITS)}
    if link.get("beta_deg"):
        link["beta_deg"] = 0.0
    ends = (before, turn, T[2, 3] - T[2, 2] * far), (after, math.atan2(-T[0, 1], T[0, 0]), far)
    for row, angle, shift in ends:
        theta = "theta_deg" if _unit(row) == "mm" else "offset_deg"
        row[theta] = round((row.get(theta) or 0.0) + math.degrees(angle), DIGITS)
        row["d_mm"] = round(row["d_mm"] + shift, DIGITS)


def _placement(T: Reals, source: str) -> Content:
    xyz, rpy = ((np.round(each, DIGITS) + 0.0).tolist() for each in (T[:3, 3], np.degrees(rpy_of(T))))
    return {"source": f"Table {source}, a row without a joint", "grade": "claim", "xyz_mm": xyz, "rpy_deg": rpy}


def _assumed(given: set[str], kinds: set[str], convention: Convention) -> Iterator[str]:
    """What is assumed because no column of the table says it."""
    if convention == "standard" and "convention" not in given:
        yield "the table was read as standard D-H; --convention modified if it is Craig's"
    if not given & {"offset_deg", "direction"}:
        yield "no column offset_deg or direction: joint angles are taken to be the table's own"
    if "deg" in kinds and "lower_deg" not in given:
        yield f"no limits were read: +-{ASSUMED_LIMIT_DEG:g} deg were assumed for all joints that turn"
    if "mm" in kinds and "lower_mm" not in given:
        yield f"no limits were read: 0 to {ASSUMED_SLIDE_MM:g} mm were assumed for all joints that slide"
    if any(f"speed_{unit}_s" not in given for unit in kinds):
        yield "no speeds were read: those that the study assumes stand in for them"


def _unit_of(column: str) -> str:
    """The unit that a column's name ends in, of a speed that of its path; "" if it has none."""
    return column.removesuffix("_s").rpartition("_")[2]


def _usual_unit(column: str) -> tuple[str, float]:
    """A column's name in mm or degrees, and what takes its values to those."""
    unit, scale = OTHER_UNITS.get(_unit_of(column), ("", 1.0))
    return (re.sub(r"_(cm|m|in|rad)(_s)?$", rf"_{unit}\2", column) if unit else column), scale


def _in_usual_units(row: CsvRow) -> CsvRow:
    found = {}
    for column, value in row.items():
        name, scale = _usual_unit(column)
        found[name] = _converted(name, value, scale) if isinstance(value, float) else value
    return found


def _in_own_units(
    path: Path,
    rows: CsvRows,
    length_unit: LengthUnit | None,
    angle_unit: AngleUnit | None,
    as_printed: bool,
    *,
    own: set[str],
    printed: PrintedTable,
) -> Iterator[str]:
    """Take all values to mm and degrees, and doubt or refuse those that are another unit's.

    Lengths and twists are taken for what they can only be if no heading says their unit. Otherwise such lengths are
    refused, with ``as_printed`` doubted, and such twists stay degrees, with a note.
    ``own``: columns that said their unit.
    """
    without_unit = printed.without_unit
    lengths = [abs(row[key]) for row in rows for key in ("a_mm", "d_mm") if row[key] and key not in own]
    unsaid = {"a_mm", "d_mm"} - own <= without_unit
    slides = any(_unit(row) == "mm" for row in rows) and not unsaid
    unit = length_unit or _length_unit(path, [] if slides else lengths, as_printed, unsaid)
    if unit != (length_unit or "mm"):
        yield f"the lengths, {max(lengths):g} at most, were read as {WORDS[unit]}; --length-unit mm if they are mm"
    as_degrees = angle_unit == "deg" or not rows
    turned = set() if as_degrees else {column for column in rows[0] if _unit_of(column) == "deg"} - own
    if angle_unit is None:
        if as_printed and (wide := [row[c] for row in rows for c in turned if row[c] and abs(row[c]) > MAX_DEG]):
            doubt(None, "angles", f"{wide[0]:g} deg", "degrees that were converted twice", file=path)
        found = _twists_in_radians(rows, own, "alpha_deg" in without_unit)
        turned = {column for column in turned if _in_radians(rows, column)} if found else set()
        named = ", ".join(sorted(turned))
        if turned and "alpha_deg" in without_unit:
            yield f"{named} were read as radians; --angle-unit deg if they are degrees"
        elif turned:
            yield f"{named} look like radians: give --angle-unit rad if they are"
            turned = set()
        elif "alpha_deg" in without_unit and _in_radians(rows, "alpha_deg"):
            raise InputError(path, "column alpha", "small angles say no unit", "Give --angle-unit deg or rad")
    for row in rows:
        for column, value in row.items():
            if column not in own and isinstance(value, float):
                scale = PER_RAD if column in turned else {"mm": PER_MM[unit]}.get(_unit_of(column), 1.0)
                row[column] = _converted(column, value, scale)


def _length_unit(path: Path, lengths: list[float], as_printed: bool, unsaid: bool) -> LengthUnit:
    """The unit of lengths that no heading says (``unsaid``), or mm; others are refused, with ``as_printed`` doubted."""
    likely = _likely_unit(lengths) if lengths else "mm"
    longest = max(lengths, default=0.0)
    # A small arm in mm, or a large one in cm, and no other for sure.
    small = LONGEST_LINK_M <= longest < SHORTEST_LINK_MM
    if unsaid and small and (likely in ("mm", "cm") or all(length == round(length) for length in lengths)):
        problem = f"the lengths, {longest:g} at most, say no unit"
        raise InputError(path, "columns a, d", problem, "Give --length-unit mm, cm, m or in")
    if likely == "mm":
        return "mm"
    word = WORDS[likely]
    if not (as_printed or unsaid):
        problem = f"the lengths, {longest:g} mm at most, are those of an arm in {word}"
        remedy = f"Name the columns a_{likely} and d_{likely}, or give --length-unit {likely}"
        remedy += " (or mm)" if longest > SHORTEST_PLAIN_LENGTH_MM else ""
        raise InputError(path, "columns a_mm, d_mm", problem, remedy)
    if not unsaid or likely != "m":  # no arm's lengths are below a millimetre
        doubt(None, "columns a, d", f"{longest:g} mm at most", word, file=path)
    return likely if unsaid else "mm"


def _converted(column: str, value: float, scale: float) -> float:
    """A value in mm or degrees; one in radians as :func:`er3a.numerics.si_units.limit_in_degrees` if it is a limit."""
    if scale == PER_RAD and column in ("lower_deg", "upper_deg"):
        return limit_in_degrees(value, 1 if column == "lower_deg" else -1)
    return value * scale


def headed_units(
    path: Path,
    length_unit: LengthUnit | None = None,
    angle_unit: AngleUnit | None = None,
    columns: Sequence[str] = (),
    text: str | None = None,
    convention: Convention | None = None,
) -> dict[str, str]:
    """The unit of each column of a D-H table, as its heading says it.

    Parameters
    ----------
    length_unit, angle_unit, columns, text, convention : as of :func:`read_dh_table`; the units are of headings that say
        mm and deg, or nothing

    Returns
    -------
    units : such as ``{"a": "in", "alpha": "rad", "lower": "deg"}``
    """
    lines = _printed(path, columns, text, convention).lines
    meant = {"mm": length_unit or "mm", "deg": angle_unit or "deg"}
    units = {name.partition("_")[0]: _unit_of(name) for name in (lines[0][1] if lines else ())}
    return {name: meant.get(unit, unit) for name, unit in units.items() if unit in (*PER_MM, "deg", "rad")}


def _in_radians(rows: CsvRows, column: str) -> bool:
    """Whether a column's values can all be radians, and are not all 0."""
    values = [abs(row[column]) for row in rows if row[column]]
    return bool(values) and max(values) < RADIANS_BELOW_DEG


def _twists_in_radians(rows: CsvRows, own: set[str], unsaid: bool) -> bool:
    """Whether all twists are right angles in radians, as printed with two decimals or more; two at least, or one where
    no heading says degrees (``unsaid``)."""
    twists = [row["alpha_deg"] for row in rows if row["alpha_deg"]]
    enough = look_like_radians(twists) or (unsaid and twists)
    return bool("alpha_deg" not in own and enough and all(look_like_radians([each, each]) for each in twists))


def _likely_unit(lengths: list[float]) -> LengthUnit:
    """What lengths are in: inches if they are round millimetres in inches alone; else, below 10, metres or inches."""

    def is_round(scale: float, values: list[float]) -> bool:
        off = [[abs(x * scale - round(x * scale / step) * step) for x in values] for step, _, _ in ROUND_MM]
        return any(len(set(values)) >= least and max(gaps) < near for gaps, (_, near, least) in zip(off, ROUND_MM))

    # Arms are made in round mm: lengths that are round mm only if they are read as inches are inches.
    metres = max(lengths) < SHORTEST_ARM_MM
    odd = [x for x in lengths if round(x, 1) != x]  # whole inches are whole tenths of a millimetre
    in_inches = max(lengths) < LONGEST_LINK_M * 1000 / 25.4 and is_round(25.4, odd) and not is_round(1.0, lengths)
    if in_inches and not (metres and is_round(1000.0, lengths)):
        return "in"
    return "mm" if not metres else "m" if max(lengths) < LONGEST_LINK_M else "cm"


def _unit(row: CsvRow) -> str:
    return "mm" if row.get("type") == "prismatic" else "deg"


def _check_kind(path: Path, row: CsvRow, given: set[str]) -> None:
    """Reject cells that are empty, or filled in for the other kind of joint."""
    unit = _unit(row)
    own = {f"lower_{unit}", f"upper_{unit}", f"speed_{unit}_s", "theta_deg" if unit == "mm" else "offset_deg"}
    own |= {"joint", "direction"}
    for column in sorted(given & {key for key, kind in OPTIONAL.items() if kind.optional}):
        where = f"row {row['row']}, column {column}"
        if column in own and row[column] is None:
            raise InputError(path, where, "empty", "Fill in a value")
        if column not in own and row[column]:
            kind = "slides" if unit == "mm" else "turns"
            remedy = "Leave the cell empty, or correct its type"
            if column == "theta_deg":
                remedy = "Write what theta is with the joint at 0 as offset_deg, or correct the joint's type"
            raise InputError(path, where, f"joint {row['joint']} {kind}", remedy)


def _far_normals(rows: CsvRows, convention: str) -> bool:
    shift = 1 if convention == "modified" else 0
    alphas = [row["alpha_deg"] for row in rows[shift:]] + [0.0] * shift
    return far_normals([(row["d_mm"], alpha) for row, alpha in zip(rows, alphas)])


def _calibrated(rows: CsvRows, convention: str) -> bool:
    """Whether the table says so, has turns about y, or normals far away that cancel."""
    stated = any(row.get("calibrated") == "true" or row.get("beta_deg") for row in rows)
    return stated or _far_normals(rows, convention)


def _filled(row: CsvRow) -> CsvRow:
    """A row with what is assumed where its table has no column, without the columns of the other kind of joint."""
    unit, other, angle = ("mm", "deg", "offset_deg") if _unit(row) == "mm" else ("deg", "mm", "theta_deg")
    kind = {"type": "prismatic", "theta_deg": 0.0} if unit == "mm" else {"offset_deg": 0.0}
    lower, upper = (0.0, ASSUMED_SLIDE_MM) if unit == "mm" else (-ASSUMED_LIMIT_DEG, ASSUMED_LIMIT_DEG)
    assumed = {"direction": 1, f"lower_{unit}": lower, f"upper_{unit}": upper} | kind
    others = {"type", angle, f"lower_{other}", f"upper_{other}", f"speed_{other}_s"}
    return assumed | {key: value for key, value in row.items() if value is not None and key not in others}


def _content(rows: CsvRows, given: set[str], name: str, convention: str, source: str) -> Content:
    units = {_unit(row) for row in rows}
    filled = [_filled(row) for row in rows]

    def group(known: bool, *keys: str) -> Content:
        grade: Grade = "claim" if known else "inferred"
        own = [{key: row[key] for key in ("joint", *keys) if key in row} for row in filled]
        return {"source": f"Table {source}" if known else "Not in the table; assumed", "grade": grade, "rows": own}

    table = group(True, "type", "theta_deg", "a_mm", "alpha_deg", "d_mm", "beta_deg")
    limits = [f"{end}_{unit}" for unit in units for end in ("lower", "upper")]
    content: Content = {
        "kind": "robot",
        "name": name,
        "title": name,
        "zero_pose": "not stated",
        "dh": {"convention": convention, "calibrated": _calibrated(rows, convention)} | table,
        "zero": group(bool(given & {"offset_deg", "direction"}), "direction", "offset_deg"),
        "limits": group(given >= {*limits}, *limits),
    }
    if convention == "standard" and "convention" not in given:
        content["dh"]["source"] += ", read as standard D-H, which it does not say"
    if "direction" not in given and "offset_deg" in given:
        content["zero"]["source"] += "; it gives no directions: all were assumed as +1"
    if given >= (speeds := {f"speed_{unit}_s" for unit in units}):
        content["speeds"] = group(True, *speeds)
    return content
