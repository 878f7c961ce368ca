"""Tool directions: even sets over the sphere and over cones, and the poses that a tool takes along them.

The tool's direction is the z axis of its frame. What the roll about it does depends on the tool: if the wrist centre
and axis 6 lie on the tool's own axis, rolling turns joint 6 alone, and some roll reaches a direction exactly if it is
reached without asking joint 6 (*free roll*). Any other tool moves the wrist when it rolls, and rolls are sampled.
"""

from __future__ import annotations

import numpy as np

from er3a.by_value import frozen
from er3a.kinematics.chain import constant_links
from er3a.kinematics.wrist_partitioned import wrist_partition_missing, wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

_ON_AXIS = 1e-12  # m, and sine of an angle: rounding of tables that are exact
RING = np.radians(10)  # rings of a cone are at most this far from each other


@frozen
class Roll:
    """How the roll about the tool's direction is treated.

    Attributes
    ----------
    free : whether it is left to joint 6
    angles : rad, the rolls to try; one if it is free
    last_joint : whether a free roll is left to the last joint, or to nothing, since the arm can't make it
    """

    free: bool
    angles: tuple[float, ...]
    last_joint: bool = True


def roll_of(robot: Robot, rolls: int) -> Roll:
    """How the roll about the tool's direction is treated for a robot.

    Parameters
    ----------
    robot : the roll is free if axis 6 and the wrist centre lie on the tool's z axis and the last joint moves alone
    rolls : how many even ones to try if it is not

    Returns
    -------
    roll : angles in rad
    """
    if wrist_partition_missing(robot):
        last = constant_links(robot)[-1]
        axis_6, wrist = last[2, :3], -last[:3, :3].T @ last[:3, 3]
    else:
        arm = wrist_partitioned_arm(robot)
        axis_6, wrist = arm.tool_rotation.T @ arm.axes[5], arm.wrist_in_tool
    free = max(float(np.hypot(*wrist[:2])), float(np.hypot(*axis_6[:2]))) < _ON_AXIS and _last_turns_alone(robot)
    angles = (0.0,) if free else tuple((2 * np.pi * np.arange(rolls) / rolls).tolist())
    return Roll(free, angles)


def _last_turns_alone(robot: Robot) -> bool:
    """Whether the last joint turns, and neither moves with others nor has limits together with them."""
    last = robot.joints - 1
    if robot.sliding[-1] or any(limit.factors[last] for limit in robot.combined):
        return False
    alone = np.eye(robot.rows, robot.joints)
    coupling = robot.joint_to_row
    return np.array_equal(coupling[-1], alone[-1]) and np.array_equal(coupling[:, last], alone[:, last])


def left_to_roll(robot: Robot, roll: Roll) -> Robot:
    """The robot as poses with a free roll are asked of it: with a full turn of its last joint.

    Parameters
    ----------
    robot : with its own limits
    roll : of :func:`roll_of`

    Returns
    -------
    robot : the same object if the roll is not free, or not made by the last joint
    """
    return with_full_turn(robot, robot.joints - 1) if roll.free and roll.last_joint else robot


def with_full_turn(robot: Robot, joint: int) -> Robot:
    """The robot with a full turn of one joint, from -pi to pi.

    Parameters
    ----------
    joint : from 0

    Returns
    -------
    robot : a copy
    """
    lower, upper = robot.lower.copy(), robot.upper.copy()
    lower[joint], upper[joint] = -np.pi, np.pi
    return robot.replace(lower=lower, upper=upper)


def cone_directions(axis: Reals, half_angle: float, step: float = RING) -> Reals:
    """Unit vectors (n, 3) of a cone: rings, the outermost (on the cone's edge) first.

    Each ring is its own image under quarter turns.

    Parameters
    ----------
    axis : (3,), unit vector; half_angle : rad, up to pi
    """
    rings = int(np.ceil(half_angle / step - 1e-9))
    angles = [half_angle * ring / rings for ring in range(rings, 0, -1)]
    counts = [4 * max(2, int(np.ceil(np.pi / 2 * np.sin(min(angle, np.pi / 2)) / step))) for angle in angles]
    polar = np.repeat([*angles, 0.0], [*counts, 1])
    around = np.concatenate([*(2 * np.pi * np.arange(count) / count for count in counts), [0.0]])
    return from_polar(axis, polar, around)


def from_polar(axis: Reals, polar: Reals, around: Reals) -> Reals:
    """Unit vectors at angles from an axis and around it.

    Parameters
    ----------
    axis : (3,), unit vector
    polar : (n,), rad, from the axis
    around : (n,), rad, about it, from a direction that :func:`across` chooses

    Returns
    -------
    directions : (n, 3)
    """
    x, y = across(axis[None])
    flat = np.cos(around)[:, None] * x + np.sin(around)[:, None] * y
    return np.sin(polar)[:, None] * flat + np.cos(polar)[:, None] * axis


def across(directions: Reals) -> tuple[Reals, Reals]:
    """Two unit vectors that make a right-handed frame with each direction as z.

    Parameters
    ----------
    directions : (n, 3), unit vectors

    Returns
    -------
    x, y : (n, 3) each
    """
    helper = np.eye(3)[np.argmin(np.abs(directions), axis=1)]
    x = np.cross(helper, directions)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    return x, np.cross(directions, x)


def tool_rotations(directions: Reals, roll: Roll) -> Reals:
    """Orientations of the tool frame with z along given directions, one for each roll.

    Parameters
    ----------
    directions : (n, 3), unit vectors, base frame
    roll : its angles (rad) turn x and y of :func:`across` about the direction

    Returns
    -------
    rotations : (n, rolls, 3, 3)
    """
    x, y = across(directions)
    c, s = np.cos(roll.angles)[:, None], np.sin(roll.angles)[:, None]
    rolled_x, rolled_y = c * x[:, None] + s * y[:, None], c * y[:, None] - s * x[:, None]
    z = np.broadcast_to(directions[:, None], rolled_x.shape)
    return np.stack([rolled_x, rolled_y, z], axis=-1)


def poses(points: Reals, rotations: Reals) -> Reals:
    """Poses from points and rotations, broadcast against each other.

    Parameters
    ----------
    points : (..., 3), m
    rotations : (..., 3, 3)

    Returns
    -------
    T : (..., 4, 4)
    """
    shape = np.broadcast_shapes(points.shape[:-1], rotations.shape[:-2])
    T = np.zeros((*shape, 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = rotations, points, 1.0
    return T
