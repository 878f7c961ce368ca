"""Joint limits and whole turns: a joint with a wide range reaches the same arm pose at angles a full turn apart."""

from __future__ import annotations

from typing import Literal

import numpy as np

from er3a.by_value import Finding
from er3a.errors import Er3aError
from er3a.geometry.vectors import TURN, wrap_to_pi
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE, nearest_rows, rows_within, shortest_move, turns_in, whole_turns

SAME_DIGITS = 9  # of rad, m: joint values that are alike to these are one
MAX_ROWS = 10_000


class LimitExceeded(Finding):
    """A joint is above its upper or below its lower limit, by the excess."""

    joint: int
    side: Literal["above", "below"]
    angle_deg: float
    excess_deg: float
    limit_deg: float


class SlideExceeded(Finding):
    """A prismatic joint is beyond its upper or below its lower limit, by the excess."""

    joint: int
    side: Literal["above", "below"]
    position_mm: float
    excess_mm: float
    limit_mm: float


class CombinationExceeded(Finding):
    """A sum of joints is above its upper or below its lower limit; values in deg (mm if all of them slide)."""

    joints: tuple[int, ...]
    factors: tuple[float, ...]
    side: Literal["above", "below"]
    value: float
    excess: float
    limit: float
    sliding: bool


Exceeded = LimitExceeded | SlideExceeded | CombinationExceeded


class LimitsExceeded(Finding):
    """One or more joints, or sums of joints, are outside their limits."""

    joints: tuple[Exceeded, ...]


def speeds_given(robot: Robot) -> Flags:
    """Joints (n,) whose maximum speed the robot's file gives, by a source that is no guess."""
    found, source = np.isfinite(robot.speed), robot.sources.get("speeds")
    return found & (source is None or source.grade != "inferred")


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


def row_limits(robot: Robot) -> Reals:
    """Ends (m, 2), rad (m of rows that slide), of what each row moves by, each row by itself, the lower first."""
    ends = np.stack([robot.lower, robot.upper], axis=1)
    if robot.coupling is None:
        return ends
    parts = robot.coupling[:, :, None] * ends[None]
    return np.stack([parts.min(axis=2).sum(axis=1), parts.max(axis=2).sum(axis=1)], axis=1)


def theta_limits(robot: Robot) -> Reals:
    """Ends (m, 2), rad (m of rows that slide), of the range of each row's theta or shift, the lower first.

    With a coupling they are those of the sums of each row, each by itself.
    """
    ends = robot.direction[:, None] * row_limits(robot) + np.where(robot.sliding, 0.0, robot.offset)[:, None]
    ends.sort(axis=1)
    return ends


def comparable(robot: Robot, moves: Reals) -> Reals:
    """Moves of joints, or their distances from limits (..., n), rad or m, as rad: a millimetre of a prismatic joint
    counts as a degree.

    By this joints of both types are compared wherever solutions are ranked or margins are asked for; in degrees it has
    the unit :func:`unit_compared`.
    """
    return np.where(robot.slides, np.radians(1000.0) * moves, moves) if robot.sliding.any() else moves


def unit_compared(robot: Robot) -> str:
    """The unit of what :func:`comparable` returns, in degrees."""
    return "deg (mm of a prismatic joint)" if robot.sliding.any() else "deg"


def limit_margin(robot: Robot, q: Reals) -> Reals:
    """Smallest distance (...,) of joints (..., n) from their limits, rad as by :func:`comparable`; negative outside.

    Infinite where all joints are continuous. Limits of sums of joints count too.
    """
    each = comparable(robot, np.minimum(q - robot.lower, robot.upper - q))
    if robot.continuous.any():
        each = np.where(robot.continuous, np.inf, each)
    margin: Reals = each.min(axis=-1)
    for limit in robot.combined:
        total, slides = q @ np.array(limit.factors), bool(robot.slides[np.flatnonzero(limit.factors)].all())
        room = np.minimum(total - limit.lower, limit.upper - total)
        margin = np.minimum(margin, np.radians(1000.0) * room if slides else room)
    return margin


