"""Reads joint values and poses of a controller: tables by their headings, and lines of a pendant.

Tables are CSV with any separator, decimal commas, and further columns. Lines are ABB's ``jointtarget`` and
``robtarget`` as ``TPWrite`` prints them, KRL's ``{A1 10.0, ...}`` and ``{X 500.0, ...}``, Fanuc's
``P[1]{ J1 = 10.0 deg, ...}``, and EFORT's ``POINTJ(...)`` and ``POINTC(...)``. Recordings of ROS become such a table
(:mod:`er3a.confirmation.bag`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from er3a.confirmation.bag import is_recording, recorded_lines
from er3a.confirmation.pairs import Pairs, spread
from er3a.errors import ArgumentError, InputError
from er3a.files.arithmetic import UNITS, words_of
from er3a.files.csv_file import LARGEST_DIGITS, CsvColumn, Lines, Written, cell_value, check_widths, csv_text, lines_of
from er3a.files.orientations import OF_THREE, NoRotationError, of_angles, rotations
from er3a.files.path_file import UR_JOINTS
from er3a.files.units import IN_SI
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

MAX_ROWS = 10_000
MOST_TYPED = 6  # decimals; a program that writes more leaves out zeros at the end, if it does, of no weight
REST = 1e-3  # rad/s or m/s, below which a joint rests
STILL, RECORDING = 1e-4, 200  # rad or m between two rows of a stop; rows of a recording
NEAR_TURN, LONGEST_M = 6.4, 20.0
"""Angles without a unit that are all below are rad; positions without one m."""
NEAR_ROTATION = 0.02  # by which a quaternion or a matrix as it was typed may be off one
UNIT = re.compile(rf"[\s_\[(./]+({'|'.join(UNITS)})\s*[\])]?$")
LENGTHS = ("mm", "m", "cm", "in")
NUMBER = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"
TARGETS = re.compile(r"\[\s*\[([^\[\]]*)\]\s*,\s*\[([^\[\]]*)\]|\{([^{}]*)\}|\bE?POINT([JC])\s*\(([^()]*)")
"""Of ABB in brackets, of KRL and Fanuc in braces, of EFORT's RPL."""
OF_POSES: tuple[tuple[str, ...], ...] = (("a", "b", "c"), ("w", "p", "r"), ("qw", "qx", "qy", "qz"))
NO_POSITIONS = re.compile(
    r"vel|qd|dq|tau|torque|effort|curr|temp|volt|moment|force|target|cmd|command|des|tcp|pose|cart|ee|acc|limit|o_t|tool"
)
OF_TOOL = re.compile(r"^(?!.*(vel|speed|target|force|offset|_c$|_d$)).*(tcp|pose|cart|ee$|flange)")
RATES = re.compile(r"(^|_)(actual_qd|qd|dq|vel\w*)$")
COMMENT = r"[ \t]*[#!%]"
ANGLES = {
    tuple(names.split(",")): tuple(forms.split(","))
    for names, forms in words_of(
        "a,b,c=abc w,p,r=rpy roll,pitch,yaw=rpy o,a,t=zyz z1,y,z2=zyz rx,ry,rz=rotation_vector,rpy,zyz,xyz r,p,y=rpy"
    ).items()
}
QUATERNIONS = [tuple(names.split(",")) for names in words_of("qw,qx,qy,qz w,x,y,z q1,q2,q3,q4 q_1,q_2,q_3,q_4")]
MATRICES = (
    tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    tuple(f"{axis}{row}" for row in "xyz" for axis in ("n", "o", "a")),
)
REMEDY = (
    "Give columns such as A1 ... A6, X, Y, Z, A, B, C, or q1_deg ... q6_deg, x_mm, y_mm, z_mm, rx_deg, ry_deg, rz_deg"
)


def read_pairs(
    source: str | Path, robot: Robot, text: str | None = None, *, angles: str | None = None, units: str | None = None
) -> Pairs:
    """Joint values and poses of a controller.

    Parameters
    ----------
    source : a file; with ``text`` only its name, for messages
    robot : with n joints, which columns have to give
    angles : the form of orientations, if it is none that the columns' names say
    units : of positions, in place of what the columns' names say

    Returns
    -------
    pairs : m and rad

    Raises
    ------
    InputError
        naming file, row or columns, and the remedy
    """
    if units is not None and units not in LENGTHS:
        raise ArgumentError("units", units, f"one of {', '.join(LENGTHS)}")
    path = Path(source)
    if text is None and is_recording(path):
        lines = recorded_lines(path)
    else:
        content = csv_text(path) if text is None else text
        lines = _lines_of_pendant(path, content, robot.joints) or _table(path, content, robot.joints)
    pairs = _pairs(path, robot, lines, units)
    if angles is None:
        return pairs
    if angles not in pairs.turns:
        raise ArgumentError("angles", angles, f"one of {', '.join(pairs.turns) or 'none, without orientations'}")
    turns = {angles: pairs.turns[angles], **pairs.turns}
    return replace(pairs, turns=turns, named=1)


