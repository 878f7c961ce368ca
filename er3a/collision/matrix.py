"""The collision matrix: which pairs of an arm's bodies are checked for collisions, each with its reason.

Bodies of one link never move against each other, so they are not a pair. Every other pair is checked unless it is
proven harmless:

- *never*: the two are apart in all joint vectors within the limits, proven by bounds of the distance over boxes of
  joint values, which are halved until each is decided;
- *joined*: they overlap in all joint vectors drawn (``TRIED``) because a joint joins them. Of given hulls and surfaces,
  links with no shaped link between them count as joined, and ones across another that always overlap; they are not
  looked at. Of capsules, either no link with a shape is between the two (of neighbours, being less than ``TOUCH`` apart
  counts as overlap if it is proven), or there are two joints between them (more if their axes meet), and a ball in the
  outer link about a point of its joint's axis, or in its middle, is proven to touch the inner link in all joint
  vectors, as in a wrist. Only the region around that joint is left out, within the girth of both, from where they are
  nearest in the pose in which they are farthest apart. The rest is classified again, so that an arm that folds onto
  itself is seen. A default shape that slides in a thicker one is joined to it likewise: only the part of the guide
  along the sliding axis is left out, and nothing of the sliding shape;
- *overlaps*: they overlap in all joint vectors drawn, the boxes show none in which they don't, and no joint explains
  it. No arm is built like that, so the shapes are wrong: the overlap is left out, and every result that does not
  examine it has to say so;
- *guessed*: shapes guessed from a table (:mod:`er3a.collision.shapes`) that would be joined, but the table gives the
  link between them no length (its housing is missing), or they are neighbours between three parallel axes (the table
  does not say how far apart they lie along these), and the rest of the two overlaps in many of the joint vectors drawn
  (``POOR_GUESS``). Or that link has no length, less is left of one of the two than it is thick, and nothing is found
  that this meets, as across most wrists. The pair is left out, and results have to say so. A tool changes nothing of
  this: the capsule that leads to its point is judged apart, without the region that is left out of its link;
- *meets*: a joint vector in which they overlap was found, and one in which they don't: checked;
- *undecided*: none of this within the number of boxes: checked.

Decisions in the robot file (``Robot.pair_rules``) overrule this. *Allowed* pairs are not checked. But they are judged
as if they weren't allowed, and if they would be checked then, no verdict passes. *Watched* pairs are checked whole.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import combinations, compress, product
from typing import Literal

import numpy as np

from er3a.collision.convex import ROOM
from er3a.collision.distances import (
    FREE,
    MEETS,
    Layout,
    measure,
    pair_distance,
    place,
    search_boxes,
    unplaced,
    which_overlap,
)
from er3a.collision.pairs import BASE, PENETRATION_TOLERANCE, TRIED, link_label
from er3a.collision.scene import Box, Scene
from er3a.collision.shapes import PARALLEL, Body, arm_bodies, arm_shapes, layout_of, link_frames, solid_bodies
from er3a.kinematics.chain import TO_NEXT_AXIS, link_parts
from er3a.kinematics.forward import frames
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.robot import PairRule, Robot, derived

SHORTEST = 1e-6  # m


def girth(body: Body, centre: Reals) -> float:
    """How far a line extends from that which leads from ``centre`` (3,) through its middle, with its radius, m."""
    along, away = body.points.mean(axis=0) - centre, body.points - centre
    length = float(np.linalg.norm(along))
    if length > SHORTEST:
        away = away - np.outer(away @ along, along) / length**2
    return float(np.linalg.norm(away, axis=1).max()) + body.radius


def ball_inside(body: Body, point: Reals) -> Body | None:
    """The largest ball about a point (3,), m, that is inside a capsule; None where the point is not inside it."""
    start, along = body.points[0], body.points[-1] - body.points[0]
    share = np.clip((point - start) @ along / max(float(along @ along), SHORTEST**2), 0.0, 1.0)
    depth = body.radius - float(np.linalg.norm(point - start - share * along))
    return replace(body, points=point[None], radius=depth) if depth > 0 else None


def trimmed(body: Body, centre: Reals, radius: float) -> list[Body]:
    """What is left of a line outside the ball about ``centre`` (3,) with ``radius`` (m), the region around a joint."""
    start, end = body.points[0], body.points[-1]
    along, away = end - start, start - centre
    length = float(along @ along)
    if length <= SHORTEST**2:
        return [body] if np.linalg.norm(away) > radius else []
    return _outside(body, away, along, radius)


def beside_axis(body: Body, point: Reals, axis: Reals, radius: float) -> list[Body]:
    """What is left of a line that is farther than ``radius`` (m) from an axis through a point, both (3,)."""
    start, along = body.points[0] - point, body.points[-1] - body.points[0]
    away, across = start - (start @ axis) * axis, along - (along @ axis) * axis
    if across @ across <= SHORTEST**2:
        return [body] if np.linalg.norm(away) > radius else []
    return _outside(body, away, across, radius)


def _outside(body: Body, away: Reals, along: Reals, radius: float) -> list[Body]:
    """The parts of a body's line where ``away + s along``, s from 0 to 1, is longer than ``radius``."""
    length = float(along @ along)
    middle, half = -float(away @ along) / length, float((away @ along) ** 2 - length * (away @ away - radius**2))
    if half <= 0:
        return [body]
    half = float(np.sqrt(half)) / length
    parts = [(0.0, min(1.0, middle - half)), (max(0.0, middle + half), 1.0)]
    start, line = body.points[0], body.points[-1] - body.points[0]
    return [
        replace(body, points=np.array([start + low * line, start + high * line]))
        for low, high in parts
        if high > low and (high - low) ** 2 * length > SHORTEST**2
    ]


