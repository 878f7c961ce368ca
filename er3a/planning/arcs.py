"""Circular arcs of the tool, on the laws of time and orientation of straight lines (:mod:`er3a.planning.moves`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.errors import PoseError
from er3a.geometry.transforms import check_poses
from er3a.numerics.arrays import Reals
from er3a.planning.moves import Segment, rotation_between

ON_A_LINE = 1e-6  # rad; three points this near to a straight line fix no circle


@dataclass(frozen=True, eq=False)
class Arc(Segment):
    """A circular arc of the tool point.

    Attributes
    ----------
    centre, normal : (3,), m and unit vector, of the circle; the arc turns about the normal
    angle : rad, greater than 0; of an arc to a pose less than a full circle
    """

    centre: Reals
    normal: Reals
    angle: float

    @property
    def radius(self) -> float:
        """Radius of the circle, m."""
        return float(np.linalg.norm(self.T_start[:3, 3] - self.centre))

    @property
    def length(self) -> float:
        """See :class:`er3a.planning.moves.ToolPath`."""
        return self.radius * self.angle

    @property
    def bend(self) -> float:
        """See :class:`er3a.planning.moves.Segment`."""
        return self.angle

    def points(self, progress: Reals) -> Reals:
        """See :class:`er3a.planning.moves.Segment`."""
        return self.centre + self._spokes(np.asarray(progress, float))

    def twists(self, progress: Reals) -> tuple[Reals, Reals]:
        """See :class:`er3a.planning.moves.ToolPath`."""
        spokes = self._spokes(np.asarray(progress, float))
        turning = np.broadcast_to(self.rotation, spokes.shape)
        first = np.concatenate([self.angle * np.cross(self.normal, spokes), turning], axis=-1)
        return first, np.concatenate([-(self.angle**2) * spokes, np.zeros_like(spokes)], axis=-1)

    def _spokes(self, progress: Reals) -> Reals:
        """From the centre to the tool point, (..., 3)."""
        spoke = self.T_start[:3, 3] - self.centre
        turn = (self.angle * progress)[..., None]
        return np.cos(turn) * spoke + np.sin(turn) * np.cross(self.normal, spoke)


def arc(
    T_start: Reals,
    via: Reals,
    T_end: Reals,
    duration: float,
    half_turn_axis: Reals | None = None,
    ramp: float | None = None,
) -> Arc:
    """The arc from a pose of the tool through a point ``via`` (3,) in m to another pose.

    The rest is as for :func:`er3a.planning.moves.line`.

    Raises
    ------
    PoseError
        if the three points fix no circle, a pose is no rigid transform, or ``half_turn_axis`` can't choose
    """
    T_start, T_end = check_poses(T_start, "T_start"), check_poses(T_end, "T_end")
    start = T_start[:3, 3]
    a, b = np.asarray(via, float) - start, T_end[:3, 3] - start
    normal = np.cross(a, b)
    far = max(np.linalg.norm(a), np.linalg.norm(b))
    apart = min(np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(a - b))
    if not apart > ON_A_LINE * far:
        raise PoseError("two of the arc's three points are one; a full circle takes two arcs")
    if np.linalg.norm(normal) < ON_A_LINE * apart * far:
        raise PoseError("the arc's three points lie on a straight line")
    to_centre = np.cross((a @ a) * b - (b @ b) * a, normal) / (2 * normal @ normal)
    normal = normal / np.linalg.norm(normal)
    last = b - to_centre
    angle = np.arctan2(normal @ np.cross(-to_centre, last), -to_centre @ last) % (2 * np.pi)
    rotation, half_turn = rotation_between(T_start, T_end, half_turn_axis)
    return Arc(T_start, rotation, duration, half_turn, ramp, start + to_centre, normal, float(angle))
