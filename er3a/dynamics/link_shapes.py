"""What is known of the links' shapes, for judging masses: convex pieces of meshes, capsules of the file, or a guess."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from er3a.collision.envelopes import envelopes_of
from er3a.dynamics.estimate import capsule_body
from er3a.numerics.arrays import Reals
from er3a.robots.masses import MassBody, six_moments, together
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
    """Shapes of links from 0: of the pieces where there are any, else of capsules."""
    found: dict[int, LinkShape] = {}
    for link in range(robot.rows + 1):
        pieces = [np.array(piece.points) for piece in robot.hulls if piece.link == link]
        pieces = [points for points in pieces if len(points) > 3 and np.linalg.matrix_rank(points - points[0]) == 3]
        if pieces:
            found[link] = LinkShape(together([filled(points) for points in pieces]), np.concatenate(pieces), False)
    capsules: dict[int, list[Envelope]] = {}
    for capsule in envelopes_of(robot):
        capsules.setdefault(capsule.link, []).append(capsule)
    for link, own in capsules.items():
        points = [np.array(end) + each.radius * AROUND for each in own for end in (each.start, each.end)]
        water = together([capsule_body(each, WATER) for each in own])
        found.setdefault(link, LinkShape(water, np.concatenate(points), not robot.envelopes))
    return found


def filled(points: Reals) -> MassBody:
    """The hull of points (k, 3) filled with water, as tetrahedra about its middle [1]_.

    References
    ----------
    .. [1] F. Tonon, "Explicit exact formulas for the 3-D tetrahedron inertia tensor", J. Math. Stat. 1 (2005).
    """
    hull, middle = scipy.spatial.ConvexHull(points), points.mean(axis=0)
    corners = points[hull.simplices] - middle
    mass = WATER * np.abs(np.linalg.det(corners)) / 6
    sums = corners.sum(axis=1)
    second = np.einsum("t,ti,tj->ij", mass, sums, sums) + np.einsum("t,tki,tkj->ij", mass, corners, corners)
    whole, centre = float(mass.sum()), mass @ sums / 4 / mass.sum()
    second = second / 20 - whole * np.outer(centre, centre)
    x, y, z = (middle + centre).tolist()
    return MassBody(whole, (x, y, z), six_moments(np.trace(second) * np.eye(3) - second))