def nearest_equivalent(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """The same arm poses (..., n) by the turns nearest to q_ref within the limits, else by those nearest to them.

    Joints that no turn brings back, such as slides, stay where they are. Behind a gear or a ball screw turns are those
    of rows (:mod:`er3a.robots.whole_turns`), which can move several joints, slides among them.
    """
    turns = whole_turns(robot)
    if not turns.each:
        return _nearest_rows(robot, q, q_ref)
    whole, near = turns.alone, q + turns_in(robot, q_ref - q)
    low, high = turn_bounds(robot, near)
    inside = near + TURN * np.clip(0, low, np.maximum(low, high))
    below, above = near + TURN * (low - 1), near + TURN * low
    outside = np.where(robot.lower - below < above - robot.upper, below, above)
    found = np.where(low <= high, inside, outside)
    found = found if whole.all() else np.where(whole, found, q)
    if not robot.combined:
        return found
    left = ~within(robot, found)
    again = found.copy()
    again[left] = _nearest_rows(robot, found[left], np.broadcast_to(q_ref, found.shape)[left])
    return again


def _nearest_rows(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    shape = np.broadcast_shapes(q.shape, q_ref.shape)
    rows, refs = (np.ascontiguousarray(np.broadcast_to(each, shape).reshape(-1, shape[-1])) for each in (q, q_ref))
    return nearest_rows(robot, rows, refs)[0].reshape(shape)


def equivalents_within(robot: Robot, q: Reals, q_ref: Reals) -> Reals:
    """The same arm pose as joints (n,), in all turns (k, n) that keep all limits; if there are none, the one of
    :func:`nearest_equivalent`. Of continuous joints only turns near to q_ref (n,) count.

    Raises
    ------
    Er3aError
        if the limits allow more than ``MAX_ROWS``
    """
    rows = rows_within(robot, q, q_ref, MAX_ROWS)
    if len(rows) > MAX_ROWS:
        raise Er3aError(f"{robot.name}: the limits allow more than {MAX_ROWS} turns of one pose; narrow them")
    return rows if len(rows) else nearest_equivalent(robot, q, q_ref)[None]


def unwound(robot: Robot, q: Reals) -> Reals:
    """Joint values (..., n) with their whole turns taken off: angles in (-pi, pi], behind a gear those of rows."""
    turns = whole_turns(robot)
    return np.where(turns.alone, wrap_to_pi(q), q) if turns.each else shortest_move(robot, q)


def but_for_turns(robot: Robot, q: Reals) -> Reals:
    """Joint values (..., n) with their whole turns taken off, to ``SAME_DIGITS``."""
    return np.asarray(np.round(unwound(robot, q), SAME_DIGITS))


def turn_bounds(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Smallest and largest number of turns to add so that each value lies within its limits (smallest > largest: none).

    Of a continuous joint the turn it has is given; of one that a turn of its own would move elsewhere 0, or none if it
    is outside.
    """
    low = np.ceil((robot.lower - LIMIT_TOLERANCE - q) / TURN)
    high = np.floor((robot.upper + LIMIT_TOLERANCE - q) / TURN)
    if robot.continuous.any():
        low, high = np.where(robot.continuous, 0.0, low), np.where(robot.continuous, 0.0, high)
    whole = whole_turns(robot).alone
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


def shown(robot: Robot, q: Reals) -> Reals:
    """Joint values, rates or their derivatives (..., n) in rad or m, as degrees or mm."""
    values: Reals = np.where(robot.slides, 1000.0 * q, np.degrees(q)) if robot.sliding.any() else np.degrees(q)
    return values


def joint_shown(robot: Robot, joint: int, value: float) -> tuple[float, bool]:
    """A value of one joint (from 0) in rad or m, as degrees or mm, and whether it slides."""
    slides = bool(robot.slides[joint])
    return 1000.0 * value if slides else float(np.degrees(value)), slides


def meant(robot: Robot, values: Reals) -> Reals:
    """Values (..., n) in degrees or mm, as rad or m."""
    values = np.asarray(values, float)
    q: Reals = (
        np.where(robot.slides, values / 1000.0, np.radians(values)) if robot.sliding.any() else np.radians(values)
    )
    return q


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Names of the joints in q: ``J1 ... Jn``."""
    return tuple(f"J{k + 1}" for k in range(robot.joints))


def joint_columns(robot: Robot) -> tuple[str, ...]:
    """Names of the joints with the unit they are shown in: ``q1_deg``, of those that slide ``q3_mm``."""
    return tuple(f"q{k + 1}_{'mm' if slides else 'deg'}" for k, slides in enumerate(robot.slides))


def size_of(robot: Robot) -> float:
    """A length (m) to scale drawings with: the sum of all link lengths."""
    return float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
