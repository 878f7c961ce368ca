"""Self-motions of any arm, as parts of traced curves that lie within the joint limits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import field
from typing import Any, Literal

import numpy as np

from er3a.by_value import ByValue, Displayed, Sheet, frozen, shortly
from er3a.kinematics.chain import joint_starts, row_values
from er3a.kinematics.classes.self_motion import PoseChain, TracedCurve
from er3a.numerics.arrays import Flags, Reals
from er3a.robots.joint_limits import joint_columns, limit_margin, nearest_equivalent, shown, unwound, within
from er3a.robots.robot import Robot

LAPS = 6  # a curve that turns a joint is followed over so many of its laps at most
SPLIT, SPLITS = 16, 11  # an interval is cut into so many parts, so often: to 16^-11 of it
NARROWINGS = 10  # each to a sixth of the interval
SAME_TURN, COVERS = 1e-6, 1e-6  # rad: what rounding makes of equal turns, and of ends of one part


@frozen
class SelfMotionCurve(ByValue, Displayed):
    """A part of a curve of solutions of one pose: joints move with the tool at rest.

    Its members have a parameter t (rad), which is the summed length of the joint moves from q0 on.

    Attributes
    ----------
    q0 : (n,), rad or m, the member nearest to the reference (Euclidean norm), within the limits if
        ``within_limits``
    direction : (n,), rad or m per rad of t, at q0
    range : (2,), smallest and largest t up to which all members from q0 on are within the limits; of a curve of which
        none is, one lap
    max_margin_member : (n,), the member with the largest margin to all joint limits; max_margin : that margin
    dimension : 1; above it, this curve is one of many on a surface of solutions
    branches : numbers of the solutions that lie on it
    """

    kind: Literal["curve"]
    q0: Reals
    direction: Reals
    range: Reals
    within_limits: bool
    max_margin_member: Reals
    max_margin: float
    dimension: int
    branches: tuple[int, ...]
    robot: Robot
    T: Reals
    chain: PoseChain = field(repr=False)
    curve: TracedCurve = field(repr=False)
    lengths: Reals = field(repr=False)
    start: float = 0.0
    shift: Reals = field(default_factory=lambda: np.zeros(0))

    def members(self, t: Reals) -> Reals:
        """Members of the self-motion.

        Parameters
        ----------
        t : (...), rad, summed length of joint moves from q0 on; a slide counts in parts of the arm's size

        Returns
        -------
        q : (..., n), rad or m
        """
        t = np.asarray(t, float)
        at = _place_of(self.lengths, self.start + t.reshape(-1), self.curve.closed)
        q = _joints(self.robot, self.chain.members(self.curve, at)) + self.shift
        return np.asarray(q.reshape(*t.shape, self.robot.joints))

    def sheet(self) -> Sheet:
        """A line for printing: range (deg) and the nearest member (deg or mm).

        Returns
        -------
        sheet : without rows
        """
        values = zip(joint_columns(self.robot), shown(self.robot, self.q0).tolist())
        return line_of(self, "Self-motion", "q0: " + ", ".join(f"{name} {shortly(value)}" for name, value in values))


def line_of(motion: Any, name: str, q0: str) -> Sheet:
    """A self-motion in a line, for printing: what it is, its range (deg), and its nearest member.

    Parameters
    ----------
    motion : with ``range``, ``within_limits`` and ``dimension``
    name, q0 : texts
    """
    low, high = np.degrees(motion.range).tolist()
    within = "within the limits" if motion.within_limits else "outside the limits"
    of_surface = f", one curve of a surface of dimension {motion.dimension}" if motion.dimension > 1 else ""
    return Sheet(f"{name}, t from {shortly(low)} to {shortly(high)} deg, {within}, {q0}{of_surface}")


def _joints(robot: Robot, x: Reals) -> Reals:
    """The manufacturer's values (..., n), not wrapped."""
    u = robot.direction * (x - joint_starts(robot))
    return u if robot.coupling is None else np.asarray(u @ np.linalg.inv(robot.coupling).T)


def _place_of(lengths: Reals, t: Reals, closed: bool) -> Reals:
    """Places counted in points of the curve, for lengths along it."""
    lap, last = lengths[-1], len(lengths) - 1
    laps = np.floor(t / lap) if closed else np.zeros_like(t)
    return np.asarray(np.interp(t - laps * lap, lengths, np.arange(len(lengths))) + laps * last)