PairState = Literal["never", "joined", "overlaps", "guessed", "meets", "undecided", "allowed", "watched"]

BOXES = 50_000
BOXES_OF_SURFACES = 2_000
BOXES_MORE = 500  # for the other bodies of two links that are known to meet
GOAL = 0.5  # of the smallest distance sampled, to be proven at first
COAXIAL = 1e-9  # m
TOUCH = 2e-3  # m
MEETING = 0.05  # of the arm's length: axes that pass a point within that meet there
HUBS = 9  # points looked at on an axis
AROUND_GUIDE = 1.05  # of the radii of a guide and of what slides in it
POOR_GUESS = 0.1  # of the joint vectors drawn
GROWTH, GROWTHS = 1.25, 12  # of the region around a joint, until the rest comes apart


@dataclass(frozen=True, eq=False)
class JudgedPair:
    """What was found of two bodies.

    Attributes
    ----------
    bodies : pairs to be watched
    witness : (n,), rad or m, a joint vector in which watched bodies overlap; None where none was found
    lower_bound : m, a lower bound of the distance of bodies that never meet; NaN for others
    left_out : m, radius of the region around the joint that is left out, 0 where there is none
    boxes : how many boxes of joint vectors were examined
    whole : whether nothing of one of them is left without the region around the joint
    region : the pair that a joint joins, and the centres (3,), m, of what is left out, each in its own link's frame
    """

    state: PairState
    bodies: tuple[tuple[Body, Body], ...] = ()
    witness: Reals | None = None
    lower_bound: float = np.nan
    left_out: float = 0.0
    boxes: int = 0
    whole: bool = False
    region: tuple[tuple[Body, Body], list[Reals]] | None = None


@dataclass(frozen=True, eq=False)
class MatrixRow:
    """What holds of two links, or of a link and what is carried; as :class:`JudgedPair`, over all of their bodies.

    ``hides``: that an allowed pair would be watched otherwise; ``whole``: that nothing of them is left to be watched;
    ``coarse``: that guessed shapes of the two are left out, or that of the tool which one holds, and the rest watched.
    """

    first: str
    second: str
    state: PairState
    witness: Reals | None
    lower_bound: float
    left_out: float
    boxes: int
    reason: str = ""
    hides: bool = False
    whole: bool = False
    coarse: bool = False


@dataclass(frozen=True, eq=False)
class CollisionMatrix:
    """The allowed collision matrix: a row for each pair of links, and the pairs of bodies that are watched.

    ``joined`` says of each watched pair whether it is what is left of two bodies that a joint joins.
    """

    rows: tuple[MatrixRow, ...]
    watched: tuple[tuple[Body, Body], ...] = field(repr=False)
    joined: tuple[bool, ...] = field(repr=False)


