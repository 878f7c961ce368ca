"""Arms with a spherical wrist and parallel axes 2 and 3: recognised from their table, and solved in closed form.

The arm is taken as its six axis lines (directions w, points P) with all theta at 0, so that D-H convention, offsets,
base and tool need no cases of their own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er3a.by_value import by_identity
from er3a.errors import NotWristPartitionedError
from er3a.finding import Finding, fact
from er3a.geometry.transforms import frame_along
from er3a.geometry.vectors import Vector, signed_angle, unsigned_angle, wrap_to_pi
from er3a.kinematics import closed_form
from er3a.kinematics.block_inverse import BlockConstants, block_constants
from er3a.kinematics.chain import axes_at_zero_theta, constant_links, meeting_point, row_values
from er3a.kinematics.classes.four_bar import solve_near_reference
from er3a.kinematics.classes.parallel_axes import ThreeParallel, three_parallel
from er3a.numerics.arrays import Reals, for_kernel
from er3a.robots.robot import Robot, derived

PARALLEL = 1e-9  # rad


ClosedFormMissing = Finding


@by_identity
class WristPartitionedArm:
    """Axis lines of such an arm with all theta at 0, in the base frame (m).

    Attributes
    ----------
    axes : (6, 3) unit vectors; points : (6, 3); wrist : (3,) where axes 4, 5, 6 meet
    tool_rotation : (3, 3), rotation of the tool frame; wrist_in_tool : (3,), the wrist centre in the tool frame
    elbow_sign : +1 if axis 3 points along axis 2, -1 if against it
    upper_arm, forearm : (3,), across axis 2: from axis 2 to axis 3, and from axis 3 to the wrist centre
    shoulder_offset : constant component along axis 2 of the wrist centre, seen from the point on axis 1
    """

    axes: Reals
    points: Reals
    wrist: Reals
    tool_rotation: Reals
    wrist_in_tool: Reals
    elbow_sign: float
    upper_arm: Reals
    forearm: Reals
    shoulder_offset: float

    @property
    def upper_arm_length(self) -> float:
        """Distance of axis 3 from axis 2, m."""
        return float(np.linalg.norm(self.upper_arm))

    @property
    def forearm_length(self) -> float:
        """Distance of the wrist centre from axis 3, m."""
        return float(np.linalg.norm(self.forearm))

    @property
    def wrist_reach(self) -> float:
        """Largest distance of the wrist centre from axis 2 across it, m."""
        return self.upper_arm_length + self.forearm_length


def wrist_partitioned_arm(robot: Robot) -> WristPartitionedArm:
    """The arm's axis lines and wrist centre, as recognised from its table.

    Returns
    -------
    arm : base frame, m

    Raises
    ------
    NotWristPartitionedError
        naming the property that the arm lacks
    """
    found = _recognised(robot)
    if isinstance(found, WristPartitionedArm):
        return found
    raise NotWristPartitionedError(robot.name, found)


def wrist_partition_missing(robot: Robot) -> ClosedFormMissing | None:
    """Which property the arm lacks for the closed form of a spherical wrist.

    Returns
    -------
    missing : None if it has them all
    """
    found = _recognised(robot)
    return None if isinstance(found, WristPartitionedArm) else found


@derived
def _recognised(robot: Robot) -> WristPartitionedArm | ClosedFormMissing:
    """The arm, or what it lacks."""
    if robot.rows != 6 or robot.joints != 6 or robot.sliding.any():
        return fact("not_six_turning_joints", joints=robot.joints, sliding=int(robot.sliding.sum()))
    if robot.coupling is not None and not _couples_the_arm_alone(robot.coupling):
        return fact("coupled_wrist")
    return recognised(*axes_at_zero_theta(robot))


def recognised(axes: Reals, points: Reals, T_base_tool: Reals) -> WristPartitionedArm | ClosedFormMissing:
    """Recognise an arm with a spherical wrist from its axis lines.

    Parameters
    ----------
    axes, points : (6, 3), unit vectors and m, with all theta at 0, base frame
    T_base_tool : (4, 4), m

    Returns
    -------
    arm : or what it lacks; axes are parallel to 1e-9 rad and meet to 1e-9 m
    """
    if np.linalg.norm(np.cross(axes[1], axes[2])) > PARALLEL:
        return fact("elbow_axes_not_parallel")
    for i, j in ((0, 1), (3, 4), (4, 5)):
        if np.linalg.norm(np.cross(axes[i], axes[j])) < PARALLEL:
            return fact("neighbouring_axes_parallel", first=i + 1, second=j + 1)
    wrist, miss = meeting_point(axes[3:], points[3:])
    if miss > closed_form.BOUNDARY_M:
        return fact("no_common_point_of_axes_4_5_6", miss_mm=miss * 1000)
    across = np.eye(3) - np.outer(axes[1], axes[1])
    upper_arm, forearm = across @ (points[2] - points[1]), across @ (wrist - points[2])
    if min(np.linalg.norm(upper_arm), np.linalg.norm(forearm)) < closed_form.BOUNDARY_M:
        return fact("upper_arm_or_forearm_without_length")
    return WristPartitionedArm(
        axes=axes,
        points=points,
        wrist=wrist,
        tool_rotation=np.ascontiguousarray(T_base_tool[:3, :3]),
        wrist_in_tool=T_base_tool[:3, :3].T @ (wrist - T_base_tool[:3, 3]),
        elbow_sign=float(np.sign(axes[1] @ axes[2])),
        upper_arm=upper_arm,
        forearm=forearm,
        shoulder_offset=float(axes[1] @ (wrist - points[0])),
    )


def _couples_the_arm_alone(coupling: Reals) -> bool:
    """Whether a coupling (6, 6) leaves the wrist alone, and maps whole turns to whole turns in both directions."""
    rest = coupling.copy()
    rest[:3, :3] = np.eye(3)
    whole = np.array_equal(coupling, np.round(coupling)) and round(abs(float(np.linalg.det(coupling)))) == 1
    return whole and np.array_equal(rest, np.eye(6))


@derived
def _constants(robot: Robot) -> closed_form.ArmConstants:
    """The arm's constants, kept with the robot."""
    return constants_of(wrist_partitioned_arm(robot))


