"""The collision-free share of joint space, the places that the tool reaches without collision, and those connected to
home.

Shares are those of random joint vectors, with Wilson's interval [1]_. A place (a cell of space) counts as reached if a
joint vector with the tool point in it was found, and as clear if one of these is free of overlap; that vector proves
it. For a place without one nothing is proven; the number of tries is stated.

Two free joint vectors are connected if the straight move between them is proven free. Places are connected to home if a
chain of such moves leads there (a roadmap [2]_). For other places nothing is proven.

References
----------
.. [1] E. B. Wilson, "Probable inference, the law of succession, and statistical inference", JASA 22, 1927.
.. [2] L. E. Kavraki, P. Svestka, J.-C. Latombe, M. H. Overmars, "Probabilistic roadmaps for path planning in
   high-dimensional configuration spaces", IEEE Trans. Robotics and Automation 12, 1996.
"""

from __future__ import annotations

import numpy as np
import scipy
from scipy.cluster.hierarchy import DisjointSet

from er3a.by_value import by_identity, frozen
from er3a.collision.bodies import Bodies
from er3a.collision.distances import FREE, free_between
from er3a.kinematics.batch import inverse_batch
from er3a.kinematics.forward import forward
from er3a.kinematics.wrist_partitioned import wrist_partition_missing
from er3a.numerics.arrays import Flags, Integers, Reals

Z_95 = 1.959963984540054  # half-width of the 95 % interval of a standard normal number
POSES_A_ROUND = 8  # tried in a place in one round
MIN_EXTENT_M = 1e-4  # of what a tool point that stays in place is reported to reach
DEPTH = 1e-3  # m; a move in which the arm may overlap by less than this, unproven, joins nothing
LOOKS = 300  # arms looked at to prove one move


