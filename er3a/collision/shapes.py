"""The convex bodies of an arm, of what it carries and of a scene, in one form, and as arrays for kernels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er3a.collision.core_distance import CYLINDER, HALF_SPACE, HULL
from er3a.collision.distance_kernels import WORLD, Layout
from er3a.collision.envelopes import arm_shapes
from er3a.collision.overlap_depth import cylinder_points
from er3a.collision.pairs import link_label
from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Solid, Sphere
from er3a.kinematics.chain import constant_links, joint_starts
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.robot import Robot

ON_AXIS = 1e-9  # m
SIDES = 24
CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@dataclass(frozen=True, eq=False)
class Body:
    """A convex body.

    Attributes
    ----------
    name : ``base``, ``link_3``, or that of the solid or of what is carried
    link : 0 for the base, k for the link that row k moves, ``WORLD`` for what stands around
    points : (k, 3), m, in the link's frame; a half-space has its normal and, in the second row, its offset first
    kind, radius, disc : see :mod:`core_distance`
    """

    name: str
    link: int
    points: Reals
    radius: float
    kind: int = HULL
    disc: float = 0.0


def arm_bodies(robot: Robot) -> tuple[Body, ...]:
    """Capsules and convex pieces of the arm, link by link."""
    shapes = arm_shapes(robot)
    capsules = [
        Body(link_label(c.link), c.link, np.unique([c.start, c.end], axis=0), c.radius) for c in shapes.capsules
    ]
    pieces = [Body(link_label(h.link), h.link, np.array(h.points), h.margin) for h in shapes.pieces]
    return tuple(sorted([*capsules, *pieces], key=lambda body: body.link))


def carried_bodies(robot: Robot, scene: Scene | None) -> tuple[Body, ...]:
    """What the tool carries, in the frame of the last link; a cylinder as a prism around it, under 1 % too wide."""
    if scene is None or not scene.carried:
        return ()
    last = robot.rows
    poses = frames(robot, np.zeros(robot.joints))
    T = np.linalg.inv(poses[last - 1]) @ poses[last]
    bodies = [body for solid in scene.carried for body in solid_bodies(solid)]
    points = [cylinder_points(b.points, b.disc, SIDES) if b.kind == CYLINDER else b.points for b in bodies]
    return tuple(
        Body(body.name, last, corners @ T[:3, :3].T + T[:3, 3], body.radius) for body, corners in zip(bodies, points)
    )


def solid_bodies(solid: Solid) -> tuple[Body, ...]:
    """A solid as bodies of the world."""
    match solid:
        case Plane():
            points = np.array([solid.normal, [solid.offset, 0, 0]])
            return (Body(solid.name, WORLD, points, 0.0, HALF_SPACE),)
        case Mesh():
            pieces = tuple(piece @ solid.T[:3, :3].T + solid.T[:3, 3] for piece in solid.pieces)
            return tuple(Body(solid.name, WORLD, piece, solid.margin) for piece in pieces)
        case Box():
            points, radius, kind, disc = CORNERS * solid.size, 0.0, HULL, 0.0
        case Cylinder():
            half = solid.length / 2
            points, radius, kind, disc = np.array([[0, 0, -half], [0, 0, half]]), 0.0, CYLINDER, solid.radius
        case Sphere():
            points, radius, kind, disc = np.zeros((1, 3)), solid.radius, HULL, 0.0
    return (Body(solid.name, WORLD, points @ solid.T[:3, :3].T + solid.T[:3, 3], radius, kind, disc),)


def layout_of(
    robot: Robot, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]], joined: Sequence[bool] = ()
) -> Layout:
    """Arrays of bodies and of pairs of them; the second of a pair is on the outer link, or in the world."""
    starts = np.concatenate([[0], np.cumsum([len(body.points) for body in bodies])]).astype(np.int64)
    centre, reach = np.zeros((len(bodies), 3)), np.zeros(len(bodies))
    for b, body in enumerate(bodies):
        if body.kind == HALF_SPACE:
            reach[b] = np.inf
            continue
        centre[b] = (body.points.min(axis=0) + body.points.max(axis=0)) / 2
        spread = float(np.linalg.norm(body.points - centre[b], axis=1).max())
        reach[b] = float(np.hypot(spread, body.disc)) + body.radius
    return Layout(
        direction=np.array(robot.direction, float),
        starts=joint_starts(robot),
        sliding=np.array(robot.sliding),
        coupling=np.empty((0, robot.joints)) if robot.coupling is None else np.array(robot.coupling, float),
        base=np.array(robot.base),
        links=np.array(constant_links(robot)),
        link=np.array([body.link for body in bodies], np.int64),
        start=starts,
        points=np.concatenate([body.points for body in bodies]) if bodies else np.empty((0, 3)),
        kind=np.array([body.kind for body in bodies], np.int64),
        radius=np.array([body.radius for body in bodies], float),
        disc=np.array([body.disc for body in bodies], float),
        centre=centre,
        reach=reach,
        first=np.array([i for i, _ in pairs], np.int64),
        second=np.array([j for _, j in pairs], np.int64),
        joined=np.array(joined or [False] * len(pairs), bool),
        inner=np.array([_first_joint(robot, bodies[i], bodies[j]) for i, j in pairs], np.int64),
    )


def _first_joint(robot: Robot, inner: Body, outer: Body) -> int:
    """The first row (from 0) that changes how two bodies lie: not one that turns about an axis of the inner body."""
    if outer.link == WORLD:
        return 0
    if inner.kind != HULL or inner.link >= outer.link or robot.sliding[inner.link]:
        return inner.link
    poses = frames(robot, np.zeros(robot.joints))
    start = robot.base if inner.link == 0 else poses[inner.link - 1]
    axis, point = poses[inner.link][:3, 2], poses[inner.link][:3, 3]
    placed = inner.points @ start[:3, :3].T + start[:3, 3] - point
    away = np.linalg.norm(placed - np.outer(placed @ axis, axis), axis=1).max()
    return inner.link + int(away <= ON_AXIS)
