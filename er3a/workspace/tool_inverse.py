"""All solutions of tool poses for capability maps, for any arm with an inverse by class.

Arms with more than six joints are tested at evenly spaced values of their redundancy parameters.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from er3a.finding import Finding, fact
from er3a.geometry.transforms import exp_rotation
from er3a.geometry.vectors import TURN
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import (
    arm_solver,
    checked_parameters,
    parameters_of,
    slots_of_class,
    task_mask,
    with_task_frame,
)
from er3a.kinematics.classes.chain_solvers import LockedJoint, Unsolved
from er3a.kinematics.classes.class_solvers import ARM_CLASSES, ChainSolver, PaddedChain
from er3a.kinematics.classes.six_revolute import CERTAIN
from er3a.kinematics.forward import forward, jacobian
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import row_limits
from er3a.robots.robot import Robot, derived
from er3a.robots.whole_turns import whole_turns
from er3a.workspace.cell_frame import is_quick, joint_1_alone
from er3a.workspace.orientations import asked_of

ARM_ANGLES = 8  # values of what a pose leaves open; of two such parameters the root of it each
QUICK_S, COMPLETED_S, CERTAIN_S, DOUBT_S, INNER_S, GEARED_S = 4e-6, 16e-6, 3e-4, 8e-3, 1e-3, 5e-6
"""About what a pose takes: of classes in closed form, of fewer joints completed, by elimination where its readings are
clear and where they leave doubt, also where a joint within the arm is held, and of each slot for its turns where
gears or ball screws connect motors and joints."""
BESIDE = np.array([1.1e-4, -0.7e-4, 0.9e-4])  # rad, about the tool's axes
_PROBED = 24  # random poses that tell how often elimination leaves a doubt


MapsMissing = Finding


def lacking_for_maps(robot: Robot) -> MapsMissing | None:
    """Why there are no maps of what a robot's tool can do.

    Returns
    -------
    why : None if there are
    """
    if isinstance(arm_solver(robot).chain, Unsolved):
        return fact("inverse_unknown")
    if not joint_1_alone(robot):
        return fact("joint_one_shared")
    return fact("orientations_unknown", joints=robot.joints) if asked_of(robot, 1) is None else None


@derived
def pose_cost(robot: Robot) -> float:
    """About how long the solutions of a pose take, at one value of what it leaves open.

    Parameters
    ----------
    robot : with an inverse by class

    Returns
    -------
    cost : s, the same on every machine: by the class, and by how many random poses of the arm leave doubt
    """
    chain: ChainSolver | None = arm_solver(robot).chain
    cost = COMPLETED_S if isinstance(chain, PaddedChain) else 0.0
    cost += 0.0 if whole_turns(robot).each else GEARED_S * slot_count(robot)
    while isinstance(chain, LockedJoint | PaddedChain):
        chain = chain.rest
    if chain is None:
        return cost + CERTAIN_S + INNER_S
    if ARM_CLASSES[chain.code].closed_form:
        return cost + QUICK_S
    random = np.random.default_rng(_PROBED)
    q = robot.lower + random.random((_PROBED, robot.joints)) * (robot.upper - robot.lower)
    values = checked_parameters(robot, None, q, _PROBED)
    doubts = arm_solver(robot).chain.rows(forward(robot, q), values)[1] != CERTAIN
    return float(cost + CERTAIN_S + DOUBT_S * doubts.mean())


def slot_count(robot: Robot) -> int:
    """How many slots for solutions each pose has at one value of what it leaves open.

    Parameters
    ----------
    robot : with an inverse by class

    Returns
    -------
    slots : 8 for six joints with a spherical wrist
    """
    return arm_solver(robot).chain.slots


@derived
def redundancy_values(robot: Robot) -> Reals | None:
    """What each pose of an arm with more joints than it needs is tried with.

    Parameters
    ----------
    robot : with an inverse by class

    Returns
    -------
    values : (k, p), rad or m: arm angles, or values of joints (where they are coupled, of rows); None for arms of six
        joints
    """
    parameters = parameters_of(robot)
    if not parameters:
        return None
    count = max(2, round(ARM_ANGLES ** (1 / len(parameters))))
    each = []
    endless = (robot.joint_to_row[:, robot.continuous] != 0).any(axis=1)
    for parameter in parameters:
        j = parameter.joint
        if j < 0:
            each.append(TURN * np.arange(count) / count)
            continue
        low, high = row_limits(robot)[j].tolist()
        if not robot.sliding[j] and (endless[j] or high - low > TURN):
            low, high = (low + high) / 2 - np.pi, (low + high) / 2 + np.pi
        each.append(low + (high - low) * (np.arange(count) + 0.5) / count)
    return np.array(list(product(*each)))


def tried_values(robot: Robot) -> int:
    """At how many values of what it leaves open each pose is tried.

    Parameters
    ----------
    robot : with an inverse by class

    Returns
    -------
    count : rows of :func:`redundancy_values`; 1 for arms of six joints
    """
    values = redundancy_values(robot)
    return 1 if values is None else len(values)


def all_solutions(robot: Robot, T: Reals) -> tuple[Reals, Flags]:
    """Solutions of many poses, for maps.

    Parameters
    ----------
    T : (N, 4, 4), m, base frame

    Returns
    -------
    q : (N, k * slots, n), rad or m, NaN in empty slots; all slots of one value of what a pose leaves open after those
        of another
    inside : (N, k * slots) bool, whether each is within the limits

    Notes
    -----
    Of arms solved by elimination, a pose that leaves a doubt (where a joint may be free) is asked ``BESIDE`` next to
    it, once: to look at it alone takes some 20 ms.
    """
    values = redundancy_values(robot)
    each = [_solutions(robot, T, value) for value in ((None,) if values is None else values)]
    return np.concatenate([q for q, _ in each], axis=1), np.concatenate([inside for _, inside in each], axis=1)


def _solutions(robot: Robot, T: Reals, redundancy: Reals | None) -> tuple[Reals, Flags]:
    """:func:`all_solutions` at one value of what a pose leaves open."""
    if is_quick(robot):
        found = inverse_batch(robot, T, redundancy=redundancy)
        return found.q, found.within_limits
    reference = np.zeros((1, robot.joints))
    values = checked_parameters(robot, redundancy, reference, len(T))
    slots = slots_of_class(robot, T, reference, values, settling=False)
    left = np.flatnonzero(slots.certainty != CERTAIN)
    if left.size:
        beside = T[left].copy()
        beside[:, :3, :3] = beside[:, :3, :3] @ exp_rotation(BESIDE)
        again = slots_of_class(robot, beside, reference, values[left], settling=False)
        more = again.inside.sum(axis=1) > slots.inside[left].sum(axis=1)
        slots.q[left[more]], slots.inside[left[more]] = again.q[more], again.inside[more]
    return slots.q, slots.inside


def generic_manipulability(robot: Robot, q: Reals, chosen: Flags) -> Reals:
    """Yoshikawa's manipulability for any arm: product of the singular values of the Jacobian of what the tool meets.

    Parameters
    ----------
    q : (..., n), rad or m
    chosen : (...) bool, which to compute

    Returns
    -------
    manipulability : (...), m^3, less one m for each prismatic joint among those that place the tool point; 0 where not
        chosen
    """
    J, found = jacobian(robot, q[chosen]), np.zeros(chosen.shape)
    mask = task_mask(robot) > 0
    if not mask.all() and arm_solver(robot).chain.code != "scara":  # of a SCARA the other rows are 0
        R = forward(with_task_frame(robot), q[chosen])[:, :3, :3]
        J = np.concatenate([J[:, :3], R.swapaxes(-1, -2) @ J[:, 3:]], axis=1)[:, mask]
    if J.shape[-2] != J.shape[-1]:
        gram = J @ J.swapaxes(-1, -2) if J.shape[-2] < J.shape[-1] else J.swapaxes(-1, -2) @ J
        found[chosen] = np.sqrt(np.maximum(0.0, np.linalg.det(gram)))
    else:
        found[chosen] = np.abs(np.linalg.det(J))
    return found
