"""All joint solutions of one pose; each solution outside the limits has a reason."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from er3a.errors import PoseError, ShapeError
from er3a.finding import Finding, fact, is_one
from er3a.geometry.transforms import typed_pose, warn_of_rounding
from er3a.geometry.vectors import max_joint_move, wrap_to_pi
from er3a.kinematics import by_class, solutions
from er3a.kinematics.by_class import confirms, meets_poses, misses, task_mask
from er3a.kinematics.chain import joint_starts
from er3a.kinematics.classes.chain_solvers import Unsolved as UnsolvedChain
from er3a.kinematics.classes.class_solvers import ARM_CLASSES, BranchSolver, LinkedRows
from er3a.kinematics.classes.six_revolute import CERTAIN
from er3a.kinematics.closed_form import FREE, OFF_AXIS, ORIENTATION, REACHED, TOO_FAR
from er3a.kinematics.confirmed import ClosedFormArm, confirmed, regular_turns
from er3a.kinematics.families import Family, families, is_regular
from er3a.kinematics.forward import CONFIRMS, checked_joints, forward
from er3a.kinematics.numerical import all_found, nearest_arm, solve
from er3a.kinematics.self_motions import SelfMotionCurve, to_rows
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import (
    ClosedFormMissing,
    solve_slots,
    wrist_partition_missing,
    wrist_partitioned_arm,
)
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.joint_limits import equivalents_within, within
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import turns_alone

SAME_JOINTS = 1e-9  # rad: rows so near to each other are one
SAME_MEMBER = 1e-6  # rad or m: a member of a self-motion so near to a row is listed already
MISSED = 1e-4  # rad or m from all rows
TYPED = 2e-3  # m and rad, that three decimals in a pose are off by, half of it in its rotation
SOLVES = 1e-12  # m and parts of 1
MOST_AT_ONCE = 1024  # turns of a pose; more take the longer way
STARTS, STARTS_OF_DEPENDENT = 400, 24  # where joints depend on each other a start that leads anywhere leads elsewhere


def inverse(
    robot: Robot,
    T: Reals,
    q_ref: Reals | None = None,
    redundancy: Reals | None = None,
    self_motion_rows: bool = False,
) -> solutions.Solutions:
    """All joint solutions of one pose of the tool, by the class of the arm's geometry.

    If a joint is free (a self-motion), the member within the limits that is nearest to ``q_ref`` is among the rows;
    with a spherical wrist also the one half a turn further, for the branch that meets there. Arms with more than six
    joints have rows at the given value of their redundancy parameter. Their self-motions (``families``) are traced when
    they are first read, which takes about 0.3 s. Arms with fewer than six joints meet the part of the pose that
    :func:`er3a.kinematics.by_class.task_mask` returns; rows that meet all of it come first (``freed_turn``).

    Forward kinematics confirms each row to 1e-9 m and rad. Where a row of the class had to be improved or dropped for
    it, the solutions are not certain to be all.

    Parameters
    ----------
    T : (4, 4), T_base_tool, m; of a rotation with three decimals the nearest is taken, and a warning says how far it
        is; and of five joints then the nearest pose that they can do, up to ``TYPED`` away
    q_ref : (n,), rad or m, reference for the choice of members of self-motions and of whole turns: in each branch the
        nearest turn comes first. None means zeros.
    redundancy : (k,), values of the redundancy parameters (``parameters_of``): an arm angle in rad, or a joint's value;
        None means those of ``q_ref``, or the nearest at which the pose has rows
    self_motion_rows : for an arm with one redundancy parameter, add for each self-motion the member nearest to
        ``q_ref`` and the one with the largest limit margin as rows; done too where no value tried has rows inside

    Returns
    -------
    solutions : rows (k, n), rad or m, all turns within the limits; of a branch outside them one row with the reason

    Raises
    ------
    ShapeError, PoseError
        if T is not a rigid transform, or q_ref does not have one finite number for each joint
    """
    if (at_once := _at_once(robot, T, q_ref)) is not None:
        return at_once
    given, T = T, typed_pose(T)
    if T.shape != (4, 4):
        raise ShapeError("T", T.shape, "(4, 4)")
    q_ref = checked_reference(robot, q_ref)
    if wrist_partition_missing(robot) or robot.coupling is not None:
        found = _by_class(robot, T, q_ref, redundancy, self_motion_rows)
        if not len(found.q) and robot.joints == 5 and (given != T).any():
            near = missed_row(robot, T, q_ref)  # no typed pose is exactly one of five joints
            if (off := max(map(float, misses(robot, T, near.q)))) <= TYPED:
                warn_of_rounding("T, for five joints,", off)
                return inverse(robot, forward(robot, near.q), q_ref)
    else:
        found = _by_closed_form(robot, T, q_ref)
    return _at_exit(robot, found, T, q_ref if redundancy is None and not found.regular else None)


@derived
def _closed_form(robot: Robot) -> tuple[BranchSolver, ClosedFormArm, solutions.Method] | None:
    """The solver of an arm in closed form whose joints turn by themselves, and what the kernel takes of the arm."""
    solver = by_class.arm_solver(robot)
    if not isinstance(solver.chain, BranchSolver) or not turns_alone(robot) or robot.coupling is not None:
        return None
    method = fact("by_class", arm_class=solver.chain.code, certain=True, named=True)
    if solver.chain.code == "spherical_wrist":
        method = solutions.CLOSED_FORM
    scaled = np.array(solver.links)
    scaled[:, :3, 3] /= solver.size
    arm = scaled, solver.size, robot.direction, joint_starts(robot), (robot.lower, robot.upper)
    return solver.chain, arm, method


def _at_once(robot: Robot, T: Reals, q_ref: Reals | None) -> solutions.Solutions | None:
    """The solutions of a pose far from all singular ones: all that most poses need.

    Nothing is checked before: what is no rigid transform has no row that solves it to rounding.
    """
    plain = _closed_form(robot)
    if plain is None or not _is_array(T, (4, 4)):
        return None
    if q_ref is None:
        q_ref = np.zeros(6)
    elif not _is_array(q_ref, (6,)):
        q_ref = checked_reference(robot, q_ref)
    (solver, arm, method), pose = plain, T.copy()  # what kernels take: contiguous, writeable
    x, marked, empty = solver.branches(pose[None])
    if marked[0]:
        return None
    rows, of, inside = np.empty((MOST_AT_ONCE, 6)), np.empty(MOST_AT_ONCE, np.int64), np.empty(MOST_AT_ONCE, bool)
    count = regular_turns(arm, pose, x[0], q_ref.copy(), (rows, of, inside))
    if count <= 0:
        return None
    q, branch, fits = rows[:count].copy(), of[:count].copy(), inside[:count].copy()
    unsolved = () if empty is None else _unsolved(robot, empty[0][0], empty[1][0])
    return solutions.Solutions(robot, q, np.ones(count, bool), fits, branch, method, unsolved)


def _is_array(values: Reals, shape: tuple[int, ...]) -> bool:
    """Whether values need no conversion."""
    return isinstance(values, np.ndarray) and values.dtype == np.float64 and values.shape == shape


class _Found(NamedTuple):
    """Rows (k, n) and their branches (k,), as :class:`er3a.kinematics.solutions.Solutions` has them.

    ``regular``: all are so far from singular poses that they are known to rounding.
    """

    q: Reals
    branch: Integers
    method: solutions.Method
    unsolved: tuple[solutions.Unsolved, ...]
    families: Sequence[Family | SelfMotionCurve] = ()
    regular: bool = False


def _by_closed_form(robot: Robot, T: Reals, q_ref: Reals) -> _Found:
    """Rows of an arm with a spherical wrist: each branch once per turn, and the nearest member of each self-motion."""
    q, fault, gap = solve_slots(robot, T[None], q_ref[None], keep_folds=True, keep_free=True)
    q, fault, gap = q[0], fault[0], gap[0]
    slots = np.flatnonzero(fault == REACHED)
    if is_regular(robot, q):
        rows, of = equivalents_within(robot, q[slots], q_ref)
        return _Found(rows, slots[of], solutions.CLOSED_FORM, _unsolved(robot, fault, gap), regular=True)
    continua = families(robot, T, q, q_ref)
    if continua:
        q = _free_joints_near(robot, T, q, q_ref, continua)
    slots = slots[by_class.distinct(robot, q[slots], SAME_JOINTS)]
    rows, of = equivalents_within(robot, q[slots], q_ref)
    branches = slots[of]
    for family in continua:
        if family.within_limits and _distance(rows, family.q0) > SAME_MEMBER:
            rows, branches = np.concatenate([rows, family.q0[None]]), np.append(branches, family.branches[0])
    return _Found(rows, branches, solutions.CLOSED_FORM, _unsolved(robot, fault, gap), continua)


def _at_exit(robot: Robot, found: _Found, T: Reals, own: Reals | None) -> solutions.Solutions:
    """The solutions that forward kinematics confirms; those that turn the tool from the pose come last.

    ``own`` (n,) is a reference that joins the rows if it keeps the limits, solves the pose to rounding and is none of
    them: next to two singularities roots are known to 1e-8 rad only, so the arm's own row can lie beyond a limit.
    """
    q, branch, method, unsolved, motions, _ = found
    rows, failing = confirmed(robot, T[None], q)
    certain = not failing.any()
    if not certain:
        kept = np.isfinite(rows[:, 0])
        if not kept.any():
            position, rotation, _ = misses(robot, T, q)
            unsolved = _no_row(position.min(), rotation.min())
        q, branch = rows[kept], branch[kept]
    if own is not None and within(robot, own) and np.abs(forward(robot, own) - T).max() <= SOLVES:
        away = max_joint_move(q, own)
        if away[within(robot, q)].min(initial=np.inf) > SAME_MEMBER:
            certain = certain and bool(away.min(initial=np.inf) <= MISSED)
            branch = np.append(branch, branch[away.argmin()] if len(q) else 0)
            q = np.concatenate([q, own[None]])
            unsolved = tuple(each for each in unsolved if not is_one(each, "pose_unsolved"))
    freed = None if meets_poses(robot) else misses(robot, T, q)[2]
    if freed is not None:
        order = np.argsort(np.where(freed <= CONFIRMS, 0.0, freed), kind="stable")
        q, branch, freed = q[order], branch[order], freed[order]
    if isinstance(motions, tuple):
        motions = tuple(each for each in motions if confirms(robot, T, each.q0))
    return solutions.Solutions(
        robot,
        q,
        solved=np.ones(len(q), dtype=bool),
        within_limits=within(robot, q),
        branch=branch,
        method=method if certain else solutions.in_doubt(method),
        unsolved=unsolved,
        families=motions,
        freed_turn=freed,
    )


def _with_rows(
    robot: Robot, T: Reals, found: tuple[Reals, Integers], turned: Reals, least: float
) -> tuple[Reals, Integers]:
    """Rows (k, n), and the branch of each, with one more arm in all its turns (t, n), if ``least`` away from all."""
    rows, branches = found
    if min(_distance(rows, row) for row in turned) <= least:
        return found
    own = np.full(len(turned), by_class.slot_of(robot, T, turned[0]))
    return np.concatenate([rows, turned]), np.concatenate([branches, own])


def _by_class(robot: Robot, T: Reals, q_ref: Reals, redundancy: Reals | None, self_motion_rows: bool) -> _Found:
    """Rows by the solver of the arm's class, with members of self-motions, and what a search adds in doubt."""
    solver = by_class.arm_solver(robot).chain
    if isinstance(solver, UnsolvedChain):
        return _by_iteration(robot, T, q_ref)
    values = by_class.checked_parameters(robot, redundancy, q_ref[None], 1)
    found = by_class.slots_of_class(robot, T[None], q_ref[None], values)
    free = len(solver.parameters) == 1 and redundancy is None
    if free and not np.isfinite(found.q).any():
        values = by_class.nearest_value(robot, T, q_ref, values)
        found = by_class.slots_of_class(robot, T[None], q_ref[None], values)
    slots, motions = found.q[0], found.settled[0].motions if found.settled else ()
    filled = np.flatnonzero(np.isfinite(slots[:, 0]))
    traced: Sequence[SelfMotionCurve] = motions
    if len(solver.parameters) == 1:
        traced = by_class.LazySelfMotions(robot, T, q_ref, values)
        motions = tuple(traced) if self_motion_rows or (free and not filled.size) else ()
    if solver.parameters:  # keep one where two branches meet; other arms' poses of that kind are settled
        filled = filled[by_class.distinct(robot, slots[filled], SAME_JOINTS)]
    rows, of = equivalents_within(robot, slots[filled], q_ref)
    branches = filled[of]
    for motion in motions:
        members = (motion.q0, motion.max_margin_member) if solver.parameters else (motion.q0,)
        for member in members if motion.within_limits else ():
            rows, branches = _with_rows(robot, T, (rows, branches), member[None], SAME_MEMBER)
    certain = bool(is_complete(robot, found.certainty)[0])
    if not certain and isinstance(solver, LinkedRows):  # the rows found may be members that the linkage can't make
        for row in all_found(robot, T, STARTS):
            turned, _ = equivalents_within(robot, row[None], q_ref)
            rows, branches = _with_rows(robot, T, (rows, branches), turned, MISSED)
    if len(solver.parameters) == 1 and np.abs(forward(robot, q_ref) - T).max() <= SOLVES:
        # the self-motion through the reference is traced from there: without a first step it is missing
        certain = certain and by_class.arm_solver(robot).poses_at(T).moves(to_rows(robot, q_ref))
    unsolved: tuple[solutions.Unsolved, ...] = ()
    if not len(branches):
        near = missed_row(robot, T, q_ref)
        # The class missed it, or the reference's parameters do.
        if near.solved and not (solver.parameters and redundancy is not None):
            rows, branches = _near_solved(robot, T, near.q, q_ref)
            certain = False
        else:
            unsolved = _no_row(near.position_error, near.rotation_error)
    method = fact("by_class", arm_class=solver.code, certain=bool(certain), named=bool(solutions.slot_labels(robot)))
    return _Found(rows, branches, method, unsolved, traced)


