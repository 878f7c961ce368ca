"""Distances of an arm's capsules from solids and from one another, by Coal itself on frames worked out here.

Nothing of er3a is used: capsules, pairs and solids come as plain numbers.
"""

from __future__ import annotations

import coal
import numpy as np

from testing.motion_oracle import about_z, arm_of


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
        """Smallest distance (n,) in m at joint angles (n, 6) in rad; about 0 or less where something touches."""
        q = np.atleast_2d(q)
        own = [(self.shapes[i], self.shapes[j], i, j) for i, j in self.own]
        found = [
            min((self._apart(a, where[i], b, where[j]) for a, b, i, j in own), default=np.inf)
            for where in map(self._placed, q)
        ]
        return np.minimum(found, self.from_solids(q).min(axis=(1, 2), initial=np.inf))

    def from_solids(self, q) -> np.ndarray:
        """Distances (n, links that move, solids), m, of arms (n, 6) in rad; infinite for a link without capsules."""
        q = np.atleast_2d(q)
        found = np.full((len(q), 6, len(self.around)), np.inf)
        for row, where in enumerate(map(self._placed, q)):
            for (link, _), capsule, at in zip(self.numbers, self.shapes, where):
                for k, (shape, T) in enumerate(self.around if link > 0 else ()):
                    found[row, link - 1, k] = min(found[row, link - 1, k], self._apart(capsule, at, shape, T))
        return found

    def _placed(self, q) -> list:
        T, frames = self.links[0], [self.base]
        for k in range(6):
            T = T @ about_z(self.direction[k] * q[k] + self.offset[k])
            frames.append(T)
            T = T @ self.links[k + 1]
        placed = [frames[link] @ own for link, own in self.numbers]
        return [coal.Transform3s(T[:3, :3], T[:3, 3]) for T in placed]

    @staticmethod
    def _apart(a, A, b, B) -> float:
        return float(coal.distance(a, A, b, B, coal.DistanceRequest(), coal.DistanceResult()))
