"""Which of several joint solutions to take."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.inverse import Solutions
from er3a.pipeline.messages.language import N_, joined, said
from er3a.robots.robot import Robot

NEAREST_RULE = N_(
    "Of the solutions within the limits, take the one whose greatest joint move from the reference is least: where all "
    "joints start and stop together, that joint decides how long the move takes. Between equals (to 1e-9 rad) the "
    "least root of the summed squares of all joint moves decides, then the lower branch number."
)
SAME_MOVE = 1e-9


@dataclass(frozen=True, eq=False)
class Choice:
    """Solutions in the order of a rule.

    Attributes
    ----------
    order : (k,) int, rows of the solutions to choose from, best first
    greatest_move : (n,), rad, the farthest that any joint turns from the reference to each solution
    distance : (n,), rad, root of the summed squares of the joint moves
    reason : why the first was taken, or why none
    """

    order: np.ndarray
    greatest_move: np.ndarray
    distance: np.ndarray
    reason: str

    @property
    def chosen(self) -> int | None:
        """The row taken; None if no solution is within the limits."""
        return int(self.order[0]) if len(self.order) else None

    @property
    def runner_up(self) -> int | None:
        """The next best row."""
        return int(self.order[1]) if len(self.order) > 1 else None


def nearest(robot: Robot, solutions: Solutions, q_ref: np.ndarray, allowed: np.ndarray | None = None) -> Choice:
    """Order the solutions within the limits by ``NEAREST_RULE``.

    Parameters
    ----------
    q_ref : (6,), rad, the joint angles that the arm comes from
    allowed : (n,) bool, the rows to choose from instead of those within the limits
    """
    moves = np.abs(solutions.q - q_ref)
    greatest = moves.max(axis=1, initial=0.0)
    distance = np.linalg.norm(moves, axis=1)
    left = [int(row) for row in np.flatnonzero(solutions.within_limits if allowed is None else allowed)]
    order = []
    while left:
        best = _first(left, greatest, distance, solutions.branch)
        order.append(best)
        left.remove(best)
    order = np.array(order, dtype=int)
    why = _why_first(robot, solutions, order, moves, distance) if len(order) else _why_none(robot, solutions)
    return Choice(order, greatest, distance, why)


def limit_margin(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Least distance (...,) in rad of any joint of (..., 6) from its limits; negative outside them."""
    return np.minimum(q - robot.lower, robot.upper - q).min(axis=-1)


def _first(rows: list[int], greatest: np.ndarray, distance: np.ndarray, branch: np.ndarray) -> int:
    for measure in (greatest, distance):
        least = min(measure[row] for row in rows)
        rows = [row for row in rows if measure[row] <= least + SAME_MOVE]
    return min(rows, key=lambda row: (branch[row], row))


def _why_first(robot: Robot, solutions: Solutions, order: np.ndarray, moves: np.ndarray, distance: np.ndarray) -> str:
    chosen = order[0]
    joint = int(moves[chosen].argmax())
    most = moves[chosen, joint]
    move = said("greatest joint move {angle:.1f} deg (J{joint})", angle=np.degrees(most), joint=joint + 1)
    if len(order) == 1:
        return said("{move}; the only solution within the limits", move=move)
    second = order[1]
    other = said("the next best ({branch})", branch=_told_apart(robot, solutions, chosen, second))
    margin = moves[second].max() - most
    if margin > SAME_MOVE:
        return said("{move}, {angle:.3g} deg less than {other}", move=move, angle=np.degrees(margin), other=other)
    nearer = distance[second] - distance[chosen]
    if nearer > SAME_MOVE:
        return said(
            "{move}, as with {other}; all joints taken together move {angle:.3g} deg less",
            move=move,
            other=other,
            angle=np.degrees(nearer),
        )
    return said("{move}; {other} is just as near, and the lower branch number decides", move=move, other=other)


def _told_apart(robot: Robot, solutions: Solutions, chosen: int, other: int) -> str:
    turns = solutions.turn[other] - solutions.turn[chosen]
    if solutions.branch[other] != solutions.branch[chosen]:
        return solutions.label[other]
    turned = [said("J{joint} turned by {turn:+d} deg", joint=j + 1, turn=360 * turns[j]) for j in np.flatnonzero(turns)]
    if not turned:
        return N_("the same branch, its free joint at another angle")
    return said("the same branch, {turned}", turned=joined(turned, ", "))


def _why_none(robot: Robot, solutions: Solutions) -> str:
    if not len(solutions.q):
        if len(solutions.unsolved) == 1:
            return solutions.unsolved[0]
        sides = [text.split(": ", 1) for text in solutions.unsolved]
        if len({text for _, text in sides}) == 1:
            return said("out of reach: {fault}", fault=sides[0][1])
        return said("out of reach: {fault}", fault=joined((joined(side, ", ") for side in sides), "; "))
    least = int(limit_margin(robot, solutions.q).argmax())
    label = solutions.label[least]
    count, reason = len(solutions.q), solutions.reason[least]
    if count == 1:
        return said("the only solution leaves them: {branch}: {reason}", branch=label, reason=reason)
    return said(
        "all {count} solutions leave the limits; the least so is {branch}: {reason}",
        count=count,
        branch=label,
        reason=reason,
    )
