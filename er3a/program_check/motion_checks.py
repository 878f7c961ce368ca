"""The way of a motion through joint space, its time, and its faults except collisions.

A way is points of the joints, near to each other. Cubics through them, by the motion's law of time, are polynomials in
time; :mod:`er3a.planning.motion_faults` judges them as it does every motion.

Durations follow from the program's speeds: from rest to rest at constant acceleration. A controller's own ramps and
blends decide the true times; these are estimates.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import scipy

from er3a.by_value import ByValue, frozen
from er3a.errors import PoseError
from er3a.finding import Amount, Finding, fact, turned_or_moved
from er3a.geometry.transforms import rotation_angle
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.singularity import NearSingular
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Reals
from er3a.planning.motion_faults import Interval, over_limits
from er3a.planning.piecewise import SAME_TIME, PiecewiseMotion, chebyshev_times, motion_through
from er3a.planning.profiles import MotionLaw, law_of, trapezoid
from er3a.planning.singular_events import SingularEvent, singular_events
from er3a.planning.timing import SPLINE_DEGREE, JointLimits, standing
from er3a.program_check.program_check_findings import gravity, which
from er3a.programs.instructions import RAMP_OF_A_DURATION, ArmMotion, Rate
from er3a.programs.solving import WIDE_STEP, joints_along, way_of
from er3a.robots.robot import Robot

TURN_LENGTH = 0.1  # m of the path, as long as which a turn of the tool by 1 rad counts
POINTS_APART_M, POINTS_APART_RAD = 0.01, 0.05  # of the tool, or of a joint
MIN_PARTS, MAX_PARTS = 8, 400
AHEAD = 0.02  # of a way: what is beyond where it ends has no solution, if it ends for want of one
SHORTEST_PART = 1e-4  # of a way, in which a joint that moves by more than WIDE_STEP jumps
SMOOTH_STEP = 0.05  # rad or m, of a joint from one point to the next: cubics through others miss rates by up to 7 %
NO_WAY = 1e-9  # m or rad
SLIGHT_TURN = math.radians(1.0)  # of the tool on an arc, which way round does not matter
SAME_ARRIVAL = 1e-4  # rad
FAR_TURN, NEAR_MOVE = math.radians(90.0), 0.05  # of a joint that jumps: it turns so far where the tool moves less
SPARED = math.radians(10.0)  # the other way round is named where it is shorter by so much
ASSUMED_TOOL_SPEED, ASSUMED_TOOL_ACCELERATION = 0.25, 2.0  # m/s and m/s^2, where a program does not say
ASSUMED_JOINT_SHARE = 0.1  # of the joints' maximum speed, where a program does not say
MOST_JOINTS = 6  # of arms whose joints follow from the tool's path

Poses = Callable[[Reals], Reals]
"""T_world_tool (k, 4, 4), m, at shares of the way (k,)."""


@frozen
class CheckRules(ByValue):
    """What motions are checked against.

    Attributes
    ----------
    near : distances below which a pose of a line counts as near-singular
    limits : of the joints, assumed where no document gives them
    """

    near: NearSingular
    limits: JointLimits


@frozen
class MotionPath(ByValue):
    """A motion's way: straight in joint space between points that are near to each other.

    Attributes
    ----------
    share : (N,), of the way, rising from 0; q : (N, n), rad or m, up to where it can be followed
    length : m, of the tool point's way; for a joint move of the straight line between its ends
    turned : rad, by which the tool turns, or for a joint move the joint that turns most
    ahead : (4, 4), m, T_world_tool a little beyond where it can't be followed; None where it can
    """

    arm: Robot
    law: MotionLaw
    share: Reals
    q: Reals
    length: float
    turned: float
    of_tool: bool
    ahead: Reals | None = None

    @property
    def t(self) -> Reals:
        """Times (N,) of the points, s after the motion's start."""
        return self.law.times(self.share)

    @property
    def end(self) -> Reals | None:
        """Joints (n,) at the end, rad or m; None where that is not come to."""
        return self.q[-1] if self.ahead is None else None

    def at(self, share: Reals) -> Reals:
        """Joints at places of the way, straight between its points.

        Parameters
        ----------
        share : (k,), of the whole way, 0 to 1

        Returns
        -------
        q : (k, n), rad or m
        """
        return np.stack([np.interp(share, self.share, column) for column in self.q.T], axis=-1)

    def along_mm(self, share: float) -> float:
        """How far the tool point has come.

        Parameters
        ----------
        share : of the whole way, 0 to 1

        Returns
        -------
        length : mm along the path of the tool point, rounded to 1 um
        """
        return round(1000 * self.length * share, 3)