def _no_row(position: Any, rotation: Any) -> tuple[solutions.Unsolved, ...]:
    """Why a pose has no row: by how much (m, rad) the nearest one misses it."""
    miss = fact("nearest_miss", position_mm=float(position * 1000), rotation_deg=float(np.degrees(rotation)))
    return (fact("pose_unsolved", pose=0, why=fact("no_solution_of_class", miss=miss)),)


def _distance(rows: Reals, q: Reals) -> float:
    """How far joint values (n,) are from the nearest of rows (k, n); infinite if there are none."""
    return float(max_joint_move(rows, q).min(initial=np.inf))


def is_complete(robot: Robot, certainty: Integers) -> Flags:
    """Whether the class found all solutions of poses.

    Parameters
    ----------
    certainty : (N,), of the class, CERTAIN, UNCERTAIN or CONTINUUM

    Returns
    -------
    complete : (N,) bool; always True for classes that don't eliminate
    """
    solver = by_class.arm_solver(robot).chain
    closed = ARM_CLASSES[solver.code].closed_form and not isinstance(solver, LinkedRows)
    return np.asarray((certainty == CERTAIN) | closed)


def missed_row(robot: Robot, T: Reals, q_ref: Reals) -> solutions.Solutions:
    """What a search from the reference finds at a pose that the arm's class has no row for.

    Parameters
    ----------
    T : (4, 4), m
    q_ref : (n,), rad or m

    Returns
    -------
    found : one row, solved or not, within the limits if it can be
    """
    open_pose, mask = bool(by_class.parameters_of(robot)), task_mask(robot)
    robot, T = by_class.with_task_frame(robot), T @ by_class.arm_solver(robot).task_frame
    near = nearest_arm(robot, T, q_ref, mask, open_pose)
    if open_pose or not near.solved or within(robot, near.q):
        return near
    inside = nearest_arm(robot, T, q_ref, mask, True)
    return inside if inside.solved else near


