"""All joint solutions of many poses in one array."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from er3a.errors import PoseError, ShapeError
from er3a.finding import fact
from er3a.geometry.transforms import check_poses
from er3a.geometry.vectors import TURN
from er3a.kinematics.block_inverse import solve_blocks
from er3a.kinematics.by_class import arm_solver, checked_parameters, meets_poses, misses, slots_of_class
from er3a.kinematics.chain import constant_links
from er3a.kinematics.classes.chain_solvers import Unsolved
from er3a.kinematics.classes.six_revolute import CERTAIN
from er3a.kinematics.closed_form import REACHED, SLOTS
from er3a.kinematics.confirmed import confirmed, to_be_confirmed
from er3a.kinematics.forward import BLOCK, checked_joints, forward, joints_for_blocks
from er3a.kinematics.inverse import SAME_MEMBER, SOLVES, is_complete, missed_row, missing_class, starts_of
from er3a.kinematics.numerical import all_found
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.solutions import Method, Solutions, in_doubt, slot_labels
from er3a.kinematics.wrist_partitioned import constants_for_blocks, solve_slots, wrist_partition_missing
from er3a.numerics.arrays import Flags, Integers, Reals, as_floats
from er3a.numerics.jit import kernel, parallel_for
from er3a.robots.joint_limits import nearest_equivalent, turn_bounds, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE, whole_turns

SMALLEST_PART = 8 * BLOCK  # poses that are worth a thread's start
NEARLY_OWN = 1e-5  # rad
SLOTS_BY_STARTS = 16  # rows of a pose that iteration solves: as many as six joints can have


def inverse_batch(
    robot: Robot,
    T: Reals,
    q_ref: Reals | None = None,
    turns: bool = False,
    threads: int = 1,
    redundancy: Reals | None = None,
) -> Solutions:
    """All joint solutions for many poses of the tool, in the slots of the arm's class.

    Arms with a spherical wrist: at a singularity both branches that meet keep their slots. A free joint has its value
    of ``q_ref`` in one slot and half a turn more in the other. Next to two singularities, where the pose does not
    determine joints 4 and 6, a ``q_ref`` that solves the pose to 1e-12 and keeps the limits is in the slot of its
    branch.

    Other arms: for a self-motion, a slot holds the member nearest to ``q_ref``. Chains without a class have the
    solutions that iteration finds. Next to two singularities ``q_ref`` may be missing.

    The numbers do not depend on the number of threads, nor on a pose's place in the batch.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool, m
    q_ref : (n,) or (N, n), rad or m, reference for the choice of whole turns and free joints; None means zeros
    turns : also return the number of whole turns that each joint can have within its limits
    threads : number of threads
    redundancy : (k,) or (N, k), for arms with more than six joints, as :func:`er3a.kinematics.inverse.inverse` takes it

    Returns
    -------
    solutions : rows (N, S) of joint values (rad or m), S slots of the class; NaN in empty slots

    Raises
    ------
    ShapeError, PoseError, Er3aError
        naming the first pose that is not a rigid transform, the wrong shape, or the argument that can't be used
    """
    T = np.ascontiguousarray(as_floats(T, "T"))
    if T.ndim != 3 or T.shape[1:] != (4, 4):
        raise ShapeError("T", T.shape, "(N, 4, 4)")
    reference = _checked_reference(robot, q_ref, len(T))
    if wrist_partition_missing(robot) or robot.coupling is not None:
        return _by_class(robot, T, reference, turns, threads, redundancy)
    arm, chain, count = constants_for_blocks(robot), (joints_for_blocks(robot), constant_links(robot)), len(T)
    q = np.empty((count, SLOTS, 6))
    valid, inside = np.empty((count, SLOTS), dtype=bool), np.empty((count, SLOTS), dtype=bool)
    rigid, marked = np.empty(count, dtype=bool), np.empty(count, dtype=bool)

    def solve(part: slice) -> None:
        own = reference if len(reference) == 1 else reference[part]
        rows = (q[part], valid[part], inside[part], rigid[part], marked[part])
        solve_blocks(arm, chain, (robot.lower, robot.upper), T[part], own, rows)

    parallel_for(count, threads, SMALLEST_PART, solve)
    if not rigid.all():
        check_poses(T)
    plain = not robot.combined and not robot.continuous.any()  # what the kernel knows of limits
    left, failing = np.flatnonzero(marked) if plain else np.arange(count), np.zeros(count, dtype=bool)
    if left.size:
        own = np.broadcast_to(reference, (count, 6))[left]
        found, fault, _ = solve_slots(robot, T[left], own, keep_folds=True, keep_free=True)
        rows, solved = nearest_equivalent(robot, found, own[:, None]), fault == REACHED
        _put_own(robot, T[left], own, rows, solved)
        fits = within(robot, rows)
        # No row leaves that forward kinematics denies: of other poses, the blocks have confirmed all.
        failing[left] = _confirm(robot, T[left], rows, fits, threads)
        q[left], valid[left], inside[left] = rows, solved & np.isfinite(rows[..., 0]), fits
    branch = np.broadcast_to(np.arange(SLOTS), valid.shape)
    solutions = Solutions(robot, q, valid, inside, branch, turn_range=_turn_range(robot, q) if turns else None)
    return replace(solutions, method=in_doubt(solutions.method), certain=~failing) if failing.any() else solutions


def _confirm(
    robot: Robot, T: Reals, q: Reals, inside: Flags, threads: int, of: Integers | slice = slice(None)
) -> Flags:
    """Let only such rows of ``q`` (N, S, n), of these poses, out as forward kinematics confirms.

    Returns whether each pose (N,) had others.
    """
    failing = np.zeros(len(T), dtype=bool)
    poses = np.arange(len(T))[of][to_be_confirmed(robot, T[of], q[of], threads)]
    if not poses.size:
        return failing
    rows, lost = confirmed(robot, np.repeat(T[poses], q.shape[1], axis=0), q[poses].reshape(-1, robot.joints))
    if lost.any():
        failing[poses] = lost.reshape(-1, q.shape[1]).any(axis=1)
        q[poses] = rows.reshape(-1, *q.shape[1:])
        inside[poses] = within(robot, q[poses])
    return failing


def _put_own(robot: Robot, T: Reals, own: Reals, q: Reals, valid: Flags) -> None:
    """Put references (k, 6) that solve their poses to rounding in their slots, if no row within the limits is them.

    That is the slot that is the reference but for rounding, else the one whose branch it is on by the signs of its
    factors: next to two singularities the row there is another member of what solves the pose to rounding.
    """
    rows = np.flatnonzero((np.abs(forward(robot, own) - T).max(axis=(1, 2)) < SOLVES) & within(robot, own))
    own = own[rows]
    away = np.abs(q[rows] - own[:, None]).max(axis=2)
    away = np.where(np.isnan(away), np.inf, away)
    lost = ~(within(robot, q[rows]) & (away < SAME_MEMBER)).any(axis=1)
    rows, own, away = rows[lost], own[lost], away[lost]
    factors = determinant_factors(robot, own)
    slot = 4 * (factors.shoulder > 0) + 2 * (factors.elbow < 0) + (factors.wrist < 0)
    slot = np.where(away.min(axis=1, initial=np.inf) < NEARLY_OWN, away.argmin(axis=1), slot)
    q[rows, slot], valid[rows, slot] = own, True


def _by_class(
    robot: Robot, T: Reals, reference: Reals, turns: bool, threads: int, redundancy: Reals | None
) -> Solutions:
    """All slots by the arm's class, or, for chains of no class, what random starts find."""
    check_poses(T)
    count, solver = len(T), arm_solver(robot).chain
    certain: Flags | None = None
    method: Method
    if isinstance(solver, Unsolved):
        own = np.broadcast_to(reference, (count, robot.joints))
        q = _found_by_starts(robot, T, own)
        inside = within(robot, q)
        _confirm(robot, T, q, inside, threads)
        method = fact("iteration", starts=starts_of(robot), lacking=missing_class(robot))
    else:
        values = checked_parameters(robot, redundancy, reference, count)
        found = slots_of_class(robot, T, reference, values, threads)
        q, inside = found.q, found.inside
        lost = (found.certainty != CERTAIN) & np.isnan(q[..., 0]).all(axis=1)
        for n in np.flatnonzero(lost).tolist() if not solver.parameters else ():  # singular under the arm's task
            near = missed_row(robot, T[n], reference[0 if len(reference) == 1 else n])
            if near.solved:
                q[n, 0], inside[n, 0] = near.q, within(robot, near.q)
        certain = is_complete(robot, found.certainty) & ~_confirm(robot, T, q, inside, threads, found.unconfirmed)
        method = fact("by_class", arm_class=solver.code, certain=bool(certain.all()), named=bool(slot_labels(robot)))
    valid = np.isfinite(q[..., 0])
    branch = np.broadcast_to(np.arange(q.shape[1]), valid.shape)
    turn_range = _turn_range(robot, q) if turns else None
    freed = None if meets_poses(robot) else misses(robot, T[:, None], q)[2]
    return Solutions(robot, q, valid, inside, branch, method, turn_range=turn_range, certain=certain, freed_turn=freed)