def _given(rate: Rate | None, unit: str) -> float | None:
    return rate.value if rate is not None and rate.unit == unit and rate.value > 0 else None


def tool_law(motion: ArmMotion, length: float, turned: float) -> MotionLaw:
    """The law of a line or arc, by its path or by its tool's turn, whichever takes longer.

    Parameters
    ----------
    length : m, of the tool point's path
    turned : rad, of the tool

    Returns
    -------
    law : of the duration that the program gives, or else by its speeds

    Notes
    -----
    A turn whose speed the program does not give counts as a length of ``TURN_LENGTH`` for 1 rad.
    """
    if (seconds := _given(motion.speed, "s")) is not None:
        return MotionLaw(seconds, RAMP_OF_A_DURATION)
    v = _given(motion.speed, "m/s") or ASSUMED_TOOL_SPEED
    a = _given(motion.acceleration, "m/s2") or ASSUMED_TOOL_ACCELERATION
    turn_speed = motion.turn_speed or v / TURN_LENGTH
    return law_of(max(length, turned * v / turn_speed), v, a)


def joint_law(motion: ArmMotion, steps: Reals, limits: JointLimits, length: float = 0.0) -> MotionLaw:
    """The law of a joint move whose joints turn by ``steps`` (n,) in rad, all together.

    With a speed of the tool it takes as long as the tool's straight way of ``length`` (m), and no joint is faster than
    it can be.
    """
    if (seconds := _given(motion.speed, "s")) is not None:
        return MotionLaw(seconds, RAMP_OF_A_DURATION)
    size = np.abs(steps)
    lead = int(np.argmax(size))
    if (lead_speed := _given(motion.speed, "rad/s")) is not None:
        a = _given(motion.acceleration, "rad/s2") or float(limits.acceleration[lead])
        return law_of(float(size[lead]), lead_speed, a)
    along = _given(motion.speed, "m/s")
    share = 1.0 if along is not None else _given(motion.speed, "share") or ASSUMED_JOINT_SHARE
    quick = _given(motion.acceleration, "share") or 1.0
    slowest = int(np.argmax(size / limits.speed))
    law = law_of(
        float(size[slowest]), float(limits.speed[slowest]) * share, float(limits.acceleration[slowest]) * quick
    )
    if along is None or law.duration >= length / along:
        return law
    return MotionLaw(length / along, law.ramp)


def is_given(motion: ArmMotion) -> bool:
    """Whether the program gives a speed that the motion's law uses.

    Returns
    -------
    given : for joint moves a duration, a speed or a share of the greatest; for lines and arcs a duration or the tool's
        speed
    """
    units = ("s", "rad/s", "share", "m/s") if motion.kind == "joint" else ("s", "m/s")
    return any(_given(motion.speed, unit) is not None for unit in units)


def joint_path(arm: Robot, motion: ArmMotion, start: Reals, end: Reals, rules: CheckRules) -> MotionPath | None:
    """The way of a joint move: all joints together, straight in joint space.

    Parameters
    ----------
    start, end : (n,), rad or m

    Returns
    -------
    path : points near to each other; None if no joint moves by more than ``NO_WAY``. Its length is the straight
        distance (m) between the tool's places at both ends.
    """
    step = end - start
    lead = float(np.abs(step).max())
    if lead < NO_WAY:
        return None
    tool = forward(arm, np.stack([start, end]))[:, :3, 3]
    moved = float(np.linalg.norm(tool[1] - tool[0]))
    law = joint_law(motion, step, rules.limits, moved)
    share = np.linspace(0.0, 1.0, _parts(0.0, lead) + 1)
    return MotionPath(arm, law, share, start + share[:, None] * step, moved, lead, of_tool=False)


