"""How long a motion takes and how it runs, as far as a program tells: from rest to rest at even acceleration.

A controller's own ramps and blends decide the true times; these are estimates.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.planning.profiles import trapezoid
from er3a.planning.timing import JointLimits
from er3a.programs.instructions import ArmMotion, Rate

RAMP_OF_A_DURATION = 1 / 3  # of the time that a program gives for a motion, on the way up and on the way down


@dataclass(frozen=True)
class MotionLaw:
    """A trapezoid of speed.

    Attributes
    ----------
    duration : s; ramp : share of it that each ramp takes, at most 1/2
    """

    duration: float
    ramp: float

    @property
    def breaks(self) -> Reals:
        """Times (s) at which the acceleration steps."""
        ramp = self.ramp * self.duration
        return np.unique([0.0, ramp, self.duration - ramp, self.duration])

    @property
    def saved_by_blend(self) -> float:
        """Time (s) that is saved where the arm does not stop at one end."""
        return self.duration * self.ramp / 2


@dataclass(frozen=True)
class AssumedRates:
    """What is assumed where a program does not say.

    Attributes
    ----------
    tool_speed : m/s; tool_acceleration : m/s^2; joint_share : of the joints' greatest speed
    """

    tool_speed: float = 0.25
    tool_acceleration: float = 2.0
    joint_share: float = 0.1


def law_of(way: float, speed: float, acceleration: float) -> MotionLaw:
    """The trapezoid that covers a way at a speed and an acceleration, in any one unit of length."""
    if way * acceleration >= speed * speed:
        duration = way / speed + speed / acceleration
        return MotionLaw(duration, speed / acceleration / duration)
    return MotionLaw(2 * math.sqrt(way / acceleration), 0.5)


def tool_law(motion: ArmMotion, size: float, assumed: AssumedRates) -> MotionLaw:
    """The law of a line or arc; ``size`` in m, where turns count too."""
    speed, acceleration = motion.speed, motion.acceleration
    if speed is not None and speed.unit == "s" and speed.value > 0:
        return MotionLaw(speed.value, RAMP_OF_A_DURATION)
    v = _given(speed, "m/s") or assumed.tool_speed
    a = _given(acceleration, "m/s2") or assumed.tool_acceleration
    return law_of(size, v, a)


def joint_law(motion: ArmMotion, steps: Reals, limits: JointLimits, assumed: AssumedRates) -> MotionLaw:
    """The law of a joint move whose joints turn by ``steps`` (n,) in rad, all together."""
    speed, acceleration = motion.speed, motion.acceleration
    if speed is not None and speed.unit == "s" and speed.value > 0:
        return MotionLaw(speed.value, RAMP_OF_A_DURATION)
    size = np.abs(steps)
    lead = int(np.argmax(size))
    if speed is not None and speed.unit == "rad/s" and speed.value > 0:
        a = _given(acceleration, "rad/s2") or float(limits.acceleration[lead])
        return law_of(float(size[lead]), speed.value, a)
    share = _given(speed, "share") or assumed.joint_share
    quick = _given(acceleration, "share") or 1.0
    laws = [
        law_of(float(way), float(v) * share, float(a) * quick)
        for way, v, a in zip(size, limits.speed, limits.acceleration)
        if way > 0
    ]
    return max(laws, key=lambda law: law.duration)


def is_given(motion: ArmMotion) -> bool:
    """Whether a motion's speed is one that its law uses."""
    units = ("s", "rad/s", "share") if motion.kind == "joint" else ("s", "m/s")
    return motion.speed is not None and motion.speed.unit in units and motion.speed.value > 0


def progress(law: MotionLaw, t: Reals) -> tuple[Reals, Reals, Reals]:
    """Share of the way done at times (n,) in s, with its first and second derivative."""
    return trapezoid(np.clip(t, 0.0, law.duration), law.duration, law.ramp)


def _given(rate: Rate | None, unit: str) -> float | None:
    return rate.value if rate is not None and rate.unit == unit and rate.value > 0 else None
