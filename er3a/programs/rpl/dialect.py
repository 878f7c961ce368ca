"""What RPL's motions, points and functions mean: mm and degrees; a, b, c turn about z, y, x in this order."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np

from er3a.programs import instructions
from er3a.programs.evaluation import (
    IN_DEGREES,
    Dialect,
    ProgramMemory,
    evaluated,
    external_axes,
    target_numbers,
    unresolved,
)
from er3a.programs.instructions import ArmMotion, NamedFrame, Rate, UnresolvedTarget, Zone
from er3a.programs.rpl.reader import CONFIGURATION, FIELDS, JOINTS, LIBRARY_NAMES, OUTER, POSITION
from er3a.programs.syntax import Expression, Invocation, Move, Record, Unclear, Value, number, shown

SPEED = re.compile(r"v(\d+(?:\.\d+)?)(perc)?$", re.IGNORECASE)
ZONE = re.compile(r"z(\d+(?:\.\d+)?)$", re.IGNORECASE)
NO_BASE = "wobj0"
ROOTS: dict[str, Callable[[float], float]] = {"ABS": abs, "SQRT": math.sqrt}
SOCKETS = frozenset(f"tcpip.sock{what}" for what in ("open", "send", "recv", "close"))


class RplDialect(Dialect):
    """RPL, as a run needs it."""

    whole_division = None
    signals = ("io.", "fidbus.")
    harmless = SOCKETS | {*FIELDS, "OFFSET", *IN_DEGREES, *map(str.lower, IN_DEGREES)}

    def function(self, memory: ProgramMemory, name: str, given: Invocation) -> Value:
        """The value of a function of RPL: points, OFFSET, roots and absolute values.

        Returns
        -------
        value : in mm and deg; unclear for others. No source says in which unit the angles of trigonometric functions
            are.
        """
        values = [None if each is None else memory.value(each) for each in given.arguments]
        if name in FIELDS:
            return _point(name, values)
        if name == "OFFSET" and values and isinstance(values[0], Record):
            return _offset(values[0], values[1:])
        found = evaluated(ROOTS[name.upper()], values) if name.upper() in ROOTS and len(values) == 1 else None
        unclear = f"{name}({', '.join('' if each is None else shown(each) for each in values)})"
        return Unclear(unclear) if found is None else found

    def motion(self, memory: ProgramMemory, move: Move) -> ArmMotion:
        """The motion of MJOINT and MLIN: target, speed, zone, tool, reference frame.

        Returns
        -------
        motion : tool and frame by their names, with a pose where the cell gives one; without a frame it is the robot's
            base
        """
        given = [*move.arguments, *[None] * (5 - len(move.arguments))]
        point = Unclear(move.text) if given[0] is None else memory.value(given[0])
        goal = _target(point, move.text) if len(given) == 5 else UnresolvedTarget(move.text, "not_understood")
        tool, base = (_word(memory, each) for each in given[3:5])
        frames = memory.cell.frames
        base_pose = frames.get(base or NO_BASE)
        if base_pose is None and base in ("", NO_BASE):
            base_pose = np.eye(4)
        return ArmMotion(
            "joint" if move.form == "MJOINT" else "line",
            goal,
            move.form,
            speed=_speed(_word(memory, given[1])),
            zone=_zone(_word(memory, given[2])),
            tool=NamedFrame(tool or "no tool", frames.get(tool)),
            base=NamedFrame(base or NO_BASE, base_pose),
        )

    def is_followed(self, name: str) -> bool:
        """Whether motions are followed as a variable asks.

        Returns
        -------
        followed : False for variables of the controller (``sys.`` ...), which may set anything, such as the override
        """
        return name.partition(".")[0] not in LIBRARY_NAMES


def _word(memory: ProgramMemory, expression: Expression | None) -> str:
    """The name of a speed, zone or tool, also where a variable of the program holds it."""
    return "" if expression is None else shown(memory.value(expression))


def _speed(word: str) -> Rate | None:
    match = SPEED.match(word)
    if match is None:
        return Rate(0.0, "m/s", word) if word else None
    value = float(match[1])
    return Rate(value / 100, "share", word) if match[2] else Rate(value / 1000, "m/s", word)


def _zone(word: str) -> Zone:
    match = ZONE.match(word)
    if match is not None:
        return Zone("distance", float(match[1]) / 1000, word)
    return instructions.FINE if word == "fine" else Zone("named", 0.0, word or "not given")


def _point(name: str, values: list[Value | None]) -> Value:
    """A point of its parts; an unclear one makes it unclear only when it is gone to."""
    fields = FIELDS[name]
    if not 6 <= len(values) <= len(fields) and not any(each is None or isinstance(each, Unclear) for each in values):
        return Record(name, ())  # which is no point
    if not 6 <= len(values) <= len(fields) or None in values:
        return Unclear(f"{name}({', '.join('' if each is None else shown(each) for each in values)})")
    given = [each for each in values if each is not None]
    if name == "EPOINTC" and len(given) == 10 and isinstance(given[6], str):
        fields = FIELDS["POINTC"]
    return Record(name, tuple(zip(fields, given)))


def _offset(point: Record, by: list[Value | None]) -> Value:
    if len(by) > 3:
        return Unclear(f"OFFSET({shown(point)}, ...)")
    for key, step in zip(POSITION, by):
        old = point.get(key)
        for part in (old, step):
            if isinstance(part, Unclear):
                return part
        a, b = number(old), number(step)
        if a is None or b is None:
            return Unclear(f"OFFSET({shown(point)})")
        point = point.having(key, a + b)
    return point


def _target(value: Value, text: str) -> instructions.Target:
    if isinstance(value, Unclear):
        return unresolved(value)
    if not isinstance(value, Record) or not {key for key, _ in value.items} <= set(FIELDS.get(value.kind, ())):
        return UnresolvedTarget(text, "not_understood")
    keys = JOINTS if value.kind in ("POINTJ", "EPOINTJ") else POSITION
    plain = target_numbers([value.get(key) for key in keys], text)
    if isinstance(plain, UnresolvedTarget):
        return plain
    outer = external_axes(value, OUTER)
    if keys is JOINTS:
        return instructions.JointTarget(np.radians(plain), outer)
    given = ((key, value.get(key)) for key in CONFIGURATION)
    configuration = tuple((key, part) for key, part in given if isinstance(part, (int, float, str)))
    return instructions.PoseTarget(instructions.pose_of(plain, "efort"), configuration, external=outer)
