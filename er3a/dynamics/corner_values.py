"""Holding torques and distances from axes at the corners of hulls around boxes of joint values.

Both are affine in the cosine and sine of each row's angle (in its shift, where it slides), because no row comes in
twice: what hangs behind a joint is carried to its axis row by row, gravity from the base likewise. Cosine and sine of
an arc lie in the triangle of its ends and the point where the tangents there meet; those of an arc of more than 120
degrees in the triangle around the whole circle. What is affine in each of several points has its greatest absolute
value over a product of triangles at a corner of it, so nowhere in a box is there more than at the corners.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.dynamics.arm_model import ArmModel, flange_in_last_link
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

WIDEST_ARC = np.pi / 3  # rad to either side
APEX = 2
"""Of a row's three corners the third is where the tangents meet; the ends of its interval come before."""


@dataclass(frozen=True, eq=False)
class Hanging:
    """What hangs behind a joint, in the frame that moves with it.

    Attributes
    ----------
    mass : kg
    first : (B, K, 3), sum of mass times centre, kg m
    moment, force : (B, K, 3), of the surroundings on the tool, about the frame's origin, N m and N
    """

    mass: float
    first: Reals
    moment: Reals
    force: Reals


def corners(robot: Robot, low: Reals, high: Reals) -> Reals:
    """Corners (B, m, 3, 2) of each row's hull over boxes (B, n) of joint values: cosine and sine, or shift and 0."""
    coupling = np.eye(robot.rows) if robot.coupling is None else robot.coupling
    to_rows = robot.direction[:, None] * coupling
    middle = (low + high) / 2 @ to_rows.T + joint_starts(robot)
    half = (high - low) / 2 @ np.abs(to_rows).T
    wide = half > WIDEST_ARC
    turn = np.where(wide, 2 * np.pi / 3, half)
    radius = np.stack([np.where(wide, 2.0, 1.0)] * 2 + [np.where(wide, 2.0, 1 / np.cos(np.where(wide, 0, half)))], -1)
    angle = middle[..., None] + np.stack([-turn, turn, np.zeros_like(turn)], axis=-1)
    found = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)
    slides = np.stack([middle - half, middle + half, middle], axis=-1)
    sliding = robot.sliding[:, None]
    found[..., 0] = np.where(sliding, slides, found[..., 0])
    found[..., 1] = np.where(sliding, 0.0, found[..., 1])
    return found


def hanging_of(model: ArmModel) -> list[Hanging]:
    """What each link (of rows 0 to m - 1) adds of its own; load and forces at the tool count to the last one."""
    robot, load = model.robot, model.load
    last = constant_links(robot)[-1]
    force, moment = (
        last[:3, :3] @ np.array(part) for part in ((load.force, load.moment) if load else ((0.0,) * 3,) * 2)
    )
    found = []
    for row in range(robot.rows):
        own = [body for link, body in model.bodies if (robot.rows if link is None else link) == row + 1]
        at_end = row == robot.rows - 1
        found.append(
            Hanging(
                sum(body.mass for body in own),
                _alone(sum((body.mass * np.array(body.centre) for body in own), np.zeros(3))),
                _alone((moment + np.cross(last[:3, 3], force)) * at_end),
                _alone(force * at_end),
            )
        )
    return found


def point_of(robot: Robot, point: Reals) -> list[Hanging]:
    """A point (3,) of the flange as 1 kg that hangs on the last row."""
    placed = flange_in_last_link(robot) @ np.append(point, 1.0)
    none = [_alone(np.zeros(3))] * 3
    return [*[Hanging(0.0, *none)] * (robot.rows - 1), Hanging(1.0, _alone(placed[:3]), *none[1:])]


def _alone(vector: Reals) -> Reals:
    found: Reals = vector[None, None]
    return found


def carried(robot: Robot, own: list[Hanging], at: list[Reals], row: int) -> Hanging:
    """All that hangs behind a row's joint, in the frame that moves with it, over the corners of the rows behind.

    Parameters
    ----------
    at : m arrays (B, c, 2), corners of each row; those of rows behind come in order, the last row's fastest
    """
    links, found = constant_links(robot), own[-1]
    for behind in range(robot.rows - 1, row, -1):
        corner, link = at[behind], links[behind]
        first, moment, force = (each[:, None] for each in (found.first, found.moment, found.force))
        if robot.sliding[behind]:
            shift = corner[:, :, None, :1] * np.array([0.0, 0.0, 1.0])
            first, moment = first + found.mass * shift, moment + np.cross(shift, force)
            force = force + 0 * shift
        else:
            first, moment, force = (_turned(each, corner[:, :, None, :]) for each in (first, moment, force))
        R, p = link[:3, :3], link[:3, 3]
        first, moment, force = first @ R.T, moment @ R.T, force @ R.T
        here = own[behind - 1]
        found = Hanging(
            found.mass + here.mass,
            _joined(first + found.mass * p) + here.first,
            _joined(moment + np.cross(p, force)) + here.moment,
            _joined(force) + here.force,
        )
    return found


def gravity_before(robot: Robot, gravity: float, at: list[Reals], row: int) -> Reals:
    """Gravity (B, K, 3) in the frame that moves with a row's joint, over the corners of the rows up to it."""
    found, links = np.array([[[0.0, 0.0, -gravity]]]), constant_links(robot)
    for before in range(row + 1):
        found = (found @ links[before][:3, :3])[:, :, None]
        corner = at[before][:, None]
        slides = robot.sliding[before]
        found = _joined(found + 0 * corner[..., :1] if slides else _turned(found, corner * np.array([1.0, -1.0])))
    return found


def _turned(vectors: Reals, corner: Reals) -> Reals:
    """Vectors (..., 3) turned about z by corners (..., 2), which need not be of length 1."""
    u, v = corner[..., 0], corner[..., 1]
    x, y, z = vectors[..., 0], vectors[..., 1], vectors[..., 2]
    parts = np.broadcast_arrays(u * x - v * y, v * x + u * y, z)
    return np.stack(parts, axis=-1)


def _joined(vectors: Reals) -> Reals:
    found: Reals = vectors.reshape(len(vectors), vectors.shape[1] * vectors.shape[2], 3)
    return found


def row_torques(robot: Robot, row: int, behind: Hanging, pull: Reals) -> Reals:
    """Holding torques or forces (B, K) of a row: over the corners of all rows, the last row's fastest."""
    x, y, z = (pull[:, :, None, axis] for axis in range(3))
    if robot.sliding[row]:
        found = -behind.mass * z - behind.force[:, None, :, 2]
    else:
        found = behind.first[:, None, :, 1] * x - behind.first[:, None, :, 0] * y - behind.moment[:, None, :, 2]
    torques: Reals = found.reshape(len(found), found.shape[1] * found.shape[2])
    return torques


def torque_caps(robot: Robot, row: int, behind: Hanging, gravity: float) -> Reals:
    """What a row's torque or force (B, K) can't exceed wherever gravity points, over the corners of the rows behind."""
    if robot.sliding[row]:
        caps: Reals = behind.mass * gravity + np.abs(behind.force[..., 2])
    else:
        caps = gravity * np.hypot(behind.first[..., 0], behind.first[..., 1]) + np.abs(behind.moment[..., 2])
    return caps
