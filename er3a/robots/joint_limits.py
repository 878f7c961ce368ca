"""Joint limits and whole turns: a joint with a wide range reaches the same arm pose at several angles."""

from __future__ import annotations

from typing import Literal

import numpy as np

from er3a.errors import Er3aError
from er3a.finding import Amount, Finding, fact, turned_or_moved
from er3a.geometry.vectors import TURN, max_joint_move, wrap_to_pi
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import (
    LIMIT_TOLERANCE,
    nearest_rows,
    nearest_turns,
    rows_within,
    shortest_move,
    turned_alone,
    turns_alone,
    whole_turns,
)

SAME_DIGITS = 9  # of rad, m: joint values that are alike to these are one
MAX_ROWS = 10_000  # turns of one pose: more make no list that anyone reads, and fill memory
ROOMS = 64, 4096  # rows that turns of most poses fill, without a search in order


Exceeded = Finding


def speeds_given(robot: Robot) -> Flags:
    """Joints whose maximum speed is known from a source that is no guess.

    Parameters
    ----------
    robot : the speeds are those of ``speed``, their grade that of the source "speeds"

    Returns
    -------
    given : (n,) bool; all False if the speeds are graded "inferred"
    """
    found, source = np.isfinite(robot.speed), robot.sources.get("speeds")
    return found & (source is None or source.grade != "inferred")


def within(robot: Robot, q: Reals) -> Flags:
    """Whether joint values lie within all limits, of joints and of sums of joints.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    fits : (...) bool; ``LIMIT_TOLERANCE`` (1e-9 rad or m) beyond a limit still counts as inside

    Notes
    -----
    Continuous joints have no limits. NaN of a joint with limits is outside.
    """
    outside = np.maximum(q - robot.upper, robot.lower - q)
    if robot.continuous.any():
        outside = np.where(robot.continuous, -np.inf, outside)
    fits: Flags = np.asarray((outside <= LIMIT_TOLERANCE).all(axis=-1))
    for limit in robot.combined:
        total = q @ np.array(limit.factors)
        fits = fits & (total <= limit.upper + LIMIT_TOLERANCE) & (total >= limit.lower - LIMIT_TOLERANCE)
    return fits


def row_limits(robot: Robot) -> Reals:
    """Ranges of what the rows of the table move by, ``u = coupling @ q``, each row by itself.

    Parameters
    ----------
    robot : n joints, m rows

    Returns
    -------
    ends : (m, 2), rad (m of rows that slide), the lower end first

    Notes
    -----
    Interval arithmetic: exact for a single row. Not all combinations of rows within their ends can be reached.
    """
    ends = np.stack([robot.lower, robot.upper], axis=1)
    if robot.coupling is None:
        return ends
    parts = robot.coupling[:, :, None] * ends[None]
    return np.stack([parts.min(axis=2).sum(axis=1), parts.max(axis=2).sum(axis=1)], axis=1)


def theta_limits(robot: Robot) -> Reals:
    """Ranges of the D-H variables: theta of revolute rows, the shift along z of prismatic ones.

    Parameters
    ----------
    robot : n joints, m rows

    Returns
    -------
    ends : (m, 2), rad (m of rows that slide, without the constant d), the lower end first

    Notes
    -----
    With a coupling they are those of the sums of each row, each by itself (:func:`row_limits`).
    """
    ends = robot.direction[:, None] * row_limits(robot) + np.where(robot.sliding, 0.0, robot.offset)[:, None]
    ends.sort(axis=1)
    return ends


def comparable(robot: Robot, moves: Reals) -> Reals:
    """Moves of joints as one unit, so that joints of both types can be compared: a millimetre counts as a degree.

    Parameters
    ----------
    moves : (..., n), rad or m: moves of joints, or their distances from limits

    Returns
    -------
    moves : (..., n), rad; in degrees, the unit is the one of :func:`unit_compared`

    Notes
    -----
    Solutions are ranked, and margins from limits given, by this measure. The exchange rate is a convention.
    """
    return np.where(robot.slides, np.radians(1000.0) * moves, moves) if robot.sliding.any() else moves


def unit_compared(robot: Robot) -> str:
    """The unit of what :func:`comparable` returns, after conversion to degrees.

    Parameters
    ----------
    robot : only whether it has prismatic joints matters

    Returns
    -------
    unit : ``deg``, or ``deg (mm of a prismatic joint)``
    """
    return "deg (mm of a prismatic joint)" if robot.sliding.any() else "deg"


