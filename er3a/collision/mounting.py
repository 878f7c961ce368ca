"""What the base stands on or in: it does not move, so it is looked at once."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from er3a.collision.core_distance import ROOM, pair_distance
from er3a.collision.distance_kernels import place
from er3a.collision.pairs import BASE
from er3a.collision.scene import Scene
from er3a.collision.shapes import arm_bodies, layout_of, solid_bodies
from er3a.robots.robot import Robot

INSIDE = 1e-6  # m


@dataclass(frozen=True)
class BaseContact:
    """A solid that a body of the base overlaps, by a depth (m; at least that if ``inside``).

    ``inside``: the body's core, of a capsule its line, is in the solid, so that it is no mere mounting.
    """

    solid: str
    depth: float
    inside: bool


def base_contacts(robot: Robot, scene: Scene | None) -> tuple[BaseContact, ...]:
    """Solids that the base overlaps, the deepest contact with each."""
    base = [body for body in arm_bodies(robot) if body.link == BASE]
    solids = [body for solid in (scene.solids if scene else ()) for body in solid_bodies(solid)]
    bodies = [*base, *solids]
    pairs = list(product(range(len(base)), range(len(base), len(bodies))))
    if not pairs:
        return ()
    layout = layout_of(robot, bodies, pairs)
    w = np.empty(layout.points.shape)
    place(layout, np.zeros(robot.joints), np.empty(layout.links.shape), w, np.empty(layout.centre.shape))
    shape = (layout.start, layout.kind, layout.radius, layout.disc)
    found: dict[str, BaseContact] = {}
    for a, b in pairs:
        distance, deep = pair_distance(w, shape, a, b, np.empty((ROOM, 3)), np.empty((2, 3)))
        inside = bool(deep) or distance + bodies[a].radius + bodies[b].radius < -INSIDE
        contact = BaseContact(bodies[b].name, -float(distance), inside)
        before = found.get(contact.solid)
        if distance < 0 and (before is None or (contact.inside, contact.depth) > (before.inside, before.depth)):
            found[contact.solid] = contact
    return tuple(found.values())
