"""The eight branches of a wrist-partitioned arm: which one joint angles belong to, and their names.

The slot is ``4 * shoulder + 2 * elbow + wrist``. Each part is the sign of one factor of the Jacobian's determinant, so
that a branch can only change where the arm passes a singularity of that part:

- shoulder 0: the wrist centre lies against ``w1 x w2``, as seen from axis 1 (w: axis directions, D-H sense);
- elbow 0: the forearm is turned by 0 to pi from the upper arm about axis 2;
- wrist 0: axis 6 is turned by 0 to pi from axis 4 about axis 5, both projected across it.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from er3a.geometry.vectors import signed_angle
from er3a.kinematics.closed_form import BOUNDARY_M, SLOTS
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot

LABELS = (  # by shoulder, elbow and wrist
    (
        (N_("front, elbow up, no flip"), N_("front, elbow up, flip")),
        (N_("front, elbow down, no flip"), N_("front, elbow down, flip")),
    ),
    (
        (N_("back, elbow up, no flip"), N_("back, elbow up, flip")),
        (N_("back, elbow down, no flip"), N_("back, elbow down, flip")),
    ),
)


def branch_of(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Slot (...,) that joint angles (..., 6) in rad belong to; on a singularity, where two meet, the lower number.

    Raises
    ------
    NotWristPartitionedError
    """
    arm = wrist_partitioned_arm(robot)
    q = np.asarray(q, float)
    theta = robot.direction * q + robot.offset
    w = [tuple(axis) for axis in arm.axes.tolist()]
    elbow = arm.elbow_sign * theta[..., 2] + signed_angle(tuple(arm.upper_arm), tuple(arm.forearm), w[1])
    wrist = theta[..., 4] + signed_angle(w[3], w[5], w[4])
    shoulder = determinant_factors(robot, q).shoulder > 0
    return 4 * shoulder + 2 * (np.sin(elbow) < 0) + (np.sin(wrist) < 0)


@lru_cache(maxsize=256)
def branch_labels(robot: Robot) -> tuple[str, ...]:
    """The eight slots in words.

    *front*: the wrist centre is on the side of axis 1 where it stands in the manufacturer's zero pose (if it stands on axis 1
    there, the side of the cross product of axes 1 and 2); *back*: reached over the head. *up*: with the arm stretched
    out level on that side, the elbow is above the line from shoulder to wrist. *flip*: the wrist root with the
    negative angle.
    """
    arm = wrist_partitioned_arm(robot)
    w1, w2 = arm.axes[0], arm.axes[1]
    forward_root = -1.0  # slot 0 has theta_1 = phi + delta: the wrist lies against w1 x w2
    at_zero = determinant_factors(robot, np.zeros(6)).shoulder
    zero_side = 1.0 if abs(at_zero) < BOUNDARY_M else np.sign(at_zero)
    labels = []
    for slot in range(SLOTS):
        side = forward_root * (1.0 if slot < 4 else -1.0)
        outward = side * np.cross(w1, w2)
        bend = 1.0 if slot % 4 < 2 else -1.0
        down = bend * (np.cross(w2, outward) @ w1) >= 0
        labels.append(LABELS[int(side != zero_side)][int(down)][slot % 2])
    return tuple(labels)
