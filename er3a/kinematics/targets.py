"""Poses that an arm is to reach, with a name and where the arm comes from."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from er3a.numerics.arrays import Reals


@dataclass(frozen=True, eq=False)
class Target:
    """A pose of the tool.

    Attributes
    ----------
    T : (4, 4), T_base_tool, m, in the frame that the robot's base is placed in
    q_ref_deg : 6, the joint angles that the arm comes from, as they are written
    """

    name: str
    T: Reals
    note: str | None = None
    q_ref_deg: tuple[float, ...] = (0.0,) * 6

    @property
    def q_ref(self) -> Reals:
        """``q_ref_deg`` in rad, (6,)."""
        return np.radians(self.q_ref_deg)
