"""All strategies of singularity avoidance: the cost of each, and the recommended one.

Bend the path past the singular region through a via point, by the smallest amount that keeps the distance.

Near a singularity, a pose differs from it by a vector of one or two components: the deviation of axis 6 from axis 4
(wrist), the wrist centre's distance across axis 1 (shoulder), the elbow's angle. The path runs past the origin of that
plane; to first order the smallest shift, or the smallest tilt, that moves it away is across its direction there. That
gives the direction of the bend; its size is found on the bent path itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import field
from itertools import product
from typing import Any, Literal, Protocol, cast

import numpy as np
import scipy

from er3a.by_value import by_identity
from er3a.errors import PoseError
from er3a.finding import Finding, fact, turned_or_moved
from er3a.geometry.transforms import frame_along, moved
from er3a.kinematics.closed_form import SLOTS
from er3a.kinematics.forward import forward, frames
from er3a.kinematics.singularity import TYPES, SingularityType, characteristic_length, determinant_factors, factor_of
from er3a.kinematics.wrist_partitioned import solve_slots, wrist_partitioned_arm
from er3a.numerics.arrays import Reals
from er3a.planning.avoidance import avoidance
from er3a.planning.follow import Followed, follow
from er3a.planning.motion_faults import by_kind, over_limits
from er3a.planning.moves import ToolPath
from er3a.planning.names import StrategyName
from er3a.planning.piecewise import PiecewiseMotion
from er3a.planning.profiles import quintic
from er3a.planning.timing import JointLimits, TimingError, joined, straight
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot

Kind = Literal["shift", "tilt"]

WIDER = 2.5  # a bend spans the region's half width so many times, if the path is long enough
STEP = 1e-6  # of the characteristic length, or rad
BENT_POINTS = 120  # at which the distance along a bend is looked at
GROWTH = 1.4  # of a bend's size from try to try, until one clears the region
HALVINGS = 12  # of the interval between the last size that did not clear it and the first that did
MAX_SIDES = 8  # combinations of sides that are followed: with each region more they double
MAX_BEND: dict[Kind, float] = {"shift": 0.5, "tilt": 1.0}  # of the characteristic length; rad
SAME_TIME = 0.01  # s
SPARE = 1.0005  # keep this much more than the distance


@by_identity
class Bend:
    """A smooth bulge of a path: rises from ``start`` to its full size at ``top``, and falls to nothing at ``end``.

    Attributes
    ----------
    start, top, end : shares of the path
    shift : (3,), m, base frame; tilt : (3,), rad, rotation vector about the tool point, base frame
    """

    start: float
    top: float
    end: float
    shift: Reals
    tilt: Reals

    @property
    def amount(self) -> float:
        """Length of the shift (m) plus angle of the tilt (rad), of which one is 0."""
        return float(np.linalg.norm(self.shift) + np.linalg.norm(self.tilt))

    def size(self, progress: Reals) -> Reals:
        """Share of the bend that is applied, with continuous second derivative (quintic up, quintic down).

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        size : (...,), 0 outside ``start`` to ``end``, 1 at ``top``
        """
        rise = np.clip((progress - self.start) / (self.top - self.start), 0.0, 1.0)
        fall = np.clip((self.end - progress) / (self.end - self.top), 0.0, 1.0)
        zero, one = np.array(0.0), np.array(1.0)
        return np.where(progress < self.top, quintic(rise, 1.0, zero, one)[0], quintic(fall, 1.0, zero, one)[0])


@by_identity
class BentPath:
    """A path of the tool with bends, on the path's own time law."""

    path: ToolPath
    bends: tuple[Bend, ...] = field(default=())

    @property
    def duration(self) -> float:
        """Duration of the path without bends, s."""
        return self.path.duration

    def progress(self, t: Reals) -> tuple[Reals, Reals, Reals]:
        """Time law of the path without bends.

        Parameters
        ----------
        t : (...,), s

        Returns
        -------
        progress, first, second : (...,), share of the path, and its derivatives in 1/s and 1/s^2
        """
        return self.path.progress(t)

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool on the bent path: shifted, and turned about the tool point.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """
        progress = np.asarray(progress, float)
        T = self.path.poses(progress)
        for bend in self.bends:
            T = moved(T, bend.size(progress)[..., None] * np.append(bend.shift, bend.tilt))
        return T


def shifted_via(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Bend the path by the smallest shift of the tool point, its orientation kept.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep

    Returns
    -------
    found : the motion along the bent path, or why there is none
    """
    return _via(segment, "shift")


