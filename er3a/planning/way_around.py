"""Planned motions around obstacles: a joint motion between two joint vectors that is proven clear, or none.

RRT-Connect [1]_ of OMPL [2]_ connects the ends by straight moves in joint space. A move is tried by conservative
advancement: if the arm has clearance d, no body can be touched before the joints' turns, each times the longest lever
that it swings, add up to d. Random short cuts follow, then corners are rounded as far as they stay clear, and the
rounded path is timed. The result is proven on the timed curve itself: its smallest clearance, found to within a depth
(:mod:`er3a.collision.along`), exceeds that depth, so that nothing touches at any time.

The search ends after a number of rounds, not of seconds, and draws from its own seed alone: equal tasks, equal motions.

References
----------
.. [1] J. J. Kuffner, S. M. LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000.
.. [2] I. A. Sucan, M. Moll, L. E. Kavraki, "The Open Motion Planning Library", IEEE Robotics and Automation Magazine
   19(4), 2012.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from er3a.by_value import by_identity
from er3a.collision.along import ClearanceAlong, clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.distances import keeps_margin
from er3a.collision.shapes import link_frames
from er3a.errors import PathError
from er3a.finding import Finding, fact, is_one
from er3a.numerics.arrays import Reals
from er3a.planning.motion_faults import over_limits
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.profiles import FromRestToRest
from er3a.planning.sequences import JointSequence, joint_sequence
from er3a.planning.timing import JointLimits, TimingError, fastest, joined, standing
from er3a.robots.joint_limits import limits_exceeded
from er3a.robots.robot import Robot

ROUNDS = 4000
SHORT_CUTS = 50  # random ones that are tried
LONGEST_MOVE = 1.5  # rad of all joints together, by which a tree grows at a time
SHORTEST_STEP = 2e-3  # rad of the joint that turns most, by which a move advances beside an obstacle
MARGINS = (0.008, 0.003, 0.0)  # m beyond the tolerance, tried in this order
FROM_LIMITS, FROM_ENDS = np.radians(2.0), 0.002  # rad, m of those that slide: drawn joints keep from their limits
ROUNDINGS = (1.0, 0.5, 0.2, 0.0)  # of half of the shorter side
NODES = 240
SHOWN = 101  # times at which the clearance of a way is returned
STILL = 1e-9  # rad
SPARE = 0.25  # of the clearance at the ends, to within which that of the motion is found
STREAM = 17
MAX_PAIRS = 4  # of start and end, the nearest: each failed search takes all its rounds


@by_identity
class WayAround:
    """A motion that keeps clear.

    Attributes
    ----------
    corners : (k, n), rad, start and end among them
    motion : rounded and timed
    along : its clearance, proven
    """

    corners: Reals
    motion: PiecewiseMotion
    along: ClearanceAlong


@by_identity
class PlanningTask:
    """What all motions of a robot have in common.

    Attributes
    ----------
    tolerance : m, to within which clearances are found, or better where the ends are nearer to something
    """

    robot: Robot
    bodies: Bodies
    tolerance: float
    limits: JointLimits
    seed: int
    rounds: int = ROUNDS


def way_around(task: PlanningTask, start: Reals, end: Reals) -> WayAround | Finding:
    """Find a motion between two joint vectors that is proven clear.

    Parameters
    ----------
    start, end : (n,), rad or m

    Returns
    -------
    found : the timed motion with its proven clearance, or why there is none

    References
    ----------
    RRT-Connect [1]_ as OMPL has it [2]_.
    """
    clear = _clear_at_ends(task, start, end)
    if not isinstance(clear, float):
        return clear
    depth = min(task.tolerance, SPARE * clear)
    if np.abs(end - start).max() < STILL:
        return _proven(task, np.stack([start, end]), standing(start, 1.0), depth) or fact("none_found", rounds=0)
    rounds = 0
    for attempt, margin in enumerate(MARGINS):
        moves = _Moves(task.robot, task.bodies, min(task.tolerance + margin, 0.5 * clear))
        if moves.free(start, end):
            corners: Reals | None = np.stack([start, end])
        else:
            corners = _tree(task, moves, start, end, attempt)
            rounds += task.rounds
        if corners is None:
            continue
        if isinstance(corners, Finding):
            return corners
        corners = _shortened(moves, corners, np.random.default_rng([task.seed, STREAM, attempt]))
        for motion in _timed(task, corners):
            if isinstance(motion, Finding):
                return motion
            if found := _proven(task, corners, motion, depth):
                return found
    return fact("none_found", rounds=rounds)


def _clear_at_ends(task: PlanningTask, start: Reals, end: Reals) -> float | Finding:
    """The smaller clearance (m) of the two ends (n,); which of them can't be one, and why."""
    ends: tuple[tuple[Literal["start", "end"], Reals], ...] = (("start", start), ("end", end))
    for name, q in ends:
        if outside := limits_exceeded(task.robot, q):
            return fact("no_end", end=name, why=outside)
    clear, pairs = task.bodies.min_distance(np.stack([start, end]))
    for (name, _), distance, pair in zip(ends, clear, pairs):
        if distance <= 0:
            return fact(
                "no_end",
                end=name,
                why=fact("pair_overlaps", pair=task.bodies.pairs[pair], depth_mm=-float(distance) * 1000),
            )
    return float(clear.min())


