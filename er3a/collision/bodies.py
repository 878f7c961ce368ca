"""The pairs of bodies that can collide: of an arm with itself (:mod:`er3a.collision.matrix`) and with a scene's solids.

The base is not paired with the scene: it does not move, and it is mounted on something.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from itertools import product

import numpy as np

from er3a.collision.convex import TOUCHING, cylinder_points, overlap_depth
from er3a.collision.distances import (
    CYLINDER,
    FREE,
    HALF_SPACE,
    Layout,
    measure,
    search_boxes,
    some_distances,
    which_overlap,
)
from er3a.collision.matrix import BOXES, MatrixRow, collision_matrix, matrix_of
from er3a.collision.pairs import BASE, Pair, link_label
from er3a.collision.scene import Scene
from er3a.collision.shapes import (
    Body,
    arm_bodies,
    arm_shapes,
    carried_bodies,
    depth_inside,
    layout_of,
    link_frames,
    solid_body,
)
from er3a.errors import Er3aError
from er3a.finding import fact
from er3a.numerics.arrays import Flags, Integers, Reals
from er3a.robots.joint_limits import but_for_turns
from er3a.robots.robot import Robot


class Bodies:
    """Pairs that can meet, numbered: first those of the arm with itself, then those with solids.

    Attributes
    ----------
    scene : as given; None for none
    all : all bodies, those that move first, as the layout has them
    capsules : all bodies that move; each has its ``link``
    first : (P,) int, number of the pair's body; of two links the one nearer to the base
    second : (P,) int, number of the other link's body, -1 for a solid
    pairs : P, what meets what
    matrix : what was found of each pair of links
    in_error : pairs whose shapes overlap where no arm's can (:mod:`er3a.collision.matrix`), so that they are left out
    coarse : pairs that are left out because their shapes are too coarse, or too large, there
    unexamined : pairs that shapes which a file gives leave unchecked; what er3a guesses is an assumption instead
    joined : (P,), whether a joint joins the two, so that only overlap of what is left of them means anything
    layout : the same as arrays, solids among the bodies
    """

    def __init__(self, robot: Robot, scene: Scene | None, without: Collection[Pair] = ()) -> None:
        if not isinstance(scene, Scene | None):
            raise Er3aError(f"the scene is a {type(scene).__name__}; expected what er3a.load_scene returns")
        self.robot, self.scene = robot, scene
        own, carried = arm_bodies(robot), carried_bodies(robot, scene)
        matrix = collision_matrix(robot)
        rules = scene.pair_rules if scene else ()
        more = matrix_of(robot, list(product(own, carried)), rules)
        self.matrix: tuple[MatrixRow, ...] = matrix.rows + more.rows
        moving = [body for body in (*own, *carried) if body.link != BASE]
        solids = [solid_body(solid) for solid in (scene.solids if scene else ())]
        allowed = {frozenset((rule.first, rule.second)) for rule in rules if rule.rule == "allow"}
        around = [(b, s) for s in solids for b in moving if frozenset((b.name, s.name)) not in allowed]
        found = zip(matrix.watched + more.watched, matrix.joined + more.joined)
        kept = [(pair, held) for pair, held in found if frozenset(body.name for body in pair) not in allowed]
        kept = [(pair, held) for pair, held in kept if named_pair(*pair) not in without]
        around = [pair for pair in around if named_pair(*pair) not in without]
        met = (*(pair for pair, _ in kept), *around)
        numbers = {link_label(k): k for k in range(robot.rows + 1)}
        self.in_error, self.coarse = (
            tuple[Pair, ...](
                fact("link_pair", first=numbers[row.first], second=numbers[row.second])
                if row.second in numbers
                else fact("carried_and_link", carried=row.second, link=numbers[row.first])
                for row in self.matrix
                if row.state == state and frozenset((row.first, row.second)) not in allowed
            )
            for state in ("overlaps", "coarse")
        )
        self.unexamined = self.in_error + (self.coarse if arm_shapes(robot).given else ())
        links = (body for pair, _ in kept for body in pair)
        number = {body: k for k, body in enumerate(dict.fromkeys((*links, *moving, *solids)))}
        self.all, count = tuple(number), len(number) - len(solids)
        self.capsules = self.all[:count]
        joined = [held for _, held in kept] + [False] * len(around)
        self.layout = layout_of(robot, self.all, [(number[a], number[b]) for a, b in met], joined)
        self.joined = self.layout.joined
        self.first = self.layout.first
        self.second = np.where(self.layout.second < count, self.layout.second, -1)
        self.pairs: tuple[Pair, ...] = tuple(named_pair(a, b) for a, b in met)
        most = max((len(body.points) for body in self.capsules), default=1)
        rows = [np.resize(np.arange(len(body.points)), most) for body in self.capsules]
        self._padded = np.array([body.points[row] for body, row in zip(self.capsules, rows)]).reshape(-1, most, 3)

    def ends(self, q: Reals) -> Reals:
        """Points whose hulls are the cores of the moving bodies; of a capsule the ends of its line.

        A body moves, as a set, by no more than its points do; those of a body that has fewer than others come more than
        once.

        Parameters
        ----------
        q : (..., n), rad or m

        Returns
        -------
        points : (..., bodies, k, 3), m, world frame
        """
        T = link_frames(self.robot, q)[..., [body.link for body in self.capsules], :, :]
        return self._padded @ T[..., :3, :3].swapaxes(-1, -2) + T[..., None, :3, 3]

    def distances(self, q: Reals, pairs: Integers) -> Reals:
        """Distances of some pairs in one arm pose.

        Parameters
        ----------
        q : (n,), rad or m
        pairs : (k,), numbers of pairs

        Returns
        -------
        distances : (k,), m, negative by the depth of overlap
        """
        return self.nearest(q, pairs)[0]

    def counted(self, distances: Reals) -> Reals:
        """Distances as they are counted: infinite for joined pairs that don't overlap.

        Parameters
        ----------
        distances : (..., P), m

        Returns
        -------
        distances : (..., P), m
        """
        return np.where(self.joined & (distances > 0), np.inf, distances)

    def nearest(self, q: Reals, pairs: Integers) -> tuple[Reals, Reals]:
        """Distances of some pairs in one arm pose, and where they are.

        Parameters
        ----------
        q : (n,), rad or m
        pairs : (k,), numbers of pairs

        Returns
        -------
        distances : (k,), m, negative by the depth of overlap
        points : (k, 2, 3), m, world frame, where the bodies' cores are nearest
        """
        found, deep, near = some_distances(self.layout, np.ascontiguousarray(q, float), np.asarray(pairs, np.int64))
        for row in np.flatnonzero(deep):
            found[row] -= self._depth(q, int(pairs[row]))
        return found, near

    def min_distance(self, q: Reals) -> tuple[Reals, Integers]:
        """Smallest distance over all pairs, for many arm poses.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        distance : (N,), m, negative by the depth of overlap; joined pairs count only where they overlap
        pair : (N,), number of the pair; -1 where nothing can meet
        """
        q = np.ascontiguousarray(q, float)
        smallest, pair, deep = np.empty(len(q)), np.empty(len(q), np.int64), np.zeros(len(q), bool)
        measure(self.layout, q, smallest, pair, deep)
        rows = np.flatnonzero(deep)
        for row, overlap in zip(rows, self.overlaps(q[rows])):
            pairs = np.flatnonzero(overlap)
            distances = self.distances(q[row], pairs)
            pair[row], smallest[row] = pairs[distances.argmin()], distances.min()
        return smallest, pair

    def min_distance_of_turns(self, q: Reals) -> tuple[Reals, Integers]:
        """As :meth:`min_distance`, for arm poses many of which are others but for whole turns: those are measured once.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        distance, pair : (N,), m, and numbers of pairs
        """
        if self.robot.coupling is not None:
            return self.min_distance(q)
        _, first, inverse = np.unique(but_for_turns(self.robot, q), axis=0, return_index=True, return_inverse=True)
        smallest, pair = self.min_distance(q[first])
        return smallest[inverse.reshape(-1)], pair[inverse.reshape(-1)]

    def overlaps(self, q: Reals) -> Flags:
        """Which pairs overlap, for many arm poses.

        Parameters
        ----------
        q : (N, n), rad or m

        Returns
        -------
        overlaps : (N, P) bool
        """
        q = np.ascontiguousarray(q, float)
        found = np.empty((len(q), len(self.pairs)), bool)
        which_overlap(self.layout, q, found)
        return found

    def free(self, q: Reals, margin: float = 0.0) -> Flags:
        """Which arm poses are free of overlap, and keep a margin.

        Parameters
        ----------
        q : (N, n), rad or m
        margin : m, between all pairs that no joint holds together

        Returns
        -------
        free : (N,) bool
        """
        q = np.ascontiguousarray(q, float)
        clear = np.ones(len(q), bool)
        for layout in (self.layout,) if margin <= 0 else _apart_by(self, margin):
            found = np.zeros((int(clear.sum()), 1), bool)
            which_overlap(layout, q[clear], found)
            clear[clear] = ~found[:, 0]
        return clear

    def surface_points(self, q: Reals, pair: int) -> Reals:
        """The points on the surfaces of a pair's bodies that are nearest.

        Parameters
        ----------
        q : (n,), rad or m
        pair : number of the pair

        Returns
        -------
        points : (2, 3), m, world frame; the cores' nearest points moved towards each other by the bodies' radii
        """
        near = self.nearest(q, np.array([pair]))[1][0]
        along = near[1] - near[0]
        length = float(np.linalg.norm(along))
        unit = along / length if length > 0 else np.zeros(3)
        sizes = [self.all[b].radius for b in (self.layout.first[pair], self.layout.second[pair])]
        return np.array([near[0] + sizes[0] * unit, near[1] - sizes[1] * unit])

    def always_overlaps(self, pair: int) -> bool:
        """Whether a pair overlaps in all arm poses within the limits, proven on boxes of joint vectors.

        Parameters
        ----------
        pair : number of the pair

        Returns
        -------
        always : False too where ``BOXES`` boxes did not decide it
        """
        box = np.stack([self.robot.lower, self.robot.upper])
        return search_boxes(self.layout, pair, box, (True, 0.0), BOXES, np.empty(box.shape[1]))[0] == FREE

    def _depth(self, q: Reals, pair: int) -> float:
        """How deep two bodies whose cores overlap do, m; of surfaces at least that."""
        bodies = [self.all[b] for b in (self.layout.first[pair], self.layout.second[pair])]
        T = np.concatenate([link_frames(self.robot, q), np.eye(4)[None]])
        if any(body.tree for body in bodies):
            found = [depth_inside(a, b, np.linalg.inv(T[a.link]) @ T[b.link]) for a, b in (bodies, bodies[::-1])]
            return max(TOUCHING, *found)  # what crosses overlaps, though no corner that was looked at is inside
        return overlap_depth(*(_core_points(body, T[body.link]) for body in bodies))


def _core_points(body: Body, T: Reals) -> Reals:
    """Points (n, 3), m, whose hull is a body's core, placed by T (4, 4)."""
    points: Reals = body.points @ T[:3, :3].T + T[:3, 3]
    return cylinder_points(points, body.disc) if body.kind == CYLINDER else points


