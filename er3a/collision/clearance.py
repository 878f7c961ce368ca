"""How far an arm stays clear of its surroundings and of itself (:mod:`er3a.collision.bodies`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.collision.bodies import Bodies
from er3a.collision.scene import Scene
from er3a.pipeline.messages.language import N_
from er3a.robots.robot import Robot


@dataclass(frozen=True, eq=False)
class Clearance:
    """Least distances of arms.

    Attributes
    ----------
    distance : (N,), m; negative where something overlaps, by the depth
    pair : N texts, what is nearest to what
    """

    distance: np.ndarray
    pair: tuple[str, ...]


def clearance(robot: Robot, q: np.ndarray, scene: Scene | None) -> Clearance:
    """Least distance of each arm (N, 6) in rad from the scene's solids and from itself.

    Raises
    ------
    Er3aError
        if the Coal library is missing, or the scene is none
    """
    bodies = Bodies(robot, scene)
    pairs = np.arange(len(bodies.names))
    distances, names = [], []
    for ends in bodies.ends(np.asarray(q, float).reshape(-1, 6)):
        found = bodies.distances(ends, pairs)
        least = int(np.argmin(found)) if found.size else -1
        distances.append(found[least] if found.size else np.inf)
        names.append(bodies.names[least] if found.size else N_("nothing near"))
    return Clearance(np.array(distances), tuple(names))