@derived
@lru_cache(maxsize=32)  # of equal robots too: who checks many programs loads the arm for each
def collision_matrix(robot: Robot) -> CollisionMatrix:
    """The matrix of an arm without anything carried."""
    if not arm_shapes(robot).given:
        return _allowing(_matrix_of_guesses(robot), robot.pair_rules)
    return matrix_of(robot, list(combinations(arm_bodies(robot), 2)), robot.pair_rules)


def _matrix_of_guesses(robot: Robot) -> CollisionMatrix:
    """The matrix of guessed shapes: of the links, and of what leads to a tool's point beside them."""
    bare = {(body.link, body.points.tobytes()) for body in arm_bodies(robot.replace(tool=np.eye(4)))}
    is_own = [(body.link, body.points.tobytes()) in bare for body in arm_bodies(robot)]
    links, tool = (list(compress(arm_bodies(robot), part)) for part in (is_own, np.logical_not(is_own)))
    found = _judged(robot, list(combinations(links, 2)), robot.pair_rules)
    poor = {names for names, pairs in found.items() if _says_nothing(robot, pairs)}
    regions = {names: [each for each in pairs if each.region] for names, pairs in found.items()}
    more = _judged(robot, list(product(links, tool)), robot.pair_rules, regions)
    poor_tool = {n for n, pairs in more.items() if _mostly_overlaps(robot, [each for each in pairs if each.region])}
    rows, kept = [], {}
    for names in dict.fromkeys((*found, *more)):
        every = [*found.get(names, ()), *more.get(names, ())]
        kept[names] = [
            each for part, bad in ((found, poor), (more, poor_tool)) if names not in bad for each in part.get(names, ())
        ]
        row = _row(*names, every, _reason(names, robot.pair_rules))
        if names in poor | poor_tool:
            watched = any(each.bodies for each in kept[names])
            row = replace(_row(*names, kept[names], ""), coarse=True) if watched else replace(row, state="guessed")
        rows.append(row)
    return CollisionMatrix(tuple(rows), *_watched(kept.values()))


def _says_nothing(robot: Robot, pairs: Sequence[JudgedPair]) -> bool:
    """Whether guessed shapes of two links are too coarse to show collisions of them."""
    return _mostly_overlaps(robot, pairs) or _hardly_left(pairs)


def _mostly_overlaps(robot: Robot, pairs: Sequence[JudgedPair]) -> bool:
    """Whether what is left of joined pairs overlaps in many joint vectors, because the link between them has no length
    in the table, or it does not say whether they lie side by side."""
    joined = [pair for each in pairs if each.state == "joined" for pair in each.bodies]
    left = [pair for pair in joined if pair[1].link > pair[0].link + 1 or _may_pass(robot, pair[0].link)]
    return bool(left) and bool(_overlap(robot, left).any(axis=1).mean() >= POOR_GUESS)


def _hardly_left(pairs: Sequence[JudgedPair]) -> bool:
    """Whether less than its thickness is left of one of two bodies across a link without length, and nothing of their
    links was found to meet."""
    regions = [(each.left_out, *each.region) for each in pairs if each.region]
    if not regions or any(each.bodies if each.region is None else each.witness is not None for each in pairs):
        return False
    return all(
        pair[1].link > pair[0].link + 1
        and any(_length(trimmed(body, centre, radius)) < body.radius for body, centre in zip(pair, centres))
        for radius, pair, centres in regions
    )


def _length(parts: Sequence[Body]) -> float:
    """The length of lines together, m."""
    return sum(float(np.linalg.norm(part.points[-1] - part.points[0])) for part in parts)


def _may_pass(robot: Robot, link: int) -> bool:
    """Whether a link and the next may lie side by side for all that the table says: along three parallel axes that
    turn it gives only the sum of how far the links shift."""
    if not 0 < link < robot.rows - 1 or robot.sliding[link - 1 : link + 2].any():
        return False
    turns = link_parts(robot)[link : link + 2, TO_NEXT_AXIS, 2, 2]
    return bool((np.abs(turns) > 1 - PARALLEL).all())


