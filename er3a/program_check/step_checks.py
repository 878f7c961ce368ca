"""Follows the steps of a program that was run, and checks each motion from where the one before left the arm."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from er3a.by_value import ByValue
from er3a.collision.along import clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.geometry.angles import TURN
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.program_check.motion_laws import is_given
from er3a.program_check.program_check_findings import (
    ArcGoesOn,
    ArcHasNoCircle,
    CheckFinding,
    ExternalAxesLeftOut,
    LoopComesBackOtherwise,
    MoreThanFullSpeed,
    MotionCollides,
    SpeedNotGiven,
    SplineAsLine,
    TargetOutOfReach,
    WayNotKnown,
    WayOutOfReach,
    ZoneTooLarge,
    ZoneWithoutSize,
)
from er3a.program_check.rest_targets import target_findings
from er3a.program_check.target_joints import Arms, Goal, PlacedMotion, goal_of
from er3a.program_check.ways import CheckRules, MotionWay, joint_way, limit_findings, tool_way
from er3a.program_check.zone_clearance import zone_clearance
from er3a.program_check.zone_patch import bend_of_line, patch_of
from er3a.programs.execution import Ending, Execution
from er3a.programs.instructions import ArmMotion, JointTarget, Pause, PoseTarget, Target, Unknown
from er3a.robots.robot import Robot
from er3a.robots.shown import joint_shown

MOST_OF_A_MOTION = 0.5  # that a zone may take
TOLERANCE = 1e-9
SAME_JOINTS = 1e-4  # rad
BEND_PARTS = 16


@dataclass(frozen=True, eq=False)
class Obstacles:
    """What the arm may not touch.

    Attributes
    ----------
    tolerance : m, of an overlap that may go unnoticed
    """

    scene: Scene | None
    tolerance: float
    bodies: dict[int, Bodies]

    def of(self, arm: Robot) -> Bodies:
        """The bodies of the robot with one tool, made once."""
        if id(arm) not in self.bodies:
            self.bodies[id(arm)] = Bodies(arm, self.scene)
        return self.bodies[id(arm)]


def obstacles_of(robot: Robot, scene: Scene | None, tolerance: float) -> Obstacles:
    """What a robot must not meet, itself among it."""
    return Obstacles(scene, tolerance, {id(robot): Bodies(robot, scene)})


@dataclass(frozen=True, eq=False)
class CheckedMotion(ByValue):
    """A motion as it was carried out.

    Attributes
    ----------
    start : (n,), rad; None if not known
    way : None where there is none: the arm stays (``stays``), or the way is not known
    end : (n,), rad, where the motions that follow go on from; None if not known
    clearance : m, least on the way, negative by an overlap; None where not measured
    blended_ends : of its two ends, how many have a zone that is not fine
    moments : s from the motion's start, when what is found begins; not of findings about the motion as a whole
    """

    kind: str
    placed: PlacedMotion
    start: Reals | None
    way: MotionWay | None
    end: Reals | None
    findings: tuple[CheckFinding, ...]
    clearance: float | None = None
    stays: bool = False
    blended_ends: int = 0
    moments: Mapping[CheckFinding, float] = field(default_factory=dict)


class StepChecker:
    """Checks steps in their order."""

    def __init__(self, robot: Robot, rules: CheckRules, obstacles: Obstacles | None, execution: Execution):
        self.arms, self.rules, self.obstacles, self.execution = Arms(robot), rules, obstacles, execution
        self.start: Reals | None = None
        self.motions: dict[int, CheckedMotion] = {}
        self.returns: list[tuple[Ending, LoopComesBackOtherwise]] = []
        self._joints: list[Reals | None] = []
        self._before: list[int] = []  # the motion that an arm blends from into the next; -1 for none
        self._known: dict[Hashable, CheckedMotion] = {}
        self._corners: dict[Hashable, tuple[CheckFinding, ...]] = {}

    def check(self, number: int) -> None:
        """Check a step; those before it have been checked."""
        step = self.execution.steps[number]
        joints = self._joints[step.before] if step.before >= 0 else self.start
        before = self._before[step.before] if step.before >= 0 else -1
        what = step.instruction
        if isinstance(what, ArmMotion):
            self.motions[number] = motion = self._motion(what, joints)
            joints = motion.end
            self._corner(before, number)
            before = number
        elif isinstance(what, Pause):
            before = -1
        elif isinstance(what, Unknown) and what.may_move:
            joints, before = None, -1
        self._joints.append(joints)
        self._before.append(before)

    @property
    def different(self) -> int:
        """How many motions that differ were checked."""
        return len(self._known)

    def rest(self, first: int) -> tuple[int, dict[int, tuple[CheckFinding, ...]]]:
        """As :func:`target_findings`, of the steps from one on."""
        steps = self.execution.steps
        motions = {i: what for i in range(first, len(steps)) if isinstance(what := steps[i].instruction, ArmMotion)}
        return target_findings(self.arms, motions, {i: _key(motion) for i, motion in motions.items()})

    def close_loop(self, ending: Ending) -> None:
        """Where a loop begins again: whether the arm stands as it did then, and the corner between the rounds."""
        if ending.kind != "repeats" or ending.repeats_from is None or ending.step < 0:
            return
        first = self.execution.steps[ending.repeats_from]
        then = self._joints[first.before] if first.before >= 0 else self.start
        now = self._joints[ending.step]
        if then is not None and now is not None and np.abs(now - then).max() > SAME_JOINTS:
            joint = int(np.argmax(np.abs(now - then)))
            other = joint_shown(self.arms.robot, joint, float(now[joint] - then[joint]))
            self.returns.append((ending, LoopComesBackOtherwise(joint + 1, *other)))
        if isinstance(first.instruction, ArmMotion):
            self._corner(self._before[ending.step], ending.repeats_from)

    def _motion(self, motion: ArmMotion, before: Reals | None) -> CheckedMotion:
        key = (_key(motion), None if before is None else before.tobytes())
        if key not in self._known:
            self._known[key] = self._checked(motion, before)
        return self._known[key]

    def _checked(self, motion: ArmMotion, before: Reals | None) -> CheckedMotion:
        placed = self.arms.placed(motion)
        goal = goal_of(placed, motion.target, before)
        findings: list[CheckFinding] = [*goal.findings, *_said(motion)]
        if motion.angle is not None and not np.isfinite(motion.angle):
            return CheckedMotion(motion.kind, placed, before, None, None, (*findings, ArcGoesOn(None, turns=False)))
        if not goal.known:
            return CheckedMotion(motion.kind, placed, before, None, None, tuple(findings))
        if not is_given(motion):
            assumed = self.rules.assumed
            joint = motion.kind == "joint"
            findings.append(SpeedNotGiven(*((assumed.joint_share, "share") if joint else (assumed.tool_speed, "m/s"))))
        if before is None:
            findings.append(WayNotKnown())
            findings += () if goal.joints is None else limit_findings(placed.arm, goal.joints)
            return CheckedMotion(motion.kind, placed, None, None, goal.joints, tuple(findings))
        if motion.kind == "joint":
            return self._joint_move(placed, goal, before, findings)
        return self._tool_move(placed, goal, before, findings)

    def _joint_move(
        self, placed: PlacedMotion, goal: Goal, before: Reals, findings: list[CheckFinding]
    ) -> CheckedMotion:
        findings += [each for each in placed.missing if each not in findings]
        if goal.joints is None:
            return CheckedMotion("joint", placed, before, None, None, tuple(findings))
        way = joint_way(placed.arm, placed.motion, before, goal.joints, self.rules)
        if way is None:
            return CheckedMotion("joint", placed, before, None, goal.joints, tuple(findings), stays=True)
        found = (*findings, *way.findings)
        beyond = np.maximum(goal.joints - placed.arm.upper, placed.arm.lower - goal.joints).max()
        if beyond > TURN:  # no arm gets there, and nothing goes on from there
            return CheckedMotion("joint", placed, before, None, None, found, moments=way.moments)
        return self._measured(CheckedMotion("joint", placed, before, way, way.end, found, moments=way.moments))

    def _tool_move(
        self, placed: PlacedMotion, goal: Goal, before: Reals, findings: list[CheckFinding]
    ) -> CheckedMotion:
        kind = placed.motion.kind
        if placed.missing:
            said = tuple(dict.fromkeys((*findings, *placed.needed)))
            return CheckedMotion(kind, placed, before, None, goal.joints, said)
        end = goal.pose
        given = None
        if end is None:
            assert goal.joints is not None
            given = goal.joints
            end = forward(placed.arm, given)
        via = self._via(placed, before) if kind == "arc" else None
        if kind == "arc" and via is None:
            return CheckedMotion(kind, placed, before, None, goal.joints, (*findings, ArcHasNoCircle()))
        if placed.motion.angle is not None:  # it goes elsewhere
            findings = [each for each in findings if not isinstance(each, TargetOutOfReach)]
            turns = bool(np.abs(end[:3, :3] - forward(placed.arm, before)[:3, :3]).max() > SAME_JOINTS)
            findings.append(ArcGoesOn(float(np.degrees(placed.motion.angle)), turns))
            given = None
        way = tool_way(placed.arm, placed.motion, before, (end, given, via), self.rules)
        if way is None:
            return CheckedMotion(kind, placed, before, None, before, tuple(findings), stays=True)
        if not isinstance(way, MotionWay):
            return CheckedMotion(kind, placed, before, None, goal.joints, (*findings, way))
        if any(isinstance(each, WayOutOfReach) for each in way.findings):
            findings = [each for each in findings if not isinstance(each, TargetOutOfReach)]
        told = (*findings, *way.findings)
        return self._measured(CheckedMotion(kind, placed, before, way, way.end, told, moments=way.moments))

    def _via(self, placed: PlacedMotion, before: Reals) -> Reals | None:
        """The arc's point (3,), m."""
        target = placed.motion.via
        if isinstance(target, PoseTarget) and placed.base is not None:
            point: Reals = (placed.base @ target.pose)[:3, 3]
            return point
        if isinstance(target, JointTarget):
            return forward(placed.arm, np.where(np.isnan(target.joints), before, target.joints))[:3, 3]
        return None

    def _measured(self, motion: CheckedMotion) -> CheckedMotion:
        """With its clearance and what it collides with."""
        way = motion.way
        if self.obstacles is None or way is None or not np.isfinite(way.q).any():
            return motion
        bodies = self.obstacles.of(way.arm)
        ends = way.t[[0, -1]]
        along = clearance_along(bodies, way.joints, way.rates, way.t, ends, self.obstacles.tolerance)
        least = float(along.distance[along.least]) if along.least >= 0 else None
        if not along.contacts:
            return replace(motion, clearance=least)
        worst = max(along.contacts, key=lambda contact: contact.depth)
        at = None if motion.kind == "joint" else way.along_mm(worst.start)
        hit = MotionCollides(worst.pairs, worst.depth * 1000, at)
        moments = {**motion.moments, hit: worst.start}
        return replace(motion, findings=(*motion.findings, hit), clearance=least, moments=moments)

    def _corner(self, first: int, second: int) -> None:
        """Check the corner between two motions, if a zone lets the arm round it."""
        if first < 0:
            return
        motion = self.motions[first]
        zone = motion.placed.motion.zone
        if zone.kind == "fine":
            return
        after = self.motions[second]
        findings: list[CheckFinding] = []
        if zone.kind in ("named", "velocity"):
            findings.append(ZoneWithoutSize(zone.text))
        if motion.way is not None and after.way is not None:
            findings += self._rounded(motion.way, after.way, motion)
        new = tuple(each for each in findings if each not in motion.findings)
        self.motions[first] = replace(
            motion, findings=(*motion.findings, *new), blended_ends=min(motion.blended_ends + 1, 2)
        )
        self.motions[second] = replace(self.motions[second], blended_ends=min(self.motions[second].blended_ends + 1, 2))

    def _round_corner(
        self, way: MotionWay, after: MotionWay, corners: Reals, shares: tuple[float, float]
    ) -> CheckFinding | None:
        """What stands in a way from joints (3, n) before a corner to behind it, over shares of the two motions."""
        assert self.obstacles is not None
        bodies, tolerance = self.obstacles.of(way.arm), self.obstacles.tolerance
        if way.tool_path is None or after.tool_path is None or way.arm is not after.arm:
            bend = _bend(way, 1 - shares[0], 1.0) + _bend(after, 0.0, shares[1])
            return zone_clearance(bodies, corners, tolerance, bend)
        slack = max(way.sagitta(shares[0]), after.sagitta(shares[1]))
        return zone_clearance(bodies, corners, tolerance, patch=patch_of(way.arm, corners, slack))

    def _rounded(self, way: MotionWay, after: MotionWay, motion: CheckedMotion) -> tuple[CheckFinding, ...]:
        key = (id(way), id(after))
        if key not in self._corners:
            self._corners[key] = self._zone_findings(way, after, motion)
        return self._corners[key]

    def _zone_findings(self, way: MotionWay, after: MotionWay, motion: CheckedMotion) -> tuple[CheckFinding, ...]:
        shares = [_zone_share(motion.placed.motion, part) for part in (way, after)]
        found: list[CheckFinding] = []
        zone = motion.placed.motion.zone
        if zone.kind == "distance" and max(shares) > MOST_OF_A_MOTION + TOLERANCE:
            found.append(ZoneTooLarge(zone.value * 1000, min(way.length, after.length) * 1000))
        if self.obstacles is None or motion.clearance is None or motion.clearance < 0:
            return tuple(found)
        before, behind = (min(share, MOST_OF_A_MOTION) for share in shares)
        corners = np.stack(
            [way.joints_at(np.array(1 - before)), way.joints_at(np.array(1.0)), after.joints_at(np.array(behind))]
        )
        if np.isfinite(corners).all():
            hit = self._round_corner(way, after, corners, (before, behind))
            if hit is not None:
                found.append(hit)
        return tuple(found)