def limit_margin(robot: Robot, q: Reals) -> Reals:
    """Smallest distance of joint values from the limits, of joints and of sums of joints.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    margin : (...), rad as by :func:`comparable`; negative outside, infinite where nothing has limits
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
    """The same arm poses by the turns nearest to a reference within the limits, else by those nearest to the limits.

    Parameters
    ----------
    q : (..., n), rad or m
    q_ref : (..., n), rad or m, or a shape that broadcasts with q

    Returns
    -------
    equivalent : (..., n), q with whole turns added

    Notes
    -----
    Joints that no turn brings back, such as slides, stay where they are. Behind a gear or a ball screw turns are those
    of rows (:mod:`er3a.robots.whole_turns`), which can move several joints, slides among them.
    """
    turns, shape = whole_turns(robot), np.broadcast_shapes(q.shape, q_ref.shape)
    n = shape[-1]
    found, refs = (np.array(np.broadcast_to(each, shape)).reshape(-1, n) for each in (q, q_ref))
    if turns.each:
        nearest_turns(found, refs, (turns.lower[:n], turns.upper[:n], turns.alone), found)
    if robot.combined or not turns.each:
        # Each joint by itself may break the limit of a sum; these rows are searched with all limits together.
        left = ~(within(robot, found) & turns.each)
        found[left] = nearest_rows(robot, found[left], refs[left])[0]
    return found.reshape(shape)


def equivalents_within(robot: Robot, q: Reals, q_ref: Reals) -> tuple[Reals, Integers]:
    """The same arm poses by all turns that keep all limits, or, if there are none, by :func:`nearest_equivalent`.

    Parameters
    ----------
    q : (N, n), rad or m
    q_ref : (n,), rad or m; of continuous joints only turns near to it count

    Returns
    -------
    rows : (k, n), rad or m, those of one pose after the other, of each the nearest to the reference first
    of : (k,), which pose each is of; at least one of each

    Raises
    ------
    Er3aError
        if the limits allow more than ``MAX_ROWS``
    """
    for room in ROOMS if turns_alone(robot) else ():
        rows, of = np.empty((room, robot.joints)), np.empty(room, np.int64)
        if (count := turned_alone(np.ascontiguousarray(q), q_ref, (robot.lower, robot.upper), rows, of)) >= 0:
            return rows[:count], of[:count]
    rows, counts = rows_within(robot, q, q_ref, MAX_ROWS)
    if (counts > MAX_ROWS).any():
        raise Er3aError(f"{robot.name}: the limits allow more than {MAX_ROWS} turns of one pose; narrow them")
    of = np.repeat(np.arange(len(q)), counts)
    if len(beyond := np.flatnonzero(counts == 0)):
        rows = np.concatenate([rows, nearest_equivalent(robot, q[beyond], q_ref)])
        of = np.concatenate([of, beyond])
    order = np.lexsort((max_joint_move(rows, q_ref), of))
    return rows[order], of[order]


def unwound(robot: Robot, q: Reals) -> Reals:
    """Joint values with their whole turns taken off.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    q : (..., n), angles in (-pi, pi]; behind a gear the turns of rows are taken off instead
    """
    turns = whole_turns(robot)
    return np.where(turns.alone, wrap_to_pi(q), q) if turns.each else shortest_move(robot, q)


def but_for_turns(robot: Robot, q: Reals) -> Reals:
    """Joint values without whole turns, rounded, so that equal arm poses of a branch compare as equal.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    key : (..., n), rad or m, to ``SAME_DIGITS`` decimals
    """
    return np.asarray(np.round(unwound(robot, q), SAME_DIGITS))


def turn_bounds(robot: Robot, q: Reals) -> tuple[Reals, Reals]:
    """Smallest and largest number of whole turns that keep each joint within its own limits.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    low, high : (..., n), whole numbers to add; low > high where no turn fits

    Notes
    -----
    For a continuous joint both are 0. They are also 0 for a joint that a turn of its own would move elsewhere, such as
    a slide; if it is outside, high is -1. Limits of sums are not looked at.
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


