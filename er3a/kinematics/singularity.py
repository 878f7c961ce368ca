"""How near an arm is to a singularity, to which one, and where a motion meets one.

The determinant of a wrist-partitioned arm's Jacobian is a product of three factors [1]_, each of which is zero on one
type of singularity: *wrist* (axes 4 and 6 align), *elbow* (arm straight or folded), *shoulder* (the wrist centre lies
in the plane of axis 1 and the direction of axis 2, where turning joint 1 can't move it). So is that of an arm with
parallel axes 2, 3 and 4: there the wrist centre is where axes 5 and 6 meet, and the forearm ends on axis 4.

Any arm is singular where its Jacobian loses rank. Columns of prismatic joints, and linear rows, are scaled by the arm's
length. Axes are named by the smallest set of columns that are dependent there.

References
----------
.. [1] B. Siciliano et al., *Robotics: Modelling, Planning and Control*, section 3.3.
.. [2] T. Yoshikawa, "Manipulability of robotic mechanisms", Int. J. Robotics Research 4(2), 1985.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import combinations
from typing import Any, Literal

import numpy as np

from er3a.by_value import Displayed, Sheet, by_identity, frozen
from er3a.geometry.vectors import Vector, cross, dot, subtract
from er3a.kinematics.chain import arm_length, axes_at_zero_theta, constant_links, row_values
from er3a.kinematics.classes.arm_angle import vector_of
from er3a.kinematics.forward import checked_joints, jacobian, rows_of, step_row, turn_row
from er3a.kinematics.wrist_partitioned import (
    has_branches,
    parallel_axes_arm,
    wrist_partition_missing,
    wrist_partitioned_arm,
)
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.jit import inner_kernel, kernel
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.robot import Robot, derived

SingularityType = Literal["wrist", "elbow", "shoulder"]
EventType = SingularityType | Literal["dependent_axes"]
TYPES: tuple[SingularityType, ...] = ("wrist", "elbow", "shoulder")
ROUNDING = 6 * np.finfo(float).eps  # of the largest singular value: what smaller ones may be by rounding alone


@dataclass(frozen=True, eq=False, repr=False)
class Conditioning(Displayed):
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

    def sheet(self) -> Sheet:
        """The three measures at each joint vector, for printing.

        Returns
        -------
        sheet : one row for each
        """
        measures = [np.ravel(getattr(self, each.name)) for each in fields(self)]
        columns, count = tuple(each.name.replace("_", " ") for each in fields(self)), len(measures[0])
        return Sheet.of_table(f"Conditioning at {count} joint vector(s)", columns, zip(*measures))


@by_identity
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
    """Length that makes linear and angular rows comparable: the wrist centre's reach from axis 2.

    Returns
    -------
    length : m; for arms without a wrist centre half the length along all links
    """
    return arm_length(robot) if wrist_partition_missing(robot) else wrist_partitioned_arm(robot).wrist_reach


def conditioning(robot: Robot, q: Reals, length: float | None = None) -> Conditioning:
    """Manipulability [2]_, condition number and smallest singular value of the Jacobian at joint values.

    These are the singular values of as many directions as the arm moves its tool in (:func:`regular_rank`): at most as
    many as it has joints, fewer of those with several slides in one direction. Columns of prismatic joints are
    multiplied by the length, so that they are comparable with those of revolute joints.

    Parameters
    ----------
    q : (..., n), rad or m
    length : characteristic length, m, by which the linear rows of the Jacobian are divided; None means
        :func:`characteristic_length`

    Returns
    -------
    measures : (...) each, without unit
    """
    J = scaled_jacobian(robot, q, characteristic_length(robot) if length is None else length)
    values = np.linalg.svd(J, compute_uv=False)[..., : regular_rank(robot)].astype(float)
    smallest = values[..., -1]
    regular = smallest > ROUNDING * values[..., 0]
    condition = np.divide(values[..., 0], smallest, out=np.full_like(smallest, np.inf), where=regular)
    return Conditioning(values.prod(axis=-1), condition, smallest)


def wrist_and_forearm(robot: Robot) -> tuple[Reals, bool]:
    """Where the wrist centre is, and where the forearm ends.

    Parameters
    ----------
    robot : with a spherical wrist, or with parallel axes 2, 3 and 4

    Returns
    -------
    wrist : (3,), m, in the tool frame
    to_axis_4 : whether the forearm ends on axis 4 instead of at the wrist centre

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor
    """
    if (parallel := parallel_axes_arm(robot)) is not None:
        return np.array(parallel.constants.wrist_in_tool), True
    return wrist_partitioned_arm(robot).wrist_in_tool, False


@derived
def _of_factors(robot: Robot) -> tuple[Reals, Vector, bool]:
    """What the kernel of factors takes of an arm: its links, its wrist in the tool, where its forearm ends."""
    wrist, to_axis_4 = wrist_and_forearm(robot)
    return constant_links(robot), vector_of(wrist), to_axis_4


def determinant_factors(robot: Robot, q: Reals) -> DeterminantFactors:
    """Signed distances from the wrist, elbow and shoulder singularities [1]_.

    Parameters
    ----------
    q : (..., 6), rad

    Returns
    -------
    factors : (...) each, rad, rad and m

    Raises
    ------
    NotWristPartitionedError
        if the arm's determinant does not factor this way
    ShapeError, PoseError
        if q has the wrong shape, or is no array of numbers
    """
    q = checked_joints(robot, q)
    out = np.empty((q.size // 6, 3))
    _factors(row_values(robot, q).reshape(-1, 6), (robot.direction, robot.offset), *_of_factors(robot), out)
    out = out.reshape(*q.shape[:-1], 3)
    return DeterminantFactors(out[..., 0], out[..., 1], out[..., 2])


def factors_where_defined(robot: Robot, q: Reals) -> DeterminantFactors:
    """As :func:`determinant_factors`, for any arm.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    factors : (...) each; NaN for arms whose determinant does not factor this way
    """
    if has_branches(robot):
        return determinant_factors(robot, q)
    nothing = np.full(np.shape(q)[:-1], np.nan)
    return DeterminantFactors(nothing, nothing, nothing)


@kernel
def _factors(
    q: Reals, zeros: tuple[Reals, Reals], links: Reals, wrist_in_tool: Vector, to_axis_4: bool, out: Reals
) -> None:
    """Fill ``out`` (N, 3): wrist, elbow and shoulder at joint angles ``q`` (N, 6)."""
    direction, offset = zeros
    w, p = np.empty((6, 3)), np.empty((7, 3))  # directions, and origins with the wrist behind them
    for n in range(q.shape[0]):
        x, y, z = rows_of(links[0])
        for k in range(6):
            w[k, 0], w[k, 1], w[k, 2] = x[2], y[2], z[2]
            p[k, 0], p[k, 1], p[k, 2] = x[3], y[3], z[3]
            angle, link = direction[k] * q[n, k] + offset[k], links[k + 1]
            c, s = np.cos(angle), np.sin(angle)
            x, y, z = turn_row(x, c, s), turn_row(y, c, s), turn_row(z, c, s)
            x, y, z = step_row(x, link), step_row(y, link), step_row(z, link)
        for k, row in enumerate((x, y, z)):
            p[6, k] = dot(row[:3], wrist_in_tool) + row[3]
        sideways, from_axis = cross(w[0], w[1]), subtract(p[6], p[0])
        out[n, 0] = _angle_short_of_line(w[3], w[5], w[4])
        forearm_end = p[3 if to_axis_4 else 6]
        out[n, 1] = _angle_short_of_line(subtract(p[2], p[1]), subtract(forearm_end, p[2]), w[1])
        out[n, 2] = dot(sideways, from_axis) / np.sqrt(dot(sideways, sideways))


@inner_kernel
def _angle_short_of_line(a: Vector, b: Vector, axis: Vector) -> float:
    """Signed angle from the line of a to the line of b, in (-pi/2, pi/2], as seen along the axis."""
    angle: float = np.arctan2(dot(axis, cross(a, b)), abs(dot(a, b) - dot(a, axis) * dot(b, axis)))
    return angle


DEPENDENT = 1e-6  # smallest singular value of columns that count as dependent, relative to that of the event
TRIED = 16  # joint vectors in which an arm's rank is looked for


def scaled_jacobian(robot: Robot, q: Reals, length: float | None = None) -> Reals:
    """Jacobian with linear rows in parts of a length, and prismatic joints too.

    Parameters
    ----------
    q : (..., n), rad or m
    length : m; None for the arm's

    Returns
    -------
    J : (..., 6, n), without unit
    """
    length = arm_length(robot) if length is None else length
    J = jacobian(robot, q)
    J[..., :3, :] /= length
    return J * np.where(robot.slides, length, 1.0) if robot.sliding.any() else J


@derived
def regular_rank(robot: Robot) -> int:
    """The rank of an arm's Jacobian where the arm is not singular.

    Parameters
    ----------
    robot : with six joints it may be below 6, too, as of an arm with two slides in one direction

    Returns
    -------
    rank : the largest found in joint vectors that are spread over the limits
    """
    J = scaled_jacobian(robot, quasi_random_points(robot.lower, robot.upper, TRIED))
    return int(np.linalg.matrix_rank(J, DEPENDENT).max())


def smallest_value(robot: Robot, J: Reals) -> Reals:
    """Smallest singular value of scaled Jacobians, among those that are not 0 in every pose.

    Parameters
    ----------
    J : (..., 6, n), see :func:`scaled_jacobian`

    Returns
    -------
    smallest : (...), without unit
    """
    values = np.linalg.svd(J, compute_uv=False)
    return np.asarray(values[..., regular_rank(robot) - 1], dtype=float)


@derived
def change_per_joint(robot: Robot) -> Reals:
    """Bound of the change of the scaled Jacobian, in Frobenius' norm, as a joint moves.

    Parameters
    ----------
    robot : limits matter only of prismatic joints

    Returns
    -------
    B : (n,), per rad (or arm's length) of each joint

    Notes
    -----
    A joint turns the axes after it, and moves their points and the tool point by at most its lever. So each column
    changes by at most ``sqrt(1 + (2 R / length)^2)``. R is the longest stretched distance along the arm.
    """
    points, T = axes_at_zero_theta(robot)[1:]
    slide = np.zeros(len(points))
    if robot.sliding.any():
        most = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
        slide = np.where(robot.sliding, np.abs(robot.joint_to_row) @ most, 0.0)
    path = np.vstack([points, T[:3, 3]])
    reach = float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum() + slide.sum()) / arm_length(robot)
    columns = np.sqrt(robot.joints * (1.0 + (2.0 * reach) ** 2))
    return np.asarray(columns * np.abs(robot.joint_to_row).sum(axis=0))


def dependent_axes(robot: Robot, q: Reals) -> tuple[int, ...]:
    """The fewest axes whose columns of the Jacobian are nearly dependent.

    Parameters
    ----------
    q : (n,), rad or m

    Returns
    -------
    axes : numbers from 1; empty for arms with a single joint

    Notes
    -----
    Of all sets of as many axes the one with the smallest singular value is named; a larger set only if its value is
    clearly smaller.
    """
    J = scaled_jacobian(robot, q)
    J = J / np.maximum(np.linalg.norm(J, axis=0), 1e-300)
    of_all = float(np.linalg.svd(J, compute_uv=False)[-1])
    best: tuple[float, tuple[int, ...]] = (np.inf, ())
    for count in range(2, min(6, robot.joints) + 1):
        sets = list(combinations(range(robot.joints), count))
        parts = np.stack([J[:, list(chosen)] for chosen in sets])
        smallest = np.linalg.svd(parts, compute_uv=False)[:, -1]
        k = int(smallest.argmin())
        if smallest[k] < 0.2 * best[0]:
            best = float(smallest[k]), tuple(j + 1 for j in sets[k])
        if best[0] < max(5.0 * of_all, DEPENDENT):
            break
    return best[1]


MIN_SINGULAR_VALUE = 0.02  # as about 5 deg from an aligned wrist, where a wrist counts as near-singular


@frozen
class NearSingular:
    """Distance from each singular set below which a pose is near-singular.

    ``smallest`` is the smallest singular value (:mod:`er3a.kinematics.singularity`) for arms without singular sets.
    """

    wrist_rad: float
    elbow_rad: float
    shoulder_m: float
    smallest: float = MIN_SINGULAR_VALUE

    def of(self, kind: SingularityType) -> float:
        """The threshold of one type.

        Parameters
        ----------
        kind : wrist, elbow or shoulder

        Returns
        -------
        threshold : rad, of the shoulder m
        """
        return {"wrist": self.wrist_rad, "elbow": self.elbow_rad, "shoulder": self.shoulder_m}[kind]

    def ratios(self, factors: DeterminantFactors) -> Reals:
        """Distances from the three singular sets in parts of their thresholds.

        Parameters
        ----------
        factors : (...) each

        Returns
        -------
        ratios : (3, ...), in the order of ``TYPES``; below 1 is near
        """
        return np.stack([np.abs(factor_of(factors, kind)) / self.of(kind) for kind in TYPES])

    def contains(self, robot: Robot, q: Reals) -> Flags:
        """Whether arms are near-singular.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        near : (N,) bool, False where joint values are NaN
        """
        near = np.array(np.isfinite(q).all(axis=1))
        near[near] = self.margin(robot, q[near]) < 1.0
        return near

    def margin(self, robot: Robot, q: Reals) -> Reals:
        """Distance from the nearest singular set in parts of its threshold.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        margin : (N,), below 1 is near; -1 where joint values are NaN, for unreachable poses
        """
        if not has_branches(robot):
            smallest = smallest_value(robot, scaled_jacobian(robot, q))
            return np.asarray(np.nan_to_num(smallest / self.smallest, nan=-1.0))
        ratios = self.ratios(determinant_factors(robot, q))
        return np.where(np.isnan(ratios[0]), -1.0, ratios.min(axis=0))


USUAL_NEAR = NearSingular(float(np.radians(5)), float(np.radians(5)), 0.03)
"""Thresholds where no study gives others."""


def factor_of(factors: DeterminantFactors, kind: SingularityType) -> Any:
    """The determinant's factor of one type.

    Parameters
    ----------
    factors : of :func:`determinant_factors`
    kind : wrist, elbow or shoulder

    Returns
    -------
    factor : (...), rad, of the shoulder m
    """
    return getattr(factors, kind)
