"""Where the arm stands while a program runs, as far as the program's text and the arm's table tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from er3a.by_value import ByValue
from er3a.numerics.arrays import Reals
from er3a.programs.arm_joints import MOST_ROBOT_AXES
from er3a.programs.circle import arc_end
from er3a.programs.instructions import ArmMotion, JointTarget, NamedFrame, PoseTarget

NO_FRAME = NamedFrame()

Flange = Callable[[Reals], Reals]
"""T_robot_flange (4, 4) of joint angles (n,) in rad."""


@dataclass(frozen=True, eq=False)
class Cell(ByValue):
    """What is known of the cell that a program runs in.

    Attributes
    ----------
    flange : forward kinematics of the arm; None if no arm is given
    start : (n,), rad, joints where the program starts
    joints : n, how many the arm has
    frames : poses (4, 4) of tools and bases by the program's names for them
    tool, base : (4, 4), for motions whose program sets none; None if no arm is given
    """

    flange: Flange | None = None
    start: Reals | None = None
    joints: int = MOST_ROBOT_AXES
    frames: Mapping[str, Reals] = field(default_factory=dict)
    tool: Reals | None = None
    base: Reals | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Position:
    """Where the arm stands.

    Attributes
    ----------
    joints : (n,), rad; None where unknown
    pose : T_base_tool (4, 4), in ``base`` for ``tool``; None where it is known only through ``joints``
    """

    joints: Reals | None = None
    pose: Reals | None = None
    tool: NamedFrame = NO_FRAME
    base: NamedFrame = NO_FRAME

    def after(self, motion: ArmMotion, flange: Flange | None) -> Position:
        """Where the arm stands behind a motion."""
        target = motion.target
        if motion.angle is not None:
            return self._after_arc(motion, motion.angle, flange)
        if isinstance(target, JointTarget):
            kept = np.isnan(target.joints)
            if not kept.any():
                return Position(target.joints, None, motion.tool, motion.base)
            if kept.all():
                return self
            if self.joints is None:
                return Position()
            return Position(np.where(kept, self.joints, target.joints), None, motion.tool, motion.base)
        if isinstance(target, PoseTarget):
            return Position(target.joints, target.pose, motion.tool, motion.base)
        return Position()

    def _after_arc(self, motion: ArmMotion, angle: float, flange: Flange | None) -> Position:
        """Behind an arc with an angle of its own."""
        start = self.seen(motion.tool, motion.base, flange)
        poses = isinstance(motion.target, PoseTarget) and isinstance(motion.via, PoseTarget)
        if start is None or not poses or not math.isfinite(angle):
            return Position()
        assert isinstance(motion.target, PoseTarget)
        assert isinstance(motion.via, PoseTarget)
        end = arc_end(start, motion.via.pose, motion.target.pose, angle)
        return Position() if end is None else Position(None, end, motion.tool, motion.base)

    def seen(self, tool: NamedFrame, base: NamedFrame, flange: Flange | None) -> Reals | None:
        """T_base_tool (4, 4) for this tool and base, or None if it can't be known."""
        if self.pose is not None and same(tool, self.tool) and same(base, self.base):
            return self.pose
        here = self._flange(flange)
        if here is None or tool.pose is None or base.pose is None:
            return None
        found: Reals = np.linalg.inv(base.pose) @ here @ tool.pose
        return found

    def _flange(self, flange: Flange | None) -> Reals | None:
        if self.joints is not None and flange is not None:
            return flange(self.joints)
        if self.pose is None or self.tool.pose is None or self.base.pose is None:
            return None
        found: Reals = self.base.pose @ self.pose @ np.linalg.inv(self.tool.pose)
        return found

    def key(self) -> tuple[bytes, ...]:
        """Equal for equal positions."""
        frames = (self.tool, self.base) if self.pose is not None else ()
        parts = (self.joints, self.pose, *(frame.pose for frame in frames))
        words = tuple(frame.name.encode() for frame in frames)
        return (*(b"" if part is None else part.tobytes() for part in parts), *words)


def same(a: NamedFrame, b: NamedFrame) -> bool:
    """Whether two frames are one."""
    if a.pose is not None and b.pose is not None:
        return bool(np.array_equal(a.pose, b.pose))
    return a.name == b.name and a.pose is None and b.pose is None
