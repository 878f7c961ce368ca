"""All joint solutions of any arm, by the class of its geometry, from blocks of poses to self-motions.

The chain's solver (:mod:`er3a.kinematics.classes.chain_solvers`) works with rotations and shifts of the table's rows;
this module converts them by direction, offset and coupling. Poses at which branches meet, a joint is free, or the
solver is in doubt are treated one by one. Rows that can move without moving the tool are members of a self-motion,
which is traced and listed with its member nearest to the reference. Random starts search for missing solutions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from er3a.by_value import by_identity
from er3a.errors import ShapeError
from er3a.geometry.transforms import frame_along, rotation_angle, transposed
from er3a.kinematics.chain import constant_links, joint_starts, size_of
from er3a.kinematics.classes.arm_angle import is_out_of_reach
from er3a.kinematics.classes.chain_solvers import Unsolved, chain_solver
from er3a.kinematics.classes.class_solvers import (
    ALL_OF_POSE,
    ARM_CLASSES,
    ArmAngle,
    ArmClassCode,
    ChainSolver,
    LinkedRows,
    ParallelAxes,
    Redundancy,
)
from er3a.kinematics.classes.parallel_axes import solve_parallel_blocks
from er3a.kinematics.classes.self_motion import OPEN_ROLL, POSE, POSITION, PoseChain, TracedCurve
from er3a.kinematics.classes.six_revolute import CERTAIN, CONTINUUM, UNCERTAIN
from er3a.kinematics.forward import CONFIRMS, forward, joints_for_blocks
from er3a.kinematics.self_motions import SelfMotionCurve, self_motion_of, to_rows
from er3a.numerics.arrays import Flags, Integers, Reals, as_floats
from er3a.numerics.jit import kernel, parallel_for
from er3a.robots.joint_limits import nearest_equivalent, row_limits, unwound, within
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import LIMIT_TOLERANCE, nearest_turn, shortest_move, uncoupling, uncoupling_of_linkage

SAME_ROW = 1e-6  # rad or parts of the arm's size
OWN_SOLVES, MISSED = 1e-12, 1e-4  # m and parts of 1; rad or m from all rows
MAYBE_SAME = 1e-2  # rad
IN_LINE = 1e-9  # rad by which an axis that is taken as the tool's z may be askew
SPREAD = 1e-13  # residual, in parts of the size, that rounding leaves at a root
MAX_CURVES, MAX_ON_SURFACE = 24, 2  # self-motions of a pose that are traced, and those of them on surfaces
MOVES_BELOW = 3e-8  # smallest singular value above which rows of three parallel axes, known to rounding, can't move
STARTS, FEW_STARTS = 240, 32  # random starts in the search for self-motions; few for arms of fewer than six joints
TRACED: dict[ArmClassCode, int] = {"free_roll": OPEN_ROLL, "position": POSITION}
SMALLEST_PART = 64  # poses that are worth a thread's start
SCANNED = 16  # values of a redundancy parameter from which self-motions are collected
TRIED, CLOSER = 32, 3  # values that are tried where the one asked for has no rows; how often closer ones are


@by_identity
class ArmSolver:
    """An arm's chain of m rows as its solver takes it.

    ``uncouple`` (n, m) undoes the coupling, None where there is none. ``task_frame`` (4, 4) turns the tool's frame to
    that of the task, in which z is the axis that five joints leave open, or that a SCARA turns about.
    """

    chain: ChainSolver
    links: Reals
    sliding: Flags
    size: float
    task_frame: Reals
    uncouple: Reals | None = None

    def poses_at(self, T: Reals) -> PoseChain:
        """The chain closed by one pose, with what its class meets of the pose.

        Parameters
        ----------
        T : (4, 4), m

        Returns
        -------
        chain : for errors, roots and self-motions at this pose
        """
        links = np.concatenate([self.links[:-1], self.links[-1:] @ self.task_frame])
        return PoseChain.of(links, self.sliding, T @ self.task_frame, self.size, TRACED.get(self.chain.code, POSE))


@by_identity
class Settled:
    """Solutions of one pose: isolated ones, and self-motions, nearest to the reference first."""

    alone: Reals
    motions: tuple[SelfMotionCurve, ...] = ()


@derived
def arm_solver(robot: Robot) -> ArmSolver:
    """The solver for the class of the robot's geometry.

    Parameters
    ----------
    robot : any; limits don't matter

    Returns
    -------
    solver : its chain is ``Unsolved`` where no class applies
    """
    links = constant_links(robot)
    sliding = np.ascontiguousarray(robot.sliding)
    uncouple = uncoupling(robot)
    if robot.coupling is not None and uncouple is None:
        uncouple = uncoupling_of_linkage(robot)
        chain = Unsolved(robot.joints) if uncouple is None else _linked(robot, chain_solver(links, sliding), uncouple)
        return ArmSolver(chain, links, sliding, size_of(links), np.eye(4), uncouple)
    # Row 2 of the last link's rotation: the direction of axis n in coordinates of the tool.
    last = links[-1, 2, :3]  # the last joint's axis in the tool's frame
    pointing = last if np.array_equal(robot.tool[:3, :3], np.eye(3)) else np.array([0.0, 0.0, 1.0])
    chain, frame = chain_solver(links, sliding, pointing), np.eye(4)
    axis = {"free_roll": pointing, "scara": last}.get(chain.code, frame[2, :3])
    if np.hypot(axis[0], axis[1]) > IN_LINE:
        frame[:3, :3] = frame_along(axis).T
    return ArmSolver(chain, links, sliding, size_of(links), frame, uncouple)


def _linked(robot: Robot, chain: ChainSolver, uncouple: Reals) -> ChainSolver:
    """The solver of a chain with more rows than joints, of those rows alone that the joints can make."""
    if chain.parameters or isinstance(chain, Unsolved) or ARM_CLASSES[chain.code].task != ALL_OF_POSE:
        return Unsolved(robot.joints)
    apart = np.eye(robot.rows) - np.asarray(robot.coupling) @ uncouple
    return LinkedRows(chain, apart * robot.direction, joint_starts(robot), robot.sliding, chain.code, chain.slots)


def to_joints(robot: Robot, x: Reals) -> Reals:
    """The manufacturer's joint values for the motion of the table's rows.

    Parameters
    ----------
    x : (..., m), rad or m, offsets included

    Returns
    -------
    q : (..., n), rad or m; angles in (-pi, pi], those of the rows if coupled
    """
    uncouple = arm_solver(robot).uncouple
    u = robot.direction * (x - joint_starts(robot))
    return unwound(robot, u if uncouple is None else u @ uncouple.T)


def parameters_of(robot: Robot) -> tuple[Redundancy, ...]:
    """What a pose leaves open: the redundancy parameters of the arm's class.

    Returns
    -------
    parameters : empty for arms of up to six joints
    """
    return arm_solver(robot).chain.parameters


def checked_parameters(robot: Robot, redundancy: Reals | None, q_ref: Reals, count: int) -> Reals:
    """Values of the redundancy parameters as the solver takes them.

    Parameters
    ----------
    redundancy : (k,) or (N, k), as the user gives them: a locked joint as the manufacturer's value (of coupled joints
        what its row moves by), an arm angle in rad; None: those of the reference
    q_ref : (1 or N, n), rad or m
    count : number of poses, N

    Returns
    -------
    values : (N, k), rad or m, joints as row values with direction and offset

    Raises
    ------
    ShapeError, PoseError
        if ``redundancy`` has another shape, or holds what is no number
    """
    parameters = parameters_of(robot)
    if redundancy is None:
        values = arm_solver(robot).chain.values_of(to_rows(robot, q_ref))
        return np.ascontiguousarray(np.broadcast_to(values, (count, len(parameters))))
    given = np.atleast_1d(as_floats(redundancy, "redundancy"))
    if given.shape[-1] != len(parameters) or given.ndim > 2 or (given.ndim == 2 and len(given) != count):
        raise ShapeError("redundancy", given.shape, f"({len(parameters)},) or ({count}, {len(parameters)})")
    values = np.array(np.broadcast_to(given, (count, len(parameters))))
    for k, parameter in enumerate(parameters):
        if parameter.joint >= 0:
            j = parameter.joint
            values[:, k] = robot.direction[j] * values[:, k] + joint_starts(robot)[j]
    return values


def class_rows(robot: Robot, T: Reals, values: Reals) -> Reals:
    """All rows that the class finds for poses.

    Parameters
    ----------
    T : (N, 4, 4), m
    values : (N, k), of the redundancy parameters, see :func:`checked_parameters`

    Returns
    -------
    q : (N, slots, n), manufacturer's values, angles in (-pi, pi]; NaN in empty slots
    """
    return to_joints(robot, arm_solver(robot).chain.rows(T, values)[0])


def settle(robot: Robot, T: Reals, rows: Reals, q_ref: Reals, certainty: int) -> Settled:
    """Solutions of one pose, divided into isolated ones and self-motions.

    Parameters
    ----------
    T : (4, 4), m
    rows : (k, n), rad or m, what the class found, without NaN
    q_ref : (n,), rad or m
    certainty : of the class at this pose

    Returns
    -------
    settled : isolated rows, and self-motions (those within the limits first, then the nearest to the reference)
    """
    solver = arm_solver(robot)
    if isinstance(solver.chain, Unsolved | LinkedRows) or (solver.chain.code == "scara" and not len(rows)):
        return Settled(rows[distinct(robot, rows, SAME_ROW)])
    if solver.chain.code == "scara":  # without the tilt that no joint can take away
        T = forward(robot, rows[0])
    chain = solver.poses_at(T)
    found = [to_rows(robot, rows), *solver.chain.seeds(T)]
    if chain.error(to_rows(robot, q_ref)) < 1e-11:
        found.insert(0, to_rows(robot, q_ref)[None])
    in_doubt = certainty == CONTINUUM or (certainty == UNCERTAIN and solver.sliding.any())
    if in_doubt and ARM_CLASSES[solver.chain.code].searched:
        few = certainty == UNCERTAIN and robot.joints < 6
        found.append(chain.roots(_starts(robot, FEW_STARTS if few else STARTS)))
    candidates = np.concatenate(found)
    curves: list[TracedCurve] = []
    alone: list[Reals] = []
    for x in candidates:
        if any(chain.holds(curve, x) for curve in curves) or _is_same_root(robot, x, alone, chain):
            continue
        surface = sum(curve.dimension > 1 for curve in curves)
        if len(curves) >= MAX_CURVES or surface >= MAX_ON_SURFACE:
            if not chain.moves(x):
                alone.append(x)
            continue
        # Rows of this class are known to rounding, so a Jacobian clearly of full rank needs no tracing.
        stuck = solver.chain.code == "three_parallel" and chain.smallest(x) > MOVES_BELOW
        curve = None if stuck else chain.curve(x)
        if curve is not None:
            curves.append(curve)
        else:
            alone.append(x)
    single = np.array([x for x in alone if not any(chain.holds(curve, x) for curve in curves)])
    single = single.reshape(-1, len(solver.sliding))
    motions = [
        motion
        for curve in curves
        for motion in self_motion_of(robot, T, chain, curve, q_ref)
        if confirms(robot, T, np.array([motion.q0, motion.max_margin_member])).all()
    ]
    motions.sort(key=lambda motion: (not motion.within_limits, float(np.linalg.norm(motion.q0 - q_ref))))
    return Settled(to_joints(robot, single), tuple(motions))


def all_motions(robot: Robot, T: Reals, q_ref: Reals, values: Reals) -> Settled:
    """Self-motions of a pose of an arm with one redundancy parameter, from rows at values all over its range.

    Parameters
    ----------
    T : (4, 4), m
    q_ref : (n,), rad or m
    values : (1, 1), rad or m, a further value to look at

    Returns
    -------
    settled : as of :func:`settle`; nothing if the pose is out of reach
    """
    solver = arm_solver(robot)
    if isinstance(solver.chain, ArmAngle) and is_out_of_reach(solver.chain.arm, T):
        return Settled(np.empty((0, robot.joints)))
    grid = np.concatenate([values, _scanned(robot, SCANNED)])
    q = class_rows(robot, np.broadcast_to(T, (len(grid), 4, 4)), grid).reshape(-1, robot.joints)
    more = to_joints(robot, solver.poses_at(T).roots(_starts(robot, STARTS)))  # curves between the values scanned
    return settle(robot, T, np.concatenate([q[np.isfinite(q[:, 0])], more]), q_ref, CERTAIN)


def _scanned(robot: Robot, count: int) -> Reals:
    """Values (count, 1) of the redundancy parameter all over its range, as the solver takes them."""
    span, joint = np.linspace(-np.pi, np.pi, count, endpoint=False), parameters_of(robot)[0].joint
    if joint >= 0:
        if robot.sliding[joint]:
            low, high = row_limits(robot)[joint].tolist()
            span = np.linspace(low, high, count)
        span = robot.direction[joint] * span + joint_starts(robot)[joint]
    return span[:, None]


def nearest_value(robot: Robot, T: Reals, q_ref: Reals, values: Reals) -> Reals:
    """The value of the redundancy parameter, near a given one, at which a pose has rows.

    Parameters
    ----------
    T : (4, 4), m
    q_ref : (n,), rad or m
    values : (1, 1), rad or m, the value that is asked for, see :func:`checked_parameters`

    Returns
    -------
    values : (1, 1), at which rows are within the limits if there is one among those that are tried, else as given
    """
    tried, parameter = _scanned(robot, TRIED), parameters_of(robot)[0]
    turns = parameter.joint < 0 or not robot.sliding[parameter.joint]
    step, most = tried[1] - tried[0], TRIED
    for _ in range(1 + CLOSER):
        away = np.abs(np.remainder(tried - values + np.pi, 2 * np.pi) - np.pi if turns else tried - values)
        tried = tried[away[:, 0].argsort(kind="stable")[:most]]
        q = nearest_equivalent(robot, class_rows(robot, np.broadcast_to(T, (len(tried), 4, 4)), tried), q_ref)
        fits = np.flatnonzero(within(robot, q).any(axis=1))
        if not fits.size:
            return values
        found = tried[fits[:1]]
        tried, step, most = found + step * np.linspace(-1, 1, 9)[:, None], step / 4, 5  # no farther than found
    return found


@by_identity
class LazySelfMotions(Sequence[SelfMotionCurve]):
    """What :func:`all_motions` gives, traced when it is first read."""

    robot: Robot
    T: Reals
    q_ref: Reals
    values: Reals

    @cached_property
    def traced(self) -> tuple[SelfMotionCurve, ...]:
        """The self-motions, nearest to the reference first."""
        return all_motions(self.robot, self.T, self.q_ref, self.values).motions

    def __getitem__(self, index: Any) -> Any:
        return self.traced[index]

    def __len__(self) -> int:
        return len(self.traced)


def _starts(robot: Robot, count: int) -> Reals:
    """Random row values (count, m), rad and parts of the size; the same at each call."""
    solver = arm_solver(robot)
    random = np.random.default_rng([20261121, count])
    return random.uniform(-1, 1, (count, len(solver.sliding))) * np.where(solver.sliding, 1.5, np.pi)


def distinct(robot: Robot, rows: Reals, most: float) -> Flags:
    """Which rows are no earlier one, whole turns aside.

    Parameters
    ----------
    rows : (k, n), rad or m
    most : rad or m by which equal rows differ

    Returns
    -------
    first : (k,) bool
    """
    away = np.abs(shortest_move(robot, rows[:, None] - rows)).max(axis=2, initial=0.0)
    return np.asarray(~np.triu(away < most, 1).any(axis=0))


def _is_same_root(robot: Robot, x: Reals, others: list[Reals], chain: PoseChain) -> bool:
    """Whether row values (n,) are the same root as some others.

    Newton's method leaves a root of higher order spread: those that are nearer than what an error of ``SPREAD`` makes
    of them there are one.
    """
    if not others:
        return False
    away = to_joints(robot, np.array([x])) - to_joints(robot, np.array(others))
    apart = float(np.abs(shortest_move(robot, away)).max(axis=1).min())
    return apart < SAME_ROW or (apart < MAYBE_SAME and apart * chain.smallest(x) < SPREAD)


@by_identity
class ClassSlots:
    """All slots of a block of poses.

    Attributes
    ----------
    q : (N, S, n), by the turns nearest to the reference; inside : (N, S), whether within the limits
    certainty : (N,); settled : what was examined one by one, by the pose's number
    unconfirmed : which poses' rows forward kinematics has not confirmed yet
    """

    q: Reals
    inside: Flags
    certainty: Integers
    settled: dict[int, Settled]
    unconfirmed: Integers | slice


def slots_of_class(
    robot: Robot, T: Reals, q_ref: Reals, values: Reals, threads: int = 1, *, settling: bool = True
) -> ClassSlots:
    """All slots for poses, by the class, with doubtful poses settled one by one.

    Poses at which a joint may be free, or that left a doubt, are settled one by one, if the arm has no more than six
    joints. Without ``settling`` they keep what the class found: solutions all, but of a self-motion any members.

    Parameters
    ----------
    T : (N, 4, 4), m
    q_ref : (1 or N, n), rad or m
    values : (N, k), of the redundancy parameters
    threads : for the class; what is settled runs in one
    settling : see above

    Returns
    -------
    slots : (N, S, n), rad or m, by the turns nearest to the reference
    """
    solver = arm_solver(robot)
    count, slots = len(T), solver.chain.slots
    q, certainty = np.empty((count, slots, robot.joints)), np.full(count, CERTAIN)
    inside = np.empty((count, slots), dtype=bool)
    plain = robot.coupling is None and not robot.combined and not robot.continuous.any()
    left: Integers | slice = slice(None)
    if plain and isinstance(solver.chain, ParallelAxes):
        left = _regular_slots(robot, solver.chain, T, q_ref, threads, (q, inside))
    pendant = robot.direction, joint_starts(robot), robot.sliding, robot.lower, robot.upper

    def part(rows: slice) -> None:
        numbers = rows if isinstance(left, slice) else left[rows]
        x, certainty[numbers] = solver.chain.rows(T[numbers], values[numbers])
        own = q_ref if len(q_ref) == 1 else q_ref[numbers]
        found, fits = q[numbers], inside[numbers]  # views of a slice, copies else
        if plain:
            to_pendant(pendant, np.ascontiguousarray(x), own, found, fits)
        else:
            found[:] = nearest_equivalent(robot, to_joints(robot, x), own[:, None])
            fits[:] = within(robot, found)
        q[numbers], inside[numbers] = found, fits

    parallel_for(count if isinstance(left, slice) else len(left), threads, SMALLEST_PART, part)
    settled: dict[int, Settled] = {}
    if not settling:
        return ClassSlots(q, inside, certainty, settled, left)
    alone = not solver.chain.parameters  # self-motions of redundant arms come from `all_motions`
    for n in np.flatnonzero(certainty != CERTAIN).tolist() if alone else ():
        own = q_ref[0 if len(q_ref) == 1 else n]
        rows = unwound(robot, q[n])
        settled[n] = settle(robot, T[n], rows[np.isfinite(rows[:, 0])], own, int(certainty[n]))
        q[n] = nearest_equivalent(robot, _in_slots(robot, rows, settled[n]), own)
        inside[n] = within(robot, q[n])
    each_its_own = alone and len(q_ref) == count
    own_looked_for = np.arange(count) if each_its_own else np.flatnonzero(certainty != CERTAIN)
    _with_own(robot, T, q_ref, own_looked_for, (q, inside, certainty))
    return ClassSlots(q, inside, certainty, settled, left)


def _regular_slots(
    robot: Robot, chain: ParallelAxes, T: Reals, q_ref: Reals, threads: int, out: tuple[Reals, Flags]
) -> Integers:
    """Fill slots and whether they are within the limits by the closed form, confirmed; gives the poses left (k,)."""
    T, (q, inside), marked = np.ascontiguousarray(T, dtype=float), out, np.empty(len(T), dtype=bool)
    joints, limits = (joints_for_blocks(robot), constant_links(robot)), (robot.lower, robot.upper)

    def part(rows: slice) -> None:
        own = np.ascontiguousarray(q_ref if len(q_ref) == 1 else q_ref[rows])
        pendant = joints, limits, own, inside[rows]
        solve_parallel_blocks(chain.arm.constants, T[rows], 0.0, pendant, q[rows], marked[rows])

    parallel_for(len(T), threads, SMALLEST_PART, part)
    return np.flatnonzero(marked)


def _with_own(robot: Robot, T: Reals, q_ref: Reals, numbers: Integers, found: tuple[Reals, Flags, Integers]) -> None:
    """Put references that solve their poses to rounding in a slot where no row is them.

    Next to two singularities a pose does not determine all joints to rounding, and a row that it gives instead of the
    arm's own can lie beyond a limit. The slot is that of the row nearest to the reference if that is near, else one
    that is empty, else the nearest. ``numbers`` (k,) are the poses looked at; ``found`` rows (N, S, n), which of them
    are within the limits (N, S), and certainty (N,).
    """
    q, inside, certainty = found
    numbers = numbers[_missing(q, inside, q_ref, numbers)]
    own = q_ref[numbers] if len(q_ref) == len(T) else np.broadcast_to(q_ref[0], (len(numbers), robot.joints))
    solves = np.abs(forward(robot, own) - T[numbers]).max(axis=(1, 2), initial=0.0) < OWN_SOLVES
    for n, row in zip(numbers[solves].tolist(), own[solves]):
        away, fits = _moves_between(robot, q[n], row), bool(within(robot, row))
        if away.min() < SAME_ROW and not fits:
            continue
        slot = int(away.argmin())
        if away[slot] > MAYBE_SAME and np.isinf(away).any():
            slot = int(np.isinf(away).argmax())
        # A solution far from all rows: the class has missed one, so it can't be sure of the others.
        if away.min() > MISSED and certainty[n] == CERTAIN:
            certainty[n] = UNCERTAIN
        q[n, slot], inside[n, slot] = row, fits


@kernel
def _missing(q: Reals, inside: Flags, q_ref: Reals, numbers: Integers) -> Flags:
    """Whether no row within the limits is the reference (k,), of the poses with these numbers (k,)."""
    missing = np.ones(numbers.shape[0], np.bool_)
    for i in range(numbers.shape[0]):
        n = numbers[i]
        ref = q_ref[n if q_ref.shape[0] > 1 else 0]
        for slot in range(q.shape[1]):
            if not inside[n, slot]:
                continue
            far = 0.0
            for j in range(q.shape[2]):
                far = max(far, abs(q[n, slot, j] - ref[j]))
            if far < SAME_ROW:
                missing[i] = False
                break
    return missing


Pendant = tuple[Reals, Reals, Flags, Reals, Reals]


@kernel
def to_pendant(pendant: Pendant, x: Reals, q_ref: Reals, q: Reals, inside: Flags) -> None:
    """Take rows of the solver to the manufacturer's values, for arms without coupling. Kernel.

    Parameters
    ----------
    pendant : direction, start, sliding, lower and upper limits (n,)
    x : (N, S, n), rad or m, row values
    q_ref : (1 or N, n), rad or m
    q : (N, S, n), filled, in the turns that :func:`er3a.robots.joint_limits.nearest_equivalent` takes
    inside : (N, S), filled with whether the limits are kept
    """
    direction, start, sliding, lower, upper = pendant
    slots, n = x.shape[1], x.shape[2]
    # all slots in one row and no branches, so that the processor takes several joints at once
    of = np.arange(slots * n) % n
    sign, zero, stays, lowest, highest = direction[of], start[of], sliding[of], lower[of], upper[of]
    rows, found = x.reshape(x.shape[0], slots * n), q.reshape(x.shape[0], slots * n)
    ref = q_ref[0][of]
    for i in range(x.shape[0]):
        if q_ref.shape[0] > 1:
            ref = q_ref[i][of]
        for m in range(slots * n):
            value = sign[m] * (rows[i, m] - zero[m])
            turned = nearest_turn(value, ref[m], lowest[m], highest[m])
            found[i, m] = value if stays[m] else turned
        for slot in range(slots):
            fits = True
            for j in range(n):
                value = found[i, slot * n + j]
                fits &= (value <= upper[j] + LIMIT_TOLERANCE) & (value >= lower[j] - LIMIT_TOLERANCE)
            inside[i, slot] = fits


def _in_slots(robot: Robot, rows: Reals, settled: Settled) -> Reals:
    """Isolated solutions, one per slot (S, n); those on a self-motion are replaced by its member nearest to the
    reference, and further solutions fill free slots."""
    kept, left = np.full_like(rows, np.nan), []
    for row in settled.alone:
        far = _moves_between(robot, rows, row)
        slot = int(far.argmin())
        if far[slot] < SAME_ROW and np.isnan(kept[slot, 0]):
            kept[slot] = row
        else:
            left.append(row)
    left += [motion.q0 for motion in settled.motions]
    free = np.flatnonzero(np.isnan(kept[:, 0]))
    taken = np.flatnonzero(np.isnan(kept[:, 0]) & np.isfinite(rows[:, 0]))
    order = [*taken, *(slot for slot in free if slot not in set(taken.tolist()))]
    for slot, row in zip(order, left):
        kept[slot] = row
    return kept


def _moves_between(robot: Robot, rows: Reals, q: Reals) -> Reals:
    """Largest joint moves (k,) from rows (k, n) to joint values (n,), whole turns off; infinite from rows of NaN."""
    away = np.abs(shortest_move(robot, rows - q)).max(axis=1)
    return np.where(np.isnan(away), np.inf, away)


def slot_of(robot: Robot, T: Reals, q: Reals) -> int:
    """The slot of joint values that solve a pose.

    Parameters
    ----------
    T : (4, 4), m
    q : (n,), rad or m

    Returns
    -------
    slot : 0 if they are none of the class's rows
    """
    values = checked_parameters(robot, None, q[None], 1)
    rows = class_rows(robot, T[None], values)[0]
    far = _moves_between(robot, rows, q)
    return int(far.argmin()) if far.min() < SAME_ROW else 0


@derived
def task_mask(robot: Robot) -> Reals:
    """Which components of a pose the arm's solutions meet.

    Returns
    -------
    mask : (6,), 1 or 0 for x, y, z and the rotations about x, y, z of the frame of :func:`with_task_frame`

    Notes
    -----
    All, but for arms with fewer than six joints: five leave the turn about the tool's axis (if they can't do it
    themselves), a SCARA the tool's tilt, three joints the orientation. The tool's axis is its z where the robot's tool
    is turned from the flange, which says where it points; else the direction of the last joint's axis.
    """
    mask = np.array(ARM_CLASSES[arm_solver(robot).chain.code].task, dtype=float)
    mask.setflags(write=False)
    return mask


@derived
def meets_poses(robot: Robot) -> bool:
    """Whether the arm's solutions meet all of a pose, with nothing left open by :func:`task_mask`.

    Returns
    -------
    whole : True for arms of six joints and more
    """
    return bool(task_mask(robot).all())


@derived
def with_task_frame(robot: Robot) -> Robot:
    """The robot with its tool turned to the frame in which :func:`task_mask` counts.

    Returns
    -------
    robot : most often the same object
    """
    frame = arm_solver(robot).task_frame
    return robot if np.array_equal(frame, np.eye(4)) else robot.replace(tool=robot.tool @ frame)


def misses(robot: Robot, T: Reals, q: Reals) -> tuple[Reals, Reals, Reals]:
    """By how much rows miss poses, by forward kinematics.

    Parameters
    ----------
    T : (..., 4, 4), m
    q : (..., n), rad or m

    Returns
    -------
    position : (...), m
    rotation : (...), rad, like the position in what the arm's task asks
    freed : (...), rad, the tool's turn from the pose in what the task leaves open; 0 where it leaves nothing

    Notes
    -----
    NaN for rows that hold NaN.
    """
    back = forward(robot, q)
    position = np.linalg.norm(back[..., :3, 3] - T[..., :3, 3], axis=-1)
    rotation, asked = (
        rotation_angle(back[..., :3, :3], T[..., :3, :3]),
        tuple(task_mask(robot)[3:].astype(int).tolist()),
    )
    if all(asked):
        return position, rotation, np.zeros_like(rotation)
    F = arm_solver(robot).task_frame[:3, :3]
    R, freed = F.T @ transposed(T[..., :3, :3]) @ back[..., :3, :3] @ F, rotation
    if asked == (1, 1, 0):
        return position, np.arctan2(np.hypot(R[..., 0, 2], R[..., 1, 2]), R[..., 2, 2]), freed
    # The turn about z that brings R nearest to the identity, for any tilt.
    about_z = np.arctan2(R[..., 1, 0] - R[..., 0, 1], R[..., 0, 0] + R[..., 1, 1])
    return position, np.abs(about_z) * asked[2], freed


def confirms(robot: Robot, T: Reals, q: Reals) -> Flags:
    """Whether forward kinematics confirms rows of poses, to ``CONFIRMS`` in m and rad.

    Parameters
    ----------
    T : (..., 4, 4), m
    q : (..., n), rad or m

    Returns
    -------
    confirmed : (...) bool, False for NaN
    """
    off = forward(robot, q) - T
    if np.abs(off, out=off).max(initial=0.0) <= CONFIRMS / 3:  # bounds both, in a fifth of the time
        return np.ones(off.shape[:-2], dtype=bool)
    position, rotation, _ = misses(robot, T, q)
    return np.asarray((position <= CONFIRMS) & (rotation <= CONFIRMS))
