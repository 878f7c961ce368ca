"""All strategies of singularity avoidance side by side: what each costs, and which one to take."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from er3a.kinematics.forward import forward
from er3a.numerics.arrays import Reals
from er3a.planning.avoidance.avoidance_findings import (
    AccelerationExceeded,
    EndsOffPath,
    NotPossible,
    PathNotFinished,
    SpeedExceeded,
)
from er3a.planning.avoidance.damped_least_squares import damped
from er3a.planning.avoidance.deviation import deviation
from er3a.planning.avoidance.joint_detour import detour
from er3a.planning.avoidance.other_branch import branch
from er3a.planning.avoidance.singular_segment import Avoidance, SingularSegment, Strategy
from er3a.planning.avoidance.slow_down import slow
from er3a.planning.avoidance.stop_before import stop
from er3a.planning.avoidance.strategy_names import StrategyName
from er3a.planning.avoidance.via_point import shifted_via, tilted_via
from er3a.planning.timing import Timed, TimingError
from er3a.planning.way_around import NoWayAround
from er3a.robots.joint_limits import LimitsExceeded, limits_exceeded

STRATEGIES: dict[StrategyName, Strategy] = {
    "slow": slow,
    "branch": branch,
    "via_shift": shifted_via,
    "via_tilt": tilted_via,
    "damped": damped,
    "detour": detour,
    "stop": stop,
}
ARRIVED = 1e-3, np.radians(0.1)  # m and rad from the path's end
ON_PATH = 1e-6, np.radians(1e-4)
OVER = 1e-6  # relative, by which rounding may exceed a limit

NotUsable = (
    NotPossible | PathNotFinished | EndsOffPath | LimitsExceeded | SpeedExceeded | AccelerationExceeded | NoWayAround
)


@dataclass(frozen=True, eq=False)
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

    motion: Timed
    done: float
    distance: Reals
    angle: Reals
    max_joint_speed_ratio: float
    max_joint_acceleration_ratio: float
    keeps_clear: bool


@dataclass(frozen=True, eq=False)
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
    reasons: tuple[NotUsable, ...] = ()


def compare(segment: SingularSegment, chosen: StrategyName | None = None) -> list[StrategyResult]:
    """Try all strategies, or the chosen one."""
    return [_tried(segment, name) for name in STRATEGIES if chosen in (None, name)]


def best(results: Iterable[StrategyResult], meets: bool) -> StrategyResult | None:
    """Of the usable strategies the one that leaves the path least (mm and deg added), then the quickest; else None.

    Parameters
    ----------
    meets : whether the path meets a singular pose; what goes through it is then taken only if nothing else is usable
    """

    def price(cost: StrategyCost) -> tuple[bool, float, float]:
        far, turned = cost.distance.max(), cost.angle.max()
        on_path = far < ON_PATH[0] and turned < ON_PATH[1]
        away = 0.0 if on_path else float(far * 1000 + np.degrees(turned))
        return meets and not cost.keeps_clear, away, cost.motion.duration

    usable = [(price(result.cost), i, result) for i, result in enumerate(results) if result.cost and not result.reasons]
    return min(usable)[2] if usable else None


def _tried(segment: SingularSegment, name: StrategyName) -> StrategyResult:
    try:
        found = STRATEGIES[name](segment)
    except TimingError as error:
        return StrategyResult(name, None, (error.finding,))
    if not isinstance(found, Avoidance):
        return StrategyResult(name, None, (found,))
    robot, motion, line = segment.robot, found.motion, segment.followed.line
    T = forward(robot, motion.q)
    distance, angle, _ = deviation(line, T)
    speed, acceleration = motion.ratios(segment.allowed or segment.limits)
    reasons: list[NotUsable] = []
    last = line.poses(np.array(1.0))
    left = float(np.linalg.norm(T[-1, :3, 3] - last[:3, 3]))
    twisted = 2 * np.arcsin(min(1.0, float(np.linalg.norm(T[-1, :3, :3] - last[:3, :3])) / np.sqrt(8.0)))
    if name == "stop":
        reasons.append(PathNotFinished(found.done))
    elif left > ARRIVED[0] or twisted > ARRIVED[1]:
        reasons.append(EndsOffPath(left * 1000, float(np.degrees(twisted))))
    worst = np.argmax(np.maximum(motion.q - robot.upper, robot.lower - motion.q).max(axis=1))
    if exceeded := limits_exceeded(robot, motion.q[worst]):
        reasons.append(exceeded)
    if speed > 1 + OVER:
        reasons.append(SpeedExceeded(speed))
    if acceleration > 1 + OVER:
        reasons.append(AccelerationExceeded(acceleration))
    keeps = name in ("stop", "detour", "branch") or bool(segment.near.margin(robot, motion.q).min() > 1 - 1e-6)
    cost = StrategyCost(motion, found.done, distance, angle, speed, acceleration, keeps)
    return StrategyResult(name, cost, tuple(reasons))
