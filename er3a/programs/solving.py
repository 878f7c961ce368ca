"""Ways of the tool, joints along them, and where the motions of a sequence leave the arm."""

from __future__ import annotations

import math

import numpy as np

from er3a.errors import PoseError
from er3a.geometry.vectors import wrap_to_pi
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.singularity import factors_where_defined
from er3a.numerics.arrays import Flags, Reals
from er3a.planning.moves import Segment, line
from er3a.planning.sequences import arc
from er3a.programs.evaluation import Position
from er3a.programs.instructions import ArmMotion, JointTarget, MeantSolution, NamedFrame, PoseTarget, UnresolvedTarget
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

STEP_M, STEP_RAD = 0.02, 0.1
MAX_STEPS = 10_000  # on a way that no arm can take
WIDE_STEP = 0.15  # rad or m, of a joint from one pose to the next, which are near to each other
ON_POSE = 1e-6  # m, and of the elements of a rotation matrix
AT_A_CHANGE = math.radians(1.0)
ROUNDED = 1e-5  # m, and of the elements of a rotation matrix that a program gives with six digits
TURNS = np.linspace(-2 * np.pi, 2 * np.pi, 65)  # four in each quarter
NO_SIDE = 1e-9  # m or rad, of a signed distance that is on no side
Frames = tuple[NamedFrame, NamedFrame]


def way_of(start: Reals, via: Reals | None, end: Reals) -> Segment | None:
    """The line between two poses of the tool, or the arc through a point.

    Parameters
    ----------
    start, via, end : (4, 4), m; a line without ``via``, of which only the position counts

    Returns
    -------
    way : over 1 s; None where the points fix no circle, or a pose is no rigid transform
    """
    try:
        return line(start, end, 1.0) if via is None else arc(start, via[:3, 3], end, 1.0)
    except PoseError:
        return None


def joints_along(robot: Robot, poses: Reals, start: Reals) -> Reals:
    """Joints along poses of the tool, each the solution nearest to the joints before, whatever the limits.

    Parameters
    ----------
    poses : (N, 4, 4), T_world_tool in m, near to each other
    start : (n,), rad or m

    Returns
    -------
    q : (k, n), rad or m, of the first k poses; k is less than N where a pose has no solution. Whoever calls this looks
        at how far the joints move from one pose to the next.

    Notes
    -----
    Where the nearest solution is far, the pose is solved again from the joints before, which decide what is free in a
    singular pose.
    """
    found = inverse_batch(robot, poses, start)
    rows: list[Reals] = []
    q = start
    for pose, solutions, solved in zip(poses, found.q, found.solved):
        best = _nearest(solutions[solved], q)
        if best is not None and np.abs(best - q).max() > WIDE_STEP:
            again = inverse_batch(robot, pose[None], q)
            best = _nearest(again.q[0][again.solved[0]], q)
        if best is None:
            break
        rows.append(best)
        q = best
    made = np.array(rows).reshape(-1, robot.joints)
    off = np.abs(forward(robot, made) - poses[: len(made)]).max(axis=(1, 2), initial=0.0)
    return made if (off < ON_POSE).all() else made[: int(np.argmax(off >= ON_POSE))]


def _nearest(solutions: Reals, q: Reals) -> Reals | None:
    """Of solutions (k, n) the nearest to joints (n,), with whole turns added."""
    if not len(solutions):
        return None
    step = wrap_to_pi(solutions - q)
    found: Reals = q + step[int(np.abs(step).max(axis=1).argmin())]
    return found


def solutions_meant(branch: MeantSolution, robot: Robot, rows: Reals, quarters_off: float = AT_A_CHANGE) -> Flags:
    """Which of joint vectors (k, n) in rad, solutions of one target, are meant: (k,).

    ``quarters_off`` (rad) is how far a joint may be from the quarter of a turn that is stated for it.

    Where none is exactly, joints within ``AT_A_CHANGE`` of where their sign or quarter changes belong to both sides:
    the program rounds its numbers, and no arm is exactly as its table. The wrist centre's sides are compared with those
    in the arm's zero pose; what has no side there, or has no such sides at all, as an arm without a spherical wrist, is
    not checked.
    """
    in_quarters = np.isfinite(branch.ranges).all(axis=1)
    for beside in (np.zeros(len(branch.ranges)), np.where(in_quarters, quarters_off, AT_A_CHANGE)):
        within = (rows >= branch.ranges[:, 0] - beside) & (rows <= branch.ranges[:, 1] + beside)
        met: Flags = np.asarray(within.all(axis=1), np.bool_)
        if met.any():
            break
    if branch.behind_axis_1 is None and branch.behind_lower_arm is None:
        return met
    zero = factors_where_defined(robot, np.zeros((1, robot.joints)))
    found = factors_where_defined(robot, rows)
    for behind, there, here in (
        (branch.behind_axis_1, zero.shoulder[0], found.shoulder),
        (branch.behind_lower_arm, zero.elbow[0], found.elbow),
    ):
        if behind is not None and abs(there) > NO_SIDE:
            met = met & (((here * there < 0) == behind) | (np.abs(here) < NO_SIDE))
    return met