def way_between(task: PlanningTask, starts: Reals, ends: Reals) -> WayAround | Finding:
    """The motion between the nearest start and end for which one is found.

    Parameters
    ----------
    starts, ends : (k, n) and (m, n), rad or m: joint solutions of the two poses

    Returns
    -------
    found : of the ``MAX_PAIRS`` nearest pairs the first with a motion; else why the last one has none
    """
    pairs = sorted(
        (float(np.abs(end - start).max()), i, j) for i, start in enumerate(starts) for j, end in enumerate(ends)
    )
    if not len(starts) or not len(ends):
        return fact("no_end", end="end" if len(starts) else "start", why=fact("none_within_limits"))
    found: WayAround | Finding = fact("none_found", rounds=0)
    for _, i, j in pairs[:MAX_PAIRS]:
        found = way_around(task, starts[i], ends[j])
        if isinstance(found, WayAround):
            break
    return found


class _Moves:
    """Straight moves in joint space, tried by conservative advancement."""

    def __init__(self, robot: Robot, bodies: Bodies, margin: float) -> None:
        self.bodies, self.margin = bodies, margin
        self.coupling = robot.joint_to_row
        T = link_frames(robot, np.zeros(len(robot.lower)))
        origins = T[[capsule.link for capsule in bodies.capsules], None, :3, 3]
        reach = np.linalg.norm(bodies.ends(np.zeros(len(robot.lower))) - origins, axis=-1).max()
        lengths = np.linalg.norm(np.diff(T[1:, :3, 3], axis=0), axis=1)
        self.levers = reach + np.append(np.cumsum(lengths[::-1])[::-1], 0.0)

    def free(self, a: Reals, b: Reals) -> bool:
        """Whether the straight joint move between two arms keeps the margin, by conservative advancement.

        Parameters
        ----------
        a, b : (n,), rad or m

        Returns
        -------
        free : steps are no shorter than ``SHORTEST_STEP``, so that a thin violation may pass; the final proof sees it
        """
        turn, of_rows = np.abs(b - a), np.abs(self.coupling @ (b - a))
        least = SHORTEST_STEP / max(float(turn.max()), SHORTEST_STEP)
        return bool(keeps_margin(self.bodies.layout, a, b, self.margin, float(self.levers @ of_rows), least))


def _tree(task: PlanningTask, moves: _Moves, start: Reals, end: Reals, attempt: int) -> Any:
    """Corners (k, n) of a path of free moves; None if none was found."""
    try:
        from ompl import base, geometric, util
    except ImportError:
        return fact("library_missing", name="OMPL")
    util.noOutputHandler()
    util.RNG.setSeed(1 + (task.seed * len(MARGINS) + attempt) % (2**31 - 1))
    n, robot = len(start), task.robot
    space, bounds = base.RealVectorStateSpace(n), base.RealVectorBounds(n)
    for j in range(n):
        both = min(start[j], end[j]), max(start[j], end[j])
        inner = min(FROM_ENDS if robot.slides[j] else FROM_LIMITS, (robot.upper[j] - robot.lower[j]) / 4)
        bounds.setLow(j, float(min(both[0], robot.lower[j] + inner)))
        bounds.setHigh(j, float(max(both[1], robot.upper[j] - inner)))
    space.setBounds(bounds)
    info = base.SpaceInformation(space)

    def joints(state: Any) -> Reals:
        return np.array([state[j] for j in range(n)])

    class Advancement(base.MotionValidator):  # type: ignore[misc]
        def checkMotion(self, first: Any, second: Any) -> bool:
            """Whether the straight move between two states of OMPL keeps the margin."""
            return moves.free(joints(first), joints(second))

    info.setStateValidityChecker(lambda state: moves.free(joints(state), joints(state)))
    validator = Advancement(info)
    info.setMotionValidator(validator)
    info.setup()
    problem = base.ProblemDefinition(info)
    states = [space.allocState(), space.allocState()]
    for state, q in zip(states, (start, end)):
        for j in range(n):
            state[j] = float(q[j])
    problem.setStartAndGoalStates(*states)
    planner = geometric.RRTConnect(info)
    planner.setRange(LONGEST_MOVE)
    planner.setProblemDefinition(problem)
    planner.setup()
    rounds = iter(range(task.rounds))
    planner.solve(base.PlannerTerminationCondition(lambda: next(rounds, None) is None))
    found = None
    if problem.hasExactSolution():
        path = problem.getSolutionPath()
        found = np.array([joints(path.getState(k)) for k in range(path.getStateCount())])
        found[[0, -1]] = start, end
    del planner, problem, info, validator, space, states
    gc.collect()
    return found


