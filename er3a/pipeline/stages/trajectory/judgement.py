"""What is wrong with a motion, where, and the verdict on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.kinematics.near_singular import NearSingular
from er3a.numerics.arrays import Reals
from er3a.pipeline.stages.trajectory.motion import Motion
from er3a.planning.intervals import (
    AboveLimit,
    BelowLimit,
    Interval,
    PathOutOfReach,
    TooFast,
    out_of_limits,
    too_fast,
    unreachable,
)
from er3a.planning.path_verdicts import PathVerdict
from er3a.planning.singular_events import SingularEvent, singular_events
from er3a.robots.robot import Robot

SPEED_STEP = 1e-5  # share of the duration


@dataclass(frozen=True, eq=False)
class Judgement:
    """A motion's faults, collisions apart.

    Attributes
    ----------
    times, q, velocity, acceleration : (N,) s and (N, 6) in rad, rad/s, rad/s^2 at all points checked
    speed_bounded : False where the exact path needs a joint speed without bound
    velocity_check : rad/s, greatest difference between velocities through the Jacobian and by differences of angles
    """

    verdict: PathVerdict
    events: list[SingularEvent]
    limits: list[Interval[AboveLimit | BelowLimit]]
    beyond: list[Interval[PathOutOfReach]]
    fast: list[Interval[TooFast]]
    times: Reals
    q: Reals
    velocity: Reals
    acceleration: Reals
    speed_bounded: bool
    velocity_check: float


def judge(robot: Robot, motion: Motion, near: NearSingular) -> Judgement:
    """Check a motion at its check points, at its closest passes, and at what lies between by root finding.

    Parameters
    ----------
    near : distances below which a pass counts as near-singular
    """
    events = singular_events(robot, motion.t, motion.q, motion.joints, near)
    times = np.unique(np.concatenate([motion.checks, [event.t for event in events]]))
    q, velocity, acceleration = motion.rates(times)
    limits = out_of_limits(robot, motion.t, motion.q, motion.joints)
    beyond = unreachable(motion.followed) if motion.followed else []
    fast = too_fast(robot, times, velocity, lambda t: motion.rates(t)[1])
    jumps = motion.followed.jumps if motion.followed else ()
    edge = any(interval.start > 0 or interval.end < times[-1] for interval in beyond)
    bounded = not edge and not jumps and not (np.isfinite(q[:, 0]) & np.isnan(velocity[:, 0])).any()
    verdict: PathVerdict = "safe"
    if beyond:
        verdict = "unreachable"
    elif limits:
        verdict = "leaves limits"
    elif fast:
        verdict = "too fast"
    elif motion.followed and (jumps or any(event.crossing for event in events)):
        verdict = "singular"
    elif motion.followed and events:
        verdict = "near-singular"
    return Judgement(
        verdict=verdict,
        events=events,
        limits=limits,
        beyond=beyond,
        fast=fast,
        times=times,
        q=q,
        velocity=velocity,
        acceleration=acceleration,
        speed_bounded=bool(bounded),
        velocity_check=_velocity_check(motion),
    )


def _velocity_check(motion: Motion) -> float:
    step = SPEED_STEP * motion.built.duration
    inner = motion.samples[1:-1]
    if not inner.size:
        return 0.0
    slope = (motion.joints(inner + step) - motion.joints(inner - step)) / (2 * step)
    difference = np.abs(slope - motion.rates(inner)[1])
    return float(np.nanmax(difference)) if np.isfinite(difference).any() else 0.0
