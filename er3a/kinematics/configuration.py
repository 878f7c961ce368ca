"""The eight branches of a wrist-partitioned arm: which one joint angles belong to, and their names.

The slot is ``4 * shoulder + 2 * elbow + wrist``. Each part is the sign of one factor of the Jacobian's determinant, so
that a branch can only change where the arm passes a singularity of that part:

- shoulder 0: the wrist centre lies against ``w1 x w2``, as seen from axis 1 (w: axis directions, D-H sense);
- elbow 0: the forearm is turned by 0 to pi from the upper arm about axis 2;
- wrist 0: axis 6 is turned by 0 to pi from axis 4 about axis 5, both projected across it.
"""

from __future__ import annotations

from typing import Literal, get_args

import numpy as np

from er3a.kinematics.by_class import arm_solver, to_rows
from er3a.kinematics.classes.class_solvers import BranchLabel, SlotName
from er3a.kinematics.closed_form import BOUNDARY_M, SLOTS
from er3a.kinematics.singularity import determinant_factors
from er3a.kinematics.wrist_partitioned import closed_form_missing, parallel_axes_arm, wrist_partitioned_arm
from er3a.robots.robot import Robot, derived

Side = Literal["front", "back"]
LABELS: tuple[BranchLabel, ...] = get_args(BranchLabel)


@derived
def branch_labels(robot: Robot) -> tuple[BranchLabel, ...]:
    """The codes of the eight slots, of arms with a spherical wrist or with parallel axes 2, 3 and 4.

    *front*: the wrist centre is on the side of axis 1 where it is in the manufacturer's zero pose (if it is on axis 1
    there, the side of the cross product of axes 1 and 2); *back*: reached over the head. *up*: with the arm stretched
    out level on that side, the elbow is above the line from shoulder to wrist. *flip*: the wrist root with the
    negative angle.

    Raises
    ------
    NotWristPartitionedError
    """
    if parallel_axes_arm(robot) is not None:
        names = arm_solver(robot).chain.names(to_rows(robot, np.zeros(6)))
        return tuple(LABELS[LABELS.index(name)] for name in names)  # type: ignore[arg-type]
    arm = wrist_partitioned_arm(robot)
    w1, w2 = arm.axes[0], arm.axes[1]
    labels = []
    for slot in range(SLOTS):
        outward = _outward(slot) * np.cross(w1, w2)
        bend = 1.0 if slot % 4 < 2 else -1.0
        down = bend * (np.cross(w2, outward) @ w1) >= 0
        labels.append(LABELS[4 * (side_of(robot, slot) == "back") + 2 * int(down) + slot % 2])
    return tuple(labels)


@derived
def slot_labels(robot: Robot) -> tuple[BranchLabel | SlotName, ...]:
    """The codes of the slots of the arm's class; empty where no signs separate its solutions, which are numbered."""
    if not closed_form_missing(robot):
        return branch_labels(robot)
    return arm_solver(robot).chain.names(to_rows(robot, np.zeros(robot.joints)))


@derived
def side_of(robot: Robot, slot: int) -> Side:
    """Whether a slot's wrist is in front of axis 1 or reached over the head (see :func:`branch_labels`)."""
    at_zero = determinant_factors(robot, np.zeros(6)).shoulder
    zero_side = 1.0 if abs(at_zero) < BOUNDARY_M else np.sign(at_zero)
    return "front" if _outward(slot) == zero_side else "back"


def _outward(slot: int) -> float:
    """On which side of axis 1 the wrist is, along w1 x w2: slot 0 has theta_1 = phi + delta and lies against it."""
    return -1.0 if slot < 4 else 1.0
