"""The ways around a path's singular regions, and its fastest time law, as records and rows of the results."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd

import er3a.pipeline.messages.collision  # noqa: F401
from er3a.collision.along import clearance_along
from er3a.collision.bodies import Bodies
from er3a.collision.pairs import PairOverlaps
from er3a.kinematics.forward import forward
from er3a.kinematics.singularity import characteristic_length, conditioning
from er3a.pipeline.messages.language import N_, joined, said
from er3a.pipeline.messages.say import say
from er3a.pipeline.stages.trajectory.judgement import Judgement, stretch_text
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.avoidance.singular_segment import Trouble, trouble_of
from er3a.planning.avoidance.strategies import Price, best, compare
from er3a.planning.timing import JointLimits, Timed, TimingError, fastest, nodes_along
from er3a.robots.robot import Robot

ROWS = 250  # of each way in the table
FASTEST = "fastest"
_PER_JOINT = [f"q{j + 1}_{unit}" for unit in ("deg", "deg_s", "deg_s2") for j in range(6)]
_MEASURES = ["deviation_mm", "deviation_deg", "speed_share", "condition_number", "smallest_singular_value"]
NUMBERS = ("t_s", *_PER_JOINT, "x_mm", "y_mm", "z_mm", *_MEASURES)
CLEARANCE_TIMES = 41
SENTENCES = {
    "slow": N_("Keep the path and slow down"),
    "branch": N_("Change to another solution of the arm first"),
    "via_shift": N_("Bend the path through a shifted via point"),
    "via_tilt": N_("Bend the path through a tilted via point"),
    "damped": N_("Let damped least squares leave the path"),
    "detour": N_("Cross the region by a joint move"),
    "stop": N_("Stop before the region with an alarm"),
}


@dataclass(frozen=True, eq=False)
class Ways:
    """What a path's entry in ``summary.json`` gains, and the rows of ``repairs.parquet``."""

    record: dict[str, Any]
    rows: list[pd.DataFrame]


@dataclass(frozen=True)
class Surroundings:
    """What motions must not meet: bodies, and the overlap (m) that may go unnoticed."""

    bodies: Bodies
    depth: float


def ways_around(
    robot: Robot,
    motion: Motion,
    found: Judgement,
    near: Mapping[str, float],
    limits: JointLimits,
    chosen: str | None,
    surroundings: Surroundings | None = None,
) -> Ways:
    """Compare the ways around where a path is not safe; find its fastest time law where it can be run as it is.

    A way on which the arm meets its surroundings or itself is not usable; without ``surroundings`` that is unknown.
    """
    prices: list[Price] = []
    if motion.followed is None:
        quickest, prices = _joint_move(motion, found, limits)
    else:
        trouble = trouble_of(motion.followed, near, limits, found.events, motion.built.q_start is not None)
        quickest = _quickest(trouble)
        if found.word != "safe":
            prices = compare(trouble, chosen)
    clearances = {}
    if surroundings:
        for i, price in enumerate(prices):
            if price.motion:
                prices[i], clearances[price.name] = _measured(price, surroundings)
    taken = best(prices, meets=any(event.crossing for event in found.events) and motion.followed is not None)
    known = found.velocity[np.isfinite(found.velocity[:, 0])] if found.speed_bounded else found.velocity[:0]
    record = {
        "max_joint_speed_ratio": float(np.abs(known / limits.speed).max()) if len(known) else None,
        "max_joint_acceleration_ratio": _pull(found, limits),
        "fastest_s": quickest and quickest.duration,
        "repairs": [_record(price) | {"clearance_mm": clearances.get(price.name)} for price in prices],
        "repair": taken and taken.name,
        "repair_text": _text(motion, found, prices, taken),
    }
    rows = [_rows(robot, motion, price.name, price.motion, price, limits) for price in prices if price.motion]
    if quickest:
        rows.append(_rows(robot, motion, FASTEST, quickest, None, limits))
    return Ways(record, rows)


def _measured(price: Price, surroundings: Surroundings) -> tuple[Price, float | None]:
    """The way, no longer usable if it meets something, and its least clearance in mm (None if nothing can meet)."""
    t, q = price.motion.t, price.motion.q

    def joints(at: np.ndarray) -> np.ndarray:
        return np.stack([np.interp(at, t, q[:, j]) for j in range(6)], axis=-1)

    grid = np.linspace(0.0, t[-1], CLEARANCE_TIMES)
    along = clearance_along(surroundings.bodies, joints, grid, grid, surroundings.depth)
    if along.least < 0:
        return price, None
    least = float(along.distance[along.least] * 1000)
    if along.contacts:
        meets = say(PairOverlaps(along.pair[along.least], -least))
        reason = joined([price.reason, meets])
        price = replace(price, usable=False, reason=reason)
    return price, least


def limits_record(robot: Robot, limits: JointLimits, full_speed_after: float) -> dict[str, Any]:
    """The joint limits that motions are timed with, and which of the speeds are assumed."""
    return {
        "speed_deg_s": [float(value) for value in np.degrees(limits.speed)],
        "speed_assumed": [bool(value) for value in ~np.isfinite(robot.speed)],
        "acceleration_deg_s2": [float(value) for value in np.degrees(limits.acceleration)],
        "full_speed_after_s": full_speed_after,
    }


def repairs_table(parts: list[pd.DataFrame]) -> pd.DataFrame:
    """The rows of all ways; an empty table where no path can be driven at all."""
    if parts:
        return pd.concat(parts, ignore_index=True)
    return pd.DataFrame({"path": [], "way": []} | {name: np.empty(0) for name in NUMBERS})


