"""A line as an arm follows it: joint angles at any point of the way, and their derivatives through the Jacobian.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, sections 3.5 and 3.6 (equations 3.46, 3.98).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.by_value import ByValue
from er3a.kinematics.forward import jacobian
from er3a.kinematics.singularity import characteristic_length, conditioning, determinant_factors
from er3a.kinematics.wrist_partitioned import parallel_axes_arm, solve_slots
from er3a.numerics.arrays import Integers, Reals
from er3a.planning.branch_tracking import FREE_SHOULDER, FREE_WRIST, align_wrist, onto_axis_1, turned_difference
from er3a.planning.moves import ToolPath
from er3a.robots.robot import Robot

REGULAR = 1e-6  # smallest singular value (scaled) down to which the Jacobian is solved
BESIDE = (1e-4, 1e-3)  # shares of the way to step aside from a singular point
AGREE = 1e-2  # relative, between the two sides of a singular point
JACOBIAN_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class BranchJump(ByValue):
    """A place where the branch in use ends and no other continues it.

    Attributes
    ----------
    t : s; joint : 1..6, the one that would have to move farthest; angle : rad
    """

    t: float
    joint: int
    angle: float


@dataclass(frozen=True, eq=False)
class Followed(ByValue):
    """Joint angles along a line.

    Attributes
    ----------
    t : (N,), s, rising; progress : (N,), share of the way (0..1)
    q : (N, 6), rad, manufacturer's angles, continuous but for ``jumps``; NaN where no branch reaches the pose
    slot : (N,) int, closed-form branch; -1 where none
    start_turn : (6,), rad, turn at rest from the given start joints to the beginning; not 0 only at a singular start
    jumps : changes of branch that no continuous motion makes
    """

    robot: Robot
    line: ToolPath
    t: Reals
    progress: Reals
    q: Reals
    slot: Integers
    start_turn: Reals
    jumps: tuple[BranchJump, ...]

    def joints(self, t: Reals) -> Reals:
        """Joint angles (..., 6) in rad at times (...,) in s; NaN where unreachable."""
        return self.joints_at(self.line.progress(t)[0])

    def joints_at(self, progress: Reals) -> Reals:
        """Joint angles (..., 6) in rad at shares of the way (...,); NaN where unreachable."""
        progress = np.asarray(progress, float)
        return self._solve(progress.reshape(-1)).reshape(*progress.shape, 6)

    def _solve(self, progress: Reals) -> Reals:
        robot = self.robot
        right = np.clip(np.searchsorted(self.progress, progress, side="right"), 1, len(self.progress) - 1)
        left = right - 1
        span = self.progress[right] - self.progress[left]
        weight = np.where(span > 0, (progress - self.progress[left]) / np.where(span > 0, span, 1.0), 0.0)[:, None]
        a, b = self.q[left], self.q[right]
        a, b = np.where(np.isnan(a), b, a), np.where(np.isnan(b), a, b)
        guess = (1 - weight) * a + weight * b
        known = np.isfinite(guess[:, 0])
        q_ref = np.where(known[:, None], guess, 0.0)
        T = self.line.poses(progress)
        q = self._nearest(solve_slots(robot, T, q_ref)[0], q_ref, self.slot[left], self.slot[right])
        q[~known] = np.nan
        if parallel_axes_arm(robot) is not None:  # the reference has told what is free
            return q
        factors = determinant_factors(robot, q)
        on_axis = np.abs(factors.shoulder) < FREE_SHOULDER
        if on_axis.any():
            again = solve_slots(robot, onto_axis_1(robot, T[on_axis]), q_ref[on_axis])[0]
            slots = self.slot[left][on_axis], self.slot[right][on_axis]
            q[on_axis] = self._nearest(again, q_ref[on_axis], *slots)
        aligned = np.abs(factors.wrist) < FREE_WRIST
        if aligned.any():
            q[aligned] = align_wrist(robot, q[aligned], q_ref[aligned, 3])
            q[aligned] = q_ref[aligned] + turned_difference(q_ref[aligned], q[aligned])
        return q

    @staticmethod
    def _nearest(q: Reals, q_ref: Reals, slot_a: Integers, slot_b: Integers) -> Reals:
        """Of the branches (n, 8, 6) in use on either side, the nearer to q_ref (n, 6), by the nearest turns."""
        rows = np.arange(len(q))
        both = np.stack([q[rows, slot_a], q[rows, slot_b]], axis=1)
        both[np.stack([slot_a, slot_b], axis=1) < 0] = np.nan
        step = turned_difference(q_ref[:, None], both)
        distance = np.abs(step).max(axis=-1)
        best = np.argmin(np.where(np.isnan(distance), np.inf, distance), axis=1)
        nearest: Reals = q_ref + step[rows, best]
        return nearest

    def derivatives(self, progress: Reals) -> tuple[Reals, Reals, Reals]:
        """Joint angles and their first and second derivative by progress, at shares of the way (n,) [1]_.

        With the tool's twist per unit of progress, J q' = twist and J q'' = twist' - J' q'. Where the Jacobian is
        singular, the derivatives are those just beside, if both sides agree; else NaN: no finite joint speed follows
        the line through there.

        Returns
        -------
        q, dq, ddq : (n, 6), rad
        """
        q = self.joints_at(progress)
        dq, ddq = self.through_jacobian(q, progress)
        for aside in BESIDE:
            rows = np.flatnonzero(np.isnan(dq[:, 0]) & np.isfinite(q[:, 0]))
            if rows.size:
                dq[rows], ddq[rows] = self._beside(progress[rows], aside)
        return q, dq, ddq

    def rates(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Joint angles (rad), velocities (rad/s) and accelerations (rad/s^2) at times (n,) in s; each (n, 6)."""
        progress, speed, acceleration = (part[:, None] for part in self.line.progress(np.asarray(t, float)))
        q, dq, ddq = self.derivatives(progress[:, 0])
        return q, dq * speed, ddq * speed**2 + dq * acceleration

    @property
    def _size(self) -> float:
        """Size of the line in rad, for comparing derivatives."""
        return self.line.length / characteristic_length(self.robot) + self.line.turned

    def _beside(self, progress: Reals, aside: float) -> tuple[Reals, Reals]:
        """Derivatives on both sides of points of the way, averaged where they agree; NaN elsewhere."""
        before = np.where(progress < aside, progress + aside, progress - aside)
        after = np.where(progress > 1 - aside, progress - aside, progress + aside)
        sides = [self.through_jacobian(self.joints_at(side), side) for side in (before, after)]
        merged = []
        for a, b in zip(*sides):
            scale = np.maximum(np.abs(a).max(axis=1), np.abs(b).max(axis=1)) + self._size
            agree = np.abs(a - b).max(axis=1) <= AGREE * scale
            merged.append(np.where(agree[:, None], (a + b) / 2, np.nan))
        return merged[0], merged[1]

    def through_jacobian(self, q: Reals, progress: Reals) -> tuple[Reals, Reals]:
        """First and second derivative of joints (n, 6) by progress; NaN where the Jacobian is singular."""
        length = characteristic_length(self.robot)
        dq, ddq = np.full_like(q, np.nan), np.full_like(q, np.nan)
        rows = np.flatnonzero(np.isfinite(q[:, 0]))
        smallest = conditioning(self.robot, q[rows], length).smallest_singular_value
        rows = rows[smallest > REGULAR]
        scale = np.array([1 / length] * 3 + [1.0] * 3)[:, None]
        J = jacobian(self.robot, q[rows]) * scale
        twist, slope = (part[..., None] * scale for part in self.line.twists(progress[rows]))
        first = np.linalg.solve(J, twist)
        step = JACOBIAN_STEP / np.maximum(1.0, np.abs(first).max(axis=1, keepdims=True))
        ahead = jacobian(self.robot, q[rows] + (step * first)[..., 0])
        behind = jacobian(self.robot, q[rows] - (step * first)[..., 0])
        dJ = (ahead - behind) * scale / (2 * step)
        dq[rows], ddq[rows] = first[..., 0], np.linalg.solve(J, slope - dJ @ first)[..., 0]
        return dq, ddq