def _near_solved(robot: Robot, T: Reals, q: Reals, q_ref: Reals) -> tuple[Reals, Integers]:
    """Rows and branches of a pose that joint values (n,) solve: all at their redundancy parameters, else they."""
    if by_class.parameters_of(robot):
        slots = by_class.slots_of_class(
            robot, T[None], q_ref[None], by_class.checked_parameters(robot, None, q[None], 1)
        ).q[0]
        if len(filled := np.flatnonzero(np.isfinite(slots[:, 0]))):
            rows, of = equivalents_within(robot, slots[filled], q_ref)
            return rows, filled[of]
    return equivalents_within(robot, q[None], q_ref)


def _by_iteration(robot: Robot, T: Reals, q_ref: Reals) -> _Found:
    """Rows that random starts find, for chains of no class."""
    arms = all_found(robot, T, starts_of(robot))
    rows, branches = equivalents_within(robot, np.reshape(arms, (-1, robot.joints)), q_ref)
    unsolved = () if len(arms) else solve(robot, T, respect_limits=False).unsolved
    return _Found(rows, branches, fact("iteration", starts=starts_of(robot), lacking=missing_class(robot)), unsolved)


def starts_of(robot: Robot) -> int:
    """How many random starts look for the solutions of an arm that no class solves.

    Returns
    -------
    count : few if joints depend on each other, since there any start leads elsewhere
    """
    return STARTS_OF_DEPENDENT if by_class.arm_solver(robot).chain.code == "dependent" else STARTS


