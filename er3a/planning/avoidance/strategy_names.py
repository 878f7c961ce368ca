"""The names of the strategies, apart from what they do, for settings and results."""

from __future__ import annotations

from typing import Literal

StrategyName = Literal["slow", "branch", "via_shift", "via_tilt", "damped", "detour", "stop", "planned"]
