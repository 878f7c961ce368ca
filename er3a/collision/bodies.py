"""An arm's capsules and a scene's solids as shapes of the Coal library [1]_, and the pairs of them that can meet.

Left out are pairs that can't tell anything: links with at most one link between them, pairs joined over a way shorter
than their two radii (the wrist), and the base with the surroundings that it stands on.

References
----------
.. [1] J. Pan et al., Coal (formerly hpp-fcl), an extension of the Flexible Collision Library: GJK and EPA distances.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from er3a.collision.envelopes import capsule_poses, envelopes_of
from er3a.collision.pairs import BASE, LinkAndSolid, LinkPair, Pair
from er3a.collision.scene import Box, Cylinder, Plane, Scene, Solid, Sphere
from er3a.errors import Er3aError
from er3a.numerics.arrays import Integers, Reals
from er3a.robots.robot import Robot

try:
    import coal
except ImportError:  # no wheels for this platform
    coal = None


def can_measure() -> bool:
    """Whether the Coal library is there."""
    return coal is not None


class Bodies:
    """Pairs that can meet, numbered: first those of links with one another, then those of links with solids.

    Attributes
    ----------
    capsules : of the arm
    first : (P,) int, number of the pair's capsule; of two links the one nearer to the base
    second : (P,) int, number of the other link's capsule, -1 for a solid
    pairs : P, what meets what

    Raises
    ------
    Er3aError
        if the Coal library is missing, or the scene is none
    """

    def __init__(self, robot: Robot, scene: Scene | None) -> None:
        if coal is None:
            problem = "clearance needs the Coal library, which has no wheels for this platform; leave the scene out"
            raise Er3aError(problem)
        if not isinstance(scene, Scene | None):
            raise Er3aError(f"the scene is a {type(scene).__name__}; expected what er3a.load_scene returns")
        self.robot = robot
        self.capsules = envelopes_of(robot)
        self._shapes = [
            coal.Capsule(c.radius, float(np.linalg.norm(np.subtract(c.end, c.start)))) for c in self.capsules
        ]
        solids = scene.solids if scene else ()
        self._solids = [_shape(solid) for solid in solids]
        links = [capsule.link for capsule in self.capsules]
        own = self_pairs(robot)
        moving = [i for i, link in enumerate(links) if link != BASE]
        self.first = np.array([i for i, _ in own] + [i for _ in solids for i in moving], dtype=int)
        self.second = np.array([j for _, j in own] + [-1 for _ in solids for _ in moving], dtype=int)
        self.pairs: tuple[Pair, ...] = (
            *(LinkPair(links[i], links[j]) for i, j in own),
            *(LinkAndSolid(links[i], solid.name) for solid in solids for i in moving),
        )
        self._solid_of = [-1] * len(own) + [k for k in range(len(solids)) for _ in moving]

    def ends(self, q: Reals) -> Reals:
        """End points (..., capsules, 2, 3) in m of the capsules' lines at joint angles (..., 6) in rad."""
        return capsule_poses(self.robot, self.capsules, q)

    def distances(self, ends: Reals, pairs: Integers) -> Reals:
        """Distances (len(pairs),) in m of some pairs, negative by the depth of overlap, for end points (n, 2, 3)."""
        placed = _placed(ends)
        found = np.empty(len(pairs))
        for row, pair in enumerate(pairs):
            i, j, solid = self.first[pair], self.second[pair], self._solid_of[pair]
            other, where = (self._shapes[j], placed[j]) if solid < 0 else self._solids[solid]
            found[row] = coal.distance(
                self._shapes[i], placed[i], other, where, coal.DistanceRequest(), coal.DistanceResult()
            )
        return found


@lru_cache(maxsize=64)
def self_pairs(robot: Robot) -> tuple[tuple[int, int], ...]:
    """Pairs of capsules (by number) that can come apart, so that their distance means something."""
    capsules = envelopes_of(robot)
    lengths = {link: 0.0 for link in range(robot.rows + 1)}
    for capsule in capsules:
        lengths[capsule.link] += float(np.linalg.norm(np.subtract(capsule.end, capsule.start)))
    pairs = []
    for i, first in enumerate(capsules):
        for j, second in enumerate(capsules[:i]):
            low, high = sorted((first.link, second.link))
            between = sum(lengths[link] for link in range(low + 1, high))
            if high - low > 2 and between > first.radius + second.radius:
                pairs.append((j, i))
    return tuple(pairs)


def _shape(solid: Solid) -> tuple[Any, Any]:
    """Shape and place of a solid."""
    match solid:
        case Plane():
            return coal.Halfspace(solid.normal, solid.offset), coal.Transform3s.Identity()
        case Box():
            shape = coal.Box(*solid.size)
        case Cylinder():
            shape = coal.Cylinder(solid.radius, solid.length)
        case Sphere():
            shape = coal.Sphere(solid.radius)
    return shape, coal.Transform3s(solid.T[:3, :3], solid.T[:3, 3])


def _placed(ends: Reals) -> list[Any]:
    """Where capsules (n, 2, 3) (along their own z, about their middle) lie."""
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    z = np.where(length > 0, along / np.where(length > 0, length, 1.0), [0.0, 0.0, 1.0])
    least = np.eye(3)[np.argmin(np.abs(z), axis=1)]
    x = np.cross(least, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    R = np.stack([x, np.cross(z, x), z], axis=-1)
    return [coal.Transform3s(rotation, middle) for rotation, middle in zip(R, ends.mean(axis=1))]
