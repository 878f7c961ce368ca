"""What of a void is left if one entry of the table is another: what else than a limit may make it.

An offset that is off by a right angle, a direction turned round and a length with the other sign are the commonest
slips of a table. Each moves the reach of the arm as a whole, so it is not the void's own cells that are looked at but
all that the changed arm encloses. Which of the changes is right, a void can't tell: references do.
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
INNER = (1, 2, 3, 4)  # joints 2 to 5; turning joint 1 or 6 moves no section through the reach
SHAPING = {"a": (0, 1, 2), "d": (3, 5)}  # lengths of an arm with a spherical wrist that shape its section


@dataclass(frozen=True)
class SingleChange:
    """One entry changed.

    Attributes
    ----------
    entry : "offset2", "direction3", "a2", "d4", or "lower2", "upper2" for a limit
    given, tried : in ``unit``
    left_litres : bounds of the changed arm's enclosed voids together, as far as a coarse proof finds them
    """

    entry: str
    unit: Literal["deg", "mm", ""]
    given: float
    tried: float
    left_litres: tuple[float, float]


def single_changes(robot: Robot, cause: VoidCause, seed: int) -> tuple[SingleChange, ...]:
    """Single changes of a table of an arm with a spherical wrist, those that leave least first.

    Parameters
    ----------
    cause : what the limits say of the void; the limits that it names are among the changes
    """
    found = []
    for entry, unit, given, tried, changed in (*_of_table(robot), *_of_limits(robot, cause)):
        enclosed, _ = cavities(prove_robot(changed, CELLS, POINTS, seed).section)
        left = tuple(round(1000 * sum(getattr(void, bound) for void in enclosed), 3) for bound in ("lower", "upper"))
        found.append(SingleChange(entry, unit, given, tried, (left[0], left[1])))
    return tuple(sorted(found, key=lambda change: (change.left_litres[1], change.entry, change.tried)))


Candidate = tuple[str, Literal["deg", "mm", ""], float, float, Robot]


def _of_table(robot: Robot) -> Iterator[Candidate]:
    """Offsets, directions and lengths; without those that leave the reach as it is."""
    for j in INNER:
        if robot.upper[j] - robot.lower[j] < FULL_TURN:
            given = float(np.degrees(robot.offset[j]))
            for turn in TURNS_DEG:
                changed = robot.replace(offset=_with(robot.offset, j, np.radians(given + turn)))
                yield f"offset{j + 1}", "deg", round(given, 9), round(_half_turn(given + turn), 9), changed
        if abs(robot.lower[j] + robot.upper[j]) > 1e-9:
            changed = robot.replace(direction=_with(robot.direction, j, -robot.direction[j]))
            yield f"direction{j + 1}", "", float(robot.direction[j]), -float(robot.direction[j]), changed
    for column, rows in SHAPING.items():
        values = getattr(robot, column)
        for k in rows:
            if values[k]:
                mm = float(round(1000 * values[k], 6))
                yield f"{column}{k + 1}", "mm", mm, -mm, robot.replace(**{column: _with(values, k, -values[k])})


def _of_limits(robot: Robot, cause: VoidCause) -> Iterator[Candidate]:
    """The limits that a void's cause names, widened as it says; sums of joints are left out."""
    for limit in _named(cause):
        if limit.factors == (1.0,) and limit.unit == "deg":
            j = limit.joints[0] - 1
            changed = robot.replace(**{limit.side: _with(getattr(robot, limit.side), j, np.radians(limit.extended))})
            yield f"{limit.side}{j + 1}", "deg", round(limit.limit, 9), round(limit.extended, 9), changed


def _named(cause: VoidCause) -> Sequence[Relaxed]:
    if isinstance(cause, Disappears):
        return cause.limits
    if isinstance(cause, SeveralLimits | Geometry) and cause.most is not None:
        return (cause.most,)
    return ()


def _with(values: np.ndarray, place: int, value: float) -> np.ndarray:
    changed = values.copy()
    changed[place] = value
    return changed


def _half_turn(degrees: float) -> float:
    """An angle within (-180, 180]."""
    return 180.0 - (180.0 - degrees) % 360.0
