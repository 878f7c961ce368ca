"""The collision matrix: which pairs of an arm's links are checked for collisions, each with its reason.

As MoveIt's setup assistant has it, but that "never" is proven:

- *joined*: a joint joins the two: no link with a shape is between them, or they are at most ``ACROSS`` joints apart
  and overlap in all joint vectors drawn (``TRIED``), as across a wrist. Hulls and surfaces are not checked then, nor
  those that stay within ``PLAY`` of each other there: what rubs at each joint value is a bearing, and whether it
  touches by the rounding of a mesh's corners says nothing. Of capsules the region around the joint is left out, within
  the girth of both, from where they are nearest in the pose in which they are farthest apart. The rest is checked, so
  that an arm that folds onto itself is seen;
- *overlaps*: they overlap in all joint vectors drawn and no joint explains it. No arm is built like that, so the shapes
  are wrong: they are not checked, and every result that does not examine them has to say so;
- *coarse*: shapes of links as near to each other that overlap too often for an arm. Guessed from a table
  (:mod:`er3a.collision.shapes`): in many of the joint vectors drawn (``POOR_GUESS``), without that region if a joint
  joins them. Hulls and surfaces that a file gives: in ``MOST``, and no joint vector parts them by
  ``ASSUMED_MARGIN``, or they only slide along each other: housings and the stages of a telescope, drawn too large. A
  link that folds onto another parts from it elsewhere. Not checked: every result names them, and none passes where
  a file gives the shapes;
- *never*: the two are apart in all joint vectors within the limits, proven by bounds of the distance over boxes of
  joint values, which are halved until each is decided;
- *meets*: a joint vector in which they overlap was found, and one in which they don't: checked;
- *undecided*: none of this within the number of boxes: checked.

Decisions in the robot file (``Robot.pair_rules``) overrule this. *Allowed* pairs are not checked. But they are judged
as if they weren't allowed, and if they would be checked then, no verdict passes. *Watched* pairs are checked whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import lru_cache
from itertools import combinations, product
from typing import Literal

import numpy as np

from er3a.by_value import by_identity, frozen
from er3a.collision.distances import FREE, MEETS, Layout, measure, search_boxes, some_distances, which_overlap
from er3a.collision.pairs import ASSUMED_MARGIN, BASE, PENETRATION_TOLERANCE, TRIED, link_label
from er3a.collision.scene import Box, Scene
from er3a.collision.shapes import Body, arm_bodies, arm_shapes, layout_of, link_frames, solid_body
from er3a.numerics.arrays import Flags, Reals
from er3a.numerics.quasi_random import quasi_random_points
from er3a.robots.robot import PairRule, Robot, derived

PairState = Literal["never", "joined", "overlaps", "coarse", "meets", "undecided", "allowed", "watched"]

ACROSS = 2  # joints that a wrist's housing hides
POOR_GUESS = 0.1  # of the joint vectors drawn
MOST = 0.5  # of the joint vectors drawn; of 63 arms, housings overlap in 0.6 or more of them, links that fold in 0.46
FEW = 8  # of the joint vectors drawn: in one of them most pairs part
PLAY = 1e-3  # m, between housings that turn in each other
BOXES = 50_000
BOXES_OF_SURFACES = 2_000
BOXES_MORE = 500  # for the other bodies of two links that are known to meet
GOAL = 0.5  # of the smallest distance sampled, to be proven at first
GROWTH, GROWTHS = 1.25, 12  # of the region around a joint, until the rest comes apart
SHORTEST = 1e-6  # m

BodyPair = tuple[Body, Body]


@by_identity
class MatrixRow:
    """What holds of two links, or of a link and what is carried, over all of their bodies.

    Attributes
    ----------
    witness : (n,), rad or m, a joint vector in which they overlap; None where none was found
    lower_bound : m, a lower bound of the distance of links that never meet; NaN for others
    left_out : m, radius of the region around their joint that is left out, 0 where there is none
    boxes : how many boxes of joint vectors were examined
    reason : why a rule decides; empty where none does
    hides : whether an allowed pair would be checked otherwise
    """

    first: str
    second: str
    state: PairState
    witness: Reals | None = None
    lower_bound: float = np.nan
    left_out: float = 0.0
    boxes: int = 0
    reason: str = ""
    hides: bool = False


@by_identity
class CollisionMatrix:
    """The allowed collision matrix: a row for each pair of links, and the pairs of bodies that are checked.

    ``joined`` says of each of these whether only overlap means anything: of what is left of two bodies that a joint
    joins, and of assumed shapes that never part by ``ASSUMED_MARGIN``.
    """

    rows: tuple[MatrixRow, ...]
    watched: tuple[BodyPair, ...] = field(repr=False)
    joined: tuple[bool, ...] = field(repr=False)


@derived
@lru_cache(maxsize=32)  # of equal robots too: who checks many programs loads the arm for each
def collision_matrix(robot: Robot) -> CollisionMatrix:
    """The matrix of an arm without anything carried; kept, also for equal robots.

    Parameters
    ----------
    robot : with its shapes, and the rules of its file

    Returns
    -------
    matrix : a row for each pair of links that have shapes
    """
    return matrix_of(robot, list(combinations(arm_bodies(robot), 2)), robot.pair_rules)


def matrix_of(robot: Robot, pairs: Sequence[BodyPair], rules: Sequence[PairRule]) -> CollisionMatrix:
    """Judge pairs of bodies of different links; bodies of one link never move against each other.

    Parameters
    ----------
    pairs : of bodies, in any order
    rules : what the file decides of pairs of links or carried bodies, by their names

    Returns
    -------
    matrix : a row for each two names, and the pairs of bodies that are to be checked
    """
    by_names: dict[tuple[str, str], list[BodyPair]] = {}
    for pair in pairs:
        inner, outer = sorted(pair, key=lambda body: body.link)
        if inner.link < outer.link:
            by_names.setdefault((inner.name, outer.name), []).append((inner, outer))
    decided = {frozenset((rule.first, rule.second)): rule for rule in rules}
    rows, watched, joined = list[MatrixRow](), list[BodyPair](), list[bool]()
    for names, bodies in by_names.items():
        rule = decided.get(frozenset(names))
        if rule and rule.rule == "watch":
            row, kept = MatrixRow(*names, "watched", reason=rule.reason), bodies
        else:
            row, kept = _judged(robot, bodies)
        if rule and rule.rule == "allow":
            witness = row.witness if kept else None
            row, kept = MatrixRow(*names, "allowed", witness, reason=rule.reason, hides=bool(kept)), []
        rows.append(row)
        watched += kept
        guessed = arm_shapes(robot).assumed and not rule and _held(robot, kept, ASSUMED_MARGIN)
        joined += [row.state == "joined" or guessed] * len(kept)
    return CollisionMatrix(tuple(rows), tuple(watched), tuple(joined))


def _judged(robot: Robot, pairs: Sequence[BodyPair]) -> tuple[MatrixRow, list[BodyPair]]:
    """What holds of the bodies of two links, and which of them are to be checked."""
    inner, outer = pairs[0]
    names, own = (inner.name, outer.name), outer.name == link_label(outer.link)
    neighbours = own and arm_shapes(robot).links.isdisjoint(range(inner.link + 1, outer.link))
    capsules = not any(body.tree or len(body.points) > 2 for pair in pairs for body in pair)
    joined = MatrixRow(*names, "joined"), list[BodyPair]()
    if neighbours and not capsules:
        return joined
    overlap = _overlap(robot, pairs)
    near, share = neighbours or outer.link - inner.link <= ACROSS, float(overlap.any(axis=1).mean())
    if share == 1.0 and not near:
        return MatrixRow(*names, "overlaps", _drawn(robot)[0]), []
    if share == 1.0 and capsules:
        return _joined(robot, pairs, overlap)
    if near and not capsules and _held(robot, pairs, PLAY):
        return joined
    guessed = share >= POOR_GUESS and not arm_shapes(robot).given
    if near and (guessed or (share > MOST and own and not capsules and _never_parts(robot, pairs))):
        return MatrixRow(*names, "coarse"), []
    row, watched = _checked(robot, pairs, overlap)
    return row, [*pairs] if watched else []  # the distance of two links is that of all of their bodies


def _never_parts(robot: Robot, pairs: Sequence[BodyPair]) -> bool:
    """Whether two links only slide along each other, or stay too near for any margin, so that neither can fold."""
    inner, outer = pairs[0]
    return bool(robot.sliding[inner.link : outer.link].all()) or _held(robot, pairs, ASSUMED_MARGIN)


def _held(robot: Robot, pairs: Sequence[BodyPair], within: float) -> bool:
    """Whether bodies of two links stay within a distance (m) of each other in all joint vectors drawn."""
    return all(_least(robot, pairs, count).max() <= within for count in (FEW, TRIED))


def _checked(robot: Robot, pairs: Sequence[BodyPair], overlap: Flags) -> tuple[MatrixRow, list[BodyPair]]:
    """Bodies of two links that no joint joins, which overlap (TRIED, K) in the joint vectors drawn: all but those that
    are proven never to meet are to be checked."""
    met = overlap.any(axis=1)
    boxes, witness = (BOXES_MORE, _drawn(robot)[met.argmax()]) if met.any() else (BOXES, None)
    watched, bounds, looked = [], [np.inf], 0
    for pair, meets in zip(pairs, np.asarray(overlap.any(axis=0)).tolist()):
        if not meets:
            outcome, at, bound, more = _searched(robot, pair, boxes)
            looked += more
            if outcome == FREE:
                bounds.append(bound)
                continue
            witness = at if witness is None and outcome == MEETS else witness
        watched.append(pair)
    state: PairState = "never" if not watched else "undecided" if witness is None else "meets"
    bound = np.nan if watched else min(bounds)
    return MatrixRow(pairs[0][0].name, pairs[0][1].name, state, witness, bound, boxes=looked), watched


def _joined(robot: Robot, pairs: Sequence[BodyPair], overlap: Flags) -> tuple[MatrixRow, list[BodyPair]]:
    """Capsules of two links that a joint joins, without the region around it: it grows until the rest comes apart."""
    bodies = pairs[int(overlap.sum(axis=0).argmax())]
    names, centres = (bodies[0].name, bodies[1].name), _centres(robot, bodies)
    radius = sum(map(girth, bodies, centres))
    for _ in range(GROWTHS):
        rest = [
            (first, second)
            for one, other in pairs
            for first in trimmed(one, centres[0], radius)
            for second in trimmed(other, centres[1], radius)
        ]
        left = _overlap(robot, rest)
        if not left.all(axis=0).any():
            break
        radius *= GROWTH
    else:
        rest = []
    row = MatrixRow(*names, "joined", left_out=radius)
    if not rest:
        return row, []
    if left.any(axis=1).mean() >= POOR_GUESS and not arm_shapes(robot).given:
        return MatrixRow(*names, "coarse"), []
    found, watched = _checked(robot, rest, left)
    return replace(row, witness=found.witness, boxes=found.boxes), watched


def girth(body: Body, centre: Reals) -> float:
    """How far a capsule extends from the line that leads from a point through its middle.

    Parameters
    ----------
    centre : (3,), m, in the frame of the body's link

    Returns
    -------
    girth : m, its radius included
    """
    along, away = body.points.mean(axis=0) - centre, body.points - centre
    length = float(np.linalg.norm(along))
    if length > SHORTEST:
        away = away - np.outer(away @ along, along) / length**2
    return float(np.linalg.norm(away, axis=1).max()) + body.radius


def trimmed(body: Body, centre: Reals, radius: float) -> list[Body]:
    """What is left of a capsule's line outside a ball.

    Parameters
    ----------
    centre : (3,), m, in the frame of the body's link
    radius : m

    Returns
    -------
    bodies : up to two capsules; none if the line is wholly inside
    """
    start, line = body.points[0], body.points[-1] - body.points[0]
    away, length = start - centre, float(line @ line)
    if length <= SHORTEST**2:
        return [body] if np.linalg.norm(away) > radius else []
    middle, half = -float(away @ line) / length, float((away @ line) ** 2 - length * (away @ away - radius**2))
    if half <= 0:
        return [body]
    half = float(np.sqrt(half)) / length
    parts = [(0.0, min(1.0, middle - half)), (max(0.0, middle + half), 1.0)]
    return [
        replace(body, points=np.array([start + low * line, start + high * line]))
        for low, high in parts
        if high > low and (high - low) ** 2 * length > SHORTEST**2
    ]


def _centres(robot: Robot, pair: BodyPair) -> list[Reals]:
    """Where two capsules are nearest to each other, each point (3,), m, in its own link's frame, in the one of the
    joint vectors drawn in which they are farthest apart."""
    apart = _drawn(robot)[int(_least(robot, [pair]).argmax())]
    near = _measured(robot, pair, [(0, 1)], apart)[2][0]
    frames = (link_frames(robot, apart)[body.link] for body in pair)
    return [frame[:3, :3].T @ (point - frame[:3, 3]) for frame, point in zip(frames, near)]


def _measured(
    robot: Robot, bodies: Sequence[Body], pairs: Sequence[tuple[int, int]], q: Reals
) -> tuple[Reals, Flags, Reals]:
    """Distances (k,), m, of pairs of bodies at joint values (n,), whether their cores overlap, and the nearest points
    (k, 2, 3) of these."""
    return some_distances(layout_of(robot, bodies, pairs), q, np.arange(len(pairs)))


def _searched(robot: Robot, pair: BodyPair, boxes: int) -> tuple[int, Reals, float, int]:
    """Of two bodies that overlap in none of the joint vectors drawn: what boxes prove (:func:`search_boxes`), where
    they meet (n,), a bound of their distance (m), and how many boxes were looked at."""
    layout, box, at = _layout(robot, [pair]), np.stack([robot.lower, robot.upper]), np.empty(robot.joints)
    tries = [(0.0, BOXES_OF_SURFACES)]
    if not any(body.tree for body in pair):
        tries = [(GOAL * float(_least(robot, [pair]).min()), boxes // 2), (0.0, boxes)]
    looked = 0
    for goal, most in tries:
        outcome, more, bound = search_boxes(layout, 0, box, (False, goal), most, at)
        looked += more
        if outcome in (FREE, MEETS):
            break
    return outcome, at, bound, looked


def _drawn(robot: Robot) -> Reals:
    """The joint vectors drawn, (TRIED, n), rad or m."""
    return quasi_random_points(robot.lower, robot.upper, TRIED)


def _least(robot: Robot, pairs: Sequence[BodyPair], count: int = TRIED) -> Reals:
    """The smallest distance of pairs (count,), m, in the first of the joint vectors drawn."""
    q, found = _drawn(robot)[:count], np.empty(count)
    measure(_layout(robot, pairs), q, found, np.empty(count, np.int64), np.empty(count, bool))
    return found


def _layout(robot: Robot, pairs: Sequence[BodyPair]) -> Layout:
    bodies = [body for pair in pairs for body in pair]
    return layout_of(robot, bodies, [(2 * k, 2 * k + 1) for k in range(len(pairs))])


def _overlap(robot: Robot, pairs: Sequence[BodyPair]) -> Flags:
    """Who overlaps, (TRIED, K), in the joint vectors drawn."""
    found = np.empty((TRIED, len(pairs)), bool)
    which_overlap(_layout(robot, pairs), _drawn(robot), found)
    return found


INSIDE = 1e-6  # m


@frozen
class BaseContact:
    """A solid that a body of the base touches, by a depth (m; of hulls in solids with faces at least that).

    ``inside``: the body's middle, of a capsule its line, reaches into the solid, so that it is no mere mounting.
    """

    solid: str
    depth: float
    inside: bool


def base_contacts(robot: Robot, scene: Scene | None) -> tuple[BaseContact, ...]:
    """Solids that the base overlaps or rests on, the deepest contact with each; a guessed base only if it is inside.

    Parameters
    ----------
    scene : None for none

    Returns
    -------
    contacts : with depths in m
    """
    base = [body for body in arm_bodies(robot) if body.link == BASE]
    solids = [solid_body(solid) for solid in (scene.solids if scene else ())]
    bodies = [*base, *map(_middle, base), *solids]
    pairs = list(product(range(len(base)), range(2 * len(base), len(bodies))))
    if not pairs:
        return ()
    both = [(first + more, second) for more in (0, len(base)) for first, second in pairs]
    distances, deep, _ = _measured(robot, bodies, both, np.zeros(robot.joints))
    given, found = arm_shapes(robot).given, dict[str, BaseContact]()
    for k, (a, b) in enumerate(pairs):
        distance, touches, middle = distances[k], deep[k], distances[len(pairs) + k]
        inside = bool(deep[len(pairs) + k]) or middle + bodies[a].radius < -INSIDE
        contact = BaseContact(bodies[b].name, 0.0 - float(distance), inside)
        before = found.get(contact.solid)
        if (
            (given or inside)
            and (touches or distance < 0)
            and (before is None or (contact.inside, contact.depth) > (before.inside, before.depth))
        ):
            found[contact.solid] = contact
    return tuple(found.values())


def solids_met(robot: Robot, box: Box, scene: Scene) -> tuple[str, ...]:
    """Solids of a scene that a box would overlap.

    Parameters
    ----------
    box : in the world; taken smaller by ``PENETRATION_TOLERANCE`` on each side

    Returns
    -------
    names : of the solids, each once, in the scene's order
    """
    inner = replace(box, size=np.maximum(np.asarray(box.size) - 2 * PENETRATION_TOLERANCE, PENETRATION_TOLERANCE))
    bodies = [solid_body(each) for each in (inner, *scene.solids)]
    distances, deep, _ = _measured(robot, bodies, [(0, k) for k in range(1, len(bodies))], np.zeros(robot.joints))
    return tuple(body.name for body, touches in zip(bodies[1:], deep | (distances < 0)) if touches)


def _middle(body: Body) -> Body:
    """Of a capsule half its line; a hull at half its size, about the mean of its six ends."""
    at_end = [np.isclose(body.points, end(body.points, axis=0)) for end in (np.min, np.max)]
    ends = [body.points[each].mean(axis=0) for each in np.concatenate(at_end, axis=1).T]
    return replace(body, points=(body.points + np.mean(ends, axis=0)) / 2, tree=None)
