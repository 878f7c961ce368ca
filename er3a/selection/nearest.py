"""Choice of the joint solution nearest to a reference, with the reason, or the reason why none is chosen.

The admissible solution with the smallest maximum joint move from the reference is chosen
(:func:`er3a.robots.joint_limits.comparable`, the meaning of *nearest* in all rankings). If all joints start and stop
together, that joint decides the duration of the move. Between equals (to 1e-9 rad) the least root of the summed squares
of all joint moves decides, then the lower branch number.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.by_value import by_identity
from er3a.finding import Amount, Finding, fact, is_one, turned_or_moved
from er3a.kinematics.solutions import Solutions
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.joint_limits import comparable, joint_shown, limit_margin, unit_compared
from er3a.robots.robot import Robot

SAME_MOVE = 1e-9  # rad; moves closer than this differ by rounding only

WhyFirst = Finding
"""``only_admissible``, ``moves_less`` (largest joint move), ``moves_less_together`` (the root of all moves' squares) or
``lower_branch_number``."""


@by_identity
class Choice:
    """Admissible solutions, nearest first.

    Attributes
    ----------
    order : (k,) int, rows of the solutions to choose from, best first
    max_joint_move : (n,), rad, largest joint move from the reference to each solution; a millimetre of a prismatic
        joint counts as a degree here and in ``distance``
    distance : (n,), rad, root of the summed squares of the joint moves
    reason : why the first was taken, or why none
    """

    order: Integers
    max_joint_move: Reals
    distance: Reals
    reason: WhyFirst | Finding

    @property
    def chosen(self) -> int | None:
        """The row taken; None if no solution is admissible."""
        return int(self.order[0]) if len(self.order) else None


def nearest(
    robot: Robot, solutions: Solutions, q_ref: Reals, refused: Sequence[Finding | None] | None = None
) -> Choice:
    """Order the admissible solutions of one pose by their distance from a reference, as the module says.

    Parameters
    ----------
    solutions : all solutions of the pose, turns included, (N, n)
    q_ref : (n,), rad or m, the joint values that the arm comes from
    refused : why each row is not admissible, None for those that are; left out, the limits alone refuse

    Returns
    -------
    choice : admissible rows, nearest first, and the reason for the first (or for none)
    """
    moves = comparable(robot, np.abs(solutions.q - q_ref))
    greatest: Reals = moves.max(axis=-1, initial=0.0)
    distance: Reals = np.linalg.norm(moves, axis=1)
    allowed = solutions.within_limits if refused is None else [why is None for why in refused]
    rows = np.flatnonzero(allowed)
    left, ordered = rows[np.argsort(greatest[rows], kind="stable")].tolist(), list[int]()
    # Not one sort: rows within SAME_MOVE of the best are alike, and alike is not transitive.
    while left:
        alike = 1
        while alike < len(left) and greatest[left[alike]] <= greatest[left[0]] + SAME_MOVE:
            alike += 1
        best = left.index(_first(left[:alike], distance, solutions.branch))
        ordered.append(left.pop(best))
    why: WhyFirst | Finding
    if ordered:
        why = _why_first(robot, solutions, q_ref, ordered, moves, distance)
    else:
        why = why_none(robot, solutions, refused or ())
    return Choice(np.array(ordered, dtype=int), greatest, distance, why)


def _first(rows: list[int], distance: Reals, branch: Integers) -> int:
    """Of rows whose largest moves are alike."""
    smallest = min(distance[row] for row in rows)
    return min((row for row in rows if distance[row] <= smallest + SAME_MOVE), key=lambda row: (branch[row], row))


def _why_first(
    robot: Robot, solutions: Solutions, q_ref: Reals, order: list[int], moves: Reals, distance: Reals
) -> WhyFirst:
    """What the first of the order has over the second."""
    chosen = order[0]
    joint = int(moves[chosen].argmax())
    most = moves[chosen, joint]
    value, slides = joint_shown(robot, joint, float(np.abs(solutions.q[chosen, joint] - q_ref[joint])))
    move: Finding = fact("greatest_move", joint=joint + 1, move=turned_or_moved(value, slides))
    if len(order) == 1:
        return fact("only_admissible", move=move)
    second = order[1]
    other = _difference(solutions, chosen, second)
    margin = moves[second].max() - most
    if margin > SAME_MOVE:
        return fact("moves_less", move=move, less=_compared(robot, margin), next_best=other)
    nearer = distance[second] - distance[chosen]
    if nearer > SAME_MOVE:
        return fact("moves_less_together", move=move, less=_compared(robot, nearer), next_best=other)
    return fact("lower_branch_number", move=move, next_best=other)


def _compared(robot: Robot, less: float) -> Amount:
    """A difference of moves (rad), in the unit of such."""
    return Amount(float(np.degrees(less)), unit_compared(robot))


def _difference(solutions: Solutions, chosen: int, other: int) -> Finding:
    """How another solution differs from the one chosen: its branch, its turns, or its free joint."""
    if solutions.branch[other] != solutions.branch[chosen]:
        return fact("other_branch", branch=int(solutions.branch[other]), label=solutions.label[other])
    turns = solutions.turn[other] - solutions.turn[chosen]
    turned = tuple(fact("joint_turned", joint=int(j) + 1, turn_deg=int(360 * turns[j])) for j in np.flatnonzero(turns))
    return fact("other_turns", joints=turned)


def why_none(robot: Robot, solutions: Solutions, refused: Sequence[Finding | None]) -> Finding:
    """Why no solution of a pose is taken, where each is refused.

    Parameters
    ----------
    solutions : of the pose, perhaps none
    refused : the reason for each row; overlaps count before limits

    Returns
    -------
    why : no solution at all; or the overlap of the solution with the largest margin; or the smallest excess of limits
    """
    if not len(solutions.q):
        return fact("no_solution", unsolved=solutions.unsolved)
    overlaps = {row: why for row, why in enumerate(refused) if is_one(why, "pair_overlaps")}
    margin = limit_margin(robot, solutions.q)
    if overlaps:
        widest = max(overlaps, key=lambda row: margin[row])
        return fact("all_collide", count=len(overlaps), overlap=overlaps[widest])
    nearest = int(margin.argmax())
    return fact(
        "all_outside_limits",
        count=len(solutions.q),
        branch=int(solutions.branch[nearest]),
        label=solutions.label[nearest],
        exceeded=solutions.reason[nearest],
    )
