"""Joints and poses of a sequence's targets, by the arm's table: what a writer needs beside the targets themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from er3a.errors import PoseError
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.solutions import Solutions
from er3a.numerics.arrays import Reals
from er3a.programs.circle import arc_length, arc_poses
from er3a.programs.instructions import ArmMotion, Instruction, JointTarget, NamedFrame, PoseTarget
from er3a.robots.robot import Robot

STEP_M, STEP_RAD = 0.02, 0.1
MOST_STEPS = 10_000  # on a way that no arm can take
MOST_AT_ONCE = 2_000  # motions whose joints are solved together
MOST_ROUNDS = 10  # over them

Frames = tuple[NamedFrame, NamedFrame]


@dataclass(frozen=True, eq=False)
class ReadyMotion:
    """A motion with all that is known of its start and end.

    Attributes
    ----------
    number : among the motions of its sequence
    pose, pose_before, via : (4, 4), m, in its base for its tool; None where unknown
    """

    motion: ArmMotion
    resolver: Resolver
    number: int
    pose: Reals | None
    pose_before: Reals | None
    via: Reals | None = None

    @property
    def joints(self) -> Reals | None:
        """Joints (n,) in rad at its end; None where unknown."""
        return self.resolver.joints_behind(self.number)

    @property
    def joints_before(self) -> Reals | None:
        """Joints (n,) in rad at its start; None where unknown."""
        return self.resolver.joints_behind(self.number - 1)

    @property
    def length(self) -> float | None:
        """Length of the tool point's way, m; for a joint motion of the straight line between its ends."""
        if self.pose is None or self.pose_before is None:
            return None
        if self.motion.kind == "arc" and self.via is not None:
            return arc_length(self.pose_before, self.via, self.pose)
        return float(np.linalg.norm(self.pose[:3, 3] - self.pose_before[:3, 3]))


class Resolver:
    """Follows a sequence and knows where the arm is; joints are solved when they are asked for, many at a time.

    Parameters
    ----------
    robot : None if there is none; then joints come from joint targets alone, and poses from poses
    start : (n,), rad, where the sequence starts
    """

    def __init__(self, robot: Robot | None, start: Reals | None):
        self.arm = None if robot is None else robot.without_tool().replace(base=np.eye(4))
        self.start = start
        self.motions: list[tuple[ArmMotion, Reals | None]] = []  # with the pose before
        self.pose: Reals | None = None
        self._solved: list[Reals | None] = []

    def ready(self, motion: ArmMotion) -> ReadyMotion:
        """A motion with its start and end; the arm is at its end then."""
        frames = (motion.tool, motion.base)
        pose_before = self._pose_in(frames)
        number = len(self.motions)
        self.motions.append((motion, pose_before))
        target = motion.target
        if isinstance(target, PoseTarget):
            self.pose = target.pose
        else:
            joints = self.joints_behind(number) if isinstance(target, JointTarget) else None
            self.pose = None if joints is None else self._forward(joints, frames)
        via = motion.via.pose if isinstance(motion.via, PoseTarget) else None
        if isinstance(motion.via, JointTarget):
            via = self._forward(motion.via.joints, frames)
        ready = ReadyMotion(motion, self, number, self.pose, pose_before, via)
        if motion.angle is not None:
            self.pose = None
        return ready

    def joints_behind(self, number: int) -> Reals | None:
        """Joints (n,) in rad behind a motion; -1 for the start."""
        if number < 0:
            return self.start
        motion, _ = self.motions[number]
        given = motion.target.joints if isinstance(motion.target, JointTarget) and motion.angle is None else None
        if given is not None and not np.isnan(given).any():
            return given
        while len(self._solved) <= number:
            self._solve_next()
        return self._solved[number]

    def solve(self, poses: Reals, frames: Frames, near: Reals | None) -> list[Reals | None]:
        """Joints (n,) of poses (k, 4, 4) one after another, each nearest to those before and within the limits.

        The list ends behind the first pose that has none, with None.
        """
        flanges = self._flanges_of(poses, frames)
        if self.arm is None or flanges is None:
            return [None]
        reference = np.zeros(self.arm.joints) if near is None else near
        references = np.tile(reference, (len(flanges), 1))
        chain: list[Reals] = []
        for _ in range(MOST_ROUNDS):  # until each pose is solved with the joints before it as reference
            try:
                chain = _chain(inverse_batch(self.arm, flanges, references), reference)
            except PoseError:
                return [None]
            before = np.stack([reference, *chain])[: len(flanges)]
            if np.array_equal(references[: len(before)], before):
                break
            references[: len(before)] = before
        return [*chain, None] if len(chain) < len(flanges) else list(chain)

    def _solve_next(self) -> None:
        """Solve the next motion, and with it those behind it that are lines and arcs to poses."""
        first = len(self._solved)
        motion, pose_before = self.motions[first]
        near = self.joints_behind(first - 1)
        if motion.angle is not None:
            self._solved.append(None)
        elif not _is_followed(motion) or near is None or pose_before is None:
            self._solved.append(self._end(motion, near))
        else:
            self._solve_ways(first, near)

    def _solve_ways(self, first: int, near: Reals) -> None:
        frames = _frames(self.motions[first][0])
        ways: list[Reals] = []
        for motion, pose_before in self.motions[first : first + MOST_AT_ONCE]:
            if not _is_followed(motion) or pose_before is None or not _same(frames, _frames(motion)):
                break
            ways.append(_between(motion, pose_before))
        ends = np.cumsum([len(way) for way in ways]) - 1
        found = self.solve(np.concatenate(ways), frames, near)
        self._solved += [found[end] for end in ends.tolist() if end < len(found)] or [None]
        if len(found) <= ends[-1] and self._solved[-1] is not None:
            self._solved.append(None)

    def _end(self, motion: ArmMotion, before: Reals | None) -> Reals | None:
        target = motion.target
        if isinstance(target, JointTarget):
            joints = target.joints
            if not np.isnan(joints).any():
                return joints
            return None if before is None else np.where(np.isnan(joints), before, joints)
        if not isinstance(target, PoseTarget) or target.joints is not None:
            return getattr(target, "joints", None)
        near = before if target.near is None else target.near
        return self.solve(target.pose[None], _frames(motion), near)[0]

    def _pose_in(self, frames: Frames) -> Reals | None:
        """Where the tool is, in a base for a tool."""
        if not self.motions:
            return None if self.start is None else self._forward(self.start, frames)
        last, _ = self.motions[-1]
        if isinstance(last.target, JointTarget):
            joints = self.joints_behind(len(self.motions) - 1)
            return None if joints is None else self._forward(joints, frames)
        old = _frames(last)
        return self.pose if self.pose is None or _same(old, frames) else _changed(self.pose, old, frames)

    def _forward(self, joints: Reals, frames: Frames) -> Reals | None:
        tool, base = frames
        if self.arm is None or tool.pose is None or base.pose is None:
            return None
        found: Reals = np.linalg.inv(base.pose) @ forward(self.arm, joints) @ tool.pose
        return found

    def _flanges_of(self, poses: Reals, frames: Frames) -> Reals | None:
        tool, base = frames
        if tool.pose is None or base.pose is None:
            return None
        found: Reals = base.pose @ poses @ np.linalg.inv(tool.pose)
        return found


