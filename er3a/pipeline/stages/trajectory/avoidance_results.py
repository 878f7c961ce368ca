"""Strategies of singularity avoidance on a path, and its fastest time law: what the results hold of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from er3a.collision.along import clearance_along
from er3a.collision.pairs import PairOverlaps
from er3a.kinematics.forward import forward
from er3a.kinematics.near_singular import NearSingular
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.collisions import Surroundings, least_clearance
from er3a.pipeline.stages.trajectory.judgement import Judgement
from er3a.pipeline.stages.trajectory.model import FASTEST, AvoidanceRows, StrategyMotion, TriedStrategy
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.avoidance.singular_segment import SingularSegment, singular_segment
from er3a.planning.avoidance.strategies import StrategyCost, StrategyResult, best, compare
from er3a.planning.avoidance.strategy_names import StrategyName
from er3a.planning.timing import JointLimits, Timed, TimingError, fastest, nodes_along
from er3a.robots.robot import Robot
from er3a.robots.shown import shown

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
    """What all paths of a robot have in common; without ``surroundings`` clearances stay unknown.

    Attributes
    ----------
    only : the strategy that the study asks for; None to compare all
    """

    robot: Robot
    near: NearSingular
    limits: JointLimits
    only: StrategyName | None
    surroundings: Surroundings | None

    def avoid(self, motion: Motion, found: Judgement) -> Avoided:
        """Compare the strategies where a path is not safe; find its fastest time law where it can be run as it is.

        A strategy on whose motion the arm meets its surroundings or itself is not usable.
        """
        results: list[StrategyResult] = []
        if motion.followed is None:
            quickest, results = self._joint_move(motion, found)
        else:
            fixed_start = motion.built.q_start is not None
            segment = singular_segment(motion.followed, self.near, self.limits, found.events, fixed_start)
            quickest = _quickest(segment)
            if found.verdict != "safe":
                results = compare(segment, self.only)
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

    def _joint_move(self, motion: Motion, found: Judgement) -> tuple[Timed | None, list[StrategyResult]]:
        """Fastest time law; slowing down is the only strategy that a joint move can need."""
        t, q = nodes_along(motion.joints, motion.t, motion.q, self.limits)
        try:
            quickest = fastest(q, self.limits)
            if found.verdict != "too fast":
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
        if self.surroundings is None:
            return None, None
        t, q = cost.motion.t, cost.motion.q

        def joints(at: Reals) -> Reals:
            return np.stack([np.interp(at, t, q[:, j]) for j in range(q.shape[1])], axis=-1)

        grid = np.linspace(0.0, t[-1], CLEARANCE_TIMES)
        along = clearance_along(self.surroundings.bodies, joints, grid, grid, self.surroundings.tolerance)
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
        ratio = speed_ratio(timed.velocity, self.limits)
        kept = np.union1d(kept, [np.argmax(ratio)] + ([] if deviations is None else [np.argmax(deviations[0])]))
        q = timed.q[kept]
        distance, angle = deviations or (np.zeros(len(timed.t)),) * 2
        measures = conditioning(self.robot, q, characteristic_length(self.robot))
        return AvoidanceRows(
            path=np.full(len(kept), path, object),
            strategy=np.full(len(kept), strategy, object),
            t_s=timed.t[kept],
            q_deg=shown(self.robot, q),
            q_deg_s=shown(self.robot, timed.velocity[kept]),
            q_deg_s2=shown(self.robot, timed.acceleration[kept]),
            xyz_mm=forward(self.robot, q)[:, :3, 3] * 1000,
            deviation_mm=distance[kept] * 1000,
            deviation_deg=np.degrees(angle[kept]),
            speed_ratio=ratio[kept],
            condition_number=measures.condition_number,
            smallest_singular_value=measures.smallest_singular_value,
        )


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
