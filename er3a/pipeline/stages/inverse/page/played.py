"""The targets for the player: the arm in one solution after another, among all of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from er3a.finding import Finding, is_one
from er3a.pipeline.language import tr
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.inverse import limits_in_short
from er3a.pipeline.messages.kinematics import branch_word
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion
from er3a.pipeline.stages.inverse.model import SolutionRows, TargetResult
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot

SHOWN_S = 0.9  # how long the player shows a solution, before it moves to the next one for a tenth of a second
MAX_GHOSTS = 8  # solutions that are drawn at a time: more hide each other


def solutions_played(robot: Robot, target: TargetResult, rows: SolutionRows) -> PlayedMotion:
    """The arm in each branch that solves a target, among all of them, pale.

    Parameters
    ----------
    rows : the best row of each branch, in the order in which they are shown
    """
    q = meant(robot, rows.q_deg if len(rows) else np.array([target.q_ref_deg]))
    events = [_solution_event(rows, k) for k in range(len(rows))]
    events = events or [PlayedEvent(0.0, SHOWN_S, outcome_word(target.outcome), "fail")]
    marks = [_place(target.name, target.xyz_mm, len(q))]
    if target.neighbours and target.neighbours.shifted_to_mm:
        marks.append(_place(tr("nearest position with a solution"), target.neighbours.shifted_to_mm, len(q)))
    t = np.arange(len(q))[:, None] + [0.0, SHOWN_S]
    return PlayedMotion(target.name, "", t.ravel(), np.repeat(q, 2, axis=0), events, marks, ghosts=list(q[:MAX_GHOSTS]))


def _solution_event(rows: SolutionRows, k: int) -> PlayedEvent:
    """What came of a branch, as long as the player shows it."""
    refusal, name = rows.refusal[k], branch_word(rows.label[k], int(rows.branch[k]))
    said = tr("chosen") if rows.rank[k] == 1 else refusal_in_short(refusal)
    return PlayedEvent(k, k + SHOWN_S, joined([name, said], ": "), "plain" if refusal is None else "fail")


def _place(name: str, xyz_mm: Sequence[float], count: int) -> Mark:
    """A dot at a place, as long as ``count`` solutions are shown."""
    x, y, z = (value / 1000 for value in xyz_mm)
    return Mark(0.0, float(count), (x, y, z), (x, y, z), name)


def refusal_in_short(refusal: Finding | None) -> str:
    """Why a solution is not taken, in few words; empty for one that is admissible."""
    if refusal is None:
        return ""
    return limits_in_short(refusal) if is_one(refusal, "limits_exceeded") else say(refusal)
