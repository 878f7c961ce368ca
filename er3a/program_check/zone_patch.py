"""The ways round a corner between two lines: joints at poses of a triangle of the tool, and by how much they bend.

The poses have two coordinates from 0, at most 1 in sum: shares of the ways back to where the zone begins and on to
where it ends; the tool turns with the same shares. Along a straight way of the coordinates J q' = v. From a pose that
is solved, with J0 there, all bounds are taken joint by joint: as long as the joints have moved by no more than d,
``|J0^-1 (J - J0)| <= E(d)``, of the derivatives of J at that pose and a bound of the second ones (no derivative of a
column is longer than the longest column). Then ``|q'| <= (I - E)^-1 |J0^-1 v|`` [1]_; where that comes out no greater
than d, all poses of the triangle are solved, on one branch. Second derivatives follow from J q'' = v' - J' q'. The
error of linear interpolation over a triangle is half the mean, by the shares of its corners, of the second derivatives
towards them: at most an eighth of the sum that two of its sides give.

References
----------
.. [1] A. Neumaier, *Interval Methods for Systems of Equations*, 1990, sections 3.6 and 4.1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.kinematics.forward import forward, jacobian
from er3a.kinematics.singularity import characteristic_length
from er3a.kinematics.wrist_partitioned import solve_slots
from er3a.numerics.arrays import Reals
from er3a.planning.branch_tracking import turned_difference
from er3a.planning.tool_proof import inverse_and_reach
from er3a.robots.robot import Robot

MOST_TURN = 1.0  # rad, to which the twist of a rotation vector that changes has been bounded
MOST_GROWN = 0.7
STEP, BLUR = 1e-5, 1e-8  # rad, of differences of the Jacobian; their error
ATTEMPTS = 6
SAME = 1e-7  # rad
MOST_INVERSE = 1e6  # of the scaled Jacobian; beyond, nothing is proven


@dataclass(frozen=True, eq=False)
class ZonePatch:
    """The poses round a corner.

    Attributes
    ----------
    corner : T_world_tool (4, 4), m
    sides : (2, 3), m, from the corner to where the zone begins and to where it ends
    turns : (2, 3), rotation vectors, likewise, in the world's frame
    slack : m, by which the tool point may be off the triangle
    """

    arm: Robot
    corner: Reals
    sides: Reals
    turns: Reals
    slack: float

    def poses(self, at: Reals) -> Reals:
        """T_world_tool (k, 4, 4) at coordinates (k, 2)."""
        found = np.tile(self.corner, (len(at), 1, 1))
        found[:, :3, 3] += at @ self.sides
        found[:, :3, :3] = Rotation.from_rotvec(at @ self.turns).as_matrix() @ self.corner[:3, :3]
        return found

    def joints(self, at: Reals, near: Reals) -> Reals:
        """Solutions (k, n), rad, nearest to joints (k, n) at coordinates (k, 2); NaN where there is none."""
        solved = solve_slots(self.arm, self.poses(at), near)[0]
        steps = turned_difference(near[:, None], solved)
        away = np.where(np.isnan(steps).any(axis=-1), np.inf, np.abs(steps).max(axis=-1))
        best = away.argmin(axis=1)
        rows = np.arange(len(at))
        return np.where(np.isfinite(away[rows, best])[:, None], near + steps[rows, best], np.nan)

    def bend(self, at: Reals, q: Reals) -> tuple[Reals, Reals]:
        """By how much joints (n,) are off the flat triangle at most, and off it by slack alone, rad.

        Parameters
        ----------
        at : (3, 2), coordinates; q : (3, n), rad, solutions there

        Returns
        -------
        bend, slack : the first infinite where nothing is proven of so large a part
        """
        n = q.shape[1]
        open_ = np.full(n, np.inf), np.zeros(n)
        turned = float(np.linalg.norm(self.turns, axis=1).sum())
        near = _Near.of(self.arm, q[0]) if np.isfinite(q).all() and turned <= MOST_TURN else None
        if near is None:
            return open_
        edges = at[1:] - at[0]
        turning = edges @ self.turns
        angles = np.linalg.norm(turning, axis=1)
        twists = np.concatenate([edges @ self.sides / near.length, turning], axis=1)
        # a twist turns with the tool, by no more than the tool does; slack adds to what has to be gone
        aside = [near.size @ np.repeat([self.slack / near.length, turned * angle], 3) for angle in angles]
        first = np.abs(twists @ near.inverse.T) + np.stack(aside)
        moved = 1.2 * np.maximum(first.max(axis=0), first.max() / 5)
        for _ in range(ATTEMPTS):
            grown = near.grown(moved)
            if grown is None:
                return open_
            rates = first @ grown.T
            if (rates <= moved).all():
                break
            moved = np.maximum(moved, 1.1 * rates.max(axis=0))
        else:
            return open_
        if (np.abs(q[1:] - q[0]) > rates * (1 + 1e-6) + SAME).any():  # another branch
            return open_
        bent = sum(
            near.second(moved, rates[i], rates[j]) + near.size @ np.repeat([0.0, angles[i] * angles[j]], 3)
            for i in range(2)
            for j in range(2)
        )
        slack: Reals = grown @ near.size @ np.repeat([self.slack / near.length, 0.0], 3)
        return grown @ bent / 8 + slack, slack


@dataclass(frozen=True, eq=False)
class _Near:
    """The scaled Jacobian J0 near solved joints.

    Attributes
    ----------
    inverse : (n, 6), of J0; size : its absolute values
    changes : (n, n, n), sizes of J0^-1 dJ/dq_i, by i
    weights : (n,), by which rows of the table move per joint, in sum
    reach : greatest lever of the tool point, over ``length`` (m)
    """

    inverse: Reals
    size: Reals
    changes: Reals
    weights: Reals
    reach: float
    length: float

    @classmethod
    def of(cls, arm: Robot, q: Reals) -> _Near | None:
        """At joints (n,) in rad; None where J0 has no inverse to speak of."""
        n, length = len(q), characteristic_length(arm)
        (b,), (reach,) = inverse_and_reach(arm, q[None], length)
        if not b < MOST_INVERSE:
            return None
        steps = STEP * np.eye(n)
        J = jacobian(arm, np.concatenate([q[None], q + steps, q - steps]))
        J[:, :3] /= length
        inverse = np.linalg.inv(J[0])
        changes = np.abs(inverse @ (J[1 : n + 1] - J[n + 1 :]) / (2 * STEP)) + BLUR * np.abs(inverse).max()
        weights = np.ones(n) if arm.coupling is None else np.abs(arm.coupling).sum(axis=0)
        return cls(inverse, np.abs(inverse), changes, weights, float(reach), length)

    @property
    def norms(self) -> Reals:
        """Lengths (n,) of the rows of J0^-1."""
        return np.asarray(np.sqrt((self.inverse**2).sum(axis=1)), np.float64)

    def column(self, moved: Reals) -> tuple[Reals, float]:
        """Greatest length of the columns (n,) of J while joints move by (n,), and by how much rows do in sum."""
        rows = float(self.weights @ moved)
        longest = math.hypot(1.0, self.reach * math.exp(min(rows, 1.0)))
        return longest * self.weights, rows

    def grown(self, moved: Reals) -> Reals | None:
        """(I - E)^-1 (n, n) while joints move by no more than (n,), rad; None if E is too great."""
        columns, rows = self.column(moved)
        E = np.tensordot(moved, self.changes, 1) + self.norms[:, None] * columns * rows**2 / 2
        if rows >= 1.0 or np.abs(np.linalg.eigvals(E)).max() >= MOST_GROWN:
            return None
        return np.asarray(np.linalg.inv(np.eye(len(E)) - E), np.float64)

    def second(self, moved: Reals, one: Reals, other: Reals) -> Reals:
        """Sizes (n,) of J0^-1 D_J[one] other while joints move by no more than ``moved``, rates (n,) at most."""
        columns, rows = self.column(moved)
        rest = self.norms * rows * (self.weights @ one) * float(columns @ other)
        found = np.asarray(np.einsum("iac,i,c->a", self.changes, one, other) + rest, np.float64)
        return found


def patch_of(arm: Robot, corners: Reals, slack: float) -> ZonePatch:
    """The poses between joints (3, n) where the zone begins, at the corner, and where it ends."""
    poses = forward(arm, corners)
    turns = Rotation.from_matrix(poses[[0, 2], :3, :3] @ poses[1, :3, :3].T).as_rotvec()
    return ZonePatch(arm, poses[1], poses[[0, 2], :3, 3] - poses[1, :3, 3], turns, slack)


def bend_of_line(arm: Robot, q: Reals, slack: float) -> Reals:
    """By how much joints (n,) are off the chord at most on a line through solved joints (k, n), rad.

    ``slack`` (m) is by how far the way may be off the straight lines between them; infinite where nothing is proven.
    """
    shares = np.linspace(0, 1, len(q))[:, None]
    nodes = np.abs(q - q[0] - shares * (q[-1] - q[0])).max(axis=0)
    at = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    parts = [
        patch_of(arm, np.stack([a, a, b]), slack).bend(at, np.stack([a, b, a]))[0]
        if np.isfinite([a, b]).all()
        else np.full(q.shape[1], np.inf)
        for a, b in pairwise(q)
    ]
    found: Reals = nodes + np.max(parts, axis=0)
    return found
