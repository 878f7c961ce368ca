"""Whether a table is the arm that references describe, with zeros, directions, base or flange defined otherwise.

Where references state the line of every joint axis, these lines are an arm, and the table is matched with it
(:mod:`er3a.comparison.mechanism`): geometry first. Only if that agrees are zeros, directions, base and flange taken
from the match, any number of them at once, and fitted to all references that the arm's shape and place answer. The
table is the same arm if all of these are met.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.comparison.mechanism import Match, Tolerances, match, mechanism_from_axes, mechanism_of, turn_of, wrapped
from er3a.diagnosis.faults import BaseElsewhere, Fault, Faults, FlangeElsewhere, ReversedDirection, WrongOffset
from er3a.geometry.transforms import rot_x, rot_y, rot_z, translation
from er3a.kinematics.table_batch import tables_of
from er3a.numerics.arrays import Reals
from er3a.references.predict import predict_tables
from er3a.references.quantities import MM, ZERO_POSE, AxisAngle, AxisCoordinate, Limit, PointCoordinate, PoseOutside
from er3a.references.reference import Reference, expected_of, quantities_of
from er3a.robots.robot import Robot

LEAST_LENGTH, LEAST_ANGLE = 0.5e-3, math.radians(0.1)
SPREAD = 3.0  # times its uncertainty, that what is derived from two lines may be off
ROUNDS = 8
STEP = 1e-6
ROUND_DEG, ROUND_MM = 1e-6, 1e-6


@dataclass(frozen=True, eq=False)
class Conventions:
    """A table's geometry is the references'; ``faults`` is what is defined otherwise, and ``corrected`` the table with
    it as they have it; ``left`` : what stays, in half-widths of the references, at most."""

    faults: Faults
    corrected: Robot
    left: float


def conventions_of(robot: Robot, references: Sequence[Reference], meets: float) -> Conventions | None:
    """How references define zeros, directions, base and flange of a table otherwise; None if that is not the reason
    why they are missed, or if they don't state all joint axes.

    Parameters
    ----------
    references : that all state a value; limits and speeds don't count here
    meets : half-widths by which a reference that is met may be off
    """
    if robot.coupling is not None or robot.rows != robot.joints or robot.sliding.any():
        return None
    stated = [r for r in references if not isinstance(r.quantity, Limit | PoseOutside)]
    lines = _lines(stated, robot.joints)
    if lines is None:
        return None
    directions, points, signed, tolerances = lines
    T = translation(*_zero_flange(robot, stated))
    other = mechanism_from_axes(directions, points, T, tolerances.angle)
    own = mechanism_of(robot.without_tool())
    found = match(own, other, tolerances)
    if found.differences or found.unexplained:
        return None
    expected, uncertainty = expected_of(stated)
    quantities = quantities_of(stated)

    def off(arm: Robot) -> Reals:
        difference = predict_tables(tables_of(arm), arm, quantities)[0] - expected
        return np.asarray(difference / uncertainty)

    start = _moved(robot, found)
    flips = [[1.0] if sure else [1.0, -1.0] for sure in signed]
    tried = []
    for flip in itertools.product(*flips):
        arm = _with_flange(start.replace(direction=start.direction * np.array(flip)), stated)
        reversed_count = int((arm.direction != robot.direction).sum())
        tried.append((round(float(np.abs(off(arm)).max()), 3), reversed_count, arm))
    least = min(worst for worst, _, _ in tried)
    best = min((each for each in tried if each[0] <= least + 0.5), key=lambda each: each[1])[2]
    best = _fitted(best, off, meets)
    best = _plain(robot, best, off, meets, tolerances)
    left = float(np.abs(off(best)).max())
    if left > meets:
        return None
    faults = _differences(robot, best, tolerances)
    return Conventions(faults, best, left) if faults else None


def _lines(stated: Sequence[Reference], joints: int) -> tuple[Reals, Reals, list[bool], Tolerances] | None:
    """Directions, points (n, 3), m, of all joint axes, which directions are of positive rotation, and how exactly."""
    toward = dict[int, AxisAngle]()
    points = dict[int, tuple[float, float, float]]()
    length, angle = LEAST_LENGTH, LEAST_ANGLE
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
    return directions, places, [toward[joint].signed for joint in every], Tolerances(length, angle)


def _zero_flange(robot: Robot, stated: Sequence[Reference]) -> tuple[float, float, float]:
    """Where the flange (m) is with all joints at 0: as stated, else the last axis' own point."""
    found = dict.fromkeys("xyz", math.nan)
    for reference in stated:
        quantity = reference.quantity
        if isinstance(quantity, PointCoordinate) and quantity.point == "flange" and quantity.pose == ZERO_POSE:
            found[quantity.coordinate] = float(expected_of([reference])[0][0]) / MM
    x, y, z = (0.0 if math.isnan(value) else value for value in found.values())
    return x, y, z