def _found_by_starts(robot: Robot, T: Reals, q_ref: Reals) -> Reals:
    """Slots (N, S, n) with what random starts find, for chains of no class, and references (N, n) that solve."""
    q = np.full((len(T), SLOTS_BY_STARTS, robot.joints), np.nan)
    own = np.abs(forward(robot, q_ref) - T).max(axis=(1, 2), initial=0.0) <= SOLVES
    for n, pose in enumerate(T):
        rows = nearest_equivalent(robot, all_found(robot, pose, starts_of(robot))[:SLOTS_BY_STARTS], q_ref[n])
        if own[n] and not (np.abs(rows - q_ref[n]).max(axis=1) < SAME_MEMBER).any():
            rows = np.concatenate([rows[: SLOTS_BY_STARTS - 1], q_ref[n : n + 1]])
        q[n, : len(rows)] = rows
    return q


def _checked_reference(robot: Robot, q_ref: Reals | None, count: int) -> Reals:
    """Reference joints (1 or N, n)."""
    n = robot.joints
    reference = checked_joints(robot, np.zeros(n) if q_ref is None else q_ref, "q_ref")
    if reference.shape not in ((n,), (count, n)):
        raise ShapeError("q_ref", reference.shape, f"({n},) or ({count}, {n})")
    reference = reference.reshape(-1, n)
    bad = np.flatnonzero(~np.isfinite(reference).all(axis=1))
    if bad.size:
        raise PoseError(f"q_ref{f'[{bad[0]}]' if len(reference) > 1 else ''} holds NaN or infinity")
    return reference