def limits_exceeded(robot: Robot, q: Reals) -> Finding | None:
    """Which limits joint values leave, with the excess, for messages.

    Parameters
    ----------
    q : (n,), rad or m

    Returns
    -------
    finding : joints (from 1) and sums with value, excess and limit in deg or mm; None if all limits are kept
    """
    found: list[Exceeded] = []
    slides = robot.slides
    for j, value in enumerate(q):
        for side, excess, limit in _beyond(value, robot.lower[j], robot.upper[j]):
            if robot.continuous[j]:
                continue
            sizes = limit_amounts(bool(slides[j]), float(value), excess, limit)
            found.append(fact("limit_exceeded", joint=j + 1, side=side, **sizes))
    for combined in robot.combined:
        factors = np.array(combined.factors)
        joints = np.flatnonzero(factors)
        sliding = bool(slides[joints].all())
        # A sum is shown in mm only if all its joints slide; see CombinedLimit.
        for side, excess, limit in _beyond(float(factors @ q), combined.lower, combined.upper):
            own, shares = tuple((joints + 1).tolist()), tuple(factors[joints].tolist())
            sizes = limit_amounts(sliding, float(factors @ q), excess, limit)
            found.append(fact("combination_exceeded", joints=own, factors=shares, side=side, **sizes))
    return fact("limits_exceeded", joints=tuple(found)) if found else None


def limit_amounts(slides: bool, value: float, excess: float, limit: float) -> dict[str, Amount]:
    """What a finding of a limit says, with its unit.

    Parameters
    ----------
    slides : whether what is limited slides
    value, excess, limit : rad, or m if it does
    """
    scale = 1000.0 if slides else float(np.degrees(1.0))
    sizes = {"value": value, "excess": excess, "limit": limit}
    return {name: turned_or_moved(scale * float(size), slides) for name, size in sizes.items()}


def _beyond(value: float, lower: float, upper: float) -> list[tuple[Literal["above", "below"], float, float]]:
    """The sides on which a value is beyond its limits, by how much, and the limit."""
    sides: tuple[tuple[Literal["above", "below"], float, float], ...] = (
        ("above", value - upper, upper),
        ("below", lower - value, lower),
    )
    return [(side, excess, limit) for side, excess, limit in sides if excess > LIMIT_TOLERANCE]


def shown(robot: Robot, q: Reals) -> Reals:
    """Joint values, rates or their derivatives in the units of people.

    Parameters
    ----------
    q : (..., n), rad or m, and per s, s^2 ...

    Returns
    -------
    values : (..., n), deg, or mm of prismatic joints
    """
    return np.where(robot.slides, 1000.0 * q, np.degrees(q)) if robot.sliding.any() else np.degrees(q)


def joint_shown(robot: Robot, joint: int, value: float) -> tuple[float, bool]:
    """A value of one joint in the unit of people.

    Parameters
    ----------
    joint : number from 0
    value : rad or m

    Returns
    -------
    value, slides : deg, or mm if the joint is prismatic; whether it is
    """
    slides = bool(robot.slides[joint])
    return 1000.0 * value if slides else float(np.degrees(value)), slides


def meant(robot: Robot, values: Reals) -> Reals:
    """Joint values from the units of people: the inverse of :func:`shown`.

    Parameters
    ----------
    values : (..., n), deg, or mm of prismatic joints

    Returns
    -------
    q : (..., n), rad or m
    """
    values = np.asarray(values, float)
    q: Reals = (
        np.where(robot.slides, values / 1000.0, np.radians(values)) if robot.sliding.any() else np.radians(values)
    )
    return q


def joint_names(robot: Robot) -> tuple[str, ...]:
    """Names of the joints of q.

    Parameters
    ----------
    robot : only the number of its joints matters

    Returns
    -------
    names : ``J1`` to ``Jn``
    """
    return tuple(f"J{k + 1}" for k in range(robot.joints))


def joint_columns(robot: Robot) -> tuple[str, ...]:
    """Names of the joints as columns of a table, with the unit of :func:`shown`.

    Parameters
    ----------
    robot : number and type of its joints matter

    Returns
    -------
    names : such as ``q1_deg``, for prismatic joints ``q3_mm``
    """
    return tuple(f"q{k + 1}_{'mm' if slides else 'deg'}" for k, slides in enumerate(robot.slides))


def size_of(robot: Robot) -> float:
    """A length to scale drawings with: the sum of the sizes of all a and d.

    Parameters
    ----------
    robot : base, flange and tool don't count

    Returns
    -------
    length : m
    """
    return float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
