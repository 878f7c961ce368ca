"""Which joints a target of a program stands for."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from er3a.by_value import ByValue
from er3a.errors import PoseError
from er3a.kinematics.inverse import inverse
from er3a.numerics.arrays import Reals
from er3a.program_check.program_check_findings import (
    CheckFinding,
    ConfigurationNotRead,
    FrameNotGiven,
    FrameTakenAsFlange,
    TargetNotGiven,
    TargetOutOfReach,
    TurnNotMet,
)
from er3a.programs.instructions import ArmMotion, JointTarget, PoseTarget, Target, UnresolvedTarget
from er3a.robots.robot import Robot

FLANGE = "tool0"
SIGN_ZERO = 1e-7  # rad; nearer to 0 a joint's sign says nothing


@dataclass(frozen=True, eq=False)
class PlacedMotion(ByValue):
    """A motion with the arm that carries its tool.

    Attributes
    ----------
    arm : the robot with the motion's tool; without one where the tool is not known
    base : T_world_base of the targets (4, 4); None where the base is not known
    missing, taken : frames that are not given
    """

    motion: ArmMotion
    arm: Robot
    base: Reals | None
    missing: tuple[FrameNotGiven, ...]
    taken: tuple[FrameTakenAsFlange, ...]

    @property
    def needed(self) -> tuple[FrameNotGiven, ...]:
        """The frames that are not given, for a motion that needs them."""
        return tuple(replace(each, needed=True) for each in self.missing)


class Arms:
    """The robot with each tool of a program, made once."""

    def __init__(self, robot: Robot):
        self.robot = robot
        self._by_tool: dict[bytes, Robot] = {robot.tool.tobytes(): robot}

    def placed(self, motion: ArmMotion) -> PlacedMotion:
        """A motion with its arm; frames that are not given are named."""
        missing: list[FrameNotGiven] = []
        taken: tuple[FrameTakenAsFlange, ...] = ()
        arm, base = self.robot, motion.base.pose
        if motion.tool.pose is not None:
            arm = self._with(motion.tool.pose)
        elif motion.tool.name == FLANGE:
            arm, taken = self._with(np.eye(4)), (FrameTakenAsFlange(FLANGE),)
        elif motion.tool.name:
            missing.append(FrameNotGiven(motion.tool.name, "tool", needed=False))
        if base is None and motion.base.name:
            missing.append(FrameNotGiven(motion.base.name, "base", needed=motion.kind != "joint"))
        known = None if base is None and motion.base.name else self.robot.base @ (np.eye(4) if base is None else base)
        return PlacedMotion(motion, arm, known, tuple(missing), taken)

    def _with(self, tool: Reals) -> Robot:
        key = tool.tobytes()
        if key not in self._by_tool:
            self._by_tool[key] = self.robot.replace(tool=tool)
        return self._by_tool[key]


@dataclass(frozen=True, eq=False)
class Goal:
    """Where a motion goes.

    Attributes
    ----------
    joints : (n,), rad; None where no solution is known
    pose : T_world_tool (4, 4), m, of a target that is a pose
    known : whether the target itself is known
    """

    joints: Reals | None
    pose: Reals | None
    known: bool
    findings: tuple[CheckFinding, ...] = ()


def goal_of(placed: PlacedMotion, target: Target | None, before: Reals | None) -> Goal:
    """What a target means, from joints (n,) in rad; of several solutions the nearest within the limits."""
    if isinstance(target, UnresolvedTarget) and target.reason == "position_unknown" and placed.missing:
        return Goal(None, None, False, placed.needed)
    if target is None or isinstance(target, UnresolvedTarget):
        unknown = TargetNotGiven("", "undefined") if target is None else TargetNotGiven(target.text, target.reason)
        return Goal(None, None, False, (unknown,))
    if isinstance(target, JointTarget):
        open_ = np.isnan(target.joints)
        if not open_.any():
            return Goal(target.joints, None, True)
        if before is None:
            stays = bool(open_.all())
            return Goal(None, None, stays, () if stays else (TargetNotGiven("", "position_unknown"),))
        return Goal(np.where(open_, before, target.joints), None, True)
    if placed.missing or placed.base is None:
        return Goal(None, None, False, placed.needed)
    pose = placed.base @ target.pose
    return _solved(placed, target, pose, before)


def _solved(placed: PlacedMotion, target: PoseTarget, pose: Reals, before: Reals | None) -> Goal:
    reference = target.near if target.near is not None else before
    try:
        found = inverse(placed.arm, pose, reference, self_motion_rows=True)
    except PoseError:
        return Goal(None, None, False, (TargetNotGiven("", "not_finite"),))
    if not len(found.q):
        return Goal(None, pose, True, (*placed.taken, TargetOutOfReach(found.unsolved)))
    rows = found.q[found.within_limits] if found.within_limits.any() else found.q
    findings: list[CheckFinding] = list(placed.taken)
    given = dict(target.configuration)
    turn = given.get("T")
    if isinstance(turn, (int, float)) and placed.motion.kind == "joint":
        met = _with_signs(rows, int(turn))
        rows = rows if met is None else met
        if met is None:
            findings.append(TurnNotMet(int(turn)))
    elif given and "S" not in given and placed.motion.kind == "joint":
        findings.append(ConfigurationNotRead(", ".join(f"{value}" for value in given.values())))
    start = np.zeros(rows.shape[1]) if reference is None else reference
    away = np.abs(rows - start).max(axis=1)
    return Goal(rows[int(away.argmin())], pose, True, tuple(findings))


def _with_signs(rows: Reals, turn: int) -> Reals | None:
    """The solutions whose joints have the signs that KRL's Turn gives: bit i - 1 is set where axis i is below 0."""
    below = np.array([(turn >> i) & 1 for i in range(rows.shape[1])], bool)
    met = ((rows < 0) == below) | (np.abs(rows) < SIGN_ZERO)
    kept = met.all(axis=1)
    return rows[kept] if kept.any() else None