def tool_path(
    arm: Robot, motion: ArmMotion, start: Reals, end: Reals, via: Reals | None
) -> MotionPath | Finding | None:
    """The way of a line or arc, followed from given joints.

    Parameters
    ----------
    start : (n,), rad or m
    end, via : T_world_tool (4, 4), m; a line without ``via``

    Returns
    -------
    path : up to where the arm can't follow any more. None if the tool does not move. A finding where the way is not
        followed: points that define no arc, a redundant arm, or a turn that could go either way.
    """
    way = way_of(forward(arm, start), via, end)
    if way is None:
        return fact("not_followed", text=motion.form, reason="too_far" if via is None else "not_understood")
    length, turned = way.length, way.turned
    if max(length, TURN_LENGTH * turned) < NO_WAY:
        return None
    if arm.joints > MOST_JOINTS:
        return fact("not_followed", text=motion.form, reason="redundant")
    if way.half_turn:
        return fact("not_followed", text=motion.form, reason="half_turn")
    if motion.with_path and turned > SLIGHT_TURN:
        return fact("not_followed", text=motion.form, reason="turns_with_path")
    share, q, stop = _followed(arm, way.poses, start, _parts(length, turned))
    ahead = None if stop is None else way.poses(np.array(min(stop + AHEAD, 1.0)))
    return MotionPath(arm, tool_law(motion, length, turned), share, q, length, turned, True, ahead)


def _followed(arm: Robot, poses: Poses, start: Reals, parts: int) -> tuple[Reals, Reals, float | None]:
    """Shares (k,) and joints (k, n) along a tool's path, with more points where joints move far; and the share beyond
    which it can't be followed."""
    share = np.linspace(0.0, 1.0, parts + 1)
    while True:
        q = np.concatenate([start[None], joints_along(arm, poses(share[1:]), start)])
        steps = np.abs(np.diff(q, axis=0)).max(axis=1, initial=0.0)
        wide = np.flatnonzero(steps > WIDE_STEP)
        first = int(wide[0]) if wide.size else len(q) - 1  # the last point before the first that is not followed
        open_parts = np.union1d(wide, [len(q) - 1] if len(q) < len(share) else []).astype(int)
        again = np.union1d(open_parts, np.flatnonzero(steps > SMOOTH_STEP))
        again = again[np.diff(share)[again] > SHORTEST_PART]
        if not again.size:
            done = not open_parts.size
            return share[: first + 1], q[: first + 1], None if done else float(share[first + 1])
        share = np.insert(share, again + 1, (share[again] + share[again + 1]) / 2)


def _parts(length: float, turned: float) -> int:
    return int(np.clip(np.ceil(max(length / POINTS_APART_M, turned / POINTS_APART_RAD)), MIN_PARTS, MAX_PARTS))


Moments = dict[Finding, float]
"""Findings with the time (s) of the motion at which each begins."""


def path_findings(path: MotionPath, rules: CheckRules, target: Reals | None) -> Moments:
    """Limits, speeds, reach, configuration, and of lines and arcs singular poses.

    Parameters
    ----------
    target : T_world_tool (4, 4), m, of a line's or arc's end; None for a joint move
    """
    found: Moments = {}
    curve = curve_of(path)
    if path.ahead is not None and target is not None:
        found[_stopped(path, path.ahead, target)] = curve.duration  # where the arm still is
    limits = rules.limits
    most = 1 if limits.acceleration_assumed else 2
    rates = limits.rates[:most] if path.ahead is None else ()  # towards the end of reach they grow without bound
    found |= begun(over_limits(path.arm, curve, rates))
    if path.of_tool and has_branches(path.arm):
        for event in singular_events(path.arm, curve, rules.near):
            found[_singular(path, event)] = event.t
    return found


def curve_of(path: MotionPath) -> PiecewiseMotion:
    """The motion in time: cubics in the share of the way, by its law."""
    law, share = path.law, path.share
    if len(share) == 1:
        return standing(path.q[0], 0.0)
    times = law.times(share)
    ramps = law.duration * np.array([law.ramp, 1 - law.ramp])
    times = np.union1d(times, ramps[ramps < times[-1]])
    times = times[np.diff(times, prepend=-1.0) > SAME_TIME * times[-1]]
    nodes = chebyshev_times(times[:-1], times[1:], SPLINE_DEGREE)[0]
    progress = trapezoid(nodes, law.duration, law.ramp)[0]
    spline = scipy.interpolate.make_interp_spline(share, path.q, k=min(3, len(share) - 1))
    return motion_through(spline(progress), times)


