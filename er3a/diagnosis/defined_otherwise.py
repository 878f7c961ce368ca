"""Whether a table describes the references' arm, with zeros, directions, base or flange defined differently.

If references state the line of every joint axis, these lines describe an arm, and the table is matched with it
(:mod:`er3a.comparison.mechanism`): geometry first. Zeros, directions, base and flange, any number of them at once, are
taken from the match and fitted to all references about the arm's shape and place. If all of these are met, the table
describes the same arm. If up to ``MAX_WRONG`` entries of the geometry are wrong as well, it is a faulty table of that
arm.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.comparison.axis_table import table_from_axes
from er3a.comparison.compare import rows_at_ends
from er3a.comparison.entries import Entry, shifted
from er3a.comparison.mechanism import (
    EntryDifference,
    Match,
    Tolerances,
    is_identity,
    match,
    mechanism_of,
    turn_of,
)
from er3a.diagnosis.faults import Fault, Faults, limit_repairs, rounded, wrong_number
from er3a.diagnosis.fitting import MEETS, lowered
from er3a.finding import fact
from er3a.geometry.transforms import exp_rotation, posed
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.table_batch import robot_of, tables_of
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.references.predict import joints_of, predict_tables
from er3a.references.quantities import (
    COORDINATES,
    MM,
    ZERO_POSE,
    AxisAngle,
    AxisCoordinate,
    FlangeTurn,
    PointCoordinate,
)
from er3a.references.reference import Reference, expected_of, quantities_of
from er3a.robots.robot import Robot

Misfit = Callable[[Robot], Reals]
Lines = tuple[Reals, Reals, list[bool], Tolerances]
"""Directions and points (n, 3), m, of all axes, which of these directions are of positive rotation, and how exactly."""

MAX_WRONG = 3
LINKS = "a", "d", "alpha"
SLIGHT_LENGTH, SLIGHT_ANGLE = 1e-3, math.radians(0.2)
FINER = (1.0, 0.3, 0.1)
MIN_LENGTH, MIN_ANGLE = 1e-5, math.radians(1e-3)
LEVER = 0.3  # m, over which an axis' direction says where it is
SPREAD = 3.0  # times its uncertainty, that what is derived from two lines may be off
ROUNDS = 8
AS_GOOD = 1.05  # times the misfit: a simpler arm that misses by no more is taken
ROUND_DEG, ROUND_MM = 1e-6, 1e-6
PARALLEL = 1 - 1e-6
SIGNS: tuple[Literal[1, -1], ...] = (-1, 1)


@by_identity
class Conventions:
    """A table's geometry is the references', but for few entries; ``faults`` is what is wrong or defined otherwise,
    ``corrected`` the table with it as they have it."""

    faults: Faults
    corrected: Robot


def conventions_of(robot: Robot, references: Sequence[Reference]) -> list[Conventions]:
    """How references define zeros, directions, base and flange of a table otherwise.

    Parameters
    ----------
    references : that all state a value; limits don't count here, but are set right besides

    Returns
    -------
    conventions : one; none if that is not the reason why references are missed, or if they don't state all joint axes
    """
    if robot.coupling is not None or robot.rows != robot.joints or robot.sliding.any():
        return []
    stated = [r for r in references if r.quantity.depends_on_table]
    lines = _lines(stated, robot.joints)
    found = (_conventions(robot, stated, lines, finer) for finer in FINER) if lines else ()
    chosen = [_with_limits(robot, each, references) for each in itertools.islice(filter(None, found), 1)]
    return [each for each in chosen if each.faults]


def counted_from_ground(
    robot: Robot, references: Sequence[Reference], limits_besides: bool = False
) -> list[Conventions]:
    """Which joint references count from the ground (J3 - J2), so that all of them are met, in each way that does it.

    Its limits may be stated either way: of the table's joint, or of the one counted so.

    Parameters
    ----------
    references : as of :func:`conventions_of`
    limits_besides : where positions show it, limits that are other ones, as those of a linkage often are, are set right

    Returns
    -------
    conventions : one for each way; empty for arms with coupled or sliding joints
    """
    if robot.coupling is not None or robot.sliding.any():
        return []
    if limits_besides and not any(r.quantity.depends_on_table for r in references):
        return []
    axes, found = frames(robot, np.zeros(robot.joints))[:-1, :3, 2], dict[Fault, Conventions]()
    off = _misfit_of(references)
    for joint in range(1, robot.joints):
        parallel = [k for k in range(joint) if abs(axes[k] @ axes[joint]) > PARALLEL]
        for along in dict.fromkeys((*((k,) for k in reversed(parallel)), tuple(parallel))):
            for sign, ends in itertools.product(SIGNS if along else (), (False, True)):
                fault = fact("counted_from_ground", joint=joint + 1, along=tuple(k + 1 for k in along), sign=sign)
                own = Conventions((fault,), _from_ground(robot, joint, along, sign, ends))
                own = _with_limits(robot, own, references) if limits_besides and not ends else own
                if np.abs(off(own.corrected)).max() <= MEETS:
                    found.setdefault(fault, own)
    return list(found.values())


def _misfit_of(references: Sequence[Reference]) -> Misfit:
    """How far (n,) an arm is off references, in half-widths."""
    quantities, (expected, uncertainty) = quantities_of(references), expected_of(references)
    return lambda arm: (predict_tables(tables_of(arm), arm, quantities)[0] - expected) / uncertainty


def _from_ground(robot: Robot, joint: int, along: tuple[int, ...], sign: Literal[1, -1], ends: bool) -> Robot:
    """The robot with a joint that is counted from the ground; ``ends``: its limits are those of what is counted."""
    coupling, lower, upper = np.eye(robot.joints), robot.lower.copy(), robot.upper.copy()
    coupling[joint, list(along)] = sign
    if ends:
        least, most = robot.lower[list(along)].sum(), robot.upper[list(along)].sum()
        lower[joint] -= sign * (most if sign > 0 else least)
        upper[joint] -= sign * (least if sign > 0 else most)
    return robot.replace(coupling=coupling, lower=lower, upper=upper)


def described_by(robot: Robot, references: Sequence[Reference]) -> list[Robot]:
    """The table corrected by comparison with the arm whose axes references state, however much of it is wrong.

    Parameters
    ----------
    references : that all state a value

    Returns
    -------
    robots : one, with base and flange as they are as far as rows can hold what differs; none if axes are not all stated
    """
    lines = _lines(references, robot.joints) if robot.rows == robot.joints else None
    if lines is None:
        return []
    found, start, _ = _matched(robot, references, lines, lines[-1])
    table = tables_of(start)
    for column, row, value in itertools.chain(*rows_at_ends(robot, found, lines[-1])):
        table = table.with_column(column, [row], np.array([[value]]))
    return [robot_of(table, 0, start)]


def _matched(
    robot: Robot, stated: Sequence[Reference], lines: Lines, tolerances: Tolerances
) -> tuple[Match, Robot, list[Entry]]:
    """The match with the arm that lines describe, the table with it, and the entries that differ."""
    other = _arm_of(lines, _zero_flange(stated))
    found = match(mechanism_of(robot.without_tool()), mechanism_of(other), tolerances)
    later = int(robot.convention == "modified")  # rows of a and alpha are those of the next joint
    own = [each for each in found.differences if each.column in LINKS]
    wrong = [Entry(each.column, each.link + later * (each.column != "d") + 1) for each in own]
    moved = robot.replace(
        offset=robot.offset + found.zeros,
        direction=np.where(found.reverses, -1.0, 1.0) * robot.direction,
        base=np.linalg.inv(found.base) @ robot.base,
    )
    table = shifted(tables_of(moved), wrong, np.array([[each.other - each.one for each in own]]))
    return found, robot_of(table, 0, moved), wrong


def _conventions(robot: Robot, stated: Sequence[Reference], lines: Lines, finer: float) -> Conventions | None:
    """What :func:`conventions_of` finds where entries differ that are off by more than the lines' tolerances, or by a
    finer part of them."""
    _, _, signed, widest = lines
    tolerances = Tolerances(finer * widest.length, finer * widest.angle)
    found, start, wrong = _matched(robot, stated, lines, tolerances)
    if any(each.column not in LINKS for each in found.differences):
        return None
    if found.unexplained or sum(_gross(each) for each in found.differences) > MAX_WRONG:
        return None
    flips = itertools.product(*([1.0] if sure else [1.0, -1.0] for sure in signed))
    starts = [start.replace(direction=start.direction * np.array(flip)) for flip in flips]
    return _fitted_to(robot, starts, wrong, stated, tolerances)


def _fitted_to(
    robot: Robot,
    starts: Sequence[Robot],
    wrong: Sequence[Entry],
    stated: Sequence[Reference],
    tolerances: Tolerances,
) -> Conventions | None:
    """The start that comes nearest to what is stated, of nearly equal ones that with the fewest directions reversed,
    fitted; None if something is missed then."""
    off, tried = _misfit_of(stated), []
    for start in starts:
        arm = _with_flange(start, stated)
        reversed_count = int((arm.direction != robot.direction).sum())
        tried.append((round(float(np.abs(off(arm)).max()), 3), reversed_count, arm))
    least = min(worst for worst, _, _ in tried)
    best = min((each for each in tried if each[0] <= least + 0.5), key=lambda each: each[1])[2]
    best = _fitted(best, [*(Entry("offset", joint) for joint in range(2, robot.joints)), *wrong], off)
    best = _plain(robot, best, off, tolerances)
    if np.abs(off(best)).max() > MEETS:
        return None
    faults = (
        *(rounded(wrong_number(each, *(float(each.of(tables_of(arm))[0]) for arm in (robot, best)))) for each in wrong),
        *_differences(robot, best, tolerances),
    )
    return Conventions(faults, best)


def _with_limits(given: Robot, found: Conventions, references: Sequence[Reference]) -> Conventions:
    """What was found, with limits as they are stated, or as wide as poses that are shown; those that the robot's file
    gives otherwise are faults."""
    table = tables_of(found.corrected)
    repairs = limit_repairs(table, references)
    for repair in repairs:
        table = repair.apply(table)
    faults = [repair.fault for repair in repairs] if given.states("limits") else []
    return Conventions((*found.faults, *faults), robot_of(table, 0, found.corrected))


def _gross(found: EntryDifference) -> bool:
    """Whether an entry is off by more than a table's rounding or another edition of an arm's drawing."""
    return abs(found.one - found.other) > (SLIGHT_ANGLE if found.column == "alpha" else SLIGHT_LENGTH)


def _lines(stated: Sequence[Reference], joints: int) -> Lines | None:
    """Directions, points (n, 3), m, of all joint axes, which directions are of positive rotation, and how exactly."""
    toward = dict[int, AxisAngle]()
    points = dict[int, tuple[float, float, float]]()
    length, angle = MIN_LENGTH, MIN_ANGLE
    for reference in stated:
        quantity, uncertainty = reference.quantity, float(expected_of([reference])[1][0])
        if isinstance(quantity, AxisAngle) and (quantity.joint not in toward or quantity.signed):
            toward[quantity.joint] = quantity
            angle = max(angle, SPREAD * math.radians(uncertainty))
        elif isinstance(quantity, AxisCoordinate):
            points.setdefault(quantity.joint, quantity.point_mm)
            length = max(length, SPREAD * uncertainty / MM)
    every = range(1, joints + 1)
    if not all(joint in toward and joint in points for joint in every):
        return None
    directions = np.array([toward[joint].toward for joint in every], float)
    places = np.array([points[joint] for joint in every], float) / MM
    return directions, places, [toward[joint].signed for joint in every], Tolerances(length + LEVER * angle, angle)


def _arm_of(lines: Lines, flange: Reals) -> Robot:
    """The arm that turns about lines, all joints at 0 where they are given; neighbours that are parallel to within
    their tolerance are taken for parallel."""
    directions, points, _, tolerances = lines
    z = directions / np.linalg.norm(directions, axis=1)[:, None]
    for k in range(1, len(z)):
        if np.linalg.norm(np.cross(z[k - 1], z[k])) < math.sin(tolerances.angle):
            z[k] = z[k - 1] * np.sign(z[k] @ z[k - 1])
    table, turn = table_from_axes(z, points, flange), np.full(len(z), math.pi)
    return Robot("stated", "stated", "standard", lower=-turn, upper=turn, **vars(table))


def _zero_flange(stated: Sequence[Reference]) -> Reals:
    """The flange (4, 4), m, with all joints at 0, as far as it is stated."""
    T = np.eye(4)
    for reference in stated:
        quantity = reference.quantity
        if isinstance(quantity, PointCoordinate) and quantity.point == "flange" and quantity.pose == ZERO_POSE:
            T[COORDINATES.index(quantity.coordinate), 3] = float(expected_of([reference])[0][0]) / MM
        elif isinstance(quantity, FlangeTurn) and quantity.pose == ZERO_POSE:
            T[:3, :3] = quantity.stated
    return T


def _with_flange(robot: Robot, stated: Sequence[Reference]) -> Robot:
    """The arm with its flange where stated poses have it: turned as the first orientation says, and shifted, which is a
    linear matter."""
    first = next((r.quantity for r in stated if isinstance(r.quantity, FlangeTurn)), None)
    if first is not None:
        T = forward(robot.without_tool(), joints_of(robot, [first.pose])[0])
        turn = np.eye(4)
        turn[:3, :3] = T[:3, :3].T @ np.array(first.stated)
        robot = robot.replace(flange=robot.flange @ turn)
    own = [r for r in stated if isinstance(r.quantity, PointCoordinate) and r.quantity.point == "flange"]
    if not own:
        return robot
    return _fitted(robot, (), _misfit_of(own), np.array([[k // 3 != SHIFT_OF_FLANGE for k in range(12)]]))


def _changed(robot: Robot, numbers: Sequence[Entry], x: Reals) -> Robot:
    """The arm with base (6), flange (6), and entries moved by x, m and rad."""
    base, flange = (
        T @ posed(exp_rotation(own[3:]), own[:3]) for T, own in ((robot.base, x[:6]), (robot.flange, x[6:12]))
    )
    return robot_of(shifted(tables_of(robot), numbers, x[None, 12:]), 0, robot.replace(base=base, flange=flange))


SHIFT_OF_FLANGE = 2
"""Of the four threes of base and flange: shift and turn of each."""


def _fitted(robot: Robot, numbers: Sequence[Entry], off: Misfit, held: Flags | None = None) -> Robot:
    """Base, flange and entries fitted, but for those held (1, 12 + k), from an arm that nearly meets the references."""

    def model(amounts: Reals, _: Integers) -> Reals:
        return np.array([off(_changed(robot, numbers, x)) for x in amounts])

    return _changed(robot, numbers, lowered(model, np.zeros((1, 12 + len(numbers))), held, passes=ROUNDS)[0][0])


def _plain(given: Robot, fitted: Robot, off: Misfit, tolerances: Tolerances) -> Robot:
    """The fitted arm with as much as can be left as the table has it, and zeros that are whole degrees written so."""

    def kept(arm: Robot, simpler: Robot) -> Robot:
        return simpler if np.abs(off(simpler)).max() <= max(MEETS, AS_GOOD * np.abs(off(arm)).max()) else arm

    moved = np.degrees(wrap_to_pi(fitted.offset - given.offset))
    snapped = np.where(np.abs(moved - np.round(moved)) < 2 * np.degrees(tolerances.angle), np.round(moved), moved)
    arm = kept(fitted, fitted.replace(offset=wrap_to_pi(given.offset + np.radians(snapped))))
    near = Tolerances(2 * tolerances.length, 2 * tolerances.angle)
    for end in ("flange", "base"):
        if is_identity(np.linalg.inv(getattr(given, end)) @ getattr(arm, end), near):
            arm = kept(arm, arm.replace(**{end: getattr(given, end)}))
    return arm


def _differences(given: Robot, found: Robot, tolerances: Tolerances) -> Faults:
    faults: list[Fault] = []
    moved = wrap_to_pi(found.offset - given.offset)
    for k in range(given.joints):
        if found.direction[k] != given.direction[k]:
            faults.append(fact("reversed_direction", joint=k + 1))
        if abs(moved[k]) > tolerances.angle:
            fits = float(np.round(np.degrees(wrap_to_pi(found.offset[k : k + 1]))[0], 6))
            faults.append(
                fact("wrong_offset", joint=k + 1, given_deg=float(np.degrees(given.offset[k])), fits_deg=fits)
            )
    ends = {"base": found.base @ np.linalg.inv(given.base), "flange": np.linalg.inv(given.flange) @ found.flange}
    for end, T in ends.items():
        if not is_identity(T, tolerances):
            x, y, z = (np.round(T[:3, 3] * MM, 3) + 0.0).tolist()
            turn = float(np.round(np.degrees(turn_of(T)), 4))
            faults.append(fact(f"{end}_elsewhere", shift_mm=(x, y, z), turn_deg=turn))
    return tuple(faults)
