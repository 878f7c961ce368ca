"""Joint limits and whole turns: a joint with a wide range reaches the same arm pose at angles a full turn apart."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from er3a.geometry.angles import TURN, wrap_to_pi
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

SAME_DIGITS = 9  # of rad, m: joint values that are alike to these are one
LIMIT_TOLERANCE = 1e-9
WHOLE = 1e-12  # parts of a turn


@dataclass(frozen=True)
class LimitExceeded:
    """A joint stands above its upper or below its lower limit, by the excess."""

    joint: int
    side: Literal["above", "below"]
    angle_deg: float
    excess_deg: float
    limit_deg: float
    code: Literal["limit_exceeded"] = "limit_exceeded"


@dataclass(frozen=True)
class SlideExceeded:
    """A joint that slides is beyond its upper or below its lower limit, by the excess."""

    joint: int
    side: Literal["above", "below"]
    position_mm: float
    excess_mm: float
    limit_mm: float
    code: Literal["slide_exceeded"] = "slide_exceeded"


@dataclass(frozen=True)
class CombinationExceeded:
    """A sum of joints is above its upper or below its lower limit; values in deg (mm if all of them slide)."""

    joints: tuple[int, ...]
    factors: tuple[float, ...]
    side: Literal["above", "below"]
    value: float
    excess: float
    limit: float
    sliding: bool
    code: Literal["combination_exceeded"] = "combination_exceeded"


Exceeded = LimitExceeded | SlideExceeded | CombinationExceeded


@dataclass(frozen=True)
class LimitsExceeded:
    """One or more joints, or sums of joints, stand outside their limits."""

    joints: tuple[Exceeded, ...]
    code: Literal["limits_exceeded"] = "limits_exceeded"


def within(robot: Robot, q: Reals) -> Flags:
    """Whether joint values (..., n) in rad or m lie within all limits, to 1e-9 rad or m; shape (...,)."""
    outside = np.maximum(q - robot.upper, robot.lower - q)
    if robot.continuous.any():
        outside = np.where(robot.continuous, -np.inf, outside)
    fits: Flags = np.asarray((outside <= LIMIT_TOLERANCE).all(axis=-1))
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        fits = fits & (total <= limit.upper + LIMIT_TOLERANCE) & (total >= limit.lower - LIMIT_TOLERANCE)
    return fits


def theta_limits(robot: Robot) -> Reals:
    """Ends (m, 2), rad (m of rows that slide), of the range of each row's theta or shift, the lower first.

    With a coupling they are those of the sums of each row, each by itself.
    """
    ends = np.stack([robot.lower, robot.upper], axis=1)
    if robot.coupling is not None:
        parts = robot.coupling[:, :, None] * ends[None]
        ends = np.stack([parts.min(axis=2).sum(axis=1), parts.max(axis=2).sum(axis=1)], axis=1)
    ends = robot.direction[:, None] * ends + np.where(robot.sliding, 0.0, robot.offset)[:, None]
    ends.sort(axis=1)
    return ends


def limit_margin(robot: Robot, q: Reals) -> Reals:
    """Least distance (...,) of joints (..., n) from their limits, rad (m of joints that slide); negative outside.

    Infinite where all joints are continuous. Limits of sums of joints count too.
    """
    each = np.minimum(q - robot.lower, robot.upper - q)
    if robot.continuous.any():
        each = np.where(robot.continuous, np.inf, each)
    margin: Reals = each.min(axis=-1)
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        margin = np.minimum(margin, np.minimum(total - limit.lower, limit.upper - total))
    return margin


def nearest_equivalent(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """The same arm poses (..., n) by the turns nearest to q_ref within the limits, else by those nearest to them.

    Joints that no whole turn brings back (:func:`turned_alike`), such as slides, stay where they are.
    """
    near = q + turn_of(robot) * np.round((q_ref - q) / TURN)
    low, high = turn_bounds(robot, near)
    inside = near + TURN * np.clip(0, low, np.maximum(low, high))
    below, above = near + TURN * (low - 1), near + TURN * low
    outside = np.where(robot.lower - below < above - robot.upper, below, above)
    found, whole = np.where(low <= high, inside, outside), turned_alike(robot)
    found = found if whole.all() else np.where(whole, found, q)
    return _within_sums(robot, found, q_ref) if robot.combined else found


def _within_sums(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """The same arm poses (..., n), those that leave a limit of a sum in the turns nearest to q_ref that keep all of
    them, where there are such."""
    summed = np.any([limit.factors for limit in robot.combined], axis=0) & turned_alike(robot)
    spare = np.where(robot.continuous, 2, np.floor((robot.upper - robot.lower + 2 * LIMIT_TOLERANCE) / TURN))
    spare = np.where(summed, spare, 0).astype(int)
    left = ~within(robot, q) & np.isfinite(q).all(axis=-1)
    if not spare.any() or not left.any():
        return q
    rows, near = q[left], np.broadcast_to(q_ref, q.shape)[left]
    best, least = rows.copy(), np.full(len(rows), np.inf)
    for turns in product(*(range(-most, most + 1) for most in spare.tolist())):
        tried = rows + TURN * np.array(turns)
        away = np.where(within(robot, tried), np.abs(tried - near).max(axis=-1), np.inf)
        nearer = away < least
        best[nearer], least[nearer] = tried[nearer], away[nearer]
    found = q.copy()
    found[left] = best
    return found


def but_for_turns(robot: Robot, q: Reals) -> Reals:
    """Joint values (..., n) with their whole turns taken off, to ``SAME_DIGITS``."""
    wrapped: Reals = np.where(turned_alike(robot), wrap_to_pi(q), q)
    return np.round(wrapped, SAME_DIGITS)


@derived
def turned_alike(robot: Robot) -> Flags:
    """Which joints (n,) leave the arm as it was by a whole turn: not those that slide, nor those that move a row that
    slides, or a row that turns by a part of a turn."""
    if robot.coupling is None:
        return ~robot.sliding
    parts = np.where(robot.sliding[:, None], robot.coupling, robot.coupling - np.round(robot.coupling))
    return np.asarray(~robot.slides & (np.abs(parts) <= WHOLE).all(axis=0))


def turn_of(robot: Robot) -> Reals | float:
    """What may be added to each joint with the arm as it was: a turn or 0 (:func:`turned_alike`); (n,) or a number."""
    whole = turned_alike(robot)
    return TURN if whole.all() else np.where(whole, TURN, 0.0)


def turn_bounds(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Least and greatest number of turns to add so that each value lies within its limits (least > greatest: none).

    Of a continuous joint the turn it has is given; of one that a turn would move elsewhere (:func:`turned_alike`) 0, or
    none if it is outside.
    """
    low = np.ceil((robot.lower - LIMIT_TOLERANCE - q) / TURN)
    high = np.floor((robot.upper + LIMIT_TOLERANCE - q) / TURN)
    if robot.continuous.any():
        low, high = np.where(robot.continuous, 0.0, low), np.where(robot.continuous, 0.0, high)
    whole = turned_alike(robot)
    if not whole.all():
        fits = (q >= robot.lower - LIMIT_TOLERANCE) & (q <= robot.upper + LIMIT_TOLERANCE) | robot.continuous
        low, high = np.where(whole, low, 0.0), np.where(whole, high, np.where(fits, 0.0, -1.0))
    return low, high


