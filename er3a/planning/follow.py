"""Joint angles along a line of the tool: the sequence of closed-form branches that is best as a whole.

On the grid of :mod:`er3a.planning.branch_tracking`, dynamic programming [1]_ finds for each branch at the start the
best way to continue to the end. Best means, in this order: fewest jumps (a joint would have to move far in no time),
least time outside the limits, of joints and of sums of joints, least joint travel, and among equals the greatest
distance from the limits. Whole turns cost no states of their own: along a continuous sequence they are fixed by the
first angle, so each joint's turn is chosen once per stretch, by least time outside the limits, then nearest to the
joints before. Among the branches at the start, the best whole sequence wins; given start joints admit only the branches
that they lie on (several, if the start is singular).

An unreachable pose interrupts the sequence; the stretch behind it is solved on its own.

References
----------
.. [1] R. Bellman, *Dynamic Programming*, Princeton, 1957.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from er3a.errors import PoseError
from er3a.geometry.angles import TURN
from er3a.kinematics.closed_form import SLOTS
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.numerics.jit import kernel
from er3a.numerics.runs import runs
from er3a.planning.branch_tracking import WIDE_STEP, Branches, branches_along, turned_difference, wrist_joints
from er3a.planning.followed import BranchJump, Followed
from er3a.planning.moves import ToolPath
from er3a.robots.joint_limits import limit_margin, nearest_equivalent, within
from er3a.robots.robot import Robot
from er3a.robots.whole_turns import LIMIT_TOLERANCE

JUMP_COST = 1e7
OUTSIDE_COST = 1e4  # for the whole duration
SAME_JOINTS = 1e-6
SWITCH_STEP = 1e-4
EQUAL = 6  # digits of rad to which travel and margin count


@dataclass(frozen=True, eq=False)
class _Sequence:
    """One way through a stretch: angles (n, 6) in rad, slots (n,), jumps behind points (n - 1,), and its cost."""

    q: Reals
    slot: Integers
    jumps: Flags
    cost: tuple[float, float, float, float]


def follow(
    robot: Robot, line: ToolPath, t: Reals, q_start: Reals | None = None, start_slot: int | None = None
) -> Followed:
    """Follow a line.

    Parameters
    ----------
    t : (N,), s, rising from 0 to the line's duration: where to solve at least
    q_start : (6,), rad, joints at the start, whose tool pose is the line's first
    start_slot : closed-form branch (0..7) to begin on; None for the best

    Raises
    ------
    PoseError
        if ``start_slot`` has no solution at the start
    NotWristPartitionedError
        if the arm has no closed form here
    """
    grid = branches_along(robot, line, np.asarray(t, float))
    q = np.full((len(grid.t), 6), np.nan)
    slot = np.full(len(grid.t), -1)
    before, jumps = q_start, []
    for first, last in runs(np.any(grid.reached, axis=1)):
        starts = np.flatnonzero(grid.reached[first])
        if first == 0:
            starts = _admitted(robot, grid, starts, q_start, start_slot)
        best = _best(robot, grid, slice(first, last), starts, before)
        q[first:last], slot[first:last] = best.q, best.slot
        jumps += [_jump(grid.t, q, first + i) for i in np.flatnonzero(best.jumps).tolist()]
        before = best.q[-1]
    turn = q[0] - q_start if q_start is not None else np.zeros(6)
    turn = np.where(np.abs(turn) < SAME_JOINTS, 0.0, turn)
    return Followed(robot, line, grid.t, grid.progress, q, slot, turn, tuple(jumps))


def _admitted(
    robot: Robot, grid: Branches, starts: Integers, q_start: Reals | None, start_slot: int | None
) -> Integers:
    if start_slot is not None:
        if start_slot not in starts:
            raise PoseError(f"the start pose has no solution on branch {start_slot}")
        return np.array([start_slot])
    if q_start is None:
        return starts
    distance = np.abs(turned_difference(grid.q[0], q_start))
    distance[np.ix_(grid.free_wrist[0], wrist_joints(robot))] = 0.0
    distance[np.ix_(grid.free_shoulder[0], [0, 3, 4, 5])] = 0.0
    worst = distance.max(axis=1)[starts]
    admitted: Integers = starts[worst <= max(SAME_JOINTS, worst.min())]
    return admitted


def _best(robot: Robot, grid: Branches, part: slice, starts: Integers, before: Reals | None) -> _Sequence:
    q, t = grid.q[part], grid.t[part]
    share = np.gradient(t) / grid.t[-1] if len(t) > 1 else np.zeros(1)
    fits = within(robot, nearest_equivalent(robot, q, np.zeros(6)))
    price = np.where(fits, 0.0, OUTSIDE_COST * share[:, None])
    onward, leaps = _costs_to_go(q, price, grid.meeting[part])
    sequences = []
    for start in starts:
        slot = _walk(onward, start)
        jumps = leaps[np.arange(len(t) - 1), slot[:-1]]
        sequences.append(_turned(robot, q[np.arange(len(t)), slot], slot, jumps, share, before))
    return min(sequences, key=lambda sequence: sequence.cost)


def _turned(robot: Robot, q: Reals, slot: Integers, jumps: Flags, share: Reals, before: Reals | None) -> _Sequence:
    """Make angles continuous and choose each joint's whole turns: those that leave its limits, and those of sums of
    joints, for the least part of the time, then the nearest."""
    steps = turned_difference(q[:-1], q[1:])
    unwound = q[0] + np.concatenate([np.zeros((1, 6)), np.cumsum(steps, axis=0)])
    reference = np.zeros(6) if before is None else before
    priced: list[list[tuple[float, float, int]]] = []
    for j in range(6):
        low = int(np.floor((robot.lower[j] - unwound[:, j].max()) / TURN))
        high = int(np.ceil((robot.upper[j] - unwound[:, j].min()) / TURN))
        nearest = round((reference[j] - unwound[0, j]) / TURN)
        fixed = robot.continuous[j] or (
            before is not None and abs(unwound[0, j] + TURN * nearest - reference[j]) < SAME_JOINTS
        )
        priced.append([])
        for turn in [nearest] if fixed else sorted({nearest, *range(low, high + 1)}):
            angle = unwound[:, j] + TURN * turn
            beyond = (angle > robot.upper[j] + LIMIT_TOLERANCE) | (angle < robot.lower[j] - LIMIT_TOLERANCE)
            beyond &= ~robot.continuous[j]
            priced[j].append((round(float(share[beyond].sum()), 6), abs(angle[0] - reference[j]), turn))
    outside, turns = _cheapest(robot, unwound, share, priced)
    unwound += TURN * turns
    travel = float(np.linalg.norm(steps, axis=1).sum() + np.linalg.norm(unwound[0] - reference))
    margin = float(limit_margin(robot, unwound).min())
    return _Sequence(unwound, slot, jumps, (float(jumps.sum()), outside, round(travel, EQUAL), -round(margin, EQUAL)))


def _cheapest(
    robot: Robot, q: Reals, share: Reals, priced: list[list[tuple[float, float, int]]]
) -> tuple[float, Reals]:
    """For what part of the time a motion q (N, 6) leaves limits, each counted, and the turns (6,) of its joints.

    Joints that sums are limited of are chosen together, the others each by itself.

    Parameters
    ----------
    share : (N,), part of the time that each point stands for
    priced : for each joint, its turns, for what part of the time it leaves its limits, and how far it is at first
    """
    choice = [min(each) for each in priced]
    summed = [j for j in range(6) if any(limit.factors[j] for limit in robot.combined)]

    def price(turns: Reals) -> float:
        total = (q + TURN * turns) @ np.array([limit.factors for limit in robot.combined]).T
        ends = np.array([(limit.lower - LIMIT_TOLERANCE, limit.upper + LIMIT_TOLERANCE) for limit in robot.combined]).T
        return round(float((share[:, None] * ((total < ends[0]) | (total > ends[1]))).sum()), 6)

    best: tuple[float, float] | None = None
    for tried in product(*(priced[j] for j in summed)) if summed else ():
        each = choice.copy()
        for j, turn in zip(summed, tried):
            each[j] = turn
        cost = sum(one[0] for one in tried), sum(one[1] for one in tried)
        if best is not None and cost >= best:
            continue  # sums can only add to it
        cost = cost[0] + price(np.array([one[2] for one in each])), cost[1]
        if best is None or cost < best:
            best, choice = cost, each
    turns = np.array([one[2] for one in choice], dtype=float)
    return sum(one[0] for one in choice) + (price(turns) if summed else 0.0), turns


def _jump(t: Reals, q: Reals, i: int) -> BranchJump:
    step = q[i + 1] - q[i]
    joint = int(np.argmax(np.abs(step)))
    return BranchJump(float(t[i + 1]), joint + 1, float(step[joint]))


@kernel
def _costs_to_go(q: Reals, price: Reals, meeting: Integers) -> tuple[Integers, Flags]:
    """The branch to take next from each point and branch, and whether that is a jump; both (n - 1, 8).

    Going from one branch to another is no jump only where they meet, or are the same to SWITCH_STEP. Branches meet in
    what is singular there: passing an aligned wrist does not change the side of the elbow.
    """
    count = q.shape[0]
    cost = np.full(SLOTS, np.inf)
    onward = np.zeros((count - 1, SLOTS), dtype=np.int64)
    jumps = np.zeros((count - 1, SLOTS), dtype=np.bool_)
    for a in range(SLOTS):
        if np.isfinite(q[count - 1, a, 0]):
            cost[a] = price[count - 1, a]
    for i in range(count - 2, -1, -1):
        behind = cost.copy()
        cost[:] = np.inf
        for a in range(SLOTS):
            if not np.isfinite(q[i, a, 0]):
                continue
            for b in range(SLOTS):
                if not np.isfinite(behind[b]):
                    continue
                travel, farthest = 0.0, 0.0
                for j in range(6):
                    step = q[i + 1, b, j] - q[i, a, j]
                    step -= 2 * np.pi * np.round(step / (2 * np.pi))
                    travel += step * step
                    farthest = max(farthest, abs(step))
                together = (a ^ b) & ~(meeting[i, a] | meeting[i + 1, b]) == 0
                jump = farthest > (WIDE_STEP if together else SWITCH_STEP)
                total = price[i, a] + np.sqrt(travel) + behind[b] + (JUMP_COST if jump else 0.0)
                if total < cost[a]:
                    cost[a] = total
                    onward[i, a] = b
                    jumps[i, a] = jump
    return onward, jumps


@kernel
def _walk(onward: Integers, start: int) -> Integers:
    """The sequence of branches from ``start`` to the end."""
    slot = np.empty(onward.shape[0] + 1, dtype=np.int64)
    slot[0] = start
    for i in range(onward.shape[0]):
        slot[i + 1] = onward[i, slot[i]]
    return slot