def tilted_via(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Bend the path by the smallest tilt of the tool, the tool point kept on its path.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep

    Returns
    -------
    found : the motion along the bent path, or why there is none
    """
    return _via(segment, "tilt")


def _via(segment: avoidance.SingularSegment, kind: Kind) -> avoidance.Avoidance | Finding:
    if not segment.regions:
        return fact("nothing_to_avoid")
    if segment.regions[0][0] == 0:
        return no_end("start", "in_region")
    if segment.regions[-1][1] == len(segment.t):
        return no_end("end", "in_region")
    bends = [bends_of(segment, first, last, kind) for first, last in segment.regions]
    if not all(bends):
        return _none_far_enough(segment, kind)
    fallback = None
    for chosen in sorted(product(*bends), key=lambda some: sum(bend.amount for bend in some))[:MAX_SIDES]:
        path = BentPath(segment.followed.line, chosen)
        for other in _followed(segment, path):
            if other.regions:
                continue
            if within(segment.robot, other.q).all():
                return avoidance.Avoidance(_carried_out(segment, other))
            fallback = fallback or other
    if fallback is None:
        return fact("bent_path_singular")
    return avoidance.Avoidance(_carried_out(segment, fallback))


def _followed(segment: avoidance.SingularSegment, path: BentPath) -> Iterator[avoidance.SingularSegment]:
    """The bent path from the path's own first joints, then from the start pose with other turns of the joints."""
    t = avoidance.coarse(segment.t)
    starts: tuple[dict[str, Any], ...] = ({"q_start": segment.q[0]}, {"start_slot": int(segment.followed.slot[0])})
    for start in starts:
        followed = follow(segment.robot, cast(ToolPath, path), t, **start)  # only its joints are used
        yield avoidance.singular_segment(followed, segment.near, segment.limits)


def _carried_out(segment: avoidance.SingularSegment, other: avoidance.SingularSegment) -> PiecewiseMotion:
    leave = segment.first_joints if segment.fixed_start else other.q[0]
    turn = [straight(leave, other.q[0], segment.limits)] if np.abs(other.q[0] - leave).max() > avoidance.AT_REST else []
    return joined([*turn, other.along(0, len(other.t) - 1)])


def bends_of(segment: avoidance.SingularSegment, first: int, last: int, kind: Kind) -> list[Bend]:
    """The smallest bend to either side that clears a region.

    Parameters
    ----------
    first, last : index range of the region on the segment's grid, ``last`` excluded; not at the path's ends
    kind : "shift" of the tool point (m) or "tilt" about it (rad)

    Returns
    -------
    bends : up to two, one for each side on which a bend was found
    """
    path, t = segment.followed.line, segment.t
    worst = first + int(np.argmin(segment.near.margin(segment.robot, segment.q[first:last])))
    low, top, high = (float(path.progress(t[i])[0]) for i in (first - 1, worst, last))
    half = WIDER * max(top - low, high - top)
    span = max(0.0, top - half), top, min(1.0, top + half)
    slot = int(segment.followed.slot[np.searchsorted(segment.followed.t, t[first - 1])])
    singular = _nearest_type(segment, first, worst)
    bends = [
        _smallest_bend(segment, slot, singular, span, way) for way in _directions(segment, slot, singular, top, kind)
    ]
    return [bend for bend in bends if bend is not None]


def _nearest_type(segment: avoidance.SingularSegment, first: int, worst: int) -> SingularityType:
    q = segment.q[worst] if np.isfinite(segment.q[worst, 0]) else segment.q[first - 1]
    factors = determinant_factors(segment.robot, q)
    return TYPES[int(np.argmin(segment.near.ratios(factors)))]


def _directions(
    segment: avoidance.SingularSegment, slot: int, singular: SingularityType, top: float, kind: Kind
) -> list[Reals]:
    """Unit shifts or tilts (6,) across the path in the plane beside the singularity, to either side."""
    path, length = segment.followed.line, characteristic_length(segment.robot)
    part = slice(0, 3) if kind == "shift" else slice(3, 6)
    pose = path.poses(np.array(top))
    size = STEP * (length if kind == "shift" else 1.0)
    moves = np.zeros((6, 6))
    moves[:3, part], moves[3:, part] = size * np.eye(3), -size * np.eye(3)
    ahead = np.array([min(top + 1e-4, 1.0), max(top - 1e-4, 0.0)])
    T = np.concatenate([moved(pose, moves), path.poses(ahead), pose[None]])
    beside = _beside(segment, T, slot, singular)
    slope = ((beside[:3] - beside[3:6]) / (2 * size)).T
    along = beside[6] - beside[7]
    if not np.isfinite(slope).all():
        return []
    if len(along) == 1:
        across = [np.ones(1), -np.ones(1)]
    else:
        if not np.isfinite(along).all() or np.linalg.norm(along) < 1e-9:
            along = np.array([-beside[8][1], beside[8][0]]) if beside[8].any() else np.array([1.0, 0.0])
        normal = np.array([-along[1], along[0]]) / np.linalg.norm(along)
        across = [normal, -normal]
    directions = []
    for normal in across:
        wanted = slope.T @ normal
        if np.linalg.norm(wanted) > 1e-6 * length:
            full = np.zeros(6)
            full[part] = wanted / np.linalg.norm(wanted)
            directions.append(full)
    return directions


def _beside(segment: avoidance.SingularSegment, T: Reals, slot: int, singular: SingularityType) -> Reals:
    """How poses (n, 4, 4) lie beside the singularity: (n, 2) or, for the elbow, (n, 1)."""
    robot = segment.robot
    arm = wrist_partitioned_arm(robot)
    if singular == "shoulder":
        centre = T[:, :3, 3] + T[:, :3, :3] @ arm.wrist_in_tool - arm.points[0]
        across: Reals = centre @ frame_along(arm.axes[0])[:2].T
        return across
    q, _, gap = solve_slots(robot, T, np.zeros((len(T), 6)))
    if singular == "elbow":
        reached = np.isfinite(q[:, slot, 0])
        bend = np.abs(determinant_factors(robot, q[:, slot]).elbow)
        return np.where(reached, bend, -gap[:, slot])[:, None]
    axes = frames(robot, q[:, slot])[..., :3, 2]
    axis_4, axis_6 = axes[:, 3], axes[:, 5]
    same = np.sign(np.einsum("ni,ni->n", axis_4, axis_6))[:, None]
    apart: Reals = (axis_6 - same * axis_4) @ frame_along(axis_6[-1])[:2].T
    return apart


def _smallest_bend(
    segment: avoidance.SingularSegment,
    slot: int,
    singular: SingularityType,
    span: tuple[float, float, float],
    direction: Reals,
) -> Bend | None:
    """The smallest bend in a direction (6,) that keeps the distance; None if none up to MAX_BEND does."""
    path = segment.followed.line
    grid = np.unique(np.concatenate([np.linspace(span[0], span[2], BENT_POINTS), [span[1]]]))
    kind: Kind = "shift" if direction[:3].any() else "tilt"
    most = MAX_BEND[kind] * (characteristic_length(segment.robot) if kind == "shift" else 1.0)

    def bend(size: float) -> Bend:
        return Bend(*span, size * direction[:3], size * direction[3:])

    def keeps(size: float) -> bool:
        T = BentPath(path, (bend(size),)).poses(grid)
        q = solve_slots(segment.robot, T, np.zeros((len(T), 6)))[0][:, slot]
        distance = np.abs(factor_of(determinant_factors(segment.robot, q), singular))
        return bool((distance >= SPARE * segment.near.of(singular)).all())

    low, high = 0.0, most / 50
    while not keeps(high):
        low, high = high, high * GROWTH
        if high > most:
            return None
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (low, middle) if keeps(middle) else (middle, high)
    return bend(high)


def no_end(end: str, why: str) -> Finding:
    """That the start or the end of a path can't be one, and why."""
    return fact("no_end", end=end, why=fact(why))


def _none_far_enough(segment: avoidance.SingularSegment, kind: Kind) -> Finding:
    shift = 1000 * MAX_BEND["shift"] * characteristic_length(segment.robot)
    most = shift if kind == "shift" else float(np.degrees(MAX_BEND["tilt"]))
    return fact("no_bend_keeps_distance", up_to=turned_or_moved(most, kind == "shift"))


def detour(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Follow the path up to the last good pose, move the joints to the next good one, and go on, at every region.

    Where the path begins or ends inside a region, its first or last joints take the place of the good pose.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep

    Returns
    -------
    found : the motion, which crosses the singular set by joint moves, or why there is none
    """
    if not segment.regions:
        return fact("nothing_to_avoid")
    count, at = len(segment.t), 0
    parts: list[PiecewiseMotion] = []
    for first, last in segment.regions:
        before, after = max(first - 1, 0), min(last, count - 1)
        if np.isnan(segment.q[before, 0]):
            return no_end("start", "beyond_reach")
        if np.isnan(segment.q[after, 0]):
            return no_end("end", "beyond_reach")
        if before > at:
            parts += [*(segment.begin() if at == 0 else []), segment.along(at, before)]
        leave = segment.q[before] if before > 0 else segment.first_joints
        parts.append(straight(leave, segment.q[after], segment.limits))
        at = after
    if at < count - 1:
        parts.append(segment.along(at, count - 1))
    return avoidance.Avoidance(joined(parts), crosses_by_joints=True)


COARSE = 201  # times at which other branches are looked at before one is followed in full


def branch(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Change to another branch by a joint move at rest, and follow the rest of the path on it.

    A change before the path begins is preferred: where only the tool's pose is given there, the arm may as well begin
    on that branch. Else the change is made at the last good pose. Of the branches on which the rest keeps its distance
    within the limits, the one nearest in joint travel is taken.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep

    Returns
    -------
    found : the motion, or why there is none
    """
    bad = ~(segment.good & within(segment.robot, segment.q))
    if not bad.any():
        return fact("nothing_to_avoid")
    few = np.linspace(0.0, segment.followed.line.duration, COARSE)
    others = [_follow(segment, slot, few) for slot in range(SLOTS) if slot != segment.followed.slot[0]]
    begin = max(int(np.argmax(bad)) - 1, 0)
    for index in sorted({0, begin}):
        leave = segment.first_joints if index == 0 else segment.q[index]
        found = []
        for other in others:
            if other is not None and _keeps_clear(segment, other, segment.t[index]):
                step = other.joints(segment.t[index : index + 1])[0] - leave
                found.append((float(np.abs(step / segment.limits.speed).max()), int(other.slot[0])))
        for _, slot in sorted(found):
            times = np.union1d(avoidance.coarse(segment.t), segment.t[index])
            other = _follow(segment, slot, times)
            if other is not None and _keeps_clear(segment, other, segment.t[index]):
                return _changed(segment, other, index, leave)
    return fact("no_other_branch")


def _follow(segment: avoidance.SingularSegment, slot: int, t: Reals) -> Followed | None:
    try:
        return follow(segment.robot, segment.followed.line, t, start_slot=slot)
    except PoseError:
        return None


def _keeps_clear(segment: avoidance.SingularSegment, other: Followed, start: float) -> bool:
    rest = other.q[np.searchsorted(other.t, start) :]
    if other.jumps or np.isnan(rest[:, 0]).any() or not within(segment.robot, rest).all():
        return False
    return bool(segment.near.margin(segment.robot, rest).min() >= 1.0)


def _changed(segment: avoidance.SingularSegment, followed: Followed, index: int, leave: Reals) -> avoidance.Avoidance:
    other = avoidance.singular_segment(followed, segment.near, segment.limits)
    at = int(np.searchsorted(other.t, segment.t[index]))
    before = [*segment.begin(), segment.along(0, index)] if index > 0 else []
    waits = index == 0 and not segment.fixed_start
    change = [] if waits else [straight(leave, other.q[at], segment.limits)]
    return avoidance.Avoidance(joined([*before, *change, other.along(at, len(other.t) - 1)]), crosses_by_joints=True)


def slow(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Follow the path exactly, as programmed wherever the joints can, slower where they can't.

    Parameters
    ----------
    segment : the path; not possible where it leaves the reach, or where a branch ends

    Returns
    -------
    found : the motion within the limits of speed and acceleration, or why there is none
    """
    if np.isnan(segment.q[:, 0]).any():
        return fact("partly_out_of_reach")
    if segment.followed.jumps:
        jump = segment.followed.jumps[0]
        return fact("branch_ends", t_s=jump.t, joint=jump.joint)
    return avoidance.Avoidance(joined([*segment.begin(), segment.along(0, len(segment.t) - 1)]))


def stop(segment: avoidance.SingularSegment) -> avoidance.Avoidance | Finding:
    """Follow the path exactly, and stop at the last pose that keeps its distance.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep

    Returns
    -------
    found : the motion to that pose with the share of the path done (0 to 1), or why there is none
    """
    if not segment.regions:
        return fact("nothing_to_avoid")
    last = segment.regions[0][0] - 1
    if last < 1:
        return no_end("start", "in_region")
    motion = joined([*segment.begin(), segment.along(0, last)])
    done = float(segment.followed.line.progress(segment.t[last])[0])
    return avoidance.Avoidance(motion, done, crosses_by_joints=True)


POINTS = 2001
LENGTH = 0.001 / np.radians(1.0)  # m per rad


class HasPoses(Protocol):
    """A path of the tool in space."""

    def poses(self, progress: Reals) -> Reals:
        """Poses of the tool along the path.

        Parameters
        ----------
        progress : (...,), shares of the path, 0 to 1

        Returns
        -------
        T : (..., 4, 4), T_base_tool, m
        """


def deviation(line: HasPoses, T: Reals) -> tuple[Reals, Reals, Reals]:
    """Distance and angle of poses from the path's nearest pose, where 1 mm weighs as much as 1 deg.

    Parameters
    ----------
    T : (N, 4, 4), T_base_tool

    Returns
    -------
    distance : (N,), m; angle : (N,), rad; progress : (N,), the nearest pose's share of the path
    """
    progress = np.linspace(0.0, 1.0, POINTS)
    on_path, at = _points(line.poses(progress)), _points(T)
    _, near = scipy.spatial.cKDTree(on_path).query(at)
    middle = np.clip(near, 1, POINTS - 2)
    squares = np.stack([((at - on_path[middle + k]) ** 2).sum(axis=1) for k in (-1, 0, 1)])
    curvature = squares[0] - 2 * squares[1] + squares[2]
    offset = np.divide(squares[0] - squares[2], 2 * curvature, out=np.zeros(len(T)), where=curvature > 0)
    refined = progress[middle] + np.clip(offset, -1.0, 1.0) / (POINTS - 1)
    nearest = line.poses(refined)
    distance = np.linalg.norm(T[:, :3, 3] - nearest[:, :3, 3], axis=1)
    chord = np.linalg.norm(T[:, :3, :3] - nearest[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
    return distance, 2 * np.arcsin(np.minimum(chord, 1.0)), refined


def _points(T: Reals) -> Reals:
    return np.concatenate([T[:, :3, 3] / LENGTH, T[:, :3, :3].reshape(-1, 9) / np.sqrt(2.0)], axis=1)


STRATEGIES: dict[StrategyName, avoidance.Strategy] = {
    "slow": slow,
    "branch": branch,
    "via_shift": shifted_via,
    "via_tilt": tilted_via,
    "detour": detour,
    "stop": stop,
}
ARRIVED = 1e-3, np.radians(0.1)  # m and rad from the path's end
ON_PATH = 1e-6, np.radians(1e-4)
BETWEEN_POINTS = 1e-4  # rad or m: a curve through points at a limit may pass it by as little


@by_identity
class StrategyCost:
    """A strategy's motion, and what it costs.

    Attributes
    ----------
    done : share of the path that is done
    distance, angle : (N,), m and rad: how far the tool is from the path
    max_joint_speed_ratio, max_joint_acceleration_ratio : of a joint's speed, or acceleration, to its limit
    keeps_clear : whether the arm keeps its distance from the singular sets wherever the tool is on or beside the path
        (a joint move may pass them: joint moves are unaffected by singularities)
    """

    motion: PiecewiseMotion
    done: float
    distance: Reals
    angle: Reals
    max_joint_speed_ratio: float
    max_joint_acceleration_ratio: float
    keeps_clear: bool


@by_identity
class StrategyResult:
    """What came of a strategy.

    Attributes
    ----------
    cost : None where the strategy is not possible
    reasons : why it is not possible, or does not do the whole path within the limits of angles, speeds and
        accelerations; empty if it does
    """

    name: StrategyName
    cost: StrategyCost | None
    reasons: tuple[Finding, ...] = ()


def compare_strategies(segment: avoidance.SingularSegment, chosen: StrategyName | None = None) -> list[StrategyResult]:
    """Try all strategies on a path, or the chosen one.

    Parameters
    ----------
    segment : the path, and the distances that it is to keep
    chosen : name of one strategy; None for all

    Returns
    -------
    results : one for each strategy tried, in the order of ``STRATEGIES``
    """
    return [_tried(segment, name) for name in STRATEGIES if chosen in (None, name)]


def best(results: Iterable[StrategyResult], meets: bool, programmed: float = 0.0) -> StrategyResult | None:
    """The usable strategy with the smallest deviation from the path (mm and deg added).

    Among equals the shortest time beyond the programmed one (in steps of ``SAME_TIME``) counts. Then comes a strategy
    that keeps its distance from singular poses, then the smallest ratio of speeds and accelerations to their limits.

    Parameters
    ----------
    meets : whether the path meets a singular pose; what goes through it is then taken only if nothing else is usable
    programmed : duration of the path, s

    Returns
    -------
    result : None if no strategy is usable
    """

    def price(cost: StrategyCost) -> tuple[bool, float, int, bool, float]:
        far, turned = cost.distance.max(), cost.angle.max()
        on_path = far < ON_PATH[0] and turned < ON_PATH[1]
        away = 0.0 if on_path else float(far * 1000 + np.degrees(turned))
        ratio = max(cost.max_joint_speed_ratio, cost.max_joint_acceleration_ratio)
        longer = round(max(0.0, cost.motion.duration - programmed) / SAME_TIME)
        return meets and not cost.keeps_clear, away, longer, not cost.keeps_clear, ratio

    usable = [(price(result.cost), i, result) for i, result in enumerate(results) if result.cost and not result.reasons]
    return min(usable)[2] if usable else None


def beyond_limits(robot: Robot, motion: PiecewiseMotion, limits: JointLimits) -> list[Finding]:
    """Which limits a strategy's motion does not keep, by the judge of all motions.

    Returns
    -------
    causes : of each kind the first
    """
    over = over_limits(robot, motion, limits.rates, BETWEEN_POINTS)
    return [parts[0].cause for parts in by_kind(over).values()]


def _tried(segment: avoidance.SingularSegment, name: StrategyName) -> StrategyResult:
    try:
        found = STRATEGIES[name](segment)
    except TimingError as error:
        return StrategyResult(name, None, (error.finding,))
    if not isinstance(found, avoidance.Avoidance):
        return StrategyResult(name, None, (found,))
    robot, motion, line = segment.robot, found.motion, segment.followed.line
    q, limits = motion.joints(motion.times), segment.allowed or segment.limits
    T = forward(robot, q)
    distance, angle, _ = deviation(line, T)
    speed, acceleration = limits.ratios(motion)
    reasons: list[Finding] = []
    last = line.poses(np.array(1.0))
    left = float(np.linalg.norm(T[-1, :3, 3] - last[:3, 3]))
    twisted = 2 * np.arcsin(min(1.0, float(np.linalg.norm(T[-1, :3, :3] - last[:3, :3])) / np.sqrt(8.0)))
    if found.done < 1.0:
        reasons.append(fact("path_not_finished", done=found.done))
    elif left > ARRIVED[0] or twisted > ARRIVED[1]:
        reasons.append(fact("ends_off_path", distance_mm=left * 1000, angle_deg=np.degrees(twisted)))
    reasons += beyond_limits(robot, motion, limits)
    keeps = found.crosses_by_joints or bool(segment.near.margin(robot, q).min() > 1 - 1e-6)
    cost = StrategyCost(motion, found.done, distance, angle, speed, acceleration, keeps)
    return StrategyResult(name, cost, tuple(reasons))
