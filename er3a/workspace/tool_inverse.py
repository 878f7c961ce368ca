"""All solutions of tool poses for maps of what a tool can do: closed form, three parallel axes, or seven joints with an
arm angle, which is taken at even values."""

from __future__ import annotations

import numpy as np

from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.by_class import arm_solver
from er3a.kinematics.chain import constant_links
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import jacobian
from er3a.kinematics.wrist_partitioned import ClosedFormMissing, CoupledJoints, closed_form_missing
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.robot import Robot
from er3a.sampling.grid import tool_bound
from er3a.workspace.general_arm import coupled
from er3a.workspace.section_arm import section_arm, section_frame

ARM_ANGLES = 8
_QUICK = ("three_parallel", "arm_angle")


def lacking_for_maps(robot: Robot) -> ClosedFormMissing | None:
    """Why there are no maps of what a robot's tool can do; None if there are."""
    if coupled(robot):
        return CoupledJoints()
    lacks = closed_form_missing(robot)
    return None if lacks is None or arm_solver(robot).chain.code in _QUICK else lacks


def arm_angles(robot: Robot) -> Reals:
    """The arm angles (k,), rad, that each pose is tried with; one of no meaning for arms without."""
    redundant = closed_form_missing(robot) and arm_solver(robot).chain.parameters
    return 2 * np.pi * np.arange(ARM_ANGLES) / ARM_ANGLES if redundant else np.zeros(1)


def all_solutions(robot: Robot, T: Reals) -> tuple[Reals, Flags]:
    """Solutions of poses (N, 4, 4): q (N, k * SLOTS, n), rad, all slots of one arm angle after those of another, and
    whether each is within the limits."""
    angles = arm_angles(robot)
    if len(angles) == 1:
        found = inverse_batch(robot, T)
        return found.q, found.within_limits
    each = [inverse_batch(robot, T, redundancy=angle[None]) for angle in angles]
    return np.concatenate([part.q for part in each], axis=1), np.concatenate([p.within_limits for p in each], axis=1)


def generic_manipulability(robot: Robot, q: Reals, wanted: Flags) -> Reals:
    """Product of the Jacobian's singular values (m^3) at the wanted joint values (..., n), 0 at others."""
    J = jacobian(robot, q[wanted])
    found = np.zeros(wanted.shape)
    if robot.joints == J.shape[-2]:
        found[wanted] = np.abs(np.linalg.det(J))
    else:
        found[wanted] = np.sqrt(np.maximum(0.0, np.linalg.det(J @ J.swapaxes(-1, -2))))
    return found


def frame_about_axis_1(robot: Robot) -> tuple[Reals, Reals]:
    """x, y, z about axis 1 in the base frame as rows (3, 3), and origin (3,), m."""
    if not closed_form_missing(robot):
        return section_frame(robot)
    first = constant_links(robot)[0]
    return first[:3, :3].T, first[:3, 3]


def section_bounds(robot: Robot) -> tuple[float, tuple[float, float], float, float]:
    """What the tool point never leaves: distance from axis 1 and heights along it, and a ball about a point of it.

    Returns
    -------
    reach, (low, high) : m; middle, radius : m, height of the ball's centre, and its radius
    """
    if not closed_form_missing(robot):
        arm = section_arm(robot)
        return arm.reach, arm.heights, float(arm.centre[2]), arm.reach
    bound = tool_bound(robot)
    low, high = bound.height - bound.radius, bound.height + bound.radius
    return bound.reach, (low, high), bound.height, bound.reach


def slots_apart(values: Reals) -> Reals:
    """Values (N, rolls * k * SLOTS, ...) as (N, rolls * k, SLOTS, ...)."""
    return values.reshape(len(values), -1, SLOTS, *values.shape[2:])
