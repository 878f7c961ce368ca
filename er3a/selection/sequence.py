"""Joint solutions for a sequence of poses that are best as a whole.

Bellman's recursion over the solutions of each pose, turns included [1]_: the cost to reach a solution is the least,
over those of the pose before, of its cost plus that of the move between the two.

References
----------
.. [1] R. Bellman, *Dynamic Programming*, 1957, chapter III.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, first_rows
from er3a.collision.along import bodies_of
from er3a.collision.scene import Scene
from er3a.errors import Er3aError
from er3a.kinematics.inverse import checked_reference
from er3a.kinematics.solutions import Solutions
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot
from er3a.selection.select import RULES

MoveRule = Literal["nearest", "weighted", "time"]
MOVES: tuple[MoveRule, ...] = get_args(MoveRule)


@dataclass(frozen=True, eq=False, repr=False)
class SequenceChoice(ByValue, Displayed):
    """Solutions of a sequence of poses.

    Attributes
    ----------
    rows : (N,) int, the row taken of each pose's solutions; q : (N, 6), rad
    cost : sum of the moves' costs from the reference on (deg, or s for *time*)
    greedy_rows : (N,) int, what taking the cheapest next move each time would take; greedy_cost : what that costs
    """

    rows: Integers
    q: Reals
    cost: float
    greedy_rows: Integers
    greedy_cost: float

    def sheet(self) -> Sheet:
        """The row taken of each pose, with its joint angles."""
        rows = ((pose, row, *angles) for pose, row, angles in zip(range(len(self.q)), self.rows, np.degrees(self.q)))
        shown, left_out = first_rows(rows, len(self.q))
        heading = f"Sequence of {len(self.q)} poses: cost {self.cost:.6g}; nearest each time: {self.greedy_cost:.6g}"
        return Sheet(heading, ("pose", "row", *(f"q{k + 1}_deg" for k in range(self.q.shape[1]))), shown, left_out)


def select_sequence(
    robot: Robot,
    poses: Sequence[Solutions],
    q_ref: Reals,
    rule: MoveRule = "nearest",
    scene: Scene | None = None,
    acceleration: Reals | None = None,
) -> SequenceChoice:
    """Choose one solution of each pose so that all moves together cost least.

    Parameters
    ----------
    poses : the solutions of each pose, in order; rows outside the limits or in collision are left out
    q_ref : (6,), rad, where the arm starts
    rule : how a move costs: "nearest" (greatest joint move), "weighted" or "time"
    acceleration : (n,), rad/s^2; moves by "time" then run from rest to rest, else at full speed throughout

    Raises
    ------
    Er3aError
        for an unknown rule, no poses, or a pose without a usable solution (it is named by its number)
    """
    if rule not in MOVES:
        raise Er3aError(f"a sequence can't be ranked by '{rule}'; moves are ranked by: {', '.join(MOVES)}")
    if not poses:
        raise Er3aError("the sequence is empty; give at least one pose")
    usable = [_usable(robot, solutions, scene, number) for number, solutions in enumerate(poses)]
    q_ref = checked_reference(robot, q_ref)
    sets = [solutions.q[rows] for solutions, rows in zip(poses, usable)]
    found = best_of_sets(robot, sets, q_ref, rule, acceleration)
    return replace(
        found,
        rows=np.array([rows[k] for rows, k in zip(usable, found.rows)]),
        greedy_rows=np.array([rows[k] for rows, k in zip(usable, found.greedy_rows)]),
    )


def best_of_sets(
    robot: Robot, sets: Sequence[Reals], q_ref: Reals, rule: MoveRule, acceleration: Reals | None = None
) -> SequenceChoice:
    """As :func:`select_sequence`, of sets (k, n) of joint values of which all may be taken."""
    total = _move_costs(robot, q_ref[None], sets[0], rule, acceleration)[0]
    came_from = []
    for before, after in pairwise(sets):
        through = total[:, None] + _move_costs(robot, before, after, rule, acceleration)
        came_from.append(through.argmin(axis=0))
        total = through.min(axis=0)
    best = [int(total.argmin())]
    for origin in reversed(came_from):
        best.append(int(origin[best[-1]]))
    best.reverse()
    greedy, greedy_cost, at = [], 0.0, q_ref
    for q in sets:
        costs = _move_costs(robot, at[None], q, rule, acceleration)[0]
        greedy.append(int(costs.argmin()))
        greedy_cost += float(costs.min())
        at = q[greedy[-1]]
    return SequenceChoice(
        rows=np.array(best),
        q=np.array([q[k] for q, k in zip(sets, best)]),
        cost=float(total.min()),
        greedy_rows=np.array(greedy),
        greedy_cost=greedy_cost,
    )


def rest_to_rest(angle: Reals, speed: Reals, acceleration: Reals) -> Reals:
    """Least time (..., n) in s in which joints turn by angles (..., n) from rest to rest, on triangle or trapezoid."""
    short = angle < speed**2 / acceleration
    time: Reals = np.where(short, 2 * np.sqrt(angle / acceleration), angle / speed + speed / acceleration)
    return time


def _usable(robot: Robot, solutions: Solutions, scene: Scene | None, number: int) -> Integers:
    rows = np.flatnonzero(solutions.within_limits)
    if rows.size:
        rows = rows[bodies_of(robot, scene).least_of_turns(solutions.q[rows])[0] >= 0]
    if not rows.size:
        raise Er3aError(f"pose {number} of the sequence has no solution within the limits and free of collisions")
    return rows


def _move_costs(robot: Robot, before: Reals, after: Reals, rule: MoveRule, acceleration: Reals | None) -> Reals:
    """Cost (n, m) of each move from joint angles (n, 6) to (m, 6)."""
    if rule == "time" and acceleration is not None:
        times = rest_to_rest(np.abs(after[None] - before[:, None]), robot.speed, acceleration)
        slowest: Reals = times.max(axis=-1, initial=0.0)
        return slowest
    return RULES[rule].measure(robot, after[None], before[:, None], None)
