"""How far off a pose is that a calibrated camera reports, and the tool that goes there; first order throughout.

Four independent parts are carried to the base frame: the camera's noise in this one reading; the calibration; the arm's
repeatability; and its table. With the camera on the flange the arm's errors come in where the picture is taken, with
any setup where the tool goes. That a table's error has already bent the calibration is left out of account.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.calibration.parameters import corrected
from er3a.comparison.entries import entries_in
from er3a.geometry.transforms import skew, step_between
from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot
from er3a.vision.hand_eye import HandEye

DRAWS = 4000  # a probability near 0.95 has a standard deviation of 0.0034
DRAW_SEED = 9283
ISO_DEVIATIONS = 3.0  # ISO 9283: RP is the mean distance from the mean place plus three standard deviations of it
TABLE_STEP = 1e-6  # m or rad, of one-sided differences


@frozen
class ArmAccuracy:
    """What is stated of an arm.

    Attributes
    ----------
    repeatability : m, pose repeatability RP of position after ISO 9283
    length_deviation, angle_deviation : m, rad, standard deviations of each length and each angle of its table
    """

    repeatability: float = 0.0
    length_deviation: float = 0.0
    angle_deviation: float = 0.0

    @property
    def position_deviation(self) -> float:
        """Standard deviation (m) by axis that has this repeatability, if it is normal and equal in all directions.

        The distance from the mean of such a position has the mean 1.596 and the standard deviation 0.673 of it.
        """
        return self.repeatability / float(2 * np.sqrt(2 / np.pi) + ISO_DEVIATIONS * np.sqrt(3 - 8 / np.pi))


@by_identity
class SeenPoseError:
    """Covariances (..., 6, 6) of a pose in the base frame, position (m) and rotation (rad), by cause and in all."""

    camera: Reals
    calibration: Reals
    repeatability: Reals
    table: Reals

    @property
    def whole(self) -> Reals:
        """All parts together, (..., 6, 6), m and rad in the base frame."""
        return self.camera + self.calibration + self.repeatability + self.table


def table_covariance(robot: Robot, q: Reals, accuracy: ArmAccuracy) -> Reals:
    """Covariance of the tool's pose from independent errors of the table's entries, to first order.

    Parameters
    ----------
    q : (..., n), rad or m
    accuracy : with standard deviations of lengths (m) and angles (rad)

    Returns
    -------
    covariance : (..., 6, 6), position (m) and rotation (rad) of T_base_tool by the base's axes
    """
    at = forward(robot, q)
    out = np.zeros((*at.shape[:-2], 6, 6))
    for entry in entries_in(("a", "d", "alpha", "offset"), robot.rows):
        deviation = accuracy.length_deviation if entry.unit == "mm" else accuracy.angle_deviation
        moved = corrected(robot, (entry,), np.array([TABLE_STEP]))
        step = deviation * step_between(at, forward(moved, q)) / TABLE_STEP
        out += step[..., :, None] * step[..., None, :]
    return out


def repeatability_covariance(accuracy: ArmAccuracy) -> Reals:
    """Covariance of the pose to which an arm comes back.

    Parameters
    ----------
    accuracy : with RP of position after ISO 9283, m

    Returns
    -------
    covariance : (6, 6), m^2; 0 for the rotation, of which RP of position says nothing
    """
    return np.diag([accuracy.position_deviation**2] * 3 + [0.0] * 3)


def seen_pose(found: HandEye, T_camera_object: Reals, T_base_flange: Reals | None = None) -> Reals:
    """Pose of an object in the base frame, from where the camera sees it.

    Parameters
    ----------
    T_camera_object : (..., 4, 4), m
    T_base_flange : (..., 4, 4), m, where the picture is taken, for a camera on the flange; None for a fixed one

    Returns
    -------
    T : (..., 4, 4), m, T_base_object
    """
    placed: Reals = found.X @ T_camera_object
    return placed if T_base_flange is None else T_base_flange @ placed


def seen_pose_error(
    found: HandEye,
    T_camera_object: Reals,
    camera_covariance: Reals,
    accuracy: ArmAccuracy,
    arm: tuple[Robot, Reals, Reals | None],
) -> SeenPoseError:
    """Errors of an object's pose as the tool meets them that goes there, to first order.

    Parameters
    ----------
    T_camera_object : (..., 4, 4), m; camera_covariance : (..., 6, 6) of it by the camera's axes
    arm : the robot, and the joint angles (..., n) at which its tool is on the object; then those (n,) at which a camera
        on the flange takes the picture, None for a fixed one

    Returns
    -------
    errors : covariances (..., 6, 6) of T_base_object, m and rad by the base's axes, by cause
    """
    robot, q_there, q_picture = arm
    X = found.X
    p = (X[:3, :3] @ T_camera_object[..., :3, 3, None])[..., 0]
    by_calibration = _stacked(np.broadcast_to(np.eye(3), (*p.shape, 3)), -skew(p))
    by_camera = _stacked(X[:3, :3], np.zeros((3, 3)), corner=X[:3, :3])
    calibration = _carried(by_calibration, found.covariance[:6, :6])
    camera = _carried(by_camera, camera_covariance)
    shape = calibration.shape
    repeat, table = (
        np.broadcast_to(repeatability_covariance(accuracy), shape),
        table_covariance(robot, q_there, accuracy),
    )
    if q_picture is not None:
        A = forward(robot.without_tool(), q_picture)
        turn = _stacked(A[:3, :3], np.zeros((3, 3)), corner=A[:3, :3])
        calibration, camera = _carried(turn, calibration), _carried(turn, camera)
        lever = (A[:3, :3] @ (p + X[:3, 3])[..., None])[..., 0]
        by_arm = _stacked(np.broadcast_to(np.eye(3), (*p.shape, 3)), -skew(lever))
        repeat = repeat + _carried(by_arm, repeatability_covariance(accuracy))
        table = table + _carried(by_arm, table_covariance(robot.without_tool(), q_picture, accuracy))
    return SeenPoseError(camera, calibration, repeat, np.broadcast_to(table, shape))


def _stacked(left: Reals, right: Reals, corner: Reals | None = None) -> Reals:
    """[[left, right], [0, corner]] (..., 6, 6), the corner 1 unless given."""
    shape = np.broadcast_shapes(left.shape[:-2], right.shape[:-2])
    out = np.zeros((*shape, 6, 6))
    out[..., :3, :3], out[..., :3, 3:], out[..., 3:, 3:] = left, right, np.eye(3) if corner is None else corner
    return out


def _carried(J: Reals, covariance: Reals) -> Reals:
    return J @ covariance @ np.swapaxes(J, -1, -2)


@lru_cache(maxsize=1)
def _normals() -> Reals:
    return np.random.default_rng(DRAW_SEED).standard_normal((DRAWS, 6))


def draws(covariance: Reals) -> Reals:
    """Normal errors of given covariances, from the same random numbers always, for equal bytes.

    Parameters
    ----------
    covariance : (..., 6, 6), m and rad

    Returns
    -------
    errors : (4000, ..., 6), m and rad
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :]
    found: Reals = np.einsum("...ij,kj->k...i", root, _normals())
    return found


def error_sizes(covariance: Reals) -> tuple[Reals, Reals]:
    """Sizes below which 95 % of errors of a covariance stay, by the draws of :func:`draws`.

    Parameters
    ----------
    covariance : (..., 6, 6), m and rad

    Returns
    -------
    distance, angle : (...,), m and rad
    """
    drawn = draws(covariance)
    square = drawn**2
    distance, angle = (np.sqrt(square[..., part].sum(axis=-1)) for part in (slice(3), slice(3, 6)))
    return np.quantile(distance, 0.95, axis=0), np.quantile(angle, 0.95, axis=0)
