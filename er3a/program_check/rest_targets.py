"""Targets of motions that are too many to be checked one by one: reach and limits of all at once."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Mapping

import numpy as np

from er3a.errors import PoseError
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.wrist_partitioned import closed_form_missing
from er3a.numerics.arrays import Reals
from er3a.program_check.program_check_findings import CheckFinding, TargetOutOfReach
from er3a.program_check.target_joints import Arms, PlacedMotion, goal_of
from er3a.program_check.ways import limit_findings
from er3a.programs.instructions import ArmMotion, JointTarget, PoseTarget
from er3a.robots.joint_limits import within

MOST_REASONS = 1000  # targets out of reach for which it is told why


def target_findings(
    arms: Arms, motions: Mapping[int, ArmMotion], keys: Mapping[int, Hashable]
) -> tuple[int, dict[int, tuple[CheckFinding, ...]]]:
    """How many targets were looked at, and what is wrong with them, by the number of the step.

    Parameters
    ----------
    keys : equal for motions that are the same in all numbers
    """
    first: dict[Hashable, int] = {}
    for number in motions:
        first.setdefault(keys[number], number)
    told: dict[int, tuple[CheckFinding, ...]] = {}
    poses: dict[int, list[tuple[int, PlacedMotion]]] = defaultdict(list)
    for number in first.values():
        placed = arms.placed(motions[number])
        target = placed.motion.target
        if isinstance(target, JointTarget):
            known = np.where(np.isnan(target.joints), placed.arm.lower, target.joints)
            told[number] = limit_findings(placed.arm, known)
        elif not isinstance(target, PoseTarget) or placed.base is None or placed.missing:
            told[number] = goal_of(placed, target, None).findings
        elif closed_form_missing(placed.arm) is None and placed.arm.coupling is None:  # others take too long
            poses[id(placed.arm)].append((number, placed))
    for group in poses.values():
        told |= _of_poses(group)
    looked = [number for number in motions if first[keys[number]] in told]
    return len(looked), {number: found for number in looked if (found := told[first[keys[number]]])}


def _of_poses(group: list[tuple[int, PlacedMotion]]) -> dict[int, tuple[CheckFinding, ...]]:
    """Findings of targets that are poses, of one arm."""
    arm = group[0][1].arm
    told: dict[int, tuple[CheckFinding, ...]] = {number: () for number, _ in group}
    try:
        found = inverse_batch(arm, np.stack([_pose(placed) for _, placed in group]))
    except PoseError:  # one of them is no pose
        return {number: goal_of(placed, placed.motion.target, None).findings for number, placed in group}
    away = np.where(found.solved, np.abs(found.q).max(axis=2), np.inf)
    inside = (found.solved & within(arm, found.q)).any(axis=1)
    reasons = 0
    for i in np.flatnonzero(~inside).tolist():
        number, placed = group[i]
        if found.solved[i].any():
            told[number] = limit_findings(arm, found.q[i, int(away[i].argmin())])
        elif (reasons := reasons + 1) <= MOST_REASONS:
            told[number] = goal_of(placed, placed.motion.target, None).findings
        else:
            told[number] = (TargetOutOfReach(()),)
    return told


def _pose(placed: PlacedMotion) -> Reals:
    assert placed.base is not None
    assert isinstance(placed.motion.target, PoseTarget)
    found: Reals = placed.base @ placed.motion.target.pose
    return found
