"""The targets for the player: the arm in one solution after another, among all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.finding import Finding, is_one
from er3a.geometry.transforms import transform
from er3a.kinematics.inverse import inverse
from er3a.pipeline.language import tr, with_unit
from er3a.pipeline.messages.expectations import outcome_word
from er3a.pipeline.messages.inverse import limits_in_short
from er3a.pipeline.messages.kinematics import branch_word, singularity_word
from er3a.pipeline.messages.numbers import fixed
from er3a.pipeline.messages.say import joined, say
from er3a.pipeline.player.motions import Mark, PlayedEvent, PlayedMotion, Weight
from er3a.pipeline.stages.inverse.model import SolutionRows, TargetResult
from er3a.pipeline.stages.trajectory.page.played import gap
from er3a.robots.joint_limits import meant
from er3a.robots.robot import Robot
from er3a.selection.regular_first import SINGULAR_PARTS

SHOWN_S = 0.9  # how long the player shows a solution, before it moves to the next one for a tenth of a second
Position = tuple[float, float, float]
MAX_GHOSTS = 8  # solutions that are drawn at a time: more hide each other


def solutions_played(robot: Robot, target: TargetResult, rows: SolutionRows, bodies: Bodies | None) -> PlayedMotion:
    """The arm in each branch that solves a target, among all of them, pale; without one where it comes nearest.

    Parameters
    ----------
    rows : the best row of each branch, in the order in which they are shown
    bodies : of the arm and its scene, to which the gap of the chosen one is drawn; None where it is not
    """
    q = meant(robot, rows.q_deg if len(rows) else np.array([target.q_ref_deg]))
    events = [_solution_event(rows, k) for k in range(len(rows))]
    events = events or [PlayedEvent(0.0, SHOWN_S, outcome_word(target.outcome), "fail")]
    marks = [_line(target.xyz_mm, target.xyz_mm, target.name, len(q))]
    if bodies and target.clearance and len(rows):
        marks.append(gap(bodies, q[0], target.clearance.least_mm, 0.0, SHOWN_S))
    near = target.neighbours if not len(rows) else None
    if near and near.shifted_to_mm and near.least_shift_mm:
        pose = transform(np.array(near.shifted_to_mm) / 1000, np.radians(target.rpy_deg))
        found = inverse(robot, pose, q[0])
        q = np.repeat(found.q[found.within_limits][:1] if found.within_limits.any() else q, 2, axis=0)
        far = with_unit(fixed(near.least_shift_mm, 0), "mm")
        events.append(PlayedEvent(1.0, 1.0 + SHOWN_S, tr("reached after moving the part {far}", far=far), "plain"))
        marks += [
            _line(near.shifted_to_mm, target.xyz_mm, short_of(near.least_shift_mm), 1),
            replace(_line(near.shifted_to_mm, target.xyz_mm, "", 2), t0=1.0),
            replace(_line(near.shifted_to_mm, near.shifted_to_mm, target.name, 2), t0=1.0),
        ]
    t = np.arange(len(q))[:, None] + [0.0, SHOWN_S]
    return PlayedMotion(
        target.name, "", t.ravel(), np.repeat(q, 2, axis=0), events, marks, ghosts=list(q[: min(MAX_GHOSTS, len(rows))])
    )


def short_of(far_mm: float) -> str:
    """By how much the arm does not get to a target, in few words."""
    return tr("{far} short", far=with_unit(fixed(far_mm, 0), "mm"))


def _solution_event(rows: SolutionRows, k: int) -> PlayedEvent:
    """What came of a branch, as long as the player shows it."""
    refusal, name = rows.refusal[k], branch_word(rows.label[k], int(rows.branch[k]))
    said = tr("chosen") if rows.rank[k] == 1 else refusal_in_short(refusal)
    weight: Weight = "fail" if refusal is not None else "caution" if rows.singular[k].any() else "plain"
    over = refusal.joints if refusal and is_one(refusal, "limits_exceeded") else ()
    joints = tuple((each.joint, "") for each in over)
    return PlayedEvent(k, k + SHOWN_S, with_singularity(joined([name, said], ": "), rows, k), weight, joints=joints)


def with_singularity(said: str, rows: SolutionRows, k: int) -> str:
    """What is said of a solution, and the singularities that it is on."""
    kinds = [kind for kind, on in zip(SINGULAR_PARTS, rows.singular[k]) if on]
    if not kinds:
        return said
    if kinds == ["rank"]:
        return tr("{taken}; rank singularity", taken=said)
    return tr("{taken}; {kinds} singularity", taken=said, kinds=tr(", ").join(map(singularity_word, kinds)))


def _line(start_mm: Position, end_mm: Position, name: str, count: int) -> Mark:
    """A line between two places, a dot where they are one, as long as ``count`` solutions are shown."""
    start, end = (np.array([start_mm, end_mm]) / 1000).tolist()
    return Mark(0.0, float(count), start, end, name)


def refusal_in_short(refusal: Finding | None) -> str:
    """Why a solution is not taken, in few words; empty for one that is admissible."""
    if refusal is None:
        return ""
    return limits_in_short(refusal) if is_one(refusal, "limits_exceeded") else say(refusal)
