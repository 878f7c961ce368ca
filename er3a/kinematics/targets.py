"""Poses that an arm is to reach, with a name and where the arm comes from."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from er3a.by_value import ByValue
from er3a.display import Displayed, Sheet, shortly
from er3a.geometry.transforms import rpy_of
from er3a.numerics.arrays import Reals

MANY_TARGETS = 1000
"""Of more targets than these stages keep of each arm the turn that is nearest to the reference, and no others."""

TargetOutcome = Literal["reached", "unreachable", "leaves limits", "collides"]
"""Whether an admissible solution exists, or what stands against it."""


@dataclass(frozen=True, eq=False, repr=False)
class Target(ByValue, Displayed):
    """A pose of the tool.

    Attributes
    ----------
    T : (4, 4), T_base_tool, m, in the frame that the robot's base is placed in
    q_ref_deg : n, the joint values that the arm comes from, as they are written (mm of joints that slide)
    joints_before : (n,), the same in rad or m; None where all joints turn
    expect : what is to come out, where the target says so
    """

    name: str
    T: Reals
    note: str | None = None
    q_ref_deg: tuple[float, ...] = (0.0,) * 6
    expect: TargetOutcome | None = None
    joints_before: Reals | None = None

    @property
    def q_ref(self) -> Reals:
        """``q_ref_deg`` in rad, or m of joints that slide, (n,)."""
        return np.radians(self.q_ref_deg) if self.joints_before is None else self.joints_before

    def sheet(self) -> Sheet:
        """A line: name, position and roll, pitch, yaw."""
        xyz, rpy = (shortly(tuple(values.tolist())) for values in (1000 * self.T[:3, 3], np.degrees(rpy_of(self.T))))
        return Sheet(f"Target {self.name}: xyz_mm {xyz}; rpy_deg {rpy}")
