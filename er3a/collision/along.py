"""Clearance along a motion, bounded between the points at which it is measured.

The distance of two bodies changes by no more than they move against each other. If they are d0 apart at one time and d1
at another, and move by M in between, they stay (d0 + d1 - M) / 2 apart [1]_: an interval in which that is positive for
every pair is free as a whole. Overlap counts as negative distance (the depth), for which the same holds: if the depths
at both ends of an interval add up to more than M, the pair overlaps in the whole interval. Other intervals are halved
until M is twice the requested ``depth``. So no overlap deeper than that is missed, however small or thin the obstacle,
and the smallest clearance is found to within it.

M is the longer path of a capsule's two ends (its other points move no farther), in space for a solid, in the frame of
the other link for two links. The path is bounded on a grid of the motion so fine that no end moves by more than
twice the depth from point to point: a chord over a time h, plus A h^2 / 3, where A bounds the end's acceleration.
With levers of at most L, revolute rows with speeds v and accelerations a, and prismatic rows with w and b,
``A = L (sum |a| + (sum |v|)^2) + sum |b| + 2 sum |v| sum |w|``: these are bounds over the whole interval. The caller
gives them for the joints; a coupling converts them to rows. If the motion has no such bounds (at singular poses of a
tool path, through which nothing is proven), the bulge of the parabola through three points replaces A h^2 / 3.

References
----------
.. [1] F. Schwarzer, M. Saha, J.-C. Latombe, "Adaptive dynamic collision checking for single and multiple articulated
   robots in complex environments", IEEE Trans. Robotics 21, 2005.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from itertools import pairwise

import numpy as np
import scipy

from er3a.by_value import Displayed, by_identity, frozen
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import Pair
from er3a.collision.scene import Scene
from er3a.collision.shapes import link_frames
from er3a.numerics.arrays import Integers, Reals, runs
from er3a.robots.robot import Robot

SHORTEST = 1e-9  # share of the duration; motion that is wide over less is a jump
LOCATED = 1e-10  # share of the duration
DEEPEST = 1e-6  # share of the duration, within which an overlap is deepest: depths are level there
LEVEL = 1e-9  # m
CHUNK = 20_000  # points whose ends are held in memory at a time

Joints = Callable[[Reals], Reals]
RateBounds = Callable[[Reals, Reals], tuple[Reals, Reals]]


@frozen
class Touch:
    """Two bodies that overlap.

    Attributes
    ----------
    start : s, when they first touch in a stretch
    depth, at : of their deepest overlap measured, m, and its time, s
    """

    pair: Pair
    start: float
    depth: float
    at: float


@frozen
class Contact:
    """A stretch of overlap.

    Attributes
    ----------
    start, end : s
    touches : what overlaps, the first to touch first
    depth, at : of the deepest overlap measured, m, and its time, s
    """

    start: float
    end: float
    touches: tuple[Touch, ...]
    depth: float
    at: float

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """What overlaps, the first to touch first."""
        return tuple(touch.pair for touch in self.touches)


@by_identity
class ClearanceAlong:
    """Clearance along a motion.

    Attributes
    ----------
    t : (K,), s, rising; distance : (K,), m, negative by the depth of overlap, NaN where the motion is unknown
    pair : K, what is nearest to what; None where that is unknown or nothing can meet
    number : (K,), which of the bodies' pairs that is; -1 where there is none
    contacts : stretches of overlap, in order of time
    measured : number of arm poses at which distances were measured
    """

    t: Reals
    distance: Reals
    pair: tuple[Pair | None, ...]
    number: Integers
    contacts: tuple[Contact, ...]
    measured: int

    @property
    def closest(self) -> int:
        """Index of the smallest clearance; -1 if none is known."""
        return -1 if np.isnan(self.distance).all() else int(np.nanargmin(self.distance))


class _Motion:
    """Distances along a motion, remembered per time."""

    def __init__(self, bodies: Bodies, joints: Joints, rates: RateBounds) -> None:
        self.bodies, self.joints, self.rates = bodies, joints, rates
        self.known: dict[float, Reals] = {}
        self.every = np.arange(len(bodies.pairs))
        own = np.flatnonzero(bodies.second >= 0)
        solid = np.flatnonzero(bodies.second < 0)
        moving, track = np.unique(bodies.first[solid], return_inverse=True)
        self._own, self._moving = own, moving
        self.track = np.empty(len(bodies.pairs), dtype=int)  # of a pair: which tracked capsule's path counts
        self.track[own], self.track[solid] = np.arange(len(own)), len(own) + track

    @cached_property
    def lever(self) -> float:
        """How far a point of a body can be from the axis of a joint that moves it, m, sliding rows at their limits."""
        robot = self.bodies.robot
        T = link_frames(robot, np.zeros(robot.joints))
        links = np.linalg.norm(np.diff(T[:, :3, 3], axis=0), axis=1).sum()
        slides = self.of_rows(np.maximum(np.abs(robot.lower), np.abs(robot.upper)))[robot.sliding].sum()
        origins = T[[capsule.link for capsule in self.bodies.capsules], None, :3, 3]
        own = np.linalg.norm(self.bodies.ends(np.zeros(robot.joints)) - origins, axis=-1).max()
        return float(links + slides + own)

    def of_rows(self, sizes: Reals) -> Reals:
        """What rows of the table move by at most, by the coupling of the joints.

        Parameters
        ----------
        sizes : (..., n), rad or m, sizes of the joints' moves

        Returns
        -------
        sizes : (..., m), of the rows
        """
        coupling = self.bodies.robot.coupling
        return sizes if coupling is None else np.asarray(sizes @ np.abs(coupling).T)

    def acceleration(self, start: Reals, end: Reals) -> Reals:
        """Bounds of the accelerations of the capsules' ends between times.

        Parameters
        ----------
        start, end : (k,), s

        Returns
        -------
        bounds : (k,), m/s^2; infinite where the joints' rates are unknown
        """
        sliding = self.bodies.robot.sliding
        speed, acceleration = self.rates(start, end)
        known = np.asarray(np.isfinite(speed + acceleration).all(axis=1, keepdims=True))
        speed, acceleration = (self.of_rows(np.where(known, part, 0.0)) for part in (speed, acceleration))
        turning, shifting = speed[:, ~sliding].sum(axis=1), speed[:, sliding].sum(axis=1)
        bent = acceleration[:, ~sliding].sum(axis=1) + turning**2
        found = self.lever * bent + acceleration[:, sliding].sum(axis=1) + 2 * turning * shifting
        return np.where(known[:, 0], found, np.inf)

    def tracked(self, q: Reals) -> Reals:
        """End points whose paths count: of links in other links' frames, then of capsules in space.

        Parameters
        ----------
        q : (..., n), rad or m

        Returns
        -------
        points : (..., tracks, k, 3), m; k is the largest number of points of a body
        """
        bodies, ends = self.bodies, self.bodies.ends(q)
        links = [bodies.capsules[i].link for i in bodies.first[self._own]]
        T = link_frames(bodies.robot, q)[..., links, :, :]
        from_link = ends[..., bodies.second[self._own], :, :] - T[..., None, :3, 3]
        return np.concatenate([from_link @ T[..., :3, :3], ends[..., self._moving, :, :]], axis=-3)

    def measure(self, t: float, q: Reals, pairs: Integers) -> Reals:
        """Distances at a time, measured where they are not known yet.

        Parameters
        ----------
        t : s, by which they are remembered
        q : (n,), rad or m, the arm at that time
        pairs : (k,), numbers of pairs that are needed

        Returns
        -------
        distances : (P,), m, negative by the depth; NaN for pairs that were never asked for at that time
        """
        found = self.known.setdefault(t, np.full(len(self.bodies.pairs), np.nan))
        missing = pairs[np.isnan(found[pairs])]
        if missing.size:
            found[missing] = self.bodies.distances(q, missing)
        return found

    def measure_at(self, t: float) -> None:
        """Measure all distances at a time, s, which need not be one of the points."""
        self.measure(t, self.joints(np.array([t]))[0], self.every)


def clearance_along(
    bodies: Bodies, joints: Joints, rates: RateBounds, t: Reals, shown: Reals, depth: float
) -> ClearanceAlong:
    """Measure clearance along a motion, bounded between the points measured (see the module's text).

    Parameters
    ----------
    rates : bounds (k, n) of the sizes of joint speeds (rad/s or m/s) and accelerations between times (k,) and (k,);
        infinite where there are none
    joints : values (N, n) in rad or m at times (N,) in s; NaN where the motion is unknown
    t : (N,), s, rising: where the motion is known or not; refined as needed
    shown : times (K,) of ``t`` at which the clearance is returned
    depth : m, of overlaps that may be missed, and to within which the smallest clearance is found

    Returns
    -------
    along : distances in m at ``shown`` and at all times at which every pair was measured; and the contacts. Links that
        touch by design at their joint count only on motions on which they overlap elsewhere, there all along: so the
        distance has no jump where they begin to
    """
    motion = _Motion(bodies, joints, rates)
    every = motion.every
    if not every.size:
        none = len(shown)
        return ClearanceAlong(shown, np.full(none, np.nan), (None,) * none, np.full(none, -1), (), 0)
    times, q, travel = _fine(motion, t, 2 * depth)
    reached = np.isfinite(q[:, 0])
    for i in np.flatnonzero(np.isin(times, shown) & reached):
        motion.measure(times[i], q[i], every)
    contacts: list[Contact] = []
    for first, last in runs(reached):
        for end in (first, last - 1):
            motion.measure(times[end], q[end], every)
        part = slice(first, last)
        _refine(motion, times[part], q[part], travel[part], 2 * depth)
        contacts += _contacts(motion, times[part], q[part], (t[-1] - t[0]) * LOCATED)
    at = np.array(sorted(time for time, found in motion.known.items() if not np.isnan(found).any()))
    at = np.union1d(at, shown[~np.isin(shown, at)])
    unknown = np.full(len(every), np.nan)
    rows = np.array([motion.known.get(time, unknown) for time in at])
    rows[:, bodies.joined & ~(rows <= 0).any(axis=0)] = np.inf
    blind = np.asarray(np.isnan(rows).any(axis=1) | np.isinf(rows).all(axis=1))
    distance = np.where(blind, np.nan, rows.min(axis=1))
    number = np.where(blind, -1, rows.argmin(axis=1))
    pair = tuple(None if k < 0 else bodies.pairs[k] for k in number)
    return ClearanceAlong(at, distance, pair, number, tuple(contacts), len(motion.known))


def _fine(motion: _Motion, t: Reals, step: float) -> tuple[Reals, Reals, Reals]:
    """Times so near to one another that no tracked end moves by more than ``step``, joints, and the path length so far.

    The path length is (N, tracks), of the end that moves more, summed up; infinite steps where it is unknown.
    """
    times, q = t, motion.joints(t)
    while True:
        cuts = range(0, len(times) - 1, CHUNK)
        steps = np.concatenate([_steps(motion, times[k : k + CHUNK + 1], q[k : k + CHUNK + 1]) for k in cuts])
        wide = (steps.max(axis=1) > step) & (np.diff(times) > SHORTEST * (t[-1] - t[0]))
        if not wide.any():
            break
        middle = (times[:-1] + times[1:])[wide] / 2
        times = np.concatenate([times, middle])
        order = np.argsort(times, kind="stable")
        times, q = times[order], np.concatenate([q, motion.joints(middle)])[order]
    steps = np.nan_to_num(steps, nan=0.0)  # beside an unknown pose; stretches between them are summed up apart
    return times, q, np.concatenate([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])


def _steps(motion: _Motion, times: Reals, q: Reals) -> Reals:
    """How far the tracked ends move at most between neighbouring times (m + 1,); (m, tracks)."""
    here = motion.tracked(q)
    h = np.diff(times)
    bulge = motion.acceleration(times[:-1], times[1:]) * h**2 / 3
    moved: Reals = np.linalg.norm(np.diff(here, axis=0), axis=-1).max(axis=-1) + bulge[:, None]
    free = np.flatnonzero(~np.isfinite(bulge))
    if free.size:
        half = motion.tracked(motion.joints(times[free] + h[free] / 2))
        chords = np.linalg.norm(half - here[free], axis=-1) + np.linalg.norm(here[free + 1] - half, axis=-1)
        bent = np.linalg.norm(here[free] - 2 * half + here[free + 1], axis=-1)
        moved[free] = (chords + bent).max(axis=-1)
    return moved


def _refine(motion: _Motion, times: Reals, q: Reals, travel: Reals, step: float) -> None:
    """Measure between known points until each pair is free in all of an interval, or overlaps in it, or it is short."""
    known = [i for i, time in enumerate(times) if time in motion.known]
    bodies = motion.bodies
    best = min(float(bodies.counted(motion.known[times[i]]).min()) for i in known)
    waiting = [(a, b, motion.every) for a, b in pairwise(known)]
    while waiting:
        a, b, pairs = waiting.pop()
        before, after = motion.known[times[a]], motion.known[times[b]]
        moved = (travel[b] - travel[a])[motion.track[pairs]]
        if b - a < 2:
            continue
        apart = before[pairs] + after[pairs]
        free = apart - moved >= np.where(bodies.joined[pairs], 0.0, 2 * max(best, 0.0))
        if not (~free & (apart > -moved) & (moved > step)).any():
            continue
        pairs = pairs[~free]
        middle = int(
            np.clip(np.searchsorted(travel[a : b + 1].sum(axis=1), travel[[a, b]].sum() / 2) + a, a + 1, b - 1)
        )
        found = motion.measure(times[middle], q[middle], pairs)
        nearest = float(np.nanmin(bodies.counted(found)))
        if nearest < best:
            best = nearest
            motion.measure(times[middle], q[middle], motion.every)
        waiting += [(a, middle, pairs), (middle, b, pairs)]


def _contacts(motion: _Motion, times: Reals, q: Reals, near: float) -> list[Contact]:
    """Stretches of overlap between known points, their ends located where the smallest distance is 0, and measured."""
    known = [i for i, time in enumerate(times) if time in motion.known]
    overlap = np.array([bool(np.nanmin(motion.known[times[i]]) <= 0) for i in known])

    def apart(at: float, pairs: Integers = motion.every) -> float:
        return float(motion.bodies.distances(motion.joints(np.array([at]))[0], pairs).min())

    found = []
    for a, b in runs(overlap):
        first, last = times[known[a]], times[known[b - 1]]
        start = scipy.optimize.brentq(apart, times[known[a - 1]], first, xtol=near) if a > 0 else first
        end = scipy.optimize.brentq(apart, last, times[known[b]], xtol=near) if b < len(known) else last
        for edge in (start, end):
            motion.measure_at(edge)
        inside = known[max(a - 1, 0) : b + 1]
        at = times[inside]
        rows = np.array([motion.bodies.distances(q[i], motion.every) for i in inside])
        touches: dict[Pair, Touch] = {}
        for k in np.flatnonzero(rows[(at >= first) & (at <= last)].min(axis=0) <= 0).tolist():
            touch = _touch(motion, k, at, rows[:, k], partial(apart, pairs=np.array([k])), near)
            other = touches.get(touch.pair, touch)
            deeper = max(touch, other, key=lambda each: each.depth)
            touches[touch.pair] = Touch(touch.pair, max(min(touch.start, other.start), start), deeper.depth, deeper.at)
        order = sorted(touches.values(), key=lambda each: (each.start, -each.depth))
        deepest = max(order, key=lambda each: each.depth)
        found.append(Contact(float(start), float(end), tuple(order), deepest.depth, deepest.at))
    return found


def _touch(
    motion: _Motion, k: int, times: Reals, distances: Reals, apart: Callable[[float], float], near: float
) -> Touch:
    """When a pair first touches, and where it is deepest, near the minimum of its distances (n,) at times (n,)."""
    first, deepest = int(np.argmax(distances <= 0)), int(np.argmin(distances))
    start, at = float(times[first]), float(times[deepest])
    if first > 0:
        start = float(scipy.optimize.brentq(apart, times[first - 1], start, xtol=near))
    beside = times[max(deepest - 1, 0)], times[min(deepest + 1, len(times) - 1)]
    found = scipy.optimize.minimize_scalar(
        apart, bounds=beside, method="bounded", options={"xatol": DEEPEST / LOCATED * near}
    )
    depth = -float(distances[deepest])
    if -found.fun > depth + LEVEL:
        at, depth = float(found.x), -float(found.fun)
        motion.measure_at(at)
    return Touch(motion.bodies.pairs[k], start, depth, at)


STEP = 0.02
"""Of joints, rad or m, between moments at which a stored motion is compared with solids."""


def first_overlap(robot: Robot, scene: Scene, t: Reals, q: Reals) -> tuple[float, Pair] | None:
    """When a motion that goes straight from row to row first overlaps a solid of the scene, and what with which.

    Parameters
    ----------
    t : (n,), s
    q : (n, joints), rad or m; rows that are not finite are left out, with the ways to and from them

    Returns
    -------
    moment, pair : s, and two bodies; None if nothing overlaps at the rows and every ``STEP`` between them
    """
    steps = np.abs(np.diff(q, axis=0, append=q[-1:])).max(axis=1)
    counts = np.where(np.isfinite(steps), np.maximum(np.ceil(steps / STEP), 1), 1).astype(int)
    row = np.repeat(np.arange(len(t)), counts)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[row]
    after = np.minimum(row + 1, len(t) - 1)
    tried = np.where(share[:, None] > 0, q[row] + share[:, None] * (q[after] - q[row]), q[row])
    known = np.flatnonzero(np.isfinite(tried).all(axis=1))
    bodies = bodies_of(robot, scene)
    found = bodies.overlaps(tried[known]) & (bodies.second < 0)
    (hits,) = np.nonzero(found.any(axis=1))
    if not len(hits):
        return None
    at = known[hits[0]]
    moment = t[row[at]] + share[at] * (t[after[at]] - t[row[at]])
    return float(moment), bodies.pairs[int(found[hits[0]].argmax())]


@dataclass(frozen=True, eq=False, repr=False)
class Clearance(Displayed):
    """Smallest distances of arms.

    Attributes
    ----------
    distance : (N,), m, over the pairs of bodies that can meet; negative where something overlaps, by the depth
    pair : N, what is nearest to what; None where nothing can meet
    """

    distance: Reals
    pair: tuple[Pair | None, ...]


@lru_cache(maxsize=8)
def bodies_of(robot: Robot, scene: Scene | None) -> Bodies:
    """The bodies of an arm and a scene; the eight used last are kept.

    Parameters
    ----------
    scene : None for the arm alone

    Returns
    -------
    bodies : with the pairs that can meet
    """
    return Bodies(robot, scene)


def clearance(robot: Robot, q: Reals, scene: Scene | None = None) -> Clearance:
    """Smallest distance of the arm from the scene's solids and from itself, at each joint vector.

    Parameters
    ----------
    q : (N, n), rad or m
    scene : None for the arm alone

    Returns
    -------
    clearance : distances (N,) in m, 0 where bodies touch, negative by the depth of overlap, and the nearest pairs

    Raises
    ------
    Er3aError
        if the scene is not a scene of er3a
    """
    bodies = bodies_of(robot, scene)
    distance, pair = bodies.min_distance(np.asarray(q, float).reshape(-1, robot.joints))
    return Clearance(distance, tuple(bodies.pairs[k] if k >= 0 else None for k in pair))
