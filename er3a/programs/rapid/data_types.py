"""RAPID's structured data: their components, the predefined ones, and what poses, targets and frames mean.

Entries are named as in ABB's *Technical reference manual: RAPID Instructions, Functions and Data types*
(3HAC050917-001; 1 instructions, 2 functions, 3 data types): "3 robtarget" is the entry *robtarget* of its section 3.
That manual's text could not be had; what was read is ABB's older *RAPID Reference Manual* (published as *Basic
Characteristics RAPID*), by its pages: kinds of sums and products (5-26, section 7.1), priority between operators
(section 7.7), configuration (6-34, 7-confdata-1), robtarget and the axes that are not there (7-robtarget-1, -2),
wobjdata's frames, stop points, at which a program waits until the arm is at rest, and zones, at most half a motion
(7-zonedata-1), EulerZYX's range (9-EulerZYX-1). There cfx is not used yet: its bits are as two public post-processors
write them. Sizes of predefined zones are as public code cites them from 3HAC16581-1 revision J, section 3.78; those of
speeds as in the tests of another library. For all else, such as the order of the turns of RelTool and OrientZYX, or
what VelSet, AccSet and PDispOn do, no public text was found: it is common knowledge, not held against the manual.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.programs import evaluation
from er3a.programs.instructions import MeantSolution, numbers_of, pose_of
from er3a.programs.syntax import Record, Unclear, Value, finite, number, numbers
from er3a.robots.masses import MassBody, moved

AXES = "A B C D E F"
SHAPES: Mapping[str, Mapping[str, str]] = {
    "POS": dict.fromkeys("XYZ", "NUM"),  # 3 pos: mm
    "ORIENT": dict.fromkeys(("Q1", "Q2", "Q3", "Q4"), "NUM"),  # 3 orient: a quaternion, the scalar first
    "POSE": {"TRANS": "POS", "ROT": "ORIENT"},
    "CONFDATA": dict.fromkeys(("CF1", "CF4", "CF6", "CFX"), "NUM"),
    "EXTJOINT": {f"EAX_{letter}": "NUM" for letter in AXES.split()},
    "ROBJOINT": {f"RAX_{i}": "NUM" for i in range(1, 7)},
    "LOADDATA": {"MASS": "NUM", "COG": "POS", "AOM": "ORIENT", "IX": "NUM", "IY": "NUM", "IZ": "NUM"},
    "ROBTARGET": {"TRANS": "POS", "ROT": "ORIENT", "ROBCONF": "CONFDATA", "EXTAX": "EXTJOINT"},
    "JOINTTARGET": {"ROBAX": "ROBJOINT", "EXTAX": "EXTJOINT"},
    "TOOLDATA": {"ROBHOLD": "BOOL", "TFRAME": "POSE", "TLOAD": "LOADDATA"},
    "WOBJDATA": {"ROBHOLD": "BOOL", "UFPROG": "BOOL", "UFMEC": "STRING", "UFRAME": "POSE", "OFRAME": "POSE"},
    "SPEEDDATA": dict.fromkeys(("V_TCP", "V_ORI", "V_LEAX", "V_REAX"), "NUM"),
    "ZONEDATA": {
        "FINEP": "BOOL",
        **dict.fromkeys(("PZONE_TCP", "PZONE_ORI", "PZONE_EAX", "ZONE_ORI", "ZONE_LEAX", "ZONE_REAX"), "NUM"),
    },
}
"""Structured types: their components with the types of these. ``[]`` after a type makes an array of it."""

NO_AXIS = 9e9
"""Of an external axis that is not there, or stays."""
NULL_POSE = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0))
TOOL_SPEEDS = (
    *(5, 10, 20, 30, 40, 50, 60, 80, 100, 150, 200, 300, 400, 500, 600, 800),
    *(1000, 1500, 2000, 2500, 3000, 4000, 5000, 6000, 7000),
)
"""3 speeddata: v5 to v7000, mm/s; each with 500 deg/s, 5000 mm/s, 1000 deg/s."""
TURN_SPEED, SLIDE_SPEED, AXIS_SPEED = 500.0, 5000.0, 1000.0
FASTEST = "VMAX"
ZONES: Mapping[str, float] = {
    "Z0": 0.3,
    **{f"Z{size}": size for size in (1, 5, 10, 15, 20, 30, 40, 50, 60, 80, 100, 150, 200)},
}
"""3 zonedata: mm of the path."""


remembered = lru_cache(10_000)
"""Keeps what a function makes of a value: a program meets the same targets and tools again and again."""


def typed(value: Value, kind: str) -> Value:
    """A value as its declared type has it: aggregates get the names of their components.

    Parameters
    ----------
    value : nested lists, as the text has them
    kind : the type in capital letters, with ``[]`` for each dimension of an array

    Returns
    -------
    value : others than aggregates of the right length stay as they are
    """
    if isinstance(value, tuple) and kind.endswith("[]"):
        return tuple(typed(each, kind[:-2]) for each in value)
    shape = SHAPES.get(kind)
    values = value.values() if isinstance(value, Record) else value
    if shape is None or not isinstance(values, tuple) or len(values) != len(shape):
        return value
    if isinstance(value, Record) and value.kind != kind:
        return value
    return Record(kind, tuple((name, typed(each, part)) for (name, part), each in zip(shape.items(), values)))


def starting(kind: str) -> Value | None:
    """What a variable holds that is declared without a value (RAPID overview, 1 Data types).

    Parameters
    ----------
    kind : the type in capital letters

    Returns
    -------
    value : zeros, FALSE, an empty text, or a record of these; None if the type is not known
    """
    plain_values: dict[str, Value] = {"NUM": 0, "DNUM": 0, "BOOL": False, "STRING": ""}
    if kind not in SHAPES:
        return plain_values.get(kind)
    return typed(tuple(starting(part) or 0 for part in SHAPES[kind].values()), kind)


@remembered
def predefined(name: str) -> Value | None:
    """The value of a name that every controller has.

    Parameters
    ----------
    name : in capital letters, such as ``V100``, ``Z10``, ``FINE``, ``TOOL0`` or ``WOBJ0``

    Returns
    -------
    value : in mm, mm/s, deg and deg/s, as RAPID has it; None for other names. How fast ``VMAX`` is depends on the arm.

    References
    ----------
    Entries of ABB's manual as the head of this module cites them.
    """
    if name == "FINE":
        return typed((True, *(0.0,) * 6), "ZONEDATA")
    if name in ZONES:
        return typed((False, ZONES[name], *(Unclear(name),) * 5), "ZONEDATA")
    if name[:1] == "V" and name[1:].isdigit() and int(name[1:]) in TOOL_SPEEDS:
        return typed((float(name[1:]), TURN_SPEED, SLIDE_SPEED, AXIS_SPEED), "SPEEDDATA")
    if name == FASTEST:  # how fast that is depends on the arm
        return Record("SPEEDDATA", (("FASTEST", True),))
    load = (0.001, (0.0, 0.0, 0.001), (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    values: dict[str, tuple[Value, str]] = {
        "TOOL0": ((True, NULL_POSE, load), "TOOLDATA"),
        "WOBJ0": ((False, True, "", NULL_POSE, NULL_POSE), "WOBJDATA"),
        "LOAD0": (load, "LOADDATA"),
    }
    if name in values:
        return typed(*values[name])
    return {"PI": math.pi, "HIGH": 1, "LOW": 0}.get(name)


def part(value: Value | None, *path: str) -> Value | None:
    """A component of a record, however deep.

    Parameters
    ----------
    path : names of components, from the outermost on

    Returns
    -------
    value : None where a record on the way has no such component
    """
    for name in path:
        value = value.get(name) if isinstance(value, Record) else None
    return value


def plain(value: Value | None, count: int) -> tuple[float, ...] | None:
    """The numbers of a record or aggregate.

    Parameters
    ----------
    count : how many there must be

    Returns
    -------
    numbers : None if there are more or fewer, or one is no finite number
    """
    values = value.values() if isinstance(value, Record) else value
    if not isinstance(values, tuple) or len(values) != count:
        return None
    found = numbers(values)
    return found if found is not None and finite(found) else None


LENGTH_TOLERANCE = 0.01
"""How far a quaternion's length may be from 1: two digits round it by less. ABB's manual wants it normalised."""


def pose_matrix(value: Value | None) -> Reals | None:
    """The transform of a pose.

    Parameters
    ----------
    value : a position in mm, and a quaternion q1 .. q4, q1 the scalar

    Returns
    -------
    T : (4, 4), m; None unless all seven numbers are given, and the quaternion's length is 1 to ``LENGTH_TOLERANCE``
    """
    trans, rot = (part(value, "TRANS"), part(value, "ROT")) if isinstance(value, Record) else (None, None)
    if isinstance(value, tuple) and len(value) == 2:
        trans, rot = value
    xyz, quaternion = plain(trans, 3), plain(rot, 4)
    if xyz is None or quaternion is None or abs(math.hypot(*quaternion) - 1) > LENGTH_TOLERANCE:
        return None
    return pose_of((*xyz, *quaternion), "abb")


@remembered
def load_of(value: Value | None) -> MassBody | None:
    """Mass, centre and inertia of loaddata; None unless all its numbers are given.

    3 loaddata: kg, mm, moments of inertia in kg m^2 about the axes aom through the centre of mass. 3 tooldata: a
    tool's are those of the wrist's frame, which is the flange's.
    """
    mass, T = number(part(value, "MASS")), pose_matrix((part(value, "COG") or 0, part(value, "AOM") or 0))
    given = numbers(tuple(part(value, name) for name in ("IX", "IY", "IZ")))
    if mass is None or not mass > 0 or T is None or given is None:
        return None
    x, y, z = given
    return moved(MassBody(mass, inertia=(x, y, z, 0.0, 0.0, 0.0)), T)


def pose_record(T: Reals) -> Record:
    """A transform as a pose of RAPID; the inverse of :func:`pose_matrix`.

    Parameters
    ----------
    T : (4, 4), m

    Returns
    -------
    pose : TRANS in mm, ROT as a quaternion, its scalar first and at least 0
    """
    values = numbers_of(T, "abb")
    found = typed((values[:3], values[3:]), "POSE")
    assert isinstance(found, Record)
    return found


QUARTER = math.pi / 2
MIN_LOAD = 0.001
"""kg, of a tool whose mass is not known: tool0 and most templates have it (3 loaddata)."""
AT_A_QUARTER = 1e-3  # rad; nearer to a quarter's end an axis belongs to both: programs round their positions
CONFIGURED = (0, 3, 5)
"""Axes whose quarters confdata gives: 1, 4 and 6."""


def branch_of(conf: Value | None, joints: int) -> MeantSolution | None:
    """What confdata says of an arm's solution; None if its numbers are not given.

    3 confdata: cf1, cf4 and cf6 are the quarter turns in which axes 1, 4 and 6 are: 0 from 0 to 90 deg, 1 from 90 to
    180 deg, -1 from -90 to 0 deg. cfx is 0 to 7: 1 is added for a negative axis 5, 2 where the wrist centre is behind
    the lower arm, 4 where it is behind axis 1.
    """
    given = plain(conf, 4)
    if given is None or joints != 6:
        return None
    ranges = np.tile([-np.inf, np.inf], (joints, 1))
    for axis, quarter in zip(CONFIGURED, given):
        ranges[axis] = quarter * QUARTER - AT_A_QUARTER, (quarter + 1) * QUARTER + AT_A_QUARTER
    sides = round(given[3])
    if not 0 <= sides <= 7:
        return MeantSolution(ranges)
    ranges[4] = (-np.inf, AT_A_QUARTER) if sides & 1 else (-AT_A_QUARTER, np.inf)
    return MeantSolution(ranges, bool(sides & 4), bool(sides & 2))


def quarters_of(joints: Reals) -> tuple[int, ...]:
    """The quarters of a turn in which axes 1, 4 and 6 are, as confdata counts them.

    Parameters
    ----------
    joints : (6,), rad

    Returns
    -------
    cf1, cf4, cf6 : 0 from 0 to 90 deg, -1 from -90 to 0 deg, and so on; within 1e-9 rad of its end the next quarter
    """
    return tuple(math.floor((float(joints[axis]) + 1e-9) / QUARTER) for axis in CONFIGURED)


def external_axes(value: Value | None) -> tuple[tuple[str, float], ...]:
    """Axes that do not belong to the arm, which a target moves.

    Parameters
    ----------
    value : an extjoint; ``9E9`` is an axis that is not there

    Returns
    -------
    axes : pairs of name and value, mm or deg, of those that are there and not at 0; NaN where a value is not known
    """
    value = typed(value, "EXTJOINT") if value is not None else None
    if isinstance(value, Unclear):
        return (("extax", math.nan),)
    if not isinstance(value, Record):
        return ()
    given = evaluation.external_axes(value, [name for name, _ in value.items])
    return tuple((name.lower(), each) for name, each in given if not abs(each) >= NO_AXIS / 10)
