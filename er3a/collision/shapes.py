"""The convex bodies of an arm, of what it carries and of a scene, in one form, and as arrays for kernels.

The shapes of an arm's links are those of its file, or, if the file gives none at all, capsules guessed from its table.
A file that gives any shape has to give all: a link without one has none. Files often leave links without a shape
because the shapes of their neighbours cover them (frames in a wrist, rings between two housings). A guessed capsule
would overlap the shape around the next joint in every pose.

``ArmShapes.bare`` lists the links without a shape, because their contacts are not seen. No verdict passes if such a
link reaches out of its neighbours' shapes (``ArmShapes.uncovered``), or if a link's visual mesh reaches out of its own
and its neighbours' shapes by ``VISIBLE``. Nor does one if the shapes of a link reach along too little of its
lengths in the table (``ArmShapes.partial``). Only how far they reach in the direction of a length counts, as housings
are often offset from the table's lines; and a d between parallel axes does not count, as it may stand in any row.

The guess puts a capsule around each straight piece of a link, along its joint's axis and across to the next. Its radius
is a share of the arm's size (the sum of all link lengths): 5.5 % at the shoulder, falling to 3 % at the wrist, an
estimate of how thick small industrial arms are. The column below axis 2 counts as base.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import assert_never

import numpy as np
import scipy

from er3a.by_value import by_identity, frozen
from er3a.collision.convex import cylinder_points, distances_from_hull
from er3a.collision.distances import CYLINDER, HALF_SPACE, HULL, WORLD, Layout
from er3a.collision.meshes import MOST_CORNERS, is_convex
from er3a.collision.pairs import BASE, Pair, link_label
from er3a.collision.scene import Box, Cylinder, Mesh, Plane, Scene, Solid, Sphere
from er3a.collision.triangles import TriangleTree, depths_inside, outer_corners, tree_of, trees_of
from er3a.finding import Finding, fact
from er3a.geometry.vectors import fibonacci_sphere
from er3a.kinematics.chain import ALONG_Z, TO_NEXT_AXIS, constant_links, joint_starts, link_parts
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Reals
from er3a.robots.joint_limits import size_of
from er3a.robots.robot import ConvexPiece, Envelope, Grade, LinkMesh, Robot, derived

RADIUS_RATIOS = (0.055, 0.055, 0.05, 0.045, 0.04, 0.035, 0.03)
SHORTEST = 1e-6  # m, below which a length of the table is none
LINE_POINTS, TOUCH = 25, 1e-3  # points along a piece of a link, and m, by which they may protrude
VISIBLE = 0.02  # m, by which a link's visible mesh may protrude: covers and cables do
COVERED, GAP = 0.75, 0.04  # of a link's lengths in the table its shapes have to reach along so much, or all but GAP, m
ASSUMED_GRADES: tuple[Grade, ...] = ("inferred", "claim")
PARALLEL = 1e-6  # cosine short of 1
PAST = 0.01  # m, beyond a flange: bosses and bolts stand out less
UNSHAPED = 0.02  # m, of the way from the flange to a tool's point: adapters are thin, and tools reach a little less far


@frozen
class ArmShapes:
    """All shapes of an arm's links, and what they rest on.

    Attributes
    ----------
    capsules, pieces, meshes : shapes of the links, in any order
    given : whether the robot's file gives them; else they are guessed from its table
    grade : how far they can be relied on: as the file grades them, ``inferred`` if it doesn't or if they are guessed
    bare : numbers of links from 0 on that a file which gives shapes gives none; () for guessed shapes, which leave out
        only links without length
    uncovered : of these, those that reach out of the shapes of the links beside them, along the table's lengths; and
        links whose visual meshes reach out of all shapes; each with how far, m, infinite where there are no such shapes
    partial : links with given shapes that reach along less than ``COVERED`` of the link's lengths in the table, and
        leave more than ``GAP`` of them, each with that share; not a base that is drawn, whose frame may stand anywhere
    """

    capsules: tuple[Envelope, ...]
    pieces: tuple[ConvexPiece, ...]
    meshes: tuple[LinkMesh, ...]
    given: bool
    grade: Grade
    bare: tuple[int, ...]
    uncovered: tuple[tuple[int, float], ...] = ()
    partial: tuple[tuple[int, float], ...] = ()

    @property
    def assumed(self) -> bool:
        """Whether no document that a verdict may rest on gives them, or not for all of a link."""
        return self.grade in ASSUMED_GRADES or bool(self.partial)

    @property
    def links(self) -> set[int]:
        """Numbers of the links that have a shape, 0 for the base."""
        shapes: tuple[Envelope | ConvexPiece | LinkMesh, ...] = (*self.capsules, *self.pieces, *self.meshes)
        return {shape.link for shape in shapes}


@derived
def arm_shapes(robot: Robot) -> ArmShapes:
    """The shapes of an arm: those of its file, or capsules guessed from its table if the file gives none at all.

    Parameters
    ----------
    robot : any arm

    Returns
    -------
    shapes : in the links' frames, m, and what they leave open: bare, uncovered and partial links
    """
    given = bool(robot.envelopes or robot.hulls or robot.meshes)
    capsules = robot.envelopes if given else default_envelopes(robot)
    source = robot.sources.get("envelopes")
    grade = source.grade if given and source else "inferred"
    shapes = ArmShapes(capsules, robot.hulls, robot.meshes, given, grade, ())
    bare = tuple(link for link in range(robot.rows + 1) if given and link not in shapes.links)
    shapes = replace(shapes, bare=bare)
    drawn = {BASE} & {visual.link for visual in robot.visuals}  # its frame may stand far below what is drawn of it
    lengths = ((link, *covered_lengths(robot, shapes, link)) for link in sorted(shapes.links - drawn) if given)
    beyond = ((link, _uncovered(robot, shapes, link)) for link in range(robot.rows + 1))
    return replace(
        shapes,
        uncovered=tuple((link, most) for link, most in beyond if most > 0),
        partial=tuple(
            (link, covered / whole)
            for link, covered, whole in lengths
            if covered < COVERED * whole and whole - covered > GAP
        ),
    )


def covered_lengths(robot: Robot, shapes: ArmShapes, link: int) -> tuple[float, float]:
    """How much of a link's lengths in the table its shapes, or those of its neighbours, reach along.

    Parameters
    ----------
    shapes : of the whole arm
    link : number, 0 for the base

    Returns
    -------
    covered, whole : m
    """
    found = [_covered(robot, shapes, line, link) for line in _own_lengths(robot, link)]
    return sum(covered for covered, _ in found), sum(length for _, length in found)


def _own_lengths(robot: Robot, link: int) -> list[Reals]:
    """The ends (2, 3), m, of the straight pieces of a link that its table settles: not those of flange and tool, which
    are no link's, nor a shift along an axis that is parallel to the one before or after it. Nor those to or from a
    joint that slides: any axis that is parallel to its own would do as well."""
    if robot.sliding[max(link - 1, 0) : link + 1].any():
        return []
    bare, row = robot.replace(tool=np.eye(4), flange=np.eye(4)), max(link - 1, 0)
    turns = link_parts(robot)[:, TO_NEXT_AXIS, 2, 2]
    beside = ([turns[row]] if row else []) + ([turns[row + 1]] if row + 1 < robot.rows else [])
    shifts = any(abs(turn) > 1 - PARALLEL for turn in beside)
    lines = [np.array([c.start, c.end]) for c in default_envelopes(bare) if c.link == link]
    return [line for line in lines if not (shifts and abs(line[1, 2] - line[0, 2]) > SHORTEST)]


def _covered(robot: Robot, shapes: ArmShapes, line: Reals, link: int) -> tuple[float, float]:
    """How much of one length is covered, and the length, m; from point to point (2, 3), m, in the link's frame."""
    length = float(np.linalg.norm(line[1] - line[0]))
    share = (np.arange(LINE_POINTS) + 0.5) / LINE_POINTS
    points, axis = line[0] + share[:, None] * (line[1] - line[0]), (line[1] - line[0]) / length
    covered = _beyond(robot, shapes, points, link, {link - 1, link + 1}) <= TOUCH
    for _, corners, radius in _hulls(shapes, {link}):
        along = (corners - line[0]) @ axis
        covered |= (share * length >= along.min() - radius) & (share * length <= along.max() + radius)
    return float(covered.mean()) * length, length


