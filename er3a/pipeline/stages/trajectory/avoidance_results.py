"""Strategies of singularity avoidance on a path, and its fastest time law: what the results hold of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from er3a.collision.along import ClearanceAlong, clearance_along
from er3a.collision.pairs import PairOverlaps
from er3a.kinematics.forward import forward
from er3a.kinematics.inverse import inverse
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.collisions import Surroundings, least_clearance
from er3a.pipeline.stages.trajectory.judgement import Judgement
from er3a.pipeline.stages.trajectory.model import FASTEST, AvoidanceRows, StrategyMotion, TriedStrategy
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.avoidance.deviation import deviation
from er3a.planning.avoidance.singular_segment import SingularSegment, singular_segment
from er3a.planning.avoidance.strategies import StrategyCost, StrategyResult, best, compare
from er3a.planning.avoidance.strategy_names import StrategyName
from er3a.planning.timing import JointLimits, Timed, TimingError, fastest, nodes_along
from er3a.planning.way_around import PlanningTask, WayAround, way_between
from er3a.robots.joint_limits import within
from er3a.robots.robot import Robot
from er3a.robots.shown import shown

LEAST_RATIO = 1e-3  # of the limits, below which a path counts as standing still
ROWS = 250  # of each motion in the table
CLEARANCE_TIMES = 41


@dataclass(frozen=True, eq=False)
class Avoided:
    """What was tried on a path, and what to take.

    Attributes
    ----------
    fastest_s : duration of the path itself as fast as the joints can; None where no motion follows it
    """

    tried: tuple[TriedStrategy, ...]
    chosen: StrategyName | None
    fastest_s: float | None
    rows: AvoidanceRows


@dataclass(frozen=True)
class AvoidanceTask:
    """What all paths of a robot have in common.

    Attributes
    ----------
    only : the strategy that the study asks for; None to compare all
    """

    robot: Robot
    near: NearSingular
    limits: JointLimits
    only: StrategyName | None
    surroundings: Surroundings
    planning: PlanningTask

    def avoid(self, motion: Motion, found: Judgement, along: ClearanceAlong) -> Avoided:
        """Compare the strategies where a path is not safe; find its fastest time law where it can be run as it is.

        A strategy on whose motion the arm meets its surroundings or itself is not usable. Where the path keeps the
        joints' limits of rates, strategies are timed to need no more of them than the path does, so that none is worse
        than what it mends. Where it collides or can't be run at all, a motion is planned between its ends.
        """
        results: list[StrategyResult] = []
        if motion.followed is None:
            quickest, results = self._joint_move(motion, found)
        else:
            fixed_start = motion.built.q_start is not None
            segment = singular_segment(motion.followed, self.near, self.limits, found.events, fixed_start)
            quickest = _quickest(segment)
            if found.verdict != "safe":
                results = compare(replace(segment, limits=self._no_more_than(found), allowed=self.limits), self.only)
        collides = bool(along.contacts)
        if (collides or found.beyond or found.limits) and motion.no_way is None and self.only in (None, "planned"):
            results += self._planned(motion)
        met = {result.name: self._meets(result.cost) for result in results if result.cost}
        free = [result for result in results if result.name not in met or met[result.name][0] is None]
        meets = motion.followed is not None and any(event.crossing for event in found.events)
        chosen = best(free, meets)
        tried = tuple(_tried(result, *met.get(result.name, (None, None))) for result in results)
        return Avoided(
            tried=tried,
            chosen=chosen.name if chosen else None,
            fastest_s=quickest.duration if quickest else None,
            rows=AvoidanceRows.stacked(self._tables(motion, results, quickest)),
        )

    def _no_more_than(self, found: Judgement) -> JointLimits:
        """The limits, or what of them the path needs if that is less."""
        if found.fast or found.greatest_speed is None or found.greatest_acceleration is None:
            return self.limits
        speed = float((found.greatest_speed / self.limits.speed).max())
        acceleration = float((found.greatest_acceleration / self.limits.acceleration).max())
        speed, acceleration = (min(1.0, max(ratio, LEAST_RATIO)) for ratio in (speed, acceleration))
        return replace(
            self.limits, speed=self.limits.speed * speed, acceleration=self.limits.acceleration * acceleration
        )

    def _planned(self, motion: Motion) -> list[StrategyResult]:
        """The planner's motion between the ends of a path, where both can be reached."""
        tool = motion.tool(np.array([0.0, motion.built.duration]))
        ends = [self._end(q, T) for q, T in zip(motion.q[[0, -1]], tool)]
        found = way_between(self.planning, *ends)
        if not isinstance(found, WayAround):
            return [StrategyResult("planned", None, (found,))]
        timed = found.motion
        path = motion.built.tool or _ToolWay(motion)
        distance, angle, _ = deviation(path, forward(self.robot, timed.q))
        cost = StrategyCost(timed, 1.0, distance, angle, *timed.ratios(self.limits), keeps_clear=True)
        return [StrategyResult("planned", cost)]

    def _end(self, q: Reals, T: Reals) -> Reals:
        """Joint angles (k, n) within the limits at an end of a path: its own, else others that reach the pose."""
        if np.isfinite(q).all() and within(self.robot, q):
            return q[None]
        solved = inverse(self.robot, T, self_motion_rows=True)
        return solved.q[solved.within_limits]

    def _joint_move(self, motion: Motion, found: Judgement) -> tuple[Timed | None, list[StrategyResult]]:
        """Fastest time law; slowing down is the only strategy that a joint move can need."""
        t, q = nodes_along(motion.joints, motion.t, motion.q, self.limits)
        try:
            quickest = fastest(q, self.limits)
            if not found.fast:
                return quickest, []
            slower = fastest(q, self.limits, t)
        except TimingError:
            return None, []
        speed, acceleration = slower.ratios(self.limits)
        nothing = np.zeros(len(slower.t))
        return quickest, [
            StrategyResult("slow", StrategyCost(slower, 1.0, nothing, nothing, speed, acceleration, False))
        ]

    def _meets(self, cost: StrategyCost) -> tuple[PairOverlaps | None, float | None]:
        """The deepest overlap on a motion, and its least clearance in mm (None if nothing can meet)."""
        curve = cost.motion.curve
        grid = np.linspace(0.0, curve.duration, CLEARANCE_TIMES)
        along = clearance_along(
            self.surroundings.bodies, curve.joints, curve.rate_bounds, grid, grid, self.surroundings.tolerance
        )
        least = least_clearance(along)
        if least is None:
            return None, None
        return PairOverlaps(least.between, -least.least_mm) if along.contacts else None, least.least_mm

    def _tables(self, motion: Motion, results: list[StrategyResult], quickest: Timed | None) -> Iterator[AvoidanceRows]:
        for result in results:
            if result.cost:
                deviations = (result.cost.distance, result.cost.angle)
                yield self._rows(motion.entry.name, result.name, result.cost.motion, deviations)
        if quickest:
            yield self._rows(motion.entry.name, FASTEST, quickest, None)

    def _rows(self, path: str, strategy: str, timed: Timed, deviations: tuple[Reals, Reals] | None) -> AvoidanceRows:
        """At most ROWS rows of a motion, and those of its greatest speed and deviation."""
        kept = np.unique(np.linspace(0, len(timed.t) - 1, min(ROWS, len(timed.t))).round().astype(int))
        kept = kept if deviations is None else np.union1d(kept, [np.argmax(deviations[0])])
        times = np.union1d(timed.t[kept], [self._fastest_time(timed)])
        q, velocity, acceleration = timed.curve.rates(times)
        distance, angle = (np.interp(times, timed.t, part) for part in deviations or (np.zeros(len(timed.t)),) * 2)
        measures = conditioning(self.robot, q, characteristic_length(self.robot))
        return AvoidanceRows(
            path=np.full(len(times), path, object),
            strategy=np.full(len(times), strategy, object),
            t_s=times,
            q_deg=shown(self.robot, q),
            q_deg_s=shown(self.robot, velocity),
            q_deg_s2=shown(self.robot, acceleration),
            xyz_mm=forward(self.robot, q)[:, :3, 3] * 1000,
            deviation_mm=distance * 1000,
            deviation_deg=np.degrees(angle),
            speed_ratio=speed_ratio(velocity, self.limits),
            condition_number=measures.condition_number,
            smallest_singular_value=measures.smallest_singular_value,
        )

    def _fastest_time(self, timed: Timed) -> float:
        """When a joint comes nearest to its greatest speed."""
        curve = timed.curve
        j = int(np.argmax(timed.greatest[0] / self.limits.speed))
        return max(curve.of_joint(curve.velocity, j, sign).peak() for sign in (1.0, -1.0))[1]