def rows_meant(
    branch: MeantSolution, robot: Robot, pose: Reals, rows: Reals, quarters_off: float = AT_A_CHANGE
) -> tuple[Reals, bool]:
    """The solutions of a pose that are meant.

    Parameters
    ----------
    pose : (4, 4), T_world_tool, m
    rows : (k, n), rad or m, its solutions
    quarters_off : as of :func:`solutions_meant`

    Returns
    -------
    rows, met : those that are meant, or all if none is, and whether there are any

    Notes
    -----
    With two axes in line only the sum of their joints follows from the pose. A program that rounds its numbers misses
    such a pose by its last digit, and one solution is left of all. So joints turn against each other, too, in the
    direction that moves the tool least, as long as the pose stays the same but for those digits.
    """
    met = solutions_meant(branch, robot, rows, quarters_off)
    if not met.any():
        least = np.linalg.svd(jacobian(robot, rows))[2][:, -1]
        turns = TURNS[:, None, None] * least / np.abs(least).max(axis=1, keepdims=True)
        turned = (rows + turns).reshape(-1, robot.joints)
        stays = np.abs(forward(robot, turned) - pose).max(axis=(1, 2)) < ROUNDED
        turned = turned[stays & within(robot, turned)]
        if len(turned) and (met := solutions_meant(branch, robot, turned, quarters_off)).any():
            rows = turned
    return (rows[met], True) if met.any() else (rows, False)


class Resolver:
    """Follows a sequence and knows where the arm is; joints are solved when they are needed.

    Parameters
    ----------
    robot : None if there is none; then joints come from joint targets alone, and poses from poses
    start : (n,), rad, where the sequence starts
    """

    def __init__(self, robot: Robot | None, start: Reals | None):
        self.arm = None if robot is None else robot.without_tool().replace(base=np.eye(4))
        arm = self.arm
        self.flange = None if arm is None else lambda joints: forward(arm, joints)
        self.start, self.here = start, Position(start)
        self.motions: list[tuple[ArmMotion, Reals | None]] = []  # with the pose before
        self._solved: list[Reals | None] = []

    def ready(self, motion: ArmMotion) -> tuple[Reals | None, Reals | None, Reals | None]:
        """The start, the end and the point of a motion; the arm is at its end then.

        Parameters
        ----------
        motion : the next of the sequence

        Returns
        -------
        pose_before, pose, via : (4, 4), m, in the motion's base for its tool; None where they can't be known
        """
        frames = (motion.tool, motion.base)
        before = self.here.seen(*frames, self.flange)
        self.motions.append((motion, before))
        here = self.here.after(motion)
        if isinstance(motion.target, JointTarget):
            here = Position(self.joints_after(len(self.motions) - 1), None, *frames)
        target = motion.target.pose if isinstance(motion.target, PoseTarget) else None
        via = motion.via.pose if isinstance(motion.via, PoseTarget) else None
        if isinstance(motion.via, JointTarget):
            via = Position(motion.via.joints).seen(*frames, self.flange)
        self.here = here
        return before, here.seen(*frames, self.flange) if target is None else target, via

    def joints_after(self, number: int) -> Reals | None:
        """Joints after a motion of the sequence.

        Parameters
        ----------
        number : of the motion, from 0; -1 for the start

        Returns
        -------
        q : (n,), rad; None where they are not known. Motions before it are solved first, because they decide the
            branch.
        """
        if number < 0:
            return self.start
        motion, _ = self.motions[number]
        target = motion.target
        if isinstance(target, JointTarget) and not np.isnan(target.joints).any():
            return target.joints
        while len(self._solved) <= number:
            before = self.joints_after(len(self._solved) - 1)
            self._solved.append(self._end(*self.motions[len(self._solved)], before))
        return self._solved[number]

    def along(self, poses: Reals, frames: Frames, start: Reals | None) -> Reals | None:
        """Joints along poses of the tool.

        Parameters
        ----------
        poses : (k, 4, 4), m, in a base for a tool, near to each other
        start : (n,), rad; None where it is not known

        Returns
        -------
        q : (k, n), rad; None if the arm does not come to all of them within its limits
        """
        tool, base = frames
        if self.arm is None or tool.pose is None or base.pose is None or start is None:
            return None
        q = joints_along(self.arm, base.pose @ poses @ np.linalg.inv(tool.pose), start)
        return q if len(q) == len(poses) and within(self.arm, q).all() else None

    def _goal(self, pose: Reals, frames: Frames, near: Reals | None, branch: MeantSolution | None) -> Reals | None:
        """The solution of a pose within the limits that is meant, or of several the nearest."""
        tool, base = frames
        if self.arm is None or tool.pose is None or base.pose is None:
            return None
        reference = np.zeros(self.arm.joints) if near is None else near
        try:
            at_flange = base.pose @ pose @ np.linalg.inv(tool.pose)
            found = inverse_batch(self.arm, at_flange[None], reference)
        except PoseError:
            return None
        rows = found.q[0][found.solved[0] & found.within_limits[0]]
        if branch is not None and len(rows):
            rows, _ = rows_meant(branch, self.arm, at_flange, rows)
        return rows[int(np.abs(rows - reference).max(axis=1).argmin())] if len(rows) else None

    def _end(self, motion: ArmMotion, pose_before: Reals | None, before: Reals | None) -> Reals | None:
        """Joints (n,) in rad at a motion's end; those of a line or arc come from following its way."""
        target = motion.target
        if isinstance(target, UnresolvedTarget):
            return None
        if isinstance(target, JointTarget):
            return None if before is None else np.where(np.isnan(target.joints), before, target.joints)
        if target.joints is not None:
            return target.joints
        frames = (motion.tool, motion.base)
        if motion.kind == "joint" or before is None or pose_before is None:
            branch = target.branch if motion.kind == "joint" else None
            return self._goal(target.pose, frames, before if target.near is None else target.near, branch)
        via = motion.via.pose if motion.kind == "arc" and isinstance(motion.via, PoseTarget) else None
        way = way_of(pose_before, via, target.pose)
        if way is None:
            return None
        count = math.ceil(min(max(way.length / STEP_M, way.turned / STEP_RAD, 1), MAX_STEPS))
        rows = self.along(way.poses(np.arange(1, count + 1) / count), frames, before)
        return None if rows is None else rows[-1]