def _turn_range(robot: Robot, q: Reals) -> NDArray[np.int8]:
    """Smallest and largest number of whole turns (N, S, n, 2) within the limits; 0 and -1 in empty slots."""
    turns = np.empty((2, *q.shape), dtype=np.int8)
    if whole_turns(robot).alone.all() and not robot.continuous.any():
        lower, upper = (np.tile(limit, q.shape[1]) for limit in (robot.lower, robot.upper))
        _count_turns(q.reshape(-1, len(lower)), lower, upper, turns.reshape(2, -1, len(lower)))
    else:
        low, high = turn_bounds(robot, q)
        turns[:] = np.nan_to_num(low), np.nan_to_num(high, nan=-1.0)
    return np.moveaxis(turns, 0, -1)


@kernel
def _count_turns(q: Reals, lower: Reals, upper: Reals, turns: NDArray[np.int8]) -> None:
    """What ``turn_bounds`` finds for joints (N, k) that turn and have limits (k,), in turns (2, N, k)."""
    low, high = turns[0], turns[1]
    for n in range(q.shape[0]):
        for j in range(q.shape[1]):
            least = np.ceil((lower[j] - LIMIT_TOLERANCE - q[n, j]) / TURN)
            most = np.floor((upper[j] + LIMIT_TOLERANCE - q[n, j]) / TURN)
            empty = np.isnan(q[n, j])
            low[n, j], high[n, j] = np.int32(0.0 if empty else least), np.int32(-1.0 if empty else most)