def _lines_of_pendant(path: Path, text: str, joints: int) -> Lines:
    """A table of the joint values and poses in targets in brackets or braces, in the order in which they come."""
    q: Lines = []
    poses: list[list[str]] = []
    header: list[str] = []
    line, seen = 1, 0
    for found in TARGETS.finditer(text):
        line, seen = line + text.count("\n", seen, found.start()), found.start()
        values = _values_of(found, joints)
        for names in [[f"{letter}{k + 1}" for k in range(joints)] for letter in "aj"]:
            if values.keys() >= set(names):
                q.append((line, [values[name] for name in names]))
        if values.keys() >= {"x", "y", "z"}:
            turn = next((turn for turn in OF_POSES if values.keys() >= set(turn)), ())
            header = [*(f"j{k + 1}_deg" for k in range(joints)), "x_mm", "y_mm", "z_mm", *turn]
            poses.append([values[name] for name in ("x", "y", "z", *turn)])
    if not (q and poses):
        return []
    if len(q) != len(poses):
        problem = f"{len(q)} targets of joints and {len(poses)} of poses"
        raise InputError(path, None, problem, "Give one pose for each joint target, in the same order")
    return [(0, header), *((line, [*own, *pose]) for (line, own), pose in zip(q, poses))]


def _values_of(target: re.Match[str], joints: int) -> dict[str, str]:
    """Numbers of a target by the names that KRL and Fanuc give them; of ABB those of a jointtarget or robtarget."""
    own = [f"j{k + 1}" for k in range(joints)]
    if target[3] is not None:
        return {key.lower(): value for key, value in re.findall(rf"([A-Za-z]\w*)\s*[=:]?\s*({NUMBER})", target[3])}
    if target[4]:
        return dict(zip(own if target[4] == "J" else "xyzabc", re.findall(NUMBER, target[5])))
    first, second = (re.findall(NUMBER, part) for part in target.group(1, 2))
    if len(first) == 3 and len(second) == 4:
        return dict(zip(("x", "y", "z", "qw", "qx", "qy", "qz"), (*first, *second)))
    return dict(zip(own, first)) if len(first) == joints else {}


def _table(path: Path, text: str, joints: int) -> Lines:
    """Headings and rows of a table, with er3a's own headings for one that has none; comments are left out, but that
    which holds the headings."""
    text = re.sub(rf"(?m)^{COMMENT}.*\n(?={COMMENT})", "\n", text)
    text = re.sub(rf"(?m)^{COMMENT}.*$", "", re.sub(r"\A\s*[#!%][#!% ]*", "", text))
    lines = lines_of(path, text, mixed=True)
    if not lines:
        raise InputError(path, None, "the file is empty", REMEDY)
    header = lines[0][1]
    if all(re.fullmatch(NUMBER, field) for field in header):
        more = {3: [], 6: ["rx", "ry", "rz"], 7: ["qx", "qy", "qz", "qw"]}.get(len(header) - joints)
        if more is None:
            raise InputError(path, f"row {lines[0][0]}", "the table has no headings", REMEDY)
        lines.insert(0, (0, [*(f"j{k + 1}" for k in range(joints)), "x", "y", "z", *more]))
    check_widths(path, lines)
    return lines