def missing_class(robot: Robot) -> ClosedFormMissing | None:
    """Why the arm is solved by iteration.

    Parameters
    ----------
    robot : that no class solves

    Returns
    -------
    why : dependent joints, or what a spherical wrist lacks
    """
    return (
        fact("dependent_joints")
        if by_class.arm_solver(robot).chain.code == "dependent"
        else wrist_partition_missing(robot)
    )


def checked_reference(robot: Robot, q_ref: Reals | None) -> Reals:
    """Reference joint values of one pose.

    Parameters
    ----------
    q_ref : (n,), rad or m; None for zeros

    Returns
    -------
    q_ref : (n,), rad or m

    Raises
    ------
    ShapeError, PoseError
        if they have not one finite number for each joint
    """
    q_ref = np.zeros(robot.joints) if q_ref is None else checked_joints(robot, q_ref, "q_ref")
    if q_ref.ndim != 1:
        raise ShapeError("q_ref", q_ref.shape, f"({robot.joints},)")
    if not np.isfinite(q_ref).all():
        raise PoseError("q_ref holds NaN or infinity")
    return q_ref


def _free_joints_near(robot: Robot, T: Reals, q: Reals, q_ref: Reals, continua: tuple[Family, ...]) -> Reals:
    """The slots (8, 6) with free joints where their nearest family has them, unless they are nearer as they are.

    A family solves the pose to 1e-9, so next to a second singularity its nearest member can lie 1e-8 rad from arms
    that solve it to rounding.
    """
    factors = determinant_factors(robot, q)
    exact = {"wrist": np.abs(factors.wrist) < FREE, "shoulder": np.abs(factors.shoulder) < FREE}
    exact["elbow"] = np.ones(len(q), dtype=bool)
    reference, moved = np.tile(q_ref, (len(q), 1)), np.zeros(len(q), dtype=bool)
    for family in reversed(continua):
        for slot in family.branches:
            if exact[family.kind][slot]:
                reference[slot], moved[slot] = family.q0, True
    again = solve_slots(robot, np.broadcast_to(T, (len(q), 4, 4)), reference, keep_folds=True, keep_free=True)[0]
    again = again[np.arange(len(q)), np.arange(len(q))]
    away, away_again = (np.abs(wrap_to_pi(rows - q_ref)).max(axis=1) for rows in (q, again))
    return np.where((moved & (away_again < away))[:, None], again, q)


