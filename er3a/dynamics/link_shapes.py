"""The links' shapes (:mod:`er3a.collision.envelopes`) filled evenly: to judge masses by, and to guess them from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from er3a.collision.envelopes import arm_shapes
from er3a.numerics.arrays import Reals
from er3a.robots.masses import LinkMass, MassBody, moved, six_moments, together
from er3a.robots.robot import Envelope, Robot

WATER = 1000.0
STEPS = np.stack(np.meshgrid(*[[-1.0, 0.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
AROUND = STEPS[np.abs(STEPS).sum(axis=1) > 0] / np.linalg.norm(STEPS[np.abs(STEPS).sum(axis=1) > 0], axis=1)[:, None]
"""26 directions: a ball by their points is too small by 8 % of its radius at most."""


@dataclass(frozen=True, eq=False)
class LinkShape:
    """The shape of a link in the frame that moves with its joint.

    Attributes
    ----------
    water : the shape filled with water
    points : (k, 3), m, whose hull is around the shape
    guessed : from lengths of the table alone, which leaves out how a link is offset along parallel axes
    """

    water: MassBody
    points: Reals
    guessed: bool

    def outside(self, point: Reals) -> float:
        """How far (m) a point (3,) is outside the hull at least, where no centre of mass can be; below 0 inside."""
        return float((scipy.spatial.ConvexHull(self.points).equations @ np.append(point, 1.0)).max())


def link_shapes(robot: Robot) -> dict[int, LinkShape]:
    """Shapes of links from 0 that have any."""
    guessed = not arm_shapes(robot).given
    found = {}
    for link, parts in _link_parts(robot).items():
        points = np.concatenate([_outline(part) for part in parts])
        found[link] = LinkShape(together([_body(part, WATER) for part in parts]), points, guessed)
    return found


def estimated_links(robot: Robot, density: float) -> tuple[LinkMass, ...]:
    """A body for each link that has shapes, filled evenly at ``density`` (kg/m^3); overlaps count twice.

    Whoever uses them grades them ``inferred``.
    """
    parts = sorted(_link_parts(robot).items())
    return tuple(LinkMass(link, together([_body(part, density) for part in own])) for link, own in parts)


def _link_parts(robot: Robot) -> dict[int, Sequence[Envelope] | Sequence[Reals]]:
    """What fills each link: its convex pieces (k, 3), m, that have a volume; of a link without any its capsules."""
    shapes, pieces, capsules = arm_shapes(robot), dict[int, list[Reals]](), dict[int, list[Envelope]]()
    for piece in shapes.pieces:
        points = np.array(piece.points)
        if len(points) > 3 and np.linalg.matrix_rank(points - points[0]) == 3:
            pieces.setdefault(piece.link, []).append(points)
    for capsule in shapes.capsules:
        capsules.setdefault(capsule.link, []).append(capsule)
    return {**capsules, **pieces}


def _body(part: Envelope | Reals, density: float) -> MassBody:
    return capsule_body(part, density) if isinstance(part, Envelope) else filled(part, density)


def _outline(part: Envelope | Reals) -> Reals:
    """Points (k, 3), m, whose hull is around a part."""
    if isinstance(part, Envelope):
        return np.concatenate([np.array(end) + part.radius * AROUND for end in (part.start, part.end)])
    return part


def filled(points: Reals, density: float = WATER) -> MassBody:
    """The hull of points (k, 3), m, filled at ``density`` (kg/m^3), as tetrahedra about its middle [1]_.

    References
    ----------
    .. [1] F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", J. Math. Stat. 1 (2005).
    """
    hull, middle = scipy.spatial.ConvexHull(points), points.mean(axis=0)
    corners = points[hull.simplices] - middle
    mass = density * np.abs(np.linalg.det(corners)) / 6
    sums = corners.sum(axis=1)
    second = np.einsum("t,ti,tj->ij", mass, sums, sums) + np.einsum("t,tki,tkj->ij", mass, corners, corners)
    whole, centre = float(mass.sum()), mass @ sums / 4 / mass.sum()
    second = second / 20 - whole * np.outer(centre, centre)
    x, y, z = (middle + centre).tolist()
    return MassBody(whole, (x, y, z), six_moments(np.trace(second) * np.eye(3) - second))


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