def limits_exceeded(robot: Robot, q: Reals) -> LimitsExceeded | None:
    """Which limits the joint values (n,) in rad or m leave; None if none."""
    found: list[Exceeded] = []
    slides = robot.slides
    for j, value in enumerate(q):
        for side, excess, limit in _beyond(value, robot.lower[j], robot.upper[j]):
            if robot.continuous[j]:
                continue
            if slides[j]:
                found.append(SlideExceeded(j + 1, side, *(1000 * np.array([value, excess, limit])).tolist()))
            else:
                found.append(LimitExceeded(j + 1, side, *np.degrees([value, excess, limit]).tolist()))
    for combined in robot.combined:
        factors = np.array(combined.factors)
        joints = np.flatnonzero(factors)
        sliding = bool(slides[joints].all())
        scale = 1000.0 if sliding else float(np.degrees(1.0))
        for side, excess, limit in _beyond(float(factors @ q), combined.lower, combined.upper):
            numbers = (joints + 1).tolist(), factors[joints].tolist()
            shown = scale * float(factors @ q), scale * excess, scale * limit
            found.append(CombinationExceeded(tuple(numbers[0]), tuple(numbers[1]), side, *shown, sliding))
    return LimitsExceeded(tuple(found)) if found else None


def _beyond(value: float, lower: float, upper: float) -> list[tuple[Literal["above", "below"], float, float]]:
    """The sides on which a value is beyond its limits, by how much, and the limit."""
    sides: tuple[tuple[Literal["above", "below"], float, float], ...] = (
        ("above", value - upper, upper),
        ("below", lower - value, lower),
    )
    return [(side, excess, limit) for side, excess, limit in sides if excess > LIMIT_TOLERANCE]