def _frames(motion: ArmMotion) -> Frames:
    return motion.tool, motion.base


def _same(a: Frames, b: Frames) -> bool:
    return all(one.name == other.name and one.pose is other.pose for one, other in zip(a, b))


def _is_followed(motion: ArmMotion) -> bool:
    """Whether the joints at a motion's end come from following its way."""
    target = motion.target
    given = isinstance(target, PoseTarget) and target.joints is None and target.near is None
    return given and motion.kind != "joint" and motion.angle is None


def _chain(found: Solutions, reference: Reals) -> list[Reals]:
    """The solution of each pose that is nearest to the one before, up to the first pose that has none."""
    chain: list[Reals] = []
    rows = np.where((found.solved & found.within_limits)[..., None], found.q, np.inf)
    for solutions in rows:
        away = np.abs(solutions - reference).max(axis=1)
        best = int(away.argmin())
        if not np.isfinite(away[best]):
            break
        reference = solutions[best]
        chain.append(reference)
    return chain


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


def _changed(pose: Reals, old: Frames, new: Frames) -> Reals | None:
    parts = [frame.pose for frame in (*old, *new)]
    tool, base, new_tool, new_base = parts
    if tool is None or base is None or new_tool is None or new_base is None:
        return None
    found: Reals = np.linalg.inv(new_base) @ base @ pose @ np.linalg.inv(tool) @ new_tool
    return found


def _between(motion: ArmMotion, start: Reals) -> Reals:
    """Poses (k, 4, 4) on the way and at its end, near enough to each other that the arm's branch is the same."""
    assert isinstance(motion.target, PoseTarget)
    end = motion.target.pose
    turn = scipy.spatial.transform.Rotation.from_matrix(end[:3, :3] @ start[:3, :3].T).as_rotvec()
    way = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    count = int(min(max(way / STEP_M, float(np.linalg.norm(turn)) / STEP_RAD, 1), MOST_STEPS)) + 1
    shares = np.arange(1, count + 1) / count
    poses = None
    if motion.kind == "arc" and isinstance(motion.via, PoseTarget):
        poses = arc_poses(start, motion.via.pose, end, shares)
    if poses is None:
        poses = np.tile(np.eye(4), (count, 1, 1))
        poses[:, :3, 3] = start[:3, 3] + shares[:, None] * (end[:3, 3] - start[:3, 3])
        turns = scipy.spatial.transform.Rotation.from_rotvec(shares[:, None] * turn).as_matrix()
        poses[:, :3, :3] = turns @ start[:3, :3]
    poses[-1] = end
    return poses
