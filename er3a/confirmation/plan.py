"""Poses to read at the pendant that settle most of a table: few, safe, and with what the pendant should show.

Of random poses within the middle of the limits, clear of the arm itself and of the floor, and away from singular ones,
those are taken in turn that increase the determinant of the information most [1]_.

References
----------
.. [1] V. V. Fedorov, *Theory of Optimal Experiments*, 1972.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import ByValue, frozen
from er3a.collision.along import clearance
from er3a.confirmation.fit import SMALL, Explanation, Fitter
from er3a.confirmation.pairs import Pairs
from er3a.confirmation.screen import plain
from er3a.errors import Er3aError
from er3a.geometry.transforms import transposed
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.singularity import conditioning
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.joint_limits import meant, shown, within
from er3a.robots.robot import Robot

TRIED, KEPT = 3_000, 200
MIDDLE = 0.1  # share of each range that is left out at either end
FROM_SINGULAR = 0.3  # of the best smallest singular value among all tried
CLEAR_M, FLOOR_M = 0.03, 0.05  # of the arm from itself, and of its joints and tool from the floor below the base
DIGIT_M, DIGIT_DEG = 1e-5, 0.01


@frozen
class Plan(ByValue):
    """Poses to read at the pendant.

    Attributes
    ----------
    q : (k, n), rad or m, whole degrees and millimetres
    T : (k, 4, 4), m, what the pendant should show
    shapes : whether the arm's own shapes were known, to keep clear of them
    """

    q: Reals
    T: Reals
    shapes: bool


def plan(robot: Robot, count: int = 5) -> Plan:
    """Poses that settle most of a table.

    Parameters
    ----------
    count : how many poses

    Raises
    ------
    Er3aError
        if too few poses are safe
    """
    room = MIDDLE * (robot.upper - robot.lower)
    q = quasi_random_points(robot.lower + room, robot.upper - room, TRIED)
    q = meant(robot, np.round(shown(robot, q)))
    q, shapes = _safe(robot, q)
    if len(q) < count:
        raise Er3aError(f"{robot.name}: only {len(q)} of {TRIED} poses are safe, and {count} are needed")
    J = _effects(robot, q[:KEPT])
    information = np.eye(J.shape[2])
    chosen: list[int] = []
    for _ in range(count):
        by_pose = J @ np.linalg.inv(information) @ transposed(J)
        gain = np.linalg.slogdet(np.eye(J.shape[1]) + by_pose)[1]
        gain[chosen] = -np.inf
        chosen.append(int(gain.argmax()))
        information += J[chosen[-1]].T @ J[chosen[-1]]
    return Plan(q[chosen], forward(robot, q[chosen]), shapes)


def _safe(robot: Robot, q: Reals) -> tuple[Reals, bool]:
    """Poses within limits, away from singular ones, the floor and the arm itself; whether it has shapes."""
    q = q[within(robot, q)]
    size = conditioning(robot, q).smallest_singular_value
    heights = np.minimum(frames(robot, q)[:, 1:, 2, 3].min(axis=1), forward(robot, q)[:, 2, 3])
    q = q[(size > FROM_SINGULAR * size.max(initial=0.0)) & (heights > FLOOR_M)]
    shapes = bool(robot.envelopes or robot.hulls or robot.meshes)
    if shapes and len(q):
        gap = clearance(robot, q, None).distance
        q = q[gap > min(CLEAR_M, gap.max() / 2)]  # some arms are built closer to themselves than CLEAR_M
    return q, shapes


def _effects(robot: Robot, q: Reals) -> Reals:
    """(N, 6, p), by how many standard deviations small corrections of entries, base and tool move a reading."""
    turns = {"": forward(robot, q)[:, :3, :3]}
    digits = np.full(robot.joints, np.radians(DIGIT_DEG)), np.full(3, DIGIT_M), float(np.radians(DIGIT_DEG))
    fitter = Fitter(robot, Pairs(q, forward(robot, q)[:, :3, 3], turns, 1, *digits))
    explanation = Explanation(plain(robot), "", 1.0, ("base", "tool"), fitter.every)
    J, _ = fitter.linear(fitter.state(explanation, robot, fitter.every))
    return J.reshape(len(q), 6, -1) * SMALL