def named_pair(first: Body, second: Body) -> Pair:
    """What the results call two bodies.

    Parameters
    ----------
    first : a body of the arm, or one that the tool carries
    second : the outer one, or a solid of the scene

    Returns
    -------
    pair : by link numbers from 0, and names of other bodies
    """
    is_link = [body.name == link_label(body.link) for body in (first, second)]
    if second.link < 0:
        return (
            fact("link_and_solid", link=first.link, solid=second.name)
            if is_link[0]
            else fact("carried_and_solid", carried=first.name, solid=second.name)
        )
    return (
        fact("link_pair", first=first.link, second=second.link)
        if is_link[1]
        else fact("carried_and_link", carried=second.name, link=first.link)
    )


@lru_cache(maxsize=4)
def _apart_by(bodies: Bodies, margin: float) -> tuple[Layout, Layout]:
    """The pairs that no joint holds together, of bodies larger by half a margin (m) all around, and the other pairs."""
    layout, by = bodies.layout, margin / 2
    solid, apart = layout.kind != HALF_SPACE, ~layout.joined
    points = layout.points.copy()
    points[layout.start[:-1][~solid] + 1, 0] += by
    grown = layout._replace(points=points, radius=layout.radius + by * solid, reach=layout.reach + by)
    return _of_pairs(grown, apart), _of_pairs(layout, layout.joined)


def _of_pairs(layout: Layout, kept: Flags) -> Layout:
    """A layout with some of its pairs."""
    of_pairs = ("first", "second", "joined", "inner")
    return layout._replace(**{name: getattr(layout, name)[kept] for name in of_pairs})
