"""The shapes of an arm's links: those that its file gives, else capsules guessed from its table.

A file that gives any shape gives them all: a link without one has none. Links are often left without a shape because
the shapes of their neighbours cover them (frames in a wrist, rings between two housings), and a capsule guessed along
the table's lengths lies inside what the file draws around the next joint, so that the two would overlap in every pose.
Which links have none is said (``ArmShapes.bare``), because nothing that they hit is seen.

The guess puts a capsule around each straight piece of a link, along its joint's axis and across to the next. Its
radius is a share of the arm's size (the sum of all link lengths): 5.5 % at the shoulder, falling to 3 % at the wrist,
which is about how thick small industrial arms are: an estimate. The column below axis 2 counts as base.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.collision.pairs import BASE
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.derived import derived
from er3a.robots.robot import ConvexPiece, Envelope, Grade, Robot

RADIUS_RATIOS = (0.055, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03)
SHORTEST = 1e-6


@dataclass(frozen=True)
class ArmShapes:
    """All shapes of an arm's links, and what they rest on.

    Attributes
    ----------
    capsules, pieces : shapes of the links, in any order
    given : whether the robot's file gives them; else they are guessed from its table
    grade : how far they can be relied on: as the file grades them, ``inferred`` if it doesn't or if they are guessed
    bare : numbers of links from 0 on that a file which gives shapes gives none; () for guessed shapes, which leave out
        only links without length
    """

    capsules: tuple[Envelope, ...]
    pieces: tuple[ConvexPiece, ...]
    given: bool
    grade: Grade
    bare: tuple[int, ...]


@derived
def arm_shapes(robot: Robot) -> ArmShapes:
    """The shapes that an arm has, for whatever asks for its shapes (see the module's text)."""
    if not (robot.envelopes or robot.hulls):
        return ArmShapes(default_envelopes(robot), (), False, "inferred", ())
    source = robot.sources.get("envelopes")
    shaped = {capsule.link for capsule in robot.envelopes} | {piece.link for piece in robot.hulls}
    bare = tuple(link for link in range(robot.rows + 1) if link not in shaped)
    return ArmShapes(robot.envelopes, robot.hulls, True, source.grade if source else "inferred", bare)


def default_envelopes(robot: Robot) -> tuple[Envelope, ...]:
    """Capsules along the table's link lengths (see the module's text)."""
    size = float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
    parts, found = link_parts(robot), []
    last = robot.rows
    for k in range(last):
        along = parts[k + 1, ALONG_Z, :3, 3]
        across = along + parts[k + 1, TO_NEXT_AXIS, :3, 3]
        if k == 0:
            found += _pieces(robot, BASE, size, [(np.zeros(3), along)])
            found += _pieces(robot, 1, size, [(along, across)])
        else:
            found += _pieces(robot, k + 1, size, [(np.zeros(3), along), (along, across)])
    T = frames(robot, np.zeros(robot.joints))
    found += _pieces(robot, last, size, [(across, (np.linalg.inv(T[last - 1]) @ T[last])[:3, 3])])
    return tuple(found)


def capsule_poses(robot: Robot, capsules: tuple[Envelope, ...], q: Reals) -> Reals:
    """End points (..., n, 2, 3) of the capsules' lines in the base's surroundings, m, at joint values (..., n)."""
    T = link_frames(robot, q)[..., [c.link for c in capsules], :, :]
    ends = np.array([(c.start, c.end) for c in capsules])
    placed: Reals = np.einsum("...nij,nkj->...nki", T[..., :3, :3], ends) + T[..., None, :3, 3]
    return placed


def link_frames(robot: Robot, q: Reals) -> Reals:
    """Frames (..., m + 1, 4, 4) of the base and the links at joint values (..., n)."""
    T = frames(robot, q)
    base = np.broadcast_to(robot.base, (*T.shape[:-3], 1, 4, 4))
    return np.concatenate([base, T[..., :-1, :, :]], axis=-3)


def _pieces(robot: Robot, link: int, size: float, lines: list[tuple[Reals, Reals]]) -> list[Envelope]:
    return [
        Envelope(link, tuple(start.tolist()), tuple(end.tolist()), RADIUS_RATIOS[round(link * 6 / robot.rows)] * size)
        for start, end in lines
        if np.linalg.norm(end - start) > SHORTEST
    ]