class _Columns:
    """Columns by names without their units, and their numbers."""

    def __init__(self, path: Path, lines: Lines):
        self.path, self.rows = path, lines[1:]
        self.places: dict[str, int] = {}
        self.units: dict[str, str] = {}
        for place, heading in enumerate(lines[0][1]):
            low = " " + heading.strip().lower()
            unit = UNIT.search(low)
            name = re.sub(r"\W+", "_", low[: unit.start()] if unit else low).strip("_")
            self.places.setdefault(name, place)
            self.units.setdefault(name, UNITS[unit[1]] if unit else "")

    def cells(self, names: Sequence[str]) -> list[list[Written]]:
        """The numbers of N rows in k columns, as they are written."""
        kind, places = CsvColumn(Written), [(name, self.places[name]) for name in names]
        return [
            [cell_value(self.path, line, name, row[place].strip().rstrip("°"), kind) for name, place in places]
            for line, row in self.rows
        ]

    def numbers(self, names: Sequence[str]) -> tuple[Reals, Reals]:
        """Values (N, k) of columns, and the last digit of each, none finer than half of them have.

        A zero more at the end of a field says nothing of the others, and little of its own. Of numbers that no person
        types all have the digits of the longest.
        """
        cells = self.cells(names)
        decimals = np.array([[cell.decimals for cell in row] for row in cells], float)
        usual = decimals.max() if decimals.max() > MOST_TYPED else np.floor(np.median(decimals))
        decimals = np.full_like(decimals, usual) if usual > MOST_TYPED else np.minimum(decimals, usual)
        digits = 10.0 ** -np.clip(decimals, -LARGEST_DIGITS, LARGEST_DIGITS)
        return np.array(cells, float), np.asarray(digits)

    def together(self, names: Sequence[str]) -> list[str] | None:
        """Columns with these names, behind one beginning; the shortest."""
        starts = sorted({name.removesuffix(names[0]) for name in self.places if name.endswith(names[0])}, key=len)
        for start in starts:
            if (not start or start.endswith("_")) and all(start + name in self.places for name in names):
                return [start + name for name in names]
        return None

    def families(self) -> dict[str, list[str]]:
        """Columns that are numbered without a gap from 0 or 1, by what is before and behind the number."""
        found: dict[tuple[str, str], dict[int, str]] = {}
        for name in self.places:
            if parts := re.fullmatch(r"(.*?)_?(\d{1,2})(_pos\w*|_angle\w*|)", name):
                found.setdefault((parts[1], parts[3]), {})[int(parts[2])] = name
        whole: dict[str, list[str]] = {}
        for (start, _), numbered in found.items():
            first = min(numbered)
            if first in (0, 1) and sorted(numbered) == list(range(first, first + len(numbered))):
                whole.setdefault(start, [numbered[k] for k in sorted(numbered)])
        return whole


def _pairs(path: Path, robot: Robot, lines: Lines, lengths: str | None) -> Pairs:
    columns = _Columns(path, lines)
    families = columns.families()
    joints = _joint_columns(columns, families, robot.joints)
    if joints is None:
        seen = ", ".join(f"{start or '?'} ({len(names)})" for start, names in families.items())[:80] or "none"
        raise InputError(path, "header", f"no columns of {robot.joints} joints; numbered columns: {seen}", REMEDY)
    notes = []
    place, turn = _pose_columns(columns, {start: names for start, names in families.items() if names != joints}, joints)
    if place is None:
        raise InputError(path, "header", "no columns of a position x, y, z", REMEDY)
    needed, point = [columns.places[name] for name in (*joints, *place, *turn)], columns.places.get("point")
    whole = [
        (line, row)
        for line, row in columns.rows
        if all(row[k].strip() for k in needed) and (point is None or row[point] in ("", "flange", "tool"))
    ]
    if len(whole) < len(columns.rows):
        notes.append(("blank_rows", str(len(columns.rows) - len(whole))))
        columns.rows = whole
    if not whole:
        raise InputError(path, None, "no row has both joint values and a position", REMEDY)
    q, q_digit = columns.numbers(joints)
    units, turning = np.array([columns.units[name] for name in joints]), ~robot.slides
    angle = next(filter(None, units[turning].tolist()), "")
    if not angle and turning.any():
        angle = "deg" if np.abs(q[:, turning]).max() > NEAR_TURN else "rad"
        notes.append(("joints_taken_in", angle))
    size = np.array([IN_SI[angle if turns else unit or "mm"] for turns, unit in zip(turning, units)])
    xyz, xyz_digit = columns.numbers(place)
    unit = lengths or columns.units[place[0]]
    if not unit:
        unit = "m" if np.abs(xyz).max() < LONGEST_M else "mm"
        notes.append(("positions_taken_in", unit))
    turns, named, turn_digit = _turns(columns, turn) if turn else ({}, 1, 0.0)
    read = np.array([line for line, _ in columns.rows])
    found = Pairs(
        q * size, xyz * IN_SI[unit], turns, named, q_digit * size, xyz_digit * IN_SI[unit], turn_digit, read,
        tuple(notes),
    )  # fmt: skip
    return _at_rest(path, found, columns, families)