def _shortened(moves: _Moves, corners: Reals, random: np.random.Generator) -> Reals:
    """Corners with random short cuts taken, and those left out that straight moves can do without."""
    for _ in range(SHORT_CUTS):
        if len(corners) < 3:
            break
        lengths = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(corners, axis=0)).max(axis=1))])
        first, last = np.sort(random.uniform(0.0, lengths[-1], 2))
        i, k = (int(np.searchsorted(lengths, at, side="right")) - 1 for at in (first, last))
        k = min(k, len(corners) - 2)
        if i >= k:
            continue
        a, b = (_between(corners, lengths, at) for at in (first, last))
        if moves.free(a, b):
            corners = np.concatenate([corners[: i + 1], [a, b], corners[k + 1 :]])
    kept = [0]
    while kept[-1] < len(corners) - 1:
        ahead = range(len(corners) - 1, kept[-1], -1)
        kept.append(next(j for j in ahead if j == kept[-1] + 1 or moves.free(corners[kept[-1]], corners[j])))
    shortened = corners[kept]
    steps = np.abs(np.diff(shortened, axis=0)).max(axis=1)
    kept_apart: Reals = shortened[np.concatenate([[True], steps > STILL])]
    return kept_apart


def _between(corners: Reals, lengths: Reals, at: float) -> Reals:
    return np.array([np.interp(at, lengths, column) for column in corners.T])


def _timed(task: PlanningTask, corners: Reals) -> Iterator[PiecewiseMotion | Finding]:
    """The path with corners rounded less and less, timed under the limits."""
    sides = np.abs(np.diff(corners, axis=0)).max(axis=1)
    for share in ROUNDINGS if len(corners) > 2 else (0.0,):
        blends = share * np.minimum(sides[:-1], sides[1:]) / 2
        try:
            route = joint_sequence(corners, blends, 1.0)
            yield _with_jerk(route, task.limits) if task.limits.jerk is not None else _quickest(route, task.limits)
        except PathError:
            continue
        except TimingError as error:
            if is_one(error.finding, "library_missing"):
                yield error.finding


def _quickest(route: JointSequence, limits: JointLimits) -> PiecewiseMotion:
    """As fast as speeds and accelerations allow, from halt to halt."""
    law = route.law
    assert isinstance(law, FromRestToRest)
    parts = []
    for a, b in pairwise(law.progress.tolist()):
        count = max(9, round(NODES * (b - a)))
        parts.append(fastest(route.curve(np.linspace(a, b, count))[0], limits))
    return joined(parts)


def _with_jerk(route: JointSequence, limits: JointLimits) -> PiecewiseMotion:
    """On quintics from halt to halt, in the time in which speeds, accelerations and jerks keep their limits."""
    curve = route.polynomials()
    assert limits.jerk is not None
    speed, acceleration = limits.ratios(curve)
    jerk = float((curve.max_abs(curve.jerk) / limits.jerk).max())
    return curve.scaled(max(speed, np.sqrt(acceleration), np.cbrt(jerk)))


def _proven(task: PlanningTask, corners: Reals, motion: PiecewiseMotion, depth: float) -> WayAround | None:
    """The motion with its clearance, if it touches nothing and keeps its limits."""
    if over_limits(task.robot, motion, task.limits.rates):
        return None
    grid = np.linspace(0.0, motion.duration, SHOWN)
    along = clearance_along(task.bodies, motion.joints, motion.rate_bounds, grid, grid, depth)
    nearest = np.inf if along.closest < 0 else float(along.distance[along.closest])
    return WayAround(corners, motion, along) if nearest > depth else None