def self_motion_of(robot: Robot, T: Reals, chain: PoseChain, curve: TracedCurve, q_ref: Reals) -> list[SelfMotionCurve]:
    """Parts of a traced curve that lie within the joint limits.

    Parameters
    ----------
    T : (4, 4), m, the pose
    chain : with that pose
    curve : traced on it
    q_ref : (n,), rad or m

    Returns
    -------
    motions : one for each part, nearest to the reference first; one for the whole of it if no part lies within the
        limits
    """
    q = _joints(robot, curve.points)
    steps = np.diff(np.where(robot.slides, q / chain.size, q), axis=0)
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(steps, axis=1))])
    near = nearest_equivalent(robot, unwound(robot, q), q_ref)
    inside = within(robot, near)
    made: list[SelfMotionCurve] = []
    parts = _parts(inside, near - q, curve.closed) if inside.any() else [np.arange(len(q))]
    parts.sort(key=lambda part: float(np.linalg.norm(near[part] - q_ref, axis=1).min()))
    if curve.dimension > 1:  # one curve of a surface: only the part nearest to the reference
        parts = parts[:1]
    for part in parts:
        if any(_reaches(motion, lengths[part]) for motion in made):
            continue
        best = int(part[np.linalg.norm(near[part] - q_ref, axis=1).argmin()])
        widest = int(part[limit_margin(robot, near[part]).argmax()])
        made.append(
            _part(
                robot,
                T,
                chain,
                curve,
                lengths,
                q_ref=q_ref,
                any_inside=bool(inside.any()),
                best=(best, near[best] - q[best]),
                max_margin_member=(widest, near[widest] - q[widest]),
            )
        )
    return made


def _parts(inside: Flags, turns: Reals, closed: bool) -> list[np.ndarray]:
    """Runs of points within the limits without a change of ``turns`` (k, n), what they are shifted by; the last point
    of a closed curve is its first."""
    count = len(inside) - int(closed)
    flags, new_run = inside[:count], np.zeros(count, dtype=bool)
    new_run[1:] = np.abs(np.diff(turns[:count], axis=0)).max(axis=1) > SAME_TURN
    new_run[0] = not closed or np.abs(turns[count] - turns[count - 1]).max() > SAME_TURN
    breaks = np.flatnonzero(new_run | ~flags)
    order = np.roll(np.arange(count), -int(breaks[0]) if breaks.size else 0)
    runs = np.split(order, np.flatnonzero((new_run | ~flags)[order])[1:] if breaks.size else [])
    return [own for run in runs if len(own := run[flags[run]])]


def _reaches(motion: SelfMotionCurve, places: Reals) -> bool:
    """Whether a part covers places (k,), lengths along its curve, turns of joints aside."""
    low, high = motion.range
    away = places - motion.start - low
    if motion.curve.closed:
        away = np.mod(away + COVERS, motion.lengths[-1]) - COVERS
    return bool(((away >= -COVERS) & (away <= high - low + COVERS)).all())


def _part(
    robot: Robot,
    T: Reals,
    chain: PoseChain,
    curve: TracedCurve,
    lengths: Reals,
    *,
    q_ref: Reals,
    any_inside: bool,
    best: tuple[int, Reals],
    max_margin_member: tuple[int, Reals],
) -> SelfMotionCurve:
    """One part of a curve: its nearest member, its tangent, its range and its member with the largest margin."""

    def at(t: Reals) -> Reals:
        return _joints(robot, chain.members(curve, _place_of(lengths, np.atleast_1d(t), curve.closed)))

    def distance(t: Reals) -> Reals:
        q = at(t) + best[1]
        cost = np.linalg.norm(q - q_ref, axis=1)
        return np.where(within(robot, q) | ~np.bool_(any_inside), cost, np.inf)

    def narrowness(t: Reals) -> Reals:
        return -limit_margin(robot, at(t) + max_margin_member[1])

    start = place_of_least(distance, lengths, best[0], curve.closed)
    q0 = (at(np.array([start])) + best[1])[0]
    own = q_ref
    if np.abs(own - q0).max() < 1e-5 and chain.error(to_rows(robot, own)) < 1e-11:
        q0 = np.array(own)
    shift = q0 - at(np.array([start]))[0]
    step = 1e-4
    direction = (at(np.array([start + step])) - at(np.array([start - step])))[0] / (2 * step)
    widest = place_of_least(narrowness, lengths, max_margin_member[0], curve.closed)
    room = (at(np.array([widest])) + max_margin_member[1])[0]
    span = np.array([-0.5, 0.5]) * lengths[-1] if curve.closed else np.array([0.0, lengths[-1]]) - start
    motion = SelfMotionCurve(
        "curve", q0, direction, span, any_inside, room, float(limit_margin(robot, room)), curve.dimension, (), robot, T,
        chain, curve, lengths, start, shift,
    )  # fmt: skip
    if not any_inside:
        return motion
    object.__setattr__(motion, "range", _range(motion))
    return motion


