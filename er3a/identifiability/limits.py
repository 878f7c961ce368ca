"""Limits and speeds: settled where a second, independent document gives the same."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from er3a.identifiability.entries import TableNumber, shifted
from er3a.identifiability.requirements import Asked, requirements_of
from er3a.kinematics.table_batch import tables_of
from er3a.references.quantities import Limit, PoseOutside, Speed
from er3a.references.reference import Reference
from er3a.robots.robot import Robot

LimitStatus = Literal["settled", "weak", "contradicted", "consistent", "open"]
ROUNDING = 1e-9
WIDEST = 720.0
FIRST_STEP, HALVINGS = 0.05, 12


def judge_limit(
    robot: Robot, entry: TableNumber, independent: Sequence[Reference], told: bool
) -> tuple[LimitStatus, tuple[float, float]]:
    """Status of a limit or speed, and what independent references leave open for it, in its unit.

    Parameters
    ----------
    independent : references that react to it and rest on other documents than it does
    told : whether any reference reacts to it
    """
    value = entry.value(robot)
    direct = [r for r in independent if isinstance(r.quantity, Limit | Speed)]
    if direct:
        spans = [(float(r.expected or 0.0) - r.uncertainty, float(r.expected or 0.0) + r.uncertainty) for r in direct]
        agree = [low - ROUNDING <= value <= high + ROUNDING for low, high in spans]
        hull = min(low for low, _ in spans), max(high for _, high in spans)
        status: LimitStatus = "settled" if all(agree) else "weak" if any(agree) else "contradicted"
        return status, hull
    low, high = value - WIDEST, value + WIDEST
    if not independent:
        return ("consistent" if told else "open"), (low, high)
    low, high = _past_poses(entry, independent, low, high)
    if entry.column != "speed":
        low, high = _by_extremes(robot, entry, independent, low, high)
    inside = low - ROUNDING <= value <= high + ROUNDING
    return ("weak" if inside else "contradicted"), (low, high)


def _past_poses(entry: TableNumber, independent: Sequence[Reference], low: float, high: float) -> tuple[float, float]:
    """A limit lies beyond every pose at which a document shows the arm."""
    for reference in independent:
        if isinstance(reference.quantity, PoseOutside):
            angle = reference.quantity.pose[entry.joint - 1]
            if entry.column == "upper":
                low = max(low, angle - reference.uncertainty)
            else:
                high = min(high, angle + reference.uncertainty)
    return low, high


def _by_extremes(
    robot: Robot, entry: TableNumber, independent: Sequence[Reference], low: float, high: float
) -> tuple[float, float]:
    """How far a limit may go before reach or extents are missed, the rest of the table as it is."""
    asked = Asked(robot, requirements_of(independent))
    if not asked.extreme:
        return low, high
    value = entry.value(robot)
    table = tables_of(robot)

    def met(amount: float) -> bool:
        changed = shifted(table, [entry], np.array([[amount / entry.in_unit]]))
        return bool(asked.violation(asked.off(changed, afresh=True)).max() <= ROUNDING)

    if not met(0.0):
        return low, high
    return value + max(-_reach(lambda x: met(-x), value - low), low - value), value + _reach(met, high - value)


def _reach(met: Callable[[float], bool], most: float) -> float:
    """How far one can go before requirements are missed, by doubling and halving steps."""
    inside, step = 0.0, FIRST_STEP
    while step < most and met(step):
        inside, step = step, 2 * step
    if step >= most:
        return most
    outside = step
    for _ in range(HALVINGS):
        middle = (inside + outside) / 2
        inside, outside = (middle, outside) if met(middle) else (inside, middle)
    return inside