def _uncovered(robot: Robot, shapes: ArmShapes, link: int) -> float:
    """How far (m) points of a link lie outside its shapes and those of its two neighbours: of what it looks like, and,
    where it has no shape, along its lengths in the table, of a base from its origin on; 0 for what may be a cover."""
    beside, none = {link - 1, link, link + 1}, np.empty((0, 3))
    seen = np.concatenate([none, *(visual.points for visual in robot.visuals if visual.link == link)])
    lines = [np.linspace(c.start, c.end, LINE_POINTS) for c in default_envelopes(robot) if c.link == link]
    lines += [np.zeros((1, 3))] if link == BASE else []
    along = np.concatenate([none, *(lines if link in shapes.bare else [])])
    most = 0.0
    for points, by in ((along, TOUCH), (seen, VISIBLE)):
        beyond = _beyond(robot, shapes, points, link, beside)
        most = max(most, beyond[beyond > by].max(initial=0.0))
    return most


def has_bare_tool(robot: Robot, scene: Scene | None = None) -> bool:
    """Whether a tool, or the flange, reaches out of all shapes: those of the arm's file and of what it carries.

    Without anything carried, its point lies outside the last link's shapes. What is inside another link's shape at some
    joint values is not inside it at others. Or these shapes and what is carried leave
    more than ``UNSHAPED`` of the line from the table's end to that point free, seen along it. Something must hold what
    is carried at a tool's tip. Tools are bent, and fingers are next to the line, so it need not lie inside them.

    Parameters
    ----------
    scene : with what the tool carries; None for nothing

    Returns
    -------
    bare : False for guessed shapes, and for arms without tool and flange lengths
    """
    shapes = arm_shapes(robot)
    if not shapes.given or not (robot.tool[:3, 3].any() or robot.flange[:3, 3].any()):
        return False
    last, carried = robot.rows, carried_bodies(robot, scene)
    start, point = _end(robot.replace(tool=np.eye(4), flange=np.eye(4))), _end(robot)
    if not carried and _beyond(robot, shapes, point[None], last, {last})[0] > TOUCH:
        return True
    bodies = [*carried, *(body for body in arm_bodies(robot) if body.link == last)]
    return _length_without(bodies, start, point) > UNSHAPED


