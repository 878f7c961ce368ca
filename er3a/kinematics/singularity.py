"""How near an arm is to a singularity, and to which one.

The determinant of a wrist-partitioned arm's Jacobian is a product of three factors [1]_, each of which is zero on one
type of singularity: *wrist* (axes 4 and 6 align), *elbow* (arm straight or folded), *shoulder* (the wrist centre lies
in the plane of axis 1 and the direction of axis 2, where turning joint 1 can't move it).

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 3.3.
.. [2] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.errors import NotWristPartitionedError
from er3a.kinematics.chain import arm_length
from er3a.kinematics.forward import frames, jacobian
from er3a.kinematics.wrist_partitioned import wrist_partitioned_arm
from er3a.robots.robot import Robot

TYPES = ("wrist", "elbow", "shoulder")
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

    manipulability: np.ndarray
    condition_number: np.ndarray
    smallest_singular_value: np.ndarray


@dataclass(frozen=True, eq=False)
class DeterminantFactors:
    """Signed distances from the three singular sets; a change of sign is a crossing.

    Attributes
    ----------
    wrist : (...,), rad, angle between axes 4 and 6 short of 0 or pi
    elbow : (...,), rad, angle between upper arm and forearm short of 0 or pi
    shoulder : (...,), m, distance of the wrist centre from the plane of axis 1 and the direction of axis 2
    """

    wrist: np.ndarray
    elbow: np.ndarray
    shoulder: np.ndarray


def characteristic_length(robot: Robot) -> float:
    """Length (m) that makes linear and angular rows comparable: the wrist centre's reach from axis 2.

    For arms without a wrist centre it is half the length along all links.
    """
    try:
        return wrist_partitioned_arm(robot).wrist_reach
    except NotWristPartitionedError:
        return arm_length(robot)


def conditioning(robot: Robot, q: np.ndarray, length: float) -> Conditioning:
    """Manipulability, condition number and smallest singular value at joint angles (..., 6) in rad.

    Parameters
    ----------
    length : characteristic length, m; the linear rows of the Jacobian are divided by it
    """
    J = jacobian(robot, q)
    J[..., :3, :] /= length
    values = np.linalg.svd(J, compute_uv=False)
    smallest = values[..., -1]
    regular = smallest > ROUNDING * values[..., 0]
    condition = np.divide(values[..., 0], smallest, out=np.full_like(smallest, np.inf), where=regular)
    return Conditioning(values.prod(axis=-1), condition, smallest)


def determinant_factors(robot: Robot, q: np.ndarray) -> DeterminantFactors:
    """Signed distances from the wrist, elbow and shoulder singularities at joint angles (..., 6) in rad.

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor this way
    """
    arm = wrist_partitioned_arm(robot)
    T = frames(robot, q)
    axes, points = T[..., :6, :3, 2], T[..., :6, :3, 3]
    tool = T[..., 6, :, :]
    wrist = tool[..., :3, 3] + np.einsum("...ij,j->...i", tool[..., :3, :3], arm.wrist_in_tool)
    w1, w2, w5 = axes[..., 0, :], axes[..., 1, :], axes[..., 4, :]
    upper_arm = points[..., 2, :] - points[..., 1, :]
    forearm = wrist - points[..., 2, :]
    sideways = np.cross(w1, w2)
    sideways = sideways / np.linalg.norm(sideways, axis=-1, keepdims=True)
    return DeterminantFactors(
        wrist=_angle_short_of_line(axes[..., 3, :], axes[..., 5, :], w5),
        elbow=_angle_short_of_line(upper_arm, forearm, w2),
        shoulder=_dot(sideways, wrist - points[..., 0, :]),
    )


def _angle_short_of_line(a: np.ndarray, b: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Signed angle from the line of a to the line of b, in (-pi/2, pi/2], as seen along the axis."""
    along_a, along_b = _dot(a, axis), _dot(b, axis)
    angle = np.arctan2(_dot(axis, np.cross(a, b)), np.abs(_dot(a, b) - along_a * along_b))
    return angle


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("...i,...i->...", a, b)