def speed_share(velocity: np.ndarray, limits: JointLimits) -> np.ndarray:
    """Greatest share of a joint's speed limit (N,), of velocities (N, 6) in rad/s; NaN where they are unknown."""
    return np.abs(velocity / limits.speed).max(axis=1)


def _pull(found: Judgement, limits: JointLimits) -> float | None:
    known = found.acceleration[np.isfinite(found.acceleration[:, 0])]
    return float(np.abs(known / limits.acceleration).max()) if found.speed_bounded and len(known) else None


def _joint_move(motion: Motion, found: Judgement, limits: JointLimits) -> tuple[Timed | None, list[Price]]:
    """Fastest time law; slowing down is the only repair that a joint move can need."""
    t, q = nodes_along(motion.joints, motion.t, motion.q, limits)
    try:
        quickest = fastest(q, limits)
        if found.word != "too fast":
            return quickest, []
        slower = fastest(q, limits, t)
    except TimingError:
        return None, []
    speed, acceleration = slower.share(limits)
    nothing = np.zeros(len(slower.t))
    return quickest, [Price("slow", slower, True, "", 1.0, nothing, nothing, speed, acceleration)]


def _quickest(trouble: Trouble) -> Timed | None:
    if np.isnan(trouble.q[:, 0]).any() or trouble.followed.jumps:
        return None
    try:
        return trouble.along(0, len(trouble.t) - 1, programmed=False)
    except TimingError:
        return None


def _record(price: Price) -> dict[str, Any]:
    record: dict[str, Any] = {"way": price.name, "usable": price.usable, "reason": price.reason}
    keys = ("done_share", "max_deviation_mm", "max_deviation_deg", "duration_s", "keeps_clear", "max_joint_speed_deg_s")
    keys += ("max_joint_speed_ratio", "max_joint_acceleration_deg_s2", "max_joint_acceleration_ratio")
    if price.motion is None:
        return record | dict.fromkeys(keys)
    values = (
        price.done,
        float(price.distance.max() * 1000),
        float(np.degrees(price.angle.max())),
        price.motion.duration,
        price.clear,
        [float(value) for value in np.degrees(np.abs(price.motion.velocity).max(axis=0))],
        price.speed,
        [float(value) for value in np.degrees(np.abs(price.motion.acceleration).max(axis=0))],
        price.acceleration,
    )
    return record | dict(zip(keys, values))


def _text(motion: Motion, found: Judgement, prices: list[Price], taken: Price | None) -> str | None:
    """One sentence: what to do about the path; None where nothing is to be done."""
    if not prices:
        return None
    if taken is not None:
        cost = {"tool": _leaves(taken), "time": _time(taken.motion.duration - motion.built.duration)}
        return said("{way}: {tool}, and {time}", way=SENTENCES[taken.name], **cost)
    if found.beyond:
        why = said("it is out of reach {when}", when=joined((stretch_text(part) for part in found.beyond), ", "))
    else:
        causes = [part.cause for part in found.limits] or [price.reason for price in prices if price.reason]
        why = joined(dict.fromkeys(causes))
    if len(prices) == 1:
        only = {"way": SENTENCES[prices[0].name], "reason": prices[0].reason}
        return said("{way}, as the study asks for, does not repair it: {reason}", **only)
    return said("No way around completes this path: {why}", why=why)


def _leaves(way: Price) -> str:
    far, turned = way.distance.max() * 1000, np.degrees(way.angle.max())
    if far < 0.005 and turned < 0.005:
        return N_("the tool stays on the path")
    if turned < 0.005:
        return said("the tool leaves the path by {far:.2g} mm", far=far)
    if far < 0.005:
        return said("the tool leaves the path by {turned:.2g} deg", turned=turned)
    return said("the tool leaves the path by {far:.2g} mm and {turned:.2g} deg", far=far, turned=turned)


def _time(longer: float) -> str:
    if abs(longer) < 0.005:
        return N_("it takes no more time than programmed")
    if longer > 0:
        return said("it takes {longer:.2f} s more than programmed", longer=longer)
    return said("it takes {shorter:.2f} s less than programmed", shorter=-longer)


def _rows(
    robot: Robot, motion: Motion, name: str, timed: Timed, price: Price | None, limits: JointLimits
) -> pd.DataFrame:
    """At most ROWS rows of a way: its motion, its tool and its deviation."""
    kept = np.unique(np.linspace(0, len(timed.t) - 1, min(ROWS, len(timed.t))).round().astype(int))
    share = speed_share(timed.velocity, limits)
    kept = np.union1d(kept, [np.argmax(share)] + ([] if price is None else [np.argmax(price.distance)]))
    q = timed.q[kept]
    tool = forward(robot, q)[:, :3, 3] * 1000
    columns: dict[str, Any] = {"path": motion.entry.name, "way": name, "t_s": timed.t[kept]}
    for values, unit in ((q, "deg"), (timed.velocity[kept], "deg_s"), (timed.acceleration[kept], "deg_s2")):
        columns |= {f"q{j + 1}_{unit}": np.degrees(values[:, j]) for j in range(6)}
    columns |= {f"{axis}_mm": tool[:, k] for k, axis in enumerate("xyz")}
    none = np.zeros(len(kept))
    measures = conditioning(robot, q, characteristic_length(robot))
    columns |= {
        "deviation_mm": none if price is None else price.distance[kept] * 1000,
        "deviation_deg": none if price is None else np.degrees(price.angle[kept]),
        "speed_share": share[kept],
        "condition_number": measures.condition_number,
        "smallest_singular_value": measures.smallest_singular_value,
    }
    return pd.DataFrame(columns)
