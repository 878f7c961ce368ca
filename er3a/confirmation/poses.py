"""Reads joint values and poses of a controller: tables by their headings, and lines of a pendant.

Tables are CSV with any separator, decimal commas, and further columns. Lines are ABB's ``jointtarget`` and
``robtarget`` as ``TPWrite`` prints them, KRL's ``{A1 10.0, ...}`` and ``{X 500.0, ...}``, Fanuc's
``P[1]{ J1 = 10.0 deg, ...}``, and EFORT's ``POINTJ(...)`` and ``POINTC(...)``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from er3a.confirmation.pairs import Pairs
from er3a.errors import ArgumentError, InputError
from er3a.files.csv_file import LARGEST_DIGITS
from er3a.formats.mesh_file import read_text
from er3a.geometry.transforms import exp_rotation, rot_x, rot_y, rot_z
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot

MAX_BYTES, MAX_ROWS = 50_000_000, 10_000
MOST_TYPED = 6  # decimals; a program that writes more leaves out zeros at the end, if it does, of no weight
LARGEST = 1e9  # of a number, in any unit
REST = 1e-3  # rad/s or m/s, below which a joint rests
STILL, RECORDING = 1e-4, 200  # rad or m between two rows of a stop; rows of a recording
NEAR_TURN, LONGEST_M = 6.4, 20.0
"""Angles without a unit that are all below are rad; positions without one m."""
UNIT = re.compile(r"[\s_\[(./]+(deg|degrees?|°|rad|radians?|mm|m|cm|in|inch)\s*[\])]?$")
SIZES = {"mm": 1e-3, "m": 1.0, "cm": 1e-2, "in": 0.0254, "inch": 0.0254, "rad": 1.0, "radian": 1.0, "radians": 1.0}
LENGTHS = ("mm", "m", "cm", "in")
NUMBER = r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?"
TARGETS = re.compile(r"\[\s*\[([^\[\]]*)\]\s*,\s*\[([^\[\]]*)\]|\{([^{}]*)\}|\bE?POINT([JC])\s*\(([^()]*)")
"""Of ABB in brackets, of KRL and Fanuc in braces, of EFORT's RPL."""
OF_POSES: tuple[tuple[str, ...], ...] = (("a", "b", "c"), ("w", "p", "r"), ("qw", "qx", "qy", "qz"))
NO_POSITIONS = re.compile(
    r"vel|qd|dq|tau|torque|effort|curr|temp|volt|moment|force|target|cmd|command|des|tcp|pose|cart|ee|acc|limit|o_t|tool"
)
RATES = re.compile(r"(^|_)(actual_qd|qd|dq|vel\w*)$")
UR_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
ANGLES: dict[tuple[str, ...], tuple[str, ...]] = {
    ("a", "b", "c"): ("abc",),
    ("w", "p", "r"): ("rpy",),
    ("roll", "pitch", "yaw"): ("rpy",),
    ("o", "a", "t"): ("zyz",),
    ("z1", "y", "z2"): ("zyz",),
    ("rx", "ry", "rz"): ("rotation_vector", "rpy", "zyz", "xyz"),
    ("r", "p", "y"): ("rpy",),
}
QUATERNIONS = (("qw", "qx", "qy", "qz"), ("w", "x", "y", "z"), ("q1", "q2", "q3", "q4"), ("q_1", "q_2", "q_3", "q_4"))
MATRICES = (
    tuple(f"r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)),
    tuple(f"{axis}{row}" for row in "xyz" for axis in ("n", "o", "a")),
)
OF_THREE = ("abc", "rpy", "zyz", "xyz", "rotation_vector")
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
    content = read_text(path, MAX_BYTES) if text is None else text
    written = _lines_of_pendant(path, content, robot.joints)
    header, rows, lines = written or _table(path, content, robot.joints)
    pairs = _pairs(path, robot, header, rows, lines, units)
    if angles is None:
        return pairs
    if angles not in pairs.turns:
        raise ArgumentError("angles", angles, f"one of {', '.join(pairs.turns) or 'none, without orientations'}")
    turns = {angles: pairs.turns[angles], **pairs.turns}
    return replace(pairs, turns=turns, named=1)


def _lines_of_pendant(path: Path, text: str, joints: int) -> tuple[list[str], list[list[str]], list[int]] | None:
    """Joint values and poses out of targets in brackets or braces, in the order in which they come."""
    q: list[tuple[list[str], int]] = []
    poses: list[list[str]] = []
    header: list[str] = []
    line, seen = 1, 0
    for found in TARGETS.finditer(text):
        line, seen = line + text.count("\n", seen, found.start()), found.start()
        values = _values_of(found, joints)
        for names in [[f"{letter}{k + 1}" for k in range(joints)] for letter in "aj"]:
            if values.keys() >= set(names):
                q.append(([values[name] for name in names], line))
        if values.keys() >= {"x", "y", "z"}:
            turn = next((turn for turn in OF_POSES if values.keys() >= set(turn)), ())
            header = [*(f"j{k + 1}_deg" for k in range(joints)), "x_mm", "y_mm", "z_mm", *turn]
            poses.append([values[name] for name in ("x", "y", "z", *turn)])
    if not (q and poses):
        return None
    if len(q) != len(poses):
        problem = f"{len(q)} targets of joints and {len(poses)} of poses"
        raise InputError(path, None, problem, "Give one pose for each joint target, in the same order")
    return header, [[*a, *b] for (a, _), b in zip(q, poses)], [line for _, line in q]


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


def _table(path: Path, text: str, joints: int) -> tuple[list[str], list[list[str]], list[int]]:
    """Headings, fields and line numbers of a table; headings of er3a's own for one that has none."""
    lines = [(number, line.strip()) for number, line in enumerate(text.splitlines(), 1) if line.strip()]
    while len(lines) > 1 and lines[0][1][0] in "#!%" and lines[1][1][0] in "#!%":
        lines = lines[1:]
    if not lines:
        raise InputError(path, None, "the file is empty", REMEDY)
    head = lines[0][1].lstrip("#!% ")
    mark = next((each for each in (";", "\t", ",") if each in head), None)
    fields = [[field.strip().strip('"') for field in (line.split(mark) if mark else line.split())] for _, line in lines]
    if mark != ",":
        fields = [fields[0], *([re.sub(r"^([-+]?\d*),(\d+)$", r"\1.\2", field) for field in row] for row in fields[1:])]
    fields[0] = [name.lstrip("#!% ") for name in fields[0]]
    numbers = [number for number, _ in lines]
    if all(re.fullmatch(NUMBER, field) for field in fields[0]):
        more = {3: [], 6: ["rx", "ry", "rz"], 7: ["qx", "qy", "qz", "qw"]}.get(len(fields[0]) - joints)
        if more is None:
            raise InputError(path, f"line {numbers[0]}", "the table has no headings", REMEDY)
        fields.insert(0, [*(f"j{k + 1}" for k in range(joints)), "x", "y", "z", *more])
        numbers.insert(0, 0)
    header = fields[0]
    kept = [k for k in range(1, len(fields)) if fields[k][0][:1] not in ("#", "!", "%")]
    for k in kept:
        if len(fields[k]) != len(header):
            problem = f"{len(fields[k])} fields where the first line has {len(header)}"
            raise InputError(path, f"line {numbers[k]}", problem, "Correct the separators")
    return header, [fields[k] for k in kept], [numbers[k] for k in kept]


class _Columns:
    """Columns by names without their units, and their numbers."""

    def __init__(self, path: Path, header: Sequence[str], rows: Sequence[Sequence[str]], lines: Sequence[int]):
        self.path, self.rows, self.lines = path, rows, lines
        self.places: dict[str, int] = {}
        self.units: dict[str, str] = {}
        for place, heading in enumerate(header):
            unit = UNIT.search(" " + heading.strip().lower())
            bare = (" " + heading.strip().lower())[: unit.start()] if unit else heading.lower()
            name = re.sub(r"[\W]+", "_", bare.strip()).strip("_")
            self.places.setdefault(name, place)
            self.units.setdefault(name, unit[1] if unit else "")

    def values(self, names: Sequence[str]) -> Reals:
        """Numbers (N, k) of columns."""
        found = np.empty((len(self.rows), len(names)))
        for k, name in enumerate(names):
            for n, row in enumerate(self.rows):
                field = row[self.places[name]].replace("\u2212", "-").rstrip("°")
                if not re.fullmatch(rf"\s*{NUMBER}\s*", field):
                    where = f"line {self.lines[n]}, column {name}"
                    raise InputError(
                        self.path, where, f"'{field[:40]}' is not a number", "Correct it, or remove the row"
                    )
                found[n, k] = float(field)
                if abs(found[n, k]) > LARGEST:
                    where = f"line {self.lines[n]}, column {name}"
                    raise InputError(self.path, where, f"'{field[:40]}' is out of all measure", "Correct it")
        return found

    def digits(self, names: Sequence[str]) -> Reals:
        """The last digit (N, k) of each field of columns, none finer than half of them have.

        A zero more at the end of a field says nothing of the others, and little of its own. Of numbers that no person
        types all have the digits of the longest.
        """
        decimals = np.empty((len(self.rows), len(names)))
        for n, row in enumerate(self.rows):
            for k, name in enumerate(names):
                mantissa, _, exponent = row[self.places[name]].lower().partition("e")
                decimals[n, k] = len(mantissa.partition(".")[2]) - int(exponent or 0)
        usual = decimals.max() if decimals.max() > MOST_TYPED else np.floor(np.median(decimals))
        decimals = np.full_like(decimals, usual) if usual > MOST_TYPED else np.minimum(decimals, usual)
        return np.asarray(10.0 ** -np.clip(decimals, -LARGEST_DIGITS, LARGEST_DIGITS))

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


def _pairs(
    path: Path, robot: Robot, header: list[str], rows: list[list[str]], lines: list[int], lengths: str | None
) -> Pairs:
    columns = _Columns(path, header, rows, lines)
    families = columns.families()
    joints = _joint_columns(columns, families, robot.joints)
    if joints is None:
        seen = ", ".join(f"{start or '?'} ({len(names)})" for start, names in families.items())[:80] or "none"
        raise InputError(path, "header", f"no columns of {robot.joints} joints; numbered columns: {seen}", REMEDY)
    notes = []
    place, turn = _pose_columns(columns, {start: names for start, names in families.items() if names != joints}, joints)
    if place is None:
        raise InputError(path, "header", "no columns of a position x, y, z", REMEDY)
    point = columns.places.get("point")
    blank = {
        n for n, row in enumerate(rows)
        if not all(row[columns.places[name]] for name in (*joints, *place, *turn))
        or (point is not None and row[point] not in ("", "flange", "tool"))
    }  # fmt: skip
    if blank:
        notes.append(("blank_rows", str(len(blank))))
        kept = [n for n in range(len(rows)) if n not in blank]
        columns.rows, columns.lines = [rows[n] for n in kept], [lines[n] for n in kept]
    if not columns.rows:
        raise InputError(path, None, "no row has both joint values and a position", REMEDY)
    q, size = columns.values(joints), np.empty(robot.joints)
    units = [columns.units[name] for name in joints]
    turning = ~robot.slides
    angle = next((unit for unit, turns in zip(units, turning) if turns), "")
    if not angle and turning.any():
        angle = "deg" if np.abs(q[:, turning]).max() > NEAR_TURN else "rad"
        notes.append(("joints_taken_in", angle))
    size[turning] = SIZES.get(angle, np.pi / 180)
    size[~turning] = [SIZES.get(unit, 1e-3) for unit in np.array(units)[~turning].tolist()]
    xyz, unit = columns.values(place), lengths or columns.units[place[0]]
    if not unit:
        unit = "m" if np.abs(xyz).max() < LONGEST_M else "mm"
        notes.append(("positions_taken_in", unit))
    turns, named, turn_digit = _turns(path, columns, turn)
    found = Pairs(
        q * size, xyz * SIZES[unit], turns, named, columns.digits(joints) * size,
        columns.digits(place) * SIZES[unit], turn_digit, np.array(columns.lines), tuple(notes),
    )  # fmt: skip
    return _at_rest(path, found, columns, families)


def _joint_columns(columns: _Columns, families: Mapping[str, list[str]], count: int) -> list[str] | None:
    for known in ("actual_q", "q", "j", "a", "joint", "axis"):
        if len(families.get(known, ())) == count:
            return families[known]
    for start, names in families.items():
        if len(names) == count and not NO_POSITIONS.search(start):
            return names
    own = [
        next((name for name in columns.places if each in name and not NO_POSITIONS.search(name)), "")
        for each in UR_JOINTS
    ]
    return own if count == len(own) and all(own) else None


def _pose_columns(
    columns: _Columns, families: Mapping[str, list[str]], joints: Sequence[str]
) -> tuple[list[str] | None, list[str]]:
    """Columns of the position, and of the orientation: 3 angles, 4 of a quaternion (w first), or 9 of a matrix."""
    for start, names in families.items():
        if re.search(r"tcp|pose|cart|ee$|flange", start) and not re.search(
            r"vel|speed|target|force|offset|_c$|_d$", start
        ):
            if len(names) == 16:
                R = [names[k] for k in (0, 4, 8, 1, 5, 9, 2, 6, 10)]
                return names[12:15], R
            if len(names) in (6, 7):
                return names[:3], names[3:] if len(names) == 6 else [names[6], *names[3:6]]
    place = columns.together(("x", "y", "z"))
    own = [each for each in QUATERNIONS if (found := columns.together(each)) and found[1] != (place or [""])[0]]
    for each in (*MATRICES, *own, *ANGLES):
        turn = columns.together(each)
        if turn and not set(turn) & {*(place or ()), *joints}:
            return place, turn
    return place, []


def _turns(path: Path, columns: _Columns, names: Sequence[str]) -> tuple[dict[str, Reals], int, Reals | float]:
    """Rotations by form, how many forms the names allow, and the last digits (N, 1) in rad."""
    if not names:
        return {}, 1, 0.0
    values, digit = columns.values(names), columns.digits(names).max(axis=1, keepdims=True)
    if len(names) == 9:
        R = values.reshape(-1, 3, 3)
        return {"matrix": _nearest(path, columns, R), "transposed": _nearest(path, columns, R.mT)}, 1, 1.5 * digit
    if len(names) == 4:
        forms = {"quaternion": values, "xyzw": values[:, [3, 0, 1, 2]], "wxyz": values[:, [1, 2, 3, 0]]}
        return {form: _of_quaternions(path, columns, each) for form, each in forms.items()}, 1, 2 * digit
    unit = columns.units[names[0]]
    size = SIZES.get(unit, np.pi / 180) if unit else (1.0 if np.abs(values).max() < NEAR_TURN else np.pi / 180)
    stems = tuple(re.sub(r".*_", "", name) for name in names)
    allowed = ANGLES.get(stems, ("rotation_vector", "rpy", "abc", "zyz"))
    allowed = ("rotation_vector",) if names[0].startswith("actual_tcp") else allowed
    tried = (*allowed, *(form for form in OF_THREE if form not in allowed))
    return {form: of_angles(form, values * size) for form in tried}, len(allowed), digit * size


def of_angles(form: str, angles: Reals) -> Reals:
    """Rotations of three angles.

    Parameters
    ----------
    form : ``abc`` Rz(A) Ry(B) Rx(C), ``rpy`` Rz(3) Ry(2) Rx(1), ``zyz``, ``xyz`` Rx(1) Ry(2) Rz(3), or
        ``rotation_vector``
    angles : (N, 3), rad, in the order of the columns

    Returns
    -------
    R : (N, 3, 3)
    """
    if form == "rotation_vector":
        return exp_rotation(angles)
    axes = {
        "abc": (rot_z, rot_y, rot_x),
        "rpy": (rot_x, rot_y, rot_z),
        "zyz": (rot_z, rot_y, rot_z),
        "xyz": (rot_x, rot_y, rot_z),
    }
    first, second, third = (
        np.array([turn(angle)[:3, :3] for angle in column]) for turn, column in zip(axes[form], angles.T)
    )
    found: Reals = third @ second @ first if form == "rpy" else first @ second @ third
    return found


def _of_quaternions(path: Path, columns: _Columns, wxyz: Reals) -> Reals:
    length = np.linalg.norm(wxyz, axis=1)
    _refuse(path, columns, np.abs(length - 1) > 0.02, "the quaternion's length is not 1")
    w, v = wxyz[:, 0] / length, wxyz[:, 1:] / length[:, None]
    angle = 2 * np.arctan2(np.linalg.norm(v, axis=1), w)
    return exp_rotation(v / np.maximum(np.linalg.norm(v, axis=1), 1e-12)[:, None] * angle[:, None])


def _nearest(path: Path, columns: _Columns, R: Reals) -> Reals:
    off = np.abs(R @ R.mT - np.eye(3)).max(axis=(1, 2))
    _refuse(path, columns, (off > 0.02) | (np.linalg.det(R) < 0), "the matrix is not a rotation")
    U, _, Vt = np.linalg.svd(R)
    found: Reals = U @ Vt
    return found


def _refuse(path: Path, columns: _Columns, wrong: Reals, problem: str) -> None:
    if wrong.any():
        raise InputError(path, f"line {columns.lines[int(np.argmax(wrong))]}", problem, "Correct the row, or remove it")


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
        rest = np.abs(columns.values(rates)).max(axis=1) < REST
    elif count > RECORDING and np.unique(np.round(pairs.q[same], 3), axis=0).shape[0] >= 6:
        rest = same | np.r_[False, same[:-1]]
    kept = np.flatnonzero(rest & ~(same & np.r_[rest[1:], False]))
    _, first = np.unique(np.round(pairs.q[kept] / STILL), axis=0, return_index=True)
    kept = _spread(kept[np.sort(first)], MAX_ROWS)
    if len(kept) < count:
        notes.append(("rows_at_rest" if not rest.all() else "rows_once", f"{len(kept)} of {count}"))
    if not len(kept):
        raise InputError(path, None, "the arm rests in no row", "Record it while it rests at several poses")
    return replace(pairs.some(kept), notes=tuple(notes))


def _spread(rows: Integers, most: int) -> Integers:
    return rows if len(rows) <= most else rows[np.linspace(0, len(rows) - 1, most).astype(np.int64)]
