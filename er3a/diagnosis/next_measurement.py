"""Which further reference would tell hypotheses apart that the present ones can't."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.table_batch import Tables, frames_of
from er3a.pipeline.messages.language import N_, said
from er3a.robots.robot import Robot

STEP_DEG = 45.0
APART_MM = 1.0
APART_RAD = 1e-3
LIMITS = {
    "lower": N_("the lower limit of joint {joint} would tell them apart"),
    "upper": N_("the upper limit of joint {joint} would tell them apart"),
}


def what_decides(tables: Tables, robot: Robot) -> str:
    """The pose, out of single joints turned and all turned together, at which the flange positions that the tables
    predict are farthest apart; else the limits in which they differ.

    Parameters
    ----------
    tables : H hypotheses, which the references at hand can't tell apart

    Returns
    -------
    advice : empty for a single table
    """
    if len(tables) < 2:
        return ""
    poses = _candidates(robot)
    flanges = frames_of(tables, robot.base, np.radians(poses))[:, :, 6]
    points = flanges[..., :3, 3] * 1000
    apart = np.linalg.norm(points[:, None] - points[None, :], axis=-1)
    pairs = np.triu_indices(len(tables), 1)
    told = (apart[pairs] > APART_MM).mean(axis=0)
    best = int(np.lexsort((-apart[pairs].max(axis=0), -told))[0])
    if told[best] > 0:
        pose = ", ".join(f"{angle:g}" for angle in poses[best])
        template = (
            N_("the flange's position at joints ({pose}) deg would tell all apart, by up to {most}")
            if told[best] == 1
            else N_(
                "the flange's position at joints ({pose}) deg would tell {share:.0%} of the pairs apart, by up to "
                "{most}"
            )
        )
        return said(template, pose=pose, share=told[best], most=_length(apart[pairs][:, best].max()))
    for side, template in LIMITS.items():
        column = getattr(tables, side)
        joints = np.flatnonzero(np.ptp(column, axis=0) > APART_RAD)
        if len(joints):
            return said(template, joint=joints[0] + 1)
    if np.ptp(flanges, axis=0).max() < APART_RAD:
        return N_("nothing can, they are the same arm written in different ways")
    return N_("no position of the flange does, but its orientation, or a point beside axis 6")


def _candidates(robot: Robot) -> np.ndarray:
    """Poses (P, 6) in deg within the limits: one joint turned either way, pairs, and all."""
    turned = [np.zeros(6)]
    for j in range(6):
        for sign in (1, -1):
            turned.append(sign * STEP_DEG * (np.arange(6) == j))
    turned += [a + b for i, a in enumerate(turned[1:]) for b in turned[i + 2 :]]
    turned.append(STEP_DEG * np.array([1, -1, 1, 1, 1, 1]))
    lower, upper = np.degrees(np.minimum(robot.lower, robot.upper)), np.degrees(np.maximum(robot.lower, robot.upper))
    return np.unique(np.round(np.clip(turned, lower, upper), 3), axis=0)


def _length(value: float) -> str:
    return f"{value:.0f} mm" if value >= 10 else f"{value:.1f} mm"