def _bend(way: MotionWay, first: float, last: float) -> Reals:
    """By how much joints (n,) leave the straight way between two shares of a motion, rad; 0 in a joint move."""
    if way.tool_path is None:
        return np.zeros(way.q.shape[1])
    q = way.joints_at(np.linspace(first, last, BEND_PARTS + 1))
    return bend_of_line(way.arm, q, way.sagitta((last - first) / BEND_PARTS))


def _zone_share(motion: ArmMotion, way: MotionWay) -> float:
    """The share of a way that its zone may take; over one half where the zone is larger than that."""
    zone = motion.zone
    match zone.kind:
        case "distance":
            return zone.value / way.length if way.length > TOLERANCE else MOST_OF_A_MOTION
        case "angle":
            return min(zone.value / way.turned, MOST_OF_A_MOTION) if way.turned > TOLERANCE else MOST_OF_A_MOTION
        case "share":
            return min(zone.value, 1.0) * MOST_OF_A_MOTION
    return MOST_OF_A_MOTION


def _said(motion: ArmMotion) -> list[CheckFinding]:
    """What is to be said of a motion whatever the arm does."""
    found: list[CheckFinding] = []
    outer = getattr(motion.target, "external", ())
    if outer:
        found.append(ExternalAxesLeftOut(tuple(name for name, _ in outer)))
    rates = [rate.value for rate in (motion.speed, motion.acceleration) if rate is not None and rate.unit == "share"]
    if rates and max(rates) > 1 + TOLERANCE:
        found.append(MoreThanFullSpeed(100 * max(rates)))
    if motion.kind == "spline":
        found.append(SplineAsLine())
    return found


def _key(motion: ArmMotion) -> Hashable:
    """Equal for motions that are the same in all numbers."""
    targets = tuple(_target_key(each) for each in (motion.target, motion.via))
    frames = tuple(
        (each.name, None if each.pose is None else each.pose.tobytes()) for each in (motion.tool, motion.base)
    )
    return (motion.kind, targets, motion.angle, motion.speed, motion.acceleration, motion.zone, frames)


def _target_key(target: Target | None) -> Hashable:
    match target:
        case JointTarget():
            return (target.joints.tobytes(), target.external)
        case PoseTarget():
            near = None if target.near is None else target.near.tobytes()
            return (target.pose.tobytes(), target.configuration, near, target.external)
    return target