def constants_of(arm: WristPartitionedArm) -> closed_form.ArmConstants:
    """The arm's constants as the closed form takes them.

    Parameters
    ----------
    arm : recognised

    Returns
    -------
    constants : m and rad, base frame unless marked
    """
    w = [_vector(axis) for axis in arm.axes]
    beside_6 = frame_along(arm.axes[5])[0]
    upper_arm, forearm = _vector(arm.upper_arm), _vector(arm.forearm)
    min_reach = abs(arm.upper_arm_length - arm.forearm_length)
    angle_45, angle_56 = float(unsigned_angle(w[3], w[4])), float(unsigned_angle(w[4], w[5]))
    oblique = (
        abs(angle_45 - angle_56) > closed_form.BOUNDARY_RAD,
        abs(angle_45 + angle_56 - np.pi) > closed_form.BOUNDARY_RAD,
    )
    return closed_form.ArmConstants(
        axis_1=w[0],
        axis_2=w[1],
        axis_4=w[3],
        axis_5=w[4],
        axis_6=w[5],
        point_1=_vector(arm.points[0]),
        point_2=_vector(arm.points[1]),
        upper_arm=upper_arm,
        forearm=forearm,
        beside_6=_vector(beside_6),
        wrist_in_tool=_vector(arm.wrist_in_tool),
        axis_6_in_tool=_vector(arm.tool_rotation.T @ arm.axes[5]),
        beside_6_in_tool=_vector(arm.tool_rotation.T @ beside_6),
        reach=arm.wrist_reach,
        min_reach=min_reach,
        cos_12=float(arm.axes[0] @ arm.axes[1]),
        sin_12=float(np.linalg.norm(np.cross(arm.axes[0], arm.axes[1]))),
        shoulder_offset=arm.shoulder_offset,
        elbow_sign=arm.elbow_sign,
        elbow_angle=float(signed_angle(upper_arm, forearm, w[1])),
        wrist_angle=float(signed_angle(w[3], w[5], w[4])),
        angle_45=angle_45,
        angle_56=angle_56,
        folded_offset=closed_form.FOLD_OFFSET * min(1.0, min_reach / arm.forearm_length)
        if min_reach > closed_form.BOUNDARY_M
        else 0.0,
        min_tilt_offset=closed_form.FOLD_OFFSET if oblique[0] else 0.0,
        max_tilt_offset=closed_form.FOLD_OFFSET if oblique[1] else 0.0,
    )


