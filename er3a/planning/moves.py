"""Moves between two points: in joint space, and along a straight line of the tool.

Both run on the quintic time law with rest at either end. On a line the position is linear and the orientation turns
about one fixed axis at a rate proportional to the position's (slerp [1]_), the shorter way round.

A rotation by exactly half a turn is equally short both ways. It is then taken counter-clockwise as seen from above:
of the two opposite axes, the one that points up (+Z of the base), if level the one towards +Y, if that is 0 too
towards +X. A path may choose the other one by naming an axis.

References
----------
.. [1] K. Shoemake, "Animating rotation with quaternion curves", SIGGRAPH 1985.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from er3a.errors import PoseError
from er3a.kinematics.transforms import check_poses
from er3a.planning.profiles import quintic

HALF_TURN_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class JointMove:
    """All joints start and stop together.

    Attributes
    ----------
    start, end : (6,), rad, maker's angles
    duration : s
    """

    start: np.ndarray
    end: np.ndarray
    duration: float

    def joints(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles (rad), velocities (rad/s) and accelerations (rad/s^2) at times (...,) in s; each (..., 6)."""
        return quintic(t, self.duration, self.start, self.end)


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line of the tool.

    Attributes
    ----------
    T_start : (4, 4), T_base_tool at the start
    translation : (3,), m, from start to end in the base frame
    rotation : (3,), rad, rotation vector from start to end in the base frame
    duration : s
    half_turn : whether the rotation is half a turn, so that its sense had to be chosen
    """

    T_start: np.ndarray
    translation: np.ndarray
    rotation: np.ndarray
    duration: float
    half_turn: bool = False

    @property
    def length(self) -> float:
        """Length of the tool point's way, m."""
        return float(np.linalg.norm(self.translation))

    @property
    def twist(self) -> np.ndarray:
        """Velocity of the tool per unit of progress, (6,): m, then rad, in the base frame; the same all along."""
        return np.concatenate([self.translation, self.rotation])

    def progress(self, t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Share of the way done (0..1) at times (...,) in s, with its first and second derivative by time."""
        return quintic(t, self.duration, np.array(0.0), np.array(1.0))

    def poses(self, progress: np.ndarray) -> np.ndarray:
        """T_base_tool (..., 4, 4) at shares of the way (...,)."""
        progress = np.asarray(progress, float)
        turns = Rotation.from_rotvec(progress.reshape(-1, 1) * self.rotation).as_matrix().reshape(*progress.shape, 3, 3)
        T = np.zeros((*progress.shape, 4, 4))
        T[..., :3, :3] = turns @ self.T_start[:3, :3]
        T[..., :3, 3] = self.T_start[:3, 3] + progress[..., None] * self.translation
        T[..., 3, 3] = 1.0
        return T


Move = JointMove | Line


def line(T_start: np.ndarray, T_end: np.ndarray, duration: float, half_turn_axis: np.ndarray | None = None) -> Line:
    """The straight line between two poses of the tool.

    Parameters
    ----------
    T_start, T_end : (4, 4), T_base_tool, m
    duration : s
    half_turn_axis : (3,), base frame; for rotations by exactly half a turn, the side to which the axis shall point

    Raises
    ------
    PoseError
        if a pose is no rigid transform, or ``half_turn_axis`` can't choose
    """
    T_start, T_end = check_poses(T_start, "T_start"), check_poses(T_end, "T_end")
    rotation = Rotation.from_matrix(T_end[:3, :3] @ T_start[:3, :3].T).as_rotvec()
    angle = np.linalg.norm(rotation)
    half_turn = bool(abs(angle - np.pi) < HALF_TURN_TOLERANCE)
    if half_turn_axis is not None and not half_turn:
        raise PoseError(f"half_turn_axis is given, but the rotation is by {np.degrees(angle):.6g} deg, not by 180 deg")
    if half_turn:
        rotation = rotation * _sense(rotation / angle, half_turn_axis)
    return Line(T_start, T_end[:3, 3] - T_start[:3, 3], rotation, duration, half_turn)


def _sense(axis: np.ndarray, wanted: np.ndarray | None) -> float:
    """+1 to turn about ``axis``, -1 to turn about its opposite."""
    if wanted is not None:
        side = float(axis @ wanted)
        if abs(side) < 1e-6 * np.linalg.norm(wanted) or not np.any(wanted):
            shown = ", ".join(f"{value:.3g}" for value in axis + 0.0)
            raise PoseError(f"half_turn_axis is at right angles to the axis of the half turn, ({shown})")
        return float(np.sign(side))
    for component in axis[::-1]:
        if abs(component) > 1e-9:
            return float(np.sign(component))
    return 1.0