def _unsolved(robot: Robot, fault: NDArray[np.int8], gap: Reals) -> tuple[solutions.Unsolved, ...]:
    """Why a shoulder side has no branch: by that of its four slots which misses least."""
    sides = {0, 4} - {4 * (slot // 4) for slot in np.flatnonzero(fault == REACHED).tolist()}
    best = [side + int(np.argmin(gap[side : side + 4])) for side in sorted(sides)]
    whys = [_out_of_reach(robot, int(fault[slot]), float(gap[slot])) for slot in best]
    return tuple(fact("side_unsolved", side=solutions.side_of(robot, slot), why=why) for slot, why in zip(best, whys))


def _out_of_reach(robot: Robot, fault: int, gap: float) -> Finding:
    """The reason behind a slot's fault, with its gap in mm or deg."""
    arm = wrist_partitioned_arm(robot)
    if fault == ORIENTATION:
        return fact("wrist_tilts_too_little", missing_deg=float(np.degrees(gap)))
    if fault == OFF_AXIS:
        return fact("wrist_too_near_axis_1", gap_mm=gap * 1000)
    if fault == TOO_FAR:
        return fact("wrist_too_far", gap_mm=gap * 1000, reach_mm=arm.wrist_reach * 1000)
    return fact("wrist_too_near", gap_mm=gap * 1000, least_mm=abs(arm.upper_arm_length - arm.forearm_length) * 1000)