def _moved(robot: Robot, found: Match) -> Robot:
    """The table with the match's zeros, directions and base."""
    offset = robot.offset + found.zeros
    direction = np.where(found.reverses, -1.0, 1.0) * robot.direction
    return robot.replace(offset=offset, direction=direction, base=np.linalg.inv(found.base) @ robot.base)


def _with_flange(robot: Robot, stated: Sequence[Reference]) -> Robot:
    """The arm with its flange shifted to where stated positions have it, which is a linear matter."""
    own = [r for r in stated if isinstance(r.quantity, PointCoordinate) and r.quantity.point == "flange"]
    if not own:
        return robot
    expected, uncertainty = expected_of(own)

    def at(shift: Reals) -> Reals:
        arm = robot.replace(flange=robot.flange @ translation(*shift))
        return np.asarray((predict_tables(tables_of(arm), arm, quantities_of(own))[0] - expected) / uncertainty)

    here = at(np.zeros(3))
    slopes = np.stack([at(row) - here for row in np.eye(3)], axis=1)
    shift = -np.linalg.lstsq(slopes, here, rcond=1e-9)[0]
    return robot.replace(flange=robot.flange @ translation(*shift))


def _changed(robot: Robot, x: Reals) -> Robot:
    """The arm with base (6), flange (3) and inner zeros moved by x, m and rad."""
    base = robot.base @ translation(*x[:3]) @ rot_z(x[3]) @ rot_y(x[4]) @ rot_x(x[5])
    offset = robot.offset.copy()
    offset[1:-1] += x[9:]
    return robot.replace(base=base, flange=robot.flange @ translation(*x[6:9]), offset=offset)


def _fitted(robot: Robot, off, meets: float) -> Robot:  # type: ignore[no-untyped-def]
    """Gauss and Newton's steps from an arm that nearly meets the references."""
    count = 9 + max(robot.joints - 2, 0)
    for _ in range(ROUNDS):
        here = off(robot)
        if np.abs(here).max() < 0.1 * meets:
            break
        slopes = np.stack([(off(_changed(robot, STEP * row)) - here) / STEP for row in np.eye(count)], axis=1)
        ahead = _changed(robot, -np.linalg.lstsq(slopes, here, rcond=1e-9)[0])
        if np.linalg.norm(off(ahead)) > 0.999 * np.linalg.norm(here):
            break
        robot = ahead
    return robot


def _plain(given: Robot, fitted: Robot, off, meets: float, tolerances: Tolerances) -> Robot:  # type: ignore[no-untyped-def]
    """The fitted arm with as much as can be left as the table has it, and zeros that are whole degrees written so."""

    def kept(arm: Robot, simpler: Robot) -> Robot:
        return simpler if np.abs(off(simpler)).max() <= max(meets, 1.05 * np.abs(off(arm)).max()) else arm

    moved = np.degrees(wrapped(fitted.offset - given.offset))
    snapped = np.where(np.abs(moved - np.round(moved)) < 2 * np.degrees(tolerances.angle), np.round(moved), moved)
    arm = kept(fitted, fitted.replace(offset=wrapped(given.offset + np.radians(snapped))))
    shift = np.linalg.inv(given.flange) @ arm.flange
    if np.linalg.norm(shift[:3, 3]) < 2 * tolerances.length:
        arm = kept(arm, arm.replace(flange=given.flange))
    shift = np.linalg.inv(given.base) @ arm.base
    if np.linalg.norm(shift[:3, 3]) < 2 * tolerances.length and turn_of(shift) < 2 * tolerances.angle:
        arm = kept(arm, arm.replace(base=given.base))
    return arm


def _differences(given: Robot, found: Robot, tolerances: Tolerances) -> Faults:
    faults: list[Fault] = []
    moved = wrapped(found.offset - given.offset)
    for k in range(given.joints):
        if found.direction[k] != given.direction[k]:
            faults.append(ReversedDirection(k + 1))
        if abs(moved[k]) > tolerances.angle:
            fits = float(np.round(np.degrees(wrapped(found.offset[k : k + 1]))[0], 6))
            faults.append(WrongOffset(k + 1, float(np.degrees(given.offset[k])), fits))
    base = found.base @ np.linalg.inv(given.base)
    if np.linalg.norm(base[:3, 3]) > tolerances.length or turn_of(base) > tolerances.angle:
        faults.append(BaseElsewhere(_shift(base), float(np.round(np.degrees(turn_of(base)), 4))))
    flange = np.linalg.inv(given.flange) @ found.flange
    if np.linalg.norm(flange[:3, 3]) > tolerances.length:
        faults.append(FlangeElsewhere(_shift(flange)))
    return tuple(faults)


def _shift(T: Reals) -> tuple[float, float, float]:
    x, y, z = (np.round(T[:3, 3] * MM, 3) + 0.0).tolist()
    return x, y, z
