"""When, within a joint move, what is wrong with it begins."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from er3a.numerics.arrays import Reals
from er3a.planning.intervals import LimitSide
from er3a.program_check.motion_laws import MotionLaw, progress

PARTS, HALVINGS = 200, 50


def time_of_share(law: MotionLaw, share: float) -> float:
    """When (s) a law has done a share (0 to 1) of the way."""
    low, high = 0.0, law.duration
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        early = float(progress(law, np.array(middle))[0]) < share
        low, high = (middle, high) if early else (low, middle)
    return high


def limit_moment(law: MotionLaw, side: LimitSide, start: Reals, end: Reals) -> float:
    """When (s) a joint move between joints (n,) goes beyond a side of a limit that its end is beyond; 0 if it begins
    there."""
    before, behind, bound = float(side.of(start)), float(side.of(end)), side.sign * side.limit
    return 0.0 if before >= bound else time_of_share(law, (bound - before) / (behind - before))


def speed_moment(law: MotionLaw, share_of_greatest: float) -> float:
    """When (s) the speed comes to a share (0 to 1) of its greatest, on the ramp up."""
    return law.ramp * law.duration * share_of_greatest


def change_moment(law: MotionLaw, kind: Callable[[float], int | None]) -> float:
    """When (s) the kind of pose, by shares of the way, first is another than at the start."""
    shares = np.linspace(0.0, 1.0, PARTS + 1)
    first = kind(0.0)
    other = next((i for i, share in enumerate(shares) if kind(float(share)) not in (first, None)), PARTS)
    low, high = float(shares[other - 1]), float(shares[other])
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if kind(middle) == first else (low, middle)
    return time_of_share(law, high)