def _end(robot: Robot) -> Reals:
    """Where the tool's point is, (3,), m, in the last link's frame."""
    T = frames(robot, np.zeros(robot.joints))
    point: Reals = (np.linalg.inv(T[-2]) @ T[-1])[:3, 3]
    return point


def outward(robot: Robot) -> tuple[float, float]:
    """Which way the last joint's axis leads out of an arm, and how far the last link goes on there.

    Parameters
    ----------
    robot : its tool is not looked at

    Returns
    -------
    sense : 1 along the axis, or -1; 0 where the flange is on no side of that joint, and no file gives a shape there
    beyond : m, from the flange to the end of the last link's shape that way; 0 where that ends before, or is not around
        the flange, as a camera at its side
    """
    at = constant_links(robot.replace(tool=np.eye(4)))[-1][:3, 3]
    parts = [np.array([each.start, each.end]) for each in robot.envelopes if each.link == robot.rows]
    parts += [np.array(each.points) for each in robot.hulls if each.link == robot.rows]
    parts += [each.points for each in robot.meshes if each.link == robot.rows]
    points = np.concatenate(parts or [at[None]]) - at
    along = points[:, 2]
    sense = float(np.sign(at[2] if abs(at[2]) > SHORTEST else along.min() + along.max()))
    past = points[sense * along > PAST]
    turns = np.sort(np.arctan2(past[:, 1], past[:, 0]))
    around = len(past) > 0 and np.diff(turns, append=turns[0] + 2 * np.pi).max() < np.pi
    return sense, float((sense * past[:, 2]).max()) if around else 0.0