@frozen
class Share:
    """A share of random joint vectors, with its 95 % interval."""

    count: int
    of: int

    @property
    def value(self) -> float:
        """The share that was counted, 0 to 1."""
        return self.count / self.of

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share, 0 to 1, after Wilson [1]_."""
        n, p = self.of, self.value
        middle = (p + Z_95**2 / (2 * n)) / (1 + Z_95**2 / n)
        half = Z_95 / (1 + Z_95**2 / n) * float(np.sqrt(p * (1 - p) / n + Z_95**2 / (4 * n**2)))
        return max(0.0, middle - half), min(1.0, middle + half)


@by_identity
class JointSpace:
    """Counts of random joint vectors.

    Attributes
    ----------
    q : (N, n), rad; free : (N,)
    of_itself, of_scene, whole : free of self-collision, of the scene, and of both
    overlaps : (N, P), which pairs of bodies overlap
    """

    q: Reals
    free: Flags
    of_itself: Share
    of_scene: Share
    whole: Share
    overlaps: Flags

    def count(self, pairs: list[int]) -> int:
        """Number of joint vectors in which any of some pairs overlaps.

        Parameters
        ----------
        pairs : their numbers, columns of ``overlaps``

        Returns
        -------
        count : 0 to N
        """
        return int(self.overlaps[:, pairs].any(axis=1).sum())


@by_identity
class ClearPlaces:
    """Cells of space that the tool point was brought to.

    Attributes
    ----------
    corner : (3,), m, of the grid; cell : m, edge
    index : (M, 3) int, cells; tries : (M,), arms tried there; clear : (M,)
    witness : (M, n), rad, an arm free of overlap with its tool there, NaN where none was found
    joined : (M,), whether the witness is joined to home
    """

    corner: Reals
    cell: float
    index: Integers
    tries: Integers
    clear: Flags
    witness: Reals
    joined: Flags

    @property
    def middles(self) -> Reals:
        """Middles (M, 3), m, of the cells."""
        return self.corner + (self.index + 0.5) * self.cell


def sample_joint_space(bodies: Bodies, samples: int, random: np.random.Generator) -> JointSpace:
    """Try random joint vectors, uniform within the limits.

    Parameters
    ----------
    bodies : of the arm and a scene
    samples : N, how many
    random : generator that draws them

    Returns
    -------
    space : the vectors (N, n), rad or m, and which pairs overlap in them
    """
    robot = bodies.robot
    q = random.uniform(robot.lower, robot.upper, (samples, robot.joints))
    own = bodies.second >= 0
    hit = bodies.overlaps(q)
    itself, scene = (~np.asarray(hit[:, part].any(axis=1)) for part in (own, ~own))
    free = itself & scene
    of_itself, of_scene, whole = (Share(int(flags.sum()), samples) for flags in (itself, scene, free))
    return JointSpace(q, free, of_itself, of_scene, whole, hit)


def find_places(
    bodies: Bodies, space: JointSpace, across: int, rounds: int, random: np.random.Generator
) -> ClearPlaces:
    """Cells that the samples reach, and whether an arm free of overlap reaches each.

    Parameters
    ----------
    across : cells along the longest side of what the samples reach
    rounds : how often POSES_A_ROUND further poses are tried in a cell without a clear arm; all branches of each

    Returns
    -------
    places : M cells, in m; none is joined to home yet
    """
    robot = bodies.robot
    T = forward(robot, space.q)
    points = T[:, :3, 3]
    corner = points.min(axis=0)
    cell = max(float(np.ptp(points, axis=0).max()), MIN_EXTENT_M) / across * (1 + 1e-9)
    index, where, tries = np.unique(
        ((points - corner) / cell).astype(np.int64), axis=0, return_inverse=True, return_counts=True
    )
    where = where.ravel()
    witness = np.full((len(index), robot.joints), np.nan)
    free = np.flatnonzero(space.free)[::-1]
    witness[where[free]] = space.q[free]  # the first one of each cell stays
    tries = tries.astype(np.int64)
    if wrist_partition_missing(robot) is None:
        samples = [np.flatnonzero(where == cell) for cell in np.flatnonzero(np.isnan(witness[:, 0]))]
        for _ in range(rounds):
            samples = [rows for rows in samples if np.isnan(witness[where[rows[0]], 0])]
            if samples:
                rows = np.concatenate([random.choice(own, POSES_A_ROUND) for own in samples])
                _try_poses(bodies, T, rows, where, (witness, tries), random)
    clear = np.isfinite(witness[:, 0])
    return ClearPlaces(corner, cell, index, tries, clear, witness, np.zeros(len(index), bool))


def _try_poses(
    bodies: Bodies,
    T: Reals,
    rows: Integers,
    where: Integers,
    found: tuple[Reals, Integers],
    random: np.random.Generator,
) -> None:
    """Solve the points of some samples with the orientations of others, and keep what is free of overlap."""
    witness, tries = found
    poses = T[rows].copy()
    half = len(rows) // 2
    poses[:half, :3, :3] = T[random.integers(0, len(T), half), :3, :3]
    solved = inverse_batch(bodies.robot, poses)
    pose, slot = np.nonzero(solved.within_limits)
    q = solved.q[pose, slot]
    cells = where[rows][pose]
    np.add.at(tries, cells, 1)
    free = bodies.free(q)
    witness[cells[free][::-1]] = q[free][::-1]


def joined_to_home(bodies: Bodies, places: ClearPlaces, home: Reals, more: Reals, neighbours: int) -> Flags:
    """Which clear places can be joined to home by moves that are proven free [2]_.

    Parameters
    ----------
    home : (n,), rad or m, an arm free of overlap
    more : (k, n), rad or m, arms free of overlap through which moves may go, too, such as those at targets
    neighbours : moves to how many of the nearest arms are tried from each

    Returns
    -------
    joined : (M,) bool; none if only home itself is joined; nothing is proven of the others
    """
    clear = np.flatnonzero(places.clear)
    q = np.concatenate([home[None], places.witness[clear], more])
    reach = np.maximum(bodies.robot.upper - bodies.robot.lower, 1e-9)
    away, near = scipy.spatial.cKDTree(q / reach).query(q / reach, k=min(neighbours + 1, len(q)))
    first = np.repeat(np.arange(len(q)), near.shape[1] - 1)
    second, length = near[:, 1:].ravel(), away[:, 1:].ravel()
    order = np.lexsort((second, first, length))
    joint = DisjointSet(range(len(q)))
    for edge in order:
        a, b = int(first[edge]), int(second[edge])
        if not joint.connected(a, b) and free_between(bodies.layout, q[a], q[b], DEPTH, LOOKS)[0] == FREE:
            joint.merge(a, b)
    joined = np.zeros(len(places.clear), bool)
    moves = [node for node in joint.subset(0) if (q[node] != home).any()]
    if moves:
        joined[clear] = [joint.connected(0, node) for node in range(1, len(clear) + 1)]
    return joined
