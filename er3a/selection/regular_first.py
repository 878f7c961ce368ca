"""The solution that Poses and Collisions take of a target: the nearest, singular ones last."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from er3a.finding import Finding, fact
from er3a.kinematics.singularity import TYPES, characteristic_length, conditioning, determinant_factors
from er3a.kinematics.solutions import Solutions
from er3a.kinematics.wrist_partitioned import has_branches
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.selection.nearest import Choice, nearest

SINGULAR_PARTS = (*TYPES, "rank")
SINGULAR = 1e-6  # sine of an angle, m from axis 1, or singular value (no unit): far above rounding


def regular_first(robot: Robot, solutions: Solutions, q_ref: Reals, refused: Sequence[Finding | None]) -> Choice:
    """Nearest first, singular ones last: from these the tool can't move straight in every direction.

    Parameters
    ----------
    solutions : all solutions of the pose, (N, n)
    q_ref : (n,), rad or m, where the arm comes from
    refused : why each row is not admissible

    Returns
    -------
    choice : its reason says whether nearer singular ones were passed over
    """
    choice = nearest(robot, solutions, q_ref, refused)
    late = np.asarray(singular(robot, solutions)[choice.order].any(axis=1))
    moved = np.argsort(late, kind="stable")  # its first is not 0 where a singular one was first
    reason = fact("nearest_regular") if moved[:1].any() else choice.reason
    return replace(choice, order=choice.order[moved], reason=reason)


def singular(robot: Robot, solutions: Solutions) -> Flags:
    """Which singular sets solutions are on.

    Parameters
    ----------
    solutions : of a pose, (N, n)

    Returns
    -------
    on : (N, 4) bool, one for each of ``SINGULAR_PARTS``; arms without closed form by the Jacobian's rank
    """
    found = np.zeros((len(solutions.q), len(SINGULAR_PARTS)), dtype=bool)
    if has_branches(robot):
        factors = determinant_factors(robot, solutions.q)
        for column, kind in enumerate(TYPES):
            found[:, column] = np.abs(getattr(factors, kind)) < SINGULAR
    else:
        smallest = conditioning(robot, solutions.q, characteristic_length(robot)).smallest_singular_value
        found[:, SINGULAR_PARTS.index("rank")] = smallest < SINGULAR
    return found