def _length_without(bodies: Sequence[Body], start: Reals, end: Reals) -> float:
    """The length (m) of a line, with ends (3,), along which none of some bodies in the same frame reaches."""
    length = float(np.linalg.norm(end - start))
    if length <= SHORTEST:
        return 0.0
    along = [(body.points - start) @ (end - start) / length for body in bodies]
    reach, bare = 0.0, 0.0
    for low, high in sorted((float(a.min()) - b.radius, float(a.max()) + b.radius) for a, b in zip(along, bodies)):
        bare += max(min(low, length) - reach, 0.0)
        reach = max(reach, min(high, length))
    return bare + length - reach


def _beyond(robot: Robot, shapes: ArmShapes, points: Reals, link: int, beside: set[int]) -> Reals:
    """How far points (n, 3) of a link, m, are outside the shapes of some links, (n,), m.

    They are looked at in one pose: a joint between two links turns about the line on which they meet.
    """
    T = link_frames(robot, np.clip(0.0, robot.lower, robot.upper))

    def placed(points: Reals, k: int) -> Reals:
        return points @ T[k, :3, :3].T + T[k, :3, 3]

    points = placed(points, link)
    outside = np.full(len(points), np.inf)
    for k, corners, radius in _hulls(shapes, beside):
        outside = np.minimum(outside, distances_from_hull(points, placed(corners, k)) - radius)
    return outside


def _hulls(shapes: ArmShapes, links: set[int]) -> list[tuple[int, Reals, float]]:
    """Link, corners (k, 3), m, in its frame, and radius (m) of the shapes of some links."""
    hulls = [(c.link, np.array([c.start, c.end]), c.radius) for c in shapes.capsules if c.link in links]
    hulls += [(m.link, _surface(m).points, 0.0) for m in shapes.meshes if m.link in links]
    return hulls + [(h.link, np.array(h.points), h.margin) for h in shapes.pieces if h.link in links]


def shapes_assumed(robot: Robot, margin: float, clearances: Mapping[str, float | None]) -> Finding | None:
    """The remark on collisions where the arm's shapes are assumed.

    Parameters
    ----------
    margin : m, within which of assumed shapes nothing is settled
    clearances : m, smallest ones by name; None where unknown, negative for overlaps

    Returns
    -------
    remark : None where a document that verdicts rest on gives the shapes of all links
    """
    shapes = arm_shapes(robot)
    if not shapes.assumed:
        return None
    near = tuple(name for name, smallest in clearances.items() if smallest is not None and 0 <= smallest < margin)
    partial = shapes.grade not in ASSUMED_GRADES
    return fact("shapes_assumed", given=shapes.given, margin_mm=1000 * margin, near=near, partial=partial)


def default_envelopes(robot: Robot) -> tuple[Envelope, ...]:
    """Capsules guessed along the table's link lengths.

    Parameters
    ----------
    robot : any arm; its tool gets a capsule too

    Returns
    -------
    envelopes : in the links' frames, m; links without length get none
    """
    size = size_of(robot)
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
    flange, point = _end(robot.replace(tool=np.eye(4))), _end(robot)
    found += _pieces(robot, last, size, [(across, flange), (flange, point)])
    return tuple(found)


def surely_touch(robot: Robot, pair: Pair, depth: float, margin: float) -> bool:
    """Whether an overlap is a collision for certain: motions of paths and programs fail by those, others are cautions.

    Parameters
    ----------
    pair : of bodies that overlap
    depth : m, of the overlap
    margin : m, by how much assumed shapes of the arm may be wrong; contacts between what is carried and solids rest on
        none of them

    Returns
    -------
    certain : whether it is deeper than the shapes may be wrong
    """
    assumed = arm_shapes(robot).assumed and pair.code != "carried_and_solid"
    return depth > (margin if assumed else 0.0)


def link_frames(robot: Robot, q: Reals) -> Reals:
    """Frames of the base and the links.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    T : (..., m + 1, 4, 4), T_world_link, m; the tool's frame is not among them
    """
    T = frames(robot, q)
    base = np.broadcast_to(robot.base, (*T.shape[:-3], 1, 4, 4))
    return np.concatenate([base, T[..., :-1, :, :]], axis=-3)


