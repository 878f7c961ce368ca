"""Masses guessed from the capsules around the links, at a stated density: for who asks for figures without data."""

from __future__ import annotations

import numpy as np

from er3a.collision.envelopes import envelopes_of
from er3a.robots.masses import LinkMass, MassBody, moved, together
from er3a.robots.robot import Envelope, Robot


def estimated_links(robot: Robot, density: float) -> tuple[LinkMass, ...]:
    """A body for each link that has capsules, filled evenly at ``density`` (kg/m^3); overlaps count twice.

    Whoever uses them grades them ``inferred``.
    """
    found: dict[int, list[MassBody]] = {}
    for capsule in envelopes_of(robot):
        found.setdefault(capsule.link, []).append(capsule_body(capsule, density))
    return tuple(LinkMass(link, together(bodies)) for link, bodies in sorted(found.items()))


def capsule_body(capsule: Envelope, density: float) -> MassBody:
    """A solid capsule: a cylinder and two half balls."""
    start, end, r = np.array(capsule.start), np.array(capsule.end), capsule.radius
    length = float(np.linalg.norm(end - start))
    cylinder, ball = density * np.pi * r**2 * length, density * 4 / 3 * np.pi * r**3
    across = cylinder * (length**2 / 12 + r**2 / 4) + ball * (0.4 * r**2 + length**2 / 4 + 0.375 * length * r)
    round_ = cylinder * r**2 / 2 + 0.4 * ball * r**2
    body = MassBody(cylinder + ball, (0.0, 0.0, 0.0), (across, across, round_, 0.0, 0.0, 0.0))
    T = np.eye(4)
    T[:3, 3] = (start + end) / 2
    if length > 0:
        z = (end - start) / length
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return moved(body, T)