def to_rows(robot: Robot, q: Reals) -> Reals:
    """What the table's rows turn or shift by, offsets included: the solver's x.

    Parameters
    ----------
    q : (..., n), rad or m

    Returns
    -------
    x : (..., m), rad or m
    """
    return np.asarray(robot.direction * row_values(robot, q) + joint_starts(robot))


def place_of_least(cost: Callable[[Reals], Reals], lengths: Reals, best: int, closed: bool = False) -> float:
    """The minimum of a cost along a curve between the neighbours of its best point, by narrowing.

    Parameters
    ----------
    cost : of places (k,) along the curve
    lengths : (m,), places of the curve's points, rising
    best : number of the point
    closed : whether the last point is the first
    """
    low, high = lengths[max(best - 1, 0)], lengths[min(best + 1, len(lengths) - 1)]
    if closed and best == 0:
        low = lengths[-2] - lengths[-1]
    at = float(lengths[best])
    for _ in range(NARROWINGS):
        t = np.append(np.linspace(low, high, 13), at)
        costs = cost(t)
        at = float(t[int(costs.argmin())])
        half = (high - low) / 12
        low, high = max(at - half, low), min(at + half, high)
    return at


def _range(motion: SelfMotionCurve) -> Reals:
    """How far members from q0 on stay within the limits: at the curve's points, then by halving."""
    robot, lengths, closed = motion.robot, motion.lengths, motion.curve.closed
    lap = lengths[-1]
    turns = np.abs(motion.members(np.array([lap])) - motion.members(np.array([0.0]))).max() > 1e-6 if closed else False
    ends = []
    for side in (-1.0, 1.0):
        if closed and not turns:
            reach = np.concatenate([lengths - motion.start, lengths - motion.start + lap, lengths - motion.start - lap])
            reach = np.abs(reach[(reach * side > 0) & (np.abs(reach) <= lap)])
        elif closed:
            laps = np.arange(-LAPS, LAPS + 1)[:, None] * lap
            reach = (laps + lengths[None, :-1] - motion.start).reshape(-1)
            reach = np.abs(reach[reach * side > 0])
        else:
            reach = np.abs((lengths - motion.start)[(lengths - motion.start) * side > 0])
        reach = np.sort(reach)
        ok = within(robot, motion.members(side * reach)) if len(reach) else np.zeros(0, dtype=bool)
        if ok.all():
            whole = 0.5 * lap if closed and not turns else reach[-1] if len(reach) else 0.0
            ends.append(side * whole)
            continue
        ends.append(last_within(robot, motion.members, side * reach, ok))
    return np.array(ends)


def last_within(robot: Robot, members: Callable[[Reals], Reals], reach: Reals, ok: Flags) -> float:
    """How far members from place 0 on stay within the limits, by cutting again and again what holds the end.

    Parameters
    ----------
    members : (k, n), rad or m, at places (k,)
    reach : (m,), places, from 0 on in one sense
    ok : (m,) bool, whether the members there are within the limits; not all of them
    """
    first = int(ok.argmin())
    good, bad = (float(reach[first - 1]) if first else 0.0), float(reach[first])
    for _ in range(SPLITS):
        parts = np.linspace(good, bad, SPLIT + 1)
        last = int(np.append(within(robot, members(parts[1:-1])), False).argmin())
        good, bad = float(parts[last]), float(parts[last + 1])
    return good