def matrix_of(robot: Robot, pairs: Sequence[tuple[Body, Body]], rules: Sequence[PairRule]) -> CollisionMatrix:
    """Judge pairs of bodies of different links."""
    return _allowing(_as_matrix(_judged(robot, pairs, rules), rules), rules)


def _judged(
    robot: Robot,
    pairs: Sequence[tuple[Body, Body]],
    rules: Sequence[PairRule],
    regions: Mapping[tuple[str, str], Sequence[JudgedPair]] | None = None,
) -> dict[tuple[str, str], list[JudgedPair]]:
    """Judgements of pairs of bodies of different links, by the names of the two; as if none were allowed.

    ``regions``: of other bodies of the links, that joints join: what is left out of these is left out of ``pairs`` too
    """
    by_names: dict[tuple[str, str], list[tuple[Body, Body]]] = {}
    for first, second in pairs:
        if first.link != second.link:
            inner, outer = (first, second) if first.link < second.link else (second, first)
            by_names.setdefault((inner.name, outer.name), []).append((inner, outer))
    decided = {frozenset((rule.first, rule.second)) for rule in rules if rule.rule == "watch"}
    found = {}
    for names, bodies in by_names.items():
        if frozenset(names) in decided:
            found[names] = [JudgedPair("watched", tuple(bodies))]
        elif any(body.tree or len(body.points) > 2 for pair in bodies for body in pair):
            found[names] = _judged_given(robot, bodies)
        else:
            judged = judged_pairs(robot, bodies, BOXES)
            if regions:
                judged = [_beyond_joint(robot, *each, regions.get(names, ())) for each in zip(bodies, judged)]
            found[names] = judged
    return found


def _beyond_joint(robot: Robot, pair: tuple[Body, Body], found: JudgedPair, joined: Sequence[JudgedPair]) -> JudgedPair:
    """The judgement of a link and what leads to a tool's point, without the region of a joint that joins the link and
    the one with the tool.

    Its own ``region`` is kept only where the two overlap always: else they are no pair that a joint joins.
    """
    for each in joined:
        if each.region and each.region[0][0] is pair[0] and found.state in ("meets", "undecided", "overlaps"):
            rest = _cut(robot, pair, (each.region[1], each.left_out), (found.boxes, BOXES))
            return rest if found.state == "overlaps" else replace(rest, region=None)
    return found


def _as_matrix(found: Mapping[tuple[str, str], Sequence[JudgedPair]], rules: Sequence[PairRule]) -> CollisionMatrix:
    """Judgements, by the names of the two links, as rows and as pairs of bodies."""
    rows = (_row(*names, pairs, _reason(names, rules)) for names, pairs in found.items())
    return CollisionMatrix(tuple(rows), *_watched(found.values()))


def _reason(names: tuple[str, str], rules: Sequence[PairRule]) -> str:
    """Why a rule has two links watched; empty where none does."""
    decided = {frozenset((rule.first, rule.second)): rule.reason for rule in rules if rule.rule == "watch"}
    return decided.get(frozenset(names), "")


def _watched(found: Iterable[Sequence[JudgedPair]]) -> tuple[tuple[tuple[Body, Body], ...], tuple[bool, ...]]:
    """The pairs of bodies to be watched, and of each whether a joint joins them."""
    watched = [(pair, each.state == "joined") for pairs in found for each in pairs for pair in each.bodies]
    return tuple(pair for pair, _ in watched), tuple(joined for _, joined in watched)


def _allowing(matrix: CollisionMatrix, rules: Sequence[PairRule]) -> CollisionMatrix:
    """A matrix without the pairs that rules allow, of which it says whether that hides anything.

    Two links that a joint joins overlap always, but what is left of them without its region may meet.
    """
    allowed = {frozenset((rule.first, rule.second)): rule.reason for rule in rules if rule.rule == "allow"}
    named = [frozenset(body.name for body in pair) for pair in matrix.watched]

    def let(row: MatrixRow, pair: frozenset[str]) -> MatrixRow:
        witness = row.witness if pair in named else None
        found = replace(
            row, state="allowed", witness=witness, lower_bound=np.nan, left_out=0.0, whole=False, coarse=False
        )
        return replace(found, reason=allowed[pair], hides=pair in named)

    rows = ((row, frozenset((row.first, row.second))) for row in matrix.rows)
    kept = [names not in allowed for names in named]
    return CollisionMatrix(
        tuple(let(row, pair) if pair in allowed else row for row, pair in rows),
        tuple(compress(matrix.watched, kept)),
        tuple(compress(matrix.joined, kept)),
    )


