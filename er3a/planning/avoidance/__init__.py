"""Singularity avoidance: one module per strategy, each one function of a path with singular segments."""

from typing import Literal

StrategyName = Literal["slow", "branch", "via_shift", "via_tilt", "damped", "detour", "stop"]
