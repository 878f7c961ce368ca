"""How far the tool is off between two tables, anywhere in the joint ranges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.geometry.transforms import rotation_angle
from er3a.identifiability.peaks import box_points, peak
from er3a.kinematics.table_batch import Tables, frames_of, join
from er3a.numerics.arrays import Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.references.quantities import MM
from er3a.robots.robot import Robot

SAME_MM, SAME_DEG = 1e-6, 1e-7
SEEN_AT = 12


@dataclass(frozen=True)
class ToolOff:
    """How far the tool is off at most: position and orientation, each at its own worst pose."""

    mm: float
    deg: float

    @property
    def moves(self) -> bool:
        """Whether it is off at all."""
        return self.mm > SAME_MM or self.deg > SAME_DEG

    def within(self, mm: float, deg: float) -> bool:
        """Whether it stays below a tolerance."""
        return self.mm < mm and self.deg < deg

    def worse(self, other: ToolOff) -> ToolOff:
        """The worse of both, in position and in orientation."""
        return ToolOff(max(self.mm, other.mm), max(self.deg, other.deg))


NOT_OFF = ToolOff(0.0, 0.0)


class ToolRange:
    """A robot's tool over its joint ranges."""

    def __init__(self, robot: Robot, table: Tables):
        self.robot, self.table = robot, table
        self.lower, self.upper = np.minimum(robot.lower, robot.upper), np.maximum(robot.lower, robot.upper)
        self.points = box_points(self.lower, self.upper)
        self._own = self._tool(table, self.points)[0]

    def off(self, other: Tables) -> ToolOff:
        """How far the tool of another table (a batch of one) is off at most."""
        both = join([self.table, other])
        theirs = self._tool(other, self.points)[0]
        best: list[float] = []
        for measure, factor in ((_distance, MM), (rotation_off, 180 / np.pi)):

            def apart(q: Reals, measure=measure) -> Reals:  # type: ignore[no-untyped-def]
                T = self._tool(both, q)
                result: Reals = measure(T[0], T[1])
                return result

            first = measure(self._own, theirs)
            start = self.points[np.argsort(-first, kind="stable")[:24]]
            best.append(peak(apart, self.lower, self.upper, start)[1] * factor if first.max() > 1e-12 else 0.0)
        return ToolOff(*best)

    def signature(self, tables: Tables) -> Reals:
        """Numbers (H, k), in mm and thousandths, that are equal for tables whose tools move alike."""
        q = quasi_random_points(self.lower, self.upper, SEEN_AT)
        T = self._tool(tables, q)
        return np.concatenate([T[..., :3, 3] * MM, T[..., :3, :3].reshape(*T.shape[:2], 9) * MM], axis=-1).reshape(
            len(tables), -1
        )

    def _tool(self, tables: Tables, q: Reals) -> Reals:
        T: Reals = frames_of(tables, self.robot, q)[:, :, -1] @ self.robot.tool
        return T


def _distance(one: Reals, other: Reals) -> Reals:
    distance: Reals = np.linalg.norm(one[..., :3, 3] - other[..., :3, 3], axis=-1)
    return distance


def rotation_off(one: Reals, other: Reals) -> Reals:
    """Angle (...,) in rad between the orientations of transforms (..., 4, 4)."""
    return rotation_angle(one[..., :3, :3], other[..., :3, :3])