def judged_pairs(robot: Robot, pairs: Sequence[tuple[Body, Body]], boxes: int) -> list[JudgedPair]:
    """Judge pairs of bodies, the second on the link that is farther out."""
    flat = [body for pair in pairs for body in pair]
    layout = layout_of(robot, flat, [(2 * k, 2 * k + 1) for k in range(len(pairs))])
    q, distance, overlap = _sampled(robot, layout)
    always: Flags = np.asarray(overlap.all(axis=0))
    meets: Flags = np.asarray(overlap.any(axis=0)) & ~always
    if meets.any():
        boxes = min(boxes, BOXES_MORE)
    found = []
    for k, pair in enumerate(pairs):
        sampled = distance[:, k]
        if always[k]:
            found.append(_overlapping(robot, pair, q, sampled, boxes))
            continue
        if meets[k] and (guide := _guide(robot, pair)):
            rest = [(part, pair[1]) for part in beside_axis(pair[0], *guide)]
            parts = judged_pairs(robot, rest, boxes) if rest else []
            watched = tuple(pair for each in parts for pair in each.bodies)
            witness = next((each.witness for each in parts if each.witness is not None), None)
            boxes_looked_at = sum(each.boxes for each in parts)
            found.append(JudgedPair("joined", watched, witness, left_out=guide[2], boxes=boxes_looked_at))
            continue
        if meets[k]:
            grown = (pair[0], replace(pair[1], radius=pair[1].radius + TOUCH))
            held = _held(robot, grown, boxes) if _neighbours(robot, pair) and sampled.max() < TOUCH else None
            if held is not None:
                found.append(_joined(robot, pair, q[sampled.argmax()], (held, boxes)))
            else:
                witness = q[np.where(overlap[:, k], sampled, np.inf).argmin()]
                found.append(JudgedPair("meets", (pair,), witness))
            continue
        found.append(_searched(robot, layout, k, pair, float(sampled.min()), boxes))
    return found