def _pieces(robot: Robot, link: int, size: float, lines: list[tuple[Reals, Reals]]) -> list[Envelope]:
    return [
        Envelope(link, tuple(start.tolist()), tuple(end.tolist()), RADIUS_RATIOS[round(link * 6 / robot.rows)] * size)
        for start, end in lines
        if np.linalg.norm(end - start) > SHORTEST
    ]


ON_AXIS = 1e-9  # m
LOOKED_AT = 200  # corners of a surface
BALL = 200  # corners by which a ball is drawn
CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@by_identity
class Body:
    """A convex body, or a surface of triangles.

    Attributes
    ----------
    name : ``base``, ``link_3``, or that of the solid or of what is carried
    link : 0 for the base, k for the link that row k moves, ``WORLD`` for bodies around the arm
    points : (k, 3), m, in the link's frame; a half-space has its normal and, in the second row, its offset first; of a
        surface the corners of a hull around it
    kind, radius, disc : see :mod:`er3a.collision.distances`
    tree : of a surface its triangles; None for convex bodies
    """

    name: str
    link: int
    points: Reals
    radius: float
    kind: int = HULL
    disc: float = 0.0
    tree: TriangleTree | None = None


@lru_cache(maxsize=64)
def _surface(mesh: LinkMesh) -> Body:
    """A link's surface as a body."""
    tree = tree_of(mesh.points, mesh.faces)
    return Body(link_label(mesh.link), mesh.link, outer_corners(tree.hull), 0.0, tree=tree)


def arm_bodies(robot: Robot) -> tuple[Body, ...]:
    """Capsules, convex pieces and surfaces of the arm, link by link.

    Parameters
    ----------
    robot : any arm

    Returns
    -------
    bodies : points in the frame of each body's link, m
    """
    shapes = arm_shapes(robot)
    capsules = [
        Body(link_label(c.link), c.link, np.unique([c.start, c.end], axis=0), c.radius) for c in shapes.capsules
    ]
    pieces = [Body(link_label(h.link), h.link, np.array(h.points), h.margin) for h in shapes.pieces]
    return tuple(sorted([*capsules, *pieces, *map(_surface, shapes.meshes)], key=lambda body: body.link))


def carried_bodies(robot: Robot, scene: Scene | None) -> tuple[Body, ...]:
    """What the tool carries, as bodies of the last link.

    Parameters
    ----------
    scene : None for none

    Returns
    -------
    bodies : in the last link's frame, m; a cylinder as a prism around it, at most 0.05 mm too wide
    """
    if scene is None or not scene.carried:
        return ()
    poses = frames(robot, np.zeros(robot.joints))
    T = np.linalg.inv(poses[-2]) @ poses[-1]
    found = []
    for solid in scene.carried:
        assert not isinstance(solid, Plane), "nothing carries a half-space"
        body = solid_body(replace(solid, T=T @ solid.T))
        if body.kind == CYLINDER:
            body = replace(body, kind=HULL, disc=0.0, points=cylinder_points(body.points, body.disc))
        found.append(replace(body, link=robot.rows))
    return tuple(found)


def solid_body(solid: Solid) -> Body:
    """A solid as a body of the world.

    Parameters
    ----------
    solid : of a scene

    Returns
    -------
    body : points in the world frame, m; a mesh that is closed and convex, of few corners, as its hull
    """
    match solid:
        case Plane():
            points = np.array([solid.normal, [solid.offset, 0, 0]])
            return Body(solid.name, WORLD, points, 0.0, HALF_SPACE)
        case Mesh():
            return _mesh_body(solid)
        case Box():
            points, radius, kind, disc = CORNERS * solid.size, 0.0, HULL, 0.0
        case Cylinder():
            half = solid.length / 2
            points, radius, kind, disc = np.array([[0, 0, -half], [0, 0, half]]), 0.0, CYLINDER, solid.radius
        case Sphere():
            points, radius, kind, disc = np.zeros((1, 3)), solid.radius, HULL, 0.0
        case _:
            assert_never(solid)
    return Body(solid.name, WORLD, points @ solid.T[:3, :3].T + solid.T[:3, 3], radius, kind, disc)


