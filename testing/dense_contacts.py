"""Distances of an arm's capsules from solids and from one another, by Coal itself on frames worked out here.

Nothing of er3a is used: capsules, pairs and solids come as plain numbers.
"""

from __future__ import annotations

import coal
import numpy as np

from testing.motion_oracle import _turn, arm_of


class Contacts:
    """An arm in a scene.

    table : as of :func:`testing.motion_oracle.arm_of`
    capsules : (link, start, end, radius), m, in the frame that turns with the link's joint; link 0 is the base
    own : pairs of capsules, by number
    solids : (kind, measures, T): "box" (edges), "cylinder" (radius, length), "sphere" (radius) or "plane" (normal,
        offset)
    """

    def __init__(self, table, capsules, own, solids) -> None:
        arm = arm_of(table)
        self.links, self.direction, self.offset = arm.links, arm.direction, arm.offset
        self.base = np.array(table["base"])
        self.shapes, self.numbers = [], []
        for link, start, end, radius in capsules:
            start, end = np.array(start), np.array(end)
            length = np.linalg.norm(end - start)
            z = (end - start) / length if length > 0 else np.array([0.0, 0.0, 1.0])
            x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
            x /= np.linalg.norm(x)
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = np.stack([x, np.cross(z, x), z], axis=1), (start + end) / 2
            self.shapes.append(coal.Capsule(radius, length))
            self.numbers.append((link, T))
        self.around = [self._solid(*solid) for solid in solids]
        self.own = list(own)

    @staticmethod
    def _solid(kind, measures, T):
        if kind == "plane":
            return coal.Halfspace(np.array(measures[0]), float(measures[1])), coal.Transform3s.Identity()
        made = {"box": coal.Box, "cylinder": coal.Cylinder, "sphere": coal.Sphere}[kind]
        return made(*map(float, measures)), coal.Transform3s(T[:3, :3], T[:3, 3])

    def least(self, q) -> np.ndarray:
        """Least distance (n,) in m of arms (n, 6) in rad; about 0 or less where something touches."""
        q = np.atleast_2d(q)
        T, frames = np.broadcast_to(self.links[0], (len(q), 4, 4)), [np.broadcast_to(self.base, (len(q), 4, 4))]
        for k in range(6):
            T = T @ _turn(self.direction[k] * q[:, k] + self.offset[k])
            frames.append(T)
            T = T @ self.links[k + 1]
        placed = [frames[link] @ own for link, own in self.numbers]
        return np.array([self._one([part[row] for part in placed]) for row in range(len(q))])

    def _one(self, placed) -> float:
        where = [coal.Transform3s(T[:3, :3], T[:3, 3]) for T in placed]
        request, found = coal.DistanceRequest(), [np.inf]
        for i, j in self.own:
            found.append(
                coal.distance(self.shapes[i], where[i], self.shapes[j], where[j], request, coal.DistanceResult())
            )
        for i, (link, _) in enumerate(self.numbers):
            if link == 0:
                continue
            for shape, at in self.around:
                found.append(coal.distance(self.shapes[i], where[i], shape, at, request, coal.DistanceResult()))
        return float(min(found))
