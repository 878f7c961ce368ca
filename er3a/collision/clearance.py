"""How far an arm stays clear of its surroundings and of itself (:mod:`er3a.collision.bodies`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.pairs import Pair
from er3a.collision.scene import Scene
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Clearance:
    """Least distances of arms.

    Attributes
    ----------
    distance : (N,), m, over the pairs of bodies that can meet; negative where something overlaps, by the depth
    pair : N, what is nearest to what; None where nothing can meet
    """

    distance: Reals
    pair: tuple[Pair | None, ...]


@lru_cache(maxsize=8)
def bodies_of(robot: Robot, scene: Scene | None) -> Bodies:
    """The bodies of an arm and a scene, kept for as long as few others are asked for."""
    return Bodies(robot, scene)


def clearance(robot: Robot, q: Reals, scene: Scene | None) -> Clearance:
    """Least distance of each arm (N, n) in rad or m from the scene's solids and from itself.

    Raises
    ------
    Er3aError
        if the scene is none
    """
    bodies = bodies_of(robot, scene)
    distance, pair = bodies.least(np.asarray(q, float).reshape(-1, robot.joints))
    return Clearance(distance, tuple(bodies.pairs[k] if k >= 0 else None for k in pair))
