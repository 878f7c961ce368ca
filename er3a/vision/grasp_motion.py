"""The motion of a grasp, leg by leg: from where the arm waits to the approach, to the grasp, and away.

The arm halts at the end of each leg, so that the way is the same whatever ramps a controller has. Between the place
where it waits and the approach the legs are straight moves of all joints: a single one if that keeps clear, else those
of a way that the planner found (:mod:`er3a.planning.way_around`). Approach and retreat are straight lines of the tool,
followed on polynomials (:mod:`er3a.planning.tool_curve`). Arms without closed form go along them in short
straight moves of the joints. Clearance is proven along each leg as it is run (:mod:`er3a.collision.along`).
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from typing import Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import RateBounds, clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import Pair
from er3a.finding import Finding, fact
from er3a.kinematics.wrist_partitioned import parallel_axes_arm, wrist_partition_missing
from er3a.numerics.arrays import Reals
from er3a.planning.follow import follow
from er3a.planning.motion_faults import over_limits
from er3a.planning.moves import JointMove, line
from er3a.planning.timing import JointLimits
from er3a.planning.tool_curve import follow_as_curve
from er3a.planning.way_around import PlanningTask, WayAround, way_around
from er3a.robots.joint_limits import limits_exceeded, within
from er3a.robots.robot import Robot

Part = Literal["move", "approach", "retreat"]
PARTS: tuple[Part, ...] = ("move", "approach", "retreat")
DEPTH = 2e-4  # m, to within which the smallest clearance is found
PEAKS = (15 / 8, 10 / np.sqrt(3), 60.0)  # of a quintic from rest to rest: speed, acceleration and jerk, by duration
SPARE = 1.02  # of the duration, so that bounds settle what samples allow
MIN_DURATION = 0.05  # s
CHECKS = 41  # times of a leg at which it is solved and measured first; both are refined from there


@by_identity
class GraspLeg:
    """A part of the way from halt to halt.

    Attributes
    ----------
    duration : s; joints : angles (k, n) in rad at times (k,); rates : bounds of speeds and accelerations between times
    q_end : (n,), rad; T_end : T_base_tool (4, 4) where the tool runs straight there, None where all joints do
    """

    part: Part
    duration: float
    joints: Callable[[Reals], Reals]
    rates: RateBounds
    q_end: Reals
    T_end: Reals | None = None

    def sampled(self, count: int) -> tuple[Reals, Reals]:
        """The leg at even times, both ends included.

        Parameters
        ----------
        count : how many times

        Returns
        -------
        t, q : (count,), s from 0, and (count, n), rad or m
        """
        times = np.linspace(0.0, self.duration, count)
        return times, self.joints(times)


def joint_legs(part: Part, corners: Reals, limits: JointLimits) -> tuple[GraspLeg, ...]:
    """Straight moves of all joints from corner to corner, on quintics from rest to rest.

    Parameters
    ----------
    part : of the grasp's way that the legs belong to
    corners : (k, n), rad or m
    limits : of speed and acceleration, which the legs use as far as they allow

    Returns
    -------
    legs : k - 1
    """
    return tuple(_joint_leg(part, a, b, limits) for a, b in pairwise(corners))


def _joint_leg(part: Part, start: Reals, end: Reals, limits: JointLimits) -> GraspLeg:
    turn = np.abs(end - start)
    smallest = [(PEAKS[0] * turn / limits.speed).max(), np.sqrt(PEAKS[1] * turn / limits.acceleration).max()]
    if limits.jerk is not None:
        smallest.append(np.cbrt(PEAKS[2] * turn / limits.jerk).max())
    move = JointMove(start, end, max(MIN_DURATION, *map(float, smallest)))
    motion = move.polynomials()
    return GraspLeg(part, move.duration, lambda t: move.joints(t)[0], motion.rate_bounds, end)


def transfer(task: PlanningTask, start: Reals, end: Reals, needed: float) -> tuple[GraspLeg, ...] | Finding:
    """Legs from joints to joints on which nothing touches.

    Where the straight move comes too near to something, a way around is tried; of both the one is taken that keeps
    farther away.

    Parameters
    ----------
    start, end : (n,), rad or m
    needed : m, clearance with which the straight move is good enough

    Returns
    -------
    legs : or why there are none
    """
    if outside := limits_exceeded(task.robot, start):
        return fact("no_end", end="start", why=outside)
    straight = joint_legs("move", np.stack([start, end]), task.limits)
    if (clear := _clearance(task.bodies, straight)) > 0 and clear >= needed:
        return straight
    found = way_around(task, start, end)
    if not isinstance(found, WayAround):
        return straight if clear > 0 else found
    legs = joint_legs("move", found.corners, task.limits)
    around = _clearance(task.bodies, legs) if within(task.robot, found.corners).all() else 0.0
    if max(clear, around) <= 0:
        return fact("none_found", rounds=task.rounds)
    return legs if around > clear else straight


def _clearance(bodies: Bodies, legs: tuple[GraspLeg, ...]) -> float:
    """What the arm keeps clear by along legs, m; infinite where nothing can meet."""
    smallest = min_clearance(bodies, legs)
    return np.inf if smallest is None else smallest[0]


def tool_leg(
    robot: Robot, part: Part, waypoints: Reals, ends: tuple[Reals, Reals], limits: JointLimits, speed: float
) -> tuple[GraspLeg, ...] | None:
    """The straight line of the tool between two poses, within limits and off singular poses.

    Parameters
    ----------
    waypoints : (k, n), rad, joints along it, from a search; arms without closed form move straight between them
    ends : (4, 4) each, T_base_tool, m
    speed : m/s, the tool's largest

    Returns
    -------
    legs : one, or one for each two waypoints; None if no line keeps the limits
    """
    if parallel_axes_arm(robot) is None and wrist_partition_missing(robot) is not None:
        return joint_legs(part, waypoints, limits)
    length = float(np.linalg.norm(ends[1][:3, 3] - ends[0][:3, 3]))
    duration = max(MIN_DURATION, PEAKS[0] * length / speed)
    path, times = line(*ends, duration), np.linspace(0, duration, CHECKS)
    _, velocity, acceleration = follow(robot, path, times, waypoints[0]).rates(times)
    needed = [np.abs(velocity / limits.speed), np.sqrt(np.abs(acceleration / limits.acceleration))]
    if limits.jerk is not None:
        needed.append(np.cbrt(np.abs(np.diff(acceleration, axis=0) / times[1] / limits.jerk)))
    slower = max(float(each.max()) for each in needed)
    if not np.isfinite(slower):
        return None
    duration *= max(1.0, SPARE * slower)
    path = line(*ends, duration)
    followed, curve = follow_as_curve(robot, path, np.linspace(0, duration, CHECKS), waypoints[0])
    if followed.jumps or over_limits(robot, curve, limits.rates):
        return None
    q_end = followed.joints(np.array([duration]))[0]
    return (GraspLeg(part, duration, followed.joints, curve.rate_bounds, q_end, ends[1]),)


def min_clearance(bodies: Bodies, legs: tuple[GraspLeg, ...]) -> tuple[float, Pair] | None:
    """What the arm is proven to keep clear by along legs, and what is nearest there.

    Parameters
    ----------
    bodies : of the arm and the scene
    legs : one after another

    Returns
    -------
    clearance, pair : m, below 0 where it overlaps, less the ``DEPTH`` that the proof leaves open
        None in place of both where nothing can meet
    """
    smallest: tuple[float, Pair] | None = None
    for leg in legs:
        times = np.linspace(0.0, leg.duration, CHECKS)
        along = clearance_along(bodies, leg.joints, leg.rates, times, times, DEPTH)
        pair = along.pair[along.closest] if along.closest >= 0 else None
        if pair is not None:
            distance = float(along.distance[along.closest]) - DEPTH
            smallest = min(smallest or (np.inf, pair), (distance, pair), key=lambda each: each[0])
    return smallest
