"""The numerical inverse: any arm, from a start guess, with or without limits, for parts of a pose."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral, Real

import numpy as np

from er3a.errors import Er3aError, PoseError, ShapeError
from er3a.geometry.transforms import as_floats, check_poses
from er3a.kinematics.chain import arm_length, constant_links, joint_starts
from er3a.kinematics.forward import checked_joints, jacobian
from er3a.kinematics.iteration import solve_numerically
from er3a.kinematics.iteration_any import solve_any
from er3a.kinematics.solutions import (
    BadGuess,
    Iteration,
    LimitBound,
    NearestMiss,
    NotFound,
    PoseUnsolved,
    SingularEnd,
    Solutions,
    Unreachable,
)
from er3a.numerics.arrays import Integers, Reals
from er3a.numerics.threads import parallel_for
from er3a.robots.joint_limits import limits_exceeded, nearest_equivalent, unwound, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import shortest_way

RESTARTS = 500
DIAGNOSIS_RESTARTS = 100
NEARLY = 1e-6  # m (in parts of the arm's length) or rad: so near, only a singularity keeps the iteration from its end
RANK = 1e-3  # smallest singular value below which the end of an iteration counts as singular
SAME_ARM = 1e-6
SMALLEST_PART = 64


def solve(
    robot: Robot,
    T: Reals,
    q0: Reals | None = None,
    *,
    mask: Reals | None = None,
    respect_limits: bool = True,
    restarts: int = RESTARTS,
    position_tolerance: float = 1e-10,
    rotation_tolerance: float = 1e-10,
    seed: int = 0,
    threads: int = 1,
) -> Solutions:
    """Solve poses by iteration from a start guess, then from random ones.

    Parameters
    ----------
    T : (..., 4, 4), T_base_tool, m
    q0 : (n,) or (..., n), rad or m, where to start; None means the middle of the limits
    mask : 6 of 1 or 0: which of x, y, z and the rotations about x, y, z of the target's tool frame must be met; None
        means all. ``[1, 1, 1, 1, 1, 0]`` leaves the rotation about the tool's axis free.
    respect_limits : keep to the joint limits inside the iteration; else angles come in (-pi, pi]
    restarts : how many random starts to try after ``q0`` (0 to 65535)
    position_tolerance : m; rotation_tolerance : rad
    seed : of the random starts; equal seeds give equal results, whatever the number of threads

    Raises
    ------
    ShapeError, PoseError, Er3aError
        naming the argument that can't be used
    """
    T = np.ascontiguousarray(check_poses(T))
    shape = T.shape[:-2]
    mask = _checked_mask(mask)
    for name, value, most in (("restarts", restarts, 65535), ("seed", seed, 2**63 - 1)):
        if not (isinstance(value, Integral) and 0 <= value <= most):
            raise Er3aError(f"{name} is {value!r}; expected a whole number from 0 to {most}")
    for name, tolerance in (("position_tolerance", position_tolerance), ("rotation_tolerance", rotation_tolerance)):
        if not (isinstance(tolerance, Real) and tolerance > 0):
            raise Er3aError(f"{name} is {tolerance!r}; expected a number above 0")
    q0 = (robot.lower + robot.upper) / 2 if q0 is None else checked_joints(robot, q0, "q0")
    n = robot.joints
    if q0.shape not in ((n,), (*shape, n)):
        raise ShapeError("q0", q0.shape, f"({n},) or {(*shape, n)}")
    if not np.isfinite(q0).all():
        raise PoseError("q0 holds NaN or infinity")
    search = _Search(robot, mask, np.array([position_tolerance, rotation_tolerance]), seed)
    poses = T.reshape(-1, 4, 4)
    starts_at = np.broadcast_to(q0, (*shape, n)).reshape(-1, n)
    q, error, starts = search.run(poses, starts_at, respect_limits, restarts, threads)
    unsolved = tuple(
        PoseUnsolved(int(n), search.explain(poses[n], q[n], error[n], respect_limits, restarts))
        for n in np.flatnonzero(starts == 0)
    )
    q = q.reshape(*shape, n)
    return Solutions(
        robot,
        q,
        solved=(starts > 0).reshape(shape),
        within_limits=(starts > 0).reshape(shape) & within(robot, q),
        branch=np.full(shape, -1),
        method=Iteration(1 + restarts),
        unsolved=unsolved,
        position_error=error[:, 0].reshape(shape),
        rotation_error=error[:, 1].reshape(shape),
        starts=starts.reshape(shape),
    )


def all_found(robot: Robot, T: Reals, starts: int, seed: int = 0) -> Reals:
    """Different joint solutions (k, n), angles in (-pi, pi], found from that many random starts for one pose (4, 4).

    There may be more: a search from random starts can't prove that it has found all.
    """
    search = _Search(robot, np.ones(6), np.array([1e-12, 1e-12]), seed + 1)
    low, high = search.without_limits()
    begin = np.random.default_rng([seed, 2]).uniform(low, high, (starts, robot.joints))
    q, _, used = search.run(np.tile(T, (starts, 1, 1)), begin, False, 0, 1)
    distinct: list[Reals] = []
    for row in q[used > 0]:
        away = row - np.reshape(distinct, (-1, robot.joints))
        if not (np.abs(shortest_way(robot, away)).max(axis=1) <= SAME_ARM).any():
            distinct.append(row)
    return np.array(distinct).reshape(-1, robot.joints)


@dataclass(frozen=True, eq=False)
class _Search:
    robot: Robot
    mask: Reals
    tolerances: Reals
    seed: int

    def run(self, T: Reals, q0: Reals, respect: bool, restarts: int, threads: int) -> tuple[Reals, Reals, Integers]:
        """Joint values (N, n), errors (N, 2) in m and rad, and starts (N,) for poses (N, 4, 4)."""
        robot, count = self.robot, len(T)
        q, error, starts = np.empty((count, robot.joints)), np.empty((count, 2)), np.empty(count, dtype=np.int64)
        limits = (robot.lower, robot.upper, True) if respect else (*self.without_limits(), False)
        q0, length = np.ascontiguousarray(q0), arm_length(robot)
        plain = robot.joints == robot.rows == 6 and robot.coupling is None and not robot.sliding.any()
        lanes = robot.direction, robot.offset, constant_links(robot)
        coupling = np.eye(robot.rows) if robot.coupling is None else np.ascontiguousarray(robot.coupling)
        units = np.where(robot.slides, length, 1.0)
        each = robot.direction, joint_starts(robot), constant_links(robot), robot.sliding, coupling, units

        def part(rows: slice) -> None:
            goal, draws = (self.mask, self.tolerances, length), (restarts, np.uint64(self.seed), rows.start)
            out = q[rows], error[rows], starts[rows]
            if plain:
                solve_numerically(lanes, limits, T[rows], q0[rows], goal, draws, out)
            else:
                solve_any(each, limits, T[rows], q0[rows], goal, draws, out)

        parallel_for(count, threads, SMALLEST_PART, part)
        return (q if respect else unwound(robot, q)), error, starts

    def without_limits(self) -> tuple[Reals, Reals]:
        """From where to where joints (n,) start that need not keep to limits: a turn; slides twice as far as theirs."""
        robot = self.robot
        middle, half = (robot.lower + robot.upper) / 2, robot.upper - robot.lower
        low, high = np.where(robot.slides, middle - half, -np.pi), np.where(robot.slides, middle + half, np.pi)
        return low, high

    def explain(self, T: Reals, q: Reals, error: Reals, respect: bool, restarts: int) -> NotFound:
        """Why one pose was not solved: its nearest arm and a search without what may have hindered it."""
        miss = NearestMiss(float(error[0] * 1000), float(np.degrees(error[1])))
        if restarts < DIAGNOSIS_RESTARTS:
            _, _, starts = self.run(T[None], q[None], respect, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                return BadGuess(miss, "other_starts")
        if respect:
            free, _, starts = self.run(T[None], q[None], False, DIAGNOSIS_RESTARTS, 1)
            if starts[0]:
                exceeded = limits_exceeded(self.robot, nearest_equivalent(self.robot, free[0], q))
                return LimitBound(miss, exceeded) if exceeded else BadGuess(miss, "without_limits")
        length = arm_length(self.robot)
        J = jacobian(self.robot, q)
        J[:3] /= length
        singular = np.linalg.svd(J[self.mask > 0], compute_uv=False)[-1] < RANK
        if singular and max(error[0] / length, error[1]) < NEARLY:
            return SingularEnd(miss)
        return Unreachable(miss)


def _checked_mask(mask: Reals | None) -> Reals:
    values = np.ones(6) if mask is None else as_floats(mask, "mask")
    if values.shape != (6,):
        raise ShapeError("mask", values.shape, "(6,)")
    if not np.isin(values, (0.0, 1.0)).all() or not values.any():
        raise Er3aError(f"mask is {values.tolist()}; expected six of 0 or 1, at least one 1")
    return values
