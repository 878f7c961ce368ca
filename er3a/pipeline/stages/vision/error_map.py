"""The error of a grasp wherever the camera sees and the arm reaches: a map around the objects, at their mean height."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.batch import inverse_batch
from er3a.numerics.arrays import Flags, Reals
from er3a.pipeline.stages.vision.model import ErrorMapRows
from er3a.robots.robot import Robot
from er3a.vision.hand_eye import HandEye
from er3a.vision.next_view import FieldOfView, in_sight
from er3a.vision.point_error import ArmAccuracy, error_sizes, seen_pose_error
from er3a.vision.tangent import inverted

MARGIN = 0.25  # of the objects' extent
LEAST_HALF = 0.2  # m, to each side of the objects' middle


@dataclass(frozen=True, eq=False)
class MapTask:
    """What the map is of.

    Attributes
    ----------
    T_base_camera : (4, 4), where the objects were seen from; picture : (n,), rad, of an arm that carries the camera
    places : (k, 4, 4), T_base_object; T_object_tool : (4, 4), the grasp that is held everywhere, as of the first object
    camera_covariance : (6, 6), m and rad, of one reading
    """

    robot: Robot
    home: Reals
    accuracy: ArmAccuracy
    T_base_camera: Reals
    picture: Reals | None
    view: FieldOfView
    places: Reals
    T_object_tool: Reals
    camera_covariance: Reals
    cells: int


def error_map(found: HandEye, task: MapTask) -> ErrorMapRows:
    """Errors on a square around the objects, of the first object's grasp held at each cell."""
    middle = task.places[:, :3, 3].mean(axis=0)
    half = max(LEAST_HALF, (1 + MARGIN) * float(np.abs(task.places[:, :2, 3] - middle[:2]).max()))
    steps = np.linspace(-half, half, task.cells)
    x, y = (part.ravel() for part in np.meshgrid(middle[0] + steps, middle[1] + steps))
    points = np.tile(task.places[0], (len(x), 1, 1))
    points[:, :3, 3] = np.column_stack([x, y, np.full(len(x), middle[2])])
    seen = inverted(task.T_base_camera) @ points
    q, reached = _held(task, points @ task.T_object_tool)
    covariance = np.broadcast_to(task.camera_covariance, (len(x), 6, 6))
    parts = seen_pose_error(found, seen, covariance, task.accuracy, (task.robot, q, task.picture))
    together = np.where(reached, np.stack(error_sizes(parts.whole)), np.nan)
    return ErrorMapRows(
        x_mm=1000 * x,
        y_mm=1000 * y,
        in_view=in_sight(task.view, seen[:, :3, 3]),
        reached=reached,
        calibration_mm=1000 * error_sizes(parts.calibration)[0],
        arm_mm=np.where(reached, 1000 * error_sizes(parts.repeatability + parts.table)[0], np.nan),
        together_mm=1000 * together[0],
        together_deg=np.degrees(together[1]),
    )


def _held(task: MapTask, tools: Reals) -> tuple[Reals, Flags]:
    """Joint angles (N, n) within the limits, nearest to where the arm waits, and whether there are any (N,)."""
    solved = inverse_batch(task.robot, tools, task.home)
    good = solved.solved & solved.within_limits
    far = np.where(good, np.abs(np.nan_to_num(solved.q) - task.home).max(axis=-1), np.inf)
    best = far.argmin(axis=1)
    reached: Flags = np.asarray(good.any(axis=1))
    q = np.where(reached[:, None], solved.q[np.arange(len(tools)), best], task.home)
    return q, reached
