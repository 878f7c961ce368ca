"""What of a void is left if one entry of the table is another: what else than a limit may make it.

An offset that is off by a right angle, a direction turned round, and a length with the other sign or of half or twice
its value (a diameter for a radius) are the commonest slips of a table. Each moves the reach of the arm as a whole, so
it is not the void's own cells that are looked at but all that the changed arm encloses. Which of the changes is right,
a void can't tell: references do.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.robots.robot import Robot
from er3a.workspace.causes import Disappears, Geometry, Relaxed, SeveralLimits, VoidCause
from er3a.workspace.proven import cavities, prove_robot
from er3a.workspace.section_arm import FULL_TURN

CELLS, POINTS = 2000, 100  # of the proof of each changed arm, and of the estimate beside it, which is not looked at
TURNS_DEG = (-90.0, 90.0, 180.0)
FACTORS = (-1.0, 0.5, 2.0)
INNER = (1, 2, 3, 4)  # joints 2 to 5; turning joint 1 or 6 moves no section through the reach
# Lengths that shape the section of an arm with a spherical wrist, by their places.
SHAPING: dict[Literal["a", "d"], tuple[int, ...]] = {"a": (0, 1, 2), "d": (3, 5)}


Column = Literal["offset", "direction", "a", "d", "lower", "upper"]
Unit = Literal["deg", "mm", ""]
UNITS: dict[Column, Unit] = {"offset": "deg", "direction": "", "a": "mm", "d": "mm", "lower": "deg", "upper": "deg"}
IN_SI: dict[Unit, float] = {"deg": np.pi / 180, "mm": 1e-3, "": 1.0}


@dataclass(frozen=True)
class SingleChange:
    """One entry changed.

    Attributes
    ----------
    column : of the table; "lower" and "upper" are limits
    joint : 1 to 6
    given, tried : in ``unit``
    left_litres : bounds of the changed arm's enclosed voids together, as far as a coarse proof finds them
    """

    column: Column
    joint: int
    unit: Unit
    given: float
    tried: float
    left_litres: tuple[float, float]

    @property
    def entry(self) -> str:
        """Column and joint, as "offset2"."""
        return f"{self.column}{self.joint}"


def single_changes(robot: Robot, cause: VoidCause, seed: int) -> tuple[SingleChange, ...]:
    """Single changes of a table of an arm with a spherical wrist, those that leave least first.

    Parameters
    ----------
    cause : what the limits say of the void; the limits that it names are among the changes
    """
    found = []
    for column, joint, given, tried in (*_of_table(robot), *_of_limits(robot, cause)):
        enclosed, _ = cavities(prove_robot(with_entry(robot, column, joint, tried), CELLS, POINTS, seed).section)
        left = tuple(round(1000 * sum(getattr(void, bound) for void in enclosed), 3) for bound in ("lower", "upper"))
        found.append(SingleChange(column, joint, UNITS[column], given, tried, (left[0], left[1])))
    return tuple(sorted(found, key=lambda change: (change.left_litres[1], change.entry, change.tried)))


def with_entry(robot: Robot, column: Column, joint: int, value: float) -> Robot:
    """The robot with one entry changed; ``joint`` from 1, ``value`` in the column's unit."""
    values = getattr(robot, column).copy()
    values[joint - 1] = value * IN_SI[UNITS[column]]
    return robot.replace(**{column: values})


Candidate = tuple[Column, int, float, float]  # column, joint from 1, given and tried in the column's unit


def _of_table(robot: Robot) -> Iterator[Candidate]:
    """Offsets, directions and lengths; without those that leave the reach as it is."""
    for j in INNER:
        if robot.upper[j] - robot.lower[j] < FULL_TURN:
            given = float(np.degrees(robot.offset[j]))
            for turn in TURNS_DEG:
                yield "offset", j + 1, round(given, 9), round(_half_turn(given + turn), 9)
        if abs(robot.lower[j] + robot.upper[j]) > 1e-9:
            yield "direction", j + 1, float(robot.direction[j]), -float(robot.direction[j])
    for column, rows in SHAPING.items():
        for k in rows:
            mm = float(round(1000 * getattr(robot, column)[k], 6))
            for factor in FACTORS if mm else ():
                yield column, k + 1, mm, round(factor * mm, 6)


def _of_limits(robot: Robot, cause: VoidCause) -> Iterator[Candidate]:
    """The limits that a void's cause names, widened as it says; sums of joints are left out."""
    for limit in _named(cause):
        if limit.factors == (1.0,) and limit.unit == "deg":
            yield limit.side, limit.joints[0], round(limit.limit, 9), round(limit.extended, 9)


def _named(cause: VoidCause) -> Sequence[Relaxed]:
    if isinstance(cause, Disappears):
        return cause.limits
    if isinstance(cause, SeveralLimits | Geometry) and cause.most is not None:
        return (cause.most,)
    return ()


def _half_turn(degrees: float) -> float:
    """An angle within (-180, 180]."""
    return 180.0 - (180.0 - degrees) % 360.0