@lru_cache(maxsize=64)
def _mesh_body(solid: Mesh) -> Body:
    """A mesh with its tree: it takes a while to grow, so those used last are kept."""
    points, tree = placed_points(solid), tree_of(placed_points(solid), solid.faces)
    if tree.shell.all() and len(tree.hull) <= MOST_CORNERS and is_convex(points, solid.faces):
        return Body(solid.name, WORLD, tree.hull, 0.0)
    return Body(solid.name, WORLD, outer_corners(tree.hull), 0.0, tree=tree)


def depths_in(solid: Solid, points: Reals) -> Reals:
    """How deep points are in a solid.

    Parameters
    ----------
    points : (n, 3), m, world frame

    Returns
    -------
    depths : (n,), m; not above 0 outside
    """
    return _depths_in(solid_body(solid), points)


def depth_inside(body: Body, other: Body, T: Reals) -> float:
    """How deep another body has points inside a body's core.

    Parameters
    ----------
    T : (4, 4), m, places the other body in the frame of the first

    Returns
    -------
    depth : m, not below 0; of a surface up to ``LOOKED_AT`` corners in the body's box are looked at, so that it is at
        least that deep
    """
    if body.tree is None and len(body.points) <= 2 and body.kind != CYLINDER:
        return 0.0
    points = (other.points if other.tree is None else other.tree.corner.reshape(-1, 3)) @ T[:3, :3].T + T[:3, 3]
    low, high = body.points.min(axis=0) - body.disc, body.points.max(axis=0) + body.disc
    points = points[((points >= low) & (points <= high)).all(axis=1)]
    points = points[:: max(-(-len(points) // LOOKED_AT), 1)]
    return max(0.0, float(_depths_in(body, points).max(initial=0.0)))


def _depths_in(body: Body, points: Reals) -> Reals:
    if body.tree is not None:
        found = np.zeros(len(points))
        depths_inside(trees_of([body.tree]), np.ascontiguousarray(points), found)
        return found
    if body.kind == HALF_SPACE:
        return np.asarray(body.points[1, 0] - points @ body.points[0])
    if len(body.points) == 1:
        return np.asarray(body.radius - np.linalg.norm(points - body.points[0], axis=1))
    if body.kind == CYLINDER:
        start, along = body.points[0], body.points[1] - body.points[0]
        length = float(np.linalg.norm(along))
        height = (points - start) @ along / length
        away = np.linalg.norm(np.cross(points - start, along), axis=1) / length
        return np.asarray(np.min([body.disc - away, height, length - height], axis=0))
    try:
        faces = scipy.spatial.ConvexHull(body.points).equations
    except RuntimeError:  # flat, says qhull
        return np.full(len(points), -np.inf)
    return np.asarray(-(points @ faces[:, :3].T + faces[:, 3]).max(axis=1))


def solid_corners(solid: Box | Cylinder | Sphere) -> Reals:
    """Points on a convex solid's surface that it is drawn by.

    Parameters
    ----------
    solid : of a scene

    Returns
    -------
    corners : (k, 3), m, world frame
    """
    body = solid_body(solid)
    if body.kind == CYLINDER:
        return cylinder_points(body.points, body.disc)
    if body.radius:
        return np.asarray(body.points + body.radius * fibonacci_sphere(BALL))
    return body.points


def placed_points(solid: Mesh) -> Reals:
    """The points of a mesh, (k, 3), m, in the world frame.

    Parameters
    ----------
    solid : of a scene
    """
    return solid.points @ solid.T[:3, :3].T + solid.T[:3, 3]


def layout_of(
    robot: Robot, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]], joined: Sequence[bool] = ()
) -> Layout:
    """Arrays of bodies and of pairs of them, for kernels.

    Parameters
    ----------
    bodies : B, of the arm and the world
    pairs : numbers of two bodies; the second is on the outer link, or in the world
    joined : of each pair, whether a joint joins them; empty for none

    Returns
    -------
    layout : m and rad
    """
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
        trees=trees_of([body.tree for body in bodies]),
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