@dataclass(frozen=True, eq=False)
class _ToolWay:
    """The way of the tool on a move of the joints."""

    motion: Motion

    def poses(self, progress: Reals) -> Reals:
        """T_base_tool (..., 4, 4) at shares of the time (...,)."""
        return self.motion.tool(np.asarray(progress) * self.motion.built.duration)


def speed_ratio(velocity: Reals, limits: JointLimits) -> Reals:
    """Greatest ratio of a joint's speed to its limit (N,), of velocities (N, 6) in rad/s; NaN where unknown."""
    ratio: Reals = np.abs(velocity / limits.speed).max(axis=1)
    return ratio


def _quickest(segment: SingularSegment) -> Timed | None:
    if np.isnan(segment.q[:, 0]).any() or segment.followed.jumps:
        return None
    try:
        return segment.along(0, len(segment.t) - 1, programmed=False)
    except TimingError:
        return None


def _tried(result: StrategyResult, meets: PairOverlaps | None, clearance_mm: float | None) -> TriedStrategy:
    reasons = (*result.reasons, meets) if meets else result.reasons
    motion = _motion(result.cost, clearance_mm) if result.cost else None
    return TriedStrategy(result.name, motion is not None and not reasons, reasons, motion)


def _motion(cost: StrategyCost, clearance_mm: float | None) -> StrategyMotion:
    return StrategyMotion(
        done_ratio=cost.done,
        max_deviation_mm=float(cost.distance.max() * 1000),
        max_deviation_deg=float(np.degrees(cost.angle.max())),
        duration_s=cost.motion.duration,
        keeps_clear=cost.keeps_clear,
        max_joint_speed_deg_s=_greatest_deg(cost.motion.velocity),
        max_joint_speed_ratio=cost.max_joint_speed_ratio,
        max_joint_acceleration_deg_s2=_greatest_deg(cost.motion.acceleration),
        max_joint_acceleration_ratio=cost.max_joint_acceleration_ratio,
        clearance_mm=clearance_mm,
    )


def _greatest_deg(values: Reals) -> tuple[float, ...]:
    """Of each joint, from (N, 6) in rad."""
    return tuple(float(value) for value in np.degrees(np.abs(values).max(axis=0)))
