"""How near an arm is to a singularity, and to which one.

The determinant of a wrist-partitioned arm's Jacobian is a product of three factors [1]_, each of which is zero on one
type of singularity: *wrist* (axes 4 and 6 align), *elbow* (arm straight or folded), *shoulder* (the wrist centre lies
in the plane of axis 1 and the direction of axis 2, where turning joint 1 can't move it). So is that of an arm with
parallel axes 2, 3 and 4: there the wrist centre is where axes 5 and 6 meet, and the forearm ends on axis 4.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 3.3.
.. [2] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.geometry.vectors import Vector, cross, dot, subtract
from er3a.kinematics.chain import arm_length, constant_links, row_values
from er3a.kinematics.forward import checked_joints, jacobian, rows_of, step_row, turn_row
from er3a.kinematics.wrist_partitioned import (
    closed_form_missing,
    has_branches,
    parallel_axes_arm,
    wrist_partitioned_arm,
)
from er3a.numerics.arrays import Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.robots.derived import derived
from er3a.robots.robot import Robot

SingularityType = Literal["wrist", "elbow", "shoulder"]
EventType = SingularityType | Literal["dependent_axes"]
TYPES: tuple[SingularityType, ...] = ("wrist", "elbow", "shoulder")
ROUNDING = 6 * np.finfo(float).eps


@dataclass(frozen=True, eq=False)
class Conditioning:
    """Measures of the Jacobian with its linear rows divided by a characteristic length.

    Attributes
    ----------
    manipulability : (...,), product of the singular values [2]_
    condition_number : (...,), infinite where the Jacobian is singular to rounding
    smallest_singular_value : (...,)
    """

    manipulability: Reals
    condition_number: Reals
    smallest_singular_value: Reals


@dataclass(frozen=True, eq=False)
class DeterminantFactors:
    """Signed distances from the three singular sets; a change of sign is a crossing.

    Attributes
    ----------
    wrist : (...,), rad, angle between axes 4 and 6 short of 0 or pi
    elbow : (...,), rad, angle between upper arm and forearm short of 0 or pi
    shoulder : (...,), m, distance of the wrist centre from the plane of axis 1 and the direction of axis 2
    """

    wrist: Reals
    elbow: Reals
    shoulder: Reals


@derived
def characteristic_length(robot: Robot) -> float:
    """Length (m) that makes linear and angular rows comparable: the wrist centre's reach from axis 2.

    For arms without a wrist centre it is half the length along all links.
    """
    return arm_length(robot) if closed_form_missing(robot) else wrist_partitioned_arm(robot).wrist_reach


def conditioning(robot: Robot, q: Reals, length: float) -> Conditioning:
    """Manipulability, condition number and smallest singular value at joint values (..., n) in rad or m.

    Of an arm with fewer than six joints the singular values are those of its n columns. Columns of joints that slide
    are multiplied by the length too, so that they compare with those of joints that turn.

    Parameters
    ----------
    length : characteristic length, m; the linear rows of the Jacobian are divided by it
    """
    J = jacobian(robot, q)
    J[..., :3, :] /= length
    if robot.sliding.any():
        J *= np.where(robot.slides, length, 1.0)
    values = np.linalg.svd(J, compute_uv=False).astype(float)
    smallest = values[..., -1]
    regular = smallest > ROUNDING * values[..., 0]
    condition = np.divide(values[..., 0], smallest, out=np.full_like(smallest, np.inf), where=regular)
    return Conditioning(values.prod(axis=-1), condition, smallest)


def determinant_factors(robot: Robot, q: Reals) -> DeterminantFactors:
    """Signed distances from the wrist, elbow and shoulder singularities at joint angles (..., 6) in rad.

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor this way
    """
    if (parallel := parallel_axes_arm(robot)) is not None:
        wrist_in_tool, to_axis_4 = np.array(parallel.constants.wrist_in_tool), True
    else:
        wrist_in_tool, to_axis_4 = wrist_partitioned_arm(robot).wrist_in_tool, False
    q = checked_joints(robot, q)
    out = np.empty((q.size // 6, 3))
    links = constant_links(robot)
    _factors(row_values(robot, q).reshape(-1, 6), robot.direction, robot.offset, links, wrist_in_tool, to_axis_4, out)
    return DeterminantFactors(*(out[:, k].reshape(q.shape[:-1]) for k in range(3)))


def factors_where_defined(robot: Robot, q: Reals) -> DeterminantFactors:
    """The same; NaN for arms whose determinant does not factor this way (see :mod:`er3a.kinematics.rank_loss`)."""
    if has_branches(robot):
        return determinant_factors(robot, q)
    nothing = np.full(np.shape(q)[:-1], np.nan)
    return DeterminantFactors(nothing, nothing, nothing)


@kernel
def _factors(
    q: Reals, direction: Reals, offset: Reals, links: Reals, wrist_in_tool: Reals, to_axis_4: bool, out: Reals
) -> None:
    """Fill ``out`` (N, 3): wrist, elbow and shoulder at joint angles ``q`` (N, 6)."""
    w, p = np.empty((6, 3)), np.empty((6, 3))
    for n in range(q.shape[0]):
        x, y, z = rows_of(links[0])
        for k in range(6):
            w[k, 0], w[k, 1], w[k, 2] = x[2], y[2], z[2]
            p[k, 0], p[k, 1], p[k, 2] = x[3], y[3], z[3]
            angle, link = direction[k] * q[n, k] + offset[k], links[k + 1]
            c, s = np.cos(angle), np.sin(angle)
            x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
            x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
        i, j, k = wrist_in_tool[0], wrist_in_tool[1], wrist_in_tool[2]
        wrist = (
            x[0] * i + x[1] * j + x[2] * k + x[3],
            y[0] * i + y[1] * j + y[2] * k + y[3],
            z[0] * i + z[1] * j + z[2] * k + z[3],
        )
        w1, w2, w5 = (w[0, 0], w[0, 1], w[0, 2]), (w[1, 0], w[1, 1], w[1, 2]), (w[4, 0], w[4, 1], w[4, 2])
        p2, p3 = (p[1, 0], p[1, 1], p[1, 2]), (p[2, 0], p[2, 1], p[2, 2])
        sideways = cross(w1, w2)
        out[n, 0] = _angle_short_of_line((w[3, 0], w[3, 1], w[3, 2]), (w[5, 0], w[5, 1], w[5, 2]), w5)
        forearm_end = (p[3, 0], p[3, 1], p[3, 2]) if to_axis_4 else wrist
        out[n, 1] = _angle_short_of_line(subtract(p3, p2), subtract(forearm_end, p3), w2)
        from_axis = subtract(wrist, (p[0, 0], p[0, 1], p[0, 2]))
        out[n, 2] = dot(sideways, from_axis) / np.sqrt(dot(sideways, sideways))


@inner_kernel
def _angle_short_of_line(a: Vector, b: Vector, axis: Vector) -> float:
    """Signed angle from the line of a to the line of b, in (-pi/2, pi/2], as seen along the axis."""
    angle: float = np.arctan2(dot(axis, cross(a, b)), abs(dot(a, b) - dot(a, axis) * dot(b, axis)))
    return angle