def begun(faults: Iterable[Interval]) -> Moments:
    """Each fault once, from where it begins first, as it is where it is worst.

    Parameters
    ----------
    faults : in the order of time
    """
    found: dict[str, Interval] = {}
    for part in faults:
        first = found.setdefault(part.cause.code + which(part.cause), part)
        worst = max(first.cause, part.cause, key=gravity)
        found[part.cause.code + which(part.cause)] = replace(first, cause=worst)
    return {part.cause: part.start for part in found.values()}


def _singular(path: MotionPath, event: SingularEvent) -> Finding:
    """That a line or arc meets a singular pose, with joint speeds that stay finite, or passes one."""
    at_mm = path.along_mm(float(trapezoid(np.array(event.t), path.law.duration, path.law.ramp)[0]))
    if event.crossing:
        return fact("meets_singularity", type=event.type, at_mm=at_mm)
    moves = event.type == "shoulder"
    distance = turned_or_moved(event.distance * (1000.0 if moves else float(np.degrees(1.0))), moves)
    return fact("passes_singularity", type=event.type, at_mm=at_mm, distance=distance)


def _stopped(path: MotionPath, ahead: Reals, target: Reals) -> Finding:
    """Why a line or arc can't be followed on."""
    arm, last, at_mm = path.arm, path.q[-1], path.along_mm(float(path.share[-1]))
    for pose in (target, ahead):
        try:
            solutions = inverse(arm, pose, last)
        except PoseError:
            continue
        if not len(solutions.q):
            place = tuple(target[:3, 3].tolist())
            return fact("way_out_of_reach", at_mm=at_mm, reasons=solutions.unsolved, target_m=place)
    away = np.abs(solutions.q - last).max(axis=1)
    other = solutions.q[int(away.argmin())] - last
    joint = int(np.abs(other).argmax())
    jump = Amount(float(np.degrees(other[joint])), "deg")
    return fact("configuration_ends", at_mm=at_mm, joint=joint + 1, jump=jump)


def far_turns(path: MotionPath) -> list[Finding]:
    """Joints that turn further than the motion needs.

    Returns
    -------
    findings : the joint that turns most, if by more than 90 deg, although the tool moves less than 50 mm. The tool also
        turns less than half as far then. Further joints that turn by more than 180 deg, where another turn within the
        limits is shorter.
    """
    arm, start, step = path.arm, path.q[0], path.q[-1] - path.q[0]
    found: list[Finding] = []
    turned = np.abs(step)
    lead = int(np.argmax(turned))
    if turned[lead] > FAR_TURN and path.length < NEAR_MOVE:
        tool = forward(arm, path.q[[0, -1]])[:, :3, :3]
        if rotation_angle(tool[0], tool[1]) < turned[lead] / 2:
            angle, near, end = np.degrees([step[lead], *path.q[[0, -1], lead]]).tolist()
            turned_deg = {"angle_deg": angle, "near_deg": near, "target_deg": end}
            found.append(fact("joint_jumps", joint=lead + 1, moved_mm=path.length * 1000, **turned_deg))
    for j in np.flatnonzero(turned > np.pi).tolist():
        nearer = float(wrap_to_pi(step[j]))
        if abs(step[j]) - abs(nearer) > SPARED and arm.lower[j] <= start[j] + nearer <= arm.upper[j]:
            found.append(
                fact(
                    "whole_turn",
                    joint=j + 1,
                    angle_deg=float(np.degrees(step[j])),
                    nearest_deg=float(np.degrees(nearer)),
                )
            )
    return found


def arrives_otherwise(path: MotionPath, given: Reals) -> Finding | None:
    """Whether a line or arc to given joints ends in other joints than these.

    Parameters
    ----------
    given : (n,), rad or m, joints of the target

    Returns
    -------
    finding : the joint that differs most, and by how much; None where the end is the same, or is not come to
    """
    if path.end is None or np.abs(path.end - given).max() <= SAME_ARRIVAL:
        return None
    joint = int(np.argmax(np.abs(path.end - given)))
    differs = Amount(float(np.degrees(path.end[joint] - given[joint])), "deg")
    return fact("arrives_otherwise", joint=joint + 1, difference=differs)
