"""Joints and poses of a sequence's targets, by the arm's table: what a writer needs beside the targets themselves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy

from er3a.errors import PoseError
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.numerics.arrays import Reals
from er3a.programs.circle import arc_length, arc_poses
from er3a.programs.instructions import ArmMotion, Instruction, JointTarget, NamedFrame, PoseTarget
from er3a.robots.robot import Robot

STEP_M, STEP_RAD = 0.02, 0.1
MOST_STEPS = 10_000  # on a way that no arm can take
SAME_NUMBERS = 1e-12


@dataclass(frozen=True, eq=False)
class ReadyMotion:
    """A motion with all that is known of its start and end.

    Attributes
    ----------
    joints, joints_before : (6,), rad, at its end and start; None where unknown
    pose, pose_before, via : (4, 4), m, in its base for its tool; None where unknown
    """

    motion: ArmMotion
    joints: Reals | None
    pose: Reals | None
    joints_before: Reals | None
    pose_before: Reals | None
    via: Reals | None = None

    @property
    def length(self) -> float | None:
        """Length of the tool point's way, m; for a joint motion of the straight line between its ends."""
        if self.pose is None or self.pose_before is None:
            return None
        if self.motion.kind == "arc" and self.via is not None:
            return arc_length(self.pose_before, self.via, self.pose)
        return float(np.linalg.norm(self.pose[:3, 3] - self.pose_before[:3, 3]))


class Resolver:
    """Follows a sequence and knows where the arm is.

    Parameters
    ----------
    robot : None if there is none; then joints come from joint targets alone, and poses from poses
    start : (6,), rad, where the sequence starts
    """

    def __init__(self, robot: Robot | None, start: Reals | None):
        self.arm = None if robot is None else robot.without_tool().replace(base=np.eye(4))
        self.joints = start
        self.pose: Reals | None = None
        self.frames = (NamedFrame(), NamedFrame())

    def ready(self, motion: ArmMotion) -> ReadyMotion:
        """A motion with its start and end; the arm is at its end then."""
        frames = (motion.tool, motion.base)
        joints_before = self.joints
        pose_before = self.pose_in(frames)
        joints, pose = self._end(motion, frames, pose_before)
        via = motion.via.pose if isinstance(motion.via, PoseTarget) else None
        if isinstance(motion.via, JointTarget):
            via = self._forward(motion.via.joints, frames)
        self.joints, self.pose, self.frames = joints, pose, frames
        if motion.angle is not None:
            self.joints = self.pose = None
        return ReadyMotion(motion, joints, pose, joints_before, pose_before, via)

    def pose_in(self, frames: tuple[NamedFrame, NamedFrame]) -> Reals | None:
        """Where the tool is, in a base for a tool."""
        if self.joints is not None and self.arm is not None:
            return self._forward(self.joints, frames)
        same = all(a.name == b.name and a.pose is b.pose for a, b in zip(frames, self.frames))
        return self.pose if same or self.pose is None else _changed(self.pose, self.frames, frames)

    def solve(self, pose: Reals, frames: tuple[NamedFrame, NamedFrame], near: Reals | None) -> Reals | None:
        """Joints (6,) of a pose, nearest to others, within the limits; None if there are none."""
        flange = self._flange_of(pose, frames)
        if self.arm is None or flange is None:
            return None
        try:
            solutions = inverse(self.arm, flange, near)
        except PoseError:
            return None
        rows = solutions.q[solutions.within_limits]
        if not len(rows):
            return None
        away = np.abs(rows - (np.zeros(6) if near is None else near)).max(axis=1)
        found: Reals = rows[int(away.argmin())]
        return found

    def _end(
        self, motion: ArmMotion, frames: tuple[NamedFrame, NamedFrame], pose_before: Reals | None
    ) -> tuple[Reals | None, Reals | None]:
        target = motion.target
        if isinstance(target, JointTarget):
            joints = target.joints
            if np.isnan(joints).any():
                if self.joints is None:
                    return None, None
                joints = np.where(np.isnan(joints), self.joints, joints)
            return joints, self._forward(joints, frames)
        if not isinstance(target, PoseTarget):
            return None, None
        if target.joints is not None:
            return target.joints, target.pose
        near = self.joints if target.near is None else target.near
        if motion.kind != "joint" and near is not None and pose_before is not None:
            for pose in _between(motion, pose_before, target.pose):
                near = self.solve(pose, frames, near)
                if near is None:
                    return None, target.pose
        return self.solve(target.pose, frames, near), target.pose

    def _forward(self, joints: Reals, frames: tuple[NamedFrame, NamedFrame]) -> Reals | None:
        tool, base = frames
        if self.arm is None or tool.pose is None or base.pose is None:
            return None
        found: Reals = np.linalg.inv(base.pose) @ forward(self.arm, joints) @ tool.pose
        return found

    def _flange_of(self, pose: Reals, frames: tuple[NamedFrame, NamedFrame]) -> Reals | None:
        tool, base = frames
        if tool.pose is None or base.pose is None:
            return None
        found: Reals = base.pose @ pose @ np.linalg.inv(tool.pose)
        return found


def with_default_frames(instruction: Instruction, robot: Robot | None) -> Instruction:
    """A motion whose tool or base is not given at all, with the robot's own tool and base."""
    if not isinstance(instruction, ArmMotion) or robot is None:
        return instruction
    tool, base = instruction.tool, instruction.base
    if not tool.name and tool.pose is None:
        tool = NamedFrame("", robot.tool)
    if not base.name and base.pose is None:
        base = NamedFrame("", np.eye(4))
    return replace(instruction, tool=tool, base=base)


def _changed(pose: Reals, old: tuple[NamedFrame, NamedFrame], new: tuple[NamedFrame, NamedFrame]) -> Reals | None:
    parts = [frame.pose for frame in (*old, *new)]
    tool, base, new_tool, new_base = parts
    if tool is None or base is None or new_tool is None or new_base is None:
        return None
    found: Reals = np.linalg.inv(new_base) @ base @ pose @ np.linalg.inv(tool) @ new_tool
    return found


def _between(motion: ArmMotion, start: Reals, end: Reals) -> Iterator[Reals]:
    """Poses on the way, near enough to each other that the arm's branch is the same."""
    turn = scipy.spatial.transform.Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    way = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    count = int(min(max(way / STEP_M, float(np.linalg.norm(turn)) / STEP_RAD, 1), MOST_STEPS)) + 1
    shares = np.arange(1, count) / count
    if motion.kind == "arc" and isinstance(motion.via, PoseTarget):
        poses = arc_poses(start, motion.via.pose, end, shares)
        if poses is not None:
            yield from poses
            return
    for share in shares:
        pose = np.eye(4)
        pose[:3, 3] = start[:3, 3] + share * (end[:3, 3] - start[:3, 3])
        pose[:3, :3] = scipy.spatial.transform.Rotation.from_rotvec(share * turn).as_matrix() @ start[:3, :3]
        yield pose