def _joint_columns(columns: _Columns, families: Mapping[str, list[str]], count: int) -> list[str] | None:
    likely = {start: names for start, names in families.items() if len(names) == count}
    first: list[str] = [start for start in ("actual_q", "q", "j", "a", "joint", "axis") if start in likely]
    for start in first or [start for start in likely if not NO_POSITIONS.search(start)]:
        return likely[start]
    own = [
        next((name for name in columns.places if each in name and not NO_POSITIONS.search(name)), "")
        for each in UR_JOINTS
    ]
    return own if count == len(own) and all(own) else None


def _pose_columns(
    columns: _Columns, families: Mapping[str, list[str]], joints: Sequence[str]
) -> tuple[list[str] | None, list[str]]:
    """Columns of the position, and of the orientation: 3 angles, 4 of a quaternion (w first), or 9 of a matrix."""
    for names in (names for start, names in families.items() if OF_TOOL.search(start)):
        if len(names) == 16:
            return names[12:15], [names[k] for k in (0, 4, 8, 1, 5, 9, 2, 6, 10)]
        if len(names) in (6, 7):
            return names[:3], names[3:] if len(names) == 6 else [names[6], *names[3:6]]
    place = columns.together(("x", "y", "z"))
    own = [each for each in QUATERNIONS if (found := columns.together(each)) and found[1] != (place or [""])[0]]
    for each in (*MATRICES, *own, *ANGLES):
        turn = columns.together(each)
        if turn and not set(turn) & {*(place or ()), *joints}:
            return place, turn
    return place, []


def _turns(columns: _Columns, names: Sequence[str]) -> tuple[dict[str, Reals], int, Reals | float]:
    """Rotations by form, how many forms the names allow, and the last digits (N, 1) in rad."""
    values, digits = columns.numbers(names)
    digit = digits.max(axis=1, keepdims=True)
    if len(names) > 3:
        kind, factor = ("matrix", 1.5) if len(names) == 9 else ("quaternion_wxyz", 2.0)
        orders = {"matrix": range(9), "transposed": (0, 3, 6, 1, 4, 7, 2, 5, 8)}
        if len(names) == 4:
            orders = {"quaternion": range(4), "xyzw": (3, 0, 1, 2), "wxyz": (1, 2, 3, 0)}
        try:
            turns = {form: rotations(kind, values[:, list(order)], NEAR_ROTATION) for form, order in orders.items()}
        except NoRotationError as error:
            place = f"row {columns.rows[error.row][0]}"
            raise InputError(columns.path, place, error.problem, error.remedy) from None
        return turns, 1, factor * digit
    unit = columns.units[names[0]] or ("rad" if np.abs(values).max() < NEAR_TURN else "deg")
    allowed = ANGLES.get(tuple(re.sub(r".*_", "", name) for name in names), ("rotation_vector", "rpy", "abc", "zyz"))
    allowed = ("rotation_vector",) if names[0].startswith("actual_tcp") else allowed
    tried = (*allowed, *(form for form in OF_THREE if form not in allowed))
    return {form: of_angles(form, values * IN_SI[unit]) for form in tried}, len(allowed), digit * IN_SI[unit]


def _at_rest(path: Path, pairs: Pairs, columns: _Columns, families: Mapping[str, list[str]]) -> Pairs:
    """One row of each stop of a recording, and no pose twice."""
    count, notes = len(pairs), list(pairs.notes)
    rest = np.ones(count, dtype=bool)
    moved = np.abs(np.diff(pairs.q, axis=0)).max(axis=1, initial=0.0)
    same = np.r_[moved < STILL, False]  # as the next row
    rates = next(
        (names for start, names in families.items() if RATES.search(start) and len(names) == pairs.q.shape[1]), None
    )
    if rates is not None:
        rest = np.abs(np.array(columns.cells(rates), float)).max(axis=1) < REST
    elif count > RECORDING and np.unique(np.round(pairs.q[same], 3), axis=0).shape[0] >= 6:
        rest = same | np.r_[False, same[:-1]]
    kept = np.flatnonzero(rest & ~(same & np.r_[rest[1:], False]))
    _, first = np.unique(np.round(pairs.q[kept] / STILL), axis=0, return_index=True)
    kept = kept[np.sort(first)]
    kept = kept[spread(len(kept), MAX_ROWS)]
    if len(kept) < count:
        notes.append(("rows_at_rest" if not rest.all() else "rows_once", f"{len(kept)} of {count}"))
    if not len(kept):
        raise InputError(path, None, "the arm rests in no row", "Record it while it rests at several poses")
    return replace(pairs.some(kept), notes=tuple(notes))