def _vector(array: Reals) -> Vector:
    """Three floats."""
    x, y, z = array.tolist()
    return x, y, z


@derived
def constants_for_blocks(robot: Robot) -> BlockConstants:
    """The arm's constants as the kernel for many poses takes them.

    Returns
    -------
    constants : m and rad

    Raises
    ------
    NotWristPartitionedError
        for other arms
    """
    arm = wrist_partitioned_arm(robot)
    return block_constants(arm.axes, arm.points, arm.wrist, arm.tool_rotation, arm.wrist_in_tool, arm.elbow_sign)


@derived
def parallel_axes_arm(robot: Robot) -> ThreeParallel | None:
    """The solver of an arm with axes 2, 3 and 4 parallel and 5 and 6 meeting (UR and its like).

    Returns
    -------
    solver : None for other arms, and for those with a spherical wrist
    """
    six = robot.rows == robot.joints == 6 and robot.coupling is None and not robot.sliding.any()
    if not six or wrist_partition_missing(robot) is None:
        return None
    return three_parallel(constant_links(robot))


def has_branches(robot: Robot) -> bool:
    """Whether the arm has the eight branches of :mod:`er3a.kinematics.solutions`, which three signs name.

    Returns
    -------
    has : a spherical wrist, or parallel axes 2, 3 and 4
    """
    return wrist_partition_missing(robot) is None or parallel_axes_arm(robot) is not None


def _slots_of_parallel_axes(
    robot: Robot, arm: ThreeParallel, T: Reals, q_ref: Reals
) -> tuple[Reals, NDArray[np.int8], Reals]:
    """:func:`solve_slots` for axes 2, 3 and 4 parallel."""
    x, gap = solve_near_reference(arm, T, robot.direction * q_ref + robot.offset)
    q = wrap_to_pi(robot.direction * (x - robot.offset))
    fault = np.where(np.isnan(q[..., 0]), closed_form.TOO_FAR, closed_form.REACHED).astype(np.int8)
    return q, fault, gap


def solve_slots(
    robot: Robot, T: Reals, q_ref: Reals, keep_folds: bool = False, keep_free: bool = False
) -> tuple[Reals, NDArray[np.int8], Reals]:
    """All branches for a batch of poses of a wrist-partitioned arm, or of one with parallel axes 2, 3 and 4.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool, m, valid rigid transforms
    q_ref : (N, 6), rad; supplies the joint that is free where a continuum solves the pose
    keep_folds, keep_free : keep branches that meet at a fold, or where a joint is free, as two different rows (see
        :mod:`closed_form`); else both are one

    Returns
    -------
    q : (N, 8, 6), rad, manufacturer's angles within half a turn of 0 (-pi..pi]; NaN where the slot has no solution
    fault : (N, 8), int8: REACHED, TOO_FAR, TOO_NEAR, OFF_AXIS or ORIENTATION (with parallel axes REACHED or TOO_FAR)
    gap : (N, 8): by how much, in m (rad for ORIENTATION)
    """
    if (parallel := parallel_axes_arm(robot)) is not None:
        return _slots_of_parallel_axes(robot, parallel, T, q_ref)
    constants, shape = _constants(robot), (T.shape[0], closed_form.SLOTS)
    q, fault, gap = np.full((*shape, 6), np.nan), np.zeros(shape, dtype=np.int8), np.zeros(shape)
    T, q_ref = for_kernel(T), for_kernel(row_values(robot, q_ref))
    closed_form.solve(constants, (robot.direction, robot.offset), T, q_ref, keep_folds, keep_free, (q, fault, gap))
    if robot.coupling is not None:
        q = wrap_to_pi(q @ np.round(np.linalg.inv(robot.coupling)).T)
    return q, fault, gap