def _searched(robot: Robot, layout: Layout, k: int, pair: tuple[Body, Body], least: float, boxes: int) -> JudgedPair:
    """A pair of bodies that overlaps in none of the joint vectors drawn; of these, its least distance, m."""
    box, at = np.stack([robot.lower, robot.upper]), np.empty(robot.joints)
    outcome, looked, bound = search_boxes(layout, k, box, (False, GOAL * least), boxes // 2, at)
    if outcome not in (FREE, MEETS):
        outcome, more, bound = search_boxes(layout, k, box, (False, 0.0), boxes, at)
        looked += more
    if outcome == MEETS:
        return JudgedPair("meets", (pair,), at, boxes=looked)
    if outcome == FREE:
        return JudgedPair("never", lower_bound=bound, boxes=looked)
    return JudgedPair("undecided", (pair,), boxes=looked)


def _judged_given(robot: Robot, pairs: Sequence[tuple[Body, Body]]) -> list[JudgedPair]:
    """Judge all bodies of two links, some of them hulls or surfaces, as MoveIt's setup assistant does.

    Neighbours are not looked at, nor links across another that overlap in all joint vectors drawn.
    """
    inner, outer = pairs[0]
    if outer.name == link_label(outer.link) and _neighbours(robot, pairs[0]):
        return [JudgedPair("joined", whole=True)]
    q, overlap = quasi_random_points(robot.lower, robot.upper, TRIED), _overlap(robot, pairs)
    if overlap.any(axis=1).all():
        across = outer.link - inner.link <= 2
        return [JudgedPair("joined", whole=True) if across else JudgedPair("overlaps", witness=q[0])]
    found = []
    for k, pair in enumerate(pairs):
        layout = layout_of(robot, pair, [(0, 1)])
        if overlap[:, k].any():
            found.append(JudgedPair("meets", (pair,), q[overlap[:, k].argmax()]))
        elif any(body.tree for body in pair):
            found.append(_searched(robot, layout, 0, pair, 0.0, BOXES_OF_SURFACES))
        else:
            found.append(_searched(robot, layout, 0, pair, float(_sampled(robot, layout)[1].min()), BOXES))
    return found


def _overlapping(robot: Robot, pair: tuple[Body, Body], q: Reals, distance: Reals, boxes: int) -> JudgedPair:
    """A pair that overlaps in all joint vectors drawn (N, n); of these, ``distance`` (N,), negative or 0."""
    held, neighbours = _held(robot, pair, boxes) is not None, _neighbours(robot, pair)
    layout, box, at = layout_of(robot, pair, [(0, 1)]), np.stack([robot.lower, robot.upper]), np.empty(robot.joints)
    outcome, looked, _ = search_boxes(layout, 0, box, (True, 0.0), boxes // 2, at)
    if outcome not in (FREE, MEETS):
        outcome, more, _ = search_boxes(layout, 0, box, (True, 0.0), boxes, at)
        looked += more
    if outcome == MEETS:
        return JudgedPair("meets", (pair,), q[distance.argmin()], boxes=looked)
    if neighbours or held:
        return _joined(robot, pair, q[distance.argmax()], (looked, boxes))
    return JudgedPair("overlaps", witness=q[0], boxes=looked)


def _overlap(robot: Robot, pairs: Sequence[tuple[Body, Body]]) -> Flags:
    """Who overlaps, (TRIED, K), in the joint vectors drawn."""
    flat = [body for pair in pairs for body in pair]
    found = np.empty((TRIED, len(pairs)), bool)
    layout = layout_of(robot, flat, [(2 * k, 2 * k + 1) for k in range(len(pairs))])
    which_overlap(layout, quasi_random_points(robot.lower, robot.upper, TRIED), found)
    return found


def _neighbours(robot: Robot, pair: tuple[Body, Body]) -> bool:
    """Whether no link with a shape is between the two bodies' links."""
    return arm_shapes(robot).links.isdisjoint(range(pair[0].link + 1, pair[1].link))


def _held(robot: Robot, pair: tuple[Body, Body], boxes: int) -> int | None:
    """How many boxes of joint vectors prove that a joint holds two bodies together; None if it is not proven.

    A ball inside the outer body, about a point of its joint's axis or in its middle, overlaps the inner body in all
    joint vectors; it moves only as its centre does.
    """
    inner, outer = pair
    T = link_frames(robot, quasi_random_points(robot.lower, robot.upper, TRIED))
    seen = np.linalg.inv(T[:, inner.link]) @ T[:, outer.link]  # the outer link's frame in the inner's
    centre = outer.points.mean(axis=0)
    heights = np.linspace(outer.points[:, 2].min() - outer.radius, outer.points[:, 2].max() + outer.radius, HUBS)
    hubs = np.concatenate([np.c_[np.zeros((HUBS, 2)), heights], centre[None]])
    balls = [ball for hub in hubs if (ball := ball_inside(outer, hub)) is not None]
    if outer.link - inner.link > 2:
        length = MEETING * float(np.abs(robot.a).sum() + np.abs(robot.d).sum())
        ways = [np.ptp(seen[:, :3, :3] @ ball.points[0] + seen[:, :3, 3], axis=0) for ball in balls]
        balls = [ball for ball, way in zip(balls, ways) if np.linalg.norm(way) <= 2 * length]
    if not balls:
        return None
    layout = layout_of(robot, [inner, *balls], [(0, 1 + k) for k in range(len(balls))])
    distance = _sampled(robot, layout)[1].max(axis=0)
    best = int(distance.argmin())
    if distance[best] >= 0:
        return None
    box = np.stack([robot.lower, robot.upper])
    outcome, looked, _ = search_boxes(layout, best, box, (True, 0.0), boxes, np.empty(robot.joints))
    return looked if outcome == FREE else None


def _guide(robot: Robot, pair: tuple[Body, Body]) -> tuple[Reals, Reals, float] | None:
    """Of a default shape that slides in another one: point and axis (3,) of the slide, and radius of what is left out.

    In the inner link's frame, m. All joints between the two slide along this axis or turn about it, so that it lies
    still in the guide; the axis leads through the guide's core, and the outer body is no thicker about it.
    """
    inner, outer = pair
    between = range(inner.link, outer.link)
    given = arm_shapes(robot).given
    if given or robot.coupling is not None or not any(robot.sliding[k] for k in between):
        return None
    poses = frames(robot, np.zeros(robot.joints))
    start = robot.base if inner.link == 0 else poses[inner.link - 1]
    axis, point = poses[inner.link][:3, 2], poses[inner.link][:3, 3]

    def away(points: Reals) -> Reals:
        distances: Reals = np.linalg.norm(np.cross(points - point, axis), axis=-1)
        return distances

    if max(away(poses[k][:3, 3] + side * poses[k][:3, 2]) for k in between for side in (0.0, 1.0)) > COAXIAL:
        return None
    carrier = poses[outer.link - 1]
    thick = float(away(outer.points @ carrier[:3, :3].T + carrier[:3, 3]).max()) + outer.radius
    slide = start[:3, :3].T @ (point - start[:3, 3]), start[:3, :3].T @ axis
    if thick > inner.radius or beside_axis(inner, *slide, inner.radius) == [inner]:
        return None
    return *slide, AROUND_GUIDE * (inner.radius + thick)


def _joined(robot: Robot, pair: tuple[Body, Body], apart: Reals, boxes: tuple[int, int]) -> JudgedPair:
    """A pair that overlaps in every pose: without the region around the joint, judged again.

    ``boxes``: how many were examined, and how many may be.
    """
    centres = _centres(robot, pair, apart)
    return _cut(robot, pair, (centres, sum(girth(body, centre) for body, centre in zip(pair, centres))), boxes)


def _cut(
    robot: Robot, pair: tuple[Body, Body], region: tuple[list[Reals], float], boxes: tuple[int, int]
) -> JudgedPair:
    """Two bodies without the region around their joint (centres, radius in m), which grows until the rest comes apart;
    ``boxes`` as of :func:`_joined`."""
    (centres, radius), (looked, most) = region, boxes
    for _ in range(GROWTHS):
        parts = [trimmed(body, centre, radius) for body, centre in zip(pair, centres)]
        rest = [(first, second) for first in parts[0] for second in parts[1]]
        found = _without_joining(robot, rest, most)
        if found is not None:
            watched = tuple(pair for each in found for pair in each.bodies)
            witness = next((each.witness for each in found if each.witness is not None), None)
            looked += sum(each.boxes for each in found)
            return JudgedPair("joined", watched, witness, np.nan, radius, looked, not rest, (pair, centres))
        radius *= GROWTH
    return JudgedPair("joined", left_out=radius, boxes=looked, whole=True, region=(pair, centres))


def _without_joining(robot: Robot, pairs: Sequence[tuple[Body, Body]], boxes: int) -> list[JudgedPair] | None:
    """Judgements of trimmed pairs; None if one of them still overlaps in every pose."""
    if not pairs:
        return []
    return None if _overlap(robot, pairs).all(axis=0).any() else judged_pairs(robot, pairs, boxes)


def _sampled(robot: Robot, layout: Layout) -> tuple[Reals, Reals, Flags]:
    """Joint vectors (TRIED, n) spread over the limits; of all pairs the distances (TRIED, K), and who overlaps.

    Of cores that overlap the distance is only a bound, 0 for bodies without a margin.
    """
    q = quasi_random_points(robot.lower, robot.upper, TRIED)
    found, none = np.empty((TRIED, len(layout.first))), np.empty(TRIED)
    measure(layout, q, found, none, np.empty(TRIED, np.int64), np.empty(TRIED, bool))
    return q, found, found <= 0


def _centres(robot: Robot, pair: tuple[Body, Body], q: Reals) -> list[Reals]:
    """Where two lines are nearest in an arm pose (n,), each (3,) in its own link's frame, m."""
    layout, near = layout_of(robot, pair, [(0, 1)]), np.empty((2, 3))
    T, world, middle = unplaced(layout)
    place(layout, q, T, world, middle)
    pair_distance(layout, T, world, 0, 1, np.empty((ROOM, 3)), near, np.inf)
    frames = (T[body.link] for body in pair)
    return [frame[:3, :3].T @ (point - frame[:3, 3]) for frame, point in zip(frames, near)]


def _row(first: str, second: str, found: Sequence[JudgedPair], reason: str) -> MatrixRow:
    """One row over all pairs of bodies of two links; the most serious state of the watched ones."""
    watched = [each for each in found if each.bodies or each.state == "overlaps"]
    by_severity = ("overlaps", "meets", "undecided", "joined", "watched", "allowed", "never")
    state = min((each.state for each in watched or found), key=by_severity.index)
    witness = next((each.witness for each in found if each.witness is not None), None)
    bounds = [each.lower_bound for each in found if each.state == "never"]
    return MatrixRow(
        first,
        second,
        state,
        witness,
        min(bounds) if state == "never" else np.nan,
        max(each.left_out for each in found),
        sum(each.boxes for each in found),
        reason,
        whole=not watched and any(each.whole for each in found),
    )


INSIDE = 1e-6  # m


@dataclass(frozen=True)
class BaseContact:
    """A solid that a body of the base touches, by a depth (m; of hulls in solids with faces at least that).

    ``inside``: the body's middle, of a capsule its line, reaches into the solid, so that it is no mere mounting.
    """

    solid: str
    depth: float
    inside: bool


def base_contacts(robot: Robot, scene: Scene | None) -> tuple[BaseContact, ...]:
    """Solids that the base overlaps or rests on, the deepest contact with each."""
    base = [body for body in arm_bodies(robot) if body.link == BASE]
    solids = [body for solid in (scene.solids if scene else ()) for body in solid_bodies(solid)]
    bodies = [*base, *map(_middle, base), *solids]
    pairs = list(product(range(len(base)), range(2 * len(base), len(bodies))))
    if not pairs:
        return ()
    layout = layout_of(robot, bodies, pairs)
    T, w, middles = unplaced(layout)
    place(layout, np.zeros(robot.joints), T, w, middles)
    found: dict[str, BaseContact] = {}
    for a, b in pairs:
        room, near = np.empty((ROOM, 3)), np.empty((2, 3))
        distance, touches = pair_distance(layout, T, w, a, b, room, near, np.inf)
        middle, deep = pair_distance(layout, T, w, len(base) + a, b, room, near, np.inf)
        margin = bodies[b].radius if len(bodies[b].points) > 1 else 0.0  # a ball's radius is none
        inside = bool(deep) or middle + bodies[a].radius + margin < -INSIDE
        contact = BaseContact(bodies[b].name, 0.0 - float(distance), inside)
        before = found.get(contact.solid)
        if (touches or distance < 0) and (
            before is None or (contact.inside, contact.depth) > (before.inside, before.depth)
        ):
            found[contact.solid] = contact
    return tuple(found.values())


def solids_met(robot: Robot, box: Box, scene: Scene) -> tuple[str, ...]:
    """Solids of a scene, by name, that a box would overlap by more than ``PENETRATION_TOLERANCE`` on a side."""
    inner = replace(box, size=np.maximum(np.asarray(box.size) - 2 * PENETRATION_TOLERANCE, PENETRATION_TOLERANCE))
    bodies = [*solid_bodies(inner), *(body for solid in scene.solids for body in solid_bodies(solid))]
    layout = layout_of(robot, bodies, [(0, k) for k in range(1, len(bodies))])
    (T, w, middles), room, near = unplaced(layout), np.empty((ROOM, 3)), np.empty((2, 3))
    place(layout, np.zeros(robot.joints), T, w, middles)
    found = [pair_distance(layout, T, w, 0, k, room, near, np.inf) for k in range(1, len(bodies))]
    met = (body.name for body, (distance, deep) in zip(bodies[1:], found) if deep or distance < 0)
    return tuple(dict.fromkeys(met))


def _middle(body: Body) -> Body:
    """Of a capsule half its line; a hull at half its size, about the mean of its six ends."""
    at_end = [np.isclose(body.points, end(body.points, axis=0)) for end in (np.min, np.max)]
    ends = [body.points[each].mean(axis=0) for each in np.concatenate(at_end, axis=1).T]
    return replace(body, points=(body.points + np.mean(ends, axis=0)) / 2, tree=None)
