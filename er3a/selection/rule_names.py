"""The names of the rules that rank solutions, for settings and results."""

from __future__ import annotations

from typing import Literal

RuleName = Literal["nearest", "weighted", "time", "manipulability", "limits", "clearance"]
